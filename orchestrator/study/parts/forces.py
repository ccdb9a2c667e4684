"""How the grains of a scene feel the flow."""

from typing import Annotated, Literal

from pydantic import field_validator

from orchestrator.physics.constants import LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS
from orchestrator.study.info import Info
from orchestrator.study.parts.part import Part, UnfitError, unless
from orchestrator.study.ranges import LiftCoefficient, OverHeight

Stress = Literal["wall", "eq10"]
Forced = Literal["exposed", "all but crest", "all but toe"]
Standing = Literal["alike", "protrusion"]


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
    lift_coefficient: Annotated[
        LiftCoefficient, Info("lift coefficient", "α_s", column="alpha_s")
    ] = LIFT_COEFFICIENT
    """lift coefficient"""
    stress: Annotated[
        Stress,
        Info(
            "stress",
            scope="piles",
            choices={"wall": "wall stress", "eq10": "stress of Eq. 10"},
        ),
    ] = "wall"
    """how the stress on the bed is read off the flow: at the wall, or at the first cell"""
    averaging_length: Annotated[OverHeight, Info("averaging length", unit="h", scope="piles")] = (
        1 / 40
    )
    """least length of bed that a grain's stress is averaged on: the crest's own value never
    converges with the mesh"""
    loaded_grains: Annotated[
        Forced,
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
        Standing,
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
    def _is_known(cls, value: str) -> str:
        if value not in ("paper", *LAWS):
            known = ", ".join(("paper", *LAWS))
            raise UnfitError("forces.law", f"unknown force law {value!r}", f"known: {known}")
        return value
