"""OpenFOAM: which version is here, what a run left, and what its end means."""

import os
import re
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.errors import Exploded, SolverError, Stalled
from orchestrator.runs.process import ask, find

if TYPE_CHECKING:
    import pyvista

PROGRAMS = ("simpleFoam",)
"""The programs of a study's case; by hand a mesh is made by others before."""
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
    """Version of the OpenFOAM that is found first, as its programs state it, such as "1912".

    Raises
    ------
    SolverError
        If a program is missing, does not start, or is of a version that the case cannot run with.
    """
    path = [find(name, remedy=INSTALL) for name in PROGRAMS][-1]
    home = os.environ.get("WM_PROJECT_DIR")
    reply = ask(path, "-help", env={"WM_PROJECT_DIR": home or _HOME})
    match = _STATED.search(reply.text)
    if match is None:
        if home and _STATED.search(ask(path, "-help", env={"WM_PROJECT_DIR": _HOME}).text):
            raise SolverError(
                f"WM_PROJECT_DIR is {home}, which is not the OpenFOAM of {path}",
                remedy="unset it, or put the programs of that OpenFOAM first in PATH",
            )
        raise SolverError(
            f"{path} is not of the openfoam.com line: "
            f"{_line_with('Using:', reply.text) or reply.gist}",
            remedy="put the one of Debian's package `openfoam` first in PATH",
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
    text = path.read_text(encoding="utf-8")
    return {
        name: float(value) for name, value in re.findall(r"(?m)^(\w+)\s+([-+.\d][^\s;]*);", text)
    }


def read_last_time(
    directory: Path, patch: str, arrays: Sequence[str]
) -> "tuple[pyvista.PolyData, pyvista.UnstructuredGrid]":
    """A patch and the cells of a case, with cell arrays of its last time, in single precision.

    Raises
    ------
    SolverError
        If the case holds no time but 0, or a file of it is broken.
    """
    import pyvista

    if not any(directory.glob(f"[1-9]*/{arrays[0]}")):
        raise SolverError("no results", where=str(directory), remedy="run ./Allrun there")
    reader = pyvista.POpenFOAMReader(str(directory / "system" / "controlDict"))
    # the reader starts at the first time, not at the last
    reader.set_active_time_value(reader.time_values[-1])
    reader.cell_to_point_creation = False
    reader.disable_all_patch_arrays()
    reader.enable_patch_array("internalMesh")
    reader.enable_patch_array(f"patch/{patch}")
    reader.disable_all_cell_arrays()
    for array in arrays:
        reader.enable_cell_array(array)
    blocks: Any = reader.read()
    try:
        surface, cells = blocks["boundary"][patch], blocks["internalMesh"]
        for array in arrays:
            surface.cell_data[array], cells.cell_data[array]
    except KeyError as missing:
        raise SolverError(
            f"the results are not whole: {missing}",
            where=str(directory),
            remedy="is the disk full? Run the case again",
        ) from missing
    return surface, cells


def check_log(directory: Path) -> int:
    """Read from its logs how a case that `Allrun` has run in ended.

    Returns
    -------
    int
        The iterations that simpleFoam took to converge.

    Raises
    ------
    Exploded
        If simpleFoam diverged.
    Stalled
        If it did not converge.
    SolverError
        If any program failed or was stopped otherwise, whatever its exit code was.
    """
    where = str(directory)
    for program in PROGRAMS:
        try:
            text = (directory / f"log.{program}").read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            what = f"{program} has not run"
            raise SolverError(what, where=where, remedy="run ./Allrun there") from None
        times = re.findall(r"^Time = (\d+)$", text, re.MULTILINE)
        last = f"iteration {times[-1]}" if times else "its header"
        # first the crash: a NaN also makes simpleFoam stumble over its own residuals' file
        diverged = ""
        if re.search(r"residual = -?nan", text):
            diverged = f"the residuals are not numbers: {_line_with('nan', text)}"
        elif "sigFpe::sigHandler" in text:
            diverged = f"floating point exception after {last}"
        if diverged:
            raise Exploded(
                f"simpleFoam diverged: {diverged}",
                where=where,
                remedy="another first cell or number of cells per face may do; "
                "relaxation and correctors are in system/fvSolution",
            )
        if "sigSegv::sigHandler" in text:
            raise SolverError(
                f"{program} crashed: segmentation fault after {last}",
                where=where,
                remedy="run the case again; if it stays, install the package `openfoam` anew",
            )
        if fatal := _FATAL.search(text):
            what = f"{program} stopped: {' '.join(fatal[1].split())}"
            raise SolverError(what, where=where, remedy=f"log.{program} says where")
        if text.split()[-1:] != ["End"]:
            raise SolverError(
                f"{program} was stopped before its end; its log breaks off after {last}",
                where=where,
                remedy="killed, out of time, memory or disk? Run the case again",
            )
    converged = _CONVERGED.search(text)
    if converged is None:
        # how the residual of Ux went over the last two fifths of the run
        residuals = [float(value) for value in _RESIDUAL.findall(text)]
        fifth = max(len(residuals) // 5, 1)
        before, now = residuals[-2 * fifth : -fifth] or residuals, residuals[-fifth:]
        falls = max(now, default=0.0) < 0.5 * max(before, default=0.0)
        verb = "still falls" if falls else "cycles, it no longer falls"
        trend = f"the residual of Ux {verb} ({max(now, default=float('nan')):.1e})"
        raise Stalled(
            f"simpleFoam did not converge: {trend} after {last}",
            where=where,
            remedy="raise endTime in system/controlDict; if the residuals cycle, relax more",
        )
    return int(converged[1])


def _line_with(word: str, text: str) -> str:
    return next((line.strip() for line in text.splitlines() if word in line), "")
