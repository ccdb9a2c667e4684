"""Packs from a stranger: each one that is none is refused by one line, and touches nothing."""

import contextlib
import functools
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from orchestrator import cli
from orchestrator.benchmark import pack
from orchestrator.errors import InputError


@pytest.fixture
def copy(all_levels: Path, tmp_path: Path) -> Path:
    """A pack of all levels to be harmed."""
    root = tmp_path / "pack"
    shutil.copytree(all_levels, root)
    return root


def _seal(root: Path) -> None:
    """Make the digests those of the files, as whoever means harm does."""
    manifest = json.loads((root / pack.MANIFEST).read_text())
    paths = [root / name for name in pack.FILES]
    for folder, _, files in os.walk(root / pack.SCENES):
        paths += [Path(folder) / file for file in files]
    manifest["sha256"] = {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in paths
        if path.is_file()
    }
    (root / pack.MANIFEST).write_text(json.dumps(manifest))


def _scene(root: Path, kind: str = "incline") -> Path:
    pattern = {"incline": "2-incline-20", "line": "5-*", "pile": "4-*", "formula": "1-*"}[kind]
    return min((root / pack.SCENES).glob(pattern))


def _edit(path: Path, **changed: Any) -> None:
    told = json.loads(path.read_text())
    told.update(changed)
    kept = {name: value for name, value in told.items() if value is not ...}
    path.write_text(json.dumps(kept))


def _rename(root: Path, name: str) -> None:
    """Give a scene another name, wherever a pack says it."""
    old = _scene(root).name
    _edit(_scene(root) / "scene.json", scene=name)
    for file in ("expected.csv", "scenes.csv", pack.MANIFEST):
        text = (root / file).read_text()
        escaped = json.dumps(name)[1:-1] if file == pack.MANIFEST else name
        (root / file).write_text(text.replace(old, escaped))
    if not name.startswith("/"):
        goal = root / pack.SCENES / name
        goal.parent.mkdir(parents=True, exist_ok=True)
        _scene(root).rename(goal)


def _expected(root: Path, old: str, new: str, count: int = 1) -> None:
    path = root / "expected.csv"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, count))


def _unjudged(root: Path, tolerance: str, low: str = "", high: str = "") -> None:
    """Give all numbers of the sliding scenes another tolerance, or another interval."""
    path = root / "expected.csv"
    lines = [line.split(",") for line in path.read_text().splitlines()]
    for cells in lines:
        if cells[0].startswith("2-sliding"):
            cells[4:7] = [low or cells[4], high or cells[5], tolerance]
    path.write_text("\n".join([*map(",".join, lines), ""]))


def _study(root: Path, text: str) -> None:
    path = root / "study.toml"
    path.write_text(text + path.read_text())


def _line(root: Path, column: int, cell: str) -> None:
    """Change a cell of the first expectation."""
    path = root / "expected.csv"
    head, first, *rest = path.read_text().splitlines()
    cells = first.split(",")
    cells[column] = cell
    path.write_text("\n".join([head, ",".join(cells), *rest, ""]))


def _manifest(root: Path, **changed: Any) -> None:
    _edit(root / pack.MANIFEST, **changed)


def _link(path: Path, goal: Path | str) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(goal)


def _pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _file(root: Path, name: str, text: str = "1\n") -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


