"""Run a solver on the scenes of a pack, read its answers, and judge them."""

import csv
import fnmatch
import os
import re
import shlex
import shutil
import signal
import stat
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import pack
from orchestrator.benchmark.export import Ours
from orchestrator.benchmark.pack import COUNTS, Pack
from orchestrator.errors import InputError, OrchestratorError, one_line, printable
from orchestrator.runs import process, workspace
from orchestrator.runs.files import Folder, read_json, text_of
from orchestrator.tables import text
from orchestrator.types import Row

ANSWER, LOG, USED, OURS = "answer.csv", "log.txt", "used.json", "ours"
"""Files of a scene in the results: the answer, the output, and the times. The answers of our
solvers lie in a directory beside those of the solver."""
PAGE, NUMBERS, VERDICTS, FIGURES = "comparison.html", "comparison.csv", "verdicts.csv", "figures"
COLUMNS = ["quantity", "at", "value"]
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
MIB = 2**20
ANSWER_BYTES, LOG_BYTES, FILE_BYTES = 4 * MIB, 64 * MIB, 4096 * MIB
"""Largest answer, largest output, and largest file of a solver, bytes."""
LARGEST = 1e30
"""Largest number of an answer, SI units."""
ROUND = 1e-8
"""Relative rounding of a pack's tables."""
LISTED = 10
"""Number of failures that the terminal lists."""
LEVELS = {
    1: "closed form",
    2: "contact and one grain",
    3: "flow",
    4: "grains of a pile",
    5: "flow and grains",
}
"""Names of the levels."""
OF_SCHEMA_1 = re.compile(r"[1-5]-[0-9a-f]{12}")
"""Names of the scenes of former packs."""
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


class AnswerError(OrchestratorError):
    """An answer that cannot be used."""


@dataclass(frozen=True)
class Choice:
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


@dataclass(frozen=True)
class Limits:
    """Limits of a solver for a scene: wall time, s, and memory of each process, bytes."""

    seconds: float = 600.0
    memory: int = 4 * 2**30


@dataclass(frozen=True)
class Contender:
    """A solver with its answers to some scenes of a pack.

    Attributes
    ----------
    name : str
        Name of the directory of its results.
    verdicts : DataFrame
        A row for each scene: ``passed``, ``message``, errors and times.
    numbers : DataFrame
        The expectations with ``answer``, ``error`` (relative) and ``within``; rows are the same for
        all solvers.
    """

    name: str
    verdicts: pd.DataFrame
    numbers: pd.DataFrame


@dataclass(frozen=True)
class Outcome:
    """A comparison: failures as lines, a summary as a table, and the page."""

    failures: list[str]
    summary: str
    page: Path


def run(root: Path, command: str, out: Path | None, choice: Choice, limits: Limits) -> Outcome:
    """Run a solver on scenes of a pack, ours in turn, judge the answers, and write the page.

    Parameters
    ----------
    root : Path
        The pack.
    command : str
        The solver's, with ``{case}`` and ``{out}``; it is split as by a shell, but no shell runs.
    out : Path or None
        Directory of the results; by default ``results/benchmark-NAME`` of the pack.
    choice : Choice
        The scenes.
    limits : Limits
        Limits of the solver.

    Raises
    ------
    InputError
        If the pack, the command or the directory cannot be used.
    """
    chosen = pack.read(root.absolute())
    names, words = choice.names(chosen), split(command)
    out = (out or _default_place(root)).absolute()
    _check_places([out], out, chosen)
    ours = Ours(chosen, out / OURS / "cases")
    for name in names:
        ours.check(name)
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        about = _about(out)
        if about.get("pack", chosen.digest) != chosen.digest:
            raise InputError(
                "the directory holds answers to another pack, or to an earlier export of this one",
                where=str(out),
                remedy="choose another with --out, or remove it",
            )
        folder.note(workspace.RESULTS.marker, text_of({**about, "pack": chosen.digest}))
        ours.root.mkdir(parents=True, exist_ok=True)
        for number, name in enumerate(names, 1):
            print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
            _put(folder, name, *solve(words, chosen.directory(name), limits))
            answer, took = ours.answer(name)
            _put(folder, f"{OURS}/{name}", pack.csv(answer).encode(), b"", took._asdict())
        chosen.verify()
        return _written(chosen, [judge(chosen, names, out)], folder)


