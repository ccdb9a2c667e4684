"""The closed form of a scene's single grain: its force law, its threshold, the paper's rule.

Thousands of scenes share few grains. Thresholds are found for many of them at once, and each once.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.physics.exposure import Exposure
from orchestrator.physics.force_law import ForceLaw
from orchestrator.physics.laws import LAWS
from orchestrator.physics.regime import LAWS_OF, Regime, regime
from orchestrator.physics.threshold import Threshold, threshold
from orchestrator.study.scene import Scene

FloatArray = NDArray[np.float64]
Force = Callable[[ArrayLike], FloatArray]
"""A force (N) of friction velocities (m/s)."""
Key = tuple[str, tuple[float, ...]]

PAPER = "paper"
"""The paper's rule in a study file: Eq. 2 or Eq. 4 where each holds, both in the transition."""
_KNOWN: dict[Key, Threshold] = {}


def law(scene: Scene) -> ForceLaw:
    """The force law of a resolved scene."""
    return LAWS[scene.forces.law]


def exposure(scene: Scene, sizes: ArrayLike = 1.0, gaps: ArrayLike | None = None) -> Exposure:
    """Exposure of a grain of a scene: all that its force depends on besides the friction velocity.

    Grains of other sizes are given by their diameters, in that of the scene; their lowest points
    lie some gaps (m) above the level of the flow, by default z0.
    """
    return Exposure(
        scene.grain.diameter * np.asarray(sizes, float),
        scene.bed.roughness,
        scene.fluid.density,
        scene.fluid.viscosity,
        scene.forces.lift_coefficient,
        gaps,
    )


def forces(
    scene: Scene, sizes: ArrayLike = 1.0, gaps: ArrayLike | None = None
) -> tuple[Force, Force]:
    """Drag and lift on an exposed grain of a resolved scene, or on grains of some sizes."""
    here, there = law(scene), exposure(scene, sizes, gaps)
    return partial(here.drag, exposure=there), partial(here.lift, exposure=there)


def closed_form(scene: Scene, name: str | None = None) -> Threshold:
    """The threshold of one grain of a scene; numbers of shape ().

    Parameters
    ----------
    scene : Scene
        The scene.
    name : str, optional
        A force law; by default the scene's own.
    """
    return closed_forms([scene], name or scene.forces.law)[0]


def closed_forms(scenes: Sequence[Scene], name: str) -> list[Threshold]:
    """The thresholds of many scenes under one force law, a hundred times faster than in turn."""
    return known(name, [_grain(scene) for scene in scenes])


def on_slopes(scene: Scene, slopes_deg: FloatArray) -> FloatArray:
    """Friction velocity at which a grain of a scene leaves on other slopes, m/s.

    It is 0 on slopes down which a grain rolls by itself.
    """
    *others, _, angle_deg, gravity = _grain(scene)
    slopes, place = np.unique(np.round(slopes_deg, 9), return_inverse=True)
    grains = [(*others, slope, angle_deg, gravity) for slope in slopes.tolist()]
    found = np.array([one.friction_velocity for one in known(scene.forces.law, grains)], float)
    return np.asarray(np.nan_to_num(found, nan=0.0, posinf=np.inf)[place])


def known(name: str, grains: Sequence[tuple[float, ...]]) -> list[Threshold]:
    """The thresholds of grains under a law; each is found once.

    A grain is its diameter, roughness length, fluid density, viscosity, lift coefficient, density,
    slope, entrainment angle and gravity: all that the closed form depends on.
    """
    keys = [(name, grain) for grain in grains]
    new = list(dict.fromkeys(key for key in keys if key not in _KNOWN))
    if new:
        columns = np.array([grain for _, grain in new]).T
        _KNOWN.update(zip(new, _split(_threshold(LAWS[name], *columns)), strict=True))
    return [_KNOWN[key] for key in keys]


def _grain(scene: Scene) -> tuple[float, ...]:
    """All numbers that the closed form depends on."""
    return (
        scene.grain.diameter,
        scene.bed.roughness,
        scene.fluid.density,
        scene.fluid.viscosity,
        scene.forces.lift_coefficient,
        scene.grain.density,
        scene.bed.slope_deg,
        scene.pocket_angle_deg,
        scene.fluid.gravity,
    )


def _threshold(here: ForceLaw, *columns: FloatArray) -> Threshold:
    *exposed, density, slope_deg, angle_deg, gravity = columns
    return threshold(
        here,
        Exposure(*exposed),
        density=density,
        slope_deg=slope_deg,
        entrainment_angle_deg=angle_deg,
        gravity=gravity,
    )


def _split(found: Threshold) -> Iterator[Threshold]:
    columns = [getattr(found, name) for name in Threshold.__dataclass_fields__]
    return (Threshold(*row) for row in zip(*columns, strict=True))


def regime_of(scene: Scene) -> Regime:
    """Which of Eqs. 2 and 4 holds at a scene's own single-grain threshold."""
    return _regime(_grain(scene))


@cache
def _regime(grain: tuple[float, ...]) -> Regime:
    (low,), (high,) = (known(name, [grain]) for name in ("low", "high"))
    return cast(Regime, str(regime(low, high)))


def law_holds(scene: Scene) -> bool:
    """Whether the force law of a resolved scene holds at its own single-grain threshold."""
    return bool(closed_form(scene).valid)


def resolved(scenes: Sequence[Scene]) -> Iterator[tuple[Scene, ...]]:
    """Each scene with one force law; by the paper's rule one becomes two in the transition.

    Many scenes at once take a hundredth of the time that one after the other takes.
    """
    named = {scene.forces.law for scene in scenes} - {PAPER, "low", "high"}
    for name in named:
        closed_forms([scene for scene in scenes if scene.forces.law == name], name)
    for name in ("low", "high"):  # the regime of each is in the tables, whatever its law
        closed_forms(scenes, name)
    for scene in scenes:
        asked = scene.forces.law
        yield tuple(_under(scene, LAWS_OF[regime_of(scene)] if asked == PAPER else (asked,)))


def _under(scene: Scene, names: Iterable[str]) -> Iterator[Scene]:
    """The scene under each of some force laws."""
    parts = {part: getattr(scene, part) for part in Scene.model_fields}
    for name in names:
        forces = scene.forces.model_copy(update={"law": name})
        yield scene if name == scene.forces.law else Scene(**{**parts, "forces": forces})
