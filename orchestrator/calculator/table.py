"""Thresholds of many single grains under every force law, as one table."""

import itertools
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.calculator import (
    BY_FLUID,
    CRITERIA,
    GOES_ON,
    LARGEST_DEPTH,
    LEAVES,
    OF_FLUID,
    PARAMETERS,
    QUANTITIES,
)
from orchestrator.errors import InputError
from orchestrator.physics import saltation, verdict
from orchestrator.physics.beside import beside, measured_level_ustar
from orchestrator.physics.constants import GAS_BELOW, GRAIN_COLUMNS
from orchestrator.physics.laws import DEFAULT, LAWS, Exposure, law
from orchestrator.physics.threshold import (
    AUTO,
    LAWS_OF,
    PAPER,
    SingleGrain,
    Threshold,
    default_laws,
    regime,
    standing_out,
    threshold,
    why_not,
)
from orchestrator.physics.velocity import (
    LAMINAR_BELOW,
    measurable_speeds,
    open_water_reynolds,
)
from orchestrator.types import BoolArray, FloatArray, Row

Table = dict[str, NDArray[Any]]
"""Columns of equal length by their names."""
OF_PAPER = (PAPER, *LAWS_OF["transition"])
"""Laws of the paper, which are of grains that leave their pockets."""


def thresholds(
    points: Mapping[str, Any],
    asked: str = AUTO,
    criterion: str = BY_FLUID,
) -> Table:
    """Find the thresholds of single grains under every force law.

    Parameters
    ----------
    points
        Sequences of equal length by keys of `PARAMETERS`. A parameter that is left out
        has its default, and the depth none. Without a number of the fluid it is the
        paper's gas.
    asked
        The law that is asked for, ``auto`` for the default law, or ``paper`` for the
        paper's rule.
    criterion
        What a grain must do: one of `CRITERIA`, or `BY_FLUID`. Grains that go on leave
        their pockets in a gust of `saltation.PEAK` times the mean stress and hop on
        after it; their threshold is the larger of the two mean stresses. Grains that
        cannot hop go on where the mean stress turns them over their neighbours.

    Returns
    -------
    dict of str to ndarray
        A row for each point and law, point by point. A gas has winds, a liquid of a
        given depth a mean velocity where its flow is turbulent; the others are NaN. The
        column ``answer`` is whether the law is one of those asked for. Grains that go
        on have the columns `OF_CRITERION` as well: both stresses, that at which motion
        ceases, and the criterion that decides.

    Raises
    ------
    InputError
        For a law, a criterion or a depth that is none, a point that is no scene, or if
        no law holds anywhere.

    Examples
    --------
    >>> table = thresholds({"diameter": [1e-3]}, asked="bridged")
    >>> is_asked = table["answer"]
    >>> print(table["law"][is_asked], table["ustar_m_s"][is_asked].round(3))
    ['bridged'] [0.89]
    """
    _check_law(asked)
    _check_criterion(criterion)
    grains = _grains(points)
    if criterion == BY_FLUID:
        criterion = _criterion(points, asked)
    if criterion == GOES_ON and asked in OF_PAPER:
        what = f"the law {asked} is of grains that leave their pockets"
        remedy = f"take the criterion {LEAVES}, or another law"
        raise InputError(what, "threshold: criterion", remedy)
    if "depth" in points:
        _check_depth(grains)
    # numbers beyond all floats end as laws that do not hold
    with np.errstate(all="ignore"):
        table = _of_all_laws(grains, asked, criterion)
    if criterion == GOES_ON and not np.isfinite(table["shields"]).any():
        remedy = f"take the criterion {LEAVES}, or a larger grain"
        raise InputError(verdict.NO_START, "threshold: criterion", remedy)
    if not table["valid"].any():
        place = int(np.argmax(table["answer"]))
        reason = f"{table['law'][place]}: {table['law_ends'][place]}"
        remedy = "are all numbers in SI units?"
        raise InputError(f"no force law holds; {reason}", "threshold", remedy)
    judge(table)
    return table


def _check_criterion(criterion: str) -> None:
    """Refuse a criterion that is none."""
    if criterion not in (*CRITERIA, BY_FLUID):
        what = f"no criterion {criterion!r}"
        remedy = f"choose {', '.join(CRITERIA)}, {BY_FLUID}"
        raise InputError(what, "threshold: criterion", remedy)


