"""The model's own spread."""

import math

import pytest

from orchestrator.fidelity import spread
from orchestrator.fidelity.decision import decide
from orchestrator.fidelity.spread import Share
from tests.fidelity.conftest import MakePile


def test_independent_shares_add_as_squares() -> None:
    assert spread.together([0.03, 0.04]) == pytest.approx(0.05)
    found = spread._of((Share("a", 0.3, 0.1), Share("b", 0.4, 0.0), Share("c", 0.0, 0.6)))
    assert (found.low, found.high) == pytest.approx((0.5, math.hypot(0.1, 0.6)))
    assert found.dominant == "c"


def test_a_threshold_does_not_fall_below_zero() -> None:
    assert spread._of((Share("a", 0.9, 0.0), Share("b", 0.9, 0.0))).low == 1.0


def test_of_another_bed_nothing_is_known(pile: MakePile) -> None:
    assert math.isnan(spread.spread(pile(shape="dune"), 0.3).low)
    assert decide(pile(shape="dune"), 0.2).why == "no error is known: as the study asks"


def test_what_was_measured_is_known_at_every_fraction(pile: MakePile) -> None:
    for fraction in (0.1, 0.3, 0.42, 0.7):
        found = spread.spread(pile(), fraction)
        assert 0 < found.low <= 1
        assert found.high > 0
        assert found.dominant


def test_one_choice_is_known_by_itself(pile: MakePile) -> None:
    moved = [spread.of_choice(pile(), fraction, spread.FROZEN) for fraction in (0.1, 0.7)]
    # until the first update nothing has changed
    assert 0 <= moved[0] < 0.05 < moved[1]
    assert math.isnan(spread.of_choice(pile(), 0.3, "no choice"))
    assert math.isnan(spread.of_choice(pile(shape="dune"), 0.3, spread.FROZEN))
