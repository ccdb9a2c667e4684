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
from orchestrator.tables import Tables

FILE = Path(__file__).with_name("claims.toml")


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
            return f"The study has no scenes for: {lacking or 'any of its comparisons'}."
        there = f"on the preset `paper` without a tolerance it is {self.claim.verdict}"
        return f"Not explained: {there}."


def judge(tables: Tables) -> list[Judged]:
    """Judge every claim of the paper by the tables of a study."""
    evidence = Evidence(tables)
    return [Judged(claim, tuple(claim.measure(evidence))) for claim in CLAIMS]


def section(judged: Sequence[Judged], figures: Sequence[str], has_tolerance: bool) -> Markup:
    """The report card as a section of the page; empty where no claim could be judged.

    `figures` are the names of the page's figures in their order; `has_tolerance` is whether many
    scenes may be answered without DEM.
    """
    entries = []
    for one in (one for one in judged if one.verdict != "no data"):
        named = [name.startswith(one.claim.figures) for name in figures]
        entries.append((one, [number for number, is_shown in enumerate(named, 1) if is_shown]))
    counts = Counter(one.verdict for one, _ in entries)
    lacking = [one for one in judged if one.verdict == "no data"]
    values = {"entries": entries, "counts": counts, "lacking": lacking, "rule": RULE}
    template = ("card.html.j2", Path(__file__).parent)
    return Markup(page.fill(*template, **values, has_tolerance=has_tolerance))


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
        function = partial(measures.along, **pairs) if pairs else getattr(measures, measure)
        yield Claim(**{**entry, "measure": function, "figures": tuple(entry["figures"])})


CLAIMS: tuple[Claim, ...] = tuple(_claims())
"""In the paper's order, then those on its method."""