Harm = Callable[[Path], object]
NAMES = ("../../evil", "/tmp/evil", "2-a/b", "2-A", "2-é", "2-$\\frac$", "2-a\n", "2-.", "2-")
HARMS: dict[str, Harm] = {
    **{f"a scene {name!r}": functools.partial(_rename, name=name) for name in NAMES},
    "a brace": lambda root: (_scene(root) / "scene.json").write_text("{"),
    "no text": lambda root: (_scene(root) / "scene.json").write_bytes(b"\xff\xfe\0"),
    "a list": lambda root: (_scene(root) / "scene.json").write_text("[1]"),
    "a bomb": lambda root: (_scene(root) / "scene.json").write_text("[" * 100_000),
    "a bomb of keys": lambda root: (_scene(root) / "scene.json").write_text('{"a":' * 100_000),
    "many digits": lambda root: (_scene(root) / "scene.json").write_text("1" * 10_000),
    "no level": lambda root: _edit(_scene(root) / "scene.json", level=...),
    "another level": lambda root: _edit(_scene(root) / "scene.json", level=3),
    "level true": lambda root: _edit(_scene(root) / "scene.json", level=True),
    "another kind": lambda root: _edit(_scene(root) / "scene.json", kind="pile"),
    "no kind": lambda root: _edit(_scene(root) / "scene.json", kind=...),
    "another scene": lambda root: _edit(_scene(root) / "scene.json", scene="2-incline-5"),
    "a text for a number": lambda root: _edit(_scene(root) / "scene.json", d_m="1e-3"),
    "no number": lambda root: _edit(_scene(root) / "scene.json", d_m=...),
    "null": lambda root: _edit(_scene(root) / "scene.json", d_m=None),
    "a nest": lambda root: _edit(_scene(root) / "scene.json", d_m={"a": [1]}),
    "NaN": lambda root: _edit(_scene(root) / "scene.json", d_m=float("nan")),
    "Infinity": lambda root: _edit(_scene(root) / "scene.json", more=float("inf")),
    "1e999": lambda root: (_scene(root) / "scene.json").write_text('{"d_m": 1e999}'),
    "10^400": lambda root: _edit(_scene(root) / "scene.json", d_m=10**400),
    "damping of -5": lambda root: _edit(_scene(root) / "scene.json", damping=-5.0),
    "a strange word": lambda root: _edit(_scene(root, "line") / "scene.json", packing="$\\frac"),
    "a strange key": lambda root: _edit(_scene(root) / "scene.json", **{"=1+1": 1}),
    "lighter than the fluid": lambda root: _edit(
        _scene(root, "formula") / "scene.json", rho_f_kg_m3=1e5
    ),
    "no force law": lambda root: _edit(_scene(root, "formula") / "scene.json", force_law="Eq. 7"),
    "a column less": lambda root: _expected(root, "tolerance,", ""),
    "no at": lambda root: _expected(root, ",at,", ",where,"),
    "a value of words": lambda root: _line(root, 3, "many"),
    "a value of NaN": lambda root: _line(root, 3, "nan"),
    "no value": lambda root: _line(root, 3, ""),
    "a value of 1e999": lambda root: _line(root, 3, "1e999"),
    "low above high": lambda root: _line(root, 4, "1e6"),
    "a tolerance of -1": lambda root: _line(root, 6, "-1"),
    "an at of words": lambda root: _line(root, 2, "here"),
    "an at of NaN": lambda root: _line(root, 2, "nan"),
    "a strange quantity": lambda root: _line(root, 1, "=cmd()"),
    "another's scene": lambda root: _line(root, 0, "2-none"),
    "a number more": lambda root: _line(root, 1, "drag_pn"),
    "a line twice": lambda root: (root / "expected.csv").write_text(
        (root / "expected.csv").read_text()
        + (root / "expected.csv").read_text().splitlines()[1]
        + "\n"
    ),
    "a million lines": lambda root: (root / "expected.csv").write_text(
        (root / "expected.csv").read_text()
        + "".join(f"2-incline-20,a,{i},1,1,1,,\n" for i in range(10**6))
    ),
    "lines of 8 fields and 9": lambda root: _line(root, 7, "1,2"),
    "an empty table": lambda root: (root / "expected.csv").write_text(""),
    "no text in a table": lambda root: (root / "expected.csv").write_bytes(b"\xff\0\xfe" * 99),
    "a directory for a table": lambda root: _folder(root / "expected.csv"),
    "a huge file": lambda root: os.truncate(_scene(root) / "ask.csv", 2**27),
    "a table that is a link": lambda root: _link(root / "expected.csv", "/dev/zero"),
    "a scene's file that is a link": lambda root: _link(_scene(root) / "ask.csv", "/etc/passwd"),
    "a scene that is a link": lambda root: _link(
        _scene(root), _scene(root).rename(root.parent / "away")
    ),
    "a pipe": lambda root: _pipe(_scene(root) / "ask.csv"),
    "a directory in a scene": lambda root: _file(root, "scenes/2-incline-20/more/1.csv"),
    "a hidden file": lambda root: _file(root, "scenes/2-incline-20/.rc"),
    "a program": lambda root: _file(root, "scenes/2-incline-20/solver.py"),
    "a file of capitals": lambda root: _file(root, "scenes/2-incline-20/ASK.csv"),
    "a scene that is not listed": lambda root: shutil.copytree(
        _scene(root), root / pack.SCENES / "2-more"
    ),
    "a scene that is not there": lambda root: shutil.rmtree(_scene(root)),
    "another question": lambda root: (_scene(root) / "ask.csv").write_text("quantity,at\nx,\n"),
    "no question": lambda root: (_scene(root) / "ask.csv").unlink(),
    "a scene listed twice": lambda root: _manifest(root, scenes=["2-incline-20"] * 2),
    "no scenes": lambda root: _manifest(root, scenes=[]),
    "scenes of numbers": lambda root: _manifest(root, scenes=[1, 2]),
    "programs of lists": lambda root: _manifest(root, programs={"a": ["b"]}),
    "a program that writes": lambda root: _manifest(root, programs={"a": "\x1b[2J"}),
    "a machine of text": lambda root: _manifest(root, machine="mine"),
    "more in the manifest": lambda root: _manifest(root, more=1),
    "no kind of directory": lambda root: _manifest(root, kind=...),
    "a study that is none": lambda root: (root / "study.toml").write_text("[[["),
    # what would pass any answer
    "no tolerance": lambda root: _unjudged(root, ""),
    "a tolerance of 10": lambda root: _unjudged(root, "10"),
    "an endless interval": lambda root: _unjudged(root, "0.01", "-1e29", "1e29"),
    "an interval elsewhere": lambda root: _unjudged(root, "0.01", "2", "3"),
    # files outside of the pack
    "bytes for a study": lambda root: (root / "study.toml").write_bytes(b"\xff\xfe\x00"),
    "a study of a file": lambda root: _study(root, 'bed = { profile = "/etc/passwd" }\n'),
    "a study of files": lambda root: _study(root, 'axes = { "bed.profile" = ["../../a.csv"] }\n'),
    "a study of a sieve": lambda root: _study(root, 'group = [{ grain.sizes = "/etc/passwd" }]\n'),
    "profiles that are none": lambda root: _study(root, 'profiles = 3\nbed.profile = "a"\n'),
    "a study of another": lambda root: (root / "study.toml").write_text("title = 'mine'\n"),
}


