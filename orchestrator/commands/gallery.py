"""The command `gallery`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add the options of the command."""
    text = "directory that holds studies, such as results"
    command.add_argument("directory", type=Path, metavar="DIR", help=text)


def _run(options: Namespace) -> int:
    """Write the page, and print its place."""
    from orchestrator import gallery

    print(gallery.write_gallery(options.directory))
    return 0


COMMAND = Command(
    name="gallery",
    order=4,
    help="write one page over the studies in a directory",
    page="docs/commands.md",
    examples={
        "gallery results": "one page over all studies in results",
        "gallery /data/studies": "the same for another directory",
    },
    options=_options,
    run=_run,
)
