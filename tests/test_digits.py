"""Numbers of nine digits: what is written of them is the same on every processor."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator import digits, tables
from orchestrator.bed import deck
from orchestrator.grains.pile import Pile
from orchestrator.runs import case
from orchestrator.study import study

FINITE = st.floats(
    allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12
)


@given(FINITE)
def test_a_neighbour_of_a_number_of_nine_digits_is_that_number(value: float) -> None:
    nine = digits.rounded(value)
    assert nine == pytest.approx(value, rel=5e-9, abs=5e-309)
    for neighbour in (np.nextafter(nine, -np.inf), np.nextafter(nine, np.inf)):
        # of the least of all numbers a neighbour is twice as large
        if abs(nine) > 1e-300:
            assert digits.rounded(neighbour) == nine
    assert digits.all_rounded([value])[0] == nine
    assert float(digits.text(value)) == nine


def test_what_is_no_number_stays_what_it_is() -> None:
    assert np.isnan(digits.rounded(np.nan))
    assert digits.all_rounded([np.inf, -np.inf]).tolist() == [np.inf, -np.inf]
    assert digits.all_rounded(np.ones((2, 3))).shape == (2, 3)


def test_components_are_known_to_nine_digits_of_the_largest() -> None:
    noise = np.array([[10.0, 3e-17, 0.12345678951]])
    assert digits.on_grid(noise).tolist() == [[10.0, 0.0, 0.1234568]]
    assert digits.on_grid([-1e-20], unit=1.0).tolist() == [0.0]
    assert not np.signbit(digits.on_grid([-1e-20], unit=1.0)).any()
    # a unit and its neighbours have one grid
    fine = 0.1234567890123
    assert (
        len({digits.on_grid([fine], unit=u)[0] for u in (0.1, np.nextafter(0.1, 0))})
        == 1
    )
    assert digits.on_grid([0.0, 0.0]).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("whole", [1, 7, 2000])
def test_a_whole_number_and_its_neighbours_are_counted_alike(whole: int) -> None:
    value = float(whole)
    for near in (np.nextafter(value, 0), value, np.nextafter(value, np.inf)):
        assert digits.whole_up(near) == whole
    assert digits.whole_up(value + 0.1) == whole + 1


def test_the_last_of_the_load_steps_is_not_one_of_the_last_digits() -> None:
    for first in np.linspace(0.01, 0.9, 500).tolist():
        last = first * 1.05
        for near in (np.nextafter(last, 0), last, np.nextafter(last, 1)):
            assert len(deck.rising_flows(first, near, 0.05)) == 3


SCENE = """
[grain]
diameter = 1e-3
[bed]
kind = "pile"
slope_deg = 17.0
height = 0.006
roughness = "d/30"
[method.flow]
model = "waves"
[method]
kind = "dem"
"""
NUMBER = re.compile(rb"(?<![\w.])[-+]?(\d+\.\d+|\d+\.|\.\d+|\d+)(e[-+]?\d+)?(?![\w.])")


def _most_digits(text: bytes) -> int:
    """Digits of the longest number of a text, without zeros before and behind them."""
    each = (match[1].replace(b".", b"").strip(b"0") for match in NUMBER.finditer(text))
    return max(map(len, each), default=0)


def test_inputs_have_nine_digits_at_most(tmp_path: Path) -> None:
    assert _most_digits(b"x 0.000123456789 1234567890.1") == 11
    (scene,) = study.parse(SCENE, name="s", where="s").scenes
    pile = Pile(scene)
    directory = case.prepare(pile.case, tmp_path)
    names = (
        "grains.data",
        "parameters.liggghts",
        "load_steps.txt",
        "force.x.txt",
        "along.z.txt",
    )
    for name in names:
        assert 8 <= _most_digits((directory / name).read_bytes()) <= digits.DIGITS, name


def test_tables_have_nine_digits_and_say_which_numbers_are_floats() -> None:
    columns = {"a": [1 / 3, 15.0], "b": [np.nan, 1e-7 / 3], "n": [3, 123456789012]}
    mixed = pd.DataFrame({**columns, "o": np.array([2 / 3, None], object)})
    expected = (
        "a,b,n,o\n0.333333333,,3,0.666666667\n15.0,3.33333333e-08,123456789012,\n"
    )
    assert tables.csv(mixed) == expected
    assert tables.csv(mixed[["a"]], "%.3g") == "a\n0.333\n15\n"
