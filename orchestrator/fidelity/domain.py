"""The domain of the numerical errors: over which scenes they were measured.

``calibration/domain.csv`` has the values that the measured scenes of each class had of
each quantity: numbers from the least to the most, or words. `orchestrator ladder`
writes it beside its errors. Outside of it no error is known, whatever the class.

Every field of a study file is a quantity of its own, or belongs to one of `SIMILAR`, in
whose dimensionless numbers scenes of any scale are alike. So a field that is new is
part of the domain by itself: with the values that it had while errors were measured.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pandas as pd

from orchestrator.digits import enumerated
from orchestrator.fidelity import measured
from orchestrator.fidelity.classes import (
    BY_DEM,
    FLOW,
    GRAINS,
    lift_over_weight,
    scene_class,
)
from orchestrator.fidelity.fidelities import FIDELITIES
from orchestrator.fidelity.measured import Spanned
from orchestrator.study.closed_form import flow_roughness, single_grain
from orchestrator.study.criterion import ENTRAINED, SUSTAINED
from orchestrator.study.fields import FIELDS, SEED
from orchestrator.study.fields import Quantity as Field
from orchestrator.study.parts import LogNormal, PileBed
from orchestrator.study.scene import Scene, default_first_cell_height
from orchestrator.study.scopes import APPLIES

FILE = measured.FOLDER / "domain.csv"
NEAR = 0.02
"""Relative distance from a measured number up to which one counts as measured."""
CRITERION = "threshold.criterion"
"""A quantity that every scene has."""
FRACTIONS = "threshold.fractions"
"""The quantity of which one value that was measured is enough: each has its error."""
MOST_NAMED = 3
"""Quantities outside of what was measured that a reason names; it counts the others."""
NONE, GIVEN = "none", "given"
"""Words of a field without a value, and of one whose value is a table or a file."""
Value = float | str
Read = Callable[[Scene], Iterable[Value]]
SOLVED = (
    "method.flow.speed",
    "method.flow.viscosity",
    "method.flow.roughness",
    "method.flow.first_cell_height",
)
"""Numbers of a solve that are judged by what they give."""
OPEN_ABOVE = (
    "method.flow.lid",
    "method.flow.upstream",
    "method.flow.downstream",
)
"""Lengths of the flow's domain: one that is longer is as good."""
OF_FLOW = (
    "method.flow.",
    "flow.top",
    "flow.depth",
    "bed.obstacles",
    "forces.stress",
    "forces.averaging_length",
)
"""Beginnings of the names of what acts on grains through the stress alone."""
OF_GRAINS = ("method.grains.",)
"""The same of what no flow feels."""


@dataclass(frozen=True)
class MeasuredQuantity:
    """A number or a word of a scene of which the measured values are kept.

    Attributes
    ----------
    name
        Its name in the file and in reasons.
    fields
        The fields of a study file that it stands for.
    read
        Finds its values in a scene; none where it has no effect.
    """

    name: str
    fields: tuple[str, ...]
    read: Read

    def is_of(self, part: str) -> bool:
        """Whether the error of a part of a pile depends on it.

        Parameters
        ----------
        part
            `FLOW` or `GRAINS`.

        Returns
        -------
        bool
            Whether it does.
        """
        others = OF_GRAINS if part == FLOW else OF_FLOW
        return not self.name.startswith(others)


def _bed(scene: Scene) -> PileBed:
    assert isinstance(scene.bed, PileBed)
    return scene.bed


def _over_diameter(scene: Scene) -> Iterator[float]:
    """The height of what the flow goes over; a level bed has none."""
    bed = _bed(scene)
    if not bed.is_level:
        yield bed.relief / scene.grain.diameter


def _level_length(scene: Scene) -> Iterator[float]:
    """The length of the level part of a form in heights."""
    bed = _bed(scene)
    if not bed.is_level and "length" in bed.form.fields:
        yield bed.level_length / bed.relief


def _length_of_level(scene: Scene) -> Iterator[float]:
    """The length of a level bed in diameters."""
    bed = _bed(scene)
    if bed.is_level:
        yield bed.level_length / scene.grain.diameter


def _spacing(scene: Scene) -> Iterator[Value]:
    spacing = _bed(scene).spacing
    yield NONE if spacing is None else spacing / _bed(scene).relief


def _brink(scene: Scene) -> Iterator[float]:
    yield _bed(scene).brink_radius / _bed(scene).relief


