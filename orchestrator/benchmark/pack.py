"""A benchmark pack: its scenes and expected answers, and how they are written and read.

docs/benchmark.md is the contract for solvers. A pack may come from anywhere: `read` refuses one
whose files are not those of its manifest, or whose names, links or numbers no export makes.
"""

import json
import math
import os
import platform
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, NoReturn

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core import from_json

from orchestrator.errors import InputError
from orchestrator.physics.laws import LAWS
from orchestrator.runs import workspace
from orchestrator.runs.files import canonical_json, digest_files, digest_text, text_of
from orchestrator.types import Row

SCHEMA = 2
"""Version of the exchange format. A key or column that is renamed is a new version."""
MANIFEST, EXPECTED, STUDY, TIMES = "manifest.json", "expected.csv", "study.toml", "times.csv"
FILES = (EXPECTED, "scenes.csv", TIMES, STUDY, "README.md")
"""Files of a pack beside its manifest and the directory of its scenes."""
SCENES, SCENE, ASK = "scenes", "scene.json", "ask.csv"
COLUMNS = ("quantity", "at", "value", "low", "high", "tolerance", "ours")
"""Columns of the expected answers beside the scene's name."""
COUNTS = ("moved", "not_moved", "carried_off")
"""Quantities that count grains."""
NUMBER = "%.9g"
"""Format of the numbers in all tables of a pack."""
MAX_BYTES, MAX_SCENES, MAX_MEMBERS = 64 * 2**20, 20_000, 20
"""Size of a file, scenes of a pack, files of a scene."""
MAX_TOLERANCE, MAX_WIDTH = 0.5, 10.0
"""Bounds of what is judged: the tolerance, and the width of an interval over its value. A pack with
wider ones would pass any answer."""
_NAME, _MEMBER = r"[1-5]-[a-z0-9]+([.+-][a-z0-9]+)*", r"[a-z0-9]+([_-][a-z0-9]+)*\.(csv|json)"
_BED = (*COUNTS, "ustar0_m_s", "shields")
_GRAIN = ("d_m", "rho_sol_kg_m3", "damping", "time_step", "reduced_gravity_m_s2")
_FLUID = ("rho_f_kg_m3", "nu_m2_s", "g_m_s2", "alpha_deg", "beta_deg", "z0_m", "alpha_s")


SIGNED = ("alpha_deg", "alpha_s")
"""Required numbers that may be zero or negative."""


class Kind(NamedTuple):
    """A kind of scene: its level, its required numbers, and what it asks.

    `single` are quantities that are one number each, `functions` depend on the column ``at``.
    """

    level: int
    required: tuple[str, ...]
    single: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()


KINDS: dict[str, Kind] = {
    "closed-form": Kind(
        1,
        ("d_m", "rho_sol_kg_m3", *_FLUID),
        ("ustar_m_s", "reynolds", "shields"),
        ("drag_n", "lift_n"),
    ),
    "collision": Kind(2, (*_GRAIN, "speed_m_s"), ("restitution",)),
    "incline": Kind(2, (*_GRAIN, "incline_deg"), ("acceleration_over_g",)),
    "sliding": Kind(2, (*_GRAIN, "speed_m_s"), (), ("speed_over_start", "spin_over_start")),
    "passing": Kind(
        2,
        (*_GRAIN, "beta_deg", "displacement_criterion", "force_n", "weight_n", "stiffness"),
        ("passing_time_over_t",),
    ),
    "pivot": Kind(2, (*_GRAIN, *_FLUID), ("ustar_m_s",)),
    "flow": Kind(3, ("alpha_deg", "z0_m"), ("windward_mean",), ("ustar_over_ustar0",)),
    "pile": Kind(4, (*_GRAIN, *_FLUID, "count"), (), _BED),
    "line": Kind(5, (*_GRAIN, *_FLUID), ("count",), _BED),
}

Text = Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._+-]{0,79}$")]
Whole = Annotated[int, Field(ge=-(2**53), le=2**53)]
SceneName = Annotated[str, Field(max_length=120, pattern=f"^{_NAME}$")]
Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,79}$")]


class Manifest(BaseModel):
    """The manifest of a pack."""

    model_config = ConfigDict(strict=True, extra="forbid")
    kind: Literal["benchmark pack"]
    name: Text
    format: Annotated[Literal[2], Field(alias="schema")]
    scenes: Annotated[list[SceneName], Field(min_length=1, max_length=MAX_SCENES)]
    sha256: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]]
    programs: dict[Text, Text] = {}
    machine: dict[Text, Text | Whole | None] = {}


_PARAMETERS = TypeAdapter(
    dict[Key, Whole | float | Word], config=ConfigDict(strict=True, allow_inf_nan=False)
)


