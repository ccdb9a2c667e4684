"""Strips whose grains DEM follows: drag and zero level of the deck, dropped grains, thresholds of a study."""

import json
import math
import re
import runpy
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from orchestrator.bed import deck, poured
from orchestrator.errors import InputError, SolverError
from orchestrator.fidelity import spread
from orchestrator.grains import followed
from orchestrator.grains.followed import FollowedCase
from orchestrator.grains.pile import Pile
from orchestrator.physics import velocity
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.runs import engine
from orchestrator.runs.case import templates
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import study
from orchestrator.study.closed_form import single_grain
from orchestrator.study.criterion import sustaining
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray
from tests.waiting import HANGS_S

TEMPLATE = templates() / "liggghts/followed"
TOOL = Path(__file__).parents[2] / "tools" / "followed.py"


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
    case = shutil.copytree(TEMPLATE, tmp_path / "case")
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
    steps = deck.read_table(case / "steps.csv")
    _, gone = ENGINE.read_frames(case / "sustained.dump", ("id", "way"))
    way = mean.sol(looks["time"].iloc[-1] * UNIT)[0] - gust.y[0, -1]
    assert steps["sustained"].tolist() == [1]
    assert gone["id"].tolist() == [2]
    assert gone["way"].iloc[0] > way > followed.DISTANCE * D


