"""On which scenes a field has an effect, and those of a scene that have one."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from orchestrator.study.declare import Part, info_of
from orchestrator.study.method import Method
from orchestrator.study.parts import Forces, GrainBed, PileBed

RANDOM = ("disordered", "poured")


class Asked(Protocol):
    """What scopes know of a scene, which itself needs them."""

    @property
    def bed(self) -> GrainBed | PileBed:
        """Its bed."""

    @property
    def forces(self) -> Forces:
        """How its grains feel the flow."""

    @property
    def method(self) -> Method:
        """How it is answered."""

    @property
    def is_poured(self) -> bool:
        """Whether its grains are poured."""


def _of_piles(
    condition: Callable[[Asked, PileBed], Any],
) -> Callable[[Asked], bool]:
    return lambda scene: (
        isinstance(scene.bed, PileBed) and bool(condition(scene, scene.bed))
    )


def _may_be_resolved_in_time(scene: Asked) -> bool:
    return any(each.is_resolved_in_time for each in scene.method.candidates)


def _may_have_contacts(scene: Asked) -> bool:
    return any(each.has_contacts for each in scene.method.candidates)


APPLIES: Mapping[str, Callable[[Asked], bool]] = {
    "every scene": lambda scene: True,
    "single grains": lambda scene: not isinstance(scene.bed, PileBed),
    "piles": _of_piles(lambda scene, bed: True),
    "dunes": _of_piles(lambda scene, bed: "windward" in bed.form.fields),
    "beds with level parts": _of_piles(lambda scene, bed: "length" in bed.form.fields),
    "profiles": _of_piles(lambda scene, bed: bed.profile),
    "disordered piles": _of_piles(lambda scene, bed: bed.packing == "disordered"),
    "poured beds": lambda scene: scene.is_poured,
    "random beds and replicas": _of_piles(
        lambda _, bed: bed.packing in RANDOM or bed.is_replica
    ),
    "solved flows": _of_piles(lambda scene, bed: scene.method.flow.facts.is_solved),
    "flows that change along the bed, and shared stress": _of_piles(
        lambda scene, bed: (
            scene.method.flow.facts.follows_bed or scene.forces.sheltering != "none"
        )
    ),
    "DEM": _may_be_resolved_in_time,
    "DEM of piles": _of_piles(lambda scene, bed: _may_be_resolved_in_time(scene)),
    "DEM and peeling": _may_have_contacts,
    "DEM and peeling of piles": _of_piles(lambda scene, bed: _may_have_contacts(scene)),
}
"""The scenes on which a field has an effect, by the `scope` of its `Info`."""


def effective(part: Part, dumped: Mapping[str, Any], scene: Asked) -> dict[str, Any]:
    """List the fields of a part of a scene that have an effect on it.

    Parameters
    ----------
    part
        The scene or a part of it.
    dumped
        Its fields as JSON, all or some.
    scene
        The scene.

    Returns
    -------
    dict
        Those of them that have an effect, as JSON.
    """
    kept = {}
    for name, value in dumped.items():
        if not APPLIES[info_of(type(part).model_fields[name]).scope](scene):
            continue
        inner = getattr(part, name)
        kept[name] = (
            effective(inner, value, scene) if isinstance(inner, Part) else value
        )
    return kept
