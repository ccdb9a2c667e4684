"""The commands of the core, a file each: it holds a `COMMAND`, which is found here."""

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules

from orchestrator.command import Command


def commands() -> Iterator[Command]:
    """Find the commands of this package.

    Yields
    ------
    Command
        Each command.
    """
    for module in iter_modules(__path__):
        command: Command = import_module(f"{__name__}.{module.name}").COMMAND
        yield command
