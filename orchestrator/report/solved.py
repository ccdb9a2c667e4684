"""Solved flows of a study: which are kept, their stress and velocity, their beds."""

from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from orchestrator.flow.foam import flow_in
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, style
from orchestrator.report.results import Results
from orchestrator.report.style import Look
from orchestrator.report.subjects import place_of_file
from orchestrator.study import fields
from orchestrator.types import FloatArray

FELT: Look = {
    "label": "as the grains feel it (averaged)",
    "gid": "grains",
    "color": "#f0a35e",
    "lw": 0,
    "marker": ".",
    "ms": 7,
    "zorder": 1.5,
}
REVERSED: Look = {
    "label": "reversed flow",
    "gid": "reversed flow",
    "color": "0.85",
    "lw": 0,
}
USTAR = "u*/u*₀"
SMALL_M = 0.5
"""Height of a bed up to which its lengths are in mm, m."""
OF_LINE = (
    "bed_shape",
    "windward",
    "lee_slope_deg",
    "brink_radius",
    "length",
    "forms",
    "spacing",
    "profile",
    "towards",
    "obstacles",
    "flow_top",
    "depth_m",
)
"""Fields of a scene, besides its slope and height, that shape the flow over its bed."""
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def title(results: Results, pile: Pile) -> str:
    """Name a pile by its slope, height, roughness, and fields in which flows differ.

    Returns
    -------
    str
        The title of its panel; that of a profile says where its x/h is zero.
    """
    names = ["alpha_deg", "h_m", "z0_m", *varied(results)]
    values = [fields.COLUMNS[name].used(pile.scene) for name in names]
    title = labels.panel(pd.Series(values, names, dtype=object), names)
    profile = pile.bed.profile
    if profile is None:
        return title
    zero = f"x/h from x = {place_of_file(profile.origin[0], profile)} m"
    return f"{title}, {zero} towards {profile.towards}"


def varied(results: Results) -> list[str]:
    """List the fields, of the bed line and of the solve, in which flows differ.

    Returns
    -------
    list of str
        The columns.
    """
    beds = results.beds("pile")
    lines = [name for name in OF_LINE if beds[name].nunique(dropna=False) > 1]
    return [*lines, *results.flow_fields]


def piles_by_kind(results: Results) -> list[list[Pile]]:
    """List piles with flows by slope, height and the fields in which flows differ.

    Returns
    -------
    list of list of Pile
        The piles of each kind, by rising z0.
    """
    differing = varied(results)

    def kind(pile: Pile) -> tuple[float, float, str]:
        texts = [str(fields.COLUMNS[name].used(pile.scene)) for name in differing]
        return pile.bed.slope_deg, pile.bed.height, ", ".join(texts)

    def by_kind_and_roughness(pile: Pile) -> tuple[float, float, str, float]:
        return *kind(pile), pile.bed.roughness

    piles = sorted(results.flows.values(), key=by_kind_and_roughness)
    return [list(alike) for _, alike in groupby(piles, kind)]


def piles_with_files(results: Results) -> list[Pile]:
    """A pile for each kind of flow whose files are kept.

    Returns
    -------
    list of Pile
        The piles.
    """
    found = []
    for kind in piles_by_kind(results):
        kept = [pile for pile in kind if results.is_whole(pile.flow)]
        found += kept[:1]
    return found


def stress_on(pile: Pile, results: Results) -> pd.DataFrame:
    """Find the stress along the bed of a pile whose flow is solved.

    Returns
    -------
    DataFrame
        Rows of the table ``wall_stress``. Scenes may share a flow and be of files with
        other axes: x is that of the pile's.
    """
    table = results.tables.get("wall_stress", pd.DataFrame())
    if table.empty:
        return table
    rows: pd.DataFrame = table[table["flow_case"] == pile.flow.name]
    if rows.empty or not pile.bed.profile:
        return rows
    along = results.flows[pile.flow.name].bed.along(rows["x_m"])
    return rows.assign(x_m=pile.bed.place(along))


def eq10_over_wall(
    results: Results, flow_cases: tuple[str, ...]
) -> tuple[float, float]:
    """Compare u* by Eq. 10 with that of the wall stress.

    Parameters
    ----------
    results
        The study with its tables.
    flow_cases
        Names of the flows.

    Returns
    -------
    mean, crest : float
        Relative differences: the mean of windward faces, the largest of their crests.
    """
    table = results.tables["wall_stress"]
    means = []
    crests = []
    for name, rows in table[table["flow_case"].isin(flow_cases)].groupby("flow_case"):
        crest_s = results.flows[str(name)].model.line.crest_s
        face = rows[(rows["s_m"] > 0) & (rows["s_m"] < crest_s)]
        wall = face["ustar_over_ustar0_wall"]
        eq10 = face["ustar_over_ustar0_eq10"]
        means.append(eq10.mean() / wall.mean() - 1)
        crests.append(eq10.max() / wall.max() - 1)
    return float(np.mean(means)), float(np.max(crests))


def over_u_e(
    pile: Pile, cases: Path, window: Window, unit: float, width: int = 800
) -> FloatArray:
    """Velocity over U_e on a grid.

    Parameters
    ----------
    pile
        A pile whose flow is solved.
    cases
        Directory of the cases.
    window
        Left, right, bottom and top, in units of `unit`.
    unit
        A length, m.
    width
        Columns of the grid.

    Returns
    -------
    array of shape (rows, width, 3)
        Rows upwards; NaN outside the mesh.
    """
    left, right, bottom, top = np.multiply(window, unit)
    rows = round(width * (top - bottom) / (right - left))
    x = np.linspace(left, right, width)
    z = np.linspace(bottom, top, rows)
    bed = pile.flow.bed_line
    lid = pile.flow.lid * pile.flow.height_m
    above = z - bed.height(x)[:, None]
    is_beside = (x < bed.x[0]) | (x > bed.x[-1])
    is_outside = (above < 0) | (z > lid) | is_beside[:, None]
    # a height of 1 stands for those that are not used
    heights = np.where(is_outside, 1.0, np.maximum(above, 1e-12))
    values = flow_in(cases / pile.flow.name).at("U", x, heights, bed)
    grid = np.where(is_outside[..., None], np.nan, values.reshape(*above.shape, 3))
    return np.asarray(grid.swapaxes(0, 1) / pile.scene.method.flow.speed)


class LengthUnit(NamedTuple):
    """The unit of the lengths of a page: mm of a small bed, else m, or heights.

    Attributes
    ----------
    name
        The unit.
    scale
        What a length in m is multiplied with; 0 where the unit is the height.
    """

    name: str
    scale: float

    @classmethod
    def of(cls, pile: Pile) -> "LengthUnit":
        """Find the unit of a bed.

        Returns
        -------
        LengthUnit
            mm of a bed below half a metre; a profile has the metres of its file.
        """
        is_small = pile.bed.height < SMALL_M and not pile.bed.profile
        return cls("mm", 1e3) if is_small else cls("m", 1.0)

    def of_height(self, pile: Pile) -> float:
        """Find the height of a pile in the unit.

        Returns
        -------
        float
            The height.
        """
        return self.scale * pile.bed.height if self.scale else 1.0


OVER_H = LengthUnit("h", 0.0)


def draw_bed(ax: Axes, pile: Pile) -> None:
    """Draw the bed under the flow.

    Parameters
    ----------
    ax
        The panel, in heights of the bed.
    pile
        The pile.
    """
    x, z = pile.model.line.corners.T / pile.bed.height
    ax.fill_between(x, z, z.min() - 1, color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")
