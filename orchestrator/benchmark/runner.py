"""A solver on the scenes of a pack: each in a process of its own, watched, ours in turn."""

import contextlib
import fnmatch
import shlex
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from orchestrator.benchmark import meter, pack, report
from orchestrator.benchmark.answer import FILE
from orchestrator.benchmark.ours import Ours
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.problem import csv
from orchestrator.benchmark.report import Found
from orchestrator.benchmark.verdict import USED, compared
from orchestrator.errors import InputError
from orchestrator.files import digest_files, read_json, write_json
from orchestrator.solvers import process

OURS = "ours"
LOG = "log.txt"
LAST_LINES = 200
"""Characters of a log's end that a message repeats."""


@dataclass(frozen=True)
class Choice:
    """Which scenes of a pack: of some levels, by patterns of names; empty for all."""

    levels: Sequence[int] = ()
    patterns: Sequence[str] = ()

    def of(self, chosen: Pack) -> list[str]:
        """Their names.

        Raises
        ------
        InputError
            If there are none.
        """
        found = [name for name, told in chosen.scenes.items() if self._has(name, told["level"])]
        if not found:
            raise InputError(
                "no scene of the pack is chosen",
                where=str(chosen.root),
                remedy="see its scenes.csv, and --level and --scene",
            )
        return found

    def _has(self, name: str, level: int) -> bool:
        named = not self.patterns or any(fnmatch.fnmatchcase(name, p) for p in self.patterns)
        return named and (not self.levels or level in self.levels)


def compare(root: Path, results: Path, choice: Choice) -> Found:
    """Compare answers that are there, ``RESULTS/SCENE/answer.csv``, with a pack; write the page."""
    chosen = pack.read(root)
    names = choice.of(chosen)
    if not results.is_dir():
        raise InputError("there is no such directory", where=str(results), remedy="name another")
    return report.write(chosen, *compared(chosen, names, results, results / OURS), results)


def run(root: Path, command: str, out: Path, choice: Choice, limit_s: float) -> Found:
    """Run a solver on scenes of a pack, ours in turn, compare, and write the page.

    Parameters
    ----------
    root : Path
        The pack.
    command : str
        The solver's, with ``{case}`` and ``{out}``; it is split as a shell would, but no shell
        reads it.
    out : Path
        Where the results go.
    choice : Choice
        Which scenes.
    limit_s : float
        Wall time after which a run counts as hung, s.

    Raises
    ------
    InputError
        If the pack, the command or the directory cannot be used.
    """
    chosen = pack.read(root.absolute())
    names = choice.of(chosen)
    words = split(command)
    out = out.absolute()
    _claim(out, chosen)
    ours = Ours(chosen, out / OURS / "cases")
    ours.root.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names, 1):
        print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
        harm = _attempt(chosen, name, words, out, limit_s)
        if harm:
            raise InputError(f"{name}: {harm}", where=str(root), remedy="export it again")
        _answer_ours(ours, name, out / OURS / name)
    chosen.verify()
    return report.write(chosen, *compared(chosen, names, out, out / OURS), out)


def split(command: str) -> list[str]:
    """The words of a command; files that it names keep their meaning in another directory.

    Raises
    ------
    InputError
        If it has no ``{case}`` or ``{out}``, or its program is not there.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise InputError(f"the command cannot be read: {error}", where="--solver") from None
    for part in ("{case}", "{out}"):
        if not any(part in word for word in words):
            raise InputError(
                f"the command has no {part}",
                where="--solver",
                remedy="such as 'my-solver {case} {out}'",
            )
    if shutil.which(words[0]) is None:
        raise InputError(
            f"there is no program {words[0]}", where="--solver", remedy="give its path"
        )
    return [str(Path(word).absolute()) if Path(word).is_file() else word for word in words]


def _claim(out: Path, chosen: Pack) -> None:
    if out == chosen.root or chosen.root in out.parents:
        raise InputError("the results may not lie in the pack", where=str(out), remedy="use --out")
    out.mkdir(parents=True, exist_ok=True)


def _attempt(chosen: Pack, name: str, words: Sequence[str], out: Path, limit_s: float) -> str:
    """Run the solver on one scene; what it took, or why it failed, is in its directory.

    Returns how it changed the pack, or nothing.
    """
    folder = out / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    case = folder / "case"
    shutil.copytree(chosen.directory(name), case)
    given = [w.replace("{case}", str(case)).replace("{out}", str(folder / FILE)) for w in words]
    watch = _Watch(chosen, out, name)
    error = ""
    metered = [sys.executable, "-I", "-S", meter.__file__, str(folder / USED), *given]
    ended = process.run(metered, cwd=folder, log=folder / LOG, limit_s=limit_s)
    used = read_json(folder / USED) or {"seconds": ended.seconds}
    if ended.timed_out:
        error = f"it did not end within {limit_s:g} s and was killed"
    elif used.get("returncode") != 0:
        error = f"it ended with {used.get('returncode')}{_last_words(folder / LOG)}"
    elif digest_files(_all(case), root=case) != digest_files(
        _all(chosen.directory(name)), root=chosen.directory(name)
    ):
        error = "it changed the files of its case"
    harm, other = watch.changes()
    write_json(folder / USED, {**used, "error": harm or other or error})
    return harm


def _all(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def _last_words(log: Path) -> str:
    said = log.read_text(errors="replace").strip().splitlines()
    return f": {said[-1][-LAST_LINES:]}" if said else ""


class _Watch:
    """The pack and the answers of other scenes: no solver may touch them."""

    def __init__(self, chosen: Pack, out: Path, name: str) -> None:
        self.pack, self.out, self.name = chosen, out, name
        self.before = self._marks()
        self.answers = {path: path.read_bytes() for path in self._others()}

    def changes(self) -> tuple[str, str]:
        """How the pack was changed, and how an answer was; the answer is put back."""
        after = self._marks()
        harm = ""
        if after != self.before:
            differing = {p for p, _ in set(after.items()) ^ set(self.before.items())}
            first = min(differing).relative_to(self.pack.root)
            harm = f"it changed {first} of the pack: the pack is not used further"
        changed = [
            path
            for path, content in self.answers.items()
            if not path.is_file() or path.read_bytes() != content
        ]
        for path in changed:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(self.answers[path])
        names = ", ".join(path.parent.name for path in changed)
        return harm, f"it changed the answer of {names}, which was put back" if changed else ""

    def _others(self) -> Iterator[Path]:
        found = (*self.out.glob(f"*/{FILE}"), *self.out.glob(f"{OURS}/*/{FILE}"))
        return (path for path in found if path.parent != self.out / self.name)

    def _marks(self) -> dict[Path, tuple[int, int]]:
        marks: dict[Path, tuple[int, int]] = {}
        for path in self.pack.files():
            with contextlib.suppress(FileNotFoundError):
                state = path.stat()
                marks[path] = (state.st_mtime_ns, state.st_size)
        return marks


def _answer_ours(ours: Ours, name: str, folder: Path) -> None:
    table, took = ours.answer(name)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / FILE).write_text(csv(table), encoding="utf-8")
    known = {name: value for name, value in asdict(took).items() if value == value}
    write_json(folder / USED, known)
