"""Answers that must not depend on how a question is put: units, scales, names and orders."""

from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.flow.model import of_scene
from orchestrator.study.study import parse

PILE = (
    "fluid.density = 1000.0; fluid.viscosity = 1e-6; grain.density = 2650.0; grain.diameter = 1e-3;"
    'bed.kind = "pile"; bed.slope_deg = 15.0; bed.height = 0.02;'
    'method.flow.model = "waves"; method.kind = "pivot"'
)
PROFILE = "x_m,z_m\n0,0\n0.0746410162,0.02\n0.1492820323,0\n"


def shields(place: Path, changes: str) -> list[float]:
    """Shields numbers of the threshold of the pile at its fractions, some of its fields changed."""
    fields = dict(
        each.strip().split(" = ", 1) for each in f"{PILE};{changes}".split(";") if each
    )
    text = "\n".join(
        f"{name} = {value}" for name, value in fields.items() if value != "none"
    )
    (place / "bed.csv").write_text(PROFILE, encoding="utf-8")
    study = parse(text, name="study", where=str(place / "study.toml"))
    (pile,) = plan.make(study).piles.values()
    scene = pile.scene
    scale = (
        (scene.grain.density - scene.fluid.density)
        * scene.fluid.gravity
        * scene.grain.diameter
    )
    return [
        each.tau / scale for each in pile.thresholds(place, scene.threshold.fractions)
    ]


def scaled(size: float) -> str:
    """The same bed so many times as large, in a fluid of the same Re* and Shields numbers."""
    lengths = f"grain.diameter = {1e-3 * size}; bed.height = {0.02 * size}"
    return f"{lengths}; fluid.viscosity = {1e-6 * size**1.5}"


PEELING, FLAT = 'method.kind = "peeling"', 'method.flow.model = "flat"'
DUNE, FLAT_BED = (
    'bed.shape = "dune"',
    f'bed.shape = "flat"; bed.slope_deg = 0.0; {FLAT}',
)
FENCE = '{ kind = "fence", x = -0.3, height = 0.01 }'
BLOCK = '{ kind = "block", x = -0.1, height = 0.01 }'
ENTRAINED = 'threshold.criterion = "entrained"'
AS_PROFILE = 'bed.profile = "bed.csv"; bed.counted = "windward"'


@pytest.mark.parametrize(
    ("one", "other", "tolerance"),
    [
        *((scaled(size), "", 1e-6) for size in (0.1, 10, 1000)),
        (f"{scaled(10)}; {PEELING}", PEELING, 1e-5),
        ("fluid.density = 9e3; grain.density = 23850.0", "", 1e-6),
        # four times the submerged density: it changes how far a grain hops, not when it leaves
        (
            f"grain.density = {1000 + 4 * 1650.0}; fluid.viscosity = 2e-6; {ENTRAINED}",
            ENTRAINED,
            1e-6,
        ),
        ("method.grains.mobile_layers = 5", "", 1e-9),
        ('method.kind = "local"', "", 5e-3),
        ("bed.seed = 3", "", 1e-6),
        (f"bed.roughness = {1e-3 / 30}", 'bed.roughness = "d/30"', 1e-9),
        (f"{DUNE}; bed.lee_slope_deg = 30.0", DUNE, 1e-9),
        (FLAT_BED, f"{FLAT_BED}; bed.counted = [0.0, 0.08]", 1e-9),
        # the rows of a form of two straight faces are laid from its crest, those of a profile from
        # its foot: one grain more or less is counted
        (f"{AS_PROFILE}; bed.height = none; bed.slope_deg = none", "", 5e-3),
    ],
)
def test_the_same_bed_has_the_same_threshold(
    one: str, other: str, tolerance: float, tmp_path: Path
) -> None:
    assert shields(tmp_path, one) == pytest.approx(
        shields(tmp_path, other), rel=tolerance
    )


@pytest.mark.parametrize(
    ("field", "values", "sign"),
    [
        ("bed.slope_deg", (10.0, 15.0, 20.0), 1),
        ("forces.lift_coefficient", (0.0, 1e-9, 1.0, 3.0), -1),
        ("bed.roughness", (1e-4, 3e-5, 1e-5, 1e-6), -1),
    ],
)
def test_the_threshold_is_monotonic(
    field: str, values: tuple[float, ...], sign: int, tmp_path: Path
) -> None:
    first = [shields(tmp_path, f"{FLAT}; {field} = {value}")[0] for value in values]
    assert sorted(first, key=lambda theta: sign * theta) == first


def test_obstacles_in_another_order_are_one_bed() -> None:
    lines = []
    for obstacles in ((FENCE, BLOCK), (BLOCK, FENCE)):
        text = "\n".join(part.strip() for part in PILE.split(";"))
        text += f"\nbed.obstacles = [{', '.join(obstacles)}]"
        (scene,) = parse(text, name="study", where="study").scenes
        lines.append(of_scene(scene).line)
    one, other = lines
    assert (one.x, one.z, {*one.bare}) == (other.x, other.z, {*other.bare})
    bare = parse(text.replace(f", {FENCE}", ""), name="study", where="study").scenes[0]
    assert len(of_scene(bare).line.x) < len(one.x)
