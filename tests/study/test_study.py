"""Study files: what they mean, and the refusal of each way in which they can be wrong."""

import re
import subprocess
import sys
import warnings
from itertools import product
from pathlib import Path

import pytest

from orchestrator import guests, plan
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.grains.geometry import Geometry
from orchestrator.runs.files import canonical_json
from orchestrator.study import closed_form, fields, methods, parts, study
from orchestrator.study.parts import Forces, GrainBed, GrainPart
from orchestrator.study.scene import Scene

OFFERED = [*guests.offers()]
"""Guests explain the keys of their own beds."""

GRAIN = "[grain]\ndiameter = 1e-3\n"
PILE = f'{GRAIN}[bed]\nkind = "pile"\nslope_deg = 15.0\n'
ENDS = {
    "fluid.density": ("1e-7", "1e4"),
    "fluid.viscosity": ("1e-8", "1e3"),
    "fluid.gravity": ("1e-6", "1e4"),
    "grain.density": ("1.2e4", "2.5e4"),
    "grain.diameter": ("1e-7", "10.0"),
    "bed.roughness": ("'d/3'", "'d/1000'"),
    "bed.slope_deg": ("0.0", "29.9"),
    "forces.lift_coefficient": ("0.0", "100.0"),
}


def _parse(text: str) -> study.Study:
    return study.parse(text, name="test", where="test.toml")


def test_axes_span_a_grid_in_the_files_order() -> None:
    axes = (
        '[axes]\n"bed.slope_deg" = [0.0, 10.0]\n"grain.diameter" = [1e-3, 2e-3, 3e-3]\n'
    )
    points = [(s.bed.slope_deg, s.grain.diameter) for s in _parse(axes).scenes]
    assert points == [*product((0.0, 10.0), (1e-3, 2e-3, 3e-3))]
    scenes = _parse(f'seeds = 3\n{PILE}packing = "poured"').scenes
    assert [scene.bed.seed for scene in scenes] == [0, 1, 2]  # type: ignore[union-attr]


def test_a_group_overrides_the_tables_at_the_top_and_may_share_a_scene() -> None:
    group = (
        '[[group]]\nname = "one"\ngrain = { density = 3000.0 }\n[[group]]\n[[group]]\n'
    )
    asked = _parse(f"seeds = 0\n{GRAIN}density = 2650.0\n{group}")
    assert [group.name for group in asked.groups] == ["one", "group 2", "group 3"]
    assert [len(group.scenes) for group in asked.groups] == [1, 1, 1]
    assert [s.grain.density for s in asked.scenes] == [3000.0, 2650.0]


def test_the_papers_rule_takes_the_laws_that_hold() -> None:
    for d, regime in ((5e-5, "low"), (2e-4, "transition"), (1e-3, "high")):
        scenes = _parse(f"grain.diameter = {d}\nforces.law = 'paper'\n").scenes
        names = ["low", "high"] if regime == "transition" else [regime]
        assert [scene.forces.law for scene in scenes] == names
        assert {closed_form.regime_of(scene) for scene in scenes} == {regime}


def test_the_id_follows_the_content_alone() -> None:
    law = Forces(law="bridged")  # which the default comes to
    one = Scene(
        grain=GrainPart(diameter=1e-3), bed=GrainBed(roughness=1e-4), forces=law
    )
    dense = GrainPart(diameter=1e-3, density=2500.0)
    same = Scene(grain=dense, bed=GrainBed(roughness=1e-4), forces=law)
    other = Scene(grain=GrainPart(diameter=1e-3), bed=GrainBed(roughness=1.1e-4))
    assert one.id == same.id != other.id
    copy = Scene.model_validate_json(
        canonical_json(one.model_dump(mode="json")), strict=False
    )
    assert copy == one
    (scene,) = _parse(f"{GRAIN}[bed]\nroughness = 'd/10'\n").scenes
    assert scene.id == one.id
    named = _parse(f"{GRAIN}[axes]\n'fluid.kind' = ['water', 'air']\n")
    air = "fluid = { density = 1.225, viscosity = 1.4607e-5 }\n"
    assert named.scenes[1].id == _parse(air + GRAIN).scenes[0].id
    level = PILE.replace("15.0", "0.0")
    asked = f"{level}shape = 'flat'\n[method.flow]\nmodel = 'flat'\n"
    assert (
        _parse(level.replace("pile", "flat")).scenes[0].id == _parse(asked).scenes[0].id
    )


