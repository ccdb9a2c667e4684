"""Spheres over a fixed bed by LIGGGHTS, beside the solver of the table of sustained motion."""

import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture(scope="module", name="tool")
def _tool() -> dict[str, Any]:
    path = [*sys.path]
    try:
        return runpy.run_path(str(TOOLS / "probes.py"))
    finally:
        sys.path[:] = path


def test_spheres_over_a_lattice_stop_and_go_on_as_by_the_solver(
    tool: dict[str, Any], tmp_path: Path
) -> None:
    """On a square lattice all pockets are alike: at a low stress none goes on, at a high one all."""
    probes, rolling = tool, vars(tool["rolling"])
    flat = np.indices((12, 4)).reshape(2, -1).T + 0.5
    centres = np.ascontiguousarray(np.column_stack([flat, np.zeros(len(flat))]))
    bed = rolling["Bed"](centres, (12.0, 4.0), np.ones(48), 1)
    sphere = rolling["Sphere"](127.0, 2.65)
    count = probes["COUNT"]
    for gust, mean, started, kept in (
        (0.002, 0.001, 0, 0),
        (0.1, 0.001, count, 0),
        (0.1, 0.04, count, count),
    ):
        stress = probes["Stress"](gust, mean)
        ours = probes["by_solver"](sphere, bed, stress)
        directory = tmp_path / f"{gust}-{mean}"
        theirs = probes["by_liggghts"](directory, sphere, bed, stress)
        for found in (ours, theirs):
            assert [int(each.sum()) for each in found] == [started, kept]


def test_spheres_are_laid_where_they_touch_the_bed(tool: dict[str, Any]) -> None:
    rolling = vars(tool["rolling"])
    flat = np.indices((6, 4)).reshape(2, -1).T + 0.5
    centres = np.ascontiguousarray(np.column_stack([flat, np.zeros(len(flat))]))
    bed = rolling["Bed"](centres, (6.0, 4.0), np.ones(24), 1)
    laid = tool["laid"](bed)
    apart = laid[:, None] - centres
    apart[..., :2] -= np.round(apart[..., :2] / [6, 4]) * [6, 4]
    assert np.linalg.norm(apart, axis=2).min(axis=1) == pytest.approx(1.0)


def test_a_gust_that_ends_leaves_spheres_behind(tool: dict[str, Any]) -> None:
    rolling = vars(tool["rolling"])
    flat = np.indices((12, 4)).reshape(2, -1).T + 0.5
    centres = np.ascontiguousarray(np.column_stack([flat, np.zeros(len(flat))]))
    bed = rolling["Bed"](centres, (12.0, 4.0), np.ones(48), 1)
    ways = {}
    for time in (1.0, 10.0, np.inf):
        sphere = rolling["Sphere"](127.0, 2.65, gust_time=time)
        first, then = rolling["ways"](sphere, [bed], (0.1, 0.004), 8, then=20.0)
        ways[time] = first.mean()
        # in a mean flow that is too weak none goes on
        assert then.max() < 20
    assert ways[1.0] < 1 < ways[10.0] < ways[np.inf]
    assert ways[np.inf] >= 30
