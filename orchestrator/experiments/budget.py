"""The budget: how far the choices that all fidelity levels share move a threshold.

A choice is changed alone, on the cheapest levels that feel it.
"""

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator import plan
from orchestrator.errors import InputError
from orchestrator.experiments.experiment import TEXTS, Experiment, Results, Runs, label, piles
from orchestrator.fidelity import levels, limits
from orchestrator.fidelity.decision import Decision, on_levels
from orchestrator.fidelity.levels import FROZEN, PEELING, Fields, Pair, changed, level, value_of
from orchestrator.physics.laws import LAWS
from orchestrator.report import style
from orchestrator.report.page import Section
from orchestrator.report.results import FRACTION
from orchestrator.report.style import Figure
from orchestrator.study.closed_form import law_holds
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.tables.rows import shields

COARSE = level("flow", "coarse")  # of a solved flow; another flow model is kept
DYNAMIC, DYNAMIC_POURED = level("grains", "1 layer, fast"), level("grains", "4 layers, fast")
"""Levels for a choice that dynamics alone feel; on poured beds, with more layers."""
SEEDS = (1, 2, 3)  # other draws of a random packing that are as good
QUANTITIES = {"shields": "Shields number $θ$", "ustar0": "undisturbed friction velocity $u^*_0$"}
ENDS = [f"{name}_{end}" for name in QUANTITIES for end in ("low", "high")]
BASE = "as asked"
COLOURS = ("#0072b2", "#d55e00")
ALONE = "What each choice moves, changed alone"


@dataclass(frozen=True)
class Choice:
    """One choice that all levels share, and what else it could be.

    The alternatives are `values` of the field, `times` the scene's value, and sums `beside` it.
    `packings` says whether "all" piles have it, "lattices" or "poured" beds alone; a choice
    `of_solved_flow` moves nothing under another flow, and one that is `dynamic` DEM alone feels.
    """

    name: str
    why: str
    field: str
    values: Sequence[Any] = ()
    times: Sequence[float] = ()
    beside: Sequence[float] = ()
    packings: str = "all"
    of_solved_flow: bool = False
    dynamic: bool = False

    def levels(self, scene: Scene) -> Pair:
        """The levels on which it is changed in a scene."""
        grains = (DYNAMIC_POURED if scene.is_poured else DYNAMIC) if self.dynamic else PEELING
        return Pair(COARSE if scene.flow.model == "solve" else levels.AS_ASKED, grains)

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
                yield name, other

    def _alternatives(self, scene: Scene) -> dict[str, Fields]:
        if self.name == "packing":
            name, random, rows = "poured", {}, dict[str, Fields]()
            if not scene.is_poured:
                name, random = "random gaps", {"bed.packing": "disordered", "bed.disorder": 0.05}
                rows["rows along the slope"] = {"bed.packing": "aligned"}
                rows["level rows"] = {"bed.packing": "horizontal"}
            return rows | {f"{name}, seed {seed}": {**random, "bed.seed": seed} for seed in SEEDS}
        if self.name == "force law":  # peeling knows no torque
            return {law.label: {self.field: n} for n, law in LAWS.items() if not law.turns}
        of_cell = self.name == "first cell"
        value = scene.first_cell_height if of_cell else value_of(scene, self.field)
        return {
            **{f"{other}": {self.field: other} for other in self.values},
            **{f"{by:g} times": {self.field: by * value} for by in self.times},
            **{f"{by:+g}°": {self.field: value + by} for by in self.beside},
        }


_TEXT = Path(__file__).with_name("choices.toml").read_text(encoding="utf-8")
CHOICES = [Choice(**row) for row in tomllib.loads(_TEXT)["choice"]]


class Change(NamedTuple):
    """An alternative of a choice at a scene, with the names in the plan of both piles."""

    scene: Scene
    choice: Choice
    alternative: str
    base: str
    other: str


def changes(study: Study) -> tuple[list[Change], dict[str, Decision]]:
    """The alternatives of each pile of a study, and the piles to be answered, by name."""
    listed, asked = [], {}
    for scene in piles(study):
        for choice in CHOICES:
            pair, why = choice.levels(scene), "the budget changes one choice"
            start = f"{scene.id} | {pair.text} | "
            asked[start + BASE] = on_levels(scene, pair, why)
            for name, other in choice.scenes(scene):
                key = f"{start}{choice.name}: {name}"
                asked[key] = on_levels(other, pair, why)
                listed.append(Change(scene, choice, name, start + BASE, key))
    return listed, asked


def experiment(study: Study, out: Path) -> Experiment:
    """What each shared choice is worth, changed alone on the piles of a study."""
    limits.check_study(study)
    listed, asked = changes(study)
    planned = plan.of(asked, cases=out.absolute() / "cases")

    def results(runs: Runs) -> Results:
        if (moved := measure(listed, runs)).empty:
            return {}, ()
        tables = {"changes": moved, "shares": (shared := shares(moved)), "budget": known(shared)}
        return tables, _sections(listed, moved, shared, runs)

    # a flow model may refuse a bed: only runs of the scenes as they are asked count as failed
    failing = {run.name for change in listed for run in planned.piles[change.base].runs}
    title, limit_s = "What a threshold is worth", study.time_limit_s
    source = study.source
    return Experiment("budget", title, planned, results, limit_s, failing=failing, source=source)


