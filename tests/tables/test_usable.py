"""Which thresholds may be used, the reasons against the others, and the scatter over seeds."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import plan, tables
from orchestrator.report.results import Results
from orchestrator.study import study
from orchestrator.tables import piles
from orchestrator.tables.usable import SMOOTH_BELOW, with_scatter, with_usable

NAN = float("nan")
SOUND = {
    "scene_id": "a",
    "alpha_deg": 15.0,
    "d_m": 1e-3,
    "z0_over_d": 1 / 30,
    "nu_m2_s": 1e-5,
    "force_law": "bridged",
    "reynolds": 60.0,
    "shields": 0.05,
    "fraction": 0.3,
    "count": 65,
    "highest_fraction": 0.8,
    "share_carried_off": 0.0,
    "error_estimate": 0.03,
    "u_e_m_s": 10.0,
}
SCENE = {
    "scene_id": "a",
    "rho_f_kg_m3": 1.0,
    "alpha_s": 1.0,
    "h_m": 0.02,
    "relative_size": 1.0,
    "beta_deg": 60.0,
}
UNREACHED = {"reynolds": NAN, "shields": NAN, "share_carried_off": NAN}
PILE = """
grain = {{ diameter = 1e-3, density = 2650.0 }}
protocol = {{ method = "pivot" }}
fluid = {{ {fluid} }}
flow = {{ model = "flat"{flow} }}
bed = {{ kind = "pile", slope_deg = 15.0, height = 0.02, roughness = "d/3" }}
"""
GRAIN = """
grain = {{ diameter = {d}, density = 2650.0 }}
protocol = {{ method = "pivot" }}
fluid = {{ density = 1000.0, viscosity = 1e-6 }}
bed = {{ {bed} }}
forces = {{ {forces} }}
"""
WATER = "density = 1000.0, viscosity = 1e-6"


def judged(tolerance: float | None = None, **changes: Any) -> str:
    """The reasons against a sound threshold with some changes."""
    table, scenes = pd.DataFrame([{**SOUND, **changes}]), pd.DataFrame([SCENE])
    asked: Any = SimpleNamespace(tolerance=tolerance)
    row = with_usable(table, scenes, asked).iloc[0]
    assert row["usable"] == (not row["why_not"])
    return str(row["why_not"])


@pytest.mark.parametrize(
    ("tolerance", "changes", "reason"),
    [
        (None, {}, ""),
        (0.05, {}, ""),
        (None, {"force_law": "low"}, "Re* 60 is not below 3"),
        (None, {"force_law": "high", "reynolds": 20.0}, "Re* 20 is below 30"),
        (None, {"force_law": "high", "reynolds": 400.0}, "Schiller and Naumann"),
        (None, {"reynolds": 29 * SMOOTH_BELOW}, "hydraulically smooth bed: u* z0/nu 0.16"),
        (None, {"count": 3}, "0.3 of 3 grains is less than one"),
        (None, {"row_hold": 2.3}, "hold the first grain up to 2.3 times"),
        (None, {"share_carried_off": 0.76}, "lift carried off 76% of the moved grains"),
        (None, {"error_estimate": NAN}, "no interval"),
        (0.05, {"error_estimate": NAN}, "no interval"),
        (0.02, {}, "known error 3.0% is above the tolerance of 0.02"),
        (None, UNREACHED, "not reached: at most 80% of 65 grains moved"),
    ],
)
def test_each_reason_stands_alone(
    tolerance: float | None, changes: dict[str, Any], reason: str
) -> None:
    why = judged(tolerance, **changes)
    assert reason in why
    assert bool(why) == bool(reason)
    assert ";" not in why


def test_reasons_add_up() -> None:
    assert judged(share_carried_off=0.5, error_estimate=NAN).count(";") == 1


def test_a_single_grain_without_dem_is_judged_by_the_closed_form(results: Results) -> None:
    grains = results.tables["single_grain"].drop(columns=["usable", "why_not"])
    closed = grains.assign(answered_method="pivot", reynolds=NAN)
    found = with_usable(closed, results.scenes, results.study)
    assert found["usable"].any()
    assert not found["why_not"].str.contains("did not move").any()


def why(text: str, path: Path) -> pd.Series:
    """The reasons against the thresholds of a study that needs no run."""
    asked = study.parse(text, name="t", where="t")
    made = tables.make(asked, plan.make(asked), path, ())
    return made["pile_threshold" if "pile" in text else "single_grain"]["why_not"]


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
    found = why(PILE.format(fluid=fluid, flow=flow), tmp_path)
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


def scattered(shields: list[float], chosen: slice = slice(None), **changes: Any) -> pd.DataFrame:
    """Three seeds of one pile, one regular pile of its slope, one of another, two of level rows."""
    names = list("abcdefg")
    slope = [15.0, 15.0, 15.0, 15.0, 30.0, 15.0, 15.0]
    columns = {
        "scene_id": names,
        "alpha_deg": slope,
        "force_law": "high",
        "fraction": 0.5,
        "share_carried_off": changes.pop("share_carried_off", 0.0),
        "shields": shields,
        "shields_low": np.multiply(shields, 0.98),
        "shields_high": np.multiply(shields, 1.02),
    }
    scenes = {
        "scene_id": names,
        "packing": [*["disordered"] * 3, "aligned", "aligned", "horizontal", "horizontal"],
        "seed": [0.0, 1.0, 2.0, NAN, NAN, NAN, 1.0],
        "alpha_deg": slope,
        "stiffness": 1e3,
        **changes,
    }
    found = with_scatter(pd.DataFrame(columns).iloc[chosen], pd.DataFrame(scenes))
    return found.set_index("scene_id")


SHIELDS = [0.95, 1.0, 1.05, 2.0, 3.0, 1.8, 2.2]


def test_half_the_range_over_seeds_widens_the_intervals_of_similar_piles() -> None:
    found = scattered(SHIELDS)
    # the level rows are a lattice and its replica
    expected = [0.05, 0.05, 0.05, 0.05, NAN, 0.1, 0.1]
    assert found["scatter"].tolist() == pytest.approx(expected, nan_ok=True)
    wider = found["scatter"].fillna(0.0)
    assert found["shields_low"].tolist() == pytest.approx(found["shields"] * 0.98 * (1 - wider))
    assert found["shields_high"].tolist() == pytest.approx(found["shields"] * 1.02 * (1 + wider))


def test_what_is_no_scatter() -> None:
    lifted = scattered(SHIELDS, share_carried_off=[1.0] * 3 + [0.0] * 4)
    assert lifted["scatter"].isna()["d"]
    assert scattered(SHIELDS, stiffness=range(7))["scatter"].isna().all()
    assert scattered(SHIELDS, slice(0, 7, 3))["scatter"].isna().all()
    assert with_scatter(pd.DataFrame(), pd.DataFrame()).empty


def test_loose_grains_keep_an_interval_from_zero() -> None:
    found = scattered([0.0, 0.0, 1.0, 0.0, 3.0, 1.8, 2.2])
    assert (found["shields_low"] >= 0).all()
    assert found["shields_high"].tolist()[2] > 1.0


def test_nothing_is_a_multiple_of_a_threshold_of_zero() -> None:
    # the grains of the first of two forms lie loose: they move in still fluid
    rules, grain = SimpleNamespace(fractions=(0.5, 1.0)), SimpleNamespace(diameter=1.0)
    scene = SimpleNamespace(protocol=rules, grain=grain)
    x = np.array([[0.2, 0.0], [0.5, 0.0], [1.2, 0.0], [1.5, 0.0]])
    packing = SimpleNamespace(centres=x, windward=np.ones(4, bool))
    bed, model = SimpleNamespace(forms=2, profile=None, spacing=1.0), SimpleNamespace(line=None)
    answer: Any = SimpleNamespace(
        scene_id="a",
        pile=SimpleNamespace(scene=scene, bed=bed, model=model, packing=packing),
        speed=np.ones(4),
        motion=SimpleNamespace(
            level=np.array([1, 1, 2, 0]), low=np.array([0.0, 0.0, 0.1]), flow=np.array([0, 0, 0.4])
        ),
    )
    rows = pd.DataFrame(piles.forms(answer))
    assert rows["ustar0_m_s"].tolist() == pytest.approx([0.0, 0.2, 0.0, NAN], nan_ok=True)
    assert rows["over_first_form"].isna().all()
