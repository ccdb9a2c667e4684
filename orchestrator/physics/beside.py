"""What was measured beside a threshold on a level bed, by columns of tables, and in words.

In a liquid it is rows of flumes, by eye, in a gas three sites in the field, and a curve in both. An
interval is that which held the thresholds of flumes, from the tenth to the ninetieth percentile
over the model's, for one kind of bed and forces and a range of the model's Re*: ``tested.csv``, by
`orchestrator validate` and ``tools/tested.py``.
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
"""Shields numbers of the fluid threshold at three sites, by R. L. Martin and J. F. Kok, 2018,
doi:10.1029/2017JF004416: sand of 0.40 to 0.53 mm."""
MEASURED = tuple(
    f"measured_{name}" for name in ("curve", "median", "low", "high", "rows")
)
TESTED = tuple(f"tested_{name}" for name in ("low", "high", "rows", "held"))
"""Columns of what was measured at the Re*, and of the interval; `tables/columns.csv` tells them."""
OF_KIND = (
    *(
        "alpha_s",
        "cohesion_n_m",
        "alpha_deg",
        "relative_size",
        "rho_f_kg_m3",
        "rho_sol_kg_m3",
        "force_law",
        "d_m",
    ),
    *(
        "z0_m",
        "bed",
        "beta_deg",
        "bed_shape",
        "profile",
        "obstacles",
        "width",
        "sizes",
    ),
    *(
        "method",
        "exposure",
        "sheltering",
        "fraction",
        "gusts",
        "phi_deg",
        "poured_depth",
    ),
    *("mobile_layers", "counted", "loaded_grains", "length", "h_m"),
    "criterion",
)
"""Columns that the kind of a threshold follows from."""
LENGTHS = ("d_m", "length", "h_m")
"""Those of them that are lengths, of which the ratios to z0 alone matter."""
GOES_ON = "goes on"
"""The criterion of the kinds of grains that must go on after a gust."""
TABLE = Path(__file__).with_name("tested.csv")
"""The tested intervals."""
AIR_OF_QUARTZ = (1085.0, 4580.0)
"""Densities of grains over that of the gas, within 2 of those of the sites in the field."""
MOST_SLOPE_DEG = 30.0
"""Slope to which an interval of grains that go on is given."""
FRICTION_DEG = (32.0, 50.0)
"""Friction angles of the slope laws that bound that of grains that go on."""
LEAST_LENGTH = 20.0
"""Length of the strips whose intervals were found, d: shorter ones have too few grains."""


def beside(table: Any) -> dict[str, FloatArray]:
    """Columns `MEASURED` and `TESTED` for thresholds, from a table or a mapping of columns."""
    names = (
        "reynolds",
        "d_m",
        "rho_sol_kg_m3",
        "rho_f_kg_m3",
        "nu_m2_s",
        "g_m_s2",
        "shields",
    )
    re, d, rho_s, rho, nu, g, theta = (np.asarray(table[name], float) for name in names)
    excess, is_gas = (rho_s / rho - 1) * g, rho < GAS_BELOW
    in_gas = shao_lu(d, Air(rho_s, rho, nu, g)) ** 2 / (excess * d)
    curve = np.where(
        is_gas, in_gas, soulsby_whitehouse(d * (excess / nu**2) ** (1 / 3))
    )
    none = (np.nan, np.nan, np.nan, 0.0)
    bins = [
        none,
        *((b.median, b.tenth, b.ninetieth, float(b.count)) for b in VISUAL),
        none,
    ]
    edges = [VISUAL[0].low, *(each.high for each in VISUAL)]
    flumes = np.array(bins)[np.searchsorted(edges, re, side="right")]
    # the sites have Re* 8.8 to 13.5 and grains 2,170 to 2,290 times as dense as the air: within 2
    least, most = AIR_OF_QUARTZ
    near = (re > 4.4) & (re < 27) & (rho_s / rho > least) & (rho_s / rho < most)
    ends = (float(np.median(FIELD)), min(FIELD), max(FIELD), float(len(FIELD)))
    rows = np.where(is_gas[..., None], np.where(near[..., None], ends, none), flumes)
    kinds = _kinds(table)
    held = np.array(list(map(interval, kinds, re.tolist())), float).T
    held[:2] *= theta
    wider = _slope_width(table)
    held[0] /= wider
    held[1] *= wider
    return dict(zip((*MEASURED, *TESTED), [curve, *rows.T, *held], strict=True))


def _slope_width(table: Any) -> FloatArray:
    """Factor by which the interval of a sloping bed is wider than that of a level one.

    It is the range of the usual slope laws of the `FRICTION_DEG`; the intervals of
    grains that leave are of level beds alone.
    """
    alpha = np.radians(np.asarray(table["alpha_deg"], float))
    most, least = (
        np.cos(alpha) + np.sin(alpha) / np.tan(np.radians(phi)) for phi in FRICTION_DEG
    )
    return np.asarray(np.where(alpha > np.radians(1), most / least, 1.0))


def _kinds(table: Any) -> list[str]:
    """The kind of each row of a table; thousands of rows have few."""
    given = {
        name: np.asarray(table[name]).tolist() for name in OF_KIND if name in table
    }
    z0 = np.asarray(table["z0_m"], float)
    for name in LENGTHS:
        if name in table:
            ratio = (np.asarray(table[name], float) / z0).tolist()
            given[name] = [float(f"{value:.3g}") for value in ratio]
    given["z0_m"] = [1.0] * len(z0)
    # one NaN for all: others are not equal to each other
    columns = ([x if x == x else None for x in column] for column in given.values())
    keys = [*zip(*columns, strict=True)]
    kinds = {key: kind_of(dict(zip(given, key, strict=True))) for key in {*keys}}
    return [kinds[key] for key in keys]


def kind_of(row: Mapping[str, Any]) -> str:
    """The kind of a threshold from columns of its scene; empty where no rows are like it.

    Of single grains, and of strips of sand by the pivots at a fraction of their grains; there are
    none on slopes, and in a gas three, too few.
    """
    if not _is_as_tested(row):
        return ""
    goes_on = row.get("criterion") == GOES_ON
    words = [row["force_law"], f"z0 d/{row['d_m'] / row['z0_m']:.3g}"]
    if row.get("bed", "grain") == "grain":
        words += ["grain", f"beta {row['beta_deg']:g}"]
        if goes_on:
            words.append(GOES_ON)
        if row["rho_f_kg_m3"] < GAS_BELOW:
            words.append("air")
    elif _is_strip(row):
        words += ["strip", f"phi {row['phi_deg']:g}", f"{row['poured_depth']:g} d deep"]
        words += [
            f"{row['width']:g} d wide",
            f"{row['mobile_layers']:g} layers",
        ]
        words += [str(row["sizes"]), row["exposure"], row["sheltering"]]
        words += [f"n/N {row['fraction']:g}"]
    else:
        return ""
    gusts = row.get("gusts")
    if isinstance(gusts, str):
        words.append(f"gusts {gusts}")
    return ", ".join(words)


def _is_as_tested(row: Mapping[str, Any]) -> bool:
    """Whether grains, fluid and slope are of a kind that was measured."""
    goes_on = row.get("criterion") == GOES_ON
    if row["alpha_s"] != LIFT_COEFFICIENT or row["cohesion_n_m"]:
        return False
    if row["alpha_deg"] > (MOST_SLOPE_DEG if goes_on else 1):
        return False
    if row.get("relative_size") not in (1.0, None):
        return False
    if row["rho_f_kg_m3"] >= GAS_BELOW:
        return True
    return goes_on and _is_quartz_in_air(row)


def _is_quartz_in_air(row: Mapping[str, Any]) -> bool:
    """Whether grain and gas have a ratio of densities as those that were measured."""
    low, high = AIR_OF_QUARTZ
    return bool(low < row["rho_sol_kg_m3"] / row["rho_f_kg_m3"] < high)


def _is_strip(row: Mapping[str, Any]) -> bool:
    """Whether a bed is a level strip as those that were tested, all of whose grains count."""
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
    """Ends of an interval over the Shields number, of how many rows, and the share that it held.

    There are no rows (0) where fewer than ten are alike.
    """
    at = (
        found for low, high, *found in _table().get(kind, ()) if low <= reynolds < high
    )
    return next(at, [np.nan, np.nan, 0, np.nan])


@cache
def _table() -> dict[str, list[list[float]]]:
    """By kind: the ends of each range of Re*, and the interval."""
    table: dict[str, list[list[float]]] = {}
    text = TABLE.read_text(encoding="utf-8")
    for kind, *numbers in [*csv.reader(text.splitlines())][1:]:
        table.setdefault(kind, []).append([float(number) for number in numbers])
    return table


def sentences(row: Mapping[Any, Any]) -> tuple[str, str]:
    """Say what was measured beside the threshold of a row, and which of it its interval held."""
    theta, number = row["shields"], f"Re* {row['reynolds']:.3g}"
    curve, median, low, high, count = (row[name] for name in MEASURED)
    if row["rho_f_kg_m3"] >= GAS_BELOW:
        by = f"the curve of Soulsby and Whitehouse {curve:.3f}"
        said = f"measured beside it: {by}; no flume has rows at {number}"
        if count:
            rows = f"θ {median:.3f}, 10 to 90 % {low:.3f} to {high:.3f}, {count:g} rows"
            said = f"measured at this Re* on level beds in flumes, by eye: {rows}; {by}"
    else:
        over, ratio = theta / curve, row["rho_sol_kg_m3"] / row["rho_f_kg_m3"]
        by = f"the curve of Shao and Lu has θ {curve:.4f}, this is {over:.2g} times it"
        by = f"{by}, {over**0.5:.3g} times in u*"
        rows = "Re* 9 to 14 and densities 2170 to 2290 times the gas's"
        said = f"{by}; no field rows are near it: they have {rows}, this has {number} and {ratio:.3g}"
        if count:
            rows = f"{low:.3f} to {high:.3f} at {count:g} sites (Martin and Kok 2018)"
            said = f"measured in air on level beds: {by}; in the field {rows}"
            said += f", this is {theta / median:.2g} times"
    low, high, count, held = (row[name] for name in TESTED)
    if not count:
        return (
            said,
            "no tested interval: no ten measured thresholds are of such beds at such Re*",
        )
    where = "flume rows"
    if row["rho_f_kg_m3"] < GAS_BELOW:
        where = "rows in air"
    rows = f"{held:.0%} of {count:g} {where}"
    return said, f"θ {theta:.3f}; {rows} lie within {low:.3f} and {high:.3f}"
