"""Known errors of the fidelity levels and the spread of the model, by class of scene.

The numbers are tables beside this module: ``levels.csv`` holds what ``orchestrator ladder``
measured against the most expensive levels, ``budget.csv`` what ``orchestrator budget`` measured of
the choices that all levels share, ``maps.csv`` what ``orchestrator stability`` found.
"""

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.fidelity.levels import AS_ASKED, FLAT, LEVELS, Level, Pair, packing, value_of
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import Flow, Forces, PileBed, Protocol
from orchestrator.study.scene import Scene, default_first_cell_height
from orchestrator.types import FloatArray

FOLDER = Path(__file__).parent
DISORDERS = (0.02, 0.05, 0.2)
"""Ends of the ranges of disorder that share their known errors, d."""
VISCOUS, ROUGH = 3.0, 30.0
"""Re* below which a bed is hydraulically smooth, and from which it is rough."""
LIFT_OFF = 0.95
"""Lift over the weight at a grain's own threshold from which it lifts off before it rolls: of the
piles of the preset `paper` those below 0.93 roll, those above 0.98 are carried off."""
LEVEL_BED, LIMITING = "level bed", ", limiting slope"
"""The class for the flow of beds over which u* is u*_0 everywhere; the end of a class's name."""
BETWEEN_DEG = 5.0
"""Degrees below the limiting slope from which slopes were measured as below it."""
DEFAULTS = {
    f"{part}.{name}": kind.model_fields[name].default
    for part, kind, names in (
        ("flow", Flow, ("turbulence_model", "convection_scheme", "lid", "upstream", "downstream")),
        ("forces", Forces, ("averaging_length", "loaded_grains", "exposure")),
        ("protocol", Protocol, ("displacement_criterion",)),
    )
    for name in names
}
"""Fields that move an answer and that the ladder keeps at their defaults."""
AT_LEAST = ("flow.lid", "flow.upstream", "flow.downstream")
SAME_CELL = 0.02
"""Relative difference from the default height of the first cell that changes no known error."""
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
    """How far the choices of all levels lower and raise a Shields number, and the widest of them.

    Relative; NaN and an empty name where nothing is known.
    """

    low: float
    high: float
    dominant: str


def scene_class(part: str, scene: Scene, *, obstacles: bool = True) -> str:
    """The class under which the known error of a level is measured on a scene.

    The class for the flow names how the stress is read and what is above the water; the class for
    the grains names their packing. Both name the form, and the limiting slope, on which a row
    waits for a touch; or that there are obstacles, unless these are left out.
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

    A slope between those that were measured belongs to both of its neighbours. So do level rows on
    any slope: which grain of a chain goes first is chaotic, and no slope is known better than
    another. A form with obstacles has the errors of both.
    """
    bed, name = scene.bed, scene_class(part, scene)
    assert isinstance(bed, PileBed)
    base = name.removesuffix(LIMITING)
    between = 1 <= scene.limiting_slope_deg - bed.slope_deg < BETWEEN_DEG
    if bed.is_triangle and (between or base == "horizontal"):
        return base, base + LIMITING
    if bed.obstacles:
        return name, scene_class(part, scene, obstacles=False)
    return (name,)


