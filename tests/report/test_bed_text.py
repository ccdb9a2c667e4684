"""The bed in two lines of a terminal."""

import numpy as np
import pytest

from orchestrator.report import bed_text, single, words
from orchestrator.report.bed_text import BLOCKS, COLUMNS, HEAD, bed_lines
from orchestrator.report.results import Results
from orchestrator.runs import terminal
from tests.report.conftest import changed, only


def test_the_bed_stands_over_the_point_of_first_motion(results: Results) -> None:
    heap = only(results, "pile")
    heights, places = bed_lines(heap)
    row = heap.exemplars.iloc[0]
    assert heights.startswith(f"  {single.quantity_of_row(row).flow} ->")
    drawn = heights[HEAD:]
    assert len(drawn) == COLUMNS
    assert set(drawn) <= set(BLOCKS)
    line = next(iter(heap.plan.piles.values())).model.line
    # the highest letters are those of the crest
    x = np.linspace(line.x[1], line.x[-2], COLUMNS)
    tops = [x[at] for at, letter in enumerate(drawn) if letter == BLOCKS[-1]]
    assert min(tops) <= line.crest[0] <= max(tops)
    column = places.index("^") - HEAD
    step = x[1] - x[0]
    assert x[column] == pytest.approx(float(row["first_x_m"]), abs=0.51 * step)
    assert f"^ {1e3 * row['first_x_m']:.3g} mm" in places
    said = words.answer_text(heap)
    assert heights in said
    plain = terminal.plain(said)
    assert max(map(len, plain.splitlines())) < 80


def test_a_level_bed_has_no_such_lines(results: Results) -> None:
    heap = only(results, "pile")
    level = heap.tables["scenes"].assign(bed_shape="flat")
    assert [*bed_lines(changed(heap, scenes=level))] == []
    assert [*bed_lines(only(results, "grain"))] == []


@pytest.mark.parametrize("column", [0, 3, 20, COLUMNS - 3, COLUMNS - 1])
def test_an_end_gives_way_to_the_point(column: int) -> None:
    said = bed_text._labelled("0", "^ 74.6 mm", column, "149 mm")
    assert said.index("^ 74.6 mm") == column
    assert said.startswith("0 ") == (column > 1)
    assert ("149 mm" in said) == (column < COLUMNS - 15)
