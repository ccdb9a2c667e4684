"""The command line: parse, call, print."""

import argparse
import os
import re
import sys
import warnings
from argparse import Namespace
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator import __version__, examples
from orchestrator.benchmark import cli as benchmark
from orchestrator.calculator import cli as calculator
from orchestrator.errors import Fault, InputError, of_exception, suggestion
from orchestrator.runs import processors, terminal
from orchestrator.runs.cluster import SYSTEMS, Queue
from orchestrator.study.units import number, whole_number

if TYPE_CHECKING:
    from orchestrator.experiments.experiment import Experiment
    from orchestrator.pipeline import Finished
    from orchestrator.study.surface_study import SurfaceStudy

OF_SURFACES = {
    "study": "orchestrator.experiments.surface",
    "erosion": "orchestrator.experiments.surface_erosion",
}
"""Commands on beds in three dimensions, and the modules of their experiments."""


TRUTH = ("ridge", "turn", "interval", "piles", "askervein")
"""Comparisons of flows over beds in three dimensions."""
COMMANDS = {
    "study": "run the missing cases of a study, and write its page",
    "status": "list the cases that are done, running or failed, and why",
    "report": "write tables, figures and page of a study again",
    "gallery": "write one page over the studies in a directory",
    "prune": "drop the large files of finished cases; a rerun makes them anew",
    "ladder": "measure the cost and the error of each fidelity",
    "budget": "measure how much each assumption changes a threshold",
    "stability": "draw maps of where each method fails; for developers",
    "validate": "compare the models with measured thresholds",
    "erosion": "compute what wind takes from a stockpile, also by AP-42",
    "doctor": "check solvers and drawing, and say what to install",
}
"""Commands that this module adds, with what each does."""
RUNNING = {
    "study": "first-look",
    "ladder": "ladder",
    "budget": "budget",
    "stability": "",
    "validate": "validate",
    "erosion": "stockpile",
}
"""Those that run cases, with the preset that each runs by default."""


