"""The answer of a study in few words: sentences, and a short table of its thresholds."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from orchestrator.fidelity.calibration import lowest_floor
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.physics.velocity import log_law_speed
from orchestrator.report import hills, labels
from orchestrator.report.apart import varying
from orchestrator.report.facts import Sheet
from orchestrator.report.results import Results, nearest_fraction, seeds_as_one, split, valid
from orchestrator.study.closed_form import closed_form

GAS_BELOW = 100.0
"""Density that tells gases from liquids, kg/m3: a gas has a wind."""
TOLD = 3
"""Fields beside slope and diameter that a sentence tells of a pile."""
FEW = 12
"""Piles that have a row each; of more, a row tells the range of many."""


def sentences(results: Results) -> list[str]:
    """The answer, from the least slope to the largest; a warning where little is usable."""
    piles = results.joined("pile_threshold")
    if len(piles):
        found = list(hills.sentences(results))
        if valid(piles).any() or not found:
            telling = varying(piles, "alpha_deg", "d_m", "fraction")[:TOLD]
            found += [_of_pile(row, results, telling) for row in _ends(results)]
        worth = _worth(piles, results.study.tolerance)
        return [*found, *_warnings(piles), *_frozen(piles), *_chosen(results), *worth]
    single = results.joined("single_grain")
    return [*map(_of_grain, _grain_ends(single)), *_warnings(single)] if len(single) else []


def _ends(results: Results) -> list[pd.Series]:
    """The piles of the least and of the largest slope in each fluid; pictures show them, too."""
    ends = []
    for _, piles in split(results.exemplars, "rho_f_kg_m3"):
        firsts = piles.drop_duplicates("alpha_deg")
        ends += [firsts.iloc[at] for at in sorted({0, len(firsts) - 1})]
    return sorted(ends, key=lambda row: float(row["alpha_deg"]))


def _of_pile(row: pd.Series, results: Results, telling: Sequence[str]) -> str:
    single = float(closed_form(results.plan.decisions[str(row["scene_id"])].asked).shields)
    ratio = f"{row['shields'] / single:.2g} times the stress of a single one"
    size, others = f"d = {labels.millimetres(row['d_m'])}", labels.told(row, telling)
    pile = ", ".join([_slope(row["alpha_deg"]), size, *others])
    seeds = ""
    if row["of_seeds"] > 1:
        usable = "" if row["seeds"] == row["of_seeds"] else f" usable ones of {row['of_seeds']}"
        seeds = (
            f" in the mean of {row['seeds']}{usable} seeds ({row['least']:.3g} … "
            f"{row['largest']:.3g})"
        )
    return (
        f"{pile}: {row['fraction']:.0%} of the exposed grains move at {ratio}, τ_c = "
        f"{row['shields']:.3g}{seeds}; upwind {_flow(row, 'ustar0_m_s')}{_unless(row)}."
    )


def _slope(alpha: Any) -> str:
    return labels.amount(float(alpha), "°")


def _grain_ends(grains: pd.DataFrame) -> list[pd.Series]:
    """The finest and the coarsest grain of the least slope."""
    table = grains.assign(valid=valid(grains))
    here = table[table["alpha_deg"] == table["alpha_deg"].min()].sort_values(
        ["valid", "d_m"], ascending=[False, True], kind="stable"
    )
    here = here[here["valid"]] if here["valid"].any() else here
    return [here.iloc[i] for i in sorted({0, len(here) - 1})]


def _of_grain(row: pd.Series) -> str:
    by_dem = pd.notna(row["ustar_m_s"])
    ustar = "ustar_m_s" if by_dem else "ustar_closed_form_m_s"
    shields = row["shields_dem" if by_dem else "shields_closed_form"]
    return (
        f"One grain of {labels.millimetres(row['d_m'])} on {_slope(row['alpha_deg'])} starts to "
        f"move at {_flow(row, ustar)}, τ_c = {shields:.3g}{_unless(row)}."
    )


def _flow(row: pd.Series, column: str) -> str:
    ustar = row[column]
    wind = ""
    if pd.notna(row.get("mean_speed_m_s")):
        wind = f", {row['mean_speed_m_s']:.2g} m/s in the mean over {row['depth_m']:g} m of depth"
    elif row["rho_f_kg_m3"] < GAS_BELOW:
        wind = f", {float(log_law_speed(ustar, 1.0, row['z0_m'])):.2g} m/s wind at 1 m"
    return f"u* {ustar:.2g} m/s{wind}"


def _unless(row: pd.Series) -> str:
    return "" if row["usable"] else f" (not usable: {row['why_not']})"


def _warnings(table: pd.DataFrame) -> Iterator[str]:
    usable = int(valid(table).sum())
    if usable < len(table):
        yield f"Usable: {usable} of {len(table)} thresholds."


def _chosen(results: Results) -> Iterator[str]:
    """Which levels answered where the study file says nothing of them."""
    chosen = [d for d in results.plan.decisions.values() if d.by_default]
    if chosen:
        names = ", ".join(dict.fromkeys(one.levels.text for one in chosen if one.levels))
        error = max(one.known.total for one in chosen)
        yield (
            f"Answered by default on the levels {names}: at most {error:.0%} off DEM, less than "
            f"the model's own choices move a threshold ({lowest_floor():.0%}). `--tolerance 0` "
            "runs DEM."
        )


def _worth(piles: pd.DataFrame, tolerance: float | None) -> Iterator[str]:
    """A tolerance below the model's own interval is answered, and this is said of it."""
    known = piles.dropna(subset=["shields", "shields_model_low"])
    if not tolerance or known.empty:
        return
    low = 1 - known["shields_model_low"] / known["shields"]
    high = known["shields_model_high"] / known["shields"] - 1
    if tolerance < float(((low + high) / 2).min()):
        yield (
            f"The tolerance of {tolerance:.0%} is about numerics. The choices that all models here "
            f"share move the same thresholds by −{low.max():.0%} … +{high.max():.0%}, most by "
            f"{known['model_share'].mode().iloc[0]} (see `orchestrator budget`)."
        )


