"""The domain of numerical errors: what the calibration varied, nothing beside it."""

import runpy
from collections import Counter
from io import StringIO
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from orchestrator.experiment import piles
from orchestrator.fidelity import domain
from orchestrator.fidelity.classes import FLOW, GRAINS, scene_class
from orchestrator.fidelity.decision import decide
from orchestrator.fidelity.fidelities import FIDELITIES, named
from orchestrator.fidelity.known import UNKNOWN, known
from orchestrator.fidelity.measured import FOLDER
from orchestrator.lab import calibration, ladder
from orchestrator.study import study
from orchestrator.study.criterion import ENTRAINED
from orchestrator.study.fields import FIELDS
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.tables import csv
from tests.fidelity.conftest import MakePile

ROOT = Path(__file__).parents[2]
TOOLS = ROOT / "tools"
SCENE_ERRORS = ROOT / "docs" / "measured" / "scene_errors.csv"
SPANNED = {
    *("fluid.density", "fluid.viscosity", "fluid.gravity", "flow.top", "flow.depth"),
    *("grain.density", "grain.diameter", "grain.sizes", "forces.law", "forces.stress"),
    *("bed.slope_deg", "bed.lee_slope_deg", "bed.height"),
    *(
        "bed.roughness",
        "bed.shape",
        "bed.windward",
        "bed.packing",
        "bed.disorder",
        "bed.obstacles",
    ),
    *("bed.counted", "threshold.criterion", "threshold.fractions", "fluid.kind"),
}
"""Fields of which the calibration has more than one value."""
UNTESTED = {
    *("bed.kind", "bed.profile", "bed.smoothing", "bed.forms", "bed.spacing"),
    *("bed.brink_radius", "bed.entrainment_angle_deg", "bed.length"),
    *("bed.relative_size", "bed.poured_depth", "bed.width"),
    "bed.dropped_grains",
    *("grain.friction_angle_deg", "grain.cohesion", "flow.gusts", "flow.towards"),
    *("forces.averaging_length", "forces.lift_coefficient", "forces.loaded_grains"),
    *("forces.exposure", "forces.sheltering"),
    *("method.flow.turbulence_model", "method.flow.convection_scheme"),
    *("method.flow.non_orthogonal_correctors", "method.flow.lid"),
    *("method.flow.upstream", "method.flow.downstream", "method.grains.damping"),
    *("threshold.displacement", "threshold.update"),
}
"""Fields that had one value, or none, in every scene: of another one no error is known."""


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """The stored domain."""
    return pd.read_csv(domain.FILE, keep_default_na=False, na_values=[""])


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the tools of the domain know: the piles beside DEM, and the pairs of rungs."""
    monkeypatch.syspath_prepend(TOOLS)
    return runpy.run_path(str(TOOLS / "domain.py"))


def test_the_stored_domain_is_that_of_the_scenes_that_were_measured(tools: Any) -> None:
    """A field that is new has its values here: `python tools/domain.py` writes it anew."""
    beside = tools["beside_dem"].scenes()
    made = csv(ladder.measured_domain(tools["pairs"](), beside))
    assert made == domain.FILE.read_text(encoding="utf-8")


def test_the_scenes_of_the_domain_are_those_of_the_errors(tools: Any) -> None:
    """Else scenes would count as measured that nobody has run."""
    counted: dict[str, set[tuple[str, str]]] = {FLOW: set(), GRAINS: set()}
    random_piles = tools["random_piles"]
    random = random_piles.load(random_piles.CALIBRATION, "peeling")
    measured = {**piles(study.load("ladder")), **piles(random)}
    for scene, bed in measured.items():
        # a pile of both criteria of motion is one
        pile = changed(scene, {"threshold.criterion": ENTRAINED}).id
        if not bed.is_level:
            counted[FLOW].add((scene_class(FLOW, scene), pile))
        if scene.method.kind == "dem":
            counted[GRAINS].add((scene_class(GRAINS, scene), pile))
    stored = pd.read_csv(SCENE_ERRORS).query("rung == 'reference'")
    for part, rows in stored.groupby("part"):
        found = Counter(rows["scene_class"])
        assert found == Counter(name for name, _ in counted[str(part)])
    beside = tools["beside_dem"].scenes()
    piles_ = Counter(scene_class(GRAINS, scene) for scene in beside)
    rows = pd.read_csv(SCENE_ERRORS).query("part == 'grains' and rung == 'static'")
    more = Counter(rows["scene_class"]) - Counter(
        stored.query("part == 'grains'")["scene_class"]
    )
    assert more == piles_


def test_the_stored_half_widths_are_those_of_the_errors_of_scenes() -> None:
    long = runpy.run_path(str(TOOLS / "calibration.py"))["long"]
    rows = long(pd.read_csv(SCENE_ERRORS))
    made = csv(calibration.half_widths(rows, ladder.AGAIN_OF))
    assert made == (FOLDER / "errors.csv").read_text(encoding="utf-8")


def test_every_field_was_varied_or_is_named_as_untested(table: pd.DataFrame) -> None:
    """A field that is new is in one of the two, or has a reason to stand apart."""
    of_quantity = {each.name: each.fields for each in domain.QUANTITIES}
    varied: set[str] = set()
    for name, rows in table.groupby("quantity"):
        least, most = rows["least"].min(), rows["most"].max()
        if most - least > domain.NEAR * most or rows["word"].nunique() > 1:
            varied.update(of_quantity[str(name)])
    apart = {name for names in domain.APART.values() for name in names}
    declared = {field.name for field in FIELDS}
    assert varied == SPANNED
    assert declared - apart == SPANNED | UNTESTED
    assert not apart & (SPANNED | UNTESTED)
    assert set(of_quantity) >= {*table["quantity"]}


def test_each_measured_scene_is_in_the_domain() -> None:
    for scene, bed in piles(study.load("ladder")).items():
        if not bed.is_level:
            assert domain.outside(FLOW, scene) == ""
        if scene.method.kind == "dem":
            assert domain.outside(GRAINS, scene) == ""
            assert known(named("paper"), scene) != UNKNOWN


def test_a_scene_of_another_scale_is_the_same(pile: MakePile) -> None:
    """Ten times as large, in a fluid in which it has the same Re* and Shields numbers."""
    fields = {"grain.diameter": 1e-2, "fluid.viscosity": 1e-5 * 10**1.5}
    larger = pile(fields, height=0.2, roughness=1e-2 / 30)
    for one in FIDELITIES:
        assert known(one, larger).total == pytest.approx(known(one, pile()).total)


def test_a_number_that_is_nearly_one_that_was_measured_counts(pile: MakePile) -> None:
    plain = known(named("static"), pile())
    for angle in (34.9999, 35.0001):
        near = pile({"grain.friction_angle_deg": angle})
        assert known(named("static"), near) == plain


def test_an_error_is_known_at_the_fractions_at_which_it_was_measured(
    pile: MakePile,
) -> None:
    scene = pile({"threshold.fractions": [0.05, 0.1, 0.4, 0.7, 0.9]})
    answer = decide(scene, 0.2)
    assert answer.is_chosen
    assert answer.error_estimate is not None
    below, *errors, above = map(answer.error_at, scene.threshold.fractions)
    assert below is above is None
    assert len({*errors}) == 3
    assert max(one for one in errors if one) == answer.error_estimate


def test_a_reason_names_the_field_and_what_was_measured(pile: MakePile) -> None:
    def why(scene: Scene) -> str:
        return decide(scene, 0.2).why

    assert "no error is known for grain.friction_angle_deg other than 35" in why(
        pile({"grain.friction_angle_deg": 20.0})
    )
    assert "bed.height/grain.diameter outside 10 … " in why(pile(height=0.5))
    assert "forces.law other than " in why(pile({"forces.law": "profile"}))
    assert why(pile({"flow.gusts": {"intensity": 0.4, "events": 100}})).endswith(
        "flow.gusts"
    )


def test_words_and_numbers_of_a_quantity_are_read_again(pile: MakePile) -> None:
    made = domain.of({GRAINS: [pile(), pile(slope_deg=20.0)]})
    again = pd.read_csv(StringIO(csv(made)), keep_default_na=False, na_values=[""])
    rows = again.set_index("quantity")
    assert (rows.loc["bed.slope_deg", ["least", "most"]] == [15.0, 20.0]).all()
    assert rows.loc["bed.profile", "word"] == domain.NONE
    assert not any(name.startswith("method.flow") for name in rows.index)