def compare(root: Path, results: Sequence[Path], out: Path | None, choice: Choice) -> Outcome:
    """Judge answers that are there, and write one page of all solvers.

    Parameters
    ----------
    root : Path
        The pack.
    results : sequence of Path
        A directory for each solver, which is named by it: ``RESULTS/SCENE/answer.csv``.
    out : Path or None
        Directory of the page; by default the only results, if `run` wrote them, or
        ``results/benchmark-NAME`` of the pack.
    choice : Choice
        The scenes.

    Raises
    ------
    InputError
        If the pack or a directory cannot be used, or two have one name.
    """
    chosen = pack.read(root.absolute())
    names = choice.names(chosen)
    for place in results:
        if not place.is_dir():
            raise InputError("there is no such directory", where=str(place), remedy="name another")
        if any(OF_SCHEMA_1.fullmatch(path.name) for path in place.iterdir()):
            pack.refuse_schema("its answers are to a pack of schema 1", place)
    about = _about(results[0]) if len(results) == 1 else {}
    out = (out or (results[0] if about else _default_place(root))).absolute()
    _check_places(results, out, chosen)
    is_of_run = bool(about) and out == results[0].absolute()
    kind = workspace.RESULTS if is_of_run else workspace.COMPARISON
    contenders = [judge(chosen, names, place) for place in results]
    with workspace.claimed(out, kind, about["name"] if is_of_run else chosen.root.name) as folder:
        return _written(chosen, contenders, folder)


def _about(results: Path) -> Row:
    """The notes of `run` in its results; empty for other directories."""
    about = workspace.read_marker(results, workspace.RESULTS) or {}
    return about if about.get("kind") == workspace.RESULTS.word else {}


def _default_place(root: Path) -> Path:
    return Path("results") / f"benchmark-{root.absolute().name}"


def _check_places(results: Sequence[Path], out: Path, chosen: Pack) -> None:
    """See that each solver has a name of its own, and that nothing is written into the pack."""
    names = [OURS, *(place.absolute().name for place in results)]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        remedy = "name each directory of results after its solver"
        raise InputError(f"two solvers have the name {twice[0]}", "RESULTS", remedy)
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", str(out), "use --out")


def split(command: str) -> list[str]:
    """The words of a solver's command; files that it names are found from any directory.

    Raises
    ------
    InputError
        If it has no ``{case}`` or ``{out}``, is for a shell, or its program is not there.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(f"the command cannot be read: {error}", "--solver") from None
    lacking = [part for part in ("{case}", "{out}") if not any(part in word for word in words)]
    operators = [word for word in words if OPERATORS.fullmatch(word)]
    if lacking:
        what, remedy = f"the command has no {lacking[0]}", "such as 'my-solver {case} {out}'"
    elif operators:
        what, remedy = f"no shell reads the command: {operators[0]}", "write: sh -c '...'"
    elif shutil.which(words[0]) is None:
        what, remedy = f"there is no program {words[0]} that may be run", "give its path"
    else:
        return [str(Path(word).absolute()) if Path(word).is_file() else word for word in words]
    raise InputError(what, "--solver", remedy)


def solve(
    words: Sequence[str], scene: Path, limits: Limits
) -> tuple[bytes | None, bytes, dict[str, Any]]:
    """Run a solver on a copy of a scene, in a directory that is removed afterwards.

    Returns the bytes of its answer, None if there is none; its output; and its times (s), memory
    (MiB) and ``error``, the reason why the answer does not count.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        work, log = Path(folder, "work"), Path(folder, LOG)
        case, out = work / "case", work / ANSWER
        shutil.copytree(scene, case)
        command = [word.replace("{case}", str(case)).replace("{out}", str(out)) for word in words]
        measured = Path(folder, USED)
        ended = process.run(
            [sys.executable, "-ISc", MEASURE, str(measured), str(limits.memory), *command],
            cwd=work,
            log=log,
            limit_s=limits.seconds,
            env={"TMPDIR": str(work), "OLDPWD": None},
            output_limit=LOG_BYTES,
            file_limit=FILE_BYTES,
        )
        error, answer = _fault(ended, limits, log), None
        try:
            answer = content(out)
        except AnswerError as fault:
            error = error or str(fault)
        used = read_json(measured) or {"seconds": ended.seconds}
        with log.open("rb") as stream:
            return answer, stream.read(LOG_BYTES), {**used, "error": error}


