"""Winds of a place in the shapes in which weather services and models give them."""

from collections.abc import Callable
from datetime import datetime, timedelta

import pytest

from orchestrator.errors import InputError
from orchestrator.study import compass
from orchestrator.study.source import decoded
from orchestrator.study.wind import Winds, read_winds

WHERE = "pile.toml: erosion.wind"
HOURS = 24 * 20
"""Hours of a series: more than twelve days tell the day from the month."""
TIMES = [datetime(2019, 1, 1) + timedelta(hours=hour) for hour in range(HOURS)]


def wind(hour: int) -> tuple[int, int]:
    """Direction and speed, m/s: of eight hours three from the west, two from the east."""
    of_eight = [
        (270, 8),
        (270, 4),
        (90, 4),
        (270, 8),
        (360, 12),
        (90, 4),
        (180, 6),
        (180, 6),
    ]
    return of_eight[hour % 8]


EXPECTED = {
    (270.0, 8.0): 0.25,
    (270.0, 4.0): 0.125,
    (90.0, 4.0): 0.25,
    (0.0, 12.0): 0.125,
    (180.0, 6.0): 0.25,
}


def series(head: str, line: Callable[[datetime, int, int], str]) -> str:
    """A file with a line for each hour."""
    lines = [line(time, *wind(hour)) for hour, time in enumerate(TIMES)]
    return "\n".join([head, *lines, ""])


def check(found: Winds, unit: float = 1.0) -> None:
    """That winds are those of the series."""
    got = {(way, round(speed, 6)): share for way, speed, share in found.rows}
    assert {way for way, _ in got} == {way for way, _ in EXPECTED}
    expected = {
        (way, round(unit * u, 6)): share for (way, u), share in EXPECTED.items()
    }
    assert got == pytest.approx(expected)


SERIES = {
    "MEDEA": (
        series("date,ws,wd,stabclass,z", lambda t, d, u: f"{t:%Y-%m-%dT%H:%M:%SZ},{u},{d},B,10"),
        1.0,
        10.0,
    ),
    "Germany's service": (
        series(
            "STATIONS_ID;MESS_DATUM;QN_3;   F;   D;eor",
            lambda t, d, u: f"       2667;{t:%Y%m%d%H};    3;{u:6.1f};{d:4d};eor",
        ),
        1.0,
        None,
    ),
    "KNMI": (
        "# BRON: KNMI\n# DD = Windrichting (in graden); FH = Uurgemiddelde windsnelheid\n"
        + series(
            "# STN,YYYYMMDD,   HH,   DD,   FH,   FF,   FX\n#",
            lambda t, d, u: f"  235,{t:%Y%m%d},{t.hour + 1:5d},{d:5d},{10 * u:5d},   70,  110",
        ),
        1.0,
        None,
    ),
    "airports": (
        series("station,valid,drct,sknt", lambda t, d, u: f"EDDF,{t:%Y-%m-%d %H:%M},{d},{u}"),
        1852 / 3600,
        None,
    ),
    "Meteostat": (
        series(
            "time,temp,dwpt,wdir,wspd,wpgt,pres,coco",
            lambda t, d, u: f"{t:%Y-%m-%d %H:%M:%S},1.0,,{d},{u},,1013,1",
        ),
        1 / 3.6,
        None,
    ),
    "a model's point": (
        "latitude,longitude,elevation\n52.5,13.4,38\n\n"
        + series(
            "time,wind_speed_80m (km/h),wind_direction_80m (°)",
            lambda t, d, u: f"{t:%Y-%m-%dT%H:%M},{u},{d}",
        ),
        1 / 3.6,
        80.0,
    ),
    "a logger in German": (
        series(
            "Datum;Uhrzeit;Windgeschwindigkeit (m/s);Windrichtung (°)",
            lambda t, d, u: f"{t:%d.%m.%Y};{t:%H:%M};{u},0;{d}",
        ),
        1.0,
        None,
    ),
    "months before days": (
        series(
            "Date/Time,Wind Speed (mph),Wind Direction",
            lambda t, d, u: f"{t:%m/%d/%Y %H:%M},{u},{d}",
        ),
        0.44704,
        None,
    ),
    "a column for each part of the time": (
        series(
            "Year,Month,Day,Hour,Wind Speed at 2 m (m/s),Wind Direction",
            lambda t, d, u: f"{t.year},{t.month},{t.day},{t.hour},{u},{d}",
        ),
        1.0,
        2.0,
    ),
    "AeoLiS with names": (
        series(
            "t (s) u (m/s) dir",
            lambda t, d, u: f"{(t - TIMES[0]).total_seconds():.0f} {u} {d}",
        ),
        1.0,
        None,
    ),
}  # fmt: skip


