"""Is everything here that a study needs, and what to install if not."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs import process
from orchestrator.solvers import liggghts, openfoam

LIBRARIES = (
    *("numpy", "scipy", "pandas", "pydantic"),
    *("gmsh", "meshio", "pyvista", "matplotlib"),
)
TOOLS = ("stdbuf", "sha256sum", "setpriv")
_NEEDS = {"gmsh": "apt-get install libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1 libgomp1"}
"""Packages that a library needs beside itself."""
FREE_GIB = 1.0


@dataclass(frozen=True)
class Finding:
    """One thing looked at.

    Attributes
    ----------
    what : str
        Its name.
    good : bool
        Whether a study can run with it.
    said : str
        Version, or what is wrong and what to do.
    """

    what: str
    good: bool
    said: str


def examine() -> list[Finding]:
    """Look at the solvers, the libraries, the tools and the disk."""
    return [
        Finding("Python", sys.version_info >= (3, 11), sys.version.split()[0]),
        *(_solver(name, ask) for name, ask in _SOLVERS.items()),
        *(_library(name) for name in LIBRARIES),
        *(_tool(name) for name in TOOLS),
        _limits(),
        _disk(Path.cwd()),
    ]


_SOLVERS: dict[str, Callable[[], str]] = {
    "OpenFOAM": openfoam.version,
    "LIGGGHTS": liggghts.version,
}


def _solver(name: str, ask: Callable[[], str]) -> Finding:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            said = ask()
        except OrchestratorError as error:
            return Finding(name, False, str(error))
    return Finding(name, True, " ".join([said, *(f"(warning: {w.message})" for w in caught)]))


def _library(name: str) -> Finding:
    try:
        version = importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, False, f"missing: pip install {name}")
    # in a process of its own: a broken library may end it
    loaded = subprocess.run(
        [sys.executable, "-c", f"import {name}"],
        env={**os.environ, "MATPLOTLIBRC": os.devnull},
        capture_output=True,
        text=True,
        errors="replace",
    )
    if loaded.returncode == 0:
        return Finding(name, True, version)
    said = (loaded.stderr.strip().splitlines() or [f"it ended with {loaded.returncode}"])[-1]
    remedy = _NEEDS.get(name, f"pip install --force-reinstall {name}")
    return Finding(name, False, f"does not load: {said}: {remedy}")


def _tool(name: str) -> Finding:
    path = shutil.which(name)
    return Finding(name, path is not None, path or "missing: install coreutils and util-linux")


def _limits() -> Finding:
    low = process.shortage()
    return Finding("limits", not low, low or "enough memory and open files")


def _disk(folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free / 2**30
    return Finding("disk", free >= FREE_GIB, f"{free:.1f} GiB free here")


def text(findings: list[Finding]) -> str:
    """The findings for people."""
    rows = (f"{'ok ' if f.good else 'NOT'}  {f.what:<12} {f.said}" for f in findings)
    return "\n".join(rows)
