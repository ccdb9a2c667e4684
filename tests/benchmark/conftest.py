"""Packs that several tests read: none of them may change one."""

from pathlib import Path

import pytest

from orchestrator import pipeline
from orchestrator.benchmark.export import export
from orchestrator.study import study
from tests.conftest import Shared

ROOT = Path(__file__).parents[2]
NATIVE = ROOT / "examples" / "native"
STUDY = """
[flow]
[grain]
diameter = 1e-3
stiffness = 1e3
[protocol]
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
[[group]]
name = "piles"
bed = { kind = "pile", height = 0.01, slope_deg = 20.0, mobile_layers = 1 }
[[group]]
name = "grains"
bed = { slope_deg = 10.0 }
"""
"""One small pile, one grain."""


def _exported(root: Path, source: Path | None, levels: tuple[int, ...] = ()) -> Path:
    """A pack, exported unless it is there."""
    if not (root / "manifest.json").exists():
        export(root, source, levels)
    return root


@pytest.fixture(scope="session")
def formulas(shared: Shared) -> Path:
    """A pack of levels 1 and 2."""
    with shared("packs") as folder:
        return _exported(folder / "formulas", None)


@pytest.fixture(scope="session")
def finished(shared: Shared) -> Path:
    """The directory of a finished study."""
    with shared("studies") as folder:
        asked = study.parse(STUDY, name="small", where="small")
        assert not pipeline.run(asked, folder / "small", workers=2).failures
        return folder / "small"


@pytest.fixture(scope="session")
def all_levels(finished: Path, shared: Shared) -> Path:
    """A pack of all levels."""
    with shared("packs") as folder:
        return _exported(folder / "all", finished)


THEORY = """
[flow]
model = "hill"
[forces]
law = "{law}"
[grain]
diameter = {diameter}
stiffness = 1e3
[protocol]
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.8
[[group]]
name = "pile"
bed = {{ kind = "pile", height = 0.005, slope_deg = 20.0, roughness = "d/30", {bed} }}
"""
"""A pile under the stress of a theory, which needs no OpenFOAM."""


POURED = """
[fluid]
density = 1000.0
viscosity = 1e-6
[grain]
diameter = 1e-3
density = 2650.0
sizes = { sigma_g = 1.3 }
stiffness = 1e3
[bed]
kind = "pile"
shape = "gaussian"
slope_deg = 15.0
height = 0.005
poured_depth = 4.0
packing = "poured"
[flow]
model = "hill"
[protocol]
load_increment = 0.05
waiting_time = 6.0
final_fraction = 0.4
fractions = [0.1, 0.3]
"""
"""A poured hump of grains of many sizes."""


def _theory(folder: Path, **fields: object) -> Path:
    """A pack of level 4."""
    return _packed(folder, THEORY.format(**fields))


def _packed(folder: Path, text: str) -> Path:
    asked = study.parse(text, name="theory", where="theory")
    assert not pipeline.run(asked, folder / "study", workers=1).failures
    return _exported(folder / "pack", folder / "study", (4,))


@pytest.fixture(scope="session")
def lift_off(shared: Shared) -> Path:
    """A pack of one pile whose grains lift carries off: Eq. 2 far above its range."""
    with shared("lift-off") as folder:
        return _theory(folder, law="low", diameter=5e-4, bed="mobile_layers = 1")


@pytest.fixture(scope="session")
def poured(shared: Shared) -> Path:
    """A pack of one poured bed; the study lies beside it."""
    with shared("poured") as folder:
        return _packed(folder, POURED)


@pytest.fixture(scope="session")
def level_rows(shared: Shared) -> Path:
    """A pack of one pile of level rows, which empties in chains."""
    with shared("level-rows") as folder:
        return _theory(folder, law="high", diameter=5e-4, bed='packing = "horizontal"')
