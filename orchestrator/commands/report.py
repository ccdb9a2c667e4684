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
    text = "write the grains under the rising flow as an animation (GIF), and no page"
    command.add_argument("--movie", type=Path, metavar="FILE", help=text)


def _run(options: Namespace) -> int:
    """Draw the page again, or an animation."""
    from orchestrator import pipeline

    if options.movie:
        print(pipeline.film(options.directory, options.movie))
        return 0
    return pipeline.redraw(options.directory, every=options.all).tell()


COMMAND = Command(
    name="report",
    order=3,
    help="write tables, figures and page of a study again",
    page="docs/commands.md",
    examples={
        "report results/first-look": "draw its page again",
        "report results/dune --movie dune.gif": "an animation of its grains",
    },
    options=_options,
    run=_run,
)
