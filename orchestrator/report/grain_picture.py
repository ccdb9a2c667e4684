"""The grains of a pile when a fraction of them has moved, coloured by how far."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from orchestrator.grains.pile import PileCase
from orchestrator.report import captions, labels, snapshot, style
from orchestrator.report.figure import Figure
from orchestrator.report.picture import Picture
from orchestrator.report.results import Results, split, valid
from orchestrator.report.snapshot import Snapshot

FRACTION = 0.3
"""n/N of the instant that is shown, or the nearest that the study reports."""
PIXELS = 2000
LYING, FIXED = (0.90, 0.87, 0.80), (0.55, 0.55, 0.55)
GONE = "#b03030"
TICKS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30)
SCALE = ScalarMappable(LogNorm(TICKS[0], TICKS[-1]), colormaps["YlOrRd"])
LONG = 40.0
"""Half length of a pile, d, beyond which the crest gets a panel of its own."""
Window = tuple[float, float, float, float]


def plan(results: Results, folder: Path) -> Iterator[Picture]:
    """One figure for each slope: of its largest grains, whose closure holds if any does."""
    for pile in _chosen(results):
        fraction = min(pile.scene.protocol.fractions, key=lambda f: abs(f - FRACTION))
        found = snapshot.take(pile, results.cases, fraction)
        if found:
            yield _picture(pile, found, folder)


def _chosen(results: Results) -> Iterator[PileCase]:
    for _, rows in split(results.joined("pile_threshold"), "alpha_deg"):
        order = rows.assign(valid=valid(rows)).sort_values(
            ["valid", "d_m", "z0_over_d", "scene_id"], ascending=[False, False, True, True]
        )
        yield results.plan.piles[str(order["scene_id"].iloc[0])]


def _picture(pile: PileCase, found: Snapshot, folder: Path) -> Picture:
    grains = folder / f"{pile.name}.npz"
    present = ~found.gone
    np.savez(grains, centres=found.place[present], colours=_colours(found)[present])
    windows = _windows(pile)
    jobs = tuple(
        {
            "kind": "grains",
            "grains": str(grains),
            "window": window,
            "pixels": [PIXELS, round(PIXELS * _shape(window))],
            "out": str(folder / f"{pile.name}-{number}.png"),
        }
        for number, window in enumerate(windows)
    )
    alpha, d = labels.plain("alpha_deg", pile.bed.slope_deg), pile.scene.grain.diameter
    title = f"Grains when {found.fraction:.0%} have moved, {alpha}, d = {labels.millimetres(d)}"
    figure = Figure(
        f"grains-alpha{pile.bed.slope_deg:g}",
        title,
        captions.grains(pile, found),
        (pile.name,),
        None,
    )
    return Picture(figure, jobs, lambda: _frame(found, windows, [str(job["out"]) for job in jobs]))


def _colours(found: Snapshot) -> NDArray[np.uint8]:
    shades = SCALE.to_rgba(np.maximum(found.displacement, 1e-9))[:, :3]
    shades[found.displacement < TICKS[0]] = LYING
    shades[~found.mobile] = FIXED
    return np.asarray(np.rint(255 * shades), np.uint8)


def _windows(pile: PileCase) -> list[Window]:
    """The whole pile and, if that is long, its crest."""
    x, z = (float(edge) for edge in pile.triangle.crest)
    whole = -6.0, 2 * x + 6, -2.5, z + 6
    return [whole, (x - 28, x + 14, z - 9, z + 5)] if x > LONG else [whole]


def _shape(window: Window) -> float:
    left, right, bottom, top = window
    return (top - bottom) / (right - left)


def _frame(found: Snapshot, windows: list[Window], files: list[str]) -> Canvas:
    shapes = [_shape(window) for window in windows]
    figure = style.canvas(6.4 * sum(shapes) + 1.3)
    axes = list(figure.subplots(len(windows), 1, height_ratios=shapes, squeeze=False)[:, 0])
    for ax, window, file in zip(axes, windows, files, strict=True):
        _panel(ax, found, window, file)
    for left, right, bottom, top in windows[1:]:
        box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="0.2", lw=0.7)
        axes[0].add_patch(box)
    axes[-1].set_xlabel("$x/d$ from the windward toe")
    bar = figure.colorbar(SCALE, ax=axes, location="bottom", aspect=60, pad=0.02, extend="max")
    bar.set_label("distance from its place in the packing, $d$")
    bar.set_ticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    style.legends(figure, _entries(), [])
    return figure


def _entries() -> list[Artist]:
    looks = (
        ("fixed", {"mfc": FIXED, "mec": "none"}),
        ("mobile, displaced by less than 0.01 $d$", {"mfc": LYING, "mec": "none"}),
        ("left the box: where it lay", {"mfc": "none", "mec": GONE, "mew": 0.7}),
    )
    return [Line2D([], [], ls="", marker="o", ms=6, label=text, **look) for text, look in looks]


def _panel(ax: Axes, found: Snapshot, window: Window, file: str) -> None:
    ax.imshow(imread(file), extent=window, zorder=2)
    empty = found.start[found.gone]
    size = np.ones(len(empty))
    ax.add_collection(
        EllipseCollection(
            size,
            size,
            0 * size,
            units="xy",
            offsets=empty,
            offset_transform=ax.transData,
            fc="none",
            ec=GONE,
            lw=0.5,
            zorder=1,
            gid="gone",
        )
    )
    ax.set(xlim=window[:2], ylim=window[2:], ylabel="$z/d$", aspect="equal")
