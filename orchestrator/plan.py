"""From scenes to cases: which runs a study needs, shared where scenes agree."""

import time
import timeit
from collections import Counter
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from orchestrator.digits import number, percent
from orchestrator.errors import InputError
from orchestrator.fidelity import decision, few, flows, limits, measured, smoothing
from orchestrator.fidelity.decision import Decision, as_written, decide
from orchestrator.fidelity.domain import unmeasured
from orchestrator.fidelity.few import Corrected
from orchestrator.flow.between import MOST_ERROR
from orchestrator.grains.cells import SingleGrainCase, batches
from orchestrator.grains.pile import Pile
from orchestrator.runs import reuse
from orchestrator.runs.case import Case, is_whole
from orchestrator.runs.engine import human
from orchestrator.study.closed_form import law_holds, regime_of
from orchestrator.study.own_errors import OwnErrors
from orchestrator.study.parts import PileBed
from orchestrator.study.study import Study

START_S, SCENE_S, GRAIN_S = 2.5, 4e-3, 4e-5
"""Times of imports and first figures, of a scene, and of a grain of a bed without a
run, s."""
BESIDE = 1.3
"""Time of a case with the Python beside its solver, over that of the solver."""
SORT_S = 4.3e-3
"""Time of `pace` on the machine of these times and of those that cases expect, s."""
TOLERANCES = (0.05, 0.2)
"""Tolerances of which a plan says what they cost."""
BYTES = 2.2e6
"""Mean size of a case of the preset `paper`."""
BY_DEM = (
    'method.kind = "dem", without a tolerance, answers its scenes as they are written'
)
"""What to do where a run of a chosen fidelity has failed."""


@dataclass(frozen=True)
class Plan:
    """How the scenes of a study are answered, and by which cases.

    Attributes
    ----------
    decisions
        The decisions, by the id of the scene that was asked for.
    piles
        The piles that answer, by the same id.
    cells
        Cases of single grains, each of which answers its grains.
    checks
        Piles by DEM that check an answer without DEM, by the same id.
    checked
        The decisions on these, by the same id.
    cases
        Every run once, by name, after those whose results it needs.
    smoothings
        Noisy profiles with other smoothing, by the same id and by the factor of the
        smoothing.
    """

    decisions: dict[str, Decision]
    piles: dict[str, Pile]
    cells: tuple[SingleGrainCase, ...]
    checks: dict[str, Pile]
    checked: dict[str, Decision]
    cases: dict[str, Case]
    smoothings: dict[str, dict[float, Pile]] = field(default_factory=dict)

    @property
    def cost_s(self) -> float:
        """Expected time of all cases on one core, s."""
        return sum(case.cost_s for case in self.cases.values())

    @property
    def drawing_s(self) -> float:
        """Expected time of tables, figures and grains without a run, s."""
        without_run = [pile for pile in self.piles.values() if not pile.method.cases]
        lengths = sum(pile.length for pile in without_run)
        return START_S + SCENE_S * len(self.decisions) + GRAIN_S * lengths

    @property
    def chosen(self) -> frozenset[str]:
        """The names of the cases that only chosen fidelities need.

        A case that a scene needs as it is written, or a check by DEM, is not among
        them.
        """
        piles = [*self.checks.values()]
        for asked, pile in self.piles.items():
            if not self.decisions[asked].is_chosen:
                piles.append(pile)
        for smoothed in self.smoothings.values():
            piles += smoothed.values()
        needed = {cell.name for cell in self.cells}
        for pile in piles:
            needed.update(run.name for run in pile.runs)
        return frozenset(self.cases) - needed

    @property
    def ids(self) -> dict[str, str]:
        """The ids of the cases, by name."""
        return {name: case.id for name, case in self.cases.items()}

    def missing(self, directory: Path, done: Container[str]) -> dict[str, Case]:
        """List the cases to be run.

        Parameters
        ----------
        directory
            The directory of the cases.
        done
            Names of the cases that are done.

        Returns
        -------
        dict of str to Case
            Those not done, and those pruned that they need, by name.
        """
        missing = {name: case for name, case in self.cases.items() if name not in done}
        starts = {}
        for case in missing.values():
            if not case.needs_bulky:
                continue
            for need in case.needs:
                if not is_whole(need, directory):
                    starts[need.name] = need
        return starts | missing


