"""Wind erosion of a stockpile, beside US EPA AP-42."""

from argparse import Namespace
from pathlib import Path

from orchestrator import guests
from orchestrator.command import Command, Parser, add_run_options


def _options(command: Parser) -> None:
    """Add the options of the command."""
    add_run_options(command, "stockpile")


def _run(options: Namespace) -> int:
    """Run the experiment on a section, or that of a guest on its own beds."""
    study = guests.load_study(options.source, options.tolerance)
    code = guests.taken_over(study, options)
    if code is not None:
        return code
    from orchestrator.stockpile.erosion import PileErosion

    out = options.out or Path("results") / options.command
    return PileErosion(study).command(options, out)


OFFER = guests.Offer(
    commands=(
        Command(
            name="erosion",
            order=11,
            help="compute what wind takes from a stockpile, also by AP-42",
            page="docs/stockpile.md",
            examples={
                "erosion": "run the preset stockpile",
                "erosion heap.toml --plan": "list what your own file would run",
            },
            options=_options,
            run=_run,
        ),
    )
)
