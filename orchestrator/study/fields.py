"""The registry of the fields of a scene: what follows from where each is declared.

A field is about the method if it stands in one of the tables of the method; all others
are about the question.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, get_args

from pydantic.fields import FieldInfo

from orchestrator.study.closed_form import regime_of
from orchestrator.study.declare import Info, Part, info_of
from orchestrator.study.method import FlowMethod, GrainMethod, Method
from orchestrator.study.parts import (
    Flow,
    Fluid,
    Forces,
    GrainPart,
    Gusts,
    LogNormal,
    PileBed,
    ThresholdPart,
)
from orchestrator.study.profile import Profile
from orchestrator.study.scene import Scene
from orchestrator.study.scopes import APPLIES

QUESTION: Mapping[str, type[Part]] = {
    "fluid": Fluid,
    "grain": GrainPart,
    # a bed of one grain has no field that a pile has not
    "bed": PileBed,
    "flow": Flow,
    "forces": Forces,
    "threshold": ThresholdPart,
}
"""The tables of a study file that ask."""
METHOD: Mapping[str, type[Part]] = {
    "method": Method,
    "method.flow": FlowMethod,
    "method.grains": GrainMethod,
}
"""The tables of a study file that say how to answer."""
PARTS: Mapping[str, type[Part]] = {**QUESTION, **METHOD}
"""The tables of a study file."""
PROFILE = "bed.profile"
SEED = "bed.seed"
"""The field that tells apart beds that are alike."""
FIDELITY = "method.fidelity"
"""The key of a study file that names a set of fields of the method."""


@dataclass(frozen=True)
class Quantity:
    """A field of a study file, or a quantity that follows from fields.

    Attributes
    ----------
    name
        As a study file writes it, such as bed.slope_deg; empty for one that follows.
    column
        Its column in tables.
    info
        Its words.
    meaning
        Its meaning.
    read
        Finds its value in a scene, None where that leaves it open.
    """

    name: str
    column: str
    info: Info
    meaning: str
    read: Callable[[Scene], Any]

    @property
    def is_method(self) -> bool:
        """Whether it says how a scene is answered."""
        return table_of(self.name) in METHOD

    def applies(self, scene: Scene) -> bool:
        """Tell whether it has an effect on a scene.

        Returns
        -------
        bool
            Whether it has.
        """
        return APPLIES[self.info.scope](scene)

    def asked(self, scene: Scene) -> Any:
        """Find its value as a scene has it written.

        Returns
        -------
        Any
            The value; None where it has no effect or is left open.
        """
        if not self.applies(scene):
            return None
        return plain(self.read(scene))

    def used(self, scene: Scene) -> Any:
        """Find its value as a scene uses it.

        Returns
        -------
        Any
            The value; None where it has no effect.
        """
        if not self.applies(scene):
            return None
        if self.info.read:
            return plain(getattr(scene, self.info.read))
        return plain(self.read(scene))

    @property
    def phrase(self) -> str:
        """Its meaning with its unit, its scope and the meaning of its words."""
        phrase = self.meaning
        if self.info.unit:
            phrase += f", {self.info.unit}"
        if self.info.scope != "every scene":
            phrase += f" ({self.info.scope})"
        for word, meaning in self.info.choices.items():
            phrase += f"; {word}: {meaning}"
        return phrase


def table_of(name: str) -> str:
    """Name the table of a field, such as ``bed`` or ``method.flow``.

    Parameters
    ----------
    name
        The name of the field in a study file.

    Returns
    -------
    str
        The table.

    Examples
    --------
    >>> table_of("method.flow.speed"), table_of("bed.height")
    ('method.flow', 'bed')
    """
    return name.rpartition(".")[0]


def default_of(name: str) -> Any:
    """Find the default of a field.

    Parameters
    ----------
    name
        The name of the field in a study file.

    Returns
    -------
    Any
        The default.
    """
    table, _, field = name.rpartition(".")
    return PARTS[table].model_fields[field].default


def inner_fields(name: str) -> Mapping[str, FieldInfo]:
    """Find the fields of a field that is a table itself, such as those of gusts.

    Parameters
    ----------
    name
        The name of the field in a study file.

    Returns
    -------
    dict of str to FieldInfo
        Their declarations by their names; none of a field that is no table.
    """
    table, _, field = name.rpartition(".")
    found: dict[str, FieldInfo] = {}
    for kind in get_args(PARTS[table].model_fields[field].annotation):
        if isinstance(kind, type) and issubclass(kind, Part):
            found |= kind.model_fields
    return found


def plain(value: Any) -> Any:
    """Make a value a cell of a table.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    Any
        Words and numbers as they are, all else as a text.
    """
    if isinstance(value, tuple):
        return "; ".join(_item(each) for each in value) or None
    if isinstance(value, Profile | LogNormal | Gusts):
        return str(value)
    return value


def _item(item: Any) -> str:
    """A text for an item of a list.

    In a sieve table it is a size and its part of the mass.
    """
    if isinstance(item, tuple):
        diameter, part = item
        return f"{1e3 * diameter:g} mm {100 * part:g} %"
    return str(item)


def quantity(table: str, name: str, declared: FieldInfo) -> Quantity:
    """Read the words of a field off its declaration.

    Parameters
    ----------
    table
        The table of the field.
    name
        Its name in there.
    declared
        Its declaration.

    Returns
    -------
    Quantity
        The field.
    """
    info = info_of(declared)
    meaning, *words = (declared.description or "").split("\n- ")
    choices = {}
    for word in words:
        choice, means = " ".join(word.split()).split(": ", 1)
        choices[choice] = means
    label = info.label or name.removesuffix("_deg").replace("_", " ")
    return Quantity(
        name=f"{table}.{name}",
        column=info.column or name,
        info=replace(info, label=label, choices=info.choices or choices),
        meaning=" ".join(meaning.split()),
        read=attrgetter(f"{table}.{name}"),
    )


def _declared() -> tuple[Quantity, ...]:
    quantities = []
    for table, part in PARTS.items():
        for name, declared in part.model_fields.items():
            # the tables within the method have fields of their own
            if f"{table}.{name}" not in PARTS:
                quantities.append(quantity(table, name, declared))
    return tuple(quantities)


FIELDS: tuple[Quantity, ...] = _declared()
"""Every field of a study file, in the order of the file."""


def _z0_over_d(scene: Scene) -> float:
    # rounded: d/30 over d is not 1/30 to the last digit, and figures group by it
    return round(scene.bed.roughness / scene.grain.diameter, 9)


DERIVED = (
    Quantity(
        name="",
        column="z0_over_d",
        info=Info(label="roughness length", symbol="z_0", unit="d"),
        meaning="roughness length over diameter",
        read=_z0_over_d,
    ),
    Quantity(
        name="",
        column="regime",
        info=Info(label="regime"),
        meaning=(
            "forces that are valid at the threshold of a single grain of the scene, "
            "or transition"
        ),
        read=regime_of,
    ),
)
COLUMNS: Mapping[str, Quantity] = {
    each.column: each for each in (*FIELDS, *DERIVED) if each.column != "-"
}
"""The quantities of a scene by their columns in tables."""
OF_QUESTION = tuple(name for name, each in COLUMNS.items() if not each.is_method)
"""Columns of what is asked."""
OF_METHOD = tuple(name for name, each in COLUMNS.items() if each.is_method)
"""Columns of how a scene is answered."""
TWINS = ("z0_m", "regime")
"""Columns that say again what others say: of the two roughness lengths, the ratio to
the diameter tells beds apart that are alike but for the size of their grains."""
LEFT_OPEN = tuple(column for column in OF_METHOD if COLUMNS[column].info.read)
"""Columns of the method that follow from the question where a study leaves them
open."""


def question(scene: Scene) -> dict[str, Any]:
    """List what a scene asks.

    Returns
    -------
    dict
        Values by column.
    """
    return {column: COLUMNS[column].used(scene) for column in OF_QUESTION}


def method(scene: Scene) -> dict[str, Any]:
    """List how a scene is answered.

    Returns
    -------
    dict
        Values by column; what the scene leaves open is worked out.
    """
    return {column: COLUMNS[column].used(scene) for column in OF_METHOD}


def asked(scene: Scene) -> dict[str, Any]:
    """List what a scene asks and how its method is written.

    Returns
    -------
    dict
        Values by column; None is left open.
    """
    written = {column: COLUMNS[column].asked(scene) for column in OF_METHOD}
    return question(scene) | written


def used(scene: Scene) -> dict[str, Any]:
    """List all quantities of a scene.

    Returns
    -------
    dict
        Values by column; what the scene leaves open is worked out.
    """
    return {column: each.used(scene) for column, each in COLUMNS.items()}


def written(scene: Scene) -> str:
    """List the fields of the method that a scene does not leave at their defaults.

    Returns
    -------
    str
        For each its name in the table ``[method]`` and its value; ``auto`` if there is
        none.
    """
    texts = []
    for each in FIELDS:
        if not each.is_method:
            continue
        value = each.asked(scene)
        if value is not None and value != default_of(each.name):
            texts.append(f"{each.name.removeprefix('method.')} = {value}")
    return ", ".join(texts) or "auto"


def others(columns: Iterable[Hashable], *but: str) -> list[str]:
    """List the columns of fields among some.

    Those that follow from others are left out.

    Parameters
    ----------
    columns
        The columns.
    *but
        Columns that are left out as well.

    Returns
    -------
    list of str
        The columns.
    """
    rest = set(columns) - {*but, *TWINS, *LEFT_OPEN}
    return [column for column in COLUMNS if column in rest]
