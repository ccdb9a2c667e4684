"""Hours a year in which sand moves on a beach and a dune, by place."""

from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser
from orchestrator.guests import Offer
from orchestrator.study.units import number


def _options(command: Parser) -> None:
    """Add the options of the command."""
    command.add_argument("directory", type=Path, metavar="DIR", help="a finished study")
    text = "winds of the place: a series by the hour, or a table of shares"
    command.add_argument("--wind", type=Path, required=True, metavar="FILE", help=text)
    text = "direction from which the wind of the study blows, degrees from north"
    command.add_argument(
        "--from", dest="from_deg", type=number, required=True, metavar="DEG", help=text
    )
    text = "z0 of the ground at the anemometer, m; default: that of the bed"
    command.add_argument("--ground-roughness", type=number, metavar="Z0", help=text)
    command.add_argument("--csv", action="store_true", help="a row for each place")


def _run(options: Namespace) -> int:
    """Print the hours of a finished study."""
    from orchestrator.hours.places import run_hours

    return run_hours(options)


OFFER = Offer(
    commands=(
        Command(
            name="hours",
            order=14,
            help="count the hours a year in which sand moves, by place",
            page="docs/dune.md",
            examples={
                "hours results/dune --wind year.csv --from 270": (
                    "beach, foot, slope and brink in the wind from the west"
                ),
                "hours results/dune --wind year.csv --from 270 --csv": "as a table",
            },
            options=_options,
            run=_run,
        ),
    )
)
