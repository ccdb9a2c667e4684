"""The tables of a study as claims are judged by them, and comparisons of its scenes."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import pandas as pd

from orchestrator.digits import percent
from orchestrator.study import fields
from orchestrator.study.method import HELD_FROM
from orchestrator.tables import Tables, meanings, with_methods, with_scenes
from orchestrator.tables.facts import has_contacts, needs_run
from orchestrator.types import BoolArray, FloatArray

Verdict = Literal["reproduced", "mostly", "half", "mostly not", "not", "no data"]

SHARE = 0.95
"""Part of comparisons that must be true where a statement counts as true.

It counts as false if at most the other part is."""
RULE = (
    f"reproduced: so in at least {percent(SHARE)} of the comparisons of each judged "
    f"line; not: in at most {percent(1 - SHARE)} of each; else mostly or mostly not: "
    "in more or in less than half of all comparisons of these lines together; "
    "not judged: if a judged line has none"
)
REGIMES = {"low": "low regime", "high": "high regime"}
BRIDGED = "bridged"
"""The force law that has an answer where neither of the paper's has one."""
ANSWERS = ("pile_threshold", "wall_stress")
"""Tables of which the rows by every threshold method are taken."""
FREEING = ("pile_curve",)
"""Tables of which the rows by methods are taken in which grains free one another: DEM
and peeling. Of all other tables those by DEM are taken."""
FLOWS = {"eq10": "Eq. 10", "wall": "wall stress"}
"""The stresses on the grains of piles by which a claim on piles is judged: that of the
paper first."""
BESIDE = ("fraction", "fidelity")
"""Columns in which two rows must agree beside those of their scenes."""
GRAIN = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law")
"""Columns in which single grains may differ; in all others the commonest combination is
taken."""
PAPER = {"rho_sol_kg_m3": 2500.0, "rho_f_kg_m3": 1.0, "g_m_s2": 9.81, "phi_deg": 35.0}
"""The grains and the gas of the paper: no others are judged."""


@dataclass(frozen=True)
class Comparison:
    """Values of one quantity in many scenes, and the range in which a claim has them.

    Attributes
    ----------
    name
        What the values are.
    values
        Numbers, NaN where a scene has none; or bools, which say themselves whether the
        claim is true.
    above, below
        The claim is true of numbers above the one and not above the other. Without a
        bound numbers are shown and not judged.
    form
        Format of a number.
    is_judged
        Whether the verdict of a claim may depend on the values.
    flow
        The stress on the grains under which the values were found, of `FLOWS`; empty
        where they depend on no flow over a pile, or on both stresses.
    """

    name: str
    values: Any
    above: float = -np.inf
    below: float = np.inf
    form: str = ".3g"
    is_judged: bool = True
    flow: str = ""

    @cached_property
    def has_bools(self) -> bool:
        """Whether the values are the answers themselves."""
        return np.asarray(self.values).dtype == bool

    @property
    def is_decisive(self) -> bool:
        """Whether the verdict of a claim depends on these values."""
        has_bound = self.above > -np.inf or self.below < np.inf
        return self.is_judged and (self.has_bools or has_bound)

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
        return combined([self])

    @property
    def counts(self) -> tuple[int, int]:
        """In how many of the `numbers` the claim is true, and of how many."""
        return int(self.true.sum()), len(self.numbers)

    @property
    def title(self) -> str:
        """The flow, and what the values are."""
        return f"{FLOWS[self.flow]}, {self.name}" if self.flow else self.name

    def __str__(self) -> str:
        if not len(self.numbers):
            return f"{self.title}: no data"
        count = "in {} of {}".format(*self.counts)
        if self.has_bools:
            return f"{self.title}: {count}"
        limits = []
        if np.isfinite(self.above):
            limits.append(f"above {self._written(self.above)}")
        if np.isfinite(self.below):
            limits.append(f"at most {self._written(self.below)}")
        text = f"{self.title}: {self._spread()}"
        if limits:
            text += f", {' and '.join(limits)} {count}"
        missing = np.size(self.values) - len(self.numbers)
        if missing:
            text += f"; {missing} without a value"
        return text

    def _written(self, number: float) -> str:
        """A number in its format."""
        return format(number, self.form).replace("%", " %").replace("-", "−")

    def _spread(self) -> str:
        """The median of the values, the least and the largest one."""
        ends = np.quantile(self.numbers, [0.5, 0.0, 1.0]).tolist()
        middle, least, most = map(self._written, ends)
        if least == most:
            return middle
        return f"{middle} in the median ({least} … {most})"


def combined(lines: Iterable[Comparison]) -> Verdict:
    """Judge a claim by several lines, by `RULE`.

    Parameters
    ----------
    lines
        The judged lines.

    Returns
    -------
    str
        Mostly, half or mostly not by all comparisons together, where the lines are not
        all true or all false; no data where one of them has none, or none is given.
    """
    counts = [line.counts for line in lines]
    if not counts or not all(of for _, of in counts):
        return "no data"
    if all(true >= SHARE * of for true, of in counts):
        return "reproduced"
    if all(of - true >= SHARE * of for true, of in counts):
        return "not"
    true, of = map(sum, zip(*counts, strict=True))
    if 2 * true == of:
        return "half"
    return "mostly" if 2 * true > of else "mostly not"


