"""Tests of wind roses: what is read and what is refused."""

import pytest

from orchestrator.errors import InputError
from orchestrator.study.rose import read_rose

WHERE = "pile.toml: erosion.wind"
HEAD = "from_deg,speed_m_s,share\n"


def test_percentages_and_parts_are_one_rose() -> None:
    parts = read_rose(HEAD + "0,5,0.5\n360,9,0.25\n-90,0,0.25\n", "a.csv", WHERE)
    percent = read_rose(HEAD + "0,5,50\n0,9,25\n270,0,25\n", "b.csv", WHERE)
    assert parts == percent
    assert [row[0] for row in parts.rows] == [0.0, 0.0, 270.0]


def test_each_row_is_answered_by_the_nearest_flow() -> None:
    rose = read_rose(HEAD + "350,5,0.5\n100,5,0.5\n", "a.csv", WHERE)
    table = rose.table([0.0, 90.0, 180.0, 270.0], WHERE)
    assert table["solved_deg"].tolist() == [0.0, 90.0]
    assert table["share"].sum() == pytest.approx(1.0)


def test_wind_from_where_no_flow_is_is_refused() -> None:
    rose = read_rose(HEAD + "180,5,0.5\n0,5,0.5\n", "a.csv", WHERE)
    with pytest.raises(InputError, match="no flow is within 30 deg of 180"):
        rose.table([0.0], WHERE)
    calm = read_rose(HEAD + "180,0,0.5\n0,5,0.5\n", "a.csv", WHERE)
    assert calm.table([0.0], WHERE)["solved_deg"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("from,speed,share\n0,5,1\n", "line 1: no columns from_deg"),
        (HEAD + "0,5,0.5\n0,6,0.3\n", "shares add up to 0.8, not to 1 or 100"),
        (HEAD + "0,5,1\n0,x,0\n", "line 3: 'x' is no number"),
        (HEAD + "400,5,1\n", "line 2: from_deg 400"),
        (HEAD + "0,-1,1\n", "line 2: speed_m_s -1"),
        (HEAD + "0,500,1\n", "line 2: speed_m_s 500"),
        (HEAD + "0,5,-1\n0,5,2\n", "line 2: share -1"),
        (HEAD, "shares add up to 0"),
    ],
)
def test_what_is_no_rose_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_rose(text, "a.csv", WHERE)
    assert str(caught.value).startswith(WHERE)
    assert caught.value.remedy
