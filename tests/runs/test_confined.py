"""Programs that mean harm: each is ended within its limits, and nothing of it lives on."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from orchestrator.runs import confined
from orchestrator.runs.confined import Limits, Used

ROOT = Path(__file__).parents[2]
MIB = 2**20
SMALL = Limits(seconds=20.0, memory=300 * MIB, disk=16 * MIB, printed=4 * MIB, processes=40)


@pytest.fixture(params=["walled", "open"])
def walled(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Once with the namespaces of the system, and once as where it has none."""
    if request.param == "open":
        monkeypatch.setattr(confined, "hides", lambda: False)
    elif not confined.hides():
        pytest.skip("this system has no namespaces for users")
    return bool(request.param == "walled")


def _run(folder: Path, text: str, limits: Limits = SMALL, hide: tuple[Path, ...] = ()) -> Used:
    work = folder / "work"
    work.mkdir(exist_ok=True)
    return confined.run(["sh", "-c", text], cwd=work, log=folder / "log", limits=limits, hide=hide)


def _python(text: str) -> str:
    return f"exec {sys.executable} -c '{text}'"


@pytest.mark.parametrize(("text", "code"), [("exit 3", 3), ("kill -9 $$", -9), ("true", 0)])
@pytest.mark.usefixtures("walled")
def test_the_end_of_a_program_is_known(tmp_path: Path, text: str, code: int) -> None:
    used = _run(tmp_path, f"echo said; {text}")
    assert (used.returncode, used.broken) == (code, "")
    assert (tmp_path / "log").read_text() == "said\n"
    assert used.cpu_s > 0
    assert used.peak_mib > 1


@pytest.mark.usefixtures("walled")
def test_a_daemon_ends_with_its_program(tmp_path: Path) -> None:
    daemon = "setsid sh -c 'trap \"\" TERM HUP; sleep 1; echo late >answer'"
    used = _run(tmp_path, f"(({daemon}) &) ; echo early >answer")
    assert used.returncode == 0
    time.sleep(1.5)
    assert (tmp_path / "work" / "answer").read_text() == "early\n"


HARM = {
    "prints": ("yes", "printed more than 4 MiB"),
    "files": (
        "for i in 1 2 3; do head -c 9000000 /dev/zero >$i; done; sleep 20",
        "its files took more",
    ),
    "names": (
        _python("for i in range(5000): open(str(i), chr(119))") + "; sleep 20",
        "its files took more",
    ),
    "depth": (
        _python("import os\nfor i in range(500): os.mkdir(chr(97)*9); os.chdir(chr(97)*9)"),
        "too deep",
    ),
    "memory": (_python("b = bytes([1]) * 10**9; import time; time.sleep(20)"), "300 MiB of memory"),
    "memory of many": (
        _python(
            "import os, time\nfor i in range(3): os.fork()\nb = bytes([1]) * 10**8; time.sleep(20)"
        ),
        "300 MiB of memory",
    ),
    "processes": ("while :; do sleep 20 & done", "more than 40 processes"),
    "time": ("trap '' TERM; setsid sleep 30", "did not end within 1 s"),
}


@pytest.mark.parametrize("name", HARM)
@pytest.mark.usefixtures("walled")
def test_a_limit_ends_a_program(tmp_path: Path, name: str) -> None:
    text, message = HARM[name]
    limits = Limits(seconds=1.0) if name == "time" else SMALL
    used = _run(tmp_path, text, limits)
    assert message in used.broken
    assert (tmp_path / "log").stat().st_size <= limits.printed


@pytest.mark.usefixtures("walled")
def test_one_file_has_a_limit_at_once(tmp_path: Path) -> None:
    used = _run(tmp_path, "head -c 30000000 /dev/zero >big")
    assert used.returncode == 128 + signal.SIGXFSZ
    assert (tmp_path / "work" / "big").stat().st_size <= SMALL.disk


@pytest.mark.usefixtures("walled")
def test_shared_memory_counts_once(tmp_path: Path) -> None:
    text = "import os, time\nb = bytes([1]) * 10**8\nfor i in range(6): os.fork() or time.sleep(1)"
    used = _run(tmp_path, _python(text))
    assert used.broken == ""


def test_what_is_hidden_cannot_be_found(tmp_path: Path) -> None:
    if not confined.hides():
        pytest.skip("this system has no namespaces for users")
    secret = tmp_path / "pack"
    secret.mkdir()
    (secret / "expected.csv").write_text("a secret number\n")
    for text in (
        f"cat {secret}/expected.csv",
        f"umount {secret}; cat {secret}/expected.csv",
        f"unshare -Urm sh -c 'umount {secret}; cat {secret}/expected.csv'",
        f"echo 43 >{secret}/expected.csv",
        f"mkdir {secret}/new",
        f"cat /proc/1/root{secret}/expected.csv",
        "nsenter -t 1 -m true",
        "cat /proc/1/fd/* /proc/1/mem",
        f"kill {os.getpid()}",
    ):
        used = _run(tmp_path, text, hide=(secret,))
        said = (tmp_path / "log").read_text()
        assert used.returncode, f"{text}: {said}"
        assert "a secret number" not in said
    assert (secret / "expected.csv").read_text() == "a secret number\n"


def test_a_program_cannot_end_its_keeper(tmp_path: Path) -> None:
    if not confined.hides():
        pytest.skip("this system has no namespaces for users")
    used = _run(tmp_path, "kill -9 $PPID; kill -9 1; exit 7")
    assert used.returncode == 7
