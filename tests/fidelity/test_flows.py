"""Flows that differ in their roughness alone: which are solved, and what they say of the others."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import pipeline, plan
from orchestrator.fidelity import flows
from orchestrator.fidelity.decision import as_written
from orchestrator.flow import between
from orchestrator.flow.stress import WallStress
from orchestrator.study import study

PILES = """
grain = {{ diameter = 1e-3 }}
forces = {{ law = "high" }}
bed = {{ kind = "pile", height = 0.014, slope_deg = 20.0{more} }}
method.kind = "{kind}"
method.flow.cells_per_face = 20
[axes]
"bed.roughness" = {roughnesses}
"""
ROUGHNESSES = [3.3e-5, 4e-5, 5e-5, 5.5e-5, 6e-5, 7e-5, 8.5e-5, 1e-4]


def asked(
    tolerance: float | None = 0.2, more: str = "", kind: str = "pivot"
) -> study.Study:
    text = PILES.format(more=more, kind=kind, roughnesses=ROUGHNESSES)
    made = study.parse(text, name="piles", where="test")
    return replace(made, tolerance=tolerance)


def solved_of(made: plan.Plan) -> list[float]:
    kinds = [case for case in made.cases.values() if case.kind == "flow"]
    return sorted(float(case.parameters["roughness"]) for case in kinds)


def put_of(made: plan.Plan) -> list[float]:
    every = made.decisions.values()
    put = [each.scene for each in every if each.scene.method.flow.between]
    return sorted(scene.bed.roughness for scene in put)


def test_within_a_tolerance_some_are_solved_and_the_others_lie_between() -> None:
    made = plan.make(asked())
    assert solved_of(made) == list(between.nodes(ROUGHNESSES))
    assert sorted(solved_of(made) + put_of(made)) == ROUGHNESSES
    assert len(flows.lying(made.decisions.values())) == len(put_of(made)) == 3
    told = [*plan.forecast(asked(), Path("none"), 1)]
    (line,) = [each for each in told if "3 flows lie between solved ones" in each]
    # and what they cost if they are solved after all
    assert re.search(r"solved too if .*: \d+ s more$", line)


def test_without_a_tolerance_all_are_solved() -> None:
    made = plan.make(asked(tolerance=None))
    assert solved_of(made) == ROUGHNESSES
    assert not put_of(made)


@pytest.mark.parametrize("more", [', counted = "all"', ", counted = [0.01, 0.02]"])
def test_where_grains_in_the_wake_count_all_are_solved(more: str) -> None:
    assert solved_of(plan.make(asked(more=more))) == ROUGHNESSES


def test_a_pile_by_dem_needs_the_flows_that_its_own_lies_between() -> None:
    scenes = asked(None, kind="dem").scenes
    written = {scene.id: as_written(scene) for scene in scenes}
    answers, _ = flows.shared(written, {})
    made = plan.of(answers)
    piles = [each for each in made.piles.values() if each.model.is_between]
    for pile in piles:
        needs = {need.name for need in pile.case.needs}
        assert needs == {flow.name for flow in pile.model.cases}
        listed = pile.case.parameters["method"]["flow"]["between"]
        assert listed == [flow.roughness_m for flow in pile.model.cases]
    assert piles


@pytest.mark.parametrize("bump", [0.0, 0.03])
def test_finished_flows_decide_whether_the_others_are_solved(
    bump: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One solved flow that is off by 3 % is no point of a smooth curve."""
    made = plan.make(asked())
    read = WallStress(*np.ones((7, 20)))
    rises = replace(read, x_m=np.arange(20.0), z_m=np.arange(20.0))
    nodes = solved_of(made)
    stress = {z0: replace(rises, tau_wall=read.tau_wall * 2) for z0 in nodes}
    stress[nodes[1]] = replace(rises, tau_wall=read.tau_wall * 2 * (1 + bump))
    by_name = {}
    for case in made.cases.values():
        by_name[case.name] = stress[float(case.parameters["roughness"])]
    monkeypatch.setattr(flows, "done_state", lambda *_: {"ended": "done"})
    monkeypatch.setattr("orchestrator.flow.model.state_of", lambda path: ())
    monkeypatch.setattr(
        "orchestrator.flow.model._read", lambda path, _: by_name[path.parent.name]
    )
    again = plan.refined(made, tmp_path)
    assert (again is made) == (bump == 0)
    assert solved_of(again) == (ROUGHNESSES if bump else nodes)


def test_answers_between_flows_are_those_of_solved_ones(tmp_path: Path) -> None:
    tables = {}
    for name, tolerance in (("between", 0.2), ("solved", None)):
        finished = pipeline.run(asked(tolerance), tmp_path / name, workers=2)
        assert not finished.failures
        table = pd.read_csv(tmp_path / name / "tables/pile_threshold.csv")
        tables[name] = table.sort_values(["z0_over_d", "fraction"], ignore_index=True)
    found, sound = tables["between"], tables["solved"]
    put = found["between_error"].notna()
    assert put.sum() == 3 * found["fraction"].nunique()
    off = (found["shields"] / sound["shields"] - 1).abs()
    assert (off[put] < found["between_error"][put]).all()
    assert (off[~put] == 0).all()
    # the numerical error contains it
    larger = found["numerical_error"] > sound["numerical_error"]
    assert larger[put & sound["numerical_error"].notna()].all()
    scenes = pd.read_csv(tmp_path / "between/tables/scenes.csv")
    counts = scenes["flow_case"].str.count("flow-")
    assert sorted(counts) == [1, 1, 1, 1, 1, 5, 5, 5]
    page = (tmp_path / "between/report.html").read_text(encoding="utf-8")
    assert "Some flows were interpolated." in page
    assert "3 flows were not solved" in " ".join(page.split())
    again = pipeline.run(asked(), tmp_path / "between", workers=2)
    assert again.started == 0
