"""From a raster to the wind at which each part of it moves.

OpenFOAM gives the stress on a bed in three dimensions for each direction of the wind,
the closed form the threshold of a grain on each of its faces.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiment import Experiment, ExperimentResults, Runs, page_texts
from orchestrator.flow.run import SPEED_HEIGHT, WALL_STRESS
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.report.page import IN_SENTENCES, Paragraphs, Section, Table
from orchestrator.report.style import Figure
from orchestrator.stockpile.erosion import given_threshold
from orchestrator.study.scene import (
    SOLVE_VISCOSITY,
    VISCOUS_CELLS,
    default_first_cell_height,
)
from orchestrator.surface import cards, maps, onset, winds
from orchestrator.surface.answer import (
    ENTRAINED,
    HOURS,
    LEAST,
    MOVES,
    RATIO,
    Direction,
    Ground,
    Stream,
    SurfaceAnswer,
)
from orchestrator.surface.case import SurfaceFlowCase
from orchestrator.surface.mesh import LEVELS
from orchestrator.surface.parts import SurfaceErosion, SurfaceScene
from orchestrator.surface.raster import geotiff
from orchestrator.surface.rose import SolvedRose
from orchestrator.surface.stress import SurfaceStress
from orchestrator.surface.study import SurfaceStudy, rose_of
from orchestrator.types import FloatArray

HEADINGS = {
    "x_m": "first at x, m",
    "y_m": "y, m",
    "z_m": "z, m",
}
"""Columns of directions as the page calls them."""
MOST_SHARE = 0.95
"""Share of the surface up to which it is drawn against the wind."""


class OverSurfaces(Experiment):
    """An experiment on the flows over the surfaces of a study.

    Parameters
    ----------
    study
        The study.

    Raises
    ------
    InputError
        If the threshold is no number or material, or the rose blows from where no flow
        is.
    """

    shares_cases = True

    def __init__(self, study: SurfaceStudy) -> None:
        self.title = study.title
        asked = study.erosion.threshold
        self.threshold, self.threshold_from = given_threshold(asked, study.file)
        self.flows = {scene: flow_of(scene) for scene in study.scenes}
        self.members = alike(study.scenes)
        self.roses = roses_of(study, self.members)
        self.understood = study.understood
        super().__init__(plan.of_cases(self.flows.values()), study)

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Answer the surfaces of which a flow is done."""
        found = []
        for bare, scenes in self.members.items():
            done = [scene for scene in scenes if self.flows[scene].name in runs.done]
            if not done:
                continue
            rose = self.roses.get(bare) if len(done) == len(scenes) else None
            found.append(_answer(done, self.flows, self.threshold, runs.cases, rose))
        return self.results_of(found) if found else None

    @abstractmethod
    def results_of(self, found: Sequence[SurfaceAnswer]) -> ExperimentResults:
        """Make tables and page of some surfaces.

        Parameters
        ----------
        found
            The answers; at least one.

        Returns
        -------
        Results
            Tables, page and files.
        """


class SurfaceMotion(OverSurfaces):
    """From which wind on each part of some surfaces moves."""

    name = "surface"

    def results_of(self, found: Sequence[SurfaceAnswer]) -> ExperimentResults:
        """List directions, shares and faces, and draw the maps."""
        return ExperimentResults(
            tables(found),
            surface_sections(found, self.threshold_from, self.understood),
            files(found),
        )


INLET_OFF = 1.1
"""Factor by which the ground at the inlet may be other than that of the approach."""


def flow_of(scene: SurfaceScene) -> SurfaceFlowCase:
    """The run of a scene.

    Returns
    -------
    SurfaceFlowCase
        The run of its flow.

    Raises
    ------
    InputError
        If a map of roughness has other ground at the inlet than the approaching wind.
    """
    roughness = scene.solve_roughness
    relief = scene.heights.relief
    asked = scene.method.flow
    eddy = KARMAN * float(log_law_ustar(asked.speed, SPEED_HEIGHT * relief, roughness))
    viscous = (asked.viscosity or 0.0) / eddy
    cell = asked.first_cell_height
    roughest = roughness
    if asked.roughness_map:
        roughest = max(roughness, float(np.nanmax(asked.roughness_map.z0)))
    cell = cell or default_first_cell_height(relief, roughest, viscous)
    most = eddy * cell / VISCOUS_CELLS
    viscosity = asked.viscosity or min(SOLVE_VISCOSITY, float(f"{most:.3g}"))
    made = SurfaceFlowCase(
        scene.heights,
        scene.flow.from_deg,
        asked.speed,
        roughness,
        viscosity,
        LEVELS[asked.level],
        turbulence_model=asked.turbulence_model,
        first_cell_m=cell,
        roughness_map=asked.roughness_map,
    )
    _check_inlet(made)
    return made


