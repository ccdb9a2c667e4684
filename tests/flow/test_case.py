"""Flow cases run by the real solver on a coarse mesh, and their failures."""

import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.bed.line import between_flats
from orchestrator.errors import Exploded, InputError, SolverError, Stalled
from orchestrator.flow import diagnostics
from orchestrator.flow.case import DIAGNOSTICS, WALL_STRESS, FlowCase
from orchestrator.flow.solved import SolvedFlow
from orchestrator.flow.stress import WallStress
from orchestrator.runs import case, process
from orchestrator.solvers import openfoam
from orchestrator.study.parts import Turbulence
from orchestrator.study.scene import default_first_cell_height
from tests.flow.conftest import PILE, SLOW, Solve, allrun
from tests.flow.test_mesh import edit

MESH_FILES = ("points", "faces", "owner", "neighbour", "boundary")
FACE = PILE.height_m / np.sin(np.radians(PILE.slope_deg))


def windward_mean(directory: Path, flow: FlowCase) -> float:
    """Mean of u*/u*_0 over the windward face."""
    stress = WallStress.from_csv(directory / WALL_STRESS)
    face = flow.height_m / np.sin(np.radians(flow.slope_deg))
    on_it = (stress.s_m > 0.0) & (stress.s_m < face)
    ustar, length = stress.ustar_over_ustar0_wall[on_it], stress.length_m[on_it]
    return float(np.average(ustar, weights=length))


def test_a_case_from_its_inputs_to_its_table(solve: Solve) -> None:
    directory = solve(PILE)
    assert case.is_done(PILE, directory.parent)
    kept, read = WallStress.from_csv(directory / WALL_STRESS), SolvedFlow(directory).stress()
    np.testing.assert_array_equal(kept.tau_wall, read.tau_wall)
    assert (directory / "parameters").read_text().count("//") == 13
    sums = (directory / "results.sha256").read_text()
    for field in ("U", "epsilon", "k", "nut", "p", "phi", "wallShearStress"):
        assert f"/{field}\n" in sums


def test_the_geometry_of_the_bed(solve: Solve) -> None:
    stress = WallStress.from_csv(solve(PILE) / WALL_STRESS)
    crest = FACE * np.cos(np.radians(15.0))
    bed = np.maximum(0.0, np.tan(np.radians(15.0)) * np.minimum(stress.x_m, 2 * crest - stress.x_m))
    np.testing.assert_allclose(stress.z_m, bed, atol=1e-7)
    windward = (stress.x_m > 0.0) & (stress.x_m < crest)
    assert np.count_nonzero(windward) == PILE.cells_per_face
    np.testing.assert_allclose(
        stress.s_m[windward], stress.x_m[windward] / np.cos(np.radians(15.0)), rtol=1e-5
    )
    upstream = stress.x_m < 0.0
    np.testing.assert_allclose(stress.s_m[upstream], stress.x_m[upstream], rtol=1e-5)
    np.testing.assert_allclose(stress.edges_m[:-1], stress.s_m - stress.length_m / 2, atol=1e-8)
    np.testing.assert_allclose(stress.z_e_m[windward], PILE.first_cell_m / 2.0, rtol=2e-3)


def test_the_flow_speeds_up_to_the_crest_and_separates_behind_it(solve: Solve) -> None:
    stress = WallStress.from_csv(solve(PILE) / WALL_STRESS)
    toe, mid, crest, lee = stress.mean_over(
        np.array([0.05, 0.5, 0.98, 1.5]) * FACE, np.array([0.1, 0.1, 0.04, 0.2]) * FACE
    )
    assert 0.0 < toe < mid < crest
    assert crest > 2.0
    assert lee < 0.0
    start, end = stress.edges_m[[0, -1]]
    assert stress.mean_over(start + 0.02, 0.02) == pytest.approx(1.0, abs=0.01)
    assert 0.8 < stress.mean_over(end - 0.02, 0.02) < 1.0


def solved_flat(flow: FlowCase, tmp_path: Path) -> Path:
    """A flat bed after 300 iterations: what is left is noise, and its residuals do not fall."""
    directory = case.prepare(flow, tmp_path)
    for old, new in (
        ("endTime             1000;", "endTime 300;"),
        ("Interval       1000", "Interval 300"),
    ):
        edit(directory / "system" / "controlDict", old, new)
    allrun(directory)
    return directory


