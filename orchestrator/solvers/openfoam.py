"""OpenFOAM: which version is here, what a run left, and what its end means."""

import os
import re
from functools import cache
from pathlib import Path

from orchestrator import solvers
from orchestrator.errors import Exploded, SolverError, Stalled

PROGRAM = "simpleFoam"
TRIED = "1912"
"""Version that the tests ran with. Later ones may lack the bed's nutkAtmRoughWallFunction."""
INSTALL = "install Debian's package `openfoam`, and put it first in PATH"

_HOME = "/usr/share/openfoam"
_STATED = r"Using: OpenFOAM-(?:v(\d{4})|\S* \((\d{4})\))"
_FATAL = r"(?s)--> FOAM FATAL (?:IO )?ERROR[^\n]*\n(.*?)(?:\n\s*\n|\Z)"
_CONVERGED = r"(?m)^SIMPLE solution converged in (\d+) iterations$"
_RESIDUAL = r"Solving for Ux, Initial residual = (\S+),"


@cache
def version() -> str:
    """Version of the OpenFOAM on the path, such as "1912"; SolverError if none works."""
    home = os.environ.get("WM_PROJECT_DIR") or _HOME
    env, other = {"WM_PROJECT_DIR": home}, f"unset WM_PROJECT_DIR, which is {home}"
    remedy = INSTALL if home == _HOME else other
    command = f"{PROGRAM} -help"
    return solvers.version("OpenFOAM", command, _STATED, tried=TRIED, env=env, remedy=remedy)


def check_log(directory: Path) -> int:
    """Read from its log how a case that `Allrun` has run in ended; the iterations that it took.

    Raises Exploded or Stalled if simpleFoam diverged or did not converge, and SolverError if it
    failed or was stopped otherwise, whatever its exit code was.
    """
    where, log = str(directory), directory / f"log.{PROGRAM}"
    if not log.is_file():
        raise SolverError(f"{PROGRAM} has not run", where, "run ./Allrun there")
    text = log.read_text(encoding="utf-8", errors="replace")
    times = re.findall(r"\nTime = (\d+)\n", text)
    last = f"iteration {times[-1]}" if times else "its header"
    # first the crash: a NaN also makes simpleFoam stumble over its own residuals' file
    nan = re.search(r"(?m)^.*residual = -?nan.*", text)
    if nan or "sigFpe::sigHandler" in text:
        exception = f"floating point exception after {last}"
        cause = f"the residuals are not numbers: {nan[0].strip()}" if nan else exception
        remedy = "other first cells or cells per face may do; see also system/fvSolution"
        raise Exploded(f"{PROGRAM} diverged: {cause}", where, remedy)
    if "sigSegv::sigHandler" in text:
        remedy = "run the case again; if it stays, install the package `openfoam` anew"
        raise SolverError(f"{PROGRAM} crashed: segmentation fault after {last}", where, remedy)
    if fatal := re.search(_FATAL, text):
        cause = " ".join(fatal[1].split())
        raise SolverError(f"{PROGRAM} stopped: {cause}", where, f"{log.name} says where")
    if text.split()[-1:] != ["End"]:
        what = f"{PROGRAM} was stopped before its end; its log breaks off after {last}"
        remedy = "killed, out of time, memory or disk? Run the case again"
        raise SolverError(what, where, remedy)
    if converged := re.search(_CONVERGED, text):
        return int(converged[1])
    residual = re.findall(_RESIDUAL, text)[-1:] or ["not known"]
    what = f"{PROGRAM} did not converge: the residual of Ux is {residual[0]} after {last}"
    remedy = "raise endTime in system/controlDict; if the residuals cycle, relax more"
    raise Stalled(what, where, remedy)
