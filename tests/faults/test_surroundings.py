"""What can be wrong around a study: the disk, the clock, the solvers, another driver."""

import os
import subprocess
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
