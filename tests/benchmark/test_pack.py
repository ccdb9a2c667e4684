"""A pack says all that a solver needs, and is refused when it is not what was exported."""

import json
import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.benchmark import exact, pack, page
from orchestrator.benchmark.export import export
from orchestrator.benchmark.pack import COLUMNS
from orchestrator.errors import InputError
from orchestrator.grains import cells
from orchestrator.runs.workspace import STUDY, Workspace, claimed
from orchestrator.study import study
from orchestrator.study.scene import Scene
from tests.benchmark.conftest import ROOT
from tests.conftest import Command

DISORDERED = """
[grain]
diameter = 1e-3
[flow]
[forces]
law = "high"
[[group]]
name = "gaps"
bed = { kind = "pile", packing = "disordered", slope_deg = 20.0 }
"""


def test_levels_of_a_study(all_levels: Path) -> None:
    found = pack.read(all_levels)
    levels = [told["level"] for told in found.scenes.values()]
    assert sorted(set(levels)) == [1, 2, 3, 4, 5]
    assert list(found.expected.columns) == ["scene", *COLUMNS]
    assert set(found.expected["scene"]) == set(found.scenes)
    judged = found.expected[found.expected["tolerance"].notna()]
    # our own answer is within what is expected of others
    known = judged[judged["ours"].notna()]
    margin = (known["tolerance"] + 1e-8) * known["value"].abs()
    assert (known["ours"] >= known["low"] - margin).all()
    assert (known["ours"] <= known["high"] + margin).all()


def _documented() -> set[tuple[str, str]]:
    """Entry and kind, by the table of docs/benchmark.md."""
    text = (ROOT / "docs" / "benchmark.md").read_text().partition("## Scenes\n")[2]
    table = text.partition("**The contact.**")[0]
    rows = re.findall(r"^\| (`.*?) \| (.*?) \|", table, re.MULTILINE)
    return {
        (name, kind)
        for names, kinds in rows
        for name in re.findall(r"`(\w+)`", names)
        for kind in _kinds(kinds)
    }


def _kinds(said: str) -> set[str]:
    listed = {kind for kind in pack.KINDS if re.search(rf"\b{kind}\b", said)}
    return set(pack.KINDS) - listed if said.startswith("all") else listed


def test_every_entry_of_a_scene_is_documented_and_the_others_are_absent(
    formulas: Path, all_levels: Path, lift_off: Path
) -> None:
    packs = [pack.read(root) for root in (formulas, all_levels, lift_off)]
    told = [one for found in packs for one in found.scenes.values()]
    found = {(name, str(one["kind"])) for one in told for name in one}
    scene = next(iter(study.parse(DISORDERED, name="d", where="d").scenes))
    for kind in ("pile", "line"):
        # no pack here has these
        found |= {(name, kind) for name in (*exact.parameters(scene, kind), "lift_off")}
    assert found == _documented()


SCHEMA_2 = """
schema scene level kind d_m rho_sol_kg_m3 mass_kg reduced_gravity_m_s2 weight_n rho_f_kg_m3 nu_m2_s
g_m_s2 force_law alpha_s regime alpha_deg beta_deg relative_size z0_m phi_deg spring_n_m
stiffness damping time_unit_s time_step speed_m_s incline_deg roll_time_s force_n
displacement_criterion waiting_time load_increment final_fraction count lift_off h_m packing
disorder seed flow_model stress
update mobile_layers averaging_length loaded_grains u_e_m_s ustar0_m_s u_e_height_m lid_height_m
solve_nu_m2_s solve_z0_m first_cell_m cells_per_face turbulence_model
"""
TABLES = {
    "scenes/4-*/grains.csv": "id,x_m,z_m,d_m,kind,slope_deg,ustar_over_ustar0",
    "scenes/4-*/load_steps.csv": "load_step,ustar0_m_s,u_e_m_s",
    "scenes/2-grain*/grains.csv": "id,x_m,z_m,d_m,kind",
    "scenes/2-grain*/load_steps.csv": "load_step,ustar_m_s,fx_n,fz_n",
    "scenes/3-*/bed.csv": "x_m,z_m",
    "scenes/1-*/ask.csv": "quantity,at",
    "expected.csv": "scene,quantity,at,value,low,high,tolerance,ours",
    "times.csv": "scene,seconds",
}


def test_the_names_of_the_schema_are_kept(all_levels: Path) -> None:
    """Solvers read these names: one that is changed is a new schema, and a line of the page."""
    assert pack.SCHEMA == 2
    assert {name for name, _ in _documented()} == set(SCHEMA_2.split())
    for pattern, head in TABLES.items():
        assert min(all_levels.glob(pattern)).read_text().splitlines()[0] == head


