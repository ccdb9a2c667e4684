"""Hours a year by place: exact winds, exact shares, a bed by linear theory."""

import io
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator import cli, pipeline
from orchestrator.grains.places import DunePlace, places_of
from orchestrator.hours.places import hours_above
from orchestrator.physics.velocity import outer_roughness
from orchestrator.report.by_place import places_sheet
from orchestrator.report.results import Results
from orchestrator.runs.workspace import Workspace
from orchestrator.study.parts import Obstacle
from orchestrator.study.wind import Winds

STUDY = """\
[fluid]
kind = "air"
[grain]
density = 2650.0
diameter = 3e-4
[bed]
kind = "pile"
profile = "hump.csv"
[method]
kind = "local"
[method.flow]
model = "waves"
"""
WINDS = """\
from_deg,speed_m_s,share
270,6,0.2
300,9,0.1
240,12,0.04
90,20,0.3
0,0,0.36
"""


def test_winds_along_the_section_and_above_the_speed_count() -> None:
    rows = (
        (270.0, 8.0, 0.1),
        (315.0, 8.0, 0.02),
        (316.0, 8.0, 0.03),
        (225.0, 7.9, 0.04),
        (90.0, 30.0, 0.5),
        (0.0, 0.0, 0.31),
    )
    winds = Winds(rows, 10.0, "")
    assert hours_above(winds, 270.0, 8.0) == pytest.approx(8760 * 0.12)
    assert hours_above(winds, 270.0, 7.0) == pytest.approx(8760 * 0.16)
    assert hours_above(winds, 270.0, 0.0) == pytest.approx(8760 * 0.16)
    assert hours_above(winds, 270.0, math.inf) == 0
    # over north
    assert hours_above(winds, 350.0, 8.0) == pytest.approx(8760 * 0.05)


def test_a_part_of_a_place_is_a_part_of_its_length() -> None:
    place = DunePlace("foot", np.array([0.5, 0.2, np.inf]), np.array([1.0, 2.0, 1.0]))
    assert [place.at(part) for part in (0.1, 0.5, 0.6, 0.75)] == [0.2, 0.2, 0.5, 0.5]
    assert place.at(0.9) == math.inf


