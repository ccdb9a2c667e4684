"""A study's directory on disk: whose it is, who holds it, what it is called inside."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator import __version__
from orchestrator.errors import InputError
from orchestrator.runs import lock
from orchestrator.runs.case import IDENTITY
from orchestrator.runs.files import read_json, write_json

MARKER = "study.json"
LOCK = ".lock"


@dataclass(frozen=True)
class Workspace:
    """The directory that holds one study's cases, tables, figures and page."""

    root: Path

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
        """Marker that tables, figures and page were finished, and of which cases."""
        return self.root / "report.json"

    def claim(self, name: str, cases: list[str], **about: Any) -> None:
        """Say which study this is, and of which cases; only who holds the directory may.

        `about` is kept with it.
        """
        # what a killed process was about to write
        for path in self.root.glob(".*.tmp"):
            path.unlink(missing_ok=True)
        write_json(
            self.root / MARKER,
            {"orchestrator": __version__, "name": name, **about, "cases": cases},
        )

    def is_study(self) -> bool:
        """Whether the directory was made by `held`, whatever was lost of it since then."""
        names = {path.name for path in self.root.iterdir() if not path.name.endswith(".tmp")}
        return (
            MARKER in names
            or names <= {LOCK, "cases"}
            or any(self.cases.glob(f"*-{'[0-9a-f]' * 12}/{IDENTITY}"))
        )

    def description(self) -> dict[str, Any]:
        """What `claim` wrote.

        Raises
        ------
        InputError
            If the directory holds no study.
        """
        value: Any = read_json(self.root / MARKER)
        if not _describes(value):
            raise InputError(
                "there is no study in this directory",
                where=str(self.root),
                remedy="name the directory that a study was written to",
            )
        return dict(value)

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Make the directory, or take it up again, and hold it while its study runs.

        Raises
        ------
        InputError
            If it holds something else or cannot be written.
        OrchestratorError
            If another process holds it.
        """
        self._enter()
        with lock.held(self.root / LOCK):
            yield

    def _enter(self) -> None:
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            ours = self.is_study()
            if ours:
                self.cases.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"the output directory cannot be used: {error.strerror or error}",
                where=str(self.root),
                remedy="choose another with --out",
            ) from None
        if not ours:
            raise InputError(
                "the output directory holds something that is not a study",
                where=str(self.root),
                remedy="choose an empty or a new one with --out",
            )

    def is_held(self) -> bool:
        """Whether a running process holds the study."""
        return lock.holder(self.root / LOCK) is not None


def _describes(value: Any) -> bool:
    try:
        texts = [value["name"], value.get("study", ""), *value["cases"]]
    except (AttributeError, KeyError, TypeError):
        return False
    return isinstance(value["cases"], list) and all(isinstance(text, str) for text in texts)
