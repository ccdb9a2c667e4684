"""The ladder: what each rung costs, and how far its thresholds are from the reference.

The rungs of the grains are run on the flow of the reference, those of the flow with the
grains by peeling, so that each error is that of one part; the fidelities, which have
one rung of each, show that the errors add up.
"""

import math
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from adjustText import adjust_text
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke
from matplotlib.text import Text

from orchestrator import plan
from orchestrator.bed.line import of_bed
from orchestrator.experiment import (
    Experiment,
    Results,
    Runs,
    label,
    page_texts,
    piles,
)
from orchestrator.fidelity import domain, limits, spread
from orchestrator.fidelity.classes import FLOW, GRAINS, LEVEL_BED, scene_class
from orchestrator.fidelity.decision import Decision, on_fidelity
from orchestrator.fidelity.fidelities import (
    FIDELITIES,
    FLAT,
    REFERENCE,
    Fidelity,
    Rung,
    packing,
)
from orchestrator.grains.loads import forget
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import of_pile
from orchestrator.lab import calibration
from orchestrator.report import style
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import Limits, Paragraphs, Section, Table
from orchestrator.report.style import Figure, Look
from orchestrator.runs.case import Case
from orchestrator.study.criterion import ENTRAINED
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed
from orchestrator.tables.rows import point
from orchestrator.types import FloatArray, Row


def _rungs() -> dict[str, tuple[Rung, ...]]:
    """The rungs of each part: those of its file, and those of the fidelities."""
    path = Path(__file__).with_name("rungs.toml")
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    flow = [Rung(**row) for row in data[FLOW]]
    grains = [Rung(**row) for row in data[GRAINS]]
    return {
        FLOW: (FLAT, *flow, *(one.flow for one in FIDELITIES)),
        GRAINS: (*grains, *(one.grains for one in FIDELITIES)),
    }


RUNGS = _rungs()
"""All rungs, by the part of a pile that they answer."""
PEELING = next(one.grains for one in FIDELITIES if one.name == "static")
"""Rung of the grains beside which those of the flow are measured."""
AGAIN = "soft reference"
"""Rung of the grains as good as the reference, with all of its numbers changed."""
FINER = "finest"
"""The same of the flow."""
REFERENCES = (
    ((REFERENCE.name, REFERENCE.name), (REFERENCE.name, AGAIN)),
    ((FLAT.name, REFERENCE.name), (FLAT.name, AGAIN)),
    ((REFERENCE.name, PEELING.name), (FINER, PEELING.name)),
)
"""The reference of a scene is the first of these pairs that it has (over a level bed no
flow is solved); beside it stands a pair as good with all of its numbers changed: the
uncertainty."""
MOST_WHOLE = 24
"""Most exposed grains of piles on which whole fidelities are run."""
CURVE = np.arange(0.05, 0.76, 0.05)
"""Fractions at which whole curves are compared."""
HEADS = {
    "error_10": "$n/N$ = 10 %",
    "error_30": "$n/N$ = 30 %",
    "error_50": "$n/N$ = 50 %",
    "error_70": "$n/N$ = 70 %",
    "error_curve": "whole curve",
}
"""Heads of the columns of errors."""
AT_FRACTIONS = ["error_10", "error_30", "error_50", "error_70"]
"""Those of them at single fractions."""
COLUMN_HEADS = {
    **{name: f"{name.removeprefix('error_')} %" for name in HEADS},
    "flow_rung": "flow",
    "grain_rung": "grains",
    "scene_class": "scene class",
    "cost_core_s": "core-s",
}
"""Heads of the columns of the tables of the page."""
KNOWN_BY = ["part", "rung", "scene_class", "fraction"]
"""Columns by which known errors are looked up."""
PAIR = ["flow_rung", "grain_rung"]
"""Columns that name a pair of rungs."""
FLOOR = 1e-3
"""Relative errors below it are drawn on it."""
TOLERANCES = (0.05, 0.2)
"""Relative errors at which a panel has a line."""
BANDS = (
    ("error of the reference itself", "0.88"),
    ("the model's own spread: better numerics buy nothing", "#fdf3dc"),
)
MARKS: Mapping[str, Look] = {
    "threshold too high": {"marker": "^", "mfc": "0.2"},
    "threshold too low": {"marker": "v", "mfc": "0.2"},
    "open: another model": {"marker": "^", "mfc": "white"},
}
METHODS = {"quick": "#009e73", "static": "#d55e00", "DEM": "#0072b2"}
FRONT: Look = {"color": "0.25", "lw": 0.9, "zorder": 1.5}


