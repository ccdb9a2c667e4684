"""A benchmark pack on disk: its scenes, questions and expected answers, written and read.

docs/benchmark.md is the contract for solvers. A pack may come from anywhere: `read` refuses one
whose files are not those of its manifest, or whose names, links or numbers no export makes.
"""

import json
import os
import platform
import re
import stat
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, NoReturn

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from orchestrator.errors import InputError
from orchestrator.runs import workspace
from orchestrator.runs.files import digest_files, text_of
from orchestrator.types import Row

SCHEMA = 2
"""Version of the exchange format. A key or column that is renamed is a new version."""
MANIFEST, EXPECTED, STUDY, TIMES = "manifest.json", "expected.csv", "study.toml", "times.csv"
FILES = (EXPECTED, "scenes.csv", TIMES, STUDY, "README.md")
"""Files of a pack beside its manifest and the directory of its scenes."""
SCENES, SCENE = "scenes", "scene.json"
COLUMNS = ["quantity", "at", "value", "low", "high", "tolerance", "ours"]
"""Columns of the expected answers beside the scene's name."""
COUNTS = ("moved", "not_moved", "carried_off")
"""Quantities that count grains."""
NUMBER = "%.9g"
"""Format of the numbers in all tables of a pack."""
MAX_BYTES, LARGEST = 64 * 2**20, 1e30
"""Largest file, bytes; largest number."""
MAX_TOLERANCE, MAX_WIDTH, MAX_COUNT = 0.5, 10.0, 1e6
"""Bounds of what is judged: the tolerance, the width of an interval over its value, and the largest
count. A pack with wider ones would pass any answer."""
_NAME, _MEMBER = r"[1-5]-[a-z0-9]+([.+-][a-z0-9]+)*", r"[a-z0-9]+([_-][a-z0-9]+)*\.(csv|json)"
_IN_SCENES = re.compile(f"{_NAME}/{_MEMBER}")


class Kind(NamedTuple):
    """A kind of scene: its level, and what it asks.

    `single` are quantities that are one number each, `functions` depend on the column ``at``.
    """

    level: int
    single: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()


KINDS: dict[str, Kind] = {
    "closed-form": Kind(1, ("ustar_m_s", "reynolds", "shields"), ("drag_n", "lift_n")),
    "collision": Kind(2, ("restitution",)),
    "incline": Kind(2, ("acceleration_over_g",)),
    "sliding": Kind(2, (), ("speed_over_start", "spin_over_start")),
    "passing": Kind(2, ("passing_time_over_t",)),
    "pivot": Kind(2, ("ustar_m_s",)),
    "flow": Kind(3, ("windward_mean",), ("ustar_over_ustar0",)),
    "pile": Kind(4, (), (*COUNTS, "ustar0_m_s", "shields")),
    "line": Kind(5, ("count",), (*COUNTS, "ustar0_m_s", "shields")),
}


class Manifest(BaseModel):
    """The manifest of a pack."""

    model_config = ConfigDict(strict=True, extra="forbid")
    format: Annotated[Literal[2], Field(alias="schema")]
    kind: Literal["benchmark pack"]
    name: str
    scenes: list[str]
    sha256: dict[str, str]
    programs: dict[str, str]
    machine: dict[str, str | int | None]


_PARAMETERS = TypeAdapter(
    dict[str, float | str], config=ConfigDict(strict=True, allow_inf_nan=False)
)


@dataclass(frozen=True)
class Problem:
    """A scene with its questions and their answers.

    `name` is unique among the scenes of its level. The entries of ``scene.json`` are `parameters`;
    `tables` lie beside it, by the stems of their files. `expected` has the columns `COLUMNS` and a
    row for each number that is asked; `at` is a text. `seconds` is the time of our answer, s.
    """

    name: str
    kind: str
    parameters: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    expected: pd.DataFrame
    seconds: float = np.nan

    @property
    def scene(self) -> str:
        """Name of its directory."""
        return f"{KINDS[self.kind].level}-{self.name}"

    @property
    def entries(self) -> Row:
        """Its entries in ``scene.json`` and ``scenes.csv``."""
        level = KINDS[self.kind].level
        return {"scene": self.scene, "level": level, "kind": self.kind, **self.parameters}

    def write(self, folder: Path) -> None:
        """Write the directory that a solver is given."""
        folder.mkdir(parents=True)
        text = json.dumps({"schema": SCHEMA, **self.entries}, indent=1, allow_nan=False)
        (folder / SCENE).write_text(text + "\n", encoding="utf-8")
        for stem, table in {**self.tables, "ask": self.expected[["quantity", "at"]]}.items():
            (folder / f"{stem}.csv").write_text(csv(table), encoding="utf-8")


