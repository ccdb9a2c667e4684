"""Diagnostics of a flow on beds whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.bed.line import triangle
from orchestrator.flow import diagnostics, theory
from orchestrator.flow.stress import WallStress

HEIGHT = 0.02


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


def unsound(
    stress: WallStress, roughness: float = 3e-5, reynolds: float = 5e4, approach: float = 1.0
) -> set[str]:
    found = diagnostics.of(
        stress,
        approach=approach,
        slope_deg=15.0,
        height=HEIGHT,
        roughness=roughness,
        reynolds=reynolds,
    )
    return {name for name, one in found.items() if not one.sound}


def test_each_flaw_is_named(sound: WallStress) -> None:
    assert unsound(sound) == set()
    assert unsound(sound, roughness=1.1e-3) == {"z_e_over_z0"}
    assert unsound(sound, reynolds=4e3) == {"y_plus"}
    assert unsound(replace(sound, tau_wall=np.abs(sound.tau_wall))) == {"reattachment_over_h"}
    for approach in (0.9, 1.09, np.nan):
        assert unsound(sound, approach=approach) == {"approach_ustar_over_log_law"}


def test_the_end_of_the_reversed_flow(sound: WallStress) -> None:
    assert diagnostics.reattachment(sound, HEIGHT) == pytest.approx(6, abs=0.02)
    assert diagnostics.reattachment(theory.flat(triangle(15.0, HEIGHT)), HEIGHT) == 0


def test_a_corners_eddy_does_not_end_the_reversed_flow(sound: WallStress) -> None:
    crest = HEIGHT / np.tan(np.radians(15.0))
    eddy = np.abs(sound.x_m - crest - 2 * HEIGHT) < 0.3 * HEIGHT
    stress = replace(sound, tau_wall=np.where(eddy, 0.1, sound.tau_wall))
    found = diagnostics.bubble(stress, HEIGHT)
    assert found is not None
    assert found == pytest.approx((0.05, 6), abs=0.03)
    again = np.abs(sound.x_m - crest - 12 * HEIGHT) < HEIGHT
    assert (
        diagnostics.bubble(replace(stress, tau_wall=np.where(again, -1, stress.tau_wall)), HEIGHT)
        == found
    )
