"""Whether thresholds are usable, and their scatter over seeds."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.grains.threshold import within
from orchestrator.physics.beside import GOES_ON, NOT_MEASURED, ROW_HOLD, beside
from orchestrator.physics.laws import LAWS, Exposure
from orchestrator.physics.threshold import standing_out, why_not
from orchestrator.physics.velocity import (
    LAMINAR_BELOW,
    laminar,
    open_water_reynolds,
)
from orchestrator.study import fields
from orchestrator.tables.check import Contradictions
from orchestrator.tables.quoted import OF_PILE, quoted

EXPOSED_FROM = 0.25
"""Part of a grain over the tops of its neighbours from which it is exposed."""
CARRIED_OFF = 0.1
"""Share of the moved grains from which a threshold is one of lift-off."""
KEPT_TO = 0.1
"""n/N to which a balance of the whole bed holds; at 0.3 theta is 2 to 3.5 times
that."""
SIMILAR = ["layout", "lifted", "alpha_deg", "force_law", "fraction"]
"""Piles that agree in these scatter alike: their grains lie alike, and lifted ones
collide or do not."""
LAYOUTS = {"aligned": "rows along the bed", "disordered": "rows along the bed"}
"""Packings whose grains lie alike: a lattice scatters as one with small random gaps."""
POURED = ["width", "sizes", "poured_depth"]
"""Columns in which poured beds agree whose grains lie alike."""


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


def with_usable(
    table: pd.DataFrame,
    scenes: pd.DataFrame,
    tolerance: float | None,
    contradicted: Contradictions | None = None,
) -> pd.DataFrame:
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

    Returns
    -------
    DataFrame
        The table with ``usable``, ``why_not``, what was measured, by `beside`, and the
        columns of `quoted`.
    """
    if table.empty:
        return table
    columns = [name for name in scenes if name not in table or name == "scene_id"]
    rows = table.merge(scenes[columns], on="scene_id", how="left")
    if "reynolds_closed_form" in rows:
        is_dem = rows["method"] == "dem"
        rows["reynolds"] = rows["reynolds"].where(is_dem, rows["reynolds_closed_form"])
        rows["shields"] = rows["shields_dem"].where(is_dem, rows["shields_closed_form"])
    ustar = rows["reynolds"] * rows["nu_m2_s"] / rows["d_m"]
    rows["law"] = ""
    for name, part in rows.groupby("force_law"):
        rows.loc[part.index, "law"] = _beyond_law(str(name), part, ustar[part.index])
    rows["standing_out"] = standing_out(rows["relative_size"], rows["beta_deg"])
    rows["flow_reynolds"] = _flow_reynolds(rows)
    measured = beside(rows)
    rows["tested_rows"] = measured["tested_rows"]
    against = contradicted or {}
    texts = []
    for row in rows.to_dict("records"):
        reasons = [*_reasons(row, tolerance), *_untested(row)]
        key = (row["scene_id"], row.get("fraction", np.nan))
        if key in against:
            reasons.append(against[key])
        texts.append("; ".join(reasons))
    rows = rows.assign(**measured)
    twins = None
    if "fraction" in rows:
        replicas = rows["scene_id"].map(_replicas(scenes.set_index("scene_id")))
        twins = rows.groupby([replicas, "fraction"], dropna=False).ngroup()
    made = {
        "usable": [not text for text in texts],
        "why_not": texts,
        **measured,
        **quoted(rows, twins),
    }
    return pd.concat([table, pd.DataFrame(made, index=table.index)], axis=1)


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
        is_dem = rows["method"] == "dem"
        ustar0 = rows["ustar_m_s"].where(is_dem, rows["ustar_closed_form_m_s"])
    channel = open_water_reynolds(
        ustar0,
        roughness=rows["z0_over_d"] * rows["d_m"],
        viscosity=nu,
        depth=depth,
        closed=rows["flow_top"] == "closed channel",
    )
    return pd.Series(channel, rows.index).fillna(layer / nu)


def _beyond_law(name: str, rows: pd.DataFrame, ustar: "pd.Series[float]") -> list[str]:
    """Reasons against a force law in some rows at their u*, m/s; empty if none."""
    law = LAWS[name]
    d = rows["d_m"].to_numpy()
    exposure = Exposure(
        diameter=d,
        roughness=rows["z0_over_d"].to_numpy() * d,
        fluid_density=rows["rho_f_kg_m3"].to_numpy(),
        viscosity=rows["nu_m2_s"].to_numpy(),
        lift_coefficient=rows["alpha_s"].to_numpy(),
    )
    weights = {}
    # a pile has the share of grains that lift carried off
    if "share_carried_off" not in rows:
        weights["density"] = rows["rho_sol_kg_m3"].to_numpy()
        weights["slope_deg"] = rows["alpha_deg"].to_numpy()
        weights["gravity"] = rows["g_m_s2"].to_numpy()
    speeds = np.asarray(ustar, float)
    texts = why_not(law, speeds, exposure, **weights)
    if law.goes_on:
        holds = LAWS[law.goes_on].valid(speeds, exposure)
        remedy = f'; choose forces.law = "{law.goes_on}"'
        for row in np.flatnonzero(holds).tolist():
            if texts[row]:
                texts[row] += remedy
    return texts


