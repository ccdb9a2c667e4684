"""The page of the small study, and parts of it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import report, tables
from orchestrator.report import settings
from orchestrator.report.results import Results
from orchestrator.runs.files import Folder


@pytest.fixture(scope="session")
def page(results: Results) -> Path:
    """Its page, with one failure reported."""
    return write(results, results.cases.parent, {next(iter(results.plan.cases)): "it <b>died</b>"})


def write(results: Results, out: Path, failures: dict[str, str]) -> Path:
    times = tables.timings(results.plan, results.plan.done(results.cases))
    report.write(results, times, failures, Folder(out))
    return out / report.PAGE


def only(results: Results, bed: str) -> Results:
    """The part of a study with one kind of bed."""
    kept = results.scenes[results.scenes["bed"] == bed]
    chosen = {
        name: table[table["scene_id"].isin(kept["scene_id"])]
        for name, table in results.tables.items()
        if "scene_id" in table
    }
    stress = results.tables["wall_stress"]
    return replace(
        results, tables={**chosen, "wall_stress": stress if bed == "pile" else pd.DataFrame()}
    )


@pytest.fixture(autouse=True)
def styled() -> Iterator[None]:
    with settings.own():
        yield
