"""The tables of a page: thresholds, force laws, parameters and fidelities."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.fidelity.fidelities import FIDELITIES, LOCAL, OWN_NUMBERS, PAIRS
from orchestrator.grains.threshold import STEP
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.verdict import (
    BOTH,
    COMPARED,
    CORRECTED,
    MODEL,
    UNUSABLE,
    USABLE,
)
from orchestrator.report import counted, labels, single
from orchestrator.report.results import (
    Results,
    measured_hills,
    seeds_as_one,
    split_by,
    valid,
)
from orchestrator.report.subjects import (
    MEAN,
    STRESS,
    TERMS,
    WIND,
    ReportedQuantity,
    has_wind,
)
from orchestrator.study import fields
from orchestrator.tables.facts import are_followed, needs_run

HEADS = {WIND: "wind at 10 m", MEAN: "mean velocity", STRESS: "bed shear stress"}
"""Quantities of flows in the heads of columns."""
TITLES = {
    WIND: "Threshold wind",
    MEAN: "Threshold mean velocity",
    STRESS: "Threshold bed shear stress",
}
"""Titles of tables of thresholds."""
PART = "fraction entrained"
FIRST_MOTION = "first motion"
VERDICT = "verdict"
WORDS: Mapping[str, str] = {
    USABLE: "usable",
    CORRECTED: "with a correction",
    COMPARED: "to compare",
    UNUSABLE: "not usable",
}
"""Verdicts in the cells of a table."""
MIXED = 2.0
"""Least ratio of sizes that are told apart."""
MOST_ROWS = 40
"""Thresholds that are listed each; of more the ranges are told."""
MOST_LISTED = 12
"""Values of a parameter that are listed each; of more the range is told."""
EACH = ("alpha_deg", "d_m", "force_law")
"""Columns that each row of a table of single piles tells."""
SERIES = ("profile", "d_m", "force_law")
"""The same where the beds are several profiles."""
MOST_WITH_FRACTIONS = 2
"""Profiles of which every fraction is listed; more have a row each, however many."""
RANGES = ("alpha_deg", "force_law")
"""Columns that each row of a table of ranges tells."""


@dataclass(frozen=True)
class Sheet:
    """A table of a page and of a terminal.

    Attributes
    ----------
    title
        Its title.
    frame
        Texts by the heads of their columns; a unit stands behind the last comma.
    shared
        What all rows agree in.
    terms
        Terms of the heads in plain words.
    file
        The file that has these rows with more columns.
    notes
        What the numbers in brackets of its last column say, from 1 on.
    main
        The head of the column that a reader should take; empty without one.
    fold
        Of a table that is folded away the line that opens it.
    is_grey
        Whether no row is usable, where the rows have no verdict of their own.
    """

    title: str
    frame: pd.DataFrame
    shared: tuple[str, ...] = ()
    terms: tuple[str, ...] = ()
    file: str = ""
    notes: tuple[str, ...] = ()
    main: str = ""
    fold: str = ""
    is_grey: bool = False


def quantity_of_rows(rows: pd.DataFrame) -> ReportedQuantity:
    """Choose what the flows of some rows are told by.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    Quantity
        Of winds their speed, of other flows with a depth the mean velocity, else the
        stress.
    """
    flows = zip(rows["rho_f_kg_m3"], rows["depth_m"].astype(float), strict=True)
    if all(has_wind(*flow) for flow in flows):
        return WIND
    if MEAN.column() in rows and rows[MEAN.column()].notna().all():
        return MEAN
    return STRESS


def short(results: Results) -> Sheet | None:
    """List the thresholds in at most a screen: of few scenes each, of many their range.

    Returns
    -------
    Sheet or None
        Of piles thresholds at every fraction if these are few, else at one; of single
        grains those of the grains. None without thresholds.
    """
    every = results.ratios(results.joined("pile_threshold"))
    if len(every):
        return _of_piles(results, every)
    grains = single_grains_sheet(results)
    if grains.empty:
        return None
    keys = [*EACH, *labels.varying(grains, *EACH), "by"]
    is_listed = _fits(grains, keys)
    return _sheet(grains, keys if is_listed else [*RANGES, "by"], "single_grain")


def _of_piles(results: Results, every: pd.DataFrame) -> Sheet:
    """The thresholds of piles at every fraction, or at one."""
    here = results.at_fraction
    is_series = here["profile"].nunique() > 1
    each = SERIES if is_series else EACH
    keys = [*each, *labels.varying(here, *each)]
    if here["profile"].nunique() > MOST_WITH_FRACTIONS:
        return _of_series(results, _in_order(here), keys)
    if not _fits(every, [*keys, "fraction"]):
        return _sheet(here, keys if _fits(here, keys) else RANGES, "pile_threshold")
    sheet = _sheet(every, [*keys, "fraction"], "pile_threshold")
    if PART not in sheet.frame:
        return sheet
    return replace(sheet, frame=_first_grains(results, every, keys, sheet.frame))


def _of_series(results: Results, rows: pd.DataFrame, keys: Sequence[str]) -> Sheet:
    """The thresholds of many profiles at one fraction, and where motion starts."""
    sheet = _sheet(rows, keys, "pile_threshold")
    if len(sheet.frame) != len(rows):  # replicates share a row
        return sheet
    told = quantity_of_rows(rows)
    first = []
    for _, row in rows.iterrows():
        value = row[f"first_{told.column()}"]
        bed = results.plan.piles[str(row["scene_id"])].bed
        spot = counted.spot(float(row["first_x_m"]), bed)
        first.append(f"{value:#.3g} {told.unit}, {spot}" if value > 0 else "—")
    frame = sheet.frame.copy()
    frame.insert(len(_heads_of(keys, frame)), FIRST_MOTION, first)
    return replace(sheet, frame=frame)


def _first_grains(
    results: Results, every: pd.DataFrame, keys: Sequence[str], frame: pd.DataFrame
) -> pd.DataFrame:
    """The table of beds, with a row for the first motion above those of each.

    The row says where it is. Replicates have none.
    """
    # as the rows of the table are
    every = _in_order(every)
    columns = _columns(every, False, False)
    fraction = results.at_fraction["fraction"].iloc[0]
    beds = every.groupby(list(keys), dropna=False, sort=False)
    parts = []
    start = 0
    for _, rows in beds:
        end = start + rows["fraction"].nunique()
        part = frame.iloc[start:end].reset_index(drop=True)
        start = end
        # the row that the card is made of: each has the first motion by its own
        row = rows[rows["fraction"] == fraction].iloc[0]
        if rows["scene_id"].nunique() == 1:
            named = {head: str(part[head].iloc[0]) for head in _heads_of(keys, part)}
            named[PART] = FIRST_MOTION
            if not single.is_level(row) and len(results.plan.piles) > 1:
                bed = results.plan.piles[str(row["scene_id"])].bed
                spot = counted.spot(float(row["first_x_m"]), bed)
                named[PART] = f"{FIRST_MOTION} {spot}"
            part = _first_grain(row, part, named, columns)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def _in_order(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows by slope and size; of a series of profiles as the study lists them."""
    first: Any = rows["alpha_deg"]
    if "profile" in rows and rows["profile"].nunique() > 1:
        first = pd.factorize(rows["profile"])[0]
    return rows.iloc[np.lexsort([rows["d_m"], first])]


