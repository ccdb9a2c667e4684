"""The file of a map of failure: its places, with the scenes of each.

A map's file has the tables of a study file. An axis changes fields of them: a list of
values, each times a factor where it is a number; entries with a label and the fields
they set; or the fractions of a pile at which the threshold of one run is read. Where no
check can tell its wrong answers, `no_check` says why.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator.fidelity.decision import written
from orchestrator.study.closed_form import resolved
from orchestrator.study.keys import by_name
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene

FOLDER = Path(__file__).parent / "maps"
"""The maps of the package."""
DEFAULT = "default"
"""In a file, the value that is a field's default; TOML has none."""


class Place(NamedTuple):
    """A place of a map.

    Attributes
    ----------
    x, y
        Its values on the axes; x is None where the run is read at several fractions.
    scenes
        Its scenes.
    references
        The scenes that they are compared with, in the same order.
    """

    x: float | str | None
    y: float | str
    scenes: tuple[Scene, ...]
    references: tuple[Scene, ...]


class StabilityMap(NamedTuple):
    """A map.

    Attributes
    ----------
    name
        Its name.
    data
        What its file says.
    places
        Its places.
    """

    name: str
    data: Mapping[str, Any]
    places: tuple[Place, ...]

    @property
    def fractions(self) -> Sequence[float | None]:
        """Fractions at which each run is read; None stands for those of its scene."""
        values = self.data["x"].get("fractions")
        if values is None:
            return (None,)
        return [float(value) for value in values]


def read_map(path: Path) -> StabilityMap:
    """Read a map's file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    StabilityMap
        The map.
    """
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    of_reference = data.get("reference", {})
    places = []
    for y, below in _axis(data["y"]):
        for x, beside in _axis(data["x"]):
            changes = {**below, **beside}
            scenes = _scenes(data, changes, path.name)
            references = _scenes(data, {**changes, **of_reference}, path.name)
            places.append(Place(x, y, scenes, references))
    return StabilityMap(path.stem, data, tuple(places))


def _axis(axis: Mapping[str, Any]) -> Iterator[tuple[Any, Mapping[str, Any]]]:
    """The places of an axis: the label, and the fields that it sets."""
    if "fractions" in axis:
        fractions = [float(value) for value in axis["fractions"]]
        yield None, {"threshold.fractions": fractions}
    for entry in axis.get("entries", ()):
        yield entry["label"], entry["set"]
    for value in axis.get("values", ()):
        yield value, _scaled(axis["fields"], value)


def _scaled(factors: Mapping[str, float], value: float | str) -> dict[str, Any]:
    """Fields with a value times their factors if it is a number, else as it is."""
    if not isinstance(value, int | float):
        return dict.fromkeys(factors, value)
    return {name: value * factor for name, factor in factors.items()}


def _scenes(
    data: Mapping[str, Any],
    changes: Mapping[str, Any],
    where: str,
) -> tuple[Scene, ...]:
    """The scene with some changes, with its method.

    In the transition it is one for each force law.
    """
    tables = by_name(data)
    for name, value in changes.items():
        table, _, field = name.rpartition(".")
        tables[table].pop(field, None)
        if value != DEFAULT:
            tables[table][field] = value
    scenes = next(resolved([make_scene(tables, where)]))
    return tuple(written(scene) for scene in scenes)
