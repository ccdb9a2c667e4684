"""The tables of piles: the stress on them, their grains, their answer to the flow."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.fidelity import calibration, decision
from orchestrator.fidelity.decision import Decision
from orchestrator.fidelity.levels import Pair
from orchestrator.flow.channel import mean_speed
from orchestrator.flow.stress import undisturbed_ustar
from orchestrator.grains import classes, threshold
from orchestrator.grains.loaded_bed import Face
from orchestrator.grains.motion import MODES, Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.physics.measured import egiazaroff_hiding, wilcock_crowe_hiding
from orchestrator.study.scene import Scene
from orchestrator.tables.scenes import Row, point

Columns = Mapping[str, NDArray[Any]]
"""Columns of one length, by name."""


@dataclass(frozen=True)
class Answer:
    """The answer to a scene: a pile with what its finished cases say, read once for all tables."""

    decision: Decision
    pile: Pile
    motion: Motion
    face: Face
    row_hold: float

    @classmethod
    def read(cls, decision: Decision, pile: Pile, cases: Path) -> "Answer":
        """Read the motion of a pile and the stress on it."""
        return cls(decision, pile, pile.motion(cases), pile.face(cases), pile.row_hold(cases))

    @property
    def scene_id(self) -> str:
        """Id of the scene that was asked for."""
        return self.decision.asked.id


def wall_stress(piles: Iterable[Pile], cases: Path) -> Iterator[pd.DataFrame]:
    """The friction velocity along the bed, for the solved flow of each pile."""
    for pile in piles:
        stress = pile.stress(cases)
        yield pd.DataFrame(
            {
                "flow_case": pile.flow.name,
                "alpha_deg": pile.bed.slope_deg,
                "h_m": pile.bed.height,
                "z0_m": pile.flow.roughness_m,
                "s_m": stress.s_m,
                "s_over_h": stress.s_m / pile.bed.height,
                "x_m": stress.x_m,
                "z_m": stress.z_m,
                "ustar_over_ustar0_wall": stress.ustar_over_ustar0_wall,
                "ustar_over_ustar0_eq10": stress.ustar_over_ustar0_eq10,
                "ustar_over_ustar0_eq10_printed": stress.ustar_over_ustar0_eq10_printed,
            }
        )


def grains(answer: Answer) -> Columns:
    """The windward grains of a pile: the stress on each, when and how it moved."""
    motion, face = answer.motion, answer.face
    return {
        "scene_id": np.full(len(face.ids), answer.scene_id),
        "grain_id": face.ids,
        "s_m": face.arc_length,
        "x_m": face.x,
        "ustar_over_ustar0": face.speed,
        "moved_in_load_step": motion.level,
        "fallen_in_load_step": motion.fallen,
        "carried_off": motion.carried.astype(int),
        "mode": np.array(MODES)[motion.mode],
        "ustar0_m_s": threshold.of_grains(motion).value,
        **(_of_its_own(answer.pile) if answer.pile.pouring else {}),
    }


def _of_its_own(pile: Pile) -> Columns:
    """Columns that differ from grain to grain of a poured bed."""
    packed, chosen = pile.packing, pile.packing.windward
    found = {"size_over_d": packed.sizes[chosen], "pivot_deg": pile.pivot_angles_deg}
    if packed.width:
        found["y_m"] = packed.places.xyz[chosen, 1] * pile.scene.grain.diameter
    return found


def size_class_rows(answer: Answer) -> Iterator[Row]:
    """The threshold of each size class of a mixture, where a fraction of its grains has moved."""
    pile, scene = answer.pile, answer.pile.scene
    if not pile.pouring:
        return
    listed = list(classes.classes(pile.packing.sizes[pile.packing.windward]))
    for fraction in scene.protocol.fractions:
        found = {one.number: _of_class(answer, one, fraction) for one in listed}
        middle = found[0]["shields_own"] if 0 in found else np.nan
        whole = threshold.first_level(answer.motion, fraction)
        for one in listed:
            moved = answer.motion.moved_by(whole or 0)[one.chosen]
            yield {
                "scene_id": answer.scene_id,
                "fraction": fraction,
                "size_over_d": one.size,
                "count": int(one.chosen.sum()),
                "class_moved": moved.mean() if whole else np.nan,
                **found[one.number],
                # the grains of the middle class may lie loose: no ratio to a threshold of zero
                "hiding": found[one.number]["shields_own"] / middle if middle > 0 else np.nan,
                "hiding_wilcock_crowe": float(wilcock_crowe_hiding(one.size) / one.size),
                "hiding_egiazaroff": float(egiazaroff_hiding(one.size)),
            }


def _of_class(answer: Answer, one: classes.SizeClass, fraction: float) -> Row:
    scene, speed = answer.pile.scene, answer.face.speed[one.chosen]
    motion = classes.of(answer.motion, one.chosen)
    found = threshold.of_pile(motion, speed, fraction, scene.fluid.density)
    names = ("shields_own", "shields_own_low", "shields_own_high")
    stresses = (found.tau, found.tau_low, found.tau_high)
    return {
        "ustar0_m_s": found.ustar0,
        **{n: shields(scene, tau) / one.size for n, tau in zip(names, stresses, strict=True)},
    }


def curve(answer: Answer) -> Columns:
    """The fraction of a pile that had moved, and the stress on it, at each load step."""
    scene, motion = answer.pile.scene, answer.motion
    curve, steps = threshold.curve(motion, answer.face.speed, scene.fluid.density), len(motion.flow)
    return {
        "scene_id": np.full(steps, answer.scene_id),
        "load_step": np.arange(steps),
        "u_e_m_s": curve.ustar0 * _lid_speed_ratio(answer.pile),
        "ustar0_m_s": curve.ustar0,
        "count": np.full(steps, motion.count),
        "moved": motion.moved,
        "not_moved": motion.count - motion.moved,
        "carried_off": motion.carried_off,
        "fallen_upstream": motion.fallen_upstream,
        "fraction_moved": curve.fraction,
        "mean_tau_pa": curve.mean_tau,
        "shields": shields(scene, curve.mean_tau),
        "reynolds": _reynolds(scene, curve.mean_tau),
    }


def threshold_rows(answer: Answer) -> Iterator[Row]:
    """The threshold of a pile at each fraction that its scene asks for."""
    pile, motion, speed = answer.pile, answer.motion, answer.face.speed
    scene = pile.scene
    pivot, place = pile.pivot_thresholds(speed), point(scene)
    for fraction in scene.protocol.fractions:
        found = threshold.of_pile(motion, speed, fraction, scene.fluid.density)
        yield {
            "scene_id": answer.scene_id,
            **place,
            "packing": pile.bed.packing,
            "stress": scene.forces.stress,
            "fraction": fraction,
            "shields": shields(scene, found.tau),
            **_interval(scene, found, answer.decision.error_estimate),
            **_model_interval(answer.decision.asked, fraction, shields(scene, found.tau)),
            "frozen_bed": calibration.frozen_bed(answer.decision.asked, fraction),
            "reynolds": _reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * _lid_speed_ratio(pile),
            **_speeds(scene, found.ustar0),
            "pivot_ustar0_m_s": pivot[int(np.ceil(fraction * motion.count - 1e-9)) - 1],
            "count": motion.count,
            "highest_fraction": motion.fraction[-1],
            "share_carried_off": found.carried_off,
            "share_against_flow": found.against_the_flow,
            "row_hold": answer.row_hold,
            **_levels(answer.decision.levels),
            "error_estimate": answer.decision.error_estimate,
            "case": pile.runs[-1].name if pile.runs else None,
        }


def _levels(levels: Pair | None) -> Row:
    assert levels
    return {f"{part}_level": one.name for part, one in zip(("flow", "grain"), levels, strict=True)}


def _interval(scene: Scene, found: PileThreshold, error: float | None) -> Row:
    """The interval of load steps and count; at least the known error, as a factor both ways.

    It is empty where no error is known.
    """
    if error is None:
        return {"shields_low": np.nan, "shields_high": np.nan}
    return {
        "shields_low": shields(scene, min(found.tau_low, found.tau / (1 + error))),
        "shields_high": shields(scene, max(found.tau_high, found.tau * (1 + error))),
    }


def _model_interval(scene: Scene, fraction: float, shields: float) -> Row:
    """The interval of the choices that all levels share; never a part of the numerical one."""
    found = calibration.spread(scene, fraction)
    return {
        "shields_model_low": shields * (1 - found.low),
        "shields_model_high": shields * (1 + found.high),
        "model_share": found.dominant or None,
    }


def check_rows(
    decisions: Mapping[str, Decision],
    cheap: Mapping[str, Pile],
    check: Mapping[str, Pile],
    tolerance: float,
    cases: Path,
) -> Iterator[Row]:
    """The piles that DEM checked: both answers at each fraction."""
    for asked, pile in check.items():
        scene = cheap[asked].scene
        for one in decision.compare(cheap[asked], pile, tolerance, cases):
            yield {
                "scene_id": asked,
                **point(scene),
                "packing": pile.bed.packing,
                "fraction": one.cheap.fraction,
                **_levels(decisions[asked].levels),
                "shields": shields(scene, one.cheap.tau),
                "shields_dem": shields(scene, one.dem.tau),
                "shields_dem_low": shields(scene, one.dem.tau_low),
                "shields_dem_high": shields(scene, one.dem.tau_high),
                "difference": one.cheap.tau / one.dem.tau - 1,
                "agree": one.agree,
                "case": pile.case.name,
            }


def _speeds(scene: Scene, ustar0: float) -> Row:
    """Speeds that a field user measures: at 1 m, or the mean of a channel, with the discharge."""
    z0, flow = scene.bed.roughness, scene.flow
    if flow.depth is None:
        return {"u_1m_m_s": ustar0 / undisturbed_ustar(1.0, 1.0, z0)}
    mean = mean_speed(ustar0, flow.depth, z0, closed=flow.top == "closed channel")
    return {"mean_speed_m_s": mean, "discharge_m2_s": mean * flow.depth}


def _lid_speed_ratio(pile: Pile) -> float:
    return pile.model.lid_speed_ratio


def shields(scene: Scene, tau: Any) -> Any:
    """The Shields number of a stress, Pa."""
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def _reynolds(scene: Scene, tau: Any) -> Any:
    ustar = np.sqrt(tau / scene.fluid.density)
    return ustar * scene.grain.diameter / scene.fluid.viscosity
