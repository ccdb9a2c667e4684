"""The flow over a pile: speed, streamlines, the region that runs back."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.image import AxesImage
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from orchestrator.grains.pile import Pile
from orchestrator.report import captions, stress, style
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import flow_field
from orchestrator.report.pictures.flow_field import Window
from orchestrator.report.results import Results
from orchestrator.runs.case import is_whole

FloatArray = NDArray[np.float64]

BEFORE, BEHIND, ABOVE = 2.0, 8.0, 3.0
"""Flow shown before the windward toe, behind the lee toe, and above the flat bed, h."""
MOST = 6
"""Panels of a figure."""
COLUMNS = 1000
SPEED = r"speed over that of the approaching flow at 10 h, $|\mathbf{u}|/U_e$"
SMOOTHED = 6.0
"""Standard deviation of the smoothing of streamlines along x, columns."""


def draw(results: Results) -> Iterator[Figure]:
    """A panel for each slope and height, at its least z0; six in a figure."""
    piles = chosen(results)
    for number, start in enumerate(range(0, len(piles), MOST)):
        some = piles[start : start + MOST]
        yield Figure(
            "flow" + (f"-{number + 1}" if number else ""),
            "Flow over the pile" + (f", more panels ({number})" if number else ""),
            captions.flow(some),
            tuple(pile.flow.name for pile in some),
            _frame(results, some),
            fold=number > 0,
        )


def chosen(results: Results) -> list[Pile]:
    """A pile for each panel; a flow whose files were pruned has none."""
    found: dict[stress.Kind, Pile] = {}
    for pile in stress.choose(results):
        if is_whole(pile.flow, results.cases):
            found.setdefault(stress.kind(results, pile), pile)
    return list(found.values())


def _window(piles: list[Pile]) -> Window:
    """Left, right, bottom, top, h; the same for all panels."""
    toe = max(pile.model.line.x[-2] / pile.bed.height for pile in piles)
    return -BEFORE, toe + BEHIND, 0.0, ABOVE


def sampled(pile: Pile, cases: Path, window: Window, unit: float) -> FloatArray:
    """The velocity over a pile in a window, over U_e; the window is in units of `unit`, m."""
    left, right, bottom, top = window
    rows = round(COLUMNS * (top - bottom) / (right - left))
    metres = left * unit, right * unit, bottom * unit, top * unit
    found = flow_field.velocity(cases / pile.flow.name, metres, (rows, COLUMNS))
    return found / pile.scene.flow.speed


def _frame(results: Results, piles: list[Pile]) -> Canvas:
    window = left, right, bottom, top = _window(piles)
    # as high as to scale, with a title over each panel
    panel = 0.4 + 0.9 * style.WIDTH * (top - bottom) / (right - left)
    figure = style.canvas(panel * len(piles) + 0.9)
    axes = list(figure.subplots(len(piles), 1, sharex=True, squeeze=False)[:, 0])
    for ax, pile in zip(axes, piles, strict=True):
        velocity = sampled(pile, results.cases, window, pile.bed.height)
        image = _panel(ax, pile, window, velocity)
        ax.set_title(stress.title(results, pile), loc="left")
    axes[-1].set_xlabel("$x/h$ from the windward toe")
    bar = figure.colorbar(image, ax=axes, location="bottom", aspect=60, pad=0.02)
    bar.set_label(SPEED)
    return figure


def _panel(ax: Axes, pile: Pile, window: Window, velocity: FloatArray) -> AxesImage:
    speed = np.linalg.norm(velocity, axis=-1)
    image = ax.imshow(speed, origin="lower", extent=window, cmap="viridis", vmin=0, vmax=1.1)
    _streamlines(ax, window, velocity)
    draw_bed(ax, pile)
    ax.set(ylabel="$z/h$", aspect="equal", xlim=window[:2], ylim=window[2:], yticks=[0, 1, 2, 3])
    return image


def draw_bed(ax: Axes, pile: Pile) -> None:
    """The bed under the flow, in h."""
    x, z = pile.model.line.corners.T / pile.bed.height
    ax.fill_between(x, z, z.min() - 1, color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")


def _streamlines(ax: Axes, window: Window, velocity: FloatArray) -> None:
    """Contours of the stream function.

    Outside the region that runs back it is integrated from above, inside it from the bed: each
    where the flow is smooth and the function small.
    """
    rows, columns, _ = velocity.shape
    x, z = np.linspace(*window[:2], columns), np.linspace(*window[2:], rows)
    u, w = velocity[..., 0], velocity[-1, :, 2]
    above_bed = _integral(np.nan_to_num(u), z[1] - z[0])
    through_top = above_bed[-1, 0] - _integral(w, x[1] - x[0])
    from_above = through_top - (above_bed[-1] - above_bed)
    forward = np.linspace(0, above_bed[-1, 0], 12)[1:]
    back = np.nanmin(above_bed) * np.array([0.9, 0.6, 0.3])
    for psi, levels in ((from_above, forward), (above_bed, back[back < 0])):
        # the grid meets the bed in steps, which the integral from there carries upwards
        inside = np.where(np.isnan(u), np.nan, gaussian_filter1d(psi, SMOOTHED, axis=1))
        ax.contour(x, z, inside, levels, colors="white", linewidths=0.45, linestyles="solid")


def _integral(values: FloatArray, step: float) -> FloatArray:
    """Cumulative, by the trapezoidal rule, along the first axis."""
    pieces = (values[1:] + values[:-1]) * step / 2
    return np.concatenate([0 * values[:1], np.cumsum(pieces, axis=0)])
