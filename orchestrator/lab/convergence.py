"""Convergence: how far finer meshes and load steps move the thresholds of a scene.

Of a solved flow the mesh is refined at the same first cell, and with it; of DEM the
load steps and the mobile layers. The grains under a refined flow move without a run (by
peeling, or by pivots on a bed in space), so that no load step hides what a mesh
changes.
"""

import math
import sys
import warnings
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator import plan
from orchestrator.bed.line import of_bed
from orchestrator.command import say
from orchestrator.digits import number
from orchestrator.errors import InputError
from orchestrator.experiment import (
    Experiment,
    ExperimentResults,
    Runs,
    label,
    page_texts,
    piles,
)
from orchestrator.fidelity import limits
from orchestrator.fidelity.classes import FLOW, GRAINS, scene_class
from orchestrator.fidelity.decision import as_written
from orchestrator.grains.pile import Pile
from orchestrator.lab.grid_index import Orders, judge
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import Limits, Paragraphs, Section, Table
from orchestrator.report.style import Figure, Look
from orchestrator.runs import terminal
from orchestrator.study import methods
from orchestrator.study.fidelities import Fields
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed
from orchestrator.types import Row

FILE = "tables/convergence.csv"
PANEL, LEGEND = 2.2, 1.9
"""Heights of a panel and of the legends of the chart, inches."""
CHANGES = "Change from the mesh and the load steps of the scene, %"
TITLE = "What finer meshes and load steps change"
REFINED = ((1.0, 2.0, 4.0), (0.5, 1.0, 2.0), (0.25, 0.5, 1.0))
"""How many times finer than those of the scene its three meshes are: the first of these
that the scene can have. A first cell must not lie within the roughness."""
ITERATIONS = 0.0027
"""Change of u* that the end of the iterations leaves, relative (docs/flow.md)."""
SCHEMES = Orders(0.5, 2.1)
"""Orders that a flow can have: the convection of U is of second order, that of k and
epsilon of first, as the wall function is."""
STEPS = Orders(0.5, 1.1)
"""Orders that load steps can have: a threshold is known to one of them."""
FIRST = "first motion"
"""Name of the threshold of the first grain, in place of a fraction."""
MEAN_STRESS = "mean stress"
HIGHEST_STRESS = "highest stress"
POWERS = {"ustar0": 1, "tau_c": 2, MEAN_STRESS: 2, HIGHEST_STRESS: 2}
"""The quantities, and with which power of u* each goes: the undisturbed friction
velocity and tau_c of a threshold; the stress on the counted grains, over u*_0^2, its
mean and its largest."""
LABELS = {
    "ustar0": "$u^*_0$",
    "tau_c": "$τ_c$",
    MEAN_STRESS: "mean stress on the counted grains",
    HIGHEST_STRESS: "highest stress on one of them",
}
IN_TEXT = {**LABELS, "ustar0": "u*₀", "tau_c": "τ_c"}
"""The same without the signs of a formula."""
LOOKS = {"ustar0": "-", "tau_c": "--", MEAN_STRESS: ":", HIGHEST_STRESS: "-."}
"""How the quantities are drawn."""
GOOD = ("in the range", "settled")
"""Verdicts of numbers that have settled, or approach a limit."""
OTHER = "0.35"
"""Colour of what is of no threshold."""
ENDS = ("coarse", "medium", "fine")
"""The three meshes."""
KEYS = ["scene_id", "scene", "series", "part", "scene_class", "quantity", "at"]
"""Columns that name a number that three meshes have."""


