"""The commands of the benchmark: parse, call, print."""

import argparse
import math
import sys
from pathlib import Path
from typing import Any

LEVELS = (1, 2, 3, 4, 5)
LIMIT_S = 600.0
MEMORY_GIB = 4.0


def add(commands: Any) -> None:
    """Add ``benchmark`` with its parts to the parser of the program."""
    group = commands.add_parser("benchmark", help="compare another solver with this one")
    parts = group.add_subparsers(required=True, metavar="part")
    _add_export(parts)
    _add_run(parts)
    _add_compare(parts)


def _add_export(parts: Any) -> None:
    command = parts.add_parser("export", help="write scenes, and what is expected of a solver")
    command.add_argument("pack", type=Path, metavar="PACK", help="directory to write")
    command.add_argument(
        "--from",
        dest="study",
        type=Path,
        metavar="DIR",
        help="of a finished study; without one only levels 1 and 2, which are formulas",
    )
    _add_level(command)
    command.set_defaults(run=_export)


def _add_run(parts: Any) -> None:
    command = parts.add_parser("run", help="run a solver on each scene, ours in turn, and compare")
    command.add_argument("pack", type=Path, metavar="PACK")
    command.add_argument(
        "--solver",
        required=True,
        metavar="COMMAND",
        help="such as 'my-solver {case} {out}': a scene's directory, and the CSV file to write",
    )
    command.add_argument(
        "--out", type=Path, metavar="RESULTS", help="default: results/benchmark-NAME of the pack"
    )
    command.add_argument(
        "--limit",
        type=_positive,
        default=LIMIT_S,
        metavar="S",
        help="wall time for a scene; default %(default)g",
    )
    command.add_argument(
        "--memory",
        type=_positive,
        default=MEMORY_GIB,
        metavar="GIB",
        help="for a scene, all processes of the solver together; default %(default)g",
    )
    _add_choice(command)
    command.set_defaults(run=_run)


def _add_compare(parts: Any) -> None:
    command = parts.add_parser(
        "compare", help="the same for answers that are there already, of one solver or several"
    )
    command.add_argument("pack", type=Path, metavar="PACK")
    command.add_argument(
        "results",
        type=Path,
        nargs="+",
        metavar="RESULTS",
        help="holds SCENE/answer.csv; its name is the solver's",
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="of the page; default: the only RESULTS, if run wrote them, or"
        " results/benchmark-NAME of the pack",
    )
    _add_choice(command)
    command.set_defaults(run=_compare)


def _add_choice(command: Any) -> None:
    _add_level(command)
    command.add_argument(
        "--scene",
        action="append",
        default=[],
        metavar="PATTERN",
        help="only these, such as '2-incline-*'; may be repeated",
    )


def _add_level(command: Any) -> None:
    command.add_argument(
        "--level",
        action="append",
        default=[],
        type=int,
        choices=LEVELS,
        help="only this one; may be repeated",
    )


def _export(options: argparse.Namespace) -> int:
    from orchestrator.benchmark.export import export

    count = export(options.pack, options.study, options.level)
    print(f"{options.pack}: {count} scenes")
    return 0


def _run(options: argparse.Namespace) -> int:
    from orchestrator.benchmark import runner
    from orchestrator.runs.confined import GIB, Limits

    choice = runner.Choice(options.level, options.scene)
    limits = Limits(seconds=options.limit, memory=int(options.memory * GIB))
    return _end(runner.run(options.pack, options.solver, options.out, choice, limits))


def _compare(options: argparse.Namespace) -> int:
    from orchestrator.benchmark import runner

    choice = runner.Choice(options.level, options.scene)
    return _end(runner.compare(options.pack, options.results, options.out, choice))


def _positive(text: str) -> float:
    number = float(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError("more than 0, and finite")
    return number


def _end(found: Any) -> int:
    """Name what failed, where the page is, and give the exit code."""
    for line in found.failures:
        print(f"orchestrator: {line}", file=sys.stderr)
    print(found.summary)
    print(found.page)
    return 1 if found.failures else 0
