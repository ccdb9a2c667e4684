"""Finished cases are reused only where the code as it is now would make the same."""

import json
from pathlib import Path

import numpy as np
import pytest

from orchestrator import plan
from orchestrator.physics import laws
from orchestrator.runs import case as case_states
from orchestrator.study import study
from tests.small_study import run

TEXT = """
grain = { diameter = 1e-3 }
threshold.fractions = [0.1]
method.kind = "dem"
forces = { law = "zeng" }

[bed]
kind = "pile"
slope_deg = 25.0
height = 0.006

[method.grains]
stiffness = 1e3
mobile_layers = 1
load_increment = 0.1
final_fraction = 0.1

[[group]]
name = "waves"
method.flow.model = "waves"
[[group]]
name = "solved"
method.flow.cells_per_face = 20
"""


def _kinds_done(cases: Path) -> list[str]:
    """The kinds of the cases that are done as a new plan sees them."""
    planned = plan.make(study.parse(TEXT, name="small", where="test"), cases=cases)
    return sorted(name.partition("-")[0] for name in planned.done(cases))


@pytest.mark.filterwarnings("ignore:.*load steps 10%")
def test_other_code_of_the_same_recipe_does_not_get_old_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = run(tmp_path, TEXT)
    cases = tmp_path / "cases"
    everything = ["flow", "pile", "pile"]
    assert _kinds_done(cases) == everything

    # other code that makes the same: the cases are kept, and it is noted
    monkeypatch.setattr(case_states, "code_digest", lambda: "other code")
    monkeypatch.setattr("orchestrator.runs.reuse.code_digest", lambda: "other code")
    assert _kinds_done(cases) == everything
    for directory in cases.glob("*-*"):
        about = json.loads((directory / case_states.IDENTITY).read_text())
        assert about[case_states.CODE] == "other code"

    # a drag twice as large is in no name of a case, and in the inputs of the piles
    drag = laws.LAWS["zeng"].__class__.drag
    monkeypatch.setattr(
        laws.LAWS["zeng"].__class__, "drag", lambda *given: np.multiply(2, drag(*given))
    )
    monkeypatch.setattr("orchestrator.runs.reuse.code_digest", lambda: "a law")
    monkeypatch.setattr(case_states, "code_digest", lambda: "a law")
    with pytest.warns(UserWarning, match="2 cases were made by other code"):
        assert _kinds_done(cases) == ["flow"]
    with pytest.warns(UserWarning, match="2 cases were made by other code"):
        after = run(tmp_path, TEXT)
    assert _kinds_done(cases) == everything
    column = (
        "shields_dem" if "shields_dem" in before.tables["pile_threshold"] else "shields"
    )
    ratio = (
        after.tables["pile_threshold"][column] / before.tables["pile_threshold"][column]
    )
    assert (ratio < 0.7).all()
