"""Fidelity levels: named ways to answer a scene, from cheap to dear.

A level changes how a scene is answered, never what it asks. One level is for the flow, one for the
grains.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from orchestrator.study.closed_form import closed_form
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import LEAST_WIDTH, Scene
from orchestrator.study.sizes import largest
from orchestrator.study.study import make_scene

Part = Literal["flow", "grains"]
Levels = Mapping[Part, str]
"""Names of levels, by what they answer."""
Fields = Mapping[str, Any]
"""Values of a scene's fields, named as in a study file."""
AS_ASKED = "as asked"
"""Stands for the name of a level where a scene is on none."""
OCTAVES = 2.0
"""Flows are shared within this ratio of z0."""
FULL = 1000
"""More layers than any pile has."""
STRIP = "strip"
"""A poured bed in space, and the level of the grains that answers one in the plane by it."""
WIDTH = 5.0
"""Width of that level's strip, d; more where the largest grains need it."""
FLAT = "flat"
"""The level of the flow that leaves out all forms: exact over a level bed."""


@dataclass(frozen=True)
class Level:
    """One way to answer the flow or the grains of a pile.

    Attributes
    ----------
    name, meaning : str
        What tables call it, and what it is.
    sets : mapping or callable
        The fields that it sets; a callable where they follow from the scene.
    same_model : bool
        Whether it has the reference's model choices; another turbulence model has not, nor have
        contacts of one stiffness in N/m or a bed in space. Others are measured and never chosen.
    most_grains : int or None
        The ladder measures a dear level on piles of no more exposed grains than this.
    not_on : tuple of str
        Packings that it leaves alone, `STRIP` among them.
    """

    name: str
    meaning: str
    sets: Fields | Callable[[Scene], Fields]
    same_model: bool = True
    most_grains: int | None = None
    not_on: tuple[str, ...] = ()

    def answer(self, scene: Scene) -> Scene:
        """The scene as this level answers it."""
        return changed(scene, self.fields(scene))

    def describes(self, scene: Scene) -> bool:
        """Whether the scene is on this level as it is."""
        return self.takes(scene) and all(
            getattr(getattr(scene, part), field) == value
            for key, value in self.fields(scene).items()
            for part, _, field in (key.partition("."),)
        )

    def takes(self, scene: Scene) -> bool:
        """Whether it is a way to answer a pile of this packing."""
        assert isinstance(scene.bed, PileBed)
        return packing(scene.bed) not in self.not_on

    def fields(self, scene: Scene) -> Fields:
        """The fields that it sets in a scene."""
        return self.sets(scene) if callable(self.sets) else self.sets


def packing(bed: PileBed) -> str:
    """The packing of a pile as levels tell them apart, with `STRIP` for a bed in space."""
    return STRIP if bed.width else bed.packing


def changed(scene: Scene, fields: Fields) -> Scene:
    """A scene with some fields changed.

    Raises
    ------
    InputError
        For a field that there is none of, or a value that it cannot have.
    """
    parts: dict[str, dict[str, Any]] = {name: dict(getattr(scene, name)) for name in PARTS}
    for key, value in fields.items():
        part, _, field = key.partition(".")
        parts.setdefault(part, {})[field] = value
    return make_scene(parts, "fields that are changed")


def solved_model(scene: Scene) -> str:
    """The flow model that the levels approximate: over a level bed there is nothing to solve."""
    return FLAT if isinstance(scene.bed, PileBed) and scene.bed.is_level else "solve"


def level(part: Part, name: str) -> Level:
    """A level by its name."""
    return next(one for one in LEVELS[part] if one.name == name)


def holding(scene: Scene) -> Levels:
    """The levels that a pile is on as it is asked; `AS_ASKED` where it is on none."""
    return {
        part: next((one.name for one in reversed(listed) if one.describes(scene)), AS_ASKED)
        for part, listed in LEVELS.items()
    }


def meaning(levels: Levels) -> str:
    """Meanings of some levels; parts without a level are left out."""
    named = ((part, name) for part, name in levels.items() if name != AS_ASKED)
    return "; ".join(level(part, name).meaning for part, name in named)


def paper_stiffness(scene: Scene) -> float:
    """K d/W of the paper's K = 1e6 N/m."""
    return 1e6 * scene.grain.diameter / scene.weight


def _dem(name: str, layers: int, rules: Fields, **options: Any) -> Level:
    """DEM of some mobile layers; options as for `Level`."""
    which = "every grain mobile" if layers == FULL else f"{layers} mobile layers"
    which = which.removesuffix("s") if layers == 1 else which
    meaning = f"DEM, {which}, load steps {100 * rules['protocol.load_increment']:g} % apart"
    return Level(name, **{"meaning": meaning, "sets": _mobile(layers, rules), **options})


def _mobile(layers: int, rules: Fields) -> Fields:
    return {"bed.mobile_layers": layers, "protocol.method": "dem", **rules}


def _solve(cells: int, growth: float) -> Fields:
    mesh = {"flow.cells_per_face": cells, "flow.expansion_ratio": growth}
    return {"flow.model": "solve", "flow.roughness": None, **mesh}


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
    own = {"flow.speed": float(f"{speed:.6g}"), "flow.first_cell_height": scene.first_cell_height}
    return {**STANDARD, **own}


