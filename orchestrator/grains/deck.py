"""The tables and parameters that LIGGGHTS reads beside a copy of the template deck."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GONE, FIXED, MOBILE, COUNTED, PUSHED = 0, 1, 2, 3, 4
"""Grain types of the deck: fixed; mobile; mobile and exposed: counted, or pushed only. Those that
have gone are in no deck."""

MEANING = {
    "diameter": "d of the units below; of every grain, or the median of a mixture, m",
    "smallest": "diameter of the smallest grain that may move, d",
    "density": "kg/m3",
    "gravity": "of the submerged grain, m/s2",
    "friction": "tan(phi)",
    "stiffness": "K d/W, normal and tangential",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "waiting_time": "time without a passage of the criterion that ends a load step, sqrt(d/g')",
    "sampling_interval": "time between two samples of the grains, sqrt(d/g')",
    "settle": "time before the first load step, sqrt(d/g')",
    "settle_drag": "of a still fluid in that time, m sqrt(g/d)",
    "displacement_criterion": "displacement along the bed that counts as motion, d",
    "stir": "displacement from which on passage.dump lists a grain, d",
    "away": "displacement along the bed from which on a counted grain is gone, d",
    "enough": "the end: no more counted grains than this still lie",
    "slope": "of both faces, degrees",
    "ceiling_x": "ridge of the roof above which a grain in flight is gone, m",
    "ceiling_z": "its height, m",
    "behind": "place along x behind which every grain is gone, m",
    "width": "of a strip with periodic sides, d; 0: all grains in one plane",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""


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
    kind: NDArray[np.int64]
    along: FloatArray
    sizes: FloatArray
    diameter: float
    density: float
    width: float = 0.0

    @property
    def counted_ids(self) -> NDArray[np.int64]:
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
    (directory / "grains.data").write_text(_data_file(grains, margin))
    # float() because a numpy number's repr is not one that the deck could read
    given = {**parameters, "width": grains.width, "ranks": ranks}
    numbers = {k: v if isinstance(v, int) else float(v) for k, v in given.items()}
    lines = (
        f"variable        {name} equal {value!r}  # {MEANING[name]}\n"
        for name, value in numbers.items()
    )
    (directory / "parameters.liggghts").write_text("".join(lines))
    (directory / "load_steps.txt").write_text("".join(f"{flow!r}\n" for flow in flows.tolist()))
    pushed = np.flatnonzero(grains.kind >= COUNTED)
    counted = np.flatnonzero(grains.kind == COUNTED)
    for place, axis in enumerate("xz"):
        _write_sets(directory / f"force.{axis}.txt", pushed, force[:, pushed, place])
        # in these units displacement is one in the grain's own diameter
        own = grains.along[None, counted, place] / grains.sizes[counted]
        _write_sets(directory / f"along.{axis}.txt", counted, own)


def _write_sets(path: Path, grains: NDArray[np.int64], sets: FloatArray) -> None:
    """Write sets of values of grains as LIGGGHTS reads them: a count, then ids and values."""
    ids = [f"{number} " for number in (grains + 1).tolist()]
    with path.open("w") as stream:
        for values in sets.tolist():
            stream.write(f"{len(ids)}\n")
            stream.writelines(f"{a}{b!r}\n" for a, b in zip(ids, values, strict=True))


def _data_file(grains: GrainTable, margin: float) -> str:
    # a rounded bound would lose the grains that lie on it: every number has all its digits
    there = grains.kind != GONE
    low = (grains.position[there].min(axis=0) - margin).tolist()
    high = (grains.position[there].max(axis=0) + margin).tolist()
    if grains.width:
        low[1], high[1] = 0.0, grains.width * grains.diameter
    bounds = "".join(
        f"{a!r} {b!r} {axis}lo {axis}hi\n" for a, b, axis in zip(low, high, "xyz", strict=True)
    )
    diameters = (grains.diameter * grains.sizes).tolist()
    columns = zip(grains.kind.tolist(), diameters, grains.position.tolist(), strict=True)
    rows = "".join(
        f"{number} {kind} {diameter!r} {grains.density!r} {x!r} {y!r} {z!r}\n"
        for number, (kind, diameter, (x, y, z)) in enumerate(columns, 1)
        if kind != GONE
    )
    head = f"grains: id type diameter density x y z\n\n{there.sum()} atoms\n4 atom types\n\n"
    return f"{head}{bounds}\nAtoms\n\n{rows}"
