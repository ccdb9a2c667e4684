"""The command `threshold` as a user runs it: its output, questions and refusals."""

import csv
import io
import json
import math
import re
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from orchestrator import cli
from orchestrator.calculator import QUANTITIES
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import LAWS
from tests.waiting import HANGS_S

Ended = tuple[int, str, str]
Run = Callable[..., Ended]

D = ["--diameter", "1e-3"]
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


@pytest.mark.parametrize("law", LAWS)
def test_json_has_an_object_for_each_law_that_agrees_with_itself(
    run: Run, law: str
) -> None:
    angles = ["--slope", "10", "--entrainment-angle", "50"]
    record = _json(run("--diameter", "2e-4", *angles, "--law", law, "--json"))
    assert (record["regime"], record["paper"]) == ("transition", ["low", "high"])
    assert record["answer"] == [law]
    assert record["input"]["roughness"] == pytest.approx(2e-4 / 30)
    of_law = record[law]
    ustar, weight = of_law["friction_velocity"], math.pi / 6 * 2e-4**3 * 2499 * 9.81
    assert of_law["reynolds"] == pytest.approx(ustar * 2e-4 / 1e-5)
    assert of_law["stress"] == pytest.approx(ustar**2)
    assert of_law["shields"] == pytest.approx(of_law["stress"] / (2499 * 9.81 * 2e-4))
    for height in (1, 10):
        wind = ustar / 0.41 * math.log1p(height / (2e-4 / 30 + 1e-5 / (9 * ustar)))
        assert of_law[f"wind_speed_{height}_m"] == pytest.approx(wind)
    assert of_law["mean_velocity"] is None
    assert bool(of_law["why_not"]) is not of_law["usable"]
    assert of_law["valid"] or not of_law["usable"]
    beta, lean = math.radians(50), math.radians(10 - 50)
    moment = of_law["drag"] * math.sin(beta) + of_law["lift"] * math.cos(beta)
    assert moment == pytest.approx(weight * math.cos(lean), rel=1e-9)
    # the equations of the paper enclose the bridged law
    ends = [record[name]["friction_velocity"] for name in ("high", "bridged", "low")]
    assert sorted(ends) == ends


def test_ranges_give_the_same_numbers_as_points(run: Run) -> None:
    records = _json(run("--diameter", RANGE, "--slope", "0:20:3", "--json"))
    assert len(records) == 15
    assert [record["input"]["slope_deg"] for record in records[:4]] == [0, 10, 20, 0]
    diameters = [record["input"]["diameter"] for record in records[::3]]
    assert diameters == pytest.approx([1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3])
    given = [str(records[7]["input"][name]) for name in ("diameter", "slope_deg")]
    point = _json(run("--diameter", given[0], "--slope", given[1], "--json"))
    names = "friction_velocity", "wind_speed_10_m", "stress", "shields", "drag", "lift"
    for law in LAWS:
        for name in names:
            assert records[7][law][name] == pytest.approx(point[law][name], rel=1e-9)


def test_a_liquid_of_a_depth_has_a_mean_velocity_and_no_winds(run: Run) -> None:
    one = _json(run(*QUARTZ_IN_WATER, "--depth", "1", "--json"))["bridged"]
    assert one["wind_speed_10_m"] is None
    z0 = 5e-4 / 10 + 1e-6 / (9 * one["friction_velocity"])
    mean = one["friction_velocity"] / 0.41 * ((1 + z0) * math.log(1 + 1 / z0) - 1)
    assert one["mean_velocity"] == pytest.approx(mean)
    assert "wind" not in run(*QUARTZ_IN_WATER, "--depth", "1")[1]
    assert "--depth in m" in run(*QUARTZ_IN_WATER)[1]
    oil = ["--fluid-density", "870", "--viscosity", "5e-5", "--depth", "0.02"]
    assert (
        "laminar flow: speed times depth over nu, 189, is below"
        in run(*D, "--density", "2650", *oil)[1]
    )


