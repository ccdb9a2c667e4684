"""A directory of results: whose it is, who holds it, how far its study came, what it can drop."""

import contextlib
import csv
import fcntl
import os
import socket
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock, Timeout

from orchestrator import __version__
from orchestrator.errors import InputError, OrchestratorError, of_system, printable
from orchestrator.runs import case as case_states
from orchestrator.runs import process
from orchestrator.runs.case import DONE, Case, failure, names_in, size
from orchestrator.runs.files import (
    RECORD,
    Folder,
    opened,
    read_json,
    remove_empty_directory,
    size_of,
    text_of,
)

LOCK = ".lock"
WAIT_S = 1.0
"""Time to wait for a lock that a dying process may still hold, s."""
NAMED = 5
"""Number of cases that are listed by name where an earlier study file asked for them."""


class Kind(NamedTuple):
    """A kind of directory that this program writes.

    `word` names its contents, such as "study". The JSON file `marker` states them, with "kind" and
    "name". `option` is how another directory is chosen.
    """

    word: str
    marker: str
    option: str = " with --out"


STUDY = Kind("study", "study.json")
EXPERIMENT = Kind("experiment", STUDY.marker)
RESULTS = Kind("benchmark of the solver", "benchmark.json")
COMPARISON = Kind("comparison with the pack", RESULTS.marker)
PACK = Kind("benchmark pack", "manifest.json", " as PACK")
KINDS = (STUDY, EXPERIMENT, RESULTS, COMPARISON, PACK)
STATE = "report.json"
"""Marker that what is drawn was finished, and of which cases."""
MARKERS = (STUDY.marker, STATE)
"""Files that are not made anew with tables, figures and page."""


@contextlib.contextmanager
def claimed(root: Path, kind: Kind, name: str, *, new: bool = True) -> Iterator[Folder]:
    """Make a directory, or take it up again, and hold it while the block runs.

    Parameters
    ----------
    root : Path
        The directory: new, empty, or of the same kind and name.
    kind : Kind
        Kind of its contents.
    name : str
        Name of its contents: of a study its name, of results their solver.
    new : bool, optional
        Whether a directory without a marker gets one.

    Raises
    ------
    InputError
        If the directory holds something else, which is named, or cannot be written, or if a
        link stands where this program writes.
    OrchestratorError
        If another process holds it, or the shell's limits are too low for any work.
    """
    if shortage := process.shortage():
        raise OrchestratorError(shortage)
    folder = Folder(root)
    with contextlib.ExitStack() as stack:
        try:
            root.mkdir(parents=True, exist_ok=True)
            _check(folder, kind, name)
            stack.enter_context(_held(folder.path(LOCK)))
        except OSError as error:
            raise InputError(
                f"the output directory cannot be used: {error.strerror or error}",
                where=str(error.filename or root),
                remedy=f"choose another{kind.option}",
            ) from None
        _check(folder, kind, name)  # another process may have been first
        if new and read_marker(root, kind) is None:
            folder.put(kind.marker, text_of({"kind": kind.word, "name": name}))
        yield folder


def read_marker(root: Path, kind: Kind) -> dict[str, Any] | None:
    """Content of the marker of a kind; None where there is none, or it is not this program's."""
    value = read_json(root / kind.marker)
    return value if isinstance(value, dict) and {"kind", "name"} <= value.keys() else None


def _check(folder: Folder, kind: Kind, name: str) -> None:
    """See that a directory holds nothing but what is claimed, and no links."""
    root = folder.root
    for other in KINDS:
        marker = read_marker(root, other)
        if marker and (marker["kind"], marker["name"]) != (kind.word, name):
            raise InputError(
                f"the directory holds the {marker['kind']} {marker['name']}, "
                f"not the {kind.word} {name}",
                where=str(root),
                remedy=f"choose another{kind.option}",
            )
    # a study whose marker is lost still has its cases
    has_cases = kind.marker == STUDY.marker and names_in(root / "cases")
    if read_marker(root, kind) is None and not has_cases:
        for path in sorted(root.iterdir()):
            # a claim that was ended at once leaves these
            is_nothing = path.name in (LOCK, RECORD) or path.name.endswith(".tmp")
            if path.is_dir() and not path.is_symlink():
                is_nothing = not any(path.iterdir())
            if not is_nothing:
                raise InputError(
                    f"the output directory holds something that is not a {kind.word}: {path.name}",
                    where=str(root),
                    remedy=f"choose an empty or a new one{kind.option}",
                )
    for place in (LOCK, RECORD, kind.marker, "cases", *folder.written()):
        folder.path(place)


