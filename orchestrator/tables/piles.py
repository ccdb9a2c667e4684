"""The tables of piles: the stress on them, their grains, their answer to the flow."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.fidelity import decision, levels, limits
from orchestrator.fidelity.decision import Decision
from orchestrator.fidelity.levels import changed
from orchestrator.grains import threshold
from orchestrator.grains.motion import MODES, Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics.measured import egiazaroff_hiding, wilcock_crowe_hiding
from orchestrator.physics.velocity import depth_mean_speed, log_law_speed
from orchestrator.plan import Plan
from orchestrator.study.scene import Scene
from orchestrator.tables.scenes import point
from orchestrator.types import BoolArray, FloatArray, Row


@dataclass(frozen=True)
class Answer:
    """The answer to a scene: a pile with what its finished cases say, read once for all tables."""

    decision: Decision
    pile: Pile
    motion: Motion
    speed: FloatArray
    row_hold: float

    @classmethod
    def read(cls, decision: Decision, pile: Pile, cases: Path) -> "Answer":
        """Read the motion of a pile and the stress on it."""
        hold = pile.loads(cases).row_hold()
        return cls(decision, pile, pile.motion(cases), pile.speed(cases), hold)

    @property
    def scene_id(self) -> str:
        """Id of the scene that was asked for."""
        return self.decision.asked.id

    def at(self, fraction: float, chosen: BoolArray | slice = slice(None)) -> PileThreshold:
        """The threshold of the pile, or of some of its counted grains, at a fraction."""
        motion = self.motion if isinstance(chosen, slice) else self.motion.of(chosen)
        density = self.pile.scene.fluid.density
        return threshold.of_pile(motion, self.speed[chosen], fraction, density)


def shields(scene: Scene, tau: Any) -> Any:
    """The Shields number of a stress, Pa."""
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def _reynolds(scene: Scene, tau: Any) -> Any:
    return np.sqrt(tau / scene.fluid.density) * scene.grain.diameter / scene.fluid.viscosity


def grains(answer: Answer) -> Row:
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


def curve(answer: Answer) -> Row:
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


def threshold_rows(answer: Answer) -> Iterator[Row]:
    """The threshold of a pile at each fraction that its scene asks for.

    The interval holds load steps and count, and at least the known error as a factor both ways; it
    is empty where no error is known. The model's interval is of the choices that all levels share.
    """
    pile, motion, asked = answer.pile, answer.motion, answer.decision.asked
    scene, error = pile.scene, answer.decision.error_estimate
    z0, depth, place = scene.bed.roughness, scene.flow.depth, point(scene)
    pivot = pile.pivot_thresholds(answer.speed)
    for fraction in scene.protocol.fractions:
        found, model = answer.at(fraction), levels.spread(asked, fraction)
        value, factor = shields(scene, found.tau), np.nan if error is None else 1 + error
        row = {
            "scene_id": answer.scene_id,
            **place,
            "packing": pile.bed.packing,
            "stress": scene.forces.stress,
            "fraction": fraction,
            "shields": value,
            "shields_low": np.minimum(shields(scene, found.tau_low), value / factor),
            "shields_high": np.maximum(shields(scene, found.tau_high), value * factor),
            "shields_model_low": value * (1 - model.low),
            "shields_model_high": value * (1 + model.high),
            "model_share": model.dominant or None,
            "frozen_bed": model.frozen_bed,
            "reynolds": _reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * pile.model.lid_speed_ratio,
        }
        # a field user measures the wind at 1 m, or the mean speed of a channel
        if depth is None:
            row["u_1m_m_s"] = float(log_law_speed(found.ustar0, 1.0, z0))
        else:
            closed = scene.flow.top == "closed channel"
            mean = float(depth_mean_speed(found.ustar0, depth, z0, closed=closed))
            row |= {"mean_speed_m_s": mean, "discharge_m2_s": mean * depth}
        yield row | {
            "pivot_ustar0_m_s": pivot[ceil(fraction * motion.count - 1e-9) - 1],
            "count": motion.count,
            "highest_fraction": motion.fraction[-1],
            "share_carried_off": found.carried_off,
            "share_against_flow": found.against_the_flow,
            "row_hold": answer.row_hold,
            **_levels(answer.decision),
            "error_estimate": error,
            "case": pile.runs[-1].name if pile.runs else None,
        }


def _levels(answer: Decision) -> Row:
    assert answer.levels
    return {"flow_level": answer.levels.flow.name, "grain_level": answer.levels.grains.name}


def size_class_rows(answer: Answer) -> Iterator[Row]:
    """The threshold of each size class of a mixture, where a fraction of its grains has moved."""
    pile, scene, motion = answer.pile, answer.pile.scene, answer.motion
    if not pile.pouring:
        return
    classes = list(threshold.classes(pile.packing.sizes[pile.packing.windward]))
    for fraction in scene.protocol.fractions:
        rows = {}
        for number, size, chosen in classes:
            found = answer.at(fraction, chosen)
            level = threshold.first_level(motion, fraction)
            taus = np.array([found.tau, found.tau_low, found.tau_high])
            value, low, high = shields(scene, taus) / size
            rows[number] = {
                "scene_id": answer.scene_id,
                "fraction": fraction,
                "size_over_d": size,
                "count": int(chosen.sum()),
                "class_moved": motion.moved_by(level)[chosen].mean() if level else np.nan,
                "ustar0_m_s": found.ustar0,
                "shields_own": value,
                "shields_own_low": low,
                "shields_own_high": high,
                "hiding": np.nan,
                "hiding_wilcock_crowe": float(wilcock_crowe_hiding(size) / size),
                "hiding_egiazaroff": float(egiazaroff_hiding(size)),
            }
        middle = rows[0]["shields_own"] if 0 in rows else np.nan
        for row in rows.values():
            # the grains of the middle class may lie loose: no ratio to a threshold of zero
            yield row | {"hiding": row["shields_own"] / middle if middle > 0 else np.nan}


def forms(answer: Answer) -> Iterator[Row]:
    """Of a train, a row for each form and each fraction of the counted grains of that form."""
    pile, bed = answer.pile, answer.pile.bed
    if bed.forms == 1 or bed.profile:
        return
    period = bed.spacing or (pile.model.line.x[-2] - pile.model.line.x[1]) / bed.forms
    x = pile.packing.centres[pile.packing.windward, 0] * pile.scene.grain.diameter
    form = np.clip(np.floor(x / period).astype(int), 0, bed.forms - 1)
    ustar0 = np.nan_to_num(threshold.of_grains(answer.motion).value, nan=np.inf)
    for fraction in pile.scene.protocol.fractions:
        first = np.nan
        for number in range(bed.forms):
            grains, speed = np.sort(ustar0[form == number]), answer.speed[form == number]
            needed = max(ceil(fraction * len(grains) - 1e-9), 1)
            reached = float(grains[needed - 1]) if len(grains) else np.nan
            first = reached if number == 0 else first
            # loose grains of the first form move in still fluid: nothing is a multiple of that
            ratio = reached / first if first > 0 else np.nan
            yield {
                "scene_id": answer.scene_id,
                "form": number + 1,
                "count": len(grains),
                "fraction": fraction,
                "mean_ustar_over_ustar0": float(speed.mean()) if len(speed) else np.nan,
                "ustar0_m_s": reached if np.isfinite(reached) else np.nan,
                "over_first_form": ratio if np.isfinite(ratio) else np.nan,
            }


def bed_changes(answers: Sequence[Answer]) -> Iterator[Row]:
    """Columns of thresholds on beds that change beside those on the frozen beds, by grain.

    For each pile that the study asks for on both, up to its last fraction.
    """
    frozen = {one.scene_id: one for one in answers if not one.pile.scene.protocol.update}
    for answer in answers:
        scene, count = answer.pile.scene, answer.motion.count
        twin = frozen.get(changed(answer.decision.asked, {"protocol.update": 0.0}).id)
        if not scene.protocol.update or twin is None:
            continue
        moved = np.arange(1, ceil(max(scene.protocol.fractions) * count - 1e-9) + 1)
        pairs = [(answer.at(n / count), twin.at(n / count)) for n in moved.tolist()]
        tau, tau_frozen = np.array([[one.tau for one in pair] for pair in pairs]).T
        ustar0, ustar0_frozen = np.array([[one.ustar0 for one in pair] for pair in pairs]).T
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
            "change_ustar0": ustar0 / ustar0_frozen - 1,
            "holds_until": beyond[0] if len(beyond) else np.nan,
        }


def check_rows(plan: Plan, tolerance: float, cases: Path, done: Container[str]) -> Iterator[Row]:
    """The piles that DEM checked in a study with a tolerance: both answers at each fraction."""
    compared = decision.compare(plan.piles, plan.checks, tolerance, cases, done)
    for asked, cheap, dem, agree in compared:
        scene, pile = plan.piles[asked].scene, plan.checks[asked]
        yield {
            "scene_id": asked,
            **point(scene),
            "packing": pile.bed.packing,
            "fraction": cheap.fraction,
            **_levels(plan.decisions[asked]),
            "shields": shields(scene, cheap.tau),
            "shields_dem": shields(scene, dem.tau),
            "shields_dem_low": shields(scene, dem.tau_low),
            "shields_dem_high": shields(scene, dem.tau_high),
            "difference": cheap.tau / dem.tau - 1,
            "agree": agree,
            "case": pile.case.name,
        }
