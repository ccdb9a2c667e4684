"""Scenes of a pack from a study, and our own answer to each scene, run anew."""

import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import pipeline, plan, tables
from orchestrator.benchmark import checks, pack, scenes
from orchestrator.benchmark.pack import KINDS, OF_POCKET, STUDY, Pack, Problem
from orchestrator.errors import InputError, SolverError
from orchestrator.grains.pile import Pile
from orchestrator.plan import Plan
from orchestrator.runs import case, engine, process, reuse
from orchestrator.runs.workspace import Workspace
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import fields, study
from orchestrator.study.criterion import SUSTAINED
from orchestrator.study.profile import Files
from orchestrator.study.scene import Scene
from orchestrator.study.study import Group, Study
from orchestrator.tables import Tables

Times = dict[str, float]
"""``seconds`` and ``cpu_s`` of runs, wall and processor time, s; empty for formulas."""
FORMULAS = (1, 2)
"""Levels that need no finished study."""
LIMIT_S = 3600.0
"""Wall time of each of our own runs, s."""
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
NAMED = {
    "alpha_deg": "{:g}deg",
    "beta_deg": "beta{:g}",
    "h_m": "h{:g}mm",
    "d_m": "d{:g}mm",
    "z0_over_d": "z{:.3g}d",
    "nu_m2_s": "nu{:g}",
    "packing": "{}",
    "force_law": "{}",
    "stress": "{}",
    "seed": "seed{:g}",
}
"""Columns that name a scene where they differ between the scenes of a study; of lengths
in mm."""
IN_MM = ("h_m", "d_m")
"""Those of them that are lengths."""
OF_FLOW = ("alpha_deg", "h_m", "z0_over_d", "nu_m2_s")
"""Those of them that name a flow."""


def export(root: Path, source: Path | None, levels: Collection[int]) -> int:
    """Write a pack.

    Parameters
    ----------
    root
        The directory of the pack.
    source
        The directory of a finished study; without one the answers are formulas, of
        levels 1 and 2 alone.
    levels
        The levels that the pack has; by default all that there can be.

    Returns
    -------
    int
        How many scenes the pack has.

    Raises
    ------
    InputError
        If a level needs a study, or a pack cannot hold this one.
    """
    if source is None:
        return _export_formulas(root, levels or FORMULAS)
    kinds = _kinds(levels or KINDS.values())
    space = Workspace(source.absolute())
    asked, planned = pipeline.reopen(space)
    _check_exportable(asked, planned, str(source))
    if not space.drawn.is_file():
        what = "the study is not finished"
        raise InputError(what, str(source), "run it to its end")
    times = tables.read_tables(space, "timings")["timings"].set_index("case")[
        "solver_s"
    ]
    if set(times.index) != set(planned.cases):
        what = (
            "the study was run by another version of the program: its cases are others"
        )
        raise InputError(what, str(source), "run it again")
    sharing = {cell.name: len(cell.scenes) for cell in planned.cells}
    results = tables.read_tables(space, "tables")
    listed = []
    for problem in problems(asked, planned, results, space.cases, kinds):
        if problem.runs:
            seconds = sum(times[run] / sharing.get(run, 1) for run in problem.runs)
            problem = replace(problem, seconds=seconds)
        listed.append(problem)
    programs = case.programs(space.cases, planned.cases)
    return pack.write_pack(root, listed, (asked.name, asked.text), programs)


def _export_formulas(root: Path, levels: Collection[int]) -> int:
    """Write a pack whose answers are formulas, but for those of our check decks."""
    lacking = sorted(set(levels) - set(FORMULAS))
    if lacking:
        what = f"level {lacking[0]} needs the answers of a finished study"
        raise InputError(what, "--level", "name its directory with --from")
    asked = study.load("first-look")
    programs = {}
    if 2 in levels and _has_decks():
        programs[ENGINE.PROGRAM] = ENGINE.version()
    listed = problems(asked, plan.make(asked), {}, Path(), _kinds(levels))
    return pack.write_pack(root, listed, (asked.name, asked.text), programs)


def _kinds(levels: Collection[int]) -> list[str]:
    """The kinds of scenes of some levels."""
    return [name for name, level in KINDS.items() if level in levels]


def _has_decks() -> bool:
    """Whether our check decks can be run."""
    return shutil.which(ENGINE.PROGRAM) is not None