def csv(table: pd.DataFrame) -> str:
    """The text of a table of a pack."""
    return table.to_csv(index=False, float_format=NUMBER)


def expectation(
    quantity: str,
    value: float,
    tolerance: float,
    at: float | None = None,
    interval: tuple[float, float] | None = None,
    ours: float = np.nan,
) -> Row:
    """A row of the expected answers.

    `at` is the argument of a quantity that is a function; the interval is by default the value
    itself. A relative tolerance of NaN is not judged. `ours` is our own answer.
    """
    place = "" if at is None else NUMBER % at
    values = (quantity, place, value, *(interval or (value, value)), tolerance, ours)
    return dict(zip(COLUMNS, values, strict=True))


@dataclass(frozen=True)
class Pack:
    """A pack that was read: its directory, its scenes' entries by name, its expected answers."""

    root: Path
    manifest: Manifest
    scenes: dict[str, Row]
    expected: pd.DataFrame


def read(root: Path) -> Pack:
    """Read a pack, and see that it is as it was exported.

    Raises InputError if there is none, or it is of another schema, changed, or holds what no export
    writes.
    """
    if not os.path.lexists(root / MANIFEST):
        raise InputError(
            f"there is no pack here: {MANIFEST} is missing",
            where=str(root),
            remedy="write one with: python -m orchestrator benchmark export",
        )
    manifest: Manifest = _validated(Manifest.model_validate_json, root / MANIFEST)
    verify(root, manifest)
    if {name.split("/")[1] for name in manifest.sha256 if "/" in name} != {*manifest.scenes}:
        _refuse(f"its manifest does not list the scenes of {SCENES}", root)
    scenes = {name: _scene(root / SCENES / name / SCENE, name) for name in manifest.scenes}
    return Pack(root, manifest, scenes, _expected(root / EXPECTED, scenes))


def verify(root: Path, manifest: Manifest) -> None:
    """See that no file of a pack has changed; raises InputError naming the first that has."""
    paths = [root / name for name in FILES]
    for path in (root / SCENES).rglob("*"):  # it does not follow links to directories
        if path.is_symlink() or not path.is_dir():
            if not _IN_SCENES.fullmatch(path.relative_to(root / SCENES).as_posix()):
                _refuse("no pack holds such a file", path)
            paths.append(path)
    for path in paths:
        _check_file(path)
    digests = digest_files(paths, root=root)
    for name in sorted({*manifest.sha256, *digests}):
        if manifest.sha256.get(name) != digests.get(name):
            how = "is missing" if name not in digests else "is not what was exported"
            _refuse(f"the file {name} {how}", root)


def _refuse(what: str, where: Path) -> NoReturn:
    raise InputError(what, where=str(where), remedy="the pack is not used: export it again")


def _check_file(path: Path) -> None:
    if not os.path.lexists(path):
        _refuse("it is missing", path)
    state = path.lstat()
    if not stat.S_ISREG(state.st_mode):
        _refuse("this is a link or no file", path)
    if state.st_size > MAX_BYTES:
        _refuse(f"it is larger than {MAX_BYTES // 2**20} MiB", path)


def _validated(validate: Callable[[bytes], Any], path: Path) -> Any:
    """The content of a JSON file; a fault is named without the value that is refused."""
    _check_file(path)
    try:
        return validate(path.read_bytes())
    except ValidationError as error:
        fault = error.errors()[0]
        _refuse(f"{'.'.join(map(str, fault['loc'][:2]))}: {fault['msg']}", path)


def _scene(path: Path, name: str) -> Row:
    parameters: Row = _validated(_PARAMETERS.validate_json, path)
    kind = KINDS.get(str(parameters.get("kind")))
    head = [parameters.get(key) for key in ("schema", "scene", "level")]
    if kind is None or head != [SCHEMA, name, kind.level] or name[0] != str(kind.level):
        _refuse(f"schema, scene, level and kind are not those of {name}", path)
    return {**parameters, "level": kind.level}


