"""Finished cases are reused only where the code as it is now would make the same."""

import importlib
import json
import pkgutil
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orchestrator
from orchestrator import plan
from orchestrator.grains import motion
from orchestrator.physics import laws
from orchestrator.runs import case as case_states
from orchestrator.runs import files
from orchestrator.study import study
from tests.small_study import run

TEXT = """
grain = { diameter = 1e-3 }
threshold.fractions = [0.1]
method.kind = "dem"
forces = { law = "profile" }

[bed]
kind = "pile"
slope_deg = 25.0
height = 0.006

[method.grains]
stiffness = 1e3
mobile_layers = 1
load_increment = 0.1
final_fraction = 0.1

[[group]]
name = "waves"
method.flow.model = "waves"
[[group]]
name = "solved"
method.flow.cells_per_face = 20
"""


def _kinds_done(cases: Path) -> list[str]:
    """The kinds of the cases that are done as a new plan sees them."""
    planned = plan.make(study.parse(TEXT, name="small", where="test"), cases=cases)
    return sorted(name.partition("-")[0] for name in planned.done(cases))


@pytest.mark.filterwarnings("ignore:.*load steps 10%")
def test_other_code_of_the_same_recipe_does_not_get_old_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = run(tmp_path, TEXT)
    cases = tmp_path / "cases"
    everything = ["flow", "pile", "pile"]
    assert _kinds_done(cases) == everything

    # other code that makes the same: the cases are kept, and it is noted
    monkeypatch.setattr(case_states, "code_digest", lambda: "other code")
    monkeypatch.setattr("orchestrator.runs.reuse.code_digest", lambda: "other code")
    assert _kinds_done(cases) == everything
    for directory in cases.glob("*-*"):
        about = json.loads((directory / case_states.IDENTITY).read_text())
        assert about[case_states.CODE] == "other code"

    # a drag twice as large is in no name of a case, and in the inputs of the piles
    drag = laws.Profile.drag
    monkeypatch.setattr(
        laws.Profile, "drag", lambda *given: np.multiply(2, drag(*given))
    )
    monkeypatch.setattr("orchestrator.runs.reuse.code_digest", lambda: "a law")
    monkeypatch.setattr(case_states, "code_digest", lambda: "a law")
    with pytest.warns(UserWarning, match="2 cases were made by other code"):
        assert _kinds_done(cases) == ["flow"]
    with pytest.warns(UserWarning, match="2 cases were made by other code"):
        after = run(tmp_path, TEXT)
    assert _kinds_done(cases) == everything
    column = (
        "shields_dem" if "shields_dem" in before.tables["pile_threshold"] else "shields"
    )
    ratio = (
        after.tables["pile_threshold"][column] / before.tables["pile_threshold"][column]
    )
    assert (ratio < 0.7).all()


def _called(monkeypatch: pytest.MonkeyPatch, digest: str) -> None:
    """Let the code have a digest."""
    monkeypatch.setattr(case_states, "code_digest", lambda: digest)
    monkeypatch.setattr("orchestrator.runs.reuse.code_digest", lambda: digest)


def _made_by(cases: Path) -> dict[str, str]:
    """The digest of the code that is noted in each case, by its kind."""
    made = {}
    for directory in cases.glob("*-*"):
        about = json.loads((directory / case_states.IDENTITY).read_text())
        made[about["kind"]] = about[case_states.CODE]
    return made


@pytest.mark.filterwarnings("ignore:.*load steps 10%")
def test_tables_of_a_pruned_case_are_never_taken_for_those_of_other_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases = tmp_path / "cases"
    one = TEXT.replace('[[group]]\nname = "waves"\nmethod.flow.model = "waves"\n', "")
    before = run(tmp_path, one)
    for case in before.plan.cases.values():
        case_states.prune(case, cases)
    made = _made_by(cases)

    def done() -> list[str]:
        planned = plan.make(study.parse(one, name="small", where="test"), cases=cases)
        return sorted(name.partition("-")[0] for name in planned.done(cases))

    assert done() == ["flow", "pile"]

    # a reader that finds other motions: the tables of before are not its own
    read = motion.read

    def mended(*given: Any, **named: Any) -> motion.Motion:
        found = read(*given, **named)
        return replace(found, fallen=found.fallen + 1)

    monkeypatch.setattr(motion, "read", mended)
    _called(monkeypatch, "a mended reader")
    said = "2 of them were pruned, so that nothing is left to compare"
    with pytest.warns(UserWarning, match=said):
        assert done() == []
    assert _made_by(cases) == made
    with pytest.warns(UserWarning, match=said):
        run(tmp_path, one)
    assert done() == ["flow", "pile"]
    assert set(_made_by(cases).values()) == {"a mended reader"}


def _modules_of_the_makers() -> set[str]:
    """The modules of the package that are imported with those that make cases."""
    code = """
import importlib, pkgutil, sys
import orchestrator
from orchestrator.runs.case import MAKERS
for part in MAKERS:
    if part.endswith(".py"):
        continue
    package = importlib.import_module(f"orchestrator.{part}")
    for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(one.name)
print(*(name for name in sys.modules if name.startswith("orchestrator.")))
"""
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return set(ended.stdout.split())


def _kinds_of(base: type[Any]) -> Iterator[type[Any]]:
    for kind in base.__subclasses__():
        yield kind
        yield from _kinds_of(kind)


def test_every_file_that_a_case_is_made_by_is_in_the_digest_of_the_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modules = _modules_of_the_makers()
    assert {"orchestrator.digits", "orchestrator.runs.case"} <= modules
    for one in pkgutil.walk_packages(orchestrator.__path__, "orchestrator."):
        if not one.name.endswith("__main__"):
            importlib.import_module(one.name)
    modules |= {kind.__module__ for kind in _kinds_of(case_states.Case)}
    package = tmp_path / "orchestrator"
    shutil.copytree(files.PACKAGE, package)
    monkeypatch.setattr(case_states, "PACKAGE", package)

    def digest() -> str:
        case_states.code_digest.cache_clear()
        return case_states.code_digest()

    changed = []
    for name in sorted(modules):
        if name.startswith("orchestrator."):
            place = package.joinpath(*name.split(".")[1:])
            changed.append(
                place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
            )
    # tables of numbers that the forces are made of
    changed += [
        *(package / "physics").glob("*.csv"),
        package / "study" / "fidelities.toml",
    ]
    unnoticed = []
    for path in changed:
        before, content = digest(), path.read_bytes()
        path.write_bytes(content + b"\n")
        if digest() == before:
            unnoticed.append(path.name)
        path.write_bytes(content)
    case_states.code_digest.cache_clear()
    assert len(changed) > 40
    assert unnoticed == []
