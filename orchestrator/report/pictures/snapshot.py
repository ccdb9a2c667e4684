"""The grains of a pile at one sample of its deck, and at all of them."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.grains import counting, dump, motion
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Snapshot:
    """All n grains of a pile at one sample of its deck; lengths in d.

    Attributes
    ----------
    start, place : ndarray, shape (n, 2)
        x and z of the centres in the packing and now.
    mobile, exposed, gone : ndarray of bool, shape (n,)
        May move; is one of the N counted; has left the box.
    mode : ndarray of int, shape (n,)
        How a counted grain moved, index into `orchestrator.grains.motion.MODES`: 0 while it has
        not, and for all others.
    hold : int
        Number of the load step.
    ustar0 : float
        Undisturbed friction velocity of the load step, m/s.
    """

    start: FloatArray
    place: FloatArray
    mobile: BoolArray
    exposed: BoolArray
    gone: BoolArray
    mode: IntArray
    load_step: int
    ustar0: float

    @property
    def displacement(self) -> FloatArray:
        """Distance of each grain from its start, shape (n,)."""
        return np.asarray(np.hypot(*(self.place - self.start).T))

    @property
    def moved(self) -> int:
        """How many of the counted grains have moved."""
        return int((self.mode > 0).sum())


@dataclass(frozen=True)
class Passage:
    """What the grains of a pile did at each of the T samples of its deck; lengths in d.

    Attributes
    ----------
    pile : Pile
        The pile.
    looks : DataFrame
        The deck's table of samples, T rows.
    exposed : ndarray, shape (T + 1, N, 2)
        x and z of the counted grains, first after settling; NaN where one is gone.
    rest : ndarray, shape (holds, n, 2)
        x and z of the mobile grains at the end of each load step, NaN for all others.
    passed : ndarray of bool, shape (T, N)
        Which counted grains have moved by then.
    mode : ndarray of int, shape (N,)
        How each counted grain moved in the end.
    """

    pile: Pile
    samples: pd.DataFrame
    exposed: FloatArray
    rest: FloatArray
    passed: BoolArray
    mode: IntArray

    def first(self, fraction: float) -> int | None:
        """The first sample at which a fraction of the counted grains had moved, if any."""
        needed = max(math.ceil(fraction * len(self.mode) - 1e-9), 1)
        enough = np.flatnonzero(self.passed.sum(axis=1) >= needed)
        return int(enough[0]) if len(enough) else None

    def at(self, sample: int) -> Snapshot:
        """The grains at a sample: those not counted are known at the end of its load step only."""
        packing, row = self.pile.packing, self.samples.iloc[sample]
        now = np.where(
            packing.mobile[:, None], self.rest[int(row["load_step"]) - 1], packing.centres
        )
        now[packing.windward] = self.exposed[sample + 1]
        gone = np.isnan(now[:, 0])
        mode = np.zeros(len(now), np.int64)
        mode[packing.windward] = np.where(self.passed[sample], self.mode, 0)
        return Snapshot(
            start=packing.centres,
            place=np.where(gone[:, None], packing.centres, now),
            mobile=packing.mobile,
            exposed=packing.windward,
            gone=gone,
            mode=mode,
            load_step=int(row["load_step"]),
            ustar0=float(row["flow"]),
        )


def read(pile: Pile, cases: Path) -> Passage:
    """Read the dumps of a finished pile."""
    directory, d = cases / pile.case.name, pile.scene.grain.diameter
    samples = pd.read_csv(directory / motion.SAMPLES)
    counted = np.flatnonzero(pile.packing.windward) + 1
    exposed = np.moveaxis(dump.read_passage(directory, counted, samples)[:2], 0, -1) / d
    ends = samples.groupby("load_step")["step"].last().to_numpy(np.int64)
    bed = dump.read_dump(directory / dump.BED, dump.BED_COLUMNS)
    rest = np.full((len(ends), len(pile.packing.centres), 2), np.nan)
    _place(rest, bed.rows, ends, d)
    passed = _passed(exposed, pile)
    return Passage(pile, samples, exposed, rest, passed, Motion.from_csv(directory).mode)


def _place(into: FloatArray, rows: pd.DataFrame, steps: IntArray, d: float) -> None:
    """Write the places of a dump's rows into an array by frame and grain."""
    into[np.searchsorted(steps, rows["step"]), rows["id"] - 1] = (
        rows[["x", "z"]].to_numpy(float) / d
    )


def _passed(exposed: FloatArray, pile: Pile) -> BoolArray:
    along = pile.tangents[pile.packing.windward]
    travel = ((exposed[1:] - exposed[0]) * along).sum(axis=2)
    return counting.count(travel, pile.scene.protocol.displacement_criterion, falls_out=False).moved
