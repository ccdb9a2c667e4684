"""Gusts: the largest stress of some events never holds a grain down."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from orchestrator.grains.forces import on_slopes
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import loads_of
from orchestrator.grains.pile_case import in_time
from orchestrator.physics.gusts import gust_stresses, peak_over_mean
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import Scene
from orchestrator.study.study import parse

INTENSITIES = st.floats(1e-17, 1.0)
EVENTS = st.integers(2, 10**9)
SAND = """
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0 }
method.kind = "pivot"
"""
PILE = (
    SAND
    + 'bed = { kind = "pile", slope_deg = 15.0, height = 0.01 }\nmethod.flow.model = "flat"\n'
)


def _scene(text: str, intensity: float, events: int) -> Scene:
    gusts = f"flow.gusts = {{ intensity = {intensity!r}, events = {events} }}\n"
    (scene,) = parse(text + gusts, name="gusts", where="gusts").scenes
    return scene


@given(intensity=INTENSITIES, events=EVENTS)
@example(intensity=1.0, events=2)
@example(intensity=1e-17, events=2)
def test_peaks_are_not_below_the_mean_and_rise_with_the_events(
    intensity: float, events: int
) -> None:
    peak = peak_over_mean(intensity, events)
    assert peak >= 1
    assert peak_over_mean(intensity, 2 * events) >= peak
    # the closed form of the quantile, where it is above the mean
    assert peak_over_mean(0.4, 100) == pytest.approx(2.28, abs=5e-3)


@given(intensity=INTENSITIES, events=EVENTS)
@example(intensity=1.0, events=2)
@example(intensity=0.4, events=2)
def test_no_gusts_strengthen_a_bed(intensity: float, events: int) -> None:
    (steady,) = parse(SAND, name="steady", where="steady").scenes
    gusty = closed_form(_scene(SAND, intensity, events))
    assert float(gusty.shields) <= float(closed_form(steady).shields)


def test_gusts_lower_the_mean_flow_by_the_root_of_their_peak() -> None:
    """The peak is one of the stress, which goes with the square of the flow."""
    peak = peak_over_mean(0.4, 100)
    assert peak > 2
    (steady,) = parse(SAND, name="steady", where="steady").scenes
    gusty = _scene(SAND, 0.4, 100)
    ratio = closed_form(gusty).friction_velocity / closed_form(steady).friction_velocity
    assert float(ratio) == pytest.approx(peak**-0.5, rel=1e-9)
    slopes = np.array([-10.0, 0.0, 8.0, 20.0])
    (calm,) = parse(PILE, name="steady", where="steady").scenes
    found = on_slopes(_scene(PILE, 0.4, 100), slopes) / on_slopes(calm, slopes)
    assert found == pytest.approx(peak**-0.5, rel=1e-9)


# the largest stress of the second is above the mean by its last digits alone
@pytest.mark.parametrize(
    ("intensity", "events"), [(1e-17, 2), (1e-15, 100), (0.4, 2), (1.0, 3), (0.4, 100)]
)
def test_the_force_of_each_event_is_that_of_its_stress(
    intensity: float, events: int
) -> None:
    scene = _scene(PILE, intensity, events)
    loads = loads_of(Geometry(scene), Path())
    rising = float(closed_form(scene).friction_velocity) * np.array([1.0, 1.3])
    factors = in_time(scene.flow.gusts, loads, rising)  # type: ignore[arg-type]
    each = factors[1:].reshape(len(rising), events + 1)
    stress = gust_stresses(intensity, events, len(rising), scene.bed.seed)  # type: ignore[union-attr]
    stress = np.pad(stress, ((0, 0), (0, 1)), constant_values=1.0)
    # under steady flows of those stresses
    steady = replace(loads, geometry=Geometry(_scene(PILE, intensity, 2)))
    for step, flow in enumerate(rising):
        force = np.abs(steady.loading.at(flow * np.sqrt(stress[step]))).sum(axis=(1, 2))
        largest = np.abs(loads.loading.at(np.array([flow]))).sum()
        # the force is nearly a power of the stress
        assert each[step] == pytest.approx(force / largest, abs=0.02)
