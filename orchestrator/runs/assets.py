"""Where the templates and presets lie: beside the package in a checkout, inside it in a wheel."""

import stat
from fnmatch import fnmatchcase
from functools import cache
from hashlib import sha256
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs.files import canonical_json, digest_text

PACKAGE = Path(__file__).resolve().parents[1]


def templates() -> Path:
    """The folder of the solvers' templates."""
    inside = PACKAGE / "templates"
    return inside if inside.is_dir() else PACKAGE.parent / "templates"


def presets() -> Path:
    """The folder of the study files that the package brings."""
    return PACKAGE / "study" / "presets"


GENERATED = (
    *("[1-9]", "[1-9][0-9]", "[1-9][0-9][0-9]", "[1-9][0-9][0-9][0-9]"),
    *("log.*", "postProcessing", "polyMesh", "settling.csv", "samples.csv", "*.dump"),
)
"""Files that a run by hand leaves in the template's own folder; no part of the template."""


def copy_template(name: str, folder: Path) -> None:
    """Make a folder as a fresh copy of a template."""
    folder.mkdir(parents=True)
    for path, mode, content in _files(name):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
        (folder / path).chmod(mode)


@cache
def template_names(name: str) -> frozenset[str]:
    """The files of a template, by their paths in it."""
    return frozenset(path for path, _, _ in _files(name))


@cache
def template_digest(name: str) -> str:
    """One digest of every file of a template, names included."""
    digests = {path: sha256(content).hexdigest() for path, _, content in _files(name)}
    return digest_text(canonical_json(digests))


@cache
def _files(name: str) -> tuple[tuple[str, int, bytes], ...]:
    """Path, mode and content of each file; read once, so that all copies are what was digested."""
    root = templates() / name
    if not root.is_dir():
        raise OrchestratorError(
            "the package lacks this directory of templates",
            where=str(root),
            remedy="install the package again",
        )
    paths = (path.relative_to(root) for path in sorted(root.rglob("*")) if path.is_file())
    own = [path for path in paths if not any(map(_is_generated, path.parts))]
    modes = (stat.S_IMODE((root / path).stat().st_mode) for path in own)
    contents = ((root / path).read_bytes() for path in own)
    return tuple(zip((path.as_posix() for path in own), modes, contents, strict=True))


def _is_generated(name: str) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in GENERATED)
