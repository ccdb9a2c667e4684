"""What can be wrong around a study: the disk, the clock, the solvers, streams, another driver."""

import os
import re
import shutil
import signal
import subprocess

import pandas as pd
import pytest

from tests.conftest import Mount
from tests.faults import bench
from tests.faults.bench import (
    Bench,
    await_halt,
    await_none_in,
    ended,
    tables,
    wrapper,
)
from tests.waiting import until

# the mesh of the small study is so coarse that it is warned of
pytestmark = pytest.mark.filterwarnings("ignore:method.flow.cells_per_face")


@pytest.mark.parametrize("size", ["16k", "300k", "900k"])
def test_a_full_disk(pile: Bench, disk: Mount, size: str) -> None:
    (disk(f"size={size}") / "out").mkdir()
    pile.out.symlink_to(pile.folder / "disk" / "out")
    code, printed = pile.study()
    assert code in (1, 2, 3), printed
    assert "no space" in printed.lower() or "disk" in printed
    disk("size=100M")
    pile.check_finished()


def test_a_disk_without_rights_to_run_or_write(pile: Bench, disk: Mount) -> None:
    (disk("noexec,nosuid,nodev,size=100M") / "out").mkdir()
    pile.out.symlink_to(pile.folder / "disk" / "out")
    pile.check_finished()
    disk("ro")
    assert pile.study()[0] == 0  # nothing is left to write
    pile.source.write_text(f"title = 'another'\n{pile.source.read_text()}")
    code, printed = pile.study()
    assert code in (1, 2), printed
    assert "Read-only file system" in printed
    disk("rw")
    pile.check_finished()


def test_a_clock_that_has_jumped_back(pile: Bench) -> None:
    driver = pile.start(halt_at="*/flow-*/log.simpleFoam")
    await_halt(driver)
    driver.kill()
    ended(driver)
    await_none_in(pile.folder)
    for _ in range(2):
        for path in pile.out.rglob("*"):
            os.utime(
                path, (4e9, 4e9)
            )  # the files of before are in the future: here in 2096
        pile.check_finished()


def test_a_solver_that_hangs(pile: Bench) -> None:
    text = pile.source.read_text()
    pile.source.write_text(re.sub("time_limit = .*", "time_limit = 8", text))
    programs = wrapper(pile.folder / "bin", "simpleFoam", "sleep 600")
    code, printed = pile.study(programs=programs)
    assert code == 3, printed
    assert "did not end within 8 s" in printed
    await_none_in(pile.folder)
    pile.source.write_text(text)
    pile.check_finished()


DIVERGING = "sed -i 's/^\\(relaxation[A-Za-z]*\\) .*/\\1 2.5;/'"
"""Over-relaxation, in the files that follow: the iterations really diverge."""
BOTH = f"{DIVERGING} parameters; [ ! -f second_try ] || {DIVERGING} second_try"
LOSING = "sed -i 's/ceiling_z *equal [^ ]*/ceiling_z equal -1.0/' parameters.liggghts"
"""The roof under the bed: every grain counts as lost."""
FAILURES = {
    "flow": ("simpleFoam", BOTH, "diverged.*it was the second try", 2),
    "pile": ("liggghts", LOSING, "LIGGGHTS stopped", 1),
}
"""The solver of a kind of case, what lets it fail, what is said, and how often it is tried."""


@pytest.mark.parametrize("kind", FAILURES)
def test_a_run_that_fails_by_itself_is_not_repeated_but_for_a_second_try_of_a_flow(
    pile: Bench, kind: str
) -> None:
    program, before, cause, tries = FAILURES[kind]
    there = f'case $(basename "$(pwd -P)") in {kind}-*) echo >>../../../tries; {before};; esac'
    code, printed = pile.study(programs=wrapper(pile.folder / "bin", program, there))
    assert code == 3, printed
    assert re.search(cause, printed)
    (directory,) = pile.cases(kind)
    assert (directory / "failed.json").is_file()
    assert len((pile.folder / "tries").read_text().splitlines()) == tries
    pile.check_finished()


def test_a_flow_that_converges_at_its_second_try_says_so(pile: Bench) -> None:
    there = f'case $(basename "$(pwd -P)") in flow-*) {DIVERGING} parameters;; esac'
    code, printed = pile.study(
        programs=wrapper(pile.folder / "bin", "simpleFoam", there)
    )
    assert code == 0, printed
    told = r"simpleFoam diverged: .*; the second try converged"
    assert re.search(told, printed)
    code, printed = pile.command("status")
    assert code == 0
    assert re.search(f"done: flow-[0-9a-f]*: {told}", printed)
    assert re.search(told, (pile.out / "report.html").read_text())
    # the answer is that of the first try, but for what its residuals leave
    found, undisturbed = (
        pd.read_csv(root / "tables" / "flow.csv")["ustar_mean"]
        for root in (pile.out, pile.undisturbed)
    )
    assert found.tolist() != undisturbed.tolist()
    assert found.tolist() == pytest.approx(undisturbed.tolist(), rel=0.02)
    code, printed = pile.command("study")
    assert (code, "no solver was started" in printed) == (0, True)


