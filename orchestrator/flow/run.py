"""A flow run by OpenFOAM: what a bed line and a surface share."""

import re
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version as installed
from math import sqrt
from pathlib import Path
from typing import ClassVar, Generic, TypeVar

import numpy as np

from orchestrator import digits
from orchestrator.errors import Exploded, SolverError
from orchestrator.flow.foam import BED_FLOW, COLUMN_FLOW, start_from
from orchestrator.flow.stress import APPROACH, Diagnostic, Stress, diagnostics
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import log_law_speed, log_law_ustar
from orchestrator.runs.case import Case
from orchestrator.solvers import openfoam
from orchestrator.types import FloatArray

WALL_STRESS = "wall_stress.csv"
DIAGNOSTICS = "diagnostics.csv"
SPEED_HEIGHT = 10.0
"""Height above the flat bed at which U_e is given, h."""
C_MU = 0.09
"""Coefficient of k-epsilon: omega = epsilon/(C_mu k)."""
OnBed = TypeVar("OnBed", bound=Stress)
"""Stress on a bed line or on a surface."""
_FIELDS = ("U", "epsilon", "k", "nut", "omega", "p", "phi", "wallShearStress")
"""Fields of the last iteration; epsilon or omega, as the turbulence model has it."""


@dataclass(frozen=True)
class Approach:
    """The flow that approaches a bed: the log layer of a rough wall.

    Attributes
    ----------
    speed_m_s
        Speed U_e at `SPEED_HEIGHT` above the flat bed, m/s.
    height_m
        Height h of the forms, m.
    roughness_m
        Roughness length z0 of the bed, m.
    viscosity_m2_s
        Kinematic viscosity of the solve, m2/s.
    """

    speed_m_s: float
    height_m: float
    roughness_m: float
    viscosity_m2_s: float

    @property
    def ustar_m_s(self) -> float:
        """Friction velocity u*_0 by the log law, m/s."""
        height = SPEED_HEIGHT * self.height_m
        return float(log_law_ustar(self.speed_m_s, height, self.roughness_m))

    @property
    def parameters(self) -> dict[str, object]:
        """The values that ``parameters`` has of it."""
        return {
            "freeStream": float(self.speed_m_s),
            "speedHeight": SPEED_HEIGHT * self.height_m,
            "roughnessLength": float(self.roughness_m),
            "viscosity": float(self.viscosity_m2_s),
        }

    def start(self, fields: Path, heights: FloatArray) -> None:
        """Let fields start from it, which takes a third of the iterations.

        Parameters
        ----------
        fields
            The directory ``0`` of a case.
        heights
            Height of each cell above the bed, m, shape (cells,).
        """
        ustar = self.ustar_m_s
        speed = log_law_speed(ustar, heights, self.roughness_m)
        velocity = np.column_stack([speed, 0 * speed, 0 * speed])
        frequency = ustar / (KARMAN * (heights + self.roughness_m))
        start_from(fields / "U", velocity)
        start_from(fields / "epsilon", ustar**2 * frequency)
        start_from(fields / "omega", frequency / sqrt(C_MU))


