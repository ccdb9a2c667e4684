"""Rows that differ in a study's own axes are told apart, in figures and on the page."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from orchestrator.report import flows, labels, piles, shields, words
from orchestrator.report.results import Results
from orchestrator.report.shields import SHAPE
from orchestrator.study import fields
from tests.report.conftest import only

SHOWN = ("alpha_deg", "d_m")


@pytest.fixture
def table() -> pd.DataFrame:
    """Piles of two slopes, by two numbers of layers and two stiffnesses."""
    return pd.DataFrame(
        {
            "alpha_deg": [15.0, 15.0, 15.0, 25.0],
            "d_m": 1e-3,
            "force_law": "high",
            "mobile_layers": [1, 2, 1, 1],
            "stiffness": [1e3, 1e3, 1e4, 1e3],
            "load_increment": [0.02, 0.03, 0.02, 0.02],
            "seed": [1, 2, 3, 4],
        }
    )


def test_fields_that_tell_rows_apart(table: pd.DataFrame) -> None:
    assert labels.varying(table, *SHOWN) == ["stiffness", "mobile_layers"]
    assert labels.varying(table, *SHOWN, "mobile_layers") == ["stiffness"]
    assert labels.varying(table.iloc[[0, 3]], *SHOWN) == []


def test_the_method_comes_before_the_fields_that_it_alone_has() -> None:
    beds = pd.DataFrame(
        {
            "alpha_deg": 0.0,
            "rho_f_kg_m3": [1000.0, 1000.0, 1.2, 1000.0],
            "stiffness": [np.nan, np.nan, np.nan, 1e3],
            "method": ["pivot", "peeling", "peeling", "dem"],
            "update": [np.nan, 0.0, 0.0, 0.0],
        }
    )
    assert labels.varying(beds, "alpha_deg") == ["rho_f_kg_m3", "method"]


def test_what_is_asked_parts_panels_and_what_answers_has_markers(table: pd.DataFrame) -> None:
    asked = table.assign(stiffness=1e3, packing=["aligned", "aligned", "horizontal", "aligned"])
    panels, rows, entries = shields.parted(asked, *SHOWN)
    assert panels == ["packing"]
    assert rows[SHAPE].tolist() == ["s", "D", "s", "s"]
    names = [one[0].get_label() for one in entries if isinstance(one, tuple)]
    assert names == ["mobile layers = 1", "mobile layers = 2"]


@pytest.fixture(scope="module")
def two(results: Results) -> Results:
    """The study's pile, and the same on one layer more."""
    heap = only(results, "pile")
    tables = {}
    for name, own in heap.tables.items():
        if "scene_id" in own:
            other = own.assign(scene_id="another")
            if name == "scenes":
                other = other.assign(mobile_layers=2, answered_mobile_layers=2)
            own = pd.concat([own, other], ignore_index=True)
        tables[name] = own
    return replace(heap, tables=tables)


def test_curves_and_points_of_two_layers_are_told_apart(two: Results) -> None:
    for figure in (*piles.fractions(two), *piles.extended(two)):
        assert figure.canvas is not None
        ax = figure.canvas.axes[0]
        ids = (*two.scenes["scene_id"], *shields.RESULT[1:])
        drawn = {line.get_marker() for line in ax.lines if line.get_gid() in ids}
        assert drawn == {"s", "D"}
        said = [text.get_text() for legend in figure.canvas.legends for text in legend.texts]
        assert {"mobile layers = 1", "mobile layers = 2"} <= set(said)


def test_rows_of_two_layers_are_told_apart(two: Results) -> None:
    sheet = words.piles(two)
    assert sheet is not None
    assert set(sheet["mobile layers"]) == {"1", "2"}


def test_page_lists_every_parameter(results: Results) -> None:
    sheet = words.parameters(results)
    listed = sheet["in a study file"].tolist()
    scenes = results.scenes
    asked_for = [column for column in fields.COLUMNS if scenes[column].notna().any()]
    assert set(listed) >= {fields.COLUMNS[column].name or column for column in asked_for}
    asked = dict(zip(listed, sheet.to_numpy().tolist(), strict=True))
    assert asked["flow.turbulence_model"][3:] == ["kEpsilon", ""]
    assert asked["flow.first_cell_height"][3] == "default"
    assert float(asked["flow.first_cell_height"][4]) > 0


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("alpha_deg", 15.0, "α = 15°"),
        ("alpha_deg", 10.463, "α = 10.46°"),
        ("z0_over_d", 0.033333333, "z₀ = d/30"),
        ("d_m", 7e-4, "d = 0.7 mm"),
        ("turbulence_model", "RNGkEpsilon", "RNG k-ε"),
        ("convection_scheme", "upwind", "convection scheme upwind"),
        ("mobile_layers", 3, "mobile layers = 3"),
        ("waiting_time", 6.0, "waiting time = 6 √(d/g′)"),
        ("averaging_length", 0.05, "averaging length = h/20"),
        ("fraction", 0.3, "n/N = 30 %"),
    ],
)
def test_values_with_their_symbols(column: str, value: object, said: str) -> None:
    assert labels.plain(column, value) == said


def test_flows_by_two_models_have_a_panel_each(results: Results) -> None:
    heap = only(results, "pile")
    ((name, pile),) = heap.plan.piles.items()
    flow = pile.scene.flow.model_copy(update={"turbulence_model": "RNGkEpsilon"})
    other = replace(pile, scene=pile.scene.model_copy(update={"flow": flow}))
    ours = {"scene_id": "another", "turbulence_model": "RNGkEpsilon"}
    scenes, bed = heap.tables["scenes"], heap.tables["wall_stress"]
    theirs = {"flow_case": other.flow.name}
    tables = {
        **heap.tables,
        "scenes": pd.concat([scenes, scenes.assign(**ours)], ignore_index=True),
        "wall_stress": pd.concat([bed, bed.assign(**theirs)], ignore_index=True),
    }
    plan = replace(heap.plan, piles={name: pile, "another": other})
    (figure,) = flows.stress(replace(heap, tables=tables, plan=plan))
    assert figure.canvas is not None
    titles = [ax.get_title(loc="left") for ax in figure.canvas.axes]
    assert [title.rpartition(", ")[2] for title in titles if title] == ["RNG k-ε", "k-ε"]
    assert len(figure.cases) == 2
