"""State on disk: canonical JSON, digests, and writing that survives a crash."""

import errno
import hashlib
import json
import os
import stat
from collections.abc import Iterable
from io import BufferedReader
from pathlib import Path
from typing import Any


def canonical_json(value: Any) -> str:
    """The one text of a JSON value: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


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
    sync_directory(path.parent)


def remove_empty_directory(path: Path) -> None:
    """Clear the way for a file where something has put a directory; one that holds files stays."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()


def remove_empty_folders(root: Path, folders: Iterable[Path]) -> None:
    """Remove those of some folders below `root` that are empty, and their parents if they are."""
    for folder in sorted({*folders}, reverse=True):
        while folder != root and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
            folder = folder.parent


def size_of(path: Path) -> int:
    """Size of a file, or all files below a directory, bytes; what vanishes does not count."""
    total = 0
    try:
        if path.is_symlink() or not path.is_dir():
            return path.lstat().st_size
        with os.scandir(path) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    total += size_of(Path(entry.path))
                else:
                    total += entry.stat(follow_symlinks=False).st_size
    except OSError:
        pass
    return total


def sync_directory(directory: Path) -> None:
    """Make the names in a directory durable."""
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_json(path: Path, value: Any) -> None:
    """Write a JSON file durably, indented for people, with its keys sorted."""
    write_durably(path, text_of(value))


def text_of(value: Any) -> str:
    """A JSON value as a file for people: indented, with its keys sorted."""
    return json.dumps(value, indent=2, sort_keys=True, allow_nan=False) + "\n"


def read_json(path: Path) -> Any | None:
    """The file's value, or None where it is missing or cannot be read: unreadable is undone."""
    try:
        with opened(path) as stream:
            return json.load(stream)
    except (OSError, ValueError, RecursionError):
        return None


def opened(path: Path) -> BufferedReader:
    """Open a file to read it; a pipe or a device, which might never end, is refused.

    Raises
    ------
    OSError
        If it is no file, or cannot be read.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "not a file", str(path))
    return os.fdopen(handle, "rb")