class Ladder(Experiment):
    """What each rung costs and how far it is off.

    Parameters
    ----------
    study
        The study with the piles.
    out
        The directory.
    """

    name = "ladder"
    title = "Speed against accuracy"

    def __init__(self, study: Study, out: Path) -> None:
        limits.check_study(study)
        self.pairs = decisions(study)
        super().__init__(plan.of(self.pairs, cases=out.absolute() / "cases"), study)

    def results(self, runs: Runs) -> Results | None:
        """Compare the pairs of rungs whose runs are done."""
        measured = points(self.pairs, runs)
        if measured.empty:
            return None
        compared = errors(measured)
        if compared.empty:
            return None
        means = join_points(compared)
        rows = compared.merge(means[["packing", *PAIR, "pareto"]], how="left")
        rows = rows.fillna({"pareto": False})
        known = known_errors(measured)
        done = [pair for key, pair in self.pairs.items() if runs.are_done(key)]
        tables = {"points": rows, "errors": known, "domain": measured_domain(done)}
        return Results(tables, _sections(means, known))


def decisions(study: Study) -> dict[str, Decision]:
    """Decide on the pairs of rungs that each pile of a study is run on.

    Parameters
    ----------
    study
        The study.

    Returns
    -------
    dict of str to Decision
        A decision for each pile and pair, by names for the plan.
    """
    why = "the ladder measures these rungs"
    chosen = {}
    for scene, bed in piles(study).items():
        for pair in _pairs(scene, bed):
            chosen[f"{scene.id} | {pair.name}"] = on_fidelity(scene, pair, why)
    return chosen


def _pair(flow: Rung, grains: Rung) -> Fidelity:
    """The fidelity of two rungs."""
    name = f"{flow.name} | {grains.name}"
    return Fidelity(name, "", flow, grains)


def _pairs(scene: Scene, bed: PileBed) -> Iterator[Fidelity]:
    """The pairs of rungs that are measured on a pile."""
    line = of_bed(bed)
    exposed = line.lengths[line.counted(bed.counts)].sum() / scene.grain.diameter - 1e-6

    def taken(part: str) -> list[Rung]:
        rungs = [rung for rung in RUNGS[part] if exposed <= rung.most_grains]
        return [rung for rung in rungs if rung.takes(scene)]

    # over a level bed and on a bed in space no rung of the flow can be measured
    is_solved = not (bed.is_level or bed.width)
    if is_solved:
        for flow in taken(FLOW):
            yield _pair(flow, PEELING)
    if not scene.method.is_resolved_in_time:
        return
    best = REFERENCE.flow
    if bed.is_level:
        best = FLAT
    for grains in taken(GRAINS):
        yield _pair(best, grains)
    if is_solved and exposed <= MOST_WHOLE:
        for one in FIDELITIES:
            if one.takes(scene):
                yield _pair(one.flow, one.grains)


def points(pairs: Mapping[str, Decision], runs: Runs) -> pd.DataFrame:
    """Measure the pairs of rungs whose runs are done.

    Parameters
    ----------
    pairs
        The decisions, by `decisions`.
    runs
        The runs.

    Returns
    -------
    DataFrame
        A row for each scene and pair that is done: cost, core-s, and thresholds, Pa.
    """
    rows = []
    for key, decision in pairs.items():
        pair = decision.fidelity
        if pair and runs.are_done(key):
            pile = runs.planned.piles[key]
            count = pile.motion(runs.cases).count
            row = {
                **_about(decision.asked, pair, count),
                **_costs(pile, runs),
                **_thresholds(decision.asked, pile, runs.cases),
            }
            rows.append(row)
    return pd.DataFrame(rows)


