"""Profiles that users measure: read, smoothed, refused in one line, and whole in a study's text."""

import math
import os
import re
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from orchestrator.bed.line import of_bed
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.study import profile, study
from orchestrator.study.fields import asked
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

GOOD = "x_m,z_m\n0,0\n0.05,0.01\n\n0.1,0.02\n0.14,0\n\n"
STUDY = """
grain = { diameter = 1e-3 }
bed = { kind = "pile", profile = "scan.csv" }
method.flow.model = "flat"
"""


def scene_of(folder: Path, content: str | bytes, text: str = STUDY) -> Scene:
    (folder / "scan.csv").write_bytes(
        content if isinstance(content, bytes) else content.encode()
    )
    return study.parse(text, name="scan", where=str(folder / "study.toml")).scenes[0]


def points(*rows: str) -> str:
    return "\n".join(["x_m,z_m", *rows, ""])


def long(*changed: tuple[int, str]) -> str:
    rows = [f"{0.005 * i:.4g},{0.01 * abs(np.sin(i / 9)):.5f}" for i in range(60)]
    for place, row in changed:
        rows[place] = row
    return points(*rows)


BAD: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "line 1: it is empty"),
    "missing column": (
        "x_m,y_m\n0,0\n1,1\n2,0\n",
        "line 1: no names of columns that are known, in 'x_m,y_m' .*chainage.*level, ",
    ),
    "two columns of a name": (
        "x_m,z_m,x_m\n0,0,0\n",
        "line 1: which column is x_m: x_m or x_m",
    ),
    "unsorted": (
        points("0,0", "2,0.1", "1,0.2", "3,0"),
        "line 4: x does not rise to 1 m",
    ),
    "overhang": (long((30, "0.14,0.02")), "line 32: x does not rise to 0.14 m"),
    "decimal commas": (
        points("0,0", "0,1,0,2", "2,0"),
        "line 3: 4 cells, .*decimal comma",
    ),
    "commas that may be either": (
        "x_m;z_m\n0;0\n1;1,500\n2;0\n",
        "'1,500' may be 1.500 or 1500: write one of them",
    ),
    "commas and points": (
        "x_m;z_m\n0;0\n1;0,5\n1.5;0\n",
        "both '0,5' and '1.5' stand there: which is the decimal mark",
    ),
    "depths": ("chainage,depth\n0,1\n1,2\n", "'chainage,depth' .depths go down"),
    "degrees": ("lon,lat,z\n0,1,2\n", "line 1: .*degrees are no lengths"),
    "stations of hundreds": (
        "station,z\n0+00,0\n0+50,0.5\n1+00,0\n",
        r"line 2: station: 0\+00 may count hundreds of feet or of metres",
    ),
    "a workbook": (b"PK\x03\x04xx", "a workbook of a spreadsheet.*as CSV"),
    **{
        f"not a number: {cell}": (
            points("0,0", f"1,{cell}", "2,0"),
            f"line 3: {message}",
        )
        for cell, message in {
            "nan": "z_m: nan looks like an empty cell",
            "NA": "z_m: NA looks like an empty cell .remove such lines",
            "-": "z_m: - looks like an empty cell .remove such lines",
            "inf": "z_m: inf is not a number up to",
            "1e6": "z_m: 1e.06 is not a number up to",
            "high": "z_m: 'high' is no number",
            "1_0": "z_m: '1_0' is no number",
            "٣": "z_m: '٣' is no number",
            "20 mm": "z_m: '20 mm' is no number: write 0.02, without a unit",
            "": "the cell of z_m is empty",
        }.items()
    },
    "a missing cell": (points("0,0", "1", "2,0"), "line 3: the cell of z_m is empty"),
    "a gap": (
        long((30, "0.9,0.0"), *((i, f"{0.9 + i / 200},0") for i in range(31, 60))),
        "a gap",
    ),
    "too steep": (
        points("0,0", "1,0.1", "1.01,0.9", "3,0"),
        "line 4: 89 deg at x = 1 m, above",
    ),
    "level": (points("0,0.3", "1,0.3", "2,0.3"), "level: it has no height"),
    "too many points": (
        points(*(f"{i},{i % 2}" for i in range(4000))),
        "4000 points, more than",
    ),
    "binary": (b"\x7fELF\0\0\x01\0", "binary, not text"),
    "too large": (b"x_m,z_m\n" + b"0,0\n" * 6_000_000, "larger than 20 MiB"),
}
UNFIT = [
    (
        '"scan.csv" }\nthreshold = { fractions = [0.1, 0.3, 0.1]',
        r"threshold.fractions: 0.1 stands twice .list each value once",
    ),
    (
        '"scan.csv", height = 0.1',
        r"bed.profile: it has its own height \(leave out bed.height",
    ),
    ('"scan.csv", shape = "dune"', "it has its own shape"),
    ('"scan.csv", smoothing = -1.0', "bed.smoothing: -1.0 is not accepted"),
    ('"scan.csv", smoothing = 0.1', r"smoothing over 0.1 m leaves nothing of 0.14 m"),
    ('"scan.csv", smoothing = 1e-300', r"more than the 3000 .*raise bed.smoothing"),
    ('"empty"', "there is no profile in it"),
    ('"pipe"', "not a readable text file"),
    (f'"{"x" * 5000}"', "not a readable text file"),
    ("3", r"bed.profile: 3 is not accepted"),
]


