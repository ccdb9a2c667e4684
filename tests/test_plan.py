"""What a plan says before anything runs."""

from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.lab import budget
from orchestrator.study import study

PILE = """
fluid.kind = "water"
grain = {{ diameter = 1e-3, density = 2650.0 }}
bed = {{ kind = "pile", slope_deg = 15.0{} }}
"""


@pytest.mark.parametrize(
    ("bed", "more", "line"),
    [
        ("", "", ""),
        (
            ', packing = "poured"',
            "",
            "4 thresholds of piles will not be usable: equal spheres in one plane",
        ),
        (
            "",
            'method.flow.model = "waves"\nmethod.kind = "pivot"',
            "4 thresholds of piles will not be usable: the error of their fidelity on such "
            "beds is not known; `orchestrator convergence` estimates it",
        ),
        (
            "",
            "tolerance = 0.01",
            "4 thresholds of piles will not be usable: no fidelity is known to be within "
            "the tolerance",
        ),
        ("", "tolerance = 0.2", "1 check by DEM"),
    ],
)
def test_what_is_known_from_the_file_is_said(
    bed: str, more: str, line: str, tmp_path: Path
) -> None:
    """Once it was said after minutes of runs."""
    text = f"{more}\n" + PILE.format(bed)
    asked = study.parse(text, name="one", where="one")
    said = "\n".join(plan.forecast(asked, tmp_path, 2))
    assert line in said
    if not line:
        assert "will not be usable" not in said


def test_the_budget_of_a_study_has_its_criterion() -> None:
    """It once answered by grains that leave, without a word."""
    text = PILE.format(", height = 0.01")
    asked = study.parse(text, name="one", where="one")
    _, decisions = budget.changes(asked)
    assert {one.scene.threshold.criterion for one in decisions.values()} == {
        "sustained"
    }
