"""The counting rule on known tracks, thresholds of a known motion, whether a bed rests."""

import itertools
import math
import re
import shutil
import subprocess
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.special import bdtr

from orchestrator import pipeline
from orchestrator.bed.deck import NOISE, GrainTable, read_table
from orchestrator.errors import Exploded, Noisy, SolverError
from orchestrator.fidelity.decision import written
from orchestrator.grains import motion, threshold
from orchestrator.grains.forces import forces
from orchestrator.grains.loads import loads_of
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.runs.case import templates
from orchestrator.study import study
from orchestrator.study.study import changed

GONE = np.nan
SLOPE = np.radians(20.0)
STIFFNESS = 1e3
WEIGHT = 2500.0 * np.pi / 6 * 1e-3**3 * 9.806076000000001


@pytest.mark.parametrize(
    ("track", "on_a_pile", "in_a_cell"),
    [
        ((0.0, 0.29, 0.29), (0, 0, 0), (0, 0, 0)),
        ((0.0, 0.3, 0.1), (1, 0, 0), (1, 0, 0)),  # it came back
        ((0.0, 0.4, GONE), (1, 0, 0), (1, 0, 0)),  # it went on its way
        ((0.0, -0.3, -0.1), (0, 1, 0), (0, 1, 0)),  # it lies further down
        ((0.0, -0.3, 0.3), (1, 1, 0), (1, 1, 0)),  # and goes after all
        ((0.0, -0.4, GONE), (1, 1, 1), (0, 1, 0)),  # off a pile lift took it, backwards
        ((0.0, 0.0, GONE), (1, 0, 1), (0, 1, 0)),  # straight up within one sample
        ((GONE, GONE), (1, 0, 1), (0, 1, 0)),  # it did not even stay as the bed settled
    ],
)
def test_what_a_track_counts_as(
    track: tuple[float, ...], on_a_pile: tuple[int, ...], in_a_cell: tuple[int, ...]
) -> None:
    for falls_out, ends in ((False, on_a_pile), (True, in_a_cell)):
        found = motion.count(np.array(track)[:, None], 0.3, falls_out=falls_out)
        states = (found.moved, found.fallen, found.carried)
        assert tuple(int(state[-1, 0]) for state in states) == ends


LIFT_OFF = """
fluid = { density = 1.0, viscosity = 1e-5 }
grain = { diameter = 5e-4, density = 2500.0 }
method.flow.model = "waves"
forces = { law = "low" }
bed = { kind = "pile", height = 0.005, slope_deg = 20.0, roughness = "d/30" }
[threshold]
fractions = [0.1, 0.3]

[method.grains]
stiffness = 1e3
mobile_layers = 1
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.5
"""
"""A pile under Eq. 2 far above its range: lift bears the grains before drag can push them up."""


def test_a_pile_that_lifts_off_has_moved_and_says_so(tmp_path: Path) -> None:
    asked = study.parse(LIFT_OFF, name="lift", where="lift")
    assert not pipeline.run(asked, tmp_path, workers=1).failures
    paths = (
        tmp_path / f"tables/pile_{name}.csv" for name in ("curve", "threshold", "grain")
    )
    curve, thresholds, grains = map(pd.read_csv, paths)
    last = curve.iloc[-1]
    assert last["fallen_upstream"] > 0.3 * last["count"]
    assert last["count"] - last["not_moved"] == last["moved"] >= 0.5 * last["count"]
    assert last["carried_off"] > 0.9 * last["moved"]
    assert (thresholds["share_carried_off"] > 0.9).all()
    assert (grains.loc[grains["carried_off"] == 1, "mode"] == "lifted").all()
    # by geometry lift bears the weight normal to the bed before any grain rolls
    pile, cases = Pile(written(asked.scenes[0])), tmp_path / "cases"
    loads, scene = loads_of(pile, cases), pile.scene
    lifting, ratio = loads.lifting(loads.alone()), loads.ratio[pile.packing.windward]
    assert (np.isinf(lifting) == (ratio == 0)).all()
    lift = forces(scene)[1](lifting[ratio > 0] * ratio[ratio > 0])
    np.testing.assert_allclose(lift, scene.weight * np.cos(SLOPE), rtol=2e-8)
    assert np.isinf(loads.lifting(0.99 * lifting)).all()
    for method in ("pivot", "peeling"):
        cheap = Pile(changed(scene, {"method.kind": method})).thresholds(
            cases, (0.1, 0.3)
        )
        for at, dem in zip(cheap, pile.thresholds(cases, (0.1, 0.3)), strict=True):
            assert at.carried_off > 0.9
            assert 0.95 * dem.tau_low < at.tau < 1.05 * dem.tau_high


