"""Flows over surfaces beside measurements, the flow in a section, and one another.

`orchestrator validate --surfaces PART` runs them and makes ``measured/surfaces.csv``.

- ridge: a ridge across the wind in three dimensions against the flow over its bed line.
- turn: a cone on a raster, with the wind turned against the raster's axes.
- interval: a cone with other meshes, first cells and turbulence models.
- piles: us/ur on cone and oval, by the areas that AP-42 (section 13.2.5) has of them.
- askervein: the wind at 10 m over Askervein hill against the masts of 1983.

No measured stress on the wall of a hill in three dimensions was found.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator import plan
from orchestrator.errors import Stalled
from orchestrator.experiment import Experiment, ExperimentResults, Runs, page_texts
from orchestrator.flow.case import FlowCase
from orchestrator.flow.foam import BED_FLOW
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import WallStress
from orchestrator.physics.velocity import log_law_speed
from orchestrator.report.page import Paragraphs, Section, Table
from orchestrator.runs.case import Case
from orchestrator.study.method import FlowMethod
from orchestrator.surface import mesh
from orchestrator.surface.case import SurfaceFlowCase
from orchestrator.surface.heights import (
    SPREAD_OF_SHAPE,
    Plane,
    Surface,
    cone,
    oval,
    surface_of,
)
from orchestrator.surface.mesh import COARSE, STANDARD, Columns, Level, Sizes
from orchestrator.surface.stress import SurfaceStress
from orchestrator.types import BoolArray, FloatArray

MEASURED = Path(__file__).with_name("measured")
SURFACES = MEASURED / "surfaces.csv"
"""What the parts have given."""
LIMIT_S = 7200.0
"""Time that a run may take, s."""
AIR = 1.5e-5
"""Kinematic viscosity, m2/s."""
RIDGE, RIDGE_DEG_UP = 10.0, 15.0
"""Height of the ridge, m, and slope of its two sides; its z0 is h/600."""
PILE, BASE = 11.4, 14.6
"""Height and radius of the cone, m."""
PILE_SLOPE = float(np.degrees(np.arctan(PILE / BASE)))
OVAL_SLOPE, OVAL_LENGTH, OVAL_WIDTH = 37.0, 22.8, 11.4
"""Of the oval: AP-42 gives a slope of 37 degrees and a flat top; its lengths are
taken here as two heights and one."""
ROUGHNESS = 0.004
"""Roughness length of a coal pile, m."""
ABOVE_PILE = 0.25
"""Height over a pile, normal to it, at which us/ur is read, m."""
REFERENCE = 10.0
"""Height at which ur is read, m, and that of the masts."""
QUICK = Level("quick", 8, 2, 1.25, 1.35, 50_000)
"""A third of the cells of the coarse level."""
BANDS = (0.0, 0.4, 0.8, 1.0, np.inf)
"""Ends of the classes of us/ur, whose middles AP-42 names 0.2, 0.6, 0.9 and 1.1."""
AREAS = {
    "cone": (40.0, 48.0, 12.0, 0.0),
    "oval, 0 deg": (36.0, 50.0, 14.0, 0.0),
    "oval, 20 deg": (31.0, 51.0, 15.0, 3.0),
    "oval, 40 deg": (28.0, 54.0, 14.0, 4.0),
}
"""Per cent of the area in each class by AP-42, by pile and direction."""
HILL_ROUGHNESS, HILL_FROM_DEG = 0.03, 210.0
HILLS = (
    Level("askervein", 12, 4, 1.25, 1.4, 90_000),
    Level("askervein, finer", 12, 6, 1.2, 1.3, 240_000),
)
TAPERED = 250.0
"""Width over which the rim of the raster of Askervein is tapered to level ground, m."""
ALONG_DEG, RIDGE_DEG = 43.0, 133.0
"""Where lines A and AA, and line B, go to, degrees from north."""
TO_CP = 400.0
"""From the hilltop to the centre point along line B, m."""
AT_MAST = "U/U_RS at 10 m"
"""The wind at a mast over that at the reference site."""


Row = Mapping[str, object]
"""A row of the table of what was compared."""


def _row(part: str, name: str, quantity: str, value: float, beside: float) -> Row:
    """A row of the table of what was compared; `beside` is NaN where nothing is."""
    columns = {"part": part, "case": name, "quantity": quantity}
    return {**columns, "value": value, "compared_with": beside}


@dataclass(frozen=True)
class _RidgeFlow(SurfaceFlowCase):
    """The flow over a ridge that goes on beyond the sides of the mesh."""

    section: FlowCase | None = None
    has_its_lines: bool = True
    """Whether its grid lines along the wind are those of the section, or even."""

    @property
    def parameters(self) -> dict[str, object]:
        """All that the flow depends on."""
        return {**super().parameters, "lines": self.has_its_lines}

    @property
    def needs(self) -> tuple[Case, ...]:
        """The flow in the section."""
        assert self.section is not None
        return (self.section,)

    @cached_property
    def mesh(self) -> Columns:
        """A few columns of cells across the wind."""
        assert self.section is not None
        h = self.height_m
        line = self.section.bed_line
        foot, end = line.x[1], line.x[-2]
        cell = (end - foot) / 2 / self.level.per_radius
        x, _ = mesh.grid_lines(Sizes(foot, end, -h, h), h, cell, self.level)
        if self.has_its_lines:
            x = _lines_of(self.section)
        count = mesh.rows(h, self.first_cell, self.level)
        return Columns.over(
            lambda x, y: line.height(x),
            x,
            np.linspace(-h, h, 4),
            height=h,
            first_cell=self.first_cell,
            count=count,
        )


def _lines_of(section: FlowCase) -> FloatArray:
    """Grid lines along a section, m."""
    grid = section.grid
    lines = [np.array(grid.line.x[:1])]
    ends = zip(grid.line.x[:-1], grid.line.x[1:], strict=True)
    for (start, end), piece in zip(ends, grid.pieces, strict=False):
        lines.append(start + piece.ends(end - start))
    return np.concatenate(lines)


@cache
def _ridge_flows() -> dict[str, SurfaceFlowCase]:
    """The flows over a ridge, on two meshes."""
    first = RIDGE / 40
    settings = FlowMethod(
        roughness=RIDGE / 600,
        viscosity=1e-5,
        first_cell_height=first,
        cells_per_face=40,
        lid=mesh.LID,
        upstream=mesh.UPSTREAM,
        downstream=mesh.DOWNSTREAM,
    )
    section = FlowCase(RIDGE, RIDGE_DEG_UP, settings)
    flows: dict[str, SurfaceFlowCase] = {}
    for name in ("grid lines of the section", "even cells"):
        flows[name] = _RidgeFlow(
            cone(RIDGE, RIDGE_DEG_UP),
            270.0,
            10.0,
            RIDGE / 600,
            1e-5,
            Level("ridge", 40, 1, 1.1, 1.2, 10**6),
            first_cell_m=first,
            section=section,
            has_its_lines=name != "even cells",
        )
    return flows


def _ridge(cases: Path) -> Iterator[Row]:
    """A ridge in three dimensions against its section, by means of its sides."""
    face = RIDGE / np.tan(np.radians(RIDGE_DEG_UP))
    sides = {"windward": (0.0, face), "lee": (face, 2 * face)}
    for name, one in _ridge_flows().items():
        (section,) = one.needs
        plane = WallStress.from_csv(cases / section.name / WALL_STRESS)
        stress = _stress_of(one, cases)
        # the whole stress along the slope, not its part along the wind
        ours = np.sign(stress.tau_along) * stress.ustar_over_ustar0
        for side, (start, end) in sides.items():
            of_wide = (stress.along_m > start) & (stress.along_m < end)
            of_plane = (plane.x_m > start) & (plane.x_m < end)
            theirs = plane.ustar_over_ustar0_wall[of_plane]
            value = float(np.average(ours[of_wide], weights=stress.area_m2[of_wide]))
            beside = float(np.average(theirs, weights=plane.length_m[of_plane]))
            yield _row("ridge", name, f"mean u*/u*_0, {side} side", value, beside)


def _stress_of(one: SurfaceFlowCase, cases: Path) -> SurfaceStress:
    """The stress on the bed of a case."""
    return one.stress(cases / one.name)[0]


def _pile_flow(
    surface: Surface,
    from_deg: float = 270.0,
    roughness: float = ROUGHNESS,
    level: Level = COARSE,
) -> SurfaceFlowCase:
    """The flow over a stockpile."""
    return SurfaceFlowCase(surface, from_deg, 10.0, roughness, AIR, level)


def _on_form(stress: SurfaceStress, height: float) -> BoolArray:
    """Whether a face is a part of the form."""
    return np.asarray(stress.z_m > 0.01 * height)


def _measures(stress: SurfaceStress, height: float) -> dict[str, float]:
    """A few numbers of the stress on a form."""
    form = _on_form(stress, height)
    area = stress.area_m2[form]
    tau = np.linalg.norm(stress.tau[form], axis=1)
    is_reversed = stress.tau_along[form] < 0
    return {
        "mean tau/u*_0^2": float(np.average(tau, weights=area)),
        "u*/u*_0 that 1 % of the area exceeds": _exceeded(np.sqrt(tau), area, 0.01),
        "u*/u*_0 that half of the area exceeds": _exceeded(np.sqrt(tau), area, 0.5),
        "reversed, % of the area": 100 * float(area[is_reversed].sum() / area.sum()),
    }


def _exceeded(values: FloatArray, area: FloatArray, share: float) -> float:
    """The value that a share of the area exceeds."""
    order = np.argsort(values)[::-1]
    part = np.cumsum(area[order]) / area.sum()
    return float(np.interp(share, part, values[order]))


@cache
def _turn_flows() -> dict[str, SurfaceFlowCase]:
    """The flows over a cone from three directions."""
    surface = cone(PILE, PILE_SLOPE)
    names = {0.0: "by 0 deg", 30.0: "by 30 deg", 90.0: "by 90 deg"}
    return {name: _pile_flow(surface, 270.0 - turn) for turn, name in names.items()}


def _turn(cases: Path) -> Iterator[Row]:
    """A cone whose raster is turned against the wind."""
    return _beside_the_first("turn", _turn_flows(), cases)


@cache
def interval_flows() -> dict[str, SurfaceFlowCase]:
    """Make the flows over a cone with other meshes, first cells and models.

    Returns
    -------
    dict of str to SurfaceFlowCase
        The flows by what sets them apart; the first has the coarse level.
    """
    coarse = _pile_flow(cone(PILE, PILE_SLOPE))
    return {
        "coarse": coarse,
        "first cell h/20": replace(coarse, first_cell_m=PILE / 20),
        "first cell h/80": replace(coarse, first_cell_m=PILE / 80),
        "standard level": replace(coarse, level=STANDARD),
        "RNGkEpsilon": replace(coarse, turbulence_model="RNGkEpsilon"),
        "kOmegaSST": replace(coarse, turbulence_model="kOmegaSST"),
    }


def _interval(cases: Path) -> Iterator[Row]:
    """A cone with other meshes, first cells and models."""
    return _beside_the_first("interval", interval_flows(), cases)


def _beside_the_first(
    part: str, flows: Mapping[str, SurfaceFlowCase], cases: Path
) -> Iterator[Row]:
    """Measures of the flows over a cone beside those of the first."""
    found = {}
    for name, one in flows.items():
        found[name] = _measures(_stress_of(one, cases), PILE)
    first, *others = found
    for name in others:
        for quantity, value in found[name].items():
            yield _row(part, name, quantity, value, found[first][quantity])


def _speeds(
    one: SurfaceFlowCase, directory: Path, above: float, upright: FloatArray
) -> FloatArray:
    """Speed at a distance over each face of the bed, m/s, of the shape of its faces.

    `upright` is the vertical part of the unit vectors along which the distance is
    taken, of a shape that broadcasts to it.
    """
    velocity = np.linalg.norm(one.velocity(directory), axis=-1)[1:]
    away = one.mesh.over_bed[1:] * upright[..., None]
    columns = [part.reshape(-1, part.shape[-1]) for part in (np.log(away), velocity)]
    pairs = zip(*columns, strict=True)
    found = [np.interp(np.log(above), up, speed) for up, speed in pairs]
    return np.reshape(found, velocity.shape[:2])


def _speed_over_bed(one: SurfaceFlowCase, directory: Path, above: float) -> FloatArray:
    """Speed so far over each face of the bed along its normal, m/s, in their order."""
    along, across, _ = one.mesh.shape
    upright = one.stress(directory)[0].normal[:, 2].reshape(along - 1, across)
    return _speeds(one, directory, above, upright).ravel()


def _reference_speed(one: SurfaceFlowCase, directory: Path) -> float:
    """Speed of the approaching flow at the reference height, m/s."""
    ustar0 = one.stress(directory)[1]
    return float(log_law_speed(ustar0, REFERENCE, one.roughness_m))


@cache
def _piles_flows() -> dict[str, SurfaceFlowCase]:
    """The flows over the shapes that the tunnel had."""
    round_one = cone(PILE, PILE_SLOPE)
    long_one = oval(PILE, OVAL_SLOPE, OVAL_LENGTH, OVAL_WIDTH)
    flows = {}
    for roughness in (ROUGHNESS, 3 * ROUGHNESS):
        name = f"cone, z0 {1e3 * roughness:g} mm"
        flows[name] = _pile_flow(round_one, roughness=roughness)
    for angle in (0.0, 20.0, 40.0):
        name = f"oval, {angle:g} deg"
        flows[name] = _pile_flow(long_one, 270.0 - angle, level=QUICK)
    return flows


def _piles(cases: Path) -> Iterator[Row]:
    """Areas of AP-42's classes on the shapes that the tunnel had."""
    for name, one in _piles_flows().items():
        directory = cases / one.name
        ratio = _speed_over_bed(one, directory, ABOVE_PILE)
        ratio /= _reference_speed(one, directory)
        stress = _stress_of(one, cases)
        form = _on_form(stress, PILE)
        area = stress.area_m2[form]
        counts, _ = np.histogram(ratio[form], BANDS, weights=area)
        of_epa = AREAS[name.partition(", z0")[0]]
        for band, count in enumerate(counts):
            quantity = f"us/ur from {BANDS[band]:g}, % of the area"
            share = 100 * float(count / area.sum())
            yield _row("piles", name, quantity, share, of_epa[band])


