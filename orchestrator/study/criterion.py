"""The criterion of a scene: what a grain must do to count as moved.

A grain of the paper leaves its pocket. One of a natural sediment leaves it in a gust,
and goes on after that (`orchestrator.physics.saltation`). Where a scene leaves the
criterion and the method open, its fluid and its forces decide.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import saltation
from orchestrator.physics.fluids import PAPER
from orchestrator.study.closed_form import closed_form
from orchestrator.study.question import why_not_going_on
from orchestrator.study.scene import Scene
from orchestrator.types import BoolArray, FloatArray

LEAVES, GOES_ON, AUTO = "leaves", "goes on", "auto"
"""Words of the field `threshold.criterion`."""


def goes_on(scene: Scene) -> bool:
    """Tell whether the grains of a scene must go on, not only leave their pockets.

    Parameters
    ----------
    scene
        The scene.

    Returns
    -------
    bool
        Whether it asks for that, or leaves criterion and method open in a fluid that is
        not the paper's, with forces of which going on is known.
    """
    criterion = scene.threshold.criterion
    if criterion != AUTO:
        return criterion == GOES_ON
    if scene.method.kind != "auto" or scene.flow.gusts is not None:
        return False
    if (scene.fluid.density, scene.fluid.viscosity) == PAPER:
        return False
    return not why_not_going_on(scene)


class GoingOn(NamedTuple):
    """Mean stresses at which grains leave and go on, arrays of shape (n,).

    Attributes
    ----------
    shields
        Shields number from which they do both.
    leaves
        That from which the gust turns a grain over its neighbour; of one that cannot
        hop, the mean stress.
    goes_on
        That from which it hops on after the gust; NaN of one that cannot hop.
    at_most
        The threshold with the weakest rebounds; NaN of one that cannot hop.
    cessation
        That below which motion ceases once it is under way.
    hops_decide
        Whether hopping on holds it longer than its pocket.
    """

    shields: FloatArray
    leaves: FloatArray
    goes_on: FloatArray
    at_most: FloatArray
    cessation: FloatArray
    hops_decide: BoolArray


def peak_of(scene: Scene) -> float:
    """Find the stress of the gust that decides, over the mean stress.

    Parameters
    ----------
    scene
        The scene.

    Returns
    -------
    float
        That of the scene's gusts, or the usual one.
    """
    return scene.gust if scene.flow.gusts else saltation.PEAK


def going_on(scene: Scene, slopes_deg: ArrayLike, steady: ArrayLike) -> GoingOn:
    """Find the mean stresses at which equal grains of a scene leave and go on.

    Parameters
    ----------
    scene
        The scene.
    slopes_deg
        Slopes that the flow goes up, degrees, shape (n,).
    steady
        Shields numbers of a steady flow that turn the grains over, shape (n,).

    Returns
    -------
    GoingOn
        The stresses.
    """
    grain = scene.grain
    fluid = scene.fluid
    rounded = np.round(np.asarray(slopes_deg, float), 6)
    slopes, place = np.unique(rounded, return_inverse=True)
    hoppers = saltation.Grains.of(
        grain.diameter,
        density=grain.density,
        fluid_density=fluid.density,
        viscosity=fluid.viscosity,
        slope_deg=slopes,
        roughness=scene.bed.roughness,
        gravity=fluid.gravity,
    )
    peak = peak_of(scene)
    usual = saltation.tabulated(hoppers)
    weakest = saltation.tabulated(hoppers, at_most=True)
    further = usual.initiation(peak)[place]
    can = saltation.hops(hoppers)[place]
    alone = np.asarray(steady, float)
    found = saltation.motion(alone, further, can, peak)
    highest = saltation.motion(alone, weakest.initiation(peak)[place], can, peak)
    return GoingOn(
        shields=found.shields,
        leaves=np.where(can, alone / peak, alone),
        goes_on=np.where(can, further, np.nan),
        at_most=np.where(can, highest.shields, np.nan),
        cessation=np.where(can, usual.cessation[place], alone),
        hops_decide=found.goes_on,
    )


def of_single_grain(scene: Scene) -> GoingOn:
    """Find the mean stresses at which the single grain of a scene leaves and goes on.

    Parameters
    ----------
    scene
        The scene.

    Returns
    -------
    GoingOn
        The stresses, arrays of shape (1,).
    """
    steady = np.atleast_1d(closed_form(scene).shields) * scene.gust
    return going_on(scene, [scene.bed.slope_deg], steady)
