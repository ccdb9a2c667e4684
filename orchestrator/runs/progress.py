"""Progress of a running study: the share of the work done, the last case that ended, time left."""

import math
import sys
import time
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from orchestrator.runs.case import Case
from orchestrator.runs.engine import Outcome

LOOK_S = 1.0
"""Time between two looks at the cases that are running, s."""


class Display:
    """Shows how far a study is: a bar on a terminal, elsewhere a line for each case that ends."""

    def __init__(self, forecast: "Forecast", cases: Path) -> None:
        self._console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
        self._forecast, self._cases = forecast, cases
        self._ended, self._looked = 0, -math.inf
        self._bar = Progress(
            TextColumn("{task.fields[ended]}/{task.fields[count]} cases"),
            BarColumn(),
            TextColumn("{task.percentage:.0f}% of the work, {task.fields[left]}"),
            console=self._console,
        )
        self._task = self._bar.add_task("", total=1.0, ended=0, count=forecast.count, left="")
        self._show()

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.live.is_started:
            self._bar.stop()

    def __call__(self, outcome: Outcome) -> None:
        """Take note of a case that has ended."""
        self._ended += 1
        self._forecast.ended(outcome)
        place, word = (
            f"[{self._ended}/{self._forecast.count}]",
            "failed" if outcome.error else "done",
        )
        self._console.print(f"{place} {word}  {outcome.case.name}  {self._show()}")
        if outcome.error:
            self._console.print(f"  {outcome.error}")

    def watch(self, running: Collection[Case]) -> None:
        """Look how far the running cases are, once a second, for the bar of a terminal."""
        if sys.stderr.isatty() and time.monotonic() > self._looked + LOOK_S:
            self._looked = time.monotonic()
            self._forecast.going((case, case.share(self._cases / case.name)) for case in running)
            self._show()

    def _show(self) -> str:
        """Show on the bar how far the study is; the same in words."""
        done, left = self._forecast.done, f"about {human(self._forecast.left_s())} left"
        self._bar.update(self._task, completed=done, ended=self._ended, left=left)
        return f"{done:.0%} of the work, {left}"


class Forecast:
    """The time left: what the cases still cost, at the pace of those that have ended.

    The runs share so many cores as `workers`; `after_s` is expected after the last run, s.
    """

    def __init__(self, todo: Collection[Case], workers: int, after_s: float = 0.0) -> None:
        self.count = len(todo)
        self._workers, self._after_s = workers, after_s
        self._left = sum(case.cost_s for case in todo)
        self._whole = self._left / workers + after_s
        self._expected = self._took = 0.0  # costs and times of the cases that have ended, s
        self._going: dict[str, float] = {}

    def going(self, running: Iterable[tuple[Case, float]]) -> None:
        """Take note of how much the running cases have done, each a share of its own work."""
        self._going = {case.name: part * case.cost_s for case, part in running}

    def ended(self, outcome: Outcome) -> None:
        """Take note of a case that has ended."""
        self._going.pop(outcome.case.name, None)
        self._left -= outcome.case.cost_s
        if not outcome.error:
            self._expected += outcome.case.cost_s
            self._took += outcome.seconds * outcome.case.ranks

    @property
    def done(self) -> float:
        """Share of the work that is done, 0 to 1."""
        return 1 - self.left_s(1.0) / self._whole if self._whole else 1.0

    def left_s(self, pace: float | None = None) -> float:
        """Time until all is done, s, at a pace: that of the cases so far, over their costs."""
        if pace is None:
            pace = self._took / self._expected if self._took else 1.0
        left = max(0.0, self._left - sum(self._going.values()))
        return pace * left / self._workers + self._after_s


def human(seconds: float) -> str:
    """A time for people."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
