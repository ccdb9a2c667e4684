"""The source of a report: the study, its cases and its tables."""

from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from orchestrator.grains.pile import Pile
from orchestrator.plan import Plan
from orchestrator.runs.case import Case, is_whole
from orchestrator.study import fields
from orchestrator.study.method import HELD_FROM
from orchestrator.study.study import Study
from orchestrator.tables import with_methods, with_scenes
from orchestrator.tables.facts import needs_run
from orchestrator.tables.flows import measured_hill
from orchestrator.tables.quoted import reported

FRACTION = 0.3  # n/N at which one threshold stands for all of its pile
Made = TypeVar("Made")


@dataclass
class Reads:
    """What a part of a page was made from, by name.

    Attributes
    ----------
    tables
        The tables that were asked for, also in vain.
    cases
        The cases whose files were asked for, also in vain.
    """

    tables: set[str] = field(default_factory=set)
    cases: set[str] = field(default_factory=set)


class _Noted(Mapping[str, pd.DataFrame]):
    """Tables that note which of them are read."""

    def __init__(
        self, tables: Mapping[str, pd.DataFrame], note: Callable[[str], None]
    ) -> None:
        self._tables = dict(tables)
        self._note = note

    def __getitem__(self, name: str) -> pd.DataFrame:
        self._note(name)
        return self._tables[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)


