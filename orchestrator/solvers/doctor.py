"""Is everything here that a study needs, and what to install if not."""

import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from orchestrator.errors import OrchestratorError
from orchestrator.runs import process
from orchestrator.solvers import liggghts, openfoam

SOLVERS = {
    "OpenFOAM": openfoam.version,
    "LIGGGHTS": liggghts.version,
}
"""How each solver is asked for its version."""
LIBRARIES = (
    "numpy",
    "scipy",
    "pandas",
    "pydantic",
    "gmsh",
    "meshio",
    "pyvista",
    "matplotlib",
)
TOOLS = ("stdbuf", "sha256sum", "setpriv")
_PACKAGES = "libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1 libgomp1"
_REMEDIES = {"gmsh": f"apt-get install {_PACKAGES}"}
"""What to do for a library that needs packages of the system beside itself."""
FREE_GIB = 1.0
"""Least free space on the disk, GiB."""
LEAST_PYTHON = (3, 11)


class Finding(NamedTuple):
    """What was found of one thing that a study needs.

    Attributes
    ----------
    what
        Name of the thing.
    good
        Whether a study can run with it.
    text
        Its version, or what to do.
    """

    what: str
    good: bool
    text: str


def examine() -> Iterator[Finding]:
    """Examine solvers, libraries, tools, limits of the shell and the disk.

    Yields
    ------
    Finding
        What was found of each, as it is found.
    """
    is_new = sys.version_info >= LEAST_PYTHON
    yield Finding("Python", is_new, sys.version.split()[0])
    for name, version in SOLVERS.items():
        yield _solver(name, version)
    for name in LIBRARIES:
        yield _library(name)
    for name in TOOLS:
        yield _tool(name)
    low = process.shortage()
    yield Finding("limits", not low, low or "enough memory and open files")
    free_gib = shutil.disk_usage(Path.cwd()).free / 2**30
    yield Finding("disk", free_gib >= FREE_GIB, f"{free_gib:.1f} GiB free here")


def _solver(name: str, version: Callable[[], str]) -> Finding:
    """Ask a solver for its version, with the warnings that it gives."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            words = [version()]
    except OrchestratorError as error:
        return Finding(name, False, str(error))
    words += [f"(warning: {each.message})" for each in caught]
    return Finding(name, True, " ".join(words))


def _library(name: str) -> Finding:
    """Load a library in a process of its own: a broken one may end it."""
    script = f"import {name}, importlib.metadata as m; print(m.version('{name}'))"
    loaded = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "MATPLOTLIBRC": os.devnull},
        capture_output=True,
        text=True,
    )
    if loaded.returncode == 0:
        printed = loaded.stdout.strip().splitlines()
        return Finding(name, True, printed[-1])
    printed = loaded.stderr.strip().splitlines()
    cause = printed[-1] if printed else f"it ended with {loaded.returncode}"
    remedy = _REMEDIES.get(name, f"pip install --force-reinstall {name}")
    return Finding(name, False, f"does not load: {cause}: {remedy}")


def _tool(name: str) -> Finding:
    """Look for a tool of the system."""
    path = shutil.which(name)
    if path is None:
        return Finding(name, False, "missing: install coreutils and util-linux")
    return Finding(name, True, path)


def findings_text(findings: Sequence[Finding]) -> str:
    """Write findings for people.

    Parameters
    ----------
    findings
        What was found.

    Returns
    -------
    str
        A line for each.

    Examples
    --------
    >>> print(findings_text([Finding("disk", True, "2.0 GiB free here")]))
    ok   disk         2.0 GiB free here
    """
    lines = []
    for finding in findings:
        mark = "ok " if finding.good else "NOT"
        lines.append(f"{mark}  {finding.what:<12} {finding.text}")
    return "\n".join(lines)
