"""The picture of a bed with its grains and the flow, and the grains at each stop of a slider."""

import base64
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from PIL import Image

from orchestrator.bed.deck import read_dump
from orchestrator.bed.line import BedLine
from orchestrator.grains import motion
from orchestrator.grains import pile as piles
from orchestrator.grains.pile import Pile
from orchestrator.report import flows, labels
from orchestrator.report.page import caption, fill
from orchestrator.report.results import FRACTION, Results, split
from orchestrator.report.style import Figure
from orchestrator.study import fields
from orchestrator.types import BoolArray, FloatArray, IntArray

LONG = 100.0  # length of a face, d, beyond which its upper end is shown alone: grains must be seen
WHOLE = 4.0  # length of a whole bed over `LONG` up to which all forms are shown
STOPS = 300  # largest number of stops of the slider of a bed without dynamics
SHIFT = 0.02  # grains that have moved by less since they were last drawn stay, d


@dataclass(frozen=True)
class Steps:
    """The n drawn grains of a pile at K + 1 stops of the slider, lengths in d.

    `grains` (n,) are their numbers in the packing; `places` (K + 1, n, 2) are x and z, first as
    packed, NaN of a grain that has left the box; `level` (n,) is the stop by which a grain has
    moved, 0 if it never does or is not counted. `flow` (K + 1,) is the undisturbed friction
    velocity, m/s, `totals` (K + 1,) how many counted grains, drawn or not, have moved. `lines` are
    the bed lines, each with the first stop under its flow; one, on a frozen bed.
    """

    pile: Pile
    grains: IntArray
    places: FloatArray
    level: IntArray
    flow: FloatArray
    totals: IntArray
    lines: tuple[tuple[int, BedLine], ...]

    def first(self, fraction: float) -> int:
        """The first stop at which a fraction of the counted grains has moved, or the last."""
        enough = self.totals >= fraction * self.pile.packing.count - 1e-9
        return int(np.argmax(enough)) if enough.any() else len(self.totals) - 1


def read(pile: Pile, cases: Path) -> Steps:
    """Read where the grains of a finished pile are: without DEM, where they were packed.

    Only grains within the picture are read, at `STOPS` of the load steps if there are more: all
    grains of a long bed at all load steps would need many gigabytes.
    """
    packing, moved = pile.packing, pile.motion(cases)
    ((left, right, bottom, _), _), (x, z) = window(pile), packing.centres.T
    inside = (x > left - 1) & (x < right + 1) & (z > bottom - 1)
    rolling = packing.mobile if isinstance(pile.method, piles.Dem) else False
    grains = np.flatnonzero(inside | rolling)
    counted = np.zeros(len(x), np.int64)
    counted[packing.windward] = moved.level
    if isinstance(pile.method, piles.Dem):
        every = [packing.centres[None]]
        for run in pile.method.runs:
            steps, rows = read_dump(cases / run.name / motion.BED, motion.BED_COLUMNS)
            fixed = np.where(packing.mobile[:, None], np.nan, packing.centres)
            every.append(np.tile(fixed, (len(steps), 1, 1)))
            ends, d = np.searchsorted(steps, rows["step"]), pile.scene.grain.diameter
            every[-1][ends, rows["id"] - 1] = rows[["x", "z"]] / d
        places = np.concatenate(every)[:, grains]
        stops = np.arange(len(places))
    else:
        share = int(np.argmax(moved.moved >= FRACTION * moved.count - 1e-9))
        spaced = np.linspace(0, len(moved.flow) - 1, min(STOPS, len(moved.flow)))
        stops = np.unique([*spaced.round().astype(int), share])
        places = np.broadcast_to(packing.centres[grains], (len(stops), len(grains), 2))
    lines = [(0, pile.line)]
    for worn in pile.flows[1:]:  # the first grain that moves under its flow
        left_ = np.isfinite(piles.grains(pile, worn, cases).left).sum()
        stop = int(np.searchsorted(moved.moved[stops], left_, side="right"))
        lines.append((stop, piles.line(pile, worn, cases)))
    level = np.where(counted > 0, np.searchsorted(stops, counted), 0)[grains]
    if len(lines) > 1:
        gone = (level > 0) & (level <= np.arange(len(stops))[:, None])
        places = np.where(gone[..., None], np.nan, places)
    return Steps(pile, grains, places, level, moved.flow[stops], moved.moved[stops], tuple(lines))


