"""The ladder: what each level costs, and how far its thresholds are from the dearest ones'.

Every scene is answered on many pairs of levels. The grains' levels are run on the reference's flow,
the flow's with the grains by peeling, so that each error is that of one part; a few pairs as they
are used show that the errors add up.
"""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.experiments import naive
from orchestrator.fidelity import calibration, decision, levels
from orchestrator.fidelity.decision import Decision
from orchestrator.fidelity.levels import LEVELS, Level, Part
from orchestrator.grains.threshold import of_pile
from orchestrator.plan import Plan
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.tables.scenes import point

Pair = tuple[str, str]
"""Names of a level of the flow and of one of the grains."""
Row = dict[str, Any]
WHY = "the ladder measures these levels"

REFERENCE: Pair = ("fine", "reference")
AGAIN: Pair = ("fine", "soft reference")
"""The same with every number of the grains' run changed: the reference's own uncertainty."""
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


@dataclass(frozen=True)
class Key:
    """One scene on one pair of levels."""

    scene: Scene
    pair: Pair

    @property
    def text(self) -> str:
        """Its name in the plan."""
        return " | ".join((self.scene.id, *self.pair))


def keys(study: Study) -> Iterator[Key]:
    """What the ladder runs: every pile of a study on its pairs of levels."""
    for scene in study.scenes:
        if isinstance(scene.bed, PileBed):
            yield from (Key(scene, pair) for pair in dict.fromkeys(_pairs(scene)))


def _pairs(scene: Scene) -> Iterator[Pair]:
    by_dem = scene.protocol.method == "dem"
    for flow in _affordable("flow", scene):
        yield flow.name, BESIDE
    if by_dem:
        yield from ((REFERENCE[0], grains.name) for grains in _affordable("grains", scene))
        yield from USED


def _affordable(part: Part, scene: Scene) -> Iterator[Level]:
    assert isinstance(scene.bed, PileBed)
    face = scene.bed.height / math.sin(math.radians(scene.bed.slope_deg))
    for one in LEVELS[part]:
        if one.on_lattices and scene.bed.packing == "disordered":
            continue
        if one.most_grains is None or face / scene.grain.diameter <= one.most_grains:
            yield one


def answers(study: Study) -> dict[str, Decision]:
    """How the scenes of the ladder are answered, by their keys."""
    return {
        key.text: decision.on_levels(key.scene, dict(zip(LEVELS, key.pair, strict=True)), WHY)
        for key in keys(study)
    }


def fast(study: Study) -> str:
    """Key of the first pile by DEM on the level that the naive route is beside."""
    return next(k.text for k in keys(study) if k.pair == (REFERENCE[0], naive.FAST))


def points(
    study: Study, planned: Plan, cases: Path, states: Mapping[str, Mapping[str, Any]]
) -> pd.DataFrame:
    """A row for each scene and pair: its cost and its thresholds; of the runs that are done."""
    return pd.DataFrame(
        _point(key, planned, cases, states)
        for key in keys(study)
        if all(run.name in states for run in planned.piles[key.text].runs)
    )


def _point(key: Key, planned: Plan, cases: Path, states: Mapping[str, Mapping[str, Any]]) -> Row:
    pile = planned.piles[key.text]
    started = time.process_time()
    motion = pile.motion(cases)
    own = time.process_time() - started if pile.scene.protocol.method != "dem" else 0.0
    speed = pile.face(cases).speed
    row: Row = {
        "scene_id": key.scene.id,
        "scene": label(key.scene),
        **point(key.scene),
        "packing": pile.bed.packing,
        "asked": key.scene.protocol.method,
        **{f"class_{part}": calibration.scene_class(part, key.scene) for part in LEVELS},
        "count": motion.count,
        "flow_level": key.pair[0],
        "grain_level": key.pair[1],
        "same_model": levels.level("flow", key.pair[0]).same_model,
        "flow_s": sum(states[run.name]["cpu_s"] for run in pile.model.cases),
        "grains_s": own + sum(states[r.name]["cpu_s"] for r in pile.method.cases),
    }
    for fraction in key.scene.protocol.fractions:
        found = of_pile(motion, speed, fraction, key.scene.fluid.density)
        row[f"tau_{fraction:g}"] = found.tau
    for fraction in CURVE:
        found = of_pile(motion, speed, float(fraction), key.scene.fluid.density)
        row[f"curve_{fraction:.2f}"] = found.tau
    return row


def label(scene: Scene) -> str:
    """A scene in a few words."""
    assert isinstance(scene.bed, PileBed)
    words = [
        f"{scene.bed.slope_deg:g}°",
        f"d = {1e3 * scene.grain.diameter:g} mm",
        scene.forces.law,
    ]
    if scene.bed.packing == "disordered":
        words.append(f"gaps {scene.bed.disorder:g} d")
    return ", ".join(words)
