"""Intervals of thresholds: each contains its answer, and has a width."""

from typing import Any

import numpy as np
import pytest

from orchestrator.calculator.table import Table, thresholds
from orchestrator.physics import cessation
from orchestrator.physics.grain import Grain
from orchestrator.physics.reported import WIDTH

COUNT = 300
"""Number of grains at random."""
ENDS = (("tested_low", "tested_high"), ("shields_low", "shields_high"))
"""Columns of the ends of intervals of the Shields number."""


def grains_at_random() -> dict[str, Any]:
    """Grains of all sizes and densities in liquids and gases, on Earth and elsewhere.

    They are those that the table of hops holds; others take a second each.
    """
    chance = np.random.default_rng(50)
    is_gas = chance.uniform(size=COUNT) < 0.3
    # dynamic viscosities of gases are alike, whatever their density
    gas = 10 ** chance.uniform(-0.4, 1.9, COUNT)
    liquid = chance.uniform(700, 1400, COUNT)
    density = np.where(is_gas, gas, liquid)
    viscosity = np.where(
        is_gas,
        10 ** chance.uniform(-5.3, -4.5, COUNT) / gas,
        10 ** chance.uniform(-6.5, -5, COUNT),
    )
    made = {
        "diameter": 10 ** chance.uniform(-4.5, -1.3, COUNT),
        "density": np.where(
            chance.uniform(size=COUNT) < 0.5, 2650.0, chance.uniform(1450, 8000, COUNT)
        ),
        "fluid_density": density,
        "viscosity": viscosity,
        "gravity": chance.choice([9.81, 9.81, 3.71, 1.35, 8.87], COUNT),
        "slope_deg": chance.choice([0.0, 0.0, 0.5, 10.0, 25.0], COUNT),
        "cohesion": chance.choice([0.0, 0.0, 1e-6, 5e-5], COUNT),
        "entrainment_angle_deg": chance.choice([60.0, 60.0, 50.0, 45.0], COUNT),
    }
    of_grain = {name: made[name] for name in made if name != "cohesion"}
    held = cessation.is_tabulated(Grain(**of_grain))
    return {name: column[held] for name, column in made.items()}


def sand_in(fluid: tuple[float, float, float], density: float = 2650.0) -> Table:
    """Thresholds of many sizes in a fluid of a density, a viscosity and a gravity."""
    sizes = np.geomspace(5e-5, 1e-3, 61)
    names = ("fluid_density", "viscosity", "gravity", "density")
    numbers = dict(zip(names, (*fluid, density), strict=True))
    every = {name: [number] * len(sizes) for name, number in numbers.items()}
    return thresholds({"diameter": sizes, **every})


@pytest.fixture(scope="module")
def tables() -> dict[str, Table]:
    """Thresholds at random, and over sizes in some fluids."""
    return {
        "random": thresholds(grains_at_random()),
        "random, entrained": thresholds(grains_at_random(), criterion="entrained"),
        "water": sand_in((999.1, 1.139e-6, 9.81)),
        "air": sand_in((1.225, 1.46e-5, 9.81)),
        "Titan": sand_in((5.4, 1.2e-6, 1.35), 1000.0),
    }


@pytest.mark.parametrize("ends", ENDS)
def test_every_interval_contains_its_answer_and_has_a_width(
    tables: dict[str, Table], ends: tuple[str, str]
) -> None:
    counts = {}
    for name, table in tables.items():
        low, high = (table[end] for end in ends)
        known = np.isfinite(low)
        # an interval has both ends
        np.testing.assert_array_equal(known, np.isfinite(high), name)
        theta = table["shields"][known]
        assert (low[known] <= theta * (1 + 1e-9)).all(), name
        assert (theta <= high[known] * (1 + 1e-9)).all(), name
        assert (high[known] >= low[known] * WIDTH).all(), name
        counts[name] = int(known.sum())
    assert min(counts["random"], counts["water"], counts["air"]) > 50


@pytest.mark.parametrize("criterion", ["sustained", "entrained"])
def test_an_interval_has_no_step_from_size_to_size(criterion: str) -> None:
    """Where one window of Re* ends the next has begun: sizes are 1 % apart."""
    sizes = np.exp(np.arange(np.log(5e-5), np.log(2e-2), 0.01))
    water = {"fluid_density": 999.1, "viscosity": 1.139e-6, "density": 2650.0}
    every = {name: [number] * len(sizes) for name, number in water.items()}
    table = thresholds({"diameter": sizes, **every}, "bridged-gravel", criterion)
    asked = table["law"] == "bridged-gravel"
    assert asked.sum() == len(sizes)
    reynolds = table["reynolds"][asked]
    for end in ("tested_low", "tested_high"):
        over = np.log(table[end][asked] / table["shields"][asked])
        known = np.isfinite(over)
        # from the first to the last that has one all have one
        assert known[np.flatnonzero(known)[0] : np.flatnonzero(known)[-1] + 1].all()
        assert reynolds[known].max() / reynolds[known].min() > 100
        assert np.abs(np.diff(over[known])).max() < np.log(1.05)


def test_no_measurement_is_told_of_another_world(tables: dict[str, Table]) -> None:
    table = tables["Titan"]
    assert not table["tested_rows"].any()
    assert not table["measured_rows"].any()
    assert np.isnan(table["formula_shields"]).all()
    assert not any(table["compared_with"])
    # a formula is called so: flumes have rows in water, and nothing in air stands for them
    assert set(tables["air"]["compared_with"]) == {"formula"}
    in_water = set(tables["water"]["compared_with"])
    assert "flumes" in in_water
    assert in_water <= {"flumes", "formula"}


def test_what_is_usable_lies_inside_its_interval(tables: dict[str, Table]) -> None:
    count = 0
    for table in tables.values():
        inside = table["verdict"] == "usable"
        inside &= table["tested_rows"] > 0
        theta = table["shields"][inside]
        count += len(theta)
        assert (table["tested_low"][inside] < theta).all()
        assert (theta < table["tested_high"][inside]).all()
    assert count > 100
