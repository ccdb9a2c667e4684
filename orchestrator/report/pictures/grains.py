"""The grains of a pile when a fraction of them has moved: how far, and how under which flow."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize, to_rgb, to_rgba_array
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from orchestrator.grains.pile import Pile
from orchestrator.report import captions, labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import flow, marks, snapshot, spheres
from orchestrator.report.pictures.marks import Window
from orchestrator.report.pictures.snapshot import Snapshot
from orchestrator.report.results import Results, split, valid

FloatArray = NDArray[np.float64]

FRACTION = 0.3
"""n/N of the instant that is shown, or the nearest that the study reports."""
PIXELS = 1400
GONE = "#b03030"
TICKS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30)
SCALE = ScalarMappable(LogNorm(TICKS[0], TICKS[-1]), colormaps["YlOrRd"])
# pale, so that grains of any colour stand out on it
PALE = LinearSegmentedColormap.from_list("pale", colormaps["Blues"](np.linspace(0, 0.6, 64)))
SPEED = ScalarMappable(Normalize(0, 1), PALE)


@dataclass(frozen=True)
class Shown:
    """What a figure shows: a pile at an instant, in some windows, and the flow over the last."""

    pile: Pile
    found: Snapshot
    windows: list[Window]
    velocity: FloatArray


def draw(results: Results) -> Iterator[Figure]:
    """One figure for each slope: of its largest grains, whose force law holds if any does.

    None where that pile's flow is a theory's, which has no field to show.
    """
    for pile in (one for one in chosen(results) if one.model.cases):
        fraction = min(pile.scene.protocol.fractions, key=lambda f: abs(f - FRACTION))
        passage = snapshot.read(pile, results.cases)
        look = passage.first(fraction)
        if look is not None:
            windows, d = marks.windows(pile), pile.scene.grain.diameter
            velocity = flow.sampled(pile, results.cases, windows[-1], d)
            shown = Shown(pile, passage.at(look), windows, velocity)
            caption = captions.grains(results, pile, shown.found, fraction)
            yield _figure(shown, fraction, caption)


def chosen(results: Results) -> Iterator[Pile]:
    """The pile that stands for all of its slope, by rising slope; of equals the study's first.

    A pile whose files were pruned stands for nothing.
    """
    for _, rows in split(results.joined("pile_threshold"), "alpha_deg"):
        order = rows.assign(valid=valid(rows)).sort_values(
            ["valid", "d_m", "z0_over_d"], ascending=[False, False, True], kind="stable"
        )
        piles = (results.shown(str(scene_id)) for scene_id in order["scene_id"])
        yield from itertools.islice(filter(results.has_files, piles), 1)


def _figure(shown: Shown, fraction: float, caption: str) -> Figure:
    pile = shown.pile
    alpha, d = (
        labels.plain("alpha_deg", pile.bed.slope_deg),
        labels.plain("d_m", pile.scene.grain.diameter),
    )
    return Figure(
        f"grains-alpha{pile.bed.slope_deg:g}",
        f"Grains when {fraction:.0%} have moved, {alpha}, {d}",
        caption,
        (pile.case.name, pile.flow.name),
        _frame(shown),
    )


def _by_distance(found: Snapshot) -> FloatArray:
    shades = SCALE.to_rgba(np.maximum(found.displacement, 1e-9))[:, :3]
    shades[found.displacement < TICKS[0]] = to_rgb(marks.LYING)
    shades[~found.mobile] = to_rgb(marks.FIXED)
    return np.asarray(shades)


def _by_mode(found: Snapshot) -> FloatArray:
    return to_rgba_array(marks.by_mode(found))[:, :3]


def _frame(shown: Shown) -> Canvas:
    shapes = [marks.shape(window) for window in (*shown.windows, shown.windows[-1])]
    figure = style.canvas(6.4 * sum(shapes) + 2.6)
    axes = list(figure.subplots(len(shapes), 1, height_ratios=shapes, squeeze=False)[:, 0])
    for ax, window in zip(axes, shown.windows, strict=False):
        _panel(ax, shown, window, _by_distance(shown.found), GONE)
    for left, right, bottom, top in shown.windows[1:]:
        box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="0.2", lw=0.7)
        axes[0].add_patch(box)
    _how(axes[-1], shown)
    axes[-1].set_xlabel("$x/d$ from the windward toe")
    _bars(figure, axes)
    style.legends(figure, _entries(), [])
    marks.mode_legend(figure, shown.pile)
    return figure


def _bars(figure: Canvas, axes: list[Axes]) -> None:
    bar = figure.colorbar(SCALE, ax=axes[:-1], location="bottom", aspect=60, pad=0.02, extend="max")
    bar.set_label("distance from its place in the packing, $d$")
    bar.set_ticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    bar = figure.colorbar(SPEED, ax=axes[-1], location="bottom", aspect=60, pad=0.02)
    bar.set_label(r"speed of the flow over that at the lid, $|\mathbf{u}|/U_e$")


def _how(ax: Axes, shown: Shown) -> None:
    window, found = shown.windows[-1], shown.found
    speed = np.linalg.norm(shown.velocity, axis=-1)
    ax.imshow(speed, origin="lower", extent=window, cmap=PALE, vmin=0, vmax=1, zorder=0)
    _panel(ax, shown, window, _by_mode(found), marks.edges(found))
    marks.place(marks.symbols(ax, window), found)


def _panel(
    ax: Axes, shown: Shown, window: Window, colours: FloatArray, edges: str | list[str]
) -> None:
    marks.ground(ax, shown.pile, window)
    found, here = shown.found, ~shown.found.gone
    marks.discs(ax, found.start[found.gone], fc="white", ec=edges, lw=0.6, zorder=1, gid="gone")
    image = spheres.picture(found.place[here], colours[here], window, PIXELS)
    ax.imshow(image, extent=window, zorder=2)


def _entries() -> list[Artist]:
    looks = (
        ("fixed", {"mfc": marks.FIXED, "mec": "none"}),
        ("mobile, displaced by less than 0.01 $d$", {"mfc": marks.LYING, "mec": "none"}),
        ("left the box: where it lay", {"mfc": "white", "mec": GONE, "mew": 0.7}),
    )
    return [Line2D([], [], ls="", marker="o", ms=6, label=text, **look) for text, look in looks]