@pytest.mark.parametrize("name", BAD)
def test_a_bad_profile_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, message = BAD[name]
    with pytest.raises(InputError, match=message) as caught:
        scene_of(tmp_path, content)
    assert "\n" not in str(caught.value)
    assert caught.value.remedy


def test_what_does_not_go_with_a_profile_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "empty").mkdir()
    for fields, message in UNFIT:
        with pytest.raises(InputError, match=message):
            scene_of(tmp_path, GOOD, STUDY.replace('"scan.csv"', fields))


def test_a_profile_begins_at_the_origin_between_flat_beds(tmp_path: Path) -> None:
    bed = scene_of(tmp_path, GOOD).bed
    assert isinstance(bed, PileBed)
    line = of_bed(bed)
    assert bed.height == pytest.approx(0.02)
    assert bed.slope_deg == pytest.approx(np.degrees(np.arctan(0.2)), abs=0.005)
    np.testing.assert_allclose(line.x[1:-1], [0, 0.05, 0.1, 0.14])
    assert line.x[0] == pytest.approx(-0.2)


def test_a_scene_is_what_a_profile_holds_and_a_study_is_whole_without_the_file(
    tmp_path: Path,
) -> None:
    scene = scene_of(tmp_path, GOOD)
    shifted = "\n".join(
        ["note,x_m,z_m", "a,1,5", "b,1.05,5.01", "c,1.1,5.02", "d,1.14,5"]
    )
    np.testing.assert_allclose(
        of_bed(scene_of(tmp_path, shifted).bed).x, of_bed(scene.bed).x
    )
    assert scene_of(tmp_path, GOOD.replace("0.02", "0.021")).id != scene.id
    assert scene_of(tmp_path, GOOD.replace("\n", "\r\n")).id == scene.id
    asked = study.parse(STUDY, name="a", where=str(tmp_path / "a.toml"))
    (tmp_path / "scan.csv").unlink()
    again = study.parse(asked.text, name="a", where="elsewhere")
    assert again.scenes[0].id == scene.id
    assert again.text == asked.text


