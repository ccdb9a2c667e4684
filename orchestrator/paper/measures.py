"""Comparisons by which the claims of the paper are judged."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import wraps
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.calculator import ENTRAINED
from orchestrator.calculator.table import thresholds
from orchestrator.digits import percent
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.paper.evidence import (
    BRIDGED,
    FLOWS,
    GRAIN,
    REGIMES,
    Comparison,
    Evidence,
    other_columns,
    pairs,
    parts,
)
from orchestrator.physics import curves
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.study import fields
from orchestrator.study.method import HELD_FROM
from orchestrator.tables.facts import needs_run
from orchestrator.types import FloatArray, IntArray

Comparisons = Iterator[Comparison]
ByFlow = Callable[[Evidence, str], Comparisons]

NEARLY = 0.05
"""Change that still counts as nearly none."""
SMALL_RE = 0.3
"""Re* up to which a claim on Re* < 3 must be true to be partly right."""
BETA = (50.0, 55.0)
"""Entrainment angles, degrees, for which the paper claims the best fit."""
Z0_OVER_D = 1 / 30
"""Roughness length for which it does."""
POINTS = 60
"""Re* at which a series of thresholds is compared with curves."""
GOOD = 1.25
"""Mean factor from the curves up to which a fit is called good."""
CREST = 0.9
"""Part of the counted grains, from the toe, above which they are at the crest."""
RANKED = -0.9
"""Rank correlation of place and load step from which the motion runs downward."""
COARSE_M = 5e-4
"""Diameter above which the paper sees wiggles, m."""
STEEP = 0.2
"""Least n/N for wiggles: below it the curve rises too steeply for the load steps."""
SMOOTH = np.array([-3, 12, 17, 12, -3]) / 35
"""Weights of five neighbours: their sum is the value of the parabola through them."""
WINDOW = 0.06
"""Part of the face over which the stress is smoothed: its steps have an effect."""
LATER = 1.5
"""n/N is read at this many times the stress that moves 30 %."""
LEAST_M = 5e-5
"""The least diameter of the paper, m."""
PILES_M = (1e-4, 1e-3)
"""The least and the largest diameter of the paper's piles, m."""
METHODS = ("DEM", "pivots", "pivots under a smoothed stress")
"""Curves whose wiggles are compared."""
INSENSITIVE = 0.01
"""Change of the threshold that counts as none."""
PACKINGS = {
    "aligned": "rows along the slope",
    "disordered": "random gaps",
    "horizontal": "horizontal rows",
}
"""What the lines of claims call packings."""


def by_flow(measure: ByFlow) -> Callable[[Evidence], Comparisons]:
    """Make a measure of piles under one stress judge those under each of `FLOWS`.

    Parameters
    ----------
    measure
        Takes the tables of a study and a stress.

    Returns
    -------
    callable
        Takes the tables. Of a study without piles it gives lines without data.
    """

    @wraps(measure)
    def under_each(evidence: Evidence) -> Comparisons:
        for flow in evidence.flows or [""]:
            for line in measure(evidence, flow):
                yield replace(line, flow=flow)

    return under_each


def by_regime(
    table: pd.DataFrame, column: str, name: str, above: float = -np.inf, **others: Any
) -> Comparisons:
    """A column of a table, compared in each regime.

    Parameters
    ----------
    table
        The table.
    column
        The column.
    name
        What its values are.
    above
        The claim is true of values above it.
    **others
        Further fields of a `Comparison`.

    Yields
    ------
    Comparison
        One for each regime.
    """
    for law, regime in REGIMES.items():
        values = table.loc[table["force_law"] == law, column]
        yield Comparison(f"{regime}: {name}", values, above, **others)


def rises_along(
    evidence: Evidence, table: str, along: str, rises: bool, name: str
) -> Comparisons:
    """Whether thresholds of single grains or of piles rise, or fall, along a column.

    Parameters
    ----------
    evidence
        The tables of a study.
    table
        ``"held"`` for single grains, else piles.
    along
        The column.
    rises
        Whether they rise.
    name
        What is compared.

    Yields
    ------
    Comparison
        One for each regime.
    """

    def compared(rows: pd.DataFrame, value: str) -> Comparisons:
        """The neighbours among some rows."""
        neighbours = pairs(rows, along, value)
        ratio = neighbours["ratio"] if rises else 1 / neighbours["ratio"]
        yield from by_regime(neighbours.assign(ratio=ratio), "ratio", name, 1.0)

    @by_flow
    def of_piles(evidence: Evidence, flow: str) -> Comparisons:
        """Those of piles, under one stress."""
        yield from compared(evidence.piles("pile_threshold", flow), "shields")

    if table == "held":
        yield from compared(evidence.exact, "shields_dem")
    else:
        yield from of_piles(evidence)


