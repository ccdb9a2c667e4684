"""The stress on the bed against that of OpenFOAM's function object ``wallShearStress``."""

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista

from orchestrator.bed.line import of_bed
from orchestrator.errors import SolverError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.foam import SolvedFlow, read_list
from orchestrator.types import FloatArray
from tests.bed.test_line import BEDS, bed
from tests.flow.conftest import OPEN, PILE, Solve, allrun, changed, edit

RECORDED = Path(__file__).with_name("wall_shear.csv")
"""What the function object of OpenFOAM 1912 gave on Debian 12 for the template as it lies."""
NO_FUNCTION_OBJECTS = 'error in IOstream "sha1"'
"""How OpenFOAM 1912 of Debian 13 ends whenever it reads a function object."""


def over(shape: str) -> FlowCase:
    """The flow over one of the bed lines that the tests of `bed` have."""
    asked = bed(**BEDS[shape])
    return replace(PILE, slope_deg=asked.slope_deg, line=of_bed(asked))


FLOWS = {
    "kEpsilon": PILE,
    "RNGkEpsilon": changed(PILE, turbulence_model="RNGkEpsilon"),
    "realizableKE": changed(PILE, turbulence_model="realizableKE"),
    "kOmegaSST": changed(PILE, turbulence_model="kOmegaSST"),
    "upwind": changed(PILE, convection_scheme="upwind"),
    "steep": replace(changed(PILE, cells_per_face=32), slope_deg=32.0),
    "smooth": changed(PILE, roughness=3.3e-6),
    "open water": OPEN,
    "closed channel": changed(OPEN, top="closed channel"),
    "curved": over("curved and rounded"),
    "cosine": over("cosine"),
    "fence": over("fence"),
    "cylinder": over("cylinder"),
    "block on it": over("block on it"),
}


def by_function_object(directory: Path) -> FloatArray:
    """Let OpenFOAM's function object write the field into a case; its values on the bed."""
    program = "simpleFoam -postProcess -latestTime -func wallShearStress"
    home = {"WM_PROJECT_DIR": "/usr/share/openfoam", "PWD": "/proc/self/cwd"}
    ended = subprocess.run(
        program.split(),
        cwd=directory,
        env={**home, **os.environ, "PWD": home["PWD"]},
        capture_output=True,
        text=True,
    )
    if NO_FUNCTION_OBJECTS in ended.stdout + ended.stderr:
        pytest.skip("the OpenFOAM of this release cannot read function objects")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return SolvedFlow(directory).wall_shear


def assert_same(ours: FloatArray, theirs: FloatArray) -> None:
    """To 1e-6 of the stress of each face, and where it vanishes of a thousandth of the mean."""
    size = np.linalg.norm(theirs, axis=1)
    error = np.linalg.norm(ours - theirs, axis=1)
    assert np.all(error <= 1e-6 * np.maximum(size, 1e-3 * size.mean()))


@pytest.mark.parametrize("name", FLOWS)
def test_the_stress_is_that_of_the_function_object(
    solve: Solve, tmp_path: Path, name: str
) -> None:
    solved = solve(FLOWS[name])
    ours = SolvedFlow(solved).wall_shear
    copy = Path(shutil.copytree(solved, tmp_path / "copy"))
    (SolvedFlow(copy).last_iteration / "wallShearStress").unlink()
    assert_same(ours, by_function_object(copy))


def test_the_stress_is_the_recorded_one_on_every_release(template: Path) -> None:
    """So the comparison does not end where the function object cannot be used."""
    assert allrun(template).returncode == 0
    recorded = np.loadtxt(RECORDED, delimiter=",", skiprows=1)
    stress = SolvedFlow(template).wall_shear
    assert_same(stress, np.insert(recorded, 1, 0.0, axis=1))
    reader = pyvista.POpenFOAMReader(str(template / "flow.foam"))
    reader.set_active_time_value(reader.time_values[-1])
    boundary: Any = reader.read()["boundary"]
    seen = boundary["bed"].cell_data["wallShearStress"]
    np.testing.assert_allclose(seen, stress, rtol=1e-6)


@pytest.mark.parametrize("name", ["kEpsilon", "closed channel", "cylinder"])
def test_a_study_reads_the_fields_with_six_digits(
    solve: Solve, tmp_path: Path, name: str
) -> None:
    """So that processors whose fields differ in their last digits read the same."""
    copy = Path(shutil.copytree(solve(FLOWS[name]), tmp_path / "copy"))
    solved = SolvedFlow(copy)
    solved.check()
    x, _, z = solved.mesh.middles.T
    # the column before the inlet, whose cells stand one on another
    column = np.flatnonzero(x < x.min() + 1e-9)
    points = read_list(copy / "constant/polyMesh/points")
    levels = np.unique(points[points[:, 0] < points[:, 0].min() + 1e-9, 2])
    speed = solved.velocity[column[np.argsort(z[column])], 0]
    mean = np.average(speed, weights=np.diff(levels))
    assert solved.column_speed() == pytest.approx(mean, rel=5e-6)
    for table in ("bed_flow.csv", "column_flow.csv"):
        values = np.loadtxt(copy / table, delimiter=",", skiprows=1)
        assert all(float(f"{value:.6g}") == value for value in values.ravel())
    # tables of another run are noticed
    bed_flow = copy / "bed_flow.csv"
    rows = bed_flow.read_text().splitlines()
    rows[20:22] = rows[21:19:-1]
    bed_flow.write_text("\n".join(rows) + "\n")
    with pytest.raises(SolverError, match=r"bed_flow\.csv is not of these fields"):
        SolvedFlow(copy).check()


def test_the_last_iteration_is_read(template: Path) -> None:
    """Whichever of the directories a listing has first."""
    edit(
        template / "system/controlDict",
        "writeInterval       $iterations;",
        "writeInterval 7;",
    )
    assert allrun(template).returncode == 0
    written = sorted(int(path.name) for path in template.glob("[1-9]*"))
    assert len(written) > 10
    assert SolvedFlow(template).last_iteration.name == str(written[-1])
    assert (template / str(written[-1]) / "wallShearStress").is_file()
    velocity = read_list(
        template / str(written[-1]) / "U", "internalField   nonuniform"
    )
    np.testing.assert_array_equal(SolvedFlow(template).velocity, velocity)


@pytest.mark.parametrize("name", ["0/U", "0/nut", "constant/polyMesh/owner"])
def test_a_stress_of_files_that_are_cut_is_none(
    solve: Solve, tmp_path: Path, name: str
) -> None:
    copy = Path(shutil.copytree(solve(PILE), tmp_path / "copy"))
    last = SolvedFlow(copy).last_iteration.name
    cut = copy / name.replace("0/", f"{last}/")
    os.truncate(cut, cut.stat().st_size * 9 // 10)
    program = [
        "awk",
        "-v",
        f"time={last}",
        "-v",
        "nu=1e-05",
        "-f",
        "wallShearStress.awk",
    ]
    ended = subprocess.run(program, cwd=copy, capture_output=True, text=True)
    assert ended.returncode == 1
    assert f"the results are not whole: {cut.relative_to(copy)}" in ended.stderr


def test_a_case_without_iterations_has_no_results(template: Path) -> None:
    with pytest.raises(SolverError, match="no results"):
        _ = SolvedFlow(template).velocity
