"""Pictures that VTK makes: the process, the flow's field, the grains at an instant."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from orchestrator.grains import motion
from orchestrator.report import flow_picture, grain_picture, pictures, snapshot
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results
from orchestrator.report.snapshot import Passage

WINDOW = [-1.0, 3.0, -1.0, 1.0]


def test_spheres_lie_where_they_are(tmp_path: Path) -> None:
    grains = tmp_path / "grains.npz"
    colours = np.array([[200, 0, 0], [0, 0, 200]], np.uint8)
    np.savez(grains, centres=np.array([[0.0, 0.0], [2.0, 0.25]]), colours=colours)
    out = tmp_path / "out.png"
    job = {"kind": "grains", "grains": str(grains), "window": WINDOW, "pixels": [400, 200]}
    assert pictures.run([{**job, "out": str(out)}], tmp_path) == ""
    image = imread(out)
    assert image.shape == (200, 400, 4)
    opaque = np.argwhere(image[:, :200, 3] > 0.5)
    assert opaque.mean(axis=0) == pytest.approx([100, 100], abs=2)
    assert np.ptp(opaque, axis=0) == pytest.approx([100, 100], abs=3)
    assert image[100, 100, 0] > 0.4
    assert image[75, 300, 2] > 0.4
    assert image[5, 5, 3] == 0


def test_drawing_is_possible_here() -> None:
    assert pictures.can_render()


def test_failure_of_the_drawing_process_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "drawing process failed" in pictures.run([{"kind": "flow", "case": "none"}], tmp_path)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "missing"))
    assert not pictures.can_render()


def test_one_bad_picture_does_not_cost_the_others(results: Results, tmp_path: Path) -> None:
    (planned,) = flow_picture.plan(results, tmp_path)
    bad = {"kind": "grains", "grains": "none", "window": WINDOW, "pixels": [4, 4], "out": "none"}
    cause = pictures.run([*planned.jobs, bad], tmp_path)
    assert cause
    assert planned.finished(cause).canvas is not None


def test_field_is_that_of_the_flow(results: Results, tmp_path: Path) -> None:
    (planned,) = flow_picture.plan(results, tmp_path)
    (job,) = planned.jobs
    assert pictures.run(planned.jobs, tmp_path) == ""
    velocity = np.load(job["out"])
    assert list(velocity.shape[:2]) == job["shape"]
    speed = np.linalg.norm(velocity, axis=-1) / 10.0
    assert 0.7 < speed[-1].min() < speed[-1].max() < 1.2
    assert np.isnan(speed).any()
    assert np.nanmin(velocity[..., 0]) < 0
    figure = planned.finished("")
    assert figure.canvas is not None
    image = figure.canvas.axes[0].images[0]
    assert np.asarray(image.get_array()) == pytest.approx(speed, nan_ok=True)


@pytest.fixture(scope="module")
def passage(results: Results) -> Passage:
    (pile,) = results.plan.piles.values()
    return snapshot.read(pile, results.cases)


def test_grains_have_passed_as_the_tables_say(results: Results, passage: Passage) -> None:
    curve = results.tables["pile_curve"]
    ends = np.flatnonzero(np.diff(passage.looks["level"], append=0))
    assert passage.passed.sum(axis=1)[ends].tolist() == curve["moved"].tolist()[-len(ends) :]
    lost = passage.at(len(passage.looks) - 1)
    table = results.tables["pile_grain"]
    modes = [motion.MODES[mode] for mode in lost.mode[passage.pile.packing.windward]]
    assert modes == table["mode"].tolist()
    assert not (lost.mode[~lost.exposed] > 0).any()


def test_snapshot_is_the_first_look_with_enough_grains_moved(
    results: Results, passage: Passage
) -> None:
    for fraction in (0.3, 0.7):
        look = passage.first(fraction)
        assert look is not None
        found, before = passage.at(look), passage.at(look - 1)
        needed = int(np.ceil(fraction * passage.pile.packing.count))
        assert before.moved < needed <= found.moved
        along = (found.place - found.start) @ passage.pile.triangle.tangent
        assert (found.mode[found.exposed & (found.gone | (along >= 0.31))] > 0).all()
        curve = results.tables["pile_curve"]
        assert found.hold == curve[curve["moved"] >= needed]["hold"].iloc[0]
        assert not found.gone[~found.mobile].any()
        assert (found.displacement[~found.mobile] == 0).all()


def test_no_snapshot_of_what_was_not_reached(passage: Passage) -> None:
    assert passage.first(1.0) is None


@pytest.fixture(scope="module")
def figure(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Figure:
    """The picture of the grains."""
    folder = tmp_path_factory.mktemp("grains")
    (planned,) = grain_picture.plan(results, folder)
    assert json.dumps(planned.jobs)
    assert pictures.run(planned.jobs, folder) == ""
    return planned.finished("")


def test_picture_shows_grains_that_are_gone_where_they_lay(
    passage: Passage, figure: Figure
) -> None:
    assert figure.canvas is not None
    look = passage.first(0.3)
    assert look is not None
    found = passage.at(look)
    for ax in figure.canvas.axes[:3]:
        (gone,) = [c for c in ax.collections if c.get_gid() == "gone"]
        offsets = np.asarray(gone.get_offsets())
        assert offsets == pytest.approx(found.start[found.gone])
    assert 0 < len(offsets) <= 0.3 * passage.pile.packing.count + 2
    lines = figure.canvas.axes[2].lines
    drawn = {line.get_gid(): len(np.asarray(line.get_xydata())) for line in lines}
    for number, name in enumerate(motion.MODES[1:], 1):
        assert drawn[f"{name}, here"] == (~found.gone[found.mode == number]).sum()
        assert drawn[f"{name}, gone"] == found.gone[found.mode == number].sum()
    assert "30%" in figure.title


def test_flow_behind_the_grains_is_faster_above_than_near_the_bed(figure: Figure) -> None:
    assert figure.canvas is not None
    image = np.ma.masked_invalid(np.asarray(figure.canvas.axes[2].images[0].get_array()))
    speed = np.ma.filled(image, np.nan)
    column = speed[:, speed.shape[1] // 4]
    above = column[~np.isnan(column)]
    assert 0 <= above[0] < 0.5 < above[-1] < 1.2
    assert len(above) < len(column)
