"""The stress along the bed: exact means, and a table that loses nothing."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from orchestrator.errors import InputError, SolverError
from orchestrator.flow.solved import SolvedFlow
from orchestrator.flow.stress import WallStress, undisturbed_ustar

FloatArray = NDArray[np.float64]


@pytest.fixture
def stress() -> WallStress:
    """A bed of 60 unequal faces, with flow that runs back on some."""
    random = np.random.default_rng(7)
    length = random.uniform(1e-4, 3e-3, 60)
    tau, eq10 = random.normal(1.0, 1.0, (2, 60))
    return WallStress(
        s_m=np.cumsum(length) - length / 2.0 - length[:20].sum(),
        x_m=random.normal(size=60),
        z_m=random.normal(size=60),
        length_m=length,
        z_e_m=random.uniform(2e-4, 4e-4, 60),
        tau_wall=tau,
        ustar_over_ustar0_eq10=eq10,
        ustar_over_ustar0_eq10_printed=1.04 * eq10,
    )


def overlap_mean(stress: WallStress, values: np.ndarray, s: float, length: float) -> float:
    """The mean by its definition, face by face."""
    starts, ends = stress.edges_m[:-1], stress.edges_m[1:]
    shared = np.minimum(ends, s + length / 2.0) - np.maximum(starts, s - length / 2.0)
    return float(np.sum(values * np.maximum(shared, 0.0)) / length)


@pytest.mark.parametrize("length", [1e-6, 5e-4, 1e-2])
def test_mean_is_the_integral_of_the_faces(stress: WallStress, length: float) -> None:
    places = np.linspace(stress.edges_m[0] + length, stress.edges_m[-1] - length, 97)
    expected = [overlap_mean(stress, stress.tau_wall, s, length) for s in places]
    np.testing.assert_allclose(stress.mean_over(places, length), expected, rtol=1e-8, atol=1e-8)


def test_mean_of_eq10_is_that_of_its_signed_square(stress: WallStress) -> None:
    squares = np.sign(stress.ustar_over_ustar0_eq10) * stress.ustar_over_ustar0_eq10**2
    expected = overlap_mean(stress, squares, 0.01, 4e-3)
    assert stress.mean_over(0.01, 4e-3, "eq10") == pytest.approx(expected, rel=1e-12)


def test_mean_within_one_face_is_its_value(stress: WallStress) -> None:
    within = stress.mean_over(stress.s_m, 0.9 * stress.length_m)
    np.testing.assert_allclose(within, stress.tau_wall, rtol=1e-9)


def _bent(slope_deg: float, tau: Callable[[FloatArray], FloatArray]) -> WallStress:
    """A flat bed, then a slope from s = 0 on, of 20 faces each 1 mm long; tau of each from s."""
    s = np.arange(-19.5, 20) * 1e-3
    up = np.where(s > 0, np.radians(slope_deg), 0.0)
    return WallStress(
        s_m=s,
        x_m=s * np.cos(up),
        z_m=s * np.sin(up),
        length_m=np.full(40, 1e-3),
        z_e_m=np.full(40, 5e-4),
        tau_wall=tau(s),
        ustar_over_ustar0_eq10=tau(s),
        ustar_over_ustar0_eq10_printed=tau(s),
    )


@pytest.mark.parametrize("slope_deg", [0.0, 10.0, 35.0])
def test_a_stress_that_is_linear_is_read_exactly(slope_deg: float) -> None:
    stress = _bent(slope_deg, lambda s: 1.0 + 30.0 * s)
    places = np.linspace(-19e-3, 19e-3, 77)
    np.testing.assert_allclose(stress.mean_over(places, 2e-4), 1.0 + 30.0 * places, rtol=1e-9)


def test_a_jump_at_a_bend_is_not_smeared() -> None:
    stress = _bent(15.0, lambda s: np.where(s > 0, 2.0, 0.5))
    np.testing.assert_allclose(stress.mean_over([-2e-4, 2e-4], 2e-4), [0.5, 2.0], rtol=1e-9)


def test_no_face_reaches_beyond_its_neighbours() -> None:
    stress = _bent(0.0, lambda s: np.where(s > 0.0101, 2.0, np.where(s > 0, 0.5, 0.4)))
    read = stress.mean_over(np.linspace(-19e-3, 19e-3, 400), 1e-5)
    assert read.min() >= 0.4 - 1e-9
    assert read.max() <= 2.0 + 1e-9


def test_mean_over_the_whole_bed(stress: WallStress) -> None:
    start, end = stress.edges_m[0], stress.edges_m[-1]
    whole = stress.mean_over((start + end) / 2.0, (end - start) * (1.0 - 1e-12))
    assert whole == pytest.approx(np.average(stress.tau_wall, weights=stress.length_m))


@pytest.mark.parametrize(("s", "length"), [(0.0, 0.0), (0.0, -1.0), (0.0, 1.0), (9.0, 1e-4)])
def test_no_mean_beyond_the_bed(stress: WallStress, s: float, length: float) -> None:
    with pytest.raises(InputError, match="within the bed"):
        stress.mean_over(s, length)


def test_friction_velocity_keeps_the_sign(stress: WallStress) -> None:
    ustar = stress.ustar_over_ustar0_wall
    assert np.any(ustar < 0.0)
    np.testing.assert_allclose(ustar * np.abs(ustar), stress.tau_wall)


def test_table_gives_the_same_numbers_back(stress: WallStress, tmp_path: Path) -> None:
    stress.to_csv(tmp_path / "one.csv")
    again = WallStress.from_csv(tmp_path / "one.csv")
    for field in fields(stress):
        np.testing.assert_array_equal(getattr(again, field.name), getattr(stress, field.name))
    again.to_csv(tmp_path / "two.csv")
    assert (tmp_path / "two.csv").read_bytes() == (tmp_path / "one.csv").read_bytes()


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "\n"])
def test_another_table_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.csv").write_text(text)
    with pytest.raises(InputError, match=r"other\.csv: not a table"):
        WallStress.from_csv(tmp_path / "other.csv")


def test_undisturbed_friction_velocity_gives_the_speed_at_the_lid() -> None:
    ustar0 = undisturbed_ustar(10.0, 0.2, 1e-4)
    assert ustar0 / 0.41 * np.log((0.2 + 1e-4) / 1e-4) == pytest.approx(10.0)


def test_a_case_that_has_not_run_has_no_stress(template: Path) -> None:
    with pytest.raises(SolverError, match=r"no results \(run \./Allrun there\)"):
        SolvedFlow(template).stress()


def test_vtk_is_not_loaded_before_it_is_needed() -> None:
    heavy = "{'gmsh', 'meshio', 'pyvista', 'vtkmodules'}"
    code = f"import sys, orchestrator.flow.case; sys.exit(bool({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
