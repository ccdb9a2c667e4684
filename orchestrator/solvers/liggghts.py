"""LIGGGHTS: its version, the end of a run, and the files of its decks.

It is the `orchestrator.solvers.dem.Engine` of the package.
"""

import re
from collections.abc import Mapping
from functools import cache
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from orchestrator import digits, solvers
from orchestrator.errors import SolverError
from orchestrator.types import FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

PROGRAM = "liggghts"
TEMPLATES = "liggghts"
"""Folder of its templates."""
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


def command(deck: str, variables: Mapping[str, float]) -> list[str]:
    """Make the command that runs one deck, with its words as they come.

    Parameters
    ----------
    deck
        The file of the deck.
    variables
        Numbers that it is given.

    Returns
    -------
    list of str
        Program and arguments.
    """
    words = ["stdbuf", "-o0", PROGRAM, "-in", deck, "-nocite", "-log", "none"]
    for name, value in variables.items():
        words += ["-var", name, repr(value)]
    return words


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
        solvers.find_program("mpirun", "install it: apt-get install openmpi-bin")
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


def write_parameters(
    directory: Path,
    values: Mapping[str, float | int | tuple[float, ...]],
    meaning: Mapping[str, str],
) -> None:
    """Write ``parameters.liggghts``.

    Parameters
    ----------
    directory
        The directory of the deck.
    values
        A number for each variable, a tuple for each index.
    meaning
        What each of them is, in words.
    """
    lines = []
    for name, value in values.items():
        if isinstance(value, tuple):
            text = f"index {' '.join(map(digits.text, value))}"
        elif isinstance(value, int):
            text = f"equal {value}"
        else:
            text = f"equal {digits.text(value)}"
        lines.append(f"variable        {name} {text}  # {meaning[name]}\n")
    (directory / "parameters.liggghts").write_text("".join(lines))


def write_numbers(path: Path, values: FloatArray) -> None:
    """Write numbers, one a line.

    Parameters
    ----------
    path
        The file.
    values
        The numbers.
    """
    path.write_text("".join(f"{digits.text(each)}\n" for each in values.tolist()))


def write_sets(path: Path, grains: IntArray, sets: FloatArray) -> None:
    """Write values of grains as LIGGGHTS reads them: a count, then ids and values.

    Parameters
    ----------
    path
        The file.
    grains
        Numbers of n grains, from 0.
    sets
        Their values at each of s load steps, shape (s, n).
    """
    rows = "".join(f"{number} {digits.FORMAT}\n" for number in (grains + 1).tolist())
    with path.open("w") as stream:
        for values in sets.tolist():
            stream.write(f"{len(values)}\n{rows}" % tuple(values))


def write_grains(
    directory: Path,
    position: FloatArray,
    kind: IntArray,
    diameters: FloatArray,
    density: float,
    bounds: FloatArray,
    order: IntArray,
) -> None:
    """Write ``grains.data``, in SI units with nine digits.

    Parameters
    ----------
    directory
        The directory of the deck.
    position
        Centres, m, shape (n, 3).
    kind
        Grain types, shape (n,).
    diameters
        Diameters, m, shape (n,).
    density
        Density of every grain, kg/m3.
    bounds
        Lower and upper ends of the box, m, shape (2, 3): so far from the grains that
        rounding loses none.
    order
        Numbers of the grains that are written, in their order.
    """
    row = "%d %d" + 5 * f" {digits.FORMAT}" + "\n"
    numbers = order.tolist()
    kinds = kind[order].tolist()
    sizes = diameters[order].tolist()
    centres = position[order].tolist()
    rows = []
    for number, of_kind, size, centre in zip(
        numbers, kinds, sizes, centres, strict=True
    ):
        rows.append(row % (number + 1, of_kind, size, density, *centre))
    box = []
    for axis, low, high in zip("xyz", *bounds.tolist(), strict=True):
        box.append(f"{digits.text(low)} {digits.text(high)} {axis}lo {axis}hi\n")
    head = "grains: id type diameter density x y z\n\n"
    counts = f"{len(order)} atoms\n4 atom types\n\n"
    text = f"{head}{counts}{''.join(box)}\nAtoms\n\n{''.join(rows)}"
    (directory / "grains.data").write_text(text)


def read_frames(
    path: Path, columns: tuple[str, ...]
) -> tuple[IntArray, "pd.DataFrame"]:
    """Read a text dump: a frame for each time step that was listed.

    Parameters
    ----------
    path
        The file.
    columns
        Names of its columns.

    Returns
    -------
    steps
        The time step of each frame, also of one without a grain.
    rows
        A row for each grain of each frame, with its time step in ``step``.

    Raises
    ------
    SolverError
        If the file is missing, cut short or not a dump of these columns.
    """
    # `doctor` names a pandas that does not load
    import pandas as pd

    try:
        text = path.read_text(encoding="ascii")
        frames = [frame.split("\n", 8) for frame in text.split("ITEM: TIMESTEP\n")[1:]]
        steps = np.array([int(frame[0]) for frame in frames])
        counts = np.array([int(frame[2]) for frame in frames])
        body = StringIO("".join(frame[8] for frame in frames))
        names = list(columns)
        rows = pd.read_csv(body, sep=r"\s+", names=names, header=None, low_memory=False)
        is_whole = text.endswith("\n") and len(rows) == counts.sum()
        if not is_whole or rows.isna().any(axis=None):
            raise ValueError("it is cut short or has NaN")
    except (OSError, ValueError, IndexError) as error:
        what = f"the dump cannot be read: {error}"
        raise SolverError(what, where=str(path), remedy="run the case again") from None
    return steps, rows.assign(step=np.repeat(steps, counts))
