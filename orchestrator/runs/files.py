"""State on disk: canonical JSON, digests, writing that survives a crash, and files of others."""

import contextlib
import errno
import hashlib
import itertools
import json
import os
import re
import stat
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from io import BufferedReader
from pathlib import Path, PurePosixPath
from typing import Any

from orchestrator.errors import InputError, OrchestratorError, of_system


def canonical_json(value: Any) -> str:
    """The one text of a JSON value: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def text_of(value: Any) -> str:
    """A JSON value as a file for people: indented, with its keys sorted."""
    return json.dumps(value, indent=2, sort_keys=True, allow_nan=False) + "\n"


def digest_text(text: str) -> str:
    """SHA-256 of a text, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def digest_file(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal."""
    with opened(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_files(paths: Iterable[Path], *, root: Path) -> dict[str, str]:
    """Digest of each file, keyed by its path relative to `root`."""
    return {path.relative_to(root).as_posix(): digest_file(path) for path in sorted(paths)}


def opened(path: Path) -> BufferedReader:
    """Open a file to read it; a pipe or a device, which might never end, is refused.

    Raises
    ------
    OSError
        If it is not a file, or cannot be read.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "not a file", str(path))
    return os.fdopen(handle, "rb")


def read_json(path: Path) -> Any | None:
    """The file's value, or None where it is missing or cannot be read: unreadable is undone."""
    try:
        with opened(path) as stream:
            return json.load(stream)
    except (OSError, ValueError, RecursionError):
        return None


def write_json(path: Path, value: Any) -> None:
    """Write a JSON file durably, indented for people, with its keys sorted."""
    write_durably(path, text_of(value))


def write_durably(path: Path, content: str | bytes) -> None:
    """Replace a file as one step: a reader, or a crash, sees the old or the new content whole."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        remove_empty_directory(path)
        os.replace(temporary, path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    handle = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(handle)  # the name, too, survives a crash
    finally:
        os.close(handle)


def remove_empty_directory(path: Path) -> None:
    """Clear the way for a file where something has put a directory; one that holds files stays."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()


def size_of(path: Path) -> int:
    """Size of a file, or of all files below a directory, bytes; a file that vanishes counts 0."""
    if path.is_symlink() or not path.is_dir():
        return _size(path)
    files = (Path(folder) / name for folder, _, names in os.walk(path) for name in names)
    return sum(map(_size, files))


def _size(path: Path) -> int:
    try:
        return path.lstat().st_size
    except OSError:
        return 0


RECORD = "written.sha256"
"""Digests of the files that were put, as `sha256sum` reads them. A line is added before its file
is written: a killed process leaves no file that is not listed."""
KEPT = "kept"
"""Where files are moved that stand in the way and that this program did not write."""
TEMPORARY = re.compile(r"^\.(.+)\.\d+\.tmp$")
"""Pattern of files that a killed process was about to write, with their final names."""
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")

Ours = Callable[[str], bool]
"""Whether a file is this program's, from its name."""


