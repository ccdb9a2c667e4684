"""The packing of a bed that LIGGGHTS has poured: which grains are exposed, and which may move."""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.bed.cover import counted_segments, within
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import TIE, Packing
from orchestrator.bed.places import Places, across
from orchestrator.bed.poured_case import BED
from orchestrator.errors import InputError
from orchestrator.study.parts import Range

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

LAYER = np.sin(np.pi / 3)
"""Thickness of a layer, d: as of a lattice."""
NEAR = 0.5
"""Fixed grains whose surfaces are nearer than this to a mobile one's are in the case, d."""
LOCAL = 5.0
"""Length of bed before and behind a grain that it is held against, d."""


def read(
    directory: Path,
    line: BedLine,
    counts: str | Range,
    *,
    surface: float,
    mobile_layers: int,
    width: float = 0.0,
) -> Packing:
    """The packing of a finished case.

    Parameters
    ----------
    directory : Path
        Directory of the case `PouredBed`.
    line : BedLine
        Bed line of the flow, d.
    counts : {"windward", "all"} or (float, float)
        Which exposed grains are counted: those of segments that rise, all, or a range of x.
    surface : float
        Height over the line, normal to it, of the highest centres.
    mobile_layers : int
        Layers of the forms that may move.
    width : float
        Width of a strip with periodic sides; 0 in one plane.
    """
    rows = pd.read_csv(directory / BED)
    centres, sizes = rows[["x_over_d", "z_over_d"]].to_numpy(float), rows["size"].to_numpy(float)
    segment, along = line.nearest(centres)
    height = np.einsum("nk,nk->n", centres - line.corners[segment], line.normals[segment])
    places = Places.of(centres, rows["y_over_d"].to_numpy(float), width)
    y = places.xyz[:, 1]
    free = unshadowed(along, height, sizes / 2, y, width) & (rows["fixed"] == 0).to_numpy()
    on_form = (segment > 0) & (segment < len(line.lengths) - 1)
    in_layers = surface - height < (mobile_layers - 0.5) * LAYER
    mobile = (in_layers | free) & on_form & (rows["fixed"] == 0).to_numpy()
    counted = free & counted_segments(line, counts)[segment] & within(centres[:, 0], counts)
    if not counted.any():
        raise InputError(
            "no grain of the poured bed is exposed where grains are counted",
            where="bed.counted",
            remedy="choose another part of the bed, or another bed.seed",
        )
    # along the bed; the fixed ones last, for a deck must not lose the grain of its highest id
    order = np.lexsort((along, ~mobile))
    kept = order[(mobile | _near(places, sizes, mobile))[order]]
    return Packing(
        centres=centres[kept],
        sizes=sizes[kept],
        mobile=mobile[kept],
        windward=counted[kept],
        lee=(free & on_form & ~counted)[kept],
        arc_length=along[kept],
        across=y[kept],
        width=width,
    )


def unshadowed(
    along: FloatArray,
    height: FloatArray,
    radii: FloatArray,
    sideways: FloatArray | float = 0.0,
    width: float = 0.0,
) -> BoolArray:
    """Which grains are exposed.

    A grain is exposed when the line through its centre, normal to the bed, meets no other grain
    whose centre lies higher.

    Parameters
    ----------
    along, height, radii : ndarray, shape (n,)
        Place along the bed, height over it, radius, in one unit of length.
    sideways, width
        Place across the flow, and the width of a strip; 0 in one plane.
    """
    order = np.argsort(along, kind="stable")
    x, z, r = along[order], height[order], radii[order]
    y = np.broadcast_to(sideways, along.shape)[order]
    free = np.ones(len(x), bool)
    most = float(r.max()) + TIE
    for apart in range(1, len(x)):
        gap = x[apart:] - x[:-apart]
        near = np.flatnonzero(gap <= most)
        if not len(near):
            break
        first, second = near, near + apart
        away = np.hypot(gap[near], across(y[second] - y[first], width))
        free[first] &= (away > r[second] + TIE) | (z[second] <= z[first] + TIE)
        free[second] &= (away > r[first] + TIE) | (z[first] <= z[second] + TIE)
    found = np.empty_like(free)
    found[order] = free
    return found


def standing(packing: Packing, line: BedLine) -> FloatArray:
    """How much higher each grain's lowest point lies than that of a mean exposed grain, d, (n,).

    The local bed is the mean height of the exposed centres within `LOCAL` along the bed, less half
    of d: a grain of d at that height stands as all grains of a lattice do.
    """
    segment, along = line.nearest(packing.centres)
    away = packing.centres - line.corners[segment]
    height = np.einsum("nk,nk->n", away, line.normals[segment])
    shown = packing.windward | packing.lee
    order = np.argsort(along[shown], kind="stable")
    place, sums = along[shown][order], np.append(0, np.cumsum(height[shown][order]))
    first, last = (np.searchsorted(place, along + side * LOCAL) for side in (-1, 1))
    near = np.maximum(last - first, 1)
    level = (sums[last] - sums[first]) / near
    return np.asarray(np.where(shown, height - packing.sizes / 2 - (level - 0.5), 0.0))


def contacts(places: Places, sizes: FloatArray, touch: float = 1e-3) -> IntArray:
    """Pairs of grains that touch, by their numbers, shape (k, 2).

    Two grains touch whose surfaces are nearer than a part of the mean of their diameters.
    """
    reach = (1 + touch) * float(sizes.max())
    pairs = places.tree().query_pairs(reach, output_type="ndarray")
    apart = np.linalg.norm(places.apart(*pairs.T), axis=1)
    return np.asarray(pairs[apart < (1 + touch) * sizes[pairs].mean(axis=1)])


def _near(places: Places, sizes: FloatArray, chosen: BoolArray) -> BoolArray:
    """Which grains lie near one of the chosen ones."""
    reach = float(sizes.max()) + NEAR
    numbers, tree = np.flatnonzero(chosen), places.tree(chosen)
    found = np.zeros(len(sizes), bool)
    for number, near in enumerate(tree.query_ball_point(places.xyz, reach)):
        others = numbers[near]
        apart = np.linalg.norm(places.apart(np.full_like(others, number), others), axis=1)
        found[number] = bool(np.any(apart < (sizes[others] + sizes[number]) / 2 + NEAR))
    return found
