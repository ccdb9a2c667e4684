"""The faults that were injected, and how many of them the study survived."""

import contextlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd


@dataclass
class Ledger:
    """Counts by fault and stage; a fault is survived when its test says nothing against it."""

    runs: Counter[tuple[str, str]] = field(default_factory=Counter)
    survived: Counter[tuple[str, str]] = field(default_factory=Counter)

    @contextlib.contextmanager
    def fault(self, name: str, stage: str) -> Iterator[None]:
        """Inject one fault, and see what becomes of the study, within the block."""
        self.runs[name, stage] += 1
        yield
        self.survived[name, stage] += 1

    def told(self) -> list[tuple[str, str, int, int]]:
        """Fault, stage, runs and survived, as one process tells them to another."""
        return [(*key, runs, self.survived[key]) for key, runs in self.runs.items()]

    def hear(self, told: list[tuple[str, str, int, int]]) -> None:
        """Add what another process tells."""
        for name, stage, runs, survived in told:
            self.runs[name, stage] += runs
            self.survived[name, stage] += survived

    def table(self) -> pd.DataFrame:
        """One row for each fault and stage, and the sum."""
        rows = [*self.told(), ("sum", "", self.runs.total(), self.survived.total())]
        return pd.DataFrame(rows, columns=["fault", "stage", "runs", "survived"])

    def write(self, folder: Path) -> Path:
        """Write the table as a file; give its path."""
        path = folder / "faults.csv"
        self.table().to_csv(path, index=False)
        return path
