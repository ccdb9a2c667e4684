"""An experiment: scenes in, runs, tables, one page of figures."""

import tomllib
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator import pipeline
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.fidelity.decision import written
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import page, style
from orchestrator.report.page import Section
from orchestrator.runs import case
from orchestrator.runs.workspace import EXPERIMENT, Workspace, claimed, read_marker
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.source import Source
from orchestrator.study.study import TIME_LIMIT_S, Study
from orchestrator.tables import csv

Results = tuple[Mapping[str, pd.DataFrame], Sequence[Section]]
TEXTS = tomllib.loads(
    Path(__file__).with_name("texts.toml").read_text(encoding="utf-8")
)
"""The texts of the pages, by experiment and by what they are about."""


@dataclass(frozen=True)
class Runs:
    """Plan and directory of the runs, and the markers of those that are done, by name."""

    planned: Plan
    cases: Path
    done: Mapping[str, Mapping[str, Any]]

    def are_done(self, *piles: str) -> bool:
        """Whether all runs of some piles of the plan are done, by their names."""
        return all(self.planned.piles[key].is_run(self.done) for key in piles)

    def cpu_s(self, runs: Sequence[case.Case]) -> float:
        """Processor seconds of some runs; NaN if one is not done."""
        return sum(
            float(self.done.get(run.name, {}).get("cpu_s", "nan")) for run in runs
        )


@dataclass(frozen=True)
class Experiment:
    """What an experiment runs and makes: its name and title, its scenes and runs, its page.

    `results` gives the tables by name and the sections of the page; no table where too little is
    known. A run may take `limit_s`, s. A failed run that ends by one of the `verdicts` is not run
    again: its failure is the answer. Failures of the runs named in `failing` count (None: of all).
    """

    name: str
    title: str
    planned: Plan
    results: Callable[[Runs], Results]
    limit_s: float = TIME_LIMIT_S
    verdicts: Container[str] = ()
    failing: Container[str] | None = None
    source: Source | None = None
    """The study file that it is on; None for scenes of its own."""

    def run(self, out: Path, *, workers: int) -> Finished:
        """Run what is missing, write tables and page; an `OrchestratorError` if too little ran."""
        space, planned = Workspace(out.absolute()), self.planned
        with claimed(space.root, EXPERIMENT, self.name) as folder:
            self._describe(space)
            missing = planned.missing(space.cases, planned.done(space.cases)).items()
            ends = {name: case.failure(space.cases / name)[0] for name, _ in missing}
            todo = {
                name: run for name, run in missing if ends[name] not in self.verdicts
            }
            failures = pipeline.complete(
                todo, space, workers=workers, limit_s=self.limit_s
            )
            with style.settings():
                done = planned.done(space.cases)
                tables, sections = self.results(Runs(planned, space.cases, done))
                if not tables:
                    what = "no reference ran to its end: `orchestrator status` names the causes"
                    raise OrchestratorError(what, str(out))
                with folder.renewed():
                    for key, table in tables.items():
                        folder.put(f"tables/{key}.csv", csv(table))
                    solvers = case.programs(space.cases, planned.cases)
                    page.write(self.title, sections, folder, space.page.name, solvers)
        if self.failing is not None:
            failures = {
                name: error for name, error in failures.items() if name in self.failing
            }
        answer = "\n".join(
            p.text.replace("\n\n", "\n") for p in sections if not p.title
        )
        return Finished(space.page, len(todo), failures, answer)

    def _describe(self, space: Workspace) -> None:
        """Write into the directory what it is of; an InputError if it is of another file.

        All experiments of a name have one directory by default, whatever file they are on.
        """
        source = self.source.described(space.root) if self.source else {}
        before = read_marker(space.root, EXPERIMENT).get("source")
        other = str(before.get("file", "")) if isinstance(before, dict) else ""
        is_other = other not in ("", source.get("file", ""))
        if is_other and (space.root / other).is_file():
            what = f"the directory holds the {self.name} of another file, {other}"
            raise InputError(what, str(space.root), "choose another with --out")
        space.describe(EXPERIMENT, self.name, list(self.planned.cases), source=source)


def piles(study: Study) -> dict[Scene, PileBed]:
    """The piles of a study as they are written, with their beds and with the method that answers.

    Raises
    ------
    InputError
        If the study has no pile.
    """
    chosen = {}
    for scene in study.scenes:
        if isinstance(scene.bed, PileBed):
            chosen[written(scene)] = scene.bed
    if not chosen:
        remedy = 'give a group `bed.kind = "pile"`'
        raise InputError("there is no pile", where=study.name, remedy=remedy)
    return chosen


def label(scene: Scene) -> str:
    """A pile in a few words."""
    bed, fluid, d = scene.bed, scene.fluid, scene.grain.diameter
    assert isinstance(bed, PileBed)
    rows = {"aligned": "rows along the slope", "horizontal": "level rows"}
    gaps = f"gaps up to {bed.disorder:g} d" if bed.packing == "disordered" else "poured"
    packing = rows.get(bed.packing, f"{gaps}, seed {bed.seed}")
    form = "level" if bed.is_level else f"{bed.slope_deg:g}°"
    if not bed.is_triangle and not bed.is_level:
        form = f"{'profile' if bed.profile else bed.shape}, {form}"
    strip = f", strip of {bed.width:g} d" if bed.width else ""
    size = f"{1e3 * d:g} mm, ρ_f {fluid.density:g} kg/m³, ν {fluid.viscosity:g} m²/s"
    return f"{form}, {size}, {scene.forces.law}, {packing}{strip}"
