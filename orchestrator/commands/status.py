"""The command `status`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add the options of the command."""
    text = "directory of a study, such as results/first-look"
    command.add_argument("directory", type=Path, metavar="DIR", help=text)


def _run(options: Namespace) -> int:
    """Print the states of the cases; 3 where one has failed."""
    from orchestrator.runs import workspace

    text, has_failed = workspace.status(options.directory)
    print(text)
    return 3 if has_failed else 0


COMMAND = Command(
    name="status",
    order=2,
    help="list the cases that are done, running or failed, and why",
    page="docs/reliability.md",
    examples={
        "status results/first-look": "the cases of a study",
        "status results/erosion": "the cases of an experiment",
    },
    options=_options,
    run=_run,
)
