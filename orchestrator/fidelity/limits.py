"""Where the methods hold: what a study refuses, and what it is warned of.

Each limit was read off a map of `orchestrator stability`, which runs scenes beyond it; the tables
of the maps lie in ``calibration/maps.csv``.
"""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from orchestrator.bed.line import of_bed
from orchestrator.errors import InputError
from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.flow.model import model
from orchestrator.flow.stress import undisturbed_ustar
from orchestrator.flow.theory import half_length, seen_by_the_flow
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.physics.constants import KARMAN
from orchestrator.study.parts import PileBed, UnfitError
from orchestrator.study.scene import MOST_GRAINS, Scene
from orchestrator.study.study import Study

FROZEN_BED = 0.05
"""Known change of a threshold, relative, up to which the flow of the whole pile may act on."""
PILE_SLOPES_DEG = (10.0, 35.0)
"""Slopes of piles that the mesh and the packing have been tried for."""
TIMESTEPS = ((0.1, 0.4), (0.3, 0.2), (0.6, 0.1), (1.0, 0.05))
"""Largest damping ratio, and the largest safe time step up to it, sqrt(m/K)."""
LEAST_DAMPING = 0.03
WAITING_TIME = 3.0
"""Least time without a passage, sqrt(d/g')."""
COARSE_STEP = 0.05
CLOSE_PACKED_DEG = 59.0
"""Entrainment angle from which the grains of a row hold each other."""


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
        What is wrong with a scene, or None.
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


def largest_timestep(damping: float) -> float:
    """The largest safe time step at a damping ratio, sqrt(m/K)."""
    return next(step for most, step in TIMESTEPS if damping <= most)


def _pile(scene: Scene, *models: str) -> PileBed | None:
    """The bed of a pile, under one of some flow models if they are given."""
    is_pile = isinstance(scene.bed, PileBed) and (not models or scene.flow.model in models)
    return scene.bed if is_pile and isinstance(scene.bed, PileBed) else None


def _dem_pile(scene: Scene) -> bool:
    return isinstance(scene.bed, PileBed) and scene.protocol.method == "dem"


def _bed_line(scene: Scene) -> str | None:
    """A fault of the bed line, or a slope down which its grains roll or slide without a flow.

    A bed that is poured slumps wherever it is too steep, counted or not.
    """
    bed = _pile(scene)
    if not bed:
        return None
    poured, limit = bed.packing == "poured", scene.limiting_slope_deg
    if poured:
        limit = min(scene.grain.friction_angle_deg, PILE_SLOPES_DEG[1])
    try:
        line = of_bed(bed)
        if poured and bed.obstacles:
            return "no grains can be poured around obstacles"
        length = line.x[-2] - line.x[1]
        if length > MOST_GRAINS * scene.grain.diameter:
            count = length / scene.grain.diameter
            return f"{length:g} m of bed are {count:.3g} grains, more than {MOST_GRAINS:g}"
        if not bed.is_wedge and not poured:
            _ = LoadedBed(scene).packing
    except UnfitError as error:
        return str(error)
    if bed.is_wedge and not poured:
        return None
    slopes = np.abs(line.slopes_deg)
    if not poured:
        slopes = np.where(line.counted(bed.counts), slopes, 0.0)
    for start, end in line.bare:
        slopes[(np.array(line.x[1:]) > start) & (np.array(line.x[:-1]) < end)] = 0.0
    steep = int(np.argmax(slopes))
    if slopes[steep] <= limit + 1e-6:
        return None
    where = f"{slopes[steep]:.3g} deg at x = {line.x[steep]:.4g} ... {line.x[steep + 1]:.4g} m"
    if poured:
        return f"{where} is beyond what poured grains hold, min(friction angle, 35 deg) = {limit:g}"
    return f"{where} is beyond min(friction angle, 90 deg - entrainment angle) = {limit:g} deg"


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
    beyond = bed and bed.is_wedge and not low <= bed.slope_deg <= high
    return f"a pile of {scene.bed.slope_deg:g} deg" if beyond else None


