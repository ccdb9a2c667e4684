"""A surface under the winds of some directions: what lies on it, and where it moves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.physics.beside import ENTRAINED as ENTRAINMENT
from orchestrator.physics.beside import SUSTAINED as SUSTAINED_MOTION
from orchestrator.physics.beside import beside
from orchestrator.physics.constants import GAS_BELOW, GRAIN_COLUMNS
from orchestrator.physics.grain import Grain
from orchestrator.physics.onset import of_grains
from orchestrator.physics.threshold import check_known
from orchestrator.surface import onset
from orchestrator.surface.heights import Plane, Surface
from orchestrator.surface.maps import MapGrid
from orchestrator.surface.mesh import wind_axes
from orchestrator.surface.onset import Shares
from orchestrator.surface.rose import MOST_APART_DEG, SolvedRose
from orchestrator.surface.stress import SurfaceStress
from orchestrator.types import FloatArray

MOVES = "wind_m_s"
ENTRAINED, SUSTAINED = "wind_entrained_m_s", "wind_sustained_m_s"
"""Columns of faces: winds in which a grain moves, leaves its pocket, and goes on."""
RATIO = "ustar_over_ustar0"
HEAP = "heap"
"""Column of faces: the number of the heap that a face is on, 0 for the ground."""
LEAST, HOURS = "least_wind_m_s", "hours_a_year"
"""Maps of the least wind of all directions, and of the hours a year."""
STARTS = "starts, m/s"
FIRST_ENTRAINED = "first entrained, m/s"
"""Columns of directions: wind in which motion starts, and the first grains leave."""
ASKED_SHARES = (0.1, 0.5)
"""Shares of the surface whose winds the answer has."""
OF_CURRENT = {
    MOVES: "current_m_s",
    ENTRAINED: "current_entrained_m_s",
    SUSTAINED: "current_sustained_m_s",
    LEAST: "least_current_m_s",
}
"""What tables and maps call those columns in a liquid."""
PER_CELL = 2.0
"""Steps of the raster of maps in a cell of the flow, at least."""


class Stream(NamedTuple):
    """What flows over a surface.

    Attributes
    ----------
    word
        The word for it.
    height
        Height above flat ground at which its speed is told, m.
    columns
        Names of columns in files, by those here, where they are others.
    """

    word: str
    height: float
    columns: Mapping[str, str]

    @property
    def at(self) -> str:
        """Its speed in words."""
        return f"{self.word} at {self.height:g} m"


WIND = Stream("wind", onset.WIND_HEIGHT, {})
CURRENT = Stream("current", 1.0, OF_CURRENT)


@dataclass(frozen=True)
class Ground:
    """What lies on a surface: one grain, and the force law or a given threshold.

    Attributes
    ----------
    grain
        The grain in its pocket.
    law
        Name of the force law.
    roughness
        Roughness length of the ground under the wind, m.
    is_natural
        Whether grains count that go on, as in natural fluids, or all that leave.
    threshold
        u*_t of every face, m/s; None for the closed form.
    """

    grain: Grain
    law: str
    roughness: float
    is_natural: bool = True
    threshold: float | None = None

    def winds(self, local: FloatArray, ratio: FloatArray) -> FloatArray:
        """Give the winds at which local friction velocities are reached.

        Parameters
        ----------
        local
            Friction velocity on each face, m/s, (F,).
        ratio
            Friction velocity on each face over that of flat ground, (F,).

        Returns
        -------
        ndarray
            Speed of the `stream`, m/s, (F,).
        """
        upstream = onset.undisturbed(local, ratio)
        return onset.wind_of(upstream, self.roughness, self.stream.height)

    @property
    def stream(self) -> Stream:
        """What flows over the ground: a wind, or in a liquid a current."""
        return WIND if self.grain.fluid_density < GAS_BELOW else CURRENT

    @property
    def level_ustar(self) -> float:
        """Friction velocity at which the grain moves on flat ground, m/s."""
        if self.threshold is not None:
            return self.threshold
        level = np.zeros(1)
        leaving, going = self._local(level, level)
        return float((going if self.is_natural else leaving)[0])

    @property
    def flat(self) -> float:
        """Speed of the `stream` at which the grain moves on flat ground, m/s."""
        speed = onset.wind_of(self.level_ustar, self.roughness, self.stream.height)
        return float(speed)

    @cached_property
    def factors(self) -> tuple[float, float]:
        """Ends of the tested interval of the grain on flat ground, over its u*.

        They are NaN for a given threshold, and where nothing near was measured.
        """
        if self.threshold is not None:
            return float("nan"), float("nan")
        columns = {
            column: np.array([getattr(self.grain, name)], float)
            for name, column in GRAIN_COLUMNS.items()
        }
        criterion = SUSTAINED_MOTION if self.is_natural else ENTRAINMENT
        at = of_grains(Grain.of_table(columns), self.law, criterion)
        table: dict[str, Any] = {**columns, "shields": at.shields}
        table |= {"reynolds": at.reynolds, "force_law": [self.law]}
        table["criterion"] = [criterion]
        held = beside(table)
        if not held["tested_rows"][0]:
            return float("nan"), float("nan")
        ends = [held[name][0] / at.shields[0] for name in ("tested_low", "tested_high")]
        return float(np.sqrt(ends[0])), float(np.sqrt(ends[1]))

    def faces(
        self, stress: SurfaceStress, from_deg: float, plane: Plane
    ) -> pd.DataFrame:
        """List the faces of a bed with the wind at which each moves.

        Parameters
        ----------
        stress
            The stress on them by the flow of one direction.
        from_deg
            Where the wind comes from, degrees.
        plane
            The ground; its fall is not in the flow, but grains feel it.

        Returns
        -------
        DataFrame
            A row for each face: place, area, slope, slope along the wind, angle of the
            stress to the way up the slope, u*/u*_0, and the wind `MOVES`; with the
            closed form also `ENTRAINED` and `SUSTAINED`, NaN where grains lie loose.
        """
        normal, tau = onset.with_fall(
            stress.normal, stress.tau, plane.east, plane.north
        )
        slope = onset.slopes_deg(normal)
        heading = onset.headings_deg(normal, tau)
        ratio = stress.ustar_over_ustar0
        columns = {
            "x_m": stress.x_m,
            "y_m": stress.y_m,
            "z_m": stress.z_m,
            "along_m": stress.along_m,
            "across_m": stress.across_m,
            "area_m2": stress.area_m2,
            "slope_deg": slope,
            "uphill": -(stress.normal[:, :2] @ wind_axes(from_deg)[0]),
            "heading_deg": heading,
            RATIO: ratio,
        }
        if self.threshold is not None:
            local = np.full_like(ratio, self.threshold)
            return pd.DataFrame({**columns, MOVES: self.winds(local, ratio)})
        leaving, going = self._local(slope, heading)
        columns |= {
            ENTRAINED: self.winds(leaving, ratio),
            SUSTAINED: self.winds(going, ratio),
        }
        columns[MOVES] = columns[SUSTAINED] if self.is_natural else columns[ENTRAINED]
        return pd.DataFrame(columns)

    def _local(
        self, slope: FloatArray, heading: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Local u* at which a grain leaves, and goes on, m/s; NaN where it is loose."""
        leaving = onset.entrained(self.grain, self.law, slope, heading)
        check_known(leaving, self.law)
        is_loose = leaving == 0
        going = onset.sustained(self.grain, leaving, slope, heading)
        return np.where(is_loose, np.nan, leaving), np.where(is_loose, np.nan, going)


