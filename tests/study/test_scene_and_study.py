"""Study files: what they mean, and the refusal of each way in which they can be wrong."""

import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.physics.laws import LAWS
from orchestrator.runs.files import canonical_json
from orchestrator.study import study
from orchestrator.study.closed_form import regime_of
from orchestrator.study.fields import FIELDS
from orchestrator.study.parts import Grain, GrainBed, PileBed
from orchestrator.study.scene import Scene

GRAIN = "[grain]\ndiameter = 1e-3\n"
PILE = f'{GRAIN}[bed]\nkind = "pile"\nslope_deg = 15.0\n'


def _parse(text: str) -> study.Study:
    return study.parse(text, name="test", where="test.toml")


def test_axes_span_a_grid_in_the_files_order() -> None:
    axes = '[axes]\n"bed.slope_deg" = [0.0, 10.0]\n"grain.diameter" = [1e-3, 2e-3, 3e-3]\n'
    points = [(s.bed.slope_deg, s.grain.diameter) for s in _parse(axes).scenes]
    assert points == [(a, d) for a in (0.0, 10.0) for d in (1e-3, 2e-3, 3e-3)]


def test_a_group_overrides_the_tables_at_the_top() -> None:
    group = '[[group]]\nname = "one"\ngrain = { density = 3000.0 }\n[[group]]\n'
    asked = _parse(f"{GRAIN}density = 2650.0\n{group}")
    assert [group.name for group in asked.groups] == ["one", "group 2"]
    assert [s.grain.density for s in asked.scenes] == [3000.0, 2650.0]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", ["dem", "peeling", "pivot"])
def test_a_law_that_turns_the_grain_is_for_pivots_alone(law: str, method: str) -> None:
    text = f'{GRAIN}[forces]\nlaw = "{law}"\n[protocol]\nmethod = "{method}"\n'
    if not LAWS[law].turns or method == "pivot":
        assert _parse(text).scenes[0].forces.law == law
        return
    with pytest.raises(InputError, match=f"{law} turns the grain"):
        _parse(text)


@pytest.mark.parametrize(("former", "present"), study.RENAMED.items())
def test_a_former_key_is_refused_with_the_present_one_named(former: str, present: str) -> None:
    part, _, field = former.partition(".")
    assert present in {quantity.name for quantity in FIELDS}
    with pytest.raises(InputError, match=rf"{former}: a former name \(write {present}\)"):
        _parse(f"{GRAIN}[{part}]\n{field} = 1\n")


@pytest.mark.parametrize(
    ("d", "nu", "regime", "laws"),
    [
        (5e-5, 1e-5, "low", ["low"]),
        (2e-4, 1e-5, "transition", ["low", "high"]),
        (1e-3, 1e-5, "high", ["high"]),
    ],
)
def test_the_papers_rule_takes_the_laws_that_hold(
    d: float, nu: float, regime: str, laws: list[str]
) -> None:
    tables = f"[grain]\ndiameter = {d}\n[fluid]\nviscosity = {nu}\n"
    scenes = _parse(tables + '[forces]\nlaw = "paper"\n').scenes
    assert [scene.forces.law for scene in scenes] == laws
    assert {regime_of(scene) for scene in scenes} == {regime}
    assert _parse(tables).scenes[0].forces.law == "bridged"


def test_the_id_follows_the_content_alone() -> None:
    one = Scene(grain=Grain(diameter=1e-3), bed=GrainBed(roughness=1e-4))
    same = Scene(grain=Grain(diameter=1e-3, density=2500.0), bed=GrainBed(roughness=1e-4))
    other = Scene(grain=Grain(diameter=1e-3), bed=GrainBed(roughness=1.1e-4))
    assert one.id == same.id != other.id
    copy = Scene.model_validate_json(canonical_json(one.model_dump(mode="json")), strict=False)
    assert copy == one
    (scene,) = _parse(f"{GRAIN}[bed]\nroughness = 'd/10'\n").scenes
    assert scene.id == one.id


def test_defaults_are_the_papers() -> None:
    (scene,) = _parse(PILE).scenes
    assert isinstance(scene.bed, PileBed)
    assert (scene.fluid.density, scene.fluid.viscosity, scene.fluid.gravity) == (1.0, 1e-5, 9.81)
    assert (scene.grain.density, scene.grain.friction_angle_deg) == (2500.0, 35.0)
    assert (scene.bed.height, scene.bed.entrainment_angle_deg) == (0.02, 60.0)
    assert scene.protocol.displacement_criterion == 0.3
    assert scene.protocol.fractions == (0.1, 0.3, 0.5, 0.7)


