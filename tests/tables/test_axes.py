"""Tables and cards of profiles: x and z are those of the user's file."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.report import answers
from orchestrator.report.card import lines
from orchestrator.report.figures import where
from orchestrator.report.results import Results
from tests import small_study

MIDDLE = 300.0
"""A profile and its mirror image lie about this x, m."""
STUDY = """
fluid.kind = "air"
grain = {{ diameter = 2.5e-4, density = 2650.0 }}
bed = {{ kind = "pile", profile = "scan.csv", smoothing = 1.0 }}
flow.towards = "{towards}"
method.flow.model = "waves"
[profiles]
"scan.csv" = '''{rows}'''
"""


def surveyed(out: Path, towards: str) -> Results:
    """The answer for a dune under a wind, by the theory that needs no solver."""
    x = np.linspace(0, 60, 301)
    z = 2.29 + 3 * np.exp(-(((x - 32) / np.where(x < 32, 14.0, 9.0)) ** 2))
    x += 112.4
    if towards == "-x":
        x, z = 2 * MIDDLE - x[::-1], z[::-1]
    points = zip(x.tolist(), z.tolist(), strict=True)
    rows = "\n".join(["x_m,z_m", *(f"{a:.3f},{b:.5f}" for a, b in points), ""])
    return small_study.run(out, STUDY.format(towards=towards, rows=rows))


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Results, Results]:
    out = tmp_path_factory.mktemp("axes")
    return surveyed(out / "one", "+x"), surveyed(out / "other", "-x")


def test_a_bed_and_its_mirror_image_move_at_the_same_surveyed_places(
    both: tuple[Results, Results],
) -> None:
    one, other = both
    for name, places in {
        "pile_threshold": ["first_x_m", "pivot_x_m"],
        "pile_grain": ["x_m"],
    }.items():
        table = one.tables[name]
        mirrored = other.tables[name]
        for column in places:
            np.testing.assert_allclose(
                table[column], 2 * MIDDLE - mirrored[column], rtol=0, atol=1e-9
            )
        rest = table.columns.difference(["scene_id", *places])
        assert table[rest].equals(mirrored[rest])
    first = one.tables["pile_threshold"]["first_x_m"].iloc[0]
    # the top of the dune lies at 144.4 m
    assert 140 < first < 146


def test_the_card_and_the_picture_have_x_of_the_file(
    both: tuple[Results, Results],
) -> None:
    for results in both:
        first = results.tables["pile_threshold"]["first_x_m"].iloc[0]
        card = answers.card(results)
        (place,) = (number for number in card.numbers if number.unit == "m")
        assert place.figure == f"{first:.1f}"
        told = "\n".join(lines(card))
        assert f"{first:.1f} m" in told
        assert any(f"at {first:.1f} m" in text for text in _texts(results))
    assert "wind towards -x" in answers.card(both[1]).scene
    assert "← flow" in _texts(both[1])


def _texts(results: Results) -> list[str]:
    """The texts in the picture that leads."""
    (figure,) = where.FIGURE.draw(results)
    assert figure.place == "lead"
    assert figure.canvas
    return [text.get_text() for ax in figure.canvas.axes for text in ax.texts]
