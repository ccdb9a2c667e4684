"""Wind roses: the share of time of each direction and speed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from orchestrator.errors import InputError
from orchestrator.runs.files import digest_text
from orchestrator.study.wind import read_winds
from orchestrator.types import BoolArray, FloatArray

COLUMNS = ("from_deg", "speed_m_s", "share")
WINDIEST = 20.0
"""Mean speed above which it is likelier in another unit, m/s: Cape Denison, of the
windiest places, has 19."""
FURTHEST_DEG = 30.0
"""Largest angle between a direction of a rose and the nearest flow."""
SECTORS = (4, 8, 12, 16, 24, 32, 36, 72, 360)
"""Numbers of sectors of a rose, the widest sectors first."""
SURELY = 12
"""From so many sectors on, a rose may leave sectors out: these are narrow."""
ROUNDED_DEG = 0.5 + 1e-6
"""Largest angle between a direction as it is written and the middle of its sector:
compass points are written in whole degrees."""


@dataclass(frozen=True)
class Rose:
    """A wind rose; two with one digest are one.

    Attributes
    ----------
    name
        The name of its file.
    rows
        Where the wind comes from, degrees from 0 to 360, speed, m/s, and share of time;
        the shares add up to 1.
    digest
        SHA-256 of the rows.
    understood
        What was understood of its file, in words.
    height
        Height of its speeds above the ground, m; None where its file says none.
    """

    name: str = field(compare=False)
    rows: tuple[tuple[float, float, float], ...] = field(compare=False, repr=False)
    digest: str
    understood: str = field(default="", compare=False)
    height: float | None = field(default=None, compare=False)

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"

    @property
    def question(self) -> str:
        """A question on speeds that are likelier in another unit; empty for none."""
        mean = sum(speed * share for _, speed, share in self.rows)
        if mean <= WINDIEST:
            return ""
        what = f"the wind of {self.name} is {mean:.3g} m/s in the mean"
        return f"{what}: did you mean km/h, {mean / 3.6:.3g} m/s?"

    def table(self, solved: Sequence[float], where: str) -> pd.DataFrame:
        """List the rose with the directions of the flows that answer each row.

        A direction stands for its sector of the rose, and a flow for all directions to
        which it is the nearest. A row is shared by the flows in the parts of its sector
        that are theirs.

        Parameters
        ----------
        solved
            Directions of the flows, degrees, in any order.
        where
            The field that names the rose, for messages.

        Returns
        -------
        DataFrame
            The columns `COLUMNS` and `solved_deg`; a row of the rose that several flows
            answer has a row for each, with a part of its share.

        Raises
        ------
        InputError
            If no flow is near a direction in which the wind blows.
        """
        table = pd.DataFrame(self.rows, columns=[*COLUMNS])
        directions = table["from_deg"].to_numpy(float)
        flows = np.sort(np.asarray(solved, float))
        blows = (table["share"] > 0) & (table["speed_m_s"] > 0)
        _check_flows(np.where(blows, _off(directions, flows), 0.0), directions, where)
        middles, width = _sectors(directions, table["speed_m_s"].to_numpy(float) > 0)
        parts = _parts(middles, width, flows)
        of_row, of_flow = np.nonzero(parts)
        listed = table.iloc[of_row].reset_index(drop=True)
        listed["share"] *= parts[of_row, of_flow]
        listed["solved_deg"] = flows[of_flow]
        return listed


def _turned(angles: FloatArray, turn: float) -> FloatArray:
    """Angles less whole turns, from -turn/2 to turn/2."""
    return np.asarray((angles + turn / 2) % turn - turn / 2)


def _off(directions: FloatArray, flows: FloatArray) -> FloatArray:
    """Angle between each direction and the nearest flow, degrees."""
    return np.asarray(np.abs(_turned(directions[:, None] - flows, 360)).min(axis=1))


def _check_flows(off_deg: FloatArray, directions: FloatArray, where: str) -> None:
    """Refuse a rose with a direction that is far off all flows."""
    worst = int(off_deg.argmax())
    if off_deg[worst] > FURTHEST_DEG:
        what = f"no flow is within {FURTHEST_DEG:g} deg of {directions[worst]:g}"
        remedy = 'list more directions: "flow.from_deg" = [0, 45, 90, ...]'
        raise InputError(what, where, remedy)


def _sectors(directions: FloatArray, blows: BoolArray) -> tuple[FloatArray, float]:
    """The middle of the sector of each direction, and the width of all, degrees.

    The sectors are the widest in whose middles all directions lie. Calms have none.
    """
    written = directions[blows]
    for count in SECTORS:
        width = 360 / count
        # the first sector may begin anywhere
        residuals = np.radians(written * count)
        turn = np.angle(np.exp(1j * residuals).sum())
        # without round-off, of which a flow beside the sector would get a part
        first = round(float(np.degrees(turn)) / count, 9)
        number = np.round((directions - first) / width)
        middles = first + width * number
        is_near = np.abs(written - middles[blows]) <= ROUNDED_DEG
        is_whole = len(np.unique(number[blows] % count)) == count
        if is_near.all() and (is_whole or count >= SURELY):
            break
    return np.asarray(middles), width


def _parts(middles: FloatArray, width: float, flows: FloatArray) -> FloatArray:
    """The part of each sector that is nearest to each flow, of shape (rows, flows)."""
    turns = 360 * np.arange(-2, 3)
    around = np.concatenate([flows[-1:] - 360, flows, flows[:1] + 360])
    ends = (around[1:] + around[:-1]) / 2
    last = np.minimum(middles[:, None, None] + width / 2, ends[1:, None] + turns)
    first = np.maximum(middles[:, None, None] - width / 2, ends[:-1, None] + turns)
    overlap = np.maximum(last - first, 0.0).sum(axis=2)
    return np.asarray(overlap / overlap.sum(axis=1, keepdims=True))


def read_rose(text: str, name: str, where: str) -> Rose:
    """Read a wind rose.

    Parameters
    ----------
    text
        A file that `read_winds` reads.
    name
        The name of the file.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Rose
        The rose.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    winds = read_winds(text, where)
    digest = digest_text(repr((winds.rows, winds.height)))
    return Rose(name, winds.rows, digest, winds.understood, winds.height)
