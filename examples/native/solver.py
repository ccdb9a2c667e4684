"""A small native solver: levels 1 and 2 and the pivot law of level 4; standard library only.

    python solver.py CASE OUT

It reads the directory of a scene and writes its answer, as docs/benchmark.md says. The contact
mechanics are those of a sphere in a plane, integrated explicitly; the thresholds of a pile are
those of each grain alone under its own stress. It knows no other kind and ends with 2 then.
"""

import csv
import json
import math
import sys
from pathlib import Path

KARMAN = 2.5
INERTIA = 0.4  # of a sphere, over m r^2
TOUCH = 1.001  # two grains closer than this touch, of the sum of their radii
STEP = 0.05  # of the integration, in sqrt(m/K)
REST = 1e-6  # kinetic energy at rest, in W d


def forces(scene, ustar):
    """Drag and lift on an exposed grain, N (Eqs. 2 and 4, and the law that bridges them)."""
    d, rho, nu = scene["d_m"], scene["rho_f_kg_m3"], scene["nu_m2_s"]
    speed, gradient = flow_around(scene, ustar)
    drag = 3 * math.pi * rho * nu * d * speed
    if scene["force_law"] != "low":
        drag *= 1 + 0.15 * (speed * d / nu) ** 0.687
    return drag, scene["alpha_s"] * rho * math.sqrt(nu * gradient) * d**2 * speed


def flow_around(scene, ustar):
    """Speed (m/s) and shear (1/s) of the flow around the grain."""
    d, nu, r = scene["d_m"], scene["nu_m2_s"], scene["z0_m"] / scene["d_m"]
    viscous = (nu / (d / 2 + scene["z0_m"]), nu)
    rough = (
        KARMAN * ((1 + r) * math.log(1 + 1 / r) - 1),
        KARMAN * math.log(1 + 1 / r) / d,
    )
    if scene["force_law"] == "low":
        return tuple(ustar**2 / a for a in viscous)
    if scene["force_law"] == "high":
        return tuple(ustar * c for c in rough)
    if scene["force_law"] != "bridged":
        raise SystemExit(f"this solver has no force law {scene['force_law']}")
    # ustar^2 = a x + (x/c)^2: viscosity and turbulence carry the stress together
    pairs = zip(viscous, rough, strict=True)
    return tuple(2 * ustar**2 / (a + math.hypot(a, 2 * ustar / c)) for a, c in pairs)


def threshold(scene, slope_deg=None):
    """The u* (m/s) at which the forces turn a grain over its neighbour (Eq. 1), by bisection."""
    slope_deg = scene["alpha_deg"] if slope_deg is None else slope_deg
    alpha, beta = math.radians(slope_deg), math.radians(scene["beta_deg"])
    goal = scene["weight_n"] * math.cos(alpha - beta)
    low, high = 1e-6, 1e3
    for _ in range(200):
        middle = math.sqrt(low * high)
        drag, lift = forces(scene, middle)
        if drag * math.sin(beta) + lift * math.cos(beta) < goal:
            low = middle
        else:
            high = middle
    return math.sqrt(low * high)


def closed_form(scene, case):
    """Level 1."""
    ustar = threshold(scene)
    d, rho = scene["d_m"], scene["rho_f_kg_m3"]
    excess = (scene["rho_sol_kg_m3"] - rho) * scene["g_m_s2"] * d
    answers = {
        "ustar_m_s": lambda at: ustar,
        "reynolds": lambda at: ustar * d / scene["nu_m2_s"],
        "shields": lambda at: rho * ustar**2 / excess,
        "drag_n": lambda at: forces(scene, float(at))[0],
        "lift_n": lambda at: forces(scene, float(at))[1],
    }
    return lambda quantity, at: answers[quantity](at)


