"""Sieve tables in the shapes in which laboratories write them."""

from pathlib import Path
from typing import Any

import pytest

from orchestrator.digits import rounded
from orchestrator.errors import InputError
from orchestrator.report import remarks
from orchestrator.study import study
from orchestrator.study.sieve import Cut, read_sieve

SIZES = (0.000707106781, 0.00141421356, 0.00282842712)
"""Between 0.5, 1, 2 and 4 mm, of whose grains 10, 50 and 40 % lie between two."""
ALIKE = {
    "passing": "Sieve (mm),Passing (%)\n4,100\n2,60\n1,10\n0.5,0\n",
    "the finest first": "Sieve (mm),Passing (%)\n0.5,0\n1,10\n2,60\n4,100\n",
    "parts": "Sieve (mm),Passing\n4,1\n2,0.6\n1,0.1\n0.5,0\n",
    "grams that pass": "Sieve (mm),Mass passing (g)\n4,500\n2,300\n1,50\n0.5,0\n",
    "per cent signs": "Sieve (mm),Passing\n4,100 %\n2,60 %\n1,10 %\n0.5,0 %\n",
    "grams on each, with a pan": (
        "Sieve (mm),Mass retained (g)\n4,0\n2,200\n1,250\n0.5,50\nPan,0\nTotal,500\n"
    ),
    "a pan of size 0": "Sieve (mm),Retained (%)\n4,0\n2,40\n1,50\n0.5,10\n0,0\n",
    "a pan that is said": "Sieve (mm),Weight (g)\n4,0\n2,4\n1,5\n0.5,1\nPan (<0.5),0\n",
    "sums by that word": "Sieve (mm),Cumulative retained (%)\n4,0\n2,40\n1,90\n0.5,100\n",
    "sums that are called retained": (
        "Sieve (mm),Retained (%)\n4,0\n2,40\n1,90\n0.5,100\nPan,100\n"
    ),
    "sums without a direction": "Sieve (mm),Cumulative (%)\n4,100\n2,60\n1,10\n0.5,0\n",
    "coarser": "Sieve (mm),% coarser\n4,0\n2,40\n1,90\n0.5,100\n",
    "phi, sums": "phi,Cumulative weight (%)\n-2,0\n-1,40\n0,90\n1,100\n",
    "phi, on each": "Grain size (phi),wt %\n-2,0\n-1,40\n0,50\n1,10\n",
    "micrometres": "Aperture (µm),% finer\n4000,100\n2000,60\n1000,10\n500,0\n",
    "microns": "Opening (microns),% finer\n4000,100\n2000,60\n1000,10\n500,0\n",
    "units in cells": "Sieve size,% finer\n4 mm,100\n2 mm,60\n1000 µm,10\n500 um,0\n",
    "a line of units": "Sieve;Passing\nmm;%\n4;100\n2;60\n1;10\n0.5;0\n",
    "ranges": "Size class (mm),Mass (g)\n2 - 4,80\n1-2,100\n0.5–1,20\n",
    "German": "Siebweite [mm];Durchgang [%]\n4;100\n2;60\n1;10,0\n0,5;0\n",
    "German, on each": "Maschenweite in mm;Rückstand in g\n4;0\n2;4,0\n1;5\n0,5;1\nSchale;0\n",
    "French": "Tamis (mm);Passant cumulé (%)\n4;100\n2;60\n1;10,0\n0,5;0\n",
    "tabs": "sieve_mm\tpassing_percent\n4\t100\n2\t60\n1\t10\n0.5\t0\n",
    "blanks": "sieve_mm passing_percent\n4 100\n2 60\n1 10\n0.5 0\n",
    "a unit alone": "mm,passing (%)\n4,100\n2,60\n1,10\n0.5,0\n",
    "a title above": (
        "Particle size distribution\nSample: A 3\n\nSieve (mm),Passing (%)\n"
        "4,100\n2,60\n1,10\n0.5,0\n"
    ),
    "all columns of a form": (
        "Sieve No.,Opening (mm),Mass retained (g),% retained,Cum. % retained,% passing\n"
        "5,4,0,0,0,100\n10,2,200,40,40,60\n18,1,250,50,90,10\n35,0.5,50,10,100,0\n"
        "Pan,,0,0,100,0\nTotal,,500,100,,\n"
    ),
    "another column": "Sieve (mm),Passing (%),Moisture (%)\n4,100,3\n2,60,\n1,10,\n0.5,0,\n",
    "empty lines of a spreadsheet": (
        "Sieve (mm),Passing (%),\n4,100,\n,,\n2,60,\n1,10,\n0.5,0,\n,,\n"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ALIKE)
def test_a_table_is_read_as_laboratories_write_it(name: str) -> None:
    table = read_sieve(ALIKE[name], "sieve.csv")
    assert [size for size, _ in table.rows] == [*SIZES]
    assert [part for _, part in table.rows] == pytest.approx([0.1, 0.5, 0.4])
    assert not table.cuts
    assert table.said


@pytest.mark.parametrize("head", ["phi", "diameter_phi"])
def test_a_table_of_sizes_may_have_phi(head: str) -> None:
    """The negative logarithm to the base 2 of millimetres."""
    table = read_sieve(f"{head},fraction\n-1,0.4\n0,0.5\n1,0.1\n", "s")
    sizes = dict(table.rows)
    assert sizes == pytest.approx({2e-3: 0.4, 1e-3: 0.5, 5e-4: 0.1})


def test_sieves_have_the_openings_of_their_numbers() -> None:
    text = 'Sieve,% passing\n"3/8""",100\nNo. 4,80\n#10,50\nNo. 20,20\n20 mesh,20\n'
    with pytest.raises(InputError, match=r"line 6: 0.85 mm stands twice"):
        read_sieve(text, "s")
    table = read_sieve(text.replace("20 mesh,20\n", "No 40,0\n"), "s")
    ends = [(9.5, 4.75), (4.75, 2.0), (2.0, 0.85), (0.85, 0.425)]
    means = [rounded(1e-3 * (a * b) ** 0.5) for a, b in reversed(ends)]
    # 6.7 over 0.6 mm is more than ten: the finest are the lesser part
    assert [size for size, _ in table.rows] == means[1:]
    assert table.cuts == (Cut(0.0, 0.00085, 0.2),)


@pytest.mark.parametrize("head", ["Sieve (in)", "Sieve"])
def test_fractions_are_sieves_of_inches(head: str) -> None:
    table = read_sieve(f"{head},% passing\n1 1/2,100\n3/4,60\n3/8,0\n", "s")
    means = [(9.5 * 19.0) ** 0.5, (19.0 * 37.5) ** 0.5]
    assert [1e3 * size for size, _ in table.rows] == pytest.approx(means)


def test_cells_may_have_inches_with_a_point() -> None:
    table = read_sieve('Sieve,% passing\n"0.08""",100\n0.04 in,50\n0.02 inch,0\n', "s")
    sizes = [25.4 * (0.02 * 0.04) ** 0.5, 25.4 * (0.04 * 0.08) ** 0.5]
    assert [1e3 * size for size, _ in table.rows] == pytest.approx(sizes)


def test_openings_in_inches_become_millimetres_and_are_said() -> None:
    table = read_sieve("Opening (in),% passing\n0.08,100\n0.04,50\n0.02,0\n", "s")
    sizes = [25.4 * (0.02 * 0.04) ** 0.5, 25.4 * (0.04 * 0.08) ** 0.5]
    assert [1e3 * size for size, _ in table.rows] == pytest.approx(sizes)
    assert "'Opening (in)' in in (1 in = 25.4 mm)" in table.said


@pytest.mark.parametrize("total", ["100.4", "99.7"])
def test_a_total_within_the_losses_of_a_sieving_is_taken(total: str) -> None:
    text = f"Sieve (mm),Retained (g)\n4,0\n2,40\n1,60\nTotal,{total}\n"
    assert len(read_sieve(text, "s").rows) == 2


def test_fines_below_the_last_sieve_are_cut_and_said() -> None:
    table = read_sieve("Sieve (mm),Passing (%)\n4,100\n2,60\n1,3\n", "s")
    assert [part for _, part in table.rows] == pytest.approx([57 / 97, 40 / 97])
    assert table.cuts == (Cut(0.0, 0.001, 0.03),)
    assert "3 % of the mass is finer than 1 mm and was cut" in table.said
    pan = read_sieve("Sieve (mm),Retained (g)\n4,0\n2,40\n1,57\nPan,3\n", "s")
    assert pan.rows == table.rows
    assert pan.cuts == table.cuts


def test_the_ten_to_one_with_most_of_the_mass_is_kept() -> None:
    """The sizes of a class are the geometric means of its sieves."""
    text = "Sieve (mm),Passing (%)\n63,100\n16,90\n4,60\n1,20\n0.25,5\n0.063,0\n"
    table = read_sieve(text, "s")
    kept = [(16 * 4) ** 0.5 * 1e-3, (4 * 1) ** 0.5 * 1e-3]
    assert [size for size, _ in table.rows] == pytest.approx(kept[::-1])
    assert [part for _, part in table.rows] == pytest.approx([40 / 70, 30 / 70])
    assert table.cuts == (Cut(0.0, 0.001, 0.2), Cut(0.016, float("inf"), 0.1))
    assert table.cuts[1].said == "10 % of the mass is coarser than 16 mm and was cut"
    assert table.rows[-1][0] <= 10 * table.rows[0][0]


def test_little_on_the_largest_sieve_goes_on_as_the_sieves_do() -> None:
    table = read_sieve("Sieve (mm),Passing (%)\n4,95\n2,60\n1,0\n", "s")
    assert table.rows[-1] == (rounded(1e-3 * 32**0.5), 0.05)
    assert (
        "5 % stay on the largest sieve, and were taken for grains up to 8 mm"
        in table.said
    )


REFUSED = {
    "Sieve (mm),Retained (g)\n4,0\n2,40\n1,60\nTotal,120\n": (
        r"line 5: Retained \(g\): the total is 120, and the lines add up to 100"
    ),
    "Sieve (mm);Retained (%);Passing (%)\n4;0;100\n2;40;60\n1;60;0\nSumme;90;\n": (
        r"line 5: Retained \(%\): the total is 90, and the lines add up to 100"
    ),
    "Sieve (mm),Mass (g),% passing\n4,0,100\n2,40,60\n1,60,0\nTotal,110,\n": (
        r"line 5: Mass \(g\): the total is 110, and the lines add up to 100"
    ),
    "Sieve (in),Passing (%)\n3/7,100\nNo. 20,0\n": "'3/7' is no sieve of ASTM",
    "Sieve (mm),Passing (%)\n3/8,100\n2,0\n": "'3/8' is no sieve",
    "Sieve size,Passing (%)\n4,100\n2,0\n": r"line 2: Sieve size: 4 of which unit .*Sieve \(mm\)",
    "Sieve (mm),Retained (%)\n4,0\n2,20\n1,30\n": "add up to 50, not to 100",
    "Sieve (mm),Passing (%)\n4,60\n2,0\n": "60 % pass the largest sieve, not 100",
    "Sieve (mm),Retained (%),Passing (%)\n4,0,100\n2,20,60\n1,80,0\n": (
        r"from 2 mm on: 40 % by Passing \(%\), 20 % by Retained \(%\)"
    ),
    "Sieve (mm),Passing (%)\n-1,100\n0,50\n1,0\n": "line 2: .*is the column phi",
    "Sieve (mm),Passing (%)\n4,100\n2,\n1,0\n": r"line 3: the cell of Passing \(%\) is empty",
    "Sieve (mm),Retained (g)\n2,0\n1,NA\n0.5,100\n": (
        r"line 3: Retained \(g\): 'NA' is no number "
        r"\(write the mass on this sieve, or 0, or remove the line\)"
    ),
    "Sieve (mm),Passing (%)\n2,100\n1,n/a\n0.5,0\n": (
        r"line 3: Passing \(%\): 'n/a' is no number"
        r".*\(write its number, or remove the line\)"
    ),
    "Sieve (mm),Passing\n4,50\n2,20\n1,0\n": "Passing: of which whole",
    "Sieve (mm),Passing (%)\n4,100\n2,120\n1,0\n": "line 3: .*120 is no part",
    "Sieve (mm),Weight (g)\n4,0\n2,-1\n1,5\n": "line 3: .*-1 is no part",
    "Sieve (mm),Weight (g)\n4,0\n2,0\n1,0\n": "nothing stays anywhere",
    "Sieve (mm),Passing (%)\n4,100\n2,100\n": "all grains pass the smallest sieve",
    "Sieve (mm),Passing (%)\n63,100\n31.5,66\n2,66\n1,33\n0.063,33\n0.04,0\n": "are 34 % of",
    "Sieve,Passing (%)\nNo. 11,100\nNo. 20,0\n": "line 2: 'No. 11' is no sieve of ASTM",
    "Sieve (mm),Passing (%)\n1-2,100\n0.5-1,0\n": "what passes a range of sizes",
    "Sieve (mm);Passing (%)\n4;100\n2;60\n1,5;10.5\n": "both '1,5' and '10.5' stand there",
    "Size (mm),Moisture\n4,1\n": "no names of columns that are known, in 'Size .mm.,Mois",
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_not_certain_is_asked(text: str) -> None:
    with pytest.raises(InputError, match=REFUSED[text]) as caught:
        read_sieve(text, "sieve.csv")
    assert "sieve.csv" in str(caught.value)
    assert caught.value.remedy
    assert "\n" not in str(caught.value)


STUDY = """
[fluid]
kind = "water"
[grain]
sizes = "sieve.csv"
density = 2650.0
[bed]
kind = "flat"
length = 40.0
packing = "poured"
[method]
kind = "pivot"
"""


def test_a_study_says_what_it_understood_of_its_sieves(tmp_path: Path) -> None:
    (tmp_path / "sieve.csv").write_text(
        "Sieve (mm);Passing (%)\n4;100\n2;60\n1;10\n0,5;3\n", encoding="utf-16"
    )
    (tmp_path / "mixed.toml").write_text(STUDY)
    asked = study.load(str(tmp_path / "mixed.toml"))
    (table,) = asked.sieves.values()
    assert asked.scenes[0].grain.sizes == table.rows
    assert "decimal commas" in asked.understood["sieve.csv"]
    again = study.parse(asked.text, name="m", where=str(tmp_path / "no" / "m.toml"))
    assert again.understood == asked.understood
    assert again.sieves == asked.sieves


def test_fines_that_were_cut_are_answered_by_a_hiding_function(tmp_path: Path) -> None:
    (tmp_path / "sieve.csv").write_text("Sieve (mm),Passing (%)\n4,100\n2,60\n1,3\n")
    (tmp_path / "mixed.toml").write_text(STUDY)
    asked = study.load(str(tmp_path / "mixed.toml"))

    class Empty:
        """Results of no run."""

        study = asked

        def joined(self, name: str) -> Any:
            del name
            return []

    (remark,) = remarks._cuts(Empty())  # type: ignore[arg-type]
    d50 = asked.scenes[0].grain.diameter
    size = 1e-3 / d50
    factor = size ** (0.67 / (1 + 2.718281828459045 ** (1.5 - size)))
    assert f"grains of 1 mm need {factor:.2f} times the stress of d50" in remark.text
    assert "hiding function of Wilcock and Crowe (2003), a formula" in remark.text
    assert "3 % of the mass is finer than 1 mm" in remark.text