def _check_exportable(asked: Study, planned: Plan, where: str) -> None:
    """Refuse a study of which a pack cannot hold the scenes."""
    if any(decision.is_chosen for decision in planned.decisions.values()):
        what = "levels were chosen for its scenes"
        remedy = 'run it with method.kind = "dem" and no tolerance'
        raise InputError(
            f"{what}: a pack has the answers of scenes as written",
            where,
            f"{remedy} into another directory",
        )
    remedy = "run the study without it into another directory"
    for decision in planned.decisions.values():
        if decision.scene.threshold.criterion == SUSTAINED:
            raise InputError(
                "threshold.criterion: a pack asks when grains are entrained",
                where,
                'write threshold.criterion = "entrained", run it into another '
                "directory",
            )
    for pile in planned.piles.values():
        if pile.scene.threshold.update or pile.bed.width:
            what = "a pack holds one flow over each bed, in its plane"
            fields_of_it = "threshold.update or bed.width"
            raise InputError(f"{fields_of_it}: {what}", where, remedy)
    for scene in asked.scenes:
        has_gusts = scene.flow.gusts is not None
        if has_gusts or scene.grain.cohesion or scene.forces.sheltering != "none":
            fields_of_it = "flow.gusts, grain.cohesion or forces.sheltering"
            what = f"{fields_of_it}: a pack has no entries for them"
            raise InputError(what, where, remedy)


def problems(
    asked: Study, planned: Plan, results: Tables, cases: Path, kinds: Collection[str]
) -> Iterator[Problem]:
    """Make problems of the scenes of a study.

    Parameters
    ----------
    asked
        The study.
    planned
        Its plan.
    results
        Its tables; empty for formulas alone.
    cases
        The directory of its runs.
    kinds
        The kinds of problems, names of `KINDS`.

    Yields
    ------
    Problem
        The problems, by level but for single grains, whose two come together.
    """
    if "collision" in kinds:
        for check in checks.all_checks():
            yield _with_ours(check) if _has_decks() else check
    names = scene_names(planned, asked)
    yield from _of_grains(asked, planned, results, names, kinds)
    if "flow" in kinds:
        for run, solve in _solves(planned).items():
            name = names[solve.flow.id[:12]]
            yield replace(scenes.flow_scene(name, solve, results), runs=(run,))
    yield from _of_piles(planned, results, cases, names, kinds)


def _of_grains(
    asked: Study,
    planned: Plan,
    results: Tables,
    names: Mapping[str, str],
    kinds: Collection[str],
) -> Iterator[Problem]:
    """The problems of single grains."""
    cells = {scene.id: cell.name for cell in planned.cells for scene in cell.scenes}
    ustar: dict[Any, float] = {}
    if "single_grain" in results:
        ustar = results["single_grain"].set_index("scene_id")["ustar_m_s"].to_dict()
    for scene in asked.scenes:
        if scene.id in planned.piles:
            continue
        name = names[scene.id]
        if "closed-form" in kinds:
            yield scenes.formula_scene(name, scene)
        if OF_POCKET in kinds and scenes.has_pivot(scene):
            problem = scenes.pivot(name, scene, ustar.get(scene.id, np.nan))
            answered = planned.decisions[scene.id].scene
            if answered.id in cells and scene.id in ustar:
                problem = replace(problem, runs=(cells[answered.id],))
            yield problem


def _has_solved_layer(pile: Pile) -> bool:
    """Whether the flow of a pile is a question: no theory's, and no channel's."""
    return bool(pile.model.cases) and not pile.scene.flow.depth


def _solves(planned: Plan) -> dict[str, Pile]:
    """A pile for each solved flow that is a question, by the flow's case."""
    solves = {}
    for pile in planned.piles.values():
        if _has_solved_layer(pile):
            solves.update(pile.solves)
    return solves


