"""What a plan refuses, what it is warned of, and what a study file may still ask for."""

import re
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.fidelity.decision import as_asked
from orchestrator.fidelity.levels import changed
from orchestrator.study import study
from orchestrator.study.study import Study
from tests.fidelity.conftest import MakePile

GRAIN = """
[grain]
diameter = 1e-3
[bed]
slope_deg = {slope}
entrainment_angle_deg = {angle}
"""
FENCE = 'slope_deg = 15.0, obstacles = [{ kind = "fence", x = -0.1, height = 0.01 }]'
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
    (GRAIN.format(slope=31.0, angle=60.0), "bed.slope_deg", "= 30 deg"),
    (GRAIN.format(slope=36.0, angle=50.0), "bed.slope_deg", "= 35 deg"),
    (PILE.replace("15.0", "31.0"), "bed.slope_deg", "90 deg - entrainment angle"),
    (PILE.replace("15.0", "5.0"), "bed.slope_deg", "choose 10"),
    (PILE + "first_cell_height = 3e-5\n", "bed.roughness", "z_e"),
    (PILE + "viscosity = 1e-2\n", "flow.viscosity", "not turbulent"),
]


def _parse(text: str) -> Study:
    return study.parse(text, name="test", where="test.toml")


@pytest.mark.parametrize(("text", "field", "word"), BEYOND, ids=[b[1] + b[2] for b in BEYOND])
def test_beyond_the_limits_a_plan_is_refused_and_a_map_is_not(
    text: str, field: str, word: str
) -> None:
    asked = _parse(text)
    with pytest.raises(InputError, match=word) as caught:
        plan.make(asked)
    assert caught.value.where == f"test.toml: {field}"
    assert plan.of({scene.id: as_asked(scene) for scene in asked.scenes}, "map").cases


def test_the_group_of_a_scene_that_is_refused_is_named() -> None:
    asked = _parse(PILE + "[[group]]\n[[group]]\nbed = { slope_deg = 31.0 }\n")
    with pytest.raises(InputError) as caught:
        plan.make(asked)
    assert caught.value.where == "test.toml: group 2: bed.slope_deg"


