"""Answers against expectations: each number, then each scene."""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import answer
from orchestrator.benchmark.answer import COUNTS, FILE, STEPS, AnswerError
from orchestrator.benchmark.mistakes import hint
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import InputError, one_line, printable
from orchestrator.runs.files import read_json

USED = "used.json"
"""Time of a solver for a scene, beside its answer."""
OURS = "ours"
"""Our own answers, in a directory beside the solver's."""
ROUND = 1e-8
"""Relative: the digits of a pack's tables."""
NUMBERS = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
"""Parts that differ in the messages of one cause."""


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
    cause : str
        What it has in common with other failures of one cause: the likely mistake or, where none is
        known, the message without its numbers.
    answered : bool
        Whether there were numbers to judge.
    error : float
        Median relative error of the judged numbers; NaN without an answer.
    worst : float
        The largest of them.
    bias : float
        Their median with its sign: above zero for answers that are too large.
    seconds, ours_seconds : float
        Wall time of the solver, and of ours; NaN if it is not known.
    cpu_s, ours_cpu_s : float
        CPU time of both.
    steps, ours_steps : float
        Time steps of both, where they are stated.
    peak_mib : float
        Memory of the solver.
    """

    scene: str
    level: int
    kind: str
    passed: bool
    message: str
    cause: str
    answered: bool
    error: float
    worst: float
    bias: float
    seconds: float
    ours_seconds: float
    cpu_s: float
    ours_cpu_s: float
    steps: float
    ours_steps: float
    peak_mib: float

    @property
    def ratio(self) -> float:
        """The solver's wall time over ours; NaN for a scene that it did not answer."""
        return self.seconds / self.ours_seconds if self.answered else math.nan

    @property
    def cpu_ratio(self) -> float:
        """The same of the CPU time, which a busy machine disturbs less."""
        return self.cpu_s / self.ours_cpu_s if self.answered else math.nan


@dataclass(frozen=True)
class Contender:
    """A solver with its answers to some scenes of a pack.

    Attributes
    ----------
    name : str
        That of the directory of its results.
    verdicts : list of Verdict
        One for each scene.
    rows : DataFrame
        The expectations with ``found``, ``error`` (relative) and ``within``; where there is no
        tolerance nothing is judged. The index is the same for all solvers.
    """

    name: str
    verdicts: list[Verdict]
    rows: pd.DataFrame


def failures(of: Contender) -> Iterator[tuple[str, str, str]]:
    """The failures of a solver, one for each cause: kind, scenes, and why the first failed."""
    groups: dict[tuple[str, str], list[Verdict]] = {}
    for v in of.verdicts:
        if not v.passed:
            groups.setdefault((v.kind, v.cause), []).append(v)
    for (kind, _), (first, *others) in groups.items():
        more = f" and {len(others)} more of kind {kind}" if others else ""
        yield kind, first.scene + more, first.message


def ours(contenders: Sequence[Contender]) -> Contender:
    """Ourselves as one more of them: our answers beside the first, the mean of our CPU times."""
    first = contenders[0]
    found, value = first.rows["ours"], first.rows["value"]
    rows = first.rows.assign(found=found, error=_relative(found, value))
    judged = rows[rows["tolerance"].notna() & ~rows["quantity"].isin(COUNTS)]
    worst = judged["error"].abs().groupby(judged["scene"]).max()
    turns = [(v.scene, v.ours_cpu_s) for one in contenders for v in one.verdicts]
    cpu_s = pd.DataFrame(turns, columns=["scene", "s"]).groupby("scene")["s"].mean()
    verdicts = [
        replace(
            v,
            answered=True,
            worst=float(worst.get(v.scene, math.nan)),
            cpu_s=float(cpu_s[v.scene]),
            ours_cpu_s=math.nan,
            steps=v.ours_steps,
        )
        for v in first.verdicts
    ]
    return Contender(OURS, verdicts, rows)


def compared(pack: Pack, names: Sequence[str], results: Path) -> Contender:
    """Compare the answers of a solver.

    Parameters
    ----------
    pack : Pack
        What is expected.
    names : sequence of str
        The scenes.
    results : Path
        Holds ``SCENE/answer.csv`` of the solver, and ``ours/SCENE/answer.csv`` where ours ran.
    """
    groups = dict(iter(pack.expected.groupby("scene", sort=False)))
    judged = [
        _judged(pack.scenes[name], groups[name], results / name, results / OURS / name)
        for name in names
    ]
    rows = pd.concat([part for _, part in judged], ignore_index=True)
    return Contender(printable(results.absolute().name), [verdict for verdict, _ in judged], rows)


