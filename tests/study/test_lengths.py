"""Units of lengths in heads of tables have the sizes of their definitions."""

import pytest

from orchestrator.errors import InputError
from orchestrator.study.heads import Name, name_of
from orchestrator.study.lengths import LENGTHS, lengths_of

KNOWN = {
    "m": 1.0,
    "km": 1000.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 0.001,
    "µm": 0.000001,
    "ft": 0.3048,
    "us survey foot": 0.3048006096012192,
    "in": 0.0254,
    "yd": 0.9144,
}
"""SI brochure, NIST Handbook 44, and the foot of the Mendenhall order."""


def test_each_unit_has_the_size_of_its_definition() -> None:
    for unit, metres in KNOWN.items():
        assert LENGTHS[unit] == pytest.approx(metres, rel=1e-14)
    # all other names are of one of them
    sizes = sorted({*LENGTHS.values()})
    assert sizes == pytest.approx(sorted(KNOWN.values()), rel=1e-14)
    assert LENGTHS["feet"] == LENGTHS["ft"] != LENGTHS["us ft"] == LENGTHS["ftus"]


@pytest.mark.parametrize(
    ("cell", "name"),
    [
        ("Height (in)", Name("height", "in")),
        ("Level in", Name("level", "in")),
        ("Height [in inches]", Name("height", "inches")),
        ("Maschenweite in mm", Name("maschenweite", "mm")),
        ("z_us_ft", Name("z", "us_ft")),
        ("x [US survey feet]", Name("x", "us survey feet")),
        ("Elevation (ft NAVD88)", Name("elevation", "ft", "NAVD88")),
        ("Elevation (NAVD88, ft)", Name("elevation", "ft", "NAVD88")),
        ("NAVD88 (ft)", Name("level", "ft", "NAVD88")),
    ],
)
def test_the_name_of_a_column_says_its_unit_and_its_datum(
    cell: str, name: Name
) -> None:
    assert name_of(cell) == name


@pytest.mark.parametrize(
    ("before", "unit"),
    [
        (["# Units: feet"], "feet"),
        (["length unit = mm"], "mm"),
        (["Einheit: cm"], "cm"),
        (["Survey of May", "all values are in inches"], "inches"),
        (["units are in US survey feet"], "us survey feet"),
        (["line 3 of 7, flown at 120 ft"], "m"),
        (["grain 0.25 mm", "a 5-cm grid, GSD 2cm"], "m"),
        ([], "m"),
    ],
)
def test_a_line_above_may_name_the_unit_of_all(before: list[str], unit: str) -> None:
    columns = [("x", "x", ""), ("z", "z", "")]
    assert lengths_of(columns, before, "f").units == (unit, unit)


def test_a_unit_of_some_lengths_is_none_of_all() -> None:
    columns = [("x", "x", ""), ("z", "z", "")]
    with pytest.raises(InputError, match=r"f: a line above speaks of feet"):
        lengths_of(columns, ["Vertical units: feet"], "f")
