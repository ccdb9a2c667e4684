"""The rows of the tables: scenes, single grains, flows, and piles with their grains."""

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from math import ceil, hypot, isfinite, log, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from orchestrator.bed.deck import read_texts
from orchestrator.errors import InputError
from orchestrator.fidelity import limits, smoothing, spread
from orchestrator.fidelity.decision import Decision
from orchestrator.flow.profiles import PROFILES
from orchestrator.flow.stress import bubble
from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.corrected import CorrectedPile
from orchestrator.grains.loads import interlocking
from orchestrator.grains.motion import MODES, Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics import measured
from orchestrator.physics.reported import every_unit
from orchestrator.physics.velocity import log_law_speed, outer_roughness
from orchestrator.plan import Plan
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form, law_holds
from orchestrator.study.criterion import ENTRAINED, SUSTAINED, of_single_grain
from orchestrator.study.declare import UnfitError
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, changed
from orchestrator.tables.columns import phrases, several
from orchestrator.types import BoolArray, FloatArray, Row

POINT = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law", "regime")
"""Columns by which a scene is found in a figure; tables of results have them too."""
PER_E_FOLD = 0.06
"""Relative rise of tau_c with each e-fold of the flow's z0, at most: triangles of 15
and 30 deg under solved flows, z0/h from 2.5e-4 to 8e-3, at 10 to 70 % of the grains;
0.03 in the mean."""
ENDS = ("", "_low", "_high")
"""Endings of the columns of a threshold and of its interval."""
SMOOTHED = {
    0.5: "first_half_smoothing_m_s",
    1.0: "first_smoothing_m_s",
    2.0: "first_twice_smoothing_m_s",
}
"""Columns of the flow at which motion starts, by the factor of `smoothing.compared`."""
ALONE: Row = {
    "criterion": ENTRAINED,
    "shields_entrained": nan,
    "shields_sustained": nan,
    "shields_sustained_low": nan,
    "shields_sustained_high": nan,
    "shields_cessation": nan,
    "decides": ENTRAINED,
}
"""Columns of the criterion of a single grain that only leaves its pocket."""
FEW_GRAINS = 10
"""Grains of a size class below which the interval of its threshold is wide."""
WAY_UP: Mapping[str, str] = {
    "ustar_toe": "u*/u*_0 of the wall stress at the toe of the first form",
    "ustar_quarter": (
        "u*/u*_0 of the wall stress at a quarter of the way along the bed from the toe "
        "to the crest"
    ),
    "ustar_half": (
        "u*/u*_0 of the wall stress at half of the way along the bed from the toe to "
        "the crest"
    ),
    "ustar_three_quarters": (
        "u*/u*_0 of the wall stress at three quarters of the way along the bed from "
        "the toe to the crest"
    ),
    "ustar_crest": "u*/u*_0 of the wall stress at the crest of the first form",
}
"""Columns of u*/u*_0 at equal parts of the way along the bed from the toe to the
crest."""


def point(scene: Scene) -> Row:
    """Make the columns by which a scene is found in a figure.

    Returns
    -------
    dict
        Its columns `POINT`.
    """
    return {column: fields.COLUMNS[column].used(scene) for column in POINT}


SCENES: Mapping[str, str] = {
    **several("scene_id"),
    "group": "groups of the study file that ask for the scene",
    **phrases(*fields.OF_QUESTION),
    "gust": "largest over mean stress of the gusts of the flow; empty without gusts",
    "law_holds": (
        "whether the force law holds at the threshold of a single grain of the scene"
    ),
    **several("case", "flow_case"),
}
"""Columns of `scenes`."""


def scenes(study: Study, plan: Plan) -> Iterator[Row]:
    """List the scenes: what they ask, the groups that ask it, the cases that answer it.

    Parameters
    ----------
    study
        The study.
    plan
        Its plan.

    Yields
    ------
    dict
        A row for each scene, in the study's order.
    """
    cell_of = {scene.id: cell.name for cell in plan.cells for scene in cell.scenes}
    groups: dict[str, dict[str, None]] = {}
    scenes_by_id = {}
    for group in study.groups:
        for asked in group.scenes:
            scenes_by_id[asked.id] = asked
            groups.setdefault(asked.id, {})[group.name] = None
    for asked in scenes_by_id.values():
        decision = plan.decisions[asked.id]
        scene = decision.scene
        case = cell_of.get(scene.id)
        flow_case = None
        pile = plan.piles.get(asked.id)
        if pile:
            case = pile.last_run
            if pile.model.cases:
                flow_case = "; ".join(run.name for run in pile.model.cases)
        yield {
            "scene_id": asked.id,
            "group": "; ".join(groups[asked.id]),
            **fields.question(asked),
            "gust": asked.gust if asked.flow.gusts else nan,
            "law_holds": law_holds(asked),
            "case": case if scene.method.facts.needs_run else None,
            "flow_case": flow_case,
        }


METHODS: Mapping[str, str] = {
    **several("scene_id"),
    "asked": (
        "fields of the method that the scene does not leave at their defaults, by "
        "their names in the table [method]; auto: none"
    ),
    "fidelity": "fidelity of the answer; empty for a single grain",
    "error_estimate": (
        "known relative error of flow and grains together, at the asked fraction at "
        "which it is largest; empty where it is not known"
    ),
    "why": "reason for the method and the flow by which the scene was answered",
    **phrases(*fields.OF_METHOD),
}
"""Columns of `methods`."""


def methods(plan: Plan) -> Iterator[Row]:
    """List how each scene is answered.

    Parameters
    ----------
    plan
        The plan of the study.

    Yields
    ------
    dict
        A row for each scene, with the fields of its method as they are used.
    """
    for scene_id, decision in plan.decisions.items():
        yield {
            "scene_id": scene_id,
            "asked": fields.written(decision.asked),
            "fidelity": decision.fidelity.name if decision.fidelity else None,
            "error_estimate": decision.error_estimate,
            "why": decision.why,
            **fields.method(decision.scene),
        }


class _ByDem(NamedTuple):
    """The threshold of a single grain by DEM, relative to the closed form in u*."""

    value: float = nan
    low: float = nan
    high: float = nan
    fell_upstream: bool = False
    case: str = ""


