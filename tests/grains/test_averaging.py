"""The stress that a grain feels is the mean over its own length, or over a longer one."""

import numpy as np
import pytest

from orchestrator.flow.stress import WallStress
from orchestrator.grains.geometry import Geometry
from orchestrator.study import study

DIAMETER, HEIGHT = 1e-3, 0.02


def _stress() -> WallStress:
    """Faces of 0.5 mm with any stress, back and forth."""
    random = np.random.default_rng(11)
    s = np.linspace(-0.1, 0.1, 401)[:-1]
    faces = np.full(400, 5e-4)
    tau = random.normal(0.0, 1.0, 400)
    return WallStress(s, s, np.zeros(400), faces, faces, tau, tau)


def _geometry(averaging_length: float) -> Geometry:
    bed = f'kind = "pile", slope_deg = 20.0, height = {HEIGHT}, roughness = "d/30"'
    text = (
        f"grain = {{ diameter = {DIAMETER} }}\nbed = {{ {bed} }}\n"
        f"forces.averaging_length = {averaging_length}\n"
    )
    (scene,) = study.parse(text, name="one", where="test").scenes
    return Geometry(scene)


@pytest.mark.parametrize(
    ("averaging_length", "over"),
    [
        (0.025, DIAMETER),  # less than a grain
        (0.1, 0.1 * HEIGHT),
        (0.5, 0.5 * HEIGHT),
    ],
)
def test_a_grain_feels_the_mean_over_the_averaging_length(
    averaging_length: float, over: float
) -> None:
    stress = _stress()
    places = np.linspace(-60.0, 60.0, 41)
    found = _geometry(averaging_length).felt(stress, places)
    mean = stress.mean_over(places * DIAMETER, over)
    assert np.sign(found) * found**2 == pytest.approx(mean, rel=1e-7)
    assert len({*np.sign(found)}) == 2


def test_a_longer_mean_is_another_stress() -> None:
    places = np.linspace(-60.0, 60.0, 41)
    short, long = (_geometry(one).felt(_stress(), places) for one in (0.025, 0.5))
    assert np.abs(short - long).max() > 0.5
