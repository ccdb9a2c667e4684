"""Motion of the counted grains of a deck: which moved, at which flow, and how.

The counting rule is described in docs/benchmark.md, "The counting rule". The deck in.bed has the
same criterion to know when a load step may end, and its counts are compared with those here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.bed.deck import (
    NOISE,
    SETTLE_FLOW,
    GrainTable,
    read_dump,
    read_table,
    read_texts,
)
from orchestrator.bed.packing import across
from orchestrator.digits import FORMAT
from orchestrator.errors import Exploded, Noisy, SolverError
from orchestrator.types import BoolArray, FloatArray, IntArray

SETTLING, SAMPLES = "settling.csv", "samples.csv"
LOAD_STEPS, MOTION = "load_steps.csv", "motion.csv"
PASSAGE, BED = "passage.dump", "bed.dump"
PASSAGE_COLUMNS = ("id", "x", "z", "vx", "vz", "omegay", "y")
BED_COLUMNS = ("id", "type", "x", "z", "vx", "vz", "omegay")
MODES = ("none", "rolled", "slid", "lifted")  # how a grain moved
LIFTED = 0.3
"""A grain has lifted when it rises by this over its bed, d: to roll over a neighbour takes 0.13 at
an entrainment angle of 60 degrees."""
ROLLED = 0.5  # a grain rolls when its spin makes at least this part of its speed, else it slides
WINDOW = 5  # samples from the passage of the criterion on in which a grain may lift: 2 sqrt(d/g')
LAST = 5  # samples in a row in which a bed at rest has less energy than `NOISE`
GROWS = 2.0
"""The energy of a bed that does not come to rest grows when the last quarter of the settling has
more than this times that of the second."""
BURST = 10.0  # kinetic energy per grain, over W d, that no fall of a grain can give it
REMEDY = (
    "a smaller protocol.time_step or grain.damping, or look for grains that overlap"
)
POURED_REMEDY = (
    "another bed.seed, a gentler slope, or a larger grain.friction_angle_deg; the springs "
    "of a poured bed are at most of grain.stiffness = 1e5"
)
"""Of poured beds. Grains that have come to rest on a slope roll off it when the springs
or the fixed grains under them are others; a smaller time step changes nothing."""


@dataclass(frozen=True)
class Motion:
    """The motion of the N counted grains of a deck.

    `flow`, never falling, has the shape (levels + 1,), all others have the shape (N,).
    """

    flow: FloatArray
    """The flow of each load step, in the deck's unit; first that of the settling."""
    level: IntArray
    """Load step (index into `flow`) in which a grain moved by the counting rule; 0 for never."""
    fallen: IntArray
    """Load step in which a grain was first the criterion upstream of its place; 0 for never."""
    carried: BoolArray
    """Whether it was gone before it was seen beyond the displacement criterion: carried off."""
    mode: IntArray
    """How it moved: index into `MODES`."""
    exact: bool = False
    """Whether a grain moves at its level's very flow, as by a formula; else between the load step
    before and that one."""

    @classmethod
    def of_flows(
        cls, rolling: FloatArray, lifting: FloatArray | float = np.inf
    ) -> "Motion":
        """The motion of grains that roll or are lifted at given flows, (N,); infinite for never."""
        flows = np.minimum(rolling, lifting)
        # to be lifted straight over a neighbour is to be lifted
        moves, carried = np.isfinite(flows), np.isfinite(lifting) & (lifting <= rolling)
        levels = np.unique(flows[moves])
        # before the first level nothing moves
        flow = (
            np.concatenate([levels[:1] * SETTLE_FLOW, levels])
            if len(levels)
            else np.zeros(1)
        )
        level = np.where(moves, np.searchsorted(levels, flows) + 1, 0)
        mode = np.select(
            [carried, moves], [MODES.index("lifted"), MODES.index("rolled")], 0
        )
        return cls(flow, level, np.zeros_like(level), carried, mode, exact=True)

    @classmethod
    def chained(cls, runs: "Sequence[tuple[BoolArray, Motion]]") -> "Motion":
        """The motion in runs that go on from one another: of each which of the N it counts."""
        whole = cls.of_flows(np.full(len(runs[0][0]), np.inf))
        level, fallen, carried, mode = (
            whole.level,
            whole.fallen,
            whole.carried,
            whole.mode,
        )
        flow, before = [runs[0][1].flow[:1]], 0
        for counted, run in runs:
            level[counted] = np.where(run.level > 0, run.level + before, 0)
            first = (fallen[counted] == 0) & (run.fallen > 0)
            fallen[counted] = np.where(first, run.fallen + before, fallen[counted])
            carried[counted], mode[counted] = run.carried, run.mode
            flow.append(run.flow[1:])
            before += len(run.flow) - 1
        return cls(np.concatenate(flow), level, fallen, carried, mode)

    def of(self, chosen: BoolArray) -> "Motion":
        """The motion of some of the counted grains under the same flows."""
        parts = ("level", "fallen", "carried", "mode")
        return replace(self, **{name: getattr(self, name)[chosen] for name in parts})

    @cached_property
    def low(self) -> FloatArray:
        """For each level the highest flow that is known to be below it, shape (levels + 1,)."""
        # two load steps of one flow are before and after the bed has changed
        lower = np.searchsorted(self.flow, self.flow) - 1
        return self.flow if self.exact else self.flow[np.maximum(lower, 0)]

    def moved_by(self, level: int) -> BoolArray:
        """Which grains have moved by the end of a load step."""
        return (self.level > 0) & (self.level <= level)

    @property
    def count(self) -> int:
        """N, how many grains are counted."""
        return len(self.level)

    @cached_property
    def fraction(self) -> FloatArray:
        """n/N at the end of each load step, shape (levels + 1,)."""
        return np.asarray(self.moved / self.count)

    @cached_property
    def moved(self) -> IntArray:
        """How many grains had moved by the end of each load step, shape (levels + 1,)."""
        return self._by_load_step(self.level)

    @property
    def fallen_upstream(self) -> IntArray:
        """How many had been the displacement criterion upstream by then, shape (levels + 1,)."""
        return self._by_load_step(self.fallen)

    @cached_property
    def carried_off(self) -> IntArray:
        """How many of those that had moved by then were carried off, shape (levels + 1,)."""
        return self._by_load_step(np.where(self.carried, self.level, 0))

    def _by_load_step(self, level: IntArray) -> IntArray:
        """How many grains had reached their level by the end of each load step."""
        counts = np.bincount(level, minlength=len(self.flow))
        counts[0] = 0
        return np.cumsum(counts)

    def to_csv(self, directory: Path, grains: GrainTable) -> None:
        """Write ``load_steps.csv`` and ``motion.csv``, which `from_csv` reads."""
        load_steps = {
            "load_step": np.arange(len(self.flow)),
            "flow": self.flow,
            "moved": self.moved,
            "not_moved": self.count - self.moved,
            "carried_off": self.carried_off,
            "fallen_upstream": self.fallen_upstream,
        }
        table = pd.DataFrame(load_steps)
        table.to_csv(directory / LOAD_STEPS, index=False, float_format=FORMAT)
        moved = {
            "id": grains.counted_ids,
            "moved_in": self.level,
            "fallen_in": self.fallen,
            "carried_off": self.carried.astype(int),
            "mode": [MODES[mode] for mode in self.mode],
        }
        pd.DataFrame(moved).to_csv(directory / MOTION, index=False)

    @classmethod
    def from_csv(cls, directory: Path) -> "Motion":
        """Read what `to_csv` wrote."""
        grains = read_texts(directory / MOTION)
        return cls(
            flow=read_texts(directory / LOAD_STEPS)["flow"].astype(float),
            level=grains["moved_in"].astype(np.int64),
            fallen=grains["fallen_in"].astype(np.int64),
            carried=grains["carried_off"] == "1",
            mode=np.array([MODES.index(mode) for mode in grains["mode"]], np.int64),
        )


