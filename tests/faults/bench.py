"""A small study that faults are injected into, its driver as a process, its undisturbed tables."""

import contextlib
import io
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from orchestrator import cli
from tests.waiting import HANGS_S, pause, until

ROOT = Path(__file__).parents[2]
ORCHESTRATOR = (sys.executable, "-m", "orchestrator")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
HEAD = f"""
time_limit = {HANGS_S:g}
[method.grains]
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
stiffness = 1e3
"""
CELLS = """
[[group]]
name = "cells"
axes = { "grain.diameter" = [7e-4, 1e-3] }
"""
PILE = """
[[group]]
name = "pile"
grain = { diameter = 2e-3 }
bed = { kind = "pile", slope_deg = 20.0, roughness = "d/30" }
threshold.fractions = [0.3, 0.5]
method.flow.cells_per_face = 10
method.grains.mobile_layers = 1
method.grains.final_fraction = 0.8
"""
Driver = subprocess.Popen[str]
ENDLESS = {
    "simpleFoam": (
        "parameters system/fvSolution",
        "s/residualControl/unused/; s/iterations  *[0-9][0-9]*/iterations 1e9/",
    ),
    "liggghts": (
        "parameters.liggghts",
        "s/waiting_time equal [^ ]*/waiting_time equal 1e9/;"
        " s/rest_energy equal [^ ]*/rest_energy equal 0/",
    ),
}
"""Inputs of each solver, and the change of them by `sed` with which it never ends by itself."""
AT_WORK = {
    "flow": ("log.simpleFoam", b"\nTime = 2\n"),
    "pile": ("samples.csv", b"\n1,"),
}
"""For each kind of case, a file that its solver writes and what it has once it is at work."""


@dataclass
class Bench:
    """A directory with a study file, its `source`, and the directory of its undisturbed run."""

    folder: Path
    undisturbed: Path
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)
    options: Sequence[str] = ()
    drivers: list[Driver] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.source, self.out = self.folder / "small.toml", self.folder / "out"

    def cases(self, kind: str) -> list[Path]:
        """The directories of the cases of a kind."""
        return [*self.out.glob(f"cases/{kind}-*")]

    def start(
        self,
        *,
        programs: Path | None = None,
        under: Sequence[str] = (),
        halt_at: str = "",
    ) -> Driver:
        """Start the study's driver, with programs before the real ones, under a command.

        It halts when it first opens a file whose path fits the pattern `halt_at`.
        """
        paths = [*([str(programs)] if programs else []), os.environ["PATH"]]
        variables = {"PYTHONPATH": str(ROOT), "PATH": os.pathsep.join(paths)}
        driver = subprocess.Popen(
            [
                *under,
                *(halting(halt_at) if halt_at else ORCHESTRATOR),
                "study",
                "small.toml",
                "--out",
                str(self.out),
                *self.options,
            ],
            cwd=self.folder,
            env={**self.environment, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.drivers.append(driver)
        return driver

    def study(self, *, programs: Path | None = None) -> tuple[int, str]:
        """Run the study to its end; its exit code and what it printed."""
        return ended(self.start(programs=programs))

    def command(self, word: str, source: Path | None = None) -> tuple[int, str]:
        """Run a command on the study in this process; its exit code and what it printed."""
        words = [str(source or self.source), "--out"] if word == "study" else []
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            code = cli.main([word, *words, str(self.out)])
        return code, printed.getvalue()

    def check_finished(self) -> None:
        """See that the same command ends well, with the tables of the undisturbed run."""
        code, printed = self.study()
        assert code == 0, printed
        assert (self.out / "report.html").is_file()
        assert tables(self.out) == tables(self.undisturbed)
        await_none_in(self.folder)
        assert not list(self.out.rglob("*.tmp"))


@contextlib.contextmanager
def begun(folder: Path, text: str, *about: Any) -> Iterator[Bench]:
    """A study that is not begun; drivers that a failed test has left are ended."""
    bench = Bench(folder, *about)
    bench.source.write_text(text)
    yield bench
    for driver in bench.drivers:
        with driver:
            driver.kill()


def undisturbed(folder: Path, text: str) -> Path:
    """The directory of a study that has run to its end without a failure; it is run once."""
    bench = Bench(folder, folder / "out")
    folder.mkdir(exist_ok=True)
    succeeded = folder / "succeeded"
    if not succeeded.exists():
        bench.source.write_text(text)
        code, printed = bench.study()
        assert code == 0, printed
        succeeded.touch()
    return bench.out


def ended(driver: Driver) -> tuple[int, str]:
    """Wait for a driver; its exit code and all that it printed, which holds no traceback."""
    out, printed = driver.communicate(timeout=HANGS_S)
    assert "Traceback" not in printed
    return driver.returncode, out + printed


def halting(pattern: str) -> tuple[str, ...]:
    """The command of a driver that halts when it first opens a file of a pattern."""
    return sys.executable, "-m", "tests.faults.halting", pattern


def await_halt(driver: Driver) -> None:
    """Wait until a driver has halted: all its threads, also if it only now comes there."""
    look = os.WSTOPPED | os.WEXITED | os.WNOWAIT
    state = os.waitid(os.P_PID, driver.pid, look)
    assert state is not None
    assert state.si_code == os.CLD_STOPPED, ended(driver)


def tables(out: Path) -> dict[str, bytes]:
    """The tables of a study, byte for byte."""
    return {path.name: path.read_bytes() for path in (out / "tables").iterdir()}


def wait_for(seen: Callable[[], bool], driver: Driver) -> bool:
    """Wait until something is seen; False if the driver ends before that."""
    while not seen():
        if driver.poll() is not None:
            return False
        pause()
    return True


def processes_in(folder: Path) -> dict[int, str]:
    """Names of the living processes that work below a folder, by their number."""
    return {
        process.pid: process.info["name"]
        for process in psutil.process_iter(["cwd", "name", "status"])
        if process.info["status"] != psutil.STATUS_ZOMBIE
        if process.info["cwd"] and Path(process.info["cwd"]).is_relative_to(folder)
    }


def await_none_in(folder: Path) -> None:
    """Wait until every process that works below a folder has ended."""
    until(lambda: not processes_in(folder))


def wrapper(folder: Path, program: str, before: str) -> Path:
    """A folder with a program that does something first, and then becomes the real one.

    Asked for its version it does nothing first.
    """
    folder.mkdir(exist_ok=True)
    path = folder / program
    at_work = f'case "$1" in -h*) ;; *)\n{before}\n;; esac'
    path.write_text(f'#!/bin/sh\n{at_work}\nexec {shutil.which(program)} "$@"\n')
    path.chmod(0o755)
    return folder


def endless(program: str) -> str:
    """What a `wrapper` does first so that a solver never ends.

    The solver is the real one at its real work, and only a signal ends it.
    """
    names, change = ENDLESS[program]
    return f"sed -i.whole '{change}' {names}"


def endless_once(program: str, kind: str) -> str:
    """The same for the first run of a kind of case; the next one has its own inputs again."""
    names, _ = ENDLESS[program]
    return f"""case $(basename "$(pwd -P)") in {kind}-*)
    if mkdir ../../../endless-{program} 2>/dev/null; then
        {endless(program)}
    else
        for name in {names}; do [ ! -e $name.whole ] || mv $name.whole $name; done
    fi;;
esac"""


def is_at_work(case: Path, kind: str) -> bool:
    """Whether the solver of a case of a kind is in the midst of its iterations or load steps."""
    log, line = AT_WORK[kind]
    return (case / log).is_file() and line in (case / log).read_bytes()
