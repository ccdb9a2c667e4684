"""The criterion of a scene: what a grain must do to count as moved.

A grain of the paper leaves its pocket. One of a natural sediment leaves it in a gust,
and goes on after that (`orchestrator.physics.rolling`). Where a scene leaves the
criterion open, its fluid and its forces decide, whatever its method is.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import rolling
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.physics.onset import Criteria
from orchestrator.study.closed_form import closed_form, single_grain
from orchestrator.study.parts import GrainBed
from orchestrator.study.question import why_not_sustained
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

ENTRAINED, SUSTAINED, AUTO = "entrained", "sustained", "auto"
"""Words of the field `threshold.criterion`."""


def is_sustained(scene: Scene) -> bool:
    """Tell whether the grains of a scene must go on, not only leave their pockets.

    Returns
    -------
    bool
        Whether it asks for that, or leaves the criterion open in a fluid that is not
        the paper's by its name, without a mixture, and with forces of which going on is
        known. No number decides it: thresholds do not jump along an axis.
    """
    criterion = scene.threshold.criterion
    if criterion != AUTO:
        return criterion == SUSTAINED
    if scene.flow.gusts is not None or _is_single_by_dem(scene):
        return False
    if scene.fluid.is_paper or scene.grain.sizes is not None:
        return False
    is_alone = scene.forces.sheltering != "balanced"
    return is_alone and not why_not_sustained(scene)


def _is_single_by_dem(scene: Scene) -> bool:
    """Whether LIGGGHTS follows a single grain, of which it knows no hops."""
    return scene.method.is_resolved_in_time and isinstance(scene.bed, GrainBed)


def peak_of(scene: Scene) -> float:
    """Find the stress of the gust that decides, over the mean stress.

    Returns
    -------
    float
        That of the scene's gusts, or the usual one.
    """
    return scene.gust if scene.flow.gusts else PEAK


def spheres(
    scene: Scene,
    slopes_deg: ArrayLike,
    sizes: ArrayLike = 1.0,
) -> Grain:
    """Make the grains of a scene as they roll and hop over its bed.

    Parameters
    ----------
    scene
        The scene.
    slopes_deg
        Slopes that the flow goes up, degrees.
    sizes
        Diameters over that of the scene's grain.

    Returns
    -------
    Grain
        The grains, of the broadcast shape, raveled. A bed of many grains is of those of
        the scene's diameter, its median.
    """
    grain = single_grain(scene)
    over = np.asarray(sizes, float)
    rolling_grain = grain.changed(
        diameter=grain.diameter * over,
        slope_deg=slopes_deg,
        relative_size=grain.relative_size * over,
    )
    return rolling_grain.flat


def sustaining(
    scene: Scene,
    slopes_deg: ArrayLike,
    sizes: ArrayLike,
) -> FloatArray:
    """Find the mean stresses at which the grains of a bed go on after a gust.

    Parameters
    ----------
    scene
        The scene.
    slopes_deg
        Slopes that the flow goes up, degrees, shape (n,).
    sizes
        Diameters over that of the scene's grain, shape (n,).

    Returns
    -------
    FloatArray
        Shields numbers of each grain by its own diameter, shape (n,).
    """
    pairs = np.round(np.column_stack(np.broadcast_arrays(slopes_deg, sizes)), 6)
    unlike, place = np.unique(pairs, axis=0, return_inverse=True)
    rows = tuple((float(slope), float(size)) for slope, size in unlike)
    return _initiation(scene, rows)[place.ravel()]


@lru_cache(maxsize=64)
def _initiation(
    scene: Scene,
    rows: tuple[tuple[float, float], ...],
) -> FloatArray:
    """The same for rows of slope and size; a pile asks for them several times."""
    grains = spheres(scene, *np.array(rows).T)
    return rolling.sustained(grains).initiation(peak_of(scene))


def of_single_grain(scene: Scene) -> Criteria:
    """Find the mean stresses at which the single grain of a scene leaves and goes on.

    Returns
    -------
    Criteria
        The stresses, arrays of shape (1,).
    """
    steady = np.atleast_1d(closed_form(scene).shields) * scene.gust
    return Criteria(steady, spheres(scene, scene.bed.slope_deg), peak_of(scene))
