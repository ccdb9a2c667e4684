"""The maps: their files, their verdicts on real runs, and the limits that were read off them."""

import math
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import pipeline
from orchestrator.errors import InputError
from orchestrator.experiments.stability import maps, verdicts
from orchestrator.experiments.stability.run import planned_for
from orchestrator.fidelity import calibration, limits
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.workspace import Workspace
from orchestrator.study import study

ALL = maps.load_all()
MAPS = calibration.FOLDER / "maps.csv"

SMALL = """
title = "Small"
question = "?"
judge = "pile"
x = { label = "dt", fields = { "protocol.time_step" = 1.0 }, values = [0.2, 1.5] }
y = { label = "h, d", fields = { "bed.height" = 1e-3 }, values = [10.0] }
reference = { "protocol.method" = "peeling" }
bed = { kind = "pile", slope_deg = 20.0, roughness = "d/30" }
grain = { diameter = 1e-3, stiffness = 1e3 }
protocol = { load_increment = 0.05, waiting_time = 6.0, final_fraction = 0.75 }
flow = { model = "hill" }
forces = { law = "high" }
"""


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_a_maps_file_spans_its_axes(one: maps.Map) -> None:
    across = 1 if one.x.is_fraction else len(one.x.places)
    assert len(one.runs) == across * len(one.y.places)
    assert all(run.scenes for run in one.runs)
    if one.judge == "pile":
        assert all(len(run.scenes) == len(run.references) for run in one.runs)
    assert one.question.endswith((".", "?"))


def test_every_limit_names_a_map() -> None:
    assert {limit.map for limit in limits.LIMITS} <= {one.name for one in ALL}


def test_verdicts_are_those_of_real_runs(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    one = maps.load(path)
    planned = planned_for([one])
    space = Workspace(tmp_path / "out")
    with space.held(EXPERIMENT, "stability"):
        pipeline.complete(pipeline.missing(planned, space), space, workers=2, limit_s=120)
    answers = verdicts.Answers(planned, space.cases, planned.done(space.cases))
    good, bad = verdicts.judge(one, answers).table.sort_values("x").to_dict("records")
    assert good["verdict"] == "good"
    assert abs(good["error"]) < 0.05
    assert bad["verdict"] in ("exploded", "noisy")
    assert bad["caught"]
    assert math.isnan(bad["error"])


def _tables_of_a_pile() -> dict[str, dict[str, object]]:
    return {
        "grain": {"diameter": 1e-3},
        "bed": {"kind": "pile", "slope_deg": 15.0},
        "protocol": {},
        "fluid": {},
        "flow": {},
        "forces": {},
    }


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"protocol": {"time_step": 0.5}}, "protocol.time_step"),
        ({"grain": {"damping": 0.3}, "protocol": {"time_step": 0.3}}, "protocol.time_step"),
        ({"grain": {"damping": 0.01}}, "grain.damping"),
        ({"bed": {"slope_deg": 31.0}}, "bed.slope_deg"),
        ({"bed": {"entrainment_angle_deg": 55.0}}, "bed.entrainment_angle_deg"),
    ],
)
def test_a_study_beyond_a_limit_is_refused_with_the_map(
    change: dict[str, dict[str, float]], field: str
) -> None:
    parts = _tables_of_a_pile()
    for part, fields in change.items():
        parts[part].update(fields)
    with pytest.raises(InputError, match="map") as caught:
        limits.check(study.make_scene(parts, "test"), "test")
    assert caught.value.where == f"test: {field}"


@pytest.mark.parametrize(
    ("part", "field", "value"),
    [
        ("protocol", "waiting_time", 2.0),
        ("protocol", "load_increment", 0.1),
        ("forces", "loaded_grains", "all but crest"),
        ("flow", "convection_scheme", "upwind"),
    ],
)
def test_a_study_whose_answer_is_merely_worse_is_warned(
    part: str, field: str, value: object
) -> None:
    parts = _tables_of_a_pile()
    parts[part][field] = value
    with pytest.warns(UserWarning, match="map"):
        limits.check(study.make_scene(parts, "test"), "test")


def _runs(name: str) -> pd.DataFrame:
    table = pd.read_csv(MAPS)
    return table[table["map"] == name]


def test_the_time_steps_that_are_allowed_were_good_on_the_map() -> None:
    for run in _runs("timestep-damping").itertuples():
        step, damping = float(str(run.x)), float(str(run.y))
        if damping >= limits.LEAST_DAMPING and step <= limits.largest_timestep(damping):
            assert run.verdict == "good", (step, damping)


def test_what_blows_up_on_the_map_was_noticed_by_the_run_itself() -> None:
    table = pd.read_csv(MAPS)
    bad = table[table["verdict"].isin(verdicts.VERDICTS)]
    assert len(bad) > 20
    assert bad["caught"].all()


def test_the_holds_that_are_allowed_were_good_on_the_map() -> None:
    for run in _runs("quiet-step").itertuples():
        if float(str(run.y)) >= 6.0 and float(str(run.x)) <= limits.COARSE_STEP:
            assert run.verdict == "good", (run.x, run.y)


def test_rows_with_gaps_are_refused_because_of_what_the_map_shows() -> None:
    runs = _runs("entrainment-layers")
    touching = runs["x"].astype(float) >= limits.CLOSE_PACKED_DEG + 0.5
    assert (runs[touching]["verdict"] == "good").all()
    assert (runs[~touching]["verdict"] != "good").mean() > 0.5
