"""Calibration data: the known errors of the fidelity levels, by class of scene.

``levels.csv`` holds what ``orchestrator ladder`` measured against the dearest levels, ``maps.csv``
what ``orchestrator stability`` found.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, reduce
from operator import add
from pathlib import Path

from orchestrator.fidelity.levels import FLAT, Levels, Part, packing
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

FOLDER = Path(__file__).parent
DISORDERS = (0.02, 0.05, 0.2)
"""Sizes of disorder up to which errors are known together, d."""


VISCOUS, ROUGH = 3.0, 30.0
"""Re* below which a bed is hydraulically smooth, and from which it is rough."""


@dataclass(frozen=True)
class Known:
    """Known error of a level, or of one for each part, on a class of scenes at a fraction.

    Attributes
    ----------
    error : float
        Largest relative error of tau_c against the reference.
    uncertainty : float
        How far the reference itself moved when its numbers were changed.
    cost_core_s : float
        Mean core-seconds of a scene.
    """

    error: float
    uncertainty: float
    cost_core_s: float

    def __add__(self, other: "Known") -> "Known":
        """Known error of both parts together.

        Each number is the largest over the scenes of a class, and each has a cause of its own. So
        they add up as the shares of the model do: by their squares.
        """
        return Known(
            math.hypot(self.error, other.error),
            math.hypot(self.uncertainty, other.uncertainty),
            self.cost_core_s + other.cost_core_s,
        )

    @property
    def total(self) -> float:
        """Error and uncertainty together, by their squares."""
        return math.hypot(self.error, self.uncertainty)


UNKNOWN = Known(math.inf, 0.0, math.inf)
EXACT = Known(0.0, 0.0, 0.0)
LEVEL = "level bed"
"""The class for the flow of beds over which u* is u*_0 everywhere."""


def scene_class(part: Part, scene: Scene) -> str:
    """The class of scenes that share the known error of a level.

    The flow's depends on how the stress is read, the grains' on their packing; both on whether the
    slope is the limiting one, on which a row waits for a touch, and on the shape.
    """
    assert isinstance(scene.bed, PileBed)
    ending = ", limiting slope" if scene.bed.slope_deg > scene.limiting_slope_deg - 1 else ""
    ending += _shape(scene.bed)
    if part == "flow" and scene.bed.is_level:
        return LEVEL
    if part == "flow":
        return scene.forces.stress + ending
    if scene.bed.packing == "disordered":
        size = next(size for size in DISORDERS if scene.bed.disorder <= size)
        return f"disordered up to {size:g} d{ending}"
    return packing(scene.bed) + ending


def model_class(scene: Scene) -> str:
    """The class of scenes that share what the choices common to all levels do to a threshold."""
    assert isinstance(scene.bed, PileBed)
    reynolds = float(closed_form(scene).reynolds)
    names = {VISCOUS: "viscous", ROUGH: "transitional", math.inf: "rough"}
    name = next(name for end, name in names.items() if reynolds < end)
    return f"{scene.bed.packing}, {name}{_shape(scene.bed)}"


def _shape(bed: PileBed) -> str:
    """A suffix of the class: measurements on triangles hold for no other bed."""
    return "" if bed.is_triangle else f", {'profile' if bed.profile else bed.shape}"


def known(levels: Levels, classes: Mapping[Part, str], fractions: Sequence[float]) -> list[Known]:
    """Known error of a level for each part, together, at each fraction.

    Parameters
    ----------
    levels, classes : mapping
        By part: the level's name, and the class of the scene.
    fractions : sequence of float
        n/N.
    """
    return [
        reduce(add, (known_at(part, name, classes[part], at) for part, name in levels.items()))
        for at in fractions
    ]


def known_at(part: Part, level: str, scene_class: str, fraction: float) -> Known:
    """Known error of one level at a fraction; infinite where nothing is known."""
    if (level, scene_class) == (FLAT, LEVEL):
        return EXACT
    rows = measured().get((part, level, scene_class), {})
    if fraction in rows or not rows:
        return rows.get(fraction, UNKNOWN)
    # between the fractions that were measured the worst of them has to do
    return max(rows.values(), key=lambda row: row.error)


@cache
def measured() -> dict[tuple[str, str, str], dict[float, Known]]:
    """The measured errors, by part, level and class of scene, then by fraction."""
    found: dict[tuple[str, str, str], dict[float, Known]] = {}
    with (FOLDER / "levels.csv").open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            key = (row["part"], row["level"], row["scene_class"])
            numbers = (float(row[name]) for name in ("error", "uncertainty", "cost_core_s"))
            found.setdefault(key, {})[float(row["fraction"])] = Known(*numbers)
    return found
