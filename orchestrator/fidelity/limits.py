"""Where the methods hold: what a study refuses, and what it is warned of.

Each limit was read off a map of `orchestrator stability` (``calibration/maps.csv``),
whose file says it in words.
"""

import warnings
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.digits import percent
from orchestrator.errors import InputError
from orchestrator.fidelity.decision import is_along, written
from orchestrator.flow.model import of_scene
from orchestrator.flow.run import SPEED_HEIGHT
from orchestrator.flow.theory import seen_by_the_flow
from orchestrator.grains.geometry import Geometry
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.study import units
from orchestrator.study.declare import UnfitError
from orchestrator.study.method import HELD_FROM, GrainMethod
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene, default_first_cell_height
from orchestrator.study.study import Study

MOST_GRAINS = 1e5  # largest length of a bed with grains, diameters
FROZEN_BED = 0.05
"""Relative change of a threshold up to which the flow over the initial pile acts on."""
PILE_SLOPES_DEG = (
    1.0,
    35.0,
)  # of piles that the mesh and the packing have been tried for
TIMESTEPS = ((0.1, 0.4), (0.3, 0.2), (0.6, 0.1), (1.0, 0.05))
"""Largest damping ratio, and the largest safe time step up to it, sqrt(m/K)."""
LEAST_DAMPING = 0.03
STIFFEST = 1e6
"""K d/W to which thresholds are known to be good: at 1e8 they are 6 to 11 % high."""
COARSE_STEP = 0.05
CLOSE_PACKED_DEG = 60.0
"""Entrainment angle from which the grains of a row hold each other: at 59.9 degrees a
mobile row wedges the one below it apart, and thresholds are 68 % too low."""
LONGEST_AVERAGED = 0.1
"""Length over which a stress may be averaged, h: over 0.2 h the first grains of a crest
leave 5 % late, over 0.4 h 13 %."""
COARSEST = 20
"""Cells along a face below which thresholds at 15 degrees were 5 % too high."""
OTHER_CELL = 2.0
"""Factor between a first cell and its default with which thresholds were found to move
by up to 7 %, by 15 % at 8 times the default."""
OTHER_TURBULENCE = {
    "realizableKE": "up to 8 % lower",
    "kOmegaSST": "5 to 8 % higher",
}
"""Turbulence models with thresholds that differ from those by k-epsilon, and how."""
RAMP = 0.004
"""Fastest rise of u* per sqrt(d/g') at which a single grain on a ramp leaves within 5 %
of its threshold; at 0.01 it leaves 8 % late."""
TINY = 1e-9
"""Part of the length of a bed by which a place beyond its end is at its end."""
ANGLES = "min(friction angle, 90 deg - entrainment angle)"


class Limit(NamedTuple):
    """A limit that a scene is beyond, and its map; a study is refused or warned.

    Attributes
    ----------
    map
        The map of `orchestrator stability` that it was read off; empty if none.
    field
        The field of the scene.
    what
        What is wrong, in words.
    remedy
        What to do, in words.
    refused
        Whether the study is refused; else it is warned.
    """

    map: str
    field: str
    what: str
    remedy: str
    refused: bool = True


def check_study(study: Study) -> None:
    """Check every scene of a study.

    Raises
    ------
    InputError
        With the file and the group of the first scene beyond a limit.
    """
    for group in study.groups:
        for scene in group.scenes:
            try:
                check(scene, group.where)
            except InputError as error:
                # a number in another unit breaks many rules
                raise units.hinted(error, study.asked) from None


def check(scene: Scene, where: str, *, grains: bool = True) -> None:
    """Refuse a scene outside of the regions in which its answer means something.

    Where the answer is merely worse, a warning is given.

    Parameters
    ----------
    scene
        The scene.
    where
        The file of the scene, for messages.
    grains
        Whether the grains count; else only the flow over a pile does.

    Raises
    ------
    InputError
        With field, map and remedy of the first limit that it is beyond.
    """
    with suppress(UnfitError):  # which is told below
        scene = written(scene)
    for limit in exceeded(scene, grains=grains):
        seen = f"; map “{limit.map}” of `orchestrator stability`" if limit.map else ""
        remedy = limit.remedy + seen
        if limit.refused:
            raise InputError(limit.what, f"{where}: {limit.field}", remedy)
        warnings.warn(f"{limit.field}: {limit.what} ({remedy})", stacklevel=2)
    if isinstance(scene.bed, PileBed):
        try:
            # a mesh that cannot be made is refused before anything runs
            _ = of_scene(scene).cases
        except InputError as error:
            raise InputError(
                error.what, f"{where}: {error.where}", error.remedy
            ) from None


