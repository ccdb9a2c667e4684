"""The decision how a scene is answered: the levels, what is known of them, and the reason."""

import itertools

import numpy as np
import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity import decision, levels
from orchestrator.fidelity.decision import NO_BOUND, Bound, Decision
from orchestrator.fidelity.levels import (
    FLAT,
    FLOW,
    GRAINS,
    LEVEL_BED,
    LEVELS,
    Pair,
    floors,
    model_class,
)
from orchestrator.study import study
from orchestrator.study.scene import Scene
from tests.fidelity.conftest import MakePile


def decide(scene: Scene, tolerance: float | None, above: Bound = NO_BOUND) -> Decision:
    return decision.decide([scene], tolerance, {scene.id: above})[scene.id]


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered", "poured"])
@pytest.mark.parametrize("tolerance", [1e-9, 0.05, 0.2, 0.8])
def test_the_choice_is_within_the_tolerance_or_says_that_none_is(
    tolerance: float, packing: str, pile: MakePile
) -> None:
    scene = pile(packing=packing)
    chosen = decide(scene, tolerance)
    pairs = (Pair(*pair) for pair in itertools.product(FLOW, GRAINS))
    known = {
        pair: levels.known(pair, scene)
        for pair in pairs
        if all(one.is_offered and one.takes(scene) for one in pair)
    }
    assert chosen.levels in known
    assert chosen.error_estimate == chosen.known.total == known[chosen.levels].total
    assert chosen.scene == chosen.levels.answer(scene) != scene
    if "none" in chosen.why:
        best = min(one.total for one in known.values())
        assert best > tolerance
        assert chosen.known.error <= best
    else:
        assert chosen.known.total <= tolerance
        cost = chosen.known
        within = [one for one in known.values() if one.total <= tolerance]
        assert all(one.flow_s >= cost.flow_s or one.grains_s >= cost.grains_s for one in within)


