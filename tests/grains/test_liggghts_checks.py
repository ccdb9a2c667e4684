"""The contact law as LIGGGHTS runs it, against exact answers, and a bed that feeds itself."""

import math
import re
import shutil
from pathlib import Path

import pytest

from orchestrator.benchmark.checks import passing_time
from tests.conftest import Deck

MU = math.tan(math.radians(35))


def _number(said: str, label: str) -> float:
    found = re.search(rf"^{label}: (\S+)$", said, re.MULTILINE)
    assert found, said
    return float(found[1])


@pytest.mark.parametrize("damping", [0.05, 0.1, 0.3])
def test_restitution_of_a_head_on_collision(run_check: Deck, damping: float) -> None:
    # the contact ends where the force does, not the overlap: the phase then is pi - 2 asin(zeta)
    said = run_check("in.collision", damping=damping, time_step=0.01)
    phase = math.pi - 2 * math.asin(damping)
    exact = math.exp(-damping / math.sqrt(1 - damping**2) * phase)
    assert _number(said, "restitution") == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("angle", [5.0, 20.0, 60.0, 70.0, 75.0])
def test_a_sphere_rolls_on_an_incline_and_slides_on_a_steep_one(
    run_check: Deck, angle: float
) -> None:
    said, alpha = run_check("in.incline", incline=angle), math.radians(angle)
    rolls = math.tan(alpha) < 3.5 * MU
    exact = 5 / 7 * math.sin(alpha) if rolls else math.sin(alpha) - MU * math.cos(alpha)
    assert _number(said, "acceleration over g") == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("speed", [1.0, 2.0, 5.0])
def test_sliding_start_ends_in_rolling(run_check: Deck, speed: float) -> None:
    said = run_check("in.sliding", speed=speed, time_step=0.02)
    assert _number(said, "speed at half the time") == pytest.approx(6 / 7, rel=0.01)
    assert _number(said, "speed when it rolls") == pytest.approx(5 / 7, rel=0.01)
    assert _number(said, "spin when it rolls") == pytest.approx(5 / 7, rel=0.01)


@pytest.mark.parametrize("push", [1.5, 2.0, 3.0])
@pytest.mark.parametrize("displacement_criterion", [0.3, 0.5])
def test_a_pushed_grain_passes_the_marker_in_time(
    run_check: Deck, push: float, displacement_criterion: float
) -> None:
    said = run_check(
        "in.passing", push=push, displacement_criterion=displacement_criterion
    )
    exact = passing_time(push, displacement_criterion)
    assert _number(said, "time of passing") == pytest.approx(exact, rel=0.005)


FOLDER = Path(__file__).parents[2] / "examples" / "flux"


@pytest.mark.skipif(
    shutil.which("liggghts") is None, reason="liggghts is not installed"
)
def test_a_bed_feeds_itself_above_its_threshold_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(FOLDER))
    import measure  # type: ignore[import-not-found]

    rest, swept = measure.flux(tmp_path, 1, (0.003, 0.1), hold=10.0, length=20)
    assert abs(rest) < measure.CRITERION
    assert swept > 100 * measure.CRITERION
