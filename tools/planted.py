"""Plants small faults in a copy of the program, one at a time, and counts those that its tests notice.

python tools/planted.py [--only NAME …] [--table FILE]

The faults are those of planted.toml: a file, what stands there, what is written in its place, and the tests
that should notice it. These are run on the copy without a fault first, where they have to pass. A fault is
noticed where a test fails. A test that runs longer than `LIMIT_S` has noticed nothing.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_suffix(".toml")
GRAVE = ("physics", "units", "digests")
"""Kinds of which no fault may go unnoticed."""
ASKED = 0.95
"""Part of all faults that the tests have to notice."""
LIMIT_S = 600
PASSED, FAILED, NOTHING_RUN = 0, 1, 5
"""Exit codes of pytest."""


@dataclass(frozen=True)
class Fault:
    """A small fault.

    Attributes
    ----------
    name
        What is wrong in the copy, in words.
    kind
        What it is a fault of: physics, units, digests, …
    file
        The file, below the root of the repository.
    old, new
        What stands there once, and what is written in its place.
    tests
        The tests that should notice it, as pytest takes them.
    """

    name: str
    kind: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def plant(self, root: Path) -> None:
        """Write it into a copy; ValueError if its place is not there, or not the only one."""
        path = root / self.file
        text = path.read_text(encoding="utf-8")
        count = text.count(self.old)
        if count != 1:
            raise ValueError(f"{self.name}: {count} times in {self.file}: {self.old!r}")
        path.write_text(text.replace(self.old, self.new), encoding="utf-8")


def faults() -> list[Fault]:
    """The faults of the list, in its order."""
    entries = tomllib.loads(LIST.read_text(encoding="utf-8"))["fault"]
    return [Fault(**{**entry, "tests": tuple(entry["tests"])}) for entry in entries]


def copied(place: Path) -> Path:
    """A copy of all files that git knows."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        target = place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, target, follow_symlinks=False)
    # some tests ask git for the list of files
    for words in (["init", "--quiet"], ["add", "--all"]):
        subprocess.run(["git", *words], cwd=place, check=True)
    return place


def outcome(
    root: Path, tests: Iterable[str], limit_s: float | None = LIMIT_S
) -> tuple[str, str]:
    """What tests say of a copy: "passed", "failed", "hung" or "not run"; and the first that failed."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-n0",
        "-p",
        "no:cacheprovider",
        "--tb=no",
        *tests,
    ]
    environment = {
        **os.environ,
        "PYTHONPATH": str(root),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    try:
        ended = subprocess.run(
            command,
            cwd=root,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit_s,
        )
    except subprocess.TimeoutExpired:
        return "hung", ""
    lines = [
        line
        for line in ended.stdout.splitlines()
        if line.startswith(("FAILED", "ERROR"))
    ]
    by = lines[0].split(" - ")[0].split(" ", 1)[1] if lines else ""
    words = {PASSED: "passed", FAILED: "failed"}
    return words.get(ended.returncode, "not run"), by


def tried(fault: Fault, root: Path) -> tuple[str, str]:
    """The outcome of a fault, which is taken out again."""
    path = root / fault.file
    sound = path.read_bytes()
    fault.plant(root)
    try:
        return outcome(root, fault.tests)
    finally:
        path.write_bytes(sound)


def table(found: Sequence[tuple[Fault, str, str]]) -> str:
    """The score by kind, as Markdown."""
    lines = ["| faults of | planted | noticed | not noticed |", "|---|---|---|---|"]
    for kind in dict.fromkeys(fault.kind for fault, _, _ in found):
        of_kind = [(fault, said) for fault, said, _ in found if fault.kind == kind]
        missed = [fault.name for fault, said in of_kind if said != "failed"]
        noticed = len(of_kind) - len(missed)
        lines.append(f"| {kind} | {len(of_kind)} | {noticed} | {'; '.join(missed)} |")
    noticed = sum(said == "failed" for _, said, _ in found)
    lines.append(f"| all | {len(found)} | {noticed} | |")
    return "\n".join(lines)


def main(words: Sequence[str]) -> int:
    """Plant the faults; 1 if too few are noticed, or a grave one is not."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="WORD",
        help="faults whose name or file has one of these words",
    )
    parser.add_argument("--table", type=Path, help="write the table there")
    asked = parser.parse_args(words)
    chosen = faults()
    if asked.only:
        chosen = [
            one
            for one in chosen
            if any(word in one.name + one.file for word in asked.only)
        ]
    found = []
    with tempfile.TemporaryDirectory() as place:
        root = copied(Path(place))
        said, by = outcome(
            root, dict.fromkeys(test for one in chosen for test in one.tests), None
        )
        if said != "passed":
            print(f"without a fault the tests have {said}: {by}", file=sys.stderr)
            return 1
        for number, fault in enumerate(chosen, 1):
            said, by = tried(fault, root)
            found.append((fault, said, by))
            word = {"failed": "noticed", "passed": "NOT NOTICED"}.get(
                said, said.upper()
            )
            print(
                f"{number:3d} {fault.kind:12s} {word:12s} {fault.name}  [{by}]",
                flush=True,
            )
    text = table(found)
    print(text)
    if asked.table:
        asked.table.write_text(text + "\n", encoding="utf-8")
    missed = [fault for fault, said, _ in found if said != "failed"]
    is_grave = any(fault.kind in GRAVE for fault in missed)
    return int(is_grave or len(missed) > (1 - ASKED) * len(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
