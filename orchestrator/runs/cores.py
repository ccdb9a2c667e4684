"""The cores of this machine, which solvers take in turn."""

import contextlib
import threading
from collections.abc import Iterator


class Cores:
    """So many cores, of which a solver takes one or several while it runs.

    Who asks first is served first: a solver that needs two cores does not wait for ever while
    others take each single one that falls free.

    Parameters
    ----------
    count : int
        How many there are.
    """

    def __init__(self, count: int) -> None:
        self._count = self._free = count
        self._queue = threading.Lock()
        self._changed = threading.Condition()

    @contextlib.contextmanager
    def held(self, wanted: int) -> Iterator[None]:
        """Hold as many cores as are wanted, or all where there are fewer."""
        taken = min(wanted, self._count)
        with self._queue, self._changed:
            self._changed.wait_for(lambda: self._free >= taken)
            self._free -= taken
        try:
            yield
        finally:
            with self._changed:
                self._free += taken
                self._changed.notify()
