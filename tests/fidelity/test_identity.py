"""An answer follows from the scene and the tolerance, not from order, spelling or other scenes."""

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import orchestrator as face
from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.study import study
from orchestrator.study.fields import PARTS
from tests.conftest import Command

Group = Mapping[str, Any]
Answers = list[tuple[str, str, str | None, str]]
VALUES: dict[str, list[Any]] = {
    "bed.slope_deg": [15.0, 25.0, 30.0],
    "bed.packing": ["aligned", "horizontal", "disordered"],
    "bed.shape": ["triangle", "dune"],
    "method.grains.mobile_layers": [1, 2],
    "method.grains.stiffness": [1e3, 1e4],
    "method.grains.damping": [0.1, 0.3],
    "grain.cohesion": [0.0, 1e-4],
    "method.kind": ["dem", "peeling", "pivot"],
    "method.grains.load_increment": [0.02, 0.05],
    "method.grains.waiting_time": [6.0, 10.0],
    "method.grains.final_fraction": [0.75, 0.9],
    "method.flow.cells_per_face": [20, 40],
    "method.flow.expansion_ratio": [1.1, 1.2],
    "method.flow.speed": [1.0, 10.0],
    "method.flow.model": ["solve", "waves"],
    "forces.law": ["bridged", "profile"],
    "forces.stress": ["wall", "eq10"],
}
"""Values of fields of which groups are made, the default among them but for the method."""
HEAD = """
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0 }
bed = { kind = "pile", slope_deg = 20.0, height = 0.01 }
"""
GIVEN = ("grain.diameter", "grain.density", "bed.kind", "bed.slope_deg", "bed.height")
DEFAULTS = {
    f"{part}.{name}": declared.default
    for part, model in PARTS.items()
    for name, declared in model.model_fields.items()
    if isinstance(declared.default, bool | int | float | str)
}
SPELT = {name: DEFAULTS[name] for name in DEFAULTS if name.split(".")[0] != "fluid"}
SPELT = {name: value for name, value in SPELT.items() if name not in GIVEN}
"""Fields with a default that a study file can write, and the default."""


@st.composite
def groups(draw: st.DrawFn) -> Group:
    """The fields of a group of one scene."""
    names = draw(st.lists(st.sampled_from([*VALUES]), unique=True, max_size=4))
    return {name: draw(st.sampled_from(VALUES[name])) for name in names}


@st.composite
def spelt(draw: st.DrawFn, group: Group) -> Group:
    """The same scene with some defaults written, in another order, whole numbers as integers."""
    names = draw(st.lists(st.sampled_from([*SPELT]), unique=True, max_size=12))
    fields = {name: SPELT[name] for name in names} | dict(group)
    fields = {name: fields[name] for name in draw(st.permutations([*fields]))}
    if draw(st.booleans()):
        return {name: _as_integer(value) for name, value in fields.items()}
    return fields


def _as_integer(value: Any) -> Any:
    is_whole = isinstance(value, float) and value.is_integer()
    return int(value) if is_whole else value


def answers(*listed: Group, tolerance: float | None = None) -> Answers:
    """Of the one scene of each group: its id, the one that answers, its fidelity, and why."""
    lines = [] if tolerance is None else [f"tolerance = {tolerance}"]
    lines.append(HEAD)
    for group in listed:
        lines.append("[[group]]")
        lines += [f"{name} = {json.dumps(value)}" for name, value in group.items()]
    asked = study.parse("\n".join(lines), name="asked", where="asked")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        decisions = plan.make(asked).decisions
    found: Answers = []
    for group_of_one in asked.groups:
        (scene,) = group_of_one.scenes
        answer = decisions[scene.id]
        fidelity = answer.fidelity.name if answer.fidelity else None
        found.append((scene.id, answer.scene.id, fidelity, answer.why))
    return found


