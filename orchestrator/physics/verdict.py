"""Whether a threshold may be used, with the reasons against it as data.

The command `threshold` and the tables of a study ask the same functions.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from orchestrator.digits import percent
from orchestrator.physics.beside import (
    COMPARED_WITH,
    ENTRAINED,
    FORMULA,
    LIKE,
    MOST_COHESION,
    MOST_SLOPE_DEG,
    SUSTAINED,
)
from orchestrator.physics.curves import GAMMA
from orchestrator.physics.fluids import is_gas, is_like_paper
from orchestrator.physics.threshold import LAWS_OF
from orchestrator.physics.velocity import LAMINAR_BELOW, laminar

Word = Literal[
    "usable", "usable, with a correction", "usable, to compare", "not usable"
]
"""What an answer is worth."""
USABLE: Word = "usable"
CORRECTED: Word = "usable, with a correction"
COMPARED: Word = "usable, to compare"
"""No measurement is near: beds may be compared with each other."""
UNUSABLE: Word = "not usable"
MOST_CORRECTION = 2.0
"""Factor from the friction velocity beside it up to which an answer may be corrected.
The tested intervals of the usual roughness reach as far: 0.21 to 3.5 in the stress."""
SLOPE_TOLERANCE_DEG = 1e-6
"""By how much a slope may be beyond the steepest one, deg: round-off."""
EXPOSED_FROM = 0.25
"""Part of a grain over the tops of its neighbours from which it is exposed."""
Advised = Literal["model", "corrected", "both"]
"""Which of the two numbers beside each other a reader should take."""
MODEL: Advised = "model"
WITH_MEASURED: Advised = "corrected"
BOTH: Advised = "both"
"""Of the article's gas and laws, with which models are compared."""
ADVISED: Mapping[str, str] = {
    "advised": (
        "which number the page advises, one for all rows of a study: model, the "
        "computed one; corrected, the one with a measured critical Shields number or "
        "that of a formula (columns compared_...), where it corrects a usable row; "
        "both, of the article's gas and laws, and where some rows have no such number"
    ),
}
"""The column of `advised`."""
NOT_REACHED = "not reached: the grain has not moved"
"""Why a grain has no threshold."""
COLUMNS: Mapping[str, str] = {
    "usable": "whether why_not is empty",
    "verdict": (
        "what the threshold is worth: usable, within what was measured; with a "
        "correction, to the measured value or that of a formula; to compare, where "
        "neither is near; not usable"
    ),
    "reason": (
        "a word for each thing that speaks against the use of the threshold, for "
        "programs"
    ),
    "why_not": "what speaks against the use of the threshold; empty if nothing does",
    "remedy": "what helps against that",
}
"""Columns of a verdict."""


class Reason(NamedTuple):
    """What speaks against the use of a threshold.

    Attributes
    ----------
    code
        A word that programs read.
    text
        What it is, for people.
    remedy
        What helps; empty where nothing does.
    """

    code: str
    text: str
    remedy: str = ""


def of_grain(row: Mapping[Any, Any], of_law: Iterable[Reason]) -> Iterator[Reason]:
    """Find what speaks against the threshold of a grain, or of such a grain in a bed.

    Parameters
    ----------
    row
        The threshold with the columns of its scene and those of `beside`;
        `standing_out`, the part of it above its neighbours; and `flow_reynolds`, that
        of the flow.
    of_law
        What its force law has against it.

    Yields
    ------
    Reason
        The reasons.
    """
    if not math.isfinite(row["reynolds"]) and "count" not in row:
        yield Reason("not reached", NOT_REACHED)
    yield from of_law
    standing_out = row["standing_out"]
    if standing_out <= 0:
        yield Reason("hidden", "hidden grain: it lies below the tops of its neighbours")
    elif standing_out < EXPOSED_FROM:
        part = f"{percent(standing_out)} of it stands out of its neighbours"
        yield Reason("hidden", f"hidden grain: {part}")
    if row["flow_reynolds"] < LAMINAR_BELOW:
        yield Reason("laminar", laminar(row["flow_reynolds"]))


