"""Piles on both real solvers: the flow's stress on the grains, their motion, their thresholds."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import plan, tables
from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.study import study
from tests import small_study

SMALL = """
[grain]
diameter = 1e-3
[bed]
kind = "pile"
slope_deg = 20.0
height = 0.01
roughness = "d/30"
packing = "{packing}"
[flow]
cells_per_face = 20
[protocol]
load_increment = {step}
final_fraction = 0.75
"""


def _study(packing: str = "aligned", step: float = 0.05) -> study.Study:
    return study.parse(SMALL.format(packing=packing, step=step), name="small", where="test")


def _run(asked: study.Study, cases: Path) -> Pile:
    (pile,) = small_study.in_turn(asked, cases).piles.values()
    return pile


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cases")


@pytest.fixture(scope="module")
def slow(cases: Path) -> Pile:
    return _run(_study(step=0.01), cases)


def test_a_slow_pile_follows_the_pivot_law_at_each_grains_own_stress(
    slow: Pile, cases: Path
) -> None:
    motion, speed = Motion.from_csv(cases / slow.case.name), slow.speed(cases)
    pivot = slow.pivot_thresholds(speed)
    for fraction in (0.1, 0.3, 0.5, 0.7):
        found = threshold.of_pile(motion, speed, fraction, slow.scene.fluid.density)
        expected = pivot[int(np.ceil(fraction * motion.count)) - 1]
        assert found.ustar0 == pytest.approx(expected, rel=0.03)


def test_it_empties_from_the_crest_down(slow: Pile, cases: Path) -> None:
    motion, packed = Motion.from_csv(cases / slow.case.name), slow.packing
    moved = motion.level > 0
    # from the crest to the toe no grain moves in an earlier load step than the one above it
    downward = np.argsort(-packed.arc_length[packed.windward][moved])
    load_steps = motion.level[moved][downward]
    assert load_steps[0] == load_steps.min()
    assert np.mean(np.diff(load_steps) >= 0) > 0.9


def test_tables_reconcile(slow: Pile, cases: Path) -> None:
    asked = _study(step=0.01)
    planned = plan.make(asked)
    made = tables.make(asked, planned, cases, planned.done(cases))
    curve, found, grains = (made[f"pile_{name}"] for name in ("curve", "threshold", "grain"))
    assert ((curve["moved"] + curve["not_moved"]) == slow.packing.count).all()
    assert found["shields"].is_monotonic_increasing
    assert (found["shields"].between(found["shields_low"], found["shields_high"])).all()
    # Re* and tau are two views of one stress
    ustar = np.sqrt(found["shields"] * 2499 * 9.81 * 1e-3)
    np.testing.assert_allclose(found["reynolds"], ustar * 1e-3 / 1e-5, rtol=1e-12)
    assert (grains["moved_in_load_step"] > 0).sum() == curve["moved"].iloc[-1]


@pytest.mark.parametrize(
    ("fields", "least", "most"),
    [
        ("slope_deg = 20.0", 1.0, 1.0),
        ('shape = "dune"\nslope_deg = 15.0\nforms = 2', 1.0, 1.01),
        ('shape = "cosine"\nslope_deg = 20.0', 1.5, 4.0),
        ('shape = "flat"', 2.0, 4.0),
    ],
)
def test_the_grains_of_a_row_without_a_free_end_hold_one_another(
    tmp_path: Path, fields: str, least: float, most: float
) -> None:
    text = SMALL.format(packing="aligned", step=0.05).replace("slope_deg = 20.0", fields)
    text = text.replace("cells_per_face = 20", 'model = "flat"')
    (scene,) = study.parse(text, name="row", where="test").scenes
    pile = Pile(scene)
    assert least <= pile.loads(tmp_path).row_hold() <= most
