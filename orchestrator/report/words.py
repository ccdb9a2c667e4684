"""The answer of a study in sentences and tables, and all other words of its page."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from platform import python_version
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from orchestrator import __version__
from orchestrator.errors import OrchestratorError
from orchestrator.fidelity import levels as fidelity
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.laws import LAWS
from orchestrator.physics.velocity import log_law_speed, smooth_wall_roughness
from orchestrator.report import labels, theory
from orchestrator.report.page import caption
from orchestrator.report.results import Results, by_dem, held, measured_hills, split, valid
from orchestrator.runs import case
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form

FEW = 12
"""Piles, or values of a parameter, that are listed each; of more the range is told."""
PACKAGES = ("gmsh", "matplotlib", "meshio", "numpy", "pandas", "pyvista", "scipy", "vtk")
EACH, RANGES = ("alpha_deg", "d_m", "force_law"), ("alpha_deg", "force_law")
"""Columns that each row of a table tells, of single piles and of ranges."""


def text(results: Results) -> str:
    """The short table, then the sentences, for a terminal.

    An `OrchestratorError` if the tables lack columns, as those of another version do.
    """
    try:
        answer = "\n".join(sentences(results)) or "No case has given a result yet."
        table = short(results)
    except KeyError as error:
        what = f"its tables lack {error}: another version of this program wrote them"
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(what, where=str(results.cases.parent), remedy=remedy) from None
    if table is None:
        return answer
    rows = [[str(name) for name in table], *table.to_numpy(str).tolist()]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = ("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
    return "\n".join([*padded, "", answer])


def sentences(results: Results) -> list[str]:
    """The answer, from the least slope to the largest, then warnings."""
    piles, grains = results.joined("pile_threshold"), _single(results)
    table = piles if len(piles) else grains
    if table.empty:
        return []
    count, usable = len(table), table["usable"].sum()
    warnings = [f"Usable: {usable} of {count} thresholds."] if usable < count else []
    if piles.empty:
        return [*_grains(grains), *warnings]
    hills, ends = list(_hills(results)), []
    if usable or not hills:  # the least and the largest slope in each fluid, as in the pictures
        for _, wet in split(results.exemplars, "rho_f_kg_m3"):
            firsts = wet.drop_duplicates("alpha_deg")
            ends += [firsts.iloc[at] for at in sorted({0, len(firsts) - 1})]
    ends.sort(key=lambda row: float(row["alpha_deg"]))
    telling = labels.varying(piles, "alpha_deg", "d_m", "fraction")[:3]
    beyond = piles[piles["frozen_bed"] > FROZEN_BED]
    if len(beyond):
        warnings.append(caption("frozen", beyond=beyond, count=count, limit=FROZEN_BED))
    chosen = [d for d in results.plan.decisions.values() if d.by_default]
    if chosen:
        names = ", ".join(dict.fromkeys(item.levels.text for item in chosen if item.levels))
        error, floor = max(item.known.total for item in chosen), min(fidelity.floors().values())
        warnings.append(caption("defaults", names=names, error=error, floor=floor))
    rows, tolerance = piles.dropna(subset=["shields", "shields_model_low"]), results.study.tolerance
    if tolerance and len(rows):
        low = 1 - rows["shields_model_low"] / rows["shields"]
        high = rows["shields_model_high"] / rows["shields"] - 1
        if tolerance < float(((low + high) / 2).min()):
            facts = {"ends": (low.max(), high.max()), "share": rows["model_share"].mode().iloc[0]}
            warnings.append(caption("tolerance", tolerance=tolerance, **facts))
    return [*hills, *(_pile(row, results, telling) for row in ends), *warnings]


def _pile(row: pd.Series, results: Results, telling: Sequence[str]) -> str:
    single = float(closed_form(results.plan.decisions[str(row["scene_id"])].asked).shields)
    slope = labels.value("alpha_deg", row["alpha_deg"])
    name = ", ".join([slope, *labels.told(row, ["d_m", *telling])])
    return caption("pile", row=row, name=name, single=single, flow=_flow(row))


def _grains(grains: pd.DataFrame) -> Iterator[str]:
    """The finest and the coarsest grain of the least slope."""
    here = grains[grains["alpha_deg"] == grains["alpha_deg"].min()]
    here = (here[valid(here)] if valid(here).any() else here).sort_values("d_m", kind="stable")
    for at in sorted({0, len(here) - 1}):
        row = here.iloc[at]
        size, slope = (labels.value(column, row[column]) for column in ("d_m", "alpha_deg"))
        yield caption("one_grain", row=row, size=size, slope=slope, flow=_flow(row))


def _flow(row: pd.Series) -> str:
    """A friction velocity with a speed that is measured: of a channel's mean, or of the wind."""
    ustar = row["ustar0_m_s"]
    if pd.notna(row.get("mean_velocity_m_s")):
        speed, depth = row["mean_velocity_m_s"], row["depth_m"]
        return f"u* {ustar:.2g} m/s, {speed:.2g} m/s in the mean over {depth:g} m of depth"
    if row["rho_f_kg_m3"] >= GAS_BELOW:
        return f"u* {ustar:.2g} m/s"
    z0 = max(row["z0_m"], float(smooth_wall_roughness(ustar, row["nu_m2_s"])))
    return f"u* {ustar:.2g} m/s, {float(log_law_speed(ustar, 1.0, z0)):.2g} m/s wind at 1 m"


