"""Answers that must not depend on how a question is put: units, scales, names and orders."""

from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.study.study import parse

WATER = {"fluid.density": 1000.0, "fluid.viscosity": 1e-6, "grain.density": 2650.0}
PILE = {
    **WATER,
    **{"grain.diameter": 1e-3, "bed.kind": "pile", "bed.slope_deg": 15.0, "bed.height": 0.02},
    **{"flow.model": "hill", "protocol.method": "pivot"},
}
FENCES = [
    {"kind": "fence", "x": -0.3, "height": 0.01},
    {"kind": "block", "x": -0.1, "height": 0.01},
]
PROFILE = "x_m,z_m\n" + "0,0\n0.0746410162,0.02\n0.1492820323,0\n"


def toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def shields(place: Path, **fields: object) -> list[float]:
    """Shields numbers of the threshold of the one pile of a study at its fractions."""
    given = {name.replace("__", "."): value for name, value in fields.items()}
    fields = {name: value for name, value in {**PILE, **given}.items() if value is not None}
    text = "\n".join(f"{name} = {toml(value)}" for name, value in fields.items())
    (place / "bed.csv").write_text(PROFILE, encoding="utf-8")
    study = parse(text, name="study", where=str(place / "study.toml"))
    (pile,) = plan.make(study).piles.values()
    scene = pile.scene
    scale = (scene.grain.density - scene.fluid.density) * scene.fluid.gravity * scene.grain.diameter
    found = pile.thresholds(place, scene.protocol.fractions)
    return [threshold.tau / scale for threshold in found]


def scaled(size: float) -> dict[str, object]:
    """The same bed so many times as large, in a fluid of the same Re* and Shields numbers."""
    lengths = {"grain__diameter": 1e-3 * size, "bed__height": 0.02 * size}
    return {**lengths, "fluid__viscosity": 1e-6 * size**1.5}


SAME: dict[str, tuple[dict[str, object], dict[str, object], float]] = {
    **{f"{size:g} times as large": (scaled(size), {}, 1e-6) for size in (0.1, 10, 1000)},
    "peeling, 10 times as large": (
        {**scaled(10), "protocol__method": "peeling"},
        {"protocol__method": "peeling"},
        1e-5,
    ),
    "both densities 9 times": ({"fluid__density": 9e3, "grain__density": 23850.0}, {}, 1e-6),
    "four times the submerged density": (
        {"grain__density": 1000 + 4 * 1650.0, "fluid__viscosity": 2e-6},
        {},
        1e-6,
    ),
    "mobile layers do not move pivots": ({"bed__mobile_layers": 5}, {}, 1e-9),
    "a replica of the lattice": ({"bed__seed": 3}, {}, 1e-6),
    "z0 as a number": ({"bed__roughness": 1e-3 / 30}, {"bed__roughness": "d/30"}, 1e-9),
    "the default lee side of a dune": (
        {"bed__shape": "dune", "bed__lee_slope_deg": 30.0},
        {"bed__shape": "dune"},
        1e-9,
    ),
    "the order of obstacles": (
        {"bed__obstacles": FENCES, "flow__model": "flat"},
        {"bed__obstacles": FENCES[::-1], "flow__model": "flat"},
        1e-12,
    ),
    "all of a flat bed is counted": (
        {"bed__shape": "flat", "bed__slope_deg": 0.0, "flow__model": "flat"},
        {
            **{"bed__shape": "flat", "bed__slope_deg": 0.0, "flow__model": "flat"},
            "bed__counted": [-1.0, 1.0],
        },
        1e-9,
    ),
    # the rows of a form of two straight faces are laid from its crest, those of a profile from
    # its foot: one grain more or less is counted
    "a triangle as a profile": (
        {
            **{"bed__profile": "bed.csv", "bed__counted": "windward"},
            **{"bed__height": None, "bed__slope_deg": None},
        },
        {},
        5e-3,
    ),
}


@pytest.mark.parametrize("case", SAME)
def test_the_same_bed_has_the_same_threshold(case: str, tmp_path: Path) -> None:
    one, other, tolerance = SAME[case]
    assert shields(tmp_path, **one) == pytest.approx(shields(tmp_path, **other), rel=tolerance)


@pytest.mark.parametrize(
    ("field", "values", "sign"),
    [
        ("bed__slope_deg", (10.0, 15.0, 20.0), 1),
        ("forces__lift_coefficient", (0.0, 1e-9, 1.0, 3.0), -1),
        ("bed__roughness", (1e-4, 3e-5, 1e-5, 1e-6), -1),
    ],
)
def test_the_threshold_is_monotonic(
    field: str, values: tuple[float, ...], sign: int, tmp_path: Path
) -> None:
    first = [shields(tmp_path, flow__model="flat", **{field: value})[0] for value in values]
    assert sorted(first, key=lambda theta: sign * theta) == first
