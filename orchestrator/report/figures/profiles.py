"""Speed against height over toe, crest and lee of beds whose flow is solved."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.grains.pile import Pile
from orchestrator.report import labels, solved, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.style import ANSWER, NONE, OTHERS, Figure, Look
from orchestrator.study import fields

PLACES = ("toe", "crest", "lee")
"""The places of the panels, as the table calls them."""
SHOWN_TO = 2.0
"""Height over the bed up to which speeds are drawn, h."""
SPEED = "U/Uₑ, Uₑ upstream at 10 h"
LOOKS: tuple[Look, ...] = ({"color": ANSWER, "ls": "-", "lw": 1.8}, *OTHERS)
"""Looks of the lines of flows."""
LAW: Look = {
    "label": "logarithmic law, upstream",
    "color": NONE,
    "lw": 0.9,
    "ls": (0, (1, 1)),
    "gid": "log law",
    "zorder": 1,
}
ALIKE = 2e-3
"""Difference of two laws, over the speed at 10 h, that a drawing does not show."""
CAPTION = """\
{{ "The crest speeds the flow up near the bed, and the lee shelters it." if sheltered
else "The flow near the bed differs from that upstream." }} Mean speed U of the computed
flow, downstream positive, against the height above the bed{{ several }}. Grey dots: the
logarithmic law of the approaching flow. Heights start at the first cells."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw the speeds over each kind of bed, at its least z0.

    Yields
    ------
    Figure
        The figures, of which those of further beds are folded; none of hills, which
        have their own.
    """
    table = results.tables["speed_profile"]
    over = set(table.loc[table["profile_at"] == "crest", "flow_case"])
    kinds = solved.piles_by_kind(results)
    piles = [kind[0] for kind in kinds if kind[0].flow.name in over]
    if any(True for _ in measured_hills(results)):
        return
    for name, title, shown in style.pages(piles):
        names = tuple(dict.fromkeys(pile.flow.name for pile in shown))
        wide, narrow = (
            partial(_draw, results, shown, width)
            for width in (style.WIDE, style.NARROW)
        )
        several = ", for each bed" if len(shown) > 1 else ""
        rows = table[table["flow_case"].isin(names)]
        yield Figure(
            f"profiles{name}",
            f"Mean speed against height at toe, crest and lee{title}",
            filled(CAPTION, several=several, sheltered=speeds_up(rows)),
            names,
            wide,
            place="folded" if name else "",
            narrow=narrow,
        )


def speeds_up(rows: pd.DataFrame) -> bool:
    """Say whether each flow is faster than upstream at the crest, slower in the lee.

    Parameters
    ----------
    rows
        Rows of the table ``speed_profile``.

    Returns
    -------
    bool
        Whether the lowest speeds are.
    """
    lowest = rows.sort_values("height_over_h").groupby(["flow_case", "profile_at"])
    speed = lowest["u_over_u_e"].first().unstack()
    faster = speed["crest"] > speed["upstream"]
    return bool((faster & (speed["lee"] < speed["upstream"])).all())


def _draw(results: Results, piles: Sequence[Pile], width: float) -> Canvas:
    """A panel for each place, with a line for each flow."""
    figure, axes = style.grid(PLACES, 2.6, "", "", len(PLACES), width=width)
    names = _names(results, piles)
    heights = {pile.bed.height for pile in piles}
    is_one = np.ptp([*heights]) < 1e-6 * max(heights)
    unit = solved.LengthUnit.of(piles[0]) if is_one else solved.OVER_H
    table = results.tables["speed_profile"]
    drawn: list[pd.DataFrame] = []
    for pile, name, look in zip(piles, names, LOOKS, strict=False):
        rows = table[table["flow_case"] == pile.flow.name]
        scale = unit.of_height(pile)
        draw_profiles(axes, rows, scale, {**look, "label": name})
        if not any(_is_alike(rows, other) for other in drawn):
            draw_law(axes, rows, scale)
            drawn.append(rows)
    finish(axes, SHOWN_TO * min(unit.of_height(pile) for pile in piles))
    axes[0].set_ylabel(f"height above the bed, {unit.name}")
    style.legends_below(figure, [], style.samples(axes))
    return figure


def draw_profiles(
    axes: Sequence[Axes], rows: pd.DataFrame, scale: float, look: Look
) -> None:
    """Draw the speeds of one flow over the places.

    Parameters
    ----------
    axes
        A panel for each of `PLACES`.
    rows
        The rows of ``speed_profile`` of the flow.
    scale
        The height h of the form in the unit of the panels.
    look
        The look of its line.
    """
    for ax, place in zip(axes, PLACES, strict=True):
        at = rows[rows["profile_at"] == place]
        ax.plot(at["u_over_u_e"], scale * at["height_over_h"], gid="speed", **look)


def draw_law(axes: Sequence[Axes], rows: pd.DataFrame, scale: float) -> None:
    """Draw the logarithmic law of the flow that approaches, in each panel.

    Parameters
    ----------
    axes, rows, scale
        As of `draw_profiles`.
    """
    law = rows[rows["profile_at"] == "upstream"]
    for ax in axes:
        ax.plot(law["u_over_u_e_log_law"], scale * law["height_over_h"], **LAW)


def finish(axes: Sequence[Axes], top: float) -> None:
    """Set the limits of the panels, and name their common x.

    Parameters
    ----------
    axes
        The panels.
    top
        The largest height.
    """
    speeds = [
        np.asarray(line.get_xdata(), float)[np.asarray(line.get_ydata()) <= top]
        for ax in axes
        for line in ax.lines
    ]
    every = np.concatenate(speeds)
    axes[0].set(ylim=(0, top), xlim=(min(0.0, every.min()) - 0.04, every.max() + 0.04))
    for ax in axes:
        ax.axvline(0, color="0.4", lw=0.6, gid="rest")
    axes[len(axes) // 2].set_xlabel(SPEED)


def _is_alike(rows: pd.DataFrame, other: pd.DataFrame) -> bool:
    """Whether the laws of two flows look the same."""
    laws = [
        each[each["profile_at"] == "upstream"].sort_values("height_over_h")
        for each in (rows, other)
    ]
    first, second = (law["u_over_u_e_log_law"].to_numpy(float) for law in laws)
    at = [law["height_over_h"].to_numpy(float) for law in laws]
    return bool(np.abs(np.interp(at[0], at[1], second) - first).max() < ALIKE)


def _names(results: Results, piles: Sequence[Pile]) -> list[str]:
    """What each flow is called: by what differs among them."""
    if len(piles) == 1:
        return ["computed flow"]
    columns = ["alpha_deg", "h_m", "z0_m", *solved.varied(results)]
    values = pd.DataFrame(
        [[fields.COLUMNS[name].used(pile.scene) for name in columns] for pile in piles],
        columns=columns,
        dtype=object,
    )
    varied = [name for name in columns if values[name].astype(str).nunique() > 1]
    return [labels.panel(row, varied) for _, row in values.iterrows()]


FIGURE = FigureKind(order=155, draws=draw, needs=("speed_profile",))
