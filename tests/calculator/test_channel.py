"""Two roughnesses: that of the grain's pocket, and that of the channel or the ground."""

import json
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator import cli
from orchestrator.errors import InputError
from orchestrator.physics.velocity import strickler_speed

GRAVEL = {"density": 2650.0, "fluid_density": 1000.0, "viscosity": 1e-6}
"""Gravel of quartz in water; the bed is rough, so that no viscosity adds to z0."""
DIAMETER = 0.03
SPEEDS = ["wind_1m_m_s", "wind_10m_m_s", "mean_velocity_m_s", "discharge_m2_s"]
AT_THE_GRAIN = ["ustar_m_s", "stress_pa", "shields", "drag_n", "lift_n", "verdict"]
SAND_IN_AIR = ["--fluid", "air", "--diameter", "2.5e-4", "--density", "2650"]
GRAVEL_IN_WATER = ["--fluid", "water", "--diameter", "0.03", "--density", "2650"]


def one(**given: Any) -> Any:
    """The row of one grain of gravel."""
    return orchestrator.threshold(DIAMETER, **{**GRAVEL, **given}).iloc[0]


def log_mean(ustar: float, depth: float, z0: float) -> float:
    """The mean of the log law over a depth."""
    return ustar / 0.41 * ((1 + z0 / depth) * math.log(1 + depth / z0) - 1)


def test_the_mean_velocity_follows_from_the_roughness_of_the_channel() -> None:
    row = one(depth=0.6, channel_roughness=0.0053)
    ustar = row["ustar_m_s"]
    assert row["z0_m"] == pytest.approx(0.001)
    assert row["z0_channel_m"] == 0.0053
    mean = log_mean(ustar, 0.6, 0.0053)
    assert row["mean_velocity_m_s"] == pytest.approx(mean, rel=1e-9)
    assert row["discharge_m2_s"] == pytest.approx(0.6 * mean, rel=1e-9)
    for end in ("low", "high"):
        at = row[f"ustar0_{end}_m_s"]
        found = row[f"discharge_{end}_m2_s"]
        assert found == pytest.approx(0.6 * log_mean(at, 0.6, 0.0053), rel=1e-9)


def test_the_channel_changes_no_stress_and_no_verdict() -> None:
    plain = one(depth=0.6)
    rough = one(depth=0.6, channel_roughness=0.02)
    assert plain[AT_THE_GRAIN].equals(rough[AT_THE_GRAIN])
    assert rough["mean_velocity_m_s"] < 0.8 * plain["mean_velocity_m_s"]


def test_a_channel_has_by_default_three_d84() -> None:
    """A mean velocity over grains of d/30 alone was 19 to 43 % too high."""
    alone = one(depth=0.6)
    assert alone["z0_channel_m"] == pytest.approx(DIAMETER / 10, rel=1e-12)
    mixed = one(depth=0.6, d84=0.053)
    assert mixed["z0_channel_m"] == pytest.approx(0.0053, rel=1e-12)
    ustar = mixed["ustar_m_s"]
    by_grains = log_mean(ustar, 0.6, 0.001)
    assert mixed["mean_velocity_grains_m_s"] == pytest.approx(by_grains, rel=1e-9)
    # K = 21.1/d^(1/6), U = K h^(2/3) S^(1/2), of the slope of that stress
    slope = ustar**2 / (9.81 * 0.6)
    strickler = 21.1 / DIAMETER ** (1 / 6) * 0.6 ** (2 / 3) * slope**0.5
    found = mixed["mean_velocity_strickler_m_s"]
    assert found == pytest.approx(strickler, rel=1e-9)
    assert by_grains / strickler == pytest.approx(1.19, abs=0.005)
    assert by_grains / mixed["mean_velocity_m_s"] == pytest.approx(1.43, abs=0.005)
    assert mixed["mean_velocity_m_s"] == mixed["mean_velocity_3d84_m_s"]


def test_stricklers_speed_is_that_of_a_channel_by_hand() -> None:
    # h = 1 m, S = 0.001, d = 64 mm: K = 21.1/0.632 = 33.36, U = 33.36 x 0.0316
    ustar = math.sqrt(9.81 * 1.0 * 0.001)
    assert strickler_speed(ustar, 1.0, 0.064, 9.81) == pytest.approx(1.055, abs=5e-4)


