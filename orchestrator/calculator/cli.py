"""The command `threshold`: the options and ranges of its command line."""

import argparse
import itertools
import math
import sys
from typing import TYPE_CHECKING

from orchestrator.calculator import (
    BY_FLUID,
    GEOMETRIC,
    LENGTHS,
    MOST_POINTS,
    OF_FLUID,
    PARAMETERS,
)
from orchestrator.calculator.asked import Value, thresholds_and_questions
from orchestrator.calculator.printed import as_json, as_text, print_csv
from orchestrator.command import Parser
from orchestrator.errors import InputError
from orchestrator.physics.fluids import KINDS, PAPER, STANDARD_DEG_C
from orchestrator.runs import terminal
from orchestrator.study.units import meant, number

if TYPE_CHECKING:  # this loads numpy
    from orchestrator.calculator.table import Table

OPTIONS = {
    name: f"--{name.removesuffix('_deg').replace('_', '-')}"
    for name in (*PARAMETERS, "fluid", "temperature", "law", "criterion")
}
"""Options of the command line, by the parameters of `face.threshold`."""
GROUND = "--ground-roughness"
"""What `channel_roughness` is called of a wind."""
FORM = (
    "write a number in SI units, or FIRST:LAST:COUNT such as 1e-4:2e-3:20; "
    "a z0 may be d/30"
)
RANGES = """\
Any number may be a range FIRST:LAST:COUNT, such as --diameter 1e-4:2e-3:20,
for a table; several ranges give every combination. Lengths, viscosity and the
slope of a channel are spaced geometrically, all others evenly. A fluid below
100 kg/m3 is a gas."""
LAW_HELP = (
    "force law of the answer; default: bridged, or bridged-gravel where the drag law "
    "of bridged ends; paper: Eq. 2 or 4 where each holds"
)
CRITERION_HELP = (
    "what a grain must do: sustained, which is to leave its pocket in a gust and to "
    "roll and hop on after it; entrained, which is to leave its pocket; default: "
    "entrained in the fluid paper and by the laws paper, low and high, sustained in "
    "all others"
)


def options(command: Parser) -> None:
    """Add the options of the command.

    Parameters
    ----------
    command
        Its parser.
    """
    command.epilog = RANGES
    for name in PARAMETERS:
        alias = [GROUND] if name == "channel_roughness" else []
        command.add_argument(
            OPTIONS[name],
            *alias,
            dest=name,
            help=_help(name),
            required=name == "diameter",
            metavar="X",
        )
    names = ", ".join(KINDS)
    text = f"{names}: its density and viscosity at --temperature; without any of "
    text += f"these: {PAPER}"
    command.add_argument("--fluid", metavar="NAME", help=text)
    text = f"of that fluid, deg C, one number; default {STANDARD_DEG_C:g}"
    command.add_argument("--temperature", type=number, metavar="T", help=text)
    command.add_argument("--law", default="auto", metavar="NAME", help=LAW_HELP)
    command.add_argument(
        "--criterion", default=BY_FLUID, metavar="NAME", help=CRITERION_HELP
    )
    form = command.add_mutually_exclusive_group()
    text = "an object for each law by its name"
    form.add_argument("--json", action="store_true", help=text)
    text = "a row for each point and law"
    form.add_argument("--csv", action="store_true", help=text)


def _help(name: str) -> str:
    """The symbol and unit of a parameter, and its default."""
    parameter = PARAMETERS[name]
    parts = [parameter.label]
    if parameter.note:
        parts.append(parameter.note.replace("%", "%%"))  # argparse fills help in
    default = parameter.default
    if isinstance(default, float):
        default = f"{default:g}"
    if default is not None:
        of_paper = ""
        if name in OF_FLUID:
            of_paper = ", that of the paper's gas, which any number of a fluid replaces"
        parts.append(f"default {default}{of_paper}")
    return "; ".join(parts)


