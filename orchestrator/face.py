"""The public Python face: `threshold`, `run` and `open`."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from orchestrator import paper, pipeline, report, tables
from orchestrator.calculator import table as calculator
from orchestrator.errors import InputError, OrchestratorError, SolverError, of_system
from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.report.results import Results
from orchestrator.runs.workspace import Workspace
from orchestrator.study import study
from orchestrator.study.study import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Numbers = ArrayLike
"""A number or an array of them."""
GUESTS = (paper.report_card,)
"""Guests that add to the page of a study."""
P = ParamSpec("P")
T = TypeVar("T")


def _public(function: Callable[P, T]) -> Callable[P, T]:
    """Call with numpy's default error handling; failures of the system as `OrchestratorError`."""

    @wraps(function)
    def call(*arguments: P.args, **settings: P.kwargs) -> T:
        try:
            with np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"):
                return function(*arguments, **settings)
        except OSError as error:
            raise of_system(error) from error

    return call


def _path(value: Any, name: str) -> Path:
    """An argument as a path."""
    if not isinstance(value, str | os.PathLike) or "\0" in str(value):
        raise InputError(f"{value!r} is not a path", where=name)
    return Path(value)


def _array(values: Any, name: str) -> Any:
    """An argument as an array of numbers; a roughness may have texts such as ``d/30``."""

    def number(value: Any) -> Any:
        return value if isinstance(value, str) and name == "roughness" else float(value)

    try:
        return np.vectorize(number, otypes=[object])(np.asarray(values, dtype=object))
    except (TypeError, ValueError):
        what = f"{values!r} is neither a number nor an array of numbers"
        raise InputError(what, where=name) from None


@_public
def threshold(
    diameter: Numbers,
    *,
    density: Numbers = 2500.0,
    fluid_density: Numbers = 1.0,
    viscosity: Numbers = 1e-5,
    slope_deg: Numbers = 0.0,
    entrainment_angle_deg: Numbers = 60.0,
    roughness: Numbers | str = "d/30",
    lift_coefficient: Numbers = LIFT_COEFFICIENT,
    gravity: Numbers = GRAVITY,
    depth: Numbers | None = None,
    law: str | None = "bridged",
) -> pd.DataFrame:
    """Thresholds of motion of single grains by the closed form.

    Parameters
    ----------
    diameter : array_like
        d, m.
    density, fluid_density : array_like
        Densities of grain and fluid, kg/m3.
    viscosity : array_like
        Kinematic, m2/s.
    slope_deg, entrainment_angle_deg : array_like
        Slope that the flow goes up, and the angle of the contact that a grain rolls over, degrees.
    roughness : array_like or str
        Roughness length z0, m, or a part of the diameter such as ``d/10``.
    lift_coefficient : array_like
        Coefficient of Saffman's lift.
    gravity : array_like
        m/s2.
    depth : array_like, optional
        Depth of a liquid, m: for its mean velocity.
    law : str or None
        A force law, or ``paper`` for the paper's rule; None: every law.

    Returns
    -------
    DataFrame
        The arrays broadcast together and are raveled: one row for each point, or for each point
        and law, with units in the columns' names; ``valid`` and ``why_not`` say where a law ends.

    Raises
    ------
    InputError
        For a point that is no scene, a law that is none, or if no law holds at any point.
    """
    given: dict[str, Numbers] = {
        "diameter": diameter,
        "density": density,
        "fluid_density": fluid_density,
        "viscosity": viscosity,
        "slope_deg": slope_deg,
        "entrainment_angle_deg": entrainment_angle_deg,
        "roughness": roughness,
        "lift_coefficient": lift_coefficient,
        "gravity": gravity,
        **({} if depth is None else {"depth": depth}),
    }
    if not isinstance(law, str | None):
        raise InputError(f"{law!r} is not the name of a force law", where="law")
    try:
        arrays = np.broadcast_arrays(*(_array(values, name) for name, values in given.items()))
    except ValueError as error:
        raise InputError(str(error), where="threshold") from None
    if not arrays[0].size:
        raise InputError("an array without values", where="threshold")
    points = pd.DataFrame(dict(zip(given, map(np.ravel, arrays), strict=True))).infer_objects()
    answer = "bridged" if law is None else law
    calculator.check_law(answer)
    found = calculator.thresholds(points, answer)
    chosen = found if law is None else found[found["answer"]]
    return chosen.drop(columns="answer").reset_index(drop=True)


