"""Motion of the counted grains of a deck: which moved, at which flow, and how.

The counting rule is described in docs/benchmark.md, "The counting rule". The deck
in.bed has the same criterion to know when a load step may end, and its counts are
compared with those here.
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
    read_table,
    read_texts,
)
from orchestrator.bed.places import across
from orchestrator.digits import FORMAT
from orchestrator.errors import Exploded, Noisy, SolverError
from orchestrator.solvers.dem import ENGINE
from orchestrator.types import BoolArray, FloatArray, IntArray

SETTLING = "settling.csv"
SAMPLES = "samples.csv"
LOAD_STEPS = "load_steps.csv"
MOTION = "motion.csv"
PASSAGE = "passage.dump"
BED = "bed.dump"
PASSAGE_COLUMNS = ("id", "x", "z", "vx", "vz", "omegay", "y")
BED_COLUMNS = ("id", "type", "x", "z", "vx", "vz", "omegay")
MODES = ("none", "rolled", "slid", "lifted")
"""How a grain moved."""
LIFTED = 0.3
"""A grain has lifted when it rises by this over its bed, d: to roll over a neighbour
takes 0.13 at an entrainment angle of 60 degrees."""
ROLLED = 0.5
"""A grain rolls when its spin makes at least this part of its speed, else it slides."""
WINDOW = 5
"""Samples after the passage in which a grain may lift: 2 sqrt(d/g')."""
LAST = 5
"""Samples in a row in which a bed at rest has less energy than `NOISE`."""
GROWS = 2.0
"""The energy of a bed that does not come to rest grows when the last quarter of the
settling has more than this times that of the second."""
BURST = 10.0
"""Kinetic energy per grain, over W d, that no fall of a grain can give it."""
REMEDY = (
    "a smaller method.grains.time_step or method.grains.damping,"
    " or look for grains that overlap"
)
POURED_REMEDY = (
    "another bed.seed, a gentler slope, or a larger grain.friction_angle_deg; the "
    "springs of a poured bed are at most of method.grains.stiffness = 1e5"
)
"""Of poured beds. Grains that have come to rest on a slope roll off it when the springs
or the fixed grains under them are others; a smaller time step changes nothing."""


@dataclass(frozen=True)
class Motion:
    """The motion of the N counted grains of a deck.

    Attributes
    ----------
    flow
        The flow of each load step, in the deck's unit, which never falls; first that of
        the settling; shape (load steps + 1,).
    load_step
        Load step (index into `flow`) in which a grain moved by the counting rule; 0 for
        never; shape (N,).
    fallen
        Load step in which a grain was first the criterion upstream of its place; 0 for
        never; shape (N,).
    carried
        Whether it was gone before it was seen beyond the displacement criterion:
        carried off; shape (N,).
    mode
        How it moved: index into `MODES`; shape (N,).
    exact
        Whether a grain moves at the very flow of its load step, as by a formula; else
        the load step before and that one.
    """

    flow: FloatArray
    load_step: IntArray
    fallen: IntArray
    carried: BoolArray
    mode: IntArray
    exact: bool = False

    @classmethod
    def of_flows(
        cls, rolling: FloatArray, lifting: FloatArray | float = np.inf
    ) -> "Motion":
        """Make the motion of grains that roll or are lifted at given flows.

        Parameters
        ----------
        rolling, lifting
            The flows, shape (N,); infinite for never.

        Returns
        -------
        Motion
            The motion.
        """
        flows = np.minimum(rolling, lifting)
        moves = np.isfinite(flows)
        # to be lifted straight over a neighbour is to be lifted
        carried = np.isfinite(lifting) & (lifting <= rolling)
        load_steps = np.unique(flows[moves])
        flow = np.zeros(1)
        if len(load_steps):
            # before the first load step nothing moves
            flow = np.concatenate([load_steps[:1] * SETTLE_FLOW, load_steps])
        load_step = np.where(moves, np.searchsorted(load_steps, flows) + 1, 0)
        modes = [MODES.index("lifted"), MODES.index("rolled")]
        mode = np.select([carried, moves], modes, 0)
        return cls(flow, load_step, np.zeros_like(load_step), carried, mode, exact=True)

    @property
    def flows(self) -> FloatArray:
        """Flow at which each grain moved, shape (N,); infinite for never."""
        middle = np.sqrt(self.low * self.flow)
        return np.where(self.load_step > 0, middle[self.load_step], np.inf)

    def until(self, further: FloatArray, over: FloatArray) -> "Motion":
        """Make the motion of grains that must go on, too, from that of their leaving.

        Parameters
        ----------
        further
            Flows from which they go on, shape (N,).
        over
            Flow of the gust in which they leave, over the mean flow, shape (N,).

        Returns
        -------
        Motion
            The motion at the larger of both flows.
        """
        flows = np.maximum(self.flows / over, further)
        lifting = np.where(self.carried, flows, np.inf)
        return Motion.of_flows(flows, lifting)

    def scaled(self, fractions: Sequence[float], ratios: Sequence[float]) -> "Motion":
        """Make the motion under flows that are larger by some ratios.

        Parameters
        ----------
        fractions
            Fractions n/N, rising.
        ratios
            For each, the flow at which it has moved over that at which it had.

        Returns
        -------
        Motion
            The same grains in the same order; between fractions the ratios are
            interpolated in their logarithm, and beyond all the nearest holds.
        """
        at = np.interp(self.fraction, fractions, np.log(ratios))
        # a grain goes at no lower flow than those that went before it
        flow = np.maximum.accumulate(self.flow * np.exp(at))
        return replace(self, flow=flow)

    @classmethod
    def chained(cls, runs: "Sequence[tuple[BoolArray, Motion]]") -> "Motion":
        """Join the motion in runs that go on from one another.

        Parameters
        ----------
        runs
            For each run which of the N grains it counts, and its motion.

        Returns
        -------
        Motion
            The motion of all grains.
        """
        everyone, first_run = runs[0]
        load_step = np.zeros(len(everyone), np.int64)
        fallen = np.zeros(len(everyone), np.int64)
        carried = np.zeros(len(everyone), bool)
        mode = np.zeros(len(everyone), np.int64)
        flow = [first_run.flow[:1]]
        before = 0
        for counted, run in runs:
            load_step[counted] = np.where(run.load_step > 0, run.load_step + before, 0)
            falls_first = (fallen[counted] == 0) & (run.fallen > 0)
            fallen[counted] = np.where(
                falls_first, run.fallen + before, fallen[counted]
            )
            carried[counted] = run.carried
            mode[counted] = run.mode
            flow.append(run.flow[1:])
            before += len(run.flow) - 1
        return cls(np.concatenate(flow), load_step, fallen, carried, mode)

    def of(self, chosen: BoolArray) -> "Motion":
        """Take the motion of some of the counted grains under the same flows.

        Parameters
        ----------
        chosen
            Which grains, shape (N,).

        Returns
        -------
        Motion
            Their motion.
        """
        return replace(
            self,
            load_step=self.load_step[chosen],
            fallen=self.fallen[chosen],
            carried=self.carried[chosen],
            mode=self.mode[chosen],
        )

    @cached_property
    def low(self) -> FloatArray:
        """The highest flow known below each load step, shape (load steps + 1,)."""
        if self.exact:
            return self.flow
        # two load steps of one flow are before and after the bed has changed
        lower = np.searchsorted(self.flow, self.flow) - 1
        return np.asarray(self.flow[np.maximum(lower, 0)])

    def moved_by(self, load_step: int) -> BoolArray:
        """Find the grains that have moved by the end of a load step.

        Parameters
        ----------
        load_step
            The load step.

        Returns
        -------
        BoolArray
            Which grains, shape (N,).
        """
        return (self.load_step > 0) & (self.load_step <= load_step)

    @property
    def count(self) -> int:
        """N, how many grains are counted."""
        return len(self.load_step)

    @cached_property
    def fraction(self) -> FloatArray:
        """n/N at the end of each load step, shape (load steps + 1,)."""
        return np.asarray(self.moved / self.count)

    @cached_property
    def moved(self) -> IntArray:
        """How many grains had moved by the end of each load step; (load steps + 1,)."""
        return self._by_load_step(self.load_step)

    @property
    def fallen_upstream(self) -> IntArray:
        """How many had been the criterion upstream by then, shape (load steps + 1,)."""
        return self._by_load_step(self.fallen)

    @cached_property
    def carried_off(self) -> IntArray:
        """How many of those had been carried off, shape (load steps + 1,)."""
        return self._by_load_step(np.where(self.carried, self.load_step, 0))

    def _by_load_step(self, load_step: IntArray) -> IntArray:
        """How many grains had reached their load step by the end of each load step."""
        counts = np.bincount(load_step, minlength=len(self.flow))
        counts[0] = 0
        return np.cumsum(counts)

    def to_csv(self, directory: Path, grains: GrainTable) -> None:
        """Write ``load_steps.csv`` and ``motion.csv``, which `from_csv` reads.

        Parameters
        ----------
        directory
            Where to.
        grains
            The grains of the deck.
        """
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
            "moved_in": self.load_step,
            "fallen_in": self.fallen,
            "carried_off": self.carried.astype(int),
            "mode": [MODES[mode] for mode in self.mode],
        }
        pd.DataFrame(moved).to_csv(directory / MOTION, index=False)

    @classmethod
    def from_csv(cls, directory: Path) -> "Motion":
        """Read what `to_csv` wrote.

        Parameters
        ----------
        directory
            Where from.

        Returns
        -------
        Motion
            The motion.
        """
        grains = read_texts(directory / MOTION)
        return cls(
            flow=read_texts(directory / LOAD_STEPS)["flow"].astype(float),
            load_step=grains["moved_in"].astype(np.int64),
            fallen=grains["fallen_in"].astype(np.int64),
            carried=grains["carried_off"] == "1",
            mode=np.array([MODES.index(mode) for mode in grains["mode"]], np.int64),
        )