def surveyed(mirrored: bool = False) -> str:
    """A noisy dune with x from 112.4 m and z from 2.29 m, or its image about x = 300 m.

    The wind is towards larger x, of the image towards smaller x.
    """
    x = np.linspace(0, 60, 301)
    z = 2.29 + 0.05 * np.maximum(0, 30 - np.abs(x - 32))
    z += 2e-3 * np.random.default_rng(4).standard_normal(len(x))
    x += 112.4
    if mirrored:
        x, z = 600 - x[::-1], z[::-1]
    rows = zip(x.tolist(), z.tolist(), strict=True)
    return points(*(f"{a:.3f},{b:.5f}" for a, b in rows))


TOWARDS = """
grain = {{ diameter = 1e-3 }}
flow.towards = "{towards}"
method.flow.model = "waves"
[bed]
kind = "pile"
profile = "scan.csv"
smoothing = 1.0
counted = {counted}
obstacles = [{{ kind = "fence", x = {fence}, height = 0.1 }}]
"""


def test_a_profile_is_its_mirror_image_in_the_opposite_wind(tmp_path: Path) -> None:
    scenes = []
    for mirrored, places in (
        (False, ("[130, 140.5]", 120)),
        (True, ("[459.5, 470]", 480)),
    ):
        text = TOWARDS.format(
            counted=places[0], fence=places[1], towards="-x" if mirrored else "+x"
        )
        scenes.append(scene_of(tmp_path, surveyed(mirrored), text))
    one, other = scenes
    assert isinstance(one.bed, PileBed)
    assert isinstance(other.bed, PileBed)
    assert one.bed == other.bed
    assert one.bed.profile
    assert other.bed.profile
    assert one.bed.profile.x == other.bed.profile.x
    assert one.bed.profile.z == other.bed.profile.z
    assert (one.bed.profile.origin[0], other.bed.profile.origin[0]) == (112.4, 487.6)
    assert one.bed.counts == (17.6, 28.1)
    # what is told has x of the file
    assert (asked(one)["counted"], asked(other)["counted"]) == (
        "130.0; 140.5",
        "459.5; 470.0",
    )
    assert "at x = 480 m" in str(asked(other)["obstacles"])
    np.testing.assert_allclose(one.bed.place([0, 60]), [112.4, 172.4])
    np.testing.assert_allclose(other.bed.place([0, 60]), [487.6, 427.6])
    np.testing.assert_allclose(other.bed.along(other.bed.place([3.0, 7.5])), [3, 7.5])


def test_the_wind_towards_smaller_x_is_of_profiles(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"flow.towards: 'west' is not accepted"):
        scene_of(tmp_path, GOOD, STUDY + 'flow.towards = "west"\n')
    pile = 'grain = { diameter = 1e-3 }\nbed.kind = "dune"\nbed.slope_deg = 9.0\nflow.towards = "-x"\n'
    with pytest.raises(InputError, match=r"flow.towards: it has an effect on profiles"):
        scene_of(tmp_path, GOOD, pile)


def test_a_refusal_has_x_of_the_file(tmp_path: Path) -> None:
    steep = points("412,2", "413,2.1", "413.01,2.9", "415,2")
    for towards, place in (("+x", 413), ("-x", 413.01)):
        text = STUDY + f'flow.towards = "{towards}"\n'
        with pytest.raises(InputError, match=f"89 deg at x = {place} m, above"):
            scene_of(tmp_path, steep, text)


@pytest.mark.parametrize(
    "header",
    [
        "Easting (m),Elevation (m)",
        "point,chainage_m,height_m",
        "distance,z",
        "STATION [m],Level",
        "x,altitude",
    ],
)
def test_surveyors_may_call_the_columns_as_they_do(header: str, tmp_path: Path) -> None:
    rows = GOOD.splitlines()[1:]
    if header.startswith("point"):
        rows = [f"a,{row}" if row else "" for row in rows]
    content = "\n".join([header, *rows, ""])
    assert scene_of(tmp_path, content).id == scene_of(tmp_path, GOOD).id


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("easting,northing,z", "which column is x_m: easting or northing. Name that"),
        ("x_mm,z,n", r"x_mm is in mm, and z names no unit .*: z \(m\), z \(ft\)"),
    ],
)
def test_a_column_that_may_be_another_is_asked_about(
    header: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=f"line 1: {message}"):
        scene_of(tmp_path, f"{header}\n0,0,0\n1,1,1\n")


