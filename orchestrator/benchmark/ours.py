"""Our own answer to a scene of a pack, run anew on this machine."""

import math
import re
import resource
import shutil
import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import plan, tables
from orchestrator.benchmark import exact, measured
from orchestrator.benchmark.answer import STEPS
from orchestrator.benchmark.measured import Answered
from orchestrator.benchmark.pack import STUDY, Pack
from orchestrator.benchmark.problem import Problem
from orchestrator.errors import InputError, SolverError
from orchestrator.plan import Plan
from orchestrator.runs import engine, process
from orchestrator.runs.case import Case, done_state, templates
from orchestrator.solvers import liggghts
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import Group

LIMIT_S = 3600.0
CHECKS = ("collision", "incline", "sliding", "passing")
"""Kinds that have a deck of their own: they need no scene of the study."""
SAID = {
    "restitution": ("restitution", ""),
    "acceleration over g": ("acceleration_over_g", ""),
    "speed at half the time": ("speed_over_start", "0.5"),
    "speed when it rolls": ("speed_over_start", "2"),
    "spin when it rolls": ("spin_over_start", "2"),
    "time of passing": ("passing_time_over_t", ""),
}
"""Names that the check decks print, and the quantities of a pack."""


@dataclass(frozen=True)
class Took:
    """Times of solvers: wall time, and CPU time of them all, s; NaN for formulas."""

    seconds: float
    cpu_s: float

    def __add__(self, other: "Took") -> "Took":
        return Took(self.seconds + other.seconds, self.cpu_s + other.cpu_s)


NOTHING = Took(math.nan, math.nan)
Given = tuple[pd.DataFrame, Took]
"""An answer, and what it took."""


class Ours:
    """The solvers of this package behind the same door."""

    def __init__(self, pack: Pack, root: Path) -> None:
        """Read the pack's study; cases are made below `root`."""
        text = (pack.root / STUDY).read_text(encoding="utf-8")
        self.pack, self.root = pack, root
        self.study = study.parse(text, name="benchmark", where=str(pack.root / STUDY))
        self.scenes = {scene.id: scene for scene in self.study.scenes}
        piles = plan.make(self.study).piles.values()
        self.shared: dict[str, Took] = {}
        self.of_flow = {case.id[:12]: pile.scene for pile in piles for case in pile.model.cases}

    def answer(self, name: str) -> Given:
        """Answer a scene.

        Raises
        ------
        InputError
            If the pack is of another version of the program.
        SolverError
            If a solver failed.
        """
        told = self.pack.scenes[name]
        kind = told["kind"]
        if kind in CHECKS:
            return check(kind, told, self.root / "checks")
        scene = self._scene(name.partition("-")[2], kind)
        group = Group("benchmark", (scene,), str(self.pack.root / STUDY))
        asked = replace(self.study, groups=(group,))
        planned = plan.make(asked, cases=self.root)
        if kind == "closed-form":
            return _given(exact.closed_form(scene)), NOTHING
        if kind == "pivot":
            took = self._run(*planned.cases.values())
            made = tables.make(asked, planned, self.root, planned.cases)
            ours = float(made["single_grain"]["ustar_m_s"].iloc[0])
            return _given(exact.pivot(scene, ours)), took
        return self._bed(kind, asked, planned)

    def check(self, names: Iterable[str]) -> None:
        """See that ours can answer some scenes, before any solver is started.

        Raises
        ------
        InputError
            If the pack is of another version of the program.
        """
        for name in names:
            kind = self.pack.scenes[name]["kind"]
            if kind not in CHECKS:
                self._scene(name.partition("-")[2], kind)

    def _scene(self, name: str, kind: str) -> Scene:
        found = (self.of_flow if kind == "flow" else self.scenes).get(name)
        if found is None:
            raise InputError(
                f"no scene of its study is {name}: it is of another version of the program",
                where=str(self.pack.root),
                remedy="export it again",
            )
        return found

    def _bed(self, kind: str, asked: study.Study, planned: Plan) -> Given:
        pile = next(iter(planned.piles.values()))
        flow_took = NOTHING
        for run in (*pile.model.cases, *pile.pouring):
            if run.name not in self.shared:  # by several scenes
                self.shared[run.name] = self._run(run)
        for flow in pile.model.cases:
            flow_took = self.shared[flow.name]
        cases = {pile.flow.name} if kind == "flow" else set(planned.cases)
        pile_took = NOTHING if kind == "flow" else self._run(pile.case)
        made = tables.make(asked, planned, self.root, cases)
        nothing = pd.DataFrame()
        one = Answered(
            pile,
            made.get("pile_curve", nothing),
            made.get("pile_threshold", nothing),
            made.get("wall_stress", nothing),
            self.root,
        )
        if kind == "flow":
            return _given(measured.flow(one)), flow_took
        if kind == "pile":
            return _with_steps(_given(measured.pile(one)), self.root / pile.case.name), pile_took
        return _given(measured.line(one)), flow_took + pile_took

    def _run(self, *cases: Case) -> Took:
        """Run cases anew."""
        before = _cpu_s()
        for one in cases:
            engine.execute(one, self.root, LIMIT_S, threading.Event())
        return Took(sum(_seconds(one, self.root) for one in cases), _cpu_s() - before)


