"""Beds that LIGGGHTS pours: the same from the same seed, a lattice where grains rain as one."""

import subprocess
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from orchestrator.bed import packing, poured
from orchestrator.bed.line import BedLine
from orchestrator.bed.places import Places
from orchestrator.bed.poured_case import BED, DUMP, PouredBed
from orchestrator.bed.shapes import triangle
from orchestrator.errors import SolverError
from orchestrator.runs import engine
from orchestrator.study.sizes import LogNormal, Sizes
from tests.bed import by_hand

FloatArray = NDArray[np.float64]
SURFACE = 0.5 + 1 / 30
MIXED = LogNormal(sigma_g=1.3)


def _bed(sizes: Sizes | None = MIXED, seed: int = 1) -> PouredBed:
    line = BedLine((-10.0, 0.0, 14.0, 34.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    return PouredBed(line, 3.0, SURFACE, sizes, 1.0, 35.0, seed)


def _poured(one: PouredBed, cases: Path) -> Path:
    engine.execute(one, cases, 120.0)
    return cases / one.name


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _poured(_bed(), tmp_path_factory.mktemp("cases"))


def _grains(directory: Path) -> tuple[FloatArray, FloatArray]:
    rows = pd.read_csv(directory / BED)
    return rows[["x_over_d", "z_over_d"]].to_numpy(float), rows["size"].to_numpy(float)


def test_the_same_seed_gives_the_same_bytes_by_hand(mixed: Path, tmp_path: Path) -> None:
    assert by_hand.is_the_same(mixed, tmp_path / "copy")
    assert _bed(seed=2).id != _bed().id


def test_the_template_runs_as_it_lies(tmp_path: Path) -> None:
    from orchestrator.runs import assets

    assets.copy_template("liggghts/poured", tmp_path / "copy")
    ended = subprocess.run(["./Allrun"], cwd=tmp_path / "copy", capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "copy" / DUMP).stat().st_size > 1000


def test_grains_rest_on_one_another_under_the_line(mixed: Path) -> None:
    centres, sizes = _grains(mixed)
    touching = poured.contacts(Places.of(centres), sizes)
    number = np.bincount(touching.ravel(), minlength=len(sizes))
    lying = np.arange(len(sizes)) >= len(_bed().mould.floor)
    assert np.mean(number[lying] >= 2) > 0.98
    # settled again after the cut, a grain may have come up by a little, never by a layer
    assert centres[:, 1].max() < SURFACE + 0.3
    overlap = (sizes[touching[:, 0]] + sizes[touching[:, 1]]) / 2 - np.hypot(
        *(centres[touching[:, 0]] - centres[touching[:, 1]]).T
    )
    fixed = (touching < len(_bed().mould.floor)).all(axis=1)
    assert overlap[~fixed].max() < 0.01


def test_packing_and_contacts_lie_between_loose_and_close(mixed: Path) -> None:
    centres, sizes = _grains(mixed)
    inner = (centres[:, 1] > -2.5) & (centres[:, 1] < -1) & (np.abs(centres[:, 0] - 7) < 14)
    number = np.bincount(poured.contacts(Places.of(centres), sizes).ravel(), minlength=len(sizes))[
        inner
    ]
    # discs in the plane: three contacts hold a frictional packing, four one without friction
    assert 3.0 < number.mean() < 4.0


def test_one_size_is_the_equal_case(tmp_path: Path) -> None:
    equal, mixture = (_poured(_bed(sizes), tmp_path) for sizes in (None, ((1.0, 1.0),)))
    assert equal.name != mixture.name
    for one, other in zip(_grains(equal), _grains(mixture), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


class Lattice(PouredBed):
    """Equal grains that rain row by row, each above its pocket."""

    @cached_property
    def _grains(self) -> tuple[FloatArray, FloatArray]:
        floor = self.mould.floor
        rows = [floor[: len(floor) - row] + np.array([row / 2, 0.0, 1.1 * row]) for row in range(5)]
        centres = np.vstack(rows)
        return centres, np.ones(len(centres))


def test_equal_grains_that_rain_onto_a_lattice_reproduce_it(tmp_path: Path) -> None:
    one = _bed(None)
    lattice = Lattice(one.line, 3.0, SURFACE, None, 1.0, 35.0, 0)
    centres, _ = _grains(_poured(lattice, tmp_path))
    row = np.rint((centres[:, 1] + 3) / np.sin(np.pi / 3))
    np.testing.assert_allclose(centres[:, 1] + 3, row * np.sin(np.pi / 3), atol=2e-3)
    place = centres[:, 0] - row / 2 - lattice.mould.floor[0, 0]
    np.testing.assert_allclose(place, np.rint(place), atol=5e-3)
    assert row.max() == 4


def test_equal_grains_are_exposed_as_those_of_a_lattice() -> None:
    line = triangle(20.0, 12.0)
    lattice = packing.pile(
        line, entrainment_angle_deg=60.0, gap=1 / 30, pattern="aligned", mobile_layers=2
    )
    segment, along = line.nearest(lattice.centres)
    away = np.einsum("nk,nk->n", lattice.centres - line.corners[segment], line.normals[segment])
    free = poured.unshadowed(along, away, lattice.sizes / 2)
    face = (segment == line.windward) & (along < line.crest_s - 1) & (along > 1)
    np.testing.assert_array_equal(free[face], lattice.windward[face])


def test_a_grain_under_the_flank_of_a_larger_one_is_not_exposed() -> None:
    along, height = np.array([0.0, 0.7, 2.0]), np.array([1.0, 0.5, 0.5])
    radii = np.array([1.0, 0.3, 0.5])
    assert poured.unshadowed(along, height, radii).tolist() == [True, False, True]
    assert poured.unshadowed(along, height, radii / 2).tolist() == [True, True, True]


@pytest.mark.parametrize("width", [0.0, 8.0])
@pytest.mark.parametrize("sizes", [None, MIXED, LogNormal(sigma_g=1.6)])
def test_grains_in_the_air_touch_nothing(sizes: Sizes | None, width: float) -> None:
    # a step that is nearly upright, and a slope: their fixed grains stand beside those in the air
    line = BedLine((-10.0, 0.0, 0.5, 8.0, 16.0, 34.0), (0.0, 0.0, 5.0, 5.0, 1.0, 1.0), 1.0)
    bed = PouredBed(line, 6.0, SURFACE, sizes, 1.0, 35.0, 3, width)
    centres, diameters = bed._grains
    fixed, (start, end) = len(bed.mould.floor), bed.mould.ends
    touching = poured.contacts(Places(centres, width), diameters, 0.0)
    assert not (touching.max(axis=1) >= fixed).any()
    falling = centres[fixed:, 0]
    assert (falling - diameters[fixed:] / 2 > start).all()
    assert (falling + diameters[fixed:] / 2 < end).all()


def test_a_mould_that_holds_nothing_says_so(tmp_path: Path) -> None:
    directory = tmp_path / "case"
    directory.mkdir()
    table = "stage,step,grains,ke\n1,5,3,0.0\n2,9,3,0.0\n3,12,{}\n"
    (directory / "settling.csv").write_text(table.format("0,0.0"))
    with pytest.raises(SolverError, match="no grain of the poured bed is left"):
        _bed()._check_rest(directory)
    (directory / "settling.csv").write_text(table.format("3,1.0"))
    with pytest.raises(SolverError, match="does not come to rest"):
        _bed()._check_rest(directory)


def test_a_grain_stands_as_high_as_its_lowest_point_over_the_local_bed() -> None:
    line = BedLine((-9.0, 0.0, 60.0, 69.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    x = np.arange(0.5, 60)
    height = np.where(x == 30.5, 0.4, 0.0) + 0.5
    row = packing.Packing(
        centres=np.column_stack([x, height]),
        sizes=np.where(x == 40.5, 0.8, 1.0),
        mobile=np.ones(60, bool),
        windward=np.ones(60, bool),
        lee=np.zeros(60, bool),
        arc_length=x,
    )
    found = poured.standing(row, line)
    assert found[5] == pytest.approx(0.0, abs=1e-12)
    assert found[30] == pytest.approx(0.4 - 0.4 / 10, rel=0.1)
    assert found[40] == pytest.approx(0.1, abs=1e-12)
