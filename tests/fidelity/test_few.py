"""Few piles by DEM that correct many others: which they are, what they hold, what they cost."""

from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from orchestrator import pipeline, plan
from orchestrator.digits import percent
from orchestrator.fidelity import choice, decision, few, measured
from orchestrator.fidelity.classes import GRAINS, scene_class
from orchestrator.fidelity.decision import Decision, as_written
from orchestrator.fidelity.few import Corrected
from orchestrator.fidelity.fidelities import PAIRS
from orchestrator.grains import corrected as corrections
from orchestrator.grains.corrected import CorrectedPile, Correction, Pair
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.study import study
from orchestrator.study.study import Study
from orchestrator.tables.quantities import shields

TOLERANCE = 0.08
"""Between the errors of DEM and of pivots on lifted grains."""
PILES = """
tolerance = {tolerance}
fluid.kind = "paper"
forces.law = "low"
method = {{ kind = "{kind}" }}
bed = {{ kind = "pile", roughness = "d/30" }}
grain = {{ diameter = 5e-4, density = 2500.0, friction_angle_deg = 35.0 }}
[axes]
"bed.slope_deg" = {slopes}
"bed.height" = {heights}
"""
HEIGHTS = tuple(round(5e-4 * k, 7) for k in np.linspace(13, 17, 16).tolist())


@cache
def asked(
    heights: tuple[float, ...] = HEIGHTS,
    slopes: tuple[float, ...] = (16.0, 18.0),
    tolerance: float = TOLERANCE,
    kind: str = "auto",
) -> Study:
    text = PILES.format(
        tolerance=tolerance, heights=[*heights], slopes=[*slopes], kind=kind
    )
    return study.parse(text, name="lifted", where="test")


decide = cache(decision.decide)  # each asks for the costs of many cases


def decided(of: Study) -> dict[str, Decision]:
    assert of.tolerance
    found = {scene.id: decide(scene, of.tolerance) for scene in of.scenes}
    return dict(few.shared(found, of.tolerance))


def corrected_of(answers: dict[str, Decision]) -> dict[str, Corrected]:
    return {key: one for key, one in answers.items() if isinstance(one, Corrected)}


def by_dem_of(answers: dict[str, Decision]) -> set[str]:
    return {key for key, one in answers.items() if one.scene.method.is_resolved_in_time}


def test_of_many_piles_that_need_dem_it_runs_on_some() -> None:
    answers = decided(asked())
    spared = corrected_of(answers)
    (runs,) = {one.few for one in spared.values()}
    assert len(runs.kept) == 19
    assert len(runs.design) == 2 * few.DESIGNED
    assert not set(runs.kept) & set(runs.design)
    assert by_dem_of(answers) == {*runs.kept, *runs.design}
    assert spared.keys() == answers.keys() - by_dem_of(answers)
    assert {one.scene.method.kind for one in spared.values()} == {"pivot"}
    # the flow stays what it would be by DEM
    for one in spared.values():
        slope = one.asked.bed.slope_deg
        assert one.stratum == (slope, one.asked.forces.law)
        assert one.scene.method.flow == one.instead.scene.method.flow
        assert one.by_dem.scene == one.instead.scene
    # each slope gives factors, of its least pile and its largest
    for slope in (16.0, 18.0):
        heights = [
            answers[one].asked.bed.relief  # type: ignore[union-attr]
            for one in runs.design
            if answers[one].asked.bed.slope_deg == slope
        ]
        assert min(heights) == pytest.approx(min(HEIGHTS))
        assert max(heights) == pytest.approx(max(HEIGHTS))


def test_the_piles_are_the_same_in_any_order() -> None:
    first = next(iter(corrected_of(decided(asked())).values())).few
    turned = asked(HEIGHTS[::-1], (18.0, 16.0))
    other = next(iter(corrected_of(decided(turned)).values())).few
    assert (first.design, first.kept) == (other.design, other.kept)


