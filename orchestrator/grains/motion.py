"""What the counted grains of a deck did: who passed the marker, and at which flow."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.errors import SolverError
from orchestrator.grains.deck import GrainTable
from orchestrator.grains.protocol import SETTLE_FLOW

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEVELS = "levels.csv"
PASSAGE = "passage.dump"
BED = "bed.dump"
HOLDS = "holds.csv"
MOTION = "motion.csv"


@dataclass(frozen=True)
class Motion:
    """The motion of the N counted grains of a deck.

    Attributes
    ----------
    flow : ndarray, shape (levels + 1,)
        The flow of each hold, rising, in the deck's unit; first the flow of the settling.
    level : ndarray of int, shape (N,)
        Hold (index into `flow`) in which a grain first passed the marker or left the box; 0 where
        it never did. Latched: a grain that comes back has moved.
    fallen : ndarray of int, shape (N,)
        Hold in which a grain was first a marker's length upstream of its place; 0 for never. Such
        a grain has not moved unless it passes the marker as well.
    """

    flow: FloatArray
    level: IntArray
    fallen: IntArray

    def moved_by(self, level: int) -> NDArray[np.bool_]:
        """Which grains have moved by the end of a hold."""
        return (self.level > 0) & (self.level <= level)

    @property
    def count(self) -> int:
        """N, how many grains are counted."""
        return len(self.level)

    @property
    def fraction(self) -> FloatArray:
        """n/N at the end of each hold, shape (levels + 1,)."""
        return np.asarray(self._counts(self.level) / self.count)

    def _counts(self, level: IntArray) -> IntArray:
        """How many grains had their level by the end of each hold."""
        counts = np.bincount(level, minlength=len(self.flow))
        counts[0] = 0
        return np.cumsum(counts)

    def to_csv(self, directory: Path, grains: GrainTable) -> None:
        """Write ``holds.csv`` and ``motion.csv``: the same, for people and for `from_csv`."""
        moved = self._counts(self.level)
        holds = pd.DataFrame({"hold": np.arange(len(self.flow)), "flow": self.flow})
        holds = holds.assign(
            moved=moved, not_moved=self.count - moved, fallen_upstream=self._counts(self.fallen)
        )
        holds.to_csv(directory / HOLDS, index=False)
        columns = {"id": grains.counted_ids, "moved_in": self.level, "fallen_in": self.fallen}
        pd.DataFrame(columns).to_csv(directory / MOTION, index=False)

    @classmethod
    def from_csv(cls, directory: Path) -> "Motion":
        """Read what `to_csv` wrote."""
        holds = pd.read_csv(directory / HOLDS)
        grains = pd.read_csv(directory / MOTION)
        return cls(
            flow=holds["flow"].to_numpy(float),
            level=grains["moved_in"].to_numpy(np.int64),
            fallen=grains["fallen_in"].to_numpy(np.int64),
        )


def read(directory: Path, grains: GrainTable, marker: float) -> Motion:
    """Read the deck's tables of a finished run.

    Parameters
    ----------
    directory : Path
        The case.
    grains : GrainTable
        As the deck was given them.
    marker : float
        Displacement that counts as motion, diameters.

    Raises
    ------
    SolverError
        If a table is cut short, grains are lost where none may be, or the counts do not reconcile.
    """
    looks = _looks(directory)
    travel = _travel(directory, grains, looks) / grains.diameter
    present = ~np.isnan(travel)
    passed = ~present | (travel >= marker)
    fallen = present & (travel <= -marker)
    _reconcile(directory, looks, passed, fallen)
    hold = looks["level"].to_numpy(np.int64)
    flow = looks.groupby("level")["flow"].first().to_numpy(float)
    return Motion(
        flow=np.concatenate([[SETTLE_FLOW * flow[0]], flow]),
        level=_first(passed, hold),
        fallen=_first(fallen, hold),
    )


def _first(happened: NDArray[np.bool_], hold: IntArray) -> IntArray:
    return np.where(happened.any(axis=0), hold[happened.argmax(axis=0)], 0)


def _looks(directory: Path) -> pd.DataFrame:
    path = directory / LEVELS
    try:
        looks = pd.read_csv(path)
        if looks.empty or not np.isfinite(looks.to_numpy(float)).all():
            raise ValueError("it holds no whole line")
        return looks
    except (OSError, ValueError) as error:
        raise SolverError(
            f"the table of holds cannot be read: {error}",
            where=str(path),
            remedy="run the same command again",
        ) from None


def _travel(directory: Path, grains: GrainTable, looks: pd.DataFrame) -> FloatArray:
    """Displacement along the bed at each look, m, shape (looks, N); NaN for a grain that is gone.

    The dump begins with the grains' places after settling.
    """
    path = directory / PASSAGE
    frames = read_dump(path, ("id", "x", "z"))
    ids = grains.counted_ids
    steps = np.concatenate([[frames["step"].min()], looks["step"]])
    started = frames.loc[frames["step"] == steps[0], "id"]
    if not np.array_equal(started, ids):
        raise SolverError(
            f"{len(ids) - len(started)} of {len(ids)} grains were lost before the flow rose",
            where=str(path),
            remedy="a smaller protocol.timestep, or look for grains that overlap",
        )
    row, column = np.searchsorted(steps, frames["step"]), np.searchsorted(ids, frames["id"])
    known = np.isin(frames["step"], steps) & np.isin(frames["id"], ids)
    if not known.all():
        raise SolverError("it is not of these grains and holds", where=str(path))
    place = np.full((len(steps), len(ids), 2), np.nan)
    place[row, column] = frames[["x", "z"]]
    along = grains.along[ids - 1]
    return np.asarray(np.einsum("tnk,nk->tn", place[1:] - place[0], along))


def _reconcile(
    directory: Path,
    looks: pd.DataFrame,
    passed: NDArray[np.bool_],
    fallen: NDArray[np.bool_],
) -> None:
    """Moved + not moved = N at each look, by the deck's own count and by the grains' places."""
    lying = looks["lying"].to_numpy(float) == (~passed).sum(axis=1)
    back = looks["fallen"].to_numpy(float) == fallen.sum(axis=1)
    if not (lying & back).all():
        number = int(np.argmin(lying & back))
        raise SolverError(
            f"the counts do not reconcile at look {number + 1}",
            where=str(directory / LEVELS),
            remedy="grains were lost, or the tables are of different runs",
        )


def read_dump(path: Path, columns: tuple[str, ...]) -> pd.DataFrame:
    """Read a LIGGGHTS text dump.

    Parameters
    ----------
    path : Path
        The dump.
    columns : tuple of str
        Its columns, in order.

    Returns
    -------
    pandas.DataFrame
        A row for each grain and frame, with the frame's time step in the column ``step``.

    Raises
    ------
    SolverError
        If it is missing, cut short or not a dump of these columns.
    """
    try:
        text = path.read_text(encoding="ascii")
        frames = text.split("ITEM: TIMESTEP\n")[1:]
        heads = [frame.split("\n", 8) for frame in frames]
        steps = np.array([int(head[0]) for head in heads])
        counts = np.array([int(head[2]) for head in heads])
        body = "".join(head[8] for head in heads)
        table = pd.read_csv(StringIO(body), sep=r"\s+", names=list(columns), header=None)
        if len(table) != counts.sum() or table.isna().any(axis=None):
            raise ValueError("it is cut short or holds NaN")
    except (OSError, ValueError, IndexError) as error:
        raise SolverError(
            f"the dump cannot be read: {error}", where=str(path), remedy="run the case again"
        ) from None
    return table.assign(step=np.repeat(steps, counts))