def test_two_drivers_at_once(pile: Bench) -> None:
    # the one that has the study cannot end before the other has asked for it
    hold = "until [ -e ../../../go ]; do sleep 0.1; done"
    programs = wrapper(pile.folder / "bin", "simpleFoam", hold)
    drivers = [pile.start(programs=programs), pile.start(programs=programs)]
    until(lambda: any(driver.poll() is not None for driver in drivers))
    (pile.folder / "go").touch()
    ends = [ended(driver) for driver in drivers]
    assert sorted(code for code, _ in ends) == [0, 1], ends
    loser = [code for code, _ in ends].index(1)
    assert f"in use by process {drivers[1 - loser].pid} on " in ends[loser][1]
    pile.check_finished()


@pytest.mark.parametrize("limit", ["-n 16", "-v 600000"])
def test_a_limit_of_the_shell_that_is_too_low(cells: Bench, limit: str) -> None:
    shell = ("sh", "-c", f'ulimit {limit}; exec "$0" "$@"')
    code, printed = ended(cells.start(under=shell))
    assert (code, printed.count("\n")) == (1, 1), printed
    assert f"ulimit {limit[:2]}" in printed
    assert not cells.out.exists()


def test_a_directory_that_vanishes(pile: Bench) -> None:
    driver = pile.start(halt_at="*/pile-*/log.Allrun")
    await_halt(driver)
    while pile.out.exists():  # its solvers may be at work on it
        shutil.rmtree(pile.out, ignore_errors=True)
    driver.send_signal(signal.SIGCONT)
    code, printed = ended(driver)
    assert code in (1, 2, 3), printed
    await_none_in(pile.folder)
    shutil.rmtree(pile.out, ignore_errors=True)
    pile.check_finished()


NOBODY = 65534
ANOTHER_USER = (
    *("unshare", "--net", "setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}"),
    # the tests may lie where only their own user can read
    *("--clear-groups", "--inh-caps=+dac_read_search"),
    *("--ambient-caps=+dac_read_search", "env", "HOME=/proc/nohome"),
)
"""As in a container that is run as another user, without a home and without a network."""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may become another user")
def test_another_user_without_a_home_or_a_network(pile: Bench) -> None:
    for path in (pile.folder, pile.source):
        os.chown(path, NOBODY, NOBODY)
    code, printed = ended(pile.start(under=ANOTHER_USER))
    assert code == 0, printed
    assert "nohome" not in printed
    assert tables(pile.out) == tables(pile.undisturbed)
    assert {path.stat().st_uid for path in pile.out.rglob("*")} == {NOBODY}
    # on another machine, at another path: the path of the run is in none of its notes
    notes = [*pile.out.glob("*.json"), *pile.out.glob("*.html")]
    assert notes
    own = str(pile.folder).encode()
    assert not [path for path in notes if own in path.read_bytes()]
    moved = pile.folder / "moved"
    pile.out.rename(moved)
    (moved / ".lock").write_text("process 1 on elsewhere\n")
    pile.out = moved
    code, printed = pile.command("status")
    assert (code, "0 failed" in printed, "running" in printed) == (0, True, False)
    assert "no solver was started" in pile.command("study")[1]
    assert pile.command("report")[0] == 0


STREAMS = {
    "<&- >&- 2>&-": 0,
    "2>/dev/full": 0,
    ">/dev/full": 1,
    "2>&1 | head -n 1": 0,
    "2>&1 >page | true": 0,
}
"""Redirections of a shell, and the exit code of a study that is whole: 1 if an answer is lost."""


@pytest.mark.parametrize("redirection", STREAMS)
def test_a_study_ends_well_whatever_its_streams(cells: Bench, redirection: str) -> None:
    driver = f"'{bench.ORCHESTRATOR[0]}' -m orchestrator study small.toml --out out {redirection}"
    shell = subprocess.run(
        ["bash", "-o", "pipefail", "-c", driver],
        cwd=cells.folder,
        env=bench.ENVIRONMENT | {"PYTHONIOENCODING": "ascii:strict"},
        capture_output=True,
        text=True,
    )
    assert shell.returncode == STREAMS[redirection], shell.stderr
    assert "Traceback" not in shell.stdout + shell.stderr
    assert bench.tables(cells.out) == bench.tables(cells.undisturbed)
