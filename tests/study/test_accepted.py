"""What is said of a value that a field of a study file does not take, for every field."""

import re
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from orchestrator import guests
from orchestrator.errors import InputError, shown, suggestion
from orchestrator.study import study
from orchestrator.study.accepted import of_field
from orchestrator.study.fields import FIELDS, PARTS, Quantity
from orchestrator.study.written import toml_of
from orchestrator.surface.study import TABLES as OF_SURFACES

PILE: dict[str, Any] = {
    "fluid": {"kind": "water"},
    "grain": {"diameter": 1e-3, "density": 2650.0},
    "bed": {"kind": "pile", "slope_deg": 15.0, "height": 0.02},
}
CONE: dict[str, Any] = {
    "fluid": {"kind": "air"},
    "grain": {"diameter": 3e-4},
    "bed": {"kind": "surface", "shape": "cone", "height": 5.0, "slope_deg": 30.0},
}
OF_THE_LIBRARY = re.compile(
    r"[Ii]nput|\bvalid|literal|dictionary|instance|tuple|function|datetime|pydantic"
    r"|True|False|None|\{'"
)
"""Words of the library that validates, and of Python."""
WRONG: tuple[Any, ...] = (True, [True], {"nothing": 1}, "nonsense", -1e300, 1e300)
"""Values that hardly a field takes."""


def _with(tables: dict[str, Any], name: str, value: object) -> str:
    """A study file of some tables with one value more."""
    made = deepcopy(tables)
    *within, key = name.split(".")
    table = made
    for step in within:
        table = table.setdefault(step, {})
    table[key] = value
    return toml_of(made, "test")


def _refusal(name: str, value: object) -> str:
    """What a study says of a value that it refuses; empty where it takes it."""
    try:
        study.parse(_with(PILE, name, value), name="test", where="test")
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_a_value_that_is_not_taken_is_told_with_what_is(field: Quantity) -> None:
    table, _, key = field.name.rpartition(".")
    taken = of_field(PARTS[table].model_fields[key])
    refused = 0
    for value in WRONG:
        said = _refusal(field.name, value)
        if not said:
            continue
        refused += 1
        assert said.startswith(f"test: {field.name}"), said
        assert not OF_THE_LIBRARY.search(said), said
        assert said.endswith(")"), said  # with a remedy
        if f"{shown(value)} is not accepted" in said:
            remedy = said.partition("is not accepted (")[2]
            assert taken.said in remedy, said
    assert refused >= 3


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_a_misspelt_key_is_asked_about(field: Quantity) -> None:
    table, _, key = field.name.rpartition(".")
    for misspelt in (key[:-1], f"{key}s", key.capitalize()):
        if misspelt in PARTS[table].model_fields:
            continue
        said = _refusal(f"{table}.{misspelt}", 1.0)
        assert said.startswith(f"test: {table}.{misspelt}: "), said
        assert key in said.partition("(")[2], said


OF_CHOICES = [
    (field.name, word)
    for field in FIELDS
    for word in of_field(
        PARTS[field.name.rpartition(".")[0]].model_fields[field.name.rpartition(".")[2]]
    ).words
]


@pytest.mark.parametrize(("name", "word"), OF_CHOICES)
def test_a_misspelt_choice_is_asked_about(name: str, word: str) -> None:
    """In other letters, and with a letter too few."""
    others = [other for of, other in OF_CHOICES if of == name]
    for misspelt in {word.upper(), word.capitalize(), word[:-1]} - {*others, ""}:
        said = _refusal(name, misspelt)
        assert f"{misspelt!r} is no" in said, said
        assert suggestion(misspelt, [word, *others]) in said, said
        if misspelt.casefold() == word.casefold():
            assert f"did you mean {word}?" in said, said


def test_values_within_tables_and_lists_are_named_by_their_place() -> None:
    fence = {"kind": "fence", "x": -0.1, "height": 0.01}
    obstacles = [fence, {**fence, "kind": "Block"}]
    said = _refusal("bed.obstacles", obstacles)
    assert "bed.obstacles[2].kind: 'Block' is not accepted (did you mean block?" in said
    said = _refusal("flow.gusts", {"intensity": 2, "events": 100})
    assert (
        "flow.gusts.intensity: 2 is not accepted (write a number above 0 to 1" in said
    )
    said = _refusal("flow.gusts", {"intensty": 0.4, "events": 100})
    assert "flow.gusts.intensty: unknown key (did you mean intensity?" in said
    said = _refusal("axes", {"grain.diameter": 1e-3})
    assert "axes.grain.diameter: 0.001 is not accepted (write a list of values" in said


def test_all_fields_that_are_not_accepted_are_named() -> None:
    tables = deepcopy(PILE)
    tables["bed"]["packing"] = "Aligned"
    tables["forces"] = {"law": "briged"}
    tables["threshold"] = {"fractions": ["a", 2]}
    with pytest.raises(InputError) as caught:
        study.parse(toml_of(tables, "test"), name="test", where="test")
    said = str(caught.value)
    assert said.startswith("test: bed.packing: 'Aligned' is not accepted (did you mean")
    assert said.endswith("not accepted either: forces.law and threshold.fractions)")
    # a roughness that could not be worked out for want of the diameter is not wrong
    said = _refusal("grain.diameter", "x")
    assert "not accepted either" not in said


@pytest.mark.parametrize(
    ("roughness", "said"),
    [
        ("d/2", "0.5 mm is above a third of the bed's grains of 1 mm (usual is"),
        ("5 mm", "write 0.005, without a unit"),
        ("half", "'half' is not a length (write metres, or a part of the diameter"),
    ],
)
def test_a_roughness_that_is_none_is_told(roughness: str, said: str) -> None:
    assert said in _refusal("bed.roughness", roughness)


@pytest.mark.parametrize("table", [name for name in OF_SURFACES if name != "method"])
def test_a_bed_in_three_dimensions_says_the_same(table: str, tmp_path: Path) -> None:
    pytest.importorskip("rasterio")
    file = tmp_path / "cone.toml"
    for key, declared in OF_SURFACES[table].model_fields.items():
        taken = of_field(declared)
        for value in (*WRONG, *(word.upper() for word in taken.words)):
            file.write_text(_with(CONE, f"{table}.{key}", value))
            try:
                guests.load_study(str(file), None)
            except InputError as error:
                said = str(error).removeprefix(str(file))
            else:
                continue
            if value == "nonsense" and "name of a file" in taken.said:
                continue  # it is the name of a file that is not there
            assert not OF_THE_LIBRARY.search(said), said
            assert said.startswith((f": {table}.{key}", ": bed.")), said
            assert said.endswith(")"), said
