"""The answer card of a study: its question, its numbers and what they are worth."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.fidelity import crest
from orchestrator.grains.pile import Pile
from orchestrator.physics.constants import GRAIN_COLUMNS
from orchestrator.physics.fluids import is_gas
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE, wilcock_crowe_hiding
from orchestrator.physics.verdict import USABLE
from orchestrator.report import counted, labels, sheets, single, theory
from orchestrator.report.card import Card, Mark, Number, Worth
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
from orchestrator.study.profile import WITH_X
from orchestrator.study.shapes import SHAPES
from orchestrator.tables.facts import packs_grains
from orchestrator.tables.quoted import is_flat, of_rows

NONE = Card(
    "When do these grains start to move?",
    "",
    (),
    "",
    Worth("bad", "no answer yet", "No case has given a result."),
)
"""The card of a study without results."""
NUMBERS = "load steps, count and the numerical error of the method"
"""What the numerical interval of a share of a bed is of."""


@lru_cache(maxsize=1)
def card(results: Results) -> Card:
    """Make the answer card of a study.

    Parameters
    ----------
    results
        The study with its tables.

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
    """The card of one bed: where motion starts, the first grains, a share of them."""
    pile = results.plan.piles[str(row["scene_id"])]
    told = single.quantity_of_row(row)
    return Card(
        _question(row, pile, told),
        _scene(row, pile, results),
        tuple(_numbers_of_bed(row, pile, results, told)),
        single.source(row, told, "first_"),
        _worth(row),
    )


def _worth(row: pd.Series, few: bool = False) -> Worth:
    """What the answer of one bed is worth, seeds as one."""
    worth = single.worth(row, few)
    if worth.mark == "bad" or row["seeds"] == row["of_seeds"]:
        return worth
    word = f"usable, with gaps: {row['seeds']} of {row['of_seeds']} beds"
    advice = "They are replicates; the table says what is against the others."
    return Worth("care", word, advice)


def _question(row: pd.Series, pile: Pile, told: ReportedQuantity) -> str:
    """The question of one bed."""
    bed = pile.bed
    name = kind_of_grain(float(row["d_m"]))
    if bed.profile:
        return f"When does the {name} of {bed.profile.name} start to move, and where?"
    grains = f"{name} of {length(float(row['d_m']))}"
    shape = bed.form.word
    if bed.forms > 1:
        shape = f"train of {bed.forms} {bed.form.words}"
    return f"At which {told.flow} does a {shape} of {grains} start to move?"


def _scene(row: pd.Series, pile: Pile, results: Results) -> str:
    """One line on shape, size, grains, what of it is counted, and fluid."""
    bed = pile.bed
    line = pile.model.line
    first = float(line.x[1])
    last = float(line.x[-2])
    grains = f"{solid(float(row['rho_sol_kg_m3']))} of {length(float(row['d_m']))}"
    size = f"{length(last - first)} long"
    if single.is_level(row):
        shape = f"level bed, {size}"
    elif bed.profile:
        shape = f"{bed.profile.name}, {size}, {length(float(line.h))} high"
    else:
        slope = f"{bed.slope_deg:g}° windward"
        shape = f"{length(bed.height)} high, {slope}"
    count = f"{row['count']:.0f} counted grains"
    if not packs_grains(row):
        asked = results.plan.decisions[str(row["scene_id"])].asked
        count = "no grains are packed, as the study asks"
        if asked.method.is_open:
            count = "too many grains to follow each"
    if bed.profile or bed.counted:
        grains_ = results.tables["pile_grain"]
        of_bed = grains_["scene_id"] == row["scene_id"]
        count += f"; counted: {counted.metres(grains_.loc[of_bed, 'x_m'], bed)}"
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


def _numbers_of_bed(
    row: pd.Series, pile: Pile, results: Results, told: ReportedQuantity
) -> Iterator[Number]:
    """Where motion starts, the flow of the first grains, and that of a share."""
    first = single.known_number(row["first_ustar0_m_s"])
    has_place = first > 0 and not single.is_level(row)
    if has_place:
        yield _place(row, pile, results)
    if first > 0:
        yield _first_motion(row, pile, told)
    yield share(row, told)
    if not has_place:
        yield ustar_number(row)


