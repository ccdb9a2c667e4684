"""The numbers of decks by the equations, with nothing of the program but what it wrote."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

from orchestrator.bed import deck
from orchestrator.bed.deck import COUNTED, FIXED, GrainTable
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.pile_case import PileCase
from orchestrator.runs.case import templates
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

D, RHO_S, RHO_F, NU, G, PHI = 4e-4, 2650.0, 1000.0, 1e-6, 9.81, 33.0
"""Grains of quartz in water: buoyancy is a third of what it is not in air."""
Z0 = D / 10
SLOPE, BETA = 20.0, 60.0
LIFT = 1.615
FIRST, STEP = 0.9, 0.05
"""The first load step over the least threshold, and the rise from one to the next."""
WATER = f"""
fluid = {{ density = {RHO_F}, viscosity = {NU} }}
forces = {{ law = "low" }}
threshold.criterion = "entrained"
method.kind = "dem"
method.grains.load_increment = {STEP}
"""
GRAIN = f"diameter = {D}, density = {RHO_S}, friction_angle_deg = {PHI}"
Sets = dict[int, float]


def scenes(text: str) -> tuple[Scene, ...]:
    return tuple(study.parse(WATER + text, name="one", where="test").scenes)


def eq_2(ustar: float, d: float = D) -> tuple[float, float]:
    """Drag and lift of Eq. 2 on a grain whose gap is z0, a tenth of its diameter."""
    shear = ustar**2 / NU
    speed = shear * (d / 2 + d / 10)
    drag = 3 * math.pi * NU * RHO_F * d * speed
    return drag, LIFT * RHO_F * math.sqrt(NU) * d**2 * speed * math.sqrt(shear)


def weight(d: float = D) -> float:
    return math.pi / 6 * d**3 * (RHO_S - RHO_F) * G


def parameters(folder: Path) -> dict[str, float]:
    """The variables of a deck that are numbers."""
    lines = (folder / "parameters.liggghts").read_text().splitlines()
    words = [line.split() for line in lines]
    return {word[1]: float(word[3]) for word in words if word[2] == "equal"}


def numbers(path: Path) -> list[float]:
    return [float(line) for line in path.read_text().split()]


def sets(path: Path) -> list[Sets]:
    """The sets of a file of LIGGGHTS: values by the ids of grains."""
    lines = path.read_text().splitlines()
    found = []
    while lines:
        count = int(lines[0])
        rows = [line.split() for line in lines[1 : 1 + count]]
        found.append({int(number): float(value) for number, value in rows})
        lines = lines[1 + count :]
    return found


@pytest.fixture(scope="module")
def pile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The deck of a pile under u* = u*_0 everywhere."""
    folder = tmp_path_factory.mktemp("pile")
    bed = f'kind = "pile", slope_deg = {SLOPE}, height = {12 * D}, roughness = "d/10"'
    text = f"grain = {{ {GRAIN} }}\nbed = {{ {bed} }}\n"
    (scene,) = scenes(f'method.flow.model = "flat"\n{text}')
    PileCase(scene).write(folder, folder)
    return folder


def test_a_deck_has_the_grains_of_the_scene_under_their_submerged_weight(
    pile: Path,
) -> None:
    """The whole weight in water would be 1.6 times it."""
    found = parameters(pile)
    assert found["gravity"] == pytest.approx(G * (RHO_S - RHO_F) / RHO_S, rel=1e-8)
    assert found["diameter"] == D
    assert found["density"] == RHO_S
    assert found["friction"] == pytest.approx(0.649407593, rel=1e-8)  # tan 33 deg
    assert found["displacement_criterion"] == 0.3
    assert found["slope"] == pytest.approx(SLOPE, rel=1e-8)
    mass = math.pi / 6 * D**3 * found["density"]
    assert mass * found["gravity"] == pytest.approx(weight(), rel=1e-8)


def test_load_steps_rise_from_below_the_first_threshold(pile: Path) -> None:
    settling, *rising = numbers(pile / "load_steps.txt")
    assert rising[0] / settling == pytest.approx(math.sqrt(2), rel=1e-8)
    ratios = np.divide(rising[1:], rising[:-1])
    assert ratios == pytest.approx(1 + STEP, rel=1e-8)
    # the pivot on the windward side, f_d sin(beta) + f_l cos(beta) = W cos(alpha - beta);
    # the uppermost grain, which goes first, needs half a per cent less
    drag, lift = eq_2(rising[0] / FIRST)
    beta, lean = math.radians(BETA), math.radians(SLOPE - BETA)
    moment = drag * math.sin(beta) + lift * math.cos(beta)
    assert 0.99 < moment / (weight() * math.cos(lean)) < 1.0


def test_each_load_step_has_the_forces_of_its_own_flow_along_the_face(
    pile: Path,
) -> None:
    """Drag up the face, lift from it: at another load step, or exchanged, they are off."""
    flows = numbers(pile / "load_steps.txt")
    along_x, along_z = (sets(pile / f"force.{axis}.txt") for axis in "xz")
    assert len(along_x) == len(along_z) == len(flows) > 5
    (way_x,), (way_z,) = (sets(pile / f"along.{axis}.txt") for axis in "xz")
    assert len(way_x) > 10
    cosine, sine = math.cos(math.radians(SLOPE)), math.sin(math.radians(SLOPE))
    for number in way_x:
        assert (way_x[number], way_z[number]) == pytest.approx((cosine, sine), rel=1e-8)
    for flow, x, z in zip(flows, along_x, along_z, strict=True):
        drag, lift = eq_2(flow)
        force = (drag * cosine - lift * sine, drag * sine + lift * cosine)
        for number in way_x:
            assert (x[number], z[number]) == pytest.approx(force, rel=1e-7)


