"""LIGGGHTS: which version is here, and what the end of a run means."""

import re
from functools import cache
from pathlib import Path

from orchestrator import solvers
from orchestrator.errors import SolverError

PROGRAM = "liggghts"
TRIED = "3.8"
"""Version that the tests ran with."""
INSTALL = "install it: apt-get install --no-install-recommends liggghts"
ENVIRONMENT = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "OMPI_MCA_pml": "ob1",
}
"""Variables with which one process needs no MPI daemon.

Without the first a run starts one, and waits 5 s for the name of a machine that
resolves nowhere; without the last it looks for fast networks for 0.2 s. Without the
second all such processes of a user share a directory, which one may remove while
another starts: of 2000 short runs, four at a time, 16 failed.
"""
MANY = 10_000
"""Grains from which on two processes share them: 29,000 are poured in half the time."""
LAST_WORDS = "the protocol has ended"
"""What each deck prints last."""
_STATED = r"LIGGGHTS-\w+ (\d+\.\d+\.\d+)"
_ERROR = r"\n(ERROR(?!: ld\.so:).*)"
"""Pattern of an error in a log.

Its message follows a banner of MPI; the deck's own words hold no such line, and the
linker's are of libraries that were asked for in vain.
"""


@cache
def version() -> str:
    """Ask LIGGGHTS for its version.

    Returns
    -------
    str
        Version of the LIGGGHTS on the path, such as ``3.8.0``.

    Raises
    ------
    SolverError
        If none works.
    """
    return solvers.version(
        "LIGGGHTS",
        # without -log it leaves a log wherever the user happens to be
        f"{PROGRAM} -h -log none",
        _STATED,
        tried=TRIED,
        env=ENVIRONMENT,
        remedy=INSTALL,
    )


def ranks(grains: float) -> int:
    """Choose how many processes share the grains of a deck.

    The number of grains alone decides, whatever the machine has: other processes sum in
    another order, and a bed of many grains is then another one.

    Parameters
    ----------
    grains
        Number of grains.

    Returns
    -------
    int
        Number of processes.

    Examples
    --------
    >>> ranks(9_999), ranks(10_000)
    (1, 2)
    """
    return 2 if grains >= MANY else 1


def programs(ranks: int) -> dict[str, str]:
    """List the programs that run a deck.

    Parameters
    ----------
    ranks
        Number of processes that share the grains.

    Returns
    -------
    dict
        Versions by name.

    Raises
    ------
    SolverError
        If a program is missing.
    """
    if ranks > 1:
        solvers.find("mpirun", "install it: apt-get install openmpi-bin")
    return {PROGRAM: version()}


def check_log(directory: Path) -> None:
    """Check that a run came to its own end: LIGGGHTS ends with 0 in any case.

    Parameters
    ----------
    directory
        Directory of the case, which holds ``log.liggghts``.

    Raises
    ------
    SolverError
        If the run stopped by an error, or its log lacks the deck's last words.
    """
    log = directory / "log.liggghts"
    text = log.read_text(errors="replace") if log.is_file() else ""
    error = re.search(_ERROR, text)
    if error is not None:
        what = f"LIGGGHTS stopped: {error[1]}"
        raise SolverError(what, where=str(log), remedy="see the log")
    if LAST_WORDS not in text:
        what = "LIGGGHTS ended before its protocol did"
        remedy = "it was killed, or the disk is full; run the same command again"
        raise SolverError(what, where=str(log), remedy=remedy)