def _heads_of(keys: Sequence[str], frame: pd.DataFrame) -> list[str]:
    """The heads in a table of the columns that name its beds."""
    heads = [labels.head_of(column) for column in keys]
    return [head for head in heads if head in frame]


def _first_grain(
    row: pd.Series,
    frame: pd.DataFrame,
    named: Mapping[str, str],
    columns: Mapping[str, Sequence[str]],
) -> pd.DataFrame:
    """The table of one bed, with a row for its first motion above the others.

    The row has some cells that name it, by their heads, and those of columns of the
    whole table: a wind is told as a stress beside one in water.
    """
    if not row["first_ustar0_m_s"] > 0:
        return frame
    values = {**dict.fromkeys(frame.columns, "—"), **named}
    for head, names in columns.items():
        own = [_of_first(name) for name in names]
        if head not in values or not all(name in row for name in own):
            continue
        numbers = [single.known_number(row[name]) for name in own]
        values[head] = _ranges(numbers, numbers)[0]
        if len(numbers) > 1:
            values[head] = labels.interval(numbers[0], numbers[1])
    if VERDICT in values:
        values[VERDICT] = str(frame[VERDICT].iloc[0])
    return pd.concat([pd.DataFrame([values]), frame], ignore_index=True)


def _of_first(column: str) -> str:
    """The column of the first motion beside one of a fraction."""
    if column.startswith(OTHER):
        return f"{OTHER}first_{column.removeprefix(OTHER)}"
    return f"first_{column}"


