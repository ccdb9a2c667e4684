"""The picture below the answer card, in the colours of the page, for two widths.

Each is drawn twice, for a page and for a telephone; the style of the page shows one.
"""

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import LogLocator, NullFormatter

from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import within
from orchestrator.physics.curves import Air, shao_lu, soulsby_whitehouse
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import SingleGrain, thresholds_of
from orchestrator.report import answers, labels, sheets, single, style
from orchestrator.report.results import Results
from orchestrator.report.style import Look
from orchestrator.report.subjects import Quantity, is_gas

WIDE = 1136
NARROW = 360
"""Widths of a drawing, px."""
PX = 1 / 100
"""Inches of a px at the resolution of the drawings."""
TEXT = 9.4
"""Size of text, points: 13 px."""
SMALL = 8.7
"""Size of the numbers of axes, points: 12 px."""
COLOURS = {
    "#c24e00": "answer",
    "#f7ddc8": "pale",
    "#0072b2": "flow",
    "#1d1d1b": "ink",
    "#57534c": "soft",
    "#d8d3c7": "line",
    "#767676": "none",
    "#dccfae": "sand",
    "#8d7f5c": "edge",
    "#fefefe": "ground",
}
"""Colours of drawings, and their names in the style of the page."""
ANSWER = "#c24e00"
PALE = "#f7ddc8"
FLOW = "#0072b2"
INK = "#1d1d1b"
SOFT = "#57534c"
LINE = "#d8d3c7"
NONE = "#767676"
SAND = "#dccfae"
EDGE = "#8d7f5c"
GROUND = "#fefefe"
RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.size": TEXT,
    "text.color": INK,
    "axes.edgecolor": LINE,
    "axes.labelcolor": INK,
    "xtick.color": LINE,
    "ytick.color": LINE,
    "xtick.labelcolor": SOFT,
    "ytick.labelcolor": SOFT,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "axes.titlesize": TEXT,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 4,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": LINE,
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "savefig.transparent": True,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
}
"""Settings of drawings beside those of all figures."""
HIGHEST = 2.6
"""Largest flow that the panel of a bed shows, over that of the first motion."""
MOST_SERIES = 4
"""Curves of a sweep that a drawing tells apart."""
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1, 2)))
MARKERS = "osD^"
"""Dashes and markers of the curves of a sweep."""


class Head(NamedTuple):
    """A picture below a card.

    Attributes
    ----------
    draw
        Draws it, for a width that is narrow or not.
    title
        What it shows, for who cannot see it.
    caption
        A sentence or two below it.
    """

    draw: Callable[[bool], Canvas]
    title: str
    caption: str


def of(results: Results) -> Head | None:
    """Choose the picture of a study.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    Head or None
        Of one bed with a place where motion starts its three panels, of one grain the
        laws and the sizes, of a sweep its curves. None where another figure leads.
    """
    thresholds = results.joined("pile_threshold")
    if thresholds.empty:
        grains = sheets.single_grains(results)
        return _of_grains(grains) if len(grains) else None
    rows = results.exemplars
    if rows.empty:
        return None
    row = rows.iloc[0]
    pile = results.plan.piles[str(row["scene_id"])]
    has_place = row["first_ustar0_m_s"] > 0 and not single.is_level(row)
    is_line = has_place and not pile.bed.is_triangle
    if is_line and not answers.are_several_beds(rows):
        return _along(row, pile, results)
    return None


def below(results: Results) -> Head | None:
    """Choose what stands under the picture of a bed of grains.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    Head or None
        Of a mixture each size, of one other bed the share that has moved.
    """
    rows = results.exemplars
    if rows.empty:
        return None
    row = rows.iloc[0]
    if sheets.sizes(results) is not None:
        return _sizes(row, results)
    if answers.are_several_beds(rows):
        return _sweep(rows)
    return _shares(row, results)


def written(head: Head) -> Markup:
    """Write a picture as HTML, drawn for both widths.

    Parameters
    ----------
    head
        The picture.

    Returns
    -------
    Markup
        Two SVG drawings, of which the style shows one.
    """
    drawings = []
    with matplotlib.rc_context(RC):
        for name, narrow in (("wide", False), ("narrow", True)):
            drawings.append(_svg(head.draw(narrow), head.title, name))
    return Markup("\n").join(drawings)


