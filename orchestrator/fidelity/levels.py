"""Fidelity levels: named ways to answer a pile, from cheap to dear, and their known errors.

A level changes how a scene is answered, never what it asks. A pile is answered on a pair of levels,
one for the flow and one for the grains. ``levels.toml`` lists them. The tables in ``calibration``
hold what was measured: ``levels.csv`` by `orchestrator ladder`, ``budget.csv``, the spread of the
model, by `orchestrator budget`, ``maps.csv`` by `orchestrator stability`.
"""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import rounded, whole_up
from orchestrator.physics.constants import KARMAN
from orchestrator.study.closed_form import closed_form, outer_roughness
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed, extremes
from orchestrator.study.scene import LEAST_WIDTH, Scene, default_first_cell_height
from orchestrator.study.study import make_scene
from orchestrator.types import FloatArray

Fields = Mapping[str, Any]  # values of a scene's fields, named as in a study file
STRIP_WIDTH = (
    5.0  # of the bed of the level `strip`, d; more where the largest grains need it
)
FINER = {
    **{"flow.cells_per_face": 1, "flow.expansion_ratio": -1},
    **{"bed.mobile_layers": 1, "grain.stiffness": 1},
    **{
        "protocol.time_step": -1,
        "protocol.waiting_time": 1,
        "protocol.load_increment": -1,
    },
}
"""Numbers of a level, and whether a larger one (1) or a smaller one (-1) is at least as fine."""
FOLDER = Path(__file__).with_name("calibration")
DISORDERS = (
    0.02,
    0.05,
    0.2,
)  # ends of the ranges of disorder that share their known errors, d
VISCOUS, ROUGH = (
    3.0,
    30.0,
)  # Re* below which a bed is smooth, and from which it is rough
LEVEL_BED = "level bed"  # class for the flow of beds over which u* is u*_0 everywhere
LIMITING = ", limiting slope"  # end of the name of a class
LIFTED_TO = 1.235  # lift over the weight normal to the bed, up to which lifted grains were measured
BETWEEN_DEG = (
    5.0  # below the limiting slope, from which slopes were measured as below it
)
AT_LEAST = ("flow.lid", "flow.upstream", "flow.downstream")  # as good where larger
SETTINGS = (
    *(
        *AT_LEAST,
        "flow.turbulence_model",
        "flow.convection_scheme",
        "forces.averaging_length",
    ),
    *("forces.loaded_grains", "forces.exposure", "forces.sheltering", "grain.cohesion"),
    "protocol.displacement_criterion",
)
_AT = {name: name.split(".") for name in SETTINGS}
DEFAULTS = {
    name: PARTS[part].model_fields[key].default for name, (part, key) in _AT.items()
}
"""Fields that move an answer and that the ladder keeps at their defaults."""
SAME_CELL = 0.02  # relative difference of the first cell that changes no known error
FROZEN = "frozen bed"  # the choice that the flow of the whole pile acts until the last grain left
STATED = (
    "packing",
    "roughness length",
    "entrainment angle",
    "friction angle",
    "lift coefficient",
)
"""Choices whose values a study file states."""