def _frozen(piles: pd.DataFrame) -> Iterator[str]:
    """Where the flow of the whole pile is known to be too little to go by."""
    beyond = piles["frozen_bed"] > FROZEN_BED
    if beyond.any():
        least, most = piles.loc[beyond, "fraction"].min(), piles["frozen_bed"].max()
        yield (
            "The flow of the whole pile acts until the last grain has gone. With "
            f"`protocol.update = 0.1` the flow follows the bed: {int(beyond.sum())} of "
            f"{len(piles)} thresholds then move by more than {FROZEN_BED:.0%} (up to {most:.0%}, "
            f"from n/N = {least:.0%} on; column frozen_bed)."
        )


def sheet(results: Results) -> Sheet | None:
    """The thresholds in at most a screen: of few piles each, of many their range by slope."""
    piles = results.joined("pile_threshold")
    if len(piles):
        here = piles[piles["fraction"] == nearest_fraction(piles)]
        piles = seeds_as_one(here)
        return _each(piles) if len(piles) <= FEW else _ranges(here)
    return grains(results)


MODEL = "model's interval"
HEAD = ("τ_c", "interval", "u*₀, m/s", "usable")


def _each(rows: pd.DataFrame) -> Sheet:
    telling = varying(rows, "alpha_deg", "d_m", "force_law")
    several = (rows["of_seeds"] > 1).any()
    cells = [
        (
            _slope(row["alpha_deg"]),
            labels.millimetres(row["d_m"]),
            labels.value("force_law", row["force_law"]),
            *(
                labels.value(one, row[one]) if labels.is_told(one, row[one]) else "—"
                for one in telling
            ),
            *([_seeds(row)] if several else []),
            *_threshold(row),
        )
        for _, row in rows.sort_values(["alpha_deg", "d_m"], kind="stable").iterrows()
    ]
    fraction = rows["fraction"].iloc[0]
    tau, interval, *others = HEAD
    told = tuple(labels.words(one).label for one in telling)
    told = (*told, "τ_c of each seed") if several else told
    head = ("slope", "d", "forces", *told, f"{tau} at n/N = {fraction:.0%}", interval, MODEL)
    return Sheet((*head, *others), tuple(cells))


def _seeds(row: pd.Series) -> str:
    """How many seeds a row is of, and their least and largest threshold."""
    count = f"{row['seeds']} of {row['of_seeds']}"
    return f"{count}: {row['least']:.4f} … {row['largest']:.4f}" if row["seeds"] > 1 else count


