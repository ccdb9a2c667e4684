"""The grains of a pile at the instant when a fraction of them has moved."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.grains import dump, motion
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import PileCase

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Snapshot:
    """All n grains of a pile at one look of its deck; lengths in d.

    Attributes
    ----------
    start, place : ndarray, shape (n, 2)
        x and z of the centres in the packing and now.
    mobile, gone : ndarray of bool, shape (n,)
        May move; has left the box.
    fraction : float
        n/N that was to be reached.
    hold : int
        Number of the hold.
    ustar0 : float
        Undisturbed friction velocity of the hold, m/s.
    """

    start: FloatArray
    place: FloatArray
    mobile: BoolArray
    gone: BoolArray
    fraction: float
    hold: int
    ustar0: float

    @property
    def displacement(self) -> FloatArray:
        """Distance of each grain from its start, shape (n,)."""
        return np.asarray(np.hypot(*(self.place - self.start).T))


def take(pile: PileCase, cases: Path, fraction: float) -> Snapshot | None:
    """The first look at which a fraction of the exposed windward grains had moved.

    Those grains are in ``passage.dump`` at every look; all other mobile ones in ``bed.dump``, at
    the end of the hold. None if the fraction was not reached.
    """
    directory, d = cases / pile.name, pile.scene.grain.diameter
    looks = pd.read_csv(directory / motion.LEVELS)
    count = Motion.from_csv(directory).count
    needed = max(math.ceil(fraction * count - 1e-9), 1)
    enough = looks[looks["lying"] <= count - needed]
    if enough.empty:
        return None
    look = enough.iloc[0]
    counted = _frame(directory / dump.PASSAGE, dump.PASSAGE_COLUMNS, int(look["step"]))
    last = looks.loc[looks["level"] == look["level"], "step"].iloc[-1]
    columns = ("id", "type", "x", "z", "vx", "vz", "omegay")
    bed = _frame(directory / dump.BED, columns, int(last))
    packing = pile.packing
    place = packing.centres.copy()
    gone = packing.mobile.copy()
    windward = packing.windward
    for table, chosen in ((bed, ~windward), (counted, windward)):
        index = table["id"].to_numpy(int) - 1
        own = chosen[index]
        place[index[own]] = table.loc[own, ["x", "z"]].to_numpy(float) / d
        gone[index[own]] = False
    return Snapshot(
        packing.centres,
        place,
        packing.mobile,
        gone,
        fraction,
        int(look["level"]),
        float(look["flow"]),
    )


def _frame(path: Path, columns: tuple[str, ...], step: int) -> pd.DataFrame:
    frames = dump.read_dump(path, columns).rows
    return frames[frames["step"] == step]