@pytest.mark.parametrize("law", LAWS)
def test_the_answer_comes_first_and_the_other_laws_beside_it(
    run: Run, law: str
) -> None:
    code, out, err = run(*SAND_IN_AIR, "--law", law)
    assert (code, err) == (0, "")
    record = _json(run(*SAND_IN_AIR, "--law", law, "--json"))
    assert out.startswith("At what wind does a grain of ")
    (told,) = [line for line in out.splitlines() if "friction velocity;" in line]
    # beside it stands the number with another critical number, by the verdict
    figures = [float(each) for each in re.findall(r"\d+\.\d+", told)]
    assert any(
        each == pytest.approx(record[law]["friction_velocity"], rel=0.05)
        for each in figures
    )
    (table,) = [part for part in out.split("\n\n") if part.startswith("force law")]
    # a head may have two lines
    rows = [line.split() for line in table.splitlines() if line.split()[0] in LAWS]
    assert rows[0][0] == law
    (marked,) = [line for line in table.splitlines() if "<- answer" in line]
    assert marked.split()[0] == law
    for name, _, ustar, _, shields, *rest in rows:
        # Re* stands there where the line is not too long
        holds = next(each for each in rest if each in ("yes", "no"))
        assert (ustar, shields) == tuple(
            f"{record[name][key]:.3g}" for key in ("friction_velocity", "shields")
        )
        assert holds == ("yes" if record[name]["valid"] else "no")


def test_the_papers_rule_gives_both_equations_in_the_transition(run: Run) -> None:
    lines = run(*SAND_IN_AIR, "--law", "paper")[1].splitlines()
    marked = [line.split() for line in lines if "<- answer" in line]
    assert [(row[0], row[2]) for row in marked] == [
        ("low", "0.466"),
        ("high", "0.224"),
    ]
    rows = csv.DictReader(
        io.StringIO(run("--diameter", RANGE, "--law", "paper", "--csv")[1])
    )
    for row in rows:
        laws = {"low": ["low"], "high": ["high"], "transition": ["low", "high"]}[
            row["regime"]
        ]
        assert (row["answer"] == "True") == (row["law"] in laws)


def test_csv_and_json_say_the_same(run: Run) -> None:
    asked = [*QUARTZ_IN_WATER, "--roughness", "d/30:d/10:3", "--depth", "2"]
    rows = list(csv.DictReader(io.StringIO(run(*asked, "--csv")[1])))
    records = _json(run(*asked, "--json"))
    assert len(rows) == 3 * len(LAWS)
    for row, (record, law) in zip(
        rows, ((r, n) for r in records for n in LAWS), strict=True
    ):
        one = record[law]
        assert row["law"] == law
        assert float(row["z0_m"]) == record["input"]["roughness"]
        for column, (name, _) in QUANTITIES.items():
            assert (float(row[column]) if row[column] else None) == one[name]
        assert (row["valid"], row["why_not"]) == (str(one["valid"]), one["why_not"])