class Track(NamedTuple):
    """The counted grains at each sample; arrays of shape (T, N), NaN for a grain that is gone.

    `travel`, `rise` and `aside` are the displacement since the settling in the grain's own
    diameter: along the bed as the flow goes, normal to it, and across the flow to either side.
    `roll` is the speed of the surface by spinning over that of the centre: 1 for pure rolling.
    """

    travel: FloatArray
    rise: FloatArray
    aside: FloatArray
    roll: FloatArray


class Count(NamedTuple):
    """Motion of N counted grains by each of T samples, shape (T, N); a grain stays counted."""

    moved: BoolArray
    """Displaced downstream or aside by the criterion at a sample, or carried off."""
    fallen: BoolArray
    """Displaced upstream by it; such a grain has not moved, but may yet."""
    carried: BoolArray
    """Gone without having been seen beyond the criterion: the flow lifted it off the pile."""


def count(
    travel: FloatArray,
    criterion: float,
    *,
    falls_out: bool,
    aside: FloatArray | float = 0.0,
) -> Count:
    """Apply the counting rule to `Track.travel` and `Track.aside`, with a criterion in d.

    `falls_out` says whether a grain that is gone and was not seen beyond the criterion fell
    upstream: from the two neighbours of a single grain it did, for no bed is behind them; only lift
    can have taken it from a pile.
    """
    ahead, back = (
        _ever((travel >= criterion) | (aside >= criterion)),
        _ever(travel <= -criterion),
    )
    vanished = _ever(np.isnan(travel) & ~ahead)
    if falls_out:
        return Count(ahead, back | vanished, np.zeros_like(vanished))
    return Count(ahead | vanished, back, vanished)


