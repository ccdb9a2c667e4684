"""Numbers as users write them: their spelling, and the unit that they are likely in."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from orchestrator import guests
from orchestrator.calculator import PARAMETERS
from orchestrator.calculator.asked import thresholds_and_questions
from orchestrator.calculator.cli import OPTIONS
from orchestrator.errors import InputError
from orchestrator.study import study, units
from orchestrator.study.lengths import LENGTHS
from orchestrator.study.parts import PileBed
from orchestrator.study.source import presets

WATER = "fluid.kind = 'water'\n"
QUARTZ = f"{WATER}grain.density = 2650.0\n"
SAND = f"{QUARTZ}grain.diameter = 1e-3\n"
PILE = "bed = { kind = 'pile', slope_deg = 15.0 }\n"


@pytest.mark.parametrize("text", ["1", "-1.5", ".5", "5.", "1e-3", " 2E5 ", "+3"])
def test_numbers_are_those_of_python(text: str) -> None:
    assert units.number(text) == float(text)


NUMBERS = {
    "0,25": "write 0.25",
    "1,5e-3": "write 1.5e-3",
    "0.25 mm": "write 0.00025, without a unit",
    "250um": "write 0.00025, without a unit",
    "2.65 g/cm3": "write 2650, without a unit",
    "1_0": "'1_0' is no number",
    "١": "'١' is no number",
    "high": "'high' is no number",
    "": "there is no number",
    "1,000,000": "is no number",
    "0x10": "is no number",
    "1.2.3 mm": "is no number",
}


@pytest.mark.parametrize("text", NUMBERS)
def test_other_texts_are_no_numbers(text: str) -> None:
    with pytest.raises(ValueError, match=NUMBERS[text]):
        units.number(text)
    with pytest.raises(ValueError, match=r"whole number|no number"):
        units.whole_number(text)


def test_cobbles_of_a_river_are_not_asked_about() -> None:
    assert units.questions({"grain.diameter": [0.057, 0.09]}, {}) == []
    assert len(units.questions({"grain.diameter": [0.057, 0.1]}, {})) == 1


def _asked(diameter: float, density: float, fluid_density: float) -> str:
    values = {
        "grain.diameter": [1e-3, diameter],
        "grain.density": [density, density],
        "fluid.density": [fluid_density, fluid_density],
    }
    (one,) = units.questions(values, {})
    return one.text


@pytest.mark.parametrize("diameter", [0.1, 0.15, 0.3, 3.0])
def test_riprap_in_a_liquid_is_taken_for_stones(diameter: float) -> None:
    """Sand in millimetres has the same numbers: it is asked about, and never refused."""
    assert f"{diameter:g} m is a stone of" in _asked(diameter, 2650.0, 1000.0)
    for density, fluid_density in ((2650.0, 1.2), (1100.0, 1000.0), (7850.0, 1000.0)):
        assert "stone" not in _asked(diameter, density, fluid_density)
    assert "stone" not in _asked(3.5, 2650.0, 1000.0)
    river = f"{QUARTZ}grain.diameter = {diameter}"
    assert study.parse(river, name="t", where="t").scenes
    confirmed = study.parse(f"units_confirmed = true\n{river}", name="t", where="t")
    assert confirmed.questions == ()


ASKED = {
    # a study, the field and what it is asked, and whether another rule refuses the scene
    f"{QUARTZ}grain.diameter = 0.25\n{PILE}": "0.25 mm, grain.diameter = 0.00025?",
    f"{QUARTZ}grain.diameter = 250.0": "250 mm, grain.diameter = 0.25?",
    f"{QUARTZ}grain.diameter = 0.12": "0.12 mm, grain.diameter = 0.00012?",
    "grain = { diameter = 1e-3, density = 2.65 }": "2.65 g/cm3, grain.density = 2650?",
    f"{WATER}grain = {{ diameter = 1e-3, density = 2.65 }}": "grain.density = 2650?",
    f"{SAND}bed.slope_deg = 0.26": "0.26 rad, bed.slope_deg = 14.9?",
    f"{SAND}{PILE.replace('15.0', '0.2618')}": "0.2618 rad, bed.slope_deg = 15?",
    f"{SAND}bed.entrainment_angle_deg = 1.05": "bed.entrainment_angle_deg = 60.16?",
    f"{SAND}forces.lift_coefficient = 6.46": "forces.lift_coefficient = 1.615?",
    f"{SAND}bed = {{ kind = 'dune', slope_deg = 15.0, lee_slope_deg = 0.52 }}": (
        "0.52 rad, bed.lee_slope_deg = 29.79?"
    ),
    f"{SAND}{PILE}flow = {{ top = 'open water', depth = 400.0 }}": (
        "400 mm, flow.depth = 0.4?"
    ),
    f"{SAND}fluid.gravity = 981.0": "981 cm/s2, fluid.gravity = 9.81?",
    "grain.diameter = 1e-3\nfluid.viscosity = 1.8": "1.8 Pa s, is unusual for 1 kg/m3",
    "grain.diameter = 1e-3\nfluid.density = 1000.0\ngrain.density = 2e3": "0.01 Pa s, is un",
    "grain.diameter = 5e-5\nfluid.kind = 'air'": "5e-05 m: cohesion",
}


@pytest.mark.parametrize("text", ASKED)
def test_a_study_asks_about_numbers_that_are_usual_in_another_unit(
    text: str, tmp_path: Path
) -> None:
    """It is a warning, and behind the remedy where the scene is refused as well."""
    file = tmp_path / "t.toml"
    file.write_text(text)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            questions = study.load(file).questions
            said = "; ".join(questions)
            assert [str(one.message) for one in caught] == [said]
        except InputError as error:
            remedy, _, said = error.remedy.partition("; ")
            assert "did you mean" not in remedy
    assert ASKED[text] in said


@pytest.mark.parametrize("name", presets())
def test_presets_are_asked_nothing(name: str) -> None:
    assert guests.load_study(name, None).questions == ()


def test_a_study_and_the_command_ask_alike() -> None:
    parameters = {
        "diameter": 0.12,
        "density": 2650.0,
        "fluid_density": 1000.0,
        "viscosity": 1e-3,
        "slope_deg": 0.26,
        "lift_coefficient": 6.46,
        "gravity": 98.1,
    }
    points = {name: [value] for name, value in parameters.items()}
    fields = {name: each.field for name, each in PARAMETERS.items()}
    names = {**dict.fromkeys(OPTIONS, ""), **fields, "fluid": "fluid.kind"}
    asked = thresholds_and_questions(points, "auto", None, None, names, "{} = {:.4g}")[
        1
    ]
    text = "\n".join(f"{fields[name]} = {value}" for name, value in parameters.items())
    assert list(study.parse(text, name="t", where="t").questions) == asked
    assert len(asked) == 5


def test_a_profile_in_millimetres_is_refused_unless_its_unit_is_confirmed(
    tmp_path: Path,
) -> None:
    x = np.linspace(0, 60, 301)
    z = 1.5 * (1 - np.cos(2 * np.pi * x / 60))
    text = f"{SAND}bed = {{ kind = 'pile', profile = 'scan.csv' }}\n"
    file = tmp_path / "t.toml"

    def scaled(scale: float) -> None:
        rows = [f"{scale * a:.3f},{scale * b:.4f}" for a, b in zip(x, z, strict=True)]
        (tmp_path / "scan.csv").write_text("\n".join(["x_m,z_m", *rows]))

    file.write_text(text)
    scaled(1.0)
    assert study.load(file).questions == ()
    scaled(1e3)
    what = (
        r"t\.toml: bed\.profile: scan\.csv is 6e\+04 m long and 3000 m high: did you mean "
        r"mm, 60 m long and 3 m high\? \(divide x_m and z_m by 1000, or write "
        r"units_confirmed = true"
    )
    with pytest.raises(InputError, match=what):
        study.load(file)
    file.write_text(f"units_confirmed = true\n{text}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        confirmed = study.load(file)
    assert confirmed.questions == ()
    bed = confirmed.scenes[0].bed
    assert isinstance(bed, PileBed)
    assert bed.height == pytest.approx(3000.0)


def test_confirmed_units_leave_remarks_and_silence_questions() -> None:
    text = "grain = { diameter = 5e-5, density = 2.65 }\nfluid.kind = 'air'\n"
    asked = study.parse(text, name="t", where="t").questions
    assert ["g/cm3" in one for one in asked] == [True, False]
    confirmed = study.parse(f"units_confirmed = true\n{text}", name="t", where="t")
    assert confirmed.questions == asked[1:]
    assert "cohesion" in asked[1]


@pytest.mark.parametrize(
    "sizes", ["[[12.0, 0.5], [64.0, 0.5]]", "[[0.6, 0.5], [2.0, 0.5]]"]
)
def test_a_sieve_table_in_millimetres_is_asked_about(
    sizes: str, tmp_path: Path
) -> None:
    bed = "bed = { kind = 'flat', packing = 'poured', length = 100.0 }\n"
    (tmp_path / "sieve.csv").write_text("diameter_m,fraction\n0.6,0.5\n64,0.5\n")
    for written, grain in ((sizes, sizes), ("sieve.csv", "'sieve.csv'")):
        text = f"{QUARTZ}{bed}grain.sizes = {grain}"
        try:
            file = str(tmp_path / "t.toml")
            said = "; ".join(study.parse(text, name="t", where=file).questions)
        except InputError as error:
            said = str(error)
        assert "m: did you mean mm? Divide the diameters by 1000" in said, written


WRONG = {
    "grain.diameter = 0,25": "write 0.25",
    "grain.diameter = 0.25 mm  # sand": "write 0.00025, without a unit",
    'grain.diameter = "0.25 mm"': "write 0.00025, without a unit",
    'grain.diameter = "0,25"': "write 0.25",
    "grain.diameter = 1e-3\nfluid = { kind = 'air', temperature_deg_c = true }": "True is no",
    "grain.diameter = 1e-3\nfluid = { kind = 'air', temperature_deg_c = 288 }": "14.85 deg C?",
    "grain.diameter = 1e-3\nbed.roughness = 'd/٣٠'": "'d/٣٠' is not a length",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_number_in_another_spelling_is_refused_with_the_right_one(text: str) -> None:
    with pytest.raises(InputError) as caught:
        study.parse(text, name="t", where="t.toml")
    assert WRONG[text] in str(caught.value)


@pytest.mark.parametrize("name", ["frist-look", "first_look", "stockpiles"])
def test_a_misspelt_preset_is_named(name: str) -> None:
    near = {"stockpiles": "stockpile"}.get(name, "first-look")
    with pytest.raises(InputError, match=f"did you mean {near}\\?"):
        study.load(name)


KNOWN_UNITS = {
    "m": 1.0,
    "km": 1000.0,
    "cm": 0.01,
    "mm": 0.001,
    "um": 0.000001,
    "\u00b5m": 0.000001,
    "\u03bcm": 0.000001,
    "kg/m3": 1.0,
    "kg/m\u00b3": 1.0,
    "g/cm3": 1000.0,
    "g/cm\u00b3": 1000.0,
    "m/s": 1.0,
    "cm/s": 0.01,
    "m2/s": 1.0,
    "m\u00b2/s": 1.0,
    "deg": 1.0,
    "\u00b0": 1.0,
    "rad": 57.29577951308232,
}
"""What one of each is in the units of a study file (SI brochure, 9th edition)."""


def test_every_unit_has_the_factor_of_its_definition() -> None:
    assert {*units.TO_SI} == {*KNOWN_UNITS} | {*LENGTHS}
    for unit, factor in KNOWN_UNITS.items():
        assert units.TO_SI[unit] == pytest.approx(factor, rel=1e-15)
        assert units.meant(f"2.5 {unit}").startswith(f"write {2.5 * factor:.9g}, ")