def _of_all_laws(grains: Table, asked: str, criterion: str) -> Table:
    """The thresholds of grains under every law, a row for each grain and law."""
    exposure = _exposure(grains)
    inputs = {each.column: grains[name] for name, each in PARAMETERS.items()}
    by_law = {name: _threshold(name, exposure, grains) for name in LAWS}
    regimes = regime(by_law["low"], by_law["high"]).astype(object)
    picked = _picked(asked, regimes, by_law[DEFAULT].friction_velocity, exposure)
    hopping = _hopping(grains) if criterion == GOES_ON else None
    level = _level_ustar(grains, criterion, by_law, hopping)
    blocks = []
    for name, at in by_law.items():
        block = _block(name, at, exposure, grains)
        kind: Table = {**inputs, "force_law": block["law"]}
        if hopping is not None:
            block = _going_on(block, hopping, exposure, grains)
            kind["criterion"] = np.full(len(block["law"]), GOES_ON, object)
        block["regime"] = regimes
        measured = beside({**block, **kind})
        block |= measured
        block["level_ustar_m_s"] = level[name]
        block["measured_level_ustar_m_s"] = measured_level_ustar({**inputs, **measured})
        block["answer"] = np.array([name in laws for laws in picked])
        blocks.append(block)
    table = {name: np.repeat(column, len(LAWS)) for name, column in inputs.items()}
    for name in blocks[0]:
        of_laws = [block[name] for block in blocks]
        table[name] = np.stack(of_laws, axis=1).ravel()
    return table


def _level_ustar(
    grains: Table,
    criterion: str,
    by_law: Mapping[str, Threshold],
    hopping: "_Hopping | None",
) -> dict[str, FloatArray]:
    """Friction velocity of each grain on a level bed, m/s, by the force law."""
    is_sloping = grains["slope_deg"] != 0
    if is_sloping.any():
        grains = {**grains, "slope_deg": np.zeros(len(is_sloping))}
        exposure = _exposure(grains)
        by_law = {name: _threshold(name, exposure, grains) for name in LAWS}
        hopping = _hopping(grains) if criterion == GOES_ON else None
    found = {}
    for name, at in by_law.items():
        ustar = at.friction_velocity
        if hopping is not None:
            further = hopping.thresholds.initiation(saltation.PEAK)
            moved = saltation.motion(at.shields, further, hopping.can).shields
            ustar = ustar * np.sqrt(moved / at.shields)
        found[name] = ustar
    return found


def _exposure(grains: Table) -> Exposure:
    """The grains in their fluids."""
    return Exposure(
        diameter=grains["diameter"],
        roughness=grains["roughness"],
        fluid_density=grains["fluid_density"],
        viscosity=grains["viscosity"],
        lift_coefficient=grains["lift_coefficient"],
    )


def judge(table: Table, of_depth: Sequence[str] = ()) -> None:
    """Say whether the thresholds of a table are usable, and what speaks against them.

    A law whose flow in open water may be laminar is not valid.

    Parameters
    ----------
    table
        The table of `thresholds`, with any depth; it gets the columns of the verdict.
    of_depth
        What is against the depth of each; empty where nothing is.
    """
    with np.errstate(all="ignore"):
        reynolds = open_water_reynolds(
            table["ustar_m_s"],
            roughness=table["z0_m"],
            viscosity=table["nu_m2_s"],
            depth=table["depth_m"],
        )
    is_laminar = reynolds < LAMINAR_BELOW
    is_laminar &= table["rho_f_kg_m3"] >= GAS_BELOW
    table["valid"] &= ~is_laminar
    flow = np.where(table["rho_f_kg_m3"] < GAS_BELOW, np.nan, reynolds)
    columns = {
        **table,
        "force_law": table["law"],
        "law": table["law_ends"],
        "law_remedy": table["law_remedy"],
        "flow_reynolds": flow,
        "standing_out": standing_out(1.0, table["beta_deg"]),
    }
    if "decides" in table:
        columns["criterion"] = np.full(len(flow), GOES_ON, object)
    cells = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in cells]
    reasons = [
        [*verdict.of_grain(row), *verdict.of_measurements(row, is_closed=True)]
        for row in rows
    ]
    for place, text in enumerate(of_depth):
        if text:
            reasons[place].append(verdict.Reason("depth", text))
            table["valid"][place] = False
    for name, values in verdict.columns(rows, reasons).items():
        is_word = name != "usable"
        table[name] = np.array(values, object if is_word else bool)


def why_no_depth(depth: float, diameter: float) -> str:
    """Say why a depth is none of a flow over a bed of grains.

    Parameters
    ----------
    depth
        The depth, m.
    diameter
        Diameter of the grains, m.

    Returns
    -------
    str
        The reason; empty for a depth that covers the grains and is no more than
        `LARGEST_DEPTH`.

    Examples
    --------
    >>> why_no_depth(4e-4, 5e-4)
    'a depth of 0.0004 m does not cover a grain of 0.0005 m'
    """
    if not depth > diameter:
        return f"a depth of {depth:g} m does not cover a grain of {diameter:g} m"
    if depth > LARGEST_DEPTH:
        return f"a depth of {depth:g} m is deeper than {LARGEST_DEPTH:g} m"
    return ""


