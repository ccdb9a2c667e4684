"""One scene: a fluid, its grains, their bed, the flow and the protocol."""

import re
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from math import acos, cos, degrees, radians
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from orchestrator.digits import SLACK, rounded
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import weight
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study import parts
from orchestrator.study.parts import (
    Flow,
    Fluid,
    Forces,
    Grain,
    GrainBed,
    PileBed,
    Protocol,
)
from orchestrator.study.shapes import SHAPES

BUILDABLE_DEG = (1.0, 60.0)  # slopes of piles that can be meshed and packed
SOLVE_VISCOSITY = (
    1e-5  # at which flows are solved, m2/s, where it is low enough for their cells
)
VISCOUS_CELLS = (
    2.5  # first cell over nu/(kappa u*_0): at its centre the flow is turbulent
)
CELLS_OVER_Z0 = 2.5  # first cell over z0: its centre is not within the roughness
LEAST_HEIGHT = 5.0  # of forms, in grains
LEAST_DEPTH = 3.0
"""Least depth of a flow, in heights of forms and obstacles: mesh rows are level at half of it. Over
a level bed, where no flow is solved, it is in the largest grains."""
MOST_POURED_STIFFNESS = 1e5
"""K d/W of a deck on a poured bed, ten times that of the pouring: grains that lie in one another by
1e-3 d are thrown apart by stiffer springs."""
LEAST_WIDTH = (
    3.0  # of a strip, in its largest grains: none touches another from both sides
)
NARROWEST_OVER_D, NARROWEST_OVER_CELL = 0.1, 0.05
"""Least distance of two points of a profile, over the diameter and over the height of the first
cell. Nearer ones make columns of cells in which the flow does not converge: on a triangle of 15 deg
a second point at 0.05 of the first cell moves thresholds by 1 to 2 %, at 0.0002 by half."""
ROUGHEST = (
    1 / 3
)  # largest z0 over the diameter of the bed's grains; measured are up to 1/7
BEYOND_ASKED = 0.05
"""Part of the grains beyond the largest fraction asked for that a run of DEM goes on: half a grain
of ten."""
LEAST_UPDATE = 0.02  # least part of the grains between two solves of the flow
LARGEST_RATIO = 10.0  # of a mixture's grains: the time of DEM rises with its square
OFF_SIEVE = 1e-5
"""Relative difference of the d50 of a sieve table from the diameter: messages and tables
print it with six digits."""
OFF_MEDIAN = 0.01
"""Relative difference of a log-normal mixture's d50 from the diameter, of which Shields numbers and
a roughness length of d/30 are made."""
Rule = tuple[object, str, str, str]
"""Whether a rule between fields is broken, the field that breaks it, what is wrong, the remedy."""
CLOSED = (
    "pivot",
    "local",
)  # methods without contacts: nothing that moves changes the bed
LEFT_OPEN = 'protocol.method = "auto", which takes one that does'
OUT, POURED = "leave it out", 'leave it out, or bed.packing = "poured"'


