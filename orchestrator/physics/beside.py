"""What was measured beside a threshold on a level bed, as columns.

In a liquid it is rows of flumes, by eye; in a gas it is three sites in the field.
Beside these stands a formula, within the range of fluids and sizes that it was fitted
in: it is called a formula, never measured. An interval is that which held the
thresholds of flumes, from the tenth to the ninetieth percentile over the model's.
``tested.csv`` has those of single grains, ``tested_strips.csv`` those of poured
strips, each with the ranges of numbers that it is of: of the model's Re*, the ratio of
densities, the entrainment angle, d/z0 and more. Outside of them there is none.
``tools/tested.py`` makes both.
"""

import csv
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.physics.constants import GAS_BELOW, LIFT_COEFFICIENT
from orchestrator.physics.curves import of_medium
from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import VISUAL
from orchestrator.types import BoolArray, FloatArray

FIELD = (0.0110, 0.0126, 0.0129)
"""Shields numbers of the fluid threshold at three sites, by R. L. Martin and J. F. Kok,
2018, doi:10.1029/2017JF004416: sand of 0.40 to 0.53 mm."""
FIELD_REYNOLDS = (4.4, 27.0)
"""Re* near those of the sites, 8.8 to 13.5: within a factor of 2."""
AIR_OF_QUARTZ = (1085.0, 4580.0)
"""Densities of grains over that of the gas, within 2 of those of the sites in the
field, 2,170 to 2,290. The formula of Shao and Lu is taken for such grains alone."""
VISCOSITY_OF_AIR = (7.5e-6, 3e-5)
"""Kinematic viscosities of gases that are like air, m2/s: within 2 of 1.5e-5."""
OF_TUNNELS = (1.2e-5, 1.29e-3)
"""Diameters of the grains of the wind tunnels that the formula of Shao and Lu was
fitted to, m; the lower end is in the abstract of R. Greeley et al., Geophys. Res. Lett.
3, 1976, the upper end is from memory."""
OF_FLUMES = (1.28, 4.7)
"""Densities of grains over that of the liquid, from the least to the largest of the
rows of flumes."""
DSTAR_OF_FLUMES = (0.379, 1705.0)
"""Dimensionless diameters of the rows of flumes, steep ones included. The formula of
Soulsby and Whitehouse is taken there: the range of their own rows was not found."""
MOST_COHESION = 9.1e-5
"""Largest cohesion of dry grains in air, N/m: the pull of a contact over the diameter
that holds a grain between neighbours at 30 degrees as `curves.GAMMA` does,
pi GAMMA/(12 cos 30 deg) = 9.07e-5."""
MEASURED: Mapping[str, str] = {
    "formula_shields": (
        "Shields number of the same grain on a level bed by a formula: of Soulsby and "
        "Whitehouse in a liquid, of Shao and Lu in a gas; empty outside of what is "
        "like the grains that it was fitted to: densities over that of a liquid of "
        "1.28 to 4.7 and D* of 0.379 to 1705, the rows of flumes, over that of a gas "
        "of 1085 to 4580, grains of 0.012 to 1.29 mm and 7.5e-6 to 3e-5 m2/s"
    ),
    "measured_median": (
        "median of the Shields numbers that were measured on level beds at this Re*, "
        "by eye in flumes or in the field; empty where there are no rows near"
    ),
    "measured_low": "tenth percentile of these rows, in a gas the least",
    "measured_high": "ninetieth percentile of these rows, in a gas the largest",
    "measured_rows": "number of these rows",
}
"""Columns of the formula and of what was measured at the Re*."""

COMPARED_WITH, FLUMES, FORMULA = "compared_with", "flumes", "formula"
"""Column that says what the columns ``compared_…`` of a flow are made of, and its
words: the median of flumes, or a formula."""
TESTED: Mapping[str, str] = {
    "tested_low": (
        "lower end of the interval of measured thresholds on answers of this kind "
        "(`orchestrator validate`), as wide as 80 % of them need when their set is "
        "left out, and up to the answer itself; the widest over the ranges of "
        "entrainment angle, d/z0, ratio of densities and Re* that the rows and answers "
        "are of; empty outside of them"
    ),
    "tested_high": "upper end of this interval",
    "tested_rows": (
        "number of these rows; in a gas three sites in the field and five points of a "
        "formula"
    ),
    "tested_held": (
        "share of them that it contained, each set predicted from the others; the "
        "least over these ranges"
    ),
}
"""Columns of the interval."""

