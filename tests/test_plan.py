"""What a plan says before anything runs."""

import re
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
            "4 thresholds of piles will not be usable: the numerical error on such a "
            "bed was not measured (run `orchestrator convergence` on the study file",
        ),
        (
            ", height = 0.05",
            'method.kind = "dem"',
            "4 thresholds of piles will not be usable: the numerical error on such a "
            "bed was not measured (leave method.kind out: the program then chooses",
        ),
        (
            "",
            "tolerance = 0.01",
            "4 thresholds of piles will not be usable: no fidelity is known to be within "
            "the tolerance",
        ),
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


def test_a_plan_says_what_each_choice_costs_and_names_its_checks(
    tmp_path: Path,
) -> None:
    text = "tolerance = 0.2\nmethod.kind = 'dem'\n" + PILE.format(", height = 0.02")
    text += "\n[[group]]\n[group.axes]\n'bed.height' = [0.016, 0.018, 0.02]\n"
    asked = study.parse(text, name="three", where="three")
    said = [*plan.forecast(asked, tmp_path, 2)]
    (check,) = plan.make(asked).checks.values()
    assert sum("1 check by DEM" in line for line in said) == 1
    assert any(check.case.name in line for line in said)
    (head,) = (
        line for line in said if line.startswith("time of the whole study by tolerance")
    )
    count = sum(len(one.threshold.fractions) for one in asked.scenes)
    assert f"of {count} thresholds" in head
    first = said.index(head) + 1
    names = [line.split(":")[0].strip() for line in said[first : first + 3]]
    assert names == ["tolerance 0.05", "tolerance 0.2", "no tolerance"]
    assert f"{count} known within it" in said[first + 1]
    # no case is done: the time of the file's tolerance is that which is expected
    (time,) = re.findall(r": (about \d+ \w+), ", said[first + 1])
    assert said[-1].startswith(f"expected: {time} with 2 workers")


def test_a_tolerance_that_costs_more_than_the_study_as_written_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Piles are chosen one by one; two that shared a flow may need one each."""
    text = "tolerance = 0.2\nmethod.kind = 'dem'\n" + PILE.format(", height = 0.02")
    asked = study.parse(text, name="one", where="one")
    assert not any("leave it out" in line for line in plan.forecast(asked, tmp_path, 2))
    dear = plan.make(asked)
    costs = {id(dear.cases): 1e9}
    monkeypatch.setattr(
        plan.Plan, "cost_s", property(lambda self: costs.get(id(self.cases), 1.0))
    )
    monkeypatch.setattr(plan, "make", lambda *_: dear)
    assert any("leave it out" in line for line in plan.forecast(asked, tmp_path, 2))


def test_the_budget_of_a_study_has_its_criterion() -> None:
    """It once answered by grains that leave, without a word."""
    text = PILE.format(", height = 0.01")
    asked = study.parse(text, name="one", where="one")
    _, decisions = budget.changes(asked)
    assert {one.scene.threshold.criterion for one in decisions.values()} == {
        "sustained"
    }
