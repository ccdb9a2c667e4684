"""Size classes of the counted grains of a mixture, and the threshold of each."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from orchestrator.grains.motion import Motion

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STEP = np.sqrt(2)
"""Ratio of the ends of a class: half a phi; d lies in the middle of one."""


@dataclass(frozen=True)
class SizeClass:
    """The counted grains between two sizes.

    Attributes
    ----------
    number : int
        0 for the class around d.
    size : float
        Geometric mean of their diameters, d.
    chosen : ndarray of bool, shape (N,)
        Which of the counted grains they are.
    """

    number: int
    size: float
    chosen: BoolArray


def classes(sizes: FloatArray) -> Iterator[SizeClass]:
    """The classes that some counted grains are in, rising; sizes in d, shape (N,)."""
    number = np.rint(np.log(sizes) / np.log(STEP)).astype(int)
    for one in np.unique(number).tolist():
        chosen = number == one
        yield SizeClass(one, float(np.exp(np.log(sizes[chosen]).mean())), chosen)


def of(motion: Motion, chosen: BoolArray) -> Motion:
    """The motion of some of the counted grains under the same flows."""
    parts = ("level", "fallen", "carried", "mode")
    return replace(motion, **{name: getattr(motion, name)[chosen] for name in parts})