SERIES |= {
    "ISD-Lite": (
        "\n".join(
            f"{t:%Y %m %d %H}   -11   -56 10123 {d:5d} {10 * u:5d}     8     0 -9999"
            for t, (d, u) in ((time, wind(hour)) for hour, time in enumerate(TIMES))
        ),
        1.0,
        None,
    ),
    "NOAA by the hour": (
        series(
            '"STATION","DATE","WND"',
            lambda t, d, u: f'"012","{t:%Y-%m-%dT%H:%M:%S}","{d:03d},1,N,{10 * u:04d},1"',
        ),
        1.0,
        None,
    ),
    "seconds since 1970": (
        series("timestamp,ws,wd", lambda t, d, u: f"{(t - datetime(1970, 1, 1)).total_seconds():.0f},{u},{d}"),
        1.0,
        None,
    ),
    "Canada's service": (
        series(
            '"Date/Time (LST)","Wind Dir (10s deg)","Wind Spd (km/h)"',
            lambda t, d, u: f'"{t:%Y-%m-%d %H:%M}","{d // 10}","{u}"',
        ),
        1 / 3.6,
        None,
    ),
    "a height above the table": (
        "# Anemometer height: 33 ft\n"
        + series("time,ws,wd", lambda t, d, u: f"{t:%Y-%m-%d %H:%M},{u},{d}"),
        1.0,
        10.0584,
    ),
    "a zone beside the time": (
        series("valid(UTC),drct,sknt", lambda t, d, u: f"{t:%Y-%m-%d %H:%M},{d},{u}"),
        1852 / 3600,
        None,
    ),
    "words of a logger": (
        series(
            "Datum/Uhrzeit (MEZ);Windgeschw. (m/s);Richtung (°)",
            lambda t, d, u: f"{t:%d.%m.%Y %H:%M};{u},0;{d}",
        ),
        1.0,
        None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SERIES)
def test_series_of_services_are_read(name: str) -> None:
    text, unit, height = SERIES[name]
    found = read_winds(text, WHERE)
    check(found, unit)
    assert found.height == height
    assert "480 hours with a wind, 0 without" in found.understood
    assert "in steps of 1 h" in found.understood
    assert "less than a year" in found.understood


def test_parts_towards_east_and_north_are_where_the_wind_comes_from() -> None:
    text = "time,u10,v10\n2020-01-01 00:00,5,0\n2020-01-01 01:00,0,-5\n"
    found = read_winds(text, WHERE)
    assert found.rows == ((270.0, 5.0, 0.5), (0.0, 5.0, 0.5))
    assert found.height == 10.0


def test_gaps_calms_and_variable_winds_count_for_what_they_are() -> None:
    head = "date,ws,wd\n"
    rows = [
        "00:00,4,270",
        "01:00,0,",
        "02:00,,90",
        "03:00,-999,90",
        "04:00,2,VRB",
        "05:00,4,90",
    ]
    text = head + "\n".join(f"2020-01-01 {row}" for row in rows)
    found = read_winds(text, WHERE)
    shares = {(way, speed): share for way, speed, share in found.rows}
    # of four hours with a wind one is calm, and one goes half to each direction
    assert shares == {
        (270.0, 4.0): 0.25,
        (0.0, 0.0): 0.25,
        (90.0, 4.0): 0.25,
        (270.0, 2.0): 0.125,
        (90.0, 2.0): 0.125,
    }
    assert "4 hours with a wind, 2 without" in found.understood
    assert "25 % without a direction" in found.understood
    # lines that are missing are gaps as well
    lines = [row for row in rows if "02:" not in row and "03:" not in row]
    other = read_winds(head + "\n".join(f"2020-01-01 {row}" for row in lines), WHERE)
    assert other.rows == found.rows
    assert "4 hours with a wind, 2 without" in other.understood


def test_numbers_for_no_observation_count_for_nothing_and_are_said() -> None:
    """ISD writes 9999 for no speed, and 999 for a direction that varies or is none."""
    rows = ["00:00,4,270", "01:00,9999,90", "02:00,2,999", "03:00,6,9999", "04:00,4,90",
            "05:00,99.9,90", "06:00,4,-999", "07:00,0,9999"]  # fmt: skip
    text = "date,ws,wd\n" + "\n".join(f"2020-01-01 {row}" for row in rows)
    found = read_winds(text, WHERE)
    shares = {(way, speed): share for way, speed, share in found.rows}
    assert shares == {
        (270.0, 4.0): 0.25,
        (90.0, 4.0): 0.25,
        (270.0, 2.0): 0.125,
        (90.0, 2.0): 0.125,
        (0.0, 0.0): 0.25,
    }
    for said in (
        "4 hours with a wind, 4 without",
        "9999 in 'ws' stands for no speed, 1 line",
        "99.9 in 'ws' stands for no speed, 1 line",
        "999 in 'wd' stands for a variable or unknown direction, 1 line",
        "9999 in 'wd' stands for no observation of a direction, 2 lines",
        "-999 in 'wd' stands for no observation of a direction, 1 line",
        "25 % without a direction",
    ):
        assert said in found.understood


def test_marks_of_noaa_are_calm_variable_or_none() -> None:
    cells = ["270,1,N,0040,1", "999,9,C,0000,1", "999,9,V,0020,1", "999,9,9,0050,1",
             "090,1,N,9999,9", "090,1,N,0040,1"]  # fmt: skip
    rows = [f'2020-01-01T{hour:02d}:00:00,"{cell}"' for hour, cell in enumerate(cells)]
    found = read_winds("\n".join(["DATE,WND", *rows]), WHERE)
    shares = {(way, speed): share for way, speed, share in found.rows}
    assert shares == {
        (270.0, 4.0): 0.25,
        (0.0, 0.0): 0.25,
        (270.0, 2.0): 0.125,
        (90.0, 2.0): 0.125,
        (90.0, 4.0): 0.25,
    }
    assert "4 hours with a wind, 2 without" in found.understood
    with pytest.raises(InputError, match=r"line 2: WND has a direction, a speed and"):
        read_winds("DATE,WND\n2020-01-01T00:00:00,270\n", WHERE)


def test_a_usual_wind_is_no_mark_of_its_unit() -> None:
    text = "date,ws (km/h),wd\n2020-01-01 00:00,99.9,270\n2020-01-01 01:00,999.9,90\n"
    found = read_winds(text, WHERE)
    assert [(way, round(speed, 6), share) for way, speed, share in found.rows] == [
        (270.0, 27.75, 1.0)
    ]


def of_speeds(unit: str, speeds: list[float], above: str = "") -> str:
    """A series of some speeds, each from another direction."""
    rows = [
        f"2020-01-01 {hour:02d}:00,{speed:g},{30 * hour + 10}"
        for hour, speed in enumerate(speeds)
    ]
    return "\n".join([*([above] if above else []), f"date,ws{unit},wd", *rows, ""])


def test_99_is_no_speed_where_all_others_are_far_below() -> None:
    found = read_winds(of_speeds("", [5, 99, 3, 99, 12]), WHERE)
    shares = {(way, speed): share for way, speed, share in found.rows}
    assert shares == pytest.approx(
        {(10.0, 5.0): 1 / 3, (70.0, 3.0): 1 / 3, (130.0, 12.0): 1 / 3}
    )
    assert "3 hours with a wind, 2 without" in found.understood
    assert "99 in 'ws' stands for no speed, 2 lines" in found.understood
    assert "mean 6.67 m/s" in found.understood


def test_99_is_a_speed_where_others_are_like_it_or_its_unit_is_small() -> None:
    found = read_winds(of_speeds(" (knots)", [5, 99, 72]), WHERE)
    assert [speed for _, speed, _ in found.rows] == pytest.approx(
        [5 * 1852 / 3600, 99 * 1852 / 3600, 72 * 1852 / 3600]
    )
    found = read_winds(of_speeds(" (km/h)", [5, 99, 18]), WHERE)
    assert [speed for _, speed, _ in found.rows] == pytest.approx([5 / 3.6, 27.5, 5])


def test_parts_that_stand_for_none_are_no_wind() -> None:
    rows = ["3,4", "-99,-99", "-999,2", "0,99.9", "-5,12"]
    lines = [f"2020-01-01 {hour:02d}:00,{row}" for hour, row in enumerate(rows)]
    found = read_winds("\n".join(["time,u10,v10", *lines, ""]), WHERE)
    assert [(speed, share) for _, speed, share in found.rows] == [(5, 0.5), (13, 0.5)]
    assert "-99 in 'u10' stands for no speed, 1 line" in found.understood
    assert "99.9 in 'v10' stands for no speed, 1 line" in found.understood


@pytest.mark.parametrize(
    ("above", "factor", "said"),
    [
        ("# speeds in knots", 1852 / 3600, "in knots, by line 1"),
        ("# Wind speed: km/h", 1 / 3.6, "in km/h, by line 1"),
        ("Units: mph", 0.44704, "in mph, by line 1"),
        ("Station 7\n# speed at 10 m (kn)", 1852 / 3600, "in kn, by line 2"),
        ("# 10 min mean wind speed in miles per hour", 0.44704, "in miles per hour"),
        ("# FF: wind speed in 0.1 m/s", 0.1, "in 0.1 m/s, by line 1"),
        ("# speeds in m/s", 1.0, "in m/s, by line 1"),
        ("# knots", 1852 / 3600, "in knots, by line 1"),
        ("# speeds below 2 kt are calm; 1 kt = 0.514 m/s", 1.0, "names no unit"),
        ("# starting speed of the anemometer 0.4 m/s", 1.0, "names no unit"),
    ],
)
def test_a_line_above_may_name_the_unit_of_all_speeds(
    above: str, factor: float, said: str
) -> None:
    found = read_winds(of_speeds("", [5, 10, 18], above), WHERE)
    assert [speed for _, speed, _ in found.rows] == pytest.approx(
        [5 * factor, 10 * factor, 18 * factor]
    )
    assert said in found.understood


def test_a_line_above_names_the_unit_of_classes_and_of_parts() -> None:
    table = "Direction,0-20,20-40\nN,40,10\nS,30,20\n"
    found = read_winds(f"# Wind rose, speeds in km/h\n{table}", WHERE)
    assert max(speed for _, speed, _ in found.rows) == pytest.approx(39 / 3.6)
    assert "classes of speeds in km/h, by line 1" in found.understood
    series = "time,u10,v10\n2020-01-01 00:00,3,4\n2020-01-01 01:00,5,12\n"
    found = read_winds(f"# units: knots\n{series}", WHERE)
    assert [speed for _, speed, _ in found.rows] == pytest.approx(
        [5 * 1852 / 3600, 13 * 1852 / 3600]
    )


@pytest.mark.parametrize(
    ("above", "unit", "message"),
    [
        (
            "# speeds in knots",
            " (m/s)",
            r"line 1: speeds in knots, and 'ws \(m/s\)' is",
        ),
        ("# speeds in mph\n# wind in km/h", "", "line 2: which unit .* mph or km/h"),
        ("# ws: m/s, wind: kt", "", "line 1: which unit have the speeds: m/s or kt"),
        ("# gusts in knots", "", r"line 1: it speaks of knots.*ws \(m/s\)"),
        ("# converted from mph", "", "line 1: it speaks of mph"),
        ("# speeds in Beaufort", "", "line 1: it speaks of beaufort"),
        ("# wind speed in tenths of m/s", "", "line 1: it speaks of tenths"),
    ],
)
def test_a_line_above_that_is_not_certain_is_asked_about(
    above: str, unit: str, message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_winds(of_speeds(unit, [5, 10, 18], above), WHERE)
    assert str(caught.value).startswith(WHERE)
    assert caught.value.remedy


@pytest.mark.parametrize("above", ["# speeds in kt", "# gusts in km/h"])
def test_a_line_above_may_say_what_a_column_says(above: str) -> None:
    found = read_winds(of_speeds(" (knots)", [5, 18], above), WHERE)
    assert max(speed for _, speed, _ in found.rows) == pytest.approx(18 * 1852 / 3600)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("time,wind speed 33 ft (mph),wd", 0.44704),
        ("time,ws_33ft_mph,wd", 0.44704),
        ("time,Wind Speed at 33 feet (ft/s),wd", 0.3048),
        ("time,ws,wd,z (ft)", 1.0),
    ],
)
def test_heights_in_feet_and_the_unit_of_speeds_are_both_read(
    head: str, unit: float
) -> None:
    more = ",33" if "z (ft)" in head else ""
    rows = [f"2020-01-01 {hour:02d}:00,10,270{more}" for hour in range(3)]
    found = read_winds("\n".join([head, *rows]), WHERE)
    assert found.height == pytest.approx(10.0584)
    ((way, speed, share),) = found.rows
    assert (way, share) == (270.0, 1.0)
    assert speed == pytest.approx(10 * unit)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16"])
