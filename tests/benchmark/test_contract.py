"""What docs/benchmark.md says is what the decks do: read by itself, it gives the same counts."""

import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed import deck
from orchestrator.bed.deck import GrainTable
from orchestrator.benchmark import pack, scenes
from orchestrator.flow.stress import WallStress
from orchestrator.grains import motion
from orchestrator.grains.geometry import Geometry
from orchestrator.runs.case import templates
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import study
from tests.benchmark.conftest import NATIVE, ROOT
from tests.benchmark.rules import (
    Bed,
    Count,
    Frame,
    Sample,
    State,
    answers,
    packed,
    settled_after,
)

sys.path[:0] = [str(NATIVE), str(NATIVE.parent)]
import door  # type: ignore[import-not-found]  # noqa: E402
import solver  # type: ignore[import-not-found]  # noqa: E402

KINDS = {"fixed": 1, "mobile": 2, "counted": 3, "pushed": 4}
"""Kinds of grains in a scene, and their types in the deck."""
COLUMNS = ("id", "x", "z", "vx", "vz")
ANCHOR = "dump            passage counted"
"""Line of the deck before which all mobile grains are dumped at each sample, too."""
MORE = f"""dump            every mobile custom ${{sampling_steps}} every.dump {" ".join(COLUMNS)}
dump_modify     every sort id format "%d %.17g %.17g %.17g %.17g"
"""


def _case_of(root: Path) -> tuple[Bed, Path]:
    """The scene of level 4 of a pack, and the directory of the run that answered it."""
    (folder,) = root.glob("scenes/4-*")
    (case,) = root.parent.glob("study/cases/pile-*")
    return Bed(folder), case


def _parameters(case: Path) -> dict[str, float]:
    """The variables of a deck."""
    text = (case / "parameters.liggghts").read_text()
    found = re.findall(r"^variable\s+(\w+) equal (\S+)", text, re.MULTILINE)
    return {name: float(value) for name, value in found}


def _sets(path: Path) -> list[dict[int, float]]:
    """The sets of values by grain in a file of the deck."""
    lines = path.read_text().split("\n")
    found = []
    at = 0
    while at < len(lines) and lines[at]:
        count = int(lines[at])
        rows = [line.split() for line in lines[at + 1 : at + 1 + count]]
        found.append({int(number): float(value) for number, value in rows})
        at += 1 + count
    return found


@pytest.mark.parametrize("name", ["all_levels", "lift_off", "level_rows", "poured"])
def test_a_scene_says_all_that_its_deck_has(
    name: str, request: pytest.FixtureRequest
) -> None:
    """Roof, ends of the box, forces, directions, times: from the scene by the page alone."""
    bed, case = _case_of(request.getfixturevalue(name))
    scene, values = bed.scene, _parameters(case)
    d, near = scene["d_m"], 1e-6 * scene["d_m"]
    slope, x, z = bed.roof
    assert math.radians(values["slope"]) == pytest.approx(slope, abs=1e-8)
    assert values["ceiling_x"] == pytest.approx(x, abs=near)
    assert values["ceiling_z"] == pytest.approx(z, abs=near)
    assert values["behind"] == pytest.approx(bed.behind, abs=near)
    box = re.findall(r"(\S+) (\S+) [xz]lo", (case / "grains.data").read_text())
    ends = [float(end) for pair in box for end in pair]
    assert ends == pytest.approx(bed.box, abs=near)
    assert values["diameter"] == d
    assert values["density"] == pytest.approx(scene["rho_sol_kg_m3"])
    assert values["gravity"] == pytest.approx(scene["reduced_gravity_m_s2"])
    assert values["friction"] == pytest.approx(math.tan(math.radians(scene["phi_deg"])))
    unit = math.sqrt(d / scene["reduced_gravity_m_s2"])
    assert scene["time_unit_s"] == pytest.approx(unit)
    assert scene["spring_n_m"] == pytest.approx(
        values["stiffness"] * scene["weight_n"] / d
    )
    for entry in (
        "stiffness",
        "damping",
        "time_step",
        "waiting_time",
        "displacement_criterion",
    ):
        assert values[entry] == pytest.approx(scene[entry])
    settle_drag = values["settle_drag"] * scene["mass_kg"] / unit
    assert scene.get("settle_drag_kg_s", 0.0) == pytest.approx(settle_drag)
    # the numbers of the rules
    assert (values["settle"], values["sampling_interval"]) == (10.0, 0.5)
    assert (values["rest_energy"], values["away"]) == (1e-6, 10.0)
    assert (values["noise"], values["most_settle"]) == (0.01, 400.0)

    flows = np.loadtxt(case / "load_steps.txt")
    assert bed.load_steps == pytest.approx(flows[: len(bed.load_steps)])
    for axis, place in (("x", 0), ("z", 1)):
        (along,) = _sets(case / f"along.{axis}.txt")
        assert sorted(along) == bed.counted
        for number, value in along.items():
            grain = bed.grains[number]
            assert value == pytest.approx(grain.along[place] * d / grain.d, abs=1e-8)
        forces = _sets(case / f"force.{axis}.txt")
        for load_step in (0, 1, len(bed.load_steps) - 1):
            for number, value in forces[load_step].items():
                force = bed.force(number, load_step, solver.forces)[place]
                assert value == pytest.approx(
                    force, rel=1e-6, abs=1e-7 * scene["weight_n"]
                )