SINGLE_GRAIN: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **several("reynolds"),
    "reynolds_closed_form": (
        "friction Reynolds number u* d/nu at the threshold, closed form"
    ),
    "shields_closed_form": "Shields number at the threshold, closed form",
    **several("shields_dem", "shields_dem_low", "shields_dem_high"),
    "ustar_closed_form_m_s": "friction velocity at the threshold, closed form",
    "ustar_m_s": "friction velocity at the threshold by DEM",
    "ustar_low_m_s": "highest friction velocity without motion, by DEM",
    "ustar_high_m_s": "lowest friction velocity with motion, by DEM",
    "drag_over_weight": "drag over the submerged weight at the threshold, closed form",
    "fell_upstream": (
        "whether the grain fell back before or instead of moving downstream"
    ),
    **phrases("criterion"),
    "shields_entrained": (
        "Shields number of the mean flow whose gust turns the grain over its neighbour"
    ),
    "shields_sustained": (
        "Shields number of the mean flow from which the grain rolls and hops on after "
        "the gust"
    ),
    "shields_sustained_low": (
        "lower end of the threshold: of a quarter of the grains, and half of the way"
    ),
    "shields_sustained_high": (
        "upper end of the threshold: of three quarters of the grains, and twice the way"
    ),
    "shields_cessation": (
        "Shields number below which motion ceases once it is under way"
    ),
    **several("decides", "case"),
}
"""Columns of `single_grain_rows`, beside those of speeds."""


def single_grain_rows(
    plan: Plan, cells: Iterable[SingleGrainCase], cases: Path
) -> Iterator[Row]:
    """List the single grains that a finished case or the closed form answers.

    Parameters
    ----------
    plan
        The plan of the study.
    cells
        The finished cases of single grains.
    cases
        The directory of the cases.

    Yields
    ------
    dict
        A row for each grain.
    """
    by_dem = _single_grains_by_dem(cells, cases)
    for asked, decision in plan.decisions.items():
        scene = decision.scene
        is_missing = scene.method.facts.needs_run and scene.id not in by_dem
        if asked in plan.piles or is_missing:
            continue
        found = by_dem.get(scene.id, _ByDem())
        exact = closed_form(scene)
        ustar = float(exact.friction_velocity)
        shields = float(exact.shields)
        of_criterion = {**ALONE}
        if scene.threshold.criterion == SUSTAINED:
            both = of_single_grain(scene)
            of_criterion = {"criterion": SUSTAINED}
            for column, (value,) in both.columns().items():
                of_criterion[column] = value
            ratio = float(both.shields[0]) / shields
            shields = float(both.shields[0])
            ustar *= ratio**0.5
        reynolds = ustar * scene.grain.diameter / scene.fluid.viscosity
        row = {
            "scene_id": asked,
            **point(scene),
            "reynolds": reynolds * found.value,
            "reynolds_closed_form": reynolds,
            "shields_closed_form": shields,
            "shields_dem": shields * found.value**2,
            "shields_dem_low": shields * found.low**2,
            "shields_dem_high": shields * found.high**2,
            "ustar_closed_form_m_s": ustar,
            "ustar_m_s": ustar * found.value,
            "ustar_low_m_s": ustar * found.low,
            "ustar_high_m_s": ustar * found.high,
            **_speeds(scene, ustar if np.isnan(found.value) else ustar * found.value),
            "drag_over_weight": float(exact.drag) / scene.weight,
            "fell_upstream": found.fell_upstream,
            **of_criterion,
        }
        if found.case:
            row["case"] = found.case
        yield row


def _single_grains_by_dem(
    cells: Iterable[SingleGrainCase], cases: Path
) -> dict[str, _ByDem]:
    """The thresholds of single grains by DEM, by the scene."""
    by_dem = {}
    for cell in cells:
        motion = Motion.from_csv(cases / cell.name)
        steps = threshold.of_grains(motion)
        fell = (motion.fallen > 0).tolist()
        numbers = zip(steps.value, steps.low, steps.high, fell, strict=True)
        for scene, (value, low, high, fell_upstream) in zip(
            cell.scenes, numbers, strict=True
        ):
            by_dem[scene.id] = _ByDem(value, low, high, fell_upstream, cell.name)
    return by_dem


SPEEDS: Mapping[str, str] = {
    "wind_1m_m_s": "undisturbed wind 1 m above the flat bed of a gas, by the log law",
    "wind_10m_m_s": "undisturbed wind 10 m above the flat bed of a gas, by the log law",
    "current_1m_m_s": (
        "undisturbed current 1 m above the flat bed of a liquid, by the log law"
    ),
    "mean_velocity_m_s": (
        "mean velocity of the undisturbed flow over the depth of a channel, by the log "
        "law; empty where it may be laminar"
    ),
    "discharge_m2_s": (
        "mean velocity times depth of a channel: discharge for each metre of width"
    ),
}
"""Columns of the speeds of undisturbed flows."""


def _speeds(scene: Scene, ustar: float) -> Row:
    """Columns of the speeds of an undisturbed flow of a friction velocity (m/s)."""
    flow = scene.flow
    fluid = scene.fluid
    undisturbed = {
        "rho_f_kg_m3": fluid.density,
        "nu_m2_s": fluid.viscosity,
        "z0_m": scene.bed.roughness,
        "depth_m": flow.depth or np.nan,
        "flow_top": flow.top,
    }
    speeds = every_unit(ustar, undisturbed)
    row = {}
    for column in SPEEDS:
        if np.isfinite(speeds.get(column, nan)):
            row[column] = float(speeds[column])
    mean = row.get("mean_velocity_m_s")
    if mean:
        row["discharge_m2_s"] = mean * (flow.depth or 0.0)
    return row


WALL_STRESS: Mapping[str, str] = {
    **several("flow_case"),
    **phrases("alpha_deg", "h_m", "z0_m"),
    **several("s_m"),
    "s_over_h": "arc length along the bed line from the windward toe over h",
    **several("x_m"),
    "z_m": "height above the flat bed; of a profile z of its file",
    "ustar_over_ustar0_wall": (
        "signed friction velocity of the wall stress over the undisturbed one"
    ),
    "ustar_over_ustar0_eq10": (
        "signed friction velocity by Eq. 10 with ln((z_e + z0)/z0) over the "
        "undisturbed one"
    ),
}
"""Columns of `wall_stress`."""


