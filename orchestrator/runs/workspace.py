"""A directory of results: whose it is, who holds it, how far its study came."""

import contextlib
import csv
import os
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator import __version__
from orchestrator.errors import InputError, OrchestratorError, printable
from orchestrator.runs import case as case_states
from orchestrator.runs import files, locks, process, terminal
from orchestrator.runs.case import DONE, SAID, failure, names_in
from orchestrator.runs.files import (
    RECORD,
    Folder,
    canonical_json,
    digest_text,
    read_json,
)

LOCK = ".lock"


class DirectoryKind(NamedTuple):
    """A kind of contents of a directory.

    Attributes
    ----------
    word
        Its name for people.
    marker
        The JSON file that states the kind and the name of the contents.
    """

    word: str
    marker: str


STUDY = DirectoryKind("study", "study.json")
EXPERIMENT = DirectoryKind("experiment", STUDY.marker)
RESULTS = DirectoryKind("benchmark of the solver", "benchmark.json")
COMPARISON = DirectoryKind("comparison with the pack", RESULTS.marker)
PACK = DirectoryKind("benchmark pack", "manifest.json")
KINDS = (STUDY, EXPERIMENT, RESULTS, COMPARISON, PACK)
COMMANDS = {"surface": "study", "surfaces": "validate --surfaces PART"}
"""Commands of the experiments whose names are other ones."""
EPOCH = "SOURCE_DATE_EPOCH"
"""Variable with the date that pages have, s since 1970, as tools of reproducible builds
take it; without run times they are then the same bytes whenever they are made."""
STATE = "report.json"
"""Marker that what is drawn was finished, and of which cases."""


@contextlib.contextmanager
def claimed(
    root: Path, kind: DirectoryKind, name: str, *, new: bool = True
) -> Iterator[Folder]:
    """Make a directory for contents of a kind and a name, and hold it for a block.

    It may also be empty, or hold these contents already.

    Parameters
    ----------
    root
        The directory.
    kind, name
        Kind and name of the contents.
    new
        Whether a directory without a marker gets one.

    Yields
    ------
    Folder
        The directory.

    Raises
    ------
    InputError
        If it holds something else, cannot be written, or has a link where this program
        writes.
    OrchestratorError
        If another process holds it, or the shell's limits are low.
    """
    shortage = process.shortage()
    if shortage:
        raise OrchestratorError(shortage)
    folder = Folder(root)
    remedy = "wait for its end, or choose another directory with --out"
    held = locks.lock_held(root / LOCK, limit_s=locks.AT_ONCE_S, else_=remedy)
    holding = contextlib.ExitStack()
    try:
        root.mkdir(parents=True, exist_ok=True)
        _check(folder, kind, name)
        holding.enter_context(held)
    except OSError as error:
        what = f"the output directory cannot be used: {error.strerror or error}"
        where = str(error.filename or root)
        raise InputError(what, where, "choose another one: --out") from None
    with holding:
        _check(folder, kind, name)  # another process may have been first
        if new and not read_marker(root, kind):
            folder.note(kind.marker, files.text_of({"kind": kind.word, "name": name}))
        yield folder


def read_marker(root: Path, kind: DirectoryKind) -> dict[str, Any]:
    """Read the marker of a kind.

    Parameters
    ----------
    root
        The directory.
    kind
        The kind.

    Returns
    -------
    dict
        Its content; empty where there is none, or it is not this program's.
    """
    value = read_json(root / kind.marker)
    return value if {"kind", "name"} <= value.keys() else {}


def _check(folder: Folder, kind: DirectoryKind, name: str) -> None:
    """See that a directory holds nothing but what is claimed, and no links."""
    root = folder.root
    remedy = "choose an empty or a new one: --out"
    for other in KINDS:
        marker = read_marker(root, other)
        if marker and (marker["kind"], marker["name"]) != (kind.word, name):
            holds = f"the directory holds the {marker['kind']} {marker['name']}"
            raise InputError(f"{holds}, not the {kind.word} {name}", str(root), remedy)
    # a study whose marker is lost still has its cases
    has_cases = kind.marker == STUDY.marker and names_in(root / "cases")
    if not read_marker(root, kind) and not has_cases:
        for path in sorted(root.iterdir()):
            # a claim that was ended at once leaves these, and empty directories
            is_left = path.name in (LOCK, RECORD) or path.suffix == ".tmp"
            if not is_left and (not path.is_dir() or any(path.iterdir())):
                what = f"the output directory holds something that is not a {kind.word}"
                raise InputError(f"{what}: {path.name}", str(root), remedy)
    for place in (LOCK, RECORD, STATE, kind.marker, "cases", *folder.written()):
        folder.path(place)


