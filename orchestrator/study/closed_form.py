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
from orchestrator.physics.threshold import LAWS_OF, Regime, Threshold, regime, threshold
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

Force = Callable[[ArrayLike], FloatArray]
"""A force (N) of friction velocities (m/s)."""
PAPER = "paper"
"""The paper's rule in a study file: Eq. 2 or Eq. 4 where each holds, both in the transition."""


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
    return SingleGrain(
        diameter=scene.grain.diameter,
        roughness=scene.bed.roughness,
        fluid_density=scene.fluid.density,
        viscosity=scene.fluid.viscosity,
        lift_coefficient=scene.forces.lift_coefficient,
        density=scene.grain.density,
        slope_deg=scene.bed.slope_deg,
        entrainment_angle_deg=scene.pocket_angle_deg,
        gravity=scene.fluid.gravity,
    )


def thresholds(name: str, grains: Sequence[tuple[float, ...]]) -> list[Threshold]:
    """The thresholds of grains under a force law, each of shape ().

    Parameters
    ----------
    name : str
        The force law.
    grains : sequence of SingleGrain
        Tuples of the same numbers will do.
    """
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
    answers = thresholds(scene.forces.law, grains)
    each = np.array([answer.friction_velocity for answer in answers], float)
    return np.asarray(np.nan_to_num(each, nan=0.0, posinf=np.inf)[place])


def forces(
    scene: Scene, sizes: ArrayLike = 1.0, gaps: ArrayLike | None = None
) -> tuple[Force, Force]:
    """Drag and lift on exposed grains of a resolved scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    sizes : array_like
        Diameters of the grains over that of the scene.
    gaps : array_like, optional
        Heights of their lowest points above the level at which the flow begins, m; by default z0.
    """
    law, grain = LAWS[scene.forces.law], single_grain(scene)
    exposure = Exposure(grain.diameter * np.asarray(sizes, float), *grain[1:5], gaps)
    return partial(law.drag, exposure=exposure), partial(law.lift, exposure=exposure)


def regime_of(scene: Scene) -> Regime:
    """Which of Eqs. 2 and 4 holds at the single-grain threshold of a scene."""
    return cast(Regime, str(regime(closed_form(scene, "low"), closed_form(scene, "high"))))


def law_holds(scene: Scene) -> bool:
    """Whether the force law of a resolved scene holds at its single-grain threshold."""
    return bool(closed_form(scene).valid)


def resolved(scenes: Sequence[Scene]) -> Iterator[tuple[Scene, ...]]:
    """Each scene with one force law; by the paper's rule a scene becomes two in the transition."""
    # many thresholds at once take a hundredth of the time that they take one after the other
    for name in {scene.forces.law for scene in scenes} - {PAPER}:
        thresholds(name, [single_grain(each) for each in scenes if each.forces.law == name])
    for name in ("low", "high"):  # the tables have the regime of each scene, whatever its law
        thresholds(name, [single_grain(scene) for scene in scenes])
    for scene in scenes:
        if scene.forces.law != PAPER:
            yield (scene,)
            continue
        parts = {part: getattr(scene, part) for part in Scene.model_fields}
        laws = LAWS_OF[regime_of(scene)]
        forces = (scene.forces.model_copy(update={"law": law}) for law in laws)
        yield tuple(Scene(**{**parts, "forces": each}) for each in forces)