@dataclass(frozen=True)
class Series:
    """Something that is refined.

    Attributes
    ----------
    name
        Its name.
    part
        Whether it is of the `FLOW` or of the `GRAINS`.
    fields
        The fields of a scene that is so many times finer.
    size
        Size of cells or steps of a scene.
    told
        The number that is refined, in words.
    orders
        The orders that it can have; None where none is expected.
    resolution
        Relative change of u* that is not resolved on a scene, the finest of three.
    """

    name: str
    part: str
    fields: Callable[[Scene, float], Fields]
    size: Callable[[Scene], float]
    told: Callable[[Scene], str]
    orders: Orders | None
    resolution: Callable[[Scene], float]

    def concerns(self, scene: Scene) -> bool:
        """Whether a scene has what is refined.

        Parameters
        ----------
        scene
            The scene, with the method that answers it.

        Returns
        -------
        bool
            Whether its flow is solved, or its grains are moved by DEM.
        """
        if self.part == FLOW:
            return scene.method.flow.facts.is_solved
        return scene.method.facts.is_resolved_in_time

    def refined(self, scene: Scene) -> tuple[tuple[float, Scene], ...]:
        """Make the three scenes, from the coarsest to the finest.

        Parameters
        ----------
        scene
            The scene, with the method that answers it.

        Returns
        -------
        tuple of pairs
            How many times finer than the scene each is, and the scene; empty where none
            of `REFINED` is accepted.
        """
        if self.part == FLOW:
            scene = _without_dem(scene)
        for factors in REFINED:
            with suppress(InputError), warnings.catch_warnings():
                # the effect of what limits warn of is what is wanted
                warnings.simplefilter("ignore")
                made = [changed(scene, self.fields(scene, each)) for each in factors]
                for one in made:
                    limits.check(one, "", grains=self.part == GRAINS)
                return tuple(zip(factors, made, strict=True))
        return ()


def _without_dem(scene: Scene) -> Scene:
    """The scene by a method whose thresholds follow the flow without load steps."""
    if not scene.method.facts.is_resolved_in_time:
        return scene
    is_peeled = methods.PEELING.misfit(scene) is None
    name = methods.PEELING.name if is_peeled else methods.PIVOT.name
    return changed(scene, {"method.kind": name})


def _cells(scene: Scene, finer: float) -> Fields:
    """Cells along the bed and up from it, at the same first cell."""
    cells = round(scene.method.flow.cells_per_face * finer)
    # the default of the first cell is written out
    return {
        "method.flow.cells_per_face": cells,
        "method.flow.first_cell_height": scene.first_cell_height,
    }


def _with_first_cell(scene: Scene, finer: float) -> Fields:
    """All cells, the first ones, too."""
    first = scene.first_cell_height / finer
    return {**_cells(scene, finer), "method.flow.first_cell_height": first}


def _load_steps(scene: Scene, finer: float) -> Fields:
    """Load steps of DEM."""
    step = scene.method.grains.load_increment / finer
    return {"method.grains.load_increment": step}


def _layers(scene: Scene, finer: float) -> Fields:
    """Mobile layers of DEM."""
    layers = round(scene.method.grains.mobile_layers * finer)
    return {"method.grains.mobile_layers": layers}


def _by_iterations(_: Scene) -> float:
    """What a flow does not resolve."""
    return ITERATIONS


def _by_load_step(scene: Scene) -> float:
    """What DEM does not resolve."""
    return scene.method.grains.load_increment


SERIES = (
    Series(
        "mesh",
        FLOW,
        _cells,
        lambda scene: 1 / scene.method.flow.cells_per_face,
        lambda scene: f"{scene.method.flow.cells_per_face} cells",
        SCHEMES,
        _by_iterations,
    ),
    Series(
        "mesh and first cell",
        FLOW,
        _with_first_cell,
        lambda scene: scene.first_cell_height,
        lambda scene: f"{1e3 * scene.first_cell_height:.3g} mm",
        SCHEMES,
        _by_iterations,
    ),
    Series(
        "load steps",
        GRAINS,
        _load_steps,
        lambda scene: scene.method.grains.load_increment,
        lambda scene: f"{100 * scene.method.grains.load_increment:.3g} %",
        STEPS,
        _by_load_step,
    ),
    Series(
        "mobile layers",
        GRAINS,
        _layers,
        lambda scene: 1 / scene.method.grains.mobile_layers,
        lambda scene: number(scene.method.grains.mobile_layers, "layer"),
        None,
        _by_load_step,
    ),
)
"""What is refined."""


