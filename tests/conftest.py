"""What several tests share."""

import contextlib
import fcntl
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from orchestrator.report.results import Results
from orchestrator.runs import process
from orchestrator.runs.case import templates
from orchestrator.solvers import liggghts
from tests import small_study
from tests.faults import bench
from tests.waiting import HANGS_S

Deck = Callable[..., str]
# no time decides a test, also on a machine that has much else to do
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")


def pytest_configure() -> None:
    """Let programs that tests start hear every signal, as those of a terminal do.

    A shell that runs the tests in the background has them ignore two, and children inherit that.
    """
    for number in (signal.SIGINT, signal.SIGQUIT, signal.SIGHUP, signal.SIGTERM):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def run_check(tmp_path: Path) -> Deck:
    """Run one of the check decks with LIGGGHTS and return what it said."""
    shutil.copytree(templates() / "liggghts", tmp_path / "liggghts")

    def run(deck: str, **variables: float) -> str:
        folder = tmp_path / "liggghts" / "checks"
        command = ["stdbuf", "-o0", "liggghts", "-in", deck, "-nocite", "-log", "none"]
        for name, value in variables.items():
            command += ["-var", name, repr(value)]
        log = folder / "log.check"
        ended = process.run(
            command, cwd=folder, log=log, limit_s=HANGS_S, env=liggghts.ENVIRONMENT
        )
        said = log.read_text()
        assert ended.returncode == 0, said
        assert "the check has ended" in said
        return said

    return run


Command = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def orchestrator(tmp_path: Path) -> Command:
    """Run the command line in a process of its own, in a directory of its own."""

    def run(
        *arguments: str, cwd: Path = tmp_path, path: str | None = None
    ) -> "subprocess.CompletedProcess[str]":
        root = Path(__file__).parent.parent
        env = {
            **os.environ,
            "PYTHONPATH": str(root),
            **({"PATH": path} if path else {}),
        }
        return subprocess.run(
            [sys.executable, "-m", "orchestrator", *arguments],
            cwd=cwd,
            env=env,
            capture_output=True,
            text=True,
            timeout=HANGS_S,
        )

    return run


Shared = Callable[[str], contextlib.AbstractContextManager[Path]]


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    """A directory by its name, one for all processes of a test run; one of them at a time."""
    own = tmp_path_factory.getbasetemp()
    root = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    @contextlib.contextmanager
    def held(name: str) -> Iterator[Path]:
        folder = root / f"shared-{name}"
        folder.mkdir(exist_ok=True)
        with (root / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield folder

    return held


@pytest.fixture(scope="session")
def results(shared: Shared) -> Results:
    """The small study, finished, in a directory whose name asks for trouble."""
    with shared("results") as folder:
        return small_study.run(folder / """grains d'été "1" & #2 %20""")


@pytest.fixture(scope="session")
def finished_pile(shared: Shared) -> Path:
    """The directory of a finished study, undisturbed: a pile, its flow, two single grains."""
    with shared("pile") as folder:
        return bench.undisturbed(folder, bench.HEAD + bench.CELLS + bench.PILE)


Mount = Callable[[str], Path]


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Mount]:
    """Mount a file system of its own with some options, or mount it anew with others."""
    folder = tmp_path / "disk"

    def mount(options: str) -> Path:
        again = "remount," if folder.exists() else ""
        folder.mkdir(exist_ok=True)
        command = ["mount", "-t", "tmpfs", "-o", again + options, "tmpfs", str(folder)]
        if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode:
            folder.rmdir()
            pytest.skip("a file system can be mounted by root alone")
        return folder

    yield mount
    if folder.exists():
        subprocess.run(["umount", "-l", str(folder)], check=True)
