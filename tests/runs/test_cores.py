"""Solvers take no more cores than there are, and none waits for ever."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.runs.cores import Cores


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 4), st.lists(st.integers(1, 3), min_size=1, max_size=12))
def test_never_more_than_there_are(count: int, wanted: list[int]) -> None:
    cores, lock = Cores(count), threading.Lock()
    taken, most = 0, 0

    def solve(one: int) -> None:
        nonlocal taken, most
        with cores.held(one):
            with lock:
                taken += min(one, count)
                most = max(most, taken)
            with lock:
                taken -= min(one, count)

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(solve, wanted))
    assert most <= count
    assert taken == 0


def test_a_large_one_is_served_before_those_that_ask_later() -> None:
    cores, served = Cores(2), []

    def solve(name: str, wanted: int) -> None:
        with cores.held(wanted):
            served.append(name)

    with cores.held(1):
        large = threading.Thread(target=solve, args=("large", 2))
        large.start()
        while not cores._queue.locked():
            pass
        small = threading.Thread(target=solve, args=("small", 1))
        small.start()
        # one core is free, but the large one asked first
        small.join(timeout=0.2)
        assert served == []
    large.join()
    small.join()
    assert served == ["large", "small"]


def test_a_failure_gives_its_cores_back() -> None:
    cores = Cores(1)
    with pytest.raises(ValueError, match="lost"), cores.held(1):
        raise ValueError("lost")
    with cores.held(1):
        pass