def _of_piles(
    planned: Plan,
    results: Tables,
    cases: Path,
    names: Mapping[str, str],
    kinds: Collection[str],
) -> Iterator[Problem]:
    """The problems of piles that DEM answers, under the given stress or one's own."""
    for scene_id, pile in planned.piles.items():
        # replicas of lattices are in the intervals of the others
        is_reference = pile.scene.method.is_resolved_in_time
        if pile.bed.is_replica or not is_reference:
            continue
        name = names[scene_id]
        if "pile" in kinds:
            problem = scenes.bed(name, "pile", scene_id, pile, results, cases)
            yield replace(problem, runs=(pile.case.name,))
        # grains on other beds are given at level 4 alone, one by one
        is_lattice = pile.bed.is_triangle and not pile.pouring
        if "line" in kinds and is_lattice and _has_solved_layer(pile):
            problem = scenes.bed(name, "line", scene_id, pile, results, cases)
            yield replace(problem, runs=(*pile.solves, pile.case.name))


def scene_names(planned: Plan, asked: Study) -> dict[str, str]:
    """Name each scene and each flow of a study by the numbers that differ.

    Parameters
    ----------
    planned
        The plan of the study.
    asked
        The study.

    Returns
    -------
    dict of str to str
        The names, by the digests of scenes and flows.
    """
    grains = {one.id: one for one in asked.scenes if one.id not in planned.piles}
    piles = {name: pile.scene for name, pile in planned.piles.items()}
    names = _named("grain", grains, NAMED)
    names |= _named("pile", piles, NAMED)
    names |= _named("flow", _scenes_of_flows(planned), OF_FLOW)
    return names


def _scenes_of_flows(planned: Plan) -> dict[str, Scene]:
    """A scene for each flow of a plan, by the digest of the flow."""
    flows = {}
    for pile in planned.piles.values():
        for solve in pile.solves.values():
            flows[solve.flow.id[:12]] = solve.scene
    return flows


def _named(
    kind: str, listed: Mapping[str, Scene], columns: Collection[str]
) -> dict[str, str]:
    """Names of scenes of a kind by their digests: the columns in which they differ."""
    values = pd.DataFrame([fields.used(scene) for scene in listed.values()])
    values.index = pd.Index(listed)
    differ = []
    for name in NAMED:
        if name in columns and name in values and values[name].nunique() > 1:
            differ.append(name)
    names: dict[str, str] = {}
    counts: Counter[str] = Counter()
    for digest, row in values[differ].iterrows():
        words = [kind]
        for column in differ:
            value = row[column]
            if column in IN_MM:
                value = value * 1e3
            if pd.notna(value):
                words.append(NAMED[column].format(value))
        name = re.sub("[^a-z0-9.+]+", "-", "-".join(words).lower())
        counts[name] += 1
        if counts[name] > 1:
            name = f"{name}-{counts[name]}"
        names[str(digest)] = name
    return names


def _with_ours(check: Problem) -> Problem:
    """A check of the contact law with the answer of our deck."""
    with tempfile.TemporaryDirectory() as folder:
        answer, times = run_check(check.kind, check.parameters, Path(folder) / "deck")
    ours = answer.set_index(["quantity", "at"])["value"]
    rows = []
    for row in check.rows:
        rows.append({**row, "ours": ours[row["quantity"], row["at"]]})
    return replace(check, rows=rows, seconds=times["seconds"])


