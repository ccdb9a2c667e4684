"""The flow models: ways to find the stress on the bed of a pile, with their facts.

Whoever needs to know something of a model asks its object, and never for its name. A
new model is one entry of `MODELS` here, with its words and what it knows, and one class
in `orchestrator.flow.model`, which finds the stress.
"""

from typing import ClassVar

from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import PileBed
from orchestrator.study.question import Question


class FlowModel:
    """A way to find the stress on the bed of a pile.

    Attributes
    ----------
    name
        What a study file calls it.
    meaning
        What it is, in words.
    is_solved
        Whether a solver finds the flow on a mesh, anew if the bed changes: with a wake
        behind a form, and with numbers of its own.
    follows_bed
        Whether the stress changes along the bed, with the shape and the roughness that
        the flow goes over.
    is_of_low_beds
        Whether it is an expansion in the slope of the bed.
    """

    name: ClassVar[str]
    meaning: ClassVar[str]
    is_solved: ClassVar[bool] = False
    follows_bed: ClassVar[bool] = True
    is_of_low_beds: ClassVar[bool] = False

    def misfit(self, question: Question) -> UnfitError | None:
        """Say what of the question on a pile the model does not know.

        Returns
        -------
        UnfitError, or None
            The field, why it does not fit, and what would; None where it knows all.
        """
        del question
        return None


class Solve(FlowModel):
    """Steady turbulent flow by OpenFOAM."""

    name = "solve"
    meaning = "OpenFOAM"
    is_solved = True


class Waves(FlowModel):
    """Linear theory, wavelength by wavelength."""

    name = "waves"
    meaning = "linear theory with A and B of each wavelength (Fourrière et al. 2010)"
    is_of_low_beds = True

    def misfit(self, question: Question) -> UnfitError | None:
        """Say why there is no wave under a boundary layer."""
        assert isinstance(question.bed, PileBed)
        if question.bed.is_level:
            what = "over a level bed it is the flat flow"
            remedy = f'leave it out, or choose "{FLAT.name}"'
            return UnfitError("method.flow.model", what, remedy)
        if question.flow.top != "boundary layer":
            what = "linear theory has no top"
            remedy = f'choose "{SOLVE.name}" or "{FLAT.name}"'
            return UnfitError("method.flow.model", what, remedy)
        if any(each.is_porous for each in question.bed.obstacles):
            what = "linear theory knows no flow through a fence"
            return UnfitError("method.flow.model", what, f'choose "{SOLVE.name}"')
        return None


class Flat(FlowModel):
    """The undisturbed stress everywhere."""

    name = "flat"
    meaning = "log law of a flat bed, u* = u*₀"
    follows_bed = False

    def misfit(self, question: Question) -> UnfitError | None:
        """Say why nothing stands in an undisturbed flow."""
        assert isinstance(question.bed, PileBed)
        if question.bed.obstacles:
            what = "the undisturbed flow knows no obstacle"
            return UnfitError("method.flow.model", what, f'choose "{SOLVE.name}"')
        return None


SOLVE, WAVES, FLAT = Solve(), Waves(), Flat()
MODELS: dict[str, FlowModel] = {each.name: each for each in (SOLVE, WAVES, FLAT)}
"""The models by what a study file calls them."""
MEANINGS = {name: each.meaning for name, each in MODELS.items()}
"""The words of the field `method.flow.model`."""
