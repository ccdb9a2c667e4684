"""The budget from a study to its page, by the real solvers."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator.errors import InputError
from orchestrator.experiments.budget import shares
from orchestrator.experiments.budget.choices import CHOICES
from orchestrator.experiments.budget.run import run
from orchestrator.study import study

SMALL = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", slope_deg = 25.0, height = 0.01, roughness = "d/30" }
flow = { model = "solve" }
"""


def test_every_choice_has_its_share(tmp_path: Path) -> None:
    asked = study.parse(SMALL, name="small", where="small")
    finished = run(asked, tmp_path / "out", workers=2)
    assert not finished.failures
    shared = pd.read_csv(tmp_path / "out" / "tables" / "shares.csv")
    assert set(shared["choice"]) == {one.name for one in CHOICES} | {shares.FROZEN}
    moved = (
        shared.groupby("choice")["shields_high"].max()
        + shared.groupby("choice")["shields_low"].max()
    )
    # the grains' drag grows with z0, and level rows are no rows along the slope
    assert moved["roughness length"] > 0.1
    assert moved["packing"] > 0.1
    # a mean over a grain cannot feel half of 1/40 of the height
    assert moved["averaging length"] < 0.05
    page = (tmp_path / "out" / "report.html").read_text()
    assert all(f"<td>{one.name}" in page for one in CHOICES)
    assert run(asked, tmp_path / "out", workers=2).started == 0


def test_a_study_without_piles(tmp_path: Path) -> None:
    asked = study.parse("grain = { diameter = 1e-3 }", name="one", where="one")
    with pytest.raises(InputError, match="there is no pile"):
        run(asked, tmp_path / "out", workers=1)
