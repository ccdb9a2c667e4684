"""Motion of the counted grains of a deck: which moved, at which flow, and how."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.errors import SolverError
from orchestrator.grains import counting
from orchestrator.grains.counting import Count
from orchestrator.grains.deck import GrainTable
from orchestrator.grains.dump import Track, read_track
from orchestrator.grains.protocol import SETTLE_FLOW

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

SAMPLES = "samples.csv"
LOAD_STEPS = "load_steps.csv"
MOTION = "motion.csv"
MODES = ("none", "rolled", "slid", "lifted")
"""How a grain moved."""
LIFTED = 0.3
"""A grain has lifted when it rises by this over its bed, d: to roll over a neighbour takes 0.13 at
an entrainment angle of 60 degrees."""
ROLLED = 0.5
"""A grain rolls when its spin makes at least this part of its speed, else it slides."""
WINDOW = 5
"""Samples from the passage of the criterion on in which a grain may lift: 2 sqrt(d/g')."""


@dataclass(frozen=True)
class Motion:
    """The motion of the N counted grains of a deck.

    Attributes
    ----------
    flow : ndarray, shape (levels + 1,)
        The flow of each load step, never falling, in the deck's unit; first that of the settling.
    level : ndarray of int, shape (N,)
        Load step (index into `flow`) in which a grain moved by the rule of `counting`; 0 for
        never.
    fallen : ndarray of int, shape (N,)
        Load step in which a grain was first the criterion upstream of its place; 0 for never.
    carried : ndarray of bool, shape (N,)
        Whether it moved by being carried off: it was gone before it was seen beyond the
        displacement criterion.
    mode : ndarray of int, shape (N,)
        How it moved: index into `MODES`.
    exact : bool
        Whether a grain moves at its level's very flow, as by a formula; else between the load step
        before and that one.
    """

    flow: FloatArray
    level: IntArray
    fallen: IntArray
    carried: BoolArray
    mode: IntArray
    exact: bool = False

    @classmethod
    def of_flows(cls, flows: FloatArray) -> "Motion":
        """The motion of grains that roll at known flows, shape (N,); infinite for never."""
        moves = np.isfinite(flows)
        levels = np.unique(flows[moves])
        # before the first level nothing moves
        flow = np.concatenate([levels[:1] * SETTLE_FLOW, levels]) if len(levels) else np.zeros(1)
        level = np.where(moves, np.searchsorted(levels, flows) + 1, 0)
        none, rolled = MODES.index("none"), MODES.index("rolled")
        return cls(
            flow=flow,
            level=level,
            fallen=np.zeros_like(level),
            carried=np.zeros_like(moves),
            mode=np.where(moves, rolled, none),
            exact=True,
        )

    @classmethod
    def chained(cls, runs: "Sequence[tuple[BoolArray, Motion]]") -> "Motion":
        """The motion in runs that go on from one another: of each which of the N it counts."""
        found = cls.of_flows(np.full(len(runs[0][0]), np.inf))
        level, fallen, carried, mode = found.level, found.fallen, found.carried, found.mode
        flow, before = [runs[0][1].flow[:1]], 0
        for counted, run in runs:
            level[counted] = np.where(run.level > 0, run.level + before, 0)
            first = (fallen[counted] == 0) & (run.fallen > 0)
            fallen[counted] = np.where(first, run.fallen + before, fallen[counted])
            carried[counted], mode[counted] = run.carried, run.mode
            flow.append(run.flow[1:])
            before += len(run.flow) - 1
        return cls(np.concatenate(flow), level, fallen, carried, mode)

    @property
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

    @property
    def fraction(self) -> FloatArray:
        """n/N at the end of each load step, shape (levels + 1,)."""
        return np.asarray(self.moved / self.count)

    @property
    def moved(self) -> IntArray:
        """How many grains had moved by the end of each load step, shape (levels + 1,)."""
        return self._counts(self.level)

    @property
    def fallen_upstream(self) -> IntArray:
        """How many had been the displacement criterion upstream by then, shape (levels + 1,)."""
        return self._counts(self.fallen)

    @property
    def carried_off(self) -> IntArray:
        """How many of those that had moved by then were carried off, shape (levels + 1,)."""
        return self._counts(np.where(self.carried, self.level, 0))

    def _counts(self, level: IntArray) -> IntArray:
        """How many grains had their level by the end of each load step."""
        counts = np.bincount(level, minlength=len(self.flow))
        counts[0] = 0
        return np.cumsum(counts)

    def to_csv(self, directory: Path, grains: GrainTable) -> None:
        """Write ``load_steps.csv`` and ``motion.csv``: the same, for people and for `from_csv`."""
        load_steps = pd.DataFrame({"load_step": np.arange(len(self.flow)), "flow": self.flow})
        load_steps = load_steps.assign(
            moved=self.moved,
            not_moved=self.count - self.moved,
            carried_off=self.carried_off,
            fallen_upstream=self.fallen_upstream,
        )
        load_steps.to_csv(directory / LOAD_STEPS, index=False)
        columns = {
            "id": grains.counted_ids,
            "moved_in": self.level,
            "fallen_in": self.fallen,
            "carried_off": self.carried.astype(int),
            "mode": [MODES[mode] for mode in self.mode],
        }
        pd.DataFrame(columns).to_csv(directory / MOTION, index=False)

    @classmethod
    def from_csv(cls, directory: Path) -> "Motion":
        """Read what `to_csv` wrote."""
        load_steps = pd.read_csv(directory / LOAD_STEPS)
        grains = pd.read_csv(directory / MOTION)
        return cls(
            flow=load_steps["flow"].to_numpy(float),
            level=grains["moved_in"].to_numpy(np.int64),
            fallen=grains["fallen_in"].to_numpy(np.int64),
            carried=grains["carried_off"].to_numpy(bool),
            mode=np.array([MODES.index(mode) for mode in grains["mode"]], np.int64),
        )


def read(directory: Path, grains: GrainTable, marker: float, *, falls_out: bool) -> Motion:
    """Read the deck's tables of a finished run.

    Parameters
    ----------
    directory : Path
        The case.
    grains : GrainTable
        As the deck was given them.
    marker, falls_out
        As `counting.count` takes them.

    Raises
    ------
    SolverError
        If a table is cut short, grains are lost that may not be, or the counts do not reconcile.
    """
    samples = _samples(directory)
    track = read_track(directory, grains, samples)
    _reconcile(directory, samples, track, marker)
    found = counting.count(track.travel, marker, falls_out=falls_out, aside=track.aside)
    load_step = samples["load_step"].to_numpy(np.int64)
    flow = samples.groupby("load_step")["flow"].first().to_numpy(float)
    return Motion(
        flow=np.concatenate([[SETTLE_FLOW * flow[0]], flow]),
        level=_first(found.moved, load_step),
        fallen=_first(found.fallen, load_step),
        carried=found.carried[-1],
        mode=_mode(track, found),
    )


def _first(happened: BoolArray, load_step: IntArray) -> IntArray:
    return np.where(happened.any(axis=0), load_step[happened.argmax(axis=0)], 0)


def _mode(track: Track, found: Count) -> IntArray:
    """How each grain moved, from its track around the sample at which it had moved."""
    passed = found.moved
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
        [first < 0, found.carried[-1] | (rise > LIFTED), roll >= ROLLED],
        [none, lifted, rolled],
        slid,
    )


def _samples(directory: Path) -> pd.DataFrame:
    path = directory / SAMPLES
    try:
        text = path.read_text(encoding="ascii")
        samples = pd.read_csv(StringIO(text))
        if (
            samples.empty
            or not text.endswith("\n")
            or not np.isfinite(samples.to_numpy(float)).all()
        ):
            raise ValueError("it holds no whole line")
        return samples
    except (OSError, ValueError) as error:
        raise SolverError(
            f"the table of load steps cannot be read: {error}",
            where=str(path),
            remedy="run the same command again",
        ) from None


def _reconcile(directory: Path, samples: pd.DataFrame, track: Track, marker: float) -> None:
    """Lying, fallen and gone make N at each sample, by the deck's own count and by the places."""
    lying, fallen = counting.deck_counts(track.travel, marker, track.aside)
    agree = (samples["lying"] == lying) & (samples["fallen"] == fallen)
    if not agree.all():
        raise SolverError(
            f"the counts do not reconcile at sample {int(agree.argmin()) + 1}",
            where=str(directory / SAMPLES),
            remedy="grains were lost, or the tables are of different runs",
        )