class Member(NamedTuple):
    """One of three meshes of a scene.

    Attributes
    ----------
    scene_id
        Id of the scene in the study.
    asked
        The scene, with the method that answers it.
    series
        What is refined.
    finer
        How many times finer than the scene it is.
    scene
        The scene with the finer numbers.
    """

    scene_id: str
    asked: Scene
    series: Series
    finer: float
    scene: Scene

    @property
    def key(self) -> str:
        """Its name in the plan."""
        return f"{self.scene_id} | {self.series.name} | {self.finer:g}"


def chosen(
    study: Study, ids: Sequence[str] = (), *, every: bool = False
) -> dict[str, Scene]:
    """Choose the scenes of a study that are refined.

    Parameters
    ----------
    study
        The study.
    ids
        Ids of scenes, as the tables of the study have them.
    every
        Whether all are.

    Returns
    -------
    dict of str to Scene
        The scenes by their ids, with the method that answers. By default one for each
        class of flow and grains: that with the fewest counted grains.

    Raises
    ------
    InputError
        If the study has no pile, or no pile of an id.
    """
    asked = [one.id for one in study.scenes if isinstance(one.bed, PileBed)]
    found = dict(zip(asked, piles(study), strict=True))
    if every:
        return found
    for one in ids:
        if one not in found:
            known = ", ".join(asked[:3])
            remedy = f"choose one such as {known}: column scene_id of its tables"
            raise InputError(f"no pile has the id {one!r}", study.name, remedy)
    if ids:
        return {one: found[one] for one in ids}
    smallest: dict[tuple[str, str], tuple[float, str]] = {}
    for name, scene in found.items():
        kind = (scene_class(FLOW, scene), scene_class(GRAINS, scene))
        size = (_counted(scene), name)
        smallest[kind] = min(smallest.get(kind, size), size)
    return {name: found[name] for _, name in smallest.values()}


def _counted(scene: Scene) -> float:
    """How many grains are counted, by the length of their bed."""
    assert isinstance(scene.bed, PileBed)
    line = of_bed(scene.bed)
    length = line.lengths[line.counted(scene.bed.counts)].sum()
    return float(length / scene.grain.diameter)


def members(scenes: Mapping[str, Scene]) -> Iterator[Member]:
    """List the meshes of some scenes.

    Parameters
    ----------
    scenes
        The scenes by their ids, with the methods that answer.

    Yields
    ------
    Member
        Three for each scene and each series that it has.
    """
    for name, scene in scenes.items():
        for series in SERIES:
            if series.concerns(scene):
                for finer, refined in series.refined(scene):
                    yield Member(name, scene, series, finer, refined)


