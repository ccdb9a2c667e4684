"""The criterion of motion: where grains must go on, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

import orchestrator
from orchestrator import plan
from orchestrator.calculator.table import thresholds
from orchestrator.errors import InputError
from orchestrator.fidelity.decision import decide
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.pile_case import PileCase
from orchestrator.study import study
from orchestrator.study.criterion import is_sustained, of_single_grain
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

SAND = "[grain]\ndensity = 2650.0\ndiameter = 3.5e-4\n"
WATER = '[fluid]\nkind = "water"\n'
PILE = "[bed]\nkind = 'pile'\nslope_deg = 15.0\n"
STRIP = """[bed]
kind = "flat"
packing = "poured"
length = 0.007
width = 6.0
"""
MIXTURE = f"[grain.sizes]\nsigma_g = 1.3\n{STRIP}"
SHARING = '[forces]\nexposure = "protrusion"\nsheltering = "balanced"\n'
BOTH = '[threshold]\ncriterion = "sustained"\n'
CURVED = "[bed]\nkind = 'dune'\nslope_deg = 10.0\nwindward = 'curved'\n"


def _scene(text: str) -> Scene:
    scene, *_ = study.parse(text, name="one", where="one").scenes
    return scene


@pytest.mark.parametrize(
    ("text", "does"),
    [
        (SAND, False),  # the paper's fluid
        (SAND + WATER, True),
        (SAND + '[fluid]\nkind = "air"\n', True),
        (SAND + "[fluid]\ndensity = 1.2\nviscosity = 1.5e-5\n", True),
        (SAND + WATER + '[method]\nkind = "pivot"\n', True),
        (SAND + WATER + '[threshold]\ncriterion = "entrained"\n', False),
        # a single grain is followed by LIGGGHTS as it leaves
        (SAND + WATER + '[method]\nkind = "dem"\n', False),
        (SAND + '[threshold]\ncriterion = "sustained"\n', True),
        (SAND + WATER + '[forces]\nlaw = "paper"\n', False),
        # as `threshold` does: cohesion holds a grain in its pocket, not in its hops
        (SAND + "cohesion = 1e-5\n" + WATER, True),
        # mixtures, and grains that share the stress, by request alone
        (SAND + WATER + "[bed]\nrelative_size = 2.0\n", True),
        (SAND + WATER + MIXTURE, False),
        (SAND + WATER + STRIP, True),
        (SAND + WATER + STRIP + SHARING, False),
        (SAND + WATER + MIXTURE + BOTH, True),
        (SAND + WATER + STRIP + SHARING + BOTH, True),
        (SAND + WATER + "[bed]\nrelative_size = 2.0\n" + BOTH, True),
        (SAND + WATER + "[flow]\ngusts = { intensity = 0.4, events = 9 }\n", False),
    ],
)
def test_fluid_and_forces_decide_where_nothing_is_asked(text: str, does: bool) -> None:
    assert is_sustained(_scene(text)) is does


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('[forces]\nlaw = "low"\n', "the law low is one of entrainment alone"),
        ('[method]\nkind = "dem"\n', 'method.kind = "pivot"'),
        (
            PILE + "[threshold]\nupdate = 0.1\n",
            "on a bed that changes (threshold.update) stress and slope of a grain",
        ),
    ],
)
def test_a_criterion_that_a_scene_cannot_have_is_refused(text: str, word: str) -> None:
    asked = SAND + (text if "[threshold]" in text else text + BOTH)
    asked = asked.replace("[threshold]\nupdate", BOTH + "update")
    with pytest.raises(InputError, match=r"threshold.criterion") as refused:
        _scene(asked)
    assert word in str(refused.value)


def test_cohesion_holds_a_grain_in_its_pocket_but_not_as_it_goes_on() -> None:
    air = '[fluid]\nkind = "air"\n'
    loose = of_single_grain(_scene(SAND + air))
    sticky = of_single_grain(_scene(SAND + "cohesion = 2e-3\n" + air))
    assert sticky.sustained == loose.sustained
    assert sticky.cessation == loose.cessation
    assert sticky.entrained[0] > 2 * loose.entrained[0]
    assert sticky.shields == sticky.entrained
    assert not sticky.sustained_decides[0]
    # and is the answer of `threshold`
    at_once = thresholds(
        {
            "diameter": [3.5e-4],
            "density": [2650.0],
            "fluid_density": [1.225],
            "viscosity": [1.4607e-5],
            "cohesion": [2e-3],
        }
    )
    found = at_once["shields"][at_once["answer"]]
    assert found == pytest.approx(sticky.shields, rel=1e-6)


def test_what_answers_a_bed_whose_grains_go_on() -> None:
    of_bed = {
        "": "pivot",
        # a pile of 20 diameters, as numerical errors were measured on
        f"{PILE}height = 0.007\n": "pivot",
        CURVED: "local",
        "[bed]\nkind = 'flat'\n": "local",
    }
    for bed, method in of_bed.items():
        answer = decide(_scene(SAND + WATER + bed), None)
        assert answer.scene.method.kind == method
        assert answer.scene.threshold.criterion == "sustained"
        assert answer.asked.threshold.criterion == "auto"
        # in the paper's fluid as before
        before = decide(_scene(SAND + bed), None)
        assert before.scene.threshold.criterion == "auto"
        assert before.scene.method.kind != "local"
    # grains where they are asked for
    asked = SAND + WATER + CURVED + "[method.grains]\nmobile_layers = 3\n"
    assert decide(_scene(asked), None).scene.method.kind == "dem"


@pytest.mark.parametrize("kind", ["auto", "local", "pivot", "peeling", "dem"])
def test_every_method_answers_the_same_question(kind: str) -> None:
    text = SAND + WATER + PILE + f'[method]\nkind = "{kind}"\n'
    answer = decide(_scene(text), None).scene
    assert answer.threshold.criterion == "sustained"
    if kind != "auto":
        assert answer.method.kind == kind


def test_a_run_of_dem_does_not_depend_on_the_criterion() -> None:
    scene = _scene(SAND + WATER + PILE + '[method]\nkind = "dem"\n')
    other = changed(scene, {"threshold.criterion": "sustained"})
    assert scene.id != other.id
    assert PileCase(scene).parameters == PileCase(other).parameters


def test_a_grain_moves_at_the_larger_of_both_flows() -> None:
    leaving = Motion.of_flows(np.array([1.0, 3.0, 2.0, np.inf]))
    further = np.array([2.0, 1.0, 5.0, 1.0])
    over = np.array([2.0, 2.0, 1.0, 2.0])
    assert leaving.until(further, over).flows.tolist() == [2.0, 1.5, 5.0, np.inf]


def test_sand_on_a_level_bed_is_answered_as_one_grain_and_usable(
    tmp_path: Path,
) -> None:
    """Fine sand in water had no answer: "the row has no end"."""
    sizes = [1.2e-4, 2e-4, 3.5e-4, 1e-3]
    text = f"""
        grain.density = 2650.0
        [axes]
        "grain.diameter" = {sizes}
        "fluid.kind" = ["water", "air"]
        [[group]]
        name = "level"
        bed = {{ kind = "flat" }}
        [[group]]
        name = "grain"
        bed = {{ kind = "grain" }}
    """
    file = tmp_path / "level.toml"
    file.write_text(text, encoding="utf-8")
    results = orchestrator.run(file, out=tmp_path / "out")
    beds = results.tables["pile_threshold"]
    grains = results.tables["single_grain"]
    assert beds["usable"].all()
    assert grains["usable"].all()
    assert {*beds["decides"]} == {"entrained", "sustained"}
    for fluid in ("water", "air"):
        at_once = _by_calculator(fluid, sizes)
        gas = fluid == "air"
        for table, column in ((beds, "shields"), (grains, "shields_closed_form")):
            rows = table[(table["nu_m2_s"] > 5e-6) == gas].sort_values("d_m")
            found = rows.groupby("d_m")[column].first().to_numpy()
            assert found == pytest.approx(at_once, rel=1e-6)


def _by_calculator(fluid: str, sizes: list[float]) -> np.ndarray:
    numbers = {"water": (999.1, 1.1386e-6), "air": (1.225, 1.4607e-5)}[fluid]
    density, viscosity = numbers
    count = len(sizes)
    table = thresholds(
        {
            "diameter": sizes,
            "density": [2650.0] * count,
            "fluid_density": [density] * count,
            "viscosity": [viscosity] * count,
        }
    )
    return np.asarray(table["shields"][table["answer"]])


@pytest.mark.parametrize("bed", ["", PILE, CURVED])
@pytest.mark.parametrize("tolerance", ["", "tolerance = 0.2\n"])
def test_a_criterion_that_is_written_is_answered_as_where_it_is_left_open(
    bed: str, tolerance: str
) -> None:
    asked = ("", '[threshold]\ncriterion = "sustained"\n')
    answers = []
    for threshold in asked:
        text = tolerance + SAND + WATER + bed + threshold
        made = study.parse(text, name="one", where="one")
        plan.make(made)
        answers.append(decide(made.scenes[0], made.tolerance))
    left, written = answers
    assert written.scene == left.scene
    assert (written.fidelity, written.why) == (left.fidelity, left.why)


BY_NUMBERS = (9.9e-6, 1e-5, 1.00001e-5, 1.01e-5)
"""Viscosities around that of the paper's gas, m2/s."""