def _judged(
    told: Mapping[str, Any], expected: pd.DataFrame, folder: Path, ours: Path
) -> tuple[Verdict, pd.DataFrame]:
    used, own_used = (_used(place) for place in (folder, ours))
    found, error = _answered(told, expected, folder, str(used.get("error") or ""))
    own = _own(ours / FILE)
    keys = answer.keys(expected)
    given = np.array([found.get(key, math.nan) for key in keys])
    rows = expected.assign(
        found=given,
        error=_relative(given, expected["value"].to_numpy(float)),
        within=within(given, expected, expected["tolerance"]),
    )
    if own:
        rows = rows.assign(ours=[own.get(key, math.nan) for key in keys])
    took = {
        "seconds": used.get("seconds"),
        "ours_seconds": own_used.get("seconds"),
        "cpu_s": used.get("cpu_s"),
        "ours_cpu_s": own_used.get("cpu_s"),
        "steps": found.get(STEPS),
        "ours_steps": own.get(STEPS),
        "peak_mib": used.get("peak_mib"),
    }
    return _verdict(told, rows, error, took), rows


def _used(folder: Path) -> Mapping[str, Any]:
    found = read_json(folder / USED)
    return found if isinstance(found, dict) else {}


def _own(path: Path) -> Mapping[answer.Key, float]:
    """Our answer, where ours ran."""
    if not os.path.lexists(path):
        return {}
    try:
        return answer.numbers(path)
    except AnswerError as wrong:
        raise InputError(wrong.what, where=str(path), remedy="remove it") from None


def _answered(
    told: Mapping[str, Any], expected: pd.DataFrame, folder: Path, error: str
) -> tuple[dict[answer.Key, float], str]:
    """The numbers that count, and why there are none."""
    if error:
        return {}, one_line(error)  # it repeats what a program printed
    try:
        return answer.read(folder / FILE, expected, told.get("count")), ""
    except AnswerError as wrong:
        return {}, str(wrong)


def _relative(found: Any, value: Any) -> Any:
    # a count of zero has no relative error
    return (found - value) / np.where(value == 0, 1.0, value)


def within(found: Any, expected: pd.DataFrame, tolerance: Any) -> Any:
    """Whether each number is in its interval, widened by a tolerance; missing ones are not."""
    margin = (tolerance + ROUND) * expected["value"].abs()
    return (found >= expected["low"] - margin) & (found <= expected["high"] + margin)


def _verdict(
    told: Mapping[str, Any], rows: pd.DataFrame, error: str, took: Mapping[str, Any]
) -> Verdict:
    judged = rows[rows["tolerance"].notna()]
    wrong = judged[~judged["within"].astype(bool)]
    signed = judged.loc[~judged["quantity"].isin(COUNTS), "error"]
    errors = signed.abs()
    message, cause = error, ""
    if not error and len(wrong):
        message, cause = _message(told, rows, wrong)
    return Verdict(
        scene=str(told["scene"]),
        level=int(told["level"]),
        kind=str(told["kind"]),
        passed=not message,
        message=message,
        cause=cause or NUMBERS.sub("#", message),
        answered=not error,
        error=float(errors.median()) if not error else math.nan,
        worst=float(errors.max()) if not error else math.nan,
        bias=float(signed.median()) if not error else math.nan,
        **{name: _number(value) for name, value in took.items()},
    )


def _message(told: Mapping[str, Any], rows: pd.DataFrame, wrong: pd.DataFrame) -> tuple[str, str]:
    """The number that is furthest off and how many others are; and the likely cause."""
    # a count is named only if nothing else is off
    size = wrong["error"].abs().where(~wrong["quantity"].isin(COUNTS), 0.0)
    place = int(size.to_numpy().argmax())
    first = wrong.iloc[place]
    at = f" at {first['at']}" if first["at"] else ""
    said = f"{first['quantity']}{at} is {first['found']:.6g}, not {first['value']:.6g}"
    if first["low"] < first["high"]:
        said += f" ({first['low']:.6g} ... {first['high']:.6g})"
    if len(wrong) > 1:
        said += f", and {len(wrong) - 1} more are off"
    cause = hint(told, rows, pd.concat([wrong.iloc[[place]], wrong.drop(wrong.index[place])]))
    return (f"{said}: {cause}" if cause else said), cause


def _number(value: Any) -> float:
    # times, steps, memory: whoever made the results, what none of them can be is not known
    return float(value) if isinstance(value, int | float) and 0 < value < 1e300 else math.nan
