"""The answer of a study in sentences and tables, and all other words of its page."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from platform import python_version
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from orchestrator import __version__
from orchestrator.fidelity import levels as fidelity
from orchestrator.fidelity.calibration import lowest_floor
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.physics.velocity import log_law_speed, smooth_wall_roughness
from orchestrator.report import labels, theory
from orchestrator.report.page import caption
from orchestrator.report.results import (
    Results,
    by_dem,
    held,
    measured_hills,
    nearest_fraction,
    seeds_as_one,
    split,
    valid,
)
from orchestrator.runs.case import IDENTITY
from orchestrator.runs.files import read_json
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form

GAS_BELOW = 100.0
"""Density that tells gases from liquids, kg/m3: a gas has a wind."""
TELLING = 3
"""Fields beside slope and diameter that a sentence tells of a pile."""
FEW = 12
"""Piles, or values of a parameter, that are listed each; of more the range is told."""
PACKAGES = (
    *("gmsh", "jinja2", "matplotlib", "meshio", "numpy"),
    *("pandas", "pydantic", "pyvista", "scipy", "vtk"),
)
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that each row of the table of piles tells."""


def text(results: Results) -> str:
    """The short table, then the sentences, for a terminal."""
    answer = "\n".join(sentences(results)) or "No case has given a result yet."
    table = sheet(results)
    if table is None:
        return answer
    rows = [[str(name) for name in table], *table.to_numpy(str).tolist()]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = (
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
    return "\n".join([*lines, "", answer])


def sentences(results: Results) -> list[str]:
    """The answer, from the least slope to the largest; a warning where little is usable."""
    piles, grains = results.joined("pile_threshold"), results.joined("single_grain")
    table = piles if len(piles) else grains
    if table.empty:
        return []
    usable = int(valid(table).sum())
    count = f"Usable: {usable} of {len(table)} thresholds."
    warnings = [count] if usable < len(table) else []
    if piles.empty:
        return [*_grains(grains), *warnings]
    hills, ends = list(_hills(results)), []
    if usable or not hills:  # the least and the largest slope in each fluid, as in the pictures
        for _, wet in split(results.exemplars, "rho_f_kg_m3"):
            firsts = wet.drop_duplicates("alpha_deg")
            ends += [firsts.iloc[at] for at in sorted({0, len(firsts) - 1})]
    ends.sort(key=lambda row: float(row["alpha_deg"]))
    telling = labels.varying(piles, "alpha_deg", "d_m", "fraction")[:TELLING]
    beyond = piles[piles["frozen_bed"] > FROZEN_BED]
    if len(beyond):
        warnings.append(caption("frozen", beyond=beyond, count=len(piles), limit=FROZEN_BED))
    chosen = [d for d in results.plan.decisions.values() if d.by_default]
    if chosen:
        names = ", ".join(dict.fromkeys(item.levels.text for item in chosen if item.levels))
        error = max(item.known.total for item in chosen)
        warnings.append(caption("defaults", names=names, error=error, floor=lowest_floor()))
    warnings += _tolerance(piles, results.study.tolerance)
    return [*hills, *(_pile(row, results, telling) for row in ends), *warnings]


def _pile(row: pd.Series, results: Results, telling: Sequence[str]) -> str:
    single = float(closed_form(results.plan.decisions[str(row["scene_id"])].asked).shields)
    size, others = f"d = {labels.millimetres(row['d_m'])}", labels.told(row, telling)
    name = ", ".join([labels.value("alpha_deg", row["alpha_deg"]), size, *others])
    flow, why = _flow(row, row["ustar0_m_s"]), "" if row["usable"] else row["why_not"]
    return caption("pile", row=row, name=name, single=single, flow=flow, why=why)


def _grains(grains: pd.DataFrame) -> Iterator[str]:
    """The finest and the coarsest grain of the least slope."""
    here = grains[grains["alpha_deg"] == grains["alpha_deg"].min()]
    here = here[valid(here)] if valid(here).any() else here
    here = here.sort_values("d_m", kind="stable")
    for at in sorted({0, len(here) - 1}):
        row = here.iloc[at]
        names = ("ustar_m_s", "shields_dem")
        if pd.isna(row["ustar_m_s"]):
            names = ("ustar_closed_form_m_s", "shields_closed_form")
        ustar, shields = (row[name] for name in names)
        size, slope = labels.millimetres(row["d_m"]), labels.value("alpha_deg", row["alpha_deg"])
        facts = {"flow": _flow(row, ustar), "why": "" if row["usable"] else row["why_not"]}
        yield caption("one_grain", size=size, slope=slope, shields=shields, **facts)


def _flow(row: pd.Series, ustar: float) -> str:
    """A friction velocity with a speed that is measured: of a channel's mean, or of the wind."""
    if pd.notna(row.get("mean_speed_m_s")):
        speed, depth = row["mean_speed_m_s"], row["depth_m"]
        return f"u* {ustar:.2g} m/s, {speed:.2g} m/s in the mean over {depth:g} m of depth"
    if row["rho_f_kg_m3"] >= GAS_BELOW:
        return f"u* {ustar:.2g} m/s"
    z0 = max(row["z0_m"], float(smooth_wall_roughness(ustar, row["nu_m2_s"])))
    return f"u* {ustar:.2g} m/s, {float(log_law_speed(ustar, 1.0, z0)):.2g} m/s wind at 1 m"


def _hills(results: Results) -> Iterator[str]:
    """Where reversed flow ends behind each hill that others measured, by model and as measured."""
    for hill, rows in measured_hills(results):
        names = [labels.value("turbulence_model", name) for name in rows["turbulence_model"]]
        ends = dict(zip(names, rows["reattachment_over_h"], strict=True))
        yield caption(
            "hill",
            hill=hill,
            ends={name: end for name, end in ends.items() if pd.notna(end)},
            without=[name for name, end in ends.items() if pd.isna(end)],
            measured=rows["measured_reattachment_over_h"].iloc[0],
            verified=rows["measured_verified"].all(),
        )


def _tolerance(piles: pd.DataFrame, tolerance: float | None) -> Iterator[str]:
    """A warning about a tolerance below the interval of the model's own choices."""
    rows = piles.dropna(subset=["shields", "shields_model_low"])
    if not tolerance or rows.empty:
        return
    low = 1 - rows["shields_model_low"] / rows["shields"]
    high = rows["shields_model_high"] / rows["shields"] - 1
    if tolerance < float(((low + high) / 2).min()):
        ends, share = (low.max(), high.max()), rows["model_share"].mode().iloc[0]
        yield caption("tolerance", tolerance=tolerance, ends=ends, share=share)


def sheet(results: Results) -> pd.DataFrame | None:
    """The thresholds in at most a screen: of few piles each, of many their range by slope."""
    piles = results.joined("pile_threshold")
    if piles.empty:
        return grains(results)
    here = piles[piles["fraction"] == nearest_fraction(piles)]
    one_each = seeds_as_one(here)
    if len(one_each) <= FEW:
        return _each(one_each)
    tau = f"τ_c at n/N = {here['fraction'].iloc[0]:.0%}"
    return _ranges(here, ["alpha_deg", "force_law"], tau, "shields", "ustar0_m_s")


def grains(results: Results) -> pd.DataFrame | None:
    """By slope, force law, fluid and method: the range of the thresholds of single grains."""
    rows = results.joined("single_grain")
    if rows.empty:
        return None
    dem, values = rows["answered_method"] == "dem", {}
    for name in ("shields", "ustar"):
        unit = "_m_s" if name == "ustar" else ""
        run = f"{name}_dem" if name == "shields" else name
        for end in ("", "_low", "_high"):
            exact = rows[f"{name}_closed_form{unit}"]
            values[f"{name}{end}"] = rows[f"{run}{end}{unit}"].where(dem, exact)
    by = dem.map({True: "DEM", False: "closed form"})
    keys = ["alpha_deg", "force_law", "by"]
    return _ranges(rows.assign(by=by, **values), keys, "τ_c", "shields", "ustar")


def _each(rows: pd.DataFrame) -> pd.DataFrame:
    """A row for each pile; seeds are one."""
    telling = labels.varying(rows, "alpha_deg", "d_m", "force_law")
    cells = []
    for _, row in rows.sort_values(["alpha_deg", "d_m"], kind="stable").iterrows():
        cell = {
            "slope": labels.value("alpha_deg", row["alpha_deg"]),
            "d": labels.millimetres(row["d_m"]),
            "forces": labels.value("force_law", row["force_law"]),
        }
        for item in telling:
            told = labels.is_told(item, row[item])
            cell[labels.words(item).label] = labels.value(item, row[item]) if told else "—"
        if (rows["of_seeds"] > 1).any():
            ends = f": {row['least']:.4f} … {row['largest']:.4f}" if row["seeds"] > 1 else ""
            cell["τ_c of each seed"] = f"{row['seeds']} of {row['of_seeds']}{ends}"
        low, high = row["shields_model_low"], row["shields_model_high"]
        model = "—" if pd.isna(low) else f"{low:.3f} … {high:.3f}, most by {row['model_share']}"
        reached = pd.notna(row["shields"])
        cell |= {
            f"τ_c at n/N = {row['fraction']:.0%}": _number(row["shields"], ".4f"),
            "interval": _interval(row["shields_low"], row["shields_high"]),
            "model's interval": model if reached else "—",
            "u*₀, m/s": _number(row["ustar0_m_s"], ".3f"),
            "usable": "yes" if row["usable"] else f"no: {row['why_not']}",
        }
        cells.append(cell)
    return pd.DataFrame(cells)


def _ranges(
    rows: pd.DataFrame, keys: list[str], tau: str, shields: str, ustar: str
) -> pd.DataFrame:
    """Ranges of usable thresholds by some columns; fluids are never merged."""
    fluids = [item for item in ("rho_f_kg_m3", "nu_m2_s") if rows[item].nunique() > 1]
    cells = []
    for _, group in split(rows, *keys, *fluids):
        first, usable = group.iloc[0], group[valid(group)]
        cells.append(
            {
                "slope": labels.value("alpha_deg", first["alpha_deg"]),
                "d": f"{_span(group['d_m'] * 1e3, 'g')} mm",
                "forces": labels.value("force_law", first["force_law"]),
                **{labels.words(item).symbol: labels.value(item, first[item]) for item in fluids},
                **({"by": first["by"]} if "by" in keys else {}),
                tau: _span(usable[shields], ".4f"),
                "interval": _interval(
                    usable[f"{shields}_low"].min(), usable[f"{shields}_high"].max()
                ),
                "u*₀, m/s": _span(usable[ustar], ".3f"),
                "usable": f"{len(usable)} of {len(group)}",
            }
        )
    return pd.DataFrame(cells)


def _number(value: float, form: str) -> str:
    return "—" if pd.isna(value) else format(float(value), form)


def _interval(low: float, high: float) -> str:
    return "—" if pd.isna(low) or pd.isna(high) else f"{min(low, high):.4f} … {max(low, high):.4f}"


def _span(values: pd.Series, form: str) -> str:
    ends = (values.min(), values.max())
    return " … ".join(dict.fromkeys(_number(value, form) for value in ends))


def piles(results: Results) -> pd.DataFrame | None:
    """The thresholds of the piles, a row for each, with the name of its case last."""
    rows = results.joined("pile_threshold")
    if rows.empty:
        return None
    extra = labels.varying(rows, *SHOWN, "fraction")
    cells = []
    for _, group in split(rows, "alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "scene_id"):
        row = group.iloc[0]
        slope, ratio = labels.value("alpha_deg", row["alpha_deg"]), row["z0_over_d"]
        cell = {
            "pile: α, d, z₀": f"{slope}, {labels.millimetres(row['d_m'])},\n"
            f"{labels.ratio_of(ratio, 'd')}",
            "forces, ν in m²/s": f"{labels.value('force_law', row['force_law'])}, "
            f"{row['nu_m2_s']:g}",
            **({"other choices": "\n".join(labels.told(row, extra))} if extra else {}),
            "N": str(row["count"]),
        }
        for _, item in group.sort_values("fraction").iterrows():
            interval = _interval(item["shields_low"], item["shields_high"])
            cell[f"τ_c at n/N = {item['fraction']:.0%}"] = (
                str(item["why_not"])
                if pd.isna(item["shields"])
                else f"{item['shields']:.4f}\n({interval})\nu*₀ {item['ustar0_m_s']:.3f} m/s"
            )
        cells.append({**cell, "case": row["case"] if isinstance(row["case"], str) else ""})
    table = pd.DataFrame(cells).fillna("—")
    return table[[*(item for item in table if item != "case"), "case"]]


def single_grains(results: Results) -> pd.DataFrame | None:
    """How far DEM is from the closed form, by force law, whether it holds, and protocol."""
    rows = by_dem(results.joined("single_grain"))
    if rows.empty:
        return None
    exact = rows["ustar_closed_form_m_s"]
    width = (rows["ustar_high_m_s"] - rows["ustar_low_m_s"]) / exact / 2
    rows = rows.assign(
        holds=np.where(valid(rows), "yes", "no"),
        protocol=np.where(held(rows), "holds", "ramps"),
        off=rows["ustar_m_s"] / exact - 1,
        width=width,
    )
    cells = [
        {
            "forces": labels.value("force_law", group["force_law"].iloc[0]),
            "law holds": group["holds"].iloc[0],
            "protocol": group["protocol"].iloc[0],
            "grains": str(len(group)),
            "never moved": str(int(group["off"].isna().sum())),
            "mean of u*/u*(closed form) − 1": f"{group['off'].mean():+.3%}",
            "largest |u*/u*(closed form) − 1|": f"{group['off'].abs().max():.3%}",
            "median half width of the interval": f"±{group['width'].median():.3%}",
        }
        for _, group in split(rows, "force_law", "holds", "protocol")
    ]
    table = pd.DataFrame(cells)
    return table.sort_values(["forces", "law holds", "protocol"], ascending=False)


def force_laws(results: Results) -> pd.DataFrame:
    """The force laws of the scenes: where each holds, and where it was taken from."""
    rows = []
    for name, law in LAWS.items():
        if (results.scenes["force_law"] == name).any():
            low, high = law.reynolds
            parts = [f"Re* ≥ {low:g}"] if low > 0 else []
            parts += [f"Re* < {high:g}"] if np.isfinite(high) else []
            if np.isfinite(law.drag_end):
                parts.append(f"V d/ν < {law.drag_end:g} (drag: {law.drag_law})")
            rows.append((law.label, ", ".join(parts) or "every Re*", law.reference))
    return pd.DataFrame(rows, columns=["force law", "holds for", "source"])


def parameters(results: Results) -> pd.DataFrame:
    """The values that each parameter of the scenes takes."""
    rows = []
    for column, item in fields.COLUMNS.items():
        asked, run = _values(results.scenes[column]), fields.ANSWERED + column
        answered = _values(results.scenes[run]) if run in fields.ANSWERS else asked
        if asked or answered:
            symbol = item.info.symbol.replace("_0", "₀")
            name = f"{item.info.label}, {symbol}" if symbol else item.info.label
            other = "" if answered == asked else answered
            rows.append((name, item.info.unit, item.name or column, asked or "default", other))
    head = ["parameter", "unit", "in a study file", "asked for", "answered with, if otherwise"]
    return pd.DataFrame(rows, columns=head)


def _values(column: pd.Series) -> str:
    values = list(column.dropna().unique())
    if all(isinstance(value, str) for value in values):
        return ", ".join(sorted(map(str, values)))
    numbers = list(dict.fromkeys(f"{number:.6g}" for number in sorted(map(float, values))))
    return (
        ", ".join(numbers)
        if len(numbers) <= FEW
        else f"{len(numbers)} from {numbers[0]} to {numbers[-1]}"
    )


def programs(results: Results) -> pd.DataFrame:
    """The solvers by what the cases say of them, and the libraries."""
    used: dict[str, set[str]] = {}
    for name in results.plan.cases:
        identity = read_json(results.cases / name / IDENTITY)
        solvers = identity.get("programs", {}) if isinstance(identity, dict) else {}
        for program, version in solvers.items():
            used.setdefault(str(program), set()).add(str(version))
    return versions({program: ", ".join(sorted(values)) for program, values in used.items()})


def versions(solvers: Mapping[str, str]) -> pd.DataFrame:
    """Solvers with their versions, this package, and the libraries that are not among them."""
    rows = [*sorted(solvers.items()), ("orchestrator", __version__), ("Python", python_version())]
    installed = {item.metadata["Name"].lower(): item.version for item in metadata.distributions()}
    rows += [
        (name, installed.get(name, "not installed")) for name in PACKAGES if name not in solvers
    ]
    return pd.DataFrame(rows, columns=["program", "version"])


def times(timings: pd.DataFrame) -> pd.DataFrame | None:
    """Wall time of the finished cases by their kind: in the solver, and outside it."""
    if timings.empty:
        return None
    rows = []
    for name, group in [
        *((str(kind), group) for (kind,), group in split(timings, "kind")),
        ("all", timings),
    ]:
        wall = group["solver_s"] + group["outside_s"]
        seconds = (group["solver_s"].sum(), group["outside_s"].sum(), wall.max())
        rows.append((name, str(len(group)), *(f"{value:.1f}" for value in seconds)))
    head = ["kind of case", "cases", "in the solver, s", "outside it, s", "longest case, s"]
    return pd.DataFrame(rows, columns=head)


def levels(results: Results) -> pd.DataFrame | None:
    """On which fidelity levels the piles were answered, why, and what is known of them."""
    table = results.joined("pile_threshold")
    rows = []
    for (flow, grain, why), group in split(table, "flow_level", "grain_level", "why"):
        error = group["error_estimate"].max()
        rows.append(
            {
                "flow | grains": f"{flow} | {grain}",
                "description": fidelity.meaning([str(flow), str(grain)]),
                "reason": str(why),
                "piles": str(group["scene_id"].nunique()),
                "known error of τ_c, up to": "not known"
                if pd.isna(error)
                else f"{100 * error:.1f} %",
            }
        )
    return pd.DataFrame(rows) if rows else None


def checks(results: Results) -> pd.DataFrame | None:
    """The piles that DEM answered as well: how far the cheap answers are from it."""
    rows = [
        {
            "piles": f"{labels.amount(item['alpha_deg'], '°')}, {item['packing']}, "
            f"{labels.value('force_law', item['force_law'])}",
            "d": f"{1e3 * item['d_m']:g} mm",
            "n/N": f"{item['fraction']:.0%}",
            "τ_c": f"{item['shields']:.4g}",
            "by DEM": f"{item['shields_dem']:.4g} "
            f"({item['shields_dem_low']:.4g} … {item['shields_dem_high']:.4g})",
            "difference": f"{100 * item['difference']:+.1f} %",
            "agree": "yes" if item["agree"] else "no",
            "case": str(item["case"]),
        }
        for item in results.tables.get("check", pd.DataFrame()).to_dict("records")
    ]
    return pd.DataFrame(rows) if rows else None


def remarks(results: Results) -> dict[str, Any]:
    """Counts that a reader must know before using this study's results; 0 or None is no remark."""
    scenes, thresholds = results.scenes, results.joined("pile_threshold")
    outside = scenes[~valid(scenes)]
    both = outside["force_law"].isin(theory.PAIR) & (outside["regime"] == "transition")
    counts: dict[str, Any] = {
        "outside": len(outside),
        "transition": int(both.sum()),
        "unreached": int(thresholds["shields"].isna().sum()) if len(thresholds) else 0,
        "thresholds": len(thresholds),
        "far": (0, 0),
        "silent": 0,
    }
    curve = results.tables.get("pile_curve", pd.DataFrame())
    for name in ("carried_off", "fallen_upstream"):
        largest = curve.groupby("scene_id")[name].max() if len(curve) else pd.Series(dtype=int)
        counts[name] = (int((largest > 0).sum()), int(largest.max() if len(largest) else 0))
    grains = by_dem(results.joined("single_grain"))
    if len(grains):
        ratio = grains["ustar_m_s"] / grains["ustar_closed_form_m_s"]
        far = ((ratio - 1).abs() > 0.01) & held(grains)
        counts["far"] = (int(far.sum()), int((far & valid(grains)).sum()))
        counts["silent"] = int(ratio.isna().sum())
    return counts


def contents(
    results: Results, timings: pd.DataFrame, failures: Mapping[str, str]
) -> dict[str, Any]:
    """The words and numbers of the page beside its figures, by the names of its template.

    Parameters
    ----------
    results : Results
        The results of the study.
    timings : DataFrame
        Wall times of the finished cases.
    failures : mapping of str to str
        Causes by name of case.
    """
    from orchestrator.report import flows, measured  # both import what draws

    ranked = measured.fits(results)
    eq10 = flows.eq10_over_wall(results, tuple(results.flows)) if results.flows else (0.0, 0.0)
    methods = set(results.scenes["answered_method"])
    run = [pile.scene for pile in results.plan.piles.values()]
    root, names = (
        results.cases.name,
        [n for n in results.plan.cases if (results.cases / n).is_dir()],
    )
    foams = (path for name in names for path in sorted((results.cases / name).glob("*.foam")))
    foam = next(foams, None)
    return {
        "title": results.study.title,
        "study": results.study,
        "scene_count": len(results.scenes),
        "case_count": len(results.plan.cases),
        "piles": piles(results),
        "grains": grains(results),
        "single_grains": single_grains(results),
        "levels": levels(results),
        "checks": checks(results),
        "remarks": remarks(results),
        "paper_pair": bool(results.scenes["force_law"].isin(theory.PAIR).any()),
        "force_laws": force_laws(results),
        "measured_source": MEASURED_SOURCE,
        "factors_from": measured.FACTORS_FROM,
        "measured": list(measured.sentences(results.beds("grain"), ranked)) if ranked else None,
        "best_laws": measured.sheet(measured.best(ranked)),
        "every_law": measured.sheet(ranked),
        "answer": sentences(results),
        "short": sheet(results),
        "failures": failures,
        "links": {name: quote(f"{root}/{name}/") for name in names},
        "tables": list(results.tables),
        "parameters": parameters(results),
        "programs": programs(results),
        "times": times(timings),
        "wall_stress": bool(results.flows),
        "eq10_mean": eq10[0],
        "eq10_crest": eq10[1],
        "by_dem": "dem" in methods,
        "without_dem": bool(methods - {"dem"}),
        "mixed": any(scene.grain.sizes is not None for scene in run),
        "strips": any(pile.bed.width for pile in results.plan.piles.values()),
        "example_case": names[-1] if names else "NAME",
        "example_foam": f"{foam.parent.name}/{foam.name}" if foam else "",
    }
