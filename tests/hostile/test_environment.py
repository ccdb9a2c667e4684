"""A user's settings and variables that are none of ours: they change no result and no figure."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.faults.bench import CELLS, HEAD, ROOT

HOSTILE_RC = """
text.usetex: True
backend: nonsense
font.family: serif
font.serif: Nothing
axes.facecolor: red
lines.linewidth: 9
path.sketch: 3, 10, 2
savefig.dpi: 30
savefig.bbox: tight
svg.fonttype: none
axes.formatter.use_locale: True
nonsense: 1
"""


def _run(folder: Path, *arguments: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "orchestrator", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        capture_output=True,
        text=True,
        timeout=300,
    )


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
        {"XDG_CONFIG_HOME": "config"},
        {"MPLCONFIGDIR": "/dev/null/nowhere"},
    ],
    ids=str,
)
def test_no_setting_of_matplotlib_changes_a_figure(
    finished: Path, tmp_path: Path, variables: dict[str, str]
) -> None:
    before = _drawn(finished)
    for folder in ("rc", "config/matplotlib"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "matplotlibrc").write_text(HOSTILE_RC)
    ended = _run(tmp_path, "report", str(finished), **variables)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert _drawn(finished) == before


@pytest.mark.parametrize("content", [HOSTILE_RC.encode(), b"\xff\xfe\x00"])
def test_no_matplotlibrc_of_the_working_directory_does(
    finished: Path, tmp_path: Path, content: bytes
) -> None:
    before = _drawn(finished)
    (tmp_path / "matplotlibrc").write_bytes(content)
    for command in ("report", "prune"):
        ended = _run(tmp_path, command, str(finished))
        assert (ended.returncode, ended.stderr) == (0, "")
    assert _drawn(finished) == before


SEALED = """
import sys
from pathlib import Path
import orchestrator.benchmark.compare, orchestrator.pipeline
import orchestrator.experiments.ladder.run, orchestrator.experiments.stability.run
assert "matplotlib" not in sys.modules
from orchestrator.report import settings
from orchestrator.runs.files import Folder
with settings.own():
    from orchestrator.benchmark import page
    from orchestrator.experiments.ladder import page as ladder
    from orchestrator.experiments.stability import page as stability
    from orchestrator.report import style
    figure = style.canvas(1.0)
    figure.subplots().plot([0, 1], label="grains")
    style.save(figure, Folder(Path()), "one")
"""
"""What the pages of experiments and benchmarks do: matplotlib is imported by nothing before."""


def test_pages_of_experiments_and_benchmarks_are_drawn_as_ours_too(tmp_path: Path) -> None:
    for name in ("ours", "theirs"):
        (tmp_path / name).mkdir()
    (tmp_path / "theirs" / "matplotlibrc").write_text(HOSTILE_RC)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for name in ("ours", "theirs"):
        subprocess.run(
            [sys.executable, "-c", SEALED], cwd=tmp_path / name, env=environment, check=True
        )
    for kind in ("png", "svg"):
        one, other = (tmp_path / name / "figures" / f"one.{kind}" for name in ("ours", "theirs"))
        assert one.read_bytes() == other.read_bytes()


def test_a_program_that_draws_by_itself_keeps_its_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import matplotlib

    from orchestrator.report import settings

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "pdf")
    with matplotlib.rc_context({"font.size": 33}):
        with settings.own():
            assert matplotlib.rcParams["font.size"] == settings.RC["font.size"]
        assert matplotlib.rcParams["font.size"] == 33
    assert Path.cwd() == tmp_path
    assert os.environ["MPLBACKEND"] == "pdf"


@pytest.mark.parametrize("value", ["abc", "", "-1", "1e9", "9" * 40])
def test_the_library_is_imported_whatever_the_date_of_a_build(value: str) -> None:
    command = [sys.executable, "-c", "import orchestrator.pipeline, orchestrator.report.page"]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "SOURCE_DATE_EPOCH": value}, check=True)


BROKEN = {
    "scipy": "raise RuntimeError('compiled against another numpy')",
    "pandas": "def",
    "pydantic": "import _nothing",
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_library_is_told_in_a_line(tmp_path: Path, name: str) -> None:
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


def test_a_package_without_its_templates_says_so(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "orchestrator", tmp_path / "package" / "orchestrator")
    (tmp_path / "small.toml").write_text(HEAD + CELLS)
    ended = _run(tmp_path, "study", "small.toml", PYTHONPATH=str(tmp_path / "package"))
    assert ended.returncode == 1
    assert "package/templates/liggghts/" in ended.stderr
    assert "lacks this directory of templates (install the package again)" in ended.stderr
    assert ended.stderr.count("\n") == 1