def _possible(*listed: Group, tolerance: float | None) -> None:
    """Leave out fields that do not go together, such as cohesion by DEM."""
    try:
        for group in listed:
            answers(group, tolerance=tolerance)
    except InputError:
        assume(False)


tolerances = st.sampled_from([None, 0.05, 0.2])
properties = settings(max_examples=60, deadline=None)


@properties
@given(
    listed=st.lists(groups(), min_size=2, max_size=4),
    tolerance=tolerances,
    data=st.data(),
)
def test_groups_in_any_order_and_alone_have_the_same_answers(
    listed: list[Group], tolerance: float | None, data: st.DataObject
) -> None:
    _possible(*listed, tolerance=tolerance)
    together = answers(*listed, tolerance=tolerance)
    order = data.draw(st.permutations(range(len(listed))))
    shuffled = answers(*(listed[place] for place in order), tolerance=tolerance)
    assert shuffled == [together[place] for place in order]
    alone = [answers(group, tolerance=tolerance)[0] for group in listed]
    assert together == alone


@properties
@given(group=groups(), tolerance=tolerances, data=st.data())
def test_defaults_that_are_written_and_integers_change_nothing(
    group: Group, tolerance: float | None, data: st.DataObject
) -> None:
    _possible(group, tolerance=tolerance)
    other = data.draw(spelt(group))
    assert answers(other, tolerance=tolerance) == answers(group, tolerance=tolerance)
    # beside each other they are one scene
    both = answers(group, other, tolerance=tolerance)
    assert both[0] == both[1] == answers(group, tolerance=tolerance)[0]


def test_a_method_that_is_asked_for_answers_whatever_other_groups_leave_open() -> None:
    by_dem, left_open = {"method.kind": "dem"}, dict[str, Any]()
    (first, second), (third, fourth) = (
        answers(by_dem, left_open),
        answers(left_open, by_dem),
    )
    assert (first, second) == (fourth, third)
    assert first[2] == "standard"
    assert second[2] == "quick flow, paper grains"
    assert first[0] != second[0]


@pytest.mark.parametrize("name", [*SPELT])
def test_a_field_with_its_own_default_is_the_same_scene(name: str) -> None:
    assert answers({name: SPELT[name]}) == answers({})


FILE = """
title = "Without a solver"
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { diameter = 1e-3, density = 2650.0 }
bed = { kind = "pile", slope_deg = 15.0, height = 0.01 }
method.flow.model = "waves"
"""
ONE = '[[group]]\nname = "one"\nmethod.kind = "pivot"\n'
OTHER = '[[group]]\nname = "other"\nmethod.kind = "peeling"\nmethod.grains.mobile_layers = 1\n'
LONG = '[[group]]\nname = "long"\nbed.height = 2.0\n'


def test_the_command_and_python_give_the_same_in_any_order(
    tmp_path: Path, orchestrator: Command
) -> None:
    texts = {"a": FILE + ONE + OTHER + LONG, "b": FILE + LONG + OTHER + ONE}
    rows = {}
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
        done = orchestrator("study", f"{name}.toml", "--out", f"{name}-command")
        assert done.returncode == 0, done.stderr
        by_face = run_by_face(tmp_path / f"{name}.toml", tmp_path / f"{name}-face")
        for way, table in (("command", None), ("face", by_face)):
            place = tmp_path / f"{name}-{way}" / "tables"
            written = pd.read_csv(place / "pile_threshold.csv")
            assert table is None or len(table) == len(written)
            keys = ["scene_id", "fraction"]
            rows[name, way] = written.sort_values(keys).reset_index(drop=True)
    first = rows["a", "command"]
    assert first["scene_id"].nunique() == 3
    for table in rows.values():
        pd.testing.assert_frame_equal(table, first, check_exact=True)


def run_by_face(file: Path, out: Path) -> pd.DataFrame:
    """The thresholds by `orchestrator.run`."""
    return face.run(file, out=out).tables["pile_threshold"]
