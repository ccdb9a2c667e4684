"""Writes the mesh of the template of flows over a surface: a round hill.

python tools/surface_mesh.py

The template runs without Python; this is for who changes the mesh of all surfaces.
"""

from pathlib import Path

import meshio
import numpy as np

from orchestrator.runs.case import templates
from orchestrator.surface import mesh
from orchestrator.surface.mesh import Columns, Level, Sizes
from orchestrator.types import FloatArray

HEIGHT, RADIUS = 10.0, 30.0
"""Of the hill, m."""
FIRST_CELL = 0.5
"""Height of the first cells, m: gmshToFoam takes flatter ones for inverted, since the
faces of so coarse a mesh are twisted."""
LEVEL = Level("template", 6, 1, 1.4, 1.6, 10_000)
MESH = templates() / "openfoam/flow/hill/mesh.msh"


def hill(x: FloatArray, y: FloatArray) -> FloatArray:
    """Heights of the hill, m: a squared cosine of the distance from its top."""
    away = np.minimum(np.hypot(x, y) / RADIUS, 1.0)
    return np.asarray(HEIGHT * np.cos(np.pi / 2 * away) ** 2)


def columns() -> Columns:
    """The mesh over the hill."""
    form = Sizes(-RADIUS, RADIUS, -RADIUS, RADIUS)
    x, y = mesh.grid_lines(form, HEIGHT, RADIUS / LEVEL.per_radius, LEVEL)
    count = mesh.rows(HEIGHT, FIRST_CELL, LEVEL)
    return Columns.over(hill, x, y, height=HEIGHT, first_cell=FIRST_CELL, count=count)


def write(path: Path) -> None:
    """Write the mesh as gmsh does, which gmshToFoam reads."""
    made = columns()
    patches = made.patches
    quads = list(patches.values())
    numbers = np.arange(1, len(patches) + 1)
    on_quads = np.repeat(numbers, [len(each) for each in quads])
    in_cells = np.full(made.cells, len(patches) + 1)
    tags = {
        name: np.array([number, 2])
        for name, number in zip(patches, numbers, strict=True)
    }
    tags["air"] = np.array([len(patches) + 1, 3])
    tagged = [on_quads, in_cells]
    whole = meshio.Mesh(
        made.corners.reshape(-1, 3),
        [("quad", np.concatenate(quads)), ("hexahedron", made.hexahedra)],
        cell_data={"gmsh:physical": tagged, "gmsh:geometrical": tagged},
        field_data=tags,
    )
    whole.write(path, file_format="gmsh22", binary=False, float_fmt=".9g")


if __name__ == "__main__":
    write(MESH)