def _hills(results: Results) -> Iterator[str]:
    """Where reversed flow ends behind each hill that others measured, by model and as measured."""
    for hill, rows in measured_hills(results):
        names = labels.cells(rows, ["turbulence_model"]).popitem()[1]
        ends = dict(zip(names, rows["reattachment_over_h"], strict=True))
        measured = rows["measured_reattachment_over_h"].iloc[0]
        facts = {"measured": measured, "verified": rows["measured_verified"].all()}
        yield caption("hill", hill=hill, ends=ends, **facts)


def short(results: Results) -> pd.DataFrame | None:
    """The thresholds in at most a screen: of few piles each, of many their range by slope."""
    here = results.at_fraction
    if here.empty:
        return grains(results)
    keys = [*EACH, *labels.varying(here, *EACH)]
    few = len(here[keys].drop_duplicates()) <= FEW
    tau = f"τ_c at n/N = {here['fraction'].iloc[0]:.0%}"
    return _thresholds(here, keys if few else RANGES, tau)


def piles(results: Results) -> pd.DataFrame | None:
    """The thresholds of the piles at every fraction, with the name of the case last."""
    rows = results.joined("pile_threshold")
    if rows.empty:
        return None
    keys, seeds = [*EACH, "z0_over_d", "nu_m2_s"], ["seed"] * (rows["seed"].nunique() > 1)
    keys += [*labels.varying(rows, *keys, "fraction"), *seeds, "fraction"]
    return _thresholds(rows, keys, more=("count", "case"))


def grains(results: Results) -> pd.DataFrame | None:
    """By slope, force law, fluid and method: the range of the thresholds of single grains."""
    rows = _single(results)
    return None if rows.empty else _thresholds(rows, [*RANGES, "by"])


def _single(results: Results) -> pd.DataFrame:
    """Single grains with their thresholds: by DEM, or else by the closed form."""
    rows = results.joined("single_grain")
    if rows.empty:
        return rows
    dem, ends = rows["answered_method"] == "dem", ("", "_low", "_high")
    exact = rows["shields_closed_form"]
    values = {f"shields{end}": rows[f"shields_dem{end}"].where(dem, exact) for end in ends}
    ustar = rows["ustar_m_s"].where(dem, rows["ustar_closed_form_m_s"])
    values |= {"ustar0_m_s": ustar, "by": dem.map({True: "DEM", False: "closed form"})}
    return pd.concat([rows, pd.DataFrame(values)], axis=1)