@dataclass(frozen=True)
class Problem:
    """A scene at a level.

    Attributes
    ----------
    name : str
        Name of the scene, unique among those of its level.
    kind : str
        One of `KINDS`.
    parameters : mapping
        Numbers and words, SI units in their names.
    tables : mapping of str to DataFrame
        Tables that lie beside them, by the stem of the file's name.
    expected : DataFrame
        Columns `COLUMNS`, a row for each number that is asked; `at` is a text.
    seconds : float
        Time of our answer, s; NaN if it is not known.
    """

    name: str
    kind: str
    parameters: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    expected: pd.DataFrame
    seconds: float = float("nan")

    @property
    def level(self) -> int:
        """Its level, 1 to 5."""
        return KINDS[self.kind].level

    @property
    def scene(self) -> str:
        """Name of its directory."""
        return f"{self.level}-{self.name}"

    @property
    def head(self) -> Row:
        """Its first entries in ``scene.json`` and ``scenes.csv``."""
        return {"scene": self.scene, "level": self.level, "kind": self.kind}

    def write(self, folder: Path) -> None:
        """Write the directory that a solver is given."""
        folder.mkdir(parents=True)
        text = json.dumps(
            {"schema": SCHEMA, **self.head, **self.parameters}, indent=1, allow_nan=False
        )
        (folder / SCENE).write_text(text + "\n", encoding="utf-8")
        for stem, table in {**self.tables, "ask": self.expected[["quantity", "at"]]}.items():
            (folder / f"{stem}.csv").write_text(csv(table), encoding="utf-8")


def csv(table: pd.DataFrame) -> str:
    """The text of a table; a pack has thousands, and pandas takes a millisecond for each."""
    columns = [
        [
            "" if v != v else NUMBER % v if isinstance(v, float) else str(v)
            for v in table[c].tolist()
        ]
        for c in table
    ]
    rows = map(",".join, zip(*columns, strict=True))
    return "\n".join([",".join(map(str, table)), *rows, ""])


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


def table_of(rows: Iterable[Row]) -> pd.DataFrame:
    """The table of rows that `expectation` gives."""
    return pd.DataFrame(list(rows), columns=list(COLUMNS))


@dataclass(frozen=True)
class Pack:
    """A pack that was read.

    Attributes
    ----------
    root : Path
        Its directory.
    scenes : dict of str to dict
        The parameters of each scene, by its name, as its ``scene.json`` has them.
    expected : DataFrame
        ``scene`` and `COLUMNS`; `at` is a text.
    manifest : Manifest
        Its manifest.
    """

    root: Path
    scenes: dict[str, Row]
    expected: pd.DataFrame
    manifest: Manifest

    @property
    def digest(self) -> str:
        """One digest of questions and expected answers; the times of our runs do not count."""
        sums = {name: digest for name, digest in self.manifest.sha256.items() if name != TIMES}
        return digest_text(canonical_json(sums))

    def directory(self, scene: str) -> Path:
        """The directory that the solver of a scene gets."""
        return self.root / SCENES / scene

    def verify(self) -> None:
        """See that no file has changed.

        Raises
        ------
        InputError
            Naming the first file that is not as the manifest says.
        """
        digests = digest_files(_members(self.root).values(), root=self.root)
        stated = self.manifest.sha256
        for name in sorted({*stated, *digests}):
            if stated.get(name) != digests.get(name):
                how = "is missing" if name not in digests else "is not what was exported"
                _refuse(f"the file {name} {how}", self.root)


def read(root: Path) -> Pack:
    """Read a pack, and see that it is as it was exported.

    Raises
    ------
    InputError
        If there is none, or it is of another schema, changed, or holds what no export writes.
    """
    if not os.path.lexists(root / MANIFEST):
        raise InputError(
            f"there is no pack here: {MANIFEST} is missing",
            where=str(root),
            remedy="write one with: python -m orchestrator benchmark export",
        )
    value = _json(root / MANIFEST)
    schema = value.get("schema") if isinstance(value, dict) else None
    if isinstance(schema, int) and schema != SCHEMA:
        refuse_schema(f"its schema is {schema}, and this program reads {SCHEMA}", root / MANIFEST)
    manifest: Manifest = _checked(Manifest.model_validate, value, root / MANIFEST)
    pack = Pack(root, {}, pd.DataFrame(), manifest)
    pack.verify()
    folders = {name.split("/")[1] for name in manifest.sha256 if name.startswith(f"{SCENES}/")}
    if folders != {*manifest.scenes} or len(folders) < len(manifest.scenes):
        _refuse(f"its manifest does not list each scene of {SCENES} once", root)
    _check_study(root / STUDY)
    scenes = {name: _scene(root / SCENES / name / SCENE, name) for name in manifest.scenes}
    expected = _expected(root / EXPECTED, scenes)
    for name, asked in expected.groupby("scene", sort=False):
        path = root / SCENES / str(name) / ASK
        _check_file(path)
        if path.read_bytes() != csv(asked[["quantity", "at"]]).encode():
            _refuse(f"it does not ask what {EXPECTED} answers", path)
    return replace(pack, scenes=scenes, expected=expected)