@pytest.mark.parametrize(
    ("roughness", "first_cell"), [(3.3e-6, 2.5e-4), (3.3e-5, 2.5e-4), (1e-4, 5e-4), (1e-4, 2e-3)]
)
def test_a_flat_bed_keeps_the_friction_velocity(
    tmp_path: Path, roughness: float, first_cell: float
) -> None:
    """Along 60 h the flow does not change, and the log law of the wall holds from U_e to z_e."""
    flow = replace(
        PILE, slope_deg=0.0, roughness_m=roughness, first_cell_m=first_cell, cells_per_face=40
    )
    directory = solved_flat(flow, tmp_path)
    stress = SolvedFlow(directory).stress()
    assert np.ptp(stress.x_m[np.abs(stress.x_m) < 0.8]) > 60 * flow.height_m
    np.testing.assert_allclose(stress.ustar_over_ustar0_wall, 1.0, atol=0.002)
    assert SolvedFlow(directory).approach_ustar() == pytest.approx(1, abs=0.015)
    np.testing.assert_allclose(stress.ustar_over_ustar0_eq10, 1.0, atol=0.02)
    printed = stress.ustar_over_ustar0_eq10_printed / stress.ustar_over_ustar0_eq10
    z_over_z0 = first_cell / 2.0 / roughness
    np.testing.assert_allclose(printed, np.log(z_over_z0 + 1.0) / np.log(z_over_z0), rtol=1e-4)


@pytest.mark.parametrize("slope", [15.0, 30.0])
def test_a_domain_twice_as_large_gives_the_same_stress(solve: Solve, slope: float) -> None:
    flow = replace(PILE, slope_deg=slope)
    larger = replace(flow, lid=2 * flow.lid, upstream=2 * flow.upstream, downstream=200.0)
    ratio = windward_mean(solve(larger), larger) / windward_mean(solve(flow), flow)
    assert ratio**2 == pytest.approx(1, abs=0.01)
    small = replace(flow, lid=10.0, upstream=10.0, downstream=20.0)
    assert windward_mean(solve(small), small) > 1.02 * windward_mean(solve(flow), flow)


@pytest.mark.parametrize("slope", [15.0, 30.0])
def test_a_finer_mesh_gives_the_same_mean(solve: Solve, slope: float) -> None:
    coarse = replace(PILE, slope_deg=slope)
    fine = replace(coarse, cells_per_face=32)
    means = [windward_mean(solve(flow), flow) for flow in (coarse, fine)]
    assert means[0] == pytest.approx(means[1], rel=0.02)


@pytest.mark.parametrize(("speed", "tolerance"), [(5.0, 0.01), (20.0, 0.005)])
def test_the_stress_scales_with_the_speed(solve: Solve, speed: float, tolerance: float) -> None:
    other = replace(PILE, speed_m_s=speed)
    expected = windward_mean(solve(PILE), PILE)
    assert windward_mean(solve(other), other) == pytest.approx(expected, rel=tolerance)


def test_the_stress_scales_with_the_size(solve: Solve) -> None:
    larger = replace(
        PILE,
        height_m=10 * PILE.height_m,
        roughness_m=10 * PILE.roughness_m,
        first_cell_m=10 * PILE.first_cell_m,
        viscosity_m2_s=10 * PILE.viscosity_m2_s,
    )
    expected = windward_mean(solve(PILE), PILE)
    assert windward_mean(solve(larger), larger) == pytest.approx(expected, rel=1e-4)


def test_a_copy_run_by_hand_gives_the_same_bytes(solve: Solve, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(solve(PILE), tmp_path / '-a "b" c\'é'))
    shutil.rmtree(next(copy.glob("[1-9]*")))
    environment = {"PATH": os.environ["PATH"]}
    ended = subprocess.run([copy / "Allrun"], env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.count(": OK\n") == 7
    edit(copy / "parameters", "freeStream       10.0;", "freeStream       10.1;")
    ended = subprocess.run(["./Allrun"], cwd=copy, capture_output=True, text=True)
    assert ended.returncode != 0
    assert "U: FAILED" in ended.stdout


def test_the_template_runs_as_it_lies(template: Path) -> None:
    assert allrun(template).returncode == 0
    assert openfoam.check_log(template) > 10
    assert SolvedFlow(template).stress().tau_wall.max() > 2.0
    left = {path.name for path in template.iterdir()}
    subprocess.run([template / "Allclean"], check=True)
    gone = left - {path.name for path in template.iterdir()}
    assert {"log.simpleFoam", "log.gmshToFoam", "postProcessing"} < gone
    assert not (template / "constant" / "polyMesh").exists()


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 300.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def has_begun(directory: Path) -> bool:
    """Whether simpleFoam has begun to iterate in a case."""
    log = directory / "log.simpleFoam"
    return log.exists() and "Time = 3\n" in log.read_text()


def solver_pid(directory: Path) -> int:
    """Of the simpleFoam that has begun to iterate in a case."""
    wait_for(lambda: has_begun(directory))
    lines = (directory / "log.simpleFoam").read_text().splitlines()
    line = next(line for line in lines if line.startswith("PID"))
    return int(line.split(":")[1])


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_killed_solver_is_a_failed_case(tmp_path: Path) -> None:
    directory = case.prepare(SLOW, tmp_path)
    ended: list[process.Ended] = []
    thread = threading.Thread(target=lambda: ended.append(allrun(directory)))
    thread.start()
    os.kill(solver_pid(directory), signal.SIGKILL)
    thread.join()
    assert ended[0].returncode == 128 + signal.SIGKILL
    assert "simpleFoam failed" in (directory / "log.Allrun").read_text()
    with pytest.raises(SolverError, match=r"simpleFoam was stopped before its end; .* iteration"):
        SLOW.collect(directory)


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="needs setpriv of util-linux")
def test_a_killed_script_takes_the_solver_with_it(tmp_path: Path) -> None:
    directory = case.prepare(SLOW, tmp_path)
    script = subprocess.Popen(["./Allrun"], cwd=directory)
    pid = solver_pid(directory)
    script.kill()
    script.wait()
    wait_for(lambda: not is_alive(pid))


