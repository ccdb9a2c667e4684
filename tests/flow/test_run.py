"""What a flow over a bed line and one over a surface share, without a solver."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.flow.case import FlowCase
from orchestrator.flow.foam import read_list
from orchestrator.flow.run import C_MU, SPEED_HEIGHT, OpenFoamCase
from orchestrator.runs import case
from orchestrator.surface.case import SurfaceFlowCase
from orchestrator.types import FloatArray
from tests.flow.conftest import PILE
from tests.surface.test_case import flow, hill

RUNS: dict[str, OpenFoamCase[Any]] = {"pile": PILE, "hill": flow(hill())}


@pytest.mark.parametrize("name", RUNS)
def test_the_approach_is_a_log_layer_of_constant_stress(
    name: str, template: Path
) -> None:
    approach = RUNS[name].approach
    heights = np.array([0.5, 1.0, 2.0]) * SPEED_HEIGHT * approach.height_m
    approach.start(template / "0", heights)
    speed = read_whole(template / "0/U").reshape(-1, 3)
    assert speed[1] == pytest.approx([approach.speed_m_s, 0.0, 0.0])
    k = approach.ustar_m_s**2 / np.sqrt(C_MU)
    epsilon = read_whole(template / "0/epsilon")
    omega = read_whole(template / "0/omega")
    np.testing.assert_allclose(omega, epsilon / (C_MU * k), rtol=1e-8)
    # as much turbulence is dissipated as is made, u*^2 dU/dz
    steps = np.log(heights + approach.roughness_m)
    shear = np.diff(speed[:, 0]) / np.diff(steps) / (heights[1] + approach.roughness_m)
    assert epsilon[1] == pytest.approx(approach.ustar_m_s**2 * shear[0], rel=1e-6)


def read_whole(path: Path) -> FloatArray:
    """The numbers of a field that a case starts from."""
    path.write_text(f"{path.read_text()}// ***")
    return np.asarray(read_list(path)).ravel()


@pytest.mark.parametrize("name", RUNS)
def test_a_case_has_no_other_bed_of_the_template(name: str, tmp_path: Path) -> None:
    one = RUNS[name]
    directory = case.prepare(one, tmp_path)
    left = {path.suffix for path in directory.rglob("*")}
    assert ".msh" not in left
    assert (".geo" in left) == isinstance(one, FlowCase)
    assert not (directory / "hill").exists()
    sides = "slip" if isinstance(one, SurfaceFlowCase) else "empty"
    assert f"sides            {sides};" in (directory / "parameters").read_text()
    boundary = (directory / "constant/polyMesh/boundary").read_text()
    assert ("empty" in boundary) == isinstance(one, FlowCase)


@pytest.mark.parametrize("name", RUNS)
def test_the_share_of_a_run_is_that_of_its_iterations(
    name: str, tmp_path: Path
) -> None:
    one = RUNS[name]
    assert one.share(tmp_path) == 0.0
    log = tmp_path / "log.simpleFoam"
    log.write_text("\nTime = 1\n" * 10)
    assert one.share(tmp_path) == pytest.approx(10 / one.iterations)
    log.write_text("\nTime = 1\n" * 10_000)
    assert one.share(tmp_path) < 1.0
