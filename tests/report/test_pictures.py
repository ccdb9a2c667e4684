"""Pictures of the flow and of the grains at an instant."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.errors import SolverError
from orchestrator.grains import motion
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import flow, flow_field, grains, mesh, snapshot, spheres
from orchestrator.report.pictures.snapshot import Passage
from orchestrator.report.results import Results

WINDOW = (-1.0, 3.0, -1.0, 1.0)


def test_spheres_lie_where_they_are() -> None:
    centres = np.array([[0.0, 0.0], [2.0, 0.25]])
    colours = np.array([[0.8, 0.0, 0.0], [0.0, 0.0, 0.8]])
    image = spheres.picture(centres, colours, WINDOW, 400)
    assert image.shape == (200, 400, 4)
    opacity = image[..., 3] / 255
    assert opacity.sum() == pytest.approx(2 * np.pi / 4 * 100**2, rel=1e-3)
    red = np.argwhere(opacity[:, :200] > 0.5)
    assert red.mean(axis=0) + 0.5 == pytest.approx([100, 100], abs=0.01)
    assert image[100, 100].tolist() == [204, 0, 0, 255]
    assert image[75, 300].tolist() == [0, 0, 204, 255]
    # the rim turns away from the light
    assert image[100, 148, 0] == pytest.approx(255 * 0.8 * (0.45 + 0.6 * 0.24), abs=3)
    assert image[5, 5].tolist() == [0, 0, 0, 0]


def test_spheres_are_cut_at_the_edges_of_the_window() -> None:
    window = (0.0, 1.0, 0.0, 1.0)
    image = spheres.picture(np.array([[0.0, 0.0], [5.0, 5.0]]), np.ones((2, 3)), window, 100)
    assert (image[..., 3] / 255).sum() == pytest.approx(np.pi / 16 * 100**2, rel=1e-2)
    assert np.flatnonzero(image[..., 3].max(axis=1)).min() == 50


def test_field_is_that_of_the_flow(results: Results) -> None:
    (figure,) = flow.draw(results)
    (pile,) = results.plan.piles.values()
    shown = (-0.02, 0.1, 0.0, 0.03)
    velocity = flow_field.velocity(results.cases / pile.flow.name, shown, (60, 240))
    speed = np.linalg.norm(velocity, axis=-1) / 10.0
    assert 0.7 < speed[-1].min() < speed[-1].max() < 1.2
    # outside: the triangle of the pile, 0.01 m high and 2 · 0.01/tan 15° wide
    area = 0.01**2 / np.tan(np.radians(15))
    assert np.isnan(speed).mean() * 0.12 * 0.03 == pytest.approx(area, rel=0.05)
    assert np.nanmin(velocity[..., 0]) < 0
    assert figure.canvas is not None
    image = np.ma.masked_invalid(np.asarray(figure.canvas.axes[0].images[0].get_array()))
    assert 0.9 < float(image.max()) < 1.2


def test_mesh_is_that_of_the_flow(results: Results) -> None:
    (pile,) = results.plan.piles.values()
    edges = mesh.read_edges(results.cases / pile.flow.name)
    table = results.tables["wall_stress"]
    faces = len(table)
    # of a grid of quadrilaterals; its height is that of the lid
    rows = (len(edges) - faces) // (2 * faces + 1)
    assert len(edges) == (2 * rows + 1) * faces + rows
    assert edges[..., 1].max() == pytest.approx(10 * pile.bed.height)
    middles = {(round(x, 5), round(z, 5)) for x, z in edges.mean(axis=1)}
    bed = zip(table["x_m"].round(5), table["z_m"].round(5), strict=True)
    assert len(middles.intersection(bed)) > 0.9 * faces
    (figure,) = mesh.draw(results)
    assert figure.canvas is not None
    for ax in figure.canvas.axes:
        (line,) = (line for line in ax.lines if line.get_gid() == "mesh")
        assert 30 < len(np.asarray(line.get_xdata())) // 3 < len(edges)


def test_a_case_without_results_is_named(tmp_path: Path) -> None:
    with pytest.raises(SolverError, match="no results"):
        flow_field.velocity(tmp_path, (0.0, 1.0, 0.0, 1.0), (2, 2))


@pytest.fixture(scope="module")
def passage(results: Results) -> Passage:
    (pile,) = results.plan.piles.values()
    return snapshot.read(pile, results.cases)


def test_grains_have_passed_as_the_tables_say(results: Results, passage: Passage) -> None:
    curve = results.tables["pile_curve"]
    ends = np.flatnonzero(np.diff(passage.samples["load_step"], append=0))
    assert passage.passed.sum(axis=1)[ends].tolist() == curve["moved"].tolist()[-len(ends) :]
    lost = passage.at(len(passage.samples) - 1)
    table = results.tables["pile_grain"]
    modes = [motion.MODES[mode] for mode in lost.mode[passage.pile.packing.windward]]
    assert modes == table["mode"].tolist()
    assert not (lost.mode[~lost.exposed] > 0).any()


def test_snapshot_is_the_first_look_with_enough_grains_moved(
    results: Results, passage: Passage
) -> None:
    for fraction in (0.3, 0.7):
        sample = passage.first(fraction)
        assert sample is not None
        found, before = passage.at(sample), passage.at(sample - 1)
        needed = int(np.ceil(fraction * passage.pile.packing.count))
        assert before.moved < needed <= found.moved
        along = ((found.place - found.start) * passage.pile.tangents).sum(axis=1)
        assert (found.mode[found.exposed & (found.gone | (along >= 0.31))] > 0).all()
        curve = results.tables["pile_curve"]
        assert found.load_step == curve[curve["moved"] >= needed]["load_step"].iloc[0]
        assert not found.gone[~found.mobile].any()
        assert (found.displacement[~found.mobile] == 0).all()


def test_no_snapshot_of_what_was_not_reached(passage: Passage) -> None:
    assert passage.first(1.0) is None


@pytest.fixture(scope="module")
def figure(results: Results) -> Figure:
    """The picture of the grains."""
    (drawn,) = grains.draw(results)
    return drawn


def test_picture_shows_grains_that_are_gone_where_they_lay(
    passage: Passage, figure: Figure
) -> None:
    assert figure.canvas is not None
    sample = passage.first(0.3)
    assert sample is not None
    found = passage.at(sample)
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
