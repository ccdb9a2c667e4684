"""How many processors a process may use, which can be fewer than the machine has.

A batch system, a container or ``taskset`` may allot it a part of them. More solvers
than that would wait for each other.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

JOBS = (
    ("", ("SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE")),
    ("PBS_JOBID", ("NCPUS", "PBS_NUM_PPN")),
    ("JOB_ID", ("NSLOTS",)),
    ("LSB_JOBID", ("LSB_DJOB_NUMPROC",)),
)
"""For each batch system a variable that only its jobs have, and those of a job's
processors, the narrowest first: Slurm, PBS, Grid Engine, LSF."""
V1 = ("cpu,cpuacct", "cpu")
"""Names that the controller of times is mounted under, in the first version of control
groups."""


def usable_count(root: Path = Path("/")) -> int:
    """Count the processors that this process may use.

    Parameters
    ----------
    root
        Where ``proc`` and ``sys`` are mounted.

    Returns
    -------
    int
        The least of what the machine, the affinity of the process, the quota of its
        control groups and its job of a batch system allow; at least 1.
    """
    allowed = [_by_affinity(), *_by_groups(root), *_by_job(os.environ)]
    return max(1, min(allowed))


def _by_affinity() -> int:
    """Processors that the process is bound to; where no system says so, all."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _by_job(environment: Mapping[str, str]) -> Iterator[int]:
    """What the job of each batch system has on this machine, if there is one."""
    for of_job, names in JOBS:
        if of_job and of_job not in environment:
            continue
        counts = [environment.get(name, "") for name in names]
        numbers = [int(text) for text in counts if text.isdecimal()]
        yield from numbers[:1]


def _by_groups(root: Path) -> Iterator[int]:
    """The quota of each control group that the process is in, in whole processors."""
    try:
        groups = (root / "proc/self/cgroup").read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError):
        return
    mounted = root / "sys/fs/cgroup"
    for line in groups:
        _, controllers, path = line.split(":", 2)
        if not controllers:
            for folder in _upward(mounted, path):
                yield from _quota(_words(folder / "cpu.max"))
        elif "cpu" in controllers.split(","):
            for name in V1:
                for folder in _upward(mounted / name, path):
                    quota = _words(folder / "cpu.cfs_quota_us")
                    yield from _quota([*quota, *_words(folder / "cpu.cfs_period_us")])


def _upward(mounted: Path, path: str) -> Iterator[Path]:
    """The folders of a group and of those that it is in.

    In a container the path is often that of the machine, and the group itself is what
    is mounted.
    """
    folder = mounted / path.lstrip("/")
    yield folder
    yield from (one for one in folder.parents if one.is_relative_to(mounted))


def _words(path: Path) -> list[str]:
    """The words of a file; none if it is not there."""
    with suppress(OSError, UnicodeDecodeError):
        return path.read_text(encoding="ascii").split()
    return []


def _quota(words: list[str]) -> Iterator[int]:
    """Processors of a time and of its period; "max" and -1 are no limit."""
    if len(words) == 2 and all(word.isdecimal() for word in words) and int(words[1]):
        yield int(words[0]) // int(words[1])
