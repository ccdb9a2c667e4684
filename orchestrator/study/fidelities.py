"""The fidelities as a study file names them: sets of fields that answer a pile.

``fidelities.toml`` writes each of them out.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError

AUTO = "auto"
"""Leaves the fidelity to the program, which chooses by known errors."""
WRITTEN: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
"""Each fidelity by its name, from cheap to dear: `meaning`, the fields of `flow` and of
`grains`, those that it sets to something else `on` a packing, and the packings `not_on`
which it answers none."""


def packing_of(bed: Mapping[str, Any]) -> str:
    """The packing of a bed; a poured bed in space is a "strip"."""
    packing = str(bed.get("packing", "aligned"))
    return "strip" if packing == "poured" and bed.get("width") else packing


def fields_of(name: str, bed: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The fields that a fidelity sets on a bed, by their names in a study file.

    Parameters
    ----------
    name
        The fidelity.
    bed
        The table of the bed. On one grain, which has neither a solved flow nor layers,
        the rest is set.
    where
        The file, for messages.

    Raises
    ------
    InputError
        For a name that is none, and on a bed that the fidelity does not answer.
    """
    if name not in WRITTEN:
        known = ", ".join([AUTO, *WRITTEN])
        raise InputError(
            f"{name!r} is no fidelity", f"{where}: protocol.fidelity", known
        )
    written, packing = WRITTEN[name], packing_of(bed)
    if packing in written.get("not_on", ()):
        others = [
            one for one in WRITTEN if packing not in WRITTEN[one].get("not_on", ())
        ]
        what = f"{name} does not answer a poured bed in space"
        raise InputError(
            what, f"{where}: protocol.fidelity", f"write {', '.join(others)}"
        )
    fields = {**written["grains"], **written.get("on", {}).get(packing, {})}
    if bed.get("kind") == "grain":
        return {
            field: fields[field] for field in fields if not field.startswith("bed.")
        }
    return {**written["flow"], **fields}