@pytest.mark.parametrize("name", HARMS)
def test_a_hostile_pack_is_refused_by_one_line(
    copy: Path, name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(copy.parent)
    HARMS[name](copy)
    _seal(copy)
    before = {path for path in copy.parent.rglob("*") if "results" not in path.parts}
    code = cli.main(["benchmark", "run", "pack", "--scene", "2-*", "--solver", "true {case} {out}"])
    said = capsys.readouterr().err
    assert code == 2, said
    (line,) = (line for line in said.splitlines() if line.startswith("orchestrator: "))
    assert "pack" in line
    assert len(line) < 1500
    assert "root:" not in line
    assert {p for p in copy.parent.rglob("*") if "results" not in p.parts} == before


@pytest.mark.parametrize("name", ["manifest.json", "expected.csv"])
def test_a_pipe_for_a_table_does_not_hang(copy: Path, name: str) -> None:
    _pipe(copy / name)
    with pytest.raises(InputError, match="a link or no file"):
        pack.read(copy)


def test_grains_that_are_none(copy: Path) -> None:
    path, whole = _scene(copy, "pile") / "grains.csv", pack.read(copy)
    for content in (b"", b"kind\n\xff\n", b"x_m\n1\n", b'"'):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"grains\.csv"):
            pack.mobile_grains(whole, path.parent.name)
    path.unlink()
    with pytest.raises(InputError, match=r"grains\.csv"):
        pack.mobile_grains(whole, path.parent.name)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
CELLS = st.text(max_size=20) | st.floats().map(str) | st.sampled_from(["", '"', "1e999", "0x1"])


@settings(
    max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_any_pack_is_read_or_refused(copy: Path, data: st.DataObject) -> None:
    scene = _scene(copy, data.draw(st.sampled_from(["incline", "line", "pile", "formula"])))
    files = [scene / "scene.json", copy / "expected.csv", copy / pack.MANIFEST]
    path = data.draw(st.sampled_from(files))
    text = path.read_text()
    if path.suffix == ".json":
        before = json.loads(text)
        keys = st.sampled_from([*before]) | st.text(max_size=9)
        changed = json.dumps(before | data.draw(st.dictionaries(keys, VALUES, min_size=1)))
    else:
        lines = [line.split(",") for line in text.splitlines()]
        for _ in range(data.draw(st.integers(1, 3))):
            row = lines[data.draw(st.integers(0, len(lines) - 1))]
            row[data.draw(st.integers(0, len(row) - 1))] = data.draw(CELLS)
        changed = "\n".join(map(",".join, lines)).encode(errors="replace").decode()
    path.write_text(changed)
    if path.name != pack.MANIFEST:
        _seal(copy)
    with contextlib.suppress(InputError):
        scenes = pack.read(copy).scenes
        assert all(parameters["scene"] == name for name, parameters in scenes.items())
    path.write_text(text)
    _seal(copy)