ENTRAINED, SUSTAINED = "entrained", "sustained"
"""Criteria: a grain leaves its pocket, or its motion is also sustained after a gust."""
LIQUID, GAS = "liquid", "gas"
"""Media of the tested intervals."""
GRAINS = Path(__file__).with_name("tested.csv")
STRIPS = Path(__file__).with_name("tested_strips.csv")
"""The tested intervals of single grains, and of poured strips."""
OF_THE_TOOL = ("sets", "widened")
"""Columns of both files that no answer needs: `tools/tested.py` explains them."""
WINDOW = ("reynolds", "density_ratio")
"""Columns of the ranges that tell the windows of Re* of an interval apart."""
LEAST_WEIGHT = 1e-9
"""What a window counts at its ends, where it alone may be there."""
OF_STRIPS = ("sizes", "exposure", "sheltering")
"""Words that tell tested strips apart, beside those of all tested intervals."""
NUMBERS_OF_STRIPS = (
    "gust",
    "phi_deg",
    "poured_depth",
    "width",
    "mobile_layers",
    "fraction",
)
"""The same, of numbers; the gust of a steady flow is 1."""
TESTED_AS, GRAIN, STRIP = "tested_as", "grain", "strip"
"""Column that says of thresholds on beds what the tested ones were of that are like
them, and its words; that of any other bed is empty."""
LIKE = 0.01
"""Relative difference from a number that was not varied up to which an interval is
given: of the lift coefficient, of a grain's size over that of its neighbours, of the
numbers of a strip. So much of its weight may cohesion hold a grain that has none."""
LEVEL_DEG = 1.0
"""Steepest slope of a bed that is like those of the flumes, degrees."""
MOST_SLOPE_DEG = 30.0
"""Steepest slope on which sustained motion was found, and has an interval, degrees."""
FRICTION_DEG = (32.0, 50.0)
"""Friction angles of the slope laws that bound that of sustained motion, degrees."""
NO_ROWS = (np.nan, np.nan, np.nan, 0.0)
"""Median, tenth and ninetieth percentile, and count, where nothing was measured."""


def beside(table: Any) -> dict[str, FloatArray]:
    """Look up what was measured beside thresholds.

    Parameters
    ----------
    table
        A table, or a mapping of columns, of n thresholds: Re*, the Shields number, and
        the columns of grain and fluid.

    Returns
    -------
    dict of str to ndarray
        The columns `MEASURED` and `TESTED`, each of shape (n,).
    """
    reynolds = np.asarray(table["reynolds"], float)
    grain = _grain(table)
    is_gas = grain.fluid_density < GAS_BELOW
    formula = by_formula(grain)
    rows = np.where(is_gas, _of_field(reynolds).T, _of_flumes(reynolds).T)
    # of other grains nothing was measured, whatever a formula says
    is_alike = _is_alike(grain.density_ratio, is_gas)
    rows = np.where(is_alike, rows, np.array(NO_ROWS)[:, None])
    held = tested(table)
    width = _slope_width(table)
    held[0] *= np.asarray(table["shields"], float) / width
    held[1] *= np.asarray(table["shields"], float) * width
    return dict(zip((*MEASURED, *TESTED), [formula, *rows, *held], strict=True))


def _grain(table: Any) -> Grain:
    """The grains of a table in their fluids."""
    return Grain(
        diameter=table["d_m"],
        density=table["rho_sol_kg_m3"],
        fluid_density=table["rho_f_kg_m3"],
        viscosity=table["nu_m2_s"],
        gravity=table["g_m_s2"],
    )


def by_formula(grain: Grain) -> FloatArray:
    """Find the threshold of grains on a level bed by the formula of their medium.

    It is that of Soulsby and Whitehouse in a liquid and that of Shao and Lu in a gas.

    Parameters
    ----------
    grain
        The grains.

    Returns
    -------
    ndarray
        Shields numbers; NaN of grains and fluids that are not like those that the
        formula was fitted to.
    """
    is_gas = grain.fluid_density < GAS_BELOW
    dstar = grain.dimensionless_diameter
    is_of_liquid = _is_within(dstar, DSTAR_OF_FLUMES)
    is_of_gas = _is_within(grain.diameter, OF_TUNNELS)
    is_of_gas &= _is_within(grain.viscosity, VISCOSITY_OF_AIR)
    fitted = np.where(is_gas, is_of_gas, is_of_liquid)
    fitted &= _is_alike(grain.density_ratio, is_gas)
    return np.where(fitted, of_medium(grain), np.nan)


