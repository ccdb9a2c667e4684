"""The bed that changes: its line is drawn anew through the grains that are there, as they leave.

Without `protocol.update` the flow of the whole pile acts until the last grain has gone, as in the
paper. With it the grains leave in rounds. After each, the bed line sinks by as much as the upper
sides of the grains have, and the flow is solved over it; what is left goes on under its forces.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine
from orchestrator.flow.case import WALL_STRESS, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.runs.case import Case
from orchestrator.study.scene import Scene

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

GRAINS = "grains.csv"
"""The grains when a bed line was drawn, in the case of the flow over it; at the end of a run of
LIGGGHTS, in its case."""
EDGE = 2.0
"""Length over which the edge of a bared part is rounded, d."""
NEAREST = 0.25
"""Least distance along x of a new corner from those of the bed line, d."""
LEVEL = 1e-6
"""A bed that is less above the flat bed lies on it, d."""
FAR = 1e9
SPACING = 0.25
"""Spacing of the places at which the height of the grains is asked, d."""


@dataclass(frozen=True)
class Worn:
    """The n grains of a pile that wears, at one time.

    Attributes
    ----------
    places : ndarray, shape (n, 2)
        x and z of the centres, d; NaN for a grain that has gone.
    left : ndarray, shape (n,)
        Undisturbed friction velocity at which a counted grain has moved, m/s; else infinite.
    speed : ndarray, shape (n,)
        Signed local friction velocity over the undisturbed one, at that time; else the last known.
    """

    places: FloatArray
    left: FloatArray
    speed: FloatArray

    @classmethod
    def whole(cls, bed: LoadedBed) -> "Worn":
        """The grains as they were packed."""
        count = len(bed.packing.centres)
        return cls(bed.packing.centres, np.full(count, np.inf), np.zeros(count))

    @property
    def there(self) -> BoolArray:
        """Which grains have not gone, shape (n,)."""
        return ~np.isnan(self.places[:, 0])

    def gone(self, who: BoolArray) -> FloatArray:
        """The places, shape (n, 2), when some more have gone."""
        return np.where(who[:, None], np.nan, self.places)

    def to_csv(self, directory: Path) -> None:
        """Write ``grains.csv``."""
        table = pd.DataFrame(self.places, columns=["x_d", "z_d"])
        table = table.assign(moved_at_m_s=self.left, ustar_over_ustar0=self.speed)
        table.index = pd.RangeIndex(1, len(table) + 1, name="id")
        table.to_csv(directory / GRAINS)

    @classmethod
    def from_csv(cls, directory: Path) -> "Worn":
        """Read what `to_csv` wrote."""
        table = pd.read_csv(directory / GRAINS)
        values = table[["x_d", "z_d", "moved_at_m_s", "ustar_over_ustar0"]].to_numpy(float)
        return cls(values[:, :2], values[:, 2], values[:, 3])


@dataclass(frozen=True)
class WornFlow(Case):
    """The flow over the bed of a pile that has worn for some rounds.

    Attributes
    ----------
    scene : Scene
        Scene of the pile.
    before : FlowCase or WornFlow
        The flow of the round before.
    run : Case or None
        The run of LIGGGHTS of that round; None: its grains leave by peeling.
    """

    scene: Scene
    before: "FlowCase | WornFlow"
    run: Case | None
    kind: ClassVar[str] = "worn"
    template: ClassVar[str] = FlowCase.template
    recipe: ClassVar[int] = FlowCase.recipe
    results: ClassVar[tuple[str, ...]] = FlowCase.results
    derived: ClassVar[tuple[str, ...]] = FlowCase.derived
    bulky: ClassVar[tuple[str, ...]] = FlowCase.bulky
    made: ClassVar[tuple[str, ...]] = FlowCase.made

    @cached_property
    def loaded(self) -> LoadedBed:
        """The bed of the pile."""
        return LoadedBed(self.scene)

    @property
    def number(self) -> int:
        """How many rounds the bed has worn for."""
        return 1 + number(self.before)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The flow and the run of the round before, and the run that poured the bed."""
        runs = () if self.run is None else (self.run,)
        return (self.before, *runs, *self.loaded.pouring)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.model_dump(mode="json", exclude={"protocol": {"fractions"}})

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s: that of the whole pile."""
        return self.loaded.flow.cost_s

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return self.loaded.flow.versions()

    def write(self, directory: Path, cases: Path) -> None:
        """Draw the bed line through the grains that are there, and mesh it."""
        bed = LoadedBed(self.scene, cases)
        if self.run is None:
            worn = peeled(bed, self.before, cases)
        else:
            worn = Worn.from_csv(cases / self.run.name)
        worn.to_csv(directory)
        _over(bed, worn).write(directory, cases)

    def collect(self, directory: Path) -> None:
        """Check the run and write the stress and the diagnostics, as any flow's."""
        bed = LoadedBed(self.scene, directory.parent)
        _over(bed, Worn.from_csv(directory)).collect(directory)


Flow = FlowCase | WornFlow


