"""The rows of the thresholds of a pile, with their intervals."""

from collections.abc import Iterable, Iterator, Mapping
from math import ceil, log, nan

import numpy as np

from orchestrator.fidelity import smoothing, spread
from orchestrator.grains import threshold
from orchestrator.grains.corrected import CorrectedPile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics.velocity import outer_roughness
from orchestrator.study.criterion import ENTRAINED, SUSTAINED
from orchestrator.study.scene import Scene
from orchestrator.tables.answer import Answer
from orchestrator.tables.columns import phrases, several
from orchestrator.tables.quantities import POINT, point, reynolds, shields, speeds
from orchestrator.types import Row

PER_E_FOLD = 0.06
"""Relative rise of tau_c with each e-fold of the flow's z0, at most: triangles of 15
and 30 deg under solved flows, z0/h from 2.5e-4 to 8e-3, at 10 to 70 % of the grains;
0.03 in the mean."""

ENDS = ("", "_low", "_high")
"""Endings of the columns of a threshold and of its interval."""

SMOOTHED = {
    0.5: "first_half_smoothing_m_s",
    1.0: "first_smoothing_m_s",
    2.0: "first_twice_smoothing_m_s",
}
"""Columns of the flow at which motion starts, by the factor of `smoothing.compared`."""

PILE_THRESHOLD: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing", "stress"),
    **several("fraction", "shields", "shields_numerical_low", "shields_numerical_high"),
    "smooth_bed": (
        "by how much shields may still move, relative, to the z0 that the flow has "
        "over its bed at this threshold, z0 + nu/(9 u*) where it is not rough: 6 % at "
        "most for each e-fold from the z0 of the solve; the interval holds it"
    ),
    "numerical_error": (
        "known relative error of the threshold at this fraction, of two measured "
        "fractions beside it the larger; empty where none was measured: of such beds, "
        "or at such fractions"
    ),
    "numerical_error_coverage": (
        "share of the scenes on which numerical_error was measured that it holds, each "
        "by what was found from all other geometries; with factors of few piles by "
        "DEM at most the share that the piles kept apart hold"
    ),
    "numerical_error_count": "how many scenes, or piles kept apart, these are at least",
    "shields_model_low": (
        "lower end of the model's interval of shields: the choices that all methods "
        "share, changed one at a time by `orchestrator budget`; empty where they were "
        "not measured"
    ),
    "shields_model_high": (
        "upper end of the model's interval of shields: the choices that all methods "
        "share, changed one at a time by `orchestrator budget`; empty where they were "
        "not measured"
    ),
    "model_share": "the shared choice that moves the threshold most",
    "frozen_bed": (
        "largest known change of shields, relative, where the bed line is drawn anew "
        "as the grains leave (threshold.update), measured by `orchestrator budget` for "
        "piles of this kind; empty where it is not known, or the bed changes"
    ),
    **several("reynolds", "ustar0_m_s", "u_e_m_s"),
    "pivot_ustar0_m_s": (
        "undisturbed friction velocity at the threshold by the closed form with each "
        "grain's own stress"
    ),
    **several("count"),
    "highest_fraction": "largest n/N that the load steps reached",
    "share_carried_off": "carried_off over moved where the fraction is first reached",
    "share_against_flow": (
        "of the grains that had moved where the fraction is first reached, the share "
        "that a reversed flow drove upstream"
    ),
    "interlocking": (
        "undisturbed friction velocity at which the first grain leaves by peeling over "
        "that at which the first grain moves by itself: above 1 the touching grains of "
        "a row without a free end hold one another; of a bed without grains for those "
        "around the first motion"
    ),
    **several("case"),
}
"""Columns of `pile_threshold`, beside those below and those of speeds."""