def compared_level_ustar(table: Any) -> FloatArray:
    """Find the threshold of one grain on a level bed to compare the computed one with.

    Parameters
    ----------
    table
        A table, or a mapping of columns, with those of `beside`.

    Returns
    -------
    ndarray
        Friction velocity, m/s: in a liquid that of the median of the flumes where they
        have rows, else that of the formula; `compared_with` says which. NaN where there
        is neither.
    """
    median = np.asarray(table["measured_median"], float)
    formula = np.asarray(table["formula_shields"], float)
    return _grain(table).ustar_at(np.where(_has_flumes(table), median, formula))


def compared_with(table: Any) -> NDArray[Any]:
    """Say what the threshold of `compared_level_ustar` is.

    Parameters
    ----------
    table
        As `compared_level_ustar` takes it.

    Returns
    -------
    ndarray
        `FLUMES`, `FORMULA`, or None where there is neither.
    """
    formula = np.asarray(table["formula_shields"], float)
    words = np.full(formula.shape, None, object)
    words[np.isfinite(formula)] = FORMULA
    words[_has_flumes(table)] = FLUMES
    return words


def _has_flumes(table: Any) -> BoolArray:
    """Whether flumes have rows near thresholds."""
    median = np.asarray(table["measured_median"], float)
    is_liquid = np.asarray(table["rho_f_kg_m3"], float) >= GAS_BELOW
    return np.asarray(is_liquid & np.isfinite(median))


def _is_alike(density_ratio: FloatArray, is_gas: BoolArray) -> BoolArray:
    """Whether grain and fluid have a ratio of densities as those that were measured."""
    in_liquid = _is_within(density_ratio, OF_FLUMES)
    in_gas = _is_within(density_ratio, AIR_OF_QUARTZ)
    return np.asarray(np.where(is_gas, in_gas, in_liquid))


def _is_within(value: FloatArray, ends: tuple[float, float]) -> BoolArray:
    """Whether numbers are between two ends, these included; NaN is not."""
    low, high = ends
    return np.asarray((value >= low) & (value <= high))


def _slope_width(table: Any) -> FloatArray:
    """Factor by which the interval of a sloping bed is wider than that of a level one.

    It is the range of the usual slope laws of the `FRICTION_DEG`; the intervals of
    grains that leave are of level beds alone.
    """
    alpha = np.radians(np.asarray(table["alpha_deg"], float))
    most, least = (
        np.cos(alpha) + np.sin(alpha) / np.tan(np.radians(phi)) for phi in FRICTION_DEG
    )
    return np.asarray(np.where(alpha > np.radians(LEVEL_DEG), most / least, 1.0))


def _of_flumes(reynolds: FloatArray) -> FloatArray:
    """Median, percentiles and count of the rows of flumes at Re*; shape (n, 4)."""
    rows = [NO_ROWS]
    for each in VISUAL:
        rows.append((each.median, each.tenth, each.ninetieth, float(each.count)))
    rows.append(NO_ROWS)
    edges = [VISUAL[0].low, *(each.high for each in VISUAL)]
    return np.array(rows)[np.searchsorted(edges, reynolds, side="right")]


def _of_field(reynolds: FloatArray) -> FloatArray:
    """The same of the sites in the field, for what is near them; shape (n, 4)."""
    low, high = FIELD_REYNOLDS
    is_near = (reynolds > low) & (reynolds < high)
    sites = (float(np.median(FIELD)), min(FIELD), max(FIELD), float(len(FIELD)))
    return np.where(is_near[..., None], sites, NO_ROWS)


def tested(table: Any) -> FloatArray:
    """Find the intervals that held the measured thresholds of such beds.

    There are intervals of single grains, and of strips of sand by the pivots at a
    fraction of their grains.

    Parameters
    ----------
    table
        A table, or a mapping of columns, of n thresholds: Re*, and the columns of their
        scenes that they have.

    Returns
    -------
    ndarray
        Ends of the interval over the Shields number, the number of measured thresholds,
        and the share of them that it held, shape (4, n). Where there is none, there are
        no rows (0).
    """
    columns = _columns(table)
    count = len(columns["reynolds"])
    found = _none(count)
    is_lone, is_strip = _kinds(table, count)
    is_usual = _is_usual(table)
    for asked, path in ((is_lone, GRAINS), (is_strip, STRIPS)):
        asked &= is_usual
        if not asked.any():
            continue
        for kind in _intervals(path):
            here = kind.is_of(columns, asked)
            if here.any():
                found[:, here] = kind.widest(found[:, here], columns, here)
    return found


