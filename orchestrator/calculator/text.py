"""Thresholds in words and columns, for people."""

from collections.abc import Iterable, Iterator, Sequence

import pandas as pd

from orchestrator.calculator.parameters import Parameter
from orchestrator.calculator.table import PAPER, QUANTITIES, WINDS, Quantity

RULE = {
    "low": "Eq. 2 (low), since Re* is below 3",
    "high": "Eq. 4 (high), since Re* is not below 30",
    "transition": "both Eq. 2 (low) and Eq. 4 (high), since neither holds",
}
"""Laws that the paper's rule picks in each regime."""
GIVE_DEPTH = "for the mean velocity of the liquid give its depth, --depth in m"
FORCES = ("drag", "lift")
GAP = "  "


def single(table: pd.DataFrame, answer: str) -> str:
    """One point: the answer, every law beside it, the paper's rule."""
    chosen, rest = table[table["answer"]], table[~table["answer"]]
    lines = [
        f"{_name(answer)}: a grain of {table['d_m'].iloc[0] * 1000:.4g} mm starts to move at",
        *_answer(chosen),
        *_others(chosen, rest),
        "",
        *_rows(pd.concat([chosen, rest]), {"law": "force law"}, leave_out=WINDS[:1]),
        "",
        f"paper's rule: {RULE[table['regime'].iloc[0]]}",
        *_without_depth(table),
    ]
    return "\n".join(lines)


def several(table: pd.DataFrame, answer: str, varied: Sequence[Parameter]) -> str:
    """Many points: a row for each, of the answer's law; of both equations if the paper says so."""
    labels = {parameter.column: parameter.label for parameter in varied}
    first = {**labels, "law": "force law"} if answer == PAPER else labels
    rows = _rows(table[table["answer"]], first)
    return "\n".join([_name(answer), *rows, *_without_depth(table)])


def _name(answer: str) -> str:
    return "The paper's rule" if answer == PAPER else f"Force law {answer}"


def _answer(chosen: pd.DataFrame) -> Iterator[str]:
    """The quantities one below the other; by the paper's rule there may be two laws of them."""
    if len(chosen) > 1:
        yield f"{GAP}{'':<20}{''.join(f'{law:<12}' for law in chosen['law'])}".rstrip()
    for one in _shown(chosen):
        numbers = "".join(f"{_number(value):<12}" for value in chosen[one.column])
        yield f"{GAP}{_header(one):<20}{numbers}".rstrip()
    for law, why in zip(chosen["law"], chosen["why_not"], strict=True):
        if why:
            yield f"{GAP}outside the range of {law}: {why}"


def _others(chosen: pd.DataFrame, rest: pd.DataFrame) -> Iterator[str]:
    """Laws that hold if the answer's does not."""
    if not chosen["valid"].any():
        yield f"{GAP}laws that hold here: {', '.join(rest.loc[rest['valid'], 'law'])}"


def _rows(
    table: pd.DataFrame, first: dict[str, str], leave_out: Sequence[Quantity] = ()
) -> Iterator[str]:
    """A line for each row: some columns first, the quantities, whether the law holds."""
    shown = [one for one in _shown(table) if one.name not in FORCES and one not in leave_out]
    columns = [
        *([label, *map(_number, table[name])] for name, label in first.items()),
        *([_header(one), *map(_number, table[one.column])] for one in shown),
        ["holds", *(f"no: {why}" if why else "yes" for why in table["why_not"])],
    ]
    widths = [max(map(len, column)) for column in columns]
    for cells in zip(*columns, strict=True):
        padded = (f"{cell:<{width}}" for cell, width in zip(cells, widths, strict=True))
        yield GAP.join(padded).rstrip()


def _shown(table: pd.DataFrame) -> Iterable[Quantity]:
    """The quantities that there are in this fluid."""
    return [one for one in QUANTITIES if table[one.column].notna().any()]


def _header(one: Quantity) -> str:
    return f"{one.label}, {one.unit}" if one.unit else one.label


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _without_depth(table: pd.DataFrame) -> list[str]:
    liquid = table["wind_1m_m_s"].isna() & table["mean_velocity_m_s"].isna()
    return [GIVE_DEPTH] if liquid.any() else []
