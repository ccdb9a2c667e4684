"""The ladder: what it runs beside what, and errors from points that are known."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import plan
from orchestrator.bed.pile import pile as packed_pile
from orchestrator.experiment import Runs, piles
from orchestrator.fidelity.classes import LEVEL_BED, scene_class
from orchestrator.fidelity.fidelities import FLAT
from orchestrator.fidelity.measured import LEAST_SCENES
from orchestrator.lab import choices, ladder
from orchestrator.lab.ladder import REFERENCES, RUNGS
from orchestrator.lab.timing import time_alone_s
from orchestrator.physics import threshold
from orchestrator.study import study
from orchestrator.study.parts import PileBed

FAST = "paper"
TAU = {
    "tau_0.1": 1.0,
    "tau_0.3": 1.5,
    "tau_0.5": 2.0,
    "tau_0.7": 2.5,
    "curve_0.50": 2.0,
}
(REFERENCE, AGAIN), (LEVEL_REFERENCE, LEVEL_AGAIN), (FLOW_REFERENCE, FINER) = REFERENCES


def test_every_rung_is_run_and_each_pile_beside_its_reference() -> None:
    asked = study.load("ladder")
    made = [
        (one.asked, one.fidelity)
        for one in ladder.decisions(asked).values()
        if one.fidelity
    ]
    assert {pair.flow for _, pair in made} == set(RUNGS["flow"])
    assert {pair.grains for _, pair in made} == set(RUNGS["grains"])
    for scene in piles(asked):
        run = {
            (pair.flow.name, pair.grains.name) for whose, pair in made if whose == scene
        }
        assert isinstance(scene.bed, PileBed)
        if scene.bed.is_level:  # no flow is solved over it
            assert {LEVEL_REFERENCE, LEVEL_AGAIN} <= run
            assert {flow for flow, _ in run} == {FLAT.name}
        else:
            assert (REFERENCE in run) == (AGAIN in run) == (scene.method.kind == "dem")
            assert FLOW_REFERENCE in run


def test_ten_scenes_of_the_preset_or_more_are_of_each_class() -> None:
    counts: Counter[tuple[str, str]] = Counter()
    for scene in piles(study.load("ladder")):
        counts["flow", scene_class("flow", scene)] += 1
        if scene.method.kind == "dem":
            counts["grains", scene_class("grains", scene)] += 1
    assert min(counts.values()) >= LEAST_SCENES


def test_what_has_not_run_has_no_point_and_what_needs_no_run_no_error(
    tmp_path: Path,
) -> None:
    bed = 'kind = "pile", height = 0.01, slope_deg = 20.0, roughness = "d/30"'
    text = (
        f'grain = {{ diameter = 1e-3 }}\nbed = {{ {bed} }}\nmethod.flow.model = "flat"'
    )
    pairs = ladder.decisions(study.parse(text, name="one", where="one"))
    points = ladder.points(pairs, Runs(plan.of(pairs), tmp_path, {}))
    assert set(points["grain_rung"]) == {"static"}
    assert ladder.rung_errors(points).empty


def test_the_cost_of_a_pile_does_not_depend_on_what_was_asked_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A packing that another pile had asked for once cost nothing."""
    bed = 'kind = "pile", height = 0.01, slope_deg = 20.0, roughness = "d/30"'
    text = (
        f'grain = {{ diameter = 1e-3 }}\nbed = {{ {bed} }}\nmethod.flow.model = "flat"'
    )
    text += '\nmethod.kind = "pivot"'
    (pile,) = plan.make(study.parse(text, name="one", where="one")).piles.values()
    done: list[str] = []

    def counted(name: str, function: Any) -> Any:
        def count(*given: Any, **more: Any) -> Any:
            done.append(name)
            return function(*given, **more)

        return count

    found = threshold.threshold
    packed = counted("packed", packed_pile)
    monkeypatch.setattr("orchestrator.grains.geometry.pile", packed)
    monkeypatch.setattr(threshold, "threshold", counted("found", found))
    work = []
    for _ in range(3):
        done.clear()
        assert time_alone_s(pile, tmp_path) > 0
        work.append([*done])
    assert work[0] == work[1] == work[2]
    assert work[0].count("packed") == 1
    assert "found" in work[0]


