"""What the page of a measured profile says in the x of its file."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.fidelity import limits
from orchestrator.report import answers, remarks, sheets
from orchestrator.report.results import Results
from orchestrator.study import study
from tests import small_study
from tests.report.conftest import changed

BEACH = [(112.4, 0.0), (162.4, 1.25), (187.4, 7.25), (198.4, 1.25), (232.4, 1.25)]
"""A beach of 1:40, a dune of 6 m on it, x and z in m."""
TEXT = """
fluid.kind = "air"
grain = {{ diameter = 2.5e-4, density = 2650.0 }}
bed = {{ kind = "pile", profile = "own.csv"{more} }}
flow.towards = "{towards}"
method.flow.model = "flat"
[profiles]
"own.csv" = '''
x_m,z_m
{points}
'''
"""


def _text(towards: str = "+x", start: float = 0.0, more: str = "") -> str:
    x, z = np.transpose(BEACH)
    places = np.arange(112.4, 232.41, 0.4)
    heights = np.interp(places, x, z)
    if towards == "-x":
        places = 344.8 - places[::-1]
        heights = heights[::-1]
    rows = [f"{a + start:.1f},{b:.4f}" for a, b in zip(places, heights, strict=True)]
    return TEXT.format(towards=towards, more=more, points="\n".join(rows))


def _advised(results: Results) -> list[float]:
    """The range that the remark on what is counted advises."""
    told = [each.text for each in remarks.remarks(results) if "counted" in each.head]
    (pair,) = re.findall(r"`bed\.counted = \[([-.\d]+), ([-.\d]+)\]`", " ".join(told))
    return [float(end) for end in pair]


@pytest.mark.parametrize("start", [0.0, 5.6e6])
@pytest.mark.parametrize(
    ("towards", "form"), [("+x", (162.4, 187.4)), ("-x", (157.4, 182.4))]
)
def test_the_range_that_a_card_advises_is_the_form_in_the_x_of_the_file(
    towards: str, form: tuple[float, float], start: float, tmp_path: Path
) -> None:
    results = small_study.run(tmp_path, _text(towards, start))
    advised = _advised(results)
    assert np.subtract(advised, start) == pytest.approx(form, abs=1.0)
    # it can be written into the file as it stands
    followed = _text(towards, start, f", counted = {advised}")
    scene = study.parse(followed, name="own", where="own.toml").scenes[0]
    limits.check(scene, "own.toml")
    assert isinstance(scene.counts, tuple)


def test_a_card_says_which_metres_are_counted(tmp_path: Path) -> None:
    results = small_study.run(tmp_path / "windward", _text())
    windward = answers.card(results).scene
    assert "counted: x = 112 to 187 m" in windward
    heads = [remark.head for remark in remarks.remarks(results)]
    assert "The sides that rise in the wind are counted" in " ".join(heads)
    more = ", counted = [164.0, 186.0]"
    results = small_study.run(tmp_path / "range", _text(more=more))
    assert "counted: x = 164 to 186 m" in answers.card(results).scene
    heads = [remark.head for remark in remarks.remarks(results)]
    assert "A range of the bed is counted: x = 164 to 186 m." in heads


FENCED = """
fluid.kind = "air"
grain = { diameter = 2.5e-4, density = 2650.0 }
bed = { kind = "pile", profile = "own.csv" }
method.kind = "local"
method.flow.first_cell_height = 6e-3
threshold.fractions = [0.1, 0.3]
[axes]
"bed.obstacles" = [[], [{ kind = "fence", x = 114.0, height = 0.05 }]]
[profiles]
"own.csv" = '''
x_m,z_m
POINTS
'''
"""


@pytest.fixture(scope="module")
def fenced(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A beach with a small dune, and the same with a fence."""
    x = np.arange(112.4, 117.01, 0.05)
    corners = [112.4, 114.2, 115.2, 115.6, 117.0]
    z = np.interp(x, corners, [0.0, 0.05, 0.25, 0.05, 0.05])
    rows = "\n".join(f"{a:.2f},{b:.4f}" for a, b in zip(x, z, strict=True))
    text = FENCED.replace("POINTS", rows)
    return small_study.run(tmp_path_factory.mktemp("fenced"), text)