def of_measurements(row: Mapping[Any, Any], is_closed: bool) -> Iterator[Reason]:
    """Find what measurements have against a threshold.

    Parameters
    ----------
    row
        The threshold, as `of_grain` takes it, with the friction velocities of one grain
        on a level bed, computed and compared with.
    is_closed
        Whether it is of the closed form.

    Yields
    ------
    Reason
        The reasons.
    """
    if not math.isfinite(row["reynolds"]):
        return
    is_sustained = row.get("criterion") == SUSTAINED
    if is_closed and is_sustained and not row["tested_rows"] > 0:
        at = f"at Re* {row['reynolds']:.3g}"
        what = f"nothing was measured near such grains {at}"
        if row["measured_rows"] > 0:
            # rows of that Re*, but no interval for the angle, z0, slope or densities
            what = f"no interval was tested for beds and densities like these {at}"
        yield Reason("not measured", what)
    if is_sustained:
        yield from _held_by_cohesion(row)
        yield from _too_steep(row)
    # measured are grains among their like
    size = row.get("relative_size")
    is_other = size is not None and abs(size - 1) > LIKE
    off = correction(row)
    if off > MOST_CORRECTION and not is_other:
        computed, other = row["level_ustar_m_s"], row["compared_level_ustar_m_s"]
        what = f"one grain on a level bed has a friction velocity of {computed:.3g} m/s"
        source, remedy = "measured is", "take the measured value"
        if row.get(COMPARED_WITH) == FORMULA:
            source, remedy = "the formula gives", "take the value of the formula"
        what = f"{what}, {source} {other:.3g} m/s: more than {MOST_CORRECTION:g}"
        yield Reason("correction", f"{what} times off", remedy)


def _held_by_cohesion(row: Mapping[Any, Any]) -> Iterator[Reason]:
    """Why a grain in a gas is held by a cohesion that its scene leaves out."""
    if not is_gas(row["rho_f_kg_m3"]):
        return
    left_out = 1 - row["cohesion_n_m"] / MOST_COHESION
    pull = GAMMA * left_out / row["d_m"]
    weight = row["rho_sol_kg_m3"] * row["g_m_s2"] * row["d_m"]
    if pull > weight:
        times = f"{pull / weight:.2g} times its weight"
        what = f"cohesion holds such a grain by {times}"
        what = f"{what} (by the formula of Shao and Lu 2000 for dry grains in air)"
        yield Reason("cohesion", what, f"give a cohesion of {MOST_COHESION:g} N/m")


def _too_steep(row: Mapping[Any, Any]) -> Iterator[Reason]:
    """Why sustained motion is not known on a slope beyond those of its table."""
    slope = float(row["alpha_deg"])
    if abs(slope) > MOST_SLOPE_DEG + SLOPE_TOLERANCE_DEG:
        what = f"sustained motion was found on slopes of up to {MOST_SLOPE_DEG:g}°"
        what = f"{what}; it is extrapolated to {slope:g}°"
        yield Reason("slope", what, f'ask for the criterion "{ENTRAINED}"')


def correction(row: Mapping[Any, Any]) -> float:
    """Find how far the computed threshold of one grain is from that beside it.

    Parameters
    ----------
    row
        The threshold, with both friction velocities on a level bed.

    Returns
    -------
    float
        The factor between them, at least 1; NaN where one is not known.
    """
    ratio = float(row["level_ustar_m_s"]) / float(row["compared_level_ustar_m_s"])
    return math.exp(abs(math.log(ratio))) if 0 < ratio < math.inf else math.nan


