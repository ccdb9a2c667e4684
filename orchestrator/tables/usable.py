"""Whether thresholds are usable, and their scatter over seeds."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.fidelity.decision import NOT_MEASURED
from orchestrator.flow.run import SPEED_HEIGHT
from orchestrator.grains.threshold import within
from orchestrator.physics import verdict
from orchestrator.physics.beside import SUSTAINED, TESTED_AS, beside
from orchestrator.physics.grain import Grain
from orchestrator.physics.onset import against_law
from orchestrator.physics.threshold import standing_out
from orchestrator.physics.velocity import open_water_reynolds
from orchestrator.physics.verdict import Reason
from orchestrator.study import fields
from orchestrator.study.methods import METHODS
from orchestrator.tables.check import Contradictions
from orchestrator.tables.columns import several
from orchestrator.tables.facts import needs_run, packs_grains
from orchestrator.tables.kinds import INTERLOCKED, tested_as
from orchestrator.tables.quoted import (
    OF_PILE,
    of_rows,
    quoted,
    with_advice,
    with_laws,
)
from orchestrator.types import Row

CARRIED_OFF = 0.1
"""Share of the moved grains from which a threshold is one of lift-off."""
KEPT_TO = 0.1
"""n/N to which a balance of the whole bed holds; at 0.3 theta is 2 to 3.5 times
that."""
SIMILAR = ["layout", "lifted", "alpha_deg", "force_law", "fraction"]
"""Piles that agree in these scatter alike: their grains lie alike, and lifted ones
collide or do not."""
ABOVE_TOLERANCE = "tolerance"
"""The reason against a threshold whose numerical error is above the tolerance."""
NOT_KNOWN = "error not known"
"""The reason against a threshold whose numerical error was not measured."""
Remedies = Mapping[tuple[str, float], str]
"""What helps against `NOT_KNOWN`, by the scene and the fraction."""
LAYOUTS = {"aligned": "rows along the bed", "disordered": "rows along the bed"}
"""Packings whose grains lie alike: a lattice scatters as one with small random gaps."""
POURED = ["width", "sizes", "poured_depth"]
"""Columns in which poured beds agree whose grains lie alike."""


SCATTER: Mapping[str, str] = {
    "scatter": (
        "half the range of shields over seeds, over its mean: the largest of the piles "
        "whose grains lie alike, of the same slope, force law and fraction"
    ),
}
"""The column that `with_scatter` adds."""


def with_scatter(thresholds: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    """Add the scatter over seeds to thresholds of piles, and widen intervals by it.

    Half the range over the seeds, relative to their mean, is computed for each set of
    piles that differ in the seed alone: random gaps, or perturbed replicas of a
    lattice. A pile gets the largest of those that are `SIMILAR`; where the study ran no
    seeds, none, and its interval stays. The interval then holds the mean, from which a
    pile may be off by that much; it is open above from 100 %.

    Parameters
    ----------
    thresholds
        Thresholds of piles.
    scenes
        Their scenes with their methods, each once.

    Returns
    -------
    DataFrame
        The thresholds with ``scatter``.
    """
    if thresholds.empty:
        return thresholds
    of_scene = scenes.set_index("scene_id")
    ids = thresholds["scene_id"]
    table = thresholds.assign(
        layout=ids.map(_layouts(of_scene)),
        lifted=thresholds["share_carried_off"] > 0,
        replicas=ids.map(_replicas(of_scene)),
    )
    reached = table.dropna(subset=["shields"])
    groups = reached.groupby([*SIMILAR, "replicas"], dropna=False)["shields"]
    spread = (groups.max() - groups.min()) / 2 / groups.mean()
    # one seed has no range
    several = spread[groups.count() > 1].rename("scatter")
    largest = several.groupby(level=SIMILAR, dropna=False).max()
    table = table.merge(
        largest.reset_index(), on=SIMILAR, how="left", validate="many_to_one"
    )
    wider = table["scatter"].fillna(0.0).to_numpy()
    least, most = OF_PILE
    low, _ = within(table[least].to_numpy(), wider)
    _, high = within(table[most].to_numpy(), wider)
    table = table.assign(**{least: low, most: high})
    return table.drop(columns=["layout", "lifted", "replicas"])


def _replicas(scenes: pd.DataFrame) -> "pd.Series[int]":
    """A number for each scene, by its id, that those share that differ in their seed.

    Those that were asked for otherwise are no replicas.
    """
    alike = fields.others(scenes, "seed")
    if "asked" in scenes:
        alike.append("asked")
    return scenes.groupby(alike, dropna=False).ngroup()


def _layouts(scenes: pd.DataFrame) -> "pd.Series[int]":
    """How the grains of each scene lie, by its id: a number that alike scenes share."""
    of_poured = [column for column in POURED if column in scenes]
    columns = scenes[["packing", *of_poured]].replace({"packing": LAYOUTS})
    # a lattice has no width, sizes or depth, and equal spheres have no sizes
    return columns.groupby([*columns], dropna=False).ngroup()


class Judged(NamedTuple):
    """Thresholds with their verdicts, and each reason against one.

    Attributes
    ----------
    table
        The thresholds.
    reasons
        A row for each reason: the threshold, its code, what it is, and what helps.
    """

    table: pd.DataFrame
    reasons: pd.DataFrame


def with_usable(
    table: pd.DataFrame,
    scenes: pd.DataFrame,
    tolerance: float | None,
    contradicted: Contradictions | None = None,
    remedies: Remedies | None = None,
) -> Judged:
    """Add to thresholds of piles or of single grains whether they are usable.

    Parameters
    ----------
    table
        The thresholds; each is judged at its own Re*.
    scenes
        Their scenes with their methods, each once.
    tolerance
        The relative error that is allowed, if one was asked for.
    contradicted
        What DEM says against the thresholds.
    remedies
        What helps where the numerical error of a threshold is not known.

    Returns
    -------
    Judged
        The table with the columns of `verdict.columns`, what was measured, by `beside`,
        and the columns of `quoted`; and the reasons, which its columns join.
    """
    if table.empty:
        return Judged(table, pd.DataFrame())
    columns = [name for name in scenes if name not in table or name == "scene_id"]
    rows = table.merge(scenes[columns], on="scene_id", how="left")
    is_pile = "share_carried_off" in rows
    if not is_pile:
        is_run = needs_run(rows)
        rows["reynolds"] = rows["reynolds"].where(is_run, rows["reynolds_closed_form"])
        rows["shields"] = rows["shields_dem"].where(is_run, rows["shields_closed_form"])
    rows["standing_out"] = standing_out(rows["relative_size"], rows["beta_deg"])
    rows["flow_reynolds"] = _flow_reynolds(rows)
    measured = beside(rows.assign(**{TESTED_AS: tested_as(rows)}))
    # in one step: columns put in one by one would lie in as many pieces
    rows = _with(rows, measured)
    twins = None
    if "fraction" in rows:
        replicas = rows["scene_id"].map(_replicas(scenes.set_index("scene_id")))
        twins = rows.groupby([replicas, "fraction"], dropna=False).ngroup()
    units = quoted(rows, twins)
    records = _with(rows, units).to_dict("records")
    reasons = []
    for row, of_law in zip(records, _against_law(rows, is_pile), strict=True):
        against = [*_reasons(row, of_law, tolerance)]
        key = (row["scene_id"], row.get("fraction", np.nan))
        if contradicted and key in contradicted:
            against.append(Reason("contradicted", contradicted[key]))
        reasons.append([_with_remedy(each, key, remedies) for each in against])
    of_verdict = verdict.columns(records, reasons)
    if not is_pile:
        units = with_laws(rows, units, np.array(of_verdict["usable"], bool))
    units = with_advice(rows, units, of_verdict, twins)
    made = {**of_verdict, **measured, **units}
    judged = pd.concat([table, pd.DataFrame(made, index=table.index)], axis=1)
    return Judged(judged, pd.DataFrame(_listed(records, reasons)))


def _with_remedy(
    reason: Reason, key: tuple[str, float], remedies: Remedies | None
) -> Reason:
    """A reason with what helps against it, where that depends on the scene."""
    if reason.code != NOT_KNOWN or not remedies:
        return reason
    return reason._replace(remedy=remedies.get(key, ""))


def _with(rows: pd.DataFrame, columns: Mapping[str, Any]) -> pd.DataFrame:
    """Some rows with columns, in place of their own of these names."""
    others = rows.drop(columns=[*columns], errors="ignore")
    return pd.concat([others, pd.DataFrame(columns, index=rows.index)], axis=1)


REASON: Mapping[str, str] = {
    **several("scene_id", "fraction"),
    **{name: verdict.COLUMNS[name] for name in ("reason", "why_not", "remedy")},
}
"""Columns of the reasons against thresholds."""


def _listed(
    rows: Sequence[Mapping[Any, Any]], reasons: Sequence[Sequence[Reason]]
) -> Iterator[Row]:
    """A row for each reason against each threshold."""
    for row, against in zip(rows, reasons, strict=True):
        for each in against:
            yield {
                "scene_id": row["scene_id"],
                "fraction": row.get("fraction"),
                "reason": each.code,
                "why_not": each.text,
                "remedy": each.remedy or None,
            }


def _against_law(rows: pd.DataFrame, is_pile: bool) -> list[list[Reason]]:
    """What the force law of each row has against its threshold.

    It is asked where a grain leaves its pocket: one that goes on does so in a gust. A
    pile has the share of grains that lift carried off.
    """
    ustar = np.array(rows["reynolds"] * rows["nu_m2_s"] / rows["d_m"], float)
    if not is_pile and "criterion" in rows:
        is_sustained = (rows["criterion"] == SUSTAINED).to_numpy()
        ustar[is_sustained] = of_rows(rows[is_sustained])["leaving"]
    found: list[list[Reason]] = [[] for _ in ustar]
    for name in rows["force_law"].unique():
        places = np.flatnonzero(rows["force_law"] == name)
        part = rows.iloc[places]
        of_law = against_law(
            str(name), Grain.of_table(part), ustar[places], lifts=not is_pile
        )
        for place, reasons in zip(places.tolist(), of_law, strict=True):
            found[place] = reasons
    return found


def _flow_reynolds(rows: pd.DataFrame) -> "pd.Series[float]":
    """Speed times depth over nu of the undisturbed flow at the threshold of each row.

    Of a channel its mean speed over its depth, of a boundary layer over a pile the
    speed at 10 h. NaN for a single grain in a boundary layer, which has no depth.
    """
    nu = rows["nu_m2_s"]
    depth = rows["depth_m"].astype(float)
    layer: Any = np.nan
    if "ustar0_m_s" in rows:
        ustar0 = rows["ustar0_m_s"]
        layer = rows["u_e_m_s"] * SPEED_HEIGHT * rows["h_m"]
    else:
        ustar0 = rows["ustar_m_s"].where(needs_run(rows), rows["ustar_closed_form_m_s"])
    channel = open_water_reynolds(
        ustar0,
        roughness=rows["z0_over_d"] * rows["d_m"],
        viscosity=nu,
        depth=depth,
        closed=rows["flow_top"] == "closed channel",
    )
    return pd.Series(channel, rows.index).fillna(layer / nu)


def _reasons(
    row: Mapping[Any, Any], of_law: Sequence[Reason], tolerance: float | None
) -> Iterator[Reason]:
    """Reasons against the threshold of a row, with those of its law."""
    is_pile = "share_carried_off" in row
    if is_pile and np.isnan(row["reynolds"]):
        what, remedy = _reached(row)
        yield Reason("not reached", f"not reached: {what}", remedy)
    yield from verdict.of_grain(row, of_law)
    if is_pile:
        yield from _reasons_of_pile(row, tolerance)
    elif isinstance(row.get("gusts"), str):
        what = "the error of the closed form under gusts is not known"
        yield Reason("gusts", what)
    is_closed = not is_pile or not packs_grains(row)
    yield from verdict.of_measurements(row, is_closed)


def _reasons_of_pile(
    row: Mapping[Any, Any], tolerance: float | None
) -> Iterator[Reason]:
    """Reasons against the threshold of a pile, beside those that a grain has, too."""
    if row["share_carried_off"] > CARRIED_OFF:
        share = percent(row["share_carried_off"])
        what = f"{share} of the entrained grains were lifted off"
        yield Reason("carried off", what)
    yield from _reasons_of_bed(row)
    error = row["numerical_error"]
    if pd.isna(error):
        yield Reason(NOT_KNOWN, NOT_MEASURED)
    elif tolerance and error > tolerance * (1 + 1e-9):
        what = f"numerical error {percent(error, 1)} is above the tolerance of "
        what += f"{100 * tolerance:.3g} %"
        yield Reason(ABOVE_TOLERANCE, what)
    if row["fraction"] * row["count"] < 1 - 1e-9:
        what = f"{row['fraction']:.3g} of {row['count']:.0f} grains is less than one"
        yield Reason("few grains", what)
    yield from _open_ends(row)
    needed = row.get("smoothing_needed_m", 0.0)
    if needed > (row.get("smoothing") or 0.0) * (1 + 1e-9):
        what = "the profile is noise at the scale of the mesh, which disturbs its flow"
        remedy = f"write bed.smoothing = {needed:g} and run again"
        yield Reason("noise", what, remedy)
    yield from _held_row(row)


def _held_row(row: Mapping[Any, Any]) -> Iterator[Reason]:
    """Why a threshold is that of a row of touching grains; empty where it is not.

    The closed form along the bed line packs no rows: it is of single exposed grains.
    """
    if not packs_grains(row) or not row.get("interlocking", 0.0) > INTERLOCKED:
        return
    times = f"{row['interlocking']:.2g} times the u* of a single one"
    said = f"the row has no end: its neighbours hold the first grain up to {times}"
    remedy = ""
    if row.get("packing") in ("aligned", "disordered"):
        remedy = 'choose method.kind = "local", which is of single exposed grains'
    yield Reason("row", said, remedy)


def _reasons_of_bed(row: Mapping[Any, Any]) -> Iterator[Reason]:
    """Reasons against how the grains of a pile lie and against a kept balance."""
    is_strip = (row.get("width") or 0) > 0
    is_plane = row.get("packing") == "poured" and not is_strip
    if is_plane and pd.isna(row.get("sizes")):
        remedy = "give sizes = { sigma_g = 1.2 }"
        what = "equal spheres in one plane settle into a crystal"
        yield Reason("crystal", what, remedy)
    renews = METHODS[row["method"]].renews_balance
    is_renewed = renews or (row.get("update") or 0) > 0
    is_kept = row.get("sheltering") == "balanced" and not is_renewed
    if is_kept and row["fraction"] > KEPT_TO + 1e-9:
        beyond = (
            f"beyond n/N = {KEPT_TO} grains that were entrained still bear a part of it"
        )
        yield Reason("kept balance", f"kept balance: {beyond}")


def _reached(row: Mapping[Any, Any]) -> tuple[str, str]:
    """How many grains of a pile have moved by the end of its run, and what helps."""
    highest = row.get("highest_fraction", 0.0)
    said = f"at most {percent(highest)} of {row['count']} grains moved"
    last = row.get("final_fraction")
    if last is not None and highest >= last - 1e-9:
        end = f"method.grains.final_fraction = {last:g}"
        return f"{said}, since the run ends at {end}", "raise it"
    return said, ""


def _open_ends(row: Mapping[Any, Any]) -> Iterator[Reason]:
    """Why the interval of a threshold that was reached has no upper end.

    It is empty if the interval has one.
    """
    low, high = (row.get(name, np.nan) for name in OF_PILE)
    if np.isnan(low) or not np.isnan(high) or np.isnan(row["shields"]):
        return
    remedy = ""
    if row["numerical_error"] >= 1:
        why = f"the numerical error is {percent(row['numerical_error'])}"
    elif row.get("scatter", 0.0) >= 1:
        why = f"the scatter over seeds is {percent(row['scatter'])}"
    else:
        why, remedy = _reached(row)
    yield Reason("open", f"interval open above: {why}", remedy)
