"""Answers against expectations: each number, then each scene."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import answer
from orchestrator.benchmark.answer import FILE, AnswerError
from orchestrator.benchmark.mistakes import hint
from orchestrator.benchmark.pack import Pack
from orchestrator.files import read_json

USED = "used.json"
"""What a solver took for a scene, beside its answer."""
COUNTS = ("moved", "not_moved")
"""Whole numbers, which may be small: they are judged, but a relative error says little of them."""
ROUND = 1e-8
"""Relative: the digits of a pack's tables."""


@dataclass(frozen=True)
class Verdict:
    """How a scene went.

    Attributes
    ----------
    scene, kind : str
        Its name, and what was to be solved.
    level : int
        1 to 5.
    passed : bool
        Whether every judged number is within.
    message : str
        Why not.
    error : float
        Median relative error of the judged numbers; NaN without an answer.
    worst : float
        The largest of them.
    seconds, ours_seconds : float
        Wall time of the solver, and of ours; NaN if it is not known.
    cpu_s, ours_cpu_s : float
        CPU time of both.
    peak_mib : float
        Memory of the solver.
    """

    scene: str
    level: int
    kind: str
    passed: bool
    message: str
    error: float
    worst: float
    seconds: float
    ours_seconds: float
    cpu_s: float
    ours_cpu_s: float
    peak_mib: float

    @property
    def ratio(self) -> float:
        """The solver's wall time over ours."""
        return self.seconds / self.ours_seconds

    @property
    def cpu_ratio(self) -> float:
        """The same of the CPU time, which a busy machine disturbs less."""
        return self.cpu_s / self.ours_cpu_s


def compared(
    pack: Pack, names: Sequence[str], results: Path, ours: Path
) -> tuple[list[Verdict], pd.DataFrame]:
    """Compare the answers of some scenes.

    Parameters
    ----------
    pack : Pack
        What is expected.
    names : sequence of str
        The scenes.
    results, ours : Path
        Hold ``SCENE/answer.csv`` of the solver, and of our own run where there was one.

    Returns
    -------
    list of Verdict
        One for each scene.
    DataFrame
        The expectations with ``found``, ``error`` (relative) and ``within``; where there is no
        tolerance nothing is judged.
    """
    groups = dict(iter(pack.expected.groupby("scene", sort=False)))
    parts = []
    verdicts = []
    for name in names:
        rows, error = _rows(pack.scenes[name], groups[name], results / name, ours / name)
        parts.append(rows)
        verdicts.append(_verdict(pack.scenes[name], rows, error, results / name, ours / name))
    return verdicts, pd.concat(parts, ignore_index=True)


def _rows(
    told: Mapping[str, Any], expected: pd.DataFrame, folder: Path, ours: Path
) -> tuple[pd.DataFrame, str]:
    found: dict[answer.Key, float] = {}
    error = str((read_json(folder / USED) or {}).get("error") or "")
    if not error:
        try:
            found = answer.read(folder / FILE, expected, told.get("count"))
        except AnswerError as wrong:
            error = str(wrong)
    keys = [answer.key(q, at) for q, at in zip(expected["quantity"], expected["at"], strict=True)]
    value = expected["value"].to_numpy(float)
    given = np.array([found.get(key, math.nan) for key in keys])
    rows = expected.assign(
        found=given, error=_relative(given, value), within=_within(given, expected)
    )
    if (ours / FILE).is_file():
        run = answer.numbers(ours / FILE)
        rows = rows.assign(ours=[run.get(key, math.nan) for key in keys])
    return rows, error


def _relative(found: Any, value: Any) -> Any:
    # a count of zero has no relative error
    return (found - value) / np.where(value == 0, 1.0, value)


def _within(found: Any, expected: pd.DataFrame) -> Any:
    """Whether each number is in its interval, widened by its tolerance; missing ones are not."""
    margin = (expected["tolerance"] + ROUND) * expected["value"].abs()
    return (found >= expected["low"] - margin) & (found <= expected["high"] + margin)


def _verdict(
    told: Mapping[str, Any], rows: pd.DataFrame, error: str, folder: Path, ours: Path
) -> Verdict:
    judged = rows[rows["tolerance"].notna()]
    wrong = judged[~judged["within"].astype(bool)]
    errors = judged.loc[~judged["quantity"].isin(COUNTS), "error"].abs()
    message = error or (_message(told, rows, wrong) if len(wrong) else "")
    used, run = (read_json(place / USED) or {} for place in (folder, ours))
    return Verdict(
        scene=str(told["scene"]),
        level=int(told["level"]),
        kind=str(told["kind"]),
        passed=not message,
        message=message,
        error=float(errors.median()) if not error else math.nan,
        worst=float(errors.max()) if not error else math.nan,
        seconds=_number(used.get("seconds")),
        ours_seconds=_number(run.get("seconds")),
        cpu_s=_number(used.get("cpu_s")),
        ours_cpu_s=_number(run.get("cpu_s")),
        peak_mib=_number(used.get("peak_mib")),
    )


def _message(told: Mapping[str, Any], rows: pd.DataFrame, wrong: pd.DataFrame) -> str:
    """The number that is furthest off, how many others are, and the likely cause."""
    # a count is named only if nothing else is off
    size = wrong["error"].abs().where(~wrong["quantity"].isin(COUNTS), 0.0)
    first = wrong.iloc[int(size.to_numpy().argmax())]
    at = f" at {first['at']}" if first["at"] else ""
    said = f"{first['quantity']}{at} is {first['found']:.6g}, not {first['value']:.6g}"
    if first["low"] < first["high"]:
        said += f" ({first['low']:.6g} ... {first['high']:.6g})"
    if len(wrong) > 1:
        said += f", and {len(wrong) - 1} more are off"
    same = rows[rows["quantity"] == first["quantity"]]
    ratios = (same["found"] / same["value"]).tolist()
    cause = hint(str(told["kind"]), told, str(first["quantity"]), ratios)
    return f"{said}: {cause}" if cause else said


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
