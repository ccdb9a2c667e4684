"""The decision how a scene is answered: its fidelity levels, their known error, the reason.

A study with a tolerance is answered on the cheapest levels that are known to meet it. Of the piles
of each slope, packing and force law that are answered without DEM, the cheapest by DEM is answered
by DEM as well; where the two differ by more than the tolerance, all of them go to higher levels.
"""

import itertools
import math
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

from orchestrator.fidelity import levels
from orchestrator.fidelity.levels import LEVELS, LOCAL, Known, Level, Pair, changed, level, pair_of
from orchestrator.grains.loads import LONG, Geometry, has_rows_along
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study.fields import FIELDS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

Piles = Mapping[str, Pile]
Names = tuple[str, ...]
LEAST_HELD = 6.0  # waiting time, sqrt(d/g'), below which load steps are a ramp of the flow
ROUNDS = 4
ASKED = "as the study asks"
ALONG = f"more than {LONG:g} grains long: closed form along the bed, checked where motion starts"
ANSWERS = [q.name.split(".") for q in FIELDS if q.info.about == "answer"]


@dataclass(frozen=True)
class Decision:
    """How a scene is answered: as `asked` by the study, and the `scene` that answers it.

    The `levels` (None for a single grain) with their `known` error of tau_c; why; and whether the
    study file left the levels open.
    """

    asked: Scene
    scene: Scene
    levels: Pair | None
    known: Known
    why: str
    by_default: bool = False

    @property
    def is_as_asked(self) -> bool:
        """Whether the scene is answered as the study asks for it."""
        return self.scene == self.asked

    @property
    def is_chosen(self) -> bool:
        """Whether its levels are of those that higher ones can follow, and not as asked."""
        return self.levels is not None and not self.is_as_asked and self.levels[1] != LOCAL

    @property
    def error_estimate(self) -> float | None:
        """The known error with its uncertainty; None where it is not known."""
        return None if math.isinf(self.known.total) else self.known.total

    @property
    def is_unchecked(self) -> bool:
        """Whether it is a pile that the tool chose to answer without DEM."""
        return self.is_chosen and self.scene.protocol.method != "dem"


class Bound(NamedTuple):
    """The highest levels that are not good enough for a scene, and why: higher ones are chosen."""

    flow: Level | None = None
    grains: Level | None = None
    because: str = ""


NO_BOUND = Bound()
NO_BOUNDS: Mapping[str, Bound] = {}
CHECK = Bound(level("flow", "coarse"), levels.PEELING, "it checks answers without DEM")


def decide(
    scenes: Iterable[Scene], tolerance: float | None, above: Mapping[str, Bound] = NO_BOUNDS
) -> dict[str, Decision]:
    """Choose for each resolved scene levels known to be within a tolerance, at least cost in all.

    A flow that several piles share is run once, and a run of DEM costs what it takes for that pile.
    Where no levels are within the tolerance, a scene is on the cheapest whose error is below the
    uncertainty of their reference; it is as asked where nothing is known, or where the way to the
    answer is a part of what is asked. `above` has, by id, levels that turned out to be too low.

    The tolerance is the relative error of tau_c, the uncertainty of the reference included; 0: all
    scenes as they are asked. None: a pile whose file sets no field about the answer is answered on
    a solved flow, within the lowest `levels.floors` of all classes, so that the scenes of a figure
    are answered alike; all other scenes, and poured beds, as asked.
    """
    decided, offered = {}, {}
    for scene in scenes:
        if (along := along_if_long(scene)) is not scene:
            decided[scene.id] = replace(as_asked(along, ALONG), asked=scene)
            continue
        pairs, why = _offered(scene, tolerance, above.get(scene.id, NO_BOUND))
        if pairs:
            offered[scene.id] = [_option(scene, pair, why, tolerance is None) for pair in pairs]
        elif why or isinstance(scene.bed, PileBed):
            decided[scene.id] = as_asked(scene, why)
        else:
            exact = changed(scene, {"protocol.method": "pivot"})
            why = "the closed form is exact for a single grain in a held flow"
            decided[scene.id] = Decision(scene, exact, None, levels.UNKNOWN, why)
    return decided | _cheapest(offered)


def along_if_long(scene: Scene) -> Scene:
    """A scene by the closed form along the bed if it leaves the method open on long rows.

    Level rows are no rows along the bed: they stay with the method that packs them.
    """
    rules = scene.protocol
    if "method" in rules.model_fields_set or rules.update:
        return scene
    if not has_rows_along(scene):
        return scene
    return LOCAL.answer(scene) if Geometry(scene).length > LONG else scene


