"""The convergence of a user's own scenes: which are refined, how, and what is said of it."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import cli
from orchestrator.bed.line import of_bed
from orchestrator.errors import InputError
from orchestrator.experiment import piles
from orchestrator.fidelity import limits
from orchestrator.lab import convergence
from orchestrator.lab.convergence import FIRST, POWERS, SERIES, TITLE, Convergence
from orchestrator.report import style
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study, value_of
from tests import letters

PILE = """
title = "One"
threshold.criterion = "entrained"
grain = { diameter = 1e-3 }
[bed]
kind = "pile"
slope_deg = 20.0
height = 0.008
roughness = "d/30"
"""
NAMES = [series.name for series in SERIES]
MESH, WITH_FIRST_CELL, LOAD_STEPS, LAYERS = NAMES


def _study(text: str = PILE) -> Study:
    return study.parse(text, name="one", where="one")


def _series_of(text: str) -> dict[str, list[convergence.Member]]:
    found: dict[str, list[convergence.Member]] = {}
    for one in convergence.members(convergence.chosen(_study(text))):
        found.setdefault(one.series.name, []).append(one)
    return found


@pytest.mark.parametrize(
    ("more", "names"),
    [
        ("", NAMES),
        ('kind = "peeling"', [MESH, WITH_FIRST_CELL]),
        ('kind = "dem"\nflow.model = "waves"', [LOAD_STEPS, LAYERS]),
        ('kind = "pivot"\nflow.model = "waves"', []),
    ],
)
def test_what_a_scene_has_is_refined(more: str, names: list[str]) -> None:
    found = _series_of(f"{PILE}[method]\n{more}")
    assert list(found) == names
    assert {len(three) for three in found.values()} <= {3}


def test_a_level_bed_has_no_mesh() -> None:
    level = PILE.replace("slope_deg = 20.0", 'shape = "flat"\nlength = 0.05')
    level = level.replace("height = 0.008\n", "")
    text = level + '[method]\nflow.model = "flat"\nkind = "dem"\n'
    assert list(_series_of(text)) == [LOAD_STEPS, LAYERS]


def test_a_refined_scene_differs_in_what_is_refined_alone() -> None:
    numbers: dict[str, dict[str, list[float]]] = {
        MESH: {"method.flow.cells_per_face": [40, 80, 160]},
        WITH_FIRST_CELL: {
            "method.flow.cells_per_face": [40, 80, 160],
            "method.flow.first_cell_height": [2e-4, 1e-4, 5e-5],
        },
        LOAD_STEPS: {"method.grains.load_increment": [0.02, 0.01, 0.005]},
        LAYERS: {"method.grains.mobile_layers": [2, 4, 8]},
    }
    for name, three in _series_of(PILE).items():
        for field, values in numbers[name].items():
            assert [value_of(one.scene, field) for one in three] == pytest.approx(
                values
            )
        sizes = [one.series.size(one.scene) for one in three]
        assert sizes == sorted(sizes, reverse=True)
        kinds = {one.scene.method.kind for one in three}
        # no load step hides what a mesh changes
        assert kinds == {"peeling" if name in (MESH, WITH_FIRST_CELL) else "dem"}
        (question,) = {one.scene.question.model_dump_json() for one in three}
        assert question == three[0].asked.question.model_dump_json()


def test_a_first_cell_stays_out_of_the_roughness() -> None:
    """A finer one than the bed allows is no mesh of its flow: coarser ones are taken."""
    rough = PILE.replace('"d/30"', '"d/10"').replace("0.008", "0.02")
    rough = rough.replace("diameter = 1e-3", "diameter = 2e-3")
    three = _series_of(rough)[WITH_FIRST_CELL]
    assert [one.finer for one in three] != [1.0, 2.0, 4.0]
    assert 1.0 in [one.finer for one in three]
    for one in three:
        assert one.scene.first_cell_height >= one.scene.solve_roughness
        assert not any(limit.refused for limit in limits.exceeded(one.scene))


SIZES = (
    PILE
    + """