def test_places_are_ranges_of_the_bed_and_of_the_height_of_its_windward_side(
    tmp_path: Path,
) -> None:
    """A form 2 m high, whose toe is at x = 3 m, whose crest is 8 m behind it."""
    s = np.arange(-15.0, 16.0)
    z = 0.5 + np.interp(s, [0.0, 8.0, 12.0], [0.0, 2.0, 0.0])
    stress = SimpleNamespace(
        s_m=s,
        x_m=s + 3,
        z_m=z,
        length_m=np.where(s < -5, 1.0, 2.0),
        ustar_over_ustar0_wall=np.where(s < -5, -0.5, 2.0),
    )
    fence = Obstacle(kind="fence", x=0.0, height=1.5)
    bed = SimpleNamespace(height=2.0, obstacles=(fence,))
    model = SimpleNamespace(line=SimpleNamespace(crest_s=8.0))
    pile = SimpleNamespace(model=model, bed=bed, stress=lambda _: stress)
    grains = pd.DataFrame({"s_m": [1.0, 3.0, 7.0, 11.0, 15.0]})
    grains["ustar0_m_s"] = [0.5, 0.4, 0.3, 0.2, 0.1]
    beach, foot, slope, brink = places_of(cast(Any, pile), grains, 0.25, tmp_path)
    # five heights of it, but for what is within the reach of the fence, at s = -3 m
    assert beach.length.tolist() == [1.0] * 5 + [2.0] * 4
    # where the wind is half as strong, u*0 has to be twice as large
    assert beach.ustar0.tolist() == [0.5] * 5 + [0.125] * 4
    assert [foot.name, slope.name, brink.name] == ["foot", "slope", "brink"]
    # grains behind the crest are in no place
    assert [each.ustar0.tolist() for each in (foot, slope, brink)] == [
        [0.5],
        [0.4],
        [0.3],
    ]


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of a hump."""
    folder = tmp_path_factory.mktemp("hours")
    rows = ["x_m,z_m"]
    for place in np.linspace(0, 30, 121):
        rows.append(f"{place},{0.6 * math.exp(-(((place - 15) / 4) ** 2)):.5f}")
    (folder / "hump.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    (folder / "winds.csv").write_text(WINDS, encoding="utf-8")
    out = folder / "out"
    words = ["study", str(folder / "study.toml"), "--out", str(out), "--workers", "1"]
    assert cli.main(words) == 0
    return out


def hours(directory: Path, *words: str) -> list[str]:
    """The words of the command on a directory."""
    winds = directory.parent / "winds.csv"
    return ["hours", str(directory), "--wind", str(winds), "--from", "270", *words]


def table(
    directory: Path, capsys: pytest.CaptureFixture[str], *words: str
) -> pd.DataFrame:
    """The places of the hump with their winds and hours."""
    assert cli.main(hours(directory, "--csv", *words)) == 0
    return pd.read_csv(io.StringIO(capsys.readouterr().out)).set_index("place")


def test_each_place_has_its_wind_and_its_hours_with_the_interval(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    places = table(directory, capsys)
    assert [*places.index] == ["beach", "foot", "slope", "brink"]
    # the flow grows up the hump: the brink moves first
    winds = places["wind_half_m_s"]
    assert winds["brink"] < winds["slope"] < winds["foot"]
    for _, row in places.iterrows():
        for end, other in (("", ""), ("_low", "_high"), ("_high", "_low")):
            speed = row[f"wind_half{other}_m_s"]
            share = 0.2 * (speed <= 6) + 0.1 * (speed <= 9) + 0.04 * (speed <= 12)
            assert row[f"hours_half{end}"] == pytest.approx(8760 * share)
        assert row["hours_half_low"] <= row["hours_half"] <= row["hours_half_high"]
        assert row["wind_a_tenth_m_s"] <= row["wind_half_m_s"]


def test_the_winds_are_those_of_the_tables(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    places = table(directory, capsys)
    read = {
        name: pd.read_csv(directory / "tables" / f"{name}.csv")
        for name in ("pile_grain", "pile_threshold", "scenes")
    }
    threshold = read["pile_threshold"].iloc[0]
    scene = read["scenes"].iloc[0]

    def wind(ustar: float) -> float:
        z0 = outer_roughness(scene["z0_m"], ustar, scene["nu_m2_s"])
        return float(ustar / 0.41 * np.log1p(10 / z0))

    grains = read["pile_grain"]
    # the top quarter of the height of the hump, whose sand lies close to evenly
    is_top = np.exp(-(((grains["x_m"] - 15) / 4) ** 2)) >= 0.75
    for part, share in (("a_tenth", 0.1), ("half", 0.5)):
        ustar = float(np.quantile(grains["ustar0_m_s"][is_top], share))
        found = places[f"wind_{part}_m_s"]["brink"]
        assert found == pytest.approx(wind(ustar), rel=0.003)
    factor = threshold["ustar0_high_m_s"] / threshold["ustar0_m_s"]
    half = places.loc["brink", ["wind_half_m_s", "wind_half_high_m_s"]]
    assert half.iloc[1] / half.iloc[0] == pytest.approx(factor, rel=0.01)
    # the beach is nearly level ground in the wind of the approach
    level = wind(threshold["level_ustar_m_s"])
    assert places["wind_half_m_s"]["beach"] == pytest.approx(level, rel=0.05)


def test_rougher_ground_at_the_anemometer_needs_a_weaker_wind(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    bare = table(directory, capsys)
    rough = table(directory, capsys, "--ground-roughness", "1e-3")
    assert (rough["wind_half_m_s"] < bare["wind_half_m_s"]).all()
    assert (rough["hours_half"] >= bare["hours_half"]).all()


def test_the_wind_is_that_at_the_height_of_the_anemometer(
    directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    at_ten = table(directory, capsys)
    low = tmp_path / "low.csv"
    low.write_text(WINDS.replace("\n", ",2\n").replace("share,2", "share,z_m"))
    words = ["hours", str(directory), "--wind", str(low), "--from", "270", "--csv"]
    assert cli.main(words) == 0
    at_two = pd.read_csv(io.StringIO(capsys.readouterr().out)).set_index("place")
    assert (at_two["wind_half_m_s"] < 0.9 * at_ten["wind_half_m_s"]).all()


def test_winds_that_are_likelier_in_another_unit_are_asked_about(
    directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    strong = tmp_path / "strong.csv"
    strong.write_text("from_deg,speed_m_s,share\n270,36,0.75\n90,18,0.25\n")
    words = ["hours", str(directory), "--wind", str(strong), "--from", "270"]
    assert cli.main(words) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "strong.csv is 31.5 m/s in the mean: did you mean km/h, 8.75 m/s?" in said
    assert cli.main(hours(directory)) == 0
    assert "did you mean" not in capsys.readouterr().err


def test_each_bed_has_the_winds_of_its_own_grains(
    directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    axes = '[axes]\n"grain.diameter" = [3e-4, 6e-4]\n'
    text = STUDY.replace("diameter = 3e-4\n", "")
    file = directory.parent / "two.toml"
    file.write_text(text + axes)
    out = tmp_path / "two"
    words = ["study", str(file), "--out", str(out), "--workers", "1"]
    assert cli.main(words) == 0
    capsys.readouterr()
    winds = str(directory.parent / "winds.csv")
    assert cli.main(["hours", str(out), "--wind", winds, "--from", "270", "--csv"]) == 0
    both = pd.read_csv(io.StringIO(capsys.readouterr().out))
    alone = table(directory, capsys)
    fine, coarse = (part for _, part in both.groupby("scene_id", sort=False))
    assert fine["wind_half_m_s"].tolist() == alone["wind_half_m_s"].tolist()
    assert (
        coarse["wind_half_m_s"].to_numpy() > 1.1 * fine["wind_half_m_s"].to_numpy()
    ).all()


def test_people_read_places_and_what_is_not_counted(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(hours(directory)) == 0
    text = capsys.readouterr().out
    assert "2978 hours have wind from 270° ± 45°" in text
    assert "2628 from elsewhere are not counted" in text
    for place in ("beach", "foot", "slope", "brink"):
        assert f" {place} " in text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--from", "400"], "--from: 400 is no direction"),
        (["--ground-roughness", "0"], "--ground-roughness: 0 is no length above 0"),
        (["--wind", "no.csv"], "--wind no.csv: not a readable text file"),
    ],
)
def test_what_is_no_wind_is_refused(
    words: list[str], said: str, directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(hours(directory, *words)) == 2
    assert said in capsys.readouterr().err


def test_the_page_has_the_thresholds_of_the_same_places(
    directory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    places = table(directory, capsys)
    opened = orchestrator.open(directory)
    space = Workspace(directory)
    study, plan = pipeline.reopen(space)
    results = Results(study, plan, opened.tables, space.cases)
    sheet = places_sheet(results)
    assert sheet is not None
    told = sheet.frame.set_index("place")
    assert [*told.index] == [*places.index]
    for part, column in (("a tenth", "a_tenth"), ("half", "half")):
        for place, (_, row) in zip(
            sheet.frame["place"], places.iterrows(), strict=True
        ):
            assert float(told[f"{part} at, m/s"][place]) == pytest.approx(
                row[f"wind_{column}_m_s"], rel=0.01
            )
            ends = told[f"interval of {part}, m/s"][place].split(" … ")
            assert [float(end) for end in ends] == pytest.approx(
                [row[f"wind_{column}{end}_m_s"] for end in ("_low", "_high")], rel=0.01
            )
    html = opened.page.read_text(encoding="utf-8")
    assert sheet.title in html
    assert sheet.title in opened.answer