def _thresholds(
    rows: pd.DataFrame, keys: Sequence[str], tau: str = "τ_c", more: Sequence[str] = ()
) -> pd.DataFrame:
    """A row for all thresholds that agree in some columns, with the range of the usable ones."""
    ranges = "d_m" not in keys
    if ranges:  # fluids are never merged
        keys = [*keys, *(n for n in ("rho_f_kg_m3", "nu_m2_s") if rows[n].nunique() > 1)]
    rows = rows.sort_values(keys if ranges else ["alpha_deg", "d_m"], kind="stable")
    number = rows.groupby(list(keys), dropna=False, sort=False).ngroup()
    usable, d = (rows[name].groupby(number) for name in ("usable", "d_m"))
    shown = rows[rows["usable"] | ~usable.transform("any")].groupby(number)
    low, high = (end(numeric_only=True).astype(float) for end in (shown.min, shown.max))
    first = shown.first()
    table: dict[str, Any] = labels.cells(first, keys)
    if ranges:
        low[~usable.any()] = np.nan
        table["diameter, mm"] = _spans(1e3 * d.min(), 1e3 * d.max(), "g")
    table[tau] = _spans(low["shields"], high["shields"], ".4f")
    table["interval"] = _spans(low["shields_low"], high["shields_high"], ".4f")
    if "shields_model_low" in rows and not ranges:
        wide = _spans(low["shields_model_low"], high["shields_model_high"], ".3f")
        shares = zip(wide, first["model_share"], strict=True)
        table["model's interval"] = [f"{a}, most by {b}" if a != "—" else a for a, b in shares]
    table["u*₀, m/s"] = _spans(low["ustar0_m_s"], high["ustar0_m_s"], ".3f")
    table["usable"] = [
        f"{n} of {of}" if ranges or of > 1 else "yes" if n else f"no: {why}"
        for n, of, why in zip(usable.sum(), usable.size(), first["why_not"], strict=True)
    ]
    return pd.DataFrame({**table, **{name: first[name] for name in more}})


def _spans(low: pd.Series, high: pd.Series, form: str) -> list[str]:
    """The range between each two values as a text, one number where they are written alike."""
    pairs = ([format(float(end), form) for end in pair] for pair in zip(low, high, strict=True))
    return ["—" if "nan" in pair else " … ".join(dict.fromkeys(pair)) for pair in pairs]


def force_laws(results: Results) -> pd.DataFrame:
    """The force laws of the scenes: where each holds, and where it was taken from."""
    rows = []
    for law in (LAWS[name] for name in LAWS if (results.scenes["force_law"] == name).any()):
        low, high = law.reynolds
        holds = f"{low:g} ≤ Re* < {high:g}".replace("inf", "∞")
        if np.isfinite(law.drag_end):
            holds += f", V d/ν < {law.drag_end:g} (drag: {law.drag_law})"
        rows.append((law.label, holds, law.reference))
    return pd.DataFrame(rows, columns=["force law", "holds for", "source"])


def parameters(results: Results) -> pd.DataFrame:
    """The values that each parameter of the scenes takes."""
    rows = []
    for column, item in fields.COLUMNS.items():
        asked, run = _values(results.scenes[column]), fields.ANSWERED + column
        answered = _values(results.scenes[run]) if run in fields.ANSWERS else asked
        if asked or answered:
            words = filter(None, (item.info.label, item.info.symbol.replace("_0", "₀")))
            name, other = ", ".join(words), "" if answered == asked else answered
            rows.append((name, item.info.unit, item.name or column, asked or "default", other))
    head = ["parameter", "unit", "in a study file", "asked for", "answered with, if otherwise"]
    return pd.DataFrame(rows, columns=head)


def _values(column: pd.Series) -> str:
    """The different values of a column, of many the ends."""
    values = sorted(column.dropna().unique(), key=lambda value: (isinstance(value, str), value))
    texts = list(dict.fromkeys(v if isinstance(v, str) else f"{v:.6g}" for v in values))
    return ", ".join(texts if len(texts) <= FEW else [*texts[:2], "…", texts[-1]])


def versions(solvers: Mapping[str, str]) -> pd.DataFrame:
    """Solvers with their versions, this package, and the libraries that are not among them."""
    rows = [*sorted(solvers.items()), ("orchestrator", __version__), ("Python", python_version())]
    rows += [(name, metadata.version(name)) for name in PACKAGES if name not in solvers]
    return pd.DataFrame(rows, columns=["program", "version"])