def test_the_grains_of_a_pile_are_those_of_its_case(all_levels: Path, finished: Path) -> None:
    found = pack.read(all_levels)
    name = next(name for name in found.scenes if name.startswith("4-"))
    told = found.scenes[name]
    grains = pd.read_csv(found.directory(name) / "grains.csv")
    (case,) = (finished / "cases").glob("pile-*")
    rows = (case / "grains.data").read_text().partition("Atoms\n\n")[2].split("\n")
    deck = pd.DataFrame([row.split() for row in rows if row]).astype(float)
    kinds = grains["kind"].map({"fixed": 1, "mobile": 2, "counted": 3, "pushed": 4})
    assert kinds.tolist() == deck[1].tolist()
    for column, name in ((4, "x_m"), (6, "z_m")):
        # in parts of the diameter: nine digits of the longest coordinate
        assert (grains[name] - deck[column]).abs().max() < 1e-6 * told["d_m"]
    assert (grains["kind"] == "counted").sum() == told["count"]
    forced = grains["kind"].isin(["counted", "pushed"])
    assert grains.loc[forced, ["slope_deg", "ustar_over_ustar0"]].notna().all(axis=None)


def _grain(**forces: object) -> Scene:
    fields = "\n".join(f"{name} = {value!r}" for name, value in forces.items())
    group = "[[group]]\nname = 'a'\nbed.slope_deg = 25.0"
    text = f"[grain]\ndiameter = 3e-4\n[forces]\n{fields}\n{group}"
    (scene,) = study.parse(text, name="a", where="a").scenes
    return scene


def test_pivots_are_of_every_law_that_holds_and_rolls_its_grain() -> None:
    assert exact.has_pivot(_grain(law="bridged"))
    # neither equation holds between Re* 3 and 30, and there Eq. 2 lifts the grain off
    assert not exact.has_pivot(_grain(law="low"))
    assert not exact.has_pivot(_grain(law="high"))
    # a law that covers every Re* lifts it off, too, where its lift is large
    assert not exact.has_pivot(_grain(law="bridged", lift_coefficient=50.0))


def test_a_pivot_is_the_cell_of_its_case(all_levels: Path, finished: Path) -> None:
    found = pack.read(all_levels)
    name = next(name for name, told in found.scenes.items() if told["kind"] == "pivot")
    weight, d = found.scenes[name]["weight_n"], found.scenes[name]["d_m"]
    grains = pd.read_csv(found.directory(name) / "grains.csv")
    load_steps = pd.read_csv(found.directory(name) / "load_steps.csv")
    (case,) = (finished / "cases").glob("cells-*")
    rows = (case / "grains.data").read_text().partition("Atoms\n\n")[2].split("\n")
    deck = pd.DataFrame([row.split() for row in rows if row]).astype(float)
    for axis, column, place in (("x", "fx_n", 4), ("z", "fz_n", 6)):
        own, of_deck = grains[f"{axis}_m"], deck[place]
        assert ((own - own[2]) / d).to_numpy() == pytest.approx((of_deck - of_deck[2]) / 1e-3)
        sets = (case / f"force.{axis}.txt").read_text().split("\n")[1::2]
        force = np.array([line.split()[1] for line in sets if line], float)
        assert (load_steps[column] / weight).to_numpy() == pytest.approx(
            force / cells.WEIGHT, rel=1e-7
        )
    flows = (case / "load_steps.txt").read_text().split()
    ratio = load_steps["ustar_m_s"] / load_steps["ustar_m_s"].iloc[0]
    assert ratio.to_numpy() == pytest.approx([float(f) / float(flows[0]) for f in flows])


def test_derived_parameters_agree(all_levels: Path) -> None:
    for told in pack.read(all_levels).scenes.values():
        if told["kind"] == "flow":
            continue
        weight = told["mass_kg"] * told["reduced_gravity_m_s2"]
        assert told["weight_n"] == pytest.approx(weight, rel=1e-12)
        if told["kind"] == "closed-form":
            continue
        assert told["spring_n_m"] == pytest.approx(told["stiffness"] * weight / told["d_m"])
        unit = math.sqrt(told["d_m"] / told["reduced_gravity_m_s2"])
        assert told["time_unit_s"] == pytest.approx(unit)


def test_a_pile_that_lifts_off_says_so_and_asks_for_it(lift_off: Path, all_levels: Path) -> None:
    found = pack.read(lift_off)
    ((name, told),) = found.scenes.items()
    assert told["lift_off"] > 0.9
    assert page.about(found, name).endswith(", lift-off")
    rows: Any = found.expected.set_index("quantity")
    last = rows.loc["moved"].iloc[-1]
    assert rows.loc["carried_off", "at"] == last["at"]
    assert rows.loc["carried_off", "value"] == round(told["lift_off"] * last["value"])
    assert last["value"] > 0.5 * told["count"]
    assert {"shields", "ustar0_m_s"} <= set(rows.index)
    # where drag moves the grains nothing is said of lift
    others = pack.read(all_levels)
    assert not any("lift_off" in told for told in others.scenes.values())
    assert "carried_off" not in set(others.expected["quantity"])


