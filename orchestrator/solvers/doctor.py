"""Is everything here that a study needs, and what to install if not."""

import importlib.metadata
import shutil
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs import resources
from orchestrator.solvers import liggghts, openfoam

LIBRARIES = ("numpy", "pandas", "pyarrow", "meshio", "gmsh", "pyvista", "matplotlib", "pydantic")
TOOLS = ("stdbuf", "sha256sum", "setpriv")
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
        _gmsh(),
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
        return Finding(name, True, importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, False, f"missing: pip install {name}")


def _tool(name: str) -> Finding:
    path = shutil.which(name)
    return Finding(name, path is not None, path or "missing: install coreutils and util-linux")


def _gmsh() -> Finding:
    try:
        import gmsh  # noqa: F401 - its shared libraries are looked for at import
    except (ImportError, OSError) as error:
        libraries = "libglu1-mesa libgl1 libxft2 libxcursor1 libxinerama1 libgomp1"
        return Finding("meshing", False, f"{error}: apt-get install {libraries}")
    return Finding("meshing", True, "gmsh loads")


def _limits() -> Finding:
    low = [str(error) for error in resources.shortages()]
    return Finding("limits", not low, "; ".join(low) or "enough memory and open files")


def _disk(folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free / 2**30
    return Finding("disk", free >= FREE_GIB, f"{free:.1f} GiB free here")


def text(findings: list[Finding]) -> str:
    """The findings for people."""
    rows = (f"{'ok ' if f.good else 'NOT'}  {f.what:<12} {f.said}" for f in findings)
    return "\n".join(rows)
