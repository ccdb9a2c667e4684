"""Maps of failure: where in a plane of two parameters a run is good, and where not.

A run that fails gives its own verdict. Another answer is wrong where it differs by more
than `WRONG` from the reference of its place.
"""

import math
import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch, Rectangle

from orchestrator import plan
from orchestrator.digits import percent
from orchestrator.experiment import Experiment, ExperimentResults, Runs
from orchestrator.fidelity.decision import as_written
from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion
from orchestrator.lab import told
from orchestrator.lab.map_file import FOLDER, Place, StabilityMap, read_map
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import Limits, Paragraphs, Section, Table
from orchestrator.report.style import Figure
from orchestrator.runs import case
from orchestrator.study.scene import Scene
from orchestrator.types import Row

TITLE = "Where each method fails"
MAPS_TEXT = """\
Each cell is a run. It is good where the critical stress is within 5 % of its \
reference at every fraction. It is noisy, exploded or stalled where the run reports \
so, and wrong where the error is larger and the run reports nothing."""
CAPTION = """\
The worst verdict at each place, and where a number is below it the relative error of \
the critical Shields number."""
WHOLE_CAPTION = """\
The worst verdict at each place of every map. The errors stand on the map of each \
below."""
TOLD_TITLE = "What a study reports of the wrong runs"
TOLD_TEXT = """\
A wrong run looks like a good one; the study tells them apart. It refuses or warns of \
a field that the map varies, or it knows no numerical error for such a scene, so that \
the threshold is not usable, or its interval contains the reference. Where a map \
compares two different beds, no run is at fault."""
WRONG = 0.05
"""Relative error of tau_c from which an answer counts as wrong."""
NOTICED = ("exploded", "noisy", "stalled")
"""How a run says that it failed."""


class Look(NamedTuple):
    """How a verdict is drawn.

    Attributes
    ----------
    colour
        Colour of the cell.
    ink
        Colour of its text.
    letter
        Letter that stands in the cell for the verdict.
    """

    colour: str
    ink: str
    letter: str


VERDICTS = {
    "good": Look("#8cc5e8", "black", "G"),
    "noisy": Look("#f4ea7a", "black", "N"),
    "wrong": Look("#e0803a", "black", "W"),
    "stalled": Look("#c8c8c8", "black", "S"),
    "exploded": Look("#5b2a52", "white", "X"),
}
"""The verdicts, from the best to the worst."""


class Stability(Experiment):
    """Where each method fails.

    Parameters
    ----------
    folder
        Directory of the maps, by default those of the package.
    """

    name = "stability"
    title = TITLE
    verdicts = NOTICED
    failing = ()

    def __init__(self, folder: Path = FOLDER) -> None:
        self.maps = [read_map(path) for path in sorted(folder.glob("*.toml"))]
        asked = {}
        for each in self.maps:
            for place in each.places:
                for scene in (*place.scenes, *place.references):
                    asked[scene.id] = as_written(scene)
        super().__init__(plan.of(asked))

    def results(self, runs: Runs) -> ExperimentResults:
        """Judge every place of every map."""
        judged = [judge_map(each, runs) for each in self.maps]
        table = pd.concat(judged, ignore_index=True)
        said = told.counted(self.maps, table)
        sections = _sections(self.maps, table, said)
        return ExperimentResults({"maps": table, "told": said}, sections)


def _sections(
    maps: Sequence[StabilityMap], table: pd.DataFrame, counts: pd.DataFrame
) -> list[Section]:
    """The page: all maps in one figure, what is told, each with its question."""
    whole = Figure.of_both_widths(
        "maps", TITLE, WHOLE_CAPTION, partial(draw_maps, maps, table)
    )
    sections = [
        Section("", [_card(table)]),
        Section("All maps", [whole, Paragraphs(MAPS_TEXT, "lead")]),
        Section(TOLD_TITLE, [Paragraphs(TOLD_TEXT, "lead"), Table.of(counts)]),
    ]
    for each in maps:
        title = each.data["title"]
        figure = Figure.of_both_widths(
            f"map-{each.name}", title, CAPTION, partial(draw_maps, [each], table)
        )
        question = Paragraphs(each.data["question"], "lead")
        limits = each.data.get("limits", ())
        said = [Limits(limits)] if limits else []
        sections.append(Section(title, [*said, figure, question]))
    return sections