def _fits(rows: pd.DataFrame, keys: Sequence[str]) -> bool:
    """Whether a table with a row for each combination of some columns fits a screen."""
    return len(rows[list(keys)].drop_duplicates()) <= MOST_ROWS


def piles_sheet(results: Results) -> Sheet | None:
    """List the thresholds of the piles at every fraction.

    Returns
    -------
    Sheet or None
        A table that is folded away, the name of the case first; None without piles.
    """
    rows = results.joined("pile_threshold")
    if rows.empty:
        return None
    keys = [*EACH, "z0_over_d", "nu_m2_s"]
    keys += labels.varying(rows, *keys, "fraction")
    if rows["seed"].nunique() > 1:
        keys.append("seed")
    keys.append("fraction")
    frame, notes = _noted(_thresholds(rows, keys, more=("case", "count")))
    return Sheet(
        "",
        frame,
        file="tables/pile_threshold.csv",
        notes=notes,
        main=next(iter(_columns(rows, False, True))),
        fold=f"All {len(frame)} thresholds with their cases",
    )


def single_grains_sheet(results: Results) -> pd.DataFrame:
    """List single grains with their thresholds: by DEM, or else by the closed form.

    Returns
    -------
    DataFrame
        The rows of ``single_grain`` with the columns of a pile's threshold, and ``by``.
    """
    rows = results.joined("single_grain")
    if rows.empty:
        return rows
    is_run = needs_run(rows)
    re = rows["reynolds"].where(is_run, rows["reynolds_closed_form"])
    values = {
        "shields": rows["shields_dem"].where(is_run, rows["shields_closed_form"]),
        "by": is_run.map({True: "DEM", False: "closed form"}),
    }
    return pd.concat([rows.assign(reynolds=re), pd.DataFrame(values)], axis=1)


def _sheet(rows: pd.DataFrame, keys: Sequence[str], name: str) -> Sheet:
    """A table of thresholds, without the columns in which all rows agree."""
    frame = _thresholds(rows, keys)
    told_by = quantity_of_rows(rows)
    shared = []
    is_single = len(frame) == 1
    for column in keys:
        head = labels.head_of(column)
        if column == "fraction" and not is_single:
            continue
        if head in frame and frame[head].nunique() == 1:
            frame = frame.drop(columns=head)
            if column == "force_law" and are_followed(rows).all():
                continue
            if column != "fraction":  # it is told in words below
                shared += labels.told(rows.iloc[0], [column])
    frame, notes = _noted(frame)
    is_uniform = VERDICT in frame and frame[VERDICT].nunique() == 1
    if is_uniform and len(frame) > 1 and " of " not in frame[VERDICT].iloc[0]:
        shared.append(frame[VERDICT].iloc[0])
        frame = frame.drop(columns=VERDICT)
    if "fraction" in rows and PART not in frame:
        shared.append(f"{PART}: {percent(rows['fraction'].iloc[0])}")
    main = next(iter(_columns(rows, "d_m" not in keys, False)))
    return Sheet(
        TITLES[told_by],
        frame,
        tuple(shared),
        terms_of(frame, is_of_beds=name == "pile_threshold"),
        f"tables/{name}.csv",
        notes,
        main,
        is_grey=not valid(rows).any(),
    )


