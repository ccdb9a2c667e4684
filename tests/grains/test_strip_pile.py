"""Strips in space through the whole line: pour, forces, motion, tables and page."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import tables
from orchestrator.plan import Plan
from orchestrator.report import piles
from orchestrator.report.results import Results
from orchestrator.study import study
from tests import small_study

STUDY = """
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0, stiffness = 1e3 }
flow = { model = "flat" }
[bed]
kind = "pile"
shape = "flat"
height = 0.005
length = 0.004
packing = "poured"
poured_depth = 3.0
width = 3.0
mobile_layers = 1
[protocol]
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.4
fractions = [0.1, 0.3]
[axes]
"protocol.method" = ["pivot", "dem"]
"""
ASKED = study.parse(STUDY, name="strip", where="test")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    cases = tmp_path_factory.mktemp("cases")
    return small_study.in_turn(ASKED, cases), cases


def test_grains_lie_between_the_sides_and_feel_the_flow_along_x(
    finished: tuple[Plan, Path],
) -> None:
    planned, cases = finished
    pile = next(one for one in planned.piles.values() if one.by_dem)
    text = (cases / pile.case.name / "grains.data").read_text()
    assert "0.0 0.003 ylo yhi" in text
    rows = np.array([row.split() for row in text.partition("Atoms\n\n")[2].splitlines()], float)
    y = rows[:, 5] / pile.scene.grain.diameter
    assert y.min() >= 0
    assert y.max() < 3.0
    assert np.ptp(y) > 2.0
    exposed = pile.packing.windward
    # some lie beside others at one x
    assert exposed.sum() > 4.0
    force = pile.loads(cases).loading.at(0.02)
    assert (force[exposed] > 0).all()


def test_pivots_and_dem_answer(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    made = tables.make(ASKED, planned, cases, list(planned.cases))
    rows = made["pile_threshold"].merge(made["scenes"][["scene_id", "method"]], on="scene_id")
    early = rows[rows["fraction"] == 0.1].set_index("method")["shields"]
    assert set(early.index) == {"pivot", "dem"}
    assert early.between(0.003, 0.1).all()
    grains = made["pile_grain"]
    assert grains["y_m"].between(0, 0.003).all()
    held = grains["pivot_deg"].dropna()
    assert len(held) > 0.3 * len(grains)
    assert held.between(-30, 120).all()


def test_the_page_shows_the_strip_from_above(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    made = tables.make(ASKED, planned, cases, list(planned.cases))
    found = {one.name: one for one in piles.poured(Results(ASKED, planned, made, cases))}
    assert {"poured-pivot", "poured-dem", "pivots"} == set(found)
    bed = found["poured-dem"].canvas
    assert bed is not None
    assert bed.axes[0].get_ylim() == (0.0, 3.0)
    assert "strip of 3 d seen from above" in found["poured-dem"].caption