@dataclass(frozen=True, eq=False)
class Level:
    """One way to answer the flow or the grains of a pile: the fields of a scene that it sets.

    `on_poured` are those that it sets to something else on a poured bed, `derived` names the one
    that follows from the scene ("threshold_speed", "paper_stiffness", "strip_width"). A level that
    is not of the reference's model, or not `offered`, is measured and never chosen; the ladder
    measures an expensive one on piles of at most `most_grains` exposed grains. Packings `not_on` it
    cannot answer.
    """

    name: str
    meaning: str
    sets: Fields = field(default_factory=dict)
    on_poured: Fields = field(default_factory=dict)
    derived: str = ""
    same_model: bool = True
    offered: bool = True
    most_grains: float = math.inf
    not_on: Sequence[str] = ()

    @property
    def is_offered(self) -> bool:
        """Whether a choice may take it."""
        return self.offered and self.same_model

    def takes(self, scene: Scene) -> bool:
        """Whether the level can answer a pile.

        Linear theory knows boundary layers over beds without obstacles.
        """
        bed = scene.bed
        assert isinstance(bed, PileBed)
        beyond_theory = scene.flow.top != "boundary layer" or bool(bed.obstacles)
        if self.sets.get("flow.model") == "waves" and beyond_theory:
            return False
        return packing(scene) not in self.not_on

    def answer(self, scene: Scene) -> Scene:
        """The scene as this level answers it."""
        return changed(scene, self.changes(scene))

    def changes(self, scene: Scene) -> Fields:
        """The fields that it sets where it is chosen: a flow over fine sand has its own z0."""
        own = self.sets.get("flow.model", "flat") != "flat"
        return {
            **self.fields(scene),
            **({"flow.roughness": outer_roughness(scene)} if own else {}),
        }

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
        fields, bed = (
            {**self.sets, **(self.on_poured if scene.is_poured else {})},
            scene.bed,
        )
        assert isinstance(bed, PileBed)
        if self.derived == "threshold_speed":
            ustar = float(closed_form(scene).friction_velocity)
            speed = ustar / KARMAN * math.log1p(10 * bed.height / bed.roughness)
            fields["flow.speed"] = float(f"{speed:.6g}")
            fields["flow.first_cell_height"] = scene.first_cell_height
        elif self.derived == "paper_stiffness":
            stiffness = 1e6 * scene.grain.diameter / scene.weight  # of 1e6 N/m
            fields["grain.stiffness"] = rounded(stiffness)
        elif self.derived == "strip_width":
            largest = extremes(scene.grain.sizes, scene.grain.diameter)[1]
            least = max(STRIP_WIDTH, float(whole_up(LEAST_WIDTH * largest)))
            fields["bed.width"] = least if scene.is_poured else 0.0
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
        return changed(
            scene, {**self.flow.changes(scene), **self.grains.changes(scene)}
        )


def value_of(scene: Scene, name: str) -> Any:
    """The value of a field, named as in a study file."""
    return attrgetter(name)(scene)


def changed(scene: Scene, fields: Fields) -> Scene:
    """A scene with some fields changed; an `InputError` for a value that a field cannot have."""
    parts: dict[str, dict[str, Any]] = {
        name: dict(getattr(scene, name)) for name in PARTS
    }
    for name, value in fields.items():
        part, _, field = name.partition(".")
        parts.setdefault(part, {})[field] = value
    return make_scene(parts, "fields that are changed")


def packing(scene: Scene) -> str:
    """The packing of a pile as levels tell them apart: a poured bed in space is a "strip"."""
    assert isinstance(scene.bed, PileBed)
    return "strip" if scene.bed.width else scene.bed.packing


def _load(part: str) -> tuple[Level, ...]:
    data = tomllib.loads(
        Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    )
    for row in data[part]:
        for sets in (row["sets"], row.get("on_poured", {})):
            sets |= data["rules"].get(sets.pop("rules", ""), {})
    return tuple(Level(**row) for row in data[part])


AS_ASKED = Level(
    "as asked", "numbers of the study file"
)  # where a scene is on no level
FLOW, GRAINS = _load("flow"), _load("grains")
LEVELS = {"flow": FLOW, "grains": GRAINS}
"""All levels, by the part of a pile that they answer, from cheap to dear."""
FLAT, PIVOT, PEELING = FLOW[0], *GRAINS[:2]
LOCAL = Level("local", "closed form along the bed line", {"protocol.method": "local"})
"""A level without grains, for beds that have too many: its error is that of pivots."""


def level(part: str, name: str) -> Level:
    """A level by its name."""
    return next(level for level in LEVELS[part] if level.name == name)


def pair_of(scene: Scene) -> Pair:
    """The levels that a pile is on as it is asked; `AS_ASKED` where it is on none."""
    on = (
        [level for level in levels if level.describes(scene)]
        for levels in LEVELS.values()
    )
    flow, grains = (levels[-1] if levels else AS_ASKED for levels in on)
    return Pair(flow, LOCAL if LOCAL.describes(scene) else grains)


class Known(NamedTuple):
    """Known relative error of tau_c against the reference, of a pair of levels.

    With the change of the reference itself when its numbers were changed; mean times, core-s.
    """

    error: float
    uncertainty: float
    flow_s: float
    grains_s: float

    @property
    def cost_core_s(self) -> float:
        """Mean time of a scene that shares its flow with no other, s."""
        return self.flow_s + self.grains_s

    @property
    def total(self) -> float:
        """Error and uncertainty together: the root of the sum of their squares."""
        return math.hypot(self.error, self.uncertainty)


UNKNOWN = Known(math.inf, 0.0, math.inf, 0.0)
UNBOUND = 10.0  # a level that was off by so many times a threshold says nothing of it


class Spread(NamedTuple):
    """How far the choices of all levels lower and raise a Shields number, relative; the widest.

    Last how far a bed that changes moves the number at most.
    """

    low: float = math.nan
    high: float = math.nan
    dominant: str = ""
    frozen_bed: float = math.nan


