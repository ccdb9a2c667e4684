"""One scene: a question with the method that answers it."""

import re
from functools import cached_property
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from orchestrator.digits import rounded
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study import units
from orchestrator.study.declare import UnfitError
from orchestrator.study.method import LEAST_FLOWS, Method
from orchestrator.study.methods import ThresholdMethod
from orchestrator.study.parts import PileBed, Sizes, percentile
from orchestrator.study.question import LEAST_DEPTH, OUT, Question, check
from orchestrator.study.scopes import blanked, effective

SOLVE_VISCOSITY = 1e-5
"""Viscosity at which flows are solved, m2/s, where it is low enough for their cells."""
VISCOUS_CELLS = 2.5
"""First cell over nu/(kappa u*_0): at its centre the flow is turbulent."""
CELLS_OVER_Z0 = 2.5
"""First cell over z0: its centre is not within the roughness."""
MOST_POURED_STIFFNESS = 1e5
"""K d/W of a deck on a poured bed, ten times that of the pouring: grains that lie in
one another by 1e-3 d are thrown apart by stiffer springs."""
NARROWEST_OVER_D = 0.1
NARROWEST_OVER_CELL = 0.05
"""Least distance of two points of a profile, over the diameter and over the height of
the first cell. Nearer ones make columns of cells in which the flow does not converge:
on a triangle of 15 deg a second point at 0.05 of the first cell moves thresholds by 1
to 2 %, at 0.0002 by half."""
BEYOND_ASKED = 0.05
"""Part of the grains beyond the largest fraction asked for that a run of DEM goes on:
half a grain of ten."""
READ_LATER: dict[str, Any] = {
    "fluid": {"kind"},
    "threshold": {"fractions", "criterion"},
}
"""Fields that no run of a solver depends on, only the reading of its results."""


class Scene(Question):
    """One point of a study.

    A `pydantic.ValidationError` names each field that is wrong.
    """

    method: Method = Method()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        """Blank the fields without effect, and refuse others that do not fit."""
        vars(self).update(dict(blanked(self, self)))
        check(self)
        _check(self)
        return self

    @property
    def is_followed(self) -> bool:
        """Whether DEM follows its grains until their motion is sustained or ends."""
        return self.method.is_resolved_in_time and self.is_for_following

    @cached_property
    def digest(self) -> str:
        """Digest of all that a run may depend on: of the fluid its numbers alone."""
        asked = self.described(exclude={"fluid": {"kind"}})
        return digest_text(canonical_json(asked))[:12]

    @cached_property
    def id(self) -> str:
        """Digest of the scene's canonical JSON, of the fields that have an effect."""
        return digest_text(canonical_json(self.described()))[:12]

    def described(self, **chosen: Any) -> dict[str, Any]:
        """List the fields that have an effect on the scene.

        Parameters
        ----------
        **chosen
            Which fields: `include` and `exclude` of pydantic's `model_dump`.

        Returns
        -------
        dict
            The fields as JSON.
        """
        return effective(self, self.model_dump(mode="json", **chosen), self)

    @cached_property
    def question(self) -> Question:
        """What is asked, without the method."""
        parts = {name: getattr(self, name) for name in Question.model_fields}
        return Question(**parts)

    def by(self, method: ThresholdMethod) -> "Scene":
        """Make the same question by another threshold method.

        Returns
        -------
        Scene
            The scene.
        """
        parts = {name: getattr(self, name) for name in Scene.model_fields}
        parts["method"] = self.method.model_copy(update={"kind": method.name})
        return Scene(**parts)

    def without_obstacles(self) -> "Scene":
        """Make the same question and method over a pile without its obstacles.

        Returns
        -------
        Scene
            The scene.
        """
        parts = {name: getattr(self, name) for name in Scene.model_fields}
        parts["bed"] = self.bed.model_copy(update={"obstacles": ()})
        return Scene.model_construct(**parts)

    @property
    def last_fraction(self) -> float:
        """Fraction of a pile's grains at which a run of DEM ends.

        It goes on beyond the largest fraction that is asked for: there the interval
        ends where half a grain more has moved, of ten grains or more.
        """
        final = self.method.grains.final_fraction
        asked = min(max(self.threshold.fractions) + BEYOND_ASKED, 1.0)
        if asked <= final + 1e-9:
            return final
        return round(asked, 9)

    @property
    def solve_roughness(self) -> float:
        """z0 at which the flow over a pile is solved, m."""
        return self.method.flow.roughness or self.bed.roughness

    @cached_property
    def first_cell_height(self) -> float:
        """Height of the flow's first cell on the bed of a pile, m."""
        assert isinstance(self.bed, PileBed)
        given = self.method.flow
        viscous = (given.viscosity or 0.0) / self._eddy_viscosity
        default = default_first_cell_height(
            self.bed.relief, self.solve_roughness, viscous
        )
        return given.first_cell_height or default

    @property
    def solve_viscosity(self) -> float:
        """Kinematic viscosity at which the flow over a pile is solved, m2/s."""
        given = self.method.flow.viscosity
        if given:
            return given
        most = self._eddy_viscosity * self.first_cell_height / VISCOUS_CELLS
        return min(SOLVE_VISCOSITY, float(f"{most:.3g}"))

    @cached_property
    def _eddy_viscosity(self) -> float:
        """Eddy viscosity of the undisturbed flow over the height, kappa u*_0, m/s."""
        assert isinstance(self.bed, PileBed)
        height = 10 * self.bed.relief
        speed = self.method.flow.speed
        return KARMAN * float(log_law_ustar(speed, height, self.solve_roughness))


