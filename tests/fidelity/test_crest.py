"""What a page says of the mesh at a crest is what was measured, and of such piles alone."""

from pathlib import Path

import pandas as pd
import pytest

from orchestrator.fidelity import crest
from orchestrator.study import study

TABLE = Path(__file__).parents[2] / "docs" / "measured" / "flow_crest.csv"
PILE = 'grain.diameter = 1e-3\nbed = { kind = "pile", slope_deg = 15.0, roughness = "d/30" }'


def test_the_changes_are_those_of_the_table() -> None:
    table = pd.read_csv(TABLE)
    grain = table["averaged over, h"] == table["averaged over, h"].min()
    with_first_cell = table["refined"] == "mesh and first cell"
    rows = table[grain & with_first_cell]
    assert len(rows[["slope", "z0, m"]].drop_duplicates()) == crest.PILES
    for threshold, ends in (("first motion", crest.FIRST_GRAIN), ("10 %", crest.TENTH)):
        of_one = rows.loc[rows["threshold"] == threshold, "own to fine"]
        changes = of_one.str.removesuffix(" %").astype(float) / 100
        assert len(changes) == crest.PILES
        assert ends == pytest.approx((changes.min(), changes.max()), abs=5e-4)


@pytest.mark.parametrize(
    ("text", "is_sharp"),
    [
        (PILE, True),
        (f'{PILE}\nmethod.flow.model = "waves"', False),
        (PILE.replace("slope_deg", 'shape = "cosine", slope_deg'), False),
        ("grain.diameter = 1e-3", False),
    ],
)
def test_a_sharp_crest_is_an_edge_under_a_solved_flow(
    text: str, is_sharp: bool
) -> None:
    (scene,) = study.parse(text, name="one", where="one").scenes
    assert crest.has_sharp_crest(scene) is is_sharp