def _threshold(row: pd.Series) -> tuple[str, str, str, str, str]:
    usable = "yes" if row["usable"] else f"no: {row['why_not']}"
    if pd.isna(row["shields"]):
        return "—", "—", "—", "—", usable
    low, high = sorted((row["shields_low"], row["shields_high"]))
    value, interval = f"{row['shields']:.4f}", f"{low:.4f} … {high:.4f}"
    return value, interval, _model(row), f"{row['ustar0_m_s']:.3f}", usable


def _model(row: pd.Series) -> str:
    """The model's own interval, and the choice behind most of it."""
    low, high = row["shields_model_low"], row["shields_model_high"]
    return "—" if pd.isna(low) else f"{low:.3f} … {high:.3f}, most by {row['model_share']}"


def _ranges(rows: pd.DataFrame) -> Sheet:
    cells = []
    fluids = _fluids(rows)
    for (alpha, law, *fluid), own in split(rows, "alpha_deg", "force_law", *fluids):
        usable = own[valid(own)]
        cells.append(
            (
                _slope(alpha),
                _span(own["d_m"] * 1e3, "g") + " mm",
                labels.value("force_law", law),
                *_fluid(fluids, fluid),
                _span(usable["shields"], ".4f"),
                f"{usable['shields_low'].min():.4f} … {usable['shields_high'].max():.4f}"
                if len(usable)
                else "—",
                _span(usable["ustar0_m_s"], ".3f"),
                f"{len(usable)} of {len(own)}",
            )
        )
    fraction = rows["fraction"].iloc[0]
    tau, *others = HEAD
    head = ("slope", "d", "forces", *_fluid_head(fluids), f"{tau} at n/N = {fraction:.0%}", *others)
    return Sheet(head, tuple(cells))


def grains(results: Results) -> Sheet | None:
    """By slope, force law and method: the range of the thresholds of single grains."""
    rows, cells = results.joined("single_grain"), []
    if rows.empty:
        return None
    fluids = _fluids(rows)
    for (alpha, law, method, *fluid), own in split(
        rows, "alpha_deg", "force_law", "answered_method", *fluids
    ):
        usable = own[valid(own)]
        name = "shields_dem" if method == "dem" else "shields_closed_form"
        ustar = "ustar_m_s" if method == "dem" else "ustar_closed_form_m_s"
        low, high = (f"{name}_low", f"{name}_high") if method == "dem" else (name, name)
        cells.append(
            (
                _slope(alpha),
                _span(own["d_m"] * 1e3, "g") + " mm",
                labels.value("force_law", law),
                *_fluid(fluids, fluid),
                "DEM" if method == "dem" else "closed form",
                _span(usable[name], ".4f"),
                f"{usable[low].min():.4f} … {usable[high].max():.4f}" if len(usable) else "—",
                _span(usable[ustar], ".3f"),
                f"{len(usable)} of {len(own)}",
            )
        )
    tau, interval, ustar0, usable_ = HEAD
    told = ("slope", "d", "forces", *_fluid_head(fluids), "by")
    return Sheet((*told, tau, interval, ustar0, usable_), tuple(cells))


def _fluids(rows: pd.DataFrame) -> list[str]:
    """The columns of fluids in which rows differ: they are never merged."""
    return [one for one in ("rho_f_kg_m3", "nu_m2_s") if rows[one].nunique() > 1]


def _fluid(columns: Sequence[str], values: Sequence[Any]) -> list[str]:
    return [labels.value(*pair) for pair in zip(columns, values, strict=True)]


def _fluid_head(columns: Sequence[str]) -> list[str]:
    return [labels.words(one).symbol or labels.words(one).label for one in columns]


def _span(values: pd.Series, form: str) -> str:
    known = values.dropna()
    if known.empty:
        return "—"
    ends = dict.fromkeys(format(float(value), form) for value in (known.min(), known.max()))
    return " … ".join(ends)


def text(results: Results) -> str:
    """The short table, then the sentences, for a terminal."""
    said = "\n".join(sentences(results)) or "No case has given a result yet."
    found = sheet(results)
    if found is None:
        return said
    widths = [max(map(len, column)) for column in zip(found.head, *found.rows, strict=True)]
    lines = (
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in (found.head, *found.rows)
    )
    return "\n".join([*lines, "", said])
