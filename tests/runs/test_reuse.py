"""Finished cases under other code: their inputs decide, and their tables are made again."""

import importlib
import json
import pkgutil
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator import plan
from orchestrator.flow.case import FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.grains import motion
from orchestrator.grains.pile_case import PileCase
from orchestrator.physics import laws
from orchestrator.runs import case as case_states
from orchestrator.runs import files, reuse
from orchestrator.runs.case import Case
from orchestrator.study import study
from tests.small_study import run
from tests.test_architecture import arrows, reached

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


def _kinds_done(cases: Path, text: str = TEXT) -> list[str]:
    """The kinds of the cases that are done as a new plan sees them."""
    planned = plan.make(study.parse(text, name="small", where="test"), cases=cases)
    return sorted(name.partition("-")[0] for name in reuse.done(planned.cases, cases))


def _called(monkeypatch: pytest.MonkeyPatch, digest: str) -> None:
    """Let the code have a digest."""
    monkeypatch.setattr(case_states, "code_of", lambda kind: digest)
    monkeypatch.setattr(reuse, "code_of", lambda kind: digest)


def _markers(cases: Path) -> dict[str, dict[str, Any]]:
    """The marker of each case, by its name."""
    paths = sorted(cases.glob("*/done.json"))
    return {path.parent.name: json.loads(path.read_text()) for path in paths}


def _made_by(cases: Path) -> set[str]:
    """The digests of the code that is noted in the cases."""
    return {str(marker[case_states.CODE]) for marker in _markers(cases).values()}


