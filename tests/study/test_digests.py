"""What is asked of a solver is in the name of its case: a run is never taken for another.

Every field of every kind of scene is tried in test_every_field.py; here those of a pile by DEM
stand with the runs that they change.
"""

import pytest

from orchestrator import plan
from orchestrator.study import study

PILE = """
grain.diameter = 1e-3
threshold.criterion = "entrained"
method.kind = "dem"
[bed]
kind = "pile"
slope_deg = 20.0
height = 0.02
roughness = "d/30"
"""
GUSTS = "{{ intensity = {}, events = {}, duration = {} }}"


def cases(line: str = "") -> dict[str, str]:
    """The names of the cases of the pile with one more line in its file, by their kinds."""
    planned = plan.make(study.parse(line + PILE, name="pile", where="test"))
    found = {case.kind: name for name, case in planned.cases.items()}
    assert found.keys() == {"pile", "flow"}
    return found


@pytest.mark.parametrize(
    ("line", "changed"),
    [
        (f"flow.gusts = {GUSTS.format(0.4, 10, 1.0)}", {"pile"}),
        ("forces.stress = 'eq10'", {"pile"}),
        ("forces.averaging_length = 0.1", {"pile"}),
        ("forces.lift_coefficient = 1.7", {"pile"}),
        ("forces.law = 'profile'", {"pile"}),
        ("fluid.viscosity = 1.5e-5", {"pile"}),
        ("fluid.density = 1.2", {"pile"}),
        ("fluid.gravity = 3.7", {"pile"}),
        ("grain.density = 2600.0", {"pile"}),
        ("grain.friction_angle_deg = 40.0", {"pile"}),
        ("threshold.displacement = 0.2", {"pile"}),
        ("method.grains.stiffness = 1e3", {"pile"}),
        ("method.grains.load_increment = 0.03", {"pile"}),
        # what a run needs is in its name: another flow is another pile
        ("method.flow.cells_per_face = 20", {"pile", "flow"}),
        ("method.flow.first_cell_height = 4e-4", {"pile", "flow"}),
    ],
)
def test_a_field_changes_the_names_of_the_runs_that_depend_on_it(
    line: str, changed: set[str]
) -> None:
    before = cases()
    after = cases(f"{line}\n")
    assert {kind for kind in before if before[kind] != after[kind]} == changed


def test_gusts_of_other_numbers_are_other_runs() -> None:
    numbers = [(0.4, 10, 1.0), (0.3, 10, 1.0), (0.4, 11, 1.0), (0.4, 10, 2.0)]
    names = [cases()["pile"]]
    for gusts in numbers:
        names.append(cases(f"flow.gusts = {GUSTS.format(*gusts)}\n")["pile"])
    assert len(set(names)) == 1 + len(numbers)
