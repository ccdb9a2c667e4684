"""Run a program that nobody vouches for: limited, ended whole, and blind to what it may not see."""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from orchestrator.runs import keeper, process

GIB = 2**30
_WALLS = (
    *("unshare", "--user", "--map-current-user", "--keep-caps", "--mount", "--ipc"),
    *("--pid", "--fork", "--kill-child", "--mount-proc", "--"),
)
"""Namespaces: of processes, which end with the first of them, and of what is mounted."""
_POWERLESS = (
    *("setpriv", "--no-new-privs", "--bounding-set=-all", "--inh-caps=-all"),
    *("--ambient-caps=-all", "--"),
)
"""Rights to mount could show a hidden directory again: the program itself has none of them."""


@dataclass(frozen=True)
class Limits:
    """Limits of a program.

    Attributes
    ----------
    seconds : float
        Wall time, s.
    memory : int
        All its processes together, bytes.
    disk : int
        Files of its working directory together, and any single file, bytes.
    printed : int
        Its log, bytes.
    processes : int
        At once.
    """

    seconds: float = 600.0
    memory: int = 4 * GIB
    disk: int = 4 * GIB
    printed: int = GIB // 16
    processes: int = 256


@dataclass(frozen=True)
class Used:
    """How a program ended, and what it took.

    Attributes
    ----------
    returncode : int or None
        None where it had to be ended.
    broken : str
        The limit that it broke, as a sentence, or nothing.
    seconds, cpu_s : float
        Wall and CPU time, s.
    peak_mib : float
        Memory of its largest process.
    said : str
        The end of what it printed.
    """

    returncode: int | None
    broken: str
    seconds: float
    cpu_s: float = float("nan")
    peak_mib: float = float("nan")
    said: str = ""


def run(
    command: Sequence[str], *, cwd: Path, log: Path, limits: Limits, hide: Iterable[Path] = ()
) -> Used:
    """Run a program to the end of all its processes.

    Parameters
    ----------
    command : sequence of str
        The program and its arguments; no shell reads them.
    cwd, log : Path
        Working directory, with room for all that it writes; file that takes what it prints.
    limits : Limits
        What it may take.
    hide : iterable of Path
        Directories that are empty for it, as far as `hides` says so.
    """
    return _run(command, cwd, log, limits, [str(path) for path in hide], walled=hides())


@cache
def hides() -> bool:
    """Whether this system lets a program run without sight of some directories: it is tried."""
    if not all(map(shutil.which, ("unshare", "setpriv"))):
        return False
    with tempfile.TemporaryDirectory() as folder:
        cwd, secret = Path(folder), Path(folder) / "hidden" / "secret"
        secret.parent.mkdir()
        secret.touch()
        seen = ["test", "!", "-e", str(secret)]
        used = _run(seen, cwd, cwd / "log", Limits(), [str(secret.parent)], walled=True)
    return used.returncode == 0


def _run(
    command: Sequence[str], cwd: Path, log: Path, limits: Limits, hide: list[str], *, walled: bool
) -> Used:
    # opened first: the program may put something else in the log's place
    with tempfile.TemporaryFile() as report, log.open("wb+") as printed:
        order = {**asdict(limits), "report": report.fileno(), "hide": hide if walled else []}
        start = [sys.executable, "-I", "-S", keeper.__file__, json.dumps(order)]
        ended = process.run(
            [*(_WALLS if walled else ()), *start, *(_POWERLESS if walled else ()), *command],
            cwd=cwd,
            log=log,
            limit_s=limits.seconds,
            env={"TMPDIR": str(cwd), "OLDPWD": str(cwd)},
            fds=[report.fileno()],
        )
        report.seek(0)
        told = report.read()
        said = process.last_words(log)
        if os.fstat(printed.fileno()).st_size > limits.printed:
            printed.truncate(limits.printed)
    if told and ended.over != "time":
        return Used(**json.loads(told), said=said)
    late = f"it did not end within {limits.seconds:g} s and was killed"
    why = late if ended.over == "time" else f"it could not be watched: {said}"
    return Used(None, why, ended.seconds, said=said)