def _first_motion(row: pd.Series, pile: Pile, told: ReportedQuantity) -> Number:
    """The flow that moves the first grains, with its interval."""
    of_what = single.interval_of(row, "load step and the numerical error of the method")
    meaning = f"{told.name} that moves the first grains"
    place = single.place_of_quantity(told, row)
    if crest.has_sharp_crest(pile.scene):
        place += f"; a finer first cell moves u*₀ by {crest.told(crest.FIRST_GRAIN)}"
    return single.reported_number(row, told, meaning, place, of_what, "first_")


def _place(row: pd.Series, pile: Pile, results: Results) -> Number:
    """Where motion starts, and where else it may within the numerical error."""
    line = pile.model.line
    crest = float(line.crest[0])
    x = float(row["first_x_m"])
    low, high = _places(row, results)
    of_what = "places whose threshold is within the numerical error of the lowest"
    profile = pile.bed.profile
    if profile:
        top = place_of_file(float(profile.place(crest)), profile)
        return Number(
            x,
            "m",
            "x where motion starts",
            f"the crest of {profile.name} is at x = {top} m",
            low=low,
            high=high,
            interval_of=of_what,
            decimals=digits_of_place(profile),
        )
    unit, scale = ("m", 1.0) if abs(line.x[-2]) >= 1 else ("mm", 1e3)
    top = f"the crest is at {scale * crest:.3g} {unit}"
    return Number(
        scale * x,
        unit,
        "along the bed: here motion starts",
        f"from the toe; {top}",
        low=scale * low,
        high=scale * high,
        interval_of=of_what,
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


def share(row: pd.Series, told: ReportedQuantity) -> Number:
    """Make the number of the flow at which a share of a bed has moved.

    Parameters
    ----------
    row
        A threshold with the columns of its scene, seeds as one.
    told
        What its flow is told by.

    Returns
    -------
    Number
        With its interval.
    """
    part = percent(row["fraction"])
    what = "of the grains" if packs_grains(row) else "of the bed"
    of_what = single.interval_of(row, NUMBERS)
    meaning = f"{told.name} that moves {part} {what}"
    return single.reported_number(
        row, told, meaning, single.place_of_quantity(told, row), of_what
    )


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
    note = "√(τ_b/ρ), the bed shear stress as a speed"
    return single.reported_number(row, USTAR, USTAR.name, note)


def _of_several(rows: pd.DataFrame, results: Results) -> Card:
    """The card of several beds: the least and the largest flow, and what is usable."""
    told = sheets.quantity_of_rows(rows)
    usable = rows[valid(rows)]
    shown = usable if len(usable) else rows
    shown = shown.sort_values(told.column(), kind="stable")
    telling = labels.varying(results.at_fraction, "fraction")
    numbers = _range(shown, told, telling)
    every = results.joined("pile_threshold")
    scenes = every["scene_id"].nunique()
    count = int(every["usable"].sum())
    third = _first_of_several(shown, results, told, telling)
    if third is None or count < len(every):
        third = _usable_number(count, len(every))
    worth = _worth_of_many(shown, count, len(every))
    advice = f"{worth.advice} {_no_difference(shown, told)}".strip()
    return Card(
        f"At which {told.flow} do {scenes} {_common_shape(results.at_fraction)} start "
        "to move?",
        _span_of(results.at_fraction),
        (*numbers, third),
        single.source(shown.iloc[0], told),
        replace(worth, advice=advice),
    )


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
    bed = results.plan.piles[str(row["scene_id"])].bed
    number = _first_motion(row, results.plan.piles[str(row["scene_id"])], told)
    what = ", ".join(labels.told(row, list(telling)[:3]))
    where = counted.spot(float(row["first_x_m"]), bed)
    meaning = f"least {told.name} that moves the first grains, {where}: {what}"
    return replace(number, meaning=meaning)


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
        f"The beds show no difference: the least and the most {told.name} are "
        f"{percent(apart)} apart in stress, less than their numerical errors together, "
        f"{percent(error)}."
    )