@pytest.mark.parametrize(
    ("arguments", "question"),
    [
        (
            [*WATER, "--diameter", "0.1"],
            "0.1 m is a stone of 100 mm: or did you mean 0.1 mm, --diameter 0.0001?",
        ),
        ([*D, "--fluid-density", "1000"], "1e-05 m2/s, or 0.01 Pa s, is unusual"),
        ([*QUARTZ_IN_WATER, "--viscosity", "1e-3"], "is it right? --fluid names water"),
        ([*D, "--density", "2.65"], "2.65 g/cm3, --density 2650?"),
        ([*D, "--slope", "0.26"], "0.26 rad, --slope 14.9?"),
        ([*D, "--gravity", "981"], "981 cm/s2, --gravity 9.81?"),
        ([*D, "--lift-coefficient", "6.46"], "--lift-coefficient 1.615?"),
        (["--diameter", "3e-5:1e-3:3", *WATER], "3e-05 m: cohesion"),
    ],
)
def test_a_number_that_is_usual_in_another_unit_is_asked_about_and_answered(
    run: Run, arguments: list[str], question: str
) -> None:
    code, out, err = run(*arguments)
    assert code == 0
    assert question in err
    assert err.count("\n") == 1
    is_table = out.startswith("Force law bridged")
    assert is_table or out.startswith("At what ")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["--diameter", "a:b:c"],
            ["--diameter: 'a:b:c' is neither a number nor a range"],
        ),
        (["--diameter", "1:2"], ["--diameter: '1:2' is not a range"]),
        *(
            (["--diameter", text], [f"--diameter: '{text}' is not a range"])
            for text in (
                "1:2:1",
                "1:2:2.5",
                "1:2:inf",
                "2e-3:1e-4:5",
                "1e-4:inf:5",
                "1:2:1e9",
            )
        ),
        ([*D, "--roughness", "d/10:d/30:3"], ["--roughness", "values that rise"]),
        (["--diameter", "1e-4:1e-3:100001"], ["number of values", "2 to 100000"]),
        ([*D, "--roughness", "d/30:1e-4:3"], ["--roughness: 'd/30:1e-4:3' is neither"]),
        ([*D, "--slope", "0:31:5"], ["--slope: 31 deg"]),
        (
            ["--diameter", "1e-4:1e-3:400", "--slope", "0:30:400"],
            ["160000 points", "COUNT"],
        ),
        (
            [*D, "--density", "2.65", *WATER],
            ["--density: not above the fluid's", "--density 2650?"],
        ),
        ([*D, "--density", "900", *WATER], ["--density", "lower --fluid-density"]),
        ([*D, "--depth", "1"], ["--depth", "gas", "--fluid water"]),
        ([*QUARTZ_IN_WATER, "--depth", "1e-4"], ["--depth", "does not cover"]),
        ([*D, "--law", "bridge"], ["--law", "did you mean bridged?", "paper"]),
        (["--diameter", "0.2"], ["no force law holds", "0.2 mm, --diameter 0.0002?"]),
        (
            ["--diameter", "0.3", "--density", "2650", "--fluid", "water"],
            ["bridged-gravel: particle Reynolds number", "not below 300000"],
        ),
        (["--diameter", "30"], ["30 m: did you mean 30 mm, --diameter 0.03?"]),
        ([*D, "--slope", "-29:29:201"], ["--slope: below 0", "--bed-slope 0.005"]),
        *(
            ([*QUARTZ_IN_WATER, "--depth", depth], ["--depth", "deeper than 10000 m"])
            for depth in ("inf", "1e308", "2e4")
        ),
        ([*QUARTZ_IN_WATER, "--depth", "nan"], ["--depth", "nan m does not cover"]),
        (
            [*QUARTZ_IN_WATER, "--bed-slope", "5e-324"],
            ["--bed-slope", "deeper than 10000 m", "a steeper slope"],
        ),
        (
            [
                "--diameter",
                "1e-3",
                "--density",
                "2650",
                "--fluid",
                "water",
                "--bed-slope",
                "-0.05",
            ],
            ["--bed-slope", "does not cover a grain of 0.001 m", "a gentler slope"],
        ),
        (
            ["--diameter", "200"],
            ["--diameter: 200.0 is not acc", "did you mean 200 mm, --diameter 0.2?"],
        ),
        ([*D, "--diameter", "0,25"], ["--diameter", "write 0.25"]),
        (
            [*D, "--diameter", "0.25 mm"],
            ["--diameter", "write 0.00025, without a unit"],
        ),
        ([*D, "--diameter", "1_0e-4"], ["--diameter: '1_0e-4' is neither"]),
        ([*D, "--diameter", "١e-3"], ["--diameter: '١e-3' is neither"]),
        ([*D, "--roughness", "d/٣٠"], ["--roughness: 'd/٣٠' is not a length"]),
        ([*D, "--fluid", "air", "--temperature", "١"], ["invalid number value: '١'"]),
        ([*D, "--fluid", "air", "--temperature", "288"], ["288 K, 14.85 deg C?"]),
        ([*D, "--fluid", "air", "--viscosity", "1"], ["--viscosity: air has its own"]),
        (["--diam", "1e-3"], ["there is no option --diam: did you mean --diameter?"]),
        ([*D, "--csv", "--json"], ["--json", "not allowed with"]),
    ],
)
def test_refusals_are_one_line_that_names_the_option(
    run: Run, arguments: list[str], words: list[str]
) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    lines = [line for line in err.splitlines() if line.startswith("orchestrator")]
    assert len(lines) == 1, err
    for word in words:
        assert word in lines[0]


def test_gravel_is_answered_by_a_law_that_holds(run: Run) -> None:
    """The drag law of the law bridged ends at a particle Reynolds number of 1000."""
    gravel = ["--diameter", "0.03", "--density", "2650", "--fluid", "water"]
    code, out, _ = run(*gravel, "--criterion", "entrained")
    assert code == 0
    assert out.startswith("At what flow does a grain of 30 mm start to move?")
    assert "19.2 Pa" in out
    (answer,) = [line for line in out.splitlines() if "<- answer" in line]
    assert answer.startswith("bridged-gravel")
    asked = " ".join(run(*gravel, "--law", "bridged")[1].split())
    assert "Not usable: particle Reynolds number (Schiller and Naumann)" in asked
    assert "Choose --law bridged-gravel." in asked
    sizes = ["--diameter", "1e-3:0.03:3", "--density", "2650", *WATER]
    rows = csv.DictReader(io.StringIO(run(*sizes, "--csv")[1]))
    answers = [row["law"] for row in rows if row["answer"] == "True"]
    assert answers == ["bridged", "bridged-gravel", "bridged-gravel"]
    lines = run(*sizes)[1].splitlines()
    assert lines[0] == "Force law bridged and bridged-gravel"
    assert all(line.endswith("yes") for line in lines[3:6])


