"""The public Python face: `threshold`, `run` and `open`."""

import os
import warnings
from collections.abc import Mapping
from html import escape
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from orchestrator import guests, pipeline, report, tables
from orchestrator.calculator import BY_FLUID, LENGTHS, PARAMETERS
from orchestrator.calculator.asked import thresholds_and_questions
from orchestrator.calculator.cli import OPTIONS
from orchestrator.errors import InputError, OrchestratorError, SolverError
from orchestrator.report import words
from orchestrator.report.card import Card
from orchestrator.report.results import Results
from orchestrator.runs import processors
from orchestrator.runs.workspace import Workspace
from orchestrator.study import study
from orchestrator.study.units import meant

FIRST = (
    "d_m",
    "alpha_deg",
    "fraction",
    "wind_10m_m_s",
    "wind_10m_low_m_s",
    "wind_10m_high_m_s",
    "mean_velocity_m_s",
    "mean_velocity_low_m_s",
    "mean_velocity_high_m_s",
    "stress_pa",
    "stress_low_pa",
    "stress_high_pa",
    "ustar0_m_s",
    "ustar0_low_m_s",
    "ustar0_high_m_s",
    "interval_of",
    "compared_ustar0_m_s",
    "shields",
    "usable",
    "why_not",
)
"""Columns of `Opened.thresholds` that come before all others, those that have values.

The flow and its interval are those of the page.
"""
OF_GRAINS = {
    "ustar0_m_s": ("ustar_m_s", "ustar_closed_form_m_s"),
    "shields": ("shields_dem", "shields_closed_form"),
}
"""Columns of single grains, by DEM and by the closed form, for those of piles."""
DICTIONARY = "study"
"""Name of a study from a dictionary."""
if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike, NDArray


