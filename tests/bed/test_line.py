"""Bed lines of all shapes: heights, slopes, trains, obstacles."""

from typing import Any

import numpy as np
import pytest

from orchestrator.bed.line import of_bed, triangle
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Obstacle, PileBed
from orchestrator.study.shapes import SHAPES

H = 0.02


def bed(**fields: Any) -> PileBed:
    common = {"kind": "pile", "height": H, "roughness": H / 600}
    slope = 15.0 if SHAPES[fields.get("shape", "triangle")].rises else 0.0
    return PileBed.model_validate({"slope_deg": slope, **common, **fields})


BEDS: dict[str, dict[str, Any]] = {
    **{name: {"shape": name} for name in SHAPES},
    "curved dune": {"shape": "dune", "windward": "curved"},
    "rounded dune": {"shape": "dune", "brink_radius": H},
    "curved and rounded": {"shape": "dune", "windward": "curved", "brink_radius": H},
    "train": {"shape": "dune", "forms": 5},
    "apart": {"forms": 3, "spacing": 0.3},
    "fence": {"obstacles": (Obstacle(kind="fence", x=-0.1, height=0.01),)},
    "cylinder": {"obstacles": (Obstacle(kind="half-cylinder", x=0.3, height=0.005),)},
    "block on it": {
        "obstacles": (Obstacle(kind="block", x=0.04, height=0.005, length=0.01),)
    },
}


@pytest.mark.parametrize("name", BEDS)
def test_a_line_goes_downstream_between_flat_beds(name: str) -> None:
    line = of_bed(bed(**BEDS[name]))
    assert np.all(np.diff(line.x) > 0)
    assert line.x[1] - line.x[0] == pytest.approx(10 * H)
    assert line.x[-1] - line.x[-2] == pytest.approx(20 * H)
    assert line.z[0] == line.z[1]
    assert line.z[-1] == pytest.approx(line.z[-2])
    assert np.interp(0.0, line.x, line.arc_lengths) == 0
    assert of_bed(bed()) == triangle(15.0, H)


@pytest.mark.parametrize("name", [name for name in BEDS if SHAPES.get(name)])
def test_a_form_has_its_height_and_its_steepest_slope(name: str) -> None:
    shape, line = SHAPES[name], of_bed(bed(shape=name))
    if shape.rises:
        assert max(line.z) == pytest.approx(H)
        assert line.slopes_deg.max() == pytest.approx(15.0, rel=0.01)
    if "lee_slope_deg" in shape.fields:
        assert line.slopes_deg.min() == pytest.approx(-(shape.lee_slope_deg or 15.0))
        other = of_bed(bed(shape=name, lee_slope_deg=22.0))
        assert other.slopes_deg.min() == pytest.approx(-22.0)
    # an arc takes the sharpness of a brink
    assert of_bed(bed(**BEDS["rounded dune"])).bends_deg.max() < 2.1


def test_forms_of_a_train_are_alike_and_do_not_overlap() -> None:
    line, alone = of_bed(bed(**BEDS["apart"])), of_bed(bed())
    x = np.linspace(0, alone.x[-2], 50)
    for place in range(3):
        np.testing.assert_allclose(
            line.height(x + 0.3 * place), alone.height(x), atol=1e-12
        )
    with pytest.raises(
        UnfitError, match=r"bed.spacing: forms 0.149\d* m long overlap at 0.1 m"
    ):
        of_bed(bed(forms=2, spacing=0.1))


@pytest.mark.parametrize("name", ["fence", "cylinder"])
def test_an_obstacle_stands_on_the_bed_and_is_bare(name: str) -> None:
    line, (obstacle,) = of_bed(bed(**BEDS[name])), BEDS[name]["obstacles"]
    assert float(line.height(np.array(obstacle.x))) == pytest.approx(obstacle.height)
    ((start, end),) = line.bare
    assert (
        obstacle.x - obstacle.reach
        <= start
        < obstacle.x
        < end
        <= obstacle.x + obstacle.reach
    )
    assert np.abs(line.slopes_deg).max() < 75.1
    np.testing.assert_allclose(line.height(np.array([start, end])), 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "slope"),
    [("triangle", 15.0), ("dune", 15.0), ("step up", 0.0), ("train", 0.0)],
)
def test_the_roof_is_clear_of_the_forms(name: str, slope: float) -> None:
    line = of_bed(bed(**BEDS[name]))
    found, ridge = line.roof(0.001)
    assert found == pytest.approx(slope, abs=1e-9)
    inner = line.corners[1:-1] - ridge
    assert (
        inner[:, 1] + np.abs(inner[:, 0]) * np.tan(np.radians(found)) < -0.00099
    ).all()
