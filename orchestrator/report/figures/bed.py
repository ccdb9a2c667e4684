"""The picture of a bed with its grains and the flow, with a slider over the flow."""

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from PIL import Image

from orchestrator.bed.line import BedLine
from orchestrator.digits import percent
from orchestrator.grains import motion, wear
from orchestrator.grains.methods import Dem
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, single, solved, units
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import fill, filled, typeset
from orchestrator.report.results import FRACTION, Results, split_by
from orchestrator.report.style import Figure
from orchestrator.runs.case import Case
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import fields
from orchestrator.tables import csv
from orchestrator.types import FloatArray, IntArray

LONG = 100.0
"""Length of a face, d, beyond which its upper end is shown alone.

Grains must be seen.
"""
WHOLE = 4.0
"""Length of a whole bed over `LONG` up to which all forms are shown."""
STOPS = 300
"""Largest number of stops of the slider of a bed without dynamics."""
SHIFT = 0.02
"""Grains that have moved by less since they were last drawn stay, d."""
BARS = (1, 2, 5, 10, 20, 50, 100)
"""Lengths of the bar of scale, d."""
LEAD = (
    "The bed from the side: orange grains are entrained at the flow that the title "
    "names."
)
"""What stands under the drawing."""
CAPTION = """\
After Fig. 13 of the paper. Grains {% if width %}of all rows of a strip of {{
"%g"|format(width) }} d, from the side, {% endif %} {% if by_dem %} at the end of a load
step. Orange: entrained, displaced by {{ criterion }} downstream along the bed. Pale
orange: has left the domain; drawn at its initial place. {% else %} as they were packed.
Orange: entrained at this flow, {% if goes_on %} the larger of that at which the grain
leaves its place by DEM and that at which its motion is sustained. {% else %} by {{
method }}, a method without dynamics. {% endif %} {% endif %}
Pale yellow: exposed, at rest. Beige: mobile, under the exposed grains. Grey: fixed.
{% if flow %} The shade of blue is the speed of the flow by OpenFOAM over the bed
without grains, relative to that of the approaching flow at 10 h. {% endif %} {% if
update %} Blue line: the bed line, drawn anew after each {{ "%.0f"|format(100 * update)
}} % of the grains. Pale: entrained; drawn at its initial place. {% endif %} d is one
diameter. {{ properties }}. {{ part }}"""


@dataclass(frozen=True)
class Steps:
    """The n drawn grains of a pile at K + 1 stops of the slider, lengths in d.

    Attributes
    ----------
    pile
        The pile.
    grains
        Their numbers in the packing, shape (n,).
    places
        Their x and z, shape (K + 1, n, 2): first as packed; NaN of a grain that has
        left the box.
    level
        The stop by which each grain has moved, shape (n,); 0 if it never does or is not
        counted.
    flow
        Undisturbed friction velocity at each stop, m/s, shape (K + 1,).
    totals
        Number of counted grains, drawn or not, that have moved, shape (K + 1,).
    lines
        The bed lines, each with the first stop under its flow; one, on a frozen bed.
    """

    pile: Pile
    grains: IntArray
    places: FloatArray
    level: IntArray
    flow: FloatArray
    totals: IntArray
    lines: tuple[tuple[int, BedLine], ...]

    def first(self, fraction: float) -> int:
        """Find the first stop at which a fraction of the counted grains has moved.

        Parameters
        ----------
        fraction
            The fraction.

        Returns
        -------
        int
            The stop, or the last one.
        """
        enough = self.totals >= fraction * self.pile.packing.count - 1e-9
        return int(np.argmax(enough)) if enough.any() else len(self.totals) - 1


@dataclass(frozen=True)
class Flows:
    """The flows of the stops in a unit that can be measured.

    Attributes
    ----------
    unit
        The unit.
    advised
        The flows that the card advises, for each stop.
    model
        The computed ones where these are others; else none.
    advised_is, model_is
        What both are called.
    """

    unit: str
    advised: Sequence[float]
    model: Sequence[float] = ()
    advised_is: str = ""
    model_is: str = ""

    def said(self, stop: int) -> str:
        """Write the flow of a stop.

        Parameters
        ----------
        stop
            The stop.

        Returns
        -------
        str
            The text.
        """
        text = f"{self.advised[stop]:g} {self.unit}"
        if self.model:
            text += f" {self.advised_is} ({self.model_is} {self.model[stop]:g})"
        return text


