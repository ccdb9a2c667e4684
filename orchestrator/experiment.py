"""An experiment: scenes in, runs, tables, one page of figures."""

import sys
import tomllib
from abc import ABC, abstractmethod
from argparse import Namespace
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator import pipeline, plan
from orchestrator.digits import number, plain_number
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.fidelity.decision import with_criterion, written
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import page, style
from orchestrator.report.page import Paragraphs, Section
from orchestrator.report.remarks import NOT_AS_PLANNED
from orchestrator.runs import case, reuse, terminal, workspace
from orchestrator.runs.engine import Display
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import EXPERIMENT, Workspace, claimed
from orchestrator.study.parts import PileBed
from orchestrator.study.reading import TIME_LIMIT_S
from orchestrator.study.scene import Scene
from orchestrator.study.source import Source
from orchestrator.study.study import Study
from orchestrator.tables import csv


def page_texts(module: str, about: str) -> Mapping[str, str]:
    """Read what a page says around its figures and tables.

    Parameters
    ----------
    module
        File of the module that asks; ``texts.toml`` lies beside it.
    about
        Table of that file.

    Returns
    -------
    Mapping of str to str
        The texts by their names.
    """
    text = Path(module).with_name("texts.toml").read_text(encoding="utf-8")
    found: Mapping[str, str] = tomllib.loads(text)[about]
    return found


@dataclass(frozen=True)
class Runs:
    """The runs of an experiment.

    Attributes
    ----------
    planned
        Their plan.
    cases
        Their directory.
    done
        The markers of those that are done, by name.
    """

    planned: Plan
    cases: Path
    done: Mapping[str, Mapping[str, Any]]

    def are_done(self, *piles: str) -> bool:
        """Whether all runs of some piles are done.

        Parameters
        ----------
        *piles
            Names of the piles in the plan.

        Returns
        -------
        bool
            Whether all are.
        """
        return all(self.planned.piles[key].is_run(self.done) for key in piles)

    def cpu_s(self, runs: Sequence[case.Case]) -> float:
        """Add the processor time of some runs.

        Parameters
        ----------
        runs
            The runs.

        Returns
        -------
        float
            The time, s; NaN if one is not done.
        """
        times = [self.done.get(run.name, {}).get("cpu_s", "nan") for run in runs]
        return sum(map(float, times))


@dataclass(frozen=True)
class ExperimentResults:
    """What an experiment makes of its runs.

    Attributes
    ----------
    tables
        Its tables, by name.
    page
        The sections of its page.
    files
        Contents of other files, by path in its directory.
    """

    tables: Mapping[str, pd.DataFrame]
    page: Sequence[Section]
    files: Mapping[str, bytes] = field(default_factory=dict)


