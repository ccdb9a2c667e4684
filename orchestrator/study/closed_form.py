"""The closed form of the single grain of a scene.

It has the grain's forces, its threshold, and the paper's rule.

Thousands of scenes share few grains: thresholds are computed for many grains at once,
and kept.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import cast

from orchestrator.physics import velocity
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import DEFAULT
from orchestrator.physics.threshold import (
    AUTO,
    LAWS_OF,
    PAPER,
    Regime,
    Threshold,
    regime,
    thresholds_of,
    usual_law,
)
from orchestrator.study.scene import CELLS_OVER_Z0, Scene


@cache  # every question to a scene begins with it
def single_grain(scene: Scene) -> Grain:
    """Make the single grain of a scene.

    Returns
    -------
    Grain
        The grain, of shape (); its entrainment angle is that of its pocket.
    """
    grain = scene.grain
    bed = scene.bed
    fluid = scene.fluid
    # at a contact of two sizes the pull is that of their harmonic mean
    cohesion = grain.cohesion * 2 / (1 + bed.relative_size)
    return Grain(
        diameter=grain.diameter,
        roughness=bed.roughness,
        fluid_density=fluid.density,
        viscosity=fluid.viscosity,
        lift_coefficient=scene.forces.lift_coefficient,
        density=grain.density,
        slope_deg=bed.slope_deg,
        entrainment_angle_deg=scene.pocket_angle_deg,
        gravity=fluid.gravity,
        cohesion=cohesion,
        relative_size=bed.relative_size,
    )


def closed_form(scene: Scene, name: str | None = None) -> Threshold:
    """Find the threshold of the grain of a scene under a force law.

    Under gusts u*, Re* and the Shields number are those of the mean flow, the forces
    those of the gust.

    Parameters
    ----------
    scene
        The scene.
    name
        Name of the force law, by default the scene's own.

    Returns
    -------
    Threshold
        The threshold, of shape ().
    """
    grain = single_grain(scene)
    law = name or _law_of(scene, grain)
    at = thresholds_of(law, grain)
    if scene.gust == 1:
        return at
    root = scene.gust**0.5
    mean = {
        "friction_velocity": at.friction_velocity / root,
        "reynolds": at.reynolds / root,
    }
    return replace(at, **mean, shields=at.shields / scene.gust)


def flow_roughness(scene: Scene) -> float | None:
    """Find the roughness length of the flow over the bed of a pile.

    Where the bed is not rough viscosity adds to its own, by the friction velocity at
    which a single grain moves; a sublayer that is thicker than the first cells bears no
    turbulent flow. The flows of Eqs. 2 and 4 are the paper's, over a rough wall.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    float, or None
        The length, m; None if it is the bed's own.
    """
    if scene.forces.law in LAWS_OF["transition"]:
        return None
    z0 = scene.bed.roughness
    ustar = closed_form(scene).friction_velocity
    outer = float(velocity.outer_roughness(z0, ustar, scene.fluid.viscosity))
    outer = min(float(f"{outer:.3g}"), scene.first_cell_height / CELLS_OVER_Z0)
    return outer if outer > z0 else None


def regime_of(scene: Scene) -> Regime:
    """Say which of Eqs. 2 and 4 holds at the single-grain threshold of a scene.

    Returns
    -------
    str
        ``low``, ``high`` or ``transition``.
    """
    return cast(
        Regime, str(regime(closed_form(scene, "low"), closed_form(scene, "high")))
    )


def law_holds(scene: Scene) -> bool:
    """Say whether the force law of a scene holds at its single-grain threshold.

    Parameters
    ----------
    scene
        A scene with one force law.

    Returns
    -------
    bool
        Whether it does.
    """
    return bool(closed_form(scene).valid)


def _law_of(scene: Scene, grain: Grain) -> str:
    """The force law of a scene and its grain; one that holds if none is asked for."""
    if scene.forces.law != AUTO:
        return scene.forces.law
    return usual_law(grain)


def resolved(scenes: Sequence[Scene]) -> Iterator[tuple[Scene, ...]]:
    """Give each scene one force law.

    Where a scene leaves the law open, it is one that holds for its single grain. By the
    paper's rule a scene becomes two in the transition.

    Parameters
    ----------
    scenes
        The scenes.

    Yields
    ------
    tuple of Scene
        One or two scenes for each.
    """
    # many thresholds at once take a hundredth of the time that they take one after
    # another
    grains = {scene.id: single_grain(scene) for scene in scenes}
    asked: dict[str, list[Grain]] = {"low": [], "high": []}
    for scene in scenes:
        grain = grains[scene.id]
        # the tables have the regime of each scene, whatever its law
        asked["low"].append(grain)
        asked["high"].append(grain)
        name = DEFAULT if scene.forces.law == AUTO else scene.forces.law
        if name != PAPER:
            asked.setdefault(name, []).append(grain)
    for name, of_law in asked.items():
        thresholds_of(name, Grain.together(of_law))
    for scene in scenes:
        laws: tuple[str, ...] = (scene.forces.law,)
        if scene.forces.law == AUTO:
            laws = (_law_of(scene, grains[scene.id]),)
        elif scene.forces.law == PAPER:
            laws = LAWS_OF[regime_of(scene)]
        yield tuple(_under(scene, law) for law in laws)


def _under(scene: Scene, law: str) -> Scene:
    """A scene under another force law."""
    if law == scene.forces.law:
        return scene
    parts = {part: getattr(scene, part) for part in Scene.model_fields}
    parts["forces"] = scene.forces.model_copy(update={"law": law})
    return Scene(**parts)
