"""The maps: their files, their verdicts on real runs, the limits read off them, their figures."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from orchestrator import pipeline
from orchestrator.experiments import stability, stability_figures
from orchestrator.experiments.experiment import Runs
from orchestrator.experiments.stability import NOTICED, Map
from orchestrator.fidelity import calibration, limits
from orchestrator.runs.workspace import EXPERIMENT, Workspace, claimed

ALL = stability.load_all()
SMALL = """
title = "Small"
question = "?"
judge = "pile"
x = { label = "dt", fields = { "protocol.time_step" = 1.0 }, values = [0.2, 1.5] }
y = { label = "h, d", fields = { "bed.height" = 1e-3 }, values = [10.0] }
reference = { "protocol.method" = "peeling" }
bed = { kind = "pile", slope_deg = 20.0, roughness = "d/30" }
grain = { diameter = 1e-3, stiffness = 1e3 }
protocol = { load_increment = 0.05, waiting_time = 6.0, final_fraction = 0.75 }
flow = { model = "hill" }
forces = { law = "high" }
"""


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_a_maps_file_spans_its_axes(one: Map) -> None:
    across, down = ({place[axis] for place in one.places} for axis in (0, 1))
    assert len(one.places) == len(across) * len(down)
    assert (across == {None}) == bool(one.fractions)
    assert all(place.scenes for place in one.places)
    if one.data["judge"] == "pile":
        assert all(len(place.scenes) == len(place.references) for place in one.places)


def test_verdicts_are_those_of_real_runs(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    one = stability.load(path)
    planned = stability.planned_for([one])
    space = Workspace(tmp_path / "out")
    with claimed(space.root, EXPERIMENT, "stability"):
        pipeline.complete(planned.missing(space.cases), space, workers=2, limit_s=120)
    runs = Runs(planned, space.cases, planned.done(space.cases), {})
    good, bad = stability.judge(one, runs).sort_values("x").to_dict("records")
    assert good["verdict"] == "good"
    assert abs(good["error"]) < 0.05
    assert bad["verdict"] in ("exploded", "noisy")
    assert bad["caught"]
    assert math.isnan(bad["error"])


def test_the_limits_were_read_off_the_maps() -> None:
    table = pd.read_csv(calibration.FOLDER / "maps.csv")
    assert set(limits.SAYS) <= {one.name for one in ALL}
    noticed = table[table["verdict"].isin(NOTICED)]
    assert len(noticed) > 20
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
    touching = pockets["x"].astype(float) >= limits.CLOSE_PACKED_DEG + 0.5
    assert (pockets[touching]["verdict"] == "good").all()
    assert (pockets[~touching]["verdict"] != "good").mean() > 0.5


Judged = tuple[Map, pd.DataFrame]


def _made(rows: Sequence[tuple[object, ...]], title: str = "T", name: str = "none") -> Judged:
    axes = {"x": {"label": "x"}, "y": {"label": "y"}}
    one = Map(name, {"title": title, "question": "How far?", "judge": "pile", **axes}, ())
    columns = ["x", "y", "verdict", "caught", "error", "note"]
    return one, pd.DataFrame(rows, columns=columns)


@pytest.fixture
def small() -> Judged:
    """Three by two, without a run at (1, 10)."""
    return _made(
        [
            (2.0, 10.0, "exploded", True, np.nan, ""),
            (0.5, 10.0, "good", False, -0.012, ""),
            (0.5, 1e6, "good", False, 0.004, ""),
            (1.0, 1e6, "good", False, 0.0, ""),
            (2.0, 1e6, "wrong", False, 12.0, ""),
        ],
        name="first-cell",
    )


def _cells(ax: Axes) -> dict[tuple[float, float], str]:
    return {p.get_xy(): str(p.get_gid()) for p in ax.patches if isinstance(p, Rectangle)}


def _edges(ax: Axes, *looks: str) -> set[tuple[tuple[float, ...], ...]]:
    lines = (line for line in ax.lines if line.get_gid() == "border")
    return {
        tuple(map(tuple, np.asarray(line.get_xydata(), float).tolist()))
        for line in lines
        if line.get_linestyle() in looks
    }


def test_each_cell_shows_its_run(small: Judged) -> None:
    (ax,) = stability_figures.draw(*small).axes
    expected = {(0, 0): "good", (0, 1): "good", (1, 1): "good", (2, 0): "exploded", (2, 1): "wrong"}
    assert _cells(ax) == expected
    errors = {text.get_text() for text in ax.texts if text.get_gid() == "error"}
    assert errors == {"−1.2 %", "+0.4 %", "+0.0 %", "+12×"}
    (caught,) = [patch for patch in ax.patches if patch.get_gid() == "caught"]
    assert caught.get_path().contains_point((2.95, 0.95))
    assert [label.get_text() for label in ax.get_xticklabels()] == ["0.5", "1", "2"]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["10", "1e6"]
    # the border was found where the next run is not good
    assert _edges(ax, "-") == {((2, 1), (2, 2))}
    not_tried = _edges(ax, ":", "--")
    assert {((1, 0), (1, 1)), ((1, 1), (2, 1))} <= not_tried
    assert ((0, 1), (1, 1)) not in not_tried
    assert len(not_tried) == 7


def test_a_sheet_holds_all_maps_and_the_worst_run_of_a_place(small: Judged) -> None:
    rows = [("a", 1.0, verdict, False, 0.1, "") for verdict in ("wrong", "exploded", "good")]
    worst, empty = _made([*rows, (None, 1.0, "good", False, 0.1, "")]), _made([], title="empty")
    figure = stability_figures.sheet([small[0], empty[0], worst[0]], [small[1], empty[1], worst[1]])
    shown = [ax for ax in figure.axes if ax.axison]
    assert [ax.get_title("left") for ax in shown] == ["T", "empty", "T"]
    assert _cells(shown[0]) == _cells(stability_figures.draw(*small).axes[0])
    assert "nothing was run" in [text.get_text() for text in shown[1].texts]
    assert _cells(shown[2]) == {(0, 0): "exploded"}
    letters = {letter for *_, letter in stability_figures.VERDICTS.values()}
    assert len(letters) == len(stability_figures.VERDICTS) == 5  # it reads without colour
    assert not [ax for ax in stability_figures.sheet([], []).axes if ax.axison]
