"""Few runs of DEM for many piles of one class.

Where only DEM is within the tolerance and a study asks for many piles of one class, DEM
runs on some of them. The others are answered without it, and corrected by one factor
for each slope, force law and fraction. The piles that give the factors are chosen by
design: of each slope and force law the smallest grains, the largest, and those between.
The error of the correction is measured on piles kept apart. These are drawn at random
from the rest, by the digests of what they ask: the draw depends on neither the order of
a study nor on any answer. Where the measured error leads out of the tolerance, DEM runs
on all.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from orchestrator.digits import number, percent, rounded
from orchestrator.fidelity import measured
from orchestrator.fidelity.classes import GRAINS, scene_class
from orchestrator.fidelity.decision import NUMBERS, Decision, Decisions
from orchestrator.fidelity.fidelities import PAIRS, Fidelity, Rung
from orchestrator.grains.corrected import Correction, Pair, corrected
from orchestrator.grains.pile import Pile
from orchestrator.runs.case import done_state
from orchestrator.study.closed_form import single_grain
from orchestrator.study.criterion import SUSTAINED
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed, value_of

DESIGNED = 3
"""Piles of a slope and a force law from which its factors are made."""
KEPT = (19, 9)
"""How many piles are kept apart: 19 hold 95 % of all others, 9 hold 90 %."""
METHOD = ("method.kind", *(one for one in NUMBERS if one.startswith("method.grains.")))
"""Fields of what moves grains."""
Stratum = tuple[float, str]
"""Slope in degrees, and force law: what has one factor."""
Ranked = tuple[float, float, str]
"""Galileo number, height of the bed and id of a pile: the order of a design."""


@dataclass(frozen=True, eq=False)
class FewRuns:
    """Which piles of a class DEM runs on, so that it need not run on the others.

    Attributes
    ----------
    design
        Ids of the asked scenes from which the factors are made.
    kept
        Ids of those that are kept apart.
    plain
        What moves the grains of the others.
    by_dem
        Fields of a scene by which DEM moves them.
    tolerance
        The tolerance of the study.
    """

    design: tuple[str, ...]
    kept: tuple[str, ...]
    plain: Rung
    by_dem: Mapping[str, object]
    tolerance: float

    @property
    def in_words(self) -> str:
        """How the others are answered."""
        method = self.plain.sets["method.kind"]
        held = len(self.kept) / (len(self.kept) + 1)
        of = number(len(self.design), "pile")
        kept = f"their error is that of {len(self.kept)} kept apart ({percent(held)})"
        return f"the method {method}, with factors of {of} by DEM; {kept}"


@dataclass(frozen=True, kw_only=True)
class Corrected(Decision):
    """The decision to answer a pile without DEM, and to correct it by that of others.

    Attributes
    ----------
    asked, scene, fidelity, known, why, is_chosen
        As of any decision; the error is that of DEM.
    few
        These others.
    instead
        The decision to answer it by DEM.
    """

    few: FewRuns
    instead: Decision

    @property
    def stratum(self) -> Stratum:
        """What it shares with the piles of its factor."""
        return _stratum(self.asked)

    @property
    def is_unchecked(self) -> bool:
        """It is not: DEM of other piles measures its error."""
        return False

    @property
    def by_dem(self) -> Decision:
        """The decision to answer the pile by DEM after all."""
        why = f"{self.instead.why}; factors of few piles are beyond the tolerance"
        scene = changed(self.scene, self.few.by_dem)
        return replace(self.instead, scene=scene, why=why)


def shared(answers: Decisions, tolerance: float) -> Decisions:
    """Correct piles by DEM of others, where many are to be answered by it.

    Parameters
    ----------
    answers
        Decisions by the ids of the asked scenes.
    tolerance
        The tolerance of the study.

    Returns
    -------
    dict of str to Decision
        The same with the scenes that answer now.
    """
    groups: dict[object, dict[str, Decision]] = {}
    for asked, answer in answers.items():
        if _is_by_dem(answer, tolerance):
            groups.setdefault(_group(answer), {})[asked] = answer
    found = dict(answers)
    for members in groups.values():
        found |= _shared(members, tolerance)
    return found


def _is_by_dem(answer: Decision, tolerance: float) -> bool:
    """Whether a tolerance has chosen DEM for a pile, and is met by it."""
    if not answer.is_chosen or not answer.scene.method.is_resolved_in_time:
        return False
    if answer.scene.threshold.criterion == SUSTAINED or not answer.known.fractions:
        return False
    # a fraction of an unknown error leaves nothing to be within
    asked = answer.scene.threshold.fractions
    is_known = answer.known.fractions == asked
    return is_known and answer.known.total <= tolerance


def _group(answer: Decision) -> object:
    """What piles have in common: their errors, and how DEM moves their grains."""
    scene = answer.scene
    numbers = tuple(value_of(scene, name) for name in METHOD)
    return (scene_class(GRAINS, answer.asked), answer.known, numbers)


def _stratum(scene: Scene) -> Stratum:
    return scene.bed.slope_deg, scene.forces.law


def _shared(members: Mapping[str, Decision], tolerance: float) -> dict[str, Decision]:
    """The decisions of a group in which DEM runs on some; of a small one the same."""
    first = next(iter(members.values()))
    plain = _plain(first.asked, first.known.fractions)
    design = _design(members.values())
    # an id is a digest of what is asked: its order is a draw
    rest = sorted(members.keys() - set(design))
    count = next((each for each in KEPT if each < len(rest)), None)
    if plain is None or count is None:
        return dict(members)
    by_dem = {name: value_of(first.scene, name) for name in METHOD}
    few = FewRuns(design, tuple(rest[:count]), plain, by_dem, tolerance)
    found = {}
    for asked, answer in members.items():
        if asked in design:
            why = f"{answer.why}; it gives factors to piles of its class"
            found[asked] = replace(answer, why=why)
        elif asked in few.kept:
            why = f"{answer.why}; it is kept apart to measure the error of factors"
            found[asked] = replace(answer, why=why)
        else:
            found[asked] = _corrected(answer, few)
    return found


def _plain(scene: Scene, fractions: Iterable[float]) -> Rung | None:
    """What moves grains without DEM with the least error on the class of a scene."""
    name = scene_class(GRAINS, scene)
    found: dict[str, tuple[float, Rung]] = {}
    for one in PAIRS:
        errors = measured.errors().get((GRAINS, one.grains.name, name))
        if one.is_resolved_in_time or errors is None or not one.grains.takes(scene):
            continue
        worst = max(errors.at(each).total for each in fractions)
        found.setdefault(one.grains.name, (worst, one.grains))
    return min(found.values(), key=lambda one: one[0], default=(0.0, None))[1]


def _design(answers: Iterable[Decision]) -> tuple[str, ...]:
    """Choose the piles of each stratum from which its factors are made."""
    strata: dict[Stratum, list[Ranked]] = {}
    for answer in answers:
        scene = answer.asked
        assert isinstance(scene.bed, PileBed)
        galileo = rounded(float(single_grain(scene).galileo))
        height = rounded(scene.bed.relief)
        strata.setdefault(_stratum(scene), []).append((galileo, height, scene.id))
    chosen: list[str] = []
    for piles in strata.values():
        chosen += _spread(sorted(piles))
    return tuple(sorted(chosen))


def _spread(rising: Sequence[Ranked]) -> list[str]:
    """The ids of the first, of the last, and of those evenly between them."""
    last = len(rising) - 1
    places = {round(i * last / (DESIGNED - 1)) for i in range(DESIGNED)}
    return [rising[at][2] for at in sorted(places)]


def _corrected(answer: Decision, few: FewRuns) -> Corrected:
    """The decision on a pile that is left to factors."""
    assert answer.fidelity is not None
    scene = changed(answer.scene, few.plain.fields(answer.asked))
    name = f"few runs of {answer.fidelity.name}"
    meaning = f"{few.in_words}: {answer.fidelity.meaning}"
    fidelity = Fidelity(name, meaning, answer.fidelity.flow, few.plain)
    why = f"{few.in_words}; by DEM: {answer.why}"
    known = answer.known
    return Corrected(
        answer.asked, scene, fidelity, known, why, True, few=few, instead=answer
    )


def corrected_by(
    few: FewRuns, answers: Decisions, piles: Mapping[str, Pile]
) -> Correction:
    """Find the piles that correct others.

    Parameters
    ----------
    few
        Which they are.
    answers
        Decisions by the ids of the asked scenes.
    piles
        Their piles.

    Returns
    -------
    Correction
        The correction.
    """

    def pairs(ids: Iterable[str]) -> tuple[Pair, ...]:
        found = []
        for asked in ids:
            scene, pile = answers[asked].asked, piles[asked]
            plain = changed(pile.scene, few.plain.fields(scene))
            found.append(Pair(_stratum(scene), Pile(plain, pile.cases), pile))
        return tuple(found)

    design, kept = pairs(few.design), pairs(few.kept)
    return Correction(design[0].by_dem.scene.threshold.fractions, design, kept)


def with_corrections(piles: Mapping[str, Pile], answers: Decisions) -> dict[str, Pile]:
    """Correct the piles of which it was decided so.

    Parameters
    ----------
    piles
        Piles by the ids of the asked scenes.
    answers
        The decisions on them.

    Returns
    -------
    dict of str to Pile
        The same piles.
    """
    found = dict(piles)
    made: dict[FewRuns, Correction] = {}
    for asked, answer in answers.items():
        if isinstance(answer, Corrected):
            if answer.few not in made:
                made[answer.few] = corrected_by(answer.few, answers, piles)
            found[asked] = corrected(piles[asked], made[answer.few], answer.stratum)
    return found


def solved(
    answers: Decisions, piles: Mapping[str, Pile], cases: Path
) -> Decisions | None:
    """Answer by DEM the piles of which finished runs show that no factor is enough.

    Parameters
    ----------
    answers
        Decisions by the ids of the asked scenes.
    piles
        Their piles.
    cases
        The directory of the runs.

    Returns
    -------
    dict of str to Decision, or None
        The same with the scenes that answer now; None where there are no such piles.
    """
    are_done: dict[FewRuns, bool] = {}
    found = dict(answers)
    for asked, answer in answers.items():
        if not isinstance(answer, Corrected):
            continue
        few = answer.few
        pile = piles[asked]
        if few not in are_done:
            are_done[few] = all(done_state(run, cases) for run in pile.runs)
        if are_done[few] and _is_beyond(answer, pile, cases):
            found[asked] = answer.by_dem
    return found if any(found[one] is not answers[one] for one in found) else None


def _is_beyond(answer: Corrected, pile: Pile, cases: Path) -> bool:
    """Whether the measured error of its factors leads a pile out of the tolerance."""
    for fraction in answer.known.fractions:
        of_factors = pile.correction_error(fraction, cases)
        error = math.hypot(answer.known.at(fraction).total, of_factors)
        if rounded(error) > answer.few.tolerance:
            return True
    return False
