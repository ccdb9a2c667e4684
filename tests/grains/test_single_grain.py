"""One grain by LIGGGHTS against the pivot law, and what happens when LIGGGHTS fails."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import SolverError
from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase, batches
from orchestrator.grains.motion import MODES, Motion
from orchestrator.runs import case, engine
from orchestrator.study import study
from orchestrator.study.closed_form import regime_of
from orchestrator.study.parts import Grain

BETAS, SLOPES = (45.0, 50.0, 55.0, 60.0), (0.0, 15.0, 30.0)


def _cells(text: str) -> SingleGrainCase:
    (one,) = batches(study.parse(text, name="cells", where="test").scenes)
    return one


def _run(one: SingleGrainCase, cases: Path, limit_s: float = 120.0) -> Motion:
    engine.execute(one, cases, limit_s)
    return Motion.from_csv(cases / one.name)


FIGURE = f"""
protocol = {{ load_increment = 0.002 }}
[axes]
"bed.entrainment_angle_deg" = {list(BETAS)}
"bed.slope_deg" = {list(SLOPES)}
[[group]]
grain = {{ diameter = 1e-4 }}
fluid = {{ viscosity = 1e-3 }}
[[group]]
grain = {{ diameter = 1e-3 }}
"""
FEW = """
protocol = { load_increment = 0.005 }
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""


def test_threshold_of_the_pivot_law_in_both_regimes_from_one_run(tmp_path: Path) -> None:
    one = _cells(FIGURE)
    assert len(one.scenes) == 24
    assert [c.id for c in batches(reversed(one.scenes))] == [one.id]
    assert {regime_of(scene) for scene in one.scenes} == {"low", "high"}
    found = threshold.of_grains(_run(one, tmp_path))
    # the deck's flow is the friction velocity over that of the closed form
    np.testing.assert_allclose(found.value, 1.0, atol=0.005)
    assert np.all(found.low < 1.005)
    assert np.all(found.high > 0.995)


def test_a_grain_on_a_row_of_others_leaves_at_the_angle_of_its_own_pocket(tmp_path: Path) -> None:
    text = f"""
    grain = {{ diameter = 1e-3 }}
    protocol = {{ load_increment = 0.001 }}
    [axes]
    "bed.relative_size" = {np.linspace(0.5, 3.0, 10).tolist()}
    """
    one = _cells(text)
    found = threshold.of_grains(_run(one, tmp_path))
    np.testing.assert_allclose(found.value, 1.0, atol=0.002)


def test_a_bed_has_no_scale(tmp_path: Path) -> None:
    # two diameters, one Reynolds number, one ratio of lift to drag: the same motion to the load
    # step
    text = """
    forces = { law = "high" }
    protocol = { load_increment = 0.002 }
    [[group]]
    grain = { diameter = 1e-3 }
    [[group]]
    grain = { diameter = 1e-4 }
    fluid = { viscosity = 3.1622776601683795e-7 }
    """
    found = _run(_cells(text), tmp_path)
    assert found.level[0] == found.level[1] > 0


class Sticky(Grain):
    """A grain with a property of its contact that no deck knows yet."""

    cohesion: float = 0.0


def test_grains_of_two_contact_laws_share_no_deck() -> None:
    (parsed,) = study.parse("grain = { diameter = 1e-3 }", name="cells", where="test").scenes
    scene = parsed.model_copy(update={"grain": Sticky(diameter=1e-3)})
    others = {
        "diameter": 2e-3,
        "density": 3000.0,
        "friction_angle_deg": 40.0,
        "stiffness": 2e4,
        "damping": 0.2,
        "cohesion": 1.0,
    }
    assert {*others, "sizes"} == set(Sticky.model_fields)
    for name, value in others.items():
        other = scene.model_copy(update={"grain": scene.grain.model_copy(update={name: value})})
        decks = len(list(batches([scene, other])))
        assert decks == (1 if name in ("diameter", "density") else 2), name


