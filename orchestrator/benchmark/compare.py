"""Run a solver on the scenes of a pack, read its answers, and judge them."""

import contextlib
import fnmatch
import re
import shlex
import shutil
import signal
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.benchmark import pack
from orchestrator.benchmark.export import Ours
from orchestrator.benchmark.pack import COUNTS, LARGEST, Pack
from orchestrator.errors import InputError, one_line, printable
from orchestrator.runs import process, workspace
from orchestrator.runs.files import Folder, opened, read_json, text_of
from orchestrator.tables import csv as text_of_table
from orchestrator.types import Row

ANSWER, LOG, USED, OURS = "answer.csv", "log.txt", "used.json", "ours"
"""Files of a scene in the results: the answer, the output, and the times. The answers of our
solvers lie in a directory beside those of the solver; they are those of the solver `OURS`."""
PAGE, NUMBERS, VERDICTS = "comparison.html", "comparison.csv", "verdicts.csv"
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
MIB = 2**20
ANSWER_BYTES, LOG_BYTES, FILE_BYTES = 4 * MIB, 64 * MIB, 4096 * MIB
"""Largest answer, largest output, and largest file of a solver, bytes."""
ROUND = 1e-8
"""Relative rounding of a pack's tables."""
LISTED = 10
"""Number of failures that the terminal lists."""
NAMES = ("closed form", "contact and one grain", "flow", "grains of a pile", "flow and grains")
"""Names of the levels, 1 to 5."""
OPERATORS = re.compile(r"[|&;<>]+|\d*>\S*|\S*;")
"""Words that are operators of a shell."""
MEASURE = """
import json, os, resource, signal, sys, time
report, memory, *command = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_DATA, (int(memory), int(memory)))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
for number in (signal.SIGPIPE, signal.SIGXFSZ):
    signal.signal(number, signal.SIG_DFL)
began = time.monotonic()
code = os.spawnvp(os.P_WAIT, command[0], command)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
numbers = {"seconds": time.monotonic() - began, "cpu_s": used.ru_utime + used.ru_stime}
with open(report, "w") as stream:
    json.dump({**numbers, "peak_mib": used.ru_maxrss / 1024}, stream)
sys.exit(code if code >= 0 else 128 - code)
"""
"""Program that runs the solver: the memory of a process that this one starts would count as the
solver's."""


class Choice(NamedTuple):
    """Scenes of a pack by level and by patterns of names; empty for all."""

    levels: Sequence[int] = ()
    patterns: Sequence[str] = ()

    def names(self, chosen: Pack) -> list[str]:
        """Names of the chosen scenes; raises InputError if there are none."""
        names = [
            name
            for name, given in chosen.scenes.items()
            if (not self.levels or given["level"] in self.levels)
            and (not self.patterns or any(fnmatch.fnmatchcase(name, p) for p in self.patterns))
        ]
        if not names:
            remedy = "see its scenes.csv, and --level and --scene"
            raise InputError("no scene of the pack is chosen", str(chosen.root), remedy)
        return names


class Limits(NamedTuple):
    """Limits of a solver for a scene: wall time, s, and memory of each process, bytes."""

    seconds: float = 600.0
    memory: int = 4 * 2**30


class Outcome(NamedTuple):
    """A comparison: failures as lines, a summary as a table, and the page."""

    failures: list[str]
    summary: str
    page: Path