def _point(pair: tuple[str, str], factor: float = 1.0, **other: Any) -> dict[str, Any]:
    names = {"scene_id": "a", "pile": "a", "geometry": "20°", "packing": "aligned"}
    facts = {"in_time": True}
    classes = {"class_flow": "wall", "class_grains": "aligned"}
    times = {"flow_s": 1.0, "grains_s": 1.0, "model_floor": 0.2}
    taus = {name: factor * value for name, value in TAU.items()}
    rungs = dict(zip(("flow_rung", "grain_rung"), pair, strict=True))
    return {**names, **facts, **classes, **rungs, **times, **taus, **other}


def _table(*more: dict[str, Any]) -> pd.DataFrame:
    rows = [
        _point(REFERENCE, grains_s=100.0),
        _point(AGAIN, 1.01, grains_s=50.0),
        _point(FLOW_REFERENCE, 0.98, grains_s=0.1),
        _point(("reference", FAST), 1.03, grains_s=2.0),
        _point(("quick", "static"), 0.98 * 1.05, grains_s=0.1, flow_s=0.1),
        _point(FINER, 0.98, grains_s=0.1, flow_s=9.0),
    ]
    return pd.DataFrame([*rows, *more])


def test_a_ladder_has_all_of_its_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bed = 'kind = "pile", height = 0.01, slope_deg = 20.0, roughness = "d/30"'
    text = f"grain = {{ diameter = 1e-3 }}\nbed = {{ {bed} }}"
    one = ladder.Ladder(study.parse(text, name="one", where="one"), tmp_path)
    monkeypatch.setattr(ladder, "points", lambda *_: _table())
    monkeypatch.setattr(choices, "shares", lambda *_: pd.DataFrame())
    found = one.results(Runs(one.planned, tmp_path, {}))
    assert found is not None
    errors = found.tables["scene_errors"]
    assert set(errors["part"]) == {"flow", "grains"}
    pd.testing.assert_frame_equal(errors, ladder.scene_errors(_table()))


def test_errors_are_relative_to_the_reference() -> None:
    table = ladder.rung_errors(_table(_point(("quick", FAST), **{"tau_0.5": math.nan})))
    rows = table.set_index(["flow_rung", "grain_rung"])
    assert rows["error_10"][REFERENCE] == pytest.approx(0.0)
    assert rows["error_50"][FLOW_REFERENCE] == pytest.approx(-0.02)
    assert rows["error_curve"]["reference", FAST] == pytest.approx(0.03)
    assert rows["cost_core_s"]["quick", "static"] == pytest.approx(0.2)
    assert math.isnan(rows["error_50"]["quick", FAST])
    np.testing.assert_allclose(table["reference_error"], 0.01)


def test_numerical_errors_stand_beside_the_uncertainty_of_the_reference() -> None:
    over: dict[str, Any] = {
        "scene_id": "b",
        "pile": "b",
        "class_flow": LEVEL_BED,
        "class_grains": "poured",
    }
    table = _table(
        _point(LEVEL_REFERENCE, **over),
        _point(LEVEL_AGAIN, 1.05, **over),
        _point(("flat", "static"), 1.4, **over),
        # over a pile the flat flow is a level of the flow
        _point(("flat", "static"), 0.7),
    ).reset_index(drop=True)
    # a fraction that only one of the two reaches is infinitely off
    table.loc[table["grain_rung"] == FAST, "tau_0.5"] = math.nan
    known = ladder.numerical_errors(table).set_index(
        ["scene_class", "rung", "fraction"]
    )
    for place, error, uncertainty in (
        (("aligned", "static", 0.5), 0.02, 0.01),
        (("aligned", "reference", 0.1), 0.0, 0.01),
        (("aligned", FAST, 0.1), 0.03, 0.01),
        (("aligned", FAST, 0.5), math.inf, 0.01),
        (("wall", "quick", 0.5), 0.05, 0.0),
        (("wall", "flat", 0.5), 1 - 0.7 / 0.98, 0.0),
        (("poured", "static", 0.5), 0.4, 0.05),
    ):
        row = known.loc[[place]].iloc[0]
        assert (row["error"], row["uncertainty"]) == pytest.approx((error, uncertainty))
        assert row["scenes"] == 1
    assert LEVEL_BED not in known.index.get_level_values("scene_class")
