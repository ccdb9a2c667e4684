"""Pictures of flow, bed and hills, from their study file to what is drawn."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orchestrator.bed import packing
from orchestrator.grains.pile import Pile
from orchestrator.physics.threshold import thresholds_of
from orchestrator.report import answers, single, solved, units
from orchestrator.report.figures import bed, flow, profiles, where
from orchestrator.report.figures import hills as measured_hills
from orchestrator.report.figures.bed import Steps
from orchestrator.report.results import FRACTION, Results
from orchestrator.study import methods
from orchestrator.study.closed_form import single_grain
from tests import small_study
from tests.report.conftest import axes_of

X = np.linspace(0, 40, 201)
RISE = 1 - np.cos(0.72 * np.pi * np.clip((X - 3) / 27, 0, 1))
"""27 m of a windward side, steepest in its middle, before a slip face of 33 deg."""
Z = np.minimum(
    2 * RISE / RISE[-1], np.maximum(2 - (X - 30) * np.tan(np.radians(33)), 0)
)
Z += 0.01 * np.random.default_rng(1).standard_normal(len(X))
ROWS = "\n".join(f"{x:.3f},{z:.4f}" for x, z in zip(X, Z, strict=True))
DUNE = f"""
fluid = {{ density = 1.22, viscosity = 1.48e-5 }}
grain = {{ diameter = 3e-4, density = 2650.0 }}
bed = {{ kind = "pile", profile = "dune.csv", smoothing = 0.8, roughness = 1e-5 }}
threshold.criterion = "entrained"
method.flow.expansion_ratio = 1.2
[[group]]
[[group]]
method.kind = "pivot"
bed = {{ counted = [28.0, 29.0] }}
[profiles]
"dune.csv" = '''x_m,z_m
{ROWS}'''
"""
TRAIN = """
title = "Two ripples"
grain = { diameter = 1e-3 }
method.kind = "peeling"
method.flow.cells_per_face = 10
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
method.kind = "pivot"
method.flow.cells_per_face = 12
bed = { kind = "pile", shape = "rushil", slope_deg = 26.175, height = 0.117, roughness = 1.57e-4 }
[axes]
"method.flow.turbulence_model" = ["kEpsilon", "RNGkEpsilon"]
"""
LEVEL_BY_DEM = """
title = "Level sand in water"
fluid.kind = "water"
grain = { diameter = 1e-3, density = 2650.0 }
method.kind = "dem"
bed = { kind = "flat", length = 0.01, roughness = "d/30" }
"""
Studies = pytest.TempPathFactory
# meshes as coarse as these are warned of
pytestmark = pytest.mark.filterwarnings("ignore:.*cells_per_face")


@pytest.fixture(scope="module")
def dune(tmp_path_factory: Studies) -> Results:
    return small_study.run(tmp_path_factory.mktemp("dune"), DUNE)


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
    return replace(pile, scene=pile.scene.by(methods.PEELING))


@pytest.fixture(scope="module")
def steps(results: Results, pile: Pile) -> Steps:
    return bed.read_steps(pile, results.cases)


def test_field_is_that_of_the_flow(results: Results, pile: Pile) -> None:
    (figure,) = flow.FIGURE.draw(results)
    velocity = solved.over_u_e(pile, results.cases, (-0.02, 0.1, 0.0, 0.03), 1.0, 240)
    speed = np.linalg.norm(velocity, axis=-1)
    assert 0.7 < speed[-1].min() < speed[-1].max() < 1.2
    # outside: the triangle of the pile, 0.01 m high and 2 · 0.01/tan 15° wide
    area = 0.01**2 / np.tan(np.radians(15))
    assert np.isnan(speed).mean() * 0.12 * 0.03 == pytest.approx(area, rel=0.05)
    assert np.nanmin(velocity[..., 0]) < 0
    assert figure.canvas is not None
    image = np.ma.masked_invalid(
        np.asarray(figure.canvas.axes[0].images[0].get_array())
    )
    assert 0.9 < float(image.max()) < 1.2
    # |u|/U_e is 1 at 10 h far upstream; at the lid it is a quarter more
    window = (-60.0, -59.0, 10.0, 10.1)
    far = np.linalg.norm(
        solved.over_u_e(pile, results.cases, window, pile.bed.height), axis=-1
    )
    assert np.nanmean(far) == pytest.approx(1, abs=0.02)


def test_a_flow_that_was_run_again_is_read_again(
    results: Results, pile: Pile, tmp_path: Path
) -> None:
    window = (-0.02, 0.1, 0.0, 0.03)
    here, fresh = tmp_path / "here", tmp_path / "fresh"
    shutil.copytree(results.cases / pile.flow.name, here / pile.flow.name)
    before = solved.over_u_e(pile, here, window, 1.0, 60)
    # another mesh: higher cells from the bed upwards
    points = here / pile.flow.name / "constant" / "polyMesh" / "points"
    head, rows = points.read_text().split("\n(\n")
    rows, end = rows.split("\n)", 1)
    corners = np.array([row.strip("()").split() for row in rows.splitlines()], float)
    corners[:, 2] += 0.5 * np.maximum(corners[:, 2], 0)
    rows = "\n".join("({} {} {})".format(*corner) for corner in corners.tolist())
    points.write_text(f"{head}\n(\n{rows}\n){end}")
    shutil.copytree(here, fresh)
    after = solved.over_u_e(pile, here, window, 1.0, 60)
    np.testing.assert_array_equal(after, solved.over_u_e(pile, fresh, window, 1.0, 60))
    assert not np.array_equal(after, before, equal_nan=True)


def test_the_slider_has_every_place_of_every_load_step(
    results: Results, steps: Steps
) -> None:
    (figure,) = bed.FIGURE.draw(results)
    data, curve, counts = (
        figure.data,
        results.tables["pile_curve"],
        steps.totals.tolist(),
    )
    assert counts == curve["moved"].tolist()[: len(counts)]
    assert steps.flow == pytest.approx(curve["ustar0_m_s"][: len(counts)])
    assert counts[data["shown"] - 1] < 0.3 * data["count"] <= counts[data["shown"]]
    # the flows are those that the card advises, beside those of the model
    first = answers.card(results).numbers[0]
    assert first.is_pair
    assert data["unit"] == first.unit
    for flows, number in (("flow", first.value), ("model", first.other)):
        before, here = data[flows][data["shown"] - 1 : data["shown"] + 1]
        assert before * 0.99 < number < here * 1.01
        assert f"{here:g}" in figure.title
        assert f"{here:g}" in data["said"]
    assert len(data["frames"]) == len(steps.places) - 1
    mobile = steps.pile.packing.mobile[steps.grains]
    now = np.array(data["start"])
    for frame, places in zip(data["frames"], steps.places[1:, mobile], strict=True):
        for number, x, y in np.array(frame, float).reshape(-1, 3):
            now[int(number)] = x, y
        assert np.isnan(now[:, 0]).tolist() == np.isnan(places[:, 0]).tolist()
        known = ~np.isnan(now[:, 0])
        assert np.abs(now[known] * [1, -1] - places[known]).max() <= bed.SHIFT + 0.011


def test_grains_that_go_on_by_dem_are_drawn_at_the_flows_at_which_they_have_gone(
    tmp_path: Path,
) -> None:
    """The flows of the deck are those at which grains leave, which are other ones."""
    results = small_study.run(tmp_path, LEVEL_BY_DEM)
    pile = next(iter(results.plan.piles.values()))
    assert pile.is_sustained
    steps = bed.read_steps(pile, results.cases)
    assert len(steps.places) == len(steps.flow) == len(steps.totals)
    assert steps.flow.tolist() == pile.motion(results.cases).flow.tolist()
    assert steps.totals[-1] == pile.packing.count
    (figure,) = bed.FIGURE.draw(results)
    assert figure.data["step"] == "flow"
    assert "at which the grain leaves its place by DEM" in figure.caption
    assert "without dynamics" not in figure.caption
    # no grain is shown elsewhere than where it was packed
    assert not figure.data["leaves"]
    assert b"moved and left" not in figure.image


def test_a_bed_without_dem_has_a_picture_of_few_stops(
    results: Results, peeled: Pile, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = bed.read_steps(peeled, results.cases)
    monkeypatch.setattr(bed, "STOPS", 5)
    few = bed.read_steps(peeled, results.cases)
    assert (few.places == peeled.packing.centres[few.grains]).all()
    assert len(few.places) <= 6 < len(every.places)
    assert few.totals[-1] == every.totals[-1] > 0.7 * peeled.packing.count
    at, share = few.first(FRACTION), peeled.packing.count * FRACTION
    assert few.totals[at] == every.totals[every.first(FRACTION)] >= share
    assert ((few.level > 0) & (few.level <= at)).sum() == few.totals[at]
    found = bed.data(few, at, bed.Flows("m/s", few.flow.tolist()))
    assert "model" not in found
    assert not any(found["frames"])
    assert found["step"] == "flow"
    assert not found["leaves"]
    assert "load step" not in bed.bed_caption(results, peeled)


def test_motion_starts_on_a_natural_dune_where_stress_and_slope_say(
    dune: Results,
) -> None:
    """40 m of 0.3 mm sand without a grain, and with those of a metre of it, under one flow."""
    whole, part = dune.plan.piles.values()
    table, stress = dune.joined("pile_threshold"), dune.tables["wall_stress"]
    row = table[table["method"] == "local"].iloc[0]
    assert [run.name for run in whole.runs] == [run.name for run in part.runs]
    x, ustar = row["first_x_m"], stress["ustar_over_ustar0_wall"]
    assert 28 < x == pytest.approx(stress["x_m"][int(ustar.argmax())], abs=0.3)
    (slope,) = whole.model.line.slopes_deg[np.searchsorted(whole.model.line.x, [x]) - 1]
    grain = single_grain(whole.scene).changed(slope_deg=slope)
    by_hand = thresholds_of("bridged", grain)
    felt = by_hand.friction_velocity / np.interp(x, stress["x_m"], ustar)
    assert row["first_ustar0_m_s"] == pytest.approx(felt, rel=0.03)
    # the pivots around the place say the same, and those of the metre just before it
    answer = x, row["first_ustar0_m_s"]
    assert (row["pivot_x_m"], row["pivot_first_m_s"]) == pytest.approx(answer, rel=5e-3)
    grains = dune.tables["pile_grain"]
    local, lattice = (rows for _, rows in grains.groupby("scene_id", sort=False))
    assert (
        len(local)
        <= packing.SAMPLES
        < len(lattice)
        == pytest.approx(1 / 3e-4, rel=0.02)
    )
    at_grains = np.interp(lattice["x_m"], local["x_m"], local["ustar0_m_s"])
    np.testing.assert_allclose(lattice["ustar0_m_s"], at_grains, rtol=0.02)
    assert np.ptp(part.packing.centres[:, 0]) < 3500
    # noise that rises in the wake is not windward
    assert (local["ustar_over_ustar0"] > 0).all()


def test_the_card_of_a_dune_ends_with_the_place_where_motion_starts(
    tmp_path_factory: Studies,
) -> None:
    groups = DUNE[DUNE.index("[[group]]") : DUNE.index("[profiles]")]
    alone = DUNE.replace(groups, "")
    dune = small_study.run(tmp_path_factory.mktemp("dune"), alone)
    row = dune.joined("pile_threshold").iloc[0]
    place = answers.card(dune).numbers[-1]
    assert (place.value, place.unit) == (row["first_x_m"], "m")
    assert "point of first motion" in place.meaning


def test_each_form_of_a_train_has_its_thresholds(train: Results) -> None:
    table = train.tables["form"]
    assert list(table["form"].unique()) == [1, 2]
    assert table["count"].sum() / 4 == train.tables["pile_threshold"]["count"].iloc[0]
    first, second = (
        table[table["form"] == form].set_index("fraction") for form in (1, 2)
    )
    assert (
        second["over_first_form"] == second["ustar0_m_s"] / first["ustar0_m_s"]
    ).all()
    assert (np.diff(first["ustar0_m_s"]) >= 0).all()


def test_the_map_shows_every_grain_at_its_place(train: Results) -> None:
    (figure,) = where.FIGURE.draw(train)
    grains = train.tables["pile_grain"].sort_values("x_m")
    goes = grains[np.isfinite(grains["ustar0_m_s"])]
    lines = [line for ax in axes_of(figure) for line in ax.lines]
    (shown,) = (line for line in lines if line.get_gid() == "thresholds")
    x, told = np.asarray(shown.get_xydata(), float).T
    known = np.isfinite(x)
    # a bed of 20 mm has its lengths in mm
    np.testing.assert_allclose(x[known], 1e3 * goes["x_m"])
    row = train.joined("pile_threshold").iloc[0]
    at = units.told_by(row, goes["ustar0_m_s"], single.quantity_of_row(row))
    np.testing.assert_allclose(told[known], at)


def test_a_steep_hill_separates_where_it_was_measured_to(hills: Results) -> None:
    """On a coarse mesh too, the flow leaves behind the crest and is back within 4 to 9 heights."""
    table = hills.tables["flow"]
    assert (table["measured_reattachment_over_h"] == 6.5).all()
    assert table["measured_source"].str.contains("unverified").all()
    assert table["separation_over_h"].between(0.1, 2).all()
    assert table["reattachment_over_h"].between(4, 9).all()
    assert table["ustar_mean"].between(1.2, 1.5).all()


def test_the_card_of_a_hill_has_the_bubble_or_that_there_is_none(
    hills: Results,
) -> None:
    card = answers.card(hills)
    (number,) = card.numbers
    first = hills.tables["flow"].iloc[0]
    assert number.value == first["reattachment_over_h"]
    assert number.low <= number.value <= number.high
    assert (number.unit, number.beside) == ("h", "6.5")
    assert "not read in its source" in number.note
    assert "k-ε and RNG k-ε separate behind the same hills" in card.worth.advice
    # a hill behind which one model separates and the tunnel did not
    flows = hills.tables["flow"].copy()
    flows["measured_reattachment_over_h"] = np.nan
    flows.loc[flows.index[0], ["separation_over_h", "reattachment_over_h"]] = 0.0
    changed = replace(hills, tables={**hills.tables, "flow": flows})
    card = answers.card(changed)
    (number,) = card.numbers
    assert (number.figure, number.unit, number.beside) == ("none", "", "none")
    assert "by RNG k-ε reattachment at" in number.note
    assert "k-ε separates behind the same hills as the tunnel" in card.worth.advice
    assert "RNG k-ε does not" in card.worth.advice


def test_computed_stands_beside_measured(hills: Results) -> None:
    lead, along = measured_hills.FIGURE.draw(hills)
    assert lead.place == "lead"
    assert lead.canvas
    assert along.canvas
    lines = [line for axes in lead.canvas.axes for line in axes.lines]
    (measured_,) = (line for line in lines if line.get_gid() == "measured")
    np.testing.assert_array_equal(np.asarray(measured_.get_xdata()), 6.5)
    ends = [
        np.asarray(one.get_xdata())[1]
        for one in lines
        if one.get_gid() == "reversed flow"
    ]
    np.testing.assert_allclose(ends, hills.tables["flow"]["reattachment_over_h"])
    tops = [
        np.max(np.asarray(one.get_ydata()))
        for axes in along.canvas.axes
        for one in axes.lines
        if one.get_gid() == "stress"
    ]
    np.testing.assert_allclose(tops, hills.tables["flow"]["ustar_largest"])
    said = {str(text.get_text()) for axes in lead.canvas.axes for text in axes.texts}
    assert said == {"half-length 3 h; measured: to 6.5 h"}


def test_models_differ_by_dash_as_well_as_by_colour(hills: Results) -> None:
    for figure in measured_hills.FIGURE.draw(hills):
        assert figure.canvas
        drawn = [
            (str(line.get_color()), str(line.get_linestyle()))
            for line in figure.canvas.axes[0].lines
            if line.get_gid() in ("speed", "stress")
        ]
        assert len(drawn) == 2
        assert drawn[0][0] != drawn[1][0]
    looks = [(look["color"], str(look["ls"])) for look in profiles.LOOKS]
    assert len({dash for _, dash in looks}) == len(looks)


def test_profiles_stand_over_toe_crest_and_lee_beside_the_law(train: Results) -> None:
    """Of the first ripple's toe, in the units of the table times the height."""
    (figure,) = profiles.FIGURE.draw(train)
    assert figure.canvas
    assert [axes.get_title(loc="left") for axes in figure.canvas.axes] == [
        "toe",
        "crest",
        "lee",
    ]
    assert figure.canvas.axes[0].get_ylabel() == "height above the bed, mm"
    table = train.tables["speed_profile"]
    for axes in figure.canvas.axes:
        rows = table[table["profile_at"] == axes.get_title(loc="left")]
        (speed,) = (line for line in axes.lines if line.get_gid() == "speed")
        (law,) = (line for line in axes.lines if line.get_gid() == "log law")
        np.testing.assert_allclose(np.asarray(speed.get_xdata()), rows["u_over_u_e"])
        height = np.asarray(speed.get_ydata())
        np.testing.assert_allclose(height, 10.0 * rows["height_over_h"])
        expected = np.log1p(height / 0.0333333333) / np.log1p(100.0 / 0.0333333333)
        np.testing.assert_allclose(np.asarray(law.get_xdata()), expected, rtol=1e-6)
    # one more place of the flow upstream, beside the same law
    ahead = table[table["profile_at"] == "upstream"]
    off = ahead["u_over_u_e"] / ahead["u_over_u_e_log_law"] - 1
    assert np.abs(off).max() < 0.05


def test_a_caption_says_what_the_speeds_do(train: Results, hills: Results) -> None:
    rows = train.tables["speed_profile"]
    assert profiles.speeds_up(rows)
    ahead = rows["profile_at"] == "upstream"
    slowed = rows.assign(u_over_u_e=rows["u_over_u_e"].where(ahead, -1.0))
    assert not profiles.speeds_up(slowed)
    # hills have a figure of their own
    assert list(profiles.FIGURE.draw(hills)) == []