@dataclass(frozen=True)
class Direction:
    """A bed under the wind of one direction.

    Attributes
    ----------
    from_deg
        Where the wind comes from, degrees.
    every
        All faces, also those of the flat ground.
    stream
        What flows.
    """

    from_deg: float
    every: pd.DataFrame
    stream: Stream = WIND

    @classmethod
    def of(
        cls,
        ground: Ground,
        stress: SurfaceStress,
        from_deg: float,
        surface: Surface,
    ) -> "Direction":
        """Put the faces of a flow on the heaps of its surface.

        Parameters
        ----------
        ground
            What lies on the surface.
        stress
            The stress on the faces.
        from_deg
            Where the wind comes from, degrees.
        surface
            The surface as it was read.

        Returns
        -------
        Direction
            The direction, each face with its heap.
        """
        every = ground.faces(stress, from_deg, surface.ground)
        every[HEAP] = surface.heap_at(stress.x_m, stress.y_m)
        return cls(from_deg, every, ground.stream)

    @cached_property
    def form(self) -> pd.DataFrame:
        """The faces of all heaps."""
        return self.every[self.every[HEAP] > 0]

    @property
    def area(self) -> float:
        """Area of all heaps as it lies, m2."""
        return float(self.form["area_m2"].sum())

    @cached_property
    def faces(self) -> pd.DataFrame:
        """The faces of the heaps on which grains lie."""
        return self.form[self.form[MOVES].notna()]

    @property
    def loose(self) -> float:
        """Share of the heaps on which grains roll without a flow."""
        is_loose = self.form[MOVES].isna()
        area = self.form["area_m2"]
        return float(area[is_loose].sum() / area.sum())

    def shares(self, column: str = MOVES) -> Shares:
        """Give the share of the heaps that moves, against the wind.

        Parameters
        ----------
        column
            The column of the faces with the wind at which each moves.

        Returns
        -------
        Shares
            Winds, and the share of the area that moves in each.
        """
        wind = self.faces[column].fillna(np.inf).to_numpy(float)
        return Shares.of(wind, self.faces["area_m2"].to_numpy(float))

    @property
    def first(self) -> "pd.Series[float]":
        """The face that moves first."""
        return self.faces.iloc[int(self.faces[MOVES].to_numpy(float).argmin())]

    @cached_property
    def starts(self) -> float:
        """Wind at which motion starts, m/s."""
        return self.shares().wind_for(onset.STARTS)

    @property
    def entrained(self) -> float | None:
        """Wind in which the first grains leave without gusts, m/s; None if that is one.

        It is the wind in which motion starts where no grain goes on.
        """
        if ENTRAINED not in self.faces or self.faces[ENTRAINED].equals(
            self.faces[MOVES]
        ):
            return None
        return self.shares(ENTRAINED).wind_for(onset.STARTS)

    @property
    def word(self) -> str:
        """The direction in names of files."""
        return f"{self.from_deg:g}"

    @property
    def title(self) -> str:
        """The direction in words."""
        return f"{self.stream.word} from {self.from_deg:g}°"

    def row(self) -> dict[str, Any]:
        """Give the numbers of the direction.

        Returns
        -------
        dict of str to object
            A row of the table of directions, by column.
        """
        shares = self.shares()
        first = self.first
        row = {
            "from_deg": self.from_deg,
            STARTS: self.starts,
            "x_m": first["x_m"],
            "y_m": first["y_m"],
            "z_m": first["z_m"],
        }
        for share in ASKED_SHARES:
            row[_of(share)] = shares.wind_for(share)
        if ENTRAINED in self.faces:
            leaving = self.shares(ENTRAINED)
            row[FIRST_ENTRAINED] = leaving.wind_for(onset.STARTS)
            row["half entrained, m/s"] = leaving.wind_for(0.5)
        area = self.faces["area_m2"]
        ratio = self.faces[RATIO]
        row["mean u*/u*₀"] = float(np.average(ratio, weights=area))
        row["largest u*/u*₀"] = float(ratio.max())
        row["loose, %"] = 100 * self.loose
        row["area, m²"] = self.area
        return row