def test_a_displacement_criterion_may_be_very_small(tmp_path: Path) -> None:
    text = "protocol = { load_increment = 0.02, displacement_criterion = 1e-3 }"
    found = threshold.of_grains(_run(_cells(f"grain = {{ diameter = 1e-3 }}\n{text}"), tmp_path))
    np.testing.assert_allclose(found.value, 1.0, atol=0.02)


def test_a_run_tells_its_load_steps_over_those_that_there_may_be(tmp_path: Path) -> None:
    cells = _cells(FEW)
    assert cells.share(tmp_path) == 0.0
    (tmp_path / "load_steps.txt").write_text("0.1\n0.2\n0.3\n0.4\n")
    (tmp_path / "samples.csv").write_text("load_step,flow,step\n1,0.1,250\n3,0.3,500\n")
    assert cells.share(tmp_path) == 0.75


STOPPED = """pid=$$
(until [ -s samples.csv ]; do sleep 0.01; done; kill -KILL $pid) &"""


@pytest.mark.parametrize(
    ("script", "limit_s", "word"),
    [
        # LIGGGHTS itself ends with 0: a spring too stiff for the step throws all grains out
        ("sed -i 's/time_step equal 0.2/time_step equal 3.0/' parameters.liggghts", 120, "lost"),
        ("echo 'fix nothing' >>parameters.liggghts", 120, "ERROR"),
        (STOPPED, 120, "before its protocol did"),
        ("kill -STOP $$", 1, "within 1 s"),
    ],
)
def test_a_solver_that_fails_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, limit_s: float, word: str
) -> None:
    # the script runs before the real solver; what it does to the case, the solver then suffers
    program = tmp_path / "bin" / "liggghts"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\n{script}\nexec {shutil.which("liggghts")} "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    one, cases = _cells(FEW), tmp_path / "cases"
    with pytest.raises(SolverError, match=word) as caught:
        _run(one, cases, limit_s)
    assert not case.done_state(one, cases)
    assert (cases / one.name / case.FAILED).is_file()
    assert str(cases / one.name) in str(caught.value)


def test_tables_cut_short_are_not_trusted(tmp_path: Path) -> None:
    one = _cells(FEW)
    _run(one, tmp_path)
    for name in ("passage.dump", "samples.csv", "settling.csv"):
        path = tmp_path / one.name / name
        whole = path.read_bytes()
        # within a line, wherever two thirds of the file are
        path.write_bytes(whole[: whole.index(b"\n", len(whole) * 2 // 3) - 1])
        with pytest.raises(SolverError, match=name):
            one.collect(tmp_path / one.name)
        path.write_bytes(whole)


def test_how_grains_move(tmp_path: Path) -> None:
    # 8 % above the threshold: without lift a grain rolls over its neighbour; with little else it
    # leaves its bed; at the limiting slope the low law's lift carries a large grain off backwards
    text = """
    protocol = { load_increment = 0.2 }
    [[group]]
    grain = { diameter = 1e-3 }
    forces = { law = "high", lift_coefficient = 0.0 }
    [[group]]
    grain = { diameter = 1e-3 }
    forces = { law = "high", lift_coefficient = 100.0 }
    bed = { entrainment_angle_deg = 20.0 }
    [[group]]
    grain = { diameter = 3e-4 }
    bed = { slope_deg = 30.0 }
    forces = { law = "low" }
    """
    one = _cells(text)
    motion = _run(one, tmp_path)
    names = [scene.forces.lift_coefficient for scene in one.scenes]
    back = [scene.forces.law for scene in one.scenes].index("low")
    assert MODES[motion.mode[names.index(0.0)]] == "rolled"
    assert MODES[motion.mode[names.index(100.0)]] == "lifted"
    assert (motion.level[back], motion.mode[back]) == (0, 0)
    assert motion.fallen[back] > 0
    assert np.isnan(threshold.of_grains(motion).value[back])
