"""The keys of a study file, and the messages that refuse all others."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from orchestrator.errors import InputError, unknown_key
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed, UnfitError

GROUP_KEYS = (*PARTS, "axes", "name", "seeds")
TOP_KEYS = (
    *(*PARTS, "axes", "title", "time_limit", "tolerance", "cluster", "group", "profiles"),
    "seeds",
)
RENAMED = {
    "flow.closure": "forces.law",
    "flow.lift_coefficient": "forces.lift_coefficient",
    "flow.stress": "forces.stress",
    "flow.average": "forces.averaging_length",
    "flow.forced": "forces.loaded_grains",
    "flow.growth": "flow.expansion_ratio",
    "flow.correctors": "flow.non_orthogonal_correctors",
    "flow.turbulence": "flow.turbulence_model",
    "flow.convection": "flow.convection_scheme",
    "protocol.step": "protocol.load_increment",
    "protocol.quiet": "protocol.waiting_time",
    "protocol.marker": "protocol.displacement_criterion",
    "protocol.until": "protocol.final_fraction",
    "protocol.timestep": "protocol.time_step",
}
"""Former names of keys, with the present ones."""


def check_keys(table: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    """See that a table of a study file has known keys alone.

    Raises
    ------
    InputError
        Naming the first that is not, and where it may belong.
    """
    for key in table:
        if key not in known:
            raise unknown_key(key, known, f"{where}: {key}", _elsewhere(""))


def explained(error: ValidationError, where: str) -> InputError:
    """The refusal of a scene's tables, for the first thing that is wrong in them."""
    # a misspelt key says more than the field that is missing because of it
    first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, UnfitError):
        return InputError(cause.what, where=f"{where}: {cause.field}", remedy=cause.remedy)
    path = [str(step) for step in first["loc"]]
    is_grain = path[:2] == ["bed", "grain"]
    if path[0] == "bed" and path[1:2] in (["grain"], ["pile"]):
        del path[1]  # the branch of the union, not a key of the file
    field = ".".join(path)
    given = first.get("input")
    if first["type"] == "extra_forbidden" and field in RENAMED:
        new = RENAMED[field]
        return InputError("a former name", where=f"{where}: {field}", remedy=f"write {new}")
    if first["type"] == "extra_forbidden" and is_grain and path[1] in PileBed.model_fields:
        what, remedy = "unknown key of a bed of one grain", 'a pile has it: write kind = "pile"'
        return InputError(what, where=f"{where}: {field}", remedy=remedy)
    if first["type"] == "extra_forbidden":
        known = list(PARTS[path[0]].model_fields if path[1:] else PARTS)
        return unknown_key(path[-1], known, f"{where}: {field}", _elsewhere(path[0]))
    if first["type"] == "missing":
        return InputError("is missing", where=f"{where}: {field}", remedy="add it to the file")
    return InputError(
        f"{given!r} is not accepted",
        where=f"{where}: {field}",
        remedy=first["msg"].lower().replace("input should", "it should"),
    )


def _elsewhere(here: str) -> list[tuple[str, str]]:
    """The keys of all tables but one, with how a message writes them."""
    others = ((part, one.model_fields) for part, one in PARTS.items() if part != here)
    found = [(name, f"{part}.{name}") for part, names in others for name in names]
    alone = (key for key in TOP_KEYS if key not in PARTS)
    return [*found, *((key, f"{key}, above the first table") for key in alone)]
