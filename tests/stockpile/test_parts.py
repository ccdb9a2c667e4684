"""The parts of a pile that erosion tells apart lie where the wind meets and leaves it."""

from pathlib import Path

import pytest

from orchestrator.stockpile import erosion
from orchestrator.study import study


@pytest.mark.parametrize("lee", [30.0, 12.0])
def test_the_windward_side_comes_before_the_lee(tmp_path: Path, lee: float) -> None:
    """The sides have other slopes, and so other lengths: exchanged, all is off."""
    bed = f'kind = "pile", slope_deg = 20.0, lee_slope_deg = {lee}, height = 2.0'
    text = f'bed = {{ {bed} }}\ngrain.diameter = 0.01\nmethod.flow.model = "waves"\n'
    (scene,) = study.parse(text, name="pile", where="test").scenes
    faces = erosion.solved(scene, 1.0, tmp_path).faces
    crest = float(faces["x_m"].iloc[int(faces["z_m"].argmax())])
    assert (faces.loc[faces["part"] == "windward", "x_m"] <= crest + 1e-6).all()
    assert (faces.loc[faces["part"] == "lee", "x_m"] >= crest - 1e-6).all()
    lengths = faces.groupby("part")["share"].sum()
    is_longer = lengths["windward"] > lengths["lee"]
    assert is_longer == (lee > 20.0)
