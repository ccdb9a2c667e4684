"""Where the methods hold: what a study refuses, and what it is warned of.

Each limit was read off a map of `orchestrator stability`, which runs scenes beyond it; the map's
table lies in ``calibration/maps.csv``.
"""

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from orchestrator.bed.cover import counted_segments
from orchestrator.bed.shapes import of_bed
from orchestrator.errors import InputError
from orchestrator.fidelity import spread
from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.flow.model import model
from orchestrator.flow.stress import undisturbed_ustar
from orchestrator.flow.theory import half_length, seen_by_the_flow
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.physics.constants import KARMAN
from orchestrator.study.parts import PileBed, UnfitError
from orchestrator.study.scene import MOST_GRAINS, Scene
from orchestrator.study.study import Study


@dataclass(frozen=True)
class Limit:
    """One limit of a method.

    Attributes
    ----------
    map : str
        Name of the map that shows it.
    field : str
        The field of a study file to change.
    beyond : callable
        What is wrong with a scene, or nothing.
    says : str
        The limit in a sentence.
    remedy : str
        What would do.
    refused : bool
        Whether a study is refused; else it is warned.
    """

    map: str
    field: str
    beyond: Callable[[Scene], str | None]
    says: str
    remedy: str
    refused: bool = True


def check_study(study: Study) -> None:
    """Check every scene of a study as `check` does; messages name the file and the group."""
    for group in study.groups:
        for scene in group.scenes:
            check(scene, group.where)


def check(scene: Scene, where: str) -> None:
    """Refuse a scene outside of the regions in which its answer means something.

    Where the answer is merely worse, a warning is given. `where` names the scene's file.

    Raises
    ------
    InputError
        For the first limit that it is beyond: the field, the map and the remedy.
    """
    for limit in LIMITS:
        if what := limit.beyond(scene):
            remedy = f"{limit.remedy}; map “{limit.map}” of `orchestrator stability`"
            if limit.refused:
                raise InputError(what, where=f"{where}: {limit.field}", remedy=remedy)
            warnings.warn(f"{limit.field}: {what} ({remedy})", stacklevel=2)
    if _pile(scene):
        try:
            _ = model(scene).cases  # a mesh that cannot be made is refused before anything runs
        except InputError as error:
            raise InputError(
                error.what, where=f"{where}: {error.where}", remedy=error.remedy
            ) from None


def of_map(name: str) -> Iterator[Limit]:
    """The limits that were read off a map."""
    return (limit for limit in LIMITS if limit.map == name)


def _pile(scene: Scene) -> PileBed | None:
    return scene.bed if isinstance(scene.bed, PileBed) else None


def _solved(scene: Scene) -> PileBed | None:
    return _pile(scene) if scene.flow.model == "solve" else None


def _slope(scene: Scene) -> str | None:
    slope, limit = scene.bed.slope_deg, scene.limiting_slope_deg
    bed = _pile(scene)
    if slope <= limit + 1e-9 or (bed and not bed.is_wedge):
        return None
    return (
        f"{slope:g} deg is beyond min(friction angle, 90 deg - entrainment angle) = {limit:g} deg"
    )


def _pile_slope(scene: Scene) -> str | None:
    bed, (low, high) = _pile(scene), PILE_SLOPES_DEG
    if not bed or not bed.is_wedge:
        return None
    return None if low <= bed.slope_deg <= high else f"a pile of {bed.slope_deg:g} deg"


def _bed_line(scene: Scene) -> str | None:
    """A fault of the bed line, if there is one."""
    if not (bed := _pile(scene)):
        return None
    try:
        line = of_bed(bed)
        if bed.packing == "poured" and bed.obstacles:
            return "no grains can be poured around obstacles"
        length = line.x[-2] - line.x[1]
        if length > MOST_GRAINS * scene.grain.diameter:
            count = length / scene.grain.diameter
            return f"{length:g} m of bed are {count:.3g} grains, more than {MOST_GRAINS:g}"
        if not bed.is_wedge and bed.packing != "poured":
            _ = LoadedBed(scene).packing
    except UnfitError as error:
        return str(error)
    limit = scene.limiting_slope_deg
    slopes = np.where(counted_segments(line, bed.counts), np.abs(line.slopes_deg), 0.0)
    for start, end in line.bare:
        slopes[(np.array(line.x[1:]) > start) & (np.array(line.x[:-1]) < end)] = 0.0
    steep = int(np.argmax(slopes))
    if bed.is_wedge or bed.packing == "poured" or slopes[steep] <= limit + 1e-6:
        return None
    where = f"{slopes[steep]:.3g} deg at x = {line.x[steep]:.4g} ... {line.x[steep + 1]:.4g} m"
    return f"{where} is beyond min(friction angle, 90 deg - entrainment angle) = {limit:g} deg"


