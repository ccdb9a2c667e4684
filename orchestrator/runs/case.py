"""A case directory: who it is, what it holds, how far it came. It knows nothing of any solver."""

import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, ClassVar

from orchestrator.errors import SolverError
from orchestrator.runs import assets
from orchestrator.runs.files import (
    canonical_json,
    digest_file,
    digest_files,
    digest_text,
    read_json,
    remove_empty_folders,
    size_of,
    write_durably,
    write_json,
)
from orchestrator.runs.folder import TEMPORARY, Folder

NAME = re.compile(r"[a-z]+-[0-9a-f]{12}")
"""Name of a case's directory."""
IDENTITY = "case.json"
DONE = "done.json"
FAILED = "failed.json"
CHECKSUMS = "results.sha256"
LOG = "log.Allrun"
STATE = (IDENTITY, DONE, FAILED, CHECKSUMS, LOG)


class Case(ABC):
    """One run of a solver: what it depends on, how its inputs are written, what its end means.

    A subclass is a frozen value. Its `parameters` and the template it copies are its identity,
    so two scenes that need the same run name the same directory.
    """

    kind: ClassVar[str]
    """Name of the kind, and first word of the directory's name."""
    template: ClassVar[str]
    """Folder below `templates/` that the directory starts as a copy of."""
    recipe: ClassVar[int]
    """Raised whenever the same parameters come to give other inputs or results."""
    results: ClassVar[tuple[str, ...]]
    """Glob patterns of the files that a rerun by hand must reproduce byte for byte."""
    derived: ClassVar[tuple[str, ...]] = ()
    """Tables that `collect` makes of the results; not the solver's own."""
    bulky: ClassVar[tuple[str, ...]] = ()
    """Large files that the run leaves and no table is made of: `prune` drops them."""
    made: ClassVar[tuple[str, ...]] = ()
    """Patterns of other files that a run writes or leaves; files that fit none are not its own."""

    @property
    @abstractmethod
    def parameters(self) -> dict[str, Any]:
        """All that the run depends on, as JSON; SI units."""

    @property
    @abstractmethod
    def cost_s(self) -> float:
        """Expected time of one core, s: for ordering and for the time left, nothing else."""

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with, and so the cores that it takes."""
        return 1

    def share(self, directory: Path) -> float:
        """Share of its work that a running case has done, 0 to 1; 0 where that is not known."""
        return 0.0

    @property
    def needs(self) -> tuple["Case", ...]:
        """The cases whose results this one's inputs are made of."""
        return ()

    @abstractmethod
    def write(self, directory: Path, cases: Path) -> None:
        """Write parameter files, meshes and tables into a fresh copy of the template."""

    @abstractmethod
    def collect(self, directory: Path) -> None:
        """Check how the run ended and derive its tables.

        Raises
        ------
        SolverError
            If the results cannot be trusted, whatever the exit code was.
        """

    @abstractmethod
    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""

    @cached_property
    def id(self) -> str:
        """Digest of all that the results depend on."""
        return digest_text(
            canonical_json(
                {
                    "kind": self.kind,
                    "recipe": self.recipe,
                    "template": assets.template_digest(self.template),
                    "parameters": self.parameters,
                    "needs": [case.id for case in self.needs],
                }
            )
        )

    @property
    def name(self) -> str:
        """Name of the case's directory."""
        return f"{self.kind}-{self.id[:12]}"


def prepare(case: Case, cases: Path) -> Path:
    """Make the case's directory afresh, inputs and identity, and return it.

    What an interrupted run left there is thrown away: it is never trusted half-written. What else
    lies there, an input that someone has changed too, is kept aside: a solver might read it.
    """
    cases.mkdir(parents=True, exist_ok=True)
    is_ours = _made_by(case, cases / case.name)
    directory = Folder(cases.parent).clear(f"{cases.name}/{case.name}", is_ours)
    assets.copy_template(case.template, directory)
    case.write(directory, cases)
    inputs = [path for path in directory.rglob("*") if path.is_file()]
    identity = {
        "id": case.id,
        "kind": case.kind,
        "recipe": case.recipe,
        "template": case.template,
        "template_sha256": assets.template_digest(case.template),
        "parameters": case.parameters,
        "needs": [need.name for need in case.needs],
        "inputs_sha256": digest_files(inputs, root=directory),
        "programs": case.versions(),
    }
    write_json(directory / IDENTITY, identity)
    return directory


