"""The queues of clusters, and what their jobs ask for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

SYSTEMS = {
    "htcondor": "HTCondorCluster",
    "lsf": "LSFCluster",
    "moab": "MoabCluster",
    "oar": "OARCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "slurm": "SLURMCluster",
}
"""Names of the queues, and dask-jobqueue's classes for them."""

REASONS = {
    "slurm": ("squeue", "--me", "--noheader", "--format=%i %T, %r"),
}
"""Commands of a queue that print a line for each job: its number, and why it waits."""


@dataclass(frozen=True)
class Queue:
    """A queue, and what its jobs ask for.

    Attributes
    ----------
    system
        One of `SYSTEMS`.
    settings
        The table ``[cluster]`` of the study file: arguments of dask-jobqueue's class.
    """

    system: str
    settings: Mapping[str, Any] = field(default_factory=dict)
