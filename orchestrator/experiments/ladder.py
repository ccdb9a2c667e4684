"""The ladder: what each rung costs, and how far its thresholds are from the reference.

The rungs of the grains are run on the flow of the reference, those of the flow with the
grains by peeling, so that each error is that of one part; the fidelities, which have
one rung of each, show that the errors add up.
"""

import math
import time
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from adjustText import adjust_text
from matplotlib.artist import Artist
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke

from orchestrator import plan
from orchestrator.bed.line import of_bed
from orchestrator.experiments.experiment import (
    TEXTS,
    Experiment,
    Results,
    Runs,
    label,
    piles,
)
from orchestrator.fidelity import limits, spread
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
from orchestrator.report import style
from orchestrator.report.page import Section
from orchestrator.report.style import Figure, Look
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.tables.rows import point
from orchestrator.types import Row


def _rungs() -> dict[str, tuple[Rung, ...]]:
    data = tomllib.loads(
        Path(__file__).with_name("rungs.toml").read_text(encoding="utf-8")
    )
    more = {part: [Rung(**row) for row in rows] for part, rows in data.items()}
    return {
        FLOW: (FLAT, *more[FLOW], *(one.flow for one in FIDELITIES)),
        GRAINS: (*more[GRAINS], *(one.grains for one in FIDELITIES)),
    }


RUNGS = _rungs()
"""All rungs, by the part of a pile that they answer."""
PEELING = next(one.grains for one in FIDELITIES if one.name == "static")
AGAIN, FINER = "soft reference", "finest"
"""Rungs as good as those of the reference, with all of their numbers changed."""
REFERENCES = (
    ((REFERENCE.name, REFERENCE.name), (REFERENCE.name, AGAIN)),
    ((FLAT.name, REFERENCE.name), (FLAT.name, AGAIN)),
    ((REFERENCE.name, PEELING.name), (FINER, PEELING.name)),
)
"""The reference of a scene is the first of these pairs that it has (over a level bed no
flow is solved); beside it stands a pair as good with all of its numbers changed: the
uncertainty."""
MOST_WHOLE = 24  # exposed grains of piles on which whole fidelities are run
CURVE = np.arange(0.05, 0.76, 0.05)  # fractions at which whole curves are compared
HEADS = {f"error_{n}": f"$n/N$ = {n} %" for n in (10, 30, 50, 70)} | {
    "error_curve": "whole curve"
}
PAIR = ["flow_rung", "grain_rung"]
FLOOR = 1e-3  # errors below it are drawn on it
BANDS = (
    ("error of the reference itself", "0.88"),
    ("the model's own spread: better numerics buy nothing", "#fdf3dc"),
)
MARKS: Mapping[str, Look] = {
    "threshold too high": {"marker": "^", "mfc": "0.2"},
    "threshold too low": {"marker": "v", "mfc": "0.2"},
    "hollow: another model": {"marker": "^", "mfc": "white"},
}
METHODS = {"quick": "#009e73", "static": "#d55e00", "DEM": "#0072b2"}
FRONT: Look = {"color": "0.25", "lw": 0.9, "zorder": 1.5}


def experiment(study: Study, out: Path) -> Experiment:
    """What each rung costs and how far it is off, on the piles of a study."""
    limits.check_study(study)
    pairs = decisions(study)
    planned = plan.of(pairs, cases=out.absolute() / "cases")

    def results(runs: Runs) -> Results:
        measured = points(pairs, runs)
        if measured.empty or (compared := errors(measured)).empty:
            return {}, ()
        means = together(compared)
        rows = compared.merge(means[["packing", *PAIR, "pareto"]], how="left")
        known = known_errors(measured)
        return {"points": rows.fillna({"pareto": False}), "errors": known}, _sections(
            means, known
        )

    limit_s = study.time_limit_s
    return Experiment(
        "ladder",
        "Speed against accuracy",
        planned,
        results,
        limit_s,
        source=study.source,
    )