def _check_law(asked: str) -> None:
    """Refuse a law that is none."""
    if asked in (AUTO, PAPER):
        return
    try:
        law(asked)
    except InputError as error:
        remedy = f"{error.remedy}, {AUTO}, {PAPER}"
        raise InputError(error.what, "threshold: law", remedy) from None


def _check_depth(grains: Table) -> None:
    """Refuse a depth that no flow over the grains has, or that of a gas."""
    density = grains["fluid_density"]
    remedy = "give the depth of a liquid, in m; of water: fluid.kind water"
    pairs = zip(grains["depth"].tolist(), grains["diameter"].tolist(), strict=True)
    for what in itertools.starmap(why_no_depth, pairs):
        if what:
            raise InputError(what, "threshold: depth", remedy)
    if (density < GAS_BELOW).all():
        what = f"{density[0]:g} kg/m3 is a gas"
        raise InputError(what, "threshold: depth", remedy)


def _threshold(name: str, exposure: Exposure, grains: Table) -> Threshold:
    """The thresholds of the grains under one force law."""
    return threshold(
        LAWS[name],
        exposure,
        density=grains["density"],
        slope_deg=grains["slope_deg"],
        gravity=grains["gravity"],
        entrainment_angle_deg=grains["entrainment_angle_deg"],
        cohesion=grains["cohesion"],
    )


def _block(name: str, at: Threshold, exposure: Exposure, grains: Table) -> Table:
    """The columns that the threshold under one force law has by itself."""
    ustar = at.friction_velocity
    density = grains["fluid_density"]
    found = {
        "ustar_m_s": ustar,
        "stress_pa": density * ustar**2,
        "shields": at.shields,
        "reynolds": at.reynolds,
        "drag_n": at.drag,
        "lift_n": at.lift,
        **measurable_speeds(
            ustar,
            roughness=grains["roughness"],
            fluid_density=density,
            viscosity=grains["viscosity"],
            depth=np.where(density < GAS_BELOW, np.nan, grains["depth"]),
        ),
    }
    block: Table = {"law": np.full(len(density), name, object)}
    block |= {column: found[column] for column in QUANTITIES}
    block["valid"] = at.valid
    reasons = why_not(
        LAWS[name],
        ustar,
        exposure,
        density=grains["density"],
        slope_deg=grains["slope_deg"],
        gravity=grains["gravity"],
    )
    # without a threshold no law is beyond its range
    is_known = np.isfinite(ustar)
    block["law_ends"] = np.where(is_known, np.array(reasons, object), "")
    remedies = np.full(len(ustar), "", object)
    further = LAWS[name].goes_on
    if further:
        holds = LAWS[further].valid(ustar, exposure) & (block["law_ends"] != "")
        remedies[holds] = f'choose forces.law = "{further}"'
    block["law_remedy"] = remedies
    return block


def _criterion(points: Mapping[str, Any], asked: str) -> str:
    """The criterion of grains for which none is asked.

    A fluid of which a number is given is none of the paper's, whatever the number is.
    """
    is_paper = not OF_FLUID.keys() & points.keys()
    return LEAVES if is_paper or asked in OF_PAPER else GOES_ON


class _Hopping(NamedTuple):
    """Whether grains can hop, and their thresholds by two laws of rebound."""

    can: BoolArray
    thresholds: saltation.Thresholds
    at_most: saltation.Thresholds


def _hopping(grains: Table) -> _Hopping:
    """How the grains hop over the bed."""
    hoppers = saltation.Grains.of(
        grains["diameter"],
        density=grains["density"],
        fluid_density=grains["fluid_density"],
        viscosity=grains["viscosity"],
        slope_deg=grains["slope_deg"],
        roughness=grains["roughness"],
        gravity=grains["gravity"],
    )
    return _Hopping(
        saltation.hops(hoppers),
        saltation.tabulated(hoppers),
        saltation.tabulated(hoppers, at_most=True),
    )


