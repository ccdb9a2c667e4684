"""The decision how a scene is answered: by which fidelity, what is known of it, and why."""

import math

import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity import choice, decision
from orchestrator.fidelity.classes import FLOW, LEVEL_BED, scene_class
from orchestrator.fidelity.decision import CHECKS, checks, decide, written
from orchestrator.fidelity.fidelities import PAIRS
from orchestrator.fidelity.known import known
from orchestrator.fidelity.spread import floors, model_class
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed, value_of
from tests.fidelity.conftest import MakePile

GUSTS = {"intensity": 0.4, "events": 100}


MEASURED: dict[str, dict[str, object]] = {
    "aligned": {},
    "horizontal": {},
    "disordered": {"bed.height": 0.01},
    "poured": {"bed.height": 0.012, "grain.sizes": {"sigma_g": 1.3}},
}
"""Piles of each packing of which errors were measured."""


@pytest.mark.parametrize("packing", [*MEASURED])
@pytest.mark.parametrize("tolerance", [1e-9, 0.05, 0.2, 0.8])
def test_the_choice_is_within_the_tolerance_or_says_that_none_is(
    tolerance: float, packing: str, pile: MakePile
) -> None:
    scene = pile(MEASURED[packing], packing=packing)
    chosen = decide(scene, tolerance)
    errors = {one: known(one, scene) for one in PAIRS if one.takes(scene)}
    errors = {one: error for one, error in errors.items() if math.isfinite(error.total)}
    assert chosen.fidelity in errors
    assert chosen.error_estimate == chosen.known.total == errors[chosen.fidelity].total
    assert chosen.scene == chosen.fidelity.answer(scene)
    assert chosen.known.worst.scenes
    missed = chosen.known.total > tolerance
    assert missed == ("meets the tolerance at n/N" in chosen.why)
    # none that is cheaper has as much within the tolerance
    own = choice.cost_s(chosen.scene)
    for one, error in errors.items():
        if choice.cost_s(one.answer(scene)) < own and not missed:
            assert error.total > tolerance


def test_flow_and_grains_are_chosen_apart(pile: MakePile) -> None:
    """The crest grain changes its rank on 20 cells; its pivot is as good as a run."""
    scene = pile({"threshold.fractions": [0.1, 0.3, 0.5, 0.7]})
    chosen = decide(scene, 0.05)
    assert chosen.fidelity
    assert (chosen.fidelity.flow.name, chosen.fidelity.grains.name) == (
        "static",
        "quick",
    )
    loose = decide(scene, 0.2)
    assert loose.fidelity
    assert loose.fidelity.name == "quick"
    # each fraction has its own error: above the crest the coarse flow is enough
    upper = pile({"threshold.fractions": [0.3, 0.5]})
    assert decide(upper, 0.05).scene.method.flow.cells_per_face == 20


def test_where_nothing_meets_the_tolerance_the_message_says_what_would_help(
    pile: MakePile,
) -> None:
    uncertain = decide(pile(packing="horizontal"), 0.05)
    assert "the reference itself is known to" in uncertain.why
    assert "no DEM is better" in uncertain.why
    scene = pile({"threshold.fractions": [0.3]})
    near = decide(scene, 0.03)
    assert "tolerance = " in near.why
    said = float(near.why.rpartition("tolerance = ")[2].split()[0])
    assert decide(scene, said).known.total <= said
    assert decide(scene, said - 0.002).known.total > said - 0.002


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"method.grains.waiting_time": 1.0}, "rises steadily"),
        ({"method.kind": "peeling", "flow.gusts": GUSTS}, "peeling"),
        ({"method.kind": "peeling", "method.flow.model": "waves"}, "waves"),
        ({"method.flow.model": "waves"}, "waves"),
        ({"threshold.update": 0.1, "method.flow.first_cell_height": 5e-4}, "update"),
        ({"bed.packing": "poured", "bed.width": 6.0}, "no error is known"),
        ({"forces.averaging_length": 10.0}, "averaging_length other than 0.025"),
        ({"method.flow.first_cell_height": 0.005}, "first cells of 0.005 m"),
        ({"forces.law": "low", "bed.slope_deg": 20.0}, "lift"),
        ({"flow.gusts": GUSTS}, "flow.gusts"),
    ],
)
def test_what_is_asked_for_or_not_known_is_answered_as_asked(
    fields: dict[str, object], word: str, pile: MakePile
) -> None:
    scene = pile(fields)
    chosen = decide(scene, 0.3)
    assert not chosen.is_chosen
    assert chosen.scene == written(scene)
    assert word in chosen.why


