"""The question.

It has a fluid, its grains, their bed, the flow above, and what counts as motion.
"""

from itertools import pairwise
from math import acos, cos, degrees, radians
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from orchestrator.digits import SLACK, metres, rounded
from orchestrator.physics.grain import Grain as PhysicalGrain
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import DEFAULT, LAWS
from orchestrator.physics.threshold import LAWS_OF, PAPER
from orchestrator.study.declare import Part, UnfitError
from orchestrator.study.parts import (
    Flow,
    Fluid,
    Forces,
    GrainBed,
    GrainPart,
    Obstacle,
    PileBed,
    Range,
    Sizes,
    ThresholdPart,
    extremes,
    percentile,
)
from orchestrator.study.sieve import LARGEST_RATIO

BUILDABLE_DEG = (1.0, 60.0)
"""Slopes of piles that can be meshed and packed."""
LEAST_HEIGHT = 5.0
"""Least height of forms, in grains."""
LEAST_DEPTH = 3.0
"""Least depth of a flow, in heights of forms and obstacles: mesh rows are level at half
of it. Over a level bed, where no flow is solved, it is in the largest grains."""
LEAST_WIDTH = 3.0
"""Least width of a strip, in its largest grains: none touches another from both
sides."""
ROUGHEST = 1 / 3
"""Largest z0 over the diameter of the bed's grains; measured are up to 1/7."""
LEAST_UPDATE = 0.02
"""Least part of the grains between two solves of the flow."""
OFF_SIEVE = 1e-5
"""Relative difference of the d50 of a sieve table from the diameter: messages and
tables print it with six digits."""
OFF_MEDIAN = 0.01
"""Relative difference of a log-normal mixture's d50 from the diameter, of which Shields
numbers and a roughness length of d/30 are made."""
OUT = "leave it out"


class Question(Part):
    """What is asked of nature.

    A `pydantic.ValidationError` names each field that is wrong.
    """

    fluid: Fluid = Fluid()
    grain: GrainPart
    bed: Annotated[GrainBed | PileBed, Field(discriminator="kind")]
    flow: Flow = Flow()
    forces: Forces = Forces()
    threshold: ThresholdPart = ThresholdPart()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        check(self)
        return self

    @property
    def is_poured(self) -> bool:
        """Whether its bed is poured by LIGGGHTS."""
        return isinstance(self.bed, PileBed) and self.bed.packing == "poured"

    @property
    def is_for_following(self) -> bool:
        """Whether DEM of it follows grains until their motion is sustained or ends.

        It is of a level strip in gusts whose criterion is written.
        """
        bed = self.bed
        if not isinstance(bed, PileBed) or not (self.is_poured and bed.width):
            return False
        is_asked = self.threshold.criterion == "sustained"
        return is_asked and bed.is_level and self.flow.gusts is not None

    @property
    def counts(self) -> str | Range | None:
        """Which exposed grains of a pile are counted; None on a bed of one grain.

        With a profile a range is of x of its file.
        """
        if not isinstance(self.bed, PileBed):
            return None
        counts = self.bed.counts
        if isinstance(counts, str) or self.bed.profile is None:
            return counts
        first, last = sorted(map(rounded, self.bed.place(counts).tolist()))
        return first, last

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles on a bed, with a profile at x of its file."""
        if not isinstance(self.bed, PileBed):
            return ()
        if self.bed.profile is None:
            return self.bed.obstacles
        moved = []
        for each in self.bed.obstacles:
            x = rounded(float(self.bed.place(each.x)))
            moved.append(each.model_copy(update={"x": x}))
        return tuple(moved)

    @property
    def gust(self) -> float:
        """Stress that moves the grains over the mean stress of the flow.

        It is 1 without gusts.
        """
        gusts = self.flow.gusts
        return peak_over_mean(gusts.intensity, gusts.events) if gusts else 1.0

    @property
    def bond(self) -> float:
        """Pull of a contact between two grains of d over their submerged weight."""
        return self.grain.cohesion * self.grain.diameter / self.weight

    @property
    def reduced_gravity(self) -> float:
        """Gravity of the submerged grain, g' = g (rho_sol - rho_f)/rho_sol, m/s2."""
        return self.fluid.gravity * (1 - self.fluid.density / self.grain.density)

    @property
    def weight(self) -> float:
        """Submerged weight W of a grain, N."""
        of_one = PhysicalGrain(
            diameter=self.grain.diameter,
            density=self.grain.density,
            fluid_density=self.fluid.density,
            viscosity=self.fluid.viscosity,
            gravity=self.fluid.gravity,
        )
        return float(of_one.weight)

    @property
    def limiting_slope_deg(self) -> float:
        """Slope beyond which a grain slides or rolls back without any flow, degrees."""
        return min(self.grain.friction_angle_deg, 90 - self.pocket_angle_deg)

    @property
    def pocket_cosine(self) -> float:
        """Cosine of the angle at which a single grain leaves its pocket.

        Above 1 the grain falls through.

        Its neighbours' centres are 2 d cos(beta) apart and (D + d)/2 from its own.
        """
        angle = radians(self.bed.entrainment_angle_deg)
        return 2 * cos(angle) / (1 + self.bed.relative_size)

    @property
    def pocket_angle_deg(self) -> float:
        """Angle at which a grain leaves its pocket, degrees: beta, of equal grains."""
        if self.bed.relative_size == 1.0:
            return self.bed.entrainment_angle_deg
        return degrees(acos(self.pocket_cosine))


