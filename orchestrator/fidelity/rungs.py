"""The ladder: named ways to answer a scene, cheap to dear, and which is known to be good enough.

A rung changes how a scene is answered, never what it asks. One rung is for the flow, one for the
grains. Their errors against the dearest pair are measured by ``orchestrator ladder`` and lie in
``known/rungs.csv``.
"""

import csv
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from orchestrator.runs import assets
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import PileBed, Scene

Part = Literal["flow", "grains"]
QUIET_ENOUGH = 6.0
"""A protocol that waits at least this long, sqrt(d/g'), holds the flow; a faster one is a ramp, and
its rate is a part of what is asked."""
LIFTS = 0.95
"""Lift over the weight at a grain's own threshold from which grains fly before they roll: of the
piles of the preset `paper` those below 0.93 have thresholds, those above 0.98 none."""
OCTAVES = 2.0
"""Flows are shared within this ratio of z0."""
DISORDERS = (0.02, 0.05, 0.2)
"""Sizes of disorder up to which errors are known together, d."""
KNOWN = "rungs.csv"


@dataclass(frozen=True)
class Rung:
    """One way to answer a scene.

    Attributes
    ----------
    name, meaning : str
        What tables call it, and what it is.
    of : callable
        The scene as this rung answers it.
    same_model : bool
        Whether it has the reference's model choices; another turbulence model has not.
    most_grains : int or None
        The ladder measures a dear rung on piles of no more exposed grains than this.
    on_lattices : bool
        Whether it leaves disordered packings alone: it would disorder more rows of them.
    """

    name: str
    meaning: str
    of: Callable[[Scene], Scene]
    same_model: bool = True
    most_grains: int | None = None
    on_lattices: bool = False


def changed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """A scene with some fields changed, named as in a study file."""
    updates: dict[str, dict[str, Any]] = {}
    for key, value in changes.items():
        part, _, field = key.partition(".")
        updates.setdefault(part, {})[field] = value
    parts = {name: getattr(scene, name) for name in Scene.model_fields}
    for part, update in updates.items():
        parts[part] = parts[part].model_copy(update=update)
    return Scene(**parts)


def _with(**fields: Any) -> Callable[[Scene], Scene]:
    """Change fields; their names are written with two underscores for the dot."""
    changes = {name.replace("__", "."): value for name, value in fields.items()}
    return lambda scene: changed(scene, changes)


def _dem(layers: int, *, slow: bool = False, **fields: Any) -> Callable[[Scene], Scene]:
    rules = SLOW if slow else FAST
    return _with(**{"bed__mobile_layers": layers, "protocol__method": "dem", **rules, **fields})


def _solve(cells: int, growth: float, **fields: Any) -> Callable[[Scene], Scene]:
    mesh = {"flow__cells_per_face": cells, "flow__growth": growth}
    return _with(flow__model="solve", flow__roughness=None, **mesh, **fields)


def _shared(scene: Scene) -> Scene:
    """The flow of the nearest z0 on a grid of octaves of h, which many scenes share."""
    assert isinstance(scene.bed, PileBed)
    octave = round(math.log(scene.bed.roughness / scene.bed.height, OCTAVES))
    nearest = float(f"{scene.bed.height * OCTAVES**octave:.6g}")
    return changed(_solve(40, 1.4)(scene), {"flow.roughness": nearest})


def _own_speed(scene: Scene) -> Scene:
    """The flow at the speed at which a single grain of the scene begins to move."""
    assert isinstance(scene.bed, PileBed)
    ustar = float(closed_form(scene).friction_velocity)
    lid = 10 * scene.bed.height
    speed = ustar / 0.41 * math.log1p(lid / scene.bed.roughness)
    return changed(_solve(40, 1.1)(scene), {"flow.speed": float(f"{speed:.6g}")})


def _paper_stiffness(scene: Scene) -> Scene:
    """The paper's K = 1e6 N/m."""
    spring = 1e6 * scene.grain.diameter / scene.weight
    return changed(_dem(1)(scene), {"grain.stiffness": spring})


FAST: dict[str, Any] = {
    "grain__stiffness": 1e3,
    "protocol__timestep": 0.3,
    "protocol__quiet": 6.0,
    "protocol__step": 0.03,
}
SLOW: dict[str, Any] = {
    "grain__stiffness": 1e4,
    "protocol__timestep": 0.2,
    "protocol__quiet": 10.0,
    "protocol__step": 0.01,
}
SLOWEST: dict[str, Any] = {"protocol__quiet": 15.0, "protocol__step": 0.004}
MODEL = "standard, with another turbulence model"
FULL = 1000
"""More layers than any pile has."""