def _common_shape(rows: pd.DataFrame) -> str:
    """What several beds are, in the plural."""
    shapes = set(rows["bed_shape"])
    if rows["profile"].notna().any() or len(shapes) > 1:
        return "beds"
    return SHAPES[str(shapes.pop())].words


def _span_of(rows: pd.DataFrame) -> str:
    """One line on the grains, the slopes and the fluids of several beds or grains."""
    least = float(rows["d_m"].min())
    most = float(rows["d_m"].max())
    sizes = " to ".join(dict.fromkeys([length(least), length(most)]))
    parts = [f"grains of {sizes}"]
    slopes = sorted(set(rows["alpha_deg"]))
    if slopes != [0.0]:
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
        _end_of_range(rows.iloc[0], told, telling, "least "),
        _end_of_range(rows.iloc[-1], told, telling, "most "),
    ]


def _end_of_range(
    row: pd.Series, told: ReportedQuantity, telling: Sequence[str], which: str
) -> Number:
    """The least or the largest flow of several beds or grains."""
    what = ", ".join(labels.told(row, list(telling)[:3]))
    moves = "moves a grain"
    if "fraction" in row:
        moves = f"moves {percent(row['fraction'])}"
    is_bed = "fraction" in row
    of_what = single.interval_of(row, NUMBERS if is_bed else single.LOAD_STEP)
    meaning = f"{which}{told.name} that {moves}: {what}"
    return single.reported_number(
        row, told, meaning, single.place_of_quantity(told, row), of_what
    )


def _usable_number(count: int, of: int) -> Number:
    """How many thresholds are usable."""
    note = "" if count == of else "the tables give the reason for each other one"
    return Number.counted(count, of, "thresholds are usable", note, _mark_of(count, of))