def chosen(results: Results) -> Iterator[tuple[pd.Series, Pile]]:
    """The threshold of each slope that the sentences are about, with the pile that shows it.

    Where the files of that pile were pruned, the next one has its place.
    """
    for _, rows in split(results.exemplars, "alpha_deg"):
        each = ((row, results.shown(str(row["scene_id"]))) for _, row in rows.iterrows())
        grains = ((row, pile) for row, piles in each for pile in piles[:1] if pile.length)
        yield from itertools.islice(grains, 1)


def draw(results: Results) -> Iterator[Figure]:
    """One figure for each slope, by rising slope; the first stands for the study."""
    if results.exemplars.empty:
        return
    telling = labels.varying(results.exemplars, "alpha_deg", "d_m")
    for number, (row, pile) in enumerate(chosen(results)):
        steps = read(pile, results.cases)
        shown = steps.first(FRACTION)
        share = steps.totals[shown] / pile.packing.count
        told = ", ".join(labels.told(row, ["alpha_deg", "d_m", *telling]))
        name = f"bed-alpha{pile.bed.slope_deg:g}"
        title = f"The bed when {share:.0%} of its grains have moved, {told}"
        image = _svg(steps, shown, results.cases).encode()
        cases, text = tuple(run.name for run in reversed(pile.runs)), words(results, pile)
        look = {"fold": number > 0, "leads": number == 0}
        yield Figure(name, title, text, cases, None, image, data(steps, shown), **look)


def words(results: Results, pile: Pile) -> str:
    """The caption: how the pile was answered, and what of it is shown."""
    columns, rules = ["z0_over_d", "packing", "force_law"], pile.scene.protocol
    columns += labels.varying(results.beds("pile"), "alpha_deg", "d_m", *columns)
    used = {column: fields.COLUMNS[column].used(pile.scene) for column in columns}
    return caption(
        "bed",
        **{"width": pile.bed.width, "by_dem": pile.by_dem, "flow": bool(pile.model.cases)},
        **{"method": rules.method, "update": rules.update, "part": window(pile)[1]},
        criterion=labels.value("displacement_criterion", rules.displacement_criterion),
        properties=", ".join(labels.plain(c, v) for c, v in used.items() if v is not None),
    )


def data(steps: Steps, shown: int) -> dict[str, Any]:
    """Data for the slider: at each stop number, x and -z of the grains that have moved since."""
    mobile = steps.pile.packing.mobile[steps.grains]
    last, frames = steps.places[0, mobile].copy(), []
    for places in steps.places[1:]:
        now = places[mobile]
        gone = np.isnan(now[:, 0])
        new = (gone != np.isnan(last[:, 0])) | (np.abs(now - last).max(axis=1) > SHIFT)
        frame: list[float | None] = []
        for i in np.flatnonzero(new).tolist():
            x, z = now[i].tolist()
            frame += [i, None, None] if gone[i] else [i, round(x, 2), round(-z, 2)]
        frames.append(frame)
        last[new] = now[new]
    return {
        "step": "load step" if steps.pile.by_dem else "flow",
        "shown": shown,
        "count": steps.pile.packing.count,
        "flow": [float(f"{flow:.4g}") for flow in steps.flow],
        "moved": steps.totals.tolist(),
        "level": steps.level[mobile].tolist(),
        "start": np.round(steps.places[0, mobile] * [1, -1], 2).tolist(),
        "frames": frames,
        **({"lines": _paths(steps)} if len(steps.lines) > 1 else {}),
    }


