"""What a running study shows: cases done, the last one that ended, time left."""

import sys
import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from orchestrator.case import Case
from orchestrator.engine import Outcome


class Display:
    """Shows the cases of a study as they end: a bar on a terminal, a line each elsewhere.

    The time left is the cost still to come over the rate so far; the costs are the plan's.
    """

    def __init__(self, todo: list[Case], workers: int) -> None:
        self._console = Console(stderr=True, highlight=False, soft_wrap=True)
        self._cost = sum(case.cost_s for case in todo) or 1.0
        self._count, self._ended, self._spent = len(todo), 0, 0.0
        self._workers, self._started = workers, time.monotonic()
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
            "", total=self._cost, ended=0, count=self._count, left=self._time_left()
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
        self._spent += outcome.case.cost_s
        word = "failed" if outcome.error else "done"
        left = self._time_left()
        self._console.print(
            f"[{self._ended}/{self._count}] {word}  {outcome.case.name}  {left}", markup=False
        )
        if outcome.error:
            self._console.print(f"  {outcome.error}", markup=False)
        if self._task is not None:
            self._bar.update(self._task, completed=self._spent, ended=self._ended, left=left)

    def _time_left(self) -> str:
        if self._ended == self._count:
            return "all runs ended"
        elapsed = time.monotonic() - self._started
        rate = self._spent / elapsed if self._spent else self._workers
        seconds = (self._cost - self._spent) / rate
        return f"about {_human(seconds)} left"


def _human(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
