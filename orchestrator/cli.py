"""The command line: parse, call, print."""

import argparse
import os
import re
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator import __version__
from orchestrator.benchmark import cli as benchmark
from orchestrator.calculator import cli as calculator
from orchestrator.errors import (
    OrchestratorError,
    is_of_import,
    is_of_shortage,
    of_shortage,
    of_system,
)
from orchestrator.runs import terminal
from orchestrator.runs.cluster import SYSTEMS, Queue

if TYPE_CHECKING:
    from orchestrator.study.study import Study

INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 only if all that was asked for was done."""
    terminal.listen()
    terminal.take()
    # numpy raises at import where this variable is not an integer
    if not re.fullmatch("[0-9]{1,11}", os.environ.get("SOURCE_DATE_EPOCH", "0")):
        del os.environ["SOURCE_DATE_EPOCH"]
    warnings.showwarning = _show_warning
    # PYTHONWARNINGS=error is about libraries: a message of this program ends no command
    warnings.simplefilter("default", UserWarning)
    options = _parser().parse_args(arguments)
    code = _code(options)
    lost = terminal.lost()
    if lost and not code:
        print(f"orchestrator: the answer could not be written: {lost.strerror}", file=sys.stderr)
        return 1
    return code


def _code(options: argparse.Namespace) -> int:
    try:
        return int(options.run(options))
    except OrchestratorError as error:
        print(f"orchestrator: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt as stop:
        print("orchestrator: stopped; the same command continues", file=sys.stderr)
        if is_of_import(stop):  # OpenBLAS raises SIGINT where it can start no thread
            print("orchestrator: or no thread can be started: see ulimit -u", file=sys.stderr)
        return INTERRUPTED
    except OSError as error:
        print(f"orchestrator: {of_system(error)}", file=sys.stderr)
        return 1
    except Exception as error:
        if not is_of_shortage(error) and not is_of_import(error):
            raise
        print(f"orchestrator: {of_shortage(error)}", file=sys.stderr)
        return 1


class Parser(argparse.ArgumentParser):
    """A parser that takes options by their whole names alone, and negative numbers as values."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{**settings, "allow_abbrev": False})
        # that of Python 3.14; before, -1e-3 and -30:30:7 count as options
        self._negative_number_matcher = re.compile(r"-\.?\d")


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"orchestrator: warning: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="orchestrator",
        description="When does a sediment grain, or a whole bedform of grains, start to move?",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command")
    _add_study(commands)
    calculator.add(commands)
    _add_directory_commands(commands)
    _add_experiments(commands)
    benchmark.add(commands)
    command = commands.add_parser(
        "doctor", help="are the solvers here, can it draw; what to install"
    )
    command.set_defaults(run=_doctor)
    return parser


def _add_study(commands: Any) -> None:
    command = commands.add_parser("study", help="run what is missing of a study, and draw it")
    command.add_argument(
        "source",
        nargs="?",
        default="first-look",
        metavar="FILE|PRESET",
        help="default: %(default)s",
    )
    _add_run_options(command)
    command.add_argument(
        "--tolerance",
        type=float,
        metavar="X",
        help="relative error that tau_c may have: the cheapest models known to be within it;"
        " 0: every scene as the file asks",
    )
    command.add_argument(
        "--cluster",
        choices=sorted(SYSTEMS),
        metavar="QUEUE",
        help="run the cases in jobs of a queue: %(choices)s; settings in the file's [cluster]",
    )
    command.add_argument(
        "--plan", action="store_true", help="say what would run, how long and how large, and end"
    )
    command.set_defaults(run=_study)


def _add_run_options(command: Any) -> None:
    command.add_argument("--out", type=Path, metavar="DIR", help="default: results/NAME")
    command.add_argument(
        "--workers", type=_workers, default=os.cpu_count() or 1, metavar="N", help="cases at a time"
    )


