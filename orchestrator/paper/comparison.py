"""Comparisons of many scenes, and the verdict that they give."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from orchestrator.types import BoolArray, FloatArray

Verdict = Literal["reproduced", "partly", "not", "no data"]

SHARE = 0.95
"""Share of comparisons from which a statement counts as true; from one less it, as false."""
RULE = (
    f"reproduced: so in at least {SHARE:.0%} of the comparisons of each judged line; not: in at "
    f"most {1 - SHARE:.0%} of each; else partly; no data: if a judged line has none"
)


@dataclass(frozen=True)
class Comparison:
    """Values of one quantity in many scenes, and the range in which a claim has them.

    `values` are numbers, NaN where a scene has none, printed by `form`; the claim is true of those
    `above` the one bound and not above the other, `below`. Without a bound they are shown and not
    judged. Bools say themselves if the claim is true, and are judged unless `is_judged` is False.
    """

    name: str
    values: Any
    above: float = -np.inf
    below: float = np.inf
    form: str = ".3g"
    is_judged: bool = True

    @property
    def has_bools(self) -> bool:
        """Whether the values are the answers themselves."""
        return np.asarray(self.values).dtype == bool

    @property
    def is_decisive(self) -> bool:
        """Whether the verdict of a claim depends on these values."""
        return self.is_judged and (self.has_bools or self.above > -np.inf or self.below < np.inf)

    @cached_property
    def numbers(self) -> FloatArray:
        """The values without those that are missing."""
        values: FloatArray = np.asarray(self.values, float)
        return values[~np.isnan(values)]

    @property
    def true(self) -> BoolArray:
        """Whether the claim is true, for each of the `numbers`."""
        above = 0.0 if self.has_bools else self.above
        return (self.numbers > above) & (self.numbers <= self.below)

    @property
    def verdict(self) -> Verdict:
        """The verdict by the share of true comparisons."""
        if not len(self.numbers):
            return "no data"
        share = self.true.mean()
        return "reproduced" if share >= SHARE else "not" if share <= 1 - SHARE else "partly"

    def __str__(self) -> str:
        if not len(self.numbers):
            return f"{self.name}: no data"
        count = f"in {int(self.true.sum())} of {len(self.numbers)}"
        if self.has_bools:
            return f"{self.name}: {count}"
        least, middle, most = (
            format(function(self.numbers), self.form) for function in (np.min, np.median, np.max)
        )
        spread = middle if least == most else f"{middle} in the median ({least} … {most})"
        limits = [
            f"{word} {format(bound, self.form)}"
            for word, bound in (("above", self.above), ("at most", self.below))
            if np.isfinite(bound)
        ]
        judged = f", {' and '.join(limits)} {count}" if limits else ""
        missing = np.size(self.values) - len(self.numbers)
        lacking = f"; {missing} without a value" if missing else ""
        return f"{self.name}: {spread}{judged}{lacking}"


def combined(verdicts: Iterable[Verdict]) -> Verdict:
    """The verdict of several statements: partly where they differ, none where one lacks data."""
    different = set(verdicts)
    if not different or "no data" in different:
        return "no data"
    return different.pop() if len(different) == 1 else "partly"