def wall_stress(pile: Pile, cases: Path) -> Row:
    """List the friction velocity along the bed, for the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        Numbers, and columns of shape (n,) for n places along the bed.
    """
    stress = pile.stress(cases)
    return {
        "flow_case": pile.flow.name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": pile.bed.height,
        "z0_m": pile.flow.roughness_m,
        "s_m": stress.s_m,
        "s_over_h": stress.s_m / pile.bed.height,
        "x_m": pile.bed.place(stress.x_m),
        "z_m": pile.bed.level(stress.z_m),
        "ustar_over_ustar0_wall": stress.ustar_over_ustar0_wall,
        "ustar_over_ustar0_eq10": stress.ustar_over_ustar0_eq10,
    }


SPEED_PROFILE: Mapping[str, str] = {
    **several("flow_case"),
    "profile_at": (
        "place of a profile of speeds: upstream, in the column before the inlet; toe, "
        "of the first form; crest, the highest; lee, where the bed behind the crest is "
        "first within h/100 of its lowest"
    ),
    **several("x_m"),
    "height_over_h": "height over the bed of a speed, over h",
    "u_over_u_e": "speed downstream over that of the approaching flow at 10 h",
    "u_over_u_e_log_law": (
        "speed of the logarithmic law at this height over that at 10 h"
    ),
}
"""Columns of `speed_profile`."""


def speed_profile(pile: Pile, cases: Path) -> Row:
    """List the speeds over a few places of the bed, for the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        The case, and columns of shape (n,) for n heights over the places.
    """
    flow = pile.flow
    read = read_texts(cases / flow.name / PROFILES)
    height = read["height_m"].astype(float)
    law = log_law_speed(flow.ustar0_m_s, height, flow.roughness_m)
    return {
        "flow_case": flow.name,
        "profile_at": read["place"],
        "x_m": pile.bed.place(read["x_m"].astype(float)),
        "height_over_h": height / flow.height_m,
        "u_over_u_e": read["u_m_s"].astype(float) / flow.approach.speed_m_s,
        "u_over_u_e_log_law": law / flow.approach.speed_m_s,
    }


FLOW: Mapping[str, str] = {
    **several("flow_case"),
    **phrases(
        "bed_shape", "alpha_deg", "h_m", "z0_m", "turbulence_model", "first_cell_m"
    ),
    "lid_over_h": "height of the lid above the flat bed over h",
    "upstream_over_h": "length of the flat bed before the forms over h",
    "downstream_over_h": "length of the flat bed behind the forms over h",
    "separation_over_h": (
        "where reversed flow begins behind the crest, over h; empty: nowhere"
    ),
    "reattachment_over_h": (
        "where reversed flow ends behind the crest, over h; empty: nowhere"
    ),
    **WAY_UP,
    "ustar_mean": (
        "mean u*/u*_0 of the wall stress from the toe to the crest of the first form"
    ),
    "ustar_largest": "largest u*/u*_0 of the wall stress on the bed",
    "measured_reattachment_over_h": (
        "where reversed flow ended in a wind tunnel, over h; empty: not measured"
    ),
    "measured_verified": "whether the measured number was read in its source",
    "measured_source": "source of the measured number",
}
"""Columns of `flow`."""


def flow(pile: Pile, cases: Path) -> Row:
    """Make the row of the solved flow of a pile.

    Parameters
    ----------
    pile
        The pile.
    cases
        The directory of the finished cases.

    Returns
    -------
    dict
        The settings of the flow, its separation and its speed-up.
    """
    case = pile.flow
    stress = pile.stress(cases)
    line = pile.model.line
    separation, reattachment = bubble(stress, line.h) or (np.nan, np.nan)
    ustar = stress.ustar_over_ustar0_wall
    way = np.linspace(0, line.crest_s, len(WAY_UP))
    on_the_way = np.interp(way, stress.s_m, ustar).tolist()
    windward = (stress.s_m > 0) & (stress.s_m < line.crest_s)
    length = stress.length_m[windward]
    mean = np.nan
    if length.size:
        mean = float(np.average(ustar[windward], weights=length))
    row = {
        "flow_case": case.name,
        "bed_shape": pile.bed.shape_name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "turbulence_model": case.settings.turbulence_model,
        "first_cell_m": case.first_cell_m,
        "lid_over_h": case.lid,
        "upstream_over_h": case.settings.upstream,
        "downstream_over_h": case.settings.downstream,
        "separation_over_h": separation,
        "reattachment_over_h": reattachment,
        **dict(zip(WAY_UP, on_the_way, strict=True)),
        "ustar_mean": mean,
        "ustar_largest": float(ustar.max()),
    }
    hill = measured_hill(pile)
    if hill is not None:
        row["measured_reattachment_over_h"] = hill.reattachment or np.nan
        row["measured_verified"] = hill.verified
        row["measured_source"] = hill.source
    return row


def measured_hill(pile: Pile) -> measured.MeasuredHill | None:
    """Find the hill of a wind tunnel that a pile is.

    Returns
    -------
    MeasuredHill or None
        The hill, if it is one.
    """
    bed = pile.bed
    case = pile.flow
    if not bed.form.has_measured_flow or bed.profile or bed.forms > 1 or bed.obstacles:
        return None
    return measured.rushil_hill(bed.slope_deg, case.height_m / case.roughness_m)


