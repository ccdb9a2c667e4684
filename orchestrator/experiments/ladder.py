"""The ladder: what each fidelity level costs, and how far its thresholds are from the reference.

The piles of a study are answered on pairs of levels. The levels of the grains are run on the flow
of the reference, those of the flow with the grains by peeling, so that each error is that of one
part; a few pairs as they are used show that the errors add up.

Beside them stands the naive route: a run of the whole pile for each Re*, with every grain mobile,
which settles the bed and holds the flow. It is measured on a small pile with few load steps and
extrapolated: the time of a run is that of a load step, in proportion to the grains, and the runs
are as many as the load steps by which the fast level finds the same curve.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator import plan
from orchestrator.bed.line import of_bed
from orchestrator.errors import InputError
from orchestrator.experiments import experiment
from orchestrator.experiments.experiment import Runs, Tables
from orchestrator.fidelity import calibration, limits
from orchestrator.fidelity.decision import Decision, as_asked, on_levels
from orchestrator.fidelity.levels import (
    FLAT,
    FLOW,
    GRAINS,
    LEVELS,
    PEELING,
    Level,
    Pair,
    changed,
    level,
    packing,
    paper_stiffness,
)
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import of_pile
from orchestrator.pipeline import Finished
from orchestrator.report import document
from orchestrator.report.document import Section
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.tables.scenes import point
from orchestrator.types import Row

FINE, REFERENCE_GRAINS = level("flow", "fine"), level("grains", "reference")
SOFT = level("grains", "soft reference")
REFERENCE = Pair(FINE, REFERENCE_GRAINS)
AGAIN = Pair(FINE, SOFT)
"""The same with every number of the grains' run changed: the uncertainty of the reference."""
LEVEL_REFERENCE, LEVEL_AGAIN = Pair(FLAT, REFERENCE_GRAINS), Pair(FLAT, SOFT)
"""The same over a level bed, over which no flow is solved."""
FLOW_REFERENCE, FINER = Pair(FINE, PEELING), Pair(level("flow", "finest"), PEELING)
REFERENCES = ((REFERENCE, AGAIN), (LEVEL_REFERENCE, LEVEL_AGAIN), (FLOW_REFERENCE, FINER))
"""The reference of a scene is the first of these that it has; beside it one that is as good."""
FAST = level("grains", "1 layer, fast")
USED = tuple(
    Pair(level("flow", flow), level("grains", name))
    for flow, names in {
        "hill": ("pivot", "peeling"),
        "shared": ("peeling",),
        "coarse": ("1 layer, coarse", "1 layer, fast"),
        "standard": ("1 layer, fast", "1 layer, slow"),
    }.items()
    for name in names
)
"""Pairs as they are used together."""
CURVE = np.arange(0.05, 0.86, 0.05)
"""Fractions at which whole curves are compared."""
ERRORS = ("error_10", "error_30", "error_50", "error_70", "error_curve")
WHOLE = level("grains", "full pile, fast")
STEPS = {"protocol.load_increment": 0.2, "protocol.waiting_time": 10.0, "protocol.time_step": 0.2}
"""Few load steps, on which the time of one is measured for the naive route."""
LEVEL_PAIR = ["flow_level", "grain_level"]


def run(study: Study, out: Path, *, workers: int) -> Finished:
    """Measure what each level costs and how far it is off, on the piles of a study.

    Raises
    ------
    InputError
        If the study has no pile that is answered by DEM or is beyond a limit of the methods, or the
        directory cannot be used.
    SolverError
        If a solver is missing.
    OrchestratorError
        If no reference ran to its end.
    """
    limits.check_study(study)
    routes, pairs = naive_routes(small_pile(study)), decisions(study)
    cases = out.absolute() / "cases"
    planned = plan.of({**pairs, **routes}, study.name, cases=cases)

    def make(runs: Runs) -> tuple[Tables, Callable[[], Sequence[Section]]]:
        measured = points(pairs, runs)
        compared = errors(measured)
        if compared.empty:
            raise experiment.nothing_ran(out, "no reference ran to its end: no error is known")
        fast = next(key for key, one in pairs.items() if one.levels and one.levels.grains is FAST)
        tables = {
            "points": with_front(compared),
            "levels": known_errors(measured),
            "naive": naive_costs(list(routes), fast, runs),
        }
        return tables, lambda: _sections(tables)

    title, limit_s = "Speed against accuracy", study.time_limit_s
    return experiment.run("ladder", title, planned, out, make, workers=workers, limit_s=limit_s)


