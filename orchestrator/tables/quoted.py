"""Thresholds in the units that a report quotes: speeds and stresses, with intervals.

A threshold has one interval, which is made here: page, card, figures and texts read it.
Beside each stands what it is compared with: the same flow, with the threshold of one
grain on a level bed by flumes or by a formula in place of the computed one.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.physics.beside import (
    COMPARED_WITH,
    ENTRAINED,
    compared_level_ustar,
    compared_with,
)
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.onset import of_grains
from orchestrator.physics.reported import (
    CHOICES,
    MEASURED,
    NUMERICAL,
    SEEDS,
    Interval,
    compared_columns,
    compared_range,
    has_no_law,
    in_units,
    tested_word,
)
from orchestrator.physics.verdict import ADVISED, advised
from orchestrator.study.shapes import SHAPES
from orchestrator.tables.columns import several
from orchestrator.tables.facts import needs_run
from orchestrator.types import BoolArray, FloatArray

ENDS = ("_low", "_high")
"""Endings of the columns of an interval, before the unit."""
OF_PILE = ("shields_numerical_low", "shields_numerical_high")
OF_GRAIN = ("shields_dem_low", "shields_dem_high")
"""Columns of the ends of the numerical interval of a Shields number."""
OF_CHOICES = ("shields_model_low", "shields_model_high")
"""Columns of its ends by the choices that all methods share."""
OF_FIRST = ("first_ustar0_numerical_low_m_s", "first_ustar0_numerical_high_m_s")
"""The same of the friction velocity at which motion starts."""


class _Ends(NamedTuple):
    """The ends of the intervals of n values, NaN where one is not known."""

    low: FloatArray
    high: FloatArray


QUOTED: Mapping[str, str] = {
    "stress_pa": (
        "stress of the undisturbed flow on the bed at the threshold, rho_f u*0^2"
    ),
    **several("ustar0_m_s"),
    "shields_low": (
        "lower end of the interval of shields, the one that page, card and figures "
        "have, see interval_of; of replicates it holds all of them"
    ),
    "shields_high": (
        "upper end of this interval; empty where it is open: beside a lower end, as of "
        "a fraction that a bed does not reach"
    ),
    "interval_of": (
        "what the interval of the threshold in all its units is of: measured "
        "thresholds, in a gas field sites and a formula (tested_low, tested_high), "
        "else numerical (shields_numerical_low, "
        "shields_numerical_high; of a single grain its load step), numerical and "
        "choices where it also holds the choices that all methods share "
        "(shields_model_low, shields_model_high), else seeds: the "
        "range of replicates, where no error is known; of a usable single grain "
        "without these force laws: the range of those that hold"
    ),
    "ustar0_low_m_s": (
        "lower end of the interval of ustar0_m_s: that of shields, whose root it goes "
        "with; see interval_of"
    ),
    "stress_low_pa": "lower end of the interval of stress_pa",
    "wind_10m_low_m_s": "lower end of the interval of wind_10m_m_s",
    "mean_velocity_low_m_s": "lower end of the interval of mean_velocity_m_s",
    "ustar0_high_m_s": "upper end of this interval",
    "stress_high_pa": "upper end of the interval of stress_pa",
    "wind_10m_high_m_s": "upper end of the interval of wind_10m_m_s",
    "mean_velocity_high_m_s": "upper end of the interval of mean_velocity_m_s",
    "level_ustar_m_s": (
        "friction velocity at which one grain on a level bed starts to move by the "
        "force law, closed form"
    ),
    "compared_level_ustar_m_s": (
        "the same to compare it with: the median of the flumes at this Re*, else that "
        "of formula_shields"
    ),
    COMPARED_WITH: (
        "which of the two the columns compared_level_ustar_m_s, compared_ustar0_m_s "
        "and compared_first_ustar0_m_s are, in all their units: flumes, measured, or "
        "formula; empty without both"
    ),
    "compared_ustar0_m_s": (
        "undisturbed friction velocity of the same flow at the threshold, with "
        "compared_level_ustar_m_s of one grain in place of the computed threshold"
    ),
    "compared_stress_pa": "stress of that undisturbed flow on the bed",
    "compared_wind_10m_m_s": "wind of that flow 10 m above the bed",
    "compared_mean_velocity_m_s": "mean velocity of that flow over its depth",
    "measured_ustar0_low_m_s": (
        "the same as compared_ustar0_m_s with the threshold measured_low"
    ),
    "measured_stress_low_pa": "stress of the flow of measured_ustar0_low_m_s",
    "measured_wind_10m_low_m_s": "wind of the flow of measured_ustar0_low_m_s",
    "measured_mean_velocity_low_m_s": (
        "mean velocity of the flow of measured_ustar0_low_m_s"
    ),
    "measured_ustar0_high_m_s": (
        "the same as compared_ustar0_m_s with the threshold measured_high"
    ),
    "measured_stress_high_pa": "stress of the flow of measured_ustar0_high_m_s",
    "measured_wind_10m_high_m_s": "wind of the flow of measured_ustar0_high_m_s",
    "measured_mean_velocity_high_m_s": (
        "mean velocity of the flow of measured_ustar0_high_m_s"
    ),
}
"""Columns of `quoted`."""


def quoted(rows: pd.DataFrame, twins: "pd.Series[int] | None" = None) -> dict[str, Any]:
    """Compute the columns that reports quote.

    The interval of a threshold is the tested one, where thresholds of such beds were
    measured, else the numerical one with the range of the choices that all methods
    share, where it is known; of replicates it holds the
    intervals and the thresholds of all, and is open above if one does not reach the
    fraction. The ends of an interval of the Shields number are those of a stress: u*_0
    goes with its root. Values to compare are u*_0 times the ratio of the other
    friction velocity of one grain on a level bed to the computed one. On a level bed
    under its undisturbed flow every grain has the other threshold itself.

    Parameters
    ----------
    rows
        Thresholds of piles or of single grains, with the columns of their scenes and
        those of `beside`.
    twins
        A number that thresholds share whose beds are replicates; by default
        there are none.

    Returns
    -------
    dict of str to ndarray
        Stress of the undisturbed flow, Pa; ends of the Shields number, of u*_0, of the
        wind at 10 m, of the mean velocity (m/s) and of that stress, and what they are
        of; the flow that moves the first grain, in these units with its ends; the same
        with the threshold to compare with. NaN where there is none.
    """
    ustar = _ustar(rows)
    theta = rows["shields"].to_numpy(float)
    of_row = _interval(rows)
    held = _held(of_row, theta, twins)
    own = in_units(ustar, rows)
    columns: dict[str, Any] = {n: at for n, at in own.items() if n not in rows}
    columns |= {f"shields{end}": at for end, at in zip(ENDS, held, strict=True)}
    columns["interval_of"] = _named(rows, of_row, held, twins)
    ends = _held(_Ends(*(_rooted(ustar, at, theta) for at in of_row)), ustar, twins)
    for end, at in zip(ENDS, ends, strict=True):
        columns |= in_units(at, rows, end)
    if "first_ustar0_m_s" in rows:
        columns |= _first(rows, twins)
    of_grain = {
        "level_ustar_m_s": of_rows(rows.assign(alpha_deg=0.0))["ustar"],
        "compared_level_ustar_m_s": compared_level_ustar(rows),
        COMPARED_WITH: compared_with(rows),
    }
    columns |= of_grain
    rows = rows.assign(**of_grain)
    level = is_flat(rows)
    columns |= compared_columns(rows, ustar, level)
    if "first_ustar0_m_s" in rows:
        first = rows["first_ustar0_m_s"].to_numpy(float)
        columns |= compared_columns(rows, first, level, "first_")
    return columns


LAWS_OF_INTERVAL: Mapping[str, str] = {
    "interval_laws": (
        "number of force laws that hold whose range the interval is; empty of another "
        "interval"
    ),
}
"""The column that `with_laws` adds."""


def with_laws(
    rows: pd.DataFrame, columns: dict[str, Any], usable: BoolArray
) -> dict[str, Any]:
    """Give usable single grains without another interval the range of the force laws.

    Parameters
    ----------
    rows
        Thresholds of single grains, with the columns of their scenes.
    columns
        Those of `quoted`.
    usable
        Which are usable; an answer that is not has no range of laws.

    Returns
    -------
    dict of str to ndarray
        The columns with the range of the laws that hold, of those that take part in
        intervals; none where going on decides, which no law changes, or where the
        laws agree.
    """
    own = Interval(
        columns["ustar0_low_m_s"],
        columns["ustar0_high_m_s"],
        columns["interval_of"],
        np.full(len(rows), np.nan),
    )
    is_none = np.array([word is None for word in own.of], bool)
    asked = np.asarray(usable & is_none & ~has_no_law(rows, len(rows)))
    by_law = []
    for name, law in LAWS.items():
        if law.in_interval:
            ustar = np.full(len(rows), np.nan)
            holds = np.zeros(len(rows), bool)
            found = of_rows(rows[asked].assign(force_law=name))
            ustar[asked] = found["ustar"]
            holds[asked] = found["holds"]
            by_law.append((ustar, holds))
    return {**columns, **own.or_of_laws(by_law).columns(rows)}


ENDS_OF_COMPARED: Mapping[str, str] = {
    **ADVISED,
    "compared_ustar0_low_m_s": (
        "lower end of the interval of compared_ustar0_m_s: it holds that of "
        "ustar0_m_s, a numerical one in proportion, both numbers, and the ends of what "
        "was measured (measured_low, measured_high); of a threshold that is not usable "
        "these alone"
    ),
    "compared_stress_low_pa": "stress of the flow of compared_ustar0_low_m_s",
    "compared_wind_10m_low_m_s": "wind of the flow of compared_ustar0_low_m_s",
    "compared_mean_velocity_low_m_s": (
        "mean velocity of the flow of compared_ustar0_low_m_s"
    ),
    "compared_ustar0_high_m_s": "upper end of this interval; empty where it is open",
    "compared_stress_high_pa": "stress of the flow of compared_ustar0_high_m_s",
    "compared_wind_10m_high_m_s": "wind of the flow of compared_ustar0_high_m_s",
    "compared_mean_velocity_high_m_s": (
        "mean velocity of the flow of compared_ustar0_high_m_s"
    ),
}
"""Columns of `with_advice`, of all thresholds."""
ENDS_OF_COMPARED_FIRST: Mapping[str, str] = {
    "compared_first_ustar0_low_m_s": (
        "lower end of the interval of compared_first_ustar0_m_s, made as that of "
        "compared_ustar0_m_s"
    ),
    "compared_first_ustar0_high_m_s": (
        "upper end of this interval; empty where it is open"
    ),
    "compared_first_stress_low_pa": (
        "stress of the flow of compared_first_ustar0_low_m_s"
    ),
    "compared_first_stress_high_pa": (
        "stress of the flow of compared_first_ustar0_high_m_s"
    ),
    "compared_first_wind_10m_low_m_s": (
        "wind 10 m above the bed of the flow of compared_first_ustar0_low_m_s"
    ),
    "compared_first_wind_10m_high_m_s": (
        "wind 10 m above the bed of the flow of compared_first_ustar0_high_m_s"
    ),
    "compared_first_mean_velocity_low_m_s": (
        "mean velocity of the flow of compared_first_ustar0_low_m_s"
    ),
    "compared_first_mean_velocity_high_m_s": (
        "mean velocity of the flow of compared_first_ustar0_high_m_s"
    ),
}
"""Columns of `with_advice`, of beds."""


def with_advice(
    rows: pd.DataFrame,
    columns: Mapping[str, Any],
    verdicts: Mapping[str, Any],
    twins: "pd.Series[int] | None" = None,
) -> dict[str, Any]:
    """Add which number is advised, and the intervals of those to compare with.

    Parameters
    ----------
    rows
        All thresholds of a study, with the columns of their scenes and of `beside`.
    columns
        Those of `quoted`.
    verdicts
        Those of `verdict.columns`.
    twins
        As `quoted` takes it.

    Returns
    -------
    dict of str to ndarray
        The columns with those of `ENDS_OF_COMPARED`, and of beds with
        `ENDS_OF_COMPARED_FIRST`.
    """
    judged = rows.assign(**columns, **verdicts)
    usable = np.asarray(verdicts["usable"], bool)
    made: dict[str, Any] = {"advised": advised(judged.to_dict("records"))}
    flows = {"": _ustar(rows)}
    if "first_ustar0_m_s" in rows:
        flows["first_"] = rows["first_ustar0_m_s"].to_numpy(float)
    for which, ustar in flows.items():
        ends = _Ends(*compared_range(columns, ustar, usable, which))
        there = np.asarray(columns[f"compared_{which}ustar0_m_s"], float)
        for end, at in zip(ENDS, _held(ends, there, twins), strict=True):
            made |= in_units(at, rows, end, f"compared_{which}")
    return {**columns, **made}


def reported(rows: pd.DataFrame) -> pd.DataFrame:
    """Make the units of thresholds anew, after their friction velocities were merged.

    Parameters
    ----------
    rows
        Thresholds of piles with the columns of `quoted` and of their scenes.

    Returns
    -------
    DataFrame
        The rows, whose flows, computed or not, are those of ``ustar0_m_s`` and of
        ``first_ustar0_m_s`` in every unit.
    """
    changed: dict[str, FloatArray] = {}
    for stem in ("", "first_"):
        ustar = rows[f"{stem}ustar0_m_s"].to_numpy(float)
        changed |= in_units(ustar, rows, before=stem)
        changed |= compared_columns(rows, ustar, is_flat(rows), stem)
    return rows.assign(**changed)


def of_classes(classes: pd.DataFrame, thresholds: pd.DataFrame) -> pd.DataFrame:
    """Widen the intervals of the size classes of beds by those of the beds.

    Parameters
    ----------
    classes
        Thresholds of size classes, whose intervals are of load steps and chance alone.
    thresholds
        Those of the beds with their intervals.

    Returns
    -------
    DataFrame
        The classes with ends that hold, relative to the threshold, the interval of the
        bed; empty where that is open.
    """
    if classes.empty:
        return classes
    keys = ["scene_id", "fraction"]
    of_bed = ["shields", "shields_low", "shields_high"]
    beds = thresholds[[*keys, *of_bed]].drop_duplicates(keys)
    beside = classes[keys].merge(beds, on=keys, how="left", validate="many_to_one")
    value = classes["shields_own"].to_numpy(float)
    changed = {}
    for end, outer in (("low", np.minimum), ("high", np.maximum)):
        own = classes[f"shields_own_{end}"].to_numpy(float)
        over = (beside[f"shields_{end}"] / beside["shields"]).to_numpy(float)
        # an end that either of the two leaves open is not known
        changed[f"shields_own_{end}"] = outer(own, value * over)
    return classes.assign(**changed)


FIRST: Mapping[str, str] = {
    "first_stress_pa": (
        "stress of the undisturbed flow on the bed at which motion starts"
    ),
    "first_wind_10m_m_s": "wind 10 m above the bed at which motion starts",
    "first_mean_velocity_m_s": (
        "mean velocity of the undisturbed flow at which motion starts"
    ),
    "first_ustar0_low_m_s": (
        "lower end of the interval of first_ustar0_m_s: the tested one, else the "
        "numerical one; of replicates it holds all of them"
    ),
    "first_stress_low_pa": "lower end of the interval of first_stress_pa",
    "first_wind_10m_low_m_s": "lower end of the interval of first_wind_10m_m_s",
    "first_mean_velocity_low_m_s": (
        "lower end of the interval of first_mean_velocity_m_s"
    ),
    "first_ustar0_high_m_s": "upper end of this interval; empty where it is open",
    "first_stress_high_pa": "upper end of the interval of first_stress_pa",
    "first_wind_10m_high_m_s": "upper end of the interval of first_wind_10m_m_s",
    "first_mean_velocity_high_m_s": (
        "upper end of the interval of first_mean_velocity_m_s"
    ),
    "compared_first_ustar0_m_s": "the same of first_ustar0_m_s",
    "measured_first_ustar0_low_m_s": (
        "the same as compared_first_ustar0_m_s with the threshold measured_low"
    ),
    "measured_first_ustar0_high_m_s": (
        "the same as compared_first_ustar0_m_s with the threshold measured_high"
    ),
    "compared_first_stress_pa": "stress of the flow of compared_first_ustar0_m_s",
    "measured_first_stress_low_pa": (
        "stress of the flow of measured_first_ustar0_low_m_s"
    ),
    "measured_first_stress_high_pa": (
        "stress of the flow of measured_first_ustar0_high_m_s"
    ),
    "compared_first_wind_10m_m_s": (
        "wind 10 m above the bed of the flow of compared_first_ustar0_m_s"
    ),
    "measured_first_wind_10m_low_m_s": (
        "wind 10 m above the bed of the flow of measured_first_ustar0_low_m_s"
    ),
    "measured_first_wind_10m_high_m_s": (
        "wind 10 m above the bed of the flow of measured_first_ustar0_high_m_s"
    ),
    "compared_first_mean_velocity_m_s": (
        "mean velocity of the flow of compared_first_ustar0_m_s"
    ),
    "measured_first_mean_velocity_low_m_s": (
        "mean velocity of the flow of measured_first_ustar0_low_m_s"
    ),
    "measured_first_mean_velocity_high_m_s": (
        "mean velocity of the flow of measured_first_ustar0_high_m_s"
    ),
}
"""Columns of the flow that moves the first grain, beside those of its numbers."""


def _first(rows: pd.DataFrame, twins: "pd.Series[int] | None") -> dict[str, FloatArray]:
    """The flow that moves the first grain of each bed, with its ends, by column."""
    first = rows["first_ustar0_m_s"].to_numpy(float)
    theta = rows["shields"].to_numpy(float)
    is_tested = _is_tested(rows)
    squares = _Ends(*(rows[name].to_numpy(float) ** 2 for name in OF_FIRST))
    wide = _with_choices(rows, squares, first**2)
    ends = []
    for own, tested in zip(wide, ("tested_low", "tested_high"), strict=True):
        by_measured = _rooted(first, rows[tested].to_numpy(float), theta)
        ends.append(np.where(is_tested, by_measured, np.sqrt(own)))
    held = _held(_Ends(*ends), first, twins)
    columns: dict[str, FloatArray] = {}
    for end, at in {"": first, **dict(zip(ENDS, held, strict=True))}.items():
        columns |= in_units(at, rows, end, "first_")
    del columns["first_ustar0_m_s"]  # it is in the rows
    return columns


def _ustar(rows: pd.DataFrame) -> FloatArray:
    """Friction velocity of the undisturbed flow at each threshold, m/s."""
    if "ustar0_m_s" in rows:
        return rows["ustar0_m_s"].to_numpy(float)
    return np.where(needs_run(rows), rows["ustar_m_s"], rows["ustar_closed_form_m_s"])


def _is_tested(rows: pd.DataFrame) -> BoolArray:
    """Which thresholds have a tested interval."""
    return np.asarray((rows["tested_rows"] > 0) & rows["tested_low"].notna())


def _interval(rows: pd.DataFrame) -> _Ends:
    """The ends of the Shields number of each row by itself."""
    names = OF_PILE if OF_PILE[0] in rows else OF_GRAIN
    is_tested = _is_tested(rows)
    of_method = _Ends(*(rows[name].to_numpy(float) for name in names))
    wide = _with_choices(rows, of_method, rows["shields"].to_numpy(float))
    ends = []
    for own, tested in zip(wide, ("tested_low", "tested_high"), strict=True):
        ends.append(np.where(is_tested, rows[tested].to_numpy(float), own))
    return _Ends(*ends)


def _has_choices(rows: pd.DataFrame) -> BoolArray:
    """Which thresholds have a range of the choices that all methods share."""
    if OF_CHOICES[0] not in rows:
        return np.zeros(len(rows), bool)
    return rows[OF_CHOICES[0]].notna().to_numpy(bool)


def _with_choices(rows: pd.DataFrame, ends: _Ends, value: FloatArray) -> _Ends:
    """Numerical intervals of values that go with θ_c, which hold the choices as well.

    An end that is not known stays so.
    """
    has_choices = _has_choices(rows)
    if not has_choices.any():
        return ends
    theta = rows["shields"].to_numpy(float)
    low, high = (rows[name].to_numpy(float) / theta * value for name in OF_CHOICES)
    return _Ends(
        np.where(has_choices, np.minimum(ends.low, low), ends.low),
        np.where(has_choices, np.maximum(ends.high, high), ends.high),
    )


def _rooted(ustar: FloatArray, end: FloatArray, theta: FloatArray) -> FloatArray:
    """The friction velocity at an end of the interval of a Shields number, m/s."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(ustar * np.sqrt(end / theta))


