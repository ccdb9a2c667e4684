"""The one interval of a threshold: how it is made, and that all that is shown has it."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import face
from orchestrator.physics.reported import MEASURED, NUMERICAL, SEEDS
from orchestrator.report import (
    answers,
    labels,
    sheets,
    single,
    style,
    subjects,
)
from orchestrator.report.card import lines
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results, seeds_as_one, seeds_of
from orchestrator.tables.quoted import of_classes, quoted
from tests import small_study

NAN = float("nan")
BED = {
    "rho_f_kg_m3": 1000.0,
    "rho_sol_kg_m3": 2650.0,
    "nu_m2_s": 1.1e-6,
    "g_m_s2": 9.81,
    "d_m": 1e-3,
    "z0_m": 1e-3 / 30,
    "alpha_deg": 15.0,
    "alpha_s": 1.615,
    "beta_deg": 60.0,
    "cohesion_n_m": 0.0,
    "relative_size": 1.0,
    "force_law": "bridged",
    "depth_m": NAN,
    "flow_top": "boundary layer",
    "formula_shields": 0.03,
    "measured_median": NAN,
    "measured_low": NAN,
    "measured_high": NAN,
}
ROW = {
    **BED,
    "ustar0_m_s": 0.02,
    "shields": 0.04,
    "shields_numerical_low": 0.039,
    "shields_numerical_high": 0.041,
    "first_ustar0_m_s": 0.01,
    "first_ustar0_numerical_low_m_s": 0.0098,
    "first_ustar0_numerical_high_m_s": 0.0102,
    "tested_low": NAN,
    "tested_high": NAN,
    "tested_rows": 0.0,
}
TESTED = {"tested_low": 0.02, "tested_high": 0.08, "tested_rows": 9.0}
NO_ERROR = {"shields_numerical_low": NAN, "shields_numerical_high": NAN}
LOST = {
    "ustar0_m_s": NAN,
    "shields": NAN,
    "shields_numerical_low": 0.06,
    "shields_numerical_high": NAN,
}


def _quoted(*changes: dict[str, float], twins: list[int]) -> pd.DataFrame:
    rows = pd.DataFrame([{**ROW, **one} for one in changes])
    return pd.DataFrame(quoted(rows, pd.Series(twins)))


def test_the_interval_is_the_tested_one_in_each_unit_else_the_numerical_one() -> None:
    """A stress goes with the Shields number, a friction velocity with its root."""
    found = _quoted(TESTED, {}, twins=[0, 1])
    assert found["interval_of"].tolist() == [MEASURED, NUMERICAL]
    expected = {
        "shields_low": [0.02, 0.039],
        "shields_high": [0.08, 0.041],
        "stress_low_pa": [0.2, 0.39],
        "stress_high_pa": [0.8, 0.41],
        "ustar0_low_m_s": [0.02 / 2**0.5, 0.02 * (0.039 / 0.04) ** 0.5],
        "first_ustar0_low_m_s": [0.01 / 2**0.5, 0.0098],
        "first_ustar0_high_m_s": [0.01 * 2**0.5, 0.0102],
        "first_stress_pa": [0.1, 0.1],
        "first_stress_low_pa": [0.05, 1000 * 0.0098**2],
    }
    for name, values in expected.items():
        assert found[name].tolist() == pytest.approx(values), name


def test_the_interval_of_seeds_holds_all_of_them_and_all_their_intervals() -> None:
    other = {"shields": 0.06, "ustar0_m_s": 0.02 * 1.5**0.5}
    ends = {"shields_numerical_low": 0.058, "shields_numerical_high": 0.062}
    found = _quoted({}, {**other, **ends}, twins=[3, 3])
    assert found["shields_low"].tolist() == [0.039] * 2
    assert found["shields_high"].tolist() == [0.062] * 2
    assert found["stress_low_pa"].tolist() == pytest.approx([0.39] * 2)
    assert found["stress_high_pa"].tolist() == pytest.approx([0.62] * 2)
    assert set(found["interval_of"]) == {NUMERICAL}
    # a tested interval that does not contain its own value does not hide a seed
    beside = {"tested_low": 0.05, "tested_high": 0.055, "tested_rows": 9.0}
    found = _quoted(beside, {**other, **beside}, twins=[3, 3])
    assert (
        found[["shields_low", "shields_high"]].to_numpy().tolist() == [[0.04, 0.06]] * 2
    )
    assert set(found["interval_of"]) == {MEASURED}
    # without a known numerical error it is the range of the seeds; one bed has none
    found = _quoted(NO_ERROR, {**other, **NO_ERROR}, NO_ERROR, twins=[3, 3, 4])
    assert found["interval_of"].tolist()[:2] == [SEEDS] * 2
    assert found["interval_of"].isna().tolist() == [False, False, True]
    assert found["shields_low"].tolist()[:2] == [0.04] * 2
    assert found["shields_high"].tolist()[:2] == [0.06] * 2
    assert found[["shields_low", "shields_high", "stress_low_pa"]].iloc[2].isna().all()


def test_the_interval_of_seeds_is_open_where_one_does_not_reach_the_fraction() -> None:
    found = _quoted({}, LOST, TESTED, twins=[3, 3, 4])
    assert found["shields_low"].tolist() == [0.039, 0.039, 0.02]
    assert found["shields_high"].tolist()[2] == 0.08
    ends = ["shields_high", "ustar0_high_m_s", "stress_high_pa"]
    assert found[ends].iloc[:2].isna().all(axis=None)
    assert found["stress_low_pa"].tolist() == pytest.approx([0.39, 0.39, 0.2])


DUNE = """
fluid.kind = "air"
grain = { diameter = 2.5e-4, density = 2650.0 }
bed = { kind = "pile", shape = "dune", slope_deg = 12.0, height = 1.0, roughness = "d/30" }
method.flow.model = "waves"
"""
SEEDS_IN_WATER = """
fluid.kind = "water"
grain = { diameter = 1e-3, density = 2650.0 }
bed = { kind = "pile", slope_deg = 15.0, height = 0.02, packing = "disordered" }
method = { kind = "peeling", flow = { model = "waves" } }
axes = { "bed.seed" = [1, 2, 3] }
"""


def _ends(results: Results) -> tuple[float, float, float, float]:
    """The threshold and interval at 30 %, and those of the first grains, as told."""
    row = seeds_as_one(results.at_fraction).iloc[0]
    told = single.quantity_of_row(row)
    return (
        row[told.column("_low")],
        row[told.column("_high")],
        row[f"first_{told.column('_low')}"],
        row[f"first_{told.column('_high')}"],
    )


@pytest.mark.parametrize("text", [DUNE, SEEDS_IN_WATER], ids=["dune", "seeds"])
def test_card_table_figure_and_csv_have_one_interval(tmp_path: Path, text: str) -> None:
    results = small_study.run(tmp_path, text)
    rows = results.at_fraction
    low, high, first_low, first_high = _ends(results)
    theta_low, theta_high = rows[["shields_low", "shields_high"]].iloc[0]
    # the card
    numbers = answers.card(results).numbers
    shares = [one for one in numbers if "30 %" in one.meaning]
    assert [(one.low, one.high) for one in shares] == [(low, high)]
    firsts = [one for one in numbers if "first motion" in one.meaning]
    firsts = [one for one in firsts if one.unit in ("m/s", "Pa")]
    assert [(one.low, one.high) for one in firsts] == [(first_low, first_high)]
    # the table
    sheet = sheets.short(results)
    assert sheet is not None
    frame = sheet.frame[sheet.frame[sheets.PART] == "30 %"]
    assert len(frame) == 1
    written = labels.interval(theta_low, theta_high)
    assert frame[sheets.TAU_INTERVAL].iloc[0] == written
    (head,) = [name for name in map(str, frame) if name.startswith("interval, ")]
    assert frame[head].iloc[0] == labels.interval(low, high)
    # the bars and what the page says of a point
    with style.settings():
        (figure,) = overview.draw(results)
    assert figure.canvas is not None
    bars = [
        np.asarray(line.get_ydata())
        for ax in figure.canvas.axes
        for line in ax.lines
        if line.get_gid() == "intervals"
    ]
    ends = {float(end) for end in np.concatenate(bars) if np.isfinite(end)}
    assert {theta_low, theta_high} <= ends
    said = [text[1] for group in figure.data.values() for text in group]
    here = [one for one in said if "n/N = 30 %" in one]
    bare = labels.interval(theta_low, theta_high, 4, "g")
    assert len(here) == len(rows)
    assert all(f"({bare})" in one for one in here)


def test_the_card_of_seeds_holds_every_seed(tmp_path: Path) -> None:
    """It had the range of the usable ones' Shields numbers, scaled by their mean u*."""
    results = small_study.run(tmp_path, SEEDS_IN_WATER)
    rows = results.at_fraction
    assert rows["shields"].nunique() == 3
    (number,) = [one for one in answers.card(results).numbers if "30 %" in one.meaning]
    stress = rows["stress_pa"]
    assert number.low <= stress.min() < stress.max() <= number.high
    assert number.low <= rows["stress_low_pa"].min()
    assert rows["stress_high_pa"].max() <= number.high
    assert number.value == pytest.approx(
        1000 * rows["ustar0_m_s"].mean() ** 2, rel=1e-3
    )
    assert "it contains 3 replicates" in number.interval_of
    low, high = number.interval.split(" … ")
    assert low != high


