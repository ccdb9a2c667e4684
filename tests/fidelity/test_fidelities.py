"""Fidelities: what they change, by what they are recognised, how a study file names one."""

import re

import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity.fidelities import (
    FIDELITIES,
    FLAT,
    LOCAL,
    OWN_NUMBERS,
    Fidelity,
    Rung,
    fidelity_of,
    named,
)
from orchestrator.lab.ladder import RUNGS
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed, value_of
from tests.fidelity.conftest import MakePile

PACKINGS = ("aligned", "horizontal", "disordered", "poured")
STATIC = named("static")


def _named(name: str, bed: str = "", more: str = "") -> Scene:
    text = f"""
        grain.diameter = 1e-3
        bed = {{ kind = "pile", slope_deg = 15.0{bed} }}
        method.fidelity = "{name}"
        {more}
    """
    (scene,) = study.parse(text, name="one", where="one").scenes
    return scene


@pytest.mark.parametrize("packing", PACKINGS)
@pytest.mark.parametrize("one", FIDELITIES, ids=lambda one: one.name)
def test_an_answer_has_its_fidelity_and_asks_the_same(
    one: Fidelity, packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    answer = one.answer(scene)
    found = fidelity_of(answer)
    assert found.answer(scene) == answer
    # level rows and poured beds are peeled by quick, too
    assert found is one or (found.name, one.name) == ("static", "quick")
    assert (answer.fluid, answer.forces) == (scene.fluid, scene.forces)
    assert answer.bed.slope_deg == scene.bed.slope_deg
    assert answer.threshold.fractions == scene.threshold.fractions


@pytest.mark.parametrize("name", [one.name for one in FIDELITIES])
@pytest.mark.parametrize("packing", PACKINGS)
def test_a_study_file_names_a_fidelity(name: str, packing: str) -> None:
    """It is the scene whose file writes all of its numbers."""
    scene = _named(name, f', packing = "{packing}"')
    one = named(name)
    assert one.describes(scene)
    numbers = {**one.flow.fields(scene), **one.grains.fields(scene)}
    spelt = changed(_named("auto", f', packing = "{packing}"'), numbers)
    assert spelt == scene


def test_a_number_that_a_file_writes_stands_before_that_of_the_fidelity() -> None:
    scene = _named("quick", "", "method.flow.cells_per_face = 80")
    assert scene.method.kind == "pivot"
    assert scene.method.flow.cells_per_face == 80
    assert fidelity_of(scene) is OWN_NUMBERS
    scene = _named("standard", "", "method.grains.load_increment = 0.05")
    assert scene.method.kind == "dem"
    assert scene.method.grains.load_increment == 0.05
    assert fidelity_of(scene) is OWN_NUMBERS


@pytest.mark.parametrize(
    "asked",
    ['method.kind = "pivot"', 'method.kind = "peeling"', "method.fidelity = 'quick'"],
)
def test_load_steps_are_refused_where_the_file_names_a_method_without(
    asked: str,
) -> None:
    """A tolerance keeps such a method; one that is left open may become DEM."""
    text = """
        tolerance = 0.02
        grain.diameter = 1e-3
        bed = { kind = "pile", slope_deg = 15.0 }
        method.grains.load_increment = 0.05
    """
    with pytest.raises(
        InputError, match="load_increment: it has an effect on DEM alone"
    ):
        study.parse(f"{text}\n{asked}", name="one", where="one")
    (scene,) = study.parse(text, name="one", where="one").scenes
    assert scene.method.grains.load_increment == 0.05


def test_fidelities_are_an_axis() -> None:
    text = """
        grain.diameter = 1e-3
        bed = { kind = "pile", slope_deg = 15.0 }
        [axes]
        "method.fidelity" = ["quick", "paper", "reference"]
    """
    scenes = study.parse(text, name="three", where="three").scenes
    assert [fidelity_of(scene).name for scene in scenes] == [
        "quick",
        "paper",
        "reference",
    ]


def test_a_level_bed_and_a_single_grain_take_what_concerns_them() -> None:
    text = 'grain.diameter = 1e-3\nbed = { kind = "pile", shape = "flat" }\n'
    (level,) = study.parse(
        text + 'method.fidelity = "paper"', name="one", where="one"
    ).scenes
    assert level.method.flow.model == "flat"
    assert level.method.grains.mobile_layers == 1
    text = 'grain.diameter = 1e-3\nbed.kind = "grain"\nmethod.fidelity = "reference"'
    (grain,) = study.parse(text, name="one", where="one").scenes
    assert grain.method.kind == "dem"
    assert grain.method.grains.load_increment == 0.004


def test_a_fidelity_that_does_not_exist_or_not_there_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"'fast' is no fidelity \(write one of auto, quick, static"
    ):
        _named("fast")
    strip = ', packing = "poured", width = 6.0'
    with pytest.raises(
        InputError, match=r"static does not answer a poured bed in space"
    ):
        _named("static", strip)
    assert _named("paper", strip).bed == _named("standard", strip).bed


