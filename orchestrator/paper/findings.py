"""What a study finds of a claim: a verdict, and in how many comparisons it is true."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pandas as pd

from orchestrator.paper.evidence import FLOWS, Comparison, Verdict, combined

FOUND = Path(__file__).with_name("found.csv")
"""What the preset `paper` without a tolerance found; docs/paper.py writes it."""
WORDS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "mostly": "mostly",
    "half": "in half",
    "mostly not": "mostly not",
    "not": "not reproduced",
    "no data": "not judged",
}
"""Verdicts, and what the page calls them."""
COUNTED = ("verdict", "true", "of")
"""What the file of claims has of a finding."""


@dataclass(frozen=True)
class Finding:
    """What some lines say of a claim.

    Attributes
    ----------
    flow
        The stress of `FLOWS` under which they were found; empty for all lines.
    verdict
        Their verdict.
    true, of
        In how many of their comparisons the claim is true, and of how many.
    """

    flow: str
    verdict: Verdict
    true: int
    of: int

    @property
    def count(self) -> str:
        """The counts in words; a dash without any."""
        return f"{self.true} of {self.of}" if self.of else "—"

    def __str__(self) -> str:
        word = WORDS[self.verdict]
        return f"{word}, {self.count}" if self.of else word


def finding_of(flow: str, lines: Sequence[Comparison]) -> Finding:
    """Judge a claim by some lines.

    Parameters
    ----------
    flow
        The stress of `FLOWS` under which they were found; empty for all lines.
    lines
        Lines that count.

    Returns
    -------
    Finding
        What they say.
    """
    counts = [line.counts for line in lines]
    true = sum(count for count, _ in counts)
    return Finding(flow, combined(lines), true, sum(of for _, of in counts))


def columns_of(flow: str) -> list[str]:
    """Name the columns of a finding in the file of claims.

    Parameters
    ----------
    flow
        Its stress, of `FLOWS`; empty for all lines.

    Returns
    -------
    list of str
        Those of `COUNTED`.
    """
    return [f"{name}_{flow}" if flow else name for name in COUNTED]


def of_preset() -> list[tuple[Finding, ...]]:
    """Read what the preset found of each claim.

    Returns
    -------
    list of tuple
        Of each claim the finding of all lines, then those under each flow.
    """
    rows = pd.read_csv(FOUND).to_dict("records")
    return [tuple(_findings(row)) for row in rows]


def _findings(row: Mapping[Hashable, Any]) -> Iterator[Finding]:
    """The findings of a row of the file of claims, without those that it has not."""
    for flow in ("", *FLOWS):
        verdict, true, of = (row[column] for column in columns_of(flow))
        if isinstance(verdict, str):
            yield Finding(flow, cast(Verdict, verdict), int(true), int(of))
