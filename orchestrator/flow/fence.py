"""Porous fences: their loss of pressure, and the cells of the mesh that have it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from orchestrator import digits
from orchestrator.bed.line import BedLine, PorousFence
from orchestrator.types import FloatArray, IntArray

FENCES = "constant/fences"
"""The file of a case with the losses of its fences."""
ENTRY = (
    "{0}\n{{\n    $:fence;\n    explicitPorositySourceCoeffs\n    {{\n"
    "        $:screen;\n        cellZone        {0};\n"
    "        f               ({1} {1} {1});\n    }}\n}}\n"
)
LEAST_PART = 1e-6
"""Least part of a cell in a fence that counts: less is round-off."""


def loss(porosity: ArrayLike) -> FloatArray:
    """Pressure that the flow loses in a fence, over rho U^2/2 of the flow through it.

    It is that of a thin plate with sharp edges across a duct (Idelchik, Handbook of
    Hydraulic Resistance, diagram 8-1).

    Parameters
    ----------
    porosity
        Open part of the fence, above 0.

    Returns
    -------
    FloatArray
        The coefficient; U is the velocity far before the fence in a duct.

    Examples
    --------
    >>> loss([0.5, 1.0]).tolist()
    [4.0, 0.0]
    """
    open_part = np.asarray(porosity, float)
    shut = 1 - open_part
    return np.asarray(((np.sqrt(shut / 2) + shut) / open_part) ** 2)


@dataclass(frozen=True)
class FenceCells:
    """Cells of a mesh that have one share of the loss of a fence.

    Attributes
    ----------
    name
        What they are called.
    cells
        Their numbers.
    per_metre
        Loss over rho U^2/2 in a metre of the way through them, 1/m.
    """

    name: str
    cells: IntArray
    per_metre: float


def fence_cells(
    line: BedLine, middles: FloatArray, tops: FloatArray
) -> list[FenceCells]:
    """Find the cells in the porous fences on a bed line.

    A fence ends within a row of cells: that row has the part of the loss that it is
    covered by.

    Parameters
    ----------
    line
        The bed line, m.
    middles
        Middles of the cells, m; shape (columns, cells of a column, 3).
    tops
        Heights of their upper sides over the bed, m, of the shape of the middles.

    Returns
    -------
    list of FenceCells
        Those below the top of each fence, and those in which it ends.
    """
    x = middles[:, 0, 0]
    numbers = np.arange(middles[..., 0].size).reshape(middles.shape[:2])
    found = []
    for count, fence in enumerate(line.fences, 1):
        columns = np.flatnonzero((x > fence.start) & (x < fence.end))
        per_metre = float(loss(fence.porosity)) / fence.thickness
        part = _covered(fence, tops[columns].mean(axis=0))
        whole = np.flatnonzero(part == 1)
        found.append(
            FenceCells(f"fence{count}", numbers[np.ix_(columns, whole)], per_metre)
        )
        for row in np.flatnonzero((part > LEAST_PART) & (part < 1)):
            share = float(part[row]) * per_metre
            found.append(FenceCells(f"fence{count}Top", numbers[columns, row], share))
    return [FenceCells(one.name, one.cells.ravel(), one.per_metre) for one in found]


def _covered(fence: PorousFence, tops: FloatArray) -> FloatArray:
    """Parts of rows of cells, whose upper sides are given, that are in a fence."""
    bottoms = np.concatenate([[0.0], tops[:-1]])
    part = (fence.height - bottoms) / (tops - bottoms)
    return np.asarray(np.clip(part, 0.0, 1.0))


def write_fences(directory: Path, fences: list[FenceCells]) -> None:
    """Write the losses of fences as the template's ``fvOptions`` include them.

    Parameters
    ----------
    directory
        The case.
    fences
        The cells of the fences; without any the file of the template stays.
    """
    if not fences:
        return
    path = directory / FENCES
    entries = [ENTRY.format(one.name, digits.text(one.per_metre)) for one in fences]
    text = path.read_text(encoding="utf-8")
    path.write_text(text + "".join(entries), encoding="utf-8")
