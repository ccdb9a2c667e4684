"""Fidelity levels: what they change, and by what they are recognised."""

import re

import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity import levels
from orchestrator.fidelity.levels import AS_ASKED, FLOW, GRAINS, Level, changed, level, pair_of
from tests.fidelity.conftest import MakePile

PACKINGS = ("aligned", "horizontal", "disordered", "poured")


@pytest.mark.parametrize("packing", PACKINGS)
@pytest.mark.parametrize("one", [*FLOW, *GRAINS], ids=lambda one: one.name)
def test_a_scene_on_a_level_is_recognised_and_asks_the_same(
    one: Level, packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    if not one.takes(scene):
        return
    answered = one.answer(scene)
    # a scene that asks for a strip is on the levels of strips
    assert one in pair_of(answered) or one is level("grains", "strip")
    assert (answered.fluid, answered.forces) == (scene.fluid, scene.forces)
    assert answered.bed.slope_deg == scene.bed.slope_deg
    assert answered.protocol.fractions == scene.protocol.fractions


@pytest.mark.parametrize(
    ("fields", "finer", "coarser"),
    [
        ({"flow.expansion_ratio": 1.15}, "medium", "standard"),
        ({"flow.cells_per_face": 60}, "standard", "fine"),
        ({"protocol.load_increment": 0.02}, "2 layers, fast", "2 layers, slow"),
        ({"bed.mobile_layers": 3}, "2 layers, fast", "4 layers, fast"),
    ],
)
def test_numbers_beside_the_levels_are_bounded_by_coarser_ones(
    fields: dict[str, object], finer: str, coarser: str, pile: MakePile
) -> None:
    scene = pile(fields)
    bounds = {one.name for one in (*FLOW, *GRAINS) if one.describes(scene, or_finer=True)}
    assert finer in bounds
    assert coarser not in bounds
    assert AS_ASKED in pair_of(scene)


@pytest.mark.parametrize("field", ["flow.expansion_ration", "grain.stiffness", "nothing", "flow"])
def test_a_scene_is_changed_in_fields_that_exist(field: str, pile: MakePile) -> None:
    with pytest.raises(InputError, match=rf"changed: {re.escape(field)}"):
        changed(pile(), {field: -1.0})


@pytest.mark.parametrize(
    ("fields", "taken"),
    [
        ({}, {"hill", "waves"}),
        ({"bed.shape": "step up"}, {"waves"}),
        ({"flow.top": "open water", "flow.depth": 0.1}, set()),
    ],
)
def test_a_theory_takes_the_flows_that_it_knows(
    fields: dict[str, object], taken: set[str], pile: MakePile
) -> None:
    theories = (level("flow", name) for name in ("hill", "waves"))
    assert {one.name for one in theories if one.takes(pile(fields))} == taken


def test_the_meaning_of_levels_leaves_out_what_is_none() -> None:
    assert levels.meaning(["hill", AS_ASKED.name]) == level("flow", "hill").meaning