FLOW = (
    Rung("flat", "log law on a flat bed: u*_0 everywhere", _with(flow__model="flat")),
    Rung("hill", "linear theory of the flow over a low hill", _with(flow__model="hill")),
    Rung("shared", "coarse; one solve for each octave of z0/h", _shared),
    Rung("coarse", "40 cells on a face, growing by 1.4 away from it", _solve(40, 1.4)),
    Rung("short", "20 cells on a face, growing by 1.1", _solve(20, 1.1)),
    Rung("medium", "40 cells on a face, growing by 1.2", _solve(40, 1.2)),
    Rung("standard", "40 cells on a face, growing by 1.1", _solve(40, 1.1)),
    Rung("own speed", "standard, solved at the scene's own U_e", _own_speed),
    Rung("fine", "80 cells on a face", _solve(80, 1.1)),
    Rung("finest", "160 cells on a face", _solve(160, 1.1), most_grains=50),
    Rung("RNG k-epsilon", MODEL, _solve(40, 1.1, flow__turbulence="RNGkEpsilon"), same_model=False),
    Rung(
        "realizable k-eps.",
        MODEL,
        _solve(40, 1.1, flow__turbulence="realizableKE"),
        same_model=False,
    ),
)
"""Rungs of the flow; they keep the height of the first cell, which is a part of the model."""

GRAINS = (
    Rung("pivot", "closed form with each grain's own stress", _with(protocol__method="pivot")),
    Rung(
        "peeling",
        "pivot with blocking by neighbours, without dynamics",
        _with(protocol__method="peeling"),
    ),
    Rung("1 layer, coarse", "DEM, 1 mobile layer, holds 6 % apart", _dem(1, protocol__step=0.06)),
    Rung("1 layer, fast", "DEM, 1 mobile layer, holds 3 % apart", _dem(1)),
    Rung("2 layers, fast", "DEM, 2 mobile layers, holds 3 % apart", _dem(2)),
    Rung("4 layers, fast", "DEM, 4 mobile layers, holds 3 % apart", _dem(4)),
    Rung("1 layer, slow", "DEM, 1 mobile layer, holds 1 % apart", _dem(1, slow=True)),
    Rung("2 layers, slow", "DEM, 2 mobile layers, holds 1 % apart", _dem(2, slow=True)),
    Rung("4 layers, slow", "DEM, 4 mobile layers, holds 1 % apart", _dem(4, slow=True)),
    Rung(
        "full pile, fast",
        "DEM, every grain mobile, holds 3 % apart",
        _dem(FULL),
        on_lattices=True,
    ),
    Rung(
        "paper's K, fast",
        "DEM, 1 mobile layer, K = 1e6 N/m, holds 3 % apart",
        _paper_stiffness,
        most_grains=40,
    ),
    Rung("soft reference", "the reference on softer grains, 4 layers", _dem(4, **SLOWEST)),
    Rung("reference", "DEM, 3 mobile layers, holds 0.4 % apart", _dem(3, slow=True, **SLOWEST)),
)
"""Rungs of the grains."""

LADDER: dict[Part, tuple[Rung, ...]] = {"flow": FLOW, "grains": GRAINS}


def rung(part: Part, name: str) -> Rung:
    """A rung by its name."""
    return next(one for one in LADDER[part] if one.name == name)


def names(scene: Scene) -> dict[Part, str]:
    """The rungs that a scene of a pile is answered on; "as asked" where it is none of them."""
    return {part: _name(part, scene) for part in LADDER}


def _name(part: Part, scene: Scene) -> str:
    return next((one.name for one in reversed(LADDER[part]) if one.of(scene) == scene), "as asked")


def error(scene: Scene) -> float:
    """Known relative error of a pile's tau_c on its rungs; infinite where it is not known.

    The largest over its fractions, with the reference's own uncertainty.
    """
    chosen = names(scene)
    return max(
        sum(
            (at := known_at(part, name, scene, fraction)).error + at.uncertainty
            for part, name in chosen.items()
        )
        for fraction in scene.protocol.fractions
    )


def choose(scene: Scene, tolerance: float, *, above: Mapping[Part, str] | None = None) -> Scene:
    """A scene on the cheapest rungs that are known to be within a tolerance of the dearest.

    Parameters
    ----------
    scene : Scene
        Resolved. One that asks for a ramp, or for less than DEM on a solved flow, stays as it is.
    tolerance : float
        Relative error of tau_c at each of the scene's fractions.
    above : mapping, optional
        For each part the rung that turned out to be not good enough: a dearer one is chosen.

    Returns
    -------
    Scene
        On the rungs with the least known error where none is within the tolerance; as asked where
        nothing is known.
    """
    if not is_open(scene):
        return scene
    if not isinstance(scene.bed, PileBed):
        # the closed form is exact for one grain in a held flow
        return changed(scene, {"protocol.method": "pivot"})
    least: Mapping[Part, str] = {"grains": "peeling"} if flies(scene) else {}
    like = tuple((part, likeness(part, scene)) for part in LADDER)
    fractions, beyond = tuple(scene.protocol.fractions), tuple((above or least).items())
    for chosen in _cheapest(like, fractions, beyond, tolerance):
        scene = chosen.of(scene)
    return scene