def test_places_on_a_map_may_be_large(tmp_path: Path) -> None:
    content = points("5412345.2,0", "5412345.25,0.01", "5412345.3,0.02", "5412345.34,0")
    assert scene_of(tmp_path, content).id == scene_of(tmp_path, GOOD).id


def test_noise_is_smoothed_and_the_ends_stay() -> None:
    x = np.linspace(0, 1, 10_000)
    hill = 0.02 * np.exp(-(((x - 0.5) / 0.1) ** 2))
    noisy = hill + 1e-4 * np.random.default_rng(1).standard_normal(len(x))
    rows = points(
        *(f"{a!r},{b!r}" for a, b in zip(x.tolist(), noisy.tolist(), strict=True))
    )
    smooth = profile.read_profile(rows, "scan", "scan", 0.02)
    assert len(smooth.x) < 300
    exact = np.interp(np.array(smooth.x), x, hill)
    assert np.abs(np.array(smooth.z) - exact + noisy[0]).max() < 4e-4
    assert smooth.x[-1] == pytest.approx(1.0)


def test_points_nearer_than_mesh_or_grains_can_follow_are_refused(
    tmp_path: Path,
) -> None:
    """A second point 1e-6 m from another once took a fifth of the stress away."""
    for distance, flow, near in (
        (2e-5, "solve", 1),
        (2e-5, "flat", 1),
        (1e-4, "solve", 0),
    ):
        second = f"{0.05 + distance!r},{0.01 + 0.2 * distance!r}"
        content = points("0,0", "0.05,0.01", second, "0.1,0.02", "0.14,0")
        text = STUDY.replace('"flat"', f'"{flow}"').replace("1e-3", "3e-4")
        refused = pytest.raises(
            InputError, match=r"bed.profile: points at x = 0.05.* nearer"
        )
        with refused if near else nullcontext():
            scene_of(tmp_path, content, text)


def dune(noise: float = 0.0, lee_deg: float = 30.0) -> str:
    """A dune of 60 m, 3 m high and at most 6.9 degrees steep, with noise of some metres."""
    x = np.linspace(0, 60, 301)
    side = 1.5 * (1 - np.cos(np.pi * np.clip((x - 5) / 38.73, 0, 1)))
    z = np.minimum(side, np.maximum(3 - (x - 43.73) * np.tan(np.radians(lee_deg)), 0))
    z += noise * np.random.default_rng(4).standard_normal(len(x))
    rows = zip(x.tolist(), z.tolist(), strict=True)
    return points(*(f"{a:.3f},{b:.5f}" for a, b in rows))


def test_what_is_counted_on_a_profile_never_depends_on_its_slopes(
    tmp_path: Path,
) -> None:
    """Smoothing a little more once took the slip face below 30 degrees, and the lee was counted."""
    for smoothing in (0.0, 1.2, 1.5, 3.0):
        text = STUDY.replace('"scan.csv"', f'"scan.csv", smoothing = {smoothing}')
        for lee_deg in (29.0, 31.0):
            scene = scene_of(tmp_path, dune(0.015, lee_deg), text)
            assert isinstance(scene.bed, PileBed)
            assert scene.bed.counts == "windward"
            assert asked(scene)["counted"] == "windward"


def test_the_slope_of_a_profile_is_not_that_of_its_noise(tmp_path: Path) -> None:
    """It was the steepest of two neighbouring points: 22 degrees of this dune."""
    (low, high) = (6.9, 7.6)
    for noise in (0.0, 0.015):
        bed = scene_of(tmp_path, dune(noise)).bed
        assert low < bed.slope_deg < high