def _svg(canvas: Canvas, title: str, name: str) -> Markup:
    """The SVG of a drawing with the colours of the page."""
    text = style.svg(canvas).decode("utf-8")
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # two drawings on one page have names of their own
    svg = re.sub(r'(id="|url\(#|href="#)', rf"\g<1>{name}-", svg)
    for colour, variable in COLOURS.items():
        svg = svg.replace(colour, f"var(--{variable})")
    svg = re.sub(r'(<svg [^>]*?)width="[^"]*" ', r"\1", svg, count=1)
    svg = re.sub(r'(<svg [^>]*?)height="[^"]*" ', r"\1", svg, count=1)
    svg = svg.replace("font-family: 'DejaVu Sans'", "font-family: inherit")
    label = f'<svg class="draw {name}" role="img" aria-label="{Markup.escape(title)}"'
    return Markup(svg.replace("<svg", label, 1))


def _figure(narrow: bool, height: float) -> Canvas:
    """An empty drawing of one of the widths, height in px."""
    width = NARROW if narrow else WIDE
    return Canvas(figsize=(width * PX, height * PX), dpi=100)


def _margins(
    canvas: Canvas, left: float, right: float, top: float, bottom: float
) -> None:
    """Margins of a drawing in px."""
    width, height = canvas.get_size_inches() / PX
    canvas.subplots_adjust(
        left=left / width,
        right=1 - right / width,
        top=1 - top / height,
        bottom=bottom / height,
    )


def _log_sizes(ax: Axes) -> None:
    """Plain numbers at 1, 2 and 5 on a logarithmic axis of sizes."""
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())


# one bed along its line