def exceeded(scene: Scene, *, grains: bool = True) -> Iterator[Limit]:
    """List the limits that a scene is beyond.

    Parameters
    ----------
    scene
        The scene.
    grains
        Whether the grains count; else only the flow over a pile does.

    Yields
    ------
    Limit
        Each limit.
    """
    bed = scene.bed
    if isinstance(bed, PileBed):
        if grains:
            yield from _pile(scene, bed)
        if scene.method.flow.facts.is_solved:
            yield from _solve(scene, bed)
        elif scene.method.flow.facts.is_of_low_beds:
            yield from _theory(scene, bed)
    if not grains:
        return
    yield from _slope(scene)
    if scene.method.is_resolved_in_time:
        yield from _dem(scene)


def _slope(scene: Scene) -> Iterator[Limit]:
    """Limits of the slope of a single grain and of a wedge."""
    bed = scene.bed
    slope = bed.slope_deg
    limit = scene.limiting_slope_deg
    if isinstance(bed, PileBed) and not bed.is_wedge:
        return
    if slope > limit + 1e-9:
        what = f"{slope:g} deg is beyond {ANGLES} = {limit:g} deg"
        what += ": the bed rolls back without flow"
        remedy = "lower the slope or the entrainment angle"
        yield Limit("slope", "bed.slope_deg", what, remedy)
    angle = bed.entrainment_angle_deg
    if not isinstance(bed, PileBed) and slope > angle:
        what = f"beyond the entrainment angle, {angle:g} deg, a grain may rest half-way"
        remedy = "read it by DEM, which differs from the closed form, "
        remedy += "or lower the slope"
        yield Limit("slope", "bed.slope_deg", what, remedy, refused=False)


def largest_timestep(damping: float) -> float:
    """Look up the largest safe time step.

    Parameters
    ----------
    damping
        Damping ratio of a collision.

    Returns
    -------
    float
        The time step, sqrt(m/K).
    """
    return next(step for most, step in TIMESTEPS if damping <= most)


def _pile(scene: Scene, bed: PileBed) -> Iterator[Limit]:
    """Limits of the grains of a pile."""
    try:
        misplaced = [*_misplaced(bed)]
        if misplaced:  # no grains can be laid there
            yield from misplaced
            return
        count = Geometry(scene).length
        if count > MOST_GRAINS:
            what = f"{count * scene.grain.diameter:g} m of bed are {count:.0f} grains"
            what += f", more than {MOST_GRAINS:g}"
            yield Limit("", "bed", what, _for_long(scene))
            return
        what = _unfit(scene, bed, of_bed(bed))
    except UnfitError as error:
        what = str(error)
    if what:
        remedy = "smooth a profile, give forms room, or count another part of the bed"
        yield Limit("slope", "bed", what, remedy)
    low, high = PILE_SLOPES_DEG
    if bed.is_wedge and not low <= bed.slope_deg <= high:
        what = f"a pile of {bed.slope_deg:g} deg"
        remedy = f"choose {low:g} ... {high:g} deg, and no more than {ANGLES}"
        yield Limit("slope", "bed.slope_deg", what, remedy)
    angle = bed.entrainment_angle_deg
    if angle < CLOSE_PACKED_DEG:
        what = f"a pile of {angle:g} deg: a mobile row is wedged apart by the row on it"
        remedy = "60 deg; single grains may have less"
        yield Limit("entrainment-layers", "bed.entrainment_angle_deg", what, remedy)
    averaged = scene.forces.averaging_length
    if averaged > LONGEST_AVERAGED:
        what = f"a stress averaged over {averaged:g} h hides that of the crest"
        what += ": thresholds of the first grains may be 5 to 13 % too high"
        remedy = f"{LONGEST_AVERAGED:g} or less"
        yield Limit("average", "forces.averaging_length", what, remedy, refused=False)
    flow = scene.method.flow
    if flow.facts.is_solved and flow.turbulence_model in OTHER_TURBULENCE:
        what = f"with {flow.turbulence_model} thresholds were"
        what += f" {OTHER_TURBULENCE[flow.turbulence_model]} than with kEpsilon"
        remedy = "kEpsilon, unless its effect is what you want"
        field = "method.flow.turbulence_model"
        yield Limit("turbulence", field, what, remedy, refused=False)
    loaded = scene.forces.loaded_grains
    if loaded != "exposed":
        what = f"{loaded}: a grain without load blocks those behind it"
        yield Limit("forced", "forces.loaded_grains", what, "exposed", refused=False)


