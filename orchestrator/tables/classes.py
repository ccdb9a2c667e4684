"""The rows of the size classes of a mixture."""

from collections.abc import Iterator, Mapping

import numpy as np

from orchestrator.grains import threshold
from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.tables.answer import Answer
from orchestrator.tables.columns import several
from orchestrator.tables.quantities import shields
from orchestrator.tables.thresholds import with_ends
from orchestrator.types import BoolArray, FloatArray, Row

FEW_GRAINS = 10
"""Grains of a size class below which the interval of its threshold is wide."""

SIZE_CLASS: Mapping[str, str] = {
    **several("scene_id", "fraction", "size_over_d", "count"),
    "few": (
        "whether the size class has fewer than ten counted grains that a free way "
        "leads out"
    ),
    "class_moved": (
        "part of the size class that had moved when the fraction of all grains had"
    ),
    "class_moved_low": (
        "least part of the size class that has moved on a bed of many such grains, by "
        "the number of them (binomial, 80 %)"
    ),
    "class_moved_high": "largest part of it, alike",
    **several("ustar0_m_s"),
    "shields_own": (
        "Shields number at the threshold of a size class of diameter d_i, "
        "tau_c/((rho_sol - rho_f) g d_i)"
    ),
    "shields_own_low": (
        "lower end of the interval of shields_own: its number leaves that to chance "
        "(binomial, 80 %), load steps, and the interval of the bed; empty where so few "
        "bound nothing, and where that of the bed is open"
    ),
    "shields_own_high": "upper end of the interval of shields_own, alike",
    "hiding": (
        "shields_own over that at d50, between the two size classes beside d50; empty "
        "where one of these has no threshold or its grains lie loose"
    ),
    "hiding_low": "least hiding of the size class, by shields_own_low",
    "hiding_high": "largest hiding of the size class, by shields_own_high",
    "hiding_equal_mobility": (
        "hiding where the part of the size class that has moved is the fraction times "
        "(d/d_i)^2, as in measurements at equal dimensionless transport; empty like "
        "hiding, and where that part is above 1"
    ),
    "hiding_wilcock_crowe": "hiding of the size class by Wilcock and Crowe",
    "hiding_egiazaroff": "hiding of the size class by Egiazaroff",
}
"""Columns of `size_class`."""


def size_class(answer: Answer) -> Iterator[Row]:
    """Find the threshold of each size class of a mixture.

    It is that at which a fraction of its grains has moved; for the hiding of equal
    mobility, a part that falls with the size. Grains that no free way leads out of
    their places count in no class. The stress at d50, over which those of the classes
    are, lies between the two classes beside it.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction and class; none of a pile that was not poured.
    """
    pile = answer.pile
    if not pile.pouring:
        return
    classes = _free_classes(pile)
    sizes = np.array([each.size for each in classes])
    for fraction in pile.scene.threshold.fractions:
        load_step = threshold.first_load_step(answer.motion, fraction)
        has_moved = None if load_step is None else answer.motion.moved_by(load_step)
        found = [answer.at(fraction, each.chosen) for each in classes]
        median = threshold.at_size(1.0, sizes, np.array([at.tau for at in found]))
        hidden = _equal_mobility(answer, classes, fraction)
        for each, at, of_mobility in zip(classes, found, hidden, strict=True):
            count = int(each.chosen.sum())
            tau = np.array([at.tau, at.tau_low, at.tau_high])
            wilcock_crowe = measured.wilcock_crowe_hiding(each.size) / each.size
            yield {
                "scene_id": answer.scene_id,
                "fraction": fraction,
                "size_over_d": each.size,
                "count": count,
                "few": count < FEW_GRAINS,
                **with_ends("class_moved", _moved_of(each, has_moved)),
                "ustar0_m_s": at.ustar0,
                **with_ends("shields_own", shields(pile.scene, tau) / each.size),
                **with_ends("hiding", tau / median / each.size),
                "hiding_equal_mobility": float(of_mobility),
                "hiding_wilcock_crowe": float(wilcock_crowe),
                "hiding_egiazaroff": float(measured.egiazaroff_hiding(each.size)),
            }


def _free_classes(pile: Pile) -> list[threshold.SizeClass]:
    """The size classes of the counted grains that are free to leave."""
    sizes = pile.packing.sizes[pile.packing.windward]
    classes = []
    for each in threshold.classes(sizes):
        is_free = each.chosen & pile.is_free
        if is_free.any():
            classes.append(each._replace(chosen=is_free))
    return classes


def _equal_mobility(
    answer: Answer, classes: list[threshold.SizeClass], fraction: float
) -> FloatArray:
    """The hiding of each class at a part of its grains that falls with its size."""
    sizes = np.array([each.size for each in classes])
    parts = fraction * sizes**-threshold.EQUAL_MOBILITY
    taus = np.full(len(classes), np.nan)
    for place, each in enumerate(classes):
        if parts[place] <= 1:
            taus[place] = answer.at(parts[place], each.chosen).tau
    median = threshold.at_size(1.0, sizes, taus)
    return np.asarray(taus / median / sizes)


def _moved_of(
    each: threshold.SizeClass, has_moved: BoolArray | None
) -> tuple[float, float, float]:
    """The part of a class that has moved, with its interval; NaN if none is known."""
    if has_moved is None:
        return (np.nan, np.nan, np.nan)
    count = int(each.chosen.sum())
    moved = int(has_moved[each.chosen].sum())
    return (moved / count, *threshold.of_all(moved, count))