def _ever(happened: BoolArray) -> BoolArray:
    return np.logical_or.accumulate(happened, axis=0)


def read(
    directory: Path, grains: GrainTable, criterion: float, *, falls_out: bool
) -> Motion:
    """Read the deck's tables of a finished run; the other arguments are those of `count`.

    Raises a SolverError if a table is cut short, grains were lost, or the counts do not reconcile.
    """
    samples = read_table(directory / SAMPLES)
    track = read_track(directory, grains, samples)
    # as the deck counts
    passed = _ever((track.travel >= criterion) | (track.aside >= criterion))
    lying = (~np.isnan(track.travel) & ~passed).sum(axis=1)
    fallen = (track.travel <= -criterion).sum(axis=1)
    agree = (samples["lying"] == lying) & (samples["fallen"] == fallen)
    if not agree.all():
        what = f"the counts do not reconcile at sample {int(agree.argmin()) + 1}"
        remedy = "grains were lost, or the tables are of different runs"
        raise SolverError(what, where=str(directory / SAMPLES), remedy=remedy)
    counts = count(track.travel, criterion, falls_out=falls_out, aside=track.aside)
    load_step = samples["load_step"].to_numpy(np.int64)
    flow = samples.groupby("load_step")["flow"].first().to_numpy(float)
    level, fallen = (
        np.where(happened.any(axis=0), load_step[happened.argmax(axis=0)], 0)
        for happened in (counts.moved, counts.fallen)
    )
    whole = np.concatenate([[SETTLE_FLOW * flow[0]], flow])
    return Motion(whole, level, fallen, counts.carried[-1], _mode(track, counts))


def _mode(track: Track, counts: Count) -> IntArray:
    """How each grain moved, from its track around the sample at which it had moved."""
    passed = counts.moved
    samples = np.arange(len(passed))[:, None]
    first = np.where(passed.any(axis=0), passed.argmax(axis=0), -1)
    present = ~np.isnan(track.travel)
    # one that was gone by then is judged by its last sample
    last_seen = np.max(np.where(present & (samples <= first), samples, 0), axis=0)
    window = (samples >= last_seen) & (samples < first + WINDOW) & present
    rise = np.max(np.where(window, track.rise, -np.inf), axis=0)
    roll = np.take_along_axis(track.roll, last_seen[None], axis=0)[0]
    none, rolled, slid, lifted = range(len(MODES))
    return np.select(
        [first < 0, counts.carried[-1] | (rise > LIFTED), roll >= ROLLED],
        [none, lifted, rolled],
        slid,
    )


