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
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

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
DEFAULT = "default"
"""In a file, the value that is a field's default; TOML has none."""
WRONG = 0.05
"""Relative error of tau_c from which an answer counts as wrong."""
NOTICED = ("exploded", "noisy", "stalled")
"""How a run says that it failed."""


class Place(NamedTuple):
    """One place on an axis: what it is called, and the fields that it sets."""

    label: float | str
    changes: Mapping[str, Any]


class Axis(NamedTuple):
    """An axis of a map: its label with its unit, its places, whether these are fractions."""

    label: str
    places: tuple[Place, ...]
    is_fraction: bool = False


class Run(NamedTuple):
    """The scenes of one place of a map, and those that they are compared with."""

    x: Place
    y: Place
    scenes: tuple[Scene, ...]
    references: tuple[Scene, ...]


@dataclass(frozen=True)
class Map:
    """One map.

    Attributes
    ----------
    name, title, question : str
        The file's name; a headline; what the map is for.
    judge : {"pile", "grain"}
        Whether thresholds of a pile are compared with those of its reference, or one grain's with
        the closed form.
    x, y : Axis
        The axes.
    runs : tuple of Run
        For each y all x; only one for a y whose x are fractions.
    """

    name: str
    title: str
    question: str
    judge: Literal["pile", "grain"]
    x: Axis
    y: Axis
    runs: tuple[Run, ...]

    @property
    def limits(self) -> tuple[str, ...]:
        """The limits that were read off it, in sentences."""
        return limits.SAYS.get(self.name, ())


class Judged(NamedTuple):
    """A map, and a table with a row for each of its places.

    The columns are map; x and y, numbers or texts; verdict, "good", "wrong" or one of `NOTICED`;
    caught, whether the run itself noticed; error, relative and signed, or NaN; note, the cause.
    """

    map: Map
    table: pd.DataFrame


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
        x, y = _axis(data["x"]), _axis(data["y"])
        words = {name: data[name] for name in ("title", "question", "judge")}
        return Map(path.stem, x=x, y=y, runs=tuple(_runs(data, x, y, path.name)), **words)
    except KeyError as missing:
        raise InputError(f"{missing} is missing", where=str(path)) from None


def _axis(data: Mapping[str, Any]) -> Axis:
    if "fractions" in data:
        places = tuple(Place(value, {}) for value in data["fractions"])
        return Axis(data["label"], places, is_fraction=True)
    if "entries" in data:
        return Axis(
            data["label"], tuple(Place(one["label"], one["set"]) for one in data["entries"])
        )

    def times(value: Any, factor: float) -> Any:
        return value * factor if isinstance(value, int | float) else value

    places = tuple(
        Place(value, {name: times(value, factor) for name, factor in data["fields"].items()})
        for value in data["values"]
    )
    return Axis(data["label"], places)


def _runs(data: Mapping[str, Any], x: Axis, y: Axis, where: str) -> Iterator[Run]:
    fractions = [float(place.label) for place in x.places] if x.is_fraction else None
    for down in y.places:
        for across in x.places[:1] if fractions else x.places:
            changes = {**down.changes, **across.changes}
            if fractions:
                changes["protocol.fractions"] = fractions
            scenes = _scenes(data, changes, where)
            references = _scenes(data, {**changes, **data.get("reference", {})}, where)
            yield Run(across, down, scenes, references)


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
        judged = [judge(one, runs) for one in maps]
        table = pd.concat([one.table for one in judged], ignore_index=True)
        return {"maps": table}, lambda: _sections(judged)

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
    scenes = (
        scene
        for one in maps
        for run in one.runs
        for scene in (*run.scenes, *(run.references if one.judge == "pile" else ()))
    )
    return plan.of({scene.id: as_asked(scene) for scene in scenes}, "stability")


def judge(one: Map, runs: Runs) -> Judged:
    """Judge every run of a map."""
    rows = []
    for run in one.runs:
        places = [place.label for place in one.x.places] if one.x.is_fraction else [run.x.label]
        failed = next((end for scene in run.scenes if (end := _failure(scene, runs))), None)
        for x in places:
            row: Row = {"map": one.name, "x": x, "y": run.y.label}
            if failed:
                row |= {"verdict": failed[0], "caught": True, "error": math.nan, "note": failed[1]}
            else:
                error = _error(one, run, runs, float(x) if one.x.is_fraction else None)
                verdict = "good" if abs(error) <= WRONG else "wrong"
                note = "its reference failed" if math.isnan(error) else ""
                row |= {"verdict": verdict, "caught": False, "error": error, "note": note}
            rows.append(row)
    return Judged(one, pd.DataFrame(rows))


def _failure(scene: Scene, runs: Runs) -> tuple[str, str] | None:
    """How a run that the scene needs failed, and why; None where all of them are done."""
    planned = runs.planned
    if scene.id in planned.piles:
        names = [run.name for run in planned.piles[scene.id].runs]
    else:
        names = [cells.name for cells in planned.cells if scene in cells.scenes]
    lost = next((name for name in names if name not in runs.done), None)
    if lost is None:
        return None
    verdict, why = case.ended(runs.cases / lost)
    why = why.replace(f"{runs.cases}/", "") or "it did not run"
    return verdict if verdict in NOTICED else "stalled", why


def _error(one: Map, run: Run, runs: Runs, fraction: float | None) -> float:
    """The signed relative error of tau_c that is largest; infinite where one was not reached."""
    errors = []
    for scene, reference in zip(run.scenes, run.references, strict=True):
        if one.judge == "grain":
            cells = next(cells for cells in runs.planned.cells if scene in cells.scenes)
            found = threshold.of_grains(Motion.from_csv(runs.cases / cells.name))
            errors.append(float(found.value[cells.scenes.index(scene)]) ** 2 - 1)
        elif _failure(reference, runs):
            errors.append(math.nan)
        else:
            fractions = scene.protocol.fractions if fraction is None else (fraction,)
            piles = (runs.planned.piles[asked.id] for asked in (scene, reference))
            answers = (pile.thresholds(runs.cases, fractions) for pile in piles)
            for answer, other in zip(*answers, strict=True):
                if not (math.isnan(answer.tau) and math.isnan(other.tau)):
                    error = answer.tau / other.tau - 1
                    errors.append(math.inf if math.isnan(error) else error)
    return max(errors, key=abs, default=math.nan)


TITLE = "Where each method fails"


def _sections(judged: Sequence[Judged]) -> list[Section]:
    """The page: the sheet of all maps, then each by itself."""
    from orchestrator.experiments import stability_figures as figures

    sheet = experiment.figure("maps", TITLE, "", figures.sheet(judged))
    sections = [Section("All maps", experiment.texts("stability")["maps"], (sheet,))]
    for one in judged:
        shown = one.map
        drawn = experiment.figure(f"map-{shown.name}", shown.title, "", figures.draw(one))
        sections.append(Section(shown.title, shown.question, (drawn,), limits=shown.limits))
    return sections
