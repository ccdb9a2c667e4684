"""Errors, the front and what is known, from points that are known."""

import math
from typing import Any

import pandas as pd
import pytest

from orchestrator.experiments.ladder import ranking
from orchestrator.experiments.ladder.pairs import (
    AGAIN,
    BESIDE,
    FINER,
    LEVEL_AGAIN,
    LEVEL_REFERENCE,
    REFERENCE,
)
from orchestrator.fidelity.calibration import LEVEL
from orchestrator.fidelity.levels import FLAT

TAU = {"tau_0.1": 1.0, "tau_0.5": 2.0, "curve_0.50": 2.0}


def _point(pair: tuple[str, str], factor: float = 1.0, **other: Any) -> dict[str, Any]:
    return {
        "scene_id": "a",
        "packing": "aligned",
        "asked": "dem",
        "class_flow": "wall",
        "class_grains": "aligned",
        "same_model": True,
        "flow_level": pair[0],
        "grain_level": pair[1],
        "flow_s": 1.0,
        "grains_s": 1.0,
        **{name: factor * value for name, value in TAU.items()},
        **other,
    }


def _table() -> pd.DataFrame:
    return pd.DataFrame(
        [
            _point(REFERENCE, grains_s=100.0),
            _point(AGAIN, 1.01, grains_s=50.0),
            _point((REFERENCE[0], BESIDE), 0.98, grains_s=0.1),
            _point((REFERENCE[0], "1 layer, fast"), 1.03, grains_s=2.0),
            _point(("coarse", BESIDE), 0.98 * 1.05, grains_s=0.1, flow_s=0.1),
            _point(FINER, 0.98, grains_s=0.1, flow_s=9.0),
        ]
    )


def test_errors_are_relative_to_the_dearest_pair() -> None:
    found = ranking.errors(_table()).set_index(["flow_level", "grain_level"])
    assert found.loc[REFERENCE, "error_10"] == pytest.approx(0.0)
    assert found.loc[(REFERENCE[0], BESIDE), "error_50"] == pytest.approx(-0.02)
    assert found.loc[(REFERENCE[0], "1 layer, fast"), "error_curve"] == pytest.approx(0.03)
    assert (found["reference_error"] - 0.01).abs().max() < 1e-12
    assert found.loc[("coarse", BESIDE), "cost_core_s"] == pytest.approx(0.2)


def test_a_fraction_that_was_not_reached_has_no_error() -> None:
    table = pd.concat(
        [_table(), pd.DataFrame([_point((REFERENCE[0], "pivot"), **{"tau_0.5": math.nan})])]
    )
    found = ranking.errors(table.reset_index(drop=True))
    assert found[found["grain_level"] == "pivot"]["error_50"].isna().all()


def test_the_front_holds_what_nothing_beats_in_both() -> None:
    found = ranking.with_front(ranking.errors(_table()))
    on_front = found[found["pareto"]]
    front = set(zip(on_front["flow_level"], on_front["grain_level"], strict=True))
    assert ("coarse", BESIDE) in front
    assert REFERENCE in front
    assert (REFERENCE[0], "1 layer, fast") not in front  # dearer and worse than peeling
    assert FINER not in front


def test_known_errors_stand_beside_the_references_own_uncertainty() -> None:
    found = ranking.known(_table()).set_index(["part", "level", "fraction"])
    assert found.loc[("grains", BESIDE, 0.1), "error"] == pytest.approx(0.02)
    assert found.loc[("grains", BESIDE, 0.1), "uncertainty"] == pytest.approx(0.01)
    assert found.loc[("grains", REFERENCE[1], 0.1), "error"] == pytest.approx(0.0)
    # the flow's error is against the dearest flow with the same grains
    assert found.loc[("flow", "coarse", 0.5), "error"] == pytest.approx(0.05)
    assert (found["scenes"] == 1).all()


def test_a_level_bed_is_held_against_a_reference_without_a_solved_flow() -> None:
    over: dict[str, Any] = {"scene_id": "b", "class_flow": LEVEL, "class_grains": "poured, flat"}
    level = [
        _point(LEVEL_REFERENCE, **over),
        _point(LEVEL_AGAIN, 1.05, **over),
        _point((LEVEL_REFERENCE[0], BESIDE), 1.4, **over),
    ]
    # a pile beside it is no reference of it, nor its flat flow one of the levels of the grains
    table = pd.concat([_table(), pd.DataFrame([*level, _point((FLAT, BESIDE), 0.7)])])
    known = ranking.known(table.reset_index(drop=True))
    found = known.set_index(["scene_class", "level", "fraction"])
    assert found.loc[("poured, flat", BESIDE, 0.5), "error"] == pytest.approx(0.4)
    assert found.loc[("poured, flat", BESIDE, 0.5), "uncertainty"] == pytest.approx(0.05)
    assert found.loc[("aligned", BESIDE, 0.5), "error"] == pytest.approx(0.02)
    assert found.loc[("wall", FLAT, 0.5), "error"] == pytest.approx(1 - 0.7 / 0.98)
    assert LEVEL not in set(known["scene_class"])
    errors = ranking.errors(table.reset_index(drop=True)).set_index(["scene_id", "grain_level"])
    assert errors.loc[("b", BESIDE), "error_50"] == pytest.approx(0.4)


def test_what_only_one_of_two_reaches_is_infinitely_off() -> None:
    table = _table()
    table.loc[table["grain_level"] == "1 layer, fast", "tau_0.5"] = math.nan
    found = ranking.known(table).set_index(["part", "level", "fraction"])
    assert found.loc[("grains", "1 layer, fast", 0.5), "error"] == math.inf
    assert found.loc[("grains", "1 layer, fast", 0.1), "error"] == pytest.approx(0.03)