def test_the_first_columns_of_thresholds_are_what_the_page_prints(
    tmp_path: Path,
) -> None:
    results = small_study.run(tmp_path, SEEDS_IN_WATER)
    table = face.Opened(results).thresholds
    first = [*table.columns[:12]]
    for name in ("stress_pa", "stress_low_pa", "stress_high_pa", "interval_of"):
        assert name in first
    assert "ustar0_low_m_s" in first


TWO_BEDS = """
fluid.kind = "water"
grain.density = 2650.0
bed = { kind = "pile", slope_deg = 15.0, height = 0.02 }
axes = { "grain.diameter" = [7e-4, 1e-3] }
"""


@pytest.mark.parametrize("lost", [0, 1])
def test_two_beds_of_which_one_does_not_reach_the_fraction_stay_two(
    tmp_path: Path, lost: int
) -> None:
    both = small_study.run(tmp_path, TWO_BEDS)
    name = both.at_fraction["scene_id"].iloc[lost]
    table = both.tables["pile_threshold"].copy()
    gone = table["scene_id"] == name
    numbers = table.select_dtypes("float").columns.difference(["fraction", "d_m"])
    of_answer = [one for one in numbers if "shields" in one or "ustar0" in one]
    table[of_answer] = table[of_answer].mask(gone)
    table.loc[gone, "usable"] = False
    table.loc[gone, "why_not"] = "not reached: at most 12% of 20 grains moved"
    results = Results(
        both.study, both.plan, {**both.tables, "pile_threshold": table}, both.cases
    )
    card = answers.card(results)
    assert (
        card.question
        == "At what flow does a pile start to move, and where, by diameter?"
    )
    said = " ".join(" ".join(lines(card)).split())
    # the one that reached it is named by what tells it from the other
    told, other = (subjects.length([1e-3, 7e-4][place]) for place in (lost, 1 - lost))
    assert f"d = {told}" in said
    assert f"d = {other}" not in said
    assert "replicates" not in said
    assert "4 of 8 thresholds" in said
    # nor is the lost bed drawn as a replicate
    row = results.exemplars.iloc[0]
    assert seeds_of(row, results.at_fraction) == []


def test_the_interval_of_a_size_class_holds_that_of_its_bed() -> None:
    """Ten grains of one bed are not known better than the bed."""
    bed = {"scene_id": "a", "fraction": 0.3, "shields": 0.05}
    beds = pd.DataFrame([{**bed, "shields_low": 0.035, "shields_high": 0.1}])
    few = {"scene_id": "a", "fraction": 0.3, "shields_own": 0.04}
    classes = pd.DataFrame(
        [
            {**few, "shields_own_low": 0.039, "shields_own_high": 0.042},
            {**few, "shields_own_low": 0.010, "shields_own_high": 0.200},
            {**few, "shields_own_low": math.nan, "shields_own_high": 0.042},
        ]
    )
    wider = of_classes(classes, beds)
    assert wider["shields_own_low"].tolist() == pytest.approx(
        [0.028, 0.010, math.nan], nan_ok=True
    )
    assert wider["shields_own_high"].tolist() == pytest.approx([0.08, 0.2, 0.08])
    unknown = of_classes(classes, beds.assign(shields_high=math.nan))
    assert unknown["shields_own_high"].isna().all()
