"""The maps: their files, their verdicts on real runs, the limits read off them."""

import math
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from orchestrator.fidelity import limits, measured
from orchestrator.lab import stability, told
from orchestrator.lab.map_file import FOLDER, StabilityMap, read_map
from orchestrator.lab.stability import NOTICED
from orchestrator.report import style
from orchestrator.runs import workspace
from tests import letters

SMALL = """
title = "Small"
question = "?"
judge = "pile"
x = { label = "dt", fields = { "method.grains.time_step" = 1.0 }, values = [0.2, 1.5] }
y = { label = "h, d", fields = { "bed.height" = 1e-3 }, values = [10.0] }
reference = { "method.kind" = "peeling" }
bed = { kind = "pile", slope_deg = 20.0, roughness = "d/30" }
grain = { diameter = 1e-3 }
method.flow.model = "waves"
method.grains = { stiffness = 1e3, load_increment = 0.05, waiting_time = 6.0, final_fraction = 0.75 }
forces = { law = "high" }
"""


@pytest.mark.parametrize(
    "path", sorted(FOLDER.glob("*.toml")), ids=lambda path: path.stem
)
def test_a_maps_file_spans_its_axes(path: Path) -> None:
    read = read_map(path)
    across, down = ({place[axis] for place in read.places} for axis in (0, 1))
    assert len(read.places) == len(across) * len(down)
    assert (across == {None}) == ("fractions" in read.data["x"])
    assert all(place.scenes for place in read.places)
    if read.data["judge"] == "pile":
        assert all(len(place.scenes) == len(place.references) for place in read.places)


@pytest.mark.long
def test_verdicts_are_those_of_real_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    out = tmp_path / "out"
    stability.Stability(tmp_path).run(out, workers=2)
    said = capsys.readouterr().err
    (line,) = (line for line in said.splitlines() if "is an answer here" in line)
    assert line.startswith("1 case failed, which is an answer here; ")
    assert f"`orchestrator status {out}` names each with its cause" in line
    listed, has_failed = workspace.status(out)
    assert has_failed
    assert "failed: pile-" in listed
    assert "overlap" in listed
    # no other line says why
    assert len([line for line in said.splitlines() if "failed" in line]) == 2
    assert "exploded" not in said
    assert "noisy" not in said
    table = pd.read_csv(tmp_path / "out" / "tables" / "maps.csv")
    good, bad = table.sort_values("x").to_dict("records")
    assert good["verdict"] == "good"
    assert abs(good["error"]) < 0.05
    assert bad["verdict"] in ("exploded", "noisy")
    assert bad["caught"]
    assert math.isnan(bad["error"])


def test_the_limits_were_read_off_the_maps() -> None:
    table = pd.read_csv(measured.FOLDER / "maps.csv")
    noticed = table[table["verdict"].isin(NOTICED)]
    assert noticed["caught"].all()

    def runs(name: str) -> pd.DataFrame:
        return table[table["map"] == name].astype({"x": float, "y": float})

    steps = runs("timestep-damping")
    allowed = steps["y"] >= limits.LEAST_DAMPING
    allowed &= steps["x"] <= steps["y"].map(limits.largest_timestep)
    assert (steps[allowed]["verdict"] == "good").all()
    waits = runs("quiet-step")
    held = (waits["y"] >= 6.0) & (waits["x"] <= limits.COARSE_STEP)
    assert (waits[held]["verdict"] == "good").all()
    pockets = table[table["map"] == "entrainment-layers"]
    touching = pockets["x"].astype(float) >= limits.CLOSE_PACKED_DEG
    assert touching.any()
    assert (pockets[touching]["verdict"] == "good").all()
    assert (pockets[~touching]["verdict"] != "good").mean() > 0.5


WITH_ERRORS = {"G\n−1.2 %", "W\n+1.2e+03 %", "X"}


def test_all_maps_are_drawn_in_letters_to_read() -> None:
    table = pd.read_csv(measured.FOLDER / "maps.csv", keep_default_na=False)
    table["error"] = pd.to_numeric(table["error"])
    for name in ("x", "y"):
        # numbers are kept as texts beside words
        numbers = pd.to_numeric(table[name], errors="coerce")
        table[name] = numbers.astype(object).where(numbers.notna(), table[name])
    maps = [read_map(path) for path in sorted(FOLDER.glob("*.toml"))]
    with style.settings(style.LETTERS):
        for width in letters.SHOWN:
            letters.check(stability.draw_maps(maps, table, width))
            letters.check(stability.draw_maps(maps[:1], table, width))


def test_each_cell_shows_its_worst_run() -> None:
    rows = [
        ("m", 2.0, 10.0, "exploded", True, math.nan, ""),
        ("m", 0.5, 10.0, "good", False, -0.012, ""),
        ("m", 0.5, 1e6, "wrong", False, 12.0, ""),
        ("m", 0.5, 1e6, "good", False, 0.0, ""),
        ("words", "a", 1.0, "good", False, 0.004, ""),
    ]
    columns = ["map", "x", "y", "verdict", "caught", "error", "note"]
    table = pd.DataFrame(rows, columns=columns)
    axes = {"x": {"label": "x"}, "y": {"label": "y"}}
    maps = [StabilityMap(name, {"title": name, **axes}, ()) for name in ("m", "words")]
    for shown, said in ((maps, {"G", "W", "X"}), (maps[:1], WITH_ERRORS)):
        ax = stability.draw_maps(shown, table).axes[0]
        cells = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
        drawn = {cell.get_xy(): cell.get_gid() for cell in cells}
        assert drawn == {(0, 0): "good", (0, 1): "wrong", (1, 0): "exploded"}
        texts = {text.get_text() for text in ax.texts}
        assert texts == said
        assert [mark.get_text() for mark in ax.get_xticklabels()] == ["0.5", "2"]


def test_a_study_tells_every_stored_answer_that_is_wrong_unless_its_map_says_why_not() -> (
    None
):
    table = pd.read_csv(measured.FOLDER / "maps.csv")
    maps = [read_map(path) for path in sorted(FOLDER.glob("*.toml"))]
    found = told.told_answers(maps, table)
    silent = (table["verdict"] == "wrong") & ~table["caught"]
    assert len(found) == silent.sum() > 90
    assert set(found["told"]) <= set(told.HOW) - {told.NOTHING}
    excused = {one.name for one in maps if "no_check" in one.data}
    assert set(found.loc[found["told"] == told.NO_FAULT, "map"]) == excused
    assert found.loc[found["told"].isin([told.REFUSED, told.WARNED]), "field"].all()
    counts = told.counted(maps, table)
    assert counts["wrong"].sum() == len(found)
    assert (counts[[*told.HOW]].sum(axis=1) == counts["wrong"]).all()


def test_an_answer_of_which_a_study_says_nothing_is_counted_as_such() -> None:
    maps = [read_map(FOLDER / "layers-horizontal.toml")]
    row = {"map": "layers-horizontal", "x": 0.5, "y": 2, "verdict": "wrong"}
    table = pd.DataFrame([{**row, "caught": False, "error": 0.9, "note": ""}])
    assert told.told_answers(maps, table)["told"].tolist() == [told.NOTHING]
    (count,) = told.counted(maps, table).to_dict("records")
    assert (count["wrong"], count[told.NOTHING], count[told.WITHIN]) == (1, 1, 0)
    # within the numerical error of horizontal rows
    assert told.told_answers(maps, table.assign(error=0.05))["told"].tolist() == [
        told.WITHIN
    ]
    # a run that noticed it is no such answer
    assert told.told_answers(maps, table.assign(caught=True)).empty