class Workspace(Folder):
    """The directory of a study.

    Parameters
    ----------
    root
        The directory.

    Attributes
    ----------
    cases
        The directory of its cases.
    page
        The file of its page.
    drawn
        The marker `STATE`.
    """

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.cases = root / "cases"
        self.page = root / "report.html"
        self.drawn = root / STATE

    def is_held(self) -> bool:
        """Whether a running process holds the study.

        Returns
        -------
        bool
            Whether one does; nothing is written.
        """
        return locks.is_held(self.root / LOCK)

    def check(
        self, kind: DirectoryKind, name: str, source: Mapping[str, object]
    ) -> None:
        """Refuse a directory that `claimed` or `describe` refuse; write nothing.

        Parameters
        ----------
        kind, name
            Kind and name of the contents that are wanted.
        source
            What they are read from: `study.source.Source.described`.

        Raises
        ------
        InputError
            If it holds something else, or the same of another study file.
        """
        if self.root.is_dir():
            _check(self, kind, name)
            self._check_file(kind, name, source.get("file"))

    def describe(
        self,
        kind: DirectoryKind,
        name: str,
        cases: Iterable[str],
        source: Mapping[str, object],
        **question: Any,
    ) -> bool:
        """Write which study this is; only the holder may.

        Parameters
        ----------
        kind, name
            Kind and name of the contents.
        cases
            Names of its cases.
        source
            What it was read from: `study.source.Source.described`; empty for a study
            that was not read from a file.
        **question
            What else is asked.

        Returns
        -------
        bool
            Whether the directory held another question before.

        Raises
        ------
        InputError
            If the directory is of another study file, which is still there, and not of
            the same question.
        """
        before = read_marker(self.root, kind)
        asked_before = {key: before.get(key, question[key]) for key in question}
        changed = asked_before != question
        is_same = bool(question) and not changed
        if not is_same:
            self._check_file(kind, name, source.get("file"))
        is_resumed = not changed and before.get("source") == dict(source)
        begun = before.get("begun") if is_resumed else None
        value = {
            "orchestrator": __version__,
            "kind": kind.word,
            "name": name,
            "begun": begun or now(),
            "cases": [*cases],
            "source": dict(source),
            **question,
        }
        if before != value:
            self.note(kind.marker, files.text_of(value))
        return changed

    def _check_file(self, kind: DirectoryKind, name: str, file: object) -> None:
        """Refuse a directory of another study file, which is still there."""
        other = self._file_of_another(read_marker(self.root, kind), file)
        if other:
            holds = f"the directory holds the {kind.word} {name}"
            what = f"{holds} of another file, {other}"
            raise InputError(what, str(self.root), "choose another with --out")

    def _file_of_another(self, before: Mapping[str, Any], file: object) -> str:
        """The study file in a marker, if it is there and not the one asked for."""
        source = before.get("source")
        if not isinstance(source, dict):
            return ""
        other = str(source.get("file", ""))
        is_there = other != "" and (self.root / other).is_file()
        return other if is_there and other != file else ""

    def description(self) -> dict[str, Any]:
        """Read what `describe` wrote.

        Returns
        -------
        dict
            The description.

        Raises
        ------
        InputError
            If the directory holds no study.
        """
        about = read_json(self.root / STUDY.marker)
        names = about.get("cases")
        if isinstance(names, list):
            texts = (about.get("name"), about.get("study", ""), *names)
            if all(isinstance(text, str) for text in texts):
                return about
        remedy = "name the directory that a study was written to"
        raise InputError("there is no study in this directory", str(self.root), remedy)

    def _drawn_of(self, ids: Mapping[str, str]) -> dict[str, Any]:
        """All that a page of some cases is made of: digests, and the ids by name."""
        about = self.description()
        asked = [about.get(key) for key in ("study", "tolerance", "errors")]
        question = canonical_json(asked)
        return {
            "question": digest_text(question),
            "cases": dict(ids),
            "code": case_states.code_of_all(),
            "sha256": self.written(),
        }

    def answer(self, ids: Mapping[str, str]) -> str | None:
        """Look up the answer on the page of some cases.

        Parameters
        ----------
        ids
            The ids of the cases by name.

        Returns
        -------
        str, or None
            The answer; None where it is not finished, or has changed.
        """
        marker = read_json(self.drawn)
        if not marker or {**marker, **self._drawn_of(ids)} != marker:
            return None
        if not self.is_whole():
            return None
        return str(marker.get("answer", ""))

    def note_answer(self, ids: Mapping[str, str], answer: str) -> None:
        """Note that the page of some cases is finished, and what it answers.

        Parameters
        ----------
        ids
            The ids of the cases by name.
        answer
            The answer, which `answer` looks up.
        """
        self.note(STATE, files.text_of({**self._drawn_of(ids), "answer": answer}))

    def left(self, asked: Container[str]) -> tuple[str, ...]:
        """List the cases of an earlier study file.

        Parameters
        ----------
        asked
            Names of the cases that are asked for now.

        Returns
        -------
        tuple of str
            Names of the others that are there.
        """
        return tuple(name for name in names_in(self.cases) if name not in asked)

    def check_cases_of_tables(self, done: Container[str]) -> None:
        """Refuse to replace tables whose cases are not all done.

        Parameters
        ----------
        done
            Names of the cases that are done.

        Raises
        ------
        OrchestratorError
            If a case of the tables is not.
        """
        table = self.root / "timings" / "timings.csv"
        if not table.is_file():
            return
        text = table.read_text(encoding="utf-8", errors="replace")
        names = [row.get("case", "") for row in csv.DictReader(text.splitlines())]
        lost = [name for name in names if name not in done]
        if lost:
            share = f"{len(lost)} of the {len(names)} cases that they were made of"
            what = f"{share} are not here as this version makes them"
            what = f"the tables stay as they are: {what}"
            remedy = "to draw the others, move tables away"
            remedy = f"`orchestrator study` runs them again; {remedy}"
            raise OrchestratorError(what, str(self.root), remedy)


