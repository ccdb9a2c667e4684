"""Validation: exact pockets of laid grains, scores, the paper's rule, and measured rows."""

import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed.packing import Packing
from orchestrator.errors import InputError
from orchestrator.flow.stress import WallStress
from orchestrator.grains import threshold
from orchestrator.lab import strips, validate
from orchestrator.physics import beside
from orchestrator.physics.curves import GAMMA, iversen_white
from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import MEASURED_BEDS
from orchestrator.physics.rolling import sustained
from orchestrator.report import style
from orchestrator.study import fields, scopes, study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.tables import kinds
from tests import letters

TOOL = Path(__file__).parents[2] / "tools" / "tested.py"
DOCS = Path(__file__).parents[2] / "docs"
FLUMES = ("flumes, visual", "flumes, fixed intensity", "flumes, reference transport")


def test_grains_laid_on_a_close_packed_layer_lie_in_its_pockets() -> None:
    # rows lie across the flow, so that pockets point up and down it
    rows, columns = 16, 6
    y, x = np.meshgrid(np.arange(columns) + 0.0, np.arange(rows) * math.sqrt(3) / 2)
    y = (y + np.where(np.arange(rows)[:, None] % 2, 0.5, 0.0)).ravel()
    every, flat = np.ones(len(y), bool), np.column_stack([x.ravel(), np.zeros_like(y)])
    packing = Packing(
        flat, np.ones(len(y)), every, every, ~every, x.ravel(), y, float(columns)
    )
    angles = strips.laid(packing, 20)
    exact = np.degrees(np.arctan([math.sqrt(1 / 8), math.sqrt(1 / 2)]))
    assert np.abs(angles[:, None] - exact).min(axis=1).max() < 0.1
    # downstream of a pocket is either the saddle between two grains or the top of one
    assert {int(np.abs(angle - exact).argmin()) for angle in angles} == {0, 1}


@pytest.mark.parametrize(("mobility", "exponent"), [(0.0, -1.0), (2.0, -2.0)])
def test_hiding_is_that_of_grains_that_one_stress_moves(
    mobility: float, exponent: float
) -> None:
    """Equal parts of all sizes move at one stress; then a part as D^-2 falls as that."""
    sizes = np.repeat([0.75, math.sqrt(0.75), 1.0, math.sqrt(2.0)], 2001)
    # as much of each class moves as the square of the stress; locked grains count in none
    stress = np.tile(np.sqrt(np.linspace(0, 1, 2001)), 4)
    free = strips.Counted(stress, sizes, np.ones(len(sizes), bool))
    locked = strips.Counted(np.full(500, 1e-3), np.full(500, 1.0), np.zeros(500, bool))
    # theta_i ~ D_i^-1 at one stress, and the stress as the root of the part
    found = strips.hiding_of([free, locked], mobility)
    assert found == pytest.approx(exponent, abs=2e-2)


def test_hiding_is_read_where_few_grains_of_each_class_have_moved() -> None:
    """At most 3 % at d50 and 6 % of a class; classes too small for such a part are left out."""
    sizes = np.repeat([0.5, 1.0, 2.0], 2000)
    # beyond those parts each class has a law of its own
    part = np.tile(np.arange(1, 2001) / 2000, 3)
    stress = np.where(part <= 0.06 + 1e-9, part, 1e3 * sizes)
    every = np.ones(len(sizes), bool)
    found = threshold.hiding_exponent(stress / sizes, sizes, every, 2.0)
    # the part of 0.06 of the smallest makes 0.015 at d50
    assert found == pytest.approx(-3.0, abs=0.06)
    few = every.copy()
    # of ten grains no 6 % can be read
    few[10:2000] = False
    of_two = threshold.hiding_exponent(stress / sizes, sizes, few, 2.0)
    assert of_two == pytest.approx(-3.0, abs=2e-2)
    few[2010:4000] = False
    assert math.isnan(threshold.hiding_exponent(stress / sizes, sizes, few, 2.0))


