"""Validation: exact pockets of laid grains, scores, the paper's rule, and measured rows."""

import math
import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed.packing import Packing
from orchestrator.experiments import validate
from orchestrator.flow.stress import WallStress
from orchestrator.physics import beside

TOOL = Path(__file__).parents[2] / "tools" / "tested.py"
FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")


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


def test_an_interval_is_the_widest_without_one_of_the_sets() -> None:
    ends = runpy.run_path(str(TOOL))["ends"]
    ratio = pd.Series([*np.arange(1.0, 12), *np.arange(21.0, 32), 100.0])
    sets = pd.Series(["a"] * 11 + ["b"] * 11 + ["c"])
    # the percentiles of 12 ratios without b, of all and without a: that of c alone is too few
    assert ends(ratio, sets) == (2.0, 31.0)
    assert ends(ratio[:11], sets[:11]) == (2.0, 10.0)


def test_the_interval_of_a_kind_holds_its_rows_in_flumes() -> None:
    beds = pd.read_csv(validate.FOLDER / "beds.csv").query("set in @FLUMES")
    at = validate.single(beds, "bridged")
    here = (at.reynolds >= 1) & (at.reynolds < 10)
    grain = {"force_law": "bridged", "beta_deg": 60.0, "d_m": 3e-4, "z0_m": 1e-5, "alpha_deg": 0.0}
    grain |= {"alpha_s": 1.615, "cohesion_n_m": 0.0, "rho_f_kg_m3": 1000.0}
    low, high, rows, held = beside.interval(beside.kind_of(grain), 5.0)
    ratio = (beds["shields"] / at.shields)[here]
    assert len(ratio) == rows
    assert ratio.between(low, high).mean() == pytest.approx(held)
    # nothing was measured on slopes, of another angle or with cohesion
    for other in ({"alpha_deg": 5.0}, {"beta_deg": 52.0}, {"cohesion_n_m": 1e-4}):
        assert not beside.interval(beside.kind_of({**grain, **other}), 5.0)[2]


def test_a_stress_that_is_the_measured_one_over_a_hump_is_met_at_every_row() -> None:
    x, cf, ones = pd.read_csv(validate.FOLDER / "hump_stress.csv").to_numpy().T
    # in other units, at the same places
    stress = WallStress(x * 0.42, x * 0.42, ones, ones, ones, 300 * cf, ones, ones)
    measured, value, *_ = validate.over_hump(stress).to_numpy().T
    assert value.astype(float) == pytest.approx(measured.astype(float), rel=1e-9)