def _about(scene: Scene, pair: Fidelity, count: int) -> Row:
    """The columns of a point about its scene, its pair and the number of its grains."""
    assert isinstance(scene.bed, PileBed)
    packed = packing(scene)
    if scene.bed.is_level:
        packed += ", level bed"
    floor = spread.floors().get(spread.model_class(scene))
    return {
        "scene_id": scene.id,
        "scene": label(scene),
        **point(scene),
        "packing": packed,
        "geometry": geometry(scene, scene.bed),
        "pile": changed(scene, {"threshold.criterion": ENTRAINED}).id,
        "in_time": scene.method.is_resolved_in_time,
        **{f"class_{part}": scene_class(part, scene) for part in RUNGS},
        "count": count,
        "flow_rung": pair.flow.name,
        "grain_rung": pair.grains.name,
        "same_model": pair.flow.same_model and pair.grains.same_model,
        "model_floor": floor.error if floor else math.nan,
    }


def _costs(pile: Pile, runs: Runs) -> Row:
    """The columns of a point about its cost, core-s."""
    here_s = 0.0
    if not pile.method.cases:
        here_s = time_alone_s(pile, runs.cases)
    flows: list[Case] = []
    for flow in pile.model.cases:
        flows += [*flow.needs, flow]
    return {
        "flow_s": runs.cpu_s(flows),
        "grains_s": here_s + runs.cpu_s(pile.method.cases),
    }


def _thresholds(scene: Scene, pile: Pile, cases: Path) -> Row:
    """The columns of a point with its thresholds, Pa."""
    motion = pile.motion(cases)
    speed = pile.speed(cases)
    names = {f"tau_{at:g}": at for at in scene.threshold.fractions}
    names |= {f"curve_{at:.2f}": at for at in CURVE.tolist()}
    row: Row = {}
    for name, at in names.items():
        row[name] = of_pile(motion, speed, at, scene.fluid.density).tau
    return row


def time_alone_s(pile: Pile, cases: Path) -> float:
    """Measure the time in which the grains of a pile move without a run of DEM.

    It is the time of this pile alone: a packing or a threshold that another pile needed
    before is found again.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished runs.

    Returns
    -------
    float
        Time of one core, s.
    """
    forget()
    alone = Pile(pile.scene, pile.cases)
    started = time.process_time()
    alone.motion(cases)
    return time.process_time() - started


def errors(points: pd.DataFrame) -> pd.DataFrame:
    """Compare points with the reference that their scene has.

    Parameters
    ----------
    points
        The points, by `points`.

    Returns
    -------
    DataFrame
        The points of scenes with a reference, with their relative errors, and with
        `reference_error`: how far the reference itself moved when all of its numbers
        were changed.
    """
    parts = [points.iloc[:0]]
    for _, scene in points.groupby("scene_id", sort=False):
        rows = scene.set_index(PAIR)
        for best, again in REFERENCES:
            if best in rows.index:
                compared = _compared(rows, best, again)
                new = compared.columns.difference(scene.columns)
                parts.append(compared.reset_index()[[*scene, *new]])
                break
    return pd.concat(parts, ignore_index=True)


def _compared(
    rows: pd.DataFrame, best: tuple[str, str], again: tuple[str, str]
) -> pd.DataFrame:
    """The points of a scene, by their pairs, with their errors."""
    taus = rows.filter(regex="^tau_").astype(float)
    taus = taus.div(taus.xs(best)).sub(1)
    curve = rows.filter(regex="^curve_").astype(float)
    curve = curve.div(curve.xs(best)).sub(1)
    columns: dict[str, Any] = {}
    for name in taus:
        percent = round(100 * float(str(name).removeprefix("tau_")))
        columns[f"error_{percent}"] = taus[name]
    columns["error_curve"] = curve.abs().mean(axis=1)
    columns["cost_core_s"] = rows["flow_s"] + rows["grains_s"]
    columns["reference_error"] = math.nan
    if again in rows.index:
        columns["reference_error"] = taus.xs(again).abs().max()
    return rows.assign(**columns)