def scene_class(part: str, scene: Scene, *, obstacles: bool = True) -> str:
    """The class under which the known error of a level is measured on a scene.

    For the flow it names how the stress is read and what is above the bed, for the grains their
    packing, and whether lift takes them off before they roll; both name the form, the limiting
    slope, and obstacles, unless these are left out.
    """
    bed, name = scene.bed, packing(scene)
    assert isinstance(bed, PileBed)
    if part == "flow":
        if bed.is_level:
            return LEVEL_BED
        name = scene.forces.stress + (
            "" if scene.flow.top == "boundary layer" else ", channel"
        )
    elif name == "disordered":
        name = f"disordered up to {next(end for end in DISORDERS if bed.disorder <= end):g} d"
    if part == "grains" and _lift(scene) > 1:
        name += ", lifted"
    if bed.is_triangle:
        return name + (LIMITING if scene.limiting_slope_deg - bed.slope_deg < 1 else "")
    if bed.obstacles and obstacles:
        return f"{name}, obstacles"
    if bed.shape == "flat" and not bed.profile:
        return f"{name}, flat"
    # on a curved bed a row has no edge where it could begin to leave, on straight faces it has
    rounded = bed.profile or bed.brink_radius or bed.windward == "curved"
    curved = rounded or bed.shape in ("cosine", "gaussian", "rushil")
    return name + (", curved forms" if curved else ", straight forms")


def classes(part: str, scene: Scene) -> tuple[str, ...]:
    """The measured classes that a scene belongs to; its known error is the largest of theirs.

    A slope between those that were measured belongs to both of its neighbours, and so do level rows
    on any slope: which grain of a chain goes first is chaotic.
    """
    bed, name = scene.bed, scene_class(part, scene)
    assert isinstance(bed, PileBed)
    base, below_deg = (
        name.removesuffix(LIMITING),
        scene.limiting_slope_deg - bed.slope_deg,
    )
    if bed.is_triangle and (1 <= below_deg < BETWEEN_DEG or base == "horizontal"):
        return base, base + LIMITING
    return (
        (name, scene_class(part, scene, obstacles=False)) if bed.obstacles else (name,)
    )


def _lift(scene: Scene) -> float:
    """Lift over the weight normal to the bed when a grain would roll: above 1 it is gone before."""
    normal = scene.weight * math.cos(math.radians(scene.bed.slope_deg))
    return float(closed_form(scene).lift) / normal


def unmeasured(scene: Scene) -> str:
    """The property of a pile for which no level was measured, in words; empty if there is none."""
    if (lift := _lift(scene)) > LIFTED_TO:
        return f"a lift of {lift:.3g} times the weight normal to the bed"
    if scene.flow.gusts:
        return f"flow.gusts = {scene.flow.gusts}"
    solved, roughness = scene.flow.model == "solve", scene.flow.roughness
    for name, default in DEFAULTS.items():
        value = value_of(scene, name)
        other = value < default if name in AT_LEAST else value != default
        if other and (solved or not name.startswith("flow.")):
            return f"{name} = {value}"
    if solved:
        assert isinstance(scene.bed, PileBed)
        default = default_first_cell_height(scene.bed.relief, scene.solve_roughness)
        if abs(scene.first_cell_height / default - 1) > SAME_CELL:
            return f"first cells of {scene.first_cell_height:.3g} m in place of {default:.3g} m"
    near = (scene.bed.roughness, outer_roughness(scene) or scene.bed.roughness)
    if roughness and all(abs(math.log2(roughness / z0)) > 0.5 + 1e-6 for z0 in near):
        return f"flow.roughness = {roughness:.3g} m"
    return ""


def known(pair: Pair, scene: Scene) -> Known:
    """Known error of a pair of levels on a pile, at the fraction where it is largest.

    Errors and uncertainties of both parts add up by their squares (docs/ladder.md). A scene that is
    on no level has the error of the most expensive one that is no finer; `UNKNOWN` if not measured.
    """
    if unmeasured(scene):
        return UNKNOWN
    levels = [PIVOT if each is LOCAL else each for each in pair]
    for place, part in enumerate(LEVELS):
        if levels[place] is AS_ASKED:
            levels[place] = _coarser(part, scene)
    return known_of_classes(*levels, classes("flow", scene), classes("grains", scene))