def _with_negative_numbers(words: Sequence[str]) -> list[str]:
    """Write a negative number in one word with its option.

    Alone argparse takes -5e-3 and -29:29:9 for options.
    """
    joined: list[str] = []
    for word in words:
        is_value = (
            bool(joined) and joined[-1].startswith("--") and "=" not in joined[-1]
        )
        if is_value and re.match(r"-\.?\d", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        The words of the command, by default those that the program was called with.

    Returns
    -------
    int
        The exit code: 0 only if all that was asked for was done.

    Raises
    ------
    Exception
        If it is none of this program's own: a fault of the program.
    """
    terminal.listen()
    terminal.take()
    for name in ("SOURCE_DATE_EPOCH", "MPLBACKEND"):
        # numpy and matplotlib raise at import where these are odd; figures need neither
        os.environ.pop(name, None)
    warnings.showwarning = lambda message, *_, **__: _say(f"warning: {message}")
    # PYTHONWARNINGS=error is about libraries: a message of this program ends no command
    warnings.simplefilter("default", UserWarning)
    words = sys.argv[1:] if arguments is None else arguments
    options = parser().parse_args(_with_negative_numbers(words))
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
    """Print a message of this program."""
    print(f"orchestrator: {message}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """A parser that names the nearest option in place of an unknown one."""

    def __init__(self, **settings: Any) -> None:
        form = argparse.RawDescriptionHelpFormatter
        fixed = {"allow_abbrev": False, "formatter_class": form}
        super().__init__(**{**settings, **fixed})

    def format_help(self) -> str:
        """The help with examples of the command, and its page, at its end."""
        _, _, command = self.prog.partition(" ")
        text = super().format_help()
        if command not in examples.SHOWN:
            return text
        return f"{text}\n{examples.shown(command)}\n"

    def parse_known_args(self, args: Any, namespace: Any = None) -> Any:  # type: ignore[override]
        """Refuse an unknown option first: another may be missing because of it."""
        if not self._subparsers:  # what follows a command is its own parser's
            self._refuse_unknown(args)
        return super().parse_known_args(args, namespace)

    def _refuse_unknown(self, args: Sequence[str]) -> None:
        """Refuse an option that the parser does not know."""
        known = self._option_string_actions
        for word in args:
            name = word.partition("=")[0]
            if not name.startswith("--") or name == "--" or name in known:
                continue
            advice = suggestion(name, known) or "--help lists all"
            self.error(f"there is no option {name}: {advice}")


def parser() -> argparse.ArgumentParser:
    """Make the parser of all commands.

    Returns
    -------
    ArgumentParser
        The parser.
    """
    about = "When does a sediment grain, or a whole bedform of grains, start to move?"
    made = _Parser(prog="orchestrator", description=about)
    made.add_argument("--version", action="version", version=__version__)
    commands = made.add_subparsers(required=True, metavar="command")
    for name, text in COMMANDS.items():
        command = commands.add_parser(name, help=text)
        command.set_defaults(run=_function(name), command=name, tolerance=None)
        if name in RUNNING:
            _add_run_options(command, RUNNING[name])
        elif name != "doctor":
            text = "directory of a study, such as results/first-look"
            if name == "gallery":
                text = "directory that holds studies, such as results"
            command.add_argument("directory", type=Path, metavar="DIR", help=text)
        if name == "report":
            text = "draw the folded figures too"
            command.add_argument("--all", action="store_true", help=text)
        if name == "validate":
            text = "flows over beds in three dimensions alone: all, or one comparison"
            parts = ("all", *TRUTH)
            command.add_argument("--surfaces", choices=parts, help=text)
        if name == "study":
            _add_study_options(command)
            calculator.add(commands)
    benchmark.add(commands)
    return made


def _function(name: str) -> Callable[[Namespace], int]:
    """The function that runs a command."""
    if name == "study":
        return _study
    return _on_study if name in RUNNING else _other


def _add_run_options(command: argparse.ArgumentParser, preset: str) -> None:
    """Add the options of a command that runs cases, on a study if it has a preset."""
    add = command.add_argument
    if preset:
        text = f"study file, or name of a preset; default: {preset}"
        add("source", nargs="?", default=preset, metavar="FILE|PRESET", help=text)
    of_what = "file" if preset == "first-look" else "command"
    text = f"directory of the results; default: results/ and the name of the {of_what}"
    add("--out", type=Path, metavar="DIR", help=text)
    text = "number of cases at a time; default: one for each processor that it may use"
    workers = processors.count()
    add("--workers", type=whole_number, default=workers, metavar="N", help=text)
    text = "list what would run, with time and disk, and end"
    add("--plan", action="store_true", help=text)


def _add_study_options(command: argparse.ArgumentParser) -> None:
    """Add the options of the command that runs a study."""
    text = "accepted relative error of a threshold, such as 0.05; the fastest models "
    text += "known to be within it are taken"
    command.add_argument("--tolerance", type=number, metavar="X", help=text)
    text = "run the cases in jobs of a queue: %(choices)s; its settings stand in the "
    text += "table [cluster] of the file"
    queues = sorted(SYSTEMS)
    command.add_argument("--cluster", choices=queues, metavar="QUEUE", help=text)


def _study(options: Namespace) -> int:
    """Run a study; of one that was finished before its answer is printed."""
    if not options.plan:
        answered = finished(options)
        if answered:
            print("it was answered already; no solver was started", file=sys.stderr)
            print(*answered, sep="\n")
            return 0
    of_surface = _surface_study(options)
    if of_surface:
        return _surface(options, of_surface)
    from orchestrator import pipeline, plan
    from orchestrator.study.study import load

    study = load(options.source, options.tolerance)
    out = options.out or Path("results") / study.name
    if options.plan:
        cases = out.absolute() / "cases"
        print(*plan.forecast(study, cases, options.workers), sep="\n")
        return 0
    queue = Queue(options.cluster, study.cluster) if options.cluster else None
    return _end(pipeline.run(study, out, workers=options.workers, queue=queue))


def _on_study(options: Namespace) -> int:
    """Run an experiment on a study or, for stability, on its own scenes."""
    if getattr(options, "surfaces", None):
        truth = import_module("orchestrator.experiments.surface_truth")
        names = TRUTH if options.surfaces == "all" else (options.surfaces,)
        out = options.out or Path("results") / "surfaces"
        return _experiment(options, truth.experiment(names), out)
    of_surface = _surface_study(options)
    if of_surface:
        return _surface(options, of_surface)
    from orchestrator.study.study import load

    studies = []
    if "source" in options:
        studies.append(load(options.source, options.tolerance))
    out = options.out or Path("results") / options.command
    module = import_module(f"orchestrator.experiments.{options.command}")
    return _experiment(options, module.experiment(*studies, out), out)


def _surface_study(options: Namespace) -> "SurfaceStudy | None":
    """The study of a command, if it is of beds in three dimensions."""
    if options.command not in OF_SURFACES:
        return None
    surfaces = import_module("orchestrator.study.surface_study")
    asked: SurfaceStudy | None = surfaces.load(options.source)
    return asked


def _experiment(options: Namespace, experiment: "Experiment", out: Path) -> int:
    """Run an experiment, or say what it would run."""
    from orchestrator import plan
    from orchestrator.runs import workspace

    beside = workspace.beside(out, Path("results")) if experiment.shares_cases else ()
    if options.plan:
        experiment.check(out)
        cases = out.absolute() / "cases"
        planned = experiment.planned
        print(*plan.expected(planned, cases, options.workers, beside), sep="\n")
        return 0
    return _end(experiment.run(out, workers=options.workers, beside=beside))


def _surface(options: Namespace, study: "SurfaceStudy") -> int:
    """Run a study, or the experiment on erosion, of beds in three dimensions."""
    for name in ("cluster", "tolerance"):
        if getattr(options, name, None) is not None:
            what = "a bed in three dimensions has none"
            raise InputError(what, f"--{name}", "leave it out")
    for question in study.questions:
        warnings.warn(question, stacklevel=1)
    module = import_module(OF_SURFACES[options.command])
    name = study.name if options.command == "study" else options.command
    out = options.out or Path("results") / name
    return _experiment(options, module.experiment(study, out), out)


def finished(options: Namespace) -> tuple[str, Path] | None:
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
    now = Source(str(file), digests, options.tolerance)
    return workspace.finished(root, file.stem, now.described(root))


def _other(options: Namespace) -> int:
    """Run a command that asks for no case."""
    if options.command == "doctor":
        from orchestrator.solvers import doctor

        findings = list(doctor.examine())
        print(doctor.text(findings))
        is_good = all(finding.good for finding in findings)
        return int(not is_good)
    if options.command == "status":
        from orchestrator.runs import workspace

        text, has_failed = workspace.status(options.directory)
        print(text)
        return 3 if has_failed else 0
    from orchestrator import gallery, pipeline

    if options.command == "report":
        return _end(pipeline.redraw(options.directory, every=options.all))
    if options.command == "gallery":
        print(gallery.write(options.directory))
    else:
        print(pipeline.prune(options.directory))
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
    if finished.undrawn:
        return 1
    return 0
