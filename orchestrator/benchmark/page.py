"""The page of a comparison: all solvers side by side."""

import textwrap
from collections.abc import Iterator, Sequence

import pandas as pd

from orchestrator.benchmark import charts, sheets
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Contender, failures
from orchestrator.errors import printable
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.report.facts import Sheet
from orchestrator.runs.files import Folder

WIDE = 100
"""Characters of a message before it is broken."""
LIMITS = (
    "Levels 1 and 2 are compared with exact answers, levels 3 to 5 with our own runs: agreement "
    "there is that of solvers, not with nature.",
    "The intervals hold the step between two load steps, the count’s resolution and the scatter "
    "over "
    "packings where it was run; they do not hold what the flow model does.",
    "Scenes of less than a second are mostly start-up of the programs.",
)


def write(
    pack: Pack,
    contenders: Sequence[Contender],
    levels: pd.DataFrame,
    folder: Folder,
    name: str,
    notes: Sequence[str],
) -> None:
    """Put the page and its figures into a directory; `levels` is the summary."""
    names = ", ".join(one.name for one in contenders)
    title = f"Against the pack “{printable(pack.root.name)}”: {names}"
    sections = list(_sections(pack, contenders, levels, notes))
    document.write(title, sections, folder, name, pack.manifest.get("programs", {}))


def _sections(
    pack: Pack, contenders: Sequence[Contender], levels: pd.DataFrame, notes: Sequence[str]
) -> Iterator[Section]:
    limits = (*LIMITS, *notes)
    yield Section("Levels", _levels(pack, contenders), (), (_sheet(levels),), limits)
    failed = _failed(contenders)
    if not failed.empty:
        yield Section("What failed", tables=(_sheet(failed),))
    beds, thresholds = list(charts.beds(pack, contenders)), sheets.thresholds(pack, contenders)
    if beds:
        tables = () if thresholds.empty else (_sheet(thresholds),)
        yield Section("Beds", _BEDS if tables else "", beds, tables)
    costs = sheets.costs(pack, contenders)
    yield Section(
        "Time and error",
        _COSTS if len(costs) else "",
        list(charts.speed(contenders)),
        (_sheet(costs),) if len(costs) else (),
    )
    yield Section("Scenes", tables=(_sheet(sheets.scenes(contenders)),))


def _sheet(table: pd.DataFrame) -> Sheet:
    # heads are typeset: an underscore of a solver's name would lower what follows
    return document.sheet(table.rename(columns=lambda name: name.replace("_", " ")))


def _levels(pack: Pack, contenders: Sequence[Contender]) -> str:
    verdicts = [v for one in contenders for v in one.verdicts]
    machine = pack.manifest.get("machine", {})
    where = f" on {machine['processor']} with {machine['cores']} cores" if machine else ""
    return (
        f"{sum(v.passed for v in verdicts)} of {len(verdicts)} scenes passed. The pack was "
        f"exported{where}; the programs below gave its expected answers.\n\n"
        "Errors are relative, over the judged numbers of a scene; the bias is their median with "
        "its sign, over all scenes: it shows a fault that each scene’s interval still holds. Time "
        "and CPU time are the solver’s over ours, which ran in turn with it, the median of the "
        "scenes: below 1 is faster than ours. The CPU time is disturbed less where other programs "
        "run. Every number is in comparison.csv beside this page, every scene in verdicts.csv."
    )


_BEDS = (
    "Threshold Shields numbers, ours and each solver’s. One with a * is outside the interval of "
    "the expected answer, one with ** also beyond its tolerance: it fails."
)
_COSTS = (
    "CPU time of each pile under the given stress, s and over ours, the solver’s start included. "
    "Where a solver states its time steps, M/s is millions of them a second of CPU time, times the "
    "mobile grains."
)


def _failed(contenders: Sequence[Contender]) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "solver": one.name,
            "scenes": scenes,
            "kind": kind,
            "why": textwrap.fill(why, WIDE),
        }
        for one in contenders
        for kind, scenes, why in failures(one)
    )
