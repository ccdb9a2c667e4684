"""One scene: a fluid, its grains, their bed, the flow and the protocol."""

import re
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from math import acos, cos, degrees, radians
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import weight
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study.part import Part, UnfitError
from orchestrator.study.parts import Bed, Flow, Fluid, Forces, Grain, GrainBed, PileBed, Protocol
from orchestrator.study.shapes import having
from orchestrator.study.sizes import Sizes, extremes, percentile

BUILDABLE_DEG = (2.0, 60.0)
"""Slopes of piles that can be meshed and packed."""
SOLVE_VISCOSITY = 1e-5
"""Kinematic viscosity at which flows are solved, m2/s, where it is low enough for their cells."""
VISCOUS_CELLS = 2.5
"""Height of the first cell over nu/(kappa u*_0): at its centre the flow is turbulent."""
LEAST_DEPTH = 3.0
"""Least depth of a flow over the height of forms and obstacles: the rows of its mesh are level at
half of it."""
MOST_POURED_STIFFNESS = 1e5
"""K d/W of a deck on a poured bed, ten times that of the pouring: contacts give back 0.05 W d."""
LEAST_WIDTH = 3.0
"""Least width of a strip, diameters of its largest grain: none touches another from both sides."""
MOST_GRAINS = 1e5
"""Largest length of a bed, diameters."""
NARROWEST_OVER_D, NARROWEST_OVER_CELL = 0.1, 0.05
"""Least distance of two points of a profile, over the diameter and over the height of the first
cell. Nearer ones make columns of cells in which the flow does not converge: on a triangle of 15 deg
a second point at 0.05 of the first cell moves thresholds by 1 to 2 %, at 0.0002 by half."""
ROUGHEST = 1 / 3
"""Largest z0 over the diameter of the bed's grains. Sparse spheres have about 1/7, the largest
ratio measured; above 1/3 a grain would lie where the mean flow of the log law is at rest."""
Misfit = tuple[str, str, str]
"""A field that does not go with others, why, and what would."""