def make(study: Study, cases: Path | None = None) -> Plan:
    """Decide how each scene of a study is answered, and list the cases that it needs.

    Parameters
    ----------
    study
        The study.
    cases
        The directory of the runs, where the grains of poured beds are read.

    Returns
    -------
    Plan
        The plan.

    Raises
    ------
    InputError
        With the field, for a scene beyond a limit of the methods or a flow that cannot
        be solved.
    """
    limits.check_study(study)
    measured.use(study.errors.tables if study.errors else measured.FOLDER)
    decisions = {scene.id: decide(scene, study.tolerance) for scene in study.scenes}
    if study.errors:
        decisions = _by_own_errors(study, study.errors, decisions)
    if not study.tolerance:
        return of(decisions, {}, cases)
    answers = few.shared(decisions, study.tolerance)
    checks = decision.checks(answers.values())
    planned = of(*flows.shared(answers, checks), cases)
    return refined(planned, cases) if cases else planned


def refined(plan: Plan, cases: Path) -> Plan:
    """Run what finished runs show to be missing.

    That are flows that do not lie between solved ones, and piles by DEM for which the
    factors of few are not enough.

    Parameters
    ----------
    plan
        The plan.
    cases
        The directory of the runs.

    Returns
    -------
    Plan
        The same plan where there are none.
    """
    while groups := _refined(plan, cases):
        plan = of(*groups, cases)
    return plan


def _refined(
    plan: Plan, cases: Path
) -> tuple[Mapping[str, Decision], Mapping[str, Decision]] | None:
    """The decisions and checks of a plan that finished runs have changed, if any."""
    if groups := flows.solved(plan.decisions, plan.checked, cases):
        return groups
    answers = few.solved(plan.decisions, plan.piles, cases)
    return (answers, plan.checked) if answers else None


def _by_own_errors(
    study: Study, errors: OwnErrors, decisions: Mapping[str, Decision]
) -> dict[str, Decision]:
    """Note by whose errors piles are answered; refuse one that these do not hold."""
    found = dict(decisions)
    for group in study.groups:
        for scene in group.scenes:
            answer = decisions[scene.id]
            if not isinstance(scene.bed, PileBed):
                continue
            beyond = unmeasured(answer.scene)
            if beyond:
                what = f"the ladder of --errors has no error for {beyond}"
                remedy = "measure such a scene: orchestrator ladder FILE --out DIR"
                raise InputError(what, group.where, remedy)
            why = f"{answer.why}; numerical errors of {errors.name}"
            found[scene.id] = replace(answer, why=why)
    return found


def of(
    decisions: Mapping[str, Decision],
    checks: Mapping[str, Decision] | None = None,
    cases: Path | None = None,
) -> Plan:
    """List the cases that some decisions and some `checks` need.

    Parameters
    ----------
    decisions
        The decisions, by the id of the asked scene.
    checks
        Decisions on piles by DEM that check answers, by the same id.
    cases
        The directory of the runs, where the grains of poured beds are read.

    Returns
    -------
    Plan
        The plan.
    """
    piles = _piles(decisions, cases)
    checking = _piles(checks or {}, cases)
    grains = {}
    for asked, answer in decisions.items():
        if asked not in piles and answer.scene.method.facts.needs_run:
            grains[answer.scene.id] = answer.scene
    cells = tuple(batches(grains.values()))
    every = [*piles.values(), *checking.values()]
    smoothings = {}
    for asked, pile in piles.items():
        scenes = smoothing.compared(pile.scene)
        if scenes:
            made = {factor: Pile(scene, cases) for factor, scene in scenes.items()}
            smoothings[asked] = made
            every += made.values()
    runs: list[Case] = []
    for pile in every:
        runs += pile.runs
    listing = with_needs((*runs, *cells))
    checked = dict(checks or {})
    return Plan(dict(decisions), piles, cells, checking, checked, listing, smoothings)


def _piles(decisions: Mapping[str, Decision], cases: Path | None) -> dict[str, Pile]:
    """The piles that answer, by the keys of their decisions."""
    piles: dict[str, Pile] = {}
    for asked, answer in decisions.items():
        if isinstance(answer.scene.bed, PileBed):
            piles[asked] = Pile(answer.scene, cases)
    return few.with_corrections(piles, decisions)


def with_needs(cases: Iterable[Case]) -> dict[str, Case]:
    """List some cases and all that they need.

    Parameters
    ----------
    cases
        The cases.

    Returns
    -------
    dict of str to Case
        Each case once, by name, behind those whose results it needs.
    """
    found: dict[str, Case] = {}

    def add(cases: Iterable[Case]) -> None:
        for case in cases:
            if case.name not in found:
                add(case.needs)
                found[case.name] = case

    add(cases)
    return {name: case for name, case in found.items() if not case.needs} | found