class Answer:
    """The answer to a scene: a pile with what its finished cases say, read once.

    Parameters
    ----------
    decision
        How the scene is answered.
    pile
        Its pile.
    cases
        The directory of the finished cases.
    smoothed
        The same bed with other smoothing, by the factor of its length.
    """

    def __init__(
        self,
        decision: Decision,
        pile: Pile,
        cases: Path,
        smoothed: Mapping[float, Pile] | None = None,
    ) -> None:
        self.decision = decision
        self.pile = pile
        self.scene_id = decision.asked.id
        self.smoothed: dict[float, float] = {}
        for factor, other in (smoothed or {}).items():
            _, self.smoothed[factor] = other.first(other.motion(cases))
        self.cases = cases
        self.motion = pile.motion(cases)
        self.speed = pile.speed(cases)
        self.interlocking = interlocking(pile, cases)
        self.first = pile.first(self.motion)
        self.checked = (np.nan, np.nan)
        if decision.is_along:
            # where no grains can lie there is no check
            with suppress(InputError, UnfitError):
                around = pile.around(self.first[0])
                self.checked = around.first(around.motion(cases))

    @cached_property
    def between(self) -> float:
        """Relative error of a flow that lies between others; 0 of one that does not."""
        return self.pile.model.error(self.cases)

    def error_at(self, fraction: float) -> float | None:
        """Find the numerical error at a fraction, with what its runs show of it.

        That is the error of a flow between others, and of a correction by DEM.

        Parameters
        ----------
        fraction
            Fraction n/N of the counted grains.

        Returns
        -------
        float or None
            The relative error; None where it is not known.
        """
        error = self.decision.error_at(fraction)
        if error is None:
            return None
        of_correction = self.pile.correction_error(fraction, self.cases)
        found = hypot(error, self.between, of_correction)
        return found if isfinite(found) else None

    def at(self, fraction: float, chosen: BoolArray | None = None) -> PileThreshold:
        """Find the threshold of the pile, or of some of its counted grains.

        Parameters
        ----------
        fraction
            The fraction that has moved.
        chosen
            Which of the counted grains, shape (count,); by default all. The interval of
            some holds how many of so few would have moved by chance.

        Returns
        -------
        PileThreshold
            The threshold.
        """
        density = self.pile.scene.fluid.density
        if chosen is None:
            return threshold.of_pile(self.motion, self.speed, fraction, density)
        ends = threshold.sampled(fraction, int(chosen.sum()))
        motion = self.motion.of(chosen)
        return threshold.of_pile(motion, self.speed[chosen], fraction, density, ends)


def shields(scene: Scene, tau: Any) -> Any:
    """Make a Shields number of a stress.

    Parameters
    ----------
    scene
        The scene with its grain.
    tau
        Stress, Pa, a number or an array.

    Returns
    -------
    float or ndarray
        The stress over (rho_sol - rho_f) g d.
    """
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def _reynolds(scene: Scene, tau: Any) -> Any:
    """The particle Reynolds number Re* of a stress, Pa."""
    ustar = np.sqrt(tau / scene.fluid.density)
    return ustar * scene.grain.diameter / scene.fluid.viscosity


PILE_GRAIN: Mapping[str, str] = {
    **several("scene_id"),
    "grain_id": "id of the grain in the deck; by the method local number of the place",
    **several("s_m", "x_m"),
    "y_m": "place across the flow in a strip",
    "ustar_over_ustar0": (
        "signed friction velocity at the grain over the undisturbed one"
    ),
    "moved_in_load_step": (
        "load step in which the grain moved: passed the displacement criterion "
        "downstream, or was carried off; 0: never"
    ),
    "fallen_in_load_step": (
        "load step in which the grain was first displaced upstream by the displacement "
        "criterion; 0: never"
    ),
    **several("carried_off"),
    "mode": (
        "how the grain moved: rolled, slid, lifted (rose by more than 0.3 d) or none; "
        "the number of lifted grains depends on the stiffness and on the mobile layers "
        "of the model"
    ),
    **several("ustar0_m_s", "decides", "size_over_d"),
    "pivot_deg": (
        "angle of the grain's foremost contact from the normal of the bed; in a strip "
        "that of the saddle through which the grain rolls; empty where no contact lets "
        "it go"
    ),
}
"""Columns of `pile_grain`."""


def pile_grain(answer: Answer) -> Row:
    """List the counted grains of a pile: the stress on each, when and how it moved.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    dict
        Numbers, and columns of shape (n,) for n counted grains.
    """
    pile = answer.pile
    motion = answer.motion
    packing = pile.packing
    counted = packing.windward
    d = pile.scene.grain.diameter
    columns = {
        "scene_id": answer.scene_id,
        "grain_id": np.flatnonzero(counted) + 1,
        "s_m": packing.arc_length[counted] * d,
        "x_m": pile.bed.place(packing.centres[counted, 0] * d),
        "ustar_over_ustar0": answer.speed,
        "moved_in_load_step": motion.load_step,
        "fallen_in_load_step": motion.fallen,
        "carried_off": motion.carried.astype(int),
        "mode": np.array(MODES)[motion.mode],
        "ustar0_m_s": threshold.of_grains(motion).value,
    }
    if pile.is_sustained:
        by_sustained = pile.sustained_decides(answer.cases)
        columns["decides"] = np.where(by_sustained, SUSTAINED, ENTRAINED)
    if pile.pouring:
        columns["size_over_d"] = packing.sizes[counted]
        columns["pivot_deg"] = pile.pivot_angles_deg
        if packing.width:
            columns["y_m"] = packing.places.xyz[counted, 1] * d
    return columns


PILE_CURVE: Mapping[str, str] = {
    **several("scene_id"),
    "load_step": "number of the load step; 0 is the settling",
    **several("u_e_m_s", "ustar0_m_s", "count", "moved"),
    "not_moved": "N - n, counted grains that had not moved",
    **several("carried_off"),
    "fallen_upstream": (
        "grains that had been displaced upstream by the displacement criterion, "
        "carried off later or not"
    ),
    **several("fraction_moved"),
    "mean_tau_pa": "mean size of the wall stress on the grains that had moved",
    **several("shields", "reynolds"),
}
"""Columns of `pile_curve`."""


