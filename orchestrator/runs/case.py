"""A case directory: its identity, its files, how far it came, whatever the solver."""

import contextlib
import os
import re
import stat
from abc import ABC, abstractmethod
from collections.abc import Iterable
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

MAKERS = (
    "bed",
    "digits.py",
    "errors.py",
    "flow",
    "grains",
    "physics",
    "runs",
    "solvers",
    "study",
    "surface/across.py",
    "surface/case.py",
    "surface/epsg.py",
    "surface/heights.py",
    "surface/mesh.py",
    "surface/parts.py",
    "surface/points.py",
    "surface/raster.py",
    "surface/stress.py",
    "surface/study.py",
    "surface/truth.py",
    "types.py",
)
"""Parts of the package that make cases; the others only read them."""
NAME = re.compile(r"[a-z]+-[0-9a-f]{12}")
"""Name of a case's directory."""
IDENTITY = "case.json"
CODE = "code_sha256"
"""Key of the identity: the code that made the case, or that would make the same."""
DONE = "done.json"
FAILED = "failed.json"
CHECKSUMS = "results.sha256"
LOG = "log.Allrun"
GENERATED = (
    "[1-9]",
    "[1-9][0-9]",
    "[1-9][0-9][0-9]",
    "[1-9][0-9][0-9][0-9]",
    "log.*",
    "postProcessing",
    "polyMesh",
    "settling.csv",
    "going.csv",
    "samples.csv",
    "*.dump",
    "load_steps.csv",
    "bed_flow.csv",
    "column_flow.csv",
    "processor[0-9]*",
)
"""Files that a run by hand leaves in a template's own folder; no part of it."""


def templates() -> Path:
    """Find the folder of the solvers' templates.

    Returns
    -------
    Path
        It lies beside the package, or inside it in a wheel.
    """
    return files.beside("templates")


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
        Path in the template, mode and content of each file.
    """
    root = templates() / name
    found = []
    for path in sorted(path for path in root.rglob("*") if path.is_file()):
        parts = path.relative_to(root).parts
        if not any(map(_is_generated, parts)):
            mode = stat.S_IMODE(path.stat().st_mode)
            found.append(("/".join(parts), mode, path.read_bytes()))
    return tuple(found)


def _is_generated(part: str) -> bool:
    """Whether a run by hand leaves files or folders of this name."""
    return any(fnmatchcase(part, pattern) for pattern in GENERATED)


@cache
def _template_digest(name: str) -> str:
    """One digest of every file of a template, names included."""
    digests = {}
    for path, _, content in template_files(name):
        digests[path] = sha256(content).hexdigest()
    return digest_text(canonical_json(digests))


@cache
def code_digest() -> str:
    """Compute one digest of the code that makes cases.

    Returns
    -------
    str
        SHA-256 of the names and contents of all files of `MAKERS`: of the code, and of
        the numbers that it reads.
    """
    paths = []
    for part in MAKERS:
        place = PACKAGE / part
        inside = place.rglob("*") if place.is_dir() else [place]
        paths += [path for path in inside if path.is_file() and path.suffix != ".pyc"]
    digests = files.digest_files(paths, root=PACKAGE)
    return digest_text(canonical_json(digests))


class Case(ABC):
    """One run of a solver: what it depends on, its inputs, and what its end means.

    A subclass is a frozen value. Its `parameters` and its template are its identity, so
    two scenes that need the same run name the same directory.
    """

    kind: ClassVar[str]
    """First word of the directory's name."""
    template: ClassVar[str]
    """Folder below `templates/` that the directory starts as a copy of."""
    recipe: ClassVar[int]
    """Raised whenever the same parameters come to give other inputs or results."""
    results: ClassVar[tuple[str, ...]]
    """Glob patterns of the files that a rerun by hand must reproduce byte for byte."""
    derived: ClassVar[tuple[str, ...]] = ()
    """Tables that `collect` makes of the results; not the solver's own."""
    bulky: ClassVar[tuple[str, ...]] = ()
    """Large files that the run leaves, and that nothing reads when the tables are made:
    `prune` drops them.

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
        """Derive the tables.

        Parameters
        ----------
        directory
            The case.

        Raises
        ------
        SolverError
            If the results cannot be trusted, whatever the exit code.
        """

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
        """Digest of all that the results depend on."""
        depends = {
            "kind": self.kind,
            "recipe": self.recipe,
            "template": _template_digest(self.template),
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
        "recipe": case.recipe,
        "template": case.template,
        "template_sha256": _template_digest(case.template),
        "parameters": case.parameters,
        "needs": [need.name for need in case.needs],
        "inputs_sha256": inputs,
        CODE: code_digest(),
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
    derived = _digests(directory, _matching(directory, case.derived))
    bulky = _matching(directory, case.bulky)
    others = _digests(directory, [name for name in bulky if name not in results])
    sums = "".join(f"{digest}  {name}\n" for name, digest in results.items())
    (directory / CHECKSUMS).write_text(sums)
    stamps = {name: _stamp(directory / name) for name in {*results, *derived, *others}}
    marker = {
        "id": case.id,
        "ended": "done",
        **times,
        "results_sha256": results,
        "derived_sha256": derived,
        "others_sha256": others,
        "bulky": bulky,
        "stamps": stamps,
    }
    files.write_durably(directory / DONE, files.text_of(marker))


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


def done_state(case: Case, cases: Path) -> dict[str, Any] | None:
    """The marker of a finished case.

    Parameters
    ----------
    case
        The case.
    cases
        The directory of all cases.

    Returns
    -------
    dict, or None
        The marker; None where anything about the case cannot be trusted.
    """
    return marker_of(cases / case.name, case.id)


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

    A bulky file may be missing: `prune` drops it when the tables are made.

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
    about = read_json(directory / IDENTITY)
    state = read_json(directory / DONE)
    if not about.get("id") == state.get("id") == identity:
        return None
    made = {**state["results_sha256"], **state["derived_sha256"]}
    digests = {**made, **state.get("others_sha256", {})}
    bulky = state.get("bulky", ())
    stamps = state["stamps"]
    try:
        marked = (directory / DONE).stat().st_mtime_ns
        for name, digest in digests.items():
            path = directory / name
            if name in bulky and not os.path.lexists(path):
                continue
            # Digests of a thousand piles are those of 7 GB: they are compared only if
            # size or time have changed. A file written in the same tick of the clock as
            # the marker may have changed since without a trace, so its digest decides.
            size, changed = _stamp(path)
            untouched = [size, changed] == stamps.get(name) and changed < marked
            if not untouched and files.digest_file(path) != digest:
                return None
    except OSError:
        return None
    return state if made else None


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


def prune(case: Case, cases: Path) -> None:
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
    """Drop the bulky files of the finished case of an id, see `prune`.

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


def _stamp(path: Path) -> tuple[int, int]:
    """Size, bytes, and time of the last change, ns."""
    state = path.stat()
    return state.st_size, state.st_mtime_ns


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
