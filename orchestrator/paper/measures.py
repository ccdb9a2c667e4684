"""Comparisons by which the claims of the paper are judged, from the tables of a study."""

import warnings
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

import orchestrator
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.paper.evidence import (
    BRIDGED,
    GRAIN,
    REGIMES,
    WAITING_TIME,
    Comparison,
    Evidence,
    others,
    pairs,
    parts,
)
from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS, Exposure
from orchestrator.types import FloatArray

Comparisons = Iterator[Comparison]

NEARLY = 0.05  # change that still counts as nearly none
SMALL_RE = 0.3  # Re* up to which a claim on Re* < 3 must be true to be partly right
BETA, Z0_OVER_D = (50.0, 55.0), 1 / 30  # for these the paper claims the best fit
POINTS = 60  # Re* at which a series of thresholds is compared with curves
GOOD = 1.25  # mean factor from the curves up to which a fit is called good
CREST = (
    0.9  # part of the counted grains, from the toe, above which they are at the crest
)
RANKED = (
    -0.9
)  # rank correlation of place and load step from which the motion runs downward
COARSE_M = 5e-4  # diameter above which the paper sees wiggles, m
STEEP = 0.2  # least n/N for wiggles: below it the curve rises too steeply for the load steps
# the sum of five neighbours by these weights is the value of the parabola that fits them best
SMOOTH = np.array([-3, 12, 17, 12, -3]) / 35
WINDOW = 0.06  # part of the face over which the stress is smoothed, to see the effect of its steps
LATER = 1.5  # n/N is read at this many times the stress that moves 30 %
LEAST_M = 5e-5  # the least diameter of the paper, m
PILES_M = (1e-4, 1e-3)  # the least and the largest diameter of the paper's piles, m
INSENSITIVE = 0.01  # change of the threshold that counts as none


def by_regime(
    table: pd.DataFrame, column: str, name: str, above: float = -np.inf, **others: Any
) -> Comparisons:
    """A column of a table, compared in each regime."""
    for law, regime in REGIMES.items():
        values = table.loc[table["force_law"] == law, column]
        yield Comparison(f"{regime}: {name}", values, above, **others)


def along(
    evidence: Evidence, table: str, along: str, rises: bool, name: str
) -> Comparisons:
    """Whether thresholds of single grains or of piles rise, or fall, along a column."""
    is_held = table == "held"
    rows = evidence.held if is_held else evidence.piles("pile_threshold")
    neighbours = pairs(rows, along, "shields_dem" if is_held else "shields")
    ratio = neighbours["ratio"] if rises else 1 / neighbours["ratio"]
    yield from by_regime(neighbours.assign(ratio=ratio), "ratio", name, 1.0)


def constant(evidence: Evidence) -> Comparisons:
    """Thresholds of single grains at small Re*, where lift over drag grows with Re*."""
    grains = evidence.held.dropna(subset=["shields_dem"])
    flat = grains[(grains["force_law"] == "low") & (grains["alpha_deg"] == 0)]
    lifts, changes, law = [], [], LAWS["low"]
    for (beta, z0), series in parts(flat, "beta_deg", "z0_over_d"):
        if len(series) > 1:
            unit = Exposure(1.0, z0, 1.0, 1.0, series["alpha_s"].iloc[0])
            lifts.append(
                law.lift(1.0, unit) / law.drag(1.0, unit) / np.tan(np.radians(beta))
            )
            ends = series.sort_values("reynolds")["shields_dem"]
            changes.append(ends.iloc[-1] / ends.iloc[0] - 1)
    lift, end = np.array(lifts, float), law.reynolds[1]
    reach = NEARLY / (1 - NEARLY) / lift
    name = f"Re* up to which τ is within {NEARLY:.0%} of its limit for Re* → 0, by the closed form"
    yield Comparison(f"{name}, for each β and z₀", reach, end)
    yield Comparison("the same beside a tenth of that range", reach, SMALL_RE)
    name = "closed form: change of τ from Re* → 0 to 3"
    yield Comparison(name, 1 / (1 + lift * end) - 1, form="+.0%")
    yield Comparison("DEM: change of τ over the Re* of the study", changes, form="+.0%")