def decisions(study: Study) -> dict[str, Decision]:
    """Every pile of a study on its pairs of rungs, by names for the plan."""
    return {
        f"{scene.id} | {pair.name}": on_fidelity(
            scene, pair, "the ladder measures these rungs"
        )
        for scene, bed in piles(study).items()
        for pair in _pairs(scene, bed)
    }


def _pair(flow: Rung, grains: Rung) -> Fidelity:
    name = f"{flow.name} | {grains.name}"
    return Fidelity(name, "", flow, grains)


def _pairs(scene: Scene, bed: PileBed) -> Iterator[Fidelity]:
    """The pairs of rungs that are measured on a pile."""
    is_dem = scene.method.kind == "dem"
    line = of_bed(bed)
    exposed = line.lengths[line.counted(bed.counts)].sum() / scene.grain.diameter - 1e-6

    def taken(part: str) -> list[Rung]:
        rungs = [rung for rung in RUNGS[part] if exposed <= rung.most_grains]
        return [rung for rung in rungs if rung.takes(scene)]

    # over a level bed and on a bed in space no rung of the flow can be measured
    is_solved = not (bed.is_level or bed.width)
    if is_solved:
        yield from (_pair(flow, PEELING) for flow in taken(FLOW))
    if not is_dem:
        return
    best = FLAT if bed.is_level else REFERENCE.flow
    yield from (_pair(best, grains) for grains in taken(GRAINS))
    if is_solved and exposed <= MOST_WHOLE:
        yield from (
            _pair(one.flow, one.grains) for one in FIDELITIES if one.takes(scene)
        )


def points(pairs: Mapping[str, Decision], runs: Runs) -> pd.DataFrame:
    """A row for each scene and pair that is done: cost, core-s, thresholds, Pa."""
    rows, floors = [], spread.floors()
    for key, decision in pairs.items():
        pile, scene, pair = runs.planned.piles[key], decision.asked, decision.fidelity
        if not pair or not runs.are_done(key):
            continue
        motion = pile.motion(runs.cases)
        here_s = 0.0 if pile.method.cases else time_alone_s(pile, runs.cases)
        names = {f"tau_{at:g}": at for at in scene.threshold.fractions}
        names |= {f"curve_{at:.2f}": at for at in CURVE.tolist()}
        speed, density = pile.speed(runs.cases), scene.fluid.density
        row: Row = {
            "scene_id": scene.id,
            "scene": label(scene),
            **point(scene),
            "packing": packing(scene) + (", level bed" if pile.bed.is_level else ""),
            "asked": scene.method.kind,
            **{f"class_{part}": scene_class(part, scene) for part in RUNGS},
            "count": motion.count,
            "flow_rung": pair.flow.name,
            "grain_rung": pair.grains.name,
            "same_model": pair.flow.same_model and pair.grains.same_model,
            "model_floor": floors.get(spread.model_class(scene), math.nan),
            "flow_s": runs.cpu_s(
                [run for flow in pile.model.cases for run in (*flow.needs, flow)]
            ),
            "grains_s": here_s + runs.cpu_s(pile.method.cases),
        }
        taus = {
            name: of_pile(motion, speed, at, density).tau for name, at in names.items()
        }
        rows.append({**row, **taus})
    return pd.DataFrame(rows)


def time_alone_s(pile: Pile, cases: Path) -> float:
    """Time of one core in which the grains of a pile move without a run of DEM, s.

    It is the time of this pile alone: a packing or a threshold that another pile needed
    before is found again.
    """
    forget()
    alone = Pile(pile.scene, pile.cases)
    started = time.process_time()
    alone.motion(cases)
    return time.process_time() - started