def test_at_the_zero_level_the_drags_add_up_to_the_stress(tmp_path: Path) -> None:
    case = shutil.copytree(TEMPLATE, tmp_path / "case")
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
    kind = np.where(np.arange(len(places)) < len(floor), 1, 3)
    bounds = np.array([[0, 0, -2.0], [side, side, 10.0]]) * D
    every = np.arange(len(places))
    sizes = np.full(len(places), D)
    ENGINE.write_grains(case, places * D, kind, sizes, GRAIN, bounds, every)
    parameters = case / "parameters.liggghts"
    text = parameters.read_text().replace("balance equal 0", "balance equal 1")
    parameters.write_text(text.replace("longest equal 10.0", "longest equal 1.0"))
    (case / "load_steps.txt").write_text(f"{ustar}\n")
    row = deck.read_table(_run(case) / "steps.csv").iloc[0]
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
    packed = poured.joined(tmp_path, 8.0, 0.5, 2, 4.0)
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
criterion = "sustained"
fractions = [0.05, 0.3]
[method]
kind = "dem"
flow = { model = "flat" }
[method.grains]
stiffness = 1e3
mobile_layers = 2
load_increment = 0.1
final_fraction = 0.3
"""


def _scene(**changes: Any) -> Scene:
    (scene,) = study.parse(STRIP, name="strip", where="strip").scenes
    return study.changed(scene, changes)


def test_each_load_step_drops_grains_that_are_at_rest(tmp_path: Path) -> None:
    """Two fall in two load steps, each from its own place; only the counted one counts."""
    case = shutil.copytree(TEMPLATE, tmp_path / "case")
    grains = (case / "grains.data").read_text().replace("2 atoms", "4 atoms")
    for number in (3, 4):
        grains += f"{number} 4 0.001 2650 0.01 0.00{number} 0.03\n"
    (case / "grains.data").write_text(grains)
    heights = [0.008, 0.010, 0.016, 0.018]
    for axis, values in (
        ("x", [0.01] * 4),
        ("y", [0.001, 0.004] * 2),
        ("z", heights),
    ):
        ENGINE.write_numbers(case / f"dropped.{axis}.txt", np.array(values))
    ENGINE.write_numbers(case / "load_steps.txt", np.array([0.05, 0.06]))
    parameters = (case / "parameters.liggghts").read_text()
    short = {"look": 0.05, "gust_time": 0.2, "longest": 0.2}
    for name, value in {"dropped": 2, "first_dropped": 3, **short}.items():
        now = re.search(rf"variable +{name} equal \S+", parameters)
        assert now
        parameters = parameters.replace(now[0], f"variable {name} equal {value}")
    (case / "parameters.liggghts").write_text(parameters)
    looks = pd.read_csv(_run(case) / "samples.csv", comment="#")
    first, second = (part.iloc[0] for _, part in looks.groupby("load_step"))
    # a free fall of a twentieth of the unit of time is less than a hundredth of d
    assert first["z"] == pytest.approx(np.mean([0.02, *heights[:2]]), abs=2e-5)
    # the counted grain goes on from where it was
    counted = 3 * second["z"] - sum(heights[2:])
    assert 0.02 - 3e-4 < counted < 0.02
    # they start at rest, while it keeps what the first load step gave it
    before = looks[looks["load_step"] == 1]["vx"].iloc[-1]
    assert second["vx"] < 0.8 * before
    assert deck.read_table(case / "steps.csv")["sustained"].max() <= 1


def test_a_study_asks_for_grains_that_are_followed_by_its_criterion() -> None:
    scene = _scene()
    assert scene.is_followed
    # no choice was changed on such a strip: the spread is not that of piles
    assert math.isnan(spread.spread(scene, 0.3).low)
    other = _scene(**{"threshold.criterion": "entrained"})
    assert not other.is_followed
    assert spread.spread(other, 0.3).low > 0
    assert not _scene(**{"method.kind": "pivot"}).is_followed
    assert not _scene(**{"bed.width": 0.0}).is_followed
    assert not _scene(**{"flow.gusts": None}).is_followed
    (case,) = Pile(scene).method.cases
    assert isinstance(case, FollowedCase)
    # the law of the forces, the fractions and the flow model are no part of the run
    alike = _scene(**{"forces.law": "profile", "threshold.fractions": [0.1, 0.3]})
    assert FollowedCase(alike).name == case.name
    assert FollowedCase(_scene(**{"bed.dropped_grains": 3})).name != case.name
    shorter = {"intensity": 0.4, "events": 100, "duration": 9}
    assert FollowedCase(_scene(**{"flow.gusts": shorter})).name != case.name
    with pytest.raises(InputError, match="exposure"):
        _scene(**{"forces.exposure": "protrusion"})
    with pytest.raises(InputError, match="dropped_grains"):
        study.parse(
            STRIP.replace('criterion = "sustained"', "").replace(
                "width = 4.0", "width = 4.0\ndropped_grains = 2"
            ),
            name="strip",
            where="strip",
        )


def _with_deck(case: FollowedCase, folder: Path) -> tuple[Path, FloatArray]:
    """The directory of a case on level grains, and these."""
    bed = folder / case.needs[0].name
    bed.mkdir()
    flat = np.indices((6, 4)).reshape(2, -1).T + 0.5
    rows = np.column_stack([flat, np.zeros(24), np.ones(24), np.zeros(24)])
    heads = "x_over_d,y_over_d,z_over_d,size,fixed"
    np.savetxt(bed / poured.BED, rows, delimiter=",", header=heads, comments="")
    directory = shutil.copytree(TEMPLATE, folder / "case")
    case.write(directory, folder)
    return directory, rows


def test_the_deck_has_the_numbers_of_its_scene(tmp_path: Path) -> None:
    scene = _scene(**{"bed.roughness": 5e-5, "grain.friction_angle_deg": 31.0})
    case = FollowedCase(scene)
    directory, _ = _with_deck(case, tmp_path)
    text = (directory / "parameters.liggghts").read_text()
    found = {
        name: float(value)
        for name, value in re.findall(r"(?m)^variable +(\w+) +equal (\S+)", text)
    }
    expected = {
        "diameter": 1e-3,
        "grain_density": 2650.0,
        "fluid_density": 1000.0,
        # kinematic
        "viscosity": 1e-6,
        # Nikuradse's sand is thirty times the roughness length
        "sand_grain": 30 * 5e-5,
        "added_mass": 0.5,
        "acceleration": 9.81,
        "friction": math.tan(math.radians(31.0)),
        # of the friction velocity, whose square is the stress
        "gust": peak_over_mean(0.4, 100) ** 0.5,
        "gust_time": 10.0,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-6)
    (alone,) = sustaining(scene, 0.0, 1.0).tolist()
    shields = case.flows**2 / (9.81 * 1.65 * 1e-3)
    assert shields[0] == pytest.approx(0.3 * alone, rel=1e-6)
    assert shields[-2] < 4 * alone <= shields[-1] * (1 + 1e-6)


def test_the_deck_has_the_dropped_grains_over_the_bed(tmp_path: Path) -> None:
    scene = _scene(**{"bed.dropped_grains": 3})
    case = FollowedCase(scene)
    directory, rows = _with_deck(case, tmp_path)
    lines = (directory / "grains.data").read_text().split("Atoms\n\n")[1].split("\n")
    table = np.array([line.split() for line in lines if line], float)
    is_dropped = table[:, 1] == deck.PUSHED
    assert is_dropped.sum() == 3
    assert table[is_dropped, 0].tolist() == [25, 26, 27]
    z = np.loadtxt(directory / "dropped.z.txt")
    assert len(z) == 3 * len(case.flows)
    assert z == pytest.approx((rows[:, 2].max() + followed.DROP) * D)
    x = np.loadtxt(directory / "dropped.x.txt")
    assert (x >= 0).all()
    assert (x < 6 * D).all()
    # each load step has other places
    assert len(np.unique(x)) == len(x)
    assert (
        "variable        first_dropped equal 25 "
        in (directory / "parameters.liggghts").read_text()
    )


def test_a_grain_counts_from_the_first_load_step_that_keeps_it_moving(
    tmp_path: Path,
) -> None:
    head = "load_step,flow,level,gust_level,moved,sustained,ke,time\n"
    lines = [f"{n},{flow},0,0,1,1,0,9\n" for n, flow in ((1, 0.1), (2, 0.2), (3, 0.3))]
    (tmp_path / "steps.csv").write_text(head + "".join(lines))
    frame = (
        "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS pp pp ff\n"
        "0 1\n0 1\n0 1\nITEM: ATOMS id c_way[1] \n{}"
    )
    frames = [(10, 0, ""), (20, 2, "2 0.1\n4 0.2\n"), (30, 1, "4 0.3\n")]
    (tmp_path / "sustained.dump").write_text(
        "".join(frame.format(*each) for each in frames)
    )
    kind = np.array([deck.FIXED, deck.COUNTED, deck.COUNTED, deck.COUNTED])
    grains = deck.GrainTable(
        np.zeros((4, 3)), kind, np.ones((4, 2)), np.ones(4), D, GRAIN, 4.0
    )
    motion = followed.read_kept(tmp_path, grains)
    assert motion.load_step.tolist() == [2, 0, 2]
    assert motion.flow[1:].tolist() == [0.1, 0.2, 0.3]
    assert motion.fraction.tolist() == [0, 0, 2 / 3, 2 / 3]
    (tmp_path / "sustained.dump").write_text(frame.format(*frames[0]))
    with pytest.raises(SolverError, match="3 load steps and 1 frames"):
        followed.read_kept(tmp_path, grains)


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the cases of a strip on which two grains are dropped."""
    directory = tmp_path_factory.mktemp("strip")
    for case in Pile(_scene(**{"bed.dropped_grains": 2}), directory).runs:
        engine.execute(case, directory, HANGS_S)
    return directory


