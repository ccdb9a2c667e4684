"""Set-up of a checkout whose path has blanks and quotes in it, without any server."""

import os
import shutil
import subprocess
import tomllib
import venv
import zipfile
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from orchestrator.extras import NEEDS

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
PACKAGES = Path(np.__file__).parents[1]
"""Where the packages of `requirements.lock` are that these tests run with."""
LOCKS = ("requirements.lock", "requirements-gis.lock")
"""What every set-up installs."""
NAME = """the user's "checkout" of $HOME & co"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of this checkout with a `.venv` that holds what set-up would install."""
    folder = tmp_path / NAME
    ignored = shutil.ignore_patterns("__pycache__")
    for part in ("orchestrator", "templates", "tools"):
        shutil.copytree(ROOT / part, folder / part, ignore=ignored)
    locks = [Path(shutil.copy(ROOT / name, folder)) for name in LOCKS]
    environment = folder / ".venv"
    venv.create(environment, with_pip=True)
    (own,) = environment.glob("lib/python3*/site-packages")
    (own / "installed.pth").write_text(f"{PACKAGES}\n")
    stamp = ""
    for lock in locks:
        stamp += f"{sha256(lock.read_bytes()).hexdigest()}  {lock.name}\n"
    (environment / "installed.sha256").write_text(stamp)
    return folder


def test_set_up_installs_the_command_of_the_checkout(
    checkout: Path, tmp_path: Path
) -> None:
    outside = {
        name: value for name, value in os.environ.items() if name != "PYTHONPATH"
    }

    def says(command: Path) -> str:
        return subprocess.check_output(
            [command, "--version"], cwd=tmp_path, env=outside, text=True
        )

    (tmp_path / "orchestrator.py").write_text("raise SystemExit('another program')\n")
    command = checkout / ".venv/bin/orchestrator"
    set_up: list[str | Path] = ["sh", checkout / "tools/setup.sh", "run"]
    subprocess.run(set_up, check=True, env=outside)
    written = command.stat().st_mtime_ns
    subprocess.run(set_up, check=True, env=outside)
    assert command.stat().st_mtime_ns == written
    link = tmp_path / "orchestrator"
    link.symlink_to(command)
    (checkout / "orchestrator/__init__.py").write_text('__version__ = "changed"\n')
    assert says(command) == says(link) == "changed\n"


def test_set_up_says_what_it_installs_in_one_line(
    checkout: Path, tmp_path: Path
) -> None:
    info = "sample-1.0.dist-info"
    contents = {
        "sample.py": "",
        f"{info}/METADATA": "Metadata-Version: 2.1\nName: sample\nVersion: 1.0\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/RECORD": "",
    }
    with zipfile.ZipFile(tmp_path / "sample-1.0-py3-none-any.whl", "w") as wheel:
        for name, text in contents.items():
            wheel.writestr(name, text)
    for name in LOCKS:
        (checkout / name).write_text("sample==1.0\n")
    ended = subprocess.run(
        ["sh", checkout / "tools/setup.sh", "run"],
        env={**os.environ, "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    )
    assert list(checkout.glob(".venv/lib/python3*/site-packages/sample.py"))
    assert ended.stdout.splitlines() == [
        "setup: making .venv",
        "setup: installing what requirements.lock pins",
        "setup: installing what requirements-gis.lock pins",
    ]


def test_a_missing_extra_is_installed_by_what_the_package_asks_for() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    for extra, requirement in NEEDS.items():
        assert requirement in extras[extra]
