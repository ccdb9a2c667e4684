"""What the command `threshold` prints: lines for people, JSON, or CSV."""

import json
import math
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from orchestrator.calculator import (
    BESIDE_CHANNEL,
    ENTRAINED,
    OF_CRITERION,
    PARAMETERS,
    QUANTITIES,
    SUSTAINED,
)
from orchestrator.physics.constants import CHANNEL, GAS_BELOW
from orchestrator.physics.fluids import PAPER

if TYPE_CHECKING:  # this loads numpy
    from numpy.typing import NDArray

    from orchestrator.types import Row

SHOWN = (
    "wind_10m_m_s",
    "mean_velocity_m_s",
    "ustar_m_s",
    "stress_pa",
    "shields",
    "reynolds",
)
"""Columns of the table of laws, where some row has them."""
TOO_MANY = ("drag_n", "lift_n")
"""Quantities that a table for people leaves out."""


def print_csv(table: Mapping[str, "NDArray[Any]"]) -> None:
    """Print a row for each point and law.

    Parameters
    ----------
    table
        The columns of `table.thresholds`; a NaN is an empty cell, and every number has
        nine digits, which are the same on all processors.
    """
    import pandas as pd

    from orchestrator.digits import FORMAT

    frame = pd.DataFrame(table)
    frame.to_csv(sys.stdout, index=False, float_format=FORMAT, lineterminator="\n")


def as_json(rows: Sequence["Row"]) -> str:
    """Write a record for one point, or a list of records, as JSON.

    Parameters
    ----------
    rows
        The rows of `table.thresholds`.

    Returns
    -------
    str
        A record has the parameters, the laws of the rules, and an object for each law.
        Every number has nine digits, which are the same on all processors.
    """
    from orchestrator.physics.beside import COMPARED_WITH, MEASURED, TESTED
    from orchestrator.physics.verdict import COLUMNS

    names = {column: name for column, (name, _) in QUANTITIES.items()}
    for column in ("valid", *COLUMNS, *MEASURED, COMPARED_WITH, *TESTED):
        names[column] = column
    for column in (*BESIDE_CHANNEL, "discharge_low_m2_s", "discharge_high_m2_s"):
        names[column] = column.removesuffix("_m_s").removesuffix("_m2_s")
    for column in OF_CRITERION:
        if column in rows[0]:
            names[column] = column
    rows = _rounded(rows)
    law_count = len({row["law"] for row in rows})
    records = []
    for start in range(0, len(rows), law_count):
        records.append(_record(rows[start : start + law_count], names))
    text = json.dumps(records if len(records) > 1 else records[0])
    # JSON has neither NaN nor Infinity
    return json.dumps(json.loads(text, parse_constant=lambda _: None), indent=2)


def _rounded(rows: Sequence["Row"]) -> list["Row"]:
    """Rows whose numbers have nine digits."""
    from orchestrator import digits

    written = []
    for row in rows:
        copy: Row = {}
        for column, value in row.items():
            copy[column] = digits.rounded(value) if isinstance(value, float) else value
        written.append(copy)
    return written


def _record(of_laws: Sequence["Row"], names: Mapping[str, str]) -> "Row":
    """The record of one point, with the rows of its laws."""
    from orchestrator.physics.threshold import LAWS_OF

    first = of_laws[0]
    record: Row = {}
    record["input"] = {
        name: first[each.column]
        for name, each in PARAMETERS.items()
        if each.column in first
    }
    record["regime"] = first["regime"]
    record["paper"] = list(LAWS_OF[first["regime"]])
    record["answer"] = [row["law"] for row in of_laws if row["answer"]]
    for row in of_laws:
        record[row["law"]] = {name: row[column] for column, name in names.items()}
    return record


def as_text(
    rows: Sequence["Row"],
    asked: str,
    varied: Sequence[str],
    fluid: str | None,
) -> Iterator[str]:
    """Write lines for people.

    Parameters
    ----------
    rows
        A row for each point and law, as `table.thresholds` has them.
    asked
        The force law that was asked for, ``auto`` or ``paper``.
    varied
        The parameters that are ranges, keys of `PARAMETERS`.
    fluid
        Name of the fluid; None of one by its numbers.

    Yields
    ------
    str
        Of one point the answer, with the marks of `terminal.bold`, and every law, of
        many points the rows of the answer.
    """
    if varied:
        yield from _of_many(rows, asked, varied)
    else:
        yield from _of_one(rows)
    fluids = {(row["rho_f_kg_m3"], row["nu_m2_s"]) for row in rows}
    if fluid and len(fluids) == 1:
        from orchestrator.digits import plain_number

        ((density, viscosity),) = fluids
        name = "the paper's gas (real air: --fluid air)" if fluid == PAPER else fluid
        kinematic = plain_number(viscosity, 5)
        yield f"{name}: {density:g} kg/m³, {kinematic} m²/s"
    liquid = [row for row in rows if row["rho_f_kg_m3"] >= GAS_BELOW]
    if any(_is_nan(row["depth_m"]) for row in liquid):
        yield "for the mean velocity of the liquid give its depth, --depth in m"


