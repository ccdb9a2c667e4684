"""The registry: every field has its words and its range, tells scenes apart, is documented."""

import runpy
from pathlib import Path
from typing import Any, get_args

import pytest

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.fidelity.levels import LEVELS, Level, changed
from orchestrator.study import fields, study
from orchestrator.study.fields import Quantity
from orchestrator.study.scene import Scene
from orchestrator.study.sizes import LogNormal
from orchestrator.tables import COLUMNS, scenes

PAGE = Path(__file__).parents[2] / "docs" / "study-file.md"
REFERENCE = runpy.run_path(str(PAGE.with_name("study_file.py")))
PILE = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", slope_deg = 15.0, packing = "disordered" }
forces = { law = "high" }
"""
UNCHANGEABLE = ("bed.kind", "protocol.fractions", "bed.profile", "bed.smoothing", "bed.obstacles")
CHANGEABLE = [one for one in fields.FIELDS if one.name not in UNCHANGEABLE]
NUMERIC = [
    one
    for one in fields.FIELDS
    if {float, int}.intersection((kind := fields.declared(one).annotation, *get_args(kind)))
]
NEEDED: dict[str, dict[str, Any]] = {
    "bed.windward": {"bed.shape": "dune"},
    "bed.brink_radius": {"bed.shape": "dune"},
    "bed.lee_slope_deg": {"bed.lee_slope_deg": 20.0},
    "bed.length": {"bed.shape": "trapezoid", "bed.length": 0.1},
    "bed.spacing": {"bed.forms": 3, "bed.spacing": 0.5},
    "bed.counted": {"bed.counted": "windward"},
    "bed.width": {"bed.packing": "poured", "bed.width": 5.0},
    "flow.top": {"flow.top": "open water", "flow.depth": 1.0},
    "flow.depth": {"flow.top": "open water", "flow.depth": 1.0},
}
"""Other fields that a scene must have for a field to have an effect."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A scene on which every field has an effect."""
    return study.parse(PILE, name="test", where="test").scenes[0]


def other_value(one: Quantity, scene: Scene) -> Any:
    value = one.used(scene)
    if one.name == "grain.sizes":
        return LogNormal(sigma_g=1.3)
    if isinstance(value, str):
        words = one.info.choices or get_args(fields.declared(one).annotation)
        return next(word for word in words if word not in (value, "paper"))
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else 0.95 * value or 0.5


@pytest.mark.parametrize("one", fields.FIELDS, ids=lambda one: one.name)
def test_each_field_has_its_words_and_its_row_in_the_reference(one: Quantity) -> None:
    assert one.info.label
    assert one.meaning
    assert not one.meaning.endswith(".")
    words = [word for word in get_args(fields.declared(one).annotation) if isinstance(word, str)]
    if one.name != "bed.kind" and words and one.info.choices:
        assert list(one.info.choices) == words
    part, _, name = one.name.partition(".")
    section = REFERENCE["text"]().split(f"## `[{part}]`")[1].split("\n## ")[0]
    (row,) = [line for line in section.splitlines() if line.startswith(f"| `{name}` |")]
    assert one.meaning.replace("*", r"\*") in row
    assert row.count(" | ") == 6


def test_columns_are_distinct_and_explained() -> None:
    columns = [one.column for one in (*fields.FIELDS, *fields.DERIVED)]
    assert len(set(columns)) == len(columns)
    assert {*fields.COLUMNS, *fields.ANSWERS} <= set(COLUMNS)


@pytest.mark.parametrize("quantity", NUMERIC, ids=lambda each: each.name)
def test_every_number_has_two_ends(quantity: Quantity) -> None:
    low, high = REFERENCE["bounds"](fields.declared(quantity))
    assert (low[0], high[0]) in {(">", "<"), (">", "≤"), ("≥", "<"), ("≥", "≤")}
    part, _, name = quantity.name.partition(".")
    bed = {"kind": "pile", "slope_deg": 20.0}
    base: dict[str, dict[str, Any]] = {"grain": {"diameter": 1e-3}, "bed": bed}
    integer = fields.declared(quantity).annotation is int
    for value in (-1, 10**18) if integer else (-1e-320, 1e308):
        parts = {key: {**base.get(key, {})} for key in fields.PARTS}
        parts[part][name] = value
        with pytest.raises(InputError, match=rf"test: {quantity.name}: .* is not accepted"):
            study.make_scene(parts, "test")


