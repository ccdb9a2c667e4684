"""The columns of the stress along a bed, each with a number that no other has."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orchestrator.flow.stress import WallStress
from orchestrator.tables.flows import wall_stress


def test_each_column_of_the_stress_has_its_own_quantity() -> None:
    stress = WallStress(
        s_m=np.array([0.1, 0.3]),
        x_m=np.array([0.09, 0.28]),
        z_m=np.array([0.02, 0.05]),
        length_m=np.array([0.2, 0.2]),
        z_e_m=np.array([1e-3, 1e-3]),
        tau_wall=np.array([-0.25, 4.0]),
        ustar_over_ustar0_eq10=np.array([-0.7, 1.5]),
    )
    pile: Any = SimpleNamespace(
        stress=lambda cases: stress,
        flow=SimpleNamespace(name="flow-1", roughness_m=3e-4),
        bed=SimpleNamespace(
            slope_deg=20.0,
            height=0.5,
            place=lambda x: x + 10.0,
            level=lambda z: z + 20.0,
        ),
    )
    found = wall_stress(pile, Path())
    expected = {
        "s_m": [0.1, 0.3],
        "s_over_h": [0.2, 0.6],
        "x_m": [10.09, 10.28],
        "z_m": [20.02, 20.05],
        "ustar_over_ustar0_wall": [-0.5, 2.0],
        "ustar_over_ustar0_eq10": [-0.7, 1.5],
    }
    for name, numbers in expected.items():
        assert found[name] == pytest.approx(np.array(numbers)), name
    told = (found["flow_case"], found["alpha_deg"], found["h_m"], found["z0_m"])
    assert told == ("flow-1", 20.0, 0.5, 3e-4)