def read_steps(pile: Pile, cases: Path) -> Steps:
    """Read where the grains of a finished pile are; without DEM where they were packed.

    Only grains within the picture are read, at `STOPS` of the load steps if there are
    more: all grains of a long bed at all load steps would need many gigabytes.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of its finished cases.

    Returns
    -------
    Steps
        The grains at each stop.
    """
    packing = pile.packing
    moved = pile.motion(cases)
    grains = _grains_shown(pile)
    if _follows_dem(pile):
        places = _places_by_dem(pile, cases)[:, grains]
        stops = np.arange(len(places))
    else:
        stops = _stops(moved)
        places = np.broadcast_to(packing.centres[grains], (len(stops), len(grains), 2))
    lines = [(0, pile.line)]
    for worn in pile.flows[1:]:
        # the first grain that moves under its flow
        gone_before = np.isfinite(wear.state(pile, worn, cases).left).sum()
        stop = int(np.searchsorted(moved.moved[stops], gone_before, side="right"))
        lines.append((stop, wear.line(pile, worn, cases)))
    left_at = np.zeros(len(packing.centres), np.int64)
    left_at[packing.windward] = moved.load_step
    level = np.where(left_at > 0, np.searchsorted(stops, left_at), 0)[grains]
    is_worn = len(lines) > 1
    if is_worn:
        is_gone = (level > 0) & (level <= np.arange(len(stops))[:, None])
        places = np.where(is_gone[..., None], np.nan, places)
    flow = moved.flow[stops]
    totals = moved.moved[stops]
    return Steps(pile, grains, places, level, flow, totals, tuple(lines))


def _follows_dem(pile: Pile) -> bool:
    """Whether the picture follows the grains of the deck.

    It does not where they must go on, too: each grain then has moved at the larger of
    two flows, and at that flow no load step was run. Such grains are shown where they
    were packed.
    """
    return pile.scene.method.facts.is_resolved_in_time and not pile.is_sustained


def _grains_shown(pile: Pile) -> IntArray:
    """Numbers of the grains in the picture.

    By DEM they are all mobile ones, which may roll into it.
    """
    (left, right, bottom, _), _ = window(pile)
    x, z = pile.packing.centres.T
    is_shown = (x > left - 1) & (x < right + 1) & (z > bottom - 1)
    if _follows_dem(pile):
        is_shown |= pile.packing.mobile
    return np.flatnonzero(is_shown)


def _places_by_dem(pile: Pile, cases: Path) -> FloatArray:
    """Places of all grains as packed and after each load step, d: (K + 1, N, 2)."""
    method = pile.method
    assert isinstance(method, Dem)
    packing = pile.packing
    d = pile.scene.grain.diameter
    fixed = np.where(packing.mobile[:, None], np.nan, packing.centres)
    places = [packing.centres[None]]
    for run in method.runs:
        steps, rows = ENGINE.read_frames(
            cases / run.name / motion.BED, motion.BED_COLUMNS
        )
        of_run = np.tile(fixed, (len(steps), 1, 1))
        ends = np.searchsorted(steps, rows["step"])
        of_run[ends, rows["id"] - 1] = rows[["x", "z"]] / d
        places.append(of_run)
    return np.concatenate(places)


def _stops(moved: motion.Motion) -> IntArray:
    """Load steps of the slider of a bed without dynamics.

    They are evenly spaced, with that of `FRACTION` between them.
    """
    share = int(np.argmax(moved.moved >= FRACTION * moved.count - 1e-9))
    count = len(moved.flow)
    spaced = np.linspace(0, count - 1, min(STOPS, count)).round().astype(int)
    return np.unique([*spaced, share])


