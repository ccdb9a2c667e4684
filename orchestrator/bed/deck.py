"""The files of a deck of LIGGGHTS: parameters, grains, and the text dumps that it writes."""

from collections.abc import Mapping
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.errors import SolverError
from orchestrator.types import FloatArray, IntArray

MEANING = {
    "diameter": "d of the units below; of every grain, or the median of a mixture, m",
    "smallest": "diameter of the smallest grain that may move, d",
    "density": "kg/m3",
    "gravity": "of the submerged grain, m/s2",
    "friction": "tan(phi)",
    "stiffness": "K d/W, normal and tangential; when a bed is poured, of each stage",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "waiting_time": "time without a passage of the criterion that ends a load step, sqrt(d/g')",
    "sampling_interval": "time between two samples of the grains, sqrt(d/g')",
    "settle": "time before the first load step, sqrt(d/g')",
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


def write_parameters(
    directory: Path, values: Mapping[str, float | int | tuple[float, ...]]
) -> None:
    """Write ``parameters.liggghts``: a variable for each number, an index for each tuple."""
    lines = []
    for name, value in values.items():
        if isinstance(value, tuple):
            text = f"index {' '.join(map(repr, value))}"
        else:
            # float() because LIGGGHTS cannot read the repr of a numpy number
            text = f"equal {value if isinstance(value, int) else float(value)!r}"
        lines.append(f"variable        {name} {text}  # {MEANING[name]}\n")
    (directory / "parameters.liggghts").write_text("".join(lines))


def write_grains(
    directory: Path,
    position: FloatArray,
    kind: IntArray,
    diameters: FloatArray,
    density: float,
    bounds: FloatArray,
    order: IntArray,
) -> None:
    """Write ``grains.data``. Every number has all its digits: a rounded bound would lose grains.

    Parameters
    ----------
    directory : Path
        The case.
    position : ndarray, shape (n, 3)
        Centres, m; a grain's id is its place, from 1.
    kind : ndarray of int, shape (n,)
        Type of each grain in the deck.
    diameters : ndarray, shape (n,)
        m.
    density : float
        kg/m3.
    bounds : ndarray, shape (2, 3)
        Lower and upper corner of the box, m.
    order : ndarray of int, shape (k,)
        Places of the grains that are written, in order.
    """
    box = "".join(
        f"{low!r} {high!r} {axis}lo {axis}hi\n"
        for axis, low, high in zip("xyz", *bounds.tolist(), strict=True)
    )
    columns = (values[order].tolist() for values in (kind, diameters, position))
    rows = "".join(
        f"{place + 1} {number} {diameter!r} {density!r} {x!r} {y!r} {z!r}\n"
        for place, number, diameter, (x, y, z) in zip(order.tolist(), *columns, strict=True)
    )
    head = f"grains: id type diameter density x y z\n\n{len(order)} atoms\n4 atom types\n\n"
    (directory / "grains.data").write_text(f"{head}{box}\nAtoms\n\n{rows}")


def read_table(path: Path, rows: int = 1) -> pd.DataFrame:
    """Read a CSV of numbers that a deck has written.

    Raises
    ------
    SolverError
        If it is missing or cut short, or has fewer rows.
    """
    try:
        text = path.read_text(encoding="ascii")
        table = pd.read_csv(StringIO(text))
        if len(table) < rows or not text.endswith("\n"):
            raise ValueError("it is cut short")
    except (OSError, ValueError) as error:
        raise SolverError(
            f"the table cannot be read: {error}",
            where=str(path),
            remedy="run the same command again",
        ) from None
    return table


def read_dump(path: Path, columns: tuple[str, ...]) -> tuple[IntArray, pd.DataFrame]:
    """Read a text dump of some columns.

    Returns
    -------
    steps : ndarray of int
        Time step of each frame, also of those without a grain.
    rows : DataFrame
        A row for each grain and frame, with the frame's time step in the column ``step``.

    Raises
    ------
    SolverError
        If it is missing, cut short or not a dump of these columns.
    """
    try:
        text = path.read_text(encoding="ascii")
        heads = [frame.split("\n", 8) for frame in text.split("ITEM: TIMESTEP\n")[1:]]
        steps = np.array([int(head[0]) for head in heads])
        counts = np.array([int(head[2]) for head in heads])
        body = StringIO("".join(head[8] for head in heads))
        rows = pd.read_csv(body, sep=r"\s+", names=list(columns), header=None)
        whole = text.endswith("\n") and len(rows) == counts.sum()
        if not whole or rows.isna().any(axis=None):
            raise ValueError("it is cut short or has NaN")
    except (OSError, ValueError, IndexError) as error:
        raise SolverError(
            f"the dump cannot be read: {error}", where=str(path), remedy="run the case again"
        ) from None
    return steps, rows.assign(step=np.repeat(steps, counts))