def table_of(
    options: argparse.Namespace,
) -> tuple["Table", dict[str, list[Value]]]:
    """Find the thresholds that the options ask for, and print questions on them.

    Parameters
    ----------
    options
        The options of the command.

    Returns
    -------
    table
        The thresholds, by every law.
    axes
        The values of each parameter that is given.

    Raises
    ------
    InputError
        If an option or a range is refused.
    """
    axes: dict[str, list[Value]] = {}
    for name in PARAMETERS:
        text = getattr(options, name)
        if text is not None:
            axes[name] = values(name, text)
    if "slope_deg" in axes and min(map(float, axes["slope_deg"])) < 0:
        what = "below 0: the flow goes up a positive slope"
        option = OPTIONS["bed_slope"]
        remedy = f"a river's slope, which falls with the flow, is {option} 0.005"
        raise InputError(what, OPTIONS["slope_deg"], remedy)
    count = math.prod(map(len, axes.values()))
    if count > MOST_POINTS:
        what = f"the ranges have {count} points together, more than {MOST_POINTS}"
        raise InputError(what, "threshold", "lower a COUNT")
    combinations = itertools.product(*axes.values())
    columns = zip(*combinations, strict=True)
    table, questions = thresholds_and_questions(
        dict(zip(axes, columns, strict=True)),
        options.law,
        options.fluid,
        options.temperature,
        OPTIONS,
        "{} {:.4g}",
        options.criterion,
    )
    if questions:
        print(f"orchestrator: {'; '.join(questions)}", file=sys.stderr)
    return table, axes


def run(options: argparse.Namespace) -> int:
    """Print the thresholds that the options ask for, and questions on them.

    Parameters
    ----------
    options
        The options of the command.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    InputError
        If an option or a range is refused.
    """
    table, axes = table_of(options)
    if options.csv:
        print_csv(table)
        return 0
    cells = zip(*(column.tolist() for column in table.values()), strict=True)
    rows = [dict(zip(table, row, strict=True)) for row in cells]
    if options.json:
        print(as_json(rows))
    else:
        varied = [name for name, axis in axes.items() if len(axis) > 1]
        fluid = options.fluid
        if not OF_FLUID.keys() & axes.keys():
            fluid = fluid or PAPER
        text = "\n".join(as_text(rows, options.law, varied, fluid))
        print(terminal.shown(text))
    return 0


def values(name: str, text: str) -> list[Value]:
    """Read the values that a text gives to a parameter.

    Parameters
    ----------
    name
        Of the parameter, a key of `PARAMETERS`.
    text
        A number, or a range ``FIRST:LAST:COUNT``, both ends included; of a roughness
        both may be parts of the diameter.

    Returns
    -------
    list of float or of str
        One value, or those of the range, which rise.

    Raises
    ------
    InputError
        For any other text.

    Examples
    --------
    >>> values("slope_deg", "0:30:4")
    [0.0, 10.0, 20.0, 30.0]
    >>> values("roughness", "d/30")
    ['d/30']
    """
    is_part = name in LENGTHS and "/" in text
    ends = text.split(":")
    if is_part and len(ends) == 1:
        return [text]
    try:
        numbers = [_end(end, is_part) for end in ends[:2]]
        count = number(ends[2]) if len(ends) == 3 else 0.0
    except (ValueError, IndexError, ZeroDivisionError):
        what = f"{text!r} is neither a number nor a range"
        raise InputError(what, OPTIONS[name], meant(text) or FORM) from None
    if len(ends) == 1:
        return [*numbers]
    first, last = numbers
    if not first < last < math.inf:
        what = f"{text!r} is not a range of values that rise"
        raise InputError(what, OPTIONS[name], FORM)
    if not (2 <= count <= MOST_POINTS and count % 1 == 0):
        what = f"{text!r} is not a range with a number of values"
        remedy = f"the number is the last of three: a whole one from 2 to {MOST_POINTS}"
        raise InputError(what, OPTIONS[name], remedy)
    import numpy as np  # a single number is answered without

    from orchestrator import digits

    if name in GEOMETRIC and first > 0:
        spaced = np.geomspace(first, last, int(count)).tolist()
    else:
        spaced = np.linspace(first, last, int(count)).tolist()
    if is_part:
        return [f"d/{digits.FORMAT % (1 / part)}" for part in spaced]
    return [digits.rounded(value) for value in spaced]


def _end(text: str, is_part: bool) -> float:
    """A number, or the part of the diameter that a text such as ``d/30`` is."""
    if is_part:
        return 1 / number(text.split("d/")[1])
    return number(text)
