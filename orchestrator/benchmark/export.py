"""Scenes of a pack from a study, and our own answer to each scene of a pack, run anew."""

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
from orchestrator.benchmark import pack, scenes
from orchestrator.benchmark.pack import KINDS, STUDY, Pack, Problem
from orchestrator.errors import InputError, SolverError
from orchestrator.plan import Plan
from orchestrator.runs import case, engine, process
from orchestrator.runs.workspace import Workspace
from orchestrator.solvers import liggghts
from orchestrator.study import fields, study
from orchestrator.study.profile import Files
from orchestrator.study.study import Group, Study
from orchestrator.tables import Tables

Times = dict[str, float]
"""Wall time and processor time of runs, s, ``seconds`` and ``cpu_s``; empty for formulas."""
FORMULAS = (1, 2)
"""Levels that need no finished study."""
LIMIT_S = 3600.0  # of our own runs
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
    **{
        "alpha_deg": "{:g}deg",
        "beta_deg": "beta{:g}",
        "h_m": "h{:g}mm",
        "d_m": "d{:g}mm",
    },
    **{
        "z0_over_d": "z{:.3g}d",
        "nu_m2_s": "nu{:g}",
        "packing": "{}",
        "force_law": "{}",
    },
    **{"stress": "{}", "seed": "seed{:g}"},
}
"""Columns that name a scene where they differ between the scenes of a study; of lengths in mm."""


def export(root: Path, source: Path | None, levels: Collection[int]) -> int:
    """Write a pack, and return how many scenes it has.

    `source` is the directory of a finished study; without one the answers are formulas, of levels
    1 and 2 alone. Raises InputError if a level needs a study, or a pack cannot hold this one.
    """
    levels = levels or (FORMULAS if source is None else {*KINDS.values()})
    kinds = [name for name, level in KINDS.items() if level in levels]
    if source is None:
        if lacking := sorted({*levels} - {*FORMULAS}):
            what = f"level {lacking[0]} needs the answers of a finished study"
            raise InputError(
                what, where="--level", remedy="name its directory with --from"
            )
        asked = study.load("first-look")
        has_decks = 2 in levels and shutil.which(liggghts.PROGRAM) is not None
        programs = {"liggghts": liggghts.version()} if has_decks else {}
        listed = problems(asked, plan.make(asked), {}, Path(), kinds)
        return pack.write(root, listed, (asked.name, asked.text), programs)
    space = Workspace(source.absolute())
    asked, planned = pipeline.reopen(space)
    unknown = [
        (s.flow.gusts, s.grain.cohesion, s.forces.sheltering) for s in asked.scenes
    ]
    what, remedy = "", "run the study without it into another directory"
    if any(answer.is_chosen for answer in planned.decisions.values()):
        what = "levels were chosen for its scenes: a pack has the answers of scenes as written"
        remedy = 'run it with protocol.method = "dem" and no tolerance into another directory'
    elif any(
        pile.scene.protocol.update or pile.bed.width for pile in planned.piles.values()
    ):
        what = "protocol.update or bed.width: a pack holds one flow over each bed, in its plane"
    elif any(one != (None, 0.0, "none") for one in unknown):
        what = "flow.gusts, grain.cohesion or forces.sheltering: a pack has no entries for them"
    elif not space.drawn.is_file():
        what, remedy = "the study is not finished", "run it to its end"
    else:
        times = tables.read(space, "timings")["timings"].set_index("case")["solver_s"]
        if {*times.index} != {*planned.cases}:
            what = "the study was run by another version of the program: its cases are others"
            remedy = "run it again"
    if what:
        raise InputError(what, where=str(source), remedy=remedy)
    sharing = {cell.name: len(cell.scenes) for cell in planned.cells}
    listed = (
        replace(one, seconds=sum(times[run] / sharing.get(run, 1) for run in one.runs))
        if one.runs
        else one
        for one in problems(
            asked, planned, tables.read(space, "tables"), space.cases, kinds
        )
    )
    programs = case.programs(space.cases, planned.cases)
    return pack.write(root, listed, (asked.name, asked.text), programs)


