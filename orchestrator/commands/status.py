"""The command `status`."""

import time
from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser

LOOK_S = 1.0
"""Time between two looks at a study that is watched, s."""


def _options(command: Parser) -> None:
    """Add the options of the command."""
    text = "directory of a study, such as results/first-look"
    command.add_argument("directory", type=Path, metavar="DIR", help=text)
    text = "show it until it has ended, from any terminal"
    command.add_argument("--watch", action="store_true", help=text)


def _run(options: Namespace) -> int:
    """Print the states of the cases; 3 where one has failed."""
    from orchestrator.runs import workspace

    if options.watch:
        _watch(options.directory)
    text, has_failed = workspace.status(options.directory)
    print(text)
    return 3 if has_failed else 0


def _watch(directory: Path) -> None:
    """Show the states of the cases while a process holds the study.

    On a terminal they stay in their place; elsewhere they are printed when they change.
    """
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from orchestrator.runs import workspace

    console = Console(highlight=False, soft_wrap=True)
    space = workspace.Workspace(directory.absolute())
    shown = ""
    with Live(console=console, auto_refresh=False, transient=True) as live:
        while space.is_held():
            text, _ = workspace.status(directory)
            if text != shown and console.is_terminal:
                live.update(Text(text), refresh=True)
            elif text != shown:
                print(text, flush=True)
            shown = text
            time.sleep(LOOK_S)


COMMAND = Command(
    name="status",
    order=2,
    help="list the cases that are done, running or failed, and why",
    page="docs/reliability.md",
    examples={
        "status results/first-look": "the cases of a study",
        "status results/first-look --watch": "the same, until the study has ended",
    },
    options=_options,
    run=_run,
)
