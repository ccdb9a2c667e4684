"""The command `prune`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add the options of the command."""
    text = "directory of a study, such as results/first-look"
    command.add_argument("directory", type=Path, metavar="DIR", help=text)


def _run(options: Namespace) -> int:
    """Drop the files, and print how much was freed."""
    from orchestrator import pipeline

    print(pipeline.prune(options.directory))
    return 0


COMMAND = Command(
    name="prune",
    order=5,
    help="drop the large files of finished cases; a rerun makes them anew",
    page="docs/reliability.md",
    examples={
        "prune results/first-look": "drop the large files of one study",
        "prune results/erosion": "those of an experiment",
    },
    options=_options,
    run=_run,
)
