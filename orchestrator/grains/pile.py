"""A pile of grains and its answer."""

from collections.abc import Container, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from orchestrator.flow.stress import WallStress
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import Loads, loads_of
from orchestrator.grains.methods import METHODS, Method
from orchestrator.grains.motion import Motion
from orchestrator.grains.threshold import PileThreshold, of_grains, of_pile
from orchestrator.grains.wear import FlowRun, WornFlow
from orchestrator.runs.case import Case
from orchestrator.study.criterion import SUSTAINED
from orchestrator.types import BoolArray, FloatArray


@dataclass(frozen=True)
class Pile(Geometry):
    """The pile of a scene: its bed, the flow over it, and its threshold method.

    Attributes
    ----------
    scene
        The scene.
    cases
        The directory of the finished runs; only the grains of a poured bed, and the
        flow over a profile, are read there.
    part
        The part of the bed on which grains are packed, a range of x in diameters; by
        default all.
    """

    @cached_property
    def method(self) -> Method:
        """How its threshold is found.

        The scene's method is not left open (``auto``).
        """
        return METHODS[self.scene.method.facts](self)

    @cached_property
    def own_runs(self) -> tuple[Case, ...]:
        """The cases of this pile, those of the flow first."""
        return (*self.solved, *self.pouring, *self.method.cases)

    @cached_property
    def runs(self) -> tuple[Case, ...]:
        """The cases that its answer is read from: its own."""
        return self.own_runs

    @property
    def last_run(self) -> str | None:
        """Name of the last of its own cases; None without a run."""
        runs = self.own_runs
        if not runs:
            return None
        return runs[-1].name

    def is_run(self, done: Container[str]) -> bool:
        """Whether all of its runs are among those that are done, by name.

        Parameters
        ----------
        done
            Names of the cases that are done.

        Returns
        -------
        bool
            Whether all are.
        """
        return all(run.name in done for run in self.runs)

    @property
    def case(self) -> Case:
        """The last run of its grains, of a method that needs one."""
        return self.method.cases[-1]

    @property
    def flows(self) -> tuple[FlowRun, ...]:
        """The runs of the flow, one after another on a bed that changes."""
        worn = (run for run in self.method.cases if isinstance(run, WornFlow))
        return (*self.model.cases, *worn)

    @property
    def solves(self) -> "dict[str, Pile]":
        """The pile by the name of its flow, if one is solved for it."""
        if self.model.is_between:
            return {}
        return {run.name: self for run in self.model.cases}

    def stress(self, cases: Path) -> WallStress:
        """Read the stress along the whole bed.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        WallStress
            The stress.
        """
        return self.model.stress(cases)

    def speed(self, cases: Path) -> FloatArray:
        """Find the signed local friction velocity over u*_0 of the counted grains.

        On a bed that changes it is that of the round in which a grain moved.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        FloatArray
            The ratios, shape (N,).
        """
        if self.scene.threshold.update:
            ratio = self.method.last(cases).speed
        else:
            ratio = loads_of(self, cases).ratio
        return np.asarray(ratio[self.packing.windward])

    def first(self, motion: Motion) -> tuple[float, float]:
        """Find where a motion starts.

        Grains that lie loose, and go in still fluid, say nothing of it.

        Parameters
        ----------
        motion
            The motion of the counted grains.

        Returns
        -------
        x, ustar0 : float
            The place, m, and the undisturbed friction velocity, m/s.
        """
        flows = of_grains(motion).value
        flows = np.where(flows > 0, flows, np.nan)
        least = np.flatnonzero(flows == np.nanmin(flows, initial=np.inf))
        if not len(least):
            return np.nan, np.nan
        at = int(
            least[len(least) // 2]
        )  # of places that go at one flow the one in the middle
        x = self.packing.centres[self.packing.windward, 0]
        return float(x[at]) * self.scene.grain.diameter, float(flows[at])

    def pivot_thresholds(self, speed: FloatArray) -> FloatArray:
        """Find the friction velocities at which counted grains move by themselves.

        Parameters
        ----------
        speed
            Local friction velocity of each over the undisturbed one, shape (N,).

        Returns
        -------
        FloatArray
            Undisturbed friction velocities, m/s, sorted, shape (N,).
        """
        ratio = np.zeros(len(self.packing.sizes))
        ratio[self.packing.windward] = speed
        return np.sort(Loads(self, ratio, np.ones(len(ratio), bool)).alone())

    def motion(self, cases: Path) -> Motion:
        """Find the motion of the counted grains.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Motion
            When each of them moved.
        """
        motion = self.method.motion(cases)
        if not self.is_sustained or self.scene.is_followed:
            return motion
        return motion.until(*loads_of(self, cases).sustained())

    def correction_error(self, fraction: float, cases: Path) -> float:
        """Find the relative error of a correction of tau_c: 0 without one.

        Parameters
        ----------
        fraction
            Fraction n/N.
        cases
            The directory of the finished runs.

        Returns
        -------
        float
            The error.
        """
        del fraction, cases
        return 0.0

    @property
    def is_sustained(self) -> bool:
        """Whether its grains must go on, not only leave their pockets."""
        return self.scene.threshold.criterion == SUSTAINED

    def sustained_decides(self, cases: Path) -> BoolArray:
        """Find the counted grains that going on holds longer than their pockets.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        BoolArray
            Which they are, shape (N,).
        """
        if self.scene.is_followed:
            # both are asked at once: no grain is known to have left alone
            return np.ones(self.packing.count, bool)
        further, over = loads_of(self, cases).sustained()
        return np.asarray(self.method.motion(cases).flows / over < further)

    def thresholds(
        self, cases: Path, fractions: Iterable[float]
    ) -> list[PileThreshold]:
        """Find its thresholds at some fractions.

        Parameters
        ----------
        cases
            The directory of the finished runs.
        fractions
            Fractions n/N of the counted grains.

        Returns
        -------
        list of PileThreshold
            A threshold for each.
        """
        motion, speed = self.motion(cases), self.speed(cases)
        return [of_pile(motion, speed, n, self.scene.fluid.density) for n in fractions]
