"""Whether the grains of a deck came to rest before the flow rose, judged by their energy."""

from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.errors import Exploded, Noisy, SolverError
from orchestrator.grains.deck import GrainTable

FloatArray = NDArray[np.float64]

SETTLING = "settling.csv"
NOISE = 0.01
"""Most kinetic energy of a mobile grain at rest, over W^2/K, which is twice what its weight stores
in a spring. Beyond it trials at 0 to 0.9 of damping and 0.05 to 1.2 of time step gave other
thresholds; at a damping of 0.1 and a time step of 0.3 it is 1e-5."""
DECAY = 0.5
"""The energy still falls when the last quarter of the settling has less than this part of the
second quarter's, and grows when it has more than 1/DECAY of it."""
BURST = 10.0
"""Kinetic energy per grain, over W d, that no fall of a grain can give it."""
REMEDY = "a smaller protocol.time_step or grain.damping, or look for grains that overlap"


def check(
    directory: Path, grains: GrainTable, weight: float, stiffness: float, *, all_rest: bool
) -> None:
    """See that a bed of grains settled.

    Parameters
    ----------
    directory : Path
        The case.
    grains : GrainTable
        As the deck was given them.
    weight : float
        Submerged weight W of a grain, N.
    stiffness : float
        K d/W.
    all_rest : bool
        Whether every grain must come to rest: those of a pile must, cells are each a bed of their
        own and may be one that holds no grain.

    Raises
    ------
    Exploded
        If the energy is no number, grows, or has driven grains away.
    Noisy
        If the grains keep moving.
    SolverError
        If the table cannot be read.
    """
    settling = read(directory)
    where = str(directory / SETTLING)
    energy = settling["ke"].to_numpy(float) / grains.mobile_count / (weight * grains.diameter)
    if not energy.max() < BURST:
        what = f"the bed burst as it settled: {energy.max():.2g} W d of kinetic energy per grain"
        raise Exploded(what, where=where, remedy=REMEDY)
    if not all_rest:
        return
    lost = grains.mobile_count - int(settling["grains"].iloc[-1])
    if lost:
        what = f"{lost} of {grains.mobile_count} grains were lost before the flow rose"
        raise Exploded(what, where=where, remedy=REMEDY)
    _judge(energy * stiffness, where)


def _judge(energy: FloatArray, where: str) -> None:
    """See that grains which are all there are at rest; energy in W^2/K at each sample."""
    _, before, _, last = (float(part.mean()) for part in np.array_split(energy, 4))
    if last < NOISE or last < DECAY * before:
        return
    said = f"{last:.2g} W^2/K of kinetic energy per grain after settling"
    if last > before / DECAY:
        what = f"the energy of the bed at rest grows: {said}, {last / before:.1f} times the earlier"
        raise Exploded(what, where=where, remedy=REMEDY)
    what = f"the bed does not come to rest: {said}; {NOISE:g} is the most of a bed at rest"
    raise Noisy(what, where=where, remedy=REMEDY)


def read(directory: Path) -> pd.DataFrame:
    """Read the table of the settling: the deck's time step, grains and kinetic energy, J."""
    path = directory / SETTLING
    try:
        text = path.read_text(encoding="ascii")
        found = pd.read_csv(StringIO(text))
        if len(found) < 4 or not text.endswith("\n"):
            raise ValueError("it is cut short")
        return found.astype({"grains": np.int64, "ke": np.float64})
    except (OSError, ValueError, KeyError) as error:
        raise SolverError(
            f"the table of the settling cannot be read: {error}",
            where=str(path),
            remedy="run the same command again",
        ) from None
