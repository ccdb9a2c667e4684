"""Maps of failure: where in a plane of two parameters a run is good, and what happens elsewhere.

A map's file has the tables of a study file. An axis changes fields of them: a list of values, each
times a factor where it is a number; entries with a label and the fields they set; or the fractions
of a pile at which the threshold of one run is read. A run that fails gives its own verdict. Another
answer is wrong where it differs by more than `WRONG` from the reference of its place.
"""

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch, Rectangle

from orchestrator import plan
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs
from orchestrator.fidelity.decision import as_asked, written
from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion
from orchestrator.report import style
from orchestrator.report.page import Section
from orchestrator.report.style import Figure, Look
from orchestrator.runs import case
from orchestrator.study.closed_form import resolved
from orchestrator.study.fields import PARTS
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene
from orchestrator.types import Row

FOLDER = Path(__file__).parent / "maps"
TITLE = "Where each method fails"
DEFAULT = "default"  # in a file, the value that is a field's default; TOML has none
WRONG = 0.05  # relative error of tau_c from which an answer counts as wrong
NOTICED = ("exploded", "noisy", "stalled")  # how a run says that it failed
VERDICTS = {
    "good": ("#8cc5e8", "black", "G"),
    "noisy": ("#f4ea7a", "black", "N"),
    "wrong": ("#e0803a", "black", "W"),
    "stalled": ("#c8c8c8", "black", "S"),
    "exploded": ("#5b2a52", "white", "X"),
}
"""Colour of the cell and of its letter, and the letter, from the best to the worst verdict."""


class Place(NamedTuple):
    """A place of a map: its values on the axes, its scenes, and those they are compared with."""

    x: float | str | None  # None where the run is read at several fractions
    y: float | str
    scenes: tuple[Scene, ...]
    references: tuple[Scene, ...]


class Map(NamedTuple):
    """A map: its name, what its file says, its places."""

    name: str
    data: Mapping[str, Any]
    places: tuple[Place, ...]


