"""The page and the tables of a comparison."""

import contextlib
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Contender, Verdict, failures
from orchestrator.report import FIGURES, settings
from orchestrator.runs.files import Folder
from orchestrator.tables import text

PAGE = "comparison.html"
NUMBERS = "comparison.csv"
VERDICTS = "verdicts.csv"
SAID = 10
"""Most failures that are listed by name on the terminal."""
ABOUT = {
    1: "closed form",
    2: "contact and one grain",
    3: "flow",
    4: "grains of a pile",
    5: "flow and grains",
}
"""Names of the levels."""


@dataclass(frozen=True)
class Found:
    """Outcome of a comparison: failures as lines, a summary, the page."""

    failures: list[str]
    summary: str
    page: Path


def write(
    pack: Pack, contenders: Sequence[Contender], folder: Folder, notes: Sequence[str]
) -> Found:
    """Put tables, figures and page of a comparison into a directory.

    Parameters
    ----------
    pack : Pack
        What was asked.
    contenders : sequence of Contender
        The solvers.
    folder : Folder
        The directory.
    notes : sequence of str
        What is known of how each solver ran, for the page.
    """
    numbers = pd.concat([one.rows.assign(solver=one.name) for one in contenders])
    levels = summary(contenders)
    with settings.own(), _any_letters(), folder.renewed(NUMBERS, VERDICTS, PAGE, FIGURES):
        folder.put(NUMBERS, _text(numbers, "%.9g"))
        folder.put(VERDICTS, _text(pd.DataFrame(_verdicts(contenders)), "%.6g"))
        # the drawing libraries take half a second to import: only who draws waits for them
        from orchestrator.benchmark import page

        page.write(pack, contenders, levels, folder, PAGE, notes)
    return Found(_failures(contenders), levels.to_string(index=False), folder.root / PAGE)


@contextlib.contextmanager
def _any_letters() -> Iterator[None]:
    """Draw a solver's name without a word about letters that the font has not."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        yield


def _text(table: pd.DataFrame, digits: str) -> str:
    columns = ["solver", *table.columns.drop("solver")]
    return text.csv(table[columns], digits)


def _verdicts(contenders: Sequence[Contender]) -> Iterator[dict[str, Any]]:
    for one in contenders:
        for v in one.verdicts:
            yield {"solver": one.name, **asdict(v), "ratio": v.ratio, "cpu_ratio": v.cpu_ratio}


def _failures(contenders: Sequence[Contender]) -> list[str]:
    lines = [
        f"{f'{one.name}: ' if len(contenders) > 1 else ''}{scenes}: {why}"
        for one in contenders
        for _, scenes, why in failures(one)
    ]
    more = len(lines) - SAID
    return lines if more <= 0 else [*lines[:SAID], f"and {more} more: see {VERDICTS}"]


def summary(contenders: Sequence[Contender]) -> pd.DataFrame:
    """One row for each level and kind that was asked, and each solver."""
    kinds = dict.fromkeys((v.level, v.kind) for v in contenders[0].verdicts)
    return pd.DataFrame(
        {
            "level": f"{level} {ABOUT[level]}",
            "kind": kind,
            "solver": one.name,
            **_row([v for v in one.verdicts if (v.level, v.kind) == (level, kind)]),
        }
        for level, kind in kinds
        for one in contenders
    )


def _row(of: Sequence[Verdict]) -> dict[str, Any]:
    answered = [one for one in of if math.isfinite(one.worst)]
    return {
        "scenes": len(of),
        "passed": sum(one.passed for one in of),
        "error, median": _percent([one.error for one in answered]),
        "bias": _percent([one.bias for one in answered]),
        "error, largest": f"{100 * max(v.worst for v in answered):.3g} %" if answered else "",
        "time over ours": _median([one.ratio for one in of]),
        "CPU over ours": _median([one.cpu_ratio for one in of]),
        "peak, MiB": _largest([one.peak_mib for one in of]),
    }


def _percent(values: Sequence[float]) -> str:
    return f"{100 * float(np.median(values)):.3g} %" if values else ""


def _median(values: Sequence[float]) -> str:
    known = [value for value in values if math.isfinite(value)]
    return f"{np.median(known):.3g}" if known else ""


def _largest(values: Sequence[float]) -> str:
    known = [value for value in values if math.isfinite(value)]
    return f"{max(known):.0f}" if known else ""
