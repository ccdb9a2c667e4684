"""A command of the program: its words, its options, and what it runs."""

import argparse
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator.errors import suggestion
from orchestrator.runs import processors
from orchestrator.study.units import whole_number

_FORM = argparse.RawDescriptionHelpFormatter


class Parser(ArgumentParser):
    """A parser that names the nearest option in place of an unknown one.

    Attributes
    ----------
    ending
        What `--help` ends with.
    """

    ending = ""

    def __init__(self, **settings: Any) -> None:
        fixed = {"allow_abbrev": False, "formatter_class": _FORM}
        super().__init__(**{**settings, **fixed})

    def format_help(self) -> str:
        """The help with examples of the command, and its page, at its end."""
        text = super().format_help()
        return f"{text}\n{self.ending}\n" if self.ending else text

    def parse_known_args(self, args: Any, namespace: Any = None) -> Any:  # type: ignore[override]
        """Refuse an unknown option first: another may be missing because of it."""
        if not self._subparsers:  # what follows a command is its own parser's
            self._refuse_unknown(args)
        return super().parse_known_args(args, namespace)

    def _refuse_unknown(self, args: Sequence[str]) -> None:
        """Refuse an option that the parser does not know."""
        known = self._option_string_actions
        for word in args:
            name = word.partition("=")[0]
            if not name.startswith("--") or name == "--" or name in known:
                continue
            advice = suggestion(name, known) or "--help lists all"
            self.error(f"there is no option {name}: {advice}")


@dataclass(frozen=True)
class Command:
    """A command, or a part of one.

    Attributes
    ----------
    name
        Its words after ``orchestrator``.
    order
        Its place among the commands that `--help` lists, from 0.
    help
        What it does, in a line.
    page
        The page of the documents that explains it.
    examples
        Examples of the command, each with what it does.
    options
        Adds its options to its parser.
    run
        Runs it with its options, and returns the exit code.
    """

    name: str
    order: int
    help: str
    page: str
    examples: Mapping[str, str]
    options: Callable[[Parser], None]
    run: Callable[[Namespace], int]

    def add(self, commands: Any) -> None:
        """Add the command to a parser.

        Parameters
        ----------
        commands
            The subparsers of the program or of another command, as argparse makes
            them.
        """
        words = self.name.split()
        parser: Parser = commands.add_parser(words[-1], help=self.help)
        parser.set_defaults(run=self.run, command=self.name, tolerance=None)
        lines = ["examples:"]
        for line, meaning in self.examples.items():
            lines += [f"  orchestrator {line}", f"      {meaning}"]
        parser.ending = "\n".join([*lines, "", f"explained in {self.page}"])
        self.options(parser)


class Extension(NamedTuple):
    """Options that a guest adds to a command of the core, and what they run.

    Attributes
    ----------
    options
        Adds the options to the parser of the command.
    run
        Runs the command where one of them is given, and returns the exit code, or None
        where none is.
    """

    options: Callable[[Parser], None]
    run: Callable[[Namespace], int | None]


def add_run_options(command: Parser, preset: str, of: str = "command") -> None:
    """Add the options of a command that runs cases, on a study if it has a preset.

    Parameters
    ----------
    command
        The parser of the command.
    preset
        The preset that it runs by default; empty for a command on scenes of its own.
    of
        Whose name the directory of the results has by default.
    """
    add = command.add_argument
    if preset:
        text = f"study file, or name of a preset; default: {preset}"
        add("source", nargs="?", default=preset, metavar="FILE|PRESET", help=text)
    text = f"directory of the results; default: results/ and the name of the {of}"
    add("--out", type=Path, metavar="DIR", help=text)
    count = processors.usable_count()
    text = "number of cases at a time; default: one for each processor that it may use"
    add("--workers", type=whole_number, default=count, metavar="N", help=text)
    text = "list what would run, with time and disk, and end"
    add("--plan", action="store_true", help=text)


def say(message: object) -> None:
    """Print a message of this program.

    Parameters
    ----------
    message
        The message.
    """
    print(f"orchestrator: {message}", file=sys.stderr)
