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
MEASURED = tuple(f"measured_{name}" for name in ("curve", "median", "low", "high", "rows"))
TESTED = tuple(f"tested_{name}" for name in ("low", "high", "rows", "held"))
"""Columns of what was measured at the Re*, and of the interval; `tables/columns.csv` tells them."""
OF_KIND = (
    *("alpha_s", "cohesion_n_m", "alpha_deg", "relative_size", "rho_f_kg_m3", "force_law", "d_m"),
    *("z0_m", "bed", "beta_deg", "bed_shape", "profile", "obstacles", "width", "answered_method"),
    *("sizes", "exposure", "sheltering", "fraction", "gusts"),
)
"""Columns that the kind of a threshold follows from."""


def beside(table: Any) -> dict[str, FloatArray]:
    """Columns `MEASURED` and `TESTED` for thresholds, from a table or a mapping of columns."""
    names = ("reynolds", "d_m", "rho_sol_kg_m3", "rho_f_kg_m3", "nu_m2_s", "g_m_s2", "shields")
    re, d, rho_s, rho, nu, g, theta = (np.asarray(table[name], float) for name in names)
    excess, is_gas = (rho_s / rho - 1) * g, rho < GAS_BELOW
    in_gas = shao_lu(d, Air(rho_s, rho, nu, g)) ** 2 / (excess * d)
    curve = np.where(is_gas, in_gas, soulsby_whitehouse(d * (excess / nu**2) ** (1 / 3)))
    none = (np.nan, np.nan, np.nan, 0.0)
    bins = [none, *((b.median, b.tenth, b.ninetieth, float(b.count)) for b in VISUAL), none]
    edges = [VISUAL[0].low, *(each.high for each in VISUAL)]
    flumes = np.array(bins)[np.searchsorted(edges, re, side="right")]
    # the sites have Re* 8.8 to 13.5 and grains 2,170 to 2,290 times as dense as the air: within 2
    near = (re > 4.4) & (re < 27) & (rho_s / rho > 1085) & (rho_s / rho < 4580)
    ends = (float(np.median(FIELD)), min(FIELD), max(FIELD), float(len(FIELD)))
    rows = np.where(is_gas[..., None], np.where(near[..., None], ends, none), flumes)
    given = {name: np.asarray(table[name]).tolist() for name in OF_KIND if name in table}
    # rows of one kind are alike but for d, of which it has three digits of d/z0
    parts = (d / np.asarray(table["z0_m"], float)).tolist()
    given |= {"d_m": [float(f"{part:.3g}") for part in parts], "z0_m": [1.0] * len(parts)}
    keys = [*zip(*([x if x == x else np.nan for x in c] for c in given.values()), strict=True)]
    kinds = {key: kind_of(dict(zip(given, key, strict=True))) for key in {*keys}}
    held = np.array(list(map(interval, map(kinds.__getitem__, keys), re.tolist())), float).T
    held[:2] *= theta
    return dict(zip((*MEASURED, *TESTED), [curve, *rows.T, *held], strict=True))


def kind_of(row: Mapping[str, Any]) -> str:
    """The kind of a threshold from columns of its scene; empty where no rows are like it.

    Of single grains, and of strips of sand by the pivots at a fraction of their grains; there are
    none on slopes, and in a gas three, too few.
    """
    unusual = row["alpha_s"] != LIFT_COEFFICIENT or row["cohesion_n_m"] or row["alpha_deg"] > 1
    unusual = unusual or str(row.get("relative_size")) not in ("1.0", "nan", "None")
    if unusual or row["rho_f_kg_m3"] < GAS_BELOW:
        return ""
    words = [row["force_law"], f"z0 d/{row['d_m'] / row['z0_m']:.3g}"]
    if row.get("bed", "grain") == "grain":
        words += ["grain", f"beta {row['beta_deg']:g}"]
    else:
        # a profile or obstacles have a text
        is_level = row["bed_shape"] == "flat" and str not in map(
            type, (row["profile"], row["obstacles"])
        )
        if not (is_level and (row["width"] or 0) > 0 and row["answered_method"] == "pivot"):
            return ""
        words += ["strip", str(row["sizes"]), row["exposure"], row["sheltering"]]
        words += [f"n/N {row['fraction']:g}"]
    gusts = row.get("gusts")
    return ", ".join([*words, f"gusts {gusts}"] if isinstance(gusts, str) else words)


def interval(kind: str, reynolds: float) -> list[float]:
    """Ends of an interval over the Shields number, of how many rows, and the share that it held.

    There are no rows (0) where fewer than ten are alike.
    """
    at = (found for low, high, *found in _table().get(kind, ()) if low <= reynolds < high)
    return next(at, [np.nan, np.nan, 0, np.nan])


@cache
def _table() -> dict[str, list[list[float]]]:
    """By kind: the ends of each range of Re*, and the interval."""
    table: dict[str, list[list[float]]] = {}
    text = Path(__file__).with_name("tested.csv").read_text(encoding="utf-8")
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
        said = (
            f"{by}; no field rows are near it: they have {rows}, this has {number} and {ratio:.3g}"
        )
        if count:
            rows = f"{low:.3f} to {high:.3f} at {count:g} sites (Martin and Kok 2018)"
            said = f"measured in air on level beds: {by}; in the field {rows}"
            said += f", this is {theta / median:.2g} times"
    low, high, count, held = (row[name] for name in TESTED)
    if not count:
        return said, "no tested interval: no ten measured thresholds are of such beds at such Re*"
    rows = f"{held:.0%} of {count:g} flume rows"
    return said, f"θ {theta:.3f}; {rows} lie within {low:.3f} and {high:.3f}"