class Folder:
    """A directory that this program writes: the one way for files to get into it and out of it.

    Only files that this program wrote are replaced or removed. Anything else that stands in their
    place is moved to `KEPT` with a warning, and no link is followed.

    Names are relative to the directory, with ``/`` between their parts. All methods raise
    InputError where a link stands in the way, naming it, and OrchestratorError where the system
    refuses.

    Parameters
    ----------
    root : Path
        The directory; it may itself be reached through a link.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file in one step; a file of its name that was not put there is kept aside."""
        data = content.encode() if isinstance(content, str) else content
        with self._naming(RECORD):
            record = self.path(RECORD)
            if not self._is_record():
                self._make_way(RECORD, lambda _: False)
            elif record.stat().st_nlink > 1:  # a second name of the file, in a backup, keeps it
                write_durably(record, record.read_bytes())
            with record.open("ab", buffering=0) as stream:
                stream.write(os.fsencode(f"{hashlib.sha256(data).hexdigest()}  {name}\n"))
        self._write(name, data, self._is_put)

    def note(self, name: str, content: str | bytes) -> None:
        """Write a file whose name is this program's whatever it holds; it is not recorded."""
        self._write(name, content, lambda _: True)

    def make(self, name: str) -> None:
        """Make a sub-directory if it is missing, before processes put files into it at once."""
        with self._naming(name):
            self._make(self.path(name))

    def drop(self, name: str) -> None:
        """Remove a file; one that was not put, or has changed since, is kept aside."""
        with self._naming(name):
            path = self.path(name)
            self._make_way(name, self._is_put)
            path.unlink(missing_ok=True)

    def clear(self, name: str, is_ours: Ours) -> Path:
        """Make way for a sub-directory; files of others in it are kept aside as they lie.

        Parameters
        ----------
        name : str
            The sub-directory.
        is_ours : callable
            Whether a file in it is this program's, by its path from there.

        Returns
        -------
        Path
            Its place, which is empty now, in a directory that exists.
        """
        with self._naming(name):
            path = self._reach(name)
            for place, _, files in os.walk(path, topdown=False):
                for file in (Path(place) / each for each in files):
                    if not file.is_symlink() and is_ours(file.relative_to(path).as_posix()):
                        file.unlink()
                with contextlib.suppress(OSError):
                    Path(place).rmdir()
            if os.path.lexists(path):
                self._keep(name)
        return path

    @contextlib.contextmanager
    def renewed(self, *places: str, but: Sequence[str] = ()) -> Iterator[None]:
        """Put all files anew within the block, except for `but`; files not put again are removed.

        Where places are named, only files of these names and in these sub-directories count. A
        file that has changed since it was put stays. If the block ends with an exception, nothing
        is removed.
        """
        before = list(dict.fromkeys(self._lines()))
        self._write_record(before)
        yield
        new = self._lines()[len(before) :]
        old = [
            (digest, name)
            for digest, name in before
            if name not in but and (not places or PurePosixPath(name).parts[0] in places)
        ]
        for digest, name in old:
            if name not in {name for _, name in new} and self._digest(name) == digest:
                self.drop(name)
        self._write_record([*(line for line in before if line not in old), *new])

    def read(self, name: str) -> bytes:
        """Read a file that was put.

        Raises
        ------
        OrchestratorError
            If it is not there as it was put.
        """
        with self._naming(name), opened(self.path(name)) as stream:
            data = stream.read()
        if hashlib.sha256(data).hexdigest() != self.written().get(name):
            raise OrchestratorError(
                "it is not as it was written",
                where=str(self.root / name),
                remedy="`orchestrator report` writes it again",
            )
        return data

    def written(self, but: Sequence[str] = ()) -> dict[str, str]:
        """Digests of all files that were put, except for `but`, by name."""
        return {name: digest for digest, name in self._lines() if name not in but}

    def is_whole(self, but: Sequence[str] = ()) -> bool:
        """Whether all files that were put, except for `but`, are unchanged."""
        return all(self._digest(name) == digest for name, digest in self.written(but).items())

    def path(self, name: str) -> Path:
        """The path of a name, no part of which is a link.

        Raises
        ------
        InputError
            Naming the link, or the name that leads out of the directory.
        """
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            raise InputError(f"{name!r} leads out of the directory", where=str(self.root))
        path = self.root
        for part in parts:
            path = path / part
            if path.is_symlink():
                raise InputError(
                    f"it is a link to {os.readlink(path)}, and this program writes through none",
                    where=str(path),
                    remedy="remove the link; the directory as a whole may lie elsewhere: --out",
                )
        return path

    def drop_temporaries(self, *names: str) -> None:
        """Remove the temporary files that a killed process left of some names and those put."""
        listed = {PurePosixPath(name) for name in (*names, *self.written())}
        for folder in {name.parent for name in listed}:
            for path in (self.root / folder).glob(".*.tmp"):
                target = TEMPORARY.fullmatch(path.name)
                if target and folder / target[1] in listed and _is_file(path):
                    path.unlink()

    def _write(self, name: str, content: str | bytes, is_ours: Ours) -> None:
        with self._naming(name):
            path = self._reach(name)
            self._make_way(name, is_ours)
            write_durably(path, content)

    def _reach(self, name: str) -> Path:
        """The path of a name, in a directory that exists."""
        path = self.path(name)
        for folder in reversed(PurePosixPath(name).parents[:-1]):
            self._make(self.root / folder)
        return path

    def _make(self, path: Path) -> None:
        if os.path.lexists(path) and not path.is_dir():
            self._keep(path.relative_to(self.root).as_posix())
        path.mkdir(exist_ok=True)

    def _make_way(self, name: str, is_ours: Ours) -> None:
        """Move away anything in a place but a file of this program or an empty directory."""
        path = self.root / name
        with contextlib.suppress(OSError):
            path.rmdir()
        if os.path.lexists(path) and not (path.is_file() and is_ours(name)):
            self._keep(name)

    def _keep(self, name: str) -> None:
        """Move something that is not this program's to a free place below `KEPT`."""
        for kept in itertools.chain([KEPT], (f"{KEPT}-{count}" for count in itertools.count(2))):
            place = self.path(f"{kept}/{name}")
            # a file that was kept before may stand where a directory is needed
            with contextlib.suppress(FileExistsError, NotADirectoryError):
                place.parent.mkdir(parents=True, exist_ok=True)
                if not os.path.lexists(place):
                    break
        (self.root / name).rename(place)
        what = f"{self.root / name} is not what this program wrote: it is kept as {kept}/{name}"
        warnings.warn(what, stacklevel=2)

    def _is_put(self, name: str) -> bool:
        return (self._digest(name), name) in self._lines()

    def _digest(self, name: str) -> str | None:
        """Digest of a file; None where it is missing or cannot be read."""
        try:
            return digest_file(self.path(name))
        except (OSError, InputError):
            return None

    def _lines(self) -> list[tuple[str, str]]:
        """Digests and names of the record, as far as it can be read."""
        return [(line[1], line[2]) for line in map(_LINE.fullmatch, self._text()) if line]

    def _text(self) -> list[str]:
        record = self.path(RECORD)
        return os.fsdecode(record.read_bytes()).split("\n") if _is_file(record) else []

    def _is_record(self) -> bool:
        """Whether the record's file holds lines of a record and nothing else."""
        return _is_file(self.root / RECORD) and all(
            not line or _LINE.fullmatch(line) for line in self._text()
        )

    def _write_record(self, lines: Iterable[tuple[str, str]]) -> None:
        text = "".join(f"{digest}  {name}\n" for digest, name in dict.fromkeys(lines))
        self._write(RECORD, os.fsencode(text), lambda _: self._is_record())

    @contextlib.contextmanager
    def _naming(self, name: str) -> Iterator[None]:
        """Name the file in an error of the system."""
        try:
            yield
        except OSError as error:
            raise of_system(error, str(self.root / name)) from None


def _is_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()