@pytest.mark.parametrize("slope_deg", [3.0, 15.0, 30.0, 45.0, 55.0])
def test_the_slope_of_a_straight_side_is_its_own(
    slope_deg: float, tmp_path: Path
) -> None:
    side = 0.02 / math.tan(math.radians(slope_deg))
    bed = scene_of(tmp_path, points("0,0", f"{side!r},0.02", f"{2 * side!r},0")).bed
    assert bed.slope_deg == slope_deg


def test_a_profile_that_is_level_but_for_round_off_is_refused_for_its_height(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError, match=r"bed\.height: 0\.0 is not accepted"):
        scene_of(tmp_path, points("0,0", "0.05,1e-13", "0.1,0"))


AWAY = points(
    *(f"{112.4 + 0.1 * i:.2f},{0.1 * np.sin(i / 6.4):.5f}" for i in range(21))
)
"""A form of 2 m whose x begins at 112.4 m."""


@pytest.mark.parametrize("towards", ["+x", "-x"])
@pytest.mark.parametrize("method", ["auto", "local", "pivot", "dem"])
@pytest.mark.parametrize(
    ("field", "message"),
    [
        (
            "counted = [5.0, 34.0]",
            "m is not on the bed, which is from x = 112.4 to 114.4 m (choose a place",
        ),
        (
            "counted = [113.0, 120.0]",
            "bed.counted: 120 m is not on the bed, which is from x = 112.4 to 114.4 m",
        ),
        (
            "counted = [114.0, 113.0]",
            "bed.counted: from x = 114 to 113 m there is no bed",
        ),
        (
            "counted = [113.0, 113.0]",
            "bed.counted: from x = 113 to 113 m there is no bed",
        ),
        (
            'obstacles = [{ kind = "fence", x = 50.0, height = 0.01 }]',
            "bed.obstacles: 50 m is not on the bed, which is from x = 112.4 to 114.4 m",
        ),
    ],
)
def test_what_is_not_on_a_profile_is_refused_in_one_line(
    field: str, message: str, method: str, towards: str, tmp_path: Path
) -> None:
    # an obstacle stands in no undisturbed flow
    text = STUDY.replace('"flat"', '"waves"')
    text = text.replace('"scan.csv"', f'"scan.csv", {field}')
    text += f'method.kind = "{method}"\nflow.towards = "{towards}"\n'
    scene = scene_of(tmp_path, AWAY, text)
    with pytest.raises(InputError, match=re.escape(message)):
        limits.check(scene, "study.toml")


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered", "poured"])
@pytest.mark.parametrize(
    ("counted", "message"),
    [
        ((5.0, 34.0), "5 m is not on the bed, which is from x = 0 to 0.08959"),
        ((0.01, 34.0), "34 m is not on the bed, which is from x = 0 to 0.08959"),
        ((-0.1, 0.01), "-0.1 m is not on the bed"),
        ((0.03, 0.01), "from x = 0.03 to 0.01 m there is no bed"),
    ],
)
def test_what_is_not_on_a_shape_is_refused_alike(
    packing: str, counted: tuple[float, float], message: str
) -> None:
    text = f"""
    grain = {{ diameter = 1e-3 }}
    bed = {{ kind = "dune", slope_deg = 20.0, height = 0.02, packing = "{packing}", counted = {[*counted]} }}
    """
    scene = study.parse(text, name="dune", where="dune.toml").scenes[0]
    with pytest.raises(InputError, match=f"bed.counted: {re.escape(message)}"):
        limits.check(scene, "dune.toml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({30: "5123447.48,0.1"}, r"x does not rise to 5123447\.48 m"),
        ({30: "5123447.61,9"}, r"deg at x = 5123447\.[56]\d* m"),
        (dict.fromkeys(range(20, 50), ""), r"a gap of 3\.1 m after x = 5123446\.5 m"),
    ],
)
def test_a_northing_is_told_to_the_centimetre(
    tmp_path: Path, change: dict[int, str], message: str
) -> None:
    rows = [f"{5123444.6 + n / 10:.2f},{0.01 * min(n, 60 - n):.3f}" for n in range(60)]
    for place, row in change.items():
        rows[place] = row
    with pytest.raises(InputError, match=message):
        scene_of(tmp_path, points(*filter(None, rows)))


