"""Fidelity levels: named ways to answer a pile, from cheap to dear.

A level changes how a scene is answered, never what it asks. A pile is answered on a pair of levels,
one for the flow and one for the grains. ``levels.toml`` lists them.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator.physics.constants import KARMAN
from orchestrator.study.closed_form import closed_form
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import LEAST_WIDTH, Scene
from orchestrator.study.sizes import extremes
from orchestrator.study.study import make_scene

Fields = Mapping[str, Any]
"""Values of a scene's fields, named as in a study file."""
STRIP_WIDTH = 5.0
"""Width of the bed of the level `strip`, d; more where the largest grains need it."""
FINER = {
    **{"flow.cells_per_face": 1, "flow.expansion_ratio": -1},
    **{"bed.mobile_layers": 1, "grain.stiffness": 1},
    **{"protocol.time_step": -1, "protocol.waiting_time": 1, "protocol.load_increment": -1},
}
"""Numbers of a level, and whether a larger one (1) or a smaller one (-1) is at least as fine."""


@dataclass(frozen=True, eq=False)
class Level:
    """One way to answer the flow or the grains of a pile: the fields of a scene that it sets.

    `on_poured` are those that it sets to something else on a poured bed, `derived` names the one
    that follows from the scene ("threshold_speed", "paper_stiffness", "strip_width"). A level that
    is not of the reference's model is measured and never chosen; the ladder measures an expensive
    one on piles of at most `most_grains` exposed grains. Packings `not_on` it cannot answer.
    """

    name: str
    meaning: str
    sets: Fields = field(default_factory=dict)
    on_poured: Fields = field(default_factory=dict)
    derived: str = ""
    same_model: bool = True
    most_grains: float = math.inf
    not_on: Sequence[str] = ()

    @property
    def is_shared(self) -> bool:
        """Whether beds of one form share its flows whatever their roughness."""
        return bool(self.sets.get("flow.nodes"))

    def takes(self, scene: Scene) -> bool:
        """Whether the level can answer a pile.

        The linear theories know boundary layers over beds without obstacles; that of a hill needs a
        form that falls on both sides.
        """
        bed, model = scene.bed, self.sets.get("flow.model")
        assert isinstance(bed, PileBed)
        if model in ("hill", "waves") and (scene.flow.top != "boundary layer" or bed.obstacles):
            return False
        if model == "hill" and (bed.profile or bed.shape.startswith("step")):
            return False
        return packing(scene) not in self.not_on

    def answer(self, scene: Scene) -> Scene:
        """The scene as this level answers it."""
        return changed(scene, self.fields(scene))

    def describes(self, scene: Scene, *, or_finer: bool = False) -> bool:
        """Whether the scene is on this level, or has numbers that are finer and all else alike."""
        return self.takes(scene) and all(
            FINER[name] * (value_of(scene, name) - value) >= 0
            if or_finer and name in FINER
            else value_of(scene, name) == value
            for name, value in self.fields(scene).items()
        )

    def fields(self, scene: Scene) -> Fields:
        """The fields that it sets in a scene."""
        fields, bed = {**self.sets, **(self.on_poured if scene.is_poured else {})}, scene.bed
        assert isinstance(bed, PileBed)
        if fields.get("flow.model") == "solve":
            fields = {"flow.roughness": None, "flow.nodes": False, **fields}
        if self.derived == "threshold_speed":
            ustar = float(closed_form(scene).friction_velocity)
            speed = ustar / KARMAN * math.log1p(10 * bed.height / bed.roughness)
            fields["flow.speed"] = float(f"{speed:.6g}")
            fields["flow.first_cell_height"] = scene.first_cell_height
        elif self.derived == "paper_stiffness":
            fields["grain.stiffness"] = paper_stiffness(scene)
        elif self.derived == "strip_width":
            least = math.ceil(LEAST_WIDTH * extremes(scene.grain.sizes, scene.grain.diameter)[1])
            fields["bed.width"] = max(STRIP_WIDTH, float(least)) if scene.is_poured else 0.0
        return fields


class Pair(NamedTuple):
    """A level of the flow and one of the grains."""

    flow: Level
    grains: Level

    @property
    def text(self) -> str:
        """The names of both in one text."""
        return f"{self.flow.name} | {self.grains.name}"

    def answer(self, scene: Scene) -> Scene:
        """The scene as both levels answer it."""
        return self.grains.answer(self.flow.answer(scene))


def value_of(scene: Scene, name: str) -> Any:
    """The value of a field, named as in a study file."""
    return attrgetter(name)(scene)


def changed(scene: Scene, fields: Fields) -> Scene:
    """A scene with some fields changed; an `InputError` for a value that a field cannot have."""
    parts: dict[str, dict[str, Any]] = {name: dict(getattr(scene, name)) for name in PARTS}
    for name, value in fields.items():
        part, _, field = name.partition(".")
        parts.setdefault(part, {})[field] = value
    return make_scene(parts, "fields that are changed")


def paper_stiffness(scene: Scene) -> float:
    """K d/W of the paper's K = 1e6 N/m."""
    return 1e6 * scene.grain.diameter / scene.weight


def packing(scene: Scene) -> str:
    """The packing of a pile as levels tell them apart: a poured bed in space is a "strip"."""
    assert isinstance(scene.bed, PileBed)
    return "strip" if scene.bed.width else scene.bed.packing


def _load(part: str) -> tuple[Level, ...]:
    data = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

    def by_dem(row: dict[str, Any]) -> Fields:
        layers = {"protocol.method": "dem", "bed.mobile_layers": row.pop("layers")}
        return {**layers, **data["rules"][row.pop("rules")]}

    for row in data[part]:
        if "rules" in row:
            row["sets"] = by_dem(row)
            row["on_poured"] = by_dem(row["on_poured"]) if "on_poured" in row else {}
    return tuple(Level(**row) for row in data[part])


AS_ASKED = Level("as asked", "numbers of the study file")
"""Stands for a level where a scene is on none."""
FLOW, GRAINS = _load("flow"), _load("grains")
LEVELS = {"flow": FLOW, "grains": GRAINS}
"""All levels, by the part of a pile that they answer, from cheap to dear."""
FLAT, PEELING = FLOW[0], GRAINS[1]


def level(part: str, name: str) -> Level:
    """A level by its name."""
    return next(level for level in LEVELS[part] if level.name == name)


def pair_of(scene: Scene) -> Pair:
    """The levels that a pile is on as it is asked; `AS_ASKED` where it is on none."""
    on = ([level for level in levels if level.describes(scene)] for levels in LEVELS.values())
    return Pair(*(levels[-1] if levels else AS_ASKED for levels in on))


def meaning(names: Iterable[str]) -> str:
    """Meanings of some levels, by their names; names of no level are left out."""
    meanings = {level.name: level.meaning for level in (*FLOW, *GRAINS)}
    return "; ".join(meanings[name] for name in names if name in meanings)
