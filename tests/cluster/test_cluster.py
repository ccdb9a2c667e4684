"""A study on a real Slurm of two nodes: the same bytes, whatever happens to its jobs."""

import importlib.util
import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cluster import slurm
from tests.cluster.slurm import Slurm
from tests.conftest import Command, Shared
from tests.faults.bench import (
    Bench,
    begun,
    ended,
    processes_in,
    tables,
    undisturbed,
    wait_for,
    wrapper,
)
from tests.waiting import HANGS_S, until

pytestmark = pytest.mark.long

STUDY = f"""
time_limit = {HANGS_S:g}
[grain]
diameter = 1e-3
[bed]
kind = "pile"
height = 0.01
slope_deg = 15.0
packing = "disordered"

[method.grains]
load_increment = 0.006
waiting_time = 6.0
stiffness = 1e3
mobile_layers = 1
[method.flow]
cells_per_face = 20
[axes]
"bed.seed" = [1, 2, 3]
[cluster]
cores = 1
memory = "500MB"
interface = "lo"
"""


@pytest.fixture(scope="session")
def queue(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Slurm]:
    """Two nodes of one core."""
    lacking = slurm.missing()
    if importlib.util.find_spec("dask_jobqueue") is None:
        lacking.append("dask-jobqueue")
    if lacking:
        stop = pytest.fail if os.environ.get("SKIP_NOTHING") else pytest.skip
        stop(f"without {', '.join(lacking)}; `sh tools/setup.sh test` installs all")
    with slurm.running(
        tmp_path_factory.mktemp("slurm") / "root", nodes=2, cores=1
    ) as started:
        yield started


@pytest.fixture
def bench(tmp_path: Path, queue: Slurm, shared: Shared) -> Iterator[Bench]:
    """The study, not begun, for the queue; its undisturbed run is one of this machine alone."""
    with shared("local") as folder:
        local = undisturbed(folder, STUDY)
    options = ("--cluster", "slurm", "--workers", "2")
    with begun(tmp_path, STUDY, local, queue.environment, options) as bench:
        yield bench


def _holding(bench: Bench, count: int) -> Path:
    """Programs of which LIGGGHTS, at its run of such a number, waits until `go` is there.

    The runs before it are counted by directories, which no two of them can make.
    """
    script = f"""case $(basename "$(pwd -P)") in pile-*)
    run=1
    until mkdir ../../../run-$run 2>/dev/null; do run=$((run + 1)); done
    [ $run -ne {count} ] || until [ -e ../../../go ]; do sleep 0.1; done;;
esac"""
    return wrapper(bench.folder / "bin", "liggghts", script)


def test_two_nodes(bench: Bench, queue: Slurm) -> None:
    code, printed = bench.study()
    assert code == 0, printed
    assert tables(bench.out) == tables(bench.undisturbed)
    logs = "".join(path.read_text() for path in (bench.out / "jobs").glob("*.err"))
    assert "ON n1" in logs
    assert "ON n2" in logs
    assert not list((bench.out / "cases").glob(".*"))
    until(lambda: not queue.jobs())


def test_a_cancelled_job(bench: Bench, queue: Slurm) -> None:
    driver = bench.start(programs=_holding(bench, 1))
    assert wait_for((bench.folder / "run-1").exists, driver), ended(driver)
    queue.says("scancel", *queue.jobs())
    (bench.folder / "go").touch()
    code, printed = ended(driver)
    assert code == 0, printed
    assert tables(bench.out) == tables(bench.undisturbed)
    assert not processes_in(bench.out / "cases")


def test_a_killed_driver(bench: Bench) -> None:
    driver = bench.start(programs=_holding(bench, 2))

    def first_is_done() -> bool:
        return any(bench.out.glob("cases/pile-*/done.json"))

    assert wait_for(first_is_done, driver), ended(driver)
    # the second cannot end, and the third may be done or not
    before = {
        path: path.stat().st_mtime_ns for path in bench.out.glob("cases/*/done.json")
    }
    driver.kill()
    driver.communicate()
    (bench.folder / "go").touch()
    code, printed = bench.study()
    assert code == 0, printed
    assert tables(bench.out) == tables(bench.undisturbed)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert not processes_in(bench.out / "cases")


REFUSED = {
    'memmory = "1GB"': "memmory",
    'queue = "nowhere"': "slurm does not take the job: .*invalid partition",
    'interface = "none0"': "none0",
}


@pytest.mark.parametrize("settings", REFUSED)
def test_settings_without_jobs(bench: Bench, settings: str) -> None:
    text = STUDY.replace('interface = "lo"\n', "") if "interface" in settings else STUDY
    bench.source.write_text(text + settings)
    code, printed = bench.study()
    assert code in (1, 2), printed
    (line,) = (line for line in printed.splitlines() if line.startswith("orchestrator"))
    assert re.search(REFUSED[settings], line)
    assert "[cluster]" in line


def test_without_the_extra_one_line_says_what_to_install(
    tmp_path: Path, orchestrator: Command
) -> None:
    (tmp_path / "x.toml").write_text("grain.diameter = 1e-3\n")
    missing = "raise ModuleNotFoundError('none', name='dask_jobqueue')\n"
    (tmp_path / "dask_jobqueue.py").write_text(missing)  # python -m looks here first
    ended = orchestrator("study", "x.toml", "--cluster", "pbs")
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
    assert "pip install 'dask-jobqueue>=0.9'" in ended.stderr
