"""Case directories and processes: identity, state never trusted half-written, clean ends."""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from orchestrator.errors import Interrupted
from orchestrator.runs import assets, case, process
from orchestrator.runs.case import Case


@dataclass(frozen=True)
class Tiny(Case):
    """A case of a template with few files; nothing is run."""

    size: float
    kind: ClassVar[str] = "tiny"
    template: ClassVar[str] = "liggghts/checks"
    recipe: ClassVar[int] = 1
    results: ClassVar[tuple[str, ...]] = ("result.txt",)
    made: ClassVar[tuple[str, ...]] = ("input.txt",)

    @property
    def parameters(self) -> dict[str, Any]:
        return {"size": self.size}

    @property
    def cost_s(self) -> float:
        return 1.0

    def write(self, directory: Path, cases: Path) -> None:
        (directory / "input.txt").write_text(str(self.size))

    def collect(self, directory: Path) -> None:
        pass

    def versions(self) -> dict[str, str]:
        return {"none": "0"}


@pytest.fixture
def finished(tmp_path: Path) -> tuple[Tiny, Path]:
    tiny = Tiny(1.0)
    directory = case.prepare(tiny, tmp_path)
    (directory / "result.txt").write_text("42\n")
    case.finish(tiny, directory, solver_s=1.0, cpu_s=1.0, wall_s=1.5)
    return tiny, tmp_path


def test_the_id_is_that_of_parameters_and_template() -> None:
    assert Tiny(1.0).id == Tiny(1.0).id != Tiny(2.0).id
    assert Tiny(1.0).name == f"tiny-{Tiny(1.0).id[:12]}"


def test_a_prepared_case_is_a_copy_of_its_template_with_inputs(tmp_path: Path) -> None:
    directory = case.prepare(Tiny(1.0), tmp_path)
    for path in (assets.templates() / "liggghts/checks").iterdir():
        assert (directory / path.name).read_bytes() == path.read_bytes()
    identity = json.loads((directory / case.IDENTITY).read_text())
    assert identity["parameters"] == {"size": 1.0}
    assert "input.txt" in identity["inputs_sha256"]
    assert not case.is_done(Tiny(1.0), tmp_path)


def test_a_finished_case_is_done_and_its_checksums_hold(finished: tuple[Tiny, Path]) -> None:
    tiny, cases = finished
    assert case.is_done(tiny, cases)
    subprocess.run(["sha256sum", "-c", case.CHECKSUMS], cwd=cases / tiny.name, check=True)


def _truncate(share: float) -> Callable[[Path], None]:
    def harm(path: Path) -> None:
        os.truncate(path, int(path.stat().st_size * share))

    return harm


def _garbage(path: Path) -> None:
    path.write_bytes(b"\x00\xff{]")


def _directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


HARMS = [*(_truncate(share) for share in (0, 0.25, 0.5, 0.75, 0.99)), _garbage, _directory]


@pytest.mark.parametrize("name", [case.IDENTITY, case.DONE, "result.txt"])
@pytest.mark.parametrize("harm", HARMS)
def test_a_harmed_case_is_not_done(
    finished: tuple[Tiny, Path], name: str, harm: Callable[[Path], None]
) -> None:
    tiny, cases = finished
    harm(cases / tiny.name / name)
    assert not case.is_done(tiny, cases)
    case.prepare(tiny, cases)  # and it can be made again


def test_a_file_is_read_again_only_if_its_time_or_size_has_changed(
    finished: tuple[Tiny, Path],
) -> None:
    tiny, cases = finished
    result = cases / tiny.name / "result.txt"
    before = result.stat()
    os.utime(cases / tiny.name / case.DONE, ns=(before.st_mtime_ns + 1, before.st_mtime_ns + 1))
    result.write_text("24\n")
    assert not case.is_done(tiny, cases)
    os.utime(result, ns=(before.st_mtime_ns, before.st_mtime_ns))
    assert case.is_done(tiny, cases)
    # as old as the marker: it may have been changed after it in the same tick of the clock
    os.utime(cases / tiny.name / case.DONE, ns=(before.st_mtime_ns, before.st_mtime_ns))
    assert not case.is_done(tiny, cases)
    result.write_text("42\n")
    assert case.is_done(tiny, cases)


def test_output_is_logged_and_the_exit_code_known(tmp_path: Path) -> None:
    log = tmp_path / "log"
    command = ["sh", "-c", "echo out; echo err >&2; exit 3"]
    ended = process.run(command, cwd=tmp_path, log=log, limit_s=10)
    assert (ended.returncode, ended.timed_out) == (3, False)
    assert log.read_text() == "out\nerr\n"


def _gone(pid: int) -> bool:
    for _ in range(100):
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except FileNotFoundError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False


FAMILY = "sleep 60 & echo $! >child; trap '' TERM; wait; wait"


def test_a_hung_program_is_killed_with_all_it_started(tmp_path: Path) -> None:
    ended = process.run(["sh", "-c", FAMILY], cwd=tmp_path, log=tmp_path / "log", limit_s=0.3)
    assert ended.timed_out
    assert _gone(int((tmp_path / "child").read_text()))


def test_a_stop_ends_the_program(tmp_path: Path) -> None:
    stop = threading.Event()
    threading.Timer(0.3, stop.set).start()
    with pytest.raises(Interrupted):
        process.run(["sh", "-c", FAMILY], cwd=tmp_path, log=tmp_path / "log", limit_s=30, stop=stop)
    assert _gone(int((tmp_path / "child").read_text()))


def test_a_killed_driver_leaves_no_orphan(tmp_path: Path) -> None:
    script = (
        "from pathlib import Path; from orchestrator.runs import process;"
        "process.run(['sh', '-c', 'echo $$ >pid; exec sleep 60'], cwd=Path('.').absolute(),"
        " log=Path('log').absolute(), limit_s=60)"
    )
    root = Path(__file__).parents[2]
    driver = subprocess.Popen(
        [sys.executable, "-c", script], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(root)}
    )
    pid = tmp_path / "pid"
    for _ in range(200):
        if pid.is_file() and pid.read_text().strip():
            break
        time.sleep(0.05)
    driver.kill()
    driver.wait()
    assert _gone(int(pid.read_text()))
