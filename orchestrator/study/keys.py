"""The keys of a study file: its tables by name, and the keys that files had before."""

from collections.abc import Mapping
from typing import Any

from orchestrator.errors import InputError
from orchestrator.study.fields import FIDELITY, METHOD, PARTS

Table = dict[str, Any]
Tables = dict[str, Table]
"""The tables of a scene by their names, such as ``bed`` and ``method.flow``."""
MOVED: Mapping[str, str] = {
    "protocol.method": "method.kind",
    "protocol.fidelity": FIDELITY,
    "protocol.displacement_criterion": "threshold.displacement",
    "protocol.fractions": "threshold.fractions",
    "protocol.update": "threshold.update",
    "protocol.time_step": "method.grains.time_step",
    "protocol.load_increment": "method.grains.load_increment",
    "protocol.waiting_time": "method.grains.waiting_time",
    "protocol.final_fraction": "method.grains.final_fraction",
    "grain.stiffness": "method.grains.stiffness",
    "grain.damping": "method.grains.damping",
    "bed.mobile_layers": "method.grains.mobile_layers",
    "flow.model": "method.flow.model",
    "flow.speed": "method.flow.speed",
    "flow.viscosity": "method.flow.viscosity",
    "flow.first_cell_height": "method.flow.first_cell_height",
    "flow.cells_per_face": "method.flow.cells_per_face",
    "flow.expansion_ratio": "method.flow.expansion_ratio",
    "flow.roughness": "method.flow.roughness",
    "flow.turbulence_model": "method.flow.turbulence_model",
    "flow.convection_scheme": "method.flow.convection_scheme",
    "flow.non_orthogonal_correctors": "method.flow.non_orthogonal_correctors",
    "flow.lid": "method.flow.lid",
    "flow.upstream": "method.flow.upstream",
    "flow.downstream": "method.flow.downstream",
}
"""Keys that study files had before, and what each is called now."""
GONE_KEYS: Mapping[str, tuple[str, str]] = {
    "flow.nodes": (
        "flows are no longer interpolated between roughness lengths",
        "leave it out; beds that are alike share a flow with one "
        "method.flow.roughness, in m",
    ),
    "protocol": (
        "the table is gone",
        "what counts as motion is in [threshold], how a scene is answered in [method] "
        "and [method.grains]: docs/study-file.md",
    ),
}
"""Keys that study files had before: what became of them, and what to write now."""
GONE_VALUES: Mapping[tuple[str, str], tuple[str, str]] = {
    ("method.flow.model", "hill"): (
        "the linear theory of one low hill is gone",
        'write "waves", the linear theory of each wavelength, or "solve"',
    ),
}
"""Values that keys of study files had before: what became of them, and what to write
now."""


def check_moved(data: Mapping[str, Any], where: str) -> None:
    """Refuse a key that study files had before, in the tables of a file or of a group.

    Parameters
    ----------
    data
        The tables, as TOML has them.
    where
        The file, and which group of it.

    Raises
    ------
    InputError
        With the new key.
    """
    for table, content in data.items():
        if not isinstance(content, dict):
            continue
        names = content if table == "axes" else [f"{table}.{key}" for key in content]
        for name in names:
            if name in MOVED:
                place = f"axes.{name}" if table == "axes" else name
                what = f"it is now {MOVED[name]}"
                raise InputError(what, f"{where}: {place}", f"write {MOVED[name]}")


def by_name(data: Mapping[str, Any]) -> Tables:
    """The tables of a scene by their names; those within the method stand beside it.

    Parameters
    ----------
    data
        The tables of a study file or of a group.

    Returns
    -------
    dict of str to dict
        A new table for each name of `fields.PARTS`.

    Examples
    --------
    >>> by_name({"method": {"kind": "dem", "flow": {"speed": 1.0}}})["method.flow"]
    {'speed': 1.0}
    """
    tables: Tables = {}
    for name in PARTS:
        tables[name] = dict(data.get(name, {}))
    for name in METHOD:
        outer, _, inner = name.partition(".")
        # what is no table stays, and the validation refuses it
        if inner and isinstance(tables[outer].get(inner), dict):
            tables[name] |= tables[outer].pop(inner)
    return tables


def nested(tables: Mapping[str, Table]) -> Tables:
    """Put the tables within the method into it, as a scene takes them.

    Parameters
    ----------
    tables
        The tables by name.

    Returns
    -------
    dict of str to dict
        The tables by name.
    """
    whole: Tables = {}
    for name, table in tables.items():
        outer, _, inner = name.partition(".")
        if inner:
            whole[outer].setdefault(inner, table)
        else:
            whole[name] = dict(table)
    return whole