def test_where_details_decide_only_what_they_do_not_is_judged(
    level_rows: Path, lift_off: Path, all_levels: Path
) -> None:
    rows: Any = pack.read(level_rows).expected.set_index("quantity")
    count = rows.loc["moved", "value"].iloc[-1] + rows.loc["not_moved", "value"]
    thresholds = rows.loc["shields"].set_index("at")["tolerance"]
    assert thresholds[["0.1", "0.3"]].eq(0.03).all()
    assert thresholds[["0.5", "0.7"]].isna().all()
    moved = rows.loc["moved"]
    judged = moved["tolerance"].notna()
    assert judged.any()
    assert moved.loc[judged, "value"].max() <= 0.35 * count < moved.loc[~judged, "high"].min()
    # grains that fly collide: their thresholds are known less well
    lifted: Any = pack.read(lift_off).expected.set_index("quantity")
    assert lifted.loc["shields", "tolerance"].eq(0.2).all()
    assert lifted.loc["moved", "tolerance"].eq(0).all()
    # rows along the face are judged to their end
    table = pack.read(all_levels).expected
    aligned = table[table["scene"].str.startswith("4-")]
    assert aligned["tolerance"].notna().all()


@pytest.mark.parametrize("harm", ["changed", "removed", "added"])
def test_a_pack_that_was_touched_is_refused(formulas: Path, tmp_path: Path, harm: str) -> None:
    root = tmp_path / "pack"
    shutil.copytree(formulas, root)
    victim = root / "scenes" / "2-incline-20" / "scene.json"
    if harm == "changed":
        victim.write_text(victim.read_text().replace("20.0", "21.0"))
    elif harm == "removed":
        victim.unlink()
    else:
        victim.with_name("more.csv").write_text("1\n")
    with pytest.raises(InputError, match=r"scenes/2-incline-20/.*the pack is not used"):
        pack.read(root)


def test_a_pack_of_another_schema_is_refused(formulas: Path, tmp_path: Path) -> None:
    manifest = json.loads((formulas / pack.MANIFEST).read_text())
    (tmp_path / pack.MANIFEST).write_text(json.dumps({**manifest, "schema": 1}))
    with pytest.raises(InputError, match=r"schema is 1.*Old and new names.*docs/benchmark\.md"):
        pack.read(tmp_path)
    assert "## Old and new names" in (ROOT / "docs" / "benchmark.md").read_text()


def test_export_twice_gives_the_same_pack(formulas: Path, tmp_path: Path) -> None:
    export(tmp_path / "again", None, ())
    export(tmp_path / "again", None, ())
    first, again = (pack.read(root) for root in (formulas, tmp_path / "again"))
    assert first.digest == again.digest
    assert list(first.scenes) == list(again.scenes)


def test_our_time_and_answer_for_each_scene(all_levels: Path) -> None:
    found = pack.read(all_levels)
    times = pd.read_csv(all_levels / "times.csv").set_index("scene")["seconds"]
    assert set(times.index) == set(found.scenes)
    assert times.gt(0).all()
    judged = found.expected[found.expected["tolerance"].notna()]
    assert judged["ours"].notna().all()


def test_a_pack_of_formulas_without_liggghts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    export(tmp_path / "pack", None, (2,))
    found = pack.read(tmp_path / "pack")
    assert found.manifest.programs == {}
    assert found.expected["ours"].isna().all()
    assert pd.read_csv(tmp_path / "pack" / "times.csv").empty


def test_what_cannot_be_exported(orchestrator: Command, tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text("[grain]\ndiameter = 1e-3\n")
    ended = orchestrator("study", "one.toml", "--tolerance", "0.1", "--out", "tolerant")
    assert ended.returncode == 0, ended.stderr
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("\\end")
    for arguments, words in (
        (("new", "--level", "3"), ("--level", "--from")),
        (("mine",), ("thesis.tex", "not a benchmark pack")),
        (("new", "--from", "mine"), ("no study",)),
        (("new", "--from", "tolerant"), ("tolerance of 0.1", "without it")),
    ):
        ended = orchestrator("benchmark", "export", *arguments)
        assert ended.returncode == 2
        assert "Traceback" not in ended.stderr
        assert all(word in ended.stderr for word in words), ended.stderr
    assert (tmp_path / "mine" / "thesis.tex").is_file()


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ('bed.packing = "poured"\nbed.width = 5.0', "bed.width"),
        ("protocol.update = 0.1", "protocol.update"),
    ],
)
def test_beds_that_no_pack_holds_are_refused(fields: str, named: str, tmp_path: Path) -> None:
    text = f'grain.diameter = 1e-3\nbed.kind = "pile"\nbed.slope_deg = 20.0\n{fields}\n'
    text += 'protocol.method = "dem"\nflow.first_cell_height = 1e-3\n'
    space = Workspace(tmp_path)
    space.root.mkdir(exist_ok=True)
    with claimed(space.root, STUDY, "held"):
        space.describe(STUDY, "held", [], study=text, tolerance=None)
    with pytest.raises(InputError, match=named):
        export(tmp_path / "pack", tmp_path, ())