def test_grains_that_go_on_have_the_larger_of_two_stresses(run: Run) -> None:
    asked = [*QUARTZ_IN_WATER, "--depth", "1", "--json"]
    leaves = _json(run(*asked, "--criterion", "entrained"))
    both = _json(run(*asked, "--criterion", "sustained"))
    for law in LAWS:
        of_law = both[law]
        gust = peak_over_mean(0.4, 100)
        assert of_law["shields_entrained"] == pytest.approx(
            leaves[law]["shields"] / gust
        )
        larger = max(of_law["shields_entrained"], of_law["shields_sustained"])
        assert of_law["shields"] == larger
        decides = "entrained" if larger == of_law["shields_entrained"] else "sustained"
        assert of_law["decides"] == decides
        assert of_law["stress"] == pytest.approx(larger * 1650 * 9.81 * 5e-4)
        assert of_law["friction_velocity"] ** 2 * 1000 == pytest.approx(
            of_law["stress"]
        )
    # its interval is that of grains in sustained motion, not that of the same law's pivot
    assert both["bridged"]["tested_rows"] > 10
    held = [record["bridged"]["tested_low"] for record in (both, leaves)]
    assert held[0] != pytest.approx(held[1], rel=0.01)
    assert both["profile"]["tested_rows"] == 0
    # the default in a fluid by number is to go on, in the paper's fluid to leave
    assert _json(run(*asked)) == both
    assert "decides" not in leaves["bridged"]
    assert "decides" not in _json(run(*D, "--json"))["bridged"]
    by_paper = _json(run(*asked, "--law", "paper"))
    assert "decides" not in by_paper["bridged"]


def test_the_interval_of_a_threshold_holds_what_was_measured(run: Run) -> None:
    """Dry beach sand of 0.25 mm starts at a wind of some 9.3 m/s at 10 m."""
    sand = ["--diameter", "2.5e-4", "--density", "2650", "--fluid", "air", "--json"]
    record = _json(run(*sand))["bridged"]
    assert record["wind_speed_10_m"] == pytest.approx(9.3, rel=0.15)
    # three sites in the field and five points of a formula
    assert record["tested_rows"] == 8
    assert record["tested_low"] < record["formula_shields"] < record["tested_high"]
    assert record["compared_with"] == "formula"
    assert record["shields_sustained_high"] > record["shields"]
    # on a slope it is wider, on a steep one there is none
    on_slope = _json(run(*sand, "--slope", "15"))["bridged"]
    width = record["tested_high"] / record["tested_low"]
    assert on_slope["tested_high"] / on_slope["tested_low"] > width


def test_silt_in_water_goes_on_like_any_other_grain(run: Run) -> None:
    silt = ["--diameter", "6e-5", "--density", "2650", "--fluid", "water"]
    found = _json(run(*silt, "--json"))["bridged"]
    leaves = _json(run(*silt, "--json", "--criterion", "entrained"))["bridged"]
    assert found["decides"] == "sustained"
    assert found["shields"] == found["shields_sustained"] > leaves["shields"]
    low, high = (found[f"shields_sustained_{end}"] for end in ("low", "high"))
    assert low < found["shields"] < high
    assert found["shields_cessation"] == found["shields"]
    assert found["valid"]
    assert f"({low:.3g} … {high:.3g}: a quarter of" in " ".join(run(*silt)[1].split())


def test_the_papers_rule_has_no_grains_that_go_on(run: Run) -> None:
    code, _, err = run(*D, "--law", "paper", "--criterion", "sustained")
    assert code == 2
    assert "--criterion: the law paper is one of entrainment alone" in err


def test_the_forces_on_a_grain_that_goes_on_are_those_of_the_gust(run: Run) -> None:
    # where leaving decides, the grain is turned over by the gust: the forces of its threshold
    sand = ["--diameter", "5e-4", "--density", "2650", "--fluid", "air", "--json"]
    leaves = _json(run(*sand, "--criterion", "entrained"))["bridged"]
    both = _json(run(*sand, "--criterion", "sustained"))["bridged"]
    assert both["decides"] == "entrained"
    assert both["drag"] == pytest.approx(leaves["drag"])
    assert both["lift"] == pytest.approx(leaves["lift"])
    assert both["friction_velocity"] < leaves["friction_velocity"]