def _solved_at(cases: Path) -> dict[str, int]:
    """When each solver last wrote to its log, by the name of the case."""
    paths = sorted(cases.glob(f"*/{case_states.LOG}"))
    return {path.parent.name: path.stat().st_mtime_ns for path in paths}


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the small study, which has run."""
    out = tmp_path_factory.mktemp("reuse")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run(out, TEXT)
    return out


@pytest.fixture
def cases(ran: Path, tmp_path: Path) -> Path:
    """A copy of its cases."""
    return Path(shutil.copytree(ran / "cases", tmp_path / "cases"))


EVERYTHING = ["flow", "pile", "pile"]
pytestmark = pytest.mark.filterwarnings("ignore:.*load steps 10 %")


def test_cases_are_read_again_under_other_code_that_writes_the_same_inputs(
    cases: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before, solved = _markers(cases), _solved_at(cases)
    assert _kinds_done(cases) == EVERYTHING
    assert capsys.readouterr().err == ""
    _called(monkeypatch, "other code")
    planned = plan.make(study.parse(TEXT, name="small", where="test"), cases=cases)
    # who does not hold the directory writes nothing
    assert len(reuse.done(planned.cases, cases, holds=False)) == len(EVERYTHING)
    assert _markers(cases) == before
    assert _kinds_done(cases) == EVERYTHING
    assert "3 cases read again by the present code" in capsys.readouterr().err
    assert _made_by(cases) == {"other code"}
    for name, marker in _markers(cases).items():
        for key in ("results_sha256", "tables_sha256", "solver_s"):
            assert marker[key] == before[name][key]
    assert _kinds_done(cases) == EVERYTHING
    assert capsys.readouterr().err == ""
    assert _solved_at(cases) == solved


def test_a_column_more_is_read_from_finished_cases_and_no_solver_runs(
    cases: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, solved = _markers(cases), _solved_at(cases)
    write_motion, write_stress = motion.Motion.to_csv, WallStress.to_csv

    def with_twice(path: Path, column: str) -> None:
        table = pd.read_csv(path)
        table["twice"] = 2 * table[column]
        table.to_csv(path, index=False)

    def to_motion(self: motion.Motion, directory: Path, *given: Any) -> None:
        write_motion(self, directory, *given)
        with_twice(directory / "motion.csv", "id")

    def to_stress(self: WallStress, path: Path) -> None:
        write_stress(self, path)
        with_twice(path, "x_m")

    monkeypatch.setattr(motion.Motion, "to_csv", to_motion)
    monkeypatch.setattr(WallStress, "to_csv", to_stress)
    _called(monkeypatch, "a column more")
    run(cases.parent, TEXT)
    after = _markers(cases)
    assert sorted(name.partition("-")[0] for name in after) == EVERYTHING
    for name, marker in after.items():
        table = "wall_stress.csv" if name.startswith("flow") else "motion.csv"
        assert "twice" in pd.read_csv(cases / name / table)
        assert marker["tables_sha256"][table] != before[name]["tables_sha256"][table]
        assert marker["results_sha256"] == before[name]["results_sha256"]
    assert _solved_at(cases) == solved


def test_other_inputs_of_the_same_question_run_again(
    cases: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved = _solved_at(cases)
    before = run(cases.parent, TEXT)
    # a drag twice as large is in no name of a case, and in the inputs of the piles
    law = laws.ProfileLaw
    drag = law.drag
    monkeypatch.setattr(law, "drag", lambda *given: np.multiply(2, drag(*given)))
    _called(monkeypatch, "a law")
    said = "2 cases made by other code of this program, which now makes other inputs"
    with pytest.warns(UserWarning, match=said):
        assert _kinds_done(cases) == ["flow"]
    with pytest.warns(UserWarning, match=said):
        after = run(cases.parent, TEXT)
    assert _kinds_done(cases) == EVERYTHING
    again = {name for name, time in _solved_at(cases).items() if time > solved[name]}
    assert {name.partition("-")[0] for name in again} == {"pile"}
    thresholds = (each.tables["pile_threshold"] for each in (after, before))
    column = "shields_dem" if "shields_dem" in before.tables["pile_threshold"] else ""
    new, old = (table[column or "shields"] for table in thresholds)
    assert (new / old < 0.7).all()


def test_tables_of_a_pruned_case_are_never_taken_for_those_of_other_code(
    cases: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned = plan.make(study.parse(TEXT, name="small", where="test"), cases=cases)
    for case in planned.cases.values():
        case_states.prune_case(case, cases)
    before, solved = _markers(cases), _solved_at(cases)
    assert _kinds_done(cases) == EVERYTHING

    # a reader that finds other motions: the tables of before are not its own
    read = motion.read_motion

    def mended(*given: Any, **named: Any) -> motion.Motion:
        found = read(*given, **named)
        return replace(found, fallen=found.fallen + 1)

    monkeypatch.setattr(motion, "read_motion", mended)
    _called(monkeypatch, "a mended reader")
    said = "3 cases made by other code of this program; 3 of them were pruned and"
    with pytest.warns(UserWarning, match=said):
        assert _kinds_done(cases) == []
    assert _markers(cases) == before
    with pytest.warns(UserWarning, match=said):
        run(cases.parent, TEXT)
    assert _kinds_done(cases) == EVERYTHING
    assert _made_by(cases) == {"a mended reader"}
    again = [name for name, time in _solved_at(cases).items() if time > solved[name]]
    assert len(again) == len(EVERYTHING)


@pytest.mark.parametrize("how", ["removed", "garbage"])
def test_a_harmed_table_is_read_again_and_a_harmed_result_is_made_again(
    cases: Path, how: str
) -> None:
    before, solved = _markers(cases), _solved_at(cases)
    for path in (*cases.glob("*/motion.csv"), *cases.glob("*/wall_stress.csv")):
        path.unlink() if how == "removed" else path.write_text("x")
    assert _kinds_done(cases) == EVERYTHING
    for name, marker in _markers(cases).items():
        assert marker["tables_sha256"] == before[name]["tables_sha256"]
    assert _solved_at(cases) == solved

    first, second = sorted(cases.glob("pile-*"))
    result = first / "samples.csv"
    result.unlink() if how == "removed" else result.write_text("x")
    assert _kinds_done(cases) == ["flow", "pile"]
    # a table of a case whose results were pruned has nothing to be made of
    (second / "bed.dump").unlink()
    (second / "motion.csv").write_text("x")
    with pytest.warns(UserWarning, match="1 case made by .*; 1 of them were pruned"):
        assert _kinds_done(cases) == ["flow"]
    with pytest.warns(UserWarning, match="1 case made by .*; 1 of them were pruned"):
        run(cases.parent, TEXT)
    assert _kinds_done(cases) == EVERYTHING
    for name, marker in _markers(cases).items():
        assert marker["tables_sha256"] == before[name]["tables_sha256"]


@pytest.fixture
def own_templates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the templates, which the cases start from."""
    folder = Path(shutil.copytree(case_states.templates(), tmp_path / "templates"))
    monkeypatch.setattr(case_states, "templates", lambda: folder)
    yield folder
    _forget()


def _forget() -> None:
    """Let templates and code be read anew."""
    case_states.template_files.cache_clear()
    case_states.code_of.cache_clear()


