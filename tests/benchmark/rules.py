"""The counting rule of docs/benchmark.md, level 4, as a reader of that page alone writes it.

Nothing here imports the package: it reads the directory of a scene and applies the rules to
what the grains of any run did.
"""

import csv
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple


class State(NamedTuple):
    """A grain at a sample: its centre, m, and its velocity, m/s."""

    x: float
    z: float
    vx: float
    vz: float


Frame = Mapping[int, State]
"""The mobile grains that are there at a sample, by their ids."""


def table(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


class Grain(NamedTuple):
    """A grain of a scene; `ratio` is u*/u*_0."""

    x: float
    z: float
    d: float
    kind: str
    slope: float
    ratio: float

    @property
    def along(self) -> tuple[float, float]:
        """The unit vector of rule 3."""
        sign = -1.0 if self.ratio < 0 else 1.0
        return sign * math.cos(self.slope), sign * math.sin(self.slope)


class Bed:
    """A scene of level 4, and what its entries say of the rules."""

    def __init__(self, folder: Path) -> None:
        self.scene: dict[str, Any] = json.loads((folder / "scene.json").read_text())
        self.grains: dict[int, Grain] = {}
        for row in table(folder / "grains.csv"):
            slope = math.radians(float(row["slope_deg"] or 0))
            ratio = float(row["ustar_over_ustar0"] or 0)
            place = float(row["x_m"]), float(row["z_m"]), float(row["d_m"])
            self.grains[int(row["id"])] = Grain(*place, row["kind"], slope, ratio)
        self.load_steps = [
            float(row["ustar0_m_s"]) for row in table(folder / "load_steps.csv")
        ]
        self.given = None
        if (folder / "forces.csv").exists():
            self.given = table(folder / "forces.csv")

    @property
    def counted(self) -> list[int]:
        """The ids of the counted grains."""
        return [
            number for number, grain in self.grains.items() if grain.kind == "counted"
        ]

    @property
    def roof(self) -> tuple[float, float, float]:
        """Slope (radians) and ridge (m) of rule 5."""
        scene = self.scene
        if "roof_slope_deg" in scene:
            slope = math.radians(scene["roof_slope_deg"])
            return slope, float(scene["roof_x_m"]), float(scene["roof_z_m"])
        alpha = math.radians(scene["alpha_deg"])
        height = scene["h_m"] + 3.5 * scene["d_m"] / math.cos(alpha)
        return alpha, scene["h_m"] / math.tan(alpha), height

    @property
    def behind(self) -> float:
        """The x (m) of rule 5 behind which no grain is left."""
        mobile = [grain.x for grain in self.grains.values() if grain.kind != "fixed"]
        return max(mobile) + 10 * float(self.scene["d_m"])

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and largest x and z of rule 5, m."""
        x = [grain.x for grain in self.grains.values()]
        z = [grain.z for grain in self.grains.values()]
        margin = 3 * self.scene["d_m"]
        return min(x) - margin, max(x) + margin, min(z) - margin, max(z) + margin

    def mass(self, number: int) -> float:
        """Mass of a grain, kg."""
        ratio = self.grains[number].d / self.scene["d_m"]
        return float(self.scene["mass_kg"]) * float(ratio) ** 3

    def force(self, number: int, load_step: int, law: Any) -> tuple[float, float]:
        """The force of the flow on a grain, N; `law` gives drag and lift at a u*."""
        grain = self.grains[number]
        if grain.kind not in ("counted", "pushed"):
            return 0.0, 0.0
        if self.given is not None:
            for row in self.given:
                if (int(row["load_step"]), int(row["id"])) == (load_step, number):
                    return float(row["fx_n"]), float(row["fz_n"])
            return 0.0, 0.0
        if grain.ratio == 0:
            return 0.0, 0.0
        drag, lift = law(self.scene, abs(grain.ratio) * self.load_steps[load_step])
        drag = math.copysign(drag, grain.ratio)
        x, z = math.cos(grain.slope), math.sin(grain.slope)
        return drag * x - lift * z, drag * z + lift * x


class Sample(NamedTuple):
    """What the rules say of a sample."""

    load_step: int
    """Its load step, from 1."""
    lying: int
    """How many counted grains have not moved."""
    gone: set[int]
    """The grains that rule 5 takes away after it."""
    energy: float
    """The energy of rule 7, J."""
    ends: str
    """By what the load step ends: "moved", "waited", "rest", or empty."""


class Count:
    """The rules applied to the samples of a run, in turn."""

    def __init__(self, bed: Bed, settled: Frame) -> None:
        """Begin with the grains at the end of the settling."""
        self.bed, self.place = bed, settled
        self.passed: set[int] = set()
        self.moved_in: dict[int, int] = {}
        self.carried: set[int] = set()
        self.load_step, self.first, self.quiet, self.energy = 1, True, 0, 0.0

    def displacement(self, number: int, state: State) -> float:
        """Rule 3, of a counted grain, in its own diameters."""
        grain, place = self.bed.grains[number], self.place[number]
        x, z = grain.along
        return ((state.x - place.x) * x + (state.z - place.z) * z) / grain.d

    def sample(self, frame: Frame) -> Sample:
        """Apply the rules to the next sample."""
        bed, scene = self.bed, self.bed.scene
        # rule 7: before the passages of this sample are noted
        energy = 0.0
        for number, state in frame.items():
            if number not in self.passed:
                energy += bed.mass(number) * (state.vx**2 + state.vz**2) / 2
        # rules 3, 4 and 6
        newly = 0
        for number in bed.counted:
            if number in frame:
                is_passing = (
                    self.displacement(number, frame[number])
                    >= scene["displacement_criterion"]
                )
                if is_passing:
                    self.passed.add(number)
            if number not in self.moved_in and (
                number not in frame or number in self.passed
            ):
                newly += 1
                self.moved_in[number] = self.load_step
                if number not in frame:
                    self.carried.add(number)
        lying = len(bed.counted) - len(self.moved_in)
        # rule 7
        self.quiet = 0 if newly else self.quiet + 1
        is_low = energy < 1e-6 * scene["weight_n"] * scene["d_m"]
        ends = ""
        if lying == 0:
            ends = "moved"
        elif not self.first and not newly and is_low and energy < self.energy:
            ends = "rest"
        elif self.quiet >= math.floor(2 * scene["waiting_time"] + 0.5):
            ends = "waited"
        found = Sample(self.load_step, lying, self._gone(frame), energy, ends)
        self.first, self.energy = False, energy
        if ends:
            self.load_step += 1
            self.first, self.quiet = True, 0
        return found

    def _gone(self, frame: Frame) -> set[int]:
        """Rule 5, but for the box, which acts at any time."""
        slope, ridge_x, ridge_z = self.bed.roof
        gone = set()
        for number, state in frame.items():
            is_over = state.z > ridge_z - abs(state.x - ridge_x) * math.tan(slope)
            is_far = False
            if self.bed.grains[number].kind == "counted":
                is_far = self.displacement(number, state) > 10
            if is_over or is_far or state.x > self.bed.behind:
                gone.add(number)
        return gone


def settled_after(bed: Bed, energies: list[float]) -> int:
    """Rule 1: after how many looks, T/2 apart, load step 0 ends, from the energy at each, J."""
    scene = bed.scene
    spring = scene["stiffness"] * scene["weight_n"] / scene["d_m"]
    mobile = sum(grain.kind != "fixed" for grain in bed.grains.values())
    most = 0.01 * scene["weight_n"] ** 2 / spring * mobile
    calm = 0
    for look, energy in enumerate(energies, 1):
        calm = calm + 1 if energy < most else 0
        if look >= 20 and calm >= 5:
            return look
    return 800


def answers(bed: Bed, moved_in: Mapping[int, int], carried: Iterable[int]) -> Any:
    """The answer to a question of level 4, a function of quantity and at."""
    total = len(bed.counted)

    def moved(load_step: int) -> list[int]:
        return [number for number, step in moved_in.items() if 0 < step <= load_step]

    def answer(quantity: str, at: str) -> float:
        if quantity == "moved":
            return len(moved(int(at)))
        if quantity == "not_moved":
            return total - len(moved(int(at)))
        if quantity == "carried_off":
            return len({*moved(int(at))} & {*carried})
        needed = max(math.ceil(float(at) * total - 1e-9), 1)
        steps = range(1, len(bed.load_steps))
        reached = [step for step in steps if len(moved(step)) >= needed]
        step = reached[0] if reached else steps[-1]
        ustar0 = math.sqrt(bed.load_steps[step - 1] * bed.load_steps[step])
        if quantity == "ustar0_m_s":
            return ustar0
        scene = bed.scene
        ratios = [bed.grains[number].ratio for number in moved(step)]
        tau = sum(
            scene["rho_f_kg_m3"] * (ustar0 * ratio) ** 2 for ratio in ratios
        ) / len(ratios)
        excess = (scene["rho_sol_kg_m3"] - scene["rho_f_kg_m3"]) * scene["g_m_s2"]
        return float(tau / (excess * scene["d_m"]))

    return answer


class Packed(NamedTuple):
    """The grains of a triangle: centres in diameters, by kind."""

    counted: set[tuple[float, float]]
    pushed: set[tuple[float, float]]
    mobile: set[tuple[float, float]]
    fixed: set[tuple[float, float]]


def packed(scene: Mapping[str, Any]) -> Packed:
    """The packing of level 5 over a triangle, ``aligned`` or ``horizontal``.

    Of the fixed grains all that fill the triangle are given.
    """
    d = scene["d_m"]
    alpha, beta = math.radians(scene["alpha_deg"]), math.radians(scene["beta_deg"])
    height, over = scene["h_m"] / d, 0.5 + scene["z0_m"] / d
    crest = height / math.tan(alpha)
    slope = alpha if scene["packing"] == "aligned" else 0.0
    way = math.cos(slope), math.sin(slope)
    first = crest, height + over / math.cos(alpha)
    most = int(2 * (height + crest) / math.sin(beta)) + 10

    def below(x: float, z: float) -> tuple[float, float]:
        """How deep a centre lies below the lines of the uppermost ones, windward and lee."""
        windward = x * math.sin(alpha) - z * math.cos(alpha) + over
        lee = (2 * crest - x) * math.sin(alpha) - z * math.cos(alpha) + over
        return windward, lee

    centres = []
    for row in range(most):
        for place in range(-most, most):
            along = (2 * place + row % 2) * math.cos(beta)
            down = row * math.sin(beta)
            x = first[0] + along * way[0] + down * way[1]
            z = first[1] + along * way[1] - down * way[0]
            if min(below(x, z)) > -1e-6 and z > over - 1e-6:
                centres.append((x, z))
    found = Packed(set(), set(), set(), set())
    layers = (scene["mobile_layers"] - 0.5) * math.sin(beta)
    for x, z in centres:
        is_windward = x < crest + 1e-6
        tangent = (
            math.cos(alpha),
            math.sin(alpha) if is_windward else -math.sin(alpha),
        )
        is_exposed = True
        for other_x, other_z in centres:
            dx, dz = other_x - x, other_z - z
            aside = abs(dx * tangent[0] + dz * tangent[1])
            higher = dz * tangent[0] - dx * tangent[1]
            if aside < 0.5 + 1e-6 and higher > 1e-6:
                is_exposed = False
        is_mobile = below(x, z)[0] < layers or (is_windward and is_exposed)
        kind = found.fixed
        if is_mobile:
            kind = found.mobile
            if is_exposed:
                kind = found.counted if is_windward else found.pushed
        kind.add((x, z))
    return found