def finish(case: Case, directory: Path, *, solver_s: float, cpu_s: float, wall_s: float) -> None:
    """Mark a case as done: the last file written, with digests of all that it vouches for."""
    results = digest_files(_matching(directory, case.results), root=directory)
    derived = digest_files(_matching(directory, case.derived), root=directory)
    bulky = (path.relative_to(directory).as_posix() for path in _matching(directory, case.bulky))
    stamps = {name: list(_stamp(directory / name)) for name in {*results, *derived, *bulky}}
    sums = "".join(f"{digest}  {name}\n" for name, digest in results.items())
    write_durably(directory / CHECKSUMS, sums)
    (directory / FAILED).unlink(missing_ok=True)
    write_json(
        directory / DONE,
        {
            "id": case.id,
            "ended": "done",
            "solver_s": solver_s,
            "cpu_s": cpu_s,
            "wall_s": wall_s,
            "results_sha256": results,
            "derived_sha256": derived,
            "stamps": stamps,
            "bytes": size_of(directory),
        },
    )


def fail(directory: Path, error: SolverError) -> None:
    """Leave a note of how and why a case failed; the next study run tries it again."""
    if directory.is_dir():
        write_json(directory / FAILED, {"ended": error.ended, "cause": str(error)})


def failure(directory: Path) -> str | None:
    """Why the case in a directory failed, or None if it is not known to have failed.

    The word for its end comes first where it says more than that it failed.
    """
    path = directory / FAILED
    if not os.path.isfile(path):  # nor where it cannot be seen
        return None
    state = read_json(path)
    if not isinstance(state, dict):
        return "its note of failure cannot be read"
    ended, cause = (str(state.get(key, "")) for key in ("ended", "cause"))
    return cause if ended in ("", SolverError.ended) else f"{ended}: {cause}"


def ended(directory: Path) -> tuple[str, str]:
    """In which way the case in a directory failed, and why; empty where it is not known to have."""
    state = read_json(directory / FAILED)
    if not isinstance(state, dict):
        return "", ""
    return str(state.get("ended", "")), str(state.get("cause", ""))


def is_done(case: Case, cases: Path) -> bool:
    """Whether the case's directory holds its finished results, unharmed."""
    return done_state(case, cases) is not None


def done_state(case: Case, cases: Path) -> dict[str, Any] | None:
    """The marker of a finished case, or None where anything about it cannot be trusted."""
    directory = cases / case.name
    identity, state = read_json(directory / IDENTITY), read_json(directory / DONE)
    if not isinstance(identity, dict) or identity.get("id") != case.id:
        return None
    if not isinstance(state, dict) or state.get("id") != case.id:
        return None
    return state if _vouched(case, directory, state) else None


def prune(case: Case, cases: Path) -> None:
    """Drop the bulky files of a case that is done: those that its run left, no others.

    Their digests stay in the marker and in `CHECKSUMS`: a rerun by hand is still compared with the
    run that the tables were made of. No link is followed. A disk without any room is no obstacle.
    """
    directory, state = cases / case.name, done_state(case, cases)
    if state is None:
        return
    left_by_run = {directory / name for name in state["stamps"]}
    files = [path for path in _matching(directory, case.bulky) if path in left_by_run]
    for path in files:
        path.unlink()
    remove_empty_folders(directory, (path.parent for path in files))
    marker = directory / DONE
    size_without_marker = size_of(directory) - marker.stat().st_size
    if state["bytes"] != size_without_marker:
        write_json(marker, {**state, "bytes": size_without_marker})