def errors(points: pd.DataFrame) -> pd.DataFrame:
    """The points with their relative errors against the reference that their scene has.

    `reference_error` is how far the reference itself moved when all of its numbers were
    changed.
    """
    parts = [points.iloc[:0]]
    for _, scene in points.groupby("scene_id", sort=False):
        rows = scene.set_index(PAIR)
        best, again = next(
            (both for both in REFERENCES if both[0] in rows.index), (None, None)
        )
        if best is None:
            continue
        taus, curve = (
            rows.filter(regex=f"^{start}_").astype(float) for start in ("tau", "curve")
        )
        taus, curve = (table.div(table.xs(best)).sub(1) for table in (taus, curve))
        error = {
            f"error_{round(100 * float(str(name)[4:]))}": taus[name] for name in taus
        }
        compared = rows.assign(
            **error,
            error_curve=curve.abs().mean(axis=1),
            cost_core_s=rows["flow_s"] + rows["grains_s"],
            reference_error=taus.xs(again).abs().max()
            if again in rows.index
            else math.nan,
        )
        parts.append(
            compared.reset_index()[
                [*scene, *compared.columns.difference(scene.columns)]
            ]
        )
    return pd.concat(parts, ignore_index=True)


def together(points: pd.DataFrame) -> pd.DataFrame:
    """One row for each pair and packing: the mean cost, the largest signed errors.

    `pareto` marks the pairs that no other of their packing and model beats in both, by
    the largest error over the four fractions; a pair that did not reach one is left
    out.
    """

    def largest(values: pd.Series) -> float:
        return math.nan if values.isna().any() else float(max(values, key=abs))

    rows = points[points["asked"] == "dem"].groupby(["packing", *PAIR], sort=False)
    means: dict[str, Any] = {
        "piles": ("scene_id", "size"),
        "cost_core_s": ("cost_core_s", "mean"),
    }
    ends = {"reference_error": "max", "model_floor": "min", "same_model": "first"}
    means |= {
        name: (name, how)
        for name, how in (dict.fromkeys(HEADS, largest) | ends).items()
    }
    table: pd.DataFrame = rows.agg(**means).reset_index()
    each = table[[*HEADS][:-1]].to_numpy(float)
    worst = each[np.arange(len(each)), np.nan_to_num(np.abs(each)).argmax(axis=1)]
    whole = np.isfinite(each).all(axis=1)
    table = table.assign(largest=np.where(whole, worst, math.nan), pareto=False)
    for _, alike in table[whole & table["same_model"]].groupby("packing"):
        values = alike[["cost_core_s", "largest"]].abs().to_numpy(float)
        worse = [
            (values <= row).all(axis=1) & (values < row).any(axis=1) for row in values
        ]
        table.loc[alike.index, "pareto"] = ~np.any(worse, axis=1)
    return table


def known_errors(points: pd.DataFrame) -> pd.DataFrame:
    """Known error of each rung, by class and fraction; `known.measured` reads it.

    The error is the largest over the scenes, infinite where only one of rung and
    reference reached the fraction, zero where neither did. The uncertainty is how far
    the reference itself moved.
    """
    beside = np.where(points["class_flow"] == LEVEL_BED, FLAT.name, REFERENCE.name)
    grains = points[(points["flow_rung"] == beside) & (points["asked"] == "dem")]
    flow = points[(points["grain_rung"] == PEELING.name) & points["same_model"]]
    taus, tables = [name for name in points if str(name).startswith("tau_")], []
    key, place = (
        ["part", "rung", "scene_class", "fraction"],
        ["scene_class", "fraction"],
    )
    for part, column, table, best, again in (
        (GRAINS, "grain_rung", grains, REFERENCE.name, AGAIN),
        (FLOW, "flow_rung", flow, REFERENCE.name, FINER),
    ):
        names = {
            column: "rung",
            f"class_{part}": "scene_class",
            f"{part}_s": "cost_core_s",
        }
        rows = table.rename(columns=names).assign(part=part)
        rows = rows.melt(
            ["scene_id", *key[:-1], "cost_core_s"], taus, "fraction", "tau"
        )
        base = rows.loc[rows["rung"] == best, ["scene_id", "fraction", "tau"]]
        rows = rows.merge(base, on=["scene_id", "fraction"], suffixes=("", "_best"))
        neither = rows["tau"].isna() & rows["tau_best"].isna()
        error = (
            (rows["tau"] / rows["tau_best"] - 1)
            .abs()
            .fillna(math.inf)
            .mask(neither, 0.0)
        )
        rows = rows.assign(error=error, fraction=rows["fraction"].str[4:].astype(float))
        largest = {"error": ("error", "max"), "cost_core_s": ("cost_core_s", "mean")}
        known = (
            rows.groupby(key).agg(**largest, scenes=("scene_id", "size")).reset_index()
        )
        shift = known.loc[known["rung"] == again, [*place, "error"]]
        known = known.merge(
            shift.rename(columns={"error": "uncertainty"}), "left", place
        )
        # a finer flow is run on small piles alone, other grains on every pile
        tables.append(known.fillna({"uncertainty": 0.0 if part == FLOW else math.inf}))
    columns = [*key, "error", "uncertainty", "cost_core_s", "scenes"]
    return pd.concat(tables)[columns].sort_values(key)


