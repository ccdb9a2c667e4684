"""A flow between solved ones of other roughness: its stress, and how far it is off."""

from dataclasses import replace
from itertools import pairwise
from math import log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.bed.line import triangle
from orchestrator.flow import between, theory
from orchestrator.flow.stress import WallStress
from orchestrator.study.method import LEAST_FLOWS

Z0 = (1e-5, 2e-5, 4e-5, 8e-5, 1.6e-4)


def flow(roughness: float, power: int = 2) -> WallStress:
    """A stress on a low pile that is a polynomial in ln(z0) of this degree."""
    low = theory.flat(triangle(10.0, 0.02))
    change = 1 + 0.02 * log(roughness / 1e-5) ** power * (1 + low.z_m / 0.02)
    return replace(low, tau_wall=change, ustar_over_ustar0_eq10=np.sqrt(change))


@given(st.lists(st.floats(1e-6, 1e-2), min_size=1, max_size=40))
def test_the_nodes_are_asked_for_and_enclose_all(asked: list[float]) -> None:
    chosen = between.nodes(asked)
    assert set(chosen) <= set(asked)
    assert (chosen[0], chosen[-1]) == (min(asked), max(asked))
    assert all(low < high for low, high in pairwise(chosen))
    assert chosen == between.nodes(asked[::-1])
    saved = len({*asked}) - len(chosen)
    assert saved == 0 or len(chosen) >= LEAST_FLOWS


def test_many_flows_of_a_decade_are_solved_at_five() -> None:
    asked = np.geomspace(1e-5, 1e-4, 28).tolist()
    assert len(between.nodes(asked)) == 5


def test_a_polynomial_in_the_logarithm_is_met() -> None:
    solved = {z0: flow(z0) for z0 in Z0}
    made = between.stress(5.5e-5, solved)
    assert made.tau_wall == pytest.approx(flow(5.5e-5).tau_wall, rel=1e-12)
    assert between.error(solved, "wall") == pytest.approx(0, abs=1e-12)


def test_a_solved_flow_is_itself() -> None:
    solved = {z0: flow(z0, power=7) for z0 in Z0}
    made = between.stress(Z0[2], solved)
    assert made.tau_wall == pytest.approx(solved[Z0[2]].tau_wall, rel=1e-12)


def test_one_flow_that_is_not_on_the_curve_is_seen() -> None:
    solved = {z0: flow(z0) for z0 in Z0}
    one = solved[Z0[2]]
    solved[Z0[2]] = replace(one, tau_wall=one.tau_wall * 1.02)
    assert between.error(solved, "wall") > between.MOST_ERROR


def test_the_wake_does_not_count() -> None:
    solved = {z0: flow(z0) for z0 in Z0}
    one = solved[Z0[2]]
    falls = np.gradient(one.z_m, one.x_m) < 0
    for z0, each in solved.items():
        other = -0.1 if z0 == Z0[2] else 0.2
        solved[z0] = replace(each, tau_wall=np.where(falls, other, each.tau_wall))
    assert between.error(solved, "wall") < between.MOST_ERROR


def test_both_stresses_are_put_between_their_own() -> None:
    solved = {}
    for z0 in (*Z0, 5.5e-5):
        one = flow(z0)
        solved[z0] = replace(one, ustar_over_ustar0_eq10=0.7 * one.tau_wall - 0.1)
    expected = solved.pop(5.5e-5)
    made = between.stress(5.5e-5, solved)
    assert made.tau_wall == pytest.approx(expected.tau_wall, rel=1e-12)
    assert made.ustar_over_ustar0_eq10 == pytest.approx(
        expected.ustar_over_ustar0_eq10, rel=1e-12
    )
