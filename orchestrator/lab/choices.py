"""The choices that a study has: rungs for the flow and the grains, or a tolerance.

Each choice answers every scene of a kind, and is compared with the reference at the
fractions that the scenes ask for: what it costs, and which share of the thresholds it
has within 1, 2, 5, 10 and 20 %.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from orchestrator.experiment import Runs
from orchestrator.fidelity import decision, flows
from orchestrator.fidelity.decision import (
    Decision,
    as_written,
    decide,
    with_criterion,
    written,
)
from orchestrator.fidelity.fidelities import FIDELITIES, REFERENCE, Fidelity, Rung
from orchestrator.lab.timing import time_alone_s
from orchestrator.runs.case import Case
from orchestrator.study.criterion import SUSTAINED
from orchestrator.study.fidelities import Fields
from orchestrator.study.methods import METHODS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed
from orchestrator.types import FloatArray, Row

WITHIN = (0.01, 0.02, 0.05, 0.1, 0.2)
"""Relative errors within which thresholds are counted."""
AIM = 0.05
"""The error within which thresholds are to be."""
TOLERANCES = WITHIN[1:]
"""Tolerances that are tried."""
WRITTEN = "as written"
OPEN = "no tolerance"
REFERENCES = "reference"
WHY = "the ladder compares the choices of a study"


@dataclass(frozen=True)
class Choice:
    """A way to answer all scenes of a kind.

    Attributes
    ----------
    name
        What it is, in words.
    answers
        The decision on each scene.
    checks
        The checks by DEM that belong to it.
    tolerance
        Its tolerance; NaN without one.
    fields
        Of a choice that sets the rungs, the fields of a study file for each scene.
    """

    name: str
    answers: tuple[Decision, ...]
    checks: tuple[Decision, ...] = ()
    tolerance: float = math.nan
    fields: tuple[Fields, ...] = ()

    @property
    def decisions(self) -> dict[str, Decision]:
        """All decisions that it needs, by names for a plan."""
        return {key_of(one): one for one in (*self.answers, *self.checks)}

    @property
    def grains(self) -> str:
        """How it moves the grains; empty where that differs between its scenes."""
        found = {one.scene.method.facts.meaning for one in self.answers}
        return found.pop() if len(found) == 1 and self.fields else ""

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes that answer, which tell one choice from another."""
        return tuple(one.scene.id for one in (*self.answers, *self.checks))


@dataclass(frozen=True)
class Kind:
    """The scenes of one kind, each of which has a chart of its own.

    Attributes
    ----------
    name
        What it is, in words.
    scenes
        Its scenes, as the ladder runs them.
    choices
        The choices that answer every one of them.
    reference
        What these are compared with.
    """

    name: str
    scenes: tuple[Scene, ...]
    choices: tuple[Choice, ...]
    reference: Choice

    @property
    def decisions(self) -> dict[str, Decision]:
        """All decisions of its choices, by names for a plan."""
        found = dict(self.reference.decisions)
        for one in self.choices:
            found |= one.decisions
        return found


def key_of(answer: Decision) -> str:
    """Name a decision for a plan.

    Returns
    -------
    str
        The name, of the scene that answers: decisions that agree in it share it.
    """
    return f"choice {answer.scene.id}"


@dataclass(frozen=True)
class OfStudy:
    """What a study does by itself at a tolerance, or without one.

    Attributes
    ----------
    name
        The choice in words.
    tolerance
        The tolerance; NaN without one.
    answers, checks
        The decisions on its scenes and the checks by DEM, by the id of the scene.
    """

    name: str
    tolerance: float
    answers: Mapping[str, Decision]
    checks: Mapping[str, Decision]

    def choice(self, asked: Mapping[Scene, Scene]) -> Choice:
        """Make it a choice of some scenes.

        Parameters
        ----------
        asked
            The scenes of the study, by those of the ladder.

        Returns
        -------
        Choice
            The choice.
        """
        answers = []
        checks = []
        for scene, of_study in asked.items():
            answers.append(replace(self.answers[of_study.id], asked=scene))
            if of_study.id in self.checks:
                checks.append(self.checks[of_study.id])
        return Choice(self.name, tuple(answers), tuple(checks), self.tolerance)


def kinds(study: Study) -> list[Kind]:
    """Sort the piles of a study by kind, with the choices of each.

    Returns
    -------
    list of Kind
        The kinds, in the order of the study; none without a pair of rungs to choose,
        such as level beds by a method without DEM.
    """
    sorted_: dict[str, dict[Scene, Scene]] = {}
    for asked in study.scenes:
        if isinstance(asked.bed, PileBed):
            scene = written(with_criterion(asked))
            sorted_.setdefault(_kind_of(scene), {}).setdefault(scene, asked)
    own = _of_study(study)
    found = [_kind(name, scenes, own) for name, scenes in sorted_.items()]
    return [kind for kind in found if any(one.fields for one in kind.choices)]


