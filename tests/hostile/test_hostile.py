"""Bad input by the hundred, settings and libraries: no traceback, one message, no other result."""

import itertools
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from orchestrator import cli
from orchestrator.runs import case
from orchestrator.study import study
from orchestrator.study.method import FlowMethod, GrainMethod
from orchestrator.study.parts import (
    Flow,
    Fluid,
    Forces,
    GrainPart,
    PileBed,
    ThresholdPart,
)
from tests.conftest import Command


@dataclass(frozen=True)
class Shell:
    """The command line, in this process: its working directory, and what it prints."""

    folder: Path
    captured: pytest.CaptureFixture[str]

    def run(self, *arguments: str) -> tuple[int, str]:
        """The exit code of a command, and its one line of complaint."""
        try:
            code = cli.main(arguments)
        except SystemExit as end:  # argparse
            code = int(end.code or 0)
        printed = self.captured.readouterr().err
        assert "Traceback" not in printed
        lines = [
            line for line in printed.splitlines() if line.startswith("orchestrator")
        ]
        # a study is asked about its units before it is refused
        lines = [
            line for line in lines if not line.startswith("orchestrator: warning: ")
        ]
        assert len(lines) <= 1, printed
        return code, "\n".join(lines)

    def refuses(self, text: str | bytes, place: str = "bad.toml") -> None:
        """See that a study file is refused in one line with a place, and nothing written."""
        source = self.folder / "bad.toml"
        source.write_bytes(text.encode() if isinstance(text, str) else text)
        # a directory that cannot be used: even a study that is right by chance is refused
        code, printed = self.run("study", "bad.toml", "--out", "bad.toml/out")
        assert (code, "bad.toml" in printed, place in printed) == (2, True, True), (
            text,
            printed,
        )
        assert len(printed) < 1000
        # a line end of its own is a blank; one that the file quotes stays as it wrote it
        given = source.read_text(encoding="utf-8", errors="replace")
        assert (
            "\\n" not in printed or "\\n" in given or '"""' in given or "'''" in given
        )
        assert [*self.folder.rglob("*")] == [source]


@pytest.fixture
def shell(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Shell:
    monkeypatch.chdir(tmp_path)
    return Shell(tmp_path, capsys)


PARTS: dict[str, type[BaseModel]] = {
    **{"fluid": Fluid, "grain": GrainPart, "bed": PileBed},
    **{"flow": Flow, "forces": Forces, "threshold": ThresholdPart},
    **{"method.flow": FlowMethod, "method.grains": GrainMethod},
}
HUGE = "1" + "0" * 400
VALUES = (
    *(
        "-1.0",
        "nan",
        "inf",
        "1e30",
        "1e308",
        "'; rm -rf /'",
        "true",
        "[[1]]",
        "{ a = 1 }",
    ),
    *("2026-01-01", "'" + "x" * 3000 + "'", HUGE),
)
FIXED = {"grain.diameter": "1e-3", "bed.kind": "'pile'", "bed.slope_deg": "15.0"}


def test_study_files_with_one_wrong_value(shell: Shell) -> None:
    for (part, model), value in itertools.product(PARTS.items(), VALUES):
        for field, info in model.model_fields.items():
            if (field, value) == ("seed", HUGE) or (info.annotation, value) == (
                bool,
                "true",
            ):
                continue
            given = {**FIXED, f"{part}.{field}": value}
            text = "".join(f"{key} = {value}\n" for key, value in given.items())
            place = "bed" if (part, field) == ("bed", "kind") else f"{part}.{field}"
            shell.refuses(text, f"bad.toml: {place}")


def test_a_text_that_does_not_end_is_told_without_an_escape(shell: Shell) -> None:
    shell.refuses('title = "first look\n[grain]\n', "Illegal end of a line (at line 1")


GRAIN = "[grain]\ndiameter = 1e-3\n"
PROTOCOL = "[method.grains]\nload_increment = 0.2\nwaiting_time = 3.0\n"
BAD_FILES = (
    *("", "a = " + "[" * 100_000, "[" + ".".join(["a"] * 5000) + "]", "title = '\x00'"),
    *(
        "time_limit = 1" + "0" * 5000,
        '"gr\'ain" = 1',
        '"gr\\nain" = 1',
        f"{'k' * 3000} = 1",
    ),
    *(f"title = 3\n{GRAIN}", f"{GRAIN}[group]\n", f"group = [1, 2]\n{GRAIN}"),
    *(f"time_limit = {value}\n{GRAIN}" for value in ("nan", "0", "'long'")),
    *(
        f"[axes]\n'{axis}' = [1]\n"
        for axis in ("grain", ".", "../grain.diameter", "grain.d.x")
    ),
    *(f"[axes]\n'grain.diameter' = [{value}]\n" for value in ("{ a = 1 }", "[1]")),
    f"{GRAIN}[axes]\n'bed.seed' = [{'1,' * 1000}]\n'method.flow.speed' = [{'1.0,' * 1000}]\n",
    *(
        f"{GRAIN}diameter = 1e-3\n",
        "grain:\n  diameter: 1e-3\n",
        '{"grain": {"diameter": 1}}',
    ),
    *(f"{GRAIN}[bed]\nroughness = 'd/{part}'\n" for part in ("1e999", "0")),
)


@pytest.mark.parametrize("text", BAD_FILES, ids=lambda text: ascii(text)[:40])
def test_study_files_that_are_wrong_otherwise(shell: Shell, text: str) -> None:
    shell.refuses(text)


def test_a_study_file_without_an_end_is_not_read_whole(shell: Shell) -> None:
    (shell.folder / "bad.toml").touch()
    os.truncate(shell.folder / "bad.toml", 2**40)
    code, printed = shell.run("study", "bad.toml", "--out", "out")
    assert (code, "larger than 16 MiB" in printed) == (2, True), printed


QUICK = settings(
    deadline=None,
    max_examples=100,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
    ],
)
VALID = (
    Path(study.__file__)
    .with_name("presets")
    .joinpath("first-look.toml")
    .read_text("utf-8")
)


