"""Two examples of each command and the page that explains it, for `--help`."""

from typing import NamedTuple


class Shown(NamedTuple):
    """What `--help` of a command ends with.

    Attributes
    ----------
    page
        The page of the documents that explains the command.
    lines
        Examples of the command, each with what it does.
    """

    page: str
    lines: dict[str, str]


SHOWN = {
    "study": Shown(
        "docs/first-study.md",
        {
            "study first-look": "run a preset; its page is results/first-look",
            "study sand.toml --plan": "list what your own file would run, and end",
        },
    ),
    "threshold": Shown(
        "docs/threshold.md",
        {
            "threshold --fluid air --diameter 3e-4 --density 2650": "sand in wind",
            "threshold --fluid water --diameter 1e-4:2e-3:20 --csv": "a table of sizes",
        },
    ),
    "status": Shown(
        "docs/reliability.md",
        {
            "status results/first-look": "the cases of a study",
            "status results/erosion": "the cases of an experiment",
        },
    ),
    "report": Shown(
        "docs/commands.md",
        {
            "report results/first-look": "draw its page again",
            "report results/paper --all": "draw the folded figures too",
        },
    ),
    "gallery": Shown(
        "docs/commands.md",
        {
            "gallery results": "one page over all studies in results",
            "gallery /data/studies": "the same for another directory",
        },
    ),
    "prune": Shown(
        "docs/reliability.md",
        {
            "prune results/first-look": "drop the large files of one study",
            "prune results/erosion": "those of an experiment",
        },
    ),
    "ladder": Shown(
        "docs/ladder.md",
        {
            "ladder --plan": "list what the preset would run; it takes hours",
            "ladder dune.toml --out results/mine": "measure on scenes of your own",
        },
    ),
    "budget": Shown(
        "docs/budget.md",
        {
            "budget --plan": "list what the preset would run",
            "budget sand.toml": "the effect of each assumption on your own study",
        },
    ),
    "stability": Shown(
        "docs/stability.md",
        {
            "stability --plan": "list what would run",
            "stability --workers 1": "run one case at a time",
        },
    ),
    "validate": Shown(
        "docs/validation.md",
        {
            "validate --plan": "list what would run",
            "validate": "compare every model with every measurement",
        },
    ),
    "erosion": Shown(
        "docs/stockpile.md",
        {
            "erosion": "run the preset stockpile",
            "erosion heap.toml --plan": "list what your own file would run",
        },
    ),
    "doctor": Shown(
        "docs/troubleshooting.md",
        {
            "doctor": "check the programs that are installed",
            "doctor > doctor.txt": "keep the answer, to enclose with a question",
        },
    ),
    "benchmark": Shown(
        "docs/benchmark.md",
        {
            "benchmark export pack": "write the scenes that are formulas",
            "benchmark run pack --solver './mine {case} {out}'": "judge a solver",
        },
    ),
    "benchmark export": Shown(
        "docs/benchmark.md",
        {
            "benchmark export pack": "write the scenes that are formulas",
            "benchmark export pack --from results/first-look": "those of a study too",
        },
    ),
    "benchmark run": Shown(
        "docs/benchmark.md",
        {
            "benchmark run pack --solver './mine {case} {out}'": "run every scene",
            "benchmark run pack --level 1 --solver './mine {case} {out}'": "one level",
        },
    ),
    "benchmark compare": Shown(
        "docs/benchmark.md",
        {
            "benchmark compare pack results/benchmark-mine": "judge answers again",
            "benchmark compare pack mine theirs": "two solvers side by side",
        },
    ),
}
"""By the words of the command."""


def shown(command: str) -> str:
    """Write the examples and the page of a command.

    Parameters
    ----------
    command
        The words of the command.

    Returns
    -------
    str
        Lines for the end of its `--help`.
    """
    page, examples = SHOWN[command]
    lines = ["examples:"]
    for line, meaning in examples.items():
        lines += [f"  orchestrator {line}", f"      {meaning}"]
    return "\n".join([*lines, "", f"explained in {page}"])