def _rerun(case: Path, folder: Path) -> Iterator[Frame]:
    """Run a deck again, and give every mobile grain at the end of settling and each sample."""
    text = (folder / "in.bed").read_text()
    assert text.count(ANCHOR) == 1
    (folder / "in.bed").write_text(text.replace(ANCHOR, MORE + ANCHOR))
    command = ". ./liggghts.sh && solve in.bed >log.liggghts 2>&1"
    subprocess.run(["sh", "-c", command], cwd=folder, check=True)
    if case != folder:
        again, before = (
            (place / motion.SAMPLES).read_bytes() for place in (folder, case)
        )
        assert again == before
    steps, rows = ENGINE.read_frames(folder / "every.dump", COLUMNS)
    frames = dict(iter(rows.groupby("step")))
    for step in steps.tolist():
        columns = (frames[step][name].tolist() for name in COLUMNS)
        listed = zip(*columns, strict=True)
        yield {int(number): State(*state) for number, *state in listed}


def _judged(bed: Bed, case: Path, folder: Path) -> tuple[Count, list[Sample]]:
    """Apply the rules to the samples of a run, and see that the deck did as they say."""
    frames = list(_rerun(case, folder))
    settling = pd.read_csv(folder / motion.SETTLING)
    assert len(settling) == settled_after(bed, settling["ke"].tolist())
    count = Count(bed, frames[0])
    samples = [count.sample(frame) for frame in frames[1:]]
    table = pd.read_csv(folder / motion.SAMPLES)
    assert [one.load_step for one in samples] == table["load_step"].tolist()
    assert [one.lying for one in samples] == table["lying"].tolist()
    left, right, low, high = bed.box
    for sample, frame, after in zip(samples, frames[1:], frames[2:], strict=False):
        missing = frame.keys() - after.keys()
        assert sample.gone <= missing
        for number in missing - sample.gone:
            # it was beyond the box within the next T/2
            state = frame[number]
            time = bed.scene["time_unit_s"]
            reach = 2 * math.hypot(state.vx, state.vz) * time + 2 * bed.scene["d_m"]
            x = min(state.x - left, right - state.x)
            z = min(state.z - low, high - state.z)
            assert min(x, z) < reach
    return count, samples


