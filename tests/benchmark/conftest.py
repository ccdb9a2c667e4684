"""Packs that several tests read: none of them may change one."""

from pathlib import Path

import pytest

from orchestrator import pipeline
from orchestrator.benchmark.export import export
from orchestrator.study import study

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


@pytest.fixture(scope="session")
def formulas(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of levels 1 and 2."""
    root = tmp_path_factory.mktemp("packs") / "formulas"
    export(root, None, ())
    return root


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a finished study."""
    out = tmp_path_factory.mktemp("studies") / "small"
    ended = pipeline.run(study.parse(STUDY, name="small", where="small"), out, workers=2)
    assert not ended.failures
    return out


@pytest.fixture(scope="session")
def all_levels(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of all levels."""
    root = tmp_path_factory.mktemp("packs") / "all"
    export(root, finished, ())
    return root


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


def _theory(folder: Path, **fields: object) -> Path:
    """A pack of level 4."""
    asked = study.parse(THEORY.format(**fields), name="theory", where="theory")
    ended = pipeline.run(asked, folder / "study", workers=1)
    assert not ended.failures
    export(folder / "pack", folder / "study", (4,))
    return folder / "pack"


@pytest.fixture(scope="session")
def lift_off(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of one pile whose grains lift carries off: Eq. 2 far above its range."""
    folder = tmp_path_factory.mktemp("lift-off")
    return _theory(folder, law="low", diameter=5e-4, bed="mobile_layers = 1")


@pytest.fixture(scope="session")
def level_rows(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of one pile of level rows, which empties in chains."""
    folder = tmp_path_factory.mktemp("level-rows")
    return _theory(folder, law="high", diameter=5e-4, bed='packing = "horizontal"')
