"""A benchmark pack on disk: its scenes, questions and expected answers, written and read.

docs/benchmark.md is the contract for solvers. `read` refuses a pack whose files are not those of
its manifest, or whose names or links lead out of it: a pack may come from anywhere.
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
from orchestrator.runs import workspace
from orchestrator.runs.case import PACKAGE
from orchestrator.runs.files import canonical_json, digest_files, digest_text, text_of
from orchestrator.types import Row

SCHEMA = 2
"""Version of the exchange format. A key or column that is renamed is a new version."""
MANIFEST, EXPECTED, STUDY, TIMES = (
    "manifest.json",
    "expected.csv",
    "study.toml",
    "times.csv",
)
FILES = (EXPECTED, "scenes.csv", TIMES, STUDY, "README.md")
"""Files of a pack beside its manifest and the directory of its scenes."""
SCENES, SCENE = "scenes", "scene.json"
COLUMNS = ["quantity", "at", "value", "low", "high", "tolerance", "ours"]
"""Columns of the expected answers beside the scene's name."""
COUNTS = ("moved", "not_moved", "carried_off")
"""Quantities that count grains."""
LARGEST_TOLERANCE = 1.0  # relative, of an expected answer
NUMBER = "%.9g"  # format of the numbers in all tables
KINDS = {
    **{
        "closed-form": 1,
        "collision": 2,
        "incline": 2,
        "sliding": 2,
        "passing": 2,
        "pivot": 2,
    },
    **{"flow": 3, "pile": 4, "line": 5},
}
"""Kinds of scenes, and the level of each."""
CONTRACT = "## Write a solver\n"
"""Heading in docs/benchmark.md with which the contract for solvers begins."""
_DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
"""A number as programs print it; Python would also take 1_000 and digits of other scripts."""
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

    `name` is unique among the scenes of its level. The entries of ``scene.json`` are `parameters`;
    `tables` lie beside it, by the stems of their files. `rows` are made by `expectation`, one for
    each number that is asked. `runs` are the names of the cases of our answer, `seconds` is its
    time, s.
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
        """Write the directory that a solver is given."""
        folder.mkdir(parents=True)
        text = json.dumps({"schema": SCHEMA, **self.entries}, indent=1, allow_nan=False)
        (folder / SCENE).write_text(text + "\n", encoding="utf-8")
        for stem, table in {
            **self.tables,
            "ask": self.expected[["quantity", "at"]],
        }.items():
            (folder / f"{stem}.csv").write_text(csv(table), encoding="utf-8")


def csv(table: pd.DataFrame) -> str:
    """The text of a table of a pack."""
    return table.to_csv(index=False, float_format=NUMBER)


def expectation(
    quantity: str,
    value: float,
    tolerance: float,
    at: float | None = None,
    *interval: float,
) -> Row:
    """A row of the expected answers; the value is also our answer.

    `at` is the argument of a quantity that is a function; the interval, low and high, is by default
    the value itself. A relative tolerance of NaN is not judged.
    """
    place = "" if at is None else NUMBER % at
    values = (quantity, place, value, *(interval or (value, value)), tolerance, value)
    return dict(zip(COLUMNS, values, strict=True))


def number_of(text: str) -> float:
    """A finite number from its text; ValueError for any other text."""
    if not _DECIMAL.fullmatch(text.strip()):
        raise ValueError(f"{text!r} is not a number")
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text!r} is beyond the largest double")
    return number


@dataclass(frozen=True)
class Pack:
    """A pack that was read: its directory, its scenes' entries by name, its expected answers."""

    root: Path
    manifest: Manifest
    scenes: dict[str, Row]
    expected: pd.DataFrame

    @property
    def questions(self) -> str:
        """Digest of all that a solver is given: answers belong to these questions alone.

        A pack that was exported again has the same one, unless a scene has changed.
        """
        asked = self.manifest.sha256.items()
        given = {
            name: digest for name, digest in asked if name.startswith(f"{SCENES}/")
        }
        return digest_text(canonical_json(given))

    def chosen(
        self, levels: Collection[int] = (), patterns: Collection[str] = ()
    ) -> list[str]:
        """Names of the scenes of some levels and patterns, empty for all, by rising level.

        Raises InputError if none is left.
        """
        names = []
        for name, given in self.scenes.items():
            is_of_level = not levels or given["level"] in levels
            if is_of_level and any(
                fnmatchcase(name, pattern) for pattern in patterns or ["*"]
            ):
                names.append(name)
        if not names:
            remedy = "see its scenes.csv, and --level and --scene"
            raise InputError("no scene of the pack is chosen", str(self.root), remedy)
        return sorted(names, key=lambda name: self.scenes[name]["level"])


