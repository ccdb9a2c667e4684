"""The rows of the tables: scenes, single grains, flows, and piles with their grains."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from math import ceil, log
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.errors import InputError
from orchestrator.fidelity import levels, limits, smoothing
from orchestrator.fidelity.decision import Decision
from orchestrator.fidelity.levels import changed
from orchestrator.flow.stress import bubble
from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.motion import MODES, Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics import measured
from orchestrator.physics.velocity import measurable_speeds, outer_roughness
from orchestrator.plan import Plan
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form, law_holds
from orchestrator.study.parts import UnfitError
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study
from orchestrator.types import BoolArray, Row

POINT = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law", "regime")
"""Columns by which a scene is found in a figure; tables of results have them too."""
PER_E_FOLD = 0.06
"""Relative rise of tau_c with each e-fold of the flow's z0, at most: triangles of 15 and 30 deg
under solved flows, z0/h from 2.5e-4 to 8e-3, at 10 to 70 % of the grains; 0.03 in the mean."""
ENDS = ("", "_low", "_high")  # endings of a threshold's columns
SMOOTHED = {
    0.5: "first_half_smoothing_m_s",
    1.0: "first_smoothing_m_s",
    2.0: "first_twice_smoothing_m_s",
}
"""Columns of the flow at which motion starts, by the factor of `smoothing.compared`."""
FEW = 10  # grains of a size class: the interval of its threshold is wide
# u*/u*_0 at equal parts of the way along the bed from the foot to the top
WAY_UP = (
    "ustar_foot",
    "ustar_quarter",
    "ustar_half",
    "ustar_three_quarters",
    "ustar_top",
)


def point(scene: Scene) -> Row:
    """The columns by which a scene is found in a figure."""
    return {column: fields.COLUMNS[column].asked(scene) for column in POINT}


def scenes(study: Study, plan: Plan) -> Iterator[Row]:
    """A row for each scene of each group, in the study's order: as asked, and as answered."""
    cell_of = {scene.id: cell.name for cell in plan.cells for scene in cell.scenes}
    for group in study.groups:
        for asked in group.scenes:
            decision, pile = plan.decisions[asked.id], plan.piles.get(asked.id)
            scene = decision.scene
            runs = (
                [case.name for case in pile.runs] if pile else [cell_of.get(scene.id)]
            )
            yield {
                "scene_id": asked.id,
                "group": group.name,
                **fields.asked(asked),
                **fields.answered(scene),
                "law_holds": law_holds(asked),
                "why": decision.why,
                "case": runs[-1] if scene.protocol.method == "dem" else None,
                "flow_case": pile.flow.name if pile and pile.model.cases else None,
            }


def single_grain(
    plan: Plan, cells: Iterable[SingleGrainCase], cases: Path
) -> Iterator[Row]:
    """A row for each single grain that a finished case or the closed form answers."""
    # by DEM: u* over that of the closed form, with its interval; a fall upstream; the case
    by_dem: dict[str, tuple[Any, ...]] = {}
    for cell in cells:
        motion = Motion.from_csv(cases / cell.name)
        steps = threshold.of_grains(motion)
        ratios = zip(
            steps.value,
            steps.low,
            steps.high,
            (motion.fallen > 0).tolist(),
            strict=True,
        )
        for scene, numbers in zip(cell.scenes, ratios, strict=True):
            by_dem[scene.id] = (*numbers, {"case": cell.name})
    for asked, answer in plan.decisions.items():
        scene = answer.scene
        if asked in plan.piles or (
            scene.id not in by_dem and scene.protocol.method == "dem"
        ):
            continue
        value, low, high, fell, case = by_dem.get(scene.id, (*[np.nan] * 3, False, {}))
        exact = closed_form(scene)
        ustar, shields = float(exact.friction_velocity), float(exact.shields)
        yield {
            "scene_id": asked,
            **point(scene),
            "answered_method": scene.protocol.method,
            "reynolds": float(exact.reynolds) * value,
            "reynolds_closed_form": float(exact.reynolds),
            "shields_closed_form": shields,
            "shields_dem": shields * value**2,
            "shields_dem_low": shields * low**2,
            "shields_dem_high": shields * high**2,
            "ustar_closed_form_m_s": ustar,
            "ustar_m_s": ustar * value,
            "ustar_low_m_s": ustar * low,
            "ustar_high_m_s": ustar * high,
            **_speeds(scene, ustar if np.isnan(value) else ustar * value),
            "drag_over_weight": float(exact.drag) / scene.weight,
            "fell_upstream": fell,
            **case,
        }


