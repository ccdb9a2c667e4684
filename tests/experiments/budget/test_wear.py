"""The bed that changes."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.experiments.budget import wear
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.workspace import Workspace
from tests.experiments.budget.conftest import scene

PILE = {"slope_deg": 25.0, "height": 0.01}


@pytest.mark.parametrize("packing", ["aligned", "horizontal"])
def test_a_whole_bed_has_not_sunk(packing: str) -> None:
    bed = LoadedBed(scene(**PILE, packing=packing))
    line = wear.sunk(bed, np.ones(len(bed.packing.centres), bool))
    x = np.linspace(line.x[0], line.x[-1], 500)
    assert line.height(x) == pytest.approx(bed.line.height(x), abs=1e-9)


def test_a_bared_row_sinks_by_a_row() -> None:
    bed = LoadedBed(scene(**PILE))
    s = bed.packing.arc_length
    middle = bed.packing.windward & (s > 0.25 * bed.line.crest_s) & (s < 0.75 * bed.line.crest_s)
    line = wear.sunk(bed, ~middle)
    # rows are sin(beta) apart along the normal, so much over the cosine of the slope upright
    row = np.sin(np.radians(60.0)) / np.cos(np.radians(25.0))
    x = float(bed.line.crest[0]) / 2
    sunk = bed.line.height(np.array([x])) - line.height(np.array([x]))
    assert sunk == pytest.approx(row, abs=0.3)
    for untouched in (0.1, 0.95):
        x = untouched * float(bed.line.crest[0])
        assert line.height(np.array([x])) == pytest.approx(bed.line.height(np.array([x])), abs=1e-6)


def test_a_pile_wears_to_its_end(tmp_path: Path) -> None:
    pile = scene(**PILE)
    (one,) = (piles := wear.wears({pile.id: pile}, tmp_path, ())).values()
    space = Workspace(tmp_path / "out")
    with space.held(EXPERIMENT, "wear"):
        wear.run(piles, space, workers=2, limit_s=600.0)
    assert one.fraction >= wear.LAST
    assert len(one.ran) == len(set(one.ran)) == len(one.lines) - 1
    windward = one.bed.packing.windward
    # until the first tenth has gone nothing has changed
    first = np.sort(one.left[windward])[: int(wear.UPDATE * one.bed.packing.count)]
    assert first == pytest.approx(np.sort(one.frozen)[: len(first)], rel=1e-12)
    for before, after in zip(one.lines[:-1], one.lines[1:], strict=True):
        x = np.linspace(before.x[0], before.x[-1], 300)
        assert np.all(after.height(x) <= before.height(x) + 1e-6)
    frozen, worn = one.thresholds(0.5)
    # where the grains above have gone the next one feels more of the flow
    assert 0.7 < worn.ustar0 / frozen.ustar0 < 1.2
    assert worn.ustar0 != frozen.ustar0


def test_grains_that_the_mesh_cannot_resolve_are_left_out(tmp_path: Path) -> None:
    assert not wear.wears({"fine": scene(slope_deg=25.0, height=0.2)}, tmp_path, ())