def _askervein_hill() -> Surface:
    """Askervein hill by the Copernicus model of heights, tapered to level ground."""
    table = pd.read_csv(MEASURED / "askervein_terrain.csv", comment="#")
    x, y = np.unique(table["x_m"]), np.unique(table["y_m"])
    z = table.pivot(index="y_m", columns="x_m", values="z_m").to_numpy()
    rim = np.concatenate([z[0], z[-1], z[:, 0], z[:, -1]])
    level = float(np.median(rim))
    to_x = np.minimum(x - x[0], x[-1] - x)
    to_y = np.minimum(y - y[0], y[-1] - y)
    inside = np.minimum(to_x, to_y[:, None]) / TAPERED
    weight = (1 - np.cos(np.pi * np.clip(inside, 0.0, 1.0))) / 2
    tapered = level + (z - level) * weight
    return surface_of("Askervein", x, y, tapered, Plane(level), SPREAD_OF_SHAPE)


def _at_places(
    one: SurfaceFlowCase, directory: Path, places: FloatArray, above: float
) -> FloatArray:
    """Speed over some places in the axes of the file, m/s, linear between columns."""
    from scipy.interpolate import RegularGridInterpolator

    of_faces = _speeds(one, directory, above, np.ones((1, 1)))
    middles = [(lines[1:] + lines[:-1]) / 2 for lines in (one.mesh.x, one.mesh.y)]
    over = RegularGridInterpolator(middles, of_faces)
    return np.asarray(over((places - one.surface.centre) @ one.axes.T))


