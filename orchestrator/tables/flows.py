"""The rows of solved flows: the stress and the speeds over the bed."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from orchestrator.bed.deck import read_texts
from orchestrator.flow.profiles import PROFILES
from orchestrator.flow.stress import bubble
from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.physics.velocity import log_law_speed
from orchestrator.tables.columns import phrases, several
from orchestrator.types import Row

WAY_UP: Mapping[str, str] = {
    "ustar_toe": "u*/u*_0 of the wall stress at the toe of the first form",
    "ustar_quarter": (
        "u*/u*_0 of the wall stress at a quarter of the way along the bed from the toe "
        "to the crest"
    ),
    "ustar_half": (
        "u*/u*_0 of the wall stress at half of the way along the bed from the toe to "
        "the crest"
    ),
    "ustar_three_quarters": (
        "u*/u*_0 of the wall stress at three quarters of the way along the bed from "
        "the toe to the crest"
    ),
    "ustar_crest": "u*/u*_0 of the wall stress at the crest of the first form",
}
"""Columns of u*/u*_0 at equal parts of the way along the bed from the toe to the
crest."""

WALL_STRESS: Mapping[str, str] = {
    **several("flow_case"),
    **phrases("alpha_deg", "h_m", "z0_m"),
    **several("s_m"),
    "s_over_h": "arc length along the bed line from the windward toe over h",
    **several("x_m"),
    "z_m": "height above the flat bed; of a profile z of its file",
    "ustar_over_ustar0_wall": (
        "signed friction velocity of the wall stress over the undisturbed one"
    ),
    "ustar_over_ustar0_eq10": (
        "signed friction velocity by Eq. 10 with ln((z_e + z0)/z0) over the "
        "undisturbed one"
    ),
}
"""Columns of `wall_stress`."""


def wall_stress(pile: Pile, cases: Path) -> Row:
    """List the friction velocity along the bed, for the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        Numbers, and columns of shape (n,) for n places along the bed.
    """
    stress = pile.stress(cases)
    return {
        "flow_case": pile.flow.name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": pile.bed.height,
        "z0_m": pile.flow.roughness_m,
        "s_m": stress.s_m,
        "s_over_h": stress.s_m / pile.bed.height,
        "x_m": pile.bed.place(stress.x_m),
        "z_m": pile.bed.level(stress.z_m),
        "ustar_over_ustar0_wall": stress.ustar_over_ustar0_wall,
        "ustar_over_ustar0_eq10": stress.ustar_over_ustar0_eq10,
    }


SPEED_PROFILE: Mapping[str, str] = {
    **several("flow_case"),
    "profile_at": (
        "place of a profile of speeds: upstream, in the column before the inlet; toe, "
        "of the first form; crest, the highest; lee, where the bed behind the crest is "
        "first within h/100 of its lowest"
    ),
    **several("x_m"),
    "height_over_h": "height over the bed of a speed, over h",
    "u_over_u_e": "speed downstream over that of the approaching flow at 10 h",
    "u_over_u_e_log_law": (
        "speed of the logarithmic law at this height over that at 10 h"
    ),
}
"""Columns of `speed_profile`."""


def speed_profile(pile: Pile, cases: Path) -> Row:
    """List the speeds over a few places of the bed, for the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        The case, and columns of shape (n,) for n heights over the places.
    """
    flow = pile.flow
    read = read_texts(cases / flow.name / PROFILES)
    height = read["height_m"].astype(float)
    law = log_law_speed(flow.ustar0_m_s, height, flow.roughness_m)
    return {
        "flow_case": flow.name,
        "profile_at": read["place"],
        "x_m": pile.bed.place(read["x_m"].astype(float)),
        "height_over_h": height / flow.height_m,
        "u_over_u_e": read["u_m_s"].astype(float) / flow.approach.speed_m_s,
        "u_over_u_e_log_law": law / flow.approach.speed_m_s,
    }


FLOW: Mapping[str, str] = {
    **several("flow_case"),
    **phrases(
        "bed_shape", "alpha_deg", "h_m", "z0_m", "turbulence_model", "first_cell_m"
    ),
    "lid_over_h": "height of the lid above the flat bed over h",
    "upstream_over_h": "length of the flat bed before the forms over h",
    "downstream_over_h": "length of the flat bed behind the forms over h",
    "separation_over_h": (
        "where reversed flow begins behind the crest, over h; empty: nowhere"
    ),
    "reattachment_over_h": (
        "where reversed flow ends behind the crest, over h; empty: nowhere"
    ),
    **WAY_UP,
    "ustar_mean": (
        "mean u*/u*_0 of the wall stress from the toe to the crest of the first form"
    ),
    "ustar_largest": "largest u*/u*_0 of the wall stress on the bed",
    "measured_reattachment_over_h": (
        "where reversed flow ended in a wind tunnel, over h; empty: not measured"
    ),
    "measured_verified": "whether the measured number was read in its source",
    "measured_source": "source of the measured number",
}
"""Columns of `flow`."""


def flow_row(pile: Pile, cases: Path) -> Row:
    """Make the row of the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        The settings of the flow, its separation and its speed-up.
    """
    case = pile.flow
    stress = pile.stress(cases)
    line = pile.model.line
    separation, reattachment = bubble(stress, line.h) or (np.nan, np.nan)
    ustar = stress.ustar_over_ustar0_wall
    way = np.linspace(0, line.crest_s, len(WAY_UP))
    on_the_way = np.interp(way, stress.s_m, ustar).tolist()
    windward = (stress.s_m > 0) & (stress.s_m < line.crest_s)
    length = stress.length_m[windward]
    mean = np.nan
    if length.size:
        mean = float(np.average(ustar[windward], weights=length))
    row = {
        "flow_case": case.name,
        "bed_shape": pile.bed.shape_name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "turbulence_model": case.settings.turbulence_model,
        "first_cell_m": case.first_cell_m,
        "lid_over_h": case.lid,
        "upstream_over_h": case.settings.upstream,
        "downstream_over_h": case.settings.downstream,
        "separation_over_h": separation,
        "reattachment_over_h": reattachment,
        **dict(zip(WAY_UP, on_the_way, strict=True)),
        "ustar_mean": mean,
        "ustar_largest": float(ustar.max()),
    }
    hill = measured_hill(pile)
    if hill is not None:
        row["measured_reattachment_over_h"] = hill.reattachment or np.nan
        row["measured_verified"] = hill.verified
        row["measured_source"] = hill.source
    return row


def measured_hill(pile: Pile) -> measured.MeasuredHill | None:
    """Find the hill of a wind tunnel that a pile is.

    Returns
    -------
    MeasuredHill or None
        The hill, if it is one.
    """
    bed = pile.bed
    case = pile.flow
    if not bed.form.has_measured_flow or bed.profile or bed.forms > 1 or bed.obstacles:
        return None
    return measured.rushil_hill(bed.slope_deg, case.height_m / case.roughness_m)