class Ours:
    """The solvers of this package on scenes of a pack.

    Parameters
    ----------
    chosen
        The pack.
    names
        The names of the scenes.
    root
        The directory of the cases.

    Raises
    ------
    InputError
        If the study of the pack lacks the text of a file that it names, or one of the
        scenes.
    """

    def __init__(self, chosen: Pack, names: Sequence[str], root: Path) -> None:
        path = chosen.root / STUDY
        text = path.read_text(encoding="utf-8", errors="replace")
        self.pack = chosen
        self.root = root
        # a pack has the texts of the files that its study names
        files = Files(None)
        self.study = study.parse(text, name="benchmark", where=str(path), files=files)
        planned = plan.make(self.study)
        names_of = scene_names(planned, self.study)
        self.scenes = {names_of[scene.id]: scene for scene in self.study.scenes}
        for digest, scene in _scenes_of_flows(planned).items():
            self.scenes[names_of[digest]] = scene
        for name in names:
            is_check = chosen.scenes[name]["kind"] in CHECKS
            if not is_check and name[2:] not in self.scenes:
                what = f"no scene of its study is {name}"
                why = "it is of another version of the program"
                where = str(chosen.root)
                raise InputError(f"{what}: {why}", where, "export it again")

    def answer(self, name: str) -> tuple[pd.DataFrame, Times]:
        """Answer a scene by our solvers.

        Parameters
        ----------
        name
            The name of the scene in the pack.

        Returns
        -------
        answer
            Columns ``quantity``, ``at`` and ``value``.
        times
            Its times.
        """
        given = self.pack.scenes[name]
        kind = given["kind"]
        if kind in CHECKS:
            return run_check(kind, given, self.root / "checks")
        where = str(self.pack.root / STUDY)
        group = Group("benchmark", (self.scenes[name[2:]],), where)
        asked = replace(self.study, groups=(group,))
        planned = plan.make(asked, cases=self.root)
        self._run(planned, kind)
        states = reuse.done(planned.cases, self.root)
        results: Tables = {}
        if states:
            results = tables.make_tables(asked, planned, self.root, states)
        (problem,) = problems(asked, planned, results, self.root, [kind])
        times: Times = {}
        if problem.runs:
            ended = [states[run] for run in problem.runs]
            times["seconds"] = sum(state["solver_s"] for state in ended)
            times["cpu_s"] = sum(state["cpu_s"] for state in ended)
        return self._answers(problem), times

    def _answers(self, problem: Problem) -> pd.DataFrame:
        """The answers to a problem, of a pile with the number of its time steps."""
        answer = problem.expected[["quantity", "at", "ours"]]
        answer = answer.rename(columns={"ours": "value"})
        if problem.kind != "pile":
            return answer
        samples = pd.read_csv(self.root / problem.runs[0] / "samples.csv")
        steps = float(samples["step"].iloc[-1])
        row = {"quantity": ["steps"], "at": [""], "value": [steps]}
        return pd.concat([answer, pd.DataFrame(row)])

    def _run(self, planned: Plan, kind: str) -> None:
        """Run the cases that a kind of scene needs; several share a flow or a pile."""
        if kind == "closed-form":
            return
        for run in planned.cases.values():
            is_needed = kind != "flow" or run.kind == "flow"
            if is_needed and not case.done_state(run, self.root):
                engine.execute(run, self.root, LIMIT_S)


def run_check(
    kind: str, given: Mapping[str, Any], folder: Path
) -> tuple[pd.DataFrame, Times]:
    """Run a check deck.

    Parameters
    ----------
    kind
        Its kind, one of `CHECKS`.
    given
        The entries of the scene.
    folder
        The directory that it runs in, which is emptied.

    Returns
    -------
    answer
        Columns ``quantity``, ``at`` and ``value``.
    times
        Its times.

    Raises
    ------
    SolverError
        If it does not come to its end.
    """
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(case.templates() / ENGINE.TEMPLATES, folder)
    deck = f"in.{kind}"
    command = ENGINE.command(deck, _variables(kind, given))
    log = folder / "log.check"
    ended = process.run(
        command,
        cwd=folder / "checks",
        log=log,
        limit_s=LIMIT_S,
        env=ENGINE.ENVIRONMENT,
    )
    printed = log.read_text(errors="replace")
    if ended.returncode != 0 or "the check has ended" not in printed:
        what = "the check did not come to its end"
        raise SolverError(what, where=str(log), remedy="see it")
    rows = []
    for label, text in re.findall(r"^([a-z][a-z ]+): (\S+)$", printed, re.MULTILINE):
        if label in PRINTED:
            rows.append((*PRINTED[label], float(text)))
    answer = pd.DataFrame(rows, columns=["quantity", "at", "value"])
    return answer, {"seconds": ended.seconds, "cpu_s": ended.cpu_s}


def _variables(kind: str, given: Mapping[str, Any]) -> dict[str, float]:
    """The variables of a check deck."""
    variables = {"damping": given["damping"], "time_step": given["time_step"]}
    if kind == "incline":
        variables["incline"] = given["incline_deg"]
    elif kind == "sliding":
        unit = float(np.sqrt(given["d_m"] * given["reduced_gravity_m_s2"]))
        variables["speed"] = given["speed_m_s"] / unit
    elif kind == "passing":
        force = given["force_n"] * np.tan(np.radians(given["beta_deg"]))
        variables["push"] = float(force / given["weight_n"])
        variables["displacement_criterion"] = given["displacement_criterion"]
        variables["stiffness"] = given["stiffness"]
    return variables