[axes]
"grain.diameter" = [8e-4, 1e-3]
"bed.packing" = ["aligned", "horizontal"]
"""
)


def test_one_scene_of_a_class_is_chosen_whatever_the_order() -> None:
    def counted(scene: Scene) -> float:
        line = of_bed(scene.bed)
        return float(line.lengths.sum() / scene.grain.diameter)

    asked = _study(SIZES)
    every = convergence.chosen(asked, every=True)
    assert list(every) == [scene.id for scene in asked.scenes]
    assert list(every.values()) == list(piles(asked))
    by_class = convergence.chosen(asked)
    turned = _study(SIZES.replace("[8e-4, 1e-3]", "[1e-3, 8e-4]"))
    assert convergence.chosen(turned).keys() == by_class.keys()
    assert len(by_class) == 2
    fewest = min(map(counted, every.values()))
    assert {counted(scene) for scene in by_class.values()} == {fewest}


def test_a_scene_is_named_by_the_id_that_tables_have() -> None:
    asked = _study(SIZES)
    one = asked.scenes[2]
    chosen = convergence.chosen(asked, [one.id])
    assert list(chosen) == [one.id]
    assert chosen[one.id].question == one.question
    with pytest.raises(InputError, match="no pile has the id 'nobody'"):
        convergence.chosen(asked, ["nobody"])


def test_what_has_no_mesh_is_refused(tmp_path: Path) -> None:
    grains = _study("grain = { diameter = 1e-3 }")
    with pytest.raises(InputError, match="there is no pile"):
        Convergence(grains, tmp_path / "out")
    closed = f'{PILE}[method]\nkind = "pivot"\nflow.model = "waves"\n'
    with pytest.raises(InputError, match="nothing to refine"):
        Convergence(_study(closed), tmp_path / "out")


def _points(**values: tuple[float, float, float]) -> pd.DataFrame:
    """Numbers on three meshes of 40, 80 and 160 cells."""
    rows: list[dict[str, Any]] = []
    for name, three in values.items():
        for finer, value in zip((1.0, 2.0, 4.0), three, strict=True):
            row = {
                "scene_id": "a",
                "scene": "a pile",
                "series": MESH,
                "part": "flow",
                "scene_class": "wall",
                "finer": finer,
                "size": 1 / (40 * finer),
                "told": f"{40 * finer:g} cells",
                "cost_core_s": finer,
                "quantity": name,
                "at": "10 %" if name in ("ustar0", "tau_c") else "",
                "value": value,
                "unresolved": POWERS[name] * 1e-3,
            }
            rows.append(row)
    return pd.DataFrame(rows)


def test_each_number_has_its_verdict() -> None:
    found = _points(
        **{
            "ustar0": (1.16, 1.08, 1.04),
            "tau_c": (1.0, 1.1, 1.0),
            "mean stress": (1.0, 1.0, 1.0),
            "highest stress": (2.0, 2.1, 2.2),
        }
    )
    judged = convergence.judge_all(found).set_index("quantity")
    assert judged.loc["ustar0", "verdict"] == "in the range"
    assert judged.loc["ustar0", "order"] == pytest.approx(1.0)
    assert judged.loc["ustar0", "limit"] == pytest.approx(1.0)
    assert judged.loc["ustar0", "gci_fine"] == pytest.approx(1.25 * 0.04 / 1.04)
    assert judged.loc["ustar0", "gci_own"] == pytest.approx(1.25 * 0.16 / 1.16)
    assert judged.loc["ustar0", "own_to_fine"] == pytest.approx(1.04 / 1.16 - 1)
    assert judged.loc["tau_c", "verdict"] == "not in the range"
    assert judged.loc["tau_c", "why"] == "the values oscillate"
    assert judged.loc["mean stress", "verdict"] == "settled"
    assert judged.loc["highest stress", "why"] == "the changes grow"
    out = ["tau_c", "mean stress", "highest stress"]
    assert (
        judged.loc[out, ["order", "limit", "gci_fine", "gci_own"]].isna().all(axis=None)
    )


def test_a_number_that_a_mesh_lacks_has_no_verdict() -> None:
    found = _points(ustar0=(1.16, 1.08, 1.04), tau_c=(1.0, math.nan, 1.0))
    judged = convergence.judge_all(found).set_index("quantity")
    assert judged.loc["tau_c", "verdict"] == "not known"
    is_fine = (found["quantity"] == "ustar0") & (found["finer"] == 4.0)
    assert list(convergence.judge_all(found[~is_fine])["quantity"]) == ["tau_c"]


def test_the_letters_of_the_figure_are_large_on_a_narrow_page() -> None:
    found = _points(**{"ustar0": (1.16, 1.08, 1.04), "highest stress": (2.0, 2.1, 2.2)})
    with style.settings(style.LETTERS):
        canvas = convergence.chart_of(found, convergence.judge_all(found))
        assert canvas.get_figwidth() == style.NARROW
        letters.check(canvas)


def test_the_figure_has_a_line_for_each_number() -> None:
    found = _points(**{"ustar0": (1.16, 1.08, 1.04), "highest stress": (2.0, 2.1, 2.2)})
    judged = convergence.judge_all(found)
    (ax,) = (ax for ax in convergence.chart_of(found, judged).axes if ax.lines)
    drawn = [line for line in ax.lines if line.get_gid() == "number"]
    changes = [np.asarray(line.get_ydata()).tolist() for line in drawn]
    assert changes[0] == pytest.approx(
        [0.0, 100 * (1.08 / 1.16 - 1), 100 * (1.04 / 1.16 - 1)]
    )
    assert changes[1] == pytest.approx([0.0, 5.0, 10.0])
    # what has no order is open
    assert [line.get_markerfacecolor() == "white" for line in drawn] == [False, True]
    assert [text.get_text() for text in ax.get_xticklabels()] == [
        "40 cells",
        "80 cells",
        "160 cells",
    ]


@pytest.mark.long
def test_a_pile_is_refined(tmp_path: Path) -> None:
    asked = _study(PILE.replace("height = 0.008", "height = 0.005"))
    made = Convergence(asked, tmp_path / "out")
    finished = made.run(tmp_path / "out", workers=2)
    assert not finished.failures
    table = pd.read_csv(tmp_path / "out" / "tables" / "convergence.csv")
    assert Counter(table["series"]).keys() == set(NAMES)
    assert table["verdict"].isin(["in the range", "settled", "not in the range"]).all()
    in_range = table["verdict"] == "in the range"
    assert table["order"].notna().equals(in_range)
    first = table[table["at"] == FIRST].set_index("series")
    assert set(first["quantity"]) == {"ustar0"}
    # refined cells at one first cell have settled, or nearly so; no change is as large
    # as that of a mesh that is not of this flow
    assert first["own_to_fine"].abs().max() < 0.5
    # the values of the scene's own mesh are those of its study by peeling
    flow = table[(table["series"] == MESH) & (table["quantity"] == "tau_c")]
    same = table[(table["series"] == WITH_FIRST_CELL) & (table["quantity"] == "tau_c")]
    assert list(flow["own"]) == list(same["own"])
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert TITLE in page
    assert all(name in page for name in NAMES)
    assert made.run(tmp_path / "out", workers=2).started == 0


def test_the_command_says_first_what_it_will_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "sizes.toml"
    file.write_text(SIZES, encoding="utf-8")
    out = tmp_path / "out"
    assert cli.main(["convergence", str(file), "--plan", "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "2 of 4 scenes refined:" in said.err
    scenes = study.load(str(file)).scenes
    assert sum(f"  {scene.id}  20°" in said.err for scene in scenes) == 2
    assert "expected: about" in said.out
    assert not out.exists()
    words = ["convergence", str(file), "--plan", "--scene", scenes[3].id]
    assert cli.main([*words, "--out", str(out)]) == 0
    assert f"1 of 4 scenes refined:\n  {scenes[3].id}" in capsys.readouterr().err