class Convergence(Experiment):
    """How far finer meshes and load steps move the thresholds of scenes of a study.

    Parameters
    ----------
    study
        The study.
    out
        Directory of the runs.
    ids, every
        Which scenes, as of `chosen`.

    Raises
    ------
    InputError
        If the study has no pile, or none that has a mesh or load steps.
    """

    name = "convergence"
    title = TITLE
    shares_cases = True

    def __init__(
        self, study: Study, out: Path, ids: Sequence[str] = (), *, every: bool = False
    ) -> None:
        limits.check_study(study)
        scenes = chosen(study, ids, every=every)
        self.members = [*members(scenes)]
        self.of_how_many = len(study.scenes)
        if not self.members:
            what = "no pile has a flow that is solved, or grains that DEM moves"
            remedy = "its closed form has no mesh, and nothing to refine"
            raise InputError(what, study.name, remedy)
        asked = {one.key: as_written(one.scene) for one in self.members}
        super().__init__(plan.of(asked, cases=out.absolute() / "cases"), study)

    def command(self, options: Namespace, out: Path) -> int:
        """Run as every experiment, but say first which scenes, and how long it takes.

        Parameters
        ----------
        options
            The options of the command.
        out
            The directory of the results.

        Returns
        -------
        int
            The exit code.
        """
        scenes = {one.scene_id: label(one.asked) for one in self.members}
        say(f"{len(scenes)} of {number(self.of_how_many, 'scene')} refined:")
        told = (f"  {name}  {words}" for name, words in scenes.items())
        print(*told, sep="\n", file=sys.stderr)
        if not options.plan:
            cases = out.absolute() / "cases"
            listed = plan.expected(self.planned, cases, options.workers)
            print(terminal.fitted(listed), file=sys.stderr)
        return super().command(options, out)

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Judge the numbers that all three meshes have."""
        found = points(self.members, runs)
        if found.empty:
            return None
        judged = judge_all(found)
        if judged.empty:
            return None
        tables = {"points": found, "convergence": judged}
        return ExperimentResults(tables, _sections(found, judged))


def points(listed: Sequence[Member], runs: Runs) -> pd.DataFrame:
    """Read the thresholds on each mesh that is done.

    Parameters
    ----------
    listed
        The meshes.
    runs
        The runs.

    Returns
    -------
    DataFrame
        A row for each mesh and number: how many times finer it is, the size of cells or
        steps, the relative change that is not resolved there, and the value.
    """
    rows = []
    for one in listed:
        if not runs.are_done(one.key):
            continue
        pile = runs.planned.piles[one.key]
        of_mesh = {
            "scene_id": one.scene_id,
            "scene": label(one.asked),
            "series": one.series.name,
            "part": one.series.part,
            "scene_class": scene_class(one.series.part, one.asked),
            "finer": one.finer,
            "size": one.series.size(one.scene),
            "told": one.series.told(one.scene),
            "cost_core_s": _cost(pile, runs, one.series.part),
        }
        resolution = one.series.resolution(one.scene)
        for quantity, at, value in _values(pile, runs.cases, one.series.part):
            unresolved = POWERS[quantity] * resolution
            of_value = {"quantity": quantity, "at": at, "value": value}
            rows.append({**of_mesh, **of_value, "unresolved": unresolved})
    return pd.DataFrame(rows)


def _cost(pile: Pile, runs: Runs, part: str) -> float:
    """Processor time of what is refined, core-s."""
    if part == GRAINS:
        return runs.cpu_s(pile.method.cases)
    return runs.cpu_s([run for flow in pile.model.cases for run in (*flow.needs, flow)])


def _values(pile: Pile, cases: Path, part: str) -> Iterator[tuple[str, str, float]]:
    """The numbers on one mesh: quantity, at which fraction, value."""
    motion = pile.motion(cases)
    _, first = pile.first(motion)
    yield "ustar0", FIRST, first
    for found in pile.thresholds(cases, sorted(pile.scene.threshold.fractions)):
        at = f"{100 * found.fraction:g} %"
        yield "ustar0", at, found.ustar0
        yield "tau_c", at, found.tau
    if part == FLOW:
        stress = np.square(pile.speed(cases)) * np.sign(pile.speed(cases))
        yield MEAN_STRESS, "", float(stress.mean())
        yield HIGHEST_STRESS, "", float(stress.max())


def judge_all(found: pd.DataFrame) -> pd.DataFrame:
    """Judge each number that three meshes have.

    Parameters
    ----------
    found
        The rows of `points`.

    Returns
    -------
    DataFrame
        A row for each: its three values and sizes, the changes between them and from
        the mesh of the scene to the finest, the verdict, and where it is in the range
        order, limit and grid convergence indices of the finest and of the scene's mesh.
    """
    rows = []
    orders = {series.name: series.orders for series in SERIES}
    for keys, rows_of_number in found.groupby(KEYS, sort=False):
        three = rows_of_number.sort_values("finer")
        if len(three) != len(ENDS):
            continue
        name: Any = dict(zip(KEYS, keys, strict=True))
        rows.append({**name, **_judged(three, orders[name["series"]])})
    return pd.DataFrame(rows)


def _judged(three: pd.DataFrame, orders: Orders | None) -> Row:
    """The columns of one number on three meshes, from the coarsest to the finest."""
    coarse, medium, fine = three["value"].astype(float).tolist()
    large, middle, small = three["size"].astype(float).tolist()
    sizes = (large, middle, small)
    floor = float(three["unresolved"].iloc[-1])
    own = float(three.loc[three["finer"] == 1.0, "value"].iloc[0])
    found = judge(sizes, (coarse, medium, fine), orders, floor)
    return {
        **{f"size_{end}": size for end, size in zip(ENDS, sizes, strict=True)},
        "coarse": coarse,
        "medium": medium,
        "fine": fine,
        "own": own,
        "change_medium": _change(coarse, medium),
        "change_fine": _change(medium, fine),
        "own_to_fine": _change(own, fine),
        "unresolved": floor,
        "verdict": found.verdict,
        "why": found.why,
        "order": found.order,
        "limit": found.limit,
        "gci_fine": found.gci(fine),
        "gci_own": found.gci(own),
    }


def _change(before: float, after: float) -> float:
    """Relative change; NaN where there is nothing to compare with."""
    return after / before - 1 if before else math.nan


def _sections(found: pd.DataFrame, judged: pd.DataFrame) -> list[Section]:
    """The page: the card, and each scene with its figure and its table."""
    words = page_texts(__file__, "convergence")
    sections = []
    for place, (name, rows) in enumerate(judged.groupby("scene_id", sort=False), 1):
        # words do not tell every two scenes apart
        title = f"{rows['scene'].iloc[0]}; scene {name}"
        of_scene = found[found["scene_id"] == name]
        drawn = chart_of(of_scene, rows)
        chart = Figure(f"convergence-{place}", CHANGES, words["figure"], (), drawn)
        sections.append(Section(title, [chart, Table(_table(rows), FILE)]))
    limit = Limits([words["limit"]])
    told = Paragraphs(words["method"], "lead")
    head = Section("", [_card(judged)])
    return [head, *sections, Section("How it is found", [told, limit])]


def _table(rows: pd.DataFrame) -> pd.DataFrame:
    """The numbers of a scene, changes and indices in %."""
    verdict = rows["verdict"]
    is_out = rows["verdict"] == "not in the range"
    return pd.DataFrame(
        {
            "refined": rows["series"],
            "number": [
                f"{IN_TEXT[name]} {at}".strip()
                for name, at in zip(rows["quantity"], rows["at"], strict=True)
            ],
            "own to fine, %": _rounded(100 * rows["own_to_fine"]),
            "verdict": verdict.where(~is_out, verdict + ": " + rows["why"]),
            "order": _rounded(rows["order"]),
            "index of the finest, %": _rounded(100 * rows["gci_fine"]),
            "index of the own, %": _rounded(100 * rows["gci_own"]),
            "to medium, %": _rounded(100 * rows["change_medium"]),
            "medium to fine, %": _rounded(100 * rows["change_fine"]),
        }
    )


def _rounded(values: "pd.Series[float]") -> "pd.Series[float]":
    """Values with two digits behind the point: a resolved change is larger."""
    return values.round(2)


def _largest(judged: pd.DataFrame, at: str) -> pd.DataFrame:
    """The row in which u*_0 at a fraction changes most; none where none is known."""
    is_of = (judged["quantity"] == "ustar0") & (judged["at"] == at)
    rows = judged[is_of].dropna(subset=["own_to_fine"])
    return rows.sort_values("own_to_fine", key=abs).tail(1)


def _card(judged: pd.DataFrame) -> Card:
    """The answer card: what first motion and the first fraction are worth."""
    fractions = [at for at in dict.fromkeys(judged["at"]) if at not in (FIRST, "")]
    numbers = []
    for at in (FIRST, *fractions[:1]):
        for row in _largest(judged, at).to_dict("records"):
            what = at if at == FIRST else f"threshold of {at}"
            meaning = f"change of u*₀ from the scene’s mesh to the finest, {what}"
            note = f"the largest, by {row['series']}; {row['verdict']}"
            value = 100 * row["own_to_fine"]
            numbers.append(Number(value, "%", meaning, note, decimals=1))
    is_threshold = judged["quantity"].isin(["ustar0", "tau_c"])
    verdicts = judged.loc[is_threshold, "verdict"]
    good = int(verdicts.isin(GOOD).sum())
    numbers.append(
        Number.counted(
            good,
            len(verdicts),
            "thresholds have converged, or approach a limit",
            "the others have no order of convergence",
        )
    )
    count = judged["scene_id"].nunique()
    worth = Worth("good", "usable", "The changes are the numerical error of the scene.")
    if good < len(verdicts):
        worth = Worth(
            "care",
            "usable with its change",
            "Where a threshold has no order, quote the change from the mesh of the "
            "scene to the finest; it is no bound of the error.",
        )
    return Card(
        "How far do finer meshes and load steps move the thresholds?",
        f"{number(count, 'scene')}, each on three meshes and with three load steps "
        "where it has them.",
        tuple(numbers),
        "Nothing is measured here: each run is compared with finer ones.",
        worth,
    )


def chart_of(found: pd.DataFrame, judged: pd.DataFrame) -> Canvas:
    """Draw the change of each number of a scene on its meshes.

    Parameters
    ----------
    found
        The rows of `points` of one scene.
    judged
        Those of `judge_all`.

    Returns
    -------
    Canvas
        A panel for each series, with the change from the scene's own mesh.
    """
    verdicts = judged[["series", "quantity", "at", "verdict"]]
    found = found.merge(verdicts, how="left")
    names = list(dict.fromkeys(found["series"]))
    places = [at for at in dict.fromkeys(found["at"]) if at]
    colours = dict(zip(places, style.DIAMETERS, strict=False))
    canvas = style.canvas(PANEL * len(names) + LEGEND, style.NARROW)
    panels = canvas.subplots(len(names), 1, squeeze=False, sharey=True).ravel()
    for ax, name in zip(panels, names, strict=True):
        _panel(ax, found[found["series"] == name], colours)
        ax.set_title(name, loc="left")
        ax.set_ylabel("change, %")
    drawn = set(found["quantity"])
    looks = [
        Line2D([], [], color=OTHER, ls=look, label=LABELS[name])
        for name, look in LOOKS.items()
        if name in drawn
    ]
    mark: Look = {"ls": "", "marker": "o", "ms": 4, "color": OTHER}
    if not set(verdicts["verdict"]) <= set(GOOD):
        looks.append(Line2D([], [], mfc="white", label="open: no order", **mark))
    entries = [style.entry(*each) for each in colours.items()]
    canvas.legend(handles=entries, loc="outside upper left", ncols=2)
    canvas.legend(handles=looks, loc="outside lower left")
    return canvas


def _panel(ax: Axes, rows: pd.DataFrame, colours: Mapping[str, str]) -> None:
    """Draw the numbers of one series as their changes from the scene's own mesh."""
    for (quantity, at), of_number in rows.groupby(["quantity", "at"], sort=False):
        rising = of_number.sort_values("finer")
        own = rising.loc[rising["finer"] == 1.0, "value"].sum()
        if own:
            change = 100 * (rising["value"] / own - 1)
            colour = colours.get(str(at), OTHER)
            is_good = rising["verdict"].iloc[0] in GOOD
            look: Look = {"ls": LOOKS[str(quantity)], "marker": "o", "ms": 3.5}
            look |= {"color": colour, "mfc": colour if is_good else "white"}
            ax.plot(rising["finer"], change, gid="number", **look)
    ax.axhline(0.0, color="0.2", lw=0.6)
    told = rows.drop_duplicates("finer").sort_values("finer")
    ax.set_xscale("log", base=2)
    ax.set_xticks(told["finer"], told["told"])
    ax.minorticks_off()
