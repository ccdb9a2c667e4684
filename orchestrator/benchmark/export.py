"""Scenes of a pack from a study, and our own answer to each scene of a pack, run anew."""

import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator import pipeline, plan, tables
from orchestrator.benchmark import exact, measured, pack
from orchestrator.benchmark.pack import KINDS, STUDY, Pack, Problem
from orchestrator.errors import InputError, SolverError
from orchestrator.plan import Plan
from orchestrator.runs import case, engine, process
from orchestrator.runs.case import Case
from orchestrator.runs.workspace import Workspace
from orchestrator.solvers import liggghts
from orchestrator.study import fields, study
from orchestrator.study.study import Group, Study
from orchestrator.tables import Tables

LEVELS = (1, 2, 3, 4, 5)
FORMULAS = (1, 2)
"""Levels that need no finished study."""
DEFAULT = "first-look"
"""The study whose single grains are exported if none is named."""
LIMIT_S = 3600.0
"""Time limit of our own runs, s."""
CHECKS = ("collision", "incline", "sliding", "passing")
"""Kinds that have a deck of their own: they need no scene of the study."""
PRINTED = {
    "restitution": ("restitution", ""),
    "acceleration over g": ("acceleration_over_g", ""),
    "speed at half the time": ("speed_over_start", "0.5"),
    "speed when it rolls": ("speed_over_start", "2"),
    "spin when it rolls": ("spin_over_start", "2"),
    "time of passing": ("passing_time_over_t", ""),
}
"""What the check decks print, and the quantities of a pack."""
NAMED: dict[str, Callable[[Any], str]] = {
    "alpha_deg": "{:g}deg".format,
    "beta_deg": "beta{:g}".format,
    "h_m": lambda h: f"h{1e3 * h:g}mm",
    "d_m": lambda d: f"d{1e3 * d:g}mm",
    "z0_over_d": "z{:.3g}d".format,
    "nu_m2_s": "nu{:g}".format,
    **dict.fromkeys(("packing", "force_law", "stress"), str),
    "seed": "seed{:g}".format,
}
"""Columns that name a scene where they differ between the scenes of a study."""


def export(root: Path, source: Path | None, levels: Sequence[int]) -> int:
    """Write a pack, and return how many scenes it has.

    Parameters
    ----------
    root : Path
        Its directory.
    source : Path or None
        Directory of a finished study. Without one the answers are formulas: levels 1 and 2.
    levels : sequence of int
        The levels; empty for all that the source has.

    Raises
    ------
    InputError
        If a level needs a study, or the study is not finished, not answered as it asks, or asks for
        beds that change or lie in space.
    """
    if source is None:
        lacking = sorted(set(levels) - set(FORMULAS))
        if lacking:
            raise InputError(
                f"level {lacking[0]} needs the answers of a finished study",
                where="--level",
                remedy="name its directory with --from",
            )
        asked = study.load(DEFAULT)
        chosen = levels or FORMULAS
        programs = {"liggghts": liggghts.version()} if 2 in chosen and _has_decks() else {}
        kinds = [kind for kind, one in KINDS.items() if one.level in chosen]
        made = (one for one, _ in problems(asked, plan.make(asked), {}, Path(), kinds))
        return pack.write(root, made, (asked.name, asked.text), programs)
    space = Workspace(source.absolute())
    asked, planned = pipeline.reopen(space)
    _check(asked, planned, source)
    if not space.drawn.is_file():
        raise InputError("the study is not finished", where=str(source), remedy="run it to its end")
    times = tables.read(space, "timings")["timings"].set_index("case")["solver_s"]
    if set(times.index) != set(planned.cases):
        raise InputError(
            "the study was run by another version of the program: its cases are others",
            where=str(source),
            remedy="run it again",
        )
    kinds = [kind for kind, one in KINDS.items() if one.level in (levels or LEVELS)]
    results = tables.read(space, "tables")
    sharing = {one.name: len(one.scenes) for one in planned.cells}

    def timed() -> Iterator[Problem]:
        for one, runs in problems(asked, planned, results, space.cases, kinds):
            seconds = sum(times[run] / sharing.get(run, 1) for run in runs)
            yield replace(one, seconds=seconds if runs else one.seconds)

    programs = case.programs(space.cases, planned.cases)
    return pack.write(root, timed(), (asked.name, asked.text), programs)


def _check(asked: Study, planned: Plan, source: Path) -> None:
    """See that a study is one whose scenes a pack can hold."""
    tolerance = not all(one.is_as_asked for one in planned.decisions.values())
    changing = any(scene.protocol.update for scene in asked.scenes)
    in_space = any(pile.bed.width for pile in planned.piles.values())
    for is_so, what in (
        (tolerance, f"tolerance of {asked.tolerance}: a pack has the answers as the scenes ask"),
        (changing, "protocol.update: a pack holds one flow over each bed"),
        (in_space, "bed.width: a pack holds grains in the plane of the flow"),
    ):
        if is_so:
            remedy = "run the study without it into another directory"
            raise InputError(what, where=str(source), remedy=remedy)