def is_open(scene: Scene) -> bool:
    """Whether a scene leaves it to the tool how it is answered."""
    return (
        scene.protocol.method == "dem"
        and scene.flow.model == "solve"
        and scene.protocol.quiet >= QUIET_ENOUGH
    )


def flies(scene: Scene) -> bool:
    """Whether the lift carries a grain before it rolls, which DEM alone shows."""
    return float(closed_form(scene).lift) >= LIFTS * scene.weight


def meaning(part: Part, name: str) -> str:
    """What a rung is; nothing for a scene that is on none."""
    return next((one.meaning for one in LADDER[part] if one.name == name), "")


@cache  # a study has thousands of scenes of a few kinds
def _cheapest(
    like: tuple[tuple[Part, str], ...],
    fractions: tuple[float, ...],
    above: tuple[tuple[Part, str], ...],
    tolerance: float,
) -> tuple[Rung, ...]:
    """A rung for each part, the cheapest of those within; none where nothing is known."""
    pairs = sorted(_pairs(like, fractions, dict(above)), key=lambda pair: pair.cost)
    within = (pair for pair in pairs if pair.error <= tolerance)
    best = next(within, None) or min(pairs, key=lambda pair: pair.error, default=None)
    return () if best is None or math.isinf(best.error) else best.rungs


@dataclass(frozen=True)
class _Pair:
    rungs: tuple[Rung, ...]
    error: float
    cost: float


def _pairs(
    like: tuple[tuple[Part, str], ...], fractions: tuple[float, ...], above: Mapping[Part, str]
) -> Iterator[_Pair]:
    for pair in itertools.product(*(_open_rungs(part, above) for part, _ in like)):
        at = [
            [
                _known_of(part, one.name, kind, fraction)
                for one, (part, kind) in zip(pair, like, strict=True)
            ]
            for fraction in fractions
        ]
        error = max(sum(one.error for one in both) for both in at)
        yield _Pair(pair, error, sum(one.cost_core_s for one in at[0]))


def _open_rungs(part: Part, above: Mapping[Part, str]) -> tuple[Rung, ...]:
    listed = [one.name for one in LADDER[part]]
    start = listed.index(above[part]) + 1 if part in above else 0
    return tuple(one for one in LADDER[part][start:] if one.same_model)


def known_at(part: Part, name: str, scene: Scene, fraction: float) -> "Known":
    """What is known of a rung on a pile at a fraction; infinite errors where nothing is."""
    return _known_of(part, name, likeness(part, scene), fraction)


def _known_of(part: Part, name: str, like: str, fraction: float) -> "Known":
    rows = known().get((part, name, like), {})
    if fraction in rows or not rows:
        return rows.get(fraction, UNKNOWN)
    # between the fractions that were measured the worst of them has to do
    return max(rows.values(), key=lambda row: row.error)


def likeness(part: Part, scene: Scene) -> str:
    """The kind of scene that a rung's error is known for.

    The flow's depends on how the stress is read, the grains' on their packing; both on whether the
    slope is the limiting one, on which a row waits for a touch.
    """
    assert isinstance(scene.bed, PileBed)
    ending = ", limiting slope" if scene.bed.slope_deg > scene.limiting_slope_deg - 1 else ""
    if part == "flow":
        return scene.flow.stress + ending
    packing: str = scene.bed.packing
    if packing == "disordered":
        size = next(size for size in DISORDERS if scene.bed.disorder <= size)
        packing = f"disordered up to {size:g} d"
    return packing + ending


@dataclass(frozen=True)
class Known:
    """What is known of a rung on one kind of scene, at one fraction.

    Attributes
    ----------
    error : float
        Largest relative error of tau_c against the reference.
    uncertainty : float
        How far the reference itself moved when its numbers were changed.
    cost_core_s : float
        Mean core-seconds of a scene.
    """

    error: float
    uncertainty: float
    cost_core_s: float


UNKNOWN = Known(math.inf, 0.0, math.inf)


@cache
def known() -> dict[tuple[str, str, str], dict[float, Known]]:
    """What is known, by part, rung and likeness, then by fraction."""
    found: dict[tuple[str, str, str], dict[float, Known]] = {}
    with (assets.known() / KNOWN).open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            key = (row["part"], row["rung"], row["like"])
            numbers = (float(row[name]) for name in ("error", "uncertainty", "cost_core_s"))
            value = Known(*numbers)
            found.setdefault(key, {})[float(row["fraction"])] = value
    return found