def _offered(scene: Scene, tolerance: float | None, above: Bound) -> tuple[Sequence[Pair], str]:
    """The pairs of levels that are good enough for a scene, and why it is answered as it is."""
    rules, model, bed = scene.protocol, scene.flow.model, scene.bed
    limit, start = "within the tolerance", ""
    if tolerance is None:
        floors = levels.floors()
        is_set = any(name in getattr(scene, part).model_fields_set for part, name in ANSWERS)
        is_lattice = isinstance(bed, PileBed) and not scene.is_poured
        if is_set or not is_lattice or levels.model_class(scene) not in floors:
            return (), ASKED
        tolerance, start = min(floors.values()), "chosen by default: "
        limit = f"within the model's own spread of {tolerance:.0%}"
    if not tolerance:
        return (), ASKED
    # the levels approximate DEM in a held, solved flow
    if rules.method != "dem":
        return (), f"the study asks for the method {rules.method}"
    if model not in ("solve", _best_model(scene)):
        return (), f"the study asks for the flow model {model}"
    if rules.update:
        return (), "the study asks for a bed that changes, for which no error is known"
    if rules.waiting_time < LEAST_HELD:
        return (), "the study asks for a ramp of the flow"
    if not isinstance(bed, PileBed):
        beyond = bed.slope_deg > bed.entrainment_angle_deg
        return (), "a slope beyond the entrainment angle: the closed form is off" * beyond
    if name := levels.unmeasured(scene):
        return (), f"no error is known for {name}: {ASKED}"
    taken = [tuple(level for level in part if level.takes(scene)) for part in LEVELS.values()]
    classes = tuple(levels.classes(part, scene) for part in LEVELS)
    pairs, why = _good_enough(tuple(taken), classes, above, tolerance)
    why = f"{start}{why} {limit}" if pairs else why
    return pairs, f"{why}; {above.because}" if above.because else why


@cache  # a study has thousands of scenes of a few classes
def _good_enough(
    taken: Sequence[tuple[Level, ...]], classes: Sequence[Names], above: Bound, tolerance: float
) -> tuple[Sequence[Pair], str]:
    """Pairs of the levels taken that are good enough, of which any may be the cheapest, and why."""
    offered = []
    for part, bound in zip(taken, above[:2], strict=True):
        start = part.index(bound) + 1 if bound in part else 0
        offered.append([level for level in part[start:] if level.is_offered])
    if classes[0] == (levels.LEVEL_BED,):
        offered[0] = [levels.FLAT]
    pairs = (Pair(*pair) for pair in itertools.product(*offered))
    known = {pair: levels.known_of_classes(*pair, *classes) for pair in pairs}
    cheap_first = sorted(known, key=lambda pair: known[pair].cost_core_s)
    within, why = [pair for pair in cheap_first if known[pair].total <= tolerance], "cheapest"
    if not within:
        best = min(known, key=lambda pair: known[pair].total, default=None)
        if best is None or math.isinf(known[best].total):
            return (), f"no error is known: {ASKED}"
        # errors below the uncertainty of the reference cannot be ranked, but those of flows can
        exact, most = levels.GRAINS[-1], known[best].total
        flow = {pair: levels.known_of_classes(pair.flow, exact, *classes).error for pair in known}
        limit = max(tolerance, flow[best])
        within = [one for one in cheap_first if known[one].error <= most and flow[one] <= limit]
        why = "cheapest whose error is below the uncertainty of the reference: none is"
    kept: list[Pair] = []
    for pair in within:
        cost = known[pair]
        if not any(
            known[other].flow_s <= cost.flow_s and known[other].grains_s <= cost.grains_s
            for other in kept
        ):
            kept.append(pair)
    return kept, why


class _Option(NamedTuple):
    """A decision that is good enough, and the expected times of its flows, by name, and grains."""

    decision: Decision
    flows_s: Mapping[str, float]
    grains_s: float

    def time_s(self, users: Mapping[str, int], mine: Container[str]) -> float:
        """Its time, with each flow divided by its users; it would be one more of those not mine."""
        flows = self.flows_s.items()
        shares = (time / (users.get(name, 0) + (name not in mine)) for name, time in flows)
        return self.grains_s + sum(shares)


@cache  # a plan is made several times
def _option(scene: Scene, pair: Pair, why: str, by_default: bool) -> _Option:
    """The option to answer a scene on a pair of levels."""
    pile, known = Pile(pair.answer(scene)), levels.known(pair, scene)
    flows_s = {run.name: run.cost_s for flow in pile.model.cases for run in (*flow.needs, flow)}
    grains_s = sum(run.cost_s for run in pile.method.cases) or known.grains_s
    return _Option(Decision(scene, pile.scene, pair, known, why, by_default), flows_s, grains_s)


