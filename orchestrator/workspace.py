"""A study's directory on disk: whose it is, who holds it, what it is called inside."""

import contextlib
import fcntl
import os
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator import __version__
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.files import read_json, write_json

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
        """Make the directory this study's own, or take it up again; `about` is kept with it.

        Raises
        ------
        InputError
            If it holds something else or cannot be written.
        """
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            strange = any(self.root.iterdir()) and not self.is_study()
            if not strange:
                self.cases.mkdir(exist_ok=True)
                write_json(
                    self.root / MARKER,
                    {
                        "orchestrator": __version__,
                        "name": name,
                        **about,
                        "cases": cases,
                    },
                )
        except OSError as error:
            raise InputError(
                f"the output directory cannot be used: {error.strerror or error}",
                where=str(self.root),
                remedy="choose another with --out",
            ) from None
        if strange:
            raise InputError(
                "the output directory holds something that is not a study",
                where=str(self.root),
                remedy="choose an empty or a new one with --out",
            )

    def is_study(self) -> bool:
        """Whether the directory was made by `claim`, even if it was killed while it did."""
        known = {MARKER, LOCK, "cases"}
        names = {path.name for path in self.root.iterdir() if not path.name.endswith(".tmp")}
        return (self.root / MARKER).is_file() or names <= known

    def description(self) -> dict[str, Any]:
        """What `claim` wrote.

        Raises
        ------
        InputError
            If the directory holds no study.
        """
        value = read_json(self.root / MARKER)
        if not isinstance(value, dict) or not {"name", "cases"} <= value.keys():
            raise InputError(
                "there is no study in this directory",
                where=str(self.root),
                remedy="name the directory that a study was written to",
            )
        return value

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the study while it runs; the system lets go of it however this process ends.

        Raises
        ------
        OrchestratorError
            If another process holds it.
        """
        with (self.root / LOCK).open("a+", encoding="utf-8") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                stream.seek(0)
                holder = stream.read().strip() or "another process"
                raise OrchestratorError(
                    f"the study is being run by {holder}",
                    where=str(self.root),
                    remedy="wait for its end, or choose another directory with --out",
                ) from None
            stream.truncate(0)
            stream.write(f"process {os.getpid()} on {socket.gethostname()}\n")
            stream.flush()
            yield

    def is_held(self) -> bool:
        """Whether a running process holds the study."""
        try:
            with self.held():
                return False
        except OrchestratorError:
            return True
        except OSError:
            return False