class Track(NamedTuple):
    """The N counted grains at each of T samples; NaN for a grain that is gone.

    Attributes
    ----------
    travel, rise, aside
        Displacement since the settling in the grain's own diameter: along the bed as
        the flow goes, normal to it, and across the flow to either side; shape (T, N).
    roll
        Speed of the surface by spinning over that of the centre: 1 for pure rolling;
        shape (T, N).
    """

    travel: FloatArray
    rise: FloatArray
    aside: FloatArray
    roll: FloatArray


class Count(NamedTuple):
    """Motion of N counted grains by each of T samples; a grain stays counted.

    Attributes
    ----------
    moved
        Displaced downstream or aside by the criterion at a sample, or carried off;
        shape (T, N).
    fallen
        Displaced upstream by it; such a grain has not moved, but may yet.
    carried
        Gone without having been seen beyond the criterion: the flow lifted it off the
        pile.
    """

    moved: BoolArray
    fallen: BoolArray
    carried: BoolArray


def count(
    travel: FloatArray,
    criterion: float,
    *,
    falls_out: bool,
    aside: FloatArray | float = 0.0,
) -> Count:
    """Apply the counting rule.

    Parameters
    ----------
    travel, aside
        As in `Track`.
    criterion
        The displacement criterion, d.
    falls_out
        Whether a grain that is gone and was not seen beyond the criterion fell
        upstream: from the two neighbours of a single grain it did, for no bed is behind
        them; only lift can have taken it from a pile.

    Returns
    -------
    Count
        Which grains have moved by each sample.
    """
    ahead = _ever((travel >= criterion) | (aside >= criterion))
    back = _ever(travel <= -criterion)
    vanished = _ever(np.isnan(travel) & ~ahead)
    if falls_out:
        return Count(ahead, back | vanished, np.zeros_like(vanished))
    return Count(ahead | vanished, back, vanished)