def _refuse(what: str, where: Path) -> NoReturn:
    raise InputError(what, where=str(where), remedy="the pack is not used: export it again")


def _members(root: Path) -> dict[str, Path]:
    """Every file of a pack but the manifest, by its name; refuses links and strange names."""

    def entries(folder: Path, pattern: str, most: int) -> list[Path]:
        if folder.is_symlink() or not folder.is_dir():
            _refuse("this is no directory", folder)
        names = sorted(os.listdir(folder))
        strange = [name for name in names if not re.fullmatch(pattern, name)]
        if strange or len(names) > most:
            _refuse("no pack holds such a file, or as many", folder / (strange or names)[0])
        return [folder / name for name in names]

    folders = entries(root / SCENES, _NAME, MAX_SCENES)
    paths = [path for folder in folders for path in entries(folder, _MEMBER, MAX_MEMBERS)]
    paths += [root / name for name in FILES]
    for path in paths:
        _check_file(path)
    return {path.relative_to(root).as_posix(): path for path in paths}


def _check_file(path: Path) -> None:
    try:
        state = path.lstat()
    except OSError as error:
        _refuse(f"it cannot be read: {error.strerror}", path)
    if not stat.S_ISREG(state.st_mode):
        _refuse("this is a link or no file", path)
    if state.st_size > MAX_BYTES:
        _refuse(f"it is larger than {MAX_BYTES // 2**20} MiB", path)


def _json(path: Path) -> Any:
    _check_file(path)
    try:
        return from_json(path.read_bytes(), allow_inf_nan=False)
    except ValueError as error:
        _refuse(f"it cannot be read: {error}", path)


def refuse_schema(what: str, where: Path) -> NoReturn:
    """Refuse a pack or answers of another schema, and name the table of renamed keys."""
    raise InputError(
        what,
        where=str(where),
        remedy="export the pack again; 'Old and new names' in docs/benchmark.md lists the keys",
    )


def _checked(check: Callable[[Any], Any], value: Any, path: Path) -> Any:
    try:
        return check(value)
    except ValidationError as error:
        fault = error.errors()[0]
        _refuse(f"{'.'.join(map(str, fault['loc'][:2]))}: {fault['msg']}", path)


def _scene(path: Path, name: str) -> Row:
    parameters: Row = _checked(_PARAMETERS.validate_python, _json(path), path)
    kind = KINDS.get(str(parameters.get("kind")))
    head = [parameters.get(key) for key in ("schema", "scene", "level")]
    if kind is None or head != [SCHEMA, name, kind.level] or name[0] != str(kind.level):
        _refuse(f"schema, scene, level and kind are not those of {name}", path)
    for key in kind.required:
        value = parameters.get(key)
        is_positive = isinstance(value, int | float) and 0 < value < 1e30
        if not is_positive and not (key in SIGNED and isinstance(value, int | float)):
            _refuse(f"{key} is no number of its kind", path)
    if "alpha_s" in kind.required and parameters.get("force_law") not in LAWS:
        _refuse(f"force_law is none of {', '.join(LAWS)}", path)
    if parameters.get("rho_f_kg_m3", 0.0) >= parameters.get("rho_sol_kg_m3", math.inf):
        _refuse("the grains are not denser than the fluid", path)
    return parameters


def _expected(path: Path, scenes: Mapping[str, Row]) -> pd.DataFrame:
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")
        if list(table.columns) != ["scene", *COLUMNS]:
            _refuse(f"its columns are not scene,{','.join(COLUMNS)}", path)
        numbers = table[list(COLUMNS[2:])].where(lambda part: part != "").astype(float)
    except (ValueError, OverflowError) as error:
        _refuse(f"it cannot be read: {error}", path)
    table[list(COLUMNS[2:])] = numbers
    if set(table["scene"]) != set(scenes):
        _refuse("its scenes are not those of the manifest", path)
    at = pd.to_numeric(table["at"], errors="coerce")
    value, low, high = table["value"], table["low"], table["high"]
    is_function = table["at"] != ""
    asked = [
        quantity
        in (KINDS[scenes[name]["kind"]].functions if at else KINDS[scenes[name]["kind"]].single)
        for name, quantity, at in zip(table["scene"], table["quantity"], is_function, strict=True)
    ]
    judged, counts = table["tolerance"].notna(), table["quantity"].isin(COUNTS)
    wide = high - low > MAX_WIDTH * value.abs()
    faults = {
        "asks what its kind does not": ~pd.Series(asked),
        "has an at that is no number": is_function & ~(at.abs() < 1e30),
        "lacks a finite value": ~(value.abs() < 1e30),
        "has no interval that holds its value": ~((low <= value) & (value <= high)),
        "has a tolerance beyond 0 ... 0.5": judged & ~table["tolerance"].between(0, MAX_TOLERANCE),
        "accepts any answer": judged & wide & ~(counts & (high <= 1e6)),
        "has an infinite number of ours": table["ours"].abs() > 1e30,
        "has a negative count or Shields number": (low < 0)
        & (counts | (table["quantity"] == "shields")),
        "asks the same again": table.duplicated(["scene", "quantity", "at"]),
    }
    for what, where in faults.items():
        if where.any():
            _refuse(f"line {int(where.to_numpy().argmax()) + 2} {what}", path)
    unjudged = set(scenes) - set(table["scene"][judged])
    if unjudged:
        _refuse(f"no number of {min(unjudged)} is judged", path)
    return table


