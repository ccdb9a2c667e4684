"""Progress of a running study: the share of the work done, the last case that ended, time left."""

import math
import sys
import time
from collections.abc import Collection
from pathlib import Path
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from orchestrator.runs.case import Case
from orchestrator.runs.engine import Outcome

LOOK_S = 1.0
"""Time between two looks at the cases that are running, s."""


class Display:
    """Shows how far a study is: a bar on a terminal, elsewhere a line for each case that ends.

    The cases share so many cores as `workers`; `after_s` is expected after the last of them, s.
    """

    def __init__(
        self, todo: Collection[Case], cases: Path, workers: int, after_s: float = 0.0
    ) -> None:
        self._cases, self._workers, self._after_s = cases, workers, after_s
        self._left = sum(case.cost_s for case in todo)
        self._whole = self._left / workers + after_s
        self._expected = self._took = 0.0  # costs and times of the cases that have ended, s
        self._going: dict[str, float] = {}
        self._count, self._ended, self._looked = len(todo), 0, -math.inf
        self._console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
        columns = (
            TextColumn("{task.fields[ended]} cases"),
            BarColumn(),
            TextColumn("{task.description}"),
        )
        self._bar = Progress(*columns, console=self._console)
        self._task = self._bar.add_task("", total=1.0, ended="")
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
        case, error = outcome.case, outcome.error
        self._ended += 1
        self._going.pop(case.name, None)
        self._left -= case.cost_s
        if not error:
            self._expected += case.cost_s
            self._took += outcome.seconds * case.ranks
        ended, text = self._show()
        self._console.print(f"[{ended}] {'failed' if error else 'done'}  {case.name}  {text}")
        if error:
            self._console.print(f"  {error}")

    def watch(self, running: Collection[Case]) -> None:
        """Look how far the running cases are, once a second, for the bar of a terminal."""
        if sys.stderr.isatty() and time.monotonic() > self._looked + LOOK_S:
            self._looked = time.monotonic()
            shares = {case.name: case.share(self._cases / case.name) for case in running}
            self._going = {case.name: shares[case.name] * case.cost_s for case in running}
            self._show()

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

    def _show(self) -> tuple[str, str]:
        """Show on the bar how far the study is; the same in words."""
        done, ended = self.done, f"{self._ended}/{self._count}"
        text = f"{done:.0%} of the work, about {human(self.left_s())} left"
        self._bar.update(self._task, completed=done, ended=ended, description=text)
        return ended, text


def human(seconds: float) -> str:
    """A time for people."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
