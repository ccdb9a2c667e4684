"""An experiment: scenes in, runs, tables, one page of figures."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator import pipeline
from orchestrator.errors import OrchestratorError
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import document, settings
from orchestrator.report.document import Section
from orchestrator.report.style import Figure
from orchestrator.runs.case import programs
from orchestrator.runs.workspace import EXPERIMENT, MARKERS, Workspace, claimed
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.tables import text

Tables = Mapping[str, pd.DataFrame]


@dataclass(frozen=True)
class Runs:
    """What the runs of an experiment left.

    Attributes
    ----------
    planned : Plan
        The scenes and their runs.
    cases : Path
        Where the runs lie.
    done : mapping
        The markers of the finished runs, by name.
    failures : mapping of str to OrchestratorError
        The runs that failed.
    """

    planned: Plan
    cases: Path
    done: Mapping[str, Mapping[str, Any]]
    failures: Mapping[str, OrchestratorError]

    @property
    def cpu_s(self) -> dict[str, float]:
        """Processor seconds of the finished runs, by name."""
        return {name: state["cpu_s"] for name, state in self.done.items()}

    def are_done(self, *piles: str) -> bool:
        """Whether all runs of some piles of the plan are done, by their names."""
        return all(self.planned.piles[key].is_run(self.done) for key in piles)


def run(
    name: str,
    title: str,
    planned: Plan,
    out: Path,
    make: Callable[[Runs], tuple[Tables, Callable[[], Sequence[Section]]]],
    *,
    workers: int,
    limit_s: float,
    repeats: Callable[[Path], bool] = lambda directory: True,
) -> Finished:
    """Run what is missing of an experiment, write its tables and draw its page.

    Parameters
    ----------
    name, title : str
        Of the experiment and of its page.
    planned : Plan
        Its scenes and runs.
    out : Path
        Its directory; an experiment that is there already is continued.
    make : callable
        From the runs, the tables by name, and a function that draws the sections of the page.
    workers : int
        Cases at a time.
    limit_s : float
        Time after which a case is stopped, s.
    repeats : callable
        Whether a case that failed, by its directory, is run again.
    """
    space = Workspace(out.absolute())
    with claimed(space.root, EXPERIMENT, name) as folder:
        space.describe(EXPERIMENT, name, list(planned.cases))
        missing = planned.missing(space.cases).items()
        todo = {key: case for key, case in missing if repeats(space.cases / key)}
        failures = pipeline.complete(todo, space, workers=workers, limit_s=limit_s)
        tables, draw = make(Runs(planned, space.cases, planned.done(space.cases), failures))
        with settings.own(), folder.renewed(but=MARKERS):
            for key, table in tables.items():
                folder.put(f"tables/{key}.csv", text.csv(table))
            solvers = programs(space.cases, planned.cases)
            document.write(title, draw(), folder, space.page.name, solvers)
    return Finished(space.page, len(todo), failures)


def nothing_ran(out: Path, what: str) -> OrchestratorError:
    """The error of an experiment of which no run came to its end."""
    remedy = "`orchestrator status` names the causes; the same command continues"
    return OrchestratorError(what, where=str(out), remedy=remedy)


@cache
def texts(name: str) -> dict[str, str]:
    """The texts of the page of an experiment, by what they are about."""
    file = Path(__file__).with_name("texts.toml")
    return dict(tomllib.loads(file.read_text(encoding="utf-8"))[name])


def figure(name: str, title: str, caption: str, canvas: Any) -> Figure:
    """A figure of the page."""
    return Figure(name, title, caption, (), canvas)


def label(scene: Scene) -> str:
    """A pile in a few words."""
    bed, fluid, d = scene.bed, scene.fluid, scene.grain.diameter
    assert isinstance(bed, PileBed)
    rows = {"aligned": "rows along the slope", "horizontal": "level rows"}
    packing = rows.get(bed.packing, f"{bed.packing}, seed {bed.seed}")
    if bed.packing == "disordered":
        packing = f"gaps up to {bed.disorder:g} d, seed {bed.seed}"
    form = "level" if bed.is_level else f"{bed.slope_deg:g}°"
    if not bed.is_triangle and not bed.is_level:
        form = f"{'profile' if bed.profile else bed.shape}, {form}"
    strip = [f"strip of {bed.width:g} d"] if bed.width else []
    size = f"{1e3 * d:g} mm, ρ_f {fluid.density:g} kg/m³, ν {fluid.viscosity:g} m²/s"
    return ", ".join([form, size, scene.forces.law, packing, *strip])
