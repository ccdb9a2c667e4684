"""What a reader sees of a figure: letters of 12 pixels, few entries in a legend."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas

from orchestrator.report import figures, shields, style, theory
from orchestrator.report.figures import where
from orchestrator.report.results import Results
from tests import letters


def drawings(results: Results) -> dict[str, Canvas]:
    """Every drawing of a study, those for a narrow page too."""
    found = {}
    with style.settings(style.LETTERS):
        for kind in figures.kinds():
            for figure in kind.draw(results):
                if figure.canvas is not None:
                    found[figure.name] = figure.canvas
                if figure.narrow:
                    found[f"{figure.name}, narrow"] = figure.narrow()
        for canvas in found.values():
            canvas.draw_without_rendering()
    return found


@pytest.fixture(scope="module")
def drawn(results: Results) -> dict[str, Canvas]:
    return drawings(results)


def test_every_letter_of_a_figure_is_12_pixels_high_as_it_is_shown(
    drawn: dict[str, Canvas],
) -> None:
    assert {"shields", "share", "flow"} <= drawn.keys()
    small = {name: letters.small(canvas) for name, canvas in drawn.items()}
    assert {name: texts for name, texts in small.items() if texts} == {}


def test_no_legend_has_more_entries_than_a_reader_tells_apart(
    drawn: dict[str, Canvas],
) -> None:
    entries = {name: letters.entries(canvas) for name, canvas in drawn.items()}
    most = letters.MOST
    assert {name: said for name, said in entries.items() if len(said) > most} == {}


def test_separation_and_reattachment_are_where_the_stress_changes_its_sign() -> None:
    x = np.arange(0.0, 11.0)
    ustar = np.array([-1.0, 1, 1, -1, -1, -1, -1, 3, 1, -1, 1])
    found = where.ends_of_reversed(x, ustar, 2.0)
    assert found == [("S", 2.5), ("R", pytest.approx(6.25))]
    assert len(where.ends_of_reversed(x, ustar, 0.1)) == 4
    assert where.ends_of_reversed(x, np.abs(ustar), 0.1) == []
    # what runs back to the end of the bed does not reattach on it
    assert where.ends_of_reversed(x[:5], ustar[:5], 0.1) == []


CONFUSED = {
    "protanope": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranope": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
}  # fmt: skip
"""What they see of linear light: Machado, Oliveira and Fernandes 2009, severity 1."""
XYZ = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
APART = 15.0


def seen(colour: str, matrix: object) -> np.ndarray:
    """A colour in CIE L*a*b*."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    light = np.clip(np.array(matrix) @ linear, 0, 1)
    x, y, z = np.cbrt(np.array(XYZ) @ light / np.sum(XYZ, axis=1))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("who", CONFUSED)
def test_laws_differ_by_dash_or_by_a_colour_that_all_tell_apart(who: str) -> None:
    alike = []
    for (one, dash), (other, another) in combinations(theory.LOOKS, 2):
        far = np.linalg.norm(seen(one, CONFUSED[who]) - seen(other, CONFUSED[who]))
        if dash == another and far < APART:
            alike.append((one, other, dash, far))
    assert alike == []


def test_a_curve_is_broken_where_it_jumps() -> None:
    x = np.geomspace(1, 100, 41)
    smooth = np.array([x, 0.1 / x])
    assert shields.jumps_of(smooth).tolist() == []
    broken = smooth.copy()
    broken[1, 4:] *= 8
    assert shields.jumps_of(broken).tolist() == [4]