@pytest.mark.parametrize("kind", ["peeling", "pivot"])
def test_of_a_method_that_is_asked_for_a_tolerance_chooses_the_mesh(
    kind: str, pile: MakePile
) -> None:
    """The grains stay with the method, and no DEM checks what was not asked of it."""
    scene = pile({"method.kind": kind, "method.flow.cells_per_face": 80}, height=0.02)
    loose, strict = decide(scene, 0.2), decide(scene, 0.05)
    for one in (loose, strict):
        assert one.scene.method.kind == kind
        assert one.is_chosen
        assert not one.is_unchecked
        assert f"asks for the method {kind}" in one.why
    cells = [one.scene.method.flow.cells_per_face for one in (loose, strict)]
    assert cells == [20, 40]
    assert strict.known.total <= 0.05 < loose.known.total <= 0.2
    assert decide(scene, None).scene == scene
    assert "its flow: the mesh of quick, the cheapest fidelity" in loose.why
    # a mesh of its own that is as good is left as it is
    own = pile({"method.kind": kind, "method.flow.cells_per_face": 20}, height=0.02)
    assert "its flow: the mesh as written" in decide(own, 0.2).why


def test_so_it_does_of_the_closed_form_along_a_bed() -> None:
    """Its grains are places: the flow alone has an error."""
    scene = study.load("dune", 0.2).scenes[0]
    asked = decide(changed(scene, {"method.kind": "local"}), 0.2)
    assert asked.scene.method.kind == "local"
    assert not asked.is_unchecked
    assert asked.scene.method.flow.cells_per_face == 20
    assert "its flow: the mesh of quick, the cheapest fidelity" in asked.why


@pytest.mark.parametrize("kind", ["auto", "dem", "peeling"])
@pytest.mark.parametrize("tolerance", [None, 0.2])
def test_what_was_not_measured_is_told_once_with_all_that_is_outside(
    kind: str, tolerance: float | None, pile: MakePile
) -> None:
    fields = {"method.kind": kind, "grain.friction_angle_deg": 30.0}
    why = decide(pile(fields, entrainment_angle_deg=50.0), tolerance).why
    assert why.count("no error is known for") == 1
    # what makes the bed what it is comes first
    beyond = "bed.entrainment_angle_deg other than 60 and grain.friction_angle_deg"
    assert f"{beyond} other than 35" in why


def test_an_obstacle_is_the_first_reason_against_a_bed_with_one() -> None:
    """Beds beside one were measured with one law and one density, too."""
    fenced = study.load("fence", None).scenes[-1]
    assert fenced.obstacles
    why = decide(fenced, None).why
    first = why.partition("no error is known for ")[2]
    assert first.startswith("bed.obstacles: ")
    assert "grain.density" in first or " more" in first


def test_what_helps_against_an_unknown_error_is_what_has_a_known_one(
    pile: MakePile,
) -> None:
    """DEM's own error was measured on beds of fewer diameters than that of peeling."""
    asked = decide(pile({"method.kind": "dem"}, height=0.05), None)
    assert asked.error_at(0.3) is None
    said = decision.of_unknown_error(asked, 0.3, None)
    free = decide(changed(asked.asked, {"method.kind": "auto"}), None)
    assert free.error_at(0.3) is not None
    assert said.startswith("leave method.kind out")
    assert free.scene.method.kind in said
    assert decision.of_unknown_error(asked, 0.99, None) == decision.ESTIMATE
    open_bed = decide(pile({"grain.friction_angle_deg": 20.0}), None)
    assert decision.of_unknown_error(open_bed, 0.3, None) == decision.ESTIMATE


def test_over_a_level_bed_the_flow_is_exact_and_the_grains_are_chosen(
    pile: MakePile,
) -> None:
    asked = pile(
        {"method.flow.model": "flat"}, packing="poured", shape="flat", slope_deg=0.0
    )
    assert scene_class(FLOW, asked) == LEVEL_BED
    for tolerance in (0.9, 0.7, 0.1):
        chosen = decide(asked, tolerance)
        assert chosen.fidelity
        assert chosen.scene.method.flow.model == "flat"


