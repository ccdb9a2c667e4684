"""The report card: verdicts follow from the numbers, by the rule that it states."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import paper, report
from orchestrator.paper import PRESETS, claims
from orchestrator.paper.claims import CLAIMS, JudgedClaim
from orchestrator.paper.evidence import (
    BRIDGED,
    Comparison,
    Evidence,
    Verdict,
    combined,
    pairs,
)
from orchestrator.paper.findings import Finding
from orchestrator.physics import curves
from orchestrator.report.results import Results
from orchestrator.runs.files import Folder
from orchestrator.study import fields, study
from orchestrator.study.closed_form import closed_form, law_holds
from orchestrator.tables import Tables
from orchestrator.tables.usable import ABOVE_TOLERANCE
from tests.report.conftest import copies

NAMES = [
    " ".join((claim.measure.keywords["table"], claim.measure.keywords["along"]))
    if isinstance(claim.measure, partial)
    else claim.measure.__name__
    for claim in CLAIMS
]


def judge(tables: Tables, **changed: pd.DataFrame) -> dict[str, JudgedClaim]:
    """The verdicts by the name of the measure, some tables of the study being replaced."""
    return dict(zip(NAMES, claims.judge_claims({**tables, **changed}), strict=True))


@pytest.fixture(scope="module")
def exact() -> Tables:
    """Single grains of the preset of the paper, as if DEM gave the closed form."""
    asked, methods, grains = [], [], []
    for scene in study.load("paper").scenes:
        if scene.bed.kind == "grain":
            own = {"scene_id": scene.id, "law_holds": law_holds(scene)}
            asked.append({**own, **fields.question(scene)})
            methods.append({"scene_id": scene.id, **fields.method(scene)})
            found = closed_form(scene)
            shields, ustar = float(found.shields), float(found.friction_velocity)
            row = dict.fromkeys(
                ("shields_dem", "shields_dem_low", "shields_closed_form"), shields
            )
            row |= dict.fromkeys(("ustar_m_s", "ustar_closed_form_m_s"), ustar)
            grains.append(
                {"scene_id": scene.id, **row, "reynolds": float(found.reynolds)}
            )
    return {
        "scenes": pd.DataFrame(asked),
        "methods": pd.DataFrame(methods),
        "single_grain": pd.DataFrame(grains),
    }


def line(true: int, of: int, flow: str = "") -> Comparison:
    """A line of comparisons, some of which are true."""
    return Comparison("", np.where(np.arange(of) < true, 2.0, 0.5), 1.0, flow=flow)


@pytest.mark.parametrize(
    ("true", "of", "verdict"),
    [
        (19, 20, "reproduced"),
        (18, 20, "mostly"),
        (11, 20, "mostly"),
        (10, 20, "half"),
        (9, 20, "mostly not"),
        (2, 20, "mostly not"),
        (1, 20, "not"),
        (0, 0, "no data"),
    ],
)
def test_a_verdict_follows_from_the_share(true: int, of: int, verdict: Verdict) -> None:
    one = line(true, of)
    numbers = one.numbers
    assert one.counts == (true, of)
    assert one.verdict == verdict
    assert Comparison("", -numbers, below=-1.0).verdict == verdict
    assert Comparison("", numbers > 1).verdict == verdict
    assert Comparison("", [*numbers, np.nan], 1.0).verdict == verdict
    assert combined([one, one]) == verdict
    assert combined([one, line(0, 0)]) == combined([]) == "no data"


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        # the two claims that "in part" did not tell apart
        ([(0, 475), (12, 12)], "mostly not"),
        ([(78, 78), (4, 16), (20, 20)], "mostly"),
        ([(8, 8), (0, 8)], "half"),
        # many true ones do not carry a line that fails
        ([(1000, 1000), (5, 6)], "mostly"),
        ([(0, 1000), (1, 6)], "mostly not"),
        ([(19, 20), (1000, 1000)], "reproduced"),
        ([(1, 20), (0, 1000)], "not"),
    ],
)
def test_a_claim_that_holds_in_part_says_on_which_side_it_is(
    lines: list[tuple[int, int]], verdict: Verdict
) -> None:
    assert combined(line(*counts) for counts in lines) == verdict


def test_a_claim_is_judged_by_each_flow_and_by_both() -> None:
    lines = (
        line(4, 4, flow="eq10"),
        line(1, 3, flow="wall"),
        line(2, 2, flow="wall"),
        Comparison("", [7.0], flow="wall"),
    )
    one = JudgedClaim(CLAIMS[0], lines)
    assert one.findings == (
        Finding("", "mostly", 7, 9),
        Finding("eq10", "reproduced", 4, 4),
        Finding("wall", "mostly", 3, 5),
    )
    assert [str(each) for each in one.findings] == [
        "mostly, 7 of 9", "reproduced, 4 of 4", "mostly, 3 of 5",
    ]  # fmt: skip
    (row,) = claims.frame([one]).to_dict("records")
    assert (row["verdict"], row["true"], row["of"]) == ("mostly", 7, 9)
    assert (row["verdict_eq10"], row["true_eq10"], row["of_eq10"]) == (
        "reproduced", 4, 4,
    )  # fmt: skip
    assert (row["verdict_wall"], row["true_wall"], row["of_wall"]) == ("mostly", 3, 5)
    verdict = claims.claims_sheet([one], "").frame["verdict"].item()
    assert verdict == (
        "mostly: by Eq. 10 reproduced, 4 of 4; by wall stress mostly, 3 of 5"
    )


def test_pairs_agree_in_all_else() -> None:
    columns = {"alpha_deg": [20.0, 15.0, 25.0, 15.0], "d_m": [1e-3, 1e-3, 1e-3, 5e-4]}
    table = pd.DataFrame({**columns, "value": [3.0, 2.0, np.nan, 9.0]})
    table = table.assign(force_law="high", seed=None)
    ratio = pairs(table, "alpha_deg", "value")["ratio"]
    assert ratio[0] == 1.5
    assert len(ratio) == 2
    for column in (
        *fields.others(fields.COLUMNS, "alpha_deg"),
        "fidelity",
    ):
        if column not in ("force_law", "d_m", "seed"):
            differing = table.assign(**{column: ["a", "b", "c", "d"]})
            assert pairs(differing, "alpha_deg", "value").empty, column


def test_a_small_study_is_judged(results: Results) -> None:
    judged = judge(results.tables)
    verdicts = {
        name: one.verdict for name, one in judged.items() if one.verdict != "no data"
    }
    assert verdicts == {
        "constant": "half",
        "held beta_deg": "reproduced",
        "held z0_over_d": "mostly not",
        "held alpha_deg": "reproduced",
        "order": "reproduced",
        "coupling": "mostly not",
    }


def test_a_reason_explains_its_verdict_or_is_none(
    results: Results, exact: Tables
) -> None:
    asked = {name: results.tables[name] for name in ("scenes", "methods")}
    for tables in (results.tables, exact, asked):
        for one in claims.judge_claims(tables):
            found = one.claim.found[0].verdict
            assert (one.why == one.claim.why) == (one.verdict == found)


def test_ramps_alone_reproduce_nothing(results: Results) -> None:
    scenes, grains = results.tables["scenes"], results.tables["single_grain"]
    methods = results.tables["methods"]
    raised = grains.assign(shields_dem_low=2 * grains["shields_closed_form"])
    one = judge(
        results.tables, methods=methods.assign(waiting_time=1.0), single_grain=raised
    )
    assert one["numerical"].verdict == "no data"
    assert "held flows" in one["numerical"].why
    ramps = scenes.loc[scenes["alpha_deg"] > 0, "scene_id"]
    is_ramp = methods["scene_id"].isin(ramps)
    both = methods.assign(waiting_time=np.where(is_ramp, 1.0, 6.0))
    factor = np.where(grains["scene_id"].isin(ramps), 2.0, 0.9)
    raised = grains.assign(shields_dem_low=factor * grains["shields_closed_form"])
    assert (
        judge(results.tables, methods=both, single_grain=raised)["numerical"].verdict
        == "mostly not"
    )


def test_verdicts_turn_with_the_numbers(results: Results) -> None:
    grains, moved = results.tables["single_grain"], results.tables["pile_grain"]
    inverse = grains.assign(shields_dem=1 / grains["shields_dem"])
    turned = judge(results.tables, single_grain=inverse)
    assert turned["held beta_deg"].verdict == turned["held alpha_deg"].verdict == "not"
    step = moved["moved_in_load_step"]
    reverse = moved.assign(moved_in_load_step=step.max() + 1 - step)
    assert judge(results.tables, pile_grain=reverse)["order"].verdict == "not"
    for change, verdict in ((0.04, "reproduced"), (0.2, "not")):
        frozen = results.tables["pile_threshold"].assign(frozen_bed=change)
        assert (
            judge(results.tables, pile_threshold=frozen)["coupling"].verdict == verdict
        )


def test_a_claim_on_piles_is_judged_under_each_stress(results: Results) -> None:
    slopes = [{"alpha_deg": 15.0, "shields": 0.1}, {"alpha_deg": 20.0, "shields": 0.2}]
    falling = [{**slope, "shields": 1 / slope["shields"]} for slope in slopes]
    piles = copies(
        results,
        *({**slope, "stress": "eq10"} for slope in slopes),
        *({**slope, "stress": "wall"} for slope in falling),
    )
    in_regime = {"force_law": "high", "regime": "high", "packing": "aligned"}
    scenes = piles.tables["scenes"].assign(**in_regime)
    table = piles.tables["pile_threshold"].assign(**in_regime)
    one = judge(piles.tables, scenes=scenes, pile_threshold=table)["piles alpha_deg"]
    high = [each for each in one.decisive if "high" in each.name]
    assert [(each.flow, each.counts) for each in high] == [
        ("eq10", (4, 4)), ("wall", (0, 4)),
    ]  # fmt: skip


def test_curves_are_of_methods_in_which_grains_free_one_another(
    results: Results,
) -> None:
    methods = ("dem", "peeling", "pivot")
    piles = copies(results, *({"method": name} for name in methods))
    evidence = Evidence(piles.tables)
    assert {curve["method"].iloc[0] for curve in evidence.curves("wall")} == {
        "dem", "peeling",
    }  # fmt: skip
    assert evidence.curves("eq10") == []
    assert set(evidence.joined("pile_grain")["method"]) == {"dem"}
    assert set(evidence.joined("pile_threshold")["method"]) == set(methods)


def test_the_closed_form_is_judged(exact: Tables) -> None:
    judged = judge(exact)
    assert judged["conditioning"].verdict == "not"
    assert judged["best_fit"].verdict == "mostly not"
    # lift over drag at Re* = 3 is alpha_s/pi, over tan(beta)
    steepest = 1 / (1 + 1.615 / np.pi) - 1
    lines = judged["constant"].comparisons
    change = next(line for line in lines if "closed form: change" in line.name)
    assert change.numbers.min() == pytest.approx(steepest, rel=1e-3)
    # soft contacts that matter are seen
    soft = exact["methods"].set_index("scene_id")["stiffness"] < 1e4
    grains = exact["single_grain"]
    factor = np.where(soft.loc[grains["scene_id"]], 1.2, 1.0)
    softer = grains.assign(ustar_m_s=grains["ustar_m_s"] * factor)
    assert judge(exact, single_grain=softer)["conditioning"].verdict == "mostly not"


def test_the_transition_and_other_fluids_are_not_judged(results: Results) -> None:
    tables, joined = results.tables, results.joined("single_grain")
    in_regime = (joined["force_law"] == joined["regime"]).to_numpy()
    assert not in_regime.all()
    grains = tables["single_grain"]
    absurd = grains.assign(shields_dem=grains["shields_dem"].where(in_regime, 1e9))
    judged = claims.judge_claims({**tables, "single_grain": absurd})
    assert claims.frame(judged).equals(claims.frame(claims.judge_claims(tables)))
    water = judge(tables, scenes=tables["scenes"].assign(rho_f_kg_m3=1000.0))
    assert {one.verdict for one in water.values()} == {"no data"}


@pytest.mark.parametrize("is_paper", [True, False])
def test_a_study_of_the_paper_alone_gets_a_report_card(
    results: Results, tmp_path: Path, is_paper: bool
) -> None:
    text = (
        (PRESETS / "paper.toml").read_text(encoding="utf-8")
        if is_paper
        else "title = ''"
    )
    (tmp_path / "cases").mkdir()
    grains = {
        name: results.tables[name]
        for name in ("scenes", "methods", "single_grain", "reason")
    }
    whole = replace(results, study=replace(results.study, text=text), tables=grains)
    cards = paper.cards(whole.study, whole.tables)
    report.write(whole, {}, Folder(tmp_path), cards)
    page = (tmp_path / report.PAGE).read_text(encoding="utf-8")
    assert ('id="claims"' in page) == (tmp_path / paper.CLAIMS).exists() == is_paper
    if is_paper:
        assert cards[0].card is not None
        # what was not judged is told, and is no part of what was
        reproduced, in_part, lacking = cards[0].card.numbers
        judged = sum(one.verdict != "no data" for one in claims.judge_claims(grains))
        assert 0 < judged < len(CLAIMS)
        assert reproduced.unit == in_part.unit == f"of {judged} judged"
        assert (lacking.figure, lacking.unit) == (str(17 - judged), "of 17")
        assert "Do the paper’s claims hold" in page
        table = pd.read_csv(tmp_path / paper.CLAIMS)
        assert len(table) == len(CLAIMS)
        assert set(table["verdict"]) > {"no data"}


@pytest.mark.parametrize("tolerance", [None, 0.2])
def test_the_card_says_why_claims_were_not_judged(
    results: Results, tolerance: float | None
) -> None:
    judged = claims.judge_claims(results.tables)
    card = claims.claims_card(judged, results.tables, tolerance)
    note = card.numbers[-1].note
    assert ("at a tolerance of 20 %" in note) == (tolerance is not None)
    table = claims.claims_sheet(judged, "").frame
    not_judged = table["verdict"] == "not judged"
    assert set(table.loc[not_judged, "holds in"]) == {"—"}
    assert not (table.loc[~not_judged, "holds in"] == "—").any()


def test_thresholds_that_the_tolerance_alone_forbids_are_told(results: Results) -> None:
    piles = results.tables["pile_threshold"]
    assert piles["usable"].all()
    first = piles[["scene_id", "fraction"]].iloc[:3]
    reasons = first.assign(reason=ABOVE_TOLERANCE, why_not="", remedy="")
    reasons = pd.concat([reasons, reasons.iloc[:1].assign(reason="law")])
    index = piles.index.isin(first.index)
    tables = {
        **results.tables,
        "reason": reasons,
        "pile_threshold": piles.assign(usable=~index),
    }
    judged = claims.judge_claims(tables)
    advice = claims.claims_card(judged, tables, 0.05).worth.advice
    assert f"{len(piles) - 3} of {len(piles)} are usable" in advice
    assert "2 of the others have a numerical error above the tolerance of 5 %" in advice


def test_every_pile_in_air_has_an_answer_of_a_law_that_holds() -> None:
    """The paper's own range: 56 piles, for 34 of which neither of its equations holds."""
    holding: dict[tuple[float, ...], set[str]] = {}
    for scene in study.load("paper").scenes:
        if scene.bed.kind != "pile" or scene.fluid.viscosity != 1e-5:
            continue
        key = (scene.bed.slope_deg, scene.grain.diameter, scene.bed.roughness)
        laws = holding.setdefault(key, set())
        if law_holds(scene):
            laws.add(scene.forces.law)
    assert len(holding) == 56
    assert all(BRIDGED in laws for laws in holding.values())
    assert sum(laws == {BRIDGED} for laws in holding.values()) == 34


def test_grains_on_the_curves_fit_them(exact: Tables) -> None:
    """The claim of the best fit can come out as reproduced."""
    grains = exact["single_grain"].copy()
    own = exact["scenes"].set_index("scene_id").loc[grains["scene_id"]]
    is_wide = grains["reynolds"].to_numpy() > 0.01
    is_named = (
        (own["beta_deg"] == 50) & (own["z0_over_d"] < 0.05)
    ).to_numpy() & is_wide
    at = np.log(grains.loc[is_named, "reynolds"])
    logs = []
    for curve in curves.WATER:
        x, y = curve.points(2000)
        logs.append(np.interp(at, np.log(x), np.log(y), left=np.nan, right=np.nan))
    grains.loc[is_named, "shields_dem"] = np.exp(np.nanmean(logs, axis=0))
    fit = judge(exact, single_grain=grains)["best_fit"]
    assert fit.verdict == "reproduced"
    decisive = [one for one in fit.comparisons if one.is_decisive]
    factors = [one.numbers for one in decisive if not one.has_bools]
    assert np.concatenate(factors) == pytest.approx(1.0, abs=0.06)
