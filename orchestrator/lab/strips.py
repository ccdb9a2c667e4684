"""Level strips of sand: thresholds of their grains by pivots, and these pivots.

The threshold of a bed depends on the Galileo number
``Ga = sqrt((rho_sol/rho_f - 1) g d^3)/nu``, the slope and the cohesion alone, so that a
few solves answer hundreds of measured beds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from orchestrator.bed.packing import Packing
from orchestrator.bed.places import Places
from orchestrator.grains import peeling, threshold
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import loads_of
from orchestrator.study.closed_form import single_grain
from orchestrator.study.fidelities import Fields
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.types import BoolArray, FloatArray

MOVED = 0.1
"""Part of the exposed grains that has moved at the threshold of a bed."""
GALILEO = np.geomspace(0.3, 1e5, 12)
"""Galileo numbers at which the threshold of a level bed is found."""
SLOPES = np.array([0.0, 0.1, 0.2, 0.3, 0.4])
"""Tangents of the beds that fall with the flow, at which the effect of the slope is."""
ROUGH = 1e4
"""Galileo number at which the effect of the slope is found."""
PERCENTILES = np.array([10.0, 25.0, 50.0, 75.0, 90.0])
"""Percentiles of the pivots."""
LAID = 40
"""Test grains that are laid on each strip for their pivots."""
STEPS = np.geomspace(0.1, 1e-6, 20)
"""Lengths of the steps by which a laid grain rolls to its place, d."""
REPEATS = 80
"""Steps of each length."""


class Counted(NamedTuple):
    """The counted grains of a strip, arrays of shape (n,).

    Attributes
    ----------
    shields
        Shields number at which each moves, with the stress over (rho_sol - rho_f) g d.
    sizes
        Their diameters, d.
    is_free
        Whether a free way leads it out of its place.
    """

    shields: FloatArray
    sizes: FloatArray
    is_free: BoolArray


@dataclass(frozen=True)
class Strips:
    """Level strips of sand.

    Attributes
    ----------
    scenes
        The strips, which differ in their seeds alone.
    cases
        Directory of the finished runs.
    """

    scenes: Sequence[Scene]
    cases: Path

    def geometries(
        self,
        fields: Fields,
        galileo: float,
        bond: float = 0.0,
    ) -> list[Geometry]:
        """Make the strips under a model.

        Parameters
        ----------
        fields
            The fields of a scene that the model sets.
        galileo
            Galileo number of the grains of d.
        bond
            Pull of a contact over the weight of a grain.

        Returns
        -------
        list of Geometry
            The strips.
        """
        scene = self.scenes[0]
        grain = single_grain(scene)
        viscosity = float(grain.viscosity * grain.galileo / galileo)
        changes = {
            **fields,
            "fluid.viscosity": viscosity,
            "grain.cohesion": bond * scene.weight / scene.grain.diameter,
        }
        return [Geometry(changed(each, changes), self.cases) for each in self.scenes]

    def grains(
        self,
        fields: Fields,
        galileo: float,
        slope: float = 0.0,
        bond: float = 0.0,
    ) -> list[Counted]:
        """Find the flow at which each counted grain moves by its pivot.

        Parameters
        ----------
        fields
            The fields of a scene that the model sets.
        galileo
            Galileo number of the grains of d.
        slope
            Tangent by which the bed falls with the flow: the strip and its forces are
            turned.
        bond
            Pull of a contact over the weight of a grain.

        Returns
        -------
        list of Counted
            The counted grains of each strip.
        """
        beds = self.geometries(fields, galileo, bond)
        return [self._counted(bed, slope) for bed in beds]

    def _counted(self, bed: Geometry, slope: float) -> Counted:
        """The counted grains of one strip."""
        angle = np.arctan(slope)
        turn = np.array(
            [
                [np.cos(angle), np.sin(angle)],
                [-np.sin(angle), np.cos(angle)],
            ]
        )
        packed = bed.packing
        loads = loads_of(bed, self.cases)
        places = Places.of(packed.centres @ turn.T, packed.across, packed.width)
        loading = replace(
            loads.loading,
            ratio=np.where(packed.windward, loads.loading.ratio, 0.0),
            along=loads.loading.along @ turn.T,
            outward=loads.loading.outward @ turn.T,
        )
        bond = bed.scene.bond
        ustar = peeling.pivots(places, packed.sizes, loading, loads.tables, bond)
        shields = single_grain(bed.scene).shields(ustar[packed.windward])
        return Counted(shields, packed.sizes[packed.windward], bed.is_free)

    def shields(
        self,
        fields: Fields,
        galileo: float,
        slope: float = 0,
        bond: float = 0,
    ) -> float:
        """Find the threshold at which `MOVED` of the grains have moved.

        Grains that the bed's slope alone sets in motion have gone before the flow
        begins.

        Parameters
        ----------
        fields
            The fields of a scene that the model sets.
        galileo
            Galileo number of the grains of d.
        slope
            Tangent by which the bed falls with the flow.
        bond
            Pull of a contact over the weight of a grain.

        Returns
        -------
        float
            Shields number, the geometric mean of the strips.
        """
        thresholds = []
        for strip in self.grains(fields, galileo, slope, bond):
            held = np.sort(strip.shields[strip.shields > 0])
            rank = int(np.ceil(MOVED * len(held)))
            thresholds.append(held[max(rank - 1, 0)])
        return float(np.exp(np.mean(np.log(thresholds))))

    def interpolated(
        self,
        fields: Fields,
    ) -> Callable[[FloatArray, FloatArray], FloatArray]:
        """Find the threshold of a bed as a function of Galileo number and slope.

        Parameters
        ----------
        fields
            The fields of a scene that the model sets.

        Returns
        -------
        Callable
            The Shields number of Galileo numbers and of tangents of the slope, arrays
            of one shape.
        """
        ln_level = np.log([self.shields(fields, float(each)) for each in GALILEO])
        on_slopes = [self.shields(fields, ROUGH, float(slope)) for slope in SLOPES]
        factor = np.array(on_slopes) / on_slopes[0]

        def shields(galileo: FloatArray, slope: FloatArray) -> FloatArray:
            level = np.exp(np.interp(np.log(galileo), np.log(GALILEO), ln_level))
            return np.asarray(level * np.interp(slope, SLOPES, factor))

        return shields

    def pivots_deg(self) -> FloatArray:
        """Find the pivots of grains of d that are laid on the strips.

        Returns
        -------
        FloatArray
            `PERCENTILES` of their angles, degrees.
        """
        beds = self.geometries({}, ROUGH)
        angles = [laid(bed.packing, LAID, bed.bed.seed) for bed in beds]
        return np.asarray(np.nanpercentile(np.concatenate(angles), PERCENTILES))

    def hiding(self, fields: Fields, mobility: float) -> float:
        """Find the exponent p of theta_i ~ (D_i/D_50)^p over the mixture's classes.

        Only grains that a free way leads out, and that the bed holds without a flow,
        count in a class.

        Parameters
        ----------
        fields
            The fields of a scene that the model sets.
        mobility
            Exponent m of the parts of the classes, as of `threshold.hiding_exponent`.

        Returns
        -------
        float
            The exponent. It is NaN with fewer than two classes of enough grains.
        """
        return hiding_of(self.grains(fields, ROUGH), mobility)


def hiding_of(strips: Sequence[Counted], mobility: float) -> float:
    """Find the exponent of hiding of the grains of some strips together.

    Parameters
    ----------
    strips
        The counted grains of each.
    mobility
        As of `threshold.hiding_exponent`.

    Returns
    -------
    float
        The exponent.
    """
    sizes = np.concatenate([strip.sizes for strip in strips])
    own = np.concatenate([strip.shields for strip in strips]) / sizes
    is_free = np.concatenate([strip.is_free for strip in strips])
    return threshold.hiding_exponent(own, sizes, (own > 0) & is_free, mobility)


def laid(packed: Packing, count: int, seed: int = 0) -> FloatArray:
    """Lay grains of d on a strip, and find the pivots of the places that they take.

    Each rolls down the surface that its centre can reach, in random directions and ever
    shorter steps, until it lies on three grains.

    Parameters
    ----------
    packed
        The strip.
    count
        Number of grains, each laid alone.
    seed
        Seed of the random places and directions.

    Returns
    -------
    FloatArray
        Pivot angles downstream, degrees, of shape (count,).
    """
    rng = np.random.default_rng(seed)
    surface = _Surface(packed.places.xyz, (packed.sizes + 1) / 2, packed.width)
    # away from the ends of the strip
    first, last = np.quantile(surface.xyz[packed.windward, 0], [0.1, 0.9]).tolist()
    x = rng.uniform(first, last, count)
    y = rng.uniform(0, packed.width, count)
    resting = surface.rolled_down(x, y, rng)
    sizes = np.append(1.0, packed.sizes)
    along = np.tile([1.0, 0.0], (len(sizes), 1))
    angles = []
    for centre in resting:
        places = Places(np.vstack([centre, surface.xyz]), packed.width)
        angle, *_ = peeling.pivot_angles_deg(places, sizes, along, only=0)
        angles.append(angle)
    return np.array(angles)


@dataclass(frozen=True)
class _Surface:
    """The surface of a strip of some width that the centre of a grain of d can reach.

    `xyz` are the centres of the grains of the strip, shape (n, 3), and `reach` the
    distances of a centre that touches each, shape (n,).
    """

    xyz: FloatArray
    reach: FloatArray
    width: float

    def height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of the surface at some places; -inf where there are no grains."""
        half = self.width / 2
        across = (y[:, None] - self.xyz[:, 1] + half) % self.width - half
        along = x[:, None] - self.xyz[:, 0]
        squared_rise = self.reach**2 - along**2 - across**2
        top = self.xyz[:, 2] + np.sqrt(np.maximum(squared_rise, 0.0))
        return np.asarray(np.where(squared_rise > 0, top, -np.inf).max(axis=1))

    def rolled_down(
        self,
        x: FloatArray,
        y: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Centres of grains that have rolled down from some places, shape (n, 3)."""
        z = self.height(x, y)
        for step in STEPS.repeat(REPEATS):
            direction = rng.uniform(0, 2 * np.pi, len(x))
            to_x = x + step * np.cos(direction)
            to_y = y + step * np.sin(direction)
            to_z = self.height(to_x, to_y)
            is_lower = to_z < z
            x = np.where(is_lower, to_x, x)
            y = np.where(is_lower, to_y, y)
            z = np.where(is_lower, to_z, z)
        return np.column_stack([x, y % self.width, z])