@pytest.mark.parametrize("name", ["all_levels", "lift_off", "level_rows", "poured"])
def test_the_rules_count_what_the_deck_counts(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Load steps end, grains move and are taken away at the same samples; answers are alike."""
    root = request.getfixturevalue(name)
    bed, case = _case_of(root)
    shutil.copytree(case, tmp_path / "case")
    count, samples = _judged(bed, case, tmp_path / "case")
    ends = {one.ends for one in samples}
    # of a poured bed grains may rock to the end of the waiting time in every load step
    assert ends & ({"rest", "waited"} if name == "poured" else {"rest"})
    table = pd.read_csv(case / motion.MOTION)
    moved_in = {
        one: step
        for one, step in zip(table["id"], table["moved_in"], strict=True)
        if step
    }
    assert count.moved_in == moved_in
    assert count.carried == set(table.loc[table["carried_off"] == 1, "id"])
    answer = answers(bed, count.moved_in, count.carried)
    chosen = pack.read_pack(root)
    asked = chosen.expected[chosen.expected["scene"] == bed.scene["scene"]]
    for row in asked.to_dict("records"):
        value = answer(row["quantity"], row["at"])
        assert value == pytest.approx(row["value"], rel=1e-7), row["quantity"]


D = 1e-3
"""Diameter of the grains below, m."""
UP = math.sin(math.pi / 3)
"""Height of a grain in the pocket of two that touch, d."""
ROWS = {
    # kind, ratio, the fixed grains under it (x, d), and the force in each load step (W)
    "passes downstream": ("counted", 1.0, range(0, 16), (0.1, 0.1, 1.2, 1.2)),
    "passes upstream": ("counted", -1.0, range(-3, 2), (-0.1, -1.2, -1.2, -1.2)),
    "goes upstream, ratio 0": ("counted", 0.0, range(-3, 2), (0.0, 0.0, -1.2, -1.2)),
    "is blocked upstream": ("counted", 1.0, range(-1, 2), (0.0, -1.2, -1.2, -1.2)),
    "lies": ("counted", 1.0, range(0, 2), (0.1, 0.1, 0.1, 0.1)),
    "is lifted": ("counted", 1.0, range(0, 2), (0.0, 0.0, 0.0, 0.0)),
    "is pushed": ("pushed", 1.0, range(0, 18), (0.0, 0.0, 4.0, 4.0)),
}
"""One grain of each case, each on a row of its own."""
LIFT = 3.0  # W, on the grain that is lifted, from load step 3 on
APART = 40.0  # from row to row, d


def _cases(folder: Path) -> Bed:
    """Write a scene with one grain of each case; forces are given, so none is of a law."""
    folder.mkdir()
    gravity, density = 9.81, 2500.0
    mass = density * math.pi / 6 * D**3
    weight = mass * gravity
    grains: list[tuple[float, float, str, float | str, float | str]] = []
    forces = []
    for number, (name, (kind, ratio, row, push)) in enumerate(ROWS.items()):
        foot = APART * number
        for place in row:
            grains.append((foot + place - 0.5, 0.0, "fixed", "", ""))
        if name == "is blocked upstream":
            grains.append((foot - 1.0, 1.3, "fixed", "", ""))
        grains.append((foot, UP, kind, 0.0, ratio))
        for load_step, force in enumerate((0.0, *push)):
            lift = LIFT if name == "is lifted" and load_step >= 3 else 0.0
            forces.append((load_step, len(grains), force * weight, lift * weight))
        if name == "is pushed":
            # a grain that is not exposed is pushed along before it
            grains.append((foot + 1.0, UP, "mobile", "", ""))
    # LIGGGHTS reads values by id up to the largest that is there: it is one that stays
    grains.append((-APART / 2, 0.0, "fixed", "", ""))
    columns = ["x_m", "z_m", "kind", "slope_deg", "ustar_over_ustar0"]
    table = pd.DataFrame(grains, columns=columns)
    table[["x_m", "z_m"]] *= D
    table.insert(0, "id", range(1, len(table) + 1))
    table.insert(3, "d_m", D)
    table.to_csv(folder / "grains.csv", index=False)
    columns = ["load_step", "id", "fx_n", "fz_n"]
    pd.DataFrame(forces, columns=columns).to_csv(folder / "forces.csv", index=False)
    steps = pd.DataFrame(
        {"load_step": range(5), "ustar0_m_s": [0.07, 0.1, 0.2, 0.3, 0.4]}
    )
    steps.to_csv(folder / "load_steps.csv", index=False)
    scene = {"d_m": D, "mass_kg": mass, "weight_n": weight, "rho_sol_kg_m3": density}
    scene |= {"reduced_gravity_m_s2": gravity, "time_unit_s": math.sqrt(D / gravity)}
    scene |= {"phi_deg": 35.0, "stiffness": 1e3, "damping": 0.3, "time_step": 0.1}
    scene |= {"waiting_time": 5.0, "displacement_criterion": 0.3}
    middle = APART * len(ROWS) / 2 * D
    scene |= {"roof_slope_deg": 0.05, "roof_x_m": middle, "roof_z_m": 2.5 * D}
    (folder / "scene.json").write_text(json.dumps(scene))
    return Bed(folder)


def _deck(bed: Bed, folder: Path) -> None:
    """Write the deck of a scene, from the scene alone."""
    shutil.copytree(templates() / "liggghts" / "bed", folder)
    scene, listed = bed.scene, [*bed.grains.values()]
    slope, x, z = bed.roof
    values: dict[str, Any] = {
        "diameter": D,
        "smallest": 1.0,
        "density": scene["rho_sol_kg_m3"],
        "gravity": scene["reduced_gravity_m_s2"],
        "friction": math.tan(math.radians(scene["phi_deg"])),
        "rest_energy": 1e-6,
        "sampling_interval": 0.5,
        "events": 0,
        "event_samples": 1,
        "settle": 10.0,
        "most_settle": 400.0,
        "noise": 0.01,
        "settle_drag": 0.0,
        "stir": 0.02,
        "away": 10.0,
        "enough": 0,
        "slope": math.degrees(slope),
        "ceiling_x": x,
        "ceiling_z": z,
        "behind": bed.behind,
    }
    for entry in (
        "stiffness",
        "damping",
        "time_step",
        "waiting_time",
        "displacement_criterion",
    ):
        values[entry] = scene[entry]
    position = np.array([(grain.x, 0.0, grain.z) for grain in listed])
    table = GrainTable(
        position=position,
        kind=np.array([KINDS[grain.kind] for grain in listed]),
        along=np.array([grain.along for grain in listed]),
        sizes=np.ones(len(listed)),
        diameter=D,
        density=scene["rho_sol_kg_m3"],
    )
    steps = range(len(bed.load_steps))
    force = [[bed.force(number, step, None) for number in bed.grains] for step in steps]
    deck.write_deck(
        folder, table, values, np.array(bed.load_steps), np.array(force), margin=3 * D
    )


def test_one_grain_of_each_case(tmp_path: Path) -> None:
    """Which way counts, what moves, what is taken away when, and by what load steps end."""
    bed = _cases(tmp_path / "scene")
    _deck(bed, tmp_path / "case")
    count, samples = _judged(bed, tmp_path / "case", tmp_path / "case")
    names = [name for name in ROWS if ROWS[name][0] == "counted"]
    number = dict(zip(names, bed.counted, strict=True))
    moved_in = {name: count.moved_in.get(number[name], 0) for name in names}
    assert moved_in["passes downstream"] == 3
    assert moved_in["passes upstream"] == 2
    assert moved_in["lies"] == 0
    # displaced by a whole diameter against its way, it has not moved
    assert moved_in["is blocked upstream"] == 0
    # a ratio of 0 counts downstream: it has not passed, but it falls off the row, and is gone
    assert moved_in["goes upstream, ratio 0"] >= 3
    assert moved_in["is lifted"] == 3
    carried = {name for name in names if number[name] in count.carried}
    assert carried == {"goes upstream, ratio 0", "is lifted"}
    gone = {each for sample in samples for each in sample.gone}
    pushed, mobile = max(bed.counted) + 19, max(bed.counted) + 20
    assert bed.grains[pushed].kind == "pushed"
    assert bed.grains[mobile].kind == "mobile"
    # displaced by more than 10 d; over the roof; behind
    assert gone >= {number["passes downstream"], number["is lifted"], mobile}
    ends = {one.load_step: one.ends for one in samples if one.ends}
    assert ends[1] == "rest"
    assert "waited" in ends.values()


def test_our_own_reading_of_the_run_agrees(tmp_path: Path) -> None:
    """The package reads the tables of that deck as the rules do."""
    bed = _cases(tmp_path / "scene")
    _deck(bed, tmp_path / "case")
    count, _ = _judged(bed, tmp_path / "case", tmp_path / "case")
    kind = np.array([KINDS[grain.kind] for grain in bed.grains.values()])
    places = np.array([(grain.x, 0.0, grain.z) for grain in bed.grains.values()])
    along = np.array([grain.along for grain in bed.grains.values()])
    table = GrainTable(places, kind, along, np.ones(len(kind)), D, 2500.0)
    read = motion.read_motion(tmp_path / "case", table, 0.3, falls_out=False)
    moved_in = dict(zip(bed.counted, read.load_step.tolist(), strict=True))
    assert {one: step for one, step in moved_in.items() if step} == count.moved_in
    carried = {one for one, gone in zip(bed.counted, read.carried, strict=True) if gone}
    assert carried == count.carried


@pytest.mark.parametrize("name", ["all_levels", "level_rows", "poured"])
def test_the_examples_have_the_roof_of_the_page(
    name: str, request: pytest.FixtureRequest
) -> None:
    """What the decks of LAMMPS and the script of YADE take, whether they are installed or not."""
    root = request.getfixturevalue(name)
    bed, _ = _case_of(root)
    (folder,) = root.glob("scenes/4-*")
    theirs = door.Bed(folder)
    assert theirs.roof == pytest.approx(bed.roof)
    assert theirs.behind == pytest.approx(bed.behind)


def test_a_pack_brings_the_contract(formulas: Path) -> None:
    """Its README has the page from "Write a solver" to its links, and no link that leads nowhere."""
    text = (formulas / "README.md").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "benchmark.md").read_text(encoding="utf-8")
    contract = page[page.index("## Write a solver") : page.index("## Where to go next")]
    assert contract in text
    assert not re.search(r"\]\((?!http)", text)
    for heading in (
        "## Scenes",
        "### Level 5, `line`",
        "## Verdicts",
        "**The contact.**",
    ):
        assert heading in contract


def test_the_small_pack_is_of_the_present_contract() -> None:
    """Another page needs another pack: run its study.toml, and export it into its place."""
    small = ROOT / "benchmark" / "small"
    read = pack.read_pack(small)
    assert sorted({int(name[0]) for name in read.manifest.scenes}) == [1, 2, 3, 4, 5]
    written = (small / pack.ABOUT).read_text(encoding="utf-8")
    assert pack.contract() in written


def _near(one: set[tuple[float, float]], other: set[tuple[float, float]]) -> None:
    """See that two sets of places are the same, d."""
    assert len(one) == len(other)
    for places in zip(sorted(one), sorted(other), strict=True):
        assert places[0] == pytest.approx(places[1], abs=1e-5)


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("slope", [15.0, 22.0, 30.0])
@pytest.mark.parametrize("rows", ["aligned", "horizontal"])
def test_the_packing_is_that_of_the_page(rows: str, slope: float, layers: int) -> None:
    """Counted, pushed and mobile grains, and the fixed ones that they touch."""
    text = f"""
grain.diameter = 1e-3
[bed]
kind = "pile"
height = 8e-3
packing = "{rows}"
slope_deg = {slope}

[method.grains]
mobile_layers = {layers}
"""
    (scene,) = study.parse(text, name="a", where="a").scenes
    ours = Geometry(scene).packing
    found = packed({**scenes.parameters_of(scene, "line"), "mobile_layers": layers})
    centres = [(float(x), float(z)) for x, z in ours.centres]
    kinds = (
        ours.windward,
        ours.mobile & ours.lee,
        ours.mobile & ~ours.windward & ~ours.lee,
    )
    for kind, by_the_page in zip(
        kinds, (found.counted, found.pushed, found.mobile), strict=True
    ):
        _near({centres[number] for number in np.flatnonzero(kind)}, by_the_page)
    mobile = [centres[number] for number in np.flatnonzero(ours.mobile)]
    fixed = [centres[number] for number in np.flatnonzero(~ours.mobile)]
    # all that a mobile grain touches are there, in the pile
    for x, z in found.fixed:
        if any(math.dist((x, z), other) < 1 + 1e-6 for other in mobile):
            assert min(math.dist((x, z), other) for other in fixed) < 1e-5
    # and no other but the level rows, and what lies lower than these
    level = 0.5 + scene.bed.roughness / scene.grain.diameter
    for x, z in fixed:
        is_touched = any(math.dist((x, z), other) < 1 + 1e-6 for other in mobile)
        if is_touched and z > level + 1e-6:
            assert min(math.dist((x, z), other) for other in found.fixed) < 1e-5


def test_the_mean_on_the_face_is_that_of_the_page(all_levels: Path) -> None:
    """Level 3: signed, over the arc length from the toe to the highest corner."""
    (folder,) = all_levels.glob("scenes/3-*")
    (case,) = all_levels.parent.glob("study/cases/flow-*")
    scene = json.loads((folder / "scene.json").read_text())
    bed = pd.read_csv(folder / "bed.csv")
    toe, top = bed.iloc[1], bed.iloc[bed["z_m"].argmax()]
    assert (toe["x_m"], toe["z_m"]) == (0.0, 0.0)
    length = math.hypot(top["x_m"] - toe["x_m"], top["z_m"] - toe["z_m"])
    stress = pd.read_csv(case / "wall_stress.csv")
    ratio = np.sign(stress["tau_wall"]) * np.sqrt(np.abs(stress["tau_wall"]))
    on_face = (stress["s_m"] > 0) & (stress["s_m"] < length)
    mean = np.average(ratio[on_face], weights=stress["length_m"][on_face])
    expected = pack.read_pack(all_levels).expected.set_index(["scene", "quantity"])[
        "value"
    ]
    assert expected[scene["scene"], "windward_mean"] == pytest.approx(mean, rel=1e-7)
    along = expected[scene["scene"], "ustar_over_ustar0"].to_numpy()
    assert along == pytest.approx(ratio.to_numpy(), rel=1e-7)
    asked = pd.read_csv(folder / "ask.csv")
    at = asked.loc[asked["quantity"] == "ustar_over_ustar0", "at"]
    assert at.to_numpy() == pytest.approx(
        (stress["s_m"] / scene["h_m"]).to_numpy(), rel=1e-7
    )
    height, z0 = scene["u_e_height_m"], scene["z0_m"]
    ustar0 = 0.41 * scene["u_e_m_s"] / math.log((height + z0) / z0)
    assert scene["ustar0_m_s"] == pytest.approx(ustar0)


def test_the_stress_on_a_grain_is_that_of_the_page(all_levels: Path) -> None:
    """Level 5: the mean of the stress over a length of bed, from a table of its integral."""
    (folder,) = all_levels.glob("scenes/5-*")
    (case,) = all_levels.parent.glob("study/cases/flow-*")
    scene = json.loads((folder / "scene.json").read_text())
    stress = WallStress.from_csv(case / "wall_stress.csv")
    bed, _ = _case_of(all_levels)
    alpha = math.radians(scene["alpha_deg"])
    length = max(scene["d_m"], scene["averaging_length"] * scene["h_m"])
    for number in bed.counted:
        grain = bed.grains[number]
        s = grain.x * math.cos(alpha) + grain.z * math.sin(alpha)
        crest = scene["h_m"] / math.sin(alpha)
        if not length / 2 < s < crest - length / 2:
            # straight lines between faces would cut the corner
            continue
        places = np.linspace(s - length / 2, s + length / 2, 2001)
        tau = np.interp(places, stress.s_m, stress.tau_wall)
        mean = float(np.mean(tau))
        # ours keeps the mean of each face
        ratio = math.copysign(math.sqrt(abs(mean)), mean)
        assert grain.ratio == pytest.approx(ratio, rel=0.01)
