"""Thresholds of many single grains under every force law, as one table."""

import itertools
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.calculator import (
    BY_FLUID,
    CRITERIA,
    ENTRAINED,
    LENGTHS,
    OF_FLOW,
    OF_FLUID,
    PARAMETERS,
    QUANTITIES,
    SUSTAINED,
    river,
)
from orchestrator.errors import InputError
from orchestrator.physics import verdict
from orchestrator.physics.beside import (
    COMPARED_WITH,
    beside,
    compared_level_ustar,
    compared_with,
)
from orchestrator.physics.constants import (
    CHANNEL,
    GAS_BELOW,
    GRAIN_COLUMNS,
    SLOPE,
)
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import DEFAULT, LAWS, law
from orchestrator.physics.onset import Onset, of_grains
from orchestrator.physics.reported import (
    Interval,
    compared_columns,
    compared_range,
    every_unit,
    has_no_law,
    in_units,
)
from orchestrator.physics.threshold import (
    AUTO,
    LAWS_OF,
    PAPER,
    Threshold,
    default_laws,
    regime,
    standing_out,
)
from orchestrator.physics.velocity import LAMINAR_BELOW, open_water_reynolds
from orchestrator.physics.verdict import Reason
from orchestrator.types import Row

Table = dict[str, NDArray[Any]]
"""Columns of equal length by their names."""
OF_PAPER = (PAPER, *LAWS_OF["transition"])
"""Laws of the paper, which are of grains that are entrained."""


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
        paper's gas. Of a channel that falls by ``bed_slope`` the depth and the mean
        velocity are those of its uniform flow.
    asked
        The law that is asked for, ``auto`` for the default law, or ``paper`` for the
        paper's rule.
    criterion
        What a grain must do: one of `CRITERIA`, or `BY_FLUID`. Grains that go on leave
        their pockets in a gust of `gusts.PEAK` times the mean stress, and roll and hop
        on after it; their threshold is the larger of the two mean stresses.

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
    if criterion == SUSTAINED and asked in OF_PAPER:
        what = f"the law {asked} is one of entrainment alone"
        remedy = f"take the criterion {ENTRAINED}, or another law"
        raise InputError(what, "threshold: criterion", remedy)
    if "depth" in points:
        if "bed_slope" in points:
            what = "both a depth and a bed slope"
            remedy = "leave the depth out: it follows from the slope"
            raise InputError(what, "threshold: bed_slope", remedy)
        _check_depth(grains)
    # numbers beyond all floats end as laws that do not hold
    with np.errstate(all="ignore"):
        table, against = _of_all_laws(grains, asked, criterion)
    if not table["valid"].any():
        place = int(np.argmax(table["answer"]))
        reason = f"{table['law'][place]}: {verdict.texts(against[place])}"
        remedy = "write all numbers in SI units"
        raise InputError(f"no force law holds; {reason}", "threshold", remedy)
    if SLOPE in table:
        table |= river.uniform_flow(table)
        for row, text in enumerate(river.against_depths(table)):
            if text:
                against[row].append(Reason("depth", text))
                table["valid"][row] = False
    _judge(table, against)
    return table | river.channel_beside(table) | _reported(table)


def _check_criterion(criterion: str) -> None:
    """Refuse a criterion that is none."""
    if criterion not in (*CRITERIA, BY_FLUID):
        what = f"no criterion {criterion!r}"
        remedy = f"choose {', '.join(CRITERIA)}, {BY_FLUID}"
        raise InputError(what, "threshold: criterion", remedy)