def pile_curve(answer: Answer) -> Row:
    """List the fraction of a pile that had moved, and the stress, at each load step.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    dict
        Numbers, and columns of shape (K + 1,) for K load steps.
    """
    scene = answer.pile.scene
    motion = answer.motion
    tau = threshold.mean_tau(motion, answer.speed, scene.fluid.density)
    return {
        "scene_id": answer.scene_id,
        "load_step": np.arange(len(motion.flow)),
        "u_e_m_s": motion.flow * answer.pile.model.lid_speed_ratio,
        "ustar0_m_s": motion.flow,
        "count": motion.count,
        "moved": motion.moved,
        "not_moved": motion.count - motion.moved,
        "carried_off": motion.carried_off,
        "fallen_upstream": motion.fallen_upstream,
        "fraction_moved": motion.fraction,
        "mean_tau_pa": tau,
        "shields": shields(scene, tau),
        "reynolds": _reynolds(scene, tau),
    }


PILE_THRESHOLD: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing", "stress"),
    **several("fraction", "shields", "shields_numerical_low", "shields_numerical_high"),
    "smooth_bed": (
        "by how much shields may still move, relative, to the z0 that the flow has "
        "over its bed at this threshold, z0 + nu/(9 u*) where it is not rough: 6 % at "
        "most for each e-fold from the z0 of the solve; the interval holds it"
    ),
    "numerical_error": (
        "known relative error of the threshold at this fraction, of two measured "
        "fractions beside it the larger; empty where none was measured: of such beds, "
        "or at such fractions"
    ),
    "numerical_error_coverage": (
        "share of the scenes on which numerical_error was measured that it holds, each "
        "by what was found from all other geometries; with factors of few piles by "
        "DEM at most the share that the piles kept apart hold"
    ),
    "numerical_error_count": "how many scenes, or piles kept apart, these are at least",
    "shields_model_low": (
        "lower end of the model's interval of shields: the choices that all methods "
        "share, changed one at a time by `orchestrator budget`; empty where they were "
        "not measured"
    ),
    "shields_model_high": (
        "upper end of the model's interval of shields: the choices that all methods "
        "share, changed one at a time by `orchestrator budget`; empty where they were "
        "not measured"
    ),
    "model_share": "the shared choice that moves the threshold most",
    "frozen_bed": (
        "largest known change of shields, relative, where the bed line is drawn anew "
        "as the grains leave (threshold.update), measured by `orchestrator budget` for "
        "piles of this kind; empty where it is not known, or the bed changes"
    ),
    **several("reynolds", "ustar0_m_s", "u_e_m_s"),
    "pivot_ustar0_m_s": (
        "undisturbed friction velocity at the threshold by the closed form with each "
        "grain's own stress"
    ),
    **several("count"),
    "highest_fraction": "largest n/N that the load steps reached",
    "share_carried_off": "carried_off over moved where the fraction is first reached",
    "share_against_flow": (
        "of the grains that had moved where the fraction is first reached, the share "
        "that a reversed flow drove upstream"
    ),
    "interlocking": (
        "undisturbed friction velocity at which the first grain leaves by peeling over "
        "that at which the first grain moves by itself: above 1 the touching grains of "
        "a row without a free end hold one another; of a bed without grains for those "
        "around the first motion"
    ),
    **several("case"),
}
"""Columns of `pile_threshold`, beside those below and those of speeds."""


def pile_threshold(answer: Answer) -> Iterator[Row]:
    """Find the threshold of a pile at each fraction that its scene asks for.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction. The model's interval is of the choices that all
        fidelities share.
    """
    pile = answer.pile
    scene = pile.scene
    place = point(scene)
    pivots = pile.pivot_thresholds(answer.speed)
    starts = _starts(answer)
    for fraction in scene.threshold.fractions:
        found = answer.at(fraction)
        model = spread.spread(answer.decision.asked, fraction)
        value = shields(scene, found.tau)
        smooth = _smooth_bed(scene, found.ustar0)
        error = answer.error_at(fraction)
        low, high = _interval(scene, found, error, smooth)
        yield {
            "scene_id": answer.scene_id,
            **place,
            "packing": pile.bed.packing,
            "stress": scene.forces.stress,
            "fraction": fraction,
            "shields": value,
            "shields_numerical_low": low,
            "shields_numerical_high": high,
            "numerical_error": error,
            **_coverage(answer, fraction, error),
            "smooth_bed": smooth,
            "shields_model_low": value * (1 - model.low),
            "shields_model_high": value * (1 + model.high),
            "model_share": model.dominant or None,
            "frozen_bed": model.frozen_bed,
            "reynolds": _reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * pile.model.lid_speed_ratio,
            **_speeds(scene, found.ustar0),
            **starts,
            "pivot_ustar0_m_s": pivots[_needed(fraction, answer.motion.count) - 1],
            "count": answer.motion.count,
            "highest_fraction": answer.motion.fraction[-1],
            "share_carried_off": found.carried_off,
            "share_against_flow": found.against_the_flow,
            "interlocking": answer.interlocking,
            **_decided(answer),
            **_smoothing(answer),
            **_between(answer),
            **_corrected(answer, fraction),
            "case": pile.last_run,
        }


STARTS: Mapping[str, str] = {
    "first_x_m": (
        "where motion starts: distance along the flow from the windward toe, of a "
        "profile x of its file"
    ),
    "first_ustar0_m_s": "undisturbed friction velocity at which motion starts there",
    "first_ustar0_numerical_low_m_s": (
        "lower end of the numerical interval of first_ustar0_m_s, which holds its load "
        "step and the numerical error of the method"
    ),
    "first_ustar0_numerical_high_m_s": (
        "upper end of this interval; empty where the numerical error leaves it open"
    ),
    "first_numerical_error": (
        "known relative error of the flow at which motion starts; empty where none was "
        "measured at so small a fraction"
    ),
    "pivot_x_m": (
        "first_x_m by pivots of grains around it; empty where they were not asked for"
    ),
    "pivot_first_m_s": "first_ustar0_m_s by those pivots",
}
"""Columns of where motion starts."""


def _starts(answer: Answer) -> Row:
    """Columns of where motion starts, by the method and by the pivots."""
    first_x, first_ustar0 = answer.first
    # the first grain of all is a fraction, too
    error = answer.error_at(1 / answer.motion.count)
    low, high = _first_interval(answer, error)
    pivot_x, pivot_ustar0 = answer.checked
    bed = answer.pile.bed
    return {
        "first_x_m": float(bed.place(first_x)),
        "first_ustar0_m_s": first_ustar0,
        "first_ustar0_numerical_low_m_s": low,
        "first_ustar0_numerical_high_m_s": high,
        "first_numerical_error": error,
        "pivot_x_m": float(bed.place(pivot_x)),
        "pivot_first_m_s": pivot_ustar0,
    }


