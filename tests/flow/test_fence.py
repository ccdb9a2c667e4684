"""Porous fences: their loss, the cells that have it, and the flow through them."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.flow.case import FlowCase
from orchestrator.flow.fence import FENCES, fence_cells, loss
from orchestrator.flow.foam import SolvedFlow, read_list
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import WallStress
from orchestrator.study.parts import Obstacle, PileBed
from orchestrator.types import FloatArray
from tests.bed.test_line import bed
from tests.flow.conftest import PILE, Solve, changed

X, HEIGHT = -0.1, 0.012


def fenced(porosity: float | None) -> PileBed:
    """Level ground with a fence; None for one without."""
    fences: tuple[Obstacle, ...] = ()
    if porosity is not None:
        fence = {"kind": "fence", "x": X, "height": HEIGHT, "porosity": porosity}
        fences = (Obstacle.model_validate(fence),)
    return bed(shape="flat", length=0.1, obstacles=fences)


@pytest.mark.parametrize("kind", ["fence", "half-cylinder"])
def test_a_length_is_that_of_a_block(kind: str) -> None:
    """Else an answer would tell a length that no flow has seen."""
    about = {"x": X, "height": HEIGHT, "length": 0.05}
    Obstacle.model_validate({"kind": "block", **about})
    with pytest.raises(ValidationError, match=f"a {kind} with a length of 50 mm"):
        Obstacle.model_validate({"kind": kind, **about})


def flow(porosity: float | None, cells: int = 16) -> FlowCase:
    asked = fenced(porosity)
    return replace(
        changed(PILE, cells_per_face=cells),
        line=of_bed(asked),
        slope_deg=0.0,
        height_m=HEIGHT,
    )


def behind(solve: Solve, porosity: float, heights: FloatArray) -> FloatArray:
    """The stress on the bed at some places behind the fence."""
    stress = WallStress.from_csv(solve(flow(porosity)) / WALL_STRESS)
    return np.interp(X + heights * HEIGHT, stress.x_m, stress.tau_wall)


def test_the_loss_is_that_of_perforated_plates() -> None:
    """Against the table of plates with sharp edges of Blevins (1984)."""
    porosity = [0.3, 0.4, 0.5, 0.6, 0.7]
    np.testing.assert_allclose(loss(porosity), [17, 7.7, 3.8, 2.0, 1.1], rtol=0.13)
    assert float(loss(1.0)) == 0.0
    assert float(loss(1e-6)) > 1e12
    falls = loss(np.linspace(0.01, 1.0, 100))
    assert np.all(np.diff(falls) < 0)


def test_the_bed_goes_on_under_a_porous_fence() -> None:
    bare, solid, porous = (of_bed(fenced(part)) for part in (None, 0.0, 0.5))
    x = np.linspace(bare.x[0], bare.x[-1], 999)
    np.testing.assert_allclose(porous.height(x), bare.height(x), atol=1e-12)
    assert solid.height(np.array(X)) == pytest.approx(HEIGHT)
    ((start, end),) = porous.bare
    (fence,) = porous.fences
    assert (start + end) / 2 == pytest.approx(X)
    assert (fence.start, fence.end, fence.height, fence.porosity) == (
        start,
        end,
        HEIGHT,
        0.5,
    )
    (scaled,) = porous.scaled(1000.0).fences
    assert scaled.height == pytest.approx(1000 * HEIGHT)
    assert scaled.thickness == pytest.approx(1000 * fence.thickness)
    assert scaled.porosity == 0.5


def test_fences_on_one_bed_keep_their_own_places_and_porosities() -> None:
    obstacles = (
        Obstacle(kind="fence", x=0.3, height=0.02, porosity=0.3),
        Obstacle(kind="fence", x=-0.2, height=0.01, porosity=0.6),
        Obstacle(kind="block", x=-0.1, height=0.01),
    )
    line = of_bed(bed(obstacles=obstacles))
    found = [(round(one.start, 4), one.height, one.porosity) for one in line.fences]
    assert found == [(-0.2005, 0.01, 0.6), (0.299, 0.02, 0.3)]
    assert len(line.bare) == 3


def test_the_cells_of_a_fence_have_its_whole_loss_and_no_more() -> None:
    """The row in which it ends has the part of the loss that the fence covers of it."""
    line = BedLine((-1.0, 1.0), (0.0, 0.0), 0.1, (), ())
    fence = of_bed(fenced(0.5)).fences[0]._replace(start=-0.02, end=0.02, height=0.26)
    x = np.array([-0.5, -0.01, 0.01, 0.5])
    tops = np.array([0.1, 0.2, 0.3, 0.4])
    middles = np.zeros((4, 4, 3))
    middles[..., 0] = x[:, None]
    middles[..., 2] = tops - 0.05
    cells = fence_cells(replace(line, fences=(fence,)), middles, np.tile(tops, (4, 1)))
    whole, top = cells
    assert whole.cells.tolist() == [4, 5, 8, 9]
    assert top.cells.tolist() == [6, 10]
    per_metre = float(loss(0.5)) / 0.04
    assert whole.per_metre == pytest.approx(per_metre)
    assert top.per_metre == pytest.approx(0.6 * per_metre)


def test_a_flow_without_a_porous_fence_is_called_as_before() -> None:
    names = {part: flow(part).name for part in (None, 0.0, 0.4, 0.5)}
    assert len(set(names.values())) == 4
    assert "fences" not in flow(0.0).parameters
    assert flow(0.5).parameters["fences"] != flow(0.4).parameters["fences"]


def test_the_more_porous_a_fence_the_more_wind_goes_on(solve: Solve) -> None:
    heights = np.array([2.0, 3.0, 4.0])
    found = [behind(solve, part, heights) for part in (0.02, 0.3, 0.5, 0.7, 0.9)]
    assert np.all(np.diff(found, axis=0) > 0)
    # little is left of a fence that is nearly all holes
    assert np.all((found[-1] > 0.85) & (found[-1] < 1))
    # one that is nearly shut has the wind run back behind it, as a solid one
    assert np.all(found[0] < 0)
    assert np.all(behind(solve, 0.0, heights) < 0)
    # and one that is half open has not
    assert np.all(found[2] > 0)


def test_the_pressure_falls_by_the_loss(solve: Solve) -> None:
    """From the middle of the first cells in the fence to that of the second, half of it."""
    one = flow(0.5)
    directory = solve(one)
    solved = SolvedFlow(directory)
    middles = solved.mesh.middles
    pressure = solved.field("p")[:, 0]
    speed = np.linalg.norm(solved.velocity, axis=1)
    zones = directory / "constant/polyMesh/cellZones"
    cells = read_list(zones, "fence1 ", kind=int)[:, 0]
    columns = np.split(cells[np.argsort(middles[cells, 0], kind="stable")], 2)
    first, second = (one[np.argsort(middles[one, 2])] for one in columns)
    fall = pressure[first] - pressure[second]
    through = (solved.velocity[first, 0] * speed[first]).mean()
    expected = float(loss(0.5)) / 2 * through / 2
    assert fall.mean() == pytest.approx(expected, rel=0.25)
    text = (directory / FENCES).read_text(encoding="utf-8")
    assert text.count("explicitPorositySourceCoeffs") == len(
        [name for name in ("fence1\n", "fence1Top\n") if name in text]
    )


def at_half_height(solve: Solve, porosity: float) -> float:
    """By which part the least velocity behind a fence is below that before it."""
    solved = SolvedFlow(solve(flow(porosity, cells=40)))
    middles = solved.mesh.middles
    rows = int(np.argmax(np.diff(middles[:, 0]) > 1e-9)) + 1
    x = middles[::rows, 0]
    heights = middles[:, 2].reshape(-1, rows)
    speeds = solved.velocity[:, 0].reshape(-1, rows)
    half = np.array(
        [np.interp(HEIGHT / 2, z, u) for z, u in zip(heights, speeds, strict=True)]
    )
    wake = half[(x > X + 0.3 * HEIGHT) & (x < X + 15 * HEIGHT)]
    return float(1 - wake.min() / np.interp(X - 20 * HEIGHT, x, half))


@pytest.mark.parametrize("porosity", [0.5, 0.7])
def test_the_wind_behind_a_fence_falls_as_others_computed(
    solve: Solve, porosity: float
) -> None:
    """By the fit of Wilson (1985) to his second-order closure."""
    resistance = float(loss(porosity)) / 2
    expected = resistance / (1 + 2 * resistance) ** 0.8
    assert at_half_height(solve, porosity) == pytest.approx(expected, abs=0.04)