def chosen(results: Results) -> Iterator[tuple[pd.Series, Pile]]:
    """List the thresholds that the sentences are about, one for each slope.

    Poured beds have one for each slope and method, whose grains go otherwise. Where the
    files of a pile were pruned, the next one has its place.

    Yields
    ------
    row : Series
        The threshold, with the columns of its scene.
    pile : Pile
        The pile that shows it.
    """
    rows = results.exemplars
    if rows.empty:
        return
    is_poured = rows["packing"] == "poured"
    rows = rows.assign(by=rows["method"].where(is_poured, ""))
    for _, alike in split_by(rows, "alpha_deg", "by"):
        for _, row in alike.iterrows():
            shown = results.shown(str(row["scene_id"]))
            if shown and shown[0].length:
                yield row, shown[0]
                break


def draw(results: Results) -> Iterator[Figure]:
    """Draw the bed of each slope.

    Yields
    ------
    Figure
        By rising slope; the first stands for the study.
    """
    telling = labels.varying(results.exemplars, "alpha_deg", "d_m")
    seen: set[str] = set()
    for row, pile in chosen(results):
        steps = read_steps(pile, results.cases)
        shown = steps.first(FRACTION)
        share = percent(steps.totals[shown] / pile.packing.count)
        told = ", ".join(labels.told(row, ["alpha_deg", "d_m", *telling]))
        flows = flows_of(row, steps)
        name = f"bed-alpha{pile.bed.slope_deg:g}"
        if name in seen:
            name = f"{name}-{row['method']}"
        yield Figure(
            name=name,
            title=f"The bed at {flows.said(shown)}: {share} entrained, {told}",
            caption=bed_caption(results, pile),
            cases=tuple(run.name for run in reversed(pile.runs)),
            drawing=None,
            image=_svg(steps, shown, results.cases).encode(),
            data=data(steps, shown, flows),
            place="" if seen else "lead",
            follows="Fig. 13",
            numbers=_numbers(steps, flows),
            lead=LEAD,
        )
        seen.add(name)


def flows_of(row: pd.Series, steps: Steps) -> Flows:
    """Take the flows of the stops in the unit of the card.

    Parameters
    ----------
    row
        The threshold that the picture is of, with the columns of its scene.
    steps
        The grains at each stop.

    Returns
    -------
    Flows
        Those that the card advises, and those of the model where these are others.
    """
    told = single.quantity_of_row(row)
    factor = units.advised_over_computed(row)
    advised = _three_digits(units.told_by(row, factor * steps.flow, told))
    if factor == 1:
        return Flows(told.unit, advised)
    model = _three_digits(units.told_by(row, steps.flow, told))
    names = (single.with_threshold(row), single.model_name(row))
    return Flows(told.unit, advised, model, *names)


def _three_digits(values: FloatArray) -> list[float]:
    """Numbers with the digits that a picture has."""
    return [float(f"{value:.3g}") for value in values.tolist()]


def files(results: Results) -> Sequence[Case]:
    """List the cases of the beds that are drawn.

    Returns
    -------
    list of Case
        The cases.
    """
    return [run for _, pile in chosen(results) for run in pile.runs]


def bed_caption(results: Results, pile: Pile) -> str:
    """Write the caption of a bed.

    Parameters
    ----------
    results
        The study with its tables.
    pile
        The pile that is shown.

    Returns
    -------
    str
        How the pile was answered, and what of it is shown.
    """
    displacement = pile.scene.threshold.displacement
    columns = ["z0_over_d", "packing", "force_law"]
    columns += labels.varying(results.beds("pile"), "alpha_deg", "d_m", *columns)
    if pile.scene.is_followed:
        columns.remove("force_law")
    properties = []
    for column in columns:
        used = fields.COLUMNS[column].used(pile.scene)
        if used is not None:
            properties.append(labels.value_text(column, used))
    return filled(
        CAPTION,
        width=pile.bed.width,
        by_dem=_follows_dem(pile),
        goes_on=pile.scene.method.facts.is_resolved_in_time,
        flow=bool(pile.solves),
        method=pile.scene.method.kind,
        update=pile.scene.threshold.update,
        part=window(pile)[1],
        criterion=labels.value("displacement_criterion", displacement),
        properties=", ".join(properties),
    )


