"""Run a solver on the scenes of a pack, read its answers, and judge them."""

import contextlib
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.benchmark import pack
from orchestrator.benchmark.export import Ours
from orchestrator.benchmark.pack import COUNTS, Pack
from orchestrator.errors import InputError, one_line, printable
from orchestrator.runs import process, workspace
from orchestrator.runs.files import Folder, opened, read_json, text_of
from orchestrator.tables import csv as text_of_table

ANSWER, LOG, USED, OURS = "answer.csv", "log.txt", "used.json", "ours"
"""Files of a scene in the results: the answer, the output, and the times. The answers of our
solvers lie in a directory beside those of the solver; they are those of the solver `OURS`."""
PAGE, NUMBERS, VERDICTS = "comparison.html", "comparison.csv", "verdicts.csv"
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
TIMES = ["seconds", "cpu_s", "peak_mib"]
MIB = 2**20
ANSWER_BYTES, LOG_BYTES, FILE_BYTES = 4 * MIB, 64 * MIB, 4096 * MIB
"""Largest answer, largest output, and largest file of a solver, bytes."""
ROUND = 1e-8  # relative rounding of a pack's tables
LISTED = 10  # failures on the terminal
DECLINED = "it ended with 2(:|$)"  # message of a solver that does not know a kind of scene
OPERATORS = re.compile(r"[|&;<>]+|\d*>\S*|\S*;")  # of a shell
MEASURE = """
import json, resource, subprocess, sys, time
report, memory, *command = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_DATA, (int(memory), int(memory)))
began = time.monotonic()
code = subprocess.run(command).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
numbers = {"seconds": time.monotonic() - began, "cpu_s": used.ru_utime + used.ru_stime}
with open(report, "w") as stream:
    json.dump({**numbers, "peak_mib": used.ru_maxrss / 1024}, stream)
sys.exit(code if code >= 0 else 128 - code)
"""
"""Program that runs the solver: the memory of a process that this one starts would count as the
solver's."""


class Options(NamedTuple):
    """Scenes by level and by patterns of names, all if empty; a solver's limits (s, GiB), name."""

    levels: Sequence[int] = ()
    patterns: Sequence[str] = ()
    seconds: float = 600.0
    memory: float = 4.0
    name: str = ""


class Outcome(NamedTuple):
    """A comparison: failures as lines, a summary as a table, and the page."""

    failures: list[str]
    summary: str
    page: Path


def run(root: Path, command: str, out: Path | None, options: Options) -> Outcome:
    """Run a solver on scenes of a pack, ours in turn, judge the answers, and write the page.

    No shell runs the `command`, which has ``{case}`` and ``{out}``. `out` is the directory of the
    results, by default ``results/benchmark-NAME`` of the pack. Raises InputError if the pack, the
    command or the directory cannot be used.
    """
    chosen, words = pack.read(root.absolute()), split(command)
    scripts = [word for word in words[1:] if Path(word).is_file()]
    if (solver := options.name or Path([*scripts, words[0]][0]).stem) == OURS:
        raise InputError("two solvers have the name ours", "--name", "choose another")
    names = chosen.chosen(options.levels, options.patterns)
    digest, out = chosen.manifest.sha256[pack.EXPECTED], _place(out, chosen)
    ours = Ours(chosen, names, out / OURS / "cases")
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        about = workspace.read_marker(out, workspace.RESULTS)
        if about.get("pack", digest) != digest:
            what = "it holds answers to another pack, or to an earlier export of this one"
            raise InputError(what, where=str(out), remedy="choose another with --out, or remove it")
        folder.note(workspace.RESULTS.marker, text_of({**about, "pack": digest, "solver": solver}))
        # runs of an earlier time were not in turn with the solver
        shutil.rmtree(folder.path(f"{OURS}/cases"), ignore_errors=True)
        ours.root.mkdir(parents=True)
        for number, name in enumerate(names, 1):
            print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
            _solve(words, chosen.root / pack.SCENES / name, options, folder, name)
            answer, times = ours.answer(name)
            folder.note(f"{OURS}/{name}/{ANSWER}", pack.csv(answer))
            folder.note(f"{OURS}/{name}/{USED}", text_of(times))
        pack.verify(chosen.root, chosen.manifest)
        return _written(chosen, *judge(chosen, names, [out]), folder)


