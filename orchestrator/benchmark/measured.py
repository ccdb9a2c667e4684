"""Levels 3 to 5: scenes whose answers are those of a finished study."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.bed.deck import POURED_DRAG
from orchestrator.benchmark.exact import parameters
from orchestrator.benchmark.pack import Problem, expectation, table_of
from orchestrator.flow.case import SPEED_HEIGHT, FlowCase
from orchestrator.grains.pile import MARGIN, Pile
from orchestrator.tables import Tables
from orchestrator.types import Row

STRESS, MEAN_STRESS = 0.10, 0.05
"""Relative tolerances of the friction velocity along the bed, and of its mean."""
FACE = (0.1, 0.9)
"""Part of the windward face on which it is judged: toe and crest are points of the mesh."""
GRAINS, LINE = 0.03, 0.10
"""Relative tolerances of a pile's thresholds under the given stress, and with one's own flow."""
SCATTER = 0.10
"""Part of the count by which the number of moved grains may differ, besides one load step: three
engines with one contact law do so by up to 13 % where a chain of grains goes at once
(docs/engines.md)."""
LEVEL_ROWS = 0.35
"""Part of N: level rows are judged until so many have moved. Then a whole step goes at once or not,
as the least detail decides: runs that differ in the time step, the dashpots or places by 1e-3 d
are up to 20 % of N and six load steps apart (docs/engines.md)."""
POURED_SCATTER = 0.15
"""Part of N on poured beds. Runs that differ by round-off are 6 to 15 % apart beyond a load step in
nine of ten pairs, where a grain that goes or stays holds up others (docs/engines.md)."""
LIFT_OFF, LIFT_OFF_SCATTER = 0.20, 0.25
"""The same tolerances where grains are carried off, which collide on their way: runs that differ by
round-off are up to 16 % beyond the interval of a threshold and 22 % of N beyond a load step."""


class Margins(NamedTuple):
    """How far an answer to a pile may be off besides what the load steps and seeds enclose.

    The relative tolerance of thresholds, that of the numbers of moved grains over N, and the
    largest n/N that is judged.
    """

    threshold: float
    counted: float
    until: float = 1.0


@dataclass(frozen=True)
class Bed:
    """A pile whose cases are done, with its results.

    Attributes
    ----------
    pile : Pile
        The pile.
    curve, thresholds : DataFrame
        Its rows in the tables ``pile_curve`` and ``pile_threshold``.
    cases : Path
        Directory of the cases.
    """

    pile: Pile
    curve: pd.DataFrame
    thresholds: pd.DataFrame
    cases: Path

    @property
    def carried_off(self) -> float:
        """Share of the moved grains that were carried off."""
        last = self.curve.iloc[-1]
        return float(last["carried_off"]) / max(float(last["moved"]), 1.0)

    def margins(self, threshold: float) -> Margins:
        """Its margins where thresholds have a relative tolerance."""
        if self.carried_off:
            return Margins(max(threshold, LIFT_OFF), LIFT_OFF_SCATTER)
        if self.pile.bed.packing == "horizontal":
            return Margins(threshold, SCATTER, LEVEL_ROWS)
        return Margins(threshold, POURED_SCATTER if self.pile.pouring else SCATTER)


def beds(piles: Iterable[Pile], tables: Tables, cases: Path) -> list[Bed]:
    """The piles that DEM answered. Replicas of lattices are in the intervals of the others."""
    if "pile_curve" not in tables:
        return []
    curves, thresholds = (
        dict(iter(tables[name].groupby("scene_id"))) for name in ("pile_curve", "pile_threshold")
    )
    chosen = (p for p in piles if not p.bed.is_replica and p.scene.protocol.method == "dem")
    return [Bed(p, curves[p.scene.id], thresholds[p.scene.id], cases) for p in chosen]


def flow(pile: Pile, tables: Tables) -> Problem:
    """Level 3: the stress on the bed of a pile whose flow is solved."""
    case = pile.flow
    of_case = {name: tables[name][tables[name]["flow_case"] == case.name] for name in _OF_FLOW}
    mean = float(of_case["flow"]["ustar_mean"].iloc[0])
    rows = [expectation("windward_mean", mean, MEAN_STRESS, ours=mean)]
    stress = of_case["wall_stress"]
    crest = pile.model.line.crest_s / pile.bed.height
    for s, u in zip(stress["s_over_h"], stress["ustar_over_ustar0_wall"], strict=True):
        judged = FACE[0] * crest <= s <= FACE[1] * crest
        tolerance = STRESS if judged else np.nan
        rows.append(expectation("ustar_over_ustar0", u, tolerance, s, ours=u))
    tables_of_scene = {"bed": _bed_line(case)}
    return Problem(case.id[:12], "flow", _of_flow(pile), tables_of_scene, table_of(rows))


_OF_FLOW = ("flow", "wall_stress")


def _of_flow(pile: Pile) -> Row:
    """Parameters of the flow of a pile."""
    case = pile.flow
    return {
        "alpha_deg": case.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "u_e_m_s": case.settings.speed,
        "ustar0_m_s": case.ustar0_m_s,
        "u_e_height_m": SPEED_HEIGHT * case.height_m,
        "lid_height_m": case.lid * case.height_m,
        "solve_nu_m2_s": case.viscosity_m2_s,
        "rho_f_kg_m3": pile.scene.fluid.density,
        "first_cell_m": case.first_cell_m,
        "cells_per_face": case.settings.cells_per_face,
        "turbulence_model": case.settings.turbulence_model,
    }


def _bed_line(case: FlowCase) -> pd.DataFrame:
    return pd.DataFrame(case.bed_line.corners, columns=["x_m", "z_m"])


def pile(bed: Bed) -> Problem:
    """Level 4: the grains of a pile under a given stress."""
    scene, d = bed.pile.scene, bed.pile.scene.grain.diameter
    given = parameters(scene, "pile") | {"count": bed.pile.packing.count} | _lift_off(bed)
    if not bed.pile.bed.is_triangle:
        slope, ridge = bed.pile.line.roof(MARGIN + 0.5)
        x, z = (ridge * d).tolist()
        given |= {"roof_slope_deg": slope, "roof_x_m": x, "roof_z_m": z}
    tables = {"grains": _grains(bed), "load_steps": _load_steps(bed)}
    if bed.pile.pouring:
        tables |= {"forces": _forces(bed)}
        given |= {"settle_drag_kg_s": POURED_DRAG * given["mass_kg"] / given["time_unit_s"]}
    return Problem(scene.id, "pile", given, tables, table_of(_answers(bed, GRAINS)))


def line(bed: Bed) -> Problem:
    """Level 5: flow and grains."""
    scene = bed.pile.scene
    given = _of_flow(bed.pile) | parameters(scene, "line") | _lift_off(bed)
    tables = {"bed": _bed_line(bed.pile.flow), "load_steps": _load_steps(bed)}
    count = float(bed.pile.packing.count)
    counted = expectation("count", count, LINE, ours=count)
    return Problem(scene.id, "line", given, tables, table_of([counted, *_answers(bed, LINE)]))


def _lift_off(bed: Bed) -> Row:
    return {"lift_off": bed.carried_off} if bed.carried_off else {}


def _load_steps(bed: Bed) -> pd.DataFrame:
    """The load steps of our run, the settling first."""
    return bed.curve[["load_step", "ustar0_m_s", "u_e_m_s"]]


def _grains(bed: Bed) -> pd.DataFrame:
    packing, d = bed.pile.packing, bed.pile.scene.grain.diameter
    pushed = packing.mobile & packing.lee
    exposed = packing.windward | pushed
    tangents = bed.pile.tangents
    slope = np.degrees(np.arctan2(tangents[:, 1], tangents[:, 0]))
    x, z = packing.centres.T * d
    kinds = [~packing.mobile, packing.windward, pushed]
    return pd.DataFrame(
        {
            "id": np.arange(1, len(x) + 1),
            "x_m": x,
            "z_m": z,
            "d_m": packing.sizes * d,
            "kind": np.select(kinds, ["fixed", "counted", "pushed"], "mobile"),
            "slope_deg": np.where(exposed, slope, np.nan),
            "ustar_over_ustar0": np.where(exposed, bed.pile.loads(bed.cases).ratio, np.nan),
        }
    )


def _forces(bed: Bed) -> pd.DataFrame:
    """The flow's force on each exposed grain in each load step: each grain has its own size."""
    loading = bed.pile.loads(bed.cases).loading
    exposed = np.flatnonzero(loading.ratio)
    flows = bed.curve["ustar0_m_s"].tolist()
    force = loading.in_steps(flows)[:, exposed]
    return pd.DataFrame(
        {
            "load_step": np.repeat(bed.curve["load_step"].to_numpy(), len(exposed)),
            "id": np.tile(exposed + 1, len(flows)),
            "fx_n": force[..., 0].ravel(),
            "fz_n": force[..., 1].ravel(),
        }
    )