@pytest.mark.parametrize("one", CHANGEABLE, ids=lambda one: one.name)
def test_scenes_that_differ_in_a_field_are_not_equal_in_all_else(
    one: Quantity, scene: Scene
) -> None:
    if one.name in NEEDED:
        scene = changed(scene, NEEDED[one.name])
    if one.info.scope == "single grains":
        scene = study.parse("grain = { diameter = 1e-3 }", name="test", where="test").scenes[0]
    if one.info.scope == "poured beds":
        scene = changed(scene, {"bed.packing": "poured"})
    other = changed(scene, {one.name: other_value(one, scene)})
    rows = [{**fields.asked(each), **fields.answered(each)} for each in (scene, other)]
    columns = fields.others(rows[0])
    assert [rows[0][c] for c in columns] != [rows[1][c] for c in columns]


def test_beds_alike_but_for_the_size_of_their_grains_are_equal(scene: Scene) -> None:
    sizes = (5e-4, 1e-3)
    beds = [changed(scene, {"grain.diameter": d, "bed.roughness": d / 30}) for d in sizes]
    rows = [{**fields.asked(each), **fields.answered(each)} for each in beds]
    columns = fields.others(rows[0], "d_m")
    assert [rows[0][c] for c in columns] == [rows[1][c] for c in columns]


@pytest.mark.parametrize(
    "one", [one for part in LEVELS.values() for one in part], ids=lambda one: one.name
)
def test_a_level_changes_fields_of_the_answer_alone(one: Level, scene: Scene) -> None:
    about = {field.name: field.info.about for field in fields.FIELDS}
    assert {about[name] for name in one.fields(scene)} == {"answer"}


def test_a_field_without_effect_is_empty_and_one_left_open_is_worked_out(scene: Scene) -> None:
    row = fields.asked(changed(scene, {"flow.model": "flat", "protocol.method": "pivot"}))
    for column in ("turbulence_model", "cells_per_face", "stiffness", "waiting_time"):
        assert row[column] is None
    assert (row["h_m"], row["flow_model"]) == (0.02, "flat")
    assert fields.asked(scene)["first_cell_m"] is None
    assert fields.answered(scene)["answered_first_cell_m"] == scene.first_cell_height
    assert fields.plain(((5e-4, 0.15), (1e-3, 0.85))) == "0.5 mm 15 %; 1 mm 85 %"


def test_a_row_has_the_scene_that_was_asked_and_the_one_that_answered_it() -> None:
    asked = study.parse("tolerance = 0.2\n" + PILE, name="test", where="test")
    planned = plan.make(asked)
    (row,), (one,) = scenes.rows(asked, planned), asked.scenes
    assert row["scene_id"] == one.id
    assert fields.asked(one).items() <= row.items()
    assert fields.answered(planned.decisions[one.id].scene).items() <= row.items()
    assert row["method"] == "dem"
    assert row["answered_method"] != "dem"


def test_the_reference_of_study_files_is_written_from_the_registry() -> None:
    assert PAGE.read_text(encoding="utf-8") == REFERENCE["text"]()
    rows = {line.split(" | ")[0]: line for line in REFERENCE["text"]().splitlines()}
    assert "| ≥ 0, < 90 | `0.0` |" in rows["| `slope_deg`"]
    assert "| ≥ 1e-12, ≤ 10000 | worked out |" in rows["| `first_cell_height`"]
    assert "| ≥ 1e-07, ≤ 10 | none: required |" in rows["| `diameter`"]
    assert "| ≥ 1e-06, ≤ 1 | `[0.1, 0.3, 0.5, 0.7]` |" in rows["| `fractions`"]
