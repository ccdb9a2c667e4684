"""Pockets in space: the closed form of a pocket of three grains, by the pyramid and by DEM."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from orchestrator.bed import deck
from orchestrator.bed.packing import Places
from orchestrator.grains import motion, peeling, threshold
from orchestrator.grains.peeling import ForceTable, Loading
from orchestrator.runs.case import templates
from orchestrator.study.parts import Grain, Protocol

FloatArray = NDArray[np.float64]

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
