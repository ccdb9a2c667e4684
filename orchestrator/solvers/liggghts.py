"""LIGGGHTS: which version is here, and what the end of a run means."""

import re
from functools import cache
from pathlib import Path

from orchestrator import solvers
from orchestrator.errors import SolverError

PROGRAM = "liggghts"
TRIED = "3.8"
INSTALL = "install it: apt-get install --no-install-recommends liggghts"
ENVIRONMENT = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "OMPI_MCA_pml": "ob1",
}
"""One process needs no MPI daemon: without the first a run starts one, and waits 5 s for the name
of a machine that resolves nowhere; without the last it looks for fast networks for 0.2 s. Without
the second all such processes of a user share a directory, which one may remove while another
starts: of 2000 short runs, four at a time, 16 failed."""
MANY = 10_000  # grains from which on two processes share them: 29,000 are poured in half the time
LAST_WORDS = "the protocol has ended"


@cache
def version() -> str:
    """Version of the LIGGGHTS on the path, such as ``3.8.0``; SolverError if none works."""
    # without -log it leaves a log wherever the user happens to be
    command, pattern = f"{PROGRAM} -h -log none", r"LIGGGHTS-\w+ (\d+\.\d+\.\d+)"
    return solvers.version(
        "LIGGGHTS", command, pattern, tried=TRIED, env=ENVIRONMENT, remedy=INSTALL
    )


def ranks(grains: float) -> int:
    """Processes that share the grains of a deck: by their number, whatever the machine has.

    Other processes sum in another order, and a bed of many grains is then another one.
    """
    return 2 if grains >= MANY else 1


def programs(ranks: int) -> dict[str, str]:
    """The programs that run a deck with so many processes, with versions; else SolverError."""
    if ranks > 1:
        solvers.find("mpirun", "install it: apt-get install openmpi-bin")
    return {PROGRAM: version()}


def check_log(directory: Path) -> None:
    """See that a run came to its own end, else SolverError: LIGGGHTS ends with 0 in any case."""
    log = directory / "log.liggghts"
    text = log.read_text(errors="replace") if log.is_file() else ""
    # the message of an error follows a banner of MPI; the deck's own words hold no such line, and
    # the linker's are of libraries that were asked for in vain
    if error := re.search(r"\n(ERROR(?!: ld\.so:).*)", text):
        raise SolverError(f"LIGGGHTS stopped: {error[1]}", where=str(log), remedy="see the log")
    if LAST_WORDS not in text:
        remedy = "it was killed, or the disk is full; run the same command again"
        raise SolverError("LIGGGHTS ended before its protocol did", str(log), remedy)
