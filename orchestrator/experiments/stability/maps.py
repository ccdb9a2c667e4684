"""A map of failure: two axes over a scene, what each place is compared with, read from TOML.

The tables of a map's file are those of a study file. An axis changes fields of them: a list of
values, each times a factor where it is a number; or entries with a label and the fields they set;
or, without any run of its own, the fractions of a pile at which its threshold is read.
"""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.study.closed_form import resolved
from orchestrator.study.fields import PARTS
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene

FOLDER = Path(__file__).parent / "maps"
Judge = Literal["pile", "grain"]
DEFAULT = "default"
"""In a file, the value that is a field's default; TOML has none."""


@dataclass(frozen=True)
class Place:
    """One place on an axis: what it is called, and the fields that it sets."""

    label: float | str
    changes: Mapping[str, Any]


@dataclass(frozen=True)
class Axis:
    """An axis of a map.

    Attributes
    ----------
    label : str
        With its unit.
    places : tuple of Place
        In their order.
    is_fraction : bool
        Whether the places are fractions at which one run is read.
    """

    label: str
    places: tuple[Place, ...]
    is_fraction: bool


@dataclass(frozen=True)
class Run:
    """The scenes of one place of a map, and those that they are compared with."""

    x: Place
    y: Place
    scenes: tuple[Scene, ...]
    references: tuple[Scene, ...]


@dataclass(frozen=True)
class Map:
    """One map: what it asks, its axes, its runs.

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
    judge: Judge
    x: Axis
    y: Axis
    runs: tuple[Run, ...]

    @property
    def limits(self) -> tuple[str, ...]:
        """The limits that were read off it, in sentences."""
        return tuple(limit.says for limit in limits.of_map(self.name))


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
        return Map(
            name=path.stem,
            title=data["title"],
            question=data["question"],
            judge=data["judge"],
            x=x,
            y=y,
            runs=tuple(_runs(data, x, y, path.name)),
        )
    except KeyError as missing:
        raise InputError(f"{missing} is missing", where=str(path)) from None


def _axis(data: Mapping[str, Any]) -> Axis:
    if "fractions" in data:
        values: list[Any] = data["fractions"]
        return Axis(data["label"], tuple(Place(value, {}) for value in values), is_fraction=True)
    if "entries" in data:
        places = tuple(Place(entry["label"], entry["set"]) for entry in data["entries"])
        return Axis(data["label"], places, is_fraction=False)
    places = tuple(
        Place(value, {key: _times(value, factor) for key, factor in data["fields"].items()})
        for value in data["values"]
    )
    return Axis(data["label"], places, is_fraction=False)


def _times(value: Any, factor: float) -> Any:
    return value * factor if isinstance(value, int | float) else value


def _runs(data: Mapping[str, Any], x: Axis, y: Axis, where: str) -> Iterator[Run]:
    protocol: dict[str, Any] = {}
    if x.is_fraction:
        protocol["protocol.fractions"] = [float(place.label) for place in x.places]
    for down in y.places:
        for across in x.places[:1] if x.is_fraction else x.places:
            own = {**protocol, **down.changes, **across.changes}
            yield Run(
                across,
                down,
                _scenes(data, own, where),
                _scenes(data, {**own, **data.get("reference", {})}, where),
            )


def _scenes(data: Mapping[str, Any], changes: Mapping[str, Any], where: str) -> tuple[Scene, ...]:
    """The scene with some changes; in the transition one for each force law."""
    parts = {part: dict(data.get(part, {})) for part in PARTS}
    for key, value in changes.items():
        part, _, field = key.partition(".")
        parts[part].pop(field, None)
        if value != DEFAULT:
            parts[part][field] = value
    return next(resolved([make_scene(parts, where)]))
