"""The claims of the paper, and the report card: what a study finds of each."""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from orchestrator.digits import number, percent
from orchestrator.paper import findings, measures
from orchestrator.paper.evidence import FLOWS, RULE, Comparison, Evidence, Verdict
from orchestrator.paper.findings import COUNTED, WORDS, Finding, columns_of, finding_of
from orchestrator.report import page
from orchestrator.report.card import Card, Mark, Number, Worth
from orchestrator.report.page import Guest, Section, Text
from orchestrator.report.sheets import Sheet
from orchestrator.tables import Tables
from orchestrator.tables.usable import ABOVE_TOLERANCE

FILE = Path(__file__).with_name("claims.toml")
IN_PART: tuple[Verdict, ...] = ("mostly", "half", "mostly not")
"""Verdicts on claims that hold in a part of the comparisons."""
MARKS: dict[Verdict, Mark] = {
    "reproduced": "good",
    **dict.fromkeys(IN_PART, "care"),
    "not": "bad",
}
"""Verdicts, and their marks; one that was not judged has none."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes
    ----------
    says
        The paper's words in short.
    where
        Section or figure of the paper.
    measure
        Gives the comparisons that judge the claim.
    why
        Why the verdict on the data of the preset ``paper`` is the one that it is.
    figures
        Beginnings of the names of the page's figures that show the claim.
    found
        What the preset found: by all lines, then by those under each flow.
    """

    says: str
    where: str
    measure: Callable[[Evidence], Iterator[Comparison]]
    why: str
    figures: tuple[str, ...]
    found: tuple[Finding, ...]