class Scene(Part):
    """One point of a study.

    Raises
    ------
    pydantic.ValidationError
        Naming each field that is missing, unknown, of the wrong type or out of range.
    """

    fluid: Fluid = Fluid()
    grain: Grain
    bed: Annotated[GrainBed | PileBed, Field(discriminator="kind")]
    flow: Flow = Flow()
    forces: Forces = Forces()
    protocol: Protocol = Protocol()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        for misfit in self._misfits():
            raise UnfitError(*misfit)
        return self

    def _misfits(self) -> Iterator[Misfit]:
        grain, bed, law = self.grain, self.bed, LAWS.get(self.forces.law)
        if grain.density <= self.fluid.density:
            yield (
                "grain.density",
                f"{grain.density:g} kg/m3 is not above the fluid's {self.fluid.density:g} kg/m3",
                "the grain would float; raise it, or lower fluid.density",
            )
        largest = extremes(grain.sizes, grain.diameter)[1]
        bed_grains = grain.diameter / bed.relative_size * largest
        if bed.roughness > ROUGHEST * bed_grains * (1 + 1e-9):
            what = f"z0 = {bed.roughness:g} m is above a third of the bed's grains of"
            what = f"{what} {bed_grains:g} m, rougher than any grains lie"
            yield "bed.roughness", what, "typical: d/30"
        if law and law.turns and self.protocol.method != "pivot":
            what = f"{law.name} turns the grain about its centre, which the method"
            what = f"{what} {self.protocol.method} leaves out"
            yield "forces.law", what, 'choose the method "pivot", or a force law without torque'
        if grain.sizes is not None and not self.is_poured:
            what = "a lattice has equal grains: a mixture needs a poured bed"
            yield "grain.sizes", what, 'bed.packing = "poured", or leave it out'
        stiff = self.is_poured and grain.stiffness > MOST_POURED_STIFFNESS
        if stiff and self.protocol.method == "dem":
            what = "poured grains lie in one another by some 1e-3 d: springs of"
            what = f"{what} {grain.stiffness:.3g} W/d throw them apart"
            yield "grain.stiffness", what, f"at most {MOST_POURED_STIFFNESS:g}"
        if self.forces.exposure == "protrusion" and not self.is_poured:
            what = "the grains of a lattice stand alike"
            yield "forces.exposure", what, 'bed.packing = "poured", or leave it out'
        if self.forces.exposure == "protrusion" and law and not law.protrudes:
            laws = ", ".join(name for name, each in LAWS.items() if each.protrudes)
            what = f"{law.name} knows no height of a grain over the bed"
            yield "forces.exposure", what, f"laws that do: {laws}"
        if isinstance(bed, PileBed):
            yield from self._misfits_of_pile(bed)
            yield from self._misfits_of_flow(bed)
            return
        if bed.roughness >= grain.diameter:
            yield "bed.roughness", "z0 is not below the grain's diameter", "typical: d/30"
        if pocket_cosine(bed) >= 1:
            apart = 2 * cos(radians(bed.entrainment_angle_deg))
            what = f"a grain of {bed.relative_size:g} d falls between neighbours that are"
            what = f"{what} {apart:.3g} d apart"
            yield "bed.relative_size", what, "raise it, or bed.entrainment_angle_deg"
        if self.protocol.update:
            what = "a single grain leaves no bed that changes"
            yield "protocol.update", what, "leave it out"

    def _misfits_of_pile(self, bed: PileBed) -> Iterator[Misfit]:
        d, method = self.grain.diameter, self.protocol.method
        if bed.width:  # a strip in space
            least = LEAST_WIDTH * extremes(self.grain.sizes, d)[1]
            if bed.packing != "poured":
                what = "a lattice is one layer in the plane of the flow"
                yield "bed.width", what, 'bed.packing = "poured", or leave it out'
            if bed.width < least:
                what = f"{bed.width:g} d is less than {LEAST_WIDTH:g} of the largest grains"
                yield "bed.width", what, f"at least {least:.4g}, or 0 for a bed in the plane"
            if method == "peeling":
                what = "the method peeling knows grains in the plane of the flow alone"
                yield "bed.width", what, 'protocol.method = "dem" or "pivot", or width 0'
            if self.protocol.update:
                what = "a bed that changes is one layer in the plane of the flow"
                yield "bed.width", what, "leave it or protocol.update out"
        if bed.relative_size != 1:
            what = "it is of a single grain on its neighbours"
            yield "bed.relative_size", what, "leave it out"
        if bed.profile is None:
            yield from _misfits_of_shape(bed)
        elif (length := bed.profile.x[-1]) > MOST_GRAINS * d:
            what = f"{length:g} m are {length / d:.0f} grains of {d:g} m"
            yield "bed.profile", what, "are its columns in mm? or cut a part out of it"
        else:
            steps = np.hypot(np.diff(bed.profile.x), np.diff(bed.profile.z))
            near = int(np.argmin(steps))
            cell = self.first_cell_height if self.flow.model == "solve" else 0.0
            least = max(NARROWEST_OVER_D * d, NARROWEST_OVER_CELL * cell)
            if steps[near] < least:
                lines = bed.profile.lines
                line = f"line {lines[near + 1]}, " if lines else ""
                what = f"{bed.profile.name}, {line}x = {bed.profile.x[near + 1]:.6g} m:"
                what = f"{what} {steps[near]:.2g} m from the point before it, nearer than"
                what = f"{what} {least:.2g} m"
                more = "give" if lines else "raise"
                yield "bed.profile", what, f"leave out one of the two, or {more} bed.smoothing"
        for obstacle, other in pairwise(sorted(bed.obstacles, key=lambda each: each.x)):
            if other.x - obstacle.x < obstacle.reach + other.reach:
                yield "bed.obstacles", f"{obstacle} and {other} overlap", "move one of them"
        if bed.height < 5 * d:
            what = f"{bed.height:g} m is less than five grains of {d:g} m"
            remedy = "a pile needs some rows, and lengths on a flat bed are parts of it: raise"
            yield "bed.height", what, f"{remedy} bed.height or lower grain.diameter"

    def _misfits_of_flow(self, bed: PileBed) -> Iterator[Misfit]:
        flow, height = self.flow, bed.relief
        top = flow.depth or flow.lid * height
        for obstacle in bed.obstacles:
            if top < LEAST_DEPTH * obstacle.height:
                what = f"{obstacle} under a flow {top:g} m deep"
                remedy = f"at most a part of 1/{LEAST_DEPTH:g} of that, or raise the depth or"
                yield "bed.obstacles", what, f"{remedy} flow.lid"
        if flow.top == "boundary layer":
            if flow.depth:
                remedy = 'leave it out, or choose flow.top = "open water"'
                yield "flow.depth", "a boundary layer has none", remedy
        elif not flow.depth:
            yield "flow.depth", f"the depth of {flow.top} is missing", "give it, in m"
        elif flow.depth < LEAST_DEPTH * height:
            what = f"{flow.depth:g} m is less than {LEAST_DEPTH:g} heights of the forms,"
            yield "flow.depth", f"{what} {height:g} m", "raise it, or lower bed.height"
        elif flow.model not in ("solve", "flat"):
            what = f"the theory {flow.model} is of a flow without a top"
            yield "flow.model", what, 'choose "solve" or "flat"'
        cell = self.first_cell_height
        if flow.model == "solve" and cell > height / 4:
            what = f"{cell:g} m is above a quarter of the pile's {height:g} m"
            yield "flow.first_cell_height", what, "lower it, or raise bed.height"
        if self.protocol.update:
            never = "leave it out"
            if flow.model != "solve":
                what = f'the flow model "{flow.model}" knows no bed that changes'
                yield "protocol.update", what, f'flow.model = "solve", or {never}'
            if self.protocol.method == "pivot":
                what = "each grain by itself frees no other"
                yield "protocol.update", what, f'the method "peeling" or "dem", or {never}'
            if cell > self.grain.diameter:
                what = f"the first cell, {cell:g} m, is higher than a grain"
                remedy = f"set flow.first_cell_height to at most the diameter, or {never}"
                yield "protocol.update", what, remedy

    @cached_property
    def id(self) -> str:
        """Digest of the scene's canonical JSON."""
        return digest_text(canonical_json(self.model_dump(mode="json")))[:12]

    @property
    def is_poured(self) -> bool:
        """Whether its bed is poured by LIGGGHTS."""
        return isinstance(self.bed, PileBed) and self.bed.packing == "poured"

    @property
    def reduced_gravity(self) -> float:
        """Gravity of the submerged grain, g' = g (rho_sol - rho_f)/rho_sol, m/s2."""
        return self.fluid.gravity * (1 - self.fluid.density / self.grain.density)

    @property
    def weight(self) -> float:
        """Submerged weight W of a grain, N."""
        sphere = {"diameter": self.grain.diameter, "density": self.grain.density}
        fluid = {"fluid_density": self.fluid.density, "gravity": self.fluid.gravity}
        return float(weight(**sphere, **fluid))

    @property
    def limiting_slope_deg(self) -> float:
        """Slope beyond which a grain slides or rolls back without any flow, degrees."""
        return min(self.grain.friction_angle_deg, 90 - self.pocket_angle_deg)

    @property
    def pocket_angle_deg(self) -> float:
        """Angle at which a grain leaves its pocket, degrees: beta, of equal grains."""
        if self.bed.relative_size == 1.0:
            return self.bed.entrainment_angle_deg
        return degrees(acos(pocket_cosine(self.bed)))

    @property
    def solve_roughness(self) -> float:
        """z0 at which the flow over a pile is solved, m."""
        return self.flow.roughness or self.bed.roughness

    @property
    def first_cell_height(self) -> float:
        """Height of the flow's first cell on the bed of a pile, m."""
        assert isinstance(self.bed, PileBed)
        if self.flow.first_cell_height:
            return self.flow.first_cell_height
        viscous = (self.flow.viscosity or 0.0) / self._eddy_viscosity
        return default_first_cell_height(self.bed.relief, self.solve_roughness, viscous)

    @property
    def solve_viscosity(self) -> float:
        """Kinematic viscosity at which the flow over a pile is solved, m2/s."""
        if self.flow.viscosity:
            return self.flow.viscosity
        most = self._eddy_viscosity * self.first_cell_height / VISCOUS_CELLS
        return min(SOLVE_VISCOSITY, float(f"{most:.3g}"))

    @property
    def _eddy_viscosity(self) -> float:
        """Eddy viscosity of the undisturbed flow of the solve over the height, kappa u*_0, m/s."""
        assert isinstance(self.bed, PileBed)
        height = 10 * self.bed.relief
        return KARMAN * float(log_law_ustar(self.flow.speed, height, self.solve_roughness))