def _card(table: pd.DataFrame) -> Card:
    """The answer card: how many runs are good, failed aloud, and failed silently."""
    of = len(table)
    counts = table["verdict"].value_counts()
    good = int(counts.get("good", 0))
    noticed = int(table["caught"].sum())
    silent = of - good - noticed
    within = f"within {percent(WRONG)} of their references"
    kinds = "noisy, exploded or stalled"
    numbers = (
        Number.counted(good, of, "runs are good", within, "good"),
        Number.counted(noticed, of, "runs report their failure", kinds, "care"),
        Number.counted(
            silent,
            of,
            "runs are wrong and report nothing",
            f"off by more than {percent(WRONG)}",
            "bad",
        ),
    )
    return Card(
        "Where do the methods fail, and do they report it?",
        f"{table['map'].nunique()} maps of two parameters each, far beyond the ranges "
        "in use.",
        numbers,
        "Nothing is measured here: each run is compared with a finer one.",
        Worth(
            "care",
            "usable where the maps are good",
            "A study refuses, warns of or does not call usable what is not.",
        ),
    )


def judge_map(one: StabilityMap, runs: Runs) -> pd.DataFrame:
    """Judge every run of a map.

    Returns
    -------
    DataFrame
        A row for each place, and for each fraction where its run is read at several: x
        and y, numbers or texts; verdict, "good", "wrong" or one of `NOTICED`; caught,
        whether the run itself noticed; error, relative and signed, or NaN; note, the
        cause.
    """
    rows = []
    for place in one.places:
        failed = _first_failure(place, runs)
        for fraction in one.fractions:
            judged = failed or _judged(one, place, runs, fraction)
            row: Row = {
                "map": one.name,
                "x": place.x if fraction is None else fraction,
                "y": place.y,
                "verdict": judged.verdict,
                "caught": failed is not None,
                "error": judged.error,
                "note": judged.note,
            }
            rows.append(row)
    return pd.DataFrame(rows)


class _Judged(NamedTuple):
    """What became of a run: a verdict, the error of tau_c or NaN, and the cause."""

    verdict: str
    error: float
    note: str


def _first_failure(place: Place, runs: Runs) -> _Judged | None:
    """How the first run that failed at a place failed; None where none did."""
    failures = (_failure(scene, runs) for scene in place.scenes)
    return next((failure for failure in failures if failure), None)


def _judged(
    one: StabilityMap, place: Place, runs: Runs, fraction: float | None
) -> _Judged:
    """Judge a run that did not fail by its error against its reference."""
    error = max(_errors(one, place, runs, fraction), key=abs, default=math.nan)
    if math.isnan(error):
        return _Judged("wrong", error, "its reference failed")
    if abs(error) <= WRONG:
        return _Judged("good", error, "")
    return _Judged("wrong", error, "")


def _failure(scene: Scene, runs: Runs) -> _Judged | None:
    """How a run that the scene needs failed, and why; None where all are done."""
    pile = runs.planned.piles.get(scene.id)
    if pile is not None:
        needed: Sequence[case.Case] = pile.runs
    else:
        needed = [cells for cells in runs.planned.cells if scene in cells.scenes]
    lost = [run.name for run in needed if run.name not in runs.done]
    if not lost:
        return None
    ended, cause = case.failure(runs.cases / lost[0])
    if ended not in NOTICED:
        ended = "stalled"
    note = cause.replace(f"{runs.cases}/", "") or "it did not run"
    return _Judged(ended, math.nan, note)


def _errors(
    one: StabilityMap,
    place: Place,
    runs: Runs,
    fraction: float | None,
) -> Iterator[float]:
    """The signed relative errors of tau_c; infinite where one of two was reached."""
    for scene, reference in zip(place.scenes, place.references, strict=True):
        if one.data["judge"] == "grain":
            yield _error_of_grain(scene, runs)
        elif _failure(reference, runs):
            yield math.nan
        else:
            yield from _errors_of_pile(scene, reference, runs, fraction)


def _error_of_grain(scene: Scene, runs: Runs) -> float:
    """Error of a single grain against the closed form."""
    cells = next(cells for cells in runs.planned.cells if scene in cells.scenes)
    over = threshold.of_grains(Motion.from_csv(runs.cases / cells.name))
    return float(over.value[cells.scenes.index(scene)]) ** 2 - 1


def _errors_of_pile(
    scene: Scene,
    reference: Scene,
    runs: Runs,
    fraction: float | None,
) -> Iterator[float]:
    """Errors of a pile against its reference, at a fraction or at those of the scene.

    A fraction that neither reached has none.
    """
    fractions = scene.threshold.fractions
    if fraction is not None:
        fractions = (fraction,)
    pile = runs.planned.piles[scene.id]
    other = runs.planned.piles[reference.id]
    found = pile.thresholds(runs.cases, fractions)
    expected = other.thresholds(runs.cases, fractions)
    for answer, exact in zip(found, expected, strict=True):
        error = answer.tau / exact.tau - 1
        if not math.isnan(error):
            yield error
        elif not (math.isnan(answer.tau) and math.isnan(exact.tau)):
            yield math.inf


