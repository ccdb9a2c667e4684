"""The commands of the benchmark."""

import sys
from argparse import Namespace
from pathlib import Path

from orchestrator.command import Command, Parser


def add_options(command: Parser) -> None:
    """Add the parts of the command.

    Parameters
    ----------
    command
        Its parser.
    """
    parts = command.add_subparsers(required=True, metavar="part")
    for part in PARTS:
        part.add(parts)


def _add_pack(command: Parser, places: str) -> None:
    """Add the options that all parts have."""
    # the directories first: an option of several values would take them for its own
    command.usage = f"%(prog)s {places} [OPTION ...]"
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


def _add_scenes(command: Parser) -> None:
    """Add the choice of scenes by their names."""
    command.add_argument(
        "--scene",
        action="extend",
        nargs="+",
        default=[],
        metavar="PATTERN",
        help="only these scenes, such as '2-incline-*'",
    )


def _of_export(command: Parser) -> None:
    """Add the options of `benchmark export`."""
    _add_pack(command, "PACK")
    text = "a finished study; without one only levels 1 and 2, which are formulas"
    command.add_argument("--from", dest="study", type=Path, metavar="DIR", help=text)


def _of_run(command: Parser) -> None:
    """Add the options of `benchmark run`."""
    _add_pack(command, "PACK")
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


def _of_compare(command: Parser) -> None:
    """Add the options of `benchmark compare`."""
    _add_pack(command, "PACK RESULTS ...")
    _add_scenes(command)
    text = "holds SCENE/answer.csv; unless run wrote it, its name is the solver's"
    command.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help=text)
    text = "or results/comparison-NAME of the pack"
    text = f"default: the only RESULTS, if run wrote them, {text}"
    command.add_argument("--out", type=Path, metavar="DIR", help=text)


def _export(options: Namespace) -> int:
    from orchestrator.benchmark.export import export

    count = export(options.pack, options.study, options.level)
    print(f"{options.pack}: {count} scenes")
    return 0


def _judge(options: Namespace) -> int:
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


PARTS = (
    Command(
        name="benchmark export",
        order=0,
        help="write scenes and their expected answers",
        page="docs/benchmark.md",
        examples={
            "benchmark export pack": "write the scenes that are formulas",
            "benchmark export pack --from results/first-look": "those of a study too",
        },
        options=_of_export,
        run=_export,
    ),
    Command(
        name="benchmark run",
        order=1,
        help="run a solver on each scene, ours in turn, and compare",
        page="docs/benchmark.md",
        examples={
            "benchmark run pack --solver './mine {case} {out}'": "run every scene",
            "benchmark run pack --level 1 --solver './mine {case} {out}'": "one level",
        },
        options=_of_run,
        run=_judge,
    ),
    Command(
        name="benchmark compare",
        order=2,
        help="compare answers that are there already",
        page="docs/benchmark.md",
        examples={
            "benchmark compare pack results/benchmark-mine": "judge answers again",
            "benchmark compare pack mine theirs": "two solvers side by side",
        },
        options=_of_compare,
        run=_judge,
    ),
)
"""The parts of the command, in the order of `--help`."""
COMMAND = Command(
    name="benchmark",
    order=13,
    help="compare another solver with this one",
    page="docs/benchmark.md",
    examples={
        "benchmark export pack": "write the scenes that are formulas",
        "benchmark run pack --solver './mine {case} {out}'": "judge a solver",
    },
    options=add_options,
    run=lambda _: 0,  # one of its parts is required, and runs
)
"""The command."""
