"""Thresholds that the physics of the model does not cover are not usable, with the reason."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator import plan, tables
from orchestrator.study import study

PILE = """
grain = {{ diameter = 1e-3, density = 2650.0 }}
protocol = {{ method = "pivot" }}
fluid = {{ {fluid} }}
flow = {{ model = "flat"{flow} }}
bed = {{ kind = "pile", slope_deg = 15.0, height = {height}, roughness = "{roughness}" }}
"""
GRAIN = """
grain = {{ diameter = {d}, density = 2650.0 }}
protocol = {{ method = "pivot" }}
fluid = {{ density = 1000.0, viscosity = 1e-6 }}
bed = {{ {bed} }}
forces = {{ {forces} }}
"""
WATER = "density = 1000.0, viscosity = 1e-6"


def why(text: str, path: Path) -> pd.Series:
    """The reasons against the first table of thresholds of a study."""
    asked = study.parse(text, name="t", where="t")
    made = tables.make(asked, plan.make(asked), path, ())
    name = "pile_threshold" if "pile" in text else "single_grain"
    return made[name]["why_not"]


@pytest.mark.parametrize(
    ("fluid", "flow", "laminar"),
    [
        ("density = 1000.0, viscosity = 6e-4", "", True),
        (WATER, "", False),
        ("density = 1000.0, viscosity = 2e-4", ', top = "open water", depth = 0.1', True),
        (WATER, ', top = "open water", depth = 0.1', False),
    ],
)
def test_a_laminar_flow_has_no_usable_threshold(
    tmp_path: Path, fluid: str, flow: str, laminar: bool
) -> None:
    found = why(PILE.format(fluid=fluid, flow=flow, height=0.02, roughness="d/3"), tmp_path)
    assert found.str.contains("laminar flow").eq(laminar).all()


@pytest.mark.parametrize(
    ("d", "bed", "forces", "reason"),
    [
        (2e-4, 'roughness = "d/30", relative_size = 0.1', "", "hidden grain"),
        (2e-4, 'roughness = "d/30", relative_size = 0.5', "", ""),
        (2e-4, 'roughness = "d/30", slope_deg = 20.0', "lift_coefficient = 30.0", "lift over"),
        (2e-4, 'roughness = "d/30", slope_deg = 20.0', "", ""),
        (1e-3, "roughness = 1e-12", "", "smooth wall"),
        (1e-3, 'roughness = "d/30"', "", ""),
        (1e-3, 'roughness = "d/30"', 'law = "claudin-andreotti"', "unverified force law"),
    ],
)
def test_single_grains_beyond_the_model(
    tmp_path: Path, d: float, bed: str, forces: str, reason: str
) -> None:
    (found,) = why(GRAIN.format(d=d, bed=bed, forces=forces), tmp_path)
    assert reason in found
    assert bool(found) == bool(reason)
