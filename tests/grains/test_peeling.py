"""Peeling and pivots: exact in the plane and in space, blocked by a neighbour in the way."""

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.bed import deck
from orchestrator.bed.packing import Places
from orchestrator.grains import motion, peeling, threshold
from orchestrator.grains.peeling import ForceTable, Loading
from orchestrator.runs.case import templates
from orchestrator.study.parts import Grain, Protocol
from orchestrator.types import FloatArray

CRITERION = 0.3


def _flows(
    centres: FloatArray, drag: FloatArray, *, slope_deg: float = 0.0, lift: float = 0.0
) -> FloatArray:
    """Forces drag flow**2 along the bed, lift times that normal to it, over W; 0 drag is fixed."""
    alpha = math.radians(slope_deg)
    along = np.tile([math.cos(alpha), math.sin(alpha)], (len(centres), 1))
    outward = np.tile([-math.sin(alpha), math.cos(alpha)], (len(centres), 1))

    def square(ustar: FloatArray) -> FloatArray:
        return ustar**2

    def lifting(ustar: FloatArray) -> FloatArray:
        return lift * ustar**2

    loading = Loading(square, lifting, np.sqrt(drag), along, outward)
    table = ForceTable(square, lifting, weight=1.0, unit=1.0)
    tables = [table] * len(centres)
    return peeling.flows(Places.of(centres), np.ones(len(centres)), loading, tables, CRITERION)


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_grain_of_another_size_leaves_at_the_angle_of_its_own_pocket(size: float) -> None:
    half = math.sqrt(((1 + size) / 2) ** 2 - 0.25)
    centres, sizes = np.array([[0.0, half], [-0.5, 0], [0.5, 0]]), np.array([size, 1.0, 1.0])
    loading = Loading(
        np.square,
        np.zeros_like,
        np.array([1.0, 0, 0]),
        *np.tile(np.eye(2), (3, 1, 1)).transpose(1, 0, 2),
    )
    tables = [ForceTable(np.square, np.zeros_like, weight=1.0, unit=1.0)] * 3
    alone = peeling.pivots(Places.of(centres), sizes, loading, tables)
    found = peeling.flows(Places.of(centres), sizes, loading, tables, CRITERION)
    assert found[0] == alone[0] == pytest.approx(math.sqrt(0.5 / half), rel=1e-9)


def _row(count: int, beta_deg: float, slope_deg: float) -> tuple[FloatArray, int]:
    """Exposed grains in the pockets of a fixed row, along a slope; how many."""
    alpha, beta = math.radians(slope_deg), math.radians(beta_deg)
    along = np.array([math.cos(alpha), math.sin(alpha)])
    outward = np.array([-along[1], along[0]])
    upper = np.outer(2 * math.cos(beta) * np.arange(count), along)
    lower = np.outer(math.cos(beta) * (2 * np.arange(count + 1) - 1), along)
    return np.vstack([upper, lower - math.sin(beta) * outward]), count


@pytest.mark.parametrize("slope_deg", [-20.0, 0.0, 20.0])
def test_a_flow_that_runs_back_is_the_flow_over_the_turned_bed(slope_deg: float) -> None:
    centres, count = _row(5, 60, slope_deg)
    alpha = math.radians(slope_deg)
    along = np.tile([math.cos(alpha), math.sin(alpha)], (len(centres), 1))
    outward = np.column_stack([-along[:, 1], along[:, 0]])
    ratio = np.append(np.linspace(1.5, 0.5, count), np.zeros(count + 1))
    tables = [ForceTable(np.square, np.square, weight=1.0, unit=1.0)] * len(centres)
    sizes, turn = np.ones(len(centres)), np.array([-1.0, 1.0])

    def leaving(places: FloatArray, by: FloatArray, way: FloatArray, out: FloatArray) -> FloatArray:
        loading = Loading(np.square, np.square, by, way, out)
        return peeling.flows(Places.of(places), sizes, loading, tables, CRITERION)

    back = leaving(centres, -ratio, along, outward)
    turned = leaving(centres * turn, ratio, -along * turn, outward * turn)
    np.testing.assert_allclose(back, turned, rtol=1e-12)
    assert np.isfinite(back[:count]).all()


@settings(deadline=None)
@given(
    slope_deg=st.floats(0, 29),
    beta_deg=st.floats(45, 60),
    drag=st.floats(0.1, 10),
    lift=st.floats(0, 3),
)
def test_one_grain_leaves_at_the_pivot_of_eq_1(
    slope_deg: float, beta_deg: float, drag: float, lift: float
) -> None:
    centres, _ = _row(1, beta_deg, slope_deg)
    found = _flows(centres, np.array([drag, 0.0, 0.0]), slope_deg=slope_deg, lift=lift)
    alpha, beta = math.radians(slope_deg), math.radians(beta_deg)
    moment = drag * (math.sin(beta) + lift * math.cos(beta))
    assert found[0] == pytest.approx(math.sqrt(math.cos(alpha - beta) / moment), rel=1e-9)
    assert np.isinf(found[1:]).all()


