"""Piles of poured grains through the whole line: one bed for all scenes, three methods."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import tables
from orchestrator.errors import InputError
from orchestrator.fidelity.decision import decide
from orchestrator.grains import pile as pile_of_grains
from orchestrator.grains.loads import Geometry, Loads
from orchestrator.grains.motion import Motion
from orchestrator.plan import Plan, make
from orchestrator.report import piles
from orchestrator.report.results import Results
from orchestrator.study import study
from orchestrator.tables.piles import Answer, size_class_rows
from orchestrator.types import BoolArray, FloatArray
from tests import small_study

STUDY = """
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0, sizes = { sigma_g = 1.25 } }
bed = { kind = "pile", slope_deg = 15.0, height = 0.006, packing = "poured", poured_depth = 3.0 }
flow = { model = "flat" }
[protocol]
load_increment = 0.05
waiting_time = 6.0
final_fraction = 0.5
fractions = [0.1, 0.3]
[axes]
"protocol.method" = ["pivot", "peeling", "dem"]
"""
ASKED = study.parse(STUDY, name="poured", where="test")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    cases = tmp_path_factory.mktemp("cases")
    return small_study.in_turn(ASKED, cases), cases


def test_all_scenes_share_one_poured_bed(finished: tuple[Plan, Path]) -> None:
    planned, _ = finished
    kinds = [one.kind for one in planned.cases.values()]
    assert sorted(kinds) == ["pile", "poured"]
    assert all(pile.runs[0].kind == "poured" for pile in planned.piles.values())
    assert len({id(pile.packing) for pile in planned.piles.values()}) == 1


def test_each_method_answers(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    made = tables.make(ASKED, planned, cases, list(planned.cases))
    rows = made["pile_threshold"].merge(made["scenes"][["scene_id", "method"]], on="scene_id")
    early = rows[rows["fraction"] == 0.1].set_index("method")["shields"]
    assert set(early.index) == {"pivot", "peeling", "dem"}
    assert (early > 0.005).all()
    assert (early < 0.2).all()


class Loose(Loads):
    """A bed none of whose grains is held by another."""

    def alone(self) -> FloatArray:
        return np.zeros(self.geometry.packing.count)

    def leaving(self, present: BoolArray | None = None) -> FloatArray:
        return np.zeros(self.geometry.packing.count)


def test_a_bed_none_of_whose_grains_is_held_is_refused(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    (pile, *_) = planned.piles.values()
    with pytest.raises(InputError, match="lets it go"):
        pile_of_grains.flows(Loose(Geometry(pile.scene, cases), pile.loads(cases).ratio))


@pytest.mark.parametrize("length", [1e-3, 1e-12])
def test_a_poured_bed_has_room_for_some_grains(length: float) -> None:
    text = STUDY.replace("slope_deg = 15.0", f'shape = "flat", length = {length}')
    with pytest.raises(InputError, match=r"bed\.length: a poured bed of .* grains"):
        make(study.parse(text, name="short", where="test"))


def test_each_size_class_has_its_threshold(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    made = tables.make(ASKED, planned, cases, list(planned.cases))
    rows = made["size_class"]
    counted = rows.groupby(["scene_id", "fraction"])["count"].sum()
    (pile, *_) = planned.piles.values()
    assert (counted == pile.packing.count).all()
    middle = rows[np.abs(np.log(rows["size_over_d"])) < np.log(2) / 4]
    assert (middle["hiding"].dropna() == 1).all()
    grains = made["pile_grain"]
    assert grains["pivot_deg"].between(-90, 180).all()
    np.testing.assert_allclose(
        np.sort(grains["size_over_d"].unique()),
        np.unique(pile.packing.sizes[pile.packing.windward]),
    )


def test_a_class_whose_first_grains_lie_loose_hides_nothing(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    (answer, *_) = (
        Answer.read(planned.decisions[name], pile, cases) for name, pile in planned.piles.items()
    )
    sizes = answer.pile.packing.sizes[answer.pile.packing.windward]
    middle = np.abs(np.log(sizes)) < np.log(2) / 4
    motion = Motion.of_flows(np.where(middle, 0.0, 0.1))
    rows = pd.DataFrame(size_class_rows(replace(answer, motion=motion)))
    assert set(rows["shields_own"] > 0) == {False, True}
    assert rows["hiding"].isna().all()


def test_each_grain_weighs_and_is_driven_by_its_own_size(finished: tuple[Plan, Path]) -> None:
    planned, cases = finished
    pile = next(one for one in planned.piles.values() if one.scene.protocol.method == "dem")
    packed, d = pile.packing, pile.scene.grain.diameter
    assert packed.sizes.max() / packed.sizes.min() > 1.5
    rows = (cases / pile.case.name / "grains.data").read_text().partition("Atoms\n\n")[2]
    diameters = np.array([row.split()[2] for row in rows.splitlines()], float)
    np.testing.assert_allclose(diameters, packed.sizes * d, rtol=1e-14)
    force = np.linalg.norm(pile.loads(cases).loading.at(0.02), axis=1)[packed.windward]
    own = packed.sizes[packed.windward]
    larger = np.argsort(own)
    assert (np.diff(force[larger]) > 0).all()


def test_no_cheap_level_is_promised_on_poured_beds() -> None:
    solved = STUDY.replace('flow = { model = "flat" }', "").partition("[protocol]")[0]
    (scene,) = study.parse(solved, name="poured", where="test").scenes
    decision = decide(scene, 0.05)
    assert "none is within" in decision.why
    assert decision.error_estimate is not None
    assert decision.error_estimate > 0.05


def test_the_page_shows_where_grains_go_their_pockets_and_sizes(
    finished: tuple[Plan, Path],
) -> None:
    planned, cases = finished
    made = tables.make(ASKED, planned, cases, list(planned.cases))
    found = {one.name: one for one in piles.poured(Results(ASKED, planned, made, cases))}
    assert {"poured-pivot", "poured-peeling", "poured-dem", "pivots", "hiding"} == set(found)
    bed = found["poured-dem"].canvas
    assert bed is not None
    (discs,) = bed.axes[0].collections
    (pile, *_) = planned.piles.values()
    assert np.shape(discs.get_offsets()) == pile.packing.centres.shape
    assert pile.runs[-1].name in str([one.cases for one in found.values()])