def _along(row: pd.Series, pile: Pile, results: Results) -> Head:
    """Three panels over the bed line: threshold of each place, stress, the line."""
    told = single.quantity(row)
    x = float(row["first_x_m"])
    value = single.in_unit(row, single.known(row["first_ustar0_m_s"]), told)
    title = (
        f"Three panels along the bed: the {told.name} that moves each place, lowest "
        f"at {x:.4g} m; the stress of the flow on the bed; the bed line"
    )
    caption = (
        f"Motion starts where the curve of the {told.name} is lowest: at {x:.4g} m, "
        f"{value:.3g} {told.unit}. Orange: computed, with the known error of the "
        "method as a band; dashed: with the measured threshold. Shaded: the flow runs "
        "back."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = _figure(narrow, 400 if narrow else 372)
        heights = [150, 80, 70] if narrow else [160, 66, 70]
        axes = canvas.subplots(3, 1, sharex=True, height_ratios=heights)
        _margins(canvas, 38, 8, 22, 24)
        canvas.subplots_adjust(hspace=0.42)
        _thresholds_along(axes[0], row, results, told, narrow)
        _stress_along(axes[1], row, results, narrow)
        _line(axes[2], row, pile, results, told, narrow)
        line = pile.model.line
        axes[0].set_xlim(line.x[1], line.x[-2])
        for ax in axes:
            ax.axvline(x, color=ANSWER, lw=0.9, ls=(0, (2, 2)), zorder=1)
        return canvas

    return Head(draw, title, caption)


def _grains_of(row: pd.Series, results: Results) -> pd.DataFrame:
    """The counted places or grains of a bed, by their place."""
    grains = results.tables["pile_grain"]
    here: pd.DataFrame = grains[grains["scene_id"] == row["scene_id"]]
    return here.sort_values("x_m")


def _in_units(row: pd.Series, ustar: Any, told: Quantity) -> Any:
    """Friction velocities in the unit of a quantity."""
    return np.array([single.in_unit(row, float(one), told) for one in ustar])


def _parted(x: Any) -> Any:
    """Where a line along places has to be interrupted: before a gap."""
    steps = np.diff(x)
    return np.flatnonzero(steps > 5 * np.median(steps)) + 1 if len(steps) else []


def _thresholds_along(
    ax: Axes, row: pd.Series, results: Results, told: Quantity, narrow: bool
) -> None:
    """The flow at which each place goes, with a band, and by the measured threshold."""
    grains = _grains_of(row, results)
    grains = grains[np.isfinite(grains["ustar0_m_s"]) & (grains["ustar0_m_s"] > 0)]
    x = grains["x_m"].to_numpy(float)
    ustar = grains["ustar0_m_s"].to_numpy(float)
    computed = _in_units(row, ustar, told)
    measured = _in_units(row, _ratio(row) * ustar, told)
    first = float(np.nanmin(computed))
    cuts = _parted(x)
    _band(ax, row, x, ustar, told)
    ax.plot(*_broken(x, measured, cuts), color=INK, lw=1.2, ls=(0, (4, 2)))
    ax.plot(*_broken(x, computed, cuts), color=ANSWER, lw=2)
    ax.plot([row["first_x_m"]], [first], "o", color=ANSWER, ms=7, mec=GROUND)
    shown = computed[computed < HIGHEST * first]
    least = float(np.nanmin(np.append(measured, first)))
    ax.set_ylim(0.85 * least, 1.5 * float(np.nanmax(shown, initial=first)))
    where = "" if narrow else " here"
    ax.set_title(f"{told.name.capitalize()} that moves the bed{where}, {told.unit}")
    _names_above(ax, narrow)
    x_first = float(row["first_x_m"])
    is_left = x_first < (x[0] + x[-1]) / 2
    text = f"{x_first:.4g} m, {first:.3g} {told.unit}"
    ax.annotate(
        text if narrow else f"motion starts here: {text}",
        (x_first, 1.0),
        xycoords=ax.get_xaxis_transform(),
        xytext=(6 if is_left else -6, -3),
        textcoords="offset points",
        ha="left" if is_left else "right",
        va="top",
        color=ANSWER,
        weight="bold",
    )


def _ratio(row: pd.Series) -> float:
    """The measured over the computed friction velocity of one grain on a level bed."""
    return float(row["measured_level_ustar_m_s"]) / float(row["level_ustar_m_s"])


def _band(ax: Axes, row: pd.Series, x: Any, ustar: Any, told: Quantity) -> None:
    """What is within the known error of the method at each place."""
    error = single.known(row["error_estimate"])
    if not (math.isfinite(error) and error < 1):
        return
    least, most = within(1.0, error)
    low = _in_units(row, ustar * math.sqrt(least), told)
    high = _in_units(row, ustar * math.sqrt(most), told)
    for part in np.split(np.arange(len(x)), _parted(x)):
        ax.fill_between(x[part], low[part], high[part], color=PALE, lw=0)


def _names_above(ax: Axes, narrow: bool) -> None:
    """The names of the two curves above their panel; a narrow one has a caption."""
    if narrow:
        return
    look: Look = {"transform": ax.transAxes, "ha": "right", "va": "bottom"}
    ax.text(1.0, 1.03, "- - -  with the measured threshold", color=INK, **look)
    ax.text(0.77, 1.03, "——  computed", color=ANSWER, weight="bold", **look)


def _broken(x: Any, y: Any, cuts: Any) -> tuple[Any, Any]:
    """A line with gaps before some of its points."""
    return np.insert(x, cuts, np.nan), np.insert(y, cuts, np.nan)


def _stress_along(ax: Axes, row: pd.Series, results: Results, narrow: bool) -> None:
    """The stress on the bed over that of the undisturbed flow."""
    table = results.tables.get("wall_stress", pd.DataFrame())
    flow = row["flow_case"]
    if len(table):
        table = table[table["flow_case"] == flow]
    if len(table):
        x = table["x_m"].to_numpy(float)
        ustar = table["ustar_over_ustar0_wall"].to_numpy(float)
    else:
        grains = _grains_of(row, results)
        x = grains["x_m"].to_numpy(float)
        ustar = grains["ustar_over_ustar0"].to_numpy(float)
    stress = np.sign(ustar) * ustar**2
    ax.fill_between(x, stress, 0, where=(stress < 0).tolist(), color=LINE, lw=0)
    ax.plot(x, stress, color=FLOW, lw=1.5)
    ax.axhline(0, color=SOFT, lw=0.8)
    what = "Stress on the bed ÷ that upwind"
    long = "Stress of the flow on the bed, over that on the flat ground upwind"
    ax.set_title(what if narrow else long, color=FLOW)


def _line(
    ax: Axes, row: pd.Series, pile: Pile, results: Results, told: Quantity, narrow: bool
) -> None:
    """The bed line, with the part that has moved at the fraction of the card."""
    x, z = pile.model.line.corners.T
    low = float(z.min())
    ax.fill_between(x, z, low - 0.08 * np.ptp(z), color=SAND, lw=0)
    ax.plot(x, z, color=EDGE, lw=1)
    grains = _grains_of(row, results)
    places = grains["x_m"].to_numpy(float)
    has_moved = grains["ustar0_m_s"].to_numpy(float) <= float(row["ustar0_m_s"])
    height = np.asarray(pile.model.line.height(places), float)
    ax.plot(*_moved(places, height, has_moved), color=ANSWER, lw=3.5)
    part = f"{row['fraction']:.0%}".replace("%", " %")
    flow = single.in_unit(row, float(row["ustar0_m_s"]), told)
    told_at = f"orange: the {part} that moves by {flow:.3g} {told.unit}"
    ax.set_title("Bed line, m" if narrow else f"Bed line, m; {told_at}")
    ax.set_ylim(low - 0.08 * np.ptp(z), None)
    ax.set_xlabel("m along the bed" if narrow else "")
    ax.annotate(
        "→ flow",
        (0.01, 0.7),
        xycoords="axes fraction",
        color=FLOW,
        weight="bold",
    )


def _moved(x: Any, y: Any, has_moved: Any) -> tuple[Any, Any]:
    """A line along the places that have moved, with gaps where others lie between."""
    return x, np.where(has_moved, y, np.nan)


# one grain, and several


def _of_grains(grains: pd.DataFrame) -> Head | None:
    """Of one grain the laws and the sizes, of several the curves of a sweep."""
    if answers.is_one_grain(grains):
        return _of_grain(grains.iloc[0])
    return _sweep(grains)


def _of_grain(row: pd.Series) -> Head:
    """The threshold by every law, and by the law that answers for other sizes."""
    told = single.quantity(row)
    title = f"The {told.name} that moves the grain, by force law and by size"
    caption = (
        "By law: orange, the answer; blue discs, other laws that hold; grey rings, "
        "laws outside their range. By size: the same law, each size on its like."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = _figure(narrow, 470 if narrow else 320)
        shape = (2, 1) if narrow else (1, 2)
        axes = canvas.subplots(*shape)
        _margins(canvas, 112, 10, 24, 28)
        if narrow:
            canvas.subplots_adjust(hspace=0.28)
        else:
            canvas.subplots_adjust(wspace=0.16)
        _by_law(axes[0], row, told)
        _by_size(axes[1], row, told)
        return canvas

    return Head(draw, title, caption)


def _by_law(ax: Axes, row: pd.Series, told: Quantity) -> None:
    """A line of dots: the threshold under each law."""
    grain = SingleGrain.of_row(row.to_dict())
    found = []
    for name in LAWS:
        (at,) = thresholds_of(name, [grain])
        ustar = float(at.friction_velocity)
        value = single.in_unit(row, ustar, told)
        found.append((bool(at.valid), value, name))
    found.sort(key=lambda one: (one[0], one[1] if one[0] else -one[1]))
    asked = str(row["force_law"])
    ax.grid(visible=True, axis="y")
    for place, (holds, value, name) in enumerate(found):
        look: Look = {"ms": 6, "mew": 1.3}
        if name == asked:
            look |= {"ms": 9, "color": ANSWER}
            ax.annotate(
                f"{value:.3g}",
                (value, place),
                xytext=(0, 7),
                textcoords="offset points",
                ha="center",
                color=ANSWER,
                weight="bold",
            )
        elif holds:
            look["color"] = FLOW
        else:
            look |= {"color": NONE, "mfc": "none"}
        ax.plot([value], [place], "o", **look)
    _measured_lines(ax, row, told)
    ax.set_yticks(range(len(found)), [name for _, _, name in found])
    shown = [value for holds, value, name in found if holds or name == asked]
    measured = single.in_unit(row, single.measured_ustar(row, row["ustar0_m_s"]), told)
    least = min(*shown, measured)
    most = max(*shown, measured)
    ax.set_xlim(0.6 * least, 1.25 * most)
    ax.set_ylim(-0.6, len(found) - 0.2)
    ax.set_title(f"{told.name.capitalize()} by force law, {told.unit}", x=-0.2)


def _measured_lines(ax: Axes, row: pd.Series, told: Quantity) -> None:
    """A dashed line where the threshold was measured, and the field's range."""
    ustar = float(row["ustar0_m_s"])
    measured = single.in_unit(row, single.measured_ustar(row, ustar), told)
    ax.axvline(measured, color=INK, lw=1.4, ls=(0, (4, 2)), zorder=1)
    name = "wind tunnels" if is_gas(float(row["rho_f_kg_m3"])) else "flumes"
    look: Look = {
        "xycoords": ax.get_xaxis_transform(),
        "textcoords": "offset points",
        "va": "top",
        "fontsize": SMALL,
    }
    ax.annotate(name, (measured, 1.0), xytext=(4, 0), **look)
    if not row["measured_rows"] > 0:
        return
    ends = []
    for theta in (row["measured_low"], row["measured_high"]):
        ratio = math.sqrt(float(theta) / _measured_theta(row))
        at = single.measured_ustar(row, ustar) * ratio
        ends.append(single.in_unit(row, at, told))
    ax.axvspan(*ends, color=LINE, lw=0, zorder=0)
    sites = "field" if is_gas(float(row["rho_f_kg_m3"])) else "80 %"
    ax.annotate(sites, (ends[0], 1.0), xytext=(-4, 0), ha="right", **look)


def _measured_theta(row: pd.Series) -> float:
    """The Shields number of the measured threshold of a grain."""
    density = float(row["rho_f_kg_m3"])
    weight = (float(row["rho_sol_kg_m3"]) - density) * float(row["g_m_s2"])
    ustar = float(row["measured_level_ustar_m_s"])
    return density * ustar**2 / (weight * float(row["d_m"]))


def _by_size(ax: Axes, row: pd.Series, told: Quantity) -> None:
    """The threshold by size: by the law where it holds, and by the published curve."""
    d = np.geomspace(float(row["d_m"]) / 6, float(row["d_m"]) * 6, 61)
    law = str(row["force_law"])
    part = float(row["z0_m"]) / float(row["d_m"])
    grains = []
    for size in d.tolist():
        changed = {**row.to_dict(), "d_m": size, "z0_m": part * size}
        grains.append(SingleGrain.of_row(changed))
    found = thresholds_of(law, grains)
    computed = []
    measured = []
    for size, at, of_curve in zip(d.tolist(), found, _curve(row, d), strict=True):
        here = pd.Series({**row.to_dict(), "d_m": size, "z0_m": part * size})
        ustar = float(at.friction_velocity) if bool(at.valid) else math.nan
        computed.append(single.in_unit(here, ustar, told))
        measured.append(single.in_unit(here, float(of_curve), told))
    mm = 1e3 * d
    ax.plot(mm, computed, color=ANSWER, lw=2)
    ax.plot(mm, measured, color=INK, lw=1.2, ls=(0, (4, 2)))
    value = single.in_unit(row, float(row["ustar0_m_s"]), told)
    ax.plot([1e3 * row["d_m"]], [value], "o", color=ANSWER, ms=8, mec=GROUND)
    look: Look = {"textcoords": "offset points", "fontsize": TEXT}
    ax.annotate(
        f"this grain: {value:.3g}",
        (1e3 * row["d_m"], value),
        xytext=(-8, 8),
        ha="right",
        color=ANSWER,
        weight="bold",
        **look,
    )
    name = "wind tunnels" if is_gas(float(row["rho_f_kg_m3"])) else "flumes"
    ax.annotate(name, (mm[38], measured[38]), xytext=(8, -14), **look)
    _log_sizes(ax)
    ax.set_ylim(0, None)
    ax.set_title(f"The same for other sizes (mm), {told.unit}")


def _curve(row: pd.Series, d: Any) -> Any:
    """Friction velocity of a published curve for grains of some sizes (m), m/s."""
    density = float(row["rho_f_kg_m3"])
    solid = float(row["rho_sol_kg_m3"])
    nu = float(row["nu_m2_s"])
    g = float(row["g_m_s2"])
    if is_gas(density):
        return shao_lu(d, Air(solid, density, nu, g))
    excess = (solid / density - 1) * g
    theta = soulsby_whitehouse(d * (excess / nu**2) ** (1 / 3))
    return np.sqrt(theta * excess * d)


def _sweep(rows: pd.DataFrame) -> Head | None:
    """Thresholds over the size, or over the first other number that varies."""
    told = sheets.quantity(rows)
    column = _across(rows)
    if column is None:
        return None
    others = [name for name in labels.varying(rows, column) if name != "fraction"]
    series = _series(rows, others)
    if len(series) > MOST_SERIES or len(rows) < 2:
        return None
    info = labels.words(column)
    scale = 1e3 if info.unit == "m" else 1.0
    unit = "mm" if info.unit == "m" else info.unit
    what = f"{info.label}, {unit}".rstrip(", ")
    title = f"The {told.name} that moves each, against the {info.label}"
    caption = (
        "Orange: computed, with its interval; rings: not usable. Dashed: with the "
        "measured threshold of one grain."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = _figure(narrow, 300)
        ax = canvas.subplots()
        _margins(canvas, 40, 12 if narrow else 190, 24, 38)
        for number, (name, part) in enumerate(series):
            _draw_series(ax, part, told, column, scale, number)
            end = part.iloc[-1]
            at = (scale * end[column], end["told"])
            if name and not narrow:
                look: Look = {"textcoords": "offset points", "va": "center"}
                look |= {"color": ANSWER, "annotation_clip": False}
                ax.annotate(name, at, xytext=(8, 0), **look)
        if column == "d_m":
            _log_sizes(ax)
        ax.set_ylim(0, None)
        ax.set_xlabel(what)
        ax.set_title(f"{told.name.capitalize()} that moves it, {told.unit}")
        return canvas

    return Head(draw, title, caption)


def _across(rows: pd.DataFrame) -> str | None:
    """The column along which a sweep is drawn: the size, else a number that varies."""
    if rows["d_m"].nunique() > 1:
        return "d_m"
    for name in labels.varying(rows, "bed"):
        is_number = pd.api.types.is_numeric_dtype(rows[name])
        if is_number and rows[name].nunique() > 2:
            return name
    return None


def _series(
    rows: pd.DataFrame, others: Sequence[str]
) -> list[tuple[str, pd.DataFrame]]:
    """The parts of a sweep that agree in all but one column, with their names."""
    told = sheets.quantity(rows)
    values = [
        single.in_unit(row, float(row["ustar0_m_s"]), told)
        for _, row in rows.iterrows()
    ]
    rows = rows.assign(told=values)
    if not others:
        return [("", rows)]
    parts = []
    for _, part in rows.groupby(list(others), dropna=False, sort=False):
        parts.append((", ".join(labels.told(part.iloc[0], others)), part))
    return parts


def _draw_series(
    ax: Axes,
    part: pd.DataFrame,
    told: Quantity,
    column: str,
    scale: float,
    number: int,
) -> None:
    """A curve of a sweep: computed, with intervals and hollow points, and measured."""
    part = part.sort_values(column)
    x = scale * part[column].to_numpy(float)
    y = part["told"].to_numpy(float)
    dash = DASHES[number]
    ax.plot(x, y, color=ANSWER, lw=1.5, ls=dash)
    low = part[told.column("_low")].to_numpy(float)
    high = part[told.column("_high")].to_numpy(float)
    ax.vlines(x, low, high, color=PALE, lw=6, zorder=1)
    usable = part["usable"].to_numpy(bool)
    marker = MARKERS[number]
    ax.plot(x[usable], y[usable], marker, color=ANSWER, ms=6)
    ax.plot(x[~usable], y[~usable], marker, color=NONE, mfc=GROUND, ms=6)
    measured = [
        single.in_unit(row, single.measured_ustar(row, row["ustar0_m_s"]), told)
        for _, row in part.iterrows()
    ]
    ax.plot(x, measured, color=INK, lw=1.2, ls=(0, (4, 2)), zorder=1.5)


# below a picture of grains


def _shares(row: pd.Series, results: Results) -> Head | None:
    """The share of the counted grains that has moved, against the flow."""
    curve = results.tables.get("pile_curve", pd.DataFrame())
    if curve.empty:
        return None
    curve = curve[curve["scene_id"] == row["scene_id"]]
    told = single.quantity(row)
    flows = _in_units(row, curve["ustar0_m_s"], told)
    share = 100 * curve["fraction_moved"].to_numpy(float)
    is_known = np.isfinite(flows) & (flows > 0)
    flows = flows[is_known]
    share = share[is_known]
    ustar = curve["ustar0_m_s"].to_numpy(float)[is_known]
    measured = _in_units(row, _ratio(row) * ustar, told)
    percent = 100 * float(row["fraction"])
    at = single.in_unit(row, float(row["ustar0_m_s"]), told)
    title = f"Share of the grains that has moved against the {told.name}"
    caption = (
        f"How the share that has moved grows with the {told.name}. Dashed: with the "
        "measured threshold of one grain."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = _figure(narrow, 150)
        ax = canvas.subplots()
        _margins(canvas, 36, 10, 22, 24)
        ax.step(flows, share, where="post", color=ANSWER, lw=2)
        if not single.is_level(row):
            ax.step(measured, share, where="post", color=INK, lw=1.2, ls=(0, (4, 2)))
        ax.plot([at], [percent], "o", color=ANSWER, ms=7, mec=GROUND)
        text = f"{percent:.0f} % at {at:.3g} {told.unit}"
        look: Look = {"textcoords": "offset points", "color": ANSWER, "weight": "bold"}
        ax.annotate(text, (at, percent), xytext=(9, -9), **look)
        moved = flows[share > 0]
        least = min(float(measured[share > 0].min(initial=at)), at)
        if single.is_level(row):
            least = float(moved.min(initial=at))
        late = flows[share >= 0.999 * share.max()]
        ax.set_xlim(0.9 * least, 1.02 * float(late.min(initial=flows.max())))
        ax.set(ylim=(0, 100), yticks=(0, 50, 100))
        long = f"Share of the grains that has moved, %, against the {told.name}"
        short = f"Share moved, %, against the {told.name}"
        ax.set_title(f"{short if narrow else long}, {told.unit}")
        return canvas

    return Head(draw, title, caption)


def _sizes(row: pd.Series, results: Results) -> Head:
    """The stress that moves each size of a mixture, beside the measured hiding."""
    classes = results.joined("size_class")
    here = classes[classes["fraction"] == row["fraction"]]
    here = here[here["scene_id"] == row["scene_id"]].sort_values("size_over_d")
    density = float(row["rho_f_kg_m3"])
    excess = (float(row["rho_sol_kg_m3"]) - density) * float(row["g_m_s2"])
    weight = excess * float(row["d_m"]) * here["size_over_d"].to_numpy(float)
    value = weight * here["shields_own"].to_numpy(float)
    low = weight * here["shields_own_low"].to_numpy(float)
    high = weight * here["shields_own_high"].to_numpy(float)
    few = here["few"].to_numpy(bool)
    measured = [answers.measured_of_size(row, size) for size in here["size_over_d"]]
    names = []
    for size, count in zip(here["size_over_d"], here["count"], strict=True):
        grains = f"{count:.0f} grains" if count != 1 else "1 grain"
        names.append(f"{1e3 * float(row['d_m']) * size:.3g} mm, {grains}")
    at = density * float(row["ustar0_m_s"]) ** 2
    title = "The stress that moves each size of the mixture"
    caption = (
        "Orange: computed, with the interval that so few grains leave; rings: fewer "
        "than ten grains. Squares: Wilcock and Crowe (2003), at the measured stress of "
        "d50. An interval that reaches the frame is open."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = _figure(narrow, 60 + 26 * len(here))
        ax = canvas.subplots()
        _margins(canvas, 128, 12, 24, 24)
        top = 1.15 * np.nanmax([*value[np.isfinite(value)], *measured, at])
        places = np.arange(len(here))[::-1]
        left = np.nan_to_num(low, nan=0.0)
        right = np.nan_to_num(high, nan=2 * top)
        ax.hlines(places, left, right, color=PALE, lw=11, zorder=1)
        ax.plot(value[~few], places[~few], "o", color=ANSWER, ms=8)
        ax.plot(value[few], places[few], "o", color=ANSWER, mfc=GROUND, mew=1.6, ms=8)
        ax.plot(measured, places, "s", color=INK, ms=6)
        ax.axvline(at, color=ANSWER, lw=1, ls=(0, (2, 2)), zorder=0.5)
        ax.set_yticks(places, names)
        ax.set(xlim=(0, top), ylim=(-0.6, len(here) - 0.4))
        part = f"{row['fraction']:.0%}".replace("%", " %")
        name = f"Stress that moves {part} of a size, Pa"
        if narrow:
            ax.set_title(name, x=-0.5)
        else:
            ax.set_title(f"{name}; line: all sizes together, {at:.3g}")
        return canvas

    return Head(draw, title, caption)