@pytest.mark.parametrize(
    ("slope", "angle", "method"), [(20.0, 60.0, "pivot"), (69.0, 20.0, "dem")]
)
def test_a_single_grain_needs_no_fidelity(
    slope: float, angle: float, method: str
) -> None:
    text = f"""
        grain = {{ diameter = 1e-3, friction_angle_deg = 80.0 }}
        bed = {{ kind = "grain", slope_deg = {slope}, entrainment_angle_deg = {angle} }}
    """
    (scene,) = study.parse(text, name="one", where="test").scenes
    chosen = decide(scene, 0.05)
    assert chosen.scene.method.kind == method
    assert (chosen.fidelity, chosen.error_estimate) == (None, None)


def _asked(bed: str = "", method: str = "", diameter: float = 1e-3) -> Scene:
    text = f"""
        grain = {{ diameter = {diameter} }}
        bed = {{ kind = "pile", slope_deg = 15.0{bed} }}
        {method}
    """
    (scene,) = study.parse(text, name="own", where="own").scenes
    return scene


@pytest.mark.parametrize(
    ("packing", "diameter"),
    [("aligned", 7e-4), ("aligned", 1e-3), ("disordered", 1e-3)],
)
def test_the_default_errs_less_than_the_model_is_worth(
    packing: str, diameter: float
) -> None:
    scene = _asked(
        f', packing = "{packing}", height = 0.01',
        "threshold.fractions = [0.3]",
        diameter,
    )
    chosen = decide(scene, None)
    assert chosen.is_chosen
    assert chosen.scene.method.kind != "dem"
    assert chosen.scene.method.flow.model == "solve"
    assert f"measured on {floors()[model_class(scene)].scenes} beds" in chosen.why
    assert chosen.known.total <= floors()[model_class(scene)].error


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
def test_more_grains_are_answered_without_them_in_rows_along_the_bed_alone(
    packing: str,
) -> None:
    few, many = (
        decide(_asked(f', packing = "{packing}", height = {height}'), None)
        for height in (0.6, 0.7)
    )
    assert few.scene.method.kind == "dem"
    method = "peeling" if packing == "horizontal" else "local"
    assert many.scene.method.kind == method
    # no bed of so many grains was measured
    assert few.error_estimate is many.error_estimate is None


def test_the_closed_form_along_the_bed_is_refused_for_level_rows() -> None:
    with pytest.raises(InputError, match="local is of rows along the bed"):
        _asked(', packing = "horizontal"', 'method.kind = "local"')


@pytest.mark.parametrize(
    ("bed", "method", "word"),
    [
        ("", 'method.kind = "dem"', "the method dem"),
        ("", 'method.kind = "peeling"', "the method peeling"),
        ("", "method.grains.load_increment = 0.05", "method.grains.load_increment"),
        ("", "method.grains.mobile_layers = 1", "method.grains.mobile_layers"),
        (', packing = "poured"', "", "poured"),
        (', shape = "dune"', "", "spread"),
    ],
)
def test_what_a_file_says_stays(bed: str, method: str, word: str) -> None:
    scene = _asked(bed, method)
    chosen = decide(scene, None)
    assert not chosen.is_chosen
    kind = scene.method.kind
    kept = "dem" if kind == "auto" else kind
    assert chosen.scene == changed(scene, {"method.kind": kept})
    assert word in chosen.why


@pytest.mark.parametrize("field", ["method.flow.speed", "method.flow.viscosity"])
def test_a_number_of_the_solve_that_fidelities_keep_asks_for_no_dem(
    field: str, pile: MakePile
) -> None:
    value = {"method.flow.speed": 1.0, "method.flow.viscosity": 1e-6}[field]
    plain, other = decide(pile(), None), decide(pile({field: value}), None)
    assert plain.is_chosen
    assert other.fidelity is plain.fidelity
    assert value_of(other.scene, field) == value


GRAIN = 'bed.kind = "grain"'
PILE = 'bed = { kind = "pile", slope_deg = 15.0, height = 0.01%s }'
LONG = 'bed = { kind = "pile", slope_deg = 15.0, height = 2.0%s }'
POURED = PILE % ', packing = "poured"%s'
BALANCED = 'forces.sheltering = "balanced"'
GUSTY = "flow.gusts = { intensity = 0.4, events = 100 }"
COHESION = "grain.cohesion = 1e-3"


