"""The command `threshold`: parse, call, print."""

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.calculator.parameters import DIAMETER, OPTION_OF, PARAMETERS, Parameter, renamed
from orchestrator.errors import InputError

RANGES = (
    "Any number may be a range FIRST:LAST:COUNT, such as --diameter 1e-4:2e-3:20, for a table; "
    "several ranges give every combination. Values of diameter, viscosity, roughness and depth "
    "are spaced geometrically, all others evenly. Winds are those of the logarithmic law over z0; "
    "a fluid below 100 kg/m3 is a gas. A law that does not hold is marked, with the reason."
)


def add(commands: Any) -> None:
    """Add ``threshold`` to the parser of the program."""
    command = commands.add_parser(
        "threshold", help="when one grain starts to move, closed form, at once", epilog=RANGES
    )
    for one in PARAMETERS:
        command.add_argument(
            one.option,
            dest=one.name,
            default=None if one.default is None else str(one.default),
            required=one is DIAMETER,
            metavar="X",
            help=_help(one),
        )
    command.add_argument(
        "--law",
        default="bridged",
        metavar="NAME",
        help="force law of the answer; default %(default)s; paper: Eq. 2 or 4 where each holds",
    )
    form = command.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="an object for each law by its name")
    form.add_argument("--csv", action="store_true", help="a row for each point and law")
    command.set_defaults(run=_run)


def _help(one: Parameter) -> str:
    default = one.default if isinstance(one.default, str | None) else f"{one.default:g}"
    parts = (one.label, one.note, default and f"default {default}")
    return "; ".join(part for part in parts if part)


def _run(options: argparse.Namespace) -> int:
    from orchestrator.calculator import doubts, ranges, table

    answer = _of_option("--law", table.known_law, options.law)
    given = {one: getattr(options, one.name) for one in PARAMETERS}
    axes = {
        one.name: _of_option(one.option, ranges.values, one, text)
        for one, text in given.items()
        if text is not None
    }
    asked = doubts.questions({name: _largest(values) for name, values in axes.items()})
    try:
        found = table.thresholds(ranges.grid(axes), answer)
    except InputError as error:
        raise _refusal(error, asked) from None
    if asked:
        print(f"orchestrator: {'; '.join(asked.values())}", file=sys.stderr)
    varied = [one for one in PARAMETERS if len(axes.get(one.name, ())) > 1]
    print(_printed(found, answer, varied, options), end="")
    return 0


def _of_option(option: str, read: Any, *arguments: Any) -> Any:
    """Read the text of an option; a refusal names the option."""
    try:
        return read(*arguments)
    except InputError as error:
        raise InputError(error.what, where=option, remedy=error.remedy) from None


def _largest(values: Sequence[float | str]) -> float:
    numbers = (value for value in values if not isinstance(value, str) and math.isfinite(value))
    return max(numbers, default=0.0)


def _refusal(error: InputError, asked: Mapping[str, str]) -> InputError:
    """A refusal in the words of the command line; a question about what it names is the remedy."""
    said = renamed(error, OPTION_OF)
    whole = said.where == "threshold"
    about = [
        asked[one.name]
        for one in PARAMETERS
        if one.name in asked and (whole or one.option in said.where)
    ]
    advice = about if whole and about else [said.remedy, *about]
    return InputError(said.what, where=said.where, remedy="; ".join(filter(None, advice)))


def _printed(
    found: Any, answer: str, varied: Sequence[Parameter], options: argparse.Namespace
) -> str:
    from orchestrator.calculator import records, text

    if options.csv:
        return str(found.to_csv(index=False))
    if options.json:
        return records.text(found) + "\n"
    return (text.several(found, answer, varied) if varied else text.single(found, answer)) + "\n"