@cache
def _askervein_flows() -> dict[str, SurfaceFlowCase]:
    """The flows over Askervein hill, on two meshes."""
    surface = _askervein_hill()
    flows = {}
    for level in HILLS:
        flows[level.name] = SurfaceFlowCase(
            surface, HILL_FROM_DEG, 16.0, HILL_ROUGHNESS, AIR, level
        )
    return flows


def _askervein(cases: Path) -> Iterator[Row]:
    """The wind at the masts over that at the reference site far upstream."""
    masts = pd.read_csv(MEASURED / "askervein_masts.csv", comment="#")
    for one in _askervein_flows().values():
        for line, table in masts.groupby("line"):
            yield from _at_masts(one, cases / one.name, str(line), table)


def _at_masts(
    one: SurfaceFlowCase, directory: Path, line: str, masts: pd.DataFrame
) -> Iterator[Row]:
    """The wind at the masts of one line, and how far it is off all of them."""
    surface = one.surface
    top = np.unravel_index(int(surface.z.argmax()), surface.z.shape)
    start = np.array([surface.x[top[1]], surface.y[top[0]]])
    if line == "AA":
        start = start + TO_CP * _towards(RIDGE_DEG)
    bearing = RIDGE_DEG if line == "B" else ALONG_DEG
    along = 1000 * masts["distance_km"].to_numpy()
    places = start + along[:, None] * _towards(bearing)
    half = (surface.x[-1] - surface.x[0]) / 2 - TAPERED
    is_in = np.all(np.abs(places - surface.centre) <= half, axis=1)
    speeds = _at_places(one, directory, places[is_in], REFERENCE)
    speeds /= _reference_speed(one, directory)
    measured = masts["speed_over_reference"].to_numpy()[is_in]
    cells = f"{one.mesh.cells} cells, line {line}"
    for place, value, beside in zip(along[is_in], speeds, measured, strict=True):
        name = f"{cells}, {place:.0f} m"
        yield _row("askervein", name, AT_MAST, float(value), float(beside))
    error = speeds - measured
    name = f"{cells}, {len(error)} masts"
    rms = float(np.sqrt(np.mean(error**2)))
    yield _row("askervein", name, "rms of the differences", rms, np.nan)
    bias = float(error.mean())
    yield _row("askervein", name, "mean of the differences", bias, np.nan)


