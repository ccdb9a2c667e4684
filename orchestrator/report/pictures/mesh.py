"""The mesh of the flow over a pile, and of its crest."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from orchestrator.grains.pile import Pile
from orchestrator.report import captions, stress, style
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import flow
from orchestrator.report.pictures.flow_field import Window
from orchestrator.report.results import Results

FloatArray = NDArray[np.float64]

BESIDE, ABOVE = 2.0, 2.5
"""Mesh shown beside the toes and above the flat bed, h."""
CREST = (-0.7, 0.7, -0.25, 0.25)
"""The zoom: from the crest to its edges, h."""


def draw(results: Results) -> Iterator[Figure]:
    """One figure: of the study's least slope, whose mesh stands for all."""
    for pile in flow.chosen(results)[:1]:
        edges = read_edges(results.cases / pile.flow.name) / pile.bed.height
        canvas = _frame(pile, edges, stress.title(results, pile))
        yield Figure(
            "mesh", "Mesh of the flow", captions.mesh(pile), (pile.flow.name,), canvas, fold=True
        )


def read_edges(case: Path) -> FloatArray:
    """The edges of a mesh one cell deep, seen across the flow: x and z of ends, (E, 2, 2), m."""
    mesh = meshio.read(case / "pile.msh")
    front = mesh.points[:, 1] < mesh.points[:, 1].mean()
    corners = mesh.cells_dict["quad"]
    side = corners[front[corners].all(axis=1)]
    ends = np.concatenate([side[:, list(pair)] for pair in pairwise((0, 1, 2, 3, 0))])
    seen = np.unique(np.sort(ends, axis=1), axis=0)
    return np.asarray(mesh.points[seen][:, :, [0, 2]])


def _frame(pile: Pile, edges: FloatArray, title: str) -> Canvas:
    (x, z), end = pile.model.line.crest / pile.bed.height, pile.model.line.x[-2] / pile.bed.height
    left, right, bottom, top = CREST
    windows = [
        (-BESIDE, end + BESIDE, 0.0, ABOVE),
        (x + left, x + right, z + bottom, z + top),
    ]
    shapes = [(top - bottom) / (right - left) for left, right, bottom, top in windows]
    figure = style.canvas(6.4 * sum(shapes) + 0.8)
    axes = list(figure.subplots(2, 1, height_ratios=shapes))
    for ax, window in zip(axes, windows, strict=True):
        _panel(ax, edges, window)
        flow.draw_bed(ax, pile)
    left, right, bottom, top = windows[1]
    box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="#d55e00", lw=1)
    axes[0].add_patch(box)
    axes[0].set_title(title, loc="left")
    axes[1].set_title("the crest", loc="left")
    axes[1].set_xlabel("$x/h$ from the windward toe")
    return figure


def _panel(ax: Axes, edges: FloatArray, window: Window) -> None:
    left, right, bottom, top = window
    low, high = edges.min(axis=1), edges.max(axis=1)
    shown = (high >= [left, bottom]).all(axis=1) & (low <= [right, top]).all(axis=1)
    # as one line with gaps: thousands of lines would take seconds and megabytes
    gap = np.full((int(shown.sum()), 1, 2), np.nan)
    x, z = np.concatenate([edges[shown], gap], axis=1).reshape(-1, 2).T
    ax.plot(x, z, color="0.25", lw=0.3, gid="mesh")
    ax.set(xlim=(left, right), ylim=(bottom, top), ylabel="$z/h$", aspect="equal")
