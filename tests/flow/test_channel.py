"""Flow in open water and in a closed channel: the balance of its slope, the log law, the tables."""

from dataclasses import replace
from math import log
from pathlib import Path

import numpy as np
import pytest

from orchestrator import plan, tables
from orchestrator.errors import InputError
from orchestrator.flow.case import WALL_STRESS, set_values
from orchestrator.flow.channel import ChannelFlow, mean_speed
from orchestrator.flow.solved import SolvedFlow
from orchestrator.flow.stress import WallStress
from orchestrator.runs import case
from orchestrator.study import study
from tests.flow.conftest import PILE, Solve, allrun

OPEN = ChannelFlow(
    **{name: value for name, value in vars(PILE).items() if name not in ("lid", "line", "id")},
    lid=6.0,
)
BED = """
grain = { diameter = 1e-3 }
protocol = { method = "pivot" }
[bed]
kind = "pile"
slope_deg = 15.0
roughness = 3e-5
[flow]
"""
WATER = 'model = "flat"\ntop = "open water"\ndepth = 0.3\n'


@pytest.mark.parametrize("closed", [False, True])
def test_over_a_flat_bed_the_stress_balances_the_slope(tmp_path: Path, closed: bool) -> None:
    """The force of the slope is u*_0^2 on each wall; no place of the bed feels more or less."""
    flow = replace(OPEN, slope_deg=0.0, closed=closed, upstream=20.0, downstream=20.0)
    directory = case.prepare(flow, tmp_path)
    allrun(directory)  # to the last iteration: the residual of Uz is that of noise
    assert SolvedFlow(directory).approach_ustar() == pytest.approx(1, abs=2e-3)
    stress = SolvedFlow(directory).stress()
    np.testing.assert_allclose(stress.ustar_over_ustar0_wall, 1, atol=2e-3)
    (found,) = flow.of_the_top(SolvedFlow(directory)).values()
    # k-epsilon is slow to mix below a surface: above the log law
    assert 1 < found.value < 1.1


def test_the_template_runs_as_a_channel(template: Path) -> None:
    set_values(template / "parameters", top="open")
    assert allrun(template).returncode == 0
    assert SolvedFlow(template).approach_ustar() == pytest.approx(1, abs=0.02)
    assert SolvedFlow(template).stress().tau_wall.max() > 2


def test_shallow_water_is_faster_over_a_form(solve: Solve) -> None:
    """What the form leaves of the depth has to carry the same water."""
    mean = []
    for flow in (PILE, OPEN, replace(OPEN, lid=3.0)):
        stress = WallStress.from_csv(solve(flow) / WALL_STRESS)
        face = (stress.x_m > 0) & (stress.z_m > 0) & (stress.x_m < 0.0746)
        mean.append(float(stress.ustar_over_ustar0_wall[face].mean()))
    assert mean[0] < 0.95 * mean[1] < 0.9 * mean[2]


def test_the_mean_speed_is_that_of_the_log_law() -> None:
    """U/u* = (ln(D/z0) - 1)/0.41 for z0 far below the depth; a closed channel is two halves."""
    assert mean_speed(0.1, 1.0, 1e-5, closed=False) == pytest.approx(
        0.1 / 0.41 * (log(1e5) - 1), rel=1e-3
    )
    assert mean_speed(0.1, 2.0, 1e-5, closed=True) == mean_speed(0.1, 1.0, 1e-5, closed=False)


def test_tables_have_the_discharge(tmp_path: Path) -> None:
    asked = study.parse(BED + WATER, name="t", where="t")
    planned = plan.make(asked)
    rows = tables.make(asked, planned, tmp_path, ())["pile_threshold"]
    speed = mean_speed(1.0, 0.3, 3e-5, closed=False) * rows["ustar0_m_s"]
    np.testing.assert_allclose(rows["mean_speed_m_s"], speed)
    np.testing.assert_allclose(rows["discharge_m2_s"], 0.3 * speed)
    assert "u_1m_m_s" not in rows


@pytest.mark.parametrize(
    ("flow", "what"),
    [
        ("depth = 1.0", "flow.depth: a boundary layer has none"),
        ('top = "open water"', "flow.depth: the depth of open water is missing"),
        ('top = "open water"\ndepth = 0.05', "less than 3 heights of the forms"),
        ('top = "open water"\ndepth = 1.0\nmodel = "hill"', "the theory hill is of a flow without"),
    ],
)
def test_a_channel_has_a_depth_that_forms_do_not_fill(flow: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        study.parse(BED + flow, name="t", where="t")


def test_a_boundary_layer_is_the_case_that_it_was() -> None:
    case_of = plan.make(study.parse(BED, name="t", where="t")).cases
    assert [one.template for one in case_of.values()] == ["openfoam/pile"]
    assert all("closed" not in one.parameters for one in case_of.values())
