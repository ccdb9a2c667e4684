"""What was measured beside a threshold on a level bed, as columns and in words.

In a liquid it is rows of flumes, by eye; in a gas it is three sites in the field; in
both it is a curve, too. An interval is that which held the thresholds of flumes, from
the tenth to the ninetieth percentile over the model's, for one kind of bed and forces
and a range of the model's Re*: ``tested.csv``, by `orchestrator validate` and
``tools/tested.py``.
"""

import csv
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.physics.constants import GAS_BELOW, LIFT_COEFFICIENT
from orchestrator.physics.curves import Air, shao_lu, soulsby_whitehouse
from orchestrator.physics.measured import VISUAL
from orchestrator.types import FloatArray

FIELD = (0.0110, 0.0126, 0.0129)
"""Shields numbers of the fluid threshold at three sites, by R. L. Martin and J. F. Kok,
2018, doi:10.1029/2017JF004416: sand of 0.40 to 0.53 mm."""
FIELD_REYNOLDS = (4.4, 27.0)
"""Re* near those of the sites, 8.8 to 13.5: within a factor of 2."""
AIR_OF_QUARTZ = (1085.0, 4580.0)
"""Densities of grains over that of the gas, within 2 of those of the sites in the
field, 2,170 to 2,290."""
MOST_COHESION = 5e-5
"""Largest cohesion of the grains whose thresholds were measured in air, N/m: the curve
of the wind tunnel is answered with that of Shao and Lu's gamma of 1.65e-4 N/m."""
MEASURED = (
    "measured_curve",
    "measured_median",
    "measured_low",
    "measured_high",
    "measured_rows",
)
"""Columns of what was measured at the Re*; `tables/columns.csv` explains them."""
TESTED = ("tested_low", "tested_high", "tested_rows", "tested_held")
"""Columns of the interval; `tables/columns.csv` explains them."""
OF_KIND = (
    "alpha_s",
    "cohesion_n_m",
    "alpha_deg",
    "relative_size",
    "rho_f_kg_m3",
    "rho_sol_kg_m3",
    "force_law",
    "d_m",
    "z0_m",
    "bed",
    "beta_deg",
    "bed_shape",
    "profile",
    "obstacles",
    "width",
    "sizes",
    "method",
    "exposure",
    "sheltering",
    "fraction",
    "gusts",
    "phi_deg",
    "poured_depth",
    "mobile_layers",
    "counted",
    "loaded_grains",
    "length",
    "h_m",
    "criterion",
    "decides",
    "row_hold",
)
"""Columns that the kind of a threshold follows from."""
LENGTHS = ("d_m", "length", "h_m")
"""Those of them that are lengths, of which the ratios to z0 alone matter."""
GOES_ON = "goes on"
"""The criterion of the kinds of grains that must go on after a gust."""
LEVEL_DEG = 1.0
"""Steepest slope of a bed that is like those of the flumes, degrees."""
TABLE = Path(__file__).with_name("tested.csv")
"""The tested intervals."""
ROW_HOLD = 1.05
"""u*_0 of the first grain in its row, over that of the grain alone, from which the row
holds it."""
NOT_MEASURED = "nothing was measured"
"""The beginning of a reason why a threshold is not usable: no measurement is near."""
MOST_SLOPE_DEG = 30.0
"""Slope to which an interval of grains that go on is given, degrees."""
FRICTION_DEG = (32.0, 50.0)
"""Friction angles of the slope laws that bound that of grains that go on, degrees."""
LEAST_LENGTH = 20.0
"""Length of the strips whose intervals were found, d: shorter ones have too few
grains."""
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
    diameter = np.asarray(table["d_m"], float)
    density = np.asarray(table["rho_sol_kg_m3"], float)
    fluid_density = np.asarray(table["rho_f_kg_m3"], float)
    viscosity = np.asarray(table["nu_m2_s"], float)
    gravity = np.asarray(table["g_m_s2"], float)
    ratio = density / fluid_density
    excess = (ratio - 1) * gravity
    is_gas = fluid_density < GAS_BELOW
    air = Air(density, fluid_density, viscosity, gravity)
    in_gas = shao_lu(diameter, air) ** 2 / (excess * diameter)
    in_liquid = soulsby_whitehouse(diameter * (excess / viscosity**2) ** (1 / 3))
    rows = np.where(is_gas[..., None], _of_field(reynolds, ratio), _of_flumes(reynolds))
    held = np.array([*map(interval, _kinds(table), reynolds.tolist())], float).T
    held[:2] *= np.asarray(table["shields"], float)
    held[0] /= _slope_width(table)
    held[1] *= _slope_width(table)
    columns = [np.where(is_gas, in_gas, in_liquid), *rows.T, *held]
    return dict(zip((*MEASURED, *TESTED), columns, strict=True))


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


