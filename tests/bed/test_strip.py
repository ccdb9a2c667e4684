"""Strips in space: poured beds that are periodic across the flow."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from orchestrator.bed import poured
from orchestrator.bed.line import BedLine
from orchestrator.bed.places import Places
from orchestrator.bed.poured_case import BED, PouredBed
from orchestrator.errors import InputError
from orchestrator.runs import engine
from orchestrator.study import study
from tests.bed import by_hand

FloatArray = NDArray[np.float64]
WIDTH, DEPTH, SURFACE = 4.0, 4.0, 0.5 + 1 / 30
INNER = 6.0
"""Half the length that is away from the walls, d."""
LOOSE, CLOSE = 0.536, 0.634
"""Volume fractions of random packings of equal frictional spheres: the loosest and the closest (C.
Song, P. Wang, H. A. Makse, Nature 453, 2008, doi:10.1038/nature06981), whose grains have 4 to 6
contacts."""


def _bed(length: float = 8.0, width: float = WIDTH) -> PouredBed:
    line = BedLine((-4.0, 0.0, length, length + 4.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    return PouredBed(line, DEPTH, SURFACE, None, 1.0, 35.0, 1, width)


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cases = tmp_path_factory.mktemp("cases")
    engine.execute(_bed(), cases, 600.0)
    return cases / _bed().name


def _grains(directory: Path) -> tuple[Places, FloatArray]:
    rows = pd.read_csv(directory / BED)
    centres = rows[["x_over_d", "z_over_d"]].to_numpy(float)
    return Places.of(centres, rows["y_over_d"].to_numpy(float), WIDTH), rows["size"].to_numpy(float)


def _filled(places: Places, sizes: FloatArray, low: float, high: float) -> float:
    """Part of the volume between two heights that spheres fill, away from the walls."""
    x, _, z = places.xyz.T
    inner = np.abs(x - x.mean()) < INNER
    r = sizes[inner] / 2
    below, above = (np.clip(end - z[inner], -r, r) for end in (low, high))
    cut = np.pi * (r**2 * (above - below) - (above**3 - below**3) / 3)
    return float(cut.sum() / (2 * INNER * WIDTH * (high - low)))


def test_packing_and_contacts_are_those_of_spheres_in_space(strip: Path) -> None:
    places, sizes = _grains(strip)
    low, high = 1.5 - DEPTH, -1.0
    assert LOOSE < _filled(places, sizes, low, high) < CLOSE
    x, _, z = places.xyz.T
    inner = (np.abs(x - x.mean()) < INNER) & (z > low) & (z < high)
    number = np.bincount(poured.contacts(places, sizes).ravel(), minlength=len(sizes))
    assert 4 < number[inner].mean() < 6
    assert np.mean(number[inner] >= 3) > 0.98


def test_the_same_seed_gives_the_same_bytes_by_hand(strip: Path, tmp_path: Path) -> None:
    assert by_hand.is_the_same(strip, tmp_path / "copy")


def test_where_the_sides_are_changes_neither_who_is_exposed_nor_who_touches(strip: Path) -> None:
    places, sizes = _grains(strip)
    x, y, z = places.xyz.T
    free = poured.unshadowed(x, z, sizes / 2, y, WIDTH)
    assert 0.8 < free.sum() / (WIDTH * np.ptp(x)) < 2.0
    touching = {tuple(pair) for pair in poured.contacts(places, sizes).tolist()}
    for shift in (0.5, 1.7, 3.9):
        moved = Places.of(np.column_stack([x, z]), y + shift, WIDTH)
        again = poured.unshadowed(x, z, sizes / 2, moved.xyz[:, 1], WIDTH)
        np.testing.assert_array_equal(again, free)
        assert {tuple(pair) for pair in poured.contacts(moved, sizes).tolist()} == touching


def test_a_grain_across_the_sides_covers_and_touches() -> None:
    x, z = np.zeros(2), np.array([0.0, 0.9])
    y = np.array([0.1, 3.8])
    assert poured.unshadowed(x, z, np.full(2, 0.5), y, WIDTH).tolist() == [False, True]
    assert poured.unshadowed(x, z, np.full(2, 0.5), y, 0.0).tolist() == [True, True]
    assert len(poured.contacts(Places.of(np.column_stack([x, z]), y, WIDTH), np.ones(2))) == 1
    assert len(poured.contacts(Places.of(np.column_stack([x, z]), y), np.ones(2))) == 0


@pytest.mark.parametrize(
    ("bed", "grain", "method", "says"),
    [
        ('packing = "poured", width = 2.5', "", "dem", "less than 3 of the largest grains"),
        ('packing = "poured", width = 4.0', "{ sigma_g = 1.4 }", "dem", "at least 5.88"),
        ('packing = "aligned", width = 5.0', "", "dem", "one layer in the plane"),
        ('packing = "poured", width = 5.0', "", "peeling", "in the plane of the flow alone"),
        ('packing = "poured", width = 80.0', "", "dem", "bed.width"),
    ],
)
def test_a_strip_that_cannot_be_is_refused(bed: str, grain: str, method: str, says: str) -> None:
    text = f"""
    grain = {{ diameter = 1e-3 {", sizes = " + grain if grain else ""} }}
    bed = {{ kind = "pile", shape = "flat", length = 0.02, {bed} }}
    flow = {{ model = "flat" }}
    protocol = {{ method = "{method}" }}
    """
    with pytest.raises(InputError) as refused:
        _ = study.parse(text, name="strip", where="test").scenes
    assert says in str(refused.value)
    assert "bed.width" in str(refused.value)


def test_a_strip_of_too_many_grains_is_refused() -> None:
    _bed(length=200.0).check_size()
    with pytest.raises(InputError, match=r"bed\.width"):
        _bed(length=1000.0, width=20.0).check_size()


def test_bed_in_the_plane_knows_no_width() -> None:
    bed = 'bed = { kind = "pile", packing = "poured", slope_deg = 20.0%s }'
    text = f"grain = {{ diameter = 1e-3 }}\n{bed}"
    plain, none, strip = (
        study.parse(text % width, name="plane", where="test").scenes[0]
        for width in ("", ", width = 0.0", ", width = 5.0")
    )
    assert plain.id == none.id != strip.id