def _ever(happened: BoolArray) -> BoolArray:
    """What has happened by each sample."""
    return np.logical_or.accumulate(happened, axis=0)


def read_motion(
    directory: Path, grains: GrainTable, criterion: float, *, falls_out: bool
) -> Motion:
    """Read the deck's tables of a finished run.

    Parameters
    ----------
    directory
        The directory of the run.
    grains
        The grains of the deck.
    criterion, falls_out
        As in `count`.

    Returns
    -------
    Motion
        The motion of the counted grains.

    Raises
    ------
    SolverError
        If a table is cut short, grains were lost, or the counts do not reconcile.
    """
    samples = read_table(directory / SAMPLES)
    track = read_track(directory, grains, samples)
    # as the deck counts
    passed = _ever((track.travel >= criterion) | (track.aside >= criterion))
    lying = (~np.isnan(track.travel) & ~passed).sum(axis=1)
    fallen = (track.travel <= -criterion).sum(axis=1)
    agrees = (samples["lying"] == lying) & (samples["fallen"] == fallen)
    if not agrees.all():
        what = f"the counts do not reconcile at sample {int(agrees.argmin()) + 1}"
        remedy = "grains were lost, or the tables are of different runs"
        raise SolverError(what, where=str(directory / SAMPLES), remedy=remedy)
    counts = count(track.travel, criterion, falls_out=falls_out, aside=track.aside)
    load_step = samples["load_step"].to_numpy(np.int64)
    flow = samples.groupby("load_step")["flow"].first().to_numpy(float)
    return Motion(
        flow=np.concatenate([[SETTLE_FLOW * flow[0]], flow]),
        load_step=_first_step(counts.moved, load_step),
        fallen=_first_step(counts.fallen, load_step),
        carried=counts.carried[-1],
        mode=_mode(track, counts),
    )