def _fault(ended: process.Ended, limits: Limits, log: Path) -> str:
    """Why a run does not count; empty for one that does."""
    if ended.over == "time":
        return f"it did not end within {limits.seconds:g} s and was killed"
    if ended.over == "output" or log.stat().st_size > LOG_BYTES:
        return f"it printed more than {LOG_BYTES // MIB} MiB"
    if ended.over:
        return "no space is left on the disk"
    if ended.returncode == 0:
        return ""
    if ended.returncode == 128 + signal.SIGXFSZ:
        return f"it wrote a file of more than {FILE_BYTES // MIB} MiB"
    printed = process.last_words(log)
    return f"it ended with {ended.returncode}{printed and f': {printed}'}"


def _put(
    folder: Folder, name: str, answer: bytes | None, log: bytes, used: Mapping[str, Any]
) -> None:
    """Put the results of a scene in place of earlier ones."""
    if answer is None:
        folder.path(f"{name}/{ANSWER}").unlink(missing_ok=True)
    else:
        folder.note(f"{name}/{ANSWER}", answer)
    if log:
        folder.note(f"{name}/{LOG}", log)
    numbers = {key: value for key, value in used.items() if value == value}
    folder.note(f"{name}/{USED}", text_of(numbers))


def content(path: Path) -> bytes:
    """The bytes of an answer; raises AnswerError if there is no plain file, or it is too large."""
    try:
        state = path.lstat()
        if not stat.S_ISREG(state.st_mode):
            raise AnswerError(f"{ANSWER} is a link or no file")
        if state.st_size > ANSWER_BYTES:
            raise AnswerError(f"{ANSWER} has more than {ANSWER_BYTES // MIB} MiB")
        return path.read_bytes()
    except FileNotFoundError:
        raise AnswerError(f"it wrote no {ANSWER}") from None
    except OSError as error:
        raise AnswerError(f"{ANSWER} cannot be read: {error.strerror}") from None


def parsed(data: bytes) -> pd.DataFrame:
    """The answers of a file: columns ``quantity``, ``place`` (see `place_of`) and ``answer``.

    Raises
    ------
    AnswerError
        Naming the first line that is not whole.
    """
    try:
        text = data.decode("utf-8-sig")  # some programs begin a text with a mark of its encoding
        lines = [[word.strip() for word in row] for row in csv.reader(text.splitlines())]
    except (UnicodeDecodeError, csv.Error) as error:
        raise AnswerError(f"{ANSWER} is no table: {error}") from None
    if lines[:1] != [COLUMNS]:
        raise AnswerError(f"{ANSWER} does not begin with {','.join(COLUMNS)}")
    rows = []
    for number, row in enumerate(lines[1:], 2):
        if len(row) not in (0, len(COLUMNS)):
            raise AnswerError(f"{ANSWER}, line {number}: {len(row)} fields in place of 3")
        try:
            rows += [(row[0], place_of(row[1]), _number(row[2]))] if row else []
        except ValueError:
            what = f"{','.join(row)[:80]!r} holds no finite number below {LARGEST:g}"
            raise AnswerError(f"{ANSWER}, line {number}: {what}") from None
    if not text.endswith("\n"):
        raise AnswerError(f"{ANSWER} is cut short: its last line has no end")
    table = pd.DataFrame(rows, columns=["quantity", "place", "answer"])
    twice = table[table.duplicated(["quantity", "place"])]
    if len(twice):
        raise AnswerError(f"{ANSWER} answers {_question(twice.iloc[0])} twice")
    return table


