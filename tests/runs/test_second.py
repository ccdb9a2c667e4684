"""Pieces of work shared with a second process: all done, in order, whatever becomes of it."""

import os
import signal
from pathlib import Path

import pytest

from orchestrator.runs import processors, second
from tests.waiting import pause, until


@pytest.fixture(autouse=True)
def _two_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processors, "usable_count", lambda: 2)


def test_each_piece_is_done_in_its_place(tmp_path: Path) -> None:
    def work(number: int) -> tuple[int, int]:
        with (tmp_path / str(number)).open("x"):
            pause()
        return number, os.getpid()

    found = second.shared(work, 9)
    assert [number for number, _ in found] == [*range(9)]
    assert os.getpid() in {process for _, process in found}


def test_two_processes_share_them(tmp_path: Path) -> None:
    def work(number: int) -> int:
        """Pieces 0 and 1 wait for each other."""
        (tmp_path / str(number)).touch()
        if number < 2:
            until((tmp_path / str(1 - number)).exists)
        return os.getpid()

    assert len({*second.shared(work, 2)}) == 2


def test_with_one_processor_there_is_one_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(processors, "usable_count", lambda: 1)
    assert {*second.shared(lambda _: os.getpid(), 4)} == {os.getpid()}


def test_pieces_of_a_process_that_dies_are_done(tmp_path: Path) -> None:
    first = os.getpid()

    def work(number: int) -> int:
        """The second process dies on its first piece; the first waits until it has."""
        if os.getpid() != first:
            (tmp_path / "died").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        until((tmp_path / "died").exists)
        return number

    assert second.shared(work, 5) == [*range(5)]


def test_a_piece_that_fails_there_is_done_here_without_a_word(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    first = os.getpid()

    def work(number: int) -> int:
        if os.getpid() != first:
            (tmp_path / "failed").touch()
            raise MemoryError
        until((tmp_path / "failed").exists)
        return number

    assert second.shared(work, 5) == [*range(5)]
    assert capfd.readouterr() == ("", "")


def test_a_failure_here_ends_the_second_process(tmp_path: Path) -> None:
    first = os.getpid()

    def work(number: int) -> int:
        if os.getpid() == first:
            until((tmp_path / "begun").exists)
            raise MemoryError
        (tmp_path / "begun").write_text(str(os.getpid()))
        signal.pause()
        return number

    with pytest.raises(MemoryError):
        second.shared(work, 4)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "begun").read_text()), 0)
