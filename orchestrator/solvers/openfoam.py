"""OpenFOAM: which version is here, what a run left, and what its end means."""

import os
import re
from functools import cache
from pathlib import Path

from orchestrator import solvers
from orchestrator.errors import Exploded, SolverError, Stalled

PROGRAM = "simpleFoam"
TRIED = "1912"
"""Version that the tests ran with.

Later ones may lack the bed's nutkAtmRoughWallFunction.
"""
INSTALL = "install Debian's package `openfoam`, and put it first in PATH"

SECOND_TRY = "second_try"
"""What `Allrun` changes where the first try fails; only then it is there."""
FIRST_LOG = f"log.{PROGRAM}.first"
"""What the first try said, where there was a second."""
_OTHER_MESH = "other first cells or cells per face may do; see also system/fvSolution"
_HOME = "/usr/share/openfoam"
_STATED = r"Using: OpenFOAM-(?:v(\d{4})|\S* \((\d{4})\))"
_TIME = r"\nTime = (\d+)\n"
_NOT_A_NUMBER = r"(?m)^.*residual = -?nan.*"
_FATAL = r"(?s)--> FOAM FATAL (?:IO )?ERROR[^\n]*\n(.*?)(?:\n\s*\n|\Z)"
_CONVERGED = r"(?m)^SIMPLE solution converged in (\d+) iterations$"
_OF_SEVERAL = "Finalising parallel run"
"""What several processes say behind the end."""
_RESIDUAL = r"Solving for Ux, Initial residual = (\S+),"


@cache
def version() -> str:
    """Ask OpenFOAM for its version.

    Returns
    -------
    str
        Version of the OpenFOAM on the path, such as ``1912``.

    Raises
    ------
    SolverError
        If none works.
    """
    home = os.environ.get("WM_PROJECT_DIR") or _HOME
    remedy = INSTALL
    if home != _HOME:
        remedy = f"unset WM_PROJECT_DIR, which is {home}"
    return solvers.version(
        "OpenFOAM",
        f"{PROGRAM} -help",
        _STATED,
        tried=TRIED,
        env={"WM_PROJECT_DIR": home},
        remedy=remedy,
    )


def check_log(directory: Path) -> int:
    """Read from its log how a case ended that `Allrun` has run in.

    The exit code of simpleFoam is no proof.

    Parameters
    ----------
    directory
        Directory of the case, which holds ``log.simpleFoam``.

    Returns
    -------
    int
        Iterations until the solution converged.

    Raises
    ------
    Exploded
        If simpleFoam diverged.
    Stalled
        If it did not converge.
    SolverError
        If it has not run, failed or was stopped otherwise.
    """
    try:
        return _check_last(directory)
    except SolverError as error:
        if not (directory / FIRST_LOG).is_file():
            raise
        what = f"{error.what}; it was the second try, with more relaxation"
        remedy = f"{error.remedy}; the first is in {FIRST_LOG}"
        raise type(error)(what, error.where, remedy) from None


def second_try(directory: Path) -> str:
    """Say whether a flow that converged took a second try.

    Parameters
    ----------
    directory
        Directory of the case.

    Returns
    -------
    str
        The sentence; empty after a single try.
    """
    if not (directory / SECOND_TRY).is_file():
        return ""
    try:
        _check_last(directory, FIRST_LOG)
    except SolverError as error:
        first = error.what
    else:
        first = "the first try failed"
    return f"{first}; the second try converged, with the values of {SECOND_TRY}"


def _check_last(directory: Path, name: str = f"log.{PROGRAM}") -> int:
    """Read the log of one try; returned and raised is what `check_log` says."""
    where = str(directory)
    log = directory / name
    if not log.is_file():
        raise SolverError(f"{PROGRAM} has not run", where, "run ./Allrun there")
    text = log.read_text(encoding="utf-8", errors="replace")
    times = re.findall(_TIME, text)
    last = f"iteration {times[-1]}" if times else "its header"
    _check_end(text, last, where)
    converged = re.search(_CONVERGED, text)
    if converged is not None:
        return int(converged[1])
    residuals = re.findall(_RESIDUAL, text)
    residual = residuals[-1] if residuals else "not known"
    what = f"{PROGRAM} did not converge: the residual of Ux is {residual} after {last}"
    remedy = "raise iterations in parameters; if the residuals cycle, relax more"
    raise Stalled(what, where, remedy)


def _check_end(text: str, last: str, where: str) -> None:
    """Raise an error if a run crashed, failed or was stopped.

    `text` is its log, `last` the last step in it, and `where` the case, for messages.
    """
    # first the crash: a NaN also makes simpleFoam stumble over its own residuals' file
    not_a_number = re.search(_NOT_A_NUMBER, text)
    has_overflown = "sigFpe::sigHandler" in text
    if not_a_number is not None or has_overflown:
        cause = f"floating point exception after {last}"
        if not_a_number is not None:
            cause = f"the residuals are not numbers: {not_a_number[0].strip()}"
        raise Exploded(f"{PROGRAM} diverged: {cause}", where, _OTHER_MESH)
    if "sigSegv::sigHandler" in text:
        what = f"{PROGRAM} crashed: segmentation fault after {last}"
        remedy = "run the case again; if it stays, install the package `openfoam` anew"
        raise SolverError(what, where, remedy)
    fatal = re.search(_FATAL, text)
    if fatal is not None:
        cause = " ".join(fatal[1].split())
        remedy = f"log.{PROGRAM} says where"
        raise SolverError(f"{PROGRAM} stopped: {cause}", where, remedy)
    if text.replace(_OF_SEVERAL, "").split()[-1:] != ["End"]:
        what = f"{PROGRAM} was stopped before its end; its log breaks off after {last}"
        remedy = "killed, out of time, memory or disk? Run the case again"
        raise SolverError(what, where, remedy)
