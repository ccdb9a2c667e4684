"""An independent flow: levels 3 and 5 of a pack, by the k-epsilon solver in rans.py.

    python answer.py CASE OUT [FINER]

Level 3 is the stress on the bed. At level 5 rows along the windward face are laid, and each grain
moves when its own stress reaches the threshold of one grain. Other kinds, other packings, other
turbulence models and Eq. 10 end with 2. FINER divides all lengths of cells but the height of the
first ones, which is a part of the model.
"""

import itertools
import json
import math
import sys
from pathlib import Path

import numpy as np
from rans import solve

sys.path.insert(0, str(Path(__file__).parent.parent / "native"))
from solver import alone, table, write

SHORTEST = 1 / 30
"""Length of the cells at sharp corners of the bed, over h."""
LONGEST = 1 / 6
"""Length of the cells on forms, over h."""
GROWTH, FAR = 0.1, 0.3
"""Growth of a cell over its length, up to `NEAR` h from the forms, and beyond."""
NEAR = 4.0
SHARP_DEG = 8.0
"""Bend of the bed that is a corner, not a part of a curve."""


def grid_lines(x, z, h, finer):
    """Places of the vertical grid lines: short cells at sharp corners, long ones far away."""
    bends = np.diff(np.degrees(np.arctan2(np.diff(z), np.diff(x))))
    sharp = x[1:-1][np.abs(bends) > SHARP_DEG]
    begin, end = (x[1], x[-2]) if len(x) > 2 else (x[0] + h, x[-1] - h)
    lines = [x[:1]]
    for a, b in itertools.pairwise(x):
        at = np.linspace(a, b, 20001)
        middle = (at[1:] + at[:-1]) / 2
        away = np.maximum(np.maximum(begin - middle, middle - end), 0.0)
        size = LONGEST * h + GROWTH * np.minimum(away, NEAR * h)
        for corner in sharp:
            near = np.minimum(np.abs(middle - corner), NEAR * h)
            size = np.minimum(size, SHORTEST * h + GROWTH * near)
        size += FAR * np.maximum(away - NEAR * h, 0.0)
        count = np.r_[0.0, np.cumsum(np.diff(at) / size)]
        cells = max(math.ceil(finer * count[-1]), 1)
        lines.append(np.interp(np.arange(1, cells + 1) * count[-1] / cells, count, at))
    return np.concatenate(lines)


def levels(first, h, lid, finer):
    """Heights of the other grid lines over flat bed."""
    heights, size = [0.0], first
    while heights[-1] < lid:
        heights.append(heights[-1] + size)
        size *= (1 + (GROWTH if heights[-1] < NEAR * h else FAR)) ** (1 / finer)
    return np.array(heights) * lid / heights[-1]


class Bed:
    """The stress on the bed line of a scene, by arc length from the windward toe."""

    def __init__(self, scene, case, finer):
        corners = [
            (float(row["x_m"]), float(row["z_m"])) for row in table(case / "bed.csv")
        ]
        x, z = np.array(corners).T
        lines = grid_lines(x, z, scene["h_m"], finer)
        first = scene["first_cell_m"] / math.cos(math.radians(scene["alpha_deg"]))
        heights = levels(first, scene["h_m"], scene["lid_height_m"], finer)
        bed = np.interp(lines, x, z)
        found = solve(
            lines,
            heights,
            bed,
            scene["ustar0_m_s"],
            scene["z0_m"],
            scene["solve_nu_m2_s"],
            _say,
        )
        self.ratio = found.ratio
        length = np.hypot(np.diff(lines), np.diff(bed))
        ends = np.concatenate([[0.0], np.cumsum(length)])
        self.ends = ends - np.interp(x[1] if len(x) > 2 else x[0], lines, ends)
        self.crest = float(self.ends[np.argmax(bed)])
        stress = self.ratio * np.abs(self.ratio)
        self.carried = np.concatenate([[0.0], np.cumsum(stress * length)])

    def at(self, s):
        """u*/u*_0 at a place."""
        return float(np.interp(s, (self.ends[1:] + self.ends[:-1]) / 2, self.ratio))

    def over(self, s, length):
        """u*/u*_0 of the mean stress over a length around a place."""
        begin, end = (
            np.interp(s + side * length / 2, self.ends, self.carried)
            for side in (-1, 1)
        )
        mean = (end - begin) / length
        return math.copysign(math.sqrt(abs(mean)), mean)

    def windward_mean(self):
        """The mean over the windward face by arc length."""
        on = (self.ends[1:] > 1e-9) & (self.ends[1:] < self.crest + 1e-9)
        return float(np.average(self.ratio[on], weights=np.diff(self.ends)[on]))


def _say(flow):
    if flow.iterations % 50 == 0:
        print(
            f"iteration {flow.iterations}: the stress changes by {flow.change:.1e}",
            flush=True,
        )


def flow(scene, case, finer):
    """Level 3."""
    bed = Bed(scene, case, finer)
    mean = bed.windward_mean()
    return lambda quantity, at: mean if not at else bed.at(float(at) * scene["h_m"])


def line(scene, case, finer):
    """Level 5: grains along the windward face, from the one over the crest down to the toe."""
    bed = Bed(scene, case, finer)
    d = scene["d_m"]
    apart = 2 * d * math.cos(math.radians(scene["beta_deg"]))
    places = np.arange(bed.crest, 0.0, -apart)
    length = max(d, scene["averaging_length"] * scene["h_m"])
    grains = [(bed.over(s, length), scene["alpha_deg"]) for s in places]
    return alone(scene, grains, table(case / "load_steps.csv"))


def refused(scene):
    """Why this solver does not answer a scene; empty if it does."""
    if scene["kind"] not in ("flow", "line"):
        return f"the kind {scene['kind']}"
    if scene["turbulence_model"] != "kEpsilon":
        return f"the turbulence model {scene['turbulence_model']}"
    if scene.get("packing", "aligned") != "aligned":
        return f"the packing {scene['packing']}"
    if (
        scene.get("stress", "wall") != "wall"
        or scene.get("flow_model", "solve") != "solve"
    ):
        return "another stress than that of the wall"
    return ""


def main(case, out, finer=1.0):
    """Answer one scene."""
    scene = json.loads((case / "scene.json").read_text())
    if refused(scene):
        print(f"this solver does not know {refused(scene)}", file=sys.stderr)
        return 2
    write(case, out, {"flow": flow, "line": line}[scene["kind"]](scene, case, finer))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2]), *map(float, sys.argv[3:])))
