"""How far a run of LIGGGHTS says that it is."""

from pathlib import Path

from orchestrator import plan
from orchestrator.study import study


def test_a_run_tells_its_load_steps_over_those_that_there_may_be(tmp_path: Path) -> None:
    (cells,) = plan.make(study.load("first-look")).cells
    assert cells.share(tmp_path) == 0.0
    (tmp_path / "load_steps.txt").write_text("0.1\n0.2\n0.3\n0.4\n")
    (tmp_path / "samples.csv").write_text("load_step,flow,step\n")
    assert cells.share(tmp_path) == 0.0
    (tmp_path / "samples.csv").write_text("load_step,flow,step\n1,0.1,250\n3,0.3,500\n")
    assert cells.share(tmp_path) == 0.75