def compare(root: Path, results: Sequence[Path], out: Path | None, options: Options) -> Outcome:
    """Judge answers that are there, and write one page of all solvers.

    Each of the `results` is the directory of a solver, named by `run` or else by it. `out` is that
    of the page, by default the only results, if `run` wrote them, or ``results/benchmark-NAME`` of
    the pack. Raises InputError if the pack or a directory cannot be used, or two have one name.
    """
    chosen = pack.read(root.absolute())
    names = chosen.chosen(options.levels, options.patterns)
    solvers = [OURS, *map(name_of, results)]
    for place, solver in zip(results, solvers[1:], strict=True):
        if not place.is_dir():
            raise InputError("there is no such directory", where=str(place), remedy="name another")
        if solvers.count(solver) > 1:
            remedy = "run one with another --name, or rename its directory"
            raise InputError(f"two solvers have the name {solver}", "RESULTS", remedy)
    about = workspace.read_marker(results[0], workspace.RESULTS)
    is_of_run = len(results) == 1 and about.get("kind") == workspace.RESULTS.word
    out = _place(out or (results[0] if is_of_run else None), chosen)
    kind, name = workspace.COMPARISON, chosen.root.name
    if is_of_run and out == results[0].absolute():
        kind, name = workspace.RESULTS, about["name"]
    judged = judge(chosen, names, results)
    with workspace.claimed(out, kind, name) as folder:
        return _written(chosen, *judged, folder)


def _place(out: Path | None, chosen: Pack) -> Path:
    """The directory of the results, which is not in the pack."""
    out = out or Path("results") / f"benchmark-{chosen.root.name}"
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", str(out), "use --out")
    return out.absolute()


def name_of(place: Path) -> str:
    """The name of the solver of a directory of results: what `run` noted, or the directory's."""
    noted = workspace.read_marker(place, workspace.RESULTS).get("solver")
    return printable(str(noted or place.absolute().name))


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


def _solve(words: Sequence[str], scene: Path, options: Options, folder: Folder, name: str) -> None:
    """Run a solver on a copy of a scene, in a directory that is removed afterwards.

    Its answer, its output, its times (s) and memory (MiB) are put into a directory of the results;
    with the times is ``error``, the reason why the answer does not count.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as private:
        work, log, report = Path(private, "work"), Path(private, LOG), Path(private, USED)
        case, out, memory = work / "case", work / ANSWER, f"{options.memory * 2**30:.0f}"
        shutil.copytree(scene, case)
        command = [word.replace("{case}", str(case)).replace("{out}", str(out)) for word in words]
        ended = process.run(
            [sys.executable, "-ISc", MEASURE, str(report), memory, *command],
            cwd=work,
            log=log,
            limit_s=options.seconds,
            env={"TMPDIR": str(work), "OLDPWD": None},
            output_limit=LOG_BYTES,
            file_limit=FILE_BYTES,
        )
        error = f"it ended with {ended.returncode}: {process.last_words(log)}".rstrip(": ")
        if ended.over == "time":
            error = f"it did not end within {options.seconds:g} s and was killed"
        elif ended.over:
            error = f"it printed more than {LOG_BYTES // MIB} MiB"
        folder.path(f"{name}/{ANSWER}").unlink(missing_ok=True)
        with contextlib.suppress(OSError), opened(out) as stream:
            folder.note(f"{name}/{ANSWER}", stream.read(ANSWER_BYTES + 1))
        used = read_json(report) or {"seconds": ended.seconds}
        used["error"] = error if ended.over or ended.returncode else ""
        folder.note(f"{name}/{USED}", text_of(used))
        with log.open("rb") as stream:
            folder.note(f"{name}/{LOG}", stream.read(LOG_BYTES))


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


def _written(
    chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame, folder: Folder
) -> Outcome:
    """Put tables, figures and page of a comparison into a directory."""
    # the drawing libraries take half a second to import
    from orchestrator.benchmark import page

    theirs = verdicts[verdicts["solver"] != OURS]
    tables = {NUMBERS: (numbers[numbers["solver"] != OURS], "%.9g"), VERDICTS: (theirs, "%.6g")}
    with folder.renewed():
        for name, (table, digits) in tables.items():
            columns = ["solver", *table.columns.drop("solver")]
            folder.put(name, text_of_table(table[columns], digits))
        page.write(chosen, numbers, verdicts, folder)
    lines = [f"{row.solver}: {row.scenes}: {row.why}" for row in failures(theirs).itertuples()]
    if len(lines) > LISTED:
        lines[LISTED:] = [f"and {len(lines) - LISTED} more: see {VERDICTS}"]
    table = summary(theirs).dropna(axis=1, how="all")
    text = table.to_string(index=False, na_rep="", float_format="{:.3g}".format)
    return Outcome(lines, "\n".join([text, *in_words(theirs)]), folder.root / PAGE)
