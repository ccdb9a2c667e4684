"""What a study says of answers that are wrong though their runs noticed nothing.

Of each such answer of the maps of failure the checks of the present program are asked:
those by which a study is refused or warned, and those by which a threshold is usable.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from orchestrator.fidelity import limits
from orchestrator.fidelity.decision import as_written
from orchestrator.lab.map_file import Place, StabilityMap
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

REFUSED = "refused"
WARNED = "warned"
NOT_USABLE = "not usable"
WITHIN = "within its numerical error"
NO_FAULT = "no fault of a run"
NOTHING = "nothing"
HOW = (REFUSED, WARNED, NOT_USABLE, WITHIN, NO_FAULT, NOTHING)
"""What a study may say, from the strongest to the weakest."""


def told_answers(maps: Iterable[StabilityMap], table: pd.DataFrame) -> pd.DataFrame:
    """Find what a study says of each answer that is wrong without a notice of its run.

    Parameters
    ----------
    maps
        The maps.
    table
        The rows of `stability.judge_map`.

    Returns
    -------
    DataFrame
        The rows of these answers, with `told`, one of `HOW`, and `field`: the field
        for which a study is refused or warned.
    """
    kept = (table["verdict"] == "wrong") & ~table["caught"]
    wrong = table[kept]
    rows = []
    for one in maps:
        places = {(_key(place.x), _key(place.y)): place for place in one.places}
        of_map = wrong[wrong["map"] == one.name]
        is_read_at_several = one.fractions != (None,)
        for row in of_map.to_dict("records"):
            x = None if is_read_at_several else row["x"]
            fraction = float(row["x"]) if is_read_at_several else None
            place = places[_key(x), _key(row["y"])]
            how, field = _of_place(one, place, fraction, abs(float(row["error"])))
            rows.append({**row, "told": how, "field": field})
    return pd.DataFrame(rows, columns=[*table, "told", "field"])


def counted(maps: Sequence[StabilityMap], table: pd.DataFrame) -> pd.DataFrame:
    """Count what a study says, by map.

    Parameters
    ----------
    maps
        The maps.
    table
        The rows of `stability.judge_map`.

    Returns
    -------
    DataFrame
        A row for each map with such answers: its title, their number, how many of them
        a study tells in each way of `HOW`, and the fields that it names.
    """
    rows = []
    found = told_answers(maps, table)
    for one in maps:
        of_map = found[found["map"] == one.name]
        if of_map.empty:
            continue
        row: dict[str, Any] = {"map": one.data["title"], "wrong": len(of_map)}
        for how in HOW:
            row[how] = int((of_map["told"] == how).sum())
        fields = sorted(set(of_map["field"]) - {""})
        rows.append({**row, "fields": ", ".join(fields)})
    return pd.DataFrame(rows, columns=["map", "wrong", *HOW, "fields"])


def _key(value: object) -> object:
    """A value of an axis as it is found again in a table of texts and numbers."""
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return value


def _of_place(
    one: StabilityMap, place: Place, fraction: float | None, error: float
) -> tuple[str, str]:
    """What a study says of a place: the weakest of its scenes, one a force law."""
    if "no_check" in one.data:
        return NO_FAULT, ""
    varied = frozenset(_varied(one.data))
    each = [_of_scene(scene, varied, fraction, error) for scene in place.scenes]
    return max(each, key=lambda said: HOW.index(said[0]))


def _of_scene(
    scene: Scene, varied: frozenset[str], fraction: float | None, error: float
) -> tuple[str, str]:
    """What a study says of a scene; of its limits those of the fields of the map."""
    beyond = [one for one in limits.exceeded(scene) if one.field in varied]
    for limit in sorted(beyond, key=lambda one: not one.refused):
        return (REFUSED if limit.refused else WARNED), limit.field
    if not isinstance(scene.bed, PileBed):
        return NOTHING, ""
    decision = as_written(scene)
    fractions = scene.threshold.fractions if fraction is None else (fraction,)
    errors = [decision.error_at(at) for at in fractions]
    known = [each for each in errors if each is not None]
    if len(known) < len(errors):
        return NOT_USABLE, ""
    if error <= max(known):
        return WITHIN, ""
    return NOTHING, ""


def _varied(data: Mapping[str, Any]) -> Iterator[str]:
    """The fields that the axes of a map change."""
    for axis in (data["x"], data["y"]):
        yield from axis.get("fields", ())
        for entry in axis.get("entries", ()):
            yield from entry["set"]
