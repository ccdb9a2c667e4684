"""The chart of a ladder: cost against the share of thresholds within an error."""

import json
import math
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from orchestrator.digits import number
from orchestrator.experiment import label, page_texts
from orchestrator.lab.choices import (
    AIM,
    OPEN,
    REFERENCES,
    WITHIN,
    WRITTEN,
    Choice,
    Kind,
    column,
    column_of_reference,
    front,
)
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import Element, Lines, Paragraphs, Section, Table
from orchestrator.report.style import Figure, Look
from orchestrator.study.fidelities import Fields

Place = tuple[float, float]
"""A cost and a share."""
SHARE = 0.95
"""Share of them that is to be within it."""
LOOKS: Mapping[str, Look] = {
    "pivot": {"marker": "o", "color": "#009e73", "ms": 9},
    "peeling": {"marker": "s", "color": "#d55e00", "ms": 6},
    "DEM": {"marker": "^", "color": "#0072b2", "ms": 7},
    "": {"marker": "D", "mec": style.INK, "mfc": "none", "mew": 1.3, "ms": 11},
}
"""Marker and colour by how the grains are moved; the last is of the study itself."""
KNOWN: Look = {"ls": "--", "color": "0.3", "lw": 1.2}
"""Line of the share at which the reference itself is known within an error."""
OF_REFERENCE = "reference itself known within it"
OTHER = "the study itself"
"""What the legend calls the choices of a study, which differ from scene to scene."""
BESIDE = tuple(one for one in WITHIN if one != AIM)
"""The other errors, a panel for each."""
PANEL, LANE = 1.6, 0.2
"""Heights of the points of a panel and of the line of a name, inches."""
MOST_LOW = 80.0
"""Share below which a panel begins at least, so that its axis has two numbers, %."""
LETTERS_OF_NAME = 5.2
"""Letters of a name that a panel has room for, for each inch of its figure."""


TEXTS = page_texts(__file__, "choices")
"""What the page says of the choices."""


def _percent(part: float) -> str:
    return f"{100 * part:.0f} %"


def recommended(rows: pd.DataFrame) -> pd.Series:
    """Choose what a study should do.

    Parameters
    ----------
    rows
        The choices of a kind, by `choices.shares`.

    Returns
    -------
    Series
        The row of the cheapest choice with a share of `SHARE` of its thresholds within
        `AIM`; where only the reference has it, the reference.
    """
    good = rows[rows[column(AIM)] >= SHARE]
    return good.sort_values("core_s", kind="stable").iloc[0]


def sections(found: Sequence[Kind], table: pd.DataFrame, study: str) -> list[Section]:
    """Write the sections of the page: for each kind a card, its chart, what to write.

    Parameters
    ----------
    found
        The kinds.
    table
        The shares, by `choices.shares`.
    study
        The study file, as a command names it.

    Returns
    -------
    list of Section
        A section for each kind that was compared.
    """
    made = []
    for place, kind in enumerate(found):
        rows = table[table["kind"] == kind.name] if len(table) else table
        if rows.empty:
            continue
        name = f"share-{place + 1}" if len(found) > 1 else "share"
        title = f"Thresholds within {_percent(AIM)} against cost"
        content: list[Element] = [
            _card(rows),
            Figure.of_both_widths(
                name, title, TEXTS["caption"], partial(draw, rows, [AIM])
            ),
            Paragraphs(_reference(rows)),
            Lines("\n".join(advice(kind, rows, study))),
            Figure.of_both_widths(
                f"{name}-within",
                "Thresholds within other errors",
                TEXTS["caption"],
                partial(draw, rows, BESIDE),
            ),
            Table.of(_listed(rows)),
        ]
        made.append(Section(kind.name if len(found) > 1 else "", content))
    return made


def _reference(rows: pd.DataFrame) -> str:
    """Say at which share of the thresholds the reference itself is known."""
    first = rows.iloc[0]
    within, most = (first[column_of_reference(each)] for each in (AIM, WITHIN[-1]))
    text = (
        f"The reference is known within {_percent(AIM)} for {_percent(within)} of the "
        f"thresholds, and within {_percent(WITHIN[-1])} for {_percent(most)}."
    )
    if within < 1:
        text += " For the others a choice that agrees with it is known no better."
    return text


