"""Where the templates and presets lie: beside the package in a checkout, inside it in a wheel."""

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


@cache
def template_digest(name: str) -> str:
    """One digest of every file of a template, names included."""
    folder = templates() / name
    files = [path for path in folder.rglob("*") if path.is_file()]
    return digest_text(canonical_json(digest_files(files, root=folder)))
