"""A study's directory on disk: what it is called inside, which study it is."""

import os
import re
from collections.abc import Container
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator import __version__
from orchestrator.errors import InputError, of_system
from orchestrator.runs import lock
from orchestrator.runs.claim import LOCK, STUDY, Kind, claimed
from orchestrator.runs.files import read_json, text_of
from orchestrator.runs.folder import Folder

DRAWN = ("tables", "timings", "figures", "report.html", "claims.csv")
"""What is drawn anew together."""
STATE = "report.json"
"""Marker that what is drawn was finished, and of which cases."""
CASE_NAME = re.compile(r"[a-z]+-[0-9a-f]{12}")


@dataclass(frozen=True)
class Workspace:
    """The directory that holds one study's cases, tables, figures and page."""

    root: Path

    @property
    def folder(self) -> Folder:
        """The way for files into it."""
        return Folder(self.root)

    @property
    def cases(self) -> Path:
        """Where the case directories are."""
        return self.root / "cases"

    @property
    def tables(self) -> Path:
        """Where the tables are."""
        return self.root / "tables"

    @property
    def page(self) -> Path:
        """The page."""
        return self.root / "report.html"

    @property
    def drawn(self) -> Path:
        """Where `STATE` is."""
        return self.root / STATE

    def held(self, kind: Kind, name: str) -> AbstractContextManager[Folder]:
        """Hold the directory, as `claim.claimed` does."""
        return claimed(self.root, kind, name)

    def describe(self, kind: Kind, name: str, cases: list[str], **about: Any) -> None:
        """Say which study this is, and of which cases; only who holds the directory may.

        `about` is kept with it.
        """
        told = {"orchestrator": __version__, "kind": kind.word, "name": name, **about}
        self.folder.note(kind.marker, text_of({**told, "cases": cases}))

    def description(self) -> dict[str, Any]:
        """What `describe` wrote.

        Raises
        ------
        InputError
            If the directory holds no study.
        """
        _check_readable(self.root / STUDY.marker)
        value: Any = read_json(self.root / STUDY.marker)
        if not _describes(value):
            raise InputError(
                "there is no study in this directory",
                where=str(self.root),
                remedy="name the directory that a study was written to",
            )
        return dict(value)

    def left(self, asked: Container[str]) -> tuple[str, ...]:
        """The cases that are there without being asked for: an earlier study file did."""
        return tuple(name for name in self.case_names() if name not in asked)

    def case_names(self) -> list[str]:
        """Names of the directories of cases that are there, whoever asked for them."""
        try:
            with os.scandir(self.cases) as entries:
                return sorted(one.name for one in entries if CASE_NAME.fullmatch(one.name))
        except (FileNotFoundError, NotADirectoryError):
            return []

    def is_held(self) -> bool:
        """Whether a running process holds the study."""
        return lock.holder(self.root / LOCK) is not None


def _check_readable(path: Path) -> None:
    """See that a file that is there may be read: else it would count as none."""
    try:
        path.open("rb").close()
    except PermissionError as error:
        raise of_system(error) from None
    except OSError:
        pass


def _describes(value: Any) -> bool:
    try:
        texts = [value["name"], value.get("study", ""), *value["cases"]]
    except (AttributeError, KeyError, TypeError):
        return False
    return isinstance(value["cases"], list) and all(isinstance(text, str) for text in texts)