def pile_threshold(answer: Answer) -> Iterator[Row]:
    """Find the threshold of a pile at each fraction that its scene asks for.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction. The model's interval is of the choices that all
        fidelities share.
    """
    pile = answer.pile
    scene = pile.scene
    place = point(scene)
    pivots = pile.pivot_thresholds(answer.speed)
    starts = _starts(answer)
    for fraction in scene.threshold.fractions:
        found = answer.at(fraction)
        model = spread.spread(answer.decision.asked, fraction)
        value = shields(scene, found.tau)
        smooth = _smooth_bed(scene, found.ustar0)
        error = answer.error_at(fraction)
        low, high = _interval(scene, found, error, smooth)
        yield {
            "scene_id": answer.scene_id,
            **place,
            "packing": pile.bed.packing,
            "stress": scene.forces.stress,
            "fraction": fraction,
            "shields": value,
            "shields_numerical_low": low,
            "shields_numerical_high": high,
            "numerical_error": error,
            **_coverage(answer, fraction, error),
            "smooth_bed": smooth,
            "shields_model_low": value * (1 - model.low),
            "shields_model_high": value * (1 + model.high),
            "model_share": model.dominant or None,
            "frozen_bed": model.frozen_bed,
            "reynolds": reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * pile.model.lid_speed_ratio,
            **speeds(scene, found.ustar0),
            **starts,
            "pivot_ustar0_m_s": pivots[
                grains_needed(fraction, answer.motion.count) - 1
            ],
            "count": answer.motion.count,
            "highest_fraction": answer.motion.fraction[-1],
            "share_carried_off": found.carried_off,
            "share_against_flow": found.against_the_flow,
            "interlocking": answer.interlocking,
            **_decided(answer),
            **_smoothing(answer),
            **_between(answer),
            **_corrected(answer, fraction),
            "case": pile.last_run,
        }


STARTS: Mapping[str, str] = {
    "first_x_m": (
        "where motion starts: distance along the flow from the windward toe, of a "
        "profile x of its file"
    ),
    "first_ustar0_m_s": "undisturbed friction velocity at which motion starts there",
    "first_ustar0_numerical_low_m_s": (
        "lower end of the numerical interval of first_ustar0_m_s, which holds its load "
        "step and the numerical error of the method"
    ),
    "first_ustar0_numerical_high_m_s": (
        "upper end of this interval; empty where the numerical error leaves it open"
    ),
    "first_numerical_error": (
        "known relative error of the flow at which motion starts; empty where none was "
        "measured at so small a fraction"
    ),
    "pivot_x_m": (
        "first_x_m by pivots of grains around it; empty where they were not asked for"
    ),
    "pivot_first_m_s": "first_ustar0_m_s by those pivots",
}
"""Columns of where motion starts."""


def _starts(answer: Answer) -> Row:
    """Columns of where motion starts, by the method and by the pivots."""
    first_x, first_ustar0 = answer.first
    # the first grain of all is a fraction, too
    error = answer.error_at(1 / answer.motion.count)
    low, high = _first_interval(answer, error)
    pivot_x, pivot_ustar0 = answer.checked
    bed = answer.pile.bed
    return {
        "first_x_m": float(bed.place(first_x)),
        "first_ustar0_m_s": first_ustar0,
        "first_ustar0_numerical_low_m_s": low,
        "first_ustar0_numerical_high_m_s": high,
        "first_numerical_error": error,
        "pivot_x_m": float(bed.place(pivot_x)),
        "pivot_first_m_s": pivot_ustar0,
    }


def _first_interval(answer: Answer, error: float | None) -> tuple[float, float]:
    """Ends of the friction velocity at which motion starts, m/s.

    They hold the load step in which it starts, and what is within the numerical error
    of that load step; they are not known without a known numerical error.
    """
    _, ustar0 = answer.first
    if error is None or np.isnan(ustar0):
        return np.nan, np.nan
    grains = threshold.of_grains(answer.motion)
    is_first = np.flatnonzero(grains.value == ustar0)
    least, most = threshold.within(ustar0**2, error)
    low = np.append(grains.low[is_first], np.sqrt(least)).min()
    high = np.append(grains.high[is_first], np.sqrt(most)).max()
    return float(low), float(high)


DECIDED: Mapping[str, str] = {
    **phrases("criterion"),
    **several("decides"),
}
"""Columns of criteria."""


def _decided(answer: Answer) -> Row:
    """The column of which criterion held most of the counted grains longer."""
    if not answer.pile.is_sustained:
        return {"criterion": ENTRAINED, "decides": ENTRAINED}
    by_sustained = answer.pile.sustained_decides(answer.cases)
    decides = SUSTAINED if by_sustained.mean() > 0.5 else ENTRAINED
    return {"criterion": SUSTAINED, "decides": decides}


def grains_needed(fraction: float, count: int) -> int:
    """Count the grains that are a fraction of some, rounded up.

    Parameters
    ----------
    fraction
        The fraction n/N.
    count
        How many grains there are.

    Returns
    -------
    int
        How many have moved where the fraction has.
    """
    return ceil(fraction * count - 1e-9)