def _misplaced(bed: PileBed) -> Iterator[Limit]:
    """Fields that name places where there is no bed; x is that of the user."""
    ends = bed.profile.x if bed.profile else of_bed(bed).x[1:-1]
    length = ends[-1] - ends[0]
    first, last = sorted(bed.place([ends[0], ends[-1]]).tolist())
    is_on_it = f"not on the bed, which is from x = {first:.9g} to {last:.9g} m"
    counts = bed.counts
    named: list[tuple[str, float]] = []
    if not isinstance(counts, str):
        named = [("bed.counted", end) for end in counts]
        if counts[0] >= counts[1]:
            start, end = bed.place(counts).tolist()
            if bed.profile:
                start, end = (start, end)[:: bed.profile.sign]
            what = f"from x = {start:.9g} to {end:.9g} m there is no bed"
            yield Limit("", "bed.counted", what, "write the smaller x first")
    if bed.profile:
        named += [("bed.obstacles", one.x) for one in bed.obstacles]
    for field, x in named:
        if not ends[0] - TINY * length <= x <= ends[-1] + TINY * length:
            what = f"{float(bed.place(x)):.9g} m is {is_on_it}"
            yield Limit("", field, what, "choose a place on it")


def _for_long(scene: Scene) -> str:
    """What to do with a pile that has too many grains for its method."""
    if scene.is_poured:
        return "a shorter bed"
    if is_along(scene):
        return 'method.kind = "local", or a range of bed.counted'
    return "a range of bed.counted, or a shorter bed"


def _unfit(scene: Scene, bed: PileBed, line: BedLine) -> str:
    """Why grains cannot lie on a bed line, which is too steep; empty if they can."""
    slopes = abs(line.slopes_deg)
    limit = scene.limiting_slope_deg
    why = ANGLES
    if bed.packing == "poured":
        if bed.obstacles:
            return "no grains can be poured around obstacles"
        # poured grains slump also where they do not count
        limit = min(scene.grain.friction_angle_deg, PILE_SLOPES_DEG[1])
        why = "what poured grains hold, min(friction angle, 35 deg)"
    elif bed.is_wedge:
        return ""
    else:
        _ = Geometry(scene).packing
        slopes = np.where(line.counted(bed.counts), slopes, 0.0)
    for start, end in line.bare:
        slopes[(np.array(line.x[1:]) > start) & (np.array(line.x[:-1]) < end)] = 0.0
    at = int(np.argmax(slopes))
    if slopes[at] <= limit + 1e-6:
        return ""
    first, last = sorted(bed.place(line.x[at : at + 2]).tolist())
    where = f"{slopes[at]:.3g} deg at x = {first:.9g} ... {last:.9g} m"
    return f"{where} is beyond {why} = {limit:g} deg"


def _theory(scene: Scene, bed: PileBed) -> Iterator[Limit]:
    """Limits of linear theory, which is of low beds."""
    line = of_bed(bed)
    seen = seen_by_the_flow(line)
    at = int(np.argmax(seen.slopes))
    slope = float(np.degrees(np.arctan(seen.slopes[at])))
    if slope > PILE_SLOPES_DEG[1] + 1e-6:
        place = f"x = {float(bed.place(seen.x[at])):.9g} m"
        what = f"a bed that rises by {slope:.3g} deg at {place} is not low,"
        what += " as linear theory assumes"
        yield Limit("slope", "method.flow.model", what, 'choose "solve"')


