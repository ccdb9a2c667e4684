"""Hours a year on a surface: between its flows, and with the interval of the threshold."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics.grain import Grain
from orchestrator.report import style
from orchestrator.surface import cards, onset, winds
from orchestrator.surface.answer import HEAP, MOVES, Direction, Ground, SurfaceAnswer
from orchestrator.surface.heights import cone
from orchestrator.surface.rose import read_rose
from tests import letters

SAND = Grain(
    diameter=2.5e-4,
    density=2650.0,
    fluid_density=1.225,
    viscosity=1.46e-5,
    roughness=2.5e-4 / 30,
    entrainment_angle_deg=60.0,
)
GROUND = Ground(SAND, "bridged", 0.005)
WHERE = "heap.toml: erosion.wind"


def direction(from_deg: float, wind: float) -> Direction:
    """A flow in which one face after another of ten begins to move, from a wind on."""
    faces = pd.DataFrame(
        {HEAP: 1, MOVES: wind * np.linspace(1.0, 1.9, 10), "area_m2": np.ones(10)}
    )
    return Direction(from_deg, faces)


def answer(rows: str, *directions: Direction, ground: Ground = GROUND) -> SurfaceAnswer:
    """What lies on a cone under some winds."""
    rose = read_rose(f"from_deg,speed_m_s,share\n{rows}", "year.csv", WHERE)
    flows = [each.from_deg for each in directions]
    solved = rose.solved(flows, WHERE, 0.005, 10.0)
    return SurfaceAnswer("cone", cone(5.0, 30.0), ground, directions, 0.5, solved)


def even(low: float, high: float) -> str:
    """A wind from the north whose speed is anything between two ends."""
    speeds = np.linspace(low, high, 2001)
    return "".join(f"0,{speed:.6f},{1 / 2001!r}\n" for speed in speeds)


def test_hours_are_those_above_the_threshold() -> None:
    found = answer(even(0.0, 20.0), direction(0.0, 10.0))
    # a tenth of the area moves from 10 m/s on, half from 14 m/s on
    assert found.hours_of(0.1) == pytest.approx(8760 * 0.5, rel=2e-3)
    assert found.hours_of(0.5) == pytest.approx(8760 * 0.3, rel=2e-3)
    assert found.hours_of(0.1, 1.2) == pytest.approx(8760 * 0.4, rel=2e-3)


def test_the_interval_of_the_threshold_is_carried_through_to_the_hours() -> None:
    found = answer(even(0.0, 20.0), direction(0.0, 10.0))
    low, high = cards.factors_of_wind(onset.STARTS)
    of_grain = GROUND.factors
    assert of_grain[0] < 1 < of_grain[1]
    least = np.exp(-np.hypot(np.log(low), np.log(of_grain[0])))
    most = np.exp(np.hypot(np.log(high), np.log(of_grain[1])))
    hours = cards.hours(found, cards.TENTH)
    assert hours.value == pytest.approx(8760 * 0.5, rel=2e-3)
    # a higher threshold is reached in fewer hours
    assert hours.low == pytest.approx(8760 * (1 - 0.5 * most), rel=5e-3)
    assert hours.high == pytest.approx(8760 * (1 - 0.5 * least), rel=5e-3)
    assert re.fullmatch(r"\d,\d{3} to \d,\d{3}", hours.text)
    assert "of the grain's threshold" in hours.of
    # a given threshold has no interval of a grain
    given = replace(GROUND, threshold=0.4)
    only = cards.hours(answer(even(0.0, 20.0), direction(0.0, 10.0), ground=given), 0.1)
    assert only.low == pytest.approx(8760 * (1 - 0.5 * high), rel=5e-3)
    assert only.low > hours.low
    assert "grain" not in only.of


def test_winds_between_two_flows_meet_a_threshold_between_theirs() -> None:
    """Half-way between 6 and 12 m/s it is 8 m/s, by the friction velocity."""
    directions = [direction(0.0, 6.0), direction(90.0, 12.0)]
    # sectors of 1 degree about 45
    rows = "".join(f"{way},{{}},{1 / 360}\n" for way in range(45, 46))
    rest = "".join(f"{way},1,{1 / 360}\n" for way in range(45))
    rest += "".join(f"{way},1,{1 / 360}\n" for way in range(46, 91))
    calm = f"0,0,{269 / 360}\n"
    for speed, hours in ((7.8, 0.0), (8.2, 8760 / 360)):
        found = answer(rows.format(speed) + rest + calm, *directions)
        assert found.hours_of(0.1) == pytest.approx(hours, rel=1e-6, abs=1e-9)


def test_a_flow_that_is_left_out_measures_what_lies_between() -> None:
    circle = [direction(45.0 * k, 10.0) for k in range(8)]
    circle[3] = direction(135.0, 12.0)
    found = answer("0,9,1\n", *circle)
    worst = found.left_out(0.1)
    assert worst is not None
    # 10 m/s between two of 10; its neighbours lie between 10 and 12
    assert worst.from_deg == 135.0
    assert worst.off == pytest.approx(1 - 10 / 12)
    assert worst.gap == 90.0
    said = " ".join(cards.surface_sentences(found, ""))
    assert "a tenth of the surface within 16.7 % (that from 135°)" in said
    assert "half of it within 16.7 % (from 135°)" in said
    apart = answer("0,9,1\n", *circle[::2])
    assert apart.left_out(0.1) is None
    assert "flows 45° apart would tell how well" in " ".join(
        cards.surface_sentences(apart, "")
    )


def test_the_rose_is_drawn_with_all_hours_of_its_year() -> None:
    circle = [direction(45.0 * k, 6.0) for k in range(8)]
    rows = "".join(f"{22.5 * k},{3 + k % 5},0.05\n" for k in range(16))
    found = answer(f"{rows}0,0,0.2\n", *circle)
    with style.settings(style.LETTERS):
        for width in letters.SHOWN:
            letters.check(winds.rose_figure(found, width))
    canvas = winds.rose_figure(found, style.WIDE)
    polar, bars = canvas.axes
    # parts in which some of the bed moves, and half of it, are those of the card
    heights = np.reshape([patch.get_height() for patch in polar.patches], (3, -1))  # type: ignore[attr-defined]
    some, half = found.hours_of(onset.STARTS), found.hours_of(cards.HALF)
    assert heights.sum(1)[1:] == pytest.approx([some - half, half])
    drawn = sum(patch.get_height() for patch in polar.patches)  # type: ignore[attr-defined]
    assert drawn == pytest.approx(0.8 * 8760)
    # calms are the disc in the middle
    below = min(patch.get_y() for patch in polar.patches)  # type: ignore[attr-defined]
    assert below == pytest.approx(0.2 * 8760 / 16)
    assert len(bars.patches) == 3
    assert bars.patches[0].get_height() >= bars.patches[1].get_height()  # type: ignore[attr-defined]
