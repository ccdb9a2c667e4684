"""A case directory: its identity, its files, how far it came, whatever the solver."""

import contextlib
import inspect
import os
import re
import stat
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar

from orchestrator.errors import SolverError
from orchestrator.runs import files
from orchestrator.runs.files import (
    PACKAGE,
    Folder,
    canonical_json,
    digest_text,
    read_json,
)

ROOMS: tuple[str, ...] = (
    "types.py",
    "errors.py",
    "extras.py",
    "digits.py",
    "runs",
    "solvers",
    "physics",
    "study",
    "bed",
    "flow",
    "grains",
)
"""Parts of the package that make cases, low to high: none imports one above it."""
NAME = re.compile(r"[a-z]+-[0-9a-f]{12}")
"""Name of a case's directory."""
IDENTITY = "case.json"
CODE = "code_sha256"
"""Key of the marker: the code by which inputs and tables are those of the case."""
SAID = "said"
"""Key of the marker: what `Case.said` said of the run."""
DONE = "done.json"
FAILED = "failed.json"
CHECKSUMS = "results.sha256"
LOG = "log.Allrun"
FILES = "files.txt"
"""Names of the files of a template, one a line. Others in its folder, such as those
that a run by hand leaves, are no part of it."""


def templates() -> Path:
    """Find the folder of the solvers' templates.

    Returns
    -------
    Path
        It lies beside the package, or inside it in a wheel.
    """
    return files.beside_package("templates")


@cache
def template_files(name: str) -> tuple[tuple[str, int, bytes], ...]:
    """Read the files of a template, once.

    Parameters
    ----------
    name
        Its folder below `templates`.

    Returns
    -------
    tuple
        Path in the template, mode and content of each file of its list `FILES`.
    """
    root = templates() / name
    found = []
    for part in (root / FILES).read_text(encoding="utf-8").splitlines():
        path = root / part
        mode = stat.S_IMODE(path.stat().st_mode)
        found.append((part, mode, path.read_bytes()))
    return tuple(found)


@cache
def code_of(kind: "type[Case]") -> str:
    """Compute one digest of the code and of the template that cases of a kind are of.

    Parameters
    ----------
    kind
        The class of the cases.

    Returns
    -------
    str
        SHA-256 of the names and contents of the files of the template, of the part of
        the package in which the class is, and of all parts of `ROOMS` below it: of
        code, and of the numbers that it reads.
    """
    module = Path(inspect.getfile(kind))
    own = module
    below = ROOMS
    if module.is_relative_to(PACKAGE):
        room = module.relative_to(PACKAGE).parts[0]
        own = PACKAGE / room
        below = ROOMS[: ROOMS.index(room)] if room in ROOMS else ROOMS
    return _digest_of([*(PACKAGE / part for part in below), own], [kind.template])


@cache
def code_of_all() -> str:
    """Compute one digest of the whole package and of all templates.

    Returns
    -------
    str
        SHA-256 as of `code_of`.
    """
    root = templates()
    lists = sorted(root.rglob(FILES))
    names = [path.parent.relative_to(root).as_posix() for path in lists]
    return _digest_of([PACKAGE], names)


def _digest_of(places: Iterable[Path], template_names: Iterable[str]) -> str:
    """One digest of files, of all files in folders, and of the files of templates."""
    digests = {}
    for place in places:
        inside = place.rglob("*") if place.is_dir() else [place]
        for path in inside:
            if path.is_file() and path.suffix != ".pyc":
                name = path.relative_to(place.parent).as_posix()
                digests[name] = files.digest_file(path)
    for template in template_names:
        for name, _, content in template_files(template):
            digests[f"{template}/{name}"] = sha256(content).hexdigest()
    return digest_text(canonical_json(digests))