def test_a_changed_template_runs_again_and_what_lies_beside_it_does_not_matter(
    cases: Path, own_templates: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bed = own_templates / "liggghts" / "bed"
    digest = case_states.code_of(PileCase)
    for name in ("foo.txt", "1/U", "samples.csv"):
        (bed / name).parent.mkdir(exist_ok=True)
        (bed / name).write_text("left by a run by hand\n")
    _forget()
    assert case_states.code_of(PileCase) == digest
    assert _kinds_done(cases) == EVERYTHING
    assert capsys.readouterr().err == ""

    listed = bed / case_states.FILES
    listed.write_text(f"{listed.read_text()}foo.txt\n")
    _forget()
    with pytest.warns(UserWarning, match="2 cases made by other code"):
        assert _kinds_done(cases) == ["flow"]
    with pytest.warns(UserWarning, match="2 cases made by other code"):
        run(cases.parent, TEXT)
    assert len([*cases.glob("pile-*/foo.txt")]) == 2
    assert not [*cases.glob("pile-*/1/U")]

    # piles over a flow that runs again are piles over another flow
    solution = own_templates / "openfoam" / "flow" / "system" / "fvSolution"
    before = solution.read_text()
    solution.write_text(f"{before}// another word\n")
    _forget()
    with pytest.warns(UserWarning, match="2 cases made by other code"):
        assert "flow" not in _kinds_done(cases)
    solution.write_text(before)
    _forget()
    assert _kinds_done(cases) == EVERYTHING

    deck = bed / "in.bed"
    deck.write_text(f"# another word\n{deck.read_text()}")
    _forget()
    with pytest.warns(UserWarning, match="2 cases made by other code"):
        assert _kinds_done(cases) == ["flow"]


def test_every_file_of_a_template_is_in_its_list() -> None:
    importlib.import_module("orchestrator.surface.case")
    kinds = {kind for kind in _kinds_of(case_states.Case) if hasattr(kind, "template")}
    folders = {case_states.templates() / kind.template for kind in kinds}
    assert len(folders) >= 3
    for folder in folders:
        ended = subprocess.run(
            ["git", "ls-files"], cwd=folder, capture_output=True, text=True, check=True
        )
        known = {*ended.stdout.split()} - {case_states.FILES}
        listed = (folder / case_states.FILES).read_text().splitlines()
        assert sorted(known) == sorted(listed), folder


def _kinds_of(base: type[Any]) -> Iterator[type[Any]]:
    for kind in base.__subclasses__():
        yield kind
        yield from _kinds_of(kind)


def test_each_file_of_a_template_is_in_the_digest_of_its_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A changed deck or script runs again; the cases of another template do not."""
    root = Path(shutil.copytree(case_states.templates(), tmp_path / "templates"))
    monkeypatch.setattr(case_states, "templates", lambda: root)
    caches = case_states.template_files, case_states.code_of

    def digests() -> dict[type[case_states.Case], str]:
        for cached in caches:
            cached.cache_clear()
        return {kind: case_states.code_of(kind) for kind in (FlowCase, PileCase)}

    before = digests()
    for kind in before:
        folder = root / kind.template
        for name in (folder / case_states.FILES).read_text().split():
            content = (folder / name).read_bytes()
            (folder / name).write_bytes(content + b"\n")
            after = digests()
            (folder / name).write_bytes(content)
            assert {one for one in before if before[one] != after[one]} == {kind}, name
    assert digests() == before
    for cached in caches:
        cached.cache_clear()


def test_every_file_that_a_case_is_made_by_is_in_the_digest_of_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for one in pkgutil.walk_packages(orchestrator.__path__, "orchestrator."):
        if not one.name.endswith("__main__"):
            importlib.import_module(one.name)
    kinds = []
    for kind in _kinds_of(case_states.Case):
        # the module of a private one also draws: such a case has another mesh alone
        is_ours = kind.__module__.startswith("orchestrator.")
        is_whole = hasattr(kind, "template") and not kind.__name__.startswith("_")
        if is_ours and is_whole:
            kinds.append(kind)
    package = tmp_path / "orchestrator"
    shutil.copytree(files.PACKAGE, package)
    monkeypatch.setattr(case_states, "PACKAGE", package)
    for kind in kinds:
        path = package.joinpath(*kind.__module__.split(".")[1:]).with_suffix(".py")
        monkeypatch.setattr(sys.modules[kind.__module__], "__file__", str(path))
    graph: dict[str, set[str]] = {}
    for name, other in arrows():
        graph.setdefault(name, set()).add(other)

    def digest(kind: type[case_states.Case]) -> str:
        case_states.code_of.cache_clear()
        return case_states.code_of(kind)

    def changes(kind: type[case_states.Case], path: Path) -> bool:
        """Whether the digest of a kind of case changes with a file."""
        content = path.read_bytes()
        path.write_bytes(content + b"\n")
        after = digest(kind)
        path.write_bytes(content)
        return after != before[kind]

    before = {kind: digest(kind) for kind in kinds}
    tried = 0
    for kind in kinds:
        paths = []
        for name in (kind.__module__, *reached(kind.__module__, graph)):
            place = package.joinpath(*name.split(".")[1:])
            path = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
            paths.append(path)
        # tables of numbers that the forces are made of
        if "physics" in {path.parent.name for path in paths}:
            paths += (package / "physics").glob("*.csv")
        assert [path.name for path in paths if not changes(kind, path)] == []
        assert not changes(kind, package / "report" / "shields.py")
        tried += len(paths)
    case_states.code_of.cache_clear()
    assert tried > 100
    assert not changes(FlowCase, package / "grains" / "motion.py")


def test_a_directory_that_has_not_the_finished_case_lends_nothing(
    tmp_path: Path,
) -> None:
    wanted = {"flow-a": cast(Case, SimpleNamespace(name="flow-a", id="a"))}
    here, beside = tmp_path / "out" / "cases", tmp_path / "other"
    (beside / "cases" / "flow-a").mkdir(parents=True)
    assert reuse.elsewhere(wanted, here, [beside]) == {}
    assert reuse.taken(wanted, here, [beside]) == 0