def is_measured(row: Mapping[Any, Any]) -> bool:
    """Say whether a threshold is within what was measured.

    Parameters
    ----------
    row
        The threshold, with the columns of `beside` and the friction velocities of one
        grain on a level bed, computed and compared with.

    Returns
    -------
    bool
        Whether rows were measured beside it, it lies inside its tested interval, which
        ends at the answer where all that was measured is on one side of it, and one
        grain on a level bed is as measured: in a liquid within 80 % of the rows of
        flumes or between them and the formula, else its interval contains the value
        of the formula.
    """
    theta = float(row["shields"])
    has_interval = row["tested_rows"] > 0
    inside = 1 + LIKE
    if has_interval and not (
        row["tested_low"] * inside < theta < row["tested_high"] / inside
    ):
        return False
    computed = float(row["level_ustar_m_s"])
    has_rows = row["measured_rows"] > 0
    if has_interval and (is_gas(row["rho_f_kg_m3"]) or not has_rows):
        over = float(row["compared_level_ustar_m_s"]) / computed
        return bool(row["tested_low"] <= theta * over**2 <= row["tested_high"])
    if not has_rows:
        return False
    ends = (row["measured_low"], row["measured_high"], row["formula_shields"])
    # as `Grain.shields`, whose arrays take a hundred times as long for one number
    stress = row["rho_f_kg_m3"] * computed**2
    excess = row["rho_sol_kg_m3"] - row["rho_f_kg_m3"]
    level = stress / (excess * row["g_m_s2"] * row["d_m"])
    return bool(min(ends) <= level <= max(ends))


def verdict(row: Mapping[Any, Any], reasons: Sequence[Reason]) -> Word:
    """Say what a threshold is worth.

    Parameters
    ----------
    row
        The threshold, as `is_measured` takes it.
    reasons
        What speaks against it.

    Returns
    -------
    str
        Not usable for any reason; usable where it is within what was measured; with a
        correction where a measured value is near; else to compare.
    """
    if reasons:
        return UNUSABLE
    if is_measured(row):
        return USABLE
    return COMPARED if math.isnan(correction(row)) else CORRECTED


def texts(reasons: Iterable[Reason]) -> str:
    """Join what reasons are, for people.

    Parameters
    ----------
    reasons
        The reasons.

    Returns
    -------
    str
        Their texts.
    """
    return "; ".join(each.text for each in reasons)


BETWEEN = "; "
"""Between the codes of several reasons, in their column."""


def columns(
    rows: Iterable[Mapping[Any, Any]], reasons: Iterable[Sequence[Reason]]
) -> dict[str, list[Any]]:
    """Make the columns of the verdicts on thresholds.

    Parameters
    ----------
    rows
        The thresholds, as `is_measured` takes them.
    reasons
        What speaks against each.

    Returns
    -------
    dict of str to list
        The `COLUMNS`.
    """
    made: dict[str, list[Any]] = {name: [] for name in COLUMNS}
    for row, against in zip(rows, reasons, strict=True):
        made["usable"].append(not against)
        made["verdict"].append(verdict(row, against))
        codes = dict.fromkeys(each.code for each in against)
        made["reason"].append(BETWEEN.join(codes))
        made["why_not"].append(texts(against))
        remedies = dict.fromkeys(each.remedy for each in against if each.remedy)
        made["remedy"].append("; ".join(remedies))
    return made


def codes_of(reason: object) -> set[str]:
    """Read the codes of a cell of the column `reason`.

    Parameters
    ----------
    reason
        The cell, as `columns` makes it.

    Returns
    -------
    set of str
        The codes; none where nothing speaks against the threshold.
    """
    return {*filter(None, str(reason).split(BETWEEN))}


def advised(rows: Iterable[Mapping[Any, Any]]) -> Advised:
    """Choose which number of each threshold of a study a reader should take.

    Parameters
    ----------
    rows
        All thresholds of the study, with their verdicts, the columns of their grains
        and fluids, and the friction velocity of one grain on a level bed as measured.

    Returns
    -------
    str
        One for all of them, so that rows can be compared: the model's, unless it is
        corrected at one of them; both of the article's gas and laws, and where a
        usable row cannot be corrected.
    """
    usable = [row for row in rows if row["verdict"] != UNUSABLE]
    has_other = [row["compared_level_ustar_m_s"] > 0 for row in usable]
    if any(map(_is_of_article, usable)) and any(has_other):
        return BOTH
    if not any(row["verdict"] == CORRECTED for row in usable):
        return MODEL
    return WITH_MEASURED if all(has_other) else BOTH


def _is_of_article(row: Mapping[Any, Any]) -> bool:
    """Whether a threshold is of the article's gas, or by its laws."""
    fluid = float(row["rho_f_kg_m3"]), float(row["nu_m2_s"])
    return is_like_paper(*fluid) or row["force_law"] in LAWS_OF["transition"]
