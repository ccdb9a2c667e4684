"""Bad input by the hundred: never a traceback, one message, nothing written anywhere."""

import itertools
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from orchestrator import cli
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.runs import case
from orchestrator.study.parts import Flow, Fluid, Forces, Grain, GrainBed, PileBed, Protocol
from orchestrator.study.scene import Scene

Words = tuple[int, str]


@dataclass(frozen=True)
class Shell:
    """The command line, in this process.

    Attributes
    ----------
    folder : Path
        The working directory.
    captured : pytest.CaptureFixture
        What it prints.
    """

    folder: Path
    captured: pytest.CaptureFixture[str]

    def run(self, *arguments: str) -> Words:
        """The exit code of a command, and its lines of complaint."""
        self.captured.readouterr()
        try:
            code = cli.main(arguments)
        except SystemExit as end:  # argparse
            code = int(end.code or 0)
        said = self.captured.readouterr().err
        assert "Traceback" not in said
        lines = [line for line in said.splitlines() if line.startswith("orchestrator")]
        assert len(lines) <= 1, said
        return code, "\n".join(lines)

    def files(self) -> set[Path]:
        """All that there is."""
        return set(self.folder.rglob("*"))


@pytest.fixture
def shell(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Shell:
    monkeypatch.chdir(tmp_path)
    return Shell(tmp_path, capsys)


PARTS: dict[str, type[BaseModel]] = {
    "fluid": Fluid,
    "grain": Grain,
    "bed": PileBed,
    "flow": Flow,
    "forces": Forces,
    "protocol": Protocol,
}
VALUES = {
    "negative": "-1.0",
    "nan": "nan",
    "inf": "inf",
    "vast": "1e30",
    "vaster": "1e308",
    "text": "'; rm -rf /'",
    "truth": "true",
    "list": "[[1]]",
    "table": "{ a = 1 }",
    "date": "2026-01-01",
    "long": "'" + "x" * 3000 + "'",
    "huge": "1" + "0" * 400,
}
FIXED = {
    "grain": {"diameter": "1e-3"},
    "bed": {"kind": "'pile'", "slope_deg": "15.0"},
}


def _bad_values() -> Iterator[tuple[str, str]]:
    """Field and text of study files with one value that is wrong."""
    for (part, model), (_, value) in itertools.product(PARTS.items(), VALUES.items()):
        for field in model.model_fields.keys() - ({"seed"} if value == VALUES["huge"] else {}):
            parts = {**FIXED, part: {**FIXED.get(part, {}), field: value}}
            lines = (
                line
                for name, fields in parts.items()
                for line in (f"[{name}]", *(f"{key} = {given}" for key, given in fields.items()))
            )
            yield f"{part}.{field}", "\n".join(lines)


def test_study_files_with_one_wrong_value(shell: Shell) -> None:
    tried = list(_bad_values())
    assert len(tried) >= 200
    wrong = []
    source = shell.folder / "bad.toml"
    for field, text in tried:
        source.write_text(text)
        # not even one that is accepted by mistake may start a solver
        code, said = shell.run("study", "bad.toml", "--out", "bad.toml/out")
        place = "bed" if field == "bed.kind" else field
        if code != 2 or f"bad.toml: {place}" not in said or len(said) > 1000:
            wrong.append((text, code, said))
    assert not wrong, f"{len(wrong)} of {len(tried)}: {wrong[:5]}"
    assert shell.files() == {source}


GRAIN = "[grain]\ndiameter = 1e-3\n"
BAD_FILES = {
    "empty": "",
    "deep": "a = " + "[" * 100_000,
    "deep tables": "[" + ".".join(["a"] * 5000) + "]",
    "long number": "time_limit = 1" + "0" * 5000,
    "nul": "title = '\x00'",
    "key with a quote": '"gr\'ain" = 1',
    "key with a newline": '"gr\\nain" = 1',
    "long key": f"{'k' * 3000} = 1",
    "title": f"title = 3\n{GRAIN}",
    "group": f"{GRAIN}[group]\n",
    "groups": f"group = [1, 2]\n{GRAIN}",
    "time limit": f"time_limit = nan\n{GRAIN}",
    "no time": f"time_limit = 0\n{GRAIN}",
    "text for time": f"time_limit = 'long'\n{GRAIN}",
    "axis of a table": "[axes]\n'grain' = [1]\n",
    "axis of nothing": "[axes]\n'.' = [1]\n",
    "axis out of the file": "[axes]\n'../grain.diameter' = [1e-3]\n",
    "axis of tables": "[axes]\n'grain.diameter' = [{ a = 1 }]\n",
    "axis of lists": "[axes]\n'grain.diameter' = [[1e-3]]\n",
    "deep axis": "[axes]\n'grain.diameter.x' = [1e-3]\n",
    "too many": GRAIN + "[axes]\n'bed.seed' = [" + "1," * 1000 + "]\n'flow.speed' = ["
    "" + "1.0," * 1000 + "]\n",
    "one key twice": "[grain]\ndiameter = 1e-3\ndiameter = 1e-3\n",
    "yaml": "grain:\n  diameter: 1e-3\n",
    "json": '{"grain": {"diameter": 1e-3}}',
    "text of d": GRAIN + "[bed]\nroughness = 'd/1e999'\n",
    "d by nothing": GRAIN + "[bed]\nroughness = 'd/0'\n",
}


def test_a_study_file_that_is_too_large_is_not_read(shell: Shell) -> None:
    (shell.folder / "bad.toml").touch()
    os.truncate(shell.folder / "bad.toml", 2**40)
    code, said = shell.run("study", "bad.toml", "--out", "out")
    assert (code, "larger than 16 MiB" in said) == (2, True), said


def test_a_study_file_that_never_ends_is_not_waited_for(shell: Shell) -> None:
    code, said = shell.run("study", "/proc/kmsg", "--out", "out")
    assert code == 2, said
    assert "/proc/kmsg" in said


@pytest.mark.parametrize("name", BAD_FILES)
def test_study_files_that_are_wrong_otherwise(shell: Shell, name: str) -> None:
    (shell.folder / "bad.toml").write_text(BAD_FILES[name])
    code, said = shell.run("study", "bad.toml", "--out", "out")
    assert code == 2, said
    assert "bad.toml" in said
    assert len(said) < 1000
    assert shell.files() == {shell.folder / "bad.toml"}


QUICK = settings(
    deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@QUICK
@given(content=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_study_files_of_any_bytes(shell: Shell, content: bytes) -> None:
    (shell.folder / "bad.toml").write_bytes(content)
    code, said = shell.run("study", "bad.toml", "--out", "out")
    assert code == 2, said
    assert "bad.toml" in said
    assert shell.files() == {shell.folder / "bad.toml"}


VALID = Path(__file__).parents[2] / "orchestrator" / "study" / "presets" / "first-look.toml"


@QUICK
@given(data=st.data())
def test_study_files_that_were_cut_or_mixed_up(shell: Shell, data: st.DataObject) -> None:
    text = VALID.read_text(encoding="utf-8")
    at = data.draw(st.integers(0, len(text)))
    upto = data.draw(st.integers(at, min(at + 30, len(text))))
    mixed = text[:at] + data.draw(st.text("[]{}=\"'.,#\n\\ae0-_", max_size=10)) + text[upto:]
    (shell.folder / "bad.toml").write_text(mixed, encoding="utf-8")
    # a directory that cannot be used: a study that is still right is refused too
    code, said = shell.run("study", "bad.toml", "--out", "bad.toml/out")
    assert code == 2, said
    assert "bad.toml" in said
    assert shell.files() == {shell.folder / "bad.toml"}


ARGUMENTS = [
    [],
    ["study", "--workers", "0"],
    ["study", "--workers", "-3"],
    ["study", "--workers", "many"],
    ["study", "--workers", "1e99"],
    ["study", ""],
    ["study", "."],
    ["study", ".."],
    ["study", "/dev/null"],
    ["study", "/"],
    ["study", "\udcff.toml"],
    ["study", "x" * 5000],
    ["study", "first-look.toml"],
    ["study", "../../first-look"],
    ["study", "--out"],
    ["study", "a.toml", "b.toml"],
    ["status"],
    ["status", "nowhere"],
    ["status", "x" * 5000],
    ["report", "nowhere"],
    ["report", "\udcff"],
    ["prune", "nowhere"],
    ["prune", "/"],
    ["benchmark"],
    ["benchmark", "data", "nowhere", "there"],
    ["undo"],
    ["--frobnicate"],
    *(
        ["threshold", "--diameter", "1e-3", option, value]
        for option in ("--diameter", "--density", "--viscosity", "--slope", "--roughness")
        for value in ("", "-1", "nan", "inf", "1e999", "0x1", "$(id)", "\udcff", "1" * 400)
    ),
]


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=lambda words: ascii(" ".join(words))[:60])
def test_wrong_arguments(shell: Shell, arguments: list[str]) -> None:
    code, _ = shell.run(*arguments)
    assert code == 2
    assert not shell.files()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=12,
)
KEYS = ("name", "study", "cases", "orchestrator", "id", "ended", "cause", "host", "pid", "beat")


def _state() -> st.SearchStrategy[object]:
    return JSON | st.dictionaries(st.sampled_from(KEYS), JSON)


@QUICK
@given(about=_state(), note=_state(), done=_state(), failed=_state())
def test_directories_with_any_state(
    shell: Shell, about: object, note: object, done: object, failed: object
) -> None:
    root = shell.folder / "out"
    inside = root / "cases" / "cells-0123456789ab"
    inside.mkdir(parents=True, exist_ok=True)
    states = {
        root / "study.json": about,
        root / ".lock": note,
        inside / case.DONE: done,
        inside / case.FAILED: failed,
    }
    for path, value in states.items():
        path.write_text(json.dumps(value))
    for command in ("status", "report", "prune"):
        code, said = shell.run(command, "out")
        assert code in (0, 2, 3), said
        assert code != 2 or "out" in said
    assert {path for path in shell.files() if path.is_file()} <= {*states, root / ".lock"}


@QUICK
@given(state=_state())
def test_a_case_with_any_marker_is_not_done(shell: Shell, state: object) -> None:
    one = SingleGrainCase(
        (Scene(grain=Grain(diameter=1e-3), bed=GrainBed(roughness=1e-4), forces=Forces(law="low")),)
    )
    directory = shell.folder / one.name
    directory.mkdir(exist_ok=True)
    (directory / case.DONE).write_text(json.dumps(state))
    for identity in (state, {"id": one.id}):
        (directory / case.IDENTITY).write_text(json.dumps(identity))
        assert not case.is_done(one, shell.folder)


NAMES = [
    "$(touch reached)",
    "`touch reached`",
    "; touch reached #",
    "a'b\"c",
    "two\nlines",
    "-rf",
    "%s%n{0}",
    "back\\slash",
    "<script>alert(1)</script>",
    "..",
    "../../reached",
    "/reached",
    "\u202eright to left ∑ 沙",
    "x" * 3000,
]
STEMS = ["$(touch reached);`touch reached`'\"%s\\<b>\n∑ 沙", "-rf", "x" * 240]


@pytest.mark.parametrize("stem", STEMS, ids=ascii)
def test_names_reach_no_shell_and_no_path(shell: Shell, stem: str) -> None:
    """A study whose title, groups and file have odd names, run with the real solver."""
    (shell.folder / "work").mkdir()
    os.chdir(shell.folder / "work")
    source = Path(f"{stem}.toml")
    groups = "".join(f"[[group]]\nname = {json.dumps(name)}\n" for name in NAMES)
    title = json.dumps("<b>".join(NAMES))
    source.write_text(
        f"title = {title}\n{GRAIN}[protocol]\nload_increment = 0.2\nwaiting_time = 3.0\n{groups}",
        encoding="utf-8",
    )
    code, said = shell.run("study", f"./{source}")
    assert code == 0, said
    page = (Path("results") / stem / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "<b>-rf" not in page
    assert {path.name for path in shell.folder.iterdir()} == {"work"}
    assert set(os.listdir()) == {source.name, "results"}
    assert not any(path.name == "reached" for path in shell.files())


def test_a_study_called_two_dots_does_not_leave_its_folder(shell: Shell) -> None:
    (shell.folder / "...toml").write_text(GRAIN)
    code, said = shell.run("study", "...toml")
    assert code == 2, said
    assert "...toml: a file of dots" in said
    assert shell.files() == {shell.folder / "...toml"}


def _process(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    root = Path(__file__).parents[2]
    return subprocess.run(
        [sys.executable, "-m", "orchestrator", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        timeout=120,
    )


def test_real_processes_say_it_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "deep.toml").write_text(BAD_FILES["deep"])
    for arguments in (["study", "deep.toml"], ["status", os.fsdecode(b"\xff")], ["study", "\n"]):
        ended = _process(tmp_path, *arguments)
        assert ended.returncode == 2
        assert b"Traceback" not in ended.stderr
        assert len(ended.stderr.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["deep.toml"]


def test_names_that_are_no_text(tmp_path: Path) -> None:
    source, out = tmp_path / os.fsdecode(b"\xff\xfe.toml"), os.fsdecode(b"out\xff")
    source.write_text(GRAIN + "[protocol]\nload_increment = 0.2\nwaiting_time = 3.0\n")
    ended = _process(tmp_path, "study", str(source), "--out", out)
    assert ended.returncode == 0, ended.stderr
    assert Path(os.fsdecode(ended.stdout.splitlines()[-1])) == tmp_path / out / "report.html"