def terms_of(frame: pd.DataFrame, *, is_of_beds: bool) -> tuple[str, ...]:
    """Choose the terms that the heads of a table have.

    Parameters
    ----------
    frame
        The table, with heads as columns.
    is_of_beds
        Whether its Shields numbers are of the stress on the grains of a bed: that on a
        single grain is the stress of the undisturbed flow.

    Returns
    -------
    tuple of str
        What they mean: of those that are there, and of no others.
    """
    heads = " ".join(map(str, frame))
    shields = "shields_of_bed" if is_of_beds else "shields"
    signs = {"u*": "u*", shields: "θ", "re": "Re*"}
    return tuple(TERMS[name] for name, sign in signs.items() if sign in heads)


def _noted(frame: pd.DataFrame) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """A table whose reasons against thresholds are numbered, and the reasons."""
    if VERDICT not in frame:
        return frame, ()
    notes: dict[str, int] = {}
    cells = []
    for cell in frame[VERDICT]:
        word, _, why = cell.partition(": ")
        if why:
            number = notes.setdefault(why, len(notes) + 1)
            word = f"{word} ({number})"
        cells.append(word)
    return frame.assign(**{VERDICT: cells}), tuple(notes)


USTAR_HEAD = "friction velocity u*₀, m/s"
TAU_HEAD = "θ_c"
TAU_INTERVAL = "interval of θ_c"
RATIO = "ratio to the reference bed"
PAIRED = "paired interval"
OTHER = "compared_"
"""What the names of columns of numbers with another critical number begin with."""
SPANS_OF_SIZES = {
    "bed shear stress, Pa": ["pa"],
    "interval, Pa": ["pa_low", "pa_high"],
    "stress over that of d50": ["hiding"],
    "fitted (Wilcock & Crowe 2003)": ["hiding_wilcock_crowe"],
    USTAR_HEAD: ["ustar0_m_s"],
    "θ_c of its own size": ["shields_own"],
}
"""Columns of a table of sizes, by their heads."""


def _thresholds(
    rows: pd.DataFrame, keys: Sequence[str], more: Sequence[str] = ()
) -> pd.DataFrame:
    """A row for thresholds that agree in some columns, with the range of the usable.

    `more` are columns that come first.
    """
    is_range = "d_m" not in keys
    if is_range:
        # fluids are never merged
        keys = [*_different(rows, "rho_f_kg_m3", "nu_m2_s"), *keys]
        rows = rows.sort_values([*keys], kind="stable")
    else:
        rows = _in_order(rows)
    number = rows.groupby(list(keys), dropna=False, sort=False).ngroup()
    usable = rows["usable"].groupby(number)
    is_told = rows["usable"] | ~usable.transform("any")
    shown = rows[is_told].groupby(number)
    first = shown.first()
    table: dict[str, Any] = {column: first[column] for column in more}
    table |= labels.cells(first, keys)
    for name in _columns(rows, is_range, bool(more)).values():
        if len(name) > 1:
            rows = _open_ended(rows, *name)
    shown = rows[is_told].groupby(number)
    low = shown.min(numeric_only=True).astype(float)
    high = shown.max(numeric_only=True).astype(float)
    if is_range:
        low[~usable.any()] = np.nan
        d_mm = 1e3 * rows["d_m"].groupby(number).agg(["min", "max"])
        table["diameter, mm"] = _ranges(d_mm["min"], d_mm["max"], "g")
    spans = _columns(rows, is_range, bool(more))
    if not is_range and "seed" in rows and (usable.size() > 1).any():
        # replicates have the number of the card, and the interval holds all of them
        one = seeds_as_one(rows)
        one = one.set_index(number[one.index])
        lone = [names[0] for names in spans.values() if len(names) == 1]
        low[lone] = high[lone] = one[lone].astype(float)
    table |= _spans(low, high, spans)
    table[VERDICT] = [
        _verdict(*told, is_range)
        for told in zip(
            usable.sum(),
            usable.size(),
            first["verdict"],
            first["why_not"],
            strict=True,
        )
    ]
    return pd.DataFrame(table)


