"""The tables of a study as the claims of the paper are judged by them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from orchestrator.study import fields
from orchestrator.tables import COLUMNS, Tables

WAITING_TIME = 5.0
"""Least waiting time of a held flow, sqrt(d/g'); load steps that wait less make a ramp."""
REGIMES = {"low": "low regime", "high": "high regime"}
BRIDGED = "bridged"
"""The force law of this program that has an answer where neither of the paper's has."""
ANSWERS = ("pile_threshold", "wall_stress")
"""Tables that any threshold method fills; of all others the rows by DEM are taken."""
BESIDE = ("fraction", "flow_level", "grain_level")
"""Columns in which two rows must agree beside those of their scenes."""
GRAIN = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law")
"""Columns in which single grains may differ; in all others the commonest combination is taken."""
PAPER = {"rho_sol_kg_m3": 2500.0, "rho_f_kg_m3": 1.0, "g_m_s2": 9.81, "phi_deg": 35.0}
"""The grains and the gas of the paper: no others are judged."""


@dataclass(frozen=True)
class Evidence:
    """The tables of a study."""

    tables: Tables

    @cached_property
    def scenes(self) -> pd.DataFrame:
        """Every scene of the paper's grains and gas, once."""
        table = self.tables["scenes"].drop_duplicates("scene_id")
        return table[(table[list(PAPER)] == pd.Series(PAPER)).all(axis=1)]

    def joined(self, name: str) -> pd.DataFrame:
        """A table with the columns of its scenes; it has all columns even without rows."""
        table = self.tables.get(name, pd.DataFrame())
        if table.empty:
            return pd.DataFrame(columns=list(COLUMNS), dtype=float)
        extra = [column for column in self.scenes if column not in table or column == "scene_id"]
        table = table.merge(self.scenes[extra], on="scene_id", how="inner", validate="many_to_one")
        return table if name in ANSWERS else table[table["answered_method"] == "dem"]

    @cached_property
    def grains(self) -> pd.DataFrame:
        """Single grains by DEM whose force law holds, under held flows and ramps."""
        table = self.joined("single_grain")
        return table[table["force_law"] == table["regime"]]

    @cached_property
    def held(self) -> pd.DataFrame:
        """Those of them under held flows, of the commonest contact and protocol."""
        return commonest(self.grains)

    @cached_property
    def bridged(self) -> pd.DataFrame:
        """The same by the bridged law, in all regimes and in the transition."""
        table = self.joined("single_grain")
        return commonest(table[table["force_law"] == BRIDGED])

    def piles(self, name: str, packing: str = "aligned", *stresses: str) -> pd.DataFrame:
        """A table of piles of a packing whose force law holds; by default under the wall stress."""
        table = self.joined(name)
        chosen = table["stress"].isin(stresses or ("wall",)) & (table["packing"] == packing)
        return table[chosen & (table["force_law"] == table["regime"])]

    def curves(self) -> Iterator[pd.DataFrame]:
        """Of each pile the load steps in which some grains had moved, in their order."""
        for _, rows in self.piles("pile_curve").groupby("scene_id"):
            moved = rows[rows["moved"] > 0].sort_values("load_step")
            if moved["fraction_moved"].nunique() > 2:
                yield moved


def commonest(grains: pd.DataFrame) -> pd.DataFrame:
    """The grains under held flows that have the commonest contact and protocol."""
    held = grains[grains["waiting_time"] >= WAITING_TIME]
    combination = held.groupby(others(held, *GRAIN), dropna=False).ngroup()
    return held[combination == combination.mode()[0]] if len(held) else held


def others(table: pd.DataFrame, *along: str) -> list[str]:
    """The columns in which two rows agree that differ in some columns alone."""
    beside = [column for column in BESIDE if column in table and column not in along]
    return [*fields.others(table, *along), *beside]


def parts(table: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """The parts of a table that agree in some columns, rising; none of a table without rows."""
    if len(table):
        by: Any = list(columns) if len(columns) > 1 else columns[0]
        yield from table.groupby(by, dropna=False)


def pairs(table: pd.DataFrame, along: str, value: str, ignore: Sequence[str] = ()) -> pd.DataFrame:
    """Neighbours in one column that agree in all other parameters.

    Returns
    -------
    DataFrame
        A row for each pair: ``force_law`` and ``ratio``, the value at the higher end over that at
        the lower; NaN where one of them is missing.
    """
    series = table.groupby(others(table, along, *ignore), dropna=False).ngroup()
    ordered = table.assign(series=series).sort_values(["series", along], kind="stable")
    before = ordered.shift()
    beside = (ordered["series"] == before["series"]) & (ordered[along] > before[along])
    found = ordered[["force_law"]].assign(ratio=ordered[value] / before[value])
    return found[beside].reset_index(drop=True)
