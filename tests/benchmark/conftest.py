"""Packs that several tests read, none of which may change one, and solvers that go wrong."""

import json
import shlex
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from orchestrator import pipeline
from orchestrator.benchmark import compare, pack
from orchestrator.benchmark.compare import Options, Outcome
from orchestrator.benchmark.export import export
from orchestrator.runs.files import digest_files
from orchestrator.study import study
from tests.conftest import Shared
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[2]
NATIVE = ROOT / "examples" / "native"
PROTOCOL = (
    "[method.grains]\nload_increment = 0.05\nwaiting_time = 6.0\ntime_step = 0.3\n"
)
SMALL = f"""{PROTOCOL}
stiffness = 1e3
[method.flow]
[grain]
diameter = 1e-3
[[group]]
name = "piles"
bed = {{ kind = "pile", height = 0.01, slope_deg = 20.0 }}
method.grains.mobile_layers = 1
[[group]]
name = "grains"
bed = {{ slope_deg = 10.0 }}
"""
"""One small pile, one grain."""
THEORY = f"""{PROTOCOL}
final_fraction = 0.8
stiffness = 1e3
[method.flow]
model = "waves"
[grain]
diameter = 5e-4
[forces]
law = "%s"
[[group]]
name = "pile"
bed.kind = "pile"
bed.height = 0.005
bed.slope_deg = 20.0
bed.roughness = "d/30"
%s
"""
"""A pile under the stress of a theory, which needs no OpenFOAM."""
POURED = f"""
fluid = {{ density = 1000.0, viscosity = 1e-6 }}
grain = {{ diameter = 1e-3, density = 2650.0, sizes = {{ sigma_g = 1.3 }} }}
method.flow.model = "waves"
threshold.fractions = [0.1, 0.3]
[bed]
kind = "pile"
shape = "gaussian"
packing = "poured"
slope_deg = 15.0
height = 0.005
poured_depth = 4.0
{PROTOCOL}
final_fraction = 0.4
stiffness = 1e3
"""
"""A poured hump of grains of many sizes."""


def _pack(name: str, text: str = "", levels: tuple[int, ...] = ()) -> Any:
    """The fixture of a pack of a study, which lies beside it; without a text one of formulas."""

    @pytest.fixture(scope="session", name=name)
    def packed(shared: Shared) -> Path:
        with shared(f"pack-{name}") as folder:
            root, source = folder / "pack", folder / "study" if text else None
            if not (root / "manifest.json").exists():
                if source:
                    asked = study.parse(text, name=name, where=name)
                    assert not pipeline.run(asked, source, workers=2).failures
                export(root, source, levels)
            return root

    return packed


formulas = _pack("formulas")
all_levels = _pack("all_levels", SMALL)
poured = _pack("poured", POURED, (4,))
# Eq. 2 far above its range: grains that lift carries off; and level rows, which empty in chains
lift_off = _pack("lift_off", THEORY % ("low", "method.grains.mobile_layers = 1"), (4,))
level_rows = _pack("level_rows", THEORY % ("high", 'bed.packing = "horizontal"'), (4,))


SCENE = Options(patterns=("2-incline-5",), seconds=HANGS_S, memory=0.5)
RIGHT = f"{shlex.join([sys.executable, str(NATIVE / 'solver.py')])} {{case}} {{out}}"
"""Command of the example."""
HEAD = """
import math, os, sys, time
from pathlib import Path
from typing import Any
sys.path.insert(0, {native!r})
import solver
case, out = map(Path, sys.argv[1:])
"""
TAIL = "\nsys.exit(solver.main(case, out))\n"
AFTER = "\ncode = solver.main(case, out)\ntext = out.read_text()\n"
"""Beginning of a body that changes the answer of the right solver."""


def program(folder: Path, body: str) -> str:
    """The command of a solver that is the example but for something."""
    path = folder / "my solver.py"
    path.write_text(HEAD.format(native=str(NATIVE)) + body)
    return f"{shlex.join([sys.executable, str(path)])} {{case}} {{out}}"


def run(pack: Path, folder: Path, body: str, options: Options = SCENE) -> Outcome:
    """Run a solver of such a body on a pack, into `results` of a folder."""
    return compare.run(pack, program(folder, body), folder / "results", options)


def verdicts_in(folder: Path) -> pd.DataFrame:
    """The verdicts of that run, by scene."""
    return pd.read_csv(folder / "results" / "verdicts.csv").set_index("scene")


def seal(root: Path) -> None:
    """Make the digests of a pack those of its files, as whoever means harm does."""
    files = [*(root / name for name in pack.FILES), *root.glob("scenes/**/*")]
    digests = digest_files([path for path in files if path.is_file()], root=root)
    manifest = json.loads((root / pack.MANIFEST).read_text())
    (root / pack.MANIFEST).write_text(json.dumps({**manifest, "sha256": digests}))
