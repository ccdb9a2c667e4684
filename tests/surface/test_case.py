"""The flow over a surface, solved by the real solver on small meshes."""

import re
import shutil
import subprocess
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import SolverError, Stalled
from orchestrator.flow.foam import BED_FLOW, SolvedFlow
from orchestrator.flow.run import DIAGNOSTICS, WALL_STRESS
from orchestrator.runs import case
from orchestrator.surface.case import (
    SurfaceFlowCase,
    cell_length,
)
from orchestrator.surface.heights import Plane, Surface, cone, surface_of
from orchestrator.surface.mesh import COARSE, STANDARD, Level
from orchestrator.surface.stress import SurfaceStress
from orchestrator.types import FloatArray
from tests.conftest import Shared
from tests.flow.conftest import allrun, copied, edit, of_hill
from tests.flow.test_wall_shear import assert_same, by_function_object

SMALL = Level("small", 6, 1, 1.35, 1.5, 8000)
HEIGHT, RADIUS, STEPS = 10.0, 40.0, 80


def hill(stretch: float = 1.0, height: float = HEIGHT) -> Surface:
    """A hill, longer from west to east than from south to north by a factor."""
    x = np.linspace(-1.2 * RADIUS * stretch, 1.2 * RADIUS * stretch, STEPS + 1)
    y = np.linspace(-1.2 * RADIUS, 1.2 * RADIUS, STEPS + 1)
    east, north = np.meshgrid(x, y)
    away = np.minimum(np.hypot(east / stretch, north) / RADIUS, 1.0)
    z = height * np.cos(np.pi / 2 * away) ** 2
    return surface_of("hill", x, y, z, Plane(), spread=0.5)


def turned(surface: Surface) -> Surface:
    """The surface turned by a quarter against the clock: its east is now north."""
    z = surface.z.T[:, ::-1]
    return surface_of("turned", surface.y, surface.x, z, Plane(), surface.spread)


class Flat(Surface):
    """Level ground with the mesh of a form as high as another surface."""

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:  # type: ignore[override]
        return np.zeros_like(x)

    def smoothed(self, cell_m: float) -> Surface:
        return self


def flow(surface: Surface, from_deg: float = 270.0) -> SurfaceFlowCase:
    return SurfaceFlowCase(surface, from_deg, 10.0, 0.004, 1e-5, SMALL)


def solved(one: SurfaceFlowCase, shared: Shared) -> Path:
    """Run a case to its end, once in a session."""
    with shared("flows") as cases:
        if not case.done_state(one, cases):
            directory = case.prepare(one, cases)
            ended = allrun(directory)
            one.collect(directory)
            times = {"solver_s": ended.seconds, "cpu_s": ended.cpu_s}
            case.finish(one, directory, **times, wall_s=ended.seconds)
        return cases / one.name


def stress_of(one: SurfaceFlowCase, shared: Shared) -> SurfaceStress:
    return SurfaceStress.from_csv(solved(one, shared) / WALL_STRESS)


def on_grid(one: SurfaceFlowCase, values: FloatArray) -> FloatArray:
    """Values of the faces by their places along and across the wind."""
    along, across, _ = one.mesh.shape
    return values.reshape(along - 1, across, *values.shape[1:])


def test_over_level_ground_the_stress_is_that_of_the_approaching_flow(
    tmp_path: Path,
) -> None:
    flat = Flat(**vars(replace(hill(), digest="flat")))
    one = flow(flat)
    directory = case.prepare(one, tmp_path)
    # the velocities across and upwards are nothing but round-off: their residuals never
    # fall, and the iterations need not go on
    edit(directory / "parameters", "iterations       400;", "iterations 150;")
    allrun(directory)
    stress, _ = one.stress(directory)
    np.testing.assert_allclose(stress.ustar_over_ustar0, 1.0, atol=5e-4)
    np.testing.assert_allclose(stress.tau_across, 0.0, atol=1e-4)
    assert np.all(stress.z_m == 0.0)
    mesh = one.mesh
    domain = np.ptp(mesh.x) * np.ptp(mesh.y)
    assert stress.area_m2.sum() == pytest.approx(domain, rel=1e-8)


def test_a_symmetric_hill_has_symmetric_stress(shared: Shared) -> None:
    one = flow(hill())
    stress = stress_of(one, shared)
    along = on_grid(one, stress.tau_along)
    across = on_grid(one, stress.tau_across)
    np.testing.assert_allclose(along, along[:, ::-1], atol=2e-4)
    np.testing.assert_allclose(across, -across[:, ::-1], atol=2e-4)
    # fastest at the top, slower before the hill and behind it, and along the face
    top = int(stress.ustar_over_ustar0.argmax())
    assert stress.z_m[top] > 0.8 * HEIGHT
    assert 1.3 < stress.ustar_over_ustar0[top] < 2.0
    assert stress.tau_along.min() < 0.7
    np.testing.assert_allclose((stress.tau * stress.normal).sum(axis=1), 0, atol=2e-4)
    # the flow goes round the hill: to the left on its left, windward, side
    is_windward = (stress.along_m < 0) & (stress.z_m > 0.1 * HEIGHT)
    is_left = is_windward & (stress.across_m > 0)
    assert stress.tau_across[is_left].mean() > 0.02


