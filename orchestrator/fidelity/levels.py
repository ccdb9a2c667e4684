"""Fidelity levels: named ways to answer a pile, from cheap to dear.

A level changes how a scene is answered, never what it asks. A pile is answered on a pair of levels,
one for the flow and one for the grains.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from orchestrator.physics.constants import KARMAN
from orchestrator.study.closed_form import closed_form
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import LEAST_WIDTH, Scene
from orchestrator.study.sizes import largest
from orchestrator.study.study import make_scene

Fields = Mapping[str, Any]
"""Values of a scene's fields, named as in a study file."""
OCTAVES = 2.0
"""Ratio of z0 within which the level `shared` uses one flow."""
FULL = 1000
"""More layers than any pile has."""
STRIP_WIDTH = 5.0
"""Width of the bed of the level `strip`, d; more where the largest grains need it."""
FINER = {
    "flow.cells_per_face": 1,
    "flow.expansion_ratio": -1,
    "bed.mobile_layers": 1,
    "grain.stiffness": 1,
    "protocol.time_step": -1,
    "protocol.waiting_time": 1,
    "protocol.load_increment": -1,
}
"""Numbers of a level, and whether a larger one (1) or a smaller one (-1) is at least as fine."""


@dataclass(frozen=True, eq=False)
class Level:
    """One way to answer the flow or the grains of a pile.

    Attributes
    ----------
    name, meaning : str
        What tables call it, and what it is.
    sets : mapping or callable
        The fields that it sets; a callable where they follow from the scene.
    same_model : bool
        Whether it has the model choices of the reference: its turbulence model, contacts in
        proportion to the weight, a bed in the plane. Other levels are measured and never chosen.
    most_grains : int or None
        The ladder measures an expensive level on piles of at most this many exposed grains.
    takes : callable
        Whether the level can answer a scene.
    """

    name: str
    meaning: str
    sets: Fields | Callable[[Scene], Fields]
    same_model: bool = True
    most_grains: int | None = None
    takes: Callable[[Scene], bool] = lambda scene: True

    def fields(self, scene: Scene) -> Fields:
        """The fields that it sets in a scene."""
        return self.sets(scene) if callable(self.sets) else self.sets

    def answer(self, scene: Scene) -> Scene:
        """The scene as this level answers it."""
        return changed(scene, self.fields(scene))

    def describes(self, scene: Scene) -> bool:
        """Whether the scene is on this level as it is."""
        return self.takes(scene) and all(
            value_of(scene, name) == value for name, value in self.fields(scene).items()
        )

    def bounds(self, scene: Scene) -> bool:
        """Whether the scene is on this level, or has numbers that are finer and all else alike."""
        return self.takes(scene) and all(
            FINER[name] * (value_of(scene, name) - value) >= 0
            if name in FINER
            else value_of(scene, name) == value
            for name, value in self.fields(scene).items()
        )


class Pair(NamedTuple):
    """A level of the flow and one of the grains."""

    flow: Level
    grains: Level

    @property
    def text(self) -> str:
        """The names of both in one text."""
        return " | ".join(level.name for level in self)

    def answer(self, scene: Scene) -> Scene:
        """The scene as both levels answer it."""
        return self.grains.answer(self.flow.answer(scene))


def value_of(scene: Scene, name: str) -> Any:
    """The value of a field, named as in a study file."""
    part, _, field = name.partition(".")
    return getattr(getattr(scene, part), field)


def changed(scene: Scene, fields: Fields) -> Scene:
    """A scene with some fields changed.

    Raises
    ------
    InputError
        For a field that does not exist, or a value that it cannot have.
    """
    parts: dict[str, dict[str, Any]] = {name: dict(getattr(scene, name)) for name in PARTS}
    for name, value in fields.items():
        part, _, field = name.partition(".")
        parts.setdefault(part, {})[field] = value
    return make_scene(parts, "fields that are changed")


def packing(bed: PileBed) -> str:
    """The packing of a pile as levels tell them apart: a poured bed in space is a "strip"."""
    return "strip" if bed.width else bed.packing


def solved_model(scene: Scene) -> str:
    """The flow model that the levels approximate: over a level bed no flow is solved."""
    return "flat" if isinstance(scene.bed, PileBed) and scene.bed.is_level else "solve"