def measure(listed: list[Change], runs: Runs) -> pd.DataFrame:
    """A row for each scene, alternative and fraction: how far the threshold moved, relative."""
    thresholds = {
        key: pile.thresholds(runs.cases, pile.scene.protocol.fractions)
        for key, pile in runs.planned.piles.items()
        if runs.are_done(key)
    }
    return pd.DataFrame(
        {
            "scene_id": change.scene.id,
            "scene": label(change.scene),
            "model_class": levels.model_class(change.scene),
            "choice": change.choice.name,
            "alternative": change.alternative,
            "fraction": before.fraction,
            "shields": after.tau / before.tau - 1,
            "ustar0": after.ustar0 / before.ustar0 - 1,
        }
        for change in listed
        if runs.are_done(change.base, change.other)
        for before, after in zip(thresholds[change.base], thresholds[change.other], strict=True)
    )


def shares(moved: pd.DataFrame) -> pd.DataFrame:
    """How far down and up the alternatives move each scene at a fraction; both at least 0."""
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


def _sections(
    listed: list[Change], moved: pd.DataFrame, shared: pd.DataFrame, runs: Runs
) -> list[Section]:
    """The page: all choices, the bed that changes, a tornado for each scene, the alternatives."""
    words, rows, tornados = TEXTS["budget"], [], []
    piles, bases = runs.planned.piles, {c.scene.id: c.base for c in reversed(listed)}
    for number, (scene_id, scene) in enumerate(shared.groupby("scene_id", sort=False), 1):
        name, largest = str(scene["scene"].iloc[0]), scene.groupby("choice", sort=False)[ENDS].max()
        base, fraction = (
            piles[bases[str(scene_id)]],
            min(scene["fraction"], key=lambda n: abs(float(n) - FRACTION)),
        )
        (at,) = base.thresholds(runs.cases, [fraction])
        row, values = {"scene": name}, (shields(base.scene, at.tau), at.ustar0)
        for quantity, symbol, value in zip(QUANTITIES, ("θ", "u*₀, m/s"), values, strict=True):
            low, high = levels.together(largest, quantity)
            row[symbol] = f"{value:#.3g}"
            row[f"{symbol}: interval"] = f"{value * (1 - low):#.3g} … {value * (1 + high):#.3g}"
            widths = largest[f"{quantity}_low"] + largest[f"{quantity}_high"]
            row[f"{symbol}: most by"] = str(widths.idxmax())
        rows.append(row)
        theta, ends, most, ustar, ustar_ends, _ = list(row.values())[1:]
        said = f"{name}: {fraction:.0%} of the exposed grains go at θ = {theta} ({ends} with all "
        said += f"choices together, most by {most}), u*₀ = {ustar} m/s ({ustar_ends})."
        chart = Figure(f"tornado-{number}", ALONE, words["scene"], (), tornado(largest))
        tornados.append(Section("", said, [chart]))
    title, all_scenes = "All choices together", [pd.DataFrame(rows)]
    sections = [Section(title, words["together"], (), all_scenes, [words["limit"]])]
    frozen = moved[moved["choice"] == FROZEN]
    if len(frozen):
        table = frozen[["scene", "fraction"]].rename(columns={"fraction": "n/N"})
        table = table.assign(**{"θ, %": 100 * frozen["shields"], "u*₀, %": 100 * frozen["ustar0"]})
        sections.append(Section("The bed that changes", words["changing"], (), [table]))
    tried = moved.groupby("choice")["alternative"].agg(lambda x: ", ".join(dict.fromkeys(x)))
    kept = [(c.name, tried[c.name], c.why) for c in CHOICES if c.name in tried]
    tables = [pd.DataFrame(kept, columns=["choice", "alternatives", "why"])]
    last = Section("The choices and their alternatives", "", (), tables)
    return [tornados[0], *sections, *tornados[1:], last]


def tornado(largest: pd.DataFrame) -> Canvas:
    """The largest share of each choice of one scene over the fractions; rows are the choices."""
    largest = largest.loc[largest.max(axis=1).sort_values().index]
    total = [end for name in QUANTITIES for end in levels.together(largest, name)]
    rows = pd.concat([largest, pd.DataFrame([total], columns=ENDS, index=["all together"])])
    canvas = style.canvas(0.28 * len(rows) + 1.0)
    ax, bar = canvas.subplots(), 0.38
    for name, offset, colour in zip(QUANTITIES, (bar / 2, -bar / 2), COLOURS, strict=True):
        low, high = 100 * rows[f"{name}_low"], 100 * rows[f"{name}_high"]
        ax.barh(np.arange(len(rows)) + offset, low + high, bar, left=-low, color=colour, lw=0)
    ax.use_sticky_edges = False  # no bar ends on the frame
    ax.axvline(0.0, color="0.2", lw=0.8)
    ax.axhline(len(largest) - 0.5, color="0.7", lw=0.6)
    ax.set_yticks(range(len(rows)), list(rows.index))
    ax.set_xlabel("change of the threshold, %")
    ax.grid(axis="x", lw=0.4, color="0.85")
    looks = zip(QUANTITIES.values(), COLOURS, strict=True)
    style.legends(canvas, [style.entry(text, colour) for text, colour in looks], [])
    return canvas
