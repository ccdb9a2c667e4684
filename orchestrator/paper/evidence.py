"""The tables of a study as claims are judged by them, and comparisons of many of its scenes."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import pandas as pd

from orchestrator.study import fields
from orchestrator.tables import COLUMNS, Tables
from orchestrator.types import BoolArray, FloatArray

Verdict = Literal["reproduced", "partly", "not", "no data"]

SHARE = 0.95  # part of comparisons from which a statement counts as true; from one less it, false
RULE = (
    f"reproduced: so in at least {SHARE:.0%} of the comparisons of each judged line; not: in at "
    f"most {1 - SHARE:.0%} of each; else partly; no data: if a judged line has none"
)
WAITING_TIME = (
    5.0  # least of a held flow, sqrt(d/g'); load steps that wait less make a ramp
)
REGIMES = {"low": "low regime", "high": "high regime"}
BRIDGED = (
    "bridged"  # the force law that has an answer where neither of the paper's has one
)
ANSWERS = ("pile_threshold", "wall_stress")
"""Tables that any threshold method fills; of all others the rows by DEM are taken."""
BESIDE = ("fraction", "flow_level", "grain_level")
"""Columns in which two rows must agree beside those of their scenes."""
GRAIN = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law")
"""Columns in which single grains may differ; in all others the commonest combination is taken."""
PAPER = {"rho_sol_kg_m3": 2500.0, "rho_f_kg_m3": 1.0, "g_m_s2": 9.81, "phi_deg": 35.0}
"""The grains and the gas of the paper: no others are judged."""


@dataclass(frozen=True)
class Comparison:
    """Values of one quantity in many scenes, and the range in which a claim has them.

    `values` are numbers, NaN where a scene has none, printed by `form`; the claim is true of those
    `above` the one bound and not above the other, `below`. Without a bound they are shown and not
    judged. Bools say themselves if the claim is true, and are judged unless `is_judged` is False.
    """

    name: str
    values: Any
    above: float = -np.inf
    below: float = np.inf
    form: str = ".3g"
    is_judged: bool = True

    @cached_property
    def has_bools(self) -> bool:
        """Whether the values are the answers themselves."""
        return np.asarray(self.values).dtype == bool

    @property
    def is_decisive(self) -> bool:
        """Whether the verdict of a claim depends on these values."""
        return self.is_judged and (
            self.has_bools or self.above > -np.inf or self.below < np.inf
        )

    @cached_property
    def numbers(self) -> FloatArray:
        """The values without those that are missing."""
        values: FloatArray = np.asarray(self.values, float)
        return values[~np.isnan(values)]

    @property
    def true(self) -> BoolArray:
        """Whether the claim is true, for each of the `numbers`."""
        above = 0.0 if self.has_bools else self.above
        return (self.numbers > above) & (self.numbers <= self.below)

    @property
    def verdict(self) -> Verdict:
        """The verdict by the share of true comparisons."""
        if not len(self.numbers):
            return "no data"
        share = self.true.mean()
        return (
            "reproduced"
            if share >= SHARE
            else "not"
            if share <= 1 - SHARE
            else "partly"
        )

    def __str__(self) -> str:
        if not len(self.numbers):
            return f"{self.name}: no data"
        count = f"in {int(self.true.sum())} of {len(self.numbers)}"
        if self.has_bools:
            return f"{self.name}: {count}"
        ends = np.quantile(self.numbers, [0.5, 0.0, 1.0]).tolist()
        middle, least, most = (format(end, self.form) for end in ends)
        spread = (
            middle if least == most else f"{middle} in the median ({least} … {most})"
        )
        bounds = {"above": self.above, "at most": self.below}
        limits = [
            f"{word} {x:{self.form}}" for word, x in bounds.items() if np.isfinite(x)
        ]
        judged = f", {' and '.join(limits)} {count}" if limits else ""
        missing = np.size(self.values) - len(self.numbers)
        lacking = f"; {missing} without a value" if missing else ""
        return f"{self.name}: {spread}{judged}{lacking}"


def combined(verdicts: Iterable[Verdict]) -> Verdict:
    """The verdict of several statements: partly where they differ, none where one lacks data."""
    different = set(verdicts)
    if not different or "no data" in different:
        return "no data"
    return different.pop() if len(different) == 1 else "partly"


class Evidence:
    """The tables of a study."""

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._joined: dict[str, pd.DataFrame] = {}

    @cached_property
    def scenes(self) -> pd.DataFrame:
        """Every scene of the paper's grains and gas, once."""
        table = self._tables["scenes"].drop_duplicates("scene_id")
        return table[(table[list(PAPER)] == pd.Series(PAPER)).all(axis=1)]

    def joined(self, name: str) -> pd.DataFrame:
        """A table with the columns of its scenes; it has all columns even without rows."""
        if name not in self._joined:
            table = self._tables.get(
                name, pd.DataFrame(columns=list(COLUMNS), dtype=float)
            )
            if len(table):
                extra = [
                    item
                    for item in self.scenes
                    if item not in table or item == "scene_id"
                ]
                table = table.merge(
                    self.scenes[extra], on="scene_id", validate="many_to_one"
                )
                by_dem = table["answered_method"] == "dem"
                table = table if name in ANSWERS else table[by_dem]
            # one block: columns are added to more than a hundred others
            self._joined[name] = table.copy()
        return self._joined[name]

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

    def piles(
        self, name: str, packing: str = "aligned", *stresses: str
    ) -> pd.DataFrame:
        """A table of piles of a packing whose force law holds; by default under the wall stress."""
        table = self.joined(name)
        chosen = table["stress"].isin(stresses or ("wall",)) & (
            table["packing"] == packing
        )
        return table[chosen & (table["force_law"] == table["regime"])]

    @cached_property
    def curves(self) -> list[pd.DataFrame]:
        """Of each pile the load steps in which some grains had moved, in their order."""
        table = self.piles("pile_curve")
        moved = table[table["moved"] > 0].sort_values("load_step")
        by_scene = [rows for _, rows in moved.groupby("scene_id")]
        return [rows for rows in by_scene if rows["fraction_moved"].nunique() > 2]


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


def pairs(
    table: pd.DataFrame, along: str, value: str, ignore: Sequence[str] = ()
) -> pd.DataFrame:
    """Neighbours in one column that agree in all other parameters.

    A row for each pair has its ``force_law`` and the ``ratio`` of the value at the higher end to
    that at the lower; NaN where one of them is missing.
    """
    series = table.groupby(others(table, along, *ignore), dropna=False).ngroup()
    ordered = table.assign(series=series).sort_values(["series", along], kind="stable")
    before = ordered.shift()
    beside = (ordered["series"] == before["series"]) & (ordered[along] > before[along])
    ratios = ordered[["force_law"]].assign(ratio=ordered[value] / before[value])
    return ratios[beside].reset_index(drop=True)
