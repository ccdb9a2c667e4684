"""Numbers that can be no grain's, no fluid's, no bed's; and those at the ends of what can be."""

import itertools
import warnings
from pathlib import Path
from typing import Any, get_args

import pytest
from annotated_types import Ge, Gt, Le, Lt

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.physics.threshold import Threshold, threshold
from orchestrator.study import closed_form, fields, reference, study
from orchestrator.study.study import Study

NUMERIC = [
    one
    for one in fields.FIELDS
    if {float, int}.intersection((kind := fields.declared(one).annotation, *get_args(kind)))
]


def parse(text: str) -> Study:
    return study.parse(text, name="test", where="test.toml")


def _file(field: str, value: str) -> str:
    """A study file of a pile with one field set."""
    tables = {"grain": {"diameter": "1e-3"}, "bed": {"kind": "'pile'", "slope_deg": "20.0"}}
    part, _, name = field.partition(".")
    tables.setdefault(part, {})[name] = value
    return "\n".join(
        line
        for table, entries in tables.items()
        for line in (f"[{table}]", *(f"{key} = {text}" for key, text in entries.items()))
    )


@pytest.mark.parametrize("one", NUMERIC, ids=lambda one: one.name)
def test_every_number_has_two_ends(one: fields.Quantity) -> None:
    rules = list(reference._rules(fields.declared(one)))
    assert any(isinstance(rule, Ge | Gt) for rule in rules)
    assert any(isinstance(rule, Le | Lt) for rule in rules)
    integer = fields.declared(one).annotation is int
    for value in ("-1", str(10**18)) if integer else ("-1e-320", "1e30", "1e308", "-1e308"):
        with pytest.raises(
            InputError, match=rf"test\.toml: {one.name}: .* is not accepted .*(equal|less)"
        ):
            parse(_file(one.name, value))


@pytest.mark.parametrize("value", ["1e-320", "1e-9", "20.0", "1e30"])
def test_no_grain_is_so_small_or_so_large(value: str) -> None:
    with pytest.raises(InputError, match=r"grain\.diameter"):
        parse(_file("grain.diameter", value))


ENDS = {
    "fluid.density": ("1e-7", "1e4"),
    "fluid.viscosity": ("1e-8", "1e3"),
    "fluid.gravity": ("1e-6", "1e4"),
    "grain.density": ("1.2e4", "2.5e4"),
    "grain.diameter": ("1e-7", "10.0"),
    "bed.roughness": ("'d/3'", "'d/1000'"),
    "bed.slope_deg": ("0.0", "29.9"),
    "forces.lift_coefficient": ("0.0", "100.0"),
}


def test_the_closed_form_bears_the_ends_of_all_ranges_together() -> None:
    axes = (f'"{field}" = [{", ".join(ends)}]' for field, ends in ENDS.items())
    scenes = parse("\n".join(["[axes]", *axes])).scenes
    assert len(scenes) >= 2 ** len(ENDS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [closed_form.closed_form(scene) for scene in scenes]
    assert all(isinstance(one, Threshold) for one in found)
    assert all(one.friction_velocity > 0 for one in found)


ZEROS = ["bed.slope_deg", "forces.lift_coefficient", "grain.damping"]


@pytest.mark.parametrize("field", ZEROS)
def test_minus_zero_is_zero(field: str) -> None:
    texts = (f"[grain]\ndiameter = 1e-3\n[axes]\n'{field}' = [{zero}]" for zero in ("0.0", "-0.0"))
    one, other = (parse(text).scenes for text in texts)
    assert [scene.id for scene in one] == [scene.id for scene in other]


TWICE = [
    "'grain.diameter' = [1e-3, 2e-3, 1e-3]",
    "'grain.diameter' = [1e-3, 0.001]",
    "'bed.slope_deg' = [0.0, -0.0]\n'grain.diameter' = [1e-3]",
    "'bed.slope_deg' = [0, 0.0]\n'grain.diameter' = [1e-3]",
    "'bed.roughness' = ['d/10', 1e-4]\n'grain.diameter' = [1e-3]",
]


@pytest.mark.parametrize("axes", TWICE)
def test_an_axis_names_each_scene_once(axes: str) -> None:
    with pytest.raises(
        InputError, match=r"test\.toml: axes: .* are one scene .list each value once"
    ):
        parse(f"[axes]\n{axes}")


def test_groups_may_share_a_scene() -> None:
    groups = "".join(
        f"[[group]]\nname = '{name}'\ngrain = {{ diameter = 1e-3 }}\n" for name in "ab"
    )
    asked = parse(groups)
    assert [len(group.scenes) for group in asked.groups] == [1, 1]
    assert len(asked.scenes) == 1


def test_a_file_may_begin_with_the_mark_of_its_encoding(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + b"[grain]\r\ndiameter = 1e-3\r\n")
    assert study.load(str(path)).scenes[0].grain.diameter == 1e-3


@pytest.mark.parametrize("limit", ["nan", "inf", "0", "-1", "1e9", "1" + "0" * 400, "true"])
def test_a_time_limit_is_one_that_can_be_waited_for(limit: str) -> None:
    with pytest.raises(InputError, match=r"test\.toml: time_limit: .* is not a time"):
        parse(f"time_limit = {limit}\n[grain]\ndiameter = 1e-3\n")


def test_thresholds_of_many_groups_are_found_together(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = itertools.count()
    find = threshold

    def counted(*arguments: Any, **named: Any) -> Threshold:
        next(calls)
        return find(*arguments, **named)

    monkeypatch.setattr(closed_form, "threshold", counted)
    groups = (f"[[group]]\ngrain = {{ diameter = {1.17e-3 + k * 1e-6!r} }}\n" for k in range(50))
    asked = parse("\n".join(["[forces]", "law = 'bridged'", *groups]))
    assert len(asked.groups) == 50
    assert all(closed_form.law_holds(scene) for scene in asked.scenes)
    assert {closed_form.regime_of(scene) for scene in asked.scenes} == {"high"}
    assert next(calls) == 3  # of the law, and of the two that tell the regime
    assert len(plan.make(asked).cases) == 1