@pytest.fixture(scope="module")
def grains() -> GrainTable:
    """The grains of the template's own pile."""
    lines = (templates() / "liggghts" / "bed" / "grains.data").read_text().splitlines()
    rows = np.array([line.split() for line in lines[lines.index("Atoms") + 2 :]], float)
    return GrainTable(
        position=rows[:, 4:],
        kind=rows[:, 1].astype(np.int64),
        along=np.tile([np.cos(SLOPE), np.sin(SLOPE)], (len(rows), 1)),
        sizes=np.ones(len(rows)),
        diameter=1e-3,
        density=2500.0,
    )


def copied(folder: Path, **numbers: float) -> Path:
    """The template's pile with other values of some parameters."""
    shutil.copytree(templates() / "liggghts" / "bed", folder)
    text = (folder / "parameters.liggghts").read_text()
    for name, value in numbers.items():
        text = re.sub(rf"( {name} equal) \S+", rf"\1 {value}", text)
    (folder / "parameters.liggghts").write_text(text)
    return folder


def test_rest_and_lines_left_out_change_no_grain(
    tmp_path: Path, grains: GrainTable
) -> None:
    changes = {
        "rest": {},
        "waiting": {"rest_energy": 0.0},
        "long": {"waiting_time": 40.0},
    }
    runs = {
        name: copied(tmp_path / name, **numbers) for name, numbers in changes.items()
    }
    runs["whole"] = copied(tmp_path / "whole", stir=0.0)
    for folder in runs.values():
        subprocess.run(["./Allrun"], cwd=folder, check=True)
    rest, *others = (
        motion.read_motion(run, grains, 0.3, falls_out=False) for run in runs.values()
    )
    assert rest.moved[-1] > 0
    for other in others:
        np.testing.assert_array_equal(rest.load_step, other.load_step)
    # the waiting time is only the bound for what never rests
    samples = {
        name: read_table(folder / motion.SAMPLES) for name, folder in runs.items()
    }
    assert len(samples["rest"]) == len(samples["long"]) < 0.6 * len(samples["waiting"])
    # grains at their places need no line in the dump
    pd.testing.assert_frame_equal(samples["rest"], samples["whole"])
    short, whole = (runs[name] for name in ("rest", "whole"))
    sizes = [(folder / motion.PASSAGE).stat().st_size for folder in (short, whole)]
    assert sizes[0] < sizes[1]
    few, every = (
        motion.read_track(run, grains, samples["rest"]).travel for run in (short, whole)
    )
    np.testing.assert_allclose(few, every, rtol=0, atol=0.02)
    frames = (short / motion.BED).read_text().split("ITEM: TIMESTEP")
    (short / motion.BED).write_text("ITEM: TIMESTEP".join(frames[:-1]))
    with pytest.raises(SolverError, match=r"bed.dump: its frames are not the ends"):
        motion.read_track(short, grains, samples["rest"])


@pytest.mark.parametrize(
    ("time_step", "damping", "error", "what"),
    [
        (0.3, 0.1, None, ""),
        (1.2, 0.1, Exploded, r"settling.csv: the bed burst .* method.grains.time_step"),
        (0.6, 0.1, Noisy, "the bed does not come to rest"),
        (0.4, 0.3, Noisy, "the bed does not come to rest"),
    ],
)
def test_a_bed_comes_to_rest_unless_its_step_is_too_large(
    tmp_path: Path,
    grains: GrainTable,
    time_step: float,
    damping: float,
    error: type[SolverError] | None,
    what: str,
) -> None:
    settled = copied(
        tmp_path / "a", time_step=time_step, damping=damping, stiffness=STIFFNESS
    )
    subprocess.run(["./Allrun"], cwd=settled, capture_output=True)
    check = partial(
        motion.check_rest, settled, weight=WEIGHT, stiffness=STIFFNESS, all_rest=True
    )
    table = read_table(settled / motion.SETTLING)
    if error is None:
        check(grains)
        energy = table["ke"] / grains.mobile_count / (WEIGHT * 1e-3) * STIFFNESS
        assert energy.iloc[-5:].mean() < 0.01 * NOISE
        assert energy.iloc[0] > NOISE  # it did fall into place
        one_more = replace(grains, kind=np.append(grains.kind, grains.kind.max()))
        with pytest.raises(
            Exploded, match="1 of 47 grains were lost before the flow rose"
        ):
            check(one_more)
        return
    with pytest.raises(error, match=what):
        check(grains)
    if error is Noisy:
        # a noisy run goes up and down by chance; made to grow, it is another kind of failure
        growing = table["ke"].sort_values().to_numpy() * np.linspace(1, 4, len(table))
        table.assign(ke=growing).to_csv(settled / motion.SETTLING, index=False)
        with pytest.raises(Exploded, match="the energy of the bed at rest grows"):
            check(grains)


