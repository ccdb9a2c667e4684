"""Thresholds as JSON, for programs: a record for each point with an object for each law."""

import json
import math
from collections.abc import Iterator
from typing import Any

import pandas as pd

from orchestrator.calculator.parameters import PARAMETERS
from orchestrator.calculator.table import QUANTITIES
from orchestrator.physics.laws import LAWS
from orchestrator.physics.regime import LAWS_OF

COLUMNS = {one.name: one.column for one in QUANTITIES} | {"valid": "valid", "why_not": "why_not"}
GIVEN = {parameter.name: parameter.column for parameter in PARAMETERS}


def text(table: pd.DataFrame) -> str:
    """One record if there is one point; else a list of them, one on each line."""
    records = list(_records(table))
    if len(records) == 1:
        return json.dumps(records[0], indent=2, allow_nan=False)
    lines = ",\n".join(json.dumps(record, allow_nan=False) for record in records)
    return f"[\n{lines}\n]"


def _records(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Records of the points; what a point does not have is None, since JSON has no NaN."""
    rows = table.to_dict("records")
    for start in range(0, len(rows), len(LAWS)):
        point = rows[start : start + len(LAWS)]
        first = point[0]
        yield {
            "input": {name: _plain(first[column]) for name, column in GIVEN.items()},
            "regime": first["regime"],
            "paper": list(LAWS_OF[first["regime"]]),
            "answer": [row["law"] for row in point if row["answer"]],
            **{
                row["law"]: {name: _plain(row[column]) for name, column in COLUMNS.items()}
                for row in point
            },
        }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
