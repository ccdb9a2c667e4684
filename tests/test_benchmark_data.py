"""The benchmark's data: complete, and a fresh run of some of its points agrees with it."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import case, engine, plan, study, tables
from orchestrator.benchmark import data
from orchestrator.errors import InputError
from orchestrator.study import Group, Study
from tests.conftest import Command

FOLDER = Path(__file__).parent.parent / "benchmark" / "paper"
COLUMNS = {
    "single_grain": "scene_id alpha_deg beta_deg d_m z0_over_d nu closure reynolds"
    " shields_closed_form shields_dem",
    "wall_stress": "alpha_deg z0_m s_over_h ustar_over_ustar0_wall ustar_over_ustar0_eq10",
    "pile_curve": "scene_id seed u_e fraction_moved mean_tau_pa reynolds",
    "pile_threshold": "scene_id alpha_deg d_m z0_over_d nu closure packing fraction shields"
    " reynolds shields_low shields_high ustar0 highest_fraction",
}


@pytest.fixture(scope="module")
def files() -> dict[str, pd.DataFrame]:
    return {path.stem: pd.read_csv(path) for path in FOLDER.glob("*.csv")}


@pytest.fixture(scope="module")
def paper() -> Study:
    return study.load("paper")


def test_files_and_columns(files: dict[str, pd.DataFrame]) -> None:
    assert set(files) == {"scenes", *COLUMNS}
    for name, columns in COLUMNS.items():
        assert set(columns.split()) <= set(files[name].columns)
    assert (FOLDER / "README.md").is_file()


def test_every_row_belongs_to_a_scene(files: dict[str, pd.DataFrame], paper: Study) -> None:
    known = set(files["scenes"]["scene_id"])
    assert known == {scene.id for scene in paper.scenes}
    for name in ("single_grain", "pile_curve", "pile_threshold"):
        assert set(files[name]["scene_id"]) <= known
    piles = files["scenes"].loc[files["scenes"]["bed"] == "pile", "scene_id"]
    assert set(files["pile_threshold"]["scene_id"]) == set(piles)


def _fresh(paper: Study, chosen: list[str], root: Path) -> tables.Tables:
    scenes = tuple(scene for scene in paper.scenes if scene.id in chosen)
    assert len(scenes) == len(chosen)
    asked = dataclasses.replace(paper, groups=(Group("fresh", scenes),))
    planned = plan.make(asked)
    for one in planned.cases.values():
        engine.execute(one, root, 300.0)
        assert case.is_done(one, root)
    return tables.make(asked, planned, root, planned.done(root))


def test_fresh_piles_fall_within_the_stated_intervals(
    files: dict[str, pd.DataFrame], paper: Study, tmp_path: Path
) -> None:
    scenes, stated = files["scenes"], files["pile_threshold"]
    few = scenes[(scenes["bed"] == "pile") & (scenes["d_m"] == 1e-3) & (scenes["alpha_deg"] == 25)]
    aligned = few[(few["packing"] == "aligned") & (few["regime"] != "transition")]
    fresh = _fresh(paper, aligned["scene_id"].tolist(), tmp_path)
    both = fresh["pile_threshold"].merge(stated, on=["scene_id", "fraction"], suffixes=("", "_x"))
    assert len(both) >= 8
    assert (both["shields"] >= both["shields_low_x"]).all()
    assert (both["shields"] <= both["shields_high_x"]).all()
    known = files["wall_stress"][files["wall_stress"]["alpha_deg"] == 25]
    for z0, part in fresh["wall_stress"].drop_duplicates(["z0_m", "s_m"]).groupby("z0_m"):
        reference = known[np.isclose(known["z0_m"], float(str(z0)), rtol=1e-5)]
        ours, theirs = (t["ustar_over_ustar0_wall"].to_numpy(float) for t in (part, reference))
        np.testing.assert_allclose(ours, theirs, atol=1e-4)


def test_fresh_single_grains_fall_within_the_stated_intervals(
    files: dict[str, pd.DataFrame], paper: Study, tmp_path: Path
) -> None:
    stated = files["single_grain"]
    ids = stated[stated["shields_dem"].notna()]["scene_id"].iloc[::60].tolist()
    fresh = _fresh(paper, ids, tmp_path)["single_grain"]
    both = fresh.merge(stated, on="scene_id", suffixes=("", "_x"))
    assert len(both) == len(ids) >= 8
    assert (both["shields_dem"] >= both["shields_dem_low_x"]).all()
    assert (both["shields_dem"] <= both["shields_dem_high_x"]).all()


def test_a_study_without_piles_has_no_data(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pile"):
        data.write({"scenes": pd.DataFrame(), "single_grain": pd.DataFrame()}, {}, tmp_path)


def test_the_command_refuses_a_directory_without_a_study(
    orchestrator: Command, tmp_path: Path
) -> None:
    ended = orchestrator("benchmark", "data", str(tmp_path), str(tmp_path / "out"))
    assert ended.returncode == 2
    assert "no study" in ended.stderr
    assert "Traceback" not in ended.stderr
