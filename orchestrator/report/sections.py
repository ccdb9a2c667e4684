"""The page of a study: its sections, in the order in which a reader needs them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from urllib.parse import quote

import pandas as pd

from orchestrator.report import answers, remarks, sheets, solved, theory, words
from orchestrator.report.by_place import places_sheet
from orchestrator.report.page import (
    Element,
    Guest,
    Limits,
    Section,
    Table,
    Text,
    page_text,
    versions,
)
from orchestrator.report.results import Results, valid
from orchestrator.report.style import Figure
from orchestrator.runs import case


def of_study(
    results: Results,
    failures: Mapping[str, str],
    guests: Sequence[Guest],
    figures: Sequence[Figure],
    faults: Sequence[str],
) -> list[Section]:
    """List the sections of the page of a study.

    Parameters
    ----------
    results
        The study with its tables.
    failures
        The cases that failed, with why.
    guests
        Others that add to the page.
    figures
        The figures in the order of the page; those that are not drawn have no image.
    faults
        A line for each figure that could not be drawn.

    Returns
    -------
    list of Section
        The sections; those of guests come below the card.
    """
    drawn = [figure for figure in figures if figure.image]
    head = [] if guests else _head(drawn)
    others = [figure for figure in drawn if figure not in head]
    names = [figure.name for figure in figures]
    found = [_answer(results, failures, guests)]
    for guest in guests:
        found += guest.sections(names)
    if head:
        found.append(Section("", head, "picture"))
    found += _thresholds(results)
    found.append(_limits(results))
    undrawn = [figure for figure in figures if not figure.image]
    found.append(_figures(others, undrawn, faults, bool(head)))
    if failures:
        text = page_text("failures", causes=failures, links=links(results))
        found.append(Section("Cases that failed", [Text(text)], "failed", "Failures"))
    found.append(_methods(results))
    found.append(_files(results))
    return found


def _head(drawn: Sequence[Figure]) -> list[Figure]:
    """The figure below the card, and the one that stands under it."""
    leading = [figure for figure in drawn if figure.place == "lead"]
    under = [figure for figure in drawn if figure.place == "under"]
    return [*leading[:1], *under[:1]]


def links(results: Results) -> dict[str, str]:
    """Find the addresses of the cases on the page.

    Returns
    -------
    dict of str to str
        The addresses of the directories that there are, by the names of the cases.
    """
    root = results.cases
    found = {}
    for name in results.plan.cases:
        if (root / name).is_dir():
            found[name] = quote(f"{root.name}/{name}/")
    return found


def _answer(
    results: Results, failures: Mapping[str, str], guests: Sequence[Guest]
) -> Section:
    """The card, and how many cases failed."""
    content: list[Element] = [words.answer_card(results, guests)]
    if failures:
        of = len(results.plan.cases)
        text = page_text("failures_at_the_head", count=len(failures), of=of)
        content.append(Text(text))
    return Section("", content, "answer")


def _thresholds(results: Results) -> Iterator[Section]:
    """The table below the card, and all thresholds of piles; none without a table."""
    # what a guest lists it has as a section of its own
    sheet = words.sheet(results)
    if sheet is None:
        return
    content: list[Element] = [sheet]
    # what is asked of hills is where their flow turns back
    every = None if answers.is_of_hills(results) else sheets.piles_sheet(results)
    if every is not None and len(every.frame) > len(sheet.frame):
        content.append(every)
    yield Section(sheet.title, content, "thresholds", "Table")
    by_place = places_sheet(results)
    if by_place is not None:
        yield Section(by_place.title, [by_place])
    short = None if answers.is_of_hills(results) else sheets.short(results)
    if short is not None and not sheet.frame.equals(short.frame):
        yield Section(short.title, [short])


def _limits(results: Results) -> Section:
    """The caveats of the answer."""
    content: list[Element] = [
        Text(page_text("remarks", remarks=remarks.remarks(results))),
        Text(page_text("counted", counts=counts(results), scenes=len(results.scenes))),
    ]
    return Section("Caveats", content, "limits", "Caveats")


def _figures(
    drawn: Sequence[Figure],
    undrawn: Sequence[Figure],
    faults: Sequence[str],
    are_further: bool,
) -> Section:
    """All figures that are not at the head of the page."""
    content: list[Element] = []
    if faults:
        content.append(
            Limits([f"A figure could not be drawn: {one}." for one in faults])
        )
    content += drawn
    if undrawn:
        content.append(Text(page_text("on_demand", figures=undrawn)))
    title = "More figures" if are_further else "Figures"
    return Section(title, content, "figures", "Figures", in_grid=True)


def _methods(results: Results) -> Section:
    """How the study was computed."""
    content: list[Element] = []
    fidelities = sheets.fidelities(results)
    if fidelities is not None:
        content += [
            Text(
                page_text(
                    "fidelities",
                    tolerance=results.study.tolerance,
                    errors=results.study.errors,
                )
            ),
            Table(fidelities, "tables/pile_threshold.csv", 3),
            Text(page_text("intervals")),
        ]
        if "check" in results.tables:
            content.append(Text(page_text("checked", checks=results.tables["check"])))
    content += _beside_measurements(results)
    content.append(Text(_left_out(results)))
    content += [
        Text(page_text("force_laws")),
        Table(sheets.force_laws(results)),
        Table(sheets.parameters(results), fold="All parameters"),
        Table(versions(programs(results)), fold="Versions of the programs"),
    ]
    return Section("How it was computed", content, "methods", "Methods")


def programs(results: Results) -> dict[str, str]:
    """Name the programs that the cases of a study were run by.

    Returns
    -------
    dict of str to str
        Their versions, by name.
    """
    return dict(case.programs(results.cases, results.plan.cases))


def _beside_measurements(results: Results) -> Iterator[Element]:
    """What single grains in water are compared with; nothing where that is nothing."""
    measured = theory.theory_section(results)
    if measured is None:
        return
    file = "tables/single_grain.csv"
    yield Text(page_text("measured", measured=measured))
    best, every = measured["best"], measured["every"]
    if len(best) <= theory.MANY:
        yield Table(best, file)
    if len(every) > len(best):
        yield Table(every, file, fold=f"All {len(every)} combinations")


def _left_out(results: Results) -> Any:
    """What the models leave out."""
    scenes = results.scenes
    mixtures = [pile.scene.grain.sizes for pile in results.plan.piles.values()]
    eq10 = None
    if results.flows:
        eq10 = solved.eq10_over_wall(results, tuple(results.flows))
    return page_text(
        "left_out",
        paper_pair=scenes["force_law"].isin(theory.PAIR).any(),
        eq10=eq10,
        methods=set(scenes["method"]),
        mixed=any(sizes is not None for sizes in mixtures),
        strips=scenes["width"].any(),
    )


def _files(results: Results) -> Section:
    """The files beside the page, and how a case is run by hand."""
    last = ["NAME", *links(results)][-1]
    content: list[Element] = [
        Text(page_text("files", results=results, case=last)),
        Text(page_text("study_file", text=results.study.text), "Study file"),
    ]
    return Section("Files", content, "files", "Files")


def counts(results: Results) -> dict[str, Any]:
    """Count what a reader must know before using this study's results.

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
