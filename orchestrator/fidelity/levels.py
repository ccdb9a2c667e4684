"""Fidelity levels: named ways to answer a scene, from cheap to dear.

A level changes how a scene is answered, never what it asks. One level is for the flow, one for the
grains.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

Part = Literal["flow", "grains"]
Levels = Mapping[Part, str]
"""Names of levels, by what they answer."""
Fields = Mapping[str, Any]
"""Values of a scene's fields, named as in a study file."""
FieldsOf = Callable[[Scene], Fields]
AS_ASKED = "as asked"
"""Stands for the name of a level where a scene is on none."""
OCTAVES = 2.0
"""Flows are shared within this ratio of z0."""
FULL = 1000
"""More layers than any pile has."""


@dataclass(frozen=True)
class Level:
    """One way to answer the flow or the grains of a pile.

    Attributes
    ----------
    name, meaning : str
        What tables call it, and what it is.
    fields : callable
        The fields of a scene that it sets.
    same_model : bool
        Whether it has the reference's model choices; another turbulence model has not.
    most_grains : int or None
        The ladder measures a dear level on piles of no more exposed grains than this.
    on_lattices : bool
        Whether it leaves disordered packings alone: it would disorder more rows of them.
    """

    name: str
    meaning: str
    fields: FieldsOf
    same_model: bool = True
    most_grains: int | None = None
    on_lattices: bool = False

    def answer(self, scene: Scene) -> Scene:
        """The scene as this level answers it."""
        return changed(scene, self.fields(scene))

    def load_steps(self, scene: Scene) -> bool:
        """Whether the scene is on this level as it is."""
        return all(
            getattr(getattr(scene, part), field) == value
            for key, value in self.fields(scene).items()
            for part, _, field in (key.partition("."),)
        )


def changed(scene: Scene, fields: Fields) -> Scene:
    """A scene with some fields changed."""
    updates: dict[str, dict[str, Any]] = {}
    for key, value in fields.items():
        part, _, field = key.partition(".")
        updates.setdefault(part, {})[field] = value
    parts = {name: getattr(scene, name) for name in Scene.model_fields}
    for part, update in updates.items():
        parts[part] = parts[part].model_copy(update=update)
    return Scene(**parts)


def level(part: Part, name: str) -> Level:
    """A level by its name."""
    return next(one for one in LEVELS[part] if one.name == name)


def holding(scene: Scene) -> Levels:
    """The levels that a pile is on as it is asked; `AS_ASKED` where it is on none."""
    return {
        part: next((one.name for one in reversed(listed) if one.load_steps(scene)), AS_ASKED)
        for part, listed in LEVELS.items()
    }


def meaning(levels: Levels) -> str:
    """What some levels are; without those that a scene is on none of."""
    named = ((part, name) for part, name in levels.items() if name != AS_ASKED)
    return "; ".join(level(part, name).meaning for part, name in named)


def paper_stiffness(scene: Scene) -> float:
    """K d/W of the paper's K = 1e6 N/m."""
    return 1e6 * scene.grain.diameter / scene.weight


def _set(fields: Fields) -> FieldsOf:
    return lambda scene: fields


def _dem(layers: int, rules: Fields, **others: float) -> Fields:
    protocol = {f"protocol.{name}": value for name, value in others.items()}
    return {"bed.mobile_layers": layers, "protocol.method": "dem", **rules, **protocol}


def _solve(cells: int, growth: float, **others: str) -> Fields:
    model = {f"flow.{name}": value for name, value in others.items()}
    mesh = {"flow.cells_per_face": cells, "flow.expansion_ratio": growth}
    return {"flow.model": "solve", "flow.roughness": None, **mesh, **model}


def _shared(scene: Scene) -> Fields:
    """The flow of the nearest z0 on a grid of octaves of h, which many scenes share."""
    assert isinstance(scene.bed, PileBed)
    octave = round(math.log(scene.bed.roughness / scene.bed.height, OCTAVES))
    nearest = float(f"{scene.bed.height * OCTAVES**octave:.6g}")
    return {**_solve(40, 1.4), "flow.roughness": nearest}


def _own_speed(scene: Scene) -> Fields:
    """The flow at the speed at which a single grain of the scene begins to move."""
    assert isinstance(scene.bed, PileBed)
    ustar = float(closed_form(scene).friction_velocity)
    speed = ustar / 0.41 * math.log1p(10 * scene.bed.height / scene.bed.roughness)
    return {**_solve(40, 1.1), "flow.speed": float(f"{speed:.6g}")}