def read(root: Path) -> Pack:
    """Read a pack; raises InputError if there is none, or it is of another schema or changed."""
    if not os.path.lexists(root / MANIFEST):
        what = f"there is no pack here: {MANIFEST} is missing"
        remedy = "write one with: python -m orchestrator benchmark export"
        if (root / EXPECTED).is_file() and not (root / SCENES).exists():
            what = (
                f"this is a table of expected answers, and no pack: it has no {SCENES}"
            )
            remedy = "its README.md says how the pack is written"
        raise InputError(what, str(root), remedy)
    path = root / MANIFEST
    try:
        manifest = Manifest.model_validate_json(path.read_bytes())
        verify(root, manifest)
        scenes: dict[str, Row] = {}
        for name in manifest.scenes:
            path = root / SCENES / name / SCENE
            entries = scenes[name] = _ENTRIES.validate_json(path.read_bytes())
            head = [entries.get(key) for key in ("schema", "scene", "level")]
            if head != [SCHEMA, name, KINDS.get(str(entries.get("kind")), 0)]:
                _refuse(f"schema, scene, level and kind are not those of {name}", path)
            entries["level"] = int(entries["level"])
    except ValidationError as error:
        fault = error.errors()[0]
        _refuse(f"{'.'.join(map(str, fault['loc'][:2]))}: {fault['msg']}", path)
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
        if path.is_symlink() or not path.is_file():
            _refuse("it is missing, or it is a link or no file", path)
    digests = digest_files(paths, root=root)
    for name in sorted({*manifest.sha256, *digests}):
        if manifest.sha256.get(name) != digests.get(name):
            how = "is missing" if name not in digests else "is not what was exported"
            _refuse(f"the file {name} {how}", root)
    if {name.split("/")[1] for name in manifest.sha256 if "/" in name} != {
        *manifest.scenes
    }:
        _refuse(f"its manifest does not list the scenes of {SCENES}", root)


def _refuse(what: str, where: Path) -> NoReturn:
    raise InputError(
        what, where=str(where), remedy="the pack is not used: export it again"
    )


def _expected(path: Path, scenes: Mapping[str, Row]) -> pd.DataFrame:
    """Read the expected answers of some scenes; raises InputError if they mean nothing."""
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


def write(
    root: Path,
    problems: Iterable[Problem],
    study: tuple[str, str],
    programs: Mapping[str, str],
) -> int:
    """Write a pack, in place of one of the same study, and return how many scenes it has.

    Scenes of which no number is judged are left out. `study` are the name and the text of the study
    file; `programs` gave the expected answers, with their versions. Raises InputError if the
    directory holds something else.
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
        times = pd.DataFrame(
            {"scene": one.scene, "seconds": one.seconds} for one in listed
        )
        files = {
            EXPECTED: csv(expected[["scene", *COLUMNS]]),
            "scenes.csv": csv(pd.DataFrame(one.entries for one in listed)),
            TIMES: csv(times.dropna()),
            STUDY: text,
            "README.md": _readme(programs),
        }
        for file, content in files.items():
            folder.put(file, content)
        model = re.search(
            "(?m)^model name.*: (.*)$", Path("/proc/cpuinfo").read_text("utf-8")
        )
        processor, paths = (
            model[1] if model else platform.machine(),
            [root / f for f in files],
        )
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
answers (`expected.csv`), for a native code of the same model. What follows is all that a solver has
to know, schema 2; the program `orchestrator` runs and judges one: `orchestrator benchmark run PACK
--solver 'my-solver {case} {out}'`.

"""


def contract() -> str:
    """The contract for solvers: the page docs/benchmark.md from its section "Write a solver" on.

    The page lies beside the package, or in it in a wheel.
    """
    inside = PACKAGE / "docs"
    folder = inside if inside.is_dir() else PACKAGE.parent / "docs"
    page = (folder / "benchmark.md").read_text(encoding="utf-8")
    return page[page.index(CONTRACT) :]


def _readme(programs: Mapping[str, str]) -> str:
    """The text of a pack's README, with the programs of our answers and their versions."""
    lines = [
        f"- {program} {version}\n" for program, version in sorted(programs.items())
    ]
    by = (
        "\n## Programs that gave the answers of our runs\n\n" + "".join(lines)
        if lines
        else ""
    )
    return README + contract() + by
