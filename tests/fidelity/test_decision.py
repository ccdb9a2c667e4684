"""The decision how a scene is answered: the levels, what is known of them, and the reason."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator import plan
from orchestrator.fidelity import calibration
from orchestrator.fidelity.calibration import LEVEL_BED, floor, lowest_floor, model_class
from orchestrator.fidelity.decision import (
    NONE_WITHIN,
    Bound,
    as_asked,
    by_default,
    decide,
    on_levels,
)
from orchestrator.fidelity.levels import AS_ASKED, FLAT, FLOW, GRAINS, LEVELS, Pair, level
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form
from tests.fidelity.conftest import MakePile

PACKINGS = ("aligned", "horizontal", "disordered", "poured")


@given(one=st.floats(0.001, 0.9), other=st.floats(0.001, 0.9))
def test_a_looser_tolerance_is_never_dearer(pile: MakePile, one: float, other: float) -> None:
    tight, loose = (decide(pile(), tolerance) for tolerance in sorted([one, other]))
    assert loose.known.cost_core_s <= tight.known.cost_core_s or NONE_WITHIN in tight.why


@pytest.mark.parametrize("packing", PACKINGS)
@pytest.mark.parametrize("tolerance", [1e-9, 0.05, 0.1, 0.2, 0.8])
def test_the_choice_is_the_cheapest_within_the_tolerance_or_says_that_none_is(
    tolerance: float, packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    chosen = decide(scene, tolerance)
    pairs = [
        Pair(flow, grains)
        for flow, grains in itertools.product(FLOW, GRAINS)
        if all(one.same_model and one.takes(scene) for one in (flow, grains))
    ]
    known = {pair: calibration.known(pair, scene) for pair in pairs}
    assert chosen.levels in pairs
    assert chosen.error_estimate == chosen.known.total == known[chosen.levels].total
    assert chosen.scene == chosen.levels.answer(scene) != scene
    cheaper = [one for one in known.values() if one.cost_core_s < chosen.known.cost_core_s]
    if "none" in chosen.why:
        best = min(one.total for one in known.values())
        assert best > tolerance
        assert chosen.known.error <= best
    else:
        assert chosen.known.total <= tolerance
        assert all(one.total > tolerance for one in cheaper)


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"protocol.waiting_time": 1.0}, "ramp"),
        ({"protocol.method": "peeling"}, "peeling"),
        ({"flow.model": "hill"}, "hill"),
        ({"protocol.update": 0.1, "flow.first_cell_height": 5e-4}, "changes"),
        ({"bed.packing": "disordered", "bed.disorder": 0.2}, "no error is known"),
        ({"forces.averaging_length": 10.0}, "averaging_length = 10"),
        ({"flow.first_cell_height": 0.005}, "first cells of 0.005 m"),
        ({"forces.law": "low", "bed.slope_deg": 20.0}, "lift"),
    ],
)
def test_what_is_asked_for_or_not_known_is_answered_as_asked(
    fields: dict[str, object], word: str, pile: MakePile
) -> None:
    scene = pile(fields)
    decision = decide(scene, 0.3)
    assert decision.is_as_asked
    assert word in decision.why


def test_open_water_is_answered_at_any_tolerance(pile: MakePile) -> None:
    """With a tolerance of 0.3 a theory was chosen that knows no water."""
    water = {"flow.top": "open water", "flow.depth": 0.1, "flow.speed": 1.0, "flow.viscosity": 1e-6}
    chosen = decide(pile(water), 0.3)
    assert chosen.levels
    assert chosen.scene.flow.model == "solve"
    assert plan.of({"a": chosen}, "water").cases


def test_lift_beyond_the_weight_has_no_known_error(pile: MakePile) -> None:
    lifted = pile({"forces.law": "low"}, slope_deg=20.0)
    assert closed_form(lifted, "low").lift > lifted.weight
    decision = decide(lifted, 0.2)
    assert (decision.scene, decision.error_estimate) == (lifted, None)


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("slope_deg", [15.0, 30.0])
def test_small_grains_are_never_stiffer_than_a_file_allows(
    packing: str, slope_deg: float, pile: MakePile
) -> None:
    small = pile({"grain.diameter": 1e-4}, packing=packing, slope_deg=slope_deg)
    for tolerance in (0.01, 0.02, 0.05, 0.1, 0.2):
        levels = decide(small, tolerance).levels
        assert levels
        assert levels.grains is not level("grains", "paper's K, fast")


def test_without_a_tolerance_the_error_of_the_own_levels_is_given(pile: MakePile) -> None:
    fast = level("grains", "1 layer, fast")
    decision = decide(fast.answer(pile()), None)
    assert decision.is_as_asked
    assert decision.levels == (level("flow", "standard"), fast)
    assert decision.error_estimate == on_levels(pile(), decision.levels, "").error_estimate
    assert decide(pile(), None).levels == (level("flow", "standard"), AS_ASKED)


@pytest.mark.parametrize("model", ["flat", "solve"])
def test_over_a_level_bed_the_flow_is_exact_and_the_grains_are_chosen(
    model: str, pile: MakePile
) -> None:
    bed = {"packing": "poured", "shape": "flat", "slope_deg": 0.0}
    asked = pile({"flow.model": model}, **bed)
    assert calibration.classes("flow", asked) == (LEVEL_BED,)
    for tolerance in (0.9, 0.7, 0.1):
        chosen = decide(asked, tolerance)
        assert chosen.levels
        assert chosen.levels.flow is FLAT
        assert chosen.scene.flow.model == "flat"
    assert chosen.levels
    overruled = decide(asked, 0.9, Bound(FLAT, chosen.levels.grains, "overruled"))
    assert overruled.levels
    assert GRAINS.index(overruled.levels.grains) > GRAINS.index(chosen.levels.grains)


def test_levels_that_were_overruled_are_not_chosen_again(pile: MakePile) -> None:
    first = decide(pile(), 0.2)
    assert first.levels
    again = decide(pile(), 0.2, Bound(*first.levels, "DEM overruled them"))
    assert again.levels
    for part, before, after in zip(LEVELS.values(), first.levels, again.levels, strict=True):
        assert part.index(after) > part.index(before)
    assert again.why.endswith("; DEM overruled them")
    last = decide(pile(), 0.2, Bound(FLOW[-1], because="they failed"))
    assert last.is_as_asked
    assert last.why.endswith("; they failed")


@pytest.mark.parametrize(("slope", "angle", "method"), [(20.0, 60.0, "pivot"), (69.0, 20.0, "dem")])
def test_a_single_grain_needs_no_levels(slope: float, angle: float, method: str) -> None:
    text = f"""
        grain = {{ diameter = 1e-3, friction_angle_deg = 80.0 }}
        bed = {{ kind = "grain", slope_deg = {slope}, entrainment_angle_deg = {angle} }}
    """
    (scene,) = study.parse(text, name="one", where="test").scenes
    chosen = decide(scene, 0.05)
    assert chosen.scene.protocol.method == method
    assert (chosen.levels, chosen.error_estimate) == (None, None)
    assert math.isinf(as_asked(scene).known.error)


OPEN = """
{top}
[grain]
diameter = {diameter}
[bed]
kind = "pile"
slope_deg = 15.0
{bed}
[protocol]
{protocol}
"""


def _asked(top: str = "", bed: str = "", protocol: str = "", diameter: float = 1e-3) -> study.Study:
    text = OPEN.format(top=top, bed=bed, protocol=protocol, diameter=diameter)
    return study.parse(text, name="own", where="own")


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("diameter", [2e-4, 1e-3])
def test_the_default_errs_less_than_the_model_is_worth(packing: str, diameter: float) -> None:
    (scene,) = _asked(bed=f'packing = "{packing}"', diameter=diameter).scenes
    chosen = by_default(scene)
    assert chosen.by_default
    assert chosen.scene.protocol.method != "dem"
    assert chosen.scene.flow.model == "solve"
    assert chosen.known.total <= lowest_floor() <= floor(model_class(scene))
    assert chosen.levels
    again = by_default(scene, Bound(*chosen.levels, "a run failed"))
    assert again.known.cost_core_s > chosen.known.cost_core_s
    assert "a run failed" in again.why


@pytest.mark.parametrize(
    ("top", "bed", "protocol"),
    [
        ("", "", 'method = "dem"'),  # what is the default counts as said
        ("", "", "load_increment = 0.05"),
        ("", "mobile_layers = 1", ""),
        ("", 'packing = "poured"', ""),
        ("", 'shape = "dune"', ""),
        ("tolerance = 0", "", ""),
    ],
)
def test_what_a_file_says_stays(top: str, bed: str, protocol: str) -> None:
    (decision,) = plan.make(_asked(top, bed, protocol)).decisions.values()
    assert decision.is_as_asked
    assert not decision.by_default
    assert decision.scene.protocol.method == "dem"


def test_what_is_asked_of_nature_does_not_count_as_said() -> None:
    asked = _asked(bed="height = 0.01", protocol="fractions = [0.3]")
    (decision,) = plan.make(asked).decisions.values()
    assert decision.by_default