def _first_step(happened: BoolArray, load_step: IntArray) -> IntArray:
    """Load step of the first sample at which it happened to each grain; 0 for never."""
    first = load_step[happened.argmax(axis=0)]
    return np.where(happened.any(axis=0), first, 0)


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
    """Read what the counted grains did at each sample.

    A counted grain that ``passage.dump`` does not list, and that ``bed.dump`` has at
    the end of the load step, is at rest where it had settled.

    Parameters
    ----------
    directory
        The directory of the run.
    grains
        The grains of the deck.
    samples
        The deck's table of samples, T rows.

    Returns
    -------
    Track
        The N counted grains.

    Raises
    ------
    Exploded
        If every counted grain was lost.
    SolverError
        If a dump is of another run.
    """
    ids = grains.counted_ids
    state = _passage(directory / PASSAGE, ids, samples)
    is_listed = ~np.isnan(state[0, 1:])
    is_resting = ~is_listed & _present(is_listed, directory, ids, samples)
    x, z, vx, vz, spin, y = state
    for place in (x, y, z):
        np.copyto(place[1:], place[0], where=is_resting)
    for speed in (vx, vz, spin):
        np.copyto(speed[1:], 0.0, where=is_resting)
    return _track(grains, ids, state)


def _track(grains: GrainTable, ids: IntArray, state: FloatArray) -> Track:
    """The motion of the counted grains from their places and speeds."""
    x, z, vx, vz, spin, y = state
    diameter = grains.diameter * grains.sizes[ids - 1]
    along_x, along_z = grains.along[ids - 1].T
    right = (x[1:] - x[0]) / diameter
    up = (z[1:] - z[0]) / diameter
    sideways = across(y[1:] - y[0], grains.diameter * grains.width)
    with np.errstate(invalid="ignore", divide="ignore"):
        roll = np.abs(spin[1:]) * diameter / 2 / np.hypot(vx[1:], vz[1:])
    return Track(
        travel=right * along_x + up * along_z,
        # out of the bed, whichever way is along it
        rise=np.sign(along_x) * (up * along_x - right * along_z),
        aside=np.abs(sideways) / diameter,
        roll=roll,
    )


