"""A case runs by hand as it lies, and runs nothing where two of its files contradict each other."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator.runs.case import templates
from tests.flow.conftest import copied, edit, of_hill

LIGGGHTS = ("bed", "poured", "rebound")
BEDS = ("pile", "hill")
"""Beds that the template has meshes of."""
OF_FLOWS = ("lidHeight", "firstCentre", "approachOffset")


def _allrun(case: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(["./Allrun"], cwd=case, capture_output=True, text=True)


def _multiplied(path: Path, name: str, factor: float) -> None:
    """Multiply the number behind a name of a file of parameters."""
    text, count = re.subn(
        rf"(?m)^((?:variable +)?{name} +(?:equal )?)([^ ;]+)",
        lambda found: f"{found[1]}{float(found[2]) * factor:.9g}",
        path.read_text(),
    )
    assert count == 1
    path.write_text(text)


@pytest.mark.parametrize("template", LIGGGHTS)
@pytest.mark.parametrize("name", ["diameter", "(?:grain_)?density"])
def test_grains_of_another_size_or_density_are_refused(
    template: str, name: str, tmp_path: Path
) -> None:
    case = tmp_path / "case"
    shutil.copytree(templates() / "liggghts" / template, case)
    before = {path.name for path in case.iterdir()}
    _multiplied(case / "parameters.liggghts", name, 1.01)
    ended = _allrun(case)
    word = name.rpartition(")?")[2]
    assert ended.returncode == 1
    assert re.fullmatch(
        rf"Allrun: .*{word}.* in grains\.data: change both.*\n", ended.stderr
    )
    assert {path.name for path in case.iterdir()} == before


def test_a_density_that_is_changed_in_both_files_moves_the_threshold(
    tmp_path: Path,
) -> None:
    at = []
    for factor in (1.0, 2.0):
        case = tmp_path / str(factor)
        shutil.copytree(templates() / "liggghts" / "bed", case)
        _multiplied(case / "parameters.liggghts", "density", factor)
        grains = case / "grains.data"
        heavy = f" 0.001 {2500 * factor} "
        grains.write_text(grains.read_text().replace(" 0.001 2500.0 ", heavy))
        # the forces are those of the flow: they rise up to the same
        ended = _allrun(case)
        assert ended.returncode == 0, ended.stderr
        at.append(ended.stdout)
    assert at[0] != at[1]


def _of_bed(bed: str, tmp_path: Path) -> Path:
    """A copy of the template whose mesh is made, as in the case of a study."""
    case = copied(tmp_path)
    if bed == "hill":
        of_hill(case)
    control = case / "system" / "controlDict"
    control.write_text(re.sub(r"(?m)^endTime .*", "endTime 1;", control.read_text()))
    _allrun(case)
    assert (case / "log.simpleFoam").is_file()
    (case / "log.gmshToFoam").unlink()
    return case


def _is_refused(case: Path, name: str) -> None:
    """Nothing is solved, and what the mesh has is named."""
    ended = _allrun(case)
    assert ended.returncode == 1
    assert re.fullmatch(
        rf"Allrun: {name} is .* in the mesh: change both.*\n", ended.stderr
    )
    assert not (case / "log.simpleFoam").exists()


@pytest.mark.parametrize("bed", BEDS)
@pytest.mark.parametrize("name", OF_FLOWS)
def test_numbers_that_the_mesh_contradicts_are_refused(
    name: str, bed: str, tmp_path: Path
) -> None:
    case = _of_bed(bed, tmp_path)
    _multiplied(case / "parameters", name, 1.1)
    _is_refused(case, name)


@pytest.mark.parametrize(
    ("bed", "old", "new"), [("pile", "empty", "slip"), ("hill", "slip", "empty")]
)
def test_sides_that_the_mesh_contradicts_are_refused(
    bed: str, old: str, new: str, tmp_path: Path
) -> None:
    case = _of_bed(bed, tmp_path)
    edit(case / "parameters", f" {old};", f" {new};")
    _is_refused(case, "sides")


def test_both_beds_of_the_template_have_the_same_parameters() -> None:
    folder = templates() / "openfoam/flow"
    names = []
    for bed in (folder, folder / "hill"):
        text = (bed / "parameters").read_text()
        names.append(re.findall(r"(?m)^(\w+) ", text))
    assert names[0] == names[1]
    assert "sides" in names[0]
