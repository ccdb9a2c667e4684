"""What a study refuses, and what an unguarded one lets through."""

import pytest

from orchestrator.errors import InputError
from orchestrator.study import study
from orchestrator.study.scene import PileBed

PILE = """
[grain]
diameter = 1e-3
[bed]
kind = "pile"
slope_deg = 15.0
roughness = "d/30"
[flow]
model = "solve"
"""
BEYOND = [
    (PILE.replace("15.0", "31.0"), "bed.slope_deg", "90 deg - entrainment angle"),
    (PILE.replace("15.0", "5.0"), "bed.slope_deg", "choose 10"),
    (PILE + "first_cell_height = 6e-5\n", "bed.roughness", "z_e"),
    (PILE + "viscosity = 1e-2\n", "flow.viscosity", "not turbulent"),
]


@pytest.mark.parametrize(("text", "field", "word"), BEYOND, ids=[b[1] + b[2] for b in BEYOND])
def test_beyond_the_limits_a_study_is_refused_and_a_map_is_not(
    text: str, field: str, word: str
) -> None:
    with pytest.raises(InputError, match=word) as caught:
        study.parse(text, name="test", where="test.toml")
    assert caught.value.where == f"test.toml: {field}"
    assert study.parse(text, name="test", where="test.toml", guarded=False).scenes


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (PILE.replace("15.0", "75.0"), "bed.slope_deg"),
        (PILE + "first_cell_height = 6e-3\n", "flow.first_cell_height"),
        (PILE.replace("1e-3", "5e-3"), "bed.height"),
    ],
)
def test_what_cannot_be_built_is_refused_always(text: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        study.parse(text, name="test", where="test.toml", guarded=False)
    assert caught.value.where == f"test.toml: {field}"


def test_a_theory_has_no_mesh_to_refuse() -> None:
    text = PILE.replace("solve", "hill") + "first_cell_height = 6e-5\n"
    (scene,) = study.parse(text, name="test", where="test.toml").scenes
    assert isinstance(scene.bed, PileBed)