def check(question: Question) -> None:
    """Raise an `UnfitError` for the first fields that do not go together.

    Raises
    ------
    UnfitError
        With the field, why it does not fit, and the remedy.
    """
    if question.grain.sizes is not None:
        _check_sizes(question.grain.sizes, question.grain.diameter)
    if question.grain.density <= question.fluid.density:
        remedy = "raise it, or lower fluid.density"
        raise UnfitError("grain.density", "not above the fluid's", remedy)
    _check_roughness(question)
    _check_forces(question)
    if 0 < question.threshold.update < LEAST_UPDATE:
        what = "each update is a solve of the flow"
        raise UnfitError("threshold.update", what, f"0, or at least {LEAST_UPDATE:g}")
    _check_top(question.flow)
    _check_fractions(question.threshold.fractions)
    _check_criterion(question)
    if isinstance(question.bed, PileBed):
        _check_pile(question, question.bed)
    else:
        _check_single_grain(question)


def _check_fractions(fractions: tuple[float, ...]) -> None:
    for one, other in pairwise(sorted(fractions)):
        if rounded(one) == rounded(other):
            what = f"{one:g} stands twice"
            raise UnfitError("threshold.fractions", what, "list each value once")


def why_not_sustained(question: Question) -> str:
    """Say why grains in sustained motion are not known for a question.

    Returns
    -------
    str
        The reason; empty where they are known.
    """
    law = question.forces.law
    if law in (PAPER, *LAWS_OF["transition"]):
        return f"the law {law} is one of entrainment alone"
    if question.threshold.update > 0:
        return (
            "on a bed that changes (threshold.update) stress and slope of a grain "
            "are of one round, and it goes on over the bed of the next"
        )
    return ""


def _check_criterion(question: Question) -> None:
    if question.threshold.criterion != "sustained":
        return
    what = why_not_sustained(question)
    if what:
        raise UnfitError("threshold.criterion", what, 'choose "entrained"')


def _check_sizes(mixture: Sizes, diameter: float) -> None:
    slack = OFF_MEDIAN
    if isinstance(mixture, tuple):
        slack = OFF_SIEVE
        _check_sieve(mixture)
    median = percentile(mixture, diameter, 0.5)
    if abs(median / diameter - 1) > slack:
        what = f"the d50 of grain.sizes is {median:.6g} m"
        remedy = "write that, or change the cut-offs"
        raise UnfitError("grain.diameter", what, remedy)
    low, high = extremes(mixture, diameter)
    if high / low > LARGEST_RATIO + SLACK:
        what = f"the largest grain is {high / low:.3g} times the smallest"
        most = f"merge classes until it is at most {LARGEST_RATIO:g} times"
        raise UnfitError("grain.sizes", what, most)


def _check_sieve(rows: tuple[tuple[float, float], ...]) -> None:
    diameters = [diameter for diameter, _ in rows]
    for one, other in pairwise(diameters):
        if other <= one:
            what = f"diameters do not rise: {other:g} m comes behind {one:g} m"
            remedy = "sort the rows, each size once"
            raise UnfitError("grain.sizes", what, remedy)
    total = float(np.sum([fraction for _, fraction in rows]))
    if abs(total - 1) > 1e-6:
        what = f"fractions add up to {total:.6g}, not 1"
        raise UnfitError("grain.sizes", what, f"divide each by {total:.6g}")