IN_UNITS = {
    "x_ft,z_ft": (0.3048, 0.3048, "in ft (1 ft = 0.3048 m)"),
    "Station (ft),Elevation (ft NAVD88)": (0.3048, 0.3048, "levels above NAVD88"),
    "Distance [in],Height [in]": (0.0254, 0.0254, "in in (1 in = 0.0254 m)"),
    "x_m,z_mm": (1.0, 1e-3, "x in m, z in mm (1 mm = 0.001 m)"),
    "Abstand in cm;Höhe in cm": (0.01, 0.01, "in cm (1 cm = 0.01 m)"),
    "Chainage (km),Level (mAOD)": (1000.0, 1.0, "x in km (1 km = 1000 m), z in m"),
    "x (us ft),Elevation (NAVD88 us ft)": (1200 / 3937, 1200 / 3937, "0.3048006"),
    "# Units: US survey feet\nx,z": (1200 / 3937, 1200 / 3937, "0.3048006 m)"),
    "all lengths in mm\nx,z": (1e-3, 1e-3, "in mm (1 mm = 0.001 m)"),
    "Station-ft,Existing Grade-ft": (0.3048, 0.3048, "in ft (1 ft = 0.3048 m)"),
    "Distance (″);Height (″)": (0.0254, 0.0254, "in ″ (1 ″ = 0.0254 m)"),
    "x,z\nft,in": (0.3048, 0.0254, "x in ft (1 ft = 0.3048 m), z in in"),
}