def _going_on(
    block: Table,
    hopping: _Hopping,
    exposure: Exposure,
    grains: Table,
) -> Table:
    """The columns of a force law for grains that leave in a gust, and go on after it.

    Drag and lift are those in the gust at the threshold; grains that cannot hop have no
    gust. A law is valid where it holds
    for the grain that leaves.
    """
    stresses = _criteria(block["shields"], hopping)
    shields = stresses.pop("shields")
    density = grains["fluid_density"]
    excess = (grains["density"] - density) * grains["gravity"] * grains["diameter"]
    ustar = np.sqrt(shields * excess / density)
    law = LAWS[block["law"][0]]
    in_gust = ustar * np.sqrt(np.where(hopping.can, saltation.PEAK, 1.0))
    changed = {**block, **stresses}
    changed |= measurable_speeds(
        ustar,
        roughness=grains["roughness"],
        fluid_density=density,
        viscosity=grains["viscosity"],
        depth=np.where(density < GAS_BELOW, np.nan, grains["depth"]),
    )
    changed["ustar_m_s"] = ustar
    changed["stress_pa"] = density * ustar**2
    changed["shields"] = shields
    changed["reynolds"] = exposure.reynolds(ustar)
    changed["drag_n"] = law.drag(in_gust, exposure)
    changed["lift_n"] = law.lift(in_gust, exposure)
    is_missing = hopping.can & ~np.isfinite(stresses["shields_goes_on"])
    changed["valid"] = block["valid"] & ~is_missing
    return changed


def _criteria(steady: FloatArray, hopping: _Hopping) -> Table:
    """The threshold of grains that go on, and the columns `OF_CRITERION`.

    `steady` is the Shields number that turns them over their neighbours.
    """
    can = hopping.can
    goes_on = hopping.thresholds.initiation(saltation.PEAK)
    at_most = hopping.at_most.initiation(saltation.PEAK)
    found = saltation.motion(steady, goes_on, can)
    highest = saltation.motion(steady, at_most, can).shields
    decides = np.where(found.goes_on, GOES_ON, LEAVES)
    return {
        "shields": found.shields,
        "shields_leaves": np.where(can, steady / saltation.PEAK, steady),
        "shields_goes_on": np.where(can, goes_on, np.nan),
        "shields_goes_on_high": np.where(can, highest, np.nan),
        "shields_cessation": np.where(can, hopping.thresholds.cessation, steady),
        "decides": decides.astype(object),
    }


def _picked(
    asked: str,
    regimes: NDArray[Any],
    ustar: FloatArray,
    exposure: Exposure,
) -> list[tuple[str, ...]]:
    """The laws that answer each point; `ustar` is its threshold under `DEFAULT`."""
    if asked == PAPER:
        return [LAWS_OF[regime] for regime in regimes]
    if asked == AUTO:
        names = np.broadcast_to(default_laws(ustar, exposure), len(regimes))
        return [(name,) for name in names.tolist()]
    return [(asked,)] * len(regimes)


def _grains(points: Mapping[str, Any]) -> Table:
    """All parameters of some points as numbers.

    Only a point that may be beyond a limit is made a scene, which refuses it or warns.
    """
    count = len(points["diameter"])
    given = {}
    for name, parameter in PARAMETERS.items():
        given[name] = points.get(name, [parameter.default] * count)
    lengths = list(map(_length, given["roughness"], given["diameter"]))
    grains = {}
    for name, column in {**given, "roughness": lengths}.items():
        grains[name] = np.array(column, float)
    for index in np.flatnonzero(~_is_ordinary(grains)):
        point = {name: column[index] for name, column in given.items()}
        for name, value in asdict(_as_scene(point)).items():
            grains[name][index] = value
    return grains


def _is_ordinary(grains: Table) -> NDArray[np.bool_]:
    """Whether no limit of a scene can be exceeded, by point."""
    is_ordinary = grains["density"] > grains["fluid_density"]
    is_ordinary &= grains["roughness"] <= 0.3 * grains["diameter"]
    for name, parameter in PARAMETERS.items():
        if name != "depth":
            low, high = parameter.ordinary
            is_ordinary &= (grains[name] >= low) & (grains[name] <= high)
    return np.asarray(is_ordinary)


def _as_scene(point: Mapping[str, Any]) -> SingleGrain:
    """The grain of a point as its scene has it; an `InputError` if it is no scene."""
    # most points need none of these modules, which load slowly
    from orchestrator.fidelity import limits
    from orchestrator.study.closed_form import single_grain
    from orchestrator.study.study import make_scene

    parts: dict[str, Row] = defaultdict(dict)
    for name in GRAIN_COLUMNS:
        part, _, field = PARAMETERS[name].field.partition(".")
        value = point[name]
        parts[part][field] = value if isinstance(value, str) else float(value)
    parts["method"]["kind"] = "pivot"
    scene = make_scene(parts, "threshold")
    limits.check(scene, "threshold")
    return single_grain(scene)


def _length(roughness: Any, diameter: float) -> float:
    """A roughness length, m, of a number or of such a part of the diameter as ``d/30``.

    NaN of any other text.
    """
    if not isinstance(roughness, str):
        return float(roughness)
    part = re.fullmatch(r"d/([1-9]\d*(?:\.\d+)?)", roughness, re.ASCII)
    if part is None:
        return np.nan
    # digits as in a scene
    return float(f"{diameter / float(part[1]):.12g}")