def run(root: Path, command: str, out: Path | None, choice: Choice, limits: Limits) -> Outcome:
    """Run a solver on scenes of a pack, ours in turn, judge the answers, and write the page.

    No shell runs the `command`, which has ``{case}`` and ``{out}``. `out` is the directory of the
    results, by default ``results/benchmark-NAME`` of the pack. Raises InputError if the pack, the
    command or the directory cannot be used.
    """
    chosen, words = pack.read(root.absolute()), split(command)
    names, digest = choice.names(chosen), chosen.manifest.sha256[pack.EXPECTED]
    out = _place(out, chosen)
    ours = Ours(chosen, names, out / OURS / "cases")
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        about = workspace.read_marker(out, workspace.RESULTS) or {}
        if about.get("pack", digest) != digest:
            what = "it holds answers to another pack, or to an earlier export of this one"
            raise InputError(what, where=str(out), remedy="choose another with --out, or remove it")
        folder.note(workspace.RESULTS.marker, text_of({**about, "pack": digest}))
        # runs of an earlier time were not in turn with the solver
        shutil.rmtree(folder.path(f"{OURS}/cases"), ignore_errors=True)
        ours.root.mkdir(parents=True)
        for number, name in enumerate(names, 1):
            print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
            _solve(words, chosen.root / pack.SCENES / name, limits, folder, name)
            answer, took = ours.answer(name)
            folder.note(f"{OURS}/{name}/{ANSWER}", pack.csv(answer))
            times = {key: value for key, value in took._asdict().items() if value == value}
            folder.note(f"{OURS}/{name}/{USED}", text_of(times))
        pack.verify(chosen.root, chosen.manifest)
        return _written(chosen, *judge(chosen, names, [out]), folder)


def compare(root: Path, results: Sequence[Path], out: Path | None, choice: Choice) -> Outcome:
    """Judge answers that are there, and write one page of all solvers.

    Each of the `results` is the directory of a solver, which is named by it. `out` is that of the
    page, by default the only results, if `run` wrote them, or ``results/benchmark-NAME`` of the
    pack. Raises InputError if the pack or a directory cannot be used, or two have one name.
    """
    chosen = pack.read(root.absolute())
    names, solvers = choice.names(chosen), [OURS, *(place.absolute().name for place in results)]
    for place, solver in zip(results, solvers[1:], strict=True):
        if not place.is_dir():
            raise InputError("there is no such directory", where=str(place), remedy="name another")
        if solvers.count(solver) > 1:
            remedy = "name each directory of results after its solver"
            raise InputError(f"two solvers have the name {solver}", "RESULTS", remedy)
    about = workspace.read_marker(results[0], workspace.RESULTS) or {}
    is_of_run = len(results) == 1 and about.get("kind") == workspace.RESULTS.word
    out = _place(out or (results[0] if is_of_run else None), chosen)
    is_same = is_of_run and out == results[0].absolute()
    kind = workspace.RESULTS if is_same else workspace.COMPARISON
    judged = judge(chosen, names, results)
    with workspace.claimed(out, kind, about["name"] if is_same else chosen.root.name) as folder:
        return _written(chosen, *judged, folder)


def _place(out: Path | None, chosen: Pack) -> Path:
    """The directory of the results, which is not in the pack."""
    out = out or Path("results") / f"benchmark-{chosen.root.name}"
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", str(out), "use --out")
    if out.name == OURS:
        raise InputError("two solvers have the name ours", str(out), "use --out")
    return out.absolute()


def split(command: str) -> list[str]:
    """The words of a solver's command; files that it names are found from any directory.

    Raises InputError if it has no ``{case}`` or ``{out}``, is for a shell, or has no program.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(f"the command cannot be read: {error}", "--solver") from None
    for part in ("{case}", "{out}"):
        if not any(part in word for word in words):
            remedy = "such as 'my-solver {case} {out}'"
            raise InputError(f"the command has no {part}", "--solver", remedy)
    for word in filter(OPERATORS.fullmatch, words):
        raise InputError(f"no shell reads the command: {word}", "--solver", "write: sh -c '...'")
    if shutil.which(words[0]) is None:
        what = f"there is no program {words[0]} that may be run"
        raise InputError(what, "--solver", "give its path")
    return [str(Path(word).absolute()) if Path(word).is_file() else word for word in words]


def _solve(words: Sequence[str], scene: Path, limits: Limits, folder: Folder, name: str) -> None:
    """Run a solver on a copy of a scene, in a directory that is removed afterwards.

    Its answer, its output, its times (s) and memory (MiB) are put into a directory of the results;
    with the times is ``error``, the reason why the answer does not count.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as private:
        work, log, report = Path(private, "work"), Path(private, LOG), Path(private, USED)
        case, out = work / "case", work / ANSWER
        shutil.copytree(scene, case)
        command = [word.replace("{case}", str(case)).replace("{out}", str(out)) for word in words]
        ended = process.run(
            [sys.executable, "-ISc", MEASURE, str(report), str(limits.memory), *command],
            cwd=work,
            log=log,
            limit_s=limits.seconds,
            env={"TMPDIR": str(work), "OLDPWD": None},
            output_limit=LOG_BYTES,
            file_limit=FILE_BYTES,
        )
        folder.path(f"{name}/{ANSWER}").unlink(missing_ok=True)
        with contextlib.suppress(OSError), opened(out) as stream:
            folder.note(f"{name}/{ANSWER}", stream.read(ANSWER_BYTES + 1))
        used = read_json(report) or {"seconds": ended.seconds}
        folder.note(f"{name}/{USED}", text_of({**used, "error": _fault(ended, limits, log)}))
        with log.open("rb") as stream:
            folder.note(f"{name}/{LOG}", stream.read(LOG_BYTES))