def _share_text(row: pd.Series) -> str:
    """The share of a choice's thresholds that are near the reference, in words."""
    thresholds = number(int(row["thresholds"]), "threshold")
    return f"{_percent(row[column(AIM)])} of {thresholds} within {_percent(AIM)}"


def _listed(rows: pd.DataFrame) -> pd.DataFrame:
    """The choices of a kind, by cost, with heads for a page."""
    shown = rows.sort_values("core_s", kind="stable")
    columns: dict[str, Any] = {"choice": shown["choice"], "core-s": shown["core_s"]}
    for within in WITHIN:
        columns[f"within {_percent(within)}, %"] = 100 * shown[column(within)]
    columns["largest error, %"] = 100 * shown["largest"]
    return pd.DataFrame(columns)


def _card(rows: pd.DataFrame) -> Card:
    """The answer card of a kind."""
    best = recommended(rows)
    thresholds = number(int(best["thresholds"]), "threshold")
    shown = [(f": {best['choice']}", best)]
    for name in (WRITTEN, REFERENCES):
        shown += [
            (f", {name}", row) for _, row in rows[rows["choice"] == name].iterrows()
        ]
    numbers = []
    for name, row in shown:
        meaning = f"of one core{name}"
        numbers.append(Number(float(row["core_s"]), "s", meaning, _share_text(row)))
    worth = Worth("good", "usable", TEXTS["advice"])
    if best["choice"] == REFERENCES:
        worth = Worth(
            "care", f"only the reference has {_percent(SHARE)} within", TEXTS["advice"]
        )
    scenes = number(int(best["scenes"]), "pile")
    return Card(
        "How much computing time do these thresholds need?",
        f"{best['kind']}: {scenes}, {thresholds}, by {len(rows)} choices",
        tuple(numbers),
        TEXTS["source"],
        worth,
    )


def advice(kind: Kind, rows: pd.DataFrame, study: str) -> list[str]:
    """Write what a study file has to say for the choice that is recommended.

    Parameters
    ----------
    kind
        The kind.
    rows
        Its choices, by `choices.shares`.
    study
        The study file, as a command names it.

    Returns
    -------
    list of str
        Lines of a study file, or the command that answers it.
    """
    best = recommended(rows)
    share = _share_text(best)
    head = f"# {kind.name}: {share} of the reference, {best['core_s']:.2g} core-s"
    if best["choice"] == REFERENCES:
        return [head, *_blocks(kind.reference)]
    choice = next(one for one in kind.choices if one.name == best["choice"])
    if choice.fields:
        return [head, *_blocks(choice)]
    if not math.isnan(choice.tolerance):
        return [head, f"orchestrator study {study} --tolerance {choice.tolerance:g}"]
    if choice.name == OPEN:
        return [head, "[method]", 'kind = "auto"']
    return [head, f"orchestrator study {study}"]


def _blocks(choice: Choice) -> list[str]:
    """The table `method` of a study file; several where scenes differ in it."""
    blocks: dict[str, list[str]] = {}
    for answer, fields in zip(choice.answers, choice.fields, strict=True):
        blocks.setdefault("\n".join(_method(fields)), []).append(label(answer.asked))
    lines = []
    for text, scenes in blocks.items():
        if len(blocks) > 1:
            lines += [f"# for {scene}" for scene in scenes]
        lines += text.splitlines()
    return lines


def _method(fields: Fields) -> list[str]:
    """The lines of a table `method`."""
    tables: dict[str, dict[str, Any]] = {}
    for name, value in fields.items():
        table, _, key = name.rpartition(".")
        tables.setdefault(table, {})[key] = value
    lines = []
    for table in sorted(tables):
        lines.append(f"[{table}]")
        for key, value in tables[table].items():
            lines.append(f"{key} = {json.dumps(value)}")
    return lines