def read_track(directory: Path, grains: GrainTable, samples: pd.DataFrame) -> Track:
    """Read what the counted grains did at each sample, from ``passage.dump`` and ``bed.dump``.

    A counted grain that the first does not list, and that the second has at the end of the load
    step, is at rest where it had settled. `samples` is the deck's table of samples, T rows.
    """
    ids, path = grains.counted_ids, directory / PASSAGE
    steps, rows = read_dump(path, PASSAGE_COLUMNS)
    if rows.empty:
        remedy = "a smaller protocol.time_step, or look for grains that overlap"
        raise Exploded("every counted grain was lost", where=str(path), remedy=remedy)
    if not np.array_equal(steps[1:], samples["step"]):
        raise _of_another_run(path, "its samples are not those of samples.csv")
    if not rows["id"].isin(ids).all():
        raise _of_another_run(path, "it lists grains that are not counted")
    state = np.full((len(PASSAGE_COLUMNS) - 1, len(steps), len(ids)), np.nan)
    row, column = np.searchsorted(steps, rows["step"]), np.searchsorted(ids, rows["id"])
    for values, name in zip(state, PASSAGE_COLUMNS[1:], strict=True):
        values[row, column] = rows[name]
    listed = ~np.isnan(state[0, 1:])
    resting = ~listed & _present(listed, directory, ids, samples)
    for values, still in zip(
        state, (*state[:2, 0], 0.0, 0.0, 0.0, state[5, 0]), strict=True
    ):
        np.copyto(values[1:], still, where=resting)
    diameter, along = grains.diameter * grains.sizes[ids - 1], grains.along[ids - 1].T
    right, up = (state[:2, 1:] - state[:2, :1]) / diameter
    vx, vz, spin, y = state[2:, 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        roll = np.abs(spin) * diameter / 2 / np.hypot(vx, vz)
    return Track(
        travel=right * along[0] + up * along[1],
        # out of the bed, whichever way is along it
        rise=np.sign(along[0]) * (up * along[0] - right * along[1]),
        aside=np.abs(across(y - state[5, :1], grains.diameter * grains.width))
        / diameter,
        roll=roll,
    )


def _present(
    listed: BoolArray, directory: Path, ids: IntArray, samples: pd.DataFrame
) -> BoolArray:
    """Which grains were there at each sample: listed ones, or seen later in the load step."""
    steps, rows = read_dump(directory / BED, BED_COLUMNS)
    load_step = samples["load_step"].to_numpy(np.int64)
    last = np.append(np.flatnonzero(np.diff(load_step)), len(load_step) - 1)
    if not np.array_equal(steps, samples["step"].to_numpy()[last]):
        raise _of_another_run(
            directory / BED, "its frames are not the ends of the load steps"
        )
    rows = rows[rows["id"].isin(ids)]
    left = np.zeros((len(steps), len(ids)), bool)
    left[np.searchsorted(steps, rows["step"]), np.searchsorted(ids, rows["id"])] = True
    present = listed.copy()
    for at_the_end, first, end in zip(
        left, [0, *(last[:-1] + 1)], last + 1, strict=True
    ):
        group = listed[first:end]
        present[first:end] = np.logical_or.accumulate(group[::-1])[::-1] | at_the_end
    return present


def _of_another_run(path: Path, what: str) -> SolverError:
    return SolverError(what, where=str(path), remedy="run the case again")


def check_rest(
    directory: Path,
    grains: GrainTable,
    weight: float,
    stiffness: float,
    *,
    all_rest: bool,
    remedy: str = REMEDY,
) -> None:
    """See that a bed of grains came to rest before the flow rose, judged by their energy.

    The weight W is in N, the stiffness is K d/W. All grains of a pile must come to rest; of cells
    some grains may fall out. The errors name the remedy. Raises `Exploded` if the energy is no number, grows, or has driven
    grains away, `Noisy` if the grains keep moving.
    """
    settling, where = (
        read_table(directory / SETTLING, rows=4),
        str(directory / SETTLING),
    )
    energy = (
        settling["ke"].to_numpy(float)
        / grains.mobile_count
        / (weight * grains.diameter)
    )
    if not energy.max() < BURST:
        what = f"the bed burst as it settled: {energy.max():.2g} W d of kinetic energy per grain"
        raise Exploded(what, where=where, remedy=remedy)
    if not all_rest:
        return
    lost = grains.mobile_count - int(settling["grains"].iloc[-1])
    if lost:
        what = f"{lost} of {grains.mobile_count} grains were lost before the flow rose"
        raise Exploded(what, where=where, remedy=remedy)
    energy *= stiffness
    last = float(energy[-LAST:].max())
    if last < NOISE:
        return
    text = f"{last:.2g} W^2/K of kinetic energy per grain after settling"
    quarters = [float(quarter.mean()) for quarter in np.array_split(energy, 4)]
    if quarters[3] > GROWS * quarters[1]:
        ratio = quarters[3] / quarters[1]
        what = f"the energy of the bed at rest grows: {text}, {ratio:.1f} times the earlier"
        raise Exploded(what, where=where, remedy=remedy)
    what = (
        f"the bed does not come to rest: {text}; {NOISE:g} is the most of a bed at rest"
    )
    raise Noisy(what, where=where, remedy=remedy)
