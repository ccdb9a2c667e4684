"""Grains that go on by LIGGGHTS: the drag in the deck, the zero level, and strips without an end."""

import importlib.util
import math
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from orchestrator.bed import deck, poured
from orchestrator.physics import velocity
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import study
from orchestrator.types import FloatArray
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[2]


def _tool() -> dict[str, Any]:
    """The tool, as a module that has its file: the digest of its cases reads it."""
    path = ROOT / "tools" / "going.py"
    spec = importlib.util.spec_from_file_location("tools_going", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return vars(module)


TOOL = _tool()
D, GRAIN, FLUID, NU, GRAVITY = 1e-3, 2650.0, 1000.0, 1e-6, 9.81
"""The grain of the template and its fluid, SI."""
UNIT = math.sqrt(D / (GRAVITY * (1 - FLUID / GRAIN)))


def _run(directory: Path) -> Path:
    subprocess.run(["./Allrun"], cwd=directory, check=True, timeout=HANGS_S)
    return directory


def _drag(relative: FloatArray) -> FloatArray:
    """Drag on a grain over its velocity, N s/m."""
    factor = CLIFT_GAUVIN.factor(np.asarray(relative) * D / NU)
    return np.asarray(3 * np.pi * FLUID * NU * D * factor)


def _fluid(height: FloatArray, ustar: float) -> FloatArray:
    """Velocity of the fluid over the zero level, m/s; the sand grains are those of the template."""
    unit = ustar / NU
    profile = velocity.law_of_the_wall(np.maximum(height, 0) * unit, np.array(D * unit))
    return ustar * profile


def test_a_grain_in_a_flow_moves_as_its_equation_of_motion(tmp_path: Path) -> None:
    """From rest at 20 d it falls through a gust and the mean flow after it, as in the template."""
    case = shutil.copytree(ROOT / "tools" / "going", tmp_path / "case")
    looks = pd.read_csv(_run(case) / "samples.csv", comment="#")
    inertia = np.pi / 6 * D**3 * (GRAIN + FLUID / 2)
    weight = np.pi / 6 * D**3 * (GRAIN - FLUID) * GRAVITY
    spring = 1e4 * weight / D
    step = 0.2 * math.sqrt(inertia / spring)
    gust_end = math.ceil(3 * UNIT / step) * step

    def motion(time: float, state: FloatArray, ustar: float) -> list[float]:
        _, height, along, up = state
        fluid = float(_fluid(np.array(height), ustar))
        drag = float(_drag(np.array(math.hypot(fluid - along, up))))
        return [
            along,
            up,
            drag * (fluid - along) / inertia,
            -(drag * up + weight) / inertia,
        ]

    rules: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-13, "dense_output": True}
    start = [0.0, 0.02, 0.0, 0.0]
    gust = solve_ivp(motion, (0, gust_end), start, args=(0.075,), **rules)
    mean = solve_ivp(
        motion, (gust_end, 14 * UNIT), gust.y[:, -1], args=(0.05,), **rules
    )
    assert gust.sol
    assert mean.sol
    # until it meets the bed
    looks = looks[looks["z"] > D]
    assert len(looks) > 20
    assert set(looks["gust"]) == {0, 1}
    for time, along, height in looks[["time", "vx", "z"]].to_numpy().tolist():
        path = gust.sol if time * UNIT <= gust_end else mean.sol
        exact = path(time * UNIT)
        # the deck takes drag and velocity of the fluid from the step before
        assert along == pytest.approx(exact[2], rel=3e-3)
        assert height == pytest.approx(exact[1], abs=5e-3 * D)
    steps = deck.read_table(case / "going.csv")
    _, gone = ENGINE.read_frames(case / "gone.dump", ("id", "way"))
    way = mean.sol(looks["time"].iloc[-1] * UNIT)[0] - gust.y[0, -1]
    assert steps["went_on"].tolist() == [1]
    assert gone["id"].tolist() == [2]
    assert gone["way"].iloc[0] > way > TOOL["DISTANCE"] * D