def _first_interval(answer: Answer, error: float | None) -> tuple[float, float]:
    """Ends of the friction velocity at which motion starts, m/s.

    They hold the load step in which it starts, and what is within the numerical error
    of that load step; they are not known without a known numerical error.
    """
    _, ustar0 = answer.first
    if error is None or np.isnan(ustar0):
        return np.nan, np.nan
    grains = threshold.of_grains(answer.motion)
    is_first = np.flatnonzero(grains.value == ustar0)
    least, most = threshold.within(ustar0**2, error)
    low = np.append(grains.low[is_first], np.sqrt(least)).min()
    high = np.append(grains.high[is_first], np.sqrt(most)).max()
    return float(low), float(high)


DECIDED: Mapping[str, str] = {
    **phrases("criterion"),
    **several("decides"),
}
"""Columns of criteria."""


def _decided(answer: Answer) -> Row:
    """The column of which criterion held most of the counted grains longer."""
    if not answer.pile.is_sustained:
        return {"criterion": ENTRAINED, "decides": ENTRAINED}
    by_sustained = answer.pile.sustained_decides(answer.cases)
    decides = SUSTAINED if by_sustained.mean() > 0.5 else ENTRAINED
    return {"criterion": SUSTAINED, "decides": decides}


def _needed(fraction: float, count: int) -> int:
    """How many grains are a fraction of some, rounded up."""
    return ceil(fraction * count - 1e-9)


def _interval(
    scene: Scene, found: PileThreshold, error: float | None, smooth: float
) -> tuple[float, float]:
    """Ends of the interval of a Shields number; an end that is not known is NaN.

    It holds load steps and count, at least what is within the numerical error of the
    threshold, and how far the z0 of the flow is from that of a bed that is not rough
    (`smooth`). It is not known without a known numerical error.
    """
    if error is None:
        return np.nan, np.nan
    least, most = threshold.within(found.tau, error)
    if np.isnan(found.tau):  # it was not reached: more than the last flow is needed
        least = found.tau_low / (1 + error)
    low = float(np.fmin(found.tau_low, least))
    high = float(np.maximum(found.tau_high, most))
    low *= 1 + min(smooth, 0.0)
    high *= 1 + max(smooth, 0.0)
    return shields(scene, low), shields(scene, high)


def _smooth_bed(scene: Scene, ustar0: float) -> float:
    """How far at most tau_c moves, relative, if the flow has the z0 of its bed."""
    if not scene.method.flow.facts.follows_bed:
        return 0.0
    outer = float(outer_roughness(scene.bed.roughness, ustar0, scene.fluid.viscosity))
    return PER_E_FOLD * log(outer / scene.solve_roughness)


BETWEEN: Mapping[str, str] = {
    "between_error": (
        "relative error of the stress of a flow that is not solved and lies between "
        "solved ones of other roughness (solved_z0_m): the largest where one of these "
        "is left out; numerical_error contains it"
    ),
}
"""Column of a flow that lies between others."""


def _between(answer: Answer) -> Row:
    """The column of a flow that lies between others: how far it is off."""
    if not answer.pile.model.is_between:
        return {}
    return {"between_error": answer.between}


def _coverage(answer: Answer, fraction: float, error: float | None) -> Row:
    """The columns of what a numerical error holds."""
    if error is None:
        return {"numerical_error_coverage": nan, "numerical_error_count": nan}
    known = answer.decision.known.at(fraction)
    coverage = known.coverage
    count = nan if known.scenes is None else float(known.scenes)
    if isinstance(answer.pile, CorrectedPile):
        by = answer.pile.correction
        coverage = float(np.fmin(coverage, by.confidence))
        count = float(np.fmin(count, len(by.kept)))
    return {"numerical_error_coverage": coverage, "numerical_error_count": count}


CORRECTED: Mapping[str, str] = {
    "correction": (
        "factor of shields from other piles by DEM: the median of theirs by DEM over "
        "theirs without it; empty where nothing was corrected"
    ),
    "correction_piles": "how many piles by DEM that factor is made from",
    "correction_error": (
        "largest relative difference of a corrected threshold from DEM, of the piles "
        "kept apart; numerical_error contains it"
    ),
    "correction_kept": (
        "how many piles by DEM were kept apart, drawn at random; of n the largest "
        "difference holds n/(n + 1) of all such piles"
    ),
}
"""Columns of a threshold that is corrected by DEM of other piles."""


def _corrected(answer: Answer, fraction: float) -> Row:
    """The columns of a correction."""
    pile = answer.pile
    if not isinstance(pile, CorrectedPile):
        return {}
    by = pile.correction
    factors = by.factors(pile.stratum, answer.cases)
    return {
        "correction": factors[by.fractions.index(fraction)],
        "correction_piles": by.made_from(pile.stratum),
        "correction_error": by.error(fraction, answer.cases),
        "correction_kept": len(by.kept),
    }


SMOOTHING: Mapping[str, str] = {
    "smoothing_needed_m": (
        "smoothing, m, that a noisy profile needs: the noise of its points then has a "
        "slope of 0.01"
    ),
    "smoothing_compared_m": (
        "smoothing of a noisy profile whose half and twice are compared, m: the one "
        "used, or needed if that is more"
    ),
    "first_smoothing_m_s": (
        "first_ustar0_m_s by the closed form along the bed line with that smoothing"
    ),
    "first_half_smoothing_m_s": (
        "the same with half of it; empty where the bed cannot be meshed"
    ),
    "first_twice_smoothing_m_s": "the same with twice of it",
}
"""Columns of a noisy profile."""


def _smoothing(answer: Answer) -> Row:
    """Columns of a noisy profile: the smoothing, and the first motion around it."""
    length = smoothing.length_of(answer.pile.scene)
    if not length:
        return {}
    profile = answer.pile.bed.profile
    assert profile
    row = {"smoothing_needed_m": profile.needs, "smoothing_compared_m": length}
    for factor, column in SMOOTHED.items():
        row[column] = answer.smoothed.get(factor, np.nan)
    return row


