"""The command `study`."""

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from orchestrator import guests
from orchestrator.command import Command, Parser, add_run_options
from orchestrator.runs import terminal
from orchestrator.runs.queues import SYSTEMS, Queue
from orchestrator.study.units import number

if TYPE_CHECKING:
    from orchestrator.study.own_errors import OwnErrors


def _options(command: Parser) -> None:
    """Add the options of the command."""
    add_run_options(command, "first-look", of="file")
    text = "accepted relative error of a threshold, such as 0.05; the fastest models "
    text += "known to be within it are taken"
    command.add_argument("--tolerance", type=number, metavar="X", help=text)
    text = "directory of a ladder, whose numerical errors are taken in place of those "
    text += "of the package"
    command.add_argument("--errors", type=Path, metavar="DIR", help=text)
    text = "run the cases in jobs of a queue: %(choices)s; its settings stand in the "
    text += "table [cluster] of the file"
    queues = sorted(SYSTEMS)
    command.add_argument("--cluster", choices=queues, metavar="QUEUE", help=text)


def _run(options: Namespace) -> int:
    """Run a study; of one that was finished before its answer is printed."""
    if not options.plan:
        answered = answer_finished(options)
        if answered:
            print("it was answered already; no solver was started", file=sys.stderr)
            answer, page = answered
            print(terminal.shown(answer), terminal.page_line(page), sep="\n")
            return 0
    study = guests.load_study(options.source, options.tolerance)
    study = study.with_errors(_errors(options))
    code = guests.taken_over(study, options)
    if code is not None:
        return code
    from orchestrator import pipeline, plan

    out = options.out or Path("results") / study.name
    if options.plan:
        cases = out.absolute() / "cases"
        print(terminal.fitted(plan.forecast(study, cases, options.workers)))
        return 0
    queue = Queue(options.cluster, study.cluster) if options.cluster else None
    ended = pipeline.run(study, out, workers=options.workers, queue=queue)
    return ended.tell()


def _errors(options: Namespace) -> "OwnErrors | None":
    """The numerical errors in place of the package's; None where none are given."""
    from orchestrator.study.own_errors import own_errors

    return own_errors(options.errors) if options.errors else None


def answer_finished(options: Namespace) -> tuple[str, Path] | None:
    """Look up a study that was finished before.

    No study is read: the bytes of its files are compared with those that it was made
    from.

    Parameters
    ----------
    options
        The options of the command ``study``.

    Returns
    -------
    answer, page : tuple, or None
        The answer and the file of the page; None if it was not finished.
    """
    from orchestrator.runs import workspace
    from orchestrator.study.source import Source, digests_now, find

    file = find(options.source).absolute()
    root = (options.out or Path("results") / file.stem).absolute()
    try:
        digests = digests_now(file.parent, workspace.files_of(root))
    except OSError:
        return None
    now = Source(str(file), digests, options.tolerance, _errors(options))
    return workspace.finished(root, file.stem, now.described(root))


COMMAND = Command(
    name="study",
    order=0,
    help="run the missing cases of a study, and write its page",
    page="docs/first-study.md",
    examples={
        "study first-look": "run a preset; its page is results/first-look",
        "study sand.toml --plan": "list what your own file would run, and end",
    },
    options=_options,
    run=_run,
)
