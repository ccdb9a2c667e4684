"""The command `doctor`."""

from argparse import Namespace

from orchestrator.command import Command, Parser


def _options(command: Parser) -> None:
    """Add no option: the command has none."""


def _run(options: Namespace) -> int:
    """Print what was found; 1 where something is missing."""
    from orchestrator.solvers import doctor

    findings = list(doctor.examine())
    print(doctor.findings_text(findings))
    is_good = all(finding.good for finding in findings)
    return int(not is_good)


COMMAND = Command(
    name="doctor",
    order=12,
    help="check solvers and drawing, and say what to install",
    page="docs/troubleshooting.md",
    examples={
        "doctor": "check the programs that are installed",
        "doctor > doctor.txt": "keep the answer, to enclose with a question",
    },
    options=_options,
    run=_run,
)
