"""Drivers and solvers that are killed, at each stage of a study."""

import contextlib
import itertools
import os
import signal
import subprocess
import time
from collections.abc import Sequence
from functools import partial

import psutil
import pytest

from orchestrator.runs import process
from tests.faults import bench
from tests.faults.bench import (
    Bench,
    Driver,
    ended,
    none_left_in,
    processes_in,
    wait_for,
    wrapper,
)

SINCE = ".started"
"""A file in the study's parent: younger ones are of the driver that runs."""
LOG, DONE = "cases/pile-*/log.liggghts", "cases/pile-*/done.json"
STAGES = {
    "mesh": ("cases/flow-*/parameters", b"\n", "cases/flow-*/case.json"),
    "flow": ("cases/flow-*/log.simpleFoam", b"\n", "cases/flow-*/done.json"),
    "grains": (LOG, b"\n", DONE),
    "collecting": (LOG, b"the protocol has ended", DONE),
    "tables": ("tables/*.csv", b"\n", "report.html"),
    "figures": ("figures/*", b"\n", "report.html"),
}
"""For each: a file that shows it and its content; a file that exists only after its end."""


def _is_in(pile: Bench, stage: str) -> bool:
    """Whether the driver that runs now has come to a stage."""
    pattern, content, _ = STAGES[stage]
    since = (pile.folder / SINCE).stat().st_mtime_ns
    for path in pile.out.glob(pattern):
        with contextlib.suppress(FileNotFoundError):
            if path.stat().st_mtime_ns > since and content in path.read_bytes():
                return True
    return False


def _stopped(pile: Bench, under: Sequence[str], stage: str) -> Driver:
    """A driver that is paused within a stage."""
    after = STAGES[stage][-1]
    for _ in range(20):
        # a run that ended before its driver did has to be run again to be seen
        for path in pile.out.glob(after):
            path.unlink()
        (pile.folder / SINCE).touch()
        driver = pile.start(under=under)
        if wait_for(partial(_is_in, pile, stage), driver):
            driver.send_signal(signal.SIGSTOP)
            stopped = (psutil.STATUS_STOPPED, psutil.STATUS_ZOMBIE)
            while psutil.Process(driver.pid).status() not in stopped:
                time.sleep(0.001)
            if not list(pile.out.glob(after)):
                return driver
            # it was faster than this test: once more
            driver.send_signal(signal.SIGCONT)
        code, printed = ended(driver)
        assert code == 0, printed
    raise AssertionError(f"no driver was met before {after}")


KILL, TERM, INT, HUP = signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP
NOHUP = ("nohup",)


@pytest.mark.parametrize(
    ("numbers", "under"),
    [
        ([KILL], ()),
        ([INT, TERM, HUP, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2], ()),
        ([TERM, INT, signal.SIGXCPU], NOHUP),
    ],
)
def test_an_ended_driver(
    pile: Bench, numbers: list[signal.Signals], under: tuple[str, ...]
) -> None:
    for number, stage in zip(itertools.cycle(numbers), STAGES, strict=False):
        after, driver = STAGES[stage][-1], _stopped(pile, under, stage)
        driver.send_signal(number)
        driver.send_signal(signal.SIGCONT)
        code, printed = ended(driver)
        assert none_left_in(pile.folder), stage
        if number == KILL:
            assert code == -number, printed
            # it was ended in this stage and in no later one
            assert not list(pile.out.glob(after)), stage
        else:
            assert code == 130, printed
            assert (
                printed.count("orchestrator: stopped; the same command continues") == 1
            )
            assert not (pile.out / "report.json").exists(), stage
    pile.check_finished()


@pytest.mark.parametrize("under", [(), NOHUP])
def test_a_terminal_that_is_closed(pile: Bench, under: tuple[str, ...]) -> None:
    master, slave = os.openpty()
    driver = subprocess.Popen(
        [
            "setsid",
            "--ctty",
            *under,
            *bench.ORCHESTRATOR,
            "study",
            "small.toml",
            "--out",
            "out",
        ],
        cwd=pile.folder,
        env=bench.ENVIRONMENT,
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
    assert (pile.out / "report.html").exists() == bool(under)
    pile.check_finished()


SOLVERS = {"simpleFoam": "flow", "liggghts": "pile"}
"""The solvers of a study in their order, by the kind of their case."""


def _kill_program(pile: Bench, kind: str, name: str) -> bool:
    """Kill the program of a name in a case of a kind; whether there was one."""
    running = [
        process for case in pile.cases(kind) for process in processes_in(case).items()
    ]
    pids = [pid for pid, program in running if program == name]
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, KILL)
    return bool(pids)


def test_each_solver_that_is_killed_once_is_run_again(pile: Bench) -> None:
    for program in SOLVERS:
        # the wait makes a program live long enough to be found
        wait = 'case "$1" in -h*) ;; *) sleep 0.3;; esac'
        programs = wrapper(pile.folder / "bin", program, wait)
    driver = pile.start(programs=programs)
    for program, kind in SOLVERS.items():
        assert wait_for(partial(_kill_program, pile, kind, program), driver), program
    code, printed = ended(driver)
    assert code == 0, printed
    pile.check_finished()


def test_a_solver_that_is_killed_each_time_fails_and_the_others_are_finished(
    pile: Bench,
) -> None:
    before = '[ "$1" = -help ] || { echo >>../../../tries; kill -KILL $$; }'
    code, printed = pile.study(
        programs=wrapper(pile.folder / "bin", "simpleFoam", before)
    )
    assert code == 3, printed
    assert len((pile.folder / "tries").read_text().splitlines()) == process.TRIES
    assert "simpleFoam" in printed
    assert all((case / "done.json").is_file() for case in pile.cases("cells"))
    pile.check_finished()
