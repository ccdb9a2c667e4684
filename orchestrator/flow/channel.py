"""The flow over one bed line in open water or in a closed channel, as an OpenFOAM case."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from orchestrator.flow.case import FlowCase, set_values
from orchestrator.flow.diagnostics import Diagnostic
from orchestrator.flow.solved import SolvedFlow
from orchestrator.physics.velocity import depth_mean_speed
from orchestrator.study.scene import LEAST_DEPTH

MEAN_SPEED_ERROR = 0.1
"""Largest relative difference of the column's mean speed, before the inlet, from the log law's."""


@dataclass(frozen=True)
class ChannelFlow(FlowCase):
    """Steady turbulent flow over a bed line in a channel that is as deep as its lid is high.

    Its slope drives it: a force on the water that u*_0^2 on each wall balances over a flat bed. The
    speed at 10 h is that of the log law with this u*_0, and need not be within the depth.

    Parameters
    ----------
    closed : bool
        Whether the top is a wall as rough as the bed; else it is a level surface without stress.
    """

    closed: bool = False
    least_lid: ClassVar[float] = LEAST_DEPTH

    @property
    def depth_m(self) -> float:
        """Depth over the flat bed, m."""
        return self.lid * self.height_m

    def _write_top(self, directory: Path) -> None:
        set_values(directory / "parameters", top="closed" if self.closed else "open")
        set_values(directory / "parameters.geo", closed=int(self.closed))

    def of_the_top(self, solved: SolvedFlow) -> dict[str, Diagnostic]:
        """The mean speed in the column before the inlet over that of the log law."""
        ustar = solved.approach_ustar() * self.ustar0_m_s
        law = mean_speed(ustar, self.depth_m, self.roughness_m, closed=self.closed)
        low, high = 1 - MEAN_SPEED_ERROR, 1 + MEAN_SPEED_ERROR
        name = "mean_speed_over_log_law"
        return {name: Diagnostic(name, solved.column_speed() / law, low, high)}


def mean_speed(ustar: float, depth_m: float, roughness_m: float, *, closed: bool) -> float:
    """Mean speed (m/s) over the depth (m) by the log law; a closed channel has one on each wall."""
    return float(depth_mean_speed(ustar, depth_m / (2 if closed else 1), roughness_m))