def _depth(scene: Scene) -> Iterator[float]:
    bed = _bed(scene)
    if scene.flow.depth:
        yield scene.flow.depth / (scene.grain.diameter if bed.is_level else bed.relief)


def _counted(scene: Scene) -> Iterator[str]:
    counts = scene.counts
    yield counts if isinstance(counts, str) else "range"


def _lee_slope(scene: Scene) -> Iterator[float]:
    if not _bed(scene).profile:
        yield _bed(scene).lee_slope


def _sizes(scene: Scene) -> Iterator[str]:
    if scene.is_poured:
        sizes = scene.grain.sizes
        word = "log-normal" if isinstance(sizes, LogNormal) else "a sieve table"
        yield NONE if sizes is None else word


def _sigma(scene: Scene) -> Iterator[float]:
    if isinstance(scene.grain.sizes, LogNormal):
        yield scene.grain.sizes.sigma_g


def _smallest(scene: Scene) -> Iterator[float]:
    if isinstance(scene.grain.sizes, LogNormal):
        yield scene.grain.sizes.ends[0]


def _largest(scene: Scene) -> Iterator[float]:
    if isinstance(scene.grain.sizes, LogNormal):
        yield scene.grain.sizes.ends[1]


def _obstacles(scene: Scene) -> Iterator[float]:
    yield float(len(scene.obstacles))


def _kinds(scene: Scene) -> Iterator[str]:
    yield from (each.kind for each in scene.obstacles)


def _places(scene: Scene) -> Iterator[float]:
    yield from (each.x / _bed(scene).relief for each in scene.obstacles)


def _heights(scene: Scene) -> Iterator[float]:
    yield from (each.height / _bed(scene).relief for each in scene.obstacles)


def _porosities(scene: Scene) -> Iterator[float]:
    yield from (each.porosity for each in scene.obstacles if each.kind == "fence")


def _lengths(scene: Scene) -> Iterator[float]:
    for each in scene.obstacles:
        if each.kind == "block":
            yield (each.length or each.height) / each.height


def _criterion(scene: Scene) -> Iterator[str]:
    yield SUSTAINED if scene.threshold.criterion == SUSTAINED else ENTRAINED


def _galileo(scene: Scene) -> Iterator[float]:
    yield float(single_grain(scene).galileo)


OBSTACLES = ("bed.obstacles",)
SIZES = ("grain.sizes",)
SIMILAR: tuple[MeasuredQuantity, ...] = (
    MeasuredQuantity(
        "grain.density/fluid.density",
        ("grain.density", "fluid.density"),
        lambda scene: [scene.grain.density / scene.fluid.density],
    ),
    MeasuredQuantity(
        "Galileo number",
        ("grain.diameter", "fluid.viscosity", "fluid.gravity"),
        _galileo,
    ),
    MeasuredQuantity("lift/weight", (), lambda scene: [lift_over_weight(scene)]),
    MeasuredQuantity("bed.height/grain.diameter", ("bed.height",), _over_diameter),
    MeasuredQuantity(
        "bed.roughness/grain.diameter",
        ("bed.roughness",),
        lambda scene: [scene.bed.roughness / scene.grain.diameter],
    ),
    MeasuredQuantity("bed.lee_slope_deg", ("bed.lee_slope_deg",), _lee_slope),
    MeasuredQuantity("bed.length/bed.height", ("bed.length",), _level_length),
    MeasuredQuantity("bed.length/grain.diameter", ("bed.length",), _length_of_level),
    MeasuredQuantity("bed.spacing/bed.height", ("bed.spacing",), _spacing),
    MeasuredQuantity("bed.brink_radius/bed.height", ("bed.brink_radius",), _brink),
    MeasuredQuantity("bed.counted", ("bed.counted",), _counted),
    MeasuredQuantity("flow.depth/bed.height", ("flow.depth",), _depth),
    MeasuredQuantity("bed.obstacles: number", OBSTACLES, _obstacles),
    MeasuredQuantity("bed.obstacles: kind", OBSTACLES, _kinds),
    MeasuredQuantity("bed.obstacles: x/bed.height", OBSTACLES, _places),
    MeasuredQuantity("bed.obstacles: height/bed.height", OBSTACLES, _heights),
    MeasuredQuantity("bed.obstacles: length/height", OBSTACLES, _lengths),
    MeasuredQuantity("bed.obstacles: porosity", OBSTACLES, _porosities),
    MeasuredQuantity("grain.sizes", SIZES, _sizes),
    MeasuredQuantity("grain.sizes.sigma_g", SIZES, _sigma),
    MeasuredQuantity("grain.sizes.smallest", SIZES, _smallest),
    MeasuredQuantity("grain.sizes.largest", SIZES, _largest),
    MeasuredQuantity(CRITERION, (CRITERION, "fluid.kind"), _criterion),
    MeasuredQuantity(FRACTIONS, (FRACTIONS,), lambda scene: scene.threshold.fractions),
)
"""Quantities of several fields, without a unit, or of a field that is a table."""


