"""Piles of both solvers, through the whole line: stress, motion, thresholds, poured beds."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import linprog

from orchestrator.errors import Exploded, InputError
from orchestrator.grains.loads import Loads, interlocking, loads_of
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.pile_case import flows
from orchestrator.grains.threshold import at_size, classes, sampled, within
from orchestrator.physics import rolling
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.report.figures import bed, pivots
from orchestrator.report.results import Results
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form
from orchestrator.study.study import changed
from orchestrator.tables.answer import Answer
from orchestrator.tables.classes import size_class
from tests import small_study

SMALL = """
[grain]
diameter = 1e-3
[bed]
kind = "pile"
slope_deg = 20.0
height = 0.01
roughness = "d/30"
[method.flow]
cells_per_face = 20
[method.grains]
load_increment = {step}
final_fraction = 0.75
"""
STEPS = "[method.grains]\nload_increment = {step}\nfinal_fraction = 0.75\n"
STATIC = SMALL.removesuffix(STEPS)
"""The same for methods without load steps, which refuse them."""


def _pile(results: Results, method: str) -> Pile:
    piles = results.plan.piles.values()
    return next(pile for pile in piles if pile.scene.method.kind == method)


def test_a_slow_pile_follows_the_pivot_law_at_each_grains_own_stress(
    tmp_path: Path,
) -> None:
    results = small_study.run(tmp_path, SMALL.format(step=0.01))
    slow, cases = _pile(results, "dem"), results.cases
    motion, pivot = slow.motion(cases), slow.pivot_thresholds(slow.speed(cases))
    for at in slow.thresholds(cases, (0.1, 0.3, 0.5, 0.7)):
        expected = pivot[int(np.ceil(at.fraction * motion.count)) - 1]
        assert at.ustar0 == pytest.approx(expected, rel=0.03)
    names = "pile_curve", "pile_threshold", "pile_grain"
    curve, rows, grains = (results.tables[name] for name in names)
    assert ((curve["moved"] + curve["not_moved"]) == slow.packing.count).all()
    assert rows["shields"].is_monotonic_increasing
    assert (
        rows["shields"].between(
            rows["shields_numerical_low"], rows["shields_numerical_high"]
        )
    ).all()
    # the numerical error is relative to the reference, which may be as much larger
    low, high = within(rows["shields"], rows["numerical_error"])
    assert (rows["shields_numerical_low"] <= low * (1 + 1e-12)).all()
    assert (rows["shields_numerical_high"] >= high * (1 - 1e-12)).all()
    assert (grains["moved_in_load_step"] > 0).sum() == curve["moved"].iloc[-1]


def test_a_run_goes_on_beyond_the_largest_fraction_that_is_asked_for(
    tmp_path: Path,
) -> None:
    """It is reached, and half a grain more too, whatever `final_fraction` is."""
    text = SMALL.format(step=0.05) + "waiting_time = 6.0\n"
    text = text.replace("final_fraction = 0.75", "")
    text = text.replace("cells_per_face = 20", 'model = "waves"')
    text += '[threshold]\nfractions = [0.95]\n[method]\nkind = "dem"\n'
    results = small_study.run(tmp_path, text)
    (row,) = results.tables["pile_threshold"].to_dict("records")
    assert row["highest_fraction"] >= 0.95
    assert "not reached" not in row["why_not"]
    (pile,) = results.plan.piles.values()
    found = pile.thresholds(results.cases, [0.95])[0]
    assert found.tau_low <= found.tau


@pytest.mark.parametrize(
    ("final", "fractions", "last"),
    [
        (0.9, "0.1, 0.7", 0.9),
        (0.9, "0.95", 1.0),
        (0.5, "0.5", 0.55),
        (0.5, "0.45", 0.5),
    ],
)
def test_runs_that_end_at_one_fraction_are_one_case(
    final: float, fractions: str, last: float
) -> None:
    def pile(final: float, fractions: str) -> Pile:
        text = SMALL.format(step=0.05).replace("final_fraction = 0.75", "")
        text += f"final_fraction = {final}\n"
        text += f'[threshold]\nfractions = [{fractions}]\n[method]\nkind = "dem"\n'
        (scene,) = study.parse(text, name="last", where="test").scenes
        return Pile(scene)

    asked = pile(final, fractions)
    assert asked.scene.last_fraction == last
    assert asked.case.name == pile(last, "0.1").case.name
    other = pile(0.8, "0.1").case.name
    assert asked.case.name != other


ROWS = [
    ("slope_deg = 20.0", 1.0, 1.0),
    ('shape = "dune"\nslope_deg = 15.0\nforms = 2', 1.0, 1.01),
    ('shape = "step up"\nslope_deg = 15.0', 1.0, 1.01),
    # grains at the limiting slope behind the edge lie loose
    ('shape = "step down"', 1.0, 1.01),
    ('shape = "cosine"\nslope_deg = 20.0', 2.0, 3.2),
    ('shape = "cosine"\nslope_deg = 20.0\npacking = "disordered"', 2.0, 3.2),
    ('shape = "gaussian"\nslope_deg = 15.0', 2.0, 3.2),
    ('shape = "gaussian"\nslope_deg = 20.0', 2.0, 3.2),
    ('shape = "rushil"\nslope_deg = 20.0', 2.0, 3.2),
    ('shape = "flat"', 2.0, 3.2),
    # the row goes on beyond a range that is counted
    ("slope_deg = 15.0\ncounted = [0.01, 0.03]", 2.0, 3.2),
    # the steps of level rows have edges
    ('shape = "cosine"\nslope_deg = 20.0\npacking = "horizontal"', 1.0, 1.01),
]


@pytest.mark.parametrize("method", ["pivot", "peeling", "dem", "local"])
@pytest.mark.parametrize(("fields", "least", "most"), ROWS)
def test_the_grains_of_a_row_without_a_free_end_hold_one_another(
    tmp_path: Path, fields: str, least: float, most: float, method: str
) -> None:
    """The first departure from the row is compared with the first of grains by themselves."""
    if method == "local" and "horizontal" in fields:
        pytest.skip("level rows are refused")
    text = (SMALL.format(step=0.05) if method == "dem" else STATIC).replace(
        "slope_deg = 20.0", fields
    )
    # linear theory: the stress of each form is largest near its top
    model = '"flat"' if '"flat"' in fields else '"waves"'
    text = (
        text.replace("cells_per_face = 20", f"model = {model}")
        + f'[method]\nkind = "{method}"\n'
    )
    (scene,) = study.parse(text, name="row", where="test").scenes
    assert least <= interlocking(Pile(scene), tmp_path) <= most


def test_load_steps_begin_below_the_first_grain_that_is_held(tmp_path: Path) -> None:
    """On a step down grains lie loose at the limiting slope: no flow is below theirs."""
    text = SMALL.format(step=0.05).replace("slope_deg = 20.0", 'shape = "step down"')
    text = (
        text.replace("cells_per_face = 20", 'model = "waves"')
        + '[method]\nkind = "dem"\n'
    )
    (scene,) = study.parse(text, name="loose", where="test").scenes
    loads = loads_of(Pile(scene), tmp_path)
    alone = loads.alone()
    assert (alone == 0).any()
    first = alone[alone > 0].min()
    rising = flows(loads)
    assert 0.8 * first < rising[1] < first < rising[-1]
    _, ustar0 = Pile(scene).first(Motion.of_flows(alone))
    assert ustar0 == pytest.approx(first)


@pytest.mark.parametrize("law", ["bridged", "profile"])
def test_no_law_makes_a_hold_of_a_row(tmp_path: Path, law: str) -> None:
    text = STATIC.replace("slope_deg = 20.0", 'shape = "step up"\nslope_deg = 15')
    text = text.replace("cells_per_face = 20", 'model = "waves"')
    text += f'[method]\nkind = "pivot"\n[forces]\nlaw = "{law}"\n'
    (scene,) = study.parse(text, name="row", where="test").scenes
    assert interlocking(Pile(scene), tmp_path) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(
    ("fields", "holds"),
    [
        ('shape = "cosine"\nslope_deg = 20.0', True),
        ('shape = "dune"\nslope_deg = 10.0', False),
        ('shape = "dune"\nslope_deg = 10.0\nbrink_radius = 1.0', True),
    ],
)
def test_rows_of_a_bed_without_grains_are_judged_around_the_first_motion(
    tmp_path: Path, fields: str, holds: bool
) -> None:
    """Of more than 5000 d of bed, of which a part is packed, as of the whole bed by pivots."""
    each = {}
    for method in ("pivot", "local"):
        text = STATIC.replace("height = 0.01", "height = 1.0")
        text = (
            text.replace("slope_deg = 20.0", fields) + f'[method]\nkind = "{method}"\n'
        )
        text = text.replace("cells_per_face = 20", 'model = "waves"')
        (scene,) = study.parse(text, name="long", where="test").scenes
        each[method] = interlocking(Pile(scene), tmp_path)
    assert (each["pivot"] > 1.5) == (each["local"] > 1.5) == holds
    assert each["local"] == pytest.approx(each["pivot"], rel=0.1)


@pytest.mark.parametrize(("shape", "slope"), [("flat", 0.0), ("step up", 15.0)])
def test_along_a_plane_the_closed_form_is_that_of_a_grain_on_it(
    tmp_path: Path, shape: str, slope: float
) -> None:
    text = STATIC.replace("slope_deg = 20.0", f'shape = "{shape}"')
    text = (
        text.replace('"pile"', f'"pile"\nslope_deg = {slope}')
        + '[method]\nkind = "local"\n'
    )
    text = text.replace("cells_per_face = 20", 'model = "flat"')
    (scene,) = study.parse(text, name="plane", where="test").scenes
    exact = closed_form(scene).friction_velocity
    np.testing.assert_allclose(
        loads_of(Pile(scene), tmp_path).alone(), exact, rtol=5e-9
    )


STUDY = """
fluid = {{ density = 1000.0, viscosity = 1e-6 }}
method.flow.model = "flat"
{fields}
[threshold]
fractions = [0.1, 0.3]
[method.grains]
stiffness = 1e3
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.5
[axes]
"method.kind" = {methods}
"""
MIXED = """
grain = { diameter = 1e-3, density = 2650.0, sizes = { sigma_g = 1.25 } }
bed = { kind = "pile", slope_deg = 15.0, height = 0.006, packing = "poured", poured_depth = 3.0 }
"""
STRIP = """
grain = { diameter = 1e-3, density = 2650.0 }
[bed]
kind = "pile"
shape = "flat"
height = 0.005
length = 0.004
packing = "poured"
poured_depth = 3.0
width = 3.0
"""
"""A poured pile and a strip: all that is asserted of them holds for each of the seeds 0
to 11, which were tried."""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Results:
    text = STUDY.format(fields=MIXED, methods=["pivot", "peeling", "dem"])
    return small_study.run(tmp_path_factory.mktemp("mixed"), text)


@pytest.fixture(scope="module")
def strip(tmp_path_factory: pytest.TempPathFactory) -> Results:
    text = STUDY.format(fields=STRIP, methods=["pivot", "dem"])
    text += '"method.grains.mobile_layers" = [1]\n'
    return small_study.run(tmp_path_factory.mktemp("strip"), text)


def test_a_grain_without_a_way_out_counts_in_no_class(strip: Results) -> None:
    rows, pile = strip.tables["size_class"], _pile(strip, "dem")
    free = int(pile.is_free.sum())
    assert 0 < free < pile.packing.count
    assert (rows.groupby(["scene_id", "fraction"])["count"].sum() == free).all()
    # those whose pivot is known are among the free
    angles = pile.pivot_angles_deg
    assert pile.is_free[np.isfinite(angles)].all()


def test_classes_of_equal_mobility_move_in_parts_of_the_inverse_square(
    mixed: Results,
) -> None:
    name, pile = next(iter(mixed.plan.piles.items()))
    answer = Answer(mixed.plan.decisions[name], pile, mixed.cases)
    # one distribution of the stress for all sizes: equal parts of the classes move at one stress
    sizes = pile.packing.sizes[pile.packing.windward]
    flows = np.empty(len(sizes))
    for each in classes(sizes):
        count = int(each.chosen.sum())
        flows[each.chosen] = ((np.arange(count) + 1) / count) ** 0.5
    answer.motion = Motion.of_flows(flows)
    rows = pd.DataFrame(size_class(answer))
    rows = rows[rows["fraction"] == rows["fraction"].max()]
    own: dict[str, list[float]] = {"hiding": [], "hiding_equal_mobility": []}
    for size, count in zip(rows["size_over_d"], rows["count"], strict=True):
        for column, part in (("hiding", 1.0), ("hiding_equal_mobility", size**-2)):
            asked = part * rows["fraction"].iloc[0]
            tau = np.ceil(asked * count - 1e-9) / count if asked <= 1 else np.nan
            own[column].append(tau)
    for column, taus in own.items():
        found = rows[column] * rows["size_over_d"]
        middle = at_size(1.0, rows["size_over_d"].to_numpy(), np.array(taus))
        np.testing.assert_allclose(found, np.array(taus) / middle, rtol=1e-6)


@pytest.mark.parametrize("name", ["mixed", "strip"])
@pytest.mark.parametrize("sheltering", ["none", "balanced"])
def test_grains_of_poured_beds_leave_in_a_gust_and_go_on_by_their_own_sizes(
    name: str, sheltering: str, request: pytest.FixtureRequest
) -> None:
    results: Results = request.getfixturevalue(name)
    cases = results.cases
    fields: dict[str, object] = {
        "forces.sheltering": sheltering,
        "threshold.criterion": "entrained",
    }
    if sheltering == "balanced":
        fields["forces.exposure"] = "protrusion"
    scene = changed(_pile(results, "pivot").scene, fields)
    leaves = Pile(scene, cases).motion(cases).flows
    pile = Pile(changed(scene, {"threshold.criterion": "sustained"}), cases)
    both = pile.motion(cases).flows
    # the flow at which one grain of each size goes on, over its local friction velocity
    sizes = pile.packing.sizes[pile.packing.windward]
    x, z = pile.tangents[pile.packing.windward].T
    ratio = np.abs(pile.speed(cases))
    further = []
    for size, slope, over in zip(
        sizes, np.degrees(np.arctan2(z, x)), ratio, strict=True
    ):
        grain = Grain(
            diameter=[1e-3 * size],
            density=2650.0,
            fluid_density=1000.0,
            viscosity=1e-6,
            slope_deg=slope,
            roughness=scene.bed.roughness,
            relative_size=size,
        )
        shields = rolling.sustained(grain).initiation(PEAK)[0]
        further.append(np.sqrt(shields * 1.65 * 9.81 * 1e-3 * size) / over)
        if len(further) == 5:
            break
    in_gust = leaves[:5] / np.sqrt(PEAK)
    expected = np.maximum(in_gust, further)
    np.testing.assert_allclose(both[:5], expected, rtol=1e-4)
    by_sustained = pile.sustained_decides(cases)
    np.testing.assert_array_equal(by_sustained[:5], in_gust < further)


@pytest.mark.parametrize("name", ["mixed", "strip"])
def test_each_method_answers_on_one_shared_bed(
    request: pytest.FixtureRequest, name: str
) -> None:
    results: Results = request.getfixturevalue(name)
    assert sorted(one.kind for one in results.plan.cases.values()) == ["pile", "poured"]
    assert len({id(pile.packing) for pile in results.plan.piles.values()}) == 1
    made = results.tables
    rows = made["pile_threshold"].merge(
        made["methods"][["scene_id", "method"]], on="scene_id"
    )
    early = rows[rows["fraction"] == 0.1].set_index("method")["shields"]
    assert set(early.index) == {
        pile.scene.method.kind for pile in results.plan.piles.values()
    }
    # one bed under one stress: the methods differ by dynamics and freed grains alone
    assert early.max() / early.min() < 2.5
    for scene_id, pile in results.plan.piles.items():
        motion = pile.motion(results.cases)
        of_method = rows[rows["scene_id"] == scene_id]
        for fraction, ustar0 in zip(
            of_method["fraction"], of_method["ustar0_m_s"], strict=True
        ):
            grain = np.sort(motion.flows)[int(np.ceil(fraction * motion.count)) - 1]
            assert ustar0 == pytest.approx(grain, rel=1e-12)
    drawn = [*bed.FIGURE.draw(results), *pivots.FIGURE.draw(results)]
    # each method has a picture, of the bed of its exemplar
    assert len(drawn) == len(early.index) + 1
    assert len({figure.name for figure in drawn}) == len(drawn)


def test_grains_in_a_plane_roll_over_their_foremost_contact(mixed: Results) -> None:
    pile = _pile(mixed, "pivot")
    packed = pile.packing
    counted = np.flatnonzero(packed.windward)
    made = mixed.tables["pile_grain"]
    of_pile = made[made["scene_id"] == next(iter(mixed.plan.piles))]
    assert of_pile["grain_id"].tolist() == (counted + 1).tolist()
    for grain, angle in zip(counted, of_pile["pivot_deg"], strict=True):
        apart = packed.places.xyz[grain] - packed.places.xyz
        distance = np.linalg.norm(apart, axis=1)
        reach = (packed.sizes[grain] + packed.sizes) / 2
        touching = (distance < reach * 1.001) & (distance > 0)
        x, _, z = (apart[touching] / distance[touching, None]).T
        along, up = pile.tangents[grain]
        ahead = np.arctan2(-(x * along + z * up), z * along - x * up)
        assert angle == pytest.approx(np.degrees(ahead).max(), abs=1e-5)


def test_grains_in_space_roll_where_their_contacts_bear_the_tilted_weight_no_more(
    strip: Results,
) -> None:
    """The bed is tilted downstream until no pushes of the contacts balance the weight.

    The largest tilt at which some do is the solution of a linear program.
    """
    pile = _pile(strip, "pivot")
    packed = pile.packing
    counted = np.flatnonzero(packed.windward)
    made = strip.tables["pile_grain"]
    of_pile = made[made["scene_id"] == next(iter(strip.plan.piles))]
    assert of_pile["grain_id"].tolist() == (counted + 1).tolist()
    width = packed.places.width
    assert width == 3.0
    rolls, locked = 0, 0
    for grain, angle in zip(counted, of_pile["pivot_deg"], strict=True):
        apart = packed.places.xyz - packed.places.xyz[grain]
        apart[:, 1] -= width * np.round(apart[:, 1] / width)
        distance = np.linalg.norm(apart, axis=1)
        reach = (packed.sizes[grain] + packed.sizes) / 2
        touching = (distance < reach * 1.001) & (distance > 0)
        contacts = (apart[touching] / distance[touching, None]).T
        # pushes of the contacts, and the tangent of the tilt, which is to be the largest
        unknown = contacts.shape[1] + 1
        tilt = np.eye(unknown)[-1]
        found = linprog(
            -tilt,
            A_eq=np.column_stack([contacts, [-1.0, 0.0, 0.0]]),
            b_eq=[0.0, 0.0, -1.0],
            bounds=[(0, None)] * (unknown - 1) + [(None, None)],
        )
        if found.x is not None:
            steepest = np.degrees(np.arctan(found.x[-1]))
            assert angle == pytest.approx(steepest, abs=1e-4)
            rolls += 1
        else:
            assert np.isnan(angle)
            locked += 1
    assert rolls >= 5
    assert locked >= 1


def test_each_size_class_has_its_threshold(mixed: Results) -> None:
    rows, pile = mixed.tables["size_class"], _pile(mixed, "dem")
    assert (
        rows.groupby(["scene_id", "fraction"])["count"].sum() == pile.packing.count
    ).all()
    # of 5 grains 0 to 3 have moved with 80 % where three of ten of all have, so 4 have not
    assert sampled(0.3, 5) == (0.0, 0.8)
    # stresses are over that at d50, which lies between those of two classes
    for _, of_bed in rows.dropna(subset=["hiding"]).groupby(["scene_id", "fraction"]):
        sizes = np.log(of_bed["size_over_d"])
        stress = np.log(of_bed["hiding"] * of_bed["size_over_d"])
        assert np.interp(0.0, sizes, stress) == pytest.approx(0.0, abs=1e-9)
    known = rows["class_moved"].notna()
    assert (rows["class_moved_low"] <= rows["class_moved"])[known].all()
    assert (rows["class_moved"] <= rows["class_moved_high"])[known].all()
    # where the first grains of the class around d lie loose, nothing is hidden
    name, pile = next(iter(mixed.plan.piles.items()))
    answer = Answer(mixed.plan.decisions[name], pile, mixed.cases)
    near = np.abs(np.log(pile.packing.sizes[pile.packing.windward])) < np.log(2) / 4
    motion = Motion.of_flows(np.where(near, 0.0, 0.1))
    answer.motion = motion
    loose = pd.DataFrame(size_class(answer))
    assert set(loose["shields_own"] > 0) == {False, True}
    assert loose["hiding"].isna().all()


@pytest.mark.parametrize("name", ["mixed", "strip"])
def test_load_steps_rise_where_the_last_grain_asked_for_lies_loose(
    request: pytest.FixtureRequest, name: str
) -> None:
    results: Results = request.getfixturevalue(name)
    pile = _pile(results, "dem")
    scene = changed(pile.scene, {"method.grains.final_fraction": 1e-6})
    rising = flows(loads_of(Pile(scene, results.cases), results.cases))
    assert (np.diff(rising) > 0).all()


@pytest.mark.parametrize("name", ["mixed", "strip"])
def test_the_deck_has_the_grains_as_they_lie(
    request: pytest.FixtureRequest, name: str
) -> None:
    results: Results = request.getfixturevalue(name)
    pile = _pile(results, "dem")
    text = (results.cases / pile.case.name / "grains.data").read_text()
    rows = [row.split() for row in text.partition("Atoms\n\n")[2].splitlines()]
    _, _, diameter, _, _, y, _ = np.array(rows, float).T
    force, exposed = (
        loads_of(pile, results.cases).loading.at(0.02),
        pile.packing.windward,
    )
    np.testing.assert_allclose(diameter, pile.packing.sizes * 1e-3, rtol=5e-9)
    if name == "mixed":  # each is driven by its own size
        sizes = pile.packing.sizes[exposed]
        assert pile.packing.sizes.max() / pile.packing.sizes.min() > 1.5
        assert (
            np.diff(np.linalg.norm(force[exposed], axis=1)[np.argsort(sizes)]) > 0
        ).all()
        return
    assert 0 <= y.min() < y.max() < 3e-3
    assert (force[exposed] > 0).all()
    grains = results.tables["pile_grain"]
    number = grains["grain_id"].to_numpy() - 1
    np.testing.assert_allclose(grains["y_m"], y[number], rtol=0, atol=1e-11)


def test_a_bed_none_of_whose_grains_is_held_is_refused(
    mixed: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    pile = _pile(mixed, "dem")
    for name in ("alone", "leaving"):
        monkeypatch.setattr(Loads, name, lambda loads: np.zeros(pile.packing.count))
    with pytest.raises(InputError, match="lets it go"):
        flows(loads_of(pile, mixed.cases))


def test_a_poured_bed_that_loses_a_grain_says_what_helps(
    mixed: Results, tmp_path: Path
) -> None:
    """Its grains overlap nowhere: one that lay loose on a slope has rolled off it."""
    pile = _pile(mixed, "dem")
    for run in pile.runs:
        shutil.copytree(mixed.cases / run.name, tmp_path / run.name)
    file = tmp_path / pile.case.name / "settling.csv"
    settling = pd.read_csv(file)
    settling.loc[settling.index[-1], "grains"] -= 1
    settling.to_csv(file, index=False)
    with pytest.raises(
        Exploded, match=r"lost before the flow rose \(another bed\.seed"
    ):
        pile.case.collect(tmp_path / pile.case.name)
