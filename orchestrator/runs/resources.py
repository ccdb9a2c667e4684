"""The limits that a shell sets on this process, and the least that a study needs of them."""

import resource
from collections.abc import Iterator

from orchestrator.errors import OrchestratorError

LEAST = {
    "open files": (resource.RLIMIT_NOFILE, 64, "ulimit -n", 1),
    "memory": (resource.RLIMIT_AS, 2_000_000, "ulimit -v", 1024),
}
"""The limit, its least value, the command that sets it, and the size of its unit. A small study on
two cores took 40 files; and 1.9e6 kB of addresses, of which it used a tenth."""


def check() -> None:
    """See that a study can run within the limits; libraries end in crashes where it cannot.

    Raises
    ------
    OrchestratorError
        Naming the first that is too low, and the command that raises it.
    """
    for what in shortages():
        raise what


def shortages() -> Iterator[OrchestratorError]:
    """Each limit that is too low."""
    for what, (number, least, command, unit) in LEAST.items():
        soft, _ = resource.getrlimit(number)
        if soft != resource.RLIM_INFINITY and soft < least * unit:
            yield OrchestratorError(
                f"the limit of {what} is {soft // unit}, less than a study needs",
                remedy=f"{command} {least}, or more",
            )
