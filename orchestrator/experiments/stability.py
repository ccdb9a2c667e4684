"""Maps of failure: where in a plane of two parameters a run is good, and what happens elsewhere.

A map's file has the tables of a study file. An axis changes fields of them: a list of values, each
times a factor where it is a number; or entries with a label and the fields they set; or, without
runs of their own, the fractions of a pile at which its threshold is read. A run that fails says so
itself: its verdict is what it noticed. The answer of another is compared with the reference of its
place: beyond `WRONG` it is wrong, and nothing said so.
"""

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments import experiment
from orchestrator.experiments.experiment import Runs, Tables
from orchestrator.fidelity import limits
from orchestrator.fidelity.decision import as_asked
from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report.document import Section
from orchestrator.runs import case
from orchestrator.study.closed_form import resolved
from orchestrator.study.fields import PARTS
from orchestrator.study.scene import Scene
from orchestrator.study.study import TIME_LIMIT_S, make_scene
from orchestrator.types import Row

FOLDER = Path(__file__).parent / "maps"
TITLE = "Where each method fails"
DEFAULT = "default"
"""In a file, the value that is a field's default; TOML has none."""
WRONG = 0.05
"""Relative error of tau_c from which an answer counts as wrong."""
NOTICED = ("exploded", "noisy", "stalled")
"""How a run says that it failed."""


class Place(NamedTuple):
    """A place of a map: its values on the axes, its scenes, and those they are compared with.

    x is None where the run is read at several fractions.
    """

    x: float | str | None
    y: float | str
    scenes: tuple[Scene, ...]
    references: tuple[Scene, ...]


class Map(NamedTuple):
    """A map: its name, what its file says, its places."""

    name: str
    data: Mapping[str, Any]
    places: tuple[Place, ...]

    @property
    def limits(self) -> tuple[str, ...]:
        """The limits that were read off it, in sentences."""
        return limits.SAYS.get(self.name, ())

    @property
    def fractions(self) -> list[float]:
        """The fractions at which one run is read along x; empty for other axes."""
        return [float(value) for value in self.data["x"].get("fractions", ())]


def load_all() -> list[Map]:
    """Every map of the package, by name."""
    return [load(path) for path in sorted(FOLDER.glob("*.toml"))]


def load(path: Path) -> Map:
    """Read a map's file.

    Raises
    ------
    InputError
        If it is not one; naming the file and the field.
    """
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    try:
        _ = [data[name] for name in ("title", "question", "judge")]
        across, down = ([*_axis(data[axis])] for axis in ("x", "y"))
    except KeyError as missing:
        raise InputError(f"{missing} is missing", where=str(path)) from None
    places = []
    for y, below in down:
        for x, beside in across:
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
    """The scene with some changes; in the transition one for each force law."""
    parts = {part: dict(data.get(part, {})) for part in PARTS}
    for key, value in changes.items():
        part, _, field = key.partition(".")
        parts[part].pop(field, None)
        if value != DEFAULT:
            parts[part][field] = value
    return next(resolved([make_scene(parts, where)]))


def run(out: Path, *, workers: int) -> Finished:
    """Run every map and say where each method fails.

    Raises
    ------
    InputError
        If the directory cannot be used.
    SolverError
        If a solver is missing.
    """
    maps = load_all()

    def make(runs: Runs) -> tuple[Tables, Callable[[], list[Section]]]:
        tables = [judge(one, runs) for one in maps]
        return {"maps": pd.concat(tables, ignore_index=True)}, lambda: _sections(maps, tables)

    finished = experiment.run(
        "stability",
        TITLE,
        planned_for(maps),
        out,
        make,
        workers=workers,
        limit_s=TIME_LIMIT_S,
        # a failure that is a verdict would come again
        repeats=lambda directory: case.ended(directory)[0] not in NOTICED,
    )
    return Finished(finished.page, finished.started, {})


def planned_for(maps: Sequence[Map]) -> Plan:
    """The runs of some maps, those that they share once."""
    scenes = {
        scene.id: as_asked(scene)
        for one in maps
        for place in one.places
        for scene in (*place.scenes, *(place.references if one.data["judge"] == "pile" else ()))
    }
    return plan.of(scenes, "stability")


def judge(one: Map, runs: Runs) -> pd.DataFrame:
    """Judge every run of a map.

    Returns
    -------
    DataFrame
        A row for each place: map; x and y, numbers or texts; verdict, "good", "wrong" or one of
        `NOTICED`; caught, whether the run itself noticed; error, relative and signed, or NaN; note,
        the cause.
    """
    rows: list[Row] = []
    for place in one.places:
        failed = next((end for scene in place.scenes if (end := _failure(scene, runs))), None)
        fractions: Sequence[float | None] = one.fractions or [None]
        for at in fractions:
            row: Row = {"map": one.name, "x": place.x if at is None else at, "y": place.y}
            if failed:
                row |= {"verdict": failed[0], "caught": True, "error": math.nan, "note": failed[1]}
            else:
                error = max(_errors(one, place, runs, at), key=abs, default=math.nan)
                row |= {"verdict": "good" if abs(error) <= WRONG else "wrong", "caught": False}
                note = "its reference failed" if math.isnan(error) else ""
                row |= {"error": error, "note": note}
            rows.append(row)
    return pd.DataFrame(rows)


def _failure(scene: Scene, runs: Runs) -> tuple[str, str] | None:
    """How a run that the scene needs failed, and why; None where all of them are done."""
    pile = runs.planned.piles.get(scene.id)
    needed = pile.runs if pile else [one for one in runs.planned.cells if scene in one.scenes]
    lost = next((run.name for run in needed if run.name not in runs.done), None)
    if lost is None:
        return None
    verdict, why = case.ended(runs.cases / lost)
    why = why.replace(f"{runs.cases}/", "") or "it did not run"
    return verdict if verdict in NOTICED else "stalled", why


def _errors(one: Map, place: Place, runs: Runs, fraction: float | None) -> Iterator[float]:
    """The signed relative errors of tau_c; infinite where only one of two was reached."""
    for scene, reference in zip(place.scenes, place.references, strict=True):
        if one.data["judge"] == "grain":  # against the closed form
            cells = next(cells for cells in runs.planned.cells if scene in cells.scenes)
            found = threshold.of_grains(Motion.from_csv(runs.cases / cells.name))
            yield float(found.value[cells.scenes.index(scene)]) ** 2 - 1
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


def _sections(maps: Sequence[Map], tables: Sequence[pd.DataFrame]) -> list[Section]:
    """The page: the sheet of all maps, then each by itself."""
    from orchestrator.experiments import stability_figures as figures

    sheet = experiment.figure("maps", TITLE, "", figures.sheet(maps, tables))
    sections = [Section("All maps", experiment.texts("stability")["maps"], (sheet,))]
    for one, table in zip(maps, tables, strict=True):
        title, question = one.data["title"], one.data["question"]
        drawn = experiment.figure(f"map-{one.name}", title, "", figures.draw(one, table))
        sections.append(Section(title, question, (drawn,), limits=one.limits))
    return sections
