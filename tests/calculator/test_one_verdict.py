"""One grain, two commands: `threshold` and `study` have one answer and one verdict."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orchestrator
from orchestrator import plan, tables
from orchestrator.calculator import answer
from orchestrator.calculator.table import thresholds
from orchestrator.physics import verdict
from orchestrator.physics.laws import LAWS
from orchestrator.physics.reported import OF_CHANNELS, OF_LAWS, REPORTED
from orchestrator.report import answers, sheets
from orchestrator.report.results import Results
from orchestrator.study import study

COUNT = 200
OTHER_BEDS = 0.01
"""Number of grains at random, and the part of them on beds of another roughness."""
WATER = (999.1, 1.139e-6, 9.81)
AIR = (1.225, 1.46e-5, 9.81)
MARS = (0.02, 6.5e-4, 3.71)
TITAN = (5.4, 1.2e-6, 1.35)
FLUIDS = (
    WATER,
    (1026.0, 1.19e-6, 9.81),
    (900.0, 1e-5, 9.81),  # an oil
    AIR,
    (0.2, 6e-5, 3.71),  # a thick air of Mars
    (65.0, 5e-7, 8.87),  # Venus
)
"""Density, viscosity and gravity."""
GOOD, CARE, BAD = "good", "care", "bad"
Given = tuple[float, float, tuple[float, float, float]]
"""Diameter, density and fluid of a grain."""
NAMED: tuple[tuple[Given, dict[str, Any], str], ...] = (
    ((1e-3, 2650.0, WATER), {"entrainment_angle_deg": 59.0}, GOOD),
    ((1e-3, 2650.0, WATER), {"entrainment_angle_deg": 60.0}, GOOD),
    ((1e-3, 2650.0, WATER), {"roughness": "d/31"}, GOOD),
    ((1e-3, 2650.0, WATER), {"roughness": "d/30"}, GOOD),
    ((6e-5, 2650.0, WATER), {}, GOOD),
    # at the upper end of its interval: nearly all that was measured is below it
    ((8e-5, 2650.0, WATER), {}, CARE),
    # above the rows of flumes
    ((1e-4, 2650.0, WATER), {}, CARE),
    # of such densities nothing was measured
    ((1e-3, 19300.0, WATER), {}, BAD),
    ((1e-3, 11340.0, WATER), {}, BAD),
    ((1e-3, 1001.0, WATER), {}, BAD),
    # dust, which cohesion holds
    ((1e-5, 2650.0, AIR), {}, BAD),
    ((2e-4, 3000.0, MARS), {}, BAD),
    ((5e-4, 1000.0, TITAN), {}, BAD),
    # coarser than the rows of flumes
    ((63e-3, 2650.0, WATER), {}, BAD),
    ((100e-3, 2650.0, WATER), {}, BAD),
    # near the upper end of its interval
    ((30e-3, 2650.0, WATER), {"roughness": "d/10"}, GOOD),
)
"""Grains, what else they have, and their verdict."""
OTHERS = (
    *("measured_rows", "tested_rows", "usable", "reason", "why_not", "remedy"),
    *("verdict", "shields_low", "shields_high", "interval_of", "interval_laws"),
)
"""Columns that a row of either command has."""
UNITS = [(stem, unit) for stem, unit in REPORTED.items() if stem not in OF_CHANNELS]
REPORTED_AS = [
    f"{stem}{end}{unit}" for stem, unit in UNITS for end in ("_low", "_high")
]
REPORTED_AS += [f"compared_{stem}{unit}" for stem, unit in UNITS]
"""Columns of intervals and of values to compare in each reported unit."""


def named() -> list[dict[str, Any]]:
    """The grains of `NAMED`, as the calculator names their numbers."""
    made = []
    for (diameter, density, fluid), others, _ in NAMED:
        fluid_density, viscosity, gravity = fluid
        made.append(
            {
                "diameter": diameter,
                "density": density,
                "fluid_density": fluid_density,
                "viscosity": viscosity,
                "gravity": gravity,
                "entrainment_angle_deg": 60.0,
                "roughness": "d/30",
                "slope_deg": 0.0,
                "cohesion": 0.0,
                **others,
            }
        )
    return made


def at_random() -> list[dict[str, Any]]:
    """Grains at random."""
    chance = np.random.default_rng(47)
    made = []
    for _ in range(COUNT):
        fluid_density, viscosity, gravity = FLUIDS[
            chance.choice(6, p=[0.35, 0.1, 0.1, 0.35, 0.05, 0.05])
        ]
        densities = [2650.0, 2500.0, 1200.0, 19300.0, chance.uniform(1500, 5000)]
        density = chance.choice(densities, p=[0.6, 0.1, 0.05, 0.05, 0.2])
        finest = -5 if fluid_density < 100 else -3.8
        diameter = 10 ** chance.uniform(finest, -1.5)
        # hops over beds of another d/z0 than 30 are in no table: a second each
        ratio = 30.0
        if chance.uniform() < OTHER_BEDS:
            ratio = chance.choice([10.0, 31.0, 20.0, chance.uniform(5, 60)])
        made.append(
            {
                "diameter": float(f"{diameter:.4g}"),
                "density": float(density),
                "fluid_density": fluid_density,
                "viscosity": viscosity,
                "gravity": gravity,
                "entrainment_angle_deg": float(
                    chance.choice([60.0, 59.0, 50.0, chance.uniform(35, 60)])
                ),
                "roughness": f"d/{ratio:.4g}",
                "slope_deg": float(chance.choice([0.0, 0.0, chance.uniform(0, 28)])),
                "cohesion": float(
                    chance.choice([0.0, 0.0, 0.0, 10 ** chance.uniform(-6, -4)])
                ),
            }
        )
    return made


def by_threshold(asked: list[dict[str, Any]]) -> list[dict[str, Any] | None]:
    """The row of each grain, and its card, by `threshold`; None where no law holds."""
    table = thresholds({name: [grain[name] for grain in asked] for name in asked[0]})
    cells = zip(*(column.tolist() for column in table.values()), strict=True)
    rows = [dict(zip(table, row, strict=True)) for row in cells]
    found: list[dict[str, Any] | None] = []
    for start in range(0, len(rows), len(LAWS)):
        laws = rows[start : start + len(LAWS)]
        (row,) = (row for row in laws if row["answer"])
        holds = any(each["valid"] for each in laws)
        found.append({**row, "card": answer.grain_card(laws)} if holds else None)
    return found


def by_study(asked: list[dict[str, Any]], out: Path) -> list[dict[str, Any]]:
    """The same by one study of all of them."""
    text = 'method.kind = "pivot"\n'
    for number, grain in enumerate(asked):
        text += f"""