def _check_inlet(flow: SurfaceFlowCase) -> None:
    """Refuse a map of roughness in which the wind enters over other ground."""
    if flow.roughness_map is None:
        return
    at_inlet = float(np.exp(np.log(flow.ground_roughness()[1]).mean()))
    if abs(np.log(at_inlet / flow.roughness_m)) <= np.log(INLET_OFF):
        return
    what = (
        f"at the upwind edge, of wind from {flow.from_deg:g}°, the ground has "
        f"{at_inlet:.3g} m, and the approaching wind {flow.roughness_m:.3g} m"
    )
    remedy = f"method.flow.roughness = {at_inlet:.3g}, or a map that ends before it"
    raise InputError(what, "method.flow.roughness_map", remedy)


def alike(
    scenes: Sequence[SurfaceScene],
) -> dict[SurfaceScene, list[SurfaceScene]]:
    """Scenes by the one that they are but for the direction of the wind.

    Parameters
    ----------
    scenes
        Scenes of a study.

    Returns
    -------
    dict
        By a scene whose wind comes from 0 degrees: those that differ from it in the
        direction alone.
    """
    found: dict[SurfaceScene, list[SurfaceScene]] = {}
    for scene in scenes:
        flow = scene.flow.model_copy(update={"from_deg": 0.0})
        bare = scene.model_copy(update={"flow": flow})
        found.setdefault(bare, []).append(scene)
    return found


def roses_of(
    study: SurfaceStudy, members: Mapping[SurfaceScene, Sequence[SurfaceScene]]
) -> dict[SurfaceScene, SolvedRose]:
    """Find the flows that answer the wind rose of a study.

    Parameters
    ----------
    study
        The study.
    members
        Its scenes by `alike`.

    Returns
    -------
    dict
        The rose for the scenes of each key; empty without a rose.

    Raises
    ------
    InputError
        If the rose blows from where no flow is.
    """
    rose = rose_of(study)
    if not rose:
        return {}
    assert isinstance(study.erosion, SurfaceErosion)
    where = f"{study.file}: erosion.wind"
    height = study.erosion.wind_height or rose.height or onset.WIND_HEIGHT
    found = {}
    for bare, scenes in members.items():
        directions = [scene.flow.from_deg for scene in scenes]
        found[bare] = rose.solved(directions, where, bare.solve_roughness, height)
    return found


def ground_of(scene: SurfaceScene, threshold: float | None) -> Ground:
    """What lies on the surface of a scene; a threshold replaces the closed form.

    Parameters
    ----------
    scene
        The scene.
    threshold
        Friction velocity of every face, m/s; None: the closed form.

    Returns
    -------
    Ground
        The grains of its faces.
    """
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
    rose: SolvedRose | None,
) -> SurfaceAnswer:
    """The answer of scenes that are alike but for the direction of the wind."""
    first = scenes[0]
    ground = ground_of(first, threshold)
    directions = []
    for scene in scenes:
        stress = SurfaceStress.from_csv(cases / flows[scene].name / WALL_STRESS)
        directions.append(
            Direction.of(ground, stress, scene.flow.from_deg, first.heights)
        )
    cell = flows[first].cell_m
    return SurfaceAnswer(first.name, first.heights, ground, directions, cell, rose)