def test_a_score_is_of_rows_that_were_read_alone() -> None:
    rows = pd.DataFrame(
        {"set": "a", "model": "m", "ratio": [0.5, 2.0, 4.0, 100.0, np.nan]}
    )
    (score,) = validate.scores(
        rows.assign(sure=["read"] * 3 + ["memory", "read"])
    ).to_dict("records")
    assert (score["rows"], score["answered"]) == (4, 3)
    assert (score["ratio"], score["factor"], score["worst"]) == (2.0, 2.0, 4.0)


def test_rows_are_scored_alike_and_a_formula_is_none_of_them() -> None:
    sets = ["flumes, visual"] * 4 + ["wind, field", validate.IVERSEN_WHITE]
    ratios = [0.5, 1.0, 1.2, np.nan, 4.0, 100.0]
    rows = pd.DataFrame({"set": sets, "ratio": ratios, "model": "m"})
    found = validate.by_rows(rows).set_index("group")
    every = found.loc["flumes and field sites"]
    assert (every["rows"], every["answered"]) == (5, 4)
    assert every["factor"] == pytest.approx(1.6)
    assert (every["within_1.5"], every["within_2"]) == (0.5, 0.75)
    assert found.loc["level flumes", "factor"] == pytest.approx(1.2)
    assert "rivers" not in found.index
    scored = validate.scores(rows.assign(sure="read"))
    assert set(scored["set"]) == {"flumes, visual", "wind, field", sets[-1]}


def test_what_is_taken_without_a_model_is_of_the_fluid() -> None:
    beds = pd.read_csv(MEASURED_BEDS).query("set == 'flumes, visual'")
    assert (validate.by_constants(beds) == 0.05).all()
    air = pd.read_csv(MEASURED_BEDS).query("set == 'wind, field'")
    assert (validate.by_constants(air) == 0.0123).all()
    # Shao and Lu have 0.0123 (1 + gamma/(rho g d^2))
    held = 1 + GAMMA / (2650 * 9.81 * air["d_m"] ** 2)
    assert validate.by_formulas(air) == pytest.approx(0.0123 * held, rel=2e-3)
    level = beds.assign(slope=0.0)
    assert (validate.by_formulas(level) == validate.by_formulas(beds)).all()


def test_an_interval_is_as_wide_as_sets_left_out_need() -> None:
    tool = runpy.run_path(str(TOOL))
    sets = pd.Series(["a"] * 10 + ["b"] * 10)

    def calibrated(ratio: pd.Series, at: pd.Series) -> list[Any]:
        found = tool["calibrated"]([ratio], [at], sets, [(1.0, 10.0)])
        return [each for _, each in found]

    # two sets of ten, the second at four times the ratios of the first
    one = pd.Series(np.linspace(0.9, 1.1, 10))
    here = pd.Series(3.0, sets.index)
    apart = pd.concat([one, 4 * one], ignore_index=True)
    (found,) = calibrated(apart, here)
    # b is predicted by a, and a by b: eight rows in ten are contained
    assert (found.rows, found.sets) == (20, 2)
    assert 0.8 <= found.held < 0.9
    needed = np.sort(np.concatenate([4 * one / one.max(), 4 * one.min() / one]))
    assert needed[15] <= found.widened <= needed[15] * tool["WIDER"]
    low, high = apart.iloc[1], apart.iloc[18]
    assert found.low == pytest.approx(low / found.widened)
    assert found.high == pytest.approx(high * found.widened)
    # sets that agree need no more than their own scatter
    alike = pd.concat([one, one], ignore_index=True)
    assert calibrated(alike, here)[0].widened == pytest.approx(1.0, abs=0.01)
    # an interval on one side of the answer ends at it
    assert calibrated(3 * alike, here)[0].low == 1.0
    assert calibrated(alike / 3, here)[0].high == 1.0
    # a set that no other predicts says nothing of others
    assert not calibrated(one, here[:10])
    # with others at another Re* it does
    (lone,) = calibrated(apart, pd.Series([3.0] * 10 + [30.0] * 10))
    assert (lone.rows, lone.sets) == (10, 1)


