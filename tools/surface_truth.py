"""Flows over surfaces against measurements, against the flow in a section, and themselves.

python tools/surface_truth.py DIRECTORY [PART ...] > docs/measured/surfaces.csv

The parts are ridge, turn, interval, piles and askervein; by default all, in an hour of one core. The
cases in DIRECTORY run by hand as they lie; those that are there are not run again.

- ridge: a ridge across the wind in three dimensions against today's flow over its bed line.
- turn: a cone on a raster, with the wind turned by 30 degrees against the raster's axes.
- interval: a cone with other meshes, first cells and turbulence models.
- piles: us/ur on cone and oval, by the areas that AP-42 (section 13.2.5, table 13.2.5-3) has of them.
- askervein: the wind at 10 m over Askervein hill against the masts of 1983.

No measured stress on the wall of a hill in three dimensions was found: none is compared here.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.bed.surface import SPREAD_OF_SHAPE, Surface, cone, oval, surface_of
from orchestrator.errors import Stalled
from orchestrator.flow import mesh3
from orchestrator.flow.case import WALL_STRESS, FlowCase
from orchestrator.flow.mesh3 import COARSE, STANDARD, Columns, Level, Sizes
from orchestrator.flow.stress import WallStress
from orchestrator.flow.surface_case import SurfaceFlowCase
from orchestrator.flow.surface_stress import SurfaceStress
from orchestrator.physics.velocity import log_law_speed
from orchestrator.runs import case, engine
from orchestrator.runs.case import Case
from orchestrator.study.method import FlowMethod
from orchestrator.types import BoolArray, FloatArray

HERE = Path(__file__).resolve().parents[1] / "docs/measured"
LIMIT_S = 7200.0
AIR = 1.5e-5
"""Kinematic viscosity, m2/s."""
RIDGE, RIDGE_DEG_UP = 10.0, 15.0
"""Height of the ridge, m, and slope of its two sides; its z0 is h/600."""
PILE, BASE = 11.4, 14.6
"""Height and radius of the cone, m."""
PILE_SLOPE = float(np.degrees(np.arctan(PILE / BASE)))
OVAL_SLOPE, OVAL_LENGTH, OVAL_WIDTH = 37.0, 22.8, 11.4
"""Of the oval: AP-42 gives a slope of 37 degrees and a flat top; its lengths are taken here
as two heights and one."""
ROUGHNESS = 0.004
"""Roughness length of a coal pile, m."""
ABOVE_PILE = 0.25
"""Height over a pile, normal to it, at which us/ur is read, m."""
REFERENCE = 10.0
"""Height at which ur is read, m, and that of the masts."""
QUICK = Level("quick", 8, 2, 1.25, 1.35, 50_000)
"""A third of the cells of the coarse level: for ratios to the same mesh."""
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


class Row(dict[str, object]):
    """A row of the table."""


def row(part: str, name: str, quantity: str, value: float, beside: float) -> Row:
    """A value and what it is compared with, NaN where it is compared with nothing."""
    return Row(
        part=part, case=name, quantity=quantity, value=value, compared_with=beside
    )


def solve(one: Case, cases: Path) -> Path:
    """The directory of a case, run if it has not been."""
    if not case.done_state(one, cases):
        engine.execute(one, cases, LIMIT_S)
    return cases / one.name


def stress_of(one: SurfaceFlowCase, cases: Path) -> SurfaceStress:
    """The stress on the bed of a case."""
    return one.stress(solve(one, cases))[0]


@dataclass(frozen=True)
class RidgeFlow(SurfaceFlowCase):
    """The flow over a ridge that goes on beyond the sides of the mesh."""

    section: FlowCase | None = None
    has_its_lines: bool = True
    """Whether its grid lines along the wind are those of the section, or even."""

    @property
    def parameters(self) -> dict[str, object]:
        """All that the flow depends on."""
        return {**super().parameters, "lines": self.has_its_lines}

    @cached_property
    def mesh(self) -> Columns:
        """A few columns of cells across the wind."""
        assert self.section is not None
        h = self.height_m
        line = self.section.bed_line
        foot, end = line.x[1], line.x[-2]
        cell = (end - foot) / 2 / self.level.per_radius
        x, _ = mesh3.grid_lines(Sizes(foot, end, -h, h), h, cell, self.level)
        if self.has_its_lines:
            x = lines_of(self.section)
        count = mesh3.rows(h, self.first_cell, self.level)
        return Columns.over(
            lambda x, y: line.height(x),
            x,
            np.linspace(-h, h, 4),
            height=h,
            first_cell=self.first_cell,
            count=count,
        )


def lines_of(section: FlowCase) -> FloatArray:
    """Grid lines along a section, m."""
    grid = section.grid
    lines = [np.array(grid.line.x[:1])]
    ends = zip(grid.line.x[:-1], grid.line.x[1:], strict=True)
    for (start, end), piece in zip(ends, grid.pieces, strict=False):
        lengths = np.cumsum(piece.ratio ** np.arange(piece.cells))
        lines.append(start + (end - start) * lengths / lengths[-1])
    return np.concatenate(lines)


def ridge(cases: Path) -> Iterator[Row]:
    """A ridge in three dimensions against its section, by the means of its two sides."""
    first = RIDGE / 40
    settings = FlowMethod(
        roughness=RIDGE / 600,
        viscosity=1e-5,
        first_cell_height=first,
        cells_per_face=40,
        lid=mesh3.LID,
        upstream=mesh3.UPSTREAM,
        downstream=mesh3.DOWNSTREAM,
    )
    section = FlowCase(RIDGE, RIDGE_DEG_UP, settings)
    plane = WallStress.from_csv(solve(section, cases) / WALL_STRESS)
    face = RIDGE / np.tan(np.radians(RIDGE_DEG_UP))
    level = Level("ridge", 40, 1, 1.1, 1.2, 10**6)
    surface = cone(RIDGE, RIDGE_DEG_UP)
    for name in ("grid lines of the section", "even cells"):
        wide = RidgeFlow(
            surface,
            270.0,
            10.0,
            RIDGE / 600,
            1e-5,
            level,
            first_cell_m=first,
            section=section,
            has_its_lines=name != "even cells",
        )
        try:
            directory = solve(wide, cases)
        except Stalled:
            # the velocity across is nothing but round-off, whose residual need not fall
            directory = cases / wide.name
        stress, _ = wide.stress(directory)
        for side, ends in (("windward", (0.0, face)), ("lee", (face, 2 * face))):
            of_wide = (stress.along_m > ends[0]) & (stress.along_m < ends[1])
            of_plane = (plane.x_m > ends[0]) & (plane.x_m < ends[1])
            ours = signed_ustar(stress.tau_along)[of_wide]
            theirs = plane.ustar_over_ustar0_wall[of_plane]
            value = float(np.average(ours, weights=stress.area_m2[of_wide]))
            beside = float(np.average(theirs, weights=plane.length_m[of_plane]))
            quantity = f"mean u*/u*_0, {side} side"
            yield row("ridge", name, quantity, value, beside)


def signed_ustar(tau: FloatArray) -> FloatArray:
    """Friction velocity of a stress, with its sign."""
    return np.asarray(np.sign(tau) * np.sqrt(np.abs(tau)))


def pile_flow(
    surface: Surface,
    from_deg: float = 270.0,
    roughness: float = ROUGHNESS,
    level: Level = COARSE,
) -> SurfaceFlowCase:
    """The flow over a stockpile."""
    return SurfaceFlowCase(surface, from_deg, 10.0, roughness, AIR, level)


def on_form(stress: SurfaceStress, height: float) -> BoolArray:
    """Whether a face is a part of the form."""
    return np.asarray(stress.z_m > 0.01 * height)


def measures(stress: SurfaceStress, height: float) -> dict[str, float]:
    """A few numbers of the stress on a form."""
    form = on_form(stress, height)
    area = stress.area_m2[form]
    tau = np.linalg.norm(stress.tau[form], axis=1)
    is_reversed = stress.tau_along[form] < 0
    return {
        "mean tau/u*_0^2": float(np.average(tau, weights=area)),
        "u*/u*_0 that 1 % of the area exceeds": exceeded(np.sqrt(tau), area, 0.01),
        "u*/u*_0 that half of the area exceeds": exceeded(np.sqrt(tau), area, 0.5),
        "reversed, % of the area": 100 * float(area[is_reversed].sum() / area.sum()),
    }


def exceeded(values: FloatArray, area: FloatArray, share: float) -> float:
    """The value that a share of the area exceeds."""
    order = np.argsort(values)[::-1]
    part = np.cumsum(area[order]) / area.sum()
    return float(np.interp(share, part, values[order]))


def turn(cases: Path) -> Iterator[Row]:
    """A cone whose raster is turned against the wind, and against itself in the axes."""
    surface = cone(PILE, PILE_SLOPE)
    first = measures(stress_of(pile_flow(surface), cases), PILE)
    for turned_deg in (30.0, 90.0):
        other = stress_of(pile_flow(surface, 270.0 - turned_deg), cases)
        for quantity, value in measures(other, PILE).items():
            name = f"by {turned_deg:g} deg"
            yield row("turn", name, quantity, value, first[quantity])


def interval(cases: Path) -> Iterator[Row]:
    """A cone with other meshes, first cells and models, each against the same mesh."""
    surface = cone(PILE, PILE_SLOPE)
    quick = pile_flow(surface, level=QUICK)
    standard = pile_flow(surface, level=replace(STANDARD, ranks=1))
    others = (
        ("coarse level against quick", pile_flow(surface), quick),
        ("first cell h/20", replace(quick, first_cell_m=PILE / 20), quick),
        ("first cell h/80", replace(quick, first_cell_m=PILE / 80), quick),
        ("RNGkEpsilon", replace(quick, turbulence_model="RNGkEpsilon"), quick),
        ("kOmegaSST", replace(quick, turbulence_model="kOmegaSST"), quick),
        ("standard level against coarse", standard, pile_flow(surface)),
    )
    for name, one, beside in others:
        found = measures(stress_of(one, cases), PILE)
        first = measures(stress_of(beside, cases), PILE)
        for quantity, value in found.items():
            yield row("interval", name, quantity, value, first[quantity])


def speed_over_bed(one: SurfaceFlowCase, directory: Path, above: float) -> FloatArray:
    """Speed so far over each face of the bed along its normal, m/s, in their order."""
    velocity = np.linalg.norm(one.velocity(directory), axis=-1)[1:]
    speeds = velocity.reshape(-1, velocity.shape[-1])
    stress, _ = one.stress(directory)
    heights = one.mesh.over_bed[1:].reshape(speeds.shape)
    away = heights * stress.normal[:, 2, None]
    pairs = zip(np.log(away), speeds, strict=True)
    return np.array([np.interp(np.log(above), up, speed) for up, speed in pairs])


def reference_speed(one: SurfaceFlowCase, directory: Path) -> float:
    """Speed of the approaching flow at the reference height, m/s."""
    ustar0 = one.stress(directory)[1]
    return float(log_law_speed(ustar0, REFERENCE, one.roughness_m))


def piles(cases: Path) -> Iterator[Row]:
    """Areas of AP-42's classes on the shapes that the tunnel had."""
    round_one = cone(PILE, PILE_SLOPE)
    long_one = oval(PILE, OVAL_SLOPE, OVAL_LENGTH, OVAL_WIDTH)
    flows = [("cone", pile_flow(round_one))]
    flows.append(("cone", pile_flow(round_one, roughness=3 * ROUGHNESS)))
    for angle in (0.0, 20.0, 40.0):
        wind = pile_flow(long_one, 270.0 - angle, level=QUICK)
        flows.append((f"oval, {angle:g} deg", wind))
    for name, one in flows:
        directory = solve(one, cases)
        ratio = speed_over_bed(one, directory, ABOVE_PILE)
        ratio /= reference_speed(one, directory)
        stress, _ = one.stress(directory)
        form = on_form(stress, PILE)
        area = stress.area_m2[form]
        counts, _ = np.histogram(ratio[form], BANDS, weights=area)
        for band, count in enumerate(counts):
            quantity = f"us/ur from {BANDS[band]:g}, % of the area"
            share = 100 * float(count / area.sum())
            label = f"{name}, z0 {1e3 * one.roughness_m:g} mm"
            yield row("piles", label, quantity, share, AREAS[name][band])