def of_cases(cases: Iterable[Case]) -> Plan:
    """Plan runs that answer no scene by themselves.

    Parameters
    ----------
    cases
        The cases.

    Returns
    -------
    Plan
        The plan of them and of all that they need.
    """
    return Plan({}, {}, (), {}, {}, with_needs(cases))


def forecast(study: Study, directory: Path, workers: int) -> Iterator[str]:
    """Say what a study would run.

    Parameters
    ----------
    study
        The study.
    directory
        The directory of the cases.
    workers
        How many cases run at a time.

    Yields
    ------
    str
        Lines of text: scenes with their regimes, cases by kind, expected time and disk.
    """
    plan = make(study, directory)
    regimes = _counted(regime_of(scene) for scene in study.scenes)
    yield f"{study.title}: {number(len(study.scenes), 'scene')}; regimes: {regimes}"
    outside = sum(not law_holds(scene) for scene in study.scenes)
    if outside:
        yield f"  in {outside} the force law does not hold for a single grain"
    reasons = Counter(answer.why for answer in plan.decisions.values())
    for why, times in reasons.most_common():
        yield f"  {times} answered: {why}"
    for why, times in Counter(_not_usable(plan, study.tolerance)).most_common():
        thresholds = number(times, "threshold")
        yield f"  {thresholds} of piles will not be usable: {why}"
    if plan.checks:
        yield f"  {number(len(plan.checks), 'check')} by DEM of answers without it:"
        named = Counter(_about(pile) for pile in plan.checks.values())
        yield from (f"    {name}" for name in sorted(named))
    yield from _few(plan, pace() * BESIDE / workers)
    put = flows.lying([*plan.decisions.values(), *plan.checked.values()])
    if put:
        between = "lie between solved ones of other roughness"
        more_s = pace() * BESIDE / workers * sum(flow.cost_s for flow in put)
        most = f"solved too if that differs by more than {percent(MOST_ERROR, 1)}"
        yield f"  {number(len(put), 'flow')} {between}; {most}: {human(more_s)} more"
    if plan.smoothings:
        noisy = number(len(plan.smoothings), "noisy profile")
        other = "half and twice the smoothing, and with what it needs"
        yield f"  {noisy}: also with {other}"
    yield from _choices(study, plan, workers)
    yield from expected(plan, directory, workers)


def _few(plan: Plan, slower: float) -> Iterator[str]:
    """Say which piles DEM runs on so that it need not run on others, and the gain."""
    groups: dict[few.FewRuns, list[Corrected]] = {}
    for answer in plan.decisions.values():
        if isinstance(answer, Corrected):
            groups.setdefault(answer.few, []).append(answer)
    for runs, answers in groups.items():
        instead = [Pile(one.instead.scene) for one in answers]
        spared_s = slower * sum(pile.case.cost_s for pile in instead)
        by_dem = [plan.piles[asked] for asked in (*runs.design, *runs.kept)]
        cost_s = slower * sum(pile.case.cost_s for pile in by_dem)
        yield f"  {number(len(answers), 'pile')} by {runs.in_words}"
        cost = f"{human(cost_s)} of DEM in place of {human(cost_s + spared_s)}"
        yield f"    {cost}, which it takes if their error is beyond the tolerance:"
        named = Counter(_about(pile) for pile in by_dem)
        yield from (f"      {name}" for name in sorted(named))


def _about(pile: Pile) -> str:
    """Name a pile by DEM."""
    scene = pile.scene
    size = f"{1e3 * scene.grain.diameter:g} mm"
    words = [f"{scene.bed.slope_deg:g}°", size, pile.bed.packing, scene.forces.law]
    return f"{', '.join(words)}: {pile.case.name}"