class OpenFoamCase(Case, Generic[OnBed]):
    """Steady turbulent flow over a bed, from one direction, on one mesh."""

    template: ClassVar[str] = "openfoam/flow"
    results: ClassVar[tuple[str, ...]] = (BED_FLOW, COLUMN_FLOW, openfoam.SECOND_TRY)
    derived: ClassVar[tuple[str, ...]] = (WALL_STRESS, DIAGNOSTICS)
    bulky: ClassVar[tuple[str, ...]] = (
        *(f"[1-9]*/{name}" for name in _FIELDS),
        "[1-9]*/uniform/time",
        "[1-9]*/uniform/cumulativeContErr",
        "[1-9]*/uniform/functionObjects/functionObjectProperties",
    )
    mesher: ClassVar[str]
    """The distribution that makes the mesh."""
    of_template: ClassVar[tuple[str, ...]] = ("mesh.msh", "hill/*")
    """Glob patterns of the files of the template that are no part of a case."""

    @property
    @abstractmethod
    def approach(self) -> Approach:
        """The approaching flow."""

    @property
    @abstractmethod
    def iterations(self) -> float:
        """Expected number of iterations."""

    @abstractmethod
    def stress(self, directory: Path) -> tuple[OnBed, float]:
        """Read the stress on the bed.

        Parameters
        ----------
        directory
            Directory of the case.

        Returns
        -------
        stress
            The stress over that of the approaching flow.
        ustar0
            Friction velocity of the approaching flow, m/s.

        Raises
        ------
        SolverError
            If it is missing, or not of this mesh.
        """

    @abstractmethod
    def own_diagnostics(
        self, stress: OnBed, ustar0: float, directory: Path
    ) -> dict[str, Diagnostic]:
        """Collect the diagnostics that not every flow has.

        Parameters
        ----------
        stress, ustar0
            What `stress` has read.
        directory
            Directory of the case.

        Returns
        -------
        dict of str to Diagnostic
            Each by its name.
        """

    @property
    def ustar0_m_s(self) -> float:
        """Friction velocity u*_0 of the approaching flow by the log law, m/s."""
        return self.approach.ustar_m_s

    def write_parameters(self, directory: Path, values: Mapping[str, object]) -> None:
        """Write ``parameters``, and drop what is the template's alone.

        Parameters
        ----------
        directory
            The case, a copy of the template.
        values
            Values of this mesh and its solve; those of the approaching flow come to
            them.
        """
        own = {**self.approach.parameters, **values}
        set_values(directory / "parameters", own)
        for pattern in self.of_template:
            for path in directory.glob(pattern):
                path.unlink()
        (directory / "hill").rmdir()

    def share(self, directory: Path) -> float:
        """Iterations over those that are expected, at most nearly all.

        Parameters
        ----------
        directory
            The case.

        Returns
        -------
        float
            The share of the work that is done.
        """
        path = directory / "log.simpleFoam"
        if not path.is_file():
            return 0.0
        text = path.read_text(encoding="utf-8", errors="replace")
        return min(text.count("\nTime = ") / self.iterations, 0.95)

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve.

        Returns
        -------
        dict of str to str
            The version of each.
        """
        return {self.mesher: installed(self.mesher), "openfoam": openfoam.version()}

    def said(self, directory: Path) -> str:
        """Say whether the flow took a second try, and what was other in it.

        Parameters
        ----------
        directory
            The case, after `Allrun`.

        Returns
        -------
        str
            The sentence; empty after a single try.
        """
        return openfoam.second_try(directory)

    def collect(self, directory: Path) -> None:
        """Check the run and write `wall_stress.csv` and `diagnostics.csv`.

        Parameters
        ----------
        directory
            The case, after `Allrun`.

        Raises
        ------
        SolverError
            If the run failed, or its flow cannot be right.
        """
        iterations = openfoam.check_log(directory)
        stress, ustar0 = self.stress(directory)
        where = str(directory)
        if not stress.is_finite:
            raise Exploded("the stress on the bed is not a number", where=where)
        stress.to_csv(directory / WALL_STRESS)
        approach = ustar0 / self.ustar0_m_s
        table = diagnostics(
            stress,
            approach,
            self.ustar0_m_s / self.approach.viscosity_m2_s,
            self.approach.roughness_m,
            iterations,
            self.own_diagnostics(stress, ustar0, directory),
        )
        table.to_csv(directory / DIAGNOSTICS, float_format="%.6g", lineterminator="\n")
        if table.loc[APPROACH, "sound"] != "yes":
            ratio = f"{approach:.3f} of the log law's"
            what = f"on flat bed u* is {ratio}: the wall function fails"
            remedy = "raise the first cell's height or the speed"
            remedy = f"{DIAGNOSTICS} says more; {remedy}"
            raise SolverError(what, where=where, remedy=remedy)


def set_values(path: Path, values: Mapping[str, object]) -> None:
    """Replace the values in a template's list; its comments stay.

    Parameters
    ----------
    path
        The file.
    values
        Value by name; numbers get nine digits.

    Raises
    ------
    ValueError
        If the file has not one entry of a name.
    """
    text = path.read_text(encoding="utf-8")
    for name, value in values.items():
        new = digits.text(value) if isinstance(value, float) else value
        text, count = re.subn(rf"(?m)^({name}[ =]+)[^;]+;", rf"\g<1>{new};", text)
        if count != 1:
            raise ValueError(f"{path.name} has {count} entries named {name}")
    path.write_text(text, encoding="utf-8")
