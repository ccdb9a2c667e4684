"""The page of the small study, parts of it, and studies of several copies of its pile."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from matplotlib.axes import Axes

from orchestrator import report
from orchestrator.report import style
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.runs.files import Folder


@pytest.fixture(scope="session")
def page(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its page, with one failure reported, in a directory of the same name."""
    out = tmp_path_factory.mktemp("page") / results.cases.parent.name
    out.mkdir()
    (out / "cases").symlink_to(results.cases)
    return write(results, out, {next(iter(results.plan.cases)): "it <b>died</b>"})


@pytest.fixture(autouse=True)
def styled() -> Iterator[None]:
    with style.settings():
        yield


def write(results: Results, out: Path, failures: dict[str, str]) -> Path:
    report.write(results, failures, Folder(out))
    return out / report.PAGE


def changed(results: Results, **tables: pd.DataFrame) -> Results:
    return replace(results, tables={**results.tables, **tables})


def only(results: Results, bed: str) -> Results:
    """The part of a study with one kind of bed."""
    kept = results.scenes[results.scenes["bed"] == bed]
    chosen = {
        name: table[table["scene_id"].isin(kept["scene_id"])]
        for name, table in results.tables.items()
        if "scene_id" in table
    }
    stress = results.tables["wall_stress"] if bed == "pile" else pd.DataFrame()
    return replace(results, tables={**chosen, "wall_stress": stress})


def copies(results: Results, *changes: dict[str, Any]) -> Results:
    """The study's pile once for each set of changed columns, as a scene of its own."""
    heap = only(results, "pile")
    tables = dict(heap.tables)
    for name in (
        "scenes",
        "methods",
        "pile_threshold",
        "pile_curve",
        "pile_grain",
    ):
        own = tables[name]
        parts = [
            own.assign(
                scene_id=f"copy {n}", **{k: v for k, v in one.items() if k in own}
            )
            for n, one in enumerate(changes)
        ]
        tables[name] = pd.concat(parts, ignore_index=True)
    ids = [f"copy {n}" for n in range(len(changes))]
    (pile,) = results.plan.piles.values()
    decision = next(results.plan.decisions[name] for name in results.plan.piles)
    plan = replace(
        results.plan,
        piles=dict.fromkeys(ids, pile),
        decisions=dict.fromkeys(ids, decision),
    )
    return replace(heap, plan=plan, tables=tables)


def axes_of(figure: Figure) -> list[Axes]:
    """The panels of a figure, drawn."""
    assert figure.canvas
    figure.canvas.draw_without_rendering()
    return figure.canvas.axes


def legend_of(figure: Figure) -> list[str]:
    assert figure.canvas
    return [
        text.get_text() for legend in figure.canvas.legends for text in legend.texts
    ]