class Contact:
    """A spring that pushes and a tangential one that remembers, each with its dashpot."""

    def __init__(self, scene, mass):
        self.k = scene["spring_n_m"]
        self.gamma = 2 * scene["damping"] * math.sqrt(self.k * mass)
        self.friction = math.tan(math.radians(scene["phi_deg"]))
        self.stretch = 0.0

    def force(self, overlap, approach, slip, dt):
        """Normal push and friction, N; `approach` and `slip` are speeds at the contact, m/s."""
        push = self.k * overlap + self.gamma * approach
        if overlap <= 0 or push <= 0:
            self.stretch = 0.0
            return 0.0, 0.0
        self.stretch += slip * dt
        grip = -self.k * self.stretch - self.gamma * slip
        most = self.friction * push
        if abs(grip) > most:
            grip = math.copysign(most, grip)
            self.stretch = -grip / self.k
        return push, grip


def time_step(scene):
    """Of the integration, s."""
    return STEP * math.sqrt(scene["mass_kg"] / scene["spring_n_m"])


def collision(scene, case):
    """Two equal grains head on: the relative motion of one with half the mass."""
    mass, dt = scene["mass_kg"] / 2, time_step(scene) / 10
    contact = Contact(scene, mass)
    start = speed = 2 * scene["speed_m_s"]
    overlap = 0.0
    while True:
        overlap += speed * dt
        push, _ = contact.force(overlap, speed, 0.0, dt)
        if push == 0:
            return lambda quantity, at: -speed / start
        speed -= push / mass * dt


def roll(scene, incline_deg, speed, times):
    """A sphere on a plane: its speed and the speed of its surface by spinning at some times."""
    m, g, radius = scene["mass_kg"], scene["reduced_gravity_m_s2"], scene["d_m"] / 2
    a, dt = math.radians(incline_deg), time_step(scene)
    contact = Contact(scene, m)
    overlap = m * g * math.cos(a) / contact.k  # at rest in the plane
    sink, spin, time, found = 0.0, 0.0, 0.0, []
    for end in times:
        while time < end:
            push, grip = contact.force(overlap, sink, speed - spin * radius, dt)
            speed += (g * math.sin(a) + grip / m) * dt
            spin -= grip * radius / (INERTIA * m * radius**2) * dt
            sink += (g * math.cos(a) - push / m) * dt
            overlap += sink * dt
            time += dt
        found.append((time, speed, spin * radius))
    return found


def incline(scene, case):
    """The acceleration of a sphere on a plane, once it rolls or slides."""
    unit, g = scene["time_unit_s"], scene["reduced_gravity_m_s2"]
    (t1, v1, _), (t2, v2, _) = roll(
        scene, scene["incline_deg"], 0.0, (2 * unit, 6 * unit)
    )
    return lambda quantity, at: (v2 - v1) / (t2 - t1) / g


def sliding(scene, case):
    """A sphere that starts to slide, until it rolls."""
    start = scene["speed_m_s"]
    places = ("0.5", "2")
    found = roll(scene, 0.0, start, [float(at) * scene["roll_time_s"] for at in places])
    speed = {at: v / start for at, (_, v, _) in zip(places, found, strict=True)}
    spin = {at: w / start for at, (_, _, w) in zip(places, found, strict=True)}
    return lambda quantity, at: (speed if quantity == "speed_over_start" else spin)[at]


class Bed:
    """One mobile grain on fixed ones, in the plane."""

    def __init__(self, scene, grains):
        self.scene, self.dt = scene, time_step(scene)
        self.fixed = [
            (float(g["x_m"]), float(g["z_m"])) for g in grains if g["kind"] == "fixed"
        ]
        mobile = next(g for g in grains if g["kind"] == "mobile")
        self.x, self.z = float(mobile["x_m"]), float(mobile["z_m"])
        self.vx = self.vz = self.spin = 0.0
        self.contacts = [Contact(scene, scene["mass_kg"]) for _ in self.fixed]

    def step(self, fx, fz):
        """Move the grain by one time step under a force and its weight."""
        m, d = self.scene["mass_kg"], self.scene["d_m"]
        fz -= self.scene["weight_n"]
        torque = 0.0
        for (x, z), contact in zip(self.fixed, self.contacts, strict=True):
            dx, dz = self.x - x, self.z - z
            distance = math.hypot(dx, dz)
            nx, nz = dx / distance, dz / distance
            # along the contact, in the sense in which the grain rolls forwards over its neighbour
            slip = self.vx * nz - self.vz * nx - self.spin * d / 2
            push, grip = contact.force(
                d - distance, -self.vx * nx - self.vz * nz, slip, self.dt
            )
            fx += push * nx + grip * nz
            fz += push * nz - grip * nx
            torque -= grip * d / 2
        self.vx += fx / m * self.dt
        self.vz += fz / m * self.dt
        self.spin += torque / (INERTIA * m * d**2 / 4) * self.dt
        self.x += self.vx * self.dt
        self.z += self.vz * self.dt


