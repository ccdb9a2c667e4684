"""Meshes of many piles, without a solver."""

import threading
from dataclasses import replace
from math import cos, radians, tan
from pathlib import Path

import meshio
import numpy as np
import pytest

from orchestrator.bed.line import between_flats, of_bed
from orchestrator.errors import SolverError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.mesh import Mesh, first_cell_heights, smallest_jacobian, write_mesh
from orchestrator.flow.model import model
from orchestrator.runs import case
from orchestrator.runs.case import templates
from orchestrator.study import study
from orchestrator.study.scene import default_first_cell_height
from tests.bed.test_line import BEDS as SHAPES
from tests.bed.test_line import H, bed
from tests.flow.conftest import PILE


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def written(directory: Path) -> Mesh:
    """The mesh as another program reads its file."""
    found = meshio.read(directory / "pile.msh")
    tag = found.field_data["bed"][0]
    bed = found.cells_dict["quad"][found.cell_data_dict["gmsh:physical"]["quad"] == tag]
    return Mesh(found.points, found.cells_dict["hexahedron"], bed)


@pytest.mark.parametrize("slope", [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0])
@pytest.mark.parametrize(("height", "z0_over_h"), [(0.002, 1.6e-4), (0.02, 5e-3), (3.0, 1e-2)])
def test_a_mesh_for_each_pile(
    slope: float, height: float, z0_over_h: float, tmp_path: Path
) -> None:
    first = default_first_cell_height(height, z0_over_h * height)
    flow = FlowCase(slope, height, z0_over_h * height, 10.0, 1e-6, first, 20)
    directory = case.prepare(flow, tmp_path)
    mesh = written(directory)
    crest = height / tan(radians(slope)) if slope else 4.0 * height
    x, _, z = mesh.points.T
    assert np.isclose([x.min(), x.max()], [-81.5 * height, 2.0 * crest + 100.0 * height]).all()
    assert z.max() == pytest.approx(100.0 * height)
    above_toe = z[np.isclose(x, crest)]
    assert above_toe.min() == pytest.approx(height if slope else 0.0, abs=1e-12)
    np.testing.assert_allclose(first_cell_heights(mesh), first / cos(radians(slope)), rtol=0.01)


@pytest.mark.parametrize("name", SHAPES)
def test_a_mesh_for_each_shape(name: str, tmp_path: Path) -> None:
    shape = bed(**SHAPES[name])
    line = of_bed(shape)
    flow = FlowCase(shape.slope_deg, H, shape.roughness, 10.0, 1e-6, H / 20, line=line)
    mesh = written(case.prepare(flow, tmp_path))
    corners = np.unique(np.round(mesh.points[mesh.bed][..., [0, 2]], 9).reshape(-1, 2), axis=0)
    # ahead of the inlet is one column
    line, corners = flow.bed_line, corners[2:]
    # the corners of the bed line are among the grid lines, and all others lie on it
    np.testing.assert_allclose(corners[:, 1], line.height(corners[:, 0]), atol=2e-9)
    assert all(np.abs(corners[:, 0] - x).min() < 2e-9 for x in line.x)
    # but for bed at a sharp bend, neighbours differ by less than a factor
    steps = np.diff(corners[:, 0])
    assert (steps[1:] / steps[:-1]).max() < 3
    np.testing.assert_allclose(
        first_cell_heights(mesh), H / 20 / cos(radians(shape.slope_deg)), rtol=0.01
    )


def test_a_thousand_corners_are_meshed(tmp_path: Path) -> None:
    x = np.linspace(0, 1, 1000)
    line = between_flats(np.column_stack([x, 0.01 * (1 - np.cos(10 * np.pi * x))]), H)
    flow = FlowCase(15.0, H, H / 600, 10.0, 1e-6, H / 20, line=line)
    mesh = written(case.prepare(flow, tmp_path))
    assert len(mesh.bed) - 1 == sum(flow.grid.cells) >= 999


def test_twice_the_cells_keep_the_first_cell(tmp_path: Path) -> None:
    meshes = [written(case.prepare(replace(PILE, cells_per_face=n), tmp_path)) for n in (16, 32)]
    coarse, fine = (len(mesh.cells) for mesh in meshes)
    assert 3.0 < fine / coarse < 4.5
    lowest = [np.median(first_cell_heights(mesh)) for mesh in meshes]
    assert lowest[0] == pytest.approx(lowest[1], rel=1e-3)


def test_the_mesh_of_the_template_is_that_of_its_geometry(template: Path) -> None:
    given = written(template)
    write_mesh(template)
    made = written(template)
    np.testing.assert_allclose(made.points, given.points, atol=1e-9)
    assert (template / "pile.geo").read_bytes() == (
        templates() / "openfoam/pile/pile.geo"
    ).read_bytes()


def test_threads_make_their_meshes_one_after_another(tmp_path: Path) -> None:
    flows = [replace(PILE, slope_deg=float(slope)) for slope in (10, 20, 30)]
    threads = [threading.Thread(target=case.prepare, args=(flow, tmp_path)) for flow in flows]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for flow in flows:
        heights = first_cell_heights(written(tmp_path / flow.name))
        expected = flow.first_cell_m / cos(radians(flow.slope_deg))
        np.testing.assert_allclose(heights, expected, rtol=0.01)


def test_an_inverted_cell_is_seen() -> None:
    cube = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
        dtype=float,
    )
    upright = np.arange(8)
    upside_down = np.roll(upright, 4)
    dented = np.vstack([cube, [0.7, 0.7, 0.7]])
    np.testing.assert_allclose(smallest_jacobian(cube, upright[None]), [1.0])
    assert smallest_jacobian(cube, upside_down[None]) < 0.0
    assert smallest_jacobian(dented, np.array([[8, 1, 2, 3, 4, 5, 6, 7]])) < 0.0


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("first_cell/Cos(slope_deg*Pi/180);", "1.3*first_cell;", "first cells 2"),
        ('"lid"', '"lib"', r"physical groups \['lid'\]"),
        ("Recombine Surface{:};", "", "not of hexahedra only"),
    ],
)
def test_a_mesh_that_is_not_the_one_asked_for(
    template: Path, old: str, new: str, cause: str
) -> None:
    edit(template / "pile.geo", old, new)
    with pytest.raises(SolverError, match=rf"pile\.msh: no usable mesh: .*{cause}"):
        write_mesh(template)


def test_what_gmsh_says_reaches_the_user(template: Path) -> None:
    edit(template / "parameters.geo", "height = 0.02;", "height = two;")
    with pytest.raises(SolverError, match=r"gmsh failed: .*Unknown variable 'two'"):
        write_mesh(template)
    edit(template / "parameters.geo", "height = two;", "height = 0.02;")
    write_mesh(template)


def test_a_gentle_profile_has_a_mesh(tmp_path: Path) -> None:
    (tmp_path / "scan.csv").write_text("x_m,z_m\n0,0\n1,0.01\n2,0\n")
    text = 'grain = { diameter = 1e-3 }\nbed = { kind = "pile", profile = "scan.csv" }'
    scene = study.parse(text, name="a", where=str(tmp_path / "a.toml")).scenes[0]
    (flow,) = model(scene).cases
    directory = case.prepare(flow, tmp_path)
    assert (directory / "profile.csv").read_text() == (tmp_path / "scan.csv").read_text()
    np.testing.assert_allclose(first_cell_heights(written(directory)), flow.first_cell_m, rtol=0.01)
