"""The report card: verdicts follow from the numbers, by the rules that it states."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.paper import PRESETS, claims
from orchestrator.paper.claims import base, counting
from orchestrator.paper.claims.base import Claim, Evidence, Verdict, in_regime
from orchestrator.physics import curves
from orchestrator.report.results import Results
from orchestrator.study import fields, study
from orchestrator.study.closed_form import closed_form, law_holds
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.tables import Tables


def by_name(found: list[Claim]) -> dict[str, Claim]:
    names = [f"{one.__module__.rpartition('.')[2]}.{one.__name__}" for one in claims.JUDGES]
    return dict(zip(names, found, strict=True))


def changed(
    tables: Tables, name: str, change: Callable[[pd.DataFrame], pd.DataFrame]
) -> dict[str, Claim]:
    return by_name(claims.judge({**tables, name: change(tables[name])}))


@pytest.fixture(scope="module")
def judged(results: Results) -> dict[str, Claim]:
    return by_name(claims.judge(results.tables))


@pytest.mark.parametrize(
    ("answers", "verdict"),
    [
        ([True] * 19 + [False], "reproduced"),
        ([True] * 18 + [False] * 2, "partly"),
        ([False] * 19 + [True], "not"),
        ([], "no data"),
    ],
)
def test_verdict_by_share(answers: list[bool], verdict: Verdict) -> None:
    assert base.by_share(answers) == verdict


def test_verdicts_that_differ_are_partly() -> None:
    assert base.combined(["reproduced", "not"]) == "partly"
    assert base.combined(["not", "no data"]) == "not"
    assert base.combined([]) == "no data"


def test_pairs_agree_in_all_else() -> None:
    table = pd.DataFrame(
        {
            "force_law": "high",
            "alpha_deg": [20.0, 15.0, 25.0, 15.0],
            "d_m": [1e-3, 1e-3, 1e-3, 5e-4],
            "seed": [None] * 4,
            "value": [3.0, 2.0, np.nan, 9.0],
        }
    )
    found = base.pairs(table, "alpha_deg", "value")
    assert found["ratio"].tolist()[0] == 1.5
    assert len(found) == 2
    assert "1 pairs without a threshold" in base.rising(found, "")
    assert base.up(found) == "reproduced"


@pytest.mark.parametrize(
    "column",
    [
        *(
            "flow_model",
            "turbulence_model",
            "convection_scheme",
            "loaded_grains",
            "averaging_length",
            "expansion_ratio",
            "method",
        ),
        *(
            "first_cell_m",
            "time_step",
            "final_fraction",
            "answered_method",
            "answered_expansion_ratio",
            "flow_level",
        ),
    ],
)
def test_rows_that_differ_in_anything_else_are_no_pair(column: str) -> None:
    table = pd.DataFrame({"force_law": "high", "alpha_deg": [15.0, 20.0], "value": [1.0, 2.0]})
    assert len(base.pairs(table.assign(**{column: "same"}), "alpha_deg", "value")) == 1
    assert base.pairs(table.assign(**{column: ["one", "other"]}), "alpha_deg", "value").empty


def test_what_a_small_study_shows(judged: dict[str, Claim]) -> None:
    verdicts = {name: claim.verdict for name, claim in judged.items()}
    assert verdicts["single.constant"] == "partly"
    assert verdicts["single.compacity"] == "reproduced"
    assert verdicts["single.roughness"] == "partly"
    assert verdicts["single.slope"] == "reproduced"
    assert verdicts["single.numerical"] == "not"
    assert verdicts["motion.order"] == "reproduced"
    assert verdicts["piles.above_single"] == "reproduced"
    for lacking in ("piles.slope", "piles.saturation", "model.regimes", "model.stress"):
        assert verdicts[lacking] == "no data"


def test_constant_states_the_closed_form(judged: dict[str, Claim]) -> None:
    # lift over drag at Re* = 3 is alpha_s/pi, over tan(beta)
    steepest = 1 / (1 + 1.615 / np.pi) - 1
    assert f"{steepest:+.0%} (β = 45°)" in judged["single.constant"].measured[0]


def test_verdicts_turn_with_the_numbers(results: Results, judged: dict[str, Claim]) -> None:
    upside_down = changed(
        results.tables, "single_grain", lambda t: t.assign(shields_dem=1 / t["shields_dem"])
    )
    assert upside_down["single.compacity"].verdict == "not"
    assert upside_down["single.slope"].verdict == "not"
    later = changed(
        results.tables,
        "pile_grain",
        lambda t: t.assign(
            moved_in_load_step=t["moved_in_load_step"].max() + 1 - t["moved_in_load_step"]
        ),
    )
    assert later["motion.order"].verdict == "not"
    low = changed(results.tables, "pile_threshold", lambda t: t.assign(shields=1e-9))
    assert low["piles.above_single"].verdict == "not"
    assert judged["piles.above_single"].verdict == "reproduced"


@pytest.mark.parametrize(("moved", "verdict"), [(0.04, "reproduced"), (0.2, "not")])
def test_coupling_is_judged_by_what_the_frozen_bed_moves(
    results: Results, moved: float, verdict: Verdict
) -> None:
    found = changed(results.tables, "pile_threshold", lambda t: t.assign(frozen_bed=moved))
    assert found["model.coupling"].verdict == verdict
    assert f"moved by up to {moved:.0%}" in found["model.coupling"].measured[0]


@pytest.fixture(scope="module")
def exact() -> Tables:
    """Single grains of the preset of the paper, as if DEM gave the closed form."""
    asked, grains = [], []
    for scene in study.load("paper", [PRESETS]).scenes:
        if scene.bed.kind == "grain":
            asked.append({"scene_id": scene.id, **_parameters(scene)})
            grains.append({"scene_id": scene.id, **_closed_form(scene)})
    return {"scenes": pd.DataFrame(asked), "single_grain": pd.DataFrame(grains)}


def _parameters(scene: Scene) -> dict[str, object]:
    return {**fields.asked(scene), **fields.answered(scene), "law_holds": law_holds(scene)}


def _closed_form(scene: Scene) -> dict[str, float]:
    found = closed_form(scene)
    shields, ustar = float(found.shields), float(found.friction_velocity)
    row = dict.fromkeys(("shields_dem", "shields_dem_low", "shields_closed_form"), shields)
    speeds = dict.fromkeys(("ustar_m_s", "ustar_closed_form_m_s"), ustar)
    return {**row, **speeds, "reynolds": float(found.reynolds)}


def test_the_closed_form_itself_is_judged_so(exact: Tables) -> None:
    found = by_name(claims.judge(exact))
    assert found["single.numerical"].verdict == "not"
    assert "0 of" in found["single.numerical"].measured[0]
    assert found["model.conditioning"].verdict == "not"
    assert found["curves.best_fit"].verdict == "partly"
    assert "best β = 45°, d/30: off by 1.6" in found["curves.best_fit"].measured[1]
    assert "best β = 50°, d/30: off by 1.1" in found["curves.best_fit"].measured[2]
    assert "water, bridged, Re* = 0.018 … 306" in found["curves.best_fit"].measured[3]


def test_every_pile_in_air_has_an_answer_of_a_law_that_holds() -> None:
    answers: dict[tuple[float, ...], set[str]] = {}
    for scene in study.load("paper", [PRESETS]).scenes:
        if isinstance(scene.bed, PileBed) and scene.fluid.viscosity == 1e-5:
            key = (scene.bed.slope_deg, scene.grain.diameter, scene.bed.roughness)
            laws = {scene.forces.law} if law_holds(scene) else set()
            answers[key] = answers.get(key, set()) | laws
    assert len(answers) == 56
    assert all(base.BRIDGED in laws for laws in answers.values())
    assert sum(laws == {base.BRIDGED} for laws in answers.values()) == 34


def test_grains_on_the_curves_fit_them(exact: Tables) -> None:
    scene = exact["scenes"].set_index("scene_id")
    grains = exact["single_grain"].copy()
    own = scene.loc[grains["scene_id"]]
    wide = grains["reynolds"].to_numpy() > 0.01
    named = ((own["beta_deg"] == 50) & (own["z0_over_d"] < 0.05)).to_numpy() & wide
    known = [curve.points(2000) for curve in curves.WATER]
    at = np.log(grains.loc[named, "reynolds"])
    logs = [np.interp(at, np.log(x), np.log(y), left=np.nan, right=np.nan) for x, y in known]
    grains.loc[named, "shields_dem"] = np.exp(np.nanmean(logs, axis=0))
    found = by_name(claims.judge({**exact, "single_grain": grains}))["curves.best_fit"]
    assert found.verdict == "reproduced"
    assert "best β = 50°, d/30: off by 1.0" in found.measured[1]


def test_soft_contacts_that_matter_are_found(exact: Tables) -> None:
    soft = exact["scenes"].set_index("scene_id")["stiffness"] < 1e4
    grains = exact["single_grain"]
    factor = np.where(soft.loc[grains["scene_id"]], 1.2, 1.0)
    spoiled = grains.assign(ustar_m_s=grains["ustar_m_s"] * factor)
    found = by_name(claims.judge({**exact, "single_grain": spoiled}))["model.conditioning"]
    assert found.verdict == "partly"


def test_wiggles_are_steps_of_the_stress_or_of_the_count() -> None:
    smooth = np.linspace(0.2, 1.0, 40) ** 2
    assert counting._wiggle(smooth) < 1e-3
    assert counting._wiggle(smooth + 0.01 * (-1) ** np.arange(40)) > 5e-3
    stress = np.linspace(0.5, 1.5, 801)
    flow = np.geomspace(0.6, 2.0, 40)
    own = pd.DataFrame({"ustar0_m_s": flow, "fraction_moved": np.linspace(0, 1, 40)})
    steps = np.repeat(stress[::40], 40)[:801]
    assert len(counting._smoothed(steps)) == len(steps)
    rough, even = (
        counting._wiggle(counting._pivot(own, one)) for one in (steps, counting._smoothed(steps))
    )
    assert even < 0.5 * rough


def test_transition_is_not_judged(results: Results, judged: dict[str, Claim]) -> None:
    def spoiled(table: pd.DataFrame) -> pd.DataFrame:
        return table.assign(shields_dem=table["shields_dem"].where(in_regime(table), 1e9))

    assert (~in_regime(results.tables["single_grain"])).any()
    assert changed(results.tables, "single_grain", spoiled) == judged


def test_a_faster_rise_counts_as_a_ramp(results: Results) -> None:
    asked = results.tables["scenes"]
    fast = asked.assign(waiting_time=np.where(asked["alpha_deg"] > 0, 1.0, asked["waiting_time"]))
    ramps = asked.loc[asked["alpha_deg"] > 0, "scene_id"]
    grains = results.tables["single_grain"]
    factor = np.where(grains["scene_id"].isin(ramps), 1.3, 1.0)
    raised = {c: grains[c] * factor for c in ("shields_dem", "shields_dem_low")}
    tables = {**results.tables, "scenes": fast, "single_grain": grains.assign(**raised)}
    found = by_name(claims.judge(tables))["single.numerical"]
    assert found.verdict == "partly"
    assert "+3" in found.measured[-1]


def test_other_fluids_are_not_judged(results: Results) -> None:
    water = results.tables["scenes"].assign(rho_f_kg_m3=1000.0)
    found = claims.judge({**results.tables, "scenes": water})
    assert {claim.verdict for claim in found} == {"no data"}
    assert claims.card(found, [])["entries"] == []


def test_nothing_measured_is_no_data(results: Results) -> None:
    found = claims.judge({"scenes": results.tables["scenes"]})
    assert {claim.verdict for claim in found} == {"no data"}
    assert len(claims.card(found, [])["lacking"]) == len(claims.JUDGES)


def test_grains_that_never_moved_are_counted(results: Results) -> None:
    silent = results.tables["single_grain"].assign(shields_dem=np.nan, shields_dem_low=np.nan)
    found = by_name(claims.judge({**results.tables, "single_grain": silent}))
    assert found["single.compacity"].verdict == "no data"
    held = Evidence({**results.tables, "single_grain": silent}).held
    assert f"{len(held)} grains never moved" in found["single.numerical"].measured[0]


def test_card_names_the_figures_by_number(judged: dict[str, Claim]) -> None:
    card = claims.card(list(judged.values()), ["flow", "dem-horizontal", "bed-alpha15"])
    shown = {entry["claim"].says: entry["figures"] for entry in card["entries"]}
    assert shown[judged["single.compacity"].says] == [2]
    assert shown[judged["motion.order"].says] == [3]


def test_section_has_the_card(results: Results) -> None:
    judged = claims.judge(results.tables)
    section = claims.section(judged, ["dem-horizontal"])
    assert section == claims.section(judged, ["dem-horizontal"])
    assert 'class="verdict reproduced">reproduced<' in section
    assert 'class="verdict not">not reproduced<' in section
    assert "Re* &lt; 3" in section
    assert "no data to judge" in section
    assert "Figure 1" in section


def test_what_is_measured_is_escaped(results: Results) -> None:
    evil = replace(claims.judge(results.tables)[1], measured=("<b>&",), says="<i>", why="<u>")
    section = claims.section([evil], [])
    assert "&lt;b&gt;&amp;" in section
    assert not [tag for tag in ("<b>", "<i>", "<u>") if tag in section]


def test_no_card_where_nothing_could_be_judged() -> None:
    assert claims.section([], []).strip() == ""


def test_frame_has_a_row_for_each_claim(results: Results, tmp_path: Path) -> None:
    table = claims.frame(claims.judge(results.tables))
    table.to_csv(tmp_path / "claims.csv", index=False)
    again = pd.read_csv(tmp_path / "claims.csv")
    assert len(again) == len(claims.JUDGES)
    assert set(again["verdict"]) <= {"reproduced", "partly", "not", "no data"}