def _fault(ended: process.Ended, limits: Limits, log: Path) -> str:
    """Why a run does not count; empty for one that does."""
    if ended.over == "time":
        return f"it did not end within {limits.seconds:g} s and was killed"
    if ended.over == "output" or log.stat().st_size > LOG_BYTES:
        return f"it printed more than {LOG_BYTES // MIB} MiB"
    if ended.over:
        return "no space is left on the disk"
    if ended.returncode == 128 + signal.SIGXFSZ:
        return f"it wrote a file of more than {FILE_BYTES // MIB} MiB"
    printed = process.last_words(log)
    return f"it ended with {ended.returncode}{printed and f': {printed}'}" * bool(ended.returncode)


def _answers(path: Path) -> dict[tuple[str, str], float]:
    """The answers of a file, by quantity and `place_of`; raises ValueError for its first fault."""
    try:
        with opened(path) as stream:
            content = stream.read(ANSWER_BYTES + 1)
        if len(content) > ANSWER_BYTES:
            raise ValueError(f"has more than {ANSWER_BYTES // MIB} MiB")
        # some programs begin a text with a mark of its encoding
        rows = [line.split(",") for line in content.decode("utf-8-sig").split("\n")]
    except FileNotFoundError:
        raise ValueError(f"it wrote no {ANSWER}") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{ANSWER} cannot be read: {error}") from None
    rows = [[word.strip() for word in row] for row in rows]
    if rows[0] != ["quantity", "at", "value"]:
        raise ValueError(f"{ANSWER} does not begin with quantity,at,value")
    if rows[-1] != [""]:
        raise ValueError(f"{ANSWER} is cut short: its last line has no end")
    answers: dict[tuple[str, str], float] = {}
    for number, row in enumerate(rows[1:], 2):
        if row == [""]:
            continue
        try:
            quantity, at, value = row
            key, answer = (quantity, place_of(at)), float(value)
        except ValueError:
            answer = np.nan
        if not abs(answer) < LARGEST:
            what = f"{','.join(row)[:80]!r} is not a quantity, its at and a finite number"
            raise ValueError(f"{ANSWER}, line {number}: {what}")
        if key in answers:
            raise ValueError(f"{ANSWER} answers {row[0]} twice")
        answers[key] = answer
    return answers


def place_of(at: str) -> str:
    """The number ``at`` to seven digits; empty for a quantity that is one number."""
    return f"{float(at):.7g}" if at.strip() else ""


def _read(folder: Path) -> Row:
    """What a solver left of a scene: ``answers``, ``message`` with a fault, times and memory."""
    used = read_json(folder / USED) or {}
    error, answers = str(used.get("error") or ""), {}
    try:
        answers = {} if error else _answers(folder / ANSWER)
    except ValueError as fault:
        error = str(fault)
    times = {key: used.get(key) for key in ("seconds", "cpu_s", "peak_mib")}
    times[STEPS] = answers.get((STEPS, ""))
    for key, value in times.items():  # anybody may have written them
        is_known = isinstance(value, int | float) and 0 < value < LARGEST
        times[key] = value if is_known else np.nan
    # the message repeats the output of a program
    return {"answers": answers, "message": one_line(error), **times}