def tables(found: Sequence[SurfaceAnswer]) -> dict[str, pd.DataFrame]:
    """The tables: directions, shares against the wind, and all faces.

    Parameters
    ----------
    found
        Answers of a study.

    Returns
    -------
    dict of str to DataFrame
        The tables by their names.
    """
    rows = []
    curves = []
    made = {}
    for number, answer in enumerate(found, 1):
        winds = _winds(answer)
        for each in answer.directions:
            rows.append({"surface": answer.name, **each.row()})
            curve = {"surface": answer.name, "from_deg": each.from_deg}
            shares = each.shares().at(winds)
            names = answer.ground.stream.columns
            drawn = pd.DataFrame({**curve, MOVES: winds, "share": shares})
            curves.append(drawn.rename(columns=names))
            made[f"faces-{number}-{each.word}"] = each.every.rename(columns=names)
    return {
        "directions": pd.DataFrame(rows),
        "shares": pd.concat(curves, ignore_index=True),
        **made,
    }


def _winds(answer: SurfaceAnswer) -> FloatArray:
    """Winds over which shares are drawn and listed, m/s."""
    most = max(each.shares().wind_for(MOST_SHARE) for each in answer.directions)
    last = most if np.isfinite(most) else 3 * answer.ground.flat
    return np.linspace(0.0, 1.1 * last, 111)


def files(found: Sequence[SurfaceAnswer]) -> dict[str, bytes]:
    """GeoTIFFs of the maps for a GIS, and files of VTK for ParaView, by their paths.

    Parameters
    ----------
    found
        Answers of a study.

    Returns
    -------
    dict of str to bytes
        Contents by path in the directory of the study.
    """
    made = {}
    for number, answer in enumerate(found, 1):
        grid = answer.grid
        for name, values in answer.maps.items():
            path = f"maps/{number}-{_in_files(name, answer)}.tif"
            made[path] = geotiff(grid.x, grid.y, values, answer.surface.system)
        made[f"maps/{number}.vtk"] = _vtk(answer)
    return made


def _in_files(name: str, answer: SurfaceAnswer) -> str:
    """What files call a map, which has the name of a column and maybe a direction."""
    column, dash, direction = name.partition("-")
    return answer.ground.stream.columns.get(column, column) + dash + direction


def _vtk(answer: SurfaceAnswer) -> bytes:
    """The maps on the surface as a file of VTK; coordinates are those of the file."""
    import pyvista

    grid = answer.grid
    x, y = np.meshgrid(grid.x, grid.y)
    height = grid.height + answer.surface.ground.at(x, y)
    body: Any = pyvista.StructuredGrid(x, y, height)
    for name, values in answer.maps.items():
        body[_in_files(name, answer)] = values.ravel(order="F")
    body["height_m"] = grid.height.ravel(order="F")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "surface.vtk"
        body.save(path)
        return path.read_bytes()


def surface_sections(
    found: Sequence[SurfaceAnswer],
    source: str,
    understood: Mapping[str, str] = MappingProxyType({}),
) -> list[Section]:
    """The page: the answer with the map of the least wind, then all else.

    Parameters
    ----------
    found
        Answers of a study.
    source
        What the study was read from, in words.
    understood
        What was understood of each file of the study, by name.

    Returns
    -------
    list of Section
        The sections, in their order.
    """
    words = _texts(found[0].ground.stream)
    listed: list[Section] = []
    for number, answer in enumerate(found, 1):
        read = cards.files_read(understood) if number == 1 else []
        end = f"-{number}" if len(found) > 1 else ""
        listed += _sections(answer, end, source, read)
    table = pd.concat(map(_directions, found))
    if len(found) == 1:
        table = table.drop(columns="surface")  # the card names it
    card = cards.surface_card(found, source)
    first, *others = listed
    *figures, told = first.content
    sure = Section("How sure it is", [Paragraphs(words["sure"], "lead")])
    return [
        Section("", [card]),
        Section("", figures, in_grid=True),
        Section("", [told, Table.of(table)]),
        *others,
        sure,
    ]


def _texts(stream: Stream) -> dict[str, str]:
    """The texts of the page, by their names, with the word for what flows."""
    texts = page_texts(__file__, "surface")
    return {
        name: texts[name].format(flow=stream.word, at=stream.at)
        for name in ("least", "stress", "winds", "shares", "hours", "rose", "sure")
    }


def _directions(answer: SurfaceAnswer) -> pd.DataFrame:
    """The table of directions for people: a place has the digits that its axes need."""
    rows = []
    for each in answer.directions:
        row = each.row()
        for name in ("x_m", "y_m"):
            row[name] = cards.in_axes(row[name], answer.cell_m)
        rows.append({"surface": answer.name, **row})
    from_deg = f"{answer.ground.stream.word} from, °"
    return pd.DataFrame(rows).rename(columns={"from_deg": from_deg, **HEADINGS})


