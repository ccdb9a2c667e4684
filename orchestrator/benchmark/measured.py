"""Levels 3 to 5: scenes whose answers are those of a finished study."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.problem import (
    Problem,
    Row,
    exact,
    expectations,
    expected,
    parameters,
    place,
)
from orchestrator.flow.case import SPEED_HEIGHT, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.grains.pile import Pile
from orchestrator.grains.pile_case import MARGIN
from orchestrator.grains.protocol import POURED_DRAG
from orchestrator.grains.threshold import PileThreshold
from orchestrator.tables import Tables

STRESS, MEAN_STRESS = 0.10, 0.05
"""Relative tolerances of the friction velocity along the bed, and of its mean."""
FACE = (0.1, 0.9)
"""Part of the windward face on which it is judged: toe and crest are points of the mesh."""
GRAINS, LINE = 0.03, 0.10
"""Relative tolerances of a pile's thresholds under the given stress, and with one's own flow."""
SCATTER = 0.10
"""Part of the count by which the number of moved grains may differ, besides one load step: three
engines with one contact law do so by up to 13 % where a chain of grains goes at once
(docs/benchmark.md)."""
LEVEL_ROWS = 0.35
"""Part of N: level rows are judged until so many have moved. Then a whole step goes at once or not,
as the least detail decides: runs that differ in the time step, the dashpots or places by 1e-3 d
are up to 20 % of N and six load steps apart (docs/benchmark.md)."""
POURED_SCATTER = 0.15
"""Part of N on poured beds. Runs that differ by round-off are 6 to 15 % apart beyond a load step in
nine of ten pairs, where a grain that goes or stays holds up others (docs/benchmark.md)."""
LIFT_OFF, LIFT_OFF_SCATTER = 0.20, 0.25
"""The same tolerances where grains are carried off, which collide on their way: runs that differ by
round-off are up to 16 % beyond the interval of a threshold and 22 % of N beyond a load step."""


@dataclass(frozen=True)
class Answered:
    """A pile whose cases are done.

    Attributes
    ----------
    pile : Pile
        The pile.
    curve, thresholds, stress : DataFrame
        Its rows in the tables ``pile_curve``, ``pile_threshold`` and, where its flow is solved,
        ``wall_stress``.
    cases : Path
        Directory of the cases.
    """

    pile: Pile
    curve: pd.DataFrame
    thresholds: pd.DataFrame
    stress: pd.DataFrame
    cases: Path


def answered(
    piles: Iterable[Pile],
    tables: Tables,
    cases: Path,
) -> list[Answered]:
    """The piles that DEM answered, with what the tables say of each.

    Replicas of lattices are left out: they are in the intervals of the others.
    """
    if "pile_curve" not in tables:
        return []
    nothing = pd.DataFrame()
    curves = dict(iter(tables["pile_curve"].groupby("scene_id")))
    thresholds = dict(iter(tables["pile_threshold"].groupby("scene_id")))
    stresses: dict[Any, pd.DataFrame] = {}
    if "wall_stress" in tables:
        stresses = dict(iter(tables["wall_stress"].groupby("flow_case")))
    found = []
    for pile in piles:
        if pile.bed.is_replica or pile.scene.protocol.method != "dem":
            continue
        name = pile.scene.id
        stress = stresses[pile.flow.name] if pile.model.cases else nothing
        found.append(Answered(pile, curves[name], thresholds[name], stress, cases))
    return found


def flow(one: Answered) -> Problem:
    """Level 3: the stress on the bed."""
    case = one.pile.flow
    tables = {"bed": _bed(case)}
    asked = expectations(_stress_rows(one))
    return Problem(3, case.id[:12], "flow", flow_parameters(one), tables, asked)


def flow_parameters(one: Answered) -> dict[str, Any]:
    """Parameters of the solve of a pile's flow."""
    case = one.pile.flow
    return {
        "alpha_deg": case.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "u_e_m_s": case.speed_m_s,
        "ustar0_m_s": case.ustar0_m_s,
        "lid_m": SPEED_HEIGHT * case.height_m,
        "domain_height_m": case.lid * case.height_m,
        "solve_nu_m2_s": case.viscosity_m2_s,
        "rho_f_kg_m3": one.pile.scene.fluid.density,
        "first_cell_m": case.first_cell_m,
        "cells_per_face": case.cells_per_face,
        "turbulence_model": case.turbulence_model,
    }


