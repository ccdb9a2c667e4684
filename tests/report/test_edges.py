"""Studies at the edges: thresholds of zero, several fluids and seeds, pictures that fail."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.bed.line import BedLine
from orchestrator.report import bed, flows, piles, shields, words
from orchestrator.report.results import FRACTION, Results
from tests import small_study
from tests.report.conftest import only, write


def changed(results: Results, **tables: pd.DataFrame) -> Results:
    return replace(results, tables={**results.tables, **tables})


def copies(results: Results, *changes: dict[str, Any]) -> Results:
    """The study's pile once for each set of changed columns, as a scene of its own."""
    heap = only(results, "pile")
    tables: dict[str, pd.DataFrame] = {}
    for name in ("scenes", "pile_threshold", "pile_curve"):
        own = heap.tables[name]
        tables[name] = pd.concat(
            [own.assign(scene_id=f"copy {n}", **one) for n, one in enumerate(changes)],
            ignore_index=True,
        )
    (pile,) = results.plan.piles.values()
    (decision,) = (results.plan.decisions[one] for one in results.plan.piles)
    ids = [f"copy {n}" for n in range(len(changes))]
    plan = replace(
        results.plan, piles=dict.fromkeys(ids, pile), decisions=dict.fromkeys(ids, decision)
    )
    return replace(heap, plan=plan, tables={**heap.tables, **tables})


@pytest.mark.parametrize("value", [0.0, -0.01, np.nan, np.inf])
@pytest.mark.parametrize("rows", ["one", "all"])
def test_a_threshold_without_a_place_on_a_logarithmic_axis_costs_no_figure(
    results: Results, value: float, rows: str
) -> None:
    own, curve = results.tables["pile_threshold"].copy(), results.tables["pile_curve"].copy()
    names = ["shields", "shields_low", "shields_high", "reynolds"]
    own.loc[own.index[: 1 if rows == "one" else None], names] = value
    curve.loc[curve.index[: 3 if rows == "one" else None], ["shields", "reynolds"]] = value
    heap = only(changed(results, pile_threshold=own, pile_curve=curve), "pile")
    drawn = [*shields.draw(heap), *piles.extended(heap), *piles.fractions(heap)]
    for figure in drawn:
        assert figure.canvas
        figure.canvas.draw_without_rendering()
    assert len(drawn) == (3 if rows == "one" else 1)


def test_the_picture_is_of_the_scene_that_the_sentence_is_about(results: Results) -> None:
    """Of a pile in water that is usable and one in air that is not, whatever their order."""
    air = {"rho_f_kg_m3": 1.2, "usable": False, "why_not": "smooth", "answered_method": "dem"}
    water = {"rho_f_kg_m3": 1e3, "usable": True, "why_not": "", "answered_method": "peeling"}
    for both in ((air, water), (water, air)):
        study = copies(results, *both)
        row, _ = next(bed.chosen(study))
        assert row["rho_f_kg_m3"] == 1e3
        (figure,) = bed.draw(study)
        assert "1000 kg/m³" in figure.title
        assert any("1000 kg/m³" in sentence for sentence in words.sentences(study))


def test_each_fluid_has_a_row_and_a_sentence(results: Results) -> None:
    fluids: list[dict[str, Any]] = [
        {"rho_f_kg_m3": rho, "d_m": 1e-3 * (1 + n), "usable": True}
        for rho in (1.2, 1e3)
        for n in range(words.FEW)
    ]
    study = copies(results, *fluids)
    sheet = words.short(study)
    assert sheet is not None
    assert len(sheet) == 2
    said = " ".join(words.sentences(study))
    assert "1.2 kg/m³" in said
    assert "1000 kg/m³" in said
    grains = only(results, "grain").tables
    wet = grains["scenes"].assign(rho_f_kg_m3=1e3, scene_id="wet " + grains["scenes"]["scene_id"])
    moved = grains["single_grain"].assign(
        scene_id="wet " + grains["single_grain"]["scene_id"].astype(str)
    )
    both = changed(
        results,
        scenes=pd.concat([grains["scenes"], wet]),
        single_grain=pd.concat([grains["single_grain"], moved]),
    )
    one, two = words.grains(only(results, "grain")), words.grains(both)
    assert one is not None
    assert two is not None
    assert len(two) == 2 * len(one)


def test_seeds_are_one_row_with_their_range(results: Results) -> None:
    thetas = (0.04, 0.05, 0.09)
    study = copies(
        results, *({"seed": n, "packing": "disordered", "shields": t} for n, t in enumerate(thetas))
    )
    sheet = words.short(study)
    assert sheet is not None
    (row,) = sheet.to_numpy().tolist()
    assert {"3 of 3", "0.0400 … 0.0900"} <= set(row)
    first, *_ = words.sentences(study)
    assert "τ_c = 0.06 in the mean of 3 seeds (0.04 … 0.09)" in first


def test_the_lines_beside_piles_have_the_roughness_of_the_piles(results: Results) -> None:
    """Single grains on d/10 fit the measurements better; the piles are on d/30."""
    (figure,) = shields.draw(results)
    assert figure.canvas
    said = [text.get_text() for legend in figure.canvas.legends for text in legend.texts]
    lines = [text for text in said if text.startswith("Eq.")]
    assert len(lines) == 2
    assert all(text.endswith("β = 60°, z₀ = d/30") for text in lines)


