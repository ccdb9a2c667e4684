"""The choices that every fidelity level shares, and what else each could have been.

A choice is changed alone, within what measurements and good practice leave open. Each is answered
on the cheapest levels that feel it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from orchestrator.errors import InputError
from orchestrator.fidelity.levels import Fields, Levels, changed
from orchestrator.physics.laws import LAWS
from orchestrator.study.closed_form import law_holds
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene, roughness_length

QUASISTATIC: Levels = {"flow": "coarse", "grains": "peeling"}
DYNAMIC: Levels = {"flow": "coarse", "grains": "1 layer, fast"}
"""Levels on which a choice is changed: without dynamics, and for those that dynamics alone feel."""
Alternatives = Mapping[str, Fields]
"""Values of fields by the name of the alternative."""


@dataclass(frozen=True)
class Choice:
    """One choice that the levels share.

    Attributes
    ----------
    name : str
        What tables and figures call it.
    why : str
        Why its alternatives are as good.
    others : callable
        The alternatives for a scene, those that are the scene's own left out.
    levels : mapping
        On which it is changed.
    """

    name: str
    why: str
    others: Callable[[Scene], Alternatives]
    levels: Levels

    def scenes(self, scene: Scene) -> Iterator[tuple[str, Scene]]:
        """The scene with each alternative that can be asked of it, by the alternative's name."""
        for name, fields in self.others(scene).items():
            other = _asked(scene, fields)
            if other is not None and other != scene:
                yield name, other


def _asked(scene: Scene, fields: Fields) -> Scene | None:
    """A scene with some fields changed; None where that is refused."""
    try:
        return Scene.model_validate(changed(scene, fields).model_dump())
    except (ValueError, InputError):
        return None


def _fixed(field: str, *values: Any) -> Callable[[Scene], Alternatives]:
    """Some values of a field, whatever the scene."""
    return lambda scene: {f"{value}": {field: value} for value in values}


def _around(field: str, *parts: float) -> Callable[[Scene], Alternatives]:
    """Parts of the scene's own value of a field."""
    part, _, name = field.partition(".")
    return lambda scene: {
        f"{by:g} times": {field: by * getattr(getattr(scene, part), name)} for by in parts
    }


def _beside(field: str, *steps: float) -> Callable[[Scene], Alternatives]:
    """Degrees added to the scene's own angle."""
    part, _, name = field.partition(".")
    return lambda scene: {
        f"{step:+g}°": {field: getattr(getattr(scene, part), name) + step} for step in steps
    }


def _first_cells(scene: Scene) -> Alternatives:
    own = scene.first_cell_height
    return {f"{by:g} times": {"flow.first_cell_height": by * own} for by in (0.5, 2.0)}


def _roughness(scene: Scene) -> Alternatives:
    d = scene.grain.diameter
    return {part: {"bed.roughness": roughness_length(part, d)} for part in ("d/10", "d/30")}


def _laws(scene: Scene) -> Alternatives:
    """The laws that hold at the scene, without those that need a torque."""
    named = {name: {"forces.law": name} for name, law in LAWS.items() if not law.turns}
    asked = ((LAWS[name].label, one, _asked(scene, one)) for name, one in named.items())
    return {label: one for label, one, other in asked if other is not None and law_holds(other)}


def _packings(scene: Scene) -> Alternatives:
    """The other packings of the plane, random gaps by three seeds."""
    rows = {"rows along the slope": "aligned", "level rows": "horizontal"}
    found: dict[str, Fields] = {name: {"bed.packing": value} for name, value in rows.items()}
    for seed in (1, 2, 3):
        gaps = {"bed.packing": "disordered", "bed.disorder": 0.05, "bed.seed": seed}
        found[f"random gaps, seed {seed}"] = gaps
    return found


CHOICES = (
    Choice(
        "first cell",
        "A wall function asks for no one height of the cells on the bed.",
        _first_cells,
        QUASISTATIC,
    ),
    Choice(
        "turbulence model",
        "No model is right for all flows that separate.",
        _fixed("flow.turbulence_model", "kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"),
        QUASISTATIC,
    ),
    Choice(
        "reading of the stress",
        "The paper reads it off the first cells by Eq. 10.",
        _fixed("forces.stress", "wall", "eq10"),
        QUASISTATIC,
    ),
    Choice(
        "averaging length",
        "The stress at a sharp crest has no limit; it is averaged on a length.",
        _around("forces.averaging_length", 0.5, 2.0),
        QUASISTATIC,
    ),
    Choice(
        "force law",
        "All laws that hold at the Re* of the scene.",
        _laws,
        QUASISTATIC,
    ),
    Choice(
        "roughness length",
        "Measured ones of beds of equal grains are between d/30 and d/10.",
        _roughness,
        QUASISTATIC,
    ),
    Choice(
        "entrainment angle",
        "The pockets of one bed differ by more than that.",
        _beside("bed.entrainment_angle_deg", -5.0, 5.0),
        QUASISTATIC,
    ),
    Choice(
        "lift coefficient",
        "Saffman's is that of an unbounded shear; measured lifts on a bed scatter by more.",
        _around("forces.lift_coefficient", 0.5, 1.5),
        QUASISTATIC,
    ),
    Choice(
        "packing",
        "Of a bed that was not seen neither rows nor gaps are known.",
        _packings,
        QUASISTATIC,
    ),
    Choice(
        "criterion of motion",
        "What counts as moved is a convention: between a sixth and a half of a diameter.",
        _fixed("protocol.displacement_criterion", 0.15, 0.5),
        QUASISTATIC,
    ),
    Choice(
        "friction angle",
        "That of a sand is known to a few degrees.",
        _beside("grain.friction_angle_deg", -5.0, 5.0),
        DYNAMIC,
    ),
)
"""Every shared choice."""


def label(scene: Scene) -> str:
    """A scene in a few words."""
    bed, fluid = scene.bed, scene.fluid
    assert isinstance(bed, PileBed)
    rows = {"aligned": "rows along the slope", "horizontal": "level rows"}
    named = rows.get(bed.packing, f"{bed.packing}, seed {bed.seed}")
    size = f"{1e3 * scene.grain.diameter:g} mm, ρ_f {fluid.density:g} kg/m³, ν {fluid.viscosity:g}"
    return f"{bed.slope_deg:g}°, {size} m²/s, {named}"
