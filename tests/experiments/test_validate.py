"""Validation: exact pockets of laid grains, scores, the paper's rule, and measured rows."""

import math

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed.packing import Packing
from orchestrator.experiments import validate
from orchestrator.flow.stress import WallStress
from orchestrator.physics.curves import Air, iversen_white


def test_grains_laid_on_a_close_packed_layer_lie_in_its_pockets() -> None:
    # rows lie across the flow, so that pockets point up and down it
    rows, columns = 16, 6
    y, x = np.meshgrid(np.arange(columns) + 0.0, np.arange(rows) * math.sqrt(3) / 2)
    y = (y + np.where(np.arange(rows)[:, None] % 2, 0.5, 0.0)).ravel()
    every, flat = np.ones(len(y), bool), np.column_stack([x.ravel(), np.zeros_like(y)])
    packing = Packing(flat, np.ones(len(y)), every, every, ~every, x.ravel(), y, float(columns))
    angles = validate.laid(packing, 20)
    exact = np.degrees(np.arctan([math.sqrt(1 / 8), math.sqrt(1 / 2)]))
    assert np.abs(angles[:, None] - exact).min(axis=1).max() < 0.1
    # downstream of a pocket is either the saddle between two grains or the top of one
    assert {int(np.abs(angle - exact).argmin()) for angle in angles} == {0, 1}


def test_a_score_is_of_rows_that_were_read_alone() -> None:
    rows = pd.DataFrame({"set": "a", "model": "m", "ratio": [0.5, 2.0, 4.0, 100.0, np.nan]})
    (score,) = validate.scores(rows.assign(sure=["read"] * 3 + ["memory", "read"])).to_dict(
        "records"
    )
    assert (score["rows"], score["answered"]) == (4, 3)
    assert (score["ratio"], score["factor"], score["worst"]) == (2.0, 2.0, 4.0)


def test_the_rows_of_the_wind_tunnel_are_on_their_curve() -> None:
    air = Air(density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    tunnel = pd.read_csv(validate.FOLDER / "beds.csv").query("set == 'wind tunnel, curve'")
    d, shields = tunnel[["d_m", "shields"]].to_numpy().T
    assert shields == pytest.approx(air.shields_diagram(d, iversen_white(d, air))[1], rel=1e-3)


def test_a_stress_that_is_the_measured_one_over_a_hump_is_met_at_every_row() -> None:
    x, cf, ones = pd.read_csv(validate.FOLDER / "hump_stress.csv").to_numpy().T
    # in other units, at the same places
    stress = WallStress(x * 0.42, x * 0.42, ones, ones, ones, 300 * cf, ones, ones)
    measured, value, *_ = validate.over_hump(stress).to_numpy().T
    assert value.astype(float) == pytest.approx(measured.astype(float), rel=1e-9)
