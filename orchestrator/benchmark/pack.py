"""A pack on disk: written as one step, never used unless its files are those of its manifest."""

import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.benchmark import intake
from orchestrator.benchmark.intake import SCENES
from orchestrator.benchmark.problem import ASK, SCENE, SCHEMA, Problem, csv
from orchestrator.errors import InputError
from orchestrator.runs import workspace
from orchestrator.runs.files import canonical_json, digest_files, digest_text, text_of

MANIFEST = "manifest.json"
EXPECTED = "expected.csv"
STUDY = "study.toml"
TIMES = "times.csv"


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

    @property
    def digest(self) -> str:
        """One digest of what is asked and expected: not of the times that ours took."""
        sums = {name: sum for name, sum in self.manifest["sha256"].items() if name != TIMES}
        return digest_text(canonical_json(sums))

    def directory(self, scene: str) -> Path:
        """Parameters that the solver of a scene gets."""
        return self.root / SCENES / scene

    def about(self, scene: str) -> str:
        """Name of a bed for a reader: slope, diameter or roughness, packing."""
        told = self.scenes[scene]
        size = f"d = {1e3 * told['d_m']:g} mm" if "d_m" in told else f"z₀ = {told['z0_m']:.3g} m"
        seed = f" {told['seed']}" if "seed" in told else ""
        packing = f", {told['packing']}{seed}" if "packing" in told else ""
        lift_off = ", lift-off" if "lift_off" in told else ""
        return f"{told['alpha_deg']:g}°, {size}{packing}{lift_off}"

    def files(self) -> list[Path]:
        """Every file of the pack but the manifest."""
        return list(intake.members(self.root).values())

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


def read(root: Path) -> Pack:
    """Read a pack and see that it is what was exported.

    Raises
    ------
    InputError
        If it is none, of another schema, changed, or holds what no pack holds.
    """
    if not os.path.lexists(root / MANIFEST):
        raise InputError(
            f"there is no pack here: {MANIFEST} is missing",
            where=str(root),
            remedy="write one with: python -m orchestrator benchmark export",
        )
    manifest = intake.manifest(root / MANIFEST)
    pack = Pack(root, {}, pd.DataFrame(), manifest)
    pack.verify()
    _check_scenes(root, manifest["scenes"])
    scenes = {name: intake.scene(pack.directory(name) / SCENE, name) for name in manifest["scenes"]}
    expected = intake.expected(root / EXPECTED, scenes)
    for name, asked in expected.groupby("scene", sort=False):
        path = pack.directory(str(name)) / ASK
        intake.check(path)
        if path.read_bytes() != csv(asked[["quantity", "at"]]).encode():
            intake.refuse(f"it does not ask what {EXPECTED} answers", path)
    return Pack(root, scenes, expected, manifest)


def _check_scenes(root: Path, scenes: Sequence[str]) -> None:
    """See that all say the same of which scenes there are."""
    strange = {path.name for path in (root / SCENES).iterdir()} ^ set(scenes)
    if strange:
        intake.refuse(f"the manifest and {SCENES} differ: {min(strange)}", root)
    lines = (root / "scenes.csv").read_text("utf-8", errors="replace").splitlines()
    if [line.partition(",")[0] for line in lines] != ["scene", *scenes]:
        intake.refuse("its scenes are not those of the manifest", root / "scenes.csv")


def write(
    root: Path, problems: Iterable[Problem], study: tuple[str, str], programs: Mapping[str, str]
) -> int:
    """Write a pack, in place of one that is there, and return how many scenes it has.

    Parameters
    ----------
    root : Path
        Its directory; new, empty, or that of a pack of the same study.
    problems : iterable of Problem
        Its scenes.
    study : tuple of str
        Name and text of the study file that they come from.
    programs : mapping of str to str
        Programs that gave the expected answers, with versions.

    Raises
    ------
    InputError
        If the directory holds something else.
    """
    name, text = study
    with workspace.claimed(root, workspace.PACK, name) as folder:
        about = {"kind": workspace.PACK.word, "name": name}
        folder.note(MANIFEST, text_of(about))  # it is no pack until all is there
        listed = list(problems)
        scenes = folder.clear(SCENES, intake.is_member)
        for one in listed:
            one.write(scenes / one.scene)
        tables = {f"{name}.csv": csv(table) for name, table in _tables(listed).items()}
        for file, content in {STUDY: text, "README.md": _readme(programs), **tables}.items():
            folder.put(file, content)
        manifest = {
            **about,
            "schema": SCHEMA,
            "scenes": [one.scene for one in listed],
            "programs": dict(programs),
            "machine": {"processor": processor(), "cores": os.cpu_count()},
            "sha256": digest_files(intake.members(root).values(), root=root),
        }
        folder.note(MANIFEST, text_of(manifest))
    return len(listed)


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