def _different(rows: pd.DataFrame, *columns: str) -> list[str]:
    """Those of some columns in which rows differ."""
    return [name for name in columns if rows[name].nunique() > 1]


def _columns(
    rows: pd.DataFrame, is_range: bool, with_models: bool
) -> dict[str, list[str]]:
    """The columns of a table of thresholds that have values, by their heads.

    The first is that of the numbers which the thresholds advise.
    """
    told = quantity_of_rows(rows)
    known = set(rows.columns[rows.notna().any()])
    with_what = single.with_threshold(*(row for _, row in rows.iterrows()))
    advised = MODEL
    if f"{OTHER}{told.column()}" in known:
        advised = rows["advised"].iloc[0]
    columns = _flows(told, advised, with_what)
    if f"{told.stem}_ratio" in known:
        ends = [f"{told.stem}_ratio_low", f"{told.stem}_ratio_high"]
        columns = {RATIO: [f"{told.stem}_ratio"], PAIRED: ends, **columns}
    of_model = "" if advised == MODEL else " by the model"
    columns[f"{TAU_HEAD}{of_model}"] = ["shields"]
    columns[f"{TAU_INTERVAL}{of_model}"] = ["shields_low", "shields_high"]
    if with_models and "shields_model_low" in known:
        ends = ["shields_model_low", "shields_model_high"]
        columns["interval of other models"] = ends
    kept = {}
    for head, names in columns.items():
        is_known = bool(known & set(names)) or head == next(iter(columns))
        if is_known and not (is_range and len(names) > 1 and "θ_c" not in head):
            kept[head] = names
    return kept


def _flows(
    told: ReportedQuantity, advised: str, with_what: str
) -> dict[str, list[str]]:
    """The columns of the flows of thresholds: the advised ones, and the others."""
    name, unit = HEADS[told], told.unit
    own = [told.column()]
    band = [told.column(end) for end in ("_low", "_high")]
    other = [f"{OTHER}{told.column()}"]
    other_band = [f"{OTHER}{each}" for each in band]
    if advised == MODEL:
        return {
            f"{name}, {unit}": own,
            f"interval, {unit}": band,
            f"{with_what}, {unit}": other,
            USTAR_HEAD: ["ustar0_m_s"],
        }
    model = single.MODEL_ALONE
    of_both = {}
    if advised == BOTH:
        model = single.MODEL
        of_both = {f"interval {model}, {unit}": band}
    return {
        f"{name} {with_what}, {unit}": other,
        f"interval, {unit}": other_band,
        f"{model}, {unit}": own,
        **of_both,
        f"{USTAR_HEAD.partition(',')[0]} {with_what}, m/s": [f"{OTHER}ustar0_m_s"],
    }


def _verdict(count: int, of: int, word: str, why_not: str, is_range: bool) -> str:
    """How many of the thresholds of a row are usable, or what one is worth."""
    if is_range:
        return f"{count} of {of} usable"
    if not count:
        return f"{WORDS[UNUSABLE]}: {why_not}"
    return f"{count} of {of} seeds usable" if of > 1 else WORDS[word]


def hills(results: Results) -> Sheet:
    """List where the flow runs back behind hills that others measured.

    Returns
    -------
    Sheet
        A row for each hill and turbulence model.
    """
    table = []
    for aspect, rows in measured_hills(results):
        for _, row in rows.iterrows():
            starts = row["separation_over_h"]
            ends = row["reattachment_over_h"]
            measured = row["measured_reattachment_over_h"]
            cells = {
                "half-length, h": f"{aspect:g}",
                "turbulence model": labels.value(
                    "turbulence_model", row["turbulence_model"]
                ),
                "separation, h": _or_nowhere(starts),
                "reattachment, h": _or_nowhere(ends),
                "measured reattachment, h": _or_nowhere(measured),
            }
            table.append(cells)
    shared = ("distances from the crest, in heights of the hill",)
    title = "Separation and reattachment behind each hill"
    return Sheet(title, pd.DataFrame(table), shared, (), "tables/flow.csv")


