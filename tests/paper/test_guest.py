"""The paper is a guest: its own studies get a report card, and nothing else knows of it."""

import ast
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import paper, report
from orchestrator.paper.claims import CLAIMS
from orchestrator.report.results import Results
from orchestrator.runs.files import Folder
from orchestrator.study import study

PACKAGE = Path(paper.__file__).parents[1]


def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
    return names


def test_only_the_command_line_and_the_python_face_import_it() -> None:
    users = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "paper" not in path.relative_to(PACKAGE).parts
        and any(name.startswith("orchestrator.paper") for name in imported(path))
    }
    assert users <= {"cli.py", "face.py"}


def test_its_presets_are_studies_that_the_package_alone_does_not_bring() -> None:
    assert {"paper", "reference"} & set(study.presets()) == set()
    for name in ("paper", "reference"):
        assert study.load(name, [paper.PRESETS]).scenes


@pytest.mark.parametrize("is_paper", [True, False])
def test_a_study_of_the_paper_alone_gets_a_report_card(
    results: Results, tmp_path: Path, is_paper: bool
) -> None:
    text = (paper.PRESETS / "paper.toml").read_text(encoding="utf-8") if is_paper else "title = ''"
    (tmp_path / "cases").mkdir()
    grains = {name: results.tables[name] for name in ("scenes", "single_grain")}
    asked, guests = replace(results.study, text=text), (paper.report_card,)
    study_ = replace(results, study=asked, tables=grains)
    report.write(study_, pd.DataFrame(), {}, Folder(tmp_path), guests)
    page = (tmp_path / report.PAGE).read_text(encoding="utf-8")
    assert ('id="claims"' in page) == (tmp_path / paper.CLAIMS).exists() == is_paper
    if is_paper:
        table = pd.read_csv(tmp_path / paper.CLAIMS)
        assert len(table) == len(CLAIMS)
        assert set(table["verdict"]) > {"no data"}
