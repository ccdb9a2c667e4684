"""From a raster to the wind at which each part of it moves.

OpenFOAM gives the stress on a bed in three dimensions for each direction of the wind,
the closed form the threshold of a grain on each of its faces.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas

from orchestrator import plan
from orchestrator.bed.raster import geotiff
from orchestrator.bed.surface import OF_GROUND, Surface
from orchestrator.experiments import surface_card
from orchestrator.experiments.erosion import given_threshold
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs
from orchestrator.experiments.surfaces import SurfaceScene, SurfaceStudy
from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.flow.mesh3 import LEVELS, wind_axes
from orchestrator.flow.surface_case import SURFACE_STRESS, SurfaceFlowCase
from orchestrator.flow.surface_stress import SurfaceStress
from orchestrator.grains import onset
from orchestrator.grains.onset import Shares
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.threshold import SingleGrain
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report import maps
from orchestrator.report.maps import Grid
from orchestrator.report.page import Section
from orchestrator.report.style import Figure
from orchestrator.study.scene import (
    SOLVE_VISCOSITY,
    VISCOUS_CELLS,
    default_first_cell_height,
)
from orchestrator.types import FloatArray

MOVES = "wind_m_s"
LEAVES, GOES_ON = "wind_leaves_m_s", "wind_goes_on_m_s"
"""Columns of faces: winds in which a grain moves, leaves its pocket, and goes on."""
RATIO = "ustar_over_ustar0"
LEAST, HOURS = "least_wind_m_s", "hours_a_year"
"""Maps of the least wind of all directions, and of the hours a year."""
STARTS = "starts, m/s"
FIRST_LEAVES = "first leaves, m/s"
"""Columns of directions: wind in which motion starts, and the first grains leave."""
WIND = "wind at 10 m, m/s,"
MOST_SHARE = 0.95
"""Share of the surface up to which it is drawn against the wind."""
ASKED_SHARES = (0.1, 0.5)
"""Shares of the surface whose winds the answer has."""
PER_CELL = 2.0
"""Steps of the raster of maps in a cell of the flow, at least."""


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

    grain: SingleGrain
    law: str
    roughness: float
    is_natural: bool = True
    threshold: float | None = None

    def winds(self, local: FloatArray, ratio: FloatArray) -> FloatArray:
        """Winds at 10 m at which local friction velocities are reached, m/s, (F,)."""
        return onset.wind_of(onset.undisturbed(local, ratio), self.roughness)

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
        """Wind at 10 m at which the grain moves on flat ground, m/s."""
        return float(onset.wind_of(self.level_ustar, self.roughness))

    def faces(self, stress: SurfaceStress, from_deg: float) -> pd.DataFrame:
        """List the faces of a bed with the wind at which each moves.

        Parameters
        ----------
        stress
            The stress on them by the flow of one direction.
        from_deg
            Where the wind comes from, degrees.

        Returns
        -------
        DataFrame
            A row for each face: place, area, slope, slope along the wind, angle of the
            stress to the way up the slope, u*/u*_0, and the wind `MOVES`; with the
            closed form also `LEAVES` and `GOES_ON`, NaN where grains lie loose.
        """
        slope = onset.slopes_deg(stress.normal)
        heading = onset.headings_deg(stress.normal, stress.tau)
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
            LEAVES: self.winds(leaving, ratio),
            GOES_ON: self.winds(going, ratio),
        }
        columns[MOVES] = columns[GOES_ON] if self.is_natural else columns[LEAVES]
        return pd.DataFrame(columns)

    def _local(
        self, slope: FloatArray, heading: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Local u* at which a grain leaves, and goes on, m/s; NaN where it is loose."""
        leaving = onset.leaves(self.grain, self.law, slope, heading)
        is_loose = leaving == 0
        going = onset.goes_on(self.grain, leaving, slope, heading)
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
    relief
        Height of the form, m.
    """

    from_deg: float
    every: pd.DataFrame
    relief: float

    @cached_property
    def form(self) -> pd.DataFrame:
        """The faces of the form."""
        return self.every[self.every["z_m"].abs() > OF_GROUND * self.relief]

    @cached_property
    def faces(self) -> pd.DataFrame:
        """The faces of the form on which grains lie."""
        return self.form[self.form[MOVES].notna()]

    @property
    def loose(self) -> float:
        """Share of the form on which grains roll without a flow."""
        is_loose = self.form[MOVES].isna()
        area = self.form["area_m2"]
        return float(area[is_loose].sum() / area.sum())

    def shares(self, column: str = MOVES) -> Shares:
        """The share of the form that moves, against the wind."""
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
    def leaves(self) -> float | None:
        """Wind in which the first grains leave without gusts, m/s; None if that is one.

        It is the wind in which motion starts where no grain goes on.
        """
        if LEAVES not in self.faces or self.faces[LEAVES].equals(self.faces[MOVES]):
            return None
        return self.shares(LEAVES).wind_for(onset.STARTS)

    @property
    def word(self) -> str:
        """The direction in names of files."""
        return f"{self.from_deg:g}"

    @property
    def title(self) -> str:
        """The direction in words."""
        return f"wind from {self.from_deg:g}°"

    def row(self) -> dict[str, Any]:
        """Its numbers, a row of the table of directions."""
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
        if LEAVES in self.faces:
            leaving = self.shares(LEAVES)
            row[FIRST_LEAVES] = leaving.wind_for(onset.STARTS)
            row["half leaves, m/s"] = leaving.wind_for(0.5)
        area = self.faces["area_m2"]
        ratio = self.faces[RATIO]
        row["mean u*/u*₀"] = float(np.average(ratio, weights=area))
        row["largest u*/u*₀"] = float(ratio.max())
        row["loose, %"] = 100 * self.loose
        return row


@dataclass(frozen=True)
class Answer:
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
        The table of a wind rose; None without one.
    """

    name: str
    surface: Surface
    ground: Ground
    directions: Sequence[Direction]
    cell_m: float
    rose: pd.DataFrame | None = None

    @cached_property
    def smooth(self) -> Surface:
        """The surface as the flow has it."""
        return self.surface.smoothed(self.cell_m)

    @cached_property
    def grid(self) -> Grid:
        """The raster of the maps: nodes of the file, as near as the flow has detail."""
        axes = []
        steps = self.surface.steps
        for axis, step in zip((self.surface.x, self.surface.y), steps, strict=True):
            every = max(int(self.cell_m / PER_CELL / step), 1)
            axes.append(axis[::every])
        x, y = axes
        height = self.smooth.at(x, y[:, None])
        is_form = np.abs(height) > OF_GROUND * self.smooth.relief
        return Grid(x, y, height, is_form)

    @cached_property
    def easiest(self) -> Direction:
        """The direction from which motion starts at the least wind."""
        return min(self.directions, key=lambda each: each.starts)

    @cached_property
    def maps(self) -> Mapping[str, FloatArray]:
        """The maps by name: of each direction, the least wind of all, and hours."""
        found = {}
        for each in self.directions:
            columns = [c for c in (RATIO, MOVES, LEAVES, GOES_ON) if c in each.every]
            for column, values in self.grid.of_faces(each.every, columns).items():
                found[f"{column}-{each.word}"] = values
        winds = [found[f"{MOVES}-{each.word}"] for each in self.directions]
        found[LEAST] = np.fmin.reduce(winds)
        if self.rose is not None:
            found[HOURS] = self._hours(winds)
        return found

    def _hours(self, winds: Sequence[FloatArray]) -> FloatArray:
        """The map of the hours a year in which each part moves."""
        assert self.rose is not None
        total = np.zeros_like(winds[0])
        for each, wind in zip(self.directions, winds, strict=True):
            total += onset.hours(wind, each.from_deg, self.rose)
        return total

    def hours_of(self, share: float) -> float:
        """Hours a year in which at least this share of the surface moves."""
        assert self.rose is not None
        total = 0.0
        for each in self.directions:
            wind = np.array([each.shares().wind_for(share)])
            total += float(onset.hours(wind, each.from_deg, self.rose)[0])
        return total


