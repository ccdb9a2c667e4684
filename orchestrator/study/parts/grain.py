"""The grains of a scene."""

from typing import Annotated, Any, Self

from pydantic import field_validator, model_validator

from orchestrator.study import sizes
from orchestrator.study.info import Info
from orchestrator.study.parts.part import Part, UnfitError, unless
from orchestrator.study.ranges import Damping, Density, Diameter, FrictionAngle, Stiffness
from orchestrator.study.sizes import Sizes

OFF_MEDIAN = 0.01
"""Largest difference of a log-normal mixture's d50 from the diameter, relative: Shields numbers and
a roughness length of d/30 take the diameter."""


class Grain(Part):
    """Equal spheres and their contact law."""

    diameter: Annotated[Diameter, Info("diameter", "d", "m", "d_m")]
    """grain diameter"""
    density: Annotated[Density, Info("grain density", "ρ_sol", "kg/m³", "rho_sol_kg_m3")] = 2500.0
    """density of the grains"""
    friction_angle_deg: Annotated[FrictionAngle, Info("friction angle", "φ", "°", "phi_deg")] = 35.0
    """angle of Coulomb's friction between grains"""
    stiffness: Annotated[Stiffness, Info("stiffness", "K d/W", scope="DEM", about="answer")] = 1e4
    """spring constant of a contact, normal and tangential, times the diameter over the weight"""
    damping: Annotated[Damping, Info("damping", scope="DEM", about="answer")] = 0.1
    """damping ratio of a collision"""
    sizes: Annotated[Sizes | None, unless(None), Info("sizes", scope="poured beds")] = None
    """mixture of a poured bed; by default all grains have the diameter. A sieve table: rows of
    diameter (m, rising) and mass fraction, or the name of a file with columns diameter_m and
    fraction; its d50 is the diameter. Or a log-normal
    distribution by mass about the diameter, { sigma_g = 1.3, smallest = 0.6, largest = 1.7 }, with
    cut-offs in d, two geometric standard deviations by default"""

    @field_validator("sizes", mode="before")
    @classmethod
    def _sizes_of_a_file(cls, value: Any) -> Any:
        try:
            return sizes.read(value)
        except ValueError as error:
            remedy = "write [[5e-4, 0.4], [1e-3, 0.6]], or { sigma_g = 1.3 }"
            raise UnfitError("grain.sizes", str(error), remedy) from None

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.sizes is None:
            return self
        if what := sizes.fault(self.sizes):
            raise UnfitError("grain.sizes", what, "look at the rows")
        median = sizes.percentile(self.sizes, self.diameter, 0.5)
        if abs(median / self.diameter - 1) > OFF_MEDIAN and not isinstance(self.sizes, tuple):
            what = f"between these cut-offs d50 is {median:.4g} m, not the diameter"
            raise UnfitError("grain.sizes", what, "write smallest = 1/largest")
        if isinstance(self.sizes, tuple) and abs(self.diameter / median - 1) > 1e-9:
            what = f"the d50 of grain.sizes is {median:.9g} m"
            raise UnfitError("grain.diameter", what, "leave it out")
        return self
