"""The command `threshold`, with what guests add to it."""

from argparse import Namespace

from orchestrator import guests
from orchestrator.calculator import cli
from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add the options of the command, and those of guests."""
    cli.options(command)
    for offer in guests.offers():
        if offer.threshold is not None:
            offer.threshold.options(command)


def _run(options: Namespace) -> int:
    """Run the command, or what a guest makes of it."""
    for offer in guests.offers():
        if offer.threshold is not None:
            code = offer.threshold.run(options)
            if code is not None:
                return code
    return cli.run(options)


COMMAND = Command(
    name="threshold",
    order=1,
    help="compute when one grain starts to move, closed form, at once",
    page="docs/threshold.md",
    examples={
        "threshold --fluid air --diameter 3e-4 --density 2650": "sand in wind",
        "threshold --fluid water --diameter 1e-4:2e-3:20 --csv": "a table of sizes",
    },
    options=_options,
    run=_run,
)