class Case(ABC):
    """One run of a solver: its inputs, its results, and the tables made of them.

    A subclass is a frozen value. Its `parameters` and the cases that it needs are its
    identity, so two scenes that need the same run name the same directory. `write`
    makes its inputs of them, the solver makes the results of the inputs, and `collect`
    makes the tables of the results: as often as the code changes, without the solver.
    """

    kind: ClassVar[str]
    """First word of the directory's name."""
    template: ClassVar[str]
    """Folder below `templates/` that the directory starts as a copy of."""
    results: ClassVar[tuple[str, ...]]
    """Glob patterns of the files that a rerun by hand must reproduce byte for byte."""
    derived: ClassVar[tuple[str, ...]] = ()
    """Glob patterns of the tables that `collect` makes of the results."""
    bulky: ClassVar[tuple[str, ...]] = ()
    """Large files that the run leaves, and that nothing reads once the tables are made:
    `prune_case` drops them.

    Those that are no results may differ in their last digits from processor to
    processor.
    """
    needs_bulky: ClassVar[bool] = False
    """Whether its inputs are also made of bulky files of the cases that it needs."""

    @property
    @abstractmethod
    def parameters(self) -> dict[str, Any]:
        """All that the run depends on, as JSON; SI units."""

    @property
    @abstractmethod
    def cost_s(self) -> float:
        """Expected time of one core, s: for ordering and for the time left only."""

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with, and so the cores that it takes."""
        return 1

    @property
    def needs(self) -> tuple["Case", ...]:
        """The cases whose results this one's inputs are made of."""
        return ()

    def share(self, directory: Path) -> float:
        """Share of its work that a running case has done.

        Parameters
        ----------
        directory
            The case.

        Returns
        -------
        float
            The share, 0 to 1; 0 where it is not known.
        """
        return 0.0

    @abstractmethod
    def write(self, directory: Path, cases: Path) -> None:
        """Write parameter files, meshes and tables.

        Parameters
        ----------
        directory
            The case, a fresh copy of the template.
        cases
            The directory of all cases.
        """

    @abstractmethod
    def collect(self, directory: Path) -> None:
        """Make the tables of the results, also of a case that has them already.

        Parameters
        ----------
        directory
            The case.

        Raises
        ------
        SolverError
            If the results cannot be trusted, whatever the exit code.
        """

    def said(self, directory: Path) -> str:
        """Say what a reader of the answer must know of a run that ended well.

        Parameters
        ----------
        directory
            The case, after its run.

        Returns
        -------
        str
            The sentence, which the marker keeps; empty where all went as planned.
        """
        return ""

    @abstractmethod
    def versions(self) -> dict[str, str]:
        """The programs that run the case.

        Returns
        -------
        dict of str to str
            The version of each.
        """

    @cached_property
    def id(self) -> str:
        """Digest of what is asked of the solver: in which words is in no id."""
        depends = {
            "kind": self.kind,
            "parameters": self.parameters,
            "needs": [case.id for case in self.needs],
        }
        return digest_text(canonical_json(depends))

    @property
    def name(self) -> str:
        """Name of the case's directory."""
        return f"{self.kind}-{self.id[:12]}"


def prepare(case: Case, cases: Path) -> Path:
    """Make the case's directory afresh, with inputs and identity.

    What was in it is removed, whoever wrote it: a solver might read it.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.

    Returns
    -------
    Path
        Its directory.
    """
    cases.mkdir(parents=True, exist_ok=True)
    directory = Folder(cases.parent).clear(f"{cases.name}/{case.name}")
    directory.mkdir()
    inputs = inputs_written(case, directory, cases)
    identity = {
        "id": case.id,
        "kind": case.kind,
        "template": case.template,
        "parameters": case.parameters,
        "needs": [need.name for need in case.needs],
        "inputs_sha256": inputs,
        "programs": case.versions(),
    }
    (directory / IDENTITY).write_text(files.text_of(identity))
    return directory


def inputs_written(case: Case, directory: Path, cases: Path) -> dict[str, str]:
    """Write the template and the inputs of a case into an empty directory.

    Parameters
    ----------
    case
        The case.
    directory
        Where its files go.
    cases
        Directory of the cases that it needs.

    Returns
    -------
    dict
        SHA-256 of each file by its name.
    """
    for name, mode, content in template_files(case.template):
        (directory / name).parent.mkdir(parents=True, exist_ok=True)
        (directory / name).write_bytes(content)
        (directory / name).chmod(mode)
    case.write(directory, cases)
    written = [path for path in directory.rglob("*") if path.is_file()]
    return files.digest_files(written, root=directory)


def finish(case: Case, directory: Path, **times: float) -> None:
    """Write the marker, last of all files.

    It has the digests of the results and tables. It alone must survive a crash: what it
    names is compared with it.

    Parameters
    ----------
    case
        The case.
    directory
        Its directory.
    **times
        Times, s: ``solver_s``, ``cpu_s`` of a processor, and ``wall_s`` with Python's
        work.
    """
    results = _digests(directory, _matching(directory, case.results))
    bulky = _matching(directory, case.bulky)
    others = _digests(directory, [name for name in bulky if name not in results])
    sums = "".join(f"{digest}  {name}\n" for name, digest in results.items())
    (directory / CHECKSUMS).write_text(sums)
    marker = {
        "id": case.id,
        "ended": "done",
        SAID: case.said(directory),
        **times,
        "results_sha256": results,
        "others_sha256": others,
        "bulky": bulky,
        "stamps": _stamps(directory, {**results, **others}),
    }
    note_tables(case, directory, marker)