def _mark_of(count: int, of: int) -> Mark:
    """What a count of usable thresholds is worth."""
    if count == of:
        return "good"
    return "care" if count else "bad"


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
        f"stress that moves {percent(row['fraction'])} of the finest size, and of the "
        "coarsest",
        f"{sizes[0]:.3g} mm and {sizes[-1]:.3g} mm; beside it: the function that "
        "Wilcock and Crowe (2003) fitted to transport, at the "
        f"{'formula' if single.is_by_formula(row) else 'measured stress'} of d50",
        last=float(stress[-1]),
        compared=beside[0],
        compared_last=beside[-1],
        beside_is="formula",
    )
    told = single.quantity_of_row(row)
    flow = ustar_number(row) if told is STRESS else share(row, told)
    pile = results.plan.piles[str(row["scene_id"])]
    name = kind_of_grain(float(row["d_m"]))
    return Card(
        f"Which flow starts to move this {name}, and which sizes go first?",
        _scene(row, pile, results),
        (all_sizes, spread, flow),
        single.source(row, told),
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
    shown = shown.sort_values("ustar0_m_s", kind="stable")
    telling = labels.varying(grains, "bed")
    return Card(
        f"At which {told.flow} does one grain start to move, by its size and bed?",
        _span_of(grains),
        (
            *_range(shown, told, telling),
            _usable_number(len(usable), len(grains)),
        ),
        single.source(shown.iloc[0], told),
        _worth_of_many(shown, len(usable), len(grains)),
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
    factor = first.median_factor
    numbers = [
        Number(
            first.decades,
            f"of {theory.DECADES:.1f}",
            "decades of Re* within what was measured",
            f"{TERMS['re']}; by {first.name}",
            decimals=1,
        ),
        Number(
            factor,
            "times",
            "median misfit, a factor of the measured medians",
            f"from Re* = {theory.FACTORS_FROM:g} on; "
            f"at worst {first.worst[0]:.2f} times",
            decimals=2,
        ),
    ]
    grains = sheets.single_grains_sheet(results)
    piles = results.joined("pile_threshold")
    count = int(grains["usable"].sum()) if len(grains) else 0
    of = len(grains)
    if len(piles):
        count += int(piles["usable"].sum())
        of += len(piles)
    law = labels.value("force_law", first.law)
    said = " ".join(each.sentence for each in theory.nearest_lines(results)[1:])
    word = "usable" if count == of else f"usable, with gaps: {count} of {of} thresholds"
    mark: Mark = "good" if count == of else "care"
    return Card(
        "Which force law comes nearest to measured thresholds?",
        f"Nearest of {len(best)} laws: {law}. {_span_of(results.scenes)}",
        (*numbers, _usable_number(count, of)),
        f"{MEASURED_SOURCE[:1].upper()}{MEASURED_SOURCE[1:]}. {said}".strip(),
        Worth(mark, word, f"In water take {law}; in air see the caveats."),
    )


def _of_hills(hills: Sequence[tuple[float, pd.DataFrame]]) -> Card:
    """The card of hills that others measured: where reversed flow ends behind each."""
    first = hills[0][1]
    source_ = str(first["measured_source"].iloc[0])
    source_ = f"Squares: {source_}."
    if not all(rows["measured_verified"].all() for _, rows in hills):
        source_ += " Not every number was read in its source."
    return Card(
        "Does the computed flow turn back behind a hill as it did in the wind tunnel?",
        f"{len(hills)} hills of the wind-tunnel experiment RUSHIL; no grains move.",
        tuple(_behind(aspect, rows) for aspect, rows in hills[:3]),
        source_,
        Worth(
            "care", "usable, for flows", "Compare the models; no threshold is meant."
        ),
    )


def _behind(aspect: float, rows: pd.DataFrame) -> Number:
    """How far the flow runs back behind a hill, by the first model and by all."""
    row = rows.iloc[0]
    model = labels.value("turbulence_model", row["turbulence_model"])
    ends = rows["reattachment_over_h"].fillna(0.0)
    measured = single.known_number(row["measured_reattachment_over_h"])
    return Number(
        single.known_number(row["reattachment_over_h"]) if ends.iloc[0] else 0.0,
        "heights",
        f"behind the crest the flow runs back, of a hill of half length {aspect:g} h",
        f"by {model}; 0: it runs back nowhere",
        low=float(ends.min()),
        high=float(ends.max()),
        interval_of=f"the {len(rows)} turbulence models",
        compared=0.0 if math.isnan(measured) else measured,
        decimals=1,
    )


def is_of_hills(results: Results) -> bool:
    """Whether a study is about hills that others measured, none of whose grains count.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    bool
        Whether it is.
    """
    thresholds = results.joined("pile_threshold")
    return bool([*measured_hills(results)]) and not thresholds["usable"].any()


def _worth_of_many(shown: pd.DataFrame, count: int, of: int) -> Worth:
    """What the answers of several beds or grains are worth together."""
    if not count:
        return single.worth(shown.iloc[0])
    if count < of:
        word = f"usable, with gaps: {count} of {of} thresholds"
        return Worth("care", word, "The others are marked, each with its reason.")
    is_near = (shown["verdict"] == USABLE).tolist()
    if all(is_near):
        within = "All are within what was measured."
        if any(single.is_by_formula(row) for _, row in shown.iterrows()):
            within = "The interval of each contains what was measured or a formula."
        return Worth("good", "usable", within)
    outside = len(is_near) - sum(is_near)
    first = shown.iloc[0]
    what = "wind" if is_gas(float(first["rho_f_kg_m3"])) else "flow"
    value = "value of the formula" if single.is_by_formula(first) else "measured value"
    advice = (
        f"{outside} of {len(is_near)} are outside what was measured on level beds: for "
        f"a {what} take the {value}, to compare beds the computed ones."
    )
    return Worth("care", "usable, with a correction", advice)
