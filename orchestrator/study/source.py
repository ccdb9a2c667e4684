"""Where a study comes from.

It is a preset by its name or a file, and the bytes it was read from. The files that a
study names are read here, too.

Nothing here imports a library: a finished study is told from its bytes in a tenth of a
second.
"""

import codecs
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator.errors import InputError, suggestion
from orchestrator.runs.files import digest_file, digest_text, opened

if TYPE_CHECKING:  # no file is read by what it loads
    from orchestrator.study.own_errors import OwnErrors

BEGIN = 256
"""Bytes by which the encoding of a file is told."""
AS_CSV = "save its sheet as CSV in UTF-8, and name that file"
UNPACK = "unpack it, and name the file in it"
NO_TEXT = {
    b"PK\x03\x04": ("it is a workbook of a spreadsheet, or an archive", AS_CSV),
    b"\xd0\xcf\x11\xe0": ("it is a workbook of a spreadsheet", AS_CSV),
    b"\x1f\x8b": ("it is compressed", UNPACK),
    b"%PDF": ("it is a PDF", "write its table as CSV"),
}
"""Files that are given in place of texts, by their first bytes."""


@dataclass(frozen=True)
class Source:
    """What a study was read from, byte for byte.

    Attributes
    ----------
    file
        Absolute path of the study file.
    digests
        SHA-256 of the study file, and of each file that it names, by their paths
        relative to the folder of the study file, of a folder that of the names in it;
        None for a file that is not there, whose text the study file brings itself.
    tolerance
        The tolerance that was given in place of the file's, if one was.
    errors
        The numerical errors in place of the package's, if any were given.
    """

    file: str
    digests: Mapping[str, str | None]
    tolerance: float | None = None
    errors: "OwnErrors | None" = None

    def described(self, root: Path) -> dict[str, object]:
        """The source as JSON, for a directory of results.

        The path of the study file is relative to that directory: a copy of both
        together is a study of its own.

        Parameters
        ----------
        root
            The directory of results.

        Returns
        -------
        dict
            The source as JSON.
        """
        file = os.path.relpath(self.file, root)
        found: dict[str, object] = {
            "file": file,
            "tolerance": self.tolerance,
            "sha256": dict(self.digests),
        }
        if self.errors:
            found["errors"] = self.errors.described(root)
        return found


def presets() -> dict[str, Path]:
    """List the study files that the package brings.

    Returns
    -------
    dict of str to Path
        The files by name.
    """
    files = Path(__file__).parents[1].glob("*/presets/*.toml")
    return {path.stem: path for path in sorted(files)}


def find(source: str | Path) -> Path:
    """Find the file of a study.

    Parameters
    ----------
    source
        The name of a preset, or the path of a file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is neither a preset of this name nor a file of this path.
    """
    brought = presets()
    path = brought.get(str(source), Path(source))
    if os.path.isfile(path):
        return path
    names = f"presets: {', '.join(brought)}; or give the path of a TOML file"
    remedy = f"{suggestion(str(source), brought)} {names}".lstrip()
    what = "there is no such study file, nor a preset of this name"
    raise InputError(what, str(source), remedy)


def read_bytes(path: Path, largest: int, where: str) -> bytes:
    """Read a file of the user.

    Parameters
    ----------
    path
        The file.
    largest
        Largest size, bytes.
    where
        Its name in messages.

    Returns
    -------
    bytes
        The content.

    Raises
    ------
    InputError
        For a file that is missing, no regular one, or larger.
    """
    try:
        with opened(path) as stream:
            content = stream.read(largest + 1) or b""  # None of a file that would wait
    except (OSError, ValueError) as error:
        raise _unreadable(error, where) from None
    if len(content) > largest:
        raise _unreadable(ValueError(f"larger than {largest // 2**20} MiB"), where)
    return content


def decoded(content: bytes, where: str, *, is_data: bool = False) -> str:
    """Decode a file of the user.

    UTF-8 and UTF-16 are told by their bytes. Tables of numbers may also be in the
    Western European code page of Windows, in which letters beyond ASCII stand in names
    and units alone.

    Parameters
    ----------
    content
        The content.
    where
        Its name in messages.
    is_data
        Whether it is a table of numbers; a study file is UTF-8 or UTF-16.

    Returns
    -------
    str
        The text.

    Raises
    ------
    InputError
        For any other content.
    """
    for mark, (what, remedy) in NO_TEXT.items():
        if content.startswith(mark):
            raise InputError(what, where, remedy)
    encoding = _encoding(content)
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        if not is_data or b"\0" in content:
            raise _undecoded(content, error.start, where) from None
        text = content.decode("cp1252", errors="replace")
    if "\0" in text:
        raise _unreadable(ValueError("binary, not text"), where)
    return text


def _encoding(content: bytes) -> str:
    """The encoding of a text by its first bytes: its mark, or where its zeros are."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        of_high, of_low = content[first:BEGIN:2], content[1 - first : BEGIN : 2]
        # the high bytes of digits and signs are zero, and no low one is
        if of_high and not of_high.strip(b"\0") and b"\0" not in of_low:
            return encoding
    # some editors begin with a mark of the encoding
    return "utf-8-sig"


def _undecoded(content: bytes, place: int, where: str) -> InputError:
    """The refusal of a content in which a place is no letter of its encoding."""
    encoding = _encoding(content)
    is_marked = encoding == "utf-16"
    if b"\0" in content and not is_marked:
        return _unreadable(ValueError("binary, not text"), where)
    name = "UTF-16" if is_marked else "UTF-8"
    line = content[:place].decode(encoding, errors="replace").count("\n") + 1
    what = f"its text has a letter that is not in {name}"
    return InputError(what, f"{where}: line {line}", "save the file as UTF-8")


def _unreadable(error: Exception, where: str) -> InputError:
    why = getattr(error, "strerror", None) or error
    remedy = "it is a text in UTF-8; a path in a study file is relative to that file"
    return InputError(f"not a readable text file: {why}", where, remedy)


def beds_in(folder: Path) -> list[str]:
    """List the files of profiles in a folder: .csv and .txt, section2 before section10.

    Parameters
    ----------
    folder
        The folder.

    Returns
    -------
    list of str
        Their names.

    Raises
    ------
    OSError
        For a folder that cannot be read.
    """
    names = [
        name
        for name in os.listdir(folder)
        if name.lower().endswith((".csv", ".txt")) and not name.startswith(".")
    ]
    return sorted(names, key=counted_names)


def counted_names(name: str) -> list[tuple[int, str]]:
    """Order names by the numbers in them, as people do.

    Parameters
    ----------
    name
        A name.

    Returns
    -------
    list of tuple
        What `sorted` compares.

    Examples
    --------
    >>> sorted(["b10", "b9", "a"], key=counted_names)
    ['a', 'b9', 'b10']
    """
    parts = re.split(r"(\d+)", name, flags=re.ASCII)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def digests_now(folder: Path, names: Iterable[str]) -> dict[str, str | None]:
    """Compute the digests of files as they are now.

    Parameters
    ----------
    folder
        The folder.
    names
        Paths of the files relative to it.

    Returns
    -------
    dict
        SHA-256 by path, of a folder that of the names in it; None for a file that is
        not there.

    Raises
    ------
    OSError
        For a file that cannot be read.
    """
    found: dict[str, str | None] = {}
    for name in names:
        path = folder / name
        if os.path.isdir(path):
            found[name] = digest_text("\n".join(beds_in(path)))
        else:
            found[name] = digest_file(path) if os.path.lexists(path) else None
    return found
