"""Classes of scenes: a numerical error was measured on one class alone.

The error of a fidelity has two parts, that of the flow and that of the grains. Each
part has its classes: the flow does not depend on the packing, nor the grains on what is
above the flow.
"""

import math
from functools import cache

from orchestrator.bed.line import of_bed
from orchestrator.fidelity.fidelities import packing
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

FLOW, GRAINS = "flow", "grains"
"""The two parts of a numerical error."""
BY_DEM = "grains by DEM"
"""Part of the domain of what moves grains in time: a smaller one than that of pivots
and peeling, which were compared with DEM on more piles."""
LEVEL_BED = "level bed"
"""Class for the flow of beds over which u* is u*_0 everywhere."""
LIMITING = ", limiting slope"
"""End of the name of a class of beds near the limiting slope."""
LIFTED = ", lifted"
"""End of the name of a class of grains that lift takes off before they roll."""
SMALL = ", small"
"""End of the name of a class of beds with few grains."""
LEAST_COUNTED = 38.0
"""Counted grains of a bed that is not small."""
LIMITING_DEG = 5.0
"""How far below the limiting slope a slope belongs to it, degrees."""
LEAST_DISORDER = 0.02
"""Largest gaps of the class of slight random gaps, d."""
MOST_DISORDER = 0.2
"""Largest gaps of the class of other random gaps, d."""
NEAR_ROWS = ("aligned", f"disordered up to {LEAST_DISORDER:g} d")


@cache
def scene_class(part: str, scene: Scene) -> str:
    """The class of a pile for the flow or for the grains.

    For the flow it names how the stress is read, and what the flow goes over or under.
    For the grains it names their packing, and whether lift takes them off before they
    roll.

    Parameters
    ----------
    part
        `FLOW` or `GRAINS`.
    scene
        The scene of a pile.

    Returns
    -------
    str
        The name of the class.
    """
    if part == FLOW:
        return _flow_class(scene)
    return _grain_class(scene)


def _flow_class(scene: Scene) -> str:
    """The class of a pile for the errors of its flow."""
    bed = scene.bed
    stress = scene.forces.stress
    assert isinstance(bed, PileBed)
    if bed.is_level:
        return LEVEL_BED
    if bed.obstacles:
        return f"{stress}, obstacles"
    if is_curved(bed):
        return f"{stress}, curved forms"
    if scene.flow.top != "boundary layer":
        return f"{stress}, channel"
    if stress != "wall":
        return stress
    if _is_random(bed):
        return f"{stress}, random beds"
    name: str = stress
    if is_limiting(scene):
        name += LIMITING
    if is_small(scene):
        name += SMALL
    return name


def _grain_class(scene: Scene) -> str:
    """The class of a pile for the errors of its grains."""
    bed = scene.bed
    assert isinstance(bed, PileBed)
    name = packing(scene)
    if name == "disordered":
        most = MOST_DISORDER
        if bed.disorder <= LEAST_DISORDER:
            most = LEAST_DISORDER
        name += f" up to {most:g} d"
    is_near_row = name in NEAR_ROWS
    if lift_over_weight(scene) > 1:
        # a lifted grain does not roll over those beside it: slight gaps change nothing
        if is_near_row:
            name = "aligned"
        return f"{name}{LIFTED}"
    if bed.form.is_level and not bed.profile:
        return f"{name}, level bed"
    if is_curved(bed):
        return f"{name}, curved forms"
    # on any slope it is chaotic which grain of horizontal rows and of large gaps goes
    # first
    if is_near_row and is_limiting(scene):
        name += LIMITING
    if bed.packing == "aligned" and is_small(scene):
        name += SMALL
    return name


def is_curved(bed: PileBed) -> bool:
    """Whether a bed has no edge where a row of grains could begin to leave.

    Returns
    -------
    bool
        Whether it has none.
    """
    return bool(bed.profile) or bed.is_bent or bed.form.is_curved


def is_small(scene: Scene) -> bool:
    """Whether so few grains are counted that a tenth of them is a few.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    bool
        Whether fewer than `LEAST_COUNTED` are counted.
    """
    bed = scene.bed
    assert isinstance(bed, PileBed)
    line = of_bed(bed)
    counted = line.lengths[line.counted(bed.counts)].sum()
    return bool(counted < LEAST_COUNTED * scene.grain.diameter)


def _is_random(bed: PileBed) -> bool:
    """Whether which grain goes first depends on the draw of the bed."""
    if bed.packing == "disordered":
        return bed.disorder > LEAST_DISORDER
    return bed.packing == "poured"


def is_limiting(scene: Scene) -> bool:
    """Whether the slope is near that on which grains leave without any flow.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    bool
        Whether it is.
    """
    return scene.limiting_slope_deg - scene.bed.slope_deg < LIMITING_DEG


def lift_over_weight(scene: Scene) -> float:
    """Compute lift over the weight normal to the bed when a grain would roll.

    Returns
    -------
    float
        The ratio; above 1 the grain is gone before it rolls.
    """
    normal = scene.weight * math.cos(math.radians(scene.bed.slope_deg))
    return float(closed_form(scene).lift) / normal
