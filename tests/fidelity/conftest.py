"""What the tests of fidelity share."""

from collections.abc import Callable

import pytest

from orchestrator.fidelity.levels import changed
from orchestrator.study import study
from orchestrator.study.scene import Scene

MakePile = Callable[..., Scene]


@pytest.fixture(scope="session")
def pile() -> MakePile:
    """A pile as it is asked for by DEM on a solved flow, with some fields changed.

    Fields of its bed are keywords; other fields, as a study file names them, are in a dictionary.
    """
    text = """
        grain = { diameter = 1e-3 }
        bed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }
    """
    (scene,) = study.parse(text, name="one", where="test").scenes

    def make(fields: dict[str, object] | None = None, **bed: object) -> Scene:
        return changed(scene, {**{f"bed.{k}": v for k, v in bed.items()}, **(fields or {})})

    return make