def askervein_hill() -> Surface:
    """Askervein hill by the Copernicus model of heights, tapered to level ground."""
    table = pd.read_csv(HERE / "askervein_terrain.csv", comment="#")
    x, y = np.unique(table["x_m"]), np.unique(table["y_m"])
    z = table.pivot(index="y_m", columns="x_m", values="z_m").to_numpy()
    rim = np.concatenate([z[0], z[-1], z[:, 0], z[:, -1]])
    level = float(np.median(rim))
    to_x = np.minimum(x - x[0], x[-1] - x)
    to_y = np.minimum(y - y[0], y[-1] - y)
    inside = np.minimum(to_x, to_y[:, None]) / TAPERED
    weight = (1 - np.cos(np.pi * np.clip(inside, 0.0, 1.0))) / 2
    tapered = level + (z - level) * weight
    return surface_of("Askervein", x, y, tapered, level, SPREAD_OF_SHAPE)


def at_places(
    one: SurfaceFlowCase, directory: Path, places: FloatArray, above: float
) -> FloatArray:
    """Speed over some places in the axes of the file, m/s, linear between columns."""
    velocity = np.linalg.norm(one.velocity(directory), axis=-1)[1:]
    mesh = one.mesh
    logs = np.log(mesh.over_bed[1:])
    x = (mesh.x[1:] + mesh.x[:-1]) / 2
    y = (mesh.y[1:] + mesh.y[:-1]) / 2
    found = []
    for along, across in (places - one.surface.centre) @ one.axes.T:
        i = int(np.searchsorted(x, along)) - 1
        j = int(np.searchsorted(y, across)) - 1
        of_x = (along - x[i]) / (x[i + 1] - x[i])
        of_y = (across - y[j]) / (y[j + 1] - y[j])
        corners = {
            (i, j): (1 - of_x) * (1 - of_y),
            (i + 1, j): of_x * (1 - of_y),
            (i, j + 1): (1 - of_x) * of_y,
            (i + 1, j + 1): of_x * of_y,
        }
        parts = (
            weight * np.interp(np.log(above), logs[at], velocity[at])
            for at, weight in corners.items()
        )
        found.append(sum(parts))
    return np.array(found)