def times(timings: pd.DataFrame) -> pd.DataFrame | None:
    """Wall time of the finished cases by their kind: in the solver, and outside it."""
    if timings.empty:
        return None
    groups = pd.concat([timings, timings.assign(kind="all")]).groupby("kind", sort=False)
    sums = groups.agg({"case": "size", "solver_s": "sum", "outside_s": "sum"})
    head = ["kind of case", "cases", "in the solver, s", "outside it, s"]
    return sums.reset_index().set_axis(head, axis=1)


def levels(results: Results) -> pd.DataFrame | None:
    """On which fidelity levels the piles were answered, why, and what is known of them."""
    rows, table = [], results.joined("pile_threshold")
    about = {each.name: each.meaning for part in fidelity.LEVELS.values() for each in part}
    for (flow, grain, why), group in split(table, "flow_level", "grain_level", "why"):
        meaning = "; ".join(about[name] for name in (str(flow), str(grain)) if name in about)
        error = group["error_estimate"].max()
        rows.append((f"{flow} | {grain}", meaning, why, group["scene_id"].nunique(), 100 * error))
    head = ["flow | grains", "description", "reason", "piles", "known error of τ_c, at most, %"]
    return pd.DataFrame(rows, columns=head) if rows else None


def checks(results: Results) -> pd.DataFrame | None:
    """The piles that DEM answered as well: how far the cheap answers are from it."""
    table = results.tables.get("check", pd.DataFrame())
    if table.empty:
        return None
    asked = labels.cells(table, ["alpha_deg", "packing", "force_law", "d_m", "fraction"])
    names = ["shields", "shields_dem", "shields_dem_low", "shields_dem_high", "difference"]
    return pd.DataFrame({**asked, **table[[*names, "agree", "case"]]})


def remarks(results: Results) -> dict[str, Any]:
    """Counts that a reader must know before using this study's results; 0 is no remark."""
    scenes, thresholds = results.scenes, results.joined("pile_threshold")
    outside = scenes[~valid(scenes)]
    both = outside["force_law"].isin(theory.PAIR) & (outside["regime"] == "transition")
    names = ["scene_id", "carried_off", "fallen_upstream"]
    curve = results.tables.get("pile_curve", pd.DataFrame()).reindex(columns=names)
    lost = curve.groupby("scene_id").max()
    grains = by_dem(results.joined("single_grain"))
    counts: dict[str, Any] = {
        **{"outside": len(outside), "transition": both.sum(), "thresholds": len(thresholds)},
        "unreached": thresholds["shields"].isna().sum() if len(thresholds) else 0,
        **{name: ((lost[name] > 0).sum(), lost[name].max()) for name in names[1:]},
    }
    if len(grains):
        ratio = grains["ustar_m_s"] / grains["ustar_closed_form_m_s"]
        far = ((ratio - 1).abs() > 0.01) & held(grains)
        counts |= {"far": (far.sum(), (far & valid(grains)).sum()), "silent": ratio.isna().sum()}
    return {"far": (0, 0), "silent": 0, **counts}


def contents(
    results: Results, timings: pd.DataFrame, failures: Mapping[str, str]
) -> dict[str, Any]:
    """The words and numbers of the page beside its figures, by the names of its template."""
    from orchestrator.report import flows  # imports what draws

    sheets = (short, piles, grains, levels, checks, remarks, force_laws, parameters)
    root, cases = results.cases, results.plan.cases
    scenes = [pile.scene for pile in results.plan.piles.values()]
    return {
        **{sheet.__name__: sheet(results) for sheet in sheets},
        "results": results,
        "title": results.study.title,
        "answer": sentences(results),
        "measured": theory.section(results),
        "programs": versions(case.programs(root, cases)),
        "times": times(timings),
        "failures": failures,
        "links": {n: quote(f"{root.name}/{n}/") for n in cases if (root / n).is_dir()},
        "paper_pair": results.scenes["force_law"].isin(theory.PAIR).any(),
        "eq10": flows.eq10_over_wall(results, tuple(results.flows)) if results.flows else None,
        "methods": set(results.scenes["answered_method"]),
        "mixed": any(scene.grain.sizes is not None for scene in scenes),
        "strips": "answered_width" in results.scenes and results.scenes["answered_width"].any(),
    }
