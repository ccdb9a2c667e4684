"""Tests of wind roses: what is read and what is refused."""

import numpy as np
import pytest

from orchestrator.errors import InputError
from orchestrator.surface.rose import Rose, read_rose

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


def by_flow(rose: Rose, flows: list[float]) -> dict[float, float]:
    """The share of time that each flow answers."""
    table = rose.solved(flows, WHERE, 0.005, 10.0).by_flow
    found: dict[float, float] = {}
    for way, share in table[["solved_deg", "share"]].to_numpy(float).tolist():
        found[way] = found.get(way, 0.0) + share
    return found


def test_directions_go_from_north_over_east() -> None:
    """The flow of another quarter would answer a rose that is read the other way round."""
    rose = read_rose(HEAD + "80,5,0.7\n190,5,0.3\n", "a.csv", WHERE)
    found = by_flow(rose, [0.0, 90.0, 180.0, 270.0])
    assert found == pytest.approx(
        {0.0: 0.7 * 10 / 90, 90.0: 0.7 * 80 / 90, 180.0: 0.3 * 80 / 90, 270.0: 0.3 / 9}
    )


def test_each_wind_lies_between_the_two_flows_beside_it() -> None:
    rose = read_rose(HEAD + "350,5,0.25\n100,7,0.75\n", "a.csv", WHERE)
    table = rose.solved([270.0, 0.0, 180.0, 90.0], WHERE, 0.005, 10.0).table
    rows = table.groupby(["first_deg", "second_deg", "speed_m_s"])[
        ["second_part"]
    ].mean()
    assert rows["second_part"].to_dict() == pytest.approx(
        {(270.0, 0.0, 5.0): 80 / 90, (90.0, 180.0, 7.0): 10 / 90}
    )


def test_far_flows_are_not_interpolated() -> None:
    rose = read_rose(HEAD + "20,5,0.5\n95,7,0.5\n", "a.csv", WHERE)
    assert by_flow(rose, [0.0, 100.0]) == pytest.approx({0.0: 0.5, 100.0: 0.5})
    one = read_rose(HEAD + "20,5,0.5\n10,7,0.5\n", "a.csv", WHERE)
    assert by_flow(one, [0.0]) == pytest.approx({0.0: 1.0})


@pytest.mark.parametrize(
    ("height", "roughness"), [(2.0, 0.005), (80.0, 0.03), (10.0, 0.005)]
)
def test_winds_of_another_height_go_to_10_m_by_the_log_law(
    height: float, roughness: float
) -> None:
    rose = read_rose(HEAD + "0,5,1\n", "a.csv", WHERE)
    solved = rose.solved([0.0], WHERE, roughness, height)
    factor = np.log(10 / roughness) / np.log(height / roughness)
    assert solved.factor == pytest.approx(factor, rel=2e-3)
    assert solved.table["speed_m_s"].to_numpy() == pytest.approx(5 * factor, rel=2e-3)
    assert ("by the log law" in solved.said) == (height != 10.0)
    with pytest.raises(InputError, match="the log law needs 10 z0 at least"):
        rose.solved([0.0], WHERE, height / 5, height)


def shares(directions: list[float], of: list[float], flows: list[float]) -> list[float]:
    """The share of time that each flow answers, of winds of 5 m/s."""
    lines = [f"{a!r},5,{b!r}" for a, b in zip(directions, of, strict=True)]
    rose = read_rose(HEAD + "\n".join(lines) + "\n", "a.csv", WHERE)
    answered = by_flow(rose, flows)
    assert sum(answered.values()) == pytest.approx(1.0, rel=1e-12)
    return [answered.get(flow, 0.0) for flow in flows]


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


def test_a_sector_is_divided_among_its_directions() -> None:
    """A sector of 90 degrees about a flow: a quarter of it is nearer to each neighbour."""
    rows = "".join(f"{way},{5 if way else 9},0.25\n" for way in (270, 0, 90, 180))
    rose = read_rose(HEAD + rows, "a.csv", WHERE)
    table = rose.solved([0.0, 90, 180, 270], WHERE, 0.005, 10.0).by_flow
    of_north = table[table["speed_m_s"] == 9].groupby("solved_deg")["share"].sum()
    assert of_north.to_dict() == pytest.approx(
        {0.0: 0.1875, 90.0: 0.03125, 270.0: 0.03125}
    )


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


def test_a_narrow_sector_is_shared_by_the_flows_beside_it() -> None:
    # sectors of 10 degrees; 20 lies at four ninths between 0 and 45
    found = shares([0.0, 20, 130], [0.2, 0.4, 0.4], [45.0 * k for k in range(8)])
    share = 0.4 * 20 / 45
    edge = 0.2 * 2.5 / 45 / 2
    expected = [
        0.2 - 2 * edge + 0.4 - share,
        edge + share,
        0.4 * 5 / 45,
        0.4 * 40 / 45,
        0,
        0,
        0,
        edge,
    ]
    assert found == pytest.approx(expected, abs=1e-9)


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
        rose.solved([0.0], WHERE, 0.005, 10.0)
    calm = read_rose(HEAD + "180,0,0.5\n0,5,0.5\n", "a.csv", WHERE)
    assert by_flow(calm, [0.0]) == pytest.approx({0.0: 1.0})


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


def test_a_mean_that_is_likelier_in_another_unit_is_a_question() -> None:
    rows = "\n".join(f"2024-01-01 {hour:02d}:00,{18 + hour},270" for hour in range(8))
    asked = read_rose(f"date,ws,wd\n{rows}\n", "year.csv", "s.toml: erosion.wind")
    assert asked.question == (
        "the wind of year.csv is 21.5 m/s in the mean: did you mean km/h, 5.97 m/s?"
    )
    text = f"# speeds in km/h\ndate,ws,wd\n{rows}\n"
    assert read_rose(text, "year.csv", "s.toml: erosion.wind").question == ""
