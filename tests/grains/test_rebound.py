"""Grains thrown at a bed by LIGGGHTS, as the deck lies, and the rebound laws that came of it."""

import runpy
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics.rebound import BEADS, SIMULATED
from orchestrator.runs.case import templates
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[2]
TOOL = runpy.run_path(str(ROOT / "tools" / "rebound.py"))
SHOTS = pd.read_csv(ROOT / "docs" / "measured" / "rebounds.csv")


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """The flights of the deck's own shots, run by hand."""
    case = tmp_path_factory.mktemp("rebound") / "case"
    shutil.copytree(templates() / "liggghts" / "rebound", case)
    subprocess.run(["./Allrun"], cwd=case, check=True, timeout=HANGS_S)
    return pd.read_csv(case / "flights.csv", comment="#")


def test_a_grain_flies_a_parabola_to_the_bed_and_gains_no_energy(
    flights: pd.DataFrame,
) -> None:
    folder = templates() / "liggghts" / "rebound"
    assert set(flights["shot"]) == {1, 2, 3}
    for number in (1, 2, 3):
        shot = flights[flights["shot"] == number]
        vy, vz = (
            np.loadtxt(folder / f"shot.{name}.txt")[number - 1] for name in ("vy", "vz")
        )
        first = shot.iloc[:3]
        np.testing.assert_allclose(first["vy"], vy, rtol=1e-6)
        np.testing.assert_allclose(first["vz"], vz - 9.81 * first["time"], rtol=1e-4)
        squared = shot["vx"] ** 2 + shot["vy"] ** 2 + shot["vz"] ** 2
        energy = squared / 2 + 9.81 * shot["z"]
        # springs that are pressed hold some of it for a while
        assert energy.max() < energy.iloc[0] * 1.001
        assert energy.iloc[-1] < 0.8 * energy.iloc[0]


@pytest.mark.parametrize("restitution", [0.9, 0.55, 0.25])
def test_the_damping_gives_the_restitution(restitution: float) -> None:
    # a contact that may not pull: m x'' + 2 zeta sqrt(K m) x' + K x = 0 until its force is zero
    zeta = TOOL["damping"](restitution)
    place, speed, step = 0.0, -1.0, 1e-5
    while True:
        force = -place - 2 * zeta * speed
        if place < 0 and force < 0:
            break
        speed += step * force
        place += step * speed
    assert speed == pytest.approx(restitution, abs=2e-3)


def test_the_laws_are_those_of_the_shots() -> None:
    fits = TOOL["law"](SHOTS).set_index("restitution")
    assert sorted(fits.index) == sorted(SIMULATED)
    for restitution, law in SIMULATED.items():
        fit = fits.loc[restitution]
        assert (fit["whole_0"], fit["whole_1"]) == pytest.approx(law.whole, abs=6e-4)
        assert (fit["normal_0"], fit["normal_1"]) == pytest.approx(law.normal, abs=6e-4)
        assert fit["rebounds"] > 200


def test_hard_spheres_rebound_as_the_beads_that_were_shot() -> None:
    # in the mean of the shots; the law of the beads falls faster with the angle
    hard = SHOTS[SHOTS["restitution"] == 0.9].dropna()
    speed = hard["speed"].to_numpy()
    whole, normal = BEADS.after(speed, hard["normal"].to_numpy() / speed)
    assert np.mean((hard["speed_after"] - whole) / speed) == pytest.approx(0, abs=0.03)
    assert np.mean((hard["normal_after"] - normal) / speed) == pytest.approx(
        0, abs=0.04
    )
    # softer ones keep less
    soft = SHOTS[SHOTS["restitution"] == 0.55].dropna()
    kept = [(part["speed_after"] / part["speed"]).mean() for part in (soft, hard)]
    assert kept[0] < kept[1]