def number(flow: Flow) -> int:
    """How many rounds the bed under a flow has worn for."""
    return flow.number if isinstance(flow, WornFlow) else 0


def rounds(scene: Scene) -> int:
    """How many flows act on a pile one after another until the last of its fractions has moved."""
    update = scene.protocol.update
    return ceil(max(scene.protocol.fractions) / update - 1e-9) if update else 1


def goal(bed: LoadedBed, round_: int) -> int:
    """How many counted grains have moved when a round ends, the first being 0."""
    return ceil((round_ + 1) * bed.scene.protocol.update * bed.packing.count - 1e-9)


def grains(bed: LoadedBed, flow: Flow, cases: Path) -> Worn:
    """The grains as they were when a round began."""
    return Worn.from_csv(cases / flow.name) if isinstance(flow, WornFlow) else Worn.whole(bed)


def line(bed: LoadedBed, flow: Flow, cases: Path) -> BedLine:
    """The bed line of a round, d."""
    return sunk(bed, grains(bed, flow, cases)) if isinstance(flow, WornFlow) else bed.line


def ratio(bed: LoadedBed, flow: Flow, cases: Path) -> FloatArray:
    """Signed local friction velocity over the undisturbed one at each grain in a round."""
    stress = WallStress.from_csv(cases / flow.name / WALL_STRESS)
    return bed.ratio(stress, line(bed, flow, cases))


def peeled(bed: LoadedBed, flow: Flow, cases: Path) -> Worn:
    """The grains at the end of a round in which they leave by peeling."""
    worn, speed = grains(bed, flow, cases), ratio(bed, flow, cases)
    windward = bed.packing.windward
    reached = worn.left[np.isfinite(worn.left)].max(initial=0.0)
    flows = np.full(len(windward), np.inf)
    flows[windward] = np.maximum(bed.leaving(speed, worn.there), reached)
    flows[~worn.there] = np.inf
    least = goal(bed, number(flow)) - int(np.isfinite(worn.left).sum())
    # those that one grain frees at its flow leave with it
    last = np.sort(flows)[least - 1] if least > 0 else 0.0
    leave = np.isfinite(flows) & (flows <= last)
    return Worn(
        worn.gone(leave),
        np.where(leave, flows, worn.left),
        np.where(worn.there, speed, worn.speed),
    )


def _over(bed: LoadedBed, worn: Worn) -> FlowCase:
    """The flow over what is left of a bed."""
    return replace(bed.flow, line=sunk(bed, worn).scaled(bed.scene.grain.diameter))


def sunk(bed: LoadedBed, worn: Worn) -> BedLine:
    """The bed line over worn grains, d: as much lower as their upper sides are.

    The difference is averaged over `EDGE`, so that the lattice does not show in it.
    """
    line = bed.line
    x = np.arange(line.x[1] - EDGE, line.x[-2] + EDGE, SPACING)
    centres, radii, there = bed.packing.centres, bed.packing.sizes / 2, worn.there
    depth = _height(centres, radii, x) - _height(worn.places[there], radii[there], x)
    window = np.ones(round(EDGE / SPACING)) * SPACING / EDGE
    depth = np.convolve(depth, window, mode="same")
    places = x[_corners(depth)]
    # corners that nearly coincide would make cells that are far too short
    far = np.abs(places[:, None] - line.x).min(axis=1) > NEAREST
    finer = line.with_corners(places[far & (places > line.x[0]) & (places < line.x[-1])].tolist())
    before, ground = np.array(finer.z), min(line.z[0], line.z[-1])
    z = before - np.interp(finer.x, x, depth, left=0.0, right=0.0)
    # a form wears down to the flat bed around it, unless counted grains lie as low as that
    low = np.maximum(line.z[1:], line.z[:-1]) <= ground + LEVEL
    if not (low & line.counted(bed.counts)).any():
        z = np.maximum(z, np.minimum(before, ground))
    inside = (np.array(finer.x) > line.x[1]) & (np.array(finer.x) < line.x[-2])
    return replace(finer, z=tuple(np.where(inside, z, before).tolist()))


def _corners(depth: FloatArray) -> BoolArray:
    """Where the depth changes, at every second diameter's half."""
    step = round(EDGE / 2 / SPACING)
    changing = np.abs(np.gradient(depth)) > 1e-3
    near = np.convolve(changing, np.ones(2 * step + 1), mode="same") > 0
    return np.asarray(near & (np.arange(len(depth)) % step == 0))


def _height(centres: FloatArray, radii: FloatArray, x: FloatArray) -> FloatArray:
    """Height of the grains' upper sides at some places, d; far below where there are none."""
    found = np.full(len(x), -FAR)
    for (xc, zc), radius in zip(centres.tolist(), radii.tolist(), strict=True):
        # as wide as half the way to the next: the gaps of a row do not count
        first, last = np.searchsorted(x, [xc - 2 * radius, xc + 2 * radius])
        found[first:last] = np.maximum(found[first:last], zc + radius)
    return found