def place_of(at: str) -> str:
    """The number ``at`` to seven digits; empty for a quantity that is one number."""
    return f"{float(at):.7g}" if at.strip() else ""


def _number(text: str) -> float:
    # Python also reads underscores and digits of other alphabets, which other programs never write
    if "_" in text or not text.isascii() or not abs(float(text)) < LARGEST:
        raise ValueError(text)
    return float(text)


def _question(row: Any) -> str:
    return f"{row['quantity']} at {row['place']}" if row["place"] else str(row["quantity"])


def judge(chosen: Pack, names: Sequence[str], results: Path) -> Contender:
    """Compare the answers of a solver with the expected ones.

    Parameters
    ----------
    chosen : Pack
        The pack.
    names : sequence of str
        The scenes.
    results : Path
        Holds ``SCENE/answer.csv`` of the solver, and ``ours/SCENE/answer.csv`` if ours ran.
    """
    answers, ours, scenes = [], [], []
    for name in names:
        used, used_by_ours = (
            value if isinstance(value := read_json(folder / name / USED), dict) else {}
            for folder in (results, results / OURS)
        )
        error = str(used.get("error") or "")
        answer = again = pd.DataFrame(columns=["quantity", "place", "answer"])
        if not error:
            try:
                answer = parsed(content(results / name / ANSWER))
            except AnswerError as fault:
                error = str(fault)
        path = results / OURS / name / ANSWER
        if os.path.lexists(path):
            try:
                again = parsed(content(path))
            except AnswerError as fault:
                raise InputError(fault.what, where=str(path), remedy="remove it") from None
        answers.append(answer.assign(scene=name))
        ours.append(again.assign(scene=name))
        given = chosen.scenes[name]
        scenes.append(
            {
                "scene": name,
                "level": given["level"],
                "kind": given["kind"],
                "message": one_line(error),  # it repeats the output of a program
                **{key: _known(used.get(key)) for key in ("seconds", "cpu_s", "peak_mib")},
                **{f"ours_{key}": _known(used_by_ours.get(key)) for key in ("seconds", "cpu_s")},
                STEPS: _known(answer["answer"][answer["quantity"] == STEPS].max()),
                f"ours_{STEPS}": _known(again["answer"][again["quantity"] == STEPS].max()),
            }
        )
    keys = ["scene", "quantity", "place"]
    numbers = chosen.expected[chosen.expected["scene"].isin(names)]
    numbers = numbers.assign(place=numbers["at"].map(place_of))
    numbers = numbers.merge(pd.concat(answers), on=keys, how="left")
    numbers = numbers.merge(
        pd.concat(ours).rename(columns={"answer": "again"}), on=keys, how="left"
    )
    numbers["ours"] = numbers.pop("again").astype(float).fillna(numbers["ours"])
    numbers["answer"] = numbers["answer"].astype(float)
    numbers["error"] = relative(numbers["answer"], numbers["value"])
    numbers["within"] = within(numbers, numbers["answer"], numbers["tolerance"])
    table = pd.DataFrame(scenes).set_index("scene")

    def or_else(faults: dict[str, str]) -> "pd.Series[str]":
        more = pd.Series(faults, dtype=object).reindex(table.index, fill_value="")
        return table["message"].where(table["message"] != "", more)

    table["message"] = or_else({**_miscounted(numbers, chosen), **_missing(numbers)})
    table["answered"] = table["message"] == ""
    table["message"] = or_else(_wrong(numbers))
    table["passed"] = table["message"] == ""
    judged = numbers[numbers["tolerance"].notna() & ~numbers["quantity"].isin(COUNTS)]
    signed = judged[judged["scene"].map(table["answered"])].set_index("scene")["error"]
    table["error"] = signed.abs().groupby("scene").median()
    table["worst"] = signed.abs().groupby("scene").max()
    table["bias"] = signed.groupby("scene").median()
    for ratio, time in (("ratio", "seconds"), ("cpu_ratio", "cpu_s")):
        table[ratio] = (table[time] / table[f"ours_{time}"]).where(table["answered"])
    name = printable(results.absolute().name)
    return Contender(name, table.reset_index(), numbers.drop(columns="place"))


