"""What a deck of LIGGGHTS on a bed is given: the contact law, the protocol, grains and forces."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from orchestrator.bed.deck import write_grains, write_parameters
from orchestrator.study.parts import Grain, Protocol
from orchestrator.study.sizes import extremes
from orchestrator.types import FloatArray, IntArray

GONE, FIXED, MOBILE, COUNTED, PUSHED = 0, 1, 2, 3, 4
"""Grain types of the deck: fixed; mobile; mobile and exposed: counted, or pushed only. Those that
have gone are in no deck."""
SAMPLING_INTERVAL = 0.5
"""Time between two samples of the grains, sqrt(d/g')."""
SETTLE = 10.0
"""Time in which the bed settles before the first load step, sqrt(d/g')."""
POURED_DRAG = 2.0
"""Drag of a still fluid in which a poured bed settles, m sqrt(g'/d): its springs may be softer than
those of the pouring, and without a drag a pile of 25 degrees was not at rest at the end."""
SETTLE_FLOW = math.sqrt(0.5)
"""Flow of the settling over that of the first load step: about half of its force. Without any, a
bed at its limiting slope would not come to rest."""
START = 0.9
"""Flow of the first load step over that of the first threshold by the pivot law."""
BEYOND = 1.2
"""The last load step's flow over that at which the pivot law says that enough grains have moved."""
STIR = 0.02
"""A counted grain that is no further from its place lies there, d: it is left out of the dump.
With a small displacement criterion, or small grains, it is less."""
AWAY = 10.0
"""A counted grain that has come so far along the bed is gone, d: those that it could still meet
have left before it."""


@dataclass(frozen=True)
class Contact:
    """The contact law of a deck, as its variables: dimensionless numbers.

    Attributes
    ----------
    friction : float
        tan(phi).
    stiffness : float
        K d/W, normal and tangential.
    damping : float
        Damping ratio of a collision.
    time_step : float
        sqrt(m/K).
    """

    friction: float
    stiffness: float
    damping: float
    time_step: float

    @classmethod
    def of(cls, grain: Grain, protocol: Protocol) -> "Contact":
        """The contact law of the grains of a scene, under its protocol."""
        friction = math.tan(math.radians(grain.friction_angle_deg))
        return cls(friction, grain.stiffness, grain.damping, protocol.time_step)

    @property
    def variables(self) -> dict[str, float]:
        """Its variables in the deck, by their names."""
        return asdict(self)


def raising(
    protocol: Protocol, enough: int, *, smallest: float = 1.0, is_poured: bool = False
) -> dict[str, float | int]:
    """How the deck waits at a load step, samples the grains and goes on to the next.

    Parameters
    ----------
    protocol : Protocol
        Protocol of the scene.
    enough : int
        The load steps end early when no more than this many counted grains have not moved.
    smallest : float
        Diameter of the smallest grain that may move, d.
    is_poured : bool
        Whether the bed was poured, and so on springs of its own.
    """
    return {
        "waiting_time": protocol.waiting_time,
        "sampling_interval": SAMPLING_INTERVAL,
        "settle": SETTLE,
        "settle_drag": POURED_DRAG if is_poured else 0.0,
        "displacement_criterion": protocol.displacement_criterion,
        "stir": min(STIR, protocol.displacement_criterion * smallest / 2),
        "away": AWAY,
        "enough": enough,
    }


def flows(first: float, last: float, step: float) -> FloatArray:
    """The flow of the settling, then those of load steps that rise by one factor.

    Parameters
    ----------
    first, last : float
        Flow of the first load step, and the least that the last one must reach.
    step : float
        Relative rise from one load step to the next.
    """
    count = 1 + math.ceil(math.log(last / first) / math.log1p(step))
    rising = first * (1 + step) ** np.arange(count)
    return np.concatenate([[SETTLE_FLOW * first], rising])


def cost_s(
    load_steps: float, grains: float, rules: Protocol, grain: Grain, exposed: float = math.nan
) -> float:
    """Expected time of one core for a deck, s; `exposed` is how many grains a poured bed exposes.

    Lattices, measured with 30 to 770 counted grains: load steps of twice the waiting time, 4.5e7
    grain-steps a second. Poured beds: 6e6, and the more grains are exposed, the more often one
    passes before all have waited: load steps of 2000 took four times as long as those of 100. Their
    smallest grain sets the time step.
    """
    length, rate = 2 * rules.waiting_time, 4.5e7
    if not math.isnan(exposed):
        small = math.pow(extremes(grain.sizes, grain.diameter)[0], 1.5)
        length, rate = rules.waiting_time * (1 + exposed / 700) / small, 6e6
    steps = load_steps * length * math.sqrt(grain.stiffness) / rules.time_step
    return 0.1 + steps * grains / rate


@dataclass(frozen=True)
class GrainTable:
    """The grains of a deck, n of them.

    Attributes
    ----------
    position : ndarray, shape (n, 3)
        x, y, z of the centres, m.
    kind : ndarray of int, shape (n,)
        One of GONE, FIXED, MOBILE, COUNTED, PUSHED.
    along : ndarray, shape (n, 2)
        Unit vector downstream along the bed, in which displacement is counted.
    sizes : ndarray, shape (n,)
        Diameter of each grain over `diameter`.
    diameter, density : float
        The diameter d of the deck's units, m; the density of every grain, kg/m3.
    width : float
        Width of a strip with periodic sides, d; 0 for grains in planes.
    """

    position: FloatArray
    kind: IntArray
    along: FloatArray
    sizes: FloatArray
    diameter: float
    density: float
    width: float = 0.0

    @property
    def counted_ids(self) -> IntArray:
        """Ids (from 1) of the grains whose motion is counted."""
        return np.flatnonzero(self.kind == COUNTED) + 1

    @property
    def smallest(self) -> float:
        """Diameter of the smallest grain that may move, d."""
        return float(self.sizes[self.kind > FIXED].min())

    @property
    def last_mobile(self) -> float:
        """The furthest x of a grain that may move, m."""
        return float(self.position[self.kind > FIXED, 0].max())

    @property
    def mobile_count(self) -> int:
        """How many grains may move."""
        return int((self.kind > FIXED).sum())


def write(
    directory: Path,
    grains: GrainTable,
    parameters: Mapping[str, float | int],
    flows: FloatArray,
    force: FloatArray,
    margin: float,
    ranks: int = 1,
) -> None:
    """Write the grains, parameters, flows and forces of a deck.

    Parameters
    ----------
    directory : Path
        A copy of the template ``liggghts/bed``.
    grains : GrainTable
        The grains; ids are their places, from 1.
    parameters : mapping
        Each becomes a variable of the deck.
    flows : ndarray, shape (load steps + 1,)
        The flow of the settling, then of each load step.
    force : ndarray, shape (load steps + 1, n, 2)
        The flow's force on each grain at these flows, N; only pushed grains feel one.
    margin : float
        Distance from the outermost grains to the walls of the box, m; beyond them a grain is gone.
    ranks : int
        Processes that share the grains.
    """
    present = np.flatnonzero(grains.kind != GONE)
    places = grains.position[present]
    bounds = np.array([places.min(axis=0) - margin, places.max(axis=0) + margin])
    if grains.width:
        bounds[:, 1] = 0.0, grains.width * grains.diameter
    diameters = grains.diameter * grains.sizes
    write_grains(
        directory, grains.position, grains.kind, diameters, grains.density, bounds, present
    )
    write_parameters(directory, {**parameters, "width": grains.width, "ranks": ranks})
    (directory / "load_steps.txt").write_text("".join(f"{flow!r}\n" for flow in flows.tolist()))
    pushed = np.flatnonzero(grains.kind >= COUNTED)
    counted = np.flatnonzero(grains.kind == COUNTED)
    for place, axis in enumerate("xz"):
        _write_sets(directory / f"force.{axis}.txt", pushed, force[:, pushed, place])
        # in these units displacement is one in the grain's own diameter
        direction = grains.along[None, counted, place] / grains.sizes[counted]
        _write_sets(directory / f"along.{axis}.txt", counted, direction)


def _write_sets(path: Path, grains: IntArray, sets: FloatArray) -> None:
    """Write sets of values of grains as LIGGGHTS reads them: a count, then ids and values."""
    ids = [f"{number} " for number in (grains + 1).tolist()]
    with path.open("w") as stream:
        for values in sets.tolist():
            stream.write(f"{len(ids)}\n")
            stream.writelines(f"{a}{b!r}\n" for a, b in zip(ids, values, strict=True))