def constant(evidence: Evidence) -> Comparisons:
    """Thresholds of single grains at small Re*, where lift over drag grows with Re*.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    grains = evidence.exact.dropna(subset=["shields_dem"])
    flat = grains[(grains["force_law"] == "low") & (grains["alpha_deg"] == 0)]
    law = LAWS["low"]
    lifts = []
    changes = []
    for (beta, z0), series in parts(flat, "beta_deg", "z0_over_d"):
        if len(series) < 2:
            continue
        unit = Grain(
            diameter=1.0,
            roughness=z0,
            fluid_density=1.0,
            viscosity=1.0,
            lift_coefficient=series["alpha_s"].iloc[0],
        )
        lift_over_drag = law.lift(1.0, unit) / law.drag(1.0, unit)
        lifts.append(lift_over_drag / np.tan(np.radians(beta)))
        tau = series.sort_values("reynolds")["shields_dem"]
        changes.append(tau.iloc[-1] / tau.iloc[0] - 1)
    lift = np.array(lifts, float)
    end = law.reynolds[1]
    reach = NEARLY / (1 - NEARLY) / lift
    limit = f"Re* up to which τ is within {percent(NEARLY)} of its limit for Re* → 0"
    yield Comparison(f"{limit}, by the closed form, for each β and z₀", reach, end)
    yield Comparison("the same beside a tenth of that range", reach, SMALL_RE)
    name = "closed form: change of τ from Re* → 0 to 3"
    yield Comparison(name, 1 / (1 + lift * end) - 1, form="+.0%")
    by = "DEM" if len(evidence.held) else "closed form"
    name = f"{by}: change of τ over the Re* of the study"
    yield Comparison(name, changes, form="+.0%")


def numerical(evidence: Evidence) -> Comparisons:
    """Thresholds by DEM over the closed form, by how the flow is raised.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    held = evidence.held
    every = evidence.grains
    ramps = every[every["waiting_time"] < HELD_FROM]
    name = "lower end of DEM’s interval of τ over the closed form"
    for flow, grains in (("held flows", held), ("ramps", ramps)):
        ratio = grains["shields_dem_low"] / grains["shields_closed_form"]
        yield Comparison(f"{flow}: {name}", ratio, 1.0, form=".4f")
    name = "τ by DEM over the closed form, less 1"
    for law, grains in parts(held, "force_law"):
        ratio = grains["shields_dem"] / grains["shields_closed_form"] - 1
        yield Comparison(f"held flows, {REGIMES[law]}: {name}", ratio, form="+.2%")
    for (step, wait), grains in parts(ramps, "load_increment", "waiting_time"):
        ratio = grains["shields_dem"] / grains["shields_closed_form"] - 1
        rise = f"ramps, u* rising by {100 * step:g} % in {wait:g} √(d/g′)"
        yield Comparison(f"{rise}: {name}", ratio, form="+.1%")


