"""The tables of a study file by name, and those within another one in their place."""

from collections.abc import Iterable, Mapping
from typing import Any

from orchestrator.study.fields import PARTS

Table = dict[str, Any]
Tables = dict[str, Table]
"""The tables of a scene by their names, such as ``bed`` and ``method.flow``."""


def by_name(data: Mapping[str, Any], parts: Iterable[str] = PARTS) -> Tables:
    """The tables of a scene by their names; those within the method stand beside it.

    Parameters
    ----------
    data
        The tables of a study file or of a group.
    parts
        The names of the tables of a scene.

    Returns
    -------
    dict of str to dict
        A new table for each name.

    Examples
    --------
    >>> by_name({"method": {"kind": "dem", "flow": {"speed": 1.0}}})["method.flow"]
    {'speed': 1.0}
    """
    tables: Tables = {}
    for name in parts:
        tables[name] = dict(data.get(name, {}))
    for name in [*tables]:
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
