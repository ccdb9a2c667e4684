"""The choice of a fidelity by cost and numerical error, for one scene.

The rungs of flow and grains are chosen apart. A way to answer is offered if it costs no
more than the scene as it is written, and if it buys something: its largest error is no
more than that of any cheaper one, and at one of the asked fractions its error with the
uncertainty of its reference is below the error alone of each cheaper one, so that they
can be told apart.

Of what is offered the cheapest answers that is, at each fraction, within the tolerance
or as good as any. So a looser tolerance never costs more, and never has fewer
thresholds within it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from orchestrator.digits import percent
from orchestrator.fidelity.fidelities import Fidelity
from orchestrator.fidelity.known import Known
from orchestrator.grains.pile import Pile
from orchestrator.study.scene import Scene

ALONE_S = {"pivot": 1.2e-4, "local": 1.2e-4, "peeling": 2.2e-4}
"""Time of one grain by a method without a run, s, by the preset `ladder`."""


@dataclass(frozen=True)
class Way:
    """A way to answer a scene.

    Attributes
    ----------
    fidelity
        Its fidelity.
    answer
        The scene as it answers it.
    known
        Its numerical error.
    cost_s
        Its expected cost, s of one core.
    """

    fidelity: Fidelity
    answer: Scene
    known: Known
    cost_s: float


def cost_s(answer: Scene) -> float:
    """Compute the expected cost of a pile alone.

    Parameters
    ----------
    answer
        The scene as it is answered.

    Returns
    -------
    float
        Time of one core, s: that of its runs, or of its grains where these need none.
    """
    alone_s = ALONE_S.get(answer.method.kind, 0.0)
    return sum(runs_of(answer).values()) + alone_s * Pile(answer).length


def runs_of(answer: Scene) -> dict[str, float]:
    """List the runs of a pile, with those that they need.

    Parameters
    ----------
    answer
        The scene as it is answered.

    Returns
    -------
    dict of str to float
        The expected time of each on one core, s, by its name.
    """
    runs = {}
    for run in Pile(answer).runs:
        for one in (*run.needs, run):
            runs[one.name] = one.cost_s
    return runs


def offered(ways: Iterable[Way], most_s: float) -> list[Way]:
    """Leave out the ways that cost too much, or buy nothing.

    Parameters
    ----------
    ways
        Ways to answer one scene, of known numerical errors.
    most_s
        The cost of the scene as it is written, s.

    Returns
    -------
    list of Way
        What is offered, by rising cost.
    """
    found: list[Way] = []
    for way in sorted(ways, key=lambda one: one.cost_s):
        if way.cost_s > most_s * (1 + 1e-9):
            break
        if _buys(way, found):
            found.append(way)
    return found


def _buys(dearer: Way, cheaper: Sequence[Way]) -> bool:
    """Whether a way is nearer than cheaper ones, and can be told from them."""
    if any(dearer.known.total > one.known.total for one in cheaper):
        return False
    return any(
        all(dearer.known.at(at).total < one.known.at(at).error for one in cheaper)
        for at in dearer.known.fractions
    )


def chosen(offers: Sequence[Way], most: float) -> Way:
    """Choose the way that answers.

    Parameters
    ----------
    offers
        What is offered, by `offered`.
    most
        The tolerance.

    Returns
    -------
    Way
        The cheapest that is, at each fraction, within the tolerance or as good as any;
        the dearest, which has the smallest largest error, where none is.
    """
    fractions = offers[0].known.fractions
    best = {at: min(one.known.at(at).total for one in offers) for at in fractions}
    for way in offers:
        if all(way.known.at(at).total <= max(most, best[at]) for at in fractions):
            return way
    return offers[-1]


def beyond(way: Way, most: float) -> list[float]:
    """List the fractions at which a way is not known to be within a tolerance.

    Parameters
    ----------
    way
        The way.
    most
        The tolerance.

    Returns
    -------
    list of float
        The fractions.
    """
    return [at for at in way.known.fractions if way.known.at(at).total > most]


def in_words(way: Way, ways: Sequence[Way], most: float) -> str:
    """Say why a way answers, and what would help where it is not within the tolerance.

    Parameters
    ----------
    way
        The way that answers.
    ways
        All ways that there are, whatever they cost.
    most
        The tolerance.

    Returns
    -------
    str
        A clause for each.
    """
    worst = way.known.worst
    missed = beyond(way, most)
    if not missed:
        return f"{way.fidelity.name}, the cheapest fidelity that is {worst}"
    where = ", ".join(f"{at:g}" for at in missed)
    said = f"no fidelity offered meets the tolerance at n/N = {where}; used: "
    said += f"{way.fidelity.name}, the cheapest that is nearest to it, {worst}"
    return f"{said}; {_help(way, ways, missed, most)}"


def _help(way: Way, ways: Sequence[Way], missed: Sequence[float], most: float) -> str:
    """What would bring the missed fractions within the tolerance."""
    within = [
        one for one in ways if all(one.known.at(at).total <= most for at in missed)
    ]
    if within:
        one = min(within, key=lambda each: each.cost_s)
        return f"{one.fidelity.name} would meet it there, at a higher cost"
    uncertainties = [way.known.at(at).uncertainty or 0.0 for at in missed]
    if min(uncertainties) > most:
        least = min(uncertainties)
        known = percent(least, 1)
        return f"the reference itself is known to {known} there: no DEM is better"
    least = math.ceil(1e3 * max(way.known.at(at).total for at in missed)) / 1e3
    return f"tolerance = {least:g} is met everywhere"
