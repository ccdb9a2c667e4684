"""How all figures look: sizes, colours by meaning, markers, files."""

from collections.abc import Sequence
from io import BytesIO, StringIO
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps, rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_mixed import MixedModeRenderer
from matplotlib.backends.backend_svg import FigureCanvasSVG, RendererSVG
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullLocator

from orchestrator.report import FIGURES
from orchestrator.runs.files import Folder

WIDTH = 7.0
"""Width of a figure across two columns of a paper, inches."""

SHADES = {
    "beta_deg": ("viridis", 0.0, 0.85),
    "alpha_deg": ("plasma", 0.0, 0.82),
    "fraction": ("YlGnBu", 0.35, 1.0),
    "d_m": ("turbo", 0.05, 0.95),
}
"""Colour maps of what rises in steps; few diameters have colours that are told apart better."""
DIAMETERS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#555555", "#7b3294")
WATER = "#74aed6"
AIR = "#8c6d46"
BED = "#d9c9a3"
Look = dict[str, Any]
"""Properties of an artist."""
Sample = Artist | tuple[Artist, ...]
"""A sample of a legend: one mark, or some beside each other."""

NOTE: Look = {"fontsize": 6.5, "color": "0.35", "gid": "note"}
MINOR_TICK: Look = {"color": "black", "ms": 2, "mew": 0.6}


def palette(column: str, values: Sequence[float]) -> dict[float, str]:
    """A colour for each value of a column, the same in every figure of a study."""
    if column == "d_m" and len(values) <= len(DIAMETERS):
        return dict(zip(values, DIAMETERS, strict=False))
    name, first, last = SHADES[column]
    steps = max(len(values) - 1, 1)
    shades = (first + (last - first) * i / steps for i in range(len(values)))
    return {v: to_hex(colormaps[name](x)) for v, x in zip(values, shades, strict=True)}


def canvas(height: float) -> Canvas:
    """An empty figure of full width; height in inches."""
    return Canvas(figsize=(WIDTH, height), layout="compressed")


def grid(count: int, height: float) -> tuple[Canvas, list[Axes]]:
    """A figure of some panels of a height (inches), in two columns where there are several."""
    columns = min(count, 2)
    lines = -(-count // columns)
    figure = canvas(height * lines + 0.9)
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for unused in axes[count:]:
        unused.remove()
    for spine in (one for ax in axes[:count] for one in ax.spines.values()):
        spine.set_in_layout(False)  # they lie on the panel's edge, which counts anyway
    return figure, list(axes[:count])


def legends(figure: Canvas, colours: Sequence[Artist], looks: Sequence[Sample]) -> None:
    """Place the legend of colours above the panels, all else below them: no data are there."""
    if colours:
        figure.legend(handles=colours, loc="outside upper center", ncols=6)
    if looks:
        handles: list[Any] = list(looks)  # its stubs know no samples of two marks
        names = [str((one[0] if isinstance(one, tuple) else one).get_label()) for one in looks]
        beside = {tuple: HandlerTuple(ndivide=None)}
        figure.legend(handles, names, loc="outside lower center", ncols=3, handler_map=beside)


def entry(label: str, colour: str) -> Line2D:
    """A legend's sample of a colour."""
    return Line2D([], [], color=colour, lw=2.5, label=label)


def note(ax: Axes, x: float, text: str) -> None:
    """A small text at the upper end of a place on the x axis."""
    ax.text(x, 0.97, text, ha="center", va="top", transform=ax.get_xaxis_transform(), **NOTE)


def upright_note(ax: Axes, x: float, text: str, at: Literal["top", "bottom"]) -> None:
    """A small text along the left side of a vertical line."""
    y = 0.97 if at == "top" else 0.03
    place = ax.get_xaxis_transform()
    ax.text(x, y, text, ha="right", va=at, rotation=90, transform=place, **NOTE)


def plain_ticks(axis: Axis) -> None:
    """Numbers such as 0.01 or 20 on a logarithmic axis whose limits are set."""
    low, high = axis.get_view_interval()
    digits = "2345678" if high < 5 * low else "25" if high < 50 * low else ""
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    if digits:
        axis.set_minor_formatter(FuncFormatter(lambda x, _: _leading(x, digits)))
    else:
        _light_ticks(axis, low, high)


def _light_ticks(axis: Axis, low: float, high: float) -> None:
    """Minor ticks without numbers as one artist: matplotlib’s own are five for each tick."""
    axis.set_minor_locator(NullLocator())
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
    places = np.outer(decades, np.arange(2, 10)).ravel()
    places = places[(places >= low) & (places <= high)]
    edge, ax = np.zeros_like(places), axis.axes
    if axis is ax.xaxis:
        ticks = Line2D(places, edge, marker=3, transform=ax.get_xaxis_transform())
    else:
        ticks = Line2D(edge, places, marker=0, transform=ax.get_yaxis_transform())
    ticks.set(ls="", clip_on=False, in_layout=False, gid="minor ticks", **MINOR_TICK)
    ax.add_artist(ticks)


def _leading(x: float, digits: str) -> str:
    """The number where its first digit is one of some."""
    text = f"{x:.6g}"
    return text if text.strip("0.")[0] in digits else ""


class _Sheet(FigureCanvasSVG):
    """SVG by one renderer: matplotlib's own way takes a second one, which reads each text anew."""

    def __init__(self, figure: Canvas, out: StringIO) -> None:
        super().__init__(figure)
        figure.dpi = self.fixed_dpi
        width, height = figure.get_size_inches()
        pixels = rcParams["savefig.dpi"]
        drawn = (width * self.fixed_dpi, height * self.fixed_dpi, out)
        # matplotlib has no types for its renderers
        vectors: Any = RendererSVG(  # type: ignore[no-untyped-call]
            *drawn, image_dpi=pixels, metadata={"Date": None}
        )
        self.renderer: Any = MixedModeRenderer(  # type: ignore[no-untyped-call]
            figure, width, height, pixels, vectors
        )

    def get_renderer(self) -> Any:
        """The one that the layout measures with."""
        return self.renderer


def svg(figure: Canvas) -> bytes:
    """A figure as SVG, without a date in it."""
    out = StringIO()
    sheet = _Sheet(figure, out)
    figure.draw(sheet.renderer)  # lays out, then draws
    sheet.renderer.finalize()
    return out.getvalue().encode()


def save(figure: Canvas, folder: Folder, name: str) -> bytes:
    """Put a figure as PNG and SVG, without dates in them, and return the PNG."""
    png = BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    figure.set_layout_engine("none")  # it is laid out now
    folder.put(f"{FIGURES}/{name}.png", png.getvalue())
    folder.put(f"{FIGURES}/{name}.svg", svg(figure))
    return png.getvalue()