def test_winds_are_read_in_each_encoding(encoding: str) -> None:
    text = series("Zeit;Windgeschwindigkeit (m/s);Windrichtung (°)", lambda t, d, u: f"{t:%Y-%m-%d %H:%M};{u},0;{d}")  # fmt: skip
    check(read_winds(decoded(text.encode(encoding), WHERE, is_data=True), WHERE))


def test_observations_between_the_hours_do_not_count_twice() -> None:
    """Airports observe more often in bad weather."""
    hours = [f"2020-01-01 {hour:02d}:00,4,270" for hour in range(10)]
    more = [f"2020-01-01 05:{minute},20,90" for minute in (15, 30, 45)]
    found = read_winds("valid,ws,wd\n" + "\n".join([*hours, *more]), WHERE)
    shares = {(way, speed): share for way, speed, share in found.rows}
    assert shares == pytest.approx({(270.0, 4.0): 0.925, (90.0, 20.0): 0.075})
    # as well where each part of the time has a column of its own
    hours = [f"2020,1,1,{hour},0,4,270" for hour in range(10)]
    more = [f"2020,1,1,5,{minute},20,90" for minute in (15, 30, 45)]
    head = "year,month,day,hour,minute,ws,wd\n"
    assert read_winds(head + "\n".join([*hours, *more]), WHERE).rows == found.rows


