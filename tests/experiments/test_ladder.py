"""The ladder: what it runs beside what, errors from points that are known, and its charts."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments import ladder, ladder_figures
from orchestrator.experiments.experiment import Runs
from orchestrator.experiments.ladder import (
    AGAIN,
    ERRORS,
    FINER,
    FLOW_REFERENCE,
    LEVEL_AGAIN,
    LEVEL_REFERENCE,
    REFERENCE,
)
from orchestrator.fidelity.calibration import LEVEL_BED
from orchestrator.fidelity.levels import FLAT, LEVELS, PEELING, Pair, level
from orchestrator.study import study
from orchestrator.study.parts import PileBed
from orchestrator.study.study import Study

COARSE, FAST = level("flow", "coarse"), level("grains", "1 layer, fast")
TAU = {"tau_0.1": 1.0, "tau_0.5": 2.0, "curve_0.50": 2.0}


@pytest.fixture(scope="module")
def asked() -> Study:
    return study.load("ladder")


def test_every_level_is_run_and_each_pile_beside_its_reference(asked: Study) -> None:
    made = ladder.decisions(asked)
    pairs = [one.levels for one in made.values() if one.levels]
    for part, levels in enumerate(LEVELS.values()):
        assert {pair[part] for pair in pairs} == set(levels)
    for scene in asked.scenes:
        run = {one.levels for one in made.values() if one.asked == scene}
        by_dem = scene.protocol.method == "dem"
        assert isinstance(scene.bed, PileBed)
        if scene.bed.is_level:
            # no flow is solved over it
            assert {LEVEL_REFERENCE, LEVEL_AGAIN} <= run
            assert {pair.flow for pair in run if pair} == {FLAT}
        else:
            assert (REFERENCE in run) == (AGAIN in run) == by_dem
            assert FLOW_REFERENCE in run


def test_the_naive_route_is_measured_on_the_lowest_pile_with_every_grain_mobile(
    tmp_path: Path,
) -> None:
    text = """
        grain = { diameter = 1e-3 }
        bed = { kind = "pile", height = 0.01, slope_deg = 20.0, roughness = "d/30" }
        flow = { model = "flat" }
    """
    asked = study.parse(text, name="one", where="one")
    small = ladder.small_pile(asked)
    routes = ladder.naive_routes(small)
    dearest, softened = (one.scene for one in routes.values())
    stiffness = dearest.grain.stiffness * dearest.weight / dearest.grain.diameter
    assert stiffness == pytest.approx(1e6)  # N/m, the paper's
    assert softened.grain.stiffness == 1e4
    pairs = ladder.decisions(asked)
    planned = plan.of({**pairs, **routes}, "ladder")
    packing = planned.piles[next(iter(routes))].packing
    assert packing.mobile.sum() > 5 * packing.count
    # what did not run costs nothing that is known; what needs no run has no error by itself
    runs = Runs(planned, tmp_path, {}, {})
    fast = next(key for key, one in pairs.items() if one.levels and one.levels.grains is FAST)
    assert ladder.naive_costs(list(routes), fast, runs)["core_s"].isna().all()
    points = ladder.points(pairs, runs)
    assert set(points["grain_level"]) == {"pivot", "peeling"}
    assert set(points["flow_level"]) <= {"flat", "hill", "waves"}
    assert ladder.errors(points).empty


def test_a_study_without_dem_has_no_ladder() -> None:
    with pytest.raises(InputError, match="no pile that is answered by DEM"):
        ladder.small_pile(study.parse("[grain]\ndiameter = 1e-3\n", name="one", where="one.toml"))


def _point(pair: Pair, factor: float = 1.0, **other: Any) -> dict[str, Any]:
    return {
        "scene_id": "a",
        "packing": "aligned",
        "asked": "dem",
        "class_flow": "wall",
        "class_grains": "aligned",
        "same_model": True,
        "flow_level": pair.flow.name,
        "grain_level": pair.grains.name,
        "flow_s": 1.0,
        "grains_s": 1.0,
        "model_floor": 0.2,
        **{name: factor * value for name, value in TAU.items()},
        **other,
    }


def _table() -> pd.DataFrame:
    return pd.DataFrame(
        [
            _point(REFERENCE, grains_s=100.0),
            _point(AGAIN, 1.01, grains_s=50.0),
            _point(FLOW_REFERENCE, 0.98, grains_s=0.1),
            _point(Pair(REFERENCE.flow, FAST), 1.03, grains_s=2.0),
            _point(Pair(COARSE, PEELING), 0.98 * 1.05, grains_s=0.1, flow_s=0.1),
            _point(FINER, 0.98, grains_s=0.1, flow_s=9.0),
        ]
    )


def test_errors_are_relative_to_the_reference_and_the_front_is_not_beaten() -> None:
    unreached = pd.DataFrame([_point(Pair(COARSE, FAST), **{"tau_0.5": math.nan})])
    table = pd.concat([_table(), unreached])
    found = ladder.with_front(ladder.errors(table.reset_index(drop=True)))
    each: Any = found.itertuples()
    rows = {(row.flow_level, row.grain_level): row for row in each}
    assert rows["fine", "reference"].error_10 == pytest.approx(0.0)
    assert rows["fine", "peeling"].error_50 == pytest.approx(-0.02)
    assert rows["fine", FAST.name].error_curve == pytest.approx(0.03)
    assert rows["coarse", "peeling"].cost_core_s == pytest.approx(0.2)
    assert math.isnan(rows["coarse", FAST.name].error_50)
    np.testing.assert_allclose(found["reference_error"], 0.01)
    front = {key for key, row in rows.items() if row.pareto}
    best = {("coarse", "peeling"), ("fine", "peeling"), ("fine", "reference")}
    assert front == best | {("fine", "soft reference")}


def test_known_errors_stand_beside_the_uncertainty_of_the_reference() -> None:
    over: dict[str, Any] = {
        "scene_id": "b",
        "class_flow": LEVEL_BED,
        "class_grains": "poured, flat",
    }
    table = _table()
    # a fraction that only one of the two reaches is infinitely off
    table.loc[table["grain_level"] == FAST.name, "tau_0.5"] = math.nan
    others = [
        _point(LEVEL_REFERENCE, **over),
        _point(LEVEL_AGAIN, 1.05, **over),
        _point(Pair(FLAT, PEELING), 1.4, **over),
        # over a pile the flat flow is a level of the flow
        _point(Pair(FLAT, PEELING), 0.7),
    ]
    table = pd.concat([table, pd.DataFrame(others)]).reset_index(drop=True)
    known = ladder.known_errors(table).set_index(["scene_class", "level", "fraction"])
    for place, error, uncertainty in (
        (("aligned", "peeling", 0.5), 0.02, 0.01),
        (("aligned", "reference", 0.1), 0.0, 0.01),
        (("aligned", FAST.name, 0.1), 0.03, 0.01),
        (("aligned", FAST.name, 0.5), math.inf, 0.01),
        (("wall", "coarse", 0.5), 0.05, 0.0),
        (("wall", "flat", 0.5), 1 - 0.7 / 0.98, 0.0),
        (("poured, flat", "peeling", 0.5), 0.4, 0.05),
    ):
        row = known.loc[[place]].iloc[0]
        assert row["error"] == pytest.approx(error)
        assert row["uncertainty"] == pytest.approx(uncertainty)
        assert row["scenes"] == 1
    assert LEVEL_BED not in known.index.get_level_values("scene_class")


@pytest.fixture
def pairs() -> pd.DataFrame:
    """Nine pairs of levels in two packings; errors rise by threes as the cost falls by threes."""
    rows = []
    for packing in ("aligned", "disordered"):
        for number in range(9):
            flow = ("fine", "medium", "coarse")[number // 3]
            error = (-1.0) ** number * 1e-3 * 3.0**number
            rows.append(
                {
                    "packing": packing,
                    "flow_level": flow,
                    "grain_level": ("1 layer, slow", "1 layer, fast", "pivot")[number % 3],
                    "piles": 4,
                    "cost_core_s": 3e3 / 3.0**number,
                    **dict(zip(ERRORS, error * np.arange(5), strict=True)),
                    "reference_error": 0.002,
                    "model_floor": 0.2 if packing == "aligned" else math.nan,
                    "same_model": flow != "coarse",
                    "pareto": number % 2 == 0,
                }
            )
    return pd.DataFrame(rows)


def _points(ax: Axes) -> dict[float, tuple[float, str, Any]]:
    """The place on y, the marker and the colour of the face, by the cost."""
    return {
        round(float(x), 6): (float(y), str(line.get_marker()), line.get_markerfacecolor())
        for line in ax.lines
        if line.get_gid() == "point"
        for x, y in np.asarray(line.get_xydata())
    }


def test_points_are_the_largest_errors(pairs: pd.DataFrame) -> None:
    figure = ladder_figures.against_cost(pairs)
    for ax, (packing, rows) in zip(figure.axes, pairs.groupby("packing"), strict=True):
        assert ax.get_title("left").startswith(str(packing))
        drawn = _points(ax)
        each: Any = rows.itertuples()
        for row in each:
            y, marker, face = drawn[round(float(row.cost_core_s), 6)]
            assert y == pytest.approx(max(abs(3 * row.error_30), ladder_figures.FLOOR))
            assert marker == ("v" if row.error_30 < 0 else "^")
            assert (face == "white") == (row.flow_level == "coarse")
        tags = [text for text in ax.texts if text.get_gid() == "tag"]
        assert len(tags) == 9
    bands = [[p for p in ax.patches if p.get_gid() == "model"] for ax in figure.axes]
    assert [len(band) for band in bands] == [1, 0]


def test_each_error_has_a_panel_of_its_own(pairs: pd.DataFrame) -> None:
    figure = ladder_figures.by_fraction(pairs)
    rows = pairs[pairs["packing"] == "disordered"].sort_values("cost_core_s")
    for ax, column in zip(figure.axes[5:], ERRORS, strict=True):
        expected = rows[column].abs().clip(lower=ladder_figures.FLOOR).tolist()
        assert [y for _, (y, _, _) in sorted(_points(ax).items())] == pytest.approx(expected)
        tags = sorted(text.get_text() for text in ax.texts if text.get_gid() == "tag")
        assert tags == list("13579")  # those on the front


def test_a_pair_without_a_cost_or_an_error_is_named(pairs: pd.DataFrame) -> None:
    one = pairs[pairs["packing"] == "disordered"].reset_index(drop=True)
    one.loc[0, "cost_core_s"] = np.nan
    one.loc[1, list(ERRORS[:-1])] = np.nan
    one.loc[2, "error_70"] = np.nan
    (ax,) = ladder_figures.against_cost(one).axes
    drawn = _points(ax)
    assert len(drawn) == 7
    assert drawn[round(one["cost_core_s"].iloc[2], 6)][1] == "X"
    said = " ".join(text.get_text() for text in ax.texts)
    assert "cost not measured: fine, 1 layer, slow" in said
    assert "no fraction reached: fine, 1 layer, fast" in said
    for table in (pairs.iloc[:0], pairs.assign(cost_core_s=np.nan)):
        for draw in (ladder_figures.against_cost, ladder_figures.by_fraction):
            assert ladder_figures.NOTHING in [t.get_text() for t in draw(table).axes[0].texts]


def test_bars_are_the_factors_gained() -> None:
    routes = pd.DataFrame(
        [("naive", 4.1e8, True), ("soft", 4.1e6, False), ("lost", np.nan, False)],
        columns=["route", "core_s", "extrapolated"],
    )
    (ax,) = ladder_figures.gains(routes).axes
    bars = [bar for bar in ax.patches if isinstance(bar, Rectangle)]
    assert [bar.get_x() + bar.get_width() for bar in bars] == pytest.approx([1, 100])
    assert [bar.get_hatch() is not None for bar in bars] == [True, False]
    texts = [text.get_text().strip() for text in ax.texts]
    assert texts == ["1 × (13 years)", "100 × (47 days)", "not measured"]
