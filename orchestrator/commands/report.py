"""The command `report`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add the options of the command."""
    text = "directory of a study, such as results/first-look"
    command.add_argument("directory", type=Path, metavar="DIR", help=text)
    text = "draw the folded figures too"
    command.add_argument("--all", action="store_true", help=text)


def _run(options: Namespace) -> int:
    """Draw the page again."""
    from orchestrator import pipeline

    return pipeline.redraw(options.directory, every=options.all).tell()


COMMAND = Command(
    name="report",
    order=3,
    help="write tables, figures and page of a study again",
    page="docs/commands.md",
    examples={
        "report results/first-look": "draw its page again",
        "report results/paper --all": "draw the folded figures too",
    },
    options=_options,
    run=_run,
)
