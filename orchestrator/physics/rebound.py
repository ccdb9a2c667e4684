"""What happens in the mean where a grain meets a bed of grains.

Lengths are in diameters d of the grain.
"""

from dataclasses import dataclass

import numpy as np

from orchestrator.types import FloatArray


@dataclass(frozen=True)
class Rebound:
    """What happens in the mean where a grain meets a bed of equal grains.

    At an impact of speed v and angle a with the bed the grain leaves with the speed
    ``(whole[0] - whole[1] sin a) v``, of which ``(normal[0] - normal[1] sin a) v`` is
    normal to the bed.

    Attributes
    ----------
    whole, normal
        Coefficients of the speed, and of its part normal to the bed, over the speed of
        impact.
    trapped
        Energy below which a grain on its like stays where it is, in weights times
        diameters.
    level
        Height of its centre above the zero level of the flow, d.

    Examples
    --------
    >>> speed, normal = BEADS.after(np.array([1.0, 1.0]), np.array([0.0, 0.5]))
    >>> print(speed, normal)
    [0.87 0.51] [0.3   0.225]
    """

    whole: tuple[float, float]
    normal: tuple[float, float]
    trapped: float
    level: float

    def after(
        self,
        speed: FloatArray,
        sine: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the speed after a rebound, and its part normal to the bed.

        Parameters
        ----------
        speed
            Speed of the impact.
        sine
            Sine of the angle of the impact with the bed.

        Returns
        -------
        whole, normal
            Speeds of the broadcast shape; neither is negative, and the part is not
            larger than the whole.
        """
        whole = np.maximum(self.whole[0] - self.whole[1] * sine, 0) * speed
        normal = np.maximum(self.normal[0] - self.normal[1] * sine, 0) * speed
        return whole, np.minimum(normal, whole)

    def on(self, relative_size: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute what traps grains on a bed of others, and how high they lie on it.

        Both change as `on_layer` says from those of a grain on its like. The rebound
        itself is taken to be alike: no measurement of unlike grains is known.

        Parameters
        ----------
        relative_size
            Diameter of each grain over that of the grains of its bed.

        Returns
        -------
        trapped, level
            Energy below which each stays, in its weights times diameters, and height of
            its centre above the zero level, in its diameters; of the same shape.

        Examples
        --------
        >>> trapped, level = BEADS.on(np.array([0.5, 1.0, 2.0]))
        >>> print(trapped.round(3), level.round(3))
        [0.362 0.12  0.037] [0.724 0.7   0.634]
        """
        rest, barrier = on_layer(relative_size)
        of_like, barrier_of_like = on_layer(np.array(1.0))
        trapped = self.trapped * (barrier / barrier_of_like)
        level = (self.level + (rest - of_like)) / relative_size
        return trapped, np.maximum(level, 0.0)


def on_layer(relative_size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute where grains lie on a close-packed layer of others, and what holds them.

    A sphere of D on three of K lies ``sqrt((D + K)^2/4 - K^2/3)`` above their centres.
    On its way out it rises to between the saddle of two, ``sqrt((D + K)^2/4 - K^2/4)``,
    and the top of one, ``(D + K)/2``; the mean of both is taken.

    Parameters
    ----------
    relative_size
        Diameter of each grain over that of the layer's, D/K.

    Returns
    -------
    rest, barrier
        Height of its centre at rest above those of the layer, in K, and how much higher
        it must rise, in D; of the same shape.

    Examples
    --------
    >>> rest, barrier = on_layer(np.array(1.0))
    >>> print(rest.round(4), barrier.round(4))
    0.8165 0.1165
    """
    reach = (relative_size + 1) / 2
    rest = np.sqrt(np.maximum(reach**2 - 1 / 3, 0.0))
    saddle = np.sqrt(np.maximum(reach**2 - 1 / 4, 0.0))
    return np.asarray(rest), np.asarray(((saddle + reach) / 2 - rest) / relative_size)


BEADS = Rebound(whole=(0.87, 0.72), normal=(0.30, 0.15), trapped=0.12, level=0.7)
"""Beads of plastic shot at a bed of the same beads.

M. Beladjine, M. Ammi, L. Oger and A. Valance, Phys. Rev. E 75, 2007. Two public codes
quote its table of angles and speeds, which the law meets within 0.04.
"""

SIMULATED = {
    0.9: Rebound(whole=(0.717, 0.484), normal=(0.293, 0.187), trapped=0.12, level=0.7),
    0.55: Rebound(whole=(0.692, 0.506), normal=(0.252, 0.187), trapped=0.12, level=0.7),
    0.25: Rebound(whole=(0.682, 0.527), normal=(0.225, 0.178), trapped=0.12, level=0.7),
}
"""Spheres thrown at poured beds of the same spheres by LIGGGHTS, by restitution.

The friction coefficient is 0.5. The shots are in ``docs/measured/rebounds.csv``, made
by ``tools/rebound.py``. Nothing takes these laws by default: they say how much hangs on
the rebound.
"""