def _or_nowhere(distance: float) -> str:
    """A distance, or that there is none."""
    return f"{distance:.1f}" if distance > 0 else "none"


def sizes_sheet(results: Results) -> Sheet | None:
    """List the thresholds of the sizes of mixtures at one fraction.

    Returns
    -------
    Sheet or None
        A row for each size, all seeds together. None where sizes hardly differ.
    """
    rows = results.joined("size_class")
    if rows.empty or rows["size_over_d"].max() < MIXED * rows["size_over_d"].min():
        return None
    fraction = results.at_fraction["fraction"].iloc[0]
    rows = rows[rows["fraction"] == fraction]
    keys = labels.varying(rows, "fraction")
    number = np.rint(np.log(rows["size_over_d"]) / np.log(STEP))
    rows = _with_stresses(rows)
    rows = _open_ended(rows, "shields_own_low", "shields_own_high")
    rows = _open_ended(rows, "pa_low", "pa_high")
    by = [*(rows[key] for key in keys), number]
    groups = rows.groupby(by, dropna=False, sort=False)
    low = groups.min(numeric_only=True)
    high = groups.max(numeric_only=True)
    told = pd.DataFrame(labels.cells(groups.first()[[]].reset_index(), keys))
    # a bed is named once
    is_repeated = told.eq(told.shift()).all(axis=1)
    grains = []
    counts = _ranges(low["count"], high["count"], "g")
    for count, is_few in zip(counts, groups["few"].any(), strict=True):
        grains.append(f"{count}: under ten" if is_few else count)
    frame = pd.DataFrame(
        {
            **told.mask(is_repeated, ""),
            "size, mm": [f"{size:.3g}" for size in groups["size"].mean()],
            **_spans(low, high, SPANS_OF_SIZES),
            "fraction entrained, %": _intervals(
                100 * low["class_moved_low"], 100 * high["class_moved_high"], 0, "f"
            ),
            "exposed grains of a bed": grains,
        }
    )
    return Sheet(
        title="By size",
        frame=frame,
        shared=(f"fraction of each size entrained: {percent(fraction)}",),
        terms=terms_of(frame, is_of_beds=True),
        file="tables/size_class.csv",
        main="bed shear stress, Pa",
        is_grey=not valid(rows).any(),
    )