class Evidence:
    """The tables of a study.

    Parameters
    ----------
    tables
        The tables.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._joined: dict[str, pd.DataFrame] = {}

    @cached_property
    def scenes(self) -> pd.DataFrame:
        """Every scene of the paper's grains and gas, once."""
        table = with_methods(self._tables["scenes"], self._tables["methods"])
        return table[(table[list(PAPER)] == pd.Series(PAPER)).all(axis=1)]

    def joined(self, name: str) -> pd.DataFrame:
        """Look up a table with the columns of its scenes.

        Parameters
        ----------
        name
            Name of the table.

        Returns
        -------
        DataFrame
            Its rows; it has all columns even without rows.
        """
        if name not in self._joined:
            self._joined[name] = self._with_scenes(name)
        return self._joined[name]

    def _with_scenes(self, name: str) -> pd.DataFrame:
        """A table with the columns of its scenes, or an empty one with all columns."""
        table = self._tables.get(name, pd.DataFrame())
        if table.empty:
            return pd.DataFrame(columns=list(meanings()), dtype=float)
        table = with_scenes(table, self.scenes)
        if name in ANSWERS:
            return table
        if name in FREEING:
            return table[has_contacts(table)]
        return table[needs_run(table)]

    @cached_property
    def _exact(self) -> pd.DataFrame:
        """Single grains by the closed form, in the columns of DEM.

        They stand in where a tolerance leaves no grain to DEM.
        """
        table = self._tables.get("single_grain", pd.DataFrame())
        if table.empty:
            return self.joined("single_grain")
        return with_scenes(table, self.scenes).assign(
            shields_dem=table["shields_closed_form"],
            reynolds=table["reynolds_closed_form"],
        )

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
    def exact(self) -> pd.DataFrame:
        """Those held ones; where DEM was run of none, the same by the closed form."""
        if len(self.held):
            return self.held
        table = self._exact
        return _alike(table[table["force_law"] == table["regime"]])

    @cached_property
    def bridged(self) -> pd.DataFrame:
        """The same by the bridged law, in all regimes and in the transition."""
        table = self.joined("single_grain")
        if table.empty:
            table = self._exact
            return _alike(table[table["force_law"] == BRIDGED])
        return commonest(table[table["force_law"] == BRIDGED])

    @cached_property
    def flows(self) -> list[str]:
        """The stresses of `FLOWS` under which the study has piles."""
        piles = self.scenes[self.scenes["bed"] == "pile"]
        return [flow for flow in FLOWS if (piles["stress"] == flow).any()]

    def piles(self, name: str, *flows: str, packing: str = "aligned") -> pd.DataFrame:
        """Look up the piles of a packing whose force law holds.

        Parameters
        ----------
        name
            Name of a table.
        *flows
            The stresses on their grains.
        packing
            Their packing.

        Returns
        -------
        DataFrame
            Rows of the table with the columns of their scenes.
        """
        table = self.joined(name)
        is_chosen = table["stress"].isin(flows) & (table["packing"] == packing)
        return table[is_chosen & (table["force_law"] == table["regime"])]

    def curves(self, flow: str) -> list[pd.DataFrame]:
        """List how the fraction of each pile grows.

        Parameters
        ----------
        flow
            The stress on the grains.

        Returns
        -------
        list of DataFrame
            Of each pile in rows along the slope the load steps in which some grains
            had moved, in order.
        """
        table = self.piles("pile_curve", flow)
        moved = table[table["moved"] > 0].sort_values("load_step")
        by_scene = [rows for _, rows in moved.groupby("scene_id")]
        return [rows for rows in by_scene if rows["fraction_moved"].nunique() > 2]


def commonest(grains: pd.DataFrame) -> pd.DataFrame:
    """Choose the grains under held flows of the commonest contact and protocol.

    Parameters
    ----------
    grains
        Single grains, under held flows and ramps.

    Returns
    -------
    DataFrame
        Those grains.
    """
    return _alike(grains[grains["waiting_time"] >= HELD_FROM])


def _alike(grains: pd.DataFrame) -> pd.DataFrame:
    """The grains of the commonest combination of what is not of `GRAIN`."""
    if grains.empty:
        return grains
    combination = grains.groupby(other_columns(grains, *GRAIN), dropna=False).ngroup()
    return grains[combination == combination.mode()[0]]


def other_columns(table: pd.DataFrame, *along: str) -> list[str]:
    """Name the columns in which two rows agree that differ in some columns alone.

    Parameters
    ----------
    table
        The table.
    *along
        The columns in which they differ.

    Returns
    -------
    list of str
        All other columns of their scenes, with those of `BESIDE`.
    """
    beside = [column for column in BESIDE if column in table and column not in along]
    return [*fields.others(table, *along), *beside]


def parts(table: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Divide a table into parts that agree in some columns.

    Parameters
    ----------
    table
        The table; one without rows has no parts.
    *columns
        The columns.

    Yields
    ------
    key, part
        The values of the columns, rising, and the rows that have them.
    """
    if len(table):
        by: Any = list(columns) if len(columns) > 1 else columns[0]
        yield from table.groupby(by, dropna=False)


def pairs(
    table: pd.DataFrame, along: str, value: str, ignore: Sequence[str] = ()
) -> pd.DataFrame:
    """Compare neighbours in one column that agree in all other parameters.

    Parameters
    ----------
    table
        The table.
    along
        The column in which they are neighbours.
    value
        The column that is compared.
    ignore
        Columns in which they need not agree.

    Returns
    -------
    DataFrame
        A row for each pair, with ``force_law`` and ``alpha_deg`` of its higher end and
        the ``ratio`` of the value there to that at the lower; NaN where one of them is
        missing.
    """
    series = table.groupby(other_columns(table, along, *ignore), dropna=False).ngroup()
    ordered = table.assign(series=series).sort_values(["series", along], kind="stable")
    before = ordered.shift()
    beside = (ordered["series"] == before["series"]) & (ordered[along] > before[along])
    own = ordered[["force_law", "alpha_deg"]]
    ratios = own.assign(ratio=ordered[value] / before[value])
    return ratios[beside].reset_index(drop=True)