def check(kind: str, told: Mapping[str, Any], folder: Path) -> Given:
    """Run one of the decks for the contact law.

    Parameters
    ----------
    kind : str
        ``collision``, ``incline``, ``sliding`` or ``passing``.
    told : mapping
        The parameters of the scene.
    folder : Path
        Where it runs; what is there is removed.

    Raises
    ------
    SolverError
        If it did not come to its end.
    """
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(templates() / "liggghts", folder)
    command = ["stdbuf", "-o0", "liggghts", "-in", f"in.{kind}", "-nocite", "-log", "none"]
    for name, value in _variables(kind, told).items():
        command += ["-var", name, repr(value)]
    log, before = folder / "log.check", _cpu_s()
    ended = process.run(
        command, cwd=folder / "checks", log=log, limit_s=LIMIT_S, env=liggghts.ENVIRONMENT
    )
    said = log.read_text(errors="replace")
    if ended.returncode != 0 or "the check has ended" not in said:
        raise SolverError("the check did not come to its end", where=str(log), remedy="see it")
    found = re.findall(r"^([a-z][a-z ]+): (\S+)$", said, re.MULTILINE)
    rows = [(*SAID[label], float(number)) for label, number in found if label in SAID]
    took = Took(ended.seconds, _cpu_s() - before)
    return pd.DataFrame(rows, columns=["quantity", "at", "value"]), took


def _variables(kind: str, told: Mapping[str, Any]) -> dict[str, float]:
    own = {"damping": told["damping"], "time_step": told["time_step"]}
    if kind == "incline":
        own["incline"] = told["incline_deg"]
    if kind == "sliding":
        unit = np.sqrt(told["d_m"] * told["reduced_gravity_m_s2"])
        own["speed"] = float(told["speed_m_s"] / unit)
    if kind == "passing":
        names = ("displacement_criterion", "stiffness")
        own |= {"push": exact.push_of(told), **{name: told[name] for name in names}}
    return own


def _given(problem: Problem) -> pd.DataFrame:
    return problem.expected[["quantity", "at", "ours"]].rename(columns={"ours": "value"})


def _with_steps(given: pd.DataFrame, case: Path) -> pd.DataFrame:
    """With the time steps of the run: those of the last sample of the grains."""
    steps = pd.read_csv(case / "samples.csv")["step"].iloc[-1]
    row = dict(zip(given.columns, (*STEPS, float(steps)), strict=True))
    return pd.concat([given, pd.DataFrame([row])], ignore_index=True)


def _cpu_s() -> float:
    """CPU time of all processes that this one started and that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _seconds(case: Case, root: Path) -> float:
    state = done_state(case, root)
    assert state is not None, "it was run just now"
    return float(state["solver_s"])