def _coarser(part: str, scene: Scene) -> Level:
    """The most expensive level that is no finer than a scene and was measured; or `AS_ASKED`."""
    for one in LEVELS[part][::-1]:
        is_known = all(
            (part, one.name, name) in measured() for name in classes(part, scene)
        )
        if one.same_model and is_known and one.describes(scene, or_finer=True):
            return one
    return AS_ASKED


@cache  # a study has thousands of scenes of a few classes
def known_of_classes(
    flow: Level,
    grains: Level,
    flow_classes: tuple[str, ...],
    grain_classes: tuple[str, ...],
) -> Known:
    """Known error of two levels on scenes of some classes; unknown where it has no bound."""
    exact = flow is FLAT and flow_classes == (LEVEL_BED,)
    keys = [] if exact else [[("flow", flow.name, name) for name in flow_classes]]
    keys.append([("grains", grains.name, name) for name in grain_classes])
    table = measured()
    if not all(key in table for part in keys for key in part):
        return UNKNOWN
    # of several classes the worst; then both parts at each fraction, and the worst fraction
    parts = [np.max([table[key] for key in part], axis=0) for part in keys]
    error, uncertainty = (
        np.sqrt(sum(part[row] ** 2 for part in parts)) for row in (0, 1)
    )
    worst = int(np.argmax(np.hypot(error, uncertainty)))
    costs = [0.0] * exact + [float(part[2, 0]) for part in parts]
    known = Known(float(error[worst]), float(uncertainty[worst]), *costs)
    return known if known.total < UNBOUND else UNKNOWN


@cache
def measured() -> dict[tuple[str, str, str], FloatArray]:
    """The measured errors, by part, name of the level and class of scene.

    Each is an array with the rows error, uncertainty and cost (core-s), a column for each fraction.
    """
    table = pd.read_csv(FOLDER / "levels.csv").sort_values("fraction")
    groups = table.groupby(["part", "level", "scene_class"])[
        ["error", "uncertainty", "cost_core_s"]
    ]
    return {key: rows.to_numpy(float).T for key, rows in groups}  # type: ignore[misc]


def model_class(scene: Scene) -> str:
    """The class of scenes on which the choices common to all levels have the same effect."""
    bed, reynolds = scene.bed, float(closed_form(scene).reynolds)
    assert isinstance(bed, PileBed)
    regime = (
        "viscous"
        if reynolds < VISCOUS
        else "transitional"
        if reynolds < ROUGH
        else "rough"
    )
    shape = "" if bed.is_triangle else f", {'profile' if bed.profile else bed.shape}"
    return f"{bed.packing}, {regime}{shape}"


def spread(scene: Scene, fraction: float) -> Spread:
    """The spread of the threshold of a pile at a fraction of its grains; NaN where not known.

    What the frozen bed does is the largest of the scenes of the class; it is not known of a bed
    that changes already, nor of a flow that is not solved.
    """
    of_class = _spread(model_class(scene), fraction)
    if scene.protocol.update or scene.flow.model != "solve":
        return of_class._replace(frozen_bed=math.nan)
    return of_class


@cache
def _spread(model: str, fraction: float) -> Spread:
    """The spread of a class, at the measured fraction that is nearest."""
    rows = _budget().query("model_class == @model").set_index("choice")
    apart = (rows["fraction"] - fraction).abs()
    shares = rows.loc[apart == apart.min(), ["shields_low", "shields_high"]]
    if shares.empty:
        return Spread()
    frozen_bed = float(shares.max(axis=1).get(FROZEN, math.nan))
    return Spread(*together(shares), str(shares.sum(axis=1).idxmax()), frozen_bed)


def together(shares: pd.DataFrame, quantity: str = "shields") -> tuple[float, float]:
    """Shares of independent choices as one, down and up: the root of the sum of their squares.

    Nothing falls below zero, however many choices lower it.
    """
    low, high = (
        float(np.hypot.reduce(shares[f"{quantity}_{end}"])) for end in ("low", "high")
    )
    return min(low, 1.0), high


@cache
def floors() -> dict[str, float]:
    """Relative error below which the model's uncertainty hides the numerics, by class of scene.

    Half the interval of the choices that no study file states, the smallest over the fractions.
    """
    unstated = _budget()[~_budget()["choice"].isin(STATED)]
    groups = unstated.groupby(["model_class", "fraction"])
    halves = pd.Series({key: sum(together(part)) / 2 for key, part in groups})
    return {
        str(model): float(half) for model, half in halves.groupby(level=0).min().items()
    }


@cache
def _budget() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "budget.csv")
