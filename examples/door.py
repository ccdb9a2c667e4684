"""What the foreign solvers share: the scene, the load steps of a bed, and the answer.

The forces are those of the example in examples/native; the format is docs/benchmark.md.
"""

import csv
import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "native"))
from solver import forces, table

SAMPLING_INTERVAL = 0.5
"""Time between two samples of the grains, sqrt(d/g')."""
SETTLE = 10.0
"""Time of load step 0."""
REST_ENERGY = 1e-6
"""Kinetic energy of the mobile grains that have not passed, below which the bed is at rest, W d."""
ROOF = 3.5
"""From a face of the bed to the height at which a grain in flight is gone, d."""
BOX = 3.0
"""From the outermost centres to the sides beyond which a grain is gone, d."""
AWAY = 10.0
"""Displacement from which on a counted grain is gone, and how far behind the bed any is, d."""


class Bed:
    """The grains of a pivot or a pile, and the force on each in each load step.

    The counted grains come first, the fixed ones last.
    """

    def __init__(self, case):
        self.scene = json.loads((case / "scene.json").read_text())
        rows = table(case / "grains.csv")
        self.is_pivot = self.scene["kind"] == "pivot"
        if self.is_pivot:
            rows = [
                {**row, "kind": row["kind"].replace("mobile", "counted")}
                for row in rows
            ]
        # LAMMPS wants the highest id never to leave
        order = {"counted": 0, "fixed": 2}
        self.grains = sorted(rows, key=lambda row: order.get(row["kind"], 1))
        self.load_steps = table(case / "load_steps.csv")
        self.counted = sum(row["kind"] == "counted" for row in rows)
        self.along = [self._along(row) for row in self.grains[: self.counted]]
        self.given = self._given(case / "forces.csv")

    def _along(self, row):
        """The way along the local bed that the flow pushes a grain, over its own diameter in d."""
        slope = math.radians(float(row.get("slope_deg", self.scene["alpha_deg"])))
        way = math.copysign(1.0, float(row.get("ustar_over_ustar0", 1.0)))
        size = float(row["d_m"]) / self.scene["d_m"]
        return way * math.cos(slope) / size, way * math.sin(slope) / size

    def _given(self, path):
        """The forces that a scene gives, by load step and id; none of equal grains."""
        if not path.exists():
            return None
        given = {}
        for row in table(path):
            force = float(row["fx_n"]), float(row["fz_n"])
            given[int(row["load_step"]), row["id"]] = force
        return given

    @property
    def step(self):
        """The time step, s: that of the scene for the smallest grain that may move."""
        sizes = (float(row["d_m"]) for row in self.grains if row["kind"] != "fixed")
        mass = self.scene["mass_kg"] * (min(sizes) / self.scene["d_m"]) ** 3
        return self.scene["time_step"] * math.sqrt(mass / self.scene["spring_n_m"])

    @property
    def rest_energy(self):
        """Kinetic energy of the grains that have not passed, below which the bed is at rest, J."""
        return REST_ENERGY * self.scene["weight_n"] * self.scene["d_m"]

    @property
    def settle_drag(self):
        """Drag of the still fluid in which a poured bed settles over a grain's speed, kg/s."""
        return self.scene.get("settle_drag_kg_s", 0.0)

    @property
    def behind(self):
        """The x behind which every grain is gone, m."""
        mobile = (row for row in self.grains if row["kind"] != "fixed")
        return max(float(row["x_m"]) for row in mobile) + AWAY * self.scene["d_m"]

    @property
    def flow(self):
        """The flow of each load step, m/s."""
        return [
            float(row["ustar_m_s" if self.is_pivot else "ustar0_m_s"])
            for row in self.load_steps
        ]

    def force(self, load_step):
        """The force of the flow on each grain in a load step: a list of (fx, fz), N."""
        if self.is_pivot:
            own = (
                float(self.load_steps[load_step]["fx_n"]),
                float(self.load_steps[load_step]["fz_n"]),
            )
            return [
                own if row["kind"] == "counted" else (0.0, 0.0) for row in self.grains
            ]
        if self.given is not None:
            return [
                self.given.get((load_step, row["id"]), (0.0, 0.0))
                for row in self.grains
            ]
        return [self._pushed(row, self.flow[load_step]) for row in self.grains]

    def _pushed(self, row, ustar0):
        if row["kind"] not in ("counted", "pushed"):
            return 0.0, 0.0
        ratio, slope = (
            float(row["ustar_over_ustar0"]),
            math.radians(float(row["slope_deg"])),
        )
        drag, lift = forces(self.scene, abs(ratio) * ustar0)
        drag = math.copysign(drag, ratio)
        x, z = math.cos(slope), math.sin(slope)
        return drag * x - lift * z, drag * z + lift * x

    @property
    def roof(self):
        """Slope (radians) and ridge (m) of the roof above which a grain in flight is gone."""
        scene, d = self.scene, self.scene["d_m"]
        if self.is_pivot:
            highest = max(float(row["z_m"]) for row in self.grains)
            return 0.0, 0.0, highest + 1e3 * d
        if "roof_slope_deg" in scene:
            slope = math.radians(scene["roof_slope_deg"])
            return slope, scene["roof_x_m"], scene["roof_z_m"]
        slope = math.radians(scene["alpha_deg"])
        ridge = scene["h_m"] + ROOF * d / math.cos(slope)
        return slope, scene["h_m"] / math.tan(slope), ridge

    def answer(self, moved_in, carried):
        """Write nothing; give the answer to a question, from what each counted grain did.

        `moved_in` has the load step in which it moved, or 0 for never; `carried` says whether it
        was gone before it had passed the displacement criterion.
        """
        return _Answer(self, moved_in, carried)


