"""Pictures of the flow, of its mesh, and of the bed with its grains."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.errors import SolverError
from orchestrator.report import bed, flows
from orchestrator.report.bed import Steps
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from tests.report.conftest import only


def test_field_is_that_of_the_flow(results: Results) -> None:
    (figure,) = flows.flow(results)
    (pile,) = results.plan.piles.values()
    shown = (-0.02, 0.1, 0.0, 0.03)
    velocity = flows.velocity(results.cases / pile.flow.name, shown, (60, 240))
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
    edges = flows.read_edges(results.cases / pile.flow.name)
    table = results.tables["wall_stress"]
    faces = len(table)
    # of a grid of quadrilaterals and the one column before it; its height is that of the lid
    rows = (len(edges) - faces - 1) // (2 * faces + 4)
    assert len(edges) == (2 * rows + 1) * faces + rows + (3 * rows + 1)
    assert edges[..., 1].max() == pytest.approx(pile.flow.lid * pile.bed.height)
    middles = {(round(x, 5), round(z, 5)) for x, z in edges.mean(axis=1)}
    line = zip(table["x_m"].round(5), table["z_m"].round(5), strict=True)
    assert len(middles.intersection(line)) > 0.9 * faces
    (figure,) = flows.mesh(results)
    assert figure.canvas is not None
    for ax in figure.canvas.axes:
        (line_,) = (line for line in ax.lines if line.get_gid() == "mesh")
        assert 30 < len(np.asarray(line_.get_xdata())) // 3 < len(edges)


def test_a_case_without_results_is_named(tmp_path: Path) -> None:
    with pytest.raises(SolverError, match="no results"):
        flows.velocity(tmp_path, (0.0, 1.0, 0.0, 1.0), (2, 2))


@pytest.fixture(scope="module")
def steps(results: Results) -> Steps:
    (pile,) = results.plan.piles.values()
    return bed.read(pile, results.cases)


@pytest.fixture(scope="module")
def figure(results: Results) -> Figure:
    """The picture of the bed."""
    (drawn,) = bed.draw(results)
    return drawn


def test_grains_have_moved_as_the_tables_say(results: Results, steps: Steps) -> None:
    curve = results.tables["pile_curve"]
    counts = [steps.moved(k) for k in range(len(steps.places))]
    assert counts == curve["moved"].tolist()[: len(counts)]
    assert steps.flow == pytest.approx(curve["ustar0_m_s"][: len(counts)])
    shown = steps.first(0.3)
    assert counts[shown - 1] < 0.3 * steps.pile.packing.count <= counts[shown]


def test_the_slider_has_every_place_of_every_load_step(steps: Steps, figure: Figure) -> None:
    data = figure.data
    assert len(data["frames"]) == len(steps.places) - 1
    assert data["moved"][data["shown"]] >= 0.3 * data["count"]
    mobile = steps.pile.packing.mobile[steps.grains]
    now = np.array(data["start"])
    for frame, places in zip(data["frames"], steps.places[1:, mobile], strict=True):
        for number, x, y in np.array(frame, float).reshape(-1, 3):
            now[int(number)] = x, y
        assert np.isnan(now[:, 0]).tolist() == np.isnan(places[:, 0]).tolist()
        known = ~np.isnan(now[:, 0])
        assert np.abs(now[known] * [1, -1] - places[known]).max() <= bed.SHIFT + 0.011


def test_a_pile_without_dem_has_a_picture_too(results: Results) -> None:
    (pile,) = results.plan.piles.values()
    rules = pile.scene.protocol.model_copy(update={"method": "peeling"})
    peeled = replace(pile, scene=pile.scene.model_copy(update={"protocol": rules}))
    steps = bed.read(peeled, results.cases)
    assert (steps.places == peeled.packing.centres[steps.grains]).all()
    assert steps.moved(len(steps.places) - 1) > 0.7 * peeled.packing.count
    found = bed.data(steps, steps.first(0.3))
    assert not any(found["frames"])
    # no load step ran
    assert found["step"] == "flow"
    assert "load step" not in bed.words(results, peeled)
    assert found["moved"][found["shown"]] >= 0.3 * found["count"]


def test_a_bed_without_results_has_no_picture(results: Results) -> None:
    assert list(bed.draw(only(results, "grain"))) == []
    none = replace(results, tables={**results.tables, "pile_threshold": pd.DataFrame()})
    assert list(bed.draw(none)) == []
