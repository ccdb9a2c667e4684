"""The budget: which alternatives a scene has, how changes become shares, and its page."""

import math
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.errors import InputError
from orchestrator.lab import budget
from orchestrator.lab.budget import CHOICES
from orchestrator.report import style
from orchestrator.study import study
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from tests import letters

SMALL = """
grain = { diameter = 1e-3, sizes = { sigma_g = 1.2 } }
method.flow.model = "solve"
[bed]
kind = "pile"
slope_deg = 25.0
height = 0.007
roughness = "d/30"
packing = "poured"
"""
LEVEL = {"bed.shape": "flat", "bed.slope_deg": 0.0, "method.flow.model": "flat"}


@pytest.fixture(scope="module")
def scene() -> Scene:
    text = 'grain.diameter = 1e-3\nbed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }'
    return study.parse(text, name="one", where="test").scenes[0]


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: choice.name)
def test_an_alternative_changes_one_part_and_is_not_the_scene_itself(
    choice: budget.Choice, scene: Scene
) -> None:
    for bed in ({}, {"bed.packing": "poured"}):
        asked = changed(scene, bed)
        for _, other in choice.scenes(asked):
            parts = [
                p for p in Scene.model_fields if getattr(other, p) != getattr(asked, p)
            ]
            assert len(parts) == 1


@pytest.mark.parametrize(
    ("choice", "bed", "others"),
    [
        ("roughness length", {}, {"d/10"}),
        # neighbours of a pocket of more than 60 degrees would overlap
        ("entrainment angle", {}, {"-5°"}),
        ("entrainment angle", {"bed.entrainment_angle_deg": 52.0}, {"-5°", "+5°"}),
        ("entrainment angle", {"bed.packing": "poured"}, set()),
        ("exposure", {}, set()),
        ("first cell", LEVEL, set()),
        ("friction angle", LEVEL, {"-5°", "+5°"}),
        ("exposure", {"bed.packing": "poured"}, {"protrusion"}),
        (
            "packing",
            {"bed.packing": "poured"},
            {f"poured, seed {seed}" for seed in (1, 2, 3)},
        ),
    ],
)
def test_the_alternatives_are_those_that_a_scene_can_have(
    choice: str, bed: dict[str, object], others: set[str], scene: Scene
) -> None:
    (one,) = (one for one in CHOICES if one.name == choice)
    assert {name for name, _ in one.scenes(changed(scene, bed))} == others


def _moved(*changes: tuple[str, str, float], scene: str = "a") -> pd.DataFrame:
    row = {
        "scene_id": scene,
        "scene": scene,
        "model_class": "aligned, rough",
        "fraction": 0.3,
    }
    return pd.DataFrame(
        {
            **row,
            "choice": choice,
            "alternative": other,
            "shields": change,
            "ustar0": change / 2,
        }
        for choice, other, change in changes
    )


def test_the_share_of_a_choice_is_the_range_of_its_alternatives() -> None:
    moved = _moved(
        ("law", "a", 0.2),
        ("law", "b", 0.1),
        ("law", "no threshold", math.nan),
        ("cell", "half", -0.1),
        ("cell", "twice", 0.3),
    )
    shares = budget.shares_of_choices(moved).set_index("choice")
    assert list(shares.loc["law", ["shields_low", "shields_high"]]) == [0.0, 0.2]
    assert list(shares.loc["cell", ["shields_low", "shields_high"]]) == [0.1, 0.3]
    assert shares.loc["cell", "ustar0_high"] == pytest.approx(0.15)
    # of a class the largest is kept
    worse = budget.shares_of_choices(_moved(("law", "a", -0.4), scene="b"))
    known = budget.largest_shares(pd.concat([shares.reset_index(), worse])).set_index(
        "choice"
    )
    assert list(known.loc["law", ["shields_low", "shields_high", "scenes"]]) == [
        0.4,
        0.2,
        2.0,
    ]


def test_the_tornado_has_both_ends_of_each_choice_in_letters_to_read() -> None:
    moved = _moved(("law", "a", 0.2), ("law", "b", -0.1), ("cell", "half", 0.001))
    shares = budget.shares_of_choices(moved)
    largest = shares.groupby("choice", sort=False)[budget.ENDS].max()
    with style.settings(style.LETTERS):
        drawings = [budget.tornado(largest, width) for width in letters.SHOWN]
        letters.check(*drawings)
    for canvas in drawings:
        (ax,) = canvas.axes
        # what is not felt has no number; both are of one choice
        said = [text.get_text().strip() for text in ax.texts]
        assert sorted(set(said)) == ["−10 … +20", "−5 … +10"]
        names = [mark.get_text() for mark in ax.get_yticklabels()]
        assert names == ["cell", "law", "all together"]
        low, high = ax.get_xlim()
        assert low < -10
        assert high > 20


@pytest.mark.long
def test_every_choice_has_its_share_on_a_poured_pile(tmp_path: Path) -> None:
    asked = study.parse(SMALL, name="small", where="small")
    experiment = budget.Budget(asked, tmp_path / "out")
    assert not experiment.run(tmp_path / "out", workers=2).failures
    shared = pd.read_csv(tmp_path / "out" / "tables" / "shares.csv")
    names = {one.name for one in CHOICES} - {"entrainment angle"}
    assert set(shared["choice"]) == names
    ends = shared.groupby("choice")[["shields_low", "shields_high"]].max()
    largest = ends.sum(axis=1).to_dict()
    # the drag on the grains grows with z0, and another seed is another bed
    assert largest["roughness length"] > 0.1
    assert largest["packing"] > 0.1
    # a mean over a grain cannot feel half of 1/40 of the height
    assert largest["averaging length"] < 0.05
    page = (tmp_path / "out" / "report.html").read_text()
    assert all(name in page for name in names)
    assert experiment.run(tmp_path / "out", workers=2).started == 0


def test_a_study_without_piles_is_refused(tmp_path: Path) -> None:
    asked = study.parse("grain = { diameter = 1e-3 }", name="one", where="one")
    with pytest.raises(InputError, match="there is no pile"):
        budget.Budget(asked, tmp_path / "out")