[[group]]
name = "{number}"
grain = {{ diameter = {grain["diameter"]}, density = {grain["density"]}, cohesion = {grain["cohesion"]} }}
[group.fluid]
density = {grain["fluid_density"]}
viscosity = {grain["viscosity"]}
gravity = {grain["gravity"]}
[group.bed]
slope_deg = {grain["slope_deg"]}
entrainment_angle_deg = {grain["entrainment_angle_deg"]}
roughness = "{grain["roughness"]}"
"""
    parsed = study.parse(text, name="t", where="t")
    planned = plan.make(parsed)
    made = tables.make_tables(parsed, planned, out, ())
    results = Results(parsed, planned, made, out)
    order = {group.name: group.scenes[0].id for group in parsed.groups}
    found = sheets.single_grains_sheet(results)
    rows = []
    for number in range(len(asked)):
        (place,) = np.flatnonzero(found["scene_id"] == order[str(number)])
        row = found.iloc[place].copy()
        # a study has one basis for all its grains; the command asks for one
        row["advised"] = verdict.advised([row.to_dict()])
        cells = {str(name): value for name, value in row.items()}
        rows.append({**cells, "card": answers.card_of_grain(row)})
    return rows


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Any, Any]]:
    """What both commands say: of the `NAMED`, then of the others for which a law holds."""
    asked = [*named(), *at_random()]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        here = by_threshold(asked)
        held = [place for place, row in enumerate(here) if row is not None]
        grains = [asked[place] for place in held]
        there = by_study(grains, tmp_path_factory.mktemp("one"))
    assert held[: len(NAMED)] == list(range(len(NAMED)))
    assert len(held) > 0.85 * len(asked)
    return list(zip([here[place] for place in held], there, strict=True))


def alike(one: Any, other: Any) -> bool:
    """Whether two numbers agree but for rounding, or are not known; or two words."""
    if isinstance(one, str):
        return bool(one == other)
    is_one_known = one is not None and not math.isnan(one)
    is_other_known = other is not None and not math.isnan(other)
    if not (is_one_known and is_other_known):
        return is_one_known is is_other_known
    return math.isclose(one, other, rel_tol=1e-6)


def test_threshold_and_study_say_the_same_of_one_grain(
    pairs: list[tuple[Any, Any]],
) -> None:
    for here, there in pairs:
        told = (
            f"d {here['d_m']:g}, {here['rho_sol_kg_m3']:g} in {here['rho_f_kg_m3']:g}"
        )
        one, other = here["card"], there["card"]
        assert one.worth.mark == other.worth.mark, (told, one.worth, other.worth)
        assert one.worth.word == other.worth.word, (told, one.worth, other.worth)
        for number, same in zip(one.numbers, other.numbers, strict=True):
            assert number.interval_of == same.interval_of, told
            for name in ("value", "low", "high", "other"):
                ends = getattr(number, name), getattr(same, name)
                assert alike(*ends), (told, name, ends)
        for name in (*OTHERS, *REPORTED_AS):
            assert alike(here[name], there[name]), (told, name, here[name], there[name])


def test_named_grains_have_their_verdicts(pairs: list[tuple[Any, Any]]) -> None:
    expected = [mark for _, _, mark in NAMED]
    for rows in zip(*pairs[: len(NAMED)], strict=True):
        assert [row["card"].worth.mark for row in rows] == expected


def test_other_worlds_have_no_measurements(pairs: list[tuple[Any, Any]]) -> None:
    for row, (given, _, _) in zip(pairs[: len(NAMED)], NAMED, strict=True):
        if given[2] in (MARS, TITAN):
            assert row[0]["measured_rows"] == row[0]["tested_rows"] == 0
            assert math.isnan(row[0]["compared_level_ustar_m_s"])


def test_a_usable_answer_has_measurements_and_lies_in_its_interval(
    pairs: list[tuple[Any, Any]],
) -> None:
    marks = {"good": 0, "care": 0, "bad": 0}
    for row, _ in pairs:
        marks[row["card"].worth.mark] += 1
        if row["card"].worth.mark != "good":
            continue
        assert row["tested_rows"] > 0 or row["measured_rows"] > 0
        if row["tested_rows"] > 0:
            assert row["tested_low"] <= row["shields"] <= row["tested_high"]
    # the grains span all verdicts
    assert min(marks.values()) > 0


def test_what_is_not_usable_has_no_range_of_laws(
    pairs: list[tuple[Any, Any]],
) -> None:
    for row, _ in pairs:
        assert row["usable"] or row["interval_of"] != OF_LAWS


def test_a_grain_of_the_papers_gas_has_the_range_of_laws() -> None:
    """Nothing was measured there, and the answer is to compare models with."""
    rows = orchestrator.threshold(np.geomspace(1e-4, 2e-3, 20), fluid="paper")
    of_laws = rows[rows["interval_of"] == OF_LAWS]
    assert len(of_laws) > 10
    assert of_laws["usable"].all()
    assert (of_laws["ustar0_low_m_s"] <= of_laws["ustar_m_s"]).all()
    assert (of_laws["ustar_m_s"] <= of_laws["ustar0_high_m_s"]).all()
    assert (of_laws["interval_laws"] > 1).all()


def test_an_interval_is_the_same_in_every_unit(pairs: list[tuple[Any, Any]]) -> None:
    count = 0
    for row, _ in pairs:
        for end in ("_low", "_high"):
            ustar = row[f"ustar0{end}_m_s"]
            if math.isnan(ustar):
                continue
            count += 1
            stress = row["rho_f_kg_m3"] * ustar**2
            assert row[f"stress{end}_pa"] == pytest.approx(stress)
            ratio = row[f"shields{end}"] / row["shields"]
            assert ratio == pytest.approx((ustar / row["ustar_m_s"]) ** 2)
            if row["rho_f_kg_m3"] < 100:
                is_more = row[f"wind_10m{end}_m_s"] >= row["wind_10m_m_s"]
                assert is_more == (ustar >= row["ustar_m_s"])
    assert count > 100


def test_no_interval_has_a_width_of_zero(pairs: list[tuple[Any, Any]]) -> None:
    count = 0
    for row, _ in pairs:
        for number in row["card"].numbers:
            if math.isnan(number.low) or math.isnan(number.high):
                continue
            count += 1
            assert number.high > number.low * 1.01, (row["d_m"], number)
            assert " … " in number.interval
    assert count > 100