def _sections(pairs: pd.DataFrame, known: pd.DataFrame) -> list[Section]:
    words, index = (
        TEXTS["ladder"],
        ["part", "scene_class", "rung", "scenes", "cost_core_s"],
    )
    heads = {name: f"{name.removeprefix('error_')} %" for name in HEADS}
    heads |= {"flow_rung": "flow", "grain_rung": "grains", "scene_class": "scene class"}
    heads["cost_core_s"] = "core-s"
    means = pairs.sort_values(["packing", "cost_core_s"]).assign(
        **(100 * pairs[[*HEADS]])
    )
    means = means[["packing", *PAIR, "piles", "cost_core_s", *HEADS]].rename(
        columns=heads
    )
    rows = [
        (part, each.name, each.meaning)
        for part, rungs in RUNGS.items()
        for each in rungs
    ]
    meanings = pd.DataFrame(rows, columns=["part", "rung", "what it is"])
    order = {name: place for place, name in enumerate(meanings["rung"])}
    errors = (100 * known.set_index([*index, "fraction"])["error"]).unstack("fraction")
    errors = errors.rename(columns="{:.0%}".format).sort_index(
        level=index[:3],
        key=lambda keys: keys.map(order) if keys.name == "rung" else keys,
    )
    of_rungs = [meanings, errors.reset_index().rename(columns=heads)]
    title, largest = "Cost against error", chart(pairs, {"largest": ""})
    charts = [Figure("speed-against-accuracy", title, words["largest"], (), largest)]
    title, each = "The error at each fraction", chart(pairs, HEADS)
    charts.append(Figure("error-at-fractions", title, words["fractions"], (), each))
    title = "The rungs, and what is known of them"
    return [
        Section("Speed against accuracy", words["accuracy"], charts, [means]),
        Section(title, words["rungs"], (), of_rungs, [words["limit"]]),
    ]


