"""What a plan refuses, what it is warned of, and what a study file may still ask for."""

from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.study import study
from orchestrator.study.study import Study

FENCE = {"bed.obstacles": [{"kind": "fence", "x": -0.1, "height": 0.01}]}
POURED = {"bed.packing": "poured", "bed.slope_deg": 45.0, "bed.height": 0.015}
SOLVED_LEVEL = {"bed.shape": "flat", "bed.slope_deg": 0.0, "method.flow.model": "solve"}
LONG = {"bed.shape": "dune", "bed.slope_deg": 12.0, "method.kind": "pivot"}
MOUND = "beyond what poured grains hold"
GRAIN: dict[str, object] = {"bed.kind": "grain", "grain.friction_angle_deg": 35.0}
REFUSED: list[tuple[dict[str, object], str, str]] = [
    ({**GRAIN, "bed.slope_deg": 31.0}, "bed.slope_deg", "= 30 deg"),
    (
        {**GRAIN, "bed.slope_deg": 36.0, "bed.entrainment_angle_deg": 50.0},
        "bed.slope_deg",
        "= 35",
    ),
    ({"bed.slope_deg": 31.0}, "bed.slope_deg", "90 deg - entrainment angle"),
    ({"bed.entrainment_angle_deg": 55.0}, "bed.entrainment_angle_deg", "wedged"),
    ({"bed.entrainment_angle_deg": 59.9}, "bed.entrainment_angle_deg", "wedged"),
    ({"method.flow.first_cell_height": 3e-5}, "bed.roughness", "z_e"),
    ({"method.flow.viscosity": 1e-2}, "method.flow.viscosity", "not turbulent"),
    ({"method.grains.time_step": 0.5}, "method.grains.time_step", "above 0.4"),
    (
        {"method.grains.damping": 0.3, "method.grains.time_step": 0.3},
        "method.grains.time_step",
        "above 0.2",
    ),
    ({"method.grains.damping": 0.01}, "method.grains.damping", "does not come to rest"),
    (
        {"bed.shape": "cosine", "bed.slope_deg": 31.0},
        "bed",
        "deg at x = .* is beyond min",
    ),
    (
        {"bed.shape": "dune", "bed.counted": "all", "bed.lee_slope_deg": 33.0},
        "bed",
        "33 deg at x",
    ),
    (
        {"bed.forms": 2, "bed.spacing": 0.1},
        "bed",
        r"bed.spacing: forms 0.149\d* m long over",
    ),
    (SOLVED_LEVEL, "method.flow.model", "nothing to solve"),
    (
        {"method.flow.model": "waves", **FENCE},
        "method.flow.model",
        "rises by 75 deg at x = -0.1",
    ),
    (
        {**LONG, "bed.height": 20.0},
        "bed",
        "128.734 m of bed are 128734 grains, more than",
    ),
    ({**POURED, "bed.slope_deg": 30.0, "bed.height": 60.0}, "bed", "grains, more than"),
    # poured beds settled at 35 to 39 deg, with grains 4.4 d under the line of the flow
    ({**POURED, "bed.shape": "step up", "bed.slope_deg": 60.0}, "bed", MOUND),
    ({"bed.packing": "poured", "grain.friction_angle_deg": 14.0}, "bed", MOUND),
]
ROLLING = {"bed.slope_deg": 69.0, "bed.entrainment_angle_deg": 20.0}
RISING = {"method.kind": "dem", "method.grains.waiting_time": 1.0}
WARNED: list[tuple[dict[str, object], str, str]] = [
    (
        {**GRAIN, **ROLLING, "grain.friction_angle_deg": 80.0},
        "bed.slope_deg",
        "half-way",
    ),
    (
        {"method.grains.waiting_time": 2.0},
        "method.grains.waiting_time",
        "rises steadily",
    ),
    (
        {**GRAIN, **RISING, "method.grains.load_increment": 0.0101},
        "method.grains.load_increment",
        "8 % and more too high",
    ),
    (
        {**GRAIN, **RISING, "method.grains.waiting_time": 2.0},
        "method.grains.load_increment",
        "leaves late",
    ),
    (
        {"method.flow.turbulence_model": "kOmegaSST"},
        "method.flow.turbulence_model",
        "5 to 8 % higher",
    ),
    (
        {"forces.averaging_length": 0.2},
        "forces.averaging_length",
        "5 to 13 % too high",
    ),
    (
        {"method.flow.first_cell_height": 1e-3},
        "method.flow.first_cell_height",
        "0.001 m in place of 0.0005 m",
    ),
    (
        {"method.flow.cells_per_face": 10},
        "method.flow.cells_per_face",
        "5 % too high",
    ),
    (
        {"method.kind": "dem", "method.grains.stiffness": 1e8},
        "method.grains.stiffness",
        "6 to 11 % too high",
    ),
    ({"method.grains.load_increment": 0.1}, "method.grains.load_increment", "interval"),
    ({"forces.loaded_grains": "all but crest"}, "forces.loaded_grains", "blocks"),
    (
        {"method.flow.convection_scheme": "upwind"},
        "method.flow.convection_scheme",
        "does not converge",
    ),
]
ALLOWED: list[dict[str, object]] = [
    {**GRAIN, "bed.slope_deg": 25.0},
    {**GRAIN, **RISING, "method.grains.load_increment": 0.004},
    {**GRAIN, "method.kind": "dem", "method.grains.load_increment": 0.1},
    {"forces.averaging_length": 0.1, "method.flow.cells_per_face": 20},
    {"method.flow.turbulence_model": "RNGkEpsilon"},
    {**LONG, "bed.slope_deg": 1.0, "bed.lee_slope_deg": 34.0, "bed.height": 0.01},
    {**LONG, "bed.height": 20.0, "bed.counted": [10.0, 12.0]},
    {"method.flow.model": "waves"},
    {"method.flow.model": "flat", "bed.shape": "flat", "bed.slope_deg": 0.0},
    {**POURED, "bed.shape": "step up", "bed.slope_deg": 30.0},
]


