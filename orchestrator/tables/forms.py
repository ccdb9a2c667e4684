"""The rows of the forms of a train, and of a bed that changes."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from orchestrator.fidelity import limits
from orchestrator.grains import threshold
from orchestrator.grains.pile import Pile
from orchestrator.study.study import changed
from orchestrator.tables.answer import Answer
from orchestrator.tables.columns import phrases, several
from orchestrator.tables.quantities import POINT, point, shields
from orchestrator.tables.thresholds import grains_needed
from orchestrator.types import FloatArray, Row

FORM: Mapping[str, str] = {
    **several("scene_id"),
    "form": "number of the form, from the first upstream",
    **several("count", "fraction"),
    "mean_ustar_over_ustar0": (
        "mean of ustar_over_ustar0 over the form's counted grains"
    ),
    **several("ustar0_m_s"),
    "over_first_form": (
        "ustar0_m_s over that at which the same fraction of the first form has moved; "
        "empty where its grains lie loose"
    ),
}
"""Columns of `forms`."""


def form_rows(answer: Answer) -> Iterator[Row]:
    """Find the thresholds of the forms of a train.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction and form, of the counted grains of that form; none of a
        bed of one form.
    """
    pile = answer.pile
    bed = pile.bed
    if bed.forms == 1 or bed.profile:
        return
    period = bed.spacing or (pile.model.line.x[-2] - pile.model.line.x[1]) / bed.forms
    x = pile.packing.centres[pile.packing.windward, 0] * pile.scene.grain.diameter
    form = np.clip(np.floor(x / period).astype(int), 0, bed.forms - 1)
    ustar0 = threshold.of_grains(answer.motion).value
    for fraction in pile.scene.threshold.fractions:
        first = np.nan
        for number in range(bed.forms):
            # a grain that has not moved is not a number, which sorts last
            grains = np.sort(ustar0[form == number])
            speed = answer.speed[form == number]
            reached = np.nan
            mean = np.nan
            if len(grains):
                needed = max(grains_needed(fraction, len(grains)), 1)
                reached = float(grains[needed - 1])
                mean = float(speed.mean())
            if number == 0:
                first = reached
            yield {
                "scene_id": answer.scene_id,
                "form": number + 1,
                "count": len(grains),
                "fraction": fraction,
                "mean_ustar_over_ustar0": mean,
                "ustar0_m_s": reached,
                # loose grains of the first form move in still fluid: nothing is a
                # multiple of that
                "over_first_form": reached / first if first > 0 else np.nan,
            }


BED_CHANGE: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing"),
    **several("count", "moved", "fraction_moved", "shields"),
    "shields_frozen": (
        "shields of the same pile under the flow over the initial pile to the end"
    ),
    "change": "shields over shields_frozen, less 1",
    "change_ustar0": (
        "ustar0_m_s on the bed that changes over that on the frozen bed, less 1"
    ),
    "holds_until": (
        "n/N at which shields first differs by more than 5 % from shields_frozen; "
        "empty: nowhere up to the last fraction"
    ),
}
"""Columns of `bed_changes`."""


def bed_changes(
    piles: Mapping[str, Pile], answer_of: Callable[[str], Answer]
) -> Iterator[Row]:
    """Compare piles on a bed that changes with the same on a frozen bed.

    The two are answered alike in all else, by one method on one mesh.

    Parameters
    ----------
    piles
        The piles whose runs are done, by the ids of the asked scenes.
    answer_of
        Gives the answer to such a scene.

    Yields
    ------
    dict
        Numbers, and columns of shape (n,): thresholds for the first to the n-th grain.
    """
    changing = [one for one in piles if piles[one].scene.threshold.update]
    if not changing:
        return
    frozen = {pile.scene.id: asked for asked, pile in piles.items()}
    for asked in changing:
        scene = piles[asked].scene
        found = frozen.get(changed(scene, {"threshold.update": 0.0}).id)
        if found is None:
            continue
        answer, twin = answer_of(asked), answer_of(found)
        count = answer.motion.count
        moved = np.arange(1, grains_needed(max(scene.threshold.fractions), count) + 1)
        tau, ustar = _thresholds_of(answer, moved / count)
        tau_frozen, ustar_frozen = _thresholds_of(twin, moved / count)
        change = tau / tau_frozen - 1
        beyond = moved[np.abs(change) > limits.FROZEN_BED] / count
        yield {
            "scene_id": answer.scene_id,
            **point(scene),
            "packing": answer.pile.bed.packing,
            "count": count,
            "moved": moved,
            "fraction_moved": moved / count,
            "shields": shields(scene, tau),
            "shields_frozen": shields(scene, tau_frozen),
            "change": change,
            "change_ustar0": ustar / ustar_frozen - 1,
            "holds_until": beyond[0] if len(beyond) else np.nan,
        }


def _thresholds_of(
    answer: Answer, fractions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The stress (Pa) and the undisturbed u* (m/s) of a pile at some fractions."""
    found = [answer.at(fraction) for fraction in fractions.tolist()]
    tau = np.array([at.tau for at in found])
    ustar0 = np.array([at.ustar0 for at in found])
    return tau, ustar0
