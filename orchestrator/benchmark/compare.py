"""Run a solver on the scenes of a pack, read its answers, and judge them."""

import csv
import fnmatch
import re
import shlex
import shutil
import signal
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
PAGE, NUMBERS, VERDICTS, FIGURES = "comparison.html", "comparison.csv", "verdicts.csv", "figures"
STEPS = "steps"
"""Quantity that a solver may add to any answer: its number of time steps."""
MIB = 2**20
ANSWER_BYTES, LOG_BYTES, FILE_BYTES = 4 * MIB, 64 * MIB, 4096 * MIB
"""Largest answer, largest output, and largest file of a solver, bytes."""
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


class Outcome(NamedTuple):
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
    choice, limits : Choice, Limits
        The scenes, and the limits of the solver for each.

    Raises
    ------
    InputError
        If the pack, the command or the directory cannot be used.
    """
    chosen, words = pack.read(root.absolute()), split(command)
    names, digest = choice.names(chosen), chosen.manifest.sha256[pack.EXPECTED]
    out = _place(out or _default(root), chosen)
    ours = Ours(chosen, names, out / OURS / "cases")
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        about = workspace.read_marker(out, workspace.RESULTS) or {}
        if about.get("pack", digest) != digest:
            what = (
                "the directory holds answers to another pack, or to an earlier export of this one"
            )
            raise InputError(what, where=str(out), remedy="choose another with --out, or remove it")
        folder.note(workspace.RESULTS.marker, text_of({**about, "pack": digest}))
        ours.root.mkdir(parents=True, exist_ok=True)
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
    names, solvers = choice.names(chosen), [OURS, *(place.absolute().name for place in results)]
    for place, solver in zip(results, solvers[1:], strict=True):
        if not place.is_dir():
            raise InputError("there is no such directory", where=str(place), remedy="name another")
        if solvers.count(solver) > 1:
            remedy = "name each directory of results after its solver"
            raise InputError(f"two solvers have the name {solver}", "RESULTS", remedy)
    about = workspace.read_marker(results[0], workspace.RESULTS) or {}
    is_of_run = len(results) == 1 and about.get("kind") == workspace.RESULTS.word
    out = _place(out or (results[0] if is_of_run else _default(root)), chosen)
    is_same = is_of_run and out == results[0].absolute()
    kind = workspace.RESULTS if is_same else workspace.COMPARISON
    judged = judge(chosen, names, results)
    with workspace.claimed(out, kind, about["name"] if is_same else chosen.root.name) as folder:
        return _written(chosen, *judged, folder)


def _default(root: Path) -> Path:
    return Path("results") / f"benchmark-{root.absolute().name}"


def _place(out: Path, chosen: Pack) -> Path:
    """The directory of the results, which is not in the pack."""
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", str(out), "use --out")
    return out.absolute()


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
        error = _fault(ended, limits, log)
        try:
            folder.note(f"{name}/{ANSWER}", _content(out))
        except ValueError as fault:
            folder.path(f"{name}/{ANSWER}").unlink(missing_ok=True)
            error = error or str(fault)
        used = read_json(report) or {"seconds": ended.seconds}
        with log.open("rb") as stream:
            folder.note(f"{name}/{LOG}", stream.read(LOG_BYTES))
        folder.note(f"{name}/{USED}", text_of({**used, "error": error}))


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


def _content(path: Path) -> bytes:
    """The bytes of an answer; raises ValueError if there is no file, or it is too large."""
    try:
        with opened(path) as stream:
            content = stream.read(ANSWER_BYTES + 1)
    except FileNotFoundError:
        raise ValueError(f"it wrote no {ANSWER}") from None
    except OSError as error:
        raise ValueError(f"{ANSWER} cannot be read: {error.strerror}") from None
    if len(content) > ANSWER_BYTES:
        raise ValueError(f"{ANSWER} has more than {ANSWER_BYTES // MIB} MiB")
    return content


def _parsed(data: bytes) -> dict[tuple[str, str], float]:
    """The answers of a file, by quantity and `place_of`; raises ValueError for its first fault."""
    answers: dict[tuple[str, str], float] = {}
    try:
        text = data.decode("utf-8-sig")  # some programs begin a text with a mark of its encoding
        rows = [[word.strip() for word in row] for row in csv.reader(text.splitlines()) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{ANSWER} is no table: {error}") from None
    if rows[:1] != [["quantity", "at", "value"]]:
        raise ValueError(f"{ANSWER} does not begin with quantity,at,value")
    for number, row in enumerate(rows[1:], 2):
        try:
            quantity, at, value = row
            key, answer = (quantity, place_of(at)), float(value)
        except ValueError:
            answer = np.nan
        if not abs(answer) < LARGEST:
            what = f"{','.join(row)[:80]!r} is not a quantity, its at and a finite number"
            raise ValueError(f"{ANSWER}, line {number}: {what}")
        if key in answers:
            raise ValueError(f"{ANSWER} answers {_question(*key)} twice")
        answers[key] = answer
    if not text.endswith("\n"):
        raise ValueError(f"{ANSWER} is cut short: its last line has no end")
    return answers


def place_of(at: str) -> str:
    """The number ``at`` to seven digits; empty for a quantity that is one number."""
    return f"{float(at):.7g}" if at.strip() else ""


def _question(quantity: str, at: str) -> str:
    return f"{quantity} at {at}" if at else quantity


def _read(results: Path, names: Sequence[str]) -> tuple[dict[Any, float], pd.DataFrame]:
    """The answers of a solver by scene, quantity and place; for each scene times and a fault."""
    answers: dict[Any, float] = {}
    rows = []
    for name in names:
        used, of_scene = read_json(results / name / USED) or {}, {}
        error = str(used.get("error") or "")
        try:
            of_scene = {} if error else _parsed(_content(results / name / ANSWER))
        except ValueError as fault:
            error = str(fault)
        answers |= {(name, *key): value for key, value in of_scene.items()}
        times = {key: used.get(key) for key in ("seconds", "cpu_s", "peak_mib")}
        # the message repeats the output of a program
        row: Row = {
            "scene": name,
            "message": one_line(error),
            **times,
            STEPS: of_scene.get((STEPS, "")),
        }
        rows.append(row)
    table = pd.DataFrame(rows)
    for key in (*times, STEPS):  # anybody may have written the times
        number = pd.to_numeric(table[key], errors="coerce")
        table[key] = number.where(number.between(0, LARGEST, inclusive="neither"))
    return answers, table


def judge(
    chosen: Pack, names: Sequence[str], results: Sequence[Path]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare the answers of solvers with the expected ones.

    Parameters
    ----------
    chosen : Pack
        The pack.
    names : sequence of str
        The scenes.
    results : sequence of Path
        For each solver the directory with its ``SCENE/answer.csv``, and ``ours/SCENE/answer.csv``
        if ours ran in turn with it.

    Returns
    -------
    numbers : DataFrame
        A row for each solver, `OURS` the last, and each expectation: ``solver``, the columns of the
        expected answers, ``answer``, ``error`` (relative) and ``within``.
    verdicts : DataFrame
        A row for each solver and scene: ``passed``, ``message``, errors and times.
    """
    expected = chosen.expected[chosen.expected["scene"].isin(names)]
    places = expected["at"].map(place_of)
    keys = [*zip(expected["scene"], expected["quantity"], places, strict=True)]
    tables, times = [], []
    for place in results:
        solver = printable(place.absolute().name)
        (answers, used), (again, used_by_ours) = _read(place, names), _read(place / OURS, names)
        ours = [again.get(key, stated) for key, stated in zip(keys, expected["ours"], strict=True)]
        answer = [answers.get(key, np.nan) for key in keys]
        tables.append(expected.assign(solver=solver, ours=ours, answer=answer))
        for key in ("seconds", "cpu_s", STEPS):
            used[f"ours_{key}"] = used_by_ours[key]
        times.append(used.assign(solver=solver))
    own = {key: times[0][f"ours_{key}"] for key in ("seconds", STEPS)}
    own["cpu_s"] = pd.concat(times)["ours_cpu_s"].groupby(level=0).mean()
    times.append(times[0].assign(solver=OURS, message="", peak_mib=np.nan, **own))
    tables.append(tables[0].assign(solver=OURS, answer=tables[0]["ours"]))
    numbers = pd.concat(tables, ignore_index=True)
    # the error of a value of zero is the answer
    value = numbers["value"]
    numbers["error"] = (numbers["answer"] - value) / value.where(value != 0, 1.0)
    numbers["within"] = within(numbers, numbers["tolerance"])

    verdicts = pd.concat(times).set_index(["solver", "scene"])
    for key in ("level", "kind"):
        verdicts[key] = [chosen.scenes[name][key] for _, name in verdicts.index]
    faults = _faults(numbers, chosen).reindex(verdicts.index)
    is_silent = (verdicts["message"] != "") | (faults["rank"] > 1)
    verdicts["answered"] = ~is_silent
    verdicts["message"] = verdicts["message"].where(verdicts["message"] != "", faults["what"])
    verdicts["message"] = verdicts["message"].fillna("")
    verdicts["passed"] = verdicts["message"] == ""
    judged = numbers[numbers["tolerance"].notna() & ~numbers["quantity"].isin(COUNTS)]
    signed = judged.set_index(["solver", "scene"])["error"]
    groups, sizes = signed.groupby(level=[0, 1]), signed.abs().groupby(level=[0, 1])
    for name, errors in (
        ("error", sizes.median()),
        ("worst", sizes.max()),
        ("bias", groups.median()),
    ):
        verdicts[name] = errors.reindex(verdicts.index).where(verdicts["answered"])
    for ratio, key in (("ratio", "seconds"), ("cpu_ratio", "cpu_s")):
        verdicts[ratio] = (verdicts[key] / verdicts[f"ours_{key}"]).where(verdicts["answered"])
    verdicts.loc[OURS, ["ratio", "cpu_ratio"]] = np.nan
    return numbers, verdicts.reset_index()


