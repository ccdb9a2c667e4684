"""Figures of speed against accuracy: the points are those of the table, texts lie beside them."""

from itertools import combinations, product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas
from matplotlib.text import Annotation, Text

from orchestrator.experiments.ladder import chart
from orchestrator.report import style
from orchestrator.runs.folder import Folder

FLOWS, GRAINS = ("fine", "medium", "coarse"), ("stiff", "soft", "pivot")


@pytest.fixture
def pairs() -> pd.DataFrame:
    """Nine pairs of levels in two packings; errors rise by threes as the cost falls by threes."""
    rows = []
    for packing in ("aligned", "disordered"):
        for number, (flow, grain) in enumerate(product(FLOWS, GRAINS)):
            error = (-1.0) ** number * 1e-3 * 3.0**number
            errors = dict(zip(chart.HEADS, error * np.arange(5), strict=True))
            rows.append(
                {
                    "packing": packing, "flow_level": flow, "grain_level": grain, "piles": 4,
                    "cost_core_s": 3e3 / 3.0**number, **errors, "reference_error": 0.002,
                    "model_floor": 0.2 if packing == "aligned" else float("nan"),
                    "same_model": flow != "coarse", "pareto": number % 2 == 0,
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def points(ax: Axes) -> dict[tuple[float, float], tuple[str, str]]:
    """Marker and colour of the face by place."""
    return {
        (float(x), float(y)): (str(line.get_marker()), to_hex(line.get_markerfacecolor()))
        for line in ax.lines
        if line.get_gid() == "point"
        for x, y in np.asarray(line.get_xydata())
    }


def tags(ax: Axes) -> list[Annotation]:
    return [t for t in ax.texts if isinstance(t, Annotation) and t.get_gid() == "tag"]


def test_points_are_the_largest_errors(pairs: pd.DataFrame) -> None:
    figure = chart.against_cost(pairs)
    for ax, (packing, rows) in zip(figure.axes, pairs.groupby("packing"), strict=True):
        assert ax.get_title("left").startswith(str(packing))
        expected = set(zip(rows["cost_core_s"], 3 * rows["error_30"].abs(), strict=True))
        assert sorted(points(ax)) == [pytest.approx(pair) for pair in sorted(expected)]
        front = [line for line in ax.lines if line.get_gid() == "front"]
        assert [len(np.asarray(line.get_xdata())) for line in front] == [5]
    markers = {cost: mark for (cost, _), mark in points(figure.axes[1]).items()}
    signs = [markers[3e3 / 3.0**number][0] for number in range(9)]
    assert signs == [chart.HIGH, chart.LOW] * 4 + [chart.HIGH]
    hollow = [markers[3e3 / 3.0**number][1] == "#ffffff" for number in range(9)]
    assert hollow == [False] * 6 + [True] * 3


def test_each_error_has_a_panel_of_its_own(pairs: pd.DataFrame) -> None:
    figure = chart.by_fraction(pairs)
    rows = pairs[pairs["packing"] == "disordered"]
    for ax, column in zip(figure.axes[5:], chart.HEADS, strict=True):
        expected = rows[column].abs().clip(lower=chart.FLOOR).tolist()
        assert [y for _, y in sorted(points(ax), reverse=True)] == pytest.approx(expected)
        assert sorted(tag.get_text() for tag in tags(ax)) == list("13579")  # those on the front


def assert_apart(figure: Canvas) -> int:
    """No text covers another or a point, and none leaves its panel; how many there are."""
    figure.draw_without_rendering()
    boxes = 0
    for ax in figure.axes:
        extents = [Text.get_window_extent(tag) for tag in tags(ax)]
        assert not any(a.overlaps(b) for a, b in combinations(extents, 2))
        for x, y in ax.transData.transform(np.array(list(points(ax)))):
            assert not any(box.contains(x, y) for box in extents)
        frame = ax.get_window_extent()
        assert all(frame.contains(*corner) for box in extents for corner in box.corners())
        boxes += len(extents)
    return boxes


def test_texts_cover_nothing(pairs: pd.DataFrame) -> None:
    assert assert_apart(chart.against_cost(pairs)) == 18
    crowd = pairs.assign(cost_core_s=100 + pairs.index.to_numpy() % 9)
    assert assert_apart(chart.against_cost(crowd)) == 18


def test_what_is_not_known_has_no_place(pairs: pd.DataFrame) -> None:
    one = pairs[pairs["packing"] == "disordered"].reset_index(drop=True)
    one.loc[0, "cost_core_s"] = np.nan
    one.loc[1, chart.AT_FRACTIONS] = np.nan
    one.loc[2, "error_70"] = np.nan
    (ax,) = chart.against_cost(one).axes
    drawn = points(ax)
    assert len(drawn) == 7
    lacking = one["cost_core_s"].iloc[2], abs(one["error_50"].iloc[2])
    assert drawn[lacking][0] == chart.MISSING
    said = " ".join(text.get_text() for text in ax.texts)
    assert "cost not measured: fine, stiff" in said
    assert "no fraction reached: fine, soft" in said


@pytest.mark.parametrize("draw", [chart.against_cost, chart.by_fraction])
def test_a_ladder_without_pairs_says_so(pairs: pd.DataFrame, draw: type, tmp_path: Path) -> None:
    unknown = pairs.assign(cost_core_s=np.nan)
    for table in (pairs.iloc[:0], unknown):
        figure = draw(table)
        assert chart.NOTHING in [text.get_text() for text in figure.axes[0].texts]
        assert style.save(figure, Folder(tmp_path), "empty").startswith(b"\x89PNG")


def test_the_models_own_spread_is_a_band(pairs: pd.DataFrame) -> None:
    aligned, disordered = chart.against_cost(pairs).axes
    bands = [patch for patch in aligned.patches if patch.get_gid() == "model"]
    (top,) = {float(np.asarray(patch.get_extents().get_points())[1, 1]) for patch in bands}
    assert aligned.transData.inverted().transform((0, top))[1] == pytest.approx(0.2)
    # where it was not measured there is none
    assert not [patch for patch in disordered.patches if patch.get_gid() == "model"]