@dataclass(frozen=True)
class JudgedClaim:
    """A claim with what a study finds of it.

    Attributes
    ----------
    claim
        The claim.
    comparisons
        The comparisons of the study.
    """

    claim: Claim
    comparisons: tuple[Comparison, ...]

    @property
    def decisive(self) -> list[Comparison]:
        """The comparisons that count."""
        return [one for one in self.comparisons if one.is_decisive]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What all lines that count say together, then those under each flow."""
        lines = self.decisive
        flows = [name for name in FLOWS if any(one.flow == name for one in lines)]
        by_flow = ([one for one in lines if one.flow == name] for name in flows)
        return (finding_of("", lines), *map(finding_of, flows, by_flow))

    @property
    def verdict(self) -> Verdict:
        """By the comparisons that count."""
        return self.findings[0].verdict

    @property
    def why(self) -> str:
        """The explanation of the claim, if it explains this verdict."""
        expected = self.claim.found[0].verdict
        if self.verdict == expected:
            return self.claim.why
        if self.verdict == "no data":
            lacking = []
            for one in self.decisive:
                if one.verdict == "no data":
                    lacking.append(one.title)
            names = "; ".join(lacking) or "any of its comparisons"
            return f"This study, by its methods, has nothing to compare for: {names}."
        there = f"on the preset `paper` without a tolerance it is {WORDS[expected]}"
        return f"Not explained: {there}."


def judge_claims(tables: Tables) -> list[JudgedClaim]:
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
    return [JudgedClaim(claim, tuple(claim.measure(evidence))) for claim in CLAIMS]


def guest(
    judged: Sequence[JudgedClaim], tables: Tables, file: str, tolerance: float | None
) -> Guest:
    """Make what the page of a study of the paper has beside that of any study.

    Parameters
    ----------
    judged
        The claims.
    tables
        The tables of the study.
    file
        Name of the CSV file of the claims.
    tolerance
        The tolerance of the study.

    Returns
    -------
    Guest
        A card on how many claims hold, a section with each, and the file.
    """

    def sections(figures: Sequence[str]) -> list[Section]:
        """The claims, with the names of the figures that show each."""
        entries = []
        for one in judged:
            shown = [name for name in figures if name.startswith(one.claim.figures)]
            entries.append((one, shown))
        text = page.fill(
            "card.html.j2",
            FILE.parent,
            entries=entries,
            rule=RULE,
            words=WORDS,
            flows=FLOWS,
            marks=MARKS,
            file=file,
            links={},
        )
        title = "What the paper claims, and what this study finds"
        return [Section(title, [Text(Markup(text))], "claims", "Claims")]

    files = {file: frame(judged).to_csv(index=False)}
    card = claims_card(judged, tables, tolerance)
    return Guest(sections, files, card, claims_sheet(judged, file), True)


def claims_card(
    judged: Sequence[JudgedClaim], tables: Tables, tolerance: float | None
) -> Card:
    """Make the answer card: how many claims were judged, and how many of them hold.

    Parameters
    ----------
    judged
        The claims.
    tables
        The tables of the study.
    tolerance
        The tolerance of the study.

    Returns
    -------
    Card
        The counts of the verdicts, of the claims that were judged.
    """
    counts = Counter(one.verdict for one in judged)
    of = len(judged)
    lacking = counts["no data"]
    refuted = [str(n) for n, one in enumerate(judged, 1) if one.verdict == "not"]
    which = f"claim {', '.join(refuted)}" if refuted else "no claim is refuted"
    sides = [f"{counts[side]} {WORDS[side]}" for side in IN_PART if counts[side]]
    part = ", ".join(sides) or "none"
    told: list[tuple[tuple[Verdict, ...], str, str]] = [
        (("reproduced",), "claims reproduced", "in at least 95 % of the comparisons"),
        (IN_PART, "claims that hold in part", part),
        (("not",), "claims not reproduced", which),
    ]
    if lacking:
        # a card has three numbers: what is missing stands in place of the last
        last = f"not reproduced: {which}" if refuted else which
        told[1:] = [(IN_PART, "claims that hold in part", f"{part}; {last}")]
    figures = []
    for verdicts, meaning, note in told:
        count = sum(counts[verdict] for verdict in verdicts)
        whole = of - lacking
        figures.append(
            replace(
                Number.counted(count, whole, meaning, note, MARKS[verdicts[0]]),
                unit=f"of {whole} judged" if lacking else f"of {whole}",
            )
        )
    if lacking:
        note = _why_lacking(judged, tolerance)
        figures.append(Number.counted(lacking, of, "claims not judged", note))
    return Card(
        "Do the paper’s claims hold when its method is run anew?",
        "Bravo, Ortiz and Pérez-Aparicio on sediment transport by the discrete element"
        f" method: {of} claims, {_tested(tables)}.",
        tuple(figures),
        "The claims are compared with this study’s own numbers; claim 4 is about the "
        "published curves for water. “Caveats” has what was"
        " measured in air.",
        _worth(tables, of, lacking, tolerance),
    )


def _why_lacking(judged: Sequence[JudgedClaim], tolerance: float | None) -> str:
    """Which claims have nothing to be judged by, why, and what to do."""
    found = [n for n, one in enumerate(judged, 1) if one.verdict == "no data"]
    which = f"claim{'s' if len(found) > 1 else ''} {', '.join(map(str, found))}"
    if tolerance is None:
        return f"{which}: this study has no scenes, or no load steps, to compare"
    return (
        f"{which}: at a tolerance of {percent(tolerance)} too few scenes are answered "
        "by DEM, whose load steps these claims are about; run the study without "
        "`--tolerance`"
    )


def _tested(tables: Tables) -> str:
    """On how many piles and grains the claims were tested."""
    piles = tables.get("pile_threshold", pd.DataFrame({"scene_id": []}))
    grains = tables.get("single_grain", pd.DataFrame({"scene_id": []}))
    beds = number(piles["scene_id"].nunique(), "pile")
    return f"tested on {beds} and {number(len(grains), 'single grain')}"


def _worth(tables: Tables, of: int, lacking: int, tolerance: float | None) -> Worth:
    """What the verdicts are worth, by the claims and thresholds that they stand on."""
    piles = tables.get("pile_threshold", pd.DataFrame({"usable": []}))
    count = len(piles)
    usable = int(piles["usable"].sum())
    if usable == count and not lacking:
        return Worth("good", "usable", "All thresholds of piles are usable.")
    word = f"usable, with gaps: {of - lacking} of {of} claims judged"
    advice = f"Of the thresholds of piles {usable} of {count} are usable; the table "
    advice += "has the reason against each of the others."
    alone = _for_tolerance_alone(tables)
    if alone and tolerance is not None:
        verb = "have" if alone > 1 else "has"
        advice += (
            f" {alone} of the others {verb} a numerical error above the tolerance of "
            f"{percent(tolerance)} and nothing else against them."
        )
    return Worth("care", word, advice)


def _for_tolerance_alone(tables: Tables) -> int:
    """How many thresholds of piles have the tolerance alone against them."""
    if not {"reason", "pile_threshold"} <= tables.keys():
        return 0
    reasons = tables["reason"]
    piles = tables["pile_threshold"]
    reasons = reasons[reasons["scene_id"].isin(piles["scene_id"])]
    each = reasons.groupby(["scene_id", "fraction"])["reason"]
    return int(((each.nunique() == 1) & (each.first() == ABOVE_TOLERANCE)).sum())


def claims_sheet(judged: Sequence[JudgedClaim], file: str) -> Sheet:
    """List the claims for a terminal.

    Parameters
    ----------
    judged
        The claims.
    file
        Name of the CSV file of the claims.

    Returns
    -------
    Sheet
        A row for each.
    """
    rows = []
    for n, one in enumerate(judged, 1):
        whole, *by_flow = one.findings
        verdict = WORDS[whole.verdict]
        if len({each.verdict for each in by_flow}) > 1:
            told = [f"by {FLOWS[each.flow]} {each}" for each in by_flow]
            verdict = f"{verdict}: {'; '.join(told)}"
        count = whole.count if whole.verdict in MARKS else "—"
        rows.append((str(n), one.claim.says, count, verdict))
    columns = ["no", "claim of the paper", "holds in", "verdict"]
    return Sheet("The claims", pd.DataFrame(rows, columns=columns), file=file)


def frame(judged: Sequence[JudgedClaim]) -> pd.DataFrame:
    """List claims as a table.

    Parameters
    ----------
    judged
        The claims.

    Returns
    -------
    DataFrame
        A row for each, with the verdict and the counts of all lines, then those by
        each flow; its comparisons are one text, a line for each.
    """
    rows = []
    for one in judged:
        by_flow = {each.flow: each for each in one.findings}
        row: dict[str, object] = {"claim": one.claim.says, "where": one.claim.where}
        for flow in ("", *FLOWS):
            of_flow = by_flow.get(flow)
            for name, column in zip(COUNTED, columns_of(flow), strict=True):
                row[column] = getattr(of_flow, name) if of_flow else None
        row["measured"] = "\n".join(map(str, one.comparisons))
        rows.append({**row, "rule": RULE, "why": one.why})
    table = pd.DataFrame(rows)
    counts = [name for flow in ("", *FLOWS) for name in columns_of(flow)[1:]]
    return table.astype(dict.fromkeys(counts, "Int64"))


def _claims() -> Iterator[Claim]:
    """The claims of the file; one of neighbours in a column is measured by `along`."""
    entries = tomllib.loads(FILE.read_text(encoding="utf-8"))["claim"]
    for entry, found in zip(entries, findings.of_preset(), strict=True):
        entry["found"] = found
        pairs = entry.pop("pairs", None)
        measure = entry.pop("measure", "")
        entry["figures"] = tuple(entry["figures"])
        if pairs:
            entry["measure"] = partial(measures.rises_along, **pairs)
        else:
            entry["measure"] = getattr(measures, measure)
        yield Claim(**entry)


CLAIMS: tuple[Claim, ...] = tuple(_claims())
"""In the paper's order, then those on its method."""
