"""The script of docs/flow.md, on the flow of a small study."""

import importlib.util
import re
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from orchestrator import plan
from orchestrator.flow.case import FlowCase
from orchestrator.runs import engine
from orchestrator.study import study

SCRIPT = Path(__file__).parents[2] / "docs" / "measure_flow.py"
TABLES = 6
STEEPNESS_DEG = 20.0
"""Of the pile of the small study."""


@pytest.fixture
def script() -> ModuleType:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("measure_flow", SCRIPT)
    assert spec
    assert spec.loader
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:method.flow.cells_per_face")
def test_the_flow_is_measured_and_what_has_run_is_not_run_again(
    script: ModuleType,
    finished_pile: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (pile,) = plan.make(study.load(finished_pile.parent / "small.toml")).piles.values()
    one: FlowCase = pile.flow
    roughness = one.settings.roughness
    at_once: dict[str, object] = {
        "flow": lambda *_: one,
        "SLOPES": (STEEPNESS_DEG,),
        "ROUGHNESS": (roughness,),
        "SIMILAR": ((STEEPNESS_DEG, roughness),),
        "LEVELS": {"finer": {"cells_per_face": 80}, "the same": {}},
        "MODELS": ({}, {"turbulence_model": "RNGkEpsilon"}),
        "WAVES_DEG": (10.0,),
        "WAVE_RATIOS": (1e3,),
    }
    for name, value in at_once.items():
        assert hasattr(script, name)
        monkeypatch.setattr(script, name, value)
    ran: list[str] = []
    execute = engine.execute

    def counted(case: Any, *about: Any) -> None:
        ran.append(case.name)
        execute(case, *about)

    monkeypatch.setattr(engine, "execute", counted)
    cases = tmp_path / "cases"
    shutil.copytree(finished_pile / "cases", cases)
    script.main(cases)
    printed = capsys.readouterr().out
    assert len(ran) == len(set(ran)) > TABLES
    assert one.name not in ran
    check_tables(printed)
    mean = script.windward_mean(one, script.solved(one, cases))
    assert f"| {STEEPNESS_DEG:g} | {roughness:g} | {mean:.3f} |" in printed
    # the third place of the last table is its change on a mesh twice as fine, per cent
    finer = re.findall(r"\| \S+ \| \S+ \| [\d.]+ \| (\S+) % \|", printed)
    assert 0 < max(abs(float(change)) for change in finer) < 10

    ran.clear()
    script.main(cases)
    assert ran == []
    assert capsys.readouterr().out == printed


def check_tables(printed: str) -> None:
    """See that each table has rows, with a number in each place that its head names."""
    tables = printed.strip().split("\n\n")
    assert len(tables) == TABLES
    for table in tables:
        head, line, *rows = table.splitlines()
        assert rows
        assert {row.count("|") for row in (line, *rows)} == {head.count("|")}
        assert not re.search(r"\bnan\b|\binf\b|\| *\|", table)