@QUICK
@given(
    content=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode))
)
def test_study_files_of_any_bytes(shell: Shell, content: bytes) -> None:
    shell.refuses(content)


@QUICK
@given(
    at=st.integers(0, len(VALID)),
    length=st.integers(0, 30),
    text=st.text("[]{}=\"'.,#\n\\ae0-_", max_size=10),
)
def test_study_files_mixed_up(shell: Shell, at: int, length: int, text: str) -> None:
    shell.refuses(VALID[:at] + text + VALID[at + length :])


ARGUMENTS = (
    *(
        "",
        "study --workers 0",
        "study --workers many",
        "study --workers 1e99",
        "study .",
    ),
    *(
        "study /dev/null",
        "study /",
        "study \udcff.toml",
        f"study {'x' * 5000}",
        "study --out",
    ),
    *(
        "study first-look.toml",
        "study ../../first-look",
        "study a.toml b.toml",
        "status",
    ),
    *(
        "status nowhere",
        f"status {'x' * 5000}",
        "report nowhere",
        "report \udcff",
        "prune /",
    ),
    *("benchmark", "benchmark data nowhere there", "undo", "--frobnicate"),
    *(
        f"threshold --diameter 1e-3 --{option} {value}"
        for option in ("diameter", "density", "viscosity", "slope", "roughness")
        for value in ("-1", "nan", "inf", "1e999", "0x1", "$(id)", "\udcff", "1" * 400)
    ),
)


@pytest.mark.parametrize("words", ARGUMENTS, ids=lambda words: ascii(words)[:60])
def test_wrong_arguments(shell: Shell, words: str) -> None:
    assert shell.run(*words.split())[0] == 2
    assert not [*shell.folder.iterdir()]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner)
    ),
    max_leaves=12,
)
KEYS = (
    "name",
    "study",
    "cases",
    "orchestrator",
    "id",
    "kind",
    "file",
    "ended",
    "cause",
    "bytes",
)
STATE = JSON | st.dictionaries(st.sampled_from(KEYS), JSON)


@QUICK
@given(about=STATE, identity=STATE, done=STATE, failed=STATE)
def test_any_state(
    shell: Shell, about: object, identity: object, done: object, failed: object
) -> None:
    root = shell.folder / "out"
    inside = root / "cases" / "cells-0123456789ab"
    inside.mkdir(parents=True, exist_ok=True)
    states = {inside / case.IDENTITY: identity, inside / case.DONE: done}
    states |= {inside / case.FAILED: failed, root / "study.json": about}
    for path, value in states.items():
        path.write_text(json.dumps(value))
    for command in ("status", "report", "prune"):
        code, printed = shell.run(command, "out")
        assert code in (0, 3) or (code == 2 and "out" in printed), printed
    files = {path for path in root.rglob("*") if path.is_file()}
    assert files <= {*states, root / ".lock"}