def _known(value: Any) -> float:
    """A time or a memory, NaN where it is none: anybody may have written it."""
    return float(value) if isinstance(value, int | float) and 0 < value < 1e300 else np.nan


def relative(answer: Any, value: Any) -> Any:
    """The error of answers over the values; a value of zero has none, and leaves it as it is."""
    return (answer - value) / np.where(value == 0, 1.0, value)


def within(numbers: pd.DataFrame, answer: Any, tolerance: Any) -> Any:
    """Whether answers are in their intervals, widened by a tolerance; missing ones are not."""
    margin = (tolerance + ROUND) * numbers["value"].abs()
    return (answer >= numbers["low"] - margin) & (answer <= numbers["high"] + margin)


def _missing(numbers: pd.DataFrame) -> dict[str, str]:
    """The scenes that lack a number that was asked, and which."""
    lacking = numbers[numbers["answer"].isna()].groupby("scene")
    return {
        str(name): f"{ANSWER} lacks {_question(rows.iloc[0])}"
        + (f" and {len(rows) - 1} more" if len(rows) > 1 else "")
        for name, rows in lacking
    }


def _miscounted(numbers: pd.DataFrame, chosen: Pack) -> dict[str, str]:
    """The scenes whose counts are none, or do not make N."""
    counts = numbers[numbers["quantity"].isin((*COUNTS, "count"))]
    broken = counts[(counts["answer"] < 0) | (counts["answer"] % 1 != 0)]
    faults = {
        row["scene"]: f"{_question(row)} is {row['answer']:g}: it counts grains"
        for row in broken[::-1].to_dict("records")
    }
    moved = counts[counts["quantity"] == "moved"]
    rest = counts[counts["quantity"] == "not_moved"]
    both = moved.merge(rest, on=["scene", "place"], suffixes=("", "_not"))
    total = counts[counts["quantity"] == "count"].set_index("scene")["answer"]
    for row in both.to_dict("records"):
        count = total.get(row["scene"], chosen.scenes[row["scene"]].get("count"))
        n, rest_of_n = row["answer"], row["answer_not"]
        if count is not None and n + rest_of_n != count:
            sums = f"{n:g} moved and {rest_of_n:g} not, at load step {row['place']}, of {count:g}"
            faults.setdefault(row["scene"], f"the counts do not make N: {sums}")
    return faults


def _wrong(numbers: pd.DataFrame) -> dict[str, str]:
    """The scenes with a judged number that is off: the one that is furthest off, and how many."""
    off = numbers[numbers["tolerance"].notna() & ~numbers["within"]]
    # a count is named only if nothing else is off
    off = off.assign(size=off["error"].abs().where(~off["quantity"].isin(COUNTS), 0.0))
    messages = {}
    for name, rows in off.groupby("scene"):
        row = rows.iloc[int(rows["size"].to_numpy().argmax())]
        what = f"{_question(row)} is {row['answer']:.6g}, not {row['value']:.6g}"
        if row["low"] < row["high"]:
            what += f" ({row['low']:.6g} ... {row['high']:.6g})"
        more = f", and {len(rows) - 1} more are off" if len(rows) > 1 else ""
        messages[str(name)] = what + more
    return messages


