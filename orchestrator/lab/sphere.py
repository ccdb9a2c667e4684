"""One sphere on or among equal ones, in units of d, nu and the fluid's density."""

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.bed.packing import Packing
from orchestrator.grains import sheltering
from orchestrator.grains.peeling import FINE_TABLE, RANGE, Force, ForceTable
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import CLIFT_GAUVIN, LAWS
from orchestrator.study.fidelities import Fields
from orchestrator.types import FloatArray

LAW = LAWS["bridged-gravel"]
"""The force law, which goes on to the Reynolds numbers of the measurements."""
ROUGHNESS = 1 / 30
"""Roughness length z0, d."""
ROWS = 8
"""Rows of the layer across the flow."""
COLUMNS = 20
"""Grains of a row."""
ROW_DISTANCE = np.sqrt(3) / 2
"""Distance of the rows, d."""
POCKET_RISE = np.sqrt(2 / 3)
"""Height of a sphere in a pocket of the layer over the centres of the layer, d."""
SADDLE = np.arctan(np.sqrt(1 / 8))
"""Pivot of a sphere on the layer, which rolls over the saddle between two, radians."""
POCKET = np.radians(30.0)
"""Pivot of a sphere that lies level with its neighbours, radians."""
UNIT = 0.2
"""Middle of the friction velocities of tables, over the Galileo number."""


def sphere(fields: Fields, galileo: float, *, clear: bool) -> float:
    """Find the threshold of a sphere on a close-packed layer of equal ones.

    It stands clear in a pocket and rolls over the saddle between two, or it lies level
    with its neighbours and rolls out of a pocket of 30 degrees.

    Parameters
    ----------
    fields
        The fields of a scene that the model sets: exposure and sheltering count.
    galileo
        Galileo number of the sphere.
    clear
        Whether it stands clear.

    Returns
    -------
    float
        Critical Shields number.
    """
    packing = _layer(clear)
    gaps = ROUGHNESS + packing.centres[:, 1]
    level: Force = np.zeros_like
    if fields.get("forces.sheltering") == "balanced":
        level = _balanced_level(packing, gaps, galileo)
    gap = gaps[0] if "forces.exposure" in fields else ROUGHNESS

    def around(ustar: ArrayLike) -> Grain:
        return Grain(
            diameter=1.0,
            roughness=ROUGHNESS,
            fluid_density=1.0,
            viscosity=1.0,
            gap=gap - level(ustar),
        )

    def drag(ustar: ArrayLike) -> FloatArray:
        return LAW.drag(ustar, around(ustar))

    def lift(ustar: ArrayLike) -> FloatArray:
        return LAW.lift(ustar, around(ustar))

    submerged = np.pi / 6 * galileo**2
    ustar = UNIT * galileo * np.geomspace(*RANGE, FINE_TABLE)
    (table,) = ForceTable.of(drag, lift, np.array([submerged]), ustar)
    pivot = SADDLE if clear else POCKET
    threshold = table.reaching(np.cos(pivot), np.sin(pivot), np.sin(pivot))
    return float(threshold**2 / galileo**2)


def _layer(clear: bool) -> Packing:
    """A close-packed layer, and before all others the sphere on it or level with it."""
    x, y = np.meshgrid(np.arange(COLUMNS) + 0.0, np.arange(ROWS) * ROW_DISTANCE)
    is_shifted = np.arange(ROWS)[:, None] % 2 == 1
    x = x + np.where(is_shifted, 0.5, 0.0)
    middle = COLUMNS / 2 + 0.5
    pocket = np.sqrt(3) / 6
    along = np.append(middle, x.ravel())
    across = np.append(pocket, y.ravel())
    rise = POCKET_RISE if clear else 0.0
    height = np.append(rise, np.zeros(x.size))
    count = len(along)
    return Packing(
        centres=np.column_stack([along, height]),
        sizes=np.ones(count),
        mobile=np.ones(count, bool),
        windward=np.ones(count, bool),
        lee=np.zeros(count, bool),
        arc_length=along,
        across=across,
        width=ROWS * ROW_DISTANCE,
    )


def _balanced_level(
    packing: Packing,
    gaps: FloatArray,
    galileo: float,
) -> Force:
    """The level at which the flow begins around the sphere if drags are balanced."""

    def drag(ustar: FloatArray, sizes: FloatArray, above: FloatArray) -> FloatArray:
        return LAW.drag(
            ustar,
            Grain(
                diameter=sizes,
                roughness=ROUGHNESS,
                fluid_density=1.0,
                viscosity=1.0,
                gap=above,
            ),
        )

    patch, areas = sheltering.patches(packing, 1.0)
    shelter = sheltering.balanced(
        drag,
        patch,
        packing.sizes,
        gaps,
        areas,
        diameter=1.0,
        unit=UNIT * galileo,
        density=1.0,
    )
    return partial(shelter.level, patch=patch[0])


DIAMETER_M = 8e-3
"""Diameter of the spheres that water was seen to lift out of a pocket, m."""
WATER_DENSITY = 1000.0
"""Density of that water, kg/m3."""
WATER_VISCOSITY = 1e-6
"""Kinematic viscosity of that water, m2/s."""


def speed_of(density: float, tangent: float) -> float:
    """Find the speed of water next to a sphere of 8 mm whose drag balances its pivot.

    Parameters
    ----------
    density
        Density of the sphere, kg/m3.
    tangent
        Tangent of its pivot.

    Returns
    -------
    float
        Speed, m/s.

    Examples
    --------
    >>> round(speed_of(2500.0, 0.354), 3)
    0.379
    """
    # the roughness does not matter to a drag at a given speed
    at = Grain(
        diameter=DIAMETER_M,
        density=density,
        fluid_density=WATER_DENSITY,
        viscosity=WATER_VISCOSITY,
    )
    speeds = np.geomspace(0.01, 1.0, 2001)
    drags = CLIFT_GAUVIN.force(speeds, at)
    return float(np.interp(at.weight * tangent, drags, speeds))