def _settled(copy: Path, code: int = 0, **parameters: float) -> int:
    """Samples of the settling of the template, with other parameters."""
    folder = copied(copy, **parameters)
    ended = subprocess.run(["./Allrun"], cwd=folder, capture_output=True, text=True)
    assert ended.returncode == code, ended.stderr
    return len((folder / motion.SETTLING).read_text().splitlines()) - 1


def test_a_bed_lies_for_as_long_as_it_takes_to_come_to_rest(tmp_path: Path) -> None:
    assert _settled(tmp_path / "enough", settle=10.0) == 20
    # the less energy it may have, the longer it lies
    assert _settled(tmp_path / "short", settle=0.5) == motion.LAST
    longer = _settled(tmp_path / "longer", settle=0.5, noise=1e-6)
    assert motion.LAST < longer < 400
    assert (tmp_path / "longer" / motion.SAMPLES).is_file()
    # single grains may fall, and get the time that they are given
    assert _settled(tmp_path / "cells", settle=0.5, noise=0.0) == 1
    # a bed that never rests gets no load step, and is a failure
    never = {"settle": 0.5, "time_step": 0.6, "most_settle": 20.0}
    assert _settled(tmp_path / "never", 1, **never) == 40
    assert not (tmp_path / "never" / motion.SAMPLES).is_file()
    assert "does not come to rest" in (tmp_path / "never" / "log.liggghts").read_text()


# ten grains, four holds: two move in the 1st, three in the 2nd, none in the 3rd, four in the 4th
FLOW = np.array([0.9, 1.0, 1.1, 1.2, 1.3])
LEVEL = np.array([1, 1, 2, 2, 2, 4, 4, 4, 4, 0])
SPEED = np.array([2.0, 2.0, 1.5, 1.5, 1.5, 1.0, 1.0, 1.0, 1.0, -0.5])
NONE = np.zeros(10, int)
NOBODY = np.zeros(10, bool)
MOTION = Motion(FLOW, LEVEL, NONE, NOBODY, NONE)
DENSITY = 1.2


def test_curve_holds_the_mean_stress_of_what_has_moved() -> None:
    np.testing.assert_allclose(MOTION.fraction, [0, 0.2, 0.5, 0.5, 0.9])
    found = threshold.mean_tau(MOTION, SPEED, DENSITY)
    mean = [
        math.nan,
        4.0,
        (2 * 4 + 3 * 2.25) / 5,
        (2 * 4 + 3 * 2.25) / 5,
        (8 + 6.75 + 4) / 9,
    ]
    np.testing.assert_allclose(found, DENSITY * FLOW**2 * mean)


def test_threshold_of_a_pile_at_a_fraction() -> None:
    # all of the first load step were carried off, and two of the three of the second
    carried = Motion(FLOW, LEVEL, NONE, np.arange(10) < 4, NONE)
    shares = [
        threshold.of_pile(carried, SPEED, n, DENSITY).carried_off
        for n in (0.1, 0.4, 0.95)
    ]
    np.testing.assert_allclose(shares, [1.0, 0.8, np.nan])
    # 40 % is first reached in the second hold, by five of ten; the interval holds the counts'
    # resolution: half a grain more than 50 % asks for the fourth hold
    for fraction, high in ((0.4, 1.21 * 2.95), (0.5, 1.69 * 18.75 / 9)):
        at = threshold.of_pile(MOTION, SPEED, fraction, DENSITY)
        assert at.ustar0 == pytest.approx(math.sqrt(1.1))
        taus = np.array([at.tau, at.tau_low, at.tau_high]) / DENSITY
        np.testing.assert_allclose(taus, [1.1 * 2.95, 2.95, high])


