"""The table of force laws in docs/model.md holds what the laws give."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.physics.laws import LAWS, Exposure
from orchestrator.physics.threshold import shields_at

PAGE = Path(__file__).parents[2] / "docs" / "model.md"
REYNOLDS = np.array([0.1, 1, 3, 10, 30, 100])
RATIO = 1 / 30


def rows() -> dict[str, list[str]]:
    section = PAGE.read_text(encoding="utf-8").split("### The laws side by side")[1]
    cells = [line.strip("|\n ").split(" | ") for line in section.splitlines() if "| `" in line]
    return {name.strip("`"): numbers for name, *numbers in cells}


def test_the_page_describes_every_law() -> None:
    headings = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("### ")]
    assert set(rows()) == set(LAWS)
    assert all(any(f"`{name}`" in heading for heading in headings) for name in LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_its_thresholds_and_ranges_are_those_of_the_law(name: str) -> None:
    written = rows()[name]
    found = shields_at(LAWS[name], REYNOLDS, roughness_ratio=RATIO, entrainment_angle_deg=60)
    assert [f"{theta:.4f}" for theta in found] == [one.strip("()") for one in written]
    holds = LAWS[name].valid(REYNOLDS, Exposure(1.0, RATIO, 1.0, 1.0))
    assert [not one.startswith("(") for one in written] == holds.tolist()