def test_a_wind_follows_from_the_roughness_of_the_ground() -> None:
    air: dict[str, Any] = {"fluid": "air", "density": 2650.0}
    bare = orchestrator.threshold(2.5e-4, **air).iloc[0]
    rippled = orchestrator.threshold(2.5e-4, **air, channel_roughness=1e-3).iloc[0]
    assert rippled["ustar_m_s"] == bare["ustar_m_s"]
    wind = rippled["ustar_m_s"] / 0.41 * math.log1p(10 / 1e-3)
    assert rippled["wind_10m_m_s"] == pytest.approx(wind, rel=1e-9)
    assert rippled["wind_10m_m_s"] < bare["wind_10m_m_s"]
    high = rippled["ustar0_high_m_s"] / 0.41 * math.log1p(10 / 1e-3)
    assert rippled["wind_10m_high_m_s"] == pytest.approx(high, rel=1e-9)


def test_both_options_are_one_and_take_a_part_of_the_diameter(
    capsys: pytest.CaptureFixture[str],
) -> None:
    texts = []
    for words in (
        ["--ground-roughness", "d/5"],
        ["--channel-roughness", "d/5"],
        ["--channel-roughness", "5e-5"],
    ):
        assert cli.main(["threshold", *SAND_IN_AIR, *words, "--json"]) == 0
        texts.append(json.loads(capsys.readouterr().out))
    assert texts[0] == texts[1] == texts[2]
    assert texts[0]["input"]["channel_roughness"] == pytest.approx(5e-5)
    assert cli.main(["threshold", *SAND_IN_AIR, "--ground-roughness", "1e-3"]) == 0
    assert "level ground of z₀ 1 mm" in " ".join(capsys.readouterr().out.split())


def test_the_command_prints_the_discharge_with_its_interval(
    capsys: pytest.CaptureFixture[str],
) -> None:
    river = [*GRAVEL_IN_WATER, "--bed-slope", "0.004", "--d84", "0.053"]
    assert cli.main(["threshold", *river]) == 0
    lines = capsys.readouterr().out.splitlines()
    heads = [place for place, line in enumerate(lines) if "discharge, " in line]
    head = heads[0] + 1
    assert lines[head].split() == ["velocity,", "m/s", "m²/s"]
    of_answer, coarse, strickler, grains = (
        line.split() for line in lines[head + 1 : head + 5]
    )
    assert cli.main(["threshold", *river, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)["bridged-gravel"]
    assert of_answer[2:5] == ["0.0053", "1.31", "0.708"]
    assert record["discharge"] == pytest.approx(0.708, abs=5e-4)
    assert [float(of_answer[5]), float(of_answer[7])] == pytest.approx(
        [record["discharge_low"], record["discharge_high"]], rel=0.05
    )
    assert coarse[-2:] == of_answer[3:5]
    speeds = [float(cells[-2]) for cells in (coarse, strickler, grains)]
    assert speeds == sorted(speeds)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--channel-roughness", "0"], "--channel-roughness: 0 is no length above 0"),
        (["--channel-roughness", "2.5"], "up to 2 m (give z0, a thirtieth of k_s"),
        (["--channel-roughness", "d/x"], "--channel-roughness: nan is no length"),
        (["--d84", "0.05"], "--d84: nothing depends on it without a channel"),
        (["--depth", "1", "--d84", "-1"], "--d84: -1 m is not above 0"),
    ],
)
def test_what_is_no_channel_is_refused(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["threshold", *GRAVEL_IN_WATER, *words]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1


def test_python_has_arrays_of_temperature_and_of_the_slope_of_a_channel() -> None:
    index = pd.Index([7, 3, 5])
    warm = pd.Series([5.0, 25.0, 5.0], index=index)
    slopes = [0.001, -0.002, 0.002]
    rows = orchestrator.threshold(
        2e-3, density=2650.0, fluid="water", temperature=warm, bed_slope=slopes
    )
    assert rows.index.equals(index)
    for place, (deg_c, slope) in enumerate(zip(warm, slopes, strict=True)):
        alone = orchestrator.threshold(
            2e-3, density=2650.0, fluid="water", temperature=deg_c, bed_slope=slope
        )
        pd.testing.assert_frame_equal(
            alone, rows.iloc[[place]].reset_index(drop=True), check_dtype=False
        )
    depths = rows["ustar_m_s"] ** 2 / (9.81 * np.abs(slopes))
    np.testing.assert_allclose(rows["depth_m"], depths, rtol=1e-12)
    assert rows["bed_slope"].tolist() == [0.001, 0.002, 0.002]
    with pytest.raises(InputError, match="did you mean 288 K"):
        orchestrator.threshold(1e-3, fluid="water", temperature=[15.0, 288.0])
    with pytest.raises(InputError, match="a temperature needs it"):
        orchestrator.threshold(1e-3, temperature=[15.0, 20.0])
