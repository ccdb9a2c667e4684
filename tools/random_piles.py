"""Random piles of all kinds: numerical errors are measured on some, and tested on others.

python tools/random_piles.py METHOD > random.toml

The study file has the piles of the calibration, answered by METHOD: `dem`, beside which
`tools/beside_dem.py` puts pivots and peeling, or `peeling`, with which `orchestrator
ladder` compares the meshes of the flow. Those of the test, `tools/random_scenes.py`, are
drawn from the same distribution by another seed.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from orchestrator.study import study
from orchestrator.study.study import Study

PACKINGS = (*4 * ("aligned",), *3 * ("disordered",), *2 * ("horizontal",), "poured")
FLUIDS = (
    'fluid.kind = "paper"',
    "fluid.viscosity = 1e-3",
    'fluid.kind = "water"\ngrain.density = 2650.0',
)
HEAD = """title = "Random piles"
forces = { law = "bridged" }
bed.kind = "pile"
"""
METHODS = {
    "dem": """method.kind = "dem"
method.grains = { mobile_layers = 1, stiffness = 1e3, load_increment = 0.01, waiting_time = 6.0, time_step = 0.3 }
""",
    "peeling": 'method.kind = "peeling"\n',
}
"""Lines of each method of the grains."""


@dataclass(frozen=True)
class Draw:
    """How piles are drawn.

    Attributes
    ----------
    count
        Number of piles.
    seed
        Seed of the draw.
    has_poured
        Whether poured piles are kept, whose errors are measured on a class of their
        own.
    """

    count: int
    seed: int
    has_poured: bool


CALIBRATION = Draw(120, 20261128, has_poured=False)
TEST = Draw(60, 20261127, has_poured=True)


def text(draw: Draw, method: str) -> str:
    """Write the study file of some piles.

    Parameters
    ----------
    draw
        How they are drawn.
    method
        Name of one of `METHODS`.

    Returns
    -------
    str
        The study file.
    """
    return HEAD + METHODS[method] + "".join(_groups(draw))


def load(draw: Draw, method: str) -> Study:
    """Read some piles as a study.

    Parameters
    ----------
    draw
        How they are drawn.
    method
        Name of one of `METHODS`.

    Returns
    -------
    Study
        The study.
    """
    return study.parse(text(draw, method), name="random", where="random.toml")


def _groups(draw: Draw) -> Iterator[str]:
    """The group of each pile."""
    rng = np.random.default_rng(draw.seed)
    for index in range(draw.count):
        packing = str(rng.choice(PACKINGS))
        diameter = float(f"{10 ** rng.uniform(-3.7, -2.7):.3g}")
        most = 12.0 if packing == "poured" else 30.0
        height = float(f"{diameter * rng.uniform(10.0, most):.3g}")
        shape = "triangle"
        if packing == "aligned":
            shape = str(rng.choice(["triangle", "triangle", "dune", "trapezoid"]))
        lines = [
            f"grain.diameter = {diameter}",
            f"bed.slope_deg = {rng.uniform(10.0, 30.0):.1f}",
            f"bed.height = {height}",
            f'bed.roughness = "d/{rng.choice([10, 30])}"',
            f'bed.packing = "{packing}"',
            f'bed.shape = "{shape}"',
            f'forces.stress = "{rng.choice(["wall", "wall", "eq10"])}"',
            str(rng.choice(FLUIDS)),
        ]
        if packing == "disordered":
            lines += [f"bed.disorder = {rng.choice([0.01, 0.02, 0.1])}"]
        if packing in ("disordered", "poured"):
            lines += [f"bed.seed = {index}"]
        if packing == "poured":
            lines += [
                "grain.sizes = { sigma_g = 1.3 }",
                "method.grains.mobile_layers = 4",
            ]
        body = "\n".join(lines)
        if packing != "poured" or draw.has_poured:
            yield f'[[group]]\nname = "{index}"\n{body}\nthreshold.criterion = "entrained"\n'


if __name__ == "__main__":
    sys.stdout.write(text(CALIBRATION, sys.argv[1]))
