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
step = 0.05
quiet = 6.0
timestep = 0.3
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


LIFT_OFF = """
[flow]
closure = "low"
model = "hill"
[grain]
diameter = 5e-4
stiffness = 1e3
[protocol]
step = 0.05
quiet = 6.0
timestep = 0.3
until = 0.8
[[group]]
name = "lift"
bed = { kind = "pile", height = 0.005, slope_deg = 20.0, mobile_layers = 1, roughness = "d/30" }
"""
"""A pile whose grains lift carries off, up the hill and down it."""


@pytest.fixture(scope="session")
def lift_off(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of one pile whose answer is lift-off."""
    out = tmp_path_factory.mktemp("studies") / "lift"
    ended = pipeline.run(study.parse(LIFT_OFF, name="lift", where="lift"), out, workers=1)
    assert not ended.failures
    root = tmp_path_factory.mktemp("packs") / "lift"
    export(root, out, (4,))
    return root