def _speeds(scene: Scene, ustar: float) -> Row:
    """Columns of the speeds of an undisturbed flow that has a friction velocity (m/s)."""
    flow, fluid = scene.flow, scene.fluid
    speeds = measurable_speeds(
        ustar,
        roughness=scene.bed.roughness,
        density=fluid.density,
        viscosity=fluid.viscosity,
        depth=flow.depth or np.nan,
        closed=flow.top == "closed channel",
    )
    row = {
        column: float(speed) for column, speed in speeds.items() if np.isfinite(speed)
    }
    if mean := row.get("mean_velocity_m_s"):
        row["discharge_m2_s"] = mean * (flow.depth or 0.0)
    return row


def wall_stress(pile: Pile, cases: Path) -> Row:
    """Columns of the friction velocity along the bed, for the solved flow of a pile."""
    stress = pile.stress(cases)
    names = ("x_m", "z_m", *(f"ustar_over_ustar0_{kind}" for kind in ("wall", "eq10")))
    return {
        "flow_case": pile.flow.name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": pile.bed.height,
        "z0_m": pile.flow.roughness_m,
        "s_m": stress.s_m,
        "s_over_h": stress.s_m / pile.bed.height,
        **{
            name: getattr(stress, name)
            for name in (*names, "ustar_over_ustar0_eq10_printed")
        },
    }


def flow(pile: Pile, cases: Path) -> Row:
    """The solved flow of a pile: its settings, its separation and its speed-up."""
    case, stress, line = pile.flow, pile.stress(cases), pile.model.line
    separation, reattachment = bubble(stress, line.h) or (np.nan, np.nan)
    ustar, way = (
        stress.ustar_over_ustar0_wall,
        np.linspace(0, line.crest_s, len(WAY_UP)),
    )
    windward = (stress.s_m > 0) & (stress.s_m < line.crest_s)
    length, hill = stress.length_m[windward], measured_hill(pile)
    row = {
        "flow_case": case.name,
        "bed_shape": pile.bed.shape if not pile.bed.profile else "profile",
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
        **dict(zip(WAY_UP, np.interp(way, stress.s_m, ustar).tolist(), strict=True)),
        "ustar_mean": float(np.average(ustar[windward], weights=length))
        if length.size
        else np.nan,
        "ustar_largest": float(ustar.max()),
    }
    if hill is not None:
        row["measured_reattachment_over_h"] = hill.reattachment or np.nan
        row |= {"measured_verified": hill.verified, "measured_source": hill.source}
    return row


def measured_hill(pile: Pile) -> measured.MeasuredHill | None:
    """The hill of a wind tunnel that a pile is, if any."""
    bed, case = pile.bed, pile.flow
    if bed.shape != "rushil" or bed.profile or bed.forms > 1 or bed.obstacles:
        return None
    return measured.rushil_hill(bed.slope_deg, case.height_m / case.roughness_m)


class Answer:
    """The answer to a scene: a pile with what its finished cases say, read once for all tables."""

    def __init__(
        self,
        decision: Decision,
        pile: Pile,
        cases: Path,
        smoothed: Mapping[float, Pile] | None = None,
    ) -> None:
        self.decision, self.pile, self.scene_id = decision, pile, decision.asked.id
        self.smoothed = {
            factor: other.first(other.motion(cases))[1]
            for factor, other in (smoothed or {}).items()
        }
        self.motion, self.speed = pile.motion(cases), pile.speed(cases)
        self.row_hold = pile.row_hold(cases)
        self.first, self.checked = pile.first(self.motion), (np.nan, np.nan)
        if decision.is_along:
            with suppress(
                InputError, UnfitError
            ):  # where no grains can lie there is no check
                around = pile.around(self.first[0])
                self.checked = around.first(around.motion(cases))

    def at(self, fraction: float, chosen: BoolArray | None = None) -> PileThreshold:
        """The threshold of the pile, or of some of its counted grains, at a fraction.

        The interval of some holds how many of so few would have moved by chance.
        """
        motion, speed, density = self.motion, self.speed, self.pile.scene.fluid.density
        if chosen is None:
            return threshold.of_pile(motion, speed, fraction, density)
        ends = threshold.sampled(fraction, int(chosen.sum()))
        return threshold.of_pile(
            motion.of(chosen), speed[chosen], fraction, density, ends
        )


def shields(scene: Scene, tau: Any) -> Any:
    """The Shields number of a stress, Pa."""
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def _reynolds(scene: Scene, tau: Any) -> Any:
    return (
        np.sqrt(tau / scene.fluid.density)
        * scene.grain.diameter
        / scene.fluid.viscosity
    )