class Scene(parts.Part):
    """One point of a study; a `pydantic.ValidationError` names each field that is wrong."""

    fluid: Fluid = Fluid()
    grain: Grain
    bed: Annotated[GrainBed | PileBed, Field(discriminator="kind")]
    flow: Flow = Flow()
    forces: Forces = Forces()
    protocol: Protocol = Protocol()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        for is_broken, *words in self._rules():
            if is_broken:
                raise parts.UnfitError(*words)
        return self

    def _rules(self) -> Iterator[Rule]:
        grain, bed, update = self.grain, self.bed, self.protocol.update
        d, z0, law, method = (
            grain.diameter,
            bed.roughness,
            self.forces.law,
            self.protocol.method,
        )
        is_balanced = self.forces.sheltering == "balanced"
        if grain.sizes is not None:
            yield from self._rules_of_sizes(grain.sizes)
        light = grain.density <= self.fluid.density
        yield (
            light,
            "grain.density",
            "not above the fluid's",
            "raise it, or lower fluid.density",
        )
        size = d / bed.relative_size * parts.extremes(grain.sizes, d)[1]
        what = f"above d, or a third of the bed's grains of {size:g} m"
        yield (
            z0 > ROUGHEST * size * (1 + 1e-9) or z0 >= d,
            "bed.roughness",
            what,
            "typical: d/30",
        )
        is_raised = self.forces.exposure == "protrusion"
        blind = law in LAWS and not LAWS[law].protrudes
        for name, is_asked in {
            "exposure": is_raised,
            "sheltering": is_balanced,
        }.items():
            what = f"the law {law} has none"
            yield is_asked and blind, f"forces.{name}", what, 'choose "bridged"'
        yield from self._rules_of_method()
        width = bed.width if isinstance(bed, PileBed) else 0.0
        poured = {
            "grain.sizes": grain.sizes,
            "forces.exposure": is_raised,
            "bed.width": width,
        }
        for name, value in poured.items():
            yield value and not self.is_poured, name, "it is of poured beds", POURED
        by_dem = method == "dem" or (method == "auto" and not self.unknown_to_dem)
        stiff = self.is_poured and by_dem and grain.stiffness > MOST_POURED_STIFFNESS
        most = f"at most {MOST_POURED_STIFFNESS:g}"
        yield stiff, "grain.stiffness", "such springs throw poured grains apart", most
        few, least = 0 < update < LEAST_UPDATE, f"0, or at least {LEAST_UPDATE:g}"
        yield few, "protocol.update", "each update is a solve of the flow", least
        top, depth = self.flow.top, self.flow.depth
        what = f"{top} {'has none' if top == 'boundary layer' else 'needs one, in m'}"
        yield (
            (top == "boundary layer") == bool(depth),
            "flow.depth",
            what,
            "see flow.top",
        )
        if isinstance(bed, PileBed):
            yield from self._rules_of_bed(bed)
            yield from self._rules_of_flow(bed)
        else:
            falls = self.pocket_cosine >= 1
            yield (
                0 < (depth or 0) <= d,
                "flow.depth",
                "it does not cover the grain",
                "raise it",
            )
            yield (
                falls,
                "bed.relative_size",
                "it falls between its neighbours",
                "raise it",
            )
            yield update, "protocol.update", "it is of piles", OUT
            yield (
                is_balanced,
                "forces.sheltering",
                "a single grain has no neighbours",
                OUT,
            )

    def _rules_of_method(self) -> Iterator[Rule]:
        """What a method does not know; the method ``auto`` takes one that does."""
        method, law = self.protocol.method, self.forces.law
        is_packed = self.is_poured or self.forces.sheltering == "balanced"
        fails = self.is_turned and self.is_poured
        what = f"{law} turns the grain, which no method knows on a poured bed"
        yield fails, "forces.law", what, "choose another law"
        fails = self.is_turned and self.protocol.update > 0
        what = f"{law} turns the grain, which no method knows on a bed that changes"
        yield fails, "protocol.update", what, OUT
        fails = method == "local" and is_packed
        yield fails, "protocol.method", "local packs no grains", LEFT_OPEN
        is_level = isinstance(self.bed, PileBed) and self.bed.packing == "horizontal"
        fails = method == "local" and is_level
        yield (
            fails,
            "protocol.method",
            "local is of rows along the bed, these are level",
            LEFT_OPEN,
        )
        fails = self.is_turned and method in ("dem", "peeling")
        yield (
            fails,
            "forces.law",
            f"{law} turns the grain, which {method} does not know",
            LEFT_OPEN,
        )
        fails = method == "dem" and self.grain.cohesion > 0
        yield fails, "grain.cohesion", "DEM knows none", LEFT_OPEN
        fails = (
            method == "dem"
            and isinstance(self.bed, GrainBed)
            and self.flow.gusts is not None
        )
        yield fails, "flow.gusts", "DEM of single grains knows none", LEFT_OPEN

    def _rules_of_sizes(self, mixture: parts.Sizes) -> Iterator[Rule]:
        d, slack = self.grain.diameter, OFF_MEDIAN
        if isinstance(mixture, tuple):
            (diameters, fractions), slack = np.array(mixture).T, OFF_SIEVE
            for one, other in pairwise(diameters.tolist()):
                what = f"diameters do not rise: {other:g} m comes behind {one:g} m"
                yield other <= one, "grain.sizes", what, "sort the rows, each size once"
            total = float(fractions.sum())
            what = f"fractions add up to {total:.6g}, not 1"
            remedy = f"divide each by {total:.6g}"
            yield abs(total - 1) > 1e-6, "grain.sizes", what, remedy
        median, (low, high) = (
            parts.percentile(mixture, d, 0.5),
            parts.extremes(mixture, d),
        )
        off, what = (
            abs(median / d - 1) > slack,
            f"the d50 of grain.sizes is {median:.6g} m",
        )
        yield off, "grain.diameter", what, "write that, or change the cut-offs"
        what = f"the largest grain is {high / low:.3g} times the smallest"
        most = f"merge classes until it is at most {LARGEST_RATIO:g} times"
        yield high / low > LARGEST_RATIO + SLACK, "grain.sizes", what, most

    def _rules_of_bed(self, bed: PileBed) -> Iterator[Rule]:
        d, profile, slope, shape = (
            self.grain.diameter,
            bed.profile,
            bed.slope_deg,
            bed.shape,
        )
        planar = self.protocol.method == "peeling" or self.protocol.update
        yield (
            planar and bed.width,
            "bed.width",
            "peeling and updates need a bed in a plane",
            OUT,
        )
        least = LEAST_WIDTH * parts.extremes(self.grain.sizes, d)[1]
        what = f"three of the largest grains are {least:.4g} d"
        yield (
            0 < bed.width < least,
            "bed.width",
            what,
            "raise it, or 0: a bed in a plane",
        )
        yield bed.relative_size != 1, "bed.relative_size", "it is of single grains", OUT
        yield (
            bed.spacing and bed.forms == 1,
            "bed.spacing",
            "one form has no neighbour",
            OUT,
        )
        has_height = profile is not None or shape != "flat"
        fails = has_height and bed.height < LEAST_HEIGHT * d
        least_m = f"at least {LEAST_HEIGHT * d:.4g} m"
        yield fails, "bed.height", f"less than five grains of {d:g} m", least_m
        for obstacle, other in pairwise(sorted(bed.obstacles, key=lambda each: each.x)):
            overlap = other.x - obstacle.x < obstacle.reach + other.reach
            yield (
                overlap,
                "bed.obstacles",
                f"{obstacle} and {other} overlap",
                "move one",
            )
        if profile is None:
            (low, high), rises = BUILDABLE_DEG, bed.form.rises
            gentle = low <= slope <= high or not rises
            yield (
                not gentle,
                "bed.slope_deg",
                f"{slope:g} deg",
                f"choose {low:g} to {high:g}",
            )
            yield (
                slope and not rises,
                "bed.slope_deg",
                f"the shape {shape} does not rise",
                OUT,
            )
            yield bed.smoothing, "bed.smoothing", "it is of a profile", OUT
            others = {name for facts in SHAPES.values() for name in facts.fields}
            for name in sorted(others - {*bed.form.fields}):
                foreign = getattr(bed, name) != PileBed.model_fields[name].default
                shapes = [
                    each for each, facts in SHAPES.items() if name in facts.fields
                ]
                yield foreign, f"bed.{name}", f"it is of: {', '.join(shapes)}", OUT
            return
        cell = self.first_cell_height
        steps = np.hypot(np.diff(profile.x), np.diff(profile.z))
        cells = NARROWEST_OVER_CELL * cell if self.flow.model == "solve" else 0.0
        near, least = int(np.argmin(steps)), max(NARROWEST_OVER_D * d, cells)
        what = (
            f"points at x = {profile.x[near + 1]:.6g} m are nearer than {least:.2g} m"
        )
        yield (
            steps[near] < least,
            "bed.profile",
            what,
            "leave out one, or raise bed.smoothing",
        )

    def _rules_of_flow(self, bed: PileBed) -> Iterator[Rule]:
        flow, update, height = self.flow, self.protocol.update, bed.relief
        cell = self.first_cell_height
        solved, is_open = flow.model == "solve", flow.top != "boundary layer"
        if bed.is_level:
            largest = (
                self.grain.diameter
                * parts.extremes(self.grain.sizes, self.grain.diameter)[1]
            )
            shallow = flow.depth is not None and flow.depth < LEAST_DEPTH * largest
            what = f"{flow.depth} m is less than {LEAST_DEPTH:g} of the largest grains"
            least_m = f"at least {LEAST_DEPTH * largest:.4g} m"
            yield shallow, "flow.depth", what, least_m
        else:
            depth = flow.depth or flow.lid * height
            highest = max([height, *(each.height for each in bed.obstacles)])
            shallow = depth < LEAST_DEPTH * highest
            name = "flow.depth" if is_open else "flow.lid"
            what = f"{depth:g} m is less than {LEAST_DEPTH:g} heights of the forms or obstacles"
            yield shallow, name, what, "raise it"
        topped = is_open and flow.model == "waves"
        yield (
            topped,
            "flow.model",
            "linear theory has no top",
            'choose "solve" or "flat"',
        )
        coarse = solved and cell > height / 4
        yield (
            coarse,
            "flow.first_cell_height",
            "above a quarter of the pile",
            "lower it",
        )
        frozen = not solved or self.protocol.method in CLOSED
        what = 'it needs a flow that is solved and the method "dem"'
        yield update and frozen, "protocol.update", what, OUT
        coarse, what = (
            bool(update) and cell > self.grain.diameter,
            "higher than a grain",
        )
        yield (
            coarse,
            "flow.first_cell_height",
            f"{what}, with protocol.update",
            "lower it",
        )

    @cached_property
    def id(self) -> str:
        """Digest of the scene's canonical JSON."""
        return digest_text(canonical_json(self.model_dump(mode="json")))[:12]

    @property
    def is_poured(self) -> bool:
        """Whether its bed is poured by LIGGGHTS."""
        return isinstance(self.bed, PileBed) and self.bed.packing == "poured"

    @property
    def counts(self) -> str | parts.Range | None:
        """Which exposed grains of a pile are counted; None on a bed of one grain."""
        return self.bed.counts if isinstance(self.bed, PileBed) else None

    @property
    def is_turned(self) -> bool:
        """Whether its force law turns the grain about its centre."""
        law = self.forces.law
        return law in LAWS and LAWS[law].turns

    @property
    def unknown_to_dem(self) -> str:
        """What of the scene DEM does not know, in words; empty where it knows all."""
        if self.is_turned:
            return f"DEM does not know how {self.forces.law} turns the grain"
        if self.grain.cohesion:
            return "DEM knows no cohesion"
        if self.flow.gusts and not isinstance(self.bed, PileBed):
            return "DEM of single grains knows no gusts"
        return ""

    @property
    def gust(self) -> float:
        """Stress that moves the grains over the mean stress of the flow: 1 without gusts."""
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
        fluid = {"fluid_density": self.fluid.density, "gravity": self.fluid.gravity}
        return float(
            weight(diameter=self.grain.diameter, density=self.grain.density, **fluid)
        )

    @property
    def limiting_slope_deg(self) -> float:
        """Slope beyond which a grain slides or rolls back without any flow, degrees."""
        return min(self.grain.friction_angle_deg, 90 - self.pocket_angle_deg)

    @property
    def pocket_cosine(self) -> float:
        """Cosine of the angle at which a single grain leaves its pocket; above 1 it falls through.

        Its neighbours' centres are 2 d cos(beta) apart and (D + d)/2 from its own.
        """
        return (
            2
            * cos(radians(self.bed.entrainment_angle_deg))
            / (1 + self.bed.relative_size)
        )

    @property
    def pocket_angle_deg(self) -> float:
        """Angle at which a grain leaves its pocket, degrees: beta, of equal grains."""
        equal = self.bed.relative_size == 1.0
        return (
            self.bed.entrainment_angle_deg
            if equal
            else degrees(acos(self.pocket_cosine))
        )

    @property
    def last_fraction(self) -> float:
        """Fraction of a pile's grains at which a run of DEM ends.

        It goes on beyond the largest fraction that is asked for: there the interval ends where half
        a grain more has moved, of ten grains or more.
        """
        asked = min(max(self.protocol.fractions) + BEYOND_ASKED, 1.0)
        if asked <= self.protocol.final_fraction + 1e-9:
            return self.protocol.final_fraction
        return round(asked, 9)

    @property
    def solve_roughness(self) -> float:
        """z0 at which the flow over a pile is solved, m."""
        return self.flow.roughness or self.bed.roughness

    @cached_property
    def first_cell_height(self) -> float:
        """Height of the flow's first cell on the bed of a pile, m."""
        assert isinstance(self.bed, PileBed)
        viscous = (self.flow.viscosity or 0.0) / self._eddy_viscosity
        default = default_first_cell_height(
            self.bed.relief, self.solve_roughness, viscous
        )
        return self.flow.first_cell_height or default

    @property
    def solve_viscosity(self) -> float:
        """Kinematic viscosity at which the flow over a pile is solved, m2/s."""
        most = self._eddy_viscosity * self.first_cell_height / VISCOUS_CELLS
        return self.flow.viscosity or min(SOLVE_VISCOSITY, float(f"{most:.3g}"))

    @cached_property
    def _eddy_viscosity(self) -> float:
        """Eddy viscosity of the undisturbed flow of the solve over the height, kappa u*_0, m/s."""
        assert isinstance(self.bed, PileBed)
        height = 10 * self.bed.relief
        return KARMAN * float(
            log_law_ustar(self.flow.speed, height, self.solve_roughness)
        )


