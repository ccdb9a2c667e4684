"""Renew ``pinned.json``; refused for inputs that changed without a new recipe."""

import sys
import tempfile
from pathlib import Path

from tests import recipes


def main() -> int:
    """Renew the file; the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        found = recipes.current(Path(folder))
    before = recipes.pinned() if recipes.PINNED.exists() else {}
    names = recipes.without_new_recipe(found, before)
    if names:
        print(recipes.advice(names), file=sys.stderr)
        return 1
    recipes.pin(found)
    print(f"{len(found)} cases are pinned in {recipes.PINNED}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
