"""Meshes of hexahedra over a surface: their geometry, and what OpenFOAM says of them."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from orchestrator.flow.foam import read_list
from orchestrator.runs.case import templates
from orchestrator.surface import mesh
from orchestrator.surface.mesh import Columns, Level, Sizes
from orchestrator.surface.stress import faces_of
from orchestrator.types import FloatArray

LEVEL = Level("test", 8, 1, 1.3, 1.4, 100_000)
HEIGHT, RADIUS = 2.0, 8.0
CORNERS = np.array([[-RADIUS, 0.0], [0.0, HEIGHT], [RADIUS, 0.0]])
"""Of a ridge across the wind: x and z."""


def bell(x: FloatArray, y: FloatArray) -> FloatArray:
    """A round hill."""
    away = np.minimum(np.hypot(x, y) / RADIUS, 1.0)
    return np.asarray(HEIGHT * np.cos(np.pi / 2 * away) ** 2)


def ridge(x: FloatArray, y: FloatArray) -> FloatArray:
    """A ridge across the whole mesh."""
    return np.asarray(np.interp(x, *CORNERS.T))


def flat(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.zeros_like(x)


def over(heights: mesh.Heights, cells: int = 8) -> Columns:
    form = Sizes(-RADIUS, RADIUS, -RADIUS, RADIUS)
    x, y = mesh.grid_lines(form, HEIGHT, RADIUS / cells, LEVEL)
    first_cell = 0.05
    count = mesh.rows(HEIGHT, first_cell, LEVEL)
    return Columns.over(
        heights, x, y, height=HEIGHT, first_cell=first_cell, count=count
    )


def volumes(mesh: Columns) -> FloatArray:
    """Volumes of the cells behind the inlet by their upright columns.

    Over a rectangle of the plan, the mean of the four heights is that of the
    bilinear surface through them.
    """
    area = np.diff(mesh.x)[:, None] * np.diff(mesh.y)
    high = np.diff(mesh.levels, axis=2)
    mean = (high[:-1, :-1] + high[1:, :-1] + high[1:, 1:] + high[:-1, 1:]) / 4
    return area[..., None] * mean


def check_mesh(directory: Path) -> str:
    """What OpenFOAM's checkMesh says of a mesh, in a copy of the template."""
    template = templates() / "openfoam/flow"
    for name in ("system", "0"):
        shutil.copytree(template / name, directory / name)
    shutil.copy(template / "parameters", directory)
    home = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}
    ended = subprocess.run(
        ["checkMesh"],
        cwd=directory,
        env={**home, "PWD": "/proc/self/cwd"},
        capture_output=True,
        text=True,
        check=True,
    )
    return ended.stdout


@pytest.mark.parametrize("heights", [bell, ridge, flat])
def test_open_foam_finds_nothing_wrong(tmp_path: Path, heights: mesh.Heights) -> None:
    mesh = over(heights)
    assert 3000 < mesh.cells < 20_000
    mesh.write(tmp_path)
    said = check_mesh(tmp_path)
    assert "Mesh OK." in said
    assert "Upper triangular ordering OK." in said
    assert f"{mesh.cells}\n" in re.findall(r"cells: +(\d+\n)", said)
    worst = re.search(r"non-orthogonality Max: ([0-9.]+)", said)
    assert worst is not None
    assert float(worst[1]) < 45
    # two regions: the slab, in which the flow develops, and all the rest
    assert "Number of regions: 2" in said
    total = re.search(r"Total volume = ([0-9.]+)\.", said)
    assert total is not None
    slab = mesh.slab * np.ptp(mesh.y) * mesh.lid
    assert float(total[1]) == pytest.approx(volumes(mesh).sum() + slab, rel=1e-6)


def test_points_are_written_with_nine_digits(tmp_path: Path) -> None:
    mesh = over(bell)
    mesh.write(tmp_path)
    points = read_list(tmp_path / "constant/polyMesh/points")
    np.testing.assert_allclose(points, mesh.corners.reshape(-1, 3), rtol=1e-8)


def test_the_faces_add_up_to_the_surface() -> None:
    _, normals, areas = faces_of(over(flat))
    mesh = over(flat)
    assert areas.sum() == pytest.approx(np.ptp(mesh.x) * np.ptp(mesh.y), rel=1e-9)
    np.testing.assert_allclose(normals, [[0.0, 0.0, 1.0]] * len(normals), atol=1e-12)
    # the corners of the ridge are grid lines
    mesh = over(ridge)
    _, normals, areas = faces_of(mesh)
    sides = 2 * np.hypot(RADIUS, HEIGHT) - 2 * RADIUS
    expected = (np.ptp(mesh.x) + sides) * np.ptp(mesh.y)
    assert areas.sum() == pytest.approx(expected, rel=1e-9)
    slopes = np.unique(np.round(np.degrees(np.arccos(normals[:, 2])), 6))
    np.testing.assert_allclose(slopes, [0.0, np.degrees(np.arctan(0.25))], atol=1e-5)
    # of the hill, by its profile turned about its axis
    r = np.linspace(0, RADIUS, 100_001)
    slope = HEIGHT * np.pi / 2 / RADIUS * np.sin(np.pi * r / RADIUS)
    exact = np.trapezoid(2 * np.pi * r * (np.sqrt(1 + slope**2) - 1), r)
    errors = []
    for cells in (8, 16, 32):
        mesh = over(bell, cells)
        more = faces_of(mesh)[2].sum() - np.ptp(mesh.x) * np.ptp(mesh.y)
        errors.append(more / exact - 1)
    np.testing.assert_allclose(errors, [-0.02, -0.005, -0.00125], rtol=0.1)


@pytest.mark.parametrize("heights", [bell, flat])
def test_first_cells_have_one_height_normal_to_the_bed(heights: mesh.Heights) -> None:
    mesh = over(heights)
    middles, normals, _ = faces_of(mesh)
    first = mesh.middles[1:, :, 0].reshape(-1, 3)
    z_e = ((first - middles) * normals).sum(axis=1)
    np.testing.assert_allclose(z_e, mesh.first_cell / 2, rtol=0.02)


def test_the_domain_reaches_as_far_as_is_said() -> None:
    mesh = over(bell)
    ends = [mesh.x[0], mesh.x[-1], mesh.y[0], mesh.y[-1], mesh.lid]
    far = [-RADIUS - 6 * HEIGHT, RADIUS + 16 * HEIGHT, -RADIUS - 7 * HEIGHT]
    np.testing.assert_allclose(ends, [*far, RADIUS + 7 * HEIGHT, 10 * HEIGHT])
    assert np.all(mesh.levels[..., -1] == mesh.lid)
    assert mesh.bed[0].max() == 0.0
    # no cell is much longer than the one beside it
    for axis, most in ((mesh.x, LEVEL.growth), (mesh.y, LEVEL.growth_across)):
        steps = np.diff(axis)
        growth = np.maximum(steps[1:] / steps[:-1], steps[:-1] / steps[1:])
        assert growth.max() < most * 1.01


@pytest.mark.parametrize(
    ("from_deg", "along"),
    [(0.0, (0, -1)), (90.0, (-1, 0)), (180.0, (0, 1)), (270.0, (1, 0))],
)
def test_the_wind_blows_from_where_it_comes(
    from_deg: float, along: tuple[int, int]
) -> None:
    axes = mesh.wind_axes(from_deg)
    np.testing.assert_array_equal(axes[0], along)
    # to the left: a quarter of a turn against the clock
    np.testing.assert_array_equal(axes[1], (-along[1], along[0]))
    assert not np.signbit(axes[axes == 0]).any()
