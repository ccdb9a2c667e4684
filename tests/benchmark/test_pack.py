"""A pack says all that a solver needs, and is refused when it is not what was exported."""

import functools
import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import cli, pipeline
from orchestrator.bed.deck import DIAMETER, WEIGHT
from orchestrator.benchmark import pack, scenes
from orchestrator.benchmark.export import export
from orchestrator.errors import InputError
from orchestrator.runs.workspace import STUDY, Workspace, claimed
from orchestrator.study import study
from orchestrator.study.scene import Scene
from tests.benchmark.conftest import ROOT, seal

# first cells other than the default are warned of
pytestmark = pytest.mark.filterwarnings("ignore:.*first_cell_height")


def _documented() -> set[tuple[str, str]]:
    """Entry and kind, by the list of docs/benchmark.md."""
    text = (ROOT / "docs" / "benchmark.md").read_text().partition("## Scenes\n")[2]
    entries = set()
    for item in text.partition("**The contact.**")[0].split("\n- ")[1:]:
        words, _, names = item.partition(":")
        kinds = {kind for kind in pack.KINDS if re.search(rf"\b{kind}\b", words)}
        kinds = set(pack.KINDS) - kinds if words.startswith("all") else kinds
        entries |= {
            (name, kind) for name in re.findall(r"`(\w+)`", names) for kind in kinds
        }
    return entries


def _scene(text: str) -> Scene:
    (scene,) = study.parse(text, name="a", where="a").scenes
    return scene


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
DISORDERED = """
grain.diameter = 1e-3
forces.law = "high"
bed = { kind = "pile", packing = "disordered", slope_deg = 20.0 }
"""


def test_all_names_are_documented_and_those_of_the_schema(
    formulas: Path, all_levels: Path, lift_off: Path, poured: Path
) -> None:
    """Solvers read these names: one that is changed is a new schema, and a line of the page."""
    packs = [pack.read_pack(root) for root in (formulas, all_levels, lift_off, poured)]
    entries = [given for read in packs for given in read.scenes.values()]
    present = {(name, str(given["kind"])) for given in entries for name in given}
    for kind in ("pile", "line"):  # no pack here has these
        names = (*scenes.parameters_of(_scene(DISORDERED), kind), "lift_off")
        present |= {(name, kind) for name in names}
    assert present == _documented()
    assert pack.SCHEMA == 2
    for pattern, head in TABLES.items():
        assert min(all_levels.glob(pattern)).read_text().splitlines()[0] == head
    forces = next(poured.glob("scenes/4-*/forces.csv"))
    assert forces.read_text().splitlines()[0] == "load_step,id,fx_n,fz_n"


def test_levels_times_and_our_answers(all_levels: Path) -> None:
    chosen = pack.read_pack(all_levels)
    assert {given["level"] for given in chosen.scenes.values()} == {1, 2, 3, 4, 5}
    judged = chosen.expected[chosen.expected["tolerance"].notna()]
    margin = (judged["tolerance"] + 1e-8) * judged["value"].abs()
    assert judged["ours"].between(judged["low"] - margin, judged["high"] + margin).all()
    times = pd.read_csv(all_levels / "times.csv").set_index("scene")["seconds"]
    assert set(times.index[times > 0]) == {
        name for name in chosen.scenes if name[0] != "1"
    }


def _scene_and_case(
    root: Path, scene: str, case: str
) -> tuple[Any, pd.DataFrame, Path, Any]:
    """The entries and grains of a scene, and the case of its answer with the grains of its deck."""
    (folder,), (run,) = (
        root.glob(f"scenes/{scene}"),
        root.parent.glob(f"study/cases/{case}-*"),
    )
    rows = (run / "grains.data").read_text().partition("Atoms\n\n")[2].split("\n")
    deck = pd.DataFrame([row.split() for row in rows if row]).astype(float)
    given = json.loads((folder / "scene.json").read_text())
    return given, pd.read_csv(folder / "grains.csv"), run, deck


def test_the_grains_of_a_pile_are_those_of_its_case(all_levels: Path) -> None:
    given, grains, _, deck = _scene_and_case(all_levels, "4-*", "pile")
    kinds = grains["kind"].map({"fixed": 1, "mobile": 2, "counted": 3, "pushed": 4})
    assert kinds.tolist() == deck[1].tolist()
    for column, name in ((4, "x_m"), (6, "z_m")):
        # in parts of the diameter: nine digits of the longest coordinate
        assert (grains[name] - deck[column]).abs().max() < 1e-6 * given["d_m"]
    assert (grains["kind"] == "counted").sum() == given["count"]
    forced = grains["kind"].isin(["counted", "pushed"])
    assert grains.loc[forced, ["slope_deg", "ustar_over_ustar0"]].notna().all(axis=None)


