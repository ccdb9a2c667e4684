"""Make a finished study small: drop the files that fill the disk and that no table is made of."""

from collections.abc import Container, Mapping
from dataclasses import dataclass

from orchestrator.runs import case, status
from orchestrator.runs.case import Case
from orchestrator.runs.status import size_text, sizes
from orchestrator.runs.workspace import Workspace


@dataclass(frozen=True)
class Pruned:
    """Sizes of a study before and after.

    Attributes
    ----------
    before, after : mapping of str to int
        Bytes on disk, as in `orchestrator.runs.status.Status`.
    cases : int
        How many cases are pruned now.
    kept : tuple of str
        Finished cases left whole: the page's pictures are drawn from them.
    left : mapping of str to int
        Cases that the study does not ask for, which are not touched, and their bytes.
    """

    before: Mapping[str, int]
    after: Mapping[str, int]
    cases: int
    kept: tuple[str, ...]
    left: Mapping[str, int]


def prune(space: Workspace, done: Mapping[str, Case], shown: Container[str]) -> Pruned:
    """Drop the bulky files of finished cases, but for those that a page shows.

    What tables and page are made of stays, and so do the inputs: ``./Allrun`` in a case makes
    what was dropped anew, and compares it with the digests of the first run.

    Parameters
    ----------
    space : Workspace
        Workspace of the study; held.
    done : mapping of str to Case
        The finished cases by name.
    shown : container of str
        Names of those that the page's pictures are drawn from.
    """
    before = sizes(space)
    kept = tuple(name for name in done if name in shown)
    for name, one in done.items():
        if name not in shown:
            case.prune(one, space.cases)
    left = status.read(space.root).left
    return Pruned(before, sizes(space), len(done) - len(kept), kept, left)


def text(pruned: Pruned) -> str:
    """Summary for people."""
    lines = [
        f"before: {size_text(pruned.before)}",
        f"after:  {size_text(pruned.after)}",
        f"pruned: {pruned.cases} cases; ./Allrun in one of them makes its files anew",
    ]
    if pruned.kept:
        lines.append(f"whole, for the pictures of the page: {', '.join(pruned.kept)}")
    if pruned.left:
        lines.append(status.left_text(pruned.left))
    return "\n".join(lines)
