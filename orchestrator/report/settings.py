"""The settings of matplotlib that all figures are drawn with."""

import contextlib
import logging
from collections.abc import Iterator
from typing import Any

RC: dict[Any, Any] = {
    **dict.fromkeys(("font.size", "axes.labelsize", "axes.titlesize"), 8),
    **dict.fromkeys(("legend.fontsize", "xtick.labelsize", "ytick.labelsize"), 7),
    # numbers at minor ticks stand in line with those at major ones
    **dict.fromkeys(("xtick.minor.pad", "ytick.minor.pad"), 5),
    "font.sans-serif": ["DejaVu Sans"],  # which matplotlib brings: no font of the machine is used
    "axes.linewidth": 0.6,
    "axes.titley": 1.0,  # else matplotlib looks for ticks above each panel
    "lines.linewidth": 1.2,
    "lines.markersize": 4.2,
    "mathtext.fontset": "dejavusans",
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "svg.hashsalt": "orchestrator",
    "savefig.dpi": 200,
}
"""Settings that differ from matplotlib's defaults."""


@contextlib.contextmanager
def own() -> Iterator[None]:
    """Draw by matplotlib's defaults and `RC` alone while the block runs, not by a matplotlibrc."""
    import matplotlib  # takes half a second, for which only drawing waits

    log = logging.getLogger("matplotlib")
    level = log.level
    log.setLevel(logging.ERROR)  # a cache that cannot be kept is of no concern to the user
    defaults: dict[Any, Any] = dict(matplotlib.rcParamsDefault)
    del defaults["backend"]  # figures are made without a window
    try:
        with matplotlib.rc_context({**defaults, **RC}):
            yield
    finally:
        log.setLevel(level)
