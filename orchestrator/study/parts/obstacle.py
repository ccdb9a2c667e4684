"""Obstacles on a bed line."""

from typing import Literal

from orchestrator.study.parts.part import Part
from orchestrator.study.ranges import Height, Length


class Obstacle(Part):
    """An obstacle across the flow, which carries no grains."""

    kind: Literal["fence", "block", "half-cylinder"]
    """what it is; all have steep sides, none is upright"""
    x: float
    """place of its middle, downstream of the foot of the first form"""
    height: Height
    """height over the bed"""
    length: Length | None = None
    """length of a block; by default its height"""

    @property
    def reach(self) -> float:
        """From its middle to the foot of its sides on level bed, at most, m."""
        return {"fence": 0.4, "block": 0.3, "half-cylinder": 1.1}[self.kind] * self.height + (
            (self.length or self.height) / 2 if self.kind == "block" else 0.0
        )

    def __str__(self) -> str:
        length = f", {self.length:g} m long" if self.length else ""
        return f"{self.kind} of {self.height:g} m at {self.x:g} m{length}"
