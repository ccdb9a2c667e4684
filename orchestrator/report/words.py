"""The answer of a study in sentences and tables, and all other words of its page."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.fidelity import levels as fidelity
from orchestrator.fidelity.limits import FROZEN_BED
from orchestrator.grains.threshold import STEP
from orchestrator.physics.beside import sentences
from orchestrator.physics.fluids import PAPER
from orchestrator.physics.laws import LAWS
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.report import labels, theory
from orchestrator.report.page import Guest, caption, versions
from orchestrator.report.results import Results, measured_hills, split, valid
from orchestrator.runs import case
from orchestrator.study import fields
from orchestrator.study.parts import PileBed
from orchestrator.tables.usable import ROW_HOLD

SPEEDS = {
    "wind_1m_m_s": "wind at 1 m",
    "wind_10m_m_s": "wind at 10 m",
    "mean_velocity_m_s": "mean velocity",
}
"""Speeds of a flow that are measured in the field, by their columns."""
MIXED = 2.0  # least ratio of sizes that are told apart
FEW = 12  # piles, or values of a parameter, that are listed each; of more the range is told
EACH, RANGES = ("alpha_deg", "d_m", "force_law"), ("alpha_deg", "force_law")
"""Columns that each row of a table tells, of single piles and of ranges."""


class Answer(NamedTuple):
    """What a page and a terminal say first."""

    sentences: list[str]
    table: pd.DataFrame | None


def text(results: Results, guests: Sequence[Guest] = ()) -> str:
    """What guests say, the answer, its table and its doubts, for a terminal.

    An `OrchestratorError` if the tables lack columns, as those of another version do.
    """
    try:
        (said, table), warned = answer(results), doubts(results)
    except KeyError as error:
        what = f"its tables lack {error}: another version of this program wrote them"
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(
            what, where=str(results.cases.parent), remedy=remedy
        ) from None
    lines = [*(guest.said for guest in guests), *said] or [
        "No case has given a result yet."
    ]
    if table is not None:
        rows = [[str(name) for name in table], *table.to_numpy(str).tolist()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines += [
            "",
            *("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows),
        ]
    return "\n".join([*lines, *[""] * bool(warned), *warned])


@lru_cache(maxsize=1)
def answer(results: Results) -> Answer:
    """What a study asks: which of many laws is nearest to measurements, or at which flow what goes.

    Of piles these are the sizes of mixtures, or where motion starts and when a fraction has moved.
    """
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        return Answer(theory.nearest(results), theory.sheet(best))
    table = short(results) if (mixed := sizes(results)) is None else mixed
    return Answer(
        _grains(results) if results.at_fraction.empty else _piles(results), table
    )


def _piles(results: Results) -> list[str]:
    """Hills that others measured, the pile of the first picture, then one in each other fluid."""
    hills, rows = list(_hills(results)), results.exemplars
    if hills and not results.joined("pile_threshold")["usable"].any():
        return hills
    telling = labels.varying(
        results.joined("pile_threshold"), "alpha_deg", "d_m", "fraction"
    )
    firsts = rows.drop_duplicates("rho_f_kg_m3")
    return [*hills, *(_pile(row, results, telling[:3]) for _, row in firsts.iterrows())]


def _pile(row: pd.Series, results: Results, telling: Sequence[str]) -> str:
    """Where and at which flow the first grain of a pile moves, and when a fraction of it has."""
    pile = results.plan.piles[str(row["scene_id"])]
    line = pile.model.line
    x, z = line.crest
    told = labels.told(row, ["alpha_deg", "d_m", *telling])
    facts = {"name": ", ".join(told if z > 0 else ["Level bed", *told[1:]])}
    if (
        row["first_ustar0_m_s"] > 0 and z > 0
    ):  # a level bed has no place that goes first
        facts |= {
            "x": labels.amount(row["first_x_m"], "m"),
            "crest": labels.amount(float(x), "m"),
        }
        facts["top"] = "obstacle" if any(a <= x <= b for a, b in line.bare) else "bed"
        facts |= {"first": flow_at(row, row["first_ustar0_m_s"])}
    flow = flow_at(row, row["ustar0_m_s"])
    facts["counted"] = _counted(pile.bed)
    facts["held"] = row["row_hold"] > ROW_HOLD
    said = [caption("pile", row=row, flow=flow, **facts)]
    if pile.bed.profile and row.get("smoothing_needed_m", np.nan) > 0:
        said.append(caption("smoothing", row=row, name=pile.bed.profile.name))
    return " ".join([*said, _measured(row)])


def _counted(bed: PileBed) -> str:
    """Which part of a bed is counted, where that is not plain from its shape; else empty."""
    counts = bed.counts
    if not isinstance(counts, str):
        return f"between x = {counts[0]:g} and {counts[1]:g} m"
    if bed.profile or bed.counted:
        return {"windward": "of windward sides", "all": "of the whole bed"}[counts]
    return ""


def _grains(results: Results) -> list[str]:
    """The finest and the coarsest grain of the least slope."""
    if (grains := _single(results)).empty:
        return []
    here = grains[grains["alpha_deg"] == grains["alpha_deg"].min()]
    here = (here[valid(here)] if valid(here).any() else here).sort_values(
        "d_m", kind="stable"
    )
    rows = [here.iloc[at] for at in sorted({0, len(here) - 1})]
    said = []
    for row in rows:
        size, slope = (
            labels.value(column, row[column]) for column in ("d_m", "alpha_deg")
        )
        facts = {
            "row": row,
            "size": size,
            "slope": slope,
            "flow": flow_at(row, row["ustar0_m_s"]),
        }
        said.append(f"{caption('one_grain', **facts)} {_measured(row)}")
    return said


def _measured(row: pd.Series) -> str:
    """What was measured beside a threshold."""
    measured, tested = sentences(row.to_dict())
    said = [measured, tested] if row["tested_rows"] > 0 else [measured]
    return " ".join(f"{_capital(one)}." for one in said)


def _capital(text: str) -> str:
    """A sentence with a capital at its beginning; a symbol such as θ stays as it is."""
    return f"{text[0].upper()}{text[1:]}" if text[0].isascii() else text


def flow_at(row: pd.Series, ustar: float) -> str:
    """A friction velocity with speeds that are measured: of the wind, or of a channel."""
    depth = float(row["depth_m"] or np.nan)
    speeds = measurable_speeds(
        ustar,
        roughness=row["z0_m"],
        density=row["rho_f_kg_m3"],
        viscosity=row["nu_m2_s"],
        depth=depth,
        closed=row["flow_top"] == "closed channel",
    )
    told = [
        f"{label} {speeds[c]:#.3g} m/s" for c, label in SPEEDS.items() if speeds[c] > 0
    ]
    told += [f"depth {depth:g} m"] * (depth > 0)
    return f"u*₀ = {ustar:#.3g} m/s" + f" ({', '.join(told)})" * bool(told)


def _hills(results: Results) -> Iterator[str]:
    """Where reversed flow ends behind each hill that others measured, by model and as measured."""
    for hill, rows in measured_hills(results):
        names = labels.cells(rows, ["turbulence_model"]).popitem()[1]
        ends = dict(zip(names, rows["reattachment_over_h"], strict=True))
        measured = rows["measured_reattachment_over_h"].iloc[0]
        facts = {"measured": measured, "verified": rows["measured_verified"].all()}
        yield caption("hill", hill=hill, ends=ends, **facts)


@lru_cache(maxsize=1)
def doubts(results: Results) -> list[str]:
    """What a reader must know of the thresholds: which are usable, what their intervals lack."""
    piles = results.joined("pile_threshold")
    table = piles if len(piles) else _single(results)
    count, usable = len(table), table["usable"].sum() if len(table) else 0
    said = [f"Usable: {usable} of {count} thresholds."] if usable < count else []
    for question in results.study.questions:
        said.append(question if question.endswith("?") else f"{question}.")
    if PAPER in zip(
        results.scenes["rho_f_kg_m3"], results.scenes["nu_m2_s"], strict=True
    ):
        said.append(
            "The fluid is the paper's, 1 kg/m³, 1e-5 m²/s; real air: fluid.kind = 'air'."
        )
    if piles.empty:
        return said
    beyond = piles[piles["frozen_bed"] > FROZEN_BED]
    if len(beyond):
        said.append(caption("frozen", beyond=beyond, count=count, limit=FROZEN_BED))
    chosen = [each for each in results.plan.decisions.values() if each.is_chosen]
    if chosen and results.study.tolerance is None:
        names = ", ".join(
            dict.fromkeys(item.levels.text for item in chosen if item.levels)
        )
        error, floor = (
            max(item.known.total for item in chosen),
            min(fidelity.floors().values()),
        )
        said.append(caption("defaults", names=names, error=error, floor=floor))
    if "check" in results.tables:
        said.append(caption("checked", checks=results.tables["check"]))
    rows, tolerance = (
        piles.dropna(subset=["shields", "shields_model_low"]),
        results.study.tolerance,
    )
    if tolerance and len(rows):
        low = 1 - rows["shields_model_low"] / rows["shields"]
        high = rows["shields_model_high"] / rows["shields"] - 1
        if tolerance < float(((low + high) / 2).min()):
            facts = {
                "ends": (low.max(), high.max()),
                "share": rows["model_share"].mode().iloc[0],
            }
            said.append(caption("tolerance", tolerance=tolerance, **facts))
    return said


def short(results: Results) -> pd.DataFrame | None:
    """The thresholds in at most a screen: of few scenes each, of many their range by slope.

    Of piles they are at every fraction if these are few, else at one.
    """
    every, tau = results.joined("pile_threshold"), "τ_c"
    here, by = (_single(results), ["by"]) if every.empty else (results.at_fraction, [])
    if here.empty:
        return None
    at = tau if by else f"{tau} at n/N = {here['fraction'].iloc[0]:.0%}"
    keys = [*EACH, *labels.varying(here, *EACH), *by]
    choices = [(here, keys, at), (here, [*RANGES, *by], at)]
    choices = choices if by else [(every, [*keys, "fraction"], tau), *choices]
    fit = (
        each for each in choices if len(each[0][[*each[1]]].drop_duplicates()) <= FEW
    )
    return _thresholds(*next(fit, choices[-1]))


def sizes(results: Results) -> pd.DataFrame | None:
    """The thresholds of the sizes of mixtures at one fraction, those of all seeds in a row."""
    rows = results.joined("size_class")
    if rows.empty or rows["size_over_d"].max() < MIXED * rows["size_over_d"].min():
        return None
    fraction = results.at_fraction["fraction"].iloc[0]
    rows = rows[rows["fraction"] == fraction]
    keys, size = labels.varying(rows, "fraction"), rows["size_over_d"]
    number = np.rint(np.log(size) / np.log(STEP))
    stress = rows[["hiding", "hiding_wilcock_crowe"]].mul(size, axis=0)
    rows = rows.assign(size=1e3 * size * rows["d_m"], **stress)
    rows = _open_ended(rows, "shields_own_low", "shields_own_high")
    groups = rows.groupby(
        [*(rows[key] for key in keys), number], dropna=False, sort=False
    )
    low, high = groups.min(numeric_only=True), groups.max(numeric_only=True)
    spans = {
        f"u*₀ at n/N = {fraction:.0%}, m/s": ["ustar0_m_s"],
        "stress over that of d50": ["hiding"],
        "measured (Wilcock & Crowe 2003)": ["hiding_wilcock_crowe"],
        "θ of its own size": ["shields_own"],
        "interval of θ": ["shields_own_low", "shields_own_high"],
    }
    told = pd.DataFrame(labels.cells(groups.first()[[]].reset_index(), keys))
    moved = [
        labels.interval(100 * least, 100 * most, ".0f")
        for least, most in zip(
            low["class_moved_low"], high["class_moved_high"], strict=True
        )
    ]
    table = {
        **told.mask(told.eq(told.shift()).all(axis=1), ""),  # a bed is named once
        "size, mm": [f"{size:.3g}" for size in groups["size"].mean()],
        **_spans(low, high, spans),
        "part that had moved, %": moved,
    }
    counts = zip(
        _ranges(low["count"], high["count"], "g"), groups["few"].any(), strict=True
    )
    grains = [f"{n}: under ten" if few else n for n, few in counts]
    return pd.DataFrame({**table, "exposed grains of a bed": grains})


def _open_ended(rows: pd.DataFrame, low: str, high: str) -> pd.DataFrame:
    """Rows in which an end that only the other column of an interval has is infinite.

    The least and the largest end of several intervals, of which one is open, are then open as well.
    """
    is_open = rows[low].isna() != rows[high].isna()
    ends = {low: rows[low].mask(is_open & rows[low].isna(), -np.inf)}
    ends[high] = rows[high].mask(is_open & rows[high].isna(), np.inf)
    return rows.assign(**ends)


def piles(results: Results) -> pd.DataFrame | None:
    """The thresholds of the piles at every fraction, with the name of the case first."""
    rows = results.joined("pile_threshold")
    if rows.empty:
        return None
    keys, seeds = (
        [*EACH, "z0_over_d", "nu_m2_s"],
        ["seed"] * (rows["seed"].nunique() > 1),
    )
    keys += [*labels.varying(rows, *keys, "fraction"), *seeds, "fraction"]
    return _thresholds(rows, keys, more=("case", "count"))


def _single(results: Results) -> pd.DataFrame:
    """Single grains with their thresholds: by DEM, or else by the closed form."""
    rows = results.joined("single_grain")
    if rows.empty:
        return rows
    dem, ends = rows["answered_method"] == "dem", ("", "_low", "_high")
    exact = rows["shields_closed_form"]
    values = {
        f"shields{end}": rows[f"shields_dem{end}"].where(dem, exact) for end in ends
    }
    ustar = rows["ustar_m_s"].where(dem, rows["ustar_closed_form_m_s"])
    rows = rows.assign(
        reynolds=rows["reynolds"].where(dem, rows["reynolds_closed_form"])
    )
    values |= {"ustar0_m_s": ustar, "by": dem.map({True: "DEM", False: "closed form"})}
    return pd.concat([rows, pd.DataFrame(values)], axis=1)


def _thresholds(
    rows: pd.DataFrame, keys: Sequence[str], tau: str = "τ_c", more: Sequence[str] = ()
) -> pd.DataFrame:
    """A row for all thresholds that agree in some columns, with the range of the usable ones."""
    ranges = "d_m" not in keys
    if ranges:  # fluids are never merged
        keys = [
            *(name for name in ("rho_f_kg_m3", "nu_m2_s") if rows[name].nunique() > 1),
            *keys,
        ]
    rows = rows.sort_values(keys if ranges else ["alpha_deg", "d_m"], kind="stable")
    rows = _open_ended(rows, "shields_low", "shields_high")
    number = rows.groupby(list(keys), dropna=False, sort=False).ngroup()
    usable, d = (rows[name].groupby(number) for name in ("usable", "d_m"))
    shown = rows[rows["usable"] | ~usable.transform("any")].groupby(number)
    low, high = (end(numeric_only=True).astype(float) for end in (shown.min, shown.max))
    first = shown.first()
    table: dict[str, Any] = {**first[[*more]], **labels.cells(first, keys)}
    if ranges:
        low[~usable.any()] = np.nan
        table["diameter, mm"] = _ranges(1e3 * d.min(), 1e3 * d.max(), "g")
    known = set() if more else set(rows.columns[rows.notna().any()])
    spans = {f"{text}, m/s": [name] for name, text in SPEEDS.items() if name in known}
    spans = {"u*₀, m/s": ["ustar0_m_s"], **spans, tau: ["shields"]}
    spans |= {"interval": ["shields_low", "shields_high"]}
    if "shields_model_low" in known and not ranges:
        share = ", ".join(first["model_share"].dropna().unique())
        spans |= {
            f"model's interval, most by {share}": [
                "shields_model_low",
                "shields_model_high",
            ]
        }
    if "measured_low" in known:
        spans |= {"measured": ["measured_low", "measured_high"]}
    table |= _spans(low, high, spans)
    table["usable"] = [
        f"{n} of {of}{' seeds' * (not ranges)}"
        if ranges or of > 1
        else "yes"
        if n
        else f"no: {why}"
        for n, of, why in zip(
            usable.sum(), usable.size(), first["why_not"], strict=True
        )
    ]
    return pd.DataFrame(table)


def _spans(
    low: pd.DataFrame, high: pd.DataFrame, spans: Mapping[str, Sequence[str]]
) -> dict[str, list[str]]:
    """Columns of ranges by their heads: of one column from its least to its largest value.

    Of the two columns of an interval from the least of the first to the largest of the second.
    """
    columns = {}
    for head, names in spans.items():
        if len(names) == 1:
            columns[head] = _ranges(low[names[0]], high[names[0]])
            continue
        ends = zip(low[names[0]], high[names[1]], strict=True)
        columns[head] = [labels.interval(least, most) for least, most in ends]
    return columns


def _ranges(low: pd.Series, high: pd.Series, form: str = "#.3g") -> list[str]:
    """The range between each two values as a text, one number where they are written alike."""
    pairs = (
        [format(float(end), form) for end in pair]
        for pair in zip(low, high, strict=True)
    )
    return ["—" if "nan" in pair else " … ".join(dict.fromkeys(pair)) for pair in pairs]


def force_laws(results: Results) -> pd.DataFrame:
    """The force laws of the scenes: where each holds, and where it was taken from."""
    rows = []
    for law in (
        LAWS[name] for name in LAWS if (results.scenes["force_law"] == name).any()
    ):
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
            rows.append(
                (name, item.info.unit, item.name or column, asked or "default", other)
            )
    head = [
        "parameter",
        "unit",
        "in a study file",
        "asked for",
        "answered with, if otherwise",
    ]
    return pd.DataFrame(rows, columns=head)


def _values(column: pd.Series) -> str:
    """The different values of a column, of many the ends."""
    values = sorted(
        column.dropna().unique(), key=lambda value: (isinstance(value, str), value)
    )
    texts = list(dict.fromkeys(v if isinstance(v, str) else f"{v:.6g}" for v in values))
    return ", ".join(texts if len(texts) <= FEW else [*texts[:2], "…", texts[-1]])


def levels(results: Results) -> pd.DataFrame | None:
    """On which fidelity levels the piles were answered, why, and what is known of them."""
    rows, table = [], results.joined("pile_threshold")
    about = {
        each.name: each.meaning for part in fidelity.LEVELS.values() for each in part
    }
    for (flow, grain, why), group in split(table, "flow_level", "grain_level", "why"):
        meaning = "; ".join(
            about[name] for name in (str(flow), str(grain)) if name in about
        )
        error = group["error_estimate"].max()
        rows.append(
            (
                f"{flow} | {grain}",
                meaning,
                why,
                group["scene_id"].nunique(),
                100 * error,
            )
        )
    head = [
        "flow | grains",
        "description",
        "reason",
        "beds",
        "known error of τ_c, at most, %",
    ]
    return pd.DataFrame(rows, columns=head) if rows else None


def remarks(results: Results) -> dict[str, Any]:
    """Counts that a reader must know before using this study's results; 0 is no remark."""
    scenes, thresholds = results.scenes, results.joined("pile_threshold")
    outside = scenes[~valid(scenes)]
    both = outside["force_law"].isin(theory.PAIR) & (outside["regime"] == "transition")
    names = ["scene_id", "carried_off", "fallen_upstream"]
    curve = results.tables.get("pile_curve", pd.DataFrame()).reindex(columns=names)
    lost = curve.groupby("scene_id").max()
    return {
        **{
            "outside": len(outside),
            "transition": both.sum(),
            "thresholds": len(thresholds),
        },
        "unreached": thresholds["shields"].isna().sum() if len(thresholds) else 0,
        **{name: ((lost[name] > 0).sum(), lost[name].max()) for name in names[1:]},
    }


def contents(results: Results, failures: Mapping[str, str]) -> dict[str, Any]:
    """The words and numbers of the page beside its figures, by the names of its template."""
    from orchestrator.report import flows  # imports what draws

    sheets = (answer, doubts, short, piles, levels, remarks, force_laws, parameters)
    root, cases = results.cases, results.plan.cases
    scenes = [pile.scene for pile in results.plan.piles.values()]
    return {
        **{sheet.__name__: sheet(results) for sheet in sheets},
        "results": results,
        "title": results.study.title,
        "measured": theory.section(results),
        "programs": versions(case.programs(root, cases)),
        "failures": failures,
        "links": {n: quote(f"{root.name}/{n}/") for n in cases if (root / n).is_dir()},
        "paper_pair": results.scenes["force_law"].isin(theory.PAIR).any(),
        "eq10": flows.eq10_over_wall(results, tuple(results.flows))
        if results.flows
        else None,
        "methods": set(results.scenes["answered_method"]),
        "mixed": any(scene.grain.sizes is not None for scene in scenes),
        "strips": "answered_width" in results.scenes
        and results.scenes["answered_width"].any(),
    }