def test_a_row_empties_from_its_end_where_the_stress_is_highest() -> None:
    centres, count = _row(6, 60, 15)
    drag = np.append(np.linspace(0.5, 1.5, count), np.zeros(count + 1))
    found = _flows(centres, drag, slope_deg=15)[:count]
    alone = np.sqrt(math.cos(math.radians(45)) / (drag[:count] * math.sin(math.radians(60))))
    np.testing.assert_allclose(found, alone, rtol=1e-9)
    assert (np.diff(found) < 0).all()


def test_a_grain_waits_for_the_one_in_front_that_feels_less() -> None:
    centres, count = _row(2, 60, 15)
    drag = np.array([2.0, 1.0, 0, 0, 0])
    found = _flows(centres, drag, slope_deg=15)[:count]
    assert found[0] == found[1]


def test_a_fixed_neighbour_in_front_has_to_be_climbed() -> None:
    # a grain between two level neighbours: drag alone never lifts it over, lift does
    centres = np.array([[0, 0], [1, 0], [-0.5, -math.sqrt(3) / 2], [0.5, -math.sqrt(3) / 2]])
    drag = np.array([1.0, 0, 0, 0])
    assert math.isinf(_flows(centres, drag)[0])
    assert _flows(centres, drag, lift=0.25)[0] == pytest.approx(2.0)


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
    found = []
    for number, (turned, y) in enumerate(zip(TURNED, SEAM, strict=True)):
        round_ = np.radians(turned + np.array([60.0, -60.0, 180.0]))
        below = np.column_stack([WIDE * np.cos(round_), WIDE * np.sin(round_), np.zeros(3)])
        pocket = np.vstack([below, [0.0, 0.0, DEEP]])
        found.append(pocket + np.array([4.0 * number, y, 0.0]))
    xyz = np.vstack(found)
    return Places.of(xyz[:, [0, 2]], xyz[:, 1], WIDTH)


def _loading() -> Loading:
    """Drag of u2 along x, no lift, on each uppermost grain; their weight is 1."""
    ratio = np.tile([0.0, 0.0, 0.0, 1.0], len(TURNED))
    along = np.tile([1.0, 0.0], (len(ratio), 1))
    return Loading(np.square, np.zeros_like, ratio, along, along[:, ::-1])


def test_the_pyramid_of_three_contacts_is_the_closed_form() -> None:
    places, loading = _grains(), _loading()
    tables = [ForceTable(np.square, np.zeros_like, 1.0, 0.5)] * len(loading.ratio)
    found = peeling.pivots(places, np.ones(len(tables)), loading, tables)[3::4]
    np.testing.assert_allclose(found**2, [_drag(turned) for turned in TURNED], rtol=1e-9)
    angles = peeling.pivot_angles_deg(places, np.ones(len(tables)), loading.along)[3::4]
    np.testing.assert_allclose(np.tan(np.radians(angles)), found**2, rtol=1e-9)


def test_dem_moves_a_grain_out_of_its_pocket_at_the_closed_form(tmp_path: Path) -> None:
    places, d = _grains(), 1e-3
    grains = deck.GrainTable(
        position=places.xyz * d,
        kind=np.tile([deck.FIXED] * 3 + [deck.COUNTED], len(TURNED)),
        along=_loading().along,
        sizes=np.ones(len(places.xyz)),
        diameter=d,
        density=2500.0,
        width=WIDTH,
    )
    grain = Grain(diameter=d, stiffness=1e4)
    rules = Protocol(load_increment=0.002, waiting_time=8.0)
    rising = deck.flows(0.95 * np.sqrt(_drag(0)), 1.02 * np.sqrt(_drag(60)), 0.002)
    weight = 2500.0 * np.pi / 6 * d**3 * 9.81
    numbers = {
        **{"diameter": d, "smallest": 1.0, "density": 2500.0, "gravity": 9.81},
        **deck.contact(grain, rules),
        **deck.raising(rules, 0),
        **{"slope": 0.0, "ceiling_x": 0.0, "ceiling_z": 5 * d, "behind": 30 * d},
    }
    copy = tmp_path / "bed"
    shutil.copytree(templates() / "liggghts" / "bed", copy)
    deck.write(
        copy, grains, numbers, rising, _loading().in_steps(rising.tolist()) * weight, margin=3 * d
    )
    subprocess.run(["./Allrun"], cwd=copy, check=True)
    found = threshold.of_grains(motion.read(copy, grains, 0.3, falls_out=False)).value
    np.testing.assert_allclose(found, np.sqrt([_drag(turned) for turned in TURNED]), rtol=0.005)
    # the same pocket elsewhere across the flow, here on the seam of the sides, changes nothing
    assert found[1] == pytest.approx(found[3], rel=1e-12)
