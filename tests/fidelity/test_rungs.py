"""The ladder's rungs, and the choice among them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.fidelity import rungs
from orchestrator.fidelity.rungs import Known, Part
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import PileBed, Scene


def _scene(**bed: object) -> Scene:
    text = """
        grain = { diameter = 1e-3 }
        bed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }
    """
    (scene,) = study.parse(text, name="one", where="test").scenes
    return rungs.changed(scene, {f"bed.{name}": value for name, value in bed.items()})


@pytest.mark.parametrize("part", list(rungs.LADDER))
def test_every_rung_gives_a_scene_that_is_known_by_its_name(part: Part) -> None:
    for one in rungs.LADDER[part]:
        assert rungs.names(one.of(_scene()))[part] == one.name


def test_a_rung_changes_how_a_scene_is_answered_not_what_it_asks() -> None:
    scene = _scene()
    for one in (*rungs.FLOW, *rungs.GRAINS):
        changed = one.of(scene)
        assert changed.fluid == scene.fluid
        assert changed.bed.slope_deg == scene.bed.slope_deg
        assert changed.flow.stress == scene.flow.stress
        assert changed.protocol.fractions == scene.protocol.fractions


def test_beds_of_nearly_one_roughness_share_a_flow() -> None:
    shared = rungs.rung("flow", "shared")
    near = [shared.of(_scene(roughness=z0)).flow.roughness for z0 in (3.0e-5, 3.4e-5)]
    assert near[0] == near[1]
    assert shared.of(_scene(roughness=1e-4)).flow.roughness != near[0]


def test_likeness_tells_packings_and_the_limiting_slope_apart() -> None:
    likes = {
        rungs.likeness("grains", scene)
        for scene in (
            _scene(),
            _scene(slope_deg=30.0),
            _scene(packing="horizontal"),
            _scene(packing="disordered", disorder=0.02),
            _scene(packing="disordered", disorder=0.03),
        )
    }
    assert len(likes) == 5


@given(st.floats(0.001, 0.9), st.floats(0.001, 0.9))
def test_a_looser_tolerance_is_never_dearer(one: float, other: float) -> None:
    tight, loose = sorted([one, other])
    scenes = [rungs.choose(_scene(), tolerance) for tolerance in (tight, loose)]
    costs = [_cost(scene) for scene in scenes]
    assert costs[1] <= costs[0] or rungs.error(scenes[0]) > tight


def _cost(scene: Scene) -> float:
    table = rungs.known()
    return sum(
        table[part, name, rungs.likeness(part, scene)][0.5].cost_core_s
        for part, name in rungs.names(scene).items()
    )


@pytest.mark.parametrize("tolerance", [0.05, 0.2])
def test_the_choice_is_known_to_be_within_the_tolerance(tolerance: float) -> None:
    for scene in (_scene(), _scene(packing="horizontal"), _scene(packing="disordered")):
        chosen = rungs.choose(scene, tolerance)
        for fraction in scene.protocol.fractions:
            at = (rungs.known_at(p, n, chosen, fraction) for p, n in rungs.names(chosen).items())
            assert sum(one.error for one in at) <= tolerance


def test_level_rows_are_never_left_to_the_pivot_of_each_grain() -> None:
    chosen = rungs.choose(_scene(packing="horizontal"), 0.2)
    assert chosen.protocol.method != "pivot"
    assert rungs.known_at("grains", "pivot", _scene(packing="horizontal"), 0.5).error > 0.3


def test_what_is_not_known_is_answered_as_asked() -> None:
    wild = _scene(packing="disordered", disorder=0.2)
    assert math.isinf(rungs.known_at("grains", "peeling", wild, 0.5).error)
    assert rungs.choose(wild, 0.2) == wild


def test_a_ramp_stays_a_ramp() -> None:
    ramp = rungs.changed(_scene(), {"protocol.quiet": 1.0})
    assert rungs.choose(ramp, 0.5) == ramp


def test_grains_that_fly_before_they_roll_are_left_to_dem() -> None:
    flying = rungs.changed(_scene(slope_deg=20.0), {"flow.closure": "low"})
    assert closed_form(flying, "low").lift > flying.weight
    assert rungs.choose(flying, 0.2).protocol.method == "dem"


def test_a_rung_that_was_overruled_is_not_chosen_again() -> None:
    scene = _scene()
    first = rungs.choose(scene, 0.2)
    again = rungs.choose(scene, 0.2, above=rungs.names(first))
    for part, name in rungs.names(again).items():
        listed = [one.name for one in rungs.LADDER[part]]
        assert listed.index(name) > listed.index(rungs.names(first)[part])


def test_between_known_fractions_the_worst_one_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {
        ("grains", "peeling", "aligned"): {
            0.1: Known(0.03, 0.0, 1.0),
            0.5: Known(0.01, 0.0, 1.0),
        }
    }
    monkeypatch.setattr(rungs, "known", lambda: table)
    scene = rungs.changed(_scene(), {"protocol.fractions": (0.5,)})
    assert rungs.known_at("grains", "peeling", scene, 0.5).error == 0.01
    assert rungs.known_at("grains", "peeling", scene, 0.2).error == 0.03


def test_only_piles_are_on_rungs() -> None:
    text = 'grain = { diameter = 1e-3 }\nbed = { kind = "grain" }'
    scene = study.parse(text, name="one", where="test").scenes[0]
    chosen = rungs.choose(scene, 0.05)
    assert not isinstance(chosen.bed, PileBed)
    assert chosen.protocol.method == "pivot"