def moves(scene, grains, resting, load_step):
    """Whether the grain passes the criterion in a load step, after those in which it rests."""
    bed = Bed(scene, grains)
    alpha, unit = math.radians(scene["alpha_deg"]), scene["time_unit_s"]
    for rest in resting:
        for _ in range(int(10 * unit / bed.dt)):
            bed.step(float(rest["fx_n"]), float(rest["fz_n"]))
    x, z, before = bed.x, bed.z, 0.0
    for _ in range(int(2 * scene["waiting_time"])):  # samples, T/2 apart
        for _ in range(int(unit / 2 / bed.dt)):
            bed.step(float(load_step["fx_n"]), float(load_step["fz_n"]))
        travel = (bed.x - x) * math.cos(alpha) + (bed.z - z) * math.sin(alpha)
        if travel >= scene["displacement_criterion"] * scene["d_m"]:
            return True
        energy = scene["mass_kg"] * (bed.vx**2 + bed.vz**2) / 2
        if energy < min(before, REST * scene["weight_n"] * scene["d_m"]):
            return False  # at rest
        before = energy
    return False


def pivot(scene, case):
    """Bisect among the load steps; each trial starts from rest in the last that did not move it."""
    grains, load_steps = table(case / "grains.csv"), table(case / "load_steps.csv")
    low, high = 1, len(load_steps) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if moves(scene, grains, (load_steps[0], load_steps[low]), load_steps[middle]):
            high = middle
        else:
            low = middle
    ustar = math.sqrt(
        float(load_steps[low]["ustar_m_s"]) * float(load_steps[high]["ustar_m_s"])
    )
    return lambda quantity, at: ustar


def passing(scene, case):
    """A grain is let rest, then pushed: when has it passed the displacement criterion?"""
    bed, unit = Bed(scene, table(case / "grains.csv")), scene["time_unit_s"]
    for _ in range(int(10 * unit / bed.dt)):
        bed.step(0.0, 0.0)
    x, steps = bed.x, 0
    while bed.x - x < scene["displacement_criterion"] * scene["d_m"]:
        bed.step(scene["force_n"], 0.0)
        steps += 1
    return lambda quantity, at: steps * bed.dt / unit


def pile(scene, case):
    """Each grain alone under the stress, or of a poured bed the force, that the scene gives it."""
    counted = [g for g in table(case / "grains.csv") if g["kind"] == "counted"]
    grains = [(float(g["ustar_over_ustar0"]), float(g["slope_deg"])) for g in counted]
    load_steps = table(case / "load_steps.csv")
    if scene["packing"] != "poured":
        return alone(scene, grains, load_steps)
    steps = zip(poured_pivots(scene, case, counted), grains, strict=True)
    order = [(float(load_steps[n]["ustar0_m_s"]), r**2) for n, (r, _) in steps if n]
    return counts(scene, sorted(order), len(grains), load_steps)


