"""Solvers as real processes: a right one passes, each wrong one is caught and told by name."""

import json
import re
import shlex
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import pack, runner
from orchestrator.benchmark.report import Found
from orchestrator.benchmark.runner import Choice
from orchestrator.errors import InputError
from orchestrator.runs.confined import Limits
from tests.benchmark.conftest import NATIVE
from tests.benchmark.programs import AFTER, TAIL, program, run
from tests.conftest import Command

FORMULA, SLOPED = "one of level 1", "one of level 1 on a slope"
"""Scenes that differ from mistake to mistake: their names are digests."""


def _run(root: Path, folder: Path, body: str, *scenes: str, limit_s: float = 60.0) -> Found:
    return run(root, folder, body, Choice(patterns=scenes), Limits(seconds=limit_s))


def _level_1(root: Path) -> tuple[list[str], list[str]]:
    """Scenes of level 1: those on level ground, and those on a slope."""
    scenes = pd.read_csv(root / "scenes.csv").query("level == 1").sort_values("scene")
    sloped = scenes["alpha_deg"] > 0
    return list(scenes.loc[~sloped, "scene"]), list(scenes.loc[sloped, "scene"])


CONTACT = """
init = solver.Contact.__init__
def contact(self, scene, mass):
    init(self, scene, mass)
    {}
solver.Contact.__init__ = contact
"""
OTHER_SCENE = """
right = solver.closed_form
solver.KINDS["closed-form"] = lambda scene, case: right({{**scene, {}}}, case)
"""
PASSING = """
right = solver.passing
solver.KINDS["passing"] = lambda scene, case: right({{**scene, {}}}, case)
"""
WRONG = {
    "the radius": (
        OTHER_SCENE.format("'d_m': scene['d_m'] / 2, 'weight_n': scene['weight_n'] / 8") + TAIL,
        FORMULA,
        "the radius is taken for the diameter",
    ),
    "an angle from the other side": (
        OTHER_SCENE.format("'beta_deg': 90 - scene['beta_deg']") + TAIL,
        SLOPED,
        "the entrainment angle is counted from the other side",
    ),
    "a slope in radians": (
        OTHER_SCENE.format("'alpha_deg': math.radians(scene['alpha_deg'])") + TAIL,
        SLOPED,
        "the slope is converted to radians twice",
    ),
    "a lift for the radius": (
        OTHER_SCENE.format("'alpha_s': 4 * scene['alpha_s']") + TAIL,
        FORMULA,
        "the lift coefficient is that for the radius",
    ),
    "a Reynolds number of the radius": (
        AFTER + "lines = [n.split(',') for n in text.splitlines()]\n"
        "out.write_text(''.join(f'{q},{at},{float(v) / 2 if q == \"reynolds\" else v}\\n'"
        " for q, at, v in lines))\nsys.exit(code)\n",
        FORMULA,
        "reynolds is .*: it is that of the radius",
    ),
    "a criterion of 0.5 d": (
        PASSING.format("'displacement_criterion': 0.5") + TAIL,
        "2-passing-2",
        "passing_time_over_t .*: a grain counts as moved at 0.5 d, not at 0.3 d",
    ),
    "a criterion of 0.1 d": (
        PASSING.format("'displacement_criterion': 0.1") + TAIL,
        "2-passing-1.5",
        "a grain counts as moved at 0.1 d, not at 0.3 d",
    ),
    "a hollow sphere that passes": (
        "solver.INERTIA = 2 / 3" + TAIL,
        "2-passing-3",
        "the inertia of a hollow sphere",
    ),
    "no lift": (
        "forces = solver.forces\n"
        "solver.forces = lambda scene, u: (forces(scene, u)[0], 0.0)" + TAIL,
        FORMULA,
        "lift_n .* is 0, not .*: there is no lift",
    ),
    "lift left out of the threshold": (
        "forces, threshold = solver.forces, solver.threshold\n"
        "def alone(scene):\n"
        "    solver.forces = lambda scene, u: (forces(scene, u)[0], 0.0)\n"
        "    found = threshold(scene)\n"
        "    solver.forces = forces\n"
        "    return found\n"
        "solver.threshold = alone" + TAIL,
        FORMULA,
        "shields .*: there is no lift",
    ),
    "the other force law": (
        OTHER_SCENE.format("'force_law': {'low': 'high', 'high': 'low'}[scene['force_law']]")
        + TAIL,
        FORMULA,
        r"the forces are those of Eq\. [24] \(.*\), not of Eq\. [24] \(",
    ),
    "down the slope": (
        OTHER_SCENE.format("'alpha_deg': -scene['alpha_deg']") + TAIL,
        SLOPED,
        "the sign of the slope is turned",
    ),
    "a level bed": (
        OTHER_SCENE.format("'alpha_deg': 0.0") + TAIL,
        SLOPED,
        "the slope is left out",
    ),
    "dry weight": (
        OTHER_SCENE.format("'weight_n': scene['mass_kg'] * scene['g_m_s2']") + TAIL,
        FORMULA,
        "the weight is that of the dry grain, not of the submerged one",
    ),
    "another g": (
        OTHER_SCENE.format("'g_m_s2': 9.8, 'weight_n': scene['weight_n'] * 9.8 / scene['g_m_s2']")
        + TAIL,
        FORMULA,
        "g is 9.8, not 9.81 m/s2",
    ),
    "drag 5 % high": (
        "forces = solver.forces\n"
        "solver.forces = lambda scene, u: (1.05 * forces(scene, u)[0], forces(scene, u)[1])" + TAIL,
        FORMULA,
        "drag_n .* 3 more are off: [+]5 % at each of 4 places: one factor is wrong|"
        "drag_n .* are off: [+]5 % at each of 4 places: one factor is wrong",
    ),
    "wrong units": (
        "forces = solver.forces\n"
        "solver.forces = lambda scene, u: tuple(1e3 * f for f in forces(scene, u))" + TAIL,
        FORMULA,
        r"10\^3 times too large: another unit",
    ),
    "friction left out": (
        CONTACT.format("self.friction = 0.0") + TAIL,
        "2-incline-20",
        "there is no friction",
    ),
    "a disc": ("solver.INERTIA = 0.5" + TAIL, "2-incline-45", "the inertia of a disc"),
    "a disc that slides": (
        "solver.INERTIA = 0.5" + TAIL,
        "2-sliding-2",
        "speed_over_start|spin_over_start .* the inertia of a disc",
    ),
    "no damping": (CONTACT.format("self.gamma = 0.0") + TAIL, "2-collision-0.1", "no damping"),
    "NaN": (
        "solver.threshold = lambda scene: math.nan" + TAIL,
        FORMULA,
        "answer.csv, line 10: ustar_m_s is nan, not finite",
    ),
    "a line cut short": (
        AFTER + "out.write_text(text[: text.rindex(',')])",
        FORMULA,
        "cut short: line 12 has 2 of 3 fields",
    ),
    "a file cut short": (AFTER + "out.write_text(text[:-3])", FORMULA, "line 12 has no end"),
    "half a file": (
        AFTER + "out.write_text(text[: text.index('lift_n')])",
        FORMULA,
        "lacks lift_n at .* and 6 more",
    ),
    "another name": (
        AFTER + "out.write_text(text.replace('ustar_m_s', 'ustar_cm_s'))",
        FORMULA,
        "lacks ustar_m_s; is ustar_cm_s meant[?]",
    ),
    "no head": (AFTER + "out.write_text(text[text.index('drag_n') :])", FORMULA, "begins with"),
    "no answer": ("sys.exit(0)", FORMULA, "it wrote no answer.csv"),
    "exit 1": ("sys.exit('the mesh is inverted')", FORMULA, "ended with 1: the mesh is inverted"),
    "changes its case": (
        "(case / 'scene.json').open('a').write(' ')" + TAIL,
        FORMULA,
        "changed the files of its case",
    ),
}


