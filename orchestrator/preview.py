"""The runs of a study, listed before they start."""

from collections import Counter
from collections.abc import Iterator, Sequence

from orchestrator.plan import Plan
from orchestrator.runs.case import Case
from orchestrator.runs.progress import human
from orchestrator.study.closed_form import law_holds, regime_of
from orchestrator.study.study import Study

BYTES = {"flow": 2.9e6, "pile": 1.8e6, "cells": 1.5e6}
"""Mean size of a case of the preset `paper`, by its kind."""
OTHERS = 2e6
"""Size of a case whose kind the preset does not have."""


def text(study: Study, planned: Plan, missing: Sequence[Case], workers: int) -> str:
    """Scenes with their regimes, cases by kind, expected time and disk."""
    return "\n".join([*_scenes(study, planned), *_cases(planned, missing, workers)])


def _scenes(study: Study, planned: Plan) -> Iterator[str]:
    yield f"{study.title}: {_number(len(study.scenes), 'scene')}"
    for group in study.groups:
        regimes = Counter(str(regime_of(scene)) for scene in group.scenes)
        laws = Counter(scene.forces.law for scene in group.scenes)
        outside = sum(not law_holds(scene) for scene in group.scenes)
        yield (
            f"  {group.name}: {_number(len(group.scenes), 'scene')}; regimes: {_counted(regimes)}; "
            f"force laws: {_counted(laws)}"
            + (f"; in {outside} the law does not hold for a single grain" if outside else "")
        )
    why = Counter(one.why for one in planned.decisions.values())
    for said, count in why.most_common():
        yield f"  {count} answered: {said}"


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())


def _cases(planned: Plan, missing: Sequence[Case], workers: int) -> Iterator[str]:
    kinds = Counter(one.kind for one in planned.cases.values())
    todo = Counter(one.kind for one in missing)
    yield f"{_number(len(planned.cases), 'case')}, {len(missing)} to run"
    for kind, count in kinds.items():
        yield f"  {kind}: {count}, {todo[kind]} to run"
    costs = {one.name: one.cost_s for one in missing}
    # no chain of cases takes less than its own time, however many run beside it
    walls = {one.name: one.cost_s / min(one.ranks, workers) for one in missing}
    chains = (sum(walls.get(each.name, 0.0) for each in (one, *one.needs)) for one in missing)
    runs = max(sum(costs.values()) / workers, max(chains, default=0.0))
    size = sum(BYTES.get(one.kind, OTHERS) for one in missing)
    yield (
        f"expected: about {human(runs + planned.drawing_s)} with {_number(workers, 'worker')}, "
        f"{human(planned.drawing_s)} of them for tables and figures; {size / 1e6:.0f} MB"
    )
