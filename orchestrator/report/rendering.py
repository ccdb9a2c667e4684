"""Work for VTK, done in a process of its own: it crashes where graphics libraries are missing.

Run as ``python -m orchestrator.report.rendering JOBS``, a JSON list of jobs; each leaves one file.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

MATTE: dict[str, Any] = {"ambient": 0.45, "diffuse": 0.6}
"""Light that leaves a colour close to the one in the colour bar."""
MOST_POINTS = 400_000
"""Of all spheres together: a picture must not take seconds or a gigabyte."""


def main(path: str) -> None:
    """Do the jobs of a file, in their order."""
    for job in json.loads(Path(path).read_text(encoding="utf-8")):
        KINDS[job.pop("kind")](**job)


def sample_flow(case: str, window: list[float], shape: list[int], out: str) -> None:
    """Save the velocity of a finished OpenFOAM case on a grid, (rows, columns, 3); NaN outside.

    The window is left, right, bottom, top in m; the shape is rows and columns.
    """
    reader = pv.POpenFOAMReader(str(Path(case, "system", "controlDict")))
    reader.set_active_time_value(reader.time_values[-1])
    reader.disable_all_patch_arrays()
    reader.enable_patch_array("internalMesh")
    mesh: Any = reader.read()["internalMesh"]
    left, right, bottom, top = window
    rows, columns = shape
    middle = (mesh.bounds[2] + mesh.bounds[3]) / 2
    spacing = ((right - left) / (columns - 1), 1.0, (top - bottom) / (rows - 1))
    grid = pv.ImageData(
        dimensions=(columns, 1, rows), spacing=spacing, origin=(left, middle, bottom)
    )
    found: Any = grid.sample(mesh)
    inside = np.asarray(found["vtkValidPointMask"], bool)
    velocity = np.where(inside[:, None], np.asarray(found.point_data["U"], float), np.nan)
    np.save(out, velocity.reshape(rows, columns, 3))


def draw_grains(grains: str, window: list[float], pixels: list[int], out: str) -> None:
    """Save a picture of spheres on a transparent ground, seen across the flow.

    `grains` is an NPZ file with their centres (n, 2) in d and colours (n, 3), 0 … 255.
    """
    with np.load(grains) as data:
        centres, colours = data["centres"], data["colours"]
    left, right, bottom, top = window
    plotter: Any = pv.Plotter(off_screen=True, window_size=pixels)
    plotter.add_mesh(
        _spheres(centres, colours), scalars="colour", rgb=True, smooth_shading=True, **MATTE
    )
    plotter.enable_parallel_projection()
    x, z = (left + right) / 2, (bottom + top) / 2
    plotter.camera_position = [(x, -100.0, z), (x, 0.0, z), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = (top - bottom) / 2
    plotter.screenshot(out, transparent_background=True)
    plotter.close()


def _spheres(centres: NDArray[np.float64], colours: NDArray[np.uint8]) -> Any:
    cloud: Any = pv.PolyData(np.insert(centres, 1, 0.0, axis=1))
    cloud["colour"] = colours
    sides = int(np.clip(np.sqrt(MOST_POINTS / len(centres)), 8, 32))
    ball = pv.Sphere(radius=0.5, theta_resolution=sides, phi_resolution=sides)
    return cloud.glyph(geom=ball, scale=False, orient=False)


KINDS: dict[str, Callable[..., None]] = {"flow": sample_flow, "grains": draw_grains}


if __name__ == "__main__":
    main(sys.argv[1])
