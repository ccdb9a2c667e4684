"""Fidelity levels: what they change, and by what they are recognised."""

import re

import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity import calibration, levels
from orchestrator.fidelity.decision import decide
from orchestrator.fidelity.levels import AS_ASKED, LEVELS, Part, changed
from tests.fidelity.conftest import MakePile


@pytest.mark.parametrize("part", list(LEVELS))
def test_a_scene_that_is_on_a_level_as_it_is_asked_is_recognised(
    part: Part, pile: MakePile
) -> None:
    for one in LEVELS[part]:
        if one.takes(pile()):
            assert levels.holding(one.answer(pile()))[part] == one.name
    other = changed(pile(), {"flow.expansion_ratio": 1.15, "protocol.load_increment": 0.05})
    assert levels.holding(other)[part] == AS_ASKED


def test_a_level_changes_how_a_scene_is_answered_not_what_it_asks(pile: MakePile) -> None:
    scene = pile()
    for one in (*levels.FLOW, *levels.GRAINS):
        answered = one.answer(scene)
        assert answered.fluid == scene.fluid
        assert answered.bed.slope_deg == scene.bed.slope_deg
        assert answered.forces.stress == scene.forces.stress
        assert answered.protocol.fractions == scene.protocol.fractions


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("flow.expansion_ration", 1.1),
        ("protocol.time_steps", 0.1),
        ("grain.stiffness", -1.0),
        ("flow.model", "magic"),
        ("protocol.load_increment", float("nan")),
        ("nothing", 1),
        ("flow", 1),
    ],
)
def test_a_scene_is_changed_in_fields_that_there_are(
    field: str, value: object, pile: MakePile
) -> None:
    with pytest.raises(InputError, match=rf"changed: {re.escape(field)}"):
        changed(pile(), {field: value})


def test_beds_of_nearly_one_roughness_share_a_flow(pile: MakePile) -> None:
    shared = levels.level("flow", "shared")
    near = [shared.answer(pile(roughness=z0)).flow.roughness for z0 in (3.0e-5, 3.4e-5)]
    assert near[0] == near[1]
    assert shared.answer(pile(roughness=1e-4)).flow.roughness != near[0]


def test_the_meaning_of_levels_leaves_out_what_is_none() -> None:
    assert levels.meaning({"flow": "hill", "grains": AS_ASKED}) == (
        "linear theory of the flow over a low hill"
    )
    assert levels.meaning({"flow": AS_ASKED, "grains": AS_ASKED}) == ""


def test_a_strip_is_a_class_of_its_own_and_never_chosen_for_a_bed_in_the_plane(
    pile: MakePile,
) -> None:
    plane = changed(pile(), {"bed.packing": "poured"})
    strip = levels.level("grains", "strip").answer(plane)
    assert strip.bed.width == 5.0  # type: ignore[union-attr]
    assert levels.holding(strip)["grains"] == "4 layers, fast"
    classes = [calibration.scene_class("grains", one) for one in (plane, strip)]
    assert classes == ["poured", "strip"]
    known = calibration.known({"grains": "reference"}, {"grains": "strip"}, [0.3])
    assert decide(plane, 10.0).levels["grains"] != "strip"
    if known == [calibration.UNKNOWN]:
        assert decide(strip, 10.0).is_as_asked
