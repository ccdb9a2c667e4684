"""Pictures that VTK draws or samples: asked for here, made in a process of their own."""

import json
import os
import signal
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import orchestrator
from orchestrator.solvers import process

LIMIT_S = 300.0
PACKAGES = "libosmesa6 libgl1 libx11-6 libxcursor1"
"""Of Debian; what VTK needs to draw where there is no screen."""


def run(jobs: Sequence[Mapping[str, Any]], folder: Path) -> str:
    """Do some jobs; their list and a log go to a folder.

    Returns
    -------
    str
        Empty, or why not all of them were done and what to install.
    """
    listed = folder / "jobs.json"
    listed.write_text(json.dumps(jobs), encoding="utf-8")
    paths = [str(Path(orchestrator.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    log = folder / "log.rendering"
    ended = process.run(
        [sys.executable, "-m", "orchestrator.report.rendering", str(listed)],
        cwd=folder,
        log=log,
        limit_s=LIMIT_S,
        # VTK must not wait for a display that is named but not there
        env={"DISPLAY": "", "PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )
    return "" if ended.returncode == 0 else _cause(ended, log)


def _cause(ended: process.Ended, log: Path) -> str:
    if ended.timed_out:
        what = f"the drawing process did not end within {LIMIT_S:g} s"
    elif ended.returncode < 0:
        what = f"the drawing process was ended by {signal.Signals(-ended.returncode).name}"
    else:
        said = log.read_text(errors="replace").strip().splitlines() or ["it said nothing"]
        what = f"the drawing process failed: {said[-1]}"
    return (
        f"{what}. VTK needs libraries to draw off screen: apt-get install "
        f"--no-install-recommends {PACKAGES}"
    )


def can_render() -> bool:
    """Whether pictures can be drawn on this machine; if not, PACKAGES may be missing."""
    import numpy as np

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        grains = folder / "grains.npz"
        np.savez(grains, centres=np.zeros((1, 2)), colours=np.zeros((1, 3), np.uint8))
        job = {"kind": "grains", "grains": str(grains), "window": [-1, 1, -1, 1]}
        return not run([{**job, "pixels": [16, 16], "out": str(folder / "out.png")}], folder)