def _of_field(reynolds: FloatArray, density_ratio: FloatArray) -> FloatArray:
    """The same of the sites in the field, for what is near them; shape (n, 4)."""
    low, high = FIELD_REYNOLDS
    is_near = (reynolds > low) & (reynolds < high)
    low, high = AIR_OF_QUARTZ
    is_near &= (density_ratio > low) & (density_ratio < high)
    sites = (float(np.median(FIELD)), min(FIELD), max(FIELD), float(len(FIELD)))
    return np.where(is_near[..., None], sites, NO_ROWS)


def _kinds(table: Any) -> list[str]:
    """The kind of each row of a table; thousands of rows have few."""
    z0 = np.asarray(table["z0_m"], float)
    given = {}
    for name in OF_KIND:
        if name in table:
            given[name] = _comparable(np.asarray(table[name]).tolist())
    for name in LENGTHS:
        if name in table:
            ratio = np.asarray(table[name], float) / z0
            given[name] = _comparable([float(f"{value:.3g}") for value in ratio])
    given["z0_m"] = [1.0] * len(z0)
    rows = [*zip(*given.values(), strict=True)]
    kinds = {row: kind_of(dict(zip(given, row, strict=True))) for row in {*rows}}
    return [kinds[row] for row in rows]


def _comparable(values: list[Any]) -> list[Any]:
    """Values with None for NaN, which is not equal to another NaN."""
    return [None if value != value else value for value in values]


def kind_of(row: Mapping[str, Any]) -> str:
    """The kind of a threshold.

    There are kinds of single grains, and of strips of sand by the pivots at a fraction
    of their grains. There are none on slopes, and in a gas three rows, too few.

    Parameters
    ----------
    row
        Columns of its scene, those of `OF_KIND` that it has.

    Returns
    -------
    str
        The kind; empty where no rows are like it.
    """
    if not _is_as_tested(row):
        return ""
    words = [row["force_law"], f"z0 d/{row['d_m'] / row['z0_m']:.3g}"]
    if row.get("bed", "grain") == "grain" or _is_alone(row):
        words += ["grain", f"beta {row['beta_deg']:g}"]
        if row.get("criterion") == GOES_ON:
            words.append(GOES_ON)
        if row["rho_f_kg_m3"] < GAS_BELOW:
            words.append("air")
    elif _is_strip(row):
        words += [
            "strip",
            f"phi {row['phi_deg']:g}",
            f"{row['poured_depth']:g} d deep",
            f"{row['width']:g} d wide",
            f"{row['mobile_layers']:g} layers",
            str(row["sizes"]),
            row["exposure"],
            row["sheltering"],
            f"n/N {row['fraction']:g}",
        ]
    else:
        return ""
    gusts = row.get("gusts")
    if isinstance(gusts, str):
        words.append(f"gusts {gusts}")
    return ", ".join(words)


def _is_alone(row: Mapping[str, Any]) -> bool:
    """Whether the grains of a pile go on as single exposed ones would.

    They do along a bed line, in the closed form. Equal grains in rows do where going on
    holds them longest, or where the row does not hold its first grain.
    """
    if row.get("criterion") != GOES_ON:
        return False
    if row.get("method") == "local":
        return True
    if row["sizes"] or row["width"] or row["sheltering"] != "none":
        return False
    held = row.get("row_hold")
    is_free = held is not None and held < ROW_HOLD
    return is_free or row.get("decides") == GOES_ON


def _is_as_tested(row: Mapping[str, Any]) -> bool:
    """Whether grains, fluid and slope are of a kind that was measured."""
    goes_on = row.get("criterion") == GOES_ON
    if row["alpha_s"] != LIFT_COEFFICIENT:
        return False
    is_gas = row["rho_f_kg_m3"] < GAS_BELOW
    if row["cohesion_n_m"] > (MOST_COHESION if goes_on and is_gas else 0.0):
        return False
    if row["alpha_deg"] > (MOST_SLOPE_DEG if goes_on else LEVEL_DEG):
        return False
    if row.get("relative_size") not in (1.0, None):
        return False
    return not is_gas or (goes_on and _is_quartz_in_air(row))