class Experiment(ABC):
    """Scenes in, runs, tables, one page: a subclass plans the runs and reads them.

    Parameters
    ----------
    planned
        Its scenes and runs.
    study
        The study that it is on; None for scenes of its own.

    Attributes
    ----------
    name, title
        Its name and its title.
    limit_s
        Time that a run may take, s.
    verdicts
        A failed run that ends by one of them is not run again: its failure is the
        answer.
    failing
        Names of the runs whose failures count; None for all.
    source
        The study file that it is on; None for scenes of its own.
    shares_cases
        Whether cases that are done in another directory of results are taken from
        there: the experiment asks for runs that others ask for, too.
    """

    name: str
    title: str
    limit_s: float = TIME_LIMIT_S
    verdicts: Container[str] = ()
    failing: Container[str] | None = None
    source: Source | None = None
    shares_cases: bool = False

    def __init__(self, planned: Plan, study: Study[Any] | None = None) -> None:
        self.planned = planned
        if study is not None:
            self.limit_s = study.time_limit_s
            self.source = study.source

    @property
    def outline(self) -> Sequence[str]:
        """What `--plan` says of it before its cases: mostly nothing."""
        return ()

    @abstractmethod
    def results(self, runs: Runs) -> ExperimentResults | None:
        """Make tables and page of the runs that are done.

        Returns
        -------
        Results or None
            Tables and page; None where too few runs are done to say anything.
        """

    def check(self, out: Path) -> None:
        """Refuse a directory that holds something else, as `run` does.

        Parameters
        ----------
        out
            The directory, in which nothing is written.

        Raises
        ------
        InputError
            If it holds something else, or this experiment on another file.
        """
        space = Workspace(out.absolute())
        space.check(EXPERIMENT, self.name, self._source_of(space))

    def _source_of(self, space: Workspace) -> Mapping[str, object]:
        """The study file of the experiment as a directory notes it."""
        return self.source.described(space.root) if self.source else {}

    def run(self, out: Path, *, workers: int, beside: Sequence[Path] = ()) -> Finished:
        """Run what is missing, and write tables and page.

        Parameters
        ----------
        out
            The directory.
        workers
            Number of cases at a time.
        beside
            Other directories of results, from which finished cases are taken.

        Returns
        -------
        Finished
            What came out.

        Raises
        ------
        OrchestratorError
            If too little ran.
        """
        space = Workspace(out.absolute())
        with claimed(space.root, EXPERIMENT, self.name) as folder:
            # all experiments of a name have one directory by default
            source = self._source_of(space)
            space.describe(EXPERIMENT, self.name, self.planned.cases, source)
            taken = reuse.taken(self.planned.cases, space.cases, beside)
            if taken:
                what = f"{number(taken, 'case')} of other results taken"
                print(f"{what}; no solver was started for them", file=sys.stderr)
            todo = self._todo(space.cases)
            after_s = self.planned.drawing_s
            shown = Display(space.cases, workers, after_s, self.failing)
            with shown as display:
                failed = pipeline.complete(todo, space, display, limit_s=self.limit_s)
                display.drawing(0.0, "tables and page")
                sections = self._write(folder, space, failed)
                display.end()
        failures = {}
        for name, error in failed.items():
            if self.failing is None or name in self.failing:
                failures[name] = error
        sought = len(failed) - len(failures)
        if sought:
            what = f"{number(sought, 'case')} failed, which is an answer here"
            where = f"`orchestrator status {out}` names each with its cause"
            print(f"{what}; {where}", file=sys.stderr)
        said = "\n".join(section.told for section in sections)
        return Finished(space.page, len(todo), failures, said.rstrip())

    def command(self, options: Namespace, out: Path) -> int:
        """Run as a command, or say what would run.

        Parameters
        ----------
        options
            The options of the command, those of `command.add_run_options` among them.
        out
            The directory of the results.

        Returns
        -------
        int
            The exit code.
        """
        beside = (
            workspace.other_results(out, Path("results")) if self.shares_cases else ()
        )
        if options.plan:
            self.check(out)
            cases = out.absolute() / "cases"
            listed = plan.expected(self.planned, cases, options.workers, beside)
            print(terminal.fitted([*self.outline, *listed]))
            return 0
        return self.run(out, workers=options.workers, beside=beside).tell()

    def _todo(self, cases: Path) -> dict[str, case.Case]:
        """The runs that are missing, but for those that have ended by a verdict."""
        todo = {}
        done = reuse.done(self.planned.cases, cases)
        missing = self.planned.missing(cases, done)
        for name, run in missing.items():
            ended, _ = case.failure(cases / name)
            if ended not in self.verdicts:
                todo[name] = run
        return todo

    def _write(
        self, folder: Folder, space: Workspace, failed: pipeline.Failures
    ) -> Sequence[Section]:
        """Write tables and page, and give the sections of the page.

        Without any table the first failure says why there is none.
        """
        cases = space.cases
        with style.settings(style.LETTERS):
            done = reuse.done(self.planned.cases, cases)
            runs = Runs(self.planned, cases, done)
            made = self.results(runs)
            if made is None and failed:
                raise next(iter(failed.values()))
            if made is None:
                what = "none of its cases has run to its end"
                remedy = "`orchestrator status` names the causes"
                raise OrchestratorError(what, str(space.root), remedy)
            with folder.renewed():
                for key, table in made.tables.items():
                    folder.put(f"tables/{key}.csv", csv(table))
                for path, content in made.files.items():
                    folder.put(path, content)
                solvers = case.programs(cases, self.planned.cases)
                name = space.page.name
                sections = _with_caveats(made.page, runs)
                wall_s = sum(float(state["wall_s"]) for state in done.values())
                page.write_experiment(
                    self.title, sections, folder, name, solvers, wall_s
                )
        return sections


def _with_caveats(sections: Sequence[Section], runs: Runs) -> Sequence[Section]:
    """Put what runs say of themselves behind the answer."""
    told = []
    for name in runs.done:
        said = case.said_of(runs.cases / name)
        if said:
            told.append(f"{NOT_AS_PLANNED} {name}: {said}.")
    if not told:
        return sections
    answer, *others = sections
    return [answer, Section("", [Paragraphs("\n\n".join(told))]), *others]


def piles(study: Study) -> dict[Scene, PileBed]:
    """Find the piles of a study.

    Returns
    -------
    dict of Scene to PileBed
        The scenes as they are written, with the method that answers and the criterion
        by which a study answers them, and their beds.

    Raises
    ------
    InputError
        If the study has no pile.
    """
    chosen = {}
    for scene in study.scenes:
        if isinstance(scene.bed, PileBed):
            chosen[written(with_criterion(scene))] = scene.bed
    if not chosen:
        remedy = 'give a group `bed.kind = "pile"`'
        raise InputError("there is no pile", where=study.name, remedy=remedy)
    return chosen


def label(scene: Scene) -> str:
    """Describe a pile in a few words.

    Parameters
    ----------
    scene
        The scene of the pile.

    Returns
    -------
    str
        Its form, grains, fluid, force law and packing.
    """
    bed = scene.bed
    fluid = scene.fluid
    assert isinstance(bed, PileBed)
    size = f"{1e3 * scene.grain.diameter:g} mm"
    words = [
        *_form(bed),
        f"{size}, ρ_f = {plain_number(fluid.density)} kg/m³, "
        f"ν = {plain_number(fluid.viscosity)} m²/s",
        scene.forces.law,
        _packing(bed),
    ]
    if bed.width:
        words.append(f"strip of {bed.width:g} d")
    return ", ".join(words)


def _form(bed: PileBed) -> list[str]:
    """The form of a bed in words."""
    if bed.is_level:
        return ["level"]
    slope = f"{bed.slope_deg:g}°"
    if bed.is_triangle:
        return [slope]
    return [bed.shape_name, slope]


def _packing(bed: PileBed) -> str:
    """The packing of a bed in words."""
    if bed.packing == "aligned":
        return "rows along the slope"
    if bed.packing == "horizontal":
        return "horizontal rows"
    if bed.packing == "disordered":
        return f"gaps up to {bed.disorder:g} d, seed {bed.seed}"
    return f"poured, seed {bed.seed}"
