"""An answer counts if it is the solver's own, complete, and within the tolerance."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from orchestrator.benchmark import judge

SCENE = "1-grain"
HEAD = "quantity,at,value\n"
TOLERANCE = 0.02
EXPECTED = {"ustar": 0.25, "drag": 4e-6}


def pack() -> Any:
    """One scene that asks for two numbers."""
    rows = []
    for quantity, value in EXPECTED.items():
        ends = {"low": value, "high": value, "tolerance": TOLERANCE, "ours": value}
        asked = {"scene": SCENE, "quantity": quantity, "at": "", "value": value}
        rows.append({**asked, **ends})
    scenes = {SCENE: {"kind": "grain", "level": 1}}
    return SimpleNamespace(expected=pd.DataFrame(rows), scenes=scenes)


def verdict(folder: Path, text: str) -> dict[str, Any]:
    """The verdict on a file of answers, beside our own that has both."""
    ours = "".join(f"{name},,{value!r}\n" for name, value in EXPECTED.items())
    for place, answer in ((folder, text), (folder / judge.OURS, ours)):
        (place / SCENE).mkdir(parents=True, exist_ok=True)
        (place / SCENE / judge.ANSWER).write_text(HEAD + answer)
    _, verdicts = judge.judge_solvers(pack(), [SCENE], [folder])
    (found,) = verdicts[verdicts["solver"] != judge.OURS].to_dict("records")
    return {str(name): value for name, value in found.items()}


@pytest.mark.parametrize("lacking", EXPECTED)
def test_an_answer_that_lacks_one_number_fails(tmp_path: Path, lacking: str) -> None:
    """Though the other is right, and ours has both."""
    (other,) = EXPECTED.keys() - {lacking}
    found = verdict(tmp_path, f"{other},,{EXPECTED[other]!r}\n")
    assert found["failed"]
    assert not found["passed"]
    assert f"lacks {lacking}" in found["message"]


@pytest.mark.parametrize("quantity", EXPECTED)
@pytest.mark.parametrize(
    ("off", "passes"),
    [(0.0, True), (0.9, True), (-0.9, True), (1.1, False), (-1.1, False)],
)
def test_an_answer_passes_within_the_tolerance_of_the_expected_one(
    tmp_path: Path, quantity: str, off: float, passes: bool
) -> None:
    given = {**EXPECTED, quantity: EXPECTED[quantity] * (1 + off * TOLERANCE)}
    text = "".join(f"{name},,{value!r}\n" for name, value in given.items())
    found = verdict(tmp_path, text)
    assert found["passed"] == passes
    assert found["failed"] != passes
