"""The expected answers in the repository: complete, and a fresh run of some agrees with them."""

import dataclasses
import threading
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import plan, tables
from orchestrator.benchmark import pack, scenes
from orchestrator.benchmark.export import scene_names
from orchestrator.errors import InputError
from orchestrator.runs import case, engine, reuse
from orchestrator.study import study
from orchestrator.study.closed_form import regime_of
from orchestrator.study.study import Group, Study
from tests.benchmark.conftest import ROOT
from tests.waiting import HANGS_S

# the preset has ramps, which are warned of
pytestmark = pytest.mark.filterwarnings("ignore:.*load_increment", "ignore:.*cohesion")

FOLDER = ROOT / "benchmark" / "paper"


@pytest.fixture(scope="module")
def expected() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "expected.csv", dtype={"at": str}).fillna({"at": ""})


@pytest.fixture(scope="module")
def paper() -> Study:
    """The study of the pack: the preset before it had piles by peeling."""
    return study.load(str(FOLDER / "study.toml"))


def test_it_is_of_the_preset_paper(expected: pd.DataFrame, paper: Study) -> None:
    preset = {group.name: group.scenes for group in study.load("paper").groups}
    assert all(preset[group.name] == group.scenes for group in paper.groups)
    planned = plan.make(paper)
    names = scene_names(planned, paper)
    piles = {
        names[one] for one, pile in planned.piles.items() if not pile.bed.is_replica
    }
    flows = {names[pile.flow.id[:12]] for pile in planned.piles.values()}
    grains = {names[one.id] for one in paper.scenes if one.id not in planned.piles}
    level, name = expected["scene"].str[0], expected["scene"].str[2:]
    for number, wanted in (("1", grains), ("3", flows), ("4", piles), ("5", piles)):
        assert set(name[level == number]) == wanted
    assert set(pd.read_csv(FOLDER / "scenes.csv")["scene"]) == set(expected["scene"])


def test_fresh_piles_are_as_expected(
    expected: pd.DataFrame, paper: Study, tmp_path: Path
) -> None:
    chosen = [
        scene
        for scene in next(g for g in paper.groups if g.name == "piles").scenes
        if (scene.grain.diameter, scene.bed.slope_deg) == (1e-3, 25.0)
        and regime_of(scene) != "transition"
    ]
    asked = dataclasses.replace(paper, groups=(Group("fresh", tuple(chosen), "fresh"),))
    planned = plan.make(asked)
    for one in planned.cases.values():
        engine.execute(one, tmp_path, HANGS_S, threading.Event())
        assert case.done_state(one, tmp_path)
    results = tables.make_tables(
        asked, planned, tmp_path, reuse.done(planned.cases, tmp_path)
    )
    names = scene_names(plan.make(paper), paper)
    assert len(planned.piles) >= 2
    for pile in planned.piles.values():
        flow, bed = (names[name] for name in (pile.flow.id[:12], pile.scene.id))
        pair = (
            scenes.flow_scene(flow, pile, results),
            scenes.bed(bed, "pile", pile.scene.id, pile, results, tmp_path),
        )
        for problem in pair:
            fresh = problem.expected
            stated = expected[expected["scene"] == problem.scene].set_index(fresh.index)
            assert (fresh["quantity"] == stated["quantity"]).all()
            at, stated_at = (pd.to_numeric(table["at"]) for table in (fresh, stated))
            assert at.to_numpy() == pytest.approx(
                stated_at.to_numpy(), rel=1e-6, nan_ok=True
            )
            margin = 1e-4 * stated["value"].abs()
            is_held = fresh["ours"].between(
                stated["low"] - margin, stated["high"] + margin
            )
            assert is_held[stated["tolerance"].notna()].all(), problem.scene


def test_it_is_called_a_table_and_no_pack() -> None:
    """Whoever tries to run it is told what it is, by the program and by each link to it."""
    with pytest.raises(
        InputError, match=r"a table of expected answers, and no pack.*README"
    ):
        pack.read_pack(FOLDER)
    for page in ("docs/README.md", "docs/benchmark.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        (line,) = (
            line for line in text.splitlines() if "benchmark/paper/README.md" in line
        )
        assert "paper's pack" not in line
    assert (
        (FOLDER / "README.md")
        .read_text(encoding="utf-8")
        .startswith("# The expected answers")
    )