def _choices(study: Study, plan: Plan, workers: int) -> Iterator[str]:
    """Say what the study takes with each tolerance, and what is known within it.

    The times are those of `expected` where no case is done.
    """
    piles = [one for one in study.scenes if isinstance(one.bed, PileBed)]
    if not piles:
        return
    count = sum(len(scene.threshold.fractions) for scene in piles)
    tolerances = sorted({*TOLERANCES, *filter(None, [study.tolerance])})
    told = f"time of the whole study by tolerance, {number(workers, 'worker')}"
    yield f"{told}; how many of {count} thresholds are known to be within it:"
    for tolerance in tolerances:
        made = plan
        if tolerance != study.tolerance:
            made = make(replace(study, tolerance=tolerance))
        within = 0
        for answer in made.decisions.values():
            if isinstance(answer.scene.bed, PileBed):
                errors = map(answer.error_at, answer.scene.threshold.fractions)
                within += sum(one is not None and one <= tolerance for one in errors)
        took = _whole(made, workers)
        yield f"  tolerance {tolerance:g}: {took}, {within} known within it"
    free = make(replace(study, tolerance=None)) if study.tolerance else plan
    yield f"  no tolerance: {_whole(free, workers)}"
    whole = of({scene.id: as_written(scene) for scene in study.scenes})
    if any(scene.method.is_open for scene in piles):
        yield f"  by DEM where it can: {_whole(whole, workers)}"
    if study.tolerance and plan.cost_s > whole.cost_s:
        dearer = "costs more than the study as written: leave it out"
        yield f"  tolerance {study.tolerance:g} {dearer}"


def _whole(plan: Plan, workers: int) -> str:
    """Expected time of all of a plan, if nothing of it were done."""
    return f"about {human(sum(_wall_s(plan, plan.cases.values(), workers)))}"


def _not_usable(plan: Plan, tolerance: float | None) -> Iterator[str]:
    """Why thresholds of piles will not be usable whatever their runs give."""
    for answer in plan.decisions.values():
        scene = answer.scene
        if not isinstance(scene.bed, PileBed):
            continue
        is_plane = scene.is_poured and not scene.bed.width
        for fraction in scene.threshold.fractions:
            error = answer.error_at(fraction)
            if is_plane and scene.grain.sizes is None:
                yield "equal spheres in one plane settle into a crystal"
            elif error is None:
                remedy = decision.of_unknown_error(answer, fraction, tolerance)
                yield f"{decision.NOT_MEASURED} ({remedy})"
            elif tolerance is not None and error > tolerance * (1 + 1e-9):
                yield "no fidelity is known to be within the tolerance"


def expected(
    plan: Plan, directory: Path, workers: int, beside: Sequence[Path] = ()
) -> Iterator[str]:
    """Say how long the cases of a plan take.

    Parameters
    ----------
    plan
        The plan.
    directory
        The directory of the cases.
    workers
        How many cases run at a time.
    beside
        Other directories of results, from which finished cases are taken.

    Yields
    ------
    str
        Lines of text: cases by kind, expected time and disk.
    """
    found = reuse.elsewhere(plan.cases, directory, beside)
    done = {*reuse.done(plan.cases, directory, holds=False), *found}
    missing = plan.missing(directory, done).values()
    kinds = _counted(case.kind for case in plan.cases.values()) or "none"
    todo = _counted(case.kind for case in missing) or "none"
    yield f"{number(len(plan.cases), 'case')}: {kinds}; to run: {todo}"
    for root, count in Counter(cases.parent for cases in found.values()).items():
        yield f"  {count} done in {root}"
    runs, drawing = _wall_s(plan, missing, workers)
    wall = f"about {human(runs + drawing)} with {number(workers, 'worker')}"
    rest = f"{human(drawing)} of them for tables and figures"
    yield f"expected: {wall}, {rest}; {len(missing) * BYTES / 1e6:.0f} MB"


def _wall_s(plan: Plan, missing: Collection[Case], workers: int) -> tuple[float, float]:
    """Expected times of some cases of a plan, and of its tables and figures, s.

    A chain of cases takes at least the sum of its times, however many run beside it.
    """
    walls = {case.name: case.cost_s / min(case.ranks, workers) for case in missing}
    longest_s = 0.0
    for case in missing:
        chain_s = sum(walls.get(run.name, 0.0) for run in (case, *case.needs))
        longest_s = max(longest_s, chain_s)
    alone_s = sum(case.cost_s for case in missing)
    slower = pace()
    runs_s = slower * BESIDE * max(alone_s / workers, longest_s)
    return runs_s, slower * plan.drawing_s


@cache  # the times that a plan says are of one moment
def pace() -> float:
    """Measure how slow this machine is.

    Returns
    -------
    float
        Time of a fixed calculation over that on the machine on which the cases' times
        were found.
    """
    sort = partial(np.sort, np.random.default_rng(0).random(100_000), kind="stable")
    return min(timeit.repeat(sort, timer=time.process_time, number=1)) / SORT_S


def _counted(names: Iterable[str]) -> str:
    """Each name with how often it is there."""
    return ", ".join(f"{name} {count}" for name, count in Counter(names).most_common())