def _paper_stiffness(scene: Scene) -> Fields:
    return {**_dem(1, FAST), "grain.stiffness": paper_stiffness(scene)}


FAST: Fields = {
    "grain.stiffness": 1e3,
    "protocol.time_step": 0.3,
    "protocol.waiting_time": 6.0,
    "protocol.load_increment": 0.03,
}
SLOW: Fields = {
    "grain.stiffness": 1e4,
    "protocol.time_step": 0.2,
    "protocol.waiting_time": 10.0,
    "protocol.load_increment": 0.01,
}
SLOWEST: dict[str, float] = {"waiting_time": 15.0, "load_increment": 0.004}
OTHER_MODEL = "standard, with another turbulence model"

FLOW = (
    Level("flat", "log law on a flat bed: u*_0 everywhere", _set({"flow.model": "flat"})),
    Level("hill", "linear theory of the flow over a low hill", _set({"flow.model": "hill"})),
    Level("shared", "coarse; one solve for each octave of z0/h", _shared),
    Level("coarse", "40 cells on a face, growing by 1.4 away from it", _set(_solve(40, 1.4))),
    Level("short", "20 cells on a face, growing by 1.1", _set(_solve(20, 1.1))),
    Level("medium", "40 cells on a face, growing by 1.2", _set(_solve(40, 1.2))),
    Level("standard", "40 cells on a face, growing by 1.1", _set(_solve(40, 1.1))),
    Level("own speed", "standard, solved at the scene's own U_e", _own_speed),
    Level("fine", "80 cells on a face", _set(_solve(80, 1.1))),
    Level("finest", "160 cells on a face", _set(_solve(160, 1.1)), most_grains=50),
    Level(
        "RNG k-epsilon",
        OTHER_MODEL,
        _set(_solve(40, 1.1, turbulence_model="RNGkEpsilon")),
        same_model=False,
    ),
    Level(
        "realizable k-eps.",
        OTHER_MODEL,
        _set(_solve(40, 1.1, turbulence_model="realizableKE")),
        same_model=False,
    ),
)
"""Levels of the flow; they keep the height of the first cell, which is a part of the model."""

GRAINS = (
    Level(
        "pivot",
        "closed form with each grain's own stress",
        _set({"protocol.method": "pivot"}),
    ),
    Level(
        "peeling",
        "pivot with blocking by neighbours, without dynamics",
        _set({"protocol.method": "peeling"}),
    ),
    Level(
        "1 layer, coarse",
        "DEM, 1 mobile layer, load steps 6 % apart",
        _set(_dem(1, FAST, load_increment=0.06)),
    ),
    Level("1 layer, fast", "DEM, 1 mobile layer, load steps 3 % apart", _set(_dem(1, FAST))),
    Level("2 layers, fast", "DEM, 2 mobile layers, load steps 3 % apart", _set(_dem(2, FAST))),
    Level("4 layers, fast", "DEM, 4 mobile layers, load steps 3 % apart", _set(_dem(4, FAST))),
    Level("1 layer, slow", "DEM, 1 mobile layer, load steps 1 % apart", _set(_dem(1, SLOW))),
    Level("2 layers, slow", "DEM, 2 mobile layers, load steps 1 % apart", _set(_dem(2, SLOW))),
    Level("4 layers, slow", "DEM, 4 mobile layers, load steps 1 % apart", _set(_dem(4, SLOW))),
    Level(
        "full pile, fast",
        "DEM, every grain mobile, load steps 3 % apart",
        _set(_dem(FULL, FAST)),
        on_lattices=True,
    ),
    Level(
        "paper's K, fast",
        "DEM, 1 mobile layer, K = 1e6 N/m, load steps 3 % apart",
        _paper_stiffness,
        most_grains=40,
    ),
    Level(
        "soft reference",
        "the reference on softer grains, 4 layers",
        _set(_dem(4, FAST, **SLOWEST)),
    ),
    Level(
        "reference",
        "DEM, 3 mobile layers, load steps 0.4 % apart",
        _set(_dem(3, SLOW, **SLOWEST)),
    ),
)
"""Levels of the grains."""

LEVELS: dict[Part, tuple[Level, ...]] = {"flow": FLOW, "grains": GRAINS}
