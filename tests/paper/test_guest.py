"""The paper is a guest: its own studies get a report card, and nothing else knows of it."""

import ast
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import paper, report
from orchestrator.report.results import Results
from orchestrator.runs.folder import Folder
from orchestrator.study import study

PACKAGE = Path(paper.__file__).parents[1]


def imported(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
    return found


def test_only_the_command_line_and_the_python_face_import_it() -> None:
    theirs = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "paper" not in path.relative_to(PACKAGE).parts
        and any(name.startswith("orchestrator.paper") for name in imported(path))
    }
    assert theirs == {"cli.py", "face.py"}


def test_the_engine_knows_no_preset_of_the_paper() -> None:
    assert {"paper", "reference"} & set(study.presets()) == set()
    assert {"paper", "reference", "first-look"} <= set(study.presets([paper.PRESETS]))


@pytest.mark.parametrize("name", ["paper", "reference"])
def test_its_presets_are_studies(name: str) -> None:
    assert study.load(name, [paper.PRESETS]).scenes


def written(results: Results, text: str, out: Path) -> set[str]:
    (out / "cases").mkdir()
    grains = {name: results.tables[name] for name in ("scenes", "single_grain")}
    asked = replace(results.study, text=text)
    guests = (paper.report_card,)
    report.write(asked, results.plan, grains, pd.DataFrame(), {}, Folder(out), guests)
    return {path.name for path in out.iterdir()}


def test_a_study_of_the_paper_gets_a_report_card(results: Results, tmp_path: Path) -> None:
    text = (paper.PRESETS / "paper.toml").read_text(encoding="utf-8")
    assert paper.CLAIMS in written(results, text, tmp_path)
    assert 'id="claims"' in (tmp_path / report.PAGE).read_text(encoding="utf-8")
    table = pd.read_csv(tmp_path / paper.CLAIMS)
    assert set(table["verdict"]) > {"no data"}


def test_any_other_study_gets_none(results: Results, tmp_path: Path) -> None:
    assert paper.CLAIMS not in written(results, results.study.text, tmp_path)
    assert "claims" not in (tmp_path / report.PAGE).read_text(encoding="utf-8")
