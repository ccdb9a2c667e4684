"""What a page and a terminal say: the card, its table, remarks, and all other words."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.report import answers, remarks, sheets, theory
from orchestrator.report.card import Card, remark_lines
from orchestrator.report.card import lines as card_lines
from orchestrator.report.page import Guest, versions
from orchestrator.report.results import Results, valid
from orchestrator.report.sheets import Sheet
from orchestrator.runs import case
from orchestrator.tables import COLUMNS

MOST_LETTERS = 46
"""Letters of a column in a terminal; longer cells stand on several lines."""


def text(results: Results, guests: Sequence[Guest] = ()) -> str:
    """Write the answer card, its table and what qualifies it, for a terminal.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card in place of the study's own.

    Returns
    -------
    str
        The lines.

    Raises
    ------
    OrchestratorError
        If the tables lack columns, as those of another version do.
    """
    try:
        answered = card(results, guests)
        table = sheet(results, guests)
        qualified = remarks.remarks(results)
    except KeyError as error:
        lacking = _columns_in(error)
        if not lacking:
            raise  # a fault of this program, which says where it is
        listed = ", ".join(lacking)
        what = f"its tables lack {listed}: another version of this program wrote them"
        where = str(results.cases.parent)
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(what, where, remedy) from None
    said = [*card_lines(answered)]
    if table is not None:
        said += ["", *sheet_lines(table)]
    if qualified:
        said += ["", *remark_lines(qualified)]
    return "\n".join(said)


def _columns_in(error: KeyError) -> list[str]:
    """The columns of tables that were looked up in vain; none of any other key."""
    key = error.args[0] if error.args else None
    if key in COLUMNS:
        return [str(key)]
    # of several columns pandas makes one text
    return [column for column in COLUMNS if repr(column) in str(key)]


def card(results: Results, guests: Sequence[Guest] = ()) -> Card:
    """Choose the card of a study: that of a guest, or its own.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card.

    Returns
    -------
    Card
        The card.
    """
    for guest in guests:
        if guest.card is not None:
            return guest.card
    return answers.card(results)


def sheet(results: Results, guests: Sequence[Guest] = ()) -> Sheet | None:
    """Choose the table below the card: of a guest, of laws, of sizes, of thresholds.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a table.

    Returns
    -------
    Sheet or None
        The table; None without thresholds.
    """
    for guest in guests:
        if guest.sheet is not None:
            return guest.sheet
    if answers.is_of_hills(results):
        return sheets.hills(results)
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        frame = theory.sheet(best)
        title = "The best entrainment angle and z₀ of each force law"
        return Sheet(title, frame, file="tables/single_grain.csv")
    return sheets.sizes(results) or sheets.short(results)


def sheet_lines(table: Sheet) -> Iterator[str]:
    """Write a table for a terminal.

    Parameters
    ----------
    table
        The table.

    Yields
    ------
    str
        What its rows share, the rows, and its terms.
    """
    if table.shared:
        yield f"all rows: {', '.join(table.shared)}"
    yield from _as_lines(table.frame)
    if table.terms:
        yield ""
    for term in table.terms:
        yield term[:1].upper() + term[1:] + "."


def _as_lines(table: pd.DataFrame) -> Iterator[str]:
    """The lines of a table of texts, whose columns stand below each other.

    Heads and cells that are long stand on several lines.
    """
    heads = [str(name) for name in table]
    rows = table.to_numpy(str).tolist()
    widths = []
    for head, column in zip(heads, zip(*rows, strict=True), strict=True):
        longest = max(map(len, column))
        words_ = max(map(len, head.split()))
        widths.append(min(max(longest, words_), MOST_LETTERS))
    for cells in (heads, *rows):
        parts = [
            textwrap.wrap(cell, width) or [""]
            for cell, width in zip(cells, widths, strict=True)
        ]
        for line in zip_longest(*parts, fillvalue=""):
            yield "  ".join(map(str.ljust, line, widths)).rstrip()


def flow_at(row: pd.Series, ustar: float) -> str:
    """Write a friction velocity with speeds that are measured.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    ustar
        Undisturbed friction velocity, m/s.

    Returns
    -------
    str
        The velocity with the speeds of the wind, or with that of a channel.
    """
    depth = float(row["depth_m"] or np.nan)
    speeds = measurable_speeds(
        ustar,
        roughness=row["z0_m"],
        fluid_density=row["rho_f_kg_m3"],
        viscosity=row["nu_m2_s"],
        depth=depth,
        closed=row["flow_top"] == "closed channel",
    )
    told = []
    for column, label in sheets.SPEEDS.items():
        if speeds[column] > 0:
            told.append(f"{label} {speeds[column]:#.3g} m/s")
    if depth > 0:
        told.append(f"depth {depth:g} m")
    velocity = f"u*₀ = {ustar:#.3g} m/s"
    return f"{velocity} ({', '.join(told)})" if told else velocity


def counts(results: Results) -> dict[str, Any]:
    """Count what a reader must know before using this study's results.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    dict of str to object
        Counts by the names that the page's template has for them; 0 is no remark.
    """
    scenes = results.scenes
    thresholds = results.joined("pile_threshold")
    outside = scenes[~valid(scenes)]
    is_paper = outside["force_law"].isin(theory.PAIR)
    told: dict[str, Any] = {
        "outside": len(outside),
        "transition": (is_paper & (outside["regime"] == "transition")).sum(),
        "thresholds": len(thresholds),
        "unreached": 0,
    }
    if len(thresholds):
        told["unreached"] = thresholds["shields"].isna().sum()
    lost = ("carried_off", "fallen_upstream")
    curve = results.tables.get("pile_curve", pd.DataFrame())
    of_piles = curve.reindex(columns=["scene_id", *lost]).groupby("scene_id").max()
    for name in lost:
        most = of_piles[name]
        told[name] = ((most > 0).sum(), most.max())
    return told


def contents(
    results: Results, failures: Mapping[str, str], guests: Sequence[Guest] = ()
) -> dict[str, Any]:
    """Collect the words and numbers of the page beside its figures.

    Parameters
    ----------
    results
        The study with its tables.
    failures
        The cases that failed, with why.
    guests
        Others that add to the page.

    Returns
    -------
    dict of str to object
        By the names of the page's template.
    """
    from orchestrator.report import flows  # imports what draws

    root = results.cases
    cases = results.plan.cases
    links = {}
    for name in cases:
        if (root / name).is_dir():
            links[name] = quote(f"{root.name}/{name}/")
    scenes = results.scenes
    mixtures = [pile.scene.grain.sizes for pile in results.plan.piles.values()]
    eq10 = None
    if results.flows:
        eq10 = flows.eq10_over_wall(results, tuple(results.flows))
    has_strips = scenes["width"].any()
    # what a guest lists it has as a section of its own
    first = sheet(results)
    short = None if answers.is_of_hills(results) else sheets.short(results)
    is_same = first is None or short is None or first.frame.equals(short.frame)
    return {
        "card": card(results, guests),
        "sheet": first,
        "remarks": remarks.remarks(results),
        "further": None if is_same else short,
        "piles": sheets.piles(results),
        "fidelities": sheets.fidelities(results),
        "counts": counts(results),
        "force_laws": sheets.force_laws(results),
        "parameters": sheets.parameters(results),
        "results": results,
        "title": results.study.title,
        "measured": theory.section(results),
        "programs": versions(case.programs(root, cases)),
        "failures": failures,
        "links": links,
        "paper_pair": scenes["force_law"].isin(theory.PAIR).any(),
        "eq10": eq10,
        "methods": set(scenes["method"]),
        "mixed": any(sizes is not None for sizes in mixtures),
        "strips": has_strips,
    }
