"""The drawings of docs/how-it-works.md.

python tools/drawings.py [DIRECTORY]

Flow, stress and load steps are those of the preset `first-look`, which is run in the directory, by
default results/first-look; the ways of spheres are over a bed that is poured there, the other drawings
are geometry. They are written to docs/figures.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Arc, Circle

import orchestrator
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.report import style

sys.path.insert(0, str(Path(__file__).parent))
import rolling  # a tool beside this one

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
ANSWER = "#c24e00"
FLOW = "#0072b2"
SAND = "#dccfae"
GREY = "0.35"
HEIGHT = 0.02  # of the pile of first-look, m
AIR = {"fluid_density": 1.225, "viscosity": 1.48e-5}
WATER = {"fluid_density": 999.1, "viscosity": 1.14e-6}
FLUIDS = {"water": WATER, "air": AIR}
THETA = 0.03
SPHERES = 200
FOOT = HEIGHT / np.tan(np.radians(15))  # its half width, m


def drawing(height: float, panels: int = 1) -> tuple[Canvas, list[Axes]]:
    """An empty drawing with panels beside each other."""
    canvas = style.canvas(height)
    axes = canvas.subplots(1, panels, squeeze=False)
    return canvas, list(axes[0])


def bare(axes: Axes) -> None:
    """Take away frame and ticks, and give both axes one scale."""
    axes.set_aspect("equal")
    axes.axis("off")


def arrow(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    colour: str,
    text: str = "",
    beside: tuple[float, float] = (0.0, 0.0),
) -> None:
    """An arrow with its label at the head, moved by `beside`."""
    look = {"arrowstyle": "-|>", "color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=look)
    place = (end[0] + beside[0], end[1] + beside[1])
    axes.text(*place, text, color=colour, ha="center", va="center")


def grain(axes: Axes, x: float, z: float, *, colour: str = SAND) -> None:
    """A grain of diameter 1 with its centre."""
    axes.add_patch(Circle((x, z), 0.5, facecolor=colour, edgecolor="0.3", lw=0.8))
    axes.plot([x], [z], ".", color="0.3", ms=2)


def along(canvas: Canvas, axes: Axes, wall: pd.DataFrame) -> None:
    """The pile of first-look in heights, with what stands over it."""
    x = [-3.0, 0.0, FOOT / HEIGHT, 2 * FOOT / HEIGHT, 13.0]
    axes.fill_between(x, [0, 0, 1, 0, 0], -0.25, color=SAND, lw=0)
    axes.plot(x, [0, 0, 1, 0, 0], color="0.2", lw=0.8)
    axes.set(xlim=(-3, 13), ylim=(-0.25, 3.2), xlabel="x/h", ylabel="z/h")


def flow(wall: pd.DataFrame) -> Canvas:
    """The flow over the bed: a logarithmic profile upwind, and where the flow runs back."""
    canvas, (axes,) = drawing(2.3)
    along(canvas, axes, wall)
    z = np.linspace(0, 2.8, 8)[1:]
    speed = np.log1p(z * HEIGHT / (1e-3 / 30)) / np.log1p(3 * HEIGHT / (1e-3 / 30))
    for height, reach in zip(z, 1.8 * speed, strict=True):
        arrow(axes, (-2.8, height), (-2.8 + reach, height), FLOW)
    profile = np.linspace(0, 3, 100)
    curve = np.log1p(profile * HEIGHT / (1e-3 / 30))
    axes.plot(-2.8 + 1.8 * curve / curve[-1], profile, color=FLOW, lw=0.8)
    axes.plot([-2.8, -2.8], [0, 3], color=FLOW, lw=0.8)
    axes.text(
        -0.75,
        1.9,
        "wind or current far upwind:\na logarithmic profile,\nfriction velocity u*₀",
        color=FLOW,
        va="center",
    )
    axes.annotate(
        "the flow is fastest\nclose to the top",
        (3.73, 1.06),
        (4.6, 2.4),
        color=ANSWER,
        arrowprops={"arrowstyle": "-", "color": ANSWER},
    )
    x = wall["x_m"] / HEIGHT
    back = wall[(wall["ustar_over_ustar0_wall"] < 0) & (x > 3.7)]
    first, last = back["x_m"].min() / HEIGHT, back["x_m"].max() / HEIGHT
    axes.plot([first, last], [-0.12, -0.12], color=FLOW, lw=3, solid_capstyle="butt")
    arrow(axes, (8.2, 0.22), (7.2, 0.22), FLOW)
    axes.text(8.5, 0.6, "behind the crest\nthe flow runs back", color=FLOW)
    return canvas


def stress(wall: pd.DataFrame) -> Canvas:
    """The friction velocity along the bed over that far upwind."""
    canvas, (axes,) = drawing(2.3)
    x = wall["x_m"] / HEIGHT
    shown = (x > -3) & (x < 13)
    axes.plot(x[shown], wall["ustar_over_ustar0_wall"][shown], color=ANSWER)
    axes.axhline(1, color=GREY, lw=0.6, ls=":")
    axes.axhline(0, color=GREY, lw=0.6)
    for place, word in (
        (0, "foot"),
        (FOOT / HEIGHT, "top"),
        (2 * FOOT / HEIGHT, "foot"),
    ):
        axes.axvline(place, color="0.8", lw=0.8, zorder=0)
        axes.text(place, 2.32, word, ha="center", color=GREY)
    axes.text(9.0, 1.08, "level ground far upwind", color=GREY)
    axes.set(xlabel="x/h", ylabel="u*/u*₀", xlim=(-3, 13), ylim=(-0.9, 2.25))
    return canvas


def forces() -> Canvas:
    """The forces on a grain in its pocket on a slope."""
    canvas, (axes,) = drawing(2.6)
    slope = np.radians(15.0)
    turn = np.array([[np.cos(slope), -np.sin(slope)], [np.sin(slope), np.cos(slope)]])
    spots = [turn @ (place, 0.0) for place in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    for spot in spots:
        grain(axes, *spot)
    top = turn @ (0.5, np.sin(np.radians(60)))
    grain(axes, *top, colour="#f3c9a8")
    pivot = (top + spots[3]) / 2
    axes.plot(*pivot, "o", color=ANSWER, ms=5, zorder=5)
    axes.annotate(
        "pivot: the contact\nit rolls over",
        pivot,
        (2.1, -0.25),
        color=ANSWER,
        arrowprops={"arrowstyle": "-", "color": ANSWER},
        va="center",
    )
    drag = top + turn @ (1.25, 0.0)
    lift = top + turn @ (0.0, 1.1)
    arrow(axes, tuple(top), tuple(drag), FLOW, "drag $F_D$", (0.45, 0.08))
    arrow(axes, tuple(top), tuple(lift), FLOW, "lift $F_L$", (-0.1, 0.16))
    arrow(
        axes,
        tuple(top),
        (top[0], top[1] - 1.35),
        "0.15",
        "weight in\nthe fluid $W$",
        (0.0, -0.3),
    )
    base = turn @ (-2.6, -0.5)
    axes.plot([base[0], base[0] + 1.9], [base[1], base[1]], color=GREY, lw=0.7)
    axes.plot([base[0], base[0] + 1.84], [base[1], base[1] + 0.493], color=GREY, lw=0.7)
    axes.add_patch(Arc(tuple(base), 2.6, 2.6, theta1=0, theta2=15, color=GREY))
    axes.text(base[0] + 1.55, base[1] + 0.19, "slope α", color=GREY)
    arrow(axes, (-2.4, 1.5), (-1.2, 1.5), FLOW, "flow", (0.35, 0.0))
    axes.set(xlim=(-3.2, 3.6), ylim=(-1.7, 2.3))
    bare(axes)
    return canvas


def pocket() -> Canvas:
    """Pockets of three depths: the deeper, the larger the angle over which a grain rolls."""
    canvas, panels = drawing(1.9, 3)
    for axes, beta in zip(panels, (45.0, 55.0, 60.0), strict=True):
        half = np.cos(np.radians(beta))
        rise = np.sin(np.radians(beta))
        for place in (-half, half):
            grain(axes, place, 0.0)
        grain(axes, 0.0, rise, colour="#f3c9a8")
        axes.plot([half, 0.0], [0.0, rise], color=ANSWER, lw=1.2)
        axes.plot([half, half - 0.9], [0.0, 0.0], color=GREY, lw=0.6)
        arc = Arc((half, 0.0), 0.8, 0.8, theta1=180 - beta, theta2=180, color=ANSWER)
        axes.add_patch(arc)
        angle = np.radians(np.linspace(180 - beta, 60, 60))
        axes.plot(half + np.cos(angle), np.sin(angle), color=FLOW, lw=1.0, ls="--")
        axes.set_title(f"entrainment angle β = {beta:g}°", color="0.2")
        axes.set(xlim=(-1.4, 1.8), ylim=(-0.6, 1.6))
        bare(axes)
    return canvas


def hops(beds: Path) -> Canvas:
    """How far spheres come in a gust and in the mean flow after it: in water, and in air."""
    canvas, panels = drawing(2.1, 2)
    over = rolling.beds(beds, (1,))
    for axes, (name, fluid) in zip(panels, FLUIDS.items(), strict=True):
        grain = Grain(diameter=[2.5e-4], density=2650.0, **fluid)
        sphere = rolling.Sphere(float(grain.galileo[0]), float(grain.density_ratio[0]))
        in_gust, after = rolling.ways(sphere, over, (PEAK * THETA, THETA), SPHERES)
        way = np.sort(in_gust + after)
        share = 1 - np.arange(SPHERES) / SPHERES
        axes.step([0, *way], [1, *share], where="pre", color=ANSWER)
        axes.axvline(sphere.first, color=GREY, lw=0.8, ls=":")
        axes.set_title(f"quartz of 0.25 mm in {name}, θ = {THETA:g}", loc="left")
        axes.set(xlabel="way along the bed, d", ylabel="share that came so far")
        axes.set(xlim=(0, 2 * sphere.first), ylim=(0, 1.05))
    return canvas


def steps(curve: pd.DataFrame, thresholds: pd.DataFrame) -> Canvas:
    """Load steps, and the share of the grains that had moved when each had come to rest."""
    canvas, (axes,) = drawing(2.3)
    ustar = curve["ustar0_m_s"].to_numpy()
    moved = 100 * curve["fraction_moved"].to_numpy()
    axes.step(ustar, moved, where="post", color=FLOW, lw=1.0)
    axes.plot(ustar, moved, ".", color=FLOW, ms=4)
    for row in thresholds.itertuples():
        share = 100 * float(str(row.fraction))
        at = float(str(row.ustar0_m_s))
        axes.plot(
            [ustar.min(), at, at], [share, share, 0], color=ANSWER, lw=0.8, ls="--"
        )
        axes.plot([at], [share], "o", color=ANSWER, ms=4)
        axes.text(0.47, share + 1.5, f"{share:g} %", color=ANSWER)
    axes.annotate(
        "one load step: the flow is held until\nthe grains have come to rest",
        (ustar[20], moved[20]),
        (0.86, 12),
        color=FLOW,
        arrowprops={"arrowstyle": "-", "color": FLOW},
    )
    axes.set(
        xlabel="friction velocity far upwind u*₀, m/s",
        ylim=(0, 100),
        xlim=(0.46, 1.1),
        ylabel="share of the exposed\ngrains that has moved, %",
    )
    return canvas


def main(directory: Path) -> None:
    """Draw all and write them."""
    run = orchestrator.run("first-look", out=directory)
    wall = run.tables["wall_stress"]
    made = {
        "how-flow": flow(wall),
        "how-stress": stress(wall),
        "how-forces": forces(),
        "how-pocket": pocket(),
        "how-hops": hops(directory / "beds"),
        "how-steps": steps(run.tables["pile_curve"], run.tables["pile_threshold"]),
    }
    for name, canvas in made.items():
        (FIGURES / f"{name}.svg").write_bytes(style.svg(canvas))
        (directory / f"{name}.png").write_bytes(style.as_png(canvas))


if __name__ == "__main__":
    with style.settings():
        main(Path(sys.argv[1] if sys.argv[1:] else "results/first-look"))
