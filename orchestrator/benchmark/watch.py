"""The pack, and the answers that are there: no solver may touch them."""

import contextlib
from pathlib import Path

from orchestrator.benchmark import answer
from orchestrator.benchmark.answer import FILE, AnswerError
from orchestrator.benchmark.pack import Pack
from orchestrator.errors import InputError
from orchestrator.runs.files import Folder

Mark = tuple[int, int, int]
"""When a file was written, when it was changed at all, and how long it is."""


class Watch:
    """Sees whether a pack or answers have changed; answers are put back.

    Parameters
    ----------
    pack : Pack
        The pack.
    results : Folder
        The directory of all answers.
    """

    def __init__(self, pack: Pack, results: Folder) -> None:
        self.pack, self.results = pack, results
        self.given = self._marks()
        self.answers: dict[str, bytes] = {}
        for path in (*results.root.glob(f"*/{FILE}"), *results.root.glob(f"*/*/{FILE}")):
            name = path.relative_to(results.root).as_posix()
            if (content := self._read(name)) is not None:
                self.answers[name] = content

    def forget(self, name: str) -> None:
        """Let an answer be written anew."""
        self.answers.pop(name, None)

    def keep(self, name: str, content: bytes) -> None:
        """Write an answer, and watch over it from now on."""
        self.results.note(name, content)
        self.answers[name] = content

    def harm(self) -> str:
        """How the pack was changed, or nothing."""
        try:
            changed = {name for name, _ in set(self._marks().items()) ^ set(self.given.items())}
        except (InputError, OSError) as error:
            return f"it changed the pack: {error}"
        return f"it changed {min(changed)} of the pack" if changed else ""

    def restored(self) -> str:
        """Put answers back that were changed; says which, or nothing."""
        changed = [name for name, content in self.answers.items() if self._read(name) != content]
        for name in changed:
            # what was put in its place may be a link, which is not to be followed
            with contextlib.suppress(OSError):
                self._place(name).unlink()
            self.results.note(name, self.answers[name])
        names = ", ".join(name.split("/")[-2] for name in changed)
        return f"it changed the answer of {names}, which was put back" if changed else ""

    def _place(self, name: str) -> Path:
        """Where an answer is, by directories that no link leads out of."""
        return self.results.path(name.rpartition("/")[0]) / FILE

    def _read(self, name: str) -> bytes | None:
        try:
            return answer.content(self._place(name))
        except AnswerError:
            return None

    def _marks(self) -> dict[str, Mark]:
        root = self.pack.root
        states = {path.relative_to(root).as_posix(): path.lstat() for path in self.pack.files()}
        return {n: (s.st_mtime_ns, s.st_ctime_ns, s.st_size) for n, s in states.items()}
