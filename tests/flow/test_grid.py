"""The grid along the bed: what it resolves, and what is refused before anything runs."""

import numpy as np
import pytest

from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.flow.case import LEAST_CELL
from orchestrator.flow.grid import ratio_of
from orchestrator.flow.model import model
from orchestrator.study import study

BED = """
grain = {{ diameter = 1e-3 }}
protocol = {{ method = "pivot" }}
[bed]
kind = "pile"
slope_deg = 15.0
height = 0.02
roughness = "d/30"
{}
"""


@pytest.mark.parametrize("cells", [2, 40, 400, 5000])
@pytest.mark.parametrize("part", [1e-3, 0.1, 0.999])
def test_a_geometric_series_fills_the_length(cells: int, part: float) -> None:
    first = part / cells
    ratio = ratio_of(cells, first, 1.0)
    assert first * (ratio ** np.arange(cells)).sum() == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ('obstacles = [{ kind = "block", x = -0.1, height = 1e-5, length = 0.01 }]', "obstacles"),
        ('obstacles = [{ kind = "block", x = -0.1, height = 0.01, length = 1e-5 }]', "obstacles"),
        ('obstacles = [{ kind = "fence", x = -0.1, height = 1e-4 }]', "obstacles"),
        ('obstacles = [{ kind = "half-cylinder", x = -0.1, height = 1e-4 }]', "obstacles"),
        ("flow = { lid = 3.0 }", "flow.lid"),
        ("flow = { cells_per_face = 10, expansion_ratio = 2.0 }", "flow.expansion_ratio"),
    ],
)
def test_what_no_mesh_resolves_is_refused_with_its_field(text: str, field: str) -> None:
    flow = text.startswith("flow")
    body = BED.format("" if flow else text)
    (scene,) = study.parse(text + body if flow else body, name="t", where="t").scenes
    with pytest.raises(InputError) as raised:
        limits.check(scene, "a.toml")
    assert raised.value.where.startswith("a.toml: ")
    assert raised.value.where.endswith(field)
    assert raised.value.remedy or "heights of the forms" in raised.value.what


@pytest.mark.parametrize(
    "text",
    [
        "lee_slope_deg = 0.5",
        'obstacles = [{ kind = "block", x = -5.0, height = 0.02, length = 5.0 }]',
        'obstacles = [{ kind = "fence", x = -0.1, height = 1e-3 }]',
    ],
)
def test_long_stretches_and_small_fences_have_a_grid(text: str) -> None:
    (scene,) = study.parse(BED.format(text), name="t", where="t").scenes
    limits.check(scene, "a.toml")
    (case,) = model(scene).cases
    grid = case.grid
    assert grid.shortest[0] > LEAST_CELL * case.first_cell_m
    for count, ratio, length in zip(grid.cells, grid.ratio, np.diff(grid.line.x), strict=True):
        first = length / (ratio ** np.arange(count)).sum()
        assert first > 0