def _answers(bed: Bed, threshold: float) -> Iterator[Row]:
    """The counts of each load step and the thresholds; `threshold` is their relative tolerance."""
    margins, curve = bed.margins(threshold), bed.curve
    total, last = float(curve["count"].iloc[0]), len(curve) - 1
    for load_step in range(1, last + 1):  # load step 0 is the settling
        yield _counted("moved", curve, load_step, margins)
    moved = _counted("moved", curve, last, margins)
    interval = total - moved["high"], total - moved["low"]
    rest = total - moved["value"]
    yield expectation("not_moved", rest, moved["tolerance"], last, interval, rest)
    if bed.carried_off:
        yield _counted("carried_off", curve, last, margins)
    for row in bed.thresholds.dropna(subset="shields").to_dict("records"):
        yield from _threshold(bed, margins, row)


def _counted(quantity: str, curve: pd.DataFrame, load_step: int, margins: Margins) -> Row:
    """Expectation of a number of grains: that of a load step earlier or later, and its margin."""
    total, n = float(curve["count"].iloc[0]), curve[quantity].to_numpy(float)
    near = n[load_step - 1 : load_step + 2]
    low = max(float(near.min()) - margins.counted * total, 0.0)
    high = min(float(near.max()) + margins.counted * total, total)
    tolerance = 0.0 if near.max() <= margins.until * total else np.nan
    value = n[load_step]
    return expectation(quantity, value, tolerance, load_step, (low, high), value)


