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
            lines = (one for one in self.comparisons if one.is_decisive)
            lacking = "; ".join(one.name for one in lines if one.verdict == "no data")
            return (
                f"The study has no scenes for: {lacking or 'any of its comparisons'}."
            )
        there = f"on the preset `paper` without a tolerance it is {self.claim.verdict}"
        return f"Not explained: {there}."


def judge(tables: Tables) -> list[Judged]:
    """Judge every claim of the paper by the tables of a study."""
    evidence = Evidence(tables)
    return [Judged(claim, tuple(claim.measure(evidence))) for claim in CLAIMS]


def card(judged: Sequence[Judged], has_tolerance: bool, file: str) -> Guest:
    """The report card: how many claims hold, the section of the page, and a CSV file."""
    counts = Counter(one.verdict for one in judged)
    told = ", ".join(f"{counts[verdict]} {word}" for verdict, word in WORDS.items())
    said = f"{len(judged)} claims of the paper: {told}."
    if lacking := counts["no data"]:
        why = "a tolerance leaves scenes without DEM; without one all are judged"
        why = why if has_tolerance else "the study has no scenes for them"
        said += f" {lacking} could not be judged: {why}."

    def section(figures: Sequence[str]) -> Markup:
        each = list(enumerate(figures, 1))
        shown = [
            [n for n, name in each if name.startswith(one.claim.figures)]
            for one in judged
        ]
        values = {
            "entries": list(zip(judged, shown, strict=True)),
            "said": said,
            "rule": RULE,
        }
        return Markup(page.fill("card.html.j2", FILE.parent, **values, words=WORDS))

    return Guest("claims", said, section, {file: frame(judged).to_csv(index=False)})


def frame(judged: Sequence[Judged]) -> pd.DataFrame:
    """The claims as a table; the comparisons are one text, a line for each."""
    columns = ["claim", "where", "measured", "verdict", "rule", "why"]
    texts = ["\n".join(map(str, one.comparisons)) for one in judged]
    rows = [
        (one.claim.says, one.claim.where, text, one.verdict, RULE, one.why)
        for one, text in zip(judged, texts, strict=True)
    ]
    return pd.DataFrame(rows, columns=columns)


def _claims() -> Iterator[Claim]:
    for entry in tomllib.loads(FILE.read_text(encoding="utf-8"))["claim"]:
        pairs, measure = entry.pop("pairs", None), entry.pop("measure", "")
        function = (
            partial(measures.along, **pairs) if pairs else getattr(measures, measure)
        )
        yield Claim(
            **{**entry, "measure": function, "figures": tuple(entry["figures"])}
        )


CLAIMS: tuple[Claim, ...] = tuple(_claims())
"""In the paper's order, then those on its method."""