def best_fit(evidence: Evidence) -> Comparisons:
    """Single grains on a flat bed against the curves for water, and for air.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    grains = pd.concat([evidence.exact, evidence.bridged])
    grains = grains.dropna(subset=["shields_dem"])
    flat = grains[grains["alpha_deg"] == 0]
    water = [curve.points(2000) for curve in curves.WATER]
    for law in (*REGIMES, BRIDGED):
        table = _fits(flat[flat["force_law"] == law], water)
        if law == BRIDGED and table.empty:
            continue
        named = table[table["beta_deg"].between(*BETA) & table["is_z0_named"]]
        best = table.iloc[:1]
        prefix = REGIMES.get(law, "bridged law")
        fit = f"{prefix}: mean factor of τ from the curves for water"
        name = f"{fit}, best fit"
        for row in best.itertuples():
            name += f", of β = {row.beta_deg:g}°, {row.z0}"
        yield Comparison(name, best["factor"], -np.inf, GOOD)
        among = best.index.isin(named.index)
        yield Comparison(f"{prefix}: the best fit is one of those named", among)
        yield Comparison(f"{fit}, fits of the named β and z₀", named["factor"])


def _over_d(z0: float) -> str:
    """A roughness length in diameters as a text."""
    return f"d/{1 / z0:.3g}"


def _fits(
    grains: pd.DataFrame, lines: Iterable[tuple[FloatArray, FloatArray]]
) -> pd.DataFrame:
    """Mean factor of each series of one law from curves, at the Re* that all cover."""
    columns = ["beta_deg", "z0", "is_z0_named", "factor"]
    series = {}
    for key, rows in parts(grains, "beta_deg", "z0_over_d"):
        if len(rows) > 1:
            series[key] = rows.sort_values("reynolds")
    low = max((rows["reynolds"].min() for rows in series.values()), default=1.0)
    high = min((rows["reynolds"].max() for rows in series.values()), default=0.0)
    if low >= high:
        return pd.DataFrame(columns=columns)
    grid = np.geomspace(low, high, POINTS)
    table = np.array([_log_at(x, y, grid) for x, y in lines])
    is_covered = np.isfinite(table).any(axis=0)
    if not is_covered.any():
        return pd.DataFrame(columns=columns)
    mean = np.nanmean(table[:, is_covered], axis=0)
    fits = []
    for (beta, z0), rows in series.items():
        re = rows["reynolds"].to_numpy()
        tau = _log_at(re, rows["shields_dem"].to_numpy(), grid)
        factor = float(np.exp(np.abs(tau[is_covered] - mean).mean()))
        is_named = abs(z0 / Z0_OVER_D - 1) < 1e-3
        fits.append((beta, _over_d(z0), is_named, factor))
    return pd.DataFrame(fits, columns=columns).sort_values("factor", kind="stable")


def _log_at(x: FloatArray, y: FloatArray, grid: FloatArray) -> FloatArray:
    """Logarithm of a line at some Re*; NaN beyond its ends."""
    order = np.argsort(x, kind="stable")
    ln_x = np.log(x[order])
    ln_y = np.log(y[order])
    return np.asarray(np.interp(np.log(grid), ln_x, ln_y, left=np.nan, right=np.nan))


@by_flow
def order(evidence: Evidence, flow: str) -> Comparisons:
    """Which grains of a pile move first, and where the motion goes.

    Parameters
    ----------
    evidence
        The tables of a study.
    flow
        The stress on the grains.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    for packing, name in PACKINGS.items():
        downward = []
        ranks = []
        for _, grains in parts(
            evidence.piles("pile_grain", flow, packing=packing), "scene_id"
        ):
            step = grains.sort_values("s_m")["moved_in_load_step"].to_numpy(int)
            if not (step > 0).any():
                continue
            late = np.where(step > 0, step, step.max() + 1)
            place = (np.arange(len(late)) + 0.5) / len(late)
            ranks.append(_rank_correlation(place, late))
            is_first_on_top = place[late == late.min()].max() > CREST
            downward.append(is_first_on_top and ranks[-1] <= RANKED)
        if packing == "aligned":
            rule = f"the topmost tenth moves first, rank correlation at most {RANKED:g}"
            yield Comparison(f"{name}: {rule}", np.array(downward, bool))
        if ranks:
            what = "rank correlation of place and load step of motion"
            yield Comparison(f"{name}: {what}", ranks)


def _rank_correlation(place: FloatArray, late: IntArray) -> float:
    """Spearman's; NaN if all are alike."""
    from scipy.stats import spearmanr  # slow to import

    if len(np.unique(late)) < 2:
        return float("nan")
    return float(spearmanr(place, late).statistic)


