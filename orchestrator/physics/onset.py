"""The threshold of grains by a force law and a criterion, made once.

A grain leaves its pocket, or its motion is also sustained: it leaves in a gust, and
rolls and hops on after it (`orchestrator.physics.rolling`).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import rolling
from orchestrator.physics.beside import ENTRAINED, SUSTAINED
from orchestrator.physics.cessation import cessation
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import Threshold, threshold, why_not
from orchestrator.physics.verdict import Reason
from orchestrator.types import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Criteria:
    """Mean stresses at which grains leave in a gust and go on after it, shape (n,).

    Attributes
    ----------
    steady
        Shields number at which a flow without gusts turns each over its neighbours.
    spheres
        The grains as they roll and hop over their beds.
    peak
        Stress of the gust over the mean stress.
    """

    steady: FloatArray
    spheres: Grain
    peak: ArrayLike = PEAK

    @property
    def entrained(self) -> FloatArray:
        """Shields number from which the gust turns each over."""
        return np.asarray(self.steady / np.asarray(self.peak, float))

    @cached_property
    def sustained(self) -> FloatArray:
        """That from which each rolls and hops on after the gust."""
        return self._sustained("middle")

    def _sustained(self, end: rolling.End) -> FloatArray:
        """The same, or an end of the model's interval."""
        return rolling.sustained(self.spheres, end).initiation(self.peak)

    @property
    def shields(self) -> FloatArray:
        """That from which each is entrained, and its motion sustained."""
        return np.maximum(self.entrained, self.sustained)

    @property
    def sustained_decides(self) -> BoolArray:
        """Whether sustained motion needs more than entrainment."""
        return ~(self.entrained > self.sustained)

    @property
    def at_least(self) -> FloatArray:
        """The threshold of a quarter of the spheres, and half of the way."""
        return np.maximum(self.entrained, self._sustained("low"))

    @property
    def at_most(self) -> FloatArray:
        """The threshold of three quarters of the spheres, and twice the way."""
        return np.maximum(self.entrained, self._sustained("high"))

    @property
    def cessation(self) -> FloatArray:
        """That below which motion ceases once it is under way.

        A grain that hops in the wind keeps the speed that it has won, and goes on below
        the stress that sets it in motion.
        """
        return np.fmin(cessation(self.spheres), self.sustained)

    def columns(self) -> dict[str, Any]:
        """Make the columns of both criteria.

        Returns
        -------
        dict of str to ndarray
            The Shields numbers, and the criterion that decides.
        """
        return {
            "shields_entrained": self.entrained,
            "shields_sustained": self.sustained,
            "shields_sustained_low": self.at_least,
            "shields_sustained_high": self.at_most,
            "shields_cessation": self.cessation,
            "decides": np.where(self.sustained_decides, SUSTAINED, ENTRAINED).astype(
                object
            ),
        }


@dataclass(frozen=True, eq=False)
class Onset:
    """The threshold of grains by a law and a criterion, arrays of shape (n,).

    Attributes
    ----------
    law
        Name of the force law.
    leaving
        The threshold of leaving the pocket in a steady flow.
    criteria
        The stresses at which the grains leave and go on; None where they only leave.
    friction_velocity, shields, reynolds
        u* of the mean flow, m/s, its Shields number and Re*.
    drag, lift
        The forces at the threshold, in the gust if there is one, N.
    valid
        Whether the law holds where the grain leaves, and the threshold is known.
    grain
        The grains.
    """

    law: str
    leaving: Threshold
    criteria: Criteria | None
    friction_velocity: FloatArray
    shields: FloatArray
    reynolds: FloatArray
    drag: FloatArray
    lift: FloatArray
    valid: BoolArray
    grain: Grain

    def reasons(self) -> list[list[Reason]]:
        """List what the law has against each threshold.

        Returns
        -------
        list of list of Reason
            The reasons of each grain; none without a threshold, which is beyond no
            range.
        """
        return against_law(self.law, self.grain, self.leaving.friction_velocity)


def of_grains(
    grain: Grain,
    law: str,
    criterion: str = ENTRAINED,
    gust: ArrayLike = np.nan,
) -> Onset:
    """Find the thresholds of single grains by a force law and a criterion.

    Parameters
    ----------
    grain
        The grains, of shape (n,).
    law
        Name of the force law.
    criterion
        What a grain must do: `ENTRAINED` or `SUSTAINED`.
    gust
        Largest over mean stress of the gusts of the flow. Without gusts, NaN, a grain
        that leaves does so in the steady flow, and one that goes on leaves in a gust of
        `PEAK`.

    Returns
    -------
    Onset
        The thresholds. u* is 0 where a grain needs no flow, infinite where no
        flow is enough, NaN where that is not known.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=[1e-3],
    ...     density=2650.0,
    ...     fluid_density=1000.0,
    ...     viscosity=1e-6,
    ...     entrainment_angle_deg=60.0,
    ... )
    >>> for criterion in (ENTRAINED, SUSTAINED):
    ...     at = of_grains(sand, "bridged", criterion)
    ...     print(at.shields.round(4), at.valid)
    [0.0242] [ True]
    [0.0269] [ True]
    """
    leaving = threshold(LAWS[law], grain)
    has_gust = np.isfinite(np.asarray(gust, float))
    # the mean flow has less than the stress that is needed
    peak = np.where(has_gust, gust, 1.0)
    shields = leaving.shields / peak
    ustar = leaving.friction_velocity / np.sqrt(peak)
    criteria = None
    valid = leaving.valid
    if criterion == SUSTAINED:
        peak = np.where(has_gust, gust, PEAK)
        criteria = Criteria(leaving.shields, grain, peak)
        shields = criteria.shields
        ustar = grain.ustar_at(shields)
        valid = valid & np.isfinite(criteria.sustained)
    with np.errstate(invalid="ignore"):
        in_gust = ustar * np.sqrt(peak)
        return Onset(
            law=law,
            leaving=leaving,
            criteria=criteria,
            friction_velocity=ustar,
            shields=shields,
            reynolds=grain.reynolds(ustar),
            drag=LAWS[law].drag(in_gust, grain),
            lift=LAWS[law].lift(in_gust, grain),
            valid=valid,
            grain=grain,
        )


def against_law(
    name: str, grain: Grain, ustar: FloatArray, lifts: bool = True
) -> list[list[Reason]]:
    """List what a force law has against friction velocities at which grains leave.

    Parameters
    ----------
    name
        Name of the law.
    grain
        The grains, of shape (n,).
    ustar
        Friction velocities, m/s, shape (n,).
    lifts
        Whether a grain that the lift carries off is none of the law; a pile has a share
        of such grains.

    Returns
    -------
    list of list of Reason
        The reasons of each grain. There are none without a friction velocity.
    """
    law = LAWS[name]
    texts = why_not(law, ustar, grain, lifts=lifts)
    further = np.zeros(len(ustar), bool)
    if law.extended_by:
        further = LAWS[law.extended_by].valid(ustar, grain)
    remedy = f'choose forces.law = "{law.extended_by}"'
    found = []
    for place, of_grain in enumerate(texts):
        helps = remedy if further[place] else ""
        is_known = np.isfinite(ustar[place])
        found.append([Reason("law", each, helps) for each in of_grain if is_known])
    return found
