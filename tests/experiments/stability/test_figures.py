"""Maps of failure: each cell shows what its run came to, the border runs around the good ones."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from orchestrator.experiments.stability import figures
from orchestrator.experiments.stability.maps import Axis, Map
from orchestrator.experiments.stability.verdicts import Judged

COLUMNS = ["x", "y", "verdict", "caught", "error", "note"]
Edge = tuple[tuple[float, float], tuple[float, float]]


def made(rows: Sequence[tuple[object, ...]], title: str = "T", name: str = "none") -> Judged:
    x, y = Axis("x", (), is_fraction=False), Axis("y", (), is_fraction=False)
    one = Map(name, title, "How far?", "pile", x, y, ())
    return Judged(one, pd.DataFrame(rows, columns=COLUMNS))


@pytest.fixture
def small() -> Judged:
    """Three by two, without a run at (1, 10)."""
    return made(
        [
            (2.0, 10.0, "exploded", True, np.nan, ""),
            (0.5, 10.0, "good", False, -0.012, ""),
            (0.5, 1e6, "good", False, 0.004, ""),
            (1.0, 1e6, "good", False, 0.0, ""),
            (2.0, 1e6, "wrong", False, 0.35, ""),
        ],
        name="first-cell",
    )


def cells(ax: Axes) -> dict[tuple[float, float], str]:
    return {
        p.get_xy(): str(p.get_gid()) for p in ax.patches if isinstance(p, Rectangle)
    }  # fmt: skip


def edges(ax: Axes, look: str) -> set[Edge]:
    lines = [
        line for line in ax.lines if line.get_gid() == "border" and line.get_linestyle() == look
    ]
    ends = [np.asarray(line.get_xydata(), float).tolist() for line in lines]
    return {((a[0], a[1]), (b[0], b[1])) for a, b in ends}


def test_each_cell_shows_its_run(small: Judged) -> None:
    (ax,) = figures.draw(small).axes
    assert cells(ax) == {
        (0, 0): "good", (0, 1): "good", (1, 1): "good", (2, 0): "exploded", (2, 1): "wrong",
    }  # fmt: skip
    errors = {t.get_position(): t.get_text() for t in ax.texts if t.get_gid() == "error"}
    assert errors == {
        (0.5, 0.3): "−1.2 %", (0.5, 1.3): "+0.4 %", (1.5, 1.3): "+0.0 %", (2.5, 1.3): "+35 %",
    }  # fmt: skip
    (caught,) = [patch for patch in ax.patches if patch.get_gid() == "caught"]
    assert caught.get_path().contains_point((2.95, 0.95))
    assert [label.get_text() for label in ax.get_xticklabels()] == ["0.5", "1", "2"]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["10", "1e6"]
    said = [text.get_text() for text in ax.texts]
    assert "How far?" in said
    (limit,) = small.map.limits
    assert f"Limit: {limit}" in said


def test_border_is_found_where_the_next_run_is_not_good(small: Judged) -> None:
    (ax,) = figures.draw(small).axes
    assert edges(ax, "-") == {((2, 1), (2, 2))}
    open_ends = edges(ax, ":") | edges(ax, "--")
    assert ((1.0, 0.0), (1.0, 1.0)) in open_ends
    assert ((1.0, 1.0), (2.0, 1.0)) in open_ends
    assert ((0.0, 1.0), (1.0, 1.0)) not in open_ends
    assert len(open_ends) == 7


def test_of_several_runs_in_one_place_the_worst_is_shown() -> None:
    rows = [("a", 1.0, verdict, False, 0.1, "") for verdict in ("wrong", "exploded", "good")]
    (ax,) = figures.draw(made([*rows, (None, 1.0, "good", False, 0.1, "")])).axes
    assert cells(ax) == {(0, 0): "exploded"}
    assert [label.get_text() for label in ax.get_xticklabels()] == ["a"]


def test_every_verdict_reads_without_colour() -> None:
    rows = [(float(i), 1.0, v, False, np.nan, "") for i, v in enumerate(figures.VERDICTS)]
    figure = figures.draw(made(rows))
    letters = {letter for _, letter, _ in figures.VERDICTS.values()}
    assert len(letters) == len(figures.VERDICTS) == 5
    assert letters <= {text.get_text() for text in figure.axes[0].texts}
    named = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert {f"{letter}: {name}" for _, letter, name in figures.VERDICTS.values()} <= set(named)


def test_a_sheet_holds_all_maps(small: Judged) -> None:
    empty = made([], title="empty")
    figure = figures.sheet([small, empty, small])
    shown = [ax for ax in figure.axes if ax.axison]
    assert [ax.get_title("left") for ax in shown] == ["T", "empty", "T"]
    assert cells(shown[0]) == cells(shown[2]) == cells(figures.draw(small).axes[0])
    assert "nothing was run" in [text.get_text() for text in shown[1].texts]
    assert cells(figures.draw(empty).axes[0]) == {}
    assert [ax for ax in figures.sheet([]).axes if ax.axison] == []


@pytest.mark.parametrize(
    ("error", "written"),
    [(0.0994, "+9.9 %"), (-0.0996, "−10 %"), (0.0004, "+0.0 %"), (9.4, "+940 %"), (12.0, "+12×")],
)
def test_errors_are_written_short(error: float, written: str) -> None:
    assert figures.percent(error) == written
