"""The counting rule: which of the counted grains have moved, gone back or been carried off.

Its words are in docs/benchmark.md, "The counting rule"; the deck in.bed holds the same criterion to
know when a load step may end, and its counts are compared with those of this rule.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Count:
    """Motion of N counted grains by each of T samples. A grain that has moved stays so.

    Attributes
    ----------
    moved : ndarray of bool, shape (T, N)
        Displaced downstream or aside by the criterion at a sample, or carried off.
    fallen : ndarray of bool, shape (T, N)
        Displaced upstream by the criterion at a sample. Such a grain has not moved, but may yet.
    carried : ndarray of bool, shape (T, N)
        Gone without having been seen beyond the criterion: the flow lifted it off the pile.
    """

    moved: BoolArray
    fallen: BoolArray
    carried: BoolArray


def count(
    travel: FloatArray, criterion: float, *, falls_out: bool, aside: FloatArray | float = 0.0
) -> Count:
    """Apply the rule to the tracks of grains.

    Parameters
    ----------
    travel : ndarray, shape (T, N)
        Displacement along the bed since the settling, downstream positive, d; NaN for a grain
        that is gone.
    criterion : float
        Displacement that counts as motion, d.
    falls_out : bool
        What it means that a grain is gone which was not seen beyond the criterion: from the two
        neighbours of a single grain it fell upstream, for no bed is there to hold it; only lift
        can have taken it from a pile.
    aside : ndarray, shape (T, N), or 0
        Displacement across the flow, d; 0 of grains in one plane.
    """
    ahead, back = _ever(_moved(travel, aside, criterion)), _ever(travel <= -criterion)
    vanished = _ever(np.isnan(travel) & ~ahead)
    if falls_out:
        return Count(ahead, back | vanished, np.zeros_like(vanished))
    return Count(ahead | vanished, back, vanished)


def deck_counts(
    travel: FloatArray, criterion: float, aside: FloatArray | float = 0.0
) -> tuple[IntArray, IntArray]:
    """Counts of the deck at each sample, shape (T,): grains that have not moved; fallen ones."""
    lying = ~np.isnan(travel) & ~_ever(_moved(travel, aside, criterion))
    return lying.sum(axis=1), (travel <= -criterion).sum(axis=1)


def _moved(travel: FloatArray, aside: FloatArray | float, criterion: float) -> BoolArray:
    return np.asarray((travel >= criterion) | (aside >= criterion))


def _ever(happened: BoolArray) -> BoolArray:
    return np.logical_or.accumulate(happened, axis=0)