@pytest.mark.parametrize("command", ["study", "ladder"])
def test_a_study_beyond_the_limits_writes_nothing(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "steep.toml"
    source.write_text(PILE.replace("15.0", "31.0"))
    assert cli.main([command, str(source), "--out", str(tmp_path / "out")]) == 2
    assert f"{source}: bed.slope_deg: 31 deg is beyond" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [source]


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
        _parse(text)
    assert caught.value.where == f"test.toml: {field}"


def test_a_theory_has_no_mesh_to_refuse() -> None:
    (pile,) = plan.make(_parse(PILE.replace("solve", "hill") + "first_cell_height = 3e-5\n")).piles
    assert pile


@pytest.mark.parametrize(
    ("bed", "says"),
    [
        ('shape = "cosine", slope_deg = 31.0', r"bed: 3\d\.?\d* deg at x = .* is beyond min"),
        ('shape = "dune", slope_deg = 15.0, counted = "all", lee_slope_deg = 33.0', "33 deg at x"),
        ("slope_deg = 15.0, forms = 2, spacing = 0.1", r"bed.spacing: forms 0.149\d* m long over"),
        ('shape = "flat", counted = "windward"', "no grain is counted"),
    ],
)
def test_beds_that_no_grains_lie_on_are_refused(bed: str, says: str) -> None:
    text = f'grain = {{ diameter = 1e-3 }}\nbed = {{ kind = "pile", {bed} }}'
    with pytest.raises(InputError, match=says):
        limits.check_study(study.parse(text, name="t", where="t"))


def test_a_flat_bed_is_not_solved() -> None:
    bed = 'kind = "pile", shape = "flat", roughness = "d/30"'
    text = f"grain = {{ diameter = 1e-3 }}\nbed = {{ {bed} }}\n"
    with pytest.raises(InputError, match="nothing to solve") as told:
        limits.check_study(study.parse(text, name="flat", where="flat"))
    assert told.value.remedy.startswith('choose "flat"')
    limits.check_study(study.parse(text + 'flow = { model = "flat" }', name="f", where="f"))


@pytest.mark.parametrize(
    ("model", "bed", "what"),
    [
        ("hill", "slope_deg = 15.0", ""),
        ("hill", 'shape = "cosine", slope_deg = 15.0, forms = 3', ""),
        ("hill", 'shape = "step up", slope_deg = 15.0', "does not fall to half of its height"),
        ("waves", 'shape = "step up", slope_deg = 15.0', ""),
        ("hill", FENCE, "rises by 75 deg at x = -0.1"),
        ("waves", FENCE, "rises by 75 deg at x = -0.1"),
    ],
)
def test_the_theories_are_of_low_beds(model: str, bed: str, what: str) -> None:
    text = (
        f'grain = {{ diameter = 1e-3 }}\nflow = {{ model = "{model}" }}\n'
        f'bed = {{ kind = "pile", {bed} }}'
    )
    asked = study.parse(text, name="t", where="t")
    if not what:
        limits.check_study(asked)
        return
    with pytest.raises(InputError, match=what):
        limits.check_study(asked)


@pytest.mark.parametrize(
    "bed",
    [
        'shape = "flat", length = 1e4',
        "slope_deg = 15.0, forms = 2, spacing = 1e4",
        'shape = "dune", slope_deg = 12.0, height = 20.0',
        'slope_deg = 20.0, obstacles = [{ kind = "fence", x = -500.0, height = 0.01 }]',
    ],
)
def test_the_length_of_a_bed_in_grains_is_limited(bed: str) -> None:
    text = f'grain = {{ diameter = 1e-3 }}\nbed = {{ kind = "pile", {bed} }}\n'
    asked = study.parse(text.replace("1e-3", "1e-4"), name="long", where="long.toml")
    with pytest.raises(InputError, match=r"m of bed are .* grains, more than 100000"):
        limits.check_study(asked)


@pytest.mark.parametrize(
    ("bed", "phi"),
    [
        ('shape = "trapezoid", slope_deg = 45.0, height = 0.015', 20.0),
        ('shape = "trapezoid", slope_deg = 45.0, height = 0.015', 35.0),
        ('shape = "step up", slope_deg = 60.0', 35.0),
        ('shape = "dune", slope_deg = 15.0, lee_slope_deg = 33.0', 30.0),
        ("slope_deg = 25.0", 24.0),
    ],
)
def test_a_poured_bed_beyond_its_repose_is_refused(bed: str, phi: float) -> None:
    """It settled at 35 to 39 deg, some grains 4.4 d under the line that the flow was found over."""
    text = f"""
        grain = {{ diameter = 1e-3, friction_angle_deg = {phi} }}
        bed = {{ kind = "pile", packing = "poured", {bed} }}
    """
    with pytest.raises(InputError, match=r"what poured grains hold|is beyond min"):
        limits.check_study(study.parse(text, name="t", where="t"))
    gentle = re.sub("(45|60|33).0", "30.0", text).replace(f"= {phi}", "= 35.0")
    limits.check_study(study.parse(gentle, name="t", where="t"))


def test_a_grain_that_may_rest_half_way_is_warned_of() -> None:
    text = """
        grain = { diameter = 1e-3, friction_angle_deg = 80.0 }
        bed = { kind = "grain", slope_deg = 69.0, entrainment_angle_deg = 20.0 }
    """
    with pytest.warns(UserWarning, match="half-way"):
        limits.check_study(_parse(text))


WARNED = {
    "protocol.waiting_time": 2.0,
    "protocol.load_increment": 0.1,
    "forces.loaded_grains": "all but crest",
    "flow.convection_scheme": "upwind",
}
REFUSED = {
    "protocol.time_step": 0.5,
    "grain.damping": 0.01,
    "bed.entrainment_angle_deg": 55.0,
}


@pytest.mark.parametrize("field", [*WARNED, *REFUSED])
def test_a_field_beyond_a_limit_is_named_with_its_map(field: str, pile: MakePile) -> None:
    scene = changed(pile(), {field: {**WARNED, **REFUSED}[field]})
    if field in WARNED:
        with pytest.warns(UserWarning, match=f"{field}.*map"):
            limits.check(scene, "test")
        return
    with pytest.raises(InputError, match="map") as caught:
        limits.check(scene, "test")
    assert caught.value.where == f"test: {field}"
