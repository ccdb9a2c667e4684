"""A tolerance is compared with the error and the uncertainty of its reference together."""

import pytest

from orchestrator.fidelity import measured
from orchestrator.fidelity.classes import FLOW, GRAINS
from orchestrator.fidelity.decision import decide
from orchestrator.fidelity.fidelities import FIDELITIES
from orchestrator.fidelity.measured import Error, Measured
from orchestrator.study.study import changed
from tests.fidelity.conftest import MakePile

ERROR, UNCERTAINTY = 0.03, 0.04
"""Together 5 %, of the grains; the flow has none."""


@pytest.mark.parametrize(("tolerance", "is_met"), [(0.0499, False), (0.0501, True)])
def test_the_uncertainty_of_the_reference_counts(
    tolerance: float, is_met: bool, pile: MakePile, monkeypatch: pytest.MonkeyPatch
) -> None:
    fractions = (0.1, 0.3, 0.5, 0.7)
    table = {}
    for one in FIDELITIES:
        exact = Measured(fractions, 4 * (Error(0.0, None),))
        off = Measured(fractions, 4 * (Error(ERROR, UNCERTAINTY),))
        table[FLOW, one.name, "wall"] = exact
        table[GRAINS, one.name, "aligned"] = off
    monkeypatch.setattr(measured, "errors", lambda: table)
    scene = changed(pile(), {"method.kind": "auto"})
    answer = decide(scene, tolerance)
    assert answer.is_chosen
    assert answer.error_at(0.3) == pytest.approx(0.05)
    assert ("meets the tolerance at" in answer.why) != is_met
