"""Scripts and programs read and write numbers alike where the decimal sign is a comma.

A terminal in most countries has such a locale. It is made here, of a few lines, since a
bare Debian has none; ``localedef`` is a part of the C library there.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from orchestrator.runs.case import templates
from tests.benchmark.conftest import NATIVE, ROOT

CHARACTERS = """<code_set_name> ASCII
<comment_char> %
<escape_char> /
CHARMAP
<U0000>..<U007F> /x00 NULL
END CHARMAP
"""
NUMBERS = """comment_char %
escape_char /
LC_NUMERIC
decimal_point ","
thousands_sep "."
grouping 3;3
END LC_NUMERIC
"""
FEW = 3
"""Iterations of a flow: enough to write numbers and to read them."""
HILL = templates() / "openfoam/flow/hill"
"""Files that replace those of the template."""
CASES = [*sorted(path.parent for path in templates().rglob("Allrun")), HILL]
SAMPLE = """title = "A pile"
grain = { diameter = 2e-3 }
bed = { kind = "pile", slope_deg = 20.0 }
method.flow = { model = "solve", cells_per_face = 10 }
threshold.fractions = [0.1]

[method.grains]
load_increment = 0.1
mobile_layers = 1
final_fraction = 0.1
stiffness = 1e3
"""


@pytest.fixture(scope="session")
def comma(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a terminal whose numbers have a comma."""
    folder = tmp_path_factory.mktemp("locale")
    (folder / "characters").write_text(CHARACTERS)
    (folder / "numbers").write_text(NUMBERS)
    characters, numbers = str(folder / "characters"), str(folder / "numbers")
    command = ["localedef", "--no-archive", "--force", "-f", characters, "-i", numbers]
    if shutil.which("localedef") is None:
        stop = pytest.fail if os.environ.get("SKIP_NOTHING") else pytest.skip
        stop("without localedef, which Debian has in its package libc-bin")
    # it warns of all that the locale leaves as it is
    subprocess.run([*command, str(folder / "xx_XX")], capture_output=True)
    environment = {**os.environ, "LOCPATH": str(folder), "LC_ALL": "xx_XX"}
    said = subprocess.check_output(["printf", "%.1f", "1,5"], env=environment)
    assert said == b"1,5", "the locale is not in use"
    return environment


def _ran(
    template: Path, folder: Path, environment: Mapping[str, str]
) -> dict[str, str]:
    """What a copy of a template says, and the tables and fields that it leaves."""
    if template == HILL:
        shutil.copytree(HILL.parent, folder)
    shutil.copytree(template, folder, dirs_exist_ok=True)
    control = folder / "system" / "controlDict"
    if control.is_file():
        # a flow ends before it has converged, and its script says so
        text = re.sub(
            r"(?m)^(endTime|writeInterval) .*", rf"\1 {FEW};", control.read_text()
        )
        control.write_text(text)
    given = {path.relative_to(folder) for path in folder.rglob("*")}
    ended = subprocess.run(
        ["./Allrun"], cwd=folder, env=dict(environment), capture_output=True, text=True
    )
    left = {"said": f"{ended.stdout}{ended.stderr}"}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        is_log = path.name.startswith("log.") or path.match("uniform/*")
        if path.is_file() and name not in given and not is_log:
            left[str(name)] = path.read_text()
    assert ended.returncode == 0 or control.is_file(), left
    return left


@pytest.mark.parametrize("template", CASES, ids=lambda path: path.name)
def test_a_template_says_and_leaves_the_same_where_numbers_have_a_comma(
    template: Path, comma: Mapping[str, str], tmp_path: Path
) -> None:
    expected = _ran(template, tmp_path / "point", {**os.environ, "LC_ALL": "C"})
    tables = [name for name in expected if name.endswith(("csv", "dump", "Stress"))]
    assert any(re.search(r"\d\.\d", expected[name]) for name in tables)
    assert _ran(template, tmp_path / "comma", comma) == expected


def test_a_study_has_the_same_tables_where_numbers_have_a_comma(
    comma: Mapping[str, str], tmp_path: Path
) -> None:
    (tmp_path / "one.toml").write_text(SAMPLE)
    tables = []
    for name, environment in (
        ("point", {**os.environ, "LC_ALL": "C"}),
        ("comma", comma),
    ):
        subprocess.run(
            [sys.executable, "-m", "orchestrator", "study", "one.toml", "--out", name],
            cwd=tmp_path,
            env={**environment, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            check=True,
        )
        (case,) = (tmp_path / name / "cases").glob("pile-*")
        again = subprocess.run(
            ["./Allrun"], cwd=case, env=environment, capture_output=True, text=True
        )
        assert "the results are those of results.sha256" in again.stdout
        said = {"Allrun": again.stdout.encode()}
        for path in sorted((tmp_path / name / "tables").glob("*.csv")):
            said[path.name] = path.read_bytes()
        tables.append(said)
    point, in_commas = tables
    assert len(point) > 3
    assert in_commas == point


def _starts(tmp_path: Path) -> dict[str, list[str]]:
    """The commands of the native solvers of the examples."""
    commands = {"solver.py": [sys.executable, str(NATIVE / "solver.py")]}
    compiler = shutil.which("g++")
    if compiler is not None:
        program = str(tmp_path / "solver")
        source = str(NATIVE / "solver.cpp")
        subprocess.run([compiler, "-std=c++17", "-o", program, source], check=True)
        commands["solver.cpp"] = [program]
    return commands


def test_the_native_solvers_answer_the_same_where_numbers_have_a_comma(
    comma: Mapping[str, str], tmp_path: Path
) -> None:
    scene = next((ROOT / "benchmark" / "small" / "scenes").glob("1-*"))
    for name, command in _starts(tmp_path).items():
        answers = []
        for place, environment in (
            ("point", {**os.environ, "LC_ALL": "C"}),
            ("comma", comma),
        ):
            out = tmp_path / f"{name}-{place}.csv"
            subprocess.run([*command, scene, out], env=environment, check=True)
            answers.append(out.read_text())
        assert re.search(r"\d\.\d", answers[0])
        assert answers[1] == answers[0]
