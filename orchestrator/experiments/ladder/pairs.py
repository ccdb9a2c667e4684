"""The pairs of levels that the ladder runs, one for the flow and one for the grains.

The grains' levels are run on the reference's flow, the flow's with the grains by peeling, so that
each error is that of one part; a few pairs as they are used show that the errors add up.
"""

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.bed.cover import counted_segments
from orchestrator.bed.shapes import of_bed
from orchestrator.fidelity import calibration, spread
from orchestrator.fidelity.decision import Decision, on_levels
from orchestrator.fidelity.levels import FLAT, LEVELS, Level, Part, level, packing
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import of_pile
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.tables.scenes import point

Pair = tuple[str, str]
"""Names of a level of the flow and of one of the grains."""
Row = dict[str, Any]

REFERENCE: Pair = ("fine", "reference")
AGAIN: Pair = ("fine", "soft reference")
"""The same with every number of the grains' run changed: the reference's own uncertainty."""
LEVEL_REFERENCE: Pair = (FLAT, REFERENCE[1])
LEVEL_AGAIN: Pair = (FLAT, AGAIN[1])
"""The same of a level bed, over which no flow is solved."""
FINER: Pair = ("finest", "peeling")
BESIDE = "peeling"
"""The grains' level beside which the flow's are measured."""
USED: tuple[Pair, ...] = (
    ("hill", "pivot"),
    ("hill", "peeling"),
    ("shared", "peeling"),
    ("coarse", "1 layer, coarse"),
    ("coarse", "1 layer, fast"),
    ("standard", "1 layer, fast"),
    ("standard", "1 layer, slow"),
)
"""Pairs as they are used together."""
CURVE = np.arange(0.05, 0.86, 0.05)
"""Fractions at which whole curves are compared."""


def decisions(study: Study) -> dict[str, Decision]:
    """Scenes of the ladder: every pile of a study on its pairs of levels, by names for the plan."""
    return {
        " | ".join((scene.id, *pair)): on_levels(
            scene, dict(zip(LEVELS, pair, strict=True)), "the ladder measures these levels"
        )
        for scene in study.scenes
        if isinstance(scene.bed, PileBed)
        for pair in _pairs(scene.bed, scene)
    }


def pair_of(decision: Decision) -> Pair:
    """The levels of a decision as a pair."""
    return decision.levels["flow"], decision.levels["grains"]


def key_of(asked: Mapping[str, Decision], grains: str) -> str:
    """The name of the first pile whose grains are answered on a level."""
    return next(key for key, one in asked.items() if one.levels["grains"] == grains)


def _pairs(bed: PileBed, scene: Scene) -> Iterator[Pair]:
    by_dem = scene.protocol.method == "dem"
    # neither a level bed nor one in space has what the flow's levels are measured beside
    if bed.is_level or bed.width:
        flow = FLAT if bed.is_level else REFERENCE[0]
        yield from ((flow, one.name) for one in _affordable("grains", bed, scene) if by_dem)
        return
    for one in _affordable("flow", bed, scene):
        yield one.name, BESIDE
    if by_dem:
        yield from ((REFERENCE[0], one.name) for one in _affordable("grains", bed, scene))
        yield from USED


def _affordable(part: Part, bed: PileBed, scene: Scene) -> Iterator[Level]:
    line = of_bed(bed)
    exposed = line.lengths[counted_segments(line, bed.counts)].sum() / scene.grain.diameter
    for one in LEVELS[part]:
        if not one.takes(scene):
            continue
        if one.most_grains is None or exposed <= one.most_grains * (1 + 1e-9):
            yield one


def points(
    asked: Mapping[str, Decision],
    piles: Mapping[str, Pile],
    cases: Path,
    cpu_s: Mapping[str, float],
) -> pd.DataFrame:
    """A row for each scene and pair whose runs are done: its cost and its thresholds.

    Parameters
    ----------
    asked : mapping of str to Decision
        As `decisions` gives them.
    piles : mapping of str to Pile
        By the same names.
    cases : Path
        Where the runs lie.
    cpu_s : mapping of str to float
        Processor seconds of the finished cases, by name.
    """
    return pd.DataFrame(
        _point(decision, piles[key], cases, cpu_s)
        for key, decision in asked.items()
        if piles[key].is_run(cpu_s)
    )


def _point(decision: Decision, pile: Pile, cases: Path, cpu_s: Mapping[str, float]) -> Row:
    scene, (flow, grains) = decision.asked, pair_of(decision)
    assert isinstance(scene.bed, PileBed)
    started = time.process_time()
    motion = pile.motion(cases)
    own = time.process_time() - started if pile.scene.protocol.method != "dem" else 0.0
    speed, density = pile.face(cases).speed, scene.fluid.density
    asked, curve = scene.protocol.fractions, map(float, CURVE)
    return {
        "scene_id": scene.id,
        "scene": label(scene),
        **point(scene),
        "packing": packing(scene.bed) + (", level bed" if pile.bed.is_level else ""),
        "asked": scene.protocol.method,
        **{f"class_{part}": calibration.scene_class(part, scene) for part in LEVELS},
        "count": motion.count,
        "flow_level": flow,
        "grain_level": grains,
        "same_model": level("flow", flow).same_model and level("grains", grains).same_model,
        "model_floor": spread.floor(scene),
        "flow_s": sum(cpu_s[run.name] for run in pile.model.cases),
        "grains_s": own + sum(cpu_s[run.name] for run in pile.method.cases),
        **{f"tau_{n:g}": of_pile(motion, speed, n, density).tau for n in asked},
        **{f"curve_{n:.2f}": of_pile(motion, speed, n, density).tau for n in curve},
    }


def label(scene: Scene) -> str:
    """A scene in a few words."""
    assert isinstance(scene.bed, PileBed)
    size, law = f"d = {1e3 * scene.grain.diameter:g} mm", scene.forces.law
    words = [f"{scene.bed.slope_deg:g}°", size, law]
    if scene.bed.packing == "disordered":
        words.append(f"gaps {scene.bed.disorder:g} d")
    if scene.is_poured:
        words.append(f"poured, seed {scene.bed.seed}")
    if scene.bed.width:
        words.append(f"strip of {scene.bed.width:g} d")
    return ", ".join(words)