def test_the_stress_on_grains_is_not_joined_across_a_gap(results: Results) -> None:
    grains = results.tables["pile_grain"].sort_values("s_m")
    gap = grains.drop(grains.index[10:20])
    (figure,) = flows.stress(changed(results, pile_grain=gap))
    assert figure.canvas
    (line,) = (one for one in figure.canvas.axes[0].lines if one.get_gid() == "grains")
    felt = np.asarray(line.get_ydata(), float)
    assert np.flatnonzero(np.isnan(felt)).tolist() == [10]
    assert felt[~np.isnan(felt)].tolist() == gap["ustar_over_ustar0"].tolist()


@pytest.mark.parametrize(
    ("x", "z", "marks"),
    [
        ((-5, 0, 4, 6, 10), (0, 0, 1, 0, 0), {"toe": 0, "crest": 4, "lee toe": 6}),
        ((-5, 0, 4, 10), (0, 0, 1, 1), {"toe": 0, "crest": 4}),
        ((-5, 0, 4, 10), (0, 0, -1, -1), {"crest": 0, "lee toe": 4}),
        ((-5, 0, 10), (0, 0, 0), {}),
    ],
)
def test_marks_are_where_the_form_is(
    x: tuple[float, ...], z: tuple[float, ...], marks: dict[str, float]
) -> None:
    line = BedLine(x, z, 1.0)
    assert {name: line.x[at] for name, at in flows.corners(line).items()} == marks


def test_the_lee_toe_of_a_noisy_profile_is_not_the_end_of_its_file() -> None:
    x = np.linspace(0, 20, 401)
    noise = np.random.default_rng(0).normal(0, 0.01, len(x))
    z = np.interp(x, [0, 3, 14.5, 17, 20], [0, 0, 1, 0, 0]) + noise
    line = BedLine((-5, *x, 25), (z[0], *z, z[-1]), 1.0)
    marks = {name: line.x[at] for name, at in flows.corners(line).items()}
    assert marks == pytest.approx({"toe": 3, "crest": 14.5, "lee toe": 17}, abs=0.6)


LEVEL = """
title = "A level bed"
grain = { diameter = 1e-3 }
bed = { kind = "pile", shape = "flat", length = 0.05 }
flow = { model = "flat" }
protocol = { method = "peeling" }
"""


@pytest.fixture(scope="module")
def level(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return small_study.run(tmp_path_factory.mktemp("level"), LEVEL)


def test_no_program_is_named_that_did_not_run(level: Results, results: Results) -> None:
    (figure,) = bed.draw(level)
    assert "OpenFOAM" not in figure.caption
    assert "blue" not in figure.caption
    (pile,) = results.plan.piles.values()
    assert "OpenFOAM" in bed.words(results, pile)


def test_the_slider_of_a_long_bed_has_few_stops(
    results: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    (pile,) = results.plan.piles.values()
    rules = pile.scene.protocol.model_copy(update={"method": "peeling"})
    pile = replace(pile, scene=pile.scene.model_copy(update={"protocol": rules}))
    every = bed.read(pile, results.cases)
    monkeypatch.setattr(bed, "STOPS", 5)
    few = bed.read(pile, results.cases)
    assert len(few.places) <= 6 < len(every.places)
    assert few.moved(len(few.places) - 1) == every.moved(len(every.places) - 1)
    share = pile.packing.count * FRACTION
    at = few.first(FRACTION)
    assert few.moved(at) == every.moved(every.first(FRACTION)) >= share
    assert ((few.level > 0) & (few.level <= at)).sum() == few.moved(at)


def test_the_speed_of_the_flow_is_that_at_ten_heights(results: Results) -> None:
    """|u|/U_e is 1 at 10 h far upstream; at the lid it is a quarter more."""
    (pile,) = results.plan.piles.values()
    window = (-60.0, -59.0, 10.0, 10.1)
    speed = np.linalg.norm(flows.over_u_e(pile, results.cases, window, pile.bed.height), axis=-1)
    assert np.nanmean(speed) == pytest.approx(1, abs=0.02)
    (figure,) = flows.flow(results)
    assert figure.canvas
    assert "at 10 h" in figure.canvas.axes[-1].get_xlabel()
    assert "lid" not in figure.canvas.axes[-1].get_xlabel()


@pytest.mark.parametrize("error", [MemoryError, ValueError])
def test_a_figure_that_fails_costs_that_figure_and_a_line(
    results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Callable[..., object]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error("26.5 GiB for <an array>")  # type: ignore[misc]

    monkeypatch.setattr(bed, "read", fail)
    (tmp_path / "cases").symlink_to(results.cases)
    html = write(only(results, "pile"), tmp_path, {}).read_text(encoding="utf-8")
    assert 'id="shields"' in html
    assert 'id="bed-alpha15"' not in html
    assert "26.5 GiB for &lt;an array&gt;" in html
    assert "times the stress of a single one" in html