def join_points(points: pd.DataFrame) -> pd.DataFrame:
    """Put the points of each pair and packing together.

    Parameters
    ----------
    points
        The points with their errors, by `errors`.

    Returns
    -------
    DataFrame
        A row for each pair and packing: the mean cost and the largest signed errors.
        `pareto` marks the pairs that no other of their packing and model beats in both,
        by the largest error over the four fractions; a pair that did not reach one is
        left out.
    """

    def largest(values: pd.Series) -> float:
        if values.isna().any():
            return math.nan
        return float(max(values, key=abs))

    rows = points[points["in_time"]].groupby(["packing", *PAIR], sort=False)
    columns: dict[str, Any] = {
        "piles": ("scene_id", "size"),
        "cost_core_s": ("cost_core_s", "mean"),
        **{name: (name, largest) for name in HEADS},
        "reference_error": ("reference_error", "max"),
        "model_floor": ("model_floor", "min"),
        "same_model": ("same_model", "first"),
    }
    table: pd.DataFrame = rows.agg(**columns).reset_index()
    each = table[AT_FRACTIONS].to_numpy(float)
    worst = each[np.arange(len(each)), np.nan_to_num(np.abs(each)).argmax(axis=1)]
    is_whole = np.isfinite(each).all(axis=1)
    table = table.assign(largest=np.where(is_whole, worst, math.nan), pareto=False)
    for _, alike in table[is_whole & table["same_model"]].groupby("packing"):
        values = alike[["cost_core_s", "largest"]].abs().to_numpy(float)
        table.loc[alike.index, "pareto"] = [
            not _is_beaten(row, values) for row in values
        ]
    return table


def _is_beaten(row: FloatArray, others: FloatArray) -> bool:
    """Whether one of some rows is as good in all columns, and better in one."""
    as_good = (others <= row).all(axis=1)
    better = (others < row).any(axis=1)
    return bool(np.any(as_good & better))


def known_errors(points: pd.DataFrame) -> pd.DataFrame:
    """Find the numerical error of each rung, by class and fraction.

    Parameters
    ----------
    points
        The points, by `points`.

    Returns
    -------
    DataFrame
        A row for each part, rung, class and fraction, as `fidelity.measured` reads it.
        The uncertainty is how far the reference itself moved; empty where the reference
        was not run with other numbers.
    """
    again = {GRAINS: AGAIN, FLOW: FINER}
    return calibration.table(scene_errors(points), again)


def scene_errors(points: pd.DataFrame) -> pd.DataFrame:
    """Find the error of each rung on each pile.

    Parameters
    ----------
    points
        The points, by `points`.

    Returns
    -------
    DataFrame
        A row for each part, rung, pile and fraction: the relative difference from the
        reference, infinite where only one of rung and reference reached the fraction,
        zero where neither did. Scenes that share their runs, since they differ in the
        criterion of motion alone, are one pile; the larger of their errors counts.
    """
    beside = np.where(points["class_flow"] == LEVEL_BED, FLAT.name, REFERENCE.name)
    grains = points[(points["flow_rung"] == beside) & points["in_time"]]
    flow = points[(points["grain_rung"] == PEELING.name) & points["same_model"]]
    # over a level bed no flow is solved, and no rung of it has an error
    flow = flow[flow["class_flow"] != LEVEL_BED]
    tables = [
        _scene_errors(grains, GRAINS, "grain_rung"),
        _scene_errors(flow, FLOW, "flow_rung"),
    ]
    return pd.concat(tables, ignore_index=True)


def measured_domain(pairs: Iterable[Decision]) -> pd.DataFrame:
    """Find over which scenes the known errors of some pairs of rungs were measured.

    They are the scenes of which the reference is there.

    Parameters
    ----------
    pairs
        The pairs, by `decisions`, whose runs are done.

    Returns
    -------
    DataFrame
        The domain of each class, by `domain.of`.
    """
    scenes: dict[str, list[Scene]] = {FLOW: [], GRAINS: []}
    for decision in pairs:
        scene = decision.asked
        pair = decision.fidelity
        assert pair is not None
        if (pair.flow, pair.grains) == (REFERENCE.flow, PEELING):
            scenes[FLOW].append(scene)
        best = pair.flow_over(scene) in (REFERENCE.flow, FLAT)
        in_time = scene.method.is_resolved_in_time
        if best and pair.grains is REFERENCE.grains and in_time:
            scenes[GRAINS].append(scene)
    return domain.of(scenes)


