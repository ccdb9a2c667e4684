"""LIGGGHTS: which version is here, and what the end of a run means."""

import re
import warnings
from functools import cache
from pathlib import Path

from orchestrator.errors import SolverError
from orchestrator.solvers.programs import ask, find

PROGRAM = "liggghts"
TRIED = (3, 8)
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
MANY = 10_000
"""Grains from which on two processes share them: 29,000 of them are poured in half the time."""
LAST_WORDS = "the protocol has ended"


@cache
def version() -> str:
    """Version of the LIGGGHTS on the path, such as ``3.8.0``.

    Raises
    ------
    SolverError
        If it is missing, does not say its version, or is older than any that works.
    """
    path = find(PROGRAM, remedy=INSTALL)
    # without the option it leaves a log wherever the user happens to be
    reply = ask(path, "-h", "-log", "none", env=ENVIRONMENT)
    match = re.search(r"LIGGGHTS-\w+ (\d+)\.(\d+)\.(\d+)", reply.text)
    if not match:
        what = f"{path} does not say that it is a LIGGGHTS: {reply.gist}"
        raise SolverError(what, remedy=f"try `{path} -h` by hand; if it is broken, install it anew")
    what = f"{path} is version {match[1]}.{match[2]}"
    number = (int(match[1]), int(match[2]))
    if number < TRIED:
        raise SolverError(f"{what}, older than the decks need", remedy="install LIGGGHTS 3.8")
    if number > TRIED:
        warnings.warn(f"{what}; the decks were tried with 3.8", stacklevel=2)
    return ".".join(match.groups())


def ranks(grains: float) -> int:
    """Processes that share the grains of a deck: by their number, whatever the machine has.

    Other processes sum in another order, and a bed of many grains is then another one.
    """
    return 2 if grains >= MANY else 1


def programs(ranks: int) -> dict[str, str]:
    """The programs that run a deck with so many processes, with versions; else SolverError."""
    if ranks > 1:
        find("mpirun", remedy="install it: apt-get install openmpi-bin")
    return {PROGRAM: version()}


def check_log(directory: Path) -> None:
    """See that a run came to its own end, else SolverError: LIGGGHTS ends with 0 in any case."""
    log = directory / "log.liggghts"
    text = log.read_text(errors="replace") if log.is_file() else ""
    # the message of an error follows a banner of MPI; the deck's own words hold no such line, and
    # the linker's are of libraries that were asked for in vain
    error = re.search(r"^ERROR(?!: ld\.so:).*$", text, re.MULTILINE)
    if error:
        raise SolverError(f"LIGGGHTS stopped: {error[0]}", where=str(log), remedy="see the log")
    if LAST_WORDS not in text:
        what = "LIGGGHTS ended before its protocol did"
        remedy = "it was killed, or the disk is full; run the same command again"
        raise SolverError(what, where=str(log), remedy=remedy)