ALIKE = {
    "shares": "from_deg,speed_m_s,share\n270,8,0.5\n90,4,0.3\n0,0,0.2\n",
    "per cent": "Direction (deg),Speed (m/s),Frequency (%)\n270,8,50\n90,4,30\n0,0,20\n",
    "hours": "from_deg,speed_m_s,share\n270,8,4380\n90,4,2628\n0,0,1752\n",
    "hours by name": "wd,ws,hours\n270,8,4380\n90,4,2628\n,0,1752\n",
    "counts": "wd,ws,count\n270,8,25\n90,4,15\n0,0,10\n",
    "a calm without a direction": "from_deg,speed_m_s,share\n270,8,0.5\n90,4,0.3\n,0,0.2\n",
    "semicolons and commas": "from_deg;speed_m_s;share\n270;8,0;0,5\n90;4;0,3\n;0;0,2\n",
    "sectors by name": "Wind direction,Wind speed (km/h),%\nW,28.8,50\nE,14.4,30\nCalm,0,20\n",
    "words": "direction,speed,frequency\nWest,8,0.5\neast,4,0.3\ncalm,0,0.2\n",
    "a comment": "# winds of 2019\nfrom_deg,speed_m_s,share\n270,8,0.5\n90,4,0.3\n0,0,0.2\n",
}


