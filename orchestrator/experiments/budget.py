"""The budget: how far the choices that all fidelity levels share move a threshold.

A choice is changed alone, within what measurements and good practice leave open. Each is answered
on the cheapest levels that feel it.
"""

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments import experiment
from orchestrator.experiments.experiment import Runs, Tables, label
from orchestrator.fidelity import calibration, limits
from orchestrator.fidelity.calibration import FROZEN
from orchestrator.fidelity.decision import Decision, on_levels
from orchestrator.fidelity.levels import (
    AS_ASKED,
    PEELING,
    Fields,
    Level,
    Pair,
    changed,
    level,
    value_of,
)
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics.laws import LAWS
from orchestrator.pipeline import Finished
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.study.closed_form import law_holds
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

COARSE = level("flow", "coarse")
"""The level of a solved flow; another flow model is kept."""
DYNAMIC, DYNAMIC_POURED = level("grains", "1 layer, fast"), level("grains", "4 layers, fast")
"""Levels for a choice that dynamics alone feel; on poured beds, with more layers."""
SEEDS = (1, 2, 3)
"""Other draws of a random packing that are as good."""
QUANTITIES = ("shields", "ustar0")
"""The Shields number of the mean stress on the moved grains, and the undisturbed friction velocity
at which they moved."""
ENDS = [f"{name}_{end}" for name in QUANTITIES for end in ("low", "high")]
BASE = "as asked"


@dataclass(frozen=True)
class Choice:
    """One choice that the levels share.

    Attributes
    ----------
    name, why : str
        What tables and figures call it, and why its alternatives are as good.
    field : str
        The field that it changes.
    values, times, beside : tuple
        Its alternatives: values of the field, factors of the scene's value, and sums to it.
    packings : str
        Whether "all" piles have it, "lattices" or "poured" beds alone.
    of_solved_flow : bool
        Whether it moves nothing under a flow that is not solved.
    dynamic : bool
        Whether DEM alone feels it.
    """

    name: str
    why: str
    field: str
    values: tuple[Any, ...] = ()
    times: tuple[float, ...] = ()
    beside: tuple[float, ...] = ()
    packings: str = "all"
    of_solved_flow: bool = False
    dynamic: bool = False

    def levels(self, scene: Scene) -> Pair:
        """The levels on which it is changed in a scene."""
        grains: Level = PEELING
        if self.dynamic:
            grains = DYNAMIC_POURED if scene.is_poured else DYNAMIC
        return Pair(COARSE if scene.flow.model == "solve" else AS_ASKED, grains)

    def scenes(self, scene: Scene) -> Iterator[tuple[str, Scene]]:
        """The scene with each alternative that it can have, by the alternative's name."""
        others = "lattices" if scene.is_poured else "poured"
        if self.packings == others or (self.of_solved_flow and scene.flow.model != "solve"):
            return
        for name, fields in self._alternatives(scene).items():
            try:
                other = changed(scene, fields)
            except InputError:  # the scene cannot have it
                continue
            if other != scene and (self.name != "force law" or law_holds(other)):
                yield f"{self.name}: {name}", other

    def _alternatives(self, scene: Scene) -> dict[str, Fields]:
        if self.name == "packing":
            return _packings(scene)
        if self.name == "force law":  # peeling knows no torque
            laws = {name: law for name, law in LAWS.items() if not law.turns}
            return {law.label: {self.field: name} for name, law in laws.items()}
        value = value_of(scene, self.field)
        if self.name == "first cell":
            value = scene.first_cell_height
        return {
            **{f"{one}": {self.field: one} for one in self.values},
            **{f"{by:g} times": {self.field: by * value} for by in self.times},
            **{f"{by:+g}°": {self.field: value + by} for by in self.beside},
        }


def _packings(scene: Scene) -> dict[str, Fields]:
    """Other seeds of a poured bed; else the other packings of the plane, random gaps by seeds."""
    if scene.is_poured:
        return {f"poured, seed {seed}": {"bed.seed": seed} for seed in SEEDS}
    gaps = {"bed.packing": "disordered", "bed.disorder": 0.05}
    return {
        "rows along the slope": {"bed.packing": "aligned"},
        "level rows": {"bed.packing": "horizontal"},
        **{f"random gaps, seed {seed}": {**gaps, "bed.seed": seed} for seed in SEEDS},
    }


