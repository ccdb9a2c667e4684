"""Measure the flow cases: flat bed, mesh, first cell, similarity; prints the tables of flow.md.

``python docs/measure_flow.py DIRECTORY`` keeps its cases there; a second call runs none again.
"""

import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np

from orchestrator import case, engine
from orchestrator.flow.case import WALL_STRESS, FlowCase
from orchestrator.flow.stress import Measure, WallStress
from orchestrator.scene import default_first_cell_height

HEIGHT = 0.02
ROUGHNESS = (3.3e-6, 3.333e-5, 1e-4)
SLOPES = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0)


def flow(slope: float, roughness: float) -> FlowCase:
    """The standard case of a slope and a roughness."""
    first = default_first_cell_height(HEIGHT, roughness)
    return FlowCase(slope, HEIGHT, roughness, 10.0, 1e-5, first)


def solved(one: FlowCase, cases: Path) -> WallStress:
    """The stress of a case, run if it has not been."""
    if not case.is_done(one, cases):
        engine.execute(one, cases, 600.0, threading.Event())
    return WallStress.from_csv(cases / one.name / WALL_STRESS)


def windward_mean(one: FlowCase, stress: WallStress, measure: Measure = "wall") -> float:
    """Mean friction velocity of the windward face over the undisturbed one."""
    face = one.height_m / np.sin(np.radians(one.slope_deg))
    on = (stress.s_m > 0) & (stress.s_m < face)
    ustar = getattr(stress, f"ustar_over_ustar0_{measure}")
    return float(np.average(ustar[on], weights=stress.length_m[on]))


def change(new: float, old: float) -> str:
    """Relative change in per cent."""
    return f"{100 * (new / old - 1):+.2f} %"


def flat_bed(cases: Path) -> None:
    """Friction velocity of a flat bed against the approaching flow's and the local log law."""
    print("\n| z0, m | first cell, m | over u*_0 | over the log law at the first cell |")
    print("|---|---|---|---|")
    for roughness in (3.3e-6, 1e-5, 2.333e-5, 3.333e-5, 5e-5, 1e-4):
        one = flow(0.0, roughness)
        stress = solved(one, cases)
        on = np.abs(stress.s_m) < 5 * HEIGHT
        ustar = stress.ustar_over_ustar0_wall[on]
        local = float(np.mean(ustar / stress.ustar_over_ustar0_eq10[on]))
        print(f"| {roughness:g} | {one.first_cell_m:.3g} | {ustar.mean():.4f} | {local:.4f} |")


def meshes(cases: Path) -> None:
    """Windward mean, its change on a finer mesh and with a lower first cell."""
    print("\n| slope | z0, m | u*/u*_0 | mesh twice as fine | first cell halved: wall | Eq. 10 |")
    print("|---|---|---|---|---|---|")
    for slope in SLOPES:
        for roughness in ROUGHNESS:
            one = flow(slope, roughness)
            fine = replace(one, cells_per_face=2 * one.cells_per_face)
            low = replace(one, first_cell_m=one.first_cell_m / 2)
            mean, eq10 = (windward_mean(one, solved(one, cases), m) for m in ("wall", "eq10"))
            cells = [
                change(windward_mean(fine, solved(fine, cases)), mean),
                change(windward_mean(low, solved(low, cases)), mean),
                change(windward_mean(low, solved(low, cases), "eq10"), eq10),
            ]
            print(f"| {slope:g} | {roughness:g} | {mean:.3f} | {' | '.join(cells)} |", flush=True)


def similarity(cases: Path) -> None:
    """Change of u*/u*_0 with the speed at the lid."""
    print("\n| slope | z0, m | U_e, m/s | windward mean | largest change on the face |")
    print("|---|---|---|---|---|")
    for slope, roughness in ((15.0, 3.333e-5), (30.0, 3.333e-5), (15.0, 3.3e-6), (30.0, 1e-4)):
        one = flow(slope, roughness)
        stress = solved(one, cases)
        face = HEIGHT / np.sin(np.radians(slope))
        on = (stress.s_m > 0) & (stress.s_m < face)
        for speed in (5.0, 20.0):
            other_case = replace(one, speed_m_s=speed)
            other = solved(other_case, cases)
            ratio = other.ustar_over_ustar0_wall[on] / stress.ustar_over_ustar0_wall[on]
            mean = change(windward_mean(other_case, other), windward_mean(one, stress))
            most = f"{100 * np.abs(ratio - 1).max():.2f} %"
            print(f"| {slope:g} | {roughness:g} | {speed:g} | {mean} | {most} |", flush=True)


if __name__ == "__main__":
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    for measure in (flat_bed, similarity, meshes):
        measure(folder)
