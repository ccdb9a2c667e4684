"""What the mesh at a sharp crest is worth: the stress there has no limit of fine cells.

Numbers of docs/measured/flow_crest.csv (`orchestrator convergence`): four piles of 15
to 30 degrees, 20 mm high, of grains of 1 mm in rows along the slope, z0 of 3.3 and 33
um, by peeling. First cells of h/40, h/80 and h/160, with 40, 80 and 160 cells on a
face.
"""

from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

FIRST_GRAIN = (-0.0355, 0.0885)
"""Least and largest change of u*_0 of first motion from h/40 to h/160, relative."""
TENTH = (-0.0355, 0.055)
"""The same at n/N = 10 %."""
PILES = 4
"""On how many piles it was measured."""


def has_sharp_crest(scene: Scene) -> bool:
    """Whether a flow is solved over a pile whose crest is an edge.

    Returns
    -------
    bool
        Whether its thresholds of the first grains depend on the first cell so much.
    """
    bed = scene.bed
    is_edge = isinstance(bed, PileBed) and bed.is_wedge
    return is_edge and scene.method.flow.facts.is_solved


def told(change: tuple[float, float]) -> str:
    """Write a range of changes.

    Parameters
    ----------
    change
        Least and largest change, relative.

    Returns
    -------
    str
        Both in whole percent.

    Examples
    --------
    >>> told((-0.0355, 0.0885))
    '−4 … +9 %'
    """
    low, high = (f"{100 * end:+.0f}".replace("-", "−") for end in change)
    return f"{low} … {high} %"