def pile_grain(answer: Answer) -> Row:
    """Columns of the counted grains of a pile: the stress on each, when and how it moved."""
    motion, pile, packing = answer.motion, answer.pile, answer.pile.packing
    counted, d = packing.windward, pile.scene.grain.diameter
    columns = {
        "scene_id": answer.scene_id,
        "grain_id": np.flatnonzero(counted) + 1,
        "s_m": packing.arc_length[counted] * d,
        "x_m": packing.centres[counted, 0] * d,
        "ustar_over_ustar0": answer.speed,
        "moved_in_load_step": motion.level,
        "fallen_in_load_step": motion.fallen,
        "carried_off": motion.carried.astype(int),
        "mode": np.array(MODES)[motion.mode],
        "ustar0_m_s": threshold.of_grains(motion).value,
    }
    if pile.pouring:
        columns["size_over_d"] = packing.sizes[counted]
        columns["pivot_deg"] = pile.pivot_angles_deg
        if packing.width:
            columns["y_m"] = packing.places.xyz[counted, 1] * d
    return columns


def pile_curve(answer: Answer) -> Row:
    """Columns of the fraction of a pile that had moved, and the stress, at each load step."""
    scene, motion = answer.pile.scene, answer.motion
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


def pile_threshold(answer: Answer) -> Iterator[Row]:
    """The threshold of a pile at each fraction that its scene asks for.

    The model's interval is of the choices that all levels share.
    """
    pile, motion, asked = answer.pile, answer.motion, answer.decision.asked
    scene, error = pile.scene, answer.decision.error_estimate
    place, pivot = point(scene), pile.pivot_thresholds(answer.speed)
    for fraction in scene.protocol.fractions:
        found, model = answer.at(fraction), levels.spread(asked, fraction)
        value = shields(scene, found.tau)
        smooth = _smooth_bed(scene, found.ustar0)
        low, high = _interval(scene, found, error, smooth)
        yield {
            "scene_id": answer.scene_id,
            **place,
            "packing": pile.bed.packing,
            "stress": scene.forces.stress,
            "fraction": fraction,
            "shields": value,
            "shields_low": low,
            "shields_high": high,
            "smooth_bed": smooth,
            "shields_model_low": value * (1 - model.low),
            "shields_model_high": value * (1 + model.high),
            "model_share": model.dominant or None,
            "frozen_bed": model.frozen_bed,
            "reynolds": _reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * pile.model.lid_speed_ratio,
            **_speeds(scene, found.ustar0),
            **dict(zip(("first_x_m", "first_ustar0_m_s"), answer.first, strict=True)),
            **dict(zip(("pivot_x_m", "pivot_first_m_s"), answer.checked, strict=True)),
            "pivot_ustar0_m_s": pivot[ceil(fraction * motion.count - 1e-9) - 1],
            "count": motion.count,
            "highest_fraction": motion.fraction[-1],
            "share_carried_off": found.carried_off,
            "share_against_flow": found.against_the_flow,
            "row_hold": answer.row_hold,
            **_smoothing(answer),
            **_levels(answer.decision),
            "error_estimate": error,
            "case": pile.runs[-1].name if pile.runs else None,
        }