def decisions(study: Study) -> dict[str, Decision]:
    """Every pile of a study on its pairs of levels, by names for the plan."""
    return {
        f"{scene.id} | {pair.text}": on_levels(scene, pair, "the ladder measures these levels")
        for scene in study.scenes
        if isinstance(scene.bed, PileBed)
        for pair in _pairs(scene, scene.bed)
    }


def _pairs(scene: Scene, bed: PileBed) -> Iterator[Pair]:
    line, by_dem = of_bed(bed), scene.protocol.method == "dem"
    exposed = line.lengths[line.counted(bed.counts)].sum() / scene.grain.diameter - 1e-6
    flows, grains = (
        [one for one in levels if one.takes(scene) and exposed <= (one.most_grains or math.inf)]
        for levels in (FLOW, GRAINS)
    )
    # neither over a level bed nor on a bed in space can the levels of the flow be measured
    if bed.is_level or bed.width:
        yield from (Pair(FLAT if bed.is_level else FINE, one) for one in grains if by_dem)
        return
    yield from (Pair(one, PEELING) for one in flows)
    if by_dem:
        yield from (Pair(FINE, one) for one in grains)
        yield from (pair for pair in USED if pair.flow in flows)


def points(pairs: Mapping[str, Decision], runs: Runs) -> pd.DataFrame:
    """A row for each scene and pair whose runs are done: its cost and its thresholds.

    Parameters
    ----------
    pairs : mapping of str to Decision
        As `decisions` gives them.
    runs : Runs
        Of the same scenes.
    """
    rows = []
    for key, decision in pairs.items():
        pile, scene, pair = runs.planned.piles[key], decision.asked, decision.levels
        if not pair or not runs.are_done(key):
            continue
        started = time.process_time()
        motion = pile.motion(runs.cases)
        here_s = time.process_time() - started if pair.grains.name in ("pivot", "peeling") else 0.0
        names = {f"tau_{at:g}": at for at in scene.protocol.fractions}
        names |= {f"curve_{at:.2f}": at for at in CURVE.tolist()}
        speed, density = pile.face(runs.cases).speed, scene.fluid.density
        row: Row = {
            "scene_id": scene.id,
            "scene": experiment.label(scene),
            **point(scene),
            "packing": packing(scene) + (", level bed" if pile.bed.is_level else ""),
            "asked": scene.protocol.method,
            **{f"class_{part}": calibration.scene_class(part, scene) for part in LEVELS},
            "count": motion.count,
            "flow_level": pair.flow.name,
            "grain_level": pair.grains.name,
            "same_model": pair.flow.same_model and pair.grains.same_model,
            "model_floor": calibration.floor(calibration.model_class(scene)),
            "flow_s": sum(runs.cpu_s[run.name] for run in pile.model.cases),
            "grains_s": here_s + sum(runs.cpu_s[run.name] for run in pile.method.cases),
        }
        taus = {name: of_pile(motion, speed, at, density).tau for name, at in names.items()}
        rows.append({**row, **taus})
    return pd.DataFrame(rows)


def errors(found: pd.DataFrame) -> pd.DataFrame:
    """The points with their relative errors against the reference that their scene has.

    `reference_error` is how far the reference itself moved when all of its numbers were changed.
    """
    parts = [_against(rows) for _, rows in found.groupby("scene_id", sort=False)]
    return pd.concat(parts, ignore_index=True)


def _against(rows: pd.DataFrame) -> pd.DataFrame:
    index = {
        tuple(pair): at for at, pair in zip(rows.index, rows[LEVEL_PAIR].to_numpy(), strict=True)
    }
    names = [tuple(tuple(one.name for one in pair) for pair in pairs) for pairs in REFERENCES]
    best, again = next((one for one in names if one[0] in index), names[0])
    if best not in index:
        return rows.iloc[:0]
    taus, curve = (rows.filter(regex=f"^{start}_").astype(float) for start in ("tau", "curve"))
    taus, curve = (table / table.loc[index[best]] - 1 for table in (taus, curve))
    unsure = taus.loc[index[again]].abs().max() if again in index else math.nan
    named = {f"error_{round(100 * float(str(name)[4:]))}": taus[name] for name in taus}
    return rows.assign(
        **named,
        error_curve=curve.abs().mean(axis=1),
        cost_core_s=rows["flow_s"] + rows["grains_s"],
        reference_error=unsure,
    )