SIZE_CLASS: Mapping[str, str] = {
    **several("scene_id", "fraction", "size_over_d", "count"),
    "few": (
        "whether the size class has fewer than ten counted grains that a free way "
        "leads out"
    ),
    "class_moved": (
        "part of the size class that had moved when the fraction of all grains had"
    ),
    "class_moved_low": (
        "least part of the size class that has moved on a bed of many such grains, by "
        "the number of them (binomial, 80 %)"
    ),
    "class_moved_high": "largest part of it, alike",
    **several("ustar0_m_s"),
    "shields_own": (
        "Shields number at the threshold of a size class of diameter d_i, "
        "tau_c/((rho_sol - rho_f) g d_i)"
    ),
    "shields_own_low": (
        "lower end of the interval of shields_own: its number leaves that to chance "
        "(binomial, 80 %), load steps, and the interval of the bed; empty where so few "
        "bound nothing, and where that of the bed is open"
    ),
    "shields_own_high": "upper end of the interval of shields_own, alike",
    "hiding": (
        "shields_own over that at d50, between the two size classes beside d50; empty "
        "where one of these has no threshold or its grains lie loose"
    ),
    "hiding_low": "least hiding of the size class, by shields_own_low",
    "hiding_high": "largest hiding of the size class, by shields_own_high",
    "hiding_equal_mobility": (
        "hiding where the part of the size class that has moved is the fraction times "
        "(d/d_i)^2, as in measurements at equal dimensionless transport; empty like "
        "hiding, and where that part is above 1"
    ),
    "hiding_wilcock_crowe": "hiding of the size class by Wilcock and Crowe",
    "hiding_egiazaroff": "hiding of the size class by Egiazaroff",
}
"""Columns of `size_class`."""


def size_class(answer: Answer) -> Iterator[Row]:
    """Find the threshold of each size class of a mixture.

    It is that at which a fraction of its grains has moved; for the hiding of equal
    mobility, a part that falls with the size. Grains that no free way leads out of
    their places count in no class. The stress at d50, over which those of the classes
    are, lies between the two classes beside it.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction and class; none of a pile that was not poured.
    """
    pile = answer.pile
    if not pile.pouring:
        return
    classes = _free_classes(pile)
    sizes = np.array([each.size for each in classes])
    for fraction in pile.scene.threshold.fractions:
        load_step = threshold.first_load_step(answer.motion, fraction)
        has_moved = None if load_step is None else answer.motion.moved_by(load_step)
        found = [answer.at(fraction, each.chosen) for each in classes]
        median = threshold.at_size(1.0, sizes, np.array([at.tau for at in found]))
        hidden = _equal_mobility(answer, classes, fraction)
        for each, at, of_mobility in zip(classes, found, hidden, strict=True):
            count = int(each.chosen.sum())
            tau = np.array([at.tau, at.tau_low, at.tau_high])
            wilcock_crowe = measured.wilcock_crowe_hiding(each.size) / each.size
            yield {
                "scene_id": answer.scene_id,
                "fraction": fraction,
                "size_over_d": each.size,
                "count": count,
                "few": count < FEW_GRAINS,
                **_with_ends("class_moved", _moved_of(each, has_moved)),
                "ustar0_m_s": at.ustar0,
                **_with_ends("shields_own", shields(pile.scene, tau) / each.size),
                **_with_ends("hiding", tau / median / each.size),
                "hiding_equal_mobility": float(of_mobility),
                "hiding_wilcock_crowe": float(wilcock_crowe),
                "hiding_egiazaroff": float(measured.egiazaroff_hiding(each.size)),
            }


def _free_classes(pile: Pile) -> list[threshold.SizeClass]:
    """The size classes of the counted grains that are free to leave."""
    sizes = pile.packing.sizes[pile.packing.windward]
    classes = []
    for each in threshold.classes(sizes):
        is_free = each.chosen & pile.is_free
        if is_free.any():
            classes.append(each._replace(chosen=is_free))
    return classes


def _equal_mobility(
    answer: Answer, classes: list[threshold.SizeClass], fraction: float
) -> FloatArray:
    """The hiding of each class at a part of its grains that falls with its size."""
    sizes = np.array([each.size for each in classes])
    parts = fraction * sizes**-threshold.EQUAL_MOBILITY
    taus = np.full(len(classes), np.nan)
    for place, each in enumerate(classes):
        if parts[place] <= 1:
            taus[place] = answer.at(parts[place], each.chosen).tau
    median = threshold.at_size(1.0, sizes, taus)
    return np.asarray(taus / median / sizes)


def _moved_of(
    each: threshold.SizeClass, has_moved: BoolArray | None
) -> tuple[float, float, float]:
    """The part of a class that has moved, with its interval; NaN if none is known."""
    if has_moved is None:
        return (np.nan, np.nan, np.nan)
    count = int(each.chosen.sum())
    moved = int(has_moved[each.chosen].sum())
    return (moved / count, *threshold.of_all(moved, count))


def _with_ends(name: str, values: Iterable[float]) -> Row:
    """The columns of a value and of both ends of its interval."""
    names = [name + end for end in ENDS]
    return dict(zip(names, values, strict=True))


FORM: Mapping[str, str] = {
    **several("scene_id"),
    "form": "number of the form, from the first upstream",
    **several("count", "fraction"),
    "mean_ustar_over_ustar0": (
        "mean of ustar_over_ustar0 over the form's counted grains"
    ),
    **several("ustar0_m_s"),
    "over_first_form": (
        "ustar0_m_s over that at which the same fraction of the first form has moved; "
        "empty where its grains lie loose"
    ),
}
"""Columns of `forms`."""


