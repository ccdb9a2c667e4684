"""The decision how a scene is answered: a look-up by the scene and the tolerance of its study.

The decision depends on the values of the scene's fields and on the tolerance. It depends neither on
other scenes of the study and their order, nor on how a study file spells the values: ``auto``, the
default of `protocol.method`, is a value like any other.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

from orchestrator.fidelity import levels
from orchestrator.fidelity.levels import (
    FLAT,
    FLOW,
    GRAINS,
    LOCAL,
    Known,
    Level,
    Pair,
    changed,
    pair_of,
    value_of,
)
from orchestrator.grains.loads import LONG, Geometry, has_rows_along
from orchestrator.grains.pile import Pile
from orchestrator.study.fields import FIELDS, PARTS
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

Names = tuple[str, ...]
LEAST_HELD = (
    6.0  # waiting time, sqrt(d/g'), below which load steps are a ramp of the flow
)
EXACT = "the closed form is exact for a single grain in a held flow"
LONG_BED = f"more than {LONG:g} grains long"
ALONG = f"{LONG_BED}: closed form along the bed, checked where motion starts"
KEPT = ("flow.speed", "flow.viscosity")
"""Numbers of the solve that every level keeps: u*/U_e is the same at each of them (docs/flow.md).
Their values do not ask for DEM."""
_NUMBERS = [
    field.name.split(".")
    for field in FIELDS
    if field.info.about == "answer"
    and field.name not in ("protocol.method", "flow.model", *KEPT)
]
NUMBERS = {
    f"{part}.{name}": PARTS[part].model_fields[name].default for part, name in _NUMBERS
}
"""Fields of mesh, contact, load steps and mobile layers, with the defaults of a lattice: a scene in
which one has another value is answered by DEM, which uses it."""


@dataclass(frozen=True)
class Decision:
    """How the scene `asked` for is answered: by the `scene`, whose method is never ``auto``.

    The `levels` (None for a single grain) with their `known` error of tau_c; why; and whether these
    levels were chosen by their known errors, in place of what the scene has written.
    """

    asked: Scene
    scene: Scene
    levels: Pair | None
    known: Known
    why: str
    is_chosen: bool = False

    @property
    def error_estimate(self) -> float | None:
        """The known error with its uncertainty; None where it is not known."""
        if math.isinf(self.known.total):
            return None
        return self.known.total

    @property
    def is_along(self) -> bool:
        """Whether the closed form along the bed answers because the bed is long."""
        is_local = self.levels is not None and self.levels.grains is LOCAL
        return is_local and self.asked.protocol.method == "auto"

    @property
    def is_unchecked(self) -> bool:
        """Whether it is a pile for which levels without DEM were chosen."""
        is_pile = isinstance(self.scene.bed, PileBed)
        return is_pile and self.is_chosen and self.scene.protocol.method != "dem"


def decide(scene: Scene, tolerance: float | None) -> Decision:
    """How a resolved scene is answered.

    The methods ``auto`` and, with a tolerance, ``dem`` are answered by the cheapest levels with a
    solved flow that are known to be good enough. All other scenes are answered as they are written:
    those whose method or flow model says how, those for which no error is known, and with ``auto``
    those in which one of `NUMBERS` has another value than its default.

    Parameters
    ----------
    scene
        A scene with one force law.
    tolerance
        Relative error that tau_c may have, the uncertainty of its reference included. None: with
        ``auto`` the least of `levels.floors`, half the spread of the choices that all levels share.

    Returns
    -------
    Decision
        The scene that answers, its levels, what is known of them, and why.
    """
    if not isinstance(scene.bed, PileBed):
        return _of_grain(scene, tolerance)
    why_as_written = _why_as_written(scene, tolerance)
    if why_as_written is not None:
        return as_asked(scene, why_as_written)
    if tolerance is None:
        most = min(levels.floors().values())
        start, limit = (
            "chosen by default: ",
            f"within the model's own spread of {most:.0%}",
        )
    else:
        most, start, limit = tolerance, "", "within the tolerance"
    pair, why = _looked_up(scene, most)
    if pair is None:
        return as_asked(scene, why)
    known = levels.known(pair, scene)
    answer = pair.answer(scene)
    return Decision(scene, answer, pair, known, f"{start}{why} {limit}", is_chosen=True)


def as_asked(scene: Scene, why: str = "") -> Decision:
    """The decision to answer a scene as it is written; `why` says more than its method does."""
    answer = written(scene)
    why = "; ".join(filter(None, (method_of(scene)[1], why)))
    if not isinstance(answer.bed, PileBed):
        return Decision(scene, answer, None, levels.UNKNOWN, why)
    pair = pair_of(answer)
    unmeasured = levels.unmeasured(answer)
    if unmeasured and unmeasured not in why:
        why = f"{why}; no error is known for {unmeasured}"
    return Decision(scene, answer, pair, levels.known(pair, answer), why)


def on_levels(scene: Scene, pair: Pair, why: str) -> Decision:
    """The decision to answer a pile on a pair of levels."""
    return Decision(scene, pair.answer(scene), pair, levels.known(pair, scene), why)


@cache
def written(scene: Scene) -> Scene:
    """A scene with the method that answers it as it is written, in place of ``auto``."""
    if scene.protocol.method != "auto":
        return scene
    return changed(scene, {"protocol.method": method_of(scene)[0]})


@cache
def method_of(scene: Scene) -> tuple[str, str]:
    """The method that answers a scene as it is written, and why.

    For ``auto`` that is DEM where it can: not on a lattice of more than `LONG` grains, nor with
    what DEM does not know. There it is the closed form along the bed, else peeling, else pivots.
    """
    method, bed = scene.protocol.method, scene.bed
    if method != "auto":
        return method, f"the study asks for the method {method}"
    unknown = scene.unknown_to_dem
    if not isinstance(bed, PileBed):
        if unknown:
            return "pivot", f"by the closed form: {unknown}"
        return "dem", "by DEM: a single grain"
    if is_along(scene):
        return "local", ALONG
    if scene.is_turned:
        return "pivot", f"by pivots: {unknown}"
    if unknown and bed.width:
        return "pivot", f"by pivots: {unknown}, peeling no bed in space"
    if unknown:
        return "peeling", f"by peeling: {unknown}"
    if _is_long(scene):
        return "peeling", f"by peeling: {LONG_BED}"
    return "dem", "by DEM"


def is_along(scene: Scene) -> bool:
    """Whether the closed form along the bed may answer a pile, which has too many grains for DEM.

    Its rows have to lie along the bed, and each grain has to feel the flow by itself.
    """
    if not has_rows_along(scene) or scene.protocol.update:
        return False
    return scene.forces.sheltering == "none" and _is_long(scene)


@cache
def _is_long(scene: Scene) -> bool:
    """Whether it is a lattice of too many grains for DEM."""
    is_lattice = isinstance(scene.bed, PileBed) and not scene.is_poured
    return is_lattice and Geometry(scene).length > LONG


def _of_grain(scene: Scene, tolerance: float | None) -> Decision:
    """The decision on a single grain: with a tolerance the closed form, where it is exact."""
    as_written = as_asked(scene)
    if tolerance is None or as_written.scene.protocol.method != "dem":
        return as_written
    if scene.protocol.waiting_time < LEAST_HELD:
        return as_asked(scene, "the study asks for a ramp of the flow")
    if scene.bed.slope_deg > scene.bed.entrainment_angle_deg:
        return as_asked(
            scene, "a slope beyond the entrainment angle: the closed form is off"
        )
    exact = changed(scene, {"protocol.method": "pivot"})
    return Decision(scene, exact, None, levels.UNKNOWN, EXACT, is_chosen=True)


def _why_as_written(scene: Scene, tolerance: float | None) -> str | None:
    """Why a pile is answered as it is written; None where levels may be chosen for it.

    It is empty where the method says it all.
    """
    method = scene.protocol.method
    if method not in ("auto", "dem"):
        return ""
    if method == "auto" and (scene.unknown_to_dem or is_along(scene)):
        return ""
    if tolerance is None:
        if method == "dem":
            return ""
        if why := _why_not_by_default(scene):
            return why
    # the levels approximate DEM in a held, solved flow
    if scene.flow.model != _best_model(scene):
        return f"the study asks for the flow model {scene.flow.model}"
    if scene.protocol.update:
        return "no error is known for a bed that changes"
    if scene.protocol.waiting_time < LEAST_HELD:
        return "the study asks for a ramp of the flow"
    if unmeasured := levels.unmeasured(scene):
        return f"no error is known for {unmeasured}"
    return None


def _why_not_by_default(scene: Scene) -> str:
    """Why no levels are chosen for a pile where neither method nor tolerance is given."""
    if scene.is_poured:
        return "a poured bed"
    for name, default in NUMBERS.items():
        if value_of(scene, name) != default:
            return f"{name} is not its default"
    if levels.model_class(scene) not in levels.floors():
        return "the model's own spread on such a bed is not known"
    return ""


def _best_model(scene: Scene) -> str:
    """The flow model of the best levels: over a level bed no flow is solved."""
    assert isinstance(scene.bed, PileBed)
    return "flat" if scene.bed.is_level else "solve"


def _looked_up(scene: Scene, most: float) -> tuple[Pair | None, str]:
    """The pair of levels that answers a pile with a known error of at most `most`, and why it."""
    classes = (levels.classes("flow", scene), levels.classes("grains", scene))
    flows = [level for level in FLOW if level.is_offered and level.takes(scene)]
    if classes[0] == (levels.LEVEL_BED,):
        flows = [FLAT]
    grains = [level for level in GRAINS if level.is_offered and level.takes(scene)]
    if scene.protocol.method == "auto" and _is_long(scene):
        grains = [level for level in grains if level.sets["protocol.method"] != "dem"]
    return _cheapest(tuple(flows), tuple(grains), classes, most)


@cache  # a study has thousands of scenes of a few classes
def _cheapest(
    flows: Sequence[Level],
    grains: Sequence[Level],
    classes: tuple[Names, Names],
    most: float,
) -> tuple[Pair | None, str]:
    """The cheapest pair of some levels with a known error of at most `most`, and why it is taken.

    Where there is none, it is the cheapest whose error is below the uncertainty of the reference,
    or no pair where no error is known.
    """
    pairs = [Pair(*both) for both in itertools.product(flows, grains)]
    known = {pair: levels.known_of_classes(*pair, *classes) for pair in pairs}
    pairs = [pair for pair in pairs if math.isfinite(known[pair].total)]
    if not pairs:
        return None, "no error is known for such a bed"

    def cost(pair: Pair) -> float:
        return known[pair].cost_core_s

    within = [pair for pair in pairs if known[pair].total <= most]
    if within:
        return min(within, key=cost), "cheapest"
    # errors below the uncertainty of the reference cannot be ranked, but those of flows can
    best = min(pairs, key=lambda pair: known[pair].total)
    exact = GRAINS[-1]
    flow_error = {
        pair: levels.known_of_classes(pair.flow, exact, *classes).error
        for pair in pairs
    }
    alike = [
        pair
        for pair in pairs
        if known[pair].error <= known[best].total
        and flow_error[pair] <= max(most, flow_error[best])
    ]
    why = "cheapest whose error is below the uncertainty of the reference: none is"
    return min(alike, key=cost), why


def _check_group(scene: Scene) -> tuple[object, ...]:
    """What the piles have in common of which DEM checks one: slope, force law, known errors."""
    classes = (levels.scene_class(part, scene) for part in levels.LEVELS)
    return (scene.bed.slope_deg, scene.forces.law, *classes)


def checks(answers: Iterable[Decision]) -> dict[str, Decision]:
    """The decisions on the piles by DEM that check answers without it, by the id of the asked.

    Of each group it is the pile that DEM, as the scene is written, answers in the least time.
    """
    cheapest: dict[object, tuple[float, str, Scene]] = {}
    for answer in answers:
        if not answer.is_unchecked:
            continue
        dem = changed(answer.asked, {"protocol.method": "dem"})
        member = (Pile(dem).case.cost_s, answer.asked.id, dem)
        group = _check_group(answer.asked)
        cheapest[group] = min(
            cheapest.get(group, member), member, key=lambda one: one[:2]
        )
    why = "it checks an answer without DEM"
    return {asked: as_asked(dem, why) for _, asked, dem in cheapest.values()}