def test_an_interval_is_open_where_half_a_grain_more_or_less_was_not_reached() -> None:
    def interval(
        fraction: float, ends: tuple[float, float] | None = None
    ) -> list[float]:
        at = threshold.of_pile(MOTION, SPEED, fraction, DENSITY, ends)
        return [at.tau / DENSITY, at.tau_low / DENSITY, at.tau_high / DENSITY]

    nan = math.nan
    last = 18.75 / 9
    # nine of ten have moved by the last flow, 1.3: what half a grain more needs is not known
    np.testing.assert_allclose(interval(0.9), [1.2 * 1.3 * last, 1.44 * last, nan])
    # a fraction that was not reached takes more than the last flow
    np.testing.assert_allclose(interval(1.0), [nan, 1.69 * last, nan])
    # a sample of which none need have moved has no lower end
    np.testing.assert_allclose(
        interval(0.4, (0.0, 0.5)), [1.1 * 2.95, nan, 1.21 * 2.95]
    )
    # of grains that never move only the highest flow is known, at the mean stress on all of them
    still = MOTION.of(LEVEL == 0)
    at = threshold.of_pile(
        still, SPEED[LEVEL == 0], 0.3, DENSITY, threshold.sampled(0.3, 1)
    )
    assert math.isnan(at.tau)
    assert math.isnan(at.tau_high)
    at = threshold.of_pile(still, SPEED[LEVEL == 0], 0.9, DENSITY, (0.9, 1.0))
    assert at.tau_low == pytest.approx(DENSITY * 1.69 * 0.25)


def test_a_reference_is_within_a_relative_error_of_itself() -> None:
    for reference, error in itertools.product(
        (0.01, 3.0), (0.0, 0.05, 0.35, 0.67, 0.99)
    ):
        for value in (reference * (1 - error), reference, reference * (1 + error)):
            low, high = threshold.within(value, error)
            assert low * (1 - 1e-12) <= reference <= high * (1 + 1e-12)
    # a value that is a third too low is two thirds of the reference
    assert threshold.within(2.0, 1 / 3) == pytest.approx((1.5, 3.0))
    for error in (1.0, 3.75):
        low, high = threshold.within(2.0, error)
        assert low == pytest.approx(2.0 / (1 + error))
        assert math.isnan(high)
    assert np.isnan(threshold.within(2.0, math.nan)).all()


def test_the_stress_at_the_median_size_lies_between_those_of_the_classes_beside_it() -> (
    None
):
    sizes = np.array([0.4, 0.8, 1.15, 2.3])
    for power in (-0.5, 0.0, 0.7):
        assert threshold.at_size(1.0, sizes, 3.0 * sizes**power) == pytest.approx(3.0)
    # a class as large as the median is its own; the other sizes have no say
    nan = math.nan
    exact = threshold.at_size(0.8, sizes, np.array([nan, 5.0, nan, nan]))
    assert exact == pytest.approx(5.0)
    assert threshold.at_size(
        1.0, sizes, np.array([nan, 2.0, 2.0, nan])
    ) == pytest.approx(2.0)
    # no class beside it, one that has not moved, or one that lies loose
    assert math.isnan(threshold.at_size(0.3, sizes, sizes))
    assert math.isnan(threshold.at_size(3.0, sizes, sizes))
    for unknown in (nan, 0.0):
        assert math.isnan(
            threshold.at_size(1.0, sizes, np.array([1.0, unknown, 2.0, 3.0]))
        )


def test_a_sample_bounds_the_fraction_that_has_moved() -> None:
    """The ends of the binomial interval are those at which as much is as unlikely as 10 %."""
    assert threshold.of_all(0, 2) == pytest.approx((0.0, 1 - math.sqrt(0.1)))
    assert threshold.of_all(2, 2) == pytest.approx((math.sqrt(0.1), 1.0))
    for moved, count in ((1, 5), (3, 7), (40, 100)):
        low, high = threshold.of_all(moved, count)
        assert 1 - bdtr(moved - 1, count, low) == pytest.approx(0.1)
        assert bdtr(moved, count, high) == pytest.approx(0.1)


def test_grains_that_a_reversed_flow_drives_upstream_count_with_the_size_of_their_stress() -> (
    None
):
    ways = SPEED, -SPEED, np.where(LEVEL == 1, -SPEED, SPEED)
    forward, back, both = (
        threshold.of_pile(MOTION, speed, 0.5, DENSITY) for speed in ways
    )
    assert both.tau == back.tau == forward.tau > 0
    assert [at.against_the_flow for at in (forward, back, both)] == [0, 1, 0.4]


def test_a_class_is_at_its_threshold_when_its_own_grains_have_moved() -> None:
    sizes = np.array([0.7, 0.7, 1.0, 1.0])
    motion = Motion.of_flows(np.array([1.0, 3.0, 2.0, np.inf]))
    small, middle = (motion.of(one.chosen) for one in threshold.classes(sizes))
    asked = ((small, 1.0), (middle, 0.5), (middle, 1.0))
    found = [threshold.of_pile(one, np.ones(2), n, 1.0).ustar0 for one, n in asked]
    np.testing.assert_array_equal(found, [3.0, 2.0, np.nan])