def _of(share: float) -> str:
    """The column of the wind in which a share of the surface moves."""
    return f"{share:.0%}, m/s"


def experiment(study: SurfaceStudy, out: Path) -> Experiment:
    """Make the experiment of a study on surfaces.

    Parameters
    ----------
    study
        The study.
    out
        The directory of the results.

    Returns
    -------
    Experiment
        Its runs, and what is made of them.

    Raises
    ------
    InputError
        If the threshold is no number or material, or the rose blows from where no flow
        is.
    """
    threshold, source = given_threshold(study.erosion.threshold, study.file)
    flows = {scene: flow_of(scene) for scene in study.scenes}
    members = alike(study.scenes)
    roses = {}
    for bare, scenes in members.items():
        if study.rose:
            directions = [scene.flow.from_deg for scene in scenes]
            where = f"{study.file}: erosion.wind"
            roses[bare] = study.rose.table(directions, where)

    def answers(runs: Runs) -> list[Answer]:
        found = []
        for bare, scenes in members.items():
            done = [scene for scene in scenes if flows[scene].name in runs.done]
            if not done:
                continue
            rose = roses.get(bare) if len(done) == len(scenes) else None
            found.append(_answer(done, flows, threshold, runs.cases, rose))
        return found

    def results(runs: Runs) -> Results:
        found = answers(runs)
        if not found:
            return {}, ()
        return tables(found), sections(found, source)

    planned = plan.Plan({}, {}, (), {}, plan.listed(flows.values()))
    return Experiment(
        "surface",
        study.title,
        planned,
        results,
        study.time_limit_s,
        source=study.source,
        files=lambda runs: files(answers(runs)),
    )