def _check(scene: Scene) -> None:
    """Raise an `UnfitError` for the first field that does not fit the question."""
    misfits = {each: each.misfit(scene) for each in scene.method.candidates}
    if all(misfits.values()):
        first, *_ = filter(None, misfits.values())
        raise first
    knowing = [each for each, misfit in misfits.items() if misfit is None]
    by_springs = any(each.is_resolved_in_time for each in knowing)
    stiffness = scene.method.grains.stiffness
    if scene.is_poured and by_springs and stiffness > MOST_POURED_STIFFNESS:
        what = "such springs throw poured grains apart"
        most = f"at most {MOST_POURED_STIFFNESS:g}"
        raise UnfitError("method.grains.stiffness", what, most)
    if isinstance(scene.bed, PileBed):
        _check_flow(scene, scene.bed)
        _check_update(scene)


def _check_flow(scene: Scene, bed: PileBed) -> None:
    """Refuse a flow model or a mesh that does not fit the bed of a pile."""
    model = scene.method.flow.facts
    if bed.profile is not None:
        _check_points(scene, bed, model.is_solved)
    if scene.flow.depth is None and not bed.is_level:
        lid = scene.method.flow.lid * bed.relief
        if lid < LEAST_DEPTH * bed.highest:
            least = f"{LEAST_DEPTH:g} heights of the forms or obstacles"
            what = f"{lid:g} m is less than {least}"
            raise UnfitError("method.flow.lid", what, "raise it")
    misfit = model.misfit(scene)
    if misfit is not None:
        raise misfit
    if model.is_solved and scene.first_cell_height > bed.relief / 4:
        what = "above a quarter of the pile"
        raise UnfitError("method.flow.first_cell_height", what, "lower it")
    if between := scene.method.flow.between:
        _check_between(scene, between)


def _check_between(scene: Scene, between: tuple[float, ...]) -> None:
    """Refuse roughness lengths between which no flow can be put."""
    name = "method.flow.between"
    if len(between) < LEAST_FLOWS:
        what = f"flows of {len(between)} roughness lengths do not tell their error"
        raise UnfitError(name, what, f"name {LEAST_FLOWS} or more")
    if list(between) != sorted({*between}):
        raise UnfitError(name, "roughness lengths that do not rise", "sort them")
    if not between[0] <= scene.solve_roughness <= between[-1]:
        what = f"{scene.solve_roughness:g} m is not between them"
        raise UnfitError(name, what, "name one below it and one above")
    if scene.threshold.update:
        what = "flows over a bed that changes are solved at its own roughness"
        raise UnfitError(name, what, OUT)


def _check_points(scene: Scene, bed: PileBed, is_solved: bool) -> None:
    """Refuse points of a profile that are too near for grains or for cells."""
    assert bed.profile is not None
    steps = np.hypot(np.diff(bed.profile.x), np.diff(bed.profile.z))
    near = int(np.argmin(steps))
    least = NARROWEST_OVER_D * scene.grain.diameter
    if is_solved:
        least = max(least, NARROWEST_OVER_CELL * scene.first_cell_height)
    if steps[near] < least:
        x = float(bed.profile.place(bed.profile.x[near + 1]))
        what = f"points at x = {x:.9g} m are nearer than {least:.2g} m"
        raise UnfitError("bed.profile", what, "leave out one, or raise bed.smoothing")


def _check_update(scene: Scene) -> None:
    """Refuse updates of the bed under a flow or by a method that has none."""
    if not scene.threshold.update:
        return
    has_contacts = any(each.has_contacts for each in scene.method.candidates)
    if not (scene.method.flow.facts.is_solved and has_contacts):
        what = 'it needs a flow that is solved and the method "dem"'
        raise UnfitError("threshold.update", what, OUT)
    if scene.first_cell_height > scene.grain.diameter:
        what = "higher than a grain, with threshold.update"
        raise UnfitError("method.flow.first_cell_height", what, "lower it")


def default_first_cell_height(
    height: float, roughness: float, viscous: float = 0.0
) -> float:
    """Choose the height of the first cell on the bed of a pile.

    The finer the better, but its centre z_e must not lie in the roughness, and where
    the eddy viscosity is below the molecular one, the flow is not turbulent. h/4 is the
    end.

    Parameters
    ----------
    height
        Height h of the bed, m.
    roughness
        Roughness length of the solve, m.
    viscous
        The length nu/(kappa u*_0), m.

    Returns
    -------
    float
        The height, m.
    """
    least = max(height / 40, CELLS_OVER_Z0 * roughness, VISCOUS_CELLS * viscous)
    return rounded(min(least, height / 4))


def roughness_length(text: str, diameter: float, mixture: Sizes | None = None) -> float:
    """Compute a roughness length from a part of the diameter such as ``"d/30"``.

    In a mixture d is the median; ``"d84/30"`` is a part of the diameter that 84 % of
    the mass are finer than.

    Parameters
    ----------
    text
        The part.
    diameter
        The diameter, m.
    mixture
        The mixture; None for equal grains.

    Returns
    -------
    float
        The length, m.

    Raises
    ------
    UnfitError
        For a text that is no such part.
    """
    form = r"\s*d([1-9]\d)?\s*/\s*(\d+(?:\.\d+)?)\s*"
    match = re.fullmatch(form, text, re.ASCII)
    if not match or float(match[2]) == 0:
        what = f"{text!r} is not a length"
        remedy = units.meant(text) or 'write metres, or a part of the diameter, "d/30"'
        raise UnfitError("bed.roughness", what, remedy)
    size = diameter
    if match[1]:
        size = percentile(mixture, diameter, int(match[1]) / 100)
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a
    # flow
    return float(f"{size / float(match[2]):.12g}")