def with_front(table: pd.DataFrame) -> pd.DataFrame:
    """Mark the pairs that no other of their packing beats in both cost and error.

    A pair counts with its mean cost and its largest error over the scenes; a fraction that was not
    reached leaves it out.
    """
    worst = table.filter(regex=r"^error_\d+$").abs().max(axis=1, skipna=False)
    rows = table.assign(worst=worst)[table["same_model"] & (table["asked"] == "dem")]
    keys = ["packing", *LEVEL_PAIR]
    pairs = rows.groupby(keys).agg(
        cost=("cost_core_s", "mean"), worst=("worst", lambda values: values.max(skipna=False))
    )
    front = set()
    for _, both in pairs.groupby("packing"):
        values = both.to_numpy(float)
        for key, one in zip(both.index, values, strict=True):
            beaten = ((values <= one).all(axis=1) & (values < one).any(axis=1)).any()
            if np.isfinite(one).all() and not beaten:
                front.add(key)
    return table.assign(pareto=[tuple(key) in front for key in table[keys].to_numpy()])


def together(measured: pd.DataFrame) -> pd.DataFrame:
    """One row for each pair and packing: the mean cost, the largest errors with their signs."""

    def largest(values: pd.Series) -> float:
        return math.nan if values.isna().any() else float(max(values, key=abs))

    groups = measured.groupby(["packing", *LEVEL_PAIR], sort=False)
    return groups.agg(
        **{name: (name, largest) for name in ERRORS},
        piles=("scene_id", "size"),
        cost_core_s=("cost_core_s", "mean"),
        reference_error=("reference_error", "max"),
        model_floor=("model_floor", "min"),
        same_model=("same_model", "first"),
        pareto=("pareto", "first"),
    ).reset_index()


def known_errors(found: pd.DataFrame) -> pd.DataFrame:
    """Known error of each level, by class of scene and fraction; `calibration` reads it.

    The error is the largest over the scenes, infinite where only one of level and reference reached
    the fraction. The uncertainty is how far the reference itself moved on scenes of that class.
    """
    on_level = found["class_flow"] == calibration.LEVEL_BED
    beside = on_level.map({True: FLAT.name, False: FINE.name})
    grains = found[(found["flow_level"] == beside) & (found["asked"] == "dem")]
    flow = found[(found["grain_level"] == PEELING.name) & found["same_model"]]
    rows = [
        *_known("grains", grains, REFERENCE.grains, AGAIN.grains),
        *_known("flow", flow, FINE, FINER.flow),
    ]
    return pd.DataFrame(rows).sort_values(["part", "level", "scene_class", "fraction"])


def _known(part: str, table: pd.DataFrame, best: Level, again: Level) -> Iterator[Row]:
    name = "flow_level" if part == "flow" else "grain_level"
    for scene_class, alike in table.groupby(f"class_{part}", sort=True):
        by_level = {key: rows.set_index("scene_id") for key, rows in alike.groupby(name)}
        if best.name not in by_level:
            continue
        reference, other = by_level[best.name], by_level.get(again.name)
        for key, rows in by_level.items():
            for column in rows.filter(regex="^tau_"):
                # a finer flow is run on small piles alone, other grains on every pile
                unsure = 0.0 if part == "flow" else math.inf
                yield {
                    "part": part,
                    "level": key,
                    "scene_class": scene_class,
                    "fraction": float(str(column)[4:]),
                    "error": _shift(rows[column], reference[column]),
                    "uncertainty": unsure
                    if other is None
                    else _shift(other[column], reference[column]),
                    "cost_core_s": float(rows[f"{part}_s"].mean()),
                    "scenes": len(rows),
                }


def _shift(values: pd.Series, reference: pd.Series) -> float:
    """The largest relative difference over the scenes that both have; infinite if there is none."""
    both = values.index.intersection(reference.index)
    if both.empty:
        return math.inf
    value, base = values[both], reference[both]
    # where neither reaches the fraction they agree; where one does, they could not differ more
    apart = (value / base - 1).abs().fillna(math.inf).where(value.notna() | base.notna(), 0.0)
    return float(apart.max())


