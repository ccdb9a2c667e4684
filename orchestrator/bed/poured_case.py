"""The run of LIGGGHTS that pours a bed; all scenes with this bed share it."""

from dataclasses import dataclass
from functools import cached_property
from io import StringIO
from math import radians, tan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine
from orchestrator.bed.pouring import Mould, rows_of
from orchestrator.errors import InputError, Noisy, SolverError
from orchestrator.runs.case import Case
from orchestrator.solvers import liggghts
from orchestrator.study.sizes import Sizes, drawn

FloatArray = NDArray[np.float64]

DIAMETER, DENSITY, GRAVITY = 1e-3, 2500.0, 9.81
"""The reference grain of the deck, SI: in units of d, W and sqrt(d/g) a bed has no scale."""
CONTACT = {"damping": 0.1, "time_step": 0.2}
"""With more damping, or a longer step, equal spheres jitter: they settle into crystals."""
STIFFNESS, DRAG, CALM = (1e3, 1e4, 1e4), (0.0, 5.0, 1.0), (1e-2, 1e-4, 1e-6)
"""Stiffness K d/W of each stage, its drag over m sqrt(g/d), and the kinetic energy of a grain, over
W d, at which it ends. The grains fall on soft springs. Then a drag takes the energy of waves that
run up and down the bed, which contacts alone take off slowly. When the bed is cut, a small drag is
enough and lets grains roll into their pockets. The last energy is 1e-2 W^2/K, which is rest to
other decks too: in a long bed there is always a grain that still rolls somewhere."""
MOST_LOOKS = 400
"""Time that the grains have in a stage, sqrt(d/g')."""
SETTLING = "settling.csv"
DUMP = "poured.dump"
BED = "bed.csv"
LEAST_LENGTH = 5.0
"""Least length of the forms of a poured bed, d."""
MOST_GRAINS = 100_000
"""Most grains of a poured bed: some hundred megabytes, and half an hour of one core."""


