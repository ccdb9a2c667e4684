"""What three values on ever finer meshes say: order, limit, and grid convergence index.

The procedure is that of Celik et al., J. Fluids Eng. 130, 078001 (2008), with Roache's
factor of safety for three meshes. An order is read off the values only where it can be
one: they approach a limit from one side, by steps that stand out from what a solver
leaves, and with an order that the schemes can have.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

SAFETY = 1.25
"""Roache's factor of safety on an error that was found from three meshes."""
HIGHEST_ORDER = 20.0
"""Order at which the search for it ends: what is above is no order."""
Verdict = Literal["in the range", "settled", "not in the range", "not known"]
"""What three values say of their limit; `Judged` has the meanings."""


class Judged(NamedTuple):
    """What three values on ever finer meshes say.

    Attributes
    ----------
    verdict
        ``"in the range"``: the values approach `limit` with `order`. ``"settled"``: the
        last refinement changed no more than the solver leaves. ``"not in the range"``:
        neither, for the reason in `why`. ``"not known"``: a value is missing.
    why
        Why no order is given, in words.
    order
        Observed order, NaN unless in the range.
    limit
        The value of ever finer meshes by that order, NaN unless in the range.
    """

    verdict: Verdict
    why: str = ""
    order: float = math.nan
    limit: float = math.nan

    def gci(self, value: float) -> float:
        """Compute the grid convergence index of a value, relative.

        Parameters
        ----------
        value
            One of the three.

        Returns
        -------
        float
            `SAFETY` times its relative distance from the limit; NaN without a limit.
        """
        return SAFETY * abs(self.limit / value - 1)


class Orders(NamedTuple):
    """The orders that the schemes of a solver can have.

    Attributes
    ----------
    least, most
        Observed orders outside of these are of values that are not in the range.
    """

    least: float
    most: float


def judge(
    sizes: tuple[float, float, float],
    values: tuple[float, float, float],
    orders: Orders | None,
    floor: float,
) -> Judged:
    """Judge three values by what a finer mesh changes.

    Parameters
    ----------
    sizes
        Size of the cells, or of the steps, from the coarsest to the finest.
    values
        The values, in the same order.
    orders
        The orders that can be; None where none is expected.
    floor
        Relative change that the solver leaves on one mesh: a smaller one says nothing.

    Returns
    -------
    Judged
        The verdict, with order and limit where the values are in the range.
    """
    coarse, medium, fine = values
    if not np.isfinite(values).all() or not fine:
        return Judged("not known", "a value is missing")
    first = coarse - medium
    last = medium - fine
    if abs(last) <= floor * abs(fine):
        return Judged("settled", f"the last change is within {100 * floor:.2g} %")
    if orders is None:
        return Judged("not in the range", "no order is expected")
    if abs(first) <= floor * abs(fine):
        return Judged("not in the range", "the changes grow")
    if first * last < 0:
        return Judged("not in the range", "the values oscillate")
    order = observed_order(sizes, first / last)
    if order <= 0:
        return Judged("not in the range", "the changes grow")
    if not orders.least <= order <= orders.most:
        return Judged("not in the range", f"order {order:.2g}")
    limit = fine - last / ((sizes[1] / sizes[2]) ** order - 1)
    return Judged("in the range", "", order, limit)


def observed_order(sizes: tuple[float, float, float], ratio: float) -> float:
    """Find the order with which values approach a limit.

    Parameters
    ----------
    sizes
        Size of the cells, or of the steps, from the coarsest to the finest.
    ratio
        First change over the last one, above 0.

    Returns
    -------
    float
        The order p, for which the errors are as size^p; 0 where the last change is not
        small enough for any, `HIGHEST_ORDER` where it is smaller than for that.
    """
    large, middle, small = sizes

    def excess(order: float) -> float:
        """How far the ratio of an order lies above that of the changes."""
        first = (large / middle) ** order - 1
        last = 1 - (small / middle) ** order
        return float(first / last - ratio)

    least = 1e-6
    if excess(least) >= 0:
        return 0.0
    if excess(HIGHEST_ORDER) <= 0:
        return HIGHEST_ORDER
    return float(brentq(excess, least, HIGHEST_ORDER))
