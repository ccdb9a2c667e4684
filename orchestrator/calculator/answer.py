"""The answer card of one grain for the command `threshold`, from rows of all laws."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from orchestrator.physics.verdict import correction
from orchestrator.report import single
from orchestrator.report.card import Card

if TYPE_CHECKING:  # this loads numpy
    from orchestrator.types import Row


def grain_card(rows: Sequence["Row"]) -> Card:
    """Make the answer card of one point.

    Parameters
    ----------
    rows
        A row for each law, as `table.thresholds` has them.

    Returns
    -------
    Card
        Of the first law that answers; its interval is the tested one, or the range of
        the laws that hold.
    """
    chosen = next(row for row in rows if row["answer"])
    made = single.single_card(as_row(chosen))
    holding = [row["law"] for row in rows if row["valid"]]
    if chosen["valid"] or not holding:
        return made
    laws = ", ".join(f"--law {name}" for name in holding)
    return replace(made, worth=replace(made.worth, advice=f"Choose {laws}."))


def as_row(row: "Row") -> "Row":
    """Add to a row what a row of a study's table has beside it.

    Parameters
    ----------
    row
        A row of the command.

    Returns
    -------
    dict
        With the kind of its bed, the flow over it, and its force law.
    """
    more = {"ustar0_m_s": row["ustar_m_s"], "force_law": row["law"]}
    return {**row, "bed": "grain", **more}


def nearest(rows: Sequence["Row"]) -> str:
    """Name the law that holds and is nearest to the measured threshold.

    Parameters
    ----------
    rows
        The rows of one point.

    Returns
    -------
    str
        Its name; empty if no law holds, or nothing was measured near.
    """
    holding = [row for row in rows if row["valid"] and correction(row) >= 1]
    if not holding:
        return ""
    return str(min(holding, key=correction)["law"])
