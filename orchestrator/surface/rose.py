"""Wind roses: the share of time of each direction and speed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import SLACK
from orchestrator.errors import InputError
from orchestrator.physics.velocity import log_law_speed, log_law_ustar
from orchestrator.runs.files import digest_text
from orchestrator.study.wind import question_of, read_winds
from orchestrator.surface.onset import WIND_HEIGHT
from orchestrator.types import BoolArray, FloatArray

COLUMNS = ("from_deg", "speed_m_s", "share")
FLOWS = ("first_deg", "second_deg", "second_part")
"""Columns of the flows beside a direction."""
MOST_APART_DEG = 90.0
"""Largest angle between two flows that are interpolated."""
WIDEST_PART_DEG = 5.0
"""Width of the parts of a sector, at most."""
LOWEST = 10.0
"""Least height of winds over the roughness length of the ground."""
FURTHEST_DEG = 30.0
"""Largest angle between a direction of a rose and the nearest flow, where none lie on
both sides of it."""
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
        return question_of(self.rows, self.name)

    def solved(
        self, flows: Sequence[float], where: str, roughness: float, height: float
    ) -> "SolvedRose":
        """Put its winds between the flows that answer them, at 10 m.

        A direction stands for its sector of the rose, which is divided into parts. In
        each the flow is interpolated between the two beside it, where these are near
        enough; beyond the last flow it is that one.

        Parameters
        ----------
        flows
            Directions of the flows, degrees, in any order.
        where
            The field that names the rose, for messages.
        roughness
            Roughness length of the ground, m: by its log law winds go to 10 m.
        height
            Height of the winds, m.

        Returns
        -------
        SolvedRose
            The rose with the flows of each wind.

        Raises
        ------
        InputError
            If no flow is near a direction in which the wind blows, or the winds were
            measured among the elements of the ground.
        """
        if height < LOWEST * roughness:
            what = f"winds {height:g} m above ground of z0 = {roughness:g} m"
            remedy = f"the log law needs {LOWEST:g} z0 at least"
            raise InputError(what, where, remedy)
        factor = 1.0
        if height != WIND_HEIGHT:
            ustar = log_law_ustar(1.0, height, roughness)
            factor = float(log_law_speed(ustar, WIND_HEIGHT, roughness))
        table = pd.DataFrame(self.rows, columns=[*COLUMNS])
        directions = table["from_deg"].to_numpy(float)
        around = np.sort(np.asarray(flows, float))
        blows = (table["share"] > 0) & (table["speed_m_s"] > 0)
        _check_flows(directions[blows], around, where)
        middles, width = _sectors(directions, table["speed_m_s"].to_numpy(float) > 0)
        table["middle"] = middles
        parts = _parts(np.unique(middles), width, around)
        listed = table.merge(parts, on="middle", sort=False)
        listed["from_deg"] = listed["part_deg"]
        listed["share"] *= listed["part"]
        listed["speed_m_s"] *= factor
        listed = listed[[*COLUMNS]]
        between = _between(listed["from_deg"].to_numpy(float), around)
        return SolvedRose(self, pd.concat([listed, between], axis=1), height, factor)


class SolvedRose(NamedTuple):
    """A rose with the flows that answer its winds.

    Attributes
    ----------
    rose
        The rose.
    table
        The columns `COLUMNS`, at 10 m, and `FLOWS`: the two flows beside each
        direction, degrees, and the part of the second one.
    height
        Height of the speeds in its file, m.
    factor
        Speeds at 10 m over those in its file.
    """

    rose: Rose
    table: pd.DataFrame
    height: float
    factor: float

    @property
    def by_flow(self) -> pd.DataFrame:
        """Speeds and shares by the flow that answers a part of each, ``solved_deg``."""
        first, second, part = (self.table[name] for name in FLOWS)
        own = self.table[[*COLUMNS]]
        one = own.assign(solved_deg=first, share=own["share"] * (1 - part))
        other = own.assign(solved_deg=second, share=own["share"] * part)
        both = pd.concat([one, other], ignore_index=True)
        return both[both["share"] > 0].reset_index(drop=True)

    @property
    def said(self) -> str:
        """How its winds come to 10 m, in words."""
        if self.height == WIND_HEIGHT:
            return f"Winds of {self.rose.name} are taken as those at 10 m."
        return (
            f"Winds of {self.rose.name} are {self.height:g} m above the ground: by the "
            f"log law over the ground's z₀ they are {self.factor:.3g} times as strong "
            "at 10 m."
        )


def _parts(middles: FloatArray, width: float, flows: FloatArray) -> pd.DataFrame:
    """The parts of sectors about their middles: their directions, degrees, and sizes.

    None reaches beyond a flow: over each what is interpolated is linear.
    """
    count = max(int(np.ceil(width / WIDEST_PART_DEG - SLACK)), 1)
    even = np.linspace(-width / 2, width / 2, count + 1)
    rows = []
    for middle in middles:
        off = _turned(flows - middle, 360)
        edges = np.union1d(even, off[np.abs(off) < width / 2])
        sizes = np.diff(edges)
        of_part = zip(edges[:-1] + sizes / 2, sizes, strict=True)
        rows += [
            (middle, (middle + place) % 360, size / width) for place, size in of_part
        ]
    return pd.DataFrame(rows, columns=["middle", "part_deg", "part"])


def _between(directions: FloatArray, flows: FloatArray) -> pd.DataFrame:
    """The flows beside each direction, and the part of the second one: 0 to 1."""
    place = np.searchsorted(flows, directions, side="right")
    first = flows[place - 1]
    second = flows[place % len(flows)]
    gap = (second - first) % 360
    off = (directions - first) % 360
    part = np.divide(off, gap, out=np.zeros_like(off), where=gap > 0)
    # too far apart, or one flow alone: the nearest
    is_far = (gap > MOST_APART_DEG) | (gap == 0)
    part = np.where(is_far, np.where(off > gap / 2, 1.0, 0.0), part)
    part = np.where(gap == 0, 0.0, part)
    return pd.DataFrame(dict(zip(FLOWS, (first, second, part), strict=True)))


def _turned(angles: FloatArray, turn: float) -> FloatArray:
    """Angles less whole turns, from -turn/2 to turn/2."""
    return np.asarray((angles + turn / 2) % turn - turn / 2)


def _check_flows(directions: FloatArray, flows: FloatArray, where: str) -> None:
    """Refuse a rose with a direction that is far off all flows, and between none."""
    off = np.abs(_turned(directions[:, None] - flows, 360)).min(axis=1)
    place = np.searchsorted(flows, directions, side="right")
    gap = (flows[place % len(flows)] - flows[place - 1]) % 360
    is_between = (gap > 0) & (gap <= MOST_APART_DEG)
    off = np.where(is_between, 0.0, off)
    worst = int(off.argmax())
    if off[worst] > FURTHEST_DEG:
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
        The rose, with a question where its mean is likelier in another unit.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    winds = read_winds(text, where)
    digest = digest_text(repr((winds.rows, winds.height)))
    return Rose(name, winds.rows, digest, winds.understood, winds.height)