def _choices() -> tuple[Choice, ...]:
    rows = tomllib.loads(Path(__file__).with_name("choices.toml").read_text(encoding="utf-8"))
    lists = ("values", "times", "beside")
    return tuple(
        Choice(**{**row, **{key: tuple(row.get(key, ())) for key in lists}})
        for row in rows["choice"]
    )


CHOICES = _choices()
"""Every shared choice."""


class Change(NamedTuple):
    """An alternative of a choice at a scene, with the names in the plan of both piles."""

    scene: Scene
    choice: Choice
    name: str
    base: str
    other: str


def changes(study: Study) -> tuple[list[Change], dict[str, Decision]]:
    """The alternatives of each pile of a study, and the piles to be answered, by name."""
    listed, asked = [], {}
    for scene in study.scenes:
        for choice in CHOICES if isinstance(scene.bed, PileBed) else ():
            levels = choice.levels(scene)
            base, *others = (
                (f"{scene.id} | {levels.text} | {name}", name, pile)
                for name, pile in ((BASE, scene), *choice.scenes(scene))
            )
            for key, _, pile in (base, *others):
                asked[key] = on_levels(pile, levels, "the budget changes one choice")
            listed += [Change(scene, choice, name, base[0], key) for key, name, _ in others]
    return listed, asked


def run(study: Study, out: Path, *, workers: int) -> Finished:
    """Change each shared choice alone, on the piles of a study, and draw what that moves.

    Raises
    ------
    InputError
        If the study has no pile or one is beyond a limit of the methods, or the directory cannot
        be used.
    SolverError
        If a solver is missing.
    OrchestratorError
        If no run came to its end.
    """
    limits.check_study(study)
    listed, asked = changes(study)
    if not asked:
        remedy = 'give a group `bed.kind = "pile"`'
        raise InputError("there is no pile in this study", where=study.name, remedy=remedy)
    planned = plan.of(asked, study.name, cases=out.absolute() / "cases")

    def make(runs: Runs) -> tuple[Tables, Callable[[], list[Section]]]:
        moved = measure(listed, runs)
        if moved.empty:
            raise experiment.nothing_ran(out, "no run came to its end: no share is known")
        shared = shares(moved)
        tables = {"changes": moved, "shares": shared, "budget": known(shared)}
        return tables, lambda: _sections(listed, tables, runs)

    limit_s = study.time_limit_s
    finished = experiment.run(
        "budget", "What a threshold is worth", planned, out, make, workers=workers, limit_s=limit_s
    )
    # a flow model may refuse a bed: only runs of the scenes as they are asked count as failed
    needed = {run.name for change in listed for run in planned.piles[change.base].runs}
    failures = {name: error for name, error in finished.failures.items() if name in needed}
    return Finished(finished.page, finished.started, failures)


def measure(listed: list[Change], runs: Runs) -> pd.DataFrame:
    """A row for each scene, alternative and fraction: how far the threshold moved, relative."""

    @cache
    def thresholds(key: str) -> list[PileThreshold]:
        pile = runs.planned.piles[key]
        return pile.thresholds(runs.cases, pile.scene.protocol.fractions)

    return pd.DataFrame(
        {
            "scene_id": change.scene.id,
            "scene": label(change.scene),
            "model_class": calibration.model_class(change.scene),
            "choice": change.choice.name,
            "alternative": change.name.partition(": ")[2],
            "fraction": before.fraction,
            "shields": after.tau / before.tau - 1,
            "ustar0": after.ustar0 / before.ustar0 - 1,
        }
        for change in listed
        if runs.are_done(change.base, change.other)
        for before, after in zip(thresholds(change.base), thresholds(change.other), strict=True)
    )


def shares(moved: pd.DataFrame) -> pd.DataFrame:
    """A row for each scene, choice and fraction: how far down and up its alternatives move it.

    Both signs are at least 0: of alternatives that all raise it the lower share is 0.
    """
    keys = ["scene_id", "scene", "model_class", "choice", "fraction"]
    grouped = moved.dropna(subset=list(QUANTITIES)).groupby(keys, sort=False)
    parts = {}
    for name in QUANTITIES:
        parts[f"{name}_low"] = 0.0 - grouped[name].min().clip(upper=0.0)
        parts[f"{name}_high"] = grouped[name].max().clip(lower=0.0)
    return pd.DataFrame(parts).reset_index()