def poured_pivots(scene, case, counted):
    """The load step in which the force on each grain turns it over its own foremost contact."""
    discs = [
        (float(g["x_m"]), float(g["z_m"]), float(g["d_m"]) / 2)
        for g in table(case / "grains.csv")
    ]
    forces = {}
    for row in table(case / "forces.csv"):
        forces.setdefault(row["id"], []).append(
            (float(row["fx_n"]), float(row["fz_n"]))
        )
    for grain in counted:
        side = math.copysign(1.0, float(grain["ustar_over_ustar0"]))
        here, weight = discs[int(grain["id"]) - 1], grain_weight(scene, grain)
        lean = foremost(here, discs, side)
        yield first_of(
            lean is None
            or fx * side * math.cos(lean) + (fz - weight) * math.sin(lean) >= 0
            for fx, fz in forces[grain["id"]]
        )


def foremost(here, discs, side):
    """Angle of the contact farthest round towards where the flow goes, from straight below."""
    x, z, radius = here
    near = [
        math.atan2(side * (a - x), z - b)
        for a, b, r in discs
        if 0 < math.hypot(a - x, b - z) < TOUCH * (radius + r)
    ]
    return max(near, default=None)


def grain_weight(scene, grain):
    """Submerged weight of a grain of any size, N."""
    return scene["weight_n"] * (float(grain["d_m"]) / scene["d_m"]) ** 3


def first_of(goes):
    """The first load step in which a grain goes; none for never. In the settling none does."""
    return next((step for step, does in enumerate(goes) if step and does), None)


def alone(scene, grains, load_steps):
    """A grain moves when its own stress reaches the threshold of one grain.

    `grains` are the counted ones: the u*/u*_0 that each feels, and the slope of its bed in degrees.
    """
    found = {}  # grains on one slope have one threshold
    order = []
    for ratio, slope in grains:
        # flow that runs back pushes the grain the other way, on a slope of the other sign
        slope = math.copysign(1.0, ratio) * round(slope, 9)
        if slope not in found:
            found[slope] = threshold(scene, slope)
        if ratio:
            order.append((found[slope] / abs(ratio), ratio**2))
    return counts(scene, sorted(order), len(grains), load_steps)


def counts(scene, order, total, load_steps):
    """The answers for a number of grains, of which those that go have a flow and a stress each."""
    flow = [float(row["ustar0_m_s"]) for row in load_steps]
    moved = [sum(own <= u for own, _ in order) for u in flow]
    excess = (
        (scene["rho_sol_kg_m3"] - scene["rho_f_kg_m3"]) * scene["g_m_s2"] * scene["d_m"]
    )

    def first(fraction):
        need = max(math.ceil(fraction * total - 1e-9), 1)
        level = next((i for i, n in enumerate(moved) if n >= need), len(moved) - 1)
        return level, math.sqrt(flow[level - 1] * flow[level])

    def shields(fraction):
        level, ustar0 = first(fraction)
        mean = sum(stress for _, stress in order[: moved[level]]) / max(moved[level], 1)
        return scene["rho_f_kg_m3"] * ustar0**2 * mean / excess

    answers = {
        "moved": lambda at: moved[int(at)],
        "not_moved": lambda at: total - moved[int(at)],
        "count": lambda at: total,
        "carried_off": lambda at: 0,
        "ustar0_m_s": lambda at: first(float(at))[1],
        "shields": lambda at: shields(float(at)),
    }
    return lambda quantity, at: answers[quantity](at)


KINDS = {
    "closed-form": closed_form,
    "collision": collision,
    "incline": incline,
    "sliding": sliding,
    "pivot": pivot,
    "passing": passing,
    "pile": pile,
}


def table(path):
    """The rows of a CSV file, as dictionaries of texts."""
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def write(case, out, answer):
    """Write the answer to each question of a scene."""
    with out.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["quantity", "at", "value"])
        for asked in table(case / "ask.csv"):
            quantity, at = asked["quantity"], asked["at"]
            writer.writerow([quantity, at, repr(float(answer(quantity, at)))])


def main(case, out):
    """Answer one scene."""
    scene = json.loads((case / "scene.json").read_text())
    if scene["kind"] not in KINDS:
        print(f"this solver does not know the kind {scene['kind']}", file=sys.stderr)
        return 2
    write(case, out, KINDS[scene["kind"]](scene, case))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