def _scene_errors(table: pd.DataFrame, part: str, rung: str) -> pd.DataFrame:
    """The errors of each rung of a part of piles; `rung` is its column."""
    names = {rung: "rung", f"class_{part}": "scene_class", f"{part}_s": "cost_core_s"}
    rows = table.rename(columns=names).assign(part=part)
    taus = [name for name in table if str(name).startswith("tau_")]
    about = ["scene_class", "pile", "geometry", "cost_core_s"]
    rows = rows.melt(["scene_id", "part", "rung", *about], taus, "fraction", "tau")
    is_best = rows["rung"] == REFERENCE.name
    base = rows.loc[is_best, ["scene_id", "fraction", "tau"]]
    rows = rows.merge(base, on=["scene_id", "fraction"], suffixes=("", "_best"))
    error = (rows["tau"] / rows["tau_best"] - 1).fillna(math.inf)
    neither = rows["tau"].isna() & rows["tau_best"].isna()
    rows["error"] = error.mask(neither, 0.0)
    rows["fraction"] = rows["fraction"].str.removeprefix("tau_").astype(float)
    columns = ["part", "rung", "fraction", *about, "error"]
    largest = rows["error"].abs().sort_values(kind="stable").index
    one = ["part", "rung", "fraction", "scene_class", "pile"]
    return rows.loc[largest, columns].drop_duplicates(one, keep="last").sort_index()


def geometry(scene: Scene, bed: PileBed) -> str:
    """Name the geometry of a pile: what beds of other fluids and grains share.

    Parameters
    ----------
    scene
        The scene.
    bed
        Its bed.

    Returns
    -------
    str
        Its form, its slope and its height in grains; of a poured bed the draw, too.
    """
    height = (bed.relief or bed.level_length) / scene.grain.diameter
    words = [bed.shape_name, f"{bed.slope_deg:g}°", f"{height:.3g} d"]
    if scene.is_poured:
        words.append(f"seed {bed.seed}")
    return ", ".join(words)


def _sections(pairs: pd.DataFrame, known: pd.DataFrame) -> list[Section]:
    """The sections of the page."""
    words = page_texts(__file__, "ladder")
    charts = [
        Figure(
            "speed-against-accuracy",
            "Cost against error",
            words["largest"],
            (),
            chart(pairs, {"largest": ""}),
        ),
        Figure(
            "error-at-fractions",
            "The error at each fraction",
            words["fractions"],
            (),
            chart(pairs, HEADS),
        ),
    ]
    means = pairs_table(pairs)
    title = "The rungs, and what is known of them"
    of_rungs = _tables_of_rungs(known)
    accuracy = Paragraphs(words["accuracy"], "lead")
    rungs = Paragraphs(words["rungs"], "lead")
    limit = Limits([words["limit"]])
    return [
        Section("", [_card(_of_most_piles(pairs))]),
        Section("Speed against accuracy", [*charts, accuracy, Table.of(means)]),
        Section(title, [rungs, limit, *map(Table.of, of_rungs)]),
    ]


def pairs_table(pairs: pd.DataFrame) -> pd.DataFrame:
    """List the pairs of rungs with their numbers in the charts, costs and errors.

    Parameters
    ----------
    pairs
        The pairs, by `join_points`.

    Returns
    -------
    DataFrame
        A row for each packing and pair, by rising cost; errors in %.
    """
    percent = 100 * pairs[[*HEADS]]
    means = pairs.assign(number=_numbers(pairs), **percent)
    means = means.sort_values(["packing", "cost_core_s"])
    means = means[["number", "packing", *PAIR, "piles", "cost_core_s", *HEADS]]
    return means.rename(columns=COLUMN_HEADS)


def _numbers(pairs: pd.DataFrame) -> Any:
    """The number of each pair of rungs, in the figures and in the table."""
    names = pairs["flow_rung"] + ", " + pairs["grain_rung"]
    return pd.factorize(names)[0] + 1