def test_the_numbers_of_a_file_that_names_none_are_those_of_standard(
    pile: MakePile,
) -> None:
    for packing in PACKINGS:
        text = f"""
            grain.diameter = 1e-3
            bed = {{ kind = "pile", slope_deg = 15.0, packing = "{packing}" }}
            method.kind = "dem"
        """
        (scene,) = study.parse(text, name="one", where="one").scenes
        assert fidelity_of(scene) is named("standard")


def test_the_flow_over_fine_sand_has_a_roughness_of_its_own(pile: MakePile) -> None:
    water = {"fluid.density": 1000.0, "fluid.viscosity": 1e-6, "grain.density": 2650.0}
    fine, coarse = (
        pile({**water, "grain.diameter": d}, roughness=d / 30) for d in (2e-4, 3e-3)
    )
    ustar = float(closed_form(fine).friction_velocity)
    own = STATIC.answer(fine).method.flow.roughness
    assert own == pytest.approx(2e-4 / 30 + 1e-6 / (9 * ustar), rel=5e-3)
    # over a rough bed, and by Eqs. 2 and 4, it is the bed's
    assert STATIC.answer(coarse).method.flow.roughness is None
    by_eq_2 = changed(fine, {"forces.law": "low"})
    assert STATIC.answer(by_eq_2).method.flow.roughness is None
    assert FLAT.changes(fine) == {"method.flow.model": "flat"}


def test_a_long_bed_by_the_closed_form_is_recognised(pile: MakePile) -> None:
    assert fidelity_of(pile({"method.kind": "local"})) is LOCAL


@pytest.mark.parametrize(
    "field",
    ["method.flow.expansion_ration", "method.grains.stiffness", "nothing", "flow"],
)
def test_a_scene_is_changed_in_fields_that_exist(field: str, pile: MakePile) -> None:
    with pytest.raises(InputError, match=rf"changed: {re.escape(field)}"):
        changed(pile(), {field: -1.0})


@pytest.mark.parametrize(
    ("fields", "is_taken"),
    [
        ({}, True),
        ({"bed.shape": "step up"}, True),
        ({"flow.top": "open water", "flow.depth": 0.1}, False),
        ({"bed.obstacles": [{"kind": "fence", "x": -0.1, "height": 0.01}]}, False),
    ],
)
def test_the_theory_takes_the_flows_that_it_knows(
    fields: dict[str, object], is_taken: bool, pile: MakePile
) -> None:
    waves = next(rung for rung in RUNGS["flow"] if rung.name == "waves")
    assert waves.takes(pile(fields)) is is_taken


@pytest.mark.parametrize("rung", [rung for part in RUNGS.values() for rung in part])
def test_a_rung_describes_what_it_made(rung: Rung, pile: MakePile) -> None:
    for packing in PACKINGS:
        scene = pile(packing=packing)
        if not rung.takes(scene):
            continue
        made = changed(scene, rung.fields(scene))
        assert rung.describes(made)
        for name, value in rung.fields(scene).items():
            assert value_of(made, name) == value