@_public
def run(
    source: str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    tolerance: float | None = None,
) -> "Opened":
    """Run what is missing of a study, draw it, and open it.

    Parameters
    ----------
    source : str or Path
        A study file, or the name of a preset.
    out : str or Path, optional
        Its directory; by default ``results/NAME``.
    workers : int, optional
        Cases at a time; by default one for each processor.
    tolerance : float, optional
        Relative error that thresholds may have.

    Raises
    ------
    InputError
        If the study cannot be answered.
    SolverError
        If a solver is missing, or if cases failed; what is done stays, and the same call goes on.
    """
    if workers is not None and not (isinstance(workers, int) and workers >= 1):
        raise InputError(f"{workers!r} is not a whole number of at least 1", where="workers")
    asked = load(source, tolerance)
    place = _path(Path("results") / asked.name if out is None else out, "out")
    count = workers or os.cpu_count() or 1
    finished = pipeline.run(asked, place, workers=count, guests=GUESTS)
    if finished.failures:
        name, error = next(iter(finished.failures.items()))
        what = f"{len(finished.failures)} cases failed; {name}: {error}"
        raise SolverError(what, where=str(place))
    return open(place)


def load(source: str | Path, tolerance: float | None = None, name: str = "tolerance") -> Study:
    """Read a study file or a preset, the paper's among them, to be answered with a tolerance.

    Raises
    ------
    InputError
        If it cannot be read, or is no study; `name` names the tolerance in messages.
    """
    asked = study.load(str(_path(source, "source")), [paper.PRESETS])
    if tolerance is None:
        return asked
    study.check_tolerance(tolerance, name)
    return replace(asked, tolerance=tolerance)


@_public
def open(directory: str | Path) -> "Opened":
    """Open the directory of a study that was run.

    Raises
    ------
    InputError
        If it holds no study.
    OrchestratorError
        If it has no tables, or they have changed since they were written.
    """
    space = Workspace(_path(directory, "directory").absolute())
    asked, planned = pipeline.reopen(space)
    found = tables.read(space.folder, "tables")
    return Opened(Results(asked, planned, found, space.cases))


@dataclass(frozen=True, eq=False)
class Opened:
    """A study that was run, as `run` and `open` give it."""

    _results: Results

    @property
    def directory(self) -> Path:
        """Its directory."""
        return self._results.cases.parent

    @property
    def title(self) -> str:
        """Title in its study file."""
        return self._results.study.title

    @property
    def page(self) -> Path:
        """Its page."""
        return self.directory / report.PAGE

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Every table by its name, SI units in the columns' names."""
        return dict(self._results.tables)

    @property
    def thresholds(self) -> pd.DataFrame:
        """The thresholds of the piles, or of the single grains of a study without piles.

        Each row has its scene's parameters beside it, and says whether it is ``usable``.
        """
        piles = self._results.joined("pile_threshold")
        return piles if len(piles) else self._results.joined("single_grain")

    @property
    def answer(self) -> str:
        """The answer, in words and a short table."""
        found = self._results
        return report.said(found.study, found.plan, found.tables, found.cases)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer, in words alone."""
        return tuple(self.answer.split("\n\n")[-1].splitlines())

    @cached_property
    def plot(self) -> "Plots":
        """Its figures."""
        return Plots(self._results)

    def case(self, name: str) -> Path:
        """The directory of a case, by its name or the beginning of it.

        Raises
        ------
        InputError
            If no case begins so, or several do.
        """
        found = [one for one in self._results.plan.cases if one.startswith(name)]
        if len(found) != 1:
            what = f"{len(found)} cases begin with {name!r}"
            raise InputError(what, where=str(self.directory), remedy="see the column case")
        return self._results.cases / found[0]


@dataclass(frozen=True, eq=False)
class Plots:
    """Figures of a study."""

    _results: Results

    def shields(self) -> "Figure":
        """The extended Shields diagram of the page.

        Raises
        ------
        OrchestratorError
            If the study has nothing for it yet.
        """
        from orchestrator.report import overview, settings

        with settings.own():
            for figure in overview.draw(self._results):
                if figure.canvas:
                    return figure.canvas
        raise OrchestratorError("there is nothing to draw", where=str(self._results.cases.parent))
