"""The rows of one pile: its grains, its curve and all else that its results make."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from orchestrator.grains import threshold
from orchestrator.grains.motion import MODES
from orchestrator.study.criterion import ENTRAINED, SUSTAINED
from orchestrator.tables.answer import Answer
from orchestrator.tables.classes import size_class
from orchestrator.tables.columns import several
from orchestrator.tables.forms import form_rows
from orchestrator.tables.quantities import reynolds, shields
from orchestrator.tables.thresholds import pile_threshold
from orchestrator.types import Row

PILE_GRAIN: Mapping[str, str] = {
    **several("scene_id"),
    "grain_id": "id of the grain in the deck; by the method local number of the place",
    **several("s_m", "x_m"),
    "y_m": "place across the flow in a strip",
    "ustar_over_ustar0": (
        "signed friction velocity at the grain over the undisturbed one"
    ),
    "moved_in_load_step": (
        "load step in which the grain moved: passed the displacement criterion "
        "downstream, or was carried off; 0: never"
    ),
    "fallen_in_load_step": (
        "load step in which the grain was first displaced upstream by the displacement "
        "criterion; 0: never"
    ),
    **several("carried_off"),
    "mode": (
        "how the grain moved: rolled, slid, lifted (rose by more than 0.3 d) or none; "
        "the number of lifted grains depends on the stiffness and on the mobile layers "
        "of the model"
    ),
    **several("ustar0_m_s", "decides", "size_over_d"),
    "pivot_deg": (
        "angle of the grain's foremost contact from the normal of the bed; in a strip "
        "that of the saddle through which the grain rolls; empty where no contact lets "
        "it go"
    ),
}
"""Columns of `pile_grain`."""


def pile_grain(answer: Answer) -> Row:
    """List the counted grains of a pile: the stress on each, when and how it moved.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    dict
        Numbers, and columns of shape (n,) for n counted grains.
    """
    pile = answer.pile
    motion = answer.motion
    packing = pile.packing
    counted = packing.windward
    d = pile.scene.grain.diameter
    columns = {
        "scene_id": answer.scene_id,
        "grain_id": np.flatnonzero(counted) + 1,
        "s_m": packing.arc_length[counted] * d,
        "x_m": pile.bed.place(packing.centres[counted, 0] * d),
        "ustar_over_ustar0": answer.speed,
        "moved_in_load_step": motion.load_step,
        "fallen_in_load_step": motion.fallen,
        "carried_off": motion.carried.astype(int),
        "mode": np.array(MODES)[motion.mode],
        "ustar0_m_s": threshold.of_grains(motion).value,
    }
    if pile.is_sustained:
        by_sustained = pile.sustained_decides(answer.cases)
        columns["decides"] = np.where(by_sustained, SUSTAINED, ENTRAINED)
    if pile.pouring:
        columns["size_over_d"] = packing.sizes[counted]
        columns["pivot_deg"] = pile.pivot_angles_deg
        if packing.width:
            columns["y_m"] = packing.places.xyz[counted, 1] * d
    return columns


PILE_CURVE: Mapping[str, str] = {
    **several("scene_id"),
    "load_step": "number of the load step; 0 is the settling",
    **several("u_e_m_s", "ustar0_m_s", "count", "moved"),
    "not_moved": "N - n, counted grains that had not moved",
    **several("carried_off"),
    "fallen_upstream": (
        "grains that had been displaced upstream by the displacement criterion, "
        "carried off later or not"
    ),
    **several("fraction_moved"),
    "mean_tau_pa": "mean size of the wall stress on the grains that had moved",
    **several("shields", "reynolds"),
}
"""Columns of `pile_curve`."""


def pile_curve(answer: Answer) -> Row:
    """List the fraction of a pile that had moved, and the stress, at each load step.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    dict
        Numbers, and columns of shape (K + 1,) for K load steps.
    """
    scene = answer.pile.scene
    motion = answer.motion
    tau = threshold.mean_tau(motion, answer.speed, scene.fluid.density)
    return {
        "scene_id": answer.scene_id,
        "load_step": np.arange(len(motion.flow)),
        "u_e_m_s": motion.flow * answer.pile.model.lid_speed_ratio,
        "ustar0_m_s": motion.flow,
        "count": motion.count,
        "moved": motion.moved,
        "not_moved": motion.count - motion.moved,
        "carried_off": motion.carried_off,
        "fallen_upstream": motion.fallen_upstream,
        "fraction_moved": motion.fraction,
        "mean_tau_pa": tau,
        "shields": shields(scene, tau),
        "reynolds": reynolds(scene, tau),
    }


class OfPile(NamedTuple):
    """The rows of one pile, in the tables that its own results alone make.

    Attributes
    ----------
    thresholds, classes, forms
        Those of `pile_threshold`, `size_class` and `form_rows`.
    curve, grains
        Those of `pile_curve` and `pile_grain`.
    """

    thresholds: list[Row]
    classes: list[Row]
    forms: list[Row]
    curve: Row
    grains: Row


def of_pile(answer: Answer) -> OfPile:
    """Make the rows of one pile.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    OfPile
        The rows.
    """
    return OfPile(
        [*pile_threshold(answer)],
        [*size_class(answer)],
        [*form_rows(answer)],
        pile_curve(answer),
        pile_grain(answer),
    )