def _of_all_laws(
    grains: Table, asked: str, criterion: str
) -> tuple[Table, list[list[Reason]]]:
    """The thresholds of grains under every law, a row for each grain and law.

    Beside them is what the law of each row has against it.
    """
    inputs = {
        each.column: grains[name] for name, each in PARAMETERS.items() if name in grains
    }
    grain = Grain.of_table(inputs)
    by_law = {name: of_grains(grain, name, criterion) for name in LAWS}
    in_steady_flow = {name: at.leaving for name, at in by_law.items()}
    regimes = regime(in_steady_flow["low"], in_steady_flow["high"]).astype(object)
    picked = _picked(asked, regimes, in_steady_flow[DEFAULT], grain)
    blocks = []
    for name, at in by_law.items():
        block = _block(at, inputs)
        kind: Table = {**inputs, "force_law": block["law"]}
        if at.criteria is not None:
            kind["criterion"] = np.full(len(block["law"]), SUSTAINED, object)
        block["regime"] = regimes
        rows_beside = beside({**block, **kind})
        block |= rows_beside
        block["level_ustar_m_s"] = _on_level(at, criterion)
        with_inputs = {**inputs, **rows_beside}
        block["compared_level_ustar_m_s"] = compared_level_ustar(with_inputs)
        block[COMPARED_WITH] = compared_with(with_inputs)
        block["answer"] = np.array([name in laws for laws in picked])
        blocks.append(block)
    table = {name: np.repeat(column, len(LAWS)) for name, column in inputs.items()}
    for name in blocks[0]:
        of_laws = [block[name] for block in blocks]
        table[name] = np.stack(of_laws, axis=1).ravel()
    by_grain = zip(*(at.reasons() for at in by_law.values()), strict=True)
    return table, [*itertools.chain.from_iterable(by_grain)]


def _on_level(at: Onset, criterion: str) -> NDArray[Any]:
    """Friction velocities of the same grains on level beds, m/s."""
    ustar = at.friction_velocity.copy()
    slopes = np.flatnonzero(at.grain.slope_deg)
    if len(slopes):
        level = at.grain.at(slopes).changed(slope_deg=0.0)
        ustar[slopes] = of_grains(level, at.law, criterion).friction_velocity
    return ustar


def _block(at: Onset, inputs: Table) -> Table:
    """The columns that the thresholds under one force law have by themselves.

    A law is valid where it holds for the grain that leaves.
    """
    density = inputs["rho_f_kg_m3"]
    found = every_unit(at.friction_velocity, _flow(inputs))
    found |= {
        "ustar_m_s": at.friction_velocity,
        "shields": at.shields,
        "reynolds": at.reynolds,
        "drag_n": at.drag,
        "lift_n": at.lift,
    }
    block: Table = {"law": np.full(len(density), at.law, object)}
    block |= {column: found[column] for column in QUANTITIES}
    block["valid"] = at.valid
    if at.criteria is not None:
        block |= at.criteria.columns()
    return block


def _flow(table: Table) -> Table:
    """The columns of grains and fluids; a gas has no depth."""
    is_gas = table["rho_f_kg_m3"] < GAS_BELOW
    return {**table, "depth_m": np.where(is_gas, np.nan, table["depth_m"])}


def _reported(table: Table) -> Table:
    """The intervals and the values to compare of thresholds, in every unit."""
    ustar = table["ustar_m_s"]
    flow = _flow(table)
    # a row for each law, grain by grain
    shape = (-1, len(LAWS))
    is_asked = table["usable"] & ~has_no_law(table, len(ustar))
    by_law = []
    for place, each in enumerate(LAWS.values()):
        if each.in_interval:
            own = np.repeat(ustar.reshape(shape)[:, place], len(LAWS))
            holds = np.repeat(table["valid"].reshape(shape)[:, place], len(LAWS))
            by_law.append((own, holds & is_asked))
    with np.errstate(all="ignore"):
        interval = Interval.tested(table, ustar).or_of_laws(by_law)
        made = interval.columns(flow) | compared_columns(flow, ustar)
        ends = compared_range(made, ustar, table["usable"])
        for end, at in zip(("_low", "_high"), ends, strict=True):
            made |= in_units(at, flow, end, "compared_")
    return made | {"advised": _advised(table)}


def _advised(table: Table) -> NDArray[Any]:
    """Which number of each row is advised, by itself: points are asked one by one."""
    names = [*verdict.COLUMNS, "rho_f_kg_m3", "nu_m2_s", "compared_level_ustar_m_s"]
    columns = {name: table[name].tolist() for name in names}
    columns["force_law"] = table["law"].tolist()
    cells = zip(*columns.values(), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in cells]
    return np.array([verdict.advised([row]) for row in rows], object)


