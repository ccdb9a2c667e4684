"""Where the templates and presets lie: beside the package in a checkout, inside it in a wheel."""

import shutil
import tempfile
from functools import cache
from pathlib import Path

from orchestrator.files import canonical_json, digest_files, digest_text

PACKAGE = Path(__file__).resolve().parent


def templates() -> Path:
    """The folder of the solvers' templates."""
    inside = PACKAGE / "templates"
    return inside if inside.is_dir() else PACKAGE.parent / "templates"


def presets() -> Path:
    """The folder of the study files that the package brings."""
    return PACKAGE / "presets"


def known() -> Path:
    """The folder of what the ladder and the maps found."""
    return PACKAGE / "known"


GENERATED = (
    *("[1-9]", "[1-9][0-9]", "[1-9][0-9][0-9]", "[1-9][0-9][0-9][0-9]"),
    *("log.*", "postProcessing", "polyMesh", "settling.csv", "levels.csv", "*.dump"),
)
"""What a run by hand in the template's own folder leaves there; it is no part of the template."""


def copy_template(name: str, folder: Path) -> None:
    """Make a folder as a fresh copy of a template."""
    shutil.copytree(templates() / name, folder, ignore=shutil.ignore_patterns(*GENERATED))


@cache
def template_digest(name: str) -> str:
    """One digest of every file of a template, names included."""
    with tempfile.TemporaryDirectory(prefix="orchestrator-") as scratch:
        folder = Path(scratch) / "template"
        copy_template(name, folder)
        files = [path for path in folder.rglob("*") if path.is_file()]
        return digest_text(canonical_json(digest_files(files, root=folder)))