def _shields_over(axis: str, values: tuple[float, ...], text: str = "") -> np.ndarray:
    """Thresholds of single grains along an axis, as a study answers them."""
    listed = f'[method]\nkind = "pivot"\n[axes]\n"{axis}" = {[*values]}\n'
    made = study.parse(SAND + text + listed, name="one", where="one")
    found = []
    for scene in made.scenes:
        answer = decide(scene, None).scene
        assert answer.threshold.criterion == "sustained"
        found.append(float(of_single_grain(answer).shields[0]))
    return np.array(found)


def test_no_number_of_the_fluid_switches_the_criterion() -> None:
    shields = _shields_over("fluid.viscosity", BY_NUMBERS)
    assert shields[2] == pytest.approx(shields[1], rel=1e-4)
    # 1 % of viscosity moves the threshold by no more
    assert np.abs(np.diff(np.log(shields))).max() < 0.01
    # and so says `threshold`, row by row
    for criterion in ("auto", "sustained"):
        rows = orchestrator.threshold(
            3.5e-4, density=2650.0, viscosity=BY_NUMBERS, criterion=criterion
        )
        assert rows["shields"].to_numpy() == pytest.approx(shields, rel=1e-6)
    alone = orchestrator.threshold(3.5e-4, density=2650.0, viscosity=1e-5)
    assert alone["shields"][0] == pytest.approx(shields[1], rel=1e-6)