def data(steps: Steps, shown: int, flows: Flows) -> dict[str, Any]:
    """Collect the data of the slider.

    Parameters
    ----------
    steps
        The grains at each stop.
    shown
        The stop at which the picture is drawn.
    flows
        The flows of the stops.

    Returns
    -------
    dict of str to object
        For the page's script: ``frames`` has for each stop the number, x and -z of the
        grains that have moved since the one before.
    """
    mobile = steps.pile.packing.mobile[steps.grains]
    last = steps.places[0, mobile].copy()
    frames = []
    for places in steps.places[1:]:
        now = places[mobile]
        is_gone = np.isnan(now[:, 0])
        was_gone = np.isnan(last[:, 0])
        is_new = (is_gone != was_gone) | (np.abs(now - last).max(axis=1) > SHIFT)
        frame: list[float | None] = []
        for grain in np.flatnonzero(is_new).tolist():
            x, z = now[grain].tolist()
            if is_gone[grain]:
                frame += [grain, None, None]
            else:
                frame += [grain, round(x, 2), round(-z, 2)]
        frames.append(frame)
        last[is_new] = now[is_new]
    moved = int(steps.totals[shown])
    count = steps.pile.packing.count
    found = {
        "step": "load step" if _follows_dem(steps.pile) else "flow",
        "shown": shown,
        "said": f"{flows.said(shown)}: {moved} of {count} entrained "
        f"({percent(moved / count)})",
        "count": count,
        "flow": flows.advised,
        "unit": flows.unit,
        "moved": steps.totals.tolist(),
        "level": steps.level[mobile].tolist(),
        "start": np.round(steps.places[0, mobile] * [1, -1], 2).tolist(),
        "frames": frames,
        "leaves": _some_leave(steps),
    }
    if flows.model:
        found["model"] = flows.model
        found["names"] = [typeset(flows.advised_is), typeset(flows.model_is)]
    if len(steps.lines) > 1:
        found["lines"] = _paths(steps)
    return found


def _some_leave(steps: Steps) -> bool:
    """Whether a grain has left the box at some stop, which is drawn pale."""
    mobile = steps.pile.packing.mobile[steps.grains]
    return bool(np.isnan(steps.places[:, mobile]).any())


def _numbers(steps: Steps, flows: Flows) -> str:
    """The drawn grains as packed, with the flow of the stop by which each has moved."""
    x, z = steps.places[0].T
    has_moved = steps.level > 0
    flow = np.where(has_moved, np.array(flows.advised)[steps.level], np.nan)
    columns = {
        "grain": steps.grains,
        "x/d": x,
        "z/d": z,
        "is mobile": steps.pile.packing.mobile[steps.grains],
        f"moves at, {flows.unit}": flow,
    }
    return csv(pd.DataFrame(columns), "%.6g")


def _paths(steps: Steps) -> list[list[Any]]:
    """Each bed line as a path of the picture, after the stop at which it begins."""
    (left, right, *_), _ = window(steps.pile)
    paths = []
    for stop, line in steps.lines:
        x = np.unique([left, *np.clip(line.x, left, right), right])
        heights = line.height(x)
        points = [f"{a:.2f} {-b:.2f}" for a, b in zip(x, heights, strict=True)]
        paths.append([stop, f"M{' L'.join(points)}"])
    return paths