def test_a_time_limit_ends_the_solver(tmp_path: Path) -> None:
    for limit_s in (2.5, 10.0, 40.0, 160.0):  # a busy machine is still at the mesh
        (tmp_path / f"{limit_s}").mkdir()
        directory = case.prepare(SLOW, tmp_path / f"{limit_s}")
        edit(directory / "system/controlDict", "endTime             1000;", "endTime 1000000;")
        edit(directory / "system/fvSolution", "    residualControl", "    never")
        assert allrun(directory, limit_s=limit_s).over == "time"
        if has_begun(directory):
            break
    pid = solver_pid(directory)
    wait_for(lambda: not is_alive(pid))
    with pytest.raises(SolverError, match="stopped before its end"):
        SLOW.collect(directory)


def test_short_chords_do_not_end_the_iterations_early(solve: Solve) -> None:
    """The more cells, the less of the residual is left when the flow has come to rest."""
    ends = []
    for chords in (40, 240):
        t = np.linspace(0, 1, chords + 1)
        length = np.pi * PILE.height_m / np.tan(np.radians(26))
        wave = np.column_stack([length * t, PILE.height_m / 2 * (1 - np.cos(2 * np.pi * t))])
        line = between_flats(wave, PILE.height_m)
        hill = replace(PILE, slope_deg=26.0, line=line, lid=30.0, upstream=10.0, downstream=40.0)
        stress = WallStress.from_csv(solve(hill) / WALL_STRESS)
        ends.append(diagnostics.reattachment(stress, PILE.height_m))
    assert ends[1] == pytest.approx(ends[0], rel=0.05)


@pytest.mark.parametrize(
    ("trap", "cause"),
    [("true", "floating point exception after iteration"), ("false", "residuals are not numbers")],
)
def test_a_diverged_run(tmp_path: Path, trap: str, cause: str) -> None:
    directory = case.prepare(PILE, tmp_path)
    edit(directory / "system" / "fvSolution", "consistent      yes;", "consistent      no;")
    assert allrun(directory, FOAM_SIGFPE=trap).returncode != 0
    with pytest.raises(Exploded, match=f"simpleFoam diverged: .*{cause}"):
        PILE.collect(directory)


def test_a_run_that_needs_more_iterations(tmp_path: Path) -> None:
    directory = case.prepare(PILE, tmp_path)
    edit(
        directory / "system" / "controlDict", "endTime             1000;", "endTime             30;"
    )
    assert allrun(directory).returncode == 1
    with pytest.raises(Stalled, match=r"did not converge: .* after iteration 30"):
        PILE.collect(directory)


@pytest.mark.parametrize("name", ["wallShearStress", "U", "../constant/polyMesh/points"])
def test_a_broken_file_is_not_a_result(solve: Solve, tmp_path: Path, name: str) -> None:
    copy = Path(shutil.copytree(solve(PILE), tmp_path / "copy"))
    file = next(copy.glob("[1-9]*")) / name
    os.truncate(file, file.stat().st_size * 9 // 10)
    with pytest.raises(SolverError, match="the results are not whole"):
        PILE.collect(copy)


def test_results_of_another_mesh_are_refused(solve: Solve) -> None:
    with pytest.raises(SolverError, match=r"z_e is 0.5 to 0.5 of what the first"):
        replace(PILE, first_cell_m=1e-3).collect(solve(PILE))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("slope_deg", 1.0),
        ("slope_deg", -15.0),
        ("slope_deg", 70.0),
        ("slope_deg", float("nan")),
        ("height_m", 0.0),
        ("roughness_m", -1e-5),
        ("speed_m_s", float("inf")),
        ("viscosity_m2_s", 0.0),
        ("first_cell_m", 1e-2),
        ("cells_per_face", 2),
        ("non_orthogonal_correctors", -1),
        ("expansion_ratio", 1.0),
    ],
)
def test_an_unusable_field_is_named(field: str, value: Any) -> None:
    with pytest.raises(InputError) as raised:
        replace(PILE, **{field: value})
    assert raised.value.where == field


