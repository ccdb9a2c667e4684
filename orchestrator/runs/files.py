"""State on disk: canonical JSON, digests, writing that survives a crash, and files of others."""

import contextlib
import errno
import hashlib
import itertools
import json
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from io import BufferedReader
from pathlib import Path, PurePosixPath
from typing import Any

from orchestrator.errors import InputError, OrchestratorError

RECORD = "written.sha256"
"""Digests of the files that were put, as `sha256sum` reads them. A line is added before its file
is written: a killed process leaves no file that is not listed."""
KEPT = "kept"
"""Where files are moved that stand in the way and that this program did not write."""


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
    """SHA-256 of each file, by its path relative to `root`."""
    return {path.relative_to(root).as_posix(): digest_file(path) for path in sorted(paths)}


def opened(path: Path) -> BufferedReader:
    """Open a file to read it; OSError also for a pipe or a device, which might never end."""
    if path.is_fifo() or path.is_char_device():
        raise OSError(errno.EINVAL, "not a file", str(path))
    return path.open("rb")


def read_json(path: Path) -> dict[str, Any]:
    """The file's object; empty where there is none that can be read: unreadable is undone."""
    try:
        with opened(path) as stream:
            value = json.load(stream)
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def write_durably(path: Path, content: str | bytes) -> None:
    """Replace a file in one step: a reader, or a crash, sees the old or the new content whole."""
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
        handle = os.open(path.parent, os.O_RDONLY)
        os.fsync(handle)  # the name, too, survives a crash
        os.close(handle)
    finally:
        temporary.unlink(missing_ok=True)


def state_of(path: Path) -> tuple[int, int, int]:
    """Number, size (bytes) and time of change (ns) of a file: others once it is written again.

    With it a cache by the path of a file sees a case that was run again. Raises OSError if
    there is no such file.
    """
    state = path.stat()
    return state.st_ino, state.st_size, state.st_mtime_ns


def size_of(path: Path) -> int:
    """Size of a file, or of all files below a directory, bytes; a file that vanishes counts 0."""
    paths = (Path(folder, name) for folder, _, names in os.walk(path) for name in names)
    total = 0
    for file in paths if path.is_dir() else [path]:
        with contextlib.suppress(OSError):
            total += file.lstat().st_size
    return total


class Folder:
    """A directory that this program writes: the one way for files to get into it and out of it.

    Only files that this program wrote are replaced or removed. Anything else that stands in their
    place is moved to `KEPT` with a warning. Names are relative to `root`. A link in the way raises
    InputError; `root` itself may be one.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, name: str) -> Path:
        """The path of a name, no part of which is a link or leads out of the directory."""
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            raise InputError(f"{name!r} leads out of the directory", where=str(self.root))
        for path in itertools.accumulate(parts, Path.joinpath, initial=self.root):
            if path != self.root and path.is_symlink():
                what = f"it is a link to {os.readlink(path)}, and this program writes through none"
                remedy = "remove the link; the directory as a whole may lie elsewhere: --out"
                raise InputError(what, where=str(path), remedy=remedy)
        return path

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file in one step; a file of its name that was not put there is kept aside."""
        data = content.encode() if isinstance(content, str) else content
        self._record([*self._listed(), (hashlib.sha256(data).hexdigest(), name)])
        write_durably(self._place(name), data)

    def note(self, name: str, content: str | bytes) -> None:
        """Write a file whose name is this program's whatever it holds; it is not recorded."""
        write_durably(self._place(name, is_ours=True), content)

    def drop(self, name: str) -> None:
        """Remove a file whose name is this program's whatever it holds."""
        self._place(name, is_ours=True).unlink(missing_ok=True)

    def clear(self, name: str, is_ours: Callable[[str], bool]) -> Path:
        """Make way for a sub-directory: files that are not ours by their path in it are kept."""
        path = self.path(name)
        for place, _, files in os.walk(path, topdown=False):
            for file in (Path(place, each) for each in files):
                if not file.is_symlink() and is_ours(file.relative_to(path).as_posix()):
                    file.unlink()
            with contextlib.suppress(OSError):
                os.rmdir(place)
        return self._place(name)

    @contextlib.contextmanager
    def renewed(self) -> Iterator[None]:
        """Put all files anew within the block; files that are not put again are removed.

        A file that has changed since stays, and so do all where the block ends with an exception.
        """
        before = self._listed()
        yield
        new = self._listed()[len(before) :]
        again = {name for _, name in new}
        for digest, name in before:
            if name not in again and self._digest(name) == digest:
                self.drop(name)
        self._record(dict.fromkeys(new))

    def written(self) -> dict[str, str]:
        """Digests of all files that were put, by name."""
        return {name: digest for digest, name in self._listed()}

    def is_whole(self) -> bool:
        """Whether all files that were put are unchanged."""
        return all(self._digest(name) == digest for name, digest in self.written().items())

    def read(self, name: str) -> bytes:
        """Read a file that was put; OrchestratorError if it is not there as it was put."""
        path = self.path(name)
        data = path.read_bytes()
        if hashlib.sha256(data).hexdigest() != self.written().get(name):
            remedy = "`orchestrator report` writes it again"
            raise OrchestratorError("it is not as it was written", where=str(path), remedy=remedy)
        return data

    def _place(self, name: str, *, is_ours: bool = False) -> Path:
        """The path of a name, with its directory made; what is not this program's is moved away."""
        path = self.path(name)
        for folder in reversed(path.relative_to(self.root).parents[:-1]):
            if os.path.lexists(self.root / folder) and not (self.root / folder).is_dir():
                self._keep(folder.as_posix())
            (self.root / folder).mkdir(exist_ok=True)
        with contextlib.suppress(OSError):
            path.rmdir()
        is_put = is_ours or (self._digest(name), name) in self._listed()
        if os.path.lexists(path) and not (path.is_file() and is_put):
            self._keep(name)
        return path

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

    def _digest(self, name: str) -> str | None:
        """Digest of a file; None where it is missing or cannot be read."""
        try:
            return digest_file(self.path(name))
        except (OSError, InputError):
            return None

    def _listed(self) -> list[tuple[str, str]]:
        """Digests and names of the record, as far as it can be read."""
        record = self.path(RECORD)
        text = os.fsdecode(record.read_bytes()) if record.is_file() else ""
        # former versions listed the markers, too, which are JSON
        return re.findall(r"(?m)^([0-9a-f]{64})  (.+)(?<!\.json)$", text)

    def _record(self, lines: Iterable[tuple[str, str]]) -> None:
        """Write the record; a name has several lines while its file is being replaced."""
        self.note(RECORD, os.fsencode("".join(f"{digest}  {name}\n" for digest, name in lines)))