def ours(contenders: Sequence[Contender]) -> Contender:
    """Our solvers as one more of them: our answers, and the mean of our processor times."""
    first, numbers = contenders[0].verdicts, contenders[0].numbers
    numbers = numbers.assign(answer=numbers["ours"])
    numbers["error"] = relative(numbers["answer"], numbers["value"])
    judged = numbers[numbers["tolerance"].notna() & ~numbers["quantity"].isin(COUNTS)]
    worst = judged["error"].abs().groupby(judged["scene"]).max()
    cpu_s = pd.concat([one.verdicts for one in contenders]).groupby("scene")["ours_cpu_s"].mean()
    verdicts = first.assign(
        answered=True,
        worst=first["scene"].map(worst),
        cpu_s=first["scene"].map(cpu_s),
        cpu_ratio=np.nan,
        steps=first["ours_steps"],
    )
    return Contender(OURS, verdicts, numbers)


def failures(of: Contender) -> pd.DataFrame:
    """The failures of a solver, one for each cause: ``scenes``, ``kind`` and ``why``."""
    failed = of.verdicts[~of.verdicts["passed"]]
    # messages of one cause differ in their numbers
    cause = failed["message"].str.replace(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", regex=True)
    rows = []
    for (kind, _), group in failed.groupby(["kind", cause], sort=False):
        more = f" and {len(group) - 1} more of kind {kind}" if len(group) > 1 else ""
        first = group.iloc[0]
        rows.append({"scenes": first["scene"] + more, "kind": kind, "why": first["message"]})
    return pd.DataFrame(rows, columns=["scenes", "kind", "why"])


def summary(contenders: Sequence[Contender]) -> pd.DataFrame:
    """One row for each level and kind that was asked, and each solver."""
    rows = []
    table = pd.concat([one.verdicts.assign(solver=one.name) for one in contenders])
    for (level, kind, solver), of in table.groupby(["level", "kind", "solver"], sort=False):
        rows.append(
            {
                "level": f"{level} {LEVELS[int(str(level))]}",
                "kind": kind,
                "solver": solver,
                "scenes": len(of),
                "passed": of["passed"].sum(),
                "error, median": _text(100 * of["error"].median(), " %"),
                "bias": _text(100 * of["bias"].median(), " %"),
                "error, largest": _text(100 * of["worst"].max(), " %"),
                "time over ours": _text(of["ratio"].median()),
                "CPU over ours": _text(of["cpu_ratio"].median()),
                "peak, MiB": _text(of["peak_mib"].max()),
            }
        )
    return pd.DataFrame(rows)


def _text(value: float, unit: str = "") -> str:
    return f"{value:.3g}{unit}" if value == value else ""


def _written(chosen: Pack, contenders: Sequence[Contender], folder: Folder) -> Outcome:
    """Put tables, figures and page of a comparison into a directory."""
    numbers = pd.concat([one.numbers.assign(solver=one.name) for one in contenders])
    verdicts = pd.concat([one.verdicts.assign(solver=one.name) for one in contenders])
    with folder.renewed(NUMBERS, VERDICTS, PAGE, FIGURES):
        for name, table, digits in ((NUMBERS, numbers, "%.9g"), (VERDICTS, verdicts, "%.6g")):
            columns = ["solver", *table.columns.drop("solver")]
            folder.put(name, text.csv(table[columns], digits))
        # the drawing libraries take half a second to import
        from orchestrator.benchmark import page

        page.write(chosen, contenders, folder)
    lines = [
        f"{f'{one.name}: ' if len(contenders) > 1 else ''}{row['scenes']}: {row['why']}"
        for one in contenders
        for row in failures(one).to_dict("records")
    ]
    if len(lines) > LISTED:
        lines[LISTED:] = [f"and {len(lines) - LISTED} more: see {VERDICTS}"]
    return Outcome(lines, summary(contenders).to_string(index=False), folder.root / PAGE)
