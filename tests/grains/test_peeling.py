"""Peeling and pivots: exact in the plane and in space, blocked by a neighbour in the way."""

import gc
import math
import shutil
import subprocess
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.bed import deck
from orchestrator.bed.places import Places
from orchestrator.grains import motion, peeling, threshold
from orchestrator.grains.peeling import Force, ForceTable, Loading
from orchestrator.runs.case import templates
from orchestrator.study.method import GrainMethod
from orchestrator.study.parts import GrainPart, Gusts
from orchestrator.types import BoolArray, FloatArray


def _along(slope_deg: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Unit vectors along and out of a bed of a slope, for some grains."""
    alpha = math.radians(slope_deg)
    along = np.tile([math.cos(alpha), math.sin(alpha)], (count, 1))
    return along, np.column_stack([-along[:, 1], along[:, 0]])


def _law(lift: float) -> tuple[Force, Force]:
    """Drag of the friction velocity squared, over W, and lift as a part of it."""
    return np.square, lambda ustar: lift * ustar**2


def _tables(count: int, lift: float = 0.0, unit: float = 1.0) -> dict[int, ForceTable]:
    ustar = unit * np.geomspace(*peeling.RANGE, peeling.FINE_TABLE)
    return dict(enumerate(ForceTable.of(*_law(lift), np.ones(count), ustar)))


def _flows(
    centres: FloatArray, ratio: FloatArray, *, slope_deg: float = 0.0, lift: float = 0.0
) -> FloatArray:
    """The flow at which each grain leaves; those of a ratio of 0 feel none, and are fixed."""
    loading = Loading(*_law(lift), ratio, *_along(slope_deg, len(centres)))
    tables = {i: table for i, table in _tables(len(centres), lift).items() if ratio[i]}
    return peeling.leaving(
        Places.of(centres), np.ones(len(centres)), loading, tables, 0.3
    )


def test_a_table_of_forces_is_freed_with_its_last_user() -> None:
    table = _tables(1)[0]
    assert table.reaching(0.5, 0.0, 1.0) == table.reaching(0.5, 0.0, 1.0)
    freed = weakref.ref(table)
    gc.disable()
    try:
        del table
        assert freed() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_grain_of_another_size_leaves_at_the_angle_of_its_own_pocket(
    size: float,
) -> None:
    half = math.sqrt(((1 + size) / 2) ** 2 - 0.25)
    centres, sizes = (
        np.array([[0.0, half], [-0.5, 0], [0.5, 0]]),
        np.array([size, 1.0, 1.0]),
    )
    loading = Loading(*_law(0.0), np.array([1.0, 0, 0]), *_along(0.0, 3))
    bed = Places.of(centres), sizes, loading, _tables(3)
    alone, leaving = peeling.pivots(*bed)[0], peeling.leaving(*bed, criterion=0.3)[0]
    assert leaving == alone == pytest.approx(math.sqrt(0.5 / half), rel=1e-9)


def _row(count: int, beta_deg: float, slope_deg: float) -> FloatArray:
    """Exposed grains, the first, in the pockets of a fixed row, along a slope."""
    (along,), (outward,) = _along(slope_deg, 1)
    beta = math.radians(beta_deg)
    upper = np.outer(2 * math.cos(beta) * np.arange(count), along)
    lower = np.outer(math.cos(beta) * (2 * np.arange(count + 1) - 1), along)
    return np.vstack([upper, lower - math.sin(beta) * outward])


@pytest.mark.parametrize("slope_deg", [-20.0, 0.0, 20.0])
def test_a_flow_that_runs_back_is_the_flow_over_the_turned_bed(
    slope_deg: float,
) -> None:
    centres, ratio = (
        _row(5, 60, slope_deg),
        np.append(np.linspace(1.5, 0.5, 5), np.zeros(6)),
    )
    back = _flows(centres, -ratio, slope_deg=slope_deg, lift=1.0)
    turned = _flows(centres * [-1.0, 1.0], ratio, slope_deg=-slope_deg, lift=1.0)
    np.testing.assert_allclose(back, turned, rtol=1e-12)
    assert np.isfinite(back[:5]).all()


@settings(deadline=None)
@given(st.floats(0, 29), st.floats(45, 60), st.floats(0.1, 10), st.floats(0, 3))
def test_one_grain_leaves_at_the_pivot_of_eq_1(
    slope_deg: float, beta_deg: float, drag: float, lift: float
) -> None:
    ratio = np.array([math.sqrt(drag), 0.0, 0.0])
    leaving = _flows(
        _row(1, beta_deg, slope_deg), ratio, slope_deg=slope_deg, lift=lift
    )
    alpha, beta = math.radians(slope_deg), math.radians(beta_deg)
    moment = drag * (math.sin(beta) + lift * math.cos(beta))
    assert leaving[0] == pytest.approx(
        math.sqrt(math.cos(alpha - beta) / moment), rel=1e-9
    )
    assert np.isinf(leaving[1:]).all()


def test_a_row_empties_from_its_end_where_the_stress_is_highest() -> None:
    drag = np.append(np.linspace(0.5, 1.5, 6), np.zeros(7))
    leaving = _flows(_row(6, 60, 15), np.sqrt(drag), slope_deg=15)[:6]
    alone = np.sqrt(
        math.cos(math.radians(45)) / (drag[:6] * math.sin(math.radians(60)))
    )
    np.testing.assert_allclose(leaving, alone, rtol=1e-9)
    # a grain waits for the one in front that feels less
    waiting = _flows(_row(2, 60, 15), np.array([1.4, 1.0, 0, 0, 0]), slope_deg=15)
    assert waiting[0] == waiting[1]


def test_a_fixed_neighbour_in_front_has_to_be_climbed() -> None:
    # a grain between two level neighbours: drag alone never lifts it over, lift does
    centres = np.array(
        [[0, 0], [1, 0], [-0.5, -math.sqrt(3) / 2], [0.5, -math.sqrt(3) / 2]]
    )
    ratio = np.array([1.0, 0, 0, 0])
    assert math.isinf(_flows(centres, ratio)[0])
    assert _flows(centres, ratio, lift=0.25)[0] == pytest.approx(2.0)


TURNED = (0.0, 25.0, 60.0, 25.0)
"""Angles between the flow and the saddle ahead, degrees; at 60 a grain lies straight ahead."""
WIDTH, SEAM = 6.0, (3.0, 3.0, 3.0, 5.9)
"""The last pocket lies on the seam of the sides."""
DEEP, WIDE = np.sqrt(2 / 3), np.sqrt(1 / 3)
"""Of a grain over three that touch: height, and distance of their centres from its axis, d."""


def _drag(turned: float) -> float:
    """Drag over weight at which the grain begins to roll through the saddle."""
    return float(WIDE / 2 / DEEP / np.cos(np.radians(turned)))


def _grains() -> Places:
    """Four pockets of three grains with one on them, the fourth of each."""
    round_ = np.radians(np.add.outer(TURNED, [60.0, -60.0, 180.0]))
    below = np.stack([WIDE * np.cos(round_), WIDE * np.sin(round_), 0 * round_], axis=2)
    pockets = np.concatenate([below, np.tile([0.0, 0.0, DEEP], (4, 1, 1))], axis=1)
    pockets += np.column_stack([4.0 * np.arange(4), SEAM, np.zeros(4)])[:, None]
    x, y, z = pockets.reshape(-1, 3).T
    return Places.of(np.column_stack([x, z]), y, WIDTH)


def _loading() -> Loading:
    """Drag of u2 along x, no lift, on each uppermost grain; their weight is 1."""
    ratio = np.tile([0.0, 0.0, 0.0, 1.0], len(TURNED))
    return Loading(*_law(0.0), ratio, *_along(0.0, len(ratio)))


def test_the_pyramid_of_three_contacts_is_the_closed_form() -> None:
    places, loading = _grains(), _loading()
    tables = _tables(len(loading.ratio), unit=0.5)
    ustar = peeling.pivots(places, np.ones(len(tables)), loading, tables)[3::4]
    np.testing.assert_allclose(
        ustar**2, [_drag(turned) for turned in TURNED], rtol=1e-9
    )
    angles = peeling.pivot_angles_deg(places, np.ones(len(tables)), loading.along)[3::4]
    np.testing.assert_allclose(np.tan(np.radians(angles)), ustar**2, rtol=1e-9)


def _moved_by_dem(
    copy: Path,
    grains: deck.GrainTable,
    force: FloatArray,
    waiting_time: float,
    displacement: float,
    **given: Any,
) -> motion.Motion:
    """Motion of grains of 1 mm under forces (W) at the friction velocities of load steps."""
    d, weight = grains.diameter, 2500.0 * np.pi / 6 * grains.diameter**3 * 9.81
    numbers = {
        **{"diameter": d, "smallest": 1.0, "density": 2500.0, "gravity": 9.81},
        **deck.protocol(
            GrainPart(diameter=d),
            GrainMethod(stiffness=3e4, waiting_time=waiting_time),
            displacement,
            gusts=given.pop("asked", None),
        ),
        **{"slope": 0.0, "ceiling_x": 0.0, "ceiling_z": 5 * d, "behind": 30 * d},
    }
    shutil.copytree(templates() / "liggghts" / "bed", copy)
    deck.write_deck(
        copy, grains, numbers, given.pop("rising"), force * weight, 3 * d, **given
    )
    subprocess.run(["./Allrun"], cwd=copy, check=True)
    return motion.read_motion(copy, grains, displacement, falls_out=False)


def _around(elevation_deg: float, turned_deg: float) -> FloatArray:
    """Three directions, 120 degrees apart, of an elevation, shape (3, 3)."""
    azimuth = np.radians(turned_deg + np.array([0.0, 120.0, 240.0]))
    up = np.radians(elevation_deg)
    flat = np.column_stack([np.cos(azimuth), np.sin(azimuth)]) * np.cos(up)
    return np.column_stack([flat, np.full(3, np.sin(up))])


@pytest.mark.parametrize(("elevation_deg", "locked"), [(20.0, True), (-20.0, False)])
def test_a_grain_is_surrounded_where_its_contacts_leave_no_way(
    elevation_deg: float, locked: bool
) -> None:
    """Three grains bear it, three are at its flanks: above its centre they lock it."""
    touching = np.vstack([_around(-60.0, 0.0), _around(elevation_deg, 60.0)])
    middle = np.array([10.0, 10.0, 10.0])
    places = Places(np.vstack([middle, middle + touching]), 20.0)
    only = np.arange(7) == 0
    found = peeling.surrounded(places, np.ones(7), only)
    assert found.tolist() == [locked] + 6 * [False]
    angle = peeling.pivot_angles_deg(places, np.ones(7), np.tile([1.0, 0.0], (7, 1)), 0)
    assert np.isnan(angle[0]) == locked
    in_plane = Places.of(np.array([[0.0, 0.0], [1.0, 0.1], [-1.0, 0.1]]))
    assert not peeling.surrounded(in_plane, np.ones(3), np.ones(3, bool)).any()


def test_dem_moves_a_grain_out_of_its_pocket_at_the_closed_form(tmp_path: Path) -> None:
    places, d = _grains(), 1e-3
    kind = np.tile([deck.FIXED] * 3 + [deck.COUNTED], len(TURNED))
    along, sizes = _loading().along, np.ones(len(places.xyz))
    grains = deck.GrainTable(places.xyz * d, kind, along, sizes, d, 2500.0, WIDTH)
    rising = deck.rising_flows(
        0.95 * np.sqrt(_drag(0)), 1.02 * np.sqrt(_drag(60)), 0.002
    )
    force = _loading().at(rising)
    moved = _moved_by_dem(tmp_path / "b", grains, force, 8.0, 0.3, rising=rising)
    ustar = threshold.of_grains(moved).value
    np.testing.assert_allclose(
        ustar, np.sqrt([_drag(turned) for turned in TURNED]), rtol=0.005
    )
    # the same pocket elsewhere across the flow, here on the seam of the sides, changes nothing
    assert ustar[1] == pytest.approx(ustar[3], rel=1e-12)


def _leaves(push: FloatArray, duration: float) -> BoolArray:
    """Which spheres roll over a pivot of 30 deg under a drag, over the least, that ends."""
    start, step, speed = -math.pi / 6, duration / 10_000, np.zeros(len(push))
    angle, over = np.full(len(push), start), np.zeros(len(push), bool)
    for _ in range(10_000):
        torque = np.sin(angle) + push * math.tan(math.pi / 6) * np.cos(angle)
        speed = speed + 5 / 7 * torque * step
        angle = np.maximum(angle + speed * step, start)
        speed = np.where(angle > start, speed, 0.0)
        over |= angle > 0
    return np.asarray(over | ((speed > 0) & (0.7 * speed**2 > 1 - np.cos(angle))))


@pytest.mark.parametrize("duration", [0.5, 1.0, 2.0, 20.0])
def test_a_gust_moves_a_grain_by_its_impulse(tmp_path: Path, duration: float) -> None:
    push = np.linspace(0.98, 4.0, 303)
    x, z = np.tile([[-0.5, 0.5, 0.0], [0.0, 0.0, math.sqrt(0.75)]], len(push))
    places = np.column_stack([x, np.repeat(3.0 * np.arange(len(push)), 3), z])
    kind = np.tile([deck.FIXED, deck.FIXED, deck.COUNTED], len(push))
    ways, ones = np.tile([1.0, 0.0], (len(x), 1)), np.ones(len(x))
    grains = deck.GrainTable(places * 1e-3, kind, ways, ones, 1e-3, 2500.0)
    force = np.tile(
        np.where(kind == deck.COUNTED, np.repeat(push, 3), 0.0)[:, None], (2, 1, 2)
    )
    force *= [math.tan(math.pi / 6), 0.0]
    gust = Gusts(intensity=0.4, events=2, duration=duration / 2)
    gusts = {"asked": gust, "gusts": np.array([0.0, 1.0, 1.0, 0.0])}
    level = _moved_by_dem(
        tmp_path / "b", grains, force, 10.0, 0.5, rising=np.ones(2), **gusts
    ).load_step
    exact = push[_leaves(push, duration)].min()
    assert push[level > 0].min() == pytest.approx(exact, rel=0.015)