def flow_of(scene: SurfaceScene) -> SurfaceFlowCase:
    """The run of a scene."""
    roughness = scene.solve_roughness
    relief = scene.heights.relief
    asked = scene.method
    eddy = KARMAN * float(log_law_ustar(asked.speed, SPEED_HEIGHT * relief, roughness))
    viscous = (asked.viscosity or 0.0) / eddy
    cell = asked.first_cell_height
    cell = cell or default_first_cell_height(relief, roughness, viscous)
    most = eddy * cell / VISCOUS_CELLS
    viscosity = asked.viscosity or min(SOLVE_VISCOSITY, float(f"{most:.3g}"))
    return SurfaceFlowCase(
        scene.heights,
        scene.flow.from_deg,
        asked.speed,
        roughness,
        viscosity,
        LEVELS[asked.level],
        turbulence_model=asked.turbulence_model,
        first_cell_m=cell,
    )


def alike(
    scenes: Sequence[SurfaceScene],
) -> dict[SurfaceScene, list[SurfaceScene]]:
    """Scenes by the one that they are but for the direction of the wind."""
    found: dict[SurfaceScene, list[SurfaceScene]] = {}
    for scene in scenes:
        flow = scene.flow.model_copy(update={"from_deg": 0.0})
        bare = scene.model_copy(update={"flow": flow})
        found.setdefault(bare, []).append(scene)
    return found


def ground_of(scene: SurfaceScene, threshold: float | None) -> Ground:
    """What lies on the surface of a scene; a threshold replaces the closed form."""
    return Ground(
        grain=scene.grain_in_pocket,
        law=scene.law,
        roughness=scene.solve_roughness,
        is_natural=scene.is_natural,
        threshold=threshold,
    )


def _answer(
    scenes: Sequence[SurfaceScene],
    flows: Mapping[SurfaceScene, SurfaceFlowCase],
    threshold: float | None,
    cases: Path,
    rose: pd.DataFrame | None,
) -> Answer:
    """The answer of scenes that are alike but for the direction of the wind."""
    first = scenes[0]
    ground = ground_of(first, threshold)
    directions = []
    for scene in scenes:
        stress = SurfaceStress.from_csv(cases / flows[scene].name / SURFACE_STRESS)
        from_deg = scene.flow.from_deg
        faces = ground.faces(stress, from_deg)
        directions.append(Direction(from_deg, faces, first.heights.relief))
    cell = flows[first].cell_m
    return Answer(first.name, first.heights, ground, directions, cell, rose)


def tables(found: Sequence[Answer]) -> dict[str, pd.DataFrame]:
    """The tables: directions, shares against the wind, and all faces."""
    rows = []
    curves = []
    made = {}
    for number, answer in enumerate(found, 1):
        winds = _winds(answer)
        for each in answer.directions:
            rows.append({"surface": answer.name, **each.row()})
            curve = {"surface": answer.name, "from_deg": each.from_deg}
            shares = each.shares().at(winds)
            curves.append(pd.DataFrame({**curve, "wind_m_s": winds, "share": shares}))
            made[f"faces-{number}-{each.word}"] = each.every
    return {
        "directions": pd.DataFrame(rows),
        "shares": pd.concat(curves, ignore_index=True),
        **made,
    }