def _held(ends: _Ends, value: FloatArray, twins: "pd.Series[int] | None") -> _Ends:
    """The intervals that hold those of all twins, and their values.

    Without any known end of one it is the range of the values. A value that is not
    known is that of a bed that does not reach the fraction: nothing is known above it.
    """
    if twins is None:
        return ends
    low, high = (np.asarray(end, float) for end in ends)
    has_ends = ~(np.isnan(low) & np.isnan(high))
    is_open_below = has_ends & np.isnan(low)
    is_open_above = (has_ends & np.isnan(high)) | np.isnan(value)
    each = pd.DataFrame(
        {
            "low": np.where(is_open_below, -np.inf, np.fmin(low, value)),
            "high": np.where(is_open_above, np.inf, np.fmax(high, value)),
        }
    )
    groups = each.groupby(twins.to_numpy())
    least = groups["low"].transform("min").to_numpy(float)
    most = groups["high"].transform("max").to_numpy(float)
    is_alone = groups["low"].transform("size").to_numpy() == 1
    return _Ends(
        np.where(is_alone, low, np.where(np.isfinite(least), least, np.nan)),
        np.where(is_alone, high, np.where(np.isfinite(most), most, np.nan)),
    )


def _named(
    rows: pd.DataFrame, of_row: _Ends, held: _Ends, twins: "pd.Series[int] | None"
) -> NDArray[Any]:
    """What each interval is of; None without one."""
    is_tested = _is_tested(rows)
    is_numerical = np.isfinite(of_row.low) | np.isfinite(of_row.high)
    if twins is not None:
        groups = twins.to_numpy()
        is_tested, is_numerical = (
            pd.Series(each).groupby(groups).transform("any").to_numpy(bool)
            for each in (is_tested, is_numerical)
        )
    is_known = np.isfinite(held.low) | np.isfinite(held.high)
    choices = [~is_known, is_tested, is_numerical & _has_choices(rows), is_numerical]
    names = np.array([None, MEASURED, CHOICES, NUMERICAL, SEEDS], object)
    first = np.argmax([*choices, np.ones(len(rows), bool)], axis=0)
    return np.asarray(np.where(first == 1, tested_word(rows), names[first]))


