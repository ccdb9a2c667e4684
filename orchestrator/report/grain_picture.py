"""The grains of a pile when a fraction of them has moved: how far, and how under which flow."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure as Canvas
from matplotlib.image import imread
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from orchestrator.grains.motion import MODES
from orchestrator.grains.pile import PileCase
from orchestrator.report import captions, flow_picture, labels, snapshot, style
from orchestrator.report.figure import Figure
from orchestrator.report.picture import Picture
from orchestrator.report.results import Results, split, valid
from orchestrator.report.snapshot import Snapshot

FRACTION = 0.3
"""n/N of the instant that is shown, or the nearest that the study reports."""
PIXELS = 2000
LYING, FIXED, INSIDE = "#e6decc", "#8c8c8c", "#c4c4c4"
WAITING = "#fffbe6"
GONE = "#b03030"
HOW = {"rolled": ("#d55e00", "o"), "slid": ("#009e73", "_"), "lifted": ("#7b3294", "^")}
"""Colour and symbol of the grains by how they moved: either tells."""
TICKS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30)
SCALE = ScalarMappable(LogNorm(TICKS[0], TICKS[-1]), colormaps["YlOrRd"])
# pale, so that grains of any colour stand out on it
PALE = LinearSegmentedColormap.from_list("pale", colormaps["Blues"](np.linspace(0, 0.6, 64)))
SPEED = ScalarMappable(Normalize(0, 1), PALE)
LONG = 40.0
"""Half length of a pile, d, beyond which the crest gets a panel of its own."""
Window = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shown:
    """What a figure shows: a pile at an instant, in some windows, with files by their stems."""

    pile: PileCase
    found: Snapshot
    windows: list[Window]
    folder: Path

    def file(self, stem: str) -> Path:
        """Where a job leaves what this figure needs."""
        return self.folder / f"{self.pile.name}-{stem}"


def plan(results: Results, folder: Path) -> Iterator[Picture]:
    """One figure for each slope: of its largest grains, whose closure holds if any does."""
    for pile in chosen(results):
        fraction = min(pile.scene.protocol.fractions, key=lambda f: abs(f - FRACTION))
        passage = snapshot.read(pile, results.cases)
        look = passage.first(fraction)
        if look is not None:
            shown = Shown(pile, passage.at(look), windows(pile), folder)
            yield _picture(shown, results.cases, fraction)


def chosen(results: Results) -> Iterator[PileCase]:
    """The pile that stands for all of its slope, by rising slope."""
    for _, rows in split(results.joined("pile_threshold"), "alpha_deg"):
        order = rows.assign(valid=valid(rows)).sort_values(
            ["valid", "d_m", "z0_over_d", "scene_id"], ascending=[False, False, True, True]
        )
        yield results.plan.piles[str(order["scene_id"].iloc[0])]


def windows(pile: PileCase) -> list[Window]:
    """The whole pile and, if that is long, its crest."""
    x, z = (float(edge) for edge in pile.triangle.crest)
    whole = -6.0, 2 * x + 6, -2.5, z + 6
    return [whole, (x - 28, x + 14, z - 9, z + 5)] if x > LONG else [whole]


def shape(window: Window) -> float:
    """Height of a window over its width."""
    left, right, bottom, top = window
    return (top - bottom) / (right - left)


def _picture(shown: Shown, cases: Path, fraction: float) -> Picture:
    pile, found = shown.pile, shown.found
    spheres = [
        _spheres(shown, f"far-{number}", window, _by_distance(found))
        for number, window in enumerate(shown.windows)
    ]
    spheres.append(_spheres(shown, "how", shown.windows[-1], _by_mode(found)))
    d = pile.scene.grain.diameter
    flow = flow_picture.sampling(cases, pile, shown.windows[-1], d, shown.file("flow.npy"))
    alpha = labels.plain("alpha_deg", pile.bed.slope_deg)
    figure = Figure(
        f"grains-alpha{pile.bed.slope_deg:g}",
        f"Grains when {fraction:.0%} have moved, {alpha}, d = {labels.millimetres(d)}",
        captions.grains(pile, found, fraction),
        (pile.name, pile.flow.name),
        None,
    )
    return Picture(figure, (*spheres, flow), lambda: _frame(shown))


def _spheres(
    shown: Shown, stem: str, window: Window, colours: NDArray[np.float64]
) -> dict[str, object]:
    grains, present = shown.file(f"{stem}.npz"), ~shown.found.gone
    shades = np.asarray(np.rint(255 * colours[present]), np.uint8)
    np.savez(grains, centres=shown.found.place[present], colours=shades)
    return {
        "kind": "grains",
        "grains": str(grains),
        "window": window,
        "pixels": [PIXELS, round(PIXELS * shape(window))],
        "out": str(shown.file(f"{stem}.png")),
    }


def _by_distance(found: Snapshot) -> NDArray[np.float64]:
    shades = SCALE.to_rgba(np.maximum(found.displacement, 1e-9))[:, :3]
    shades[found.displacement < TICKS[0]] = to_rgb(LYING)
    shades[~found.mobile] = to_rgb(FIXED)
    return np.asarray(shades)


def _by_mode(found: Snapshot) -> NDArray[np.float64]:
    return np.array([to_rgb(colour) for colour in mode_colours(found)])


def mode_colours(found: Snapshot) -> list[str]:
    """A colour for each grain by how it has moved, or why not."""
    names = np.select(
        [found.mode > 0, found.exposed, found.mobile],
        [np.array(MODES)[found.mode], "waiting", "lying"],
        "fixed",
    )
    colours = {"waiting": WAITING, "lying": LYING, "fixed": FIXED}
    colours |= {name: colour for name, (colour, _) in HOW.items()}
    return [colours[str(name)] for name in names]


def _frame(shown: Shown) -> Canvas:
    shapes = [shape(window) for window in (*shown.windows, shown.windows[-1])]
    figure = style.canvas(6.4 * sum(shapes) + 2.6)
    axes = list(figure.subplots(len(shapes), 1, height_ratios=shapes, squeeze=False)[:, 0])
    for number, (ax, window) in enumerate(zip(axes, shown.windows, strict=False)):
        _panel(ax, shown, window, f"far-{number}")
        empty(ax, shown.found.start[shown.found.gone], GONE)
    for left, right, bottom, top in shown.windows[1:]:
        box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="0.2", lw=0.7)
        axes[0].add_patch(box)
    _how(axes[-1], shown)
    axes[-1].set_xlabel("$x/d$ from the windward toe")
    _bars(figure, axes)
    style.legends(figure, _entries(), [])
    legend = mode_legend(figure, "outside lower center")
    legend.set_gid("modes")
    return figure


def _bars(figure: Canvas, axes: list[Axes]) -> None:
    bar = figure.colorbar(SCALE, ax=axes[:-1], location="bottom", aspect=60, pad=0.02, extend="max")
    bar.set_label("distance from its place in the packing, $d$")
    bar.set_ticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    bar = figure.colorbar(SPEED, ax=axes[-1], location="bottom", aspect=60, pad=0.02)
    bar.set_label(r"speed of the flow over that at the lid, $|\mathbf{u}|/U_e$")


def _how(ax: Axes, shown: Shown) -> None:
    window, found = shown.windows[-1], shown.found
    velocity = np.load(shown.file("flow.npy"))
    speed = np.linalg.norm(velocity, axis=-1) / shown.pile.scene.flow.speed
    ax.imshow(speed, origin="lower", extent=window, cmap=PALE, norm=SPEED.norm, zorder=0)
    _panel(ax, shown, window, "how")
    empty(ax, found.start[found.gone], [c for c, g in zip(mode_colours(found), found.gone) if g])
    size = 260 / (window[1] - window[0])
    where = np.where(found.gone[:, None], found.start, found.place)
    for name, (colour, marker) in HOW.items():
        for gone, ink in ((False, "white"), (True, colour)):
            own = where[(found.mode == MODES.index(name)) & (found.gone == gone)]
            look = {"color": ink, "marker": marker, "ms": 0.45 * size, "mew": 0.12 * size}
            ax.plot(*own.T, ls="", zorder=3, gid=f"{name}, {'gone' if gone else 'here'}", **look)


def _panel(ax: Axes, shown: Shown, window: Window, stem: str) -> None:
    ground(ax, shown.pile, window)
    ax.imshow(imread(shown.file(f"{stem}.png")), extent=window, zorder=2)
    ax.set(xlim=window[:2], ylim=window[2:], ylabel="$z/d$", aspect="equal")


def ground(ax: Axes, pile: PileCase, window: Window) -> None:
    """Fill what lies under the bed line."""
    x, z = pile.triangle.crest
    line = [window[0], 0, x, 2 * x, window[1]]
    ax.fill_between(sorted(line), np.interp(sorted(line), [0, x, 2 * x], [0, z, 0]), window[2],
                    color=INSIDE, lw=0, zorder=0.5, gid="inside")


def empty(ax: Axes, places: NDArray[np.float64], edges: str | list[str]) -> EllipseCollection:
    """Hollow grains."""
    return discs(ax, places, fc="white", ec=edges, lw=0.6, zorder=1, gid="gone")


def discs(ax: Axes, places: NDArray[np.float64], **look: object) -> EllipseCollection:
    """Grains as circles, one d wide."""
    offsets = {"offsets": places, "offset_transform": ax.transData}
    # one size would do, if the collection drew more grains than it has sizes
    size = np.ones(max(len(places), 1))
    drawn = EllipseCollection(size, size, 0 * size, units="xy", **offsets, **look)
    ax.add_collection(drawn)
    return drawn
