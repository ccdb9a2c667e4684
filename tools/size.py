"""Lines of each package against its budget; ends with 1 where one is exceeded."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUDGET = {
    ("benchmark",): 1500,
    ("report",): 2625,
    ("runs",): 1388,
    ("study",): 1600,
    ("experiments", "fidelity"): 2470,
    ("grains", "bed", "flow", "physics"): 6500,
    ("paper",): 700,
    ("tables", "calculator", "solvers"): 1362,
    ("root modules",): 878,
    ("the package",): 19000,
    ("tests",): 9500,
    ("docs, words",): 30000,
}
"""The most lines (of the documents: words) of each group of packages."""


def sizes() -> dict[tuple[str, ...], int]:
    """Count the tracked files: lines by group of packages, words of the documents."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "orchestrator", "tests", "docs"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    group = {name: names for names in BUDGET for name in names}
    count: Counter[tuple[str, ...]] = Counter()
    for name in filter(None, listed.stdout.split("\0")):
        path = Path(name)
        if path.suffix == ".py":
            lines = len((ROOT / path).read_text().splitlines())
            if path.parts[0] == "orchestrator":
                package = path.parts[1] if len(path.parts) > 2 else "root modules"
                count[group[package]] += lines
                count[("the package",)] += lines
            elif path.parts[0] == "tests":
                count[("tests",)] += lines
        elif path.suffix == ".md" and path.parts[0] == "docs":
            count[("docs, words",)] += len((ROOT / path).read_text().split())
    return {names: count[names] for names in BUDGET}


def main() -> int:
    """Print the table."""
    counted = sizes()
    for names, most in BUDGET.items():
        mark = "  too many" if counted[names] > most else ""
        print(f"{', '.join(names):32}{counted[names]:8}{most:8}{mark}")
    return int(any(counted[names] > most for names, most in BUDGET.items()))


if __name__ == "__main__":
    sys.exit(main())
