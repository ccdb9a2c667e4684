"""What the tests of the flow share: cases on a coarse mesh, run by the real solver."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.flow.case import FlowCase
from orchestrator.runs import case, process
from orchestrator.runs.case import templates
from tests.conftest import Shared

PILE = FlowCase(
    slope_deg=15.0,
    height_m=0.02,
    roughness_m=1e-4 / 3.0,
    speed_m_s=10.0,
    viscosity_m2_s=1e-5,
    first_cell_m=5e-4,
    cells_per_face=16,
)
SLOW = replace(PILE, slope_deg=30.0, cells_per_face=80)
"""A case that runs for many seconds: long enough to be interrupted."""

Solve = Callable[[FlowCase], Path]


def allrun(directory: Path, *, limit_s: float = 120.0, **env: str) -> process.Ended:
    log = directory / "log.Allrun"
    return process.run(["./Allrun"], cwd=directory, log=log, limit_s=limit_s, env=env)


@pytest.fixture(scope="session")
def solve(shared: Shared) -> Solve:
    """Run a case to its end, once in a session."""

    def to_its_end(flow: FlowCase) -> Path:
        with shared("flows") as cases:
            if not case.is_done(flow, cases):
                directory = case.prepare(flow, cases)
                ended = allrun(directory)
                flow.collect(directory)
                case.finish(
                    flow, directory, solver_s=ended.seconds, cpu_s=ended.cpu_s, wall_s=ended.seconds
                )
            return cases / flow.name

    return to_its_end


@pytest.fixture
def template(tmp_path: Path) -> Path:
    """A copy of the template, as it lies."""
    return Path(shutil.copytree(templates() / "openfoam" / "pile", tmp_path / "pile"))
