"""Calibration data: which scenes share a known error, and how errors add up."""

import math

import pytest

from orchestrator.fidelity import calibration
from orchestrator.fidelity.calibration import Known
from tests.fidelity.conftest import MakePile


def test_classes_of_scenes_tell_packings_and_the_limiting_slope_apart(pile: MakePile) -> None:
    classes = {
        calibration.scene_class("grains", scene)
        for scene in (
            pile(),
            pile(slope_deg=30.0),
            pile(packing="horizontal"),
            pile(packing="disordered", disorder=0.02),
            pile(packing="disordered", disorder=0.03),
        )
    }
    assert len(classes) == 5


def test_between_known_fractions_the_worst_one_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {
        ("grains", "peeling", "aligned"): {
            0.1: Known(0.03, 0.0, 1.0),
            0.5: Known(0.01, 0.0, 1.0),
        }
    }
    monkeypatch.setattr(calibration, "measured", lambda: table)
    assert calibration.known_at("grains", "peeling", "aligned", 0.5).error == 0.01
    assert calibration.known_at("grains", "peeling", "aligned", 0.2).error == 0.03
    assert math.isinf(calibration.known_at("grains", "pivot", "aligned", 0.2).error)


def test_errors_and_uncertainties_of_the_parts_add_up_by_their_squares_costs_as_they_are() -> None:
    flow = calibration.known_at("flow", "coarse", "wall", 0.5)
    grains = calibration.known_at("grains", "peeling", "aligned", 0.5)
    (both,) = calibration.known(
        {"flow": "coarse", "grains": "peeling"}, {"flow": "wall", "grains": "aligned"}, [0.5]
    )
    assert both.error == math.hypot(flow.error, grains.error) > 0
    assert both.uncertainty == math.hypot(flow.uncertainty, grains.uncertainty) > 0
    assert both.cost_core_s == flow.cost_core_s + grains.cost_core_s > 0
    assert both.total == math.hypot(both.error, both.uncertainty)
