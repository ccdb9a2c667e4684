"""The forces of the flow on the exposed grains of a scene."""

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.grains.peeling import (
    Force,
)
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import check_known, thresholds_of
from orchestrator.study.closed_form import closed_form, single_grain
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

LOOSE = 1e-4
"""Threshold over that of the scene's grain, below which a grain lies loose: at the
limiting slope round-off leaves it 1e-8. Tables of forces begin there."""


def forces(
    scene: Scene,
    sizes: ArrayLike = 1.0,
    gaps: ArrayLike | None = None,
    level: Force = np.zeros_like,
) -> tuple[Force, Force]:
    """Make drag and lift on exposed grains of a resolved scene.

    Parameters
    ----------
    scene
        The scene.
    sizes
        Diameters over that of the scene.
    gaps
        Heights of the grains' lowest points above the bed's level, m; by default z0.
    level
        Height above that, m, at which the flow begins, a function of the friction
        velocity, m/s; by default 0.

    Returns
    -------
    drag, lift
        Forces, N, as functions of local friction velocities, m/s.
    """
    law = LAWS[scene.forces.law]
    grain = single_grain(scene)
    diameters = grain.diameter * np.asarray(sizes, float)
    heights = np.asarray(grain.roughness if gaps is None else gaps, float)

    def exposed(ustar: ArrayLike) -> Grain:
        return grain.changed(diameter=diameters, gap=heights - level(ustar))

    def drag(ustar: ArrayLike) -> FloatArray:
        return law.drag(ustar, exposed(ustar))

    def lift(ustar: ArrayLike) -> FloatArray:
        return law.lift(ustar, exposed(ustar))

    return drag, lift


def on_slopes(scene: Scene, slopes_deg: FloatArray) -> FloatArray:
    """Find the friction velocity at which a grain would leave on other slopes.

    Parameters
    ----------
    scene
        The scene.
    slopes_deg
        Slopes, degrees, shape (N,).

    Returns
    -------
    FloatArray
        Friction velocities, m/s, shape (N,); 0 on slopes down which a grain rolls by
        itself, the limiting slope among them.
    """
    slopes, place = np.unique(np.round(slopes_deg, 9), return_inverse=True)
    grains = single_grain(scene).changed(slope_deg=slopes)
    peaks = thresholds_of(scene.forces.law, grains).friction_velocity
    check_known(peaks, scene.forces.law)
    speeds = peaks / np.sqrt(scene.gust)
    is_loose = speeds < LOOSE * float(closed_form(scene).friction_velocity)
    return np.where(is_loose, 0.0, speeds)[place]