def problems(
    asked: Study, planned: Plan, results: Tables, cases: Path, kinds: Collection[str]
) -> Iterator[Problem]:
    """The scenes of a study as problems of some kinds, names of `KINDS`.

    The study's tables are `results`, empty for formulas alone, and its runs lie in `cases`.
    """
    if "collision" in kinds:
        has_decks = shutil.which(liggghts.PROGRAM) is not None
        yield from map(_with_ours, scenes.checks()) if has_decks else scenes.checks()
    names, piles = scene_names(planned, asked), planned.piles
    cells = {scene.id: cell.name for cell in planned.cells for scene in cell.scenes}
    answers = {asked: answer.scene.id for asked, answer in planned.decisions.items()}
    thresholds = results.get("single_grain")
    ours = (
        {}
        if thresholds is None
        else dict(thresholds.set_index("scene_id")["ustar_m_s"])
    )
    for scene in (scene for scene in asked.scenes if scene.id not in piles):
        name = names[scene.id]
        if "closed-form" in kinds:
            yield scenes.closed_form(name, scene)
        if "pivot" in kinds and scenes.has_pivot(scene):
            problem = scenes.pivot(name, scene, ours.get(scene.id, np.nan))
            yield replace(
                problem, runs=(cells[answers[scene.id]],) if scene.id in ours else ()
            )
    # neither a theory's stress nor a channel's is a question at levels 3 and 5
    solved = {
        i: p for i, p in piles.items() if p.model.cases and not p.scene.flow.depth
    }
    flows = {
        run: solve for pile in solved.values() for run, solve in pile.solves.items()
    }
    for run, solve in flows.items() if "flow" in kinds else ():
        yield replace(
            scenes.flow(names[solve.flow.id[:12]], solve, results), runs=(run,)
        )
    for id_, pile in piles.items():
        # replicas of lattices are in the intervals of the others
        if pile.bed.is_replica or pile.scene.protocol.method != "dem":
            continue
        # grains on other beds are given at level 4 alone, one by one
        has_line = id_ in solved and pile.bed.is_triangle and not pile.pouring
        for kind in ("pile", "line") if has_line else ("pile",):
            if kind in kinds:
                runs = (*(pile.solves if kind == "line" else ()), pile.case.name)
                yield replace(
                    scenes.bed(names[id_], kind, id_, pile, results, cases), runs=runs
                )


def scene_names(planned: Plan, asked: Study) -> dict[str, str]:
    """A name for each scene and each flow of a study, by its digest: the numbers that differ."""
    flows = {
        s.flow.id[:12]: s.scene
        for p in planned.piles.values()
        for s in p.solves.values()
    }
    grains = {one.id: one for one in asked.scenes if one.id not in planned.piles}
    piles = {name: pile.scene for name, pile in planned.piles.items()}
    of_flow = {"alpha_deg", "h_m", "z0_over_d", "nu_m2_s"}
    names: dict[str, str] = {}
    for kind, listed in (("grain", grains), ("pile", piles), ("flow", flows)):
        values = pd.DataFrame(
            [fields.used(scene) for scene in listed.values()], index=[*listed]
        )
        columns = [
            name for name in NAMED if name in values and values[name].nunique() > 1
        ]
        if kind == "flow":
            columns = [name for name in columns if name in of_flow]
        counts: Counter[str] = Counter()
        for length in {"h_m", "d_m"} & {*columns}:
            values[length] *= 1e3
        for digest, row in values[columns].iterrows():
            words = [
                NAMED[str(column)].format(x) for column, x in row.items() if pd.notna(x)
            ]
            name = re.sub("[^a-z0-9.+]+", "-", "-".join([kind, *words]).lower())
            counts[name] += 1
            names[str(digest)] = name if counts[name] == 1 else f"{name}-{counts[name]}"
    return names


def _with_ours(check: Problem) -> Problem:
    """A check of the contact law with the answer of our deck."""
    with tempfile.TemporaryDirectory() as folder:
        answer, times = run_check(check.kind, check.parameters, Path(folder) / "deck")
    ours = answer.set_index(["quantity", "at"])["value"]
    rows = [{**row, "ours": ours[row["quantity"], row["at"]]} for row in check.rows]
    return replace(check, rows=rows, seconds=times["seconds"])


