"""Shields diagrams of grains that have to go on: the curve is that of what is answered."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from orchestrator.report import shields, theory
from orchestrator.report.figures import one_grain
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results
from tests import small_study
from tests.report.conftest import axes_of

STUDY = """
fluid.kind = "air"
grain.density = 2650.0
bed.roughness = "{roughness}"
[axes]
"grain.diameter" = [2e-4, 3e-4, 5e-4]
"threshold.criterion" = {criteria}
"""


def results(out: Path, criteria: str, roughness: str = "d/30") -> Results:
    text = STUDY.format(criteria=criteria, roughness=roughness)
    return small_study.run(out, text)


def curves(ax: Axes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The closed-form lines of a panel by their names."""
    found = {}
    for line in ax.lines:
        name = str(line.get_label())
        if line.get_gid() == shields.RESULT[0] and not name.startswith("dotted"):
            found[name] = np.asarray(line.get_xydata(), float).T
    return found  # type: ignore[return-value]


@pytest.mark.parametrize("number", [0, 1])
def test_the_curve_of_grains_that_go_on_passes_through_their_answers(
    number: int, tmp_path: Path
) -> None:
    made = results(tmp_path, '["sustained"]')
    figures = [*overview.draw(made), *one_grain.FIGURE.draw(made)]
    (ax,) = axes_of(figures[number])
    ((name, (x, y)),) = curves(ax).items()
    assert theory.GOING in name
    answers = made.joined("single_grain")
    over = np.interp(
        np.log(answers["reynolds_closed_form"]), np.log(x), np.log(y)
    ) - np.log(answers["shields_closed_form"])
    assert np.abs(over).max() < 0.01
    assert theory.theory_section(made) is None


def test_each_criterion_has_a_curve_of_its_own_with_its_name(tmp_path: Path) -> None:
    made = results(tmp_path, '["entrained", "sustained"]')
    (figure,) = overview.draw(made)
    (ax,) = axes_of(figure)
    found = curves(ax)
    assert sorted(name.rpartition(", ")[2] for name in found) == [
        theory.LEAVING,
        theory.GOING,
    ]
    assert theory.theory_section(made) is not None


@pytest.mark.long
def test_beds_of_another_roughness_have_the_curve_of_sustained_motion(
    tmp_path: Path,
) -> None:
    made = results(tmp_path, '["sustained"]', roughness="d/10")
    (of_bed,) = theory.sustained_curves(made.joined("single_grain"))
    (of_usual,) = theory.sustained_curves(
        results(tmp_path, '["sustained"]').joined("single_grain")
    )
    assert (of_bed.tau > of_usual.tau).all()
    (figure,) = overview.draw(made)
    (ax,) = axes_of(figure)
    (name,) = curves(ax)
    assert theory.GOING in name