def test_rows_are_held_by_what_is_between_two_windows() -> None:
    calibrated = runpy.run_path(str(TOOL))["calibrated"]
    chance = np.random.default_rng(4)
    count = 400
    at = pd.Series(10 ** chance.uniform(0, 2, count))
    sets = pd.Series(chance.choice([*"abcd"], count))
    # each set has its own median, and all fall with Re*
    shift = sets.map({"a": -0.3, "b": -0.1, "c": 0.2, "d": 0.4})
    ratio = np.exp(shift + chance.normal(0, 0.2, count)) / at**0.3
    spans = [(1.0, 10.0), (10**0.5, 10**1.5), (10.0, 100.0)]
    found = [each for _, each in calibrated([ratio], [at], sets, spans)]
    assert [each.rows for each in found] == [
        int(at.between(*span).sum()) for span in spans
    ]
    assert min(each.held for each in found) >= 0.8
    # no window is wider than it must be: one of them is near what is asked
    assert min(each.held for each in found) < 0.83


def test_the_interval_of_a_kind_holds_its_rows_in_flumes() -> None:
    beds = pd.read_csv(MEASURED_BEDS).query("set in @FLUMES")
    at = validate.single(beds, "bridged")
    here = (at.reynolds >= 1) & (at.reynolds < 10)
    grain = {
        "force_law": "bridged",
        "beta_deg": 60.0,
        "d_m": 3e-4,
        "z0_m": 1e-5,
        "alpha_deg": 0.0,
        "reynolds": 5.0,
    }
    grain |= {"alpha_s": 1.615, "cohesion_n_m": 0.0, "rho_f_kg_m3": 1000.0}
    grain |= {"rho_sol_kg_m3": 2650.0, "nu_m2_s": 1e-6, "g_m_s2": 9.81}
    low, high, rows, held = found(grain)
    ratio = (beds["shields"] / at.shields)[here]
    # it is right for all angles and d/z0 of its range, and the widest
    assert len(ratio) >= rows >= 10
    assert held >= 0.8
    # it contains more of the rows that made it than of those that were left out
    assert ratio.between(low, high).mean() >= held
    # a small change of any number leaves it
    for near in ({"beta_deg": 59.0}, {"z0_m": 3e-4 / 30.06}, {"z0_m": 3e-4 / 31}):
        assert found({**grain, **near}) == [low, high, rows, held]
    # nothing was measured on slopes, of another angle, density or bed, or with cohesion
    for other in (
        {"alpha_deg": 5.0},
        {"beta_deg": 40.0},
        {"cohesion_n_m": 1e-4},
        {"z0_m": 3e-4 / 20},
        {"rho_sol_kg_m3": 19300.0},
        {"rho_sol_kg_m3": 1001.0},
    ):
        assert not found({**grain, **other})[2], other


def found(row: dict[str, Any]) -> list[float]:
    """The tested interval of a threshold."""
    table = {name: np.array([value], object) for name, value in row.items()}
    if "bed" in row:
        table[beside.TESTED_AS] = np.array(kinds.tested_as(table), object)
    return [float(each) for each in beside.tested(table)[:, 0]]


SPANNED = {
    **{"fluid.density": 1025.0, "fluid.viscosity": 2e-6, "fluid.gravity": 3.7},
    **{"grain.density": 2000.0, "bed.height": 0.5, "bed.length": 0.8},
    # over a level bed u* is u*_0, whatever is above it; pivots of poured grains know no beta
    **{
        "flow.top": "open water",
        "forces.stress": "eq10",
        "forces.averaging_length": 0.1,
    },
    "bed.entrainment_angle_deg": 59.5,
}
"""Fields of a strip, and other values of them, that its tested interval spans: its threshold is a
function of the Galileo number."""
UNTESTED: dict[str, Any] = {
    **{"fluid.density": 1.2, "grain.diameter": 0.022, "grain.friction_angle_deg": 10.0},
    **{"grain.cohesion": 0.1, "grain.sizes": {"sigma_g": 1.4}, "bed.roughness": 1e-3},
    **{
        "bed.poured_depth": 8.0,
        "bed.width": 12.0,
        "method.grains.mobile_layers": 6,
        "bed.length": 0.2,
    },
    **{"bed.counted": (0.1, 0.3), "bed.packing": "aligned", "bed.shape": "step down"},
    **{
        "bed.slope_deg": 5.0,
        "flow.gusts": {"intensity": 0.2, "events": 50},
        "method.flow.model": "x",
    },
    **{"forces.law": "profile", "forces.lift_coefficient": 1.0},
    **{"forces.loaded_grains": "all but crest", "forces.sheltering": "balanced"},
    **{"method.kind": "dem", "threshold.fractions": (0.3,)},
    **{"threshold.criterion": "sustained"},
}
"""Other values of the fields of a strip for which none was tested."""


