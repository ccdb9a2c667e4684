"""How much passes on a level bed that feeds itself: the flux under held flows, by LIGGGHTS.

    python measure.py DIRECTORY [SEEDS [HOLD]]

A bed of quartz of 1 mm in water, one plane, 40 d long and periodic, is poured and held under
rising flows, `HOLD` sqrt(d/g') each. The mass that passes a line across the bed, for each metre of
width, is the sum of the grains' speeds times their mass, over the length of the bed and the width
of the plane, d.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
BED = HERE.parents[1] / "templates" / "liggghts" / "bed"
DECKS = (HERE / "in.flux", BED / "contact.liggghts")
CRITERION = 0.41e-3
"""The practical flux of incipient motion that the paper quotes, kg/s/m."""
D, RHO_SOL, RHO_F, G = 1e-3, 2650.0, 1000.0, 9.81
MASS = RHO_SOL * np.pi / 6 * D**3
SMALLEST = 0.8
"""Of the sizes, 0.8 to 1.2 d: equal spheres would lie as a crystal."""
WATER = {
    "diameter": D,
    "smallest": SMALLEST,
    "density": RHO_SOL,
    "gravity": G * (RHO_SOL - RHO_F) / RHO_SOL,
    "friction": float(np.tan(np.radians(35.0))),
    "stiffness": 1e3,
    "damping": 0.3,
    "time_step": 0.2,
    "roughness": D / 30,
    "viscosity": 1e-6,
    "fluid": RHO_F,
    "saffman": 1.615,
}
SHIELDS = (0.008, 0.01, 0.012, 0.014, 0.017, 0.02, 0.03)
LENGTH, ROWS = 40, 4
"""Of the bed: fixed grains, and how many rows it has when it is as dense as a lattice."""


def settled(folder, seed, length=LENGTH):
    """Pour a bed; columns id, type, x, z, radius."""
    draw = np.random.default_rng(seed)
    row = int(length / 1.25)
    layers = ROWS * length // row + 1
    x = np.concatenate(
        [np.arange(length) + 0.5, *[(np.arange(row) + 0.5) * length / row] * layers]
    )
    x[length:] += draw.uniform(-0.02, 0.02, row * layers)
    z = np.concatenate(
        [np.zeros(length), np.repeat(1.3 + 1.25 * np.arange(layers), row)]
    )
    size = np.concatenate(
        [np.ones(length), draw.uniform(SMALLEST, 2 - SMALLEST, row * layers)]
    )
    _run(folder, x % length, z, size, length, level=0.0, hold=0.0)
    return np.loadtxt(folder / "settled.dump", skiprows=9)


def flux(folder, seed, shields, hold, length=LENGTH):
    """The flux at each Shields number, kg/s/m."""
    folder.mkdir(parents=True, exist_ok=True)
    bed = settled(folder, seed, length) / np.array([1, 1, D, D, D])
    _, _, x, z, radius = bed.T
    at = np.linspace(0, length, 50 * length, endpoint=False)
    aside = (at[:, None] - x + length / 2) % length - length / 2
    upper = np.where(
        np.abs(aside) < radius, z + np.sqrt(np.maximum(radius**2 - aside**2, 0)), -9
    )
    # a row of equal grains has its mean upper side pi/8 d over its centres; the level lies d/2 + z0
    # below these, as the bed line of a pile does
    level = upper.max(1).mean() - np.pi / 8 - 0.5 - 1 / 30
    flows = np.sqrt(np.asarray(shields) * (RHO_SOL - RHO_F) / RHO_F * G * D)
    (folder / "flows.txt").write_text("".join(f"{one:.9g}\n" for one in flows))
    _run(folder, x % length, z, 2 * radius, length, level=float(level) * D, hold=hold)
    _, moved, time = np.loadtxt(
        folder / "flux.csv", delimiter=",", skiprows=1, ndmin=2
    ).T
    return MASS * moved / time / (length * D) / D


def _run(folder, x, z, size, length, **told):
    lines = [
        f"variable {name} equal {value!r}" for name, value in {**WATER, **told}.items()
    ]
    (folder / "parameters.liggghts").write_text("\n".join(lines) + "\n")
    kinds = np.where(np.arange(len(x)) < length, 1, 2)
    sides = (
        f"0 {length * D} xlo xhi\n{-3 * D} {3 * D} ylo yhi\n{-3 * D} {60 * D} zlo zhi\n"
    )
    rows = "".join(
        f"{i} {kind} {own * D:.17g} {RHO_SOL} {at * D:.17g} 0.0 {up * D:.17g}\n"
        for i, (kind, own, at, up) in enumerate(zip(kinds, size, x, z, strict=True), 1)
    )
    head = f"id type diameter density x y z\n\n{len(x)} atoms\n4 atom types\n\n{sides}\nAtoms\n\n"
    (folder / "grains.data").write_text(head + rows)
    # beside its inputs: in the path of a file LIGGGHTS takes no quotes
    for deck in DECKS:
        shutil.copy(deck, folder)
    command = ["liggghts", "-in", "in.flux", "-log", "log.flux", "-screen", "none"]
    subprocess.run(command, cwd=folder, check=True)


def main(folder, seeds="3", hold="60"):
    """Print a table: a row for each flow, a column for each bed."""
    beds = [
        flux(folder / f"bed-{i}", i, SHIELDS, float(hold)) for i in range(int(seeds))
    ]
    print("Shields number | flux over the criterion of 0.41e-3 kg/s/m, for each bed")
    for row in zip(SHIELDS, *beds, strict=True):
        print(row[0], *(f"{one / CRITERION:.3g}" for one in row[1:]), sep=" | ")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
