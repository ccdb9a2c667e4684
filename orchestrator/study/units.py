"""Numbers as users write them: how they are spelt, and in which unit they are likely.

A study file and the command `threshold` ask the same questions. No library of numbers
is imported here, so that the command line starts at once.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.fluids import ALIKE, NUMBERS_OF_PAPER
from orchestrator.study.lengths import LENGTHS

NUMBER = re.compile(
    r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?(inf|nan)", re.ASCII | re.I
)
DECIMAL_COMMA = re.compile(r"([+-]?\d+),(\d+(?:e[+-]?\d+)?)", re.ASCII | re.I)
WITH_UNIT = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?)\s*([^\d\s.+-].*)", re.ASCII | re.I)
TO_SI: Mapping[str, float] = {
    **LENGTHS,
    "kg/m3": 1.0,
    "kg/m³": 1.0,
    "g/cm3": 1e3,
    "g/cm³": 1e3,
    "m/s": 1.0,
    "cm/s": 1e-2,
    "m2/s": 1.0,
    "m²/s": 1.0,
    "deg": 1.0,
    "°": 1.0,
    "rad": 180 / math.pi,
}
"""Factors of units to those of a study file: SI units, and degrees."""


class Unit(NamedTuple):
    """A range of a field in which a number is likelier in another unit.

    Attributes
    ----------
    field
        The field.
    low, high
        Ends of the range.
    question
        What is asked, a format of the number.
    factor
        What the number is multiplied with, to have the unit of the field.
    """

    field: str
    low: float
    high: float
    question: str
    factor: float  # to the unit of the field


class NumberRemark(NamedTuple):
    """What is said of a number that may not be meant as it stands.

    Attributes
    ----------
    said
        What it is, in words; a question has its mark.
    advice
        What is said behind a question; maybe nothing.
    is_question
        Whether the number may be in another unit: one that is confirmed is not asked
        about.
    """

    said: str
    advice: str = ""
    is_question: bool = True

    @property
    def text(self) -> str:
        """All of it."""
        return f"{self.said} {self.advice}".rstrip()

    @property
    def sentence(self) -> str:
        """The same with the stop that it needs."""
        ends = self.is_question and not self.advice
        return self.text if ends else f"{self.text}."


DIAMETER, WIDE = "grain.diameter", 0.1
"""Diameter from which on it is likelier in millimetres, m."""
WIDEST_STONE, STONES = 3.0, (1500.0, 5000.0)
"""Up to this diameter, m, a grain of such a density, kg/m3, may be riprap or a boulder
in a liquid."""
UNITS = (
    Unit(DIAMETER, WIDE, math.inf, "{0:g} m: did you mean {0:g} mm", 1e-3),
    Unit("grain.density", 1e-300, 30.0, "{0:g} kg/m3: did you mean {0:g} g/cm3", 1e3),
    Unit(
        "bed.slope_deg", 0.05, 0.55, "{0:g} deg: did you mean {0:g} rad", TO_SI["rad"]
    ),
    Unit(
        "bed.entrainment_angle_deg",
        1e-300,
        1.571,
        "{0:g} deg: did you mean {0:g} rad",
        TO_SI["rad"],
    ),
    Unit(
        "forces.lift_coefficient",
        6.0,
        7.0,
        "{0:g}: did you mean Saffman's for the radius",
        0.25,
    ),
    Unit(
        "bed.lee_slope_deg",
        0.05,
        0.62,
        "{0:g} deg: did you mean {0:g} rad",
        TO_SI["rad"],
    ),
    Unit("flow.depth", 250.0, math.inf, "{0:g} m: did you mean {0:g} mm", 1e-3),
    Unit("fluid.gravity", 50.0, math.inf, "{0:g} m/s2: did you mean {0:g} cm/s2", 0.01),
)
COHESIVE_BELOW = (6e-5, 1e-4)
"""Diameter below which cohesion is no longer small against the weight, in liquids and
in gases, m."""
USUAL_PA_S = ((1e-4, 0.1), (3e-6, 1e-4))
"""Usual dynamic viscosities of liquids and of gases, Pa s."""
HIGHEST, LONGEST = 500.0, 1e4
"""Height and length of a bed above which it is likelier in millimetres, m: the
largest dunes are 500 m high."""

WIDEST = 0.5  # diameter in a sieve table from which it is likelier in millimetres, m


def number(text: str) -> float:
    """The number that a text is, in the digits 0 to 9 with a decimal point.

    Python takes more for a number: digits of other scripts, and 1_0 for 10.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    float
        The number.

    Raises
    ------
    ValueError
        With what the text may mean.

    Examples
    --------
    >>> number(" 2.5e-4 ")
    0.00025
    >>> number("0,25 ")
    Traceback (most recent call last):
        ...
    ValueError: '0,25' is no number: write 0.25
    """
    stripped = text.strip()
    if NUMBER.fullmatch(stripped):
        return float(stripped)
    if not stripped:
        raise ValueError("there is no number")
    hint = meant(stripped)
    raise ValueError(f"{stripped!r} is no number{f': {hint}' if hint else ''}")


def whole_number(text: str) -> int:
    """Read the whole number that a text is.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    int
        The number.

    Raises
    ------
    ValueError
        For any other text.
    """
    if not re.fullmatch(r"[+-]?\d+", text.strip(), re.ASCII):
        raise ValueError(f"{text!r} is no whole number")
    return int(text)


def meant(text: str) -> str:
    """How to write a number that has a decimal comma or a unit.

    It is empty for any other text.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        The advice; empty for any other text.

    Examples
    --------
    >>> meant("0.25 mm")
    'write 0.00025, without a unit: numbers are in SI units, angles in degrees'
    """
    comma = DECIMAL_COMMA.fullmatch(text.strip())
    if comma:
        point = f"write {comma[1]}.{comma[2]}"
        is_thousands = len(comma[2]) == 3 and comma[2].isdecimal()
        return f"{point}, or {comma[1]}{comma[2]}" if is_thousands else point
    parts = WITH_UNIT.fullmatch(text.strip())
    if parts is None or not NUMBER.fullmatch(parts[1]) or parts[2] not in TO_SI:
        return ""
    value = float(parts[1]) * TO_SI[parts[2]]
    rule = "numbers are in SI units, angles in degrees"
    return f"write {value:.9g}, without a unit: {rule}"


def questions(
    values: Mapping[str, Sequence[float]],
    names: Mapping[str, str],
    form: str = "{} = {:.4g}",
) -> list[NumberRemark]:
    """Questions on numbers that are usual in another unit, or that no fluid has.

    Parameters
    ----------
    values
        The values of fields at some points, by the fields' names in a study file.
        Fields of the fluid and of the grain have one value for each point.
    names
        What the questions call the fields; one that is missing has its own name.
    form
        How a field is given a value: a format of its name and the value.

    Returns
    -------
    list of Remark
        The questions.

    Examples
    --------
    >>> (asked,) = questions({"grain.diameter": [0.25]}, {})
    >>> asked.text
    '0.25 m: did you mean 0.25 mm, grain.diameter = 0.00025?'
    """
    asked = []
    for unit in UNITS:
        largest = max(values.get(unit.field, ()), default=0.0)
        if unit.low <= largest < unit.high:
            name = names.get(unit.field, unit.field)
            question = unit.question.format(largest)
            if unit.field == DIAMETER and _may_be_stone(values):
                stone = f"{largest:g} m is a stone of {1e3 * largest:g} mm"
                question = f"{stone}: or did you mean {largest:g} mm"
            right = form.format(name, largest * unit.factor)
            asked.append(NumberRemark(f"{question}, {right}?"))
    return asked + _of_cohesion(values) + _of_fluid(values, names)


def _may_be_stone(values: Mapping[str, Sequence[float]]) -> bool:
    """Whether the wide grains may be riprap or boulders: stones in a liquid."""
    names = (DIAMETER, "grain.density", "fluid.density")
    grains = {*zip(*(values.get(name, ()) for name in names), strict=False)}
    low, high = STONES
    return (
        bool(grains)
        and all(
            fluid >= GAS_BELOW and low <= density <= high
            for diameter, density, fluid in grains
            if diameter >= WIDE
        )
        and max(values[DIAMETER]) <= WIDEST_STONE
    )


def _of_cohesion(values: Mapping[str, Sequence[float]]) -> list[NumberRemark]:
    """A remark on the smallest grain that its cohesion holds, if there is one."""
    names = ("grain.diameter", "fluid.density", "grain.cohesion")
    grains = {*zip(*(values.get(name, ()) for name in names), strict=False)}
    held = []
    for diameter, density, cohesion in grains:
        end = COHESIVE_BELOW[density < GAS_BELOW]
        if 0 < diameter < end and not cohesion:
            held.append(diameter)
    if not held:
        return []
    what = "cohesion, which the force laws leave out, holds grains this small"
    text = f"{min(held):g} m: {what}; they need a stronger flow"
    return [NumberRemark(text, is_question=False)]


def _of_fluid(
    values: Mapping[str, Sequence[float]], names: Mapping[str, str]
) -> list[NumberRemark]:
    """A question on the first fluid with a viscosity that none of its density has."""
    densities = values.get("fluid.density", ())
    pairs = zip(densities, values.get("fluid.viscosity", ()), strict=False)
    for density, viscosity in dict.fromkeys(pairs):
        low, high = USUAL_PA_S[density < GAS_BELOW]
        like_gas = math.isclose(viscosity, NUMBERS_OF_PAPER[1], rel_tol=ALIKE)
        is_of_air = density >= GAS_BELOW and like_gas
        is_usual = low <= density * viscosity <= high and not is_of_air
        if density > 0 and viscosity > 0 and not is_usual:
            dynamic = f"{viscosity:g} m2/s, or {density * viscosity:.3g} Pa s"
            name = names.get("fluid.kind", "fluid.kind")
            what = f"{dynamic}, is unusual for {density:g} kg/m3"
            advice = f"{name} names water, seawater, air"
            return [NumberRemark(f"{what}: is it right?", advice)]
    return []


def ask_about_bed(name: str, length: float, height: float) -> str:
    """Ask about a bed line or a surface of a length and a height that no bed has.

    Parameters
    ----------
    name
        Its name.
    length
        Its length, m.
    height
        Its height, m.

    Returns
    -------
    str
        The question; empty for any other.
    """
    if length <= LONGEST and height <= HIGHEST:
        return ""
    meant = f"{length / 1e3:.4g} m long and {height / 1e3:.4g} m high"
    what = f"{length:.4g} m long and {height:.4g} m high"
    return f"{name} is {what}: did you mean mm, {meant}?"


def of_sieve(diameters: Sequence[float]) -> list[NumberRemark]:
    """Ask about a sieve table with diameters that no sieve has.

    Parameters
    ----------
    diameters
        The diameters, m.

    Returns
    -------
    list of Remark
        One question, or none.
    """
    if not diameters or max(diameters) < WIDEST:
        return []
    sizes = f"{min(diameters):g} to {max(diameters):g}"
    text = f"grain.sizes are {sizes} m: did you mean mm?"
    return [NumberRemark(text, "Divide the diameters by 1000")]


def hinted(refusal: InputError, asked: Sequence[NumberRemark]) -> InputError:
    """Add to a refusal the questions on the numbers that it may come from.

    Parameters
    ----------
    refusal
        The refusal.
    asked
        What is said of the numbers.

    Returns
    -------
    InputError
        The refusal with the questions behind its remedy.
    """
    questions = dict.fromkeys(one.text for one in asked if one.is_question)
    remedy = "; ".join(filter(None, [refusal.remedy, *questions]))
    return InputError(refusal.what, refusal.where, remedy)
