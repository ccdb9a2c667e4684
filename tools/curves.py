"""The thresholds of the default over size, density ratio and slope, in four fluids.

python tools/curves.py [PICTURE]

It draws docs/figures/curves.svg, or another picture, and prints the largest factor between two points that
follow each other on each curve, with the place, and what it is for 1 % of the size or the ratio of densities.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.physics.beside import MOST_SLOPE_DEG, SUSTAINED
from orchestrator.physics.grain import Grain
from orchestrator.physics.onset import of_grains
from orchestrator.report import style

FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "curves.svg"
FLUIDS: dict[str, dict[str, Any]] = {
    "water": {"fluid_density": 1000.0, "viscosity": 1e-6},
    "air": {"fluid_density": 1.2, "viscosity": 1.5e-5},
    "Mars": {"fluid_density": 0.02, "viscosity": 6.5e-4, "gravity": 3.71},
    "Titan": {"fluid_density": 5.3, "viscosity": 1.2e-6, "gravity": 1.35},
}
"""Fluids, with the gravity where they are."""
DENSITY = {"Titan": 950.0}
QUARTZ = 2650.0
"""Densities of the grains, kg/m3: of Titan they are of ice."""
COLOURS = ("#0072b2", "#c24e00", "#8c564b", "#009e73")
POINTS = 200
SIZES = np.geomspace(5e-5, 2e-2, POINTS)
"""m."""
RATIOS = np.geomspace(1.1, 1e6, POINTS)
SLOPES = np.linspace(-MOST_SLOPE_DEG, MOST_SLOPE_DEG, POINTS)
OF_SLOPES = 5e-4
"""Diameter of the grains on slopes, and of those whose Galileo number the others have, m."""
LAW = "bridged-gravel"
NAMES = {
    "size": "diameter, mm",
    "density ratio": "ratio of densities, at the Galileo number of 0.5 mm",
    "slope": "slope that the flow goes up, of 0.5 mm, deg",
}


def sized(fluid: str, diameter: Any) -> Grain:
    """Grains of quartz, or on Titan of ice, in a fluid.

    Parameters
    ----------
    fluid
        Its name.
    diameter
        Their diameters, m.

    Returns
    -------
    Grain
        The grains.
    """
    return Grain(
        diameter=diameter,
        density=DENSITY.get(fluid, QUARTZ),
        entrainment_angle_deg=60.0,
        **FLUIDS[fluid],
    )


def grains_over(what: str, fluid: str) -> tuple[Any, Grain]:
    """The numbers along a curve, and its grains."""
    if what == "size":
        return 1e3 * SIZES, sized(fluid, SIZES)
    one = sized(fluid, np.full(POINTS, OF_SLOPES))
    if what == "slope":
        return SLOPES, one.changed(slope_deg=SLOPES)
    of_numbers = Grain.of_numbers(one.galileo, RATIOS)
    return RATIOS, of_numbers.changed(entrainment_angle_deg=60.0)


def curves() -> pd.DataFrame:
    """Find the thresholds along all curves.

    Returns
    -------
    DataFrame
        A row for each point: what it is over, the fluid, that number, the Shields numbers of the threshold,
        of entrainment in the gust, and of sustained motion.
    """
    made = []
    for what in NAMES:
        for fluid in FLUIDS:
            x, grains = grains_over(what, fluid)
            criteria = of_grains(grains, LAW, SUSTAINED).criteria
            assert criteria is not None
            numbers = {
                "shields": criteria.shields,
                "entrained": criteria.entrained,
                "sustained": criteria.sustained,
            }
            made.append(pd.DataFrame({"over": what, "fluid": fluid, "x": x, **numbers}))
    return pd.concat(made, ignore_index=True)


def largest_steps(rows: pd.DataFrame) -> pd.DataFrame:
    """Find the largest factor between two points that follow each other, by curve.

    Parameters
    ----------
    rows
        As of `curves`.

    Returns
    -------
    DataFrame
        A row for each curve, with the number where the factor is; `of_1_percent` is the
        largest factor of points 1 % apart, NaN over the slope.
    """
    made = []
    for (what, fluid), part in rows.groupby(["over", "fluid"], sort=False):
        logs = np.abs(np.diff(np.log(part["shields"])))
        place = int(logs.argmax())
        x = part["x"].to_numpy()
        one = np.nan
        if what != "slope":
            one = float(np.exp((logs / np.diff(np.log(x))).max() * np.log(1.01)))
        made.append(
            {
                "over": what,
                "fluid": fluid,
                "factor": np.exp(logs[place]),
                "at": float(x[place]),
                "of_1_percent": one,
            }
        )
    return pd.DataFrame(made)


def drawn(rows: pd.DataFrame) -> Canvas:
    """Draw the curves: the threshold, and dotted what the pocket alone asks for.

    Parameters
    ----------
    rows
        As of `curves`.

    Returns
    -------
    Canvas
        A panel for each number.
    """
    canvas = style.canvas(7.2)
    for ax, what in zip(canvas.subplots(3, 1), NAMES, strict=True):
        for fluid, colour in zip(FLUIDS, COLOURS, strict=True):
            part = rows[(rows["over"] == what) & (rows["fluid"] == fluid)]
            ax.plot(part["x"], part["shields"], color=colour, label=fluid)
            ax.plot(part["x"], part["entrained"], ":", color=colour, lw=1.0)
        if what != "slope":
            ax.set_xscale("log")
            style.plain_ticks(ax.xaxis)
            ax.set_yscale("log")
            style.plain_ticks(ax.yaxis)
        ax.set(xlabel=NAMES[what], ylabel="critical Shields number $θ_c$")
    canvas.axes[0].legend()
    return canvas


if __name__ == "__main__":
    found = curves()
    print(largest_steps(found).to_string(index=False, float_format="%.4g"))
    with style.settings():
        canvas = drawn(found)
        if sys.argv[1:]:
            canvas.savefig(sys.argv[1])
        else:
            FIGURE.write_bytes(style.svg(canvas))