def test_an_interval_is_of_strips_that_differ_in_nothing_else_than_the_tested() -> None:
    (strip, *_) = (scene for scene in study.load("validate").scenes if scene.is_poured)

    def rows(scene: Scene) -> float:
        row = fields.used(scene)
        row |= {"fraction": scene.threshold.fractions[0], "reynolds": 30.0}
        row["gust"] = scene.gust if scene.flow.gusts else np.nan
        return found(row)[2]

    assert rows(strip) == 81
    for name, value in SPANNED.items():
        depth = {"flow.depth": 2.0} if name == "flow.top" else {}
        assert rows(changed(strip, {name: value, **depth})) == 81, name
    for name, value in UNTESTED.items():
        try:
            other = changed(strip, {name: value})
        except InputError:  # no strip has such a value
            continue
        assert rows(other) == 0, name
    asked = {
        field.name
        for field in fields.FIELDS
        if not field.is_method and scopes.APPLIES[field.info.scope](strip)
    }
    # forms of a train, profiles and obstacles are no level beds, depth and lee side are not set
    others = {
        f"bed.{name}" for name in ("kind", "forms", "spacing", "profile", "obstacles")
    }
    others |= {"bed.lee_slope_deg", "flow.depth", "bed.disorder", fields.SEED}
    # strips with grains that stand out were tested by themselves
    others.add("forces.exposure")
    # the word for a fluid names numbers, and a criterion where none is asked for
    assert rows(changed(strip, {"fluid.kind": "paper"})) == 81
    others.add("fluid.kind")
    assert rows(changed(strip, {"forces.exposure": "protrusion"})) == 86
    assert asked - others <= SPANNED.keys() | UNTESTED.keys()
    shared = {"forces.exposure": "protrusion", "forces.sheltering": "balanced"}
    gusts = {"intensity": 0.4, "events": 100}
    gusty = rows(changed(strip, {**shared, "flow.gusts": gusts}))
    assert gusty > 0
    assert gusty == rows(
        changed(strip, {**shared, "flow.gusts": {**gusts, "duration": 5}})
    )
    assert rows(changed(strip, {**shared, "flow.gusts": {**gusts, "events": 10}})) == 0


def test_a_stress_that_is_the_measured_one_over_a_hump_is_met_at_every_row() -> None:
    x, cf, ones = pd.read_csv(validate.FOLDER / "hump_stress.csv").to_numpy().T
    # in other units, at the same places
    stress = WallStress(x * 0.42, x * 0.42, ones, ones, ones, 300 * cf, ones)
    measured, value, *_ = validate.over_hump(stress).to_numpy().T
    assert value.astype(float) == pytest.approx(measured.astype(float), rel=1e-9)