def pocket_cosine(bed: Bed) -> float:
    """Cosine of the angle at which a single grain leaves its pocket; above 1 it falls through.

    Its neighbours' centres are 2 d cos(beta) apart and (D + d)/2 from its own.
    """
    return 2 * cos(radians(bed.entrainment_angle_deg)) / (1 + bed.relative_size)


def _misfits_of_shape(bed: PileBed) -> Iterator[Misfit]:
    (low, high), rises = BUILDABLE_DEG, bed.form.rises
    name = f"a {bed.shape}" if bed.shape != "flat" else "a flat bed"
    if rises and not low <= bed.slope_deg <= high:
        what, remedy = f"a pile of {bed.slope_deg:g} deg", f"choose {low:g} ... {high:g} deg"
        yield "bed.slope_deg", what, remedy
    if bed.smoothing:
        yield "bed.smoothing", "it is of a profile", "leave it out"
    for field, about in PileBed.model_fields.items():
        shapes = having(field)
        if shapes and bed.shape not in shapes and getattr(bed, field) != about.default:
            remedy = f"leave it out; it is of: {', '.join(shapes)}"
            yield f"bed.{field}", f"{name} has none", remedy
    if not rises and bed.slope_deg:
        yield "bed.slope_deg", f"{name} does not rise", "leave it out"
    if bed.spacing and bed.forms == 1:
        yield "bed.spacing", "one form has no neighbour", "raise bed.forms"


def default_first_cell_height(height: float, roughness: float, viscous: float = 0.0) -> float:
    """Height of the first cell on the bed of a pile, m.

    The finer the better, but its centre z_e must not lie in the roughness, and where the eddy
    viscosity is below the molecular one, `viscous` = nu/(kappa u*_0), the flow is not turbulent.
    h/4 is the end.
    """
    return min(max(height / 40, 2.5 * roughness, VISCOUS_CELLS * viscous), height / 4)


def roughness_length(value: Any, diameter: float, mixture: Sizes | None = None) -> Any:
    """A roughness in metres, from a number or from a part of the diameter such as ``"d/30"``.

    In a mixture d is the median; ``"d84/30"`` is a part of the diameter that 84 % of the mass are
    finer than.
    """
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*d([1-9]\d)?\s*/\s*(\d+(?:\.\d+)?)\s*", value)
    if not match or float(match[2]) == 0:
        raise UnfitError("bed.roughness", f"{value!r} is not a length", 'write metres, or "d/30"')
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a flow
    size = percentile(mixture, diameter, int(match[1]) / 100) if match[1] else diameter
    return float(f"{size / float(match[2]):.12g}")
