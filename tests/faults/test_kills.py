"""Drivers, workers and solvers that are killed, at each stage of a study."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from orchestrator.runs import process
from tests.faults.bench import (
    Bench,
    case_of,
    ended,
    kill_program,
    none_left_in,
    pause,
    processes_in,
    same_tables,
    wait_for,
    wrapper,
)
from tests.faults.ledger import Ledger

Driver = subprocess.Popen[str]
Seen = Callable[[Path], bool]
SINCE = ".started"
"""A file in the study's parent: what is younger is of the driver that runs."""


def _young(out: Path, pattern: str) -> list[Path]:
    """Files of the driver that runs now, which are not empty."""
    since = (out.parent / SINCE).stat().st_mtime_ns
    found = []
    for path in out.glob(pattern):
        with contextlib.suppress(FileNotFoundError):
            state = path.stat()
            if state.st_mtime_ns > since and state.st_size:
                found.append(path)
    return found


def _collecting(out: Path) -> bool:
    logs = _young(out, "cases/pile-*/log.liggghts")
    return any(b"the protocol has ended" in log.read_bytes() for log in logs)


STAGES: dict[str, tuple[Seen, str]] = {
    "mesh": (lambda out: bool(_young(out, "cases/flow-*/parameters")), "cases/flow-*/case.json"),
    "flow": (
        lambda out: bool(_young(out, "cases/flow-*/log.simpleFoam")),
        "cases/flow-*/done.json",
    ),
    "grains": (
        lambda out: bool(_young(out, "cases/pile-*/log.liggghts")),
        "cases/pile-*/done.json",
    ),
    "collecting": (_collecting, "cases/pile-*/done.json"),
    "tables": (lambda out: bool(_young(out, "tables/*.csv")), "report.html"),
    "figures": (lambda out: bool(_young(out, "figures/*")), "report.html"),
}
"""For each: how it is seen, and what there is only after its end."""


def _stopped(pile: Bench, under: tuple[str, ...], seen: Seen, after: str) -> Driver:
    """A driver that is paused within a stage."""
    for _ in range(20):
        # a run that ended before its driver did has to be run again to be seen
        for path in pile.out.glob(after):
            path.unlink()
        (pile.folder / SINCE).touch()
        driver = pile.start(under=under)
        if wait_for(partial(seen, pile.out), driver):
            pause(driver)
            if not list(pile.out.glob(after)):
                return driver
            # it was faster than this test: once more
            driver.send_signal(signal.SIGCONT)
        code, said = ended(driver)
        assert code == 0, said
    raise AssertionError(f"no driver was met before {after}")


KILL, TERM, INT = signal.SIGKILL, signal.SIGTERM, signal.SIGINT
HUP, QUIT, XCPU = signal.SIGHUP, signal.SIGQUIT, signal.SIGXCPU
USR1, USR2 = signal.SIGUSR1, signal.SIGUSR2
NOHUP = ("nohup",)


@pytest.mark.parametrize(
    ("numbers", "under"),
    [
        ([KILL], ()),
        ([INT, TERM, HUP, QUIT, USR1, USR2], ()),
        ([TERM, INT, XCPU], NOHUP),
    ],
)
def test_a_driver_that_is_ended_at_each_stage_in_turn(
    pile: Bench, ledger: Ledger, numbers: list[signal.Signals], under: tuple[str, ...]
) -> None:
    with contextlib.ExitStack() as faults:
        stages = zip(itertools.cycle(numbers), STAGES.items(), strict=False)
        for number, (stage, (seen, after)) in stages:
            name = " ".join([number.name, "to the driver", *(f"under {word}" for word in under)])
            faults.enter_context(ledger.fault(name, stage))
            driver = _stopped(pile, under, seen, after)
            driver.send_signal(number)
            driver.send_signal(signal.SIGCONT)
            code, said = ended(driver)
            assert none_left_in(pile.folder), stage
            if number == signal.SIGKILL:
                assert code == -number, said
                # it was ended in this stage and in no later one
                assert not list(pile.out.glob(after)), stage
            else:
                assert code == 130, said
                assert said.count("orchestrator: stopped; the same command continues") == 1
                assert not (pile.out / "report.json").exists(), stage
        pile.check_finished()


def test_a_hang_up_under_nohup_at_each_stage_ends_nothing(pile: Bench, ledger: Ledger) -> None:
    with contextlib.ExitStack() as faults:
        (pile.folder / SINCE).touch()
        driver = pile.start(under=NOHUP)
        for stage, (seen, _) in STAGES.items():
            faults.enter_context(ledger.fault("SIGHUP to the driver under nohup", stage))
            assert wait_for(partial(seen, pile.out), driver), stage
            driver.send_signal(HUP)
        code, said = ended(driver)
        assert code == 0, said
        assert "stopped" not in said
        pile.check_finished()