def _check_study(path: Path) -> None:
    """See that the study of a pack is whole by itself: it may read no file."""
    try:
        study = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        _refuse(f"it cannot be read: {error}", path)
    texts = study.get("profiles", {})
    for name in _files_of(study):
        if not isinstance(texts, dict) or name not in texts:
            _refuse("its study names a file; a pack has the text of each in [profiles]", path)


def _files_of(value: Any, key: str = "") -> Iterator[str]:
    """The names of files in a study: the texts under ``profile`` and ``sizes``."""
    if isinstance(value, dict):
        for name, part in value.items():
            if name != "profiles":
                yield from _files_of(part, name.rpartition(".")[2])
    elif isinstance(value, list):
        for part in value:
            yield from _files_of(part, key)
    elif isinstance(value, str) and key in ("profile", "sizes"):
        yield value


def mobile_grains(pack: Pack, scene: str) -> int:
    """How many grains of a scene may move.

    Raises
    ------
    InputError
        If its table of grains cannot be read.
    """
    path = pack.directory(scene) / "grains.csv"
    _check_file(path)
    try:
        kinds = pd.read_csv(path, usecols=["kind"], dtype=str, encoding="utf-8")["kind"]
    except (ValueError, OverflowError) as error:
        _refuse(f"it cannot be read: {error}", path)
    return int((kinds != "fixed").sum())


def write(
    root: Path, problems: Iterable[Problem], study: tuple[str, str], programs: Mapping[str, str]
) -> int:
    """Write a pack, in place of one that is there, and return how many scenes it has.

    Scenes of which no number is judged are left out.

    Parameters
    ----------
    root : Path
        Its directory; new, empty, or that of a pack of the same study.
    problems : iterable of Problem
        Its scenes.
    study : tuple of str
        Name and text of their study file.
    programs : mapping of str to str
        Programs of the expected answers, with versions.

    Raises
    ------
    InputError
        If the directory holds something else.
    """
    name, text = study
    with workspace.claimed(root, workspace.PACK, name) as folder:
        about = {"kind": workspace.PACK.word, "name": name}
        folder.note(MANIFEST, text_of(about))  # it is no pack until all is there
        listed = [one for one in problems if one.expected["tolerance"].notna().any()]
        scenes = folder.clear(SCENES, lambda path: bool(re.fullmatch(f"{_NAME}/{_MEMBER}", path)))
        for one in listed:
            one.write(scenes / one.scene)
        expected = pd.concat([p.expected.assign(scene=p.scene) for p in listed], ignore_index=True)
        times = pd.DataFrame({"scene": p.scene, "seconds": p.seconds} for p in listed)
        heads = pd.DataFrame({**p.head, **p.parameters} for p in listed)
        folder.put("scenes.csv", csv(heads.astype(object)))
        folder.put(TIMES, csv(times.dropna()))
        folder.put(EXPECTED, csv(expected[["scene", *COLUMNS]]))
        folder.put(STUDY, text)
        versions = "".join(f"- {n} {v}\n" for n, v in sorted(programs.items()))
        folder.put("README.md", README + versions)
        processor = re.search("(?m)^model name.*: (.*)$", Path("/proc/cpuinfo").read_text("utf-8"))
        manifest = {
            **about,
            "schema": SCHEMA,
            "scenes": [one.scene for one in listed],
            "programs": dict(programs),
            "machine": {
                "processor": processor[1] if processor else platform.machine(),
                "cores": os.cpu_count(),
            },
            "sha256": digest_files(_members(root).values(), root=root),
        }
        folder.note(MANIFEST, text_of(manifest))
    return len(listed)


README = """# A benchmark pack

Scenes of the model of Bravo, Ortiz and Pérez-Aparicio with their questions (`scenes/`) and expected
answers (`expected.csv`), for a native code of the same model. The format, schema 2, is
docs/benchmark.md of the project. Programs that gave the answers of our runs:

"""
