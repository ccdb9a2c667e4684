"""The grains of a bed under a rising flow, as a file that plays by itself."""

from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from orchestrator.errors import InputError
from orchestrator.report.figures import bed
from orchestrator.report.figures.bed import Flows, Steps
from orchestrator.report.results import Results
from orchestrator.types import FloatArray, IntArray

ENDING = ".gif"
WIDTH = 1200
"""Width of a frame, pixels."""
FINER = 2
"""Pixels of a frame as it is drawn over those as it is written: edges are smooth."""
MOST = 120
"""Largest number of frames."""
LASTS_MS = 8000
"""Time from the first frame to the last."""
SHORTEST_MS = 40
"""Least time of a frame: readers show shorter ones for longer."""
STAYS_MS = 1500
"""Time for which the last frame stays."""
LETTERS = 24
"""Size of the letters of a frame, pixels."""
SHADES = 64
"""Colours of a frame."""
COLOURS = {
    "sky": "#e4eff7",
    "ground": "#d3cdbf",
    "fixed": "#9a9a9a",
    "exposed": "#fff7d0",
    "under": "#e6decc",
    "moved": "#d55e00",
    "edge": "#595959",
    "ink": "#222222",
}
"""The colours of the picture on the page."""


def check(file: Path) -> None:
    """Refuse a file that would not play.

    Parameters
    ----------
    file
        The file that is asked for.

    Raises
    ------
    InputError
        If its name does not end as that of a GIF.
    """
    if file.suffix.lower() != ENDING:
        what = "an animation is written as GIF"
        raise InputError(what, str(file), f"name a file that ends with {ENDING}")


def of_study(results: Results) -> bytes:
    """Draw the first bed of a study that a page would show, under its rising flow.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    bytes
        A GIF.

    Raises
    ------
    InputError
        If the study has no bed of grains whose files are kept.
    """
    for row, pile in bed.chosen(results):
        steps = bed.read_steps(pile, results.cases)
        return _gif(steps, bed.flows_of(row, steps))
    remedy = "the command is for finished beds of grains; `study` runs them"
    where = str(results.cases.parent)
    raise InputError("there is no bed whose grains could be drawn", where, remedy)


def stops_of(count: int) -> IntArray:
    """Choose the stops that are frames.

    Parameters
    ----------
    count
        Number of stops of the slider.

    Returns
    -------
    IntArray
        At most `MOST` of them, the first and the last among these.
    """
    return np.unique(np.linspace(0, count - 1, min(MOST, count)).round().astype(int))


def _gif(steps: Steps, flows: Flows) -> bytes:
    """The frames of all stops."""
    stops = stops_of(len(steps.totals)).tolist()
    drawn = _Frames(steps)
    count = steps.pile.packing.count
    frames = []
    for stop in stops:
        said = f"{flows.said(stop)}: {steps.totals[stop]} of {count} entrained"
        frames.append(drawn.at(stop, said))
    wait = max(SHORTEST_MS, LASTS_MS // len(frames))
    waits = [*[wait] * (len(frames) - 1), STAYS_MS]
    out = BytesIO()
    first, *others = frames
    first.save(out, "GIF", save_all=True, append_images=others, duration=waits, loop=0)
    return out.getvalue()


class _Frames:
    """The pictures of the grains of a bed.

    Parameters
    ----------
    steps
        The grains at each stop.
    """

    def __init__(self, steps: Steps) -> None:
        self._steps = steps
        (left, right, bottom, top), _ = bed.window(steps.pile)
        self._corner = left, top
        self._scale = FINER * WIDTH / (right - left)
        height = round((top - bottom) * self._scale)
        self._size = FINER * WIDTH, height
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        path = str(fonts / "DejaVuSans.ttf")
        self._font = ImageFont.truetype(path, LETTERS * FINER)
        x, z = steps.pile.line.x, steps.pile.line.z
        line = np.column_stack([[left, *x, right], [z[0], *z, z[-1]]])
        self._ground = np.vstack([line, [[right, bottom], [left, bottom]]])

    def _pixels(self, places: FloatArray) -> list[tuple[float, float]]:
        """Places of the bed, d, in pixels of a picture."""
        pixels = (places - self._corner) * [self._scale, -self._scale]
        return [(x, y) for x, y in pixels.tolist()]

    def at(self, stop: int, said: str) -> Image.Image:
        """The picture at a stop, with a line of text."""
        steps = self._steps
        packing, grains = steps.pile.packing, steps.grains
        has_moved = (steps.level > 0) & (steps.level <= stop)
        kind = np.select(
            [~packing.mobile[grains], has_moved, packing.windward[grains]],
            ["fixed", "moved", "exposed"],
            "under",
        )
        # a grain that has left is drawn at its first place, as on the page
        places = steps.places[stop]
        here = np.where(np.isnan(places), packing.centres[grains], places)
        radii = packing.sizes[grains] / 2 * self._scale
        picture = Image.new("RGB", self._size, COLOURS["sky"])
        pen = ImageDraw.Draw(picture)
        pen.polygon(self._pixels(self._ground), fill=COLOURS["ground"])
        for (x, y), r, name in zip(self._pixels(here), radii, kind, strict=True):
            box = (x - r, y - r, x + r, y + r)
            pen.ellipse(box, fill=COLOURS[str(name)], outline=COLOURS["edge"])
        pen.text(
            (LETTERS, LETTERS),
            said.replace("θ_c", "θc"),
            fill=COLOURS["ink"],
            font=self._font,
        )
        width, height = self._size
        whole = width // FINER, height // FINER
        small = picture.resize(whole, Image.Resampling.LANCZOS)
        return small.quantize(SHADES, dither=Image.Dither.NONE)
