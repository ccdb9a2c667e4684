"""A benchmark pack on disk: its scenes, questions and expected answers.

docs/benchmark.md is the contract for solvers. `read_pack` refuses a pack whose files
are not those of its manifest, or whose names or links lead out of it: a pack may come
from anywhere.
"""

import json
import math
import os
import platform
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from orchestrator.errors import InputError
from orchestrator.runs import processors, workspace
from orchestrator.runs.files import (
    beside_package,
    canonical_json,
    digest_files,
    digest_text,
    text_of,
)
from orchestrator.types import Row

SCHEMA = 2
"""Version of the exchange format. A key or column that is renamed is a new version."""
MANIFEST = "manifest.json"
EXPECTED = "expected.csv"
LIST = "scenes.csv"
STUDY = "study.toml"
TIMES = "times.csv"
ABOUT = "README.md"
FILES = (EXPECTED, LIST, TIMES, STUDY, ABOUT)
"""Files of a pack beside its manifest and the directory of its scenes."""
SCENES = "scenes"
"""The directory of the scenes."""
SCENE = "scene.json"
"""The file of a scene with its entries."""
COLUMNS = ["quantity", "at", "value", "low", "high", "tolerance", "ours"]
"""Columns of the expected answers beside the scene's name."""
COUNTS = ("moved", "not_moved", "carried_off")
"""Quantities that count grains."""
LARGEST_TOLERANCE = 1.0
"""Largest relative tolerance of an expected answer."""
NUMBER = "%.9g"
"""Format of the numbers in all tables."""
OF_POCKET = "pivot"
"""Kind of the scenes in which a grain is moved out of its pocket in time."""
KINDS = {
    "closed-form": 1,
    "collision": 2,
    "incline": 2,
    "sliding": 2,
    "passing": 2,
    OF_POCKET: 2,
    "flow": 3,
    "pile": 4,
    "line": 5,
}
"""Kinds of scenes, and the level of each."""
CONTRACT = "## Write a solver\n"
"""Heading in docs/benchmark.md with which the contract for solvers begins."""
AFTER_CONTRACT = "## Where to go next\n"
"""Heading behind the contract: its links lead nowhere from a pack."""
_DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
"""A number as programs print it: Python would take 1_000 and other scripts, too."""
_IN_SCENES = re.compile(
    r"[1-5]-[a-z0-9]+([.+-][a-z0-9]+)*/[a-z0-9]+([_-][a-z0-9]+)*\.(csv|json)"
)


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


_ENTRIES = TypeAdapter(
    dict[str, float | str], config=ConfigDict(strict=True, allow_inf_nan=False)
)


@dataclass(frozen=True)
class Problem:
    """A scene with its questions and their answers.

    Attributes
    ----------
    name
        A name that no other scene of its level has.
    kind
        Its kind, one of `KINDS`.
    parameters
        The entries of ``scene.json``.
    tables
        The tables beside it, by the stems of their files.
    rows
        A row for each number that is asked, made by `expectation`.
    runs
        Names of the cases of our answer.
    seconds
        The time of our answer, s.
    """

    name: str
    kind: str
    parameters: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    rows: Sequence[Row]
    runs: tuple[str, ...] = ()
    seconds: float = np.nan

    def with_table(self, stem: str, table: pd.DataFrame) -> "Problem":
        """Add a table.

        Parameters
        ----------
        stem
            The stem of its file.
        table
            The table.

        Returns
        -------
        Problem
            The problem with the table.
        """
        return replace(self, tables={**self.tables, stem: table})

    @property
    def scene(self) -> str:
        """Name of its directory."""
        return f"{KINDS[self.kind]}-{self.name}"

    @property
    def expected(self) -> pd.DataFrame:
        """The expected answers: columns `COLUMNS`; ``at`` is a text."""
        return pd.DataFrame(self.rows, columns=COLUMNS)

    @property
    def entries(self) -> Row:
        """Its entries in ``scene.json`` and ``scenes.csv``."""
        head = {"scene": self.scene, "level": KINDS[self.kind], "kind": self.kind}
        return {**head, **self.parameters}

    def write(self, folder: Path) -> None:
        """Write the directory that a solver is given.

        Parameters
        ----------
        folder
            The directory, which does not exist yet.
        """
        folder.mkdir(parents=True)
        text = json.dumps({"schema": SCHEMA, **self.entries}, indent=1, allow_nan=False)
        (folder / SCENE).write_text(text + "\n", encoding="utf-8")
        questions = self.expected[["quantity", "at"]]
        for stem, table in {**self.tables, "ask": questions}.items():
            (folder / f"{stem}.csv").write_text(csv_of(table), encoding="utf-8")


def csv_of(table: pd.DataFrame) -> str:
    """Write a table of a pack.

    Parameters
    ----------
    table
        The table.

    Returns
    -------
    str
        Its text.
    """
    return table.to_csv(index=False, float_format=NUMBER)