@dataclass(frozen=True)
class PouredBed(Case):
    """A bed that LIGGGHTS pours into a mould of a bed line; lengths in d.

    Attributes
    ----------
    line : BedLine
        Bed line of the flow.
    depth, surface : float
        As `Mould` takes them.
    sizes : LogNormal, sequence of classes, or None
        Sizes of the grains; None for equal ones.
    diameter : float
        The d of a sieve table, m; 1 otherwise, for such a bed has no scale.
    friction_angle_deg : float
        Friction angle of the grains.
    seed : int
        Which of the many.
    width : float
        Width of a strip with periodic sides; 0 of a bed in one plane.
    """

    line: BedLine
    depth: float
    surface: float
    sizes: Sizes | None
    diameter: float
    friction_angle_deg: float
    seed: int
    width: float = 0.0

    kind: ClassVar[str] = "poured"
    template: ClassVar[str] = "liggghts/poured"
    recipe: ClassVar[int] = 3
    results: ClassVar[tuple[str, ...]] = (SETTLING, DUMP)
    derived: ClassVar[tuple[str, ...]] = (BED,)
    made: ClassVar[tuple[str, ...]] = ("log.liggghts",)

    @property
    def parameters(self) -> dict[str, Any]:
        """The bed line, what is poured, and the seed."""
        mixture = self.sizes
        return {
            "x": list(self.line.x),
            "z": list(self.line.z),
            "depth": self.depth,
            "surface": self.surface,
            "sizes": mixture if mixture is None or isinstance(mixture, tuple) else str(mixture),
            "diameter": self.diameter,
            "friction_angle_deg": self.friction_angle_deg,
            "seed": self.seed,
            "width": self.width,
        }

    @cached_property
    def mould(self) -> Mould:
        """Mould that the grains rain into."""
        return Mould(self.line, self.depth, self.surface, self.width)

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s: 15,000 steps at 6e6 grain-steps a second."""
        return 1 + self._count * 15_000 / 6e6

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with."""
        return liggghts.ranks(self._count)

    def check_size(self) -> None:
        """See that the mould has room for a bed, and takes no more grains than a machine bears.

        Raises
        ------
        InputError
            With the field of a study file.
        """
        length = self.line.x[-2] - self.line.x[1]
        if length < LEAST_LENGTH:
            raise InputError(
                f"a poured bed of {length:.3g} grains: fewer than {LEAST_LENGTH:g} in a row have no"
                " pockets that are those of a bed",
                where="bed.length",
                remedy=f"at least {LEAST_LENGTH:g} diameters",
            )
        count = self._count
        if count > MOST_GRAINS:
            raise InputError(
                f"about {count:.2g} grains would be poured, more than {MOST_GRAINS:g}",
                where="bed.packing",
                remedy="a shorter bed, larger grains, or less of bed.poured_depth or bed.width",
            )

    @cached_property
    def _count(self) -> int:
        """How many grains rain into the mould."""
        sizes = drawn(self.sizes, self.diameter, 1000, 0)
        # mean area of the grains' discs, d2; in a strip mean volume, d3
        mean = np.pi * np.mean(sizes**3 / 6 if self.width else sizes**2 / 4)
        return self.mould.count(float(mean))

    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""
        return liggghts.programs(self.ranks)

    @cached_property
    def _grains(self) -> tuple[FloatArray, FloatArray]:
        """Centres of all grains, the fixed first, and their diameters, d."""
        count, floor = self._count, self.mould.floor
        mixed = drawn(self.sizes, self.diameter, count, self.seed)
        places = self.mould.rain(mixed, self.seed)
        return np.vstack([floor, places]), np.concatenate([np.ones(len(floor)), mixed])

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains in the air, the walls and the cut."""
        start, end = self.mould.ends
        _, sizes = self._grains
        numbers = {
            "diameter": DIAMETER,
            "smallest": float(sizes.min()),
            "density": DENSITY,
            "gravity": GRAVITY,
            "friction": tan(radians(self.friction_angle_deg)),
            **CONTACT,
            "upstream": start * DIAMETER,
            "downstream": end * DIAMETER,
            "most_looks": MOST_LOOKS,
            "width": self.width,
            "ranks": self.ranks,
        }
        lines = [
            f"variable        {name} equal {value!r}  # {MEANING[name]}\n"
            for name, value in numbers.items()
        ]
        stages = {"stiffness": STIFFNESS, "drag": DRAG, "calm": CALM}
        lines += [
            f"variable        {name} index {' '.join(map(repr, values))}  # {MEANING[name]}\n"
            for name, values in stages.items()
        ]
        (directory / "parameters.liggghts").write_text("".join(lines))
        scale = np.array([DIAMETER, DIAMETER, DIAMETER, 1.0])
        for name, values in rows_of(self.mould.segments * scale):
            (directory / f"cut.{name}.txt").write_text("".join(f"{v!r}\n" for v in values))
        (directory / "grains.data").write_text(self._data_file())

    def _data_file(self) -> str:
        centres, sizes = self._grains
        margin = float(sizes.max()) + 1
        low, high = (centres.min(axis=0) - margin).tolist(), (centres.max(axis=0) + margin).tolist()
        if self.width:
            low[1], high[1] = 0.0, self.width
        bounds = "".join(
            f"{a * DIAMETER!r} {b * DIAMETER!r} {axis}lo {axis}hi\n"
            for a, b, axis in zip(low, high, "xyz", strict=True)
        )
        kinds = np.where(np.arange(len(centres)) < len(self.mould.floor), 1, 2).tolist()
        columns = (kinds, (sizes * DIAMETER).tolist(), (centres * DIAMETER).tolist())
        grains = list(zip(*columns, strict=True))
        # neighbours along the bed are near in memory: a fifth less time for 20,000 grains
        rows = "".join(
            f"{number + 1} {kind} {size!r} {DENSITY!r} {x!r} {y!r} {z!r}\n"
            for number in np.argsort(centres[:, 0], kind="stable").tolist()
            for kind, size, (x, y, z) in (grains[number],)
        )
        head = f"grains: id type diameter density x y z\n\n{len(kinds)} atoms\n4 atom types\n\n"
        return f"{head}{bounds}\nAtoms\n\n{rows}"

    def collect(self, directory: Path) -> None:
        """See that the bed came to rest, and write its grains to ``bed.csv``."""
        liggghts.check_log(directory)
        self._check_rest(directory)
        text = (directory / DUMP).read_text().partition("ITEM: ATOMS id x y z \n")[2]
        rows = pd.read_csv(StringIO(text), sep=r"\s+", names=["id", "x", "y", "z"], header=None)
        if rows.empty or rows.isna().any(axis=None):
            raise SolverError(
                "it holds no grains", where=str(directory / DUMP), remedy="run the case again"
            )
        _, sizes = self._grains
        number = rows["id"].to_numpy(np.int64) - 1
        bed = pd.DataFrame(
            {
                "x_over_d": rows["x"] / DIAMETER,
                "y_over_d": rows["y"] / DIAMETER,
                "z_over_d": rows["z"] / DIAMETER,
                "size": sizes[number],
                "fixed": (number < len(self.mould.floor)).astype(int),
            }
        )
        bed.to_csv(directory / BED, index=False)

    def _check_rest(self, directory: Path) -> None:
        """Each stage ended as calm as it should, and left grains."""
        path = directory / SETTLING
        try:
            settling = pd.read_csv(path).astype({"ke": float})
            last = settling.groupby("stage").last()
            energy = last["ke"] / last["grains"].clip(lower=1) / (WEIGHT * DIAMETER)
        except (OSError, ValueError, KeyError) as error:
            what = f"the table of the settling cannot be read: {error}"
            raise SolverError(what, where=str(path), remedy="run the case again") from None
        if len(last) < len(CALM) or not (last["grains"] > 0).all():
            what = "no grain of the poured bed is left"
            remedy = "a gentler slope, or more of bed.poured_depth"
            raise SolverError(what, where=str(path), remedy=remedy)
        if not np.all(energy.to_numpy() < CALM):
            what = f"the poured bed does not come to rest: {energy.iloc[-1]:.2g} W d a grain"
            remedy = "a gentler slope, or a larger grain.friction_angle_deg"
            raise Noisy(what, where=str(path), remedy=remedy)


WEIGHT = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
MEANING = {
    "diameter": "d of the units below, m",
    "smallest": "diameter of the smallest grain, d",
    "density": "kg/m3",
    "gravity": "m/s2",
    "friction": "tan(phi)",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "upstream": "place along x of the wall before the bed, m",
    "downstream": "of the wall behind it, m",
    "most_looks": "how long a stage may take, sqrt(d/g)",
    "stiffness": "of each stage: K d/W, normal and tangential",
    "drag": "of each stage: of the still fluid, m sqrt(g/d)",
    "calm": "of each stage: kinetic energy of a grain with which it ends, W d",
    "width": "of a strip with periodic sides, d; 0: all grains in one plane",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""