def numerical(evidence: Evidence) -> Comparisons:
    """Thresholds by DEM over the closed form, by how the flow is raised."""
    held, ramps = evidence.held, evidence.grains
    ramps = ramps[ramps["waiting_time"] < WAITING_TIME]
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
    """Single grains on a flat bed against the curves for water, and for air."""
    grains = pd.concat([evidence.held, evidence.bridged]).dropna(subset=["shields_dem"])
    flat = grains[grains["alpha_deg"] == 0]
    water = [curve.points(2000) for curve in curves.WATER]
    for law in (*REGIMES, BRIDGED):
        table = _fits(flat[flat["force_law"] == law], water)
        if law == BRIDGED and table.empty:
            continue
        named = table[table["beta_deg"].between(*BETA) & table["is_z0_named"]]
        best = table.iloc[:1]
        of = [f", of β = {row.beta_deg:g}°, {row.z0}" for row in best.itertuples()]
        prefix = REGIMES.get(law, "bridged law")
        fit = f"{prefix}: mean factor of τ from the curves for water"
        yield Comparison(f"{fit}, best fit{''.join(of)}", best["factor"], -np.inf, GOOD)
        among = best.index.isin(named.index)
        yield Comparison(f"{prefix}: the best fit is one of those named", among)
        yield Comparison(f"{fit}, fits of the named β and z₀", named["factor"])


def _over_d(z0: float) -> str:
    return f"d/{1 / z0:.3g}"


def _fits(
    grains: pd.DataFrame, lines: Iterable[tuple[FloatArray, FloatArray]]
) -> pd.DataFrame:
    """Mean factor of each series of one law from some curves, at the Re* that all cover."""
    series = [
        (key, own)
        for key, own in parts(grains, "beta_deg", "z0_over_d")
        if len(own) > 1
    ]
    low = max((own["reynolds"].min() for _, own in series), default=1.0)
    high = min((own["reynolds"].max() for _, own in series), default=0.0)
    grid = np.geomspace(low, high, POINTS) if low < high else np.array([])
    table = np.array([_read(x, y, grid) for x, y in lines])
    covered = np.isfinite(table).any(axis=0) if table.size else np.array([], bool)
    rows = []
    for (beta, z0), own in series if covered.any() else ():
        ordered = own.sort_values("reynolds")
        tau = _read(
            ordered["reynolds"].to_numpy(), ordered["shields_dem"].to_numpy(), grid
        )
        away = np.abs(tau[covered] - np.nanmean(table[:, covered], axis=0)).mean()
        rows.append(
            (beta, _over_d(z0), abs(z0 / Z0_OVER_D - 1) < 1e-3, float(np.exp(away)))
        )
    fits = pd.DataFrame(rows, columns=["beta_deg", "z0", "is_z0_named", "factor"])
    return fits.sort_values("factor", kind="stable")


def _read(x: FloatArray, y: FloatArray, grid: FloatArray) -> FloatArray:
    """Logarithm of a line at some Re*; NaN beyond its ends."""
    order = np.argsort(x, kind="stable")
    logs = np.log(grid), np.log(x[order]), np.log(y[order])
    return np.asarray(np.interp(*logs, left=np.nan, right=np.nan))


def order(evidence: Evidence) -> Comparisons:
    """Which grains of a pile move first, and where the motion goes."""
    rows = "rows along the slope"
    for packing, name in (
        ("aligned", rows),
        ("disordered", "random gaps"),
        ("horizontal", "level rows"),
    ):
        downward, ranks = [], []
        every = evidence.piles("pile_grain", packing)[
            ["scene_id", "s_m", "moved_in_load_step"]
        ]
        for _, grains in parts(every, "scene_id"):
            step = grains.sort_values("s_m")["moved_in_load_step"].to_numpy(int)
            if (step > 0).any():
                late = np.where(step > 0, step, step.max() + 1)
                place = (np.arange(len(late)) + 0.5) / len(late)
                _, each, many = np.unique(late, return_inverse=True, return_counts=True)
                rank = (np.cumsum(many) - many / 2)[
                    each
                ]  # Spearman's, of ties the mean
                ranks.append(
                    float(np.corrcoef(place, rank)[0, 1]) if len(many) > 1 else np.nan
                )
                downward.append(
                    place[late == late.min()].max() > CREST and ranks[-1] <= RANKED
                )
        if packing == "aligned":
            rule = f"the topmost tenth moves first, rank correlation at most {RANKED:g}"
            yield Comparison(f"{name}: {rule}", np.array(downward, bool))
        if ranks:
            yield Comparison(
                f"{name}: rank correlation of place and load step of motion", ranks
            )


