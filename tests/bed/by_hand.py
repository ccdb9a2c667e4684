"""A poured bed, run again by hand."""

import shutil
import subprocess
from pathlib import Path

from orchestrator.bed.poured_case import DUMP


def is_the_same(bed: Path, copy: Path) -> bool:
    """Whether `Allrun` in a copy of a finished bed writes the same bytes."""
    shutil.copytree(bed, copy)
    (copy / DUMP).unlink()
    ended = subprocess.run(["./Allrun"], cwd=copy, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return (copy / DUMP).read_bytes() == (bed / DUMP).read_bytes()
