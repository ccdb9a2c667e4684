"""The samples in the documents: each command prints what its page shows."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", "docs/first-study.md", "docs/mars.md", "docs/threshold.md")
"""Pages whose study files stand on them whole."""
BLOCK = re.compile(r"(?s)```(\w*)\n(.*?)```")


def _write_studies(text: str, folder: Path) -> None:
    """Write the study files of a page, by the name that was last said before each."""
    for block in BLOCK.finditer(text):
        kind, body = block.groups()
        if kind == "toml" and body.startswith("title"):
            *_, name = re.findall(r"`([\w-]+\.toml)`", text[: block.start()])
            (folder / name).write_text(body, encoding="utf-8")


def _samples(text: str) -> Iterator[tuple[str, list[str]]]:
    """The commands of a page, each with the lines that it prints there."""
    for _, body in BLOCK.findall(text):
        command, *lines = body.splitlines()
        if re.match(r"\$ (python -m )?orchestrator", command):
            shown = [line.rstrip() for line in lines]
            # what is left out, and where the page lies
            yield (
                command[2:],
                [line for line in shown if not line.startswith(("…", "page: …"))],
            )


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES)
def test_commands_print_what_their_page_shows(page: str, tmp_path: Path) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    _write_studies(text, tmp_path)
    samples = list(_samples(text))
    assert samples
    for command, shown in samples:
        *_, arguments = command.partition("orchestrator ")
        run = [sys.executable, "-m", "orchestrator", *shlex.split(arguments)]
        ended = subprocess.run(
            run, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        printed = (ended.stdout + ended.stderr).splitlines()
        printed = [line.rstrip() for line in printed]
        assert [line for line in shown if line not in printed] == [], command
