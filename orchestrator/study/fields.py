"""The registry of the fields of a scene: what follows from where each is declared."""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

from pydantic.fields import FieldInfo

from orchestrator.study.closed_form import regime_of
from orchestrator.study.parts import Gusts, Info, LogNormal, Part, PileBed
from orchestrator.study.profile import Profile
from orchestrator.study.scene import CLOSED, Scene

PARTS: Mapping[str, type[Part]] = {
    name: PileBed if name == "bed" else declared.annotation  # type: ignore[misc]
    for name, declared in Scene.model_fields.items()
}
"""The tables of a study file; a bed of one grain has no field that a pile has not."""
ANSWERED = "answered_"
"""Before the column of a field: its value in the scene that was run in place of the one asked."""


@dataclass(frozen=True)
class Quantity:
    """A field of a study file, or a quantity that follows from fields."""

    name: str  # as a study file writes it, such as bed.slope_deg; empty for one that follows
    column: str  # of the tables
    info: Info
    meaning: str
    read: Callable[[Scene], Any]  # its value in a scene, None where that leaves it open

    def asked(self, scene: Scene) -> Any:
        """Its value as a scene asks for it; None where it has no effect.

        What a scene leaves open of the question is its default, of the way to answer it None.
        """
        if not APPLIES[self.info.scope](scene):
            return None
        if self.info.about == "question" and self.info.read:
            return plain(getattr(scene, self.info.read))
        return plain(self.read(scene))

    def used(self, scene: Scene) -> Any:
        """Its value as a scene uses it; None where it has no effect."""
        if self.info.read and APPLIES[self.info.scope](scene):
            return getattr(scene, self.info.read)
        return self.asked(scene)

    @property
    def phrase(self) -> str:
        """Its meaning with its unit, its scope and the meaning of its words."""
        unit = f", {self.info.unit}" if self.info.unit else ""
        scope = "" if self.info.scope == "every scene" else f" ({self.info.scope})"
        words = (f"; {word}: {meaning}" for word, meaning in self.info.choices.items())
        return f"{self.meaning}{unit}{scope}{''.join(words)}"


def plain(value: Any) -> Any:
    """A value as a cell of a table: words and numbers stay, all else becomes a text."""
    if isinstance(value, tuple):
        # a class of a sieve table: diameter and part of the mass
        classes = (
            f"{1e3 * e[0]:g} mm {100 * e[1]:g} %" if type(e) is tuple else e
            for e in value
        )
        return "; ".join(map(str, classes)) or None
    return str(value) if isinstance(value, Profile | LogNormal | Gusts) else value


def _of_piles(condition: Callable[[Scene, PileBed], Any]) -> Callable[[Scene], bool]:
    return lambda scene: (
        isinstance(scene.bed, PileBed) and bool(condition(scene, scene.bed))
    )


RANDOM = ("disordered", "poured")
MAYBE_DEM = ("dem", "auto")
APPLIES: Mapping[str, Callable[[Scene], bool]] = {
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
    "solved flows": _of_piles(lambda scene, bed: scene.flow.model == "solve"),
    "DEM": lambda scene: scene.protocol.method in MAYBE_DEM,
    "DEM of piles": _of_piles(lambda scene, bed: scene.protocol.method in MAYBE_DEM),
    "DEM and peeling": lambda scene: scene.protocol.method not in CLOSED,
    "DEM and peeling of piles": _of_piles(
        lambda scene, bed: scene.protocol.method not in CLOSED
    ),
}
"""The scenes on which a field has an effect, by the `scope` of its `Info`."""


def _quantity(part: str, name: str, declared: FieldInfo) -> Quantity:
    info = next(each for each in declared.metadata if isinstance(each, Info))
    text, *words = (declared.description or "").split("\n- ")
    choices = info.choices or dict(word.split(": ", 1) for word in words)
    label = info.label or name.removesuffix("_deg").replace("_", " ")
    info, read = (
        replace(info, label=label, choices=choices),
        attrgetter(f"{part}.{name}"),
    )
    return Quantity(
        f"{part}.{name}", info.column or name, info, " ".join(text.split()), read
    )


FIELDS: tuple[Quantity, ...] = tuple(
    _quantity(part, name, declared)
    for part, model in PARTS.items()
    for name, declared in model.model_fields.items()
)
"""Every field of a study file, in the order of the file."""
_REGIME = "forces that are valid at the threshold of a single grain of the scene, or transition"
_RATIO, _Z0 = "roughness length over diameter", Info("roughness length", "z_0", "d")
DERIVED = (
    # rounded: d/30 over d is not 1/30 to the last digit, and figures group by it
    Quantity(
        "",
        "z0_over_d",
        _Z0,
        _RATIO,
        lambda s: round(s.bed.roughness / s.grain.diameter, 9),
    ),
    Quantity("", "regime", Info("regime"), _REGIME, regime_of),
)
COLUMNS: Mapping[str, Quantity] = {
    each.column: each for each in (*FIELDS, *DERIVED) if each.column != "-"
}
"""By the columns of a table: what a scene asks for."""
ANSWERS: Mapping[str, Quantity] = {
    f"{ANSWERED}{column}": each
    for column, each in COLUMNS.items()
    if each.info.about == "answer"
}
"""By the columns of a table: how a scene was answered."""
FOLLOW = (
    "z0_m",
    "regime",
    *(column for column, each in ANSWERS.items() if each.info.read),
)
"""Columns that follow from others: of the two roughness lengths, the ratio to the diameter tells
beds apart that are alike but for the size of their grains."""


def asked(scene: Scene) -> dict[str, Any]:
    """Values that a scene asks for, by column."""
    return {column: each.asked(scene) for column, each in COLUMNS.items()}


def answered(scene: Scene) -> dict[str, Any]:
    """How the scene that was run answers, by column."""
    return {column: each.used(scene) for column, each in ANSWERS.items()}


def used(scene: Scene) -> dict[str, Any]:
    """All quantities of a scene, by column; what it leaves open is worked out."""
    return {column: each.used(scene) for column, each in COLUMNS.items()}


def others(columns: Iterable[Hashable], *but: str) -> list[str]:
    """The columns of fields among some, but for a few and for those that follow from others."""
    rest = set(columns) - {*but, *FOLLOW}
    return [column for column in (*COLUMNS, *ANSWERS) if column in rest]
