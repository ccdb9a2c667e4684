"""Beds of other shapes from their study file to the map of their grains' thresholds."""

from dataclasses import replace

import numpy as np
import pytest

from orchestrator.report import bed, flows
from orchestrator.report.results import Results
from tests import small_study

TRAIN = """
title = "Two ripples"
grain = { diameter = 1e-3 }
protocol = { method = "peeling" }
flow = { cells_per_face = 10 }
[bed]
kind = "pile"
shape = "dune"
slope_deg = 15.0
height = 0.01
forms = 2
mobile_layers = 1
obstacles = [{ kind = "fence", x = -0.03, height = 0.004 }]
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return small_study.run(tmp_path_factory.mktemp("where"), TRAIN)


def test_each_form_of_a_train_has_its_thresholds(results: Results) -> None:
    table = results.tables["form"]
    assert list(table["form"].unique()) == [1, 2]
    assert table["count"].sum() / 4 == results.tables["pile_threshold"]["count"].iloc[0]
    first, second = (table[table["form"] == form].set_index("fraction") for form in (1, 2))
    assert (first["over_first_form"] == 1).all()
    np.testing.assert_allclose(
        second["over_first_form"], second["ustar0_m_s"] / first["ustar0_m_s"]
    )
    assert (np.diff(first["ustar0_m_s"]) >= 0).all()


def test_the_map_shows_every_grain_at_its_place(results: Results) -> None:
    (figure,) = flows.where(results)
    grains = results.tables["pile_grain"]
    (dots,) = (
        artist
        for part in figure.canvas.subfigs  # type: ignore[union-attr]
        for axes in part.axes
        for artist in axes.collections
        if artist.get_gid() == "thresholds"
    )
    shown = np.asarray(dots.get_offsets())
    goes = grains[grains["ustar0_m_s"].notna()]
    np.testing.assert_allclose(shown[:, 0], goes["x_m"] / 0.01)
    np.testing.assert_allclose(shown[:, 1], goes["ustar0_m_s"])


def test_the_picture_of_a_long_train_shows_single_grains(results: Results) -> None:
    (pile,) = results.plan.piles.values()
    assert "Shown" not in bed.words(results, pile)
    five = pile.scene.model_copy(update={"bed": pile.bed.model_copy(update={"forms": 20})})
    train = replace(pile, scene=five)
    assert float(train.line.toe[0]) > bed.WHOLE * bed.LONG
    left, right, *_ = bed.window(train)
    assert right - left == pytest.approx(bed.LONG)
    assert left < float(train.line.crest[0]) < right
    assert "of the first form" in bed.words(results, train)
