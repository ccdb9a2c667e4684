"""Cards of single grains, and what all cards need: units, measured values, worth.

Rows are those of tables, or mappings with the same columns: nothing here loads pandas,
which the command `threshold` does without.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from orchestrator.digits import percent
from orchestrator.physics import verdict
from orchestrator.physics.beside import (
    COMPARED_WITH,
    FIELD,
    FLUMES,
    FORMULA,
    LEVEL_DEG,
    OF_TUNNELS,
    SUSTAINED,
)
from orchestrator.physics.constants import CHANNEL
from orchestrator.physics.fluids import is_gas
from orchestrator.physics.laws import LAWS
from orchestrator.physics.reported import (
    CHOICES,
    COUNT,
    IN_GAS,
    MEASURED,
    OF_LAWS,
    SEEDS,
)
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.subjects import (
    DEPTH,
    MEAN,
    STRESS,
    USTAR,
    WIND,
    ReportedQuantity,
    fluid,
    has_wind,
    length,
    solid,
)
from orchestrator.study.shapes import SHAPES

Row = Any
"""A row of a table with the columns of its scene, or a mapping with them."""


MODEL_ALONE = "model alone"
"""What the computed number is called beside one with another critical number."""
MODEL = "by the model"
"""What it is called where both stand with equal right."""
WITH_MEASURED = "with the measured θ_c"
WITH_REFERENCE = "with θ_c of the measurements or the formula"
"""What numbers are called that are made with the median of flumes, or with that or a
formula."""
LOAD_STEP = "the load step"
"""What the numerical interval of a single grain is of."""


def single_card(row: Row) -> Card:
    """Make the card of one grain.

    Parameters
    ----------
    row
        Its threshold, with the columns of `physics.reported`.

    Returns
    -------
    Card
        With speed, friction velocity and stress.
    """
    told = quantity_of_row(row)
    return Card(
        f"At what {told.flow} does {motion_of_grain(row)}?",
        _scene_of_grain(row),
        numbers_of_grain(row, told),
        source(row),
        worth(row),
    )


def motion_of_grain(row: Row) -> str:
    """Say what is asked of one grain: that it starts to move, or keeps moving, too.

    Parameters
    ----------
    row
        Its threshold, as that of `single_card`.

    Returns
    -------
    str
        The words behind "does".
    """
    size = length(float(row["d_m"]))
    # rows of `threshold` have no column for the criterion, and this one for
    # sustained motion alone
    is_sustained = row.get("criterion", SUSTAINED) == SUSTAINED
    is_decided = isinstance(row.get("decides"), str)
    ending = ""
    if is_sustained and is_decided:
        ending = " and keep moving"
    return f"a grain of {size} start to move{ending}"


def known_number(value: Any) -> float:
    """Read a number of a row.

    Parameters
    ----------
    value
        The number, or None where a row of several kinds of values has none.

    Returns
    -------
    float
        The number; NaN for None.
    """
    return math.nan if value is None else float(value)


def quantity_of_row(row: Row) -> ReportedQuantity:
    """Choose what the flow of a row is told by.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    ReportedQuantity
        Of a wind its speed, of other flows with a depth the mean velocity, else the
        stress.
    """
    if has_wind(float(row["rho_f_kg_m3"]), known_number(row.get("depth_m"))):
        return WIND
    if known_number(row.get(MEAN.column())) > 0:
        return MEAN
    return STRESS


def is_level(row: Row) -> bool:
    """Say whether the bed of a row is level, with one stress everywhere.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    bool
        Whether it is.
    """
    shape = SHAPES.get(row.get("bed_shape", ""))
    if shape is None or isinstance(row.get("profile"), str):
        return False
    return shape.is_level


def place_of_quantity(quantity_: ReportedQuantity, row: Row) -> str:
    """Say where a quantity of a row's flow is measured.

    Parameters
    ----------
    quantity_
        The quantity.
    row
        A threshold with the columns of its scene.

    Returns
    -------
    str
        The place, in words.
    """
    if quantity_ is MEAN:
        if known_number(row.get("bed_slope")) > 0:
            return f"of a wide channel that falls by {row['bed_slope']:g}"
        return f"over a depth of {row['depth_m']:g} m"
    if quantity_ is WIND and not is_level(row) and row["bed"] == "pile":
        return "10 m above the flat ground upwind"
    return quantity_.place


def _scene_of_grain(row: Row) -> str:
    """One line on a grain and its bed."""
    alpha = float(row["alpha_deg"])
    bed = "a level bed of identical grains"
    if alpha > 0:
        bed = f"a bed of identical grains that rises by {alpha:g}°"
    within = fluid(float(row["rho_f_kg_m3"]), float(row["nu_m2_s"]))
    grain = solid(float(row["rho_sol_kg_m3"]))
    if is_gas(float(row["rho_f_kg_m3"])):
        return f"One dry grain of {grain} on {bed}, in {within}."
    return f"One grain of {grain} on {bed}, in {within}."


def numbers_of_grain(row: Row, told: ReportedQuantity) -> tuple[Number, ...]:
    """Make the figures of one grain.

    Parameters
    ----------
    row
        Its threshold.
    told
        What its flow is told by.

    Returns
    -------
    tuple of Number
        Speed, friction velocity and stress, each with its interval.
    """
    theta = float(row["shields"])
    ground = "bare, level ground"
    channel = known_number(row.get(CHANNEL))
    if channel > 0 and channel != float(row["z0_m"]):
        ground = f"level ground of z₀ {length(channel)}"
    over = place_of_quantity(MEAN, row) if told is MEAN else ""
    if over and channel > 0:
        over = f"{over}; z₀ of the channel {length(channel)}"
    of_model = "" if row.get("advised", verdict.MODEL) == verdict.MODEL else "model: "
    notes = {
        WIND: f"10 m above {ground}",
        MEAN: over,
        DEPTH: "of the uniform flow whose weight along the slope is that stress",
        USTAR: "u* = √(τ_b/ρ)",
        STRESS: f"τ_b of the undisturbed flow; {of_model}θ_c = {theta:.3g}",
    }
    second = DEPTH if known_number(row.get("bed_slope")) > 0 else USTAR
    shown = [each for each in (told, second, STRESS) if each is not STRESS]
    names = {WIND: "threshold wind", STRESS: "bed shear stress"}
    numbers = []
    for each in (*dict.fromkeys(shown), STRESS):
        name = names.get(each, each.name)
        numbers.append(reported_number(row, each, name, notes[each], LOAD_STEP))
    return tuple(numbers)


def reported_number(
    row: Row,
    told: ReportedQuantity,
    meaning: str,
    note: str = "",
    numerical: str = "",
    which: str = "",
) -> Number:
    """Make the number of a threshold that its row advises, in the unit of a quantity.

    Parameters
    ----------
    row
        A threshold.
    told
        The quantity.
    meaning, note
        What the number is.
    numerical
        What its numerical interval is of.
    which
        ``first_`` for the flow that moves the first grains.

    Returns
    -------
    Number
        With its interval, and the other number beside it: the model's, or that with a
        measured critical Shields number.
    """
    ends = ("", "_low", "_high")
    own = [known_number(row.get(f"{which}{told.column(end)}")) for end in ends]
    other = [
        known_number(row.get(f"compared_{which}{told.column(end)}")) for end in ends
    ]
    has_other = math.isfinite(other[0])
    advised = row.get("advised", verdict.MODEL) if has_other else verdict.MODEL
    of_model = Number(
        own[0],
        told.unit,
        meaning,
        note,
        low=own[1],
        high=own[2],
        interval_of=interval_of(row, numerical),
    )
    if row["verdict"] == verdict.UNUSABLE:
        return replace(of_model, is_grey=True)
    if advised == verdict.MODEL:
        is_lone = row["bed"] == "grain" and not row["alpha_deg"] > LEVEL_DEG
        return replace(
            of_model,
            other=other[0],
            other_is=with_threshold(row),
            is_other_measured=(is_lone or is_level(row)) and not is_by_formula(row),
        )
    is_pair = advised == verdict.BOTH
    of_what = corrected_interval_of(row, numerical, bool(which), own)
    return Number(
        other[0],
        told.unit,
        meaning,
        note,
        low=other[1],
        high=other[2],
        interval_of=of_what,
        other=own[0],
        other_is=model_name(row),
        other_low=own[1],
        other_high=own[2],
        value_is=with_threshold(row) if is_pair else "",
    )


def take_this(row: Row, told: ReportedQuantity) -> Number | None:
    """Make the number to take in place of one that is not usable, where there is one.

    Parameters
    ----------
    row
        A threshold that is not usable.
    told
        What its flow is told by.

    Returns
    -------
    Number or None
        What was measured, or a formula gives, on a level bed of its grains; None of
        other beds, where it takes the flow that was computed.
    """
    is_lone = row["bed"] == "grain" and not row["alpha_deg"] > LEVEL_DEG
    if not (is_lone or is_level(row)):
        return None
    names = [f"compared_{told.column()}"]
    names += [f"measured_{told.column(end)}" for end in ("_low", "_high")]
    value, low, high = (known_number(row.get(name)) for name in names)
    if math.isnan(value):
        return None
    rows = known_number(row["measured_rows"])
    of_what = f"the middle 80 % of {rows:.0f} flume experiments (visual criterion)"
    if is_gas(float(row["rho_f_kg_m3"])):
        of_what = f"{rows:.0f} field sites"
    if not (math.isnan(low) or low <= value <= high):
        low, high = min(low, value), max(high, value)
        of_what += ", and this number"
    where = f"grains of {length(float(row['d_m']))}, level bed"
    by = f"by {formula_of(row)}" if is_by_formula(row) else "flumes"
    return Number(
        value,
        told.unit,
        f"take this: {by}, {where}",
        low=low,
        high=high,
        interval_of=of_what,
        is_measured=True,
    )


def advised_column(row: Row, told: ReportedQuantity) -> str:
    """Name the column of the number that a threshold advises.

    Parameters
    ----------
    row
        A threshold.
    told
        What its flow is told by.

    Returns
    -------
    str
        The column of the number that stands first.
    """
    advised = row.get("advised", verdict.MODEL)
    has_other = known_number(row.get(f"compared_{told.column()}")) > 0
    is_usable = row["verdict"] != verdict.UNUSABLE
    is_corrected = advised != verdict.MODEL and has_other and is_usable
    return f"compared_{told.column()}" if is_corrected else told.column()


def model_name(row: Row) -> str:
    """Name the computed number beside one with another critical Shields number.

    Parameters
    ----------
    row
        A threshold.

    Returns
    -------
    str
        `MODEL` where both stand with equal right, else `MODEL_ALONE`.
    """
    return MODEL if row.get("advised") == verdict.BOTH else MODEL_ALONE


def threshold_name(told: ReportedQuantity) -> str:
    """Name a quantity at the threshold of motion.

    Returns
    -------
    str
        Such as ``threshold wind``.
    """
    name = "bed shear stress" if told is STRESS else told.name
    return f"threshold {name}"


def is_by_formula(row: Row) -> bool:
    """Say whether the value beside a threshold is that of a formula.

    Parameters
    ----------
    row
        A threshold.

    Returns
    -------
    bool
        Whether it is; else it is measured, or there is none.
    """
    return bool(row.get(COMPARED_WITH) == FORMULA)


def what_beside(row: Row) -> str:
    """Name the value beside a threshold within a sentence.

    Parameters
    ----------
    row
        A threshold.

    Returns
    -------
    str
        ``the formula`` or ``measured``.
    """
    return "the formula" if is_by_formula(row) else "measured"


def with_threshold(*rows: Row) -> str:
    """Name the numbers with another critical Shields number than the model's.

    Parameters
    ----------
    *rows
        Thresholds.

    Returns
    -------
    str
        With the measured one, or with that of a formula, by its authors.
    """
    names = []
    for row in rows:
        word = row.get(COMPARED_WITH)
        if word == FLUMES:
            names.append(WITH_MEASURED)
        elif word == FORMULA:
            names.append(f"with θ_c of {formula_of(row).rpartition(' ')[0]}")
    named = [*dict.fromkeys(names)]
    if len(named) > 1:
        return WITH_REFERENCE
    return named[0] if named else WITH_MEASURED


def formula_of(row: Row) -> str:
    """Name the formula of the fluid of a threshold.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    str
        Its authors and year.
    """
    if is_gas(float(row["rho_f_kg_m3"])):
        return "Shao and Lu (2000)"
    return "Soulsby and Whitehouse (1997)"


def interval_of(row: Row, numerical: str) -> str:
    """Say what the interval of a computed threshold contains, of seeds together.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    numerical
        What its numerical interval is of.

    Returns
    -------
    str
        The words; empty without an interval.
    """
    of_what = row["interval_of"]
    if not isinstance(of_what, str):
        return ""
    if of_what == OF_LAWS:
        return f"the {row[COUNT]:.0f} force laws that hold here"
    beds = ""
    if row.get("of_seeds", 1) > 1:
        beds = f"{row['of_seeds']} replicates"
    if of_what == SEEDS:
        return f"the range of {beds}; the numerical error was not measured"
    said = numerical
    if of_what in (MEASURED, IN_GAS):
        said = tested_on(row)
    elif of_what == CHOICES:
        said = f"other packings, forces and angles; it contains {numerical}"
    return f"{said}; it contains {beds}" if beds else said


def corrected_interval_of(
    row: Row, numerical: str, is_first: bool, own: Sequence[float]
) -> str:
    """Say what the interval of a number with another critical number contains.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    numerical
        What the numerical interval of the computed number is of.
    is_first
        Whether it is of the first motion.
    own
        The computed number and the ends of its interval; NaN where one is not known.

    Returns
    -------
    str
        The words.
    """
    rows = ""
    if row["measured_rows"] > 0:
        rows = ", and the ends of what was measured"
    if all(map(math.isnan, own[1:])):
        first = " of the first grain" if is_first else ""
        return f"both numbers{rows}; the numerical error{first} was not measured"
    said = interval_of(row, numerical)
    if row["interval_of"] in (MEASURED, IN_GAS):
        return f"{said}, and widened to contain this number{rows}"
    if row["interval_of"] == OF_LAWS:
        return f"{said}, and this number{rows}"
    return f"{said}, in proportion{rows}"


def tested_on(row: Row) -> str:
    """Say which measured thresholds the tested interval of a row contained.

    Parameters
    ----------
    row
        A threshold with a tested interval and the columns of its scene.

    Returns
    -------
    str
        The part of them that it contained, how many they are, and whether the interval
        is widened for a slope.
    """
    part = percent(row["tested_held"])
    count = int(row["tested_rows"])
    them = f"{count} measured level-bed thresholds"
    if row["interval_of"] == IN_GAS:
        sites = len(FIELD)
        them = f"{count} level-bed thresholds ({sites} field sites, {count - sites} "
        them += "of a formula)"
    held = f"set for 80 %, it contained {part} of {them}, each set predicted from "
    held += "the others"
    return f"{held}; widened for slope" if row["alpha_deg"] > LEVEL_DEG else held


def source(*rows: Row) -> str:
    """Say where the numbers of a card come from, the computed ones and the others.

    Parameters
    ----------
    *rows
        The thresholds that the card shows, with the columns of their scenes.

    Returns
    -------
    str
        The sentences: of the model, and of each other critical Shields number.
    """
    laws = {str(row["force_law"]) for row in rows if row.get("force_law") in LAWS}
    law = "the force laws of the table"
    if len(laws) == 1:
        law = f"the force law {LAWS[laws.pop()].label}"
    said = [f"The model’s numbers are computed with {law}."]
    alike: dict[tuple[bool, bool], list[Row]] = {}
    for row in rows:
        if known_number(row["compared_level_ustar_m_s"]) > 0:
            in_gas = is_gas(float(row["rho_f_kg_m3"]))
            alike.setdefault((is_by_formula(row), in_gas), []).append(row)
    if not alike:
        said.append("No level bed of such grains was measured in such a fluid.")
    said += [_of_reference(which) for which in alike.values()]
    return " ".join(said)


def _of_reference(rows: Sequence[Row]) -> str:
    """Say what critical Shields numbers of one kind are."""
    row = rows[0]
    is_bed = row["bed"] != "grain" and not is_level(row)
    same = "the same bed and flow" if is_bed else "a level bed"
    said = f"Numbers {with_threshold(row)} are those of {same} with {_thetas(rows)}"
    if all(each["verdict"] == verdict.UNUSABLE for each in rows):
        # such a card has the grey numbers of the model alone
        said = f"A level bed has {_thetas(rows)}"
        if is_bed:
            said = f"In the table, numbers {with_threshold(row)} are those of {same} "
            said += f"with {_thetas(rows)}"
    if not is_by_formula(row):
        of = _each(f"{each['measured_rows']:.0f}" for each in rows)
        spans = _each(
            f"{each['measured_low']:.3f} … {each['measured_high']:.3f}" for each in rows
        )
        is_one = " and " not in of
        medians = "the median" if is_one else "the medians"
        where = "this grain Reynolds number" if is_one else "their Reynolds numbers"
        return (
            f"{said}, {medians} of {of} flume experiments at {where} (level beds, "
            "visual criterion; Buffington and Montgomery 1997); the middle 80 % of "
            f"these experiments span {spans}."
        )
    if is_gas(float(row["rho_f_kg_m3"])):
        least, most = (1e3 * end for end in OF_TUNNELS)
        return (
            f"{said}, by the formula of {formula_of(row)}, which was fitted to wind "
            f"tunnels (level beds, dry grains of {least:g} to {most:.2g} mm in air). "
            f"{_field(row)}"
        )
    reynolds = _each(f"{each['reynolds']:.3g}" for each in rows)
    return (
        f"{said}, by the formula of {formula_of(row)}, which was fitted to flumes; no "
        f"flume experiment of the compilation is at grain Reynolds number {reynolds}."
    )


def _thetas(rows: Sequence[Row]) -> str:
    """The critical Shields numbers on level beds that are not the model's, by size."""
    found = {}
    for row in rows:
        found[length(float(row["d_m"]))] = _reference_theta(row)
    if len(found) == 1:
        (size, theta), *_ = found.items()
        # a median of flumes is at a Reynolds number, a formula is for a size
        of = f" for grains of {size}" if is_by_formula(rows[0]) else ""
        return f"θ_c = {theta}{of}"
    return f"θ_c = {_each(f'{theta} ({size})' for size, theta in found.items())}"