def _asked(fields: dict[str, object]) -> Study:
    """A study of one scene, by default a pile of 15 deg under a solved flow."""
    bed = {"bed.kind": "pile", "bed.roughness": "d/30", "bed.slope_deg": 15.0}
    given = {"grain.diameter": 1e-3, **bed, **fields}
    text = "\n".join(f"{name} = {_toml(value)}" for name, value in given.items())
    return study.parse(text, name="test", where="test.toml")


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{k} = {_toml(v)}' for k, v in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return f'"{value}"' if isinstance(value, str) else f"{value}"


@pytest.mark.parametrize(("fields", "field", "what"), REFUSED)
def test_beyond_a_limit_a_plan_is_refused(
    fields: dict[str, object], field: str, what: str
) -> None:
    asked = _asked(fields)
    with pytest.raises(InputError, match=what) as caught:
        plan.make(asked)
    assert caught.value.where == f"test.toml: {field}"
    assert "; map “" in caught.value.remedy or "m of bed are" in caught.value.what


@pytest.mark.parametrize(("fields", "field", "what"), WARNED)
def test_an_answer_that_is_merely_worse_is_warned_of(
    fields: dict[str, object], field: str, what: str
) -> None:
    with pytest.warns(UserWarning, match=f"{field}: .*{what}.*map"):
        limits.check_study(_asked(fields))


@pytest.mark.parametrize("fields", ALLOWED)
def test_within_the_limits_nothing_is_said(fields: dict[str, object]) -> None:
    limits.check_study(_asked(fields))


@pytest.mark.parametrize("command", ["study", "ladder", "budget"])
def test_a_study_beyond_the_limits_writes_nothing(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "steep.toml"
    text = 'grain = { diameter = 1e-3 }\nbed = { kind = "pile", slope_deg = 15.0 }\n'
    source.write_text(text + "[[group]]\n[[group]]\nbed = { slope_deg = 31.0 }\n")
    assert cli.main([command, str(source), "--out", str(tmp_path / "out")]) == 2
    assert (
        f"{source}: group 2: bed.slope_deg: 31 deg is beyond" in capsys.readouterr().err
    )
    assert list(tmp_path.iterdir()) == [source]
