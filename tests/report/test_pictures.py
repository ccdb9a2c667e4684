"""Pictures that VTK makes: the process, the flow's field, the grains at an instant."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from orchestrator.report import flow_picture, grain_picture, pictures, snapshot
from orchestrator.report.results import Results

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


def test_snapshot_is_the_first_look_with_enough_grains_moved(results: Results) -> None:
    (pile,) = results.plan.piles.values()
    for fraction in (0.3, 0.7):
        found = snapshot.take(pile, results.cases, fraction)
        assert found is not None
        own = pile.packing.windward
        along = (found.place - found.start) @ pile.triangle.tangent
        moved = own & (found.gone | (along >= 0.3 - 1e-6))
        needed = int(np.ceil(fraction * own.sum()))
        assert needed <= moved.sum() + 1
        curve = results.tables["pile_curve"]
        hold = curve[curve["moved"] >= needed]["hold"].iloc[0]
        assert found.hold == hold
        assert not found.gone[~found.mobile].any()
        assert (found.displacement[~found.mobile] == 0).all()


def test_no_snapshot_of_what_was_not_reached(results: Results) -> None:
    (pile,) = results.plan.piles.values()
    assert snapshot.take(pile, results.cases, 1.0) is None


def test_picture_shows_grains_that_are_gone_where_they_lay(
    results: Results, tmp_path: Path
) -> None:
    (planned,) = grain_picture.plan(results, tmp_path)
    assert pictures.run(planned.jobs, tmp_path) == ""
    figure = planned.finished("")
    assert figure.canvas is not None
    (pile,) = results.plan.piles.values()
    found = snapshot.take(pile, results.cases, 0.3)
    assert found is not None
    ax = figure.canvas.axes[0]
    (gone,) = [c for c in ax.collections if c.get_gid() == "gone"]
    offsets = np.asarray(gone.get_offsets())
    assert offsets == pytest.approx(found.start[found.gone])
    assert 0 < len(offsets) <= 0.3 * pile.packing.count + 2
    assert "30%" in figure.title
    assert json.dumps(planned.jobs)
