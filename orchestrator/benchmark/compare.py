"""Run a solver on the scenes of a pack, or judge answers; write tables and page."""

import contextlib
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from orchestrator.benchmark import judge, pack, page
from orchestrator.benchmark.export import Ours
from orchestrator.benchmark.judge import (
    ANSWER,
    ANSWER_BYTES,
    EXIT_CODE,
    MIB,
    OURS,
    USED,
    solver_name,
)
from orchestrator.benchmark.pack import Pack
from orchestrator.digits import number
from orchestrator.errors import InputError, printable
from orchestrator.runs import process, workspace
from orchestrator.runs.files import Folder, opened, read_json, text_of
from orchestrator.tables import csv as text_of_table

NUMBERS = "comparison.csv"
VERDICTS = "verdicts.csv"
QUANTITIES = "quantities.csv"
LOG = "log.txt"
LOG_BYTES = 64 * MIB
"""Largest output of a solver, bytes."""
FILE_BYTES = 4096 * MIB
"""Largest file of a solver, bytes."""
LISTED = 10
"""Most failures that are printed on the terminal."""
OPERATORS = re.compile(r"[|&;<>]+|\d*>\S*|\S*;")
"""Operators of a shell."""
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
"""Program that runs the solver: the memory of a process that this one starts would
count as the solver's."""


class Options(NamedTuple):
    """The choice of scenes, and the limits of a solver.

    Attributes
    ----------
    levels
        Levels of the scenes; all if empty.
    patterns
        Patterns of their names; all if empty.
    seconds
        Wall time for a scene, s.
    memory
        Memory of each process, GiB.
    name
        Name of the solver; by default that of its script, or of its program.
    """

    levels: Sequence[int] = ()
    patterns: Sequence[str] = ()
    seconds: float = 600.0
    memory: float = 4.0
    name: str = ""


class Outcome(NamedTuple):
    """A comparison.

    Attributes
    ----------
    failures
        A line for each failure.
    summary
        A table, and a line for each solver.
    page
        The file of the page.
    """

    failures: list[str]
    summary: str
    page: Path


def run(root: Path, command: str, out: Path | None, options: Options) -> Outcome:
    """Run a solver on scenes of a pack, ours in turn, and judge the answers.

    Parameters
    ----------
    root
        The directory of the pack.
    command
        The solver's command, with ``{case}`` and ``{out}``; no shell runs it.
    out
        The directory of the results, by default ``results/benchmark-NAME`` of the pack.
    options
        The scenes that are chosen, the solver's limits and its name.

    Returns
    -------
    Outcome
        The comparison, whose page is written.

    Raises
    ------
    InputError
        If the pack, the command or the directory cannot be used.
    """
    chosen = pack.read_pack(root.absolute())
    words = split(command)
    solver = options.name or _name_of_program(words)
    if solver == OURS:
        raise InputError("two solvers have the name ours", "--name", "choose another")
    names = chosen.chosen(options.levels, options.patterns)
    out = _place(out, chosen)
    ours = Ours(chosen, names, out / OURS / "cases")
    with workspace.claimed(out, workspace.RESULTS, command) as folder:
        _check_pack(out, chosen)
        about = workspace.read_marker(out, workspace.RESULTS)
        noted = {**about, "pack": chosen.questions, "solver": solver}
        folder.note(workspace.RESULTS.marker, text_of(noted))
        # runs of an earlier time were not in turn with the solver
        shutil.rmtree(folder.path(f"{OURS}/cases"), ignore_errors=True)
        ours.root.mkdir(parents=True)
        for name in shown({name: chosen.scenes[name]["level"] for name in names}):
            _solve(words, chosen.root / pack.SCENES / name, options, folder, name)
            answer, times = ours.answer(name)
            folder.note(f"{OURS}/{name}/{ANSWER}", pack.csv_of(answer))
            folder.note(f"{OURS}/{name}/{USED}", text_of(times))
        pack.verify(chosen.root, chosen.manifest)
        return _written(chosen, judge.judge_solvers(chosen, names, [out]), folder)


def shown(levels: Mapping[str, int]) -> Iterator[str]:
    """Go through scenes and say on stderr how far it is.

    On a terminal it is one line that renews itself, else a line for each level.

    Parameters
    ----------
    levels
        The level of each scene, by name.

    Yields
    ------
    str
        The name of each scene.
    """
    is_terminal = sys.stderr.isatty()
    bar = Progress(
        TextColumn("{task.completed:.0f}/{task.total:.0f} scenes"),
        BarColumn(),
        TextColumn("{task.description}"),
        console=Console(stderr=True, highlight=False, markup=False),
        disable=not is_terminal,
    )
    counts = Counter(levels.values())
    begun: set[int] = set()
    with bar:
        task = bar.add_task("", total=len(levels))
        for name, level in levels.items():
            bar.update(task, description=f"level {level}: {name}")
            if level not in begun and not is_terminal:
                text = f"level {level}: {number(counts[level], 'scene')}"
                print(text, file=sys.stderr, flush=True)
            begun.add(level)
            yield name
            bar.advance(task)


