"""What the tests of fidelity share."""

from collections.abc import Callable

import pytest

from orchestrator.fidelity.levels import changed
from orchestrator.study import study
from orchestrator.study.scene import Scene

MakePile = Callable[..., Scene]


@pytest.fixture(scope="session")
def pile() -> MakePile:
    """A pile as it is asked for by DEM on a solved flow, with some fields of its bed changed."""
    text = """
        grain = { diameter = 1e-3 }
        bed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }
    """
    (scene,) = study.parse(text, name="one", where="test").scenes
    return lambda **bed: changed(scene, {f"bed.{name}": value for name, value in bed.items()})
