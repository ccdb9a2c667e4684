"""The table of thresholds, as Python sees it."""

from typing import get_args

import numpy as np
import pandas as pd
import pytest
from numpy.typing import ArrayLike

from orchestrator.calculator import (
    LARGEST_DEPTH,
    OF_FLOW,
    PARAMETERS,
    QUANTITIES,
    answer,
)
from orchestrator.calculator.table import thresholds
from orchestrator.fidelity import limits
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS, Bridged
from orchestrator.physics.threshold import threshold, why_not
from orchestrator.study.declare import Length
from orchestrator.study.fields import FIELDS, PARTS
from orchestrator.study.study import parse
from orchestrator.types import FloatArray


def test_every_point_and_law_is_the_closed_form_of_it() -> None:
    d = np.geomspace(5e-5, 5e-3, 40)
    slopes = np.linspace(0, 30, 40)
    table = pd.DataFrame(thresholds({"diameter": d, "slope_deg": slopes}))
    assert len(table) == 40 * len(LAWS)
    for name, law in LAWS.items():
        here = Grain(
            diameter=d,
            density=2500.0,
            fluid_density=1.0,
            viscosity=1e-5,
            slope_deg=slopes,
            entrainment_angle_deg=60.0,
        )
        one = threshold(law, here)
        rows = table[table["law"] == name]
        np.testing.assert_allclose(rows["ustar_m_s"], one.friction_velocity, rtol=1e-9)
        np.testing.assert_array_equal(rows["valid"], one.valid)
        why = why_not(law, one.friction_velocity, here)
        for said, texts in zip(rows["why_not"], why, strict=True):
            assert said.split("; ")[: len(texts)] == texts


def test_a_laminar_channel_is_not_valid() -> None:
    """The column said that the law holds, and a line below that the flow is laminar."""
    water = {"fluid_density": [999.1] * 3, "viscosity": [1.1e-6] * 3}
    grains = {"diameter": [5e-5] * 3, "density": [2650.0] * 3}
    table = thresholds({**water, **grains, "depth": [0.01, 0.02, 1.0]}, "bridged")
    asked = table["answer"]
    has_mean = np.isfinite(table["mean_velocity_m_s"][asked])
    assert has_mean.tolist() == [False, True, True]
    assert table["valid"][asked].tolist() == has_mean.tolist()
    is_laminar = ["laminar flow" in text for text in table["why_not"][asked]]
    assert is_laminar == [True, False, False]


def test_parameters_are_fields_of_a_scene_with_their_columns_and_defaults() -> None:
    fields = {one.name: one for one in FIELDS}
    for name, parameter in PARAMETERS.items():
        if name in OF_FLOW:
            continue
        assert parameter.column == fields[parameter.field].column
        part, _, field = parameter.field.partition(".")
        declared = PARTS[part].model_fields[field]
        if name != "roughness":  # its default is a part of the diameter
            assert parameter.default == (
                None if declared.is_required() else declared.default
            )
        for value in map(
            float, parameter.ordinary
        ):  # no scene of an ordinary value is refused
            given: dict[str, object] = {
                "bed.slope_deg": 30.0,
                "grain.diameter": 10.0,
                "grain.density": 2.5e4,
            }
            given |= {"fluid.density": 1e-6, "method.kind": '"pivot"'}
            text = "\n".join(
                f"{k} = {v}" for k, v in {**given, parameter.field: value}.items()
            )
            (scene,) = parse(text, name="t", where="t").scenes
            limits.check(scene, "t")


def test_a_smooth_bed_has_the_wind_of_a_smooth_wall() -> None:
    """Sand on Mars: u* z0/nu = 0.011, so that z0 is nu/(9 u*) more and the wind 44 m/s, not 55."""
    air = {"fluid_density": [0.02], "viscosity": [5.5e-4], "gravity": [3.71]}
    grain = {"diameter": [1e-4], "density": [3000.0]}
    table = thresholds({**grain, **air}, criterion="entrained")
    mars = {column: values[table["answer"]][0] for column, values in table.items()}
    ustar = mars["ustar_m_s"]
    z0 = 1e-4 / 30 + 5.5e-4 / (9 * ustar)
    assert mars["wind_1m_m_s"] == pytest.approx(ustar / 0.41 * np.log(1 + 1 / z0))
    assert mars["wind_1m_m_s"] == pytest.approx(44.3, abs=0.1)


def test_a_quantity_that_nothing_makes_is_no_column(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A misspelt one had the density of the fluid."""
    monkeypatch.setitem(QUANTITIES, "stres_pa", ("stres", "stres, Pa"))
    with pytest.raises(KeyError, match="stres_pa"):
        thresholds({"diameter": [1e-3]})


def test_the_largest_depth_is_that_of_a_study() -> None:
    (most,) = [each.le for each in get_args(Length)[1].metadata if hasattr(each, "le")]
    assert most == LARGEST_DEPTH


class Weak(Bridged):
    """Half the drag, and no part in an interval."""

    name = "weak"
    label = "weak"

    def drag(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        return np.asarray(0.5 * super().drag(ustar, at))


class Compared(Weak, in_interval=True):
    """The same, and a part in it."""


def test_a_law_widens_the_interval_of_a_grain_only_where_it_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def width(*more: Bridged) -> float:
        for law in more:
            monkeypatch.setitem(LAWS, law.name, law)
        table = thresholds({"diameter": [5e-4], "roughness": [5e-5]}, "bridged")
        cells = zip(*(column.tolist() for column in table.values()), strict=True)
        rows = [dict(zip(table, row, strict=True)) for row in cells]
        number = answer.grain_card(rows).numbers[0]
        assert number.low is not None
        assert number.high is not None
        return number.high / number.low

    assert 1 < width() == width(Weak()) < width(Compared())