FENCE = "obstacles = [{ kind = 'fence', x = -9.0, height = %g }]\n"
AXES = (
    "'grain.diameter' = [1e-3, 2e-3, 1e-3]",
    "'grain.diameter' = [1e-3, 0.001]",
    "'bed.slope_deg' = [0.0, -0.0]\n'grain.diameter' = [1e-3]",
    "'bed.slope_deg' = [0, 0.0]\n'grain.diameter' = [1e-3]",
    "'bed.roughness' = ['d/10', 1e-4]\n'grain.diameter' = [1e-3]",
)
D, BY_DEM = "grain.diameter = 1e-3\n", "method.kind = 'dem'\n"
BED = "bed = { kind = 'pile', slope_deg = 15.0 }\n"
POURED = "bed = { kind = 'pile', slope_deg = 15.0, packing = 'poured' }\n"
GUSTS = "flow.gusts = { intensity = 0.4, events = 9 }\n"
COHESION = "grain.cohesion = 1e-3\n"
DEM_KNOWS_NOT = [
    (D + GUSTS, "flow.gusts"),
    (D + COHESION, "grain.cohesion"),
    (D + BED + COHESION, "grain.cohesion"),
]
"""Files that are refused by DEM alone, and the field."""
BAD = [
    ("[grain\n", "", "TOML"),
    ("grain = 3\n", "grain", "table"),
    ("[grian]\ndiameter = 1e-3\n", "grian", "did you mean grain"),
    ("[grain]\ndiametre = 1e-3\n", "grain.diametre", "did you mean diameter"),
    ("[grain]\n", "grain.diameter", "missing"),
    ("[grain]\ndiameter = nan\n", "grain.diameter", "write a number from 1e-07 to"),
    (GRAIN + "density = 0.5\n", "grain.density", "not above the fluid's"),
    (GRAIN + "[bed]\nroughness = 'd'\n", "bed.roughness", "d/30"),
    (GRAIN + "[bed]\nkind = 'flatt'\n", "bed.kind", "write grain, pile, or a shape: "),
    ("fluid = { kind = 'air', density = 1.2 }\n", "fluid.density", "air has its own"),
    (
        "fluid.temperature_deg_c = 5\n",
        "fluid.kind",
        "write one of water, seawater, air",
    ),
    (
        "fluid = { kind = 'air', temperature_deg_c = 288 }\n",
        "fluid.temperature_deg_c",
        "-80",
    ),
    (GRAIN + "[bed]\nheight = 0.02\n", "bed.height", 'kind = "pile"'),
    (GRAIN + "[forces]\nlaw = 'bridge'\n", "forces.law", "did you mean bridged?"),
    (
        "[threshold]\ngravity = 3.7\n",
        "threshold.gravity",
        "did you mean fluid.gravity?",
    ),
    (
        "[protocol]\ngravity = 3.7\n",
        "protocol",
        "did you mean fluid.gravity?",
    ),
    (f"name = 'one'\n{GRAIN}", "name", "known keys"),
    ("gravity = 3.7\n", "gravity", "did you mean fluid.gravity?"),
    (
        "[fluid]\ntolerance = 0.1\n",
        "fluid.tolerance",
        "tolerance, above the first table",
    ),
    ("[grain]\nviscosity = 1e-6\n", "grain.viscosity", "did you mean fluid.viscosity?"),
    (
        f'{PILE}[erosion]\nwind = "year.csv"\n',
        "erosion.wind",
        'beds in three dimensions alone have it (leave it out, or bed.kind = "surface")',
    ),
    (f"{PILE}surface = 'a.tif'\n", "bed.surface", "beds in three dimensions alone"),
    (f"{PILE}[flow]\nfrom_deg = 90.0\n", "flow.from_deg", "beds in three dimensions"),
    (f"{PILE}[method.flow]\nlevel = 'coarse'\n", "method.flow.level", "dimensions"),
    (
        f'{PILE}[axes]\n"method.flow.model" = ["hill"]\n',
        "method.flow.model",
        'one of "solve", "waves", "flat"',
    ),
    (PILE + "height = 2e-3\n", "bed.height", "at least 0.005 m"),
    (
        PILE + FENCE % 0.1 + "[flow]\ntop = 'open water'\ndepth = 0.2\n",
        "flow.depth",
        "obstacles",
    ),
    (
        PILE + FENCE % 1.0,
        "method.flow.lid",
        "2 m is less than 3 heights of the forms or obstacles",
    ),
    (GRAIN + "[flow]\ngusts = { intensity = 0.4 }\n", "flow.gusts.events", "missing"),
    (
        GRAIN + "[flow]\ngusts = { intensity = 2.0, events = 9 }\n",
        "flow.gusts.intensity",
        "1",
    ),
    *((BY_DEM + text, where, 'method.kind = "auto"') for text, where in DEM_KNOWS_NOT),
    (
        GRAIN + "[forces]\nsheltering = 'balanced'\n",
        "forces.sheltering",
        'it has an effect on piles alone (leave it out, or bed.kind = "pile")',
    ),
    (GRAIN + "sizes = { sigma_g = 1.3 }\n", "grain.sizes", "on poured beds alone"),
    ("[axes]\ndiameter = [1e-3]\n", "axes.diameter", "grain.diameter"),
    ("[axes]\n'grain.diameter' = 1e-3\n", "axes.grain.diameter", "list"),
    *((f"[axes]\n{axes}", "axes", "are one scene") for axes in AXES),
    (f"time_limit = nan\n{GRAIN}", "time_limit", "write a number above 0 to"),
    ("group = []\n", "group", "write a list of one or more tables"),
    ("[[group]]\ncolour = 1\n", "group 1: colour", "known keys"),
    ("[[group]]\n[group.grain]\ndiametre = 1\n", "group 1: grain.diametre", "diameter"),
    *(
        (f"seeds = {seeds}\n{PILE}", "seeds", "a whole number from 0 to 1000")
        for seeds in ("-1", "true", "2000")
    ),
]


