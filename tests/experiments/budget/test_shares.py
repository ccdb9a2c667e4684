"""The shares of choices: which alternatives a scene has, and how changes become shares."""

import math

import pandas as pd
import pytest

from orchestrator.experiments.budget import shares
from orchestrator.experiments.budget.choices import CHOICES
from orchestrator.study.closed_form import law_holds
from orchestrator.study.scene import Scene
from tests.experiments.budget.conftest import scene

ROWS = {"scene_id": "a", "scene": "a", "model_class": "aligned, rough", "fraction": 0.3}


def _others(choice: str, of: Scene) -> dict[str, Scene]:
    (one,) = (one for one in CHOICES if one.name == choice)
    return dict(one.scenes(of))


def test_a_choice_changes_nothing_but_itself() -> None:
    one = scene()
    parts = {
        "roughness length": "bed",
        "turbulence model": "flow",
        "force law": "forces",
        "friction angle": "grain",
        "criterion of motion": "protocol",
    }
    for choice, part in parts.items():
        others = _others(choice, one)
        assert others
        for other in others.values():
            changed = {
                name for name in Scene.model_fields if getattr(other, name) != getattr(one, name)
            }
            assert changed == {part}


def test_what_the_scene_has_already_is_no_alternative() -> None:
    assert list(_others("roughness length", scene())) == ["d/10"]
    assert "level rows" in _others("packing", scene())
    assert "level rows" not in _others("packing", scene(packing="horizontal"))


def test_what_a_scene_refuses_is_no_alternative() -> None:
    # neighbours of a pocket of more than 60 degrees would overlap
    assert list(_others("entrainment angle", scene())) == ["-5°"]
    assert list(_others("entrainment angle", scene(entrainment_angle_deg=52.0))) == ["-5°", "+5°"]


def test_a_lattice_has_pockets_and_a_poured_bed_an_exposure() -> None:
    poured = scene(packing="poured")
    assert set(_others("packing", poured)) == {f"poured, seed {seed}" for seed in (1, 2, 3)}
    assert list(_others("exposure", poured)) == ["protrusion"]
    assert not _others("entrainment angle", poured)
    assert not _others("exposure", scene())


def test_force_laws_are_those_that_hold() -> None:
    others = _others("force law", scene())
    assert others
    assert all(law_holds(other) for other in others.values())
    assert "low" not in {other.forces.law for other in others.values()}


def _moved(*changes: tuple[str, str, float]) -> pd.DataFrame:
    return pd.DataFrame(
        {**ROWS, "choice": choice, "alternative": other, "shields": change, "ustar0": change / 2}
        for choice, other, change in changes
    )


def test_the_share_of_a_choice_is_the_range_of_its_alternatives() -> None:
    moved = _moved(("law", "a", 0.2), ("law", "b", 0.1), ("cell", "half", -0.1), ("cell", "2", 0.3))
    found = shares.shares(moved).set_index("choice")
    assert list(found.loc["law", ["shields_low", "shields_high"]]) == [0.0, 0.2]
    assert list(found.loc["cell", ["shields_low", "shields_high"]]) == [0.1, 0.3]
    assert found.loc["cell", "ustar0_high"] == pytest.approx(0.15)


def test_an_alternative_without_a_threshold_has_no_share() -> None:
    moved = _moved(("law", "a", 0.2), ("law", "b", math.nan))
    assert shares.shares(moved)["shields_high"].tolist() == [0.2]


def test_of_a_class_the_worst_scene_is_kept() -> None:
    one = shares.shares(_moved(("law", "a", 0.2)))
    other = shares.shares(_moved(("law", "a", -0.4))).assign(scene_id="b")
    found = shares.known(pd.concat([one, other]))
    assert found[["shields_low", "shields_high", "scenes"]].to_numpy().tolist() == [[0.4, 0.2, 2.0]]
