"""OpenFOAM: which version is here, what a run left, and what its end means."""

import os
import re
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.errors import Exploded, SolverError, Stalled
from orchestrator.runs.process import Reply, ask, find

if TYPE_CHECKING:
    import pyvista

PROGRAMS = ("gmshToFoam", "setExprFields", "simpleFoam")
"""The programs of a case's `Allrun`, in their order."""
TRIED = ("1912",)
"""Versions that the tests ran with."""
PACKAGE = "openfoam"
"""The Debian package that holds the programs."""
INSTALL = f"install the Debian package `{PACKAGE}`"

_HOME = "/usr/share/openfoam"
_STATED = re.compile(r"Using: OpenFOAM-(?:v(?P<named>\d{4})|\S* \((?P<api>\d{4})\))")
_FATAL = re.compile(r"--> FOAM FATAL (?:IO )?ERROR[^\n]*\n(.*?)(?:\n\s*\n|\Z)", re.DOTALL)
_CONVERGED = re.compile(r"^SIMPLE solution converged in (\d+) iterations$", re.MULTILINE)
_ITERATION = re.compile(r"^Time = (\d+)$", re.MULTILINE)
_RESIDUAL = re.compile(r"Solving for Ux, Initial residual = (\S+),")


@cache
def version() -> str:
    """Version of the OpenFOAM that is found first, as its programs state it, such as "1912".

    Raises
    ------
    SolverError
        If a program is missing, does not start, or is of a version that the case cannot run with.
    """
    paths = [find(name, remedy=INSTALL) for name in PROGRAMS]
    said = _help(paths[-1], os.environ.get("WM_PROJECT_DIR"))
    match = _STATED.search(said.text)
    if match is None:
        raise _stateless(paths[-1], said)
    found = str(match["named"] or match["api"])
    _judge(found)
    return found


def _help(path: str, home: str | None) -> Reply:
    return ask(path, "-help", env={"WM_PROJECT_DIR": home or _HOME})


def _stateless(path: str, said: Reply) -> SolverError:
    """Why a program states no version that is known."""
    told = os.environ.get("WM_PROJECT_DIR")
    if told and _STATED.search(_help(path, None).text):
        return SolverError(
            f"WM_PROJECT_DIR is {told}, which is not the OpenFOAM of {path}",
            remedy="unset it, or put the programs of that OpenFOAM first in PATH",
        )
    stated = _line_with("Using:", said.text) or said.gist
    return SolverError(
        f"{path} is not of the openfoam.com line: {stated}",
        remedy=f"put the one of Debian's package `{PACKAGE}` first in PATH",
    )


def _judge(found: str) -> None:
    if int(found) < int(TRIED[0]):
        raise SolverError(
            f"OpenFOAM {found} is older than {TRIED[0]}, which the cases are written for",
            remedy=f"install the Debian package `{PACKAGE}`",
        )
    if found not in TRIED:
        warnings.warn(
            f"OpenFOAM {found} has not been tried, {', '.join(TRIED)} has; "
            "later versions call the bed's nutkAtmRoughWallFunction atmNutkWallFunction",
            stacklevel=3,
        )


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
    """Read the end of a case from its logs.

    Parameters
    ----------
    directory : Path
        A case that `Allrun` has run in.

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
    for program in PROGRAMS:
        text = _log(directory, program)
        # first the crash: a NaN also makes simpleFoam stumble over its own residuals' file
        _check_crash(program, text, directory)
        _check_fatal(program, text, directory)
        _check_end(program, text, directory)
    return _iterations(text, directory)


def _log(directory: Path, program: str) -> str:
    try:
        return (directory / f"log.{program}").read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        raise SolverError(
            f"{program} has not run", where=str(directory), remedy="run ./Allrun there"
        ) from None


def _check_fatal(program: str, text: str, directory: Path) -> None:
    match = _FATAL.search(text)
    if match:
        said = " ".join(match[1].split())
        raise SolverError(
            f"{program} stopped: {said}",
            where=str(directory),
            remedy=f"log.{program} says where",
        )


def _check_crash(program: str, text: str, directory: Path) -> None:
    if re.search(r"residual = -?nan", text):
        raise _diverged(f"the residuals are not numbers: {_line_with('nan', text)}", directory)
    if "sigFpe::sigHandler" in text:
        raise _diverged(f"floating point exception after {_last_time(text)}", directory)
    if "sigSegv::sigHandler" in text:
        raise SolverError(
            f"{program} crashed: segmentation fault after {_last_time(text)}",
            where=str(directory),
            remedy=f"run the case again; if it stays, install the package `{PACKAGE}` anew",
        )


def _diverged(how: str, directory: Path) -> Exploded:
    return Exploded(
        f"simpleFoam diverged: {how}",
        where=str(directory),
        remedy="another first cell or number of cells per face may do; "
        "relaxation and correctors are in system/fvSolution",
    )


def _check_end(program: str, text: str, directory: Path) -> None:
    lines = text.split()
    if not lines or lines[-1] != "End":
        raise SolverError(
            f"{program} was stopped before its end; its log breaks off after {_last_time(text)}",
            where=str(directory),
            remedy="killed, out of time, memory or disk? Run the case again",
        )


def _iterations(text: str, directory: Path) -> int:
    match = _CONVERGED.search(text)
    if match is None:
        raise Stalled(
            f"simpleFoam did not converge: {_trend(text)} after {_last_time(text)}",
            where=str(directory),
            remedy="raise endTime in system/controlDict; if the residuals cycle, relax more",
        )
    return int(match[1])


def _trend(text: str) -> str:
    """How the residual of Ux went over the last two fifths of the run."""
    residuals = [float(value) for value in _RESIDUAL.findall(text)]
    fifth = max(len(residuals) // 5, 1)
    before, last = residuals[-2 * fifth : -fifth] or residuals, residuals[-fifth:]
    falls = max(last, default=0.0) < 0.5 * max(before, default=0.0)
    verb = "still falls" if falls else "cycles, it no longer falls"
    return f"the residual of Ux {verb} ({max(last, default=float('nan')):.1e})"


def _last_time(text: str) -> str:
    times = _ITERATION.findall(text)
    return f"iteration {times[-1]}" if times else "its header"


def _line_with(word: str, text: str) -> str:
    return next((line.strip() for line in text.splitlines() if word in line), "")