def _cheapest(offered: Mapping[str, Sequence[_Option]]) -> dict[str, Decision]:
    """One option for each scene, with the least time of all runs together that the rounds find.

    In each every scene takes the option with the least time, where a flow is shared by those who
    took it in the round before: in the first by all who could, and once more by none.
    """
    names = ({name for one in options for name in one.flows_s} for options in offered.values())
    best, least = dict[str, _Option](), math.inf
    for users in (Counter(itertools.chain(*names)), Counter[str]()):
        mine: dict[str, Mapping[str, float]] = dict.fromkeys(offered, users)
        for _ in range(ROUNDS):
            chosen = {
                key: min(options, key=lambda option: option.time_s(users, mine[key]))
                for key, options in offered.items()
            }
            mine = {key: option.flows_s for key, option in chosen.items()}
            users = Counter(itertools.chain(*mine.values()))
            flows = {name: s for one in chosen.values() for name, s in one.flows_s.items()}
            total = sum(flows.values()) + sum(option.grains_s for option in chosen.values())
            if total < least:
                best, least = chosen, total
    return {key: option.decision for key, option in best.items()}


def as_asked(scene: Scene, why: str = ASKED) -> Decision:
    """The decision to answer a scene as it is."""
    if not isinstance(scene.bed, PileBed):
        return Decision(scene, scene, None, levels.UNKNOWN, why)
    pair, name = pair_of(scene), levels.unmeasured(scene)
    if name and name not in why:
        why = f"{why}; no error is known for {name}"
    return Decision(scene, scene, pair, levels.known(pair, scene), why)


def on_levels(scene: Scene, pair: Pair, why: str) -> Decision:
    """The decision to answer a pile on a pair of levels."""
    return Decision(scene, pair.answer(scene), pair, levels.known(pair, scene), why)


def _best_model(scene: Scene) -> str:
    """The flow model of the best levels: over a level bed no flow is solved."""
    return "flat" if isinstance(scene.bed, PileBed) and scene.bed.is_level else "solve"


def _check_group(scene: Scene) -> tuple[float, str, str]:
    assert isinstance(scene.bed, PileBed)
    return scene.bed.slope_deg, scene.bed.packing, scene.forces.law


def checks(answers: Mapping[str, Decision], tolerance: float) -> dict[str, Decision]:
    """The decisions on the piles by DEM that check answers without it, by the scene asked for.

    Of each group the pile that DEM, as asked, answers in the least time; the tolerance is that of
    tau_c.
    """
    cheapest: dict[object, tuple[float, str]] = {}
    for asked, answer in answers.items():
        if answer.is_unchecked:
            group, member = _check_group(answer.scene), (Pile(answer.asked).case.cost_s, asked)
            cheapest[group] = min(cheapest.get(group, member), member)
    made = {}
    for _, asked in cheapest.values():
        scene = answers[asked].scene
        dem = changed(scene, {"protocol.method": "dem", "flow.model": _best_model(scene)})
        (made[asked],) = decide([dem], tolerance, {dem.id: CHECK}).values()
    return made


class Comparison(NamedTuple):
    """An answer without DEM and that of DEM, at one fraction of the pile `asked` for, by its id."""

    asked: str
    cheap: PileThreshold
    dem: PileThreshold
    agree: bool


def compare(
    piles: Piles, checking: Piles, tolerance: float, cases: Path, done: Container[str]
) -> Iterator[Comparison]:
    """Compare the answers of the piles that DEM checks at each fraction, where both are run.

    They agree where the answer without DEM lies in the interval of DEM, widened by the tolerance,
    or where neither reaches the fraction.
    """
    for asked, check in checking.items():
        both, fractions = (piles[asked], check), piles[asked].scene.protocol.fractions
        if all(pile.is_run(done) for pile in both):
            answers = (pile.thresholds(cases, fractions) for pile in both)
            for cheap, dem in zip(*answers, strict=True):
                low, high = dem.tau_low * (1 - tolerance), dem.tau_high * (1 + tolerance)
                neither = math.isnan(cheap.tau) and math.isnan(dem.tau)
                yield Comparison(asked, cheap, dem, neither or low <= cheap.tau <= high)


def overruled(compared: Iterable[Comparison], answers: Mapping[str, Decision]) -> dict[str, Bound]:
    """For each pile of a group whose check disagrees, the levels that are not good enough."""
    lost = {_check_group(answers[row.asked].scene) for row in compared if not row.agree}
    return {
        asked: Bound(*answer.levels, f"DEM overruled {answer.levels.text}")
        for asked, answer in answers.items()
        if answer.levels and answer.is_unchecked and _check_group(answer.scene) in lost
    }
