"""The decision how a scene is answered: a look-up by the scene and the tolerance.

The decision depends on the values of the scene's fields and on the tolerance. It
depends neither on other scenes of the study and their order, nor on how a study file
spells the values: ``auto``, the default of `method.kind`, is a value like any
other.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache

from orchestrator.errors import InputError
from orchestrator.fidelity import choice, spread
from orchestrator.fidelity.choice import Way
from orchestrator.fidelity.classes import FLOW, GRAINS, scene_class
from orchestrator.fidelity.domain import has_measured, unmeasured
from orchestrator.fidelity.fidelities import (
    LOCAL,
    PAIRS,
    Fidelity,
    Rung,
    fidelity_of,
)
from orchestrator.fidelity.known import UNKNOWN, Known, known
from orchestrator.grains.geometry import LONGEST_PACKED, Geometry, has_rows_along
from orchestrator.grains.pile import Pile
from orchestrator.study import methods, models
from orchestrator.study.criterion import SUSTAINED, is_sustained
from orchestrator.study.fields import FIELDS, default_of
from orchestrator.study.method import HELD_FROM
from orchestrator.study.methods import ThresholdMethod
from orchestrator.study.models import FlowModel
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed, value_of

EXACT = "the closed form is exact for a single grain in a steady flow"
LONG_BED = f"more than {LONGEST_PACKED:g} grains long"
ALONG = f"{LONG_BED}: closed form along the bed, checked where motion starts"
HOPS = "sustained motion: entrainment has a closed form, rolling and hopping a table"
ENDLESS = "the rows of the bed have no end: closed form along the bed"
NOT_MET = "the tolerance cannot be met, no error is known"
NOT_MEASURED = "the numerical error on such a bed was not measured"
ESTIMATE = "run `orchestrator convergence` on the study file, which estimates it"
NONE_CHEAPER = "no fidelity whose error is known is cheaper than the scene as written"
KEPT = ("method.flow.speed", "method.flow.viscosity")
"""Numbers of the solve that every fidelity keeps: u*/U_e is the same at each of them
(docs/flow.md). Their values do not ask for DEM."""


WITHOUT_NUMBER = ("method.kind", "method.flow.model", *KEPT)


def _numbers() -> dict[str, object]:
    numbers = {}
    for field in FIELDS:
        if field.is_method and field.name not in WITHOUT_NUMBER:
            numbers[field.name] = default_of(field.name)
    return numbers


NUMBERS = _numbers()
"""Fields of mesh, contact, load steps and mobile layers, with the defaults of a
lattice: a scene in which one has another value is answered by DEM, which uses it."""


@dataclass(frozen=True)
class Decision:
    """How a scene is answered.

    Attributes
    ----------
    asked
        The scene that is asked for.
    scene
        The scene that answers it; its method is never ``auto``.
    fidelity
        The fidelity of the answer; None for a single grain.
    known
        The numerical error of tau_c.
    why
        The reason, in words.
    is_chosen
        Whether the fidelity was chosen by its numerical error, in place of what the
        scene has written.
    """

    asked: Scene
    scene: Scene
    fidelity: Fidelity | None
    known: Known
    why: str
    is_chosen: bool = False

    @property
    def error_estimate(self) -> float | None:
        """The numerical error with its uncertainty, where it is largest.

        None where it is not known.
        """
        return _if_known(self.known.total)

    def error_at(self, fraction: float) -> float | None:
        """Find the numerical error of one threshold of the scene.

        Parameters
        ----------
        fraction
            Fraction n/N of the counted grains.

        Returns
        -------
        float or None
            The numerical error with its uncertainty; None where it is not known, or was
            measured at other fractions.
        """
        if not has_measured(self.scene, fraction):
            return None
        return _if_known(self.known.at(fraction).total)

    @property
    def is_along(self) -> bool:
        """Whether the closed form along the bed answers because the bed is long."""
        if self.scene.threshold.criterion == SUSTAINED:
            return False
        return self.fidelity is LOCAL and self.asked.method.is_open

    @property
    def is_unchecked(self) -> bool:
        """Whether it is a pile for which a fidelity without DEM was chosen."""
        is_pile = isinstance(self.scene.bed, PileBed)
        method = self.scene.method.facts
        # rows without an end hold their grains by DEM: it is no check of places
        is_quasi_static = method.packs_grains and not method.is_resolved_in_time
        # nor does DEM check a method that the study asks for
        stands_for_dem = self.asked.method.kind != method.name
        return is_pile and self.is_chosen and is_quasi_static and stands_for_dem


Decisions = Mapping[str, Decision]
"""Decisions by the ids of the asked scenes."""


def _if_known(error: float) -> float | None:
    return error if math.isfinite(error) else None


def decide(scene: Scene, tolerance: float | None) -> Decision:
    """How a resolved scene is answered.

    The methods ``auto`` and, with a tolerance, ``dem`` are answered by the cheapest
    fidelity that is known to be good enough; of other methods a tolerance chooses the
    mesh of the flow. All other scenes are answered as they are written: those whose
    method or flow model says how, those for which no error is
    known, and with ``auto`` those in which one of `NUMBERS` has another value than its
    default.

    Parameters
    ----------
    scene
        A scene with one force law.
    tolerance
        Relative error that tau_c may have, the uncertainty of its reference included.
        None: with ``auto`` that of `spread.floors` for the class of the scene, half the
        spread of the choices that all fidelities share.

    Returns
    -------
    Decision
        The scene that answers, its fidelity, what is known of it, and why.
    """
    if is_sustained(scene):
        return _sustained(scene, tolerance)
    return _leaving(scene, tolerance)


def _sustained(scene: Scene, tolerance: float | None) -> Decision:
    """The decision on a scene whose grains must go on.

    A single grain is answered by the closed form, a bed whose rows have no end by the
    closed form along its line, and all others as those whose grains must leave.
    """
    resolved = with_criterion(scene)
    if not scene.method.is_open:
        decision = _leaving(resolved, tolerance)
    elif not isinstance(scene.bed, PileBed):
        answer = _by(resolved, methods.PIVOT)
        return Decision(scene, answer, None, UNKNOWN, HOPS)
    elif has_endless_rows(scene):
        decision = _along_the_bed(resolved, tolerance)
    else:
        decision = _leaving(resolved, tolerance)
    return replace(decision, asked=scene)


def _along_the_bed(scene: Scene, tolerance: float | None) -> Decision:
    """The decision on grains in sustained motion over rows without an end.

    They are answered in closed form. A tolerance chooses the mesh of the flow.
    """
    answer = _by(scene, methods.LOCAL)
    written = Decision(scene, answer, LOCAL, known(LOCAL, answer), ENDLESS)
    if tolerance is None:
        return written
    beyond = unmeasured(answer)
    if beyond and answer.method.flow.facts.is_solved:
        return _with_reason(written, f"{NOT_MET} for {beyond}")
    return _on_chosen_mesh(written, _ways_on_meshes(answer), tolerance)


def _on_chosen_mesh(
    written: Decision, ways: Iterable[Way], tolerance: float
) -> Decision:
    """A decision whose flow, alone, is solved on the mesh that a tolerance chooses."""
    model = written.scene.method.flow.facts
    if not model.follows_bed:
        return written
    if not model.is_solved:
        return _with_reason(written, f"the study asks for the flow model {model.name}")
    known_ways = [one for one in ways if math.isfinite(one.known.total)]
    if not known_ways:
        return written
    offers = choice.offered(known_ways, choice.cost_s(written.scene))
    if not offers:
        return _with_reason(written, NONE_CHEAPER)
    way = choice.chosen(offers, tolerance)
    meshes = [_as_mesh(one, written.scene) for one in known_ways]
    said = choice.in_words(_as_mesh(way, written.scene), meshes, tolerance)
    why = f"{written.why}; its flow: {said}"
    return Decision(
        written.asked, way.answer, way.fidelity, way.known, why, is_chosen=True
    )


def _as_mesh(way: Way, written: Scene) -> Way:
    """A way that is called by its mesh, the only choice where the grains are given."""
    name = f"the mesh of {way.fidelity.flow.name}"
    if way.answer == written:
        name = "the mesh as written"
    return replace(way, fidelity=replace(way.fidelity, name=name))


def _with_reason(decision: Decision, why: str) -> Decision:
    """The decision with one reason more."""
    return replace(decision, why=f"{decision.why}; {why}")


def _by(scene: Scene, method: ThresholdMethod) -> Scene:
    """The scene by a method, refused as a study file would be."""
    return changed(scene, {"method.kind": method.name})


def with_criterion(scene: Scene) -> Scene:
    """A scene with the criterion by which a study answers it.

    Returns
    -------
    Scene
        The scene, whose grains must go on where its fluid and its forces decide so.
    """
    if not is_sustained(scene):
        return scene
    return changed(scene, {"threshold.criterion": SUSTAINED})


def has_endless_rows(scene: Scene) -> bool:
    """Whether a pile is a lattice whose rows end at no edge, and none asks for grains.

    Parameters
    ----------
    scene
        A pile.

    Returns
    -------
    bool
        Whether the closed form along its line answers it.
    """
    if not has_rows_along(scene) or scene.forces.sheltering != "none":
        return False
    assert isinstance(scene.bed, PileBed)
    if scene.bed.is_wedge:
        return False
    of_grains = [name for name in NUMBERS if name.startswith("method.grains.")]
    return all(value_of(scene, name) == NUMBERS[name] for name in of_grains)


def _leaving(scene: Scene, tolerance: float | None) -> Decision:
    """The decision on a scene whose grains are counted as they leave."""
    if not isinstance(scene.bed, PileBed):
        return _of_grain(scene, tolerance)
    if tolerance is not None and not _may_be_by_dem(scene):
        return _on_chosen_mesh(as_written(scene), _ways_on_meshes(scene), tolerance)
    why_as_written = _why_as_written(scene, tolerance)
    if why_as_written is not None:
        return as_written(scene, why_as_written)
    ways = [*_ways(scene)]
    if not ways:
        return as_written(scene, "no error is known for such a bed")
    offers = choice.offered(ways, choice.cost_s(written(scene)))
    if not offers:
        return as_written(scene, NONE_CHEAPER)
    most = tolerance
    if most is None:
        most = floor_of(scene).error
    way = choice.chosen(offers, most)
    why = choice.in_words(way, ways, most)
    if tolerance is None:
        why = (
            f"chosen by default, for the model's own spread of {floor_of(scene)}: {why}"
        )
    return Decision(scene, way.answer, way.fidelity, way.known, why, is_chosen=True)


def floor_of(scene: Scene) -> spread.Floor:
    """Find the error below which the model's own uncertainty hides the numerics.

    Parameters
    ----------
    scene
        The scene of a pile of a class that was measured.

    Returns
    -------
    Floor
        The error, and how many scenes it rests on.
    """
    return spread.floors()[spread.model_class(scene)]


def as_written(scene: Scene, why: str = "") -> Decision:
    """Decide to answer a scene as it is written.

    Parameters
    ----------
    scene
        The scene.
    why
        A reason in words, beside that of the method.

    Returns
    -------
    Decision
        The decision.
    """
    answer = written(scene)
    why = "; ".join(filter(None, (method_of(scene)[1], why)))
    if not isinstance(answer.bed, PileBed):
        return Decision(scene, answer, None, UNKNOWN, why)
    fidelity = fidelity_of(answer)
    by_dem = answer.method.is_resolved_in_time
    beyond = unmeasured(answer, by_dem=by_dem)
    if beyond:
        why = f"{why}; no error is known for {beyond}"
    return Decision(scene, answer, fidelity, known(fidelity, answer), why)


def of_unknown_error(
    decision: Decision, fraction: float, tolerance: float | None
) -> str:
    """Say what helps where the numerical error of a threshold is not known.

    Parameters
    ----------
    decision
        The decision on its scene.
    fraction
        Fraction n/N of the counted grains.
    tolerance
        The tolerance of the study, if it has one.

    Returns
    -------
    str
        Where the study asks for a method, and the program would choose one whose error
        is known, the remedy names that one; else it names the command that estimates
        the error.
    """
    asked = decision.asked
    if not asked.method.is_open:
        free = _left_open(asked, tolerance)
        if free is not None and free.error_at(fraction) is not None:
            chosen = f"the program then chooses the method {free.scene.method.kind}"
            is_known = "whose numerical error on such a bed is known"
            return f"leave method.kind out: {chosen}, {is_known}"
    return ESTIMATE


@cache
def _left_open(scene: Scene, tolerance: float | None) -> Decision | None:
    """The decision on a scene without the method that it asks for, if it may be so."""
    try:
        free = changed(scene, {"method.kind": default_of("method.kind")})
        return decide(free, tolerance)
    except InputError:
        return None


def on_fidelity(
    scene: Scene, fidelity: Fidelity, why: str, *, is_chosen: bool = False
) -> Decision:
    """Decide to answer a pile by a fidelity.

    Parameters
    ----------
    scene
        The scene of a pile.
    fidelity
        The fidelity.
    why
        The reason, in words.
    is_chosen
        Whether it was chosen by its numerical error.

    Returns
    -------
    Decision
        The decision.
    """
    found = known(fidelity, scene)
    return Decision(scene, fidelity.answer(scene), fidelity, found, why, is_chosen)


@cache
def written(scene: Scene) -> Scene:
    """A scene as it is written, with the method that answers in place of ``auto``."""
    if not scene.method.is_open:
        return scene
    return _by(scene, method_of(scene)[0])


@cache
def method_of(scene: Scene) -> tuple[ThresholdMethod, str]:
    """The method that answers a scene as it is written, and why.

    For ``auto`` that is DEM where it can: not on a lattice of more than
    `LONGEST_PACKED` grains, nor with what DEM does not know. There it is the closed
    form along the bed, else peeling, else pivots.
    """
    bed = scene.bed
    if not scene.method.is_open:
        method = scene.method.facts
        return method, f"the study asks for the method {method.name}"
    misfit = methods.DEM.misfit(scene)
    if not isinstance(bed, PileBed):
        if scene.threshold.criterion == SUSTAINED:
            return methods.PIVOT, HOPS
        if misfit:
            return methods.PIVOT, f"by the closed form: {misfit.what}"
        return methods.DEM, "by DEM: a single grain"
    if is_along(scene):
        return methods.LOCAL, ALONG
    if misfit and bed.width:
        why = f"by pivots: {misfit.what}, peeling no bed in space"
        return methods.PIVOT, why
    if misfit:
        return methods.PEELING, f"by peeling: {misfit.what}"
    if _is_long(scene):
        return methods.PEELING, f"by peeling: {LONG_BED}"
    return methods.DEM, "by DEM"


def is_along(scene: Scene) -> bool:
    """Whether a pile has too many grains for DEM, and the closed form may answer it.

    Its rows have to lie along the bed, and each grain has to feel the flow by itself.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    bool
        Whether it may.
    """
    if not has_rows_along(scene) or scene.threshold.update:
        return False
    return scene.forces.sheltering == "none" and _is_long(scene)


@cache
def _is_long(scene: Scene) -> bool:
    """Whether it is a lattice of too many grains for DEM."""
    is_lattice = isinstance(scene.bed, PileBed) and not scene.is_poured
    return is_lattice and Geometry(scene).length > LONGEST_PACKED


def _of_grain(scene: Scene, tolerance: float | None) -> Decision:
    """The decision on a single grain: with a tolerance by an exact closed form."""
    plain = as_written(scene)
    if tolerance is None or not plain.scene.method.is_resolved_in_time:
        return plain
    if scene.method.grains.waiting_time < HELD_FROM:
        return as_written(scene, "the study asks for a flow that rises steadily")
    if scene.bed.slope_deg > scene.bed.entrainment_angle_deg:
        return as_written(
            scene, "a slope beyond the entrainment angle: the closed form does not hold"
        )
    exact = _by(scene, methods.PIVOT)
    return Decision(scene, exact, None, UNKNOWN, EXACT, is_chosen=True)


def _why_as_written(scene: Scene, tolerance: float | None) -> str | None:
    """Why a pile is answered as it is written; None where a fidelity may be chosen.

    It is empty where the method says it all.
    """
    if not _may_be_by_dem(scene):
        return ""
    is_open = scene.method.is_open
    if is_open and (methods.DEM.misfit(scene) or is_along(scene)):
        return ""
    if tolerance is None:
        if not is_open:
            return ""
        if why := _why_not_by_default(scene):
            return why
    # the fidelities approximate DEM in a held, solved flow
    if scene.method.flow.facts is not _best_model(scene):
        return f"the study asks for the flow model {scene.method.flow.model}"
    if scene.method.grains.waiting_time < HELD_FROM:
        return "the study asks for a flow that rises steadily"
    # the decision on the scene as it is written has the reason
    return "" if unmeasured(scene) else None


def _may_be_by_dem(scene: Scene) -> bool:
    """Whether a pile leaves its grains to DEM, or to what stands for it."""
    return any(each.is_resolved_in_time for each in scene.method.candidates)


def _why_not_by_default(scene: Scene) -> str:
    """Why no fidelity is chosen for a pile without a method and a tolerance."""
    if scene.is_poured:
        return "a poured bed"
    for name, default in NUMBERS.items():
        if value_of(scene, name) != default:
            return f"{name} is not its default"
    if spread.model_class(scene) not in spread.floors():
        return "the model's own spread on such a bed is not known"
    return ""


def _best_model(scene: Scene) -> FlowModel:
    """The flow model of the best fidelities: over a level bed no flow is solved."""
    assert isinstance(scene.bed, PileBed)
    return models.FLAT if scene.bed.is_level else models.SOLVE


def _ways(scene: Scene) -> Iterator[Way]:
    """The ways to answer a pile whose errors are known, the scene as written first."""
    own = written(scene)
    found = known(fidelity_of(own), own)
    if math.isfinite(found.total):
        yield Way(fidelity_of(own), own, found, choice.cost_s(own))
    is_long = scene.method.is_open and _is_long(scene)
    seen = set()
    for one in PAIRS:
        pair = (one.flow_over(scene), one.grains)
        if pair in seen or (is_long and one.is_resolved_in_time):
            continue
        seen.add(pair)
        if one.takes(scene):
            found = known(one, scene)
            if math.isfinite(found.total):
                answer = one.answer(scene)
                yield Way(one, answer, found, choice.cost_s(answer))


def _ways_on_meshes(scene: Scene) -> Iterator[Way]:
    """A scene as it is written, and with each rung of the flow in place of its own."""
    own = fidelity_of(scene)
    yield Way(own, scene, known(own, scene), choice.cost_s(scene))
    for flow in {
        one.flow_over(scene).name: one.flow_over(scene) for one in PAIRS
    }.values():
        if flow.takes(scene):
            answer = changed(scene, flow.changes(scene))
            found = known(fidelity_of(answer), answer)
            yield Way(_on_flow(own, flow, scene), answer, found, choice.cost_s(answer))


def _on_flow(own: Fidelity, flow: Rung, scene: Scene) -> Fidelity:
    """The fidelity of given grains on a rung of the flow: that of a name, if any."""
    for one in PAIRS:
        if one.flow_over(scene) is flow and one.grains.describes(scene):
            return one
    return replace(own, name=f"{flow.name} flow", flow=flow)


CHECKS = 19
"""Checks by DEM in a study: where none of so many drawn ones contradicts, 95 % of such
groups, the share that a numerical error holds, are known to have no contradiction."""


def _check_group(scene: Scene) -> tuple[object, ...]:
    """What piles have in common of which DEM checks one: slope, force law, errors."""
    classes = [scene_class(part, scene) for part in (FLOW, GRAINS)]
    return (scene.bed.slope_deg, scene.forces.law, *classes)


def checks(answers: Iterable[Decision]) -> dict[str, Decision]:
    """Choose the piles by DEM that check answers without it.

    Of each group it is the pile that DEM, as the scene is written, answers in the least
    time. A check is the answer of the same scene with ``method.kind = "dem"``, by the
    same criterion of motion. A group is checked only where that costs less than all its
    scenes as they are written: a scene by itself is therefore never checked, since DEM
    would then answer it at the same cost. Of a study with many groups `CHECKS` are
    drawn, and at least one of each class of numerical errors.

    Parameters
    ----------
    answers
        The decisions on all scenes.

    Returns
    -------
    dict of str to Decision
        The checks, by the id of the asked scene.
    """
    groups: dict[tuple[object, ...], list[Decision]] = {}
    for answer in answers:
        if answer.is_unchecked:
            groups.setdefault(_check_group(answer.asked), []).append(answer)
    of_class: dict[object, list[tuple[str, Scene]]] = {}
    for (_, _, *classes), members in groups.items():
        by_dem = [(one.asked.id, _by(one.asked, methods.DEM)) for one in members]
        asked, dem = min(by_dem, key=lambda one: (Pile(one[1]).case.cost_s, one[0]))
        if _is_worth(dem, members):
            of_class.setdefault(tuple(classes), []).append((asked, dem))
    turns = []
    for each in of_class.values():
        # an id is a digest of what is asked: its order is a draw
        each.sort(key=lambda one: one[0])
        turns += [(turn, asked, dem) for turn, (asked, dem) in enumerate(each)]
    turns.sort(key=lambda one: one[:2])
    why = "it checks an answer without DEM"
    found = {}
    for _, asked, dem in turns[: max(CHECKS, len(of_class))]:
        found[asked] = replace(decide(dem, None), why=why)
    return found


def _is_worth(check: Scene, members: Iterable[Decision]) -> bool:
    """Whether answers with their check cost less than all of them as written."""
    spent = choice.runs_of(check)
    saved: dict[str, float] = {}
    for one in members:
        spent |= choice.runs_of(one.scene)
        saved |= choice.runs_of(written(one.asked))
    return sum(spent.values()) < sum(saved.values()) * (1 - 1e-9)
