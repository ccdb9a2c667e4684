"""Noise of measured bed lines: how large it is, and what smoothing it needs."""

import numpy as np
import pytest

from orchestrator.study.noise import SLOPE, needed_smoothing, standard_deviation
from orchestrator.study.profile import read_profile
from orchestrator.types import FloatArray

X = np.linspace(0, 60, 301)


def dune(x: FloatArray) -> FloatArray:
    side = 1.5 * (1 - np.cos(np.pi * np.clip((x - 5) / 38.73, 0, 1)))
    lee = np.maximum(3 - (x - 43.73) * np.tan(np.radians(30)), 0)
    return np.asarray(np.minimum(side, lee))


@pytest.mark.parametrize("sigma", [1e-4, 5e-3, 0.05])
@pytest.mark.parametrize("spread", [0.0, 0.08])
def test_the_noise_of_points_is_told_from_the_shape_of_the_bed(
    sigma: float, spread: float
) -> None:
    for seed in range(10):
        random = np.random.default_rng(seed)
        x = X + spread * random.uniform(-1, 1, len(X))
        z = dune(x) + sigma * random.standard_normal(len(x))
        assert standard_deviation(x, z) == pytest.approx(sigma, rel=0.35)


def test_a_bed_without_noise_needs_no_smoothing() -> None:
    wave = 0.5 * np.sin(np.linspace(0, 80, 500))
    for x, z in (
        (X, dune(X)),
        (np.linspace(0, 80, 500), wave),
        (X, np.abs((X / 4) % 1 - 0.5)),
        (X[:10], dune(X)[:10]),
    ):
        assert needed_smoothing(x, z) == 0


def test_the_smoothing_that_is_needed_leaves_the_slope_that_is_said() -> None:
    x = np.linspace(0, 300, 1501)
    slopes = []
    for seed in range(5):
        z = dune(x) + 0.015 * np.random.default_rng(seed).standard_normal(len(x))
        needed = needed_smoothing(x, z)
        lines = [f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist(), strict=True)]
        text = "\n".join(["x_m,z_m", *lines])
        smooth = read_profile(text, "scan", "scan", needed)
        at = np.array(smooth.x)
        level = at > 60  # behind the dune all slopes are of noise
        slopes.append(np.gradient(np.array(smooth.z), at)[level].std())
    assert np.mean(slopes) == pytest.approx(SLOPE, rel=0.2)