def chart(pairs: pd.DataFrame, columns: Mapping[str, str]) -> Canvas:
    """Errors against cost: a row of panels for each packing, one for each column.

    A single column has the number of every pair, the front and its names; several have
    the numbers on the front. `columns` has the heads of the panels by the columns of
    `together`.
    """
    single, names = len(columns) == 1, pairs["flow_rung"] + ", " + pairs["grain_rung"]
    colours = pairs["grain_rung"].map(METHODS).fillna(METHODS["DEM"])
    table = pairs.assign(name=names, number=pd.factorize(names)[0] + 1, colour=colours)
    packings = [rows for _, rows in table.groupby("packing", sort=False)]
    height = (
        (2.6 if single else 1.7) * len(packings)
        + 0.06 * table["number"].nunique()
        + 1.2
    )
    canvas = style.canvas(height)
    grid = canvas.subplots(
        len(packings), len(columns), sharex=True, sharey=True, squeeze=False
    )
    tags = []
    for line, rows in zip(grid, packings, strict=True):
        title = f"{rows['packing'].iloc[0]} packing"
        line[0].set_ylabel(
            "largest error of $τ_c$, %" if single else f"{title}\nerror of $τ_c$, %"
        )
        for ax, (column, head) in zip(line, columns.items(), strict=True):
            ax.set_title(head or title, loc="left" if single else "center")
            ends = rows["reference_error"].max(), rows["model_floor"].min()
            for at, (end, (_, colour)) in enumerate(zip(ends, BANDS, strict=True)):
                ax.axhspan(
                    0, np.nan_to_num(end), color=colour, lw=0, zorder=0.2 - at / 10
                )
            tags.append((ax, _points(ax, rows, column, named=single)))
    for ax in grid.ravel():
        ax.set(xscale="log", yscale="log", ylim=(FLOOR / 1.5, None))
        ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g}")
        for tolerance in (0.05, 0.2):
            ax.axhline(tolerance, color="0.45", lw=0.7, ls=(0, (4, 2)), zorder=1)
    grid[-1, len(columns) // 2].set_xlabel("cost, s of one core")
    numbered: Any = (table if single else table[table["pareto"]]).drop_duplicates(
        "number"
    )
    mark: Look = {"ls": "", "ms": 5, "mec": "0.2", "mew": 0.9}
    samples: list[Artist] = [
        Line2D(
            [],
            [],
            ls="",
            marker=f"${row.number}$",
            ms=5,
            label=row.name,
            color=row.colour,
        )
        for row in numbered.itertuples(index=False)
    ]
    samples += [
        Line2D([], [], label=text, **mark, **look) for text, look in MARKS.items()
    ]
    samples += [Patch(label=label, color=colour, lw=0) for label, colour in BANDS]
    if single:
        samples.append(
            Line2D([], [], label="no pair of rungs is cheaper and better", **FRONT)
        )
    style.legends(canvas, [style.entry(*method) for method in METHODS.items()], samples)
    canvas.draw_without_rendering()  # labels are placed in a finished layout
    arrow = {"arrowstyle": "-", "lw": 0.4, "color": "0.5"}
    for ax, texts in tags:
        if texts:
            x, y = np.transpose([text.get_position() for text in texts])
            adjust_text(
                texts, x, y, ax=ax, arrowprops=arrow, expand=(1.15, 1.4), iter_lim=100
            )
        for text in texts:
            text.set_in_layout(False)
    return canvas


def _points(ax: Any, rows: pd.DataFrame, column: str, *, named: bool) -> list[Any]:
    """Draw the points of a panel, and the front; return their labels."""
    shown = rows[(rows["cost_core_s"] > 0) & rows[column].notna()]
    shown = shown.assign(y=shown[column].abs().clip(lower=FLOOR))
    halo = [Stroke(linewidth=1.8, foreground="white"), Normal()]
    look: Look = {"fontsize": 6.0 if named else 5.5, "color": "0.1", "zorder": 5}
    tags: list[Any] = []
    each: Any = shown.itertuples(index=False)
    for row in each:
        face = row.colour if row.same_model else "white"
        mark: Look = {
            "marker": "v" if getattr(row, column) < 0 else "^",
            "ms": 5,
            "mew": 0.9,
        }
        ax.plot(
            row.cost_core_s,
            row.y,
            gid="point",
            zorder=3,
            mfc=face,
            mec=row.colour,
            **mark,
        )
        if named or row.pareto:
            text = f"{row.number}" + f": {row.name}" * (named and row.pareto)
            tags.append(
                ax.text(row.cost_core_s, row.y, text, path_effects=halo, **look)
            )
    if named:
        front = shown[shown["pareto"]].sort_values("cost_core_s")
        ax.step(front["cost_core_s"], front["y"], where="post", **FRONT)
    return tags
