"""Is everything here that a study needs, and what to install if not."""

import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from orchestrator.errors import OrchestratorError
from orchestrator.runs import process
from orchestrator.solvers import liggghts, openfoam

SOLVERS = {"OpenFOAM": openfoam.version, "LIGGGHTS": liggghts.version}
LIBRARIES = ("numpy", "scipy", "pandas", "pydantic", "gmsh", "meshio", "pyvista", "matplotlib")
TOOLS = ("stdbuf", "sha256sum", "setpriv")
_NEEDS = {"gmsh": "apt-get install libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1 libgomp1"}
"""Packages that a library needs beside itself."""
FREE_GIB = 1.0


class Finding(NamedTuple):
    """An item, whether a study can run with it, and its version or what to do."""

    what: str
    good: bool
    text: str


def examine() -> Iterator[Finding]:
    """Examine the solvers, the libraries, the tools, the limits of the shell and the disk."""
    yield Finding("Python", sys.version_info >= (3, 11), sys.version.split()[0])
    for name, version in SOLVERS.items():
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                words = [version(), *(f"(warning: {each.message})" for each in caught)]
            yield Finding(name, True, " ".join(words))
        except OrchestratorError as error:
            yield Finding(name, False, str(error))
    for name in LIBRARIES:
        # in a process of its own: a broken library may end it
        script = f"import {name}, importlib.metadata as m; print(m.version('{name}'))"
        environment = {**os.environ, "MATPLOTLIBRC": os.devnull}
        command = [sys.executable, "-c", script]
        loaded = subprocess.run(command, env=environment, capture_output=True, text=True)
        text = (loaded.stderr if loaded.returncode else loaded.stdout).strip().splitlines()
        cause = (text or [f"it ended with {loaded.returncode}"])[-1]
        remedy = _NEEDS.get(name, f"pip install --force-reinstall {name}")
        bad = f"does not load: {cause}: {remedy}"
        yield Finding(name, not loaded.returncode, bad if loaded.returncode else text[-1])
    for name in TOOLS:
        path = shutil.which(name)
        yield Finding(name, bool(path), path or "missing: install coreutils and util-linux")
    low, free = process.shortage(), shutil.disk_usage(Path.cwd()).free / 2**30
    yield Finding("limits", not low, low or "enough memory and open files")
    yield Finding("disk", free >= FREE_GIB, f"{free:.1f} GiB free here")


def text(findings: list[Finding]) -> str:
    """The findings for people."""
    return "\n".join(f"{'ok ' if f.good else 'NOT'}  {f.what:<12} {f.text}" for f in findings)
