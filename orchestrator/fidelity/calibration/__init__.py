"""Known errors of the fidelity levels and the spread of the model, by class of scene.

The tables beside this module hold what was measured: ``levels.csv`` by `orchestrator ladder`,
``budget.csv`` by `orchestrator budget`, ``maps.csv`` by `orchestrator stability`.
"""

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.fidelity.levels import AS_ASKED, FLAT, LEVELS, Level, Pair, packing, value_of
from orchestrator.study.closed_form import closed_form
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene, default_first_cell_height
from orchestrator.types import FloatArray

FOLDER = Path(__file__).parent
DISORDERS = (0.02, 0.05, 0.2)  # ends of the ranges of disorder that share their known errors, d
VISCOUS, ROUGH = 3.0, 30.0  # Re* below which a bed is smooth, and from which it is rough
LIFT_OFF = 0.95
"""Lift over the weight at a grain's own threshold from which it lifts off before it rolls: of the
piles of the preset `paper` those below 0.93 roll, those above 0.98 are carried off."""
LEVEL_BED, LIMITING = "level bed", ", limiting slope"
"""The class for the flow of beds over which u* is u*_0 everywhere; the end of a class's name."""
BETWEEN_DEG = 5.0  # below the limiting slope, from which slopes were measured as below it
AT_LEAST = ("flow.lid", "flow.upstream", "flow.downstream")
SETTINGS = (
    *(*AT_LEAST, "flow.turbulence_model", "flow.convection_scheme", "forces.averaging_length"),
    *("forces.loaded_grains", "forces.exposure", "protocol.displacement_criterion"),
)
DEFAULTS = {
    f"{part}.{name}": field.default
    for part, model in PARTS.items()
    for name, field in model.model_fields.items()
    if f"{part}.{name}" in SETTINGS
}
"""Fields that move an answer and that the ladder keeps at their defaults; those of `AT_LEAST` may
be larger."""
SAME_CELL = 0.02  # relative difference of the first cell that changes no known error
FROZEN = "frozen bed"
"""The choice that the flow of the whole pile acts until the last grain has gone."""
STATED = ("packing", "roughness length", "entrainment angle", "friction angle", "lift coefficient")
"""Choices whose values a study file states."""


class Known(NamedTuple):
    """Known relative error of tau_c against the reference, of a pair of levels.

    The uncertainty is how far the reference itself moved when its numbers were changed, the times
    are the measured means of a scene on one core, s.
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


class Spread(NamedTuple):
    """How far the choices that all levels share lower and raise a Shields number, relative.

    With the name of the widest choice, and how far a bed that changes moves the number at most.
    """

    low: float = math.nan
    high: float = math.nan
    dominant: str = ""
    frozen_bed: float = math.nan


def scene_class(part: str, scene: Scene, *, obstacles: bool = True) -> str:
    """The class under which the known error of a level is measured on a scene.

    The class for the flow names how the stress is read and what is above the water; the class for
    the grains names their packing. Both name the form, the limiting slope, on which a row waits for
    a touch, and obstacles, unless these are left out.
    """
    bed, name = scene.bed, packing(scene)
    assert isinstance(bed, PileBed)
    if part == "flow":
        if bed.is_level:
            return LEVEL_BED
        name = scene.forces.stress + ("" if scene.flow.top == "boundary layer" else ", channel")
    elif name == "disordered":
        name = f"disordered up to {next(end for end in DISORDERS if bed.disorder <= end):g} d"
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
    on any slope: which grain of a chain goes first is chaotic. A form with obstacles has the errors
    of both.
    """
    bed, name = scene.bed, scene_class(part, scene)
    assert isinstance(bed, PileBed)
    base = name.removesuffix(LIMITING)
    between = 1 <= scene.limiting_slope_deg - bed.slope_deg < BETWEEN_DEG
    if bed.is_triangle and (between or base == "horizontal"):
        return base, base + LIMITING
    return (name, scene_class(part, scene, obstacles=False)) if bed.obstacles else (name,)


