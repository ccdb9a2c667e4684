"""A directory that this program writes: the one way for files to get into it and out of it.

Whatever else lies there: only what this program wrote is replaced or removed, what stands in its
place is moved to `KEPT` and a line says so, and no link is followed.
"""

import contextlib
import hashlib
import itertools
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath

from orchestrator.errors import InputError, OrchestratorError, of_system
from orchestrator.runs.files import digest_file, opened, write_durably

RECORD = "written.sha256"
"""Digests of the files that were put, as `sha256sum` reads them. A line is added before its file
is written: a killed process leaves no file that nobody knows."""
KEPT = "kept"
"""Where things are moved that stand in the way and that this program did not write."""
TEMPORARY = re.compile(r"^\.(.+)\.\d+\.tmp$")
"""Pattern of files that a killed process was about to write, with their final names."""

LINE = re.compile(rb"([0-9a-f]{64})  (.+)")

Ours = Callable[[str], bool]
"""Whether a file is this program's, from its name."""
Line = tuple[str, str]
"""A line of the record: digest and name."""


class Folder:
    """A directory of this program's.

    Names are relative to it, with ``/`` between their parts. All methods raise InputError where
    a link stands in the way, naming it; those that write, OrchestratorError where the system
    refuses.

    Parameters
    ----------
    root : Path
        The directory; it may itself be reached through a link.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file in one step; one of its name that was not put there is kept aside."""
        data = content.encode() if isinstance(content, str) else content
        self._add([(hashlib.sha256(data).hexdigest(), name)])
        self._write(name, data, self._is_put)

    def note(self, name: str, content: str | bytes) -> None:
        """Write a file whose name is ours whatever it holds; it is not among those put."""
        self._write(name, content, lambda _: True)

    def make(self, name: str) -> None:
        """Make a sub-directory, if it is not there; before processes put files into it at once."""
        with self._told(name):
            self._reach(name)
            self._make(name)

    def drop(self, name: str) -> None:
        """Remove a file; one that was not put, or has changed since, is kept aside."""
        with self._told(name):
            path = self.path(name)
            self._make_way(name, self._is_put)
            path.unlink(missing_ok=True)

    def clear(self, name: str, is_ours: Ours) -> Path:
        """Make way for a sub-directory; what is not ours in it is kept aside as it lies.

        Parameters
        ----------
        name : str
            The sub-directory.
        is_ours : callable
            Whether a file in it is ours, by its path from there.

        Returns
        -------
        Path
            Where it goes: nothing is there now, in a directory that is.
        """
        with self._told(name):
            path = self._reach(name)
            _sweep(path, is_ours)
            if os.path.lexists(path):
                self._keep(name)
        return path

    @contextlib.contextmanager
    def renewed(self, *places: str, but: Sequence[str] = ()) -> Iterator[None]:
        """Put all files anew within the block, but some; those that were not are removed.

        Where places are named, it is about files of these names and in these sub-directories.
        A file that has changed since it was put stays. If the block ends with an exception,
        nothing is removed.
        """
        self._record(self._lines())
        before = self._lines()
        yield
        new = self._lines()[len(before) :]
        names = {name for _, name in new}
        old = {line for line in before if _is_among(line[1], places, but)}
        for digest, name in old:
            if name not in names and self._digest(name) == digest:
                self.drop(name)
        kept = [line for line in before if line not in old]
        self._record([*kept, *new])

    def read(self, name: str) -> bytes:
        """Read a file that was put.

        Raises
        ------
        OrchestratorError
            If it is not there as it was put.
        """
        with self._told(name), opened(self.path(name)) as stream:
            data = stream.read()
        if hashlib.sha256(data).hexdigest() != self.written().get(name):
            raise OrchestratorError(
                "it is not as it was written",
                where=str(self.root / name),
                remedy="`orchestrator report` writes it again",
            )
        return data

    def written(self, but: Sequence[str] = ()) -> dict[str, str]:
        """Digests of all files that were put, but some, by name."""
        return {name: digest for digest, name in self._lines() if name not in but}

    def is_whole(self, but: Sequence[str] = ()) -> bool:
        """Whether all files that were put, but some, are unchanged."""
        return all(self._digest(name) == digest for name, digest in self.written(but).items())

    def refuse_links(self, names: Iterable[str]) -> None:
        """See that no link is on the way to any of some names, nor at its end."""
        for name in names:
            self.path(name)

    def path(self, name: str) -> Path:
        """The path of a name that no link is on, in a directory or at the end of it.

        Raises
        ------
        InputError
            Naming the link, or the name that leads out of the directory.
        """
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            raise InputError(f"{name!r} leads out of the directory", where=str(self.root))
        for path in itertools.accumulate(parts, lambda one, part: one / part, initial=self.root):
            if path != self.root and path.is_symlink():
                raise InputError(
                    f"it is a link to {os.readlink(path)}, and this program writes through none",
                    where=str(path),
                    remedy="remove the link; the directory as a whole may lie elsewhere: --out",
                )
        return path

    def drop_temporaries(self, *names: str) -> None:
        """Remove what a killed process was about to write: of these names, and of those put."""
        known = {PurePosixPath(name) for name in (*names, *self.written())}
        for folder in {name.parent for name in known}:
            for path in (self.root / folder).glob(".*.tmp"):
                target = TEMPORARY.fullmatch(path.name)
                if target and folder / target[1] in known and _is_file(path):
                    path.unlink()

    def _write(self, name: str, content: str | bytes, is_ours: Ours) -> None:
        with self._told(name):
            path = self._reach(name)
            self._make_way(name, is_ours)
            write_durably(path, content)

    def _reach(self, name: str) -> Path:
        """The path of a name, in a directory that is there."""
        path = self.path(name)
        for folder in reversed(PurePosixPath(name).parents[:-1]):
            self._make(str(folder))
        return path

    def _make(self, name: str) -> None:
        path = self.root / name
        if os.path.lexists(path) and not path.is_dir():
            self._keep(name)
        path.mkdir(exist_ok=True)

    def _make_way(self, name: str, is_ours: Ours) -> None:
        """Move what stands in a place aside, unless it is a file of ours or an empty directory."""
        path = self.root / name
        with contextlib.suppress(OSError):
            path.rmdir()
        if os.path.lexists(path) and not (path.is_file() and is_ours(name)):
            self._keep(name)

    def _keep(self, name: str) -> None:
        """Move something that is not ours to a place where nothing is."""
        place = next(place for place in _places(name) if self._is_free(place))
        (self.root / name).rename(self.root / place)
        what = f"{self.root / name} is not what this program wrote: it is kept as {place}"
        warnings.warn(what, stacklevel=2)

    def _is_free(self, place: str) -> bool:
        """Whether something can be moved to a place; its directory is made."""
        goal = self.path(place)
        try:
            goal.parent.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):  # a file was kept there before
            return False
        return not os.path.lexists(goal)

    def _is_put(self, name: str) -> bool:
        return (self._digest(name), name) in set(self._lines())

    def _digest(self, name: str) -> str | None:
        """Digest of a file; None where there is none, or it cannot be read."""
        try:
            return digest_file(self.path(name))
        except (OSError, InputError):
            return None

    def _add(self, lines: Iterable[Line]) -> None:
        """Add to the record as one step: processes may do so side by side."""
        with self._told(RECORD):
            path = self.path(RECORD)
            if not _is_record(path):
                self._make_way(RECORD, lambda _: False)
            elif path.stat().st_nlink > 1:  # what is added must not reach its other name
                write_durably(path, path.read_bytes())
            with path.open("ab", buffering=0) as stream:
                stream.write(_text(lines))

    def _lines(self) -> list[Line]:
        """Entries of the record, as far as it can be read."""
        found = map(LINE.fullmatch, _content(self.path(RECORD)))
        return [(line[1].decode(), os.fsdecode(line[2])) for line in found if line]

    def _record(self, lines: Iterable[Line]) -> None:
        self._write(RECORD, _text(lines), lambda _: _is_record(self.root / RECORD))

    @contextlib.contextmanager
    def _told(self, name: str) -> Iterator[None]:
        """Say of what the system refuses which file it is about."""
        try:
            yield
        except OSError as error:
            raise of_system(error, str(self.root / name)) from None


