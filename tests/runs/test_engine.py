"""Cases and their pool: identity, order, cores, the time left, and what a fault costs."""

import json
import os
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from orchestrator.errors import SolverError
from orchestrator.runs import case, engine
from orchestrator.runs.case import Case, templates
from orchestrator.runs.engine import Cores, Display, Pool
from tests.waiting import HANGS_S, until


@dataclass(frozen=True)
class Step(Case):
    """A case whose program divides 42 by a number, as the reading of its result does."""

    size: float
    after: tuple[Case, ...] = ()
    by: int = 1
    kind: ClassVar[str] = "step"
    template: ClassVar[str] = "liggghts/checks"
    results: ClassVar[tuple[str, ...]] = ("result.txt",)

    @property
    def parameters(self) -> dict[str, Any]:
        return {"size": self.size, "by": self.by}

    @property
    def cost_s(self) -> float:
        return self.size

    @property
    def needs(self) -> tuple[Case, ...]:
        return self.after

    def write(self, directory: Path, cases: Path) -> None:
        (directory / "Allrun").write_text(f"echo $((42/{self.by})) > result.txt\n")

    def collect(self, directory: Path) -> None:
        if not (directory / "result.txt").is_file():
            raise SolverError("no result")
        42 // (self.by - 6)

    def versions(self) -> dict[str, str]:
        return {}


def test_a_case_is_a_copy_of_its_template_with_inputs_and_then_results(
    tmp_path: Path,
) -> None:
    step = Step(1.0)
    assert step.id == Step(1.0).id != Step(2.0).id
    directory = case.prepare(step, tmp_path)
    assert directory.name == step.name == f"step-{step.id[:12]}"
    template = templates() / "liggghts/checks"
    names = (template / case.FILES).read_text().split()
    assert names
    for name in names:
        assert (directory / name).read_bytes() == (template / name).read_bytes()
    identity = json.loads((directory / case.IDENTITY).read_text())
    assert identity["parameters"] == {"size": 1.0, "by": 1}
    assert "Allrun" in identity["inputs_sha256"]
    assert not case.done_state(step, tmp_path)
    engine.execute(step, tmp_path, HANGS_S)
    assert case.done_state(step, tmp_path)
    subprocess.run(["sha256sum", "-c", case.CHECKSUMS], cwd=directory, check=True)
    # it is read again only if its time or size has changed
    result, marker = directory / "result.txt", directory / case.DONE
    then = result.stat().st_mtime_ns
    os.utime(marker, ns=(then + 1, then + 1))
    result.write_text("24\n")
    assert not case.done_state(step, tmp_path)
    os.utime(result, ns=(then, then))
    assert case.done_state(step, tmp_path)
    # as old as the marker: it may have been changed after it in the same tick of the clock
    os.utime(marker, ns=(then, then))
    assert not case.done_state(step, tmp_path)


def test_a_case_is_another_after_other_cases() -> None:
    """Its inputs are made of their results: the same words over another flow are another run."""
    alone, after, after_another = (
        Step(1.0, needs).id for needs in ((), (Step(2.0),), (Step(3.0),))
    )
    assert len({alone, after, after_another}) == 3
    # also where what it needs differs in what that one needs
    deeper = Step(1.0, (Step(2.0, (Step(4.0),)),)).id
    assert deeper not in {alone, after, after_another}


def _order(places: int, *cases: Case) -> list[Case]:
    """Cases in the order in which a pool without solvers starts them."""
    started: list[Case] = []

    def task(step: Case) -> float:
        started.append(step)
        return step.cost_s

    with ThreadPoolExecutor(1) as threads:
        todo = {step.name: step for step in cases}
        assert not engine.run(todo, Pool(threads, task, places), lambda *_: None)
    return started


def test_the_most_expensive_chain_comes_first_and_a_case_after_its_needs() -> None:
    shared = Step(1.0)
    dear, cheap, single = Step(50.0, (shared,)), Step(2.0, (shared,)), Step(30.0)
    assert _order(1, cheap, single, dear, shared) == [shared, dear, single, cheap]
    first, second, done = Step(1.0), Step(2.0), Step(3.0)
    both = Step(4.0, (first, second, done))
    assert _order(3, both, first, second)[-1] == both


def test_a_failure_costs_the_cases_that_need_it_and_no_others(tmp_path: Path) -> None:
    fault, lost = Step(1.0, by=6), Step(2.0, by=0)
    second = Step(3.0, (lost,))
    third, fine = Step(4.0, (second,)), Step(5.0, by=7)
    ended: list[str] = []
    todo = {step.name: step for step in (fault, lost, second, third, fine)}
    with engine.local(tmp_path, workers=2, limit_s=HANGS_S) as pool:
        failed = engine.run(todo, pool, lambda step, *_: ended.append(step.name))
    assert failed.keys() == {step.name for step in (fault, lost, second, third)}
    assert "a fault of this program: ZeroDivisionError" in str(failed[fault.name])
    assert f"it needs {lost.name}, which failed" in str(failed[second.name])
    assert case.failure(tmp_path / lost.name) == ("failed", "no result")
    assert sorted(ended) == sorted(todo)
    assert case.done_state(fine, tmp_path)


@dataclass(frozen=True)
class Ends(Step):
    """A case whose program leaves a whole result and ends with an exit code."""

    def write(self, directory: Path, cases: Path) -> None:
        (directory / "Allrun").write_text(f"echo 42 > result.txt\nexit {self.by}\n")