def _interval(
    scene: Scene, found: PileThreshold, error: float | None, smooth: float
) -> tuple[float, float]:
    """Ends of the interval of a Shields number; an end that is not known is NaN.

    It holds load steps and count, at least what is within the known error of the level, and how far
    the z0 of the flow is from that of a bed that is not rough (`smooth`). It is not known without
    a known error.
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
    """How far at most tau_c moves, relative, if the flow has the z0 of its bed at the threshold."""
    if scene.flow.model == "flat":
        return 0.0
    outer = float(outer_roughness(scene.bed.roughness, ustar0, scene.fluid.viscosity))
    return PER_E_FOLD * log(outer / scene.solve_roughness)


def _smoothing(answer: Answer) -> Row:
    """Columns of a noisy profile: the smoothing, and the first motion around it."""
    length = smoothing.length_of(answer.pile.scene)
    if not length:
        return {}
    assert answer.pile.bed.profile
    row = {
        "smoothing_needed_m": answer.pile.bed.profile.needs,
        "smoothing_compared_m": length,
    }
    for factor, column in SMOOTHED.items():
        row[column] = answer.smoothed.get(factor, np.nan)
    return row


def _levels(answer: Decision) -> Row:
    assert answer.levels
    return {
        "flow_level": answer.levels.flow.name,
        "grain_level": answer.levels.grains.name,
    }


def size_class(answer: Answer) -> Iterator[Row]:
    """The threshold of each size class of a mixture, where a fraction of its grains has moved.

    The stress at d50, over which those of the classes are, lies between the two classes beside it.
    """
    pile, scene, motion = answer.pile, answer.pile.scene, answer.motion
    if not pile.pouring:
        return
    classes = list(threshold.classes(pile.packing.sizes[pile.packing.windward]))
    sizes = np.array([each.size for each in classes])
    for fraction in scene.protocol.fractions:
        level = threshold.first_level(motion, fraction)
        found = [answer.at(fraction, each.chosen) for each in classes]
        median = threshold.at_size(1.0, sizes, np.array([at.tau for at in found]))
        for each, at in zip(classes, found, strict=True):
            count = int(each.chosen.sum())
            moved = (np.nan, np.nan, np.nan)
            if level is not None:
                of_class = int(motion.moved_by(level)[each.chosen].sum())
                moved = (of_class / count, *threshold.of_all(of_class, count))
            taus = np.array([at.tau, at.tau_low, at.tau_high])
            own = shields(scene, taus) / each.size
            hiding = taus / median / each.size
            yield {
                "scene_id": answer.scene_id,
                "fraction": fraction,
                "size_over_d": each.size,
                "count": count,
                "few": count < FEW,
                **{
                    f"class_moved{end}": part
                    for end, part in zip(ENDS, moved, strict=True)
                },
                "ustar0_m_s": at.ustar0,
                **{
                    f"shields_own{end}": value
                    for end, value in zip(ENDS, own, strict=True)
                },
                **{
                    f"hiding{end}": value
                    for end, value in zip(ENDS, hiding, strict=True)
                },
                "hiding_wilcock_crowe": float(
                    measured.wilcock_crowe_hiding(each.size) / each.size
                ),
                "hiding_egiazaroff": float(measured.egiazaroff_hiding(each.size)),
            }


def forms(answer: Answer) -> Iterator[Row]:
    """Of a train, a row for each form and each fraction of the counted grains of that form."""
    pile, bed = answer.pile, answer.pile.bed
    if bed.forms == 1 or bed.profile:
        return
    period = bed.spacing or (pile.model.line.x[-2] - pile.model.line.x[1]) / bed.forms
    x = pile.packing.centres[pile.packing.windward, 0] * pile.scene.grain.diameter
    form = np.clip(np.floor(x / period).astype(int), 0, bed.forms - 1)
    ustar0 = threshold.of_grains(answer.motion).value
    for fraction in pile.scene.protocol.fractions:
        first = np.nan
        for number in range(bed.forms):
            # a grain that has not moved is not a number, which sorts last
            grains, speed = (
                np.sort(ustar0[form == number]),
                answer.speed[form == number],
            )
            needed = max(ceil(fraction * len(grains) - 1e-9), 1)
            reached = float(grains[needed - 1]) if len(grains) else np.nan
            first = reached if number == 0 else first
            yield {
                "scene_id": answer.scene_id,
                "form": number + 1,
                "count": len(grains),
                "fraction": fraction,
                "mean_ustar_over_ustar0": float(speed.mean()) if len(speed) else np.nan,
                "ustar0_m_s": reached,
                # loose grains of the first form move in still fluid: nothing is a multiple of that
                "over_first_form": reached / first if first > 0 else np.nan,
            }


def bed_changes(answers: Sequence[Answer]) -> Iterator[Row]:
    """Columns of thresholds, by grain, of the piles answered on a changing and a frozen bed.

    The two are answered alike in all else, by one method on one mesh.
    """
    frozen = {each.pile.scene.id: each for each in answers}
    for answer in answers:
        scene, count = answer.pile.scene, answer.motion.count
        if not scene.protocol.update:
            continue
        twin = frozen.get(changed(scene, {"protocol.update": 0.0}).id)
        if twin is None:
            continue
        moved = np.arange(1, ceil(max(scene.protocol.fractions) * count - 1e-9) + 1)
        at = ([each.at(n / count) for n in moved.tolist()] for each in (answer, twin))
        (tau, ustar), (tau_frozen, ustar_frozen) = (
            np.array([(each.tau, each.ustar0) for each in steps]).T for steps in at
        )
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


def check(plan: Plan, cases: Path, done: Container[str]) -> Iterator[Row]:
    """The piles that DEM checks, where both answers are run: both at each fraction."""
    for asked, dem in plan.checks.items():
        pile = plan.piles[asked]
        if not (pile.is_run(done) and dem.is_run(done)):
            continue
        scene, fractions = pile.scene, pile.scene.protocol.fractions
        answers = pile.thresholds(cases, fractions)
        by_dem = dem.thresholds(cases, fractions)
        for ours, theirs in zip(answers, by_dem, strict=True):
            yield {
                "scene_id": asked,
                **point(scene),
                "packing": dem.bed.packing,
                "fraction": ours.fraction,
                **_levels(plan.decisions[asked]),
                "shields": shields(scene, ours.tau),
                "shields_dem": shields(scene, theirs.tau),
                "shields_dem_low": shields(scene, theirs.tau_low),
                "shields_dem_high": shields(scene, theirs.tau_high),
                "difference": ours.tau / theirs.tau - 1,
                "case": dem.case.name,
            }
