"""The command `threshold` as a user runs it: what it prints, asks and refuses."""

import csv
import io
import json
import math
from collections.abc import Callable
from typing import Any

import pytest

from orchestrator import cli
from orchestrator.physics.laws import LAWS

Ended = tuple[int, str, str]
Run = Callable[..., Ended]

SAND_IN_AIR = ["--diameter", "2e-4", "--slope", "15"]
WATER = ["--fluid-density", "1000", "--viscosity", "1e-6"]
QUARTZ_IN_WATER = ["--diameter", "5e-4", "--density", "2650", *WATER]
RANGE = "1e-4:1.6e-3:5"


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `threshold` in this process: its exit code, output and complaints."""

    def of(*arguments: str) -> Ended:
        try:
            code = cli.main(["threshold", *arguments])
        except SystemExit as end:  # argparse
            code = int(end.code or 0)
        said = capsys.readouterr()
        return code, said.out, said.err

    return of


def _json(ended: Ended) -> Any:
    assert ended[0] == 0, ended[2]
    return json.loads(ended[1])


def _csv(ended: Ended) -> list[dict[str, str]]:
    assert ended[0] == 0, ended[2]
    return list(csv.DictReader(io.StringIO(ended[1])))


def test_json_has_an_object_for_each_law_that_agrees_with_itself(run: Run) -> None:
    found = _json(run(*SAND_IN_AIR, "--json"))
    assert found["regime"] == "transition"
    assert found["paper"] == ["low", "high"]
    assert found["answer"] == ["bridged"]
    assert found["input"]["roughness"] == pytest.approx(2e-4 / 30)
    for name in LAWS:
        one = found[name]
        ustar = one["friction_velocity"]
        assert one["reynolds"] == pytest.approx(ustar * 2e-4 / 1e-5)
        assert one["stress"] == pytest.approx(ustar**2)
        assert one["shields"] == pytest.approx(one["stress"] / (2499 * 9.81 * 2e-4))
        for height in (1, 10):
            wind = ustar / 0.41 * math.log(1 + height * 30 / 2e-4)
            assert one[f"wind_speed_{height}_m"] == pytest.approx(wind)
        assert one["mean_velocity"] is None
        assert one["drag"] > 0
        assert one["valid"] is (name not in ("low", "high"))
        assert bool(one["why_not"]) is not one["valid"]
    assert found["low"]["why_not"] == "Re* 9.32 is not below 3"
    assert found["claudin-andreotti"]["lift"] == 0
    # the two answers that sand in air used to have enclose the bridged one
    low, high = (found[name]["friction_velocity"] for name in ("low", "high"))
    assert high < found["bridged"]["friction_velocity"] < low


def test_the_moments_of_each_law_balance_about_the_pivot(run: Run) -> None:
    found = _json(run(*QUARTZ_IN_WATER, "--slope", "10", "--entrainment-angle", "50", "--json"))
    weight = math.pi / 6 * 5e-4**3 * 1650 * 9.81
    beta, lean = math.radians(50), math.radians(10 - 50)
    for name in LAWS.keys() - {"zeng-torque"}:
        one = found[name]
        moment = one["drag"] * math.sin(beta) + one["lift"] * math.cos(beta)
        assert moment == pytest.approx(weight * math.cos(lean), rel=1e-9), name


def test_a_liquid_of_a_depth_has_a_mean_velocity_and_no_winds(run: Run) -> None:
    found = _json(run(*QUARTZ_IN_WATER, "--depth", "1", "--json"))["bridged"]
    assert found["wind_speed_10_m"] is None
    z0 = 5e-4 / 30
    mean = found["friction_velocity"] / 0.41 * ((1 + z0) * math.log(1 + 1 / z0) - 1)
    assert found["mean_velocity"] == pytest.approx(mean)
    _, out, _ = run(*QUARTZ_IN_WATER, "--depth", "1")
    assert "mean velocity, m/s" in out
    assert "wind" not in out
    assert "--depth" not in out
    _, out, _ = run(*QUARTZ_IN_WATER)
    assert "mean velocity, m/s" not in out
    assert "give its depth, --depth in m" in out


def test_gravity_goes_into_weight_and_shields_number(run: Run) -> None:
    given = ["--diameter", "1e-3", "--lift-coefficient", "0", "--viscosity", "1e-3", "--json"]
    earth, moon = (_json(run(*given, "--gravity", g))["low"] for g in ("9.81", "1.62"))
    # without a lift Eq. 3 is u*^2 over g
    ratio = moon["friction_velocity"] / earth["friction_velocity"]
    assert ratio == pytest.approx(math.sqrt(1.62 / 9.81))
    assert moon["shields"] == pytest.approx(earth["shields"])


def test_one_answer_comes_first_and_the_laws_beside_it(run: Run) -> None:
    code, out, err = run(*SAND_IN_AIR)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "Force law bridged: a grain of 0.2 mm starts to move at"
    assert lines[1].split() == ["u*,", "m/s", "0.4259"]
    found = _json(run(*SAND_IN_AIR, "--json"))
    for name in LAWS:
        row = next(line.split() for line in lines if line.split()[:1] == [name])
        assert row[1] == f"{found[name]['friction_velocity']:.4g}"
        assert row[6] == ("yes" if found[name]["valid"] else "no:")
    assert lines[-1].startswith("paper's rule: both")


def test_another_law_is_the_answer(run: Run) -> None:
    _, out, _ = run(*SAND_IN_AIR, "--law", "profile")
    assert out.startswith("Force law profile: ")
    found = _json(run(*SAND_IN_AIR, "--law", "profile", "--json"))
    assert f"{found['profile']['friction_velocity']:.4g}" in out.splitlines()[1]
    assert found["answer"] == ["profile"]


def test_the_papers_rule_gives_both_equations_in_the_transition(run: Run) -> None:
    _, out, _ = run(*SAND_IN_AIR, "--law", "paper")
    lines = out.splitlines()
    assert lines[1].split() == ["low", "high"]
    assert lines[2].split() == ["u*,", "m/s", "0.4658", "0.2242"]
    coarse = _json(run("--diameter", "1e-3", "--law", "paper", "--json"))
    assert coarse["answer"] == coarse["paper"] == ["high"]
    rows = _csv(run("--diameter", RANGE, "--law", "paper", "--csv"))
    for row in rows:
        holds = {"low": ["low"], "high": ["high"], "transition": ["low", "high"]}[row["regime"]]
        assert (row["answer"] == "True") == (row["law"] in holds)
    assert {row["regime"] for row in rows} == {"transition", "high"}


def test_an_answer_outside_its_range_is_marked_and_laws_that_hold_are_named(run: Run) -> None:
    gravel = ["--diameter", "1e-2", *QUARTZ_IN_WATER[2:]]
    code, out, _ = run(*gravel)
    assert code == 0
    assert "outside the range of bridged: particle Reynolds number (Schiller and Naumann)" in out
    assert "laws that hold here: bridged-gravel, " in out
    _, out, _ = run(*gravel, "--law", "bridged-gravel")
    assert "outside" not in out


def test_a_range_is_a_row_for_each_value(run: Run) -> None:
    code, out, err = run("--diameter", RANGE)
    assert (code, err) == (0, "")
    title, header, *rows = out.splitlines()
    assert title == "Force law bridged"
    assert header.startswith("d, m")
    assert [row.split()[0] for row in rows] == ["0.0001", "0.0002", "0.0004", "0.0008", "0.0016"]
    alone = _json(run("--diameter", "4e-4", "--json"))["bridged"]
    assert rows[2].split()[1] == f"{alone['friction_velocity']:.4g}"


@pytest.mark.parametrize("law", LAWS)
def test_ranges_give_the_same_numbers_as_points(run: Run, law: str) -> None:
    records = _json(run("--diameter", RANGE, "--slope", "0:20:3", "--json"))
    assert len(records) == 15
    assert [r["input"]["slope_deg"] for r in records[:4]] == [0, 10, 20, 0]
    one = records[7]
    given = [str(one["input"][name]) for name in ("diameter", "slope_deg")]
    alone = _json(run("--diameter", given[0], "--slope", given[1], "--json"))
    assert one[law]["valid"] == alone[law]["valid"]
    for name in ("friction_velocity", "wind_speed_10_m", "stress", "shields", "drag", "lift"):
        assert one[law][name] == pytest.approx(alone[law][name], rel=1e-9)


def test_csv_and_json_say_the_same(run: Run) -> None:
    asked = [*QUARTZ_IN_WATER, "--roughness", "d/30:d/10:3", "--depth", "2"]
    rows, records = _csv(run(*asked, "--csv")), _json(run(*asked, "--json"))
    assert len(rows) == 3 * len(LAWS)
    for row, (record, law) in zip(rows, ((r, n) for r in records for n in LAWS), strict=True):
        one = record[law]
        assert row["law"] == law
        assert float(row["z0_m"]) == record["input"]["roughness"]
        assert float(row["depth_m"]) == 2
        for column, name in (
            ("ustar_m_s", "friction_velocity"),
            ("mean_velocity_m_s", "mean_velocity"),
            ("stress_pa", "stress"),
            ("shields", "shields"),
            ("reynolds", "reynolds"),
            ("drag_n", "drag"),
            ("lift_n", "lift"),
        ):
            assert float(row[column]) == one[name]
        assert row["wind_1m_m_s"] == ""
        assert row["valid"] == str(one["valid"])
        assert row["why_not"] == one["why_not"]
    ends = [records[index]["input"]["roughness"] for index in (0, 2)]
    assert ends == pytest.approx([5e-4 / 30, 5e-4 / 10])


@pytest.mark.parametrize(
    ("arguments", "question"),
    [
        (["--diameter", "0.2"], "0.2 m: did you mean 0.2 mm, --diameter 0.0002?"),
        (["--diameter", "0.1:2:3"], "did you mean 2 mm, --diameter 0.002?"),
        (["--diameter", "1e-3", "--viscosity", "15"], "15 mm2/s, --viscosity 1.5e-05?"),
        (["--diameter", "1e-3", "--viscosity", "1.5"], "1.5e-5 m2/s, --viscosity 1.5e-05?"),
        (["--diameter", "1e-3", "--viscosity", "0.15"], "0.15 cm2/s, --viscosity 1.5e-05?"),
        (["--diameter", "1e-3", "--viscosity", "1e-6"], "1 g/cm3, --fluid-density 1000?"),
        (["--diameter", "1e-3", "--fluid-density", "1000"], "did you mean water, --viscosity"),
        ([*QUARTZ_IN_WATER, "--viscosity", "1e-3"], "0.001 Pa s, --viscosity 1e-06"),
        (["--diameter", "1e-3", "--density", "2.65"], "2.65 g/cm3, --density 2650?"),
        (["--diameter", "1e-3", "--slope", "0.26"], "0.26 rad, --slope 14.9?"),
        (["--diameter", "1e-3", "--entrainment-angle", "1.05"], "1.05 rad, --entrainment-angle 60"),
        (["--diameter", "1e-3", "--gravity", "981"], "981 cm/s2, --gravity 9.81?"),
        (["--diameter", "1e-3", "--lift-coefficient", "6.46"], "--lift-coefficient 1.615?"),
        (["--diameter", "1e-6"], "1e-06 m: cohesion, which the force laws leave out, holds"),
        (["--diameter", "3e-5:1e-3:3", *WATER], "3e-05 m: cohesion"),
    ],
)
def test_what_looks_like_another_unit_is_asked_and_answered(
    run: Run, arguments: list[str], question: str
) -> None:
    code, out, err = run(*arguments)
    assert code == 0
    assert question in err
    assert err.count("\n") == 1
    assert "starts to move at" in out or "\n0." in out
    # programs read no question
    assert _csv(run(*arguments, "--csv"))


@pytest.mark.parametrize(
    "arguments",
    [
        SAND_IN_AIR,
        QUARTZ_IN_WATER,
        ["--diameter", "1e-4", "--slope", "0:30:61"],
        ["--diameter", "1e-4", "--fluid-density", "1.2", "--viscosity", "1.5e-5"],
        # Mars, Venus
        ["--diameter", "1e-4", "--fluid-density", "0.02", "--viscosity", "6e-4"],
        ["--diameter", "1e-4", "--fluid-density", "65", "--viscosity", "5e-7", "--gravity", "8.87"],
    ],
)
def test_usual_numbers_raise_no_question(run: Run, arguments: list[str]) -> None:
    code, _, err = run(*arguments)
    assert (code, err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--diameter", "1:"], ["--diameter: '1:' is not a range", "FIRST:LAST:COUNT"]),
        (["--diameter", "1e-4:2e-3"], ["--diameter", "is not a range"]),
        (["--diameter", "a:b:c"], ["--diameter: 'a' is not a number"]),
        (["--diameter", "1:2:c"], ["--diameter: 'c' is not a number"]),
        (["--diameter", "1:2:0"], ["--diameter: '0' is not a count"]),
        (["--diameter", "1:2:1"], ["--diameter: '1' is not a count"]),
        (["--diameter", "1:2:2.5"], ["--diameter: '2.5' is not a count"]),
        (["--diameter", "1:2:1e9"], ["--diameter: 1e9 values are more than 100000"]),
        (["--diameter", "1:2:inf"], ["--diameter: 'inf' is not a count"]),
        (["--diameter", "2e-3:1e-4:5"], ["--diameter", "does not rise"]),
        (["--diameter", "1e-3:1e-3:5"], ["--diameter", "does not rise"]),
        (["--diameter", "1e-4:inf:5"], ["--diameter", "finite"]),
        (["--diameter", "-1e-4:1e-3:5"], ["--diameter: -0.0001", "greater than or equal"]),
        (["--diameter", "1e-3", "--roughness", "d/10:d/30:3"], ["--roughness", "does not rise"]),
        (["--diameter", "1e-3", "--roughness", "d/30:1e-4:3"], ["--roughness: 'd/30'"]),
        (["--diameter", "1e-3", "--slope", "0:31:5"], ["--slope: 31 deg"]),
        (["--diameter", "1e-4:1e-3:400", "--slope", "0:30:400"], ["160000 points", "COUNT"]),
        (["--diameter", "1e-3", "--density", "2.65", *WATER], ["--density 2650?"]),
        (
            ["--diameter", "1e-3", "--density", "900", *WATER],
            ["--density", "lower --fluid-density"],
        ),
        (["--diameter", "1e-3", "--gravity", "0"], ["--gravity", "greater than or equal"]),
        (["--diameter", "1e-3", "--depth", "1"], ["--depth", "gas", "--fluid-density"]),
        ([*QUARTZ_IN_WATER, "--depth", "1e-4"], ["--depth", "does not cover"]),
        ([*QUARTZ_IN_WATER, "--depth", "nan"], ["--depth", "nan m"]),
        ([*QUARTZ_IN_WATER, "--depth", "1e300"], ["--depth", "deeper than any liquid"]),
        (["--diameter", "1e-3", "--law", "bridge"], ["--law", "did you mean bridged?", "paper"]),
        (["--diameter", "200"], ["--diameter", "equal to 10; 200 m", "200 um, --diameter 0.0002?"]),
        (["--diameter", "1e308"], ["--diameter", "less than or equal to 10"]),
        (["--diameter", "1e-3", "--csv", "--json"], ["--json", "not allowed with"]),
    ],
)
def test_refusals_are_one_line_that_names_the_option(
    run: Run, arguments: list[str], words: list[str]
) -> None:
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    lines = [line for line in err.splitlines() if line.startswith("orchestrator")]
    assert len(lines) == 1, err
    for word in words:
        assert word in lines[0]