def within(numbers: pd.DataFrame, tolerance: Any) -> "pd.Series[bool]":
    """Whether answers are in their intervals, widened by a tolerance; missing ones are not."""
    margin = (tolerance + ROUND) * numbers["value"].abs()
    return numbers["answer"].between(numbers["low"] - margin, numbers["high"] + margin)


def _faults(numbers: pd.DataFrame, chosen: Pack) -> pd.DataFrame:
    """The worst fault of each solver in each scene that has one: ``rank`` and ``what``.

    Ranks: 3, a number is missing; 2, a count is none; 1, a judged number is off.
    """
    index, answer = ["solver", "scene"], numbers["answer"]
    counts = numbers["quantity"].isin((*COUNTS, "count"))
    is_none = counts & ((answer < 0) | (answer % 1 != 0))
    # at the last load step both are asked: together they are the counted grains
    ends: Any = numbers[numbers["quantity"].isin(("moved", "not_moved"))]
    ends = ends[ends.duplicated([*index, "at"], keep=False)].groupby(index)
    total = numbers[numbers["quantity"] == "count"].set_index(index)["answer"]
    summed = ends["answer"].sum(min_count=2)
    total = total.reindex(summed.index).fillna(ends["value"].sum())
    lost = {*summed.index[summed.notna() & (summed != total)]}
    ids = zip(numbers["solver"], numbers["scene"], strict=True)
    is_lost = (numbers["quantity"] == "not_moved") & np.array([key in lost for key in ids])
    is_off = numbers["tolerance"].notna() & ~numbers["within"]
    rank = np.select([answer.isna(), is_none | is_lost, is_off], [3, 2, 1], 0)
    # a count that is off is named only if nothing else is
    size = numbers["error"].abs().where(~counts, 0.0)
    table = numbers.assign(rank=rank, size=size, is_none=is_none)[rank > 0]
    table = table.sort_values(["rank", "size"], ascending=False, kind="stable")
    table["others"] = table.groupby([*index, "rank"])["rank"].transform("size") - 1
    worst = table.drop_duplicates(index)
    return worst.assign(what=[_what(row) for row in worst.to_dict("records")]).set_index(index)