def size(directory: Path, state: Mapping[str, Any]) -> int:
    """Bytes on disk of the case in a directory, whose marker says what it came to at its end."""
    told = state.get("bytes")
    try:
        return told + (directory / DONE).stat().st_size if type(told) is int else size_of(directory)
    except OSError:
        return size_of(directory)


def is_whole(case: Case, cases: Path) -> bool:
    """Whether a case is done and has all of its files: none was pruned, or a rerun made it anew."""
    state = read_json(cases / case.name / DONE)
    if not isinstance(state, dict):
        return False
    return all((cases / case.name / name).is_file() for name in state.get("stamps", {}))


def names_in(cases: Path) -> list[str]:
    """Names of the directories of cases that are there, whoever asked for them."""
    try:
        return sorted(name for name in os.listdir(cases) if NAME.fullmatch(name))
    except (FileNotFoundError, NotADirectoryError):
        return []


def programs(cases: Path, names: Iterable[str]) -> dict[str, str]:
    """The programs, with versions, that some of the cases in a directory were made with."""
    found: dict[str, str] = {}
    for name in sorted(names):
        identity = read_json(cases / name / IDENTITY)
        found.update(identity.get("programs", {}) if isinstance(identity, dict) else {})
    return found


def _vouched(case: Case, directory: Path, state: dict[str, Any]) -> bool:
    """Whether the files of a case are those of its marker; bulky files may be missing."""
    digests, stamps = {**state["results_sha256"], **state["derived_sha256"]}, state["stamps"]
    try:
        marked = (directory / DONE).stat().st_mtime_ns
        return bool(digests) and all(
            (_fits(name, case.bulky) and not os.path.lexists(directory / name))
            or _untouched(directory / name, stamps.get(name), marked)
            or digest_file(directory / name) == digest
            for name, digest in digests.items()
        )
    except OSError:
        return False


def _stamp(path: Path) -> tuple[int, int]:
    """Size, bytes, and time of the last change, ns."""
    found = path.stat()
    return found.st_size, found.st_mtime_ns


def _untouched(path: Path, stamp: Any, marked: int) -> bool:
    """Whether a file is as it was when the case was marked as done, at that time in ns.

    Digests of a thousand piles are those of 7 GB. A file that was written in the same tick of the
    clock as the marker may have been changed since without a trace: its digest has to tell.
    """
    size, changed = _stamp(path)
    return [size, changed] == stamp and changed < marked


def _matching(directory: Path, patterns: tuple[str, ...]) -> list[Path]:
    """The files in a directory that fit a pattern; no link is followed."""
    walked = (Path(path) / file for path, _, files in os.walk(directory) for file in files)
    found = (path for path in walked if path.is_file() and not path.is_symlink())
    return sorted(path for path in found if _fits(path.relative_to(directory).as_posix(), patterns))


def _fits(name: str, patterns: Iterable[str]) -> bool:
    """Whether each part of a path fits that of a pattern."""
    parts = name.split("/")
    split = (pattern.split("/") for pattern in patterns)
    return any(len(one) == len(parts) and all(map(fnmatchcase, parts, one)) for one in split)


def _made_by(case: Case, directory: Path) -> Callable[[str], bool]:
    """Tell the files of a case's run, and its inputs as they were written, from all others."""
    told = read_json(directory / IDENTITY)
    inputs = told.get("inputs_sha256") if isinstance(told, dict) else None
    known = inputs if isinstance(inputs, dict) else {}
    patterns = (*STATE, *case.results, *case.derived, *case.bulky, *case.made)

    def is_ours(name: str) -> bool:
        if name in known and not _fits(name, case.made):
            return bool(known[name] == _digest(directory / name))
        path = PurePosixPath(name)
        meant = path.with_name(TEMPORARY.sub(r"\1", path.name)).as_posix()
        return meant in assets.template_names(case.template) or _fits(meant, patterns)

    return is_ours


def _digest(path: Path) -> str | None:
    try:
        return digest_file(path)
    except OSError:
        return None