NAMES = (
    *(
        "$(touch reached)",
        "`touch reached`",
        "; touch reached #",
        "a'b\"c",
        "two\nlines",
        "-rf",
    ),
    *(
        "%s%n{0}",
        "back\\slash",
        "<script>alert(1)</script>",
        "..",
        "../../reached",
        "/reached",
    ),
    *("\u202eright to left ∑ 沙", "x" * 3000),
)
STEMS = ("$(touch reached);`touch reached`'\"%s\\<b>\n∑ 沙", "-rf", "x" * 240)


@pytest.mark.parametrize("stem", STEMS, ids=ascii)
def test_names_reach_no_shell_and_no_path(shell: Shell, stem: str) -> None:
    """A study whose title, groups and file have odd names, run with the real solver."""
    (shell.folder / "work").mkdir()
    os.chdir(shell.folder / "work")
    source = Path(f"{stem}.toml")
    groups = "".join(f"[[group]]\nname = {json.dumps(name)}\n" for name in NAMES)
    title = json.dumps("<b>".join(NAMES))
    source.write_text(f"title = {title}\n{GRAIN}{PROTOCOL}{groups}", encoding="utf-8")
    code, printed = shell.run("study", f"./{source}")
    assert code == 0, printed
    page = (Path("results") / stem / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "<b>-rf" not in page
    assert {path.name for path in shell.folder.iterdir()} == {"work"}
    assert set(os.listdir()) == {source.name, "results"}
    assert not [*shell.folder.rglob("reached")]


def test_names_that_are_no_text(tmp_path: Path, orchestrator: Command) -> None:
    source, out = tmp_path / os.fsdecode(b"\xff\xfe.toml"), os.fsdecode(b"out\xff")
    source.write_text(GRAIN + PROTOCOL)
    ended = orchestrator("study", str(source), "--out", out)
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / out / "report.html").is_file()


HOSTILE_RC = """
text.usetex: True
axes.facecolor: red
path.sketch: 3, 10, 2
savefig.bbox: tight
svg.fonttype: none
nonsense: 1
"""
SETTINGS = (
    {"MATPLOTLIBRC": "rc", "MPLBACKEND": "nonsense", "SOURCE_DATE_EPOCH": "abc"},
    {"MPLCONFIGDIR": "rc", "MPLBACKEND": "TkAgg", "DISPLAY": ":99"},
    {"MPLCONFIGDIR": "/dev/null/nowhere"},
)


def test_settings_of_matplotlib(
    finished_pile: Path,
    tmp_path: Path,
    orchestrator: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = shutil.copytree(finished_pile, tmp_path / "out")
    drawn = [out / "report.html", *(out / "figures").iterdir()]
    before = [path.read_bytes() for path in drawn]
    (tmp_path / "rc").mkdir()
    for place in (tmp_path / "rc", tmp_path):
        (place / "matplotlibrc").write_text(HOSTILE_RC)
    for variables in SETTINGS:
        with monkeypatch.context() as patch:
            for name, value in variables.items():
                patch.setenv(name, value)
            ended = orchestrator("report", "out")
        assert ended.returncode == 0, ended.stderr
        assert [path.read_bytes() for path in drawn] == before


BROKEN = {
    "scipy": "raise RuntimeError('compiled against another numpy')",
    "pandas": "def",
    "pydantic": "import _nothing",
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_library_is_one_line(
    tmp_path: Path, orchestrator: Command, name: str
) -> None:
    (tmp_path / f"{name}.py").write_text(BROKEN[name])  # python -m looks here first
    (tmp_path / "small.toml").write_text(
        "bed.kind = 'flat'\nmethod.kind = 'pivot'\n" + GRAIN
    )
    ended = orchestrator(
        "study", "small.toml"
    )  # it needs scipy when its grains are packed
    assert ended.returncode == 1
    assert "Traceback" not in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith(
        "orchestrator: a library does not load: "
    )
    examined = orchestrator("doctor")
    assert examined.returncode == 1
    (line,) = (line for line in examined.stdout.splitlines() if line.startswith("NOT"))
    assert f"pip install --force-reinstall {name}" in line