def _check_roughness(question: Question) -> None:
    d = question.grain.diameter
    _, largest = extremes(question.grain.sizes, d)
    size = d / question.bed.relative_size * largest
    roughness = question.bed.roughness
    if roughness > ROUGHEST * size * (1 + 1e-9) or roughness >= d:
        what = f"{metres(roughness)} is above a third of the bed's grains of "
        what += metres(size)
        if roughness <= ROUGHEST * size * (1 + 1e-9):
            what = f"{metres(roughness)} is not below the diameter of {metres(d)}"
        raise UnfitError("bed.roughness", what, 'usual is "d/30"')


def _check_forces(question: Question) -> None:
    forces = question.forces
    law = forces.law
    if law in LAWS and not LAWS[law].protrudes:
        what = f"the law {law} has none"
        remedy = f'choose "{DEFAULT}"'
        if forces.exposure == "protrusion":
            raise UnfitError("forces.exposure", what, remedy)
        if forces.sheltering == "balanced":
            raise UnfitError("forces.sheltering", what, remedy)


def _check_top(flow: Flow) -> None:
    remedy = "see flow.top"
    if flow.top == "boundary layer" and flow.depth:
        raise UnfitError("flow.depth", f"{flow.top} has none", remedy)
    if flow.top != "boundary layer" and not flow.depth:
        raise UnfitError("flow.depth", f"{flow.top} needs one, in m", remedy)


def _check_single_grain(question: Question) -> None:
    depth = question.flow.depth
    if depth is not None and depth <= question.grain.diameter:
        raise UnfitError("flow.depth", "it does not cover the grain", "raise it")
    if question.pocket_cosine >= 1:
        what = "it falls between its neighbours"
        raise UnfitError("bed.relative_size", what, "raise it")


def _check_pile(question: Question, bed: PileBed) -> None:
    d = question.grain.diameter
    _, largest = extremes(question.grain.sizes, d)
    if question.threshold.update and bed.width:
        raise UnfitError("bed.width", "updates need a bed in a plane", OUT)
    least = LEAST_WIDTH * largest
    if 0 < bed.width < least:
        what = f"three of the largest grains are {least:.4g} d"
        raise UnfitError("bed.width", what, "raise it, or 0: a bed in a plane")
    if bed.spacing and bed.forms == 1:
        raise UnfitError("bed.spacing", "one form has no neighbour", OUT)
    has_height = bed.profile is not None or not bed.form.is_level
    if has_height and bed.height < LEAST_HEIGHT * d:
        what = f"less than five grains of {d:g} m"
        raise UnfitError("bed.height", what, f"at least {LEAST_HEIGHT * d:.4g} m")
    _check_obstacles(bed)
    if bed.profile is None:
        _check_shape(bed)
    elif bed.profile.towards != question.flow.towards:
        what = f"the profile was read for a flow towards {bed.profile.towards}"
        raise UnfitError("flow.towards", what, "read it again")
    _check_depth(question.flow, bed, largest * d)


def _check_obstacles(bed: PileBed) -> None:
    in_order = sorted(bed.obstacles, key=lambda each: each.x)
    for obstacle, other in pairwise(in_order):
        if other.x - obstacle.x < obstacle.reach + other.reach:
            what = f"{obstacle} and {other} overlap"
            raise UnfitError("bed.obstacles", what, "move one")


def _check_shape(bed: PileBed) -> None:
    low, high = BUILDABLE_DEG
    slope = bed.slope_deg
    if bed.form.rises and not low <= slope <= high:
        raise UnfitError(
            "bed.slope_deg", f"{slope:g} deg", f"choose {low:g} to {high:g}"
        )
    if slope and not bed.form.rises:
        what = f"the shape {bed.shape} does not rise"
        remedy = f'{OUT}; bed.kind = "grain" has a slope'
        raise UnfitError("bed.slope_deg", what, remedy)


def _check_depth(flow: Flow, bed: PileBed, largest: float) -> None:
    """Refuse a channel that is too shallow; `largest` is the largest grain, m."""
    depth = flow.depth
    if depth is None:
        return
    if bed.is_level:
        least = LEAST_DEPTH * largest
        if depth < least:
            what = f"{depth} m is less than {LEAST_DEPTH:g} of the largest grains"
            raise UnfitError("flow.depth", what, f"at least {least:.4g} m")
        return
    if depth < LEAST_DEPTH * bed.highest:
        heights = f"{LEAST_DEPTH:g} heights of the forms or obstacles"
        what = f"{depth:g} m is less than {heights}"
        raise UnfitError("flow.depth", what, "raise it")
