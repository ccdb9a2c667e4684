"""Study files: what they mean, and the message for each way in which they can be wrong."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from orchestrator.errors import InputError
from orchestrator.runs.files import canonical_json
from orchestrator.study import study
from orchestrator.study.closed_form import regime_of
from orchestrator.study.fields import FIELDS
from orchestrator.study.parts import Grain, GrainBed, PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import RENAMED, make_scene

PILE = """
[grain]
diameter = 1e-3
[bed]
kind = "pile"
slope_deg = 15.0
roughness = "d/30"
"""


def _parse(text: str) -> study.Study:
    return study.parse(text, name="test", where="test.toml")


def test_axes_span_a_grid_in_the_files_order() -> None:
    found = _parse(
        """
        [forces]
        law = "high"
        [axes]
        "bed.slope_deg" = [0.0, 10.0]
        "grain.diameter" = [1e-3, 2e-3, 3e-3]
        """
    )
    points = [(s.bed.slope_deg, s.grain.diameter) for s in found.scenes]
    assert points == [(a, d) for a in (0.0, 10.0) for d in (1e-3, 2e-3, 3e-3)]


def test_a_group_overrides_the_tables_at_the_top() -> None:
    found = _parse(
        """
        [grain]
        diameter = 1e-3
        density = 2650.0
        [[group]]
        name = "one"
        grain = { density = 3000.0 }
        [[group]]
        """
    )
    assert [group.name for group in found.groups] == ["one", "group 2"]
    assert [s.grain.density for s in found.scenes] == [3000.0, 2650.0]


def test_a_law_that_turns_the_grain_is_for_pivots_alone() -> None:
    fields = {"diameter": 1e-3}
    for method in ("dem", "peeling"):
        parts: dict[str, dict[str, Any]] = {"grain": fields, "protocol": {"method": method}}
        with pytest.raises(InputError, match="zeng-torque turns the grain"):
            make_scene(_with_law("zeng-torque", parts), "test")
    make_scene(_with_law("zeng-torque", {"grain": fields, "protocol": {"method": "pivot"}}), "test")
    make_scene(_with_law("zeng", {"grain": fields}), "test")


@pytest.mark.parametrize(("former", "present"), RENAMED.items())
def test_a_former_key_is_refused_with_the_present_one_named(former: str, present: str) -> None:
    part, _, field = former.partition(".")
    assert present in {quantity.name for quantity in FIELDS}
    text = f"[grain]\ndiameter = 1e-3\n[{part}]\n{field} = 1\n"
    with pytest.raises(InputError, match=rf"{former}: a former name \(write {present}\)"):
        study.parse(text, name="old", where="test")


def test_an_unknown_law_is_named_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"unknown force law 'bridge'.*bridged.*profile.*zeng"):
        make_scene(_with_law("bridge", {"grain": {"diameter": 1e-3}}), "test")


def _with_law(law: str, parts: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    empty: dict[str, dict[str, Any]] = {"fluid": {}, "bed": {}, "protocol": {}}
    return {**empty, "flow": {}, "forces": {"law": law}, **parts}


def test_one_law_holds_for_every_reynolds_number_by_default() -> None:
    found = _parse('[grain]\ndiameter = 2e-4\n[axes]\n"fluid.viscosity" = [1e-3, 1e-5, 1e-6]\n')
    assert [s.forces.law for s in found.scenes] == ["bridged"] * 3
    assert [regime_of(s) for s in found.scenes] == ["low", "transition", "high"]


def test_by_the_papers_rule_the_transition_is_run_with_both_laws() -> None:
    found = _parse('[grain]\ndiameter = 2e-4\n[forces]\nlaw = "paper"\n')
    assert [s.forces.law for s in found.scenes] == ["low", "high"]
    assert {regime_of(s) for s in found.scenes} == {"transition"}


@pytest.mark.parametrize(("d", "nu", "regime"), [(5e-5, 1e-5, "low"), (1e-3, 1e-5, "high")])
def test_the_papers_rule_takes_the_law_that_holds(d: float, nu: float, regime: str) -> None:
    tables = f"[grain]\ndiameter = {d}\n[fluid]\nviscosity = {nu}\n"
    (scene,) = _parse(tables + '[forces]\nlaw = "paper"\n').scenes
    assert (scene.forces.law, regime_of(scene)) == (regime, regime)


def test_roughness_as_a_part_of_the_diameter() -> None:
    (scene,) = _parse("[grain]\ndiameter = 1e-3\n[bed]\nroughness = 'd/10'\n").scenes
    assert scene.bed.roughness == pytest.approx(1e-4)


def test_the_id_follows_the_content_alone() -> None:
    one = Scene(grain=Grain(diameter=1e-3), bed=GrainBed(roughness=1e-4))
    same = Scene(grain=Grain(diameter=1e-3, density=2500.0), bed=GrainBed(roughness=1e-4))
    other = Scene(grain=Grain(diameter=1e-3), bed=GrainBed(roughness=1.1e-4))
    assert one.id == same.id != other.id
    copy = Scene.model_validate_json(canonical_json(one.model_dump(mode="json")), strict=False)
    assert copy == one


def test_defaults_are_the_papers() -> None:
    (scene,) = _parse(PILE).scenes
    assert isinstance(scene.bed, PileBed)
    assert (scene.fluid.density, scene.fluid.viscosity, scene.fluid.gravity) == (1.0, 1e-5, 9.81)
    assert (scene.grain.density, scene.grain.friction_angle_deg) == (2500.0, 35.0)
    assert (scene.bed.height, scene.bed.entrainment_angle_deg) == (0.02, 60.0)
    assert (scene.protocol.displacement_criterion, scene.protocol.fractions) == (
        0.3,
        (0.1, 0.3, 0.5, 0.7),
    )


def test_presets_are_studies() -> None:
    assert "first-look" in study.presets()
    for name in study.presets():
        assert study.load(name).scenes


BAD = [
    ("[grain\n", "test.toml", "TOML"),
    ("grain = 3\n", "test.toml: grain", "table"),
    ("[grian]\ndiameter = 1e-3\n", "test.toml: grian", "did you mean grain"),
    ("[grain]\ndiametre = 1e-3\n", "test.toml: grain.diametre", "did you mean diameter"),
    ("[grain]\n", "test.toml: grain.diameter", "missing"),
    ("[grain]\ndiameter = '1 mm'\n", "test.toml: grain.diameter", "number"),
    ("[grain]\ndiameter = true\n", "test.toml: grain.diameter", "number"),
    ("[grain]\ndiameter = 0.0\n", "test.toml: grain.diameter", "greater than or equal"),
    ("[grain]\ndiameter = -1e-3\n", "test.toml: grain.diameter", "greater than or equal"),
    ("[grain]\ndiameter = nan\n", "test.toml: grain.diameter", "finite"),
    ("[grain]\ndiameter = 1e-3\ndensity = 0.5\n", "test.toml: grain.density", "float"),
    (
        "[grain]\ndiameter = 1e-3\n[bed]\nentrainment_angle_deg = 0.0\n",
        "test.toml: bed.entrainment_angle_deg",
        "greater than or equal",
    ),
    (
        "[grain]\ndiameter = 1e-3\n[bed]\nentrainment_angle_deg = 61.0\n",
        "test.toml: bed.entrainment_angle_deg",
        "60",
    ),
    ("[grain]\ndiameter = 1e-3\n[bed]\nroughness = 'd'\n", "test.toml: bed.roughness", "d/30"),
    ("[grain]\ndiameter = 1e-3\n[bed]\nroughness = 2e-3\n", "test.toml: bed.roughness", "d/30"),
    ("[grain]\ndiameter = 1e-3\n[bed]\nkind = 'dune'\n", "test.toml: bed", "dune"),
    ("[grain]\ndiameter = 1e-3\n[bed]\nheight = 0.02\n", "test.toml: bed.height", 'kind = "pile"'),
    ("[protocol]\ngravity = 3.7\n", "test.toml: protocol.gravity", "did you mean fluid.gravity?"),
    ("[grain]\ngravity = 3.7\n", "test.toml: grain.gravity", "did you mean fluid.gravity?"),
    ("gravity = 3.7\n", "test.toml: gravity", "did you mean fluid.gravity?"),
    ("[fluid]\nslope = 3.7\n", "test.toml: fluid.slope", "did you mean bed.slope_deg?"),
    (
        "[fluid]\ntolerance = 0.1\n",
        "test.toml: fluid.tolerance",
        "tolerance, above the first table",
    ),
    (
        "[grain]\nviscosity = 1e-6\n",
        "test.toml: grain.viscosity",
        "did you mean fluid.viscosity or flow.viscosity?",
    ),
    (PILE + "height = 2e-3\n", "test.toml: bed.height", "raise"),
    (PILE + "[protocol]\nfractions = []\n", "test.toml: protocol.fractions", "at least 1"),
    ("[axes]\ndiameter = [1e-3]\n", "test.toml: axes.diameter", "grain.diameter"),
    ("[axes]\n'grain.diameter' = 1e-3\n", "test.toml: axes.grain.diameter", "list"),
    ("[axes]\n'grain.diameter' = []\n", "test.toml: axes.grain.diameter", "list"),
    ("time_limit = -1\n[grain]\ndiameter = 1e-3\n", "test.toml: time_limit", "above 0"),
    ("group = 1\n", "test.toml: group", "[[group]]"),
    ("group = []\n", "test.toml: group", "[[group]]"),
    (PILE.replace('"d/30"', "2e-3"), "test.toml: bed.roughness", "a third of the bed's grains"),
    (
        "[grain]\ndiameter = 1e-3\n[bed]\nroughness = 9.99e-4\n",
        "test.toml: bed.roughness",
        "a third of the bed's grains",
    ),
    (
        PILE
        + "packing = 'poured'\nshape = 'flat'\nslope_deg = 0.0\n".replace("slope_deg = 0.0\n", "")
        + "[flow]\nmodel = 'flat'\n",
        "test.toml: bed.slope_deg",
        "does not rise",
    ),
    (
        PILE
        + "obstacles = [{ kind = 'fence', x = -0.2, height = 0.1 }]\n"
        + "[flow]\ntop = 'open water'\ndepth = 0.2\n",
        "test.toml: bed.obstacles",
        "under a flow 0.2 m deep",
    ),
    (
        PILE + "obstacles = [{ kind = 'fence', x = -9.0, height = 1.0 }]\n",
        "test.toml: bed.obstacles",
        "under a flow 2 m deep",
    ),
    ("[[group]]\ncolour = 1\n", "test.toml: group 1: colour", "known keys"),
    ("[[group]]\n[group.grain]\ndiametre = 1\n", "test.toml: group 1: grain.diametre", "diameter"),
]


@pytest.mark.parametrize(("text", "where", "word"), BAD, ids=[word for _, _, word in BAD])
def test_bad_files_are_refused_with_place_and_reason(text: str, where: str, word: str) -> None:
    with pytest.raises(InputError) as caught:
        _parse(text)
    assert caught.value.where == where
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


SOLVERS = """
import sys
from orchestrator.study import study
from orchestrator.study.study import make_scene
for name in study.presets():
    assert study.load(name).scenes
loaded = set(sys.modules) & {"orchestrator.flow", "orchestrator.solvers", "gmsh", "pyvista"}
print(*loaded)
"""


def test_a_study_is_read_without_what_solves_it() -> None:
    root = Path(__file__).parents[2]
    command = [sys.executable, "-c", SOLVERS]
    ended = subprocess.run(command, cwd=root, capture_output=True, check=True)
    assert ended.stdout.split() == []


def test_a_study_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="first-look"):
        study.load(str(tmp_path / "none.toml"))


def test_a_study_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="text"):
        study.load(str(path))


def test_the_scenes_of_all_groups_together_are_limited() -> None:
    few = "[[group]]\ngrain = { diameter = 1e-3 }\n"
    values = ", ".join(f"{1e-4 + 1e-9 * k!r}" for k in range(99_999))
    many = f"[[group]]\n[group.axes]\n'grain.diameter' = [{values}]\n"
    with pytest.raises(InputError, match="group 3: axes: more than 100000 scenes in the study"):
        _parse(few + few + many)