def _is_quartz_in_air(row: Mapping[str, Any]) -> bool:
    """Whether grain and gas have a ratio of densities as those that were measured."""
    low, high = AIR_OF_QUARTZ
    return bool(low < row["rho_sol_kg_m3"] / row["rho_f_kg_m3"] < high)


def _is_strip(row: Mapping[str, Any]) -> bool:
    """Whether a bed is a level strip like those tested, all of whose grains count."""
    # the strips that were tested have grains that leave
    if row.get("criterion") == GOES_ON:
        return False
    # a profile and obstacles have a text
    if row["bed_shape"] != "flat" or row["profile"] or row["obstacles"]:
        return False
    if row["counted"] not in (None, "all"):
        return False
    if not row["width"] or row["method"] != "pivot":
        return False
    if row["loaded_grains"] != "exposed":
        return False
    length = row["length"] or 4 * row["h_m"]
    return bool(length / row["d_m"] > LEAST_LENGTH * (1 - 1e-2))


def interval(kind: str, reynolds: float) -> list[float]:
    """The interval that held the measured thresholds of a kind.

    Parameters
    ----------
    kind
        The kind, by `kind_of`.
    reynolds
        Re*.

    Returns
    -------
    list of float
        Ends of the interval over the Shields number, the number of rows, and the share
        of them that it held. There are no rows (0) where fewer than ten are alike.
    """
    for low, high, *found in _table().get(kind, ()):
        if low <= reynolds < high:
            return found
    return [np.nan, np.nan, 0, np.nan]


@cache
def _table() -> dict[str, list[list[float]]]:
    """By kind: the ends of each range of Re*, and the interval."""
    table: dict[str, list[list[float]]] = {}
    text = TABLE.read_text(encoding="utf-8")
    _, *rows = csv.reader(text.splitlines())
    for kind, *numbers in rows:
        table.setdefault(kind, []).append([float(number) for number in numbers])
    return table


def sentences(row: Mapping[Any, Any]) -> tuple[str, str]:
    """Say what was measured beside a threshold, and which of it its interval held.

    Parameters
    ----------
    row
        The row of the threshold, with the columns of `beside`.

    Returns
    -------
    measured, tested : str
        A sentence on each.
    """
    is_gas = row["rho_f_kg_m3"] < GAS_BELOW
    said = _in_gas(row) if is_gas else _in_liquid(row)
    low, high, count, held = (row[name] for name in TESTED)
    if not count:
        none = "fewer than ten measured thresholds are of such beds at this Re*"
        return said, f"no tested interval: {none}"
    where = "rows in air" if is_gas else "flume rows"
    rows = f"{held:.0%} of {count:g} {where} lie within {low:.3f} and {high:.3f}"
    return said, f"θ {row['shields']:.3f}; {rows}"


def _in_liquid(row: Mapping[Any, Any]) -> str:
    """What was measured in flumes."""
    curve, median, low, high, count = (row[name] for name in MEASURED)
    by = f"the curve of Soulsby and Whitehouse {curve:.3f}"
    if not count:
        where = f"no flume has rows at Re* {row['reynolds']:.3g}"
        return f"measured beside it: {by}; {where}"
    rows = f"θ {median:.3f}, 10 to 90 % {low:.3f} to {high:.3f}, {count:g} rows"
    return f"measured at this Re* on level beds in flumes, by eye: {rows}; {by}"


def _in_gas(row: Mapping[Any, Any]) -> str:
    """What was measured in the field."""
    curve, median, low, high, count = (row[name] for name in MEASURED)
    theta = row["shields"]
    over = theta / curve
    by = f"the curve of Shao and Lu has θ {curve:.4f}, this is {over:.2g} times it"
    by = f"{by}, {over**0.5:.3g} times in u*"
    if not count:
        theirs = "Re* 9 to 14 and densities 2170 to 2290 times the gas's"
        ratio = row["rho_sol_kg_m3"] / row["rho_f_kg_m3"]
        this = f"Re* {row['reynolds']:.3g} and {ratio:.3g}"
        return f"{by}; no field rows are near it: they have {theirs}, this has {this}"
    rows = f"{low:.3f} to {high:.3f} at {count:g} sites (Martin and Kok 2018)"
    said = f"measured in air on level beds: {by}; in the field {rows}"
    return f"{said}, this is {theta / median:.2g} times"
