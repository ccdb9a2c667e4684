"""The heaps of docs/surface.md and docs/stockpile.md: their studies, runs and pictures.

python tools/heap.py DIRECTORY

The heap of surface.md is made up: three cones on level ground, with noise; its map is
written to docs/figures/surface.png. The study of stockpile.md stands in that page; its
figure is written to docs/figures/erosion.svg.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

from orchestrator.cli import main
from orchestrator.surface.raster import geotiff

DOCS = Path(__file__).parents[1] / "docs"
PICTURE = DOCS / "figures" / "surface.png"
RIDGE = DOCS / "figures" / "erosion.svg"
EAST, NORTH = 512_300.0, 5_640_800.0
EXTENT, STEP = 60.0, 0.5  # m
CONES = ((22.0, 34.0, 8.0), (34.0, 26.0, 6.0), (36.0, 37.0, 5.0))
"""Place and height of each cone, m."""
SLOPE_DEG = 34.0
NOISE = 0.05  # m
STUDY = """title = "A heap of sand from a drone's raster"

[fluid]
kind = "air"

[grain]
diameter = 1e-3
density = 2650.0

[bed]
kind = "surface"
surface = "heap.tif"
entrainment_angle_deg = 50.0

[method.flow]
roughness = 0.005

[axes]
"flow.from_deg" = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0]

[erosion]
wind = "year.csv"
"""
YEAR = """from_deg,speed_m_s,share
270,3,0.13
270,8,0.19
270,13,0.08
0,3,0.10
0,8,0.05
90,3,0.12
90,8,0.06
180,3,0.14
180,8,0.10
180,13,0.03
"""


def heap() -> bytes:
    """The raster, a GeoTIFF."""
    axis = np.arange(0.0, EXTENT + STEP / 2, STEP)
    z = np.zeros((len(axis), len(axis)))
    for x, y, height in CONES:
        distance = np.hypot(axis - x, (axis - y)[:, None])
        z = np.maximum(z, height - distance * np.tan(np.radians(SLOPE_DEG)))
    noise = np.random.default_rng(1).normal(0.0, NOISE, z.shape)
    return geotiff(EAST + axis, NORTH + axis, 100.0 + z + noise, "")


def write(directory: Path) -> Path:
    """Write the files of the study; the file of the study itself."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "heap.tif").write_bytes(heap())
    (directory / "year.csv").write_text(YEAR, encoding="utf-8")
    study = directory / "heap.toml"
    study.write_text(STUDY, encoding="utf-8")
    return study


def run(directory: Path) -> None:
    """Write the files of the study, run it, and keep its map."""
    study = write(directory)
    out = directory / "heap"
    if main(["study", str(study), "--out", str(out)]):
        raise SystemExit("the study of the heap has failed")
    shutil.copyfile(out / "figures" / "least.png", PICTURE)


def run_ridge(directory: Path) -> None:
    """Run the study that stands in docs/stockpile.md, and keep its figure."""
    text = (DOCS / "stockpile.md").read_text(encoding="utf-8")
    study = directory / "ridge.toml"
    study.write_text(text.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    out = directory / "ridge"
    if main(["erosion", str(study), "--out", str(out)]):
        raise SystemExit("the erosion of the ridge has failed")
    shutil.copyfile(out / "figures" / "loss.svg", RIDGE)


if __name__ == "__main__":
    run(Path(sys.argv[1]))
    run_ridge(Path(sys.argv[1]))
