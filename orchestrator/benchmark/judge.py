"""Judge the answers of solvers to the scenes of a pack: errors, verdicts, and what failed."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.pack import COUNTS, Pack
from orchestrator.errors import one_line, printable
from orchestrator.runs import workspace
from orchestrator.runs.files import opened, read_json

ANSWER, USED, OURS = "answer.csv", "used.json", "ours"
"""Files of a scene in the results: the answer and the times. The answers of our solvers lie in a
directory beside those of the solver; they are those of the solver `OURS`."""
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
TIMES = ["seconds", "cpu_s", "peak_mib"]
MIB = 2**20
ANSWER_BYTES = 4 * MIB  # of the largest answer
ROUND = 1e-8  # relative rounding of a pack's tables
DECLINED = "it ended with 2(:|$)"  # message of a solver that does not know a kind of scene


def name_of(place: Path) -> str:
    """The name of the solver of a directory of results: what `run` noted, or the directory's."""
    noted = workspace.read_marker(place, workspace.RESULTS).get("solver")
    return printable(str(noted or place.absolute().name))


def place_of(at: str) -> str:
    """The number ``at`` to seven digits; empty for a quantity that is one number."""
    return f"{float(at):.7g}" if at.strip() else ""


def _answers(path: Path) -> dict[tuple[str, str], float]:
    """The answers of a file, by quantity and `place_of`; OSError or ValueError for a fault."""
    with opened(path) as stream:
        content = stream.read(ANSWER_BYTES + 1)
    if len(content) > ANSWER_BYTES:
        raise ValueError(f"it has more than {ANSWER_BYTES // MIB} MiB")
    # some programs begin a text with a mark of its encoding
    lines = content.decode("utf-8-sig").split("\n")
    head, *rows = [[word.strip() for word in line.split(",")] for line in lines]
    if head != ["quantity", "at", "value"]:
        raise ValueError("it does not begin with quantity,at,value")
    if rows[-1:] != [[""]]:
        raise ValueError("it is cut short: its last line has no end")
    answers: dict[tuple[str, str], float] = {}
    for number, row in enumerate(rows, 2):
        try:
            quantity, at, value = row if row != [""] else ("", "", "0")
            key, answer = (quantity, place_of(at)), float(value)
        except ValueError:
            answer = np.nan
        if not np.isfinite(answer) or (quantity and key in answers):
            what = "is answered twice, or is not a quantity, its at and a finite number"
            raise ValueError(f"line {number}, {','.join(row)[:80]!r}, {what}")
        answers[key] = answer
    return answers


def _read(place: Path, names: Sequence[str]) -> tuple[dict[tuple[str, ...], float], pd.DataFrame]:
    """What a solver left: answers by scene, quantity and place; per scene message, times, memory.

    The message is the reason why the answer to a scene does not count, or empty.
    """
    answers: dict[tuple[str, ...], float] = {}
    used = []
    for name in names:
        about = read_json(place / name / USED)
        error, given = str(about.get("error") or ""), {}
        try:
            given = {} if error else _answers(place / name / ANSWER)
        except FileNotFoundError:
            error = f"it wrote no {ANSWER}"
        except (OSError, ValueError) as fault:
            error = f"{ANSWER}: {fault}"
        answers |= {(name, *key): answer for key, answer in given.items()}
        # the message repeats the output of a program
        used.append([one_line(error), *map(about.get, TIMES), given.get((STEPS, ""))])
    table = pd.DataFrame(used, index=list(names), columns=["message", *TIMES, STEPS])
    numbers = table[[*TIMES, STEPS]].apply(pd.to_numeric, errors="coerce")
    return answers, table[["message"]].join(numbers.where(numbers > 0))


