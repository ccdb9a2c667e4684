"""Maps of a bed in three dimensions: values between faces, and what each map shows."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Annotation, Text

from orchestrator.report import style
from orchestrator.surface import maps
from orchestrator.surface.maps import Map, MapGrid
from tests import letters

EAST, NORTH = 512_000.0, 5_640_000.0


def grid() -> MapGrid:
    """A hill of 6 m on a raster of 2 m."""
    x = np.linspace(EAST - 20, EAST + 20, 21)
    y = np.linspace(NORTH - 20, NORTH + 20, 21)
    from_middle = np.hypot(x - EAST, y[:, None] - NORTH)
    height = np.maximum(6 - 0.4 * from_middle, 0.0)
    return MapGrid(x, y, height, height > 0)


def faces() -> pd.DataFrame:
    """Faces at random places, with values that are linear, and their inverse."""
    random = np.random.default_rng(3)
    x, y = random.uniform(-30, 30, (2, 4000))
    stress = 2.0 + 0.01 * x + 0.02 * y
    return pd.DataFrame(
        {"x_m": EAST + x, "y_m": NORTH + y, "stress": stress, "wind_m_s": 1 / stress}
    )


def test_linear_values_are_exact_between_faces_and_winds_by_their_inverse() -> None:
    of = grid()
    found = of.of_faces(faces(), ["stress", "wind_m_s"])
    exact = 2.0 + 0.01 * (of.x - EAST) + 0.02 * (of.y[:, None] - NORTH)
    assert found["stress"][of.is_form] == pytest.approx(exact[of.is_form], rel=1e-9)
    winds = found["wind_m_s"][of.is_form]
    assert winds == pytest.approx(1 / exact[of.is_form], rel=1e-9)
    assert np.isnan(found["stress"][~of.is_form]).all()


def test_a_face_without_stress_makes_the_wind_around_it_higher_not_missing() -> None:
    listed = faces()
    listed.loc[::2, "wind_m_s"] = np.inf
    found = grid().of_faces(listed, ["wind_m_s"])["wind_m_s"]
    assert not np.isnan(found[grid().is_form]).any()


def test_each_map_has_its_contours_the_wind_north_and_a_scale() -> None:
    of = grid()
    values = of.of_faces(faces(), ["stress"])["stress"]
    mark = (EAST + 4.0, NORTH + 4.0)
    drawn = [Map("from the west", values, 270.0, mark), Map("north", values, 0.0)]
    with style.settings():
        canvas = maps.figure(of, drawn, "stress", middle=2.0)
    first, second, bar = canvas.axes
    assert bar.get_xlabel() == "stress"
    scale = [line for line in first.lines if line.get_gid() == "scale"]
    assert np.ptp(np.asarray(scale[0].get_xdata(), float)) == pytest.approx(5.0)
    words = [text.get_text() for text in first.findobj(Text)]
    assert "N" in words
    assert "5 m" in words
    start = [line for line in first.lines if line.get_gid() == "start"]
    assert np.asarray(start[0].get_xydata(), float)[0].tolist() == [*mark]
    for ax in (first, second):
        assert ax.get_aspect() == 1.0
        contours = [one for one in ax.collections if "Contour" in type(one).__name__]
        assert contours


@pytest.mark.parametrize(
    ("length", "round_one"), [(0.7, 0.5), (23.0, 20.0), (5.0, 5.0), (0.0199, 0.01)]
)
def test_round_numbers_are_not_above_a_length(length: float, round_one: float) -> None:
    assert maps.nice(length) == round_one


@pytest.mark.parametrize("stretched", [1.0, 4.0, 0.25])
def test_a_figure_is_no_higher_than_its_map(stretched: float) -> None:
    of = grid()
    x = EAST + stretched * (of.x - EAST)
    wide = MapGrid(x, of.y, of.height, of.is_form)
    with style.settings(style.LETTERS):
        canvas = maps.figure(wide, [Map("", of.height)], "m")
        letters.check(canvas)
    assert canvas.get_figwidth() == style.NARROW
    panel, _ = canvas.axes
    box = panel.get_window_extent()
    # what is left is for labels, the title and the scale of colours
    assert canvas.bbox.height - box.height < 2.1 * canvas.dpi


def test_several_maps_stand_side_by_side_on_a_wide_page_alone() -> None:
    of = grid()
    several = [Map(f"wind from {90 * k}°", of.height, 90.0 * k) for k in range(4)]
    rows = {}
    with style.settings(style.LETTERS):
        for width in letters.SHOWN:
            canvas = maps.figure(of, several, "m", width=width)
            letters.check(canvas)
            places = [ax.get_position().y0 for ax in canvas.axes[:-1]]
            rows[width] = len({round(place, 2) for place in places})
    assert rows == {style.NARROW: 4, style.WIDE: 2}


def test_the_first_direction_and_the_last_are_named_and_marked() -> None:
    winds = np.linspace(0.0, 20.0, 41)
    curves = [
        maps.ShareCurve(
            f"from {way}°", np.clip((winds - way / 20) / 10, 0, 1), winds[:0]
        )
        for way in (0, 45, 90, 135)
    ]
    marks = [maps.Mark(5.0, 4.0, 6.5, 0.5, "half")]
    with style.settings(style.LETTERS):
        canvas = maps.shares(curves, winds, "wind at 10 m", marks, 8.0)
        letters.check(canvas)
        lone = maps.shares(curves[:1], winds, "wind", marks, 8.0)
    said = letters.entries(canvas)
    assert said == ["from 0°, the first", "directions between", "from 135°, the last"]
    (ax,) = canvas.axes
    assert {"half 5", " flat ground 8"} <= {text.get_text() for text in ax.texts}
    bar = ax.containers[0].lines[2][0].get_segments()[0]  # type: ignore[attr-defined]
    assert bar[:, 0].tolist() == [4.0, 6.5]
    assert not letters.entries(lone)


@pytest.mark.parametrize(
    ("from_deg", "east", "north"),
    [(270.0, 1, 0), (0.0, 0, -1), (90.0, -1, 0), (225.0, 1, 1), (150.0, -1, 1)],
)
def test_the_arrow_of_the_wind_points_to_where_it_blows(
    from_deg: float, east: int, north: int
) -> None:
    of = grid()
    values = of.of_faces(faces(), ["stress"])["stress"]
    with style.settings():
        canvas = maps.figure(of, [Map("one", values, from_deg)], "stress", middle=2.0)
    first, *_ = canvas.axes
    arrows = [
        each
        for each in first.texts
        if isinstance(each, Annotation) and each.get_gid() == "arrow"
    ]
    # the others point to the north
    wind = min(arrows, key=lambda each: each.xy[0])
    (x0, y0), (x1, y1) = wind.xyann, wind.xy
    signs = [0 if abs(way) < 1e-9 else np.sign(way) for way in (x1 - x0, y1 - y0)]
    assert signs == [east, north]