def test_a_pivot_is_the_cell_of_its_case(all_levels: Path) -> None:
    given, grains, case, deck = _scene_and_case(all_levels, "2-grain*", "cells")
    load_steps = pd.read_csv(min(all_levels.glob("scenes/2-grain*/load_steps.csv")))
    for axis, place in (("x", 4), ("z", 6)):
        centres, of_deck = (
            grains[f"{axis}_m"] / given["d_m"],
            deck[place] / DIAMETER,
        )
        assert (centres - centres[2]).to_numpy() == pytest.approx(of_deck - of_deck[2])
        rows = (case / f"force.{axis}.txt").read_text().split("\n")[1::2]
        force = np.array([row.split()[1] for row in rows if row], float)
        ratio = load_steps[f"f{axis}_n"] / given["weight_n"]
        assert ratio.to_numpy() == pytest.approx(force / WEIGHT, rel=1e-7)
    flows = np.array((case / "load_steps.txt").read_text().split(), float)
    ratio = load_steps["ustar_m_s"] / load_steps["ustar_m_s"].iloc[0]
    assert ratio.to_numpy() == pytest.approx(flows / flows[0])


@pytest.mark.parametrize(
    ("forces", "has_one"),
    [
        ("law = 'bridged'", True),
        # neither equation holds between Re* 3 and 30, and there Eq. 2 lifts the grain off
        ("law = 'low'", False),
        ("law = 'high'", False),
        # a law that covers every Re* lifts it off, too, where its lift is large
        ("law = 'bridged'\nlift_coefficient = 50.0", False),
    ],
)
def test_pivots_are_of_every_law_that_holds_and_rolls_its_grain(
    forces: str, has_one: bool
) -> None:
    group = "[[group]]\nname = 'a'\nbed.slope_deg = 25.0"
    scene = _scene(f"[grain]\ndiameter = 3e-4\n[forces]\n{forces}\n{group}")
    assert scenes.has_pivot(scene) is has_one


def test_where_details_decide_only_what_they_do_not_is_judged(
    level_rows: Path, lift_off: Path, all_levels: Path
) -> None:
    rows: Any = pack.read_pack(level_rows).expected.set_index("quantity")
    count = rows.loc["moved", "value"].iloc[-1] + rows.loc["not_moved", "value"]
    tolerances = rows.loc["shields"].set_index("at")["tolerance"]
    assert tolerances[["0.1", "0.3"]].eq(0.03).all()
    assert tolerances[["0.5", "0.7"]].isna().all()
    moved = rows.loc["moved"]
    judged = moved["tolerance"].notna()
    assert (
        0
        < moved.loc[judged, "value"].max()
        <= 0.35 * count
        < moved.loc[~judged, "high"].min()
    )
    # where lift carries grains off, which collide, thresholds are known less well
    chosen = pack.read_pack(lift_off)
    ((_, given),) = chosen.scenes.items()
    lifted: Any = chosen.expected.set_index("quantity")
    last = lifted.loc["moved"].iloc[-1]
    assert given["lift_off"] > 0.9
    assert lifted.loc["carried_off", "at"] == last["at"]
    assert lifted.loc["carried_off", "value"] == round(
        given["lift_off"] * last["value"]
    )
    assert lifted.loc["shields", "tolerance"].eq(0.2).all()
    # rows along the face are judged to their end, and nothing is said of lift
    table = (
        pack.read_pack(all_levels).expected.set_index("scene").filter(like="4-", axis=0)
    )
    assert table["tolerance"].notna().all()
    assert "carried_off" not in set(table["quantity"])


def test_export_twice_and_without_liggghts(
    formulas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(tmp_path / "again", None, ())
    export(tmp_path / "again", None, ())
    first, again = (
        pack.read_pack(root).manifest.sha256 for root in (formulas, tmp_path / "again")
    )
    assert {name for name in first if first[name] != again.get(name)} <= {pack.TIMES}
    monkeypatch.setenv("PATH", str(tmp_path))
    export(tmp_path / "pack", None, (2,))
    chosen = pack.read_pack(tmp_path / "pack")
    assert chosen.manifest.programs == {}
    assert chosen.expected["ours"].isna().all()
    assert pd.read_csv(tmp_path / "pack" / "times.csv").empty


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ('bed.packing = "poured"\nbed.width = 5.0', "bed.width"),
        ("threshold.update = 0.1", "threshold.update"),
        ('forces.sheltering = "balanced"', "forces.sheltering"),
        ('fluid.kind = "water"', 'write threshold.criterion = "entrained"'),
        ("", "the study is not finished"),
    ],
)
def test_what_cannot_be_exported(fields: str, named: str, tmp_path: Path) -> None:
    text = f'grain.diameter = 1e-3\nbed.kind = "pile"\nbed.slope_deg = 20.0\n{fields}\n'
    text += 'method.kind = "dem"\nmethod.flow.first_cell_height = 1e-3\n'
    with claimed(tmp_path, STUDY, "held"):
        Workspace(tmp_path).describe(STUDY, "held", [], {}, study=text, tolerance=None)
    with pytest.raises(InputError, match=re.escape(named)):
        export(tmp_path / "pack", tmp_path, ())
    with pytest.raises(InputError, match=r"level 3 needs .*--from"):
        export(tmp_path / "pack", None, (3,))
    (tmp_path / "thesis.tex").write_text("\\end")
    with pytest.raises(InputError, match="holds the study"):
        export(tmp_path, None, ())