def _theory(scene: Scene) -> str | None:
    bed = _pile(scene)
    if not bed or scene.flow.model not in THEORIES:
        return None
    try:
        seen = seen_by_the_flow(of_bed(bed))
    except UnfitError:  # said elsewhere
        return None
    steep = int(np.argmax(seen.slopes))
    slope = float(np.degrees(np.arctan(seen.slopes[steep])))
    if slope <= PILE_SLOPES_DEG[1] + 1e-6:
        return None
    return f"a bed that rises by {slope:.3g} deg at x = {seen.x[steep]:.4g} m is no low one"


def _hill(scene: Scene) -> str | None:
    bed = _pile(scene)
    if not bed or scene.flow.model != "hill" or _bed_line(scene):
        return None
    if half_length(of_bed(bed)) is not None:
        return None
    return "the bed does not fall to half of its height before and behind its top"


def _flat(scene: Scene) -> str | None:
    bed = _solved(scene)
    level = bed and bed.is_level
    return "over a flat bed there is nothing to solve: u* is u*_0 everywhere" if level else None


def _first_cell(scene: Scene) -> str | None:
    if not _solved(scene) or scene.solve_roughness <= scene.first_cell_height:
        return None
    return (
        f"z0 = {scene.solve_roughness:g} m is above twice z_e ="
        f" {scene.first_cell_height / 2:g} m, the height of the first cell's centre"
    )


def _laminar(scene: Scene) -> str | None:
    bed = _solved(scene)
    if not bed:
        return None
    ustar0 = undisturbed_ustar(scene.flow.speed, SPEED_HEIGHT * bed.relief, scene.solve_roughness)
    ratio = KARMAN * ustar0 * scene.first_cell_height / 2 / scene.solve_viscosity
    if ratio >= 1:
        return None
    return (
        "the flow at the bed is not turbulent: in the first cell the eddy viscosity is "
        f"{ratio:.2g} of the molecular one"
    )


def _timestep(scene: Scene) -> str | None:
    if scene.protocol.method != "dem":
        return None
    most = largest_timestep(scene.grain.damping)
    step = scene.protocol.time_step
    if step <= most:
        return None
    return f"{step:g} sqrt(m/K) is above {most:g} at a damping of {scene.grain.damping:g}"


def largest_timestep(damping: float) -> float:
    """The largest safe time step at a damping ratio, sqrt(m/K)."""
    return next(step for least, step in TIMESTEPS if damping <= least)


def _undamped(scene: Scene) -> str | None:
    if scene.protocol.method != "dem" or scene.grain.damping >= LEAST_DAMPING:
        return None
    return f"at a damping of {scene.grain.damping:g} a bed does not come to rest"


def _ramp(scene: Scene) -> str | None:
    rules = scene.protocol
    if not _pile(scene) or rules.method != "dem" or rules.waiting_time >= WAITING_TIME:
        return None
    waited = f"load steps that wait {rules.waiting_time:g} sqrt(d/g')"
    return f"{waited} end before slow grains pass: it is a ramp"


def _coarse(scene: Scene) -> str | None:
    step = scene.protocol.load_increment
    if not _pile(scene) or scene.protocol.method != "dem" or step <= COARSE_STEP:
        return None
    return f"load steps {step:.0%} apart leave the threshold that wide an interval"


def _wedged(scene: Scene) -> str | None:
    bed = _pile(scene)
    if not bed or bed.entrainment_angle_deg >= CLOSE_PACKED_DEG:
        return None
    return (
        f"a pile of {bed.entrainment_angle_deg:g} deg: the grains of a row do not touch, those"
        " under the gaps are exposed too, and a mobile row is wedged apart by the one on it"
    )


def _forced(scene: Scene) -> str | None:
    if not _pile(scene) or scene.forces.loaded_grains == "exposed":
        return None
    return f"{scene.forces.loaded_grains}: a grain without its force blocks those behind it"


def _scheme(scene: Scene) -> str | None:
    if not _solved(scene) or scene.flow.convection_scheme == "linearUpwind":
        return None
    return f"{scene.flow.convection_scheme} does not converge to the same answer, or not at all"


