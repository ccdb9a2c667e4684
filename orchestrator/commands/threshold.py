"""The command `threshold`."""

from orchestrator.calculator import cli
from orchestrator.command import Command

COMMAND = Command(
    name="threshold",
    order=1,
    help="compute when one grain starts to move, closed form, at once",
    page="docs/threshold.md",
    examples={
        "threshold --fluid air --diameter 3e-4 --density 2650": "sand in wind",
        "threshold --fluid water --diameter 1e-4:2e-3:20 --csv": "a table of sizes",
    },
    options=cli.options,
    run=cli.run,
)
