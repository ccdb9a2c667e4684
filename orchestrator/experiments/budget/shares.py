"""From thresholds under each alternative to the share of each choice, and their sum."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.experiments.budget.choices import CHOICES, Choice, label
from orchestrator.experiments.budget.wear import UPDATE, Wear
from orchestrator.fidelity import calibration
from orchestrator.fidelity.decision import Decision, on_levels
from orchestrator.fidelity.levels import Levels
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import of_pile
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

QUANTITIES = ("shields", "ustar0")
"""What moves: the Shields number of the mean stress on the grains that moved, and the undisturbed
friction velocity at which they did."""
BASE = "as asked"
FROZEN = "frozen bed"
"""What the choice is called that the flow of the whole pile acts until the end."""


def decisions(study: Study) -> dict[str, Decision]:
    """What the budget runs, by names for the plan: each pile as asked and with each alternative."""
    return {
        key_of(scene, name, levels): on_levels(other, levels, "the budget changes one choice")
        for scene in study.scenes
        if isinstance(scene.bed, PileBed)
        for choice in CHOICES
        for levels in (choice.levels,)
        for name, other in ((BASE, scene), *_others(choice, scene))
    }


def _others(choice: Choice, scene: Scene) -> list[tuple[str, Scene]]:
    return [(f"{choice.name}: {name}", other) for name, other in choice.scenes(scene)]


def key_of(scene: Scene, name: str, levels: Levels) -> str:
    """The name in the plan of a scene with an alternative."""
    return " | ".join((scene.id, *levels.values(), name))


def name_of(key: str) -> str:
    """The alternative in the name of a scene in the plan."""
    return key.rpartition(" | ")[2]


def changes(study: Study, piles: Mapping[str, Pile], cases: Path) -> pd.DataFrame:
    """A row for each scene, alternative and fraction: how far the threshold moved.

    Parameters
    ----------
    study : Study
        The scenes.
    piles : mapping of str to Pile
        By the names of `decisions`, those whose runs are done.
    cases : Path
        Where the runs lie.
    """
    found: dict[str, dict[float, dict[str, float]]] = {}

    def thresholds(key: str) -> dict[float, dict[str, float]]:
        if key not in found:
            found[key] = _thresholds(piles[key], cases)
        return found[key]

    rows: list[dict[str, Any]] = []
    for scene in (one for one in study.scenes if isinstance(one.bed, PileBed)):
        for choice in CHOICES:
            base = key_of(scene, BASE, choice.levels)
            for name, _ in _others(choice, scene):
                key = key_of(scene, name, choice.levels)
                if base not in piles or key not in piles:
                    continue
                alternative = name.partition(": ")[2]
                for fraction, before in thresholds(base).items():
                    after = thresholds(key)[fraction]
                    moved = {one: after[one] / before[one] - 1 for one in QUANTITIES}
                    rows.append(
                        {
                            "scene_id": scene.id,
                            "scene": label(scene),
                            "model_class": calibration.model_class(scene),
                            "choice": choice.name,
                            "alternative": alternative,
                            "fraction": fraction,
                            **moved,
                        }
                    )
    return pd.DataFrame(rows)


def _thresholds(pile: Pile, cases: Path) -> dict[float, dict[str, float]]:
    motion, speed, scene = pile.motion(cases), pile.face(cases).speed, pile.scene
    found = {}
    for fraction in scene.protocol.fractions:
        one = of_pile(motion, speed, fraction, scene.fluid.density)
        found[fraction] = {"shields": one.tau, "ustar0": one.ustar0}
    return found


def of_wear(piles: Mapping[str, Wear]) -> pd.DataFrame:
    """The same rows for the choice to keep the flow of the whole pile until the end."""
    rows: list[dict[str, Any]] = []
    for scene_id, one in piles.items():
        scene = one.bed.scene
        for fraction in (at for at in scene.protocol.fractions if at <= one.fraction):
            frozen, worn = one.thresholds(fraction)
            rows.append(
                {
                    "scene_id": scene_id,
                    "scene": label(scene),
                    "model_class": calibration.model_class(scene),
                    "choice": FROZEN,
                    "alternative": f"drawn anew after each {UPDATE:.0%} of N",
                    "fraction": fraction,
                    "shields": worn.tau / frozen.tau - 1,
                    "ustar0": worn.ustar0 / frozen.ustar0 - 1,
                }
            )
    return pd.DataFrame(rows)


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
    keys = ["model_class", "choice", "fraction"]
    ends = [f"{name}_{end}" for name in QUANTITIES for end in ("low", "high")]
    grouped = shared.groupby(keys, sort=False)
    return grouped[ends].max().assign(scenes=grouped["scene_id"].nunique()).reset_index()