def _bed(case: FlowCase) -> pd.DataFrame:
    return pd.DataFrame(case.bed_line.corners, columns=["x_m", "z_m"])


def _stress_rows(one: Answered) -> Iterator[Row]:
    along = one.stress
    mean = windward_mean(one)
    yield exact("windward_mean", mean, MEAN_STRESS, ours=mean)
    crest = one.pile.model.line.crest_s / one.pile.bed.height
    for s, u in zip(along["s_over_h"], along["ustar_over_ustar0_wall"], strict=True):
        judged = FACE[0] * crest <= s <= FACE[1] * crest
        yield exact("ustar_over_ustar0", u, STRESS if judged else np.nan, place(s), u)


def windward_mean(one: Answered) -> float:
    """Mean of u*/u*_0 over the windward face by arc length."""
    stress = WallStress.from_csv(one.cases / one.pile.flow.name / "wall_stress.csv")
    crest = one.pile.model.line.crest_s
    face = (stress.s_m > 0) & (stress.s_m < crest)
    return float(np.average(stress.ustar_over_ustar0_wall[face], weights=stress.length_m[face]))


def pile(one: Answered) -> Problem:
    """Level 4: the grains of a pile under a given stress."""
    scene = one.pile.scene
    told = parameters(scene, "pile") | {"count": one.pile.packing.count} | _lift_off(one)
    told |= _roof(one) if not one.pile.bed.is_triangle else {}
    tables = {"grains": _grains(one), "load_steps": load_steps(one)}
    if one.pile.pouring:
        tables |= {"forces": _forces(one)}
        told |= {"settle_drag_kg_s": POURED_DRAG * told["mass_kg"] / told["time_unit_s"]}
    return Problem(4, scene.id, "pile", told, tables, expectations(_pile_rows(one, GRAINS)))


def _forces(one: Answered) -> pd.DataFrame:
    """The flow's force on each exposed grain in each load step: each has a law of its own size."""
    loading = one.pile.loading(one.pile.ustar_over_ustar0(one.cases))
    pushed = np.flatnonzero(loading.ratio)
    flows = one.curve["ustar0_m_s"].tolist()
    force = loading.in_steps(flows)[:, pushed]
    return pd.DataFrame(
        {
            "load_step": np.repeat(one.curve["load_step"].to_numpy(), len(pushed)),
            "id": np.tile(pushed + 1, len(flows)),
            "fx_n": force[..., 0].ravel(),
            "fz_n": force[..., 1].ravel(),
        }
    )


def _roof(one: Answered) -> dict[str, float]:
    """The roof above which a grain in flight is gone, of a bed that is no triangle."""
    slope, ridge = one.pile.line.roof(MARGIN + 0.5)
    x, z = (ridge * one.pile.scene.grain.diameter).tolist()
    return {"roof_slope_deg": slope, "roof_x_m": x, "roof_z_m": z}


def line(one: Answered) -> Problem:
    """Level 5: flow and grains."""
    scene = one.pile.scene
    told = flow_parameters(one) | parameters(scene, "line") | _lift_off(one)
    tables = {"bed": _bed(one.pile.flow), "load_steps": load_steps(one)}
    count = float(one.pile.packing.count)
    counted = exact("count", count, LINE, ours=count)
    asked = expectations([counted, *_pile_rows(one, LINE)])
    return Problem(5, scene.id, "line", told, tables, asked)


def _lift_off(one: Answered) -> dict[str, float]:
    """How much of the answer is lift-off, where grains were carried off."""
    last = one.curve.iloc[-1]
    carried = float(last["carried_off"])
    return {"lift_off": carried / float(last["moved"])} if carried else {}


def load_steps(one: Answered) -> pd.DataFrame:
    """The load steps that our run came to, the settling first."""
    return one.curve[["load_step", "ustar0_m_s", "u_e_m_s"]]


def _grains(one: Answered) -> pd.DataFrame:
    packing, scene = one.pile.packing, one.pile.scene
    pushed = packing.mobile & packing.lee
    kinds = [~packing.mobile, packing.windward, pushed]
    forced = packing.windward | pushed
    slope = np.degrees(np.arctan2(one.pile.tangents[:, 1], one.pile.tangents[:, 0]))
    x, z = packing.centres.T * scene.grain.diameter
    return pd.DataFrame(
        {
            "id": np.arange(1, len(x) + 1),
            "x_m": x,
            "z_m": z,
            "d_m": packing.sizes * scene.grain.diameter,
            "kind": np.select(kinds, ["fixed", "counted", "pushed"], "mobile"),
            "slope_deg": np.where(forced, slope, np.nan),
            "ustar_over_ustar0": np.where(forced, one.pile.ustar_over_ustar0(one.cases), np.nan),
        }
    )