def test_single_grains_feel_the_forces_over_their_own_weight(tmp_path: Path) -> None:
    """The deck has one reference grain: forces over weight are those of each scene."""
    sizes = (1e-4, 4e-4)
    bed = f'kind = "grain", slope_deg = {SLOPE}, entrainment_angle_deg = {BETA}'
    text = f'grain.density = {RHO_S}\n[axes]\n"grain.diameter" = {list(sizes)}\n'
    asked = scenes(f'bed = {{ {bed}, roughness = "d/10" }}\n{text}')
    SingleGrainCase(asked).write(tmp_path, tmp_path)
    found = parameters(tmp_path)
    reference = math.pi / 6 * found["diameter"] ** 3 * found["density"]
    reference *= found["gravity"]
    assert found["density"] / found["gravity"] != pytest.approx(RHO_S / G, rel=0.01)
    rising = np.array(numbers(tmp_path / "load_steps.txt"))
    along_x, along_z = (sets(tmp_path / f"force.{axis}.txt") for axis in "xz")
    cosine, sine = math.cos(math.radians(SLOPE)), math.sin(math.radians(SLOPE))
    for place, d in enumerate(sizes):
        number = 3 * place + 3
        # u* is told over that of the closed form, where the moments balance
        least = _closed_form(d)
        for flow, x, z in zip(rising.tolist(), along_x, along_z, strict=True):
            drag, lift = eq_2(flow * least, d)
            force = np.array([drag * cosine - lift * sine, drag * sine + lift * cosine])
            told = np.array([x[number], z[number]])
            assert told / reference == pytest.approx(force / weight(d), rel=1e-6)


def _closed_form(d: float) -> float:
    """u* at which the moments of Eq. 2 and of the weight balance, by halving."""
    beta, lean = math.radians(BETA), math.radians(SLOPE - BETA)
    low, high = 1e-6, 10.0
    for _ in range(200):
        middle = math.sqrt(low * high)
        drag, lift = eq_2(middle, d)
        enough = drag * math.sin(beta) + lift * math.cos(beta)
        if enough < weight(d) * math.cos(lean):
            low = middle
        else:
            high = middle
    return low


def test_displacement_is_one_in_the_grains_own_diameter(tmp_path: Path) -> None:
    sizes = np.array([1.0, 0.5, 2.0, 1.5])
    along = np.tile([0.8, 0.6], (4, 1))
    grains = GrainTable(
        position=D * np.column_stack([3.0 * np.arange(4), np.zeros(4), np.zeros(4)]),
        kind=np.array([FIXED, COUNTED, COUNTED, COUNTED]),
        along=along,
        sizes=sizes,
        diameter=D,
        density=RHO_S,
    )
    flows = np.array([0.1, 0.2, 0.3])
    force = np.arange(24.0).reshape(3, 4, 2)
    deck.write_deck(tmp_path, grains, {"diameter": D}, flows, force, margin=D)
    for place, axis in enumerate("xz"):
        (way,) = sets(tmp_path / f"along.{axis}.txt")
        assert way == {
            number: pytest.approx(along[0, place] / sizes[number - 1])
            for number in (2, 3, 4)
        }
        told = sets(tmp_path / f"force.{axis}.txt")
        assert told == [
            {number: force[step, number - 1, place] for number in (2, 3, 4)}
            for step in range(3)
        ]
    assert _diameters(tmp_path) == pytest.approx(D * sizes)


def _diameters(folder: Path) -> FloatArray:
    """Diameters of the grains of a deck, by their ids."""
    _, atoms = (folder / "grains.data").read_text().split("Atoms\n\n")
    rows = np.array([line.split() for line in atoms.splitlines()], float)
    return np.asarray(rows[np.argsort(rows[:, 0]), 2])


def test_a_threshold_by_hand_lies_between_two_flows(tmp_path: Path) -> None:
    """It is the mean of the flow before the motion and of that of the motion."""
    atoms = "".join(f"{number} 3 4e-4 2650 0 0 0\n" for number in range(1, 11))
    (tmp_path / "grains.data").write_text(f"10 atoms\n\nAtoms\n\n{atoms}11 1 4e-4\n")
    (tmp_path / "load_steps.txt").write_text("0.05\n0.1\n0.2\n0.3\n")
    head = "load_step,flow,step,lying,fallen,ke\n"
    rows = "1,0.1,5,10,0,0\n2,0.2,9,8,0,0\n2,0.2,12,7,0,0\n3,0.3,20,4,0,0\n"
    (tmp_path / "samples.csv").write_text(head + rows)
    script = templates() / "liggghts" / "bed" / "thresholds.awk"
    words = ["awk", "-v", "table=counted.csv", "-f", str(script)]
    files = ["grains.data", "load_steps.txt", "FS=,", "samples.csv"]
    told = subprocess.run(
        [*words, *files], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    lines = told.stdout.splitlines()
    # a reader who compares is told why the page of a study may have other numbers
    assert "sustained motion" in " ".join(lines[4:])
    assert lines[:4] == [
        "n/N = 10 % at u*_0 0.1414 m/s (0.1 ... 0.2)",
        "n/N = 30 % at u*_0 0.1414 m/s (0.1 ... 0.2)",
        "n/N = 50 % at u*_0 0.2449 m/s (0.2 ... 0.3)",
        "n/N = 70 %: not reached, 6 of 10 had moved",
    ]
    assert (tmp_path / "counted.csv").read_text().splitlines()[1:] == [
        "0,0.05,0,10", "1,0.1,0,10", "2,0.2,3,7", "3,0.3,6,4",
    ]  # fmt: skip