def problems(
    asked: Study, planned: Plan, results: Tables, cases: Path, kinds: Collection[str]
) -> Iterator[tuple[Problem, tuple[str, ...]]]:
    """The scenes of a study as problems of some kinds, each with the runs that answer it.

    Parameters
    ----------
    asked : Study
        The study.
    planned : Plan
        Its plan.
    results : dict of str to DataFrame
        Its tables; for formulas alone it may be empty.
    cases : Path
        Directory of its cases.
    kinds : collection of str
        Names of `KINDS`.
    """
    names = scene_names(planned, asked)
    if "collision" in kinds:
        for one in exact.checks():
            yield _with_ours(one), ()
    cell_of = {scene.id: cell.name for cell in planned.cells for scene in cell.scenes}
    grains = [scene for scene in asked.scenes if scene.id not in planned.piles]
    thresholds = results.get("single_grain")
    ours = {} if thresholds is None else dict(thresholds.set_index("scene_id")["ustar_m_s"])

    def unnamed() -> Iterator[tuple[Problem, tuple[str, ...]]]:
        for scene in grains:
            if "closed-form" in kinds:
                yield exact.closed_form(scene), ()
            if "pivot" in kinds and exact.has_pivot(scene):
                runs = (cell_of[scene.id],) if scene.id in ours else ()
                yield exact.pivot(scene, ours.get(scene.id, np.nan)), runs
        # neither a theory's stress nor a channel's is a question at levels 3 and 5
        solved = [p for p in planned.piles.values() if p.model.cases and not p.scene.flow.depth]
        if "flow" in kinds:
            for pile in {pile.flow.name: pile for pile in solved}.values():
                yield measured.flow(pile, results), (pile.flow.name,)
        if not {"pile", "line"} & {*kinds}:
            return
        for bed in measured.beds(planned.piles.values(), results, cases):
            if "pile" in kinds:
                yield measured.pile(bed), (bed.pile.case.name,)
            # grains on other beds are given at level 4 alone, one by one
            if "line" in kinds and bed.pile in solved and bed.pile.bed.is_triangle:
                yield measured.line(bed), (bed.pile.flow.name, bed.pile.case.name)

    for one, runs in unnamed():
        yield replace(one, name=names[one.name]), runs


def scene_names(planned: Plan, asked: Study) -> dict[str, str]:
    """A name for each scene and each flow of a study, by its digest: the numbers that differ."""
    flows = {run.id[:12]: p.scene for p in planned.piles.values() for run in p.model.cases}
    grains = {one.id: one for one in asked.scenes if one.id not in planned.piles}
    piles = {name: pile.scene for name, pile in planned.piles.items()}
    of_flow = {"alpha_deg", "h_m", "z0_over_d", "nu_m2_s"}
    names: dict[str, str] = {}
    for kind, scenes in (("grain", grains), ("pile", piles), ("flow", flows)):
        values = pd.DataFrame([fields.used(scene) for scene in scenes.values()], index=[*scenes])
        columns = [name for name in NAMED if name in values and values[name].nunique() > 1]
        if kind == "flow":
            columns = [name for name in columns if name in of_flow]
        counts: Counter[str] = Counter()
        for digest, row in values.iterrows():
            words = [NAMED[column](row[column]) for column in columns if pd.notna(row[column])]
            name = re.sub("[^a-z0-9.+]+", "-", "-".join([kind, *words]).lower())
            counts[name] += 1
            names[str(digest)] = name if counts[name] == 1 else f"{name}-{counts[name]}"
    return names


def _has_decks() -> bool:
    return shutil.which(liggghts.PROGRAM) is not None


def _with_ours(one: Problem) -> Problem:
    """A check of the contact law with the answer of our deck, if LIGGGHTS is installed."""
    if not _has_decks():
        return one
    with tempfile.TemporaryDirectory() as folder:
        answer, took = run_check(one.kind, one.parameters, Path(folder) / "deck")
    keys = ["quantity", "at"]
    ours = one.expected[keys].merge(answer, on=keys, how="left")["value"]
    return replace(one, expected=one.expected.assign(ours=ours), seconds=took.seconds)


class Took(NamedTuple):
    """Wall time and processor time of runs, s; NaN for formulas."""

    seconds: float = np.nan
    cpu_s: float = np.nan