def _none(count: int) -> FloatArray:
    """No interval of each of some thresholds, shape (4, count)."""
    return np.array([[np.nan], [np.nan], [0.0], [np.nan]]).repeat(count, axis=1)


def window_weight(
    reynolds: FloatArray, ends: tuple[float, float], inside: BoolArray
) -> FloatArray:
    """Find how much a window of Re* counts for thresholds in it.

    Windows overlap. An interval is between those of the windows that its Re* is in, so
    that it has no step where one ends.

    Parameters
    ----------
    reynolds
        Re* of the thresholds, shape (n,).
    ends
        The ends of the window.
    inside
        Which of them the window is of, shape (n,).

    Returns
    -------
    ndarray
        1 in its middle, next to nothing at its ends, 0 outside.

    Examples
    --------
    >>> at = np.array([1.0, 10**0.25, 10**0.5, 10.0, 11.0])
    >>> print(window_weight(at, (1.0, 10.0), at <= 10).round(6))
    [0.  0.5 1.  0.  0. ]
    """
    low, high = np.log(ends)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = (np.log(reynolds) - low) / (high - low)
    weight = np.maximum(1 - np.abs(2 * part - 1), LEAST_WEIGHT)
    return np.where(inside, weight, 0.0)


class TestedWindow(NamedTuple):
    """A tested interval in a window of Re*.

    Attributes
    ----------
    ranges
        Ends of Re* and of the ratio of densities, both included, by the columns.
    low, high
        Ends of the interval over the Shields number.
    rows
        Number of measured thresholds.
    held
        Share of them that it held.
    """

    ranges: Mapping[str, tuple[float, float]]
    low: float
    high: float
    rows: float
    held: float

    def is_of(self, columns: Mapping[str, NDArray[Any]]) -> BoolArray:
        """Tell which of some thresholds are in the window.

        Parameters
        ----------
        columns
            Their columns, each of shape (n,).

        Returns
        -------
        ndarray
            Truth values, shape (n,).
        """
        is_within = (_is_within(columns[name], self.ranges[name]) for name in WINDOW)
        return np.asarray(np.logical_and.reduce([*is_within]))


class TestedKind(NamedTuple):
    """The tested intervals of thresholds of a kind, over Re*.

    Attributes
    ----------
    words
        Words by the columns of a table.
    ranges
        Ends of numbers, both included, by the columns.
    windows
        The intervals by windows of Re*.
    """

    words: Mapping[str, str]
    ranges: Mapping[str, tuple[float, float]]
    windows: tuple[TestedWindow, ...]

    def is_of(self, columns: Mapping[str, NDArray[Any]], asked: BoolArray) -> BoolArray:
        """Tell which of some thresholds it is of.

        Parameters
        ----------
        columns
            Their columns, each of shape (n,).
        asked
            Those among which it is looked for, shape (n,).

        Returns
        -------
        ndarray
            Truth values, shape (n,).
        """
        here = asked.copy()
        for name, word in self.words.items():
            here &= columns[name] == word
            if not here.any():
                return here
        for name, ends in self.ranges.items():
            here &= _is_within(columns[name], ends)
        return here

    def widest(
        self,
        found: FloatArray,
        columns: Mapping[str, NDArray[Any]],
        here: BoolArray,
    ) -> FloatArray:
        """Join it to other intervals of the same thresholds: at the end of two ranges.

        Parameters
        ----------
        found
            The other intervals, shape (4, m); those without rows are none.
        columns
            The columns of n thresholds.
        here
            Which of these the m are, shape (n,).

        Returns
        -------
        ndarray
            The widest ends, the fewest rows, and the least part that was held.
        """
        own = self.between({name: columns[name][here] for name in WINDOW})
        low, _, _, held = np.fmin(found, own)
        high = np.fmax(found[1], own[1])
        rows = np.where(found[2] > 0, found[2], own[2])
        rows = np.where(own[2] > 0, np.minimum(rows, own[2]), rows)
        return np.stack([low, high, rows, held])

    def between(self, columns: Mapping[str, NDArray[Any]]) -> FloatArray:
        """Find the interval of each of some thresholds between those of its windows.

        Parameters
        ----------
        columns
            Their columns of the `WINDOW`, each of shape (m,).

        Returns
        -------
        ndarray
            Ends, rows and part as of `tested`, the fewest and the least of the windows,
            shape (4, m).
        """
        reynolds = columns["reynolds"]
        total = np.zeros(len(reynolds))
        logs = np.zeros((2, len(reynolds)))
        rows, held = np.full((2, len(reynolds)), np.inf)
        for window in self.windows:
            inside = window.is_of(columns)
            weight = window_weight(reynolds, window.ranges["reynolds"], inside)
            total += weight
            logs += weight * np.log([[window.low], [window.high]])
            rows[inside] = np.minimum(rows[inside], window.rows)
            held[inside] = np.minimum(held[inside], window.held)
        is_known = total > 0
        made = _none(len(reynolds))
        made[:2, is_known] = np.exp(logs[:, is_known] / total[is_known])
        made[2, is_known], made[3, is_known] = rows[is_known], held[is_known]
        return made


