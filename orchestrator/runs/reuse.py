"""Finished cases under other code: read again, run again, or as they are.

A case has inputs, results that the solver made of them, and tables that a reader made
of the results. Its marker names the code by which all three belong together. Under
other code the inputs are written anew beside the case. If they are those that the
solver had, the results stand, and only the tables are made again. Else the case is
outdated, and the solver has to run.
"""

import contextlib
import shutil
import sys
import tempfile
import warnings
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator.digits import number
from orchestrator.errors import OrchestratorError
from orchestrator.runs import processors
from orchestrator.runs.case import (
    CODE,
    IDENTITY,
    Case,
    code_of,
    done_state,
    has_results,
    inputs_written,
    is_whole,
    note_tables,
    run_of,
)
from orchestrator.runs.files import Folder, read_json


def done(
    cases: Mapping[str, Case], directory: Path, *, holds: bool = True
) -> dict[str, dict[str, Any]]:
    """Find the cases that are done, and read those again that other code has read.

    Parameters
    ----------
    cases
        The cases by their names, each behind those that it needs.
    directory
        The directory of the cases.
    holds
        Whether the caller holds the directory. Else nothing is written, and a case that
        would be read again counts as done.

    Returns
    -------
    dict of str to dict
        Their markers, by name. A case is not done if one that it needs is outdated.
    """
    with ThreadPoolExecutor(processors.usable_count()) as pool:
        # gigabytes of results are read
        found = [*pool.map(partial(_look, directory=directory), cases.values())]
    states: dict[str, dict[str, Any]] = {}
    outdated: dict[str, Case] = {}
    again = 0
    for case, (state, is_current) in zip(cases.values(), found, strict=True):
        if state is None:
            continue
        if any(need.name in outdated for need in case.needs):
            outdated[case.name] = case
            continue
        if not is_current:
            state = _read_again(case, directory, state, holds=holds)
            again += state is not None
        if state is None:
            outdated[case.name] = case
        else:
            states[case.name] = state
    if again and holds:
        what = f"{number(again, 'case')} read again by the present code"
        print(f"{what}; no solver was started for them", file=sys.stderr)
    if outdated:
        warnings.warn(_said_of(outdated.values(), directory), stacklevel=2)
    return states


def _look(case: Case, directory: Path) -> tuple[dict[str, Any] | None, bool]:
    """The marker of a case whose solver has ended, and whether it is as made now."""
    state = done_state(case, directory)
    if state is not None:
        return state, True
    return run_of(directory / case.name, case.id), False


def _read_again(
    case: Case, directory: Path, state: Mapping[str, Any], *, holds: bool
) -> dict[str, Any] | None:
    """The marker of a case after its tables were made again; None if it is outdated."""
    place = directory / case.name
    if not has_results(state, place):
        return None
    try:
        is_other_code = state.get(CODE) != code_of(type(case))
        if is_other_code and not _has_inputs_of_now(case, directory):
            return None
        if not holds:
            return dict(state)
        # a process that ends in here leaves the results, and a marker of other tables
        case.collect(place)
        return note_tables(case, place, state)
    except (OSError, ValueError, OrchestratorError):
        # the solver's next run says what is wrong, if anything is
        return None


def _has_inputs_of_now(case: Case, directory: Path) -> bool:
    """Whether the inputs of a case are those that the present code writes."""
    with tempfile.TemporaryDirectory() as beside:
        folder = Path(beside, case.name)
        folder.mkdir()
        inputs = inputs_written(case, folder, directory)
    about = read_json(directory / case.name / IDENTITY)
    return bool(inputs == about.get("inputs_sha256"))


def _said_of(outdated: Collection[Case], directory: Path) -> str:
    """Say why cases whose solver has ended do not count as done."""
    pruned = sum(not is_whole(case, directory) for case in outdated)
    what = f"{number(len(outdated), 'case')} made by other code of this program"
    if pruned < len(outdated):
        what += ", which now makes other inputs"
    if pruned:
        what += f"; {pruned} of them were pruned and cannot be read again"
    return what


def elsewhere(
    cases: Mapping[str, Case], here: Path, beside: Sequence[Path]
) -> dict[str, Path]:
    """Find cases that are done in other directories of results and not in one.

    Parameters
    ----------
    cases
        The cases by their names.
    here
        The directory of cases in which they are wanted.
    beside
        Other directories of results.

    Returns
    -------
    dict of str to Path
        The directory of cases in which each was found first, by its name.
    """
    found = {}
    for name, case in cases.items():
        if not beside or run_of(here / name, case.id):
            continue
        for root in beside:
            if run_of(root / here.name / name, case.id):
                found[name] = root / here.name
                break
    return found


def taken(cases: Mapping[str, Case], here: Path, beside: Sequence[Path]) -> int:
    """Copy cases that are done in other directories of results.

    What is copied is checked as all finished cases are. Bulky files stay behind, as if
    they were pruned, unless the case has to be read again.

    Parameters
    ----------
    cases
        The cases by their names.
    here
        The directory of cases in which they are wanted, whose holder calls this.
    beside
        Other directories of results.

    Returns
    -------
    int
        How many were copied.
    """
    count = 0
    for name, source in elsewhere(cases, here, beside).items():
        bulky: Collection[str] = ()
        state = done_state(cases[name], source)
        if state is not None:
            bulky = state["bulky"]
        place = Folder(here.parent).clear(f"{here.name}/{name}")
        # whatever cannot be copied is run
        with contextlib.suppress(OSError):
            here.mkdir(parents=True, exist_ok=True)
            _copy(source / name, place, bulky)
        count += run_of(place, cases[name].id) is not None
    return count


def _copy(source: Path, place: Path, but: Collection[str]) -> None:
    """Copy a directory without some files, with its times; links stay links."""

    def left(folder: str, names: list[str]) -> list[str]:
        inside = Path(folder).relative_to(source)
        return [name for name in names if (inside / name).as_posix() in but]

    shutil.copytree(source, place, symlinks=True, ignore=left)
