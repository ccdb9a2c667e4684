"""Case directories: identity, and state that is never trusted half-written."""

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from orchestrator.runs import case
from orchestrator.runs.case import Case, templates


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
    for path in (templates() / "liggghts/checks").iterdir():
        assert (directory / path.name).read_bytes() == path.read_bytes()
    identity = json.loads((directory / case.IDENTITY).read_text())
    assert identity["parameters"] == {"size": 1.0}
    assert "input.txt" in identity["inputs_sha256"]
    assert not case.done_state(Tiny(1.0), tmp_path)


def test_a_finished_case_is_done_and_its_checksums_hold(finished: tuple[Tiny, Path]) -> None:
    tiny, cases = finished
    assert case.done_state(tiny, cases)
    subprocess.run(["sha256sum", "-c", case.CHECKSUMS], cwd=cases / tiny.name, check=True)


def test_a_file_is_read_again_only_if_its_time_or_size_has_changed(
    finished: tuple[Tiny, Path],
) -> None:
    tiny, cases = finished
    result = cases / tiny.name / "result.txt"
    before = result.stat()
    os.utime(cases / tiny.name / case.DONE, ns=(before.st_mtime_ns + 1, before.st_mtime_ns + 1))
    result.write_text("24\n")
    assert not case.done_state(tiny, cases)
    os.utime(result, ns=(before.st_mtime_ns, before.st_mtime_ns))
    assert case.done_state(tiny, cases)
    # as old as the marker: it may have been changed after it in the same tick of the clock
    os.utime(cases / tiny.name / case.DONE, ns=(before.st_mtime_ns, before.st_mtime_ns))
    assert not case.done_state(tiny, cases)
    result.write_text("42\n")
    assert case.done_state(tiny, cases)