def expectation(
    quantity: str,
    value: float,
    tolerance: float,
    at: float | None = None,
    *interval: float,
) -> Row:
    """Make a row of the expected answers; the value is also our answer.

    Parameters
    ----------
    quantity
        The quantity that is asked.
    value
        The expected answer.
    tolerance
        Relative tolerance; a number whose tolerance is NaN is not judged.
    at
        Argument of a quantity that is a function.
    *interval
        Low and high end of the expected answer, by default the value itself.

    Returns
    -------
    dict
        The columns `COLUMNS`.

    Examples
    --------
    >>> expectation("moved", 3.0, 0.0, 7, 2.0, 4.0)["at"]
    '7'
    """
    low, high = interval or (value, value)
    return {
        "quantity": quantity,
        "at": "" if at is None else NUMBER % at,
        "value": value,
        "low": low,
        "high": high,
        "tolerance": tolerance,
        "ours": value,
    }


def number_of(text: str) -> float:
    """Read a finite number.

    Parameters
    ----------
    text
        The number as programs print it.

    Returns
    -------
    float
        The number.

    Raises
    ------
    ValueError
        If it is no number, or beyond the largest double.

    Examples
    --------
    >>> number_of(" 1e-3")
    0.001
    """
    if not _DECIMAL.fullmatch(text.strip()):
        raise ValueError(f"{text!r} is not a number")
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text!r} is beyond the largest double")
    return number


@dataclass(frozen=True)
class Pack:
    """A pack that was read.

    Attributes
    ----------
    root
        Its directory.
    manifest
        Its manifest.
    scenes
        The entries of each scene, by its name.
    expected
        The expected answers: columns ``scene`` and `COLUMNS`.
    """

    root: Path
    manifest: Manifest
    scenes: dict[str, Row]
    expected: pd.DataFrame

    @property
    def questions(self) -> str:
        """Digest of all that a solver is given: answers belong to these questions.

        A pack that was exported again has the same one, unless a scene has changed.
        """
        given = {}
        for name, digest in self.manifest.sha256.items():
            if name.startswith(f"{SCENES}/"):
                given[name] = digest
        return digest_text(canonical_json(given))

    def chosen(
        self, levels: Collection[int] = (), patterns: Collection[str] = ()
    ) -> list[str]:
        """Choose scenes.

        Parameters
        ----------
        levels
            Levels of the scenes; all if empty.
        patterns
            Patterns of their names; all if empty.

        Returns
        -------
        list of str
            Names of the scenes, by rising level.

        Raises
        ------
        InputError
            If none is left.
        """
        names = []
        for name, given in self.scenes.items():
            is_of_level = not levels or given["level"] in levels
            fits = any(fnmatchcase(name, pattern) for pattern in patterns or ["*"])
            if is_of_level and fits:
                names.append(name)
        if not names:
            remedy = "see its scenes.csv, and --level and --scene"
            raise InputError("no scene of the pack is chosen", str(self.root), remedy)
        return sorted(names, key=lambda name: self.scenes[name]["level"])


def read_pack(root: Path) -> Pack:
    """Read a pack.

    Parameters
    ----------
    root
        Its directory.

    Returns
    -------
    Pack
        The pack.

    Raises
    ------
    InputError
        If there is none, or it is of another schema or changed.
    """
    if not os.path.lexists(root / MANIFEST):
        what = f"there is no pack here: {MANIFEST} is missing"
        remedy = "write one with: python -m orchestrator benchmark export"
        if (root / EXPECTED).is_file() and not (root / SCENES).exists():
            what = f"it has no {SCENES}"
            what = f"this is a table of expected answers, and no pack: {what}"
            remedy = "its README.md says how the pack is written"
        raise InputError(what, str(root), remedy)
    path = root / MANIFEST
    try:
        manifest = Manifest.model_validate_json(path.read_bytes())
        verify(root, manifest)
        scenes: dict[str, Row] = {}
        for name in manifest.scenes:
            path = root / SCENES / name / SCENE
            entries = _ENTRIES.validate_json(path.read_bytes())
            head = [entries.get(key) for key in ("schema", "scene", "level")]
            level = KINDS.get(str(entries.get("kind")), 0)
            if head != [SCHEMA, name, level]:
                _refuse(f"schema, scene, level and kind are not those of {name}", path)
            entries["level"] = level
            scenes[name] = entries
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"][:2]))
        _refuse(f"{place}: {fault['msg']}", path)
    return Pack(root, manifest, scenes, _expected(root / EXPECTED, scenes))


def verify(root: Path, manifest: Manifest) -> None:
    """See that no file of a pack has changed.

    Parameters
    ----------
    root
        Its directory.
    manifest
        Its manifest, with the digests.

    Raises
    ------
    InputError
        If one has; it names the first.
    """
    paths = [root / name for name in FILES]
    for path in (root / SCENES).rglob("*"):  # it does not follow links to directories
        if path.is_symlink() or not path.is_dir():
            if not _IN_SCENES.fullmatch(path.relative_to(root / SCENES).as_posix()):
                _refuse("no pack holds such a file", path)
            paths.append(path)
    for path in paths:
        if path.is_symlink() or not path.is_file():
            _refuse("it is missing, or it is a link or no file", path)
    digests = digest_files(paths, root=root)
    for name in sorted({*manifest.sha256, *digests}):
        if manifest.sha256.get(name) != digests.get(name):
            how = "is missing" if name not in digests else "is not what was exported"
            _refuse(f"the file {name} {how}", root)
    directories = {name.split("/")[1] for name in manifest.sha256 if "/" in name}
    if directories != {*manifest.scenes}:
        _refuse(f"its manifest does not list the scenes of {SCENES}", root)