def _judge(table: Table, against: Sequence[Sequence[Reason]]) -> None:
    """Say whether the thresholds of a table are usable, and what speaks against them.

    The table gets the columns of the verdict; `against` is what the law and the depth
    of each row have against it. A law whose flow in open water may be laminar is not
    valid.
    """
    with np.errstate(all="ignore"):
        reynolds = open_water_reynolds(
            table["ustar_m_s"],
            roughness=table[CHANNEL],
            viscosity=table["nu_m2_s"],
            depth=table["depth_m"],
        )
    is_laminar = reynolds < LAMINAR_BELOW
    is_laminar &= table["rho_f_kg_m3"] >= GAS_BELOW
    table["valid"] &= ~is_laminar
    flow = np.where(table["rho_f_kg_m3"] < GAS_BELOW, np.nan, reynolds)
    columns = {
        **table,
        "flow_reynolds": flow,
        "standing_out": standing_out(1.0, table["beta_deg"]),
    }
    if "decides" in table:
        columns["criterion"] = np.full(len(flow), SUSTAINED, object)
    cells = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in cells]
    reasons = []
    for row, of_law in zip(rows, against, strict=True):
        of_grain = verdict.of_grain(row, of_law)
        of_measurements = verdict.of_measurements(row, is_closed=True)
        reasons.append([*of_grain, *of_measurements])
    for name, values in verdict.columns(rows, reasons).items():
        is_word = name != "usable"
        table[name] = np.array(values, object if is_word else bool)


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
    for what in itertools.starmap(river.why_no_depth, pairs):
        if what:
            raise InputError(what, "threshold: depth", remedy)
    if (density < GAS_BELOW).all():
        what = f"{density[0]:g} kg/m3 is a gas"
        raise InputError(what, "threshold: depth", remedy)


def _criterion(points: Mapping[str, Any], asked: str) -> str:
    """The criterion of grains for which none is asked.

    A fluid of which a number is given is none of the paper's, whatever the number is.
    """
    is_paper = not OF_FLUID.keys() & points.keys()
    return ENTRAINED if is_paper or asked in OF_PAPER else SUSTAINED


def _picked(
    asked: str, regimes: NDArray[Any], by_default: Threshold, grain: Grain
) -> list[tuple[str, ...]]:
    """The laws that answer each point."""
    if asked == PAPER:
        return [LAWS_OF[regime] for regime in regimes]
    if asked == AUTO:
        names = default_laws(by_default.friction_velocity, grain)
        return [(name,) for name in np.broadcast_to(names, len(regimes)).tolist()]
    return [(asked,)] * len(regimes)


def _grains(points: Mapping[str, Any]) -> Table:
    """All parameters of some points as numbers.

    Only a point that may be beyond a limit is made a scene, which refuses it or warns.
    """
    count = len(points["diameter"])
    given = {}
    for name, parameter in PARAMETERS.items():
        given[name] = points.get(name, [parameter.default] * count)
    if "bed_slope" not in points:
        del given["bed_slope"]
    lengths = {}
    for name in LENGTHS:
        lengths[name] = list(map(_length, given[name], given["diameter"]))
    grains = {}
    for name, column in {**given, **lengths}.items():
        grains[name] = np.array(column, float)
    for index in np.flatnonzero(~_is_ordinary(grains)):
        point = {name: column[index] for name, column in given.items()}
        grain = _as_scene(point)
        for name in GRAIN_COLUMNS:
            grains[name][index] = getattr(grain, name)
    has_depth = ~np.isnan(grains.get("bed_slope", grains["depth"]))
    is_channel = has_depth & (grains["fluid_density"] >= GAS_BELOW)
    for name in ("channel_roughness", "d84"):
        if name not in points:
            del grains[name]
    return grains | river.roughnesses(grains, is_channel)


def _is_ordinary(grains: Table) -> NDArray[np.bool_]:
    """Whether no limit of a scene can be exceeded, by point."""
    is_ordinary = grains["density"] > grains["fluid_density"]
    is_ordinary &= grains["roughness"] <= 0.3 * grains["diameter"]
    for name, parameter in PARAMETERS.items():
        if name not in OF_FLOW:
            low, high = parameter.ordinary
            is_ordinary &= (grains[name] >= low) & (grains[name] <= high)
    return np.asarray(is_ordinary)


def _as_scene(point: Mapping[str, Any]) -> Grain:
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

    NaN of any other text, and of None.
    """
    if roughness is None:
        return np.nan
    if not isinstance(roughness, str):
        return float(roughness)
    part = re.fullmatch(r"d/([1-9]\d*(?:\.\d+)?)", roughness, re.ASCII)
    if part is None:
        return np.nan
    # digits as in a scene
    return float(f"{diameter / float(part[1]):.12g}")
