"""Measure the flow cases and linear theory beside them; prints the tables of flow.md.

``python docs/measure_flow.py DIRECTORY`` keeps its cases there; a second call runs none again.
"""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from orchestrator.bed.line import BedLine, triangle
from orchestrator.flow import theory
from orchestrator.flow.case import FlowCase
from orchestrator.flow.foam import SolvedFlow
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import Measure, WallStress, bubble
from orchestrator.runs import case, engine
from orchestrator.study.method import FlowMethod
from orchestrator.study.scene import default_first_cell_height
from orchestrator.types import FloatArray

HEIGHT = 0.02
ROUGHNESS = (3.3e-6, 3.333e-5, 1e-4)
SLOPES = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0)
GRAIN = 1e-3
LEVELS: dict[str, dict[str, object]] = {
    "80 cells a face": {"cells_per_face": 80},
    "40, the standard": {},
    "expansion ratio 1.15": {"expansion_ratio": 1.15},
    "expansion ratio 1.2": {"expansion_ratio": 1.2},
    "expansion ratio 1.4": {"expansion_ratio": 1.4},
    "20 cells a face": {"cells_per_face": 20},
}
SIMILAR = ((15.0, 3.333e-5), (30.0, 3.333e-5), (15.0, 3.3e-6), (30.0, 1e-4))
WAVES_DEG = (5.0, 10.0, 15.0, 20.0)
WAVE_RATIOS = (1e3, 1e4, 1e5)
MODELS: tuple[dict[str, object], ...] = (
    {},
    {"turbulence_model": "RNGkEpsilon"},
    {"turbulence_model": "realizableKE"},
    {"turbulence_model": "kOmegaSST"},
    {"convection_scheme": "upwind"},
    {"non_orthogonal_correctors": 0},
)


def flow(slope: float, roughness: float) -> FlowCase:
    """The standard case of a slope and a roughness."""
    first = default_first_cell_height(HEIGHT, roughness)
    settings = FlowMethod(roughness=roughness, viscosity=1e-5, first_cell_height=first)
    return FlowCase(HEIGHT, slope, settings)


def other(one: FlowCase, **settings: object) -> FlowCase:
    """A case with other settings."""
    return replace(one, settings=one.settings.model_copy(update=settings))


def solved(one: FlowCase, cases: Path) -> WallStress:
    """The stress of a case, which is run after those that it starts from."""
    if not case.done_state(one, cases):
        for coarser in one.needs:
            solved(coarser, cases)
        engine.execute(one, cases, 3600.0)
    return WallStress.from_csv(cases / one.name / WALL_STRESS)


def windward_mean(
    one: FlowCase, stress: WallStress, measure: Measure = "wall"
) -> float:
    """Mean friction velocity of the windward face over the undisturbed one."""
    face = one.height_m / np.sin(np.radians(one.slope_deg))
    on = (stress.s_m > 0) & (stress.s_m < face)
    ustar = getattr(stress, f"ustar_over_ustar0_{measure}")
    return float(np.average(ustar[on], weights=stress.length_m[on]))


def change(new: float, old: float) -> str:
    """Relative change in per cent."""
    return f"{100 * (new / old - 1):+.2f} %"


def meshes(cases: Path) -> None:
    """Windward mean, its change on a finer mesh and with a lower first cell."""
    print(
        "\n| slope | z0, m | u*/u*_0 | mesh twice as fine | first cell halved: wall | Eq. 10 |"
    )
    print("|---|---|---|---|---|---|")
    for slope in SLOPES:
        for roughness in ROUGHNESS:
            one = flow(slope, roughness)
            fine = other(one, cells_per_face=2 * one.settings.cells_per_face)
            low = other(one, first_cell_height=one.first_cell_m / 2)
            mean, eq10 = (
                windward_mean(one, solved(one, cases), m) for m in ("wall", "eq10")
            )
            cells = [
                change(windward_mean(fine, solved(fine, cases)), mean),
                change(windward_mean(low, solved(low, cases)), mean),
                change(windward_mean(low, solved(low, cases), "eq10"), eq10),
            ]
            print(
                f"| {slope:g} | {roughness:g} | {mean:.3f} | {' | '.join(cells)} |",
                flush=True,
            )


def similarity(cases: Path) -> None:
    """Change of u*/u*_0 with the speed at the lid."""
    print("\n| slope | z0, m | U_e, m/s | windward mean | largest change on the face |")
    print("|---|---|---|---|---|")
    for slope, roughness in SIMILAR:
        one = flow(slope, roughness)
        stress = solved(one, cases)
        face = HEIGHT / np.sin(np.radians(slope))
        on = (stress.s_m > 0) & (stress.s_m < face)
        for speed in (5.0, 20.0):
            other_case = other(one, speed=speed)
            faster = solved(other_case, cases)
            ratio = (
                faster.ustar_over_ustar0_wall[on] / stress.ustar_over_ustar0_wall[on]
            )
            mean = change(windward_mean(other_case, faster), windward_mean(one, stress))
            most = f"{100 * np.abs(ratio - 1).max():.2f} %"
            print(
                f"| {slope:g} | {roughness:g} | {speed:g} | {mean} | {most} |",
                flush=True,
            )


