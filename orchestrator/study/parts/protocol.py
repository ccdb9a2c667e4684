"""How the threshold of a scene is found."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from orchestrator.study.info import Info
from orchestrator.study.parts.part import Part, UnfitError, unless

Fraction = Annotated[float, Field(ge=1e-6, le=1)]
Method = Literal["dem", "peeling", "pivot"]
LEAST_UPDATE = 0.02
"""Least part of the grains between two solves of the flow."""


class Protocol(Part):
    """How the threshold is found; by DEM the flow rises in load steps."""

    method: Annotated[
        Method,
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
    def _tuple_of_a_list(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value