@cache
def _intervals(path: Path) -> tuple[TestedKind, ...]:
    """The tested intervals of a file."""
    text = path.read_text(encoding="utf-8")
    found: dict[Any, TestedKind] = {}
    for row in csv.DictReader(text.splitlines()):
        kind = _kind(row)
        key = tuple(kind.words.items()), tuple(kind.ranges.items())
        others = found[key].windows if key in found else ()
        found[key] = kind._replace(windows=others + kind.windows)
    return tuple(found.values())


def _kind(row: Mapping[str, str]) -> TestedKind:
    """A tested interval of a row: numbers have columns for their two ends."""
    own = {name: float(row[name]) for name in ("low", "high", "rows", "held")}
    words, ranges = {}, {}
    for name, value in row.items():
        if name in own or name in OF_THE_TOOL:
            continue
        column, _, end = name.rpartition("_")
        if end == "low":
            ranges[column] = (float(value), float(row[f"{column}_high"]))
        elif end != "high":
            words[name] = value
    window = TestedWindow({name: ranges.pop(name) for name in WINDOW}, **own)
    return TestedKind(words, ranges, (window,))


def _columns(table: Any) -> dict[str, NDArray[Any]]:
    """What tested intervals are told apart by, of some thresholds."""
    grain = _grain(table)
    cohesion = np.asarray(table["cohesion_n_m"], float)
    pull_over_weight = cohesion * grain.diameter / grain.weight
    columns: dict[str, NDArray[Any]] = {
        "medium": np.where(grain.fluid_density < GAS_BELOW, GAS, LIQUID),
        "force_law": np.asarray(table["force_law"], object),
        "criterion": np.full(grain.shape, ENTRAINED, object),
        "reynolds": np.asarray(table["reynolds"], float),
        "density_ratio": grain.density_ratio,
        "alpha_deg": np.asarray(table["alpha_deg"], float),
        "beta_deg": np.asarray(table["beta_deg"], float),
        "d_over_z0": grain.diameter / np.asarray(table["z0_m"], float),
        "cohesion_n_m": np.where(pull_over_weight < LIKE, 0.0, cohesion),
    }
    if "criterion" in table:
        is_sustained = np.asarray(table["criterion"], object) == SUSTAINED
        columns["criterion"] = np.where(is_sustained, SUSTAINED, ENTRAINED)
    for name in OF_STRIPS:
        if name in table:
            words = np.asarray(table[name], object)
            columns[name] = np.array([_word(each) for each in words], object)
    for name in NUMBERS_OF_STRIPS:
        if name in table:
            columns[name] = np.asarray(table[name], float)
    if "gust" in columns:
        columns["gust"] = np.nan_to_num(columns["gust"], nan=1.0)
    return columns


def _word(value: Any) -> str:
    """A word of a table; empty where it has none."""
    return value if isinstance(value, str) else ""


def _is_usual(table: Any) -> BoolArray:
    """Whether grains have the lift and the neighbours of those that were tested."""
    lift = np.asarray(table["alpha_s"], float)
    is_usual = np.abs(lift / LIFT_COEFFICIENT - 1) <= LIKE
    if "relative_size" not in table:
        return np.asarray(is_usual)
    size = np.asarray(table["relative_size"], float)
    # a bed of many grains has none
    return np.asarray(is_usual & ~(np.abs(size - 1) > LIKE))


def _kinds(table: Any, count: int) -> tuple[BoolArray, BoolArray]:
    """Whether thresholds are of single grains, or as of such, and whether of strips."""
    if "bed" not in table:
        return np.ones(count, bool), np.zeros(count, bool)
    kinds = np.asarray(table[TESTED_AS], object)
    return kinds == GRAIN, kinds == STRIP