def _paths(steps: Steps) -> list[list[Any]]:
    """Each bed line as a path of the picture, after the stop from which on it is there."""
    (left, right, *_), _ = window(steps.pile)
    paths = []
    for stop, line in steps.lines:
        x = np.unique([left, *np.clip(line.x, left, right), right])
        points = (f"{a:.2f} {-b:.2f}" for a, b in zip(x, line.height(x), strict=True))
        paths.append([stop, f"M{' L'.join(points)}"])
    return paths


def window(pile: Pile) -> tuple[flows.Window, str]:
    """Left, right, bottom and top of the picture, d, and which part of a long bed it shows."""
    (x, z), toe = pile.line.crest.tolist(), float(pile.line.toe[0])
    if z <= 0:  # a level bed has no crest
        left, right = pile.line.x[1] - 2, pile.line.x[-2] + 2
        part = f"Shown: {LONG:g} d of the bed." if left + LONG < pile.line.x[-2] else ""
        return (left, min(right, left + LONG), -4.0, 6.0), part
    if x <= LONG and toe <= WHOLE * LONG:
        return (-0.06 * toe, 1.06 * toe, -2.0, z + max(0.5 * z, 6.0)), ""
    form = " of the first form" if pile.bed.forms > 1 else ""
    part = f"Shown: the upper end of the windward face{form}."
    return (x - 0.7 * LONG, x + 0.3 * LONG, z - 0.2 * LONG, z + 12.0), part


def _svg(steps: Steps, shown: int, cases: Path) -> str:
    pile, places = steps.pile, steps.places[shown]
    frame = left, right, bottom, top = window(pile)[0]
    packing, grains = pile.packing, steps.grains
    centres, mobile = packing.centres[grains], packing.mobile[grains]
    here = np.where(np.isnan(places), centres, places)
    base = np.where(packing.windward[grains], "e", "m")
    moved = (steps.level > 0) & (steps.level <= shown)
    look = np.select([moved & np.isnan(places[:, 0]), moved], ["v g", "v"], base)
    length = next(n for n in (1, 2, 5, 10, 20, 50, 100) if n > (right - left) / 25)

    def circles(places: FloatArray, chosen: BoolArray) -> list[tuple[str, str, str]]:
        rows = np.column_stack([places * [1, -1], packing.sizes[grains] / 2])[chosen]
        return [(f"{x:.2f}", f"{y:.2f}", f"{r:.3g}") for x, y, r in rows.tolist()]

    paths = _paths(steps)
    return fill(
        "bed.svg.j2",
        **{"left": left, "right": right, "top": top, "bottom": bottom, "bar": length},
        box=f"{left:.2f} {-top:.2f} {right - left:.2f} {top - bottom:.2f}",
        ground=f"M{left:.2f} {-bottom:.2f} L{paths[0][1][1:]} L{right:.2f} {-bottom:.2f}Z",
        line=[path for stop, path in paths if stop <= shown][-1],
        wears=len(paths) > 1,
        flow=_flow(pile, cases, frame) if pile.model.cases else "",
        fixed=circles(centres, ~mobile),
        mobile=zip(circles(here, mobile), look[mobile], base[mobile], strict=True),
        size=f"{(right - left) / 75:.3g}",
        d=labels.value("d_m", pile.scene.grain.diameter),
        case=pile.runs[-1].name if pile.runs else "",
        title=labels.plain("alpha_deg", pile.bed.slope_deg),
    )


def _flow(pile: Pile, cases: Path, frame: flows.Window) -> str:
    """The flow's speed as a pale picture, PNG in base64."""
    velocity = flows.over_u_e(pile, cases, frame, pile.scene.grain.diameter)
    speed = np.linalg.norm(velocity, axis=-1)[::-1]
    levels = np.where(np.isnan(speed), 255, 254 * np.clip(np.nan_to_num(speed), 0, 1))
    shades = colormaps["Blues"](0.1 + 0.5 * np.arange(256) / 254, bytes=True)[:, :3]
    picture = Image.fromarray(levels.astype(np.uint8))
    picture.putpalette(shades.tobytes())
    picture.save(out := BytesIO(), "PNG", transparency=255)
    return base64.b64encode(out.getvalue()).decode("ascii")
