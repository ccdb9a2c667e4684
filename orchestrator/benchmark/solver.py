"""A foreign solver: a scene goes in, an answer comes out, and nothing else does."""

import contextlib
import os
import re
import shlex
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from orchestrator.benchmark import answer
from orchestrator.benchmark.answer import FILE, AnswerError
from orchestrator.errors import InputError
from orchestrator.runs import confined
from orchestrator.runs.confined import Limits, Used
from orchestrator.runs.files import digest_file

OPERATORS = re.compile(r"[|&;<>]+|\d*>\S*|\S*;")
"""Words that mean something to a shell, and nothing to a program."""


@dataclass(frozen=True)
class Solved:
    """Outcome of a scene.

    Attributes
    ----------
    answer : bytes or None
        The file that the solver wrote, whatever it holds.
    used : Used
        What it took.
    error : str
        Why the answer does not count, or nothing.
    """

    answer: bytes | None
    used: Used
    error: str


@dataclass(frozen=True)
class Solver:
    """A program that answers scenes.

    Attributes
    ----------
    words : sequence of str
        Its command, with ``{case}`` and ``{out}``.
    limits : Limits
        What it may take for a scene.
    hidden : sequence of Path
        Directories that it must not see, as far as the system can hide them.
    """

    words: Sequence[str]
    limits: Limits
    hidden: Sequence[Path] = ()

    def __post_init__(self) -> None:
        """See that what it needs is not hidden from it.

        Raises
        ------
        InputError
            Naming what is.
        """
        for place in (*self.words, tempfile.gettempdir()):
            for path in self.hidden:
                if Path(place).resolve().is_relative_to(path):
                    raise InputError(
                        f"{place} lies in {path}, which is hidden from the solver",
                        where="--solver",
                        remedy="move it elsewhere, or name another directory with --out",
                    )

    def solve(self, scene: Path, log: Path) -> Solved:
        """Run it on a scene, in a directory of its own that is gone afterwards.

        Parameters
        ----------
        scene : Path
            The directory of the scene.
        log : Path
            Takes what it prints.
        """
        with _workplace() as work, _opened(work) as handle:
            case = work / "case"
            shutil.copytree(scene, case)
            given = {"{case}": str(case), "{out}": str(work / FILE)}
            command = [_filled(word, given) for word in self.words]
            used = confined.run(command, cwd=work, log=log, limits=self.limits, hide=self.hidden)
            error = used.broken or _ended_badly(used)
            if not error and not _is_same(case, scene):
                error = "it changed the files of its case"
            try:
                # by the directory's own handle: its name may lead elsewhere by now
                return Solved(answer.content(FILE, folder=handle), used, error)
            except AnswerError as wrong:
                return Solved(None, used, error or str(wrong))


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
    _check_words(words)
    return [str(Path(word).absolute()) if Path(word).is_file() else word for word in words]


def _check_words(words: Sequence[str]) -> None:
    """See that a command is one program with its arguments."""
    shell = next((word for word in words if OPERATORS.fullmatch(word)), None)
    if shell:
        raise InputError(
            f"no shell reads the command: {shell} would be an argument",
            where="--solver",
            remedy="put the line into a script, or write: sh -c '...'",
        )
    if shutil.which(words[0]) is None:
        there = os.path.isfile(words[0])
        raise InputError(
            f"{words[0]} may not be run" if there else f"there is no program {words[0]}",
            where="--solver",
            remedy=f"chmod +x {words[0]}" if there else "give its path",
        )


def _filled(word: str, given: dict[str, str]) -> str:
    for part, value in given.items():
        word = word.replace(part, value)
    return word


def _ended_badly(used: Used) -> str:
    if used.returncode == 0:
        return ""
    return f"it ended with {used.returncode}{used.said and f': {used.said}'}"


def _is_same(case: Path, scene: Path) -> bool:
    """Whether a directory holds the files of a scene and no others."""
    try:
        names = {*os.listdir(case)}
        return names == {*os.listdir(scene)} and all(
            _plain_size(case / name) == _plain_size(scene / name)
            and digest_file(case / name) == digest_file(scene / name)
            for name in names
        )
    except OSError:
        return False


def _plain_size(path: Path) -> int | None:
    state = path.lstat()
    return state.st_size if stat.S_ISREG(state.st_mode) else None


@contextlib.contextmanager
def _workplace() -> Iterator[Path]:
    """A fresh directory whose name says nothing; what was made of it is removed."""
    work = Path(tempfile.mkdtemp())
    try:
        yield work
    finally:
        # a program may have put a link in its place, closed it to its owner, or made it deeper
        # than Python can remove
        if not work.is_symlink():
            _clean("chmod", "-R", "u+rwX", "--", str(work))
        _clean("rm", "-rf", "--", str(work))


def _clean(*command: str) -> None:
    # the system's own, whatever PATH says
    subprocess.run(command, capture_output=True, env={"PATH": os.defpath})


@contextlib.contextmanager
def _opened(folder: Path) -> Iterator[int]:
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        yield handle
    finally:
        os.close(handle)