@pytest.mark.parametrize(
    ("bed", "more", "method"),
    [
        (GRAIN, "", "dem"),
        (GRAIN, GUSTY, "pivot"),
        (GRAIN, COHESION, "pivot"),
        (PILE % "", GUSTY, "dem"),
        (PILE % "", COHESION, "peeling"),
        (PILE % "", BALANCED, "dem"),
        (POURED % "", "", "dem"),
        (POURED % "", COHESION, "peeling"),
        (POURED % ", width = 6.0", COHESION, "pivot"),
        (LONG % "", "", "local"),
        (LONG % "", COHESION, "local"),
        (LONG % "", GUSTY, "local"),
        # neither level rows nor grains that share the stress are those of the closed form
        (
            LONG % ', packing = "horizontal"' + "\nmethod.grains.mobile_layers = 1",
            "",
            "peeling",
        ),
        (LONG % ', packing = "horizontal"', COHESION, "peeling"),
        (LONG % "", BALANCED, "peeling"),
    ],
)
def test_what_dem_does_not_know_is_answered_by_a_method_that_does(
    bed: str, more: str, method: str
) -> None:
    text = f"grain.diameter = 1e-3\n{bed}\n{more}"
    (scene,) = study.parse(text, name="one", where="one").scenes
    answer = decide(scene, None)
    assert answer.scene == changed(scene, {"method.kind": method})
    assert not answer.is_chosen
    assert answer.is_along == (method == "local")
    if more:  # no error is known of any of these, or none of what answers
        assert decide(scene, 0.3).scene == answer.scene
        assert answer.error_estimate is None


def test_a_pile_whose_flow_is_that_of_dem_is_not_checked_alone(pile: MakePile) -> None:
    """Its check would answer it by DEM at the cost of the scene as it is written."""
    coarse = {"method.flow.cells_per_face": 20, "bed.slope_deg": 10.0}
    answer = decide(pile(coarse), 0.5)
    assert answer.is_unchecked
    assert answer.scene.method.flow == answer.asked.method.flow
    assert not checks([answer])


def test_of_many_groups_no_more_are_checked_than_the_share_needs(
    pile: MakePile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each class of numerical errors by one at least, whatever the order."""
    assert CHECKS / (CHECKS + 1) >= 0.95 > (CHECKS - 1) / CHECKS
    asked: list[dict[str, object]] = []
    asked += [{"bed.slope_deg": slope} for slope in (15.0, 18.0, 19.0, 20.0)]
    asked.append({"forces.stress": "eq10", "forces.law": "high"})
    numbers = {"method.grains.load_increment": 0.05, "method.grains.stiffness": 1e3}
    every = []
    for fields in asked:
        for height in (0.013, 0.016):
            scene = pile({**fields, **numbers}, height=height)
            every.append(decide(scene, 0.2))
    groups = [checks(every[at : at + 2]) for at in range(0, len(every), 2)]
    assert [len(group) for group in groups] == [1] * len(asked)
    one_by_one = {name: check for group in groups for name, check in group.items()}
    assert checks(every) == one_by_one
    for most in (1, 2, 3):
        monkeypatch.setattr(decision, "CHECKS", most)
        made = checks(every)
        assert len(made) == max(most, 2)
        assert made.items() <= one_by_one.items()
        assert groups[-1].keys() <= made.keys()
        assert made == checks(every[::-1])


def test_one_pile_of_each_kind_is_checked_by_dem(pile: MakePile) -> None:
    """The one that DEM answers fastest, whatever the order, and as it is written."""
    eq10 = {"forces.stress": "eq10", "forces.law": "high"}
    scenes = [
        pile(height=0.02),
        pile(height=0.01),
        pile(eq10, height=0.02),
        pile(eq10, height=0.014),
        pile(slope_deg=20.0),
        pile({"method.kind": "pivot"}),
    ]
    numbers = {"method.grains.load_increment": 0.05, "method.grains.stiffness": 1e3}
    scenes = [changed(scene, numbers) for scene in scenes]
    answers = [decide(scene, 0.2) for scene in scenes]
    made = checks(answers)
    # a pile alone is not checked: the check would cost more than the answer saves
    assert set(made) == {scenes[1].id, scenes[3].id}
    assert made == checks(answers[::-1])
    for number in (1, 3):
        by_dem = changed(scenes[number], {"method.kind": "dem"})
        assert made[scenes[number].id].scene == by_dem
