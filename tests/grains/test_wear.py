"""The bed that changes."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from orchestrator.grains import bed_state, wear
from orchestrator.grains.bed_state import BedState
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.pile import Pile
from orchestrator.report.figures import bed
from orchestrator.report.results import Results
from orchestrator.study.parts import GrainPart
from orchestrator.study.profile import Profile
from orchestrator.study.scene import Scene
from tests import small_study
from tests.bed.test_line import BEDS
from tests.bed.test_line import bed as bed_of

PILE = """
grain = { diameter = 1e-3 }
method.flow.expansion_ratio = 1.4
bed = { kind = "pile", slope_deg = 25.0, height = 0.01, roughness = "d/30" }
[threshold]
fractions = [0.25, 0.5, 0.75]

[method.grains]
stiffness = 1e3
mobile_layers = 1
load_increment = 0.03
waiting_time = 6.0
time_step = 0.3
"""
METHODS = """
[[group]]
[group.axes]
"method.kind" = ["peeling", "dem"]
"threshold.update" = [0.0, 0.25]
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """One pile by both methods, on a bed that changes and on a frozen one."""
    return small_study.run(tmp_path_factory.mktemp("wear") / "out", PILE + METHODS)


def _pile(results: Results, method: str, *, frozen: bool = False) -> Pile:
    piles = [
        pile for pile in results.plan.piles.values() if pile.scene.method.kind == method
    ]
    return next(pile for pile in piles if (pile.scene.threshold.update == 0) == frozen)


X, Z = (0.0, 0.02, 0.06, 0.1, 0.14, 0.18), (0.0, 0.0, -0.01, 0.005, 0.0, 0.0)
WORN: dict[str, dict[str, Any]] = {
    **BEDS,
    "everything": {"counted": "all"},
    "trough": {"profile": Profile("trough", X, Z, "", "trough"), "height": 0.015},
    "level behind a fence": {**BEDS["flat"], **BEDS["fence"]},
}


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("name", WORN)
def test_the_line_of_any_bed_sinks_with_the_counted_grains_alone(
    name: str, packing: str
) -> None:
    bed = Geometry(
        Scene(grain=GrainPart(diameter=1e-3), bed=bed_of(packing=packing, **WORN[name]))
    )
    whole, counted = BedState.whole(bed.packing), bed.packing.windward
    x = np.linspace(bed.line.x[0], bed.line.x[-1], 2000)
    line = bed_state.sunk(bed, whole)
    assert line.height(x) == pytest.approx(bed.line.height(x), abs=1e-9)
    # the gap between rows, over the cosine of at most 40 degrees, and a grain of level rows
    places = np.where(counted[:, None], np.nan, whole.places)
    bared = BedState(places, whole.left, whole.speed)
    sunk = bed.line.height(x) - bed_state.sunk(bed, bared).height(x)
    places = np.sort(bed.packing.centres[counted, 0])
    away = np.abs(x[:, None] - places).min(axis=1)
    assert sunk[away > bed_state.EDGE + 3] == pytest.approx(0.0, abs=1e-9)
    assert -1e-9 <= sunk.min() <= sunk.max() < 1.7
    assert 0.8 < np.median(sunk[away < 0.5]) < 1.2


@pytest.mark.parametrize("method", ["peeling", "dem"])
def test_a_bed_changes_after_each_part_of_its_grains(
    results: Results, method: str
) -> None:
    pile, cases = _pile(results, method), results.cases
    assert [flow.kind for flow in pile.flows] == ["flow", "worn", "worn"]
    begun = (wear.state(pile, flow, cases) for flow in pile.flows)
    gone = [np.isfinite(worn.left[pile.packing.windward]) for worn in begun]
    for flow, part in zip(pile.flows[:-1], gone[1:], strict=True):
        assert part.sum() >= wear.goal(pile, flow)
    # what has moved never comes back, and the line never rises
    assert all(np.all(after >= before) for before, after in pairwise(gone))
    lines = [wear.line(pile, flow, cases) for flow in pile.flows]
    x = np.linspace(lines[0].x[0], lines[0].x[-1], 300)
    for before, later in pairwise(lines):
        assert np.all(later.height(x) <= before.height(x) + 0.02)
        assert np.any(later.height(x) < before.height(x) - 0.5)
    motion = pile.motion(cases)
    # the bed changed at one flow: what goes then was last seen at rest at the flow below it
    moved = motion.load_step[motion.load_step > 0]
    assert np.all(motion.low[moved] < motion.flow[moved]) or method == "peeling"
    assert motion.fraction[-1] >= 0.75
    assert np.all(np.diff(motion.flow) >= 0)
    # the picture has the line as it sinks
    steps, frozen = (
        bed.read_steps(_pile(results, method, frozen=f), cases) for f in (False, True)
    )
    starts = [step for step, _ in steps.lines]
    assert (starts[0], len(starts)) == (0, 3)
    assert all(steps.totals[step - 1] < steps.totals[step] for step in starts[1:])
    moving, still = (bed.Flows("m/s", each.flow.tolist()) for each in (steps, frozen))
    lines = bed.data(steps, steps.first(0.5), moving)["lines"]
    assert [step for step, _ in lines] == starts
    assert "lines" not in bed.data(frozen, 0, still)


def test_the_table_sets_both_beds_side_by_side(results: Results) -> None:
    table = results.tables["bed_change"]
    assert table["scene_id"].nunique() == 2
    for scene_id, own in table.groupby("scene_id"):
        pile = results.plan.piles[str(scene_id)]
        thresholds = results.tables["pile_threshold"].set_index(
            ["scene_id", "fraction"]
        )
        at = own[own["moved"] == np.ceil(0.75 * pile.packing.count)].iloc[0]
        shields = thresholds.loc[(str(scene_id), 0.75), "shields"]
        assert at["shields"] == pytest.approx(shields)
        assert at["change"] == pytest.approx(at["shields"] / at["shields_frozen"] - 1)
        beyond = own.loc[own["change"].abs() > 0.05, "fraction_moved"]
        assert own["holds_until"].iloc[0] == beyond.min() > 0.25
        # until the first update nothing differs
        assert np.all(own.loc[own["fraction_moved"] <= 0.25, "change"].abs() < 1e-9)