@pytest.mark.long
def test_motion_on_a_strip_is_sustained_near_the_closed_form(strip: Path) -> None:
    scene = _scene(**{"bed.dropped_grains": 2})
    pile = Pile(scene, strip)
    first, last = pile.thresholds(strip, (0.05, 0.3))
    alone = float(sustaining(scene, 0.0, 1.0)[0])
    unit = float(single_grain(scene).unit_ustar)
    # within the load steps, and a factor of four of one grain in closed form
    assert 0.4 < (first.ustar0 / unit) ** 2 / alone < 4.0
    assert first.ustar0 <= last.ustar0
    assert pile.sustained_decides(strip).all()
    steps = deck.read_table(strip / pile.case.name / "steps.csv")
    assert (steps["sustained"] <= steps["moved"]).all()


@pytest.mark.long
def test_a_strip_of_another_version_counts_where_its_inputs_are_the_same(
    strip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "strip.toml"
    file.write_text(
        STRIP.replace("width = 4.0", "width = 4.0\ndropped_grains = 2")
        + "[[group]]\nname = 'water'\n",
        encoding="utf-8",
    )
    rows = runpy.run_path(str(TOOL))["rows"]
    monkeypatch.setitem(rows.__globals__, "STUDY", file)
    cases = shutil.copytree(strip, tmp_path / "cases")
    (case,) = cases.glob("followed-*")
    found = [*rows(cases)]
    assert len(found) == len(deck.read_table(case / "steps.csv")) > 0
    assert {row["dropped_grains"] for row in found} == {2}

    state = json.loads((case / "done.json").read_text(encoding="utf-8"))
    state["code_sha256"] = "of another version"
    (case / "done.json").write_text(json.dumps(state), encoding="utf-8")
    assert [*rows(cases)] == found

    about = json.loads((case / "case.json").read_text(encoding="utf-8"))
    about["inputs_sha256"]["load_steps.txt"] = "of another flow"
    (case / "case.json").write_text(json.dumps(about), encoding="utf-8")
    with pytest.warns(UserWarning, match="1 case made by other code"):
        assert [*rows(cases)] == []
