"""The remark on a method that was chosen by default says nothing that is not so."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.fidelity.decision import decide, floor_of
from orchestrator.report import remarks
from orchestrator.study import study


def _said(packing: str, slope: float) -> tuple[str, bool]:
    """What is said of one pile, and whether its error is below the model's spread."""
    text = f"""
        fluid.kind = "air"
        grain = {{ diameter = 1e-3, density = 2650.0 }}
        threshold.criterion = "entrained"
        [bed]
        kind = "pile"
        height = 0.01
        slope_deg = {slope}
        packing = "{packing}"
    """
    asked = study.parse(text, name="one", where="one")
    (scene,) = asked.scenes
    decision = decide(scene, None)
    assert decision.is_chosen
    results: Any = SimpleNamespace(
        plan=SimpleNamespace(decisions={scene.id: decision}), study=asked
    )
    (remark,) = remarks._fidelity(results)
    return remark.text, decision.known.total <= floor_of(decision.scene).error


@pytest.mark.parametrize(
    ("packing", "slope", "is_less"),
    [("aligned", 15.0, True), ("horizontal", 20.0, False)],
)
def test_assumptions_matter_more_only_where_they_do(
    packing: str, slope: float, is_less: bool
) -> None:
    """Of level rows it once said: at most 19 % off; assumptions change it by more (11 %)."""
    text, below = _said(packing, slope)
    assert below == is_less
    assert ("assumptions of the model change a threshold by more" in text) == is_less
    assert ("At 1 of 1 beds this is more than" in " ".join(text.split())) != is_less
    assert "measured on" in text
