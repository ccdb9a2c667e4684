"""A short animation: the crest of a pile empties as the flow rises."""

from collections.abc import Iterator
from io import BytesIO
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray
from PIL import Image

from orchestrator.report import captions, labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import grains, marks, snapshot
from orchestrator.report.pictures.marks import Window
from orchestrator.report.pictures.snapshot import Passage, Snapshot
from orchestrator.report.results import Results

NAME = "crest"
STIR, NEAR = 0.05, 2.0
"""A look is shown when a grain moved by more than STIR since the one before, and is no further
than NEAR from its place, d: one that rolls on along the bed is no news."""
AFTER = 10
"""Looks that are left for the last grain to leave the crest."""
MOST = 160
"""Frames: a page must not become heavy."""
FRAME_MS, LAST_MS = 50, 2500
PIXELS_PER_INCH = 140


def draw(results: Results) -> Iterator[Figure]:
    """The animation; none of a study without piles.

    It is of the pile of the picture of the grains, at the least slope.
    """
    for pile in list(grains.chosen(results))[:1]:
        passage = snapshot.read(pile, results.cases)
        window = marks.windows(pile)[-1]
        samples = choose(passage, window)
        if len(samples):
            data = _gif(passage, window, samples)
            d = labels.millimetres(pile.scene.grain.diameter)
            alpha = labels.plain("alpha_deg", pile.bed.slope_deg)
            title = f"The crest empties, {alpha}, d = {d} (animation)"
            caption = captions.crest(results, pile, len(samples))
            yield Figure(NAME, title, caption, (pile.case.name,), None, data)


def choose(passage: Passage, window: Window) -> NDArray[np.int64]:
    """The samples that are shown, rising; none where no grain of the window moved."""
    here = passage.exposed[0, :, 0] >= window[0]
    places = passage.exposed[:, here]
    stirred = np.linalg.norm(np.diff(places, axis=0), axis=-1) > STIR
    near = np.linalg.norm(places[1:] - places[0], axis=-1) < NEAR
    shown = (stirred & near).any(axis=1)
    empty = passage.passed[:, here].all(axis=1)
    last = min(int(empty.argmax()) + AFTER, len(shown) - 1) if empty.any() else len(shown) - 1
    shown[last + 1 :] = False
    samples = np.flatnonzero(shown)
    if not len(samples):
        return samples
    samples = np.unique([0, *samples, last])
    thinned = np.linspace(0, len(samples) - 1, min(MOST, len(samples))).round().astype(np.int64)
    return np.asarray(samples[thinned])


def _gif(passage: Passage, window: Window, samples: NDArray[np.int64]) -> bytes:
    scene = Scene(passage, window)
    palette = _palette()
    frames = [
        Image.fromarray(scene.frame(int(sample))).quantize(
            palette=palette, dither=Image.Dither.NONE
        )
        for sample in samples
    ]
    times = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    out = BytesIO()
    frames[0].save(
        out, "GIF", save_all=True, append_images=frames[1:], duration=times, loop=0, optimize=False
    )
    return out.getvalue()


def _agg(figure: Canvas) -> Any:
    """A canvas of pixels; its methods have no types."""
    return FigureCanvasAgg(figure)


def _palette() -> Image.Image:
    """The colours in use and those between any two of them, where edges are smooth."""
    inks = [to_rgb(colour) for colour in marks.INKS]
    between = [
        np.average(pair, axis=0, weights=(part, 3 - part))
        for pair in combinations(inks, 2)
        for part in (1, 2)
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.rint(255 * np.array([*inks, *between])).astype(np.uint8).tobytes())
    return palette


class Scene:
    """Draws the crest at one sample after the other: what stands still, once."""

    def __init__(self, passage: Passage, window: Window) -> None:
        self._passage = passage
        figure = style.canvas(6.4 * marks.shape(window) + 0.9)
        figure.set_dpi(PIXELS_PER_INCH)
        self._agg = _agg(figure)
        self._ax = ax = figure.subplots()
        ax.set_xlabel("$x/d$ from the windward toe")
        marks.ground(ax, passage.pile, window)
        fixed = passage.pile.packing.centres[~passage.pile.packing.mobile]
        marks.discs(ax, fixed, fc=marks.FIXED, ec=marks.EDGE, lw=0.4)
        marks.mode_legend(figure, passage.pile)
        nothing = np.empty((0, 2))
        self._gone = marks.discs(ax, nothing, fc="white", lw=0.6, zorder=1.5)
        self._here = marks.discs(ax, nothing, lw=0.4, ec=marks.EDGE, zorder=2)
        self._symbols = marks.symbols(ax, window)
        self._text = ax.text(0.01, 0.95, "", va="top", fontsize=9, transform=ax.transAxes)
        self._agg.draw()
        figure.set_layout_engine("none")  # it is laid out now
        self._still = self._agg.copy_from_bbox(figure.bbox)

    def frame(self, sample: int) -> NDArray[np.uint8]:
        """The picture at a sample, (rows, columns, 3)."""
        found = self._passage.at(sample)
        here, colours = found.mobile & ~found.gone, marks.by_mode(found)
        self._gone.set(offsets=found.start[found.gone], edgecolor=marks.edges(found))
        self._here.set(offsets=found.place[here], facecolor=list(colours[here]))
        marks.place(self._symbols, found)
        self._text.set_text(self._said(found))
        self._agg.restore_region(self._still)
        for artist in self._moving():
            self._ax.draw_artist(artist)
        return np.array(self._agg.buffer_rgba())[..., :3]

    def _moving(self) -> list[Artist]:
        """From the lowest to the uppermost."""
        marked = [mark for pair in self._symbols.values() for mark in pair]
        return sorted([self._gone, self._here, *marked, self._text], key=Artist.get_zorder)

    def _said(self, found: Snapshot) -> str:
        count = len(self._passage.mode)
        return (
            f"load step {found.load_step}: $u^\\star_0$ = {found.ustar0:.3f} m/s,  "
            f"$n/N$ = {found.moved}/{count} = {found.moved / count:.0%}"
        )
