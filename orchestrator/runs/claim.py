"""Whose a directory is: it belongs to one thing of one kind, and one process holds it."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError
from orchestrator.runs import lock, process
from orchestrator.runs.files import read_json, text_of
from orchestrator.runs.folder import RECORD, Folder

LOCK = ".lock"


@dataclass(frozen=True)
class Kind:
    """A kind of directory that this program writes.

    Attributes
    ----------
    word : str
        What it holds: "study".
    marker : str
        The JSON file that says so, with "kind" and "name".
    names, many : tuple of str
        What else this program writes into it, by names and by patterns: none may be a link.
    traces : tuple of str
        Patterns of what only such a directory holds: it is known by them if its marker is lost.
    option : str
        How another directory is chosen.
    """

    word: str
    marker: str
    names: tuple[str, ...] = ()
    many: tuple[str, ...] = ()
    traces: tuple[str, ...] = ()
    option: str = " with --out"


_CASE = f"cases/*-{'[0-9a-f]' * 12}"
_OF_A_STUDY = ("cases", "tables", "timings", "figures", "report.html", "report.json")
STUDY = Kind("study", "study.json", _OF_A_STUDY, (_CASE,), (f"{_CASE}/case.json",))
EXPERIMENT = replace(STUDY, word="experiment")
_PAGE = ("figures", "comparison.html", "comparison.csv", "verdicts.csv")
RESULTS = Kind(
    "benchmark of the solver",
    "benchmark.json",
    (*_PAGE, "ours", "ours/cases"),
    ("[1-5]-*", "ours/[1-5]-*", f"ours/{_CASE}"),
)
COMPARISON = Kind("comparison with the pack", "benchmark.json", _PAGE)
PACK = Kind("benchmark pack", "manifest.json", option=" as PACK")
KINDS = (STUDY, EXPERIMENT, RESULTS, COMPARISON, PACK)


@contextlib.contextmanager
def claimed(root: Path, kind: Kind, name: str, *, new: bool = True) -> Iterator[Folder]:
    """Make a directory, or take it up again, and hold it while the block runs.

    Parameters
    ----------
    root : Path
        The directory: new, empty, or of the same kind and name.
    kind : Kind
        What is to be written there.
    name : str
        The one thing of that kind: of a study its name, of results their solver.
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
    for shortage in process.shortages():
        raise shortage
    folder = Folder(root)
    with contextlib.ExitStack() as stack:
        try:
            root.mkdir(parents=True, exist_ok=True)
            _check(folder, kind, name)
            stack.enter_context(lock.held(folder.path(LOCK)))
        except OSError as error:
            raise InputError(
                f"the output directory cannot be used: {error.strerror or error}",
                where=str(error.filename or root),
                remedy=f"choose another{kind.option}",
            ) from None
        _check(folder, kind, name)  # another process may have been first
        folder.drop_temporaries(LOCK, RECORD, kind.marker, *kind.names)
        if new and told(root, kind) is None:
            folder.put(kind.marker, text_of({"kind": kind.word, "name": name}))
        yield folder


def told(root: Path, kind: Kind) -> dict[str, Any] | None:
    """Content of the marker of a kind; None where there is none, or it is not this program's."""
    value = read_json(root / kind.marker)
    known = isinstance(value, dict) and {"kind", "name"} <= value.keys()
    return value if known else None


def _check(folder: Folder, kind: Kind, name: str) -> None:
    for other in KINDS:
        found = told(folder.root, other)
        if found and (found["kind"], found["name"]) != (kind.word, name):
            raise InputError(
                f"the directory holds the {found['kind']} {found['name']}, "
                f"not the {kind.word} {name}",
                where=str(folder.root),
                remedy=f"choose another{kind.option}",
            )
    if told(folder.root, kind) is None and not any(_matches(folder.root, kind.traces)):
        _check_empty(folder.root, kind)
    folder.refuse_links((LOCK, RECORD, kind.marker, *kind.names, *folder.written()))
    linked = (path for path in _matches(folder.root, kind.many) if path.is_symlink())
    folder.refuse_links(path.relative_to(folder.root).as_posix() for path in linked)


def _matches(root: Path, patterns: Sequence[str]) -> Iterator[Path]:
    return (path for pattern in patterns for path in root.glob(pattern))


def _check_empty(root: Path, kind: Kind) -> None:
    """See that a directory holds nothing but what a claim that was ended at once leaves."""
    with os.scandir(root) as entries:
        strange = sorted(entry.name for entry in entries if not _is_nothing(Path(entry.path)))
    if strange:
        raise InputError(
            f"the output directory holds something that is not a {kind.word}: {strange[0]}",
            where=str(root),
            remedy=f"choose an empty or a new one{kind.option}",
        )


def _is_nothing(path: Path) -> bool:
    """Whether it is the lock, a temporary file, or a directory without files."""
    if path.is_dir() and not path.is_symlink():
        return not any(path.iterdir())
    return path.name in (LOCK, RECORD) or path.name.endswith(".tmp")
