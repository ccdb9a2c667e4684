"""The ladder: what each rung costs, and how far its thresholds are from the reference.

The rungs of the grains are run on the flow of the reference, those of the flow with the
grains by peeling, so that each error is that of one part; the fidelities, which have
one rung of each, show that the errors add up.
"""

import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import plan
from orchestrator.bed.line import of_bed
from orchestrator.digits import number, percent
from orchestrator.experiment import (
    Experiment,
    ExperimentResults,
    Runs,
    label,
    page_texts,
    piles,
)
from orchestrator.fidelity import domain, limits, spread
from orchestrator.fidelity.classes import BY_DEM, FLOW, GRAINS, LEVEL_BED, scene_class
from orchestrator.fidelity.decision import Decision, on_fidelity
from orchestrator.fidelity.fidelities import (
    FIDELITIES,
    FLAT,
    REFERENCE,
    Fidelity,
    Rung,
    packing,
)
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import of_pile
from orchestrator.lab import calibration, chart, choices
from orchestrator.lab.timing import time_alone_s
from orchestrator.report.page import Limits, Paragraphs, Section, Table
from orchestrator.runs.case import Case
from orchestrator.study.criterion import ENTRAINED
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed
from orchestrator.tables.quantities import point
from orchestrator.types import Row


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
AGAIN_OF = {GRAINS: AGAIN, FLOW: FINER}
"""Both, by the part."""
REFERENCES = (
    ((REFERENCE.name, REFERENCE.name), (REFERENCE.name, AGAIN)),
    ((FLAT.name, REFERENCE.name), (FLAT.name, AGAIN)),
    ((REFERENCE.name, PEELING.name), (FINER, PEELING.name)),
)
"""The reference of a scene is the first of these pairs that it has (over a level bed no
flow is solved); beside it stands a pair as good with all of its numbers changed: the
uncertainty."""
CURVE = np.arange(0.05, 0.76, 0.05)
"""Fractions at which whole curves are compared."""
COLUMN_HEADS = {
    "scene_class": "scene class",
    "cost_core_s": "core-s",
}
"""Heads of the columns of the tables of the page."""
PAIR = ["flow_rung", "grain_rung"]
"""Columns that name a pair of rungs."""


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
        self.kinds = choices.kinds(study)
        self.study = study.name
        asked = dict(self.pairs)
        for kind in self.kinds:
            asked |= kind.decisions
        super().__init__(plan.of(asked, cases=out.absolute() / "cases"), study)

    @property
    def outline(self) -> Sequence[str]:
        """Say which choices are charted, of which scenes."""
        lines = []
        for kind in self.kinds:
            scenes = number(len(kind.scenes), "pile")
            thresholds = sum(len(one.threshold.fractions) for one in kind.scenes)
            pairs = sum(bool(one.fields) for one in kind.choices)
            lines.append(
                f"{kind.name}: {scenes}, {number(thresholds, 'threshold')}, by "
                f"{number(pairs, 'pair')} of flow and grains and "
                f"{number(len(choices.TOLERANCES), 'tolerance')}, against the reference"
            )
        return lines

    def results(self, runs: Runs) -> ExperimentResults | None:
        """Compare the pairs of rungs whose runs are done."""
        measured = points(self.pairs, runs)
        if measured.empty:
            return None
        compared = rung_errors(measured)
        if compared.empty:
            return None
        known = numerical_errors(measured)
        done = [pair for key, pair in self.pairs.items() if runs.are_done(key)]
        shares = choices.shares(self.kinds, runs)
        tables = {
            "shares": shares,
            "points": compared,
            "scene_errors": scene_errors(measured),
            "errors": known,
            "domain": measured_domain(done),
        }
        charts = chart.sections(self.kinds, shares, self.study)
        return ExperimentResults(tables, [*charts, _section(known)])


def decisions(study: Study) -> dict[str, Decision]:
    """Decide on the pairs of rungs that each pile of a study is run on.

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


def rung_errors(points: pd.DataFrame) -> pd.DataFrame:
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


def numerical_errors(points: pd.DataFrame) -> pd.DataFrame:
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
    return calibration.half_widths(scene_errors(points), AGAIN_OF)


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
    flow = points[points["grain_rung"] == PEELING.name]
    # over a level bed no flow is solved, and no rung of it has an error
    flow = flow[flow["class_flow"] != LEVEL_BED]
    tables = [
        _scene_errors(grains, GRAINS, "grain_rung"),
        _scene_errors(flow, FLOW, "flow_rung"),
    ]
    return pd.concat(tables, ignore_index=True)


def measured_domain(
    pairs: Iterable[Decision], beside: Iterable[Scene] = ()
) -> pd.DataFrame:
    """Find over which scenes the numerical errors of some pairs of rungs were measured.

    They are the scenes of which the reference is there.

    Parameters
    ----------
    pairs
        The pairs, by `decisions`, whose runs are done.
    beside
        Scenes on which pivots and peeling were compared with DEM of other numbers.

    Returns
    -------
    DataFrame
        The domain of each class, by `domain.of`.
    """
    scenes: dict[str, list[Scene]] = {FLOW: [], GRAINS: [*beside], BY_DEM: []}
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
            scenes[BY_DEM].append(scene)
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


def _section(known: pd.DataFrame) -> Section:
    """The section of the page on each rung by itself."""
    words = page_texts(__file__, "ladder")
    rungs = Paragraphs(words["rungs"], "lead")
    limit = Limits([words["limit"]])
    title = "The rungs, and what is known of them"
    return Section(title, [rungs, limit, *map(Table.of, _tables_of_rungs(known))])


def _tables_of_rungs(known: pd.DataFrame) -> list[pd.DataFrame]:
    """What each rung is, and its numerical errors, %."""
    rows = []
    for part, rungs in RUNGS.items():
        rows += [(part, each.name, each.meaning) for each in rungs]
    meanings = pd.DataFrame(rows, columns=["part", "rung", "what it is"])
    order = {name: place for place, name in enumerate(meanings["rung"])}
    index = ["part", "scene_class", "rung", "scenes", "cost_core_s"]
    errors = 100 * known.set_index([*index, "fraction"])["error"]
    table = errors.unstack("fraction").rename(columns=percent)
    table = table.sort_index(
        level=index[:3],
        key=lambda keys: keys.map(order) if keys.name == "rung" else keys,
    )
    return [meanings, table.reset_index().rename(columns=COLUMN_HEADS)]
