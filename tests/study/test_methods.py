"""Threshold methods, flow models and shapes: what is asked of their objects."""

import numpy as np
import pytest

from orchestrator.flow import model
from orchestrator.grains import methods
from orchestrator.grains.pile import Pile
from orchestrator.study.methods import METHODS
from orchestrator.study.models import MODELS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.scopes import APPLIES
from orchestrator.study.shapes import SHAPES
from orchestrator.study.study import parse

PILE = """
grain = {{ diameter = 1e-3 }}
bed = {{ kind = "triangle", slope_deg = 20.0, height = 0.04 }}
method.kind = "{method}"
method.flow.model = "{model}"
"""


def _scene(method: str = "dem", model: str = "solve") -> Scene:
    """A pile by a method under a flow model."""
    text = PILE.format(method=method, model=model)
    (scene,) = parse(text, name="pile", where="pile").scenes
    return scene


def test_each_method_and_each_model_of_a_study_file_has_its_class() -> None:
    assert set(methods.METHODS) == set(METHODS.values())
    assert set(model.MODELS) == set(MODELS.values())


@pytest.mark.parametrize("name", METHODS)
def test_numbers_of_contacts_and_load_steps_are_of_methods_that_have_them(
    name: str,
) -> None:
    scene = _scene(method=name)
    method = METHODS[name]
    assert scene.method.facts is method
    assert APPLIES["DEM of piles"](scene) == method.is_resolved_in_time
    assert APPLIES["DEM and peeling"](scene) == method.has_contacts
    runs = Pile(scene).method.cases
    assert bool(runs) == method.needs_run


def test_an_open_method_has_the_fields_of_all_that_may_be_chosen() -> None:
    scene = _scene(method="auto")
    assert scene.method.candidates == tuple(METHODS.values())
    assert APPLIES["DEM of piles"](scene)
    assert APPLIES["DEM and peeling"](scene)
    assert not scene.method.is_resolved_in_time


@pytest.mark.parametrize("name", MODELS)
def test_a_model_has_a_run_if_its_flow_is_solved(name: str) -> None:
    scene = _scene(model=name)
    assert bool(model.of_scene(scene).cases) == MODELS[name].is_solved
    assert APPLIES["solved flows"](scene) == MODELS[name].is_solved


@pytest.mark.parametrize("name", SHAPES)
def test_the_corners_of_a_shape_agree_with_its_facts(name: str) -> None:
    shape = SHAPES[name]
    slope = ", slope_deg = 20.0" if shape.rises else ""
    text = f"""
grain = {{ diameter = 1e-3 }}
bed = {{ kind = "{name}", height = 0.1{slope} }}
"""
    (scene,) = parse(text, name="bed", where="bed").scenes
    assert isinstance(scene.bed, PileBed)
    heights = shape.corners(scene.bed)[:, 1]
    assert (np.ptp(heights) == 0) == shape.is_level
    assert (heights.max() > 0) == shape.rises
    # a curve has many chords; straight faces meet in one edge
    assert (len(heights) > 10) == shape.is_curved
    assert (len(heights) == 3 and heights[-1] == 0) == shape.is_wedge