def _kind_of(scene: Scene) -> str:
    """The kind of a pile: its criterion, whether it is poured, a method without DEM."""
    is_sustained = scene.threshold.criterion == SUSTAINED
    words = "sustained motion" if is_sustained else "entrainment"
    if scene.is_poured:
        words += ", poured beds"
    if not scene.method.is_resolved_in_time:
        words += f", by {scene.method.facts.meaning}"
    return words


def _kind(name: str, asked: Mapping[Scene, Scene], own: Sequence[OfStudy]) -> Kind:
    """A kind with its choices, by the scenes of the ladder and those of the study."""
    scenes = tuple(asked)
    in_time = all(scene.method.is_resolved_in_time for scene in scenes)
    best = _pair(scenes, REFERENCE.flow, REFERENCE.grains if in_time else None)
    pairs = _pairs(scenes, in_time=in_time)
    others = [one for one in pairs if one.scenes != best.scenes]
    of_study = [one.choice(asked) for one in own]
    return Kind(name, scenes, (*others, *of_study), best)


def _pairs(scenes: Sequence[Scene], *, in_time: bool) -> Iterator[Choice]:
    """Pairs of rungs that differ from all before."""
    known = set()
    for one in FIDELITIES:
        for other in FIDELITIES if in_time else (None,):
            grains = other.grains if other else None
            # no cheaper flow makes the grains of the reference a choice
            is_dear = grains is REFERENCE.grains and one is not REFERENCE
            if is_dear or not _take(scenes, one.flow, grains):
                continue
            choice = _pair(scenes, one.flow, grains)
            if choice.scenes not in known:
                known.add(choice.scenes)
                yield choice


def _take(scenes: Iterable[Scene], flow: Rung, grains: Rung | None) -> bool:
    """Whether rungs can answer all of some scenes."""
    one = Fidelity("", "", flow, grains or flow)
    return all(
        one.flow_over(scene).takes(scene) and (grains is None or grains.takes(scene))
        for scene in scenes
    )


def _pair(scenes: Sequence[Scene], flow: Rung, grains: Rung | None) -> Choice:
    """The choice of a flow, and of grains if the study leaves them open."""
    answers = []
    fields = []
    for scene in scenes:
        one = Fidelity("", "", flow, grains or flow)
        sets = dict(one.flow_over(scene).changes(scene))
        if grains is not None:
            sets |= grains.changes(scene)
        answer = as_written(changed(scene, sets), WHY)
        answers.append(replace(answer, asked=scene))
        fields.append({name: sets[name] for name in sets if sets[name] is not None})
    words = []
    if any(not _is_level(scene) for scene in scenes):
        words.append(_flow_in_words(flow))
    if grains is not None:
        words.append(_grains_in_words(grains, scenes[0]))
    return Choice(
        ", ".join(words) or "closed form", tuple(answers), fields=tuple(fields)
    )


def _is_level(scene: Scene) -> bool:
    return isinstance(scene.bed, PileBed) and scene.bed.is_level


def _flow_in_words(rung: Rung) -> str:
    """A rung of the flow in a few words."""
    cells = rung.sets["method.flow.cells_per_face"]
    ratio = rung.sets["method.flow.expansion_ratio"]
    usual = REFERENCE.flow.sets["method.flow.expansion_ratio"]
    return f"{cells} cells" if ratio == usual else f"{cells} cells ({ratio:g})"


def _grains_in_words(rung: Rung, scene: Scene) -> str:
    """A rung of the grains in a few words."""
    fields = rung.fields(scene)
    method = METHODS[fields["method.kind"]]
    if not method.is_resolved_in_time:
        return method.meaning
    layers = fields["method.grains.mobile_layers"]
    step = fields["method.grains.load_increment"]
    return f"{method.meaning} {layers} × {100 * step:g} %"


def _of_study(study: Study) -> list[OfStudy]:
    """What the study does by itself: as it is written, and with tolerances."""
    written_ = {}
    for scene in study.scenes:
        written_[scene.id] = as_written(with_criterion(scene))
    found = [OfStudy(WRITTEN, math.nan, written_, {})]
    for tolerance in (None, *TOLERANCES):
        answers = {scene.id: decide(scene, tolerance) for scene in study.scenes}
        if tolerance is None:
            found.append(OfStudy(OPEN, math.nan, answers, {}))
        else:
            checks = decision.checks(answers.values())
            put = flows.shared(answers, checks)  # as the plan of a study does
            found.append(OfStudy(f"tolerance {tolerance:g}", tolerance, *put))
    return found