@pytest.mark.parametrize("code", [1, 3, 137])
def test_an_exit_code_is_a_failure_though_there_are_results(
    tmp_path: Path, code: int
) -> None:
    ended = Ends(1.0, by=code)
    with pytest.raises(SolverError, match=rf"\./Allrun ended with {code}\b"):
        engine.execute(ended, tmp_path, HANGS_S)
    assert (tmp_path / ended.name / "result.txt").read_text() == "42\n"
    assert not case.done_state(ended, tmp_path)
    state, said = case.failure(tmp_path / ended.name)
    assert state == "failed"
    assert f"ended with {code}" in said


def test_a_solver_beyond_its_time_is_a_failure(tmp_path: Path) -> None:
    """Whatever it has written so far; what it left is not taken for an answer."""
    slow = Sleeps(1.0)
    limit_s = 0.2
    with pytest.raises(SolverError, match=r"did not end within 0\.2 s"):
        engine.execute(slow, tmp_path, limit_s=limit_s)
    assert not case.done_state(slow, tmp_path)


@dataclass(frozen=True)
class Sleeps(Step):
    """A case whose program leaves a whole result and goes on for ever."""

    def write(self, directory: Path, cases: Path) -> None:
        script = f"echo 42 > result.txt\nexec sleep {HANGS_S}\n"
        (directory / "Allrun").write_text(script)


def test_the_time_left_follows_the_pace_of_the_cases_so_far(tmp_path: Path) -> None:
    first, second, third = Step(10.0), Step(20.0), Step(400.0)
    display = Display(tmp_path, workers=2, after_s=20.0)
    display.add([first, second, third])
    assert display.left_s == pytest.approx(430 / 2 + 20)
    display(first, 5.0, None)
    assert display.left_s == pytest.approx(0.5 * 420 / 2 + 20)
    assert display.done == pytest.approx(1 - 230 / 235)
    display(third, 0.0, SolverError("died"))
    assert display.left_s == pytest.approx(0.5 * 20 / 2 + 20)
    display(second, 10.0, None)
    assert display.done == pytest.approx(1 - 20 / 235)


def test_one_bar_goes_from_the_first_case_to_the_last_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where cases are found to be missing when all others have ended."""
    first, found = Step(60.0), Step(30.0)
    display = Display(tmp_path, workers=1, after_s=40.0)
    display.add([first])
    shares = [display.done]
    display(first, 60.0, None)
    shares.append(display.done)
    assert shares == pytest.approx([0.0, 0.6])
    display.add([found])
    # what is left is 70 s now, and was 40 s
    assert (display.done, display.left_s) == pytest.approx((0.6, 70.0))
    display(found, 30.0, None)
    assert display.done == pytest.approx(1 - 0.4 * 40 / 70)
    display.drawing(0.0, "tables")
    assert display.left_s == pytest.approx(40.0)
    display.drawing(0.75, "figures")
    assert display.done == pytest.approx(1 - 0.4 * 10 / 70)
    display.end()
    assert (display.done, display.left_s) == (1.0, 0.0)
    said = capsys.readouterr().err.splitlines()
    assert [line.split("  ")[0] for line in said] == [
        "[1/1] done",
        "[2/2] done",
        "drawing tables",
        "drawing figures",
        "all is drawn",
    ]
    assert said[-1] == "all is drawn  100% of the work"


def test_failures_that_are_an_answer_are_counted_and_not_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sought, other = Step(1.0), Step(2.0)
    display = Display(tmp_path, 2, 0.0, failing={other.name})
    display.add([sought, other])
    for step in (sought, other):
        display(step, 1.0, SolverError(f"{step.name} died"))
    said = capsys.readouterr().err
    assert f"{sought.name} died" not in said
    assert f"{other.name} died" in said
    assert "[1/2] failed" in said


def test_a_failure_gives_its_cores_back() -> None:
    """Before the tests of those that wait: without it they wait for ever."""
    cores = Cores(3)
    with pytest.raises(ValueError, match="lost"), cores.held(2):
        raise ValueError("lost")
    with cores.held(1):
        pass
    free = [cores._free.acquire(blocking=False) for _ in range(4)]
    assert free == [True, True, True, False]


class Queue:
    """A lock that counts who has asked for it since it was made."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.asked = 0
        self.locked = self._lock.locked

    def __enter__(self) -> None:
        # one asks after the other here, so that the count needs no lock
        self.asked += 1
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()


def test_a_large_solver_is_served_before_those_that_ask_later() -> None:
    cores, served, queue = Cores(2), [], Queue()

    def solve(name: str, wanted: int) -> None:
        with cores.held(wanted):
            served.append(name)

    threads = [
        threading.Thread(target=solve, args=args)
        for args in (("large", 2), ("small", 1))
    ]
    with cores.held(1):
        cores._queue = queue  # type: ignore[assignment]
        threads[0].start()
        until(queue.locked)
        threads[1].start()
        until(lambda: queue.asked == 2 or not threads[1].is_alive())
        # one core is free, but the large one asked first
        assert served == []
    for thread in threads:
        thread.join()
    assert served == ["large", "small"]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_never_more_cores_are_held_than_there_are(count: int) -> None:
    cores, lock = Cores(count), threading.Lock()
    taken = most = 0

    def solve(wanted: int) -> None:
        nonlocal taken, most
        with cores.held(wanted):
            with lock:
                taken += min(wanted, count)
                most = max(most, taken)
            with lock:
                taken -= min(wanted, count)

    with ThreadPoolExecutor(6) as threads:
        list(threads.map(solve, [1, 2, 5, 1, 3, 2] * 20))
    assert taken == 0
    assert 0 < most <= count
