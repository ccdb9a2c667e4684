"""The fluid and the grains of a scene, the forces between them, and how thresholds are found.

Ranges are limits of nature, not of the methods: limits of force laws and solvers are known to
`physics` and `fidelity`.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS
from orchestrator.study import sizes
from orchestrator.study.part import Info, Part, UnfitError, Viscosity, unless
from orchestrator.study.sizes import Sizes

LEAST_UPDATE = 0.02
"""Least part of the grains between two solves of the flow."""
Fraction = Annotated[float, Field(ge=1e-6, le=1)]


class Fluid(Part):
    """The fluid; the default is the paper's air."""

    # from the vapour that ripples a comet to mercury, 13,500, and melts of metals
    density: Annotated[
        float, Field(ge=1e-7, le=20_000), Info("fluid density", "ρ_f", "kg/m³", "rho_f_kg_m3")
    ] = 1.0
    """density of the fluid"""
    viscosity: Annotated[Viscosity, Info("viscosity", "ν", "m²/s", "nu_m2_s")] = 1e-5
    """kinematic viscosity that the grains feel"""
    # from a small asteroid's to that of a centrifuge
    gravity: Annotated[float, Field(ge=1e-6, le=1e4), Info("gravity", "g", "m/s²", "g_m_s2")] = (
        GRAVITY
    )
    """acceleration of gravity"""


class Grain(Part):
    """Spheres and their contact law."""

    # smaller ones are carried by Brownian motion, larger ones no flood has moved
    diameter: Annotated[float, Field(ge=1e-7, le=10), Info("diameter", "d", "m", "d_m")]
    """grain diameter"""
    # from aerogels, 0.2, to osmium, 22,600
    density: Annotated[
        float, Field(ge=0.1, le=25_000), Info("grain density", "ρ_sol", "kg/m³", "rho_sol_kg_m3")
    ] = 2500.0
    """density of the grains"""
    # from wet ice to grains that hold by more than friction
    friction_angle_deg: Annotated[
        float, Field(ge=1, le=89), Info("friction angle", "φ", "°", "phi_deg")
    ] = 35.0
    """angle of Coulomb's friction between grains"""
    # softer grains sink into one another by a hundredth, harder ones are harder than steel
    stiffness: Annotated[
        float, Field(ge=1e2, le=1e9), Info("stiffness", "K d/W", scope="DEM", about="answer")
    ] = 1e4
    """spring constant of a contact, normal and tangential, times the diameter over the weight"""
    damping: Annotated[float, Field(ge=0, le=1), Info("damping", scope="DEM", about="answer")] = 0.1
    """damping ratio of a collision"""
    sizes: Annotated[Sizes | None, unless(None), Info("sizes", scope="poured beds")] = None
    """mixture of a poured bed; by default all grains have the diameter. A sieve table: rows of
    diameter (m, rising) and mass fraction, or the name of a file with columns diameter_m and
    fraction; its d50 is the diameter. Or a log-normal
    distribution by mass about the diameter, { sigma_g = 1.3, smallest = 0.6, largest = 1.7 }, with
    cut-offs in d, two geometric standard deviations by default"""

    @field_validator("sizes", mode="before")
    @classmethod
    def _read(cls, value: Any) -> Any:
        return sizes.read(value)

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.sizes is not None:
            sizes.check(self.sizes, self.diameter)
        return self