@pytest.mark.parametrize(("text", "where", "word"), BAD)
def test_bad_files_are_refused_with_place_and_reason(
    text: str, where: str, word: str
) -> None:
    with pytest.raises(InputError) as caught:
        _parse(text)
    assert caught.value.where == (f"test.toml: {where}" if where else "test.toml")
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "where"), DEM_KNOWS_NOT)
def test_what_dem_does_not_know_needs_no_method(text: str, where: str) -> None:
    """The remedy of the refusal works, and so does a file that leaves the method open."""
    for more in ("", "method.kind = 'auto'\n"):
        (decision,) = plan.make(_parse(text + more)).decisions.values()
        assert decision.scene.method.kind in ("pivot", "peeling")


@pytest.mark.parametrize(
    "asked",
    [
        f'seeds = 2\n{PILE}packing = "poured"\n[axes]\n"bed.seed" = [11, 12]\n',
        f'seeds = 2\n{PILE}packing = "poured"\nseed = 11\n',
        f'{PILE}packing = "poured"\nseed = 11\n[[group]]\nseeds = 2\n',
    ],
)
def test_seeds_do_not_replace_a_seed_that_is_written(asked: str) -> None:
    """The seeds 0 and 1 were run, and nothing was said."""
    with pytest.raises(InputError, match="asks for the seeds 0 to 1, and"):
        _parse(asked)


def test_the_scenes_of_all_groups_together_are_limited() -> None:
    few = "[[group]]\ngrain = { diameter = 1e-3 }\n"
    many = f"[[group]]\n[group.axes]\n'grain.diameter' = [{', '.join(['1e-3'] * 99_999)}]\n"
    with pytest.raises(
        InputError, match="group 3: axes: more than 100000 scenes in the study"
    ):
        _parse(few + few + many)


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