def judge(
    chosen: Pack, names: Sequence[str], results: Sequence[Path]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the answers of solvers with the expected ones.

    For each solver `results` has the directory with its ``SCENE/answer.csv``, and with
    ``ours/SCENE/answer.csv`` if ours ran in turn with it. The first table has a row for each
    solver, `OURS` the last, and each expectation: ``answer``, ``error`` (relative), ``within``; the
    second one for each solver and scene: ``passed``, ``failed`` or, by a solver that answers
    another, ``declined``; ``message``, errors and times.
    """
    expected = chosen.expected[chosen.expected["scene"].isin(names)]
    parts = (expected["scene"], expected["quantity"], expected["at"].map(place_of))
    keys, value = list(zip(*parts, strict=True)), expected["value"]
    margin = (expected["tolerance"] + ROUND) * value.abs()
    numbers, verdicts = [], []
    for place in (*results, results[0] / OURS):
        solver = name_of(place) if place in results else OURS
        answers, used = _read(place, names)
        again, ours = (answers, used) if solver == OURS else _read(place / OURS, names)
        table = expected.assign(solver=solver)
        table["ours"] = [again.get(key, x) for key, x in zip(keys, table["ours"], strict=True)]
        table["answer"] = [answers.get(key, np.nan) for key in keys]
        if solver == OURS:
            table["answer"], used["message"] = table["ours"], ""
        # the error of a value of zero is the answer
        table["error"] = (table["answer"] - value) / value.where(value != 0, 1.0)
        ends = expected["low"] - margin, expected["high"] + margin
        table["within"] = table["answer"].between(*ends)
        judged = table[table["tolerance"].notna()]
        faults = {
            name: used["message"][name] or _incomplete(rows, chosen.scenes[name].get("count"))
            for name, rows in ((str(name), rows) for name, rows in table.groupby("scene"))
        }
        off = {name: _off(rows) for name, rows in judged[~judged["within"]].groupby("scene")}
        heads = {"solver": solver, "scene": list(names)}
        heads |= {key: [chosen.scenes[name][key] for name in names] for key in ("level", "kind")}
        heads["message"] = [faults[name] or off.get(name, "") for name in names]
        verdict = pd.DataFrame(heads, index=list(names))
        verdict = verdict.join(used.drop(columns="message"))
        verdict = verdict.join(ours[["seconds", "cpu_s", STEPS]].add_prefix("ours_"))
        answered = pd.Series({name: not faults[name] for name in names})
        counts = judged["quantity"].isin(COUNTS)
        errors = judged["error"].where(judged["scene"].map(answered))[~counts]
        sizes, signed = (part.groupby(judged["scene"]) for part in (errors.abs(), errors))
        verdict["answered"], verdict["passed"] = answered, verdict["message"] == ""
        verdict["declined"] = verdict["message"].str.match(DECLINED) & bool(answered.any())
        verdict["failed"] = ~(verdict["passed"] | verdict["declined"])
        verdict["error"], verdict["worst"] = sizes.median(), sizes.max()
        verdict["bias"] = signed.median()
        for ratio, time in (("ratio", "seconds"), ("cpu_ratio", "cpu_s")):
            verdict[ratio] = (verdict[time] / verdict[f"ours_{time}"]).where(answered)
        numbers.append(table)
        verdicts.append(verdict)
    return pd.concat(numbers, ignore_index=True), pd.concat(verdicts, ignore_index=True)


def _incomplete(rows: pd.DataFrame, count: float | None) -> str:
    """The answer that a scene lacks, or counts that do not make `count`, N of the scene."""
    lacking = rows[rows["answer"].isna()].to_dict("records")
    if lacking:
        more = f" and {len(lacking) - 1} more" * (len(lacking) > 1)
        return f"{ANSWER} lacks {_question(lacking[0])}{more}"
    last: Any = rows.groupby("quantity")["answer"].last()
    moved, rest, total = last.get("moved"), last.get("not_moved"), last.get("count", count)
    if None not in (moved, rest, total) and moved + rest != total:
        return f"the counts do not make N: {moved:g} moved and {rest:g} not, of {total:g}"
    return ""


def _off(rows: pd.DataFrame) -> str:
    """The worst of the answers that are off; a count is named only if nothing else is off."""
    records = rows.to_dict("records")
    row = max(records, key=lambda row: abs(row["error"]) * (row["quantity"] not in COUNTS))
    message = f"{_question(row)} is {row['answer']:.6g}, not {row['value']:.6g}"
    if row["low"] < row["high"]:
        message += f" ({row['low']:.6g} ... {row['high']:.6g})"
    return message + f", and {len(rows) - 1} more are off" * (len(rows) > 1)


def _question(row: Mapping[Any, Any]) -> str:
    return f"{row['quantity']} at {row['at']}" if row["at"] else str(row["quantity"])


def failures(verdicts: pd.DataFrame) -> pd.DataFrame:
    """The failures of solvers, one for each cause: ``solver``, ``scenes``, ``kind``, ``why``."""
    failed = verdicts[verdicts["failed"]]
    # messages of one cause differ in their numbers
    cause = failed["message"].str.replace(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", regex=True)
    rows = []
    for (solver, kind, _), group in failed.groupby(["solver", "kind", cause], sort=False):
        more = f" and {len(group) - 1} more of kind {kind}" if len(group) > 1 else ""
        first = group.iloc[0]
        rows.append((solver, first["scene"] + more, kind, first["message"]))
    return pd.DataFrame(rows, columns=["solver", "scenes", "kind", "why"])


def summary(verdicts: pd.DataFrame) -> pd.DataFrame:
    """One row for each level and kind that was asked, and each solver; errors in per cent."""
    columns = {
        **{"scenes": ("scene", "size"), "passed": ("passed", "sum")},
        **{"failed": ("failed", "sum"), "declined": ("declined", "sum")},
        **{"error, %": ("error", "median"), "bias, %": ("bias", "median")},
        **{"largest, %": ("worst", "max"), "time over ours": ("ratio", "median")},
        **{"CPU over ours": ("cpu_ratio", "median"), "peak, MiB": ("peak_mib", "max")},
    }
    table = verdicts.groupby(["level", "kind", "solver"], sort=False).agg(**columns).reset_index()
    percent = [name for name in columns if name.endswith("%")]
    return table.assign(**(100 * table[percent]))


def in_words(verdicts: pd.DataFrame) -> list[str]:
    """A line for each solver: PASSED or FAILED, its name, and the numbers of its scenes."""
    lines = []
    for solver, of in verdicts.groupby("solver", sort=False):
        counts = [f"{of[kind].sum()} {kind}" for kind in ("passed", "failed", "declined")]
        word = "FAILED" if of["failed"].any() else "PASSED"
        lines.append(f"{word} {solver}: of {len(of)} scenes {', '.join(counts)}")
    return lines
