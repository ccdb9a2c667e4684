"""Meshes of many beds, without a solver: what they resolve, and what is refused beforehand."""

import threading
from dataclasses import replace
from math import cos, radians
from pathlib import Path

import meshio
import numpy as np
import pytest

from orchestrator.bed.line import of_bed
from orchestrator.errors import InputError, SolverError
from orchestrator.fidelity import limits
from orchestrator.flow.foam import SolvedFlow
from orchestrator.flow.mesh import made_by_gmsh, ratio_of
from orchestrator.runs import case
from orchestrator.study import study
from orchestrator.types import FloatArray
from tests.bed.test_line import BEDS as SHAPES
from tests.bed.test_line import H, bed
from tests.flow.conftest import PILE, changed, edit

BED = """
grain = { diameter = 1e-3 }
method.kind = "pivot"
bed.kind = "pile"
bed.slope_deg = 15.0
"""


def first_cells(directory: Path) -> tuple[FloatArray, FloatArray]:
    """Corners of the bed's faces (x, z), downstream, and mean heights of the cells on them."""
    faces, cells, middles = SolvedFlow(directory).mesh
    heights = 2 * (middles[cells, 2] - faces[..., 2].mean(axis=1))
    corners = np.unique(np.round(faces.reshape(-1, 3)[:, [0, 2]], 9), axis=0)
    return corners, heights


@pytest.mark.parametrize("slope", [0.0, 5.0, 15.0, 30.0, 40.0])
@pytest.mark.parametrize("height", [0.002, 3.0])
@pytest.mark.parametrize("lid", [10.0, 100.0])
def test_a_mesh_for_each_pile(
    slope: float, height: float, lid: float, tmp_path: Path
) -> None:
    settings = {"first_cell_height": height / 40, "roughness": height / 600, "lid": lid}
    flow = replace(changed(PILE, **settings), slope_deg=slope, height_m=height)
    corners, heights = first_cells(case.prepare(flow, tmp_path))
    # ahead of the inlet is one column
    line, corners = flow.bed_line, corners[2:]
    np.testing.assert_allclose(corners[[0, -1], 0], [line.x[0], line.x[-1]], rtol=1e-6)
    np.testing.assert_allclose(heights, height / 40 / cos(radians(slope)), rtol=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_a_mesh_for_each_shape(name: str, tmp_path: Path) -> None:
    shape = bed(**SHAPES[name])
    settings = {"cells_per_face": 40, "first_cell_height": H / 20}
    flow = replace(
        changed(PILE, **settings),
        slope_deg=shape.slope_deg,
        height_m=H,
        line=of_bed(shape),
    )
    corners, heights = first_cells(case.prepare(flow, tmp_path))
    line, corners = flow.bed_line, corners[2:]
    # the corners of the bed line are among the grid lines, and all others lie on it
    # as far as nine digits go
    np.testing.assert_allclose(corners[:, 1], line.height(corners[:, 0]), atol=5e-9)
    assert all(np.abs(corners[:, 0] - x).min() < 1e-8 for x in line.x)
    # but for bed at a sharp bend, neighbours differ by less than a factor
    steps = np.diff(corners[:, 0])
    assert (steps[1:] / steps[:-1]).max() < 3
    np.testing.assert_allclose(
        heights, H / 20 / cos(radians(shape.slope_deg)), rtol=1e-3
    )


def test_the_mesh_of_the_template_is_that_of_its_geometry(template: Path) -> None:
    given = meshio.read(template / "mesh.msh").points
    np.testing.assert_allclose(made_by_gmsh(template).points, given, atol=1e-9)


def test_threads_make_their_meshes_in_turn(tmp_path: Path) -> None:
    flows = [replace(PILE, slope_deg=float(slope)) for slope in (10, 20, 30)]
    threads = [
        threading.Thread(target=case.prepare, args=(flow, tmp_path)) for flow in flows
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for flow in flows:
        expected = flow.first_cell_m / cos(radians(flow.slope_deg))
        np.testing.assert_allclose(
            first_cells(tmp_path / flow.name)[1], expected, rtol=1e-3
        )


@pytest.mark.parametrize(
    ("file", "old", "new", "cause"),
    [
        (
            "mesh.geo",
            '"lid"',
            '"lib"',
            r"no usable mesh: without the physical groups \['lid'\]",
        ),
        ("mesh.geo", "Recombine Surface{:};", "", "not of hexahedra only"),
        (
            "mesh.geo",
            "= {x, thickness, lid}",
            "= {x, thickness, -lid}",
            "inverted cells",
        ),
        ("parameters.geo", "height = 0.02;", "height = two;", "Unknown variable 'two'"),
    ],
)
def test_a_mesh_that_is_no_such_mesh(
    template: Path, file: str, old: str, new: str, cause: str
) -> None:
    edit(template / file, old, new)
    with pytest.raises(SolverError, match=rf"mesh\.geo: .*{cause}"):
        made_by_gmsh(template)


# so coarse a mesh is warned of, too
@pytest.mark.filterwarnings("ignore:method.flow.cells_per_face")
@pytest.mark.parametrize(
    ("text", "field"),
    [
        (f"bed.obstacles = [{{ {obstacle}, x = -0.1 }}]", "bed.obstacles")
        for obstacle in (
            'kind = "block", height = 1e-5, length = 0.01',
            'kind = "block", height = 0.01, length = 1e-5',
            'kind = "fence", height = 1e-4',
            'kind = "half-cylinder", height = 1e-4',
        )
    ]
    + [
        ("method.flow.lid = 3.0", "method.flow.lid"),
        (
            "method.flow = { cells_per_face = 10, expansion_ratio = 2.0 }",
            "method.flow.expansion_ratio",
        ),
    ],
)
def test_beds_and_settings_without_a_mesh_are_refused_with_their_field(
    text: str, field: str
) -> None:
    (scene,) = study.parse(BED + text, name="t", where="t").scenes
    with pytest.raises(InputError, match=rf"a.toml: .*{field}: "):
        limits.check(scene, "a.toml")


def test_cells_that_fill_a_length_but_for_round_off_are_alike() -> None:
    assert ratio_of(5, 0.09999999999999987, 0.5) == 1.0


def test_cells_fill_lengths() -> None:
    first = np.array([0.01, 0.1, 0.5])
    length = np.array([2.0, 2.0, 2.0])
    ratio = ratio_of(20, first, length)
    powers = ratio[:, None] ** np.arange(20)
    filled = first * powers.sum(axis=1)
    np.testing.assert_allclose(filled, length, rtol=1e-12)
    assert ratio[2] < 1 < ratio[0]
    assert ratio[1] == pytest.approx(1.0, abs=1e-12)
