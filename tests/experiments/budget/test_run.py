"""The budget from a study to its page, by the real solvers."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator.errors import InputError
from orchestrator.experiments.budget import shares
from orchestrator.experiments.budget.choices import CHOICES
from orchestrator.experiments.budget.run import run
from orchestrator.fidelity.spread import FROZEN
from orchestrator.study import study
from orchestrator.study.parts import PileBed

SMALL = """
grain = { diameter = 1e-3, sizes = { sigma_g = 1.2 } }
flow = { model = "solve" }
[bed]
kind = "pile"
slope_deg = 25.0
height = 0.007
roughness = "d/30"
packing = "poured"
"""
LEVEL = """
grain = { diameter = 1e-3, sizes = { sigma_g = 1.2 } }
bed = { kind = "pile", shape = "flat", length = 0.02, packing = "poured" }
flow = { model = "flat" }
"""
OF_LATTICES = "entrainment angle"


def test_every_choice_has_its_share_on_a_poured_pile(tmp_path: Path) -> None:
    asked = study.parse(SMALL, name="small", where="small")
    finished = run(asked, tmp_path / "out", workers=2)
    assert not finished.failures
    shared = pd.read_csv(tmp_path / "out" / "tables" / "shares.csv")
    assert set(shared["choice"]) == {one.name for one in CHOICES} - {OF_LATTICES} | {FROZEN}
    moved = (
        shared.groupby("choice")["shields_high"].max()
        + shared.groupby("choice")["shields_low"].max()
    )
    # the grains' drag grows with z0, and another seed is another bed
    assert moved["roughness length"] > 0.1
    assert moved["packing"] > 0.1
    # a mean over a grain cannot feel half of 1/40 of the height
    assert moved["averaging length"] < 0.05
    page = (tmp_path / "out" / "report.html").read_text()
    assert all(f"<td>{one.name}" in page for one in CHOICES if one.name != OF_LATTICES)
    assert run(asked, tmp_path / "out", workers=2).started == 0


def test_a_flow_that_is_not_solved_has_no_choices_of_its_own() -> None:
    asked = study.parse(LEVEL, name="level", where="level")
    found = shares.decisions(asked)
    assert all(one.scene.flow.model == "flat" for one in found.values())
    changed = {shares.name_of(key).partition(":")[0] for key in found} - {shares.BASE}
    assert changed == {
        one.name for one in CHOICES if not one.of_solved_flow and one.name != OF_LATTICES
    }
    seeds = {one.scene.bed.seed for one in found.values() if isinstance(one.scene.bed, PileBed)}
    assert seeds == {0, 1, 2, 3}


def test_a_study_without_piles(tmp_path: Path) -> None:
    asked = study.parse("grain = { diameter = 1e-3 }", name="one", where="one")
    with pytest.raises(InputError, match="there is no pile"):
        run(asked, tmp_path / "out", workers=1)
