"""The solved flow over piles: speed and streamlines."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.image import AxesImage
from numpy.lib.stride_tricks import sliding_window_view

from orchestrator.grains.pile import Pile
from orchestrator.report import labels, solved, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results
from orchestrator.report.style import Figure, Look
from orchestrator.runs.case import Case
from orchestrator.types import FloatArray

SMOOTH = np.hanning(31) / np.hanning(31).sum()
"""Weights of the neighbours of a point that smooth a streamline."""
BACK = np.array([0.9, 0.6, 0.3])
"""Streamlines in reversed flow, over the least value of the stream function."""
CAPTION = """\
Steady turbulent flow by OpenFOAM ({{ models }}, rough wall), at the last iteration, for
U_e = {{ speeds }} at 10 h. The fields of other speeds are taken to be similar. White:
streamlines at arbitrary spacing; closed ones surround the reversed flow. Only the
part near the pile is shown. {% if lid %}The lid is far above. {% endif %}To scale."""


def draw(results: Results) -> Iterator[Figure]:
    """Speed and streamlines: a panel for each slope and height, at its least z0.

    Yields
    ------
    Figure
        One figure, or none.
    """
    for name, title, shown in style.pages(solved.piles_with_files(results)):
        settings = [pile.scene.method.flow for pile in shown]
        models = [
            labels.value("turbulence_model", each.turbulence_model) for each in settings
        ]
        speeds = [labels.value("solve_u_e_m_s", each.speed) for each in settings]
        text = filled(
            CAPTION,
            models=", ".join(dict.fromkeys(models)),
            speeds=", ".join(dict.fromkeys(speeds)),
            lid=not any(pile.scene.flow.depth for pile in shown),
        )
        cases = tuple(pile.flow.name for pile in shown)
        figure = _speeds(results, shown)
        title = f"Flow over the pile{title}"
        place: style.Place = "folded" if name else ""
        yield Figure(f"flow{name}", title, text, cases, figure, place=place)


def _speeds(results: Results, shown: Sequence[Pile]) -> Canvas:
    """A panel for each pile: the speed over U_e in colours, streamlines, the bed."""
    toe = max(pile.model.line.x[-2] / pile.bed.height for pile in shown)
    window = (-2.0, toe + 8.0, 0.0, 3.0)
    left, right, bottom, top = window
    sides = style.inches(sum(style.SIDES))
    height = 1.6 * (style.NARROW - sides) * (top - bottom) / (right - left)
    titles = [solved.title(results, pile) for pile in shown]
    figure, axes = style.grid(titles, height, "x/h", "z/h", 1)
    for ax, pile in zip(axes, shown, strict=True):
        velocity = solved.over_u_e(pile, results.cases, window, pile.bed.height)
        speed = np.linalg.norm(velocity, axis=-1)
        image = ax.imshow(
            speed, origin="lower", extent=window, vmin=0, vmax=1.1, interpolation="none"
        )
        _streamlines(ax, window, velocity)
        solved.draw_bed(ax, pile)
        ax.set(aspect="auto", xlim=(left, right), ylim=(bottom, top), yticks=range(4))
    _speed_bar(figure, image)
    return figure


def _speed_bar(figure: Canvas, image: AxesImage) -> None:
    """The bar of the colours of speeds, below the panels."""
    style.extend(figure, 0.0, style.inches(5.0))
    letter = style.inches(1.0) / figure.get_figheight()
    place = figure.add_axes((0.1, 3.6 * letter, 0.86, 0.9 * letter))
    bar = figure.colorbar(image, cax=place, orientation="horizontal")
    bar.set_label("|u|/Uₑ, of the approaching flow at 10 h")


def _streamlines(ax: Axes, window: solved.Window, velocity: FloatArray) -> None:
    """Contours of the stream function.

    It is integrated from above, from the bed where the flow runs back.
    """
    rows, columns, _ = velocity.shape
    left, right, bottom, top = window
    x = np.linspace(left, right, columns)
    z = np.linspace(bottom, top, rows)
    from_above, above_bed = _stream_functions(x, z, velocity)
    forward = np.linspace(0, above_bed[-1, 0], 12)[1:]
    back = np.nanmin(above_bed) * BACK
    look: Look = {"colors": "white", "linewidths": 0.45, "linestyles": "solid"}
    for psi, levels in ((from_above, forward), (above_bed, back[back < 0])):
        inside = np.where(np.isnan(velocity[..., 0]), np.nan, _smooth(psi))
        ax.contour(x, z, inside, levels, **look)


def _stream_functions(
    x: FloatArray, z: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The stream function integrated from above, and that from the bed."""
    w_at_top = velocity[-1, :, 2]
    above_bed = np.cumsum(np.nan_to_num(velocity[..., 0]), axis=0) * (z[1] - z[0])
    through_top = above_bed[-1, 0] - np.cumsum(w_at_top) * (x[1] - x[0])
    return through_top - (above_bed[-1] - above_bed), above_bed


def _smooth(psi: FloatArray) -> FloatArray:
    """A stream function without the steps in which the grid meets the bed.

    The integral from there carries them upwards.
    """
    half = SMOOTH.size // 2
    wide = np.pad(psi, ((0, 0), (half, half)), "symmetric")
    return np.asarray(sliding_window_view(wide, SMOOTH.size, axis=1) @ SMOOTH)


def files(results: Results) -> Sequence[Case]:
    """List the flows that are drawn.

    Returns
    -------
    list of Case
        The cases.
    """
    return [pile.flow for pile in solved.piles_with_files(results)]


FIGURE = FigureKind(order=170, draws=draw, files=files)
