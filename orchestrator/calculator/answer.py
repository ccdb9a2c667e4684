"""The answer card of one grain for the command `threshold`, from rows of all laws."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.threshold import SingleGrain, thresholds_of
from orchestrator.report import single
from orchestrator.report.card import Card

if TYPE_CHECKING:  # this loads numpy
    from orchestrator.types import Row


def card(rows: Sequence["Row"]) -> Card:
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
    holding = {row["law"]: row["ustar_m_s"] for row in rows if row["valid"]}
    made = single.card(as_row(chosen), holding)
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
        With the computed and the measured friction velocity of the grain on a level
        bed, m/s.
    """
    density = row["rho_f_kg_m3"]
    weight = (row["rho_sol_kg_m3"] - density) * row["g_m_s2"] * row["d_m"]
    level = row["ustar_m_s"]
    if row["alpha_deg"] > 0:
        # of either criterion: a slope changes what it takes to leave the pocket
        here = SingleGrain.of_row(row)
        flat = replace(here, slope_deg=0.0)
        on_slope, on_level = thresholds_of(row["law"], [here, flat])
        level *= float(on_level.friction_velocity / on_slope.friction_velocity)
    theta = row["measured_curve"]
    if density >= GAS_BELOW and row["measured_rows"] > 0:
        theta = row["measured_median"]
    return {
        **row,
        "bed": "grain",
        "usable": row["valid"],
        "ustar0_m_s": row["ustar_m_s"],
        "level_ustar_m_s": level,
        "measured_level_ustar_m_s": math.sqrt(theta * weight / density),
    }


def nearest(rows: Sequence["Row"]) -> str:
    """Name the law that holds and is nearest to the measured threshold.

    Parameters
    ----------
    rows
        The rows of one point.

    Returns
    -------
    str
        Its name; empty if no law holds.
    """
    holding = [as_row(row) for row in rows if row["valid"]]
    if not holding:
        return ""

    def off(row: "Row") -> float:
        ratio = row["level_ustar_m_s"] / row["measured_level_ustar_m_s"]
        return abs(math.log(ratio))

    return str(min(holding, key=off)["law"])
