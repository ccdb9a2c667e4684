"""Drivers and solvers that are killed, at each stage of a study."""

import contextlib
import itertools
import os
import shlex
import shutil
import signal
import subprocess
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import psutil
import pytest

from orchestrator.runs import process
from tests.faults import bench
from tests.faults.bench import (
    Bench,
    Driver,
    await_halt,
    await_none_in,
    ended,
    endless_once,
    is_at_work,
    processes_in,
    wait_for,
    wrapper,
)
from tests.waiting import HANGS_S, until

SOLVERS = {"simpleFoam": "flow", "liggghts": "pile"}
"""The solvers of a study in their order, by the kind of their case."""


class Stage(NamedTuple):
    """A stage of a study: where it is met, and a file that exists only after its end.

    It is met where the driver opens a file `halts_at`, or where the solver `program` is at work.
    """

    after: str
    halts_at: str = ""
    program: str = ""


STAGES = {
    "mesh": Stage("cases/flow-*/case.json", halts_at="*/flow-*/polyMesh/faces"),
    "flow": Stage("cases/flow-*/done.json", program="simpleFoam"),
    "grains": Stage("cases/pile-*/done.json", program="liggghts"),
    "collecting": Stage("cases/pile-*/done.json", halts_at="*/pile-*/motion.csv"),
    "tables": Stage("report.html", halts_at="*/tables/.methods.csv.tmp"),
    "figures": Stage("report.html", halts_at="*/figures/.shields.svg.tmp"),
}


def _is_at_work(pile: Bench, kind: str) -> bool:
    """Whether the solver of a kind of case is at work."""
    return any(is_at_work(case, kind) for case in pile.cases(kind))


def _within(pile: Bench, under: Sequence[str], stage: Stage) -> Driver:
    """A driver that is within a stage, which it cannot leave by itself."""
    # what a run before has left, whose solver may have gone on until its driver ended
    for path in pile.out.glob(stage.after):
        path.unlink()
    if stage.halts_at:
        driver = pile.start(under=under, halt_at=stage.halts_at)
        await_halt(driver)
    else:
        kind = SOLVERS[stage.program]
        for case in pile.cases(kind):
            shutil.rmtree(case)
        before = endless_once(stage.program, kind)
        programs = wrapper(pile.folder / "bin", stage.program, before)
        driver = pile.start(under=under, programs=programs)
        assert wait_for(partial(_is_at_work, pile, kind), driver), ended(driver)
    assert not list(pile.out.glob(stage.after))
    return driver


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
    for number, (name, stage) in zip(
        itertools.cycle(numbers), STAGES.items(), strict=False
    ):
        driver = _within(pile, under, stage)
        driver.send_signal(number)
        driver.send_signal(signal.SIGCONT)
        code, printed = ended(driver)
        await_none_in(pile.folder)
        if number == KILL:
            assert code == -number, printed
            # it was ended in this stage and in no later one
            assert not list(pile.out.glob(stage.after)), name
        else:
            assert code == 130, printed
            assert (
                printed.count("orchestrator: stopped; the same command continues") == 1
            )
            assert not (pile.out / "report.json").exists(), name
    pile.check_finished()


@pytest.mark.parametrize("under", [(), NOHUP])
def test_a_terminal_that_is_closed(pile: Bench, under: tuple[str, ...]) -> None:
    master, slave = os.openpty()
    driver = subprocess.Popen(
        [
            "setsid",
            "--ctty",
            *under,
            *bench.halting("*/flow-*/log.Allrun"),
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
    await_halt(driver)
    os.close(master)
    driver.send_signal(signal.SIGCONT)
    assert driver.wait(HANGS_S) == (0 if under else 130)
    await_none_in(pile.folder)
    assert (pile.out / "report.html").exists() == bool(under)
    pile.check_finished()


def test_a_study_outlives_its_terminal_and_is_watched_from_another(
    pile: Bench,
) -> None:
    """As the guide has it: nohup, an output of its own, and status --watch."""
    words = bench.halting("*/flow-*/log.Allrun")
    study = shlex.join(["nohup", *words, "study", "small.toml", "--out", "out"])
    script = f"{study} >study.log 2>&1 & echo $! >pid; wait"
    master, slave = os.openpty()
    shell = subprocess.Popen(
        ["setsid", "--ctty", "sh", "-c", script],
        cwd=pile.folder,
        env=bench.ENVIRONMENT,
        stdin=slave,
        stdout=slave,
        stderr=slave,
    )
    os.close(slave)
    until((pile.folder / "pid").exists)
    until(lambda: bool((pile.folder / "pid").read_text()))
    driver = psutil.Process(int((pile.folder / "pid").read_text()))
    until(lambda: driver.status() == psutil.STATUS_STOPPED)
    with subprocess.Popen(
        [*bench.ORCHESTRATOR, "status", "out", "--watch"],
        cwd=pile.folder,
        env=bench.ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
    ) as watch:
        assert watch.stdout
        said = [watch.stdout.readline(), watch.stdout.readline()]
        # the terminal closes: SIGHUP to its session
        os.close(master)
        assert shell.wait(HANGS_S) == -HUP
        assert driver.is_running()
        driver.send_signal(signal.SIGCONT)
        rest, _ = watch.communicate(timeout=HANGS_S)
    assert said[0].startswith("study small: ")
    assert said[1].startswith(f"running: process {driver.pid} on ")
    assert " since " in said[1]
    assert " running, " in said[0]
    last = rest[rest.rindex("study small: ") :]
    assert "3 done, 0 unfinished, 0 not begun, 0 failed" in last
    assert "running: " not in last
    assert f"page: {pile.out / 'report.html'}" in last
    assert watch.returncode == 0
    await_none_in(pile.folder)
    pile.check_finished()


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
    for program, kind in SOLVERS.items():
        before = endless_once(program, kind)
        programs = wrapper(pile.folder / "bin", program, before)
    driver = pile.start(programs=programs)
    for program, kind in SOLVERS.items():
        assert wait_for(partial(_is_at_work, pile, kind), driver), ended(driver)
        assert _kill_program(pile, kind, program), program
    code, printed = ended(driver)
    assert code == 0, printed
    pile.check_finished()


def test_a_solver_that_is_killed_each_time_fails_and_the_others_are_finished(
    pile: Bench,
) -> None:
    before = "echo >>../../../tries; kill -KILL $$"
    code, printed = pile.study(
        programs=wrapper(pile.folder / "bin", "simpleFoam", before)
    )
    assert code == 3, printed
    assert len((pile.folder / "tries").read_text().splitlines()) == process.TRIES
    assert "simpleFoam" in printed
    assert all((case / "done.json").is_file() for case in pile.cases("cells"))
    pile.check_finished()