@dataclass(frozen=True, eq=False)
class Results:
    """A study with its plan, its tables and the directory of its cases.

    Attributes
    ----------
    study
        What was asked.
    plan
        How each scene is answered, and by which cases.
    tables
        The tables by name; which of them are read is noted.
    cases
        The directory of the cases.
    """

    study: Study
    plan: Plan
    tables: Mapping[str, pd.DataFrame]
    cases: Path
    _reads: list[Reads] = field(default_factory=lambda: [Reads()], init=False)
    _made: dict[Hashable, tuple[Any, Reads]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        noted = _Noted(self.tables, lambda name: self._reads[-1].tables.add(name))
        object.__setattr__(self, "tables", noted)

    @contextmanager
    def noted(self) -> Iterator[Reads]:
        """Note what is read in a block.

        Yields
        ------
        Reads
            What was read, with what that was made from which had been made before.
        """
        self._reads.append(Reads())
        try:
            yield self._reads[-1]
        finally:
            inner = self._reads.pop()
            self._add(inner)

    def _add(self, reads: Reads) -> None:
        self._reads[-1].tables |= reads.tables
        self._reads[-1].cases |= reads.cases

    def once(self, name: Hashable, make: Callable[[], Made]) -> Made:
        """Make something once; whoever asks for it has read what it is made from.

        Parameters
        ----------
        name
            Its name.
        make
            Makes it.

        Returns
        -------
        object
            It, as it was made the first time.
        """
        if name not in self._made:
            with self.noted() as reads:
                self._made[name] = make(), reads
        made, reads = self._made[name]
        self._add(reads)
        value: Made = made
        return value

    def is_whole(self, case: Case) -> bool:
        """Say whether a case has all of its files, of which some may be read now.

        Returns
        -------
        bool
            Whether it is done, and nothing was pruned.
        """
        self._reads[-1].cases.add(case.name)
        return is_whole(case, self.cases)

    @property
    def scenes(self) -> pd.DataFrame:
        """Every scene once, whichever groups asked for it, with its method."""

        def make() -> pd.DataFrame:
            return with_methods(self.tables["scenes"], self.tables["methods"])

        return self.once("scenes", make)

    def beds(self, kind: str) -> pd.DataFrame:
        """Pick the scenes with one kind of bed.

        Parameters
        ----------
        kind
            ``pile`` or ``grain``.

        Returns
        -------
        DataFrame
            Their rows of `scenes`.
        """
        return self.scenes[self.scenes["bed"] == kind]

    @property
    def flow_fields(self) -> list[str]:
        """The fields of the solved flow in which the piles differ."""
        return self.once("flow_fields", self._flow_fields)

    def _flow_fields(self) -> list[str]:
        count = self.beds("pile").nunique(dropna=False)
        solved = [
            name
            for name, each in fields.COLUMNS.items()
            if each.info.scope == "solved flows"
        ]
        return [name for name in solved if count[name] > 1]

    def joined(self, name: str) -> pd.DataFrame:
        """Join a table with the columns of its rows' scenes.

        Parameters
        ----------
        name
            Name of the table.

        Returns
        -------
        DataFrame
            Its own columns and those of the scenes that it lacks; empty without the
            table.
        """

        def make() -> pd.DataFrame:
            table = self.tables.get(name, pd.DataFrame())
            return table if table.empty else with_scenes(table, self.scenes)

        return self.once(("joined", name), make)

    def values(self, column: str) -> list[float]:
        """List the values that the study's scenes have in a column.

        Parameters
        ----------
        column
            Name of the column, whose values are numbers.

        Returns
        -------
        list of float
            The values, each once, rising.
        """
        return sorted({float(value) for value in self.scenes[column].dropna()})

    @property
    def at_fraction(self) -> pd.DataFrame:
        """The thresholds of piles at the fraction of the sentences, nearest to 30 %."""
        return self.once("at_fraction", self._at_fraction)

    def _at_fraction(self) -> pd.DataFrame:
        rows = self.joined("pile_threshold")
        if rows.empty:
            return rows
        nearest: float = min(
            set(rows["fraction"]), key=lambda n: abs(float(n) - FRACTION)
        )
        return rows[rows["fraction"] == nearest]

    def ratios(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Add to thresholds of piles their ratios to those without shelter.

        Parameters
        ----------
        rows
            Thresholds of piles.

        Returns
        -------
        DataFrame
            The rows with the ratio columns of the table ``paired``, and with those of
            the first motion behind ``first_``; as they are without the table.
        """
        paired = self.tables.get("paired", pd.DataFrame())
        if paired.empty:
            return rows
        names = [
            str(name)
            for name in paired
            if "_ratio" in str(name) or name == "ratio_usable"
        ]
        of_first = paired[paired["fraction"].isna()].set_index("scene_id")[names]
        keys = ["scene_id", "fraction"]
        of_rows = paired.dropna(subset="fraction").set_index(keys)[names]
        return rows.join(of_rows, on=keys).join(
            of_first.add_prefix("first_"), on="scene_id"
        )

    @property
    def exemplars(self) -> pd.DataFrame:
        """The thresholds at that fraction, seeds as one, rising by slope.

        Of each slope the usable first, then large grains, DEM, beds that wear, the
        least z0. Beds that do not reach the fraction are not among them.
        """
        return self.once("exemplars", self._exemplars)

    def _exemplars(self) -> pd.DataFrame:
        if self.at_fraction.empty:
            return self.at_fraction
        here = seeds_as_one(self.at_fraction)
        here = here[here["shields"].notna()]
        order = here.assign(run=needs_run(here), wears=here["update"] > 0)
        by = ["alpha_deg", "usable", "d_m", "run", "wears", "z0_over_d"]
        return order.sort_values(
            by, ascending=[True, *[False] * 4, True], kind="stable"
        )

    def shown(self, scene_id: str) -> list[Pile]:
        """List the piles whose files show how a scene's grains move.

        Parameters
        ----------
        scene_id
            The scene.

        Returns
        -------
        list of Pile
            Those whose files are complete, a check by DEM first.
        """
        piles = [self.plan.piles[scene_id]]
        if scene_id in self.plan.checks:
            piles.insert(0, self.plan.checks[scene_id])
        return [pile for pile in piles if self._is_whole(pile)]

    def _is_whole(self, pile: Pile) -> bool:
        are_whole = [self.is_whole(run) for run in pile.runs]  # each is noted
        return all(are_whole)

    @property
    def flows(self) -> dict[str, Pile]:
        """A pile for each flow case whose stress is in the tables, by its name."""
        return self.once("flows", self._flows)

    def _flows(self) -> dict[str, Pile]:
        stress = self.tables.get("wall_stress", pd.DataFrame())
        done = set() if stress.empty else set(stress["flow_case"])
        found = {}
        for pile in self.plan.piles.values():
            for name, solve in pile.solves.items():
                if name in done:
                    found[name] = solve
        return found


def measured_hills(results: Results) -> Iterator[tuple[float, pd.DataFrame]]:
    """List the flows over hills that others measured.

    Yields
    ------
    aspect : float
        Half length of the hill, in its heights; the steepest first.
    rows : DataFrame
        The rows of ``flow`` over it.
    """
    flows = results.tables.get("flow", pd.DataFrame())
    if "measured_source" not in flows:
        return
    for _, rows in reversed(
        list(flows.dropna(subset=["measured_source"]).groupby("alpha_deg"))
    ):
        hill = measured_hill(results.flows[str(rows["flow_case"].iloc[0])])
        assert hill
        yield hill.aspect, rows


def split_by(
    table: pd.DataFrame, *by: str
) -> Iterator[tuple[tuple[Hashable, ...], pd.DataFrame]]:
    """List the parts of a table that agree in some columns.

    Parameters
    ----------
    table
        The table.
    *by
        The columns.

    Yields
    ------
    values : tuple
        What the rows of a part agree in, in rising order.
    rows : DataFrame
        The part.
    """
    if len(table):
        yield from table.groupby(list(by), sort=True, dropna=False)


def seeds_as_one(rows: pd.DataFrame) -> pd.DataFrame:
    """Merge thresholds of piles that differ in their seed alone.

    The tables give all of them one interval, which holds them all.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    DataFrame
        A row with the means over the usable seeds, or over all if none is, with the
        columns ``seeds``, how many seeds the means are of, and ``of_seeds``, how many
        there are.
    """
    keys = _but_seed(rows)
    usable = valid(rows)
    twins = usable.groupby([rows[key] for key in keys], dropna=False)
    is_told = usable | ~twins.transform("any")
    rows = rows.assign(of_seeds=twins.transform("size"))[is_told]
    # of seeds that are not usable the first that reached the fraction stands for all
    rows = rows.sort_values("shields", key=pd.isna, kind="stable")
    groups = rows.groupby(keys, dropna=False)
    names = [
        "shields",
        "ustar0_m_s",
        "first_ustar0_m_s",
        "shields_model_low",
        "shields_model_high",
    ]
    means: pd.DataFrame = groups[names].transform("mean")
    rows = rows.assign(**means, seeds=groups["shields"].transform("count"))
    return reported(rows.drop_duplicates(keys))


def _but_seed(rows: pd.DataFrame) -> list[str]:
    """The columns in which thresholds of beds that differ in their seed alone agree."""
    return [*fields.others(rows, "seed"), "asked", "fraction"]


def seeds_of(row: pd.Series, rows: pd.DataFrame) -> list[str]:
    """List the scenes whose beds differ from that of a row in their seed alone.

    Parameters
    ----------
    row
        A row of the thresholds.
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    list of str
        The ids, without that of the row.
    """
    groups = rows.groupby(_but_seed(rows), dropna=False).ngroup()
    is_row = (rows["scene_id"] == row["scene_id"]) & (
        rows["fraction"] == row["fraction"]
    )
    is_twin = groups.isin(groups[is_row]) & ~is_row
    return [str(name) for name in rows.loc[is_twin, "scene_id"]]


def drawable(table: pd.DataFrame, *columns: str) -> "pd.Series[bool]":
    """Say which rows have a place on logarithmic axes.

    Parameters
    ----------
    table
        The rows.
    *columns
        The columns that are drawn.

    Returns
    -------
    Series of bool
        Whether their values are finite and above zero.
    """
    values = table[list(columns)]
    return ((values > 0) & (values < np.inf)).all(axis=1)


def held(table: pd.DataFrame) -> "pd.Series[bool]":
    """Say which rows hold the flow until the grains are quiet; the others are a ramp.

    Parameters
    ----------
    table
        Rows with the columns of their scenes.

    Returns
    -------
    Series of bool
        Whether each does.
    """
    return ~(table["waiting_time"] < HELD_FROM)


def valid(table: pd.DataFrame) -> "pd.Series[bool]":
    """Say which thresholds are usable, or which scenes are within their force law.

    Parameters
    ----------
    table
        Thresholds, or scenes.

    Returns
    -------
    Series of bool
        Whether each threshold is usable; of scenes, whether their law holds there.
    """
    return table["usable" if "usable" in table else "law_holds"].astype(bool)


def case_names(*tables: pd.DataFrame) -> tuple[str, ...]:
    """List the cases behind the rows of tables.

    Parameters
    ----------
    *tables
        Tables with a column ``case``, or empty ones.

    Returns
    -------
    tuple of str
        The names, each once, in order.
    """
    names: set[str] = set()
    for rows in tables:
        if len(rows):
            names.update(rows["case"].dropna().astype(str))
    return tuple(sorted(names))
