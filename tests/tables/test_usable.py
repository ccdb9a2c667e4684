"""Which thresholds may be used, the reasons against the others, and the scatter over seeds."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import plan, tables
from orchestrator.physics import beside
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.study import study
from orchestrator.tables.usable import POURED, with_scatter, with_usable
from tests import small_study

NAN = float("nan")
SOUND = {
    **{
        "scene_id": "a",
        "alpha_deg": 15.0,
        "d_m": 1e-3,
        "z0_over_d": 1 / 30,
        "nu_m2_s": 1e-5,
    },
    **{
        "force_law": "bridged",
        "reynolds": 60.0,
        "shields": 0.05,
        "fraction": 0.3,
        "count": 65,
    },
    **{
        "highest_fraction": 0.8,
        "share_carried_off": 0.0,
        "numerical_error": 0.03,
        "u_e_m_s": 10.0,
    },
    **{
        "shields_numerical_low": 0.048,
        "shields_numerical_high": 0.052,
        "ustar0_m_s": 0.6,
    },
}
SCENE = {
    **{"scene_id": "a", "rho_f_kg_m3": 1.0, "alpha_s": 1.0, "h_m": 0.02},
    **{"cohesion_n_m": 0.0, "bed_shape": "triangle", "profile": NAN},
    **{
        "flow_top": "boundary layer",
        "depth_m": None,
        "relative_size": 1.0,
        "beta_deg": 60.0,
    },
    **{"rho_sol_kg_m3": 2500.0, "g_m_s2": 9.81, "z0_m": 3e-5, "method": "dem"},
}
STOPPED = {"final_fraction": 0.8}
UNREACHED = {"reynolds": NAN, "shields": NAN, "share_carried_off": NAN}


@pytest.mark.parametrize(
    ("tolerance", "changes", "reasons"),
    [
        (None, {}, []),
        (0.05, {}, []),
        (None, {"force_law": "low"}, ["Re* 60 is not below 3"]),
        (None, {"force_law": "high", "reynolds": 20.0}, ["Re* 20 is below 30"]),
        (None, {"force_law": "high", "reynolds": 400.0}, ["Schiller and Naumann"]),
        (None, {"packing": "poured"}, ["equal spheres in one plane"]),
        (None, {"sheltering": "balanced"}, ["kept balance: beyond n/N = 0.1"]),
        (None, {"reynolds": 1.0}, []),  # a hydraulically smooth bed
        (None, {"count": 3}, ["0.3 of 3 grains is less than one"]),
        (None, {"interlocking": 2.3}, ["hold the first grain up to 2.3 times"]),
        (None, {"interlocking": 2.3, "method": "local"}, []),
        (
            None,
            {"share_carried_off": 0.76},
            ["76 % of the entrained grains were lifted off"],
        ),
        (None, {"numerical_error": NAN}, ["was not measured"]),
        (0.02, {}, ["numerical error 3.0 % is above the tolerance of 2 %"]),
        (None, UNREACHED, ["not reached: at most 80 % of 65 grains moved"]),
        (
            None,
            {**UNREACHED, **STOPPED},
            ["moved, since the run ends at method.grains.final_fraction"],
        ),
        (
            None,
            {"shields_numerical_high": NAN},
            ["interval open above: at most 80 % of 65 grains moved"],
        ),
        (
            None,
            {"shields_numerical_high": NAN, **STOPPED},
            ["run ends at method.grains.final_fraction = 0.8"],
        ),
        (
            None,
            {"shields_numerical_high": NAN, "numerical_error": 3.75},
            ["above: the numerical error is 375 %"],
        ),
        (
            None,
            {"shields_numerical_high": NAN, "scatter": 1.2},
            ["above: the scatter over seeds is 120 %"],
        ),
    ],
)
def test_reasons_against_a_sound_threshold_with_some_changes(
    tolerance: float | None, changes: dict[str, Any], reasons: list[str]
) -> None:
    table = pd.DataFrame([{**SOUND, **changes}])
    row = with_usable(table, pd.DataFrame([SCENE]), tolerance).table.iloc[0]
    parts = row["why_not"].split("; ") if row["why_not"] else []
    assert len(parts) == len(reasons)
    assert all(reason in part for reason, part in zip(reasons, parts, strict=True))
    assert row["usable"] == (not reasons)


PILE = 'bed = { kind = "pile", slope_deg = 15.0, height = 0.02, roughness = "d/3" }\n'
WATER = "fluid = { density = 1000.0, viscosity = 1e-6 }\n"
FLAT = 'method.flow.model = "flat"'
CHANNEL = f'{FLAT}\nflow = {{ top = "open water", depth = 0.1 }}'
STEEP = 'roughness = "d/30", slope_deg = 20.0'


def pile(viscosity: float, flow: str) -> str:
    fluid = f"fluid = {{ density = 1000.0, viscosity = {viscosity} }}\n"
    return f"{PILE}{flow}\n{fluid}grain.diameter = 1e-3\n"


def grain(bed: str, forces: str = "") -> str:
    return f"{WATER}bed = {{ {bed} }}\nforces = {{ {forces} }}\ngrain.diameter = 2e-4\n"


def of_paper(text: str) -> str:
    """The same by the criterion of the paper, that a grain leaves."""
    return text.replace("fluid = {", 'fluid = { kind = "paper",')


@pytest.mark.parametrize(
    ("text", "reason", "applies"),
    [
        (pile(6e-4, FLAT), "laminar flow", True),
        (pile(1e-6, FLAT), "laminar flow", False),
        (pile(2e-4, CHANNEL), "laminar flow", True),
        (pile(1e-6, CHANNEL), "laminar flow", False),
        (grain('roughness = "d/30", relative_size = 0.1'), "hidden grain", True),
        (of_paper(grain('roughness = "d/30", relative_size = 0.5')), "", False),
        # of grains in sustained motion, none were measured among larger ones
        (grain('roughness = "d/30", relative_size = 0.5'), "interval was tested", True),
        (grain('roughness = "d/30", relative_size = 0.5'), "hidden grain", False),
        (grain(STEEP, "lift_coefficient = 30.0"), "lift over", True),
        (grain(STEEP), "", False),
        (grain("roughness = 1e-12").replace("2e-4", "1e-3"), "smooth wall", True),
    ],
)
def test_thresholds_beyond_the_model(
    tmp_path: Path, text: str, reason: str, applies: bool
) -> None:
    text += 'grain.density = 2650.0\nmethod.kind = "pivot"\n'
    asked = study.parse(text, name="t", where="t")
    made = tables.make_tables(asked, plan.make(asked), tmp_path, ())
    why_not = made["pile_threshold" if text.startswith(PILE) else "single_grain"][
        "why_not"
    ]
    has_reason = why_not.str.contains(reason) if reason else why_not != ""
    assert has_reason.eq(applies).all()


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_a_channel_is_laminar_by_its_flow_where_it_has_no_mean_velocity(
    closed: bool, factor: float
) -> None:
    """However much larger the stress on the grains that have moved is than that of the flow."""
    nu, depth, z0 = 1e-5, 0.04, 3e-5
    ustar0 = np.geomspace(0.005, 0.1, 40)
    channel = {
        "flow_top": "closed channel" if closed else "open water",
        "depth_m": depth,
    }
    rows = [
        {
            **SOUND,
            "scene_id": str(n),
            "nu_m2_s": nu,
            "ustar0_m_s": u,
            "reynolds": factor * u * 100,
        }
        for n, u in enumerate(ustar0)
    ]
    scenes = [
        {**SCENE, **channel, "scene_id": str(n), "z0_m": z0} for n in range(len(rows))
    ]
    made = with_usable(pd.DataFrame(rows), pd.DataFrame(scenes), None).table
    speeds = measurable_speeds(
        ustar0,
        roughness=1e-3 / 30,
        viscosity=nu,
        fluid_density=1.0,
        depth=depth,
        closed=closed,
    )
    has_no_mean = np.isnan(speeds["mean_velocity_m_s"])
    assert 0 < has_no_mean.sum() < len(rows)
    assert made["why_not"].str.contains("laminar flow").tolist() == has_no_mean.tolist()


def scattered(
    shields: list[float], chosen: slice = slice(None), **changes: Any
) -> pd.DataFrame:
    """Three seeds of one pile, one regular pile of its slope, one of another, two of level rows."""
    names, slope = list("abcdefg"), [15.0, 15.0, 15.0, 15.0, 30.0, 15.0, 15.0]
    of_poured = {name: [None] * len(names) for name in POURED}
    columns = {
        **{"scene_id": names, "alpha_deg": slope, "force_law": "high", "fraction": 0.5},
        "share_carried_off": changes.pop("share_carried_off", 0.0),
        "shields": shields,
        "shields_numerical_low": np.multiply(shields, 0.98),
        "shields_numerical_high": np.multiply(shields, 1.02),
    }
    scenes = {
        **{"scene_id": names, "alpha_deg": slope, "stiffness": 1e3, **of_poured},
        "packing": [
            *["disordered"] * 3,
            "aligned",
            "aligned",
            "horizontal",
            "horizontal",
        ],
        "seed": [0.0, 1.0, 2.0, NAN, NAN, NAN, 1.0],
        "asked": "auto",
        **changes,
    }
    table = with_scatter(pd.DataFrame(columns).iloc[chosen], pd.DataFrame(scenes))
    return table.set_index("scene_id")


SHIELDS = [0.95, 1.0, 1.05, 2.0, 3.0, 1.8, 2.2]


def test_half_the_range_over_seeds_widens_the_intervals_of_similar_piles() -> None:
    table = scattered(SHIELDS)
    # the level rows are a lattice and its replica
    expected = [0.05, 0.05, 0.05, 0.05, NAN, 0.1, 0.1]
    assert table["scatter"].tolist() == pytest.approx(expected, nan_ok=True)
    wider = table["scatter"].fillna(0.0)
    assert table["shields_numerical_low"].tolist() == pytest.approx(
        table["shields"] * 0.98 / (1 + wider)
    )
    assert table["shields_numerical_high"].tolist() == pytest.approx(
        table["shields"] * 1.02 / (1 - wider)
    )
    # lift that carries grains off, another parameter that differs, a seed alone: no scatter
    lifted = scattered(SHIELDS, share_carried_off=[1.0] * 3 + [0.0] * 4)
    assert lifted["scatter"].isna()["d"]
    assert scattered(SHIELDS, stiffness=range(7))["scatter"].isna().all()
    assert scattered(SHIELDS, slice(0, 7, 3))["scatter"].isna().all()
    # the interval of a grain that lies loose begins at zero; seeds further apart than their mean
    # leave it open above
    loose = scattered([0.0, 0.0, 1.0, 0.0, 3.0, 1.8, 2.2])
    assert (loose["shields_numerical_low"] >= 0).all()
    assert loose["scatter"].tolist()[2] == pytest.approx(1.5)
    assert np.isnan(loose["shields_numerical_high"].tolist()[2])


def test_the_scatter_of_poured_beds_is_of_beds_that_are_poured_alike() -> None:
    names = list("abcdefg")
    columns = {
        "scene_id": names,
        "alpha_deg": 15.0,
        "force_law": "high",
        "fraction": 0.5,
    }
    ends = {"shields_numerical_low": 0.98, "shields_numerical_high": 1.02}
    shields = [0.9, 1.1, 0.5, 1.5, 1.0, 1.0, 1.0]
    thresholds = pd.DataFrame(
        {**columns, **ends, "share_carried_off": 0.0, "shields": shields}
    )
    # strips and beds in one plane with two seeds each; another mixture, a lattice, level rows
    scenes = pd.DataFrame(
        {
            "scene_id": names,
            "packing": [*["poured"] * 5, "aligned", "horizontal"],
            "width": [6.0, 6.0, 0.0, 0.0, 0.0, None, None],
            "sizes": [*["log-normal, sigma_g 1.3"] * 4, "10 mm 100 %", None, None],
            "poured_depth": [*[5.0] * 5, None, None],
            "seed": [0.0, 1.0, 0.0, 1.0, 0.0, NAN, NAN],
            "asked": "auto",
        }
    )
    expected = [0.1, 0.1, 0.5, 0.5, NAN, NAN, NAN]
    scatter = with_scatter(thresholds, scenes)["scatter"]
    assert scatter.tolist() == pytest.approx(expected, nan_ok=True)
    # equal spheres have no sizes
    equal = scenes.assign(sizes=scenes["sizes"].mask(scenes.index < 4))
    scatter = with_scatter(thresholds, equal)["scatter"]
    assert scatter.tolist() == pytest.approx(expected, nan_ok=True)


SEEDS = """
grain = {{ diameter = 1e-3 }}
bed = {{ kind = "pile", slope_deg = 15.0, height = 0.02, packing = "{}" }}
threshold.fractions = [0.1, 0.5]
axes = {{ "bed.seed" = {} }}
"""


@pytest.mark.parametrize(
    ("packing", "seeds"), [("disordered", [1, 2, 3]), ("horizontal", [0, 1, 2])]
)
def test_the_intervals_of_a_study_with_seeds_hold_their_scatter(
    tmp_path: Path, packing: str, seeds: list[int]
) -> None:
    """Columns of a lattice are empty where only poured beds have values."""
    results = small_study.run(tmp_path, SEEDS.format(packing, seeds))
    table = results.tables["pile_threshold"]
    assert results.scenes[["sizes", "poured_depth"]].isna().all(axis=None)
    alone = small_study.run(tmp_path, SEEDS.format(packing, seeds[:1]))
    without = alone.tables["pile_threshold"].set_index("fraction")
    assert without["scatter"].isna().all()
    for fraction, rows in table.groupby("fraction"):
        values = rows["shields"]
        half_range = (values.max() - values.min()) / 2 / values.mean()
        assert half_range > 0
        assert rows["scatter"].tolist() == pytest.approx([half_range] * 3)
        first, before = rows.iloc[0], without.loc[fraction]
        wider = [before["shields_numerical_low"] / (1 + half_range)]
        wider += [before["shields_numerical_high"] / (1 - half_range)]
        assert first[
            ["shields_numerical_low", "shields_numerical_high"]
        ].tolist() == pytest.approx(wider)


RIPPLE = """
fluid.kind = "air"
grain = { diameter = 5e-4, density = 2650.0 }
bed = { kind = "pile", slope_deg = 12.0, height = 0.01, roughness = "d/30" }
method = { kind = "peeling", flow = { model = "flat" } }
"""


@pytest.mark.parametrize(
    ("text", "is_tested"),
    [
        (RIPPLE, True),
        (f'{RIPPLE}threshold.criterion = "entrained"', False),
        # grains that touch one another along a level row hold one another
        (RIPPLE.replace('"pile", slope_deg = 12.0, height', '"flat", length'), False),
    ],
)
def test_grains_of_a_pile_that_go_on_have_the_interval_of_one_grain(
    tmp_path: Path, text: str, is_tested: bool
) -> None:
    results = small_study.run(tmp_path, text)
    rows = results.tables["pile_threshold"]
    if not is_tested:
        assert not rows["tested_rows"].any()
        return
    grain = {
        **{"d_m": 5e-4, "z0_m": 5e-4 / 30, "rho_f_kg_m3": 1.225, "nu_m2_s": 1.46e-5},
        **{
            "rho_sol_kg_m3": 2650.0,
            "alpha_s": 1.615,
            "cohesion_n_m": 0.0,
            "g_m_s2": 9.81,
        },
        **{"alpha_deg": 12.0, "beta_deg": 60.0, "reynolds": 9.0},
        **{"force_law": "bridged", "criterion": "sustained"},
    }
    alone = beside.tested({name: [value] for name, value in grain.items()})[:, 0]
    # three sites in the field and five points of a formula
    assert alone[2] == 8
    # slope laws of friction angles of 32 and 50 degrees
    most, least = (
        np.cos(np.radians(12.0)) + np.sin(np.radians(12.0)) / np.tan(np.radians(phi))
        for phi in (32.0, 50.0)
    )
    width = most / least
    assert (rows["interlocking"] < 1.05).all()
    low = (rows["tested_low"] / rows["shields"]).to_numpy()
    high = (rows["tested_high"] / rows["shields"]).to_numpy()
    assert low == pytest.approx(alone[0] / width)
    assert high == pytest.approx(alone[1] * width)