def _of_most_piles(pairs: pd.DataFrame) -> pd.DataFrame:
    """The pairs of rungs of the packing that most piles have.

    Packings have different pairs: over a level bed no flow is solved.
    """
    packing = pairs.groupby("packing")["piles"].max().idxmax()
    return pairs[pairs["packing"] == packing]


def _card(pairs: pd.DataFrame) -> Card:
    """The answer card of one packing: what the cheapest models within errors cost."""
    alike = pairs[pairs["same_model"]]
    each = alike.assign(largest=alike["largest"].abs()).groupby(PAIR, sort=False)
    worst = each["largest"].max()
    cost = each["cost_core_s"].mean()
    numbers = []
    for tolerance in TOLERANCES:
        within = cost[worst <= tolerance]
        if within.empty:
            continue
        flow, grains = within.sort_values().index.tolist()[0]
        meaning = f"of one core for a pile within {100 * tolerance:g} %"
        note = f"flow by “{flow}”, grains by “{grains}”"
        numbers.append(Number(float(within.min()), "s", meaning, note))
    best = (REFERENCE.name, REFERENCE.name)
    if best in cost.index:
        meaning = "of one core for the reference"
        off = 100 * float(pairs["reference_error"].max())
        note = ""
        if math.isfinite(off):
            note = f"other numbers of its own move it by up to {off:.2g} %"
        numbers.append(Number(float(cost[best]), "s", meaning, note))
    count = int(pairs["piles"].max())
    piles_ = "pile" if count == 1 else "piles, each"
    return Card(
        "How much computing time does a threshold need, by how far off it may be?",
        f"{count} {piles_} by {len(worst)} pairs of models for flow and grains; "
        f"{pairs['packing'].iloc[0]} packing.",
        tuple(numbers),
        "Nothing is measured here: errors are those from the most costly models, the "
        "reference, at 10, 30, 50 and 70 % of the grains.",
        Worth(
            "good",
            "usable",
            "These errors are of these piles. A tolerance in a study file chooses by "
            "those that the package has, from the preset `ladder`. To answer by a pair "
            "of this page, write its numbers under `[method]`.",
        ),
    )


def _tables_of_rungs(known: pd.DataFrame) -> list[pd.DataFrame]:
    """What each rung is, and its known errors, %."""
    rows = []
    for part, rungs in RUNGS.items():
        rows += [(part, each.name, each.meaning) for each in rungs]
    meanings = pd.DataFrame(rows, columns=["part", "rung", "what it is"])
    order = {name: place for place, name in enumerate(meanings["rung"])}
    index = ["part", "scene_class", "rung", "scenes", "cost_core_s"]
    errors = 100 * known.set_index([*index, "fraction"])["error"]
    table = errors.unstack("fraction").rename(columns="{:.0%}".format)
    table = table.sort_index(
        level=index[:3],
        key=lambda keys: keys.map(order) if keys.name == "rung" else keys,
    )
    return [meanings, table.reset_index().rename(columns=COLUMN_HEADS)]


