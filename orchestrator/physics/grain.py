"""A grain in its pocket, and the fluid and the bed around it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import (
    GRAIN_COLUMNS,
    GRAVITY,
    LIFT_COEFFICIENT,
    SAND_GRAIN,
)
from orchestrator.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, init=False, eq=False)
class Grain:
    """A grain, or each of many: all that thresholds depend on.

    The fields are broadcast to one shape, read-only.

    Parameters
    ----------
    diameter
        Diameter of the grain, m.
    fluid_density
        Density of the fluid, kg/m3.
    viscosity
        Kinematic viscosity of the fluid, m2/s.
    density
        Density of the grain, kg/m3; NaN where its weight does not matter.
    roughness
        Roughness length z0 of the bed, m; by default d/30, that of identical grains.
    slope_deg
        Slope of the bed, degrees, positive where the flow goes up it.
    entrainment_angle_deg
        Entrainment angle beta, degrees; NaN where its pocket does not matter.
    gravity
        Acceleration of gravity, m/s2.
    cohesion
        Pull of a contact over the diameter, N/m.
    lift_coefficient
        Coefficient alpha_s of Eqs. 2 and 4; laws with a lift of their own ignore it.
    gap
        Height of the grain's lowest point over the level at which the flow begins, m,
        by default z0; laws that do not `protrude` ignore it.
    fall
        Fall of the surface of an open uniform flow, the sine of its slope. The flow's
        own weight drives it then, and its depth is ``theta (s - 1)/fall`` diameters. It
        is 0 in a flow that is much deeper than a grain. Only going on depends on it.
    relative_size
        Diameter of the grain over that of the grains of its bed. Only going on depends
        on it: a pocket has it in the entrainment angle.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3, density=2650.0, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> print(sand.reynolds([0.01, 0.02]), f"{sand.weight:.3e} {sand.galileo:.1f}")
    [10. 20.] 8.475e-06 127.2
    """

    diameter: FloatArray
    density: FloatArray
    fluid_density: FloatArray
    viscosity: FloatArray
    roughness: FloatArray
    slope_deg: FloatArray
    entrainment_angle_deg: FloatArray
    gravity: FloatArray
    cohesion: FloatArray
    lift_coefficient: FloatArray
    gap: FloatArray
    fall: FloatArray
    relative_size: FloatArray

    def __init__(
        self,
        *,
        diameter: ArrayLike,
        fluid_density: ArrayLike,
        viscosity: ArrayLike,
        density: ArrayLike = np.nan,
        roughness: ArrayLike | None = None,
        slope_deg: ArrayLike = 0.0,
        entrainment_angle_deg: ArrayLike = np.nan,
        gravity: ArrayLike = GRAVITY,
        cohesion: ArrayLike = 0.0,
        lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
        gap: ArrayLike | None = None,
        fall: ArrayLike = 0.0,
        relative_size: ArrayLike = 1.0,
    ) -> None:
        if roughness is None:
            roughness = np.asarray(diameter, float) / SAND_GRAIN
        if gap is None:
            gap = roughness
        given = {
            "diameter": diameter,
            "density": density,
            "fluid_density": fluid_density,
            "viscosity": viscosity,
            "roughness": roughness,
            "slope_deg": slope_deg,
            "entrainment_angle_deg": entrainment_angle_deg,
            "gravity": gravity,
            "cohesion": cohesion,
            "lift_coefficient": lift_coefficient,
            "gap": gap,
            "fall": fall,
            "relative_size": relative_size,
        }
        arrays = {name: np.asarray(value, float) for name, value in given.items()}
        # most have one shape already, and a law is asked for some of them often
        shapes = {array.shape for array in arrays.values()}
        shape = np.broadcast_shapes(*shapes)
        for name, array in arrays.items():
            every = array.view()
            every.flags.writeable = False
            if array.shape != shape:
                every = np.broadcast_to(array, shape)
            # the dataclass is frozen
            object.__setattr__(self, name, every)

    @classmethod
    def of_table(cls, table: Any) -> Self:
        """Make the grains of a table, or the one of a row.

        Parameters
        ----------
        table
            A table, a mapping of columns, or a row, with the columns `GRAIN_COLUMNS`.

        Returns
        -------
        Grain
            The grains, each among its like.

        Examples
        --------
        >>> sand = {"d_m": [1e-3, 2e-3], "rho_sol_kg_m3": 2650.0, "cohesion_n_m": 0.0}
        >>> water = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6, "g_m_s2": 9.81}
        >>> bed = {"z0_m": 1e-4, "alpha_deg": 0.0, "beta_deg": 60.0, "alpha_s": 1.6}
        >>> Grain.of_table({**sand, **water, **bed}).shape
        (2,)
        """
        return cls(**{name: table[column] for name, column in GRAIN_COLUMNS.items()})

    @classmethod
    def of_numbers(
        cls,
        galileo: ArrayLike,
        density_ratio: ArrayLike,
        *,
        slope_deg: ArrayLike = 0.0,
        ratio: ArrayLike = 1 / SAND_GRAIN,
        fall: ArrayLike = 0.0,
        relative_size: ArrayLike = 1.0,
    ) -> Self:
        """Make grains by their numbers without dimensions, in a fluid of 1 kg/m3.

        Parameters
        ----------
        galileo
            Galileo number sqrt((s - 1) g d^3)/nu.
        density_ratio
            Density of the grain over that of the fluid, s.
        slope_deg
            Slope of the bed, degrees.
        ratio
            Roughness length over diameter, z0/d.
        fall
            Fall of the surface of an open uniform flow.
        relative_size
            Diameter of the grain over that of the grains of its bed.

        Returns
        -------
        Grain
            Grains of 1 m, of the broadcast shape, at least of shape (1,).

        Examples
        --------
        >>> print(Grain.of_numbers(127.0, [2.65, 2200.0]).galileo.round(9))
        [127. 127.]
        """
        density = np.atleast_1d(np.asarray(density_ratio, float))
        return cls(
            diameter=1.0,
            density=density,
            fluid_density=1.0,
            viscosity=1 / np.asarray(galileo, float),
            roughness=ratio,
            slope_deg=slope_deg,
            gravity=1 / (density - 1),
            fall=fall,
            relative_size=relative_size,
        )

    @classmethod
    def together(cls, grains: Sequence["Grain"]) -> Self:
        """Put grains of shape () into one of shape (n,).

        Parameters
        ----------
        grains
            The grains.

        Returns
        -------
        Grain
            All of them.
        """
        names = [each.name for each in fields(cls)]
        return cls(**{name: [getattr(one, name) for one in grains] for name in names})

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of every field."""
        return self.diameter.shape

    def __len__(self) -> int:
        """Number of grains of shape (n,)."""
        return len(self.diameter)

    @property
    def flat(self) -> "Grain":
        """The same grains, raveled."""
        return self._each(np.ravel)

    def at(self, places: IntArray | BoolArray | slice) -> "Grain":
        """Take some of the grains.

        Parameters
        ----------
        places
            Their places, or a mask of them, along the first axis.

        Returns
        -------
        Grain
            The grains at these places.
        """
        return self._each(lambda array: array[places])

    def changed(self, **numbers: ArrayLike) -> "Grain":
        """Change some fields of the grains.

        Parameters
        ----------
        **numbers
            The new fields, which broadcast with the others; with another roughness the
            gap is z0 again, unless it is given.

        Returns
        -------
        Grain
            The changed grains.
        """
        kept = {each.name: getattr(self, each.name) for each in fields(self)}
        if "roughness" in numbers:
            del kept["gap"]
        return Grain(**{**kept, **numbers})

    def _each(self, change: Callable[[FloatArray], FloatArray]) -> "Grain":
        """Grains whose fields are changed alike."""
        names = [each.name for each in fields(self)]
        return Grain(**{name: change(getattr(self, name)) for name in names})

    @property
    def rows(self) -> list[tuple[float, ...]]:
        """The fields of each grain in the order of the class, raveled."""
        columns = [np.ravel(getattr(self, each.name)) for each in fields(self)]
        return list(zip(*(column.tolist() for column in columns), strict=True))

    @classmethod
    def of_rows(cls, rows: Sequence[tuple[float, ...]]) -> Self:
        """Make grains of their `rows`.

        Parameters
        ----------
        rows
            The fields of each grain.

        Returns
        -------
        Grain
            The grains, of shape (n,).
        """
        names = [each.name for each in fields(cls)]
        columns = np.array(rows, float).T
        return cls(**dict(zip(names, columns, strict=True)))

    @property
    def ratio(self) -> FloatArray:
        """Roughness length over diameter, z0/d."""
        return np.asarray(self.roughness / self.diameter)

    @property
    def density_ratio(self) -> FloatArray:
        """Density of the grain over that of the fluid, s."""
        return np.asarray(self.density / self.fluid_density)

    @property
    def layer_weight(self) -> FloatArray:
        """Weight of a layer of grains under the fluid, (rho_sol - rho_f) g d, Pa.

        A stress over it is a Shields number.
        """
        excess = self.density - self.fluid_density
        return np.asarray(excess * self.gravity * self.diameter)

    @property
    def weight(self) -> FloatArray:
        """Submerged weight W of the grain, N."""
        return np.asarray(np.pi / 6 * self.diameter**2 * self.layer_weight)

    @property
    def unit_ustar(self) -> FloatArray:
        """Friction velocity of a Shields number of 1, sqrt((s - 1) g d), m/s."""
        return np.asarray(np.sqrt(self.layer_weight / self.fluid_density))

    @property
    def galileo(self) -> FloatArray:
        """Galileo number sqrt((s - 1) g d^3)/nu."""
        return self.reynolds(self.unit_ustar)

    @property
    def dimensionless_diameter(self) -> FloatArray:
        """The diameter D* = d ((s - 1) g/nu^2)^(1/3)."""
        return np.asarray(self.galileo ** (2 / 3))

    def reynolds(self, ustar: ArrayLike) -> FloatArray:
        """Compute the friction Reynolds number Re* = ustar d/nu.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.

        Returns
        -------
        FloatArray
            Friction Reynolds number, of the broadcast shape.
        """
        return np.asarray(np.asarray(ustar, float) * self.diameter / self.viscosity)

    def ustar(self, reynolds: ArrayLike) -> FloatArray:
        """Compute the friction velocity of a friction Reynolds number.

        Parameters
        ----------
        reynolds
            Friction Reynolds number Re*.

        Returns
        -------
        FloatArray
            Friction velocity, m/s, of the broadcast shape.
        """
        return np.asarray(np.asarray(reynolds, float) * self.viscosity / self.diameter)

    def shields(self, ustar: ArrayLike) -> FloatArray:
        """Compute the Shields number of a friction velocity.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.

        Returns
        -------
        FloatArray
            Shields number, of the broadcast shape.
        """
        stress = self.fluid_density * np.square(np.asarray(ustar, float))
        return np.asarray(stress / self.layer_weight)

    def ustar_at(self, shields: ArrayLike) -> FloatArray:
        """Compute the friction velocity of a Shields number.

        Parameters
        ----------
        shields
            Shields number.

        Returns
        -------
        FloatArray
            Friction velocity, m/s, of the broadcast shape.
        """
        stress = np.asarray(shields, float) * self.layer_weight
        with np.errstate(invalid="ignore"):  # of what is not known
            return np.asarray(np.sqrt(stress / self.fluid_density))