def _half_way(scene: Scene) -> str | None:
    slope, angle = scene.bed.slope_deg, scene.bed.entrainment_angle_deg
    if _pile(scene) or slope <= angle:
        return None
    return (
        f"{slope:g} deg is beyond the entrainment angle, {angle:g} deg: a grain may come to rest "
        "half-way over its neighbour, and DEM and the closed form differ by up to a third"
    )


def _theory(scene: Scene) -> str | None:
    bed = _pile(scene, "hill", "waves")
    if not bed:
        return None
    try:
        seen = seen_by_the_flow(of_bed(bed))
    except UnfitError:
        return None  # `_bed_line` refuses it
    steep = int(np.argmax(seen.slopes))
    slope = float(np.degrees(np.arctan(seen.slopes[steep])))
    if slope <= PILE_SLOPES_DEG[1] + 1e-6:
        return None
    return f"a bed that rises by {slope:.3g} deg at x = {seen.x[steep]:.4g} m is no low one"


def _hill(scene: Scene) -> str | None:
    bed = _pile(scene, "hill")
    if not bed or _bed_line(scene) or half_length(of_bed(bed)) is not None:
        return None
    return "the bed does not fall to half of its height before and behind its top"


def _flat(scene: Scene) -> str | None:
    bed = _pile(scene, "solve")
    level = bed and bed.is_level
    return "over a flat bed there is nothing to solve: u* is u*_0 everywhere" if level else None


def _first_cell(scene: Scene) -> str | None:
    if not _pile(scene, "solve") or scene.solve_roughness <= scene.first_cell_height:
        return None
    return (
        f"z0 = {scene.solve_roughness:g} m is above twice z_e ="
        f" {scene.first_cell_height / 2:g} m, the height of the first cell's centre"
    )


def _laminar(scene: Scene) -> str | None:
    bed = _pile(scene, "solve")
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
    step, most = scene.protocol.time_step, largest_timestep(scene.grain.damping)
    if scene.protocol.method != "dem" or step <= most:
        return None
    return f"{step:g} sqrt(m/K) is above {most:g} at a damping of {scene.grain.damping:g}"


def _undamped(scene: Scene) -> str | None:
    if scene.protocol.method != "dem" or scene.grain.damping >= LEAST_DAMPING:
        return None
    return f"at a damping of {scene.grain.damping:g} a bed does not come to rest"


def _ramp(scene: Scene) -> str | None:
    waiting = scene.protocol.waiting_time
    if not _dem_pile(scene) or waiting >= WAITING_TIME:
        return None
    waited = f"load steps that wait {waiting:g} sqrt(d/g')"
    return f"{waited} end before slow grains pass: it is a ramp"


def _coarse(scene: Scene) -> str | None:
    step = scene.protocol.load_increment
    if not _dem_pile(scene) or step <= COARSE_STEP:
        return None
    return f"load steps {step:.0%} apart leave the threshold that wide an interval"


def _wedged(scene: Scene) -> str | None:
    if not _pile(scene) or scene.bed.entrainment_angle_deg >= CLOSE_PACKED_DEG:
        return None
    return (
        f"a pile of {scene.bed.entrainment_angle_deg:g} deg: the grains of a row do not touch, "
        "those under the gaps are exposed too, and a mobile row is wedged apart by the one on it"
    )


def _forced(scene: Scene) -> str | None:
    if not _pile(scene) or scene.forces.loaded_grains == "exposed":
        return None
    return f"{scene.forces.loaded_grains}: a grain without its force blocks those behind it"


def _scheme(scene: Scene) -> str | None:
    if not _pile(scene, "solve") or scene.flow.convection_scheme == "linearUpwind":
        return None
    return f"{scene.flow.convection_scheme} does not converge to the same answer, or not at all"


LIMITS = (
    Limit(
        "slope",
        "bed",
        _bed_line,
        "Forms and obstacles do not overlap; no counted place is beyond the limiting slope; a "
        "poured bed is nowhere beyond its friction angle and 35 deg.",
        "smooth a profile, give forms room, or count another part of the bed; lower a poured bed's "
        "slopes",
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
        "bed.slope_deg",
        _half_way,
        "Beyond the entrainment angle a single grain may come to rest half-way: a warning.",
        "read it by DEM, or lower the slope",
        refused=False,
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