@contextlib.contextmanager
def _held(path: Path) -> Iterator[None]:
    """Hold a lock file; the system frees it however this process ends.

    Raises
    ------
    OrchestratorError
        If another process holds it.
    """
    remove_empty_directory(path)
    lock = FileLock(path, timeout=WAIT_S)
    try:
        lock.acquire()
    except Timeout:
        holder = path.read_text(errors="replace").strip()
        raise OrchestratorError(
            f"it is in use by {holder or 'another process'}",
            where=str(path.parent),
            remedy="wait for its end, or choose another directory with --out",
        ) from None
    with lock:
        with contextlib.suppress(OSError):  # a full disk holds no note, but gives the lock
            path.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                os.truncate(path, 0)
            lock.release()


@dataclass(frozen=True)
class Workspace:
    """The directory that holds one study's cases, tables, figures and page."""

    root: Path

    @property
    def folder(self) -> Folder:
        """The way for files into it."""
        return Folder(self.root)

    @property
    def cases(self) -> Path:
        """The directory of the case directories."""
        return self.root / "cases"

    @property
    def page(self) -> Path:
        """The page."""
        return self.root / "report.html"

    @property
    def drawn(self) -> Path:
        """The file `STATE`."""
        return self.root / STATE

    def held(
        self, kind: Kind, name: str, *, new: bool = True
    ) -> contextlib.AbstractContextManager[Folder]:
        """Hold the directory, as `claimed` does."""
        return claimed(self.root, kind, name, new=new)

    def is_held(self) -> bool:
        """Whether a running process holds the study; nothing is written."""
        try:
            with opened(self.root / LOCK) as stream:
                fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            pass
        return False

    def describe(self, kind: Kind, name: str, cases: list[str], **about: Any) -> None:
        """Write which study this is, and of which cases; only the holder may.

        `about` is kept with it.
        """
        whose = {"orchestrator": __version__, "kind": kind.word, "name": name}
        value = {**whose, **about, "cases": cases}
        if read_marker(self.root, kind) != value:
            self.folder.put(kind.marker, text_of(value))

    def description(self) -> dict[str, Any]:
        """Read the text that `describe` wrote.

        Raises
        ------
        InputError
            If the directory holds no study.
        OrchestratorError
            If the text may not be read.
        """
        path = self.root / STUDY.marker
        try:
            opened(path).close()
        except PermissionError as error:
            raise of_system(error) from None
        except OSError:
            pass
        value = read_json(path)
        if isinstance(value, dict) and isinstance(value.get("cases"), list):
            texts = [value.get("name"), value.get("study", ""), *value["cases"]]
            if all(isinstance(text, str) for text in texts):
                return value
        raise InputError(
            "there is no study in this directory",
            where=str(self.root),
            remedy="name the directory that a study was written to",
        )

    def left(self, asked: Container[str]) -> tuple[str, ...]:
        """The cases that are there without being asked for: an earlier study file did."""
        return tuple(name for name in names_in(self.cases) if name not in asked)

    def check_cases_of_tables(self, done: Container[str]) -> None:
        """See that the cases that the tables were made of are still done.

        Raises
        ------
        OrchestratorError
            If any is not: new tables would lack its results.
        """
        table = self.root / "timings" / "timings.csv"
        if not table.is_file():
            return
        with table.open(encoding="utf-8", errors="replace", newline="") as stream:
            names = [row.get("case", "") for row in csv.DictReader(stream)]
        lost = [name for name in names if name not in done]
        if lost:
            raise OrchestratorError(
                f"{len(lost)} of the {len(names)} cases that the tables were made of are not here "
                f"as this version makes them, {lost[0]} for one: the tables stay as they are",
                where=str(self.root),
                remedy="`orchestrator study` runs them again; to draw the others, first move "
                "tables and timings elsewhere",
            )


@dataclass(frozen=True)
class Status:
    """How far a study came.

    `done`, `unfinished` and `waiting` (not begun) name cases; `failed` has those that failed with
    the cause, and `left` those of an earlier study file with their bytes. `sizes` are the bytes on
    disk by kind of case, and of tables, figures and page; those of a finished case are of the time
    when it ended, or was pruned. `page` is the page, once it is drawn; `running` is whether a
    process holds the study.
    """

    name: str
    running: bool
    done: tuple[str, ...]
    unfinished: tuple[str, ...]
    waiting: tuple[str, ...]
    failed: dict[str, str]
    page: Path | None
    sizes: dict[str, int]
    left: dict[str, int]


