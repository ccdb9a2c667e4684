"""The answer card of a study: its question, its numbers and what they are worth."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd

from orchestrator.digits import enumerated, percent
from orchestrator.digits import number as number_of
from orchestrator.fidelity import crest
from orchestrator.grains.pile import Pile
from orchestrator.physics.constants import GRAIN_COLUMNS
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE, wilcock_crowe_hiding
from orchestrator.physics.verdict import UNUSABLE, USABLE, WITH_MEASURED
from orchestrator.report import counted, labels, sheets, single, theory
from orchestrator.report.card import MOST_NUMBERS, Card, Mark, Number, Worth
from orchestrator.report.results import (
    Results,
    measured_hills,
    valid,
)
from orchestrator.report.subjects import (
    STRESS,
    TERMS,
    USTAR,
    ReportedQuantity,
    digits_of_place,
    fluid,
    kind_of_grain,
    length,
    place_of_file,
    solid,
)
from orchestrator.study import fields
from orchestrator.study.profile import WITH_X
from orchestrator.study.shapes import SHAPES
from orchestrator.tables.facts import packs_grains
from orchestrator.tables.paired import SHELTER
from orchestrator.tables.quoted import is_flat, of_rows

NONE = Card(
    "When do these grains start to move?",
    "",
    (),
    "",
    Worth("bad", "no answer yet", "No case has given a result."),
)
"""The card of a study without results."""
NUMBERS = "the numerical error of the method, load steps and count"
"""What the numerical interval of a fraction of a bed is of."""
FIRST = "the numerical error of the method and the load step"
"""What that of the first motion is of."""
MIXTURE = ("sizes",)
"""Columns of what a bed is made of, whose beds are never put into one range."""
FLUIDS = ("rho_f_kg_m3", "nu_m2_s")
"""The same of the fluid."""


@lru_cache(maxsize=1)
def card(results: Results) -> Card:
    """Make the answer card of a study.

    Returns
    -------
    Card
        Of many force laws which is nearest to measurements, of hills that others
        measured where reversed flow ends, of several beds or grains the least and the
        largest flow, of one its own numbers.
    """
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        return _of_laws(results, best)
    if is_of_hills(results):
        return _of_hills([*measured_hills(results)])
    if len(results.joined("pile_threshold")):
        return _of_beds(results)
    grains = sheets.single_grains_sheet(results)
    return _of_grains(grains) if len(grains) else NONE


# one bed, and several


def _of_beds(results: Results) -> Card:
    """The card of one bed, or of several."""
    rows = results.exemplars
    if rows.empty:
        rows = results.at_fraction.assign(seeds=1, of_seeds=1)
    if are_several_beds(results.at_fraction):
        return _of_several(rows, results)
    row = rows.iloc[0]
    if sheets.sizes_sheet(results) is not None:
        return _of_mixture(row, results)
    return _of_bed(row, results)


def are_several_beds(rows: pd.DataFrame) -> bool:
    """Whether thresholds are of beds that differ in more than the share that moves.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    bool
        Whether they are.
    """
    return bool(labels.varying(rows, "fraction"))


def is_one_grain(grains: pd.DataFrame) -> bool:
    """Whether thresholds of single grains are those of one grain.

    Parameters
    ----------
    grains
        Thresholds with the columns of their scenes.

    Returns
    -------
    bool
        Whether they are.
    """
    questions = [*GRAIN_COLUMNS.values(), "force_law", "depth_m"]
    return len(grains[questions].drop_duplicates()) == 1


def _of_bed(row: pd.Series, results: Results) -> Card:
    """The card of one bed: the flow of a fraction, of the first motion, its place."""
    pile = results.plan.piles[str(row["scene_id"])]
    told = single.quantity_of_row(row)
    return Card(
        _question(row, pile, told),
        _scene(row, pile, results),
        tuple(_numbers_of_bed(row, pile, results, told)),
        single.source(row),
        _worth(row),
    )


def _worth(row: pd.Series, few: bool = False) -> Worth:
    """What the answer of one bed is worth, seeds as one."""
    worth = single.worth(row, few)
    if worth.mark == "bad" or row["seeds"] == row["of_seeds"]:
        return worth
    word = f"usable, with gaps: {row['seeds']} of {row['of_seeds']} beds"
    advice = "The beds are replicates; the table has the reason against the others."
    return Worth("care", word, advice)


def _question(row: pd.Series, pile: Pile, told: ReportedQuantity) -> str:
    """The question of one bed."""
    bed = pile.bed
    name = kind_of_grain(float(row["d_m"]))
    if bed.profile:
        return (
            f"At what {told.flow} does the {name} of {bed.profile.name} start to move, "
            "and where?"
        )
    grains = f"{length(float(row['d_m']))} {name}"
    where = "" if single.is_level(row) else ", and where"
    shape = f"this {bed.form.word}"
    if bed.forms > 1:
        shape = f"this train of {bed.forms} {bed.form.words}"
    return f"At what {told.flow} does {shape} of {grains} start to move{where}?"


def _scene(row: pd.Series, pile: Pile, results: Results) -> str:
    """One line on shape, size, grains, what of it is counted, and fluid."""
    bed = pile.bed
    line = pile.model.line
    first = float(line.x[1])
    last = float(line.x[-2])
    grains = _grains(row)
    size = f"{length(last - first)} long"
    if single.is_level(row):
        shape = f"level bed, {size}"
    elif bed.profile:
        shape = f"{bed.profile.name}, {size}, {length(float(line.h))} high"
    else:
        slope = f"windward face {bed.slope_deg:g}°"
        shape = f"{bed.form.word} {length(bed.height)} high, {slope}"
    count = f"{row['count']:.0f} exposed grains"
    if not packs_grains(row):
        asked = results.plan.decisions[str(row["scene_id"])].asked
        count = "no grains are packed, as the study asks"
        if asked.method.is_open:
            count = "too many grains to follow each"
    if bed.profile or bed.counted:
        grains_ = results.tables["pile_grain"]
        of_bed = grains_["scene_id"] == row["scene_id"]
        count += (
            f"; counted: {counted.metres_of_place(grains_.loc[of_bed, 'x_m'], bed)}"
        )
    obstacles = pile.scene.obstacles
    if obstacles:
        shape += f", behind {', '.join(map(str, obstacles))}"
    if pile.scene.flow.towards != WITH_X:
        shape += (
            f", {single.quantity_of_row(row).flow} towards {pile.scene.flow.towards}"
        )
    within = fluid(float(row["rho_f_kg_m3"]), float(row["nu_m2_s"]))
    if not bed.profile:
        shape = f"{shape[:1].upper()}{shape[1:]}"
    return f"{shape}; {grains}; {count}; in {within}."


def _grains(row: pd.Series) -> str:
    """What the grains of a bed are, in words."""
    what = solid(float(row["rho_sol_kg_m3"]))
    size = length(float(row["d_m"]))
    return f"{what} grains of {size}" if what.isalpha() else f"grains of {size}, {what}"


def _numbers_of_bed(
    row: pd.Series, pile: Pile, results: Results, told: ReportedQuantity
) -> Iterator[Number]:
    """The flow of a fraction, that of the first motion, and its place."""
    if row["verdict"] == UNUSABLE:
        taken = single.take_this(row, told)
        if taken is not None:
            yield taken
    yield share(row, told)
    first = single.known_number(row["first_ustar0_m_s"])
    has_place = first > 0 and not single.is_level(row)
    if first > 0:
        yield _first_motion(row, pile, told)
    if has_place:
        yield _place(row, pile, results)


def _first_motion(row: pd.Series, pile: Pile, told: ReportedQuantity) -> Number:
    """The flow that moves the first grains, with its interval."""
    meaning = f"{single.threshold_name(told)}, first motion"
    note = ""
    if crest.has_sharp_crest(pile.scene):
        change = crest.told(crest.FIRST_GRAIN)
        note = f"a finer mesh at the crest changes u*₀ by {change}"
    return single.reported_number(row, told, meaning, note, FIRST, "first_")


def _place(row: pd.Series, pile: Pile, results: Results) -> Number:
    """Where motion starts, and where else it may within the numerical error."""
    line = pile.model.line
    top = float(line.crest[0])
    x = float(row["first_x_m"])
    low, high = _places(row, results)
    of_what = "places whose threshold is within the numerical error of the lowest"
    meaning = "point of first motion"
    if abs(x - top) <= float(row["d_m"]):
        meaning += ": the crest"
    is_grey = row["verdict"] == UNUSABLE
    profile = pile.bed.profile
    if profile:
        at = place_of_file(float(profile.place(top)), profile)
        return Number(
            x,
            "m",
            f"x at the {meaning}",
            f"the crest of {profile.name} is at x = {at} m",
            low=low,
            high=high,
            interval_of=of_what,
            decimals=digits_of_place(profile),
            is_grey=is_grey,
        )
    unit, scale = ("m", 1.0) if abs(line.x[-2]) >= 1 else ("mm", 1e3)
    return Number(
        scale * x,
        unit,
        meaning,
        f"from the toe; the crest is at {scale * top:.3g} {unit}",
        low=scale * low,
        high=scale * high,
        interval_of=of_what,
        is_grey=is_grey,
    )


def _places(row: pd.Series, results: Results) -> tuple[float, float]:
    """Ends of the places at which motion may start within the numerical error, m."""
    grains = results.tables.get("pile_grain", pd.DataFrame())
    error = single.known_number(row["first_numerical_error"])
    if grains.empty or math.isnan(error):
        return math.nan, math.nan
    here = grains[grains["scene_id"] == row["scene_id"]]
    most = (
        single.known_number(row["first_ustar0_m_s"]) * math.sqrt(1 + error) * (1 + 1e-9)
    )
    near = here[here["ustar0_m_s"] <= most]["x_m"]
    return (float(near.min()), float(near.max())) if len(near) else (math.nan, math.nan)


def share(row: pd.Series, told: ReportedQuantity, of_what: str = "") -> Number:
    """Make the number of the flow at which a fraction of a bed is entrained.

    Parameters
    ----------
    row
        A threshold with the columns of its scene, seeds as one.
    told
        What its flow is told by.
    of_what
        Which bed it is of; empty of the only one.

    Returns
    -------
    Number
        With its interval.
    """
    part = percent(row["fraction"])
    moved = "entrained" if packs_grains(row) else "of the bed in motion"
    meaning = f"{single.threshold_name(told)}, {part} {moved}"
    if of_what:
        meaning += f": {of_what}"
    place = single.place_of_quantity(told, row)
    return single.reported_number(row, told, meaning, place, NUMBERS)


def ustar_number(row: pd.Series) -> Number:
    """Make the number of the friction velocity of a threshold.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    Number
        With its interval.
    """
    return single.reported_number(row, USTAR, USTAR.name, "√(τ_b/ρ)", NUMBERS)


def _of_several(rows: pd.DataFrame, results: Results) -> Card:
    """The card of several beds, by what varies among them."""
    told = sheets.quantity_of_rows(rows)
    telling = labels.varying(results.at_fraction, "fraction")
    every = results.joined("pile_threshold")
    worth = _worth_of_many(every, rows)
    if _are_unlike(results.at_fraction, telling):
        return _of_unlike(rows, results, told, telling, worth)
    has_pairs = not results.tables.get("paired", pd.DataFrame()).empty
    if has_pairs and set(telling) <= {*SHELTER}:
        return _of_shelter(results, told, telling)
    usable = rows[valid(rows)]
    shown = usable if len(usable) else rows
    by = single.advised_column(shown.iloc[0], told)
    shown = shown.sort_values(by, kind="stable")
    numbers = _range(shown, told, telling)
    first = _first_of_several(shown, results, told, telling)
    if first is not None:
        numbers.append(first)
    advice = f"{worth.advice} {_no_difference(shown, told)}".strip()
    return Card(
        f"At what {told.flow} does {_common_shape(results.at_fraction)} start to move"
        f"{', and where' if first is not None else ''}, by {_axes(telling)}?",
        _scene_of_several(results),
        tuple(numbers),
        single.source(shown.iloc[0], shown.iloc[-1]),
        replace(worth, advice=advice),
    )


def _of_shelter(
    results: Results, told: ReportedQuantity, telling: Sequence[str]
) -> Card:
    """The card of beds that differ in their shelter: ratios to the bed without it."""
    rows = results.ratios(results.at_fraction)
    pairs = rows[rows[f"{told.stem}_ratio"].notna()].drop_duplicates([*telling])
    without = rows[rows["scene_id"].isin(results.tables["paired"]["without_id"])]
    bare = without.iloc[0]
    name = single.threshold_name(told)
    numbers = []
    for which, shown in (("", pairs[: MOST_NUMBERS - 1]), ("first_", pairs[:1])):
        for _, row in shown.iterrows():
            of = "first motion" if which else f"{percent(row['fraction'])} entrained"
            what = ", ".join(labels.told(row, telling))
            numbers.append(_ratio(row, bare, told, which, f"{name}, {of}: {what}"))
    pile = results.plan.piles[str(bare["scene_id"])]
    shelter, against = _shelter(results, bare, telling)
    shape = f"this {pile.bed.form.word}"
    if pile.bed.forms > 1:
        shape = f"these {pile.bed.form.words}"
    return Card(
        f"How much does {shelter} raise the {told.flow} that moves {shape}?",
        _span_of(results.at_fraction),
        tuple(numbers),
        f"Ratios of thresholds to those {against}. Both beds have the same grains, "
        "forces, method and meshes: an error that both share in proportion cancels. "
        "Whether the numerical error is such a one was not tested.",
        _worth_of_ratios(results.ratios(results.joined("pile_threshold")), told),
    )


def _shelter(
    results: Results, bare: pd.Series, telling: Sequence[str]
) -> tuple[str, str]:
    """What shelters some beds, and what the bed without it is called."""
    if "obstacles" not in telling:
        return (
            "a closer spacing",
            f"at a spacing of {labels.value('spacing', bare['spacing'])}",
        )
    scenes = [pile.scene for pile in results.plan.piles.values()]
    kinds = {each.kind for scene in scenes for each in scene.obstacles}
    if len(kinds) == 1:
        (kind,) = kinds
        return f"a {kind}", f"without a {kind}"
    return "an obstacle", "without one"


def _worth_of_ratios(every: pd.DataFrame, told: ReportedQuantity) -> Worth:
    """What the ratios of sheltered beds are worth."""
    pairs = every[every[f"{told.stem}_ratio"].notna()]
    count = int(pairs["ratio_usable"].sum())
    alone = int(every["usable"].sum())
    advice = (
        f"Take the ratios. Of the thresholds themselves {alone} of {len(every)} are "
        "usable; the reasons against the others stand below the table."
    )
    if count == len(pairs):
        return Worth("good", "usable, as ratios", advice)
    word = f"usable, with gaps: {count} of {len(pairs)} ratios"
    return Worth("care", word, advice)


def _ratio(
    row: pd.Series, without: pd.Series, told: ReportedQuantity, which: str, meaning: str
) -> Number:
    """The ratio of a threshold with shelter to that without, and both."""
    name = f"{which}{told.stem}_ratio"
    ends = [float(each[f"{which}{told.column()}"]) for each in (without, row)]
    both = " → ".join(f"{end:.3g}" for end in ends)
    return Number(
        float(row[name]),
        "",
        meaning,
        f"by the model {both} {told.unit}",
        low=float(row[f"{name}_low"]),
        high=float(row[f"{name}_high"]),
        interval_of="paired: one grain and one load step more or less in each bed",
        decimals=2,
        is_ratio=True,
    )


def _are_unlike(rows: pd.DataFrame, telling: Sequence[str]) -> bool:
    """Whether beds differ in fluid, method or mixture: they have no common range."""
    if any(rows[name].nunique() > 1 for name in FLUIDS):
        return True
    return any(
        name in MIXTURE or name == "asked" or name in fields.OF_METHOD
        for name in telling
    )


def _of_unlike(
    rows: pd.DataFrame,
    results: Results,
    told: ReportedQuantity,
    telling: Sequence[str],
    worth: Worth,
) -> Card:
    """The card of beds of several fluids, methods or mixtures: a number for each."""
    rows = rows.loc[sorted(rows.index)]
    rows = rows.sort_values("usable", ascending=False, kind="stable")
    numbers = []
    if not rows["usable"].any():
        rows_of_level = (row for _, row in rows.iterrows())
        taken = (single.take_this(row, told) for row in rows_of_level)
        numbers += [next((each for each in taken if each is not None), None)]
    # of each fluid and mixture by the first method of the study
    keys = [*FLUIDS, *MIXTURE, "bed_shape", "alpha_deg"]
    keys = [name for name in keys if name in rows]
    firsts = rows.drop_duplicates(keys)
    order = pd.concat([firsts, rows]).drop_duplicates(["scene_id"])
    for _, row in order.iterrows():
        numbers.append(share(row, told, _name_of(row, rows, telling)))
    shown = [each for each in numbers if each is not None]
    left = len(shown) - MOST_NUMBERS
    taken_count = len(shown) - len(order)
    of_card = order[: MOST_NUMBERS - taken_count]
    source = single.source(*(row for _, row in of_card.iterrows()))
    if left > 0:
        source += f" The table has {number_of(left, 'more bed')}."
    what = "these beds"
    if any(name in telling for name in MIXTURE):
        what = "these mixtures"
    return Card(
        f"What {single.threshold_name(told).removeprefix('threshold ')} mobilises "
        f"{what}, by {_axes(telling)}?",
        _span_of(results.at_fraction),
        tuple(shown[:MOST_NUMBERS]),
        source,
        worth,
    )


def _name_of(row: pd.Series, rows: pd.DataFrame, telling: Sequence[str]) -> str:
    """What a bed among others is called: its group, and what differs within that."""
    group = str(row["group"])
    if not group or "; " in group:
        return ", ".join(labels.told(row, list(telling)[:3]))
    within = labels.varying(rows[rows["group"] == row["group"]], "fraction")
    return ", ".join([f"“{group}”", *labels.told(row, within[:2])])


def _axes(telling: Sequence[str]) -> str:
    """What several beds or grains differ in, in words."""
    return enumerated([labels.head_of(name) for name in telling[:3]])


def _first_of_several(
    shown: pd.DataFrame,
    results: Results,
    told: ReportedQuantity,
    telling: Sequence[str],
) -> Number | None:
    """The least flow that moves the first grains of several beds, and where they lie.

    None where no bed has such a place.
    """
    starts = shown[(shown["first_ustar0_m_s"] > 0) & ~is_flat(shown)]
    if starts.empty:
        return None
    row = starts.loc[starts["first_ustar0_m_s"].idxmin()]
    pile = results.plan.piles[str(row["scene_id"])]
    number = _first_motion(row, pile, told)
    what = ", ".join(labels.told(row, list(telling)[:3]))
    meaning = f"lowest {single.threshold_name(told)}, first motion: {what}"
    where = _where_of_several(starts, results)
    note = "; ".join(filter(None, [f"it starts {where}", number.note]))
    return replace(number, meaning=meaning, note=note)


def _where_of_several(starts: pd.DataFrame, results: Results) -> str:
    """Where motion starts on several beds: at the crest of all, or of the first."""
    piles = [results.plan.piles[str(scene)] for scene in starts["scene_id"]]
    x = starts["first_x_m"].to_numpy(float)
    near = starts["d_m"].to_numpy(float)
    tops = np.array([float(pile.model.line.crest[0]) for pile in piles])
    if not any(pile.bed.profile for pile in piles):
        ends = dict.fromkeys(length(float(end)) for end in (x.min(), x.max()))
        places = f"{' to '.join(ends)} from the toe"
        if (np.abs(x - tops) <= near).all():
            return f"at the crest{' of each bed' if len(piles) > 1 else ''}, {places}"
        crests = dict.fromkeys(length(float(end)) for end in (tops.min(), tops.max()))
        return f"{places}, the crest at {' to '.join(crests)}"
    row = starts.sort_values("first_ustar0_m_s", kind="stable").iloc[0]
    bed = results.plan.piles[str(row["scene_id"])].bed
    return counted.spot(float(row["first_x_m"]), bed)


def _no_difference(shown: pd.DataFrame, told: ReportedQuantity) -> str:
    """That numerical errors hide the difference of several beds; empty if not.

    Unknown errors show no difference and hide none.
    """
    ends = shown.iloc[[0, -1]]
    stresses = ends["ustar0_m_s"].to_numpy(float) ** 2
    error = float(np.hypot(*ends["error_estimate"].astype(float)))
    apart = float(stresses.max() / stresses.min()) - 1
    if len(shown) < 2 or not apart < error:
        return ""
    return (
        f"The beds show no difference: the lowest and the highest {told.name} are "
        f"{percent(apart)} apart in stress, less than their numerical errors together, "
        f"{percent(error)}."
    )


def _scene_of_several(results: Results) -> str:
    """One line on the form of several beds, where it is one, and on what varies."""
    rows = results.at_fraction
    piles = [results.plan.piles[str(scene)] for scene in rows["scene_id"]]
    beds = [pile.bed for pile in piles]
    forms = {(bed.shape, bed.height, bed.slope_deg, bed.forms) for bed in beds}
    bed = beds[0]
    is_one = len(forms) == 1 and not any(each.profile for each in beds)
    if not is_one or single.is_level(rows.iloc[0]):
        return _span_of(rows)
    word = bed.form.word
    if bed.forms > 1:
        word = f"train of {bed.forms} {bed.form.words}"
    shape = f"{word} {length(bed.height)} high, windward face {bed.slope_deg:g}°"
    return f"{shape[:1].upper()}{shape[1:]}. {_span_of(rows, with_slopes=False)}"


def _common_shape(rows: pd.DataFrame) -> str:
    """What several beds are, in the singular."""
    shapes = set(rows["bed_shape"])
    if rows["profile"].notna().any() or len(shapes) > 1:
        return "a bed"
    return f"a {SHAPES[str(shapes.pop())].word}"


def _span_of(rows: pd.DataFrame, *, with_slopes: bool = True) -> str:
    """One line on the grains, the slopes and the fluids of several beds or grains."""
    least = float(rows["d_m"].min())
    most = float(rows["d_m"].max())
    sizes = " to ".join(dict.fromkeys([length(least), length(most)]))
    parts = [f"grains of {sizes}"]
    slopes = sorted(set(rows["alpha_deg"]))
    if with_slopes and slopes != [0.0]:
        ends = _ends(slopes)
        word = "slopes" if len(ends) > 1 else "a slope"
        parts.append(f"{word} of {' to '.join(ends)}°")
    fluids = dict.fromkeys(
        fluid(float(rho), float(nu))
        for rho, nu in zip(rows["rho_f_kg_m3"], rows["nu_m2_s"], strict=True)
    )
    named = list(fluids)
    if len(named) > 3:
        named = [f"{len(named)} fluids"]
    parts.append(f"in {', '.join(named)}")
    text = ", ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def _ends(values: Sequence[float]) -> list[str]:
    """The first and the last of some values as texts, one where they are alike."""
    return list(dict.fromkeys([f"{values[0]:g}", f"{values[-1]:g}"]))


def _range(
    rows: pd.DataFrame, told: ReportedQuantity, telling: Sequence[str]
) -> list[Number]:
    """The least and the largest flow of beds or grains that rise by it, or the one."""
    if len(rows) == 1:
        return [_end_of_range(rows.iloc[0], told, telling, "")]
    return [
        _end_of_range(rows.iloc[0], told, telling, "lowest "),
        _end_of_range(rows.iloc[-1], told, telling, "highest "),
    ]


def _end_of_range(
    row: pd.Series, told: ReportedQuantity, telling: Sequence[str], which: str
) -> Number:
    """The least or the largest flow of several beds or grains."""
    what = ", ".join(labels.told(row, list(telling)[:3]))
    if "fraction" in row:
        number = share(row, told, what)
    else:
        meaning = f"{single.threshold_name(told)}: {what}"
        place = single.place_of_quantity(told, row)
        number = single.reported_number(row, told, meaning, place, single.LOAD_STEP)
    return replace(number, meaning=f"{which}{number.meaning}")


# mixtures


def _of_mixture(row: pd.Series, results: Results) -> Card:
    """The card of a mixture: all sizes, the finest to the coarsest, the flow."""
    classes = results.joined("size_class")
    here = classes[classes["fraction"] == row["fraction"]]
    here = here[here["scene_id"] == row["scene_id"]].sort_values("size_over_d")
    density = float(row["rho_f_kg_m3"])
    stress = (density * here["ustar0_m_s"] ** 2).tolist()
    beside = [hidden_stress(row, float(size)) for size in here["size_over_d"]]
    sizes = [1e3 * float(row["d_m"]) * float(size) for size in here["size_over_d"]]
    all_sizes = share(row, STRESS)
    spread = Number(
        float(stress[0]),
        "Pa",
        f"bed shear stress, {percent(row['fraction'])} of the finest size entrained, "
        "and of the coarsest",
        f"{sizes[0]:.3g} mm and {sizes[-1]:.3g} mm; Wilcock and Crowe (2003) fitted a "
        "function to transport, which is taken here with the stress of d₅₀ "
        f"{single.with_threshold(row)}",
        last=float(stress[-1]),
        other=beside[0],
        other_last=beside[-1],
        other_is="by Wilcock and Crowe",
        is_grey=row["verdict"] == UNUSABLE,
    )
    told = single.quantity_of_row(row)
    flow = ustar_number(row) if told is STRESS else share(row, told)
    pile = results.plan.piles[str(row["scene_id"])]
    name = kind_of_grain(float(row["d_m"]))
    taken = None
    if row["verdict"] == UNUSABLE:
        taken = single.take_this(row, STRESS)
    numbers = (taken, all_sizes, spread, flow)
    return Card(
        f"What bed shear stress mobilises this {name} mixture, and which sizes go "
        "first?",
        _scene(row, pile, results),
        tuple(filter(None, numbers))[:MOST_NUMBERS],
        single.source(row),
        _worth(row, few=bool(here["few"].any())),
    )


def hidden_stress(row: pd.Series, size: float) -> float:
    """Compute the stress that moves a size by Wilcock and Crowe, beside that of d50.

    Parameters
    ----------
    row
        The threshold of the mixture.
    size
        The size over d50.

    Returns
    -------
    float
        Stress on the bed, Pa.
    """
    ustar = float(row["compared_level_ustar_m_s"])
    return float(row["rho_f_kg_m3"]) * ustar**2 * float(wilcock_crowe_hiding(size))


# single grains


def _of_grains(grains: pd.DataFrame) -> Card:
    """The card of one grain, or of several."""
    if is_one_grain(grains):
        return card_of_grain(grains.iloc[0])
    told = sheets.quantity_of_rows(grains)
    usable = grains[valid(grains)]
    shown = usable if len(usable) else grains
    by = single.advised_column(shown.iloc[0], told)
    shown = shown.sort_values(by, kind="stable")
    telling = labels.varying(grains, "bed")
    fluids = [name for name in FLUIDS if grains[name].nunique() > 1]
    numbers = _range(shown, told, telling)
    ends = [shown.iloc[0], shown.iloc[-1]]
    if fluids:
        # fluids are never put into one range
        of_fluids = grains.drop_duplicates(fluids)[:MOST_NUMBERS]
        ends = [row for _, row in of_fluids.iterrows()]
        numbers = [_end_of_range(row, told, telling, "") for row in ends]
    return Card(
        f"At what {told.flow} does a grain start to move, by {_axes(telling)}?",
        _span_of(grains),
        tuple(numbers),
        single.source(*ends),
        _worth_of_many(grains, grains),
    )


def card_of_grain(row: pd.Series) -> Card:
    """Make the card of one grain: speed, friction velocity and stress.

    Parameters
    ----------
    row
        Its threshold with the columns of its scene.

    Returns
    -------
    Card
        The card.
    """
    return single.single_card(row)


def by_law(row: pd.Series) -> dict[str, tuple[float, bool]]:
    """Find the threshold of a single grain by each force law, by its own criterion.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    dict of str to tuple of float and bool
        Friction velocity at the threshold, m/s, and whether the law holds there, by the
        name of the law.
    """
    rows = pd.DataFrame([row] * len(LAWS)).assign(force_law=list(LAWS))
    found = of_rows(rows)
    pairs = zip(found["ustar"].tolist(), found["holds"].tolist(), strict=True)
    return dict(zip(LAWS, pairs, strict=True))


# many laws, and hills


def _of_laws(results: Results, best: Sequence[theory.Line]) -> Card:
    """The card of a study of many force laws: which is nearest to measurements."""
    first = best[0]
    findings = theory.nearest_lines(results)
    grains = sheets.single_grains_sheet(results)
    piles = results.joined("pile_threshold")
    count = sum(int(table["usable"].sum()) for table in (grains, piles) if len(table))
    of = len(grains) + len(piles)
    law = labels.value("force_law", first.law)
    said = " ".join(each.sentence for each in findings[1:])
    word = "usable" if count == of else f"usable, with gaps: {count} of {of} thresholds"
    mark: Mark = "good" if count == of else "care"
    return Card(
        "Which force law comes nearest to measured thresholds?",
        f"Nearest of {len(best)} laws: {law}. {_span_of(results.scenes)}",
        tuple(_numbers_of_laws(best, findings)),
        f"{MEASURED_SOURCE[:1].upper()}{MEASURED_SOURCE[1:]}. {said}".strip(),
        Worth(mark, word, f"In water take {law}; in air see the caveats."),
    )


def _numbers_of_laws(
    best: Sequence[theory.Line], findings: Sequence[theory.LineFinding]
) -> Iterator[Number]:
    """Over which range the nearest law is as measured, and how far it is off."""
    first, *others = best
    second = max(others, key=lambda line: line.decades)
    law = labels.value("force_law", second.law)
    yield Number(
        first.decades,
        f"of {theory.DECADES:.1f}",
        "decades of Re* within the flumes’ 10 to 90 %",
        f"by {first.name}; the next, {law}, over {second.decades:.1f}; {TERMS['re']}",
        decimals=1,
    )
    factors = sorted(line.median_factor for line in others if line.decades)
    ends = dict.fromkeys(f"{end:.2f}" for end in (*factors[:1], *factors[-1:]))
    rest = f"; the others {' … '.join(ends)}, each over its own range" if ends else ""
    yield Number(
        first.median_factor,
        "",
        "median misfit in water, a factor of the flumes’ medians",
        f"from Re* = {theory.FACTORS_FROM:g} on, at worst {first.worst[0]:.2f}{rest}",
        decimals=2,
        is_ratio=True,
    )
    for found in findings:
        if math.isfinite(found.of_first):
            yield Number(
                found.of_first,
                "",
                "median misfit in air, a factor of the mean of published curves",
                f"by the same law; the least, {found.factor:.2f}, by {found.name}",
                decimals=2,
                is_ratio=True,
            )


def _of_hills(hills: Sequence[tuple[float, pd.DataFrame]]) -> Card:
    """The card of hills that others measured: where reversed flow ends behind each."""
    first = hills[0][1]
    source_ = str(first["measured_source"].iloc[0])
    source_ = f"{source_[:1].upper()}{source_[1:]}."
    if not all(rows["measured_verified"].all() for _, rows in hills):
        source_ += " Not every number was read in its source."
    slopes = [f"{rows['alpha_deg'].iloc[0]:.0f}°" for _, rows in hills]
    steepest = f"steepest slope{'s' if len(slopes) > 1 else ''} {enumerated(slopes)}"
    return Card(
        "Does the model reproduce the separation bubble behind a hill?",
        f"{number_of(len(hills), 'hill')} of the wind-tunnel experiment RUSHIL, "
        f"{length(float(first['h_m'].iloc[0]))} high (h), {steepest}; "
        f"{number_of(len(first), 'turbulence model')}; no grains.",
        tuple(_behind(aspect, rows) for aspect, rows in hills[:3]),
        source_,
        Worth("care", "usable, for flows", _like_the_tunnel(hills)),
        ("What was measured", "Can it be used?"),
    )


def _like_the_tunnel(hills: Sequence[tuple[float, pd.DataFrame]]) -> str:
    """Which turbulence models separate behind the same hills as the wind tunnel."""
    every = pd.concat([rows for _, rows in hills])
    measured = every["measured_reattachment_over_h"] > 0
    is_like = (every["reattachment_over_h"] > 0) == measured
    by_model = is_like.groupby(every["turbulence_model"], sort=False).all()
    named = {
        is_so: [
            labels.value("turbulence_model", name)
            for name in by_model.index[by_model == is_so]
        ]
        for is_so in (True, False)
    }
    like, unlike = named[True], named[False]
    said = []
    if like:
        verb = "separates" if len(like) == 1 else "separate"
        said.append(f"{enumerated(like)} {verb} behind the same hills as the tunnel")
    if unlike:
        verb = "does" if len(unlike) == 1 else "do"
        said.append(f"{enumerated(unlike)} {verb} not")
    return f"{'; '.join(said)}. Compare flows; no threshold is meant."


def _behind(aspect: float, rows: pd.DataFrame) -> Number:
    """Where reversed flow ends behind a hill, by the first model and by all."""
    row = rows.iloc[0]
    model = labels.value("turbulence_model", row["turbulence_model"])
    measured = single.known_number(row["measured_reattachment_over_h"])
    own = single.known_number(row["reattachment_over_h"])
    separated = rows[rows["reattachment_over_h"] > 0]
    ends = separated["reattachment_over_h"]
    hill = f"hill of half-length {aspect:g} h, by {model}"
    others = [
        labels.value("turbulence_model", name) for name in separated["turbulence_model"]
    ]
    tunnel = "none" if math.isnan(measured) else ""
    if not own > 0:
        note = f"the same by all {len(rows)} models" if len(rows) > 1 else ""
        if others:
            note = f"by {enumerated(others)} reattachment at {ends.min():.1f}"
            note += f" … {ends.max():.1f} h" if len(ends) > 1 else " h"
        return Number(
            math.nan,
            "",
            f"separation, {hill}",
            note,
            word="none",
            other=measured,
            other_word=tunnel,
            is_other_measured=True,
            decimals=1,
        )
    count = f"all {len(rows)}" if len(ends) == len(rows) else f"{len(ends)}"
    return Number(
        own,
        "h",
        f"reattachment behind the crest, {hill}",
        "" if tunnel else _against(own, measured, bool(row["measured_verified"])),
        low=float(ends.min()),
        high=float(ends.max()),
        interval_of=f"{count} turbulence models, which separate",
        other=measured,
        other_word=tunnel,
        is_other_measured=True,
        decimals=1,
    )


def _against(own: float, measured: float, is_verified: bool) -> str:
    """By how much a computed length differs from a measured one."""
    word = "short of" if own < measured else "beyond"
    note = f"{percent(abs(own / measured - 1))} {word} the measured length"
    return note if is_verified else f"{note}, which was not read in its source"


def is_of_hills(results: Results) -> bool:
    """Whether a study is about hills that others measured, none of whose grains count.

    Returns
    -------
    bool
        Whether it is.
    """
    thresholds = results.joined("pile_threshold")
    return bool([*measured_hills(results)]) and not thresholds["usable"].any()


def _worth_of_many(every: pd.DataFrame, shown: pd.DataFrame) -> Worth:
    """What the answers of several beds or grains are worth together.

    Parameters
    ----------
    every
        All their thresholds.
    shown
        Those that the card is made of.
    """
    of = len(every)
    count = int(every["usable"].sum())
    if not count:
        return single.worth(shown.iloc[0])
    usable = shown[valid(shown)]
    first = usable.iloc[0] if len(usable) else shown.iloc[0]
    advised = first.get("advised")
    # a correction is one of all rows
    is_corrected = advised == WITH_MEASURED
    with_what = single.with_threshold(*(row for _, row in usable.iterrows()))
    if count < of:
        word = f"usable, with gaps: {count} of {of} thresholds"
        advice = "The others are grey; the reasons stand below the table."
        if is_corrected:
            advice = f"Numbers are those {with_what}. {advice}"
        return Worth("care", word, advice)
    outside = int((every["verdict"] != USABLE).sum())
    if not outside:
        advice = f"All {of} thresholds are within what was measured."
        if any(single.is_by_formula(row) for _, row in shown.iterrows()):
            advice = f"The intervals of all {of} thresholds contain what was measured "
            advice += "or a formula gives."
        return Worth("good", "usable", advice)
    advice = (
        f"Take all {of} thresholds as shown, {with_what}. At {outside} of them the "
        "model alone lies outside what was measured on level beds."
    )
    if not is_corrected:
        advice = (
            f"At {outside} of {of} thresholds the model lies outside what was measured "
            f"on level beds: for a flow in nature take the number {with_what}, to "
            "compare models that of the model."
        )
    return Worth("care", "usable, with a correction", advice)