class Ours:
    """The solvers of this package on the scenes of a pack.

    Parameters
    ----------
    chosen : Pack
        The pack.
    root : Path
        Directory of the cases.
    """

    def __init__(self, chosen: Pack, root: Path) -> None:
        text = (chosen.root / STUDY).read_text(encoding="utf-8")
        self.pack, self.root = chosen, root
        self.study = study.parse(text, name="benchmark", where=str(chosen.root / STUDY))
        planned = plan.make(self.study)
        names = scene_names(planned, self.study)
        scenes = {names[one.id]: one for one in self.study.scenes}
        piles = planned.piles.values()
        flows = {names[run.id[:12]]: p.scene for p in piles for run in p.model.cases}
        self.scenes = scenes | flows
        self.times: dict[str, Took] = {}

    def answer(self, name: str) -> tuple[pd.DataFrame, Took]:
        """Answer a scene: columns ``quantity``, ``at`` and ``value``, and its time.

        Raises
        ------
        SolverError
            If a solver failed.
        """
        kind = self.pack.scenes[name]["kind"]
        if kind in CHECKS:
            return run_check(kind, self.pack.scenes[name], self.root / "checks")
        group = Group("benchmark", (self.scenes[self._key(name)],), str(self.pack.root / STUDY))
        asked = replace(self.study, groups=(group,))
        planned = plan.make(asked, cases=self.root)
        # several scenes share a flow or a poured bed, which is run once
        shared = [r for p in planned.piles.values() for r in (*p.model.cases, *p.pouring)]
        needed = {"closed-form": [], "flow": shared}.get(kind, [*planned.cases.values()])
        for run in needed:
            if run not in shared or run.name not in self.times:
                self._run(run)
        done = {run.name for run in needed}
        results = tables.make(asked, planned, self.root, done) if needed else {}
        ((problem, runs),) = problems(asked, planned, results, self.root, [kind])
        answer = problem.expected[["quantity", "at", "ours"]].rename(columns={"ours": "value"})
        if kind == "pile":
            steps = pd.read_csv(self.root / runs[0] / "samples.csv")["step"].iloc[-1]
            row = {"quantity": ["steps"], "at": [""], "value": [float(steps)]}
            answer = pd.concat([answer, pd.DataFrame(row)], ignore_index=True)
        took = [self.times[run] for run in runs] or [Took()]
        return answer, Took(sum(t.seconds for t in took), sum(t.cpu_s for t in took))

    def check(self, name: str) -> None:
        """See that a scene can be answered.

        Raises
        ------
        InputError
            If the pack's study has no such scene: the pack is of another version of the program.
        """
        if self.pack.scenes[name]["kind"] not in CHECKS and self._key(name) not in self.scenes:
            raise InputError(
                f"no scene of its study is {name}: it is of another version of the program",
                where=str(self.pack.root),
                remedy="export it again",
            )

    def _key(self, name: str) -> str:
        return name.partition("-")[2]

    def _run(self, run: Case) -> None:
        engine.execute(run, self.root, LIMIT_S)
        state = case.done_state(run, self.root) or {}
        self.times[run.name] = Took(float(state["solver_s"]), float(state["cpu_s"]))


def run_check(kind: str, given: Mapping[str, Any], folder: Path) -> tuple[pd.DataFrame, Took]:
    """Run one of the decks for the contact law.

    Parameters
    ----------
    kind : str
        One of `CHECKS`.
    given : mapping
        The parameters of the scene.
    folder : Path
        Where it runs; what is there is removed.

    Raises
    ------
    SolverError
        If it did not come to its end.
    """
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(case.templates() / "liggghts", folder)
    variables = {name: given[name] for name in ("damping", "time_step")}
    if kind == "incline":
        variables["incline"] = given["incline_deg"]
    elif kind == "sliding":
        unit = float(np.sqrt(given["d_m"] * given["reduced_gravity_m_s2"]))
        variables["speed"] = given["speed_m_s"] / unit
    elif kind == "passing":
        names = ("displacement_criterion", "stiffness")
        variables |= {"push": exact.push_of(given), **{name: given[name] for name in names}}
    command = ["stdbuf", "-o0", "liggghts", "-in", f"in.{kind}", "-nocite", "-log", "none"]
    for name, value in variables.items():
        command += ["-var", name, repr(value)]
    log = folder / "log.check"
    ended = process.run(
        command, cwd=folder / "checks", log=log, limit_s=LIMIT_S, env=liggghts.ENVIRONMENT
    )
    printed = log.read_text(errors="replace")
    if ended.returncode != 0 or "the check has ended" not in printed:
        raise SolverError("the check did not come to its end", where=str(log), remedy="see it")
    numbers = re.findall(r"^([a-z][a-z ]+): (\S+)$", printed, re.MULTILINE)
    rows = [(*PRINTED[label], float(text)) for label, text in numbers if label in PRINTED]
    answer = pd.DataFrame(rows, columns=["quantity", "at", "value"])
    return answer, Took(ended.seconds, ended.cpu_s)
