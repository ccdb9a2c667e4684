"""What the tests of fidelity share."""

from collections.abc import Callable

import pytest

from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

MakePile = Callable[..., Scene]


@pytest.fixture(scope="session")
def pile() -> MakePile:
    """A pile by DEM on a solved flow, with some fields changed; those of its bed are keywords."""
    bed = 'kind = "pile", slope_deg = 15.0, roughness = "d/30"'
    text = f"grain = {{ diameter = 1e-3 }}\nbed = {{ {bed} }}"
    (scene,) = study.parse(text, name="one", where="test").scenes

    def make(fields: dict[str, object] | None = None, **bed: object) -> Scene:
        return changed(
            scene, {**{f"bed.{k}": v for k, v in bed.items()}, **(fields or {})}
        )

    return make