def test_text_says_which_criterion_decides(run: Run) -> None:
    one = run(*QUARTZ_IN_WATER, "--depth", "1", "--criterion", "sustained")[1]
    assert "Sustained motion controls: dislodgement by a gust at" in one
    many = run(
        "--diameter", RANGE, "--density", "2650", *WATER, "--criterion", "sustained"
    )
    head, _, *rows = many[1].splitlines()[1:8]
    assert "decides" in head
    assert "Not shown: " in many[1]
    assert all(len(line) < 80 for line in many[1].splitlines())
    # in water grains stop with their gust
    assert all("sustained" in row for row in rows[:5])


def test_a_criterion_that_is_none_is_refused(run: Run) -> None:
    code, _, err = run(*D, "--criterion", "gone")
    assert code == 2
    assert "--criterion: no criterion 'gone' (choose entrained, sustained, auto)" in err


def test_a_river_has_a_depth_and_a_velocity(run: Run) -> None:
    """The stress of a wide channel is its weight along the slope, rho g h S."""
    gravel = ["--diameter", "0.03", "--density", "2650", *WATER]
    code, text, _ = run(*gravel, "--bed-slope", "0.005")
    assert code == 0
    assert "depth; of the uniform flow" in text
    falling = _json(run(*gravel, "--bed-slope", "-0.005", "--json"))
    rising = _json(run(*gravel, "--bed-slope", "0.005", "--json"))
    assert falling == rising
    answer = falling["bridged-gravel"]
    sizes = ("--diameter", "0.01:0.03:3", "--density", "2650", "--fluid", "water")
    many = run(*sizes, "--bed-slope", "0.005")[1].splitlines()
    assert many[1].split("  ")[0:1] == ["d, m"]
    assert "depth," in many[1]
    row = run(*gravel, "--bed-slope", "0.005", "--csv")[1].splitlines()
    heads = row[0].split(",")
    values = dict(zip(heads, row[1].split(","), strict=True))
    weight = float(values["rho_f_kg_m3"]) * 9.81 * float(values["depth_m"]) * 0.005
    assert weight == pytest.approx(float(values["stress_pa"]), rel=1e-6)
    assert answer["mean_velocity"] > 1
    for words, said in {
        ("--slope", "-0.29"): "--bed-slope 0.005",
        ("--bed-slope", "0.5"): "is not between 0 and 0.05",
        ("--bed-slope", "0.005", "--depth", "1"): "leave the depth out",
    }.items():
        code, _, err = run(*gravel, *words)
        assert code == 2
        assert said in err
    assert "a gas has no depth" in run(*D, "--bed-slope", "0.005")[2]


def test_a_depth_by_the_slope_is_checked_as_one_that_is_given(run: Run) -> None:
    """A river 0.46 mm deep moved sand of 0.5 mm, and none was laminar."""
    sand = ["--diameter", "5e-4", "--density", "2650", "--fluid", "water"]
    by_slope = _json(run(*sand, "--bed-slope", "0.005", "--json"))
    of_law = by_slope["bridged"]
    depth = of_law["stress"] / (999.1 * 9.81 * 0.005)
    assert not of_law["valid"]
    assert of_law["mean_velocity"] is None
    given = _json(run(*sand, "--depth", str(depth), "--json"))["bridged"]
    assert "laminar flow" in given["why_not"]
    assert of_law["why_not"] == given["why_not"]
    # of a table, the rows that are covered answer
    sizes = ["--diameter", "1e-3:5e-2:3", *sand[2:]]
    rows = _json(run(*sizes, "--bed-slope", "0.05", "--json"))
    reasons = [row[row["answer"][0]]["why_not"] for row in rows]
    assert "does not cover a grain of 0.001 m" in reasons[0]
    assert not reasons[-1]


def test_a_negative_number_of_any_spelling_is_the_value_of_its_option(run: Run) -> None:
    gravel = ["--diameter", "0.03", "--density", "2650", *WATER, "--json"]
    found = [run(*gravel, "--bed-slope", text) for text in ("-5e-3", "-.005", "5e-3")]
    assert [code for code, _, _ in found] == [0, 0, 0]
    assert found[0][1] == found[1][1] == found[2][1]


STARTED = """
import sys
from orchestrator import cli
assert cli.main(["threshold", "--diameter", "3e-4", "--fluid", sys.argv[1]]) == 0
slow = {"filelock", "jinja2", "matplotlib", "pandas", "pydantic", "pyvista"}
print("imported:", *sorted(slow & set(sys.modules)))
"""


@pytest.mark.parametrize("fluid", ["air", "water"])
def test_a_card_waits_for_no_library_that_is_slow_to_import(fluid: str) -> None:
    command = [sys.executable, "-c", STARTED, fluid]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=HANGS_S)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.splitlines()[-1] == "imported:"
