"""The expected answers in the repository: complete, and a fresh run of some agrees with them."""

import dataclasses
import threading
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import plan, tables
from orchestrator.benchmark import measured
from orchestrator.paper import PRESETS
from orchestrator.runs import case, engine
from orchestrator.study import study
from orchestrator.study.closed_form import regime_of
from orchestrator.study.parts import PileBed
from orchestrator.study.study import Group, Study
from tests.benchmark.conftest import ROOT
from tests.conftest import Command

FOLDER = ROOT / "benchmark" / "paper"


@pytest.fixture(scope="module")
def expected() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "expected.csv", dtype={"at": str})


@pytest.fixture(scope="module")
def paper() -> Study:
    return study.load("paper", [PRESETS])


def test_it_is_of_the_preset_paper(expected: pd.DataFrame, paper: Study) -> None:
    assert (FOLDER / "study.toml").read_text() == paper.text
    beds = {scene.id: scene.bed for scene in paper.scenes}
    piles = {name for name, bed in beds.items() if isinstance(bed, PileBed) and not bed.is_replica}
    grains = {name for name, bed in beds.items() if bed.kind == "grain"}
    level = expected["scene"].str[0]
    name = expected["scene"].str[2:]
    for number, wanted in (("1", grains), ("4", piles), ("5", piles)):
        assert set(name[level == number]) == wanted
    assert set(name[level == "3"]) == {
        pile.flow.id[:12] for pile in plan.make(paper).piles.values()
    }
    scenes = pd.read_csv(FOLDER / "scenes.csv")
    assert set(scenes["scene"]) == set(expected["scene"])


def test_numbers_are_within_their_own_intervals(expected: pd.DataFrame) -> None:
    judged = expected[expected["tolerance"].notna()]
    assert (judged["low"] <= judged["value"]).all()
    assert (judged["value"] <= judged["high"]).all()
    thresholds = expected[expected["quantity"].isin(["shields", "ustar0_m_s", "ustar_m_s"])]
    assert (thresholds["value"] > 0).all()


def test_fresh_piles_are_as_expected(expected: pd.DataFrame, paper: Study, tmp_path: Path) -> None:
    chosen = [
        scene
        for scene in next(g for g in paper.groups if g.name == "piles").scenes
        if (scene.grain.diameter, scene.bed.slope_deg) == (1e-3, 25.0)
        and regime_of(scene) != "transition"
    ]
    asked = dataclasses.replace(paper, groups=(Group("fresh", tuple(chosen), "fresh"),))
    planned = plan.make(asked)
    for one in planned.cases.values():
        engine.execute(one, tmp_path, 300.0, threading.Event())
        assert case.is_done(one, tmp_path)
    found = tables.make(asked, planned, tmp_path, planned.done(tmp_path))
    piles = measured.answered(planned.piles.values(), found, tmp_path)
    assert len(piles) >= 2
    for answered in piles:
        for problem in (measured.flow(answered), measured.pile(answered)):
            stated = expected[expected["scene"] == problem.scene]
            keys = stated["quantity"] + stated["at"].fillna("")
            low, high = (dict(zip(keys, stated[end], strict=True)) for end in ("low", "high"))
            for _, row in problem.expected.iterrows():
                key = row["quantity"] + row["at"]
                margin = 1e-4 * abs(row["value"])
                assert low[key] - margin <= row["ours"] <= high[key] + margin, (problem.scene, key)


def test_the_folder_is_no_pack_until_it_is_exported(orchestrator: Command) -> None:
    if (FOLDER / "manifest.json").is_file():
        pytest.skip("the whole pack was exported here")
    ended = orchestrator("benchmark", "compare", str(FOLDER), "nowhere")
    assert ended.returncode == 2
    assert "benchmark export" in ended.stderr
