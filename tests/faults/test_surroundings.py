"""What can be wrong around a study: the disk, the clock, the solvers, another driver."""

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faults.bench import (
    Bench,
    case_of,
    ended,
    none_left_in,
    same_tables,
    wait_for,
    wrapper,
)
from tests.faults.ledger import Ledger

FUTURE_S = 4e9
"""A clock that has jumped back sees the files of before in the future: here in 2096."""


@pytest.fixture
def small_disk(pile: Bench) -> Iterator[Path]:
    """A file system of its own for the study, of 300 kB."""
    folder = pile.folder / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("a file system can be mounted by root alone")
    (folder / "out").mkdir()
    pile.out.symlink_to(folder / "out")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def _remount(folder: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True)


@pytest.mark.parametrize("size", ["16k", "300k", "900k"])
def test_a_full_disk(pile: Bench, ledger: Ledger, small_disk: Path, size: str) -> None:
    _remount(small_disk, f"size={size}")
    with ledger.fault("a full disk", f"after {size}"):
        code, said = pile.study()
        assert code in (1, 2, 3), said
        assert "no space" in said.lower() or "disk" in said
        _remount(small_disk, "size=100M")
        pile.check_finished()


def test_a_disk_that_no_file_may_be_run_on(pile: Bench, ledger: Ledger, small_disk: Path) -> None:
    with ledger.fault("a disk that no file may be run on", "the whole study"):
        _remount(small_disk, "noexec,nosuid,nodev,size=100M")
        pile.check_finished()


def test_a_disk_that_can_only_be_read(pile: Bench, ledger: Ledger, small_disk: Path) -> None:
    with ledger.fault("a read-only disk", "begin"):
        _remount(small_disk, "ro,size=100M")
        code, said = pile.study()
        assert code == 2, said
        assert "--out" in said
        _remount(small_disk, "rw")
        pile.check_finished()
    with ledger.fault("a read-only disk", "end"):
        _remount(small_disk, "ro")
        code, said = pile.study()
        assert code in (1, 2), said
        assert "Read-only file system" in said
        _remount(small_disk, "rw")
        pile.check_finished()


@pytest.mark.parametrize("stage", ["flow", "end"])
def test_a_clock_that_has_jumped_back(pile: Bench, ledger: Ledger, stage: str) -> None:
    driver = pile.start()
    if stage == "flow":
        assert wait_for(lambda: any(pile.out.glob("cases/flow-*/log.simpleFoam")), driver)
        driver.kill()
    ended(driver)
    assert none_left_in(pile.folder)
    with ledger.fault("a clock that has jumped back", stage):
        for path in pile.out.rglob("*"):
            os.utime(path, (FUTURE_S, FUTURE_S))
        pile.check_finished()


def test_a_solver_that_hangs(pile: Bench, ledger: Ledger) -> None:
    source = pile.folder / "small.toml"
    source.write_text(source.read_text().replace("time_limit = 300", "time_limit = 8"))
    programs = wrapper(pile.folder / "bin", "simpleFoam", '[ "$1" = -help ] || sleep 600')
    with ledger.fault("a solver that hangs", "flow"):
        code, said = pile.study(programs=programs)
        assert code == 3, said
        assert "did not end within 8 s" in said
        assert none_left_in(pile.folder)
        pile.check_finished()


DIVERGING = "sed -i 's/0\\.9[0-9]*;/2.5;/' system/fvSolution"
"""Over-relaxation: the iterations really diverge."""
LOSING = "sed -i 's/ceiling_z *equal [^ ]*/ceiling_z equal -1.0/' parameters.liggghts"
"""The roof under the bed: every grain counts as gone."""


@pytest.mark.parametrize(
    ("program", "before", "kind", "cause"),
    [
        ("simpleFoam", DIVERGING, "flow", "diverged"),
        ("liggghts", LOSING, "pile", "LIGGGHTS stopped"),
    ],
)
def test_a_run_that_fails_by_itself_is_told_and_not_repeated(
    pile: Bench, ledger: Ledger, program: str, before: str, kind: str, cause: str
) -> None:
    there = f'case $(basename "$(pwd -P)") in {kind}-*) echo >>../../../tries; {before};; esac'
    programs = wrapper(pile.folder / "bin", program, there)
    with ledger.fault(f"{program} that fails by itself", kind):
        code, said = pile.study(programs=programs)
        assert code == 3, said
        assert cause in said
        (directory,) = case_of(pile.out, kind)
        assert (directory / "failed.json").is_file()
        assert len((pile.folder / "tries").read_text().splitlines()) == 1
        pile.check_finished()


def test_two_drivers_at_once(pile: Bench, ledger: Ledger) -> None:
    with ledger.fault("two drivers", "begin"):
        drivers = [pile.start(), pile.start()]
        ends = [ended(driver) for driver in drivers]
        assert sorted(code for code, _ in ends) == [0, 1], ends
        numbers = [driver.pid for driver in drivers]
        ((winner, said),) = [
            (numbers[1 - k], said) for k, (code, said) in enumerate(ends) if code == 1
        ]
        assert f"process {winner} on " in said
        assert same_tables(pile.out, pile.undisturbed)
        pile.check_finished()


