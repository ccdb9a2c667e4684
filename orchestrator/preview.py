"""What a study would do, before anything runs."""

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
"""Of a kind that the preset has not."""


def text(study: Study, planned: Plan, missing: Sequence[Case], workers: int) -> str:
    """Scenes with their regimes, cases by kind, expected time and disk."""
    return "\n".join([*_scenes(study, planned), *_cases(planned, missing, workers)])


def _scenes(study: Study, planned: Plan) -> Iterator[str]:
    yield f"{study.title}: {len(study.scenes)} scenes"
    for group in study.groups:
        regimes = Counter(str(regime_of(scene)) for scene in group.scenes)
        laws = Counter(scene.forces.law for scene in group.scenes)
        outside = sum(not law_holds(scene) for scene in group.scenes)
        yield (
            f"  {group.name}: {len(group.scenes)} scenes; regimes: {_counted(regimes)}; "
            f"force laws: {_counted(laws)}"
            + (f"; in {outside} the law does not hold for a single grain" if outside else "")
        )
    why = Counter(one.why for one in planned.decisions.values())
    for said, count in why.most_common():
        yield f"  {count} answered: {said}"


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())


def _cases(planned: Plan, missing: Sequence[Case], workers: int) -> Iterator[str]:
    kinds = Counter(one.kind for one in planned.cases.values())
    todo = Counter(one.kind for one in missing)
    yield f"{len(planned.cases)} cases, {len(missing)} to run"
    for kind, count in kinds.items():
        yield f"  {kind}: {count}, {todo[kind]} to run"
    costs = {one.name: one.cost_s for one in missing}
    # no chain of cases takes less than its own time, however many run beside it
    walls = {one.name: one.cost_s / min(one.ranks, workers) for one in missing}
    chains = (sum(walls.get(each.name, 0.0) for each in (one, *one.needs)) for one in missing)
    runs = max(sum(costs.values()) / workers, max(chains, default=0.0))
    size = sum(BYTES.get(one.kind, OTHERS) for one in missing)
    yield (
        f"expected: about {human(runs + planned.drawing_s)} with {workers} workers, "
        f"{human(planned.drawing_s)} of them for tables and figures; {size / 1e6:.0f} MB"
    )