def _expected(path: Path, scenes: Mapping[str, Row]) -> pd.DataFrame:
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")
        if list(table) != ["scene", *COLUMNS]:
            _refuse(f"its columns are not scene,{','.join(COLUMNS)}", path)
        table = table.astype({"scene": object, "quantity": object, "at": object})
        numbers = table[COLUMNS[2:]].where(lambda part: part != "").astype(float)
        at = table["at"].where(table["at"] != "").astype(float)
    except (ValueError, OverflowError) as error:
        _refuse(f"it cannot be read: {error}", path)
    table[COLUMNS[2:]] = numbers
    if set(table["scene"]) != set(scenes):
        _refuse("its scenes are not those of the manifest", path)
    value, low, high, tolerance = (table[name] for name in COLUMNS[2:6])
    kinds = table["scene"].map(lambda name: KINDS[scenes[name]["kind"]])
    rows = zip(kinds, table["quantity"], table["at"], strict=True)
    asked = [quantity in (kind.functions if at else kind.single) for kind, quantity, at in rows]
    judged, counts = tolerance.notna(), table["quantity"].isin(COUNTS)
    wide = (high - low > MAX_WIDTH * value.abs()) & ~(counts & (high <= MAX_COUNT))
    faults: dict[str, Any] = {
        "asks what its kind does not": ~np.array(asked),
        "has too large a number": numbers.assign(at=at).abs().gt(LARGEST).any(axis=1),
        "has no interval that holds its value": ~((low <= value) & (value <= high)),
        "has a tolerance beyond 0 ... 0.5": judged & ~tolerance.between(0, MAX_TOLERANCE),
        "accepts any answer": judged & wide,
        "is negative": (low < 0) & (counts | (table["quantity"] == "shields")),
        "asks the same again": table.duplicated(["scene", "quantity", "at"]),
    }
    for what, where in faults.items():
        if where.any():
            _refuse(f"line {int(np.argmax(where)) + 2} {what}", path)
    if unjudged := set(scenes) - set(table["scene"][judged]):
        _refuse(f"no number of {min(unjudged)} is judged", path)
    return table


def write(
    root: Path, problems: Iterable[Problem], study: tuple[str, str], programs: Mapping[str, str]
) -> int:
    """Write a pack, in place of one that is there, and return how many scenes it has.

    Scenes of which no number is judged are left out. `root` is new, empty, or the directory of a
    pack of the same study. `study` are the name and the text of the study file; `programs` gave
    the expected answers, with their versions. Raises InputError if the directory holds something
    else.
    """
    name, text = study
    with workspace.claimed(root, workspace.PACK, name) as folder:
        about = {"kind": workspace.PACK.word, "name": name}
        folder.note(MANIFEST, text_of(about))  # it is no pack until all is there
        listed = [one for one in problems if one.expected["tolerance"].notna().any()]
        scenes = folder.clear(SCENES, lambda path: bool(_IN_SCENES.fullmatch(path)))
        for one in listed:
            one.write(scenes / one.scene)
        expected = pd.concat([one.expected.assign(scene=one.scene) for one in listed])
        times = pd.DataFrame({"scene": one.scene, "seconds": one.seconds} for one in listed)
        versions = "".join(f"- {program} {v}\n" for program, v in sorted(programs.items()))
        files = {
            EXPECTED: csv(expected[["scene", *COLUMNS]]),
            "scenes.csv": csv(pd.DataFrame(one.entries for one in listed)),
            TIMES: csv(times.dropna()),
            STUDY: text,
            "README.md": README + versions,
        }
        for file, content in files.items():
            folder.put(file, content)
        model = re.search("(?m)^model name.*: (.*)$", Path("/proc/cpuinfo").read_text("utf-8"))
        processor, paths = model[1] if model else platform.machine(), [root / f for f in files]
        manifest = {
            "schema": SCHEMA,
            "scenes": [one.scene for one in listed],
            "programs": dict(programs),
            "machine": {"processor": processor, "cores": os.cpu_count()},
            "sha256": digest_files([*paths, *scenes.glob("*/*")], root=root),
        }
        folder.note(MANIFEST, text_of(about | manifest))
    return len(listed)


README = """# A benchmark pack

Scenes of the model of Bravo, Ortiz and Pérez-Aparicio with their questions (`scenes/`) and expected
answers (`expected.csv`), for a native code of the same model. The format, schema 2, is
docs/benchmark.md of the project. Programs that gave the answers of our runs:

"""