def _threshold(bed: Bed, margins: Margins, row: Mapping[Any, Any]) -> Iterator[Row]:
    """Expectations of the Shields number and the flow at a fraction of the moved grains."""
    fraction, shields, flow = row["fraction"], row["shields"], row["ustar0_m_s"]
    tolerance = margins.threshold if fraction <= margins.until else np.nan
    # the number is the mean of two load steps: one load step more to each side
    ustar0 = bed.curve["ustar0_m_s"].to_numpy(float)
    step = int(np.searchsorted(ustar0, flow))
    flows = ustar0[max(step - 2, 0)], ustar0[min(step + 1, len(ustar0) - 1)]
    (own,) = bed.pile.thresholds(bed.cases, [fraction])
    unit, scatter = shields / own.tau, np.nan_to_num(row["scatter"])
    low, high = own.tau_low * unit * (1 - scatter), own.tau_high * unit * (1 + scatter)
    if not bed.pile.bed.is_triangle or bed.pile.pouring:
        # Grains of a poured bed go by chance, and those of a train by turns: n/N stands still for
        # some load steps and leaps in the next. The interval also holds the thresholds of our run
        # at so much less of N, and at more.
        most = float(bed.curve["moved"].iloc[-1] / bed.curve["count"].iloc[-1])
        places = max(fraction - margins.counted, 1e-9), min(fraction + margins.counted, most)
        fewer, more = bed.pile.thresholds(bed.cases, places)
        low, high = min(low, fewer.tau_low * unit), max(high, more.tau_high * unit)
        flows = min(flows[0], fewer.ustar0), max(flows[1], more.ustar0)
    yield expectation("shields", shields, tolerance, fraction, (low, high), shields)
    yield expectation("ustar0_m_s", flow, tolerance, fraction, flows, flow)