def threshold(
    diameter: "ArrayLike",
    *,
    law: str | None = "auto",
    fluid: str | None = None,
    temperature: "ArrayLike | None" = None,
    criterion: str = BY_FLUID,
    **parameters: "ArrayLike",
) -> pd.DataFrame:
    """Thresholds of motion of single grains by the closed form.

    All parameters but `law`, `fluid` and `criterion` are numbers or arrays that
    broadcast together.

    Parameters
    ----------
    diameter
        Grain diameter, m.
    law
        A force law, ``auto`` for `bridged`, or `bridged-gravel` where its drag law
        ends, ``paper`` for the paper's rule, or None for every law.
    fluid
        "water", "seawater" or "air", in place of density and viscosity, or "paper",
        the paper's gas, which is the default where neither is given.
    temperature
        Of that fluid, deg C, by default 15.
    criterion
        What a grain must do: "entrained", which is to leave its pocket, or "sustained",
        to leave it in a gust and to roll and hop on after it. The threshold is then the
        larger of both mean stresses, and there are columns of both, of its ends, of the
        stress at which motion ceases, and of which decides. "auto" is "entrained" in
        the paper's gas and by its laws, "sustained" in all others.
    **parameters
        Any of those below, by their names.
    density, fluid_density
        Densities of the grains (2500) and of the fluid (1), kg/m3.
    viscosity
        Kinematic viscosity (1e-5), m2/s.
    slope_deg
        Slope of the bed (0), which the flow goes up, degrees.
    entrainment_angle_deg
        Angle (60) of the contact that a grain rolls over, degrees.
    roughness
        Roughness length z0 of the grain's pocket, m, or a part of the diameter
        ("d/30").
    lift_coefficient
        Saffman's (1.615).
    gravity
        Acceleration of gravity (9.81), m/s2.
    cohesion
        Pull of a contact over the diameter (0), N/m.
    depth
        Depth of a liquid, m, for its mean velocity and its discharge.
    bed_slope
        Slope at which a channel falls, whatever its sign, in place of a depth: the
        depth is that of the uniform flow at the threshold.
    channel_roughness
        Roughness length z0 of the channel, or of the ground in air, m, or a part of the
        diameter: speeds and discharge follow from it. By default it is that of the
        pocket, and d84/10 where there is a depth.
    d84
        Diameter that 84 % by mass of the bed of a channel are finer than (the
        diameter), m.

    Returns
    -------
    DataFrame
        A row for each point of the raveled arrays, or for each point and law, with
        units in the columns' names; ``valid`` and ``why_not`` say where a law ends. Of
        series and frames it has their index, so that it can be assigned to them.
        A number that is usual in another unit is asked about in a warning.

    Raises
    ------
    InputError
        For a point that is no scene, a law or criterion that is none, or if no law
        holds at any point.

    Examples
    --------
    Two sizes of grains on a level bed in the paper's gas:

    >>> rows = threshold([2e-4, 1e-3])
    >>> rows["law"].tolist()
    ['bridged', 'bridged']
    >>> rows["shields"].round(4).tolist()
    [0.0272, 0.0323]
    """
    for name, word in {"law": law, "fluid": fluid, "criterion": criterion}.items():
        if not isinstance(word, str | None):
            raise InputError(f"{word!r} is no name", name, "write one, such as a text")
    given: dict[str, Any] = {"diameter": diameter, **parameters}
    if temperature is not None:
        given["temperature"] = temperature
    index = _index(given)
    points = _points(given)
    names = {name: name for name in OPTIONS}
    form = "{} {:.4g}"
    temperatures = points.pop("temperature", None)
    table, asked = thresholds_and_questions(
        points, law or "auto", fluid, temperatures, names, form, criterion
    )
    if asked:
        warnings.warn("; ".join(asked), stacklevel=2)
    rows = pd.DataFrame(table)
    count = len(points["diameter"])
    is_indexed = index is not None and len(index) == count
    if index is not None and is_indexed:
        rows.index = index.repeat(len(rows) // count)
    chosen = rows if law is None else rows[rows["answer"]]
    chosen = chosen.drop(columns="answer")
    return chosen if is_indexed else chosen.reset_index(drop=True)


def _points(given: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Columns of one length of parameters that broadcast together."""
    columns = {}
    for name, values in given.items():
        if name not in (*PARAMETERS, "temperature"):
            what = f"there are {', '.join(PARAMETERS)}"
            raise InputError("no such parameter", name, what)
        columns[name] = _column(name, values)
    try:
        arrays = np.broadcast_arrays(*columns.values())
    except ValueError as error:
        raise InputError(str(error), where="threshold") from None
    points = {}
    for name, array in zip(columns, arrays, strict=True):
        points[name] = array.ravel().tolist()
    if not points["diameter"]:
        remedy = "give one diameter at least"
        raise InputError("the arrays have no point", "threshold", remedy)
    return points


def _index(given: Mapping[str, Any]) -> "pd.Index[Any] | None":
    """The index of the series and frames among some parameters; None without any.

    Rows are paired by their places, so that all must have one index.
    """
    first = ""
    index = None
    for name, values in given.items():
        if not isinstance(values, pd.Series | pd.DataFrame):
            continue
        if index is None:
            first = name
            index = values.index
        elif not values.index.equals(index):
            what = f"its index is not that of {first}"
            raise InputError(what, name, "align them first, or give .to_numpy()")
    return index


def _column(name: str, values: Any) -> "NDArray[Any]":
    """The values of a parameter as an array: numbers, for a roughness also texts."""
    what = f"{values!r} is neither a number nor an array of numbers"
    remedy = ""
    if isinstance(values, str):
        remedy = meant(values)
    refusal = InputError(what, name, remedy)
    try:
        array = np.asarray(values)
        if name in LENGTHS and array.dtype.kind in "UO":
            return np.asarray(values, object)
        if array.dtype.kind not in "iufO":
            # Python makes numbers of texts and of truths
            raise refusal
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise refusal from None


def run(
    source: str | Path | Mapping[str, Any],
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    tolerance: float | None = None,
) -> "Opened":
    """Run what is missing of a study, draw it, and open it.

    Parameters
    ----------
    source
        The study file, the name of a preset, or a dictionary with the tables of a
        study file, such as ``{"grain": {"diameter": 1e-3}}``; files that it names are
        those of the working directory.
    out
        The directory, by default ``results/NAME``, of a dictionary ``results/study``.
    workers
        Number of cases at a time, by default one for each processor that the process
        may use.
    tolerance
        Relative error that thresholds may have.

    Returns
    -------
    Opened
        The study.

    Raises
    ------
    InputError
        If the study cannot be answered.
    SolverError
        If a solver is missing or cases failed; what is done stays, and the same call
        goes on.
    """
    if workers is None:
        workers = processors.usable_count()
    given: Any = workers  # Python gives what it likes
    if isinstance(given, bool) or not isinstance(given, Integral):
        raise InputError(f"{workers!r} is no whole number", where="workers")
    if workers < 1:
        raise InputError(f"{workers} is below 1", where="workers")
    if out is not None:
        _check_path("out", out)
    [*guests.offers()]  # they have hints on the keys of their own beds
    if isinstance(source, Mapping):
        asked = study.of_dictionary(source, DICTIONARY, tolerance)
    else:
        _check_path("source", source)
        asked = study.load(source, tolerance)
    place = Path(out or Path("results") / asked.name)
    finished = pipeline.run(asked, place, workers=workers)
    if finished.failures:
        name, error = next(iter(finished.failures.items()))
        what = f"{len(finished.failures)} cases failed; {name}: {error}"
        raise SolverError(what, where=str(place))
    return open(place)


def open(directory: str | Path) -> "Opened":
    """Open the directory of a study that was run.

    Parameters
    ----------
    directory
        The directory.

    Returns
    -------
    Opened
        The study.

    Raises
    ------
    OrchestratorError
        If it holds no study or no tables, or these have changed since, or are of
        another version of this program.
    """
    _check_path("directory", directory)
    space = Workspace(Path(directory).absolute())
    asked, planned = pipeline.reopen(space)
    found = tables.read_tables(space, "tables")
    results = Results(asked, planned, found, space.cases)
    words.check_version(results)
    return Opened(results)


def _check_path(name: str, path: object) -> None:
    """Refuse an argument that is no path."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"{path!r} is no path", name, "write a text, or a Path")


class Plot:
    """The figures that a study gives to Python.

    Parameters
    ----------
    results
        The study with its tables.
    """

    def __init__(self, results: Results) -> None:
        self._results = results

    def __repr__(self) -> str:
        """The names of its figures."""
        return ".plot.shields(), the extended Shields diagram"

    def shields(self) -> "Figure":
        """Draw the extended Shields diagram of the page.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        OrchestratorError
            If the study has no thresholds.
        """
        from orchestrator.report import style
        from orchestrator.report.figures import shields

        with style.settings():
            for figure in shields.FIGURE.draw(self._results):
                if figure.canvas:
                    return figure.canvas
        directory = self._results.cases.parent
        raise OrchestratorError("there is nothing to draw", str(directory))


class Opened:
    """A study that was run; `run` and `open` make one.

    Attributes
    ----------
    directory
        The directory.
    page
        The file of its page.
    title
        Its title.
    tables
        Every table by its name, with SI units in the names of columns.
    plot
        Its figures, a `Plot`.
    """

    def __init__(self, results: Results) -> None:
        self._results = results
        self.directory = results.cases.parent
        self.page = self.directory / report.PAGE
        self.title = results.study.title
        self.tables = dict(results.tables)
        self.plot = Plot(results)

    @property
    def thresholds(self) -> pd.DataFrame:
        """The thresholds of the piles, or else of single grains, beside their scenes.

        The first columns are those that most users need. They tell points apart, and
        have the flow and its interval as the page has them, the measured flow, the
        Shields number, and whether the threshold is usable. ``why_not`` is NaN for a
        usable threshold.
        """
        piles = self._results.joined("pile_threshold")
        rows = piles if len(piles) else self._results.joined("single_grain")
        if rows.empty:
            return rows
        first: list[str] = []
        for name in FIRST:
            names = (name, *OF_GRAINS.get(name, ()))
            known = [one for one in names if one in rows and rows[one].notna().any()]
            first += known[:1]
        # a usable threshold has no reason against it: NaN, which dropna drops
        rows = rows.assign(why_not=rows["why_not"].replace("", np.nan))
        return rows[[*first, *rows.columns.difference(first, sort=False)]]

    @property
    def answer(self) -> str:
        """The answer, in words and a short table."""
        return report.said(
            self._results, guests.cards(self._results.study, self.tables)
        )

    @property
    def card(self) -> Card:
        """The answer card: its question, its numbers with units, and its verdict."""
        cards = guests.cards(self._results.study, self.tables)
        return words.answer_card(self._results, cards)

    def __repr__(self) -> str:
        """The study in five lines."""
        rows = self.thresholds
        usable = "no threshold yet"
        if len(rows):
            usable = f"{rows['usable'].sum()} of {len(rows)} thresholds are usable"
        lines = [
            self.title,
            f"{len(self._results.scenes)} scenes; {usable}",
            f"page: {self.page}",
            f"tables: {', '.join(self.tables)}",
            f"in words: .answer; as a table: .thresholds; drawn: {self.plot}",
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """The answer with its table, for a notebook."""
        return f"<h3>{escape(self.title)}</h3><pre>{escape(self.answer)}</pre>"

    def case(self, name: str) -> Path:
        """Look up the directory of a case.

        Parameters
        ----------
        name
            The beginning of its name.

        Returns
        -------
        Path
            The directory.

        Raises
        ------
        InputError
            If no case has a name that begins so, or several have.
        """
        names = [case for case in self._results.plan.cases if case.startswith(name)]
        if len(names) == 1:
            return self._results.cases / names[0]
        what = f"{len(names)} cases begin with {name!r}"
        raise InputError(what, str(self.directory), "see the column case")
