"""From thresholds under each alternative to the share of each choice, and their sum."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.experiments.budget.choices import CHOICES, Choice, label
from orchestrator.fidelity import calibration
from orchestrator.fidelity.decision import Decision, on_levels
from orchestrator.fidelity.levels import Levels
from orchestrator.fidelity.spread import FROZEN
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

QUANTITIES = ("shields", "ustar0")
"""Quantities compared: the Shields number of the mean stress on the moved grains, and the
undisturbed friction velocity at which they moved."""
BASE = "as asked"


def decisions(study: Study) -> dict[str, Decision]:
    """Scenes of the budget, by names for the plan: each pile as asked and with each alternative."""
    return {
        key_of(scene, name, levels): on_levels(other, levels, "the budget changes one choice")
        for scene in study.scenes
        if isinstance(scene.bed, PileBed)
        for choice in CHOICES
        for levels in (choice.levels(scene),)
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

    @cache
    def thresholds(key: str) -> list[PileThreshold]:
        return piles[key].thresholds(cases, piles[key].scene.protocol.fractions)

    return pd.DataFrame(
        _row(scene, choice.name, name.partition(": ")[2], before, after)
        for scene in study.scenes
        if isinstance(scene.bed, PileBed)
        for choice in CHOICES
        for levels in (choice.levels(scene),)
        for base in (key_of(scene, BASE, levels),)
        for name, _ in _others(choice, scene)
        for key in (key_of(scene, name, levels),)
        if base in piles and key in piles
        for before, after in zip(thresholds(base), thresholds(key), strict=True)
    )


def _row(
    scene: Scene, choice: str, alternative: str, before: PileThreshold, after: PileThreshold
) -> dict[str, Any]:
    """How far an alternative moves a threshold."""
    return {
        "scene_id": scene.id,
        "scene": label(scene),
        "model_class": calibration.model_class(scene),
        "choice": choice,
        "alternative": alternative,
        "fraction": before.fraction,
        "shields": after.tau / before.tau - 1,
        "ustar0": after.ustar0 / before.ustar0 - 1,
    }


def worn(study: Study, piles: Mapping[str, Pile]) -> Iterator[tuple[Pile, Pile]]:
    """Each pile on the frozen bed and on one that changes; arguments as in `changes`."""
    (choice,) = (one for one in CHOICES if one.name == FROZEN)
    for scene in study.scenes:
        for name, _ in _others(choice, scene) if isinstance(scene.bed, PileBed) else ():
            levels = choice.levels(scene)
            keys = [key_of(scene, one, levels) for one in (BASE, name)]
            if all(key in piles for key in keys):
                yield piles[keys[0]], piles[keys[1]]


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