@by_flow
def above_single(evidence: Evidence, flow: str) -> Comparisons:
    """Thresholds of piles over those of one grain of the same slope, d and z0.

    Parameters
    ----------
    evidence
        The tables of a study.
    flow
        The stress on the grains.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    table = evidence.piles("pile_threshold", flow).assign(single=np.nan)
    for law, rows in table.groupby("force_law"):
        points = {
            "diameter": rows["d_m"],
            "density": rows["rho_sol_kg_m3"],
            "fluid_density": rows["rho_f_kg_m3"],
            "viscosity": rows["nu_m2_s"],
            "slope_deg": rows["alpha_deg"],
            "entrainment_angle_deg": rows["beta_deg"],
            "roughness": rows["z0_over_d"] * rows["d_m"],
            "lift_coefficient": rows["alpha_s"],
            "gravity": rows["g_m_s2"],
        }
        lists = {name: column.tolist() for name, column in points.items()}
        exact = thresholds(lists, str(law), ENTRAINED)
        table.loc[rows.index, "single"] = exact["shields"][exact["answer"]]
    table = table.assign(ratio=table["shields"] / table["single"])
    for fraction, rows in parts(table, "fraction"):
        name = f"τ over that of one grain by the closed form, n/N = {percent(fraction)}"
        yield from by_regime(rows, "ratio", name, 1.0)


@by_flow
def wiggles(evidence: Evidence, flow: str) -> Comparisons:
    """Roughness of the curves of the fraction, by DEM and by pivots.

    Parameters
    ----------
    evidence
        The tables of a study.
    flow
        The stress on the grains.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    table = _wiggles(evidence, flow)
    coarse = table[table["d_m"] > COARSE_M]
    fine = table[table["d_m"] <= COARSE_M]
    of_fine = fine["DEM"].median() if len(fine) else np.nan
    name = "d > 0.5 mm: wiggle over the median of the finer piles"
    yield Comparison(name, coarse["DEM"] / of_fine, 1.0)
    over_grain = coarse["DEM"] / coarse["grain"]
    yield Comparison("d > 0.5 mm: wiggle over 1/N", over_grain, -np.inf, 1.0)
    yield Comparison("d ≤ 0.5 mm: wiggle over 1/N", fine["DEM"] / fine["grain"])
    for name, part in (("d > 0.5 mm", coarse), ("d ≤ 0.5 mm", fine)):
        for method in METHODS:
            yield Comparison(f"{name}: wiggle by {method}", part[method], form=".2%")


def _wiggles(evidence: Evidence, flow: str) -> pd.DataFrame:
    """The wiggles of each pile by `METHODS`, with its d and the part of a grain."""
    grains = dict(parts(evidence.piles("pile_grain", flow), "scene_id"))
    rows = []
    for curve in evidence.curves(flow):
        scene = curve.iloc[0]
        if scene["scene_id"] not in grains:
            continue
        along = grains[scene["scene_id"]].sort_values("s_m")
        stress = along["ustar_over_ustar0"].to_numpy()
        by_dem = wiggle(curve["fraction_moved"].to_numpy())
        by_pivots = wiggle(_pivots(curve, stress))
        smoothed = wiggle(_pivots(curve, _smoothed(stress)))
        rows.append((scene["d_m"], 1 / scene["count"], by_dem, by_pivots, smoothed))
    columns = ["d_m", "grain", *METHODS]
    return pd.DataFrame(rows, columns=columns, dtype=float).dropna()


def _smoothed(stress: FloatArray) -> FloatArray:
    """The mean of a stress along the bed over `WINDOW`."""
    width = 2 * int(WINDOW * len(stress) / 2) + 1
    padded = np.pad(stress, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1 / width), mode="valid")


def wiggle(fraction: FloatArray) -> float:
    """Rms distance of n/N from the parabola through its five neighbours.

    Parameters
    ----------
    fraction
        n/N of each load step; those below `STEEP` are left out.

    Returns
    -------
    float
        The distance; NaN for a curve that is too short.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(0.2, 1.0, 9)
    >>> abs(round(wiggle(x**2), 12))
    0.0
    """
    fraction = fraction[fraction >= STEEP]
    if len(fraction) < len(SMOOTH):
        return float("nan")
    rest = fraction[2:-2] - np.convolve(fraction, SMOOTH, mode="valid")
    return float(np.sqrt(np.mean(rest**2)))