@pytest.fixture(scope="module")
def mistaken(formulas: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is said of each wrong solver; one run has all, each at a scene of its own."""
    folder = tmp_path_factory.mktemp("wrong")
    level, sloped = map(iter, _level_1(formulas))
    places = {FORMULA: level, SLOPED: sloped}
    scenes = {name: next(places.get(at, iter([at]))) for name, (_, at, _) in WRONG.items()}
    bodies = {scenes[name]: body for name, (body, *_) in WRONG.items()}
    read = "solver.json.loads((case / 'scene.json').read_text())['scene']"
    found = _run(formulas, folder, f"exec({bodies!r}[{read}])", *bodies)
    verdicts = pd.read_csv(folder / "results" / "verdicts.csv").set_index("scene")
    assert set(verdicts.index) == {*bodies}
    assert not verdicts["passed"].any()
    assert all(line.split(": ")[0] in found.page.read_text() for line in found.failures[:-1])
    assert found.failures[-1].startswith("and ")
    return {name: str(verdicts.loc[scene, "message"]) for name, scene in scenes.items()}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_solver_is_caught_and_named(mistaken: dict[str, str], name: str) -> None:
    assert re.search(WRONG[name][-1], mistaken[name]), mistaken[name]


def test_a_solver_that_hangs_is_caught_and_named(formulas: Path, tmp_path: Path) -> None:
    (line,) = _run(formulas, tmp_path, "time.sleep(1000)", "2-incline-5", limit_s=2.0).failures
    assert line == "2-incline-5: it did not end within 2 s and was killed"


def test_one_mistake_in_many_scenes_is_one_line(formulas: Path, tmp_path: Path) -> None:
    body = OTHER_SCENE.format("'g_m_s2': 10.0, 'weight_n': scene['weight_n'] * 10 / 9.81") + TAIL
    found = _run(formulas, tmp_path, body, "1-[01]*")
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    (line,) = found.failures
    first, others = verdicts["scene"].iloc[0], len(verdicts) - 1
    assert others >= 2
    assert line.startswith(f"{first} and {others} more of kind closed-form: ")
    assert line.endswith("g is 10, not 9.81 m/s2")
    assert verdicts["cause"].nunique() == 1
    assert line.split(": ")[0] in found.page.read_text()


def test_declined_scenes_are_one_line_and_have_no_time(formulas: Path, tmp_path: Path) -> None:
    found = _run(formulas, tmp_path, "sys.exit(2)", "2-incline-*")
    (line,) = found.failures
    assert line == "2-incline-5 and 5 more of kind incline: it ended with 2"
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert not verdicts["answered"].any()
    assert (verdicts["ours_seconds"] > 0).all()
    assert verdicts[["ratio", "cpu_ratio"]].isna().all(axis=None)


def test_each_program_is_listed_once(formulas: Path, tmp_path: Path) -> None:
    root = tmp_path / "pack"
    shutil.copytree(formulas, root)
    manifest = json.loads((root / "manifest.json").read_text())
    manifest["programs"] = {"gmsh": "4.0.0", "liggghts": "3.8.0"}
    (root / "manifest.json").write_text(json.dumps(manifest))
    found = _run(root, tmp_path, TAIL, "2-collision-0.1")
    assert found.page.read_text().count("<td>gmsh</td>") == 1
    assert "<td>4.0.0</td>" in found.page.read_text()


def test_a_lost_grain_is_caught(all_levels: Path, tmp_path: Path) -> None:
    body = "pile = solver.pile\n" + (
        "solver.KINDS['pile'] = lambda scene, case: (lambda ask: lambda quantity, at:"
        " ask(quantity, at) - (quantity == 'not_moved'))(pile(scene, case))" + TAIL
    )
    found = _run(all_levels, tmp_path, body, "4-*")
    assert len(found.failures) == 1
    assert "grains are lost" in found.failures[0]


REPLAY = """
class Replay:
    def __init__(self, change):
        self.numbers = change({expected!r})
    def __call__(self, scene, case):
        return lambda quantity, at: self.numbers[quantity, at]
def never_carried(numbers):
    none = {{key: 0.0 for key in numbers if key[0] in ("moved", "carried_off")}}
    (rest,) = (key for key in numbers if key[0] == "not_moved")
    return numbers | none | {{rest: {count}}}
def forgets(numbers):
    moved = [key for key in numbers if key[0] == "moved"]
    return numbers | {{moved[-2]: numbers[moved[-1]] + 1}}
def all_gone(numbers):
    (carried,) = (key for key in numbers if key[0] == "carried_off")
    return numbers | {{carried: {count} + 1}}
"""
"""A solver that knows the answers to a pile, and may count by another rule."""
COUNTED = {
    "dict": "",
    "never_carried": "grains that were carried off are not counted as moved",
    "forgets": r"moved falls from \d+ to \d+ at load step \d+: a grain that has moved has moved",
    "all_gone": r"\d+ grains are carried off at load step \d+, of \d+ that moved",
}


@pytest.mark.parametrize("rule", COUNTED)
def test_another_counting_rule_is_named(lift_off: Path, tmp_path: Path, rule: str) -> None:
    rows = pack.read(lift_off).expected
    expected = rows.set_index(["quantity", "at"])["value"].to_dict()
    count = sum(rows.groupby("quantity")["value"].last()[["moved", "not_moved"]])
    replay = REPLAY.format(expected=expected, count=count)
    body = f"{replay}\nsolver.KINDS['pile'] = Replay({rule})" + TAIL
    found = _run(lift_off, tmp_path, body, "4-*")
    assert bool(found.failures) == bool(COUNTED[rule])
    assert re.search(COUNTED[rule], "\n".join(found.failures))


def test_ours_answers_a_poured_bed_as_exported(poured: Path, tmp_path: Path) -> None:
    _run(poured, tmp_path, "sys.exit(2)", "4-*")
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    pd.testing.assert_series_equal(numbers["ours"], numbers["value"], check_names=False, rtol=1e-6)


def test_ours_answers_as_exported(all_levels: Path, tmp_path: Path) -> None:
    # a solver that knows no kind: only our own runs answer
    _run(all_levels, tmp_path, "sys.exit(2)", "[345]-*")
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    assert set(numbers["scene"].str[0]) == {"3", "4", "5"}
    pd.testing.assert_series_equal(numbers["ours"], numbers["value"], check_names=False, rtol=1e-6)


def test_compare_gives_the_same_verdicts(formulas: Path, orchestrator: Command) -> None:
    command = f"{shlex.join([sys.executable, str(NATIVE / 'solver.py')])} {{case}} {{out}}"
    arguments = (str(formulas), "--scene", "2-incline-[27]0", "--solver", command, "--out", "r")
    ran = orchestrator("benchmark", "run", *arguments)
    assert ran.returncode == 0, ran.stderr
    compared = orchestrator(
        "benchmark", "compare", str(formulas), "r", "--scene", "2-incline-[27]0"
    )
    assert compared.returncode == 0
    # the last line is the page's path
    assert compared.stdout.splitlines()[:-1] == ran.stdout.splitlines()[:-1]
    more = orchestrator("benchmark", "compare", str(formulas), "r", "--scene", "2-incline-*")
    assert more.returncode == 1
    assert "2-incline-5 and 3 more of kind incline: it wrote no answer.csv" in more.stderr


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("true {case}", "no {out}"),
        ("no-such-solver {case} {out}", "no program no-such-solver"),
        ("'open {case} {out}", "cannot be read"),
    ],
)
def test_a_command_that_cannot_work(
    formulas: Path, tmp_path: Path, command: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        runner.run(formulas, command, tmp_path / "results", Choice(), Limits(seconds=60.0))


def test_no_shell_reads_the_command(formulas: Path, tmp_path: Path) -> None:
    command = program(tmp_path, TAIL)
    with pytest.raises(InputError, match="no shell reads the command"):
        runner.run(formulas, command + "; touch shell", tmp_path / "results", Choice(), Limits())
    runner.run(
        formulas,
        command + " $HOME `touch shell` $(touch shell)",
        tmp_path / "results",
        Choice(patterns=("2-incline-5",)),
        Limits(seconds=60.0),
    )
    assert not list(tmp_path.rglob("shell"))
