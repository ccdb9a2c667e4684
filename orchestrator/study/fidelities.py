"""The fidelities as a study file names them: named methods that answer a pile.

``fidelities.toml`` writes each of them out.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError, suggestion
from orchestrator.study.fields import FIDELITY

AUTO = "auto"
"""Leaves the fidelity to the program, which chooses by numerical errors."""
FLOW = "method.flow."
"""Beginning of the names of the fields of the flow."""
Fields = Mapping[str, Any]
"""Values of the fields of a method, named as in a study file."""


@dataclass(frozen=True)
class Written:
    """A fidelity as ``fidelities.toml`` writes it.

    Attributes
    ----------
    meaning
        What it does, in words.
    flow, grains
        The fields that it sets for the flow over a pile, and for its grains.
    on
        By packing, the fields of the grains that it sets to something else there.
    not_on
        The packings that it does not answer.
    is_reference
        Whether errors are measured against it.
    """

    meaning: str
    flow: Fields
    grains: Fields
    on: Mapping[str, Fields]
    not_on: tuple[str, ...]
    is_reference: bool


def _read() -> dict[str, Written]:
    """Every fidelity by its name, by cost."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    found = {}
    for name, table in tomllib.loads(text).items():
        fields = _by_name(table["method"])
        on = {}
        for packing, changed in table.get("on", {}).items():
            on[packing] = _by_name(changed)
        found[name] = Written(
            meaning=table["meaning"],
            flow={name: fields[name] for name in fields if name.startswith(FLOW)},
            grains={name: fields[name] for name in fields if not name.startswith(FLOW)},
            on=on,
            not_on=tuple(table.get("not_on", ())),
            is_reference=table.get("is_reference", False),
        )
    return found


def _by_name(method: Mapping[str, Any]) -> Fields:
    """The fields of a table ``method`` by their names in a study file."""
    fields = {}
    for key, value in method.items():
        if isinstance(value, dict):
            for inner, number in value.items():
                fields[f"method.{key}.{inner}"] = number
        else:
            fields[f"method.{key}"] = value
    return fields


WRITTEN: Mapping[str, Written] = _read()
"""The fidelities by name, by cost."""


def packing_of(bed: Mapping[str, Any]) -> str:
    """Name the packing of a bed.

    Parameters
    ----------
    bed
        The table of the bed.

    Returns
    -------
    str
        The packing; that of a poured bed in space is ``strip``.
    """
    packing = str(bed.get("packing", "aligned"))
    return "strip" if packing == "poured" and bed.get("width") else packing


def fields_of(name: str, bed: Mapping[str, Any], where: str) -> Fields:
    """The fields that a fidelity sets on a bed, by their names in a study file.

    Parameters
    ----------
    name
        The fidelity.
    bed
        The table of the bed. One grain has no flow that is solved.
    where
        The file, for messages.

    Returns
    -------
    dict
        Values by the names of the fields.

    Raises
    ------
    InputError
        For a name that is none, and on a bed that the fidelity does not answer.
    """
    place = f"{where}: {FIDELITY}"
    if name not in WRITTEN:
        known = [AUTO, *WRITTEN]
        near = suggestion(str(name), known)
        every = f"write one of {', '.join(known)}"
        remedy = f"{near} Else {every}" if near else every
        raise InputError(f"{name!r} is no fidelity", place, remedy)
    written = WRITTEN[name]
    packing = packing_of(bed)
    if packing in written.not_on:
        others = [one for one in WRITTEN if packing not in WRITTEN[one].not_on]
        what = f"{name} does not answer a poured bed in space"
        raise InputError(what, place, f"write {', '.join(others)}")
    fields = {**written.grains, **written.on.get(packing, {})}
    if bed.get("kind") == "grain":
        fields.pop("method.grains.mobile_layers", None)
        return fields
    return {**written.flow, **fields}