def draw(
    rows: pd.DataFrame, within: Sequence[float], width: float = style.NARROW
) -> Canvas:
    """Draw the share of thresholds within some errors against cost.

    Parameters
    ----------
    rows
        The choices of a kind, by `choices.shares`.
    within
        The errors, a panel for each. Of a single one the choices of the study itself
        and the reference are named, too.
    width
        Width of the drawing, inches.

    Returns
    -------
    Figure
        The chart.
    """
    is_narrow = width < style.WIDE
    fits = int(LETTERS_OF_NAME * width)
    named = []
    for error in within:
        names = _named(rows, error, own=len(within) == 1)
        named.append({at: textwrap.fill(name, fits) for at, name in names.items()})
    heights = [PANEL + LANE * _lines(each) for each in named]
    above = 1.4 if is_narrow else 1.0
    canvas = style.canvas(above + sum(heights), width)
    panels = canvas.subplots(
        len(within), 1, sharex=True, squeeze=False, height_ratios=heights
    ).ravel()
    for ax, error, labels in zip(panels, within, named, strict=True):
        _panel(ax, rows, error, labels)
    panels[-1].set_xlabel("cost, core-s")
    samples = []
    for name, look in LOOKS.items():
        if (rows["grains"] == name).any():
            samples.append(Line2D([], [], label=name or OTHER, ls="", **look))
    samples.append(Line2D([], [], label=OF_REFERENCE, **KNOWN))
    canvas.legend(
        handles=samples, loc="outside upper left", ncols=2 if is_narrow else 5
    )
    return canvas


def _lines(labels: Mapping[Place, str]) -> int:
    """How many lines some names have together."""
    return sum(name.count("\n") + 1 for name in labels.values())


def _named(rows: pd.DataFrame, within: float, *, own: bool) -> dict[Place, str]:
    """The names of the choices that are labelled, by their cost and their share."""
    is_named = front(rows, within)
    if own:
        is_named |= (rows["grains"] == "") | (rows["choice"] == REFERENCES)
    names: dict[Place, list[str]] = {}
    for row in rows[is_named].to_dict("records"):
        place = (row["core_s"], 100 * row[column(within)])
        names.setdefault(place, []).append(row["choice"])
    return {place: _joined(names[place]) for place in sorted(names)}


def _panel(
    ax: Axes, rows: pd.DataFrame, within: float, labels: Mapping[Place, str]
) -> None:
    """Draw the share within one error, and name some choices above the points."""
    share = 100 * rows[column(within)]
    for name, look in LOOKS.items():
        of_name = rows["grains"] == name
        points = (rows.loc[of_name, "core_s"], share[of_name])
        ax.plot(*points, ls="", gid="points", label=name, **look)
    edge = rows.assign(share=share)[front(rows, within)].sort_values("core_s")
    ax.step(edge["core_s"], edge["share"], where="post", color="0.45", lw=0.9, zorder=1)
    known = 100 * rows[column_of_reference(within)].iloc[0]
    ax.axhline(known, gid="reference", zorder=1, **KNOWN)
    ax.set_xscale("log")
    ax.margins(x=0.08)
    style.plain_ticks(ax.xaxis)
    ax.set_ylabel(f"% within {_percent(within)}")
    low = 20 * math.floor(min(share.min(), known, MOST_LOW) / 20) - 5
    ax.set_ylim(low, 105 + (105 - low) * LANE * _lines(labels) / PANEL)
    ax.set_yticks(range(low + 5, 101, 20))
    _name(ax, labels, (105 - low) * LANE / PANEL)


def _name(ax: Axes, labels: Mapping[Place, str], lane: float) -> None:
    """Write each name on a line of its own above the points, and lead it to its point.

    Names of cheap choices begin at their cost, those of dear ones end there.
    """
    halo = [Stroke(linewidth=2.5, foreground="white"), Normal()]
    middle = math.exp(np.log(ax.get_xlim()).mean())
    cheap = [place for place in labels if place[0] < middle]
    dear = [place for place in labels if place[0] >= middle]
    # no line leads through a name of its own half
    top = 105 + lane * _lines(labels)
    for cost_s, share in (*cheap, *dear[::-1]):
        name = labels[cost_s, share]
        high = lane * (name.count("\n") + 1)
        y = top - high / 2
        top -= high
        ax.plot([cost_s, cost_s], [share, y], color="0.6", lw=0.7, zorder=0)
        ax.text(
            cost_s,
            y,
            name,
            ha="left" if cost_s < middle else "right",
            va="center",
            linespacing=1.0,
            path_effects=halo,
        )


def _joined(names: Sequence[str]) -> str:
    """The names of choices at one place, with the word of a tolerance once."""
    tolerances = [name for name in names if name.startswith("tolerance ")]
    others = [name for name in names if name not in tolerances]
    values = [name.removeprefix("tolerance ") for name in tolerances]
    if values:
        others.append(f"tolerance {', '.join(values)}")
    return ", ".join(others)