@pytest.mark.parametrize("under", [(), NOHUP])
def test_a_terminal_that_is_closed(pile: Bench, ledger: Ledger, under: tuple[str, ...]) -> None:
    with ledger.fault(" ".join(["a closed terminal", *under]), "flow"):
        master, slave = os.openpty()
        command = [sys.executable, "-m", "orchestrator", "study", "small.toml", "--out", "out"]
        driver = subprocess.Popen(
            ["setsid", "--ctty", *under, *command],
            cwd=pile.folder,
            env=pile.environment,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            text=True,
        )
        os.close(slave)
        assert wait_for(lambda: any(pile.out.glob("cases/flow-*/log.simpleFoam")), driver)
        os.close(master)
        assert driver.wait(600) == (0 if under else 130)
        assert none_left_in(pile.folder)
        assert (
            same_tables(pile.out, pile.undisturbed)
            if under
            else not (pile.out / "report.html").exists()
        )
        pile.check_finished()


SOLVERS = {"gmshToFoam": "mesh", "simpleFoam": "flow", "liggghts": "grains"}
"""The solvers of a study, by the stage that they belong to; in their order."""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_each_solver_that_is_killed_once_is_run_again(
    pile: Bench, ledger: Ledger, number: signal.Signals
) -> None:
    with contextlib.ExitStack() as faults:
        for program, stage in SOLVERS.items():
            faults.enter_context(ledger.fault(f"{number.name} to the solver", stage))
            # the wait makes a program live long enough to be found
            wait = 'case "$1" in -h*) ;; *) sleep 0.3;; esac'
            programs = wrapper(pile.folder / "bin", program, wait)
        driver = pile.start(programs=programs)
        cases = pile.out / "cases"
        for program, stage in SOLVERS.items():
            kind = "pile" if stage == "grains" else "flow"
            assert wait_for(partial(kill_program, cases, kind, program, number), driver), program
        code, said = ended(driver)
        assert code == 0, said
        assert same_tables(pile.out, pile.undisturbed)
        pile.check_finished()


def test_a_solver_that_is_killed_each_time_fails_and_the_others_are_finished(
    pile: Bench, ledger: Ledger
) -> None:
    before = '[ "$1" = -help ] || { echo >>../../../tries; kill -KILL $$; }'
    programs = wrapper(pile.folder / "bin", "simpleFoam", before)
    with ledger.fault("SIGKILL to the solver, each time", "flow"):
        code, said = pile.study(programs=programs)
        assert code == 3, said
        assert len((pile.folder / "tries").read_text().splitlines()) == process.TRIES
        assert "simpleFoam" in said
        assert all((one / "done.json").is_file() for one in case_of(pile.out, "cells"))
        pile.check_finished()


def test_a_process_that_draws_is_killed(pile: Bench, ledger: Ledger) -> None:
    with ledger.fault("SIGKILL to a worker", "figures"):
        driver = pile.start()
        # before that, a child may be one that is about to become a solver
        assert wait_for(lambda: any(pile.out.glob("tables/*.csv")), driver)
        assert wait_for(partial(_kill_a_worker, driver.pid, pile.folder), driver)
        code, said = ended(driver)
        assert code == 0, said
        assert none_left_in(pile.folder)
        pile.check_finished()


def _kill_a_worker(driver: int, folder: Path) -> bool:
    """Kill a process that a driver has forked; whether there was one."""
    for pid in _workers(driver, folder):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
            return True
    return False


def _workers(driver: int, folder: Path) -> list[int]:
    """The processes of Python that a driver has forked."""
    names = processes_in(folder)
    found = []
    for pid in names:
        with contextlib.suppress(OSError):
            parent = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1]
            if int(parent) == driver and names[pid] == names.get(driver):
                found.append(pid)
    return found


@pytest.mark.parametrize("number", [INT, TERM])
def test_the_whole_session_is_asked_to_end(
    pile: Bench, ledger: Ledger, number: signal.Signals
) -> None:
    with ledger.fault(f"{number.name} to all", "figures"):
        seen, after = STAGES["figures"]
        driver = _stopped(pile, (), seen, after)
        os.killpg(driver.pid, number)
        os.killpg(driver.pid, signal.SIGCONT)
        code, said = ended(driver)
        assert code == 130, said
        assert "Traceback" not in said, said
        assert none_left_in(pile.folder)
        pile.check_finished()