def other_results(root: Path, *parents: Path) -> tuple[Path, ...]:
    """List the other directories of studies and experiments beside one.

    Parameters
    ----------
    root
        The directory.
    *parents
        Directories that hold some, beside the one in which it lies.

    Returns
    -------
    tuple of Path
        Their absolute paths, sorted.
    """
    own = root.absolute()
    found: set[Path] = set()
    for parent in (own.parent, *(each.absolute() for each in parents)):
        found.update(marker.parent for marker in parent.glob(f"*/{STUDY.marker}"))
    return tuple(sorted(found - {own}))


def files_of(root: Path) -> list[str]:
    """Name the files that the study in a directory was made from.

    Parameters
    ----------
    root
        The directory.

    Returns
    -------
    list of str
        The names; empty if they are not known.
    """
    source = read_json(root / STUDY.marker).get("source")
    if not isinstance(source, dict):
        return []
    digests = source.get("sha256")
    return [*digests] if isinstance(digests, dict) else []


def finished(
    root: Path, name: str, source: Mapping[str, object]
) -> tuple[str, Path] | None:
    """The answer and the page of a study that is finished and has not changed.

    The study file is not read as a study, so no library of numbers is imported: it is
    told from the bytes that the study in the directory was made from.

    Parameters
    ----------
    root
        The directory of the study.
    name
        Its name.
    source
        What is asked for: `study.source.Source.described` of the files as they are now.

    Returns
    -------
    tuple, or None
        The answer and the file of the page; None where the source is another one, or a
        case, a table, a figure or this package may have changed since.
    """
    space = Workspace(root)
    about = read_json(root / STUDY.marker)
    ids = read_json(space.drawn).get("cases")
    if about.get("source") != source or not isinstance(ids, dict):
        return None
    try:
        _check(space, STUDY, name)
        answer = None if space.is_held() else space.answer(ids)
    except (OSError, OrchestratorError):
        return None
    if answer is None:
        return None
    for case, id_ in ids.items():
        if not case_states.marker_of(space.cases / case, id_):
            return None
    return answer, space.page


