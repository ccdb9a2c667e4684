"""Roots of many functions at once."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize.elementwise import find_root

from orchestrator.physics.roots import root
from orchestrator.types import FloatArray, IntArray


def test_roots_are_those_of_scipy_to_the_last_digit() -> None:
    random = np.random.default_rng(3)
    power = random.uniform(0.2, 9.0, 400)
    target = 10 ** random.uniform(-9, 9, 400)
    high = (target * 10 ** random.uniform(0, 3, 400)) ** (1 / power)

    def excess(x: FloatArray, at: IntArray) -> FloatArray:
        return np.asarray(x ** power[at] - target[at])

    found = root(excess, np.zeros(400), high)
    by_scipy: Any = find_root
    given = {"args": (np.arange(400.0),)}
    others = by_scipy(
        lambda x, at: excess(x, at.astype(int)), (np.zeros(400), high), **given
    )
    assert others.success.all()
    assert found.tolist() == others.x.tolist()
    assert found == pytest.approx(target ** (1 / power), rel=1e-13)


def test_a_root_takes_no_more_steps_than_that_of_scipy() -> None:
    steps = 0

    def cubes(x: FloatArray, at: IntArray) -> FloatArray:
        nonlocal steps
        steps += 1
        return x**3 - 2 * x - 5

    root(cubes, np.zeros(1), np.full(1, 3.0))
    others = find_root(lambda x: x**3 - 2 * x - 5, (0.0, 3.0))
    assert steps == others.nfev


def test_each_root_is_that_of_its_own_function() -> None:
    """A grain that has its root is not asked about again."""
    asked: list[list[int]] = []

    def lines(x: FloatArray, at: IntArray) -> FloatArray:
        asked.append(at.tolist())
        return np.where(at == 0, x, x**5 - 1e-3 * at)

    found = root(lines, np.zeros(3), np.ones(3))
    assert found == pytest.approx([0.0, 1e-3**0.2, 2e-3**0.2], rel=1e-14)
    assert asked[2] == [1, 2]


def test_no_grain_has_no_root() -> None:
    assert root(lambda x, at: x, np.zeros(0), np.zeros(0)).tolist() == []


def test_a_root_that_is_not_found_is_not_known() -> None:
    """The last place tried was told as the root."""
    target = np.array([0.5, 8.0, 100.0])

    def cubes(x: FloatArray, at: IntArray) -> FloatArray:
        return np.where(x > 1.5, np.nan, x**3 - target[at])

    found = root(cubes, np.zeros(3), np.array([1.0, 4.0, 1.0]))
    assert found[0] == pytest.approx(0.5 ** (1 / 3), rel=1e-12)
    assert np.isnan(found[1:]).all()
