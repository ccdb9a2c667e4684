"""Beds that come to rest and beds that do not, on the real solver."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import Exploded, Noisy, SolverError
from orchestrator.grains import rest
from orchestrator.grains.deck import GrainTable
from orchestrator.runs import case
from orchestrator.runs.case import templates
from orchestrator.runs.files import read_json

DIAMETER, DENSITY, GRAVITY, STIFFNESS = 1e-3, 2500.0, 9.806076000000001, 1e3
WEIGHT = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY


@pytest.fixture(scope="module")
def grains() -> GrainTable:
    """Those of the template's own pile; rest looks at how many may move."""
    lines = (templates() / "liggghts" / "bed" / "grains.data").read_text().splitlines()
    rows = np.array([line.split() for line in lines[lines.index("Atoms") + 2 :]], float)
    return GrainTable(
        position=rows[:, 4:],
        kind=rows[:, 1].astype(np.int64),
        along=np.tile([1.0, 0.0], (len(rows), 1)),
        sizes=np.ones(len(rows)),
        diameter=DIAMETER,
        density=DENSITY,
    )


def _settled(folder: Path, *, time_step: float, damping: float) -> Path:
    """The template's pile with a contact law of its own, run to its end."""
    copy = folder / "bed"
    shutil.copytree(templates() / "liggghts" / "bed", copy)
    text = (copy / "parameters.liggghts").read_text()
    for name, value in (
        ("time_step", time_step),
        ("damping", damping),
        ("stiffness", STIFFNESS),
    ):
        text = re.sub(rf"( {name} equal) \S+", rf"\1 {value}", text)
    (copy / "parameters.liggghts").write_text(text)
    subprocess.run(["./Allrun"], cwd=copy, capture_output=True)
    return copy


def _check(directory: Path, grains: GrainTable, *, all_rest: bool = True) -> None:
    rest.check(directory, grains, WEIGHT, STIFFNESS, all_rest=all_rest)


def test_a_bed_comes_to_rest(tmp_path: Path, grains: GrainTable) -> None:
    found = _settled(tmp_path, time_step=0.3, damping=0.1)
    _check(found, grains)
    energy = rest.read(found)["ke"] / grains.mobile_count / (WEIGHT * DIAMETER) * STIFFNESS
    assert energy.iloc[-5:].mean() < 0.01 * rest.NOISE
    assert energy.iloc[0] > rest.NOISE  # it did fall into place


def test_a_step_far_too_large_throws_the_grains_out(tmp_path: Path, grains: GrainTable) -> None:
    found = _settled(tmp_path, time_step=1.2, damping=0.1)
    for all_rest in (True, False):
        with pytest.raises(Exploded, match=r"settling.csv: the bed burst .* protocol.time_step"):
            _check(found, grains, all_rest=all_rest)


@pytest.mark.parametrize(("time_step", "damping"), [(0.6, 0.1), (0.5, 0.2), (0.4, 0.3)])
def test_a_step_too_large_keeps_the_grains_moving(
    tmp_path: Path, grains: GrainTable, time_step: float, damping: float
) -> None:
    found = _settled(tmp_path, time_step=time_step, damping=damping)
    with pytest.raises(Noisy, match="the bed does not come to rest"):
        _check(found, grains)


def test_energy_that_grows(tmp_path: Path, grains: GrainTable) -> None:
    found = _settled(tmp_path, time_step=0.2, damping=0.7)
    # a noisy run goes up and down by chance; made to grow, it is another kind of failure
    table = rest.read(found)
    growing = table["ke"].sort_values().to_numpy() * np.linspace(1, 4, len(table))
    table.assign(ke=growing).to_csv(found / rest.SETTLING, index=False)
    with pytest.raises(Exploded, match="the energy of the bed at rest grows"):
        _check(found, grains)


def test_grains_that_are_lost(tmp_path: Path, grains: GrainTable) -> None:
    found = _settled(tmp_path, time_step=0.3, damping=0.1)
    one_more = np.append(grains.kind, grains.kind.max())
    with pytest.raises(Exploded, match="1 of 47 grains were lost before the flow rose"):
        _check(found, replace(grains, kind=one_more))


def test_ends_have_a_word_of_their_own(tmp_path: Path) -> None:
    for kind, word in ((SolverError, "failed"), (Exploded, "exploded"), (Noisy, "noisy")):
        case.fail(tmp_path, kind("it went wrong"))
        assert read_json(tmp_path / case.FAILED) == {"ended": word, "cause": "it went wrong"}
    assert case.failure(tmp_path) == "noisy: it went wrong"
