"""How far a study came, read from its directory alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.errors import printable
from orchestrator.runs.case import DONE, failure, names_in, size
from orchestrator.runs.files import read_json, size_of
from orchestrator.runs.workspace import Workspace

NAMED = 5
"""Most cases that are listed by name where an earlier study file asked for them."""


@dataclass(frozen=True)
class Status:
    """The cases of a study by how far they came.

    Attributes
    ----------
    name : str
        The study's name.
    running : bool
        Whether a process holds the study.
    done, unfinished, waiting : tuple of str
        Names of cases: finished; begun; not begun.
    failed : dict of str to str
        Cases that failed, with the cause.
    page : Path or None
        The page, once it is drawn.
    sizes : dict of str to int
        Bytes on disk by what they belong to: a kind of case, or tables, figures and page.
    left : dict of str to int
        Cases that an earlier study file asked for and this one does not, and their bytes.
    """

    name: str
    running: bool
    done: tuple[str, ...]
    unfinished: tuple[str, ...]
    waiting: tuple[str, ...]
    failed: dict[str, str]
    page: Path | None
    sizes: dict[str, int]
    left: dict[str, int]


def read(directory: Path) -> Status:
    """Read how far a study came.

    Raises
    ------
    InputError
        If the directory holds no study.
    """
    space = Workspace(directory.absolute())
    about = space.description()
    markers = _markers(space)
    states = {name: _state(space.cases / name, markers) for name in map(str, about["cases"])}
    return Status(
        name=str(about["name"]),
        running=space.is_held(),
        done=_with(states, "done"),
        unfinished=_with(states, "unfinished"),
        waiting=_with(states, "waiting"),
        failed={name: failure(space.cases / name) or "" for name in _with(states, "failed")},
        page=space.page if space.drawn.is_file() and space.page.is_file() else None,
        sizes=_sizes(space, markers),
        left={name: size(space.cases / name, markers[name]) for name in space.left(states)},
    )


def sizes(space: Workspace) -> dict[str, int]:
    """Bytes on disk, by the kind of case, and of tables, figures and page together.

    Those of a finished case are of the time when it ended, or was pruned.
    """
    return _sizes(space, _markers(space))


Markers = dict[str, dict[str, Any]]
"""Contents of the markers of all directories of cases, by name; empty for a case not done."""


def _markers(space: Workspace) -> Markers:
    states = ((name, read_json(space.cases / name / DONE)) for name in names_in(space.cases))
    return {name: state if isinstance(state, dict) else {} for name, state in states}


def _sizes(space: Workspace, markers: Markers) -> dict[str, int]:
    found: dict[str, int] = {}
    for name, state in markers.items():
        kind = f"{name.partition('-')[0]} cases"
        found[kind] = found.get(kind, 0) + size(space.cases / name, state)
    beside = (path for path in space.root.iterdir() if path != space.cases)
    found["tables, figures and page"] = sum(map(size_of, beside))
    return found


def _with(states: dict[str, str], wanted: str) -> tuple[str, ...]:
    return tuple(name for name, state in states.items() if state == wanted)


def _state(directory: Path, markers: Markers) -> str:
    if directory.name not in markers:
        return "waiting"
    if markers[directory.name]:
        return "done"
    return "unfinished" if failure(directory) is None else "failed"


def text(status: Status) -> str:
    """The status for people."""
    counts = {
        "done": len(status.done),
        "running" if status.running else "unfinished": len(status.unfinished),
        "not begun": len(status.waiting),
        "failed": len(status.failed),
    }
    numbers = ", ".join(f"{count} {word}" for word, count in counts.items())
    lines = [f"study {status.name}: {numbers}"]
    begun = "running" if status.running else "unfinished"
    lines += [f"  {begun}: {name}" for name in status.unfinished]
    lines += [f"  failed: {name}: {cause}" for name, cause in status.failed.items()]
    lines.append(f"size: {size_text(status.sizes)}")
    if status.left:
        lines.append(left_text(status.left))
    if status.page:
        lines.append(f"page: {status.page}")
    elif not status.running:
        lines.append("the same study command continues it")
    return "\n".join(map(printable, lines))  # a study's name may come from anywhere


def left_text(left: Mapping[str, int]) -> str:
    """The cases that are not asked for, for people, with their size."""
    named = ", ".join(list(left)[:NAMED]) + (", ..." if len(left) > NAMED else "")
    what = f"{len(left)} cases of an earlier study file, {_human(sum(left.values()))}: {named}"
    return f"not asked for: {what}; they stay until you remove them"


def size_text(sizes: Mapping[str, int]) -> str:
    """Sizes for people: the total, then its parts, the largest first."""
    parts = sorted(sizes.items(), key=lambda item: -item[1])
    named = ", ".join(f"{_human(size)} {name}" for name, size in parts if size)
    return f"{_human(sum(sizes.values()))} ({named})"


def _human(size: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} GB"