def known(shared: pd.DataFrame) -> pd.DataFrame:
    """The largest share of each choice over the scenes of a class: what the package keeps."""
    grouped = shared.groupby(["model_class", "choice", "fraction"], sort=False)
    return grouped[ENDS].max().assign(scenes=grouped["scene_id"].nunique()).reset_index()


def _sections(listed: list[Change], tables: Tables, runs: Runs) -> list[Section]:
    """The page: all choices, the bed that changes, a tornado for each scene, the alternatives."""
    from orchestrator.experiments import budget_figures as figures

    words, figure, sheet = experiment.texts("budget"), experiment.figure, document.sheet
    moved, shared = tables["changes"], tables["shares"]
    title, all_scenes = "All choices together", _together(shared)
    sections = [Section(title, words["together"], (), [sheet(all_scenes)], [words["limit"]])]
    piles = runs.planned.piles
    worn = [
        (piles[change.base], piles[change.other])
        for change in listed
        if change.choice.name == FROZEN and runs.are_done(change.base, change.other)
    ]
    if worn:
        frozen = moved[moved["choice"] == FROZEN]
        table = frozen[["scene", "fraction"]].rename(columns={"fraction": "n/N"})
        table = table.assign(**{"θ, %": 100 * frozen["shields"], "u*₀, %": 100 * frozen["ustar0"]})
        drawn = figures.curves(worn, runs.cases)
        chart = figure("wear", "Frozen bed and bed that changes", words["wear"], drawn)
        title = "The bed that changes"
        sections.append(Section(title, words["changing"], (chart,), [sheet(table)]))
    for number, (_, scene) in enumerate(shared.groupby("scene_id", sort=False), 1):
        name, drawn = str(scene["scene"].iloc[0]), figures.tornado(scene)
        chart = figure(f"tornado-{number}", name, words["scene"], drawn)
        ends = zip(100 * scene["shields_low"], 100 * scene["shields_high"], strict=True)
        share = [f"−{low:.1f} … +{high:.1f}" for low, high in ends]
        heads = [f"change of θ at {fraction:.0%}, %" for fraction in scene["fraction"]]
        table = scene.assign(share=share, head=heads)
        wide = table.pivot_table("share", "choice", "head", aggfunc="first", sort=False)
        sections.append(Section(name, "", (chart,), [sheet(wide.reset_index())]))
    tried = moved.groupby("choice")["alternative"].agg(lambda x: ", ".join(dict.fromkeys(x)))
    kept = [(c.name, tried[c.name], c.why) for c in CHOICES if c.name in tried]
    choices = pd.DataFrame(kept, columns=["choice", "alternatives", "why"])
    # a flow model may refuse a bed
    scenes = {key: change.scene for change in listed for key in (change.base, change.other)}
    rows = []
    for key, asked in scenes.items():
        if not runs.are_done(key):
            failed = (runs.failures.get(run.name) for run in piles[key].runs)
            why = "; ".join(error.what for error in failed if error)
            rows.append((label(asked), key.rpartition(" | ")[2], why))
    lost = pd.DataFrame(rows, columns=["scene", "alternative", "why"]).drop_duplicates()
    text = "" if lost.empty else "The alternatives of the second table have no answer."
    sheets = [sheet(table) for table in (choices, lost) if len(table)]
    return [*sections, Section("The choices and their alternatives", text, tables=sheets)]


def _together(shared: pd.DataFrame) -> pd.DataFrame:
    """A row for each scene: the shares of all choices together, and the largest of them."""
    rows = []
    for _, scene in shared.groupby("scene_id", sort=False):
        largest = scene.groupby("choice", sort=False)[ENDS].max()
        row = {"scene": scene["scene"].iloc[0]}
        for name, symbol in zip(QUANTITIES, ("θ", "u*₀"), strict=True):
            low, high = calibration.together(largest, name)
            row[f"{symbol}, %"] = f"−{100 * low:.0f} … +{100 * high:.0f}"
            widths = largest[f"{name}_low"] + largest[f"{name}_high"]
            row[f"{symbol}: largest share"] = str(widths.idxmax())
        rows.append(row)
    return pd.DataFrame(rows)