def test_a_flow_that_many_piles_share_counts_once(
    pile: MakePile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By DEM a pile is dear; by pivots on the best flow it needs that flow."""
    errors_and_times = {
        ("flow", "coarse", "wall"): (0.04, 1.0),
        ("flow", "fine", "wall"): (0.0, 5.0),
        ("grains", "1 layer, slow", "aligned"): (0.0, 9.0),
        ("grains", "pivot", "aligned"): (0.04, 0.01),
    }
    made = {key: np.tile([[e], [0], [s]], 4) for key, (e, s) in errors_and_times.items()}
    monkeypatch.setattr(levels, "measured", lambda: made)
    for module, name in ((levels, "known_of_classes"), (decision, "_good_enough")):
        monkeypatch.setattr(module, name, getattr(module, name).__wrapped__)
    scenes = [pile({"grain.diameter": 1e-4}, roughness=z0) for z0 in np.geomspace(4e-6, 3e-5, 9)]
    small = [pile({"grain.diameter": 2e-3})]
    for asked, text in (
        (scenes[:1], "fine | pivot"),
        (scenes, "fine | pivot"),
        (small, "coarse | 1 layer, slow"),
    ):
        chosen = decision.decide(asked, 0.05).values()
        assert {one.levels.text for one in chosen if one.levels} == {text}


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"protocol.waiting_time": 1.0}, "ramp"),
        ({"protocol.method": "peeling"}, "peeling"),
        ({"flow.model": "waves"}, "waves"),
        ({"protocol.update": 0.1, "flow.first_cell_height": 5e-4}, "changes"),
        ({"bed.packing": "disordered", "bed.disorder": 0.2}, "no error is known"),
        ({"forces.averaging_length": 10.0}, "averaging_length = 10"),
        ({"flow.first_cell_height": 0.005}, "first cells of 0.005 m"),
        ({"forces.law": "low", "bed.slope_deg": 20.0}, "lift"),
    ],
)
def test_what_is_asked_for_or_not_known_is_answered_as_asked(
    fields: dict[str, object], word: str, pile: MakePile
) -> None:
    chosen = decide(pile(fields), 0.3)
    assert chosen.is_as_asked
    assert word in chosen.why


def test_over_a_level_bed_the_flow_is_exact_and_the_grains_are_chosen(pile: MakePile) -> None:
    asked = pile({"flow.model": "flat"}, packing="poured", shape="flat", slope_deg=0.0)
    assert levels.classes("flow", asked) == (LEVEL_BED,)
    for tolerance in (0.9, 0.7, 0.1):
        chosen = decide(asked, tolerance)
        assert chosen.levels
        assert chosen.levels.flow is FLAT
        assert chosen.scene.flow.model == "flat"
    assert chosen.levels
    overruled = decide(asked, 0.9, Bound(FLAT, chosen.levels.grains, "overruled"))
    assert overruled.levels
    assert GRAINS.index(overruled.levels.grains) > GRAINS.index(chosen.levels.grains)


def test_levels_that_were_overruled_are_not_chosen_again(pile: MakePile) -> None:
    first = decide(pile(), 0.2)
    assert first.levels
    again = decide(pile(), 0.2, Bound(*first.levels, "DEM overruled them"))
    assert again.levels
    for part, before, after in zip(LEVELS.values(), first.levels, again.levels, strict=True):
        assert part.index(after) > part.index(before)
    assert again.why.endswith("; DEM overruled them")
    last = decide(pile(), 0.2, Bound(FLOW[-1], because="they failed"))
    assert last.is_as_asked
    assert last.why.endswith("; they failed")


@pytest.mark.parametrize(("slope", "angle", "method"), [(20.0, 60.0, "pivot"), (69.0, 20.0, "dem")])
def test_a_single_grain_needs_no_levels(slope: float, angle: float, method: str) -> None:
    text = f"""
        grain = {{ diameter = 1e-3, friction_angle_deg = 80.0 }}
        bed = {{ kind = "grain", slope_deg = {slope}, entrainment_angle_deg = {angle} }}
    """
    (scene,) = study.parse(text, name="one", where="test").scenes
    chosen = decide(scene, 0.05)
    assert chosen.scene.protocol.method == method
    assert (chosen.levels, chosen.error_estimate) == (None, None)


def _asked(bed: str = "", protocol: str = "", diameter: float = 1e-3) -> Scene:
    text = f"""
        grain = {{ diameter = {diameter} }}
        bed = {{ kind = "pile", slope_deg = 15.0{bed} }}
        protocol = {{ {protocol} }}
    """
    (scene,) = study.parse(text, name="own", where="own").scenes
    return scene


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("diameter", [2e-4, 1e-3])
def test_the_default_errs_less_than_the_model_is_worth(packing: str, diameter: float) -> None:
    scene = _asked(f', packing = "{packing}", height = 0.01', "fractions = [0.3]", diameter)
    chosen = decide(scene, None)
    assert chosen.by_default
    assert chosen.scene.protocol.method != "dem"
    assert chosen.scene.flow.model == "solve"
    assert chosen.known.total <= min(floors().values()) <= floors()[model_class(scene)]
    assert chosen.levels
    again = decide(scene, None, Bound(*chosen.levels, "a run failed"))
    assert again.known.cost_core_s > chosen.known.cost_core_s
    assert "a run failed" in again.why


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
def test_more_grains_are_answered_without_them_in_rows_along_the_bed_alone(packing: str) -> None:
    few, many = (
        decide(_asked(f', packing = "{packing}", height = {height}'), None) for height in (0.6, 0.7)
    )
    assert few.levels
    assert many.levels
    if packing == "horizontal":
        assert many.levels == few.levels
    else:
        assert many.scene.protocol.method == "local"


def test_the_closed_form_along_the_bed_is_refused_for_level_rows() -> None:
    with pytest.raises(InputError, match="local is of rows along the bed"):
        _asked(', packing = "horizontal"', 'method = "local"')


@pytest.mark.parametrize(
    ("bed", "protocol", "tolerance"),
    [
        ("", 'method = "dem"', None),  # what is the default counts as said
        ("", "load_increment = 0.05", None),
        (", mobile_layers = 1", "", None),
        (', packing = "poured"', "", None),
        (', shape = "dune"', "", None),
        ("", "", 0.0),
    ],
)
def test_what_a_file_says_stays(bed: str, protocol: str, tolerance: float | None) -> None:
    chosen = decide(_asked(bed, protocol), tolerance)
    assert chosen.is_as_asked
    assert not chosen.by_default
