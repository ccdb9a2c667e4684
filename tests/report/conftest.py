"""One small study, run once: single grains in all regimes and a pile."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import plan, report, tables
from orchestrator.report import settings
from orchestrator.report.results import Results
from orchestrator.runs import engine
from orchestrator.runs.folder import Folder
from orchestrator.study import study

TITLE = """<script>alert(1)</script> & "sand" d'été"""
TEXT = f"""title = '''{TITLE}'''
protocol = {{ step = 0.02, quiet = 6.0 }}

[[group]]
name = "horizontal"
[group.axes]
"bed.entrainment_angle_deg" = [45.0, 60.0]
"bed.roughness" = ["d/10", "d/30"]
"fluid.viscosity" = [1e-5, 1e-3]
"grain.diameter" = [5e-5, 2e-4, 1e-3]

[[group]]
name = "slope"
bed = {{ slope_deg = 15.0 }}
[group.axes]
"grain.diameter" = [5e-5, 2e-4, 1e-3]

[[group]]
name = "pile"
bed = {{ kind = "pile", slope_deg = 15.0, height = 0.01, mobile_layers = 1 }}
protocol = {{ step = 0.05 }}
grain = {{ diameter = 1e-3 }}
# </pre><b>
"""


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The study with its finished cases, in a directory whose name asks for trouble."""
    out = tmp_path_factory.mktemp("study") / """grains d'été "1" & #2 %20"""
    (out / "cases").mkdir(parents=True)
    asked = study.parse(TEXT, name="small", where="test")
    planned = plan.make(asked)
    with engine.local(out / "cases", workers=2, limit_s=120.0) as pool:
        assert not engine.run(planned.cases, pool, lambda outcome: None)
    cases = out / "cases"
    made = tables.make(asked, planned, cases, planned.done(cases))
    return Results(asked, planned, made, out / "cases")


@pytest.fixture(scope="session")
def page(results: Results) -> Path:
    """Its page, with one failure reported."""
    return write(results, results.cases.parent, {next(iter(results.plan.cases)): "it <b>died</b>"})


def write(results: Results, out: Path, failures: dict[str, str]) -> Path:
    times = tables.timings(results.plan, results.plan.done(results.cases))
    report.write(results.study, results.plan, results.tables, times, failures, Folder(out))
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