def _pivots(curve: pd.DataFrame, stress: FloatArray) -> FloatArray:
    """n/N at each load step if grains go at one local u*, after those downstream.

    That u* is set so that half of the grains have moved at the same flow as by DEM.
    """
    flow = curve["ustar0_m_s"].to_numpy(float)
    half = np.interp(0.5, curve["fraction_moved"].to_numpy(float), flow)
    with np.errstate(divide="ignore", invalid="ignore"):
        need = np.maximum.accumulate(1 / np.maximum(stress, 0)[::-1])
        need = need * half / need[len(need) // 2]
    return np.searchsorted(need, flow, side="right") / len(need)


@by_flow
def saturation(evidence: Evidence, flow: str) -> Comparisons:
    """How the rise of the fraction slows down.

    Parameters
    ----------
    evidence
        The tables of a study.
    flow
        The stress on the grains.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    table = _bends(evidence, flow)
    name = "slope of n/N against τ from 50 to 80 % over that from 20 to 50 %"
    yield Comparison(name, table["bend"], -np.inf, 1.0)
    name = f"n/N at {LATER:g} τ₃₀"
    ends = {"d_m": "largest d over smallest", "alpha_deg": "steepest over flattest"}
    for column, pair in ends.items():
        values = table.groupby(other_columns(table, column), dropna=False)[column]
        is_least = table[column] == values.transform("min")
        is_largest = table[column] == values.transform("max")
        ratio = pairs(table[is_least | is_largest], column, "later")["ratio"]
        yield Comparison(f"{name}, {pair}", ratio, -np.inf, 1.0)
    for alpha, piles in parts(table, "alpha_deg"):
        yield Comparison(f"{name}, {alpha:g}°", piles["later"], form=".0%")


def _bends(evidence: Evidence, flow: str) -> pd.DataFrame:
    """Of each pile the bend of its curve, and n/N at `LATER` times the τ of 30 %."""
    rows = []
    for curve in evidence.curves(flow):
        low = _stress_at(curve, 0.2)
        middle = _stress_at(curve, 0.5)
        high = _stress_at(curve, 0.8)
        row = curve.iloc[0].drop("fraction_moved").to_dict()
        rise = high - middle
        row["bend"] = (middle - low) / rise if rise else np.nan
        row["later"] = _fraction_at(curve, LATER * _stress_at(curve, 0.3))
        rows.append(row)
    if rows:
        return pd.DataFrame(rows)
    return evidence.joined("none").assign(bend=[], later=[])


def _stress_at(curve: pd.DataFrame, fraction: float) -> float:
    """Shields number at which a fraction had moved; NaN if it was not reached."""
    fractions = curve["fraction_moved"]
    shields = curve["shields"]
    return float(np.interp(fraction, fractions, shields, left=np.nan, right=np.nan))


def _fraction_at(curve: pd.DataFrame, shields: float) -> float:
    """The fraction that had moved when the mean stress first reached a value."""
    stress = np.maximum.accumulate(curve["shields"].to_numpy(float))
    fraction = curve["fraction_moved"].to_numpy(float)
    return float(np.interp(shields, stress, fraction, left=0.0))


@by_flow
def fraction(evidence: Evidence, flow: str) -> Comparisons:
    """The fraction at one stress, by slope.

    Parameters
    ----------
    evidence
        The tables of a study.
    flow
        The stress on the grains.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    curves_ = evidence.curves(flow)
    by_scene = {curve["scene_id"].iloc[0]: curve for curve in curves_}
    firsts = pd.DataFrame([curve.iloc[0] for curve in by_scene.values()])
    rows = []
    for _, same in parts(firsts, *other_columns(firsts, "alpha_deg")):
        series = [by_scene[key] for key in same.sort_values("alpha_deg")["scene_id"]]
        for flat, steep in pairwise(series):
            reached = _fraction_at(steep, _stress_at(flat, 0.5))
            rows.append((flat["force_law"].iloc[0], reached))
    table = pd.DataFrame(rows, columns=["force_law", "steep"])
    name = "n/N of the next steeper pile at the τ that moves 50 % of a pile"
    yield from by_regime(table, "steep", name, below=0.5, form=".0%")


def conditioning(evidence: Evidence) -> Comparisons:
    """The smallest grains, and the stiffness of the contacts.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    small = evidence.held[evidence.held["d_m"] < LEAST_M]
    change = (small["ustar_m_s"] / small["ustar_closed_form_m_s"] - 1).abs()
    name = "d below 0.05 mm: change of u* from the closed form to DEM"
    yield Comparison(name, change, INSENSITIVE, form=".2%")
    held = evidence.grains[evidence.grains["waiting_time"] >= HELD_FROM]
    ratio = held["ustar_m_s"] / held["ustar_closed_form_m_s"]
    held = held[[*GRAIN, "stiffness"]].assign(ratio=ratio)
    changes = []
    stiffness = [np.array([])]
    for _, same in parts(held, *GRAIN):
        if same["stiffness"].nunique() > 1:
            changes.append(same["ratio"].max() / same["ratio"].min() - 1)
            stiffness.append(same["stiffness"].to_numpy(float))
    yield Comparison("change of u* over all K d/W", changes, INSENSITIVE, form=".2%")
    yield Comparison("K d/W of these grains", np.concatenate(stiffness), form=".2g")


def regimes(evidence: Evidence) -> Comparisons:
    """How many piles of the paper's own range the force laws and the drag law cover.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    piles = evidence.scenes[evidence.scenes["bed"] == "pile"]
    piles = piles[piles["nu_m2_s"] == piles["nu_m2_s"].min()]
    keys = ["alpha_deg", "d_m", "z0_over_d"]
    each = piles.drop_duplicates(keys)
    least, largest = PILES_M
    has_least = each["d_m"].min() < 1.01 * least
    if not (has_least and each["d_m"].max() > 0.99 * largest):
        return
    for z0, part in parts(each, "z0_over_d"):
        where = "piles at the lowest ν of the study that lie in a regime"
        is_covered = part["regime"] != "transition"
        yield Comparison(f"z₀ = {_over_d(z0)}: {where}", is_covered)
    holds = piles[piles["law_holds"].astype(bool)]
    if (holds["force_law"] == BRIDGED).any():
        held = holds[keys].drop_duplicates()
        answered = each.merge(held, on=keys, how="left", indicator=True)
        what = "the same piles that have an answer of a law that holds"
        name = f"{what}, the bridged law included"
        yield Comparison(name, answered["_merge"] == "both", is_judged=False)
    piles = evidence.piles("pile_threshold", "wall")
    tables = {"single grains": evidence.held, "piles": piles}
    for name, table in tables.items():
        yield from _within_drag_law(name, table)


def _within_drag_law(name: str, table: pd.DataFrame) -> Comparisons:
    """How many thresholds of the high regime lie within the range of its drag law."""
    law = LAWS["high"]
    high = table[(table["force_law"] == "high") & table["reynolds"].notna()]
    if high.empty:
        return
    unit = Grain(
        diameter=1.0,
        roughness=high["z0_over_d"].to_numpy(float),
        fluid_density=1.0,
        viscosity=1.0,
        lift_coefficient=1.0,
    )
    particle_reynolds = law.particle_reynolds(high["reynolds"].to_numpy(float), unit)
    what = f"high regime: thresholds of {name} within the range of the drag law"
    yield Comparison(what, particle_reynolds <= law.drag_end, is_judged=False)


def eq10_against_wall(evidence: Evidence) -> Comparisons:
    """Eq. 10 against the wall stress, in the thresholds of piles.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    table = evidence.piles("pile_threshold", *FLOWS)
    coded = table.assign(code=(table["stress"] == "eq10").astype(float))
    judged = (("u*₀", "ustar0_m_s", NEARLY), ("τ", "shields", np.inf))
    for symbol, column, bound in judged:
        changes = pairs(coded, "code", column, ["stress"])
        changes["ratio"] -= 1
        name = f"{symbol} by Eq. 10 over that by the wall stress, less 1"
        yield from by_regime(changes, "ratio", name, -bound, below=bound, form="+.1%")
    yield from _across_methods(coded)


def _across_methods(coded: pd.DataFrame) -> Comparisons:
    """Peeling under Eq. 10 over DEM of the same pile: each slope has such a pair.

    They are not judged, since they hold the error of peeling as well.
    """
    is_run = needs_run(coded)
    free = ["stress", "fidelity", *fields.OF_METHOD]
    for stress, name in FLOWS.items():
        by_dem = coded[(coded["stress"] == stress) & is_run].assign(code=0.0)
        by_peeling = coded[(coded["stress"] == "eq10") & ~is_run].assign(code=1.0)
        both = pd.concat([by_dem, by_peeling])
        changes = pairs(both, "code", "ustar0_m_s", free)
        for alpha, part in parts(changes, "alpha_deg"):
            line = f"u*₀ by Eq. 10 and peeling over that by {name} and DEM, less 1"
            ratio = part["ratio"] - 1
            yield Comparison(f"{alpha:g}°, {line}", ratio, form="+.1%")


def coupling(evidence: Evidence) -> Comparisons:
    """The flow over the initial pile, kept until the last grain has gone.

    Yields
    ------
    Comparison
        A comparison that judges a claim, or is shown beside it.
    """
    table = evidence.joined("pile_threshold")
    # the budget found these changes under the wall stress
    table = table[table["frozen_bed"].notna() & (table["stress"] == "wall")]
    table = table[table["force_law"] == table["regime"]]
    for part, rows in parts(table, "fraction"):
        name = (
            f"n/N = {percent(part)}: known change of τ where the bed line is drawn anew"
        )
        values = rows["frozen_bed"]
        yield Comparison(name, values, below=FROZEN_BED, form=".0%", flow="wall")
