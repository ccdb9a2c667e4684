"""OpenFOAM: which version is here, what a run left, and what its end means."""

import os
import re
import warnings
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.errors import Exploded, SolverError, Stalled
from orchestrator.solvers.programs import ask, find

if TYPE_CHECKING:
    import pyvista

PROGRAM = "simpleFoam"
TRIED = ("1912",)
"""Versions that the tests ran with."""
INSTALL = "install the Debian package `openfoam`"

_HOME = "/usr/share/openfoam"
_STATED = re.compile(r"Using: OpenFOAM-(?:v(?P<named>\d{4})|\S* \((?P<api>\d{4})\))")
_FATAL = re.compile(r"--> FOAM FATAL (?:IO )?ERROR[^\n]*\n(.*?)(?:\n\s*\n|\Z)", re.DOTALL)
_CONVERGED = re.compile(r"^SIMPLE solution converged in (\d+) iterations$", re.MULTILINE)
_RESIDUAL = re.compile(r"Solving for Ux, Initial residual = (\S+),")


@cache
def version() -> str:
    """Version of the OpenFOAM that is found first, as its program states it, such as "1912".

    Raises
    ------
    SolverError
        If the program is missing, does not start, or is of a version that the case cannot run with.
    """
    path = find(PROGRAM, remedy=INSTALL)
    home = os.environ.get("WM_PROJECT_DIR") or _HOME
    reply = ask(path, "-help", env={"WM_PROJECT_DIR": home})
    match = _STATED.search(reply.text)
    if match is None:
        raise SolverError(
            f"{path} with WM_PROJECT_DIR={home} is not of the openfoam.com line: "
            f"{_line_with('Using:', reply.text) or reply.gist}",
            remedy="put Debian's `openfoam` first in PATH, and unset WM_PROJECT_DIR",
        )
    number = str(match["named"] or match["api"])
    if int(number) < int(TRIED[0]):
        what = f"OpenFOAM {number} is older than {TRIED[0]}, which the cases are written for"
        raise SolverError(what, remedy=INSTALL)
    if number not in TRIED:
        warnings.warn(
            f"OpenFOAM {number} has not been tried, {', '.join(TRIED)} has; "
            "later versions call the bed's nutkAtmRoughWallFunction atmNutkWallFunction",
            stacklevel=2,
        )
    return number


def read_numbers(path: Path) -> dict[str, float]:
    """The entries `name number;` of a dictionary file, such as a case's `parameters`."""
    entries = re.findall(r"(?m)^(\w+)\s+([-+.\d][^\s;]*);", path.read_text(encoding="utf-8"))
    return {name: float(value) for name, value in entries}


def read_cells(directory: Path, array: str) -> "pyvista.UnstructuredGrid":
    """The cells of a case with a field of its last time; SolverError if it has no results."""
    import pyvista

    if not any(directory.glob(f"[1-9]*/{array}")):
        raise SolverError("no results", where=str(directory), remedy="run ./Allrun there")
    reader = pyvista.POpenFOAMReader(str(directory / "system" / "controlDict"))
    # the reader starts at the first time, not at the last
    reader.set_active_time_value(reader.time_values[-1])
    reader.cell_to_point_creation = False
    reader.disable_all_cell_arrays()
    reader.enable_cell_array(array)
    cells: Any = reader.read()["internalMesh"]
    assert isinstance(cells, pyvista.UnstructuredGrid)
    return cells


def check_log(directory: Path) -> int:
    """Read from its log how a case that `Allrun` has run in ended; the iterations that it took.

    Raises
    ------
    Exploded, Stalled
        If simpleFoam diverged, or did not converge.
    SolverError
        If it failed or was stopped otherwise, whatever its exit code was.
    """
    where, log = str(directory), directory / f"log.{PROGRAM}"
    if not log.is_file():
        raise SolverError(f"{PROGRAM} has not run", where, "run ./Allrun there")
    text = log.read_text(encoding="utf-8", errors="replace")
    times = re.findall(r"^Time = (\d+)$", text, re.MULTILINE)
    last = f"iteration {times[-1]}" if times else "its header"
    # first the crash: a NaN also makes simpleFoam stumble over its own residuals' file
    has_nan = re.search(r"residual = -?nan", text)
    if has_nan or "sigFpe::sigHandler" in text:
        exception = f"floating point exception after {last}"
        cause = (
            f"the residuals are not numbers: {_line_with('nan', text)}" if has_nan else exception
        )
        remedy = "other first cells or cells per face may do; see also system/fvSolution"
        raise Exploded(f"{PROGRAM} diverged: {cause}", where, remedy)
    if "sigSegv::sigHandler" in text:
        remedy = "run the case again; if it stays, install the package `openfoam` anew"
        raise SolverError(f"{PROGRAM} crashed: segmentation fault after {last}", where, remedy)
    if fatal := _FATAL.search(text):
        cause = " ".join(fatal[1].split())
        raise SolverError(f"{PROGRAM} stopped: {cause}", where, f"{log.name} says where")
    if text.split()[-1:] != ["End"]:
        what = f"{PROGRAM} was stopped before its end; its log breaks off after {last}"
        remedy = "killed, out of time, memory or disk? Run the case again"
        raise SolverError(what, where, remedy)
    converged = _CONVERGED.search(text)
    if converged is None:
        residual = _RESIDUAL.findall(text)[-1:] or ["not known"]
        what = f"{PROGRAM} did not converge: the residual of Ux is {residual[0]} after {last}"
        remedy = "raise endTime in system/controlDict; if the residuals cycle, relax more"
        raise Stalled(what, where, remedy)
    return int(converged[1])


def _line_with(word: str, text: str) -> str:
    return next((line.strip() for line in text.splitlines() if word in line), "")