def _untested(row: Mapping[Any, Any]) -> Iterator[str]:
    """Why no interval holds the threshold of grains that go on, in closed form."""
    is_closed = "share_carried_off" not in row or row.get("method") == "local"
    if not is_closed or row.get("criterion") != GOES_ON or np.isnan(row["reynolds"]):
        return
    if not row["tested_rows"]:
        yield f"{NOT_MEASURED} near such grains at Re* {row['reynolds']:.3g}"


def _reasons(row: Mapping[Any, Any], tolerance: float | None) -> Iterator[str]:
    """Reasons against the threshold of a row."""
    if np.isnan(row["reynolds"]):
        yield f"not reached: {_reached(row)}"
    elif row["law"]:
        yield row["law"]
    standing_out = row["standing_out"]
    if standing_out <= 0:
        yield "hidden grain: it lies below the tops of its neighbours"
    elif standing_out < EXPOSED_FROM:
        yield f"hidden grain: {standing_out:.0%} of it stands out of its neighbours"
    flow = row["flow_reynolds"]
    if flow < LAMINAR_BELOW:
        yield laminar(flow)
    if "share_carried_off" in row:
        yield from _reasons_of_pile(row, tolerance)
    elif isinstance(row.get("gusts"), str):
        yield "the error of the closed form under gusts is not known"


def _reasons_of_pile(row: Mapping[Any, Any], tolerance: float | None) -> Iterator[str]:
    """Reasons against the threshold of a pile, beside those that a grain has, too."""
    if row["share_carried_off"] > CARRIED_OFF:
        yield f"lift carried off {row['share_carried_off']:.0%} of the moved grains"
    yield from _reasons_of_bed(row)
    error = row["known_error"]
    if pd.isna(error):
        yield "the error of its fidelity on such a bed is not known"
    elif tolerance and error > tolerance * (1 + 1e-9):
        yield f"known error {error:.1%} is above the tolerance of {tolerance:.3g}"
    if row["fraction"] * row["count"] < 1 - 1e-9:
        yield f"{row['fraction']:.3g} of {row['count']:.0f} grains is less than one"
    yield from _open_ends(row)
    needed = row.get("smoothing_needed_m", 0.0)
    if needed > (row.get("smoothing") or 0.0) * (1 + 1e-9):
        what = "the profile is noise at the scale of the mesh, which disturbs its flow"
        yield f"{what} (write bed.smoothing = {needed:g} and run again)"
    yield from _held_row(row)


def _held_row(row: Mapping[Any, Any]) -> Iterator[str]:
    """Why a threshold is that of a row of touching grains; empty where it is not.

    The closed form along the bed line packs no rows: it is of single exposed grains.
    """
    if row.get("method") == "local" or not row.get("row_hold", 0.0) > ROW_HOLD:
        return
    times = f"{row['row_hold']:.2g} times the u* of a single one"
    said = f"the row has no end: its neighbours hold the first grain up to {times}"
    if row.get("packing") in ("aligned", "disordered"):
        said += '; method.kind = "local" is of single exposed grains'
    yield said


def _reasons_of_bed(row: Mapping[Any, Any]) -> Iterator[str]:
    """Reasons against how the grains of a pile lie and against a kept balance."""
    is_strip = (row.get("width") or 0) > 0
    is_plane = row.get("packing") == "poured" and not is_strip
    if is_plane and pd.isna(row.get("sizes")):
        remedy = "give sizes = { sigma_g = 1.2 }"
        yield f"equal spheres in one plane settle into a crystal: {remedy}"
    is_renewed = row.get("method") == "peeling" or (row.get("update") or 0) > 0
    is_kept = row.get("sheltering") == "balanced" and not is_renewed
    if is_kept and row["fraction"] > KEPT_TO + 1e-9:
        beyond = f"beyond n/N = {KEPT_TO} grains that have gone still bear a part of it"
        yield f"kept balance: {beyond}"


def _reached(row: Mapping[Any, Any]) -> str:
    """How many grains of a pile have moved by the end of its run.

    It is also said whether the run was to end there.
    """
    if "count" not in row:
        return "the grain has not moved"
    highest = row.get("highest_fraction", 0.0)
    said = f"at most {highest:.0%} of {row['count']} grains moved"
    last = row.get("final_fraction")
    if last is not None and highest >= last - 1e-9:
        end = f"method.grains.final_fraction = {last:g}"
        said += f", since the run ends at {end} (raise it)"
    return said


def _open_ends(row: Mapping[Any, Any]) -> Iterator[str]:
    """Why the interval of a threshold that was reached has no upper end.

    It is empty if the interval has one.
    """
    low, high = (row.get(name, np.nan) for name in OF_PILE)
    if np.isnan(low) or not np.isnan(high) or np.isnan(row["shields"]):
        return
    if row["known_error"] >= 1:
        yield f"interval open above: the known error is {row['known_error']:.0%}"
    elif row.get("scatter", 0.0) >= 1:
        yield f"interval open above: the scatter over seeds is {row['scatter']:.0%}"
    else:
        yield f"interval open above: {_reached(row)}"