COLUMNS = 2
"""Maps beside each other in a wide figure of several."""
CELL = 0.36
"""Height of a cell with one line of text, inches."""
NAMES = 0.95
"""Height of the title and the axis of a map, inches."""
LEGENDS = 1.1
"""Height of the legends of a figure, inches."""


def draw_maps(
    maps: Sequence[StabilityMap], table: pd.DataFrame, width: float = style.WIDE
) -> Canvas:
    """Draw maps as grids of cells.

    Parameters
    ----------
    maps
        The maps.
    table
        The rows of `judge_map`.
    width
        Width of the drawing, inches.

    Returns
    -------
    Canvas
        The worst verdict at each place, and its error where a wide drawing has one map.
    """
    tables = [table[table["map"] == each.name] for each in maps]
    counts = [rows["y"].nunique() for rows in tables]
    is_wide = width >= style.WIDE
    columns = min(len(maps), COLUMNS) if is_wide else 1
    starts = range(0, len(maps), columns)
    ratios = [max(counts[start : start + columns]) for start in starts]
    has_errors = is_wide and len(maps) == 1
    cell = CELL * (1.5 if has_errors else 1.0)
    canvas = style.canvas(cell * sum(ratios) + NAMES * len(ratios) + LEGENDS, width)
    grid = canvas.subplots(len(ratios), columns, squeeze=False, height_ratios=ratios)
    axes = grid.ravel()
    for ax, each, rows in zip(axes, maps, tables, strict=False):
        _panel(ax, each, rows, has_errors=has_errors)
        fits = int(width / columns / style.inches(0.75))
        ax.set_title(textwrap.fill(each.data["title"], fits), loc="left")
        if not has_errors:
            ax.tick_params(axis="x", rotation=90)
    for ax in axes[len(maps) :]:
        ax.set_axis_off()
    style.legends_below(canvas, _samples(set(table["verdict"])), [])
    return canvas


def _samples(verdicts: set[str]) -> list[Patch]:
    """Samples of the verdicts that are drawn, for a legend."""
    samples = []
    for verdict, look in VERDICTS.items():
        if verdict in verdicts:
            label = f"{look.letter}: {verdict}"
            samples.append(Patch(fc=look.colour, ec="white", label=label))
    return samples


def _panel(
    ax: Axes, one: StabilityMap, table: pd.DataFrame, *, has_errors: bool
) -> None:
    """Draw one map, with the errors below the letters of its verdicts or without."""
    columns = _ticked(ax.xaxis, table["x"], one.data["x"]["label"])
    lines = _ticked(ax.yaxis, table["y"], one.data["y"]["label"])
    cells: Any = _worst(table).itertuples(index=False)
    for cell in cells:
        x = columns[cell.x]
        y = lines[cell.y]
        look = VERDICTS[cell.verdict]
        shape = {"fc": look.colour, "ec": "white", "lw": 1, "gid": cell.verdict}
        ax.add_patch(Rectangle((x, y), 1, 1, **shape))
        ax.text(
            x + 0.5,
            y + 0.5,
            _cell_text(look.letter, cell.error) if has_errors else look.letter,
            ha="center",
            va="center",
            color=look.ink,
        )
    ax.set(xlim=(0, len(columns)), ylim=(0, len(lines)))
    ax.tick_params(length=0)


def _ticked(axis: Axis, column: "pd.Series[Any]", label: str) -> dict[Any, int]:
    """Mark the cells of an axis; the place of each value on it.

    Texts stand as they come, numbers rise.
    """
    values = column.drop_duplicates()
    is_number = pd.to_numeric(values, errors="coerce").notna()
    if is_number.all():
        values = values.astype(float).sort_values()
    marks = [value if isinstance(value, str) else f"{value:g}" for value in values]
    axis.set_ticks(np.arange(len(marks)) + 0.5, marks)
    axis.set_label_text(label)
    return {value: place for place, value in enumerate(values)}


def _worst(table: pd.DataFrame) -> pd.DataFrame:
    """The row with the worst verdict of each place."""
    rank = {verdict: place for place, verdict in enumerate(VERDICTS)}
    rising = table.sort_values("verdict", key=lambda verdicts: verdicts.map(rank))
    return rising.drop_duplicates(["x", "y"], keep="last")


def _cell_text(letter: str, error: float) -> str:
    """The letter of a verdict, and below it the error if there is one."""
    if math.isnan(error):
        return letter
    percent = f"{100 * error:+.2g} %".replace("-", "−")
    return f"{letter}\n{percent}"
