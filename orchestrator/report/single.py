"""Cards of single grains, and what all cards need: units, measured values, worth.

Rows are those of tables, or mappings with the same columns: nothing here loads pandas,
which the command `threshold` does without.
"""

import math
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
from orchestrator.physics.reported import COUNT, IN_GAS, MEASURED, OF_LAWS, SEEDS
from orchestrator.report.card import Card, Number, Worth, decimals
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


WITH = (
    "with the measured threshold",
    "with the threshold of the formula",
    "with the measured threshold or that of the formula",
)
"""What the values beside those of beds are made with: a median of flumes, a formula,
or one of these."""
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
    size = length(float(row["d_m"]))
    # rows of `threshold` have no column for the criterion, and this one for
    # sustained motion alone
    is_sustained = row.get("criterion", SUSTAINED) == SUSTAINED
    is_decided = isinstance(row.get("decides"), str)
    ending = ""
    if is_sustained and is_decided:
        ending = " and keep moving"
    return Card(
        f"At which {told.flow} does a grain of {size} start to move{ending}?",
        _scene_of_grain(row),
        numbers_of_grain(row, told),
        source(row, told),
        worth(row),
    )


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
    notes = {
        WIND: f"10 m above {ground}",
        MEAN: over,
        DEPTH: "of the uniform flow whose weight along the slope is that stress",
        USTAR: "√(τ_b/ρ), the bed shear stress as a speed",
        STRESS: f"τ_b, of the undisturbed flow; critical Shields number "
        f"θ_c = τ_b/((ρ_s − ρ) g d): {theta:.3g}",
    }
    second = DEPTH if known_number(row.get("bed_slope")) > 0 else USTAR
    shown = [each for each in (told, second, STRESS) if each is not STRESS]
    of_what = interval_of(row, LOAD_STEP)
    numbers = []
    for each in (*dict.fromkeys(shown), STRESS):
        name = each.name if each is not STRESS else "bed shear stress"
        is_first = each is (*shown, STRESS)[0]
        number = reported_number(
            row, each, name, notes[each], of_what if is_first else ""
        )
        numbers.append(number)
    return tuple(numbers)


def reported_number(
    row: Row,
    told: ReportedQuantity,
    meaning: str,
    note: str = "",
    of_what: str = "",
    which: str = "",
) -> Number:
    """Make the number of a threshold as its row has it in the unit of a quantity.

    Parameters
    ----------
    row
        A threshold.
    told
        The quantity.
    meaning, note
        What the number is.
    of_what
        What its interval is of.
    which
        ``first_`` for the flow that moves the first grains.

    Returns
    -------
    Number
        With its interval and the value to compare with.
    """
    return Number(
        known_number(row.get(f"{which}{told.column()}")),
        told.unit,
        meaning,
        note,
        low=known_number(row.get(f"{which}{told.column('_low')}")),
        high=known_number(row.get(f"{which}{told.column('_high')}")),
        interval_of=of_what,
        compared=known_number(row.get(f"compared_{which}{told.column()}")),
        beside_is=beside_is(row),
    )


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


def beside_is(row: Row) -> str:
    """Name the value beside a threshold in one word.

    Parameters
    ----------
    row
        A threshold.

    Returns
    -------
    str
        ``formula`` or ``measured``.
    """
    return "formula" if is_by_formula(row) else "measured"


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
    """Say with which threshold of one grain the values beside those of beds are made.

    Parameters
    ----------
    *rows
        Thresholds.

    Returns
    -------
    str
        One of the `WITH`.
    """
    measured, formula, either = WITH
    words = {row.get(COMPARED_WITH) for row in rows}
    if FORMULA not in words:
        return measured
    return either if FLUMES in words else formula


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
    """Say what the interval of a threshold is of, of seeds together.

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
        return f"the range of {beds}; no error of the method is known"
    said = tested_on(row) if of_what in (MEASURED, IN_GAS) else numerical
    return f"{said}; it holds {beds}" if beds else said


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
    them = f"{count} measured thresholds"
    if row["interval_of"] == IN_GAS:
        sites = len(FIELD)
        them = f"thresholds at {sites} field sites and {count - sites} of a formula"
    held = f"this band contained {part} of {them}, each set predicted from the others"
    if row["alpha_deg"] > LEVEL_DEG:
        return f"on level beds {held}; it is widened for the slope"
    return held


def source(row: Row, told: ReportedQuantity, which: str = "") -> str:
    """Say where the values beside the numbers of a card are from.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    told
        What its flow is told by.
    which
        ``first_`` if field measurements are told of the flow of the first grains.

    Returns
    -------
    str
        The sentences.
    """
    if math.isnan(known_number(row["compared_level_ustar_m_s"])):
        return "No measurement is near."
    size = length(float(row["d_m"]))
    alike = "this bed with "
    if is_level(row) or row["bed"] == "grain":
        alike = ""
    if is_gas(float(row["rho_f_kg_m3"])):
        least, most = (1e3 * end for end in OF_TUNNELS)
        said = (
            f"Squares: {alike}the formula of {formula_of(row)} for a level bed of "
            f"grains of {size}, fitted to wind tunnels in air with dry grains of "
            f"{least:g} to {most:.2g} mm."
        )
        return f"{said} {_field(row, told, which)}"
    if row["measured_rows"] > 0:
        rows = f"{row['measured_rows']:.0f} rows of flumes"
        ends = f"{row['measured_low']:.3f} … {row['measured_high']:.3f}"
        return (
            f"Squares: {alike}the median of {rows} at this Re*, level beds, by eye "
            f"(Buffington and Montgomery 1997); 80 % of them have Shields numbers of "
            f"{ends}."
        )
    return (
        f"Squares: {alike}the formula of {formula_of(row)}, fitted to flumes; no flume "
        f"of the compilation has rows at Re* {row['reynolds']:.3g}."
    )


def _field(row: Row, told: ReportedQuantity, which: str) -> str:
    """What the field sites would give, or why none is near."""
    if not row["measured_rows"] > 0:
        return "No field site is near: those have sand of 0.40 to 0.53 mm in air."
    ends = [row[f"measured_{which}{told.column(end)}"] for end in ("_low", "_high")]
    places = decimals(float(ends[0]))
    low, high = (f"{end:.{places}f}" for end in ends)
    sites = f"{len(FIELD)} field sites (Martin and Kok 2018)"
    return f"The thresholds measured at {sites} give {low} … {high} {told.unit}."


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
        return Worth("good", "usable", _within(row))
    advice = "No measurement is near; compare beds with each other alone."
    if row["verdict"] == verdict.CORRECTED:
        what = "wind" if is_gas(float(row["rho_f_kg_m3"])) else "flow"
        value = "value of the formula" if is_by_formula(row) else "measured value"
        advice = f"For the {what} take the {value}."
        advice += " To compare beds take the computed one."
    if not is_level(row) and row["bed"] != "grain":
        advice = f"Take the place as computed. {advice}"
    return Worth("care", row["verdict"], advice)


def _within(row: Row) -> str:
    """Within what an answer is that can be used as it stands."""
    if not is_by_formula(row):
        return "It is within what was measured on level beds."
    if row["measured_rows"] > 0:
        return "Its interval contains the formula; field sites were measured near."
    return "Its interval contains the formula; no threshold was measured near."


def _sentence(text: object) -> str:
    """A text with a capital at its beginning and one point at its end.

    An empty cell of a table that was read is no text.
    """
    if not isinstance(text, str) or not text:
        return ""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
