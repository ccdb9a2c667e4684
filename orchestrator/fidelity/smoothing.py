"""What the smoothing of a noisy profile is worth: the bed with half and twice of it."""

import warnings

from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.grains.geometry import has_rows_along
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed

FACTORS = (0.5, 1.0, 2.0)
"""Smoothing of the beds that are compared, over the one that is used or needed."""


def length_of(scene: Scene) -> float:
    """Compute the smoothing of a noisy profile, m.

    Returns
    -------
    float
        The one used, or the one needed if that is more; 0 for a scene without a
        profile, or with one whose points are not noisy.
    """
    bed = scene.bed
    if not isinstance(bed, PileBed) or bed.profile is None or not bed.profile.needs:
        return 0.0
    return max(bed.smoothing, bed.profile.needs)


def compared(answer: Scene) -> dict[float, Scene]:
    """The scenes by which the smoothing of a noisy profile is judged.

    Parameters
    ----------
    answer
        The scene that answers.

    Returns
    -------
    dict[float, Scene]
        By each of `FACTORS` the scene with so much smoothing, by the closed form along
        the bed line, under the flow model of the answer. One that cannot be meshed or
        smoothed is left out. Empty for a scene without noise, and for grains that have
        no such closed form: of poured beds, of horizontal rows, and of grains that
        share the stress.
    """
    length = length_of(answer)
    is_along = has_rows_along(answer) and answer.forces.sheltering == "none"
    if not length or not is_along:
        return {}
    scenes = {}
    for factor in FACTORS:
        try:
            scenes[factor] = _with_smoothing(answer, float(f"{factor * length:.6g}"))
        except (InputError, UnfitError):
            continue
    return scenes


def _with_smoothing(scene: Scene, length: float) -> Scene:
    """A scene with another smoothing (m) of its profile, by the closed form."""
    assert isinstance(scene.bed, PileBed)
    assert scene.bed.profile is not None
    fields = scene.bed.profile.smoothed(length)
    values = {f"bed.{name}": value for name, value in fields.items()}
    values |= {"bed.smoothing": length, "method.kind": "local"}
    made = changed(scene, {**values, "threshold.update": 0.0})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the scene itself has warned
        limits.check(made, "")
    return made
