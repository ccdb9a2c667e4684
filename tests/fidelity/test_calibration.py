"""Known errors: which scenes they hold for, how they add up, what the model's choices are worth."""

import math

import numpy as np
import pandas as pd
import pytest

from orchestrator.fidelity import levels
from orchestrator.fidelity.levels import AS_ASKED, FLAT, UNKNOWN, Pair, changed, level, pair_of
from tests.fidelity.conftest import MakePile

COARSE = Pair(level("flow", "coarse"), level("grains", "peeling"))


def test_errors_of_the_parts_add_up_by_their_squares(pile: MakePile) -> None:
    table = levels.measured()
    flow, grains = table["flow", "coarse", "wall"], table["grains", "peeling", "aligned"]
    squares = flow[:2] ** 2 + grains[:2] ** 2
    known = levels.known(COARSE, pile())
    assert known.total == pytest.approx(math.sqrt(squares.sum(axis=0).max()))
    assert known.cost_core_s == pytest.approx(flow[2, 0] + grains[2, 0])


def test_a_slope_between_the_measured_ones_has_the_larger_error(pile: MakePile) -> None:
    theory = Pair(level("flow", "waves"), level("grains", "peeling"))
    below, between, limiting = (
        levels.known(theory, pile(slope_deg=slope)).total for slope in (25.0, 28.0, 30.0)
    )
    assert between == pytest.approx(max(below, limiting), rel=0.05)
    # of 40 thresholds of level rows at the limiting slope 11 lay beyond an error from one pile
    at_limit = levels.classes("grains", pile(packing="horizontal", slope_deg=30.0))
    assert at_limit == levels.classes("grains", pile(packing="horizontal"))


@pytest.mark.parametrize(
    "fields",
    [
        {"forces.averaging_length": 10.0},
        {"forces.averaging_length": 1.0},
        {"forces.loaded_grains": "all but crest"},
        {"flow.first_cell_height": 0.005},
        {"flow.speed": 0.5, "flow.viscosity": 1e-5},
        {"flow.roughness": 1e-8},
        {"flow.turbulence_model": "kOmegaSST"},
        {"flow.convection_scheme": "upwind"},
        {"flow.lid": 20.0},
        {"protocol.displacement_criterion": 0.1},
        {"flow.top": "open water", "flow.depth": 0.1, "bed.shape": "dune"},
        {"forces.law": "low"},  # lift carries these grains off
    ],
    ids=lambda fields: next(iter(fields)),
)
def test_a_known_error_holds_for_what_was_measured(
    fields: dict[str, object], pile: MakePile
) -> None:
    assert math.isfinite(levels.known(COARSE, pile()).total)
    assert levels.known(COARSE, pile(fields)) == UNKNOWN


def test_the_protocol_of_a_study_file_has_the_error_of_a_coarser_level(pile: MakePile) -> None:
    """Poured beds by the default protocol were off by up to 40 %, with an interval of 2 %."""
    bed = {"packing": "poured", "shape": "flat", "slope_deg": 0.0}
    scene = pile({"flow.model": "flat"}, **bed)
    assert pair_of(scene) == (FLAT, AS_ASKED)
    known = levels.known(pair_of(scene), scene)
    assert known == levels.known(Pair(FLAT, level("grains", "2 layers, fast")), scene)
    assert 0.4 < known.total < 2.0
    finer = changed(scene, {"bed.mobile_layers": 4})
    assert levels.known(pair_of(finer), finer).total < known.total
    softer = changed(scene, {"grain.stiffness": 100.0})
    assert levels.known(pair_of(softer), softer) == UNKNOWN
    # an error without a bound is no known one
    pivot = changed(scene, {"protocol.method": "pivot"})
    assert math.isinf(levels.known(pair_of(pivot), pivot).total)


def test_methods_without_dynamics_are_known_to_fail_where_a_row_has_no_edge(
    pile: MakePile,
) -> None:
    errors = [levels.known(COARSE, pile(shape=shape)).error for shape in ("dune", "cosine")]
    assert errors[0] < 0.1 < 1.0 < errors[1]


def test_obstacles_and_channels_have_errors_of_their_own(pile: MakePile) -> None:
    fence = [{"kind": "fence", "x": -0.1, "height": 0.01}]
    for bed in ({}, {"shape": "dune"}, {"shape": "cosine"}):
        behind, bare = (
            levels.known(COARSE, pile(**one)) for one in ({**bed, "obstacles": fence}, bed)
        )
        assert behind.error >= 0.9 * bare.error
    water = pile({"flow.top": "open water", "flow.depth": 0.1})
    assert levels.known(COARSE, water).error > levels.known(COARSE, pile()).error


def test_every_measured_class_has_its_reference() -> None:
    table = levels.measured()
    for part, best in (("flow", "fine"), ("grains", "reference")):
        classes = {name for where, _, name in table if where == part}
        assert classes
        for name in classes:
            assert not table[part, best, name][0].any()
    assert all(numbers.shape == (3, 4) for numbers in table.values())


def test_the_spread_of_the_model_is_known_at_every_fraction(pile: MakePile) -> None:
    for fraction in (0.1, 0.3, 0.42, 0.7):
        found = levels.spread(pile(), fraction)
        assert 0 < found.low <= 1
        assert found.high > 0
        assert found.dominant
    assert math.isnan(levels.spread(pile(shape="dune"), 0.3).low)


def test_independent_shares_add_as_squares_and_lower_nothing_below_zero() -> None:
    shares = pd.DataFrame({"shields_low": [0.3, 0.4], "shields_high": [0.1, 0.0]})
    assert levels.together(shares) == pytest.approx((0.5, 0.1))
    assert levels.together(3 * shares)[0] == 1.0


def test_a_frozen_bed_is_known_to_move_a_row(pile: MakePile) -> None:
    moved = [levels.spread(pile(), fraction).frozen_bed for fraction in (0.1, 0.7)]
    # until the first update nothing has changed
    assert 0 <= moved[0] < 0.05 < moved[1]
    others = {"flow.model": "hill"}, {"protocol.update": 0.1, "flow.first_cell_height": 5e-4}
    assert np.isnan([levels.spread(pile(fields), 0.7).frozen_bed for fields in others]).all()