FENCE = "obstacles = [{ kind = 'fence', x = %g, height = %g }]\n"
BAD = [
    ("[grain\n", "", "TOML"),
    ("grain = 3\n", "grain", "table"),
    ("[grian]\ndiameter = 1e-3\n", "grian", "did you mean grain"),
    ("[grain]\ndiametre = 1e-3\n", "grain.diametre", "did you mean diameter"),
    ("[grain]\n", "grain.diameter", "missing"),
    ("[grain]\ndiameter = '1 mm'\n", "grain.diameter", "number"),
    ("[grain]\ndiameter = true\n", "grain.diameter", "number"),
    ("[grain]\ndiameter = 0.0\n", "grain.diameter", "greater than or equal"),
    ("[grain]\ndiameter = nan\n", "grain.diameter", "finite"),
    (GRAIN + "density = 0.5\n", "grain.density", "float"),
    (GRAIN + "[bed]\nentrainment_angle_deg = 61.0\n", "bed.entrainment_angle_deg", "60"),
    (GRAIN + "[bed]\nroughness = 'd'\n", "bed.roughness", "d/30"),
    (GRAIN + "[bed]\nroughness = 2e-3\n", "bed.roughness", "d/30"),
    (GRAIN + "[bed]\nroughness = 9.99e-4\n", "bed.roughness", "a third of the bed's grains"),
    (PILE + "roughness = 2e-3\n", "bed.roughness", "a third of the bed's grains"),
    (GRAIN + "[bed]\nkind = 'dune'\n", "bed", "dune"),
    (GRAIN + "[bed]\nheight = 0.02\n", "bed.height", 'kind = "pile"'),
    (GRAIN + "[forces]\nlaw = 'bridge'\n", "forces.law", "bridged, "),
    ("[protocol]\ngravity = 3.7\n", "protocol.gravity", "did you mean fluid.gravity?"),
    ("gravity = 3.7\n", "gravity", "did you mean fluid.gravity?"),
    ("[fluid]\nslope = 3.7\n", "fluid.slope", "did you mean bed.slope_deg?"),
    ("[fluid]\ntolerance = 0.1\n", "fluid.tolerance", "tolerance, above the first table"),
    (
        "[grain]\nviscosity = 1e-6\n",
        "grain.viscosity",
        "did you mean fluid.viscosity or flow.viscosity?",
    ),
    (PILE + "height = 2e-3\n", "bed.height", "raise"),
    (PILE + "[protocol]\nfractions = []\n", "protocol.fractions", "at least 1"),
    (
        PILE + FENCE % (-0.2, 0.1) + "[flow]\ntop = 'open water'\ndepth = 0.2\n",
        "bed.obstacles",
        "under a flow 0.2 m deep",
    ),
    (PILE + FENCE % (-9.0, 1.0), "bed.obstacles", "under a flow 2 m deep"),
    ("[axes]\ndiameter = [1e-3]\n", "axes.diameter", "grain.diameter"),
    ("[axes]\n'grain.diameter' = 1e-3\n", "axes.grain.diameter", "list"),
    ("[axes]\n'grain.diameter' = []\n", "axes.grain.diameter", "list"),
    ("time_limit = -1\n" + GRAIN, "time_limit", "above 0"),
    ("group = 1\n", "group", "[[group]]"),
    ("group = []\n", "group", "[[group]]"),
    ("[[group]]\ncolour = 1\n", "group 1: colour", "known keys"),
    ("[[group]]\n[group.grain]\ndiametre = 1\n", "group 1: grain.diametre", "diameter"),
    *(
        (f"seeds = {seeds}\n{PILE}", "seeds", "at most 1000")
        for seeds in ("-1", "true", "2000", "'3'", "1.5")
    ),
]


@pytest.mark.parametrize(("text", "where", "word"), BAD)
def test_bad_files_are_refused_with_place_and_reason(text: str, where: str, word: str) -> None:
    with pytest.raises(InputError) as caught:
        _parse(text)
    assert caught.value.where == (f"test.toml: {where}" if where else "test.toml")
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_scenes_of_all_groups_together_are_limited() -> None:
    few = "[[group]]\ngrain = { diameter = 1e-3 }\n"
    values = ", ".join(f"{1e-4 + 1e-9 * k!r}" for k in range(99_999))
    many = f"[[group]]\n[group.axes]\n'grain.diameter' = [{values}]\n"
    with pytest.raises(InputError, match="group 3: axes: more than 100000 scenes in the study"):
        _parse(few + few + many)


SOLVERS = """
import sys
from orchestrator.study import study
for name in study.presets():
    assert study.load(name).scenes
print(*set(sys.modules) & {"orchestrator.flow", "orchestrator.solvers", "gmsh", "pyvista"})
"""


def test_presets_are_studies_and_are_read_without_what_solves_them() -> None:
    command = [sys.executable, "-c", SOLVERS]
    root = Path(__file__).parents[2]
    ended = subprocess.run(command, cwd=root, capture_output=True, check=True)
    assert ended.stdout.split() == []
    assert "first-look" in study.presets()


def test_files_that_are_missing_or_no_text_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="first-look"):
        study.load(str(tmp_path / "none.toml"))
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="text"):
        study.load(str(path))
    # some editors write the mark of an encoding at the beginning
    path.write_bytes(b"\xef\xbb\xbf" + GRAIN.replace("\n", "\r\n").encode())
    assert study.load(str(path)).scenes[0].grain.diameter == 1e-3