def test_the_paper_has_no_answer_in_the_transition() -> None:
    water = {"rho_sol_kg_m3": 2650.0, "rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6}
    beds = pd.DataFrame({"d_m": [1e-5, 1e-3, 1e-2], **water})
    beds = beds.assign(slope=0.0, cohesion_n_m=0.0)
    assert np.isnan(validate.by_paper(beds)).tolist() == [False, True, False]


def test_the_measured_rows_are_whole() -> None:
    beds = pd.read_csv(MEASURED_BEDS)
    counts = beds.groupby("set").size()
    assert counts["flumes, visual"] == 245
    assert counts["flumes, fixed intensity"] == 28
    assert counts[validate.RIVERS] == 80
    flumes = beds[beds["set"] != validate.RIVERS]
    assert flumes["shields"].between(0.0, 0.4).all()


def test_the_points_of_the_formula_are_on_it_with_the_cohesion_of_the_cards() -> None:
    beds = pd.read_csv(MEASURED_BEDS)
    tunnel = beds[beds["set"] == validate.IVERSEN_WHITE]
    assert len(tunnel) == 8
    # the pull of a contact at 30 degrees that holds as Shao and Lu's gamma
    pull = math.pi * GAMMA / (12 * math.cos(math.radians(30)))
    assert tunnel["cohesion_n_m"].to_numpy() == pytest.approx(pull, rel=1e-3)
    assert pull <= beside.MOST_COHESION <= 1.01 * pull
    sand = Grain(
        diameter=tunnel["d_m"], density=2650.0, fluid_density=1.2, viscosity=1.5e-5
    )
    curve = sand.shields(iversen_white(sand))
    assert tunnel["shields"].to_numpy() == pytest.approx(curve, rel=1e-3)


def test_grains_that_go_on_are_as_near_as_the_documents_say() -> None:
    beds = pd.read_csv(MEASURED_BEDS)
    shields = validate.sustained_shields(beds, validate.GUST, is_entrained=True)
    rows = beds.assign(model="m", ratio=shields / beds["shields"], sure="read")
    factors = validate.scores(rows).set_index("set")["factor"]
    stored = pd.read_csv(DOCS / "measured" / "validation-scores.csv")
    said = stored[stored["model"] == validate.DEFAULT].set_index("set")["factor"]
    assert factors.to_dict() == pytest.approx(said[factors.index].to_dict(), rel=0.01)
    others = [validate.IVERSEN_WHITE, validate.RIVERS]
    assert factors.drop(others).median() <= 1.25
    # in water a grain that leaves stops with its gust; in air one that leaves goes on
    alone = validate.sustained_shields(beds, validate.GUST, is_entrained=False)
    in_water = beds["rho_f_kg_m3"] > 100
    assert (alone[in_water] == shields[in_water]).all()
    assert (alone[~in_water] < shields[~in_water]).all()


def test_a_shallow_flow_is_why_steep_beds_hold_their_grains() -> None:
    beds = pd.read_csv(MEASURED_BEDS)
    steep = beds[beds["set"] == "steep flumes"].iloc[::4]
    shallow = validate.measured_grains(steep)
    deep = shallow.changed(fall=0.0)
    in_deep, in_shallow = (
        sustained(grains).initiation(validate.GUST) / steep["shields"]
        for grains in (deep, shallow)
    )
    assert in_deep.median() < 0.5
    assert in_shallow.median() == pytest.approx(1.0, abs=0.15)


def test_the_figures_have_at_most_seven_models_in_letters_to_read() -> None:
    scored = pd.read_csv(DOCS / "measured" / "validation-scores.csv")
    names = {model.name for model in validate.MODELS}
    assert set(validate.LOOKS) <= names
    galileo = np.geomspace(2.0, 2e4, 7)
    rows = pd.concat(
        pd.DataFrame(
            {
                "galileo": galileo,
                "cohesion_n_m": 0.0,
                "slope": 0.0,
                "rho_f_kg_m3": density,
                "set": "flumes",
                "model": name,
                "measured": 0.05,
                "value": 0.04,
            }
        )
        for name in names
        for density in (1000.0, 1.2)
    )
    rows = rows.reset_index(drop=True)
    with style.settings(style.LETTERS):
        for width in letters.SHOWN:
            letters.check(validate.factors(scored, width))
            letters.check(validate.validation_diagram(rows, width))
        (ax,) = validate.factors(scored, style.WIDE).axes
    assert len(ax.texts) == scored["set"].nunique()
    # a set that no model changes has one mark
    marks = [line for line in ax.lines if line.get_gid() == "every model"]
    alike = scored.groupby("set")["ratio"].agg(lambda ratio: np.ptp(ratio.dropna()))
    assert len(marks) == (alike < validate.ALIKE).sum() > 3