def _name_of_program(words: Sequence[str]) -> str:
    """The name of the script of a command, or else of its program."""
    for word in words[1:]:
        if Path(word).is_file():
            return Path(word).stem
    return Path(words[0]).stem


def compare(
    root: Path, results: Sequence[Path], out: Path | None, options: Options
) -> Outcome:
    """Judge answers that are there, and write one page of all solvers.

    Parameters
    ----------
    root
        The directory of the pack.
    results
        The directory of each solver, which is named by `run`, or else by the directory.
    out
        The directory of the page, by default the only one of the results, if `run`
        wrote them, or else ``results/comparison-NAME`` of the pack.
    options
        The scenes that are chosen.

    Returns
    -------
    Outcome
        The comparison, whose page is written.

    Raises
    ------
    InputError
        If the pack or a directory cannot be used, if `run` noted another pack for the
        answers, or if two solvers have one name.
    """
    chosen = pack.read_pack(root.absolute())
    names = chosen.chosen(options.levels, options.patterns)
    solvers = [OURS, *map(solver_name, results)]
    for place, solver in zip(results, solvers[1:], strict=True):
        if not place.is_dir():
            what = "there is no such directory"
            raise InputError(what, where=str(place), remedy="name another")
        if solvers.count(solver) > 1:
            remedy = "run one with another --name, or rename its directory"
            raise InputError(f"two solvers have the name {solver}", "RESULTS", remedy)
        _check_pack(place, chosen)
    notes = [note for place in results for note in _of_unknown_pack(place, chosen)]
    about = workspace.read_marker(results[0], workspace.RESULTS)
    is_of_run = len(results) == 1 and about.get("kind") == workspace.RESULTS.word
    if out is None and is_of_run:
        out = results[0]
    # beside results/benchmark-NAME, which holds the results of a solver
    out = _place(out, chosen, "comparison")
    kind = workspace.COMPARISON
    name = chosen.root.name
    if is_of_run and out == results[0].absolute():
        kind = workspace.RESULTS
        name = about["name"]
    judged = judge.judge_solvers(chosen, names, results)
    with workspace.claimed(out, kind, name) as folder:
        if kind == workspace.COMPARISON:
            _note_pack(folder, chosen)
        return _written(chosen, judged, folder, notes)


def _check_pack(place: Path, chosen: Pack) -> None:
    """Refuse results of `run` whose answers are to the questions of another pack."""
    about = workspace.read_marker(place, workspace.RESULTS)
    answered = about.get("pack", chosen.questions)
    if answered != chosen.questions:
        what = "it holds answers to another pack, or to an earlier export of this one"
        what = f"{what}: {chosen.root}"
        remedy = "run the solver on this one with --out"
        remedy = f"compare them with the pack that they answer, or {remedy}"
        raise InputError(what, where=str(place), remedy=remedy)


def _of_unknown_pack(place: Path, chosen: Pack) -> list[str]:
    """Say that nothing tells which pack answers belong to, unless `run` wrote them."""
    if "pack" in workspace.read_marker(place, workspace.RESULTS):
        return []
    solver = solver_name(place)
    name = printable(chosen.root.name)
    text = (
        f"{solver}: nothing in its directory tells which pack was answered, as "
        f"“benchmark run” notes it; the answers are taken for answers to “{name}”"
    )
    scenes = {answer.parent.name for answer in place.glob(f"*/{ANSWER}")}
    others = scenes - {*chosen.scenes}
    if others:
        text = f"{text}, which has no scene for {len(others)} of {len(scenes)} of them"
    return [text]


def _note_pack(folder: Folder, chosen: Pack) -> None:
    """Note of which pack a comparison is; refuse to replace that of another pack."""
    about = workspace.read_marker(folder.root, workspace.COMPARISON)
    at = os.path.relpath(chosen.root, folder.root)
    other = str(about.get("at", at))
    if other != at and (folder.root / other / pack.MANIFEST).is_file():
        what = f"the directory holds the comparison with another pack, {other}"
        remedy = "choose another with --out"
        raise InputError(what, where=str(folder.root), remedy=remedy)
    folder.note(workspace.COMPARISON.marker, text_of({**about, "at": at}))