def _interval(
    scene: Scene, found: PileThreshold, error: float | None, smooth: float
) -> tuple[float, float]:
    """Ends of the interval of a Shields number; an end that is not known is NaN.

    It holds load steps and count, at least what is within the numerical error of the
    threshold, and how far the z0 of the flow is from that of a bed that is not rough
    (`smooth`). It is not known without a known numerical error.
    """
    if error is None:
        return np.nan, np.nan
    least, most = threshold.within(found.tau, error)
    if np.isnan(found.tau):  # it was not reached: more than the last flow is needed
        least = found.tau_low / (1 + error)
    low = float(np.fmin(found.tau_low, least))
    high = float(np.maximum(found.tau_high, most))
    low *= 1 + min(smooth, 0.0)
    high *= 1 + max(smooth, 0.0)
    return shields(scene, low), shields(scene, high)


def _smooth_bed(scene: Scene, ustar0: float) -> float:
    """How far at most tau_c moves, relative, if the flow has the z0 of its bed."""
    if not scene.method.flow.facts.follows_bed:
        return 0.0
    outer = float(outer_roughness(scene.bed.roughness, ustar0, scene.fluid.viscosity))
    return PER_E_FOLD * log(outer / scene.solve_roughness)


BETWEEN: Mapping[str, str] = {
    "between_error": (
        "relative error of the stress of a flow that is not solved and lies between "
        "solved ones of other roughness (solved_z0_m): the largest where one of these "
        "is left out; numerical_error contains it"
    ),
}
"""Column of a flow that lies between others."""


def _between(answer: Answer) -> Row:
    """The column of a flow that lies between others: how far it is off."""
    if not answer.pile.model.is_between:
        return {}
    return {"between_error": answer.between}


def _coverage(answer: Answer, fraction: float, error: float | None) -> Row:
    """The columns of what a numerical error holds."""
    if error is None:
        return {"numerical_error_coverage": nan, "numerical_error_count": nan}
    known = answer.decision.known.at(fraction)
    coverage = known.coverage
    count = nan if known.scenes is None else float(known.scenes)
    if isinstance(answer.pile, CorrectedPile):
        by = answer.pile.correction
        coverage = float(np.fmin(coverage, by.confidence))
        count = float(np.fmin(count, len(by.kept)))
    return {"numerical_error_coverage": coverage, "numerical_error_count": count}


CORRECTED: Mapping[str, str] = {
    "correction": (
        "factor of shields from other piles by DEM: the median of theirs by DEM over "
        "theirs without it; empty where nothing was corrected"
    ),
    "correction_piles": "how many piles by DEM that factor is made from",
    "correction_error": (
        "largest relative difference of a corrected threshold from DEM, of the piles "
        "kept apart; numerical_error contains it"
    ),
    "correction_kept": (
        "how many piles by DEM were kept apart, drawn at random; of n the largest "
        "difference holds n/(n + 1) of all such piles"
    ),
}
"""Columns of a threshold that is corrected by DEM of other piles."""


def _corrected(answer: Answer, fraction: float) -> Row:
    """The columns of a correction."""
    pile = answer.pile
    if not isinstance(pile, CorrectedPile):
        return {}
    by = pile.correction
    factors = by.factors(pile.stratum, answer.cases)
    return {
        "correction": factors[by.fractions.index(fraction)],
        "correction_piles": by.made_from(pile.stratum),
        "correction_error": by.error(fraction, answer.cases),
        "correction_kept": len(by.kept),
    }


SMOOTHING: Mapping[str, str] = {
    "smoothing_needed_m": (
        "smoothing, m, that a noisy profile needs: the noise of its points then has a "
        "slope of 0.01"
    ),
    "smoothing_compared_m": (
        "smoothing of a noisy profile whose half and twice are compared, m: the one "
        "used, or needed if that is more"
    ),
    "first_smoothing_m_s": (
        "first_ustar0_m_s by the closed form along the bed line with that smoothing"
    ),
    "first_half_smoothing_m_s": (
        "the same with half of it; empty where the bed cannot be meshed"
    ),
    "first_twice_smoothing_m_s": "the same with twice of it",
}
"""Columns of a noisy profile."""


def _smoothing(answer: Answer) -> Row:
    """Columns of a noisy profile: the smoothing, and the first motion around it."""
    length = smoothing.length_of(answer.pile.scene)
    if not length:
        return {}
    profile = answer.pile.bed.profile
    assert profile
    row = {"smoothing_needed_m": profile.needs, "smoothing_compared_m": length}
    for factor, column in SMOOTHED.items():
        row[column] = answer.smoothed.get(factor, np.nan)
    return row


def with_ends(name: str, values: Iterable[float]) -> Row:
    """Make the columns of a value and of both ends of its interval.

    Parameters
    ----------
    name
        The column of the value.
    values
        The value, its lower and its upper end.

    Returns
    -------
    dict
        The columns `name`, with the `ENDS`.
    """
    names = [name + end for end in ENDS]
    return dict(zip(names, values, strict=True))
