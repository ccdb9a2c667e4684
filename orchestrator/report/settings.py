"""The settings of matplotlib that all figures are drawn with."""

import contextlib
import logging
from collections.abc import Iterator
from typing import Any

RC: dict[Any, Any] = {
    "font.size": 8,
    "font.sans-serif": ["DejaVu Sans"],  # which matplotlib brings: no font of the machine is used
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.minor.pad": 5,  # numbers at minor ticks stand in line with those at major ones
    "ytick.minor.pad": 5,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.2,
    "mathtext.fontset": "dejavusans",
    "axes.titley": 1.0,  # else matplotlib looks for ticks above each panel
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "svg.hashsalt": "orchestrator",
    "savefig.dpi": 200,
}
"""Settings that differ from matplotlib's defaults."""


@contextlib.contextmanager
def own() -> Iterator[None]:
    """Draw by matplotlib's defaults and `RC` alone while the block runs, not by a matplotlibrc."""
    import matplotlib  # half a second, which only who draws waits for

    log = logging.getLogger("matplotlib")
    level = log.level
    log.setLevel(logging.ERROR)  # a cache that cannot be kept is of no concern to the user
    defaults = dict(matplotlib.rcParamsDefault)
    del defaults["backend"]  # figures are made without a window
    try:
        with matplotlib.rc_context({**defaults, **RC}):
            yield
    finally:
        log.setLevel(level)
