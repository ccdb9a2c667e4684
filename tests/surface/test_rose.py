"""Tests of wind roses: what is read and what is refused."""

import numpy as np
import pytest

from orchestrator.errors import InputError
from orchestrator.surface.rose import read_rose

WHERE = "pile.toml: erosion.wind"
HEAD = "from_deg,speed_m_s,share\n"


def test_percentages_and_parts_are_one_rose() -> None:
    parts = read_rose(HEAD + "0,5,0.5\n360,9,0.25\n-90,0,0.25\n", "a.csv", WHERE)
    percent = read_rose(HEAD + "0,5,50\n0,9,25\n270,0,25\n", "b.csv", WHERE)
    assert parts == percent
    assert [row[0] for row in parts.rows] == [0.0, 0.0, 270.0]


@pytest.mark.parametrize(
    "rows", ["10,5,0.5\n90,9,0.5\n", "0,6,0.5\n90,9,0.5\n", "0,5,0.4\n90,9,0.6\n"]
)
def test_another_direction_speed_or_share_is_another_rose(rows: str) -> None:
    """An old answer would stand for it."""
    rose = read_rose(HEAD + "0,5,0.5\n90,9,0.5\n", "a.csv", WHERE)
    other = read_rose(HEAD + rows, "a.csv", WHERE)
    assert other != rose
    assert other.digest != rose.digest


def test_directions_go_from_north_over_east() -> None:
    """The flow of another quarter would answer a rose that is read the other way round."""
    rose = read_rose(HEAD + "80,5,0.7\n190,5,0.3\n", "a.csv", WHERE)
    table = rose.table([0.0, 90.0, 180.0, 270.0], WHERE)
    of = table.groupby("solved_deg")["share"].sum()
    assert of.to_dict() == pytest.approx({90.0: 0.7, 180.0: 0.3})


def test_each_row_is_answered_by_the_nearest_flow() -> None:
    rose = read_rose(HEAD + "350,5,0.5\n100,5,0.5\n", "a.csv", WHERE)
    table = rose.table([0.0, 90.0, 180.0, 270.0], WHERE)
    assert table["solved_deg"].tolist() == [0.0, 90.0]
    assert table["share"].sum() == pytest.approx(1.0)


def shares(directions: list[float], of: list[float], flows: list[float]) -> list[float]:
    """The share of time that each flow answers, of winds of 5 m/s."""
    lines = [f"{a!r},5,{b!r}" for a, b in zip(directions, of, strict=True)]
    rose = read_rose(HEAD + "\n".join(lines) + "\n", "a.csv", WHERE)
    table = rose.table(flows, WHERE)
    assert table["share"].sum() == pytest.approx(1.0, rel=1e-12)
    answered = table.groupby("solved_deg")["share"].sum()
    return [float(answered.get(flow, 0.0)) for flow in flows]


@pytest.mark.parametrize("sectors", [4, 8, 12, 16, 32, 36, 72])
@pytest.mark.parametrize("flows", [8, 12, 16])
@pytest.mark.parametrize("begin", [0.0, 5.0])
def test_a_uniform_wind_gives_each_flow_one_share(
    sectors: int, flows: int, begin: float
) -> None:
    directions = (begin + np.arange(sectors) * 360 / sectors).tolist()
    found = shares(
        directions, [1 / sectors] * sectors, np.arange(0, 360, 360 / flows).tolist()
    )
    assert found == pytest.approx([1 / flows] * flows, rel=1e-9)


def test_sectors_that_are_those_of_the_flows_stay_whole() -> None:
    rows = "".join(
        f"{way},{speed},0.125\n" for way in (270, 0, 90, 180) for speed in (3, 8)
    )
    table = read_rose(HEAD + rows, "a.csv", WHERE).table([0.0, 90, 180, 270], WHERE)
    assert table["solved_deg"].tolist() == table["from_deg"].tolist()
    assert table["share"].tolist() == [0.125] * 8


def test_compass_points_in_whole_degrees_are_sectors() -> None:
    # 22.5 degrees is written as 22 or 23
    directions = [
        0.0,
        23,
        45,
        68,
        90,
        113,
        135,
        158,
        180,
        203,
        225,
        248,
        270,
        293,
        315,
        338,
    ]
    found = shares(directions, [1 / 16] * 16, [45.0 * k for k in range(8)])
    assert found == pytest.approx([1 / 8] * 8, rel=1e-9)


def test_a_sector_is_shared_by_the_flows_that_it_overlaps() -> None:
    # sectors of 10 degrees: a quarter of that about 20 lies beyond 22.5
    found = shares([0.0, 20, 130], [0.2, 0.4, 0.4], [45.0 * k for k in range(8)])
    assert found == pytest.approx([0.5, 0.1, 0, 0.4, 0, 0, 0, 0], abs=1e-9)


@pytest.mark.parametrize(("wind", "flows"), [(30.0, [0.0, 60.0]), (15.0, [0.0, 30.0])])
def test_the_order_of_the_flows_does_not_matter(
    wind: float, flows: list[float]
) -> None:
    assert shares([wind], [1.0], flows) == pytest.approx([0.5, 0.5])
    assert shares([wind], [1.0], flows[::-1]) == pytest.approx([0.5, 0.5])
    # nor with flows on one side and many winds
    some = [0.0, 30, 50, 110, 200, 350]
    winds = [5.0 * k for k in range(72)]
    of = [float(k % 7 + 1) for k in range(72)]
    near = [share if min(abs((a - b + 180) % 360 - 180) for b in some) <= 30 else 0.0
            for a, share in zip(winds, of, strict=True)]  # fmt: skip
    parts = [share / sum(near) for share in near]
    one = dict(zip(some, shares(winds, parts, some), strict=True))
    for order in (some[::-1], some[3:] + some[:3]):
        other = dict(zip(order, shares(winds, parts, order), strict=True))
        assert {flow: other[flow] for flow in some} == pytest.approx(one, rel=1e-12)


def test_a_line_with_more_cells_than_the_head_is_refused() -> None:
    # 8,5 m/s in a German table: the share would be 5, of which the rest makes 1
    with pytest.raises(
        InputError, match=r"line 2: 4 cells, the head has 3.*decimal comma"
    ):
        read_rose(HEAD + "270,8,1,0\n", "a.csv", WHERE)


def test_wind_from_where_no_flow_is_is_refused() -> None:
    rose = read_rose(HEAD + "180,5,0.5\n0,5,0.5\n", "a.csv", WHERE)
    with pytest.raises(InputError, match="no flow is within 30 deg of 180"):
        rose.table([0.0], WHERE)
    calm = read_rose(HEAD + "180,0,0.5\n0,5,0.5\n", "a.csv", WHERE)
    assert calm.table([0.0], WHERE)["solved_deg"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("way,speed,share\n0,5,1\n", "line 1: no names of columns that are known"),
        (
            HEAD + "0,5,0.5\n0,6,0.3\n",
            "shares add up to 0.8, not to 1, 100 or the 8760",
        ),
        (HEAD + "0,5,1\n0,x,0\n", "line 3: speed_m_s: 'x' is no number"),
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