def _add_experiments(commands: Any) -> None:
    for name, text in (
        ("ladder", "what each model costs and how far it is off: speed against accuracy"),
        ("budget", "what the choices are worth that all models share: a tornado for each scene"),
    ):
        command = commands.add_parser(name, help=text)
        command.add_argument(
            "source", nargs="?", default=name, metavar="FILE|PRESET", help="default: %(default)s"
        )
        _add_run_options(command)
        command.set_defaults(run=partial(_experiment, name))
    command = commands.add_parser("stability", help="maps of where each method fails")
    _add_run_options(command)
    command.set_defaults(run=_stability)


def _add_directory_commands(commands: Any) -> None:
    for name, function, text in (
        ("status", _status, "what of a study is done, running, failed and why"),
        ("report", _report, "draw tables, figures and page of a study again"),
        ("gallery", _gallery, "one page over the studies that a directory holds"),
        ("prune", _prune, "drop the large files of finished cases; a rerun makes them anew"),
    ):
        command = commands.add_parser(name, help=text)
        command.add_argument("directory", type=Path, metavar="DIR")
        command.set_defaults(run=function)


def _workers(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("at least 1")
    return number


def _study(options: argparse.Namespace) -> int:
    from orchestrator import paper, pipeline
    from orchestrator.study import study

    asked = study.load(options.source, [paper.PRESETS])
    if options.tolerance is not None:
        study.check_tolerance(options.tolerance, "--tolerance")
        asked = replace(asked, tolerance=options.tolerance)
    out = options.out or Path("results") / asked.name
    if options.plan:
        return _plan(asked, out, options.workers)
    queue = Queue(options.cluster, asked.cluster) if options.cluster else None
    guests = (paper.report_card,)
    finished = pipeline.run(asked, out, workers=options.workers, queue=queue, guests=guests)
    if not finished.started:
        print("every case was done already; no solver was started", file=sys.stderr)
    if finished.left:
        print(
            f"the study file has changed: {len(finished.left)} cases are not asked for any more; "
            f"`orchestrator status {out}` names them",
            file=sys.stderr,
        )
    return _end(finished.page, finished.failures, finished.answer)


def _plan(asked: "Study", out: Path, workers: int) -> int:
    from orchestrator import pipeline, plan, preview
    from orchestrator.runs.workspace import Workspace

    space = Workspace(out.absolute())
    planned = plan.settled(asked, space.cases)
    todo = pipeline.missing(planned, space)
    print(preview.text(asked, planned, list(todo.values()), workers))
    return 0


def _experiment(name: str, options: argparse.Namespace) -> int:
    """Run an experiment on the scenes of a study."""
    from orchestrator import paper
    from orchestrator.study import study

    experiment = import_module(f"orchestrator.experiments.{name}")
    asked = study.load(options.source, [paper.PRESETS])
    out = options.out or Path("results") / name
    finished = experiment.run(asked, out, workers=options.workers)
    return _end(finished.page, finished.failures)


def _stability(options: argparse.Namespace) -> int:
    from orchestrator.experiments.stability import run

    out = options.out or Path("results") / "stability"
    return _end(run(out, workers=options.workers).page, {})


def _report(options: argparse.Namespace) -> int:
    from orchestrator import paper, pipeline

    finished = pipeline.redraw(options.directory, (paper.report_card,))
    return _end(finished.page, finished.failures, finished.answer)


def _end(page: Path, failures: dict[str, OrchestratorError], answer: str = "") -> int:
    """Print the answer, what failed, and last the page."""
    if answer:
        print(answer)
    for name, error in failures.items():
        print(f"orchestrator: {name} failed: {error}", file=sys.stderr)
    print(page)
    return 3 if failures else 0


def _status(options: argparse.Namespace) -> int:
    from orchestrator.runs import workspace

    found = workspace.status(options.directory)
    print(workspace.status_text(found))
    return 3 if found.failed else 0


def _gallery(options: argparse.Namespace) -> int:
    from orchestrator import gallery

    print(gallery.write(options.directory))
    return 0


def _prune(options: argparse.Namespace) -> int:
    from orchestrator import pipeline

    print(pipeline.prune(options.directory))
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from orchestrator.solvers import doctor

    findings = doctor.examine()
    print(doctor.text(findings))
    return 0 if all(finding.good for finding in findings) else 1
