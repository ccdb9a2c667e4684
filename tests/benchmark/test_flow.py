"""The flow of examples/flow, which shares no line with ours: a flat bed, and one pile."""

import shlex
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.benchmark import runner
from orchestrator.benchmark.runner import Choice
from orchestrator.runs.confined import Limits
from tests.benchmark.conftest import ROOT

FLOW = ROOT / "examples" / "flow"


@pytest.mark.parametrize("z0", [3.3e-6, 1e-4])
def test_a_flat_bed_keeps_the_stress_that_approaches(
    z0: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FLOW))
    import rans  # type: ignore[import-not-found]

    h = 0.02
    x = np.linspace(0.0, 40 * h, 11)
    heights = 20 * h * (1.1 ** np.arange(41) - 1) / (1.1**40 - 1)
    flow = rans.solve(x, heights, np.zeros(len(x)), 0.4, z0, 1e-5)
    assert flow.ratio == pytest.approx(1.0, abs=1e-4)
    assert flow.own == pytest.approx(1.0, abs=0.015)


def test_the_stress_on_a_pile_is_that_of_openfoam(all_levels: Path, tmp_path: Path) -> None:
    solver = f"{shlex.join([sys.executable, str(FLOW / 'answer.py')])} {{case}} {{out}} 0.5"
    choice = Choice(levels=(3, 5))
    found = runner.run(all_levels, solver, tmp_path / "results", choice, Limits(seconds=600.0))
    assert found.failures == []
    told = pd.read_csv(tmp_path / "results" / "comparison.csv")
    mean = told[told["quantity"] == "windward_mean"].iloc[0]
    assert mean["found"] == pytest.approx(mean["value"], rel=0.03)