@pytest.mark.parametrize("name", ALIKE)
def test_tables_of_frequencies_are_one(name: str) -> None:
    found = read_winds(ALIKE[name], WHERE)
    rows = [(way, round(speed, 9), share) for way, speed, share in found.rows]
    expected = [(270.0, 8.0, 0.5), (90.0, 4.0, 0.3), (0.0, 0.0, 0.2)]
    assert rows == [pytest.approx(row) for row in expected]
    assert "calm 20 % of the time, mean 5.2 m/s" in found.understood


CLASSES = {
    "sectors over classes": (
        "Direction,0-2,2-4,>4,Total\nN,10,20,5,35\nE,5,10,15,30\nCalm,35,,,35\nTotal,50,30,20,100\n"
    ),
    "degrees over classes": (
        "Richtung;0-2 m/s;2-4 m/s;>4 m/s\n0;10;20;5\n90;5;10;15,0\nStille;35;;\n"
    ),
    "classes over sectors": "Speed (m/s),N,E\nCalm,35,\n0-2,10,5\n2 to 4,20,10\n4+,5,15\n",
    "hours": (
        "Direction,<2,2-4,≥4\nNorth,876,1752,438\nEast,438,876,1314\nCalm,3066,,\n"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CLASSES)
def test_classes_of_speeds_are_spread_evenly(name: str) -> None:
    found = read_winds(CLASSES[name], WHERE)
    of: dict[tuple[float, str], float] = {}
    for way, speed, share in found.rows:
        word = (
            "calm"
            if speed == 0
            else "low"
            if speed < 2
            else "mid"
            if speed < 4
            else "high"
        )
        key = (way if speed else 0.0, word)
        of[key] = of.get(key, 0.0) + share
    assert of == pytest.approx(
        {
            (0.0, "low"): 0.1,
            (0.0, "mid"): 0.2,
            (0.0, "high"): 0.05,
            (90.0, "low"): 0.05,
            (90.0, "mid"): 0.1,
            (90.0, "high"): 0.15,
            (0.0, "calm"): 0.35,
        }
    )
    mean = 0.15 * 1 + 0.3 * 3 + 0.2 * 4
    assert sum(speed * share for _, speed, share in found.rows) == pytest.approx(mean)
    # nothing says how far the highest class goes
    assert "those above 4 taken at 4" in found.understood
    assert "classes of speeds in m/s" in found.understood


def test_a_table_of_wasp_has_sectors_and_thousandths() -> None:
    text = (
        "A station\n 52.0 5.0 20\n 4 1.0 0\n 40 30 20 10\n"
        " 5 500 400 300 200\n 10 500 600 700 800\n"
    )
    found = read_winds(text, WHERE)
    assert found.height == 20.0
    of_north = sum(share for way, _, share in found.rows if way == 0)
    fast = sum(share for _, speed, share in found.rows if speed > 5)
    assert of_north == pytest.approx(0.4)
    assert fast == pytest.approx(0.4 * 0.5 + 0.3 * 0.6 + 0.2 * 0.7 + 0.1 * 0.8)


@pytest.mark.parametrize(
    ("names", "degrees"),
    [
        ("N NNE NE ENE E", [0, 22.5, 45, 67.5, 90]),
        ("N NO O SO S SW W NW", [0, 45, 90, 135, 180, 225, 270, 315]),
        ("N NE E SE S SO O NO", [0, 45, 90, 135, 180, 225, 270, 315]),
        ("N NO O ZO Z ZW W NW", [0, 45, 90, 135, 180, 225, 270, 315]),
        ("N NØ Ø SØ S SV V NV", [0, 45, 90, 135, 180, 225, 270, 315]),
        ("north north-east South_West Süd", [0, 45, 225, 180]),
    ],
)
def test_letters_of_a_compass_mean_what_their_language_says(
    names: str, degrees: list[float]
) -> None:
    assert compass.degrees_of(names.split()) == degrees


REFUSED = {
    "wd,ws,hours\n270,8,5256\n": "add up to 5256, not to 8760 .add the calms",
    "from_deg,speed_m_s\n270,8\n": "neither a time nor a share",
    "date,ws,wd\n2020-01-01 00:00,5,360\nyesterday,5,90\n": "line 3: 'yesterday' is no time",
    "date,ws,wd\n2020-01-01 00:00,5,400\n": "line 2: wd 400",
    "date,ws,wd\n2020-01-01 00:00,-3,40\n": "line 2: ws -3",
    "date,ws,wd\n2020-01-01 00:00,fast,40\n": "line 2: ws: 'fast' is no number",
    "date,ws,wd\n01/02/2020 00:00,5,40\n01/02/2020 01:00,5,40\n": "the day or the month",
    "date,ws,wd\n2020-01-01 00:00,5,90\n": "one time is no series",
    "date,ws,wd\n2020-01-01 00:00,5,\n2020-01-01 01:00,5,\n": "no wind has a direction",
    "time,ws_10m,ws_80m,wd\n": "no line has a wind",
    "date,wind speed (%),wd\n2020-01-01 00:00,5,9\n": r"line 1: wind speed \(%\): speeds in %",
    "time,ws_10m,ws_80m,wd\n2020-01-01 00:00,5,6,90\n": "which column is the speed: ws_10m or ws_80m",
    "time,ws_10m,wd_80m\n2020-01-01 00:00,5,90\n": "its columns are of 10 m and 80 m",
    "date,ws,wd,z\n2020-01-01 00:00,5,90,2\n2020-01-01 01:00,5,90,10\n": "winds of one height",
    "Richtung;0-2;>2\nN;50;10\nO;30;10\n": "'o' is no direction that is told from the others",
    "0 5 270\n3600 6 280\n": "in '0 5 270' .name the columns",
    "richting,kracht\n1,2\n": "no names of columns that are known.* direction, winddir.* share.*your-files.md",
    "Direction,0-2,2-4\nN,60,30\n": "shares add up to 90",
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_winds_that_are_not_certain_are_asked_about(text: str) -> None:
    with pytest.raises(InputError, match=REFUSED[text]) as caught:
        read_winds(text, WHERE)
    assert str(caught.value).startswith(WHERE)
    assert caught.value.remedy
    assert "\n" not in str(caught.value)


def test_two_stations_in_one_file_are_asked_about() -> None:
    one = series("date,ws,wd", lambda t, d, u: f"{t:%Y-%m-%d %H:%M},{u},{d}")
    both = one + "\n".join(one.splitlines()[1:]) + "\n"
    with pytest.raises(InputError, match=r"line 482: 480 times stand twice"):
        read_winds(both, WHERE)
    # one hour stands twice where summer time ends
    lines = one.splitlines()
    once = read_winds("\n".join([*lines, lines[50]]) + "\n", WHERE)
    assert sum(share for *_, share in once.rows) == pytest.approx(1.0)


def test_directions_in_tens_of_degrees_are_asked_about() -> None:
    rows = [f"2020-01-01 {h:02d}:00,5,{h + 1}" for h in range(24)]
    with pytest.raises(
        InputError, match=r"tens of degrees.* wd \(10 deg\), or wd \(deg"
    ):
        read_winds("date,ws,wd\n" + "\n".join(rows), WHERE)
    found = read_winds("date,ws,wd (deg)\n" + "\n".join(rows), WHERE)
    assert max(way for way, *_ in found.rows) == 24.0
    found = read_winds("date,ws,wd (10 deg)\n" + "\n".join(rows), WHERE)
    assert max(way for way, *_ in found.rows) == 240.0


def test_directions_in_radians_are_asked_about() -> None:
    rows = [f"2020-01-01 {h:02d}:00,5,{0.25 * h + 0.01:.2f}" for h in range(24)]
    with pytest.raises(InputError, match="did you mean radians"):
        read_winds("date,ws,wd\n" + "\n".join(rows), WHERE)