class Forces(Part):
    """How the grains feel the flow."""

    law: Annotated[
        str,
        Info(
            "force law",
            column="force_law",
            choices={
                "paper": "Eq. 2 or Eq. 4 where each holds, both in the transition",
                **{name: law.label for name, law in LAWS.items()},
            },
        ),
    ] = "bridged"
    """drag and lift on an exposed grain"""
    # from none to sixty times Saffman's
    lift_coefficient: Annotated[
        float, Field(ge=0, le=100), Info("lift coefficient", "α_s", column="alpha_s")
    ] = LIFT_COEFFICIENT
    """lift coefficient"""
    stress: Annotated[
        Literal["wall", "eq10"],
        Info("stress", scope="piles", choices={"wall": "wall stress", "eq10": "stress of Eq. 10"}),
    ] = "wall"
    """how the stress on the bed is read off the flow: at the wall, or at the first cell"""
    # from far below a cell of any mesh to several piles
    averaging_length: Annotated[
        float, Field(ge=1e-4, le=100), Info("averaging length", unit="h", scope="piles")
    ] = 1 / 40
    """least length of bed that a grain's stress is averaged on: the crest's own value never
    converges with the mesh"""
    loaded_grains: Annotated[
        Literal["exposed", "all but crest", "all but toe"],
        Info(
            "loaded grains",
            scope="piles",
            choices={
                "exposed": "all exposed grains",
                "all but crest": "exposed grains but for the topmost one",
                "all but toe": "exposed grains but for those on the lowest 5 % of the face",
            },
        ),
    ] = "exposed"
    """grains of a pile that feel the flow's force"""
    exposure: Annotated[
        Literal["alike", "protrusion"],
        unless("alike"),
        Info(
            "exposure",
            scope="poured beds",
            choices={
                "alike": "every exposed grain stands z₀ above the bed, as in the paper",
                "protrusion": "each stands at its own height over the local bed",
            },
        ),
    ] = "alike"
    """height at which the flow meets a grain"""

    @field_validator("law")
    @classmethod
    def _is_in_registry(cls, value: str) -> str:
        if value not in ("paper", *LAWS):
            laws = ", ".join(("paper", *LAWS))
            raise UnfitError("forces.law", f"unknown force law {value!r}", f"known: {laws}")
        return value


class Protocol(Part):
    """How the threshold is found; by DEM the flow rises in load steps."""

    method: Annotated[
        Literal["dem", "peeling", "pivot"],
        Info(
            "threshold method",
            about="answer",
            choices={"dem": "DEM", "peeling": "peeling", "pivot": "pivot"},
        ),
    ] = "dem"
    """how the threshold is found: the pivot of each grain by itself, peeling (pivots that free one
    another), or DEM"""
    load_increment: Annotated[
        float, Field(ge=1e-4, le=0.2), Info("load increment", "Δu*/u*", scope="DEM", about="answer")
    ] = 0.02
    """relative rise of u* from one load step to the next"""
    waiting_time: Annotated[
        float,
        Field(ge=1, le=1e4),
        Info("waiting time", unit="√(d/g′)", scope="DEM", about="answer"),
    ] = 10.0
    """time without a passage of the displacement criterion that ends a load step"""
    displacement_criterion: Annotated[
        float,
        Field(ge=1e-3, le=0.5),
        Info("displacement criterion", unit="d", scope="DEM and peeling", about="answer"),
    ] = 0.3
    """displacement along the bed from which a grain counts as moved"""
    final_fraction: Annotated[
        Fraction, Info("last fraction", scope="DEM of piles", about="answer")
    ] = 0.9
    """fraction of the exposed grains that should have moved by the last load step"""
    fractions: Annotated[
        tuple[Fraction, ...],
        Field(min_length=1),
        Info("fractions", "n/N", column="-", scope="piles"),
    ] = (0.1, 0.3, 0.5, 0.7)
    """fractions of the exposed grains at which the thresholds of a pile are reported"""
    time_step: Annotated[
        float, Field(ge=1e-3, le=2), Info("time step", unit="√(m/K)", scope="DEM", about="answer")
    ] = 0.2
    """time step of the grains' integration"""
    update: Annotated[
        float,
        Field(ge=0, le=0.5),
        unless(0.0),
        Info("update of the bed", unit="of N", scope="DEM and peeling of piles"),
    ] = 0.0
    """part of the counted grains after which the bed line is drawn anew through the grains that are
    there, and the flow solved over it, until the last of the fractions; 0 keeps the flow of the
    whole pile, as in the paper"""

    @model_validator(mode="after")
    def _updates_are_few(self) -> Self:
        if 0 < self.update < LEAST_UPDATE:
            what = f"{self.update:g} of the grains: each update is a solve of the flow"
            raise UnfitError("protocol.update", what, f"0, or at least {LEAST_UPDATE:g}")
        return self

    @field_validator("fractions", mode="before")
    @classmethod
    def _as_tuple(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value