class Ours:
    """The solvers of this package on the scenes named of a pack, in a directory of cases.

    Raises InputError if the study of the pack lacks the text of a file that it names, or one of
    the scenes.
    """

    def __init__(self, chosen: Pack, names: Sequence[str], root: Path) -> None:
        path = chosen.root / STUDY
        text = path.read_text(encoding="utf-8", errors="replace")
        self.pack, self.root = chosen, root
        # a pack has the texts of the files that its study names
        files = Files(None)
        self.study = study.parse(text, name="benchmark", where=str(path), files=files)
        planned = plan.make(self.study)
        digests = scene_names(planned, self.study)
        piles = planned.piles.values()
        flows = {
            digests[s.flow.id[:12]]: s.scene for p in piles for s in p.solves.values()
        }
        self.scenes = {digests[scene.id]: scene for scene in self.study.scenes} | flows
        for name in names:
            if (
                chosen.scenes[name]["kind"] not in CHECKS
                and name[2:] not in self.scenes
            ):
                what = f"no scene of its study is {name}: it is of another version of the program"
                raise InputError(what, where=str(chosen.root), remedy="export it again")

    def answer(self, name: str) -> tuple[pd.DataFrame, Times]:
        """Answer a scene: columns ``quantity``, ``at`` and ``value``, and its times."""
        given = self.pack.scenes[name]
        if given["kind"] in CHECKS:
            return run_check(given["kind"], given, self.root / "checks")
        group = Group(
            "benchmark", (self.scenes[name[2:]],), str(self.pack.root / STUDY)
        )
        asked = replace(self.study, groups=(group,))
        planned = plan.make(asked, cases=self.root)
        kinds = {"closed-form": (), "flow": ("flow",)}.get(given["kind"])
        for run in (
            planned.cases.values()
        ):  # several scenes share a flow, a poured bed or a pile
            is_asked = kinds is None or run.kind in kinds
            if is_asked and not case.done_state(run, self.root):
                engine.execute(run, self.root, LIMIT_S)
        states = planned.done(self.root)
        results = tables.make(asked, planned, self.root, states) if states else {}
        (problem,) = problems(asked, planned, results, self.root, [given["kind"]])
        answer = problem.expected[["quantity", "at", "ours"]].rename(
            columns={"ours": "value"}
        )
        if given["kind"] == "pile":
            steps = pd.read_csv(self.root / problem.runs[0] / "samples.csv")[
                "step"
            ].iloc[-1]
            row = pd.DataFrame(
                {"quantity": ["steps"], "at": [""], "value": [float(steps)]}
            )
            answer = pd.concat([answer, row])
        pairs = (("seconds", "solver_s"), ("cpu_s", "cpu_s")) if problem.runs else ()
        return answer, {
            name: sum(states[run][key] for run in problem.runs) for name, key in pairs
        }


def run_check(
    kind: str, given: Mapping[str, Any], folder: Path
) -> tuple[pd.DataFrame, Times]:
    """Run the deck of a kind of `CHECKS` with the entries of a scene, in a folder that is emptied.

    Raises SolverError if it does not come to its end.
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
        push = (
            given["force_n"] * np.tan(np.radians(given["beta_deg"])) / given["weight_n"]
        )
        names = ("displacement_criterion", "stiffness")
        variables |= {"push": float(push), **{name: given[name] for name in names}}
    command = [
        "stdbuf",
        "-o0",
        "liggghts",
        "-in",
        f"in.{kind}",
        "-nocite",
        "-log",
        "none",
    ]
    command += [
        word for name, x in variables.items() for word in ("-var", name, repr(x))
    ]
    work, log = folder / "checks", folder / "log.check"
    ended = process.run(
        command, cwd=work, log=log, limit_s=LIMIT_S, env=liggghts.ENVIRONMENT
    )
    printed = log.read_text(errors="replace")
    if ended.returncode != 0 or "the check has ended" not in printed:
        raise SolverError(
            "the check did not come to its end", where=str(log), remedy="see it"
        )
    numbers = re.findall(r"^([a-z][a-z ]+): (\S+)$", printed, re.MULTILINE)
    rows = [
        (*PRINTED[label], float(text)) for label, text in numbers if label in PRINTED
    ]
    answer = pd.DataFrame(rows, columns=["quantity", "at", "value"])
    return answer, {"seconds": ended.seconds, "cpu_s": ended.cpu_s}
