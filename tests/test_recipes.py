"""Inputs that change get a new recipe: results are reused by the name of a case."""

from collections.abc import Iterable
from pathlib import Path

import pytest

from orchestrator.grains import cells, pile
from tests import recipes
from tests.recipes import Inputs

KINDS = {"cells", "flow", "pile", "poured", "surface", "worn"}


def _kinds(names: Iterable[str]) -> set[str]:
    return {name.split(": ")[1].split()[0] for name in names}


def test_inputs_are_those_of_their_recipe(tmp_path: Path) -> None:
    found, before = recipes.current(tmp_path), recipes.pinned()
    assert _kinds(found) == KINDS
    names = recipes.without_new_recipe(found, before)
    assert not names, recipes.advice(names)
    assert found == before, f"a new recipe or scene: run `{recipes.COMMAND}`"


def test_a_recipe_stands_for_its_inputs() -> None:
    before = {"a": Inputs(1, "x"), "b": Inputs(1, "y"), "c": Inputs(3, "z")}
    found = {"a": Inputs(1, "x"), "b": Inputs(1, "other"), "c": Inputs(4, "other")}
    assert recipes.without_new_recipe(found, before) == ["b"]
    # a recipe is never taken back
    assert recipes.without_new_recipe({"c": Inputs(2, "z")}, before) == ["c"]


def test_other_inputs_under_an_old_recipe_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # walls of the box farther out, and cells farther apart
    monkeypatch.setattr(pile, "MARGIN", 4.0)
    monkeypatch.setattr(cells, "SPACING", 4.0)
    found, before = recipes.current(tmp_path), recipes.pinned()
    names = recipes.without_new_recipe(found, before)
    expected = [name for name in before if _kinds([name]) <= {"pile", "cells"}]
    assert names == sorted(expected)
    said = recipes.advice(names)
    assert "orchestrator/grains/pile.py" in said
    assert recipes.COMMAND in said