def pair_of(scene: Scene) -> Pair:
    """The levels that a pile is on as it is asked; `AS_ASKED` where it is on none."""
    return Pair(
        *(
            next((level for level in reversed(levels) if level.describes(scene)), AS_ASKED)
            for levels in (FLOW, GRAINS)
        )
    )


def meaning(names: Iterator[str] | list[str]) -> str:
    """Meanings of some levels, by their names; names of no level are left out."""
    meanings = {level.name: level.meaning for level in (*FLOW, *GRAINS)}
    return "; ".join(meanings[name] for name in names if name in meanings)


def paper_stiffness(scene: Scene) -> float:
    """K d/W of the paper's K = 1e6 N/m."""
    return 1e6 * scene.grain.diameter / scene.weight


def _is_low(scene: Scene) -> bool:
    """Whether the linear theories know the flow: a boundary layer over a bed without obstacles."""
    assert isinstance(scene.bed, PileBed)
    return scene.flow.top == "boundary layer" and not scene.bed.obstacles


def _hill_ends(scene: Scene) -> bool:
    """Whether a form falls on both of its sides, as the theory of one hill needs."""
    assert isinstance(scene.bed, PileBed)
    return _is_low(scene) and not scene.bed.profile and not scene.bed.shape.startswith("step")


def _on(*packings: str) -> Callable[[Scene], bool]:
    """Whether a pile has one of some packings."""
    return lambda scene: isinstance(scene.bed, PileBed) and packing(scene.bed) in packings


def _solve(cells: int, growth: float, roughness: float | None = None) -> Fields:
    return {
        "flow.model": "solve",
        "flow.roughness": roughness,
        "flow.cells_per_face": cells,
        "flow.expansion_ratio": growth,
    }


def _shared(scene: Scene) -> Fields:
    """The flow of the nearest z0 on a grid of octaves of h, which many scenes share."""
    assert isinstance(scene.bed, PileBed)
    octave = round(math.log(scene.bed.roughness / scene.bed.height, OCTAVES))
    return _solve(40, 1.4, float(f"{scene.bed.height * OCTAVES**octave:.6g}"))


def _own_speed(scene: Scene) -> Fields:
    """The flow at the speed at which a single grain of the scene begins to move."""
    assert isinstance(scene.bed, PileBed)
    ustar = float(closed_form(scene).friction_velocity)
    speed = ustar / KARMAN * math.log1p(10 * scene.bed.height / scene.bed.roughness)
    cell = scene.first_cell_height
    return {**STANDARD, "flow.speed": float(f"{speed:.6g}"), "flow.first_cell_height": cell}


def _dem(layers: int, stiffness: float, step: float, waiting: float, increment: float) -> Fields:
    return {
        "protocol.method": "dem",
        "bed.mobile_layers": layers,
        "grain.stiffness": stiffness,
        "protocol.time_step": step,
        "protocol.waiting_time": waiting,
        "protocol.load_increment": increment,
    }


def _coarse(layers: int) -> Fields:
    return _dem(layers, stiffness=1e3, step=0.3, waiting=6.0, increment=0.06)


def _fast(layers: int) -> Fields:
    return _dem(layers, stiffness=1e3, step=0.3, waiting=6.0, increment=0.03)


def _slow(layers: int) -> Fields:
    return _dem(layers, stiffness=1e4, step=0.2, waiting=10.0, increment=0.01)


def _paper(scene: Scene) -> Fields:
    return {**_fast(1), "grain.stiffness": paper_stiffness(scene)}


def _strip(scene: Scene) -> Fields:
    least = LEAST_WIDTH * largest(scene.grain.sizes, scene.grain.diameter)
    width = max(STRIP_WIDTH, float(math.ceil(least))) if scene.is_poured else 0.0
    return {**_fast(4), "bed.width": width}


def _reference(scene: Scene) -> Fields:
    """On a poured bed each further mobile layer lets grains go earlier, up to the sixth."""
    return _slow(6) if scene.is_poured else _dem(3, 1e4, 0.2, 15.0, 0.004)


