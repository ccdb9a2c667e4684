"""On which scenes a field has an effect, and those of a scene that have one."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Protocol, TypeVar

from orchestrator.study.declare import Info, Part, info_of
from orchestrator.study.method import Method
from orchestrator.study.parts import Forces, GrainBed, PileBed

Each = TypeVar("Each", bound=Part)
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

    @property
    def is_followed(self) -> bool:
        """Whether DEM follows its grains as they roll and hop."""


def _of_piles(
    condition: Callable[[Asked, PileBed], Any],
) -> Callable[[Asked], bool]:
    return lambda scene: (
        isinstance(scene.bed, PileBed) and bool(condition(scene, scene.bed))
    )


def _of_shapes_with(name: str) -> Callable[[Asked], bool]:
    """Beds of a shape, and no profile, that has a field which not all shapes have."""
    return _of_piles(lambda _, bed: bed.profile is None and name in bed.form.fields)


def _may_be_resolved_in_time(scene: Asked) -> bool:
    return any(each.is_resolved_in_time for each in scene.method.candidates)


def _may_have_contacts(scene: Asked) -> bool:
    return any(each.has_contacts for each in scene.method.candidates)


APPLIES: Mapping[str, Callable[[Asked], bool]] = {
    "every scene": lambda scene: True,
    "single grains": lambda scene: not isinstance(scene.bed, PileBed),
    "piles": _of_piles(lambda scene, bed: True),
    "dunes": _of_shapes_with("windward"),
    "beds with level parts": _of_shapes_with("length"),
    "beds with a straight lee side": _of_shapes_with("lee_slope_deg"),
    "shapes of trains": _of_shapes_with("forms"),
    "profiles": _of_piles(lambda scene, bed: bed.profile),
    "disordered piles": _of_piles(lambda scene, bed: bed.packing == "disordered"),
    "poured beds": lambda scene: scene.is_poured,
    "strips that DEM follows": lambda scene: scene.is_followed,
    "random beds and replicas": _of_piles(
        lambda _, bed: bed.packing in RANDOM or bed.is_replica
    ),
    "solved flows": _of_piles(lambda scene, bed: scene.method.flow.facts.is_solved),
    "flows between others": _of_piles(
        lambda scene, bed: (
            scene.method.flow.facts.is_solved and scene.method.flow.between
        )
    ),
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


BY: Mapping[str, str] = {
    "single grains": 'bed.kind = "grain"',
    "piles": 'bed.kind = "pile"',
    "dunes": 'bed.shape = "dune"',
    "beds with level parts": "a bed.shape with a level part",
    "beds with a straight lee side": "a bed.shape with a straight lee side",
    "shapes of trains": "a bed.shape of which trains are made",
    "profiles": "name one by bed.profile",
    "disordered piles": 'bed.packing = "disordered"',
    "poured beds": 'bed.packing = "poured"',
    "strips that DEM follows": (
        'a level poured bed with bed.width and flow.gusts, method.kind = "dem" and '
        'threshold.criterion = "sustained"'
    ),
    "random beds and replicas": "a bed.packing",
    "solved flows": 'method.flow.model = "solve"',
    "flows between others": 'method.flow.model = "solve"',
    "flows that change along the bed, and shared stress": (
        'method.flow.model = "solve", or forces.sheltering'
    ),
    "DEM": 'method.kind = "dem"',
    "DEM of piles": 'method.kind = "dem" and a pile',
    "DEM and peeling": 'method.kind = "dem"',
    "DEM and peeling of piles": 'method.kind = "dem" and a pile',
}
"""What a study file has to say, for a field of a scope to have an effect."""


@cache
def _scoped(part: type[Part]) -> Mapping[str, tuple[Any, Callable[[Asked], bool]]]:
    """Default and condition of the fields of a part that not every scene has."""
    found = {}
    for name, declared in part.model_fields.items():
        scope = info_of(declared).scope
        if scope != Info.scope:
            found[name] = (declared.default, APPLIES[scope])
    return found


def blanked(part: Each, scene: Asked) -> Each:
    """Give a part of a scene the defaults of the fields that have no effect on it.

    Parameters
    ----------
    part
        The part.
    scene
        The scene.

    Returns
    -------
    Part
        The part; a copy if a field had another value.
    """
    changed: dict[str, Any] = {}
    for name, value in part:
        inner = blanked(value, scene) if isinstance(value, Part) else value
        if inner is not value:
            changed[name] = inner
    for name, (default, applies) in _scoped(type(part)).items():
        if getattr(part, name) != default and not applies(scene):
            changed[name] = default
    return part.model_copy(update=changed) if changed else part


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
    scoped = _scoped(type(part))
    for name, value in dumped.items():
        if name in scoped and not scoped[name][1](scene):
            continue
        inner = getattr(part, name)
        kept[name] = (
            effective(inner, value, scene) if isinstance(inner, Part) else value
        )
    return kept