def unmeasured(scene: Scene) -> str:
    """The property of a pile for which no level was measured, in words; empty if there is none.

    A known error holds for the settings at which it was measured.
    """
    if float(closed_form(scene).lift) >= LIFT_OFF * scene.weight:
        return "lift that carries grains off before they roll"
    solved, roughness = scene.flow.model == "solve", scene.flow.roughness
    for name, default in DEFAULTS.items():
        value = value_of(scene, name)
        other = value < default if name in AT_LEAST else value != default
        if other and (solved or not name.startswith("flow.")):
            return f"{name} = {value:.4g}" if isinstance(value, float) else f"{name} = {value}"
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

    Errors and uncertainties of the two parts have a cause each and add up by their squares;
    docs/ladder.md says how often the sum holds. Numbers of a study file that are on no level have
    the error of the most expensive level that is no finer than they are. `UNKNOWN` where it was not
    measured.
    """
    if unmeasured(scene):
        return UNKNOWN
    levels = list(pair)
    for place, part in enumerate(LEVELS.values()):
        if levels[place] is AS_ASKED:
            coarser = (
                x for x in reversed(part) if x.same_model and x.describes(scene, or_finer=True)
            )
            levels[place] = next(coarser, AS_ASKED)
    return known_of_classes(*levels, classes("flow", scene), classes("grains", scene))


@cache  # a study has thousands of scenes of a few classes
def known_of_classes(
    flow: Level, grains: Level, flow_classes: tuple[str, ...], grain_classes: tuple[str, ...]
) -> Known:
    """Known error of two levels on scenes of some classes; arguments as in `known`."""
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
    """The class of scenes that share what the choices common to all levels do to a threshold."""
    bed, reynolds = scene.bed, float(closed_form(scene).reynolds)
    assert isinstance(bed, PileBed)
    regime = "viscous" if reynolds < VISCOUS else "transitional" if reynolds < ROUGH else "rough"
    shape = "" if bed.is_triangle else f", {'profile' if bed.profile else bed.shape}"
    return f"{bed.packing}, {regime}{shape}"


def spread(scene: Scene, fraction: float) -> Spread:
    """The spread of the threshold of a pile at a fraction of its grains."""
    return _spread(model_class(scene), fraction)


@cache
def _spread(model: str, fraction: float) -> Spread:
    shares = _shares(model, fraction)
    if shares.empty:
        return Spread(math.nan, math.nan, "")
    widest = (shares["shields_low"] + shares["shields_high"]).to_numpy().argmax()
    return Spread(*together(shares), str(shares["choice"].iloc[int(widest)]))


def together(shares: pd.DataFrame, quantity: str = "shields") -> tuple[float, float]:
    """Shares of independent choices as one, down and up: the root of the sum of their squares.

    Nothing falls below zero, however many choices lower it.
    """
    low, high = (float(np.hypot.reduce(shares[f"{quantity}_{end}"])) for end in ("low", "high"))
    return min(low, 1.0), high


def frozen_bed(scene: Scene, fraction: float) -> float:
    """How far a threshold is known to move on a bed that changes, relative; NaN if not known.

    The largest over the scenes of the class: of one packing, on a smooth, transitional or rough
    bed. It is not known of a bed that changes already, nor of a flow that is not solved.
    """
    if scene.protocol.update or scene.flow.model != "solve":
        return math.nan
    return _frozen_bed(model_class(scene), fraction)


@cache
def _frozen_bed(model: str, fraction: float) -> float:
    shares = _shares(model, fraction)
    ends = shares.loc[shares["choice"] == FROZEN, ["shields_low", "shields_high"]]
    return math.nan if ends.empty else float(ends.to_numpy().max())


@cache
def _shares(model: str, fraction: float) -> pd.DataFrame:
    """The shares of a class at the measured fraction that is nearest."""
    rows = _budget()[_budget()["model_class"] == model]
    apart = (rows["fraction"] - fraction).abs()
    nearest: pd.DataFrame = rows[apart == apart.min()]
    return nearest


@cache
def floor(model: str) -> float:
    """Half the interval of the model's choices, of scenes of a class whose file's values are sure.

    It is relative, the smallest over the fractions; NaN if not known. Below it, an error of the
    numerics is hidden by the uncertainty of the model.
    """
    rows = _budget()[(_budget()["model_class"] == model) & ~_budget()["choice"].isin(STATED)]
    return min((sum(together(part)) / 2 for _, part in rows.groupby("fraction")), default=math.nan)


@cache
def lowest_floor() -> float:
    """The smallest floor of all measured classes, relative."""
    return min(floor(model) for model in _budget()["model_class"].unique())


@cache
def _budget() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "budget.csv")
