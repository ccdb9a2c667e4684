"""Speed against height: where it is read, and that the approach is the logarithmic law."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed.line import BedLine, between_flats, triangle
from orchestrator.flow.foam import SolvedFlow, flow_in
from orchestrator.flow.profiles import HIGHEST, PROFILES, UPSTREAM, places, profiles
from orchestrator.physics.velocity import log_law_speed
from tests.flow.conftest import PILE, Solve

FACE = PILE.height_m / np.tan(np.radians(PILE.slope_deg))


def at(table: pd.DataFrame, place: str) -> pd.DataFrame:
    return table[table["place"] == place]


def test_upstream_is_the_logarithmic_law_and_the_form_changes_it(solve: Solve) -> None:
    table = pd.read_csv(solve(PILE) / PROFILES)
    assert table["place"].unique().tolist() == [UPSTREAM, "toe", "crest", "lee"]
    ahead = at(table, UPSTREAM)
    height = ahead["height_m"].to_numpy()
    first = PILE.first_cell_m / 2 / np.cos(np.radians(PILE.slope_deg))
    assert height[0] == pytest.approx(first, rel=1e-6)
    assert 0.7 * HIGHEST < height[-1] / PILE.height_m < HIGHEST
    law = log_law_speed(PILE.ustar0_m_s, height, PILE.roughness_m)
    np.testing.assert_allclose(ahead["u_m_s"], law, rtol=0.05)
    over = {name: at(table, name)["u_m_s"].to_numpy() for name in ("crest", "lee")}
    assert np.all(over["crest"] > 1.05 * ahead["u_m_s"])
    # the flow separates behind the crest
    assert over["lee"][0] < 0 < over["lee"][-1]
    where = table.drop_duplicates("place").set_index("place")["x_m"]
    assert where["crest"] == pytest.approx(FACE)
    assert where["lee"] == pytest.approx(2 * FACE)


def test_an_exact_law_is_read_as_it_is(solve: Solve) -> None:
    """Over all places, since the heights are those above the bed."""
    read = SolvedFlow(solve(PILE))
    line = PILE.bed_line
    middles = read.mesh.middles
    above = middles[:, 2] - line.height(middles[:, 0])
    law = np.log(above / 1e-5)  # linear in the logarithm of the height
    vars(read)["velocity"] = np.column_stack([law, 0 * law, 0 * law])
    table = profiles(read, line)
    expected = np.log(table["height_m"].to_numpy() / 1e-5)
    first = table["height_m"] < PILE.first_cell_m
    np.testing.assert_allclose(table["u_m_s"][~first], expected[~first], rtol=1e-9)
    # the first cells over a slope are lower by a part of a percent
    np.testing.assert_allclose(table["u_m_s"][first], expected[first], rtol=0.01)


def test_the_lee_is_where_the_bed_is_level_behind_the_highest_crest() -> None:
    assert places(triangle(0.0, 0.02)) == {}
    two = between_flats(np.array([[0, 0], [1, 0.5], [2, 0], [3, 1], [4, 0]]), 1.0)
    assert places(two) == {"toe": 0.0, "crest": 3.0, "lee": 4.0}
    # a rough bed does not end at its first bump
    x = np.array([-9.0, 0, 1, 1.5, 1.6, 2, 9])
    bumpy = BedLine(tuple(x), (0.0, 0, 1, 0.4, 0.41, 0.005, 0), 1.0)
    assert places(bumpy)["lee"] == 2.0


def test_a_case_that_ran_again_is_read_again(solve: Solve) -> None:
    directory = solve(PILE)
    assert flow_in(directory) is flow_in(directory)
    velocity = SolvedFlow(directory).last_iteration / "U"
    before = flow_in(directory)
    velocity.touch()
    assert flow_in(directory) is not before