def small_pile(study: Study) -> Scene:
    """The lowest pile of a study, in grains, that is answered by DEM; a lattice.

    Raises
    ------
    InputError
        If it has none.
    """
    heights = {
        scene: scene.bed.height / scene.grain.diameter
        for scene in study.scenes
        if isinstance(scene.bed, PileBed) and scene.protocol.method == "dem" and not scene.is_poured
    }
    if not heights:
        what = "it has no pile that is answered by DEM and is not poured"
        raise InputError(what, where=study.name, remedy="add one: the naive route is run on it")
    return min(heights, key=lambda scene: heights[scene])


def naive_routes(scene: Scene) -> dict[str, Decision]:
    """The scene by each naive route, by its name; that of the paper's K = 1e6 N/m comes first."""
    whole = changed(WHOLE.answer(scene), STEPS)
    stiffness = {"K = 1e6 N/m": paper_stiffness(scene), "K d/W = 1e4": 1e4}
    return {
        f"every Re* alone, {name}": as_asked(changed(whole, {"grain.stiffness": value}))
        for name, value in stiffness.items()
    }


def naive_costs(routes: Sequence[str], fast: str, runs: Runs) -> pd.DataFrame:
    """Cost of each route for the curve of a pile: route, core_s, extrapolated.

    Parameters
    ----------
    routes : sequence of str
        Names of the naive routes of the small pile.
    fast : str
        Name of the pile in question on the level `FAST`.
    runs : Runs
        The runs; what is not finished costs NaN.
    """
    piles, cpu_s = runs.planned.piles, runs.cpu_s

    def load_steps(pile: Pile) -> int:
        return len(Motion.from_csv(runs.cases / pile.case.name).flow) - 1

    def extrapolated(small: Pile, fast: Pile) -> float:
        if not {small.case.name, fast.case.name} <= cpu_s.keys():
            return math.nan
        whole = Pile(WHOLE.answer(fast.scene), runs.cases)
        grains = whole.packing.mobile.sum() / small.packing.mobile.sum()
        return float(cpu_s[small.case.name] / load_steps(small) * grains * load_steps(fast))

    rows = [(name, extrapolated(piles[name], piles[fast]), True) for name in routes]
    rows.append((FAST.name, cpu_s.get(piles[fast].case.name, math.nan), False))
    return pd.DataFrame(rows, columns=["route", "core_s", "extrapolated"])


def _sections(tables: Tables) -> list[Section]:
    """The sections of the page, from the tables ``points``, ``levels`` and ``naive``."""
    from orchestrator.experiments import ladder_figures as figures

    words = experiment.texts("ladder")
    by_dem = together(tables["points"][tables["points"]["asked"] == "dem"])
    means = by_dem[["packing", *LEVEL_PAIR, "piles", "cost_core_s", *ERRORS]]
    means = means.assign(**{name: 100 * by_dem[name] for name in ERRORS})
    meanings = pd.DataFrame(
        [(part, one.name, one.meaning) for part, levels in LEVELS.items() for one in levels],
        columns=["part", "level", "what it is"],
    )
    index = ["part", "scene_class", "level", "scenes", "cost_core_s"]
    known = (100 * tables["levels"].set_index([*index, "fraction"])["error"]).unstack("fraction")
    known.columns = pd.Index([f"{fraction:.0%}" for fraction in known.columns])
    order = {name: place for place, name in enumerate(meanings["level"])}
    known = known.reset_index().assign(order=lambda rows: rows["level"].map(order))
    known = known.sort_values(["part", "scene_class", "order"]).drop(columns="order")
    heads = {name: f"{name.removeprefix('error_')} %" for name in ERRORS}
    heads |= {"cost_core_s": "core-s", "flow_level": "flow", "grain_level": "grains"}
    heads |= {"scene_class": "scene class"}
    figure = experiment.figure
    largest, fractions = figures.against_cost(by_dem), figures.by_fraction(by_dem)
    charts = [
        figure("speed-against-accuracy", "Cost against error", words["largest"], largest),
        figure("error-at-fractions", "The error at each fraction", words["fractions"], fractions),
    ]
    return [
        Section(
            "Speed against accuracy",
            words["accuracy"],
            charts,
            [document.sheet(means.rename(columns=heads).sort_values(["packing", "core-s"]))],
        ),
        Section(
            "What is gained over the naive route",
            words["naive"],
            [figure("gains", "Factors gained", "", figures.gains(tables["naive"]))],
            [document.sheet(tables["naive"])],
        ),
        Section(
            "The fidelity levels, and what is known of them",
            words["levels"],
            tables=[document.sheet(meanings), document.sheet(known.rename(columns=heads))],
            limits=[words["limit"]],
        ),
    ]