@pytest.mark.parametrize(
    ("heights", "kept"), [(HEIGHTS[:6], 0), (HEIGHTS[:8], 9), (HEIGHTS, 19)]
)
def test_fewer_piles_keep_fewer_apart(heights: tuple[float, ...], kept: int) -> None:
    spared = corrected_of(decided(asked(heights)))
    assert bool(spared) == bool(kept)
    for one in spared.values():
        assert len(one.few.kept) == kept
        assert f"{kept} kept apart ({percent(kept / (kept + 1))})" in one.why


@pytest.mark.parametrize("tolerance", [0.05, 0.2])
def test_where_dem_is_not_chosen_or_not_within_the_tolerance_nothing_changes(
    tolerance: float,
) -> None:
    """At 5 % DEM itself is beyond it, at 20 % pivots are within it."""
    assert not corrected_of(decided(asked(tolerance=tolerance)))


def test_a_study_by_dem_keeps_its_runs() -> None:
    by_dem = replace(asked(kind="dem"), tolerance=None)
    made = plan.make(by_dem)
    assert not any(isinstance(each, CorrectedPile) for each in made.piles.values())
    assert len(by_dem_of(made.decisions)) == len(by_dem.scenes)


def _cost(answers: dict[str, Decision]) -> float:
    spent: dict[str, float] = {}
    for one in answers.values():
        spent |= choice.runs_of(one.scene)
    return sum(spent.values())


POOL = asked(HEIGHTS[::2]).scenes
TOLERANCES = st.sampled_from([0.03, 0.0605, 0.07, 0.085, 0.2])


@settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    scenes=st.sets(st.sampled_from(range(len(POOL))), min_size=1),
    one=TOLERANCES,
    other=TOLERANCES,
)
def test_the_laws_of_a_tolerance_hold_for_studies_of_many_piles(
    scenes: set[int], one: float, other: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(few, "KEPT", (4, 2))
    monkeypatch.setattr(few, "DESIGNED", 2)
    chosen = [POOL[at] for at in scenes]
    costs, within = [], []
    for tolerance in sorted((one, other)):
        alone = {scene.id: decide(scene, tolerance) for scene in chosen}
        shared = dict(few.shared(alone, tolerance))
        failed = dict(shared)
        for key, answer in corrected_of(shared).items():
            failed[key] = answer.by_dem
        whole = {scene.id: as_written(scene) for scene in chosen}
        # neither what is spared nor what runs after all costs more than DEM on each
        assert _cost(shared) <= _cost(alone) * (1 + 1e-9)
        assert _cost(failed) == pytest.approx(_cost(alone))
        assert _cost(shared) <= _cost(whole) * (1 + 1e-9)
        if corrected_of(shared):
            assert _cost(shared) < _cost(alone)
        costs.append(_cost(shared))
        errors = [
            answer.error_at(fraction)
            for answer in shared.values()
            for fraction in answer.scene.threshold.fractions
        ]
        within.append(sum(error is not None and error <= tolerance for error in errors))
    assert costs[1] <= costs[0] * (1 + 1e-9)
    assert within[1] >= within[0]


def test_the_plan_says_what_runs_by_dem_and_what_it_spares() -> None:
    told = [*plan.forecast(asked(), Path("none"), 1)]
    (line,) = [
        each for each in told if "kept apart (95 %)" in each and "7 piles" in each
    ]
    assert "the method pivot, with factors of 6 piles by DEM" in line
    at = told.index(line)
    assert "of DEM in place of" in told[at + 1]
    named = [each for each in told[at + 2 :] if each.startswith("      ")]
    assert sum(": pile-" in each for each in named) == 6 + 19


class Fake:
    """A pile with given stresses."""

    def __init__(self, *tau: float) -> None:
        self.tau = tau
        self.runs = ()

    def thresholds(self, *_: Any) -> list[SimpleNamespace]:
        return [SimpleNamespace(tau=tau) for tau in self.tau]


def pair(stratum: str, plain: float, by_dem: float) -> Pair:
    return Pair(stratum, cast(Any, Fake(plain)), cast(Any, Fake(by_dem)))


def made_of(
    design: list[Pair], kept: list[Pair], monkeypatch: pytest.MonkeyPatch
) -> Correction:
    def scaled(plain: Fake, by: Correction, stratum: str) -> Fake:
        return Fake(*(plain.tau * by.factors(stratum, Path())))

    monkeypatch.setattr(corrections, "corrected", scaled)
    return Correction((0.5,), tuple(design), tuple(kept))


def test_factors_are_of_the_design_and_errors_of_those_kept_apart(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    design = [pair("a", 1.0, 2.0), pair("a", 1.0, 2.2), pair("a", 1.0, 9.0)]
    design += [pair("b", 2.0, 3.0)]
    # one is below, the other above
    kept = [pair("a", 2.0, 4.0), pair("a", 2.0, 5.0), pair("b", 1.0, 1.5)]
    made = made_of(design, kept, monkeypatch)
    # the median: a chain that goes at once does not move it
    assert made.factors("a", Path()) == pytest.approx([2.2])
    assert made.factors("b", Path()) == pytest.approx([1.5])
    assert (made.made_from("a"), made.made_from("b")) == (3, 1)
    assert made.error(0.5, Path()) == pytest.approx(0.12)
    assert made.error(0.1, Path()) == np.inf
    assert made.confidence == pytest.approx(3 / 4)


def test_between_two_fractions_the_larger_error_holds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = made_of([pair("a", 1, 2)], [], monkeypatch)
    of_two = replace(made, fractions=(0.1, 0.5))
    monkeypatch.setattr(Correction, "errors", lambda *_: np.array([0.3, 0.2]))
    found = [of_two.error(fraction, Path()) for fraction in (0.1, 0.3, 0.5)]
    assert found == [0.3, 0.3, 0.2]


def test_factors_are_of_dem_over_what_is_corrected_and_name_their_runs() -> None:
    made = plan.make(asked())
    piles = [one for one in made.piles.values() if isinstance(one, CorrectedPile)]
    assert len(piles) == 7
    for pile in piles:
        pairs = (*pile.correction.design, *pile.correction.kept)
        assert len(pairs) == 6 + 19
        for each in pairs:
            assert each.by_dem.scene.method.is_resolved_in_time
            assert each.plain.scene.method.kind == "pivot"
            assert each.plain.scene.bed == each.by_dem.scene.bed
        # an answer is not there before the runs are that its factor is read from
        of_factors = {run.name for each in pairs for run in each.by_dem.runs}
        named = {run.name for run in pile.runs}
        assert of_factors | {run.name for run in pile.own_runs} == named
        assert sum(name.startswith("pile-") for name in named) == 6 + 19


def test_what_is_corrected_has_the_least_error_at_its_worst_fraction(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (scene, *_) = asked().scenes
    rungs = {pair.grains.name: pair for pair in PAIRS if pair.grains.takes(scene)}
    plain = [name for name, pair in rungs.items() if not pair.is_resolved_in_time]
    first, second, *_ = plain
    errors = {first: {0.1: 0.01, 0.5: 0.5}, second: {0.1: 0.2, 0.5: 0.2}}

    def at(name: str, fraction: float) -> SimpleNamespace:
        return SimpleNamespace(total=errors[name][fraction])

    known = {
        (GRAINS, name, scene_class(GRAINS, scene)): SimpleNamespace(
            at=partial(at, name)
        )
        for name in errors
    }
    monkeypatch.setattr(measured, "errors", lambda: known)
    chosen = few._plain(scene, (0.1, 0.5))
    assert chosen is not None
    assert chosen.name == second


def test_factors_are_not_judged_before_all_of_their_runs_are_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = plan.make(asked())
    (first, *_) = [one for one in made.piles.values() if isinstance(one, CorrectedPile)]
    last = first.runs[-1].name
    monkeypatch.setattr(
        few,
        "done_state",
        lambda run, _: None if run.name == last else {"ended": "done"},
    )
    monkeypatch.setattr(Correction, "error", lambda *_: 0.5)
    assert plan.refined(made, tmp_path) is made


def test_what_a_pile_did_not_reach_is_not_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = made_of([pair("a", 1, 2)], [pair("a", 1, np.nan)], monkeypatch)
    assert made.error(0.5, Path()) == np.inf


def test_the_error_of_19_holds_95_percent_of_piles_in_neither_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of ratios of any distribution, drawn at random; 400 draws of 25 others."""
    rng = np.random.default_rng(1)
    held = []
    for _ in range(400):
        ratios = 2 * np.exp(0.05 * rng.standard_t(3, 47))
        pairs = [pair("a", 1.0, ratio) for ratio in ratios.tolist()]
        made = made_of(pairs[:3], pairs[3:22], monkeypatch)
        (factor,) = made.factors("a", Path())
        held.append(np.abs(factor / ratios[22:] - 1) <= made.error(0.5, Path()))
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_a_scaled_motion_has_the_same_order_and_flows_that_never_fall() -> None:
    motion = Motion.of_flows(np.array([1.0, 2.0, 3.0, 3.1]))
    scaled = motion.scaled((0.25, 0.75), [2.0, 3.0])
    assert scaled.flows == pytest.approx([2.0, 2.0 * 6**0.5, 9.0, 9.3])
    assert list(scaled.load_step) == list(motion.load_step)
    falling = motion.scaled((0.25, 0.75), [4.0, 1.0])
    assert (np.diff(falling.flow) >= 0).all()


@pytest.mark.parametrize(("error", "is_enough"), [(0.03, True), (0.06, False)])
def test_finished_runs_decide_whether_dem_runs_on_all(
    error: float, is_enough: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """DEM is within 6.04 % here: 5.2 % more lead out of a tolerance of 8 %."""
    made = plan.make(asked())
    monkeypatch.setattr(few, "done_state", lambda *_: {"ended": "done"})
    monkeypatch.setattr(Correction, "error", lambda *_: error)
    again = plan.refined(made, tmp_path)
    assert (again is made) == is_enough
    if not is_enough:
        alone = {one.id: decide(one, TOLERANCE).scene for one in asked().scenes}
        assert {key: one.scene for key, one in again.decisions.items()} == alone
        assert plan.refined(again, tmp_path) is again


def test_corrected_piles_on_the_real_solvers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(few, "KEPT", (2,))
    monkeypatch.setattr(few, "DESIGNED", 2)
    small = replace(asked(HEIGHTS[:5], (18.0,)), tolerance=0.088)
    out = tmp_path / "out"
    finished = pipeline.run(small, out, workers=2)
    assert not finished.failures
    table = pd.read_csv(out / "tables/pile_threshold.csv")
    is_corrected = table["correction"].notna()
    rows = table[is_corrected]
    assert rows["scene_id"].nunique() == 1
    assert len(list((out / "cases").glob("pile-*"))) == 4
    assert set(rows["correction_piles"]) == {2}
    assert set(rows["correction_kept"]) == {2}
    assert (rows["numerical_error"] >= rows["correction_error"]).all()
    assert (rows["numerical_error_count"] == 2).all()
    assert rows["numerical_error_coverage"].to_numpy() == pytest.approx(2 / 3)
    made = plan.make(small, out / "cases")
    for scene_id, found in rows.groupby("scene_id"):
        pile = made.piles[str(scene_id)]
        plain = Pile(pile.scene, pile.cases).thresholds(
            out / "cases", found["fraction"]
        )
        alone = [shields(pile.scene, one.tau) for one in plain]
        ratio = found["shields"].to_numpy() / alone
        assert ratio == pytest.approx(found["correction"].to_numpy(), rel=1e-6)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Some beds were corrected by DEM of others." in page
    again = pipeline.run(small, out, workers=2)
    assert again.started == 0
