"""The table of flows: what each was solved with, where it separates, how it speeds up."""

from pathlib import Path

import numpy as np

from orchestrator.bed.shapes import rushil_aspect
from orchestrator.flow import diagnostics
from orchestrator.grains.pile import Pile
from orchestrator.physics.hills import MeasuredHill, measured
from orchestrator.tables.scenes import Row

WINDWARD = {
    "ustar_foot": 0.0,
    "ustar_quarter": 0.25,
    "ustar_half": 0.5,
    "ustar_three_quarters": 0.75,
    "ustar_top": 1.0,
}
"""Parts of the way along the bed from the foot to the top at which u*/u*_0 is told."""


def row(pile: Pile, cases: Path) -> Row:
    """A row of the table of flows: one for all piles that share the flow."""
    flow, stress, line = pile.flow, pile.stress(cases), pile.model.line
    bubble = diagnostics.bubble(stress, line.h) or (np.nan, np.nan)
    ustar = stress.ustar_over_ustar0_wall
    windward = (stress.s_m > 0) & (stress.s_m < line.crest_s)
    length = stress.length_m[windward]
    return {
        "flow_case": flow.name,
        "bed_shape": pile.bed.shape if not pile.bed.profile else "profile",
        "alpha_deg": pile.bed.slope_deg,
        "h_m": flow.height_m,
        "z0_m": flow.roughness_m,
        "turbulence_model": flow.turbulence_model,
        "first_cell_m": flow.first_cell_m,
        "lid_over_h": flow.lid,
        "upstream_over_h": flow.upstream,
        "downstream_over_h": flow.downstream,
        "separation_over_h": bubble[0],
        "reattachment_over_h": bubble[1],
        **{
            name: float(np.interp(part * line.crest_s, stress.s_m, ustar))
            for name, part in WINDWARD.items()
        },
        "ustar_mean": float(np.average(ustar[windward], weights=length)) if length.size else np.nan,
        "ustar_largest": float(ustar.max()),
        **_beside(measured_hill(pile)),
    }


def measured_hill(pile: Pile) -> MeasuredHill | None:
    """The hill of a wind tunnel that a pile is, if any."""
    bed, flow = pile.bed, pile.flow
    if bed.shape != "rushil" or bed.profile or bed.forms > 1 or bed.obstacles:
        return None
    return measured(rushil_aspect(bed.slope_deg), flow.height_m / flow.roughness_m)


def _beside(hill: MeasuredHill | None) -> Row:
    """Measured values: columns of flows over such hills alone."""
    if hill is None:
        return {}
    length = hill.reattachment or np.nan
    return {
        "measured_reattachment_over_h": length,
        "measured_verified": hill.verified,
        "measured_source": hill.source,
    }
