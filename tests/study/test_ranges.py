"""Scenes at the ends of all ranges, and their closed forms."""

import itertools
import warnings
from typing import Any

import pytest

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.physics.threshold import Threshold, threshold
from orchestrator.study import closed_form, study
from orchestrator.study.study import Study

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


def parse(text: str) -> Study:
    return study.parse(text, name="test", where="test.toml")


def test_the_closed_form_bears_the_ends_of_all_ranges_together() -> None:
    axes = (f'"{field}" = [{", ".join(ends)}]' for field, ends in ENDS.items())
    scenes = parse("\n".join(["[axes]", *axes])).scenes
    assert len(scenes) >= 2 ** len(ENDS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert all(closed_form.closed_form(scene).friction_velocity > 0 for scene in scenes)


@pytest.mark.parametrize("field", ["bed.slope_deg", "forces.lift_coefficient", "grain.damping"])
def test_minus_zero_is_zero(field: str) -> None:
    texts = (f"[grain]\ndiameter = 1e-3\n[axes]\n'{field}' = [{zero}]" for zero in ("0.0", "-0.0"))
    one, other = (parse(text).scenes for text in texts)
    assert [scene.id for scene in one] == [scene.id for scene in other]


@pytest.mark.parametrize(
    "axes",
    [
        "'grain.diameter' = [1e-3, 2e-3, 1e-3]",
        "'grain.diameter' = [1e-3, 0.001]",
        "'bed.slope_deg' = [0.0, -0.0]\n'grain.diameter' = [1e-3]",
        "'bed.slope_deg' = [0, 0.0]\n'grain.diameter' = [1e-3]",
        "'bed.roughness' = ['d/10', 1e-4]\n'grain.diameter' = [1e-3]",
    ],
)
def test_an_axis_names_each_scene_once(axes: str) -> None:
    with pytest.raises(InputError, match=r"test\.toml: axes: .* are one scene"):
        parse(f"[axes]\n{axes}")


def test_groups_may_share_a_scene() -> None:
    asked = parse("[[group]]\ngrain = { diameter = 1e-3 }\n" * 2)
    assert [len(group.scenes) for group in asked.groups] == [1, 1]
    assert len(asked.scenes) == 1


@pytest.mark.parametrize("limit", ["nan", "inf", "0", "-1", "1e9", "1" + "0" * 400, "true"])
def test_a_time_limit_is_one_that_can_be_waited_for(limit: str) -> None:
    with pytest.raises(InputError, match=r"test\.toml: time_limit: .* is not a time"):
        parse(f"time_limit = {limit}\n[grain]\ndiameter = 1e-3\n")


def test_thresholds_of_many_groups_are_found_together(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = itertools.count()

    def counted(*arguments: Any, **named: Any) -> Threshold:
        next(calls)
        return threshold(*arguments, **named)

    monkeypatch.setattr(closed_form, "threshold", counted)
    groups = (f"[[group]]\ngrain = {{ diameter = {1.17e-3 + k * 1e-6!r} }}\n" for k in range(50))
    asked = parse("\n".join(groups))
    assert len(asked.groups) == 50
    assert all(closed_form.law_holds(scene) for scene in asked.scenes)
    assert {closed_form.regime_of(scene) for scene in asked.scenes} == {"high"}
    assert next(calls) == 3  # of the law, and of the two that tell the regime
    assert len(plan.make(asked).cases) == 1


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_a_grain_of_another_scale_in_a_fluid_of_the_same_numbers_is_the_same(scale: float) -> None:
    """Shields number and Re* depend on d^3 (s - 1) g/nu^2, s, z0/d and the angles alone."""
    text = "grain = {{ diameter = {} }}\nfluid = {{ viscosity = {!r}, gravity = {!r} }}"
    one = parse(text.format(1e-3, 1e-5, 9.81)).scenes[0]
    other = parse(text.format(1e-3 * scale, 1e-5 * scale**2, 9.81 * scale)).scenes[0]
    a, b = closed_form.closed_form(one), closed_form.closed_form(other)
    assert float(a.shields) == pytest.approx(float(b.shields), rel=1e-9)
    assert float(a.reynolds) == pytest.approx(float(b.reynolds), rel=1e-9)