def window(pile: Pile) -> tuple[solved.Window, str]:
    """Choose what of a bed the picture shows.

    Returns
    -------
    frame : tuple of float
        Left, right, bottom and top, d.
    part : str
        A sentence on the part of a long bed that it is; empty if it is the whole.
    """
    x, z = pile.line.crest.tolist()
    toe = float(pile.line.toe[0])
    is_level = z <= 0
    if is_level:
        left, right = pile.line.x[1] - 2, pile.line.x[-2] + 2
        is_cut = left + LONG < pile.line.x[-2]
        part = f"Shown: {LONG:g} d of the bed." if is_cut else ""
        return (left, min(right, left + LONG), -4.0, 6.0), part
    if x <= LONG and toe <= WHOLE * LONG:
        return (-0.06 * toe, 1.06 * toe, -2.0, z + max(0.5 * z, 6.0)), ""
    form = " of the first form" if pile.bed.forms > 1 else ""
    part = f"Shown: the upper end of the windward face{form}."
    return (x - 0.7 * LONG, x + 0.3 * LONG, z - 0.2 * LONG, z + 12.0), part


def _svg(steps: Steps, shown: int, cases: Path) -> str:
    """The picture at one stop of the slider."""
    pile = steps.pile
    frame = left, right, bottom, top = window(pile)[0]
    paths = _paths(steps)
    lines = [path for stop, path in paths if stop <= shown]
    first = paths[0][1].removeprefix("M")
    return fill(
        "figures/bed.svg.j2",
        left=left,
        right=right,
        top=top,
        bottom=bottom,
        bar=next(length for length in BARS if length > (right - left) / 25),
        box=f"{left:.2f} {-top:.2f} {right - left:.2f} {top - bottom:.2f}",
        ground=f"M{left:.2f} {-bottom:.2f} L{first} L{right:.2f} {-bottom:.2f}Z",
        line=lines[-1],
        wears=len(paths) > 1,
        flow=_flow(pile, cases, frame) if pile.solves else "",
        size=f"{(right - left) / 75:.3g}",
        leaves=_some_leave(steps),
        d=labels.value("d_m", pile.scene.grain.diameter),
        case=pile.last_run or "",
        title=labels.value_text("alpha_deg", pile.bed.slope_deg),
        **_grains(steps, shown),
    )


def _grains(steps: Steps, shown: int) -> dict[str, Any]:
    """The circles of fixed grains, and those of mobile ones with their classes.

    The classes are exposed, mobile, moved and gone: at this stop, and without flow.
    """
    packing = steps.pile.packing
    centres = packing.centres[steps.grains]
    radii = packing.sizes[steps.grains] / 2
    mobile = packing.mobile[steps.grains]
    places = steps.places[shown]
    is_gone = np.isnan(places[:, 0])
    has_moved = (steps.level > 0) & (steps.level <= shown)
    base = np.where(packing.windward[steps.grains], "e", "m")
    look = np.select([has_moved & is_gone, has_moved], ["v g", "v"], base)
    here = np.where(is_gone[:, None], centres, places)
    moving = _circles(here[mobile], radii[mobile])
    return {
        "fixed": _circles(centres[~mobile], radii[~mobile]),
        "mobile": zip(moving, look[mobile], base[mobile], strict=True),
    }


def _circles(centres: FloatArray, radii: FloatArray) -> list[tuple[str, str, str]]:
    """x, -z and radius of grains, as the picture writes them; it has y downwards."""
    rows = np.column_stack([centres * [1, -1], radii])
    return [(f"{x:.2f}", f"{y:.2f}", f"{r:.3g}") for x, y, r in rows.tolist()]


def _flow(pile: Pile, cases: Path, frame: solved.Window) -> str:
    """The flow's speed as a pale picture, PNG in base64."""
    velocity = solved.over_u_e(pile, cases, frame, pile.scene.grain.diameter)
    speed = np.linalg.norm(velocity, axis=-1)[::-1]
    is_outside = np.isnan(speed)
    levels = np.where(is_outside, 255, 254 * np.clip(np.nan_to_num(speed), 0, 1))
    shades = colormaps["Blues"](0.1 + 0.5 * np.arange(256) / 254, bytes=True)[:, :3]
    picture = Image.fromarray(levels.astype(np.uint8))
    picture.putpalette(shades.tobytes())
    out = BytesIO()
    picture.save(out, "PNG", transparency=255)
    return base64.b64encode(out.getvalue()).decode("ascii")


FIGURE = FigureKind(order=50, draws=draw, needs=("pile_threshold",), files=files)
