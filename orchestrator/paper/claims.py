"""The claims of the paper, and the report card: what a study finds of each."""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from orchestrator.paper import measures
from orchestrator.paper.evidence import RULE, Comparison, Evidence, Verdict, combined
from orchestrator.report import page
from orchestrator.report.page import Guest
from orchestrator.tables import Tables

FILE = Path(__file__).with_name("claims.toml")
WORDS: dict[Verdict, str] = {
    "reproduced": "reproduced",
    "partly": "partly",
    "not": "not reproduced",
}
"""Verdicts, and what the page calls them."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    `says` is the paper's words in short, `where` its section or figure, and `verdict` that on the
    data of the preset ``paper``, which `why` explains. `measure` gives the comparisons that judge
    the claim; names of the page's figures that show it begin with one of `figures`.
    """

    says: str
    where: str
    measure: Callable[[Evidence], Iterator[Comparison]]
    verdict: Verdict
    why: str
    figures: tuple[str, ...]


@dataclass(frozen=True)
class Judged:
    """A claim with the comparisons of a study, and the verdict by them."""

    claim: Claim
    comparisons: tuple[Comparison, ...]

    @property
    def verdict(self) -> Verdict:
        """By the comparisons that count."""
        return combined(one.verdict for one in self.comparisons if one.is_decisive)

    @property
    def why(self) -> str:
        """The explanation of the claim, if it explains this verdict."""
        if self.verdict == self.claim.verdict:
            return self.claim.why
        if self.verdict == "no data":
            lacking = []
            for one in self.comparisons:
                if one.is_decisive and one.verdict == "no data":
                    lacking.append(one.name)
            names = "; ".join(lacking) or "any of its comparisons"
            return f"The study has no scenes for: {names}."
        there = f"on the preset `paper` without a tolerance it is {self.claim.verdict}"
        return f"Not explained: {there}."


def judge(tables: Tables) -> list[Judged]:
    """Judge every claim of the paper.

    Parameters
    ----------
    tables
        The tables of a study.

    Returns
    -------
    list of Judged
        The claims in the paper's order, then those on its method.
    """
    evidence = Evidence(tables)
    return [Judged(claim, tuple(claim.measure(evidence))) for claim in CLAIMS]


def card(judged: Sequence[Judged], has_tolerance: bool, file: str) -> Guest:
    """Make the report card.

    Parameters
    ----------
    judged
        The claims.
    has_tolerance
        Whether the study was answered within a tolerance.
    file
        Name of the CSV file of the claims.

    Returns
    -------
    Guest
        How many claims hold, a section of the page, and the file.
    """
    counts = Counter(one.verdict for one in judged)
    told = ", ".join(f"{counts[verdict]} {word}" for verdict, word in WORDS.items())
    said = f"{len(judged)} claims of the paper: {told}."
    lacking = counts["no data"]
    if lacking:
        why = "the study has no scenes for them"
        if has_tolerance:
            why = "a tolerance leaves scenes without DEM; without one all are judged"
        said += f" {lacking} could not be judged: {why}."

    def section(figures: Sequence[str]) -> Markup:
        """The section of the page, with the numbers of the figures that show claims."""
        entries = []
        for one in judged:
            numbers = []
            for number, name in enumerate(figures, 1):
                if name.startswith(one.claim.figures):
                    numbers.append(number)
            entries.append((one, numbers))
        text = page.fill(
            "card.html.j2",
            FILE.parent,
            entries=entries,
            said=said,
            rule=RULE,
            words=WORDS,
        )
        return Markup(text)

    return Guest("claims", said, section, {file: frame(judged).to_csv(index=False)})


def frame(judged: Sequence[Judged]) -> pd.DataFrame:
    """List claims as a table.

    Parameters
    ----------
    judged
        The claims.

    Returns
    -------
    DataFrame
        A row for each; its comparisons are one text, a line for each.
    """
    columns = ["claim", "where", "measured", "verdict", "rule", "why"]
    rows = []
    for one in judged:
        text = "\n".join(map(str, one.comparisons))
        claim = one.claim
        rows.append((claim.says, claim.where, text, one.verdict, RULE, one.why))
    return pd.DataFrame(rows, columns=columns)


def _claims() -> Iterator[Claim]:
    """The claims of the file; one of neighbours in a column is measured by `along`."""
    for entry in tomllib.loads(FILE.read_text(encoding="utf-8"))["claim"]:
        pairs = entry.pop("pairs", None)
        measure = entry.pop("measure", "")
        entry["figures"] = tuple(entry["figures"])
        if pairs:
            entry["measure"] = partial(measures.along, **pairs)
        else:
            entry["measure"] = getattr(measures, measure)
        yield Claim(**entry)


CLAIMS: tuple[Claim, ...] = tuple(_claims())
"""In the paper's order, then those on its method."""
