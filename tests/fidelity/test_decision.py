"""The decision how a scene is answered: the levels, what is known of them, and the reason."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.fidelity import calibration
from orchestrator.fidelity.calibration import Known
from orchestrator.fidelity.decision import Bound, _cheapest, as_asked, decide, on_levels
from orchestrator.fidelity.levels import AS_ASKED, LEVELS, Levels, changed, level
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import Scene
from tests.fidelity.conftest import MakePile


def _errors(scene: Scene, named: Levels) -> list[float]:
    classes = {part: calibration.scene_class(part, scene) for part in LEVELS}
    found = calibration.known(named, classes, scene.protocol.fractions)
    return [one.total for one in found]


@given(one=st.floats(0.001, 0.9), other=st.floats(0.001, 0.9))
def test_a_looser_tolerance_is_never_dearer(pile: MakePile, one: float, other: float) -> None:
    tight, loose = (decide(pile(), tolerance) for tolerance in sorted([one, other]))
    cheaper = loose.known.cost_core_s <= tight.known.cost_core_s
    assert cheaper or "none is within" in tight.why


@pytest.mark.parametrize(
    ("tolerance", "packing"),
    [
        (0.05, "aligned"),
        (0.1, "disordered"),
        (0.15, "horizontal"),
        (0.2, "aligned"),
        (0.2, "horizontal"),
        (0.2, "disordered"),
    ],
)
def test_the_choice_is_known_to_be_within_the_tolerance(
    tolerance: float, packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    chosen = decide(scene, tolerance)
    assert chosen.why == "cheapest within the tolerance"
    assert max(_errors(scene, chosen.levels)) <= tolerance
    # the table says what the option asked for
    assert chosen.error_estimate == max(_errors(scene, chosen.levels))
    # no pair that is cheaper is within
    for flow in LEVELS["flow"]:
        for grains in LEVELS["grains"]:
            pair = on_levels(scene, {"flow": flow.name, "grains": grains.name}, "")
            same_model = flow.same_model and grains.same_model
            if same_model and pair.known.cost_core_s < chosen.known.cost_core_s:
                assert max(_errors(scene, pair.levels)) > tolerance


def test_a_decision_is_carried_out_by_its_levels(pile: MakePile) -> None:
    chosen = decide(pile(), 0.05)
    assert chosen.asked == pile()
    answered = pile()
    for part, name in chosen.levels.items():
        answered = level(part, name).answer(answered)
    assert chosen.scene == answered != chosen.asked
    assert not chosen.is_as_asked
    assert chosen.levels_text == f"{chosen.levels['flow']} | {chosen.levels['grains']}"
    assert chosen.error_estimate == math.hypot(chosen.known.error, chosen.known.uncertainty)


def test_without_a_tolerance_what_is_known_of_the_levels_that_a_scene_is_on_is_said(
    pile: MakePile,
) -> None:
    on_known = level("grains", "1 layer, fast").answer(pile())
    decision = decide(on_known, None)
    assert decision.is_as_asked
    assert decision.why == "as the study asks"
    assert decision.levels == {"flow": "standard", "grains": "1 layer, fast"}
    assert decision.error_estimate == on_levels(pile(), decision.levels, "").error_estimate
    other = decide(pile(), None)
    assert other.levels == {"flow": "standard", "grains": AS_ASKED}
    assert other.error_estimate is None


def test_level_rows_are_never_left_to_the_pivot_of_each_grain(pile: MakePile) -> None:
    scene = pile(packing="horizontal")
    assert decide(scene, 0.2).levels["grains"] != "pivot"
    assert calibration.known_at("grains", "pivot", "horizontal", 0.5).error > 0.3


@pytest.mark.parametrize("packing", ["aligned", "horizontal"])
def test_where_none_is_within_the_tolerance_no_more_is_paid_than_the_reference_is_worth(
    packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    chosen = decide(scene, 1e-9)
    assert "none is within the tolerance" in chosen.why
    reference = on_levels(scene, {"flow": "fine", "grains": "reference"}, "")
    assert chosen.known.error <= reference.known.total
    assert chosen.known.cost_core_s < reference.known.cost_core_s
    assert chosen.error_estimate is not None
    # beyond the reference itself there is no other
    last = decide(scene, 1e-9, Bound({"flow": "fine", "grains": "soft reference"}, "test"))
    assert last.levels == {"flow": "finest", "grains": "reference"}
    assert last.why.endswith("; test")


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("slope_deg", [15.0, 30.0])
def test_small_grains_are_answered_at_any_tolerance(
    packing: str, slope_deg: float, pile: MakePile
) -> None:
    small = changed(pile(packing=packing, slope_deg=slope_deg), {"grain.diameter": 1e-4})
    for tolerance in (0.01, 0.02, 0.05, 0.1, 0.2):
        assert decide(small, tolerance).levels["grains"] != "paper's K, fast"


def test_what_is_not_known_is_answered_as_asked(pile: MakePile) -> None:
    wild = pile(packing="disordered", disorder=0.2)
    decision = decide(wild, 0.2)
    assert decision.scene == wild
    assert decision.why == "no error is known: as the study asks"
    assert decision.error_estimate is None


@pytest.mark.parametrize(
    ("field", "value", "word"),
    [
        ("protocol.waiting_time", 1.0, "ramp"),
        ("protocol.method", "peeling", "peeling"),
        ("flow.model", "hill", "hill"),
    ],
)
def test_a_way_to_the_answer_that_is_asked_for_is_kept(
    field: str, value: object, word: str, pile: MakePile
) -> None:
    asked = changed(pile(), {field: value})
    decision = decide(asked, 0.5)
    assert decision.scene == asked
    assert word in decision.why


@pytest.mark.parametrize("model", ["flat", "solve"])
def test_over_a_level_bed_the_flow_is_exact_and_the_grains_are_chosen(
    model: str, pile: MakePile, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = {"peeling": 0.8, "1 layer, fast": 0.4, "4 layers, fast": 0.1, "reference": 0.0}
    costs = dict(zip(errors, (0.1, 1.0, 3.0, 60.0), strict=True))
    fractions = pile().protocol.fractions
    table = {
        ("grains", name, "poured, flat"): {at: Known(error, 0.05, costs[name]) for at in fractions}
        for name, error in errors.items()
    }
    monkeypatch.setattr(calibration, "measured", lambda: table)
    monkeypatch.setattr("orchestrator.fidelity.decision._cheapest", _cheapest.__wrapped__)
    level_bed = {"packing": "poured", "shape": "flat", "slope_deg": 0.0}
    asked = changed(pile(**level_bed), {"flow.model": model})
    for tolerance, grains in ((0.9, "peeling"), (0.2, "4 layers, fast"), (0.1, "reference")):
        chosen = decide(asked, tolerance)
        assert chosen.levels == {"flow": "flat", "grains": grains}
        assert chosen.error_estimate == math.hypot(errors[grains], 0.05)
        assert chosen.scene.flow.model == "flat"
    overruled = decide(asked, 0.9, Bound({"flow": "flat", "grains": "peeling"}, "overruled"))
    assert overruled.levels == {"flow": "flat", "grains": "1 layer, fast"}


def test_grains_that_lift_off_before_they_roll_are_left_to_dem(pile: MakePile) -> None:
    lifted = changed(pile(slope_deg=20.0), {"forces.law": "low"})
    assert closed_form(lifted, "low").lift > lifted.weight
    decision = decide(lifted, 0.2)
    assert decision.scene.protocol.method == "dem"
    assert "lift" in decision.why


def test_levels_that_were_overruled_are_not_chosen_again(pile: MakePile) -> None:
    first = decide(pile(), 0.2)
    again = decide(pile(), 0.2, Bound(first.levels, "DEM overruled them"))
    for part, listed in LEVELS.items():
        names = [one.name for one in listed]
        assert names.index(again.levels[part]) > names.index(first.levels[part])
    assert again.why.endswith("; DEM overruled them")


def test_above_the_dearest_level_a_scene_is_answered_as_asked(pile: MakePile) -> None:
    decision = decide(pile(), 0.2, Bound({"flow": "realizable k-eps."}, "they failed"))
    assert decision.is_as_asked
    assert decision.why == "no error is known: as the study asks; they failed"


def test_a_single_grain_is_on_no_level() -> None:
    text = 'grain = { diameter = 1e-3 }\nbed = { kind = "grain" }'
    scene = study.parse(text, name="one", where="test").scenes[0]
    chosen = decide(scene, 0.05)
    assert chosen.scene.protocol.method == "pivot"
    assert "exact" in chosen.why
    assert (chosen.levels, chosen.error_estimate) == ({}, None)
    assert as_asked(scene).levels == {}
    assert math.isinf(as_asked(scene).known.error)
