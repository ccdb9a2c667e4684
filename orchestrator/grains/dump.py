"""Files of LIGGGHTS on the grains: its text dumps, and the track of the counted grains."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.bed.packing import across
from orchestrator.errors import Exploded, SolverError
from orchestrator.grains.deck import GrainTable

FloatArray = NDArray[np.float64]

PASSAGE = "passage.dump"
BED = "bed.dump"
PASSAGE_COLUMNS = ("id", "x", "z", "vx", "vz", "omegay", "y")
BED_COLUMNS = ("id", "type", "x", "z", "vx", "vz", "omegay")


@dataclass(frozen=True)
class Track:
    """The counted grains at each sample; arrays of shape (T, N), NaN for a grain that is gone.

    Attributes
    ----------
    travel, rise : ndarray
        Displacement since the settling, along the bed as the flow goes and normal to it, in the
        grain's own diameter.
    aside : ndarray
        The same across the flow, whichever way.
    roll : ndarray
        Speed of the surface by spinning over the speed of the centre: 1 for pure rolling.
    """

    travel: FloatArray
    rise: FloatArray
    aside: FloatArray
    roll: FloatArray


def read_track(directory: Path, grains: GrainTable, samples: pd.DataFrame) -> Track:
    """Read what the counted grains did at each sample; arguments as in `read_passage`."""
    ids = grains.counted_ids
    state = read_passage(directory, ids, samples)
    width = grains.diameter * grains.width
    return _track(state, grains.along[ids - 1], grains.diameter * grains.sizes[ids - 1], width)


def read_passage(directory: Path, ids: NDArray[np.int64], samples: pd.DataFrame) -> FloatArray:
    """Read ``passage.dump``: x, z, vx, vz, omegay and y of the counted grains, shape (6, T + 1, N).

    First after settling, then at each sample. NaN of a grain that is gone; one that the deck does
    not list and that ``bed.dump`` has at the end of the load step is at rest where it had settled.

    Parameters
    ----------
    directory : Path
        The case.
    ids : ndarray of int, shape (N,)
        Ids of the counted grains, rising.
    samples : DataFrame
        The deck's table of samples, T rows.

    Raises
    ------
    SolverError
        If a dump is not one of these grains and samples.
    Exploded
        If it holds none of them.
    """
    path = directory / PASSAGE
    dump = read_dump(path, PASSAGE_COLUMNS)
    if not np.array_equal(dump.steps[1:], samples["step"]):
        raise SolverError(
            "its samples are not those of samples.csv", where=str(path), remedy="run the case again"
        )
    rows = dump.rows
    if rows.empty or not rows["id"].isin(ids).all():
        remedy = "a smaller protocol.time_step, or look for grains that overlap"
        if rows.empty:
            raise Exploded("every counted grain was lost", where=str(path), remedy=remedy)
        raise SolverError(
            "it lists grains that are not counted", where=str(path), remedy="run the case again"
        )
    state = np.full((len(PASSAGE_COLUMNS) - 1, len(dump.steps), len(ids)), np.nan)
    row, column = np.searchsorted(dump.steps, rows["step"]), np.searchsorted(ids, rows["id"])
    for part, name in zip(state, PASSAGE_COLUMNS[1:], strict=True):
        part[row, column] = rows[name]
    listed = ~np.isnan(state[0, 1:])
    resting = ~listed & _there(listed, _left(directory, ids, samples), samples)
    for part, still in zip(state, (*state[:2, 0], 0.0, 0.0, 0.0, state[5, 0]), strict=True):
        np.copyto(part[1:], still, where=resting)
    return state


def _left(directory: Path, ids: NDArray[np.int64], samples: pd.DataFrame) -> NDArray[np.bool_]:
    """Which counted grains there were at the end of each load step, shape (load steps, N)."""
    bed = read_dump(directory / BED, BED_COLUMNS)
    ends = samples.groupby("load_step")["step"].last().to_numpy(np.int64)
    if not np.array_equal(bed.steps, ends):
        raise SolverError(
            "its frames are not the ends of the load steps",
            where=str(directory / BED),
            remedy="run the case again",
        )
    rows = bed.rows[bed.rows["id"].isin(ids)]
    found = np.zeros((len(ends), len(ids)), bool)
    found[np.searchsorted(ends, rows["step"]), np.searchsorted(ids, rows["id"])] = True
    return found


def _there(
    listed: NDArray[np.bool_], left: NDArray[np.bool_], samples: pd.DataFrame
) -> NDArray[np.bool_]:
    """Which grains were there at each sample: listed ones, or seen later in the load step."""
    found = np.empty_like(listed)
    for left_then, (_, one) in zip(left, samples.reset_index().groupby("load_step"), strict=True):
        rows = one.index
        found[rows] = np.logical_or.accumulate(listed[rows][::-1])[::-1] | left_then
    return found


def _track(state: FloatArray, along: FloatArray, diameter: FloatArray, width: float = 0.0) -> Track:
    right, up = (state[:2, 1:] - state[:2, :1]) / diameter
    vx, vz, spin, y = state[2:, 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        roll = np.abs(spin) * diameter / 2 / np.hypot(vx, vz)
    return Track(
        travel=right * along[:, 0] + up * along[:, 1],
        # out of the bed, whichever way is along it
        rise=np.sign(along[:, 0]) * (up * along[:, 0] - right * along[:, 1]),
        aside=np.abs(across(y - state[5, :1], width)) / diameter,
        roll=roll,
    )


def last_places(directory: Path) -> pd.DataFrame:
    """X and z (m) of the mobile grains that are there at the end of a run, by their ids."""
    bed = read_dump(directory / BED, BED_COLUMNS)
    last: pd.DataFrame = bed.rows[bed.rows["step"] == bed.steps[-1]]
    return last.set_index("id")[["x", "z"]]


@dataclass(frozen=True)
class Dump:
    """A text dump.

    Attributes
    ----------
    steps : ndarray of int
        Time step of each frame, also of those without a grain.
    rows : pandas.DataFrame
        A row for each grain and frame, with the frame's time step in the column ``step``.
    """

    steps: NDArray[np.int64]
    rows: pd.DataFrame


def read_dump(path: Path, columns: tuple[str, ...]) -> Dump:
    """Read a LIGGGHTS text dump.

    Parameters
    ----------
    path : Path
        The dump.
    columns : tuple of str
        Its columns, in order.

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
        whole = text.endswith("\n") and len(table) == counts.sum()
        if not whole or table.isna().any(axis=None):
            raise ValueError("it is cut short or holds NaN")
    except (OSError, ValueError, IndexError) as error:
        raise SolverError(
            f"the dump cannot be read: {error}", where=str(path), remedy="run the case again"
        ) from None
    return Dump(steps, table.assign(step=np.repeat(steps, counts)))