def frozen_bed(scene: Scene, fraction: float) -> float:
    """How far the threshold is known to move on a bed that changes, relative; NaN if not known.

    The largest over the scenes of the class: of one packing, on a smooth, transitional or rough
    bed. A scene whose bed changes has no frozen one, and neither has a flow that is not solved.
    """
    if scene.protocol.update or not _solved(scene):
        return math.nan
    return spread.of_choice(scene, fraction, spread.FROZEN)


FROZEN_BED = 0.05
"""Known change of a threshold, relative, up to which the flow of the whole pile may act on."""
PILE_SLOPES_DEG = (10.0, 35.0)
"""Slopes of piles that the mesh and the packing have been tried for."""
THEORIES = ("hill", "waves")
TIMESTEPS = ((0.1, 0.4), (0.3, 0.2), (0.6, 0.1), (1.0, 0.05))
"""Damping ratio, and the largest safe time step up to it."""
LEAST_DAMPING = 0.03
WAITING_TIME = 3.0
"""Least time without a passage, sqrt(d/g')."""
COARSE_STEP = 0.05
CLOSE_PACKED_DEG = 59.0
"""Entrainment angle from which the grains of a row hold each other."""

LIMITS = (
    Limit(
        "slope",
        "bed",
        _bed_line,
        "Forms and obstacles do not overlap; no counted place is beyond the limiting slope.",
        "smooth a profile, give forms room, or count another part of the bed",
    ),
    Limit(
        "slope",
        "bed.slope_deg",
        _slope,
        "Beyond min(phi, 90 deg - beta) a bed rolls back without any flow: refused.",
        "a steeper bed rolls back without any flow: lower the slope or the entrainment angle",
    ),
    Limit(
        "slope",
        "bed.slope_deg",
        _pile_slope,
        "Piles of 10 to 35 deg: others are refused.",
        f"choose {PILE_SLOPES_DEG[0]:g} ... {PILE_SLOPES_DEG[1]:g} deg, and no more than"
        " min(friction angle, 90 deg - entrainment angle)",
    ),
    Limit(
        "slope",
        "flow.model",
        _theory,
        f"The linear theories are of beds that rise by {PILE_SLOPES_DEG[1]:g} deg at most.",
        'choose "solve"',
    ),
    Limit(
        "slope",
        "flow.model",
        _hill,
        "The theory of a hill is of beds that fall to half of their height before and behind.",
        'choose "waves" or "solve"',
    ),
    Limit(
        "slope",
        "flow.model",
        _flat,
        "The flow over a flat bed is not solved.",
        'choose "flat"',
    ),
    Limit(
        "first-cell",
        "bed.roughness",
        _first_cell,
        "z_e, half the first cell, is at least z0/2: refused below; from z0 on it is sound.",
        "lower it, or raise flow.first_cell_height or bed.height; z_e of z0 is sound",
    ),
    Limit(
        "similarity",
        "flow.viscosity",
        _laminar,
        "In the first cell the eddy viscosity is above the molecular one: refused below.",
        "take the field of a lower viscosity or a higher speed: u*/U_e is the same",
    ),
    Limit(
        "timestep-damping",
        "protocol.time_step",
        _timestep,
        "The largest safe time step falls with the damping: "
        + ", ".join(f"{step:g} up to {damping:g}" for damping, step in TIMESTEPS)
        + " sqrt(m/K); refused above.",
        "lower it, or the damping",
    ),
    Limit(
        "timestep-damping",
        "grain.damping",
        _undamped,
        f"Without damping a bed never rests: refused below {LEAST_DAMPING:g}.",
        "0.1 is sound",
    ),
    Limit(
        "entrainment-layers",
        "bed.entrainment_angle_deg",
        _wedged,
        f"Piles have rows that touch: refused below {CLOSE_PACKED_DEG:g} deg.",
        "60 deg; single grains may have less",
    ),
    Limit(
        "quiet-step",
        "protocol.waiting_time",
        _ramp,
        f"A pile's load step waits for at least {WAITING_TIME:g} sqrt(d/g'): a warning below.",
        "raise it, unless a ramp is what you want",
        refused=False,
    ),
    Limit(
        "quiet-step",
        "protocol.load_increment",
        _coarse,
        "A pile's load steps are at most 5 % apart: a warning above.",
        "lower it",
        refused=False,
    ),
    Limit(
        "forced",
        "forces.loaded_grains",
        _forced,
        "Every exposed grain carries a force: a warning otherwise.",
        "exposed",
        refused=False,
    ),
    Limit(
        "mesh-scheme-15",
        "flow.convection_scheme",
        _scheme,
        "linearUpwind alone converges to the answer: a warning otherwise.",
        "linearUpwind",
        refused=False,
    ),
)
