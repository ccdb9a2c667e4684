"""Hills over which others measured the flow: computed beside measured."""

from collections.abc import Iterator
from functools import partial
from typing import Any, get_args

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import labels, style
from orchestrator.report.figures import FigureKind, profiles
from orchestrator.report.page import filled
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.solved import USTAR
from orchestrator.report.style import Figure, Look
from orchestrator.study.method import Turbulence

LOOKS: dict[str, Look] = dict(zip(get_args(Turbulence), profiles.LOOKS, strict=True))
"""Looks of the turbulence models."""
Hills = list[tuple[float, pd.DataFrame]]
"""The half length of each hill in its heights, and its rows of ``flow``."""
BEHIND = 9.0
"""How far behind the crest reversed flow is drawn, h."""
BAR = 0.17
"""Distance of the bars of a hill, of that of two hills."""
CAPTION = """\
The turbulence models agree to the crest and differ behind it. Above: mean speed U over
the hill of half-length {{ steepest }} h, downstream positive; grey dots: the
logarithmic law of the approaching flow. Below: where the flow at the bed is reversed,
from separation to reattachment, behind each hill; black: where it ended in the wind
tunnel{{ note }}."""
OF_STRESS = """\
The computed bed shear stress rises to the crest and falls behind it. Signed friction
velocity of the wall shear stress over that upstream, u*₀, along each hill; below zero
the flow at the bed is reversed. The stress on the bed was not measured."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw hills over which others measured the flow: computed beside measured.

    Yields
    ------
    Figure
        Profiles over the steepest hill with the reversed flow behind all of them, and
        the stress along them; none without such hills.
    """
    hills = list(measured_hills(results))
    if not hills:
        return
    flows = pd.concat([rows for _, rows in hills])
    cases = tuple(flows["flow_case"])
    note = "" if flows["measured_verified"].all() else ", not read in its source"
    text = filled(CAPTION, steepest=f"{hills[0][0]:g}", note=note)
    title = "Mean speed against height, and reversed flow behind each hill"
    wide, narrow = (
        partial(_speeds, results, hills, width) for width in (style.WIDE, style.NARROW)
    )
    yield Figure("hills", title, text, cases, wide, place="lead", narrow=narrow)
    title = f"{USTAR} along each hill"
    wide, narrow = (
        partial(_stresses, results, hills, width)
        for width in (style.WIDE, style.NARROW)
    )
    text = filled(OF_STRESS)
    yield Figure("hills-stress", title, text, cases, wide, narrow=narrow)


def _speeds(results: Results, hills: Hills, width: float) -> Canvas:
    """Profiles over the steepest hill above the reversed flow behind all of them."""
    _, rows = hills[0]
    is_wide = width > style.NARROW
    titles = _titles(results, str(rows["flow_case"].iloc[0]))
    table = results.tables["speed_profile"]
    figure = style.canvas(5.8 if is_wide else 6.4, width)
    parts: Any = figure.subfigures(2, 1, height_ratios=[3, 2.4])
    above, below = parts
    axes = list(above.subplots(1, len(titles), sharex=True, sharey=True))
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title if is_wide else title.replace(", ", "\n"), loc="left")
    for _, row in rows.iterrows():
        of_flow = table[table["flow_case"] == row["flow_case"]]
        profiles.draw_profiles(axes, of_flow, 1.0, _look(row))
    profiles.draw_law(axes, of_flow, 1.0)
    profiles.finish(axes, profiles.SHOWN_TO)
    axes[0].set_ylabel("height above the bed, h")
    ax = below.subplots()
    _reversed(ax, hills)
    handles = style.samples(axes)
    figure.legend(
        handles=handles, loc="outside lower center", ncols=3 if is_wide else 2
    )
    return figure


def _titles(results: Results, flow_case: str) -> list[str]:
    """The places of the profiles of a flow, with where they are."""
    line = results.flows[flow_case].model.line
    table = results.tables["speed_profile"]
    rows = table[table["flow_case"] == flow_case].drop_duplicates("profile_at")
    along = rows.set_index("profile_at")["x_m"]
    titles = []
    for place in profiles.PLACES:
        x = round((float(along[place]) - line.crest[0]) / line.h, 1) + 0.0
        titles.append(f"{place}, x = {x:g} h".replace("-", "−"))
    return titles


def _look(row: pd.Series) -> Look:
    """The look of the turbulence model of a flow, with its name."""
    name = str(row["turbulence_model"])
    return {**LOOKS[name], "label": labels.value("turbulence_model", name)}


def _reversed(ax: Axes, hills: Hills) -> None:
    """A bar for each model where the flow behind a hill is reversed."""
    for level, (half_length, rows) in enumerate(hills):
        for place, (_, row) in enumerate(rows.iterrows()):
            ends = [row["separation_over_h"], row["reattachment_over_h"]]
            at = level - 0.12 + BAR * place
            ax.plot(ends, [at, at], gid="reversed flow", **_flat(_look(row)))
        end = rows["measured_reattachment_over_h"].iloc[0]
        if end > 0:
            marked: Look = {"color": "black", "lw": 2.2, "gid": "measured"}
            ax.plot([end, end], [level - 0.25, level + 0.5], **marked)
        is_computed = rows["reattachment_over_h"].notna().any()
        said = _said(float(end), is_computed=bool(is_computed))
        text = f"half-length {half_length:g} h; {said}"
        ax.text(0.0, level - 0.37, text, va="center", gid="hill")
    ax.set(xlim=(-0.2, BEHIND), ylim=(len(hills) - 0.4, -0.6), yticks=[])
    ax.set_xlabel("distance behind the crest, h")


def _said(end: float, *, is_computed: bool) -> str:
    """How far the flow behind a hill was reversed, in words."""
    if end > 0:
        return f"measured: to {end:g} h"
    return "measured: none" if is_computed else "measured and computed: none"


def _flat(look: Look) -> Look:
    """The look of a bar: its ends are those of the flow."""
    return {**look, "lw": 3.5, "solid_capstyle": "butt", "dash_capstyle": "butt"}


def _stresses(results: Results, hills: Hills, width: float) -> Canvas:
    """The stress along each hill, by turbulence model."""
    titles = [f"half-length {half_length:g} h" for half_length, _ in hills]
    is_wide = width > style.NARROW
    x = "distance from the crest, h"
    columns = len(hills) if is_wide else 1
    figure, axes = style.grid(titles, 2.4, x, USTAR, columns, width=width)
    table = results.tables["wall_stress"]
    for ax, (_, rows) in zip(axes, hills, strict=True):
        for _, row in rows.iterrows():
            stress = table[table["flow_case"] == row["flow_case"]]
            line = results.flows[row["flow_case"]].model.line
            along = (stress["x_m"].to_numpy(float) - line.crest[0]) / line.h
            ustar = stress["ustar_over_ustar0_wall"]
            ax.plot(along, ustar, gid="stress", **_look(row))
        ax.axhline(0, color="0.4", lw=0.6)
    axes[0].set_xlim(-9, 13)
    style.legends_below(figure, [], style.samples(axes))
    return figure


FIGURE = FigureKind(
    order=30,
    draws=draw,
    needs=("flow", "speed_profile"),
    uses=("wall_stress",),
)
