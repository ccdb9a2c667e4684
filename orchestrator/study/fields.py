"""The fields of a scene, listed from where they are declared, with what follows from them."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from pydantic.fields import FieldInfo

from orchestrator.study.closed_form import regime_of
from orchestrator.study.part import Info, Scope
from orchestrator.study.parts import Flow, Fluid, Forces, Grain, Part, PileBed, Protocol
from orchestrator.study.profile import Profile
from orchestrator.study.scene import Scene
from orchestrator.study.sizes import LogNormal

PARTS: Mapping[str, type[Part]] = {
    "fluid": Fluid,
    "grain": Grain,
    "bed": PileBed,
    "flow": Flow,
    "forces": Forces,
    "protocol": Protocol,
}
"""The tables of a study file; a bed of one grain has no field that a pile has not."""
NO_COLUMN = "-"
ANSWERED = "answered_"
"""Before the column of a field: its value in the scene that was run in place of the one asked."""


@dataclass(frozen=True)
class Quantity:
    """A field of a study file, or what follows from some.

    Attributes
    ----------
    name : str
        As a study file writes it, such as ``bed.slope_deg``; empty for what follows from fields.
    column : str
        What tables call it.
    info : Info
        Its words.
    meaning : str
        A phrase that says what it is.
    read : callable
        Its value in a scene, None where that leaves it open.
    """

    name: str
    column: str
    info: Info
    meaning: str
    read: Callable[[Scene], Any]

    def asked(self, scene: Scene) -> Any:
        """Its value as a scene asks for it; None where it is left open or has no effect."""
        return plain(self.read(scene)) if APPLIES[self.info.scope](scene) else None

    def used(self, scene: Scene) -> Any:
        """Its value as a scene uses it; None where it has no effect."""
        if self.info.read and APPLIES[self.info.scope](scene):
            return getattr(scene, self.info.read)
        return self.asked(scene)

    @property
    def phrase(self) -> str:
        """Its meaning with its unit, its scope and what its words stand for."""
        unit = f", {self.info.unit}" if self.info.unit else ""
        scope = "" if self.info.scope == "every scene" else f" ({self.info.scope})"
        words = "; ".join(f"{word}: {said}" for word, said in self.info.choices.items())
        return f"{self.meaning}{unit}{scope}" + (f"; {words}" if words else "")


def plain(value: Any) -> Any:
    """A value as a cell of a table: what is not a word or a number becomes a text."""
    if isinstance(value, tuple):
        return "; ".join(map(_text, value)) or None
    return str(value) if isinstance(value, Profile | LogNormal) else value


def _text(one: Any) -> str:
    """An entry of a list; of a sieve table a class, its diameter and part of the mass."""
    if isinstance(one, tuple):
        diameter, fraction = one
        return f"{1e3 * diameter:g} mm {100 * fraction:g} %"
    return str(one)


def _is_solved(scene: Scene) -> bool:
    return isinstance(scene.bed, PileBed) and scene.flow.model == "solve"


def _is_disordered(scene: Scene) -> bool:
    return isinstance(scene.bed, PileBed) and scene.bed.packing == "disordered"


APPLIES: Mapping[Scope, Callable[[Scene], bool]] = {
    "every scene": lambda scene: True,
    "single grains": lambda scene: not isinstance(scene.bed, PileBed),
    "piles": lambda scene: isinstance(scene.bed, PileBed),
    "dunes": lambda scene: isinstance(scene.bed, PileBed) and "windward" in scene.bed.form.fields,
    "beds with level parts": lambda scene: (
        isinstance(scene.bed, PileBed) and "length" in scene.bed.form.fields
    ),
    "profiles": lambda scene: isinstance(scene.bed, PileBed) and bool(scene.bed.profile),
    "disordered piles": _is_disordered,
    "poured beds": lambda scene: scene.is_poured,
    "random beds and replicas": lambda scene: (
        isinstance(scene.bed, PileBed)
        and (_is_disordered(scene) or scene.is_poured or scene.bed.is_replica)
    ),
    "solved flows": _is_solved,
    "DEM": lambda scene: scene.protocol.method == "dem",
    "DEM of piles": lambda scene: isinstance(scene.bed, PileBed) and scene.protocol.method == "dem",
    "DEM and peeling": lambda scene: scene.protocol.method != "pivot",
    "DEM and peeling of piles": lambda scene: (
        isinstance(scene.bed, PileBed) and scene.protocol.method != "pivot"
    ),
}


def info(declared: FieldInfo) -> Info:
    """The words that a field is declared with."""
    return next(one for one in declared.metadata if isinstance(one, Info))


def declared(one: Quantity) -> FieldInfo:
    """The declaration of a field: its range and its default."""
    part, _, name = one.name.partition(".")
    return PARTS[part].model_fields[name]


def _fields() -> Iterator[Quantity]:
    for part, model in PARTS.items():
        for name, declared in model.model_fields.items():
            words = info(declared)
            meaning = " ".join((declared.description or "").split())
            read = attrgetter(f"{part}.{name}")
            yield Quantity(f"{part}.{name}", words.column or name, words, meaning, read)


FIELDS: tuple[Quantity, ...] = tuple(_fields())
"""Every field of a study file, in the order of the file."""
DERIVED: tuple[Quantity, ...] = (
    Quantity(
        "",
        "z0_over_d",
        Info("roughness length", "z_0", "d"),
        "roughness length over diameter",
        # rounded: d/30 over d is not 1/30 to the last digit, and figures group by it
        lambda scene: round(scene.bed.roughness / scene.grain.diameter, 9),
    ),
    Quantity(
        "",
        "regime",
        Info("regime"),
        "forces that are valid at the threshold of a single grain of the scene, or transition",
        regime_of,
    ),
)
COLUMNS: Mapping[str, Quantity] = {
    one.column: one for one in (*FIELDS, *DERIVED) if one.column != NO_COLUMN
}
"""By the columns of a table: what a scene asks for."""
ANSWERS: Mapping[str, Quantity] = {
    f"{ANSWERED}{column}": one for column, one in COLUMNS.items() if one.info.about == "answer"
}
"""By the columns of a table: how a scene was answered."""
FOLLOW = ("z0_m", "regime", *(column for column, one in ANSWERS.items() if one.info.read))
"""Columns that follow from others: of the two roughness lengths, the one over the diameter tells
beds apart that are alike but for the size of their grains."""


def asked(scene: Scene) -> dict[str, Any]:
    """Values that a scene asks for, by column."""
    return {column: one.asked(scene) for column, one in COLUMNS.items()}


def answered(scene: Scene) -> dict[str, Any]:
    """How the scene that was run answers, by column."""
    return {column: one.used(scene) for column, one in ANSWERS.items()}


def used(scene: Scene) -> dict[str, Any]:
    """All that a scene is, by column; what it leaves open is worked out."""
    return {column: one.used(scene) for column, one in COLUMNS.items()}


def others(columns: Iterable[Hashable], *but: str) -> list[str]:
    """The columns in which rows agree that are equal in all else than some."""
    there = set(columns) - {*but, *FOLLOW}
    return [column for column in (*COLUMNS, *ANSWERS) if column in there]
