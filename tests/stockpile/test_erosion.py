"""Erosion of stockpiles: the rules of AP-42 by hand, a flat bed, and the preset as it is run."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.cli import main
from orchestrator.errors import InputError
from orchestrator.report import style
from orchestrator.report.card import lines
from orchestrator.stockpile import erosion
from orchestrator.study import study
from tests import letters

# meshes as coarse as these are warned of
pytestmark = pytest.mark.filterwarnings("ignore:.*cells_per_face")

WINDS = "erosion = { fastest_mile = [10.0, 20.0], threshold = 0.6 }"
PILE = 'bed.kind = "triangle"\nbed.slope_deg = 30.0\n'


def test_the_classes_of_ap42_and_its_potential_by_hand() -> None:
    assert erosion.AREAS.groupby("pile")["share"].sum().tolist() == [100] * 4
    parts = erosion.AREAS["sub_areas"].str.split(" + ", regex=False)
    assert [sum(map(int, filter(None, p))) for p in parts] == erosion.AREAS[
        "share"
    ].tolist()
    # u* in a wind of 20 m/s is 0.4, 1.2, 1.8 m/s; 36, 50 and 14 % of the area of pile B1
    surface = erosion.PileSurface("", pd.DataFrame(), 0.0, threshold=1.12)
    by_epa = erosion.Stockpile("", [surface], is_flat=False, has_bare=True).by_epa
    hand = 0.5 * (58 * 0.08**2 + 25 * 0.08) + 0.14 * (58 * 0.68**2 + 25 * 0.68)
    assert by_epa[1].potential([20.0, 10.0]) == pytest.approx([hand, 0.0])
    assert by_epa[2].faces["ratio"].tolist() == pytest.approx(
        [0.39, 1.17, 1.75, 2.14], abs=0.005
    )


def test_losses_stand_beside_those_of_ap42_in_letters_to_read() -> None:
    x = np.linspace(0.0, 20.0, 21)
    bare = pd.DataFrame({"x_m": x, "z_m": 5.0, "part": "top", "share": 1.0})
    bare["ratio"] = np.linspace(0.2, 2.2, 21)
    calm = bare.assign(ratio=bare["ratio"] / 3)
    over = erosion.PILE / erosion.OVER_FLAT
    surfaces = [
        erosion.PileSurface(name, faces, over, threshold=1.12)
        for name, faces in (("no obstacle", bare), ("fence", calm))
    ]
    pile = erosion.Stockpile("heap", surfaces, is_flat=False, has_bare=True)
    assert surfaces[1].total([20.0]) == 0.0
    with style.settings(style.LETTERS):
        loss, stress = erosion.pictures([pile], [20.0])
        for figure in (loss, stress):
            assert figure.canvas is not None
            assert figure.narrow is not None
            letters.check(figure.canvas, figure.narrow())
    assert loss.canvas is not None
    classes, amounts = loss.canvas.axes
    bars = [patch for patch in classes.patches if patch.get_gid() == "fence, class 0.2"]
    (row,) = (
        row
        for row in erosion.erosion_rows([pile], [20.0]).to_dict("records")
        if (row["surface"], row["part"]) == ("fence", "all")
    )
    assert bars[0].get_width() == pytest.approx(row["0.2 (0.39), %"])  # type: ignore[attr-defined]
    said = [text.get_text() for text in amounts.texts]
    assert len(said) == 6
    assert said[0] == f"{surfaces[0].total([20.0]):#.2g}".rstrip(".")


def test_a_flat_bed_loses_what_the_log_law_takes(tmp_path: Path) -> None:
    text = (
        'method.flow.roughness = 0.005\nbed.kind = "flat"\ngrain.diameter = 1e-3\n'
        + WINDS
    )
    erosion.PileErosion(study.parse(text, name="", where="")).run(tmp_path, workers=1)
    table = pd.read_csv(tmp_path / "tables/erosion.csv")
    assert (table["u*/u*₀"] == 1).all()
    ustar = np.array(
        [0.41 * 20 / np.log(2001), 0.053 * 20]
    )  # 10 m/s is below the threshold
    assert table["P, g/m²"].unique() == pytest.approx(
        58 * (ustar - 0.6) ** 2 + 25 * (ustar - 0.6)
    )


def test_the_preset_is_run(tmp_path: Path) -> None:
    ended = erosion.PileErosion(study.load("stockpile")).run(tmp_path, workers=2)
    table = pd.read_csv(tmp_path / "tables/erosion.csv")
    lost = table[table["part"] == "all"].groupby("pile", sort=False)["P, g/m²"]
    (flat_top, fenced, *by_epa), (ridge, behind, *by_epa_again) = (
        group for _, group in lost
    )
    assert by_epa == by_epa_again
    assert max(fenced / flat_top, behind / ridge) < 0.7
    assert min(by_epa) < flat_top < max(by_epa)
    told = _sentences(ended.answer)[0]
    page = ended.page.read_text("utf-8").replace("\u00a0", " ")
    assert f"{flat_top:.3g} g/m²" in told in page
    # no line is longer than a terminal
    lines = ended.answer.splitlines()
    assert max(map(len, lines)) < 80
    # the card stands before the sentences
    assert ended.answer.startswith("How much dust does a wind of 20 m/s take")


def test_the_card_has_what_other_flows_change_and_what_they_do_not(
    tmp_path: Path,
) -> None:
    """The flat top lost 3.25 to 12.5 g/m² by other flows, the fence took 31 to 83 %."""
    asked = study.load("stockpile")
    ran = erosion.PileErosion(asked)
    ran.run(tmp_path, workers=2)
    found = erosion.grouped([*ran.flows], ran.least, tmp_path / "cases")
    card = erosion.erosion_card(found, asked.erosion.fastest_mile, "")
    change, loss, by_epa = card.numbers
    measured = erosion.FLOWS[erosion.FLOWS["heap"] == "flat top"]
    by = measured.pivot(index="flow", columns="obstacle", values="loss_g_m2")
    assert (loss.low, loss.high) == pytest.approx(
        (by["none"].min(), by["none"].max()), rel=0.01
    )
    assert loss.low < loss.value < loss.high
    assert "38 to 2,000 times" in loss.not_in
    ratios = 100 * (by["fence"] / by["none"] - 1)
    assert change.low < ratios.min()
    assert ratios.max() == pytest.approx(change.high, abs=1.0)
    assert change.low < change.value < change.high
    assert change.figure == "−76"
    assert loss.low < by_epa.value < by_epa.last < loss.high
    # what is not in the interval stands beside it
    said = " ".join(" ".join(lines(card)).split())
    assert "Not in it: wind-tunnel tests lost 38 to 2,000 times" in said


def test_what_is_wrong_is_said_in_one_message(tmp_path: Path) -> None:
    for asked, words in (
        ('erosion.threshold = "coal"', "one of: overburden"),
        ("erosion.threshold = 112.0", "m/s"),
        ("erosion.thresold = 1.0", "did you mean threshold"),
        ('bed.kind = "grain"', "there is no pile"),
        (
            'erosion.threshold = 0.6\nfluid.kind = "water"',
            "fluid.density: .* is no wind",
        ),
    ):
        text = "grain.diameter = 1e-3\n" + PILE * ("erosion" in asked) + asked
        with pytest.raises(InputError, match=words):
            erosion.PileErosion(study.parse(text, name="a", where="a"))


BARE, FENCE = "[]", '[{ kind = "fence", x = -4.0, height = 4.0 }]'
BLOCK = '[{ kind = "block", x = -6.0, height = 3.0 }]'


def _text(axes: str, flow: str = 'model = "solve", cells_per_face = 10') -> str:
    """A study of a small heap on axes, whose flow is quick to solve."""
    return f"""
