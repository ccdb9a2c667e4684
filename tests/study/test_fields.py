"""The registry: every field has its words and its range, tells scenes apart, is documented."""

import runpy
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic.fields import FieldInfo

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.lab.ladder import RUNGS
from orchestrator.study import fields, scopes, study
from orchestrator.study.fields import Quantity
from orchestrator.study.parts import Gusts, LogNormal, PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.tables import meanings
from orchestrator.tables.scenes import method_rows, scene_rows

PAGE = Path(__file__).parents[2] / "docs" / "study-file.md"
REFERENCE = runpy.run_path(str(PAGE.with_name("study_file.py")))
PILE = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", slope_deg = 15.0, packing = "disordered" }
forces = { law = "high" }
"""
UNCHANGEABLE = (
    "bed.kind",
    "threshold.fractions",
    "bed.profile",
    "bed.smoothing",
    "bed.obstacles",
    "flow.towards",  # with the profile that is read
    "method.flow.between",  # chosen within a tolerance alone
)
NEEDED: dict[str, dict[str, Any]] = {
    "bed.windward": {"bed.shape": "dune"},
    "bed.brink_radius": {"bed.shape": "dune"},
    "bed.lee_slope_deg": {"bed.lee_slope_deg": 20.0},
    "bed.length": {"bed.shape": "trapezoid", "bed.length": 0.1},
    "bed.spacing": {"bed.forms": 3, "bed.spacing": 0.5},
    "bed.counted": {"bed.counted": "windward"},
    "bed.width": {"bed.packing": "poured", "bed.width": 5.0},
    "bed.dropped_grains": {
        "bed.packing": "poured",
        "bed.shape": "flat",
        "bed.slope_deg": 0.0,
        "bed.width": 5.0,
        "flow.gusts": {"intensity": 0.4, "events": 100},
        "forces.law": "bridged",
        "method.kind": "dem",
        "threshold.criterion": "sustained",
    },
    "flow.top": {"flow.top": "open water", "flow.depth": 1.0},
    "flow.depth": {"flow.top": "open water", "flow.depth": 1.0},
    "flow.gusts": {"method.kind": "pivot"},
    "grain.cohesion": {"method.kind": "pivot"},
}
"""Other fields that a scene must have for a field to have an effect."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A scene on which every field has an effect."""
    return study.parse(PILE, name="test", where="test").scenes[0]


def declaration(quantity: Quantity) -> FieldInfo:
    part, _, name = quantity.name.rpartition(".")
    return fields.PARTS[part].model_fields[name]


def other_value(quantity: Quantity, scene: Scene) -> Any:
    value = quantity.used(scene)
    if quantity.name == "grain.sizes":
        return LogNormal(sigma_g=1.3)
    if quantity.name == "flow.gusts":
        return Gusts(intensity=0.4, events=100)
    if quantity.name == "fluid.kind":
        return None  # a fluid by its numbers
    if isinstance(value, str):
        words = quantity.info.choices or get_args(declaration(quantity).annotation)
        return next(word for word in words if word not in (value, "paper"))
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else 0.95 * value or 0.5


def in_tables(scenes: tuple[Scene, ...], *but: str) -> list[list[Any]]:
    """The columns of scenes in the tables but for those that follow from others."""
    rows = []
    for each in scenes:
        row = {**fields.used(each), "asked": fields.written(each)}
        rows.append([row[column] for column in [*fields.others(row, *but), "asked"]])
    return rows


@pytest.mark.parametrize("quantity", fields.FIELDS, ids=lambda quantity: quantity.name)
def test_each_field_has_its_words_and_its_range(quantity: Quantity) -> None:
    assert quantity.info.label
    assert quantity.meaning
    declared = declaration(quantity)
    if not {float, int}.intersection(
        (declared.annotation, *get_args(declared.annotation))
    ):
        return
    low, high = REFERENCE["bounds"](declared)
    assert (low[0] in "[(", high[-1] in "])") == (True, True)
    part, _, name = quantity.name.rpartition(".")
    base: dict[str, dict[str, Any]] = {
        "grain": {"diameter": 1e-3},
        "bed": {"kind": "pile"},
    }
    for value in (-1, 10**18) if declared.annotation is int else (-1e-320, 1e308):
        parts = {key: {**base.get(key, {})} for key in fields.PARTS}
        parts[part][name] = value
        with pytest.raises(
            InputError, match=rf"test: {quantity.name}: .* is not accepted"
        ):
            study.make_scene(parts, "test")


@pytest.mark.parametrize("quantity", fields.FIELDS, ids=lambda quantity: quantity.name)
def test_scenes_that_differ_in_a_field_are_not_equal_in_all_else(
    quantity: Quantity, scene: Scene
) -> None:
    if quantity.name in UNCHANGEABLE:
        return
    scene = changed(scene, NEEDED.get(quantity.name, {}))
    if quantity.info.scope == "single grains":
        scene = study.parse(
            "grain = { diameter = 1e-3 }", name="test", where="test"
        ).scenes[0]
    if quantity.info.scope == "poured beds":
        scene = changed(scene, {"bed.packing": "poured"})
    other = changed(scene, {quantity.name: other_value(quantity, scene)})
    row, other_row = in_tables((scene, other))
    assert row != other_row


