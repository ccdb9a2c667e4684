"""A flow over a surface that diverges at first: its answer says so."""

import os
import re
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.surface import pipeline
from tests.faults.bench import wrapper
from tests.surface.test_case import SMALL

FILE = """
[fluid]
kind = "air"
[grain]
diameter = 5e-4
density = 2650.0
[bed]
kind = "surface"
shape = "cone"
height = 10.0
slope_deg = 26.0
[method.flow]
roughness = 0.005
[axes]
"flow.from_deg" = [270.0, 0.0]
"""
DIVERGING = "sed -i 's/^\\(relaxation[A-Za-z]*\\) .*/\\1 2.5;/' parameters"
"""Over-relaxation at the first try: the iterations really diverge."""
TOLD = (
    r"A run did not go as planned\. (surface-[0-9a-f]+): simpleFoam diverged: "
    r".*; the second try converged, with the values of second_try\."
)


def test_the_answer_names_a_flow_that_converged_at_its_second_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "cone.toml", tmp_path / "out"
    file.write_text(FILE)
    words = ["study", str(file), "--out", str(out), "--workers", "1"]
    monkeypatch.setattr(pipeline, "LEVELS", {"coarse": SMALL})
    first = f"[ -e ../../../one ] || {{ touch ../../../one; {DIVERGING}; }}"
    programs = wrapper(tmp_path / "bin", "simpleFoam", first)
    with monkeypatch.context() as changed:
        changed.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
        assert main(words) == 0
    printed = " ".join(capsys.readouterr().out.split())
    (name,) = re.findall(TOLD, printed)
    assert (out / "cases" / name / "second_try").is_file()
    # of a study that is asked for again no solver says it
    assert main(words) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert re.findall(TOLD, printed) == [name]
    page = " ".join((out / "report.html").read_text(encoding="utf-8").split())
    assert re.findall(TOLD, page) == [name]