def _of_rungs() -> frozenset[str]:
    """The fields that tell the rungs of a fidelity apart, which have errors each."""
    names = set()
    for one in FIDELITIES:
        names |= {*one.flow.sets, *one.grains.sets}
    return frozenset(names)


APART: Mapping[str, Iterable[str]] = {
    "a rung of the fidelities has its own error": _of_rungs(),
    "judged by what they give": SOLVED,
    "a draw among beds that are alike": (SEED,),
    "ends a run, and moves no grain before it": ("method.grains.final_fraction",),
    "its error is measured in the run": ("method.flow.between",),
}
"""Fields that are in no quantity, by the reason."""


def _own(field: Field) -> Read:
    """How a field is read that is a quantity by itself."""

    def read(scene: Scene) -> Iterator[Value]:
        if not APPLIES[field.info.scope](scene):
            return
        value = field.read(scene)
        if value is None:
            yield NONE
        elif isinstance(value, str):
            yield value
        elif isinstance(value, int | float):
            yield float(value)
        else:
            yield GIVEN if value else NONE

    return read


def _quantities() -> tuple[MeasuredQuantity, ...]:
    """Those of `SIMILAR`, and each other field by itself."""
    taken: set[str] = set()
    for names in APART.values():
        taken.update(names)
    for one in SIMILAR:
        taken.update(one.fields)
    own = [each for each in FIELDS if each.name not in taken]
    fields = [MeasuredQuantity(each.name, (each.name,), _own(each)) for each in own]
    return tuple(sorted((*fields, *SIMILAR), key=_place))


def _place(quantity: MeasuredQuantity) -> int:
    """The place of a quantity in a reason: what makes the bed what it is comes first.

    Beds with obstacles were measured with few grains and laws. That the obstacle is
    another one is then the reason against a bed beside one that has none.
    """
    beginnings = ("bed.obstacles", "bed.")
    for place, beginning in enumerate(beginnings):
        if quantity.name.startswith(beginning):
            return place
    return len(beginnings)


QUANTITIES = _quantities()
"""All quantities, in the order in which reasons name the first that is outside."""


def of(scenes: Mapping[str, Sequence[Scene]]) -> pd.DataFrame:
    """Find the domain of the errors that were measured on some scenes.

    Parameters
    ----------
    scenes
        The scenes on which the errors of each part were measured.

    Returns
    -------
    DataFrame
        For each part, class and quantity a row with the least and the most of its
        numbers, and a row for each of its words.
    """
    rows: list[dict[str, Value]] = []
    for part, alike in scenes.items():
        found: dict[tuple[str, str], list[Value]] = {}
        for scene in alike:
            name = scene_class(part, scene)
            for quantity in QUANTITIES:
                if quantity.is_of(part):
                    values = found.setdefault((name, quantity.name), [])
                    values += quantity.read(scene)
        for (name, quantity_name), values in found.items():
            place = {"part": part, "scene_class": name, "quantity": quantity_name}
            rows += [{**place, **row} for row in _rows(quantity_name, values)]
    columns = ["part", "scene_class", "quantity", "least", "most", "word"]
    table = pd.DataFrame(rows, columns=columns)
    return table.sort_values(["part", "scene_class", "quantity", "word"])


def _rows(quantity: str, values: Iterable[Value]) -> Iterator[dict[str, Value]]:
    """The rows of some values: one of all numbers, and one of each word."""
    numbers = [value for value in values if isinstance(value, float)]
    if numbers:
        row: dict[str, Value] = {"least": min(numbers)}
        if quantity not in OPEN_ABOVE:
            row["most"] = max(numbers)
        yield row
    for word in sorted({value for value in values if isinstance(value, str)}):
        yield {"word": word}


