"""The choices that every fidelity level shares, and what else each could have been.

A choice is changed alone, within what measurements and good practice leave open. Each is answered
on the cheapest levels that feel it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from orchestrator.errors import InputError
from orchestrator.fidelity.levels import Fields, Levels, changed
from orchestrator.fidelity.spread import FROZEN
from orchestrator.physics.laws import LAWS
from orchestrator.study.closed_form import law_holds
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene, roughness_length

QUASISTATIC, DYNAMIC = "peeling", "1 layer, fast"
"""Levels of the grains on which a choice is changed: without dynamics, and for those that dynamics
alone feel."""
DYNAMIC_POURED = "4 layers, fast"
"""The same on poured beds, where fewer mobile layers hold back the grains on them."""
COARSE = "coarse"
"""Level of a solved flow; another flow model is kept."""
SEEDS = (1, 2, 3)
"""How many other draws of a random packing are as good."""
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
    grains : str
        The level of the grains on which it is changed.
    of_solved_flow : bool
        Whether it moves nothing under a flow that is not solved.
    """

    name: str
    why: str
    others: Callable[[Scene], Alternatives]
    grains: str
    of_solved_flow: bool = False

    def levels(self, scene: Scene) -> Levels:
        """The levels on which it is changed in a scene."""
        poured = scene.is_poured and self.grains == DYNAMIC
        grains: Levels = {"grains": DYNAMIC_POURED if poured else self.grains}
        return {"flow": COARSE, **grains} if scene.flow.model == "solve" else grains

    def scenes(self, scene: Scene) -> Iterator[tuple[str, Scene]]:
        """The scene with each alternative that can be asked of it, by the alternative's name."""
        if self.of_solved_flow and scene.flow.model != "solve":
            return
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


def _pockets(scene: Scene) -> Alternatives:
    """Angles of a lattice's pockets; the grains of a poured bed have their own."""
    return {} if scene.is_poured else _beside("bed.entrainment_angle_deg", -5.0, 5.0)(scene)


def _exposures(scene: Scene) -> Alternatives:
    return _fixed("forces.exposure", "alike", "protrusion")(scene) if scene.is_poured else {}


def _packings(scene: Scene) -> Alternatives:
    """Other seeds of a poured bed; else the other packings of the plane, random gaps by seeds."""
    if scene.is_poured:
        return {f"poured, seed {seed}": {"bed.seed": seed} for seed in SEEDS}
    rows = {"rows along the slope": "aligned", "level rows": "horizontal"}
    found: dict[str, Fields] = {name: {"bed.packing": value} for name, value in rows.items()}
    for seed in SEEDS:
        gaps = {"bed.packing": "disordered", "bed.disorder": 0.05, "bed.seed": seed}
        found[f"random gaps, seed {seed}"] = gaps
    return found


CHOICES = (
    Choice(
        "first cell",
        "A wall function asks for no one height of the cells on the bed.",
        _first_cells,
        QUASISTATIC,
        of_solved_flow=True,
    ),
    Choice(
        "turbulence model",
        "No model is right for all flows that separate.",
        _fixed("flow.turbulence_model", "kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"),
        QUASISTATIC,
        of_solved_flow=True,
    ),
    Choice(
        "reading of the stress",
        "The paper reads it off the first cells by Eq. 10.",
        _fixed("forces.stress", "wall", "eq10"),
        QUASISTATIC,
        of_solved_flow=True,
    ),
    Choice(
        "averaging length",
        "The stress at a sharp crest has no limit; it is averaged on a length.",
        _around("forces.averaging_length", 0.5, 2.0),
        QUASISTATIC,
        of_solved_flow=True,
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
        _pockets,
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
        "exposure",
        "The flow meets all grains of a poured bed at one height, or each at its own.",
        _exposures,
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
        "That of a sand is known to a few degrees. A poured bed is poured anew by it.",
        _beside("grain.friction_angle_deg", -5.0, 5.0),
        DYNAMIC,
    ),
    Choice(
        FROZEN,
        "The paper, and every level, keeps the flow of the whole pile until the last grain has "
        "gone. Else the bed line is drawn anew after each tenth.",
        _fixed("protocol.update", 0.1),
        QUASISTATIC,
        of_solved_flow=True,
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
    slope = "level" if bed.shape == "flat" else f"{bed.slope_deg:g}°"
    return f"{slope}, {size} m²/s, {named}"
