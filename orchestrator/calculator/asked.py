"""Thresholds of points that users give, with questions and refusals in their words."""

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from orchestrator.calculator import BY_FLUID, ENTRAINED, OF_FLUID, PARAMETERS
from orchestrator.errors import InputError
from orchestrator.physics.fluids import PAPER, TEMPERATURE, numbers_of
from orchestrator.study.units import NumberRemark, hinted, questions

if TYPE_CHECKING:  # this loads numpy
    from orchestrator.calculator.table import Table

Value = float | str
"""A number, or a part of the diameter such as ``d/30``."""
FIELD = re.compile(
    r"\b([a-z]+\.[a-z_]+|(?<=threshold: )(depth|law|criterion)"
    r"|bed_slope|channel_roughness|d84)\b"
)
"""A field of a study file in a message, or what else is refused."""


def thresholds_and_questions(
    points: Mapping[str, Sequence[Value]],
    law: str,
    fluid: str | None,
    temperature: float | Sequence[float] | None,
    names: Mapping[str, str],
    form: str,
    criterion: str = BY_FLUID,
) -> tuple["Table", list[str]]:
    """Find the thresholds of some points, and ask about numbers that seem to be wrong.

    Parameters
    ----------
    points
        Columns of one length, by keys of `PARAMETERS`.
    law
        The force law that is asked for, ``auto`` or ``paper``.
    fluid
        Name of the fluid in place of density and viscosity; the paper's gas may have
        numbers of its own.
    temperature
        Temperature of that fluid, deg C, or that of each point.
    names
        What refusals and questions call the parameters, ``fluid``, ``temperature``,
        ``law`` and ``criterion``.
    form
        How a parameter is given a value: a format of its name and the value.
    criterion
        What a grain must do, one of `CRITERIA`, or `BY_FLUID`.

    Returns
    -------
    table
        That of `table.thresholds`.
    asked
        The questions of `units.questions`.

    Raises
    ------
    InputError
        With what is asked behind the remedy.
    """
    from orchestrator.calculator.table import thresholds

    fields = {each.field: names[name] for name, each in PARAMETERS.items()}
    fields["fluid.kind"] = names["fluid"]
    fields[f"fluid.{TEMPERATURE}"] = names["temperature"]
    fields["law"] = names["law"]
    fields["criterion"] = names["criterion"]
    asked: list[NumberRemark] = []
    try:
        points = _of_fluid(points, fluid, temperature)
        if fluid == PAPER and criterion == BY_FLUID:
            criterion = ENTRAINED  # also where the points have numbers of their own
        asked = questions(_by_field(points), fields, form)
        table = thresholds(points, law, criterion)
        return table, [one.text for one in asked]
    except InputError as error:
        renamed = InputError(
            _renamed(error.what, fields),
            _renamed(error.where, fields),
            _renamed(error.remedy, fields),
        )
        raise hinted(renamed, asked) from None


def _of_fluid(
    points: Mapping[str, Sequence[Value]],
    fluid: str | None,
    temperature: float | Sequence[float] | None,
) -> Mapping[str, Sequence[Value]]:
    """The points with the numbers of a fluid; refuses what is given twice."""
    given: dict[str, Any] = {}
    if fluid is not None:
        given["kind"] = fluid
    for name, field in OF_FLUID.items():
        if name in points:
            given[field] = points[name]
    temperatures: list[Any] = [temperature] * len(points["diameter"])
    if isinstance(temperature, Sequence):
        temperatures = [*temperature]
    by_temperature = {}
    for each in dict.fromkeys(temperatures):
        warm = {} if each is None else {TEMPERATURE: each}
        by_temperature[each] = numbers_of({**given, **warm})
    if fluid is None:
        return points
    columns = {}
    for name, field in OF_FLUID.items():
        columns[name] = [by_temperature[each][field] for each in temperatures]
    return {**columns, **points}


def _by_field(points: Mapping[str, Sequence[Value]]) -> dict[str, list[float]]:
    """The numbers of some points by the fields of a study file, defaults included."""
    count = len(points["diameter"])
    numbers = {}
    for name, parameter in PARAMETERS.items():
        column = points.get(name, [parameter.default] * count)
        numbers[parameter.field] = [x for x in column if isinstance(x, int | float)]
    return numbers


def _renamed(text: str, fields: Mapping[str, str]) -> str:
    """A message on fields of a study file with the names that these have here.

    The rules of a scene refuse the points of the calculator, too, and know its fields
    alone.
    """
    return FIELD.sub(lambda found: fields.get(found[0], found[0]), text)
