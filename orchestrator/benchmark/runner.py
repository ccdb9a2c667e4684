"""A solver on the scenes of a pack: each in a process of its own, watched, ours in turn."""

import fnmatch
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from orchestrator.benchmark import meter, pack, report
from orchestrator.benchmark.answer import FILE
from orchestrator.benchmark.ours import Ours
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.problem import csv
from orchestrator.benchmark.report import Found
from orchestrator.benchmark.verdict import OURS, USED, compared
from orchestrator.errors import InputError
from orchestrator.runs import process
from orchestrator.runs.files import digest_files, read_json, write_json

LOG = "log.txt"


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


def compare(root: Path, results: Sequence[Path], out: Path, choice: Choice) -> Found:
    """Compare answers that are there with a pack; write one page of all solvers.

    Parameters
    ----------
    root : Path
        The pack.
    results : sequence of Path
        A directory for each solver, which is named by it: ``RESULTS/SCENE/answer.csv``.
    out : Path
        Where page and tables go.
    choice : Choice
        Which scenes.

    Raises
    ------
    InputError
        If the pack or a directory cannot be used, or two have one name.
    """
    chosen = pack.read(root.absolute())
    names = choice.of(chosen)
    for one in results:
        if not one.is_dir():
            raise InputError("there is no such directory", where=str(one), remedy="name another")
    _check_names([one.absolute().name for one in results])
    _claim(out.absolute(), chosen)
    return report.write(chosen, [compared(chosen, names, one) for one in results], out)


def _check_names(names: Sequence[str]) -> None:
    """See that no two solvers, nor one and ours, have one name."""
    twice = next((name for name in names if [OURS, *names].count(name) > 1), None)
    if twice is not None:
        raise InputError(
            f"two solvers have the name {twice}",
            where="RESULTS",
            remedy="name each directory of results after its solver",
        )


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
    _check_names([out.name])
    _claim(out, chosen)
    ours, watch = Ours(chosen, out / OURS / "cases"), _Watch(chosen, out)
    ours.root.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names, 1):
        print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
        watch.forget(out / name / FILE)
        watch.forget(out / OURS / name / FILE)
        _attempt(chosen, name, words, out, limit_s, watch)
        _answer_ours(ours, name, out / OURS / name)
        watch.keep(out / name / FILE)
        watch.keep(out / OURS / name / FILE)
    chosen.verify()
    return report.write(chosen, [compared(chosen, names, out)], out)


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


def _attempt(
    chosen: Pack, name: str, words: Sequence[str], out: Path, limit_s: float, watch: "_Watch"
) -> None:
    """Run the solver on one scene; what it took, or why it failed, is in its directory.

    Raises
    ------
    InputError
        If it changed the pack.
    """
    folder = out / name
    shutil.rmtree(folder, ignore_errors=True)
    case = folder / "case"
    shutil.copytree(chosen.directory(name), case)
    given = [w.replace("{case}", str(case)).replace("{out}", str(folder / FILE)) for w in words]
    metered = [sys.executable, "-I", "-S", meter.__file__, str(folder / USED), *given]
    ended = process.run(metered, cwd=folder, log=folder / LOG, limit_s=limit_s)
    used = read_json(folder / USED) or {"seconds": ended.seconds}
    error = ""
    if ended.timed_out:
        error = f"it did not end within {limit_s:g} s and was killed"
    elif used.get("returncode") != 0:
        said = process.last_words(folder / LOG)
        error = f"it ended with {used.get('returncode')}{said and f': {said}'}"
    elif _digests(case) != _digests(chosen.directory(name)):
        error = "it changed the files of its case"
    harm, other = watch.harm(), watch.restored()
    write_json(folder / USED, {**used, "error": harm or other or error})
    if harm:
        raise InputError(f"{name}: {harm}", where=str(chosen.root), remedy="export it again")


def _digests(folder: Path) -> dict[str, str]:
    return digest_files((path for path in folder.rglob("*") if path.is_file()), root=folder)


Mark = tuple[int, int] | None
"""When a file was written and how long it is; None where there is none."""


class _Watch:
    """The pack, and the answers that are there: no solver may touch them."""

    def __init__(self, chosen: Pack, out: Path) -> None:
        self.pack = chosen
        self.given = {path: _mark(path) for path in chosen.files()}
        self.answers: dict[Path, tuple[Mark, bytes]] = {}
        for path in (*out.glob(f"*/{FILE}"), *out.glob(f"{OURS}/*/{FILE}")):
            self.keep(path)

    def keep(self, answer: Path) -> None:
        """Watch over an answer from now on."""
        if answer.is_file():
            self.answers[answer] = _mark(answer), answer.read_bytes()

    def forget(self, answer: Path) -> None:
        """Let an answer be written anew."""
        self.answers.pop(answer, None)

    def harm(self) -> str:
        """How the pack was changed, or nothing."""
        now = {path: _mark(path) for path in (*self.given, *self.pack.files())}
        changed = {path for path, _ in set(now.items()) ^ set(self.given.items())}
        if not changed:
            return ""
        first = min(changed).relative_to(self.pack.root)
        return f"it changed {first} of the pack: the pack is not used further"

    def restored(self) -> str:
        """Put answers back that were changed; says which, or nothing."""
        changed = [path for path, (mark, _) in self.answers.items() if _mark(path) != mark]
        for path in changed:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(self.answers[path][1])
            self.keep(path)
        names = ", ".join(path.parent.name for path in changed)
        return f"it changed the answer of {names}, which was put back" if changed else ""


def _mark(path: Path) -> Mark:
    try:
        state = path.stat()
    except OSError:
        return None
    return state.st_mtime_ns, state.st_size


def _answer_ours(ours: Ours, name: str, folder: Path) -> None:
    table, took = ours.answer(name)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / FILE).write_text(csv(table), encoding="utf-8")
    known = {name: value for name, value in asdict(took).items() if value == value}
    write_json(folder / USED, known)
