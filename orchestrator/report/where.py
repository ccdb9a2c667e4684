"""Where grains of a bed go, and at which flow: a map under the picture of the bed and its flow."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import SubFigure
from matplotlib.ticker import LogLocator

from orchestrator.grains.pile import Pile
from orchestrator.report import captions, style
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import flow
from orchestrator.report.results import Results
from orchestrator.report.stress import REVERSED, title
from orchestrator.runs.case import is_whole
from orchestrator.study.parts import PileBed

MOST = 4
"""Beds of the figure."""
BESIDE = 4.0
"""Bed shown before and behind the forms, h."""
ABOVE = 2.5
"""Flow shown above the bed, h."""
HEIGHT, BAR = 3.2, 0.6
"""Heights of a bed's three panels and of the colours below all, inches."""
COLOURS = "plasma"
UNMOVED = "0.75"


def draw(results: Results) -> Iterator[Figure]:
    """One figure, of beds that are more than one triangle; each shape by its first scene."""
    piles = chosen(results)
    if not piles:
        return
    heights = [*[HEIGHT] * len(piles), BAR]
    canvas = style.canvas(sum(heights))
    *parts, last = canvas.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, (scene_id, pile) in zip(parts, piles.items(), strict=True):
        _bed(part, results, scene_id, pile)
    bar = canvas.colorbar(ScalarMappable(cmap=COLOURS), last.subplots(), orientation="horizontal")
    bar.set_label("$n/N$ by then")
    names = tuple(name.name for pile in piles.values() for name in pile.runs)
    yield Figure("where", "Where grains go", captions.where(), tuple(dict.fromkeys(names)), canvas)


def chosen(results: Results) -> dict[str, Pile]:
    """Piles by their scenes, one for each bed line that is not level."""
    grains = results.joined("pile_grain")
    done = set() if grains.empty else set(grains["scene_id"])
    found: dict[object, tuple[str, Pile]] = {}
    for scene_id, pile in results.plan.piles.items():
        if scene_id in done and not pile.bed.is_triangle and np.ptp(pile.model.line.z) > 0:
            found.setdefault(pile.model.line, (scene_id, pile))
    return dict(list(found.values())[:MOST])


def _bed(part: SubFigure, results: Results, scene_id: str, pile: Pile) -> None:
    stress, bed, map_ = part.subplots(3, 1, sharex=True, height_ratios=[1.1, 1, 1.5])
    h, line = pile.bed.height, pile.model.line
    window = line.x[1] / h - BESIDE, line.x[-2] / h + BESIDE
    along = pile.stress(results.cases)
    x, ustar = along.x_m / h, along.ustar_over_ustar0_wall
    stress.plot(x, ustar, color="black", lw=1.0, gid="stress")
    stress.fill_between(x, ustar, 0, where=(ustar < 0).tolist(), **REVERSED)
    stress.axhline(0, color="0.4", lw=0.6)
    stress.set(ylabel=r"$u^\star/u^\star_0$", xlim=window)
    stress.set_title(f"{shape(pile.bed)}, {title(results, pile)}", loc="left")
    _flow(bed, results, pile, window)
    _map(map_, results, scene_id, h)


def shape(bed: PileBed) -> str:
    """A bed line in a few words."""
    words = [str(bed.profile or bed.form.label or bed.shape), *map(str, bed.obstacles)]
    if bed.forms > 1:
        every = f" every {bed.spacing:g} m" if bed.spacing else ""
        words[0] = f"{bed.forms} × {words[0]}{every}"
    return ", ".join(words)


def _flow(ax: Axes, results: Results, pile: Pile, window: tuple[float, float]) -> None:
    """The bed to scale in x, with the speed of the flow over it if the run has its files."""
    h, line = pile.bed.height, pile.model.line
    x, z = np.array(line.x) / h, np.array(line.z) / h
    bottom, top = z.min() - 0.2, z.max() + ABOVE
    if pile.model.cases and is_whole(pile.flow, results.cases):
        extent = (*window, float(z.min()), top)
        speed = np.linalg.norm(flow.sampled(pile, results.cases, extent, h), axis=-1)
        ax.imshow(speed, origin="lower", extent=extent, vmin=0, vmax=1.1, aspect="auto")
    ax.fill_between(x, z, bottom, color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")
    ax.set(ylim=(bottom, top), ylabel="$z/h$")


def _map(ax: Axes, results: Results, scene_id: str, h: float) -> None:
    """The flow at which each grain goes, against its place; the first one marked."""
    table = results.tables["pile_grain"]
    rows = table[table["scene_id"] == scene_id]
    x, flow_ = rows["x_m"].to_numpy(float) / h, rows["ustar0_m_s"].to_numpy(float)
    goes = np.isfinite(flow_)
    rank = np.argsort(np.argsort(flow_[goes], kind="stable"), kind="stable")
    share = (rank + 1) / len(rows)
    dots = ax.scatter(x[goes], flow_[goes], c=share, s=5, cmap=COLOURS, vmin=0, vmax=1)
    dots.set_gid("thresholds")
    for at in x[~goes]:
        ax.axvline(at, color=UNMOVED, lw=0.3, zorder=0)
    if goes.any():
        first = int(np.argmin(np.where(goes, flow_, np.inf)))
        ax.plot(x[first], flow_[first], "v", ms=7, mfc="none", mec="#d55e00", gid="first")
        ax.annotate("first", (x[first], flow_[first]), (0, 9), textcoords="offset points")
    ax.margins(y=0.15)
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter("")
    ax.set(xlabel="$x/h$ from the first foot", ylabel=r"goes at $u^\star_0$, m/s")
