"""Cases on a coarse mesh, run by the real solver, that the tests of the flow share."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator.flow.case import FlowCase
from orchestrator.runs import case, process
from orchestrator.runs.case import templates
from orchestrator.study.method import FlowMethod
from tests.conftest import Shared
from tests.waiting import HANGS_S

SETTINGS = FlowMethod(
    speed=10.0,
    roughness=1e-4 / 3.0,
    viscosity=1e-5,
    first_cell_height=5e-4,
    cells_per_face=16,
)
PILE = FlowCase(0.02, 15.0, SETTINGS)


def changed(flow: FlowCase, **settings: Any) -> FlowCase:
    """A case with other settings of the solve, or something else above the flow."""
    top: dict[str, Any] = {}
    for name in ("top", "depth"):
        if name in settings:
            top[name] = settings.pop(name)
    above = flow.above.model_copy(update=top)
    return replace(
        flow, settings=flow.settings.model_copy(update=settings), above=above
    )


OPEN = changed(PILE, top="open water", depth=6.0 * PILE.height_m)

Solve = Callable[[FlowCase], Path]


def allrun(directory: Path, **env: str) -> process.Ended:
    log = directory / "log.Allrun"
    return process.run(["./Allrun"], cwd=directory, log=log, limit_s=HANGS_S, env=env)


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.fixture(scope="session")
def solve(shared: Shared) -> Solve:
    """Run a case to its end, once in a session."""

    def to_its_end(flow: FlowCase) -> Path:
        for coarser in flow.needs:
            to_its_end(coarser)
        with shared("flows") as cases:
            if not case.done_state(flow, cases):
                directory = case.prepare(flow, cases)
                ended = allrun(directory)
                flow.collect(directory)
                wall_s = ended.seconds
                case.finish(
                    flow, directory, solver_s=wall_s, cpu_s=ended.cpu_s, wall_s=wall_s
                )
            return cases / flow.name

    return to_its_end


@pytest.fixture
def template(tmp_path: Path) -> Path:
    """A copy of the template, as it lies."""
    return copied(tmp_path)


def copied(folder: Path) -> Path:
    """The template in a folder."""
    return Path(shutil.copytree(templates() / "openfoam" / "flow", folder / "flow"))


def of_hill(template: Path) -> Path:
    """The template with the mesh and the parameters of its hill."""
    shutil.copytree(template / "hill", template, dirs_exist_ok=True)
    return template