class _Answer:
    def __init__(self, bed, moved_in, carried):
        self.bed, self.moved_in, self.carried, self.flow = (
            bed,
            moved_in,
            carried,
            bed.flow,
        )

    def __call__(self, quantity, at):
        if quantity == "moved":
            return self._moved(int(at))
        if quantity == "carried_off":
            pairs = zip(self.moved_in, self.carried, strict=True)
            return sum(0 < level <= int(at) for level, gone in pairs if gone)
        if quantity == "not_moved":
            return self.bed.counted - self._moved(int(at))
        if quantity == "ustar_m_s":
            return self._between(self.moved_in[0])
        load_step = self._first(float(at))
        ustar0 = self._between(load_step)
        return ustar0 if quantity == "ustar0_m_s" else self._shields(load_step, ustar0)

    def _moved(self, load_step):
        return sum(0 < level <= load_step for level in self.moved_in)

    def _first(self, fraction):
        need = max(math.ceil(fraction * self.bed.counted - 1e-9), 1)
        load_steps = range(1, len(self.flow))
        return next(
            (load_step for load_step in load_steps if self._moved(load_step) >= need),
            len(self.flow) - 1,
        )

    def _between(self, load_step):
        return math.sqrt(self.flow[load_step - 1] * self.flow[load_step])

    def _shields(self, load_step, ustar0):
        scene, rows = self.bed.scene, zip(self.bed.grains, self.moved_in, strict=False)
        ratio = [
            float(row["ustar_over_ustar0"])
            for row, level in rows
            if 0 < level <= load_step
        ]
        mean = sum(r**2 for r in ratio) / max(len(ratio), 1)
        excess = (
            (scene["rho_sol_kg_m3"] - scene["rho_f_kg_m3"])
            * scene["g_m_s2"]
            * scene["d_m"]
        )
        return scene["rho_f_kg_m3"] * ustar0**2 * mean / excess


def write(case, out, answer, steps=None):
    """Write the answer to each question of a scene, and how many time steps it took if known."""
    with out.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["quantity", "at", "value"])
        for asked in table(case / "ask.csv"):
            quantity, at = asked["quantity"], asked["at"]
            writer.writerow([quantity, at, repr(float(answer(quantity, at)))])
        if steps is not None:
            writer.writerow(["steps", "", steps])