def test_beds_that_are_compared_count_the_same_metres(fenced: Results) -> None:
    """Behind the fence the flow runs back: these places stay in the denominator."""
    grains = fenced.joined("pile_grain")
    assert grains["ustar_over_ustar0"].min() < 0
    places = [part["x_m"] for _, part in grains.groupby("scene_id", sort=False)]
    assert len(places) == 2
    foot = 0.05  # of the fence, which carries no grains
    for first, other in (places, places[::-1]):
        lost = [x for x in first if other.sub(x).abs().min() > 0.02]
        assert all(abs(x - 114.0) < foot for x in lost)
    rows = fenced.joined("pile_threshold").sort_values(["obstacles", "fraction"])
    of_fence, of_bare = np.reshape(rows["ustar0_m_s"].to_numpy(), (2, 2))
    # a fence takes wind from the sand: none of it moves earlier for it
    assert (of_fence >= of_bare).all()


def test_the_page_of_a_fence_says_that_it_is_solid(
    fenced: Results, results: Results
) -> None:
    assert remarks.SOLID_FENCE in remarks.remarks(fenced)
    assert remarks.SOLID_FENCE not in remarks.remarks(results)


def test_a_bed_is_not_called_too_long_where_the_study_asks_for_places(
    fenced: Results,
) -> None:
    table = fenced.tables["pile_threshold"]
    one = changed(
        fenced, pile_threshold=table[table["scene_id"] == table["scene_id"][0]]
    )
    assert "no grains are packed, as the study asks" in answers.card(one).scene
    said = {remark.head: remark.text for remark in remarks.remarks(fenced)}
    told = said["Closed form along the bed line."]
    assert told.startswith("The study asks for a method that packs no grains: ")
    assert not any("too many grains" in text for text in said.values())


def test_a_comparison_says_where_each_bed_starts(fenced: Results) -> None:
    rows = fenced.joined("pile_threshold").drop_duplicates("scene_id")
    sheet = sheets.short(fenced)
    assert sheet is not None
    part = sheet.frame[sheets.PART]
    firsts = sheet.frame[part.str.startswith("first motion")]
    assert firsts[sheets.PART].tolist() == [
        f"first motion at x = {x:.2f} m" for x in rows["first_x_m"]
    ]
    assert firsts["wind at 10 m, m/s"].astype(float).tolist() == pytest.approx(
        [row["first_wind_10m_m_s"] for _, row in rows.iterrows()],
        rel=5e-3,
    )
    # each stands above the shares of its own bed
    assert part.index[part.str.startswith("first")].tolist() == [0, 3]
    assert sheet.frame["obstacles"].nunique() == 2
    usable = changed(
        fenced,
        pile_threshold=fenced.tables["pile_threshold"].assign(usable=True),
        # without ratios it is a range
        paired=pd.DataFrame(),
    )
    first = answers.card(usable).numbers[2]
    least = rows.iloc[int(rows["first_ustar0_m_s"].argmin())]
    assert f"at x = {least['first_x_m']:.2f} m" in first.note
    assert first.value == pytest.approx(least["first_wind_10m_m_s"])


@pytest.mark.parametrize(
    ("error", "is_none"), [(0.02, False), (0.05, True), (np.nan, False)]
)
def test_a_difference_below_the_errors_is_said_to_be_none(
    fenced: Results, error: float, is_none: bool
) -> None:
    """At 30 % the stresses are 4.6 % apart; two errors add by their squares."""
    methods = fenced.tables["methods"].assign(error_estimate=error)
    rows = fenced.tables["pile_threshold"].assign(usable=True, error_estimate=error)
    study_ = changed(
        fenced, methods=methods, pile_threshold=rows, paired=pd.DataFrame()
    )
    assert ("no difference" in answers.card(study_).worth.advice) is is_none