@pytest.mark.parametrize("model", ["RNGkEpsilon", "realizableKE", "kOmegaSST"])
def test_other_models_of_turbulence_keep_a_flat_beds_friction_velocity(
    tmp_path: Path, model: Turbulence
) -> None:
    """Their log law is another than k-epsilon's, whose constants are those of the lid."""
    flat = replace(PILE, slope_deg=0.0, turbulence_model=model)
    directory = solved_flat(flat, tmp_path)
    stress = SolvedFlow(directory).stress()
    np.testing.assert_allclose(stress.ustar_over_ustar0_wall, 1.0, atol=0.01)
    assert 0.01 < abs(SolvedFlow(directory).approach_ustar() - 1) < diagnostics.APPROACH_ERROR


def test_upwind_convection_gives_a_windward_stress_that_is_too_high(solve: Solve) -> None:
    upwind = replace(PILE, convection_scheme="upwind")
    means = [windward_mean(solve(flow), flow) for flow in (PILE, upwind)]
    assert 1.05 < means[1] / means[0] < 1.15


def test_more_correctors_give_the_same_stress(solve: Solve) -> None:
    more = replace(PILE, non_orthogonal_correctors=2)
    assert windward_mean(solve(more), more) == pytest.approx(
        windward_mean(solve(PILE), PILE), rel=1e-3
    )


def test_a_sound_run_says_so(solve: Solve) -> None:
    rows = (solve(PILE) / DIAGNOSTICS).read_text().splitlines()
    assert len(rows) == 5
    assert all(row.endswith(",yes") for row in rows[1:])


def test_upwind_convection_reattaches_too_early(solve: Solve) -> None:
    upwind = replace(PILE, convection_scheme="upwind", cells_per_face=40)
    assert "reattachment_over_h,4." in (solve(upwind) / DIAGNOSTICS).read_text()
    assert (solve(upwind) / DIAGNOSTICS).read_text().splitlines()[-1].endswith(",no")


def test_a_flow_that_is_not_turbulent_at_the_bed_has_no_answer(tmp_path: Path) -> None:
    beyond = replace(PILE, viscosity_m2_s=1e-3)
    directory = case.prepare(beyond, tmp_path)
    assert allrun(directory).returncode == 0
    with pytest.raises(SolverError, match="the wall function fails"):
        beyond.collect(directory)


def test_who_a_case_is() -> None:
    assert replace(PILE, slope_deg=15, speed_m_s=10).id == PILE.id
    assert replace(PILE, roughness_m=3.4e-5).id != PILE.id
    assert replace(PILE, turbulence_model="kOmegaSST").id != PILE.id
    assert PILE.name.startswith("flow-")
    assert set(PILE.versions()) == {"gmsh", "openfoam"}


def test_finer_and_steeper_cases_cost_more() -> None:
    assert PILE.cost_s < replace(PILE, slope_deg=35.0).cost_s < SLOW.cost_s


def test_the_default_first_cell() -> None:
    assert default_first_cell_height(0.02, 1e-6) == pytest.approx(5e-4)
    assert default_first_cell_height(0.02, 4e-4) == pytest.approx(1e-3)
    assert default_first_cell_height(0.02, 1e-6, viscous=4e-4) == pytest.approx(1e-3)
    assert default_first_cell_height(0.02, 5e-3) == pytest.approx(5e-3)


@pytest.mark.skipif(os.geteuid() != 0, reason="mounts a small file system")
def test_a_mesh_that_a_full_disk_cuts_is_not_solved_on(template: Path, tmp_path: Path) -> None:
    """On a part of a mesh setExprFields ends with a signal, or runs without an end."""
    small = tmp_path / "small"
    small.mkdir()
    for size in range(896, 936, 4):
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(small)]
        if subprocess.run(mount, capture_output=True).returncode != 0:
            pytest.skip("no file system can be mounted here")
        try:
            copy = Path(shutil.copytree(template, small / "pile"))
            subprocess.run(["./Allrun"], cwd=copy, timeout=60, capture_output=True)
            mesh = copy / "constant" / "polyMesh"
            files = [mesh / name for name in MESH_FILES]
            whole = all(f.is_file() and f.read_text().rstrip().endswith("* //") for f in files)
            assert whole or not (copy / "log.setExprFields").exists()
        finally:
            subprocess.run(["umount", str(small)], check=True)