def _towards(bearing_deg: float) -> FloatArray:
    """Unit vector of a bearing, degrees from north."""
    angle = np.radians(bearing_deg)
    return np.array([np.sin(angle), np.cos(angle)])


@dataclass(frozen=True)
class TruthPart:
    """A comparison.

    Attributes
    ----------
    flows
        Makes its flows, by name.
    rows
        Makes the rows of its table from the directory of the cases.
    """

    flows: Callable[[], Mapping[str, SurfaceFlowCase]]
    rows: Callable[[Path], Iterator[Row]]


PARTS = {
    "ridge": TruthPart(_ridge_flows, _ridge),
    "turn": TruthPart(_turn_flows, _turn),
    "interval": TruthPart(interval_flows, _interval),
    "piles": TruthPart(_piles_flows, _piles),
    "askervein": TruthPart(_askervein_flows, _askervein),
}
"""The comparisons by their names."""


class Truth(Experiment):
    """Flows over surfaces beside measurements.

    Parameters
    ----------
    names
        The comparisons, of `PARTS`.
    """

    name = "surfaces"
    title = "Flows over surfaces beside measurements"
    limit_s = LIMIT_S
    # the velocity across a ridge is nothing but round-off, whose residual need not fall
    verdicts = (Stalled.__name__,)

    def __init__(self, names: Sequence[str]) -> None:
        self.runs = {name: [*PARTS[name].flows().values()] for name in names}
        super().__init__(plan.of_cases(chain(*self.runs.values())))
        ridges = {one.name for one in self.runs.get("ridge", ())}
        self.failing = self.planned.cases.keys() - ridges

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Make the table of the comparisons whose runs have ended."""
        listed: list[Row] = []
        for name, asked in self.runs.items():
            ended = [
                one.name in runs.done or (runs.cases / one.name / BED_FLOW).is_file()
                for one in asked
            ]
            if all(ended):
                listed += PARTS[name].rows(runs.cases)
        if not listed:
            return None
        table = pd.DataFrame(listed)
        return ExperimentResults({"surfaces": table}, [truth_section(table)])


def truth_section(table: pd.DataFrame) -> Section:
    """Make the section of a page that has the comparisons.

    Parameters
    ----------
    table
        Their table.

    Returns
    -------
    Section
        All rows but those of single masts.
    """
    few = table[table["quantity"] != AT_MAST]
    text = Paragraphs(page_texts(__file__, "surface")["truth"], "lead")
    return Section("Beds in three dimensions", [text, Table.of(few)])


def stored() -> pd.DataFrame:
    """Read the table of the comparisons as they came out before.

    Returns
    -------
    DataFrame
        Part, case, quantity, value and what it is compared with.
    """
    return pd.read_csv(SURFACES)
