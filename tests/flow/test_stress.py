"""The stress along the bed: exact means, the reversed flow, and what is not sound."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from orchestrator.bed.line import triangle
from orchestrator.errors import InputError
from orchestrator.flow import theory
from orchestrator.flow.stress import (
    WallStress,
    bubble,
    diagnostics,
    reattachment,
)
from orchestrator.types import FloatArray

HEIGHT = 0.02


@pytest.fixture
def stress() -> WallStress:
    """A bed of 60 unequal faces, with flow that runs back on some."""
    random = np.random.default_rng(7)
    length = random.uniform(1e-4, 3e-3, 60)
    tau, eq10 = random.normal(1.0, 1.0, (2, 60))
    s, z_e = (
        np.cumsum(length) - length / 2 - length[:20].sum(),
        random.uniform(2e-4, 4e-4, 60),
    )
    x, z = random.normal(size=(2, 60))
    return WallStress(s, x, z, length, z_e, tau, eq10)


def overlap_mean(
    stress: WallStress, values: np.ndarray, s: float, length: float
) -> float:
    """The mean by its definition, face by face."""
    starts, ends = stress.edges_m[:-1], stress.edges_m[1:]
    shared = np.minimum(ends, s + length / 2.0) - np.maximum(starts, s - length / 2.0)
    return float(np.sum(values * np.maximum(shared, 0.0)) / length)


@pytest.mark.parametrize("length", [1e-6, 5e-4, 1e-2])
def test_mean_is_the_integral_of_the_faces(stress: WallStress, length: float) -> None:
    places = np.linspace(stress.edges_m[0] + length, stress.edges_m[-1] - length, 97)
    eq10 = np.sign(stress.ustar_over_ustar0_eq10) * stress.ustar_over_ustar0_eq10**2
    means = stress.mean_over(places, length), stress.mean_over(places, length, "eq10")
    for mean, values in zip(means, (stress.tau_wall, eq10), strict=True):
        expected = [overlap_mean(stress, values, s, length) for s in places]
        np.testing.assert_allclose(mean, expected, rtol=1e-8, atol=1e-8)


def _bent(slope_deg: float, tau: Callable[[FloatArray], FloatArray]) -> WallStress:
    """A flat bed, then a slope from s = 0 on, of 20 faces each 1 mm long; tau of each from s."""
    s = np.arange(-19.5, 20) * 1e-3
    up = np.where(s > 0, np.radians(slope_deg), 0.0)
    lengths, tau_ = (np.full(40, 1e-3), np.full(40, 5e-4)), tau(s)
    return WallStress(s, s * np.cos(up), s * np.sin(up), *lengths, tau_, tau_)


@pytest.mark.parametrize("slope_deg", [0.0, 10.0, 35.0])
def test_a_stress_that_is_linear_is_read_exactly(slope_deg: float) -> None:
    stress = _bent(slope_deg, lambda s: 1.0 + 30.0 * s)
    places = np.linspace(-19e-3, 19e-3, 77)
    np.testing.assert_allclose(
        stress.mean_over(places, 2e-4), 1.0 + 30.0 * places, rtol=1e-9
    )


def test_no_face_reaches_beyond_its_neighbours_or_over_a_bend() -> None:
    bent = _bent(15.0, lambda s: np.where(s > 0, 2.0, 0.5))
    np.testing.assert_allclose(
        bent.mean_over([-2e-4, 2e-4], 2e-4), [0.5, 2.0], rtol=1e-9
    )
    flat = _bent(0.0, lambda s: np.where(s > 0.0101, 2.0, np.where(s > 0, 0.5, 0.4)))
    read = flat.mean_over(np.linspace(-19e-3, 19e-3, 400), 1e-5)
    assert 0.4 - 1e-9 <= read.min() <= read.max() <= 2.0 + 1e-9


@pytest.mark.parametrize(
    ("s", "length"), [(0.0, 0.0), (0.0, -1.0), (0.0, 1.0), (9.0, 1e-4)]
)
def test_no_mean_beyond_the_bed(stress: WallStress, s: float, length: float) -> None:
    with pytest.raises(InputError, match="within the bed"):
        stress.mean_over(s, length)


@pytest.fixture
def sound() -> WallStress:
    """The undisturbed stress with cells 1 mm high and reversed flow up to 6 h behind the crest."""
    stress = theory.flat(triangle(15.0, HEIGHT))
    crest = HEIGHT / np.tan(np.radians(15.0))
    behind = (stress.x_m > crest + 1e-3) & (stress.x_m < crest + 6 * HEIGHT)
    return replace(
        stress,
        z_e_m=np.full_like(stress.s_m, 5e-4),
        tau_wall=np.where(behind, -0.1, stress.tau_wall),
    )


def test_each_flaw_is_named(sound: WallStress) -> None:
    attached = replace(sound, tau_wall=np.abs(sound.tau_wall))
    for flaw, stress, approach, reynolds, z0 in (
        ([], sound, 1.0, 5e4, 3e-5),
        (["z_e_over_z0"], sound, 1.0, 5e4, 1.1e-3),
        (["y_plus"], sound, 1.0, 4e3, 3e-5),
        (["reattachment_over_h"], attached, 1.0, 5e4, 3e-5),
        (["approach_ustar_over_log_law"], sound, 0.9, 5e4, 3e-5),
        (["approach_ustar_over_log_law"], sound, np.nan, 5e4, 3e-5),
    ):
        more = {"reattachment_over_h": reattachment(stress, 15.0, HEIGHT)}
        table = diagnostics(stress, approach, reynolds, z0, 100, more)
        assert table.index[table["sound"] == "no"].tolist() == flaw


def test_a_corners_eddy_does_not_end_the_reversed_flow(sound: WallStress) -> None:
    crest = HEIGHT / np.tan(np.radians(15.0))
    eddy = np.abs(sound.x_m - crest - 2 * HEIGHT) < 0.3 * HEIGHT
    stress = replace(sound, tau_wall=np.where(eddy, 0.1, sound.tau_wall))
    found = bubble(stress, HEIGHT)
    assert found is not None
    assert found == pytest.approx((0.05, 6), abs=0.03)
    again = np.abs(sound.x_m - crest - 12 * HEIGHT) < HEIGHT
    assert (
        bubble(replace(stress, tau_wall=np.where(again, -1, stress.tau_wall)), HEIGHT)
        == found
    )