def judge(
    chosen: Pack, names: Sequence[str], results: Sequence[Path]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the answers of solvers with the expected ones.

    For each solver `results` has the directory with its ``SCENE/answer.csv``, and with
    ``ours/SCENE/answer.csv`` if ours ran in turn with it.

    Returns
    -------
    numbers : DataFrame
        A row for each solver, `OURS` the last, and each expectation: ``solver``, the columns of the
        expected answers, ``answer``, ``error`` (relative) and ``within``.
    verdicts : DataFrame
        A row for each solver and scene: ``passed``, ``message``, errors and times.
    """
    of_scenes: Any = chosen.expected.groupby("scene")
    expected = {name: rows.to_dict("records") for name, rows in of_scenes}
    numbers, verdicts = [], []
    for place in (*results, results[0] / OURS):
        solver = printable(place.absolute().name)
        for name in names:
            read = _read(place / name)
            ours = read if solver == OURS else _read(place / OURS / name)
            rows = []
            for row in expected[name]:
                key, value = (row["quantity"], place_of(row["at"])), row["value"]
                again = ours["answers"].get(key, row["ours"])
                answer = again if solver == OURS else read["answers"].get(key, np.nan)
                row = {"solver": solver, **row, "ours": again, "answer": answer}
                # the error of a value of zero is the answer
                row["error"] = (answer - value) / (value or 1.0)
                rows.append(row | {"within": within(row, row["tolerance"])})
            numbers += rows
            verdicts.append(_verdict(solver, chosen.scenes[name], rows, read, ours))
    table = pd.DataFrame(verdicts)
    is_ours = table["solver"] == OURS
    mean = table[~is_ours].groupby("scene")["ours_cpu_s"].mean()
    table["cpu_s"] = table["cpu_s"].where(~is_ours, table["scene"].map(mean))
    table.loc[is_ours, ["ratio", "cpu_ratio"]] = np.nan
    return pd.DataFrame(numbers), table


def within(row: Mapping[Any, Any], tolerance: float) -> bool:
    """Whether an answer is in its interval, widened by a tolerance; a missing one is not."""
    margin = (tolerance + ROUND) * abs(row["value"])
    return bool(row["low"] - margin <= row["answer"] <= row["high"] + margin)


def _verdict(solver: str, given: Row, rows: Sequence[Row], read: Row, ours: Row) -> Row:
    """The verdict on the answers of a solver to a scene; what it and ours used."""
    message = "" if solver == OURS else read["message"]
    message = message or _not_whole(rows, given.get("count"))
    answered = not message
    judged = [row for row in rows if row["tolerance"] == row["tolerance"]]
    if off := [row for row in judged if answered and not row["within"]]:
        # a count is named only if nothing else is off
        row = max(off, key=lambda row: abs(row["error"]) * (row["quantity"] not in COUNTS))
        message = f"{_question(row)} is {row['answer']:.6g}, not {row['value']:.6g}"
        if row["low"] < row["high"]:
            message += f" ({row['low']:.6g} ... {row['high']:.6g})"
        message += f", and {len(off) - 1} more are off" * (len(off) > 1)
    errors = np.array([row["error"] for row in judged if row["quantity"] not in COUNTS])
    if not answered or not errors.size:
        errors = np.array([np.nan])
    return {
        **{"solver": solver, "scene": rows[0]["scene"]},
        **{"level": given["level"], "kind": given["kind"], "message": message},
        **{key: read[key] for key in ("seconds", "cpu_s", "peak_mib", STEPS)},
        **{f"ours_{key}": ours[key] for key in ("seconds", "cpu_s", STEPS)},
        **{"answered": answered, "passed": not message},
        "error": np.median(np.abs(errors)),
        "worst": np.abs(errors).max(),
        "bias": np.median(errors),
        "ratio": read["seconds"] / ours["seconds"] if answered else np.nan,
        "cpu_ratio": read["cpu_s"] / ours["cpu_s"] if answered else np.nan,
    }


def _not_whole(rows: Sequence[Row], count: float | None) -> str:
    """What lacks in the answers to a scene, or which count is none; `count` is N of the scene."""
    if lacking := [row for row in rows if row["answer"] != row["answer"]]:
        more = f" and {len(lacking) - 1} more" * (len(lacking) > 1)
        return f"{ANSWER} lacks {_question(lacking[0])}{more}"
    answers = {(row["quantity"], row["at"]): row["answer"] for row in rows}
    total = answers.get(("count", ""), count)
    for row in rows:
        quantity, answer = row["quantity"], row["answer"]
        if quantity in (*COUNTS, "count") and (answer < 0 or answer % 1):
            return f"{_question(row)} is {answer:g}: it counts grains"
        moved = answers.get(("moved", row["at"]))
        if quantity == "not_moved" and None not in (moved, total) and moved + answer != total:
            return f"the counts do not make N: {moved:g} moved and {answer:g} not, of {total:g}"
    return ""


def _question(row: Row) -> str:
    return f"{row['quantity']} at {row['at']}" if row["at"] else str(row["quantity"])


def failures(verdicts: pd.DataFrame) -> pd.DataFrame:
    """The failures of solvers, one for each cause: ``solver``, ``scenes``, ``kind``, ``why``."""
    failed = verdicts[~verdicts["passed"]]
    # messages of one cause differ in their numbers
    cause = failed["message"].str.replace(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", regex=True)
    rows = []
    for (solver, kind, _), group in failed.groupby(["solver", "kind", cause], sort=False):
        more = f" and {len(group) - 1} more of kind {kind}" if len(group) > 1 else ""
        first = group.iloc[0]
        rows.append((solver, first["scene"] + more, kind, first["message"]))
    return pd.DataFrame(rows, columns=["solver", "scenes", "kind", "why"])


def summary(verdicts: pd.DataFrame) -> pd.DataFrame:
    """One row for each level and kind that was asked, and each solver."""
    rows = []
    for (level, kind, solver), of in verdicts.groupby(["level", "kind", "solver"], sort=False):
        numbers = {
            "error, median": (100 * of["error"].median(), " %"),
            "bias": (100 * of["bias"].median(), " %"),
            "error, largest": (100 * of["worst"].max(), " %"),
            "time over ours": (of["ratio"].median(), ""),
            "CPU over ours": (of["cpu_ratio"].median(), ""),
            "peak, MiB": (of["peak_mib"].max(), ""),
        }
        head = {"level": f"{level} {NAMES[int(str(level)) - 1]}", "kind": kind, "solver": solver}
        texts = {name: f"{x:.3g}{unit}" if x == x else "" for name, (x, unit) in numbers.items()}
        rows.append({**head, "scenes": len(of), "passed": of["passed"].sum(), **texts})
    return pd.DataFrame(rows)


def _written(
    chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame, folder: Folder
) -> Outcome:
    """Put tables, figures and page of a comparison into a directory."""
    theirs = verdicts[verdicts["solver"] != OURS]
    tables = {NUMBERS: (numbers[numbers["solver"] != OURS], "%.9g"), VERDICTS: (theirs, "%.6g")}
    with folder.renewed():
        for name, (table, digits) in tables.items():
            columns = ["solver", *table.columns.drop("solver")]
            folder.put(name, text_of_table(table[columns], digits))
        # the drawing libraries take half a second to import
        from orchestrator.benchmark import page

        page.write(chosen, numbers, verdicts, folder)
    failed, is_alone = failures(theirs), theirs["solver"].nunique() == 1
    lines = [
        f"{'' if is_alone else f'{row.solver}: '}{row.scenes}: {row.why}"
        for row in failed.itertuples()
    ]
    if len(lines) > LISTED:
        lines[LISTED:] = [f"and {len(lines) - LISTED} more: see {VERDICTS}"]
    return Outcome(lines, summary(theirs).to_string(index=False), folder.root / PAGE)
