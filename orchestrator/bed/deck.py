"""Decks: grains that are moved in time, their contact law, protocol and cost.

What they are written as is the engine's (`orchestrator.solvers.dem`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator import digits
from orchestrator.errors import SolverError
from orchestrator.runs import process
from orchestrator.runs.case import Case
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.method import GrainMethod
from orchestrator.study.parts import GrainPart, Gusts, extremes
from orchestrator.types import FloatArray, IntArray

DIAMETER = 1e-3
"""Diameter of the reference grain of a deck, m.

In units of d, of its weight and of sqrt(d/g') a bed has no scale.
"""
DENSITY = 2500.0
"""Its density, kg/m3."""
GRAVITY = 9.81
"""Its reduced gravity g', m/s2."""
WEIGHT = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
"""Its weight, N."""
MEANING = {
    "diameter": "d of the units below; of every grain, or the median of a mixture, m",
    "smallest": "diameter of the smallest grain that may move, d",
    "density": "kg/m3",
    "gravity": "of the submerged grain, m/s2",
    "friction": "tan(phi)",
    "stiffness": "K d/W, normal and tangential; when a bed is poured, of each stage",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "waiting_time": "time without a passage that ends a load step without rest,"
    " sqrt(d/g')",
    "rest_energy": "kinetic energy of all grains that have not passed, below which is"
    " rest, W d",
    "sampling_interval": "time between two samples of the grains, sqrt(d/g')",
    "events": "gusts in each load step, whose forces are in gusts.txt; 0: none",
    "event_samples": "samples of the grains in each of them",
    "settle": "time before the first load step, at least, sqrt(d/g')",
    "most_settle": "longest such time: as long as it takes the bed to lie, sqrt(d/g')",
    "noise": "kinetic energy of a mean grain below which a bed lies, W^2/K;"
    " 0: it need not",
    "settle_drag": "drag of a still fluid in that time, m sqrt(g/d)",
    "displacement_criterion": "displacement along the bed that counts as motion, d",
    "stir": "displacement from which on passage.dump lists a grain, d",
    "away": "displacement along the bed from which on a counted grain is gone, d",
    "enough": "the run ends when no more counted grains than this have not moved",
    "slope": "slope of both faces, degrees",
    "ceiling_x": "ridge of the roof above which a grain in flight is gone, m",
    "ceiling_z": "height of the ridge, m",
    "behind": "place along x behind which every grain is gone, m",
    "upstream": "place along x of the wall before the bed, m",
    "downstream": "place along x of the wall behind the bed, m",
    "most_looks": "longest time of a stage, sqrt(d/g)",
    "drag": "of each stage: drag of the still fluid, m sqrt(g/d)",
    "calm": "of each stage: kinetic energy of a grain with which it ends, W d",
    "width": "width of a strip with periodic sides, d; 0: all grains in one plane",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the decks, with their units."""
GONE = 0
"""Kind of the grains that have gone: they are in no deck."""
FIXED = 1
"""Grain type of the deck: fixed."""
MOBILE = 2
"""Grain type: mobile and not exposed."""
COUNTED = 3
"""Grain type: mobile, exposed and counted."""
PUSHED = 4
"""Grain type: mobile, exposed and not counted."""
SAMPLING_INTERVAL = 0.5
"""Time between two samples of the grains, sqrt(d/g')."""
REST_ENERGY = 1e-6
"""Kinetic energy of all mobile grains that have not passed the displacement criterion,
W d, below which a load step ends, if it falls. Of 1476 thresholds of 369 piles, 1438
lie in the same load step as with the waiting time alone, 23 in one beside it, 15
further off: most on level and disordered rows, where round-off decides. Of 1079 single
grains none moves in another load step."""
SETTLE = 10.0
"""Time in which the bed settles before the first load step, at least, sqrt(d/g')."""
MOST_SETTLE = 400.0
"""Time after which a bed that does not lie yet is given up, sqrt(d/g')."""
NOISE = 0.01
"""Most kinetic energy of a mobile grain at rest, over W^2/K, which is twice what its
weight stores in a spring. Beyond it trials at 0 to 0.9 of damping and 0.05 to 1.2 of
time step gave other thresholds; at a damping of 0.1 and a time step of 0.3 it is
1e-5."""
POURED_DRAG = 2.0
"""Drag of a still fluid in which a poured bed settles, m sqrt(g'/d): its springs may be
softer than those of the pouring, and without a drag a pile of 25 degrees was not at
rest at the end."""
SETTLE_FLOW = math.sqrt(0.5)
"""Flow of the settling over that of the first load step: about half of its force.
Without any, a bed at its limiting slope would not come to rest."""
STEADY = np.ones(1)
"""The gusts of a deck without any."""
START = 0.9
"""Flow of the first load step over that of the first threshold by the pivot law."""
BEYOND = 1.2
"""The last load step's flow over that at which the pivot law says that enough grains
have moved."""
STIR = 0.02
"""A counted grain that is no further from its place lies there, d: it is left out of
the dump. With a small displacement criterion, or small grains, it is less."""
AWAY = 10.0
"""A counted grain that has come so far along the bed is gone, d: those that it could
still meet have left before it."""
LATTICE_RATE = 4.5e7
"""Grain-steps a second on lattices, measured with 30 to 770 counted grains."""
POURED_RATE = 6e6
"""Grain-steps a second on poured beds."""
SLOWED_BY = 700.0
"""Exposed grains of a poured bed that double its load steps: the more are exposed, the
more often one passes before all have waited. Load steps of 2000 took four times as long
as those of 100."""


class DeckCase(Case):
    """A case that moves grains in time, by the engine."""

    def versions(self) -> dict[str, str]:
        """The programs that run the case.

        Returns
        -------
        dict of str to str
            The version of each.
        """
        return ENGINE.programs(self.ranks)

    def begun(self, directory: Path) -> int:
        """Count the load steps that have begun.

        Parameters
        ----------
        directory
            The case.

        Returns
        -------
        int
            The number of the last one; 0 where none has.
        """
        step, *_ = process.last_words(directory / "samples.csv").split(",")
        return int(step) if step.isdecimal() else 0


def protocol(
    grain: GrainPart,
    method: GrainMethod,
    displacement: float,
    enough: int = 0,
    smallest: float = 1,
    gusts: Gusts | None = None,
) -> dict[str, float | int]:
    """List the variables of the contact law, of the settling, and of the load steps.

    Parameters
    ----------
    grain
        The grains of the scene.
    method
        Contacts and load steps.
    displacement
        Displacement from which a grain counts as moved, d.
    enough
        The load steps end early when no more counted grains have not moved.
    smallest
        Diameter of the smallest grain that may move, d.
    gusts
        The gusts of the flow; one lasts a whole number of samples.

    Returns
    -------
    dict of str to number
        Variables of the deck, see `MEANING`.
    """
    event = gusts.duration if gusts else SAMPLING_INTERVAL
    samples = max(round(event / SAMPLING_INTERVAL), 1)
    return {
        "friction": math.tan(math.radians(grain.friction_angle_deg)),
        "stiffness": method.stiffness,
        "damping": method.damping,
        "time_step": method.time_step,
        "waiting_time": method.waiting_time,
        "rest_energy": REST_ENERGY,
        "sampling_interval": event / samples,
        "events": gusts.events if gusts else 0,
        "event_samples": samples,
        "settle": SETTLE,
        "most_settle": MOST_SETTLE,
        "noise": NOISE,
        "settle_drag": 0.0,
        "displacement_criterion": displacement,
        "stir": min(STIR, displacement * smallest / 2),
        "away": AWAY,
        "enough": enough,
    }


def rising_flows(first: float, last: float, step: float) -> FloatArray:
    """List the flow of the settling, then those of load steps.

    Parameters
    ----------
    first
        The flow of the first load step.
    last
        The last load step reaches at least this flow.
    step
        By how much each load step is higher, relative.

    Returns
    -------
    FloatArray
        The flows, with the nine digits that the deck reads.
    """
    count = 1 + digits.whole_up(math.log(last / first) / math.log1p(step))
    rising = first * (1 + step) ** np.arange(count)
    return digits.all_rounded([SETTLE_FLOW * first, *rising.tolist()])


def cost_s(
    load_steps: float,
    grains: float,
    rest: float,
    method: GrainMethod,
    grain: GrainPart,
    exposed: float = math.nan,
) -> float:
    """Estimate the time of one core for a deck.

    Parameters
    ----------
    load_steps
        Number of load steps.
    grains
        Number of grains.
    rest
        Time until a load step of a lattice ends at rest, sqrt(d/g'); it ends at the
        latest after twice the waiting time.
    method, grain
        Contacts and load steps, and the grains of the scene. The smallest grain of a
        poured bed sets the time step.
    exposed
        Number of grains that a poured bed exposes; NaN for a lattice.

    Returns
    -------
    float
        The time, s.
    """
    if math.isnan(exposed):
        length = min(rest, 2 * method.waiting_time)
        rate = LATTICE_RATE
    else:
        smallest, _ = extremes(grain.sizes, grain.diameter)
        small = math.pow(smallest, 1.5)
        length = method.waiting_time * (1 + exposed / SLOWED_BY) / small
        rate = POURED_RATE
    steps = load_steps * length * math.sqrt(method.stiffness) / method.time_step
    return 0.1 + steps * grains / rate


@dataclass(frozen=True)
class GrainTable:
    """The n grains of a deck; the id of a grain is its place, from 1.

    Attributes
    ----------
    position
        X, y, z of the centres, m, shape (n, 3).
    kind
        One of GONE, FIXED, MOBILE, COUNTED, PUSHED, shape (n,).
    along
        Unit vector downstream along the bed, in which displacement is counted, shape
        (n, 2).
    sizes
        Diameter of each grain over `diameter`, shape (n,).
    diameter
        The diameter d of the deck's units, m.
    density
        Density of every grain, kg/m3.
    width
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
    def mobile_count(self) -> int:
        """How many grains may move."""
        return int((self.kind > FIXED).sum())


def write_deck(
    directory: Path,
    grains: GrainTable,
    parameters: Mapping[str, float | int],
    flows: FloatArray,
    force: FloatArray,
    margin: float,
    ranks: int = 1,
    gusts: FloatArray = STEADY,
) -> None:
    """Write the files of a deck into a copy of the engine's template ``bed``.

    Parameters
    ----------
    directory
        The copy.
    grains
        The n grains.
    parameters
        Variables of the deck, see `MEANING`.
    flows
        The flow of the settling, then of each of s load steps.
    force
        The flow's force on each grain at these flows, N, shape (s + 1, n, 2); only
        pushed grains feel one.
    margin
        Distance from the outermost grains to the walls of the box, m; beyond them a
        grain is gone.
    ranks
        Processes that share the grains.
    gusts
        Factors of the force: in the settling, then for each load step in each event and
        after the last.
    """
    present = np.flatnonzero(grains.kind != GONE)
    places = grains.position[present]
    bounds = np.array([places.min(axis=0) - margin, places.max(axis=0) + margin])
    if grains.width:
        bounds[:, 1] = (0.0, grains.width * grains.diameter)
    ENGINE.write_grains(
        directory,
        grains.position,
        grains.kind,
        grains.diameter * grains.sizes,
        grains.density,
        bounds,
        present,
    )
    numbers = {**parameters, "width": grains.width, "ranks": ranks}
    ENGINE.write_parameters(directory, numbers, MEANING)
    ENGINE.write_numbers(directory / "load_steps.txt", flows)
    ENGINE.write_numbers(directory / "gusts.txt", gusts)
    pushed = np.flatnonzero(grains.kind >= COUNTED)
    counted = np.flatnonzero(grains.kind == COUNTED)
    for place, axis in enumerate("xz"):
        ENGINE.write_sets(
            directory / f"force.{axis}.txt", pushed, force[:, pushed, place]
        )
        # in these units displacement is one in the grain's own diameter
        direction = grains.along[None, counted, place] / grains.sizes[counted]
        ENGINE.write_sets(directory / f"along.{axis}.txt", counted, direction)


def read_texts(path: Path, rows: int = 1) -> dict[str, NDArray[Any]]:
    """Read the texts of a CSV of the deck or of `collect`, which quotes none.

    Parameters
    ----------
    path
        The file.
    rows
        Least number of its rows.

    Returns
    -------
    dict of str to ndarray
        The texts of each column.

    Raises
    ------
    SolverError
        If it is not whole or has less rows.
    """
    try:
        head, *lines = path.read_text(encoding="ascii").split("\n")
        is_short = len(lines) <= rows
        if is_short or lines.pop():
            raise ValueError("it is cut short")
        columns = np.array([line.split(",") for line in lines]).T
        return dict(zip(head.split(","), columns, strict=True))
    except (OSError, ValueError) as error:
        what = f"the table cannot be read: {error}"
        remedy = "run the same command again"
        raise SolverError(what, where=str(path), remedy=remedy) from None


def read_table(path: Path, rows: int = 1) -> pd.DataFrame:
    """Read the numbers of such a CSV, to the last digit.

    Parameters
    ----------
    path
        The file.
    rows
        Least number of its rows.

    Returns
    -------
    DataFrame
        The numbers; NaN where one is missing.
    """
    columns = {}
    for name, texts in read_texts(path, rows).items():
        columns[name] = np.where(texts == "", "nan", texts).astype(float)
    return pd.DataFrame(columns)
