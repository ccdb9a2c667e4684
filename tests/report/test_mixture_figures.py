"""Pictures of a mixture, and of the fraction entrained against the flow."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.report import single, units
from orchestrator.report.figures import fractions, mobility
from orchestrator.report.results import Results
from tests import small_study
from tests.report.conftest import axes_of

MIXTURE = """
title = "A mixture"
fluid = { density = 1000.0, viscosity = 1e-6 }
grain = { density = 2650.0, sizes = [[5e-4, 0.3], [1e-3, 0.4], [2e-3, 0.3]] }
method.kind = "peeling"
[bed]
kind = "pile"
shape = "flat"
packing = "poured"
length = 0.05
roughness = "d84/30"
[axes]
"bed.seed" = [1, 2]
"""


@pytest.fixture(scope="module")
def mixture(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return small_study.run(tmp_path_factory.mktemp("mixture"), MIXTURE)


def test_each_size_of_each_bed_has_its_fraction(mixture: Results) -> None:
    (figure,) = mobility.FIGURE.draw(mixture)
    (ax,) = axes_of(figure)
    drawn = [
        float(value)
        for line in ax.lines
        if line.get_gid() == "mobility"
        for value in np.asarray(line.get_ydata())
    ]
    classes = mixture.tables["size_class"]
    row = mixture.exemplars.iloc[0]
    here = classes[classes["fraction"] == row["fraction"]]
    assert here["scene_id"].nunique() == 2
    assert sorted(drawn) == sorted(100 * here["class_moved"])
    (equal,) = (line for line in ax.lines if line.get_gid() == "equal mobility")
    assert np.asarray(equal.get_ydata()).tolist() == [100 * row["fraction"]] * 2
    labels = [text.get_text() for text in ax.get_xticklabels()]
    assert labels == ["0.5", "1", "2"]


def test_the_caption_says_which_size_goes_first() -> None:
    beds = pd.DataFrame({"scene_id": ["a", "b"]})
    classes = pd.DataFrame(
        {
            "scene_id": ["a", "a", "b", "b"],
            "size_over_d": [0.5, 2.0, 0.5, 2.0],
            "few": [False] * 4,
            "class_moved": [0.5, 0.1, 0.6, 0.2],
        }
    )
    assert "Fine grains" in mobility.trend(classes, beds)
    other = classes.assign(class_moved=[0.1, 0.5, 0.2, 0.6])
    assert "Coarse grains" in mobility.trend(other, beds)
    mixed = classes.assign(class_moved=[0.1, 0.5, 0.6, 0.2])
    assert "differs" in mobility.trend(mixed, beds)
    few = classes.assign(few=True)
    assert "not known" in mobility.trend(few, beds)


def test_the_fraction_rises_with_the_flow(mixture: Results) -> None:
    """Against the flow a curve cannot run backwards, as it may against its mean stress."""
    figure = next(
        one
        for one in fractions.FIGURE.draw(mixture)
        if one.name.startswith("fractions-flow")
    )
    assert figure.place == ""
    (ax,) = axes_of(figure)
    row = mixture.exemplars.iloc[0]
    told = single.quantity_of_row(row)
    assert ax.get_xlabel() == f"{told.name}, {told.unit}"
    curve = mixture.tables["pile_curve"]
    lines = {str(line.get_gid()): line for line in ax.lines}
    for scene_id in curve["scene_id"].unique():
        points = curve[(curve["scene_id"] == scene_id) & (curve["moved"] > 0)]
        points = points[points["shields"] > 0]
        x = np.asarray(lines[scene_id].get_xdata(), float)
        assert np.all(np.diff(x) >= 0)
        flow = units.told_by(row, points["ustar0_m_s"], told)
        np.testing.assert_allclose(x, flow)