def askervein(cases: Path) -> Iterator[Row]:
    """The wind at the masts over that at the reference site far upstream."""
    surface = askervein_hill()
    masts = pd.read_csv(HERE / "askervein_masts.csv", comment="#")
    top = np.unravel_index(int(surface.z.argmax()), surface.z.shape)
    hilltop = np.array([surface.x[top[1]], surface.y[top[0]]])
    starts = {"A": hilltop, "B": hilltop, "AA": hilltop + TO_CP * towards(RIDGE_DEG)}
    half = (surface.x[-1] - surface.x[0]) / 2 - TAPERED
    for level in HILLS:
        one = SurfaceFlowCase(surface, HILL_FROM_DEG, 16.0, HILL_ROUGHNESS, AIR, level)
        directory = solve(one, cases)
        reference = reference_speed(one, directory)
        for line, table in masts.groupby("line"):
            bearing = RIDGE_DEG if line == "B" else ALONG_DEG
            along = 1000 * table["distance_km"].to_numpy()
            places = starts[str(line)] + along[:, None] * towards(bearing)
            is_in = np.all(np.abs(places - surface.centre) <= half, axis=1)
            speeds = at_places(one, directory, places[is_in], REFERENCE) / reference
            measured = table["speed_over_reference"].to_numpy()[is_in]
            cells = f"{one.mesh.cells} cells, line {line}"
            for place, value, beside in zip(
                along[is_in], speeds, measured, strict=True
            ):
                name = f"{cells}, {place:.0f} m"
                quantity = "U/U_RS at 10 m"
                yield row("askervein", name, quantity, float(value), float(beside))
            error = speeds - measured
            rms = float(np.sqrt(np.mean(error**2)))
            name = f"{cells}, {len(error)} masts"
            yield row("askervein", name, "rms of the differences", rms, np.nan)
            bias = float(error.mean())
            yield row("askervein", name, "mean of the differences", bias, np.nan)


def towards(bearing_deg: float) -> FloatArray:
    """Unit vector of a bearing, degrees from north."""
    angle = np.radians(bearing_deg)
    return np.array([np.sin(angle), np.cos(angle)])


PARTS = {
    "ridge": ridge,
    "turn": turn,
    "interval": interval,
    "piles": piles,
    "askervein": askervein,
}


def main(directory: str, *parts: str) -> None:
    """Run the parts and print the table."""
    cases = Path(directory)
    cases.mkdir(parents=True, exist_ok=True)
    is_first = True
    for part in parts or PARTS:
        for one in PARTS[part](cases):
            table = pd.DataFrame([one])
            text = table.to_csv(
                index=False, header=is_first, float_format="%.4g", lineterminator="\n"
            )
            print(text, end="", flush=True)
            is_first = False


if __name__ == "__main__":
    main(*sys.argv[1:])
