"""Laws of a tolerance, over random scenes, tolerances and tables of errors."""

import math
import warnings
from typing import Any

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from orchestrator.errors import InputError
from orchestrator.fidelity import choice
from orchestrator.fidelity.choice import Way
from orchestrator.fidelity.decision import checks, decide, written
from orchestrator.fidelity.fidelities import PAIRS
from orchestrator.fidelity.known import Known
from orchestrator.fidelity.measured import Error, Measured
from orchestrator.study import study
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

FRACTIONS = (0.1, 0.3, 0.5, 0.7)
BASE = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", slope_deg = 20.0, height = 0.02 }
"""
SLOW = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
TOLERANCES = st.floats(0.005, 0.6)
FLUIDS: list[dict[str, Any]] = [
    {},
    {"fluid.viscosity": 1e-3},
    {"fluid.kind": "water", "grain.density": 2650.0, "forces.law": "bridged"},
]


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """A pile of any kind that a study file may have."""
    (base,) = study.parse(BASE, name="laws", where="laws").scenes
    diameter = draw(st.sampled_from([1e-4, 3e-4, 5e-4, 1e-3, 2e-3]))
    fields: dict[str, Any] = {
        "grain.diameter": diameter,
        "bed.height": diameter * draw(st.floats(6.0, 60.0)),
        "bed.roughness": diameter / draw(st.sampled_from([10.0, 30.0])),
        "bed.slope_deg": draw(st.floats(8.0, 31.0)),
        "method.kind": draw(st.sampled_from(["auto", "dem"])),
        "threshold.fractions": tuple(
            sorted(draw(st.sets(st.sampled_from(FRACTIONS), min_size=1)))
        ),
        "forces.law": draw(st.sampled_from(["low", "high", "bridged"])),
        "forces.stress": draw(st.sampled_from(["wall", "eq10"])),
        "bed.shape": draw(st.sampled_from(["triangle", "dune", "cosine"])),
        "method.grains.load_increment": draw(st.sampled_from([0.01, 0.02, 0.03])),
        "method.flow.cells_per_face": draw(st.sampled_from([10, 20, 40, 80])),
        **draw(st.sampled_from(FLUIDS)),
    }
    packing = draw(st.sampled_from(["aligned", "horizontal", "disordered", "poured"]))
    fields["bed.packing"] = packing
    if packing == "disordered":
        fields["bed.disorder"] = draw(st.sampled_from([0.01, 0.02, 0.2]))
    if packing == "poured":
        fields |= {"bed.shape": "triangle", "bed.height": 12 * diameter}
        fields["grain.sizes"] = {"sigma_g": 1.3}
    if draw(st.booleans()):
        fields |= {"flow.top": "open water", "flow.depth": 5 * fields["bed.height"]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            scene = changed(base, fields)
            choice.cost_s(written(scene))
        except (InputError, UnfitError):
            assume(False)
    return scene


def _within(scene: Scene, tolerance: float) -> int:
    """How many thresholds of a scene are known to be within a tolerance."""
    answer = decide(scene, tolerance)
    errors = map(answer.error_at, scene.threshold.fractions)
    return sum(error is not None and error <= tolerance for error in errors)


@SLOW
@given(scene=scenes(), one=TOLERANCES, other=TOLERANCES)
def test_a_looser_tolerance_never_costs_more_and_never_has_less_within_it(
    scene: Scene, one: float, other: float
) -> None:
    tight, loose = sorted((one, other))
    costs = [choice.cost_s(decide(scene, most).scene) for most in (tight, loose)]
    assert costs[1] <= costs[0] * (1 + 1e-9)
    assert _within(scene, loose) >= _within(scene, tight)


@SLOW
@given(scene=scenes(), tolerance=TOLERANCES)
def test_no_tolerance_costs_more_than_the_scene_as_written(
    scene: Scene, tolerance: float
) -> None:
    """Nor does it with the check by DEM, of one scene or of several that share one."""
    assert isinstance(scene.bed, PileBed)
    others = [changed(scene, {"bed.height": f * scene.bed.height}) for f in (1.1, 1.2)]
    for alike in ([scene], [scene, *others]):
        answers = [decide(each, tolerance) for each in alike]
        made = checks(answers)
        spent: dict[str, float] = {}
        whole: dict[str, float] = {}
        for answer in (*answers, *made.values()):
            spent |= choice.runs_of(answer.scene)
        for each in alike:
            whole |= choice.runs_of(written(each))
        assert sum(spent.values()) <= sum(whole.values()) * (1 + 1e-9)
        assert len(alike) > 1 or not made


@st.composite
def ways(draw: st.DrawFn) -> list[Way]:
    """Ways of random costs and errors."""
    (scene,) = study.parse(BASE, name="laws", where="laws").scenes
    sizes = st.floats(1e-4, 1.0)
    found = []
    for fidelity in PAIRS[: draw(st.integers(1, 8))]:
        errors = tuple(
            Error(draw(sizes), draw(st.one_of(st.none(), sizes))) for _ in FRACTIONS
        )
        known = Known((Measured(FRACTIONS, errors),), FRACTIONS)
        found.append(Way(fidelity, scene, known, draw(st.floats(0.01, 10.0))))
    return found


def _met(way: Way, most: float) -> int:
    return len(FRACTIONS) - len(choice.beyond(way, most))


@settings(max_examples=300, deadline=None)
@given(ways=ways(), one=TOLERANCES, other=TOLERANCES)
def test_the_laws_hold_whatever_was_measured(
    ways: list[Way], one: float, other: float
) -> None:
    offers = choice.offered(ways, math.inf)
    tight, loose = (choice.chosen(offers, most) for most in sorted((one, other)))
    assert loose.cost_s <= tight.cost_s
    assert _met(loose, max(one, other)) >= _met(tight, min(one, other))
    # what is offered is not beaten, and where all is within the tolerance nothing
    # cheaper that is offered is
    for offer in offers:
        for way in ways:
            beaten = way.cost_s < offer.cost_s and all(
                way.known.at(at).total <= offer.known.at(at).total for at in FRACTIONS
            )
            assert not beaten
    if _met(tight, min(one, other)) == len(FRACTIONS):
        for offer in offers:
            if offer.cost_s < tight.cost_s:
                assert _met(offer, min(one, other)) < len(FRACTIONS)
    # what is within the tolerance everywhere is found
    most = max(one, other)
    if any(_met(offer, most) == len(FRACTIONS) for offer in offers):
        assert _met(loose, most) == len(FRACTIONS)
    # where nothing is, nothing that is offered has a smaller largest error
    elif loose.cost_s == offers[-1].cost_s:
        assert loose.known.total == min(offer.known.total for offer in offers)


@settings(max_examples=200, deadline=None)
@given(ways=ways(), most_s=st.floats(0.01, 10.0))
def test_nothing_is_offered_above_the_cost_as_written(
    ways: list[Way], most_s: float
) -> None:
    offers = choice.offered(ways, most_s)
    assert all(way.cost_s <= most_s * (1 + 1e-9) for way in offers)
    assert bool(offers) == any(way.cost_s <= most_s * (1 + 1e-9) for way in ways)