def _paper_stiffness(scene: Scene) -> Fields:
    return {**_mobile(1, FAST), "grain.stiffness": paper_stiffness(scene)}


def _strip(scene: Scene) -> Fields:
    least = LEAST_WIDTH * largest(scene.grain.sizes, scene.grain.diameter)
    wide = max(WIDTH, float(math.ceil(least))) if scene.is_poured else 0.0
    return {**_mobile(4, FAST), "bed.width": wide}


def _reference(scene: Scene) -> Fields:
    """On a poured bed each further layer that may move lets grains go earlier, up to the sixth."""
    return _mobile(6, SLOW) if scene.is_poured else _mobile(3, SLOWEST)


def _soft_reference(scene: Scene) -> Fields:
    return _mobile(FULL, SOFT) if scene.is_poured else _mobile(4, SOFTEST)


def _rules(
    stiffness: float, time_step: float, waiting_time: float, load_increment: float
) -> Fields:
    return {
        "grain.stiffness": stiffness,
        "protocol.time_step": time_step,
        "protocol.waiting_time": waiting_time,
        "protocol.load_increment": load_increment,
    }


COARSE = _rules(1e3, 0.3, 6.0, 0.06)
FAST = _rules(1e3, 0.3, 6.0, 0.03)
SLOW = _rules(1e4, 0.2, 10.0, 0.01)
SLOWEST = _rules(1e4, 0.2, 15.0, 0.004)
SOFTEST = _rules(1e3, 0.3, 15.0, 0.004)
SOFT = _rules(1e3, 0.3, 10.0, 0.01)
STANDARD = _solve(40, 1.1)
RNG = {**STANDARD, "flow.turbulence_model": "RNGkEpsilon"}
REALIZABLE = {**STANDARD, "flow.turbulence_model": "realizableKE"}
OTHER_MODEL = "standard, with another turbulence model"

FLOW = (
    Level(FLAT, "log law on a flat bed: u*₀ everywhere", {"flow.model": "flat"}),
    Level("hill", "linear theory of the flow over a low hill", {"flow.model": "hill"}),
    Level("waves", "linear theory, each wavelength by itself", {"flow.model": "waves"}),
    Level("shared", "coarse; one solve for each octave of z0/h", _shared),
    Level("coarse", "40 cells on a face, growing by 1.4 away from it", _solve(40, 1.4)),
    Level("short", "20 cells on a face, growing by 1.1", _solve(20, 1.1)),
    Level("medium", "40 cells on a face, growing by 1.2", _solve(40, 1.2)),
    Level("standard", "40 cells on a face, growing by 1.1", STANDARD),
    Level("own speed", "standard, solved at the scene's own U_e", _own_speed),
    Level("fine", "80 cells on a face", _solve(80, 1.1)),
    Level("finest", "160 cells on a face", _solve(160, 1.1), most_grains=50),
    Level("RNG k-epsilon", OTHER_MODEL, RNG, same_model=False),
    Level("realizable k-eps.", OTHER_MODEL, REALIZABLE, same_model=False),
)
"""Levels of the flow; they keep the height of the first cell, which is a part of the model."""

GRAINS = (
    Level("pivot", "closed form with each grain's own stress", {"protocol.method": "pivot"}),
    Level(
        "peeling",
        "pivot with blocking by neighbours, without dynamics",
        {"protocol.method": "peeling"},
        not_on=(STRIP,),
    ),
    _dem("1 layer, coarse", 1, COARSE),
    _dem("1 layer, fast", 1, FAST),
    _dem("2 layers, fast", 2, FAST),
    _dem("4 layers, fast", 4, FAST),
    _dem("1 layer, slow", 1, SLOW),
    _dem("2 layers, slow", 2, SLOW),
    _dem("4 layers, slow", 4, SLOW),
    # it would disorder more rows of a disordered packing
    _dem("full pile, fast", FULL, FAST, not_on=("disordered",)),
    Level(
        "paper's K, fast",
        "DEM, 1 mobile layer, K = 1e6 N/m, load steps 3 % apart",
        _paper_stiffness,
        # small grains would be stiffer than a study file allows, by steps of time as short
        same_model=False,
        most_grains=40,
        # the contacts of softer grains, in which it was poured, would throw them apart
        not_on=("poured", STRIP),
    ),
    Level(
        STRIP,
        "DEM of a poured bed in space, periodic across the flow, 4 mobile layers, load steps 3 % "
        "apart",
        _strip,
        same_model=False,
        not_on=("aligned", "horizontal", "disordered", STRIP),
    ),
    Level(
        "soft reference",
        "the reference on softer grains, 4 layers; of a poured bed all",
        _soft_reference,
    ),
    Level(
        "reference",
        "DEM, 3 mobile layers, load steps 0.4 % apart; of a poured bed 6 layers, 1 %",
        _reference,
    ),
)
"""Levels of the grains."""

LEVELS: dict[Part, tuple[Level, ...]] = {"flow": FLOW, "grains": GRAINS}
