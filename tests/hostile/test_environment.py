"""A user's settings of matplotlib and broken libraries: no other figure, and one line each."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.faults.bench import CELLS, HEAD, ORCHESTRATOR, ROOT

HOSTILE_RC = """
text.usetex: True
backend: nonsense
font.family: serif
axes.facecolor: red
lines.linewidth: 9
path.sketch: 3, 10, 2
savefig.bbox: tight
svg.fonttype: none
axes.formatter.use_locale: True
nonsense: 1
"""


def _run(folder: Path, *arguments: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    command = [*ORCHESTRATOR, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


@pytest.fixture(scope="module")
def finished(finished_pile: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the finished study, to be drawn again."""
    return Path(shutil.copytree(finished_pile, tmp_path_factory.mktemp("finished") / "out"))


def _drawn(out: Path) -> dict[str, bytes]:
    files = [out / "report.html", *(out / "figures").iterdir()]
    return {path.name: path.read_bytes() for path in files}


@pytest.mark.parametrize(
    "variables",
    [
        {"MATPLOTLIBRC": "rc", "MPLBACKEND": "nonsense", "SOURCE_DATE_EPOCH": "abc"},
        {"MPLCONFIGDIR": "rc", "MPLBACKEND": "TkAgg", "DISPLAY": ":99"},
        {"MPLCONFIGDIR": "/dev/null/nowhere"},
    ],
    ids=str,
)
def test_settings_of_matplotlib(finished: Path, tmp_path: Path, variables: dict[str, str]) -> None:
    before = _drawn(finished)
    (tmp_path / "rc").mkdir()
    for place in (tmp_path / "rc", tmp_path):
        (place / "matplotlibrc").write_text(HOSTILE_RC)
    ended = _run(tmp_path, "report", str(finished), **variables)
    assert ended.returncode == 0, ended.stderr
    assert _drawn(finished) == before


BROKEN = {
    "scipy": "raise RuntimeError('compiled against another numpy')",
    "pandas": "def",
    "pydantic": "import _nothing",
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_library_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / f"{name}.py").write_text(BROKEN[name])
    (tmp_path / "small.toml").write_text(HEAD + CELLS)
    paths = f"{tmp_path / 'broken'}{os.pathsep}{ROOT}"
    ended = _run(tmp_path, "study", "small.toml", PYTHONPATH=paths)
    assert ended.returncode == 1
    assert ended.stderr.startswith("orchestrator: a library does not load: ")
    assert ended.stderr.count("\n") == 1
    examined = _run(tmp_path, "doctor", PYTHONPATH=paths)
    assert examined.returncode == 1
    (line,) = (line for line in examined.stdout.splitlines() if line.startswith("NOT"))
    assert f"pip install --force-reinstall {name}" in line
