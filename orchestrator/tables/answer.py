"""The answer to a scene, read once from its finished cases."""

from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property
from math import hypot, isfinite
from pathlib import Path

import numpy as np

from orchestrator.errors import InputError
from orchestrator.fidelity.decision import Decision
from orchestrator.grains import threshold
from orchestrator.grains.loads import interlocking
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study.declare import UnfitError
from orchestrator.types import BoolArray


class Answer:
    """The answer to a scene: a pile with what its finished cases say, read once.

    Parameters
    ----------
    decision
        How the scene is answered.
    pile
        Its pile.
    cases
        The directory of the finished cases.
    smoothed
        The same bed with other smoothing, by the factor of its length.
    """

    def __init__(
        self,
        decision: Decision,
        pile: Pile,
        cases: Path,
        smoothed: Mapping[float, Pile] | None = None,
    ) -> None:
        self.decision = decision
        self.pile = pile
        self.scene_id = decision.asked.id
        self.smoothed: dict[float, float] = {}
        for factor, other in (smoothed or {}).items():
            _, self.smoothed[factor] = other.first(other.motion(cases))
        self.cases = cases
        self.motion = pile.motion(cases)
        self.speed = pile.speed(cases)
        self.interlocking = interlocking(pile, cases)
        self.first = pile.first(self.motion)
        self.checked = (np.nan, np.nan)
        if decision.is_along:
            # where no grains can lie there is no check
            with suppress(InputError, UnfitError):
                around = pile.around(self.first[0])
                self.checked = around.first(around.motion(cases))

    @cached_property
    def between(self) -> float:
        """Relative error of a flow that lies between others; 0 of one that does not."""
        return self.pile.model.error(self.cases)

    def error_at(self, fraction: float) -> float | None:
        """Find the numerical error at a fraction, with what its runs show of it.

        That is the error of a flow between others, and of a correction by DEM.

        Parameters
        ----------
        fraction
            Fraction n/N of the counted grains.

        Returns
        -------
        float or None
            The relative error; None where it is not known.
        """
        error = self.decision.error_at(fraction)
        if error is None:
            return None
        of_correction = self.pile.correction_error(fraction, self.cases)
        found = hypot(error, self.between, of_correction)
        return found if isfinite(found) else None

    def at(self, fraction: float, chosen: BoolArray | None = None) -> PileThreshold:
        """Find the threshold of the pile, or of some of its counted grains.

        Parameters
        ----------
        fraction
            The fraction that has moved.
        chosen
            Which of the counted grains, shape (count,); by default all. The interval of
            some holds how many of so few would have moved by chance.

        Returns
        -------
        PileThreshold
            The threshold.
        """
        density = self.pile.scene.fluid.density
        if chosen is None:
            return threshold.of_pile(self.motion, self.speed, fraction, density)
        ends = threshold.sampled(fraction, int(chosen.sum()))
        motion = self.motion.of(chosen)
        return threshold.of_pile(motion, self.speed[chosen], fraction, density, ends)