def _place(out: Path | None, chosen: Pack, kind: str = "benchmark") -> Path:
    """The directory of the results, which is not in the pack."""
    if out is None:
        out = Path("results") / f"{kind}-{chosen.root.name}"
    if out.resolve().is_relative_to(chosen.root.resolve()):
        raise InputError("the results may not lie in the pack", str(out), "use --out")
    return out.absolute()


def split(command: str) -> list[str]:
    """Split a solver's command into words.

    Parameters
    ----------
    command
        The command.

    Returns
    -------
    list of str
        Its words; files that it names are found from any directory.

    Raises
    ------
    InputError
        If it has no ``{case}`` or ``{out}``, is for a shell, or has no program.
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
        what = f"no shell reads the command: {word}"
        raise InputError(what, "--solver", "write: sh -c '...'")
    if shutil.which(words[0]) is None:
        what = f"there is no program {words[0]} that may be run"
        raise InputError(what, "--solver", "give its path")
    found = []
    for word in words:
        if Path(word).is_file():
            word = str(Path(word).absolute())
        found.append(word)
    return found


def _solve(
    words: Sequence[str], scene: Path, options: Options, folder: Folder, name: str
) -> None:
    """Run a solver on a copy of a scene, in a directory that is removed afterwards.

    Its answer, its output, its times (s) and memory (MiB) are put into a directory of
    the results; with the times are ``error``, the reason why the answer does not count,
    and the exit code.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as private:
        work = Path(private, "work")
        log = Path(private, LOG)
        report = Path(private, USED)
        out = work / ANSWER
        shutil.copytree(scene, work / "case")
        memory = f"{options.memory * 2**30:.0f}"
        command = [sys.executable, "-ISc", MEASURE, str(report), memory]
        for word in words:
            word = word.replace("{case}", str(work / "case"))
            command.append(word.replace("{out}", str(out)))
        ended = process.run(
            command,
            cwd=work,
            log=log,
            limit_s=options.seconds,
            env={"TMPDIR": str(work), "OLDPWD": None},
            output_limit=LOG_BYTES,
            file_limit=FILE_BYTES,
        )
        error = ""
        if ended.over == "time":
            error = f"it did not end within {options.seconds:g} s and was killed"
        elif ended.over:
            error = f"it printed more than {LOG_BYTES // MIB} MiB"
        elif ended.returncode:
            error = f"it ended with {ended.returncode}: {process.last_words(log)}"
            error = error.rstrip(": ")
        folder.path(f"{name}/{ANSWER}").unlink(missing_ok=True)
        with contextlib.suppress(OSError), opened(out) as stream:
            folder.note(f"{name}/{ANSWER}", stream.read(ANSWER_BYTES + 1))
        used = read_json(report) or {"seconds": ended.seconds}
        used["error"] = error
        used[EXIT_CODE] = ended.returncode
        folder.note(f"{name}/{USED}", text_of(used))
        with log.open("rb") as stream:
            folder.note(f"{name}/{LOG}", stream.read(LOG_BYTES))


def _written(
    chosen: Pack,
    judged: tuple[pd.DataFrame, pd.DataFrame],
    folder: Folder,
    notes: Sequence[str] = (),
) -> Outcome:
    """Put tables, figures and page of a comparison into a directory."""
    numbers, verdicts = judged
    theirs = verdicts[verdicts["solver"] != OURS]
    with folder.renewed():
        of_theirs = numbers[numbers["solver"] != OURS]
        folder.put(NUMBERS, text_of_table(_solver_first(of_theirs), "%.9g"))
        by_quantity = judge.by_quantity(numbers)
        folder.put(QUANTITIES, text_of_table(by_quantity, "%.6g"))
        folder.put(VERDICTS, text_of_table(_solver_first(theirs), "%.6g"))
        page.write_page(chosen, numbers, verdicts, folder, notes)
    lines = []
    for row in judge.failures(theirs).itertuples():
        lines.append(f"{row.solver}: {row.scenes}: {row.why}")
    if len(lines) > LISTED:
        lines[LISTED:] = [f"and {len(lines) - LISTED} more: see {VERDICTS}"]
    table = judge.summary(theirs).dropna(axis=1, how="all")
    text = table.to_string(index=False, na_rep="", float_format="{:.3g}".format)
    said = [*notes, *judge.patterns(numbers), *judge.in_words(theirs)]
    summary = "\n".join([text, *said])
    return Outcome(lines, summary, folder.root / page.PAGE)


def _solver_first(table: pd.DataFrame) -> pd.DataFrame:
    """A table with the solver in its first column."""
    return table[["solver", *table.columns.drop("solver")]]