@dataclass(frozen=True)
class SurfaceAnswer:
    """A surface with what lies on it under the winds of some directions.

    Attributes
    ----------
    name
        The bed in a few words.
    surface
        The surface as it was read.
    ground
        What lies on it.
    directions
        The winds.
    cell_m
        Length of the flow's cells over the form, m.
    rose
        The wind rose with its flows; None without one.
    """

    name: str
    surface: Surface
    ground: Ground
    directions: Sequence[Direction]
    cell_m: float
    rose: SolvedRose | None = None

    @cached_property
    def smooth(self) -> Surface:
        """The surface as the flow has it."""
        return self.surface.smoothed(self.cell_m)

    @cached_property
    def grid(self) -> MapGrid:
        """The raster of the maps: nodes of the file, as near as the flow has detail."""
        axes = []
        steps = self.surface.steps
        for axis, step in zip((self.surface.x, self.surface.y), steps, strict=True):
            every = max(int(self.cell_m / PER_CELL / step), 1)
            axes.append(axis[::every])
        x, y = axes
        height = self.smooth.at(x, y[:, None])
        east, north = np.broadcast_arrays(x, y[:, None])
        return MapGrid(x, y, height, self.surface.heap_at(east, north) > 0)

    @cached_property
    def easiest(self) -> Direction:
        """The direction from which motion starts at the least wind."""
        return min(self.directions, key=lambda each: each.starts)

    @cached_property
    def maps(self) -> Mapping[str, FloatArray]:
        """The maps by name: of each direction, the least wind of all, and hours."""
        found = {}
        for each in self.directions:
            columns = [
                c for c in (RATIO, MOVES, ENTRAINED, SUSTAINED) if c in each.every
            ]
            for column, values in self.grid.of_faces(each.every, columns).items():
                found[f"{column}-{each.word}"] = values
        winds = [found[f"{MOVES}-{each.word}"] for each in self.directions]
        found[LEAST] = np.fmin.reduce(winds)
        if self.rose is not None:
            ways = [each.from_deg for each in self.directions]
            by_way = dict(zip(ways, winds, strict=True))
            found[HOURS] = onset.hours(by_way, self.rose.table)
        return found

    def hours_of(
        self, share: float, factor: float = 1.0, rows: pd.DataFrame | None = None
    ) -> float:
        """Give the hours a year in which at least a share of the surface moves.

        Parameters
        ----------
        share
            Share of the area, 0 to 1.
        factor
            What the winds in which it moves are multiplied by.
        rows
            Winds of its rose; None for all.

        Returns
        -------
        float
            Hours a year, all these winds together.
        """
        assert self.rose is not None
        winds = {
            each.from_deg: np.array([each.shares().wind_for(share)])
            for each in self.directions
        }
        table = self.rose.table if rows is None else rows
        return float(onset.hours(winds, table, factor)[0])

    def left_out(self, share: float) -> "LeftOut | None":
        """Find how far flows between others are met, each left out once.

        Parameters
        ----------
        share
            The share of the area whose wind is compared.

        Returns
        -------
        LeftOut or None
            The largest difference; None if no flow has two others within the angle over
            which they are interpolated.
        """
        ordered = sorted(self.directions, key=lambda each: each.from_deg)
        count = len(ordered)
        worst: LeftOut | None = None
        for place, each in enumerate(ordered):
            before, behind = ordered[place - 1], ordered[(place + 1) % count]
            gap = (behind.from_deg - before.from_deg) % 360
            if count < 3 or not 0 < gap <= MOST_APART_DEG:
                continue
            part = ((each.from_deg - before.from_deg) % 360) / gap
            winds = [one.shares().wind_for(share) for one in (before, behind, each)]
            met = float(onset.interpolated(winds[0], winds[1], part))
            off = abs(met / winds[2] - 1)
            if worst is None or off > worst.off:
                worst = LeftOut(off, each.from_deg, gap)
        return worst


class LeftOut(NamedTuple):
    """The flow that its neighbours meet worst.

    Attributes
    ----------
    off
        Relative difference of the wind.
    from_deg
        Its direction, degrees.
    gap
        The angle between the neighbours, degrees.
    """

    off: float
    from_deg: float
    gap: float


def _of(share: float) -> str:
    """The column of the wind in which a share of the surface moves."""
    return f"{percent(share)}, m/s"
