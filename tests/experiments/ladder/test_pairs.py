"""What the ladder runs, beside what; no solver is run."""

import math
from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments.ladder import naive, pairs, ranking
from orchestrator.fidelity.levels import LEVELS
from orchestrator.study import study
from orchestrator.study.parts import PileBed
from orchestrator.study.study import Study


@pytest.fixture(scope="module")
def asked() -> Study:
    return study.load("ladder")


def test_every_level_is_run_and_each_pile_beside_its_reference(asked: Study) -> None:
    made = pairs.decisions(asked)
    for part, listed in LEVELS.items():
        assert {one.levels[part] for one in made.values()} == {level.name for level in listed}
    for scene in asked.scenes:
        run = {pairs.pair_of(one) for one in made.values() if one.asked == scene}
        by_dem = scene.protocol.method == "dem"
        assert isinstance(scene.bed, PileBed)
        if scene.bed.is_level:
            # no flow is solved over it, and its grains have all levels but that of small piles
            assert {flow for flow, _ in run} == {"flat"}
            assert {pairs.LEVEL_REFERENCE, pairs.LEVEL_AGAIN, ("flat", "full pile, fast")} <= run
            continue
        assert (pairs.REFERENCE in run) == (pairs.AGAIN in run) == by_dem
        assert (pairs.REFERENCE[0], pairs.BESIDE) in run
        # no row beyond the layers of the others is disordered anew
        whole = (pairs.REFERENCE[0], "full pile, fast") in run
        assert whole == (by_dem and scene.bed.packing != "disordered")


def test_what_did_not_run_costs_nothing_that_is_known(asked: Study, tmp_path: Path) -> None:
    routes, made = naive.decisions(naive.small(asked)), pairs.decisions(asked)
    piles = plan.of({**made, **routes}, "ladder").piles
    fast = piles[pairs.key_of(made, naive.FAST)]
    found = naive.costs({name: piles[name] for name in routes}, fast, tmp_path, {})
    assert found["route"].tolist() == [*routes, naive.FAST]
    assert all(map(math.isnan, found["core_s"]))
    assert found["extrapolated"].tolist() == [True, True, False]
    # what needs no run is there, and has no error without its reference
    found = pairs.points(made, piles, tmp_path, {})
    assert set(found["grain_level"]) == {"pivot", "peeling"}
    assert ranking.errors(found).empty


def test_the_naive_route_is_measured_on_the_lowest_pile_with_every_grain_mobile(
    asked: Study,
) -> None:
    small = naive.small(asked)
    assert isinstance(small.bed, PileBed)
    heights = [
        scene.bed.height / scene.grain.diameter
        for scene in asked.scenes
        if isinstance(scene.bed, PileBed) and scene.protocol.method == "dem"
    ]
    assert small.bed.height / small.grain.diameter == min(heights)
    assert not small.is_poured
    dearest, softened = (one.scene for one in naive.decisions(small).values())
    stiffness = dearest.grain.stiffness * dearest.weight / dearest.grain.diameter
    assert stiffness == pytest.approx(1e6)  # N/m, the paper's
    assert softened.grain.stiffness == 1e4
    (route, *_) = plan.of(naive.decisions(small), "naive").piles.values()
    assert route.packing.mobile.sum() > 5 * route.packing.count


def test_a_study_without_dem_has_no_ladder() -> None:
    with pytest.raises(InputError, match="no pile that is answered by DEM"):
        naive.small(study.parse("[grain]\ndiameter = 1e-3\n", name="one", where="one.toml"))
