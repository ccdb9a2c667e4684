"""The source of a report: the study, its cases and its tables."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pandas as pd

from orchestrator.grains.pile import Pile
from orchestrator.plan import Plan
from orchestrator.runs.case import is_whole
from orchestrator.study.study import Study
from orchestrator.tables import Tables

RAMP_BELOW = 3.0
"""Quiet time, sqrt(d/g'), below which a sequence of load steps is a ramp."""


@dataclass(frozen=True)
class Results:
    """A study with all that came of it.

    Attributes
    ----------
    study, plan, tables
        As the pipeline made them.
    cases : Path
        The directory of the study's cases.
    """

    study: Study
    plan: Plan
    tables: Tables
    cases: Path

    @cached_property
    def scenes(self) -> pd.DataFrame:
        """Every scene once, whichever groups asked for it."""
        return self.tables["scenes"].drop_duplicates("scene_id").reset_index(drop=True)

    def beds(self, kind: str) -> pd.DataFrame:
        """The scenes with one kind of bed."""
        return self.scenes[self.scenes["bed"] == kind]

    def joined(self, name: str) -> pd.DataFrame:
        """A table with the columns of its rows' scenes beside its own, or an empty one."""
        table = self.tables.get(name, pd.DataFrame())
        if table.empty:
            return pd.DataFrame()
        extra = [column for column in self.scenes if column not in table or column == "scene_id"]
        return table.merge(self.scenes[extra], on="scene_id", how="left", validate="many_to_one")

    def values(self, column: str) -> list[float]:
        """The values that the study's scenes have in a column, rising."""
        return sorted({float(value) for value in self.scenes[column].dropna()})

    def shown(self, scene_id: str) -> Pile:
        """The pile that shows how a scene's grains move: where DEM only checked it, the check.

        A check that has not run, or failed, shows nothing.
        """
        check = self.plan.checks.get(scene_id)
        return check if check and self.has_files(check) else self.plan.piles[scene_id]

    def asked(self, pile: Pile) -> pd.Series:
        """The row of a pile's scene in the table of scenes; of scenes that share it, the first."""
        found = next(asked for asked, one in self.plan.piles.items() if one is pile)
        return self.scenes[self.scenes["scene_id"] == found].iloc[0]

    def has_files(self, pile: Pile) -> bool:
        """Whether a pile's runs and its flow's still have the files of pictures."""
        return all(is_whole(one, self.cases) for one in pile.runs)

    @cached_property
    def flows(self) -> dict[str, Pile]:
        """A pile for each flow case whose stress is in the tables, by the flow case's name."""
        stress = self.tables.get("wall_stress", pd.DataFrame())
        done = set() if stress.empty else set(stress["flow_case"])
        piles = self.plan.piles.values()
        return {flow.name: pile for pile in piles for flow in pile.model.cases if flow.name in done}


def split(
    table: pd.DataFrame, *columns: str
) -> Iterator[tuple[tuple[Hashable, ...], pd.DataFrame]]:
    """The parts of a table that agree in some columns, with what they agree in, in rising order."""
    if len(table):
        yield from table.groupby(list(columns), sort=True, dropna=False)


def held(table: pd.DataFrame) -> pd.Series:
    """Whether each row's scene holds the flow until its grains are quiet; else it is a ramp.

    A grain half a per cent above its threshold takes 6 sqrt(d/g') to pass the marker.
    """
    return ~(table["waiting_time"] < RAMP_BELOW)


def by_dem(table: pd.DataFrame) -> pd.DataFrame:
    """The rows that DEM found; those of a formula hold nothing that was measured."""
    return table[table["answered_method"] == "dem"] if len(table) else table


def valid(table: pd.DataFrame) -> pd.Series:
    """Whether each threshold is usable; of scenes, whether their force law holds.

    A scene is judged at its own single-grain threshold.
    """
    return table["usable" if "usable" in table else "law_holds"].astype(bool)