def _each(texts: Iterable[str]) -> str:
    """Different texts in a sentence."""
    return " and ".join(dict.fromkeys(texts))


def _reference_theta(row: Row) -> str:
    """The critical Shields number on a level bed that is not the model's."""
    name = "formula_shields" if is_by_formula(row) else "measured_median"
    return f"{known_number(row[name]):.3g}"


def _field(row: Row) -> str:
    """What the field sites have, or why none is near."""
    if not row["measured_rows"] > 0:
        return (
            "No field site has a grain Reynolds number within a factor of 2 of this "
            "threshold: those are level beds of sand of 0.40 to 0.53 mm in air."
        )
    ends = f"{min(FIELD):.4f} … {max(FIELD):.4f}"
    return f"{len(FIELD)} field sites (Martin and Kok 2018) have θ_c = {ends}."


def worth(row: Row, few: bool = False) -> Worth:
    """Say what an answer is worth.

    Parameters
    ----------
    row
        A threshold with the columns of its scene, as table rows have them.
    few
        Whether some of its numbers stand on fewer than ten grains.

    Returns
    -------
    Worth
        That of its verdict, by `physics.verdict`.
    """
    if row["verdict"] == verdict.UNUSABLE:
        word = f"{row['verdict']}: {row['why_not']}"
        return Worth("bad", word, _sentence(row["remedy"]))
    if few:
        advice = (
            "Fewer than ten grains stand for some sizes; ask for more beds (seeds)."
        )
        return Worth("care", "usable, with doubt where grains are few", advice)
    if row["verdict"] == verdict.USABLE:
        if row.get("advised") == verdict.BOTH:
            return Worth("good", "usable", f"{_within(row)} {_of_both(row)}")
        return Worth("good", "usable", _within(row))
    if row["verdict"] == verdict.COMPARED:
        advice = "No measurement is near: compare such beds with each other only."
        return Worth("care", row["verdict"], advice)
    advice = f"The {_flow_of(row)} {with_threshold(row)} is the one to take."
    if row.get("advised") == verdict.BOTH:
        advice = _of_both(row)
    if not is_level(row) and row["bed"] != "grain":
        advice += " The point of first motion is as computed."
    return Worth("care", row["verdict"], advice)


def _of_both(row: Row) -> str:
    """Which of two numbers with equal right is for what."""
    return (
        f"To compare models, take the number of the model; for a {_flow_of(row)} in "
        f"nature, the one {with_threshold(row)}."
    )


def _flow_of(row: Row) -> str:
    """A wind or a flow."""
    return "wind" if is_gas(float(row["rho_f_kg_m3"])) else "flow"


def _within(row: Row) -> str:
    """Within what an answer is that can be used as it stands."""
    if not is_by_formula(row):
        return "It is within what was measured on level beds."
    if row["measured_rows"] > 0:
        near = "level field sites have a grain Reynolds number within a factor of 2"
    else:
        near = "no field site has a grain Reynolds number within a factor of 2"
    return f"Its interval contains the formula's; {near}."


def _sentence(text: object) -> str:
    """A text with a capital at its beginning and one point at its end.

    An empty cell of a table that was read is no text.
    """
    if not isinstance(text, str) or not text:
        return ""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