def shares(found: Sequence[Kind], runs: Runs) -> pd.DataFrame:
    """Compare the choices of each kind with its reference.

    Parameters
    ----------
    found
        The kinds.
    runs
        The runs.

    Returns
    -------
    DataFrame
        A row for each kind and choice whose runs are all done: its cost, core-s, the
        number of thresholds that are compared, the share of them within each of
        `WITHIN`, the largest error, and the share at which the reference itself is
        known within each of `WITHIN`. `on_front` marks those that none beats in cost
        and in the share within `AIM`.
    """
    tables = []
    for kind in found:
        if not runs.are_done(*kind.reference.decisions):
            continue
        best = _thresholds(kind.reference, runs)
        of_reference = _of_reference(kind, best)
        of_kind: list[Row] = []
        costs: dict[tuple[str, ...], float] = {}
        for choice in (kind.reference, *kind.choices):
            if not runs.are_done(*choice.decisions):
                continue
            errors = _errors(_thresholds(choice, runs), best)
            if choice.scenes not in costs:  # the time of a part of a second is noise
                costs[choice.scenes] = _cost(choice, runs)
            row = _row(kind, choice, errors, costs[choice.scenes])
            of_kind.append({**row, **of_reference})
        table = pd.DataFrame(of_kind)
        tables.append(table.assign(on_front=front(table, AIM)))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def front(rows: pd.DataFrame, within: float) -> "pd.Series[bool]":
    """Find the choices that none beats in cost and in the share within an error.

    Parameters
    ----------
    rows
        The choices of a kind, by `shares`.
    within
        The error.

    Returns
    -------
    Series of bool
        Whether each is one of them.
    """
    values = rows[["core_s", column(within)]].to_numpy(float) * [1, -1]
    beaten = []
    for row in values:
        as_good = (values <= row).all(axis=1)
        better = (values < row).any(axis=1)
        beaten.append(bool(np.any(as_good & better)))
    return ~pd.Series(beaten, index=rows.index)


def column(within: float) -> str:
    """Name the column of the share of thresholds within an error.

    Parameters
    ----------
    within
        The relative error.

    Returns
    -------
    str
        The name.
    """
    return f"within_{100 * within:g}"


def column_of_reference(within: float) -> str:
    """Name the column of the share at which the reference is known within an error.

    Parameters
    ----------
    within
        The relative error.

    Returns
    -------
    str
        The name.
    """
    return f"reference_{column(within)}"


def _of_reference(kind: Kind, best: FloatArray) -> Row:
    """The shares of thresholds at which the reference itself is known within errors."""
    known = []
    for answer in kind.reference.answers:
        for fraction in answer.asked.threshold.fractions:
            error = answer.error_at(fraction)
            known.append(math.inf if error is None else error)
    reached = np.array(known)[~np.isnan(best)]
    return {
        column_of_reference(within): float((reached <= within).mean())
        for within in WITHIN
    }


def _row(kind: Kind, choice: Choice, errors: FloatArray, cost_s: float) -> Row:
    largest = float(errors.max()) if len(errors) else math.nan
    row: Row = {
        "kind": kind.name,
        "choice": REFERENCES if choice is kind.reference else choice.name,
        "tolerance": choice.tolerance,
        "grains": choice.grains,
        "scenes": len(kind.scenes),
        "thresholds": len(errors),
        "core_s": cost_s,
    }
    for within in WITHIN:
        row[column(within)] = float((errors <= within * (1 + 1e-9)).mean())
    return {**row, "largest": largest}


def _thresholds(choice: Choice, runs: Runs) -> FloatArray:
    """The thresholds of all scenes of a choice, Pa; NaN where one was not reached."""
    values = []
    for answer in choice.answers:
        pile = runs.planned.piles[key_of(answer)]
        found = pile.thresholds(runs.cases, answer.asked.threshold.fractions)
        values += [one.tau for one in found]
    return np.array(values, float)


def _errors(values: FloatArray, best: FloatArray) -> FloatArray:
    """Sizes of the relative errors; infinite where only one of two was reached.

    A threshold that neither reached is left out.
    """
    neither = np.isnan(values) & np.isnan(best)
    errors = np.abs(values / best - 1)[~neither]
    return np.where(np.isnan(errors), math.inf, errors)


def _cost(choice: Choice, runs: Runs) -> float:
    """What a choice costs, core-s: each case once, and its checks."""
    cases: dict[str, Case] = {}
    here_s = 0.0
    for key in choice.decisions:
        pile = runs.planned.piles[key]
        cases |= {case.name: case for case in pile.runs}
        if not pile.method.cases:
            here_s += time_alone_s(pile, runs.cases)
    return here_s + runs.cpu_s([*cases.values()])