def status(directory: Path) -> tuple[str, bool]:
    """Tell how far a study came, from its directory alone.

    Parameters
    ----------
    directory
        The directory.

    Returns
    -------
    text : str
        How far it came, for people.
    has_failed : bool
        Whether a case has failed.
    """
    space = Workspace(directory.absolute())
    about = space.description()
    is_running = space.is_held()
    names = about["cases"]
    begun = [name for name in names if (space.cases / name).is_dir()]
    markers = {name: read_json(space.cases / name / DONE) for name in begun}
    undone = [name for name, marker in markers.items() if not marker]
    causes = _causes(undone, space.cases)
    unfinished = [name for name in undone if name not in causes]
    word = "running" if is_running else "unfinished"
    counts = [
        f"{len(begun) - len(undone)} done",
        f"{len(unfinished)} {word}",
        f"{len(names) - len(begun)} not begun",
        f"{len(causes)} failed",
    ]
    kind = STUDY if "study" in about else EXPERIMENT
    lines = [f"{kind.word} {about['name']}: {', '.join(counts)}"]
    if is_running:
        lines.append(f"running: {locks.holder(space.root / LOCK)}")
    lines += [f"  {word}: {name}" for name in unfinished]
    lines += [f"  failed: {name}: {cause}" for name, cause in causes.items()]
    lines += [f"  done: {each}" for each in _said(markers)]
    lines += terminal.fitted(_sizes(space, "size: ")).splitlines()
    # a run of an experiment ends with its page, and notes nothing of it
    is_drawn = not (unfinished or len(begun) < len(names))
    if kind is STUDY:
        is_drawn = space.drawn.is_file()
    if is_drawn and space.page.is_file():
        lines.append(f"page: {space.page}")
    elif not is_running:
        lines.append("the same command continues it")
    # a study's name may come from anywhere
    return "\n".join(map(printable, lines)), bool(causes)


def _causes(names: Iterable[str], cases: Path) -> dict[str, str]:
    """Why cases failed, by name; one that is not known to have failed is not there."""
    found = {name: failure(cases / name)[1] for name in names}
    return {name: cause for name, cause in found.items() if cause}


def _said(markers: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """What runs that did not go as planned say, by the markers of finished cases."""
    for name, marker in markers.items():
        if marker.get(SAID):
            yield f"{name}: {marker[SAID]}"


def prune_cases(
    space: Workspace, done: Mapping[str, str], shown: Container[str]
) -> str:
    """Drop the bulky files of the finished cases, but for those that the page shows.

    The inputs, and all that tables and page are made of, stay.

    Parameters
    ----------
    space
        The directory of the study, which the caller holds.
    done
        The ids of the cases by their names. One that is not done stays as it is.
    shown
        Names of the cases that the page shows.

    Returns
    -------
    str
        A summary for people.
    """
    before, *_ = _sizes(space, "before: ")
    pruned = []
    for name, identity in done.items():
        if name not in shown and case_states.prune_of(space.cases / name, identity):
            pruned.append(name)
    after, *left = _sizes(space, "after:  ")
    whole = ", ".join(name for name in done if name in shown)
    ran = f"pruned: {len(pruned)} cases; ./Allrun in one of them makes its files anew"
    shows = f"whole, for the pictures of the page: {whole or 'none'}"
    return terminal.fitted([before, after, ran, shows, *left])


def _sizes(space: Workspace, head: str) -> list[str]:
    """Bytes on disk, for people: by kind of case and of the rest, the largest first.

    The first line begins with a head. A second one has the cases that an earlier study
    file asked for, if any.
    """
    from rich.filesize import decimal

    cases = {name: files.size_of(space.cases / name) for name in names_in(space.cases)}
    kinds: Counter[str] = Counter()
    for name, count in cases.items():
        kinds[f"{name.partition('-')[0]} cases"] += count
    beside = [path for path in space.root.iterdir() if path != space.cases]
    kinds["tables, figures and page"] = sum(map(files.size_of, beside))
    named = []
    for kind, count in kinds.most_common():
        if count:
            named.append(f"{decimal(count)} {kind}")
    lines = [f"{head}{decimal(kinds.total())} ({', '.join(named)})"]
    left = space.left(space.description()["cases"])
    if left:
        total = decimal(sum(cases[name] for name in left))
        names = ", ".join(left[:5])
        what = f"{len(left)} cases of an earlier study file, {total}, such as {names}"
        lines.append(f"not asked for: {what}; they stay until you remove them")
    return lines


def is_dated() -> bool:
    """Whether `EPOCH` is set: pages are to be the same bytes whenever they are made.

    Returns
    -------
    bool
        Whether it is.
    """
    return EPOCH in os.environ


def now() -> str:
    """Tell the time to the minute, or that of `EPOCH`.

    Returns
    -------
    str
        The time in UTC.
    """
    time = datetime.now(UTC)
    if is_dated():
        time = datetime.fromtimestamp(int(os.environ[EPOCH]), UTC)
    return time.strftime("%Y-%m-%d %H:%M UTC")