@pytest.mark.long
def test_a_quarter_of_a_turn_changes_no_digit(shared: Shared) -> None:
    """A hill turned with the wind is the same mesh."""
    surface = hill(1.5)
    one = flow(surface, 270.0)
    other = flow(turned(surface), 180.0)
    first = solved(one, shared)
    second = solved(other, shared)
    same = (first / BED_FLOW).read_bytes() == (second / BED_FLOW).read_bytes()
    assert same
    stress = SurfaceStress.from_csv(first / WALL_STRESS)
    turned_one = SurfaceStress.from_csv(second / WALL_STRESS)
    np.testing.assert_allclose(turned_one.tau[:, 0], -stress.tau[:, 1], atol=1e-9)
    np.testing.assert_allclose(turned_one.tau[:, 1], stress.tau[:, 0], atol=1e-9)
    np.testing.assert_allclose(turned_one.y_m, stress.x_m, atol=1e-6)
    np.testing.assert_array_equal(turned_one.tau_along, stress.tau_along)
    assert one.name != other.name


def test_the_stress_is_that_of_the_function_object(
    shared: Shared, tmp_path: Path
) -> None:
    directory = solved(flow(hill(1.5), 240.0), shared)
    ours = SolvedFlow(directory).wall_shear
    copy = Path(shutil.copytree(directory, tmp_path / "copy"))
    (SolvedFlow(copy).last_iteration / "wallShearStress").unlink()
    assert_same(ours, by_function_object(copy))


@pytest.mark.long
def test_two_processes_give_the_flow_of_one(shared: Shared) -> None:
    one = flow(hill())
    two = replace(one, level=replace(SMALL, ranks=2))
    assert two.ranks == 2
    assert two.name != one.name
    alone = stress_of(one, shared)
    together = stress_of(two, shared)
    np.testing.assert_allclose(together.tau, alone.tau, atol=0.03)
    left = [path.name for path in solved(two, shared).glob("processor*")]
    assert left == []


def test_the_hill_of_the_template_runs_as_it_lies(tmp_path: Path) -> None:
    directory = of_hill(copied(tmp_path))
    before = {path.relative_to(directory) for path in directory.rglob("*")}
    ended = allrun(directory)
    assert ended.returncode == 0
    table = np.genfromtxt(directory / BED_FLOW, delimiter=",", names=True)
    assert table["tau_x"].max() > 2.0
    assert table["tau_x"][:5] == pytest.approx(1.0, abs=1e-4)
    subprocess.run(["./Allclean"], cwd=directory, check=True)
    left = {path.relative_to(directory) for path in directory.rglob("*")}
    assert left - {Path("log.Allrun")} == before


@pytest.mark.long
def test_the_same_again_gives_the_same_bytes(shared: Shared, tmp_path: Path) -> None:
    one = flow(hill())
    copy = Path(shutil.copytree(solved(one, shared), tmp_path / "copy"))
    assert allrun(copy).returncode == 0
    assert (copy / WALL_STRESS).is_file()
    edit(copy / "parameters", "freeStream       10.0;", "freeStream       12.0;")
    edit(copy / "parameters", "0.004;", "0.006;")
    assert allrun(copy).returncode == 1
    assert not (copy / WALL_STRESS).exists()


def test_a_flow_that_cycles_is_said_with_the_remedy(
    shared: Shared, tmp_path: Path
) -> None:
    one = flow(hill())
    copy = Path(shutil.copytree(solved(one, shared), tmp_path / "copy"))
    log = copy / "log.simpleFoam"
    log.write_text(re.sub(r"SIMPLE solution converged.*\n", "", log.read_text()))
    with pytest.raises(Stalled, match="the flow cycles") as raised:
        one.collect(copy)
    assert "bed.smoothing_cells" in raised.value.remedy


def test_a_table_of_another_mesh_is_refused(shared: Shared, tmp_path: Path) -> None:
    one = flow(hill())
    copy = Path(shutil.copytree(solved(one, shared), tmp_path / "copy"))
    rows = (copy / BED_FLOW).read_text().splitlines()
    (copy / BED_FLOW).write_text("\n".join(rows[:-3]) + "\n")
    with pytest.raises(SolverError, match="not those of this mesh"):
        one.collect(copy)


def test_diagnostics_tell_a_sound_flow(shared: Shared) -> None:
    text = (solved(flow(hill()), shared) / DIAGNOSTICS).read_text()
    assert ",no" not in text
    assert "approach_ustar_over_log_law,0.9" in text


def test_stress_is_read_as_it_was_written(shared: Shared, tmp_path: Path) -> None:
    stress = stress_of(flow(hill()), shared)
    stress.to_csv(tmp_path / "again.csv")
    again = SurfaceStress.from_csv(tmp_path / "again.csv")
    for name, values in vars(stress).items():
        np.testing.assert_array_equal(getattr(again, name), values)


def test_levels_have_the_cells_that_they_say() -> None:
    """A cone of a stockpile, and a wide low form whose cells are longer."""
    pile = cone(11.4, 38.0)
    for level, least, most in ((COARSE, 70_000, 110_000), (STANDARD, 200_000, 280_000)):
        cells = cell_length(pile, level)
        assert cells == pytest.approx(11.4 / np.tan(np.radians(38)) / 12, rel=1)
        counts = [
            replace(flow(pile, angle), level=level).mesh.cells for angle in (0.0, 45.0)
        ]
        assert least < min(counts) <= max(counts) < most
    low = hill(3.0, height=2.0)
    coarse = replace(flow(low, 30.0), level=COARSE)
    assert coarse.mesh.cells < 110_000
    assert coarse.cell_m > 2.0 / COARSE.per_height


def test_the_meshes_of_many_directions_are_not_kept() -> None:
    surface = hill()
    cases = [flow(surface, angle) for angle in (0.0, 30.0, 60.0, 90.0)]
    first = weakref.ref(cases[0].mesh)
    assert first() is cases[0].mesh
    for one in cases:
        assert one.mesh.cells > 0
    assert first() is None
