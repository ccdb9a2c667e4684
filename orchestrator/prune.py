"""Make a finished study small: what fills the disk and what no table is made of goes."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from orchestrator import pipeline, report, tables
from orchestrator.runs import case
from orchestrator.runs.status import size_text, sizes
from orchestrator.runs.workspace import Workspace


@dataclass(frozen=True)
class Pruned:
    """What a study was and is.

    Attributes
    ----------
    before, after : mapping of str to int
        Bytes on disk, as in `orchestrator.runs.status.Status`.
    cases : int
        How many cases are pruned now.
    kept : tuple of str
        Finished cases left whole: the page's pictures are drawn from them.
    """

    before: Mapping[str, int]
    after: Mapping[str, int]
    cases: int
    kept: tuple[str, ...]


def prune(directory: Path) -> Pruned:
    """Drop the bulky files of a study's finished cases, but for those that its page shows.

    What tables and page are made of stays, and so do the inputs: ``./Allrun`` in a case makes
    what was dropped anew, and compares it with the digests of the first run.

    Raises
    ------
    InputError
        If the directory holds no study.
    OrchestratorError
        If it is being run.
    """
    space = Workspace(directory.absolute())
    study, planned = pipeline.reopen(space)
    with space.held():
        done, before = planned.done(space.cases), sizes(space)
        made = tables.make(study, planned, space.cases, done)
        shown = {one.name for one in report.drawn_from(study, planned, made, space.cases)}
        for name in done.keys() - shown:
            case.prune(planned.cases[name], space.cases)
        kept = tuple(name for name in done if name in shown)
        return Pruned(before, sizes(space), len(done) - len(kept), kept)


def text(pruned: Pruned) -> str:
    """What was done, for people."""
    lines = [
        f"before: {size_text(pruned.before)}",
        f"after:  {size_text(pruned.after)}",
        f"pruned: {pruned.cases} cases; ./Allrun in one of them makes its files anew",
    ]
    if pruned.kept:
        lines.append(f"whole, for the pictures of the page: {', '.join(pruned.kept)}")
    return "\n".join(lines)
