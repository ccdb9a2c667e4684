"""A pack on disk: written as one step, never used unless its files are those of its manifest."""

import json
import os
import platform
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.benchmark.problem import SCENE, SCHEMA, Problem, csv
from orchestrator.errors import InputError
from orchestrator.runs.files import digest_files, read_json, write_json

MANIFEST = "manifest.json"
EXPECTED = "expected.csv"
SCENES = "scenes"
STUDY = "study.toml"
FILES = (MANIFEST, EXPECTED, "scenes.csv", "times.csv", STUDY, "README.md")
"""Beside the directory of the scenes."""


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
        ``scene``, and the columns of `problem.EXPECTED`; `at` is a text.
    manifest : mapping
        Its manifest.
    """

    root: Path
    scenes: dict[str, dict[str, Any]]
    expected: pd.DataFrame
    manifest: Mapping[str, Any]

    def directory(self, scene: str) -> Path:
        """What the solver of a scene is given."""
        return self.root / SCENES / scene

    def about(self, scene: str) -> str:
        """What a reader knows a bed by: slope, diameter or roughness, packing."""
        told = self.scenes[scene]
        size = f"d = {1e3 * told['d_m']:g} mm" if "d_m" in told else f"z₀ = {told['z0_m']:.3g} m"
        seed = f" {told['seed']}" if "seed" in told else ""
        packing = f", {told['packing']}{seed}" if "packing" in told else ""
        return f"{told['alpha_deg']:g}°, {size}{packing}"

    def files(self) -> list[Path]:
        """Every file of the pack but the manifest."""
        return _files(self.root)

    def verify(self) -> None:
        """See that no file has changed.

        Raises
        ------
        InputError
            Naming the first file that is not what the manifest says.
        """
        known = self.manifest["sha256"]
        found = digest_files(self.files(), root=self.root)
        for name in sorted({*known, *found}):
            if known.get(name) != found.get(name):
                how = "is missing" if name not in found else "is not what was exported"
                raise InputError(
                    f"the file {name} {how}: the pack is not used",
                    where=str(self.root),
                    remedy="export it again",
                )


def _files(root: Path) -> list[Path]:
    named = (root / name for name in FILES if name != MANIFEST)
    return [
        *(path for path in named if path.is_file()),
        *(path for path in (root / SCENES).rglob("*") if path.is_file()),
    ]


def read(root: Path) -> Pack:
    """Read a pack and see that it is what was exported.

    Raises
    ------
    InputError
        If it is none, of another schema, or changed.
    """
    manifest = read_json(root / MANIFEST)
    if not isinstance(manifest, dict) or not {"schema", "scenes", "sha256"} <= manifest.keys():
        raise InputError(
            f"there is no pack here: {MANIFEST} is missing or cannot be read",
            where=str(root),
            remedy="write one with: python -m orchestrator benchmark export",
        )
    if manifest["schema"] != SCHEMA:
        raise InputError(
            f"its schema is {manifest['schema']!r}, this program knows {SCHEMA}",
            where=str(root / MANIFEST),
            remedy="export it again",
        )
    pack = Pack(root, {}, pd.DataFrame(), manifest)
    pack.verify()
    scenes = {
        name: json.loads((pack.directory(name) / SCENE).read_text(encoding="utf-8"))
        for name in manifest["scenes"]
    }
    return Pack(root, scenes, _expected(root / EXPECTED), manifest)


def _expected(path: Path) -> pd.DataFrame:
    table = pd.read_csv(path, dtype={"scene": str, "quantity": str, "at": str})
    return table.assign(at=table["at"].fillna(""))


def write(
    root: Path, problems: Iterable[Problem], study_text: str, programs: Mapping[str, str]
) -> int:
    """Write a pack, in place of one that is there, and return how many scenes it has.

    Parameters
    ----------
    root : Path
        Its directory; new, empty, or that of a pack.
    problems : iterable of Problem
        Its scenes.
    study_text : str
        The study file that they come from.
    programs : mapping of str to str
        Programs that gave the expected answers, with versions.

    Raises
    ------
    InputError
        If the directory holds something else.
    """
    _claim(root)
    listed = list(problems)
    for one in listed:
        one.write(root / SCENES / one.scene)
    (root / STUDY).write_text(study_text, encoding="utf-8")
    for name, table in _tables(listed).items():
        (root / f"{name}.csv").write_text(csv(table), encoding="utf-8")
    (root / "README.md").write_text(_readme(programs), encoding="utf-8")
    manifest = {
        "schema": SCHEMA,
        "scenes": [one.scene for one in listed],
        "programs": dict(programs),
        "machine": {"processor": processor(), "cores": os.cpu_count()},
        "sha256": digest_files(_files(root), root=root),
    }
    # last: a directory without it is no pack
    write_json(root / MANIFEST, manifest)
    return len(listed)


def _claim(root: Path) -> None:
    root.mkdir(parents=True, exist_ok=True)
    strange = {path.name for path in root.iterdir()} - {*FILES, SCENES, ".gitignore"}
    if strange:
        raise InputError(
            f"the directory holds something that is no pack: {min(strange)}",
            where=str(root),
            remedy="name a new one",
        )
    (root / MANIFEST).unlink(missing_ok=True)
    shutil.rmtree(root / SCENES, ignore_errors=True)


def _tables(problems: list[Problem]) -> dict[str, pd.DataFrame]:
    heads = ({"scene": p.scene, "level": p.level, "kind": p.kind, **p.parameters} for p in problems)
    times = [{"scene": p.scene, "seconds": p.seconds} for p in problems if p.seconds == p.seconds]
    parts = [p.expected.assign(scene=p.scene) for p in problems]
    expected = pd.concat(parts, ignore_index=True)
    first = ["scene", *expected.columns.drop("scene")]
    return {
        "scenes": pd.DataFrame(heads).astype(object),
        "times": pd.DataFrame(times, columns=["scene", "seconds"]),
        "expected": expected[first],
    }


def processor() -> str:
    """The machine's processor, as far as it says."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def _readme(programs: Mapping[str, str]) -> str:
    text = resources.files("orchestrator.benchmark").joinpath("README.md.in").read_text("utf-8")
    listed = "\n".join(f"- {name} {version}" for name, version in sorted(programs.items()))
    return text.replace("@VERSIONS@", listed or "- none: every answer is a formula")