@dataclass(frozen=True)
class Margins:
    """How far an answer to a pile may be off besides what the load steps and seeds enclose.

    Attributes
    ----------
    threshold : float
        Relative tolerance of thresholds.
    count : float
        Tolerance of the numbers of moved grains, over N.
    until : float
        Largest n/N that is judged.
    """

    threshold: float
    count: float
    until: float = 1.0


def _margins(one: Answered, threshold: float) -> Margins:
    if _lift_off(one):
        return Margins(max(threshold, LIFT_OFF), LIFT_OFF_SCATTER)
    if one.pile.bed.packing == "horizontal":
        return Margins(threshold, SCATTER, LEVEL_ROWS)
    return Margins(threshold, POURED_SCATTER if one.pile.pouring else SCATTER)


def _pile_rows(one: Answered, threshold: float) -> Iterator[Row]:
    margins = _margins(one, threshold)
    yield from _count_rows(one.curve, margins)
    ustar0 = one.curve["ustar0_m_s"].to_numpy(float)
    used = ["fraction", "ustar0_m_s", "shields", "shields_low", "shields_high"]
    for row in one.thresholds[used].dropna(subset="shields").to_dict("records"):
        at, shields, flow = place(row["fraction"]), row["shields"], row["ustar0_m_s"]
        tolerance = margins.threshold if row["fraction"] <= margins.until else np.nan
        # the number is the mean of two load steps: one load step more to each side
        load_step = int(np.searchsorted(ustar0, flow))
        steps = ustar0[max(load_step - 2, 0)], ustar0[min(load_step + 1, len(ustar0) - 1)]
        stresses = row["shields_low"], row["shields_high"]
        if not one.pile.bed.is_triangle or one.pile.pouring:
            fewer, same, more = _around(one, row["fraction"], margins.count)
            unit = shields / same.tau
            stresses = (
                min(stresses[0], fewer.tau_low * unit),
                max(stresses[1], more.tau_high * unit),
            )
            steps = min(steps[0], fewer.ustar0), max(steps[1], more.ustar0)
        yield expected("shields", at, shields, stresses, tolerance, shields)
        yield expected("ustar0_m_s", at, flow, steps, tolerance, flow)


def _around(one: Answered, fraction: float, margin: float) -> list[PileThreshold]:
    """The thresholds of our run at a fraction, before it at so much less of N, after it at more.

    Grains of a poured bed go by chance, and those of a train by turns: n/N stands still for some
    load steps and leaps in the next one, so that a grain more or less is far off in the flow.
    """
    most = float(one.curve["moved"].iloc[-1] / one.curve["count"].iloc[-1])
    places = max(fraction - margin, 1e-9), fraction, min(fraction + margin, most)
    return one.pile.thresholds(one.cases, places)


def _count_rows(curve: pd.DataFrame, margins: Margins) -> Iterator[Row]:
    total, last = float(curve["count"].iloc[0]), len(curve) - 1
    # load step 0 is the settling
    for load_step in range(1, last + 1):
        yield _counted("moved", curve, load_step, margins)
    moved = _counted("moved", curve, last, margins)
    rest = total - moved["value"]
    interval = total - moved["high"], total - moved["low"]
    yield expected("not_moved", place(last), rest, interval, moved["tolerance"], rest)
    if curve["carried_off"].iloc[-1]:
        yield _counted("carried_off", curve, last, margins)


def _counted(quantity: str, curve: pd.DataFrame, load_step: int, margins: Margins) -> Row:
    """Expectation of a number of grains: that of a load step earlier or later, and its margin."""
    total, n = float(curve["count"].iloc[0]), curve[quantity].to_numpy(float)
    near = n[load_step - 1 : load_step + 2]
    low = max(float(near.min()) - margins.count * total, 0.0)
    high = min(float(near.max()) + margins.count * total, total)
    tolerance = 0.0 if near.max() <= margins.until * total else np.nan
    return expected(quantity, place(load_step), n[load_step], (low, high), tolerance, n[load_step])
