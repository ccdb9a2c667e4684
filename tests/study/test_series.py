"""A folder of profiles is a series of beds."""

from pathlib import Path

import pandas as pd
import pytest

import orchestrator
from orchestrator import cli
from orchestrator.errors import InputError
from orchestrator.study.source import beds_in, digests_now
from orchestrator.study.study import load, parse

STUDY = """\
[fluid]
kind = "air"
[grain]
density = 2650.0
diameter = 3e-4
[bed]
kind = "pile"
profile = "sections"
[method]
kind = "local"
[method.flow]
model = "waves"
"""
HEIGHTS = {"km1.csv": 0.4, "km2.csv": 0.9, "km10.csv": 0.6}
"""Height of the crest of each profile, m."""


def write_profile(path: Path, height: float) -> None:
    """Write a triangle that rises over 10 m and falls over 10 m."""
    rows = ["x_m,z_m"]
    for x in range(41):
        rows.append(f"{x / 2},{height * (1 - abs(x / 2 - 10) / 10):.6f}")
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A study file beside a folder of profiles, and of what is none."""
    folder = tmp_path / "sections"
    folder.mkdir()
    for name, height in HEIGHTS.items():
        write_profile(folder / name, height)
    (folder / "README.md").write_text("sections", encoding="utf-8")
    (folder / ".hidden.csv").write_text("no", encoding="utf-8")
    made = tmp_path / "series.toml"
    made.write_text(STUDY, encoding="utf-8")
    return made


def test_each_profile_of_a_folder_is_a_bed_in_the_order_of_its_number(
    file: Path,
) -> None:
    scenes = load(file).scenes
    names = [str(scene.bed.profile).split()[0] for scene in scenes]  # type: ignore[union-attr]
    assert names == ["km1.csv", "km2.csv", "km10.csv"]
    heights = [scene.bed.height for scene in scenes]  # type: ignore[union-attr]
    assert heights == pytest.approx([0.4, 0.9, 0.6])


def test_a_series_is_the_axis_of_its_files(file: Path) -> None:
    listed = STUDY.replace('profile = "sections"\n', "")
    listed += '[axes]\n"bed.profile" = ["sections/km1.csv", "sections/km10.csv"]\n'
    axis = file.with_name("axis.toml")
    axis.write_text(listed, encoding="utf-8")
    ids = [scene.id for scene in load(file).scenes]
    assert [scene.id for scene in load(axis).scenes] == [ids[0], ids[2]]
    mixed = listed.replace('"sections/km1.csv", "sections/km10.csv"', '"sections"')
    axis.write_text(mixed, encoding="utf-8")
    assert [scene.id for scene in load(axis).scenes] == ids


def test_the_text_of_a_study_carries_its_series(file: Path, tmp_path: Path) -> None:
    study = load(file)
    elsewhere = tmp_path / "elsewhere" / "series.toml"
    again = parse(study.text, name="series", where=str(elsewhere))
    assert [one.id for one in again.scenes] == [one.id for one in study.scenes]


def test_a_table_has_a_row_for_each_profile_and_a_new_file_is_answered(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["study", "series.toml", "--workers", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line for line in lines if line.startswith("km")]
    assert [row.split()[0] for row in rows] == [*HEIGHTS]
    assert all("at x = 10.0 m" in row for row in rows)
    winds = orchestrator.open(tmp_path / "results" / "series").thresholds
    at_share = winds[winds["fraction"] == 0.3]
    firsts = at_share["first_wind_10m_m_s"].to_numpy()
    assert [float(row.split()[1]) for row in rows] == pytest.approx(firsts, abs=0.005)
    write_profile(file.parent / "sections" / "km3.csv", 0.5)
    assert cli.main(["study", "series.toml", "--workers", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split()[0] for line in lines if line.startswith("km")]
    assert rows == ["km1.csv", "km2.csv", "km3.csv", "km10.csv"]
    scenes = pd.read_csv(tmp_path / "results" / "series" / "tables" / "scenes.csv")
    assert len(scenes) == 4


def test_the_digest_of_a_folder_is_that_of_the_names_in_it(file: Path) -> None:
    before = digests_now(file.parent, ["sections"])
    assert load(file).source.digests["sections"] == before["sections"]  # type: ignore[union-attr]
    write_profile(file.parent / "sections" / "km11.csv", 0.5)
    assert digests_now(file.parent, ["sections"]) != before
    assert beds_in(file.parent / "sections")[-2:] == ["km10.csv", "km11.csv"]


def test_a_folder_without_profiles_and_a_file_that_is_none_are_refused(
    file: Path,
) -> None:
    folder = file.parent / "sections"
    (folder / "notes.txt").write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"sections/notes\.txt"):
        load(file)
    for path in folder.iterdir():
        path.unlink()
    with pytest.raises(InputError, match=r"bed\.profile.*there is no profile in it"):
        load(file)
