"""One grain by LIGGGHTS against the pivot law, and what happens when LIGGGHTS fails."""

import os
from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import SolverError
from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase, batches
from orchestrator.grains.motion import MODES, Motion
from orchestrator.runs import case, engine
from orchestrator.study import study
from orchestrator.study.parts import GrainPart
from tests.faults.bench import endless, wrapper
from tests.waiting import HANGS_S


def _cells(text: str) -> SingleGrainCase:
    (cells,) = batches(study.parse(text, name="cells", where="test").scenes)
    return cells


def _run(cells: SingleGrainCase, cases: Path, limit_s: float = HANGS_S) -> Motion:
    engine.execute(cells, cases, limit_s)
    return Motion.from_csv(cases / cells.name)


FIGURE = """
method.grains.load_increment = 0.002
[axes]
"bed.entrainment_angle_deg" = [45.0, 50.0, 55.0, 60.0]
"bed.slope_deg" = [0.0, 15.0, 30.0]
[[group]]
grain = { diameter = 1e-4 }
fluid = { viscosity = 1e-3 }
[[group]]
grain = { diameter = 1e-3 }
"""
FEW = """
method.grains.load_increment = 0.005
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""
POCKETS = f"""
grain = {{ diameter = 1e-3 }}
method.grains.load_increment = 0.001
[axes]
"bed.relative_size" = {np.linspace(0.5, 3.0, 10).tolist()}
"""
"""Each grain leaves at the angle of its own pocket."""
SHORT = """
grain = { diameter = 1e-3 }
threshold.displacement = 1e-3
method.grains.load_increment = 0.02
"""
"""A displacement criterion may be very small."""


@pytest.mark.parametrize(
    ("text", "within"), [(FIGURE, 0.005), (POCKETS, 0.002), (SHORT, 0.02)]
)
def test_one_grain_moves_at_its_closed_form(
    tmp_path: Path, text: str, within: float
) -> None:
    cells = _cells(text)
    assert [batch.id for batch in batches(reversed(cells.scenes))] == [cells.id]
    # the deck's flow is the friction velocity over that of the closed form
    at = threshold.of_grains(_run(cells, tmp_path))
    np.testing.assert_allclose(at.value, 1.0, atol=within)
    assert np.all(at.low < 1 + within)
    assert np.all(at.high > 1 - within)


def test_a_bed_has_no_scale(tmp_path: Path) -> None:
    # two diameters, one Reynolds number, one ratio of lift to drag: the same load step
    text = """
    forces = { law = "high" }
    method.grains.load_increment = 0.002
    [[group]]
    grain = { diameter = 1e-3 }
    [[group]]
    grain = { diameter = 1e-4 }
    fluid = { viscosity = 3.1622776601683795e-7 }
    """
    first, second = _run(_cells(text), tmp_path).load_step
    assert first == second > 0


def test_grains_of_two_contact_laws_share_no_deck() -> None:
    (scene,) = study.parse(
        "grain = { diameter = 1e-3 }", name="cells", where="test"
    ).scenes
    for name in set(GrainPart.model_fields) - {"sizes"}:
        value = 1.1 * getattr(scene.grain, name) + 0.1
        other = scene.model_copy(
            update={"grain": scene.grain.model_copy(update={name: value})}
        )
        decks = len(list(batches([scene, other])))
        assert decks == (1 if name in ("diameter", "density") else 2), name


STOPPED = f"""{endless("liggghts")}
pid=$$
(until grep -q ^1, samples.csv; do sleep 0.01; done; kill -KILL $pid) 2>/dev/null &"""
"""A solver that is killed at work, and that has no end but this."""


@pytest.mark.parametrize(
    ("script", "limit_s", "word"),
    [
        # LIGGGHTS itself ends with 0: a spring too stiff for the step throws the grains apart, and
        # out; whether some of them are left is chance
        (
            "sed -i 's/time_step equal 0.2/time_step equal 3.0/' parameters.liggghts",
            HANGS_S,
            "lost|burst",
        ),
        ("echo 'fix nothing' >>parameters.liggghts", HANGS_S, "ERROR"),
        (STOPPED, HANGS_S, "before its protocol did"),
        ("kill -STOP $$", 1, "within 1 s"),
    ],
)
def test_a_solver_that_fails_says_why(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    script: str,
    limit_s: float,
    word: str,
) -> None:
    # the script runs before the real solver; what it does to the case, the solver then suffers
    programs = wrapper(tmp_path / "bin", "liggghts", script)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    cells, cases = _cells(FEW), tmp_path / "cases"
    with pytest.raises(SolverError, match=word) as caught:
        _run(cells, cases, limit_s)
    assert not case.done_state(cells, cases)
    assert (cases / cells.name / case.FAILED).is_file()
    assert str(cases / cells.name) in str(caught.value)


def test_tables_cut_short_are_not_trusted(tmp_path: Path) -> None:
    cells = _cells(FEW)
    _run(cells, tmp_path)
    for name in ("passage.dump", "samples.csv", "settling.csv"):
        path = tmp_path / cells.name / name
        whole = path.read_bytes()
        # within a line, wherever two thirds of the file are
        path.write_bytes(whole[: whole.index(b"\n", len(whole) * 2 // 3) - 1])
        with pytest.raises(SolverError, match=name):
            cells.collect(tmp_path / cells.name)
        path.write_bytes(whole)


def test_how_grains_move(tmp_path: Path) -> None:
    # 8 % above the threshold: without lift a grain rolls over its neighbour; with little else it
    # leaves its bed; at the limiting slope the low law's lift carries a large grain off backwards
    text = """
    method.grains.load_increment = 0.2
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
    cells = _cells(text)
    motion = _run(cells, tmp_path)
    lifts = [scene.forces.lift_coefficient for scene in cells.scenes]
    back = [scene.forces.law for scene in cells.scenes].index("low")
    assert MODES[motion.mode[lifts.index(0.0)]] == "rolled"
    assert MODES[motion.mode[lifts.index(100.0)]] == "lifted"
    assert (motion.load_step[back], motion.mode[back]) == (0, 0)
    assert motion.fallen[back] > 0
    assert np.isnan(threshold.of_grains(motion).value[back])
