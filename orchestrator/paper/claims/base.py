"""Judged claims, and comparisons of a study's scenes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import pandas as pd

from orchestrator.report.results import by_dem, split
from orchestrator.study import fields
from orchestrator.tables import Tables

Verdict = Literal["reproduced", "partly", "not", "no data"]

MOST = 0.95
"""Share of comparisons from which a claim counts as reproduced; one less it: as not."""
BY_SHARE = (
    f"reproduced: so in at least {MOST:.0%} of the comparisons of each regime; not: in at most "
    f"{1 - MOST:.0%} of each; else partly"
)
WAITING_TIME = 5.0
"""Least waiting time of what is a load step rather than a ramp, sqrt(d/g')."""
NAMES: dict[str, str] = {"low": "low regime", "high": "high regime"}
BRIDGED = "bridged"
"""The law of this program that has an answer where neither of the paper's has."""
ANSWERS = ("pile_threshold", "wall_stress")
"""Tables that are answers by whatever method; the others show what DEM alone measures."""
BESIDE = ("fraction", "flow_level", "grain_level")
"""Columns in which two answers must agree beside those of their scenes."""
GRAIN = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law")
"""Columns by which single grains are told apart. Of all others they are judged at one combination:
the one with most scenes."""
PAPER = {"rho_sol_kg_m3": 2500.0, "rho_f_kg_m3": 1.0, "g_m_s2": 9.81, "phi_deg": 35.0}
"""The grains and the gas of the paper: no others are judged."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, judged.

    Attributes
    ----------
    says, where : str
        The paper's words in short, and its section or figure.
    measured : tuple of str
        What this study gives.
    rule : str
        When it counts as reproduced, partly or not.
    verdict : {"reproduced", "partly", "not", "no data"}
        By the rule, from the numbers.
    why : str
        The physics behind it.
    figures : tuple of str
        How the names of the page's figures that show it begin.
    """

    says: str
    where: str
    measured: tuple[str, ...]
    rule: str
    verdict: Verdict
    why: str
    figures: tuple[str, ...]


@dataclass(frozen=True)
class Evidence:
    """The tables of a study, as the claims are judged by them."""

    tables: Tables

    @cached_property
    def scenes(self) -> pd.DataFrame:
        """Every scene of the paper's grains and gas, once."""
        table = self.tables["scenes"].drop_duplicates("scene_id")
        return table[(table[list(PAPER)] == pd.Series(PAPER)).all(axis=1)]

    def joined(self, name: str) -> pd.DataFrame:
        """A table with its scenes' columns; it has all columns even where it has no rows."""
        table = self.tables.get(name, pd.DataFrame())
        if table.empty:
            columns = [*self.scenes, *fields.COLUMNS, *fields.ANSWERS, *BESIDE, *EMPTY]
            return pd.DataFrame(columns=list(dict.fromkeys(columns))).astype(object)
        extra = [column for column in self.scenes if column not in table or column == "scene_id"]
        table = table.merge(self.scenes[extra], on="scene_id", how="inner", validate="many_to_one")
        return table if name in ANSWERS else by_dem(table)

    @cached_property
    def grains(self) -> pd.DataFrame:
        """Single grains whose force law holds, of any protocol."""
        table = self.joined("single_grain")
        return table[in_regime(table)]

    @cached_property
    def held(self) -> pd.DataFrame:
        """Those of them under held flows, at the study's commonest contact and protocol."""
        return _commonest(self.grains)

    @cached_property
    def bridged(self) -> pd.DataFrame:
        """The same of the law that has an answer between the regimes; the paper has none there."""
        table = self.joined("single_grain")
        return _commonest(table[table["force_law"] == BRIDGED])

    def piles(self, name: str, packing: str = "aligned") -> pd.DataFrame:
        """A table of piles of one packing under the wall's stress, whose force law holds."""
        table = self.joined(name)
        return table[in_regime(table) & (table["packing"] == packing) & (table["stress"] == "wall")]


def _commonest(grains: pd.DataFrame) -> pd.DataFrame:
    """Grains under held flows, at the commonest contact and protocol."""
    held = grains[grains["waiting_time"] >= WAITING_TIME]
    choices = others(held, *GRAIN)
    if held.empty:
        return held
    combination = held.groupby(choices, sort=True, dropna=False).ngroup()
    return held[combination == combination.mode()[0]]


def in_regime(table: pd.DataFrame) -> pd.Series:
    """Whether each row has the forces of its scene's regime, by the paper's rule."""
    return pd.Series(np.asarray(table["force_law"] == table["regime"]), index=table.index)


EMPTY = (
    "ustar_m_s",
    "ustar_closed_form_m_s",
    "ustar0_m_s",
    "shields",
    "shields_dem",
    "shields_dem_low",
    "shields_closed_form",
    "reynolds",
    "reynolds_closed_form",
    "count",
    "moved",
    "fraction_moved",
    "mode",
    "s_m",
    "moved_in_load_step",
    "frozen_bed",
)
"""Columns of results that are asked for even of tables without rows."""


def pairs(table: pd.DataFrame, along: str, value: str, ignore: Sequence[str] = ()) -> pd.DataFrame:
    """Neighbours in one column that agree in all other parameters.

    Returns
    -------
    DataFrame
        A row for each pair: ``force_law``, ``low`` and ``high`` of the column, and ``ratio``, the
        value at the higher over that at the lower; NaN where one is missing.
    """
    same = others(table, along, *ignore)
    series = table.groupby(same, sort=True, dropna=False).ngroup()
    columns = {
        "series": series,
        "force_law": table["force_law"],
        "x": table[along],
        "y": table[value],
    }
    ordered = pd.DataFrame(columns).sort_values(["series", "x"], kind="stable")
    low, high = ordered.iloc[:-1].reset_index(drop=True), ordered.iloc[1:].reset_index(drop=True)
    beside = (low["series"] == high["series"]) & (high["x"] > low["x"])
    found = {"force_law": low["force_law"], "low": low["x"], "high": high["x"]}
    return pd.DataFrame({**found, "ratio": high["y"] / low["y"]})[beside].reset_index(drop=True)


def others(table: pd.DataFrame, *along: str) -> list[str]:
    """The columns in which rows of a table agree that are equal in all else than some."""
    beside = [column for column in BESIDE if column in table and column not in along]
    return [*fields.others(table, *along), *beside]


def rising(found: pd.DataFrame, each: str) -> str:
    """How many pairs rise, and by how much in the middle."""
    known = found["ratio"].dropna()
    silent = len(found) - len(known)
    text = (
        f"rises in {int((known > 1).sum())} of {len(known)} pairs, by a factor of "
        f"{known.median():.3f} in the median ({known.min():.3f} … {known.max():.3f}) {each}"
    )
    return text + (f"; {silent} pairs without a threshold" if silent else "")


def by_regime(found: pd.DataFrame, each: str) -> tuple[str, ...]:
    """`rising` for each regime that has pairs."""
    parts = {law_name: found[found["force_law"] == law_name] for law_name in NAMES}
    return tuple(
        f"{NAMES[law_name]}: {rising(part, each)}"
        for law_name, part in parts.items()
        if part["ratio"].notna().any()
    )


def up(found: pd.DataFrame) -> Verdict:
    """Whether a value rises, by `BY_SHARE`."""
    known = found[found["ratio"].notna()]
    return combined(by_share(part["ratio"] > 1) for _, part in split(known, "force_law"))


def by_share(true: Iterable[object]) -> Verdict:
    """The verdict of yes and no."""
    answers = np.array(list(true), bool)
    if not len(answers):
        return "no data"
    share = answers.mean()
    return "reproduced" if share >= MOST else "not" if share <= 1 - MOST else "partly"


def combined(verdicts: Iterable[Verdict]) -> Verdict:
    """One verdict of several: partly where they differ."""
    known = {verdict for verdict in verdicts if verdict != "no data"}
    return "no data" if not known else known.pop() if len(known) == 1 else "partly"