def note_tables(
    case: Case, directory: Path, marker: Mapping[str, Any]
) -> dict[str, Any]:
    """Write the marker with the tables that the present code has made of the results.

    Parameters
    ----------
    case
        The case.
    directory
        Its directory.
    marker
        The marker with the results.

    Returns
    -------
    dict
        The marker with both.
    """
    tables = _digests(directory, _matching(directory, case.derived))
    stamps = {**marker["stamps"], **_stamps(directory, tables)}
    noted = {
        **marker,
        "tables_sha256": tables,
        "stamps": stamps,
        CODE: code_of(type(case)),
    }
    files.write_durably(directory / DONE, files.text_of(noted))
    return noted


def fail(directory: Path, error: SolverError) -> None:
    """Leave a note of how and why a case failed; the next study run tries it again.

    Parameters
    ----------
    directory
        Its directory.
    error
        The failure.
    """
    if directory.is_dir():
        note = {"ended": error.ended, "cause": str(error)}
        files.write_durably(directory / FAILED, files.text_of(note))


def failure(directory: Path) -> tuple[str, str]:
    """In which way the case in a directory failed, and why.

    Parameters
    ----------
    directory
        Its directory.

    Returns
    -------
    ended, cause : str
        Both are empty if it is not known to have failed.
    """
    about = read_json(directory / FAILED)
    return str(about.get("ended", "")), str(about.get("cause", ""))


def said_of(directory: Path) -> str:
    """What the marker of a finished case says of its run.

    Parameters
    ----------
    directory
        Its directory.

    Returns
    -------
    str
        The sentence; empty where all went as planned.
    """
    return str(read_json(directory / DONE).get(SAID, ""))


def done_state(case: Case, cases: Path) -> dict[str, Any] | None:
    """The marker of a finished case of the present code.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.

    Returns
    -------
    dict, or None
        The marker; None where anything about the case cannot be trusted, or other code
        has written its inputs or made its tables.
    """
    state = marker_of(cases / case.name, case.id)
    return state if state and state.get(CODE) == code_of(type(case)) else None


def id_of(directory: Path) -> str:
    """Read the id of the case in a directory.

    Parameters
    ----------
    directory
        The directory of the case.

    Returns
    -------
    str
        The id; empty where there is no case.
    """
    return str(read_json(directory / IDENTITY).get("id", ""))


def marker_of(directory: Path, identity: str) -> dict[str, Any] | None:
    """The marker of the finished case of an id.

    Parameters
    ----------
    directory
        The directory of the case.
    identity
        The id of the case.

    Returns
    -------
    dict, or None
        The marker; None where anything about the case cannot be trusted.
    """
    state = run_of(directory, identity)
    if state is None:
        return None
    return state if _are_unchanged(directory, state, state["tables_sha256"]) else None


def run_of(directory: Path, identity: str) -> dict[str, Any] | None:
    """The marker of the case of an id whose solver has ended, whatever its tables are.

    A bulky file may be missing: `prune_case` drops it when the tables are made.

    Parameters
    ----------
    directory
        The directory of the case.
    identity
        The id of the case.

    Returns
    -------
    dict, or None
        The marker; None where anything about the results cannot be trusted.
    """
    about = read_json(directory / IDENTITY)
    state = read_json(directory / DONE)
    if not about.get("id") == state.get("id") == identity:
        return None
    results = state.get("results_sha256")
    if not results or "tables_sha256" not in state:
        return None
    made = {**results, **state["others_sha256"]}
    return state if _are_unchanged(directory, state, made) else None


def _are_unchanged(
    directory: Path, state: Mapping[str, Any], digests: Mapping[str, str]
) -> bool:
    """Whether files of a case are as its marker says; bulky ones may be missing."""
    try:
        marked = (directory / DONE).stat().st_mtime_ns
        for name, digest in digests.items():
            path = directory / name
            if name in state["bulky"] and not os.path.lexists(path):
                continue
            # Digests of a thousand piles are those of 7 GB: they are compared only if
            # size or time have changed. A file written in the same tick of the clock as
            # the marker may have changed since without a trace, so its digest decides.
            stamp = _stamp(path)
            untouched = stamp == state["stamps"].get(name) and stamp[1] < marked
            if not untouched and files.digest_file(path) != digest:
                return False
    except OSError:
        return False
    return True


