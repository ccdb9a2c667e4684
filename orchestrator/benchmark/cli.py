"""The commands of the benchmark."""

import argparse
import sys
from pathlib import Path
from typing import Any


def add(commands: Any) -> None:
    """Add ``benchmark`` with its parts to the parser of the program."""
    group = commands.add_parser(
        "benchmark", help="compare another solver with this one"
    )
    parts = group.add_subparsers(required=True, metavar="part")

    def part(name: str, run: Any, text: str) -> argparse.ArgumentParser:
        # the directories first: an option of several values would take them for its own
        usage = (
            f"%(prog)s PACK {'RESULTS ... ' if name == 'compare' else ''}[OPTION ...]"
        )
        command: argparse.ArgumentParser = parts.add_parser(
            name, help=text, usage=usage
        )
        command.set_defaults(run=run)
        command.add_argument(
            "pack", type=Path, metavar="PACK", help="directory of the pack"
        )
        several: dict[str, Any] = {"action": "extend", "nargs": "+", "default": []}
        text, levels = "only these levels, 1 to 5", (1, 2, 3, 4, 5)
        command.add_argument(
            "--level", **several, type=int, choices=levels, metavar="N", help=text
        )
        if name != "export":
            text = "only these scenes, such as '2-incline-*'"
            command.add_argument("--scene", **several, metavar="PATTERN", help=text)
        return command

    command = part("export", _export, "write scenes and their expected answers")
    text = "a finished study; without one only levels 1 and 2, which are formulas"
    command.add_argument("--from", dest="study", type=Path, metavar="DIR", help=text)

    command = part(
        "run", _judge, "run a solver on each scene, ours in turn, and compare"
    )
    text = "such as 'my-solver {case} {out}': a scene's directory, and the CSV file to write"
    command.add_argument("--solver", required=True, metavar="COMMAND", help=text)
    text = "what the page calls the solver; default: its script, or its program"
    command.add_argument("--name", default="", metavar="NAME", help=text)
    text = "default: results/benchmark-NAME of the pack"
    command.add_argument("--out", type=Path, metavar="RESULTS", help=text)
    text = "wall time for a scene; default %(default)g"
    command.add_argument("--limit", type=float, default=600.0, metavar="S", help=text)
    text = "memory of each process of the solver; default %(default)g"
    command.add_argument("--memory", type=float, default=4.0, metavar="GIB", help=text)

    command = part("compare", _judge, "the same for answers that are there already")
    text = "holds SCENE/answer.csv; unless run wrote it, its name is the solver's"
    command.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help=text)
    text = "default: the only RESULTS, if run wrote them, or results/benchmark-NAME of the pack"
    command.add_argument("--out", type=Path, metavar="DIR", help=text)


def _export(options: argparse.Namespace) -> int:
    from orchestrator.benchmark.export import export

    print(
        f"{options.pack}: {export(options.pack, options.study, options.level)} scenes"
    )
    return 0


def _judge(options: argparse.Namespace) -> int:
    """Run a solver, or read answers; print failures, summary and page, and give the exit code."""
    from orchestrator.benchmark import compare

    choice = compare.Options(options.level, options.scene)
    if "results" in options:
        outcome = compare.compare(options.pack, options.results, options.out, choice)
    else:
        choice = choice._replace(
            seconds=options.limit, memory=options.memory, name=options.name
        )
        outcome = compare.run(options.pack, options.solver, options.out, choice)
    for line in outcome.failures:
        print(f"orchestrator: {line}", file=sys.stderr)
    print(outcome.summary, outcome.page, sep="\n")
    return 1 if outcome.failures else 0