WITHOUT_LOCKS = (
    "-c",
    """
import errno, fcntl, sys
from orchestrator import cli
from orchestrator.runs import lock
def flock(*_):
    raise OSError(errno.ENOLCK, "No locks available")
fcntl.flock, lock.BEAT_S = flock, 0.5
sys.exit(cli.main(sys.argv[1:]))
""",
)
"""A driver on a file system that knows no locks."""


def test_two_drivers_where_the_file_system_knows_no_locks(cells: Bench, ledger: Ledger) -> None:
    with ledger.fault("two drivers, no locks", "begin"):
        drivers = [cells.start(python=WITHOUT_LOCKS), cells.start(python=WITHOUT_LOCKS)]
        ends = [ended(driver) for driver in drivers]
        assert sorted(code for code, _ in ends) == [0, 1], ends
        cells.check_finished()
    with ledger.fault("SIGKILL to the driver, no locks", "grains"):
        (cells.out / "report.json").unlink()
        driver = cells.start(python=WITHOUT_LOCKS)
        assert wait_for(lambda: not _same_or_empty(cells.out / ".lock", b""), driver)
        driver.kill()
        ended(driver)
        code, said = ended(cells.start(python=WITHOUT_LOCKS))
        assert code == 0, said
        cells.check_finished()


def _same_or_empty(path: Path, content: bytes) -> bool:
    return path.read_bytes() in (b"", content)


@pytest.mark.parametrize("beats", [True, False])
def test_a_holder_on_another_machine_is_believed_while_it_lives(
    cells: Bench, ledger: Ledger, beats: bool
) -> None:
    note = '{{"beat":{},"host":"elsewhere","pid":7,"started":"then"}}\n'
    cells.out.mkdir()
    path = cells.out / ".lock"
    path.write_text(note.format(0))
    with ledger.fault("another machine, no locks", "living" if beats else "gone"):
        driver = cells.start(python=WITHOUT_LOCKS)
        for count in range(1, 200):
            if driver.poll() is not None:
                break
            if beats:
                path.write_text(note.format(count))
            time.sleep(0.1)
        code, said = ended(driver)
        assert code == (1 if beats else 0), said
        assert ("process 7 on elsewhere" in said) == beats
        cells.check_finished()


LIMITS = {"ulimit -n": "16", "ulimit -v": "600000"}


@pytest.mark.parametrize("command", LIMITS)
def test_a_limit_of_the_shell_that_is_too_low(cells: Bench, ledger: Ledger, command: str) -> None:
    shell = ("sh", "-c", f'{command} {LIMITS[command]}; exec "$0" "$@"')
    with ledger.fault(f"{command} {LIMITS[command]}", "begin"):
        code, said = ended(cells.start(under=shell))
        assert (code, said.count("\n")) == (1, 1), said
        assert command in said
        assert not cells.out.exists()
        cells.check_finished()


POWERLESS = "-dac_override,-dac_read_search"
WITHOUT_RIGHTS = ("setpriv", f"--bounding-set={POWERLESS}", f"--inh-caps={POWERLESS}")
"""Before a command: even root may then do only what owner and mode allow."""


@pytest.mark.parametrize("name", ["", "cases", "cells", "tables"])
def test_a_directory_that_may_not_be_entered(cells: Bench, ledger: Ledger, name: str) -> None:
    cells.study()
    (cells.out / "report.json").unlink()
    (cell,) = case_of(cells.out, "cells")
    (cell / "done.json").unlink()
    closed = cell if name == "cells" else cells.out / name
    with ledger.fault("a directory of mode 000", name or "the study"):
        closed.chmod(0)
        code, said = ended(cells.start(under=WITHOUT_RIGHTS))
        closed.chmod(0o755)
        assert code in (1, 2, 3), said
        assert f"{closed}" in said
        assert "Permission denied" in said
        cells.check_finished()


def test_a_case_that_is_immutable(cells: Bench, ledger: Ledger) -> None:
    cells.study()
    (cell,) = case_of(cells.out, "cells")
    (cell / "done.json").unlink()
    if os.geteuid() != 0 or subprocess.run(["chattr", "+i", cell], capture_output=True).returncode:
        pytest.skip("no file can be made immutable here")
    with ledger.fault("an immutable directory", "grains"):
        code, said = cells.study()
        subprocess.run(["chattr", "-i", cell], check=True)
        assert code == 3, said
        assert f"{cell.name}" in said
        assert "Operation not permitted (is it immutable" in said
        cells.check_finished()


def test_what_the_linker_says_is_no_failure(pile: Bench, ledger: Ledger) -> None:
    with ledger.fault("a library that cannot be preloaded", "flow and grains"):
        code, said = ended(pile.start(under=("env", "LD_PRELOAD=/nowhere/libnone.so")))
        assert code == 0, said
        logs = [path for path in pile.out.glob("cases/*/log.*") if b"ld.so" in path.read_bytes()]
        assert {"log.liggghts", "log.simpleFoam"} <= {path.name for path in logs}
        pile.check_finished()
