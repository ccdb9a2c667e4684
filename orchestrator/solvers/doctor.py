"""Is everything here that a study needs, and what to install if not."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs import process
from orchestrator.solvers import liggghts, openfoam

SOLVERS: dict[str, Callable[[], str]] = {
    "OpenFOAM": openfoam.version,
    "LIGGGHTS": liggghts.version,
}
LIBRARIES = ("numpy", "scipy", "pandas", "pydantic", "gmsh", "meshio", "pyvista", "matplotlib")
TOOLS = ("stdbuf", "sha256sum", "setpriv")
_NEEDS = {"gmsh": "apt-get install libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1 libgomp1"}
"""Packages that a library needs beside itself."""
FREE_GIB = 1.0


@dataclass(frozen=True)
class Finding:
    """One item that was examined.

    Attributes
    ----------
    what : str
        Its name.
    good : bool
        Whether a study can run with it.
    text : str
        Version, or what is wrong and what to do.
    """

    what: str
    good: bool
    text: str


def examine() -> Iterator[Finding]:
    """Examine the solvers, the libraries, the tools, the limits of the shell and the disk."""
    yield Finding("Python", sys.version_info >= (3, 11), sys.version.split()[0])
    for name, version in SOLVERS.items():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                words = [version(), *(f"(warning: {each.message})" for each in caught)]
                yield Finding(name, True, " ".join(words))
            except OrchestratorError as error:
                yield Finding(name, False, str(error))
    for name in LIBRARIES:
        yield _library(name)
    for name in TOOLS:
        path = shutil.which(name)
        yield Finding(name, bool(path), path or "missing: install coreutils and util-linux")
    low = process.shortage()
    yield Finding("limits", not low, low or "enough memory and open files")
    free = shutil.disk_usage(Path.cwd()).free / 2**30
    yield Finding("disk", free >= FREE_GIB, f"{free:.1f} GiB free here")


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
    error = [f"it ended with {loaded.returncode}", *loaded.stderr.strip().splitlines()][-1]
    remedy = _NEEDS.get(name, f"pip install --force-reinstall {name}")
    return Finding(name, False, f"does not load: {error}: {remedy}")


def text(findings: list[Finding]) -> str:
    """The findings for people."""
    return "\n".join(f"{'ok ' if f.good else 'NOT'}  {f.what:<12} {f.text}" for f in findings)
