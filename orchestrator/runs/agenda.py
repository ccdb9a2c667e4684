"""The order of a plan's cases: each after what it needs, those that most depends on first."""

import heapq
from collections.abc import Iterator, Mapping

from orchestrator.runs.case import Case


class Agenda:
    """Cases still to be started.

    A case may start once those that it needs have ended. Of these the first is the one with the
    dearest chain of cases to its end: the case itself, one that needs it, and so on.

    Parameters
    ----------
    todo : mapping of str to Case
        By name; what a case needs is either here too or done already.
    """

    def __init__(self, todo: Mapping[str, Case]) -> None:
        self._waiting = dict(todo)
        self._needs = {
            name: {need.name for need in case.needs} & todo.keys() for name, case in todo.items()
        }
        self._users: dict[str, list[str]] = {}
        for name, needs in self._needs.items():
            for need in needs:
                self._users.setdefault(need, []).append(name)
        self._chain: dict[str, float] = {}
        self._ready: list[tuple[float, int, str]] = []
        self._place = {name: place for place, name in enumerate(todo)}
        for name, needs in self._needs.items():
            if not needs:
                self._release(name)

    def __bool__(self) -> bool:
        """Whether any case is still to be started."""
        return bool(self._waiting)

    def next(self) -> Case | None:
        """Take the case to start next; None if all that are left wait for others."""
        return self._waiting.pop(heapq.heappop(self._ready)[2]) if self._ready else None

    def done(self, case: Case) -> None:
        """A case has ended well: those that waited for it alone may start."""
        for user in self._users.get(case.name, ()):
            self._needs[user].discard(case.name)
            if not self._needs[user]:
                self._release(user)

    def lost(self, case: Case) -> Iterator[tuple[Case, Case]]:
        """A case has failed: take out all that cannot start now, each with the need it lost."""
        for user in self._users.get(case.name, ()):
            if user in self._waiting:
                without = self._waiting.pop(user)
                yield without, case
                yield from self.lost(without)

    def _release(self, name: str) -> None:
        heapq.heappush(self._ready, (-self._chain_s(name), self._place[name], name))

    def _chain_s(self, name: str) -> float:
        if name not in self._chain:
            behind = max((self._chain_s(user) for user in self._users.get(name, ())), default=0.0)
            self._chain[name] = self._waiting[name].cost_s + behind
        return self._chain[name]
