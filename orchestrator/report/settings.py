"""The settings that all figures are drawn with, whatever its user has told matplotlib."""

import contextlib
import logging
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

PIXELS_PER_INCH = 200
RC: Mapping[Any, Any] = {
    "font.size": 8,
    "font.sans-serif": ["DejaVu Sans"],  # which matplotlib brings: no font of the machine is used
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.2,
    "mathtext.fontset": "dejavusans",
    "axes.titley": 1.0,  # where they are anyway; matplotlib would look for ticks above each panel
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "svg.hashsalt": "orchestrator",
    "savefig.dpi": PIXELS_PER_INCH,
}
"""Settings that differ from matplotlib's own defaults."""
VARIABLES: Mapping[str, str | None] = {
    "MATPLOTLIBRC": os.devnull,
    "MPLBACKEND": None,
}
"""Variables of the environment that matplotlib reads when it is imported."""


@contextlib.contextmanager
def own() -> Iterator[None]:
    """Draw by matplotlib's defaults and `RC` alone, for as long as the block runs.

    A file ``matplotlibrc`` of the user can change or break any figure, and even the import of
    matplotlib. So whoever draws imports what draws within this block. A program that wants its
    user's settings for figures of its own imports matplotlib first.
    """
    log = logging.getLogger("matplotlib")
    level = log.level
    log.setLevel(logging.ERROR)  # a cache that cannot be kept is nothing to the user
    try:
        matplotlib = _matplotlib()
        defaults = dict(matplotlib.rcParamsDefault)
        del defaults["backend"]  # figures are made without a window
        with matplotlib.rc_context({**defaults, **RC}):
            yield
    finally:
        log.setLevel(level)


def _matplotlib() -> Any:
    if "matplotlib" in sys.modules:
        return sys.modules["matplotlib"]
    # a file in the working directory comes before all others
    with _environment(VARIABLES), _working_in(Path(__file__).parent):
        import matplotlib
    return matplotlib


@contextlib.contextmanager
def _working_in(folder: Path) -> Iterator[None]:
    here = os.open(".", os.O_PATH)  # the way back, even to a directory that has been removed
    try:
        os.chdir(folder)
        yield
    finally:
        os.fchdir(here)
        os.close(here)


@contextlib.contextmanager
def _environment(variables: Mapping[str, str | None]) -> Iterator[None]:
    kept = {name: os.environ.get(name) for name in variables}
    _tell(variables)
    try:
        yield
    finally:
        _tell(kept)


def _tell(variables: Mapping[str, str | None]) -> None:
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
