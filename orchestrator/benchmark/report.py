"""The page and the tables of a comparison."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Verdict
from orchestrator.files import write_durably

PAGE = "comparison.html"
NUMBERS = "comparison.csv"
VERDICTS = "verdicts.csv"
FIGURES = "figures"
SAID = 10
"""Most failures that are listed by name on the terminal."""
ABOUT = {
    1: "closed form",
    2: "contact and one grain",
    3: "flow",
    4: "grains of a pile",
    5: "flow and grains",
}
"""What the levels are."""


@dataclass(frozen=True)
class Found:
    """What a comparison came to: failures as lines, a summary, the page."""

    failures: list[str]
    summary: str
    page: Path


def write(pack: Pack, verdicts: Sequence[Verdict], rows: pd.DataFrame, root: Path) -> Found:
    """Write tables, figures and page of a comparison into a directory."""
    # the drawing libraries take half a second to import: only who draws waits for them
    from orchestrator.benchmark import page

    write_durably(root / NUMBERS, rows.to_csv(index=False, float_format="%.9g"))
    table = pd.DataFrame(
        [{**asdict(v), "ratio": v.ratio, "cpu_ratio": v.cpu_ratio} for v in verdicts]
    )
    write_durably(root / VERDICTS, table.to_csv(index=False, float_format="%.6g"))
    levels = summary(verdicts)
    (root / FIGURES).mkdir(exist_ok=True)
    text = page.render(pack, verdicts, rows, levels, root / FIGURES)
    write_durably(root / PAGE, text)
    return Found(_failures(verdicts), _plain(levels), root / PAGE)


def _failures(verdicts: Sequence[Verdict]) -> list[str]:
    lines = [f"{one.scene}: {one.message}" for one in verdicts if not one.passed]
    more = len(lines) - SAID
    return lines if more <= 0 else [*lines[:SAID], f"and {more} more scenes: see {VERDICTS}"]


def summary(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    """One row for each level and kind that was asked."""
    kinds = dict.fromkeys((one.level, one.kind) for one in verdicts)
    return [
        _row(level, kind, [v for v in verdicts if (v.level, v.kind) == (level, kind)])
        for level, kind in kinds
    ]


def _row(level: int, kind: str, of: Sequence[Verdict]) -> dict[str, Any]:
    errors = [one.error for one in of if math.isfinite(one.error)]
    worst = [one.worst for one in of if math.isfinite(one.worst)]
    return {
        "level": f"{level} {ABOUT[level]}",
        "kind": kind,
        "scenes": len(of),
        "passed": sum(one.passed for one in of),
        "error, median": _percent(np.median(errors)) if errors else "",
        "error, largest": _percent(max(worst)) if worst else "",
        "time over ours": _median([one.ratio for one in of]),
        "CPU over ours": _median([one.cpu_ratio for one in of]),
        "peak, MiB": _largest([one.peak_mib for one in of]),
    }


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _median(values: Sequence[float]) -> str:
    known = [value for value in values if math.isfinite(value)]
    return f"{np.median(known):.3g}" if known else ""


def _largest(values: Sequence[float]) -> str:
    known = [value for value in values if math.isfinite(value)]
    return f"{max(known):.0f}" if known else ""


def _plain(levels: Sequence[dict[str, Any]]) -> str:
    return pd.DataFrame(levels).to_string(index=False)
