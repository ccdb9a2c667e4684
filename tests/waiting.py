"""How tests wait: for what they need to see, and never for a time."""

import time
from collections.abc import Callable

HANGS_S = 3600.0
"""Time after which something is taken to hang, s: no machine that works is so slow.

It ends a test that would wait for ever, and no test waits for it.
"""
_LOOK_S = 0.005
"""Time between two looks, s."""


def until(seen: Callable[[], object], goes_on: Callable[[], object] = bool) -> None:
    """Wait until something is seen; `goes_on` raises where it can no longer come."""
    ends_at = time.monotonic() + HANGS_S
    while not seen():
        goes_on()
        assert time.monotonic() < ends_at, "waited in vain"
        time.sleep(_LOOK_S)


def pause() -> None:
    """Let other processes run between two tries."""
    time.sleep(_LOOK_S)