def forms(answer: Answer) -> Iterator[Row]:
    """Find the thresholds of the forms of a train.

    Parameters
    ----------
    answer
        The pile with its results.

    Yields
    ------
    dict
        A row for each fraction and form, of the counted grains of that form; none of a
        bed of one form.
    """
    pile = answer.pile
    bed = pile.bed
    if bed.forms == 1 or bed.profile:
        return
    period = bed.spacing or (pile.model.line.x[-2] - pile.model.line.x[1]) / bed.forms
    x = pile.packing.centres[pile.packing.windward, 0] * pile.scene.grain.diameter
    form = np.clip(np.floor(x / period).astype(int), 0, bed.forms - 1)
    ustar0 = threshold.of_grains(answer.motion).value
    for fraction in pile.scene.threshold.fractions:
        first = np.nan
        for number in range(bed.forms):
            # a grain that has not moved is not a number, which sorts last
            grains = np.sort(ustar0[form == number])
            speed = answer.speed[form == number]
            reached = np.nan
            mean = np.nan
            if len(grains):
                needed = max(_needed(fraction, len(grains)), 1)
                reached = float(grains[needed - 1])
                mean = float(speed.mean())
            if number == 0:
                first = reached
            yield {
                "scene_id": answer.scene_id,
                "form": number + 1,
                "count": len(grains),
                "fraction": fraction,
                "mean_ustar_over_ustar0": mean,
                "ustar0_m_s": reached,
                # loose grains of the first form move in still fluid: nothing is a
                # multiple of that
                "over_first_form": reached / first if first > 0 else np.nan,
            }


BED_CHANGE: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing"),
    **several("count", "moved", "fraction_moved", "shields"),
    "shields_frozen": (
        "shields of the same pile under the flow of the whole pile until the end"
    ),
    "change": "shields over shields_frozen, less 1",
    "change_ustar0": (
        "ustar0_m_s on the bed that changes over that on the frozen bed, less 1"
    ),
    "holds_until": (
        "n/N at which shields first differs by more than 5 % from shields_frozen; "
        "empty: nowhere up to the last fraction"
    ),
}
"""Columns of `bed_changes`."""


def bed_changes(
    piles: Mapping[str, Pile], answer_of: Callable[[str], Answer]
) -> Iterator[Row]:
    """Compare piles on a bed that changes with the same on a frozen bed.

    The two are answered alike in all else, by one method on one mesh.

    Parameters
    ----------
    piles
        The piles whose runs are done, by the ids of the asked scenes.
    answer_of
        Gives the answer to such a scene.

    Yields
    ------
    dict
        Numbers, and columns of shape (n,): thresholds for the first to the n-th grain.
    """
    changing = [one for one in piles if piles[one].scene.threshold.update]
    if not changing:
        return
    frozen = {pile.scene.id: asked for asked, pile in piles.items()}
    for asked in changing:
        scene = piles[asked].scene
        found = frozen.get(changed(scene, {"threshold.update": 0.0}).id)
        if found is None:
            continue
        answer, twin = answer_of(asked), answer_of(found)
        count = answer.motion.count
        moved = np.arange(1, _needed(max(scene.threshold.fractions), count) + 1)
        tau, ustar = _thresholds_of(answer, moved / count)
        tau_frozen, ustar_frozen = _thresholds_of(twin, moved / count)
        change = tau / tau_frozen - 1
        beyond = moved[np.abs(change) > limits.FROZEN_BED] / count
        yield {
            "scene_id": answer.scene_id,
            **point(scene),
            "packing": answer.pile.bed.packing,
            "count": count,
            "moved": moved,
            "fraction_moved": moved / count,
            "shields": shields(scene, tau),
            "shields_frozen": shields(scene, tau_frozen),
            "change": change,
            "change_ustar0": ustar / ustar_frozen - 1,
            "holds_until": beyond[0] if len(beyond) else np.nan,
        }


def _thresholds_of(
    answer: Answer, fractions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The stress (Pa) and the undisturbed u* (m/s) of a pile at some fractions."""
    found = [answer.at(fraction) for fraction in fractions.tolist()]
    tau = np.array([at.tau for at in found])
    ustar0 = np.array([at.ustar0 for at in found])
    return tau, ustar0


CHECK: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing"),
    **several(
        "fraction", "shields", "shields_dem", "shields_dem_low", "shields_dem_high"
    ),
    "difference": "shields over shields_dem, less 1",
    **several("case"),
}
"""Columns of `check_rows`."""


def check_rows(plan: Plan, cases: Path, done: Container[str]) -> Iterator[Row]:
    """Compare piles with DEM of the same, where both are run.

    Parameters
    ----------
    plan
        The plan of the study.
    cases
        The directory of the cases.
    done
        Names of the cases that are done.

    Yields
    ------
    dict
        A row for each pile and fraction.
    """
    for asked, dem in plan.checks.items():
        pile = plan.piles[asked]
        if not (pile.is_run(done) and dem.is_run(done)):
            continue
        scene = pile.scene
        fractions = scene.threshold.fractions
        found = pile.thresholds(cases, fractions)
        by_dem = dem.thresholds(cases, fractions)
        for ours, theirs in zip(found, by_dem, strict=True):
            yield {
                "scene_id": asked,
                **point(scene),
                "packing": dem.bed.packing,
                "fraction": ours.fraction,
                "shields": shields(scene, ours.tau),
                "shields_dem": shields(scene, theirs.tau),
                "shields_dem_low": shields(scene, theirs.tau_low),
                "shields_dem_high": shields(scene, theirs.tau_high),
                "difference": ours.tau / theirs.tau - 1,
                "case": dem.case.name,
            }


class OfPile(NamedTuple):
    """The rows of one pile, in the tables that its own results alone make.

    Attributes
    ----------
    thresholds, classes, forms
        Those of `pile_threshold`, `size_class` and `forms`.
    curve, grains
        Those of `pile_curve` and `pile_grain`.
    """

    thresholds: list[Row]
    classes: list[Row]
    forms: list[Row]
    curve: Row
    grains: Row


def of_pile(answer: Answer) -> OfPile:
    """Make the rows of one pile.

    Parameters
    ----------
    answer
        The pile with its results.

    Returns
    -------
    OfPile
        The rows.
    """
    return OfPile(
        [*pile_threshold(answer)],
        [*size_class(answer)],
        [*forms(answer)],
        pile_curve(answer),
        pile_grain(answer),
    )