def _solve(scene: Scene, bed: PileBed) -> Iterator[Limit]:
    """Limits of a solved flow over a pile."""
    z0 = scene.solve_roughness
    cell = scene.first_cell_height
    if bed.is_level:
        what = "over a flat bed there is nothing to solve: u* is u*_0 everywhere"
        yield Limit("slope", "method.flow.model", what, 'choose "flat"')
    if z0 > cell:
        what = f"z0 = {z0:g} m is above twice z_e = {cell / 2:g} m"
        what += ", the centre of the first cell"
        remedy = "lower it, or raise method.flow.first_cell_height or bed.height"
        remedy += "; z_e of z0 is sound"
        yield Limit("first-cell", "bed.roughness", what, remedy)
    height = SPEED_HEIGHT * bed.relief
    ustar0 = float(log_law_ustar(scene.method.flow.speed, height, z0))
    ratio = KARMAN * ustar0 * cell / 2 / scene.solve_viscosity
    if ratio < 1:
        what = "not turbulent: the first cell's eddy viscosity"
        what += f" is {ratio:.2g} of the molecular one"
        remedy = "take the field of a lower viscosity or a higher speed: "
        remedy += "u*/U_e is the same"
        yield Limit("similarity", "method.flow.viscosity", what, remedy)
    yield from _mesh(scene, bed)


def _mesh(scene: Scene, bed: PileBed) -> Iterator[Limit]:
    """Limits of the mesh of a solved flow, and of its scheme."""
    default = default_first_cell_height(bed.relief, scene.solve_roughness)
    cell = scene.method.flow.first_cell_height or default
    if not 1 / OTHER_CELL < cell / default < OTHER_CELL:
        what = f"the first cell is a part of the model: with {cell:.3g} m in place of"
        what += f" {default:.3g} m thresholds may differ by 5 to 15 %"
        field = "method.flow.first_cell_height"
        remedy = "leave it out, unless its effect is what you want"
        yield Limit("first-cell", field, what, remedy, refused=False)
    cells = scene.method.flow.cells_per_face
    if cells < COARSEST:
        what = f"{cells} cells along a face leave thresholds about 5 % too high"
        remedy = f"{COARSEST} or more"
        field = "method.flow.cells_per_face"
        yield Limit("mesh-scheme-15", field, what, remedy, refused=False)
    scheme = scene.method.flow.convection_scheme
    if scheme != "linearUpwind":
        what = f"{scheme} does not converge to the same answer, or not at all"
        field = "method.flow.convection_scheme"
        yield Limit("mesh-scheme-15", field, what, "linearUpwind", refused=False)


def _dem(scene: Scene) -> Iterator[Limit]:
    """Limits of the contact and of the load steps of DEM."""
    rules = scene.method.grains
    damping = rules.damping
    most = largest_timestep(damping)
    if rules.time_step > most:
        what = f"{rules.time_step:g} sqrt(m/K) is above {most:g}"
        what += f" at a damping of {damping:g}"
        remedy = "lower it, or the damping"
        yield Limit("timestep-damping", "method.grains.time_step", what, remedy)
    if damping < LEAST_DAMPING:
        what = f"at a damping of {damping:g} a bed does not come to rest"
        yield Limit("timestep-damping", "method.grains.damping", what, "0.1 is sound")
    if not isinstance(scene.bed, PileBed):
        yield from _ramp(rules)
        return
    if rules.waiting_time < HELD_FROM:
        what = f"load steps that wait {rules.waiting_time:g} sqrt(d/g')"
        what += " make a flow that rises steadily"
        field = "method.grains.waiting_time"
        remedy = "raise it, unless a rising flow is what you want"
        yield Limit("quiet-step", field, what, remedy, refused=False)
    if rules.stiffness > STIFFEST:
        what = f"with K d/W = {rules.stiffness:g} thresholds may be 6 to 11 % too high"
        field = "method.grains.stiffness"
        remedy = f"{STIFFEST:g} or less"
        yield Limit("stiffness-diameter", field, what, remedy, refused=False)
    step = rules.load_increment
    if step > COARSE_STEP:
        field = "method.grains.load_increment"
        what = (
            f"load steps {percent(step)} apart leave the threshold so wide an interval"
        )
        yield Limit("quiet-step", field, what, "lower it", refused=False)


def _ramp(rules: GrainMethod) -> Iterator[Limit]:
    """The limit of how fast the flow over a single grain rises."""
    rise = rules.load_increment / rules.waiting_time
    if rules.waiting_time >= HELD_FROM or rise <= RAMP * (1 + 1e-9):
        return
    what = f"on a ramp of more than {percent(RAMP, 1)} per √(d/g′) a grain leaves late"
    what += ": from 1 % on its threshold is 8 % and more too high"
    remedy = f"a waiting time of {HELD_FROM:g}, unless a rising flow is what you want"
    field = "method.grains.load_increment"
    yield Limit("rate-stiffness", field, what, remedy, refused=False)