def test_the_closed_form_bears_the_ends_of_all_ranges_together() -> None:
    axes = (f'"{field}" = [{", ".join(ends)}]' for field, ends in ENDS.items())
    scenes = _parse("\n".join(["[axes]", *axes])).scenes
    assert len(scenes) >= 2 ** len(ENDS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert all(
            closed_form.closed_form(scene).friction_velocity > 0 for scene in scenes
        )


GRAVEL = """
fluid.kind = "water"
grain = {{ diameter = 0.03, density = 2650.0{sizes} }}
bed = {{ kind = "flat"{bed} }}
flow = {{ top = "open water", depth = {depth} }}
"""
LEVEL = {
    "lattice": ("", ""),
    "poured in a plane": (', packing = "poured"', ", sizes = { sigma_g = 1.3 }"),
    "poured strip": (
        ', packing = "poured", width = 6.0',
        ", sizes = { sigma_g = 1.3 }",
    ),
}


@pytest.mark.parametrize("bed", LEVEL)
def test_a_level_bed_has_no_height(bed: str) -> None:
    """Gravel of 30 mm in 0.4 m of water was refused for its height, and then for its depth."""
    fields, sizes = LEVEL[bed]
    asked = _parse(GRAVEL.format(bed=fields, sizes=sizes, depth=0.4))
    limits.check_study(asked)
    given = _parse(
        GRAVEL.format(bed=f"{fields}, height = 0.15", sizes=sizes, depth=0.4)
    )
    assert [scene.id for scene in asked.scenes] == [scene.id for scene in given.scenes]
    (gravel,) = asked.scenes
    small = GRAVEL.replace("0.03", "3e-4").format(bed=fields, sizes=sizes, depth=0.4)
    pourings = [Geometry(scene).pouring for scene in (gravel, _parse(small).scenes[0])]
    assert pourings[0] == pourings[1]  # in diameters
    least = 3 * 0.03 * parts.extremes(gravel.grain.sizes, 0.03)[1]
    with pytest.raises(
        InputError, match=rf"flow.depth: 0.08 m .* \(at least {least:.4g} m\)"
    ):
        _parse(GRAVEL.format(bed=fields, sizes=sizes, depth=0.08))
    _parse(GRAVEL.format(bed=fields, sizes=sizes, depth=round(least, 4)))


SOLVERS = """
import sys
from orchestrator import guests
from orchestrator.study import study
for name in study.presets():
    assert guests.load_study(name, None).scenes
print(*set(sys.modules) & {"orchestrator.flow", "orchestrator.solvers", "gmsh", "pyvista"})
"""


def test_presets_are_studies_and_are_read_without_what_solves_them() -> None:
    command = [sys.executable, "-c", SOLVERS]
    root = Path(__file__).parents[2]
    ended = subprocess.run(command, cwd=root, capture_output=True, check=True)
    assert ended.stdout.split() == []


ELSEWHERE = {
    "grain.stiffness": "method.grains.stiffness",
    "bed.mobile_layers": "method.grains.mobile_layers",
    "flow.model": "method.flow.model",
    "flow.lid": "method.flow.lid",
    "flow.roughness": "bed.roughness",
    "protocol.fidelity": "method.fidelity",
    "protocol.fractions": "threshold.fractions",
    "protocol.time_step": "method.grains.time_step",
    "threshold.gravity": "fluid.gravity",
    "method.height": "bed.height",
}
"""Keys in a table that has none of that name, and where they are."""


@pytest.mark.parametrize(("written", "meant"), ELSEWHERE.items())
def test_a_key_in_another_table_is_refused_with_its_own(
    written: str, meant: str
) -> None:
    """At the top and in a group, also where the table itself is unknown."""
    remedy = re.escape(f"unknown key (did you mean {meant}?)")
    for text in (f"{D}bed.kind = 'pile'\n", f"{D}[[group]]\n"):
        with pytest.raises(InputError, match=remedy):
            _parse(f"{text}{written} = 1\n")


@pytest.mark.parametrize("field", [each.name for each in fields.FIELDS])
def test_a_misspelt_key_is_refused_with_the_known_one(field: str) -> None:
    table, _, key = field.rpartition(".")
    misspelt = key[0] + key
    needed = "" if table == "grain" else D
    with pytest.raises(InputError, match=rf"unknown key \(did you mean {key}\?"):
        _parse(f"{needed}{table}.{misspelt} = 1\n")


def test_the_question_does_not_depend_on_the_method() -> None:
    (one,) = _parse(PILE).scenes
    (other,) = _parse(
        f"{PILE}[method]\nkind = 'pivot'\nflow.cells_per_face = 20\n"
    ).scenes
    assert one.question == other.question
    assert one.method != other.method
    assert one.id != other.id
    assert one.by(methods.PIVOT).method.flow.cells_per_face == 40
    assert _parse(PILE).name == "test"