def test_no_size_switches_the_criterion() -> None:
    sizes = (0.99, 1.0, 1.01)
    shields = _shields_over("bed.relative_size", sizes, WATER)
    assert np.abs(np.diff(np.log(shields))).max() < 0.05


PAPER_GAS = '[fluid]\nkind = "paper"\n'


@pytest.mark.filterwarnings("ignore:.*is unusual for")
@pytest.mark.parametrize(
    ("fluid", "criterion"),
    [
        ("", "entrained"),
        (PAPER_GAS, "entrained"),
        (PAPER_GAS + "viscosity = 1e-3\n", "entrained"),
        ("[fluid]\ngravity = 3.71\n", "entrained"),
        ("[fluid]\nviscosity = 1e-5\n", "sustained"),
        ("[fluid]\ndensity = 1.0\n", "sustained"),
        ("[fluid]\ndensity = 1.0\nviscosity = 1e-5\n", "sustained"),
    ],
)
def test_the_word_of_the_fluid_decides(fluid: str, criterion: str) -> None:
    scene = _scene(SAND + fluid)
    assert is_sustained(scene) is (criterion == "sustained")
    # a field that is changed leaves the fluid what it is
    other = changed(scene, {"fluid.viscosity": 2e-5})
    assert is_sustained(other) is is_sustained(scene)
    table = dict(scene.fluid)
    rows = orchestrator.threshold(
        3.5e-4,
        density=2650.0,
        fluid=scene.fluid.kind,
        fluid_density=table["density"],
        viscosity=table["viscosity"],
        gravity=table["gravity"],
    )
    assert ("decides" in rows) is (criterion == "sustained")


def test_the_papers_gas_by_its_word_is_that_without_a_fluid() -> None:
    by_word = _scene(SAND + PAPER_GAS)
    assert by_word == _scene(SAND)
    by_numbers = _scene(SAND + "[fluid]\ndensity = 1.0\nviscosity = 1e-5\n")
    # another answer, of the same run
    assert by_word.id != by_numbers.id
    assert by_word.digest == by_numbers.digest
    rows = orchestrator.threshold([2e-4, 1e-3], fluid="paper")
    assert rows.equals(orchestrator.threshold([2e-4, 1e-3]))


@pytest.mark.parametrize("law", ["bridged", "profile", "low", "high", "paper"])
def test_a_law_has_one_criterion_in_a_study_and_in_threshold(law: str) -> None:
    scene = _scene(f'{SAND}{WATER}[forces]\nlaw = "{law}"\n')
    rows = orchestrator.threshold(3.5e-4, density=2650.0, fluid="water", law=law)
    assert ("decides" in rows) is is_sustained(scene)


def test_steeper_lee_slopes_of_dry_sand_move_earlier(tmp_path: Path) -> None:
    """Grains that go on in any flow were told as such that never do."""
    found = []
    for slope in (25.0, 28.0, 30.0, 31.0, 33.0):
        bed = f"kind = 'dune'\nslope_deg = 15.0\nlee_slope_deg = {slope}\n"
        scene = _scene(
            "[grain]\ndensity = 2650.0\ndiameter = 2.5e-4\n"
            f"[fluid]\nkind = 'air'\n[bed]\n{bed}counted = 'all'\nheight = 0.01\n"
            "[method]\nkind = 'pivot'\nflow = { model = 'flat' }\n"
        )
        flows = Pile(decide(scene, None).scene, tmp_path).motion(tmp_path).flows
        assert np.isfinite(flows).all()
        found.append(np.quantile(flows, 0.1))
    assert (np.diff(found) < 0).all()
    assert found[-1] < found[0] < 0.2