def _of_one(rows: Sequence["Row"]) -> Iterator[str]:
    """The answer card of one point, a table of laws, and the terms of its heads."""
    from orchestrator.calculator.answer import grain_card, nearest
    from orchestrator.physics.threshold import LAWS_OF
    from orchestrator.report import single
    from orchestrator.report.card import marked_lines
    from orchestrator.report.subjects import TERMS

    chosen = [row for row in rows if row["answer"]]
    yield from marked_lines(grain_card(rows))
    if "decides" in chosen[0]:
        yield ""
        yield from _criteria(chosen)
    if not _is_nan(chosen[0]["mean_velocity_m_s"]):
        yield ""
        yield from _of_channel(chosen[0])
    yield ""
    quantities = _quantities(rows)
    heads = {"law": "force law"}
    for column in SHOWN:
        if column in quantities:
            heads[column] = quantities[column]
    ordered = sorted(rows, key=_place)
    near = nearest(rows)
    marks = []
    for row in ordered:
        said = ["answer"] if row["answer"] else []
        said += ["nearest"] if row["law"] == near else []
        marks.append(f"<- {', '.join(said)}" if said else "")
    yield from _as_table(ordered, heads, marks)
    if near:
        is_formula = single.is_by_formula(ordered[0])
        beside = "the formula" if is_formula else "the measurements"
        yield f"Nearest: of the laws that hold, the nearest to {beside}."
    yield ""
    for term in TERMS.values():
        yield from _wrapped(f"{term[:1].upper()}{term[1:]}.")
    laws = " and ".join(LAWS_OF[rows[0]["regime"]])
    yield f"Laws of the article's rule: {laws}."


def _place(row: "Row") -> tuple[bool, bool, float]:
    """Place of a law in the table: the answer, those that hold, the strongest."""
    return not row["answer"], not row["valid"], -row["ustar_m_s"]


def _criteria(chosen: Sequence["Row"]) -> Iterator[str]:
    """Both criteria of sustained motion, and which of them controls, for each law."""
    for row in chosen:
        of_law = f"{row['law']}: " if len(chosen) > 1 else ""
        dislodged, sustained, ceases, low, high = (
            _cell(row[f"shields_{name}"])
            for name in (
                "entrained",
                "sustained",
                "cessation",
                "sustained_low",
                "sustained_high",
            )
        )
        controls = "Sustained motion controls"
        if row["decides"] == ENTRAINED:
            controls = "Entrainment controls"
        yield from _wrapped(
            f"{of_law}{controls}: dislodgement by a gust at θ = {dislodged} of the "
            f"mean flow, continued motion at {sustained} ({low} … {high}: a quarter of "
            "the grains over half of the way, three quarters over twice the way), "
            f"cessation below {ceases}."
        )


def _wrapped(text: str) -> list[str]:
    """A text in lines of a terminal."""
    from orchestrator.report.card import WIDTH

    return textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def _of_channel(row: "Row") -> Iterator[str]:
    """The mean velocity and the discharge by several roughnesses of a channel.

    The depth is one, that of the answer.
    """
    from orchestrator.digits import plain_number
    from orchestrator.report.card import apart
    from orchestrator.report.lines import head_width, table

    def cells(words: str, roughness: float, speed: float, interval: str) -> list[str]:
        discharge = speed * row["depth_m"]
        numbers = [f"{number:.3g}" for number in (speed, discharge)]
        length = "-" if _is_nan(roughness) else plain_number(roughness)
        return [words, length, *numbers, interval]

    ends = [row[f"discharge{end}_m2_s"] for end in ("_low", "_high")]
    has_interval = not any(map(_is_nan, ends))
    interval = apart(ends[0], ends[1], 2, "g") if has_interval else "-"
    channel = row[CHANNEL]
    rows = [cells("the answer", channel, row["mean_velocity_m_s"], interval)]
    roughnesses = (row["d84_m"] / 10, math.nan, row["z0_m"])
    for (column, words), roughness in zip(
        BESIDE_CHANNEL.items(), roughnesses, strict=True
    ):
        rows.append(cells(words, roughness, row[column], ""))
    heads = ["channel", "z₀, m", "mean velocity, m/s", "discharge, m²/s", "interval"]
    widths = [
        max(head_width(head), *map(len, column))
        for head, column in zip(heads, zip(*rows, strict=True), strict=True)
    ]
    yield from table(rows, heads, widths)
    d84 = row["d84_m"]
    of_grain = ", taken for d (--d84)" if d84 == row["d_m"] else ""
    yield f"depth {row['depth_m']:.3g} m, d84 {d84:.3g} m{of_grain}"
    said = "All of the stress is taken to act on the grains: where ripples, bars or "
    said += "plants take a part of it, motion starts at a higher velocity."
    yield from textwrap.wrap(said, 79)


