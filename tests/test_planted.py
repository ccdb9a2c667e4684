"""The list of small faults that tools/planted.py plants: each can be planted, and has its tests."""

import runpy
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
LEAST = 60
"""Fewest faults of the list."""


@pytest.fixture(scope="module")
def tool() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "tools" / "planted.py"))


def test_each_fault_has_one_place_and_its_tests(tool: dict[str, Any]) -> None:
    """Whoever changes such a place changes the fault with it."""
    faults = tool["faults"]()
    assert len(faults) >= LEAST
    assert len({fault.name for fault in faults}) == len(faults)
    assert {*tool["GRAVE"]} <= {fault.kind for fault in faults}
    lost = []
    for fault in faults:
        text = (ROOT / fault.file).read_text(encoding="utf-8")
        if text.count(fault.old) != 1 or fault.old == fault.new:
            lost.append(f"{fault.file}: {fault.old!r}")
        for test in fault.tests:
            path, _, name = test.partition("::")
            if f"def {name}" not in (ROOT / path).read_text(encoding="utf-8"):
                lost.append(test)
    assert lost == []


def test_the_score_names_what_was_not_noticed(tool: dict[str, Any]) -> None:
    first, second, *_ = tool["faults"]()
    found = [(first, "failed", "a test"), (second, "passed", "")]
    lines = tool["table"](found).splitlines()
    assert Counter(line.count("|") for line in lines) == {5: len(lines)}
    assert lines[-1] == "| all | 2 | 1 | |"
    assert any(line.endswith(f"| {second.name} |") for line in lines)
    assert not any(first.name in line for line in lines)


def test_a_fault_is_planted_once_or_not_at_all(
    tool: dict[str, Any], tmp_path: Path
) -> None:
    words = {"name": "a", "kind": "units", "file": "a.py", "tests": ()}
    fault = tool["Fault"](**words, old="x = 1", new="x = 2")
    (tmp_path / "a.py").write_text("x = 1\n")
    fault.plant(tmp_path)
    assert (tmp_path / "a.py").read_text() == "x = 2\n"
    with pytest.raises(ValueError, match=r"0 times in a\.py"):
        fault.plant(tmp_path)
    (tmp_path / "a.py").write_text("x = 1\nx = 1\n")
    with pytest.raises(ValueError, match=r"2 times in a\.py"):
        fault.plant(tmp_path)
