"""On which scenes a field has an effect, and scenes without those that have none."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from orchestrator.study.declare import Info, Part
from orchestrator.study.method import Method
from orchestrator.study.parts import Forces, GrainBed, PileBed

Each = TypeVar("Each", bound=Part)
CLOSED = ("pivot", "local")
"""Methods without contacts: nothing that moves changes the bed."""
RANDOM = ("disordered", "poured")
MAYBE_DEM = ("dem", "auto")


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
    "solved flows": _of_piles(lambda scene, bed: scene.method.flow.model == "solve"),
    "flows that change along the bed, and shared stress": _of_piles(
        lambda scene, bed: (
            scene.method.flow.model != "flat" or scene.forces.sheltering != "none"
        )
    ),
    "DEM": lambda scene: scene.method.kind in MAYBE_DEM,
    "DEM of piles": _of_piles(lambda scene, bed: scene.method.kind in MAYBE_DEM),
    "DEM and peeling": lambda scene: scene.method.kind not in CLOSED,
    "DEM and peeling of piles": _of_piles(
        lambda scene, bed: scene.method.kind not in CLOSED
    ),
}
"""The scenes on which a field has an effect, by the `scope` of its `Info`."""


def effective(part: Each, scene: Asked) -> Each:
    """Give a part of a scene the defaults of the fields that have no effect on it.

    Parameters
    ----------
    part
        The scene or a part of it.
    scene
        The scene.

    Returns
    -------
    Part
        The part; a copy if a field has another value.
    """
    changed: dict[str, Any] = {}
    for name, declared in type(part).model_fields.items():
        value = getattr(part, name)
        if isinstance(value, Part):
            inner = effective(value, scene)
            if inner is not value:
                changed[name] = inner
        for info in declared.metadata:
            is_field = isinstance(info, Info)
            if (
                is_field
                and value != declared.default
                and not APPLIES[info.scope](scene)
            ):
                changed[name] = declared.default
    return part.model_copy(update=changed) if changed else part