@pytest.mark.parametrize("head", IN_UNITS)
def test_units_of_columns_are_applied_and_said(head: str, tmp_path: Path) -> None:
    along, up, said = IN_UNITS[head]
    places = ((0.0, 0.0), (0.05, 0.01), (0.1, 0.02), (0.14, 0.0))
    mark = ";" if ";" in head else ","
    rows = [f"{x / along!r}{mark}{z / up!r}" for x, z in places]
    bed = scene_of(tmp_path, "\n".join([head, *rows, ""])).bed
    assert isinstance(bed, PileBed)
    assert bed.profile
    assert bed.profile.x == pytest.approx([x for x, _ in places], abs=1e-9)
    assert bed.profile.z == pytest.approx([z for _, z in places], abs=1e-9)
    assert said in bed.profile.understood
    assert "x 0 to 0.14 m, z 0 to 0.02 m" in bed.profile.understood


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("x_ft,z", r"line 1: x_ft is in ft, and z names no unit"),
        ("# Units: feet\nx (m),z (m)", "line 2: which unit: feet and m stand in"),
        ("# Units: feet\n# Units: m\nx,z", "line 3: which unit: feet and m stand"),
        ("# heights in feet\nx,z", "line 2: a line above speaks of feet"),
    ],
)
def test_units_that_are_not_certain_are_asked_about(
    head: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        scene_of(tmp_path, f"{head}\n0,0\n5,1\n10,2\n14,0\n")
    assert "behind its name" in str(caught.value)


def test_lengths_in_lines_above_that_are_no_units_change_nothing(
    tmp_path: Path,
) -> None:
    plain = scene_of(tmp_path, GOOD)
    assert scene_of(tmp_path, "# flown 120 ft above sand of 0.3 mm\n" + GOOD) == plain


def test_stations_of_hundreds_are_read_in_the_unit_of_their_column(
    tmp_path: Path,
) -> None:
    text = "Station (ft),z (ft)\n0+00,0\n0+50,5\n1+00.5,0\n"
    bed = scene_of(tmp_path, text).bed
    assert isinstance(bed, PileBed)
    assert bed.profile
    assert bed.profile.x == pytest.approx([0, 15.24, 30.6324])


def test_names_of_surveyors_in_metres_are_no_other_bed(tmp_path: Path) -> None:
    turned = GOOD.replace("x_m,z_m", "Hochwert (m),Höhe [m]")
    assert scene_of(tmp_path, turned).id == scene_of(tmp_path, GOOD).id


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({20: "0.1,-9999"}, "line 22: z_m: -9999 in 1 point looks like an empty cell"),
        ({20: "-9999,0.01"}, "line 22: x_m: -9999 in 1 point looks like an empty cell"),
        ({20: "-9999,-9999"}, "line 22: x_m: -9999 in 1 point looks"),
        ({20: "0.1,99", 21: "0.105,99"}, "line 22: z_m: 99 in 2 points looks"),
        ({20: "0.1,-999.25"}, "line 22: z_m: -999.25 in 1 point"),
        ({20: "0.1,-32768"}, "line 22: z_m: -32768 in 1 point"),
    ],
)
def test_numbers_that_stand_for_none_are_named(
    change: dict[int, str], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        scene_of(tmp_path, long(*change.items()))
    assert "remove such lines" in str(caught.value)


@pytest.mark.parametrize("foot", ["EOD", "End of file", "---", "NA,NA"])
def test_words_behind_the_points_are_left_out_and_said(
    foot: str, tmp_path: Path
) -> None:
    scene = scene_of(tmp_path, GOOD + foot + "\n")
    assert scene == scene_of(tmp_path, GOOD)
    (tmp_path / "scan.csv").write_text(GOOD + foot + "\n")
    profile_of = study.parse(STUDY, name="a", where=str(tmp_path / "a.toml"))
    said = profile_of.understood["scan.csv"]
    assert said.endswith("1 line of words behind its points left out")


@pytest.mark.parametrize("foot", ["Surveyed 2024-05-01", "Mean,0.01", "Points: 4"])
def test_a_foot_with_numbers_is_to_be_removed(foot: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 8: .*remove the line, if it is no"):
        scene_of(tmp_path, f"{GOOD}{foot}\n")


READ = {
    "Elevation (m NAP)": "Chainage (m),Elevation (m NAP)",
    "Level (mAOD)": "Station,Level (mAOD)",
    "RL": "Ch.,RL",
    "RL (m AHD)": "Offset (m),RL (m AHD)",
    "m NHN": "Stationierung [m];m ü. NHN",
    "z_nap": "x;z_nap",
    "another column": "Distance,Elevation,Remark",
    "a constant offset": "Station,Offset,Elevation",
}


@pytest.mark.parametrize("name", READ)
def test_levels_are_known_with_their_datum(name: str, tmp_path: Path) -> None:
    head = READ[name]
    mark = ";" if ";" in head else ","
    lines = [head]
    for row in GOOD.splitlines()[1:]:
        cells = row.split(",")
        if len(cells) < 2:
            continue
        if "Offset," in head:
            cells.insert(1, "0.0")
        if "Remark" in head:
            cells.append("wet sand")
        lines.append(mark.join(cells))
    scene = scene_of(tmp_path, "\n".join(lines) + "\n")
    assert scene.id == scene_of(tmp_path, GOOD).id
    profile = scene_of(tmp_path, "\n".join(lines)).bed.profile  # type: ignore[union-attr]
    assert profile is not None
    datum = {"NAP": "NAP", "AOD": "AOD", "AHD": "AHD", "NHN": "NHN", "nap": "NAP"}
    for word, told in datum.items():
        if word in head:
            assert f"levels above {told}" in profile.understood
    assert "4 points, x 0 to 0.14 m, z 0 to 0.02 m" in profile.understood


def test_a_station_and_an_offset_that_both_vary_are_asked_about(tmp_path: Path) -> None:
    text = "Station,Offset,Elevation\n0,0,0\n1,0.5,0.1\n2,1,0\n"
    with pytest.raises(InputError, match="which column is x_m: Station or Offset"):
        scene_of(tmp_path, text)
    with pytest.raises(InputError, match="which column is x_m: x or y"):
        scene_of(tmp_path, "x,y,z\n0,0,0\n1,0.5,0.1\n2,1,0\n")
    straight = "x,y,z\n0,7,0\n0.05,7,0.01\n0.1,7,0.02\n0.14,7,0\n"
    assert scene_of(tmp_path, straight).id == scene_of(tmp_path, GOOD).id


ALIKE: dict[str, str | bytes] = {
    "decimal commas": "x_m;z_m\n0;0\n0,05;0,01\n0,1;0,02\n0,14;0\n",
    "quoted decimal commas": 'x_m,z_m\n0,0\n"0,05","0,01"\n"0,1","0,02"\n"0,14",0\n',
    "tabs": "x_m\tz_m\n0\t0\n0.05\t0.01\n0.1\t0.02\n0.14\t0\n",
    "blanks": "x_m  z_m\n0  0\n0.05 0.01\n0.1  0.02\n0.14 0\n",
    "a title and a comment": f"# scan of May\nProfile 4\n\n{GOOD}",
    "a line of units": "x,z\nm,m\n0,0\n0.05,0.01\n0.1,0.02\n0.14,0\n",
    "against x": "x_m,z_m\n0.14,0\n0.1,0.02\n0.05,0.01\n0,0\n",
    "stations of kilometres": (
        "Station,z\n1+250.00,0\n1+250.05,0.01\n1+250.10,0.02\n1+250.14,0\n"
    ),
    "thousands": 'x_m,z_m\n"1,000.00",0\n"1,000.05",0.01\n"1,000.10",0.02\n"1,000.14",0\n',
    "UTF-16": GOOD.encode("utf-16"),
    "Latin 1": "x_m,z_m,Höhe über\n0,0,\n0.05,0.01,\n0.1,0.02,\n0.14,0,\n".encode(
        "cp1252"
    ),
    "empty cells at the ends": "x_m,z_m,,\n0,0,,\n0.05,0.01,,\n0.1,0.02,,\n0.14,0,,\n,,,\n",
    "a minus sign of a typesetter": (
        "x_m,z_m\n0,−0.01\n0.05,0\n0.1,0.01\n0.14,−0.01\n"
    ),
}


@pytest.mark.parametrize("name", ALIKE)
def test_a_profile_is_read_as_instruments_write_it(name: str, tmp_path: Path) -> None:
    assert scene_of(tmp_path, ALIKE[name]).id == scene_of(tmp_path, GOOD).id


def test_a_refusal_lists_the_names_that_are_known(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        scene_of(tmp_path, "way,up\n0,0\n1,1\n")
    message = str(caught.value)
    for name in ("chainage", "station", "offset", "elevation", "rl", "Level (mAOD)"):
        assert name in message


def test_a_study_file_may_be_of_any_unicode_and_no_other(tmp_path: Path) -> None:
    (tmp_path / "scan.csv").write_text(GOOD)
    source = tmp_path / "s.toml"
    source.write_bytes(STUDY.encode("utf-16"))
    assert study.load(str(source)).scenes[0].id == scene_of(tmp_path, GOOD).id
    source.write_bytes(f"title = 'Düne'\n{STUDY}".encode("cp1252"))
    message = r"s.toml: line 1: its text has a letter that is not in UTF-8 .save the file as UTF-8"
    with pytest.raises(InputError, match=message):
        study.load(str(source))
    source.write_bytes(STUDY.encode("utf-16")[:-1])
    message = r"a letter that is not in UTF-16 .save the file as UTF-8"
    with pytest.raises(InputError, match=message):
        study.load(str(source))