def status(directory: Path) -> Status:
    """Read from its directory alone how far a study came.

    Raises
    ------
    InputError
        If the directory holds no study.
    """
    space = Workspace(directory.absolute())
    about = space.description()
    states = ((name, read_json(space.cases / name / DONE)) for name in names_in(space.cases))
    markers = {name: state if isinstance(state, dict) else {} for name, state in states}
    begun = [name for name in about["cases"] if name in markers and not markers[name]]
    failed = {name: failure(space.cases / name) for name in begun}
    bytes_of = {name: size(space.cases / name, state) for name, state in markers.items()}
    sizes: dict[str, int] = {}
    for name, number in bytes_of.items():
        kind = f"{name.partition('-')[0]} cases"
        sizes[kind] = sizes.get(kind, 0) + number
    beside = (path for path in space.root.iterdir() if path != space.cases)
    sizes["tables, figures and page"] = sum(map(size_of, beside))
    return Status(
        name=about["name"],
        running=space.is_held(),
        done=tuple(name for name in about["cases"] if markers.get(name)),
        unfinished=tuple(name for name, cause in failed.items() if cause is None),
        waiting=tuple(name for name in about["cases"] if name not in markers),
        failed={name: cause for name, cause in failed.items() if cause is not None},
        page=space.page if space.drawn.is_file() and space.page.is_file() else None,
        sizes=sizes,
        left={name: bytes_of[name] for name in space.left(about["cases"])},
    )


def status_text(status: Status) -> str:
    """The status for people."""
    begun = "running" if status.running else "unfinished"
    lines = [
        f"study {status.name}: {len(status.done)} done, {len(status.unfinished)} {begun}, "
        f"{len(status.waiting)} not begun, {len(status.failed)} failed",
        *(f"  {begun}: {name}" for name in status.unfinished),
        *(f"  failed: {name}: {cause}" for name, cause in status.failed.items()),
        f"size: {_size_text(status.sizes)}",
    ]
    lines += _left_lines(status.left)
    if status.page:
        lines.append(f"page: {status.page}")
    elif not status.running:
        lines.append("the same study command continues it")
    return "\n".join(map(printable, lines))  # a study's name may come from anywhere


def prune(space: Workspace, done: Mapping[str, Case], shown: Container[str]) -> str:
    """Drop the bulky files of finished cases, but for those that a page shows.

    The inputs, and all that tables and page are made of, stay: ``./Allrun`` in a case makes the
    dropped files anew, and compares them with the digests of the first run.

    Parameters
    ----------
    space : Workspace
        Workspace of the study; held.
    done : mapping of str to Case
        The finished cases by name.
    shown : container of str
        Names of those that the page's pictures are drawn from.

    Returns
    -------
    str
        Summary for people, with the sizes before and after.
    """
    before = status(space.root).sizes
    pruned = [case for name, case in done.items() if name not in shown]
    for case in pruned:
        case_states.prune(case, space.cases)
    after = status(space.root)
    lines = [
        f"before: {_size_text(before)}",
        f"after:  {_size_text(after.sizes)}",
        f"pruned: {len(pruned)} cases; ./Allrun in one of them makes its files anew",
    ]
    if whole := [name for name in done if name in shown]:
        lines.append(f"whole, for the pictures of the page: {', '.join(whole)}")
    return "\n".join([*lines, *_left_lines(after.left)])


def _left_lines(left: Mapping[str, int]) -> list[str]:
    """The cases that are not asked for, for people, with their size."""
    if not left:
        return []
    named = ", ".join(list(left)[:NAMED]) + (", ..." if len(left) > NAMED else "")
    what = f"{len(left)} cases of an earlier study file, {_human(sum(left.values()))}: {named}"
    return [f"not asked for: {what}; they stay until you remove them"]


def _size_text(sizes: Mapping[str, int]) -> str:
    """Sizes for people: the total, then its parts, the largest first."""
    parts = sorted(sizes.items(), key=lambda item: -item[1])
    named = ", ".join(f"{_human(size)} {name}" for name, size in parts if size)
    return f"{_human(sum(sizes.values()))} ({named})"


def _human(size: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} GB"