def load(path: Path) -> Map:
    """Read a map's file."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    places = []
    for y, below in _axis(data["y"]):
        for x, beside in _axis(data["x"]):
            changes = {**below, **beside}
            compared = {**changes, **data.get("reference", {})}
            scenes = (_scenes(data, fields, path.name) for fields in (changes, compared))
            places.append(Place(x, y, *scenes))
    return Map(path.stem, data, tuple(places))


def _axis(axis: Mapping[str, Any]) -> Iterator[tuple[Any, Mapping[str, Any]]]:
    """The places of an axis: the label, and the fields that it sets."""
    if "fractions" in axis:
        yield None, {"protocol.fractions": [float(value) for value in axis["fractions"]]}
    for entry in axis.get("entries", ()):
        yield entry["label"], entry["set"]
    for value in axis.get("values", ()):
        number = isinstance(value, int | float)
        fields = axis["fields"].items()
        yield value, {name: value * factor if number else value for name, factor in fields}


def _scenes(data: Mapping[str, Any], changes: Mapping[str, Any], where: str) -> tuple[Scene, ...]:
    """The scene with some changes, with its method; in the transition one for each force law."""
    parts = {part: dict(data.get(part, {})) for part in PARTS}
    for key, value in changes.items():
        part, _, field = key.partition(".")
        parts[part].pop(field, None)
        if value != DEFAULT:
            parts[part][field] = value
    return tuple(map(written, next(resolved([make_scene(parts, where)]))))


def experiment(out: Path, folder: Path = FOLDER) -> Experiment:
    """Where each method fails: every map of a folder, by default those of the package."""
    maps = [load(path) for path in sorted(folder.glob("*.toml"))]
    places = [place for each in maps for place in each.places]
    scenes = [scene for place in places for scene in (*place.scenes, *place.references)]

    def results(runs: Runs) -> Results:
        table = pd.concat([judge(each, runs) for each in maps], ignore_index=True)
        whole = Figure("maps", TITLE, "", (), draw(maps, table))
        sections = [Section("All maps", TEXTS["stability"]["maps"], [whole])]
        for each in maps:
            title, question = each.data["title"], each.data["question"]
            drawn = Figure(f"map-{each.name}", title, "", (), draw([each], table))
            sections.append(Section(title, question, [drawn], (), each.data.get("limits", ())))
        return {"maps": table}, sections

    planned = plan.of({scene.id: as_asked(scene) for scene in scenes})
    return Experiment("stability", TITLE, planned, results, verdicts=NOTICED, failing=())


def judge(one: Map, runs: Runs) -> pd.DataFrame:
    """Judge every run of a map: x and y of its place, numbers or texts, and what became of it.

    verdict, "good", "wrong" or one of `NOTICED`; caught, whether the run itself noticed; error,
    relative and signed, or NaN; note, the cause.
    """
    rows: list[Row] = []
    for place in one.places:
        failed = next((end for scene in place.scenes if (end := _failure(scene, runs))), None)
        for fraction in one.data["x"].get("fractions", (None,)):
            error, note = math.nan, ""
            if failed:
                verdict, note = failed
            else:
                error = max(_errors(one, place, runs, fraction), key=abs, default=math.nan)
                verdict = "good" if abs(error) <= WRONG else "wrong"
                note = "its reference failed" if math.isnan(error) else ""
            x = place.x if fraction is None else float(fraction)
            row: Row = {"map": one.name, "x": x, "y": place.y, "verdict": verdict}
            rows.append({**row, "caught": bool(failed), "error": error, "note": note})
    return pd.DataFrame(rows)


def _failure(scene: Scene, runs: Runs) -> tuple[str, str] | None:
    """How a run that the scene needs failed, and why; None where all of them are done."""
    pile = runs.planned.piles.get(scene.id)
    needed = pile.runs if pile else [each for each in runs.planned.cells if scene in each.scenes]
    lost = next((run.name for run in needed if run.name not in runs.done), None)
    if lost is None:
        return None
    verdict, why = case.failure(runs.cases / lost)
    why = why.replace(f"{runs.cases}/", "") or "it did not run"
    return verdict if verdict in NOTICED else "stalled", why


def _errors(one: Map, place: Place, runs: Runs, fraction: float | None) -> Iterator[float]:
    """The signed relative errors of tau_c; infinite where only one of two was reached."""
    for scene, reference in zip(place.scenes, place.references, strict=True):
        if one.data["judge"] == "grain":  # against the closed form
            cells = next(cells for cells in runs.planned.cells if scene in cells.scenes)
            over = threshold.of_grains(Motion.from_csv(runs.cases / cells.name))
            yield float(over.value[cells.scenes.index(scene)]) ** 2 - 1
        elif _failure(reference, runs):
            yield math.nan
        else:
            fractions = scene.protocol.fractions if fraction is None else (fraction,)
            piles = (runs.planned.piles[asked.id] for asked in (scene, reference))
            answers = (pile.thresholds(runs.cases, fractions) for pile in piles)
            for answer, other in zip(*answers, strict=True):
                if not (math.isnan(answer.tau) and math.isnan(other.tau)):
                    error = answer.tau / other.tau - 1
                    yield math.inf if math.isnan(error) else error


def draw(maps: Sequence[Map], table: pd.DataFrame) -> Canvas:
    """Maps as grids of cells: the worst verdict at each place, and its error, of `judge`'s rows."""
    tables = [table[table["map"] == each.name] for each in maps]
    counts = [rows["y"].nunique() for rows in tables]
    columns = min(len(maps), 2)
    ratios = [max(counts[at : at + columns]) for at in range(0, len(maps), columns)]
    cell, font = (0.42, 9) if columns == 1 else (0.31, 5.4)
    canvas = style.canvas(cell * sum(ratios) + 0.85 * len(ratios) + 0.55)
    grid = canvas.subplots(len(ratios), columns, squeeze=False, height_ratios=ratios).ravel()
    for ax, each, rows in zip(grid, maps, tables, strict=False):
        _panel(ax, each, rows, font)
    for ax in grid[len(maps) :]:
        ax.set_axis_off()
    samples = [
        Patch(fc=colour, ec="white", label=f"{letter}: {verdict}")
        for verdict, (colour, _, letter) in VERDICTS.items()
        if verdict in set(table["verdict"])
    ]
    style.legends(canvas, samples, [])
    return canvas


def _panel(ax: Axes, one: Map, table: pd.DataFrame, font: float) -> None:
    places = {}
    for line, name in ((ax.xaxis, "x"), (ax.yaxis, "y")):
        values = table[name].drop_duplicates()  # texts as they come, numbers rising
        if pd.to_numeric(values, errors="coerce").notna().all():
            values = values.astype(float).sort_values()
        places[name] = {value: place for place, value in enumerate(values)}
        marks = [value if isinstance(value, str) else f"{value:g}" for value in values]
        line.set_ticks([place + 0.5 for place in range(len(marks))], marks)
        line.set_label_text(one.data[name]["label"])
    rank = {verdict: place for place, verdict in enumerate(VERDICTS)}
    worst_last = table.sort_values("verdict", key=lambda verdicts: verdicts.map(rank))
    cells: Any = worst_last.drop_duplicates(["x", "y"], keep="last").itertuples(index=False)
    for cell in cells:
        x, y = places["x"][cell.x], places["y"][cell.y]
        colour, ink, letter = VERDICTS[cell.verdict]
        ax.add_patch(Rectangle((x, y), 1, 1, fc=colour, ec="white", lw=1, gid=cell.verdict))
        error = f"\n{100 * cell.error:+.2g} %".replace("-", "−")
        text = letter if math.isnan(cell.error) else letter + error
        look: Look = {"ha": "center", "va": "center", "fontsize": font, "color": ink}
        ax.text(x + 0.5, y + 0.5, text, **look)
    ax.set(xlim=(0, len(places["x"])), ylim=(0, len(places["y"])))
    ax.set_title(one.data["title"], loc="left")
    ax.tick_params(length=0)
