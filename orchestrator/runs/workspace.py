"""A study's directory on disk: what it is called inside, which study it is."""

import csv
from collections.abc import Container
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator import __version__
from orchestrator.errors import InputError, OrchestratorError, of_system
from orchestrator.runs import lock
from orchestrator.runs.case import names_in
from orchestrator.runs.claim import LOCK, STUDY, Kind, claimed, told
from orchestrator.runs.files import opened, read_json, text_of
from orchestrator.runs.folder import Folder

STATE = "report.json"
"""Marker that what is drawn was finished, and of which cases."""
MARKERS = (STUDY.marker, STATE)
"""Files that are not made anew with tables, figures and page."""


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

    def held(self, kind: Kind, name: str, *, new: bool = True) -> AbstractContextManager[Folder]:
        """Hold the directory, as `claim.claimed` does."""
        return claimed(self.root, kind, name, new=new)

    def check_cases_of_tables(self, done: Container[str]) -> None:
        """See that the cases that the tables were made of are still done.

        Raises
        ------
        OrchestratorError
            If any is not: new tables would lack its results.
        """
        table = self.root / "timings" / "timings.csv"
        if not table.is_file():
            return
        with table.open(encoding="utf-8", newline="") as stream:
            names = [row.get("case", "") for row in csv.DictReader(stream)]
        lost = [name for name in names if name not in done]
        if lost:
            raise OrchestratorError(
                f"{len(lost)} of the {len(names)} cases that the tables were made of are not here "
                f"as this version makes them, {lost[0]} for one: the tables stay as they are",
                where=str(self.root),
                remedy="`orchestrator study` runs them again; to draw the others, first move "
                "tables and timings elsewhere",
            )

    def describe(self, kind: Kind, name: str, cases: list[str], **about: Any) -> None:
        """Say which study this is, and of which cases; only who holds the directory may.

        `about` is kept with it.
        """
        whose = {"orchestrator": __version__, "kind": kind.word, "name": name}
        value = {**whose, **about, "cases": cases}
        if told(self.root, kind) != value:
            self.folder.put(kind.marker, text_of(value))

    def description(self) -> dict[str, Any]:
        """Read the text that `describe` wrote.

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
        return tuple(name for name in names_in(self.cases) if name not in asked)

    def is_held(self) -> bool:
        """Whether a running process holds the study."""
        return lock.holder(self.root / LOCK) is not None


def _check_readable(path: Path) -> None:
    """See that a file that is there may be read: else it would count as none."""
    try:
        opened(path).close()
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