def outside(part: str, scene: Scene) -> str:
    """Name the quantities of a pile that are outside of what was measured.

    Parameters
    ----------
    part
        `FLOW` or `GRAINS`.
    scene
        The scene of a pile.

    Returns
    -------
    str
        The first `MOST_NAMED` of them, with the values that were measured, in words;
        empty where there is none. Of a class that was not measured it is the bed.
    """
    return _outside(part, scene, measured.folder())


@cache  # a study asks it of each fidelity
def _outside(part: str, scene: Scene, _: Path) -> str:
    name = scene_class(part, scene)
    domain = measured.domain()
    if (part, name, CRITERION) not in domain:
        return "such a bed"
    found = []
    for quantity in QUANTITIES:
        if not quantity.is_of(part):
            continue
        spanned = domain.get((part, name, quantity.name))
        values = [*quantity.read(scene)]
        beyond = [value for value in values if not _is_within(value, spanned)]
        if quantity.name == FRACTIONS and len(beyond) < len(values):
            continue
        if beyond:
            found.append(_in_words(quantity.name, spanned))
    told = found[:MOST_NAMED]
    if len(found) > MOST_NAMED:
        told.append(f"{len(found) - MOST_NAMED} more")
    return enumerated(told)


def has_measured(scene: Scene, fraction: float) -> bool:
    """Whether errors of a pile were measured at a fraction of its grains.

    Parameters
    ----------
    scene
        The scene of a pile.
    fraction
        Fraction n/N of the counted grains.

    Returns
    -------
    bool
        Whether the fraction is between those that were measured on its class.
    """
    return all(
        _has_measured(part, scene_class(part, scene), fraction)
        for part in _parts(scene)
    )


def _has_measured(part: str, name: str, fraction: float) -> bool:
    """Whether errors of a class were measured at a fraction, or on both sides of it."""
    return _is_within(fraction, measured.domain().get((part, name, FRACTIONS)))


def unmeasured(scene: Scene, *, by_dem: bool = False) -> str:
    """Name the property of a pile for which no error was measured.

    Parameters
    ----------
    scene
        The scene of a pile, as it is asked for or as it is answered.
    by_dem
        Whether its grains are to be moved in time.

    Returns
    -------
    str
        The property in words; empty where there is none.
    """
    is_packed = scene.method.may_pack_grains
    if not is_packed and scene.threshold.criterion != SUSTAINED:
        return f'method.kind = "{scene.method.kind}"'
    for part in _parts(scene):
        if found := outside(part, scene):
            return found
    if by_dem and (found := outside(BY_DEM, scene)):
        return f"DEM of {found}"
    if scene.method.flow.facts.is_solved:
        return _unmeasured_solve(scene)
    return ""


def _parts(scene: Scene) -> Iterator[str]:
    """The parts of a pile that have an error.

    Over a level bed the flow has none; nor have places along a bed line, with which
    grains in sustained motion are answered in closed form.
    """
    if not _bed(scene).is_level:
        yield FLOW
    if scene.method.may_pack_grains:
        yield GRAINS


def _unmeasured_solve(scene: Scene) -> str:
    """The number of a solved flow for which nothing was measured, in words."""
    bed = _bed(scene)
    roughness = scene.method.flow.roughness
    default = default_first_cell_height(bed.relief, scene.solve_roughness)
    if abs(scene.first_cell_height / default - 1) > NEAR:
        cell = scene.first_cell_height
        return f"first cells of {cell:.3g} m in place of {default:.3g} m"
    if not roughness:
        return ""
    for near in (bed.roughness, flow_roughness(scene) or bed.roughness):
        if abs(math.log2(roughness / near)) <= 0.5 + 1e-6:
            return ""
    return f"method.flow.roughness = {roughness:.3g} m"


def _is_within(value: Value, spanned: Spanned | None) -> bool:
    """Whether a value is one of those measured, or between them."""
    if spanned is None:
        return False
    if isinstance(value, str):
        return value in spanned.words
    margin = NEAR * abs(value)
    return spanned.least - margin <= value <= spanned.most + margin


def _in_words(name: str, spanned: Spanned | None) -> str:
    """A quantity with what was measured of it."""
    if spanned is None:
        return name
    least, most = spanned.least, spanned.most
    words = [*spanned.words]
    has_numbers = least <= most
    if words == [NONE] and not has_numbers:
        return name
    if has_numbers:
        if math.isinf(most):
            return f"{name} below {least:.3g}"
        if most - least > NEAR * abs(most):
            return f"{name} outside {least:.3g} … {most:.3g}"
        words.append(f"{least:.3g}")
    return f"{name} other than {', '.join(words)}"
