"""The command line: parse, call, print."""

import argparse
import difflib
import gc
import os
import sys
import warnings
from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator import __version__
from orchestrator.benchmark import cli as benchmark
from orchestrator.calculator import cli as calculator
from orchestrator.errors import Fault, InputError, of_exception
from orchestrator.runs import terminal
from orchestrator.runs.cluster import SYSTEMS, Queue
from orchestrator.study.units import number, whole_number

if TYPE_CHECKING:
    from orchestrator.pipeline import Finished


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 only if all that was asked for was done."""
    # fewer searches for unreachable cycles: 6 % less time for the plan of 375 cases
    gc.set_threshold(100_000)
    terminal.listen()
    terminal.take()
    for name in ("SOURCE_DATE_EPOCH", "MPLBACKEND"):
        # numpy and matplotlib raise at import where these are odd; figures need neither
        os.environ.pop(name, None)
    warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
    # PYTHONWARNINGS=error is about libraries: a message of this program ends no command
    warnings.simplefilter("default", UserWarning)
    options = _parser().parse_args(sys.argv[1:] if arguments is None else arguments)
    try:
        if getattr(options, "workers", 1) < 1:
            raise InputError("at least 1", "--workers")
        code = int(options.run(options))
    except (Exception, KeyboardInterrupt) as error:
        failure = of_exception(error)
        if isinstance(failure, Fault):
            raise
        _say(failure)
        code = failure.exit_code
    lost = terminal.lost()
    if lost and not code:
        _say(f"the answer could not be written: {lost.strerror}")
        return 1
    return code


def _say(message: object) -> None:
    print(f"orchestrator: {message}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """A parser of options that are written in full; of an unknown one it names the nearest."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{**settings, "allow_abbrev": False})

    def parse_known_args(self, args: Any, namespace: Any = None) -> Any:  # type: ignore[override]
        """Refuse an unknown option first: another may be missing because of it."""
        names = {word.partition("=")[0] for word in args if word.startswith("--")} - {
            "--"
        }
        # what follows a command is its own parser's
        for name in () if self._subparsers else names - {*self._option_string_actions}:
            near = difflib.get_close_matches(name, self._option_string_actions, 1)
            advice = f"did you mean {near[0]}?" if near else "--help lists all"
            self.error(f"there is no option {name}: {advice}")
        return super().parse_known_args(args, namespace)


def _parser() -> argparse.ArgumentParser:
    about = "When does a sediment grain, or a whole bedform of grains, start to move?"
    parser = _Parser(prog="orchestrator", description=about)
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command")
    for name, run, text in (
        ("study", _study, "run what is missing of a study, and draw it"),
        ("status", _other, "what of a study is done, running, failed and why"),
        ("report", _other, "draw tables, figures and page of a study again"),
        ("gallery", _other, "one page over the studies that a directory holds"),
        (
            "prune",
            _other,
            "drop the large files of finished cases; a rerun makes them anew",
        ),
        ("ladder", _study, "what each model costs and how far it is off"),
        ("budget", _study, "what the choices are worth that all models share"),
        ("stability", _study, "for developers: maps of where each method fails"),
        ("validate", _study, "the models beside what was measured"),
        (
            "erosion",
            _study,
            "what wind takes from a stockpile, by its solved flow and by AP-42",
        ),
        ("doctor", _other, "are the solvers here, can it draw; what to install"),
    ):
        command = commands.add_parser(name, help=text)
        command.set_defaults(run=run, command=name, tolerance=None)
        add = command.add_argument
        if run == _other and name != "doctor":
            add("directory", type=Path, metavar="DIR")
        if name == "report":
            add(
                "--all",
                action="store_true",
                help="draw the figures too that it folds away",
            )
        if run == _study:
            if name != "stability":
                preset = {"study": "first-look", "erosion": "stockpile"}.get(name, name)
                add("source", nargs="?", default=preset, metavar="FILE|PRESET")
            count = os.cpu_count() or 1
            add("--out", type=Path, metavar="DIR", help="default: results/NAME")
            add(
                "--workers",
                type=whole_number,
                default=count,
                metavar="N",
                help="cases at a time",
            )
            add(
                "--plan",
                action="store_true",
                help="say what would run, how long, and end",
            )
        if name == "study":
            text = "error that tau_c may have, such as 0.05: the cheapest models known to be within"
            add("--tolerance", type=number, metavar="X", help=text)
            text = "run the cases in jobs of a queue: %(choices)s; settings in the file's [cluster]"
            add("--cluster", choices=sorted(SYSTEMS), metavar="QUEUE", help=text)
            calculator.add(commands)
    benchmark.add(commands)
    return parser


def _study(options: Namespace) -> int:
    """Run a study, or an experiment: but for the maps of stability, on scenes of a study."""
    is_study = options.command == "study"
    if is_study and not options.plan:
        answered = finished(options)
        if answered:
            print("every case was done already; no solver was started", file=sys.stderr)
            print(*answered, sep="\n")
            return 0
    from orchestrator import pipeline, plan
    from orchestrator.study.study import load

    workers = options.workers
    studies = []
    if "source" in options:
        studies = [load(options.source, options.tolerance)]
    name = studies[0].name if is_study else options.command
    out = options.out or Path("results") / name
    cases = out.absolute() / "cases"
    if is_study:
        (study,) = studies
        if options.plan:
            print(*plan.forecast(study, cases, workers), sep="\n")
            return 0
        queue = Queue(options.cluster, study.cluster) if options.cluster else None
        return _end(pipeline.run(study, out, workers=workers, queue=queue))
    module = import_module(f"orchestrator.experiments.{options.command}")
    experiment = module.experiment(*studies, out)
    if options.plan:
        print(*plan.expected(experiment.planned, cases, workers), sep="\n")
        return 0
    return _end(experiment.run(out, workers=workers))


def finished(options: Namespace) -> tuple[str, Path] | None:
    """The answer and the page of a study that was finished before; None if it is not.

    No study is read: the bytes of its files are compared with those that it was made from.
    """
    from orchestrator.runs import workspace
    from orchestrator.study.source import Source, digests_now, find

    file = find(options.source).absolute()
    root = (options.out or Path("results") / file.stem).absolute()
    try:
        digests = digests_now(file.parent, workspace.files_of(root))
    except OSError:
        return None
    now = Source(str(file), digests, options.tolerance)
    return workspace.finished(root, file.stem, now.described(root))


def _other(options: Namespace) -> int:
    """Run a command that asks for no case."""
    if options.command == "doctor":
        from orchestrator.solvers import doctor

        findings = list(doctor.examine())
        print(doctor.text(findings))
        return 0 if all(finding.good for finding in findings) else 1
    if options.command == "status":
        from orchestrator.runs import workspace

        text, has_failed = workspace.status(options.directory)
        print(text)
        return 3 if has_failed else 0
    from orchestrator import gallery, pipeline

    if options.command == "report":
        return _end(pipeline.redraw(options.directory, every=options.all))
    print(
        (gallery.write if options.command == "gallery" else pipeline.prune)(
            options.directory
        )
    )
    return 0


def _end(finished: "Finished") -> int:
    """Print the answer, the failures, and last the page; the exit code."""
    if finished.answer:
        print(finished.answer)
    for name, error in finished.failures.items():
        _say(f"{name} failed: {error}")
    if finished.undrawn:
        _say("the page lacks a figure; the same command draws it again")
    print(finished.page)
    if finished.failures:
        return 3
    return 1 if finished.undrawn else 0