def _refuse(what: str, where: Path) -> NoReturn:
    """Refuse a pack."""
    remedy = "the pack is not used: export it again"
    raise InputError(what, where=str(where), remedy=remedy)


def _expected(path: Path, scenes: Mapping[str, Row]) -> pd.DataFrame:
    """Read the expected answers of some scenes; refuse some that mean nothing."""
    texts = ["scene", *COLUMNS[:2]]
    numbers = COLUMNS[2:]
    kinds = {**dict.fromkeys(texts, object), **dict.fromkeys(numbers, float)}
    absent: Any = {
        "keep_default_na": False,
        "na_values": {key: [""] for key in numbers},
    }
    try:
        table: pd.DataFrame = pd.read_csv(path, dtype=kinds, **absent)
        if [*table] != [*texts, *numbers] or {*table["scene"]} != {*scenes}:
            raise ValueError("its columns or its scenes are others")
        for at in table["at"].unique():
            number_of(at or "0")
        if not np.isfinite(table[["value", "low", "high"]]).all(axis=None):
            raise ValueError("a number is missing or infinite")
        tolerance = table["tolerance"].fillna(0.0)
        if not tolerance.between(0.0, LARGEST_TOLERANCE).all():
            raise ValueError(f"a tolerance is not between 0 and {LARGEST_TOLERANCE:g}")
        if (table["low"] > table["high"]).any():
            raise ValueError("an interval ends below its beginning")
    except ValueError as error:
        _refuse(f"it cannot be read: {error}", path)
    return table


def write_pack(
    root: Path,
    problems: Iterable[Problem],
    study: tuple[str, str],
    programs: Mapping[str, str],
) -> int:
    """Write a pack, in place of one of the same study.

    Scenes of which no number is judged are left out.

    Parameters
    ----------
    root
        Its directory.
    problems
        The scenes.
    study
        Name and text of the study file.
    programs
        The programs that gave the expected answers, with their versions.

    Returns
    -------
    int
        How many scenes it has.

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
        scenes = folder.clear(SCENES)
        for one in listed:
            one.write(scenes / one.scene)
        expected = pd.concat([one.expected.assign(scene=one.scene) for one in listed])
        scene_names = [one.scene for one in listed]
        seconds = [one.seconds for one in listed]
        times = pd.DataFrame({"scene": scene_names, "seconds": seconds})
        files = {
            EXPECTED: csv_of(expected[["scene", *COLUMNS]]),
            LIST: csv_of(pd.DataFrame(one.entries for one in listed)),
            TIMES: csv_of(times.dropna()),
            STUDY: text,
            ABOUT: _readme(programs),
        }
        for file, content in files.items():
            folder.put(file, content)
        paths = [root / file for file in files]
        manifest = {
            "schema": SCHEMA,
            "scenes": scene_names,
            "programs": dict(programs),
            "machine": {"processor": _processor(), "cores": processors.usable_count()},
            "sha256": digest_files([*paths, *scenes.glob("*/*")], root=root),
        }
        folder.note(MANIFEST, text_of(about | manifest))
    return len(listed)


def _processor() -> str:
    """Name of the processor."""
    text = Path("/proc/cpuinfo").read_text("utf-8")
    model = re.search("(?m)^model name.*: (.*)$", text)
    return model[1] if model else platform.machine()


README = (
    "# A benchmark pack\n\n"
    "Scenes of the model of Bravo, Ortiz and Pérez-Aparicio with their questions"
    " (`scenes/`) and expected\n"
    "answers (`expected.csv`), for a native code of the same model. What follows is all"
    " that a solver has\n"
    "to know, schema 2; the program `orchestrator` runs and judges one:"
    " `orchestrator benchmark run PACK\n"
    "--solver 'my-solver {case} {out}'`.\n\n"
)
"""Beginning of the README of a pack."""


def contract() -> str:
    """The contract for solvers, a part of the page docs/benchmark.md.

    The page lies beside the package, or in it in a wheel.

    Returns
    -------
    str
        The page from its section "Write a solver" to the links at its end.
    """
    page = (beside_package("docs") / "benchmark.md").read_text(encoding="utf-8")
    return page[page.index(CONTRACT) : page.index(AFTER_CONTRACT)]


def _readme(programs: Mapping[str, str]) -> str:
    """The README of a pack, with the programs of our answers and their versions."""
    text = README + contract()
    if programs:
        text += "\n## Programs that gave the answers of our runs\n\n"
    for program, version in sorted(programs.items()):
        text += f"- {program} {version}\n"
    return text