def _text(lines: Iterable[Line]) -> bytes:
    """Lines of the record, each once; a name that is no line has none."""
    listed = (f"{digest}  {name}" for digest, name in lines if "\n" not in name)
    return b"".join(os.fsencode(line) + b"\n" for line in dict.fromkeys(listed))


def _content(record: Path) -> list[bytes]:
    return record.read_bytes().split(b"\n") if _is_file(record) else []


def _is_record(path: Path) -> bool:
    """Whether a file holds lines of a record and nothing else."""
    return _is_file(path) and all(not line or LINE.fullmatch(line) for line in _content(path))


def _is_among(name: str, places: Sequence[str], but: Sequence[str]) -> bool:
    return name not in but and (not places or PurePosixPath(name).parts[0] in places)


def _places(name: str) -> Iterator[str]:
    yield f"{KEPT}/{name}"
    yield from (f"{KEPT}-{count}/{name}" for count in itertools.count(2))


def _is_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


def _sweep(folder: Path, is_ours: Ours) -> None:
    """Remove the files of a directory that are ours, and what directories are empty then."""
    for path, _, files in os.walk(folder, topdown=False):
        for file in files:
            found = Path(path) / file
            if not found.is_symlink() and is_ours(found.relative_to(folder).as_posix()):
                found.unlink()
        with contextlib.suppress(OSError):
            Path(path).rmdir()
