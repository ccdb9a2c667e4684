"""State on disk: canonical JSON, digests, durable writing, and files of others."""

import contextlib
import errno
import hashlib
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
"""Name of the file with the digests of the files that were put.

`sha256sum` reads it. A line is added before its file is written: a killed process
leaves no file that is not listed.
"""
KEPT = "kept"
"""Directory for files that stand in the way and that this program did not write."""
_NO_LINKS = "remove the link; the directory as a whole may lie elsewhere: --out"
_LISTED = re.compile(r"(?m)^([0-9a-f]{64})  (.+)(?<!\.json)$")
"""A line of the record.

Former versions listed the markers, too, which are JSON.
"""


def canonical_json(value: Any) -> str:
    """Write a JSON value as its one text.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Its text: sorted keys, no spaces.

    Raises
    ------
    ValueError
        If a number is infinite or NaN.

    Examples
    --------
    >>> canonical_json({"b": 1.0, "a": [1, None]})
    '{"a":[1,null],"b":1.0}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def text_of(value: Any) -> str:
    """Write a JSON value as a file for people.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Its text: indented, with sorted keys.

    Raises
    ------
    ValueError
        If a number is infinite or NaN.
    """
    return json.dumps(value, indent=2, sort_keys=True, allow_nan=False) + "\n"


def digest_text(text: str) -> str:
    """Compute the SHA-256 of a text.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        Its digest, in hexadecimal.

    Examples
    --------
    >>> digest_text("a")[:12]
    'ca978112ca1b'
    """
    return hashlib.sha256(text.encode()).hexdigest()


def digest_file(path: Path) -> str:
    """Compute the SHA-256 of a file's content.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    str
        Its digest, in hexadecimal.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with opened(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_files(paths: Iterable[Path], *, root: Path) -> dict[str, str]:
    """Compute the SHA-256 of each of some files.

    Parameters
    ----------
    paths
        The files.
    root
        A directory that holds all of them.

    Returns
    -------
    dict
        Digests by path relative to `root`, in order.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    digests = {}
    for path in sorted(paths):
        digests[path.relative_to(root).as_posix()] = digest_file(path)
    return digests


def opened(path: Path) -> BufferedReader:
    """Open a file to read it.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    BufferedReader
        Its bytes.

    Raises
    ------
    OSError
        If it cannot be read, also for a pipe or a device, which might never end.
    """
    if path.is_fifo() or path.is_char_device():
        raise OSError(errno.EINVAL, "not a file", str(path))
    return path.open("rb")


def read_json(path: Path) -> dict[str, Any]:
    """Read the JSON object of a file that marks something as done.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    dict
        The object; empty where there is none that can be read: unreadable is undone.
    """
    try:
        with opened(path) as stream:
            value = json.load(stream)
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def write_durably(path: Path, content: str | bytes) -> None:
    """Replace a file in one step.

    A reader, or a crash, sees the old or the new content whole.

    Parameters
    ----------
    path
        The file.
    content
        Its new content.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
        # the name, too, survives a crash
        handle = os.open(path.parent, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)
    finally:
        temporary.unlink(missing_ok=True)


def state_of(path: Path) -> tuple[int, int, int]:
    """Tell a file from one that was written again at its path.

    With it a cache by the path of a file sees a case that was run again.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple of int
        Its number, its size, bytes, and the time of its change, ns.

    Raises
    ------
    OSError
        If there is no such file.
    """
    state = path.stat()
    return state.st_ino, state.st_size, state.st_mtime_ns


def size_of(path: Path) -> int:
    """Add up the size of a file, or of all files below a directory.

    Parameters
    ----------
    path
        The file or directory.

    Returns
    -------
    int
        Size, bytes. A file that vanishes meanwhile counts 0.
    """
    files = [path]
    if path.is_dir():
        files = _files_below(path)
    total = 0
    for file in files:
        with contextlib.suppress(OSError):
            total += file.lstat().st_size
    return total


def _files_below(directory: Path) -> list[Path]:
    """All files below a directory."""
    files = []
    for folder, _, names in os.walk(directory):
        files += [Path(folder, name) for name in names]
    return files


class Folder:
    """A directory that this program writes.

    It is the one way for files to get into the directory and out of it. Only files that
    this program wrote are replaced or removed. Anything else that stands in their place
    is moved to `KEPT` with a warning.

    Names are paths relative to the directory. A link in the way raises InputError; the
    directory itself may be one.

    Parameters
    ----------
    root
        The directory.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, name: str) -> Path:
        """Find the path of a name.

        Parameters
        ----------
        name
            A path relative to the directory, with slashes.

        Returns
        -------
        Path
            Its path.

        Raises
        ------
        InputError
            If the name leads out of the directory, or a part of it is a link.
        """
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            what = f"{name!r} leads out of the directory"
            raise InputError(what, where=str(self.root))
        path = self.root
        for part in parts:
            path = path / part
            if path.is_symlink():
                to = os.readlink(path)
                what = f"it is a link to {to}, and this program writes through none"
                raise InputError(what, where=str(path), remedy=_NO_LINKS)
        return path

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file in one step, and record it.

        A file of its name that was not put there is kept aside.

        Parameters
        ----------
        name
            Its path relative to the directory.
        content
            Its content.
        """
        data = content.encode() if isinstance(content, str) else content
        digest = hashlib.sha256(data).hexdigest()
        self._record([*self._listed(), (digest, name)])
        write_durably(self._place(name), data)

    def note(self, name: str, content: str | bytes) -> None:
        """Write a file whose name is this program's whatever it holds.

        It is not recorded.

        Parameters
        ----------
        name
            Its path relative to the directory.
        content
            Its content.
        """
        write_durably(self._place(name, is_ours=True), content)

    def drop(self, name: str) -> None:
        """Remove a file whose name is this program's whatever it holds.

        Parameters
        ----------
        name
            Its path relative to the directory.
        """
        self._place(name, is_ours=True).unlink(missing_ok=True)

    def clear(self, name: str, is_ours: Callable[[str], bool]) -> Path:
        """Make way for a sub-directory; files that are not ours are kept aside.

        Parameters
        ----------
        name
            Path of the sub-directory relative to the directory.
        is_ours
            Whether a file is this program's, by its path relative to the sub-directory.

        Returns
        -------
        Path
            The path of the sub-directory, which is not made.
        """
        path = self.path(name)
        for place, _, names in os.walk(path, topdown=False):
            for each in names:
                file = Path(place, each)
                if not file.is_symlink() and is_ours(file.relative_to(path).as_posix()):
                    file.unlink()
            # it stays while something is in it
            with contextlib.suppress(OSError):
                os.rmdir(place)
        return self._place(name)

    @contextlib.contextmanager
    def renewed(self) -> Iterator[None]:
        """Put all files anew within the block; those not put again are removed.

        A file that has changed since stays, and so do all where the block ends with an
        exception.

        Yields
        ------
        None
            While the files are put.
        """
        before = self._listed()
        yield
        new = self._listed()[len(before) :]
        names = {name for _, name in new}
        for digest, name in before:
            if name not in names and self._digest(name) == digest:
                self.drop(name)
        self._record(dict.fromkeys(new))

    def written(self) -> dict[str, str]:
        """List the files that were put.

        Returns
        -------
        dict
            Their digests by name.
        """
        return {name: digest for digest, name in self._listed()}

    def is_whole(self) -> bool:
        """Check that all files that were put are unchanged.

        Returns
        -------
        bool
            Whether they are.
        """
        written = self.written()
        return all(self._digest(name) == digest for name, digest in written.items())

    def read(self, name: str) -> bytes:
        """Read a file that was put.

        Parameters
        ----------
        name
            Its path relative to the directory.

        Returns
        -------
        bytes
            Its content.

        Raises
        ------
        OrchestratorError
            If it is not as it was put.
        OSError
            If it cannot be read.
        """
        path = self.path(name)
        data = path.read_bytes()
        if hashlib.sha256(data).hexdigest() != self.written().get(name):
            what = "it is not as it was written"
            remedy = "`orchestrator report` writes it again"
            raise OrchestratorError(what, where=str(path), remedy=remedy)
        return data

    def _place(self, name: str, *, is_ours: bool = False) -> Path:
        """The path of a name, free to be written.

        Its directory is made, and what is not this program's is moved away.
        """
        path = self.path(name)
        self._make_folders(path)
        # an empty directory is in nobody's way
        with contextlib.suppress(OSError):
            path.rmdir()
        is_put = is_ours or (self._digest(name), name) in self._listed()
        is_replaceable = is_put and path.is_file()
        if os.path.lexists(path) and not is_replaceable:
            self._keep(name)
        return path

    def _make_folders(self, path: Path) -> None:
        """Make the directories above a path; files in their place are moved away."""
        *folders, _ = path.relative_to(self.root).parents
        for folder in reversed(folders):
            place = self.root / folder
            if os.path.lexists(place) and not place.is_dir():
                self._keep(folder.as_posix())
            place.mkdir(exist_ok=True)

    def _keep(self, name: str) -> None:
        """Move something that is not this program's to a free place below `KEPT`."""
        kept = self._free_place(name)
        path = self.root / name
        path.rename(self.root / kept)
        what = f"{path} is not what this program wrote: it is kept as {kept}"
        warnings.warn(what, stacklevel=2)

    def _free_place(self, name: str) -> str:
        """A name below `KEPT`, or below the next of its kind, that nothing has."""
        count = 1
        while True:
            kept = KEPT if count == 1 else f"{KEPT}-{count}"
            count += 1
            place = self.path(f"{kept}/{name}")
            # a file that was kept before may stand where a directory is needed
            with contextlib.suppress(FileExistsError, NotADirectoryError):
                place.parent.mkdir(parents=True, exist_ok=True)
                if not os.path.lexists(place):
                    return f"{kept}/{name}"

    def _digest(self, name: str) -> str | None:
        """Digest of a file; None where it is missing or cannot be read."""
        try:
            return digest_file(self.path(name))
        except (OSError, InputError):
            return None

    def _listed(self) -> list[tuple[str, str]]:
        """Digests and names of the record, as far as it can be read."""
        record = self.path(RECORD)
        if not record.is_file():
            return []
        return _LISTED.findall(os.fsdecode(record.read_bytes()))

    def _record(self, lines: Iterable[tuple[str, str]]) -> None:
        """Write the record.

        A name has several lines while its file is being replaced.
        """
        text = "".join(f"{digest}  {name}\n" for digest, name in lines)
        self.note(RECORD, os.fsencode(text))