def _soft_reference(scene: Scene) -> Fields:
    """The reference with every number changed, which says how well it is known."""
    if scene.is_poured:
        return _dem(FULL, 1e3, 0.3, 10.0, 0.01)
    return _dem(4, 1e3, 0.3, 15.0, 0.004)


def _layers(fields: Fields) -> str:
    layers, step = fields["bed.mobile_layers"], 100 * fields["protocol.load_increment"]
    which = "every grain mobile" if layers == FULL else f"{layers} mobile layers"
    which = which.removesuffix("s") if layers == 1 else which
    return f"DEM, {which}, load steps {step:g} % apart"


STANDARD = _solve(40, 1.1)
OTHER_MODEL = "standard, with another turbulence model"
PLANE = ("aligned", "horizontal", "disordered", "poured")
AS_ASKED = Level("as asked", "numbers of the study file", {})
"""Stands for a level where a scene is on none."""
FLAT = Level("flat", "log law on a flat bed: u*₀ everywhere", {"flow.model": "flat"})
"""It leaves out all forms: exact over a level bed."""
PEELING = Level(
    "peeling",
    "pivot with blocking by neighbours, without dynamics",
    {"protocol.method": "peeling"},
    takes=_on(*PLANE),
)

FLOW = (
    FLAT,
    Level(
        "hill",
        "linear theory of the flow over a low hill",
        {"flow.model": "hill"},
        takes=_hill_ends,
    ),
    Level(
        "waves", "linear theory, each wavelength by itself", {"flow.model": "waves"}, takes=_is_low
    ),
    Level("shared", "coarse; one solve for each octave of z0/h", _shared),
    Level("coarse", "40 cells on a face, growing by 1.4 away from it", _solve(40, 1.4)),
    Level("short", "20 cells on a face, growing by 1.1", _solve(20, 1.1)),
    Level("medium", "40 cells on a face, growing by 1.2", _solve(40, 1.2)),
    Level("standard", "40 cells on a face, growing by 1.1", STANDARD),
    Level("own speed", "standard, solved at the scene's own U_e", _own_speed),
    Level("fine", "80 cells on a face", _solve(80, 1.1)),
    Level("finest", "160 cells on a face", _solve(160, 1.1), most_grains=50),
    *(
        Level(name, OTHER_MODEL, {**STANDARD, "flow.turbulence_model": model}, same_model=False)
        for name, model in (
            ("RNG k-epsilon", "RNGkEpsilon"),
            ("realizable k-eps.", "realizableKE"),
        )
    ),
)
"""Levels of the flow; they keep the height of the first cell, which is a part of the model."""

GRAINS = (
    Level("pivot", "closed form with each grain's own stress", {"protocol.method": "pivot"}),
    PEELING,
    Level("1 layer, coarse", _layers(_coarse(1)), _coarse(1)),
    *(
        Level(name, _layers(fields), fields)
        for pace, rules in (("fast", _fast), ("slow", _slow))
        for layers in (1, 2, 4)
        for name, fields in ((f"{layers} layer{'s' * (layers > 1)}, {pace}", rules(layers)),)
    ),
    # on a disordered packing, more layers are other disorder
    Level(
        "full pile, fast",
        _layers(_fast(FULL)),
        _fast(FULL),
        takes=_on("aligned", "horizontal", "poured", "strip"),
    ),
    # the stiffness of small grains would exceed the range of a study file; poured grains were
    # settled by softer contacts, from which stiff ones would throw them apart
    Level(
        "paper's K, fast",
        "DEM, 1 mobile layer, K = 1e6 N/m, load steps 3 % apart",
        _paper,
        same_model=False,
        most_grains=40,
        takes=_on("aligned", "horizontal", "disordered"),
    ),
    Level(
        "strip",
        "DEM of a poured bed in space, periodic across the flow, 4 mobile layers, load steps 3 % "
        "apart",
        _strip,
        same_model=False,
        takes=_on("poured"),
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

LEVELS = {"flow": FLOW, "grains": GRAINS}
"""All levels, by the part of a pile that they answer."""


def level(part: str, name: str) -> Level:
    """A level by its name."""
    return next(level for level in LEVELS[part] if level.name == name)