def _winds(answer: Answer) -> FloatArray:
    """Winds over which shares are drawn and listed, m/s."""
    most = max(each.shares().wind_for(MOST_SHARE) for each in answer.directions)
    last = most if np.isfinite(most) else 3 * answer.ground.flat
    return np.linspace(0.0, 1.1 * last, 111)


def files(found: Sequence[Answer]) -> dict[str, bytes]:
    """GeoTIFFs of the maps for a GIS, and files of VTK for ParaView, by their paths."""
    made = {}
    for number, answer in enumerate(found, 1):
        grid = answer.grid
        for name, values in answer.maps.items():
            path = f"maps/{number}-{name}.tif"
            made[path] = geotiff(grid.x, grid.y, values, answer.surface.tags)
        made[f"maps/{number}.vtk"] = _vtk(answer)
    return made


def _vtk(answer: Answer) -> bytes:
    """The maps on the surface as a file of VTK; coordinates are those of the file."""
    import pyvista

    grid = answer.grid
    x, y = np.meshgrid(grid.x, grid.y)
    body: Any = pyvista.StructuredGrid(x, y, grid.height + answer.surface.level)
    for name, values in answer.maps.items():
        body[name] = values.ravel(order="F")
    body["height_m"] = grid.height.ravel(order="F")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "surface.vtk"
        body.save(path)
        return path.read_bytes()


def sections(found: Sequence[Answer], source: str) -> list[Section]:
    """The page: the answer with the map of the least wind, then all else."""
    words = TEXTS["surface"]
    listed: list[Section] = []
    for number, answer in enumerate(found, 1):
        listed += _sections(answer, f"-{number}" if len(found) > 1 else "", source)
    table = tables(found)["directions"]
    card = surface_card.card(found, source)
    listed[0] = replace(listed[0], tables=[table], card=card)
    return [*listed, Section("How sure it is", words["sure"])]


def _sections(answer: Answer, end: str, source: str) -> Iterator[Section]:
    """The sections of one surface; the names of its figures have the ending."""
    words = TEXTS["surface"]
    told = "\n\n".join(surface_card.sentences(answer, source))
    first = answer.easiest.first
    mark = (float(first["x_m"]), float(first["y_m"]))
    several = len(answer.directions) > 1
    title = "least wind of all directions" if several else answer.easiest.title
    from_deg = None if several else answer.easiest.from_deg
    least = [maps.Map(title, answer.maps[LEAST], from_deg, mark)]
    drawing = maps.figure(answer.grid, least, f"{WIND} at which it moves")
    text = words["least"]
    yield Section(
        "", told, [Figure(f"least{end}", "Where motion starts", text, (), drawing)]
    )
    figures = [_figure(answer, RATIO, f"stress{end}", "Stress", words["stress"])]
    if several:
        title = "Wind from each direction"
        figures.append(_figure(answer, MOVES, f"winds{end}", title, words["winds"]))
    curves = _curves(answer)
    figures.append(Figure(f"shares{end}", "Share", words["shares"], (), curves))
    if answer.rose is not None:
        hours = [maps.Map("hours a year", answer.maps[HOURS])]
        drawing = maps.figure(answer.grid, hours, "hours a year", colours="magma")
        text = words["hours"]
        figures.append(Figure(f"hours{end}", "Hours of motion", text, (), drawing))
    yield Section(answer.name, "", figures)


def _figure(answer: Answer, column: str, name: str, title: str, text: str) -> Figure:
    """A figure with the map of a column for each direction."""
    drawn = []
    for each in answer.directions:
        values = answer.maps[f"{column}-{each.word}"]
        drawn.append(maps.Map(each.title, values, each.from_deg))
    if column == RATIO:
        drawing = maps.figure(
            answer.grid, drawn, "u*/u*₀", colours="RdBu_r", middle=1.0
        )
    else:
        drawing = maps.figure(answer.grid, drawn, f"{WIND} at which it moves")
    return Figure(name, title, text, (), drawing)


def _curves(answer: Answer) -> Canvas:
    """The shares that move against the wind, a colour for each direction."""
    winds = _winds(answer)
    drawn = []
    count = max(len(answer.directions), 2)
    for number, each in enumerate(answer.directions):
        colour = to_hex(colormaps["turbo"](0.08 + 0.84 * number / (count - 1)))
        leaving = np.array([])
        if LEAVES in each.faces and answer.ground.is_natural:
            leaving = each.shares(LEAVES).at(winds)
        drawn.append((each.title, each.shares().at(winds), leaving, colour))
    return maps.shares(drawn, winds)