def above_single(evidence: Evidence) -> Comparisons:
    """Thresholds of piles over those of one grain of the same slope, d and z0."""
    table = evidence.piles("pile_threshold").assign(single=np.nan)
    for law, rows in table.groupby("force_law"):
        with warnings.catch_warnings():
            # the paper's fluids are asked about: no fluid of 1 kg/m3 has 1e-3 m2/s
            warnings.simplefilter("ignore")
            exact = orchestrator.threshold(
                rows["d_m"],
                density=rows["rho_sol_kg_m3"],
                fluid_density=rows["rho_f_kg_m3"],
                viscosity=rows["nu_m2_s"],
                slope_deg=rows["alpha_deg"],
                entrainment_angle_deg=rows["beta_deg"],
                roughness=rows["z0_over_d"] * rows["d_m"],
                lift_coefficient=rows["alpha_s"],
                gravity=rows["g_m_s2"],
                law=str(law),
            )
        table.loc[rows.index, "single"] = exact["shields"].to_numpy()
    table = table.assign(ratio=table["shields"] / table["single"])
    for fraction, rows in parts(table, "fraction"):
        name = f"τ over that of one grain by the closed form, n/N = {fraction:.0%}"
        yield from by_regime(rows, "ratio", name, 1.0)


def wiggles(evidence: Evidence) -> Comparisons:
    """Roughness of the curves of the fraction, by DEM and by pivots."""
    every = evidence.piles("pile_grain")[["scene_id", "s_m", "ustar_over_ustar0"]]
    grains = dict(parts(every, "scene_id"))
    rows = []
    for curve in evidence.curves:
        scene = curve.iloc[0]
        if scene["scene_id"] in grains:
            stress = (
                grains[scene["scene_id"]]
                .sort_values("s_m")["ustar_over_ustar0"]
                .to_numpy()
            )
            width = 2 * int(WINDOW * len(stress) / 2) + 1
            padded = np.pad(stress, width // 2, mode="edge")
            smoothed = np.convolve(padded, np.full(width, 1 / width), mode="valid")
            fractions = curve["fraction_moved"].to_numpy(), _pivots(curve, stress)
            each = map(wiggle, (*fractions, _pivots(curve, smoothed)))
            rows.append((scene["d_m"], 1 / scene["count"], *each))
    columns = ["d_m", "grain", "DEM", "pivots", "pivots under a smoothed stress"]
    table = pd.DataFrame(rows, columns=columns, dtype=float).dropna()
    coarse, fine = table[table["d_m"] > COARSE_M], table[table["d_m"] <= COARSE_M]
    beside = coarse["DEM"] / (fine["DEM"].median() if len(fine) else np.nan)
    yield Comparison(
        "d > 0.5 mm: wiggle over the median of the finer piles", beside, 1.0
    )
    yield Comparison(
        "d > 0.5 mm: wiggle over 1/N", coarse["DEM"] / coarse["grain"], -np.inf, 1.0
    )
    yield Comparison("d ≤ 0.5 mm: wiggle over 1/N", fine["DEM"] / fine["grain"])
    for name, part in (("d > 0.5 mm", coarse), ("d ≤ 0.5 mm", fine)):
        for method in columns[2:]:
            yield Comparison(f"{name}: wiggle by {method}", part[method], form=".2%")


def wiggle(fraction: FloatArray) -> float:
    """Rms distance of n/N from the parabola through its five neighbours, for n/N of some size."""
    fraction = fraction[fraction >= STEEP]
    if len(fraction) < len(SMOOTH):
        return float("nan")
    rest = fraction[2:-2] - np.convolve(fraction, SMOOTH, mode="valid")
    return float(np.sqrt(np.mean(rest**2)))


def _pivots(curve: pd.DataFrame, stress: FloatArray) -> FloatArray:
    """n/N at each load step if each grain goes at one local u*, after those downstream of it.

    That u* is set so that half of the grains have moved at the same flow as by DEM.
    """
    flow = curve["ustar0_m_s"].to_numpy(float)
    half = np.interp(0.5, curve["fraction_moved"].to_numpy(float), flow)
    with np.errstate(divide="ignore", invalid="ignore"):
        need = np.maximum.accumulate(1 / np.maximum(stress, 0)[::-1])
        need = need * half / need[len(need) // 2]
    return np.searchsorted(need, flow, side="right") / len(need)


def saturation(evidence: Evidence) -> Comparisons:
    """How the rise of the fraction slows down."""
    rows = []
    for curve in evidence.curves:
        low, middle, high = (
            _stress_at(curve, fraction) for fraction in (0.2, 0.5, 0.8)
        )
        later = _fraction_at(curve, LATER * _stress_at(curve, 0.3))
        bend = (middle - low) / (high - middle)
        rows.append(
            {**curve.iloc[0].drop("fraction_moved"), "bend": bend, "later": later}
        )
    table = (
        pd.DataFrame(rows)
        if rows
        else evidence.joined("none").assign(bend=[], later=[])
    )
    name = "slope of n/N against τ from 50 to 80 % over that from 20 to 50 %"
    yield Comparison(name, table["bend"], -np.inf, 1.0)
    name, ends = (
        f"n/N at {LATER:g} τ₃₀",
        ("largest d over smallest", "steepest over flattest"),
    )
    for along, pair in zip(("d_m", "alpha_deg"), ends, strict=True):
        values = table.groupby(others(table, along), dropna=False)[along]
        at_end = (table[along] == values.transform("min")) | (
            table[along] == values.transform("max")
        )
        ratio = pairs(table[at_end], along, "later")["ratio"]
        yield Comparison(f"{name}, {pair}", ratio, -np.inf, 1.0)
    for alpha, piles in parts(table, "alpha_deg"):
        yield Comparison(f"{name}, {alpha:g}°", piles["later"], form=".0%")


def _stress_at(curve: pd.DataFrame, fraction: float) -> float:
    """Shields number at which a fraction had moved, between load steps; NaN if not reached."""
    ends = {"left": np.nan, "right": np.nan}
    return float(np.interp(fraction, curve["fraction_moved"], curve["shields"], **ends))


def _fraction_at(curve: pd.DataFrame, shields: float) -> float:
    """The fraction that had moved when the mean stress first reached a value."""
    stress = np.maximum.accumulate(curve["shields"].to_numpy(float))
    return float(
        np.interp(shields, stress, curve["fraction_moved"].to_numpy(float), left=0.0)
    )


def fraction(evidence: Evidence) -> Comparisons:
    """The fraction at one stress, by slope."""
    by_scene = {curve["scene_id"].iloc[0]: curve for curve in evidence.curves}
    firsts = pd.DataFrame([curve.iloc[0] for curve in by_scene.values()])
    rows = []
    for _, same in parts(firsts, *others(firsts, "alpha_deg")):
        series = [by_scene[key] for key in same.sort_values("alpha_deg")["scene_id"]]
        for flat, steep in pairwise(series):
            reached = _fraction_at(steep, _stress_at(flat, 0.5))
            rows.append((flat["force_law"].iloc[0], reached))
    table = pd.DataFrame(rows, columns=["force_law", "steep"])
    name = "n/N of the next steeper pile at the τ that moves 50 % of a pile"
    yield from by_regime(table, "steep", name, below=0.5, form=".0%")


def conditioning(evidence: Evidence) -> Comparisons:
    """The smallest grains, and the stiffness of the contacts."""
    small = evidence.held[evidence.held["d_m"] < LEAST_M]
    change = (small["ustar_m_s"] / small["ustar_closed_form_m_s"] - 1).abs()
    name = "d below 0.05 mm: change of u* from the closed form to DEM"
    yield Comparison(name, change, INSENSITIVE, form=".2%")
    held = evidence.grains[evidence.grains["waiting_time"] >= WAITING_TIME]
    ratio = held["ustar_m_s"] / held["ustar_closed_form_m_s"]
    held = held[[*GRAIN, "stiffness"]].assign(ratio=ratio)
    changes, stiffness = [], [np.array([])]
    for _, same in parts(held, *GRAIN):
        if same["stiffness"].nunique() > 1:
            changes.append(same["ratio"].max() / same["ratio"].min() - 1)
            stiffness.append(same["stiffness"].to_numpy(float))
    yield Comparison("change of u* over all K d/W", changes, INSENSITIVE, form=".2%")
    yield Comparison("K d/W of these grains", np.concatenate(stiffness), form=".2g")


def regimes(evidence: Evidence) -> Comparisons:
    """How many piles of the paper's own range the two force laws and the drag law cover."""
    piles = evidence.scenes[evidence.scenes["bed"] == "pile"]
    piles = piles[piles["nu_m2_s"] == piles["nu_m2_s"].min()]
    keys = ["alpha_deg", "d_m", "z0_over_d"]
    each, (least, largest) = piles.drop_duplicates(keys), PILES_M
    if not (each["d_m"].min() < 1.01 * least and each["d_m"].max() > 0.99 * largest):
        return
    for z0, part in parts(each, "z0_over_d"):
        name = f"z₀ = {_over_d(z0)}: piles at the lowest ν of the study that lie in a regime"
        yield Comparison(name, part["regime"] != "transition")
    holds = piles[piles["law_holds"].astype(bool)]
    if (holds["force_law"] == BRIDGED).any():
        answered = each.merge(
            holds[keys].drop_duplicates(), on=keys, how="left", indicator=True
        )
        name = "the same piles that have an answer of a law that holds, the bridged law included"
        yield Comparison(name, answered["_merge"] == "both", is_judged=False)
    law = LAWS["high"]
    tables = {"single grains": evidence.held, "piles": evidence.piles("pile_threshold")}
    for name, table in tables.items():
        high = table[(table["force_law"] == "high") & table["reynolds"].notna()]
        if len(high):
            unit = Exposure(1.0, high["z0_over_d"].to_numpy(float), 1.0, 1.0, 1.0)
            within = (
                law.particle_reynolds(high["reynolds"].to_numpy(float), unit)
                <= law.drag_end
            )
            name = f"high regime: thresholds of {name} within the range of the drag law"
            yield Comparison(name, within, is_judged=False)


def stress(evidence: Evidence) -> Comparisons:
    """Eq. 10 against the wall stress, in the thresholds of piles."""
    table = evidence.piles("pile_threshold", "aligned", "wall", "eq10")
    coded = table.assign(code=(table["stress"] == "eq10").astype(float))
    for symbol, column, bound in (
        ("u*₀", "ustar0_m_s", NEARLY),
        ("τ", "shields", np.inf),
    ):
        changes = pairs(coded, "code", column, ["stress"])
        changes["ratio"] -= 1
        name = f"{symbol} by Eq. 10 over that by the wall stress, less 1"
        yield from by_regime(changes, "ratio", name, -bound, below=bound, form="+.1%")


def coupling(evidence: Evidence) -> Comparisons:
    """The flow of the whole pile, kept until the last grain has gone."""
    table = evidence.joined("pile_threshold")
    table = table[(table["force_law"] == table["regime"]) & table["frozen_bed"].notna()]
    for part, rows in parts(table, "fraction"):
        name = f"n/N = {part:.0%}: known change of τ where the bed line is drawn anew"
        yield Comparison(name, rows["frozen_bed"], -np.inf, FROZEN_BED, form=".0%")
