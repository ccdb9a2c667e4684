"""What a running study shows: the share of the work done, the last case that ended, time left."""

import sys
from collections import defaultdict
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from orchestrator.runs.case import Case
from orchestrator.runs.engine import Outcome


class Display:
    """Shows the cases of a study as they end: a bar on a terminal, a line each elsewhere."""

    def __init__(self, todo: list[Case], workers: int) -> None:
        self._console = Console(stderr=True, highlight=False, soft_wrap=True)
        self._forecast = Forecast(todo, workers)
        self._count, self._ended = len(todo), 0
        self._bar = Progress(
            TextColumn("{task.fields[ended]}/{task.fields[count]} cases"),
            BarColumn(),
            TextColumn("{task.fields[left]}"),
            console=self._console,
            disable=not sys.stderr.isatty(),
        )
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        self._bar.start()
        self._task = self._bar.add_task(
            "", total=1.0, ended=0, count=self._count, left=self._time_left()
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def __call__(self, outcome: Outcome) -> None:
        """Take note of a case that has ended."""
        self._ended += 1
        self._forecast.ended(outcome)
        word = "failed" if outcome.error else "done"
        left = self._time_left()
        self._console.print(
            f"[{self._ended}/{self._count}] {word}  {outcome.case.name}  "
            f"{self._forecast.done:.0%} of the work, {left}",
            markup=False,
        )
        if outcome.error:
            self._console.print(f"  {outcome.error}", markup=False)
        if self._task is not None:
            self._bar.update(
                self._task, completed=self._forecast.done, ended=self._ended, left=left
            )

    def _time_left(self) -> str:
        if self._ended == self._count:
            return "all runs ended"
        return f"about {human(self._forecast.left_s())} left"


class Forecast:
    """The time left: what the cases still cost, at the pace of those that have ended.

    Parameters
    ----------
    todo : list of Case
        All that is to be run.
    workers : int
        How many run at a time.
    """

    def __init__(self, todo: list[Case], workers: int) -> None:
        self._workers = workers
        self._left: defaultdict[str, float] = defaultdict(float)
        self._ended: defaultdict[str, float] = defaultdict(float)
        self._took: defaultdict[str, float] = defaultdict(float)
        for case in todo:
            self._left[case.kind] += case.cost_s
        self._whole = sum(self._left.values())

    def ended(self, outcome: Outcome) -> None:
        """Take note of a case that has ended: it is not to come, and shows the pace of its kind."""
        kind, cost = outcome.case.kind, outcome.case.cost_s
        self._left[kind] -= cost
        if not outcome.error:
            self._ended[kind] += cost
            self._took[kind] += outcome.seconds

    @property
    def done(self) -> float:
        """Share of the work that has ended, 0 to 1."""
        left = max(0.0, sum(self._left.values()))
        return 1 - left / self._whole if left else 1.0

    def left_s(self) -> float:
        """Time until all have ended, s."""
        costs = (left * self._pace(kind) for kind, left in self._left.items())
        return max(0.0, sum(costs)) / self._workers

    def _pace(self, kind: str) -> float:
        """What a case takes over what it was thought to cost; a new kind goes as the others do."""
        if not self._ended:
            return 1.0
        if kind in self._ended:
            return self._took[kind] / self._ended[kind]
        return sum(self._took.values()) / sum(self._ended.values())


def human(seconds: float) -> str:
    """A time for people."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
