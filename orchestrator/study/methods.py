"""The threshold methods: ways to find out when grains move, with their facts.

Whoever needs to know something of a method asks its object, and never for its name. A
new method is one entry of `METHODS` here, with its words and what it knows, and one
class in `orchestrator.grains.methods`, which finds the motion.
"""

from typing import ClassVar

from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import GrainBed, PileBed
from orchestrator.study.question import OUT, Question

LEFT_OPEN = 'method.kind = "auto", which takes one that does'
LEFT_OPEN_METHOD = 'leave it out, or method.kind = "pivot"'


class ThresholdMethod:
    """A way to find out when the grains of a scene move.

    Attributes
    ----------
    name
        What a study file calls it.
    meaning
        What it is, in words.
    packs_grains
        Whether it follows each grain of a bed. Else it is of places along the bed line,
        each with a single exposed grain: any length has an answer, and no row holds its
        grains.
    has_contacts
        Whether grains rest on one another, so that one that leaves frees others.
    is_resolved_in_time
        Whether grains are moved by their equations of motion, under a flow that rises
        in load steps of its own: the others are quasi-static.
    needs_run
        Whether a solver has to move the grains.
    renews_balance
        Whether grains that share the stress share it anew after each that leaves.
    """

    name: ClassVar[str]
    meaning: ClassVar[str]
    packs_grains: ClassVar[bool] = True
    has_contacts: ClassVar[bool] = False
    is_resolved_in_time: ClassVar[bool] = False
    needs_run: ClassVar[bool] = False
    renews_balance: ClassVar[bool] = False

    def misfit(self, question: Question) -> UnfitError | None:
        """Say what of a question the method does not know.

        Returns
        -------
        UnfitError, or None
            The field, why it does not fit, and what would; None where it knows all.
        """
        del question
        return None


class Local(ThresholdMethod):
    """The closed form along the bed line: the local stress against a single grain's."""

    name = "local"
    meaning = "closed form along the bed line"
    packs_grains = False

    def misfit(self, question: Question) -> UnfitError | None:
        """Say why a bed is not one of single exposed grains."""
        if question.is_poured or question.forces.sheltering == "balanced":
            return UnfitError("method.kind", "local packs no grains", LEFT_OPEN)
        bed = question.bed
        if isinstance(bed, PileBed) and bed.packing == "horizontal":
            what = "local is of rows along the bed, these are level"
            return UnfitError("method.kind", what, LEFT_OPEN)
        return None


class Pivot(ThresholdMethod):
    """Each grain leaves its pocket by itself."""

    name = "pivot"
    meaning = "pivot"


class Peeling(ThresholdMethod):
    """Pivots that free one another, without dynamics."""

    name = "peeling"
    meaning = "peeling"
    has_contacts = True
    renews_balance = True

    def misfit(self, question: Question) -> UnfitError | None:
        """Say why it does not know which grain frees which."""
        if isinstance(question.bed, PileBed) and question.bed.width:
            return UnfitError("bed.width", "peeling needs a bed in a plane", OUT)
        return None


class Dem(ThresholdMethod):
    """The discrete element method: spheres on springs, under a flow raised in steps."""

    name = "dem"
    meaning = "DEM"
    has_contacts = True
    is_resolved_in_time = True
    needs_run = True

    def misfit(self, question: Question) -> UnfitError | None:
        """Say which force or motion the solver has no term for."""
        is_single = isinstance(question.bed, GrainBed)
        if is_single and question.threshold.criterion == "sustained":
            what = "DEM of single grains knows no hops"
            return UnfitError("threshold.criterion", what, LEFT_OPEN_METHOD)
        if question.grain.cohesion > 0:
            return UnfitError("grain.cohesion", "DEM knows no cohesion", LEFT_OPEN)
        if is_single and question.flow.gusts is not None:
            what = "DEM of single grains knows no gusts"
            return UnfitError("flow.gusts", what, LEFT_OPEN)
        if question.is_for_following:
            return self._misfit_of_followed(question)
        return None

    @staticmethod
    def _misfit_of_followed(question: Question) -> UnfitError | None:
        """Say which field means nothing to grains whose motion is followed."""
        what = "grains that DEM follows have the drag of the flow at their own height"
        if question.forces.exposure != "alike":
            return UnfitError("forces.exposure", what, OUT)
        if question.forces.sheltering != "none":
            return UnfitError("forces.sheltering", what, OUT)
        if question.flow.depth is not None:
            what = "grains that DEM follows are in a deep flow"
            return UnfitError("flow.depth", what, OUT)
        return None


LOCAL, PIVOT, PEELING, DEM = Local(), Pivot(), Peeling(), Dem()
METHODS: dict[str, ThresholdMethod] = {
    each.name: each for each in (DEM, PEELING, PIVOT, LOCAL)
}
"""The methods by what a study file calls them, in the order of its reference."""
AUTO = "auto"
"""What a study file writes that leaves the method open."""
MEANINGS = {
    AUTO: "chosen for the scene",
    **{name: each.meaning for name, each in METHODS.items()},
}
"""The words of the field `method.kind`."""