def _with_stresses(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of sizes with their diameters, mm, and stresses, Pa and over that of d50."""
    size = rows["size_over_d"]
    weight = Grain.of_table(rows).layer_weight * size
    stresses = {"size": 1e3 * size * rows["d_m"]}
    for column in ("hiding", "hiding_wilcock_crowe"):
        stresses[column] = rows[column] * size
    for end in ("", "_low", "_high"):
        stresses[f"pa{end}"] = weight * rows[f"shields_own{end}"]
    return rows.assign(**stresses)


def _open_ended(rows: pd.DataFrame, low: str, high: str) -> pd.DataFrame:
    """Rows in which an end that only the other column of an interval has is infinite.

    The least and the largest end of several intervals, of which one is open, are then
    open as well.
    """
    has_no_low = rows[low].isna()
    has_no_high = rows[high].isna()
    ends = {
        low: rows[low].mask(has_no_low & ~has_no_high, -np.inf),
        high: rows[high].mask(has_no_high & ~has_no_low, np.inf),
    }
    return rows.assign(**ends)


def _spans(
    low: pd.DataFrame, high: pd.DataFrame, spans: Mapping[str, Sequence[str]]
) -> dict[str, list[str]]:
    """Columns of ranges by their heads: of one from its least to its largest value.

    Of the two columns of an interval from the least of the first to the largest of the
    second.
    """
    columns = {}
    for head, names in spans.items():
        if len(names) == 1:
            columns[head] = _ranges(low[names[0]], high[names[0]])
            continue
        columns[head] = _intervals(low[names[0]], high[names[1]])
    return columns


def _intervals(
    low: Iterable[float], high: Iterable[float], digits: int = 3, form: str = "#g"
) -> list[str]:
    """The interval between each two values as a text, open where one is not known."""
    ends = zip(low, high, strict=True)
    return [labels.interval(least, most, digits, form) for least, most in ends]


def _ranges(
    low: Iterable[float], high: Iterable[float], form: str = "#.3g"
) -> list[str]:
    """The range between each two values as a text, one number where they are alike."""
    texts = []
    for least, most in zip(low, high, strict=True):
        ends = [format(float(least), form), format(float(most), form)]
        texts.append("—" if "nan" in ends else " … ".join(dict.fromkeys(ends)))
    return texts


def force_laws(results: Results) -> pd.DataFrame:
    """List the force laws of the scenes.

    Returns
    -------
    DataFrame
        Where each law holds, and where it was taken from.
    """
    used = set(results.scenes["force_law"])
    rows = []
    for name, law in LAWS.items():
        if name not in used:
            continue
        low, high = law.reynolds
        holds = f"{low:g} ≤ Re* < {high:g}".replace("inf", "∞")
        if np.isfinite(law.drag_end):
            holds += f", V d/ν < {law.drag_end:g} (drag: {law.drag_law})"
        rows.append((law.label, holds, law.reference))
    return pd.DataFrame(rows, columns=["force law", "holds for", "source"])


def parameters(results: Results) -> pd.DataFrame:
    """List the values that each parameter of the scenes takes.

    Returns
    -------
    DataFrame
        What is asked for, and what answers it if that is something else.
    """
    rows = []
    for column, item in fields.COLUMNS.items():
        answered = _values(results.scenes[column])
        asked = answered
        if item.is_method:
            written = [item.asked(scene) for scene in results.study.scenes]
            asked = _values(pd.Series(written, dtype=object))
        if not asked and not answered:
            continue
        name = item.info.label
        symbol = item.info.symbol.replace("_0", "₀")
        if symbol:
            name = f"{name}, {symbol}" if name else symbol
        other = "" if answered == asked else answered
        field = item.name or column
        rows.append((name, item.info.unit, field, asked or "default", other))
    head = ("parameter", "unit", "in a study file", "asked for")
    return pd.DataFrame(rows, columns=[*head, "answered with, if otherwise"])


def _values(column: pd.Series) -> str:
    """The different values of a column, of many the ends."""
    values = column.dropna().unique()
    # numbers before texts
    ordered = sorted(values, key=lambda value: (isinstance(value, str), value))
    texts: list[str] = []
    for value in ordered:
        text = value if isinstance(value, str) else f"{value:.6g}"
        if text not in texts:
            texts.append(text)
    if len(texts) > MOST_LISTED:
        texts = [*texts[:2], "…", texts[-1]]
    return ", ".join(texts)


def fidelities(results: Results) -> pd.DataFrame | None:
    """List the fidelities that answered the piles.

    Returns
    -------
    DataFrame or None
        Why each was chosen, and what is known of it; None without piles.
    """
    meanings = {
        one.name: one.meaning for one in (*FIDELITIES, *PAIRS, LOCAL, OWN_NUMBERS)
    }
    for decision in results.plan.decisions.values():
        if decision.fidelity is not None:
            meanings[decision.fidelity.name] = decision.fidelity.meaning
    table = results.joined("pile_threshold")
    rows = []
    for (name, why), group in split_by(table, "fidelity", "why"):
        error = 100 * group["error_estimate"].max()
        beds = group["scene_id"].nunique()
        rows.append((name, meanings[str(name)], why, beds, error))
    if not rows:
        return None
    head = ("fidelity", "description", "reason", "beds")
    return pd.DataFrame(rows, columns=[*head, "numerical error of θ_c, at most, %"])
