"""The closed form's answer for one grain: Eqs. 3 and 5, for people and for programs."""

from collections.abc import Mapping
from typing import Any

from orchestrator.physics import closures
from orchestrator.study.closed_form import closed_form, regime_of
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene

UNITS = {
    "friction_velocity": "m/s",
    "reynolds": "",
    "shields": "",
    "drag": "N",
    "lift": "N",
}


def scene(fields: Mapping[str, Any]) -> Scene:
    """The scene of one grain from ``part.field`` names as in a study file.

    Raises
    ------
    InputError
        Naming the field and the remedy.
    """
    parts: dict[str, dict[str, Any]] = {"fluid": {}, "grain": {}, "bed": {}, "flow": {}}
    for name, value in fields.items():
        part, _, field = name.partition(".")
        parts[part][field] = _length(value) if name == "bed.roughness" else value
    return make_scene(parts, "threshold")


def _length(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def of(asked: Scene) -> dict[str, Any]:
    """The thresholds by both closures, and which of them holds."""
    found = {closure: closed_form(asked, closure) for closure in closures.CLOSURES}
    answer: dict[str, Any] = {
        closure: {
            **{name: float(getattr(threshold, name)) for name in UNITS},
            "valid": bool(threshold.valid),
        }
        for closure, threshold in found.items()
    }
    return {**answer, "regime": regime_of(asked)}


def text(answer: Mapping[str, Any]) -> str:
    """The answer as a small table."""
    lines = [f"{'':<24}{'low (Eq. 3)':>16}{'high (Eq. 5)':>16}"]
    for name, unit in UNITS.items():
        label = f"{name.replace('_', ' ')}{f', {unit}' if unit else ''}"
        lines.append(f"{label:<24}{answer['low'][name]:>16.6g}{answer['high'][name]:>16.6g}")
    words = ("yes" if answer[closure]["valid"] else "no" for closure in closures.CLOSURES)
    lines.append(f"{'valid':<24}" + "".join(f"{word:>16}" for word in words))
    lines.append(f"regime: {answer['regime']}")
    return "\n".join(lines)
