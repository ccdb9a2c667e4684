"""The fluid of a scene."""

from typing import Annotated

from orchestrator.physics.constants import GRAVITY
from orchestrator.study.info import Info
from orchestrator.study.parts.part import Part
from orchestrator.study.ranges import FluidDensity, Gravity, Viscosity


class Fluid(Part):
    """The fluid; the default is the paper's air."""

    density: Annotated[FluidDensity, Info("fluid density", "ρ_f", "kg/m³", "rho_f_kg_m3")] = 1.0
    """density of the fluid"""
    viscosity: Annotated[Viscosity, Info("viscosity", "ν", "m²/s", "nu_m2_s")] = 1e-5
    """kinematic viscosity that the grains feel"""
    gravity: Annotated[Gravity, Info("gravity", "g", "m/s²", "g_m_s2")] = GRAVITY
    """acceleration of gravity"""