def _of_many(rows: Sequence["Row"], asked: str, varied: Sequence[str]) -> Iterator[str]:
    """The rows of the answer for many points."""
    chosen = [row for row in rows if row["answer"]]
    laws = list(dict.fromkeys(row["law"] for row in chosen))
    if asked == "paper":
        yield "The paper's rule"
    else:
        yield f"Force law {' and '.join(sorted(laws, key=len))}"
    heads = {PARAMETERS[name].column: PARAMETERS[name].label for name in varied}
    if asked == "paper" or len(laws) > 1:
        heads["law"] = "force law"
    depths = {row["depth_m"] for row in chosen if not _is_nan(row["depth_m"])}
    if len(depths) > 1:
        # those of a river of one slope
        heads["depth_m"] = PARAMETERS["depth"].label
    if "decides" in rows[0]:
        heads["decides"] = OF_CRITERION["decides"]
    heads |= _quantities(rows)
    if "decides" in rows[0]:
        heads |= OF_CRITERION
    heads["measured_median"] = "measured"
    heads["formula_shields"] = "formula"
    yield from _as_table(chosen, heads)


def _quantities(rows: Sequence["Row"]) -> dict[str, str]:
    """The labels of the quantities that some row has, by column."""
    labels = {}
    for column, (_, label) in QUANTITIES.items():
        if not all(_is_nan(row[column]) for row in rows):
            labels[column] = label
    if "mean_velocity_m_s" in labels:
        labels.pop("current_1m_m_s", None)
    return labels


def _whether_it_holds(row: "Row") -> str:
    """Whether the law holds where the grain is entrained."""
    return "yes" if row["valid"] else "no"


def _as_table(
    rows: Sequence["Row"], heads: Mapping[str, str], marks: Sequence[str] = ()
) -> Iterator[str]:
    """Lines of a table that fit a terminal, with whether each law holds, and why not.

    Columns before the last that do not fit are named below it. `marks` are words
    behind the rows.
    """
    from orchestrator.report.card import WIDTH
    from orchestrator.report.lines import BETWEEN, head_width, table

    columns = [[heads[name], *(_cell(row[name]) for row in rows)] for name in heads]
    columns = [
        column
        for name, column in zip(heads, columns, strict=True)
        if name not in TOO_MANY
    ]
    reasons: dict[str, int] = {}
    holds = ["holds"]
    for row in rows:
        word = _whether_it_holds(row)
        if not row["valid"]:
            where = "at entrainment: " if row.get("decides") == SUSTAINED else ""
            why = f"{where}{row['why_not']}"
            number = reasons.setdefault(why, len(reasons) + 1)
            word = f"{word} ({number})"
        holds.append(word)
    last = [holds, ["", *marks]] if any(marks) else [holds]

    def widths(shown: Sequence[Sequence[str]]) -> list[int]:
        return [max(head_width(each[0]), *map(len, each[1:])) for each in shown]

    left_out = []
    while sum(widths([*columns, *last])) + BETWEEN * len([*columns, *last[1:]]) > WIDTH:
        left_out.append(columns.pop()[0])
    shown = [*columns, *last]
    cells = [list(row) for row in zip(*(each[1:] for each in shown), strict=True)]
    yield from table(cells, [each[0] for each in shown], widths(shown))
    if left_out or reasons:
        yield ""
    if left_out:
        names = "; ".join(reversed(left_out))
        yield from _wrapped(f"Not shown: {names} (--csv has every column).")
    for text, number in reasons.items():
        yield from _wrapped(f"({number}) The law does not hold: {text}.")


def _cell(value: float | str) -> str:
    """A number of three digits, a dash for NaN, or a text as it is."""
    if isinstance(value, str):
        return value
    return "-" if _is_nan(value) else f"{value:.3g}"


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)
