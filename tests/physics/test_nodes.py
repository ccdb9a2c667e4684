"""Tables of numbers that are linear between nodes."""

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from orchestrator.physics.nodes import Nodes


def test_numbers_are_those_of_scipy_to_the_last_digit() -> None:
    random = np.random.default_rng(5)
    axes = [np.cumsum(random.uniform(0.1, 2, count)) for count in (4, 2, 7)]
    numbers = random.normal(size=(4, 2, 7, 3))
    inside = [random.uniform(axis[0], axis[-1], 500) for axis in axes]
    # nodes, both ends among them
    corners = [each.ravel() for each in np.meshgrid(*axes)]
    point = [np.append(*pair) for pair in zip(inside, corners, strict=True)]
    found = Nodes(axes, numbers).at(*point)
    others = RegularGridInterpolator(axes, numbers)(np.column_stack(point))
    assert found.T.tolist() == others.tolist()


def test_a_place_that_is_not_known_has_no_numbers() -> None:
    table = Nodes([np.arange(3.0), np.arange(2.0)], np.ones((3, 2, 2)))
    found = table.at(np.array([np.nan, 1.5, 0.5]), np.array([0.5, np.nan, 0.5]))
    assert np.isnan(found).tolist() == [[True, True, False]] * 2