def unmeasured(scene: Scene) -> str:
    """The property of a pile for which no level was measured, in words; empty if there is none."""
    if float(closed_form(scene).lift) >= LIFT_OFF * scene.weight:
        return "lift that carries grains off before they roll"
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
    if roughness and abs(math.log2(roughness / scene.bed.roughness)) > 0.5 + 1e-6:
        return f"flow.roughness = {roughness:.3g} m"
    return ""


def known(pair: Pair, scene: Scene) -> Known:
    """Known error of a pair of levels on a pile, at the fraction where it is largest.

    Errors and uncertainties of the two parts have a cause each and add up by their squares
    (docs/ladder.md). A study file that is on no level has the error of the most expensive level
    that is no finer. `UNKNOWN` where it was not measured.
    """
    if unmeasured(scene):
        return UNKNOWN
    levels = list(pair)
    for place, part in enumerate(LEVELS.values()):
        if levels[place] is AS_ASKED:
            coarser = (x for x in part[::-1] if x.same_model and x.describes(scene, or_finer=True))
            levels[place] = next(coarser, AS_ASKED)
    return known_of_classes(*levels, classes("flow", scene), classes("grains", scene))


@cache  # a study has thousands of scenes of a few classes
def known_of_classes(
    flow: Level, grains: Level, flow_classes: tuple[str, ...], grain_classes: tuple[str, ...]
) -> Known:
    """Known error of two levels on scenes of some classes."""
    exact = flow is FLAT and flow_classes == (LEVEL_BED,)
    keys = [] if exact else [[("flow", flow.name, name) for name in flow_classes]]
    keys.append([("grains", grains.name, name) for name in grain_classes])
    table = measured()
    if not all(key in table for part in keys for key in part):
        return UNKNOWN
    # of several classes the worst; then both parts at each fraction, and the worst fraction
    parts = [np.max([table[key] for key in part], axis=0) for part in keys]
    error, uncertainty = (np.sqrt(sum(part[row] ** 2 for part in parts)) for row in (0, 1))
    worst = int(np.argmax(np.hypot(error, uncertainty)))
    costs = [0.0] * exact + [float(part[2, 0]) for part in parts]
    return Known(float(error[worst]), float(uncertainty[worst]), *costs)


@cache
def measured() -> dict[tuple[str, str, str], FloatArray]:
    """The measured errors, by part, name of the level and class of scene.

    Each is an array with the rows error, uncertainty and cost (core-s), a column for each fraction.
    """
    table = pd.read_csv(FOLDER / "levels.csv").sort_values("fraction")
    numbers = ["error", "uncertainty", "cost_core_s"]
    groups = table.groupby(["part", "level", "scene_class"])
    return {key: rows[numbers].to_numpy(float).T for key, rows in groups}  # type: ignore[misc]


def model_class(scene: Scene) -> str:
    """The class of scenes on which the choices common to all levels have the same effect."""
    bed, reynolds = scene.bed, float(closed_form(scene).reynolds)
    assert isinstance(bed, PileBed)
    regime = "viscous" if reynolds < VISCOUS else "transitional" if reynolds < ROUGH else "rough"
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
    low, high = (float(np.hypot.reduce(shares[f"{quantity}_{end}"])) for end in ("low", "high"))
    return min(low, 1.0), high


@cache
def floors() -> dict[str, float]:
    """Relative error below which the model's uncertainty hides the numerics, by class of scene.

    Half the interval of the choices that no study file states, the smallest over the fractions.
    """
    unstated = _budget()[~_budget()["choice"].isin(STATED)]
    groups = unstated.groupby(["model_class", "fraction"])
    halves = pd.Series({key: sum(together(part)) / 2 for key, part in groups})
    return {str(model): float(half) for model, half in halves.groupby(level=0).min().items()}


@cache
def _budget() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "budget.csv")