erosion = {{ fastest_mile = [20.0], threshold = 0.6 }}
grain = {{ diameter = 1e-3, density = 1400.0 }}
fluid.kind = "air"
bed = {{ kind = "trapezoid", slope_deg = 37.0, height = 4.0, length = 4.0 }}
method.flow = {{ roughness = 0.005, {flow} }}
[axes]
{axes}
"""


def _sentences(answer: str) -> list[str]:
    """The sentences of an answer, one for each pile."""
    text = " ".join(answer.split()).partition(" The intervals apply")[0]
    return [f"Wind of {part.strip()}" for part in text.split("Wind of ")[1:]]


def _run(text: str, folder: Path) -> tuple[list[str], pd.DataFrame]:
    """The sentences of an answer, one for each pile, and the table of parts."""
    asked = study.parse(text, name="", where="")
    ended = erosion.PileErosion(asked).run(folder, workers=2)
    table = pd.read_csv(folder / "tables/erosion.csv")
    return _sentences(ended.answer), table[table["part"] == "all"].drop(columns="part")


def _change(sentence: str) -> str:
    """The part of a sentence after the pile without an obstacle."""
    return sentence.partition(" With a ")[2]


def test_piles_are_compared_that_differ_in_the_obstacle_alone(tmp_path: Path) -> None:
    """Each turbulence model has its own pile without a fence, in whatever order they stand."""
    models = '"method.flow.turbulence_model" = ["kOmegaSST", "kEpsilon"]'
    obstacles = f'"bed.obstacles" = [{FENCE}, {BARE}]'
    told, table = _run(_text(f"{models}\n{obstacles}"), tmp_path / "both")
    assert len(told) == 2
    for name, model, sentence in zip(
        ("k-ω SST", "k-ε"), ("kOmegaSST", "kEpsilon"), told, strict=True
    ):
        assert f"{name}; no obstacle)" in sentence
        alone, own = _run(
            _text(obstacles, f'turbulence_model = "{model}", cells_per_face = 10'),
            tmp_path / model,
        )
        assert len(alone) == 1
        assert _change(sentence) == _change(alone[0])
        rows = table[table["pile"].str.endswith(name)]
        assert rows["surface"].tolist()[:2] == [
            "no obstacle",
            "fence 4 m high at x = −4 m, solid",
        ]
        assert len(rows) == 6  # and the four piles of AP-42
        drop = ["pile"]
        assert (
            rows.drop(columns=drop).to_numpy().tolist()
            == own.drop(columns=drop).to_numpy().tolist()
        )
    left = [
        float(sentence.rpartition("(")[2].partition("%")[0].replace("−", "-"))
        for sentence in told
    ]
    fenced, bare = (table.iloc[row]["P, g/m²"] for row in (1, 0))
    assert left[0] == pytest.approx(100 * (fenced / bare - 1), abs=0.5)


def test_obstacles_are_not_compared_with_one_another(tmp_path: Path) -> None:
    """Without a bare pile no part is told that an obstacle takes away."""
    (told,), table = _run(_text(f'"bed.obstacles" = [{FENCE}, {BLOCK}]'), tmp_path)
    assert "; with a fence 4 m high at x = −4 m, solid)" in told
    assert " With a block 3 m high at x = −6 m: " in told
    assert "%" not in told
    assert table["surface"].tolist()[:2] == [
        "fence 4 m high at x = −4 m, solid",
        "block 3 m high at x = −6 m",
    ]


@pytest.mark.parametrize(
    ("axis", "words"),
    [
        ('"bed.length" = [4.0, 40.0]', ["length = 4 m", "length = 40 m"]),
        ('"bed.lee_slope_deg" = [20.0, 37.0]', ["lee slope = 20°", "lee slope = 37°"]),
        ('"bed.height" = [3.0, 4.0]', ["3 m high", "4 m high"]),
        ('"bed.roughness" = ["d/10", "d/30"]', ["z₀ = d/10", "z₀ = d/30"]),
        ('"method.flow.roughness" = [0.005, 0.01]', ["z₀ 5 mm", "z₀ 10 mm"]),
        ('"grain.diameter" = [1e-3, 2e-3]', ["d = 1 mm", "d = 2 mm"]),
        ('"threshold.fractions" = [[0.1], [0.2]]', [" (pile 2)"]),
        ('"method.kind" = ["pivot", "peeling"]', ["pivot", "peeling"]),
    ],
)
def test_each_pile_has_a_name_that_tells_it_from_the_others(
    axis: str, words: list[str]
) -> None:
    """Whatever differs: the rows of two piles are never taken for those of one."""
    asked = study.parse(
        _text(f"{axis}\n" + '"bed.obstacles" = [[]]'), name="", where=""
    )
    names = erosion.names_of(asked.scenes)
    assert len({*names}) == len(names) == 2
    for word in words:
        assert any(word in name for name in names), names


def test_ap42_answers_each_pile(tmp_path: Path) -> None:
    """A long heap is flat ground to AP-42, a short one beside it is not."""
    told, table = _run(_text('"bed.length" = [4.0, 40.0]', 'model = "flat"'), tmp_path)
    assert "by AP-42 " in told[0]
    assert "by AP-42, to which it is flat ground, " in told[1]
    of_epa = table[table["surface"].str.startswith("AP-42")]
    assert of_epa.groupby("pile", sort=False).size().tolist() == [4, 1]


def test_another_file_has_another_directory(tmp_path: Path) -> None:
    """All erosions have one directory by default: that of another file stays as it is."""
    first, second = tmp_path / "heap.toml", tmp_path / "heap2.toml"
    first.write_text(_text('"bed.length" = [4.0]', 'model = "flat"'))
    second.write_text(_text('"bed.length" = [5.0]', 'model = "flat"'))
    out = tmp_path / "results" / "erosion"
    run = [erosion.PileErosion(study.load(file)).run for file in (first, second)]
    page = run[0](out, workers=1).page
    before = page.read_bytes()
    with pytest.raises(
        InputError, match=r"the experiment erosion of another file, .*heap\.toml.*--out"
    ):
        run[1](out, workers=1)
    assert page.read_bytes() == before
    # the file itself may change, or go
    first.write_text(first.read_text().replace("4.0", "6.0"))
    erosion.PileErosion(study.load(first)).run(out, workers=1)
    first.unlink()
    run[1](out, workers=1)
    assert page.read_bytes() != before


def test_flows_that_were_solved_are_taken_and_the_plan_refuses_what_the_run_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("heap", "heap2"):
        Path(f"{name}.toml").write_text(_text('"bed.obstacles" = [[]]'))
    assert main(["erosion", "heap.toml"]) == 0
    first = capsys.readouterr().out
    # a second file has the default directory neither by the plan nor by the run
    for more in (["--plan"], []):
        assert main(["erosion", "heap2.toml", *more]) != 0
        assert "the experiment erosion of another file" in capsys.readouterr().err
    elsewhere = str(tmp_path / "far" / "away")
    assert main(["erosion", "heap2.toml", "--out", elsewhere, "--plan"]) == 0
    assert "to run: none" in capsys.readouterr().out
    assert main(["erosion", "heap2.toml", "--out", elsewhere]) == 0
    captured = capsys.readouterr()
    assert "1 case of other results taken" in captured.err
    assert captured.out.splitlines()[:-1] == first.splitlines()[:-1]
    # a copy that is damaged is no result: the flow is solved
    (table,) = (tmp_path / "results").glob("erosion/cases/*/bed_flow.csv")
    table.write_text(table.read_text() + "\n")
    shutil.rmtree(elsewhere)
    assert main(["erosion", "heap2.toml", "--out", elsewhere, "--plan"]) == 0
    assert "to run: flow 1" in capsys.readouterr().out
