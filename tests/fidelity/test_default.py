"""What a study file that says nothing of how to answer gets."""

import pytest

from orchestrator import plan
from orchestrator.fidelity.decision import Bound, by_default
from orchestrator.fidelity.spread import floor, lowest_floor
from orchestrator.study import study

OPEN = """
{top}
[grain]
diameter = {diameter}
[bed]
kind = "pile"
slope_deg = 15.0
{bed}
[protocol]
{protocol}
"""


def _asked(top: str = "", bed: str = "", protocol: str = "", diameter: float = 1e-3) -> study.Study:
    text = OPEN.format(top=top, bed=bed, protocol=protocol, diameter=diameter)
    return study.parse(text, name="own", where="own")


@pytest.mark.parametrize("packing", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("diameter", [2e-4, 1e-3])
def test_the_default_errs_less_than_the_model_is_worth(packing: str, diameter: float) -> None:
    (scene,) = _asked(bed=f'packing = "{packing}"', diameter=diameter).scenes
    chosen = by_default(scene)
    assert chosen.by_default
    assert chosen.scene.protocol.method != "dem"
    assert chosen.scene.flow.model == "solve"
    assert chosen.known.total <= lowest_floor() <= floor(scene)


@pytest.mark.parametrize(
    ("top", "bed", "protocol"),
    [
        ("", "", 'method = "dem"'),  # what is the default counts as said
        ("", "", "load_increment = 0.05"),
        ("", "mobile_layers = 1", ""),
        ("", 'packing = "poured"', ""),
        ("tolerance = 0", "", ""),
    ],
)
def test_what_is_said_stays(top: str, bed: str, protocol: str) -> None:
    (decision,) = plan.make(_asked(top, bed, protocol)).decisions.values()
    assert decision.is_as_asked
    assert not decision.by_default
    assert decision.scene.protocol.method == "dem"


def test_what_is_asked_of_nature_does_not_count_as_said() -> None:
    asked = _asked(bed="height = 0.01", protocol="fractions = [0.3]")
    (decision,) = plan.make(asked).decisions.values()
    assert decision.by_default


def test_a_failed_run_goes_to_dearer_levels() -> None:
    (scene,) = _asked().scenes
    first = by_default(scene)
    again = by_default(scene, Bound(first.levels, "a run failed"))
    assert again.known.cost_core_s > first.known.cost_core_s
    assert "a run failed" in again.why
