"""The command line: parse, call."""

import logging
import os
import re
import sys
import warnings
from collections.abc import Sequence

from orchestrator import __version__, guests
from orchestrator.command import Command, Parser, say
from orchestrator.commands import commands as of_core
from orchestrator.errors import Fault, InputError, of_exception
from orchestrator.runs import terminal

DATE_DIGITS = 11
"""Most digits of a date in seconds since 1970: one up to the year 5138."""


def _with_negative_numbers(words: Sequence[str]) -> list[str]:
    """Write a negative number in one word with its option.

    Alone argparse takes -5e-3 and -29:29:9 for options.
    """
    joined: list[str] = []
    for word in words:
        is_value = (
            bool(joined) and joined[-1].startswith("--") and "=" not in joined[-1]
        )
        if is_value and re.match(r"-\.?\d", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        The words of the command, by default those that the program was called with.

    Returns
    -------
    int
        The exit code: 0 only if all that was asked for was done.

    Raises
    ------
    Exception
        If it is none of this program's own: a fault of the program.
    """
    terminal.listen()
    terminal.take()
    # numpy and matplotlib raise at import where these are odd
    os.environ.pop("MPLBACKEND", None)
    date = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not (date.isdecimal() and len(date) <= DATE_DIGITS):
        os.environ.pop("SOURCE_DATE_EPOCH", None)
    # a home that cannot be written is no news: matplotlib has then a cache of its own
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    warnings.showwarning = lambda message, *_, **__: say(f"warning: {message}")
    # PYTHONWARNINGS=error is about libraries: a message of this program ends no command
    warnings.simplefilter("default", UserWarning)
    words = sys.argv[1:] if arguments is None else arguments
    options = parser().parse_args(_with_negative_numbers(words))
    try:
        if getattr(options, "workers", 1) < 1:
            raise InputError("at least 1", "--workers")
        code = int(options.run(options))
    except (Exception, KeyboardInterrupt) as error:
        failure = of_exception(error)
        if isinstance(failure, Fault):
            raise
        say(failure)
        code = failure.exit_code
    lost = terminal.lost()
    if lost and not code:
        say(f"the answer could not be written: {lost.strerror}")
        return 1
    return code


def commands() -> list[Command]:
    """Collect the commands of the core and of the guests.

    Returns
    -------
    list of Command
        In the order of `--help`.
    """
    found = [*of_core()]
    for offer in guests.offers():
        found += offer.commands
    return sorted(found, key=lambda command: command.order)


def parser() -> Parser:
    """Make the parser of all commands.

    Returns
    -------
    Parser
        The parser.
    """
    about = "When does a sediment grain, or a whole bedform of grains, start to move?"
    made = Parser(prog="orchestrator", description=about)
    made.add_argument("--version", action="version", version=__version__)
    words = made.add_subparsers(required=True, metavar="command")
    for command in commands():
        command.add(words)
    return made
