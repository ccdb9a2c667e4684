"""Density (kg/m3) and viscosity (m2/s) of fluids by name against tables."""

import pytest

from orchestrator.physics.fluids import numbers_of

# CRC Handbook; Tupper, Introduction to Naval Architecture, Table 5.1; U.S. Standard Atmosphere
TABLES: dict[str, list[tuple[float, float, float]]] = {
    "water": [(0, 999.84, 1.793e-6), (20, 998.21, 1.0034e-6), (100, 958.4, 2.94e-7)],
    "seawater": [(10, 1026.9, 1.354e-6), (20, 1024.7, 1.054e-6)],
    "air": [(-50, 1.582, 9.21e-6), (15, 1.225, 1.4607e-5)],
}


@pytest.mark.parametrize("kind", TABLES)
def test_fluids_are_those_of_tables(kind: str) -> None:
    for degrees, density, viscosity in TABLES[kind]:
        numbers = numbers_of(
            {"kind": kind, "temperature_deg_c": degrees, "gravity": 3.7}
        )
        assert numbers["density"] == pytest.approx(density, rel=2e-4)
        assert numbers["viscosity"] == pytest.approx(viscosity, rel=5e-3)
