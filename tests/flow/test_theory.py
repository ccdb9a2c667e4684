"""The linear theory of a hill: its integrals against exact ones, its stress against the solved."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.bed.shapes import triangle
from orchestrator.flow import theory
from orchestrator.flow.case import WALL_STRESS
from orchestrator.flow.stress import WallStress
from tests.flow.conftest import PILE, Solve

HEIGHT = 0.02


def test_the_integral_of_a_triangle_is_exact() -> None:
    """Mean of H over the windward face: slope 2 ln 2/pi; the crest's logarithm is no harm."""
    x, z = np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.3, 0.0])
    (mean,) = theory.hilbert(np.array([0.0, 1.0]), x, z)
    assert mean == pytest.approx(0.3 * 2 * np.log(2) / np.pi, rel=1e-12)
    edges = np.linspace(-3, 7, 400)
    fine = theory.hilbert(edges, x, z)
    middle = (edges[1:] + edges[:-1]) / 2
    exact = 0.3 / np.pi * np.log(np.abs(middle * (middle - 2)) / (middle - 1) ** 2)
    far = np.min(np.abs(middle[:, None] - x), axis=1) > 0.2
    np.testing.assert_allclose(fine[far], exact[far], atol=2e-3)


def test_a_lorentz_hill_has_the_integral_of_the_tables() -> None:
    """Of 1/(1 + x^2) the Hilbert transform of the slope is (1 - x^2)/(1 + x^2)^2."""
    x = np.linspace(-60, 60, 12001)
    edges = np.linspace(-3, 3, 121)
    middle = (edges[1:] + edges[:-1]) / 2
    exact = (1 - middle**2) / (1 + middle**2) ** 2
    np.testing.assert_allclose(theory.hilbert(edges, x, 1 / (1 + x**2)), exact, atol=2e-3)


def test_coefficients_fulfil_the_equation_of_the_inner_layer() -> None:
    """B gives ln(l/z0) back, which must solve l ln(l/z0) = 2 kappa^2 L."""
    for ratio in (30.0, 1e3, 4e5):
        strength, asymmetry = theory.coefficients(ratio)
        depth = np.pi / asymmetry - 1 - 2 * np.log(np.pi / 2) - 4 * np.euler_gamma
        assert np.exp(depth) * depth == pytest.approx(2 * 0.41**2 * ratio, rel=1e-9)
        assert strength > 0
    # of a smooth hill, as for dunes
    assert theory.coefficients(4e5) == pytest.approx((4.26, 0.228), rel=5e-3)


def test_the_streamline_leaves_and_meets_the_bed_smoothly() -> None:
    for slope in (10.0, 15.0, 20.0):
        x, z = theory.seen_by_the_flow(triangle(slope, HEIGHT))
        falls = np.diff(z) / np.diff(x)
        assert falls[1] == pytest.approx(falls[0], rel=0.05)
        assert falls[-1] == pytest.approx(0, abs=0.01)
        # to second order in the slope
        assert falls.min() == pytest.approx(-theory.STEEPEST, rel=0.08)


@pytest.mark.parametrize("slope", [15.0, 20.0])
def test_the_theory_against_the_solved_flow(solve: Solve, slope: float) -> None:
    pile = replace(PILE, slope_deg=slope)
    solved = WallStress.from_csv(solve(pile) / WALL_STRESS)
    found = theory.hill(triangle(slope, pile.height_m), pile.roughness_m)
    face = pile.height_m / np.sin(np.radians(slope))
    places = np.array([0.3, 0.5, 0.7, 0.9]) * face
    theirs, ours = (np.sqrt(one.mean_over(places, 0.2 * face)) for one in (solved, found))
    np.testing.assert_allclose(ours, theirs, rtol=0.12)
    lee = (found.s_m > face + 0.06 * pile.height_m) & (found.s_m < 2 * face)
    assert not found.tau_wall[lee].any()


def test_a_flat_beds_stress_is_the_undisturbed_one() -> None:
    stress = theory.flat(triangle(15.0, HEIGHT))
    assert (stress.tau_wall == 1).all()
    face = HEIGHT / np.sin(np.radians(15.0))
    np.testing.assert_allclose(stress.edges_m[[0, -1]], [-0.2, 2 * face + 0.4], rtol=1e-12)
    assert stress.mean_over(face, face) == pytest.approx(1)
    top = stress.z_m.argmax()
    assert stress.s_m[top] == pytest.approx(face, rel=0.01)