def default_first_cell_height(
    height: float, roughness: float, viscous: float = 0.0
) -> float:
    """Height of the first cell on the bed of a pile, m.

    The finer the better, but its centre z_e must not lie in the roughness, and where the eddy
    viscosity is below the molecular one, `viscous` = nu/(kappa u*_0), the flow is not turbulent.
    h/4 is the end.
    """
    least = max(height / 40, CELLS_OVER_Z0 * roughness, VISCOUS_CELLS * viscous)
    return rounded(min(least, height / 4))


def roughness_length(
    text: str, diameter: float, mixture: parts.Sizes | None = None
) -> float:
    """A roughness in metres from a part of the diameter (m) such as ``"d/30"``.

    In a mixture d is the median; ``"d84/30"`` is a part of the diameter that 84 % of the mass are
    finer than.
    """
    form = r"\s*d([1-9]\d)?\s*/\s*(\d+(?:\.\d+)?)\s*"
    match = re.fullmatch(form, text, re.ASCII)
    if not match or float(match[2]) == 0:
        raise parts.UnfitError(
            "bed.roughness", f"{text!r} is not a length", 'write metres, or "d/30"'
        )
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a flow
    size = (
        parts.percentile(mixture, diameter, int(match[1]) / 100)
        if match[1]
        else diameter
    )
    return float(f"{size / float(match[2]):.12g}")
