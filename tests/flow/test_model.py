"""Fields of a scene's flow: the stress that its grains feel and the case; no solver is run."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import plan, tables
from orchestrator.errors import InputError
from orchestrator.fidelity.decision import as_written
from orchestrator.flow.model import of_scene
from orchestrator.grains.pile import Pile
from orchestrator.physics.velocity import depth_mean_speed
from orchestrator.study import study

TEXT = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }
[method.flow]
"""
WATER = """
model = "flat"
[flow]
top = "open water"
depth = 0.3
[method]
kind = "pivot"
"""


def piles(flow: str) -> list[Pile]:
    asked = study.parse(TEXT + flow, name="knobs", where="test")
    decisions = {scene.id: as_written(scene) for scene in asked.scenes}
    return list(plan.of(decisions).piles.values())


def test_a_theory_needs_no_case(tmp_path: Path) -> None:
    # a mesh that it has not is refused by name
    axes = '[axes]\n"method.flow.model" = ["flat", "waves"]\n'
    with pytest.raises(InputError, match="an effect on solved flows alone"):
        piles(f"first_cell_height = 0.01\n{axes}")
    flat, waves = piles(axes)
    assert flat.model.cases == waves.model.cases == ()
    np.testing.assert_allclose(flat.speed(tmp_path), 1)
    rising = waves.speed(tmp_path)
    assert rising[0] < 0.8
    assert rising[-1] > 1.5
    assert (np.diff(rising) >= 0).all()
    with pytest.raises(InputError, match="a quarter of the pile"):
        piles("first_cell_height = 0.01\n")


@pytest.mark.parametrize(
    ("loaded_grains", "without"),
    [("exposed", []), ("all but crest", [-1]), ("all but toe", [0, 1, 2, 3])],
)
def test_which_grains_carry_the_flows_force(
    tmp_path: Path, loaded_grains: str, without: list[int]
) -> None:
    (pile,) = piles(f'model = "flat"\n[forces]\nloaded_grains = "{loaded_grains}"\n')
    expected = np.ones(pile.packing.count)
    expected[without] = 0
    np.testing.assert_allclose(pile.speed(tmp_path), expected)


def test_beds_of_nearly_one_roughness_share_a_solve() -> None:
    axes = '[axes]\n"bed.roughness" = [3.1e-5, 3.3e-5]\n'
    assert len({pile.flow.name for pile in piles(axes)}) == 2
    first, second = piles("roughness = 3.2e-5\n" + axes)
    assert first.flow.name == second.flow.name
    assert first.case.name != second.case.name


def test_a_flat_beds_height_moves_nothing_behind_a_fence() -> None:
    """The flow over it is measured in the height of the fence, not in a length without meaning."""
    fence = 'obstacles = [{ kind = "fence", x = -0.05, height = 0.02 }]'
    flat = f'shape = "flat", length = 0.2, {fence}, height = '
    texts = [
        TEXT.replace("slope_deg = 15.0", f"{flat}{height}") for height in (0.05, 0.2)
    ]
    scenes = [study.parse(text, name="t", where="t").scenes[0] for text in texts]
    assert len({of_scene(scene).cases for scene in scenes}) == 1
    assert len({scene.first_cell_height for scene in scenes}) == 1


@pytest.mark.parametrize("kind", ["fence", "block", "half-cylinder"])
def test_no_obstacle_stands_in_an_undisturbed_flow(kind: str) -> None:
    """It would change nothing, and be told beside the answer."""
    obstacle = f'obstacles = [{{ kind = "{kind}", x = -0.1, height = 0.02 }}]'
    text = TEXT.replace('"d/30"', f'"d/30", {obstacle}')
    refused = r'method\.flow\.model: the undisturbed flow .* \(choose "solve"\)'
    with pytest.raises(InputError, match=refused):
        study.parse(f'{text}model = "flat"', name="t", where="t")
    assert study.parse(f'{text}model = "waves"', name="t", where="t").scenes


def test_a_slow_solve_keeps_its_first_cells() -> None:
    """Its viscosity is lowered instead: the wall is rough, and the stress scales with the speed."""
    for pile in piles('[axes]\n"method.flow.speed" = [0.5, 1.0, 10.0]\n'):
        flow = pile.flow
        assert flow.first_cell_m == pytest.approx(0.02 / 40)
        assert flow.viscosity_m2_s <= 1e-5
        assert (
            0.41 * flow.ustar0_m_s * flow.first_cell_m / 2 / flow.viscosity_m2_s > 1.2
        )
    for pile in piles(
        'viscosity = 1e-4\n[axes]\n"method.flow.speed" = [0.5, 1.0, 10.0]\n'
    ):
        assert pile.flow.viscosity_m2_s == 1e-4
        assert pile.flow.first_cell_m > 0.02 / 40


def test_tables_have_the_discharge(tmp_path: Path) -> None:
    asked = study.parse(TEXT + WATER, name="t", where="t")
    planned = plan.make(asked)
    rows = tables.make_tables(asked, planned, tmp_path, ())["pile_threshold"]
    speed = float(depth_mean_speed(1.0, 0.3, 1e-3 / 30)) * rows["ustar0_m_s"]
    np.testing.assert_allclose(rows["mean_velocity_m_s"], speed)
    np.testing.assert_allclose(rows["discharge_m2_s"], 0.3 * speed)
    assert not {"wind_1m_m_s", "current_1m_m_s"} & {*rows}  # of 0.3 m