def _what(row: Mapping[Any, Any]) -> str:
    question, answer = _question(row["quantity"], row["at"]), row["answer"]
    if row["rank"] == 3:
        what = f"{ANSWER} lacks {question}"
    elif row["is_none"]:
        what = f"{question} is {answer:g}: it counts grains"
    elif row["rank"] == 2:
        what = "the counts do not make N: moved and not_moved at the last load step"
    else:
        what = f"{question} is {answer:.6g}, not {row['value']:.6g}"
        if row["low"] < row["high"]:
            what += f" ({row['low']:.6g} ... {row['high']:.6g})"
    return what + (f", and {row['others']} more" if row["others"] else "")


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
        head = {"level": f"{level} {LEVELS[int(str(level))]}", "kind": kind, "solver": solver}
        texts = {name: f"{x:.3g}{unit}" if x == x else "" for name, (x, unit) in numbers.items()}
        rows.append({**head, "scenes": len(of), "passed": of["passed"].sum(), **texts})
    return pd.DataFrame(rows)


def _written(
    chosen: Pack, numbers: pd.DataFrame, verdicts: pd.DataFrame, folder: Folder
) -> Outcome:
    """Put tables, figures and page of a comparison into a directory."""
    theirs = verdicts[verdicts["solver"] != OURS]
    tables = {NUMBERS: (numbers[numbers["solver"] != OURS], "%.9g"), VERDICTS: (theirs, "%.6g")}
    with folder.renewed(NUMBERS, VERDICTS, PAGE, FIGURES):
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
