"""The tables of an experiment as files."""

from collections.abc import Mapping

import pandas as pd

from orchestrator.runs.folder import Folder
from orchestrator.tables import text


def write(tables: Mapping[str, pd.DataFrame], folder: Folder) -> None:
    """Write each table as CSV into an experiment's directory."""
    for name, table in tables.items():
        folder.put(f"tables/{name}.csv", text.csv(table))