def chart(pairs: pd.DataFrame, columns: Mapping[str, str]) -> Canvas:
    """Draw errors against cost: a row of panels for each packing.

    A single column has the number of every pair, the front and its names; several have
    the numbers on the front.

    Parameters
    ----------
    pairs
        The pairs, by `join_points`.
    columns
        Heads of the panels by the columns of errors, one panel for each.

    Returns
    -------
    Figure
        The chart.
    """
    is_single = len(columns) == 1
    names = pairs["flow_rung"] + ", " + pairs["grain_rung"]
    colours = pairs["grain_rung"].map(METHODS).fillna(METHODS["DEM"])
    table = pairs.assign(name=names, number=_numbers(pairs), colour=colours)
    packings = [rows for _, rows in table.groupby("packing", sort=False)]
    of_row = 2.6 if is_single else 1.7
    height = of_row * len(packings) + 1.2
    canvas = style.canvas(height)
    grid = canvas.subplots(
        len(packings), len(columns), sharex=True, sharey=True, squeeze=False
    )
    tags = []
    for axes, rows in zip(grid, packings, strict=True):
        tags += _row_of_panels(axes, rows, columns)
    for ax in grid.ravel():
        ax.set(xscale="log", yscale="log", ylim=(FLOOR / 1.5, None))
        ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g}")
        for tolerance in TOLERANCES:
            ax.axhline(tolerance, color="0.45", lw=0.7, ls=(0, (4, 2)), zorder=1)
    grid[-1, len(columns) // 2].set_xlabel("cost, s of one core")
    samples = _samples(has_front=is_single)
    style.legends(canvas, [style.entry(*method) for method in METHODS.items()], samples)
    canvas.draw_without_rendering()  # labels are placed in a finished layout
    for ax, texts in tags:
        _place(ax, texts)
    return canvas


def _row_of_panels(
    axes: Sequence[Axes], rows: pd.DataFrame, columns: Mapping[str, str]
) -> list[tuple[Axes, list[Text]]]:
    """Draw the panels of a packing; return the labels of each."""
    is_single = len(columns) == 1
    title = f"{rows['packing'].iloc[0]} packing"
    aligned: Literal["left", "center"] = "center"
    axes[0].set_ylabel(f"{title}\nerror of $θ_c$, %")
    if is_single:
        aligned = "left"
        axes[0].set_ylabel("largest error of $θ_c$, %")
    ends = [rows["reference_error"].max(), rows["model_floor"].min()]
    tags = []
    for ax, (column, head) in zip(axes, columns.items(), strict=True):
        ax.set_title(head or title, loc=aligned)
        for number, (end, (_, colour)) in enumerate(zip(ends, BANDS, strict=True)):
            order = 0.2 - number / 10
            ax.axhspan(0, np.nan_to_num(end), color=colour, lw=0, zorder=order)
        tags.append((ax, _points(ax, rows, column, named=is_single)))
    return tags


def _samples(*, has_front: bool) -> list[Artist]:
    """Samples for the legend: marks, bands and the front."""
    samples: list[Artist] = []
    mark: Look = {"ls": "", "ms": 5, "mec": "0.2", "mew": 0.9}
    for text, look in MARKS.items():
        samples.append(Line2D([], [], label=text, **mark, **look))
    for text, colour in BANDS:
        samples.append(Patch(label=text, color=colour, lw=0))
    if has_front:
        text = "no pair of rungs is cheaper and better"
        samples.append(Line2D([], [], label=text, **FRONT))
    return samples


def _place(ax: Axes, texts: list[Text]) -> None:
    """Move the labels of a panel apart."""
    arrow = {"arrowstyle": "-", "lw": 0.4, "color": "0.5"}
    room = {"expand": (1.15, 1.4), "iter_lim": 100}
    if texts:
        x, y = np.transpose([text.get_position() for text in texts])
        adjust_text(texts, x, y, ax=ax, arrowprops=arrow, **room)
    for text in texts:
        text.set_in_layout(False)


def _points(ax: Axes, rows: pd.DataFrame, column: str, *, named: bool) -> list[Text]:
    """Draw the points of a panel, and the front; return their labels."""
    shown = rows[(rows["cost_core_s"] > 0) & rows[column].notna()]
    shown = shown.assign(y=shown[column].abs().clip(lower=FLOOR))
    halo = [Stroke(linewidth=1.8, foreground="white"), Normal()]
    look: Look = {"fontsize": 5.5, "color": "0.1", "zorder": 5, "path_effects": halo}
    if named:
        look["fontsize"] = 6.0
    mark: Look = {"gid": "point", "zorder": 3, "ms": 5, "mew": 0.9}
    tags: list[Text] = []
    each: Any = shown.itertuples(index=False)
    for row in each:
        shape = "v" if getattr(row, column) < 0 else "^"
        face = row.colour if row.same_model else "white"
        mark |= {"marker": shape, "mfc": face, "mec": row.colour}
        ax.plot(row.cost_core_s, row.y, **mark)
        text = str(row.number)
        if named and row.pareto:
            text += f": {row.name}"
        if named or row.pareto:
            tags.append(ax.text(row.cost_core_s, row.y, text, **look))
    if named:
        front = shown[shown["pareto"]].sort_values("cost_core_s")
        ax.step(front["cost_core_s"], front["y"], where="post", **FRONT)
    return tags