def of_rows(rows: pd.DataFrame) -> dict[str, Any]:
    """Find the threshold of one grain by each row's law, criterion and gusts.

    Parameters
    ----------
    rows
        Rows with the columns `GRAIN_COLUMNS` and ``force_law``; without ``criterion``
        grains leave their pockets, without ``gust`` the flow has none.

    Returns
    -------
    dict of str to ndarray
        Friction velocity of the mean flow on the slope of each row, that at which the
        grain leaves in a steady flow, m/s, and whether its law holds there, shape (n,).
    """
    found = {
        "ustar": np.full(len(rows), np.nan),
        "leaving": np.full(len(rows), np.nan),
        "holds": np.zeros(len(rows), bool),
    }
    criteria = np.full(len(rows), ENTRAINED, object)
    if "criterion" in rows:
        criteria = rows["criterion"].to_numpy(object)
    gust = np.full(len(rows), np.nan)
    if "gust" in rows:
        gust = rows["gust"].to_numpy(float)
    place = pd.Series(np.arange(len(rows)))
    keys = [rows["force_law"].to_numpy(object), criteria]
    for (law, criterion), places in place.groupby(keys):
        part = rows.iloc[places]
        at = of_grains(Grain.of_table(part), str(law), str(criterion), gust[places])
        found["ustar"][places] = at.friction_velocity
        found["leaving"][places] = at.leaving.friction_velocity
        found["holds"][places] = at.valid & np.isfinite(at.friction_velocity)
    return found


def is_flat(rows: pd.DataFrame) -> Any:
    """Tell which beds are level, so that their flow has one stress everywhere.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    ndarray
        Truth values, shape (n,).
    """
    if "bed_shape" not in rows:
        return np.zeros(len(rows), bool)
    level = [shape.name for shape in SHAPES.values() if shape.is_level]
    found = rows["bed_shape"].isin(level) & rows["profile"].isna()
    return found.to_numpy()