def has_results(state: Mapping[str, Any], directory: Path) -> bool:
    """Whether a finished case has all of its results, of which tables are made.

    Parameters
    ----------
    state
        Its marker.
    directory
        Its directory.

    Returns
    -------
    bool
        Whether none of them was pruned.
    """
    return all((directory / name).is_file() for name in state["results_sha256"])


def is_whole(case: Case, cases: Path) -> bool:
    """Whether a case is done and has all of its files.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.

    Returns
    -------
    bool
        Whether no file was pruned, or a rerun made all anew.
    """
    directory = cases / case.name
    names = read_json(directory / DONE).get("stamps", [""])
    return all((directory / name).is_file() for name in names)


def digest_of_results(case: Case, cases: Path) -> str:
    """Compute one digest of the results of a case.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.

    Returns
    -------
    str
        SHA-256 of the list of their digests; empty where the case has not ended.
    """
    listed = cases / case.name / CHECKSUMS
    return files.digest_file(listed) if listed.is_file() else ""


def prune_case(case: Case, cases: Path) -> None:
    """Drop the bulky files that the run of a finished case left, no others.

    Their digests stay in the marker and in `CHECKSUMS`: a rerun by hand is still
    compared with the run that the tables were made of. No link is followed. A disk
    without any room is no obstacle.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.
    """
    prune_of(cases / case.name, case.id)


def prune_of(directory: Path, identity: str) -> bool:
    """Drop the bulky files of the finished case of an id, see `prune_case`.

    Parameters
    ----------
    directory
        The directory of the case.
    identity
        The id of the case.

    Returns
    -------
    bool
        Whether the case is done; one that is not stays as it is.
    """
    state = marker_of(directory, identity)
    if state is None:
        return False
    for name in _matching(directory, state.get("bulky", ())):
        (directory / name).unlink()
        with contextlib.suppress(OSError):  # it is not empty
            os.removedirs((directory / name).parent)
    return True


def names_in(cases: Path) -> list[str]:
    """Name the directories of cases, whichever study asked for them.

    Parameters
    ----------
    cases
        The directory of all cases.

    Returns
    -------
    list of str
        The names, sorted.
    """
    return sorted(path.name for path in cases.glob("*-*") if NAME.fullmatch(path.name))


def programs(cases: Path, names: Iterable[str]) -> dict[str, str]:
    """List the programs that some of the cases were made with.

    Parameters
    ----------
    cases
        The directory of all cases.
    names
        Names of the cases.

    Returns
    -------
    dict of str to str
        The version of each program.
    """
    versions: dict[str, str] = {}
    for name in sorted(names):
        versions |= read_json(cases / name / IDENTITY).get("programs", {})
    return versions


def _digests(directory: Path, names: Iterable[str]) -> dict[str, str]:
    """The SHA-256 digest of each of some files of a directory, by their names."""
    return {name: files.digest_file(directory / name) for name in names}


def _stamps(directory: Path, names: Iterable[str]) -> dict[str, list[int]]:
    """The `_stamp` of each of some files of a directory, by their names."""
    return {name: _stamp(directory / name) for name in names}


def _stamp(path: Path) -> list[int]:
    """Size, bytes, and time of the last change, ns."""
    state = path.stat()
    return [state.st_size, state.st_mtime_ns]


def _matching(directory: Path, patterns: Iterable[str]) -> list[str]:
    """Names of the files in a directory that fit a pattern; no link is followed."""
    found = []
    for folder, _, names in os.walk(directory):
        for file in names:
            path = os.path.join(folder, file)
            if os.path.isfile(path) and not os.path.islink(path):
                found.append(os.path.relpath(path, directory))
    return [name for name in sorted(found) if _fits(name, patterns)]


def _fits(name: str, patterns: Iterable[str]) -> bool:
    """Whether each part of a path fits that of a pattern."""
    parts = name.split("/")
    for pattern in patterns:
        wanted = pattern.split("/")
        if len(wanted) == len(parts) and all(map(fnmatchcase, parts, wanted)):
            return True
    return False
