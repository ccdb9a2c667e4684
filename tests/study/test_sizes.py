"""Mixtures of grains: what a study file may write, and what is drawn from it."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.bed import poured
from orchestrator.errors import InputError
from orchestrator.grains.geometry import Geometry
from orchestrator.study import parts, study
from orchestrator.study.parts import LogNormal, Sizes
from orchestrator.study.scene import Scene

SIEVE = ((5e-4, 0.2), (1e-3, 0.5), (2e-3, 0.3))
BED = 'bed = { kind = "pile", slope_deg = 15.0, packing = "poured", roughness = "%s" }'


def _parse(text: str) -> Scene:
    return study.parse(text, name="m", where="m").scenes[0]


def _grain(text: str, roughness: str = "d/30") -> Scene:
    return _parse(f"{BED % roughness}\n[grain]\n{text}")


def test_the_median_of_a_sieve_table_is_the_diameter() -> None:
    scene = _grain("sizes = [[5e-4, 0.2], [1e-3, 0.5], [2e-3, 0.3]]")
    assert scene.grain.sizes == SIEVE
    # half of each class is finer than its diameter: 0.1, 0.45, 0.85 of the mass
    assert scene.grain.diameter == pytest.approx(1e-3 * 2 ** (0.05 / 0.4), rel=5e-9)
    assert scene.bed.roughness == pytest.approx(scene.grain.diameter / 30, rel=1e-9)
    classes = ((5e-4, 0.15), (7e-4, 0.2), (1e-3, 0.3), (1.4e-3, 0.2), (2e-3, 0.15))
    assert parts.percentile(classes, 1.0, 0.5) == 1e-3


def test_the_diameter_may_be_written_as_messages_print_it() -> None:
    """Six digits of the d50 of a sieve table, which are 4e-6 of it off."""
    scene = _grain("diameter = 0.00141421\nsizes = [[1e-3, 0.5], [2e-3, 0.5]]")
    assert scene.grain.diameter == 0.00141421
    with pytest.raises(InputError, match=r"grain\.sizes is 0\.00141421 m"):
        _grain("diameter = 0.0014143\nsizes = [[1e-3, 0.5], [2e-3, 0.5]]")


def test_roughness_is_a_part_of_the_percentile_that_it_names() -> None:
    roughness = _grain(
        "diameter = 1e-3\nsizes = { sigma_g = 1.5 }", "d84/10"
    ).bed.roughness
    assert roughness == pytest.approx(
        parts.percentile(LogNormal(sigma_g=1.5), 1e-3, 0.84) / 10
    )


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize(
    "mixture", [SIEVE, LogNormal(sigma_g=1.4, smallest=0.5, largest=2.0)]
)
def test_the_grains_that_are_drawn_have_the_mixtures_mass(
    mixture: Sizes, dimensions: int
) -> None:
    drawn = poured.drawn_sizes(mixture, 1e-3, 100_000, 3, dimensions) * 1e-3
    mass = drawn**dimensions / (drawn**dimensions).sum()
    for part in (0.2, 0.45, 0.7):
        exact = parts.percentile(mixture, 1e-3, part)
        slack = 0.26 * (mixture is SIEVE) + 2e-3
        assert mass[drawn < exact * (1 - 1e-9)].sum() - slack <= part
        assert part <= mass[drawn <= exact * (1 + 1e-9)].sum() + slack
    for size, fraction in SIEVE if mixture is SIEVE else ():
        assert mass[np.isclose(drawn, size)].sum() == pytest.approx(fraction, abs=1e-3)


BAD = {
    "sizes = [[5e-4, 0.2], [1e-3, 0.5]]": "add up to 0.7, not 1",
    "sizes = [[1e-3, 0.5], [5e-4, 0.5]]": "diameters do not rise",
    "sizes = [[1e-4, 0.5], [2e-3, 0.5]]": "20 times the smallest",
    "sizes = [[1e-3, 1.0, 2.0]]": "a list of two numbers",
    "sizes = [[1e-3, -1.0]]": "a number above 0",
    "sizes = [1e-3]": "0.001 is not accepted",
    "diameter = 2e-3\nsizes = [[1e-3, 0.5], [2e-3, 0.5]]": "the d50 of grain.sizes is 0.0014",
    "diameter = 1e-3\nsizes = { sigma_g = 0.5 }": "sigma_g",
    "diameter = 1e-3\nsizes = { sigma_g = 2.0 }": "16 times the smallest",
    "diameter = 1e-3\nsizes = { sigma_g = 2.0, smallest = 0.3, largest = 1.0 }": "the d50 of",
    "sizes = { sigma_g = 1.3 }": "is missing",
}


@pytest.mark.parametrize("text", BAD)
def test_bad_mixtures_are_refused_in_one_line(text: str) -> None:
    with pytest.raises(InputError, match=BAD[text]) as caught:
        _grain(text)
    assert "grain." in str(caught.value)
    assert "\n" not in str(caught.value)


def test_springs_that_throw_poured_grains_apart_are_refused_in_dem() -> None:
    text = f"grain = {{ diameter = 1e-3 }}\nmethod.grains.stiffness = 2e5\n{BED % 'd/30'}\n"
    with pytest.raises(InputError, match=r"such springs throw poured grains"):
        _parse(text)
    # pivots know no springs
    with pytest.raises(InputError, match=r"stiffness: it has an effect on DEM alone"):
        _parse(f'{text}method.kind = "pivot"')


FILES = {
    "": "sieve.csv: line 1",
    "diameter_m,fraction\n1e-3,0.5\nsand,0.5\n": "sieve.csv: line 3",
    "diameter_m,fraction\n": "grain.sizes: .* one or more rows",
    "diameter_m,fraction\n1e-3,0.5\n2e-3,0.4\n": "grain.sizes: fractions add up to 0.9, not",
}


SIEVES = {
    "2,100\n1,60\n-1,0\n": r"sieve.csv: line 4: sieve_mm: -1 .*openings .* above 0",
    "2,100\n0.85,60\nlid,0\n": r"sieve.csv: line 4: sieve_mm: 'lid' .*pan",
    "2,100\n\n0.85,160\n0.5,0\n": r"sieve.csv: line 4: passing_percent: 160 .*0 to 100",
    "2,100\n0.85,-3\n0.5,0\n": r"sieve.csv: line 3: passing_percent: -3 .*0 to 100",
    "4,100\n2,20\n1,60\n0.5,0\n": r"sieve.csv: line 3: 20 % pass 2 mm, and 60 % 1 mm",
    "2,60\n1,0\n": r"sieve.csv: 60 % pass the largest sieve, not 100",
    "4,100\n1,60\n4,100\n": r"sieve.csv: line 4: 4 mm stands twice",
}
CLASSES = {
    "diameter_m,fraction\n1e-3,0.5\n\n0,0.5\n": r"sieve.csv: line 4: diameter_m: 0 ",
    "diameter_m,fraction\n-1e-3,0.5\n": r"sieve.csv: line 2: diameter_m: -0.001 ",
    "diameter_m,fraction\n1e-3,0.5\n2e-3,-1\n": r"sieve.csv: line 3: fraction: -1 ",
    "sieve_mm,retained_percent\n2,0\n1,40\n": "add up to 40, not to 100 .*the pan",
    "sieve_mm,moisture\n2,0\n": "line 1: no names of columns that are known",
}


def test_a_sieve_that_is_none_is_refused_with_its_line(tmp_path: Path) -> None:
    sieve, source = tmp_path / "sieve.csv", tmp_path / "mixed.toml"
    source.write_text(f"{BED % 'd/30'}\ngrain = {{ sizes = 'sieve.csv' }}\n")
    head = "sieve_mm,passing_percent\n"
    for text, message in {
        **{head + k: v for k, v in SIEVES.items()},
        **CLASSES,
    }.items():
        sieve.write_text(text)
        with pytest.raises(InputError, match=message) as caught:
            study.load(str(source))
        assert str(sieve) in str(caught.value)
        assert caught.value.remedy
        assert "multiply" not in str(caught.value)


def test_a_sieve_table_may_be_a_file_beside_the_study(tmp_path: Path) -> None:
    sieve, source = tmp_path / "sieve.csv", tmp_path / "mixed.toml"
    source.write_text(f"{BED % 'd/30'}\ngrain = {{ sizes = 'sieve.csv' }}\n")
    for text, message in FILES.items():
        sieve.write_text(text)
        with pytest.raises(InputError, match=message):
            study.load(str(source))
    sieve.write_text("diameter_m,fraction\n5e-4,0.2\n1e-3,0.5\n\n2e-3,0.3\n")
    asked = study.load(str(source))
    assert asked.scenes[0].grain.sizes == SIEVE
    again = study.parse(
        asked.text, name="m", where=str(tmp_path / "elsewhere" / "m.toml")
    )
    assert again.scenes[0].id == asked.scenes[0].id


def test_the_per_cent_that_passes_each_sieve_makes_classes(tmp_path: Path) -> None:
    sieve = tmp_path / "sieve.csv"
    source = tmp_path / "mixed.toml"
    source.write_text(f"{BED % 'd/30'}\ngrain = {{ sizes = 'sieve.csv' }}\n")
    head = "sieve_mm,passing_percent\n"
    # coarse sieves first, as a laboratory lists them; nothing lies between 1 and 2 mm
    sieve.write_text(f"{head}4,100\n2,63.2\n1,63.2\n0.5,0\n")
    (scene,) = study.load(str(source)).scenes
    assert scene.grain.sizes == ((0.000707106781, 0.632), (0.00282842712, 0.368))
    for rows, message in {
        "4,85\n2,60\n1,0\n": "85 % pass the largest sieve, not 100",
        "4,100\n2,20\n1,60\n0.5,0\n": "20 % pass 2 mm, and 60 % 1 mm",
        "4,100\n": "one class lies between two sieves",
        "4,100\n2,\n1,0\n": "line 3: the cell of passing_percent is empty",
    }.items():
        sieve.write_text(head + rows)
        with pytest.raises(InputError, match=message):
            study.load(str(source))


HEADINGS = {
    # openings of 4, 2 and 0.5 mm
    "sieve_mm,passing_percent": ("4", "2", "0.5"),
    "Sieve (mm),Passing (%)": ("4", "2", "0.5"),
    "Sample,Sieve size [mm],% finer": ("A,4", "A,2", "A,0.5"),
    "Sieve (µm),Percent passing": ("4000", "2000", "500"),
    "opening_um,passing_pct": ("4000", "2000", "500"),
    "Diameter (m),Passing (%)": ("4e-3", "2e-3", "5e-4"),
}


@pytest.mark.parametrize("head", HEADINGS)
def test_a_heading_that_states_its_unit_is_read_in_that_unit(
    head: str, tmp_path: Path
) -> None:
    sieve, source = tmp_path / "sieve.csv", tmp_path / "mixed.toml"
    source.write_text(f"{BED % 'd/30'}\ngrain = {{ sizes = 'sieve.csv' }}\n")
    rows = zip(HEADINGS[head], (100, 60, 0), strict=True)
    sieve.write_text("\n".join([head, *(f"{size},{part}" for size, part in rows)]))
    (scene,) = study.load(str(source)).scenes
    assert scene.grain.sizes == ((0.001, 0.6), (0.00282842712, 0.4))


def test_classes_and_numbers_of_a_heading_in_millimetres(tmp_path: Path) -> None:
    sieve, source = tmp_path / "sieve.csv", tmp_path / "mixed.toml"
    source.write_text(f"{BED % 'd/30'}\ngrain = {{ sizes = 'sieve.csv' }}\n")
    sieve.write_text("Diameter (mm),Fraction\n0.5,0.2\n1,0.5\n2,0.3\n")
    assert study.load(str(source)).scenes[0].grain.sizes == SIEVE
    head = "Sieve (mm),Passing (%)\n"
    for rows, message in {
        '"5,000",100\n2,0\n': "'5,000' may be 5.000 or 5000",
        "4,85\n1,0\n": "85 % pass the largest sieve",
    }.items():
        sieve.write_text(head + rows)
        with pytest.raises(InputError, match=message) as caught:
            study.load(str(source))
        assert "multiply" not in str(caught.value)


def test_beds_that_differ_in_their_scale_alone_are_poured_once() -> None:
    bed = '{ kind = "pile", shape = "flat", length = %g, packing = "poured" }'
    text = f"bed = {bed}\ngrain = {{ diameter = %g, sizes = {{ sigma_g = 1.3 }} }}"
    scenes = [_parse(text % (80 * d, d)) for d in (1e-4, 2e-3)]
    assert len({Geometry(scene).pouring[0].id for scene in scenes}) == 1
