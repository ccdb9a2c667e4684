"""The closed form of the single grain of a scene: its forces, its threshold, the paper's rule.

Thousands of scenes share few grains: thresholds are computed for many grains at once, and kept.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import LAWS_OF, PAPER, Regime, Threshold, regime, threshold
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

Force = Callable[[ArrayLike], FloatArray]  # a force (N) of friction velocities (m/s)


class SingleGrain(NamedTuple):
    """All quantities that the closed form depends on, SI units and degrees."""

    diameter: float
    roughness: float
    fluid_density: float
    viscosity: float
    lift_coefficient: float
    density: float
    slope_deg: float
    entrainment_angle_deg: float
    gravity: float


_CACHE: dict[tuple[str, tuple[float, ...]], Threshold] = {}


def single_grain(scene: Scene) -> SingleGrain:
    """The grain of a scene; its entrainment angle is that of the pocket that it lies in."""
    grain, bed, fluid = scene.grain, scene.bed, scene.fluid
    flow = (bed.roughness, fluid.density, fluid.viscosity, scene.forces.lift_coefficient)
    pivot = (grain.density, bed.slope_deg, scene.pocket_angle_deg, fluid.gravity)
    return SingleGrain(grain.diameter, *flow, *pivot)


def thresholds(name: str, grains: Sequence[tuple[float, ...]]) -> list[Threshold]:
    """The thresholds of grains (as `SingleGrain`) under a force law, each of shape ()."""
    keys = [(name, tuple(grain)) for grain in grains]
    if new := [key for key in dict.fromkeys(keys) if key not in _CACHE]:
        columns = np.array([grain for _, grain in new]).T
        rest = dict(zip(SingleGrain._fields[5:], columns[5:], strict=True))
        columnwise = threshold(LAWS[name], Exposure(*columns[:5]), **rest)
        rows = zip(*vars(columnwise).values(), strict=True)
        _CACHE.update(zip(new, (Threshold(*row) for row in rows), strict=True))
    return [_CACHE[key] for key in keys]


def closed_form(scene: Scene, name: str | None = None) -> Threshold:
    """The threshold of the grain of a scene under a force law, by default the scene's own."""
    return thresholds(name or scene.forces.law, [single_grain(scene)])[0]


def on_slopes(scene: Scene, slopes_deg: FloatArray) -> FloatArray:
    """Friction velocity at which the grain of a scene would leave on other slopes, m/s.

    It is 0 on slopes down which a grain rolls by itself.
    """
    slopes, place = np.unique(np.round(slopes_deg, 9), return_inverse=True)
    grain = single_grain(scene)
    grains = [grain._replace(slope_deg=slope) for slope in slopes.tolist()]
    each = [answer.friction_velocity for answer in thresholds(scene.forces.law, grains)]
    return np.asarray(np.nan_to_num(np.array(each, float), nan=0.0, posinf=np.inf)[place])


def forces(
    scene: Scene, sizes: ArrayLike = 1.0, gaps: ArrayLike | None = None
) -> tuple[Force, Force]:
    """Drag and lift on exposed grains of a resolved scene.

    `sizes` are diameters over that of the scene; `gaps` are heights of the grains' lowest points
    above the level at which the flow begins, m, by default z0.
    """
    law, grain = LAWS[scene.forces.law], single_grain(scene)
    exposure = Exposure(grain.diameter * np.asarray(sizes, float), *grain[1:5], gaps)
    return partial(law.drag, at=exposure), partial(law.lift, at=exposure)


def regime_of(scene: Scene) -> Regime:
    """Which of Eqs. 2 and 4 holds at the single-grain threshold of a scene."""
    return cast(Regime, str(regime(closed_form(scene, "low"), closed_form(scene, "high"))))


def law_holds(scene: Scene) -> bool:
    """Whether the force law of a resolved scene holds at its single-grain threshold."""
    return bool(closed_form(scene).valid)


def resolved(scenes: Sequence[Scene]) -> Iterator[tuple[Scene, ...]]:
    """Each scene with one force law; by the paper's rule a scene becomes two in the transition."""
    # many thresholds at once take a hundredth of the time that they take one after the other
    grains = {scene.id: single_grain(scene) for scene in scenes}
    for name in {scene.forces.law for scene in scenes} - {PAPER}:
        thresholds(name, [grains[each.id] for each in scenes if each.forces.law == name])
    for name in ("low", "high"):  # the tables have the regime of each scene, whatever its law
        thresholds(name, [*grains.values()])
    for scene in scenes:
        parts = {part: getattr(scene, part) for part in Scene.model_fields}
        laws = LAWS_OF[regime_of(scene)] if scene.forces.law == PAPER else ()
        forces = (scene.forces.model_copy(update={"law": law}) for law in laws)
        yield tuple(Scene(**{**parts, "forces": each}) for each in forces) or (scene,)
