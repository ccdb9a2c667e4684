"""What the tests of the budget share."""

from orchestrator.study import study
from orchestrator.study.scene import Scene


def scene(**bed: object) -> Scene:
    """A pile of grains of 1 mm, by default of 15 degrees."""
    fields = "".join(f", {name} = {value!r}" for name, value in {"slope_deg": 15.0, **bed}.items())
    text = f"""
        grain = {{ diameter = 1e-3 }}
        bed = {{ kind = "pile", roughness = "d/30"{fields} }}
    """
    (found,) = study.parse(text, name="one", where="test").scenes
    return found