def test_at_the_zero_level_the_drags_add_up_to_the_stress(tmp_path: Path) -> None:
    case = shutil.copytree(ROOT / "tools" / "going", tmp_path / "case")
    side, spacing, ustar = 6, 2, 0.02
    floor = np.indices((side, side)).reshape(2, -1).T + 0.5
    upper = spacing * np.indices((side // spacing,) * 2).reshape(2, -1).T + 1.0
    # each lies in the pocket of four
    places = np.vstack(
        [
            np.column_stack([floor, np.zeros(len(floor))]),
            np.column_stack([upper, np.full(len(upper), math.sqrt(0.5))]),
        ]
    )
    kind = np.where(np.arange(len(places)) < len(floor), 1, 2)
    bounds = np.array([[0, 0, -2.0], [side, side, 10.0]]) * D
    every = np.arange(len(places))
    sizes = np.full(len(places), D)
    ENGINE.write_grains(case, places * D, kind, sizes, GRAIN, bounds, every)
    parameters = case / "parameters.liggghts"
    text = parameters.read_text().replace("balance equal 0", "balance equal 1")
    parameters.write_text(text.replace("longest equal 10.0", "longest equal 1.0"))
    (case / "load_steps.txt").write_text(f"{ustar}\n")
    row = deck.read_table(_run(case) / "going.csv").iloc[0]
    height = math.sqrt(0.5) * D
    for level, peak in ((row["level"], 1.0), (row["gust_level"], 1.5)):
        fluid = _fluid(np.array(height - level), peak * ustar)
        drags = len(upper) * _drag(fluid) * fluid
        stress = FLUID * (peak * ustar) ** 2 * (side * D) ** 2
        assert drags == pytest.approx(stress, rel=1e-3)


def test_the_ends_of_a_strip_are_made_one(tmp_path: Path) -> None:
    """Of two grains that overlap across the ends one is left out; a touch is none."""
    rows = pd.DataFrame(
        [
            (0.2, 1.0, 0.0, 1.0, 0),
            # across the end it overlaps the first by 0.3
            (7.5, 1.0, 0.0, 1.0, 0),
            (7.2, 3.0, 0.0, 1.0, 0),
            (0.2, 3.0, 0.0, 1.0, 0),
            # overlapping neighbours elsewhere are left to their springs
            (4.0, 3.0, 0.0, 1.0, 0),
            (4.9, 3.0, 0.0, 1.0, 0),
            (4.0, 1.0, -0.7, 1.0, 0),
            (4.0, 1.0, -4.0, 1.0, 0),
            (-0.1, 2.0, 0.0, 1.0, 0),
            (3.5, 2.0, -1.5, 1.0, 1),
        ],
        columns=["x_over_d", "y_over_d", "z_over_d", "size", "fixed"],
    )
    rows.to_csv(tmp_path / poured.BED, index=False)
    packed = TOOL["joined"](tmp_path, 8.0, 0.5, 2, 4.0)
    kept = np.column_stack([packed.centres[:, 0], packed.across]).tolist()
    # neither the grain before the strip nor the one that lies too deep is part of it
    assert [0.2, 1.0] not in kept or [7.5, 1.0] not in kept
    assert len(kept) == 7
    assert packed.mobile.tolist() == [True] * 6 + [False]
    assert packed.count == 6


STRIP = """
title = "A strip"
fluid = { density = 1000.0, viscosity = 1e-6 }
[grain]
diameter = 1e-3
density = 2650.0
sizes = { sigma_g = 1.1 }
[bed]
kind = "pile"
shape = "flat"
length = 0.006
width = 4.0
packing = "poured"
poured_depth = 3.0
roughness = "d/30"
[flow]
gusts = { intensity = 0.4, events = 100, duration = 10 }
[threshold]
fractions = [0.05]
[method]
kind = "dem"
flow = { model = "flat" }
[method.grains]
stiffness = 1e3
mobile_layers = 2
load_increment = 0.05
final_fraction = 0.05
"""


@pytest.mark.long
def test_grains_of_a_strip_go_on_near_the_closed_form(tmp_path: Path) -> None:
    (scene,) = study.parse(STRIP, name="strip", where="strip").scenes
    steps = TOOL["run"](TOOL["GoingCase"](scene), tmp_path)
    assert steps["went_on"].iloc[0] == 0
    goes = steps[steps["went_on"] >= 0.05 * steps["exposed"]]
    # between half and four times the closed form
    assert 0.5 < goes["shields"].iloc[0] / goes["closed_form"].iloc[0] < 4.0
    assert (steps["went_on"] <= steps["moved"]).all()
