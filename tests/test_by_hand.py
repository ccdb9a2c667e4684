"""Cases that are run by hand: the same again, and after a change."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator.report.results import Results
from tests.waiting import HANGS_S

pytestmark = pytest.mark.long

CHANGES = {
    "pile": ("parameters.liggghts", "rest_energy equal 1e-06", "rest_energy equal 0.0"),
    "flow": ("parameters", "freeStream       10.0;", "freeStream       11.0;"),
}


@pytest.mark.parametrize("kind", CHANGES)
def test_the_same_again_keeps_its_results_and_a_changed_case_leaves_none(
    results: Results, tmp_path: Path, kind: str
) -> None:
    (pile,) = results.plan.piles.values()
    case = pile.flow if kind == "flow" else pile.case
    copied = Path(shutil.copytree(results.cases / case.name, tmp_path / kind))

    def run() -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            ["./Allrun"], cwd=copied, capture_output=True, text=True, timeout=HANGS_S
        )

    def derived() -> list[str]:
        return [name for name in case.derived if (copied / name).exists()]

    made = derived()
    assert made
    if kind == "pile":
        ended = run()
        assert ended.returncode == 0, ended.stderr
        assert derived() == made
        said = re.findall(r"n/N = (\d+) % at u\*_0 (\S+) m/s", ended.stdout)
        at = pile.thresholds(
            results.cases, [float(percent) / 100 for percent, _ in said]
        )
        assert (
            [f"{each.ustar0:.4g}" for each in at] == [ustar for _, ustar in said] != []
        )
        assert (copied / "README.md").is_file()
    name, old, new = CHANGES[kind]
    text = (copied / name).read_text(encoding="utf-8")
    assert old in text
    (copied / name).write_text(text.replace(old, new), encoding="utf-8")
    ended = run()
    assert ended.returncode == 1
    assert any(name in ended.stderr for name in case.derived)
    assert derived() == ["load_steps.csv"] * (kind == "pile")
    (copied / "results.sha256").unlink()
    assert run().returncode == 0
