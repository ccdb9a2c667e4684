"""Beds that LIGGGHTS pours, in the plane and in strips with periodic sides."""

import shutil
import subprocess
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed import poured
from orchestrator.bed.line import BedLine
from orchestrator.bed.places import Places
from orchestrator.bed.poured import BED, DUMP, PouredBed
from orchestrator.errors import InputError, SolverError
from orchestrator.grains.geometry import Geometry
from orchestrator.runs import engine
from orchestrator.runs.case import templates
from orchestrator.study import study
from orchestrator.study.parts import LogNormal, Sizes
from orchestrator.types import FloatArray, IntArray
from tests.waiting import HANGS_S

SURFACE, WIDTH = 0.5 + 1 / 30, 4.0
MIXED = LogNormal(sigma_g=1.3)
LOOSE, CLOSE = 0.536, 0.634
"""Volume fractions of random packings of equal frictional spheres: the loosest and the closest (C.
Song, P. Wang, H. A. Makse, Nature 453, 2008, doi:10.1038/nature06981), whose grains have 4 to 6
contacts."""


def _plane(sizes: Sizes | None = MIXED, seed: int = 1) -> PouredBed:
    line = BedLine((-10.0, 0.0, 14.0, 34.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    return PouredBed(line, 3.0, SURFACE, sizes, 1.0, 35.0, seed)


def _strip(length: float = 8.0, width: float = WIDTH) -> PouredBed:
    line = BedLine((-4.0, 0.0, length, length + 4.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    return PouredBed(line, 4.0, SURFACE, None, 1.0, 35.0, 1, width)


def _run(bed: PouredBed, cases: Path) -> Path:
    engine.execute(bed, cases, HANGS_S)
    return cases / bed.name


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _run(_plane(), tmp_path_factory.mktemp("cases"))


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _run(_strip(), tmp_path_factory.mktemp("cases"))


def _grains(directory: Path, width: float = 0.0) -> tuple[Places, FloatArray, IntArray]:
    """Places and sizes of the grains, and how many others each touches."""
    x, y, z, sizes, _ = pd.read_csv(directory / BED).to_numpy(float).T
    places = Places.of(np.column_stack([x, z]), y, width)
    return places, sizes, np.bincount(places.contacts(sizes)[0], minlength=len(sizes))


@pytest.mark.parametrize("name", ["mixed", "strip"])
def test_the_same_seed_gives_the_same_bytes_by_hand(
    request: pytest.FixtureRequest, name: str, tmp_path: Path
) -> None:
    case = request.getfixturevalue(name)
    for number, folder in enumerate((case, templates() / "liggghts" / "poured")):
        copy = Path(shutil.copytree(folder, tmp_path / str(number)))
        (copy / DUMP).unlink(missing_ok=True)
        ended = subprocess.run(["./Allrun"], cwd=copy, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
        assert ((copy / DUMP).read_bytes() == (case / DUMP).read_bytes()) == (
            folder == case
        )
    assert _plane(seed=2).id != _plane().id


def test_grains_rest_on_one_another_under_the_line(mixed: Path) -> None:
    """All of it held for each of the seeds 0 to 11.

    A few grains lie on one other in unstable balance, or roll as slowly as rest allows:
    at most 2 of some 122 for 11 of these seeds, 3 for one.
    """
    places, sizes, number = _grains(mixed)
    lying = np.arange(len(sizes)) >= len(_plane().floor)
    assert np.mean(number[lying] >= 2) > 0.95
    x, _, z = places.xyz.T
    assert z.max() < SURFACE + 0.3
    first, second, apart = places.contacts(sizes)
    overlap = (sizes[first] + sizes[second]) / 2 - np.linalg.norm(apart, axis=1)
    assert overlap[lying[first] | lying[second]].max() < 0.01
    inner = (z > -2.5) & (z < -1) & (np.abs(x - 7) < 14)
    assert 3.0 < number[inner].mean() < 4.0


def test_packing_and_contacts_of_a_strip_are_those_of_spheres_in_space(
    strip: Path,
) -> None:
    """Tried on the seeds 0 to 11, and held for each."""
    places, sizes, number = _grains(strip, WIDTH)
    x, _, z = places.xyz.T
    low, high, half = -2.5, -1.0, 6.0
    inner, r = np.abs(x - x.mean()) < half, sizes / 2
    below, above = (np.clip(end - z, -r, r)[inner] for end in (low, high))
    cut = np.pi * (r[inner] ** 2 * (above - below) - (above**3 - below**3) / 3)
    assert LOOSE < cut.sum() / (2 * half * WIDTH * (high - low)) < CLOSE
    number = number[inner & (z > low) & (z < high)]
    assert 4 < number.mean() < 6
    assert np.mean(number >= 3) > 0.98


@pytest.mark.parametrize("width", [0.0, 8.0])
@pytest.mark.parametrize("sizes", [None, MIXED, LogNormal(sigma_g=1.6)])
def test_grains_in_the_air_touch_nothing(sizes: Sizes | None, width: float) -> None:
    # a step that is nearly upright, and a slope: their fixed grains stand beside those in the air
    line = BedLine(
        (-10.0, 0.0, 0.5, 8.0, 16.0, 34.0), (0.0, 0.0, 5.0, 5.0, 1.0, 1.0), 1.0
    )
    bed = PouredBed(line, 6.0, SURFACE, sizes, 1.0, 35.0, 3, width)
    centres, diameters = bed.grains
    fixed, (start, end) = len(bed.floor), bed.ends
    first, second, _ = Places(centres, width).contacts(diameters, 0.0)
    assert (first < fixed).all()
    assert (second < fixed).all()
    falling = centres[fixed:, 0]
    assert (falling - diameters[fixed:] / 2 > start).all()
    assert (falling + diameters[fixed:] / 2 < end).all()


@pytest.mark.parametrize(
    ("last", "word"),
    [
        ("0,0.0", "no grain of the poured bed is left"),
        ("3,1.0", "does not come to rest"),
    ],
)
def test_a_bed_that_is_none_or_moves_is_noticed(
    tmp_path: Path, last: str, word: str
) -> None:
    table = f"stage,step,grains,ke\n1,5,3,0.0\n2,9,3,0.0\n3,12,{last}\n"
    (tmp_path / "settling.csv").write_text(table)
    (tmp_path / "log.liggghts").write_text("the protocol has ended")
    with pytest.raises(SolverError, match=word):
        _plane().collect(tmp_path)


def test_a_grain_stands_as_high_as_its_lowest_point_over_the_local_bed() -> None:
    x, every = np.arange(0.5, 60), np.ones(60, bool)
    centres = np.column_stack([x, np.where(x == 30.5, 0.4, 0.0) + 0.5])
    sizes = np.where(x == 40.5, 0.8, 1.0)
    found = poured.standing(x, centres[:, 1], sizes, every)
    assert found[5] == pytest.approx(0.0, abs=1e-12)
    assert found[30] == pytest.approx(0.4 - 0.4 / 10, rel=0.1)
    assert found[40] == pytest.approx(0.1, abs=1e-12)


def test_a_bed_of_too_many_or_too_few_grains_is_refused() -> None:
    _strip(length=200.0).check_size()
    with pytest.raises(InputError, match=r"bed\.width"):
        _strip(length=1000.0, width=20.0).check_size()
    with pytest.raises(InputError, match=r"bed\.length: a poured bed of .* grains"):
        _strip(length=1.0).check_size()


def test_a_bed_that_was_poured_again_is_read_again(tmp_path: Path) -> None:
    text = 'kind = "flat", length = 0.014, packing = "poured", poured_depth = 3.0'
    text = f"bed = {{ {text} }}\ngrain = {{ diameter = 1e-3, sizes = {{ sigma_g = 1.3 }} }}"
    (scene,) = study.parse(text, name="bed", where="bed").scenes
    before = Geometry(scene, tmp_path)
    file = _run(before.pouring[0], tmp_path) / BED
    rows = pd.read_csv(file)
    assert len(before.packing.sizes) <= len(rows)
    rows["size"] *= 0.9
    rows.to_csv(file, index=False)
    after = Geometry(scene, tmp_path)
    assert after.packing.sizes.max() == pytest.approx(0.9 * before.packing.sizes.max())


class Lattice(PouredBed):
    """Equal grains that rain row by row, each above its pocket."""

    @cached_property
    def grains(self) -> tuple[FloatArray, FloatArray]:
        """Centres, the fixed ones first, and diameters, d."""
        floor = self.floor
        rows = []
        for number in range(5):
            above = np.array([number / 2, 0.0, 1.1 * number])
            rows.append(floor[: len(floor) - number] + above)
        centres = np.vstack(rows)
        return centres, np.ones(len(centres))


def test_equal_grains_that_rain_onto_a_lattice_reproduce_it(tmp_path: Path) -> None:
    """The one exact answer for pouring: rows of a close packing, sin(60 deg) apart."""
    lattice = Lattice(_plane().line, 3.0, SURFACE, None, 1.0, 35.0, 0)
    places, _, _ = _grains(_run(lattice, tmp_path))
    x, _, z = places.xyz.T
    row = np.rint((z + 3) / np.sin(np.pi / 3))
    np.testing.assert_allclose(z + 3, row * np.sin(np.pi / 3), atol=2e-3)
    place = x - row / 2 - lattice.floor[0, 0]
    np.testing.assert_allclose(place, np.rint(place), atol=5e-3)
    assert row.max() == 4


class OfTwoSizes(PouredBed):
    """In pockets of the floor two grains of d under a small one, and a large one."""

    @cached_property
    def grains(self) -> tuple[FloatArray, FloatArray]:
        """Centres, the fixed ones first, and diameters, d."""
        floor = self.floor
        middle = floor[len(floor) // 2]
        places = [(0.5, 0.87), (1.5, 0.87), (1.0, 1.52), (-4.5, 1.21)]
        above = np.array([[x, 0.0, z] for x, z in places])
        sizes = np.append(np.ones(len(floor)), [1.0, 1.0, 0.6, 1.6])
        return np.vstack([floor, middle + above]), sizes


@pytest.mark.parametrize(("depth", "small_stays"), [(0.5, False), (1.2, True)])
def test_a_bed_is_cut_by_the_tops_of_its_grains_over_their_diameters(
    tmp_path: Path, depth: float, small_stays: bool
) -> None:
    """The pockets are exact: over their row grains of 1.6, 1 and 0.6 d lie 1.2, 0.87 and 0.62."""
    bed = OfTwoSizes(_plane().line, depth, SURFACE, MIXED, 1.0, 35.0, 0)
    rows = pd.read_csv(_run(bed, tmp_path) / BED)
    left = rows[rows["fixed"] == 0].set_index("size")["z_over_d"].sort_index()
    unit = np.sqrt(0.75) - depth
    large = np.sqrt(1.3**2 - 0.5**2) - depth
    small = unit + np.sqrt(0.8**2 - 0.5**2)
    # the centre of the large grain lies above the line, its top within 1.6 d of the bed
    assert (large > SURFACE) == (depth == 0.5)
    assert large - 0.8 < SURFACE - 0.5
    # that of the small one lies within 0.6 d of it on the lower bed alone
    assert (small - 0.3 < SURFACE - 0.5) == small_stays
    sizes = [0.6, 1.0, 1.0, 1.6] if small_stays else [1.0, 1.0, 1.6]
    heights = [small, unit, unit, large] if small_stays else [unit, unit, large]
    np.testing.assert_allclose(left.index, sizes)
    np.testing.assert_allclose(left, heights, atol=2e-3)
