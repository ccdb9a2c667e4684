"""The commands of the benchmark."""

import argparse
import sys
from pathlib import Path
from typing import Any


def add(commands: Any) -> None:
    """Add ``benchmark`` with its parts to the parser of the program.

    Parameters
    ----------
    commands
        The commands of the parser.
    """
    text = "compare another solver with this one"
    group = commands.add_parser("benchmark", help=text)
    parts = group.add_subparsers(required=True, metavar="part")
    _add_export(parts)
    _add_run(parts)
    _add_compare(parts)


def _part(parts: Any, name: str, text: str, places: str) -> argparse.ArgumentParser:
    """Add a part with the options that all have."""
    # the directories first: an option of several values would take them for its own
    usage = f"%(prog)s {places} [OPTION ...]"
    command: argparse.ArgumentParser = parts.add_parser(name, help=text, usage=usage)
    text = "directory of the pack"
    command.add_argument("pack", type=Path, metavar="PACK", help=text)
    command.add_argument(
        "--level",
        action="extend",
        nargs="+",
        default=[],
        type=int,
        choices=(1, 2, 3, 4, 5),
        metavar="N",
        help="only these levels, 1 to 5",
    )
    return command


def _add_scenes(command: argparse.ArgumentParser) -> None:
    """Add the choice of scenes by their names."""
    command.add_argument(
        "--scene",
        action="extend",
        nargs="+",
        default=[],
        metavar="PATTERN",
        help="only these scenes, such as '2-incline-*'",
    )


def _add_export(parts: Any) -> None:
    text = "write scenes and their expected answers"
    command = _part(parts, "export", text, "PACK")
    command.set_defaults(run=_export)
    text = "a finished study; without one only levels 1 and 2, which are formulas"
    command.add_argument("--from", dest="study", type=Path, metavar="DIR", help=text)


def _add_run(parts: Any) -> None:
    text = "run a solver on each scene, ours in turn, and compare"
    command = _part(parts, "run", text, "PACK")
    command.set_defaults(run=_judge)
    _add_scenes(command)
    text = "a scene's directory, and the CSV file to write"
    text = f"such as 'my-solver {{case}} {{out}}': {text}"
    command.add_argument("--solver", required=True, metavar="COMMAND", help=text)
    text = "what the page calls the solver; default: its script, or its program"
    command.add_argument("--name", default="", metavar="NAME", help=text)
    text = "default: results/benchmark-NAME of the pack"
    command.add_argument("--out", type=Path, metavar="RESULTS", help=text)
    text = "wall time for a scene; default %(default)g"
    command.add_argument("--limit", type=float, default=600.0, metavar="S", help=text)
    text = "memory of each process of the solver; default %(default)g"
    command.add_argument("--memory", type=float, default=4.0, metavar="GIB", help=text)


def _add_compare(parts: Any) -> None:
    text = "compare answers that are there already"
    command = _part(parts, "compare", text, "PACK RESULTS ...")
    command.set_defaults(run=_judge)
    _add_scenes(command)
    text = "holds SCENE/answer.csv; unless run wrote it, its name is the solver's"
    command.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help=text)
    text = "or results/comparison-NAME of the pack"
    text = f"default: the only RESULTS, if run wrote them, {text}"
    command.add_argument("--out", type=Path, metavar="DIR", help=text)


def _export(options: argparse.Namespace) -> int:
    from orchestrator.benchmark.export import export

    count = export(options.pack, options.study, options.level)
    print(f"{options.pack}: {count} scenes")
    return 0


def _judge(options: argparse.Namespace) -> int:
    """Run a solver, or read answers; print what came out, and give the exit code."""
    from orchestrator.benchmark import compare

    choice = compare.Options(options.level, options.scene)
    if "results" in options:
        outcome = compare.compare(options.pack, options.results, options.out, choice)
    else:
        limits = {"seconds": options.limit, "memory": options.memory}
        choice = choice._replace(**limits, name=options.name)
        outcome = compare.run(options.pack, options.solver, options.out, choice)
    for line in outcome.failures:
        print(f"orchestrator: {line}", file=sys.stderr)
    print(outcome.summary, outcome.page, sep="\n")
    return 1 if outcome.failures else 0