def _sections(
    answer: SurfaceAnswer, end: str, source: str, read: Sequence[str]
) -> Iterator[Section]:
    """The sections of one surface; the names of its figures have the ending.

    What was read of the files of the study is told with it.
    """
    stream = answer.ground.stream
    words = _texts(stream)
    told = "\n\n".join([*cards.surface_sentences(answer, source), *read])
    first = answer.easiest.first
    mark = (float(first["x_m"]), float(first["y_m"]))
    several = len(answer.directions) > 1
    title = answer.easiest.title
    if several:
        title = f"least {stream.word} of all directions"
    from_deg = None if several else answer.easiest.from_deg
    least = [maps.Map(title, answer.maps[LEAST], from_deg, mark)]
    drawing = maps.figure(answer.grid, least, f"threshold {stream.at}, m/s")
    text = words["least"]
    place = Figure(f"least{end}", "Where motion starts", text, (), drawing)
    curves = _curves(answer)
    title = f"Fraction above threshold against the {stream.word}"
    share = Figure(f"shares{end}", title, words["shares"], (), curves)
    yield Section("", [place, share, Paragraphs(told, fold=IN_SENTENCES)])
    yield Section(answer.name, [*_further(answer, end)])


def _further(answer: SurfaceAnswer, end: str) -> Iterator[Figure]:
    """The figures of one surface below its answer."""
    words = _texts(answer.ground.stream)
    title = "Friction velocity over that of the undisturbed flow"
    yield _figure(answer, RATIO, f"stress{end}", title, words["stress"])
    if len(answer.directions) > 1:
        title = f"Threshold {answer.ground.stream.word} from each direction, m/s"
        yield _figure(answer, MOVES, f"winds{end}", title, words["winds"])
    if answer.rose is None:
        return
    hours = [maps.Map("hours a year", answer.maps[HOURS])]
    drawing = maps.figure(answer.grid, hours, "hours a year", colours="magma")
    title = "Hours a year above threshold"
    yield Figure(f"hours{end}", title, words["hours"], (), drawing)
    yield Figure.of_both_widths(
        f"rose{end}",
        "Wind rose, and hours a year in motion",
        f"{words['rose']} {answer.rose.said}",
        partial(winds.rose_figure, answer),
    )


def _figure(
    answer: SurfaceAnswer, column: str, name: str, title: str, text: str
) -> Figure:
    """A figure with the map of a column for each direction."""
    drawn = []
    for each in answer.directions:
        values = answer.maps[f"{column}-{each.word}"]
        drawn.append(maps.Map(each.title, values, each.from_deg))
    look: dict[str, Any] = {"label": f"threshold {answer.ground.stream.at}, m/s"}
    if column == RATIO:
        look = {"label": "u*/u*₀", "colours": "RdBu_r", "middle": 1.0}
    if len(drawn) == 1:
        return Figure(name, title, text, (), maps.figure(answer.grid, drawn, **look))

    def draw(width: float) -> Canvas:
        return maps.figure(answer.grid, drawn, width=width, **look)

    return Figure.of_both_widths(name, title, text, draw)


def _curves(answer: SurfaceAnswer) -> Canvas:
    """The fractions above threshold against the wind, the first direction first."""
    speeds = _winds(answer)
    drawn = []
    for each in sorted(answer.directions, key=lambda each: each.starts):
        leaving = np.array([])
        if ENTRAINED in each.faces and answer.ground.is_natural:
            leaving = each.shares(ENTRAINED).at(speeds)
        curve = maps.ShareCurve(each.title, each.shares().at(speeds), leaving)
        drawn.append(curve)
    marks = []
    for share, words in ((onset.STARTS, "first"), (cards.HALF, "half")):
        wind = answer.easiest.shares().wind_for(share)
        low, high = cards.factors_of_wind(share)
        if np.isfinite(wind):
            marks.append(maps.Mark(wind, low * wind, high * wind, share, words))
    flat = answer.ground.flat
    return maps.shares(drawn, speeds, answer.ground.stream.at, marks, flat)