def levels(cases: Path) -> None:
    """Cost of coarser and finer meshes, and what they do to u*^2 on grains of 1 mm."""
    print(
        "\n| mesh | slope | z0, m | cells | iterations | solver, core s | mean | worst grain |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, change_of in LEVELS.items():
        for slope in (15.0, 30.0):
            for roughness in ROUGHNESS:
                standard = flow(slope, roughness)
                one = other(standard, **change_of)
                new, old = (
                    on_grains(each, solved(each, cases)) for each in (one, standard)
                )
                worst = f"{100 * np.abs(new / old - 1).max():.1f} %"
                cost = " | ".join(spent(cases / one.name))
                mean = change(new.mean(), old.mean())
                print(
                    f"| {name} | {slope:g} | {roughness:g} | {cost} | {mean} | {worst} |"
                )


def on_grains(one: FlowCase, stress: WallStress) -> FloatArray:
    """Stress on touching grains of 1 mm along the windward face."""
    face = one.height_m / np.sin(np.radians(one.slope_deg))
    return stress.mean_over(np.arange(GRAIN / 2, face, GRAIN), GRAIN)


def spent(directory: Path) -> tuple[str, str, str]:
    """Cells, iterations and processor time of a case."""
    flow = SolvedFlow(directory)
    log = (directory / "log.simpleFoam").read_text()
    return (
        str(len(flow.mesh.middles)),
        flow.last_iteration.name,
        re.findall(r"ExecutionTime = (\S+)", log)[-1],
    )


def models(cases: Path) -> None:
    """What turbulence models and schemes give."""
    print(
        "\n| changed | 15 deg | 30 deg | separated, 15 and 30 deg, h |\n|---|---|---|---|"
    )
    for changed in MODELS:
        piles = [other(flow(slope, 3.333e-5), **changed) for slope in (15.0, 30.0)]
        means = " | ".join(
            f"{windward_mean(one, solved(one, cases)):.3f}" for one in piles
        )
        bubbles = (bubble(solved(one, cases), HEIGHT) for one in piles)
        name = (
            ", ".join(f"{key} = {value}" for key, value in changed.items()) or "nothing"
        )
        print(
            f"| {name} | {means} | {', '.join(f'{b[1] if b else 0:.1f}' for b in bubbles)} |"
        )


def linear_theory(cases: Path) -> None:
    """Linear theory against the solved flow: errors of u* in per cent."""
    at = np.array([0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98])
    print(
        "\n| slope | z0, m | solved | mean |",
        " | ".join(f"at {part:g}" for part in at),
        "|",
    )
    print("|---" * (4 + len(at)) + "|")
    for slope in SLOPES:
        for roughness in ROUGHNESS:
            one = flow(slope, roughness)
            stress = solved(one, cases)
            mean = windward_mean(one, stress)
            places = at * HEIGHT / np.sin(np.radians(slope))
            theirs = np.sqrt(stress.mean_over(places, HEIGHT / 40))
            found = theory.waves(triangle(slope, HEIGHT), roughness)
            ratios = np.sqrt(found.mean_over(places, HEIGHT / 40)) / theirs
            whole = windward_mean(one, found) / mean
            cells = (f"{100 * ratio - 100:+.0f}" for ratio in (whole, *ratios))
            print(
                f"| {slope:g} | {roughness:g} | {mean:.3f} | {' | '.join(cells)} |",
                flush=True,
            )


def waves(cases: Path) -> None:
    """A and B of waves of a cosine, solved and by linear theory: from the middle one of three."""
    print("\n| slope | lambda/z0 | solved: A | B | waves: A | B |\n" + "|---" * 6 + "|")
    for slope in WAVES_DEG:
        for ratio in WAVE_RATIOS:
            one = wavy(slope, 1 / ratio)
            assert one.line
            found = (solved(one, cases), theory.waves(one.line, 1 / ratio))
            numbers = (
                f"{a:.2f} | {b:.2f}" for a, b in (phases(one, each) for each in found)
            )
            print(f"| {slope:g} | {ratio:g} | {' | '.join(numbers)} |", flush=True)


def wavy(slope: float, roughness: float) -> FlowCase:
    """Flow over three waves of 1 m, by their steepest slope."""
    height = np.tan(np.radians(slope)) / np.pi
    x = np.linspace(0, 3, 241)
    z = height / 2 * (1 - np.cos(2 * np.pi * x))
    line = BedLine((-10.0, *x.tolist(), 13.0), (0.0, *z.tolist(), 0.0), height)
    first = max(1 / 2000, 2.5 * roughness)
    settings = FlowMethod(roughness=roughness, viscosity=1e-5, first_cell_height=first)
    domain = {"lid": 5 / height, "upstream": 3 / height, "downstream": 3 / height}
    return FlowCase(height, slope, settings.model_copy(update=domain), line=line)


def phases(one: FlowCase, stress: WallStress) -> tuple[float, float]:
    """A and B of the middle wave."""
    edges = np.linspace(1, 2, 81)
    assert one.line
    s = np.interp(edges, one.line.x, one.line.arc_lengths)
    tau = stress.mean_over((s[1:] + s[:-1]) / 2, np.diff(s))
    phase = 2 * np.pi * (edges[1:] + edges[:-1]) / 2 - np.pi
    steepness = np.pi * one.height_m
    a, b = (
        2 * np.mean(tau * wave) / steepness for wave in (np.cos(phase), -np.sin(phase))
    )
    return float(a), float(b)


def main(directory: Path) -> None:
    """Print all tables."""
    cases = directory.absolute()
    cases.mkdir(parents=True, exist_ok=True)
    for measure in (similarity, levels, models, linear_theory, waves, meshes):
        measure(cases)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