GRAINS = """
fluid.kind = "water"
grain.density = 2650.0
axes."grain.diameter" = [5e-4, 2e-3]
"""


def test_single_grains_that_no_dem_has_answered_are_exported(tmp_path: Path) -> None:
    text = GRAINS + 'threshold.criterion = "entrained"\nmethod.kind = "pivot"\n'
    asked = study.parse(text, name="grains", where="grains.toml")
    pipeline.run(asked, tmp_path / "study", workers=1)
    export(tmp_path / "pack", tmp_path / "study", ())
    chosen = pack.read_pack(tmp_path / "pack")
    pivots = chosen.expected[chosen.expected["scene"].str.startswith("2-grain")]
    assert len(pivots) == 2
    assert pivots["ours"].isna().all()
    assert pivots["value"].gt(0).all()


@pytest.mark.parametrize("levels", [(), (1,), (2,)])
def test_single_grains_that_go_on_are_no_questions_of_a_pack(
    levels: tuple[int, ...], tmp_path: Path
) -> None:
    asked = study.parse(GRAINS, name="grains", where="grains.toml")
    pipeline.run(asked, tmp_path / "study", workers=1)
    with pytest.raises(InputError, match="a pack asks when grains are entrained"):
        export(tmp_path / "pack", tmp_path / "study", levels)


def _edit(path: Path, **changed: Any) -> None:
    path.write_text(json.dumps(json.loads(path.read_text()) | changed))


def _rename(root: Path, name: str) -> None:
    """Give a scene another name, wherever a pack says it."""
    old = root / INCLINE
    _edit(old / "scene.json", scene=name)
    for file in ("expected.csv", "scenes.csv", pack.MANIFEST):
        escaped = json.dumps(name)[1:-1] if file == pack.MANIFEST else name
        (root / file).write_text((root / file).read_text().replace(old.name, escaped))
    if not name.startswith("/"):
        goal = root / "scenes" / name
        goal.parent.mkdir(parents=True, exist_ok=True)
        old.rename(goal)


def _replace(path: Path, make: Callable[[Path], object]) -> None:
    path.unlink(missing_ok=True)
    make(path)


INCLINE = "scenes/2-incline-20"
TOUCHED = ("changed", "removed", "added")
HARMS: dict[str, Callable[[Path], object]] = {
    **{
        f"a scene {name!r}": functools.partial(_rename, name=name)
        for name in ("../../evil", "/tmp/evil", "2-a/b", "2-$\\frac$", "2-a\n")
    },
    "changed": lambda root: _edit(root / INCLINE / "scene.json", d_m=2e-3),
    "removed": lambda root: (root / INCLINE / "ask.csv").unlink(),
    "added": lambda root: (root / INCLINE / "more.csv").write_text("1\n"),
    "no JSON": lambda root: (root / INCLINE / "scene.json").write_bytes(b"\xff\xfe{"),
    "another level": lambda root: _edit(root / INCLINE / "scene.json", level=3),
    "no number": lambda root: (root / "expected.csv").write_text(
        (root / "expected.csv")
        .read_text()
        .replace(",1e-06,", ",1e999,")
        .replace("0.01,", "x,")
    ),
    "a table that is a link": lambda root: _replace(
        root / "expected.csv", lambda path: path.symlink_to("/dev/zero")
    ),
    "a scene that is a link": lambda root: (root / INCLINE).symlink_to(
        (root / INCLINE).rename(root.parent / "away")
    ),
    "a pipe": lambda root: _replace(root / INCLINE / "ask.csv", os.mkfifo),
    "a scene that is not listed": lambda root: shutil.copytree(
        root / INCLINE, root / "scenes/2-b"
    ),
    "another schema": lambda root: _edit(root / pack.MANIFEST, schema=1),
    "bytes for a study": lambda root: (root / "study.toml").write_bytes(
        b"\xff\xfe\x00"
    ),
    "a study of a file": lambda root: (root / "study.toml").write_text(
        'bed = { profile = "/etc/passwd" }\n' + (root / "study.toml").read_text()
    ),
}


@pytest.mark.parametrize("name", HARMS)
def test_a_hostile_pack_is_refused_by_one_line(
    formulas: Path,
    tmp_path: Path,
    name: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    copy = Path(shutil.copytree(formulas, tmp_path / "pack"))
    monkeypatch.chdir(tmp_path)
    HARMS[name](copy)
    if name not in TOUCHED:
        seal(copy)
    before = {path for path in tmp_path.rglob("*") if "results" not in path.parts}
    code = cli.main(
        ["benchmark", "run", "pack", "--scene", "2-*", "--solver", "true {case} {out}"]
    )
    printed = capsys.readouterr().err
    assert code == 2, printed
    (line,) = (
        line for line in printed.splitlines() if line.startswith("orchestrator: ")
    )
    assert "pack" in line
    assert {p for p in tmp_path.rglob("*") if "results" not in p.parts} == before