def _passage(path: Path, ids: IntArray, samples: pd.DataFrame) -> FloatArray:
    """What ``passage.dump`` lists of the counted grains, NaN of one that it does not.

    The shape is (numbers of a grain, T + 1, N), as in `PASSAGE_COLUMNS` after the id.
    """
    steps, rows = ENGINE.read_frames(path, PASSAGE_COLUMNS)
    if rows.empty:
        remedy = "a smaller method.grains.time_step, or look for grains that overlap"
        raise Exploded("every counted grain was lost", where=str(path), remedy=remedy)
    if not np.array_equal(steps[1:], samples["step"]):
        raise _of_another_run(path, "its samples are not those of samples.csv")
    if not rows["id"].isin(ids).all():
        raise _of_another_run(path, "it lists grains that are not counted")
    state = np.full((len(PASSAGE_COLUMNS) - 1, len(steps), len(ids)), np.nan)
    sample = np.searchsorted(steps, rows["step"])
    grain = np.searchsorted(ids, rows["id"])
    for values, name in zip(state, PASSAGE_COLUMNS[1:], strict=True):
        values[sample, grain] = rows[name]
    return state


def _present(
    listed: BoolArray, directory: Path, ids: IntArray, samples: pd.DataFrame
) -> BoolArray:
    """Which grains were there at each sample: listed then, or later in that step."""
    steps, rows = ENGINE.read_frames(directory / BED, BED_COLUMNS)
    load_step = samples["load_step"].to_numpy(np.int64)
    last = np.append(np.flatnonzero(np.diff(load_step)), len(load_step) - 1)
    if not np.array_equal(steps, samples["step"].to_numpy()[last]):
        what = "its frames are not the ends of the load steps"
        raise _of_another_run(directory / BED, what)
    rows = rows[rows["id"].isin(ids)]
    is_left = np.zeros((len(steps), len(ids)), bool)
    frame = np.searchsorted(steps, rows["step"])
    is_left[frame, np.searchsorted(ids, rows["id"])] = True
    present = listed.copy()
    first = 0
    for at_the_end, end in zip(is_left, last + 1, strict=True):
        of_step = listed[first:end]
        is_seen_later = np.logical_or.accumulate(of_step[::-1])[::-1]
        present[first:end] = is_seen_later | at_the_end
        first = end
    return present


def _of_another_run(path: Path, what: str) -> SolverError:
    """The refusal of a dump that is of another run."""
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
    """See that a bed of grains came to rest before the flow rose, by their energy.

    Parameters
    ----------
    directory
        The directory of the run.
    grains
        The grains of the deck.
    weight
        Weight W of a grain, N.
    stiffness
        Stiffness of a contact, K d/W.
    all_rest
        Whether all grains must come to rest, as of a pile; of cells some may fall out.
    remedy
        What the errors name as the remedy.

    Raises
    ------
    Exploded
        If the energy is no number, grows, or has driven grains away.
    Noisy
        If the grains keep moving.
    """
    where = str(directory / SETTLING)
    settling = read_table(directory / SETTLING, rows=4)
    mean = settling["ke"].to_numpy(float) / grains.mobile_count
    energy = mean / (weight * grains.diameter)
    if not energy.max() < BURST:
        grain = f"{energy.max():.2g} W d of kinetic energy per grain"
        what = f"the bed burst as it settled: {grain}"
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
    _, second, _, fourth = (float(part.mean()) for part in np.array_split(energy, 4))
    if fourth > GROWS * second:
        times = f"{fourth / second:.1f} times the earlier"
        what = f"the energy of the bed at rest grows: {text}, {times}"
        raise Exploded(what, where=where, remedy=remedy)
    limit = f"{NOISE:g} is the most of a bed at rest"
    what = f"the bed does not come to rest: {text}; {limit}"
    raise Noisy(what, where=where, remedy=remedy)
