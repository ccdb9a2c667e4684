"""Cases in a pool: what one of them does wrong, the others do not pay for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from orchestrator.runs import case, engine
from orchestrator.runs.case import Case
from orchestrator.runs.engine import Outcome


@dataclass(frozen=True)
class Division(Case):
    """A case whose program divides 42 by a number, which the reading of its result does again."""

    by: int
    kind: ClassVar[str] = "division"
    template: ClassVar[str] = "liggghts/checks"
    recipe: ClassVar[int] = 1
    results: ClassVar[tuple[str, ...]] = ("result.txt",)

    @property
    def parameters(self) -> dict[str, Any]:
        return {"by": self.by}

    @property
    def cost_s(self) -> float:
        return 1.0

    def write(self, directory: Path, cases: Path) -> None:
        (directory / "Allrun").write_text(f"#!/bin/sh\necho $((42/{self.by})) > result.txt\n")
        (directory / "Allrun").chmod(0o755)

    def collect(self, directory: Path) -> None:
        assert (directory / "result.txt").is_file()
        42 // (self.by - 6)

    def versions(self) -> dict[str, str]:
        return {}


def test_a_fault_of_the_program_loses_one_case_and_says_where_it_is(tmp_path: Path) -> None:
    todo = {one.name: one for one in map(Division, (2, 6, 7))}
    told: list[Outcome] = []
    with engine.local(tmp_path, workers=2, limit_s=60.0) as pool:
        failed = engine.run(todo, pool, told.append)
    assert list(failed) == [Division(6).name]
    (error,) = failed.values()
    assert "a fault of this program: ZeroDivisionError" in str(error)
    assert "test_engine.py, line" in str(error)
    assert len(told) == 3
    assert all(case.is_done(one, tmp_path) == (one.by != 6) for one in todo.values())