def test_beds_alike_but_for_the_size_of_their_grains_are_equal(scene: Scene) -> None:
    other = changed(scene, {"grain.diameter": 5e-4, "bed.roughness": 5e-4 / 30})
    assert len({*map(repr, in_tables((scene, other), "d_m"))}) == 1


def test_rungs_change_fields_of_the_answer_alone(scene: Scene) -> None:
    of_method = {field.name for field in fields.FIELDS if field.is_method}
    for rungs in RUNGS.values():
        for rung in rungs:
            assert rung.fields(scene).keys() <= of_method


def test_a_field_without_effect_is_empty_and_one_left_open_is_worked_out(
    scene: Scene,
) -> None:
    row = fields.asked(
        changed(scene, {"method.flow.model": "flat", "method.kind": "pivot"})
    )
    for column in ("turbulence_model", "cells_per_face", "stiffness", "waiting_time"):
        assert row[column] is None
    assert (row["h_m"], row["flow_model"]) == (0.02, "flat")
    assert fields.asked(scene)["first_cell_m"] is None
    assert fields.method(scene)["first_cell_m"] == scene.first_cell_height
    assert fields.plain(((5e-4, 0.15), (1e-3, 0.85))) == "0.5 mm 15 %; 1 mm 85 %"


def test_a_row_has_the_scene_that_was_asked_and_the_one_that_answered_it() -> None:
    asked = study.parse("tolerance = 0.2\n" + PILE, name="test", where="test")
    planned = plan.make(asked)
    (row,), (scene,) = scene_rows(asked, planned), asked.scenes
    assert {"scene_id": scene.id, **fields.question(scene)}.items() <= row.items()
    (how,) = method_rows(planned)
    answer = fields.method(planned.decisions[scene.id].scene)
    assert {"scene_id": scene.id, **answer}.items() <= how.items()
    assert (how["asked"], how["method"], how["fidelity"]) == ("auto", "pivot", "quick")
    assert not {*row} & {*how} - {"scene_id"}
    assert {*row, *how} <= set(meanings())


def test_the_reference_of_study_files_is_written_from_the_registry() -> None:
    assert PAGE.read_text(encoding="utf-8") == REFERENCE["text"]()
    in_a_plane, _ = REFERENCE["text"]().split("## Beds in three dimensions")
    rows = {line.split(" | ")[0]: line for line in in_a_plane.splitlines()}
    assert "[0, 90) | `0.0` |" in rows["| `slope_deg`"]
    assert "[1e-07, 10] | required |" in rows["| `diameter`"]
    assert "[1e-06, 1] | `[0.1, 0.3, 0.5, 0.7]` |" in rows["| `fractions`"]


def test_columns_are_distinct_and_explained() -> None:
    without = sum(quantity.column == "-" for quantity in fields.FIELDS)
    assert without == 1
    quantities = (*fields.FIELDS, *fields.DERIVED)
    assert len(fields.COLUMNS) == len(quantities) - without
    assert {*fields.COLUMNS} <= set(meanings())


OF_POURED = """
grain = { diameter = 1e-3, sizes = { sigma_g = 1.3 } }
bed = { kind = "flat", width = 6.0 }
forces.exposure = "protrusion"
[axes]
"bed.packing" = %s
"""


def test_a_field_is_blank_on_the_scenes_of_an_axis_on_which_it_has_no_effect() -> None:
    text = OF_POURED % '["aligned", "poured"]'
    lattice, poured = study.parse(text, name="t", where="t").scenes
    (plain,) = study.parse(
        'grain.diameter = 1e-3\nbed.kind = "flat"', name="t", where="t"
    ).scenes
    assert lattice == plain
    assert lattice.id == plain.id != poured.id
    for each in fields.FIELDS:
        if not each.applies(lattice):
            assert each.read(lattice) == fields.default_of(each.name), each.name
    assert isinstance(poured.bed, PileBed)
    assert (poured.bed.width, poured.forces.exposure) == (6.0, "protrusion")
    assert poured.grain.sizes is not None


def test_a_field_without_effect_on_any_scene_is_refused_with_what_would_have_one() -> (
    None
):
    with pytest.raises(InputError, match="on poured beds alone") as caught:
        study.parse(OF_POURED % '["aligned"]', name="t", where="t")
    assert caught.value.where == "t: grain.sizes"
    assert caught.value.remedy == 'leave it out, or bed.packing = "poured"'
    assert scopes.BY.keys() == scopes.APPLIES.keys() - {"every scene"}
    assert {each.info.scope for each in fields.FIELDS} == scopes.APPLIES.keys()
