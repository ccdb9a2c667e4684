"""Pictures of flow, mesh, bed and hills, from their study file to what is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.grains.pile import Pile
from orchestrator.report import bed, flows
from orchestrator.report.bed import Steps
from orchestrator.report.results import FRACTION, Results
from tests import small_study
from tests.report.conftest import axes_of

LEVEL = """
title = "A level bed"
grain = { diameter = 1e-3 }
bed = { kind = "pile", shape = "flat", length = 0.05 }
flow = { model = "flat" }
protocol = { method = "peeling" }
"""


TRAIN = """
title = "Two ripples"
grain = { diameter = 1e-3 }
protocol = { method = "peeling" }
flow = { cells_per_face = 10 }
[bed]
kind = "pile"
shape = "dune"
slope_deg = 15.0
height = 0.01
forms = 2
obstacles = [{ kind = "fence", x = -0.03, height = 0.004 }]
"""
HILLS = """
title = "A hill"
grain = { diameter = 4.71e-3 }
protocol = { method = "pivot" }
bed = { kind = "pile", shape = "rushil", slope_deg = 26.175, height = 0.117, roughness = 1.57e-4 }
flow = { cells_per_face = 12 }
[axes]
"flow.turbulence_model" = ["kEpsilon", "RNGkEpsilon"]
"""
Studies = pytest.TempPathFactory


@pytest.fixture(scope="module")
def level(tmp_path_factory: Studies) -> Results:
    return small_study.run(tmp_path_factory.mktemp("level"), LEVEL)


@pytest.fixture(scope="module")
def train(tmp_path_factory: Studies) -> Results:
    return small_study.run(tmp_path_factory.mktemp("train"), TRAIN)


@pytest.fixture(scope="module")
def hills(tmp_path_factory: Studies) -> Results:
    return small_study.run(tmp_path_factory.mktemp("hills"), HILLS)


@pytest.fixture(scope="module")
def pile(results: Results) -> Pile:
    """The pile of the small study."""
    return next(iter(results.plan.piles.values()))


@pytest.fixture(scope="module")
def peeled(pile: Pile) -> Pile:
    """The same pile, whose grains leave by peeling."""
    rules = pile.scene.protocol.model_copy(update={"method": "peeling"})
    return replace(pile, scene=pile.scene.model_copy(update={"protocol": rules}))


@pytest.fixture(scope="module")
def steps(results: Results, pile: Pile) -> Steps:
    return bed.read(pile, results.cases)


def test_field_is_that_of_the_flow(results: Results, pile: Pile) -> None:
    (figure,) = flows.flow(results)
    velocity = flows.over_u_e(pile, results.cases, (-0.02, 0.1, 0.0, 0.03), 1.0, 240)
    speed = np.linalg.norm(velocity, axis=-1)
    assert 0.7 < speed[-1].min() < speed[-1].max() < 1.2
    # outside: the triangle of the pile, 0.01 m high and 2 · 0.01/tan 15° wide
    area = 0.01**2 / np.tan(np.radians(15))
    assert np.isnan(speed).mean() * 0.12 * 0.03 == pytest.approx(area, rel=0.05)
    assert np.nanmin(velocity[..., 0]) < 0
    assert figure.canvas is not None
    image = np.ma.masked_invalid(np.asarray(figure.canvas.axes[0].images[0].get_array()))
    assert 0.9 < float(image.max()) < 1.2
    # |u|/U_e is 1 at 10 h far upstream; at the lid it is a quarter more
    window = (-60.0, -59.0, 10.0, 10.1)
    far = np.linalg.norm(flows.over_u_e(pile, results.cases, window, pile.bed.height), axis=-1)
    assert np.nanmean(far) == pytest.approx(1, abs=0.02)


def test_mesh_is_that_of_the_flow(results: Results, pile: Pile) -> None:
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


def test_grains_have_moved_as_the_tables_say(results: Results, steps: Steps) -> None:
    curve = results.tables["pile_curve"]
    counts = steps.totals.tolist()
    assert counts == curve["moved"].tolist()[: len(counts)]
    assert steps.flow == pytest.approx(curve["ustar0_m_s"][: len(counts)])
    shown = steps.first(0.3)
    assert counts[shown - 1] < 0.3 * steps.pile.packing.count <= counts[shown]


def test_the_slider_has_every_place_of_every_load_step(results: Results, steps: Steps) -> None:
    (figure,) = bed.draw(results)
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


def test_a_pile_without_dem_has_a_picture_too(results: Results, peeled: Pile) -> None:
    steps = bed.read(peeled, results.cases)
    assert (steps.places == peeled.packing.centres[steps.grains]).all()
    assert steps.totals[-1] > 0.7 * peeled.packing.count
    found = bed.data(steps, steps.first(0.3))
    assert not any(found["frames"])
    # no load step ran
    assert found["step"] == "flow"
    assert "load step" not in bed.words(results, peeled)
    assert found["moved"][found["shown"]] >= 0.3 * found["count"]


def test_a_level_bed_names_no_program(results: Results, pile: Pile, level: Results) -> None:
    (figure,) = bed.draw(level)
    assert "OpenFOAM" not in figure.caption
    assert "blue" not in figure.caption
    assert "OpenFOAM" in bed.words(results, pile)


def test_the_slider_of_a_long_bed_has_few_stops(
    results: Results, peeled: Pile, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = bed.read(peeled, results.cases)
    monkeypatch.setattr(bed, "STOPS", 5)
    few = bed.read(peeled, results.cases)
    assert len(few.places) <= 6 < len(every.places)
    assert few.totals[-1] == every.totals[-1]
    share = peeled.packing.count * FRACTION
    at = few.first(FRACTION)
    assert few.totals[at] == every.totals[every.first(FRACTION)] >= share
    assert ((few.level > 0) & (few.level <= at)).sum() == few.totals[at]


def test_each_form_of_a_train_has_its_thresholds(train: Results) -> None:
    table = train.tables["form"]
    assert list(table["form"].unique()) == [1, 2]
    assert table["count"].sum() / 4 == train.tables["pile_threshold"]["count"].iloc[0]
    first, second = (table[table["form"] == form].set_index("fraction") for form in (1, 2))
    ratio = second["ustar0_m_s"] / first["ustar0_m_s"]
    assert (first["over_first_form"] == 1).all()
    np.testing.assert_allclose(second["over_first_form"], ratio)
    assert (np.diff(first["ustar0_m_s"]) >= 0).all()


def test_the_map_shows_every_grain_at_its_place(train: Results) -> None:
    (figure,) = flows.where(train)
    grains = train.tables["pile_grain"]
    artists = (artist for axes in axes_of(figure) for artist in axes.collections)
    (dots,) = (artist for artist in artists if artist.get_gid() == "thresholds")
    shown = np.asarray(dots.get_offsets())
    goes = grains[grains["ustar0_m_s"].notna()]
    np.testing.assert_allclose(shown[:, 0], goes["x_m"] / 0.01)
    np.testing.assert_allclose(shown[:, 1], goes["ustar0_m_s"])


def test_a_steep_hill_separates_where_it_was_measured_to(hills: Results) -> None:
    """On a coarse mesh too, the flow leaves behind the top and is back within 4 to 9 heights."""
    table = hills.tables["flow"]
    assert (table["measured_reattachment_over_h"] == 6.5).all()
    assert not table["measured_verified"].any()
    assert table["measured_source"].str.contains("unverified").all()
    assert table["separation_over_h"].between(0.1, 2).all()
    assert table["reattachment_over_h"].between(4, 9).all()
    assert table["ustar_mean"].between(1.2, 1.5).all()


def test_computed_stands_beside_measured(hills: Results) -> None:
    (figure,) = flows.hills(hills)
    assert figure.canvas
    lines = [line for axes in figure.canvas.axes for line in axes.lines]
    (measured_,) = (line for line in lines if line.get_gid() == "measured")
    np.testing.assert_array_equal(np.asarray(measured_.get_xdata()), 6.5)
    ends = [np.asarray(one.get_xdata())[1] for one in lines if one.get_gid() == "reversed flow"]
    np.testing.assert_allclose(ends, hills.tables["flow"]["reattachment_over_h"])
    tops = [np.max(np.asarray(one.get_ydata())) for one in lines if one.get_gid() == "stress"]
    np.testing.assert_allclose(tops, hills.tables["flow"]["ustar_largest"])
